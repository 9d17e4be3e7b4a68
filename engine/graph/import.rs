//! Resources that someone else owns.

use ash::vk;

use super::{
    Graph,
    format::{Extent, Format, ImageDesc},
    handles::{Buffer, Image},
    pass::{Imported, Origin, Owner},
    vocab::Layout,
    vulkan,
};
use crate::gpu::{OwnedBuffer, OwnedImage};

impl Graph {
    /// An image that outlives the graph, which keeps it alive and leaves it in the layout in which it found it. If it was
    /// never written, a pass must write it first. Importing it twice gives the same handle.
    pub fn import_image(&mut self, image: &OwnedImage) -> Image {
        let same = |o: &Origin| matches!(o, Origin::Imported(Imported { owner: Owner::Image(i), .. }) if i.raw() == image.raw());
        if let Some(index) = self.images.iter().position(|i| same(&i.origin)) {
            return self.whole_image(index as u32);
        }
        let desc = image.desc();
        let usage = desc.usage;
        let fallback = if usage.contains(vk::ImageUsageFlags::SAMPLED) { Layout::ShaderRead } else { Layout::General };
        let layout = Layout::from_vk(image.layout()).filter(|l| *l != Layout::Undefined);
        let imported = Imported {
            rest: layout.unwrap_or(fallback),
            contents: layout.is_some(),
            usage: Some(vulkan::usage_of_image(usage)),
            owner: Owner::Image(image.clone()),
        };
        let described = ImageDesc {
            format: Format::from_vk(desc.format),
            extent: Extent::new(desc.width, desc.height),
            depth: desc.depth,
            mips: desc.mips,
            layers: desc.layers,
            cube: desc.cube,
        };
        self.add_image(image.name().to_owned(), described, Origin::Imported(imported))
    }

    /// A buffer that outlives the graph, which keeps it alive. Importing it twice gives the same handle.
    pub fn import_buffer(&mut self, buffer: &OwnedBuffer) -> Buffer {
        let same = |o: &Origin| matches!(o, Origin::Imported(Imported { owner: Owner::Buffer(b), .. }) if b.raw() == buffer.raw());
        if let Some(index) = self.buffers.iter().position(|b| same(&b.origin)) {
            return self.whole_buffer(index as u32);
        }
        let handle = self.import_buffer_described(buffer.name().to_owned(), buffer.size());
        self.buffers[handle.index as usize].origin = Origin::Imported(Imported {
            rest: Layout::Buffer,
            contents: true,
            usage: Some(vulkan::usage_of_buffer(buffer.desc().usage)),
            owner: Owner::Buffer(buffer.clone()),
        });
        handle
    }
}

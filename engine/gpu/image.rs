//! Images that own their memory and their views.

use std::{
    collections::HashMap,
    fmt,
    sync::{Arc, Mutex},
};

use ash::vk;
use gpu_allocator::{MemoryLocation, vulkan::Allocation};

use super::{
    BufferDesc, Gpu, OwnedBuffer,
    device::{Context, lock},
    image_desc::{ImageDesc, Region, ViewDesc},
    memory::Owner,
    poison,
    submit::Commands,
};
use crate::{Error, ErrorKind, Result};

/// An image with its memory and views. Clones share it; the last one frees it.
///
/// Between submissions the whole image is in one layout, [`OwnedImage::layout`]; whoever leaves it in another says so with
/// [`OwnedImage::set_layout`].
#[derive(Clone)]
pub struct OwnedImage(Arc<Inner>);

struct Inner {
    context: Arc<Context>,
    raw: vk::Image,
    /// Taken only by `drop`.
    allocation: Option<Allocation>,
    views: Mutex<HashMap<ViewDesc, vk::ImageView>>,
    layout: Mutex<vk::ImageLayout>,
    name: String,
    desc: ImageDesc,
}

impl fmt::Debug for OwnedImage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ImageDesc { format, width, height, depth, mips, layers, .. } = self.0.desc;
        write!(f, "OwnedImage(`{}`, {format:?} {width}x{height}x{depth}, {mips} mips, {layers} layers)", self.0.name)
    }
}

impl Drop for Inner {
    fn drop(&mut self) {
        if self.context.abandoned() {
            // Threads of a CPU driver may still write here.
            std::mem::forget(self.allocation.take());
            return;
        }
        // SAFETY: the last owner; submissions that use the image keep a clone until they are done.
        unsafe {
            for (_, view) in lock(&self.views).drain() {
                self.context.device.destroy_image_view(view, None);
            }
            self.context.device.destroy_image(self.raw, None);
        }
        if let Some(allocation) = self.allocation.take() {
            self.context.free(allocation);
        }
    }
}

impl OwnedImage {
    /// A new image; contents and layout undefined.
    ///
    /// # Errors
    /// `Runtime` if the device cannot have such an image (the message says what it allows), `OutOfMemory`.
    pub fn new(gpu: &Gpu, name: &str, mut desc: ImageDesc) -> Result<Self> {
        let context = &gpu.0;
        context.alive()?;
        if context.options.poison {
            desc.usage |= vk::ImageUsageFlags::TRANSFER_DST;
        }
        let info = check_limits(context, &desc).map_err(|what| {
            Error::new(ErrorKind::Runtime, format!("image `{name}`: {what}"))
                .help("Use a smaller image or another format, or another device")
        })?;
        // SAFETY: `info` is complete and inside the limits; the device is alive.
        let raw = context
            .check(unsafe { context.device.create_image(&info, None) }, || format!("vkCreateImage for `{name}`"))?;
        let mut inner = Inner {
            context: Arc::clone(context),
            raw,
            allocation: None,
            views: Mutex::default(),
            layout: Mutex::new(vk::ImageLayout::UNDEFINED),
            name: name.to_owned(),
            desc,
        };
        // From here on `inner` cleans up.
        // SAFETY: the image was just made.
        let requirements = unsafe { context.device.get_image_memory_requirements(raw) };
        let allocation = context.allocate(name, Owner::Image(raw), requirements, MemoryLocation::GpuOnly)?;
        // SAFETY: memory of this allocation is not bound elsewhere; size and alignment are those required.
        let bound = unsafe { context.device.bind_image_memory(raw, allocation.memory(), allocation.offset()) };
        inner.allocation = Some(allocation);
        context.check(bound, || format!("vkBindImageMemory for `{name}`"))?;
        context.name(raw, name);
        let image = Self(Arc::new(inner));
        if context.options.poison {
            poison::image(gpu, name, raw, &desc)?;
        }
        Ok(image)
    }

    /// A new image with contents; returns when they are there. Levels and layers without a region stay undefined.
    ///
    /// # Errors
    /// As [`Self::new`] and [`Self::upload`].
    pub fn with_contents(gpu: &Gpu, name: &str, desc: ImageDesc, regions: &[Region<'_>]) -> Result<Self> {
        let image = Self::new(gpu, name, desc.also(vk::ImageUsageFlags::TRANSFER_DST))?;
        image.upload(regions)?;
        Ok(image)
    }

    pub fn desc(&self) -> &ImageDesc {
        &self.0.desc
    }

    pub fn name(&self) -> &str {
        &self.0.name
    }

    /// The raw handle, valid as long as a clone lives.
    pub fn raw(&self) -> vk::Image {
        self.0.raw
    }

    /// All aspects, levels and layers.
    pub fn range(&self) -> vk::ImageSubresourceRange {
        vk::ImageSubresourceRange {
            aspect_mask: self.0.desc.aspects(),
            base_mip_level: 0,
            level_count: self.0.desc.mips,
            base_array_layer: 0,
            layer_count: self.0.desc.layers,
        }
    }

    /// Layout of the whole image after everything submitted so far.
    pub fn layout(&self) -> vk::ImageLayout {
        *lock(&self.0.layout)
    }

    /// Says in which layout the commands just submitted leave the image.
    pub fn set_layout(&self, layout: vk::ImageLayout) {
        *lock(&self.0.layout) = layout;
    }

    /// The view of everything: 2D, array, cube, cube array or 3D as the image is; of depth-stencil images the depth.
    pub fn whole(&self) -> ViewDesc {
        let desc = &self.0.desc;
        let ty = match (desc.cube, desc.depth > 1, desc.layers) {
            (true, _, 6) => vk::ImageViewType::CUBE,
            (true, ..) => vk::ImageViewType::CUBE_ARRAY,
            (_, true, _) => vk::ImageViewType::TYPE_3D,
            (_, _, 1) => vk::ImageViewType::TYPE_2D,
            _ => vk::ImageViewType::TYPE_2D_ARRAY,
        };
        let mut aspect = desc.aspects();
        if aspect.contains(vk::ImageAspectFlags::DEPTH) {
            aspect = vk::ImageAspectFlags::DEPTH;
        }
        ViewDesc { ty, aspect, base_mip: 0, mips: desc.mips, base_layer: 0, layers: desc.layers }
    }

    /// The view for `desc`, made once; it lives as long as the image.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`; `Runtime` if `desc` is outside of the image.
    pub fn view(&self, desc: ViewDesc) -> Result<vk::ImageView> {
        let Inner { context, views, name, desc: image, .. } = &*self.0;
        let mut views = lock(views);
        if let Some(view) = views.get(&desc) {
            return Ok(*view);
        }
        context.alive()?;
        let inside =
            |base: u32, count: u32, all: u32| count > 0 && base.checked_add(count).is_some_and(|end| end <= all);
        if !inside(desc.base_mip, desc.mips, image.mips) || !inside(desc.base_layer, desc.layers, image.layers) {
            return Err(Error::new(
                ErrorKind::Runtime,
                format!(
                    "a view of mips {}+{} and layers {}+{} is outside of {self:?}",
                    desc.base_mip, desc.mips, desc.base_layer, desc.layers
                ),
            ));
        }
        let info = vk::ImageViewCreateInfo::default()
            .image(self.0.raw)
            .view_type(desc.ty)
            .format(image.format)
            .subresource_range(vk::ImageSubresourceRange {
                aspect_mask: desc.aspect,
                base_mip_level: desc.base_mip,
                level_count: desc.mips,
                base_array_layer: desc.base_layer,
                layer_count: desc.layers,
            });
        // SAFETY: the image is alive and the range is inside of it.
        let view = context.check(unsafe { context.device.create_image_view(&info, None) }, || {
            format!("vkCreateImageView of `{name}`")
        })?;
        context.name(view, name);
        views.insert(desc, view);
        Ok(view)
    }

    /// Replaces the contents of whole levels of layers, and waits. Leaves the image in `SHADER_READ_ONLY_OPTIMAL` if it can
    /// be sampled, else in `GENERAL`. Needs usage `TRANSFER_DST`. Only for formats with one aspect.
    ///
    /// # Errors
    /// `Runtime` if a region is outside of the image or its size is not that of the level; `OutOfMemory`, `DeviceLost`.
    pub fn upload(&self, regions: &[Region<'_>]) -> Result<()> {
        let Inner { context, name, desc, .. } = &*self.0;
        let wrong = |what: String| Error::new(ErrorKind::Runtime, format!("upload to image `{name}`: {what}"));
        let mut copies = Vec::with_capacity(regions.len());
        let mut total = 0_u64;
        for region in regions {
            let Region { mip, layer, bytes } = *region;
            if mip >= desc.mips || layer >= desc.layers {
                return Err(wrong(format!("mip {mip} of layer {layer} is outside of {self:?}")));
            }
            let needs = desc.level_bytes(mip).ok_or_else(|| wrong(format!("format {:?} is not known", desc.format)))?;
            if bytes.len() as u64 != needs {
                return Err(wrong(format!("mip {mip} has {} bytes, needs {needs}", bytes.len())));
            }
            copies.push(buffer_copy(desc, desc.aspects(), mip, layer, total));
            // A multiple of every block size and of the alignment that copies need.
            total += needs.next_multiple_of(48);
        }
        if copies.is_empty() {
            return Ok(());
        }
        let gpu = Gpu(Arc::clone(context));
        let staging = OwnedBuffer::new(&gpu, &format!("{name} (staging)"), BufferDesc::upload(total))?;
        for (region, copy) in regions.iter().zip(&copies) {
            staging.write(copy.buffer_offset, region.bytes)?;
        }
        let mut commands = gpu.commands(&format!("upload `{name}`"))?;
        self.transition(&mut commands, self.layout(), vk::ImageLayout::TRANSFER_DST_OPTIMAL);
        // SAFETY: regions are inside of image and buffer; both are kept until the copy is done.
        unsafe {
            context.device.cmd_copy_buffer_to_image(
                commands.raw(),
                staging.raw(),
                self.raw(),
                vk::ImageLayout::TRANSFER_DST_OPTIMAL,
                &copies,
            );
        }
        let rest = if desc.usage.contains(vk::ImageUsageFlags::SAMPLED) {
            vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL
        } else {
            vk::ImageLayout::GENERAL
        };
        self.transition(&mut commands, vk::ImageLayout::TRANSFER_DST_OPTIMAL, rest);
        commands.keep(staging);
        commands.keep(self.clone());
        commands.submit()?.wait()?;
        self.set_layout(rest);
        Ok(())
    }

    /// The contents of one level of one layer (of depth-stencil images the depth), tightly packed, top row first. Waits.
    /// Needs usage `TRANSFER_SRC`.
    ///
    /// # Errors
    /// `Runtime` if it is outside of the image, or nothing was ever written; `OutOfMemory`, `DeviceLost`.
    pub fn read(&self, mip: u32, layer: u32) -> Result<Vec<u8>> {
        let Inner { context, name, desc, .. } = &*self.0;
        let wrong = |what: String| Error::new(ErrorKind::Runtime, format!("read of image `{name}`: {what}"));
        if mip >= desc.mips || layer >= desc.layers {
            return Err(wrong(format!("mip {mip} of layer {layer} is outside of {self:?}")));
        }
        let layout = self.layout();
        if layout == vk::ImageLayout::UNDEFINED {
            return Err(wrong("it was never written".into()));
        }
        let size = desc.level_bytes(mip).ok_or_else(|| wrong(format!("format {:?} is not known", desc.format)))?;
        let gpu = Gpu(Arc::clone(context));
        let staging = OwnedBuffer::new(&gpu, &format!("{name} (readback)"), BufferDesc::readback(size))?;
        let mut commands = gpu.commands(&format!("read `{name}`"))?;
        self.transition(&mut commands, layout, vk::ImageLayout::TRANSFER_SRC_OPTIMAL);
        let copy = buffer_copy(desc, self.whole().aspect, mip, layer, 0);
        // SAFETY: the region is inside of image and buffer; both are kept until the copy is done.
        unsafe {
            context.device.cmd_copy_image_to_buffer(
                commands.raw(),
                self.raw(),
                vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
                staging.raw(),
                &[copy],
            );
        }
        self.transition(&mut commands, vk::ImageLayout::TRANSFER_SRC_OPTIMAL, layout);
        commands.everything_barrier();
        commands.keep(self.clone());
        commands.keep(staging.clone());
        commands.submit()?.wait()?;
        staging.mapped_bytes(0, usize::try_from(size).map_err(|_| wrong("it is too large for the host".into()))?)
    }

    /// Records a barrier for everything from `old` to `new`.
    fn transition(&self, commands: &mut Commands, old: vk::ImageLayout, new: vk::ImageLayout) {
        let all = vk::PipelineStageFlags2::ALL_COMMANDS;
        let barrier = [vk::ImageMemoryBarrier2::default()
            .src_stage_mask(all)
            .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
            .dst_stage_mask(all)
            .dst_access_mask(vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE)
            .old_layout(old)
            .new_layout(new)
            .image(self.raw())
            .subresource_range(self.range())];
        // SAFETY: in recording, outside of rendering; the image is alive.
        unsafe {
            self.0
                .context
                .device
                .cmd_pipeline_barrier2(commands.raw(), &vk::DependencyInfo::default().image_memory_barriers(&barrier));
        }
    }
}

fn buffer_copy(
    desc: &ImageDesc,
    aspect: vk::ImageAspectFlags,
    mip: u32,
    layer: u32,
    offset: u64,
) -> vk::BufferImageCopy {
    vk::BufferImageCopy::default()
        .buffer_offset(offset)
        .image_subresource(vk::ImageSubresourceLayers {
            aspect_mask: aspect,
            mip_level: mip,
            base_array_layer: layer,
            layer_count: 1,
        })
        .image_extent(desc.extent(mip))
}

/// The create info, if the device can have such an image; else what is wrong.
fn check_limits(context: &Context, desc: &ImageDesc) -> Result<vk::ImageCreateInfo<'static>, String> {
    let ImageDesc { format, width, height, depth, mips, layers, cube, usage } = *desc;
    if width == 0 || height == 0 || depth == 0 || mips == 0 || layers == 0 {
        return Err(format!("{width}x{height}x{depth} texels, {mips} mips, {layers} layers: each must be at least 1"));
    }
    if mips > desc.full_mips() {
        return Err(format!("{mips} mips, a {width}x{height}x{depth} image has at most {}", desc.full_mips()));
    }
    if cube && (width != height || layers % 6 != 0) {
        return Err(format!("cubes need square faces and 6 layers each, not {width}x{height} and {layers} layers"));
    }
    let ty = if depth > 1 { vk::ImageType::TYPE_3D } else { vk::ImageType::TYPE_2D };
    let flags = if cube { vk::ImageCreateFlags::CUBE_COMPATIBLE } else { vk::ImageCreateFlags::empty() };
    // SAFETY: query of a physical device of a living instance.
    let allowed = unsafe {
        context.instance.raw.get_physical_device_image_format_properties(
            context.physical,
            format,
            ty,
            vk::ImageTiling::OPTIMAL,
            usage,
            flags,
        )
    }
    .map_err(|_| format!("{} has no {format:?} images for {usage:?}", context.description.device))?;
    let max = allowed.max_extent;
    if width > max.width || height > max.height || depth > max.depth || layers > allowed.max_array_layers {
        return Err(format!(
            "{width}x{height}x{depth} with {layers} layers, {} allows {}x{}x{} with {}",
            context.description.device, max.width, max.height, max.depth, allowed.max_array_layers
        ));
    }
    Ok(vk::ImageCreateInfo::default()
        .flags(flags)
        .image_type(ty)
        .format(format)
        .extent(desc.extent(0))
        .mip_levels(mips)
        .array_layers(layers)
        .samples(vk::SampleCountFlags::TYPE_1)
        .tiling(vk::ImageTiling::OPTIMAL)
        .usage(usage)
        .sharing_mode(vk::SharingMode::EXCLUSIVE)
        .initial_layout(vk::ImageLayout::UNDEFINED))
}

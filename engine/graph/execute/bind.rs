//! Descriptor sets and push constants of a pass.

use ash::vk;

use super::{
    super::{
        args::Bind,
        format::Class,
        handles::{Image, Sampler},
        pass::Bound,
        vocab::Layout,
        vulkan,
    },
    pool::Memory,
    record::Recorder,
};
use crate::{
    Error, ErrorKind, Result,
    gpu::{Pipeline, SamplerDesc, ViewDesc},
    shader::{BindingKind, Dim},
};

/// Descriptors of one binding: position in the list of image or buffer infos.
enum Place {
    Images(usize),
    Buffers(usize),
    Accels(usize),
}

impl Recorder<'_> {
    /// Binds pipeline and descriptors of pass `pass`.
    pub fn bind(&mut self, pass: usize, bound: &Bound, pipeline: &Pipeline) -> Result<()> {
        let device = self.gpu.device();
        let raw = self.commands.raw();
        // SAFETY: in recording; the pipeline lives as long as the device.
        unsafe { device.cmd_bind_pipeline(raw, pipeline.bind_point, pipeline.raw) };
        if !bound.shader.bindings.is_empty() {
            let set = self.descriptors(pass, bound, pipeline)?;
            let device = self.gpu.device();
            // SAFETY: the set fits the layout, from which it was allocated, and lives until the frame was waited for.
            unsafe {
                device.cmd_bind_descriptor_sets(raw, pipeline.bind_point, pipeline.layout, 0, &[set], &[]);
            }
        }
        Ok(())
    }

    /// Sets the push constants.
    pub fn push(&mut self, bound: &Bound, pipeline: &Pipeline) {
        self.push_bytes(&bound.push, pipeline);
    }

    /// Sets the push constants to `bytes`, as many as the pass declared.
    pub fn push_bytes(&mut self, bytes: &[u8], pipeline: &Pipeline) {
        if !bytes.is_empty() {
            let device = self.gpu.device();
            // SAFETY: in recording; as many bytes as the layout has, for the stages it has them for.
            unsafe {
                device.cmd_push_constants(self.commands.raw(), pipeline.layout, pipeline.push_stages, 0, bytes);
            }
        }
    }

    fn descriptors(&mut self, pass: usize, bound: &Bound, pipeline: &Pipeline) -> Result<vk::DescriptorSet> {
        let plan = self.plan;
        let name = &plan.passes[pass].name;
        let set = self.sets.allocate(name, pipeline.set_layout)?;
        let mut images = Vec::new();
        let mut buffers = Vec::new();
        let mut accels = Vec::new();
        let mut places = Vec::new();
        let mut resources = bound.resources.iter();
        // The plan lists the uses of bindings first, in their order; uniform blocks are no uses.
        let mut uses = plan.passes[pass].uses.iter();
        for binding in bound.shader.bindings {
            places.push(match binding.kind {
                BindingKind::Sampled(_) | BindingKind::Storage(_) => Place::Images(images.len()),
                BindingKind::AccelerationStructure => Place::Accels(accels.len()),
                _ => Place::Buffers(buffers.len()),
            });
            for _ in 0..binding.count {
                match (binding.kind, resources.next()) {
                    (BindingKind::Sampled(dim), Some(Bind::Image(image))) => {
                        let layout = uses.next().map_or(Layout::ShaderRead, |u| u.layout);
                        images.push(
                            vk::DescriptorImageInfo::default()
                                .image_view(self.view(*image, dim)?)
                                .image_layout(layout.to_vk())
                                .sampler(self.sampler(*image)?),
                        );
                    }
                    (BindingKind::Storage(dim), Some(Bind::Image(image))) => {
                        uses.next();
                        images.push(
                            vk::DescriptorImageInfo::default()
                                .image_view(self.view(*image, dim)?)
                                .image_layout(vk::ImageLayout::GENERAL),
                        );
                    }
                    (BindingKind::Uniform { size }, Some(Bind::Uniform(slice))) => {
                        let Some(arena) = &self.uniforms else { return Err(mismatch(binding.name)) };
                        let limit = self.gpu.caps().limits.uniform_range;
                        if u64::from(size) > limit {
                            let what = format!("`{}` has {size} bytes; the device allows {limit}", binding.name);
                            return Err(
                                Error::new(ErrorKind::Runtime, what).help("Use a buffer instead of a uniform block")
                            );
                        }
                        buffers.push(
                            vk::DescriptorBufferInfo::default()
                                .buffer(arena.raw())
                                .offset(slice.offset.into())
                                .range(size.into()),
                        );
                    }
                    (BindingKind::Buffer, Some(Bind::Buffer(buffer))) => {
                        uses.next();
                        let raw = self.raw_buffer(*buffer)?;
                        let limit = self.gpu.caps().limits.storage_range;
                        if buffer.size > limit {
                            let what =
                                format!("`{}` binds {} bytes; the device allows {limit}", binding.name, buffer.size);
                            return Err(Error::new(ErrorKind::Runtime, what));
                        }
                        // An empty buffer still has memory: buffers are made with at least 16 bytes.
                        buffers.push(
                            vk::DescriptorBufferInfo::default()
                                .buffer(raw)
                                .offset(buffer.offset)
                                .range(buffer.size.max(4)),
                        );
                    }
                    (BindingKind::AccelerationStructure, Some(Bind::Accel(accel))) => {
                        uses.next();
                        accels.push(self.owned_accel(*accel)?.raw());
                    }
                    _ => return Err(mismatch(binding.name)),
                }
            }
        }
        let bindings = || bound.shader.bindings.iter().zip(&places);
        let mut traced: Vec<_> = bindings()
            .map(|(binding, place)| match place {
                Place::Accels(at) => &accels[*at..at + binding.count as usize],
                _ => &[],
            })
            .map(|list| vk::WriteDescriptorSetAccelerationStructureKHR::default().acceleration_structures(list))
            .collect();
        let writes: Vec<_> = bindings()
            .zip(&mut traced)
            .map(|((binding, place), traced)| {
                let write = vk::WriteDescriptorSet::default().dst_set(set).dst_binding(binding.binding);
                let count = binding.count as usize;
                match (place, binding.kind) {
                    (Place::Accels(_), _) => {
                        let mut write =
                            write.descriptor_type(vk::DescriptorType::ACCELERATION_STRUCTURE_KHR).push_next(traced);
                        // The number is taken from the list of the extending structure.
                        write.descriptor_count = binding.count;
                        write
                    }
                    (Place::Images(at), BindingKind::Sampled(_)) => write
                        .descriptor_type(vk::DescriptorType::COMBINED_IMAGE_SAMPLER)
                        .image_info(&images[*at..at + count]),
                    (Place::Images(at), _) => {
                        write.descriptor_type(vk::DescriptorType::STORAGE_IMAGE).image_info(&images[*at..at + count])
                    }
                    (Place::Buffers(at), BindingKind::Uniform { .. }) => {
                        write.descriptor_type(vk::DescriptorType::UNIFORM_BUFFER).buffer_info(&buffers[*at..at + count])
                    }
                    (Place::Buffers(at), _) => {
                        write.descriptor_type(vk::DescriptorType::STORAGE_BUFFER).buffer_info(&buffers[*at..at + count])
                    }
                }
            })
            .collect();
        // SAFETY: the set is new and in no use; views, samplers and buffers live until the frame was waited for.
        unsafe { self.gpu.device().update_descriptor_sets(&writes, &[]) };
        Ok(set)
    }

    /// The view of `image` that a shader expects.
    fn view(&self, image: Image, dim: Dim) -> Result<vk::ImageView> {
        let Memory::Image(owned) = self.memory_of_image(image)? else { return Err(mismatch("image")) };
        owned.view(ViewDesc {
            ty: vulkan::view_type(dim),
            aspect: vulkan::data_aspect(self.format(image)),
            base_mip: image.mip,
            mips: image.mips,
            base_layer: image.layer,
            layers: image.layers,
        })
    }

    /// The stock sampler of `image`; nearest where the device cannot filter the format.
    fn sampler(&self, image: Image) -> Result<vk::Sampler> {
        let format = self.format(image);
        let features = self.gpu.format_features(format.to_vk());
        let filters = features.contains(vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR)
            && !matches!(format.class(), Class::Uint | Class::Sint);
        let desc = match image.sampler {
            Sampler::Linear => SamplerDesc::LINEAR,
            Sampler::Nearest => SamplerDesc::NEAREST,
            Sampler::Trilinear => SamplerDesc::TRILINEAR,
            Sampler::Repeat => SamplerDesc::REPEAT,
            Sampler::NearestRepeat => SamplerDesc::NEAREST_REPEAT,
            Sampler::Shadow => SamplerDesc::SHADOW,
        };
        let desc = if filters { desc } else { SamplerDesc { linear: false, linear_mips: false, ..desc } };
        self.gpu.sampler(desc)
    }
}

pub(super) fn mismatch(name: &str) -> Error {
    Error::new(ErrorKind::Runtime, format!("`{name}` is not the kind of resource that its shader binds"))
}

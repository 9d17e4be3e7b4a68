//! Records clears, copies, blits, uploads and readbacks.

use ash::vk;

use super::{
    super::{
        format::{Class, ImageDesc},
        handles::Image,
        pass::Work,
        vulkan,
    },
    bind::mismatch,
    pool::Memory,
    record::Recorder,
};
use crate::{Result, gpu::Commands};

fn extent(desc: &ImageDesc, mip: u32) -> vk::Extent3D {
    let e = desc.extent.mip(mip);
    vk::Extent3D { width: e.width, height: e.height, depth: (desc.depth >> mip.min(31)).max(1) }
}

fn layers(image: Image, mip: u32, aspect_mask: vk::ImageAspectFlags) -> vk::ImageSubresourceLayers {
    vk::ImageSubresourceLayers {
        aspect_mask,
        mip_level: image.mip + mip,
        base_array_layer: image.layer,
        layer_count: image.layers,
    }
}

/// Corners of a whole level, for blits.
fn corners(e: vk::Extent3D) -> [vk::Offset3D; 2] {
    [vk::Offset3D::default(), vk::Offset3D { x: e.width as i32, y: e.height as i32, z: e.depth as i32 }]
}

impl Recorder<'_> {
    fn desc(&self, image: Image) -> ImageDesc {
        ImageDesc { format: self.format(image), ..self.graph.images[image.index as usize].desc }
    }

    fn aspects(&self, image: Image) -> vk::ImageAspectFlags {
        crate::gpu::aspects(self.format(image).to_vk())
    }

    pub fn transfer(&mut self, work: &Work) -> Result<()> {
        let raw = self.commands.raw();
        let device = self.gpu.device();
        let (source, target) = (vk::ImageLayout::TRANSFER_SRC_OPTIMAL, vk::ImageLayout::TRANSFER_DST_OPTIMAL);
        // SAFETY (whole function): in recording, outside of rendering; the plan checked that all ranges lie inside their
        // resources, which are in these layouts and alive until the frame was waited for.
        match work {
            Work::Upload { buffers } => {
                let Some(staging) = &self.staging else { return Ok(()) };
                let mut offset = 0;
                for buffer in buffers {
                    if buffer.size > 0 {
                        let region = vk::BufferCopy { src_offset: offset, dst_offset: 0, size: buffer.size };
                        // A buffer that no pass uses has no memory.
                        if let Ok(to) = self.raw_buffer(*buffer) {
                            unsafe { device.cmd_copy_buffer(raw, staging.raw(), to, &[region]) };
                        }
                    }
                    offset += buffer.size.next_multiple_of(super::STAGING_ALIGNMENT);
                }
            }
            Work::Clear { image, value } => {
                let range = vk::ImageSubresourceRange {
                    aspect_mask: self.aspects(*image),
                    base_mip_level: image.mip,
                    level_count: image.mips,
                    base_array_layer: image.layer,
                    layer_count: image.layers,
                };
                let handle = self.raw_image(*image)?;
                let class = self.format(*image).class();
                unsafe {
                    match class {
                        Class::Depth | Class::DepthStencil => {
                            let value = vk::ClearDepthStencilValue {
                                depth: value[0].clamp(0.0, 1.0),
                                stencil: value[1] as u32,
                            };
                            device.cmd_clear_depth_stencil_image(raw, handle, target, &value, &[range]);
                        }
                        Class::Uint => {
                            let value = vk::ClearColorValue { uint32: value.map(|v| v.round() as u32) };
                            device.cmd_clear_color_image(raw, handle, target, &value, &[range]);
                        }
                        Class::Sint => {
                            let value = vk::ClearColorValue { int32: value.map(|v| v.round() as i32) };
                            device.cmd_clear_color_image(raw, handle, target, &value, &[range]);
                        }
                        Class::Float => {
                            let value = vk::ClearColorValue { float32: *value };
                            device.cmd_clear_color_image(raw, handle, target, &value, &[range]);
                        }
                    }
                }
            }
            Work::Fill { buffer, value } => {
                let handle = self.raw_buffer(*buffer)?;
                if buffer.size > 0 {
                    unsafe { device.cmd_fill_buffer(raw, handle, buffer.offset, buffer.size, *value) };
                }
            }
            Work::CopyImage { from, to } => {
                let desc = self.desc(*from);
                let aspects = self.aspects(*from);
                let regions: Vec<_> = (0..from.mips)
                    .map(|mip| {
                        vk::ImageCopy::default()
                            .src_subresource(layers(*from, mip, aspects))
                            .dst_subresource(layers(*to, mip, aspects))
                            .extent(extent(&desc, from.mip + mip))
                    })
                    .collect();
                let (a, b) = (self.raw_image(*from)?, self.raw_image(*to)?);
                unsafe { device.cmd_copy_image(raw, a, source, b, target, &regions) };
            }
            Work::CopyBuffer { from, to } | Work::ReadBuffer { from, to } => {
                let region = vk::BufferCopy { src_offset: from.offset, dst_offset: to.offset, size: from.size };
                let (a, b) = (self.raw_buffer(*from)?, self.raw_buffer(*to)?);
                if from.size > 0 {
                    unsafe { device.cmd_copy_buffer(raw, a, b, &[region]) };
                }
            }
            Work::Blit { from, to } => {
                let (a, b) = (self.desc(*from), self.desc(*to));
                let features = self.gpu.format_features(a.format.to_vk());
                let linear = a.format.class() == Class::Float
                    && features.contains(vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR);
                let aspects = self.aspects(*from);
                let region = vk::ImageBlit::default()
                    .src_subresource(layers(*from, 0, aspects))
                    .src_offsets(corners(extent(&a, from.mip)))
                    .dst_subresource(layers(*to, 0, aspects))
                    .dst_offsets(corners(extent(&b, to.mip)));
                let filter = if linear { vk::Filter::LINEAR } else { vk::Filter::NEAREST };
                let (a, b) = (self.raw_image(*from)?, self.raw_image(*to)?);
                unsafe { device.cmd_blit_image(raw, a, source, b, target, &[region], filter) };
            }
            Work::ReadImage { from, to } => {
                let desc = self.desc(*from);
                let region = vk::BufferImageCopy::default()
                    .image_subresource(layers(*from, 0, vulkan::data_aspect(desc.format)))
                    .image_extent(extent(&desc, from.mip));
                let (a, b) = (self.raw_image(*from)?, self.raw_buffer(*to)?);
                unsafe { device.cmd_copy_image_to_buffer(raw, a, source, b, &[region]) };
            }
            Work::Compute { .. } | Work::Raster { .. } | Work::BuildBottoms { .. } | Work::BuildTop { .. } => {
                return Err(mismatch("pass"));
            }
        }
        Ok(())
    }
}

/// Records zeros into history that was just made, and leaves images in the layout between graphs.
pub(super) fn clear_fresh(gpu: &crate::gpu::Gpu, commands: &mut Commands, fresh: &[Memory]) {
    let device = gpu.device();
    let raw = commands.raw();
    let all = vk::PipelineStageFlags2::ALL_COMMANDS;
    let everything = vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE;
    for memory in fresh {
        // SAFETY: in recording, outside of rendering; memory of the pool, which nothing else uses now.
        match memory {
            // Never history.
            Memory::Accel(_) => {}
            Memory::Buffer(buffer) => unsafe { device.cmd_fill_buffer(raw, buffer.raw(), 0, vk::WHOLE_SIZE, 0) },
            Memory::Image(image) => {
                let range = image.range();
                let barrier = |from, to, src, dst| {
                    [vk::ImageMemoryBarrier2::default()
                        .src_stage_mask(all)
                        .src_access_mask(src)
                        .dst_stage_mask(all)
                        .dst_access_mask(dst)
                        .old_layout(from)
                        .new_layout(to)
                        .image(image.raw())
                        .subresource_range(range)]
                };
                use vk::ImageLayout as L;
                let write = vk::AccessFlags2::TRANSFER_WRITE;
                let before = barrier(L::UNDEFINED, L::TRANSFER_DST_OPTIMAL, vk::AccessFlags2::MEMORY_WRITE, write);
                let after = barrier(L::TRANSFER_DST_OPTIMAL, L::GENERAL, write, everything);
                unsafe {
                    device.cmd_pipeline_barrier2(raw, &vk::DependencyInfo::default().image_memory_barriers(&before));
                    if range.aspect_mask.contains(vk::ImageAspectFlags::DEPTH) {
                        let zero = vk::ClearDepthStencilValue::default();
                        device.cmd_clear_depth_stencil_image(
                            raw,
                            image.raw(),
                            L::TRANSFER_DST_OPTIMAL,
                            &zero,
                            &[range],
                        );
                    } else {
                        let zero = vk::ClearColorValue::default();
                        device.cmd_clear_color_image(raw, image.raw(), L::TRANSFER_DST_OPTIMAL, &zero, &[range]);
                    }
                    device.cmd_pipeline_barrier2(raw, &vk::DependencyInfo::default().image_memory_barriers(&after));
                }
            }
        }
    }
}

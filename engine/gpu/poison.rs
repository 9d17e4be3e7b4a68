//! Fills new memory with values that show: a read of what was never written becomes a NaN in the result, and not the zero
//! that many drivers happen to give. For tests ([`super::GpuOptions::poison`]).

use ash::vk;

use super::{Gpu, ImageDesc, format::block};
use crate::Result;

/// A quiet NaN as `f32`, a large number as integer, a NaN as two `f16`.
pub(crate) const WORD: u32 = 0x7FC0_DEAD;

/// Fills `size` bytes (a multiple of four) of a buffer that can be copied to.
pub(crate) fn buffer(gpu: &Gpu, name: &str, raw: vk::Buffer, size: u64) -> Result<()> {
    let mut commands = gpu.commands(&format!("poison `{name}`"))?;
    // SAFETY: in recording; the caller keeps the buffer while this waits.
    unsafe { gpu.0.device.cmd_fill_buffer(commands.raw(), raw, 0, size, WORD) };
    commands.everything_barrier();
    commands.submit()?.wait()
}

/// Fills all levels and layers of an image that can be copied to. Its layout counts as undefined afterwards, as before.
/// Compressed formats cannot be cleared and are left alone.
pub(crate) fn image(gpu: &Gpu, name: &str, raw: vk::Image, desc: &ImageDesc) -> Result<()> {
    if block(desc.format).is_none_or(|block| block.width > 1) {
        return Ok(());
    }
    let mut commands = gpu.commands(&format!("poison `{name}`"))?;
    let range = vk::ImageSubresourceRange {
        aspect_mask: desc.aspects(),
        base_mip_level: 0,
        level_count: desc.mips,
        base_array_layer: 0,
        layer_count: desc.layers,
    };
    let barrier = [vk::ImageMemoryBarrier2::default()
        .dst_stage_mask(vk::PipelineStageFlags2::ALL_TRANSFER)
        .dst_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
        .new_layout(vk::ImageLayout::TRANSFER_DST_OPTIMAL)
        .image(raw)
        .subresource_range(range)];
    let nan = f32::from_bits(WORD);
    let format = format!("{:?}", desc.format);
    // SAFETY: in recording; the caller keeps the image while this waits; the clear value fits the format.
    unsafe {
        let device = &gpu.0.device;
        let layout = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
        device.cmd_pipeline_barrier2(commands.raw(), &vk::DependencyInfo::default().image_memory_barriers(&barrier));
        if desc.aspects() == vk::ImageAspectFlags::COLOR {
            let color = if format.ends_with("INT") {
                vk::ClearColorValue { uint32: [WORD; 4] }
            } else if format.contains("FLOAT") {
                vk::ClearColorValue { float32: [nan; 4] }
            } else {
                // Normalised formats have no NaN.
                vk::ClearColorValue { float32: [1.0, 0.0, 1.0, 0.25] }
            };
            device.cmd_clear_color_image(commands.raw(), raw, layout, &color, &[range]);
        } else {
            let depth = vk::ClearDepthStencilValue { depth: 0.437, stencil: 0xAD };
            device.cmd_clear_depth_stencil_image(commands.raw(), raw, layout, &depth, &[range]);
        }
    }
    commands.everything_barrier();
    commands.submit()?.wait()
}

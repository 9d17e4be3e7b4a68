//! What the open device can do beyond the baseline. Asked once; techniques read this, never the driver.

use ash::vk;

use super::{facts::Candidate, select::DeviceKind};

/// Abilities and limits of the open device.
#[derive(Clone, Debug)]
pub struct Caps {
    pub kind: DeviceKind,
    /// Invocations of a subgroup; 4 to 128. Never assume one value.
    pub subgroup_size: u32,
    /// Nanoseconds for one tick of a timestamp; `None`: the queue has no timestamps.
    pub timestamp_period: Option<f64>,
    /// Low bits of a timestamp that count.
    pub timestamp_mask: u64,
    pub pipeline_statistics: bool,
    pub sampler_anisotropy: Option<f32>,
    pub geometry_shader: bool,
    /// `gl_Layer` may be written in vertex shaders.
    pub shader_output_layer: bool,
    pub multiview: bool,
    pub image_cube_array: bool,
    /// Shaders may use ray queries, and acceleration structures can be built: the device can, and
    /// [`super::GpuOptions::ray_query`] does not forbid it.
    pub ray_query: bool,
    /// Traversals of trees in compute sort the nodes that a ray meets ([`super::Traversal`]).
    pub ordered_rays: bool,
    pub float_atomic_add: bool,
    /// Colour targets of four floats can be blended.
    pub blend_float32: bool,
    pub sampled_array_dynamic_indexing: bool,
    pub storage_read_without_format: bool,
    pub storage_write_without_format: bool,
    pub multi_draw_indirect: bool,
    pub draw_indirect_count: bool,
    pub sampler_minmax: bool,
    pub depth_clamp: bool,
    pub fill_mode_lines: bool,
    pub compressed_bc: bool,
    pub compressed_etc2: bool,
    pub compressed_astc: bool,
    /// Depth and stencil format with 32 or 24 bits of depth, the better one that can be drawn to and sampled.
    pub depth_stencil_format: Option<vk::Format>,
    pub limits: Limits,
}

/// Limits that sizes and offsets are computed from.
#[derive(Clone, Debug)]
pub struct Limits {
    pub image_2d: u32,
    pub image_3d: u32,
    pub image_cube: u32,
    pub array_layers: u32,
    pub push_bytes: u32,
    pub color_attachments: u32,
    /// Bytes.
    pub storage_range: u64,
    /// Bytes.
    pub uniform_range: u64,
    /// Bytes; offsets of storage bindings are multiples of it.
    pub storage_alignment: u64,
    /// Bytes; offsets of uniform bindings are multiples of it.
    pub uniform_alignment: u64,
    pub work_group_count: [u32; 3],
    pub work_group_invocations: u32,
    /// Bytes.
    pub shared_memory: u32,
    pub indirect_draws: u32,
    /// Bytes; scratch memory of acceleration structures starts at multiples of it.
    pub accel_scratch_alignment: u64,
}

/// How rays are traced on a device.
#[derive(Clone, Copy)]
pub(crate) struct Traced {
    /// By ray query instead of in compute.
    pub by_query: bool,
    /// [`Caps::ordered_rays`].
    pub ordered: bool,
}

impl Caps {
    pub(crate) fn new(candidate: &Candidate, instance: &ash::Instance, traced: Traced) -> Self {
        let f = &candidate.features;
        let on = |flag: vk::Bool32| flag == vk::TRUE;
        let limits = &candidate.properties.limits;
        let bits = candidate.queue_family.map_or(0, |(_, bits)| bits);
        let depth_stencil_format =
            [vk::Format::D32_SFLOAT_S8_UINT, vk::Format::D24_UNORM_S8_UINT].into_iter().find(|format| {
                // SAFETY: query of a physical device of a living instance.
                let has = unsafe { instance.get_physical_device_format_properties(candidate.physical, *format) };
                has.optimal_tiling_features
                    .contains(vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT | vk::FormatFeatureFlags::SAMPLED_IMAGE)
            });
        // SAFETY: query of a physical device of a living instance.
        let floats = unsafe {
            instance.get_physical_device_format_properties(candidate.physical, vk::Format::R32G32B32A32_SFLOAT)
        };
        let blends = vk::FormatFeatureFlags::COLOR_ATTACHMENT_BLEND;
        Self {
            kind: candidate.facts.kind,
            subgroup_size: candidate.subgroup_size,
            timestamp_period: (bits > 0).then_some(f64::from(limits.timestamp_period)),
            timestamp_mask: if bits >= 64 { u64::MAX } else { (1 << bits) - 1 },
            pipeline_statistics: on(f.core.pipeline_statistics_query),
            sampler_anisotropy: on(f.core.sampler_anisotropy).then_some(limits.max_sampler_anisotropy),
            geometry_shader: on(f.core.geometry_shader),
            shader_output_layer: on(f.v12.shader_output_layer),
            multiview: on(f.v11.multiview)
                && draws_all_views(&candidate.facts.driver_name, &candidate.facts.driver_info),
            image_cube_array: on(f.core.image_cube_array),
            ray_query: traced.by_query,
            ordered_rays: traced.ordered,
            blend_float32: floats.optimal_tiling_features.contains(blends),
            float_atomic_add: on(f.float_atomics.shader_buffer_float32_atomic_add),
            sampled_array_dynamic_indexing: on(f.core.shader_sampled_image_array_dynamic_indexing),
            storage_read_without_format: on(f.core.shader_storage_image_read_without_format),
            storage_write_without_format: on(f.core.shader_storage_image_write_without_format),
            multi_draw_indirect: on(f.core.multi_draw_indirect),
            draw_indirect_count: on(f.v12.draw_indirect_count),
            sampler_minmax: on(f.v12.sampler_filter_minmax),
            depth_clamp: on(f.core.depth_clamp),
            fill_mode_lines: on(f.core.fill_mode_non_solid),
            compressed_bc: on(f.core.texture_compression_bc),
            compressed_etc2: on(f.core.texture_compression_etc2),
            compressed_astc: on(f.core.texture_compression_astc_ldr),
            depth_stencil_format,
            limits: Limits {
                image_2d: limits.max_image_dimension2_d,
                image_3d: limits.max_image_dimension3_d,
                image_cube: limits.max_image_dimension_cube,
                array_layers: limits.max_image_array_layers,
                push_bytes: limits.max_push_constants_size,
                color_attachments: limits.max_color_attachments,
                storage_range: limits.max_storage_buffer_range.into(),
                uniform_range: limits.max_uniform_buffer_range.into(),
                storage_alignment: limits.min_storage_buffer_offset_alignment.max(1),
                uniform_alignment: limits.min_uniform_buffer_offset_alignment.max(1),
                work_group_count: limits.max_compute_work_group_count,
                work_group_invocations: limits.max_compute_work_group_invocations,
                shared_memory: limits.max_compute_shared_memory_size,
                indirect_draws: limits.max_draw_indirect_count,
                accel_scratch_alignment: candidate.accel_scratch_alignment.max(1),
            },
        }
    }
}

/// Whether a driver with multiview draws all triangles in all views. Mesa's lavapipe 22.3.6 (Debian 12) leaves large ones out of the second
/// view, 25.0.7 does not. The versions between were not tried.
fn draws_all_views(driver: &str, info: &str) -> bool {
    let version = info.strip_prefix("Mesa ").and_then(|text| text.split('.').next()?.parse::<u32>().ok());
    driver != "llvmpipe" || version.is_some_and(|version| version >= 25)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn old_lavapipe_has_no_multiview() {
        assert!(!draws_all_views("llvmpipe", "Mesa 22.3.6 (LLVM 15.0.6)"));
        assert!(!draws_all_views("llvmpipe", "of another form"));
        assert!(draws_all_views("llvmpipe", "Mesa 25.0.7-2~bpo12+1 (LLVM 15.0.6)"));
        assert!(draws_all_views("NVIDIA", "535.1"));
    }
}

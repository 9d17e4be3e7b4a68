//! Asks a physical device everything once: [`DeviceFacts`] for the choice, and the raw answers for opening it.

use std::collections::{BTreeMap, BTreeSet};

use ash::{ext, khr, vk};

use super::{
    instance::{Instance, version_of},
    select::{DeviceFacts, DeviceKind},
};

/// Features as Vulkan asks for them: the same set serves to query and to enable.
#[derive(Default, Clone, Copy)]
pub(crate) struct Features {
    pub core: vk::PhysicalDeviceFeatures,
    pub v11: vk::PhysicalDeviceVulkan11Features<'static>,
    pub v12: vk::PhysicalDeviceVulkan12Features<'static>,
    pub v13: vk::PhysicalDeviceVulkan13Features<'static>,
    pub float_atomics: vk::PhysicalDeviceShaderAtomicFloatFeaturesEXT<'static>,
    pub acceleration: vk::PhysicalDeviceAccelerationStructureFeaturesKHR<'static>,
    pub ray_query: vk::PhysicalDeviceRayQueryFeaturesKHR<'static>,
}

/// Lists each feature once with its name in the specification; everything else is made from this list.
macro_rules! features {
    ($($part:ident . $field:ident = $name:literal),* $(,)?) => {
        impl Features {
            /// Names of those that are on.
            pub fn names(&self) -> BTreeSet<&'static str> {
                let mut names = BTreeSet::new();
                $(if self.$part.$field == vk::TRUE { names.insert($name); })*
                names
            }

            /// Those of `self` that the engine knows, as a set to enable.
            pub fn wanted(&self) -> Self {
                let mut wanted = Self::default();
                $(wanted.$part.$field = self.$part.$field;)*
                wanted
            }
        }
    };
}

features! {
    core.independent_blend = "independentBlend",
    core.fragment_stores_and_atomics = "fragmentStoresAndAtomics",
    core.vertex_pipeline_stores_and_atomics = "vertexPipelineStoresAndAtomics",
    core.sampler_anisotropy = "samplerAnisotropy",
    core.pipeline_statistics_query = "pipelineStatisticsQuery",
    core.geometry_shader = "geometryShader",
    core.image_cube_array = "imageCubeArray",
    core.shader_storage_image_read_without_format = "shaderStorageImageReadWithoutFormat",
    core.shader_storage_image_write_without_format = "shaderStorageImageWriteWithoutFormat",
    core.shader_storage_image_extended_formats = "shaderStorageImageExtendedFormats",
    core.shader_sampled_image_array_dynamic_indexing = "shaderSampledImageArrayDynamicIndexing",
    core.multi_draw_indirect = "multiDrawIndirect",
    core.draw_indirect_first_instance = "drawIndirectFirstInstance",
    core.depth_clamp = "depthClamp",
    core.depth_bias_clamp = "depthBiasClamp",
    core.fill_mode_non_solid = "fillModeNonSolid",
    core.multi_viewport = "multiViewport",
    core.full_draw_index_uint32 = "fullDrawIndexUint32",
    core.shader_int64 = "shaderInt64",
    core.shader_int16 = "shaderInt16",
    core.shader_float64 = "shaderFloat64",
    core.texture_compression_bc = "textureCompressionBC",
    core.texture_compression_etc2 = "textureCompressionETC2",
    core.texture_compression_astc_ldr = "textureCompressionASTC_LDR",
    v11.multiview = "multiview",
    v11.shader_draw_parameters = "shaderDrawParameters",
    v11.storage_buffer16_bit_access = "storageBuffer16BitAccess",
    v12.scalar_block_layout = "scalarBlockLayout",
    v12.buffer_device_address = "bufferDeviceAddress",
    v12.host_query_reset = "hostQueryReset",
    v12.shader_output_layer = "shaderOutputLayer",
    v12.shader_output_viewport_index = "shaderOutputViewportIndex",
    v12.sampler_filter_minmax = "samplerFilterMinmax",
    v12.draw_indirect_count = "drawIndirectCount",
    v12.timeline_semaphore = "timelineSemaphore",
    v12.separate_depth_stencil_layouts = "separateDepthStencilLayouts",
    v12.shader_float16 = "shaderFloat16",
    v12.shader_int8 = "shaderInt8",
    v13.dynamic_rendering = "dynamicRendering",
    v13.synchronization2 = "synchronization2",
    v13.maintenance4 = "maintenance4",
    v13.subgroup_size_control = "subgroupSizeControl",
    v13.shader_demote_to_helper_invocation = "shaderDemoteToHelperInvocation",
    float_atomics.shader_buffer_float32_atomic_add = "shaderBufferFloat32AtomicAdd",
    float_atomics.shader_buffer_float32_atomics = "shaderBufferFloat32Atomics",
    acceleration.acceleration_structure = "accelerationStructure",
    ray_query.ray_query = "rayQuery",
}

/// One physical device with everything asked of it.
pub(crate) struct Candidate {
    pub physical: vk::PhysicalDevice,
    pub facts: DeviceFacts,
    pub features: Features,
    pub properties: vk::PhysicalDeviceProperties,
    pub subgroup_size: u32,
    /// Family of the queue that does everything, and its valid timestamp bits.
    pub queue_family: Option<(u32, u32)>,
    /// Bytes; 0: it builds no acceleration structures.
    pub accel_scratch_alignment: u64,
}

/// All devices of the instance, in the loader's order.
pub(crate) fn candidates(instance: &Instance) -> Result<Vec<Candidate>, vk::Result> {
    // SAFETY: the instance is alive.
    let devices = unsafe { instance.raw.enumerate_physical_devices() }?;
    Ok(devices.into_iter().map(|physical| candidate(&instance.raw, physical)).collect())
}

fn candidate(instance: &ash::Instance, physical: vk::PhysicalDevice) -> Candidate {
    // SAFETY (whole function): queries of a physical device of this living instance, with chains of local structures.
    let mut driver = vk::PhysicalDeviceDriverProperties::default();
    let mut subgroup = vk::PhysicalDeviceSubgroupProperties::default();
    let mut id = vk::PhysicalDeviceIDProperties::default();
    let properties = {
        let mut all =
            vk::PhysicalDeviceProperties2::default().push_next(&mut driver).push_next(&mut subgroup).push_next(&mut id);
        unsafe { instance.get_physical_device_properties2(physical, &mut all) };
        all.properties
    };
    let extensions: BTreeSet<String> = unsafe { instance.enumerate_device_extension_properties(physical) }
        .unwrap_or_default()
        .iter()
        .filter_map(|e| e.extension_name_as_c_str().ok().map(|n| n.to_string_lossy().into_owned()))
        .collect();
    let has = |name: &std::ffi::CStr| extensions.contains(&*name.to_string_lossy());

    let mut features = Features::default();
    // Below 1.3 the version structures may be unknown to the driver; the version alone refuses such a device.
    if properties.api_version >= vk::API_VERSION_1_3 {
        let mut all = vk::PhysicalDeviceFeatures2::default()
            .push_next(&mut features.v11)
            .push_next(&mut features.v12)
            .push_next(&mut features.v13);
        if has(ext::shader_atomic_float::NAME) {
            all = all.push_next(&mut features.float_atomics);
        }
        let rays = has(khr::acceleration_structure::NAME)
            && has(khr::ray_query::NAME)
            && has(khr::deferred_host_operations::NAME);
        if rays {
            all = all.push_next(&mut features.acceleration).push_next(&mut features.ray_query);
        }
        unsafe { instance.get_physical_device_features2(physical, &mut all) };
        features.core = all.features;
    }
    let mut accel_scratch_alignment = 0;
    if features.acceleration.acceleration_structure == vk::TRUE {
        let mut accel = vk::PhysicalDeviceAccelerationStructurePropertiesKHR::default();
        let mut all = vk::PhysicalDeviceProperties2::default().push_next(&mut accel);
        unsafe { instance.get_physical_device_properties2(physical, &mut all) };
        accel_scratch_alignment = accel.min_acceleration_structure_scratch_offset_alignment.into();
    }
    // The chain pointed at locals; only the answers are kept.
    features = features.wanted();

    let family = unsafe { instance.get_physical_device_queue_family_properties(physical) }
        .iter()
        .position(|f| f.queue_count > 0 && f.queue_flags.contains(vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE))
        .map(|index| {
            let families = unsafe { instance.get_physical_device_queue_family_properties(physical) };
            (index as u32, families[index].timestamp_valid_bits)
        });

    let name = |raw: &[std::ffi::c_char]| text(raw);
    let mut names = features.names();
    // A property, not a feature, but it is there or it is not.
    if subgroup.supported_operations.contains(vk::SubgroupFeatureFlags::BALLOT)
        && subgroup.supported_stages.contains(vk::ShaderStageFlags::COMPUTE)
    {
        names.insert("subgroupBallot");
    }
    let facts = DeviceFacts {
        name: name(&properties.device_name),
        kind: match properties.device_type {
            vk::PhysicalDeviceType::DISCRETE_GPU => DeviceKind::Discrete,
            vk::PhysicalDeviceType::INTEGRATED_GPU => DeviceKind::Integrated,
            vk::PhysicalDeviceType::VIRTUAL_GPU => DeviceKind::Virtual,
            vk::PhysicalDeviceType::CPU => DeviceKind::Cpu,
            _ => DeviceKind::Other,
        },
        uuid: uuid(&id.device_uuid),
        api_version: version_of(properties.api_version),
        driver_name: name(&driver.driver_name),
        driver_info: name(&driver.driver_info),
        features: names,
        extensions,
        limits: limits(&properties.limits),
        formats: formats(instance, physical),
        has_queue: family.is_some(),
    };
    Candidate {
        physical,
        facts,
        features,
        properties,
        subgroup_size: subgroup.subgroup_size,
        queue_family: family,
        accel_scratch_alignment,
    }
}

/// `00112233-4455-6677-8899-aabbccddeeff`
fn uuid(bytes: &[u8; 16]) -> String {
    let mut text = String::with_capacity(36);
    for (i, byte) in bytes.iter().enumerate() {
        if matches!(i, 4 | 6 | 8 | 10) {
            text.push('-');
        }
        text += &format!("{byte:02x}");
    }
    text
}

/// Text of a fixed array that need not be terminated or UTF-8.
fn text(raw: &[std::ffi::c_char]) -> String {
    let bytes: Vec<u8> = raw.iter().take_while(|c| **c != 0).map(|c| *c as u8).collect();
    String::from_utf8_lossy(&bytes).into_owned()
}

fn limits(limits: &vk::PhysicalDeviceLimits) -> BTreeMap<&'static str, u64> {
    BTreeMap::from([
        ("maxImageDimension2D", limits.max_image_dimension2_d.into()),
        ("maxImageDimension3D", limits.max_image_dimension3_d.into()),
        ("maxImageDimensionCube", limits.max_image_dimension_cube.into()),
        ("maxImageArrayLayers", limits.max_image_array_layers.into()),
        ("maxPushConstantsSize", limits.max_push_constants_size.into()),
        ("maxColorAttachments", limits.max_color_attachments.into()),
        ("maxFramebufferLayers", limits.max_framebuffer_layers.into()),
        ("maxUniformBufferRange", limits.max_uniform_buffer_range.into()),
        ("maxStorageBufferRange", limits.max_storage_buffer_range.into()),
        ("maxPerStageDescriptorStorageBuffers", limits.max_per_stage_descriptor_storage_buffers.into()),
        ("maxPerStageDescriptorSampledImages", limits.max_per_stage_descriptor_sampled_images.into()),
        ("maxPerStageDescriptorStorageImages", limits.max_per_stage_descriptor_storage_images.into()),
        ("maxComputeWorkGroupInvocations", limits.max_compute_work_group_invocations.into()),
        ("maxComputeSharedMemorySize", limits.max_compute_shared_memory_size.into()),
        ("minStorageBufferOffsetAlignment", limits.min_storage_buffer_offset_alignment),
        ("minUniformBufferOffsetAlignment", limits.min_uniform_buffer_offset_alignment),
    ])
}

/// The formats whose uses the requirements may name.
const ASKED_FORMATS: [vk::Format; 10] = [
    vk::Format::R8_UNORM,
    vk::Format::R8G8B8A8_UNORM,
    vk::Format::R16_SFLOAT,
    vk::Format::R16G16B16A16_SFLOAT,
    vk::Format::R32_SFLOAT,
    vk::Format::R32G32B32A32_SFLOAT,
    vk::Format::B10G11R11_UFLOAT_PACK32,
    vk::Format::D32_SFLOAT,
    vk::Format::D32_SFLOAT_S8_UINT,
    vk::Format::D24_UNORM_S8_UINT,
];

fn formats(instance: &ash::Instance, physical: vk::PhysicalDevice) -> BTreeSet<String> {
    const USES: [(vk::FormatFeatureFlags, &str); 5] = [
        (vk::FormatFeatureFlags::SAMPLED_IMAGE, "sampled"),
        (vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR, "filtered"),
        (vk::FormatFeatureFlags::STORAGE_IMAGE, "storage"),
        (vk::FormatFeatureFlags::COLOR_ATTACHMENT, "color"),
        (vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT, "depth"),
    ];
    let mut set = BTreeSet::new();
    for format in ASKED_FORMATS {
        // SAFETY: query of a physical device of a living instance.
        let has = unsafe { instance.get_physical_device_format_properties(physical, format) }.optimal_tiling_features;
        set.extend(USES.iter().filter(|(flag, _)| has.contains(*flag)).map(|(_, name)| format!("{format:?} {name}")));
    }
    set
}

//! Lies about physical devices.

use std::{
    ffi::{CStr, c_char, c_void},
    mem::transmute,
};

use ash::vk::{self, Handle};

use crate::{chain::physical_next, rules};

/// The functions below, to be resolved while the instance is made.
pub const FUNCTIONS: [&CStr; 7] = [
    c"vkEnumeratePhysicalDevices",
    c"vkEnumerateDeviceExtensionProperties",
    c"vkGetPhysicalDeviceProperties",
    c"vkGetPhysicalDeviceProperties2",
    c"vkGetPhysicalDeviceFeatures2",
    c"vkGetPhysicalDeviceFormatProperties",
    c"vkGetPhysicalDeviceFormatProperties2",
];

pub fn own(name: &CStr) -> Option<*const c_void> {
    Some(match name.to_bytes() {
        b"vkEnumeratePhysicalDevices" => enumerate_devices as *const c_void,
        b"vkEnumerateDeviceExtensionProperties" => enumerate_extensions as *const c_void,
        b"vkGetPhysicalDeviceProperties" => properties as *const c_void,
        b"vkGetPhysicalDeviceProperties2" => properties2 as *const c_void,
        b"vkGetPhysicalDeviceFeatures2" => features2 as *const c_void,
        b"vkGetPhysicalDeviceFormatProperties" => format_properties as *const c_void,
        _ => return None,
    })
}

fn variable(name: &str) -> String {
    std::env::var(name).unwrap_or_default()
}

macro_rules! next {
    ($handle:expr, $name:literal, $pfn:ident) => {{
        // Always there: the layer resolved it for every instance it made.
        let next = physical_next($handle.as_raw(), $name).unwrap_or_else(|| std::process::abort());
        transmute::<usize, vk::$pfn>(next)
    }};
}

unsafe extern "system" fn enumerate_devices(
    instance: vk::Instance,
    count: *mut u32,
    devices: *mut vk::PhysicalDevice,
) -> vk::Result {
    unsafe {
        if let Some(result) = rules::failure("vkEnumeratePhysicalDevices", false) {
            return result;
        }
        if !variable("VKFAULT_NO_DEVICES").is_empty() {
            *count = 0;
            return vk::Result::SUCCESS;
        }
        next!(instance, c"vkEnumeratePhysicalDevices", PFN_vkEnumeratePhysicalDevices)(instance, count, devices)
    }
}

unsafe extern "system" fn enumerate_extensions(
    device: vk::PhysicalDevice,
    layer: *const c_char,
    count: *mut u32,
    out: *mut vk::ExtensionProperties,
) -> vk::Result {
    unsafe {
        let next = next!(device, c"vkEnumerateDeviceExtensionProperties", PFN_vkEnumerateDeviceExtensionProperties);
        let mut all = 0;
        let result = next(device, layer, &mut all, std::ptr::null_mut());
        if result != vk::Result::SUCCESS {
            return result;
        }
        let mut list = vec![vk::ExtensionProperties::default(); all as usize];
        let result = next(device, layer, &mut all, list.as_mut_ptr());
        if result != vk::Result::SUCCESS {
            return result;
        }
        let hidden = variable("VKFAULT_HIDE_EXT");
        list.retain(|extension| {
            let name = CStr::from_ptr(extension.extension_name.as_ptr()).to_string_lossy();
            !hidden.split(',').any(|hidden| hidden == name)
        });
        if out.is_null() {
            *count = list.len() as u32;
            return vk::Result::SUCCESS;
        }
        let copied = list.len().min(*count as usize);
        std::ptr::copy_nonoverlapping(list.as_ptr(), out, copied);
        *count = copied as u32;
        if copied < list.len() { vk::Result::INCOMPLETE } else { vk::Result::SUCCESS }
    }
}

unsafe extern "system" fn properties(device: vk::PhysicalDevice, out: *mut vk::PhysicalDeviceProperties) {
    unsafe {
        next!(device, c"vkGetPhysicalDeviceProperties", PFN_vkGetPhysicalDeviceProperties)(device, out);
        change(&mut *out);
    }
}

unsafe extern "system" fn properties2(device: vk::PhysicalDevice, out: *mut vk::PhysicalDeviceProperties2<'_>) {
    unsafe {
        next!(device, c"vkGetPhysicalDeviceProperties2", PFN_vkGetPhysicalDeviceProperties2)(device, out.cast());
        change(&mut (*out).properties);
    }
}

fn change(properties: &mut vk::PhysicalDeviceProperties) {
    if let Some((major, minor)) = variable("VKFAULT_API").split_once('.')
        && let (Ok(major), Ok(minor)) = (major.parse(), minor.parse())
    {
        properties.api_version = vk::make_api_version(0, major, minor, 0);
    }
    for rule in variable("VKFAULT_LIMIT").split(',') {
        if let Some((name, value)) = rule.split_once('=')
            && let Ok(value) = value.parse::<u32>()
        {
            limits(&mut properties.limits, name, value);
        }
    }
}

/// Sets the limit `name` of those known here.
pub fn limits(limits: &mut vk::PhysicalDeviceLimits, name: &str, value: u32) {
    match name {
        "maxStorageBufferRange" => limits.max_storage_buffer_range = value,
        "maxPushConstantsSize" => limits.max_push_constants_size = value,
        "maxImageDimension2D" => limits.max_image_dimension2_d = value,
        "maxComputeWorkGroupInvocations" => limits.max_compute_work_group_invocations = value,
        "maxColorAttachments" => limits.max_color_attachments = value,
        "minStorageBufferOffsetAlignment" => limits.min_storage_buffer_offset_alignment = value.into(),
        "minUniformBufferOffsetAlignment" => limits.min_uniform_buffer_offset_alignment = value.into(),
        "nonCoherentAtomSize" => limits.non_coherent_atom_size = value.into(),
        _ => eprintln!("fault layer: limit {name} is not known"),
    }
}

unsafe extern "system" fn features2(device: vk::PhysicalDevice, out: *mut vk::PhysicalDeviceFeatures2<'_>) {
    unsafe {
        next!(device, c"vkGetPhysicalDeviceFeatures2", PFN_vkGetPhysicalDeviceFeatures2)(device, out.cast());
        let hidden = variable("VKFAULT_HIDE_FEATURE");
        for name in hidden.split(',').filter(|name| !name.is_empty()) {
            features(&mut *out, name);
        }
    }
}

/// Takes away the feature `name` of those known here, wherever in the chain it is.
///
/// # Safety
/// The chain of `all` is valid.
pub unsafe fn features(all: &mut vk::PhysicalDeviceFeatures2<'_>, name: &str) {
    match name {
        "independentBlend" => all.features.independent_blend = vk::FALSE,
        "samplerAnisotropy" => all.features.sampler_anisotropy = vk::FALSE,
        "depthClamp" => all.features.depth_clamp = vk::FALSE,
        _ => {}
    }
    let mut next = all.p_next.cast::<vk::BaseOutStructure<'_>>();
    while !next.is_null() {
        unsafe {
            match (*next).s_type {
                vk::StructureType::PHYSICAL_DEVICE_VULKAN_1_2_FEATURES => {
                    let features = &mut *next.cast::<vk::PhysicalDeviceVulkan12Features<'_>>();
                    match name {
                        "scalarBlockLayout" => features.scalar_block_layout = vk::FALSE,
                        "shaderOutputLayer" => features.shader_output_layer = vk::FALSE,
                        _ => {}
                    }
                }
                vk::StructureType::PHYSICAL_DEVICE_VULKAN_1_3_FEATURES => {
                    let features = &mut *next.cast::<vk::PhysicalDeviceVulkan13Features<'_>>();
                    match name {
                        "dynamicRendering" => features.dynamic_rendering = vk::FALSE,
                        "synchronization2" => features.synchronization2 = vk::FALSE,
                        _ => {}
                    }
                }
                _ => {}
            }
            next = (*next).p_next;
        }
    }
}

unsafe extern "system" fn format_properties(
    device: vk::PhysicalDevice,
    format: vk::Format,
    out: *mut vk::FormatProperties,
) {
    unsafe {
        next!(device, c"vkGetPhysicalDeviceFormatProperties", PFN_vkGetPhysicalDeviceFormatProperties)(
            device, format, out,
        );
        if variable("VKFAULT_HIDE_FORMAT").split(',').any(|hidden| hidden.parse() == Ok(format.as_raw())) {
            *out = vk::FormatProperties::default();
        }
    }
}

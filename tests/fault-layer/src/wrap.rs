//! Device functions that can be made to fail.

use std::{
    ffi::{CStr, c_void},
    mem::transmute,
};

use ash::vk::{self, Handle};

use crate::{chain::device_next, rules};

/// The next layer's function; it is there, as the loader offered ours only with it.
macro_rules! next {
    ($handle:expr, $name:literal, $pfn:ident) => {
        match device_next($handle.as_raw(), $name) {
            Some(next) => transmute::<unsafe extern "system" fn(), vk::$pfn>(next),
            None => std::process::abort(),
        }
    };
}

/// Functions that return a result, with the outputs that must be null after a failure.
macro_rules! wrap {
    ($($fn:ident = $name:literal, $pfn:ident, lose $lose:literal, ($first:ident: $first_ty:ty $(, $arg:ident: $ty:ty)*)
        $(, null $out:ident * $count:expr)?;)*) => {
        $(unsafe extern "system" fn $fn($first: $first_ty $(, $arg: $ty)*) -> vk::Result {
            unsafe {
                let name: &CStr = $name;
                if let Some(result) = rules::failure(&name.to_string_lossy(), $lose) {
                    $(for i in 0..$count as usize { *$out.add(i) = Handle::from_raw(0); })?
                    return result;
                }
                next!($first, $name, $pfn)($first $(, $arg)*)
            }
        })*

        fn wrapped(name: &CStr) -> Option<*const c_void> {
            $(if name == $name { return Some($fn as *const c_void); })*
            None
        }
    };
}

type Callbacks = *const vk::AllocationCallbacks<'static>;

wrap! {
    create_buffer = c"vkCreateBuffer", PFN_vkCreateBuffer, lose false, (d: vk::Device, i: *const vk::BufferCreateInfo<'static>, a: Callbacks, o: *mut vk::Buffer), null o * 1;
    create_image = c"vkCreateImage", PFN_vkCreateImage, lose false, (d: vk::Device, i: *const vk::ImageCreateInfo<'static>, a: Callbacks, o: *mut vk::Image), null o * 1;
    create_image_view = c"vkCreateImageView", PFN_vkCreateImageView, lose false, (d: vk::Device, i: *const vk::ImageViewCreateInfo<'static>, a: Callbacks, o: *mut vk::ImageView), null o * 1;
    create_sampler = c"vkCreateSampler", PFN_vkCreateSampler, lose false, (d: vk::Device, i: *const vk::SamplerCreateInfo<'static>, a: Callbacks, o: *mut vk::Sampler), null o * 1;
    bind_buffer = c"vkBindBufferMemory", PFN_vkBindBufferMemory, lose false, (d: vk::Device, b: vk::Buffer, m: vk::DeviceMemory, o: vk::DeviceSize);
    bind_image = c"vkBindImageMemory", PFN_vkBindImageMemory, lose false, (d: vk::Device, b: vk::Image, m: vk::DeviceMemory, o: vk::DeviceSize);
    map_memory = c"vkMapMemory", PFN_vkMapMemory, lose false, (d: vk::Device, m: vk::DeviceMemory, o: vk::DeviceSize, s: vk::DeviceSize, f: vk::MemoryMapFlags, p: *mut *mut c_void);
    create_shader_module = c"vkCreateShaderModule", PFN_vkCreateShaderModule, lose false, (d: vk::Device, i: *const vk::ShaderModuleCreateInfo<'static>, a: Callbacks, o: *mut vk::ShaderModule), null o * 1;
    create_set_layout = c"vkCreateDescriptorSetLayout", PFN_vkCreateDescriptorSetLayout, lose false, (d: vk::Device, i: *const vk::DescriptorSetLayoutCreateInfo<'static>, a: Callbacks, o: *mut vk::DescriptorSetLayout), null o * 1;
    create_pipeline_layout = c"vkCreatePipelineLayout", PFN_vkCreatePipelineLayout, lose false, (d: vk::Device, i: *const vk::PipelineLayoutCreateInfo<'static>, a: Callbacks, o: *mut vk::PipelineLayout), null o * 1;
    create_pipeline_cache = c"vkCreatePipelineCache", PFN_vkCreatePipelineCache, lose false, (d: vk::Device, i: *const vk::PipelineCacheCreateInfo<'static>, a: Callbacks, o: *mut vk::PipelineCache), null o * 1;
    create_compute = c"vkCreateComputePipelines", PFN_vkCreateComputePipelines, lose false, (d: vk::Device, c: vk::PipelineCache, n: u32, i: *const vk::ComputePipelineCreateInfo<'static>, a: Callbacks, o: *mut vk::Pipeline), null o * n;
    create_graphics = c"vkCreateGraphicsPipelines", PFN_vkCreateGraphicsPipelines, lose false, (d: vk::Device, c: vk::PipelineCache, n: u32, i: *const vk::GraphicsPipelineCreateInfo<'static>, a: Callbacks, o: *mut vk::Pipeline), null o * n;
    create_descriptor_pool = c"vkCreateDescriptorPool", PFN_vkCreateDescriptorPool, lose false, (d: vk::Device, i: *const vk::DescriptorPoolCreateInfo<'static>, a: Callbacks, o: *mut vk::DescriptorPool), null o * 1;
    allocate_sets = c"vkAllocateDescriptorSets", PFN_vkAllocateDescriptorSets, lose false, (d: vk::Device, i: *const vk::DescriptorSetAllocateInfo<'static>, o: *mut vk::DescriptorSet), null o * (*i).descriptor_set_count;
    create_command_pool = c"vkCreateCommandPool", PFN_vkCreateCommandPool, lose false, (d: vk::Device, i: *const vk::CommandPoolCreateInfo<'static>, a: Callbacks, o: *mut vk::CommandPool), null o * 1;
    reset_command_pool = c"vkResetCommandPool", PFN_vkResetCommandPool, lose false, (d: vk::Device, p: vk::CommandPool, f: vk::CommandPoolResetFlags);
    allocate_commands = c"vkAllocateCommandBuffers", PFN_vkAllocateCommandBuffers, lose false, (d: vk::Device, i: *const vk::CommandBufferAllocateInfo<'static>, o: *mut vk::CommandBuffer), null o * (*i).command_buffer_count;
    begin_commands = c"vkBeginCommandBuffer", PFN_vkBeginCommandBuffer, lose false, (c: vk::CommandBuffer, i: *const vk::CommandBufferBeginInfo<'static>);
    end_commands = c"vkEndCommandBuffer", PFN_vkEndCommandBuffer, lose false, (c: vk::CommandBuffer);
    create_fence = c"vkCreateFence", PFN_vkCreateFence, lose false, (d: vk::Device, i: *const vk::FenceCreateInfo<'static>, a: Callbacks, o: *mut vk::Fence), null o * 1;
    reset_fences = c"vkResetFences", PFN_vkResetFences, lose false, (d: vk::Device, n: u32, f: *const vk::Fence);
    create_query_pool = c"vkCreateQueryPool", PFN_vkCreateQueryPool, lose false, (d: vk::Device, i: *const vk::QueryPoolCreateInfo<'static>, a: Callbacks, o: *mut vk::QueryPool), null o * 1;
    query_results = c"vkGetQueryPoolResults", PFN_vkGetQueryPoolResults, lose true, (d: vk::Device, p: vk::QueryPool, first: u32, n: u32, size: usize, data: *mut c_void, stride: vk::DeviceSize, f: vk::QueryResultFlags);
    queue_submit = c"vkQueueSubmit", PFN_vkQueueSubmit, lose true, (q: vk::Queue, n: u32, s: *const vk::SubmitInfo<'static>, f: vk::Fence);
    queue_submit2 = c"vkQueueSubmit2", PFN_vkQueueSubmit2, lose true, (q: vk::Queue, n: u32, s: *const vk::SubmitInfo2<'static>, f: vk::Fence);
    wait_fences = c"vkWaitForFences", PFN_vkWaitForFences, lose true, (d: vk::Device, n: u32, f: *const vk::Fence, all: vk::Bool32, t: u64);
    fence_status = c"vkGetFenceStatus", PFN_vkGetFenceStatus, lose true, (d: vk::Device, f: vk::Fence);
    device_wait_idle = c"vkDeviceWaitIdle", PFN_vkDeviceWaitIdle, lose true, (d: vk::Device);
    acquire = c"vkAcquireNextImageKHR", PFN_vkAcquireNextImageKHR, lose true, (d: vk::Device, s: vk::SwapchainKHR, t: u64, sem: vk::Semaphore, f: vk::Fence, i: *mut u32);
    present = c"vkQueuePresentKHR", PFN_vkQueuePresentKHR, lose true, (q: vk::Queue, p: *const vk::PresentInfoKHR<'static>);
}

unsafe extern "system" fn allocate_memory(
    device: vk::Device,
    info: *const vk::MemoryAllocateInfo<'static>,
    callbacks: Callbacks,
    out: *mut vk::DeviceMemory,
) -> vk::Result {
    unsafe {
        *out = vk::DeviceMemory::null();
        if let Some(result) = rules::failure("vkAllocateMemory", false) {
            return result;
        }
        let size = (*info).allocation_size;
        if !rules::fits(size) {
            return vk::Result::ERROR_OUT_OF_DEVICE_MEMORY;
        }
        let result = next!(device, c"vkAllocateMemory", PFN_vkAllocateMemory)(device, info, callbacks, out);
        if result == vk::Result::SUCCESS {
            rules::allocated((*out).as_raw(), size);
        }
        result
    }
}

unsafe extern "system" fn free_memory(device: vk::Device, memory: vk::DeviceMemory, callbacks: Callbacks) {
    unsafe {
        rules::freed(memory.as_raw());
        next!(device, c"vkFreeMemory", PFN_vkFreeMemory)(device, memory, callbacks);
    }
}

pub fn own(name: &CStr) -> Option<*const c_void> {
    match name.to_bytes() {
        b"vkAllocateMemory" => Some(allocate_memory as *const c_void),
        b"vkFreeMemory" => Some(free_memory as *const c_void),
        _ => wrapped(name),
    }
}

//! egui's textures in device memory.

use super::device::{Device, Owned};
use super::swapchain::color_view;
use crate::error::{Error, vk_error};
use ash::vk;
use egui::{TextureFilter, TextureOptions, TextureWrapMode};
use std::rc::Rc;

/// egui's colours are gamma-encoded and are filtered and blended as they are.
const FORMAT: vk::Format = vk::Format::R8G8B8A8_UNORM;

/// An image with its sampler and its descriptor set.
pub struct Texture {
    pub image: Owned<vk::Image>,
    pub size: [usize; 2],
    pub options: TextureOptions,
    pub set: vk::DescriptorSet,
    _pool: Owned<vk::DescriptorPool>,
    _sampler: Owned<vk::Sampler>,
    _view: Owned<vk::ImageView>,
    _memory: Owned<vk::DeviceMemory>,
}

impl Texture {
    /// Makes a texture without contents.
    pub fn new(
        device: &Rc<Device>,
        layout: vk::DescriptorSetLayout,
        size: [usize; 2],
        options: TextureOptions,
    ) -> Result<Self, Error> {
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(FORMAT)
            .extent(vk::Extent3D { width: size[0] as u32, height: size[1] as u32, depth: 1 })
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(vk::ImageUsageFlags::TRANSFER_DST | vk::ImageUsageFlags::SAMPLED);
        // SAFETY: the painter has checked the size against the device's limit; every device knows the format.
        let image = unsafe { device.raw.create_image(&info, None) }.map_err(|e| vk_error("vkCreateImage", e))?;
        // SAFETY: `Owned` calls this once, with the image.
        let image = Owned::new(device, image, |device, image| unsafe { device.destroy_image(image, None) });
        // SAFETY: the image exists.
        let needs = unsafe { device.raw.get_image_memory_requirements(image.raw) };
        let memory = device.allocate(&needs, vk::MemoryPropertyFlags::DEVICE_LOCAL)?;
        // SAFETY: the memory was allocated for this image and nothing else uses it.
        unsafe { device.raw.bind_image_memory(image.raw, memory.raw, 0) }
            .map_err(|e| vk_error("vkBindImageMemory", e))?;
        let view = color_view(device, image.raw, FORMAT)?;
        let sampler = sampler(device, options)?;
        let (pool, set) = descriptor_set(device, layout, view.raw, sampler.raw)?;
        Ok(Self { image, size, options, set, _pool: pool, _sampler: sampler, _view: view, _memory: memory })
    }
}

fn sampler(device: &Rc<Device>, options: TextureOptions) -> Result<Owned<vk::Sampler>, Error> {
    let filter = |filter| match filter {
        TextureFilter::Nearest => vk::Filter::NEAREST,
        TextureFilter::Linear => vk::Filter::LINEAR,
    };
    let wrap = match options.wrap_mode {
        TextureWrapMode::ClampToEdge => vk::SamplerAddressMode::CLAMP_TO_EDGE,
        TextureWrapMode::Repeat => vk::SamplerAddressMode::REPEAT,
        TextureWrapMode::MirroredRepeat => vk::SamplerAddressMode::MIRRORED_REPEAT,
    };
    let info = vk::SamplerCreateInfo::default()
        .mag_filter(filter(options.magnification))
        .min_filter(filter(options.minification))
        .address_mode_u(wrap)
        .address_mode_v(wrap)
        .address_mode_w(wrap)
        // With a largest level of 0 Vulkan would always magnify; 0.25 is its advice for images without smaller levels.
        .max_lod(0.25);
    // SAFETY: the sampler uses no feature that must be enabled.
    let raw = unsafe { device.raw.create_sampler(&info, None) }.map_err(|e| vk_error("vkCreateSampler", e))?;
    // SAFETY: `Owned` calls this once, with the sampler.
    Ok(Owned::new(device, raw, |device, sampler| unsafe { device.destroy_sampler(sampler, None) }))
}

/// A descriptor set in a pool of its own. There are few textures, so this costs little and sets no limit to them.
fn descriptor_set(
    device: &Rc<Device>,
    layout: vk::DescriptorSetLayout,
    view: vk::ImageView,
    sampler: vk::Sampler,
) -> Result<(Owned<vk::DescriptorPool>, vk::DescriptorSet), Error> {
    let sizes = [vk::DescriptorPoolSize { ty: vk::DescriptorType::COMBINED_IMAGE_SAMPLER, descriptor_count: 1 }];
    let info = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
    // SAFETY: `info` is complete.
    let pool =
        unsafe { device.raw.create_descriptor_pool(&info, None) }.map_err(|e| vk_error("vkCreateDescriptorPool", e))?;
    // SAFETY: `Owned` calls this once, with the pool.
    let pool = Owned::new(device, pool, |device, pool| unsafe { device.destroy_descriptor_pool(pool, None) });
    let layouts = [layout];
    let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool.raw).set_layouts(&layouts);
    // SAFETY: the pool has room for this set.
    let set = unsafe { device.raw.allocate_descriptor_sets(&info) }
        .map_err(|e| vk_error("vkAllocateDescriptorSets", e))?
        .first()
        .copied()
        .ok_or(vk_error("vkAllocateDescriptorSets", vk::Result::ERROR_UNKNOWN))?;
    let images = [vk::DescriptorImageInfo {
        sampler,
        image_view: view,
        image_layout: vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
    }];
    let write = vk::WriteDescriptorSet::default()
        .dst_set(set)
        .descriptor_type(vk::DescriptorType::COMBINED_IMAGE_SAMPLER)
        .image_info(&images);
    // SAFETY: the set is new, so no commands use it.
    unsafe { device.raw.update_descriptor_sets(&[write], &[]) };
    Ok((pool, set))
}

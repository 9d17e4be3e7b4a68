//! The images that the window shows in turn.

use super::device::{Device, Owned};
use super::surface::Surface;
use crate::error::{Error, vk_error};
use ash::vk;
use std::rc::Rc;

/// A swapchain with what each of its images needs.
pub struct Swapchain {
    pub raw: vk::SwapchainKHR,
    pub extent: vk::Extent2D,
    /// The window size that it was made for. It may differ from the extent.
    pub window_size: [u32; 2],
    pub images: Vec<Image>,
    device: Rc<Device>,
}

/// One image of a swapchain.
pub struct Image {
    pub raw: vk::Image,
    pub view: Owned<vk::ImageView>,
    /// Signalled when the image is drawn. There is one per image: presentation gives no fence, but an image that is
    /// acquired again is no longer presented, so its semaphore is free.
    pub drawn: Owned<vk::Semaphore>,
}

/// The surface's format that suits egui best: one that stores gamma-encoded values as they are.
pub fn choose_format(device: &Device) -> Result<vk::SurfaceFormatKHR, Error> {
    let surface = &device.surface;
    // SAFETY: the device can present to the surface.
    let formats =
        unsafe { surface.instance.surfaces.get_physical_device_surface_formats(device.physical, surface.raw) }
            .map_err(|e| vk_error("vkGetPhysicalDeviceSurfaceFormatsKHR", e))?;
    let wanted = [
        vk::Format::B8G8R8A8_UNORM,
        vk::Format::R8G8B8A8_UNORM,
        vk::Format::A2B10G10R10_UNORM_PACK32,
        vk::Format::A2R10G10B10_UNORM_PACK32,
        vk::Format::B8G8R8A8_SRGB,
        vk::Format::R8G8B8A8_SRGB,
    ];
    wanted
        .into_iter()
        .find_map(|format| {
            formats.iter().find(|f| f.format == format && f.color_space == vk::ColorSpaceKHR::SRGB_NONLINEAR).copied()
        })
        .ok_or_else(|| Error::NoDevice("The window has no colour format that is known.".to_owned()))
}

impl Swapchain {
    /// Makes a swapchain for the window's present size, or none if the window has no area.
    ///
    /// The device must be idle if there is an `old` one.
    pub fn new(
        device: &Rc<Device>,
        surface: &Surface,
        format: vk::SurfaceFormatKHR,
        window_size: [u32; 2],
        old: Option<&Self>,
    ) -> Result<Option<Self>, Error> {
        // SAFETY: the device can present to the surface.
        let limits =
            unsafe { surface.instance.surfaces.get_physical_device_surface_capabilities(device.physical, surface.raw) }
                .map_err(|e| vk_error("vkGetPhysicalDeviceSurfaceCapabilitiesKHR", e))?;
        let mut extent = limits.current_extent;
        if extent.width == u32::MAX {
            let (least, most) = (limits.min_image_extent, limits.max_image_extent);
            extent.width = window_size[0].max(least.width).min(most.width);
            extent.height = window_size[1].max(least.height).min(most.height);
        }
        if extent.width == 0 || extent.height == 0 {
            return Ok(None);
        }
        let most = if limits.max_image_count == 0 { u32::MAX } else { limits.max_image_count };
        let alphas = [
            vk::CompositeAlphaFlagsKHR::OPAQUE,
            vk::CompositeAlphaFlagsKHR::INHERIT,
            vk::CompositeAlphaFlagsKHR::PRE_MULTIPLIED,
            vk::CompositeAlphaFlagsKHR::POST_MULTIPLIED,
        ];
        let alpha = alphas.into_iter().find(|a| limits.supported_composite_alpha.contains(*a)).unwrap_or_default();
        let info = vk::SwapchainCreateInfoKHR::default()
            .surface(surface.raw)
            .min_image_count((limits.min_image_count + 1).min(most))
            .image_format(format.format)
            .image_color_space(format.color_space)
            .image_extent(extent)
            .image_array_layers(1)
            .image_usage(vk::ImageUsageFlags::COLOR_ATTACHMENT)
            .image_sharing_mode(vk::SharingMode::EXCLUSIVE)
            .pre_transform(limits.current_transform)
            .composite_alpha(alpha)
            .present_mode(vk::PresentModeKHR::FIFO)
            .clipped(true)
            .old_swapchain(old.map_or(vk::SwapchainKHR::null(), |old| old.raw));
        // SAFETY: all values come from the surface's own limits; the old swapchain belongs to the same surface.
        let raw = unsafe { device.swapchains.create_swapchain(&info, None) }
            .map_err(|e| vk_error("vkCreateSwapchainKHR", e))?;
        let mut swapchain = Self { raw, extent, window_size, images: Vec::new(), device: device.clone() };
        // SAFETY: the swapchain exists.
        let images = unsafe { device.swapchains.get_swapchain_images(raw) }
            .map_err(|e| vk_error("vkGetSwapchainImagesKHR", e))?;
        for image in images {
            swapchain.images.push(Image {
                raw: image,
                view: color_view(device, image, format.format)?,
                drawn: semaphore(device)?,
            });
        }
        Ok(Some(swapchain))
    }
}

impl Drop for Swapchain {
    fn drop(&mut self) {
        self.images.clear();
        // SAFETY: the presenter waits for the device before it drops a swapchain; the views are gone.
        unsafe { self.device.swapchains.destroy_swapchain(self.raw, None) };
    }
}

/// A view of a whole colour image.
pub fn color_view(device: &Rc<Device>, image: vk::Image, format: vk::Format) -> Result<Owned<vk::ImageView>, Error> {
    let info = vk::ImageViewCreateInfo::default()
        .image(image)
        .view_type(vk::ImageViewType::TYPE_2D)
        .format(format)
        .subresource_range(WHOLE);
    // SAFETY: the image exists, has this format and one level.
    let raw = unsafe { device.raw.create_image_view(&info, None) }.map_err(|e| vk_error("vkCreateImageView", e))?;
    // SAFETY: `Owned` calls this once, with the view.
    Ok(Owned::new(device, raw, |device, view| unsafe { device.destroy_image_view(view, None) }))
}

/// A semaphore that is not signalled.
pub fn semaphore(device: &Rc<Device>) -> Result<Owned<vk::Semaphore>, Error> {
    // SAFETY: the device exists.
    let raw = unsafe { device.raw.create_semaphore(&vk::SemaphoreCreateInfo::default(), None) }
        .map_err(|e| vk_error("vkCreateSemaphore", e))?;
    // SAFETY: `Owned` calls this once, with the semaphore.
    Ok(Owned::new(device, raw, |device, semaphore| unsafe { device.destroy_semaphore(semaphore, None) }))
}

/// The whole of an image with one level.
pub const WHOLE: vk::ImageSubresourceRange = vk::ImageSubresourceRange {
    aspect_mask: vk::ImageAspectFlags::COLOR,
    base_mip_level: 0,
    level_count: 1,
    base_array_layer: 0,
    layer_count: 1,
};

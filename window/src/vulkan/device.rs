//! The logical device: its choice, its memory, and owners of its objects.

use super::surface::Surface;
use crate::error::{Error, vk_error};
use ash::{khr, vk};
use std::ptr::NonNull;
use std::rc::Rc;

/// A device with one queue that draws and presents.
pub struct Device {
    pub raw: ash::Device,
    pub swapchains: khr::swapchain::Device,
    pub physical: vk::PhysicalDevice,
    pub queue: vk::Queue,
    pub family: u32,
    /// The largest side of a texture in pixels.
    pub max_texture_side: u32,
    /// The device is a driver that computes with the threads of the CPU.
    pub is_cpu: bool,
    memory: vk::PhysicalDeviceMemoryProperties,
    /// The instance must outlive the device.
    pub surface: Rc<Surface>,
}

struct Candidate {
    physical: vk::PhysicalDevice,
    family: u32,
    rank: u32,
    name: String,
}

impl Device {
    /// Makes the best device that can present to the surface, among those whose name contains `wanted`.
    pub fn new(surface: &Rc<Surface>, wanted: Option<&str>) -> Result<Rc<Self>, Error> {
        let chosen = choose(surface, wanted)?;
        log::info!("The window is drawn by {}.", chosen.name);
        let instance = &surface.instance.raw;
        let priorities = [1.0];
        let queues =
            [vk::DeviceQueueCreateInfo::default().queue_family_index(chosen.family).queue_priorities(&priorities)];
        let extensions = [khr::swapchain::NAME.as_ptr()];
        let mut features = vk::PhysicalDeviceVulkan13Features::default().dynamic_rendering(true).synchronization2(true);
        let info = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .enabled_extension_names(&extensions)
            .push_next(&mut features);
        // SAFETY: `choose` has checked the queue family, the extension and the features.
        let raw = unsafe { instance.create_device(chosen.physical, &info, None) }
            .map_err(|e| vk_error("vkCreateDevice", e))?;
        // SAFETY: the device was made with one queue of this family.
        let queue = unsafe { raw.get_device_queue(chosen.family, 0) };
        // SAFETY: the physical device belongs to the instance.
        let memory = unsafe { instance.get_physical_device_memory_properties(chosen.physical) };
        // SAFETY: as above.
        let properties = unsafe { instance.get_physical_device_properties(chosen.physical) };
        Ok(Rc::new(Self {
            swapchains: khr::swapchain::Device::new(instance, &raw),
            raw,
            physical: chosen.physical,
            queue,
            family: chosen.family,
            max_texture_side: properties.limits.max_image_dimension2_d,
            is_cpu: properties.device_type == vk::PhysicalDeviceType::CPU,
            memory,
            surface: surface.clone(),
        }))
    }

    /// Waits until the device does nothing. A lost device does nothing either.
    pub fn wait_idle(&self) {
        // SAFETY: all use of the queue is on this thread, so nothing else touches it now.
        if let Err(e) = unsafe { self.raw.device_wait_idle() } {
            log::warn!("vkDeviceWaitIdle failed: {e}");
        }
    }

    /// Allocates memory of a type that has the wanted properties.
    pub fn allocate(
        self: &Rc<Self>,
        needs: &vk::MemoryRequirements,
        wanted: vk::MemoryPropertyFlags,
    ) -> Result<Owned<vk::DeviceMemory>, Error> {
        let types = self.memory.memory_types_as_slice().iter().zip(0u32..);
        let (_, index) = types
            .into_iter()
            .find(|(t, i)| needs.memory_type_bits & (1 << i) != 0 && t.property_flags.contains(wanted))
            .ok_or(vk_error("vkAllocateMemory", vk::Result::ERROR_OUT_OF_DEVICE_MEMORY))?;
        let info = vk::MemoryAllocateInfo::default().allocation_size(needs.size).memory_type_index(index);
        // SAFETY: the type index is one of the device's.
        let raw = unsafe { self.raw.allocate_memory(&info, None) }.map_err(|e| vk_error("vkAllocateMemory", e))?;
        // SAFETY: `Owned` calls this once, with the memory.
        Ok(Owned::new(self, raw, |device, memory| unsafe { device.free_memory(memory, None) }))
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: all objects made from the device hold an `Rc` of it, so none is left.
        unsafe { self.raw.destroy_device(None) };
    }
}

/// An object of a device that is destroyed when this value is dropped.
///
/// The device must not use the object then; `Presenter` and `Frame` see to that.
pub struct Owned<T: Copy> {
    pub raw: T,
    device: Rc<Device>,
    destroy: fn(&ash::Device, T),
}

impl<T: Copy> Owned<T> {
    pub fn new(device: &Rc<Device>, raw: T, destroy: fn(&ash::Device, T)) -> Self {
        Self { raw, device: device.clone(), destroy }
    }
}

impl<T: Copy> Drop for Owned<T> {
    fn drop(&mut self) {
        (self.destroy)(&self.device.raw, self.raw);
    }
}

/// A buffer in memory that the processor writes to.
pub struct Buffer {
    pub raw: Owned<vk::Buffer>,
    bytes: NonNull<u8>,
    size: usize,
    _memory: Owned<vk::DeviceMemory>,
}

impl Buffer {
    pub fn new(device: &Rc<Device>, size: usize, usage: vk::BufferUsageFlags) -> Result<Self, Error> {
        let info = vk::BufferCreateInfo::default().size(size as u64).usage(usage);
        // SAFETY: `info` is complete; the size is not zero.
        let raw = unsafe { device.raw.create_buffer(&info, None) }.map_err(|e| vk_error("vkCreateBuffer", e))?;
        // SAFETY: `Owned` calls this once, with the buffer.
        let raw = Owned::new(device, raw, |device, buffer| unsafe { device.destroy_buffer(buffer, None) });
        // SAFETY: the buffer exists.
        let needs = unsafe { device.raw.get_buffer_memory_requirements(raw.raw) };
        let memory =
            device.allocate(&needs, vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT)?;
        // SAFETY: the memory was allocated for this buffer and nothing else uses it.
        unsafe { device.raw.bind_buffer_memory(raw.raw, memory.raw, 0) }
            .map_err(|e| vk_error("vkBindBufferMemory", e))?;
        // SAFETY: the memory is visible to the host and not yet mapped. Freeing it unmaps it.
        let bytes = unsafe { device.raw.map_memory(memory.raw, 0, vk::WHOLE_SIZE, vk::MemoryMapFlags::empty()) }
            .map_err(|e| vk_error("vkMapMemory", e))?;
        let bytes = NonNull::new(bytes.cast()).ok_or(vk_error("vkMapMemory", vk::Result::ERROR_MEMORY_MAP_FAILED))?;
        Ok(Self { raw, bytes, size, _memory: memory })
    }

    /// Makes `buffer` have room for `size` bytes. The contents are lost when it grows.
    pub fn reserve(
        buffer: &mut Option<Self>,
        device: &Rc<Device>,
        size: usize,
        usage: vk::BufferUsageFlags,
    ) -> Result<(), Error> {
        if buffer.as_ref().is_none_or(|b| b.size < size) {
            *buffer = None;
            *buffer = Some(Self::new(device, size.next_power_of_two().max(1 << 16), usage)?);
        }
        Ok(())
    }

    /// Copies the bytes of `values` to `offset` and returns the offset behind them.
    ///
    /// `T` must be plain numbers without padding. The device must not use the buffer at this time. Values that do not
    /// fit are an error of the caller: they are left out.
    pub fn write<T: Copy>(&mut self, offset: usize, values: &[T]) -> usize {
        let length = size_of_val(values);
        let end = offset.saturating_add(length);
        if end > self.size {
            log::error!("A buffer of {} bytes has no room for {length} bytes at {offset}.", self.size);
            return offset;
        }
        // SAFETY: the source is `length` bytes long. The target has them too (checked above), is mapped as long as this
        // value lives, and does not overlap the source, which is a Rust slice.
        unsafe { self.bytes.add(offset).copy_from_nonoverlapping(NonNull::from(values).cast(), length) };
        end
    }
}

fn choose(surface: &Surface, wanted: Option<&str>) -> Result<Candidate, Error> {
    // SAFETY: the instance exists.
    let devices = unsafe { surface.instance.raw.enumerate_physical_devices() }
        .map_err(|e| vk_error("vkEnumeratePhysicalDevices", e))?;
    let mut refusals = Vec::new();
    let mut best: Option<Candidate> = None;
    for physical in devices {
        // SAFETY: the physical device belongs to the instance.
        let properties = unsafe { surface.instance.raw.get_physical_device_properties(physical) };
        let name = properties.device_name_as_c_str().unwrap_or_default().to_string_lossy().into_owned();
        if wanted.is_some_and(|part| !name.to_lowercase().contains(&part.to_lowercase())) {
            refusals.push(format!("{name}: not the wanted name"));
            continue;
        }
        match suitable_family(surface, physical, &properties) {
            Ok(family) => {
                let rank = rank(properties.device_type);
                if best.as_ref().is_none_or(|b| rank > b.rank) {
                    best = Some(Candidate { physical, family, rank, name });
                }
            }
            Err(reason) => refusals.push(format!("{name}: {reason}")),
        }
    }
    best.ok_or_else(|| {
        let seen = if refusals.is_empty() { "There is no Vulkan device.".to_owned() } else { refusals.join("; ") };
        let named = wanted.map(|part| format!(" with \"{part}\" in its name")).unwrap_or_default();
        Error::NoDevice(format!("No Vulkan device{named} can draw the window. {seen}"))
    })
}

fn rank(kind: vk::PhysicalDeviceType) -> u32 {
    match kind {
        vk::PhysicalDeviceType::DISCRETE_GPU => 4,
        vk::PhysicalDeviceType::INTEGRATED_GPU => 3,
        vk::PhysicalDeviceType::VIRTUAL_GPU => 2,
        vk::PhysicalDeviceType::CPU => 1,
        _ => 0,
    }
}

/// The queue family that draws and presents, or why the device has none.
fn suitable_family(
    surface: &Surface,
    physical: vk::PhysicalDevice,
    properties: &vk::PhysicalDeviceProperties,
) -> Result<u32, String> {
    let instance = &surface.instance;
    if properties.api_version < vk::API_VERSION_1_3 {
        return Err("no Vulkan 1.3".to_owned());
    }
    // SAFETY: the physical device belongs to the instance.
    let extensions = unsafe { instance.raw.enumerate_device_extension_properties(physical) }
        .map_err(|e| format!("vkEnumerateDeviceExtensionProperties failed: {e}"))?;
    if !extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(khr::swapchain::NAME)) {
        return Err("it cannot present".to_owned());
    }
    let mut features = vk::PhysicalDeviceVulkan13Features::default();
    let mut query = vk::PhysicalDeviceFeatures2::default().push_next(&mut features);
    // SAFETY: the device knows Vulkan 1.3, so the chained struct is allowed.
    unsafe { instance.raw.get_physical_device_features2(physical, &mut query) };
    if features.dynamic_rendering == vk::FALSE || features.synchronization2 == vk::FALSE {
        return Err("no dynamic rendering or synchronization2".to_owned());
    }
    // SAFETY: the physical device belongs to the instance.
    let families = unsafe { instance.raw.get_physical_device_queue_family_properties(physical) };
    for (family, index) in families.iter().zip(0u32..) {
        // SAFETY: the index is one of the device's families; the surface belongs to the instance.
        let presents = unsafe { instance.surfaces.get_physical_device_surface_support(physical, index, surface.raw) }
            .map_err(|e| format!("vkGetPhysicalDeviceSurfaceSupportKHR failed: {e}"))?;
        if presents && family.queue_flags.contains(vk::QueueFlags::GRAPHICS) {
            return Ok(index);
        }
    }
    Err("it cannot present to this window".to_owned())
}

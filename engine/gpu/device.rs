//! The open device: one `Arc` that everything handed out keeps alive.

use std::{
    collections::HashMap,
    fmt,
    mem::ManuallyDrop,
    sync::{
        Arc, Mutex, MutexGuard, OnceLock, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use ash::{ext, khr, vk};
use gpu_allocator::{
    AllocationSizes,
    vulkan::{Allocator, AllocatorCreateDesc},
};

use super::{
    caps::{Caps, Traced},
    exit::skip_foreign_handlers,
    facts::{Candidate, Features, candidates},
    fault::{Latch, failed},
    instance::{Instance, no_driver},
    options::{GpuOptions, RayQuery, Traversal, Validation},
    pipeline::PipelineCache,
    sampler::SamplerKey,
    select::{DeviceFacts, DeviceKind, Requirements, refusal, select},
    submit::Shell,
    validation::{Log, Message, Severity},
};
use crate::{Error, ErrorKind, Result};

/// An open Vulkan device: instance, device, queue, memory. Cheap to clone; images, buffers, pipelines and submissions
/// keep it alive, so that the order in which things are dropped never matters.
#[derive(Clone)]
pub struct Gpu(pub(crate) Arc<Context>);

impl fmt::Debug for Gpu {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Gpu").field(&self.describe().device).finish()
    }
}

/// Who rendered: for metadata, tables and reports.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Description {
    pub device: String,
    pub kind: DeviceKind,
    pub driver: String,
    pub driver_info: String,
    /// `1.3.239`
    pub api_version: String,
}

impl Description {
    fn new(facts: &DeviceFacts) -> Self {
        let (major, minor, patch) = facts.api_version;
        Self {
            device: facts.name.clone(),
            kind: facts.kind,
            driver: facts.driver_name.clone(),
            driver_info: facts.driver_info.clone(),
            api_version: format!("{major}.{minor}.{patch}"),
        }
    }
}

impl fmt::Display for Description {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { device, kind, driver, driver_info, api_version } = self;
        write!(f, "{device} ({kind}), {driver} {driver_info}, Vulkan {api_version}")
    }
}

/// Everything that lives as long as the device.
pub(crate) struct Context {
    pub device: ash::Device,
    pub physical: vk::PhysicalDevice,
    /// The one queue; the lock orders submissions.
    pub queue: Mutex<vk::Queue>,
    pub queue_family: u32,
    pub allocator: ManuallyDrop<Mutex<Allocator>>,
    /// Bytes of the device-local heaps.
    pub heap_bytes: u64,
    pub caps: Caps,
    pub facts: DeviceFacts,
    pub description: Description,
    pub debug: Option<ext::debug_utils::Device>,
    /// Functions of acceleration structures, where [`Caps::ray_query`].
    pub accel: Option<khr::acceleration_structure::Device>,
    pub lost: Latch,
    abandoned: AtomicBool,
    pub options: GpuOptions,
    pub hard_limit: Duration,
    /// Execution barriers before crash markers; off under synchronisation validation, from which they would hide hazards.
    pub ordered_markers: bool,
    pub shells: Mutex<Vec<Shell>>,
    pub samplers: Mutex<HashMap<SamplerKey, vk::Sampler>>,
    pub pipelines: Mutex<PipelineCache>,
    /// Answer of [`Gpu::loop_limit`].
    pub loop_limit: OnceLock<Option<u32>>,
    /// Last: the instance goes after the device.
    pub instance: Arc<Instance>,
}

/// A lock that a panic elsewhere does not take away.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Drop for Context {
    fn drop(&mut self) {
        if self.abandoned() {
            // The device, and the instance and loader under it, must stay for the driver's threads.
            std::mem::forget(Arc::clone(&self.instance));
            return;
        }
        // SAFETY: this is the last reference, so every image, buffer and submission is gone; submissions wait before
        // they go, so nothing is in flight. After a loss, waiting is useless and destroying is allowed.
        unsafe {
            if !self.lost.is_set() {
                let _ = self.device.device_wait_idle();
            }
            let mut allocator =
                ManuallyDrop::take(&mut self.allocator).into_inner().unwrap_or_else(PoisonError::into_inner);
            for shell in lock(&self.shells).drain(..) {
                shell.destroy(&self.device, &mut allocator);
            }
            lock(&self.pipelines).destroy(&self.device);
            for (_, sampler) in lock(&self.samplers).drain() {
                self.device.destroy_sampler(sampler, None);
            }
            let left = allocator.generate_report();
            for allocation in &left.allocations {
                self.instance.log.push(Message {
                    severity: Severity::Error,
                    id: "LUCERNA-LEAK".into(),
                    text: format!("memory of `{}` was not given back", allocation.name),
                    objects: vec![allocation.name.clone()],
                });
            }
            drop(allocator);
            self.device.destroy_device(None);
        }
    }
}

impl Gpu {
    /// Opens the device that `options` choose.
    ///
    /// # Errors
    /// `NoDevice` if there is no loader, no driver or no suitable device, with one line for each device and missing
    /// item; `OutOfMemory` or `Runtime` if the driver fails while opening.
    pub fn new(options: GpuOptions) -> Result<Self> {
        let options = &options;
        let instance = Instance::new(options)?;
        let mut candidates = list(&instance)?;
        let mut needs = Requirements::baseline();
        if options.ray_query == RayQuery::On {
            needs = needs.and_ray_query();
        }
        if !options.window_extensions.is_empty() {
            needs.extensions.push("VK_KHR_swapchain");
        }
        let facts: Vec<DeviceFacts> = candidates.iter().map(|c| c.facts.clone()).collect();
        let choice = select(&facts, &needs, &options.device, options.require_gpu)
            .map_err(|rejections| refusal(&rejections, &options.device))?;
        let candidate = candidates.swap_remove(choice.index);
        instance.log.set_driver(&format!("{} {}", candidate.facts.driver_name, candidate.facts.name));
        Ok(Self(Arc::new(Context::new(instance, candidate, options)?)))
    }

    /// What it can do beyond the baseline.
    pub fn caps(&self) -> &Caps {
        &self.0.caps
    }

    /// Device and driver names, for metadata and tables.
    pub fn describe(&self) -> &Description {
        &self.0.description
    }

    /// What device choice saw of it.
    pub fn facts(&self) -> &DeviceFacts {
        &self.0.facts
    }

    /// Messages of validation, loader and driver. The log outlives the device: hold it to read what teardown says.
    pub fn log(&self) -> &Arc<Log> {
        &self.0.instance.log
    }

    /// The validation layer is on.
    pub fn validation_active(&self) -> bool {
        self.0.instance.layer.is_some()
    }

    /// What asks everything that this device does to stop ([`GpuOptions::stop`]).
    pub fn stop(&self) -> Option<&crate::Stop> {
        self.0.options.stop.as_ref()
    }

    /// The device is lost: every operation now fails.
    pub fn is_lost(&self) -> bool {
        self.0.lost.is_set()
    }

    /// The raw device, for the graph's executor. Destroy nothing through it that this module owns.
    pub fn device(&self) -> &ash::Device {
        &self.0.device
    }

    /// Turns a Vulkan result into an error that names `operation` (`vkCmdX for pass …`); a lost device sets the latch. For
    /// the graph's executor.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost` or `Runtime`, as `result` says.
    pub fn check<T>(&self, result: Result<T, vk::Result>, operation: impl FnOnce() -> String) -> Result<T> {
        self.0.check(result, operation)
    }

    /// Gives a raw object a name for messages and captures.
    pub fn name<H: vk::Handle>(&self, handle: H, name: &str) {
        self.0.name(handle, name);
    }

    /// Bytes in use and bytes taken from the driver for images and buffers.
    pub fn memory_in_use(&self) -> (u64, u64) {
        self.0.memory_in_use()
    }

    /// What the device can do with images of `format` (optimal tiling).
    pub fn format_features(&self, format: vk::Format) -> vk::FormatFeatureFlags {
        // SAFETY: query of a physical device of a living instance.
        unsafe { self.0.instance.raw.get_physical_device_format_properties(self.0.physical, format) }
            .optimal_tiling_features
    }

    /// Waits until the queue is empty.
    ///
    /// # Errors
    /// `DeviceLost`, `OutOfMemory`.
    pub fn wait_idle(&self) -> Result<()> {
        // An empty submission with our own watchdog: vkDeviceWaitIdle has no time limit.
        self.commands("wait idle")?.submit()?.wait()
    }
}

/// All devices of the system with whether and why not each is suitable; for a `devices` command.
///
/// # Errors
/// `NoDevice` if there is no loader or driver.
pub fn list_devices() -> Result<Vec<Listed>> {
    let instance = Instance::new(&GpuOptions { print_messages: false, ..GpuOptions::default() })?;
    let facts: Vec<DeviceFacts> = list(&instance)?.into_iter().map(|c| c.facts).collect();
    let needs = Requirements::baseline();
    let mut listed = Vec::new();
    for device in facts {
        let one = [device];
        let missing = match select(&one, &needs, &super::DeviceChoice::Auto, false) {
            Ok(_) => Vec::new(),
            Err(rejections) => rejections.into_iter().flat_map(|r| r.missing).collect(),
        };
        let [facts] = one;
        listed.push(Listed { description: Description::new(&facts), facts, missing });
    }
    Ok(listed)
}

/// One line of [`list_devices`].
#[derive(Clone, Debug)]
pub struct Listed {
    pub description: Description,
    pub facts: DeviceFacts,
    /// What it lacks of the baseline; empty: it can be used.
    pub missing: Vec<String>,
}

fn list(instance: &Instance) -> Result<Vec<Candidate>> {
    match candidates(instance) {
        Ok(list) if list.is_empty() => {
            Err(no_driver("Vulkan drivers are installed, but none of them has a device".into(), &instance.log))
        }
        Ok(list) => Ok(list),
        Err(result) => Err(no_driver(
            format!("no Vulkan driver could list its devices (vkEnumeratePhysicalDevices: {result})"),
            &instance.log,
        )),
    }
}

impl Context {
    fn new(instance: Arc<Instance>, candidate: Candidate, options: &GpuOptions) -> Result<Self> {
        let wanted = match options.ray_query {
            RayQuery::Auto => candidate.facts.kind != DeviceKind::Cpu,
            RayQuery::On => true,
            RayQuery::Off => false,
        };
        let ray_query = wanted && candidate.facts.lacks_of_ray_query().is_empty();
        let ordered_rays = match options.traversal {
            Traversal::Auto => candidate.facts.kind == DeviceKind::Cpu,
            Traversal::Ordered => true,
            Traversal::Grouped => false,
        };
        let caps = Caps::new(&candidate, &instance.raw, Traced { by_query: ray_query, ordered: ordered_rays });
        let facts = &candidate.facts;
        let (queue_family, _) =
            candidate.queue_family.ok_or_else(|| Error::new(ErrorKind::NoDevice, "the chosen device has no queue"))?;

        let mut features = candidate.features.wanted();
        let has = |name: &std::ffi::CStr| facts.extensions.contains(&*name.to_string_lossy());
        let mut extensions: Vec<&std::ffi::CStr> = Vec::new();
        if !options.window_extensions.is_empty() {
            extensions.push(khr::swapchain::NAME);
        }
        if has(khr::portability_subset::NAME) {
            extensions.push(khr::portability_subset::NAME);
        }
        let atomics = has(ext::shader_atomic_float::NAME);
        if atomics {
            extensions.push(ext::shader_atomic_float::NAME);
        }
        if caps.ray_query {
            extensions.extend([
                khr::acceleration_structure::NAME,
                khr::ray_query::NAME,
                khr::deferred_host_operations::NAME,
            ]);
        }
        let device =
            create_device(&instance, &candidate, &mut features, &extensions, queue_family, atomics, caps.ray_query)?;

        // From here on `device` must be destroyed on failure.
        // SAFETY: the family was given at creation.
        let queue = unsafe { device.get_device_queue(queue_family, 0) };
        let mut debug_settings = gpu_allocator::AllocatorDebugSettings::default();
        // `Context::drop` reports leaks itself.
        debug_settings.log_leaks_on_shutdown = false;
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.raw.clone(),
            device: device.clone(),
            physical_device: candidate.physical,
            debug_settings,
            buffer_device_address: true,
            allocation_sizes: AllocationSizes::new(32 << 20, 8 << 20)
                .with_max_device_memblock_size(256 << 20)
                .with_max_host_memblock_size(64 << 20),
        });
        let allocator = match allocator {
            Ok(allocator) => allocator,
            Err(cause) => {
                // SAFETY: nothing was made from the device.
                unsafe { device.destroy_device(None) };
                return Err(Error::new(ErrorKind::Runtime, "the memory allocator could not be made").caused_by(cause));
            }
        };
        // SAFETY: query of a physical device of a living instance.
        let memory = unsafe { instance.raw.get_physical_device_memory_properties(candidate.physical) };
        let heap_bytes = memory.memory_heaps[..memory.memory_heap_count as usize]
            .iter()
            .filter(|heap| heap.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL))
            .map(|heap| heap.size)
            .sum();
        let default_limit = if caps.kind == DeviceKind::Cpu { 600 } else { 60 };
        Ok(Self {
            accel: caps.ray_query.then(|| khr::acceleration_structure::Device::new(&instance.raw, &device)),
            debug: instance.debug_utils.then(|| ext::debug_utils::Device::new(&instance.raw, &device)),
            device,
            physical: candidate.physical,
            queue: Mutex::new(queue),
            queue_family,
            allocator: ManuallyDrop::new(Mutex::new(allocator)),
            heap_bytes,
            description: Description::new(facts),
            caps,
            lost: Latch::default(),
            abandoned: AtomicBool::new(false),
            hard_limit: options.hard_limit.unwrap_or(Duration::from_secs(default_limit)),
            ordered_markers: options.validation != Validation::Sync,
            options: options.clone(),
            shells: Mutex::default(),
            samplers: Mutex::default(),
            pipelines: Mutex::default(),
            loop_limit: OnceLock::new(),
            facts: candidate.facts,
            instance,
        })
    }

    /// Turns a Vulkan result into our error; a lost device sets the latch.
    pub fn check<T>(&self, result: Result<T, vk::Result>, operation: impl FnOnce() -> String) -> Result<T> {
        result.map_err(|code| match code {
            vk::Result::ERROR_DEVICE_LOST => {
                self.lost.set(format!("the device was lost in {} on {}", operation(), self.description))
            }
            other => failed(&operation(), other),
        })
    }

    /// An error if the device is lost: nothing more may be asked of it.
    pub fn alive(&self) -> Result<()> {
        if self.lost.is_set() { Err(self.lost.error()) } else { Ok(()) }
    }

    /// The device may still work although it counts as lost: from now on nothing of it is freed or destroyed.
    pub fn abandon(&self) {
        skip_foreign_handlers();
        self.abandoned.store(true, Ordering::Release);
    }

    pub fn abandoned(&self) -> bool {
        self.abandoned.load(Ordering::Acquire)
    }

    /// Gives `handle` a name for messages and captures.
    pub fn name<H: vk::Handle>(&self, handle: H, name: &str) {
        if let Some(debug) = &self.debug {
            let name: Vec<u8> = name.bytes().filter(|b| *b != 0).chain([0]).collect();
            let Ok(name) = std::ffi::CStr::from_bytes_with_nul(&name) else { return };
            let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(handle).object_name(name);
            // SAFETY: the handle is of this device and alive. A failure leaves it without a name, which harms nothing.
            let _ = unsafe { debug.set_debug_utils_object_name(&info) };
        }
    }

    /// Bytes in use, bytes taken from the driver.
    pub fn memory_in_use(&self) -> (u64, u64) {
        let report = lock(&self.allocator).generate_report();
        (report.total_allocated_bytes, report.total_capacity_bytes)
    }
}

fn create_device(
    instance: &Instance,
    candidate: &Candidate,
    features: &mut Features,
    extensions: &[&std::ffi::CStr],
    queue_family: u32,
    atomics: bool,
    rays: bool,
) -> Result<ash::Device> {
    let priorities = [1.0];
    let queues = [vk::DeviceQueueCreateInfo::default().queue_family_index(queue_family).queue_priorities(&priorities)];
    let extension_pointers: Vec<_> = extensions.iter().map(|e| e.as_ptr()).collect();
    let mut core = vk::PhysicalDeviceFeatures2::default().features(features.core);
    let mut info = vk::DeviceCreateInfo::default()
        .queue_create_infos(&queues)
        .enabled_extension_names(&extension_pointers)
        .push_next(&mut core)
        .push_next(&mut features.v11)
        .push_next(&mut features.v12)
        .push_next(&mut features.v13);
    if atomics {
        info = info.push_next(&mut features.float_atomics);
    }
    if rays {
        info = info.push_next(&mut features.acceleration).push_next(&mut features.ray_query);
    }
    // SAFETY: everything that `info` points to is alive; only offered features and extensions are asked for.
    unsafe { instance.raw.create_device(candidate.physical, &info, None) }.map_err(|result| {
        let operation = format!("vkCreateDevice for {}", candidate.facts.name);
        match result {
            vk::Result::ERROR_OUT_OF_HOST_MEMORY | vk::Result::ERROR_OUT_OF_DEVICE_MEMORY => failed(&operation, result),
            vk::Result::ERROR_DEVICE_LOST => {
                Error::new(ErrorKind::DeviceLost, format!("the device was lost in {operation}"))
            }
            other => Error::new(ErrorKind::NoDevice, format!("{operation} failed: {other:?}"))
                .help("Choose another device (`--device`, LUCERNA_DEVICE), or update the driver"),
        }
    })
}

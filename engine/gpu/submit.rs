//! Recording, submitting and waiting: every wait is bounded, and a device that is lost or stuck names the pass it was in.

use std::{
    any::Any,
    fmt,
    sync::Arc,
    time::{Duration, Instant},
};

use ash::vk;
use gpu_allocator::{
    MemoryLocation,
    vulkan::{Allocation, Allocator},
};

use super::{
    Gpu,
    device::{Context, lock},
    memory::Owner,
    options::Validation,
    select::DeviceKind,
};
use crate::{Error, ErrorKind, Result};

/// How often a wait looks whether it shall stop.
const LOOK: Duration = Duration::from_millis(20);
/// How long the device may go on with a submission after everything was asked to stop. Then the submission is given up, as after the
/// hard limit: a driver offers no way to end it.
const STOP_LIMIT: Duration = Duration::from_millis(800);
/// Passes of one submission that have a mark of their own; later ones share the last.
const MARKS: usize = 1024;

/// Pool, command buffer, fence and marks of one submission; used again by later ones.
pub(crate) struct Shell {
    pool: vk::CommandPool,
    commands: vk::CommandBuffer,
    fence: vk::Fence,
    /// One word for each pass, set by the device when it comes to that pass. Host memory, so that it can be read when the
    /// device no longer answers.
    marks: vk::Buffer,
    memory: Option<Allocation>,
}

impl Shell {
    fn new(context: &Context) -> Result<Self> {
        let mut shell = Self {
            pool: vk::CommandPool::null(),
            commands: vk::CommandBuffer::null(),
            fence: vk::Fence::null(),
            marks: vk::Buffer::null(),
            memory: None,
        };
        match shell.fill(context) {
            Ok(()) => Ok(shell),
            Err(error) => {
                shell.destroy(&context.device, &mut lock(&context.allocator));
                Err(error)
            }
        }
    }

    fn fill(&mut self, context: &Context) -> Result<()> {
        let device = &context.device;
        // SAFETY: complete create infos, a living device; what was made is in `self`, which the caller destroys on failure.
        unsafe {
            let pool = vk::CommandPoolCreateInfo::default()
                .flags(vk::CommandPoolCreateFlags::TRANSIENT)
                .queue_family_index(context.queue_family);
            self.pool = context.check(device.create_command_pool(&pool, None), || "vkCreateCommandPool".into())?;
            let buffers = vk::CommandBufferAllocateInfo::default().command_pool(self.pool).command_buffer_count(1);
            self.commands =
                context.check(device.allocate_command_buffers(&buffers), || "vkAllocateCommandBuffers".into())?[0];
            self.fence =
                context.check(device.create_fence(&vk::FenceCreateInfo::default(), None), || "vkCreateFence".into())?;
            let marks =
                vk::BufferCreateInfo::default().size(4 * MARKS as u64).usage(vk::BufferUsageFlags::TRANSFER_DST);
            self.marks = context.check(device.create_buffer(&marks, None), || "vkCreateBuffer for `marks`".into())?;
            let requirements = device.get_buffer_memory_requirements(self.marks);
            let memory =
                context.allocate("marks", Owner::Buffer(self.marks), requirements, MemoryLocation::GpuToCpu)?;
            let bound = device.bind_buffer_memory(self.marks, memory.memory(), memory.offset());
            self.memory = Some(memory);
            context.check(bound, || "vkBindBufferMemory for `marks`".into())
        }
    }

    /// Not while its commands run. Null handles are allowed.
    pub fn destroy(mut self, device: &ash::Device, allocator: &mut Allocator) {
        // SAFETY: nothing of it is in use, which the caller promises.
        unsafe {
            device.destroy_command_pool(self.pool, None);
            device.destroy_fence(self.fence, None);
            device.destroy_buffer(self.marks, None);
        }
        if let Some(memory) = self.memory.take() {
            let _ = allocator.free(memory);
        }
    }

    fn marks_pointer(&self) -> Option<*mut u32> {
        self.memory.as_ref().and_then(Allocation::mapped_ptr).map(|p| p.as_ptr().cast::<u32>())
    }

    fn clear_marks(&self) {
        if let Some(pointer) = self.marks_pointer() {
            // SAFETY: mapped memory of at least `MARKS` words that no submission uses now.
            unsafe { std::ptr::write_bytes(pointer, 0, MARKS) };
        }
    }

    /// Number of the last pass that the device came to.
    fn last_mark(&self, passes: usize) -> Option<usize> {
        let pointer = self.marks_pointer()?;
        // SAFETY: inside the mapped range; volatile because the device writes.
        (0..passes.min(MARKS)).rev().find(|i| unsafe { pointer.add(*i).read_volatile() } != 0)
    }
}

/// Commands in recording. Dropping it without [`Commands::submit`] throws them away.
pub struct Commands {
    context: Arc<Context>,
    /// `None` only after `submit`.
    shell: Option<Shell>,
    raw: vk::CommandBuffer,
    name: String,
    passes: Vec<String>,
    keep: Vec<Box<dyn Any + Send>>,
}

impl fmt::Debug for Commands {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Commands(`{}`, {} passes)", self.name, self.passes.len())
    }
}

impl Gpu {
    /// Begins recording commands; `name` says in errors and captures what they are for (`frame 7`, `upload …`).
    ///
    /// # Errors
    /// `DeviceLost` if it was lost before, `OutOfMemory`.
    pub fn commands(&self, name: &str) -> Result<Commands> {
        let context = &self.0;
        context.alive()?;
        let used = lock(&context.shells).pop();
        let shell = match used {
            Some(shell) => shell,
            None => Shell::new(context)?,
        };
        shell.clear_marks();
        let commands = Commands {
            context: Arc::clone(context),
            raw: shell.commands,
            shell: Some(shell),
            name: name.to_owned(),
            passes: Vec::new(),
            keep: Vec::new(),
        };
        let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the buffer is new or its pool was reset.
        let begun = unsafe { context.device.begin_command_buffer(commands.raw, &begin) };
        context.check(begun, || format!("vkBeginCommandBuffer for `{name}`"))?;
        Ok(commands)
    }
}

impl Commands {
    /// The command buffer to record into.
    pub fn raw(&self) -> vk::CommandBuffer {
        self.raw
    }

    /// The device it is recorded for.
    pub fn gpu(&self) -> Gpu {
        Gpu(Arc::clone(&self.context))
    }

    /// Begins a pass: a label for captures, and a mark so that a lost or stuck device can say where it was. Not inside
    /// `vkCmdBeginRendering`.
    pub fn begin_pass(&mut self, name: &str) {
        self.begin_label(name);
        let mark = self.passes.len().min(MARKS - 1);
        self.passes.push(name.to_owned());
        if let Some(shell) = &self.shell {
            // SAFETY: in recording; the words of different marks are apart.
            unsafe {
                let device = &self.context.device;
                if self.context.ordered_markers {
                    // Otherwise a mark could be set before earlier passes are done.
                    let barrier = [vk::MemoryBarrier2::default()
                        .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
                        .dst_stage_mask(vk::PipelineStageFlags2::ALL_TRANSFER)];
                    device.cmd_pipeline_barrier2(self.raw, &vk::DependencyInfo::default().memory_barriers(&barrier));
                }
                if self.passes.len() <= MARKS {
                    device.cmd_fill_buffer(self.raw, shell.marks, 4 * mark as u64, 4, 1);
                }
            }
        }
    }

    /// Ends the pass begun last.
    pub fn end_pass(&mut self) {
        self.end_label();
    }

    /// Begins a label for captures that groups passes.
    pub fn begin_label(&mut self, name: &str) {
        if let Some(debug) = &self.context.debug {
            let name: Vec<u8> = name.bytes().filter(|b| *b != 0).chain([0]).collect();
            if let Ok(name) = std::ffi::CStr::from_bytes_with_nul(&name) {
                let label = vk::DebugUtilsLabelEXT::default().label_name(name);
                // SAFETY: in recording; the label lives during the call.
                unsafe { debug.cmd_begin_debug_utils_label(self.raw, &label) };
            }
        }
    }

    /// Ends the label begun last.
    pub fn end_label(&mut self) {
        if let Some(debug) = &self.context.debug {
            // SAFETY: in recording; pairs with `begin_label`.
            unsafe { debug.cmd_end_debug_utils_label(self.raw) };
        }
    }

    /// Everything before is done and visible to everything after, the host included. For uploads, read-backs and tests;
    /// frames get their barriers from the render graph.
    pub fn everything_barrier(&mut self) {
        let barrier = [vk::MemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
            .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS | vk::PipelineStageFlags2::HOST)
            .dst_access_mask(
                vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE | vk::AccessFlags2::HOST_READ,
            )];
        // SAFETY: in recording, outside of rendering.
        unsafe {
            self.context
                .device
                .cmd_pipeline_barrier2(self.raw, &vk::DependencyInfo::default().memory_barriers(&barrier));
        }
    }

    /// Keeps `thing` (an image, a buffer, anything that the commands use) alive until the device is done.
    pub fn keep(&mut self, thing: impl Any + Send) {
        self.keep.push(Box::new(thing));
    }

    /// Hands the commands to the device.
    ///
    /// # Errors
    /// `DeviceLost`, `OutOfMemory`; the message names commands and passes.
    pub fn submit(mut self) -> Result<Submission> {
        let context = Arc::clone(&self.context);
        context.alive()?;
        let Some(shell) = &self.shell else { return Err(Error::usage("commands were submitted before")) };
        let fence = shell.fence;
        // SAFETY: in recording.
        let ended = unsafe { context.device.end_command_buffer(self.raw) };
        context.check(ended, || format!("vkEndCommandBuffer for `{}`", self.name))?;
        let buffers = [vk::CommandBufferSubmitInfo::default().command_buffer(self.raw)];
        let submits = [vk::SubmitInfo2::default().command_buffer_infos(&buffers)];
        let queue = lock(&context.queue);
        // SAFETY: the queue is locked; the fence is unsignalled and not in use.
        let submitted = unsafe { context.device.queue_submit2(*queue, &submits, fence) };
        drop(queue);
        context.check(submitted, || {
            let Self { name, passes, .. } = &self;
            match (passes.first(), passes.last()) {
                (Some(first), Some(last)) if first != last => {
                    format!("vkQueueSubmit2 of `{name}`, passes `{first}` to `{last}`")
                }
                (Some(only), _) => format!("vkQueueSubmit2 of `{name}`, pass `{only}`"),
                (None, _) => format!("vkQueueSubmit2 of `{name}`"),
            }
        })?;
        Ok(Submission {
            context,
            shell: self.shell.take(),
            name: std::mem::take(&mut self.name),
            passes: std::mem::take(&mut self.passes),
            keep: std::mem::take(&mut self.keep),
        })
    }
}

impl Drop for Commands {
    fn drop(&mut self) {
        if let Some(shell) = self.shell.take() {
            recycle(&self.context, shell);
        }
    }
}

/// Commands that the device is working on. Dropping it waits, within the same bounds as [`Submission::wait`].
pub struct Submission {
    context: Arc<Context>,
    /// `None` once waited for.
    shell: Option<Shell>,
    name: String,
    passes: Vec<String>,
    keep: Vec<Box<dyn Any + Send>>,
}

impl fmt::Debug for Submission {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Submission(`{}`, {} passes)", self.name, self.passes.len())
    }
}

impl Submission {
    /// Waits until the device is done.
    ///
    /// # Errors
    /// `DeviceLost`, naming the pass that the device was in, if it is lost or still works after the hard limit of
    /// [`super::GpuOptions`]; `Interrupted` if it was asked to stop and does not come to an end soon. The device is then lost as well.
    pub fn wait(mut self) -> Result<()> {
        self.finish()
    }

    /// Whether the device is done.
    ///
    /// # Errors
    /// `DeviceLost`, naming the pass.
    pub fn is_done(&self) -> Result<bool> {
        self.context.alive()?;
        let Some(shell) = &self.shell else { return Ok(true) };
        // SAFETY: the fence is alive.
        match unsafe { self.context.device.get_fence_status(shell.fence) } {
            Ok(done) => Ok(done),
            Err(result) => Err(self.failed(shell, "vkGetFenceStatus", result)),
        }
    }

    fn finish(&mut self) -> Result<()> {
        let Some(shell) = self.shell.take() else { return Ok(()) };
        if self.context.lost.is_set() {
            // Lost through another submission: whether the device still works on this one, nobody can say.
            self.threads_may_go_on();
            self.leave(shell);
            return self.context.alive();
        }
        match self.poll(&shell) {
            Ok(()) => {
                self.keep.clear();
                recycle(&self.context, shell);
                Ok(())
            }
            Err(error) => {
                self.leave(shell);
                Err(error)
            }
        }
    }

    /// Waits, warning after the soft limit and giving up after the hard one.
    fn poll(&self, shell: &Shell) -> Result<()> {
        let context = &self.context;
        let begun = Instant::now();
        let mut warn_at = context.options.soft_limit;
        let mut asked: Option<Instant> = None;
        loop {
            let waited = begun.elapsed();
            let left = context.hard_limit.saturating_sub(waited).min(warn_at.saturating_sub(waited));
            let mut slice = left.max(Duration::from_millis(1));
            if context.options.stop.is_some() {
                slice = slice.min(LOOK);
            }
            let slice_begun = Instant::now();
            // Synchronisation validation (seen in 1.3.239) forgets a wait that ends while another thread submits, and then
            // takes later commands for unsynchronised. Under it, waits and submissions take turns.
            let queue = (context.options.validation == Validation::Sync).then(|| {
                slice = slice.min(Duration::from_millis(10));
                lock(&context.queue)
            });
            // SAFETY: the fence is alive and was submitted.
            let waited_for = unsafe { context.device.wait_for_fences(&[shell.fence], true, slice.as_nanos() as u64) };
            drop(queue);
            match waited_for {
                Ok(()) => return Ok(()),
                Err(vk::Result::TIMEOUT) => {}
                Err(result) => return Err(self.failed(shell, "vkWaitForFences", result)),
            }
            let stop = context.options.stop.as_ref().filter(|stop| stop.requested());
            if let Some(stop) = stop
                && asked.get_or_insert_with(Instant::now).elapsed() >= STOP_LIMIT
            {
                context.abandon();
                let place = self.where_it_was(shell);
                let _ =
                    context.lost.set(format!("stopped on request while the device worked on `{}`{place}", self.name));
                return stop.check();
            }
            let waited = begun.elapsed();
            if waited >= context.hard_limit {
                context.abandon();
                let report = format!(
                    "the device did not finish `{}` within {:.1} s{} on {}",
                    self.name,
                    waited.as_secs_f64(),
                    self.where_it_was(shell),
                    context.description
                );
                return Err(context.lost.set(report));
            }
            if waited >= warn_at {
                log::warn!("waiting for the device since {:.0} s{}", waited.as_secs_f64(), self.where_it_was(shell));
                warn_at *= 2;
            }
            // A driver that answers "not yet" without waiting must not keep a core busy.
            if slice_begun.elapsed() < slice / 2 {
                std::thread::sleep(Duration::from_millis(2));
            }
        }
    }

    fn failed(&self, shell: &Shell, call: &str, result: vk::Result) -> Error {
        if result == vk::Result::ERROR_DEVICE_LOST {
            self.threads_may_go_on();
        }
        let place = self.where_it_was(shell);
        match self.context.check::<()>(Err(result), || format!("{call} for `{}`{place}", self.name)) {
            Err(error) => error,
            Ok(()) => Error::usage("success is no failure"),
        }
    }

    /// The threads of a CPU driver know nothing of a loss and may still write. (Real devices are stopped by their driver
    /// before it reports the loss, so that everything may be destroyed.)
    fn threads_may_go_on(&self) {
        if self.context.caps.kind == DeviceKind::Cpu {
            self.context.abandon();
        }
    }

    /// ", in pass `x` (3 of 12)" or nothing.
    fn where_it_was(&self, shell: &Shell) -> String {
        let count = self.passes.len();
        match shell.last_mark(count) {
            Some(index) => format!(", in pass `{}` ({} of {count})", self.passes[index], index + 1),
            None if count > 0 => format!(", before pass `{}` (1 of {count})", self.passes[0]),
            None => String::new(),
        }
    }

    /// The device is lost: gives up what the submission holds, or leaves it alone if it may still be written to.
    fn leave(&mut self, shell: Shell) {
        if self.context.abandoned() {
            std::mem::forget(shell);
            std::mem::forget(std::mem::take(&mut self.keep));
        } else {
            shell.destroy(&self.context.device, &mut lock(&self.context.allocator));
            self.keep.clear();
        }
    }
}

impl Drop for Submission {
    fn drop(&mut self) {
        let known = self.context.lost.is_set();
        if let Err(error) = self.finish()
            && !known
            && error.kind() != ErrorKind::Interrupted
        {
            log::warn!("{error}");
        }
    }
}

/// Puts a shell that is not in use back for the next submission.
fn recycle(context: &Context, shell: Shell) {
    if context.abandoned() {
        std::mem::forget(shell);
        return;
    }
    // SAFETY: nothing of the shell is in use: it was waited for, or never submitted.
    let reset = unsafe {
        context
            .device
            .reset_command_pool(shell.pool, vk::CommandPoolResetFlags::empty())
            .and_then(|()| context.device.reset_fences(&[shell.fence]))
    };
    if reset.is_ok() && !context.lost.is_set() {
        lock(&context.shells).push(shell);
    } else {
        shell.destroy(&context.device, &mut lock(&context.allocator));
    }
}

//! What one frame in flight needs, and the commands that put it on the screen.

use super::device::{Buffer, Device, Owned};
use super::swapchain::{WHOLE, semaphore};
use super::texture::Texture;
use crate::error::{Error, vk_error};
use ash::vk;
use std::rc::Rc;

/// How long a frame may take on the device, in nanoseconds. A frame of a user interface never takes so long: the
/// device hangs.
const LONGEST_FRAME: u64 = 10_000_000_000;

/// One of the frames that are in flight at the same time.
pub struct Frame {
    pub commands: vk::CommandBuffer,
    /// Signalled when the swapchain image may be drawn to.
    pub acquired: Owned<vk::Semaphore>,
    /// Vertices, then indices.
    pub mesh: Option<Buffer>,
    /// The bytes of textures that this frame uploads.
    pub staging: Option<Buffer>,
    /// Textures that this frame or an earlier one uses and no later one. They go when this frame has finished.
    pub garbage: Vec<Texture>,
    /// Signalled when the device has finished the frame.
    done: Owned<vk::Fence>,
    pool: Owned<vk::CommandPool>,
    device: Rc<Device>,
}

impl Frame {
    pub fn new(device: &Rc<Device>) -> Result<Self, Error> {
        let info = vk::CommandPoolCreateInfo::default()
            .flags(vk::CommandPoolCreateFlags::TRANSIENT)
            .queue_family_index(device.family);
        // SAFETY: the family is the one of the device's queue.
        let pool =
            unsafe { device.raw.create_command_pool(&info, None) }.map_err(|e| vk_error("vkCreateCommandPool", e))?;
        // SAFETY: `Owned` calls this once, with the pool.
        let pool = Owned::new(device, pool, |device, pool| unsafe { device.destroy_command_pool(pool, None) });
        let info = vk::CommandBufferAllocateInfo::default()
            .command_pool(pool.raw)
            .level(vk::CommandBufferLevel::PRIMARY)
            .command_buffer_count(1);
        // SAFETY: the pool exists.
        let commands = unsafe { device.raw.allocate_command_buffers(&info) }
            .map_err(|e| vk_error("vkAllocateCommandBuffers", e))?
            .first()
            .copied()
            .ok_or(vk_error("vkAllocateCommandBuffers", vk::Result::ERROR_UNKNOWN))?;
        let info = vk::FenceCreateInfo::default().flags(vk::FenceCreateFlags::SIGNALED);
        // SAFETY: the device exists.
        let done = unsafe { device.raw.create_fence(&info, None) }.map_err(|e| vk_error("vkCreateFence", e))?;
        // SAFETY: `Owned` calls this once, with the fence.
        let done = Owned::new(device, done, |device, fence| unsafe { device.destroy_fence(fence, None) });
        Ok(Self {
            commands,
            acquired: semaphore(device)?,
            mesh: None,
            staging: None,
            garbage: Vec::new(),
            done,
            pool,
            device: device.clone(),
        })
    }

    /// Waits until the device has finished this frame's last use. Everything of the frame is free then.
    pub fn wait(&mut self) -> Result<(), Error> {
        // SAFETY: the fence belongs to the device.
        unsafe { self.device.raw.wait_for_fences(&[self.done.raw], true, LONGEST_FRAME) }
            .map_err(|e| vk_error("vkWaitForFences", e))?;
        self.garbage.clear();
        Ok(())
    }

    /// Starts the frame's commands anew. Call [`wait`](Self::wait) before.
    pub fn begin(&self) -> Result<(), Error> {
        // SAFETY: the frame has finished, so no command buffer of the pool is in use.
        unsafe { self.device.raw.reset_command_pool(self.pool.raw, vk::CommandPoolResetFlags::empty()) }
            .map_err(|e| vk_error("vkResetCommandPool", e))?;
        let info = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the reset has put the command buffer into its initial state.
        unsafe { self.device.raw.begin_command_buffer(self.commands, &info) }
            .map_err(|e| vk_error("vkBeginCommandBuffer", e))
    }

    /// Records the start of drawing into a swapchain image that has just been acquired.
    pub fn begin_drawing(&self, image: vk::Image, view: vk::ImageView, extent: vk::Extent2D, clear: [f32; 4]) {
        // The acquire semaphore is waited for in the same stage, so the transition comes after the acquisition.
        let drawable = vk::ImageMemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT)
            .dst_stage_mask(vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT)
            .dst_access_mask(vk::AccessFlags2::COLOR_ATTACHMENT_WRITE | vk::AccessFlags2::COLOR_ATTACHMENT_READ)
            .old_layout(vk::ImageLayout::UNDEFINED)
            .new_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL);
        self.barrier(image, drawable);
        let attachments = [vk::RenderingAttachmentInfo::default()
            .image_view(view)
            .image_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .store_op(vk::AttachmentStoreOp::STORE)
            .clear_value(vk::ClearValue { color: vk::ClearColorValue { float32: clear } })];
        let info =
            vk::RenderingInfo::default().render_area(extent.into()).layer_count(1).color_attachments(&attachments);
        // SAFETY: the commands are being recorded, outside of rendering; the view is one of the image.
        unsafe { self.device.raw.cmd_begin_rendering(self.commands, &info) };
    }

    /// Records the end of drawing, ends the commands and hands them to the device.
    pub fn end(&self, image: vk::Image, drawn: vk::Semaphore) -> Result<(), Error> {
        // SAFETY: `begin_drawing` has begun the rendering.
        unsafe { self.device.raw.cmd_end_rendering(self.commands) };
        // The semaphore is signalled after all commands, so the barrier ends in that stage: the transition comes before
        // the presentation.
        let presentable = vk::ImageMemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT)
            .src_access_mask(vk::AccessFlags2::COLOR_ATTACHMENT_WRITE)
            .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .old_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
            .new_layout(vk::ImageLayout::PRESENT_SRC_KHR);
        self.barrier(image, presentable);
        // SAFETY: the commands are being recorded, outside of rendering.
        unsafe { self.device.raw.end_command_buffer(self.commands) }.map_err(|e| vk_error("vkEndCommandBuffer", e))?;
        // SAFETY: the fence is signalled, and no submission that uses it is pending.
        unsafe { self.device.raw.reset_fences(&[self.done.raw]) }.map_err(|e| vk_error("vkResetFences", e))?;
        let waits = [vk::SemaphoreSubmitInfo::default()
            .semaphore(self.acquired.raw)
            .stage_mask(vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT)];
        let signals =
            [vk::SemaphoreSubmitInfo::default().semaphore(drawn).stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)];
        let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(self.commands)];
        let submit = vk::SubmitInfo2::default()
            .wait_semaphore_infos(&waits)
            .command_buffer_infos(&commands)
            .signal_semaphore_infos(&signals);
        // SAFETY: the commands are complete, the acquisition signals the one semaphore, nobody has signalled the other
        // since its last wait, and only this thread uses the queue.
        unsafe { self.device.raw.queue_submit2(self.device.queue, &[submit], self.done.raw) }
            .map_err(|e| vk_error("vkQueueSubmit2", e))
    }

    /// Records a barrier for a whole image.
    pub fn barrier(&self, image: vk::Image, barrier: vk::ImageMemoryBarrier2<'_>) {
        let barriers = [barrier
            .image(image)
            .subresource_range(WHOLE)
            .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)];
        let info = vk::DependencyInfo::default().image_memory_barriers(&barriers);
        // SAFETY: the commands are being recorded, outside of rendering; the image exists.
        unsafe { self.device.raw.cmd_pipeline_barrier2(self.commands, &info) };
    }
}

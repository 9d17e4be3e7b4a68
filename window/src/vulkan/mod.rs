//! Presents egui's output with Vulkan. All unsafe code of the crate is in this folder.

mod device;
mod frame;
mod instance;
mod painter;
mod pipeline;
mod surface;
mod swapchain;
mod texture;

use crate::error::{Error, vk_error};
use crate::textures::Textures;
use ash::vk;
use device::Device;
use egui::ClippedPrimitive;
use frame::Frame;
pub use instance::{Instance, validation_messages};
use painter::Painter;
use std::rc::Rc;
use std::sync::Arc;
use surface::Surface;
use swapchain::Swapchain;
use winit::window::Window;

/// How long the display may keep all images, in nanoseconds. It keeps them while it does not show the window.
const LONGEST_ACQUISITION: u64 = 2_000_000_000;

/// What is painted.
pub struct Picture<'a> {
    pub primitives: &'a [ClippedPrimitive],
    pub pixels_per_point: f32,
    /// Gamma-encoded.
    pub clear: [f32; 4],
}

/// What became of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shown {
    /// The window shows it.
    Yes,
    /// The window has no area.
    NoArea,
    /// The window has changed meanwhile. It must be drawn again.
    Stale,
    /// The display has not given an image back in time.
    Busy,
}

/// All of Vulkan but the instance. After the loss of a device it is made anew.
pub struct Presenter {
    // The order matters: fields are dropped from first to last.
    frames: Vec<Frame>,
    painter: Painter,
    swapchain: Option<Swapchain>,
    format: vk::SurfaceFormatKHR,
    index: usize,
    stale: bool,
    device: Rc<Device>,
    surface: Rc<Surface>,
}

impl Presenter {
    pub fn new(instance: &Rc<Instance>, window: &Arc<Window>, wanted: Option<&str>) -> Result<Self, Error> {
        let surface = Surface::new(instance, window)?;
        let device = Device::new(&surface, wanted)?;
        let format = swapchain::choose_format(&device)?;
        Ok(Self {
            frames: vec![Frame::new(&device)?, Frame::new(&device)?],
            painter: Painter::new(&device, format.format)?,
            swapchain: None,
            format,
            index: 0,
            stale: false,
            device,
            surface,
        })
    }

    /// The largest side of a texture in pixels.
    pub fn max_texture_side(&self) -> usize {
        self.device.max_texture_side as usize
    }

    /// Whether painting takes the time of the CPU.
    pub fn is_cpu(&self) -> bool {
        self.device.is_cpu
    }

    /// Draws a picture and hands it to the display. Changed textures are uploaded on the way.
    pub fn draw(&mut self, picture: &Picture<'_>, textures: &mut Textures) -> Result<Shown, Error> {
        let window = self.surface.window.clone();
        let size: [u32; 2] = window.inner_size().into();
        if size.contains(&0) {
            return Ok(Shown::NoArea);
        }
        self.frames[self.index].wait()?;
        let current = self.swapchain.as_ref().is_some_and(|s| s.window_size == size);
        if self.stale || !current {
            self.renew_swapchain(size)?;
        }
        let Some(swapchain) = &self.swapchain else { return Ok(Shown::NoArea) };
        let frame = &mut self.frames[self.index];
        // SAFETY: the frame has finished, so nothing waits for its semaphore and it is not signalled.
        let acquired = unsafe {
            self.device.swapchains.acquire_next_image(
                swapchain.raw,
                LONGEST_ACQUISITION,
                frame.acquired.raw,
                vk::Fence::null(),
            )
        };
        let image = match acquired {
            Ok((image, suboptimal)) => {
                self.stale |= suboptimal;
                image
            }
            Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => {
                self.stale = true;
                return Ok(Shown::Stale);
            }
            Err(vk::Result::TIMEOUT | vk::Result::NOT_READY) => return Ok(Shown::Busy),
            Err(e) => return Err(vk_error("vkAcquireNextImageKHR", e)),
        };
        let target =
            swapchain.images.get(image as usize).ok_or(vk_error("vkAcquireNextImageKHR", vk::Result::ERROR_UNKNOWN))?;
        frame.begin()?;
        self.painter.upload(frame, textures)?;
        let vertices = self.painter.stage(frame, picture.primitives)?;
        frame.begin_drawing(target.raw, target.view.raw, swapchain.extent, picture.clear);
        self.painter.draw(frame, picture.primitives, vertices, swapchain.extent, picture.pixels_per_point);
        frame.end(target.raw, target.drawn.raw)?;
        self.index = (self.index + 1) % self.frames.len();
        window.pre_present_notify();
        let (semaphores, swapchains, images) = ([target.drawn.raw], [swapchain.raw], [image]);
        let info =
            vk::PresentInfoKHR::default().wait_semaphores(&semaphores).swapchains(&swapchains).image_indices(&images);
        // SAFETY: the image is acquired, the submitted commands signal the semaphore, and only this thread uses the
        // queue.
        match unsafe { self.device.swapchains.queue_present(self.device.queue, &info) } {
            Ok(suboptimal) => {
                self.stale |= suboptimal;
                Ok(Shown::Yes)
            }
            Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => {
                self.stale = true;
                Ok(Shown::Stale)
            }
            Err(e) => Err(vk_error("vkQueuePresentKHR", e)),
        }
    }

    fn renew_swapchain(&mut self, size: [u32; 2]) -> Result<(), Error> {
        // Bounded waits first: the wait for the whole device has no limit.
        for frame in &mut self.frames {
            frame.wait()?;
        }
        self.device.wait_idle();
        let old = self.swapchain.take();
        self.swapchain = Swapchain::new(&self.device, &self.surface, self.format, size, old.as_ref())?;
        self.stale = false;
        Ok(())
    }
}

impl Drop for Presenter {
    fn drop(&mut self) {
        self.device.wait_idle();
    }
}

//! One window with an [egui] user interface, painted by Vulkan.
//!
//! [`run`] opens the window and returns when it is closed. The window is calm: it draws only when there is something
//! new to show. A frame is drawn on input that egui reacts to, when the window system asks for one, after the delay that
//! the program has given to `Context::request_repaint_after`, and when a [`Waker`] of any thread asks for one.
//!
//! A texture's bytes reach the window unchanged if it is painted one texel to one pixel; see [`run`].
#![deny(unsafe_code, unsafe_op_in_unsafe_fn)]
#![warn(missing_docs)]

mod error;
mod handler;
mod live;
mod textures;
#[allow(unsafe_code)]
mod vulkan;
mod waker;

pub use error::Error;
pub use vulkan::validation_messages;
pub use waker::Waker;

use winit::error::EventLoopError;
use winit::event_loop::EventLoop;

/// What a program shows in the window.
pub trait App {
    /// Builds the user interface. It is called for each frame, and sometimes twice for one.
    ///
    /// Further frames come when they are asked for by `context.request_repaint` and its relatives.
    fn ui(&mut self, context: &egui::Context);

    /// The window is about to close. This is the place to save what must not be lost.
    fn closing(&mut self) {}
}

/// How the window is opened.
#[derive(Clone, Debug)]
pub struct Options {
    /// The text in the title bar.
    pub title: String,
    /// The first width and height in logical points.
    pub size: [f64; 2],
    /// Names the program to the desktop, which finds its icon by it. The desktop file must have the same name.
    pub app_id: String,
    /// Checks the use of Vulkan by its validation layer; see [`validation_messages`]. This is slow.
    pub validation: bool,
    /// The device that draws, by a part of its name. None means the best one that can present.
    pub device: Option<String>,
    /// For tests: the window may be opened by another thread than the main one. It has an effect on Linux only.
    #[doc(hidden)]
    pub any_thread: bool,
    /// For tests: the device is treated as lost at these frames.
    #[doc(hidden)]
    pub lose_at: Vec<u64>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            title: String::new(),
            size: [1280.0, 800.0],
            app_id: "lucerna".to_owned(),
            validation: false,
            device: None,
            any_thread: false,
            lose_at: Vec::new(),
        }
    }
}

/// Opens the window, makes the program's [`App`] by `make`, and returns when the window has been closed.
///
/// Call it on the main thread, and once in a process: the window systems allow no second event loop. [`App::closing`]
/// is called before it returns, with an error too, if there is an app.
///
/// The window stores gamma-encoded colours as they are. A texture comes back with exactly its bytes under three
/// conditions: it is opaque, it is painted in white at a whole pixel, and it has one texel per pixel. Points are pixels
/// divided by `context.pixels_per_point()`. Use `TextureOptions::NEAREST`.
///
/// # Errors
/// Gives an [`Error`] if the window cannot be opened, if `make` fails, or if Vulkan fails. A lost device is made anew;
/// the third loss in a row is an error.
pub fn run(
    options: Options,
    make: impl FnOnce(Waker, &egui::Context) -> Result<Box<dyn App>, Box<dyn std::error::Error + Send + Sync>>,
) -> Result<(), Error> {
    let mut builder = EventLoop::<waker::Event>::with_user_event();
    #[cfg(target_os = "linux")]
    if options.any_thread {
        // The one call is enough: both window systems share the setting.
        winit::platform::x11::EventLoopBuilderExtX11::with_any_thread(&mut builder, true);
    }
    let event_loop = builder.build().map_err(|e| match e {
        EventLoopError::RecreationAttempt => Error::Window("A process can open a window only once.".to_owned()),
        e => Error::NoDisplay(error::without_place(&e)),
    })?;
    let mut handler = handler::Handler::new(options, make, event_loop.create_proxy());
    let ended = event_loop.run_app(&mut handler);
    handler.finish()?;
    ended.map_err(|e| Error::Window(format!("The event loop failed: {}", error::without_place(&e))))
}

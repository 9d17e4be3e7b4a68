//! What can go wrong.

use ash::vk;
use std::fmt;

/// Why a window cannot be opened or has to close.
#[derive(Debug)]
#[non_exhaustive]
pub enum Error {
    /// There is no display, or it does not answer. A program can go on without a window.
    NoDisplay(String),
    /// No Vulkan device can draw the window, or a part of Vulkan that was asked for is not installed.
    NoDevice(String),
    /// A call of Vulkan failed.
    Vulkan {
        /// The name of the function.
        call: &'static str,
        /// What it returned.
        result: vk::Result,
    },
    /// The window system refused something.
    Window(String),
    /// The program's own error, from the function that makes the [`App`](crate::App).
    App(Box<dyn std::error::Error + Send + Sync>),
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoDisplay(text) => write!(f, "There is no display to open a window on. {text}"),
            Self::NoDevice(text) | Self::Window(text) => f.write_str(text),
            Self::Vulkan { call, result } => write!(f, "{call} failed: {result:?}"),
            Self::App(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Vulkan { result, .. } => Some(result),
            Self::App(error) => error.source(),
            _ => None,
        }
    }
}

impl Error {
    /// Whether a new device and a new surface can help.
    pub(crate) fn is_loss(&self) -> bool {
        matches!(self, Self::Vulkan { result: vk::Result::ERROR_DEVICE_LOST | vk::Result::ERROR_SURFACE_LOST_KHR, .. })
    }
}

pub(crate) fn vk_error(call: &'static str, result: vk::Result) -> Error {
    Error::Vulkan { call, result }
}

/// The text of an error of winit, without the place in winit's source code that it begins with.
pub(crate) fn without_place(error: &dyn fmt::Display) -> String {
    let text = error.to_string();
    let rest = text.split_once(".rs:").and_then(|(_, rest)| rest.split_once(": "));
    rest.map_or(text.clone(), |(_, reason)| reason.to_owned())
}

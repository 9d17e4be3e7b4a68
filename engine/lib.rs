//! lucerna: real-time global illumination and HDR tone mapping from six papers, on any Vulkan device or none.
#![deny(unsafe_code)]
#![warn(missing_debug_implementations)]

pub mod error;
pub mod gpu;
pub mod graph;
pub mod image;
pub mod passes;
pub mod reference;
pub mod scene;
pub mod shader;
pub mod techniques;

pub use error::{Error, ErrorKind, Result};

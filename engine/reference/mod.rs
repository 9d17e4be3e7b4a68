//! Slow and obvious CPU versions of what the shaders compute, written from the papers and not from the shaders; and the
//! progressive path tracer that makes reference pictures on the device.

pub mod brdf;
pub mod fiv;
pub mod fiv_specular;
pub mod isr;
pub mod isr_scene;
pub mod overlap;
pub mod path;
pub mod tonemap;
pub mod tracer;

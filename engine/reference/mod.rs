//! Slow and obvious CPU versions of what the shaders compute, written from the papers and not from the shaders.

pub mod brdf;
pub mod fiv;
pub mod fiv_specular;
pub mod isr;
pub mod isr_scene;
pub mod overlap;
pub mod path;
pub mod tonemap;

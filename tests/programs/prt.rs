//! One program for several files of tests: linking the engine once saves minutes.

#[path = "../tracer_lab/mod.rs"]
mod tracer_lab;

#[path = "../prt_light.rs"]
mod prt_light;

#[path = "../prt_pixels.rs"]
mod prt_pixels;

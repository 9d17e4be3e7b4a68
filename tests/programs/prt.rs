//! One program for several files of tests: linking the engine once saves minutes.

#[path = "../prt_lab/mod.rs"]
mod prt_lab;
#[path = "../tracer_lab/mod.rs"]
mod tracer_lab;

#[path = "../prt_glossy.rs"]
mod prt_glossy;
#[path = "../prt_light.rs"]
mod prt_light;
#[path = "../prt_links.rs"]
mod prt_links;
#[path = "../prt_moving.rs"]
mod prt_moving;
#[path = "../prt_odd.rs"]
mod prt_odd;
#[path = "../prt_pixels.rs"]
mod prt_pixels;
#[path = "../prt_samples.rs"]
mod prt_samples;
#[path = "../prt_shadows.rs"]
mod prt_shadows;
#[path = "../prt_transfer.rs"]
mod prt_transfer;
#[path = "../prt_units.rs"]
mod prt_units;
#[path = "../prt_visibility.rs"]
mod prt_visibility;

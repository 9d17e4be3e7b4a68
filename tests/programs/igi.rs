//! One program for several files of tests: linking the engine once saves minutes.

#[path = "../igi_lab/mod.rs"]
mod igi_lab;
#[path = "../igi_picks/mod.rs"]
mod igi_picks;
#[path = "../isr_lab/mod.rs"]
mod isr_lab;
#[path = "../tracer_lab/mod.rs"]
mod tracer_lab;

#[path = "../igi_cells.rs"]
mod igi_cells;
#[path = "../igi_cpu_reference.rs"]
mod igi_cpu_reference;
#[path = "../igi_exact.rs"]
mod igi_exact;
#[path = "../igi_filters.rs"]
mod igi_filters;
#[path = "../igi_light.rs"]
mod igi_light;
#[path = "../igi_many.rs"]
mod igi_many;
#[path = "../igi_mirrors.rs"]
mod igi_mirrors;
#[path = "../igi_odd.rs"]
mod igi_odd;
#[path = "../igi_raster.rs"]
mod igi_raster;
#[path = "../igi_sixty.rs"]
mod igi_sixty;
#[path = "../igi_soft.rs"]
mod igi_soft;
#[path = "../igi_time.rs"]
mod igi_time;
#[path = "../igi_twins.rs"]
mod igi_twins;

//! One program for several files of tests: linking the engine once saves minutes.

#[path = "../gpu_common/mod.rs"]
mod gpu_common;

#[path = "../gpu_memory.rs"]
mod gpu_memory;
#[path = "../graph_accel.rs"]
mod graph_accel;
#[path = "../graph_plan.rs"]
mod graph_plan;
#[path = "../graph_random.rs"]
mod graph_random;
#[path = "../graph_raster.rs"]
mod graph_raster;
#[path = "../graph_run.rs"]
mod graph_run;
#[path = "../graph_shipped.rs"]
mod graph_shipped;

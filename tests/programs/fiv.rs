//! One program for several files of tests: linking the engine once saves minutes.

#[path = "../common/mod.rs"]
mod common;
#[path = "../fiv_lab/mod.rs"]
mod fiv_lab;
#[path = "../tracer_lab/mod.rs"]
mod tracer_lab;

#[path = "../fiv_cut.rs"]
mod fiv_cut;
#[path = "../fiv_cutout.rs"]
mod fiv_cutout;
#[path = "../fiv_many.rs"]
mod fiv_many;
#[path = "../fiv_moving.rs"]
mod fiv_moving;
#[path = "../fiv_negligible.rs"]
mod fiv_negligible;
#[path = "../fiv_odd.rs"]
mod fiv_odd;
#[path = "../fiv_online.rs"]
mod fiv_online;
#[path = "../fiv_parallel.rs"]
mod fiv_parallel;
#[path = "../fiv_picture.rs"]
mod fiv_picture;
#[path = "../fiv_prepared.rs"]
mod fiv_prepared;
#[path = "../fiv_specular.rs"]
mod fiv_specular;
#[path = "../fiv_truth.rs"]
mod fiv_truth;
#[path = "../fiv_vectors.rs"]
mod fiv_vectors;

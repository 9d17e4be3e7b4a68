//! One program for several files of tests: linking the engine once saves minutes.

#[path = "../common/mod.rs"]
mod common;
#[path = "../agreement/images.rs"]
mod images;

#[path = "../image_assets.rs"]
mod image_assets;
#[path = "../image_formats.rs"]
mod image_formats;
#[path = "../image_odd.rs"]
mod image_odd;
#[path = "../image_read.rs"]
mod image_read;
#[path = "../measure_agreement.rs"]
mod measure_agreement;
#[path = "../measure_arithmetic.rs"]
mod measure_arithmetic;
#[path = "../measure_vdp.rs"]
mod measure_vdp;

//! One program for several files of tests: linking the engine once saves minutes.

#[path = "../common/mod.rs"]
mod common;
#[path = "../agreement/pyramids.rs"]
mod pyramids;

#[path = "../tonemap_adaptation.rs"]
mod tonemap_adaptation;
#[path = "../tonemap_agreement.rs"]
mod tonemap_agreement;
#[path = "../tonemap_operators.rs"]
mod tonemap_operators;
#[path = "../tonemap_pyramid.rs"]
mod tonemap_pyramid;
#[path = "../tonemap_reduction.rs"]
mod tonemap_reduction;
#[path = "../tonemap_selective.rs"]
mod tonemap_selective;
#[path = "../tonemap_settings.rs"]
mod tonemap_settings;
#[path = "../tonemap_solved.rs"]
mod tonemap_solved;
#[path = "../tonemap_twin.rs"]
mod tonemap_twin;

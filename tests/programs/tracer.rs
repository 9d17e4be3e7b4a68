//! One program for several files of tests: linking the engine once saves minutes.

#[path = "../common/mod.rs"]
mod common;
#[path = "../reference_kit/mod.rs"]
mod reference_kit;
#[path = "../scene_kit/mod.rs"]
mod scene_kit;
#[path = "../tracer_lab/mod.rs"]
mod tracer_lab;

#[path = "../reference_agreement.rs"]
mod reference_agreement;
#[path = "../reference_closed_forms.rs"]
mod reference_closed_forms;
#[path = "../reference_planted.rs"]
mod reference_planted;
#[path = "../tracer_closed_forms.rs"]
mod tracer_closed_forms;
#[path = "../tracer_frames.rs"]
mod tracer_frames;
#[path = "../tracer_invariants.rs"]
mod tracer_invariants;
#[path = "../tracer_moves.rs"]
mod tracer_moves;
#[path = "../tracer_points.rs"]
mod tracer_points;
#[path = "../tracer_samplers.rs"]
mod tracer_samplers;
#[path = "../tracer_surfaces.rs"]
mod tracer_surfaces;
#[path = "../tracer_textures.rs"]
mod tracer_textures;

//! One program for several files of tests: linking the engine once saves minutes.

#[path = "../isr_lab/mod.rs"]
mod isr_lab;
#[path = "../scene_kit/mod.rs"]
mod scene_kit;
#[path = "../tracer_lab/mod.rs"]
mod tracer_lab;

#[path = "../isr_area.rs"]
mod isr_area;
#[path = "../isr_closed_forms.rs"]
mod isr_closed_forms;
#[path = "../isr_frame.rs"]
mod isr_frame;
#[path = "../isr_light.rs"]
mod isr_light;
#[path = "../isr_passes.rs"]
mod isr_passes;
#[path = "../isr_reference.rs"]
mod isr_reference;
#[path = "../isr_senders.rs"]
mod isr_senders;
#[path = "../isr_senders_scene.rs"]
mod isr_senders_scene;
#[path = "../smooth_edges.rs"]
mod smooth_edges;
#[path = "../temporal.rs"]
mod temporal;
#[path = "../temporal_twin.rs"]
mod temporal_twin;

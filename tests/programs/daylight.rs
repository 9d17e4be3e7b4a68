//! One program for several files of tests: linking the engine once saves minutes.

#[path = "../daylight_lab/mod.rs"]
mod daylight_lab;
#[path = "../tracer_lab/mod.rs"]
mod tracer_lab;

#[path = "../daylight_added.rs"]
mod daylight_added;
#[path = "../daylight_added_lamps.rs"]
mod daylight_added_lamps;
#[path = "../daylight_backs.rs"]
mod daylight_backs;
#[path = "../daylight_blocks.rs"]
mod daylight_blocks;
#[path = "../daylight_cube.rs"]
mod daylight_cube;
#[path = "../daylight_day.rs"]
mod daylight_day;
#[path = "../daylight_exact.rs"]
mod daylight_exact;
#[path = "../daylight_frames.rs"]
mod daylight_frames;
#[path = "../daylight_gloss.rs"]
mod daylight_gloss;
#[path = "../daylight_lamps.rs"]
mod daylight_lamps;
#[path = "../daylight_light.rs"]
mod daylight_light;
#[path = "../daylight_lightmap.rs"]
mod daylight_lightmap;
#[path = "../daylight_masks.rs"]
mod daylight_masks;
#[path = "../daylight_probes.rs"]
mod daylight_probes;
#[path = "../daylight_sequence.rs"]
mod daylight_sequence;
#[path = "../daylight_sky.rs"]
mod daylight_sky;
#[path = "../daylight_sun.rs"]
mod daylight_sun;
#[path = "../daylight_visibility.rs"]
mod daylight_visibility;

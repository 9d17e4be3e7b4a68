//! One program for the tests of the command line: linking the engine once saves minutes.

#[path = "../cli/experiment_lab.rs"]
mod experiment_lab;
#[path = "../gpu_common/fault.rs"]
mod fault;
#[path = "../cli/support.rs"]
mod support;

#[path = "../cli/added.rs"]
mod added;
#[path = "../cli/bake.rs"]
mod bake;
#[path = "../cli/compare.rs"]
mod compare;
#[path = "../cli/daylight.rs"]
mod daylight;
#[path = "../cli/daylight_experiment.rs"]
mod daylight_experiment;
#[path = "../cli/daylight_export.rs"]
mod daylight_export;
#[path = "../cli/daylight_export_more.rs"]
mod daylight_export_more;
#[path = "../cli/daylight_more.rs"]
mod daylight_more;
#[path = "../cli/daylight_pictures.rs"]
mod daylight_pictures;
#[path = "../cli/door.rs"]
mod door;
#[path = "../cli/effects.rs"]
mod effects;
#[path = "../cli/experiment.rs"]
mod experiment;
#[path = "../cli/experiment_files.rs"]
mod experiment_files;
#[path = "../cli/experiment_place.rs"]
mod experiment_place;
#[path = "../cli/export_gltf.rs"]
mod export_gltf;
#[path = "../cli/export_pov.rs"]
mod export_pov;
#[path = "../cli/faults.rs"]
mod faults;
#[path = "../cli/first_picture.rs"]
mod first_picture;
#[path = "../cli/fiv.rs"]
mod fiv;
#[path = "../cli/igi.rs"]
mod igi;
#[path = "../cli/igi_experiment.rs"]
mod igi_experiment;
#[path = "../cli/important.rs"]
mod important;
#[path = "../cli/lucerna.rs"]
mod lucerna;
#[path = "../cli/papers.rs"]
mod papers;
#[path = "../cli/path.rs"]
mod path;
#[path = "../cli/prt.rs"]
mod prt;
#[path = "../cli/prt_bake.rs"]
mod prt_bake;
#[path = "../cli/prt_experiment.rs"]
mod prt_experiment;
#[path = "../cli/prt_rooms.rs"]
mod prt_rooms;
#[path = "../cli/reference.rs"]
mod reference;
#[path = "../cli/render.rs"]
mod render;
#[path = "../cli/rerun.rs"]
mod rerun;
#[path = "../cli/smooth.rs"]
mod smooth;
#[path = "../cli/terrain.rs"]
mod terrain;
#[path = "../cli/tonemap.rs"]
mod tonemap;
#[path = "../cli/tonemap_light.rs"]
mod tonemap_light;

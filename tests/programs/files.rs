//! One program for several files of tests: linking the engine once saves minutes.

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/gltf.rs"]
mod gltf;

#[path = "../equations.rs"]
mod equations;
#[path = "../gltf_assets.rs"]
mod gltf_assets;
#[path = "../gltf_features.rs"]
mod gltf_features;
#[path = "../gltf_fuzz.rs"]
mod gltf_fuzz;
#[path = "../module_order.rs"]
mod module_order;
#[path = "../obj_assets.rs"]
mod obj_assets;
#[path = "../obj_features.rs"]
mod obj_features;
#[path = "../scene_polygons.rs"]
mod scene_polygons;
#[path = "../shader_interface.rs"]
mod shader_interface;

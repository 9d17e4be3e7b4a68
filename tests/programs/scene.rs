//! One program for several files of tests: linking the engine once saves minutes.

#[path = "../common/mod.rs"]
mod common;
#[path = "../fiv_lab/mod.rs"]
mod fiv_lab;
#[path = "../igi_lab/mod.rs"]
mod igi_lab;
#[path = "../isr_lab/mod.rs"]
mod isr_lab;
#[path = "../rays_kit/mod.rs"]
mod rays_kit;
#[path = "../scene_kit/mod.rs"]
mod scene_kit;
#[path = "../tracer_lab/mod.rs"]
mod tracer_lab;

#[path = "../edges.rs"]
mod edges;
#[path = "../layered.rs"]
mod layered;
#[path = "../rays_exact.rs"]
mod rays_exact;
#[path = "../rays_order.rs"]
mod rays_order;
#[path = "../rays_query.rs"]
mod rays_query;
#[path = "../rays_scenes.rs"]
mod rays_scenes;
#[path = "../rays_surfaces.rs"]
mod rays_surfaces;
#[path = "../scene_deform.rs"]
mod scene_deform;
#[path = "../scene_extremes.rs"]
mod scene_extremes;
#[path = "../scene_gbuffer.rs"]
mod scene_gbuffer;
#[path = "../scene_matte.rs"]
mod scene_matte;
#[path = "../scene_plan.rs"]
mod scene_plan;
#[path = "../scene_shadows.rs"]
mod scene_shadows;
#[path = "../scene_skybox.rs"]
mod scene_skybox;
#[path = "../scene_surfaces.rs"]
mod scene_surfaces;
#[path = "../scene_textures.rs"]
mod scene_textures;
#[path = "../seeds.rs"]
mod seeds;
#[path = "../sharp_surfaces.rs"]
mod sharp_surfaces;
#[path = "../sky_plates.rs"]
mod sky_plates;
#[path = "../techniques.rs"]
mod techniques;

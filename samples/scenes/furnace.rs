//! Two scenes with closed-form answers.

use super::kit::{Model, Stage, cuboid, sphere, uniform_environment};
use glam::Vec3;
use lucerna::scene::{Material, Scene};

/// Albedo of every surface in both furnaces.
pub const ALBEDO: f32 = 0.5;
/// Radiance of the environment of `furnace-sphere`, W/(sr·m²), the same from every direction.
pub const RADIANCE: f32 = 0.4;
/// Radiance that every wall of `furnace` emits, W/(sr·m²).
pub const EMISSION: f32 = 0.12;

/// A diffuse sphere, convex, in a uniform environment: it shows `ALBEDO · RADIANCE` at every point, exactly, since it
/// cannot see itself.
pub(super) fn build_sphere() -> Scene {
    let mut stage = Stage::new("furnace-sphere");
    let grey = stage.material(Material::diffuse("grey", Vec3::splat(ALBEDO)));
    stage.add("sphere", Model::of(grey, sphere(1.0, 96, 48)));
    stage.scene.environment = Some(uniform_environment("uniform", Vec3::splat(RADIANCE)));
    stage.camera("front", [0.0, 0.0, 4.0], [0.0; 3], 40.0);
    stage.camera("above", [0.5, 3.6, 1.2], [0.0; 3], 40.0);
    stage.camera("close", [1.4, 0.3, 0.9], [0.0; 3], 50.0);
    stage.finish()
}

/// The inside of a closed cube of 2 m whose walls emit and reflect alike: with b bounces every point shows
/// `EMISSION · (1 + ALBEDO + … + ALBEDO^b)`, in the limit `EMISSION / (1 − ALBEDO)`.
pub(super) fn build_box() -> Scene {
    let mut stage = Stage::new("furnace");
    let wall =
        stage.material(Material { emissive: Vec3::splat(EMISSION), ..Material::diffuse("wall", Vec3::splat(ALBEDO)) });
    stage.add("box", Model::of(wall, cuboid(2.0, 2.0, 2.0).flipped()));
    stage.camera("corner", [0.7, 0.5, 0.7], [-1.0, -0.6, -1.0], 60.0);
    stage.camera("wall", [0.0, 0.0, 0.8], [0.0, 0.0, -1.0], 60.0);
    stage.camera("floor", [0.2, 0.8, 0.1], [0.0, -1.0, 0.0], 70.0);
    stage.finish()
}

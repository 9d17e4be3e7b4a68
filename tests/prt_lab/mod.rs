//! Bakes and pictures of small rooms, for the tests of precomputed transfer.
#![allow(dead_code)]

use crate::tracer_lab::Stage;
use glam::{Vec3, vec3};
use lucerna::{
    Result, Stop,
    bake::{self, Options, Store},
    gpu::Gpu,
    graph::{Graph, Runner},
    image::Layers,
    scene::{Material, Pose, Scene, View},
    technique::{Ready, Shot, Technique},
    techniques::prt::{Baked, Bakery, Baking, Direct, Mode, PictureSettings, Prt, Sampled, Stored, starts, units},
};

pub fn small() -> Baking {
    Baking {
        samples: 3000,
        cluster: 250,
        directions: 400,
        visibility: 24,
        examples: 200,
        rays: 256,
        ..Baking::default()
    }
}

pub fn sampled(gpu: &Gpu, scene: &Scene, baking: &Baking) -> Result<(Bakery, Sampled)> {
    let mut bakery = Bakery::new(gpu, scene)?;
    let sampled = bakery.sample(baking, &starts(scene).points, &Stop::default())?;
    Ok((bakery, sampled))
}

pub fn baked(gpu: &Gpu, scene: &Scene, baking: &Baking) -> Stored {
    let (bakery, sampled) = sampled(gpu, scene, baking).unwrap();
    stored(bakery, sampled)
}

/// As [`baked`], with the rooms that lights do not reach.
pub fn baked_with_rooms(gpu: &Gpu, scene: &Scene, baking: &Baking) -> Stored {
    let mut bakery = Bakery::new(gpu, scene).unwrap();
    let starts = bakery.starts(baking, &Stop::default()).unwrap().points;
    let sampled = bakery.sample(baking, &starts, &Stop::default()).unwrap();
    stored(bakery, sampled)
}

fn stored(bakery: Bakery, sampled: Sampled) -> Stored {
    let folder = tempfile::tempdir().unwrap();
    let job = units::job(&sampled.plan, &sampled.samples, "device").unwrap();
    let store = Store::create(&folder.path().join("room.parts"), job).unwrap();
    let samples = sampled.samples.clone();
    let mut work = units::Work::new(bakery, sampled).unwrap();
    bake::run(&store, &Options::default(), |unit, needed| work.unit(unit, &needed), |_| {}).unwrap();
    Stored::join(&store, samples).unwrap()
}

/// The inside of a box of 2×2×2 m with a lamp in it.
pub fn closed(albedo: Vec3) -> Scene {
    let mut stage = Stage::new();
    let wall = stage.material(Material::diffuse("wall", albedo));
    stage.cuboid(wall, Vec3::splat(-1.0), Vec3::ONE, true);
    stage.point(vec3(0.2, 0.3, -0.1), Vec3::splat(3.0));
    stage.scene
}

/// The inside of a room of 4×2.5×3 m, from −2, 0, −1.5. Materials: at −X and at +X, floor, ceiling, at −Z and at +Z.
pub fn walls(stage: &mut Stage, [left, right, floor, ceiling, back, front]: [u32; 6]) {
    let (x, y, z) = (Vec3::X * 4.0, Vec3::Y * 2.5, Vec3::Z * 3.0);
    let low = vec3(-2.0, 0.0, -1.5);
    stage.quad(left, low, y, z);
    stage.quad(right, low + x, z, y);
    stage.quad(floor, low, z, x);
    stage.quad(ceiling, low + y, x, z);
    stage.quad(back, low, x, y);
    stage.quad(front, low + z, y, x);
}

pub fn picture(
    gpu: &Gpu,
    scene: &Scene,
    stored: &Stored,
    view: &View,
    settings: &PictureSettings,
    mode: Mode,
) -> Layers {
    let baked = Baked::new(stored.clone());
    let mut ready = Ready::<Prt>::new(gpu, scene, settings, Some(&baked), &mut |_, _| true).unwrap();
    let mut graph = Graph::new(Prt::NAME);
    let shot = Shot { mode, ..Shot::default() };
    let picture = ready.frame(&mut graph, (scene, &Pose::rest(scene)), view, shot, settings).unwrap();
    let reading = picture.read(&mut graph, true, false);
    let frame = Runner::new(gpu).run(&graph).unwrap();
    reading.layers(&frame)
}

/// Diffuse surfaces, and shadows by the samples.
pub fn diffuse() -> PictureSettings {
    let mut settings = PictureSettings::default();
    settings.prt.gloss = false;
    settings.prt.direct = Direct::Samples;
    settings
}

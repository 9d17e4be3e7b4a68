//! Pictures of instant global illumination with their intermediate results, for tests.
#![allow(dead_code)]

pub mod twins;

use crate::tracer_lab::Stage;
use glam::Vec3;
use lucerna::{
    gpu::Gpu,
    graph::{Graph, Runner},
    resident::Resident,
    scene::{Material, Pose, Scene, View},
    shaders::types,
    techniques::igi::{Igi, PictureSettings, Settings},
};

/// The images of a picture, and its virtual lights.
pub struct Shown {
    pub total: Vec<[f32; 4]>,
    pub direct: Vec<[f32; 4]>,
    pub indirect: Vec<[f32; 4]>,
    pub irradiance: Vec<[f32; 4]>,
    /// Irradiance before the filters; alpha: number of shadow rays.
    pub gathered: Vec<[f32; 4]>,
    pub albedo: Vec<[f32; 4]>,
    pub vpls: Vec<types::Vpl>,
    /// Nodes of the light tree; empty without a tree.
    pub nodes: Vec<types::VplNode>,
    /// Number of cells of the irradiance cache; 0 without a cache.
    pub cells: u32,
}

/// A scene on the device, for several pictures.
pub struct Studio<'a> {
    scene: &'a Scene,
    resident: Resident,
    igi: Igi,
    runner: Runner,
    /// Frame number of the next picture.
    pub frame: u32,
    pub pose: Pose,
}

impl<'a> Studio<'a> {
    pub fn new(gpu: &Gpu, scene: &'a Scene) -> Self {
        Self::with(gpu, scene, &Settings::default())
    }

    /// Prepares the scene for settings that choose how rays are traced.
    pub fn with(gpu: &Gpu, scene: &'a Scene, settings: &Settings) -> Self {
        let resident = Resident::new(gpu, scene).unwrap();
        let igi = Igi::new(gpu, scene, &resident, settings).unwrap();
        Self { scene, pose: Pose::rest(scene), resident, igi, runner: Runner::new(gpu), frame: 0 }
    }

    pub fn render(&mut self, view: &View, settings: &Settings, seed: u32) -> Shown {
        let mut graph = Graph::new("igi");
        graph.seed = seed;
        graph.frame = self.frame;
        let handles = self.resident.frame_in(&mut graph, self.scene, &self.pose);
        let view = view.fit_far(&handles.bounds());
        let all = PictureSettings { igi: settings.clone(), ..Default::default() };
        let picture = self.igi.picture(&mut graph, self.scene, &self.pose, &handles, &view, &all).unwrap();
        let out = picture.outputs;
        let albedo = picture.gbuffer.albedo;
        let images = [out.total, out.direct, out.indirect, out.irradiance, out.gathered, albedo]
            .map(|image| graph.read_image(image));
        let vpls = out.vpls.map(|vpls| graph.read_buffer(vpls.buffer));
        let nodes = out.vpls.and_then(|vpls| vpls.tree).map(|tree| graph.read_buffer(tree.nodes));
        let cells = out.cache.map(|cache| graph.read_buffer(cache.list));
        let frame = self.runner.run(&graph).unwrap_or_else(|error| panic!("{error}"));
        let [total, direct, indirect, irradiance, gathered, albedo] = images.map(|token| frame.image(token).to_f32());
        for pixel in total.iter().chain(&irradiance).flatten() {
            assert!(pixel.is_finite() && *pixel >= 0.0, "{pixel}");
        }
        Shown {
            total,
            direct,
            indirect,
            irradiance,
            gathered,
            albedo,
            vpls: vpls.map(|token| frame.buffer(token)).unwrap_or_default(),
            nodes: nodes.map(|token| frame.buffer(token)).unwrap_or_default(),
            cells: cells.map_or(0, |token| frame.buffer::<u32>(token)[0]),
        }
    }
}

/// A closed box of half side 1 around the origin.
pub fn room(albedo: Vec3) -> Stage {
    let mut stage = Stage::new();
    let wall = stage.material(Material::diffuse("wall", albedo));
    stage.cuboid(wall, Vec3::splat(-1.0), Vec3::ONE, true);
    stage
}

/// Settings for diffuse surfaces only, without a bound, with one bounce.
pub fn plain(vpls: u32) -> Settings {
    Settings {
        vpls,
        candidates: 1,
        bounces: 1,
        bound: 0.0,
        compensation: 0,
        compensation_filter: 0,
        specular: false,
        direct_samples: 4,
        direct_filter: 0,
        ..Settings::default()
    }
}

/// Mean of red, green and blue over the picture.
pub fn mean(pixels: &[[f32; 4]]) -> f64 {
    pixels.iter().map(|p| f64::from(p[0]) + f64::from(p[1]) + f64::from(p[2])).sum::<f64>() / (3 * pixels.len()) as f64
}

/// Sum of the flux of the virtual lights of one depth, W.
pub fn flux(vpls: &[types::Vpl], depth: u32) -> Vec3 {
    let sum: glam::DVec3 = vpls.iter().filter(|v| v.depth == depth).map(|v| Vec3::from(v.flux).as_dvec3()).sum();
    sum.as_vec3()
}

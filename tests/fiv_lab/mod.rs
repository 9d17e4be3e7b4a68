//! Environments, bodies and pictures for the tests of fullsphere irradiance vectors.
#![allow(dead_code)]

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Mat4, Vec3, Vec4};
use lucerna::{
    gpu::Gpu,
    graph::{Graph, Runner},
    reference::fiv::Vectors,
    resident::Resident,
    scene::{Environment, Material, Mesh, Node, Pose, Primitive, Scene, Transform, View, bvh::Bvh},
    techniques::fiv::{Fiv, Occluder, Occluders, PictureSettings, Settings, Stored},
};

/// A latitude-longitude picture of a function of the direction.
pub fn painted(width: u32, light: impl Fn(DVec3) -> Vec3) -> Environment {
    let height = width / 2;
    let at = |i: u32| {
        let azimuth = TAU * ((f64::from(i % width) + 0.5) / f64::from(width) - 0.5);
        let polar = PI * (f64::from(i / width) + 0.5) / f64::from(height);
        light(DVec3::new(polar.sin() * azimuth.sin(), polar.cos(), -polar.sin() * azimuth.cos()))
    };
    let pixels = (0..width * height).map(at).collect();
    Environment { name: "painted".into(), width, height, pixels, ..Environment::constant(Vec3::ZERO) }
}

/// Light of many colours from everywhere.
pub fn colourful() -> Environment {
    painted(128, |d| {
        let sun = if d.dot(DVec3::new(0.5, 0.7, -0.4).normalize()) > 0.97 { 60.0 } else { 0.0 };
        Vec3::new((1.0 + d.x + sun) as f32, (0.7 + 0.6 * d.y) as f32, (1.2 + (3.0 * d.z).sin()) as f32)
    })
}

/// A light of radiance `light` in a cap around +Y, and the cap's half angle: `rows` of 512.
pub fn cap(rows: u32, light: f32) -> (Environment, f64) {
    let alpha = PI * f64::from(rows) / 512.0;
    (painted(1024, |d| if d.y > alpha.cos() { Vec3::splat(light) } else { Vec3::ZERO }), alpha)
}

/// Triangles with a matt material of albedo 0.5; an occluder or a ground.
pub fn thing(scene: &mut Scene, name: &str, positions: Vec<Vec3>, indices: Vec<u32>, at: Mat4) -> u32 {
    let mut normals = vec![Vec3::ZERO; positions.len()];
    for c in indices.chunks_exact(3) {
        let [a, b, d] = [c[0], c[1], c[2]].map(|i| positions[i as usize]);
        c.iter().for_each(|&i| normals[i as usize] += (b - a).cross(d - a));
    }
    let primitive = Primitive {
        normals: normals.into_iter().map(|n| n.normalize_or(Vec3::Y)).collect(),
        tangents: vec![Vec4::ZERO; positions.len()],
        positions,
        indices,
        material: scene.materials.len() as u32,
        ..Primitive::default()
    };
    scene.materials.push(Material::diffuse("matt", Vec3::splat(0.5)));
    scene.meshes.push(Mesh { primitives: vec![primitive], ..Mesh::default() });
    let mesh = Some(scene.meshes.len() as u32 - 1);
    scene.nodes.push(Node { name: name.into(), mesh, local: Transform::Matrix(at), ..Node::default() });
    scene.nodes.len() as u32 - 1
}

/// Corners and triangles of a sphere around the origin, wound outwards.
pub fn ball(radius: f32, rings: u32) -> (Vec<Vec3>, Vec<u32>) {
    let sectors = 2 * rings;
    let corner = |ring: u32, sector: u32| {
        let polar = PI * f64::from(ring) / f64::from(rings);
        let azimuth = TAU * f64::from(sector % sectors) / f64::from(sectors);
        (DVec3::new(polar.sin() * azimuth.sin(), polar.cos(), polar.sin() * azimuth.cos()) * f64::from(radius))
            .as_vec3()
    };
    let positions = (0..=rings).flat_map(|r| (0..=sectors).map(move |s| corner(r, s))).collect();
    let mut indices = vec![];
    for (ring, sector) in (0..rings).flat_map(|r| (0..sectors).map(move |s| (r, s))) {
        let a = ring * (sectors + 1) + sector;
        let b = a + sectors + 1;
        if ring > 0 {
            indices.extend([a, b, a + 1]);
        }
        if ring + 1 < rings {
            indices.extend([a + 1, b, b + 1]);
        }
    }
    (positions, indices)
}

/// A square of half side `half` in the plane y = 0, its front up.
pub fn ground(scene: &mut Scene, half: f32) -> u32 {
    let v = |x: f32, z: f32| Vec3::new(x * half, 0.0, z * half);
    let corners = vec![v(-1.0, -1.0), v(-1.0, 1.0), v(1.0, 1.0), v(1.0, -1.0)];
    thing(scene, "ground", corners, vec![0, 1, 2, 0, 2, 3], Mat4::IDENTITY)
}

/// A scene of one ball around the origin.
pub fn one_ball(radius: f32, rings: u32) -> Scene {
    let mut scene = Scene::default();
    let (positions, indices) = ball(radius, rings);
    thing(&mut scene, "ball", positions, indices, Mat4::IDENTITY);
    scene
}

/// The only occluder of a scene, and its centre seen from its node.
pub fn occluder(scene: &Scene) -> (Occluder, Vec3) {
    let mut all = Occluders::of(scene, &Pose::rest(scene), false, 1.0);
    assert_eq!(all.kinds.len(), 1);
    (all.kinds.remove(0), all.placed[0].centre)
}

/// The CPU's hierarchy over an occluder, its centre at the origin.
pub fn hierarchy(occluder: &Occluder) -> Bvh {
    Bvh::build(&occluder.scene, &Pose::rest(&occluder.scene))
}

/// Nine floats as three colours.
pub fn vectors(floats: &[f32]) -> Vectors {
    [0, 1, 2].map(|k| Vec3::from_slice(&floats[3 * k..]).as_dvec3())
}

pub fn length(v: &Vectors) -> f64 {
    v.iter().map(|c| c.length_squared()).sum::<f64>().sqrt()
}

pub fn apart(a: &Vectors, b: &Vectors) -> f64 {
    length(&[a[0] - b[0], a[1] - b[1], a[2] - b[2]])
}

/// A scene that stays on the device for many pictures.
pub struct Studio<'a> {
    scene: &'a Scene,
    resident: Resident,
    pub fiv: Fiv,
    runner: Runner,
}

impl<'a> Studio<'a> {
    pub fn new(gpu: &Gpu, scene: &'a Scene, settings: &Settings, stored: Option<&Stored>) -> Self {
        let resident = Resident::new(gpu, scene).unwrap();
        let fiv = Fiv::new(gpu, scene, &resident, settings, stored, |_, _| true).unwrap_or_else(|e| panic!("{e}"));
        Self { scene, resident, fiv, runner: Runner::new(gpu) }
    }

    /// Irradiance and radiance of every pixel.
    pub fn shot(&mut self, pose: &Pose, view: &View, settings: &Settings) -> (Vec<Vec3>, Vec<Vec3>) {
        let mut graph = Graph::new("fiv");
        let handles = self.resident.frame_in(&mut graph, self.scene, pose);
        let view = view.fit_far(&handles.bounds());
        let all = PictureSettings { fiv: settings.clone(), ..Default::default() };
        let picture = self.fiv.picture(&mut graph, self.scene, pose, &handles, &view, &all).unwrap();
        let tokens = [picture.outputs.irradiance, picture.outputs.total].map(|image| graph.read_image(image));
        let frame = self.runner.run(&graph).unwrap_or_else(|error| panic!("{error}"));
        let [irradiance, total] = tokens.map(|token| {
            let pixels = frame.image(token).to_f32();
            pixels.into_iter().map(|[r, g, b, _]| Vec3::new(r, g, b)).collect::<Vec<_>>()
        });
        for pixel in irradiance.iter().chain(&total) {
            assert!(pixel.is_finite() && pixel.min_element() >= 0.0, "{pixel}");
        }
        (irradiance, total)
    }

    /// What every pixel reflects glossily; it is part of its light.
    pub fn gloss(&mut self, pose: &Pose, view: &View, settings: &Settings) -> Vec<Vec3> {
        let mut graph = Graph::new("fiv");
        let handles = self.resident.frame_in(&mut graph, self.scene, pose);
        let view = view.fit_far(&handles.bounds());
        let all = PictureSettings { fiv: settings.clone(), ..Default::default() };
        let picture = self.fiv.picture(&mut graph, self.scene, pose, &handles, &view, &all).unwrap();
        let tokens = [picture.outputs.specular.unwrap(), picture.outputs.total].map(|image| graph.read_image(image));
        let frame = self.runner.run(&graph).unwrap_or_else(|error| panic!("{error}"));
        let [gloss, total] = tokens.map(|token| {
            let pixels = frame.image(token).to_f32();
            pixels.into_iter().map(|[r, g, b, _]| Vec3::new(r, g, b)).collect::<Vec<_>>()
        });
        assert!(gloss.iter().zip(&total).all(|(g, t)| (*t - *g).min_element() >= -1e-6 * t.max_element()));
        gloss
    }

    /// Irradiance and distance (metres; 1e10: nothing) of every pixel.
    pub fn film(&mut self, pose: &Pose, view: &View, settings: &Settings) -> (Vec<[f32; 3]>, Vec<f32>) {
        let mut graph = Graph::new("fiv");
        let handles = self.resident.frame_in(&mut graph, self.scene, pose);
        let view = view.fit_far(&handles.bounds());
        let all = PictureSettings { fiv: settings.clone(), ..Default::default() };
        let picture = self.fiv.picture(&mut graph, self.scene, pose, &handles, &view, &all).unwrap();
        let tokens = [picture.outputs.irradiance, picture.gbuffer.depth].map(|image| graph.read_image(image));
        let frame = self.runner.run(&graph).unwrap_or_else(|error| panic!("{error}"));
        let [light, depth] = tokens.map(|token| frame.image(token).to_f32());
        let metres = |[z, ..]: [f32; 4]| if z < 1.0 { z * view.far } else { 1e10 };
        (light.into_iter().map(|[r, g, b, _]| [r, g, b]).collect(), depth.into_iter().map(metres).collect())
    }

    /// Why a picture at rest is refused.
    pub fn refused(&mut self, view: &View, settings: &Settings) -> lucerna::Error {
        let mut graph = Graph::new("fiv");
        let pose = Pose::rest(self.scene);
        let handles = self.resident.frame_in(&mut graph, self.scene, &pose);
        let all = PictureSettings { fiv: settings.clone(), ..Default::default() };
        self.fiv.picture(&mut graph, self.scene, &pose, &handles, view, &all).unwrap_err()
    }

    /// Irradiance of every pixel at rest.
    pub fn irradiance(&mut self, view: &View, settings: &Settings) -> Vec<Vec3> {
        self.shot(&Pose::rest(self.scene), view, settings).0
    }
}

/// Normalised root mean square error [FIV 17]: per channel by its range in the reference, the mean of three.
pub fn nrmse(reference: &[Vec3], found: &[Vec3]) -> f64 {
    let channel = |c: usize| {
        let values = || reference.iter().map(|p| f64::from(p[c]));
        let (low, high) = values().fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
        let sum: f64 = reference.iter().zip(found).map(|(r, f)| f64::from(r[c] - f[c]).powi(2)).sum();
        (sum / reference.len() as f64).sqrt() / (high - low)
    };
    (channel(0) + channel(1) + channel(2)) / 3.0
}

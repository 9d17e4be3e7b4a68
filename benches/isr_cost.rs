//! What image-space radiosity costs, pass by pass: a simple against a complex scene, 24, 48 and 80 samples, half and full
//! resolution; and what shadows of direct light cost. Prints tables and exits with 1 if the cost depends on the scene by more than the tolerance.
//!
//! Both scenes fill the picture. The rows that count are without depth-buffer tests of visibility, whose number depends on how
//! many samples face the pixel; a row with them is printed as well.
//!
//! `cargo bench --bench isr_cost [-- WIDTHxHEIGHT [ROUNDS]]`; 1024x768 and 7 by default. `LUCERNA_DEVICE` chooses the device.

mod common;

use common::{Places, median};
use glam::{Mat4, Quat, Vec3, vec3};
use lucerna::{
    Result,
    gpu::{Gpu, GpuOptions},
    graph::{Graph, Report, Runner},
    passes::{
        ambient::Irradiance,
        shadow::{self, Kind},
    },
    resident::Resident,
    scene::{Camera, Light, LightKind, Material, Mesh, Node, Pose, Primitive, Projection, Scene, Transform, View},
    techniques::isr::{PictureSettings, Resolution, Settings, picture},
};
use lucerna_scenes as builtin;

fn main() -> std::process::ExitCode {
    common::verdict(run())
}

fn run() -> Result<bool> {
    let mut words = Places::new("WIDTHxHEIGHT [ROUNDS]");
    let extent = words.size([1024, 768])?;
    let rounds = words.number("ROUNDS", common::ROUNDS, 7)? as usize;
    words.end()?;

    let gpu = Gpu::new(GpuOptions::from_env()?)?;
    println!("{} at {}x{}, medians of {rounds} alternating runs, ms", gpu.describe(), extent[0], extent[1]);
    let scenes = [builtin::load("cornell")?, complex()];
    let mut residents = scenes.iter().map(|scene| Resident::new(&gpu, scene)).collect::<Result<Vec<_>>>()?;
    let names = scenes.each_ref().map(|s| format!("{} ({} triangles)", s.name, triangles(s)));
    let mut runner = Runner::new(&gpu);
    println!("{:<24} {:>26} {:>26} {:>7}   gather alone", "samples, resolution", names[0], names[1], "ratio");
    let mut worst: f64 = 1.0;
    let rows = [(24, 0), (48, 0), (80, 0), (48, 4)];
    for resolution in [Resolution::Half, Resolution::Full] {
        for (samples, visibility_steps) in rows {
            let settings = PictureSettings {
                isr: Settings { samples, resolution, visibility_steps, ..Settings::default() },
                ..PictureSettings::default()
            };
            let mut all = [vec![], vec![]];
            let mut gathers = [vec![], vec![]];
            for round in 0..=rounds {
                for which in 0..2 {
                    let report = once(&mut runner, &scenes[which], &mut residents[which], extent, &settings)?;
                    // The first round makes pipelines and memory.
                    if round > 0 {
                        all[which].push(cost(&report, |name| IMAGE_SPACE.iter().any(|p| name.starts_with(p))));
                        gathers[which].push(cost(&report, |name| name.starts_with("isr.gather")));
                    }
                }
            }
            // Of neighbouring runs, so that what else the machine does falls on both.
            let ratio = median(all[0].iter().zip(&all[1]).map(|(simple, complex)| complex / simple).collect());
            let [simple, complex] = all.map(median);
            let gather = gathers.map(median);
            if visibility_steps == 0 {
                worst = worst.max(ratio).max(1.0 / ratio);
            }
            println!(
                "{:<24} {simple:>26.3} {complex:>26.3} {ratio:>7.3}   {:.3} {:.3}",
                format!("{samples}, {resolution:?}{}", if visibility_steps > 0 { ", visibility" } else { "" }),
                gather[0],
                gather[1]
            );
        }
    }
    shadows(&mut runner, (&scenes, &mut residents), extent, rounds)?;
    println!("largest ratio between the scenes: {worst:.3} (the aim is at most 1.10)");
    Ok(worst <= 1.10)
}

/// Prints the cost of shadows of the paper's kinds, and of the filter over the picture (dissertation, section 4.6): all passes of a frame without
/// gathered light.
fn shadows(
    runner: &mut Runner,
    (scenes, residents): (&[Scene; 2], &mut [Resident]),
    extent: [u32; 2],
    rounds: usize,
) -> Result<()> {
    println!("{:<32} {:>20} {:>20}", "shadows, direct light alone", scenes[0].name, scenes[1].name);
    for (name, kind, screen_blur) in [
        ("off", Kind::Off, 0),
        ("plain", Kind::Plain, 0),
        ("percentage closer", Kind::Pcf, 0),
        ("exponential", Kind::Exponential, 0),
        ("exponential, filter of 4 pixels", Kind::Exponential, 4),
        ("exponential, filter of 12 pixels", Kind::Exponential, 12),
    ] {
        let settings = PictureSettings {
            isr: Settings { indirect: false, occlusion: false, ..Settings::paper() },
            shadow: shadow::Settings { kind, screen_blur, ..shadow::Settings::dissertation() },
            ..PictureSettings::paper()
        };
        let mut all = [vec![], vec![]];
        for round in 0..=rounds {
            for which in 0..2 {
                let report = once(runner, &scenes[which], &mut residents[which], extent, &settings)?;
                if round > 0 {
                    all[which].push(cost(&report, |_| true));
                }
            }
        }
        let [simple, complex] = all.map(median);
        println!("{name:<32} {simple:>20.3} {complex:>20.3}");
    }
    Ok(())
}

/// Passes whose cost must depend on the image only.
const IMAGE_SPACE: [&str; 8] = [
    "passes.downsample",
    "isr.gather",
    "isr.bounce",
    "passes.blur",
    "passes.bilateral",
    "passes.compose",
    "isr.premultiply",
    "mips isr.filtered",
];

fn cost(report: &Report, counts: impl Fn(&str) -> bool) -> f64 {
    report.passes.iter().filter(|pass| counts(&pass.name)).filter_map(|pass| pass.gpu_ms).sum()
}

fn once(
    runner: &mut Runner,
    scene: &Scene,
    resident: &mut Resident,
    extent: [u32; 2],
    settings: &PictureSettings,
) -> Result<Report> {
    let mut graph = Graph::new("isr");
    let pose = Pose::rest(scene);
    let node = scene.nodes.iter().position(|node| node.camera.is_some()).unwrap_or(0);
    let camera = &scene.cameras[scene.nodes[node].camera.unwrap_or(0) as usize];
    let handles = resident.frame_in(&mut graph, scene, &pose);
    // Into the box, so that nothing beside it is seen.
    let forward = if scene.name == "hills" { 0.0 } else { 1.0 };
    let place = pose.world[node] * Mat4::from_translation(vec3(0.0, 0.0, -forward));
    let view = View::new(camera, place, extent).fit_far(&handles.bounds());
    picture(&mut graph, &handles, &view, Irradiance::default(), settings)?;
    Ok(runner.run(&graph)?.report)
}

fn triangles(scene: &Scene) -> usize {
    let of = |mesh: u32| scene.meshes[mesh as usize].primitives.iter().map(|p| p.indices.len() / 3).sum::<usize>();
    scene.nodes.iter().filter_map(|node| node.mesh).map(of).sum()
}

/// Hills of 300 000 triangles that fill the picture: as much to shade as the closed box, and much more to draw.
fn complex() -> Scene {
    let side = 388usize;
    let height = |x: f32, z: f32| 0.6 * (0.9 * x).sin() * (0.7 * z).cos() + 0.15 * (4.1 * x + 2.3 * z).sin();
    let at = |i: usize, j: usize| {
        let (x, z) = (i as f32 / side as f32 * 24.0 - 12.0, j as f32 / side as f32 * 24.0 - 12.0);
        vec3(x, height(x, z), z)
    };
    let mut primitive = Primitive::default();
    for j in 0..=side {
        for i in 0..=side {
            let p = at(i, j);
            let slope = |d: Vec3| height(p.x + d.x, p.z + d.z) - height(p.x - d.x, p.z - d.z);
            let normal = vec3(-slope(Vec3::X * 0.01), 0.02, -slope(Vec3::Z * 0.01)).normalize();
            primitive.positions.push(p);
            primitive.normals.push(normal);
            primitive.tangents.push(glam::Vec4::ZERO);
        }
    }
    for j in 0..side {
        for i in 0..side {
            let corner = |di: usize, dj: usize| ((j + dj) * (side + 1) + i + di) as u32;
            primitive.indices.extend([corner(0, 0), corner(0, 1), corner(1, 0)]);
            primitive.indices.extend([corner(1, 0), corner(0, 1), corner(1, 1)]);
        }
    }
    let place = |translation: Vec3, rotation: Quat| Transform::Trs { translation, rotation, scale: Vec3::ONE };
    Scene {
        name: "hills".into(),
        nodes: vec![
            Node { mesh: Some(0), ..Node::default() },
            Node { light: Some(0), local: place(vec3(0.0, 4.0, 0.0), Quat::IDENTITY), ..Node::default() },
            Node { camera: Some(0), local: place(vec3(0.0, 7.0, 4.0), Quat::from_rotation_x(-1.1)), ..Node::default() },
        ],
        meshes: vec![Mesh { name: "hills".into(), primitives: vec![primitive], weights: vec![] }],
        materials: vec![Material::diffuse("ground", vec3(0.5, 0.45, 0.3))],
        lights: vec![Light {
            name: "lamp".into(),
            kind: LightKind::Point { range: None },
            color: Vec3::ONE,
            intensity: 50.0,
        }],
        cameras: vec![Camera {
            name: "above".into(),
            projection: Projection::Perspective { yfov: 0.8, aspect: None, znear: 0.1, zfar: None },
        }],
        ..Scene::default()
    }
}

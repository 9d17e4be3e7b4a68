//! Pictures of the device's path tracer against those of the CPU's, by statistics.
#![allow(dead_code)]

use glam::{DVec3, Mat4, Vec3};
use lucerna::{
    gpu::Gpu,
    image::Layers,
    reference::path,
    scene::{LightKind, Material, Pose, Scene, View, bvh::Bvh},
    tracer::{self, Filter, Tracer},
};

use crate::tracer_lab::Stage;

/// Pixels are compared one by one and in squares of this side.
const SQUARE: usize = 8;
/// Independent pictures of the device, whose spread tells their error.
pub const PICTURES: u32 = 12;

/// What both trace.
#[derive(Clone, Copy, Debug)]
pub struct Task {
    pub bounces: u32,
    pub specular_bounces: u32,
    pub diffuse_only: bool,
    pub sources: tracer::Sources,
    pub jitter: bool,
    pub sample_lamps: bool,
    /// Paths a pixel on the CPU, and in each picture of the device.
    pub samples: [u32; 2],
    /// Share by which they may differ without chance: rounding, offsets of rays, filtering of textures.
    pub slack: f64,
}

impl Default for Task {
    fn default() -> Self {
        Self {
            bounces: 2,
            specular_bounces: 8,
            diffuse_only: false,
            sources: tracer::Sources::All,
            jitter: true,
            sample_lamps: false,
            samples: [400, 32],
            slack: 5e-4,
        }
    }
}

/// Mean and variance of the mean of an estimate.
#[derive(Clone, Copy, Debug, Default)]
struct Estimate {
    mean: DVec3,
    variance: DVec3,
}

/// Traces on both, and says where they differ by more than chance explains. Empty: they agree.
///
/// The layers direct, indirect, emission and their sum are compared over squares of 8 × 8 pixels and over the picture by Welch's t,
/// the device's variance from independent pictures; single pixels of the sum by z, with the variances of the samples.
pub fn disagreements(gpu: &Gpu, scene: &Scene, view: &View, task: &Task) -> Vec<String> {
    disagreements_after(gpu, scene, view, task, &[&|_| {}]).remove(0)
}

/// The same once for each of `changes`, which is made to the device's pictures before they are compared.
pub fn disagreements_after(
    gpu: &Gpu,
    scene: &Scene,
    view: &View,
    task: &Task,
    changes: &[&dyn Fn(&mut Layers)],
) -> Vec<Vec<String>> {
    let pose = Pose::rest(scene);
    let bvh = Bvh::build(scene, &pose);
    let ours = path::trace(
        scene,
        &pose,
        &bvh,
        view,
        &path::Settings {
            samples: task.samples[0],
            bounces: task.bounces,
            specular_bounces: task.specular_bounces,
            diffuse_only: task.diffuse_only,
            jitter: task.jitter,
            sources: match task.sources {
                tracer::Sources::All => path::Sources::ALL,
                tracer::Sources::Punctual => path::Sources::PUNCTUAL,
                tracer::Sources::Emissive => path::Sources::EMISSIVE,
                tracer::Sources::Environment => path::Sources::ENVIRONMENT,
            },
            sample_lamps: task.sample_lamps,
            seed: 77,
            ..Default::default()
        },
    );
    let mut tracer = Tracer::new(gpu, scene, &pose).unwrap();
    let pictures: Vec<Layers> = (0..PICTURES)
        .map(|seed| {
            let settings = tracer::Settings {
                bounces: task.bounces,
                specular_bounces: task.specular_bounces,
                diffuse_only: task.diffuse_only,
                sources: task.sources,
                filter: if task.jitter { Filter::Box } else { Filter::Centre },
                seed: seed + 1,
                ..Default::default()
            };
            let layers = tracer.render(view, &settings, task.samples[1]).unwrap();
            assert_eq!(tracer.sums().unwrap().lost(), 0, "samples that are no numbers");
            layers
        })
        .collect();
    let compared = |change: &&dyn Fn(&mut Layers)| {
        let mut pictures = pictures.clone();
        pictures.iter_mut().for_each(change);
        compare(&ours, &pictures, view, task)
    };
    changes.iter().map(compared).collect()
}

fn compare(ours: &path::Layers, pictures: &[Layers], view: &View, task: &Task) -> Vec<String> {
    let device = |name: &str| -> Vec<Vec<DVec3>> {
        let pixels = |p: &Layers| {
            let data = &p.layer(name).unwrap().data;
            data.chunks(3).map(|c| Vec3::new(c[0], c[1], c[2]).as_dvec3()).collect()
        };
        pictures.iter().map(pixels).collect()
    };
    let [width, height] = view.extent.map(|e| e as usize);
    let all: Vec<usize> = (0..width * height).collect();
    let mut areas = vec![("the picture".to_owned(), all.clone())];
    for y in (0..height).step_by(SQUARE) {
        for x in (0..width).step_by(SQUARE) {
            let inside = |i: &usize| (x..x + SQUARE).contains(&(i % width)) && (y..y + SQUARE).contains(&(i / width));
            areas.push((format!("the square at ({x}, {y})"), all.iter().copied().filter(inside).collect()));
        }
    }
    let total = ours.total();
    let layers = [
        ("emission", &ours.emission, &ours.variance.emission),
        ("direct", &ours.direct, &ours.variance.direct),
        ("indirect", &ours.indirect, &ours.variance.indirect),
        ("", &total, &ours.variance.total),
    ];
    let mut wrong = Vec::new();
    for (name, mean, variance) in layers {
        let batches = device(name);
        let label = if name.is_empty() { "total" } else { name };
        for (area, pixels) in &areas {
            let n = pixels.len() as f64;
            let cpu = Estimate {
                mean: pixels.iter().map(|&i| mean[i].as_dvec3()).sum::<DVec3>() / n,
                variance: pixels.iter().map(|&i| variance[i].as_dvec3()).sum::<DVec3>() / (n * n),
            };
            let each: Vec<DVec3> = batches.iter().map(|p| pixels.iter().map(|&i| p[i]).sum::<DVec3>() / n).collect();
            let gpu = spread(&each);
            for c in 0..3 {
                let error = (cpu.variance[c] + gpu.variance[c]).sqrt();
                let off = (cpu.mean[c] - gpu.mean[c]).abs();
                // 11 degrees of freedom at the least: beyond 8 lies one in 150 000.
                if off > 8.0 * error + task.slack * cpu.mean[c].abs() + 1e-6 {
                    wrong.push(format!(
                        "{label} of {area}, channel {c}: device {:.6} ± {:.6}, CPU {:.6} ± {:.6}, ratio {:.4}",
                        gpu.mean[c],
                        gpu.variance[c].sqrt(),
                        cpu.mean[c],
                        cpu.variance[c].sqrt(),
                        gpu.mean[c] / cpu.mean[c]
                    ));
                }
            }
        }
        if name.is_empty() {
            let weights = DVec3::new(0.2126, 0.7152, 0.0722);
            let mut squares = 0.0;
            let mut counted = 0.0;
            for i in all.iter().copied() {
                let theirs = batches.iter().map(|p| p[i].dot(weights)).sum::<f64>() / batches.len() as f64;
                let variances = pictures.iter().map(|p| f64::from(p.layer("variance").unwrap().data[i]));
                let variance = variances.sum::<f64>() / (batches.len() * batches.len()) as f64;
                // An upper bound of the variance of luminance: channels are at most fully correlated.
                let own = (variance_of_luminance(ours.variance.total[i].as_dvec3(), weights) + variance).sqrt();
                let z = (theirs - mean[i].as_dvec3().dot(weights)) / (own + 1e-3 * theirs.abs() + 1e-5);
                (squares, counted) = (squares + z * z, counted + 1.0);
                // Šidák: one of 384 pixels beyond 5 happens once in 4500 pictures; the tails of path tracing are longer.
                if z.abs() > 7.0 {
                    wrong.push(format!("total of pixel ({}, {}): z = {z:.1}", i % width, i / width));
                }
            }
            if squares / counted > 1.6 {
                wrong.push(format!("mean z² of all pixels is {:.2}", squares / counted));
            }
        }
    }
    wrong
}

fn variance_of_luminance(variance: DVec3, weights: DVec3) -> f64 {
    let deviation = DVec3::new(variance.x.sqrt(), variance.y.sqrt(), variance.z.sqrt()).dot(weights);
    deviation * deviation
}

fn spread(each: &[DVec3]) -> Estimate {
    let n = each.len() as f64;
    let mean = each.iter().sum::<DVec3>() / n;
    let variance = each.iter().map(|e| (*e - mean) * (*e - mean)).sum::<DVec3>() / (n * (n - 1.0));
    Estimate { mean, variance }
}

/// Fails if any of the tasks disagrees.
pub fn expect_agreement(gpu: &Gpu, tasks: &[(&str, &Scene, View, Task)]) {
    let mut wrong = Vec::new();
    for (name, scene, view, task) in tasks {
        let begun = std::time::Instant::now();
        let found = disagreements(gpu, scene, view, task);
        println!("{name}: {} disagreements, {:.1} s", found.len(), begun.elapsed().as_secs_f32());
        found.iter().take(12).for_each(|text| println!("    {text}"));
        if !found.is_empty() {
            wrong.push(format!("{name}: {}", found[0]));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Floor, back wall and left wall, open elsewhere; a camera in front of it.
pub fn corner(floor: Material) -> Stage {
    let mut stage = Stage::new();
    let floor = stage.material(floor);
    let white = stage.material(Material::diffuse("white", Vec3::splat(0.7)));
    let red = stage.material(Material::diffuse("red", Vec3::new(0.7, 0.15, 0.1)));
    let (x, y, z) = (Vec3::X * 3.0, Vec3::Y * 2.0, Vec3::Z * 3.0);
    let origin = Vec3::new(-1.5, 0.0, -1.5);
    stage.quad(floor, origin, z, x);
    stage.quad(white, origin, x, y);
    stage.quad(red, origin, y, z);
    stage
}

pub fn eye() -> View {
    crate::tracer_lab::view(Vec3::new(0.6, 1.2, 3.0), Vec3::new(-0.1, 0.7, 0.0), 45.0, [24, 16])
}

/// A lamp of a metre's side over the corner, facing down.
pub fn panel(stage: &mut Stage, radiance: Vec3) {
    let lamp = stage.emitter(radiance);
    stage.quad(lamp, Vec3::new(-0.5, 1.9, -0.5), Vec3::X, Vec3::Z);
}

pub fn point(stage: &mut Stage) {
    stage.point(Vec3::new(0.5, 1.6, 0.4), Vec3::new(2.0, 1.5, 1.0));
}

/// A spot light with a range, and a sun.
pub fn spot_and_sun(stage: &mut Stage) {
    let down = Mat4::from_rotation_x(-1.1) * Mat4::from_rotation_y(0.4);
    let kind = LightKind::Spot { range: Some(6.0), inner: 0.2, outer: 0.7 };
    stage.light(kind, Vec3::new(1.0, 0.8, 0.5), 4.0, Mat4::from_translation(Vec3::new(0.2, 1.9, 1.0)) * down);
    let sun = Mat4::from_rotation_y(0.8) * Mat4::from_rotation_x(-0.9);
    stage.light(LightKind::Directional, Vec3::new(0.9, 0.9, 1.0), 1.5, sun);
}

/// A bright spot in a sky of two colours.
pub fn sky() -> lucerna::scene::Environment {
    let (width, height) = (32u32, 16u32);
    let pixels = (0..width * height)
        .map(|i| {
            let (x, y) = (i % width, i / width);
            let base = if y < height / 2 { Vec3::new(0.3, 0.5, 0.9) } else { Vec3::new(0.2, 0.15, 0.1) };
            if (6..9).contains(&x) && (3..5).contains(&y) { Vec3::new(12.0, 10.0, 6.0) } else { base }
        })
        .collect();
    lucerna::scene::Environment { name: "sky".into(), width, height, pixels, rotation: 0.6, scale: 1.2 }
}

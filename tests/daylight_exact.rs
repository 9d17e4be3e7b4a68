//! Paths that all times share against paths of each time by itself, texel by texel and behind a slit; and the size of the sun's disc.

use crate::{
    daylight_lab::lights,
    daylight_light::{baking, eye, plan, stage},
    tracer_lab::{Stage, matt, view},
};
use glam::{Mat4, Quat, Vec3, vec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    scene::{LightKind, Material, Pose, Scene, View},
    techniques::daylight::{Baking, Lit, Plan, Sources},
    tracer::{Settings, Tracer},
};

/// Runs of each estimate.
const RUNS: u32 = 8;

/// Reflected light of the sun of each pixel for each time, by shared paths: all runs. `albedo`: of each pixel and colour.
fn shared(gpu: &Gpu, scene: &Scene, view: &View, plan: &Plan, albedo: &[f32]) -> Vec<Vec<Vec<f64>>> {
    let pixels = (plan.extent[0] * plan.extent[1]) as usize;
    let run = |seed| {
        let plan = Plan { settings: Baking { seed, ..plan.settings.clone() }, ..plan.clone() };
        let mut out = vec![vec![0.0; pixels]; plan.times.len()];
        for (index, light) in lights(gpu, scene, &plan, Sources::View(Box::new(*view))).iter().enumerate() {
            for (number, [x, y]) in plan.covered(index as u32, &light.mask).enumerate() {
                let pixel = (y * plan.extent[0] + x) as usize;
                for (time, out) in out.iter_mut().enumerate() {
                    let of = |c: usize| {
                        let irradiance = light.sun[(3 * number + c) * plan.times.len() + time];
                        f64::from(irradiance * albedo[3 * pixel + c]) / std::f64::consts::PI
                    };
                    out[pixel] = of(0) + of(1) + of(2);
                }
            }
        }
        out
    };
    (0..RUNS).map(run).collect()
}

/// The same by the path tracer, which renders each time by itself; and the albedo.
fn independent(gpu: &Gpu, scene: &Scene, view: &View, suns: &[Vec3], samples: u32) -> (Vec<Vec<Vec<f64>>>, Vec<f32>) {
    let mut out = vec![Vec::new(); RUNS as usize];
    let mut albedo = Vec::new();
    for sun in suns {
        let mut stage = Stage { scene: scene.clone() };
        let turned = Quat::from_rotation_arc(Vec3::Z, *sun);
        stage.light(LightKind::Directional, Vec3::ONE, 1.0, Mat4::from_quat(turned));
        let mut tracer = Tracer::new(gpu, &stage.scene, &Pose::rest(&stage.scene)).unwrap();
        for (seed, out) in out.iter_mut().enumerate() {
            let settings = Settings { roulette: 16, seed: 100 + seed as u32, ..matt(16) };
            let layers = tracer.render(view, &settings, samples).unwrap();
            let light = &layers.layer("indirect").unwrap().data;
            out.push(light.chunks_exact(3).map(|rgb| rgb.iter().map(|v| f64::from(*v)).sum()).collect());
            albedo.clone_from(&layers.layer("albedo").unwrap().data);
        }
    }
    (out, albedo)
}

/// Mean, and the variance of the mean, of the runs of a number.
fn moments(runs: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let count = f64::from(RUNS);
    let mean = runs.clone().sum::<f64>() / count;
    (mean, runs.map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0) / count)
}

fn with_suns(scene: &Scene, view: &View, suns: &[Vec3], settings: Baking) -> Plan {
    let times = suns.iter().enumerate().map(|(i, sun)| Lit { seconds: 600.0 * i as f64, sun: sun.to_array() });
    Plan { times: times.collect(), steps: suns.len() as u32, ..plan(scene, view, settings) }
}

#[test]
fn shared_paths_and_paths_of_each_time_agree_in_every_texel() {
    with_gpu(|gpu| {
        let (scene, eye) = (stage(), eye());
        let suns = [vec3(0.9, 0.5, 0.3), vec3(-0.2, 1.0, 0.4), vec3(-0.8, 0.2, 0.5)].map(Vec3::normalize);
        let (alone, albedo) = independent(gpu, &scene, &eye, &suns, 64);
        let plan = with_suns(&scene, &eye, &suns, Baking { samples: 64, ..baking() });
        let shared = shared(gpu, &scene, &eye, &plan, &albedo);
        for time in 0..suns.len() {
            let (mut count, mut square, mut sum, mut far) = (0.0f64, 0.0f64, 0.0f64, 0.0f64);
            for pixel in 0..shared[0][time].len() {
                let (a, of_a) = moments(shared.iter().map(|run| run[time][pixel]));
                let (b, of_b) = moments(alone.iter().map(|run| run[time][pixel]));
                if of_a + of_b == 0.0 {
                    assert!((a - b).abs() <= 1e-6 * (a + b), "time {time}, pixel {pixel}: {a} and {b}");
                    continue;
                }
                let z = (a - b) / (of_a + of_b).sqrt();
                (count, square, sum) = (count + 1.0, square + z * z, sum + z);
                far += if z.abs() > 5.0 { 1.0 } else { 0.0 };
            }
            // Seven to fourteen degrees of freedom: a variance of 14 / 12 to 7 / 5.
            let (spread, drift) = ((square / count).sqrt(), sum / count.sqrt());
            println!(
                "time {time}: {count} pixels, z of {spread:.3} (1.080 to 1.183), mean {drift:.2}, beyond 5: {far}"
            );
            assert!(count > 500.0 && (0.98..1.25).contains(&spread), "time {time}: {spread}");
            assert!(drift.abs() < 4.5, "time {time}: {drift}");
            assert!(far <= 3.0, "time {time}: {far} pixels");
        }
    });
}

/// Width and depth of the slit, metres: the sun is seen through it within two degrees.
const SLIT: [f32; 2] = [0.105, 3.0];

/// A room whose black ceiling of three metres has a slit along z.
fn behind_a_slit() -> (Scene, View) {
    let mut stage = Stage::new();
    let white = stage.material(Material::diffuse("white", Vec3::splat(0.7)));
    let black = stage.material(Material::diffuse("black", Vec3::ZERO));
    stage.quad(white, vec3(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0);
    for side in [-1.0f32, 1.0] {
        stage.quad(white, vec3(2.0 * side, 0.0, -2.0 * side), Vec3::Z * 4.0 * side, Vec3::Y * 2.0);
        stage.quad(white, vec3(2.0 * side, 0.0, 2.0 * side), Vec3::X * -4.0 * side, Vec3::Y * 2.0);
        let [near, far] = [0.5 * SLIT[0] * side, 2.1 * side];
        stage.cuboid(black, vec3(near.min(far), 2.0, -2.1), vec3(near.max(far), 2.0 + SLIT[1], 2.1), false);
        let [near, far] = [2.0 * side, 2.1 * side];
        let [low, high] = [near.min(far), near.max(far)];
        stage.cuboid(black, vec3(-0.1, 2.0, low), vec3(0.1, 2.0 + SLIT[1], high), false);
    }
    (stage.scene, view(vec3(0.3, 1.2, 1.9), vec3(0.0, 0.9, 0.0), 60.0, [24, 18]))
}

fn at_degrees(degrees: f32) -> Vec3 {
    Quat::from_rotation_z(-degrees.to_radians()) * Vec3::Y
}

/// The share of the slit's width through which a sun without a size comes to the floor.
fn through(degrees: f64) -> f64 {
    (1.0 - degrees.to_radians().tan().abs() * f64::from(SLIT[1] / SLIT[0])).max(0.0)
}

/// The same for an even disc with a radius of 0.2665°.
fn through_by_disc(degrees: f64) -> f64 {
    let steps = 2000;
    let strips = (0..steps).map(|i| {
        let x = 2.0 * (f64::from(i) + 0.5) / f64::from(steps) - 1.0;
        let strip = (1.0 - x * x).sqrt();
        [strip * through(degrees + 0.2665 * x), strip]
    });
    let [light, all] = strips.fold([0.0; 2], |[a, b], [c, d]| [a + c, b + d]);
    light / all
}

#[test]
fn shared_paths_and_paths_of_each_time_agree_behind_a_slit_of_two_degrees() {
    with_gpu(|gpu| {
        let (scene, eye) = behind_a_slit();
        let suns = [-1.2, 0.0, 0.8, 2.3].map(at_degrees);
        let (alone, albedo) = independent(gpu, &scene, &eye, &suns, 256);
        let plan = with_suns(&scene, &eye, &suns, Baking { samples: 256, ..baking() });
        let shared = shared(gpu, &scene, &eye, &plan, &albedo);
        for time in 0..suns.len() {
            let (a, of_a) = moments(shared.iter().map(|run| run[time].iter().sum()));
            let (b, of_b) = moments(alone.iter().map(|run| run[time].iter().sum()));
            println!("time {time}: shared {a:.4} ± {:.4}, alone {b:.4} ± {:.4}", of_a.sqrt(), of_b.sqrt());
            if time == 3 {
                assert!(a == 0.0 && b == 0.0, "the sun is outside of the slit: {a}, {b}");
                continue;
            }
            assert!((of_a + of_b).sqrt() < 0.04 * a, "too noisy to say anything");
            assert!((a - b).abs() < 4.5 * (of_a + of_b).sqrt(), "time {time}: {a} and {b}");
        }
    });
}

#[test]
fn the_disc_of_the_sun_has_its_real_size_behind_a_slit_of_two_degrees() {
    with_gpu(|gpu| {
        let (scene, eye) = behind_a_slit();
        let degrees = [-1.9, -1.2, 0.0, 0.8, 2.1, 2.4];
        let suns = degrees.map(at_degrees);
        let albedo = vec![0.7; (3 * eye.extent[0] * eye.extent[1]) as usize];
        let [point, disc] = [false, true].map(|disc| {
            let plan = with_suns(&scene, &eye, &suns, Baking { samples: 512, disc, ..baking() });
            let runs = shared(gpu, &scene, &eye, &plan, &albedo);
            let all = |time: usize| runs.iter().map(|run| run[time].iter().sum::<f64>()).sum::<f64>();
            (0..suns.len()).map(all).collect::<Vec<f64>>()
        });
        // Light of a slit that is fully open.
        let open = point[2] / through(0.0);
        for (time, degrees) in degrees.iter().enumerate() {
            let degrees = f64::from(*degrees);
            let [found, wanted] =
                [[point[time], disc[time]].map(|light| light / open), [through(degrees), through_by_disc(degrees)]];
            println!("{degrees}°: point {:.4} ({:.4}), disc {:.4} ({:.4})", found[0], wanted[0], found[1], wanted[1]);
            for (found, wanted) in found.into_iter().zip(wanted) {
                assert!((found - wanted).abs() < 0.006 + 0.05 * wanted, "{degrees}°: {found}, not {wanted}");
            }
        }
        // The same paths in the middle of the slit: a disc of twice the size would give 0.89.
        let (ratio, wanted) = (disc[2] / point[2], through_by_disc(0.0) / through(0.0));
        assert!((ratio - wanted).abs() < 0.015, "{ratio}, not {wanted}");
        assert!(point[4] == 0.0 && disc[4] > 0.0 && disc[5] == 0.0);
    });
}

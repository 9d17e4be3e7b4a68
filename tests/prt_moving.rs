//! A lamp that moves: from frame to frame the light changes as the true light does, without flicker.

use crate::{
    prt_lab::{closed, sampled, small},
    prt_light::room,
};
use glam::{Vec3, vec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    scene::Scene,
    techniques::prt::{
        Baking, Settings,
        check::at_samples,
        solve::{self, Solved},
    },
};

const STEPS: usize = 240;

/// Irradiance of all samples, first the direct and then the indirect one, for each step.
type Film = Vec<[Vec<f32>; 2]>;

/// The film of a lamp along a path by the bake, and with exact direct light at the samples. Also the areas of the samples.
fn films(gpu: &Gpu, scene: &Scene, baking: &Baking, path: &[[f32; 3]]) -> ([Film; 2], Vec<f32>) {
    let stored = crate::prt_lab::baked(gpu, scene, baking);
    let settings = Settings { gloss: false, ..Settings::default() };
    let grey = |light: &[[f32; 3]]| light.iter().map(|e| e[1]).collect::<Vec<f32>>();
    let found = at_samples(gpu, scene, &stored, &settings, path).unwrap();
    let ours = found.iter().map(|parts| [grey(&parts[0]), grey(&parts[1])]).collect();
    let (mut bakery, _) = sampled(gpu, scene, baking).unwrap();
    bakery.upload(&stored.plan, &stored.samples).unwrap();
    let clusters = 0..stored.plan.clusters.len();
    let exact: Vec<f32> = clusters.flat_map(|c| bakery.lit(&stored.plan, c, path, 0.0).unwrap()).collect();
    let materials =
        scene.materials.iter().map(|material| material.base_color.truncate().to_array()).collect::<Vec<_>>();
    let albedos: Vec<[f32; 3]> = stored.samples.iter().map(|s| materials[s.material as usize]).collect();
    let solved: Solved = solve::solve(&stored, &albedos, &settings).unwrap();
    let truth = (0..path.len()).map(|step| {
        let direct: Vec<[f32; 3]> = exact.iter().skip(step).step_by(path.len()).map(|e| [*e; 3]).collect();
        [grey(&direct), grey(&solved.indirect(&stored, &albedos, &direct))]
    });
    ([ours, truth.collect()], stored.samples.iter().map(|sample| sample.area).collect())
}

/// Root mean square over the surface.
fn root(areas: &[f32], value: impl Fn(usize) -> f32) -> f32 {
    let sum: f32 = areas.iter().enumerate().map(|(i, area)| area * value(i).powi(2)).sum();
    (sum / areas.iter().sum::<f32>()).sqrt()
}

#[test]
fn a_lamp_that_moves_changes_the_light_no_faster_than_the_truth_does() {
    with_gpu(|gpu| {
        let path: Vec<[f32; 3]> = (0..STEPS)
            .map(|step| {
                let t = std::f32::consts::TAU * step as f32 / STEPS as f32;
                vec3(1.4 * t.sin(), 1.7 + 0.4 * (2.0 * t).sin(), 0.9 * (3.0 * t).cos()).to_array()
            })
            .collect();
        let ([ours, truth], areas) =
            films(gpu, &room(), &Baking { samples: 2000, directions: 2016, visibility: 50, ..small() }, &path);
        for part in 0..2 {
            let level = truth.iter().map(|frame| root(&areas, |i| frame[part][i])).sum::<f32>() / STEPS as f32;
            let first = |film: &Film, t: usize| root(&areas, |i| film[(t + 1) % STEPS][part][i] - film[t][part][i]);
            let second = |film: &Film, t: usize| {
                root(&areas, |i| {
                    film[(t + 2) % STEPS][part][i] - 2.0 * film[(t + 1) % STEPS][part][i] + film[t][part][i]
                })
            };
            for (name, of) in [("first", &first as &dyn Fn(&Film, usize) -> f32), ("second", &second)] {
                let all = |film: &Film| (0..STEPS).map(|t| of(film, t) / level).collect::<Vec<f32>>();
                let (ours, truth) = (all(&ours), all(&truth));
                // A shadow may be a frame late. Factor 1.2, and a floor of 0.2 % of the light.
                for t in 0..STEPS {
                    let near = [t + STEPS - 1, t, t + 1].map(|t| truth[t % STEPS]).into_iter().fold(0.0, f32::max);
                    assert!(ours[t] <= 1.2 * near + 0.002, "{part} {name} {t}: {} {}", ours[t], truth[t]);
                }
                let mean = |list: &[f32]| list.iter().sum::<f32>() / STEPS as f32;
                assert!(mean(&ours) < 1.02 * mean(&truth), "{part} {name}: {} {}", mean(&ours), mean(&truth));
            }
        }
    });
}

#[test]
fn in_a_room_without_shadows_no_sample_flickers() {
    with_gpu(|gpu| {
        let path: Vec<[f32; 3]> = (0..STEPS)
            .map(|step| {
                let t = std::f32::consts::TAU * step as f32 / STEPS as f32;
                vec3(0.6 * t.sin(), 0.6 * (2.0 * t).sin(), 0.6 * (3.0 * t).cos()).to_array()
            })
            .collect();
        let ([ours, truth], areas) = films(gpu, &closed(Vec3::splat(0.5)), &Baking { samples: 2000, ..small() }, &path);
        for part in 0..2 {
            let level = truth.iter().map(|frame| root(&areas, |i| frame[part][i])).sum::<f32>() / STEPS as f32;
            for t in 0..STEPS {
                for i in 0..areas.len() {
                    let change = |film: &Film| (film[(t + 1) % STEPS][part][i] - film[t][part][i]).abs() / level;
                    let (ours, truth) = (change(&ours), change(&truth));
                    assert!(ours <= 1.05 * truth + 1e-4, "{part} {t} {i}: {ours} {truth}");
                }
            }
        }
    });
}

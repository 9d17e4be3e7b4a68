//! A day from frame to frame: interpolated light changes no faster than the true light, so no frame pops.

use crate::daylight_lab::{Studio, baked, day};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    passes::shadow,
    scene::{Pose, Scene, View},
    techniques::daylight::{
        Baked, Baking, Calendar, Interpolation, Kind, Lit, PictureSettings, Plan, Settings, Sources, Weather, parts,
    },
};

/// Minutes between two frames, and between two steps of the truth: about 240 in the lit day.
const FRAME: f64 = 4.4;
/// Minutes between two steps of the bake.
const STEP: f64 = 30.0;

fn plan(scene: &Scene, view: &View, interval: f64) -> Plan {
    let calendar = Calendar {
        date: "2026-06-21".into(),
        zone: "Europe/Copenhagen".into(),
        latitude: 55.5,
        longitude: 10.0,
        ..Calendar::default()
    };
    let day = day(&calendar);
    let steps = day.steps(interval, 0.0).unwrap();
    let lit = |&seconds: &f64| {
        let sun = day.sun(seconds);
        (sun.elevation > -0.2665).then(|| Lit { seconds, sun: sun.direction(calendar.north) })
    };
    Plan {
        scene: scene.name.clone(),
        parts: parts(scene),
        receivers: Kind::View {
            camera: "first".into(),
            view_from_world: view.view_from_world.to_cols_array(),
            clip_from_view: view.clip_from_view.to_cols_array(),
        },
        extent: view.extent,
        probes: None,
        lamps: Vec::new(),
        steps: steps.len() as u32,
        times: steps.iter().filter_map(lit).collect(),
        calendar,
        weather: Weather::default(),
        settings: Baking { samples: 16, bounces: 3, interval, ..Baking::default() },
    }
}

/// The baked light of all frames.
fn frames(
    gpu: &Gpu,
    (scene, view): (&Scene, &View),
    baked: &Baked,
    (first, count): (&str, u32),
    how: Interpolation,
) -> Vec<Vec<f32>> {
    let daylight = Settings { time: first.into(), minutes: FRAME, interpolation: how, ..Settings::default() };
    // Baked light has no shadow maps.
    let shadow = shadow::Settings { kind: shadow::Kind::Off, ..shadow::Settings::default() };
    let settings = PictureSettings { daylight, shadow, ..PictureSettings::default() };
    let mut studio = Studio::new(gpu, scene.clone(), *view, baked);
    (0..count).map(|frame| studio.frame(frame, &settings).unwrap().0.layer("indirect").unwrap().data.clone()).collect()
}

/// The change from each frame to the next: the root mean square of the difference, relative to the mean of the day.
fn changes(frames: &[Vec<f32>]) -> Vec<f64> {
    let mean = |frame: &Vec<f32>| frame.iter().map(|value| f64::from(*value)).sum::<f64>() / frame.len() as f64;
    let of_day = frames.iter().map(mean).sum::<f64>() / frames.len() as f64;
    let change = |pair: &[Vec<f32>]| {
        let square: f64 = pair[0].iter().zip(&pair[1]).map(|(a, b)| f64::from(b - a).powi(2)).sum();
        (square / pair[0].len() as f64).sqrt() / of_day
    };
    frames.windows(2).map(change).collect()
}

/// The largest change, and how much larger a change is at most than the largest true one within a step of the bake.
fn largest(found: &[f64], truth: &[f64]) -> (f64, f64) {
    let reach = (STEP / FRAME).ceil() as usize;
    let near = |frame: usize| truth[frame.saturating_sub(reach)..(frame + reach + 1).min(truth.len())].iter().copied();
    let excess = |(frame, change): (usize, &f64)| change / near(frame).fold(0.0, f64::max);
    (found.iter().copied().fold(0.0, f64::max), found.iter().enumerate().map(excess).fold(0.0, f64::max))
}

#[test]
fn a_day_changes_from_frame_to_frame_no_faster_than_its_true_light() {
    with_gpu(|gpu| {
        let scene = lucerna_scenes::load("primitives").unwrap();
        let view = View::of_camera(&scene, &Pose::rest(&scene), 0, [40, 30]).unwrap();
        let bake = |interval| {
            let plan = plan(&scene, &view, interval);
            Baked::new(baked(gpu, &scene, plan, Sources::View(Box::new(view))))
        };
        // Both have the same paths. The true light has a step at each frame, so nothing of it is interpolated.
        let (truth, coarse) = (bake(FRAME), bake(STEP));
        let times = &truth.stored.plan.times;
        let first = day(&truth.stored.plan.calendar).label(times[0].seconds);
        let of = |baked: &Baked, how| changes(&frames(gpu, (&scene, &view), baked, (&first, times.len() as u32), how));
        let right = of(&truth, Interpolation::Nearest);
        assert!((225..=255).contains(&right.len()), "{} frames", right.len());
        let (most, _) = largest(&right, &right);
        for how in [Interpolation::Linear, Interpolation::Nearest] {
            let (found, excess) = largest(&of(&coarse, how), &right);
            eprintln!(
                "{how:?}: largest change {found:.4}, true {most:.4}; at most {excess:.3} of the true one near it"
            );
            // The slack is for half floats and for the compression of both bakes.
            assert_eq!(found <= 1.05 * most, how == Interpolation::Linear, "{how:?}: {found}, true {most}");
            assert_eq!(excess <= 1.05, how == Interpolation::Linear, "{how:?}: {excess} of the true change near it");
        }
    });
}

//! What the indirect light of a day costs: one table with four ways to the same error. *One by one*: the path tracer
//! renders each lit frame. *Adaptive*: it renders the frames that the paper's test needs. *Shared*: one set of paths
//! serves all times, with an exact shadow ray for each vertex and time (`daylight bake`), or with sun masks at points
//! [`MASKS`] metres apart (`bake.sun_masks`), whose points are part of the time. Then the bytes of the day and the time of a picture
//! from the bake.
//!
//! `cargo bench -p lucerna-samples --bench daylight_cost [-- WIDTHxHEIGHT [SAMPLES [SCENE]]]`; 48x36, 64 and hall by
//! default; SAMPLES: paths of a pixel of the shared way; SCENE: a built-in scene, seen by its first camera.
//! `LUCERNA_DEVICE` chooses the device.
//!
//! The light is that of a white sun of 1 W/m² without sky. Noise is measured by two runs with different seeds: the
//! root mean square of their difference over √2, relative to the mean of the frame. The path tracer is measured at
//! [`MEASURED`] times of the day, with 1, 2, 4… paths a pixel until it has reached the noise of the shared way at that
//! time; cost at equal noise is interpolated between the two numbers around it (in logarithms). The cost of the whole
//! day is extrapolated from these times to all lit frames; rows with the same number of paths in each frame compare the
//! mean and the worst noise of these times. Uploads of the scene are left out on both sides.

#[path = "../../benches/common/mod.rs"]
mod common;

use std::time::Instant;

use common::Places;
use glam::{Quat, Vec3};
use lucerna::{
    Error, ErrorKind, Result,
    gpu::{Gpu, GpuOptions},
    graph::{Graph, Runner},
    measure::{Display, Exposure, Measure, Options, Pair, Picture},
    scene::{Light, LightKind, Node, Pose, Scene, Transform, View},
    technique::{Ready, Shot},
    techniques::daylight::{
        Baked, Baking, Daylight, PictureSettings, Plan, Sky, Stored, Transport, lightmap::Corners, units,
    },
    tracer::{self, Filter, Tracer},
};
use lucerna_samples::daylight::{DayOptions, KindArg, for_view};
use lucerna_scenes as builtin;

/// Times of the day at which the path tracer is measured.
const MEASURED: usize = 12;
/// Pictures whose time is measured.
const PICTURES: usize = 9;
/// Most paths a pixel of the path tracer.
const MOST: u32 = 1 << 14;
/// The goal: the shared way costs at most this share of rendering frames one by one.
const GOAL: f64 = 1.0 / 20.0;
/// The same with masks.
const MASKS_GOAL: f64 = 1.0 / 50.0;
/// Distance of the points of sun masks, metres.
const MASKS: f32 = 0.25;

fn main() -> std::process::ExitCode {
    common::end(run())
}

/// Wall-clock and processor seconds.
#[derive(Clone, Copy, Debug, Default)]
struct Spent {
    wall: f64,
    processor: Option<f64>,
}

impl Spent {
    /// What the work takes.
    fn of<T>(work: impl FnOnce() -> Result<T>) -> Result<(T, Self)> {
        let (begun, before) = (Instant::now(), processor());
        let done = work()?;
        let processor = before.zip(processor()).map(|(before, after)| after - before);
        Ok((done, Self { wall: begun.elapsed().as_secs_f64(), processor }))
    }

    /// Processor time, which other programs disturb little; without it wall-clock time.
    fn seconds(self) -> f64 {
        self.processor.unwrap_or(self.wall)
    }
}

/// Seconds of all threads of this process; `None` where the system does not tell them as Linux does.
fn processor() -> Option<f64> {
    let mut sum = 0.0;
    for thread in std::fs::read_dir("/proc/self/task").ok()? {
        // The first number is the time on a processor, nanoseconds.
        let text = std::fs::read_to_string(thread.ok()?.path().join("schedstat")).ok()?;
        sum += text.split_whitespace().next()?.parse::<f64>().ok()?;
    }
    Some(1e-9 * sum)
}

/// Root mean square of the difference over √2, and the mean.
fn noise(a: &[f32], b: &[f32]) -> (f64, f64) {
    let (mut square, mut sum) = (0.0, 0.0);
    for (a, b) in a.iter().zip(b) {
        square += 0.5 * f64::from(a - b).powi(2);
        sum += 0.5 * f64::from(a + b);
    }
    let count = a.len().max(1) as f64;
    ((square / count).sqrt(), sum / count)
}

/// The scene under a white sun alone.
fn sunlit(scene: &Scene, sun: Vec3) -> Scene {
    let mut scene = scene.clone();
    scene.lights.push(Light { name: "sun".into(), kind: LightKind::Directional, color: Vec3::ONE, intensity: 1.0 });
    let local = Transform::Matrix(glam::Mat4::from_quat(Quat::from_rotation_arc(Vec3::Z, sun)));
    scene.nodes.push(Node { light: Some(scene.lights.len() as u32 - 1), local, ..Node::default() });
    scene
}

/// The scene without lights of its own.
fn dark(scene: &Scene) -> Scene {
    let mut scene = Scene { environment: None, ..scene.clone() };
    scene.lights.clear();
    scene.nodes.iter_mut().for_each(|node| node.light = None);
    scene.materials.iter_mut().for_each(|material| material.emissive = Vec3::ZERO);
    scene
}

/// Radiance of all times, by time.
type Frames = Vec<Vec<f32>>;

/// The frames, what the paths and the compression took, and the bake.
fn shared(gpu: &Gpu, scene: &Scene, view: &View, plan: &Plan, albedo: &[f32]) -> Result<(Frames, [Spent; 2], Stored)> {
    let sources = lucerna::techniques::daylight::Sources::View(Box::new(*view));
    let mut transport = Transport::new(gpu, scene, plan, sources)?;
    let (width, height) = (plan.extent[0] as usize, plan.extent[1] as usize);
    let mut frames = vec![vec![0.0; 3 * width * height]; plan.times.len()];
    let skies = units::skies(plan)?;
    let mut spent = [Spent::default(); 2];
    let add = |to: &mut Spent, more: Spent| {
        to.wall += more.wall;
        to.processor = Some(to.processor.unwrap_or(0.0)).zip(more.processor).map(|(a, b)| a + b);
    };
    let [columns, rows] = plan.tiles();
    let mut tiles = Vec::new();
    for tile in 0..columns * rows {
        let (light, paths) = Spent::of(|| transport.tile(plan, tile))?;
        let (compressed, compression) = Spent::of(|| units::compress(plan, &light, &skies))?;
        tiles.push(compressed);
        add(&mut spent[0], paths);
        add(&mut spent[1], compression);
        for (number, [x, y]) in plan.covered(tile, &light.mask).enumerate() {
            let at = 3 * (y as usize * width + x as usize);
            for channel in 0..3 {
                let scale = albedo[at + channel] / std::f32::consts::PI;
                let of_texel = &light.sun[(3 * number + channel) * plan.times.len()..];
                frames.iter_mut().zip(of_texel).for_each(|(frame, light)| frame[at + channel] = light * scale);
            }
        }
    }
    let stored = Stored { plan: plan.clone(), tiles, probes: Vec::new(), corners: Corners::default() };
    Ok((frames, spent, stored))
}

/// Median wall-clock time of a picture of the bake at noon, milliseconds.
fn picture_ms(gpu: &Gpu, scene: &Scene, view: &View, stored: Stored) -> Result<f64> {
    let settings = PictureSettings::default();
    let mut ready = Ready::<Daylight>::new(gpu, scene, &settings, Some(&Baked::new(stored)), &mut |_, _| true)?;
    let (pose, mut runner, mut all) = (Pose::rest(scene), Runner::new(gpu), Vec::new());
    for _ in 0..=PICTURES {
        let begun = Instant::now();
        let mut graph = Graph::new("daylight");
        ready.frame(&mut graph, (scene, &pose), view, Shot::default(), &settings)?;
        runner.run(&graph)?;
        all.push(begun.elapsed().as_secs_f64() * 1e3);
    }
    // The first one creates pipelines.
    all.remove(0);
    all.sort_by(f64::total_cmp);
    Ok(all[all.len() / 2])
}

/// The path tracer's noise relative to the mean, and the seconds of one picture, for 1, 2, 4… paths a pixel.
struct Curve(Vec<(f64, f64)>);

impl Curve {
    /// Until the noise is below `wanted`.
    fn measure(gpu: &Gpu, scene: &Scene, view: &View, settings: &tracer::Settings, wanted: f64) -> Result<Self> {
        let mut running = Tracer::new(gpu, scene, &Pose::rest(scene))?;
        // Pipelines are created by the first picture.
        running.render(view, settings, 1)?;
        let (mut points, mut samples) = (Vec::new(), 1);
        loop {
            let mut picture = |seed: u32| {
                let settings = tracer::Settings { seed, ..settings.clone() };
                let layers = running.render(view, &settings, samples)?;
                layers.layer("indirect").map(|layer| layer.data.clone()).ok_or_else(no_layer)
            };
            let (pair, spent) = Spent::of(|| Ok([picture(1)?, picture(2)?]))?;
            let (deviation, mean) = noise(&pair[0], &pair[1]);
            let relative = if mean > 0.0 { deviation / mean } else { f64::INFINITY };
            points.push((relative, 0.5 * spent.seconds()));
            if relative <= wanted || samples >= MOST {
                return Ok(Self(points));
            }
            samples *= 2;
        }
    }

    /// Seconds at a noise, interpolated or extrapolated in logarithms between the two points that are nearest to it.
    fn seconds(&self, wanted: f64) -> f64 {
        let Self(points) = self;
        let below = points.iter().position(|(noise, _)| *noise <= wanted).unwrap_or(points.len() - 1);
        let [(n1, s1), (n2, s2)] = match below.checked_sub(1) {
            Some(before) => [points[before], points[below]],
            // One path a pixel is too good already.
            None => return points[0].1,
        };
        // Noise falls at least as fast as that of independent paths.
        let slope = ((s2 / s1).ln() / (n2 / n1).ln()).clamp(-2.0, -0.5);
        s2 * (wanted / n2).powf(slope)
    }

    /// Noise and seconds with 2^`doublings` paths a pixel, interpolated or extrapolated in logarithms.
    fn at(&self, doublings: f64) -> (f64, f64) {
        let Self(points) = self;
        let last = points.len() - 1;
        let first = (doublings.max(0.0) as usize).min(last.saturating_sub(1));
        let more = doublings - first as f64;
        let [(n1, s1), (n2, s2)] = [points[first], points[(first + 1).min(last)]];
        // The noise of independent paths falls by √2 with each doubling.
        let (noise, seconds) = if first < last { ((n2 / n1).log2(), (s2 / s1).log2()) } else { (-0.5, 1.0) };
        (n1 * (more * noise).exp2(), s1 * (more * seconds).exp2())
    }
}

/// Seconds of the mean frame if all frames have the same number of paths, so many that `of` their noise is `wanted`.
fn alike(curves: &[(usize, Curve)], wanted: f64, of: fn(&[f64]) -> f64) -> (f64, f64) {
    let noise = |doublings: f64| of(&curves.iter().map(|(_, curve)| curve.at(doublings).0).collect::<Vec<_>>());
    let (mut low, mut high) = (0.0, f64::from(MOST.ilog2()));
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if noise(middle) > wanted { low = middle } else { high = middle }
    }
    spread(curves.iter().map(|(_, curve)| curve.at(high).1).collect())
}

/// Mean, and its standard error.
fn spread(all: Vec<f64>) -> (f64, f64) {
    let count = all.len() as f64;
    let mean = mean(&all);
    let variance = all.iter().map(|seconds| (seconds - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
    (mean, (variance / count).sqrt())
}

fn mean(all: &[f64]) -> f64 {
    all.iter().sum::<f64>() / all.len() as f64
}

fn worst(all: &[f64]) -> f64 {
    all.iter().copied().fold(0.0, f64::max)
}

/// The change that masks make whatever the seed, relative to the mean: the ratio of the light; the root mean square of the
/// difference over all texels and times, and without the twentieth of the texels that differs most. Noise of the two seeds
/// is independent, so that the mean product of their differences has none.
fn bias(exact: [&[Vec<f32>]; 2], masks: [&[Vec<f32>]; 2]) -> (f64, [f64; 2]) {
    let values = exact[0].first().map_or(0, Vec::len);
    let (mut squares, mut sums) = (vec![0.0; values], [0.0; 2]);
    for time in 0..exact[0].len() {
        for (at, square) in squares.iter_mut().enumerate() {
            let [e1, e2, m1, m2] = [exact[0], exact[1], masks[0], masks[1]].map(|frames| f64::from(frames[time][at]));
            *square += (m1 - e1) * (m2 - e2);
            sums[0] += e1 + e2;
            sums[1] += m1 + m2;
        }
    }
    let frames = exact[0].len() as f64;
    let mean = 0.5 * sums[0] / (frames * values as f64);
    squares.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
    let of = |squares: &[f64]| {
        let square = squares.iter().sum::<f64>() / (frames * squares.len() as f64);
        square.max(0.0).sqrt() / mean
    };
    (sums[1] / sums[0], [of(&squares), of(&squares[..values - values / 20])])
}

fn no_layer() -> Error {
    Error::new(ErrorKind::Runtime, "the path tracer has no layer of this name")
}

/// The lit frames that the paper's adaptive halving needs: PerceptualDiff of the interpolated middle frame with both ends.
fn needed(frames: &[Picture]) -> Result<Vec<usize>> {
    let light = |picture: &Picture| picture.pixels.as_flattened().iter().sum::<f32>();
    let brightest = (0..frames.len()).max_by(|a, b| light(&frames[*a]).total_cmp(&light(&frames[*b]))).unwrap_or(0);
    let stops = Display::default().stops(&frames[brightest]);
    let display = Display { exposure: Exposure::Stops(stops), ..Display::default() };
    let pixels = frames[0].pixels.len() as f64;
    let pdiff_threshold = ((100.0 / 480_000.0 * pixels).round() as u64).max(1);
    let options = Options { display, pdiff_threshold, ..Options::default() };
    let last = frames.len() - 1;
    let (mut open, mut kept) = (vec![[0, last / 2], [last / 2, last]], vec![0, last / 2, last]);
    while let Some([first, last]) = open.pop() {
        if last - first < 2 {
            continue;
        }
        let middle = (first + last) / 2;
        let a = (middle - first) as f32 / (last - first) as f32;
        let ends = frames[first].pixels.iter().zip(&frames[last].pixels);
        let mixed = ends.map(|(x, y)| std::array::from_fn(|c| (1.0 - a) * x[c] + a * y[c])).collect();
        let between = Picture { pixels: mixed, ..frames[first].clone() };
        let mut differs = false;
        for end in [first, last] {
            let found = Measure::Pdiff.of(&Pair::new(&frames[end], &between)?, &options)?;
            differs |= found.detail("different") == Some(1.0);
        }
        if differs {
            kept.push(middle);
            open.extend([[first, middle], [middle, last]]);
        }
    }
    kept.sort_unstable();
    kept.dedup();
    Ok(kept)
}

fn run() -> Result<()> {
    let mut words = Places::new("WIDTHxHEIGHT [SAMPLES [SCENE]]");
    let extent = words.size([48, 36])?;
    let samples = words.number("SAMPLES", 2..=65_536, 64)?;
    let name = words.tables(&["hall", "office", "street", "conference"])?;
    let name = if name.len() == 1 { name[0] } else { "hall" };
    let gpu = Gpu::new(GpuOptions::from_env()?)?;
    let scene = dark(&builtin::load(name)?);
    let view = View::of_camera(&scene, &Pose::rest(&scene), 0, extent)?;
    let day = DayOptions { date: "2026-08-16".into(), ..DayOptions::default() };
    let baking = |seed| Baking { samples, disc: false, seed, ..Baking::default() };
    let plans = [1, 2]
        .map(|seed| for_view(&gpu, &day, KindArg::View, &baking(seed), &scene, "0", &view).map(|planned| planned.plan));
    let [first, second] = plans;
    let (first, second) = (first?, second?);
    println!("{}, {name} at {}x{}, {}", gpu.describe(), extent[0], extent[1], day.date);
    let settings = tracer::Settings {
        bounces: first.settings.bounces,
        roulette: first.settings.roulette,
        filter: Filter::Centre,
        ..tracer::Settings::default()
    };
    let albedo = {
        let lit = sunlit(&scene, Vec3::Y);
        let layers = Tracer::new(&gpu, &lit, &Pose::rest(&lit))?.render(&view, &settings, 1)?;
        layers.layer("albedo").map(|layer| layer.data.clone()).ok_or_else(no_layer)?
    };
    // The first bake creates pipelines.
    shared(&gpu, &scene, &view, &Plan { settings: Baking { samples: 2, ..baking(0) }, ..first.clone() }, &albedo)?;
    let (a, spent, stored) = shared(&gpu, &scene, &view, &first, &albedo)?;
    let (b, ..) = shared(&gpu, &scene, &view, &second, &albedo)?;
    let lit = first.times.len();
    let masked = |plan: &Plan| Plan { settings: Baking { sun_masks: MASKS, ..plan.settings.clone() }, ..plan.clone() };
    let few = |plan: &Plan| Plan { settings: Baking { samples: 2, ..plan.settings.clone() }, ..plan.clone() };
    shared(&gpu, &scene, &view, &masked(&few(&first)), &albedo)?;
    let (a_masks, of_masks, _) = shared(&gpu, &scene, &view, &masked(&first), &albedo)?;
    let (b_masks, ..) = shared(&gpu, &scene, &view, &masked(&second), &albedo)?;
    let of_shared: Vec<f64> = a.iter().zip(&b).map(|(a, b)| noise(a, b)).map(|(noise, mean)| noise / mean).collect();
    let [paths, compression] = spent;
    println!("{lit} lit frames of {}; shared: {samples} paths a pixel", first.steps);
    println!(
        "shared paths {:.1} s of wall clock, {:.1} s of processor; compression {:.1} s and {:.1} s",
        paths.wall,
        paths.seconds(),
        compression.wall,
        compression.seconds()
    );
    println!(
        "noise of the shared way: mean over times {:.1} %, worst {:.1} %",
        100.0 * mean(&of_shared),
        100.0 * worst(&of_shared)
    );
    let masks_noise: Vec<f64> =
        a_masks.iter().zip(&b_masks).map(|(a, b)| noise(a, b)).map(|(noise, mean)| noise / mean).collect();
    let (energy, off) = bias([&a, &b], [&a_masks, &b_masks]);
    println!(
        "masks, points {MASKS} m apart: noise {:.1} %, worst {:.1} %; light {energy:.4} of exact; off by {:.1} %, {:.1} % without the worst twentieth of texels (root mean square over all times)",
        100.0 * mean(&masks_noise),
        100.0 * worst(&masks_noise),
        100.0 * off[0],
        100.0 * off[1]
    );
    println!("\n{:>9} {:>13} {:>13} {:>13} {:>14}", "time", "shared, %", "tracer, %", "paths a pixel", "seconds equal");
    let civil = day.day()?;
    let mut curves = Vec::new();
    for index in 0..MEASURED.min(lit) {
        let at = (2 * index + 1) * lit / (2 * MEASURED.min(lit));
        let time = first.times[at];
        let scene = sunlit(&scene, Vec3::from(time.sun));
        let curve = Curve::measure(&gpu, &scene, &view, &settings, of_shared[at])?;
        let last = curve.0.len() - 1;
        println!(
            "{:>9} {:>13.1} {:>13.1} {:>13} {:>14.2}",
            civil.label(time.seconds),
            100.0 * of_shared[at],
            100.0 * curve.0[last].0,
            1_u32 << last,
            curve.seconds(of_shared[at])
        );
        curves.push((at, curve));
    }
    let there: Vec<f64> = curves.iter().map(|(at, _)| of_shared[*at]).collect();
    let at_each = spread(curves.iter().map(|(at, curve)| curve.seconds(of_shared[*at])).collect());
    let sky_of = |t: usize| Sky::new(first.weather, first.times[t].sun.map(f64::from)).map_err(Error::input);
    let coloured = |t: usize| {
        let sun = sky_of(t)?.sun_irradiance();
        let pixels = a[t].chunks_exact(3).map(|pixel| std::array::from_fn(|c| pixel[c] * sun[c])).collect();
        Picture::new(extent[0], extent[1], pixels)
    };
    let kept = needed(&(0..lit).map(coloured).collect::<Result<Vec<_>>>()?)?;
    let all = paths.seconds() + compression.seconds();
    println!("\n{:<58} {:>9} {:>11} {:>8} {:>10}", "indirect light of the day", "frames", "seconds", "±", "of the 1st");
    let each = at_each.0 * lit as f64;
    let share = |seconds: f64| format!("1/{:.1}", each / seconds);
    let row = |what: &str, frames: usize, (mean, deviation): (f64, f64)| {
        let seconds = mean * frames as f64;
        println!("{what:<58} {frames:>9} {seconds:>11.1} {:>8.1} {:>10}", deviation * frames as f64, share(seconds));
    };
    row("one by one, the noise of the shared way at each time", lit, at_each);
    row("one by one, as many paths in each, equal mean noise", lit, alike(&curves, mean(&there), mean));
    row("one by one, as many paths in each, equal worst noise", lit, alike(&curves, worst(&there), worst));
    row("adaptive (paper's test), noise at each time", kept.len(), at_each);
    let row_of = |what: &str, seconds: f64| {
        println!("{what:<58} {lit:>9} {seconds:>11.1} {:>8} {:>10}", "", share(seconds));
    };
    row_of("shared paths, exact shadow rays", paths.seconds());
    row_of("the same with compression", all);
    let [masks, masks_compression] = of_masks;
    row_of("shared paths, sun masks", masks.seconds());
    row_of("the same with compression", masks.seconds() + masks_compression.seconds());
    let summary = stored.summary();
    println!(
        "bytes: {} as 16-bit floats of all frames, {} compressed ({:.1} %), {:.1} images a tile; worst frame {:.2} % off, tile {:.2} %",
        summary.raw_bytes,
        summary.bytes,
        100.0 * summary.bytes as f64 / summary.raw_bytes as f64,
        summary.images,
        100.0 * summary.worst_frame,
        100.0 * summary.worst_tile
    );
    println!("a picture from the bake: {:.1} ms of wall clock", picture_ms(&gpu, &scene, &view, stored)?);
    for (goal, spent, what) in [(GOAL, paths, "exact shadow rays"), (MASKS_GOAL, masks, "sun masks")] {
        let verdict = if spent.seconds() <= goal * each { "reached" } else { "missed" };
        println!("goal with {what}, at most 1/{:.0} of one by one at the noise of each time: {verdict}", 1.0 / goal);
    }
    println!(
        "seconds are of the processor where the system tells them; ±: standard error over the {} times",
        curves.len()
    );
    Ok(())
}

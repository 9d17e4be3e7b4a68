//! Cost of a picture of baked daylight: against the number of images of a tile, against the number of steps of the day, by the interpolation,
//! and from frames. The images are made up, so nothing is baked.
//!
//! `cargo bench --bench daylight_frame [-- WIDTHxHEIGHT [ROUNDS]]`; 320x240 and 9 by default. `LUCERNA_DEVICE` chooses the device. Times are
//! medians of ROUNDS rounds, ms. In each round all rows run once. *decode*: the pass that finds the light of all pixels. *host*: the time
//! until the passes of the picture are declared; the coefficients are a part of it. A second table has sequences from resident and streamed frames;
//! the file has just been written, so that the system has it in its cache.

mod common;
#[path = "../tests/daylight_lab/mod.rs"]
mod daylight_lab;

use std::time::Instant;

use common::{EDGES, ROUNDS, median, number, size, words};
use daylight_lab::{polar_day, stored};
use lucerna::{
    Result,
    bake::Digest,
    gpu::{Gpu, GpuOptions},
    graph::{Graph, Runner},
    scene::{Pose, Scene, View},
    technique::{Bake, Ready, Shot},
    techniques::daylight::{Baked, Daylight, Interpolation, PictureSettings, frames},
};
use lucerna_scenes as builtin;

fn main() -> std::process::ExitCode {
    common::end(run())
}

struct Row {
    name: String,
    ready: Ready<Daylight>,
    runner: Runner,
    settings: PictureSettings,
    decode: Vec<f64>,
    host: Vec<f64>,
    fetches: f64,
    bytes: u64,
}

impl Row {
    fn new(gpu: &Gpu, scene: &Scene, name: String, baked: &Baked, interpolation: Interpolation) -> Result<Self> {
        let mut settings = PictureSettings::default();
        settings.daylight.interpolation = interpolation;
        settings.daylight.time = "09:02".into();
        settings.shadow.kind = lucerna::passes::shadow::Kind::Off;
        let ready = Ready::new(gpu, scene, &settings, Some(baked), &mut |_, _| true)?;
        let images = baked.stored.tiles.iter().map(|tile| tile.sun.bytes() + tile.sky.bytes()).sum::<u64>();
        let frames = baked.frames.as_ref().map_or(0, |frames| frames.step_bytes() * u64::from(frames.steps));
        let (decode, host) = (Vec::new(), Vec::new());
        let bytes = images + frames;
        Ok(Self { name, ready, runner: Runner::new(gpu), settings, decode, host, fetches: 0.0, bytes })
    }

    fn once(&mut self, scene: &Scene, view: &View) -> Result<()> {
        let numbers = self.picture(scene, view, 0)?;
        self.fetches = numbers.first().map_or(0.0, |(_, number)| *number);
        Ok(())
    }

    /// Renders a picture and gives the numbers about its cost.
    fn picture(&mut self, scene: &Scene, view: &View, frame: u32) -> Result<Vec<(&'static str, f64)>> {
        let begun = Instant::now();
        let mut graph = Graph::new("daylight");
        graph.frame = frame;
        let pose = Pose::rest(scene);
        let picture = self.ready.frame(&mut graph, (scene, &pose), view, Shot::default(), &self.settings)?;
        self.host.push(begun.elapsed().as_secs_f64() * 1e3);
        let reading = picture.read(&mut graph, false, false);
        let frame = self.runner.run(&graph)?;
        let decode = frame.report.passes.iter().filter(|pass| pass.name.contains("decode"));
        self.decode.push(decode.map(|pass| pass.gpu_ms.unwrap_or(pass.cpu_ms)).sum());
        Ok(reading.numbers(&frame))
    }
}

fn run() -> Result<()> {
    let mut words = words();
    let extent = words.next().map_or(Ok([320, 240]), |text| size("size", &text, EDGES))?;
    let rounds = words.next().map_or(Ok(9), |text| number("rounds", &text, ROUNDS))?;
    let gpu = Gpu::new(GpuOptions::default())?;
    println!("{}, {}x{}, {rounds} rounds", gpu.describe(), extent[0], extent[1]);
    let scene = builtin::load("cornell")?;
    let view = View::of_camera(&scene, &Pose::rest(&scene), 0, extent)?;
    let mut rows = Vec::new();
    for images in [5, 10, 20] {
        for interval in [40.0, 5.0, 1.0] {
            let baked = Baked::new(stored(&scene, &view, polar_day(), interval, 0.0, images));
            let name = format!("{images} images, {} steps", baked.stored.plan.times.len());
            rows.push(Row::new(&gpu, &scene, name, &baked, Interpolation::Linear)?);
        }
    }
    let base = stored(&scene, &view, polar_day(), 5.0, 0.0, 10);
    let folder = std::env::temp_dir().join(format!("lucerna-daylight-{}.frames", std::process::id()));
    frames::write(&folder, &base, Digest::of(b"lab"), true, |_| true)?;
    let framed = Baked { stream: None, ..Baked::read(&folder)? };
    for (how, name) in [(Interpolation::CatmullRom, "Catmull-Rom"), (Interpolation::LogLinear, "log-linear")] {
        rows.push(Row::new(&gpu, &scene, format!("10 images, 288 steps, {name}"), &Baked::new(base.clone()), how)?);
    }
    for (how, name) in [
        (Interpolation::Linear, "linear"),
        (Interpolation::CatmullRom, "Catmull-Rom"),
        (Interpolation::LogLinear, "log-linear"),
    ] {
        rows.push(Row::new(&gpu, &scene, format!("frames, 288 steps, {name}"), &framed, how)?);
    }
    for round in 0..=rounds {
        for row in &mut rows {
            row.once(&scene, &view)?;
            // The first round makes pipelines.
            if round == 0 {
                (row.decode, row.host) = (Vec::new(), Vec::new());
            }
        }
    }
    println!("| | decode | host | fetches a pixel | bytes of the light |");
    println!("|---|---|---|---|---|");
    for row in rows {
        let pixels = f64::from(extent[0] * extent[1]);
        println!(
            "| {} | {:.2} | {:.2} | {:.2} | {} |",
            row.name,
            median(row.decode),
            median(row.host),
            row.fetches / pixels,
            row.bytes
        );
    }
    let streamed = sequences(&gpu, &scene, &view, &framed);
    let _ = std::fs::remove_file(&folder);
    streamed
}

/// Sequences of pictures from resident and from streamed frames.
fn sequences(gpu: &Gpu, scene: &Scene, view: &View, framed: &Baked) -> Result<()> {
    println!();
    println!(
        "Sequences of 100 pictures from frames of {} bytes:",
        framed.frames.as_ref().map_or(0, |f| f.step_bytes())
    );
    println!();
    println!("| minutes a picture | | picture, median | longest | wait of the first | longest wait of the others |");
    println!("|---|---|---|---|---|---|");
    for minutes in [1.0, 5.0, -30.0] {
        for (name, stream) in [("resident", None), ("streamed", Some(frames::DEFAULT_RING))] {
            let baked = Baked { stream, ..framed.clone() };
            let mut row = Row::new(gpu, scene, String::new(), &baked, Interpolation::Linear)?;
            row.settings.daylight.minutes = minutes;
            let (mut times, mut waits) = (Vec::new(), Vec::new());
            for frame in 0..100 {
                let begun = Instant::now();
                let numbers = row.picture(scene, view, frame)?;
                times.push(begun.elapsed().as_secs_f64() * 1e3);
                waits.push(numbers.iter().find(|(name, _)| *name == "stream_wait_ms").map_or(0.0, |(_, ms)| *ms));
            }
            let most = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
            // The first picture makes pipelines.
            let (longest, later) = (most(&times[1..]), most(&waits[1..]));
            let middle = median(times.split_off(1));
            println!("| {minutes} | {name} | {middle:.1} | {longest:.1} | {:.1} | {later:.1} |", waits[0]);
        }
    }
    Ok(())
}

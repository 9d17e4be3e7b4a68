//! What picks from many virtual lights, light put back, and cells of irradiance cost and how far they are off: three tables.
//!
//! `cargo bench --bench igi_many [-- WIDTHxHEIGHT [MOST [TABLE]]]`; 96x72 by default; MOST: virtual lights up to which all are gathered,
//! 10000 by default and at most; TABLE: `picks`, `compensation` or `cache` alone. `LUCERNA_DEVICE` chooses the device. Times are medians of
//! three, of the passes named. Errors are relative mean squared errors of the indirect light: of picks against MOST virtual lights of another
//! seed, of light put back against the path tracer, of cells against none.

mod common;

use lucerna::{
    Result,
    gpu::{Gpu, GpuOptions},
    graph::{Graph, Report, Runner},
    resident::Resident,
    scene::{Material, Pose, Scene, View},
    techniques::igi::{Igi, PictureSettings, Settings},
    tracer::{self, Filter, Tracer},
};
use lucerna_scenes as builtin;

fn main() -> std::process::ExitCode {
    common::end(run())
}

/// A scene that stays on the device.
struct Studio {
    scene: Scene,
    resident: Resident,
    runner: Runner,
    igi: Igi,
    extent: [u32; 2],
}

/// Light of a picture and what it took.
struct Shown {
    indirect: Vec<[f32; 4]>,
    total: Vec<[f32; 4]>,
    /// Shadow rays of the gathered texels.
    rays: f64,
    cells: u32,
    report: Report,
}

impl Studio {
    fn new(gpu: &Gpu, scene: Scene, extent: [u32; 2]) -> Result<Self> {
        let resident = Resident::new(gpu, &scene)?;
        let igi = Igi::new(gpu, &scene, &resident, &Settings::default())?;
        Ok(Self { scene, resident, runner: Runner::new(gpu), igi, extent })
    }

    fn view(&self) -> Result<View> {
        View::of_camera(&self.scene, &Pose::rest(&self.scene), 0, self.extent)
    }

    fn once(&mut self, settings: &Settings, seed: u32) -> Result<Shown> {
        let mut graph = Graph::new("igi");
        graph.seed = seed;
        let pose = Pose::rest(&self.scene);
        let handles = self.resident.frame_in(&mut graph, &self.scene, &pose);
        let view = self.view()?.fit_far(&handles.bounds());
        let all = PictureSettings { igi: settings.clone(), ..PictureSettings::default() };
        let out = self.igi.picture(&mut graph, &self.scene, &pose, &handles, &view, &all)?.outputs;
        let images = [out.indirect, out.total, out.gathered].map(|image| graph.read_image(image));
        let cells = out.cache.map(|cache| graph.read_buffer(cache.list));
        let frame = self.runner.run(&graph)?;
        let [indirect, total, gathered] = images.map(|image| frame.image(image).to_f32());
        let rays = gathered.iter().map(|p| f64::from(p[3])).sum();
        let cells = cells.map_or(0, |token| frame.buffer::<u32>(token)[0]);
        Ok(Shown { indirect, total, rays, cells, report: frame.report })
    }

    /// A picture, and the median time of the passes whose names begin so, ms.
    fn timed(&mut self, settings: &Settings, seed: u32, passes: &[&str]) -> Result<(Shown, f64)> {
        let mut shown = self.once(settings, seed)?;
        let mut times = Vec::new();
        for _ in 0..3 {
            shown = self.once(settings, seed)?;
            let counts = |name: &str| passes.iter().any(|p| name.starts_with(p));
            let of = shown.report.passes.iter().filter(|pass| counts(&pass.name));
            times.push(of.filter_map(|pass| pass.gpu_ms).sum::<f64>());
            // Long ones need no repetition.
            if times[0] > 4000.0 {
                break;
            }
        }
        times.sort_by(f64::total_cmp);
        Ok((shown, times[times.len() / 2]))
    }
}

/// 1/(3wh) Σ (t − f)²/(t² + 0.01), as `rel-mse` of `lucerna compare`.
fn error(found: &[[f32; 4]], truth: &[[f32; 4]]) -> f64 {
    let of = |(f, t): (&[f32; 4], &[f32; 4])| -> f64 {
        (0..3).map(|c| f64::from(f[c] - t[c]).powi(2) / (f64::from(t[c]).powi(2) + 0.01)).sum()
    };
    found.iter().zip(truth).map(of).sum::<f64>() / (3.0 * truth.len() as f64)
}

fn sum(pixels: &[[f32; 4]]) -> f64 {
    pixels.iter().flat_map(|p| &p[..3]).map(|&v| f64::from(v)).sum()
}

const GATHER: [&str; 4] = ["igi.gather", "igi.light_tree", "igi.gather_picks", "igi.near"];

fn run() -> Result<()> {
    let mut words = common::Places::new("WIDTHxHEIGHT [MOST [TABLE]]");
    let extent = words.size([96, 72])?;
    let most = words.number("MOST", 1..=10_000, 10_000)?;
    let tables = words.tables(&["picks", "compensation", "cache"])?;
    let gpu = Gpu::new(GpuOptions::from_env()?)?;
    println!("{} at {}x{}", gpu.describe(), extent[0], extent[1]);
    let wanted = |name: &str| tables.contains(&name);
    for name in ["cornell", "office"].into_iter().filter(|_| wanted("picks")) {
        picks(&gpu, name, extent, most)?;
    }
    for name in ["cornell", "office"].into_iter().filter(|_| wanted("compensation")) {
        compensation(&gpu, name, extent)?;
    }
    if wanted("cache") { cache(&gpu, extent) } else { Ok(()) }
}

/// Cost and error against the number of virtual lights, of all and of picks.
fn picks(gpu: &Gpu, name: &str, extent: [u32; 2], most: u32) -> Result<()> {
    let mut studio = Studio::new(gpu, builtin::load(name)?, extent)?;
    let base = Settings { candidates: 1, bounces: 1, specular: false, direct_samples: 1, ..Settings::default() };
    let truth = studio.once(&Settings { vpls: most, ..base.clone() }, 4711)?.indirect;
    println!(
        "\n{name}: all virtual lights, 16 and 64 picks: ms, rays per pixel, relative mean squared error against {most}"
    );
    println!("{:>6} {:>34} {:>30} {:>30}", "vpls", "all", "16 picks", "64 picks");
    for vpls in [30, 100, 300, 1000, 3000, 10_000] {
        print!("{vpls:>6}");
        for picks in [0, 16, 64] {
            if picks == 0 && vpls > most {
                print!("{:>34}", "-");
                continue;
            }
            let (shown, ms) = studio.timed(&Settings { vpls, picks, ..base.clone() }, 1, &GATHER)?;
            let rays = shown.rays / f64::from(extent[0] * extent[1]);
            print!(" {ms:>12.1} {rays:>7.1} {:>9.5}", error(&shown.indirect, &truth));
        }
        println!();
    }
    Ok(())
}

/// Energy and error against the path tracer with and without compensation.
fn compensation(gpu: &Gpu, name: &str, extent: [u32; 2]) -> Result<()> {
    let mut studio = Studio::new(gpu, builtin::load(name)?, extent)?;
    let pose = Pose::rest(&studio.scene);
    let mut tracer = Tracer::new(gpu, &studio.scene, &pose)?;
    let settings =
        tracer::Settings { bounces: 2, diffuse_only: true, filter: Filter::Centre, ..tracer::Settings::default() };
    let layers = tracer.render(&studio.view()?, &settings, 256)?;
    let Some(layer) = layers.layer("indirect") else { return Ok(()) };
    let truth: Vec<[f32; 4]> = layer.data.chunks_exact(3).map(|p| [p[0], p[1], p[2], 1.0]).collect();
    println!("\n{name}: 1000 virtual lights of 8 candidates, 2 bounces, against the path tracer (256 samples)");
    println!("{:>6} {:>5} {:>10} {:>8} {:>10}", "bound", "rays", "ms", "energy", "error");
    for (bound, compensation) in [(0.0, 0), (0.01, 0), (0.02, 0), (0.02, 1), (0.02, 4), (0.1, 0), (0.1, 1), (0.1, 4)] {
        let settings = Settings { vpls: 1000, bound, compensation, specular: false, ..Settings::default() };
        let (mut energy, mut off, mut time) = (0.0, 0.0, 0.0);
        for seed in 1..=4 {
            let (shown, ms) = studio.timed(&settings, seed, &GATHER)?;
            energy += sum(&shown.indirect) / sum(&truth) / 4.0;
            off += error(&shown.indirect, &truth) / 4.0;
            time += ms / 4.0;
        }
        println!("{bound:>6} {compensation:>5} {time:>10.1} {energy:>8.4} {off:>10.5}");
    }
    Ok(())
}

/// Cells behind mirrors: the Cornell box with mirrors for blocks and walls.
fn cache(gpu: &Gpu, extent: [u32; 2]) -> Result<()> {
    let mut scene = builtin::load("cornell")?;
    for material in scene.materials.iter_mut().filter(|m| m.emissive == glam::Vec3::ZERO).skip(1) {
        let color = glam::Vec3::splat(0.9);
        *material = Material { metallic: 1.0, roughness: 0.0, ..Material::diffuse(material.name.clone(), color) };
    }
    let mut studio = Studio::new(gpu, scene, extent)?;
    let base = Settings { vpls: 300, candidates: 1, ..Settings::default() };
    let passes = ["igi.ray_tree_gather", "igi.cache"];
    println!("\ncornell with mirrors, 300 virtual lights: light on what they show");
    println!("{:>8} {:>10} {:>8} {:>10}", "cells", "ms", "number", "error");
    let (exact, ms) = studio.timed(&base, 1, &passes)?;
    println!("{:>8} {ms:>10.1} {:>8} {:>10}", "none", "", "");
    for side in [0.1, 0.05, 0.02, 0.01, 0.005] {
        let (shown, ms) = studio.timed(&Settings { cache: side, ..base.clone() }, 1, &passes)?;
        println!("{side:>8} {ms:>10.1} {:>8} {:>10.6}", shown.cells, error(&shown.total, &exact.total));
    }
    let (shown, ms) = studio.timed(&Settings { picks: 16, ..base }, 1, &passes)?;
    println!("{:>8} {ms:>10.1} {:>8} {:>10.6}", "16 picks", "", error(&shown.total, &exact.total));
    Ok(())
}

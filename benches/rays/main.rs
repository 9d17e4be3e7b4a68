//! Rays a second through Sponza and Conference: camera rays, shadow rays to a lamp and to the sun, and rays that leave the
//! surfaces in all directions; nearest hit and any hit. Beside it the same rays through Embree on as many threads, where
//! its development files and a C compiler are there.
//!
//! `cargo bench --bench rays [-- [--assets DIR] [--size N] [--rounds N] [SCENE…]]`; `LUCERNA_DEVICE` chooses the device.

#[path = "../common/mod.rs"]
mod common;
mod embree;
mod sets;

use lucerna::{
    Result,
    gpu::{BufferDesc, Gpu, GpuOptions, OwnedBuffer},
    graph::{Graph, Runner},
    rays::Rays,
    resident::Resident,
    scene::{self, LoadOptions, Pose, Scene},
    shaders::{test::trace_at as shader, types},
};
use lucerna_scenes as builtin;
use std::path::PathBuf;

fn main() -> std::process::ExitCode {
    common::end(run())
}

/// What to measure.
struct Options {
    assets: PathBuf,
    /// Camera rays to a side.
    size: u32,
    rounds: usize,
    scenes: Vec<String>,
}

fn options() -> Result<Options> {
    let mut out = Options {
        assets: PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/assets"),
        size: 512,
        rounds: 5,
        scenes: Vec::new(),
    };
    let mut arguments = common::words();
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().unwrap_or_default();
        match argument.as_str() {
            "--assets" => out.assets = value().into(),
            "--size" => out.size = common::number("--size", &value(), 8..=4096)?,
            "--rounds" => out.rounds = common::number("--rounds", &value(), common::ROUNDS)? as usize,
            flag if flag.starts_with("--") => return common::wrong("option", flag, "--assets, --size, --rounds"),
            _ => out.scenes.push(argument),
        }
    }
    if out.scenes.is_empty() {
        out.scenes = ["sponza", "conference"].map(String::from).to_vec();
    }
    Ok(out)
}

fn run() -> Result<()> {
    let options = options()?;
    let gpu = Gpu::new(GpuOptions::from_env()?)?;
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    println!("{}, {threads} threads, best of {} runs, Mrays/s", gpu.describe(), options.rounds);
    let embree = embree::Program::build();
    if let Err(why) = &embree {
        println!("SKIPPED: Embree: {why}");
    }
    for name in &options.scenes {
        let file = match name.as_str() {
            "sponza" => options.assets.join("scenes/sponza-dabrovic/sponza.obj"),
            "conference" => options.assets.join("scenes/conference/conference.bin"),
            _ => PathBuf::from(name),
        };
        let scene = if builtin::NAMES.contains(&name.as_str()) {
            builtin::load(name)?
        } else if file.exists() {
            scene::load(&file, &LoadOptions::default())?
        } else {
            println!("SKIPPED: {name}: {} is not there", file.display());
            continue;
        };
        measure(&gpu, name, &scene, &options, threads, embree.as_ref().ok())?;
    }
    Ok(())
}

fn measure(
    gpu: &Gpu,
    name: &str,
    scene: &Scene,
    options: &Options,
    threads: usize,
    embree: Option<&embree::Program>,
) -> Result<()> {
    let resident = Resident::new(gpu, scene)?;
    let started = std::time::Instant::now();
    let rays = Rays::in_compute(gpu, scene, &resident)?;
    let built = started.elapsed();
    let bvh = scene::bvh::Bvh::build(scene, &Pose::rest(scene));
    println!("\n{name}: {} triangles, built in {:.2} s", bvh.triangles().len(), built.as_secs_f64());
    let query = if gpu.caps().ray_query { Some(Rays::new(gpu, scene, &resident)?) } else { None };
    let mut device = Device { gpu: gpu.clone(), scene, resident, rays, query, runner: Runner::new(gpu) };
    let sets = sets::sets(&bvh, options.size);
    let theirs = embree.map(|e| e.run(threads, options.rounds, bvh.triangles(), &sets)).transpose()?;
    println!("by the processors' time (by the clock); turns of the loops of one ray: mean, most");
    println!(
        "{:<7} {:<8} {:>16} {:>16} {:>16} {:>6} {:>6}  {:>11} {:>6}",
        "rays", "hit", "compute", "ray query", "Embree", "ratio", "hits %", "differences", "turns"
    );
    let first = &sets[0].rays;
    let idle = (0..5).map(|_| device.trace(first, true, Mode::Idle)).collect::<Result<Vec<_>>>()?;
    let idle = idle.iter().map(|t| t.0.busy / first.len() as f64).fold(f64::INFINITY, f64::min);
    for (index, set) in sets.iter().enumerate() {
        for any in [true, false] {
            let mut best = |mode: Mode| -> Result<embree::Taken> {
                let mut best = embree::Taken { seconds: f64::INFINITY, busy: f64::INFINITY, hits: 0 };
                for _ in 0..=options.rounds {
                    let taken = device.trace(&set.rays, any, mode)?.0;
                    best.seconds = best.seconds.min(taken.seconds);
                    // Without what moving the rays to the device and back takes.
                    best.busy = best.busy.min(taken.busy - idle * set.rays.len() as f64);
                    best.hits = taken.hits;
                }
                Ok(best)
            };
            let ours = best(Mode::Compute)?;
            let query = if gpu.caps().ray_query { Some(best(Mode::Query)?) } else { None };
            let (_, mean, most) = device.trace(&set.rays, any, Mode::Count)?;
            let million = set.rays.len() as f64 / 1e6;
            let rate = |t: &embree::Taken| million / t.busy * threads as f64;
            let text = |t: &embree::Taken| format!("{:.2} ({:.2})", rate(t), million / t.seconds);
            let or_none = |t: Option<&embree::Taken>| t.map_or_else(|| "-".into(), text);
            let other = theirs.as_ref().map(|t| t[index][usize::from(!any)]);
            let difference = |t: Option<&embree::Taken>| {
                t.map_or_else(|| "-".into(), |t| format!("{:+}", ours.hits as i64 - t.hits as i64))
            };
            println!(
                "{:<7} {:<8} {:>16} {:>16} {:>16} {:>6} {:>6.1}  {:>5} {:>5} {mean:>6.1} {most}",
                set.name,
                if any { "any" } else { "closest" },
                text(&ours),
                or_none(query.as_ref()),
                or_none(other.as_ref()),
                other.map_or_else(|| "-".into(), |o| format!("{:.2}", rate(&ours) / rate(&o))),
                100.0 * ours.hits as f64 / set.rays.len() as f64,
                difference(query.as_ref()),
                difference(other.as_ref()),
            );
        }
    }
    Ok(())
}

/// How to trace.
#[derive(Clone, Copy, PartialEq)]
enum Mode {
    /// Not at all: everything else of a pass.
    Idle,
    Compute,
    /// Counting turns instead of triangles.
    Count,
    Query,
}

/// Seconds that all threads of this process, those that are alive, have had a processor.
fn busy() -> f64 {
    let threads = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let of = |path: std::path::PathBuf| std::fs::read_to_string(path.join("schedstat")).ok();
    let nanoseconds = |text: String| text.split_whitespace().next().and_then(|w| w.parse::<f64>().ok());
    threads.filter_map(|thread| of(thread.path()).and_then(nanoseconds)).sum::<f64>() * 1e-9
}

struct Device<'a> {
    gpu: Gpu,
    scene: &'a Scene,
    resident: Resident,
    rays: Rays,
    query: Option<Rays>,
    runner: Runner,
}

impl Device<'_> {
    /// One pass; then the mean and the most turns.
    fn trace(&mut self, rays: &[types::Ray], any: bool, mode: Mode) -> Result<(embree::Taken, f64, u32)> {
        let mut graph = Graph::new("rays");
        let handles = self.resident.frame(&mut graph, self.scene, 0.0);
        let traced = match &mut self.query {
            Some(query) if mode == Mode::Query => query.frame(&mut graph, &handles),
            _ => self.rays.frame(&mut graph, &handles),
        };
        let count = rays.len() as u32;
        let buffer = |name, size| OwnedBuffer::new(&self.gpu, name, BufferDesc::device(size));
        let rays = OwnedBuffer::with_contents(&self.gpu, "rays", bytemuck::cast_slice(rays))?;
        let hits = buffer("hits", u64::from(count) * size_of::<types::Hit>() as u64)?;
        let args = shader::Args {
            trace_nodes: traced.trace_nodes,
            trace_triangles: traced.trace_triangles,
            trace_instances: traced.trace_instances,
            trace_indices: traced.trace_indices,
            trace_uvs: traced.trace_uvs,
            trace_colors: traced.trace_colors,
            trace_scene: traced.trace_scene,
            scene_at: traced.scene_at,
            trace_accel: traced.trace_accel,
            materials: traced.materials,
            scene_textures: traced.scene_textures,
            push: shader::Push {
                rays_at: rays.address_words(),
                hits_at: hits.address_words(),
                count: if mode == Mode::Idle { 0 } else { count },
            },
            spec: shader::Spec { any: u32::from(any), count: u32::from(mode == Mode::Count) },
        };
        let [rays, hits] = [rays, hits].map(|buffer| graph.import_buffer(&buffer));
        graph.compute(args, count).reading(rays).writing(hits);
        let token = graph.read_buffer(hits);
        let before = busy();
        let frame = self.runner.run(graph)?;
        let busy = busy() - before;
        let pass = frame.report.passes.iter().find(|p| p.name.starts_with("test.trace"));
        let seconds = pass.and_then(|p| p.gpu_ms).map_or(f64::INFINITY, |ms| ms / 1000.0);
        let all = frame.buffer::<types::Hit>(token);
        let hits = all.iter().filter(|h| h.instance != u32::MAX).count();
        let sum: u64 = all.iter().map(|h| u64::from(h.triangle)).sum();
        let most = all.iter().map(|h| h.triangle).max().unwrap_or(0);
        Ok((embree::Taken { seconds, busy, hits }, sum as f64 / all.len() as f64, most))
    }
}

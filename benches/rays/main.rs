//! Rays a second through Sponza and Conference: camera rays, shadow rays to a lamp and to the sun, and rays that leave the
//! surfaces in all directions; nearest hit and any hit. Beside it the same rays through Embree on as many threads, where
//! its development files and a C compiler are there, and through the device's ray queries where it has them: their last
//! number is how many more rays hit something by our own traversal.
//!
//! `cargo bench --bench rays [-- [--assets DIR] [--size N] [--rounds N] [SCENE…]]`; `LUCERNA_DEVICE` chooses the device.

mod embree;
mod sets;

use lucerna::{
    ErrorKind, Result,
    gpu::{Gpu, GpuOptions, RayQuery},
    graph::{Graph, Runner},
    rays::Rays,
    scene::{self, LoadOptions, Pose, Scene, builtin, resident::Resident},
    shaders::{test::trace as shader, types},
};
use std::path::PathBuf;

fn main() -> std::process::ExitCode {
    match run() {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            std::process::ExitCode::from(error.exit_code())
        }
    }
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
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut number = || {
            let text = arguments.next().unwrap_or_default();
            text.parse::<u32>().map_err(|_| lucerna::Error::usage(format!("{argument} {text:?}; allowed: a number")))
        };
        match argument.as_str() {
            "--assets" => out.assets = arguments.next().unwrap_or_default().into(),
            "--size" => out.size = number()?.clamp(8, 4096),
            "--rounds" => out.rounds = number()?.max(1) as usize,
            // From cargo.
            "--bench" => {}
            _ => out.scenes.push(argument),
        }
    }
    if out.scenes.is_empty() {
        out.scenes = ["sponza", "conference"].map(String::from).to_vec();
    }
    Ok(out)
}

/// With ray queries, also where they are emulated, unless the environment chooses otherwise or the device has none.
fn open() -> Result<Gpu> {
    let options = GpuOptions::from_env()?;
    if options.ray_query != RayQuery::Auto {
        return Gpu::new(options);
    }
    match Gpu::new(GpuOptions { ray_query: RayQuery::On, ..options.clone() }) {
        Err(error) if error.kind() == ErrorKind::NoDevice => Gpu::new(options),
        opened => opened,
    }
}

fn run() -> Result<()> {
    let options = options()?;
    let gpu = open()?;
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
    let mut device = Device { scene, resident, rays, runner: Runner::new(gpu) };
    let mut query = if gpu.caps().ray_query {
        let resident = Resident::new(gpu, scene)?;
        let rays = Rays::new(gpu, scene, &resident)?;
        Some(Device { scene, resident, rays, runner: Runner::new(gpu) })
    } else {
        None
    };
    let sets = sets::sets(&bvh, options.size);
    let theirs = embree.map(|e| e.run(threads, options.rounds, bvh.triangles(), &sets)).transpose()?;
    println!("by the processors' time (by the clock)");
    println!(
        "{:<8} {:<8} {:>17} {:>17} {:>7} {:>7} {:>11}  {:>17}",
        "rays", "hit", "lucerna", "Embree", "ratio", "hits %", "difference", "ray query"
    );
    let idle = device.idle(&sets[0].rays)?;
    let idle_query = query.as_mut().map(|q| q.idle(&sets[0].rays)).transpose()?.unwrap_or(0.0);
    for (index, set) in sets.iter().enumerate() {
        for any in [true, false] {
            let ours = device.best(&set.rays, any, idle, options.rounds)?;
            // Drivers that emulate ray queries take long.
            let queried = query.as_mut().map(|q| q.best(&set.rays, any, idle_query, 1)).transpose()?;
            let million = set.rays.len() as f64 / 1e6;
            let rates = |t: &embree::Taken| [million / t.busy * threads as f64, million / t.seconds];
            let text = |r: [f64; 2]| format!("{:.3} ({:.3})", r[0], r[1]);
            let other = theirs.as_ref().map(|t| t[index][usize::from(!any)]);
            println!(
                "{:<8} {:<8} {:>17} {:>17} {:>7} {:>7.1} {:>11}  {:>17} {}",
                set.name,
                if any { "any" } else { "closest" },
                text(rates(&ours)),
                other.map_or_else(|| "-".into(), |o| text(rates(&o))),
                other.map_or_else(|| "-".into(), |o| format!("{:.3}", rates(&ours)[0] / rates(&o)[0])),
                100.0 * ours.hits as f64 / set.rays.len() as f64,
                other.map_or_else(String::new, |o| format!("{:+}", ours.hits as i64 - o.hits as i64)),
                queried.as_ref().map_or_else(|| "-".into(), |q| text(rates(q))),
                queried.map_or_else(String::new, |q| format!("{:+}", ours.hits as i64 - q.hits as i64)),
            );
        }
    }
    Ok(())
}

/// Seconds that all threads of this process, those that are alive, have had a processor.
fn busy() -> f64 {
    let threads = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let of = |path: std::path::PathBuf| std::fs::read_to_string(path.join("schedstat")).ok();
    let nanoseconds = |text: String| text.split_whitespace().next().and_then(|w| w.parse::<f64>().ok());
    threads.filter_map(|thread| of(thread.path()).and_then(nanoseconds)).sum::<f64>() * 1e-9
}

struct Device<'a> {
    scene: &'a Scene,
    resident: Resident,
    rays: Rays,
    runner: Runner,
}

impl Device<'_> {
    /// Processor time of a ray that is only moved to the device and back; the first run also builds what there is to build.
    fn idle(&mut self, rays: &[types::Ray]) -> Result<f64> {
        let runs = (0..5).map(|_| self.trace(rays, true, false)).collect::<Result<Vec<_>>>()?;
        Ok(runs.iter().map(|t| t.busy / rays.len() as f64).fold(f64::INFINITY, f64::min))
    }

    /// The best of the rounds, and one before them; without what moving the rays to the device and back takes.
    fn best(&mut self, rays: &[types::Ray], any: bool, idle: f64, rounds: usize) -> Result<embree::Taken> {
        let mut best = embree::Taken { seconds: f64::INFINITY, busy: f64::INFINITY, hits: 0 };
        for _ in 0..=rounds {
            let taken = self.trace(rays, any, true)?;
            best.seconds = best.seconds.min(taken.seconds);
            best.busy = best.busy.min(taken.busy - idle * rays.len() as f64);
            best.hits = taken.hits;
        }
        Ok(best)
    }

    /// One pass; with `trace` off, everything but that.
    fn trace(&mut self, rays: &[types::Ray], any: bool, trace: bool) -> Result<embree::Taken> {
        let mut graph = Graph::new("rays");
        let handles = self.resident.frame(&mut graph, self.scene, 0.0);
        let traced = self.rays.frame(&mut graph, &handles);
        let count = rays.len() as u32;
        let hits = graph.buffer("hits", u64::from(count) * size_of::<types::Hit>() as u64);
        let args = shader::Args {
            rays: graph.buffer_from("rays", rays),
            hits,
            trace_nodes: traced.trace_nodes,
            trace_triangles: traced.trace_triangles,
            trace_instances: traced.trace_instances,
            trace_indices: traced.trace_indices,
            trace_uvs: traced.trace_uvs,
            trace_colors: traced.trace_colors,
            trace_scene: traced.trace_scene,
            trace_accel: traced.trace_accel,
            materials: traced.materials,
            scene_textures: traced.scene_textures,
            push: shader::Push { count: if trace { count } else { 0 }, mask: 0, salt: 0 },
            spec: shader::Spec { any: u32::from(any) },
        };
        graph.compute(args, count);
        let token = graph.read_buffer(hits);
        let before = busy();
        let frame = self.runner.run(graph)?;
        let busy = busy() - before;
        let pass = frame.report.passes.iter().find(|p| p.name.starts_with("test.trace"));
        let seconds = pass.and_then(|p| p.gpu_ms).map_or(f64::INFINITY, |ms| ms / 1000.0);
        let hits = frame.buffer::<types::Hit>(token).iter().filter(|h| h.instance != u32::MAX).count();
        Ok(embree::Taken { seconds, busy, hits })
    }
}

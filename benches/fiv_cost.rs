//! Cost of shadows from precomputed vectors in a frame, in four tables. `objects`: against the number of occluders,
//! with and without the overlap correction. `culling`: with negligible occluders left out, on a wide ground.
//! `vertices`: with finer and finer triangles of the same objects, so that the same pixels are covered. `turning`: cost
//! on the host for an environment that rotates or brightens from frame to frame, by its size.
//!
//! `cargo bench --bench fiv_cost [-- WIDTHxHEIGHT [ROUNDS [TABLE]]]`; 128x128 and 5 by default; TABLE: one of the
//! tables alone. `LUCERNA_DEVICE` chooses the device. Times are medians of ROUNDS rounds, ms. In each round all rows
//! run once.

mod common;

use std::{collections::HashMap, time::Instant};

use common::{Places, median};
use lucerna::{
    Result,
    gpu::{Gpu, GpuOptions},
    graph::{Graph, Report, Runner},
    resident::Resident,
    scene::{
        Environment, Pose, Primitive, Scene, View,
        ground::{self, Ground},
    },
    techniques::fiv::{Fiv, Light, Method, Occluders, PictureSettings, Plan, SelfSamples, Settings, Sky, Stored},
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
    fiv: Fiv,
    view: View,
}

impl Studio {
    fn new(gpu: &Gpu, scene: Scene, stored: &Stored, camera: &str, extent: [u32; 2]) -> Result<Self> {
        let resident = Resident::new(gpu, &scene)?;
        let fiv = Fiv::new(gpu, &scene, &resident, &settings(), Some(stored), |_, _| true)?;
        let number = scene.cameras.iter().position(|c| c.name == camera).unwrap_or(0);
        let view = View::of_camera(&scene, &Pose::rest(&scene), number, extent)?;
        Ok(Self { scene, resident, runner: Runner::new(gpu), fiv, view })
    }

    fn once(&mut self, settings: &Settings) -> Result<(Vec<[f32; 4]>, Report)> {
        let mut graph = Graph::new("fiv");
        let pose = Pose::rest(&self.scene);
        let handles = self.resident.frame_in(&mut graph, &self.scene, &pose);
        let view = self.view.fit_far(&handles.bounds());
        let all = PictureSettings { fiv: settings.clone(), ..PictureSettings::default() };
        let out = self.fiv.picture(&mut graph, &self.scene, &pose, &handles, &view, &all)?.outputs;
        let image = graph.read_image(out.irradiance);
        let frame = self.runner.run(&graph)?;
        Ok((frame.image(image).to_f32(), frame.report))
    }
}

/// The cost does not depend on the number of samples, as long as they fit into the same caches.
fn settings() -> Settings {
    Settings {
        size: 16,
        azimuths: 32,
        polars: 17,
        radii: 15,
        adaptive: false,
        self_samples: SelfSamples::Spheres,
        ..Settings::default()
    }
}

/// Passes that a column sums up.
const COLUMNS: [(&str, &[&str]); 5] = [
    ("G-buffer", &["passes.gbuffer"]),
    ("whose", &["fiv.identity"]),
    ("lists", &["fiv.near", "fiv.pairs"]),
    ("light", &["fiv.light"]),
    ("both", &["fiv.near", "fiv.pairs", "fiv.light"]),
];

fn times(report: &Report) -> [f64; 5] {
    COLUMNS.map(|(_, names)| {
        let of = report.passes.iter().filter(|pass| names.iter().any(|name| pass.name.starts_with(name)));
        of.filter_map(|pass| pass.gpu_ms).sum()
    })
}

/// Times of the columns, and the irradiance.
type Measured = ([f64; 5], Vec<[f32; 4]>);

/// Medians of all rows, which alternate, and their pictures.
fn measure(rows: &mut [(&mut Studio, Settings)], rounds: usize) -> Result<Vec<Measured>> {
    let mut all = vec![<[Vec<f64>; 5]>::default(); rows.len()];
    let mut pictures = vec![Vec::new(); rows.len()];
    // The first round creates pipelines and memory.
    for round in 0..=rounds {
        for (i, (studio, settings)) in rows.iter_mut().enumerate() {
            let (picture, report) = studio.once(settings)?;
            if round > 0 {
                all[i].iter_mut().zip(times(&report)).for_each(|(list, time)| list.push(time));
            }
            pictures[i] = picture;
        }
    }
    Ok(all.into_iter().map(|lists| lists.map(median)).zip(pictures).collect())
}

/// Things in their light on a plain ground.
fn placed(thing: &Scene, environment: &str, copies: u32, gap: f32) -> Result<Scene> {
    let ground = Ground { copies, gap, height: Some(1.0), ..Ground::default() };
    let mut scene = ground::on_ground(std::slice::from_ref(thing), &ground)?;
    scene.environment = Some(builtin::environment(environment)?);
    Ok(scene)
}

/// The vectors of the only kind of occluder of a scene.
fn vectors(gpu: &Gpu, scene: &Scene) -> Result<Stored> {
    let settings = settings();
    let sky = Sky::of(scene.environment.as_ref(), &settings)?;
    let kinds = Occluders::of(scene, &Pose::rest(scene), settings.flat, settings.largest).kinds;
    let plan = Plan::new("bench", sky.hash(), &kinds, &settings);
    let mut stored = Stored::empty(plan.clone(), 0);
    plan.compute(gpu, &Light::new(gpu, &sky)?, &kinds, 0..plan.samples(), |_, new| {
        stored.push(new);
        Ok(true)
    })?;
    Ok(stored)
}

/// Each triangle as four in its plane, `times` times.
fn finer(scene: &Scene, times: u32) -> Scene {
    let mut scene = scene.clone();
    for primitive in scene.meshes.iter_mut().flat_map(|mesh| &mut mesh.primitives) {
        (0..times).for_each(|_| split(primitive));
    }
    scene
}

fn split(p: &mut Primitive) {
    let mut middles = HashMap::new();
    let mut indices = Vec::with_capacity(4 * p.indices.len());
    for corner in std::mem::take(&mut p.indices).chunks_exact(3) {
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                let (i, j) = (a as usize, b as usize);
                p.positions.push(0.5 * (p.positions[i] + p.positions[j]));
                p.normals.push((p.normals[i] + p.normals[j]).normalize_or(p.normals[i]));
                p.tangents.push(p.tangents[i]);
                p.positions.len() as u32 - 1
            })
        };
        let (a, b, c) = (corner[0], corner[1], corner[2]);
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        indices.extend([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca]);
    }
    p.indices = indices;
    p.uvs.clear();
    p.colors.clear();
}

/// Largest difference, and root mean square, against the mean of the first.
fn apart(a: &[[f32; 4]], b: &[[f32; 4]]) -> (f64, f64) {
    let mean = a.iter().map(|p| f64::from(p[0] + p[1] + p[2])).sum::<f64>() / (3 * a.len()) as f64;
    let off = |(a, b): (&[f32; 4], &[f32; 4])| (0..3).map(|c| f64::from(a[c] - b[c]).abs()).fold(0.0, f64::max) / mean;
    let all: Vec<f64> = a.iter().zip(b).map(off).collect();
    let square = all.iter().map(|d| d * d).sum::<f64>() / all.len() as f64;
    (all.iter().copied().fold(0.0, f64::max), square.sqrt())
}

fn run() -> Result<()> {
    let mut words = Places::new("WIDTHxHEIGHT [ROUNDS [TABLE]]");
    let extent = words.size([128, 128])?;
    let rounds = words.number("ROUNDS", common::ROUNDS, 5)? as usize;
    let tables = words.tables(&["objects", "culling", "vertices", "turning"])?;
    let gpu = Gpu::new(GpuOptions::from_env()?)?;
    println!("{} at {}x{}, medians of {rounds}, ms", gpu.describe(), extent[0], extent[1]);
    for table in tables {
        match table {
            "objects" => objects(&gpu, extent, rounds)?,
            "culling" => culling(&gpu, extent, rounds)?,
            "vertices" => vertices(&gpu, extent, rounds)?,
            _ => turning(&gpu, extent, rounds)?,
        }
    }
    Ok(())
}

fn objects(gpu: &Gpu, extent: [u32; 2], rounds: usize) -> Result<()> {
    const COUNTS: [u32; 6] = [1, 10, 20, 40, 60, 100];
    let thing = builtin::load("hare")?;
    let stored = vectors(gpu, &placed(&thing, "grove", 1, 0.4)?)?;
    for camera in ["front", "ground"] {
        println!("\nhares, camera {camera}; lists and light with the correction for overlap, light without it");
        println!(
            "{:>8} {:>8} {:>8} {:>8} {:>10} {:>8} {:>10}",
            "objects", "lists", "light", "both", "an object", "without", "with/out"
        );
        let build = |count| Studio::new(gpu, placed(&thing, "grove", count, 0.4)?, &stored, camera, extent);
        let mut studios = COUNTS.map(build).into_iter().collect::<Result<Vec<_>>>()?;
        let [with, without] = [true, false].map(|overlap| {
            let settings = Settings { overlap, ..settings() };
            let mut rows: Vec<_> = studios.iter_mut().map(|studio| (studio, settings.clone())).collect();
            measure(&mut rows, rounds)
        });
        for (count, ((with, _), (without, _))) in COUNTS.iter().zip(with?.iter().zip(&without?)) {
            let each = with[4] / f64::from(*count);
            println!(
                "{count:>8} {:>8.2} {:>8.1} {:>8.1} {each:>10.2} {:>8.1} {:>10.2}",
                with[2],
                with[3],
                with[4],
                without[4],
                with[4] / without[4]
            );
        }
    }
    Ok(())
}

fn culling(gpu: &Gpu, extent: [u32; 2], rounds: usize) -> Result<()> {
    const SHARES: [f32; 5] = [0.0, 0.001, 0.002, 0.005, 0.01];
    let thing = builtin::load("hare")?;
    println!("\nhares six widths apart, camera ground; differences against the mean irradiance");
    println!(
        "{:>6} {:>8} {:>10} {:>8} {:>8} {:>8} {:>8} {:>9} {:>9}",
        "light", "objects", "negligible", "lists", "light", "both", "saved", "largest", "RMS"
    );
    for environment in ["grove", "areas"] {
        let stored = vectors(gpu, &placed(&thing, environment, 1, 5.0)?)?;
        for count in [60, 100] {
            let mut studio = Studio::new(gpu, placed(&thing, environment, count, 5.0)?, &stored, "ground", extent)?;
            let mut results = Vec::new();
            for negligible in SHARES {
                let settings = Settings { negligible, ..settings() };
                results.extend(measure(&mut [(&mut studio, settings)], rounds)?);
            }
            for (share, (time, picture)) in SHARES.iter().zip(&results) {
                let (largest, rms) = apart(&results[0].1, picture);
                let saved = 100.0 * (1.0 - time[4] / results[0].0[4]);
                println!(
                    "{environment:>6} {count:>8} {share:>10} {:>8.2} {:>8.1} {:>8.1} {saved:>7.0}% {largest:>9.5} {rms:>9.6}",
                    time[2], time[3], time[4]
                );
            }
        }
    }
    Ok(())
}

fn vertices(gpu: &Gpu, extent: [u32; 2], rounds: usize) -> Result<()> {
    println!("\nten queens, camera front, of which each triangle is cut into 1, 4, 16 and 64");
    println!(
        "{:>9} {:>9} {:>9} {:>8} {:>8} {:>8} {:>8} {:>11}",
        "vertices", "G-buffer", "whose", "lists", "light", "both", "to first", "apart, RMS"
    );
    let queen = builtin::load("queen")?;
    let mut studios = Vec::new();
    let mut counts = Vec::new();
    for times in 0..4 {
        let thing = finer(&queen, times);
        let stored = vectors(gpu, &placed(&thing, "grove", 1, 0.4)?)?;
        counts.push(thing.meshes.iter().flat_map(|m| &m.primitives).map(|p| p.positions.len()).sum::<usize>());
        studios.push(Studio::new(gpu, placed(&thing, "grove", 10, 0.4)?, &stored, "front", extent)?);
    }
    let mut rows: Vec<_> = studios.iter_mut().map(|studio| (studio, settings())).collect();
    let results = measure(&mut rows, rounds)?;
    for (count, (time, picture)) in counts.iter().zip(&results) {
        println!(
            "{count:>9} {:>9.2} {:>9.2} {:>8.2} {:>8.2} {:>8.2} {:>8.3} {:>11.6}",
            time[0],
            time[1],
            time[2],
            time[3],
            time[4],
            time[4] / results[0].0[4],
            apart(&results[0].1, picture).1
        );
    }
    Ok(())
}

/// Each pixel as `times` × `times`.
fn larger(env: &Environment, times: u32) -> Environment {
    let (width, height) = (env.width * times, env.height * times);
    let of = |i: u32| env.pixels[(i / width / times * env.width + i % width / times) as usize];
    Environment { width, height, pixels: (0..width * height).map(of).collect(), ..env.clone() }
}

/// Declaring a frame on the host, with the passes that an environment needs before it.
fn turning(gpu: &Gpu, extent: [u32; 2], rounds: usize) -> Result<()> {
    println!(
        "\none hare, camera front, vectors of each frame, 32 texels to a side; ms on the host before a frame is run"
    );
    println!("the last column is to sum up all pixels of the environment anew, which turning does not need");
    println!(
        "{:>11} {:>9} {:>9} {:>9} {:>10} {:>10}",
        "environment", "at rest", "turning", "brighter", "negligible", "all pixels"
    );
    let thing = builtin::load("hare")?;
    let base = Settings { method: Method::Online, size: 32, ..settings() };
    for times in [1, 2, 4] {
        let mut scene = placed(&thing, "grove", 1, 0.4)?;
        scene.environment = scene.environment.as_ref().map(|env| larger(env, times));
        let size = scene.environment.as_ref().map_or(String::new(), |e| format!("{}x{}", e.width, e.height));
        let mut resident = Resident::new(gpu, &scene)?;
        let mut fiv = Fiv::new(gpu, &scene, &resident, &base, None, |_, _| true)?;
        let pose = Pose::rest(&scene);
        let view = View::of_camera(&scene, &pose, 0, extent)?;
        let mut frame = |settings: Settings| {
            let mut graph = Graph::new("fiv");
            let handles = resident.frame_in(&mut graph, &scene, &pose);
            let view = view.fit_far(&handles.bounds());
            let all = PictureSettings { fiv: settings, ..PictureSettings::default() };
            let begun = Instant::now();
            fiv.picture(&mut graph, &scene, &pose, &handles, &view, &all)?;
            Ok::<f64, lucerna::Error>(1e3 * begun.elapsed().as_secs_f64())
        };
        let ways: [fn(&Settings, f32) -> Settings; 4] = [
            |base, _| base.clone(),
            |base, step| Settings { rotation: step, turning: 30.0, ..base.clone() },
            |base, step| Settings { exposure: 0.1 * step, ..base.clone() },
            |base, step| Settings { rotation: step, turning: 30.0, negligible: 0.005, ..base.clone() },
        ];
        let mut row = format!("{size:>11}");
        for (way, width) in ways.into_iter().zip([9, 9, 9, 10]) {
            // The first frame creates pipelines, memory and the data that all rotations share.
            let times = (0..=rounds).map(|i| frame(way(&base, 1.0 + i as f32))).collect::<Result<Vec<f64>>>()?;
            row += &format!(" {:>width$.2}", median(times[1..].to_vec()));
        }
        let begun = Instant::now();
        Sky::of(scene.environment.as_ref(), &Settings { rotation: 1.0, ..base.clone() })?;
        row += &format!(" {:>10.1}", 1e3 * begun.elapsed().as_secs_f64());
        println!("{row}");
    }
    Ok(())
}

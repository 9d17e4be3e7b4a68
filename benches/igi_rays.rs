//! Rays a second of instant global illumination by stage, and of its gathering against the ray benchmark's own pass for the very same
//! rays: any hit from every visible point to every virtual light.
//!
//! `cargo bench --bench igi_rays [-- [--size WxH] [--vpls N] [--rounds N] [--json] [SCENE…]]`; at most 1024x1024 and 1000 virtual lights;
//! rays of gathering are counted, those of shooting and of direct light are the most that there can be; scenes are built-in names or files,
//! `LUCERNA_DEVICE` chooses the device.

mod common;

use lucerna::{
    Error, Result,
    gpu::{Gpu, GpuOptions},
    graph::{Graph, ImageRead, Report, Runner},
    rays::Rays,
    resident::Resident,
    scene::{self, LoadOptions, Pose, Scene, View},
    shaders::{
        test::{trace, vpl_rays},
        types,
    },
    techniques::igi::{Igi, PictureSettings, Settings, Visibility},
};
use lucerna_scenes as builtin;
use std::collections::BTreeMap;

fn main() -> std::process::ExitCode {
    common::end(run())
}

/// What to measure.
struct Options {
    size: [u32; 2],
    vpls: u32,
    rounds: u32,
    json: bool,
    scenes: Vec<String>,
}

fn options() -> Result<Options> {
    let mut out = Options { size: [128, 96], vpls: 60, rounds: 5, json: false, scenes: Vec::new() };
    let mut arguments = common::words();
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().unwrap_or_default();
        match argument.as_str() {
            "--size" => out.size = common::size("--size", &value(), 8..=1024)?,
            "--vpls" => out.vpls = common::number("--vpls", &value(), 1..=1000)?,
            "--rounds" => out.rounds = common::number("--rounds", &value(), 1..=1000)?,
            "--json" => out.json = true,
            flag if flag.starts_with("--") => {
                return common::wrong("option", flag, "--size, --vpls, --rounds, --json");
            }
            _ => out.scenes.push(argument),
        }
    }
    if out.scenes.is_empty() {
        out.scenes = ["office", "conference"].map(String::from).to_vec();
    }
    Ok(out)
}

fn run() -> Result<()> {
    let options = options()?;
    let gpu = Gpu::new(GpuOptions::from_env()?)?;
    if !options.json {
        println!("{}, best of {} rounds", gpu.describe(), options.rounds);
    }
    for name in &options.scenes {
        let scene = if builtin::NAMES.contains(&name.as_str()) {
            builtin::load(name)?
        } else {
            scene::load(std::path::Path::new(name), &LoadOptions::default())?
        };
        measure(&gpu, name, &scene, &options)?;
    }
    Ok(())
}

/// Milliseconds of the passes of each stage.
fn stages(report: &Report) -> BTreeMap<&'static str, f64> {
    let mut out = BTreeMap::new();
    for pass in &report.passes {
        let name = pass.name.split('#').next().unwrap_or_default();
        let stage = match name {
            "igi.shoot" => "shooting",
            "igi.importance" => "importance",
            "igi.gather" => "gathering",
            "igi.direct" => "direct",
            "igi.ray_tree_grow" => "mirrors",
            _ => continue,
        };
        *out.entry(stage).or_default() += pass.gpu_ms.unwrap_or(pass.cpu_ms);
    }
    out
}

fn measure(gpu: &Gpu, name: &str, scene: &Scene, options: &Options) -> Result<()> {
    let pose = Pose::rest(scene);
    let view = View::of_camera(scene, &pose, 0, options.size)?;
    let settings = Settings {
        vpls: options.vpls,
        bounces: 1,
        direct_samples: 4,
        visibility: Visibility::Compute,
        ..Settings::default()
    };
    let all = PictureSettings { igi: settings.clone(), ..PictureSettings::default() };
    let mut resident = Resident::new(gpu, scene)?;
    let mut igi = Igi::new(gpu, scene, &resident, &settings)?;
    let mut runner = Runner::new(gpu);

    // The rays, and how many there are.
    let mut graph = Graph::new("igi");
    let handles = resident.frame_in(&mut graph, scene, &pose);
    let fitted = view.fit_far(&handles.bounds());
    let picture = igi.picture(&mut graph, scene, &pose, &handles, &fitted, &all)?;
    let Some(vpls) = picture.outputs.vpls else { return Err(Error::usage("there are no virtual lights")) };
    let blocks = u64::from(options.size[0].div_ceil(8)) * u64::from(options.size[1].div_ceil(8));
    let places = blocks * 64 * u64::from(vpls.count);
    let list = graph.buffer("rays", places * size_of::<types::ListedRay>() as u64);
    let g = picture.gbuffer;
    let bounds = handles.bounds();
    let least = settings.bound * (bounds.max - bounds.min).length();
    let push = vpl_rays::Push { total: vpls.count, least };
    let args = vpl_rays::Args { view: g.view, normal: g.normal, depth: g.depth, vpls: vpls.buffer, rays: list, push };
    graph.compute(args, options.size);
    let list = graph.read_buffer(list);
    let counted: ImageRead = graph.read_image(picture.outputs.gathered);
    let frame = runner.run(&graph)?;
    let gathered: f64 = frame.image(counted).to_f32().iter().map(|p| f64::from(p[3])).sum();
    let rays: Vec<types::ListedRay> = frame.buffer(list);
    let rays: Vec<types::ListedRay> = rays.into_iter().filter(|r| r.t_max > 0.0).collect();
    let count = rays.len() as f64;
    if (count - gathered).abs() > 1e-4 * count + 1.0 {
        let what = format!("{name}: gathering traced {gathered} rays, the list has {count}");
        return Err(Error::new(lucerna::ErrorKind::Runtime, what));
    }

    let mut best: BTreeMap<&'static str, f64> = BTreeMap::new();
    let mut keep = |stage: &'static str, ms: f64| {
        let entry = best.entry(stage).or_insert(f64::INFINITY);
        *entry = entry.min(ms);
    };
    let mut traced = Rays::in_compute(gpu, scene, &resident)?;
    // In turns, so that what else the machine does falls on both.
    for _ in 0..=options.rounds {
        let mut graph = Graph::new("igi");
        let handles = resident.frame_in(&mut graph, scene, &pose);
        igi.picture(&mut graph, scene, &pose, &handles, &fitted, &all)?;
        for (stage, ms) in stages(&runner.run(&graph)?.report) {
            keep(stage, ms);
        }
        keep("benchmark", benchmark(&mut runner, &mut resident, &mut traced, scene, &pose, &rays)?);
    }
    let rate = |stage: &str| best.get(stage).map(|ms| count / ms * 1e-3).unwrap_or(f64::NAN);
    let ratio = rate("gathering") / rate("benchmark");
    let pixels = f64::from(options.size[0]) * f64::from(options.size[1]);
    // Of pixels that show geometry at most; shadow rays from behind, or of light that does not arrive, are not traced.
    let direct = pixels * f64::from(direct_rays(scene, &pose, &settings));
    let ms = |stage: &str| best.get(stage).copied().unwrap_or(0.0);
    if options.json {
        let stages: Vec<String> = best.iter().map(|(stage, ms)| format!("\"{stage}_ms\":{ms:.4}")).collect();
        println!(
            "{{\"scene\":\"{name}\",\"rays\":{count},\"gathering_mrays\":{:.4},\"benchmark_mrays\":{:.4},\"ratio\":{ratio:.4},{}}}",
            rate("gathering"),
            rate("benchmark"),
            stages.join(",")
        );
        return Ok(());
    }
    println!("\n{name}, {}x{}, {} virtual lights, {count:.0} rays", options.size[0], options.size[1], vpls.count);
    println!("  gathering          {:8.2} ms {:8.2} Mrays/s", ms("gathering"), rate("gathering"));
    println!("  the same, benchmark{:8.2} ms {:8.2} Mrays/s", ms("benchmark"), rate("benchmark"));
    println!("  ratio {ratio:.3}");
    // Diffuse and specular segments; paths that leave the scene have fewer.
    let segments = settings.bounces + settings.specular_depth;
    let paths = f64::from(settings.paths() * settings.candidates * segments);
    println!("  shooting           {:8.2} ms {:8.2} Mrays/s (at most)", ms("shooting"), paths / ms("shooting") * 1e-3);
    if ms("importance") > 0.0 {
        let rays = f64::from(settings.paths() * settings.candidates * settings.bounces) * f64::from(settings.judges);
        let rate = rays / ms("importance") * 1e-3;
        println!("  choosing           {:8.2} ms {rate:8.2} Mrays/s (at most)", ms("importance"));
    }
    println!("  direct             {:8.2} ms {:8.2} Mrays/s (at most)", ms("direct"), direct / ms("direct") * 1e-3);
    if ms("mirrors") > 0.0 {
        println!("  mirrors and glass  {:8.2} ms", ms("mirrors"));
    }
    Ok(())
}

/// Shadow rays of a point at most: one to each light, and samples of emissive surfaces and of the sky.
fn direct_rays(scene: &Scene, pose: &Pose, settings: &Settings) -> u32 {
    let samples = settings.direct_samples;
    let emits = |primitive: &scene::Primitive| {
        scene.materials.get(primitive.material as usize).is_some_and(|m| m.emissive != glam::Vec3::ZERO)
    };
    let mut meshes = scene.nodes.iter().filter_map(|node| scene.meshes.get(node.mesh? as usize));
    let surfaces = meshes.any(|mesh| mesh.primitives.iter().any(emits));
    let sky = scene.environment.as_ref().is_some_and(|sky| !sky.pixels.is_empty());
    let soft = (u32::from(surfaces) + u32::from(sky)) * samples + u32::from(sky) * settings.glossy_rays();
    lucerna::resident::lights(scene, pose).len() as u32 + soft
}

/// Milliseconds of the ray benchmark's pass for a list of rays.
fn benchmark(
    runner: &mut Runner,
    resident: &mut Resident,
    traced: &mut Rays,
    scene: &Scene,
    pose: &Pose,
    rays: &[types::ListedRay],
) -> Result<f64> {
    let mut graph = Graph::new("rays");
    let handles = resident.frame_in(&mut graph, scene, pose);
    let traced = traced.frame(&mut graph, &handles);
    let count = rays.len() as u32;
    let args = trace::Args {
        rays: graph.buffer_from("rays", rays),
        hits: graph.buffer("hits", u64::from(count) * size_of::<types::Hit>() as u64),
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
        // As shadow rays: unlit surfaces do not stop them.
        push: trace::Push { count, mask: 2, salt: 0 },
        spec: trace::Spec { any: 1, count: 0 },
    };
    graph.compute(args, count);
    let report = runner.run(&graph)?.report;
    let pass = report.passes.iter().find(|p| p.name.starts_with("test.trace"));
    Ok(pass.map_or(f64::INFINITY, |p| p.gpu_ms.unwrap_or(p.cpu_ms)))
}

//! Shadows from fullsphere irradiance vectors, and their brute force.

use std::{
    path::{Path, PathBuf},
    time::Instant,
};

use glam::{Vec2, Vec3};
use lucerna::{
    Error, Result,
    gpu::Gpu,
    graph::Runner,
    image::{Layer, Layers, Precision},
    scene::{
        Limits, Pose, Scene, View,
        bvh::{Bvh, Ray, TriangleId},
    },
    technique::{Ready, Shot, Technique},
    techniques::fiv::{Baked, Fiv, Light, Method, Occluder, Occluders, PictureSettings, Plan, Settings, Sky, Stored},
};
use serde::{Deserialize, Serialize};
use serde_json::json;

use super::{Job, Rendered, Warm, on_device, read};
use crate::{
    config,
    experiment::{cache, digest::Digest, sealed},
};

/// Height below which an occluder hides the ground under it, in radii of the largest occluder.
const COVERS: f32 = 0.1;

/// The technique's data for a scene and one set of vectors.
struct Kept {
    ready: Ready<Fiv>,
    runner: Runner,
    made: PictureSettings,
    facts: Vec<(String, f64)>,
}

/// The contents of the text file next to the vectors of an occluder.
#[derive(Serialize, Deserialize)]
struct Cost {
    /// Digest of the vectors' file.
    vectors: String,
    /// Time of computing the vectors.
    seconds: f64,
}

pub(super) fn picture(warm: &mut Warm<'_>, job: &Job<'_>) -> Result<Option<Rendered>> {
    let settings: PictureSettings = read(job.settings)?;
    let (scene, pose, folder) = (warm.scene, warm.pose, warm.folder.clone());
    let making = Fiv::prepared_by(&settings);
    if warm.keep("fiv", |_, _, _| Ok(None::<Kept>))?.as_ref().is_none_or(|kept| kept.made != making) {
        warm.forget("fiv");
        let made = make(warm.gpu, scene, &making, folder, &|| job.interrupt.requested());
        let made = match made {
            Err(_) if job.interrupt.requested() => return Ok(None),
            made => made?,
        };
        warm.keep("fiv", |_, _, _| Ok(Some(made)))?;
    }
    let Some(Kept { ready, runner, facts, .. }) = warm.keep("fiv", |_, _, _| Ok(None::<Kept>))? else {
        return Ok(None);
    };
    let rendered = on_device(runner, job, "fiv", |graph| {
        let picture = ready.frame(graph, (scene, pose), job.view, Shot::default(), &settings)?;
        Ok(picture.only(&["irradiance"]))
    })?;
    let facts = facts.clone();
    let radius = ready.technique().occluders().kinds.iter().map(|kind| kind.radius).fold(0f32, f32::max);
    let covered = match &rendered {
        Some(_) if making.fiv.method == Method::BruteForce && job.view.is_orthographic() => {
            let bvh = warm.keep("fiv bvh", |_, scene, pose| Ok(Bvh::build(scene, pose)))?;
            Some(covered(scene, bvh, job.view, COVERS * radius))
        }
        _ => None,
    };
    Ok(rendered.map(|mut rendered| {
        rendered.layers = match covered {
            Some(data) => Layers { ..rendered.layers }.with(Layer::new("covered", &["Y"], data)),
            None => rendered.layers,
        };
        // The analysis measures errors of a hundredth, so all layers are stored in 32 bits.
        rendered.layers.layers.iter_mut().for_each(|layer| layer.precision = Precision::Full);
        rendered.times.facts = facts;
        rendered
    }))
}

/// For every pixel of an orthographic view: 1 if a surface is less than `height` metres above it, or if it is inside of an object.
fn covered(scene: &Scene, bvh: &Bvh, view: &View, height: f32) -> Vec<f32> {
    let [width, rows] = view.extent;
    let along = view.axes()[2];
    let pixel = |x: u32, y: u32| {
        let uv = (Vec2::new(x as f32, y as f32) + 0.5) / Vec2::new(width as f32, rows as f32);
        let origin: Vec3 = view.world_from_depth(uv, 0.0);
        let seen = Ray { t_min: view.near, ..Ray::new(origin, along) };
        let Some(hit) = bvh.closest(&seen) else { return 0.0 };
        let up = Ray { t_min: 1e-5 * height, ..Ray::new(origin + along * hit.t, -along) };
        let Some(over) = bvh.closest(&up) else { return 0.0 };
        let [a, b, c] = bvh.triangles()[over.triangle as usize];
        let from_inside = (b - a).cross(c - a).dot(along) < 0.0 && !is_thin(scene, bvh.id(over.triangle));
        f32::from(over.t < height || from_inside)
    };
    (0..rows).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| pixel(x, y)).collect()
}

/// Whether a triangle is double-sided, and so has no inside (a leaf).
fn is_thin(scene: &Scene, triangle: TriangleId) -> bool {
    let mesh = scene.nodes[triangle.node as usize].mesh.map(|mesh| &scene.meshes[mesh as usize]);
    let primitive = mesh.and_then(|mesh| mesh.primitives.get(triangle.primitive as usize));
    primitive.is_some_and(|primitive| scene.materials[primitive.material as usize].double_sided)
}

fn make(
    gpu: &Gpu,
    scene: &Scene,
    settings: &PictureSettings,
    folder: PathBuf,
    stop: &dyn Fn() -> bool,
) -> Result<Kept> {
    let (stored, seconds) = match settings.fiv.method {
        Method::Vectors => vectors(gpu, scene, &settings.fiv, folder, stop)?,
        _ => (None, 0.0),
    };
    let baked = stored.map(|stored| Baked { stored, file: None });
    let ready = Ready::<Fiv>::new(gpu, scene, settings, baked.as_ref(), &mut |_, _| !stop())?;
    let fiv = ready.technique();
    let occluders = fiv.occluders();
    let facts = vec![
        ("seconds before".to_owned(), seconds),
        ("bytes".to_owned(), if baked.is_some() { fiv.bytes() as f64 } else { 0.0 }),
        ("things".to_owned(), occluders.placed.len() as f64),
        ("kinds".to_owned(), occluders.kinds.len() as f64),
        ("vertices".to_owned(), occluders.placed.iter().map(|p| vertices(scene, p.node)).sum::<usize>() as f64),
        ("lights".to_owned(), (fiv.light().lit.len() + fiv.light().suns.len()) as f64),
    ];
    Ok(Kept { ready, runner: Runner::new(gpu), made: settings.clone(), facts })
}

fn vertices(scene: &Scene, node: u32) -> usize {
    let mesh = scene.nodes[node as usize].mesh.and_then(|mesh| scene.meshes.get(mesh as usize));
    mesh.map_or(0, |mesh| mesh.primitives.iter().map(|p| p.positions.len()).sum())
}

/// The vectors of all kinds of occluders, and the time of computing them, seconds. Each kind has a file in the folder of the report, so that
/// scenes share the vectors and a stopped experiment keeps them.
fn vectors(
    gpu: &Gpu,
    scene: &Scene,
    settings: &Settings,
    folder: PathBuf,
    stop: &dyn Fn() -> bool,
) -> Result<(Option<Stored>, f64)> {
    let Some(environment) = &scene.environment else { return Ok((None, 0.0)) };
    let sky = Sky::of(Some(environment), settings)?;
    let occluders = Occluders::of(scene, &Pose::rest(scene), settings.flat, settings.largest);
    let plan = Plan::new(&environment.name, sky.hash(), &occluders.kinds, settings);
    let mut whole = Stored::empty(plan.clone(), 0);
    let (mut light, mut seconds) = (None, 0.0);
    for (index, kind) in occluders.kinds.iter().enumerate() {
        let alone = Plan { occluders: vec![plan.occluders[index].clone()], ..plan.clone() };
        let name = name(gpu, &alone, settings)?;
        let (file, cost) = (folder.join(format!("{name}.fiv")), folder.join(format!("{name}.json")));
        let known = known(&file, &cost, &alone).unwrap_or_else(|error| {
            cache::does_not_count(&error);
            None
        });
        let (part, spent) = match known {
            Some(known) => known,
            None => {
                let light = match &mut light {
                    Some(light) => light,
                    none => none.insert(Light::new(gpu, &sky)?),
                };
                let computed = compute(gpu, light, (&alone, settings), kind, stop)?;
                std::fs::create_dir_all(&folder).map_err(|e| {
                    Error::new(lucerna::ErrorKind::Output, "cannot be made").in_file(&folder).caused_by(e)
                })?;
                sealed::refuse_link(&file)?;
                computed.0.write(&file, true)?;
                let vectors = Digest::of(&whole_file(&file)?).hex();
                sealed::write(&cost, &Cost { vectors, seconds: computed.1 })?;
                computed
            }
        };
        whole.plan.occluders[index] = part.plan.occluders[0].clone();
        whole.push(&part.fivs);
        seconds += spent;
    }
    Ok((Some(whole), seconds))
}

/// Name of the file: a digest of all data that decide the vectors.
fn name(gpu: &Gpu, plan: &Plan, settings: &Settings) -> Result<String> {
    // These settings choose the positions of the samples. All other data that decide the vectors are in the plan.
    let spacing = (settings.adaptive, settings.interpolation);
    let text = json!([cache::SOURCES, cache::device(gpu), config::to_value(plan)?, config::to_value(&spacing)?]);
    Ok(Digest::of(text.to_string().as_bytes()).hex())
}

/// The stored vectors; `None` if they do not exist.
///
/// # Errors
/// `Input`, naming the file, if they are damaged or were replaced.
fn known(file: &Path, cost: &Path, plan: &Plan) -> Result<Option<(Stored, f64)>> {
    let Some(known) = sealed::read::<Cost>(cost)? else { return Ok(None) };
    let bytes = whole_file(file)?;
    if Digest::of(&bytes).hex() != known.vectors {
        return Err(Error::input("does not hold the stored vectors: it is damaged or was replaced").in_file(file));
    }
    let stored = Stored::decode(&bytes).map_err(|error| error.in_file(file))?;
    // The file's name is a digest of the other inputs, so only the hashes are compared.
    let hashes =
        |of: &Plan| (of.environment_hash.clone(), of.occluders.iter().map(|k| k.hash.clone()).collect::<Vec<_>>());
    if !stored.is_complete() || hashes(&stored.plan) != hashes(plan) {
        return Err(Error::input("holds the vectors of another occluder").in_file(file));
    }
    Ok(Some((stored, known.seconds)))
}

fn whole_file(file: &Path) -> Result<Vec<u8>> {
    lucerna::image::read_file_checked(file, Limits::default().max_file)
}

fn compute(
    gpu: &Gpu,
    light: &Light,
    (plan, settings): (&Plan, &Settings),
    kind: &Occluder,
    stop: &dyn Fn() -> bool,
) -> Result<(Stored, f64)> {
    let begun = Instant::now();
    let (mut plan, kinds) = (plan.clone(), std::slice::from_ref(kind));
    plan.adapt(gpu, light, kinds, settings, |_| true)?;
    let mut stored = Stored::empty(plan.clone(), 0);
    plan.compute(gpu, light, kinds, 0..plan.samples(), |_, new| {
        stored.push(new);
        Ok(!stop())
    })?;
    match stored.is_complete() {
        true => Ok((stored, begun.elapsed().as_secs_f64())),
        false => Err(Error::new(lucerna::ErrorKind::Runtime, "stopped while computing vectors")),
    }
}

//! Baked daylight, the frames of its day, and the path tracer at a time of the day.
//!
//! All three leave out the scene's own lights, its environment and the light of emissive surfaces: a bake has the light of sun and sky alone.

mod baked;
mod filter;
mod object;
mod truth;

use glam::{Quat, Vec2, Vec3};
use lucerna::{
    Error, Result,
    image::{Layer, Layers, Precision},
    scene::{Environment, Light, LightKind, Node, Pose, Scene, Transform, environment::direction_from_uv},
    technique::Settings as _,
    techniques::daylight::{Baking, PictureSettings, Reflections, Settings, Sky},
    tracer,
};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use self::object::Object;
use super::{Job, MOST_SAMPLES, Rendered, Times, Warm, on_device, read};
use crate::{
    config,
    daylight::{DayOptions, KindArg},
    experiment::file::Changes,
};

/// Columns and rows of the path tracer's sky.
const SKY: [u32; 2] = [512, 256];

/// Settings of a picture by baked daylight.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct OfPicture {
    day: DayOptions,
    /// What the texels of the bake are.
    kind: KindArg,
    bake: Baking,
    picture: PictureSettings,
    /// Stands in the scene after the bake.
    object: Object,
}

impl Default for OfPicture {
    fn default() -> Self {
        Self {
            day: DayOptions::default(),
            kind: KindArg::View,
            bake: Baking::default(),
            picture: PictureSettings::default(),
            object: Object::default(),
        }
    }
}

/// Settings of the frames of a day.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct OfFrames {
    day: DayOptions,
    bake: Baking,
    /// Radius of the filter against noise, pixels; 0: none.
    filter: u32,
}

/// Largest radius of the filter.
const MOST_FILTER: u32 = 32;

/// Settings of the path tracer at a time of the day.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct OfTruth {
    day: DayOptions,
    daylight: Settings,
    /// Paths a pixel.
    samples: u32,
    tracer: tracer::Settings,
    object: Object,
}

impl Default for OfTruth {
    fn default() -> Self {
        let tracer = tracer::Settings { filter: tracer::Filter::Centre, ..tracer::Settings::default() };
        let (day, daylight, object) = (DayOptions::default(), Settings::default(), Object::default());
        Self { day, daylight, samples: 64, tracer, object }
    }
}

pub(super) fn picture_settings(paper: bool, changes: &Changes) -> Result<Value> {
    super::no_paper("daylight", paper)?;
    let settings: OfPicture = config::with(&OfPicture::default(), changes)?;
    settings.bake.validate()?;
    settings.picture.validate()?;
    settings.object.validate()?;
    settings.day.day()?.parse_time(&settings.picture.daylight.time).map_err(Error::usage)?;
    config::to_value(&settings)
}

pub(super) fn frame_settings(paper: bool, changes: &Changes) -> Result<Value> {
    super::no_paper("daylight-frames", paper)?;
    let settings: OfFrames = config::with(&OfFrames::default(), changes)?;
    settings.bake.validate()?;
    settings.day.day()?;
    if settings.filter > MOST_FILTER {
        return Err(Error::usage(format!("filter is {}, allowed are 0 to {MOST_FILTER}", settings.filter)));
    }
    config::to_value(&settings)
}

pub(super) fn truth_settings(paper: bool, changes: &Changes) -> Result<Value> {
    super::no_paper("daylight-truth", paper)?;
    let settings: OfTruth = config::with(&OfTruth::default(), changes)?;
    settings.tracer.validate()?;
    settings.object.validate()?;
    PictureSettings { daylight: settings.daylight.clone(), ..PictureSettings::default() }.validate()?;
    settings.day.day()?.parse_time(&settings.daylight.time).map_err(Error::usage)?;
    match settings.samples {
        1..=MOST_SAMPLES => config::to_value(&settings),
        other => Err(Error::usage(format!("samples is {other}, allowed are 1 to {MOST_SAMPLES}"))),
    }
}

/// A picture by baked daylight. The bake stays in memory for the other times of its day.
pub(super) fn picture(warm: &mut Warm<'_>, job: &Job<'_>) -> Result<Option<Rendered>> {
    let OfPicture { day, kind, bake, picture, object } = read(job.settings)?;
    let gpu = warm.gpu.clone();
    // Added objects have the light of probes, and gloss has its directions.
    let gloss = picture.daylight.gloss && picture.daylight.reflections == Reflections::Probes && !bake.diffuse_only;
    let probes = object.is_some() || gloss;
    let Some(bake) = baked::of(warm, job, (&day, kind, &bake), probes)? else { return Ok(None) };
    let rendered = bake.render(&gpu, job, &picture, &object)?;
    Ok(rendered.map(|mut rendered| {
        rendered.times.facts.extend(bake.facts.iter().cloned());
        rendered.times.facts.push(("seconds whole".into(), bake.seconds));
        rendered
    }))
}

/// All frames of a day, one below the other: first the albedo, then for each lit time the irradiance of the sun's indirect light for 1 W/m² of
/// the sun (white). Facts name the time of each frame, the sun's irradiance then, and the noise.
pub(super) fn frames(warm: &mut Warm<'_>, job: &Job<'_>) -> Result<Option<Rendered>> {
    let OfFrames { day, bake, filter } = read(job.settings)?;
    let gpu = warm.gpu.clone();
    let Some(bake) = baked::of(warm, job, (&day, KindArg::View, &bake), false)? else { return Ok(None) };
    let Some(shown) = bake.render(&gpu, job, &PictureSettings::default(), &Object::default())? else { return Ok(None) };
    let of = |name: &str| shown.layers.layer(name).map(|layer| layer.data.as_slice()).unwrap_or_default();
    let (mut frames, mut noise) = (bake.frames(), bake.noise());
    if filter > 0 {
        let surfaces = filter::Surfaces::new(job.view, of("normal"), of("depth"));
        frames = surfaces.filter(&frames, filter);
        noise = surfaces.filter(&noise, filter);
    }
    let mut facts = bake.facts_of_frames()?;
    facts.push(("filter".into(), filter.into()));
    facts.extend(baked::noise_of_frames(&frames, &noise, bake.plan.times.len()));
    let [width, height] = job.view.extent;
    let data = [of("albedo"), &frames].concat();
    let stack = Layer { precision: Precision::Full, ..Layer::new("", &["R", "G", "B"], data) };
    let times = Times { wall: vec![bake.seconds * 1e3], facts, ..Times::default() };
    let layers = Layers::new(width, height * (bake.plan.times.len() as u32 + 1)).with(stack);
    Ok(Some(Rendered { layers, times }))
}

pub(super) fn truth(warm: &mut Warm<'_>, job: &Job<'_>) -> Result<Option<Rendered>> {
    truth::picture(warm, job, read(job.settings)?)
}

/// The scene without light of its own.
fn dark(scene: &Scene) -> Scene {
    let mut scene = Scene { environment: None, ..scene.clone() };
    scene.lights.clear();
    scene.nodes.iter_mut().for_each(|node| node.light = None);
    scene.materials.iter_mut().for_each(|material| material.emissive = Vec3::ZERO);
    scene
}

/// The scene under a sun and a sky. `sun`: unit vector towards the sun.
fn lit(mut scene: Scene, sun: Vec3, sky: &Sky, strength: f32) -> (Scene, Pose) {
    let light = Vec3::from(sky.sun_irradiance()) * strength;
    if light.max_element() > 0.0 {
        scene.lights.push(Light {
            name: "sun".into(),
            kind: LightKind::Directional,
            color: light / light.max_element(),
            intensity: light.max_element(),
        });
        // A directional light shines along its -Z.
        let local = Transform::Matrix(glam::Mat4::from_quat(Quat::from_rotation_arc(Vec3::Z, sun)));
        scene.nodes.push(Node { light: Some(scene.lights.len() as u32 - 1), local, ..Node::default() });
    }
    let [width, height] = SKY;
    let texel = |x: u32, y: u32| {
        let uv = Vec2::new((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32);
        Vec3::from(sky.radiance(direction_from_uv(uv).to_array()))
    };
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| texel(x, y))).collect();
    scene.environment = Some(Environment { name: "sky".into(), width, height, pixels, rotation: 0.0, scale: strength });
    let pose = Pose::rest(&scene);
    (scene, pose)
}

//! The kinds of techniques and references that experiments can name.

mod daylight;
mod fiv;
mod prt;
mod technique;
mod tonemap;

use std::{any::Any, collections::HashMap, path::PathBuf, time::Instant};

use lucerna::{
    Error, Result,
    gpu::Gpu,
    graph::{Graph, Report, Runner},
    image::{Layer, Layers},
    reference::path,
    scene::{Pose, Scene, View, bvh::Bvh},
    technique::Picture,
    techniques::{
        fiv::Fiv,
        igi::Igi,
        isr::{Isr, LightLaw},
    },
    tracer,
};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use serde_json::Value;

use super::{
    file::{Changes, Method},
    place::Loaded,
};
use crate::{
    args::Size,
    config,
    export_pov::{self, Pov, povray},
    signals::Interrupt,
};

/// A kind of technique or reference.
pub struct Kind {
    pub name: &'static str,
    pub description: &'static str,
    /// The pictures depend on device and driver.
    pub on_device: bool,
    /// The kind also accepts pictures instead of scenes.
    pub of_images: bool,
    settings: fn(paper: bool, changes: &Changes) -> Result<Value>,
    /// The picture, or `None` if it was interrupted.
    pub render: fn(&mut Warm<'_>, &Job<'_>) -> Result<Option<Rendered>>,
    /// The version of an external program that the kind needs, or the reason why it is not available.
    pub available: fn() -> std::result::Result<String, String>,
}

impl Kind {
    /// All settings of a variant, including those with default values.
    ///
    /// # Errors
    /// `Usage` for unknown keys and values out of range.
    pub fn effective(&self, method: &Method, variant: &Changes) -> Result<Value> {
        let mut changes = method.settings.clone();
        changes.extend(variant.iter().map(|(key, value)| (key.clone(), value.clone())));
        (self.settings)(method.paper, &changes)
    }
}

/// A picture to render.
pub struct Job<'a> {
    pub view: &'a View,
    /// All settings.
    pub settings: &'a Value,
    pub seed: u32,
    pub repeat: u32,
    pub interrupt: &'a Interrupt,
}

/// A picture and its times.
pub struct Rendered {
    pub layers: Layers,
    pub times: Times,
}

/// The times of a picture, milliseconds.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Times {
    /// Wall-clock time of each repetition; the first includes the readback.
    pub wall: Vec<f64>,
    /// Device time of each repetition; empty if the device has no timestamps.
    pub device: Vec<f64>,
    /// Times of the passes by their names: medians over the repetitions (without the first, if there are more).
    pub passes: Vec<(String, f64)>,
    /// Further facts about the run, by name: time of precomputation, bytes, numbers of objects.
    pub facts: Vec<(String, f64)>,
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

impl Times {
    /// Median over the repetitions. The first repetition creates pipelines, so it does not count if there are more.
    pub fn frame(&self) -> Option<f64> {
        let list = if self.device.is_empty() { &self.wall } else { &self.device };
        median(list.iter().skip(usize::from(list.len() > 1)).copied().collect())
    }

    /// A fact by its name.
    pub fn fact(&self, name: &str) -> Option<f64> {
        self.facts.iter().find(|(known, _)| known == name).map(|(_, value)| *value)
    }

    /// Sum over the passes whose names begin with `prefix`.
    pub fn of_passes(&self, prefix: &str) -> f64 {
        self.passes.iter().filter(|(name, _)| name.starts_with(prefix)).map(|(_, ms)| ms).sum()
    }
}

/// Device and scene, with data that is kept from picture to picture.
pub struct Warm<'a> {
    pub gpu: &'a Gpu,
    pub scene: &'a Scene,
    pub pose: &'a Pose,
    /// The picture of an entry without a scene.
    pub image: Option<&'a Layers>,
    /// Folder for data that scenes share, in the folder of the report. It may not exist yet.
    pub folder: PathBuf,
    /// Data of this scene, by name.
    kept: HashMap<&'static str, Box<dyn Any>>,
    /// The path tracer borrows the scene, so it cannot be in `kept`.
    tracer: Option<tracer::Tracer<'a>>,
}

impl<'a> Warm<'a> {
    pub fn new(gpu: &'a Gpu, loaded: &'a Loaded, folder: PathBuf) -> Self {
        let Loaded { scene, pose, image, .. } = loaded;
        Self { gpu, scene, pose, image: image.as_ref(), folder, kept: HashMap::new(), tracer: None }
    }

    /// Drops the scene's data of this name.
    pub fn forget(&mut self, name: &'static str) {
        self.kept.remove(name);
    }

    /// The scene's data of this name; `make` creates it on the first call.
    ///
    /// # Errors
    /// The errors of `make`.
    pub fn keep<T: 'static>(
        &mut self,
        name: &'static str,
        make: impl FnOnce(&Gpu, &Scene, &Pose) -> Result<T>,
    ) -> Result<&mut T> {
        if !self.kept.contains_key(name) {
            self.kept.insert(name, Box::new(make(self.gpu, self.scene, self.pose)?));
        }
        let kept = self.kept.get_mut(name).and_then(|kept| kept.downcast_mut());
        kept.ok_or_else(|| Error::new(lucerna::ErrorKind::Runtime, format!("'{name}' has another type")))
    }
}

/// All kinds.
pub const KINDS: &[Kind] = &[
    technique::of::<Isr>(),
    technique::of::<Igi>(),
    Kind { render: fiv::picture, ..technique::of::<Fiv>() },
    Kind {
        name: "daylight",
        description: "baked daylight at a time of the day (picture.daylight.time), with an object that the bake does not know (object.builtin, object.x, object.y, object.height); layers direct, indirect, irradiance, object",
        on_device: true,
        of_images: false,
        settings: daylight::picture_settings,
        render: daylight::picture,
        available: || Ok(String::new()),
    },
    Kind {
        name: "daylight-frames",
        description: "the indirect light of the sun at all times of the day, one picture below the other",
        on_device: true,
        of_images: false,
        settings: daylight::frame_settings,
        render: daylight::frames,
        available: || Ok(String::new()),
    },
    Kind {
        name: "daylight-truth",
        description: "path tracer on the device under sun and sky of a time of the day; layers direct, indirect",
        on_device: true,
        of_images: false,
        settings: daylight::truth_settings,
        render: daylight::truth,
        available: || Ok(String::new()),
    },
    Kind {
        name: "prt",
        description: "precomputed transfer with its bake, by one lamp (`lamp`) or the scene's; layers direct, indirect, irradiance, shadow",
        on_device: true,
        of_images: false,
        settings: prt::picture_settings,
        render: prt::picture,
        available: || Ok(String::new()),
    },
    Kind {
        name: "prt-truth",
        description: "path tracer on the device by the same lamp, diffuse; layers direct, indirect, shadow, facing",
        on_device: true,
        of_images: false,
        settings: prt::truth_settings,
        render: prt::truth,
        available: || Ok(String::new()),
    },
    Kind {
        name: "tracer",
        description: "path tracer on the device; layers emission, direct, indirect, albedo, normal, depth, samples, variance",
        on_device: true,
        of_images: false,
        settings: |paper, changes| {
            no_paper("tracer", paper)?;
            let settings: TracerSettings = config::with(&TracerSettings::default(), changes)?;
            settings.tracer.validate()?;
            match settings.samples {
                1..=MOST_SAMPLES => config::to_value(&settings),
                other => Err(Error::usage(format!("samples is {other}, allowed are 1 to {MOST_SAMPLES}"))),
            }
        },
        render: traced,
        available: || Ok(String::new()),
    },
    Kind {
        name: "povray",
        description: "the program povray, with the dissertation's radiosity settings; the picture without layers",
        on_device: false,
        of_images: false,
        settings: |paper, changes| {
            no_paper("povray", paper)?;
            let settings: PovSettings = config::with(&PovSettings::default(), changes)?;
            settings.pov.check()?;
            config::to_value(&settings)
        },
        render: by_povray,
        available: || {
            let program = povray::find().map_err(|error| error.to_string())?;
            povray::version(&program).map_err(|error| error.to_string())
        },
    },
    Kind {
        name: "path",
        description: "path tracer on the CPU; layers direct, indirect, albedo",
        on_device: false,
        of_images: false,
        settings: |paper, changes| {
            no_paper("path", paper)?;
            let settings: PathSettings = config::with(&PathSettings::default(), changes)?;
            for (name, value) in [("light_radius", settings.light_radius), ("light_power", settings.light_power)] {
                if !(0.0..=1e9).contains(&value) {
                    return Err(Error::usage(format!("{name} is {value}, allowed are 0 to 1e9")));
                }
            }
            let other = settings.light_radius != 0.0 || settings.light_power != 1.0;
            if other && settings.light_law == LightLaw::Physical {
                let error = Error::usage("light_radius and light_power have no effect with light_law = \"physical\"");
                return Err(error.help("Set light_law = \"paper\", or leave them out"));
            }
            match (settings.samples, settings.bounces) {
                (1..=MOST_SAMPLES, 0..=MOST_BOUNCES) => config::to_value(&settings),
                (1..=MOST_SAMPLES, other) => {
                    Err(Error::usage(format!("bounces is {other}, allowed are 0 to {MOST_BOUNCES}")))
                }
                (other, _) => Err(Error::usage(format!("samples is {other}, allowed are 1 to {MOST_SAMPLES}"))),
            }
        },
        render: path_picture,
        available: || Ok(String::new()),
    },
    Kind {
        name: "tonemap",
        description: "tone mapping of a picture, or of a frame by image-space radiosity, on the device; layer important",
        on_device: true,
        of_images: true,
        settings: tonemap::settings,
        render: tonemap::on_gpu,
        available: || Ok(String::new()),
    },
    Kind {
        name: "tonemap-cpu",
        description: "the same by the CPU reference implementation",
        on_device: true,
        of_images: true,
        settings: tonemap::settings,
        render: tonemap::on_cpu,
        available: || Ok(String::new()),
    },
];

/// Refuses `paper = true` for a kind that has no settings of a paper.
fn no_paper(kind: &str, paper: bool) -> Result<()> {
    match paper {
        true => Err(Error::usage(format!("{kind} has no preset with the settings of the paper"))),
        false => Ok(()),
    }
}

/// Finds a kind.
///
/// # Errors
/// `Input` if there is none of this name.
pub fn find(name: &str) -> Result<&'static Kind> {
    KINDS.iter().find(|kind| kind.name == name).ok_or_else(|| {
        let names: Vec<&str> = KINDS.iter().map(|kind| kind.name).collect();
        let hint = config::nearest(name, names.iter().copied()).map(|name| format!(" (did you mean '{name}'?)"));
        Error::input(format!("no kind '{name}'{}; there are {}", hint.unwrap_or_default(), names.join(", ")))
    })
}

/// Deserialises settings.
fn read<S: DeserializeOwned>(settings: &Value) -> Result<S> {
    serde_json::from_value(settings.clone()).map_err(|error| Error::input(format!("settings: {error}")))
}

/// Renders the frame that `compose` declares `repeat` times. The picture is the first one.
pub fn on_device(
    runner: &mut Runner,
    job: &Job<'_>,
    name: &'static str,
    mut compose: impl FnMut(&mut Graph) -> Result<Picture>,
) -> Result<Option<Rendered>> {
    let (mut layers, mut times) = (None, Times::default());
    let mut reports: Vec<Report> = Vec::new();
    for _ in 0..job.repeat {
        if job.interrupt.requested() {
            return Ok(None);
        }
        let begun = Instant::now();
        let mut graph = Graph::new(name);
        graph.seed = job.seed;
        let picture = compose(&mut graph)?;
        let reading = layers.is_none().then(|| picture.read(&mut graph, true, true));
        let frame = runner.run(&graph)?;
        if let Some(reading) = reading {
            layers = Some(reading.layers(&frame));
            times.facts = reading.sums(&frame);
            times.facts.extend(reading.numbers(&frame).into_iter().map(|(name, number)| (name.to_owned(), number)));
        }
        times.wall.push(begun.elapsed().as_secs_f64() * 1e3);
        reports.push(frame.report);
    }
    let device = |report: &Report| report.passes.iter().map(|pass| pass.gpu_ms).sum::<Option<f64>>();
    times.device = reports.iter().map(device).collect::<Option<_>>().unwrap_or_default();
    let counted = &reports[usize::from(reports.len() > 1)..];
    if let Some(first) = counted.first() {
        let of = |index: usize| counted.iter().filter_map(|report| report.passes.get(index)?.gpu_ms).collect();
        let passes = first.passes.iter().enumerate().filter_map(|(i, pass)| Some((pass.name.clone(), median(of(i))?)));
        times.passes = passes.collect();
    }
    Ok(layers.map(|layers| Rendered { layers, times }))
}

/// Settings of the path tracer on the CPU.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct PathSettings {
    /// Paths a pixel.
    samples: u32,
    bounces: u32,
    specular: bool,
    jitter: bool,
    /// How punctual lights fall off and how surfaces reflect them, as `isr.light_law`.
    light_law: LightLaw,
    /// Law of the dissertation: radius of lights without a range, metres; 0: the far distance of the camera.
    light_radius: f32,
    /// Law of the dissertation: brightness of the brightest light.
    light_power: f32,
}

impl Default for PathSettings {
    fn default() -> Self {
        let path::Settings { samples, bounces, diffuse_only, jitter, .. } = path::Settings::default();
        let (light_law, light_radius, light_power) = (LightLaw::Physical, 0.0, 1.0);
        Self { samples, bounces, specular: !diffuse_only, jitter, light_law, light_radius, light_power }
    }
}

fn path_picture(warm: &mut Warm<'_>, job: &Job<'_>) -> Result<Option<Rendered>> {
    let PathSettings { samples, bounces, specular, jitter, light_law, light_radius, light_power } = read(job.settings)?;
    let (scene, pose) = (warm.scene, warm.pose);
    let bvh: &mut Bvh = warm.keep("bvh", |_, scene, pose| Ok(Bvh::build(scene, pose)))?;
    let begun = Instant::now();
    let law = match light_law {
        LightLaw::Physical => path::Law::Physical,
        LightLaw::Paper => {
            let radius = if light_radius > 0.0 { light_radius } else { job.view.far };
            path::Law::Paper { radius, power: light_power }
        }
    };
    let settings =
        path::Settings { samples, bounces, diffuse_only: !specular, jitter, law, seed: job.seed, ..Default::default() };
    let traced = path::trace(scene, pose, bvh, job.view, &settings);
    let [width, height] = job.view.extent;
    let rgb = |pixels: &[glam::Vec3]| pixels.iter().map(|v| v.to_array()).collect::<Vec<[f32; 3]>>();
    let total = traced.total();
    let direct: Vec<glam::Vec3> = (0..total.len()).map(|i| traced.direct[i] + traced.emission[i]).collect();
    let layers = Layers::new(width, height)
        .with(Layer::rgb("", &rgb(&total)))
        .with(Layer::rgb("direct", &rgb(&direct)))
        .with(Layer::rgb("indirect", &rgb(&traced.indirect)))
        .with(Layer::rgb("albedo", &rgb(&traced.albedo)));
    let times = Times { wall: vec![begun.elapsed().as_secs_f64() * 1e3], ..Times::default() };
    Ok(Some(Rendered { layers, times }))
}

/// Maximum of paths per pixel.
const MOST_SAMPLES: u32 = 1 << 24;
/// Maximum of bounces, as for the path tracer on the device.
const MOST_BOUNCES: u32 = 1000;

/// Settings of the path tracer on the device.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct TracerSettings {
    /// Paths a pixel.
    samples: u32,
    tracer: tracer::Settings,
}

impl Default for TracerSettings {
    /// Settings of a reference for rasterised pictures with one bounce.
    fn default() -> Self {
        let tracer = tracer::Settings { bounces: 1, filter: tracer::Filter::Centre, ..tracer::Settings::default() };
        Self { samples: 64, tracer }
    }
}

fn traced(warm: &mut Warm<'_>, job: &Job<'_>) -> Result<Option<Rendered>> {
    let TracerSettings { samples, mut tracer } = read(job.settings)?;
    // Two references with different seeds allow to measure their noise.
    tracer.seed = tracer.seed.wrapping_add(job.seed);
    if warm.tracer.is_none() {
        warm.tracer = Some(tracer::Tracer::new(warm.gpu, warm.scene, warm.pose)?);
    }
    let Some(running) = warm.tracer.as_mut() else { return Ok(None) };
    running.start(job.view, &tracer)?;
    let progress = running.run(samples.into(), |_| !job.interrupt.requested())?;
    if job.interrupt.requested() {
        return Ok(None);
    }
    let times = Times { wall: vec![progress.time.as_secs_f64() * 1e3], ..Times::default() };
    Ok(Some(Rendered { layers: running.layers()?, times }))
}

/// Settings of POV-Ray.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct PovSettings {
    /// The number of rays per pixel is the square of this value; 1: one ray, through the centre.
    subpixels: u32,
    /// With more than one, POV-Ray's radiosity differs from run to run.
    threads: u32,
    /// Time after which POV-Ray is stopped, seconds.
    time_limit: u64,
    pov: Pov,
}

impl Default for PovSettings {
    fn default() -> Self {
        Self { subpixels: 1, threads: 1, time_limit: 3600, pov: Pov::default() }
    }
}

fn by_povray(warm: &mut Warm<'_>, job: &Job<'_>) -> Result<Option<Rendered>> {
    let PovSettings { subpixels, threads, time_limit, pov } = read(job.settings)?;
    let export = export_pov::export(warm.scene, warm.pose, job.view, &pov, "scene")?;
    let [width, height] = job.view.extent;
    let options = povray::Options { subpixels, threads, time_limit: std::time::Duration::from_secs(time_limit) };
    match povray::render(&export, Size { width, height }, &options) {
        // The signal also reaches the child process, so its error is no error of the experiment.
        Err(_) if job.interrupt.requested() => Ok(None),
        rendered => rendered.map(|rendered| {
            let times = Times { wall: vec![rendered.seconds * 1e3], ..Times::default() };
            Some(Rendered { layers: rendered.picture, times })
        }),
    }
}

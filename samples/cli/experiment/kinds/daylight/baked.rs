//! Bakes that stay in memory.

use std::{sync::Arc, time::Instant};

use lucerna::{
    Error, Result,
    gpu::Gpu,
    graph::Runner,
    image::Layer,
    scene::{Pose, Scene},
    technique::{Ready, Shot},
    techniques::daylight::{
        Baked, Baking, Daylight, Light, PictureSettings, Plan, Sky, Stored, finish, probes::Brick, units,
    },
};
use serde_json::Value;

use super::{
    Job, Rendered, Warm, dark,
    object::{self, Object},
    on_device,
};
use crate::{
    config,
    daylight::{DayOptions, KindArg, Planned, for_view},
    experiment::place,
};

/// Bakes of a scene that stay in memory. Techniques and frames of the same day share one.
const KEPT: usize = 2;

/// A bake for a view.
pub(super) struct Kept {
    key: Value,
    scene: Scene,
    pub(super) plan: Plan,
    /// The light of all tiles before compression, if they are the pixels of the view.
    lights: Vec<Light>,
    stored: Arc<Stored>,
    ready: Option<Shown>,
    /// Wall-clock time of the paths and the compression.
    pub(super) seconds: f64,
    /// Sizes and errors.
    pub(super) facts: Vec<(String, f64)>,
}

/// What renders pictures of a bake.
struct Shown {
    object: Object,
    /// With the object.
    scene: Scene,
    pose: Pose,
    ready: Ready<Daylight>,
    runner: Runner,
    /// Where the object is seen.
    seen: Option<Layer>,
}

/// The bake for these settings, with `probes` or without; `None` if it was interrupted.
pub(super) fn of<'w>(
    warm: &'w mut Warm<'_>,
    job: &Job<'_>,
    (day, kind, baking): (&DayOptions, KindArg, &Baking),
    probes: bool,
) -> Result<Option<&'w mut Kept>> {
    let baking = &Baking { probes: if probes { baking.probes } else { 0.0 }, ..baking.clone() };
    let key = config::to_value(&(day, kind, baking, place::view_key(job.view)?))?;
    let (gpu, scene) = (warm.gpu, warm.scene);
    let list: &mut Vec<Kept> = warm.keep("daylight bakes", |_, _, _| Ok(Vec::new()))?;
    let index = match list.iter().position(|kept| kept.key == key) {
        Some(index) => index,
        None => {
            list.truncate(KEPT - 1);
            let Some(made) = make(gpu, scene, job, (day, kind, baking), key)? else { return Ok(None) };
            list.insert(0, made);
            0
        }
    };
    Ok(list.get_mut(index))
}

fn make(
    gpu: &Gpu,
    scene: &Scene,
    job: &Job<'_>,
    (day, kind, baking): (&DayOptions, KindArg, &Baking),
    key: Value,
) -> Result<Option<Kept>> {
    let scene = dark(scene);
    let begun = Instant::now();
    let Planned { plan, sources, corners, backs, .. } = for_view(gpu, day, kind, baking, &scene, "view", job.view)?;
    plan.validate()?;
    let skies = units::skies(&plan)?;
    let mut transport = backs.transport(gpu, &scene, &plan, sources)?;
    let [columns, rows] = plan.tiles();
    let (mut lights, mut gathered) = (Vec::new(), Vec::new());
    for tile in 0..columns * rows {
        if job.interrupt.requested() {
            return Ok(None);
        }
        let light = transport.tile(&plan, tile)?;
        gathered.push(units::gathered(&plan, &light, &skies)?);
        if kind == KindArg::View {
            lights.push(light);
        }
    }
    let tiles = finish::tiles(&plan, &gathered, |_| Ok(()))?;
    let mut probes = Vec::new();
    for index in 0..plan.brick_count() {
        if job.interrupt.requested() {
            return Ok(None);
        }
        probes.push(Brick::compress(&plan, transport.brick(&plan, index)?, &skies)?);
    }
    let seconds = begun.elapsed().as_secs_f64();
    let stored = Stored { plan: plan.clone(), tiles, probes, corners };
    let summary = stored.summary();
    let facts = [
        ("raw bytes", summary.raw_bytes as f64),
        ("bytes", summary.bytes as f64),
        ("images", summary.images),
        ("most images", f64::from(summary.most_images)),
        ("worst tile", summary.worst_tile),
        ("worst frame", summary.worst_frame),
        ("noise", summary.noise),
    ];
    let facts = facts.map(|(name, value)| (name.to_owned(), value)).to_vec();
    Ok(Some(Kept { key, scene, plan, lights, stored: Arc::new(stored), ready: None, seconds, facts }))
}

impl Kept {
    /// A picture from the compressed light, with an object that the bake does not know. A layer says where the object is seen.
    pub(super) fn render(
        &mut self,
        gpu: &Gpu,
        job: &Job<'_>,
        settings: &PictureSettings,
        object: &Object,
    ) -> Result<Option<Rendered>> {
        let shown = match self.ready.take().filter(|shown| shown.object == *object) {
            Some(shown) => shown,
            None => {
                let scene = dark(&object.added_to(&self.scene, job.view)?);
                let baked = Baked { stored: self.stored.clone(), frames: None, stream: None, file: None, digest: None };
                let ready = Ready::new(gpu, &scene, settings, Some(&baked), &mut |_, _| true)?;
                let pose = Pose::rest(&scene);
                let seen = object.is_some().then(|| object::layer(&scene, job.view));
                Shown { object: object.clone(), scene, pose, ready, runner: Runner::new(gpu), seen }
            }
        };
        let Shown { scene, pose, ready, runner, seen, .. } = self.ready.insert(shown);
        let rendered = on_device(runner, job, "daylight", |graph| {
            ready.frame(graph, (scene, pose), job.view, Shot::default(), settings)
        })?;
        Ok(rendered.map(|mut rendered| {
            rendered.layers.layers.extend(seen.clone());
            rendered
        }))
    }

    /// Irradiance before compression, W/m² for 1 W/m² of the sun: one picture for each lit time, 0 without a surface.
    pub(super) fn frames(&self) -> Vec<f32> {
        self.pictures(|light| &light.sun)
    }

    /// The noise of [`Self::frames`]: one standard deviation, on average.
    pub(super) fn noise(&self) -> Vec<f32> {
        self.pictures(|light| &light.noise)
    }

    fn pictures(&self, of: impl Fn(&Light) -> &Vec<f32>) -> Vec<f32> {
        let [width, height] = self.plan.extent.map(|side| side as usize);
        let times = self.plan.times.len();
        let mut out = vec![0.0; 3 * width * height * times];
        for (index, light) in self.lights.iter().enumerate() {
            for (number, [x, y]) in self.plan.covered(index as u32, &light.mask).enumerate() {
                let pixel = y as usize * width + x as usize;
                for channel in 0..3 {
                    let of_texel = &of(light)[(3 * number + channel) * times..][..times];
                    for (time, value) in of_texel.iter().enumerate() {
                        out[3 * (time * width * height + pixel) + channel] = *value;
                    }
                }
            }
        }
        out
    }

    /// Sizes, errors, and for each lit time its second of the day and the irradiance of the sun in the weather of the plan.
    ///
    /// # Errors
    /// `Input` for impossible weather.
    pub(super) fn facts_of_frames(&self) -> Result<Vec<(String, f64)>> {
        let mut facts = self.facts.clone();
        facts.push(("steps".into(), f64::from(self.plan.steps)));
        facts.push(("lit".into(), self.plan.times.len() as f64));
        for (number, time) in self.plan.times.iter().enumerate() {
            let sky = Sky::new(self.plan.weather, time.sun.map(f64::from)).map_err(Error::input)?;
            facts.push((format!("second {number}"), time.seconds));
            for (name, value) in ["red", "green", "blue"].iter().zip(sky.sun_irradiance()) {
                facts.push((format!("{name} {number}"), f64::from(value)));
            }
        }
        Ok(facts)
    }
}

/// Median over the frames, and the largest, of the root mean square of the noise over the mean of the frame. Frames without light have none.
pub(super) fn noise_of_frames(frames: &[f32], noise: &[f32], times: usize) -> [(String, f64); 2] {
    let one = (frames.len() / times.max(1)).max(1);
    let relative = |(frame, noise): (&[f32], &[f32])| {
        let mean = frame.iter().map(|value| f64::from(*value)).sum::<f64>() / one as f64;
        let square = noise.iter().map(|value| f64::from(*value).powi(2)).sum::<f64>() / one as f64;
        (mean > 0.0).then(|| square.sqrt() / mean)
    };
    let mut all: Vec<f64> = frames.chunks_exact(one).zip(noise.chunks_exact(one)).filter_map(relative).collect();
    all.sort_by(f64::total_cmp);
    let middle = all.get(all.len() / 2).copied().unwrap_or(0.0);
    [("median noise".into(), middle), ("worst noise".into(), all.last().copied().unwrap_or(0.0))]
}

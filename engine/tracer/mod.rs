//! Reference pictures: progressive path tracing on the device.
//!
//! The estimate is unbiased except for the limits on bounces. Each sample of a pixel follows one path from the camera. At each
//! surface the path samples a light of the light tree, a directional light and the environment, and combines these samples with
//! the light that its scattered ray hits (multiple importance sampling; Veach and Guibas, 1995).
//!
//! Random numbers are a pure function of (seed, pixel, sample, dimension): scrambled Sobol points (`lib/points.glsl`; Burley, Practical
//! Hash-based Owen Scrambling, 2020), or independent ones ([`Points`]). The samples of a pixel are summed in order, together
//! with their rounding errors. The result therefore is bit-identical for any division of the work, and after an interruption.
//!
//! ```no_run
//! # use lucerna::{gpu::Gpu, tracer::{Settings, Tracer}, scene::{Pose, Scene, View}};
//! # fn example(gpu: &Gpu, scene: &Scene) -> lucerna::Result<()> {
//! let pose = Pose::rest(scene);
//! let mut tracer = Tracer::new(gpu, scene, &pose)?; // once a scene
//! let view = View::of_camera(scene, &pose, 0, [320, 240])?;
//! let picture = tracer.render(&view, &Settings { bounces: 1, ..Default::default() }, 256)?; // any number of views
//! # Ok(())
//! # }
//! ```
//!
//! Materials have a diffuse base under microfacets as in `lib/brdf.glsl`. Mirrors (`roughness < 0.05 && metallic > 0.5`) and glass
//! (transmission) are perfectly smooth. Paths pass through them only from the camera's side: the light of a point light through
//! glass or from a mirror is missing. Single-sided surfaces emit from their front only.

mod alias;
mod area_lights;
pub mod bands;
mod environment;
mod job;
mod kernel;
mod light_tree;
mod lights;
mod settings;
mod sharp;
mod state;
mod sums;
mod technique;

pub use settings::{Filter, PictureSettings, Points, Settings, Sources, Strategy};
pub use state::{Head, State};
pub use sums::Sums;
pub use technique::{Mode, Reference};

/// The tables for light sampling. Techniques that sample the same lights use them, and so do tests.
#[doc(hidden)]
pub mod tables {
    pub use super::{
        area_lights::{AreaHandles, AreaLights},
        environment::{Importance, importance, radiance_map},
        lights::{LightTable, table as lights},
        sharp::{has_sharp, may_be_sharp},
    };
}

use std::time::Duration;

use crate::{
    Error, Result,
    gpu::{DeviceKind, Gpu, Tiles},
    graph::{Graph, Runner},
    image::Layers,
    resident::Resident,
    scene::{Aabb, Note, Pose, Scene, View},
    shaders::types,
};
use job::{GRANULE, Job};
use kernel::{Kernel, MOST_SLOTS};

/// A path tracer for one scene on one device.
#[derive(Debug)]
pub struct Tracer<'s> {
    scene: &'s Scene,
    pose: Pose,
    resident: Resident,
    kernel: Kernel,
    runner: Runner,
    /// Bounding box of the scene in this pose, metres.
    bounds: Aabb,
    punctual: Vec<types::Light>,
    job: Option<Job>,
    /// Slots per tile, adapted to the measured time; the next picture starts with this value.
    tile: u64,
    /// A fixed number of slots per tile instead.
    fixed_tile: Option<u64>,
}

/// Progress of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Samples per pixel; the fraction is the share of pixels that have one sample more.
    pub samples: f64,
    /// Paths traced so far, one for each sample of each pixel.
    pub paths: u64,
    /// Time on the device in this run.
    pub time: Duration,
}

impl<'s> Tracer<'s> {
    /// Uploads the scene, which must pass its validation.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`; `Runtime` if the scene is larger than the device's limits.
    pub fn new(gpu: &Gpu, scene: &'s Scene, pose: &Pose) -> Result<Self> {
        let resident = Resident::for_rays(gpu, scene)?;
        let mut tracer = Self {
            scene,
            pose: pose.clone(),
            kernel: Kernel::new(gpu, scene, &resident)?,
            resident,
            runner: Runner::new(gpu),
            bounds: Aabb::EMPTY,
            punctual: Vec::new(),
            job: None,
            tile: 0,
            fixed_tile: None,
        };
        tracer.set_pose(pose);
        Ok(tracer)
    }

    /// Changes the scene's pose. Drops an unfinished picture.
    pub fn set_pose(&mut self, pose: &Pose) {
        self.pose = pose.clone();
        self.job = None;
        self.kernel.moved();
        // The graph is declared only for the bounds, and never run.
        let handles = self.resident.frame_in(&mut Graph::new("tracer.bounds"), self.scene, &self.pose);
        self.bounds = handles.bounds();
        self.punctual = handles.moment.lights.clone();
    }

    /// Bounding box of the scene in its pose, world space, metres.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Notes about the parts of the scene that are approximated.
    pub fn notes(&self) -> Vec<Note> {
        notes(self.resident.notes())
    }

    /// Fixes the size of tiles to `slots` pixels instead of adapting it to the measured time. The picture does not depend on it.
    pub fn set_tile(&mut self, slots: Option<u64>) {
        self.fixed_tile = slots;
    }

    /// Limits the number of paths that are traced together, whose states are in memory: 1 to 2¹⁸, the default. The picture does not depend on it.
    pub fn set_together(&mut self, paths: u64) {
        self.kernel.together = paths.clamp(1, MOST_SLOTS);
    }

    /// Renders a picture with `samples` paths per pixel. [`Sums::layers`] describes its layers.
    ///
    /// # Errors
    /// As [`Self::start`] and [`Self::run`].
    pub fn render(&mut self, view: &View, settings: &Settings, samples: u32) -> Result<Layers> {
        self.start(view, settings)?;
        self.step(samples)?;
        self.layers()
    }

    /// Begins a picture. An infinite far plane of the camera is replaced by a plane behind the scene.
    ///
    /// # Errors
    /// `Usage` if a setting is out of its range, `OutOfMemory`, `DeviceLost`.
    pub fn start(&mut self, view: &View, settings: &Settings) -> Result<()> {
        settings.validate()?;
        let view = view.fit_far(&self.bounds);
        self.kernel.light(self.scene, &self.pose, &self.punctual, settings.sources)?;
        self.job = Some(Job::new(self.kernel.gpu(), view, settings.clone())?);
        Ok(())
    }

    /// Adds `samples` paths per pixel.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub fn step(&mut self, samples: u32) -> Result<()> {
        let target = self.job()?.samples_done() + u64::from(samples);
        self.run(target, |_| true).map(drop)
    }

    /// Continues until every pixel has `samples` paths, or `go_on` returns false. `go_on` is called after every tile, which takes
    /// about 30 ms, on CPU drivers 0.3 s. The picture is valid at any stop.
    ///
    /// # Errors
    /// `Usage` before [`Self::start`]; `OutOfMemory`, `DeviceLost`, `Runtime` from the device.
    pub fn run(&mut self, samples: u64, mut go_on: impl FnMut(&Progress) -> bool) -> Result<Progress> {
        let job = self.job.as_ref().ok_or_else(not_started)?;
        let (slots, done) = (job.slots(), job.done);
        if samples > u64::from(u32::MAX) {
            return Err(Error::usage(format!("{samples} samples a pixel; at most {} are numbered", u32::MAX)));
        }
        let total = samples.saturating_mul(slots).max(done);
        let cut = self.kernel.cut(self.scene, job, total - done)?;
        let most = cut.most().max(u64::from(GRANULE));
        // The passes of a tile are many, and each wakes the threads of a CPU driver, which has no watchdog.
        let aim = if self.kernel.gpu().caps().kind == DeviceKind::Cpu { 300 } else { 30 };
        let begin = |done| Tiles::new(total, GRANULE).at_most(most).aim(Duration::from_millis(aim)).after(done);
        let mut tiles = begin(done).first(self.tile);
        if let Some(fixed) = self.fixed_tile {
            tiles = tiles.first(fixed);
        }
        while let Some(tile) = tiles.next_tile() {
            let mut graph = Graph::new("tracer");
            let handles = self.resident.frame_in(&mut graph, self.scene, &self.pose);
            let job = self.job.as_ref().ok_or_else(not_started)?;
            self.kernel.declare(&mut graph, (self.scene, &handles), job, tile.clone(), cut)?;
            let frame = self.runner.run(&graph)?;
            let time = Duration::from_secs_f64(frame.report.wait_ms.max(0.0) * 1e-3);
            match self.fixed_tile {
                Some(fixed) => tiles = begin(tile.end).first(fixed),
                None => tiles.took(time),
            }
            let job = self.job_mut()?;
            job.done = tile.end;
            job.time += time;
            let progress = job.progress();
            if !go_on(&progress) {
                break;
            }
        }
        if self.fixed_tile.is_none() {
            self.tile = tiles.size();
        }
        Ok(self.job()?.progress())
    }

    /// The picture so far.
    ///
    /// # Errors
    /// `Usage` before [`Self::start`]; `OutOfMemory`, `DeviceLost`.
    pub fn layers(&self) -> Result<Layers> {
        Ok(self.sums()?.layers())
    }

    /// The sums from which the picture is computed.
    ///
    /// # Errors
    /// As [`Self::layers`].
    pub fn sums(&self) -> Result<Sums> {
        self.job()?.sums()
    }

    /// The view of the picture, with the far plane that [`Self::start`] has chosen.
    ///
    /// # Errors
    /// `Usage` before [`Self::start`].
    pub fn view(&self) -> Result<View> {
        Ok(self.job()?.view)
    }

    /// Progress of the picture.
    ///
    /// # Errors
    /// `Usage` before [`Self::start`].
    pub fn progress(&self) -> Result<Progress> {
        Ok(self.job()?.progress())
    }

    /// The state of the unfinished picture, with which another process can continue. `about`: further data on which the picture
    /// depends (scene, …).
    ///
    /// # Errors
    /// As [`Self::layers`].
    pub fn save(&self, about: &serde_json::Value) -> Result<State> {
        self.job()?.save(self.kernel.gpu(), about)
    }

    /// Continues from a state. Call [`Self::start`] with the same view and settings first.
    ///
    /// # Errors
    /// `Input` if the state belongs to another picture; the message lists the differences.
    pub fn restore(&mut self, state: &State, about: &serde_json::Value) -> Result<()> {
        let gpu = self.kernel.gpu().clone();
        self.job_mut()?.restore(&gpu, state, about)
    }

    fn job(&self) -> Result<&Job> {
        self.job.as_ref().ok_or_else(not_started)
    }

    fn job_mut(&mut self) -> Result<&mut Job> {
        self.job.as_mut().ok_or_else(not_started)
    }
}

/// The notes about a scene's upload that apply to rays. Those about glass and blending are for rasterisers.
fn notes(of_upload: &[Note]) -> Vec<Note> {
    of_upload.iter().filter(|note| note.place == "textures").cloned().collect()
}

fn not_started() -> Error {
    Error::usage("no picture was started")
}

//! Reference pictures: progressive path tracing on the device.
//!
//! The estimate is unbiased except for the limits on bounces. Each sample of a pixel follows one path from the camera. At each
//! surface the path samples a light of the light tree, a directional light and the environment, and combines these samples with
//! the light that its scattered ray hits (multiple importance sampling; Veach and Guibas, 1995).
//!
//! Random numbers are a pure function of (seed, pixel, sample, dimension). The samples of a pixel are summed in order, together
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
mod environment;
mod light_tree;
mod lights;
mod settings;
mod sharp;
mod state;
mod sums;
mod work;

pub use settings::{Filter, Settings, Sources, Strategy};
pub use state::{Head, State};
pub use sums::Sums;

/// The tables for light sampling. Techniques that sample the same lights use them, and so do tests.
#[doc(hidden)]
pub mod tables {
    pub use super::{
        environment::{Importance, importance, radiance_map},
        lights::{LightTable, table as lights},
        sharp::{has_sharp, may_be_sharp},
    };
}

use crate::{
    Error, Result,
    gpu::{Gpu, OwnedBuffer, OwnedImage},
    graph::{Graph, Runner},
    image::Layers,
    rays::Rays,
    resident::Resident,
    scene::{Aabb, Note, Pose, Scene, View},
    shaders::types,
};
use std::time::Duration;
use work::Job;

/// A path tracer for one scene on one device.
#[derive(Debug)]
pub struct Tracer<'s> {
    gpu: Gpu,
    scene: &'s Scene,
    pose: Pose,
    resident: Resident,
    rays: Rays,
    runner: Runner,
    environment: OwnedImage,
    environment_columns: OwnedBuffer,
    /// Columns and rows of the environment's importance map.
    cells: [u32; 2],
    /// Bounding box of the scene in this pose, metres.
    bounds: Aabb,
    punctual: Vec<types::Light>,
    lights: Option<Lights>,
    paths: Option<OwnedBuffer>,
    job: Option<Job>,
    /// Slots per tile, adapted to the measured time; the next picture starts with this value.
    tile: u64,
    /// A fixed number of slots per tile instead.
    fixed_tile: Option<u64>,
}

/// The light table of the chosen sources.
#[derive(Debug)]
struct Lights {
    sources: Sources,
    suns: u32,
    tree: bool,
    columns: OwnedBuffer,
    targets: OwnedBuffer,
    instances: OwnedBuffer,
    nodes: OwnedBuffer,
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
        let importance = environment::importance(scene.environment.as_ref());
        let environment_columns =
            OwnedBuffer::with_contents(gpu, "tracer.environment", bytemuck::cast_slice(&importance.columns))?;
        let mut tracer = Self {
            gpu: gpu.clone(),
            scene,
            pose: pose.clone(),
            rays: Rays::new(gpu, scene, &resident)?,
            resident,
            runner: Runner::new(gpu),
            environment: tables::radiance_map(gpu, scene.environment.as_ref())?,
            environment_columns,
            cells: importance.cells,
            bounds: Aabb::EMPTY,
            punctual: Vec::new(),
            lights: None,
            paths: None,
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
        self.lights = None;
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
        // The rasteriser's notes about glass and blending do not apply to rays.
        self.resident.notes().iter().filter(|note| note.place == "textures").cloned().collect()
    }

    /// Fixes the size of tiles to `slots` pixels instead of adapting it to the measured time. The picture does not depend on it.
    pub fn set_tile(&mut self, slots: Option<u64>) {
        self.fixed_tile = slots;
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
        self.prepare_lights(settings.sources)?;
        self.job = Some(Job::new(&self.gpu, view, settings.clone())?);
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
    /// some tens of milliseconds. The picture is valid at any stop.
    ///
    /// # Errors
    /// `Usage` before [`Self::start`]; `OutOfMemory`, `DeviceLost`, `Runtime` from the device.
    pub fn run(&mut self, samples: u64, mut go_on: impl FnMut(&Progress) -> bool) -> Result<Progress> {
        self.advance(samples, &mut go_on)
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
        self.job()?.save(&self.gpu, about)
    }

    /// Continues from a state. Call [`Self::start`] with the same view and settings first.
    ///
    /// # Errors
    /// `Input` if the state belongs to another picture; the message lists the differences.
    pub fn restore(&mut self, state: &State, about: &serde_json::Value) -> Result<()> {
        let gpu = self.gpu.clone();
        self.job_mut()?.restore(&gpu, state, about)
    }

    fn job(&self) -> Result<&Job> {
        self.job.as_ref().ok_or_else(not_started)
    }

    fn job_mut(&mut self) -> Result<&mut Job> {
        self.job.as_mut().ok_or_else(not_started)
    }

    fn prepare_lights(&mut self, sources: Sources) -> Result<()> {
        if self.lights.as_ref().is_some_and(|l| l.sources == sources) {
            return Ok(());
        }
        let table = lights::table(self.scene, &self.pose, &self.punctual, sources);
        let buffer = |name, bytes: &[u8]| OwnedBuffer::with_contents(&self.gpu, name, bytes);
        self.lights = Some(Lights {
            sources,
            suns: table.suns,
            tree: table.tree,
            columns: buffer("tracer.light columns", bytemuck::cast_slice(&table.columns))?,
            targets: buffer("tracer.light targets", bytemuck::cast_slice(&table.targets))?,
            instances: buffer("tracer.instance lights", bytemuck::cast_slice(&table.instances))?,
            nodes: buffer("tracer.light tree", bytemuck::cast_slice(&table.nodes))?,
        });
        Ok(())
    }
}

fn not_started() -> Error {
    Error::usage("no picture was started")
}

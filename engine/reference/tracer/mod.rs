//! Reference pictures: progressive path tracing on the device.
//!
//! Unbiased but for the limits on bounces: each sample of a pixel follows one path from the camera, samples a lamp, a sun and the
//! sky at each surface, and weighs what it meets by chance against that (multiple importance sampling; Veach and Guibas, 1995).
//! Random numbers are a pure function of (seed, pixel, sample, dimension), and a pixel's samples are summed in order with
//! their rounding errors, so the bits depend neither on how the work is cut nor on where it was interrupted.
//!
//! ```no_run
//! # use lucerna::{gpu::Gpu, reference::tracer::{Settings, Tracer}, scene::{Pose, Scene, View}};
//! # fn example(gpu: &Gpu, scene: &Scene) -> lucerna::Result<()> {
//! let pose = Pose::rest(scene);
//! let mut tracer = Tracer::new(gpu, scene, &pose)?; // once a scene
//! let view = View::of_camera(scene, &pose, 0, [320, 240])?;
//! let picture = tracer.render(&view, &Settings { bounces: 1, ..Default::default() }, 256)?; // any number of views
//! # Ok(())
//! # }
//! ```
//!
//! Transport: a matt base under microfacets as in `lib/brdf.glsl`; mirrors (`roughness < 0.05 && metallic > 0.5`) and glass (transmission)
//! are sharp, and light is followed through them only from the camera's side: what a point light sends through glass is
//! missing, as is what it sends off a mirror. Emission leaves the front of single-sided surfaces.

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

/// Tables that samples are drawn from, for techniques that sample the same lights, and for tests.
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
    scene::{Aabb, Note, Pose, Scene, View, resident::Resident},
    shaders::types,
};
use std::time::Duration;
use work::Job;

/// A scene on a device, ready for pictures of it.
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
    /// Of the environment's importance map.
    cells: [u32; 2],
    /// Around the scene in this pose.
    bounds: Aabb,
    punctual: Vec<types::Light>,
    lights: Option<Lights>,
    paths: Option<OwnedBuffer>,
    job: Option<Job>,
    /// Slots of a tile that took the right time, for the next picture.
    tile: u64,
    /// A fixed number of slots instead.
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

/// How far a picture is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Samples that every pixel has, with the part of the next one.
    pub samples: f64,
    /// Paths traced so far, one a sample and pixel.
    pub paths: u64,
    /// On the device in this run.
    pub time: Duration,
}

impl<'s> Tracer<'s> {
    /// Uploads the scene. It must pass its validation.
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

    /// Moves the scene. A picture that was begun is dropped.
    pub fn set_pose(&mut self, pose: &Pose) {
        self.pose = pose.clone();
        self.job = None;
        self.lights = None;
        // Declared to learn the bounds; not run.
        let handles = self.resident.frame_in(&mut Graph::new("tracer.bounds"), self.scene, &self.pose);
        self.bounds = handles.bounds();
        self.punctual = handles.moment.lights.clone();
    }

    /// Around the scene, world space.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// What of the scene is served by something simpler.
    pub fn notes(&self) -> Vec<Note> {
        // The rasteriser's notes on glass and blending do not hold for rays.
        self.resident.notes().iter().filter(|note| note.place == "textures").cloned().collect()
    }

    /// Cuts the work into tiles of `slots` pixels and samples instead of by time. The picture does not depend on it.
    pub fn set_tile(&mut self, slots: Option<u64>) {
        self.fixed_tile = slots;
    }

    /// A picture in one call: `samples` paths a pixel. See [`Sums::layers`] for what it holds.
    ///
    /// # Errors
    /// As [`Self::start`] and [`Self::run`].
    pub fn render(&mut self, view: &View, settings: &Settings, samples: u32) -> Result<Layers> {
        self.start(view, settings)?;
        self.step(samples)?;
        self.layers()
    }

    /// Begins a picture. An infinite far plane of the camera moves behind the scene.
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

    /// Adds `samples` paths to every pixel.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub fn step(&mut self, samples: u32) -> Result<()> {
        let target = self.job()?.samples_done() + u64::from(samples);
        self.run(target, |_| true).map(drop)
    }

    /// Goes on until every pixel has `samples` paths, or `go_on` says no; it is asked after every tile, some tens of
    /// milliseconds. Stopping leaves a valid picture.
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

    /// The sums behind the picture so far.
    ///
    /// # Errors
    /// As [`Self::layers`].
    pub fn sums(&self) -> Result<Sums> {
        self.job()?.sums()
    }

    /// The view of the picture as it is traced.
    ///
    /// # Errors
    /// `Usage` before [`Self::start`].
    pub fn view(&self) -> Result<View> {
        Ok(self.job()?.view)
    }

    /// How far the picture is.
    ///
    /// # Errors
    /// `Usage` before [`Self::start`].
    pub fn progress(&self) -> Result<Progress> {
        Ok(self.job()?.progress())
    }

    /// Everything needed to go on later, in another process. `about`: what else the picture depends on (scene, …).
    ///
    /// # Errors
    /// As [`Self::layers`].
    pub fn save(&self, about: &serde_json::Value) -> Result<State> {
        self.job()?.save(&self.gpu, about)
    }

    /// Goes on from a state, after [`Self::start`] with the same view and settings.
    ///
    /// # Errors
    /// `Input` if the state is of another picture, saying what differs.
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

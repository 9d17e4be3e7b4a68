//! The path tracer behind the interface of all techniques: a picture that grows with every frame.

use std::convert::Infallible;

use super::{PictureSettings, Settings, job::Job, kernel::Kernel, notes, sums::EPSILON};
use crate::{
    Error, Result,
    gpu::Gpu,
    graph::{Format, Graph, Image},
    resident::Resident,
    scene::{Pose, Scene},
    settings::{Described, Description},
    shaders::{consts, reference::resolve},
    technique::{self, Making, Moment, Picture, Technique},
};

/// The light that the picture shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    #[default]
    Total,
    Direct,
    Indirect,
    Emission,
}

impl technique::Mode for Mode {
    const ALL: &'static [Self] = &[Self::Total, Self::Direct, Self::Indirect, Self::Emission];

    fn name(self) -> &'static str {
        match self {
            Self::Total => "total",
            Self::Direct => "direct",
            Self::Indirect => "indirect",
            Self::Emission => "emission",
        }
    }

    fn doc(self) -> &'static str {
        match self {
            Self::Total => "All light",
            Self::Direct => "Light after one scattering",
            Self::Indirect => "Light after more than one scattering",
            Self::Emission => "Emitted light",
        }
    }
}

impl Mode {
    fn shows(self) -> u32 {
        match self {
            Self::Total => consts::SHOWS_TOTAL,
            Self::Direct => consts::SHOWS_DIRECT,
            Self::Indirect => consts::SHOWS_INDIRECT,
            Self::Emission => consts::SHOWS_EMISSION,
        }
    }
}

impl technique::Settings for PictureSettings {
    fn paper() -> Option<Self> {
        None
    }

    fn validate(&self) -> Result<()> {
        self.validate()
    }
}

/// The path tracer, prepared for a scene. Frames of the same pose, view and settings add samples to one picture; any change begins another.
/// [`super::Tracer`] is for single pictures: it tells its progress, stops at any time, and its state can be saved.
///
/// A frame counts as traced when it is declared, so each graph must run, and in order.
#[derive(Debug)]
pub struct Reference {
    kernel: Kernel,
    current: Option<(Pose, Job)>,
}

impl Reference {
    /// Samples of every pixel of the current picture.
    pub fn samples(&self) -> u64 {
        self.current.as_ref().map_or(0, |(_, job)| job.samples_done())
    }

    /// The job of this moment: the current one, or a new one.
    fn job(&mut self, moment: &Moment<'_, Mode>, settings: Settings) -> Result<()> {
        if self.current.as_ref().is_none_or(|(pose, _)| pose != moment.pose) {
            self.kernel.moved();
            self.current = None;
        }
        self.kernel.light(moment.scene, moment.pose, &moment.handles.moment.lights, settings.sources)?;
        if self.current.as_ref().is_none_or(|(_, job)| job.view != moment.view || job.settings != settings) {
            // The old sums are freed before the new ones are made.
            self.current = None;
            self.current = Some((moment.pose.clone(), Job::new(self.kernel.gpu(), moment.view, settings)?));
        }
        Ok(())
    }
}

impl Technique for Reference {
    const NAME: &'static str = "reference";
    const ABOUT: &'static str = "path tracing, more samples with each frame; layers emission, direct, indirect, albedo, normal, position, depth, samples, variance";

    type Settings = PictureSettings;
    type Mode = Mode;
    type Baked = Infallible;

    fn description() -> &'static Description {
        Settings::description()
    }

    fn prepared_by(_: &PictureSettings) -> PictureSettings {
        PictureSettings::default()
    }

    fn upload(gpu: &Gpu, scene: &Scene) -> Result<Resident> {
        Resident::for_rays(gpu, scene)
    }

    fn ready(making: Making<'_, Infallible>, _: &PictureSettings) -> Result<Self> {
        Ok(Self { kernel: Kernel::new(making.gpu, making.scene, making.resident)?, current: None })
    }

    fn frame(&mut self, graph: &mut Graph, moment: &Moment<'_, Mode>, settings: &PictureSettings) -> Result<Picture> {
        settings.validate()?;
        // Repetitions of an experiment have different seeds.
        let seed = settings.reference.seed.wrapping_add(graph.seed);
        self.job(moment, Settings { seed, ..settings.reference.clone() })?;
        let Some((_, job)) = &mut self.current else { return Err(super::not_started()) };
        let samples = job.samples_done() + u64::from(settings.samples);
        if samples > u64::from(u32::MAX) {
            return Err(Error::usage(format!("{samples} samples a pixel; at most {} are numbered", u32::MAX)));
        }
        let tile = job.done..samples * job.slots();
        let cut = self.kernel.cut(moment.scene, job, tile.end - tile.start)?;
        let sums_at = job.sums.address_words();
        let sums = self.kernel.declare(graph, (moment.scene, moment.handles), job, tile.clone(), cut)?;
        job.done = tile.end;
        let extent = moment.view.extent;
        let mut layer = |shows: u32| -> Image {
            let shown = graph.image("reference", Format::RGBA32F, extent);
            let push = resolve::Push { shows, samples: samples as f32, epsilon: EPSILON as f32, sums_at };
            graph.compute(resolve::Args { shown, push }, extent).reading(sums);
            shown
        };
        let picture = Picture::new(layer(moment.shot.mode.shows())).noting(notes(moment.notes));
        if !moment.shot.layers {
            return Ok(picture);
        }
        let variance = layer(consts::SHOWS_VARIANCE);
        Ok(picture
            .color("direct", layer(consts::SHOWS_DIRECT))
            .color("indirect", layer(consts::SHOWS_INDIRECT))
            .color("emission", layer(consts::SHOWS_EMISSION))
            .color("albedo", layer(consts::SHOWS_ALBEDO))
            .values("normal", &["X", "Y", "Z"], layer(consts::SHOWS_NORMAL))
            .values("position", &["X", "Y", "Z"], layer(consts::SHOWS_POSITION))
            .values("depth", &["Z"], layer(consts::SHOWS_DEPTH))
            .values("samples", &["Y"], layer(consts::SHOWS_SAMPLES))
            .values("variance", &["Y"], variance)
            .sum("relative_error", variance, 1))
    }
}

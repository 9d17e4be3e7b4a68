//! `isr`: image-space radiosity. A frame is declared by [`Renderer::compose`].

use std::process::ExitCode;

use clap::ValueEnum;
use lucerna::{
    Result,
    gpu::Gpu,
    graph::Graph,
    passes::{
        ambient::Irradiance,
        direct::{self, Lights},
        gbuffer, shadow, skybox,
    },
    scene::{Scene, resident::Resident},
    techniques::isr::{self, PictureSettings, Preset},
};

use crate::{
    args::RenderArgs,
    frame_output::FrameOutput,
    gbuffer_layers,
    outputs::Fresh,
    render::{self, Again, Input, Renderer, Technique},
};

/// Options of `isr render`.
#[derive(clap::Args, Debug)]
pub struct IsrArgs {
    #[command(flatten)]
    pub common: RenderArgs,

    /// Settings preset: fast, balanced or best; -D and --settings override it
    #[arg(long, value_name = "NAME", help_heading = "Technique", conflicts_with = "paper")]
    pub preset: Option<Preset>,

    /// What the picture shows
    #[arg(long, value_enum, default_value_t, help_heading = "Technique")]
    pub mode: Mode,
}

/// What the picture shows.
#[derive(ValueEnum, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// Direct and indirect light
    #[default]
    Isr,
    /// Direct light only; no light is gathered
    Direct,
    /// Indirect light only
    Indirect,
    /// Ambient occlusion only: 1 open, 0 occluded
    Occlusion,
}

impl Mode {
    fn name(self) -> &'static str {
        match self {
            Self::Isr => "isr",
            Self::Direct => "direct",
            Self::Indirect => "indirect",
            Self::Occlusion => "occlusion",
        }
    }
}

/// The technique in one of its modes.
#[derive(Debug)]
struct Isr(Mode);

/// Renders the frames of a command line.
///
/// # Errors
/// Any error of the run. Its kind decides the exit code.
pub fn run(args: &IsrArgs) -> Result<ExitCode> {
    let base = match args.preset {
        _ if args.common.paper => PictureSettings::paper(),
        Some(preset) => PictureSettings { isr: preset.settings(), ..PictureSettings::default() },
        None => PictureSettings::default(),
    };
    render::render(&Isr(args.mode), &args.common, &base)
}

/// Makes a picture again, in memory; `None`: interrupted.
///
/// # Errors
/// As [`render::again`].
pub fn again(asked: &Again<'_>) -> Result<Option<Fresh>> {
    render::again(&Isr(asked.mode()?), asked, &PictureSettings::default())
}

impl Renderer for Isr {
    type Settings = PictureSettings;
    type Kept = (Resident, Irradiance);

    fn technique(&self) -> Technique {
        Technique { name: "isr", mode: Some(self.0.name()), radiance: self.0 != Mode::Occlusion }
    }

    fn check(settings: &PictureSettings) -> Result<()> {
        settings.validate()
    }

    fn prepare(&self, gpu: &Gpu, scene: &Scene, _: &PictureSettings) -> Result<Self::Kept> {
        let ambient = scene.environment.as_ref().map(Irradiance::of).unwrap_or_default();
        Ok((Resident::new(gpu, scene)?, ambient))
    }

    fn compose(
        &self,
        graph: &mut Graph,
        (resident, ambient): &mut Self::Kept,
        input: &Input<'_>,
        settings: &PictureSettings,
    ) -> Result<FrameOutput> {
        let scene = resident.frame_in(graph, input.scene, input.pose);
        let view = input.view.fit_far(&scene.bounds());
        let (output, gbuffer, shadows) = if self.0 == Mode::Direct {
            let gbuffer = gbuffer::draw(graph, &scene, &view, &settings.gbuffer);
            let shadows = shadow::draw(graph, &scene, &view, &settings.shadow);
            let lit = direct::light(graph, &gbuffer, Lights::from(&shadows), &settings.isr.direct());
            skybox::draw(graph, &scene, &gbuffer, settings.background.into(), lit.direct);
            (FrameOutput::new(lit.direct), gbuffer, shadows)
        } else {
            let picture = isr::picture(graph, &scene, &view, ambient.clone(), settings)?;
            let out = picture.outputs;
            let output = match self.0 {
                Mode::Indirect => FrameOutput::new(out.indirect),
                Mode::Occlusion => FrameOutput::grey(out.occlusion),
                Mode::Isr | Mode::Direct => FrameOutput::new(out.total),
            };
            let output = output.color("direct", out.direct).color("indirect", out.indirect);
            (output.layer("occlusion", &["Y"], out.occlusion, |pixel| pixel), picture.gbuffer, picture.shadows)
        };
        let notes = [resident.notes(), &shadows.notes].concat();
        Ok(gbuffer_layers::add(output, &gbuffer, &view).seen_by(view).noting(notes))
    }
}

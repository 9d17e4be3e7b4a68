//! `igi`: instant global illumination. A frame is declared by [`Renderer::compose`].

use std::process::ExitCode;

use clap::ValueEnum;
use lucerna::{
    Result,
    gpu::Gpu,
    graph::Graph,
    scene::{Scene, resident::Resident},
    techniques::igi::{self, Igi, PictureSettings},
};

use crate::{
    args::RenderArgs,
    frame_output::FrameOutput,
    gbuffer_layers,
    outputs::Fresh,
    render::{self, Again, Input, Renderer, Technique},
};

/// Options of `igi render`.
#[derive(clap::Args, Debug)]
pub struct IgiArgs {
    #[command(flatten)]
    pub common: RenderArgs,

    /// What the picture shows
    #[arg(long, value_enum, default_value_t, help_heading = "Technique")]
    pub mode: Mode,
}

/// What the picture shows.
#[derive(ValueEnum, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// Direct and indirect light
    #[default]
    Igi,
    /// Direct light only
    Direct,
    /// Indirect light only
    Indirect,
}

impl Mode {
    fn name(self) -> &'static str {
        match self {
            Self::Igi => "igi",
            Self::Direct => "direct",
            Self::Indirect => "indirect",
        }
    }
}

/// The technique in one of its modes.
#[derive(Debug)]
struct ByLights(Mode);

/// Renders the frames of a command line.
///
/// # Errors
/// Any error of the run. Its kind decides the exit code.
pub fn run(args: &IgiArgs) -> Result<ExitCode> {
    let base = if args.common.paper { PictureSettings::paper() } else { PictureSettings::default() };
    render::render(&ByLights(args.mode), &args.common, &base)
}

/// Makes a picture again, in memory; `None`: interrupted.
///
/// # Errors
/// As [`render::again`].
pub fn again(asked: &Again<'_>) -> Result<Option<Fresh>> {
    render::again(&ByLights(asked.mode()?), asked, &PictureSettings::default())
}

impl Renderer for ByLights {
    type Settings = PictureSettings;
    type Kept = (Resident, Igi);

    fn technique(&self) -> Technique {
        Technique { name: "igi", mode: Some(self.0.name()), radiance: true }
    }

    fn check(settings: &PictureSettings) -> Result<()> {
        settings.validate()
    }

    fn prepare(&self, gpu: &Gpu, scene: &Scene, settings: &PictureSettings) -> Result<Self::Kept> {
        let resident = Resident::new(gpu, scene)?;
        let igi = Igi::new(gpu, scene, &resident, &settings.igi)?;
        Ok((resident, igi))
    }

    fn compose(
        &self,
        graph: &mut Graph,
        (resident, igi): &mut Self::Kept,
        input: &Input<'_>,
        settings: &PictureSettings,
    ) -> Result<FrameOutput> {
        let scene = resident.frame_in(graph, input.scene, input.pose);
        let view = input.view.fit_far(&scene.bounds());
        // Indirect light is not computed if no output shows it.
        let direct = self.0 == Mode::Direct && !input.layers;
        let served = PictureSettings {
            igi: igi::Settings { indirect: settings.igi.indirect && !direct, ..settings.igi.clone() },
            ..settings.clone()
        };
        let picture = igi.picture(graph, input.scene, input.pose, &scene, &view, &served)?;
        let out = picture.outputs;
        let output = match self.0 {
            Mode::Igi => FrameOutput::new(out.total),
            Mode::Direct => FrameOutput::new(out.direct),
            Mode::Indirect => FrameOutput::new(out.indirect),
        };
        let output = output.color("direct", out.direct).color("indirect", out.indirect);
        // The light in mirrors and glass.
        let output = match out.sharp {
            Some(sharp) => output.color("specular", sharp),
            None => output,
        };
        let output = match out.cache {
            Some(cache) => output.remarking(cache.list.range(0..4), move |count| cache.note(count)),
            None => output,
        };
        Ok(gbuffer_layers::add(output, &picture.gbuffer, &view).seen_by(view).noting(igi::notes(
            input.scene,
            resident.notes(),
            settings,
            input.frames,
        )))
    }
}

//! `fiv`: soft shadows under an environment from fullsphere irradiance vectors. A frame is declared by [`Renderer::compose`].

use std::{cell::Cell, path::PathBuf, process::ExitCode};

use lucerna::{
    Error, ErrorKind, Result,
    gpu::Gpu,
    graph::Graph,
    scene::{Note, Scene, resident::Resident},
    techniques::fiv::{Fiv, PictureSettings, Stored},
};

use crate::{
    args::RenderArgs,
    bake::Meter,
    fiv::decided,
    frame_output::FrameOutput,
    gbuffer_layers,
    last_stage::Staged,
    outputs::Fresh,
    progress::ProgressMode,
    render::{self, Again, Input, Renderer, Technique},
    rerun::bounds,
    signals::Interrupt,
};

/// Options of `fiv render`.
#[derive(clap::Args, Debug)]
pub struct FivArgs {
    #[command(flatten)]
    pub common: RenderArgs,

    /// File of `fiv precompute`; vectors that the file does not contain are computed
    #[arg(long, value_name = "FILE.fiv", help_heading = "Technique")]
    pub vectors: Option<PathBuf>,
}

/// The technique, with the file of precomputed vectors.
struct ByVectors<'a> {
    stored: Option<(&'a PathBuf, Stored)>,
    progress: ProgressMode,
    quiet: bool,
    interrupt: Interrupt,
    /// Whether the run was interrupted before the first frame.
    stopped: Cell<bool>,
}

/// Renders the frames of a command line.
///
/// # Errors
/// Whatever fails, with the kind that decides the exit code.
pub fn run(args: &FivArgs) -> Result<ExitCode> {
    let stored = args.vectors.as_ref().map(|file| Stored::read(file).map(|stored| (file, stored))).transpose()?;
    let mut base = PictureSettings::default();
    if let Some((_, stored)) = &stored {
        // The settings in the picture's metadata are then sufficient to render the picture again.
        base.fiv = stored.plan.settings(&base.fiv);
    }
    let technique = ByVectors {
        stored,
        progress: args.common.progress,
        quiet: args.common.talk.console().is_quiet(),
        interrupt: Interrupt::install(),
        stopped: Cell::new(false),
    };
    match render::render(&technique, &args.common, &base) {
        // Nothing was written.
        Err(_) if technique.stopped.get() => Ok(ExitCode::from(technique.interrupt.exit_code())),
        result => result,
    }
}

/// Renders a picture again in memory. `None` if interrupted. All vectors are computed, because the settings of the
/// picture determine them.
///
/// # Errors
/// As [`render::again`].
pub fn again(asked: &Again<'_>) -> Result<Option<Fresh>> {
    asked.no_mode()?;
    let base = PictureSettings::default();
    let staged = Staged::recorded(&asked.record.settings, &base, PictureSettings::validate)?;
    bounds::vectors(&staged.technique.fiv, asked.long)?;
    let technique = ByVectors {
        stored: None,
        progress: ProgressMode::default(),
        quiet: asked.console().is_quiet(),
        interrupt: asked.interrupt.clone(),
        stopped: Cell::new(false),
    };
    match render::again(&technique, asked, &base) {
        Err(_) if technique.stopped.get() => Ok(None),
        result => result,
    }
}

impl ByVectors<'_> {
    /// Adds the file of vectors to errors about it.
    fn named(&self, error: Error) -> Error {
        match &self.stored {
            Some((file, _)) if error.kind() == ErrorKind::Input => error.in_file(file),
            _ => error,
        }
    }
}

impl Renderer for ByVectors<'_> {
    type Settings = PictureSettings;
    type Kept = (Resident, Fiv, Vec<Note>);

    fn technique(&self) -> Technique {
        Technique { name: "fiv", mode: None, radiance: true }
    }

    fn check(settings: &PictureSettings) -> Result<()> {
        settings.validate()
    }

    fn prepare(&self, gpu: &Gpu, scene: &Scene, settings: &PictureSettings) -> Result<Self::Kept> {
        if let Some((file, stored)) = &self.stored {
            decided(file, stored, &settings.fiv)?;
        }
        let resident = Resident::new(gpu, scene)?;
        let mut meter = None;
        let told = |done: u64, total: u64| {
            let meter = meter.get_or_insert_with(|| Meter::new(self.progress, self.quiet, "samples", 0, total));
            meter.show(done, 0);
            self.stopped.set(self.interrupt.requested());
            !self.stopped.get()
        };
        let stored = self.stored.as_ref().map(|(_, stored)| stored);
        let fiv = Fiv::new(gpu, scene, &resident, &settings.fiv, stored, told).map_err(|error| self.named(error))?;
        let named = |note: &Note| match &self.stored {
            Some((file, _)) if note.place == "vectors" => {
                Note { place: format!("vectors {}", file.display()), ..note.clone() }
            }
            _ => note.clone(),
        };
        let notes = fiv.notes().iter().map(named).collect();
        Ok((resident, fiv, notes))
    }

    fn compose(
        &self,
        graph: &mut Graph,
        (resident, fiv, notes): &mut Self::Kept,
        input: &Input<'_>,
        settings: &PictureSettings,
    ) -> Result<FrameOutput> {
        let scene = resident.frame_in(graph, input.scene, input.pose);
        let view = input.view.fit_far(&scene.bounds());
        let settings = PictureSettings { fiv: settings.fiv.after(input.seconds), ..settings.clone() };
        let picture = fiv.picture(graph, input.scene, input.pose, &scene, &view, &settings)?;
        let shown = FrameOutput::new(picture.outputs.total).color("irradiance", picture.outputs.irradiance);
        let notes = [resident.notes(), notes, &picture.notes].concat();
        Ok(gbuffer_layers::add(shown, &picture.gbuffer, &view).seen_by(view).noting(notes))
    }
}

//! `fiv`: soft shadows under an environment from fullsphere irradiance vectors. A frame is declared in [`compose`].

use std::{cell::Cell, path::PathBuf, process::ExitCode};

use clap::{Parser, Subcommand};
use lucerna::{
    ErrorKind, Result,
    graph::Graph,
    scene::{Note, resident::Resident},
    techniques::fiv::{Fiv, PictureSettings, Stored},
};
use lucerna_samples::{
    args::RenderArgs,
    fiv::{self, EnvironmentArgs, MergeArgs, Meter, PrecomputeArgs, SteadyArgs},
    gbuffer_layers, program,
    render::{self, Input, Technique},
    shown::Shown,
    signals::Interrupt,
};

/// Soft shadows under an environment from fullsphere irradiance vectors.
#[derive(Parser, Debug)]
#[command(name = "fiv", version, max_term_width = 120)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// Compute the vectors of occluders under an environment into a file
    #[command(args_override_self = true)]
    Precompute(Box<PrecomputeArgs>),
    /// Join the parts of a file
    Merge(MergeArgs),
    /// Write a built-in environment into a file
    Environment(EnvironmentArgs),
    /// How a sequence changes from frame to frame against one by brute force, where surfaces stand still
    Steady(SteadyArgs),
    /// Render a scene into images
    #[command(args_override_self = true)]
    Render(Box<Render>),
}

#[derive(clap::Args, Debug)]
struct Render {
    #[command(flatten)]
    common: RenderArgs,

    /// Vectors of `fiv precompute`; those that it does not have are computed
    #[arg(long, value_name = "FILE.fiv", help_heading = "Technique")]
    vectors: Option<PathBuf>,
}

fn main() -> ExitCode {
    match Arguments::parse().command {
        Command::Precompute(args) => {
            let console = args.talk.console();
            program::run(console, || fiv::precompute(&args, console))
        }
        Command::Merge(args) => {
            let console = args.talk.console();
            program::run(console, || fiv::merge(&args, console))
        }
        Command::Environment(args) => {
            let console = args.talk.console();
            program::run(console, || fiv::environment(&args, console))
        }
        Command::Steady(args) => {
            let console = args.talk.console();
            program::run(console, || fiv::steady(&args, console))
        }
        Command::Render(args) => program::run(args.common.talk.console(), || run(&args)),
    }
}

fn run(args: &Render) -> Result<ExitCode> {
    let stored = args.vectors.as_ref().map(Stored::read).transpose()?;
    let by_file = |settings: &PictureSettings| match (&args.vectors, &stored) {
        (Some(file), Some(stored)) => fiv::decided(file, stored, &settings.fiv),
        _ => Ok(()),
    };
    let mut base = PictureSettings::default();
    if let Some(stored) = &stored {
        // What is written about the picture is then enough to make it again.
        base.fiv = stored.plan.settings(&base.fiv);
    }
    let technique = Technique { name: "fiv", mode: None, radiance: true };
    let quiet = args.common.talk.console().is_quiet();
    let (interrupt, stopped) = (Interrupt::install(), Cell::new(false));
    let result = render::render(
        technique,
        &args.common,
        &base,
        PictureSettings::validate,
        |gpu, scene, settings| {
            by_file(settings)?;
            let resident = Resident::new(gpu, scene)?;
            let mut meter = None;
            let told = |done: u64, total: u64| {
                let meter = meter.get_or_insert_with(|| Meter::new(args.common.progress, quiet, 0, total));
                meter.show(done);
                stopped.set(interrupt.requested());
                !stopped.get()
            };
            let fiv = Fiv::new(gpu, scene, &resident, &settings.fiv, stored.as_ref(), told);
            let fiv = fiv.map_err(|error| match &args.vectors {
                Some(file) if error.kind() == ErrorKind::Input => error.in_file(file),
                _ => error,
            })?;
            // Notes about the file name it.
            let named = |note: &Note| match &args.vectors {
                Some(file) if note.place == "vectors" => {
                    Note { place: format!("vectors {}", file.display()), ..note.clone() }
                }
                _ => note.clone(),
            };
            let notes: Vec<Note> = fiv.notes().iter().map(named).collect();
            Ok((resident, fiv, notes))
        },
        |graph, (resident, fiv, notes), input, settings| compose(graph, (resident, fiv, notes), input, settings),
    );
    match result {
        // Nothing was written.
        Err(_) if stopped.get() => Ok(ExitCode::from(interrupt.exit_code())),
        result => result,
    }
}

/// Declares one frame.
fn compose(
    graph: &mut Graph,
    (resident, fiv, notes): (&mut Resident, &mut Fiv, &[Note]),
    input: &Input<'_>,
    settings: &PictureSettings,
) -> Result<Shown> {
    let scene = resident.frame_in(graph, input.scene, input.pose);
    let view = input.view.fit_far(&scene.bounds());
    let settings = PictureSettings { fiv: settings.fiv.after(input.seconds), ..settings.clone() };
    let picture = fiv.picture(graph, input.scene, input.pose, &scene, &view, &settings)?;
    let shown = Shown::new(picture.outputs.total).color("irradiance", picture.outputs.irradiance);
    let notes = [resident.notes(), notes, &picture.notes].concat();
    Ok(gbuffer_layers::add(shown, &picture.gbuffer, &view).seen_by(view).noting(notes))
}

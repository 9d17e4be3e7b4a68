//! `render`: reads a scene, renders frames and writes images. For `lucerna rerun` it keeps the last image in memory instead.

use std::{process::ExitCode, time::Instant};

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use lucerna::{
    Error, Result,
    gpu::Gpu,
    graph::{Graph, Runner},
    image::Format,
    scene::Scene,
    technique::{self, Bake, Mode, Readback, Ready, Settings, Shot, Technique},
};

use crate::{
    args::{DeviceArgs, RenderArgs, TalkArgs},
    bake::Rate,
    config,
    console::{self, Console},
    last_stage::{LastStage, Staged},
    outputs::Fresh,
    program::{self, STOPPED_EARLY},
    progress::Frames,
    record::{BakeFile, Record},
    rerun::bounds,
    run::Run,
    settings_list,
    signals::Interrupt,
};

/// What a technique shows, for file names and metadata.
#[derive(Clone, Copy, Debug)]
pub struct Label {
    /// Name of the executable, and of the technique in file names and metadata, for example `isr`.
    pub name: &'static str,
    /// The value of `--mode`; `None` for techniques without modes.
    pub mode: Option<&'static str>,
    /// The picture is radiance, which the exposure scales. Otherwise its values are shown unscaled.
    pub radiance: bool,
    /// The exposure that suits a built-in scene does not suit the technique.
    pub own_light: bool,
}

impl Label {
    fn of<T: Technique>(mode: T::Mode) -> Self {
        let named = T::Mode::ALL.len() > 1;
        Self { name: T::NAME, mode: named.then(|| mode.name()), radiance: mode.is_radiance(), own_light: T::OWN_LIGHT }
    }
}

/// The choices of a command line besides those that all techniques have.
#[derive(Debug)]
pub struct Given<T: Technique> {
    /// The settings before the settings file and `-D` change them.
    pub base: T::Settings,
    pub mode: T::Mode,
    /// Data from the file of a bake.
    pub baked: Option<T::Baked>,
}

impl<T: Technique> Given<T> {
    /// The defaults, or the paper's settings with `--paper`.
    ///
    /// # Errors
    /// `Usage` if there are no settings of the paper.
    pub fn by(args: &RenderArgs, mode: T::Mode) -> Result<Self> {
        let base = if args.paper { paper::<T>().map_err(|e| e.at("--paper"))? } else { T::Settings::default() };
        Ok(Self { base, mode, baked: None })
    }
}

/// The paper's settings of a technique.
///
/// # Errors
/// `Usage` if there are none.
pub fn paper<T: Technique>() -> Result<T::Settings> {
    T::Settings::paper()
        .ok_or_else(|| Error::usage(format!("{} has no preset with the settings of the paper", T::NAME)))
}

/// Reads a mode from the command line.
pub fn mode<M: Mode>() -> impl TypedValueParser<Value = M> {
    let names = M::ALL.iter().map(|mode| PossibleValue::new(mode.name()).help(mode.doc()));
    PossibleValuesParser::new(names).try_map(|name| named(&name).ok_or("is not a mode"))
}

fn named<M: Mode>(name: &str) -> Option<M> {
    M::ALL.iter().copied().find(|mode| mode.name() == name)
}

/// The result of some work; `None` if the user has requested a stop meanwhile and the work failed because of it or did not.
///
/// # Errors
/// Any other failure.
pub fn unless_stopped<T>(result: Result<T>, interrupt: &Interrupt) -> Result<Option<T>> {
    match result {
        Err(error) if !interrupt.requested() || !program::by_request(&error) => Err(error),
        result => Ok(result.ok().filter(|_| !interrupt.requested())),
    }
}

/// Runs `render` for one technique.
///
/// # Errors
/// Any error of the run. Its kind decides the exit code.
pub fn render<T: Technique>(args: &RenderArgs, given: &Given<T>) -> Result<ExitCode> {
    let started = Instant::now();
    let staged = Staged::effective(&args.settings, &given.base, T::Settings::validate)?;
    if args.settings.print_config {
        console::print(settings_list::with_docs(&config::to_toml(&staged)?).trim_end())?;
        return Ok(ExitCode::SUCCESS);
    }
    let interrupt = Interrupt::install();
    let mut run = Run::new(Label::of::<T>(given.mode), args, args.talk.console(), &staged, None)?;
    run.name_bake(given.baked.as_ref().and_then(BakeFile::of));
    frames(given, args, staged, &mut run, &interrupt, started)?;
    Ok(match run.progress() {
        _ if args.list_passes => ExitCode::SUCCESS,
        (done, asked) if done == asked => ExitCode::SUCCESS,
        (0, _) => ExitCode::from(interrupt.exit_code()),
        _ => ExitCode::from(STOPPED_EARLY),
    })
}

/// A request to make a picture again.
#[derive(Debug)]
pub struct Again<'a> {
    pub record: &'a Record,
    /// Name of the camera for the picture's metadata.
    pub camera: &'a str,
    /// Format of the file.
    pub format: Format,
    pub device: &'a DeviceArgs,
    pub talk: &'a TalkArgs,
    /// The user allows work that takes hours.
    pub long: bool,
    pub interrupt: &'a Interrupt,
}

impl Again<'_> {
    pub fn console(&self) -> Console {
        self.talk.console()
    }

    /// The mode of the record.
    ///
    /// # Errors
    /// `Input` if the technique has no mode of this name.
    pub fn mode<M: Mode>(&self) -> Result<M> {
        let Some(asked) = &self.record.mode else { return Ok(M::default()) };
        if M::ALL.len() == 1 {
            return Err(Error::input(format!("{asked:?}, but this technique has no modes")).at("mode"));
        }
        named(asked).ok_or_else(|| {
            let names: Vec<&str> = M::ALL.iter().map(|mode| mode.name()).collect();
            Error::input(format!("{asked:?} is not a mode; allowed are {}", names.join(", "))).at("mode")
        })
    }
}

/// Renders the frames of a record up to the recorded frame, and returns this frame as the bytes of the file that `render` would write.
/// Writes no file, and reads only the files that the record names as scene, environment and ground objects. `None`: interrupted.
///
/// # Errors
/// Any error of rendering; `Input` for wrong values in the record.
pub fn again<T: Technique>(asked: &Again<'_>) -> Result<Option<Fresh>> {
    let mut given = Given::<T> { base: T::Settings::default(), mode: asked.mode()?, baked: None };
    let staged = Staged::recorded(&asked.record.settings, &given.base, T::Settings::validate)?;
    bounds::rays(T::NAME, T::rays(&staged.technique), asked.long)?;
    let args = asked.record.render_args(asked)?;
    given.baked = asked.record.bake.as_ref().map(BakeFile::read).transpose()?;
    if given.baked.is_none() && T::Baked::NEEDED {
        return Err(Error::input("is missing: the metadata do not name the bake of the picture").at("bake"));
    }
    let mut run = Run::new(Label::of::<T>(given.mode), &args, asked.console(), &staged, Some(asked.format))?;
    run.name_bake(asked.record.bake.clone());
    frames(&given, &args, staged, &mut run, asked.interrupt, Instant::now())?;
    Ok(run.fresh())
}

/// Prepares a technique. `None` if the user has requested a stop meanwhile.
fn ready<T: Technique>(
    gpu: &Gpu,
    scene: &Scene,
    (given, settings): (&Given<T>, &T::Settings),
    args: &RenderArgs,
    interrupt: &Interrupt,
) -> Result<Option<Ready<T>>> {
    let (mut meter, mut stopped) = (None, false);
    let quiet = args.talk.console().is_quiet();
    let mut told = |done: u64, total: u64| {
        let meter = meter.get_or_insert_with(|| Rate::new(args.progress, quiet, T::UNITS, 0, total));
        meter.show(done, 0);
        stopped = interrupt.requested();
        !stopped
    };
    match Ready::new(gpu, scene, settings, given.baked.as_ref(), &mut told) {
        Err(_) if stopped => Ok(None),
        ready => ready.map(Some),
    }
}

/// Renders the frames of a run.
fn frames<T: Technique>(
    given: &Given<T>,
    args: &RenderArgs,
    staged: Staged<T::Settings>,
    run: &mut Run<'_>,
    interrupt: &Interrupt,
    started: Instant,
) -> Result<()> {
    let console = args.talk.console();
    let loaded = started.elapsed();

    let gpu = Gpu::new(args.device.options()?)?;
    console.info(&format!("lucerna {}, {}", program::VERSION, gpu.describe()));
    let opened = started.elapsed();
    let settings = staged.technique;
    let mut last = LastStage::new(&gpu, staged.tonemap.as_ref(), run.exposure())?;
    let Some(mut ready) = ready(&gpu, &run.stage.scene, (given, &settings), args, interrupt)? else { return Ok(()) };
    let uploaded = started.elapsed();
    run.phases = vec![("load", loaded), ("device", opened - loaded), ("upload", uploaded - opened)];

    let all = run.outputs.wants_layers() || args.view.is_some() || args.dump.is_some() || args.list_passes;
    let frames = run.frames.len() as u32;
    let mut runner = Runner::new(&gpu);
    let mut progress = Frames::new(args.progress, console.is_quiet(), run.frames.len() as u64);
    'frames: for frame in run.frames.clone() {
        let late = args.time_limit.is_some_and(|limit| started.elapsed() >= limit.0);
        // The first frame is always rendered; otherwise a run with a short time limit would make no progress.
        if interrupt.requested() || (late && run.progress().0 > 0) {
            break;
        }
        let begun = Instant::now();
        let seconds = args.stage.time + f64::from(frame) / args.fps;
        let (pose, view) = run.stage.at(seconds, args.stage.size)?;
        let mut graph = Graph::new(T::NAME);
        (graph.frame, graph.seed) = (frame, args.seed);
        let shot = Shot { seconds, frames, mode: given.mode, layers: all };
        let picture = ready.frame(&mut graph, (&run.stage.scene, &pose), &view, shot, &settings);
        let Some(mut picture) = unless_stopped(picture, interrupt)? else { break };
        picture.develop(|picture| last.frame(&mut graph, picture, (1.0 / args.fps) as f32))?;
        if args.list_passes {
            console::print(graph.plan()?.list_passes().trim_end())?;
            return Ok(());
        }
        run.note(&picture.notes);
        let seen = picture.view.unwrap_or(view);
        let reading = match &args.view {
            Some(name) => Readback::view(&mut graph, name).map_err(|error| error.at("--view"))?,
            None => picture.read(&mut graph, run.outputs.wants_layers(), false),
        };
        let dump = args.dump.as_ref().map(|folder| (folder, graph.dump()));
        // Repetitions must not advance the history: the next frame follows the first run of this frame.
        let result = if args.repeat > 1 { runner.run_held(&graph) } else { runner.run(&graph) };
        // An interrupted frame is not written, unless it is complete.
        let Some(result) = unless_stopped(result, interrupt)? else { break };
        run.note(&reading.notes(&result));
        run.numbers(&reading.numbers(&result));
        let mut layers = reading.layers(&result);
        run.expose(&layers);
        layers.metadata = run.metadata(&gpu, &seen, frame)?;
        let milliseconds = begun.elapsed().as_secs_f64() * 1e3;
        let files = run.write(&layers, frame)?;
        interrupt.keep();
        for (folder, images) in dump.iter() {
            for (name, token) in images {
                run.dump(folder, frame, name, technique::raw(&result.image(*token)))?;
            }
        }
        progress.frame(frame, milliseconds, &files);
        run.done(frame, seconds, milliseconds, files, &result.report);
        for repeat in 1..args.repeat {
            if interrupt.requested() {
                break;
            }
            let begun = Instant::now();
            let mut graph = Graph::new(T::NAME);
            (graph.frame, graph.seed) = (frame, args.seed);
            let mut picture = ready.frame(&mut graph, (&run.stage.scene, &pose), &view, shot, &settings)?;
            // A time step of 0 leaves the adaptation unchanged.
            picture.develop(|picture| last.frame(&mut graph, picture, 0.0))?;
            let last = repeat + 1 == args.repeat;
            let result = if last { runner.run(&graph) } else { runner.run_held(&graph) };
            let Some(result) = unless_stopped(result, interrupt)? else { break 'frames };
            run.again(begun.elapsed().as_secs_f64() * 1e3, &result.report);
        }
    }
    run.finish(&gpu)
}

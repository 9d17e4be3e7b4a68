//! `render`: reads a scene, renders frames and writes images. For `lucerna rerun` it keeps the last image in memory instead.

use std::{process::ExitCode, time::Instant};

use clap::ValueEnum;
use lucerna::{
    Error, Result,
    gpu::Gpu,
    graph::{Graph, Runner},
    image::Format,
    scene::{Pose, Scene, View},
};
use serde::{Serialize, de::DeserializeOwned};

use crate::{
    args::{DeviceArgs, RenderArgs, TalkArgs},
    config,
    console::{self, Console},
    frame_output::{self, FrameOutput, Readback},
    last_stage::{LastStage, Staged},
    outputs::Fresh,
    program::{self, STOPPED_EARLY},
    progress::Progress,
    record::Record,
    run::Run,
    settings_list,
    signals::Interrupt,
};

/// The technique that renders.
#[derive(Clone, Copy, Debug)]
pub struct Technique {
    /// Name of the executable, and of the technique in file names and metadata, for example `isr`.
    pub name: &'static str,
    /// The value of `--mode`; `None` for the mode with all light, which file names leave out.
    pub mode: Option<&'static str>,
    /// The picture is radiance, which the exposure scales. Otherwise its values are shown unscaled.
    pub radiance: bool,
}

/// The input of a technique for a frame.
#[derive(Debug)]
pub struct Input<'a> {
    pub gpu: &'a Gpu,
    pub scene: &'a Scene,
    /// The pose at the frame's time.
    pub pose: &'a Pose,
    pub view: &'a View,
    pub frame: u32,
    /// Number of frames of the run.
    pub frames: u32,
    /// Time of the frame, seconds.
    pub seconds: f64,
    /// The run needs more than the picture: layers, other images of the graph, or the list of passes.
    pub layers: bool,
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

/// The interface of a technique for `render` and `rerun`. Only the programs use it; in the engine techniques are functions.
pub trait Renderer {
    type Settings: Serialize + DeserializeOwned + Clone;
    /// Data that lives as long as the run.
    type Kept;

    fn technique(&self) -> Technique;

    /// Checks that the settings are in their ranges. Called before any other work.
    ///
    /// # Errors
    /// `Usage`, naming the setting.
    fn check(settings: &Self::Settings) -> Result<()>;

    /// Makes the data that lives as long as the run.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`; `Input` if the technique does not support the scene.
    fn prepare(&self, gpu: &Gpu, scene: &Scene, settings: &Self::Settings) -> Result<Self::Kept>;

    /// Declares the passes of one frame.
    ///
    /// # Errors
    /// `Usage` or `Input` for settings or scenes that the technique does not support.
    fn compose(
        &self,
        graph: &mut Graph,
        kept: &mut Self::Kept,
        input: &Input<'_>,
        settings: &Self::Settings,
    ) -> Result<FrameOutput>;
}

/// Runs `render` for one technique. `base`: the settings before the settings file and `-D` change them.
///
/// # Errors
/// Any error of the run. Its kind decides the exit code.
pub fn render<R: Renderer>(renderer: &R, args: &RenderArgs, base: &R::Settings) -> Result<ExitCode> {
    let started = Instant::now();
    let staged = Staged::effective(&args.settings, base, R::check)?;
    if args.settings.print_config {
        console::print(settings_list::with_docs(&config::to_toml(&staged)?).trim_end())?;
        return Ok(ExitCode::SUCCESS);
    }
    let interrupt = Interrupt::install();
    let mut run = Run::new(renderer.technique(), args, args.talk.console(), &staged, None)?;
    frames(renderer, args, staged, &mut run, &interrupt, started)?;
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
    pub fn mode<M: ValueEnum + Default>(&self) -> Result<M> {
        let Some(asked) = &self.record.mode else { return Ok(M::default()) };
        M::from_str(asked, false).map_err(|_| {
            let names = M::value_variants().iter().filter_map(ValueEnum::to_possible_value);
            let names: Vec<String> = names.map(|value| value.get_name().to_owned()).collect();
            Error::input(format!("{asked:?} is not a mode; allowed are {}", names.join(", "))).at("mode")
        })
    }

    /// For techniques without modes.
    ///
    /// # Errors
    /// `Input` if the record has a mode.
    pub fn no_mode(&self) -> Result<()> {
        match &self.record.mode {
            None => Ok(()),
            Some(mode) => Err(Error::input(format!("{mode:?}, but this technique has no modes")).at("mode")),
        }
    }
}

/// Renders the frames of a record up to the recorded frame, and returns this frame as the bytes of the file that `render` would write.
/// Writes no file, and reads only the files that the record names as scene, environment and ground objects. `None`: interrupted.
///
/// # Errors
/// Any error of rendering; `Input` for wrong values in the record.
pub fn again<R: Renderer>(renderer: &R, asked: &Again<'_>, base: &R::Settings) -> Result<Option<Fresh>> {
    let staged = Staged::recorded(&asked.record.settings, base, R::check)?;
    let args = asked.record.render_args(asked)?;
    let mut run = Run::new(renderer.technique(), &args, asked.console(), &staged, Some(asked.format))?;
    frames(renderer, &args, staged, &mut run, asked.interrupt, Instant::now())?;
    Ok(run.fresh())
}

/// Renders the frames of a run.
fn frames<R: Renderer>(
    renderer: &R,
    args: &RenderArgs,
    staged: Staged<R::Settings>,
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
    let mut resources = renderer.prepare(&gpu, &run.stage.scene, &settings)?;
    let uploaded = started.elapsed();
    run.phases = vec![("load", loaded), ("device", opened - loaded), ("upload", uploaded - opened)];

    let all = run.outputs.wants_layers() || args.view.is_some() || args.dump.is_some() || args.list_passes;
    let (name, frames) = (renderer.technique().name, run.frames.len() as u32);
    let mut runner = Runner::new(&gpu);
    let mut progress = Progress::new(args.progress, console.is_quiet(), run.frames.len() as u64);
    'frames: for frame in run.frames.clone() {
        let late = args.time_limit.is_some_and(|limit| started.elapsed() >= limit.0);
        // The first frame is always rendered; otherwise a run with a short time limit would make no progress.
        if interrupt.requested() || (late && run.progress().0 > 0) {
            break;
        }
        let begun = Instant::now();
        let seconds = args.stage.time + f64::from(frame) / args.fps;
        let (pose, view) = run.stage.at(seconds, args.stage.size)?;
        let mut graph = Graph::new(name);
        (graph.frame, graph.seed) = (frame, args.seed);
        let input =
            Input { gpu: &gpu, scene: &run.stage.scene, pose: &pose, view: &view, frame, frames, seconds, layers: all };
        let output = renderer.compose(&mut graph, &mut resources, &input, &settings);
        let Some(mut output) = unless_stopped(output, interrupt)? else { break };
        output.develop(|picture| last.frame(&mut graph, picture, (1.0 / args.fps) as f32))?;
        if args.list_passes {
            console::print(graph.plan()?.list_passes().trim_end())?;
            return Ok(());
        }
        run.note(&output.notes);
        let seen = output.view.unwrap_or(view);
        let reading = match &args.view {
            Some(name) => Readback::view(&mut graph, name)?,
            None => output.read(&mut graph, run.outputs.wants_layers()),
        };
        let dump = args.dump.as_ref().map(|folder| (folder, graph.dump()));
        // Repetitions must not advance the history: the next frame follows the first run of this frame.
        let result = if args.repeat > 1 { runner.run_held(&graph) } else { runner.run(&graph) };
        // An interrupted frame is not written, unless it is complete.
        let Some(result) = unless_stopped(result, interrupt)? else { break };
        run.note(&reading.notes(&result));
        let mut layers = reading.layers(&result);
        run.expose(&layers);
        layers.metadata = run.metadata(&gpu, &seen, frame)?;
        let milliseconds = begun.elapsed().as_secs_f64() * 1e3;
        let files = run.write(&layers, frame)?;
        interrupt.keep();
        for (folder, images) in dump.iter() {
            for (name, token) in images {
                run.dump(folder, frame, name, frame_output::raw(&result.image(*token)))?;
            }
        }
        progress.frame(frame, milliseconds, &files);
        run.done(frame, seconds, milliseconds, files, &result.report);
        for repeat in 1..args.repeat {
            if interrupt.requested() {
                break;
            }
            let begun = Instant::now();
            let mut graph = Graph::new(name);
            (graph.frame, graph.seed) = (frame, args.seed);
            let input = Input {
                gpu: &gpu,
                scene: &run.stage.scene,
                pose: &pose,
                view: &view,
                frame,
                frames,
                seconds,
                layers: all,
            };
            let mut output = renderer.compose(&mut graph, &mut resources, &input, &settings)?;
            // A time step of 0 leaves the adaptation unchanged.
            output.develop(|picture| last.frame(&mut graph, picture, 0.0))?;
            let last = repeat + 1 == args.repeat;
            let result = if last { runner.run(&graph) } else { runner.run_held(&graph) };
            let Some(result) = unless_stopped(result, interrupt)? else { break 'frames };
            run.again(begun.elapsed().as_secs_f64() * 1e3, &result.report);
        }
    }
    progress.finish();
    run.finish(&gpu)
}

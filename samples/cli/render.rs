//! `render`: a scene in, images out, frame after frame; or the last of them in memory, for `lucerna rerun`.

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
    signals::Interrupt,
};

/// Who renders.
#[derive(Clone, Copy, Debug)]
pub struct Technique {
    /// Executable, and technique in names and metadata: `isr`.
    pub name: &'static str,
    /// What the picture consists of, as `--mode` takes it; the word for "everything" is left out of file names.
    pub mode: Option<&'static str>,
    /// The picture is radiance, which exposure scales to be seen; else it is shown as it is.
    pub radiance: bool,
}

/// A frame to be composed.
#[derive(Debug)]
pub struct Input<'a> {
    pub gpu: &'a Gpu,
    pub scene: &'a Scene,
    /// At this frame's time.
    pub pose: &'a Pose,
    pub view: &'a View,
    pub frame: u32,
    /// Frames of the run.
    pub frames: u32,
    /// Time of the frame.
    pub seconds: f64,
    /// More than the picture is looked at: its layers are written, images of the graph shown or dumped, its passes listed.
    pub layers: bool,
}

/// What work gave; `None` if it was asked to stop meanwhile, whether it ended because of that or not.
///
/// # Errors
/// Any other failure.
pub fn unless_stopped<T>(result: Result<T>, interrupt: &Interrupt) -> Result<Option<T>> {
    match result {
        Err(error) if !interrupt.requested() || !program::by_request(&error) => Err(error),
        result => Ok(result.ok().filter(|_| !interrupt.requested())),
    }
}

/// A technique as `render` and `rerun` call it. Of the programs alone: in the engine techniques are functions, not objects.
pub trait Renderer {
    type Settings: Serialize + DeserializeOwned + Clone;
    /// What lives as long as the run.
    type Kept;

    fn technique(&self) -> Technique;

    /// Whether the settings are in their ranges; asked before anything else is done.
    ///
    /// # Errors
    /// `Usage`, naming the setting.
    fn check(settings: &Self::Settings) -> Result<()>;

    /// Makes what lives as long as the run.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`; `Input` if the scene cannot be served.
    fn prepare(&self, gpu: &Gpu, scene: &Scene, settings: &Self::Settings) -> Result<Self::Kept>;

    /// Declares one frame.
    ///
    /// # Errors
    /// `Usage` or `Input` for what cannot be served.
    fn compose(
        &self,
        graph: &mut Graph,
        kept: &mut Self::Kept,
        input: &Input<'_>,
        settings: &Self::Settings,
    ) -> Result<FrameOutput>;
}

/// Runs `render` for one technique. `base` are the settings to start from.
///
/// # Errors
/// Whatever fails, with the kind that decides the exit code.
pub fn render<R: Renderer>(renderer: &R, args: &RenderArgs, base: &R::Settings) -> Result<ExitCode> {
    let started = Instant::now();
    let staged = Staged::effective(&args.settings, base, R::check)?;
    if args.settings.print_config {
        console::print(config::to_toml(&staged)?.trim_end())?;
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

/// A picture that is to be made again.
#[derive(Debug)]
pub struct Again<'a> {
    pub record: &'a Record,
    /// Name of the camera, which is written into the picture.
    pub camera: &'a str,
    /// Of the file.
    pub format: Format,
    pub device: &'a DeviceArgs,
    pub talk: &'a TalkArgs,
    /// Hours of work were asked for.
    pub long: bool,
    pub interrupt: &'a Interrupt,
}

impl Again<'_> {
    pub fn console(&self) -> Console {
        self.talk.console()
    }

    /// The mode of the record, one of those that the technique has.
    ///
    /// # Errors
    /// `Input` if there is none of this name.
    pub fn mode<M: ValueEnum + Default>(&self) -> Result<M> {
        let Some(asked) = &self.record.mode else { return Ok(M::default()) };
        M::from_str(asked, false).map_err(|_| {
            let names = M::value_variants().iter().filter_map(ValueEnum::to_possible_value);
            let names: Vec<String> = names.map(|value| value.get_name().to_owned()).collect();
            Error::input(format!("{asked:?} is no mode; allowed are {}", names.join(", "))).at("mode")
        })
    }

    /// # Errors
    /// `Input` if the record has a mode.
    pub fn no_mode(&self) -> Result<()> {
        match &self.record.mode {
            None => Ok(()),
            Some(mode) => Err(Error::input(format!("{mode:?}, but this technique has no modes")).at("mode")),
        }
    }
}

/// Renders the frames of a record up to its own, which is kept in memory as the file that `render` would write. Nothing is
/// written; of the record's words only scene and environment name files. `None`: interrupted.
///
/// # Errors
/// Whatever fails while rendering; `Input` for what the record says.
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
        // One frame there will be, or the next run would get no further.
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
        // The frame after this one builds on it once, however often it is repeated.
        let result = if args.repeat > 1 { runner.run_held(&graph) } else { runner.run(&graph) };
        // What was asked to stop is not written, unless it is all there.
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
            // No time passes, so that adaptation stays as it is.
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

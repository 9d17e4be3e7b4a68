//! `render`: a scene in, images out, frame after frame.

use std::{process::ExitCode, time::Instant};

use lucerna::{
    Result,
    gpu::Gpu,
    graph::{Graph, Runner},
    scene::{Pose, Scene, View},
};
use serde::{Serialize, de::DeserializeOwned};

use crate::{
    args::RenderArgs,
    config, console,
    last_stage::{LastStage, Staged},
    program::{self, STOPPED_EARLY},
    progress::Progress,
    run::Run,
    shown::{self, Reading, Shown},
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

/// Runs `render` for one technique.
///
/// `base` are the settings to start from; `check` says whether those in effect are in their ranges, before anything else is done; `prepare` makes what lives as long as the run; `compose` declares one frame.
///
/// # Errors
/// Whatever fails, with the kind that decides the exit code.
pub fn render<S: Serialize + DeserializeOwned + Clone, R>(
    technique: Technique,
    args: &RenderArgs,
    base: &S,
    check: impl Fn(&S) -> Result<()>,
    prepare: impl FnOnce(&Gpu, &Scene, &S) -> Result<R>,
    mut compose: impl FnMut(&mut Graph, &mut R, &Input<'_>, &S) -> Result<Shown>,
) -> Result<ExitCode> {
    let started = Instant::now();
    let console = args.talk.console();
    let staged = Staged::effective(&args.settings, base, check)?;
    if args.settings.print_config {
        console::print(config::to_toml(&staged)?.trim_end())?;
        return Ok(ExitCode::SUCCESS);
    }
    let interrupt = Interrupt::install();
    let mut run = Run::new(technique, args, console, &staged)?;
    let loaded = started.elapsed();

    let gpu = Gpu::new(args.device.options()?)?;
    console.info(&format!("lucerna {}, {}", program::VERSION, gpu.describe()));
    let opened = started.elapsed();
    let settings = staged.technique;
    let mut last = LastStage::new(&gpu, staged.tonemap.as_ref(), run.exposure())?;
    let mut resources = prepare(&gpu, &run.stage.scene, &settings)?;
    let uploaded = started.elapsed();
    run.phases = vec![("load", loaded), ("device", opened - loaded), ("upload", uploaded - opened)];

    let all = run.outputs.wants_layers() || args.view.is_some() || args.dump.is_some() || args.list_passes;
    let frames = run.frames.len() as u32;
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
        let mut graph = Graph::new(technique.name);
        (graph.frame, graph.seed) = (frame, args.seed);
        let input =
            Input { gpu: &gpu, scene: &run.stage.scene, pose: &pose, view: &view, frame, frames, seconds, layers: all };
        let shown = compose(&mut graph, &mut resources, &input, &settings);
        let Some(mut shown) = unless_stopped(shown, &interrupt)? else { break };
        shown.develop(|picture| last.frame(&mut graph, picture, (1.0 / args.fps) as f32))?;
        if args.list_passes {
            console::print(graph.plan()?.list_passes().trim_end())?;
            return Ok(ExitCode::SUCCESS);
        }
        run.note(&shown.notes);
        let seen = shown.view.unwrap_or(view);
        let reading = match &args.view {
            Some(name) => Reading::view(&mut graph, name)?,
            None => shown.read(&mut graph, run.outputs.wants_layers()),
        };
        let dump = args.dump.as_ref().map(|folder| (folder, graph.dump()));
        // The frame after this one builds on it once, however often it is repeated.
        let result = if args.repeat > 1 { runner.run_held(&graph) } else { runner.run(&graph) };
        // What was asked to stop is not written, unless it is all there.
        let Some(result) = unless_stopped(result, &interrupt)? else { break };
        run.note(&reading.notes(&result));
        let mut layers = reading.layers(&result);
        run.expose(&layers);
        layers.metadata = run.metadata(&gpu, &seen, frame)?;
        let milliseconds = begun.elapsed().as_secs_f64() * 1e3;
        let files = run.write(&layers, frame)?;
        interrupt.keep();
        for (folder, images) in dump.iter() {
            for (name, token) in images {
                run.dump(folder, frame, name, shown::raw(&result.image(*token)))?;
            }
        }
        progress.frame(frame, milliseconds, &files);
        run.done(frame, seconds, milliseconds, files, &result.report);
        for repeat in 1..args.repeat {
            if interrupt.requested() {
                break;
            }
            let begun = Instant::now();
            let mut graph = Graph::new(technique.name);
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
            let mut shown = compose(&mut graph, &mut resources, &input, &settings)?;
            // No time passes, so that adaptation stays as it is.
            shown.develop(|picture| last.frame(&mut graph, picture, 0.0))?;
            let last = repeat + 1 == args.repeat;
            let result = if last { runner.run(&graph) } else { runner.run_held(&graph) };
            let Some(result) = unless_stopped(result, &interrupt)? else { break 'frames };
            run.again(begun.elapsed().as_secs_f64() * 1e3, &result.report);
        }
    }
    progress.finish();
    run.finish(&gpu)?;
    Ok(match run.progress() {
        (done, asked) if done == asked => ExitCode::SUCCESS,
        (0, _) => ExitCode::from(interrupt.exit_code()),
        _ => ExitCode::from(STOPPED_EARLY),
    })
}

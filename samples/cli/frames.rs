//! The frames of a run of `render`, one after the other.

use std::time::Instant;

use glam::Vec2;
use lucerna::{
    Result,
    gpu::Gpu,
    graph::{Frame, Graph, Report, Runner},
    image::Layers,
    scene::{Pose, View},
    technique::{self, Picture, Readback, Ready, Shot, Technique},
};

use crate::{
    args::RenderArgs,
    bake::Rate,
    console,
    effects::Effects,
    last_stage::{self, LastStage, Staged},
    program,
    progress::Frames,
    render::{Given, unless_stopped},
    run::Run,
    screen::Screen,
    signals::Interrupt,
    smooth::Mean,
};

/// Prepares a technique. `None` if the user has requested a stop meanwhile.
fn ready<T: Technique>(
    gpu: &Gpu,
    run: &Run<'_>,
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
    match Ready::new(gpu, &run.stage.scene, settings, given.baked.as_ref(), &mut told) {
        Err(_) if stopped => Ok(None),
        ready => ready.map(Some),
    }
}

/// Renders the frames of a run. A watched run ([`Run::watched`]) whose first frame would be black ends before it writes anything.
///
/// # Errors
/// Any error of the run.
pub fn frames<T: Technique>(
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
    run.smooth_on(&gpu);
    let opened = started.elapsed();
    let settings = staged.technique;
    let effects = staged.effects.as_ref().map(Effects::new).transpose()?;
    let last = LastStage::new(&gpu, staged.tonemap.as_ref(), run.exposure())?;
    let important = last_stage::important(&run.stage.scene, staged.tonemap.as_ref())?;
    let Some(mut ready) = ready(&gpu, run, (given, &settings), args, interrupt)? else { return Ok(()) };
    ready.choose(important);
    let uploaded = started.elapsed();
    run.phases = vec![("load", loaded), ("device", opened - loaded), ("upload", uploaded - opened)];

    let screen = Screen::new(&gpu, run.curve());
    let mut work = Work { args, settings, interrupt, ready, runner: Runner::new(&gpu), effects, last, screen, gpu };
    let layers = run.outputs.wants_layers() || args.view.is_some() || args.dump.is_some() || args.list_passes;
    let mut progress = Frames::new(args.progress, console.is_quiet(), run.frames.len() as u64);
    for frame in run.frames.clone() {
        let late = args.time_limit.is_some_and(|limit| started.elapsed() >= limit.0);
        // The first frame is always rendered; otherwise a run with a short time limit would make no progress.
        if interrupt.requested() || (late && run.progress().0 > 0) {
            break;
        }
        let seconds = args.stage.time + f64::from(frame) / args.fps;
        let (pose, view) = run.stage.at(seconds, args.stage.size)?;
        let frames = run.frames.len() as u32;
        let (temporal, edges) = (run.smooth.temporal(), run.smooth.edges());
        let shot = Shot { seconds, frames, mode: given.mode, layers, temporal, edges };
        let of = OfFrame { frame, pose, view, shot };
        if args.list_passes {
            let (mut graph, mut picture) = work.declared(run, &of, run.smooth.place(frame), work.seed(run, frame))?;
            work.last.frame(&mut graph, &mut picture, work.step())?;
            return console::print(graph.plan()?.list_passes().trim_end());
        }
        let done = if run.smooth.count == 1 {
            work.single(run, &of, &mut progress)?
        } else {
            work.mean(run, &of, &mut progress)?
        };
        if done.is_none() || work.repeat(run, &of)?.is_none() {
            break;
        }
    }
    if run.dark.is_some() {
        return Ok(());
    }
    run.finish(&work.gpu)
}

/// What renders the frames.
struct Work<'a, T: Technique> {
    args: &'a RenderArgs,
    settings: T::Settings,
    interrupt: &'a Interrupt,
    ready: Ready<T>,
    runner: Runner,
    effects: Option<Effects>,
    last: LastStage,
    screen: Screen,
    gpu: Gpu,
}

/// A frame of a run.
struct OfFrame<M> {
    frame: u32,
    pose: Pose,
    view: View,
    shot: Shot<M>,
}

/// A frame that was rendered, in host memory.
struct Rendered {
    layers: Layers,
    frame: Frame,
    view: View,
}

// In all functions `None` means: the user has requested a stop, and there is no whole picture; or the picture would be black.
impl<T: Technique> Work<'_, T> {
    /// Time since the frame before, for the adaptation of the tone mapping, seconds.
    fn step(&self) -> f32 {
        (1.0 / self.args.fps) as f32
    }

    /// Declares the passes of a frame. `place`: where the pixels look, from their middles, pixels.
    fn declared(&mut self, run: &Run<'_>, of: &OfFrame<T::Mode>, place: Vec2, seed: u32) -> Result<(Graph, Picture)> {
        let mut graph = Graph::new(T::NAME);
        (graph.frame, graph.seed) = (of.frame, seed);
        let view = of.view.shifted(place);
        let mut picture = self.ready.frame(&mut graph, (&run.stage.scene, &of.pose), &view, of.shot, &self.settings)?;
        if let Some(effects) = &self.effects {
            effects.follow(&mut graph, &mut picture, of.shot.seconds)?;
        }
        Ok((graph, picture))
    }

    /// The seed of the only picture of a frame. Noise of other random numbers is averaged over time, too.
    fn seed(&self, run: &Run<'_>, frame: u32) -> u32 {
        let other = if run.smooth.temporal.is_some() { frame.wrapping_mul(0x9e37_79b9) } else { 0 };
        self.args.seed.wrapping_add(other)
    }

    /// Runs a frame and reads its picture. `held`: the history does not advance. `told` is called with the share that is done.
    fn rendered(
        &mut self,
        run: &mut Run<'_>,
        of: &OfFrame<T::Mode>,
        (mut graph, picture): (Graph, Picture),
        held: bool,
        told: &mut dyn FnMut(f64),
    ) -> Result<Option<Rendered>> {
        run.note(&picture.notes);
        let view = picture.view.unwrap_or(of.view);
        let reading = match &self.args.view {
            Some(name) => Readback::view(&mut graph, name).map_err(|error| error.at("--view"))?,
            // The mean of several pictures is developed afterwards, with the matte.
            None => {
                let wanted = run.outputs.wants_layers();
                let matte = run.smooth.count > 1 && picture.matte.is_some();
                let picture = if matte && !wanted { picture.only(&[last_stage::MATTE]) } else { picture };
                picture.read(&mut graph, wanted || matte, false)
            }
        };
        let dump = self.args.dump.as_ref().map(|folder| (folder, graph.dump()));
        let result = self.runner.run_with_progress(&graph, held, told);
        // An interrupted frame is not written, unless it is complete.
        let Some(frame) = unless_stopped(result, self.interrupt)? else { return Ok(None) };
        run.note(&reading.notes(&frame));
        run.numbers(&reading.numbers(&frame));
        for (folder, images) in dump.iter() {
            for (name, token) in images {
                run.dump(folder, of.frame, name, technique::raw(&frame.image(*token)))?;
            }
        }
        Ok(Some(Rendered { layers: reading.layers(&frame), frame, view }))
    }

    /// Renders and writes a frame.
    fn single(&mut self, run: &mut Run<'_>, of: &OfFrame<T::Mode>, progress: &mut Frames) -> Result<Option<()>> {
        let begun = Instant::now();
        let declared = self.declared(run, of, run.smooth.place(of.frame), self.seed(run, of.frame));
        let Some((mut graph, mut picture)) = unless_stopped(declared, self.interrupt)? else { return Ok(None) };
        let step = self.step();
        self.last.frame(&mut graph, &mut picture, step)?;
        // Repetitions must not advance the history: the next frame follows the first run of this frame.
        let held = self.args.repeat > 1;
        let mut told = |share: f64| progress.within(of.frame, share);
        let Some(rendered) = self.rendered(run, of, (graph, picture), held, &mut told)? else { return Ok(None) };
        let Rendered { layers, frame, view } = rendered;
        let report = frame.report.clone();
        drop(frame);
        // With --view the file has an image of the graph and no layers of a picture.
        run.name_exact(if self.args.view.is_none() { run.smooth.exact(&layers) } else { Vec::new() });
        self.write(run, of, (layers, view), begun, progress, |time| vec![(time, report)])
    }

    /// Renders the pictures of a frame whose pixels look at different places around their middles, and writes their mean.
    fn mean(&mut self, run: &mut Run<'_>, of: &OfFrame<T::Mode>, progress: &mut Frames) -> Result<Option<()>> {
        let begun = Instant::now();
        let mut mean = Mean::default();
        let mut runs = Vec::new();
        let mut view = of.view;
        // The first place is the middle. It comes last, because its picture is the history of the next frame.
        for (number, place) in run.smooth.places().into_iter().enumerate().rev() {
            let begun = Instant::now();
            // Noise of other random numbers is averaged, too.
            let seed = self.args.seed.wrapping_add((number as u32).wrapping_mul(0x9e37_79b9));
            let declared = self.declared(run, of, place, seed);
            let Some(declared) = unless_stopped(declared, self.interrupt)? else { return Ok(None) };
            let held = number > 0 || self.args.repeat > 1;
            let (before, all) = (runs.len() as f64, f64::from(run.smooth.count));
            let mut told = |share: f64| progress.within(of.frame, (before + share) / all);
            let Some(rendered) = self.rendered(run, of, declared, held, &mut told)? else { return Ok(None) };
            progress.within(of.frame, (before + 1.0) / all);
            mean.add(rendered.layers, number == 0);
            view = rendered.view;
            runs.push((begun.elapsed().as_secs_f64() * 1e3, rendered.frame.report.clone()));
        }
        let Some((mut layers, exact)) = mean.finish() else { return Ok(None) };
        run.name_exact(if run.outputs.wants_layers() { exact } else { Vec::new() });
        self.last.mean(&mut layers, self.step())?;
        self.write(run, of, (layers, view), begun, progress, |_| runs)
    }

    /// Writes a picture. `runs`: by the time since `begun`, milliseconds.
    fn write(
        &mut self,
        run: &mut Run<'_>,
        of: &OfFrame<T::Mode>,
        (mut layers, view): (Layers, View),
        begun: Instant,
        progress: &mut Frames,
        runs: impl FnOnce(f64) -> Vec<(f64, Report)>,
    ) -> Result<Option<()>> {
        if run.is_dark(&layers, &of.pose, &view) {
            return Ok(None);
        }
        run.expose(&layers);
        layers.metadata = run.metadata(&self.gpu, &view, of.frame)?;
        let shown = match run.curve() {
            Some(_) => self.screen.shown(&layers, run.exposure(), Some(self.step()))?,
            None => None,
        };
        let milliseconds = begun.elapsed().as_secs_f64() * 1e3;
        let files = run.write(&layers, shown.as_ref(), of.frame)?;
        self.interrupt.keep();
        progress.frame(of.frame, milliseconds, &files);
        run.done(of.frame, of.shot.seconds, milliseconds, files, &runs(milliseconds));
        Ok(Some(()))
    }

    /// Renders a frame again for its times.
    fn repeat(&mut self, run: &mut Run<'_>, of: &OfFrame<T::Mode>) -> Result<Option<()>> {
        for repeat in 1..self.args.repeat {
            if self.interrupt.requested() {
                return Ok(Some(()));
            }
            let begun = Instant::now();
            let (mut graph, mut picture) =
                self.declared(run, of, run.smooth.place(of.frame), self.seed(run, of.frame))?;
            // A time step of 0 leaves the adaptation unchanged.
            self.last.frame(&mut graph, &mut picture, 0.0)?;
            let last = repeat + 1 == self.args.repeat;
            let result = if last { self.runner.run(&graph) } else { self.runner.run_held(&graph) };
            let Some(result) = unless_stopped(result, self.interrupt)? else { return Ok(None) };
            run.again(begun.elapsed().as_secs_f64() * 1e3, &result.report);
        }
        Ok(Some(()))
    }
}

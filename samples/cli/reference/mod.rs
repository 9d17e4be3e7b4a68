//! `lucerna reference`: progressive path tracing of a picture.

mod checkpoint;
mod options;
mod progress_line;
mod units;

pub use options::{ReferenceArgs, Settings, Span};

use std::{path::PathBuf, process::ExitCode, time::Instant};

use lucerna::{
    Error, Result,
    gpu::{Gpu, GpuOptions},
    image::{Format, Layer, Layers, Metadata, WriteOptions},
    scene::{NoteKind, View},
    technique::Mode as _,
    techniques::tonemap::Operator,
    tracer::{Mode, Progress, Tracer},
};
use lucerna_scenes as builtin;
use serde_json::{Value, json};

use crate::{
    bake::Ended,
    config::{self, SettingsArgs},
    console::{self, Console},
    exposure,
    last_stage::{self, Staged},
    outputs::{self, Fresh, Outputs},
    pattern::{Pattern, Values},
    program::{self, STOPPED_EARLY},
    progress::ProgressMode,
    record::{Record, Source},
    render::Again,
    screen::Screen,
    setting_options::SettingOptions,
    settings_list,
    signals::Interrupt,
    stage::Stage,
};
use checkpoint::Checkpoint;
use progress_line::{Goals, ProgressLine};
use units::Bands;

/// The reason for the end of the work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum End {
    Samples,
    Error,
    Time,
    Interrupt,
}

impl End {
    fn text(self) -> &'static str {
        match self {
            Self::Samples => "samples",
            Self::Error => "error",
            Self::Time => "time",
            Self::Interrupt => "interrupt",
        }
    }

    fn is_early(self) -> bool {
        matches!(self, Self::Time | Self::Interrupt)
    }
}

/// Time for finishing the current sample after a stop, seconds. A picture with a partial sample is valid, but `lucerna rerun` cannot make it
/// again.
const FINISH: f64 = 0.5;

/// Runs the command.
///
/// # Errors
/// Any error of the run. Its kind decides the exit code.
pub fn run(args: &ReferenceArgs, console: Console) -> Result<ExitCode> {
    let staged = args.effective()?;
    if args.settings.print_config {
        console::print(settings_list::with_docs(&config::to_toml(&staged)?).trim_end())?;
        return Ok(ExitCode::SUCCESS);
    }
    let interrupt = Interrupt::install();
    picture(args, staged, console, None, &interrupt).map(|(code, _)| code)
}

/// Makes a picture again, in memory; `None`: interrupted. Writes no file and reads no checkpoint.
///
/// # Errors
/// Any error of rendering; `Input` for wrong values in the record.
pub fn again(asked: &Again<'_>) -> Result<Option<Fresh>> {
    let check = |settings: &Settings| {
        settings.validate()?;
        settings.reference.validate().map_err(|error| error.at("reference"))
    };
    let staged = Staged::recorded(&asked.record.settings, &Settings::default(), check)?;
    let args = ReferenceArgs {
        stage: asked.record.stage_args(asked.camera)?,
        output: Vec::new(),
        overwrite: false,
        show: asked.mode()?,
        json: false,
        spp: None,
        time_limit: None,
        target_error: None,
        options: SettingOptions::default(),
        resume: false,
        restart: false,
        shard: None,
        exposure: Some(asked.record.exposure),
        screen: asked.record.screen_args()?,
        settings: SettingsArgs::default(),
        device: asked.device.clone(),
        talk: asked.talk.clone(),
        progress: ProgressMode::default(),
    };
    picture(&args, staged, asked.console(), Some(asked.format), asked.interrupt).map(|(_, fresh)| fresh)
}

/// Makes the picture. With `memory` it is kept as the bytes of a file of this format, and no file is written.
fn picture(
    args: &ReferenceArgs,
    Staged { technique: settings, effects, tonemap }: Staged<Settings>,
    console: Console,
    memory: Option<Format>,
    interrupt: &Interrupt,
) -> Result<(ExitCode, Option<Fresh>)> {
    if effects.is_some() {
        return Err(Error::usage(
            "a post-processing pipeline follows isr, igi, fiv, daylight and prt; the path tracer has none",
        )
        .at("--effects"));
    }
    let begun = Instant::now();
    let curve = args.screen.curve(false, true, tonemap.is_some())?;
    let options = WriteOptions { overwrite: args.overwrite || args.resume, f32: true, ..WriteOptions::default() };
    let outputs = |options: WriteOptions| match memory {
        Some(format) => Ok(Outputs::in_memory(format, options)),
        None => Outputs::new(&args.output, 1, options),
    };
    outputs(options.clone())?;
    let stage = Stage::open(&args.stage)?;
    let mut outputs = outputs(options)?;
    if outputs.uses_stdout() && args.json {
        return Err(Error::usage("--json and an image both want standard output").help("Give the image a name"));
    }
    let names = (stage.scene.name.clone(), stage.placed.name.clone());
    let values = Values { scene: &names.0, camera: &names.1, technique: "reference", frame: 0, layer: "" };
    outputs.probe(&values, &["picture"])?;
    let files = match memory {
        Some(_) => Vec::new(),
        // Names of scenes and cameras never add a folder.
        None => outputs_of(args).map(|name| Ok(Pattern::parse(name)?.fill(&values).into())).collect::<Result<_>>()?,
    };
    let folder = Bands::folder(args, &files, console)?;
    let about = about(args, &stage);
    // A picture of bands does not touch the state of a single run.
    let beside = files.first().filter(|_| folder.is_none() && args.output.first().is_none_or(|name| name != "-"));
    let mut checkpoint = Checkpoint::new(beside.cloned(), about.clone());
    if !args.resume {
        checkpoint.probe(args.restart)?;
    }
    for note in stage.notes().iter().filter(|n| n.kind != NoteKind::Repaired) {
        console.info(&format!("note: {}: {}", note.place, note.text));
    }
    // The device does not get the stop request. The tracer stops between two tiles and keeps all results; an interrupted tile would be lost.
    let gpu = Gpu::new(GpuOptions { stop: None, ..args.device.options()? })?;
    console.info(&format!("lucerna {}, {}", program::VERSION, gpu.describe()));
    let (pose, view) = stage.at(args.stage.time, args.stage.size)?;
    // Before the work, so that an error does not cost it.
    let matte = last_stage::matte(&gpu, (&stage.scene, &pose), &view, tonemap.as_ref())?;
    let mut tracer = Tracer::new(&gpu, &stage.scene, &pose)?;
    tracer.start(&view, &settings.reference)?;
    let open = |folder: &PathBuf| Bands::open(args, folder, &tracer, &settings, &about, console);
    let bands = folder.as_ref().map(open).transpose()?;
    let mut traced = None;
    if let Some(bands) = &bands {
        let (progress, code) = match bands.compute(&mut tracer, args, begun, console, interrupt)? {
            Ended::Early(progress, code) => (progress, Some(code)),
            Ended::Shard(progress, _) => (progress, Some(ExitCode::SUCCESS)),
            Ended::Whole(progress) => (progress, None),
        };
        if let Some(code) = code {
            if args.json {
                console::print_json(&bands.report(&progress)?)?;
            }
            return Ok((code, None));
        }
        bands.join(&mut tracer)?;
        traced = Some(progress);
    }
    if args.resume && checkpoint.resume(&mut tracer)? {
        console.info(&format!("resumes after {:.0} samples per pixel", tracer.progress()?.samples));
    }

    let goals =
        Goals { samples: settings.samples, error: args.target_error, time: args.time_limit.map(|limit| limit.0) };
    let mut line = ProgressLine::new(args.progress, console.is_quiet(), goals, tracer.progress()?);
    if let Some(progress) = traced {
        line.traced(begun, progress.before);
    }
    // From now on the sums may hold hours of work, which must be saved.
    let _saving = interrupt.saving();
    let end = work(args, &settings, &mut tracer, &mut checkpoint, &mut line, interrupt)?;
    let done = tracer.progress()?;
    if done.paths == 0 && end == End::Interrupt {
        return Ok((ExitCode::from(interrupt.exit_code()), None));
    }
    let state = checkpoint.state(&tracer)?;
    let sums = state.sums();
    // The state holds the work, so it is written first, while this thread makes the picture.
    let (written, layers, saved) = std::thread::scope(|scope| {
        let saving = end.is_early().then(|| scope.spawn(|| checkpoint.write(&state)));
        line.finish(&done, sums.relative_error());
        if sums.lost() > 0 {
            console.warning(&format!("{} paths gave values that are not finite and are left out", sums.lost()));
        }
        let mut layers = sums.layers();
        show(args.show, &mut layers);
        let suits = match &stage.source {
            Source::Builtin(name) => builtin::exposure(name).map(f64::from),
            Source::File(_) | Source::Terrain => None,
        };
        let fitting = || suits.unwrap_or_else(|| exposure::fitting(&layers));
        // A normalised picture needs no automatic exposure.
        let normal = tonemap.as_ref().is_some_and(|tonemap| tonemap.normalize);
        let ev = args.exposure.unwrap_or_else(|| if normal { 0.0 } else { fitting() });
        // Tone mapping applies the exposure, so that the file must not apply it again.
        layers.layers.extend(matte);
        match &tonemap {
            Some(tonemap) => last_stage::still(&gpu, tonemap, ev, &mut layers)?,
            None => outputs.expose(ev),
        }
        // The metadata are those of a run with exactly this number of samples.
        let made = Settings { samples: done.samples.floor() as u64, ..settings.clone() };
        let made = Staged { technique: made, effects: None, tonemap };
        layers.metadata = metadata(args, &stage, &gpu, &tracer.view()?, &made, (ev, curve))?;
        let part = done.samples.fract();
        if part != 0.0 {
            layers.metadata.extra.insert("part of a sample".into(), format!("{part:.6}"));
        }
        let shown = match curve.filter(|_| outputs.wants_screen()) {
            Some(curve) => Screen::new(&gpu, Some(curve)).shown(&layers, ev, None)?,
            None => None,
        };
        let written = outputs.write(&values, &layers, shown.as_ref())?;
        let saved = saving.map(|saving| saving.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
        Ok::<_, Error>((written, layers, saved.transpose()?.unwrap_or(false)))
    })?;
    interrupt.keep();
    let files: Vec<&str> = written.iter().map(|(name, _)| name.as_str()).collect();
    if memory.is_none() {
        console.info(&format!("wrote {}", files.join(" ")));
    }
    if saved {
        console.info(&format!("stopped by {}; --resume continues", end.text()));
    }
    if !end.is_early() {
        checkpoint.remove();
        bands.map_or(Ok(()), |bands| bands.remove(console))?;
    }
    if args.json {
        console::print_json(&report(&layers, &done, &line, sums.relative_error(), end, &files))?;
    }
    let code = if end.is_early() { ExitCode::from(STOPPED_EARLY) } else { ExitCode::SUCCESS };
    Ok((code, outputs.fresh().filter(|_| !end.is_early())))
}

fn work(
    args: &ReferenceArgs,
    settings: &Settings,
    tracer: &mut Tracer<'_>,
    checkpoint: &mut Checkpoint,
    line: &mut ProgressLine,
    interrupt: &Interrupt,
) -> Result<End> {
    let started = Instant::now();
    // The next number of samples at which the error is estimated. The intervals grow, because reading the sums takes time.
    let mut look = 16.0f64.max(tracer.progress()?.samples);
    loop {
        let mut reason = None;
        let mut stopped: Option<Instant> = None;
        let save = &mut *checkpoint;
        let line = &mut *line;
        tracer.run(settings.samples, |progress: &Progress| {
            line.show(progress);
            let whole = progress.samples.fract() == 0.0;
            if reason.is_none() {
                if interrupt.requested() {
                    reason = Some(End::Interrupt);
                } else if args.time_limit.is_some_and(|limit| started.elapsed() >= limit.0) {
                    reason = Some(End::Time);
                }
            }
            if reason.is_some() {
                let since = stopped.get_or_insert_with(Instant::now);
                return !whole && since.elapsed().as_secs_f64() < FINISH;
            }
            // Leaves the loop to read the sums.
            let looks = progress.samples >= look && (args.target_error.is_some() || line.wants_error());
            !looks && !save.is_due()
        })?;
        let progress = tracer.progress()?;
        if let Some(end) = reason {
            return Ok(if progress.samples >= settings.samples as f64 { End::Samples } else { end });
        }
        if progress.samples >= settings.samples as f64 {
            return Ok(End::Samples);
        }
        if checkpoint.is_due() {
            checkpoint.write(&checkpoint.state(tracer)?)?;
        }
        if progress.samples >= look {
            let error = tracer.sums()?.relative_error();
            line.error(&progress, error);
            look = (progress.samples * 1.25).ceil();
            if args.target_error.is_some_and(|target| error <= target) {
                // Finishes the current sample, so that the picture can be made again.
                tracer.run(progress.samples.ceil() as u64, |_| !interrupt.requested())?;
                return Ok(End::Error);
            }
        }
    }
}

/// The names of the files to write.
fn outputs_of(args: &ReferenceArgs) -> impl Iterator<Item = &str> {
    let single = args.output.is_empty().then_some(outputs::SINGLE);
    args.output.iter().map(String::as_str).filter(|name| *name != "-").chain(single)
}

/// The data on which the bits of a picture depend, besides view and settings.
fn about(args: &ReferenceArgs, stage: &Stage) -> Value {
    json!({
        "scene": stage.fingerprint,
        "time": args.stage.time,
        "default_light": args.stage.default_light,
        "light": args.stage.light,
        "sun": args.stage.sun,
        "version": program::VERSION,
        "revision": program::revision(),
    })
}

fn metadata(
    args: &ReferenceArgs,
    stage: &Stage,
    gpu: &Gpu,
    view: &View,
    settings: &Staged<Settings>,
    (exposure, operator): (f64, Option<Operator>),
) -> Result<Metadata> {
    let about = gpu.describe();
    let record = Record {
        exposure,
        operator,
        seed: settings.technique.reference.seed,
        mode: (args.show != Mode::Total).then(|| args.show.name().to_owned()),
        f32: true,
        settings: config::to_value(settings)?,
        ..Record::new(&["lucerna", "reference"], &args.stage, stage)
    };
    Ok(Metadata {
        program: "lucerna reference".into(),
        version: program::VERSION.into(),
        revision: program::revision().map(str::to_owned),
        scene: stage.scene.name.clone(),
        scene_hash: stage.fingerprint.clone(),
        camera: stage.placed.name.clone(),
        technique: "reference".into(),
        seed: settings.technique.reference.seed.into(),
        device: about.device.clone(),
        driver: format!("{} {}", about.driver, about.driver_info).trim().to_owned(),
        shader_compiler: lucerna::shaders::COMPILER.to_owned(),
        config: config::to_value(&record)?,
        world_to_camera: Some(view.view_from_world.to_cols_array()),
        world_to_ndc: Some(view.clip_from_world.to_cols_array()),
        ..Metadata::default()
    })
}

fn report(layers: &Layers, done: &Progress, line: &ProgressLine, error: f64, end: End, files: &[&str]) -> Value {
    json!({
        "program": layers.metadata.program,
        "version": layers.metadata.version,
        "device": layers.metadata.device,
        "driver": layers.metadata.driver,
        "config": layers.metadata.config,
        "samples": done.samples,
        "paths": done.paths,
        "paths_per_second": line.rate(done),
        "seconds": line.seconds(),
        "device_seconds": done.time.as_secs_f64(),
        "relative_error": if error.is_finite() { json!(error) } else { Value::Null },
        "ended_by": end.text(),
        "complete": !end.is_early(),
        "files": files,
    })
}

/// Replaces the picture by the layer; the total becomes a layer.
pub(crate) fn show(mode: Mode, layers: &mut Layers) {
    if mode == Mode::Total {
        return;
    }
    let Some(chosen) = layers.layer(mode.name()).cloned() else { return };
    if let Some(picture) = layers.layers.iter_mut().find(|l| l.name.is_empty()) {
        *picture = Layer { name: String::new(), ..chosen };
    }
}

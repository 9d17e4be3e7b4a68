//! `tonemap`: tone maps HDR pictures, all on one device.

mod alpha;
mod args;
mod auto_exposure;
mod names;
mod picture;
mod recipe;

use std::{
    collections::HashSet,
    path::{Path, PathBuf},
    process::ExitCode,
    sync::mpsc,
    time::{Duration, Instant},
};

use lucerna::{
    Error, ErrorKind, Result,
    gpu::{Description, Gpu},
    image::{self, Format, Layers, WriteOptions},
    scene::Limits,
    techniques::tonemap::{Settings, Still},
};
use serde_json::{Value, json};

pub use args::{Config, TonemapArgs};
pub use recipe::{Again, again};

use alpha::Alpha;
use args::{Gamma, Metering};
use names::{Input, OutputName, PIPE};
use picture::Done;

use crate::{
    config,
    console::{self, Console},
    piped,
    program::{self, STOPPED_EARLY},
    progress::Frames,
    settings_list,
    signals::Interrupt,
};

/// Room for 16384×16384 pixels of colour and alpha.
const LIMITS: Limits = Limits {
    max_file: 8 << 30,
    max_alloc: 8 << 30,
    max_image_pixels: 1 << 28,
    max_vertices: 0,
    max_nodes: 0,
    max_depth: 0,
};

/// The configuration of a run: settings and output options.
#[derive(Clone, Debug)]
struct Making {
    metering: Metering,
    gamma: Gamma,
    alpha: Option<Alpha>,
    fps: f64,
    mask: Option<PathBuf>,
    png_bits: u8,
    jpeg_quality: u8,
    f32: bool,
    overwrite: bool,
}

impl Making {
    fn of(args: &TonemapArgs) -> Result<Self> {
        Ok(Self {
            metering: args.metering()?,
            gamma: args.gamma,
            alpha: args.alpha,
            fps: args.fps,
            mask: args.mask.clone(),
            png_bits: if args.bits == "16" { 16 } else { 8 },
            jpeg_quality: args.quality,
            f32: args.f32,
            overwrite: args.overwrite,
        })
    }
}

/// The state that all pictures of a run share.
struct Run {
    making: Making,
    console: Console,
    config: Config,
    outputs: Vec<(OutputName, Format)>,
    mask: Option<Layers>,
    /// The exposure that was measured for the current sequence, stops.
    metered: Option<f32>,
    /// Number of the previous frame.
    before: Option<u32>,
}

/// A picture, and the time of reading it.
type Loaded = (Result<Layers>, Duration);

/// A thread that writes the files of a picture.
type Writer<'scope> = std::thread::ScopedJoinHandle<'scope, Result<(Vec<String>, Duration)>>;

fn join(writer: Writer<'_>) -> Result<(Vec<String>, Duration)> {
    writer.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}

/// The results of all pictures.
struct Results {
    console: Console,
    progress: Frames,
    done: Vec<Done>,
    failed: Vec<(String, Error)>,
    /// A frame of the current sequence has failed.
    lost: bool,
}

impl Results {
    fn new(args: &TonemapArgs, console: Console, count: usize) -> Self {
        let progress = Frames::new(args.progress, console.is_quiet(), count as u64);
        Self { console, progress, done: Vec::new(), failed: Vec::new(), lost: false }
    }

    /// Records the result of a picture.
    ///
    /// # Errors
    /// Errors that concern all pictures.
    fn take(&mut self, input: &Input, result: Result<Done>) -> Result<()> {
        match result {
            Ok(done) => {
                self.progress.named(&input.name, done.milliseconds(), &done.files);
                self.done.push(done);
            }
            Err(error) if matches!(error.kind(), ErrorKind::DeviceLost | ErrorKind::OutOfMemory) => {
                return Err(error.in_file(&input.name));
            }
            Err(error) => {
                let error = error.in_file(&input.name);
                self.console.error(&error);
                self.lost = input.sequence.is_some();
                self.failed.push((input.name.clone(), error));
            }
        }
        Ok(())
    }
}

/// Tone maps all pictures.
///
/// # Errors
/// Errors that concern all pictures: usage, the device, memory. The error of a single picture is printed and decides the exit code.
pub fn run(args: &TonemapArgs, console: Console) -> Result<ExitCode> {
    let config = args.config()?;
    if args.settings.print_config {
        console::print(settings_list::with_docs(&config::to_toml(&config)?).trim_end())?;
        return Ok(ExitCode::SUCCESS);
    }
    let (inputs, notes) = names::inputs(&args.inputs, args.layer.as_deref(), args.frames.as_ref(), args.sequence)?;
    notes.iter().for_each(|note| console.warning(note));
    let making = Making::of(args)?;
    let mut run = Run { making, console, config, outputs: outputs(args)?, mask: None, metered: None, before: None };
    run.probe(&inputs)?;
    if let Some(path) = &args.mask {
        run.mask = Some(image::read(path, &LIMITS)?);
    }
    let interrupt = Interrupt::install();
    let mut results = Results::new(args, console, inputs.len());
    let about = std::thread::scope(|scope| -> Result<Description> {
        // Only the next picture is read while this one is processed, to save memory. The first picture is read while the device starts.
        let (sender, pictures) = mpsc::sync_channel::<Loaded>(0);
        let list = &inputs;
        scope.spawn(move || {
            for input in list {
                let begun = Instant::now();
                let picture = read(input);
                // The receiver is gone: the run has ended.
                if sender.send((picture, begun.elapsed())).is_err() {
                    return;
                }
            }
        });
        let gpu = Gpu::new(args.device.options()?)?;
        let about = gpu.describe().clone();
        console.info(&format!("lucerna {}, {about}", program::VERSION));
        let mut still = Still::new(&gpu, &run.config.tonemap)?;
        // The previous picture, whose files are written while this one is processed.
        let mut writing: Option<(&Input, Done, Writer<'_>)> = None;
        for input in &inputs {
            if interrupt.requested() {
                break;
            }
            let Ok((picture, reading)) = pictures.recv() else { break };
            // After a failed frame the adaptation of the sequence would be wrong, so its other frames are skipped.
            results.lost &= input.sequence == Some(false);
            if results.lost {
                continue;
            }
            let begun = Instant::now();
            let mapped = picture.and_then(|picture| {
                if input.sequence == Some(true) {
                    still.tonemap().reset()?;
                }
                run.develop(&mut still, &about, input, picture)
            });
            if let Some((before, done, writer)) = writing.take() {
                results.take(before, join(writer).map(|written| done.with(written)))?;
                interrupt.keep();
                // The failed picture may belong to another sequence.
                results.lost &= input.sequence == Some(false);
            }
            match mapped {
                Ok((mut done, unwritten)) => {
                    (done.reading, done.working) = (reading, begun.elapsed());
                    if unwritten.is_small() {
                        writing = Some((input, done, scope.spawn(move || unwritten.write())));
                    } else {
                        results.take(input, unwritten.write().map(|written| done.with(written)))?;
                        interrupt.keep();
                    }
                }
                // After a request to stop the picture counts neither as done nor as failed.
                Err(error) if interrupt.requested() && program::by_request(&error) => break,
                Err(error) => results.take(input, Err(error))?,
            }
        }
        if let Some((input, done, writer)) = writing {
            results.take(input, join(writer).map(|written| done.with(written)))?;
            interrupt.keep();
        }
        Ok(about)
    })?;
    let Results { done, failed, .. } = results;
    if args.json {
        console::print_json(&json_of(&run, &about, &done, &failed, inputs.len())?)?;
    }
    Ok(match (failed.first(), done.len()) {
        (Some((_, error)), _) => ExitCode::from(error.exit_code()),
        (None, count) if count == inputs.len() => ExitCode::SUCCESS,
        (None, 0) => ExitCode::from(interrupt.exit_code()),
        (None, _) => ExitCode::from(STOPPED_EARLY),
    })
}

fn outputs(args: &TonemapArgs) -> Result<Vec<(OutputName, Format)>> {
    let pipes = args.output.iter().filter(|name| *name == PIPE).count();
    if pipes > 1 {
        return Err(Error::usage("standard output (-) is named twice"));
    }
    if pipes == 1 && args.json {
        return Err(Error::usage("--json and a picture both want standard output").help("Give the picture a name"));
    }
    let each = args.output.iter().map(|text| {
        let name = OutputName::parse(text)?;
        let format = match text == PIPE {
            true => args.format.into(),
            false => Format::from_path(Path::new(name.text()))?,
        };
        Ok((name, format))
    });
    each.collect()
}

fn read(input: &Input) -> Result<Layers> {
    let Some(path) = &input.path else {
        return image::decode(&piped::bytes(LIMITS.max_file)?, &LIMITS);
    };
    image::read(path, &LIMITS)
}

impl Run {
    fn settings(&self) -> &Settings {
        &self.config.tonemap
    }

    /// The files of a picture, in the order of `-o`.
    fn files(&self, input: &Input) -> Vec<(String, Format)> {
        let (operator, mode) = (self.settings().operator.name(), picture::mode_name(self.settings()));
        self.outputs.iter().map(|(name, format)| (name.fill(input, operator, mode), *format)).collect()
    }

    /// Checks before the work that all files can be written, and that no two outputs have the same name.
    fn probe(&self, inputs: &[Input]) -> Result<()> {
        let read: HashSet<_> = inputs.iter().filter_map(|input| input.path.as_ref()?.canonicalize().ok()).collect();
        let mut seen = HashSet::new();
        for input in inputs {
            for (name, _) in self.files(input) {
                if name == PIPE {
                    if inputs.len() > 1 {
                        return Err(Error::usage(format!("{} pictures do not fit into standard output", inputs.len()))
                            .help("Give them names, such as -o out/"));
                    }
                    continue;
                }
                if !seen.insert(name.clone()) {
                    return Err(Error::usage(format!("output '{name}' would be written for several pictures"))
                        .help("Put {name} or {frame:04} into it, or name a folder"));
                }
                let path = Path::new(&name);
                if path.canonicalize().is_ok_and(|path| read.contains(&path)) {
                    return Err(Error::usage(format!("output '{name}' is one of the inputs")));
                }
                image::probe_output(path, self.making.overwrite)?;
            }
        }
        Ok(())
    }

    fn write_options(&self) -> WriteOptions {
        WriteOptions {
            overwrite: self.making.overwrite,
            png_bits: self.making.png_bits,
            jpeg_quality: self.making.jpeg_quality,
            gamma: self.making.gamma.0,
            f32: self.making.f32,
            keep_alpha: self.making.alpha == Some(Alpha::Keep),
            ..WriteOptions::default()
        }
    }
}

fn json_of(run: &Run, about: &Description, done: &[Done], failed: &[(String, Error)], asked: usize) -> Result<Value> {
    let failed: Vec<Value> = failed
        .iter()
        .map(|(name, error)| json!({ "input": name, "error": error.to_string(), "exit_code": error.exit_code() }))
        .collect();
    Ok(json!({
        "program": "tonemap",
        "version": program::VERSION,
        "revision": program::revision(),
        "device": about.device,
        "driver": format!("{} {}", about.driver, about.driver_info).trim(),
        "settings": config::to_value(&run.config)?,
        "mode": picture::mode_name(run.settings()),
        "pictures": done.iter().map(Done::json).collect::<Vec<_>>(),
        "failed": failed,
        "complete": done.len() == asked,
    }))
}

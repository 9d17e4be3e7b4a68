//! `render`: reads a scene, renders frames and writes images. For `lucerna rerun` it keeps the last image in memory instead.

use std::{process::ExitCode, time::Instant};

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use lucerna::{
    Error, Result,
    image::Format,
    technique::{Bake, Mode, Settings, Technique},
};

use crate::{
    args::{DeviceArgs, RenderArgs, TalkArgs},
    config,
    console::{self, Console},
    frames,
    last_stage::Staged,
    outputs::Fresh,
    program::{self, STOPPED_EARLY},
    record::{BakeFile, Record},
    relight::Tries,
    rerun::bounds,
    run::Run,
    settings_list,
    signals::Interrupt,
    stage::Stage,
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
    /// [`Technique::LAMPS`].
    pub lamps: bool,
    /// [`Technique::is_cheap`].
    pub cheap: bool,
}

impl Label {
    fn of<T: Technique>(mode: T::Mode, settings: &T::Settings) -> Self {
        let named = T::Mode::ALL.len() > 1;
        let mode_name = named.then(|| mode.name());
        let radiance = mode.is_radiance();
        Self {
            name: T::NAME,
            mode: mode_name,
            radiance,
            own_light: T::OWN_LIGHT,
            lamps: T::LAMPS,
            cheap: T::is_cheap(settings),
        }
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
    render_on(None, args, given)
}

/// Runs `render` for one technique. `stage`: the scene and the camera of `args`, if they were read already.
///
/// # Errors
/// Any error of the run. Its kind decides the exit code.
pub fn render_on<T: Technique>(mut stage: Option<Stage>, args: &RenderArgs, given: &Given<T>) -> Result<ExitCode> {
    let started = Instant::now();
    let staged = Staged::effective(&args.settings, &given.base, args.paper, T::Settings::validate)?;
    if args.settings.print_config {
        console::print(settings_list::with_docs(&config::to_toml(&staged)?).trim_end())?;
        return Ok(ExitCode::SUCCESS);
    }
    let interrupt = Interrupt::install();
    let label = Label::of::<T>(given.mode, &staged.technique);
    let all_light = given.mode == T::Mode::default() && label.radiance;
    let mut tries = Tries::new(args, all_light, T::LAMPS);
    loop {
        let args = tries.args();
        let mut run = Run::new(label, &args, args.talk.console(), &staged, None, stage.take())?;
        run.name_bake(given.baked.as_ref().and_then(BakeFile::of));
        run.watched = tries.watched();
        match tries.note() {
            Some(note) => run.note(&[note]),
            None => run.tell(),
        }
        frames::frames(given, &args, staged.clone(), &mut run, &interrupt, started)?;
        if let Some(dark) = run.dark.filter(|_| !interrupt.requested()) {
            tries.next(dark);
            continue;
        }
        return Ok(match run.progress() {
            _ if args.list_passes => ExitCode::SUCCESS,
            (done, asked) if done == asked => ExitCode::SUCCESS,
            (0, _) => ExitCode::from(interrupt.exit_code()),
            _ => ExitCode::from(STOPPED_EARLY),
        });
    }
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
    let mut run = Run::new(
        Label::of::<T>(given.mode, &staged.technique),
        &args,
        asked.console(),
        &staged,
        Some(asked.format),
        None,
    )?;
    run.name_bake(asked.record.bake.clone());
    run.tell();
    frames::frames(&given, &args, staged, &mut run, asked.interrupt, Instant::now())?;
    Ok(run.fresh())
}

//! `lucerna view`: every technique live in a window, beside the truth.
//!
//! Two threads render, one a side (`session.rs`), each on a device of its own, so that a long pass never blocks the window. The window has a third device
//! for painting. Pictures go through host memory: they are the bytes that `render` would write.

mod app;
mod bars;
mod cameras;
mod command;
mod controls;
mod fields;
mod file;
mod files;
mod fly;
mod keys;
pub mod live;
mod measured;
mod painted;
mod panel;
mod picture;
mod session;
mod side;
mod still;
mod text;
mod truth;
mod wanted;
mod watch;

use std::{path::PathBuf, process::ExitCode, sync::Arc};

use clap::builder::PossibleValuesParser;
use lucerna::{Error, ErrorKind, Result, techniques};
use lucerna_window as window;
use serde_json::Value;

use crate::{
    args::{DeviceArgs, Size, TalkArgs, finite},
    config::{self, SettingsArgs},
    console, settings_list,
    stage::StageArgs,
};
use app::{Compare, Viewer};
use measured::MapOf;
use session::Wake;
use side::Side;

/// How both sides are shown at the start.
#[derive(clap::ValueEnum, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Start {
    /// One picture
    #[default]
    One,
    /// Two pictures, and a line between them
    Split,
    /// Two pictures beside each other
    Beside,
    /// The difference of both
    Difference,
    /// A map of FLIP
    Flip,
    /// A map of the relative error
    Error,
}

impl From<Start> for Compare {
    fn from(start: Start) -> Self {
        match start {
            Start::One => Self::One,
            Start::Split => Self::Split,
            Start::Beside => Self::Beside,
            Start::Difference => Self::Difference,
            Start::Flip => Self::Map(MapOf::Flip),
            Start::Error => Self::Map(MapOf::RelativeError),
        }
    }
}

/// Options of `lucerna view`.
#[derive(clap::Args, Clone, Debug)]
#[command(mut_arg("size", |arg| arg.hide(true)))]
pub struct ViewArgs {
    #[command(flatten)]
    pub stage: StageArgs,

    /// Technique of side A [default: the one that suits the scene]
    #[arg(long, value_parser = PossibleValuesParser::new(techniques::NAMES), value_name = "NAME", help_heading = "Technique")]
    pub technique: Option<String>,

    /// File of a bake, for daylight and prt; file of `fiv precompute`, for fiv
    #[arg(long, value_name = "FILE", help_heading = "Technique", requires = "technique")]
    pub bake: Option<PathBuf>,

    /// How A and the path tracer (B) are shown at the start
    #[arg(long, value_enum, default_value_t, value_name = "HOW", help_heading = "Window")]
    pub compare: Start,

    /// Picture file for side B, instead of the path tracer: .exr, .png, .hdr, .pfm, .jpg
    #[arg(long, value_name = "FILE", help_heading = "Window")]
    pub against: Option<PathBuf>,

    /// Size of the window in points
    #[arg(long, default_value = "1280x720", value_name = "WxH", help_heading = "Window")]
    pub window: Size,

    /// Begin without bars and panel (Tab shows them)
    #[arg(long, help_heading = "Window")]
    pub bare: bool,

    /// Paths per pixel after which the path tracer stops
    #[arg(long, value_name = "N", default_value_t = side::SAMPLES, value_parser = clap::value_parser!(u64).range(1..=1 << 20), help_heading = "Picture")]
    pub spp: u64,

    /// Exposure: colours are multiplied by 2^EV [default: the one that suits the picture]
    #[arg(long, value_name = "EV", value_parser = finite, allow_negative_numbers = true, help_heading = "Picture")]
    pub exposure: Option<f64>,

    #[command(flatten)]
    pub settings: SettingsArgs,

    /// Begin with the paper's settings
    #[arg(long, help_heading = "Settings", requires = "technique")]
    pub paper: bool,

    #[command(flatten)]
    pub device: DeviceArgs,

    #[command(flatten)]
    pub talk: TalkArgs,
}

impl ViewArgs {
    /// The settings with which side A begins.
    ///
    /// # Errors
    /// As [`Self::settings`]; `Usage` without a technique.
    fn begun(&self) -> Result<Value> {
        let Some(technique) = &self.technique else {
            return Err(Error::usage("settings are those of a technique")
                .at("--print-config")
                .help("Name it with --technique"));
        };
        let mut side = Side::new("A", technique);
        side.set_paper(self.paper);
        Ok(self.settings(&side)?.unwrap_or_else(|| (*side.settings).clone()))
    }

    /// The settings of the command line over those of a side; `None` if there are none.
    ///
    /// # Errors
    /// `Usage` for settings without a technique, unknown keys and wrong values.
    fn settings(&self, side: &Side) -> Result<Option<Value>> {
        let given = !self.settings.define.is_empty() || self.settings.file.is_some();
        if !given {
            // The window applies a post-processing pipeline itself.
            return Ok(None);
        }
        if self.technique.is_none() && given {
            return Err(Error::usage("settings are those of a technique").at("-D").help("Name it with --technique"));
        }
        live::with(side.technique, &side.settings, &self.settings).map(Some)
    }
}

/// Opens the window, and ends when it closes.
///
/// # Errors
/// `NoDevice` without a display or without a device that can present; `Usage` for wrong options.
pub fn run(args: ViewArgs) -> Result<ExitCode> {
    if args.settings.print_config {
        console::print(settings_list::with_docs(&config::to_toml(&args.begun()?)?).trim_end())?;
        return Ok(ExitCode::SUCCESS);
    }
    let device = args.device.device.clone();
    let options = window::Options {
        title: "lucerna".into(),
        size: [f64::from(args.window.width), f64::from(args.window.height)],
        app_id: "lucerna".into(),
        validation: std::env::var_os("LUCERNA_VALIDATION").is_some_and(|value| value != "off"),
        // A number counts the devices that can render; the window finds its own.
        device: device.filter(|name| name.parse::<usize>().is_err() && name != "auto"),
        ..window::Options::default()
    };
    let result = window::run(options, move |waker, _| {
        let wake = Wake(Arc::new(move || waker.wake()));
        let viewer = Viewer::new(args, wake).map_err(Box::new)?;
        Ok(Box::new(viewer))
    });
    match result {
        Ok(()) => Ok(ExitCode::SUCCESS),
        Err(window::Error::App(error)) => Err(match error.downcast::<Error>() {
            Ok(error) => *error,
            Err(other) => Error::new(ErrorKind::Runtime, other.to_string()),
        }),
        Err(error @ (window::Error::NoDisplay(_) | window::Error::NoDevice(_))) => {
            Err(Error::new(ErrorKind::NoDevice, error.to_string())
                .help("`lucerna render` writes pictures into files, without a window"))
        }
        Err(error) => Err(Error::new(ErrorKind::Runtime, error.to_string())),
    }
}

impl window::App for Viewer {
    fn ui(&mut self, context: &egui::Context) {
        self.frame(context);
    }
}

//! `daylight render`: pictures of a scene at times of the day.

use std::{path::PathBuf, process::ExitCode};

use lucerna::{
    Result,
    techniques::daylight::{Baked, Daylight, Mode},
};

use crate::{
    args::RenderArgs,
    render::{self, Given},
};

/// Options of `daylight render`.
#[derive(clap::Args, Debug)]
pub struct DayArgs {
    #[command(flatten)]
    pub common: RenderArgs,

    /// File of `daylight bake`
    #[arg(long, value_name = "FILE.day", help_heading = "Technique")]
    pub bake: PathBuf,

    /// Local time of the first frame: HH:MM or HH:MM:SS [default: 12:00]
    #[arg(id = "clock", long = "time", value_name = "HH:MM", help_heading = "Technique")]
    pub time: Option<String>,

    /// Date, for a bake of several days [default: the first of the bake]
    #[arg(long, value_name = "YYYY-MM-DD", help_heading = "Technique")]
    pub date: Option<String>,

    /// Minutes from one frame of a sequence to the next [default: 5]
    #[arg(long, value_name = "MINUTES", allow_negative_numbers = true, help_heading = "Technique")]
    pub minutes: Option<f64>,

    /// What to show
    #[arg(long, value_parser = render::mode::<Mode>(), default_value = "total", help_heading = "Technique")]
    pub mode: Mode,
}

/// Renders the frames of a command line.
///
/// # Errors
/// Any error of the run. Its kind decides the exit code.
pub fn render(args: &DayArgs) -> Result<ExitCode> {
    let baked = Baked::read(&args.bake)?;
    let mut given = Given::<Daylight>::by(&args.common, args.mode)?;
    if let Some(time) = &args.time {
        given.base.daylight.time = time.clone();
    }
    if let Some(date) = &args.date {
        given.base.daylight.date = date.clone();
    }
    if let Some(minutes) = args.minutes {
        given.base.daylight.minutes = minutes;
    }
    render::render(&args.common, &Given { baked: Some(baked), ..given })
}

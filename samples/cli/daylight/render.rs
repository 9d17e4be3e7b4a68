//! `daylight render`: pictures of a scene at times of the day.

use std::{path::PathBuf, process::ExitCode};

use lucerna::{
    Error, Result,
    technique::Bake,
    techniques::daylight::{Baked, Daylight, Mode, frames},
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

    /// File of `daylight bake` or of `daylight frames`
    #[arg(long, value_name = "FILE", help_heading = "Technique")]
    pub bake: PathBuf,

    /// Read frames from disk ahead of the time of day instead of all before the first picture
    #[arg(long, help_heading = "Technique")]
    pub stream: bool,

    /// Frames in memory with --stream [default: 8]
    #[arg(long, value_name = "N", requires = "stream", value_parser = clap::value_parser!(u32).range(4..=65536), help_heading = "Technique")]
    pub ring: Option<u32>,

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
    let mut baked = Baked::read(&args.bake)?;
    if args.stream && baked.frames.is_none() {
        let error = Error::usage("only frames are streamed, and this is a compressed bake").at("--stream");
        return Err(error.in_file(&args.bake).help("Make frames with `daylight frames`, or leave --stream out"));
    }
    if let Some(frames) = &baked.frames {
        baked.stream = args.stream.then(|| args.ring.map_or(frames::DEFAULT_RING, |ring| ring as usize));
        let (step, all) = (frames.step_bytes(), u64::from(frames.steps));
        args.common.talk.console().info(&match baked.stream {
            Some(ring) => format!(
                "{all} frames of {step} bytes: at most {ring} in memory ({} bytes) and {} on the device",
                step * ring as u64,
                frames::LEAST_RING
            ),
            None => format!("{all} frames of {step} bytes: all on the device ({} bytes)", step * all),
        });
    }
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

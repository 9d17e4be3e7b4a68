//! Command line options that several programs share.

use std::{ops::Range, path::PathBuf, str::FromStr};

use clap::{ArgAction, Args};

use crate::{
    config::SettingsArgs, console::Console, progress::ProgressMode, reference::Span, screen::ScreenArgs,
    smooth::SmoothArgs, stage::StageArgs,
};

/// Options of `render`, the same for every technique.
#[derive(Args, Clone, Debug)]
pub struct RenderArgs {
    #[command(flatten)]
    pub stage: StageArgs,

    /// Image to write; may be given more than once. The extension chooses the format: .exr (all layers), .png, .jpg, .hdr, .pfm.
    /// Placeholders: {scene} {camera} {technique} {frame:04} {layer}. [default: {scene}-{camera}-{technique}.png]
    #[arg(short, long, value_name = "FILE", help_heading = "Output")]
    pub output: Vec<String>,

    /// Overwrite existing images
    #[arg(long, help_heading = "Output")]
    pub overwrite: bool,

    /// Write the colour layers of .exr files with 32 instead of 16 bits
    #[arg(long, help_heading = "Output")]
    pub f32: bool,

    /// Write this image of the render graph instead of the result (`--list-passes` names them)
    #[arg(long, value_name = "IMAGE", help_heading = "Output")]
    pub view: Option<String>,

    /// Write every image of the render graph into this folder, as .exr
    #[arg(long, value_name = "DIR", help_heading = "Output")]
    pub dump: Option<PathBuf>,

    /// Write the times of all passes of every frame to this .csv file
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub timings: Option<PathBuf>,

    /// Render every frame N times; the times are medians, the picture is the first one
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1000), help_heading = "Output")]
    pub repeat: u32,

    /// List the passes and the resources that they read and write, then stop
    #[arg(long, help_heading = "Output")]
    pub list_passes: bool,

    /// Print one JSON document about the run on stdout
    #[arg(long, help_heading = "Output")]
    pub json: bool,

    /// Render frames A to B−1 (A..=B: to B)
    #[arg(long, value_name = "A..B", help_heading = "Picture")]
    pub frames: Option<Frames>,

    /// Frames per second of a sequence
    #[arg(long, default_value_t = 30.0, value_parser = positive, help_heading = "Picture")]
    pub fps: f64,

    /// Start no further frame after this time: 90, 90s, 10m, 1h30m. The first frame is always rendered. Exit code 8 if frames are missing
    #[arg(long, value_name = "TIME", help_heading = "Picture")]
    pub time_limit: Option<Span>,

    /// Exposure: colours of .png files are multiplied by 2^EV [default: 0, or chosen from the first picture if it is very dark or bright]
    #[arg(long, value_name = "EV", value_parser = finite, allow_negative_numbers = true, help_heading = "Picture")]
    pub exposure: Option<f64>,

    #[command(flatten)]
    pub screen: ScreenArgs,

    #[command(flatten)]
    pub smooth: SmoothArgs,

    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 0, help_heading = "Picture")]
    pub seed: u32,

    #[command(flatten)]
    pub settings: SettingsArgs,

    /// Use the paper's settings as defaults
    #[arg(long, help_heading = "Settings")]
    pub paper: bool,

    #[command(flatten)]
    pub device: DeviceArgs,

    #[command(flatten)]
    pub talk: TalkArgs,

    /// How progress is shown on stderr
    #[arg(long, value_enum, default_value_t, value_name = "HOW", help_heading = "Messages")]
    pub progress: ProgressMode,
}

/// Which device to use.
#[derive(Args, Clone, Debug, Default)]
pub struct DeviceArgs {
    /// Device by index, by part of its name, or `cpu` (`lucerna devices` lists them); default: the best one
    #[arg(long, value_name = "INDEX|NAME|cpu", help_heading = "Device")]
    pub device: Option<String>,

    /// Fail if the device is not a GPU
    #[arg(long, help_heading = "Device")]
    pub require_gpu: bool,

    /// Hardware ray queries: auto (GPUs that have them), on (CPU drivers too; refuse devices without) or off (trace in compute)
    /// [default: auto]
    #[arg(long, value_name = "CHOICE", help_heading = "Device")]
    pub ray_query: Option<String>,
}

/// Options for the amount of messages.
#[derive(Args, Clone, Debug, Default)]
pub struct TalkArgs {
    /// Print more messages; may be repeated
    #[arg(short, long, action = ArgAction::Count, help_heading = "Messages")]
    pub verbose: u8,

    /// Print only warnings and errors
    #[arg(short, long, conflicts_with = "verbose", help_heading = "Messages")]
    pub quiet: bool,
}

impl TalkArgs {
    pub fn console(&self) -> Console {
        Console::new(self.quiet, self.verbose)
    }
}

/// Image size in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    pub width: u32,
    pub height: u32,
}

/// Maximum of pixels along a side of an image.
pub const MAX_SIDE: u32 = 16384;

impl Size {
    /// Width over height.
    pub fn aspect(&self) -> f32 {
        self.width as f32 / self.height as f32
    }
}

impl FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let side = |text: &str| text.parse().ok().filter(|side| (1..=MAX_SIDE).contains(side));
        text.split_once(['x', 'X', '×'])
            .and_then(|(width, height)| Some(Self { width: side(width)?, height: side(height)? }))
            .ok_or_else(|| format!("expected WIDTHxHEIGHT, each from 1 to {MAX_SIDE}, for example 800x600"))
    }
}

impl std::fmt::Display for Size {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}x{}", self.width, self.height)
    }
}

/// Frame numbers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frames(pub Range<u32>);

/// Maximum of frames per run.
pub const MAX_FRAMES: u32 = 1_000_000;

impl Frames {
    /// The frames of `--frames`, or only frame 0.
    pub fn of(asked: Option<&Self>) -> Range<u32> {
        asked.map_or(0..1, |frames| frames.0.clone())
    }
}

impl FromStr for Frames {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parse = || {
            let (start, end) = text.split_once("..")?;
            let start = start.parse().ok()?;
            let end = match end.strip_prefix('=') {
                Some(last) => last.parse::<u32>().ok()?.checked_add(1)?,
                None => end.parse().ok()?,
            };
            (start < end && end - start <= MAX_FRAMES).then_some(Self(start..end))
        };
        parse().ok_or_else(|| format!("expected A..B (or A..=B) with A < B and at most {MAX_FRAMES} frames"))
    }
}

pub(crate) fn finite(text: &str) -> Result<f64, String> {
    text.parse::<f64>().ok().filter(|x| x.is_finite()).ok_or_else(|| "expected a finite number".into())
}

pub(crate) fn positive(text: &str) -> Result<f64, String> {
    finite(text).ok().filter(|x| *x > 0.0).ok_or_else(|| "expected a number above zero".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes() {
        assert_eq!("800x600".parse(), Ok(Size { width: 800, height: 600 }));
        for bad in ["800", "0x5", "5x0", "x", "-1x5", "99999x5", "5x5x5", "4294967297x4"] {
            assert!(bad.parse::<Size>().is_err(), "{bad}");
        }
    }

    #[test]
    fn frame_ranges() {
        assert_eq!("2..5".parse(), Ok(Frames(2..5)));
        assert_eq!("2..=5".parse(), Ok(Frames(2..6)));
        for bad in ["5", "5..2", "3..3", "..", "-1..3", "0..4294967295", "0..=4294967295"] {
            assert!(bad.parse::<Frames>().is_err(), "{bad}");
        }
    }

    #[test]
    fn numbers() {
        assert!(finite("nan").is_err() && finite("inf").is_err() && finite("-2.5") == Ok(-2.5));
        assert!(positive("0").is_err() && positive("24") == Ok(24.0));
    }
}

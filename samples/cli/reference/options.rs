//! The command line of `lucerna reference`.

use std::{str::FromStr, time::Duration};

use lucerna::{Error, Result, bake::Shard, tracer};
use serde::{Deserialize, Serialize};

use crate::{
    args::{DeviceArgs, TalkArgs, finite, positive},
    bake,
    config::SettingsArgs,
    last_stage::Staged,
    progress::ProgressMode,
    render,
    screen::ScreenArgs,
    setting_options::SettingOptions,
    stage::StageArgs,
};

/// Options of `lucerna reference`.
#[derive(clap::Args, Clone, Debug)]
pub struct ReferenceArgs {
    #[command(flatten)]
    pub stage: StageArgs,

    /// Image to write; may be given more than once: .exr (all layers), .png, .jpg, .hdr, .pfm. Placeholders: {scene} {camera} {layer}
    #[arg(short, long, value_name = "FILE", help_heading = "Output")]
    pub output: Vec<String>,

    /// Overwrite existing images
    #[arg(long, help_heading = "Output")]
    pub overwrite: bool,

    /// The layer that the picture shows; .exr files also have the other layers
    #[arg(long, alias = "mode", value_parser = render::mode::<tracer::Mode>(), default_value = "total", value_name = "LAYER", help_heading = "Output")]
    pub show: tracer::Mode,

    /// Print one JSON document about the run on stdout
    #[arg(long, help_heading = "Output")]
    pub json: bool,

    /// Paths per pixel [default: 256]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=u64::from(u32::MAX)), help_heading = "Quality")]
    pub spp: Option<u64>,

    /// Stop after this time with the samples so far: 90, 90s, 10m, 1h30m; exit code 8. With --shard without a picture: finished bands are kept
    #[arg(long, value_name = "TIME", help_heading = "Quality")]
    pub time_limit: Option<Span>,

    /// Stop when the estimated relative mean squared error of luminance is at most this value, for example 0.01
    #[arg(long, value_name = "X", value_parser = positive, help_heading = "Quality")]
    pub target_error: Option<f64>,

    /// Continue from the state that a run with the same options has left next to the image
    #[arg(long, help_heading = "Quality")]
    pub resume: bool,

    /// Start from the beginning, even if a stopped run has left a state or bands next to the image; with --shard only its own bands are dropped
    #[arg(long, conflicts_with = "resume", help_heading = "Quality")]
    pub restart: bool,

    /// Trace only the bands of part I of N of the picture, for several machines; -o names the picture. `auto`: the part of this task in an array
    /// job of Slurm, Grid Engine or Kubernetes; `auto/N`: of N parts. The bands lie in a folder beside the first file of -o. The same command
    /// without --shard joins them
    #[arg(long, value_name = "I/N|auto", value_parser = bake::shard, conflicts_with_all = ["target_error", "resume"], help_heading = "Quality")]
    pub shard: Option<Shard>,

    /// Exposure: colours of .png files are multiplied by 2^EV [default: 0, or chosen from the picture if it is very dark or bright]
    #[arg(long, value_name = "EV", value_parser = finite, allow_negative_numbers = true, help_heading = "Picture")]
    pub exposure: Option<f64>,

    #[command(flatten)]
    pub screen: ScreenArgs,

    /// The options that are settings: --bounces, --seed.
    #[command(flatten)]
    pub options: SettingOptions<tracer::Settings>,

    #[command(flatten)]
    pub settings: SettingsArgs,

    #[command(flatten)]
    pub device: DeviceArgs,

    #[command(flatten)]
    pub talk: TalkArgs,

    /// How progress is shown on stderr
    #[arg(long, value_enum, default_value_t, value_name = "HOW", help_heading = "Messages")]
    pub progress: ProgressMode,
}

/// The settings for files and `-D`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// Paths per pixel.
    pub samples: u64,
    pub reference: tracer::Settings,
}

impl Default for Settings {
    fn default() -> Self {
        Self { samples: 256, reference: tracer::Settings::default() }
    }
}

impl Settings {
    /// # Errors
    /// `Usage` if the number of samples is 0 or above 2³² − 1.
    pub fn validate(&self) -> Result<()> {
        match self.samples {
            1..=MOST_SAMPLES => Ok(()),
            other => Err(Error::usage(format!("{other}; allowed are 1 to {MOST_SAMPLES}")).at("samples")),
        }
    }
}

/// Maximum of samples per pixel.
const MOST_SAMPLES: u64 = u32::MAX as u64;

impl ReferenceArgs {
    /// The settings in effect: defaults, file, `-D`, then the options with their own names.
    ///
    /// # Errors
    /// `Usage` or `Input`, naming the key.
    pub fn effective(&self) -> Result<Staged<Settings>> {
        let mut args = self.settings.clone();
        args.define.extend(self.options.defines("reference"));
        args.define.extend(self.spp.map(|samples| format!("samples={samples}")));
        Staged::effective(&args, &Settings::default(), false, |settings: &Settings| {
            settings.validate()?;
            settings.reference.validate().map_err(|error| error.at("reference"))
        })
    }
}

/// A time span such as `90s` or `1h30m`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span(pub Duration);

impl FromStr for Span {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("{text:?} is no time; expected for example 90s, 10m or 1h30m");
        let (mut total, mut digits) = (0.0, String::new());
        for c in text.chars() {
            let unit = match c {
                'h' => 3600.0,
                'm' => 60.0,
                's' => 1.0,
                c if c.is_ascii_digit() || c == '.' => {
                    digits.push(c);
                    continue;
                }
                _ => return Err(wrong()),
            };
            total += std::mem::take(&mut digits).parse::<f64>().map_err(|_| wrong())? * unit;
        }
        if !digits.is_empty() {
            total += digits.parse::<f64>().map_err(|_| wrong())?;
        }
        match Duration::try_from_secs_f64(total) {
            Ok(span) if total > 0.0 => Ok(Self(span)),
            _ => Err(wrong()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times() {
        for (text, seconds) in [("90", 90.0), ("1.5s", 1.5), ("10m", 600.0), ("1h30m", 5400.0), ("2m5", 125.0)] {
            assert_eq!(text.parse::<Span>().unwrap().0.as_secs_f64(), seconds, "{text}");
        }
        for text in ["", "0", "-3s", "m", "1d", "1e999", "nan", "5.5.5s"] {
            assert!(text.parse::<Span>().is_err(), "{text}");
        }
    }
}

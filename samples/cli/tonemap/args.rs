//! The command line of `tonemap`.

use std::{path::PathBuf, str::FromStr};

use clap::{Args, ValueEnum, builder::PossibleValuesParser};
use lucerna::{
    Error, Result,
    image::Format,
    techniques::tonemap::{Mode, Settings},
};
use serde::{Deserialize, Serialize};

use crate::{
    args::{DeviceArgs, Frames, TalkArgs, positive},
    config::{self, SettingsArgs},
    progress::ProgressMode,
    setting_options::SettingOptions,
};

use super::alpha::Alpha;

const LOOK: &str = "Look";
const OUTPUT: &str = "Output";
const INPUT: &str = "Input";
const WORK: &str = "Local and selective operators";

/// The arguments of `tonemap`.
#[derive(Args, Clone, Debug)]
#[command(after_help = HELP)]
pub struct TonemapArgs {
    /// Pictures: .exr .hdr .pfm (or .png .jpg); FILE:LAYER takes a layer of an EXR file; `-` is standard input;
    /// shot-####.exr or shot-%04d.exr is a numbered sequence
    #[arg(required = true, value_name = "IN")]
    pub inputs: Vec<String>,

    /// File to write; may be given more than once. The extension chooses the format: .png .jpg for screens, .exr .hdr .pfm for further work
    /// (linear). In a folder the file is NAME.png. `-` is standard output. Placeholders: {name} {frame:04} {operator} {mode}
    #[arg(short, long, value_name = "OUT", required_unless_present = "print_config", help_heading = OUTPUT)]
    pub output: Vec<String>,

    /// Brightness in stops: +1 is twice as much light; auto measures the picture (auto+0.5: half a stop more), of a sequence its first frame;
    /// 0 takes the values as they are [default: auto; ashikhmin: by the luminance of white if an EXR file states it]
    #[arg(long, value_name = "EV|auto", allow_hyphen_values = true, help_heading = LOOK)]
    pub exposure: Option<Exposure>,

    /// Encoding of light in .png and .jpg files: the sRGB curve of nearly all screens, or a power
    #[arg(long, value_name = "G|srgb", default_value = "srgb", help_heading = LOOK)]
    pub gamma: Gamma,

    /// Alpha of the picture: keep it; drop it and show all light, over black; or over:COLOUR (over:white, over:#336699) [default: keep, but
    /// not in .png files where alpha would hide more than a hundredth of the light]
    #[arg(long, value_name = "CHOICE", help_heading = LOOK)]
    pub alpha: Option<Alpha>,

    /// Use the papers' settings as defaults: light as it is in the file (--exposure 0), colours that keep their ratios, no limit of contrast,
    /// the thesis' threshold
    #[arg(long, help_heading = "Settings")]
    pub paper: bool,

    /// The options that are settings, such as --operator.
    #[command(flatten)]
    pub options: SettingOptions<Settings>,

    /// selective: a picture of the same size; pixels with red above one half count as detail
    #[arg(long, value_name = "FILE", help_heading = WORK)]
    pub mask: Option<PathBuf>,

    /// Layer of EXR files that do not name their own
    #[arg(long, value_name = "NAME", help_heading = INPUT)]
    pub layer: Option<String>,

    /// All inputs are frames of one sequence, in this order
    #[arg(long, help_heading = INPUT)]
    pub sequence: bool,

    /// Frames A to B−1 of numbered sequences (A..=B: to B) [default: all existing frames]
    #[arg(long, value_name = "A..B", help_heading = INPUT)]
    pub frames: Option<Frames>,

    /// Frames per second of sequences, for the eye's adaptation
    #[arg(long, value_name = "N", default_value_t = 25.0, value_parser = positive, help_heading = INPUT)]
    pub fps: f64,

    /// Bits of each channel of .png files
    #[arg(long, value_name = "N", default_value = "8", value_parser = PossibleValuesParser::new(["8", "16"]), help_heading = OUTPUT)]
    pub bits: String,

    /// Quality of .jpg files, 1 (small) to 100 (fine)
    #[arg(long, value_name = "Q", default_value_t = 92, value_parser = clap::value_parser!(u8).range(1..=100), help_heading = OUTPUT)]
    pub quality: u8,

    /// Format of standard output
    #[arg(long, value_enum, value_name = "FORMAT", default_value = "png", help_heading = OUTPUT)]
    pub format: FormatName,

    /// Write .exr files with 32 instead of 16 bits
    #[arg(long, help_heading = OUTPUT)]
    pub f32: bool,

    /// Overwrite existing files
    #[arg(long, help_heading = OUTPUT)]
    pub overwrite: bool,

    /// Print one JSON document about all pictures on standard output
    #[arg(long, help_heading = OUTPUT)]
    pub json: bool,

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

const HELP: &str = "\
Operators:
  ashikhmin        (default) keeps the contrast that the eye would see in the scene
  reinhard         photographic dodging and burning; needs no exposure
  bilateral        compresses large areas and keeps fine detail; needs no exposure
  drago            one logarithmic curve for pictures of any range; needs no exposure
  reinhard-devlin  the response of the eye's receptors, colour by colour; chromatic takes a colour cast away
  fattal           compresses strong gradients and keeps weak ones: shows all detail; needs no exposure
  mantiuk          compresses contrasts by how visible they are; needs no exposure
  linear           exposure only; clips values above white
  reinhard-global  a soft shoulder: does not clip lights below --white
  aces, agx        film-like curves of games and films
  neutral          Khronos PBR Neutral: does not change the colours of products

Colour: pictures are converted to linear Rec. 709 by their metadata (EXR chromaticities, XYZ, luminance with chroma; PRIMARIES and XYZE \
of .hdr; sRGB or gAMA of .png; .jpg is sRGB). Without metadata they are taken as Rec. 709. Colours outside of Rec. 709 become negative, \
and --bad-values applies to them. White is not adapted. .png and .jpg are written in sRGB, .exr .hdr .pfm as linear light relative to \
the screen's white. .png and .exr keep alpha (--alpha); .jpg shows the picture over black.

Exit codes: 0 all done; 2 wrong usage; 3 a picture cannot be read; 1 a file cannot be written; 4 no device; 5 out of memory; 6 device \
lost; 8 stopped early, with complete files; 130 stopped before any file was written. After a failed picture the other pictures are \
still processed; the first failure decides the code.

Examples:
  tonemap church.hdr -o church.png
  tonemap church.hdr -o church.jpg --exposure auto+1 --quality 95
  tonemap photos/*.exr -o developed/               a folder, one device for all
  tonemap shot-####.exr -o out-####.png --fps 24   a sequence: the eye adapts from frame to frame
  isr render room.gltf -o - | tonemap - -o a.png   in a pipe
  tonemap a.exr -o a.png -D tonemap.radius=6       any setting; --print-config shows all settings";

/// Settings in files and after `-D`, with the keys `tonemap.key`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    pub tonemap: Settings,
}

/// `--format`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum FormatName {
    Png,
    Jpg,
    Exr,
    Hdr,
    Pfm,
}

impl From<FormatName> for Format {
    fn from(name: FormatName) -> Self {
        match name {
            FormatName::Png => Self::Png,
            FormatName::Jpg => Self::Jpeg,
            FormatName::Exr => Self::Exr,
            FormatName::Hdr => Self::Hdr,
            FormatName::Pfm => Self::Pfm,
        }
    }
}

/// `--exposure`: stops; with `auto` they are added to the measured exposure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposure {
    pub auto: bool,
    pub stops: f32,
}

impl FromStr for Exposure {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (auto, rest) = match text.strip_prefix("auto") {
            Some("") => return Ok(Self { auto: true, stops: 0.0 }),
            Some(rest) if rest.starts_with(['+', '-']) => (true, rest),
            Some(_) => return Err("expected auto, auto+EV or auto-EV".into()),
            None => (false, text),
        };
        let stops = rest.parse::<f32>().ok().filter(|stops| stops.is_finite());
        Ok(Self { auto, stops: stops.ok_or("expected stops such as -1.5, or auto")? })
    }
}

/// How the exposure of a picture is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Metering {
    /// It is that of the settings.
    None,
    /// It is measured, and that of the settings is added.
    Auto,
    /// From the luminance of white that the file states, if the operator works in cd/m²; else measured.
    ByFile,
}

/// `--gamma`: `None` is the sRGB curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gamma(pub Option<f32>);

impl FromStr for Gamma {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "srgb" {
            return Ok(Self(None));
        }
        let gamma = text.parse::<f32>().ok().filter(|gamma| (0.1..=10.0).contains(gamma));
        gamma.map(|gamma| Self(Some(gamma))).ok_or_else(|| "expected srgb, or a number from 0.1 to 10".into())
    }
}

impl TonemapArgs {
    /// How the exposure of a picture is found.
    ///
    /// # Errors
    /// As [`Self::config`].
    pub(super) fn metering(&self) -> Result<Metering> {
        if let Some(exposure) = self.exposure {
            return Ok(if exposure.auto { Metering::Auto } else { Metering::None });
        }
        // The settings are computed over two different bases. A value that follows its base in both cases was not set by the user.
        let unit = |settings: &Settings| (settings.exposure, settings.normalize);
        let plain = self.base();
        let other = Config { tonemap: Settings { exposure: 1.0, normalize: true, ..plain.tonemap.clone() } };
        let followed = |base: &Config| -> Result<bool> {
            Ok(unit(&self.over(base, &self.settings.define)?.tonemap) == unit(&base.tonemap))
        };
        let set = !(followed(&plain)? && followed(&other)?);
        Ok(if set || self.paper { Metering::None } else { Metering::ByFile })
    }

    fn base(&self) -> Config {
        Config { tonemap: if self.paper { Settings::paper() } else { Settings::default() } }
    }

    /// Defaults, then the file, then the options, then `-D`.
    ///
    /// # Errors
    /// `Usage` or `Input`, naming the setting.
    pub fn config(&self) -> Result<Config> {
        let check = |config: &Config| config.tonemap.validate().map_err(|error| error.at("tonemap"));
        let config = self.with(&self.settings.define)?;
        self.settings.blamed(check(&config), || check(&self.with(&[])?))?;
        if !config.tonemap.important.trim().is_empty() {
            let what = format!("'{}' names objects of a scene, but a picture file has none", config.tonemap.important);
            let help = "Use --mask FILE, or set it where a scene is rendered (lucerna render)";
            return Err(Error::usage(what).at("tonemap.important").help(help));
        }
        if self.mask.is_some() && config.tonemap.mode() != Mode::Selective {
            return Err(Error::usage("--mask needs --mode selective"));
        }
        Ok(config)
    }

    /// The settings with these `-D`, not checked.
    fn with(&self, define: &[String]) -> Result<Config> {
        self.over(&self.base(), define)
    }

    fn over(&self, base: &Config, define: &[String]) -> Result<Config> {
        let file = self.settings.file.as_deref();
        let mut config: Config = config::effective(base, file, &self.options.defines("tonemap"))?;
        if let Some(exposure) = self.exposure {
            config.tonemap.exposure = exposure.stops;
        }
        config::effective(&config, None, define)
    }
}

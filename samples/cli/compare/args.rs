//! The command line of `lucerna compare`.

use std::{path::PathBuf, str::FromStr};

use clap::{Args, ValueEnum};
use lucerna::{
    Error, Result,
    measure::{Display, Exposure, Measure, NrmseRange, Options, Space, SsimChannels, ToneCurve},
};

use crate::args::TalkArgs;

const VIEWING: &str = "Viewing conditions";
const DETAILS: &str = "Details of measures";
const HDR: &str = "Conversion of light to screen values";

/// The arguments of `lucerna compare`.
#[derive(Args, Clone, Debug)]
#[command(after_help = HELP)]
pub struct CompareArgs {
    /// The reference image: .exr, .hdr, .pfm, .png or .jpg; FILE:LAYER selects a layer of an EXR file, `-` is
    /// standard input
    #[arg(value_name = "REFERENCE")]
    pub reference: String,

    /// Images to compare with it
    #[arg(required = true, value_name = "TEST")]
    pub tests: Vec<String>,

    /// Measures, separated by commas; `all` (those for which the images are large enough), or `default`: mae, rmse, rel-mse, psnr, pearson,
    /// ssim and flip (hdr-flip for HDR)
    #[arg(short, long, value_name = "NAME", value_delimiter = ',')]
    pub metric: Vec<String>,

    /// The image with which the measures fq, gain and improved compare each TEST
    #[arg(long, value_name = "FILE")]
    pub baseline: Option<String>,

    /// Compare this layer of all files that do not name their own (`total` is the picture)
    #[arg(long, value_name = "NAME")]
    pub layer: Option<String>,

    /// Compare a rectangle: WIDTHxHEIGHT+X+Y, from the top left corner
    #[arg(long, value_name = "RECTANGLE", value_parser = crop)]
    pub crop: Option<([u32; 2], [u32; 2])>,

    /// Replace NaN and infinite samples by this value, instead of refusing the image
    #[arg(long, value_name = "VALUE", value_parser = finite)]
    pub nan_as: Option<f64>,

    /// Write maps into this folder: TEST-MEASURE.png
    #[arg(long, value_name = "DIR")]
    pub map: Option<PathBuf>,

    /// Kinds of maps: `magma` on a fixed scale, `exr` with the numbers, `difference`: |R-T| of screen values, `negative`: 1 minus
    /// |R-T|
    #[arg(long, value_enum, value_delimiter = ',', default_value = "magma", requires = "map")]
    pub map_style: Vec<MapStyle>,

    /// Overwrite existing maps
    #[arg(long)]
    pub overwrite: bool,

    /// Print one JSON document
    #[arg(long)]
    pub json: bool,

    /// Exit with code 7 if a measure is worse than VALUE (below it for measures where more is better); may be repeated
    #[arg(long, value_name = "METRIC=VALUE", value_delimiter = ',')]
    pub fail_over: Vec<Threshold>,

    /// Print a warning if a measure is worse than VALUE
    #[arg(long, value_name = "METRIC=VALUE", value_delimiter = ',')]
    pub warn_over: Vec<Threshold>,

    /// Exit codes of OpenImageIO's idiff: 0 the same, 1 warning, 2 different, 3 sizes differ, 4 unreadable or another error; without
    /// --fail-over any difference counts
    #[arg(long)]
    pub idiff_codes: bool,

    /// Exposure for measures of screen values, stops, the same for all images; `auto`: computed from the reference
    #[arg(long, value_name = "EV|auto", allow_hyphen_values = true, value_parser = exposure, default_value = "auto", help_heading = HDR)]
    pub exposure: Stops,

    /// Tone curve for values above the screen's white
    #[arg(long, value_enum, default_value = "clip", help_heading = HDR)]
    pub tone_curve: Curve,

    /// Values that arithmetic measures compare: linear light, or sRGB codes of 0 to 1 after exposure and tone curve [default: linear; psnr
    /// display]
    #[arg(long, value_enum, help_heading = HDR)]
    pub space: Option<SpaceName>,

    /// Pixels in one degree of view: flip, hdr-flip, vdp
    #[arg(long, value_name = "N", default_value_t = Options::default().pixels_per_degree, help_heading = VIEWING)]
    pub ppd: f64,

    /// Luminance of the screen's white, cd/m²: pdiff, vdp
    #[arg(long, value_name = "L", default_value_t = 100.0, help_heading = VIEWING)]
    pub white_luminance: f64,

    /// Angle over which pdiff sees the image's width, degrees
    #[arg(long, value_name = "DEGREES", default_value_t = 45.0, help_heading = VIEWING)]
    pub fov: f64,

    /// Planes of ssim and ms-ssim: the three channels and their mean, or Rec. 709 luma
    #[arg(long, value_enum, default_value = "rgb", help_heading = DETAILS)]
    pub ssim_channels: Channels,

    /// The image whose range nrmse divides by
    #[arg(long, value_enum, default_value = "reference", help_heading = DETAILS)]
    pub nrmse_range: Range,

    /// Added to the squared reference in rel-mse
    #[arg(long, value_name = "E", default_value_t = 0.01, help_heading = DETAILS)]
    pub rel_mse_epsilon: f64,

    /// First exposure of hdr-flip, stops [default: from the reference]
    #[arg(long, value_name = "EV", allow_hyphen_values = true, help_heading = DETAILS)]
    pub flip_start: Option<f64>,

    /// Last exposure of hdr-flip, stops [default: from the reference]
    #[arg(long, value_name = "EV", allow_hyphen_values = true, help_heading = DETAILS)]
    pub flip_stop: Option<f64>,

    /// Number of exposures of hdr-flip [default: one a stop, at least 2]
    #[arg(long, value_name = "N", help_heading = DETAILS)]
    pub flip_exposures: Option<u32>,

    /// Tone curve inside hdr-flip
    #[arg(long, value_enum, default_value = "aces", help_heading = DETAILS)]
    pub flip_curve: Curve,

    /// Conversion of codes to light in pdiff: a power, or `srgb`
    #[arg(long, value_name = "G|srgb", default_value = "2.2", value_parser = gamma, help_heading = DETAILS)]
    pub pdiff_gamma: Gamma,

    /// Channels as the program perceptualdiff reads them (bgr: red and blue exchanged), or as they are
    #[arg(long, value_enum, default_value = "bgr", help_heading = DETAILS)]
    pub pdiff_order: Order,

    /// Weight of colour beside luminance in pdiff, 0 to 1
    #[arg(long, value_name = "W", default_value_t = 1.0, help_heading = DETAILS)]
    pub pdiff_color: f64,

    /// Minimum of failing pixels for which pdiff reports "visibly different"
    #[arg(long, value_name = "PIXELS", default_value_t = 100, help_heading = DETAILS)]
    pub pdiff_threshold: u64,

    /// Slope of vdp's masking: 0.65 (practised observer) to 1
    #[arg(long, value_name = "S", default_value_t = 0.7, help_heading = DETAILS)]
    pub vdp_masking: f64,

    /// Probability of detection above which vdp counts a pixel
    #[arg(long, value_name = "P", default_value_t = 0.75, help_heading = DETAILS)]
    pub vdp_threshold: f64,

    /// Number of threads [default: all cores]; the results do not depend on it
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,

    #[command(flatten)]
    pub talk: TalkArgs,
}

const HELP: &str = "\
Compares every TEST with REFERENCE pixel by pixel, and prints one line for each test and one column for each measure. Refuses images of
different sizes, images with NaN or infinite pixels, and HDR images together with screen codes (unless --exposure is given).

Measures:
  mae rmse nrmse rms-percent mean-percent rel-mse pearson   compare linear values
  psnr ssim ms-ssim flip pdiff vdp                          compare screen values: exposure, tone curve, sRGB
  hdr-flip                                                  chooses its own exposures
  fq gain improved                                          compare with --baseline; fq is -1 where TEST is nearer than the baseline

Exit codes: 0 no measure is over its threshold, 7 a measure is over its threshold, 2 wrong usage, 3 an image is unreadable or not
comparable, 1 a map could not be written.

Examples:
  lucerna compare reference.exr isr.exr                            the usual measures
  lucerna compare reference.exr a.exr b.exr c.exr -m flip,ssim     a table
  lucerna compare reference.exr isr.exr --baseline isr.exr:direct  is it better than direct light only?
  lucerna compare golden.png new.png --fail-over flip=0.02         for CI: exit code 7 if it looks different
  lucerna compare a.exr b.exr -m all --map maps --json             everything, with maps

docs/measures.md has the formula, source, range and purpose of each measure.";

/// A measure and its threshold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Threshold {
    pub measure: Measure,
    pub value: f64,
}

impl FromStr for Threshold {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, value) = text.split_once('=').ok_or("expected METRIC=VALUE, for example flip=0.05")?;
        let measure = name.parse().map_err(|error: Error| error.what().to_owned())?;
        Ok(Self { measure, value: finite(value)? })
    }
}

/// `--exposure`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stops(pub Option<f64>);

/// `--pdiff-gamma`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gamma(pub Option<f64>);

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum MapStyle {
    Magma,
    Exr,
    Difference,
    Negative,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Curve {
    Clip,
    Reinhard,
    Aces,
    Hable,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SpaceName {
    Linear,
    Display,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Channels {
    Rgb,
    Luma,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Range {
    Reference,
    Both,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Order {
    Bgr,
    Rgb,
}

impl Curve {
    pub(super) fn curve(self) -> ToneCurve {
        match self {
            Self::Clip => ToneCurve::Clip,
            Self::Reinhard => ToneCurve::Reinhard,
            Self::Aces => ToneCurve::Aces,
            Self::Hable => ToneCurve::Hable,
        }
    }
}

impl CompareArgs {
    /// The settings of the measures.
    ///
    /// # Errors
    /// `Usage` for numbers out of range.
    pub fn options(&self) -> Result<Options> {
        let options = Options {
            display: Display {
                exposure: self.exposure.0.map_or(Exposure::Auto, Exposure::Stops),
                curve: self.tone_curve.curve(),
            },
            space: self.space.map(|space| match space {
                SpaceName::Linear => Space::Linear,
                SpaceName::Display => Space::Display,
            }),
            nrmse_range: match self.nrmse_range {
                Range::Reference => NrmseRange::Reference,
                Range::Both => NrmseRange::Both,
            },
            rel_mse_epsilon: self.rel_mse_epsilon,
            ssim_channels: match self.ssim_channels {
                Channels::Rgb => SsimChannels::Rgb,
                Channels::Luma => SsimChannels::Luma,
            },
            pixels_per_degree: self.ppd,
            flip_start: self.flip_start,
            flip_stop: self.flip_stop,
            flip_exposures: self.flip_exposures,
            flip_curve: self.flip_curve.curve(),
            white_luminance: self.white_luminance,
            pdiff_fov: self.fov,
            pdiff_gamma: self.pdiff_gamma.0,
            pdiff_swapped: self.pdiff_order == Order::Bgr,
            pdiff_color: self.pdiff_color,
            pdiff_threshold: self.pdiff_threshold,
            vdp_masking_slope: self.vdp_masking,
            vdp_threshold: self.vdp_threshold,
            threads: self.threads,
            ..Options::default()
        };
        options.validate()?;
        Ok(options)
    }

    /// The thresholds of `--fail-over`. With `--idiff-codes` and without thresholds, any difference fails.
    pub(super) fn thresholds(&self) -> Vec<Threshold> {
        if self.idiff_codes && self.fail_over.is_empty() {
            return vec![Threshold { measure: Measure::Mae, value: 0.0 }];
        }
        self.fail_over.clone()
    }
}

fn finite(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|x: &f64| x.is_finite()).ok_or_else(|| format!("'{text}' is not a finite number"))
}

fn exposure(text: &str) -> Result<Stops, String> {
    if text == "auto" {
        return Ok(Stops(None));
    }
    let stops = finite(text).map_err(|error| format!("{error}, nor `auto`"))?;
    if stops.abs() > 64.0 { Err("expected -64 to 64 stops".into()) } else { Ok(Stops(Some(stops))) }
}

fn gamma(text: &str) -> Result<Gamma, String> {
    if text == "srgb" {
        return Ok(Gamma(None));
    }
    finite(text).map(|g| Gamma(Some(g))).map_err(|error| format!("{error}, nor `srgb`"))
}

/// Size and origin.
fn crop(text: &str) -> Result<([u32; 2], [u32; 2]), String> {
    let wrong = || format!("'{text}' is not WIDTHxHEIGHT+X+Y, for example 256x256+100+50");
    let (size, origin) = text.split_once('+').ok_or_else(wrong)?;
    let (w, h) = size.split_once('x').ok_or_else(wrong)?;
    let (x, y) = origin.split_once('+').ok_or_else(wrong)?;
    let number = |t: &str| t.parse::<u32>().map_err(|_| wrong());
    Ok(([number(w)?, number(h)?], [number(x)?, number(y)?]))
}

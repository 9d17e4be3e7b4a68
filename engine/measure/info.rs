//! The list of measures: names, directions, units, sources.

use std::str::FromStr;

use super::{Measured, Options, Pair, arithmetic, baseline, flip, pdiff, ssim, vdp};
use crate::{Error, Result};

/// A measure. The formulas stand at the functions that compute them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Measure {
    /// Mean absolute error ([`arithmetic::mae`]).
    Mae,
    /// Root of the mean squared error ([`arithmetic::rmse`]).
    Rmse,
    /// RMSE over the range of the reference ([`arithmetic::nrmse`]).
    Nrmse,
    /// Root mean square of relative errors of luminance ([`arithmetic::rms_percent`]).
    RmsPercent,
    /// Mean of relative errors of luminance ([`arithmetic::mean_percent`]).
    MeanPercent,
    /// Relative mean squared error ([`arithmetic::rel_mse`]).
    RelMse,
    /// Peak signal-to-noise ratio ([`arithmetic::psnr`]).
    Psnr,
    /// Correlation ([`arithmetic::pearson`]).
    Pearson,
    /// Which of two images is nearer to the reference ([`baseline::fq`]).
    Fq,
    /// By how much the mean error fell against a baseline ([`baseline::gain`]).
    Gain,
    /// On how many pixels the error fell against a baseline ([`baseline::improved`]).
    Improved,
    /// Structural similarity ([`ssim::ssim`]).
    Ssim,
    /// Structural similarity at five scales ([`ssim::ms_ssim`]).
    MsSsim,
    /// How different the images look when flipped between ([`flip::flip`]).
    Flip,
    /// The same over a range of exposures ([`flip::hdr_flip`]).
    HdrFlip,
    /// On how many pixels an observer sees a difference ([`pdiff::pdiff`]).
    Pdiff,
    /// On how many pixels a difference is detected ([`vdp::vdp`]).
    Vdp,
}

/// What a user must know about a measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Info {
    /// In kebab case.
    pub name: &'static str,
    /// One line: what it is and where it comes from.
    pub what: &'static str,
    /// Empty for plain numbers.
    pub unit: &'static str,
    pub higher_is_better: bool,
    /// Three images: reference, test and baseline.
    pub needs_baseline: bool,
    /// Compares what a screen shows; false: linear values of any range.
    pub display: bool,
}

impl Measure {
    /// In the order of the documentation.
    pub const ALL: [Self; 17] = [
        Self::Mae,
        Self::Rmse,
        Self::Nrmse,
        Self::RmsPercent,
        Self::MeanPercent,
        Self::RelMse,
        Self::Psnr,
        Self::Pearson,
        Self::Fq,
        Self::Gain,
        Self::Improved,
        Self::Ssim,
        Self::MsSsim,
        Self::Flip,
        Self::HdrFlip,
        Self::Pdiff,
        Self::Vdp,
    ];

    /// Name, direction, unit, source.
    pub const fn info(self) -> Info {
        const ERROR: Info =
            Info { name: "", what: "", unit: "", higher_is_better: false, needs_baseline: false, display: false };
        const DISPLAY: Info = Info { display: true, ..ERROR };
        const BASELINE: Info = Info { needs_baseline: true, ..ERROR };
        match self {
            Self::Mae => Info { name: "mae", what: "mean absolute error of all channels (Imalyzer, eq. 19)", ..ERROR },
            Self::Rmse => Info { name: "rmse", what: "root of the mean squared error of all channels", ..ERROR },
            Self::Nrmse => {
                Info { name: "nrmse", what: "RMSE over the reference's range, mean of channels (FIV, eq. 17)", ..ERROR }
            }
            Self::RmsPercent => Info {
                name: "rms-percent",
                what: "root mean square of relative luminance errors (FIV thesis, eq. 18)",
                unit: "%",
                ..ERROR
            },
            Self::MeanPercent => Info {
                name: "mean-percent",
                what: "mean of relative luminance errors (FIV thesis, eq. 19)",
                unit: "%",
                ..ERROR
            },
            Self::RelMse => {
                Info { name: "rel-mse", what: "mean of squared errors over the squared reference", ..ERROR }
            }
            Self::Psnr => Info {
                name: "psnr",
                what: "peak signal-to-noise ratio of what a screen shows",
                unit: "dB",
                higher_is_better: true,
                ..DISPLAY
            },
            Self::Pearson => Info {
                name: "pearson",
                what: "correlation of all channel values (Imalyzer, eq. 20)",
                higher_is_better: true,
                ..ERROR
            },
            Self::Fq => Info {
                name: "fq",
                what: "-1: the test is nearer to the reference than the baseline; 1: the baseline is; 0: equal (eq. 21)",
                ..BASELINE
            },
            Self::Gain => Info {
                name: "gain",
                what: "by how much the mean absolute error is below the baseline's",
                unit: "%",
                higher_is_better: true,
                ..BASELINE
            },
            Self::Improved => Info {
                name: "improved",
                what: "share of pixels nearer to the reference than the baseline's",
                unit: "%",
                higher_is_better: true,
                ..BASELINE
            },
            Self::Ssim => Info {
                name: "ssim",
                what: "structural similarity, 11×11 Gaussian window (Wang et al. 2004)",
                higher_is_better: true,
                ..DISPLAY
            },
            Self::MsSsim => Info {
                name: "ms-ssim",
                what: "structural similarity at five scales (Wang et al. 2003)",
                higher_is_better: true,
                ..DISPLAY
            },
            Self::Flip => Info { name: "flip", what: "LDR-FLIP, mean (Andersson et al. 2020)", ..DISPLAY },
            Self::HdrFlip => Info {
                name: "hdr-flip",
                what: "HDR-FLIP, mean: the worst of many exposures (Andersson et al. 2021)",
                ..ERROR
            },
            Self::Pdiff => Info {
                name: "pdiff",
                what: "share of pixels that look different (PerceptualDiff, Yee and Newman 2004)",
                unit: "%",
                ..DISPLAY
            },
            Self::Vdp => Info {
                name: "vdp",
                what: "share of pixels where a difference is detected, p > 0.75 (VDP, Daly 1993)",
                unit: "%",
                ..DISPLAY
            },
        }
    }

    /// The smallest side of images that the measure can compare, pixels.
    pub const fn smallest_side(self) -> u32 {
        match self {
            Self::Ssim => ssim::SMALLEST,
            Self::MsSsim => ssim::SMALLEST_MULTI_SCALE,
            _ => 1,
        }
    }

    /// In kebab case.
    pub const fn name(self) -> &'static str {
        self.info().name
    }

    /// Compares a pair.
    ///
    /// # Errors
    /// `Usage` for settings out of range, for a pair without the baseline that the measure needs, or for images too small for it.
    pub fn of(self, pair: &Pair<'_>, options: &Options) -> Result<Measured> {
        options.validate()?;
        match self {
            Self::Mae => arithmetic::mae(pair, options),
            Self::Rmse => arithmetic::rmse(pair, options),
            Self::Nrmse => arithmetic::nrmse(pair, options),
            Self::RmsPercent => arithmetic::rms_percent(pair, options),
            Self::MeanPercent => arithmetic::mean_percent(pair, options),
            Self::RelMse => arithmetic::rel_mse(pair, options),
            Self::Psnr => arithmetic::psnr(pair, options),
            Self::Pearson => arithmetic::pearson(pair, options),
            Self::Fq => baseline::fq(pair, options),
            Self::Gain => baseline::gain(pair, options),
            Self::Improved => baseline::improved(pair, options),
            Self::Ssim => ssim::ssim(pair, options),
            Self::MsSsim => ssim::ms_ssim(pair, options),
            Self::Flip => flip::flip(pair, options),
            Self::HdrFlip => flip::hdr_flip(pair, options),
            Self::Pdiff => pdiff::pdiff(pair, options),
            Self::Vdp => vdp::vdp(pair, options),
        }
    }
}

impl std::fmt::Display for Measure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Measure {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|measure| measure.name() == text).ok_or_else(|| {
            let names: Vec<&str> = Self::ALL.iter().map(|m| m.name()).collect();
            Error::usage(format!("no measure is called '{text}'; there are {}", names.join(", ")))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_kebab_case_and_come_back() {
        for measure in Measure::ALL {
            assert_eq!(measure.name().parse::<Measure>().unwrap(), measure);
            assert!(measure.name().bytes().all(|b| b.is_ascii_lowercase() || b == b'-'));
        }
        let error = "ssmi".parse::<Measure>().unwrap_err();
        assert!(error.exit_code() == 2 && error.to_string().contains("mae, rmse"));
    }
}

//! Everything about measures that can be chosen.

use super::{Display, Exposure};

/// Settings of all measures; the defaults are those of the sources named at each.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// How linear values become what a screen shows.
    pub display: Display,
    /// What arithmetic measures compare; `None`: linear values, for PSNR displayed ones.
    pub space: Option<Space>,
    pub nrmse_range: NrmseRange,
    /// Added to the squared reference in the relative MSE, in the square of the image's unit. Radiance around 0.1 and below then
    /// counts less and less.
    pub rel_mse_epsilon: f64,
    /// What SSIM and MS-SSIM compare.
    pub ssim_channels: SsimChannels,
    /// Pixels that one degree of the field of view takes: FLIP and VDP. 67.02 is FLIP's: a screen 0.7 m and 3840 pixels wide, seen
    /// from 0.7 m.
    pub pixels_per_degree: f64,
    /// HDR-FLIP's exposures in stops; `None`: from the reference, as its authors do.
    pub flip_start: Option<f64>,
    pub flip_stop: Option<f64>,
    /// Number of exposures, at least 2; `None`: one a stop.
    pub flip_exposures: Option<u32>,
    /// The tone curve inside HDR-FLIP.
    pub flip_curve: super::ToneCurve,
    /// Luminance of white on the screen, cd/m²: PerceptualDiff and VDP.
    pub white_luminance: f64,
    /// Angle over which PerceptualDiff sees the width of the image, degrees.
    pub pdiff_fov: f64,
    /// PerceptualDiff's conversion of codes to light: `None` takes sRGB's curve (the light itself); the program's way is 2.2.
    pub pdiff_gamma: Option<f64>,
    /// PerceptualDiff takes red for blue and blue for red, as the program (2.1, with FreeImage) does on little-endian machines: its
    /// numbers are reproduced to the pixel. False: the paper's luminance.
    pub pdiff_swapped: bool,
    /// Weight of differences in colour beside those in luminance, 0 to 1.
    pub pdiff_color: f64,
    /// Failing pixels from which on PerceptualDiff's verdict is "visibly different".
    pub pdiff_threshold: u64,
    /// Slope of VDP's masking where the mask is strong: 0.65 (practised observer) to 1.0; Daly's 0.7 is the default.
    pub vdp_masking_slope: f64,
    /// Steepness of VDP's psychometric function.
    pub vdp_psychometric_slope: f64,
    /// The probability of detection over which a pixel counts as different.
    pub vdp_threshold: f64,
    /// `None`: as many threads as the machine has. Results are the same for any number.
    pub threads: Option<usize>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            display: Display::default(),
            space: None,
            nrmse_range: NrmseRange::Reference,
            rel_mse_epsilon: 0.01,
            ssim_channels: SsimChannels::Rgb,
            pixels_per_degree: 0.7 * (3840.0 / 0.7) * std::f64::consts::PI / 180.0,
            flip_start: None,
            flip_stop: None,
            flip_exposures: None,
            flip_curve: super::ToneCurve::Aces,
            white_luminance: 100.0,
            pdiff_fov: 45.0,
            pdiff_gamma: Some(2.2),
            pdiff_swapped: true,
            pdiff_color: 1.0,
            pdiff_threshold: 100,
            vdp_masking_slope: 0.7,
            vdp_psychometric_slope: 3.5,
            vdp_threshold: 0.75,
            threads: None,
        }
    }
}

impl Options {
    /// Checks every number against its range.
    ///
    /// # Errors
    /// `Usage`, naming the setting, the value and what is allowed.
    pub fn validate(&self) -> crate::Result<()> {
        let wrong = |name: &str, value: f64, allowed: &str| {
            Err(crate::Error::usage(format!("{name} is {value}, allowed is {allowed}")))
        };
        let positive = [
            ("rel_mse_epsilon", self.rel_mse_epsilon),
            ("vdp_psychometric_slope", self.vdp_psychometric_slope),
            ("pdiff_gamma", self.pdiff_gamma.unwrap_or(1.0)),
        ];
        for (name, value) in positive {
            if !(value > 0.0 && value.is_finite()) {
                return wrong(name, value, "a number above 0");
            }
        }
        let bounded = [
            ("pixels_per_degree", self.pixels_per_degree, 0.1, 2000.0),
            ("white_luminance", self.white_luminance, 1e-4, 1e6),
            ("exposure", if let Exposure::Stops(stops) = self.display.exposure { stops } else { 0.0 }, -64.0, 64.0),
            ("pdiff_fov", self.pdiff_fov, 0.1, 89.9),
            ("pdiff_color", self.pdiff_color, 0.0, 1.0),
            ("vdp_masking_slope", self.vdp_masking_slope, 0.0, 1.0),
            ("vdp_threshold", self.vdp_threshold, 0.0, 1.0),
            ("flip_start", self.flip_start.unwrap_or(0.0), -64.0, 64.0),
            ("flip_stop", self.flip_stop.unwrap_or(0.0), -64.0, 64.0),
            ("flip_exposures", f64::from(self.flip_exposures.unwrap_or(2)), 2.0, 64.0),
        ];
        for (name, value, low, high) in bounded {
            if !(low..=high).contains(&value) {
                return wrong(name, value, &format!("{low} to {high}"));
            }
        }
        if let (Some(start), Some(stop)) = (self.flip_start, self.flip_stop)
            && start > stop
        {
            return wrong("flip_start", start, &format!("at most flip_stop, which is {stop}"));
        }
        Ok(())
    }
}

/// The values that arithmetic measures compare.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Space {
    /// Linear light, unbounded.
    Linear,
    /// sRGB-encoded, 0 to 1, after exposure and tone curve: the codes of an 8-bit image without their rounding.
    Display,
}

/// The range by which NRMSE divides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NrmseRange {
    /// Of the reference alone: several tests stay comparable.
    Reference,
    /// Of both images together.
    Both,
}

/// The planes of structural similarity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SsimChannels {
    /// Red, green and blue codes each, and their mean: scikit-image with `channel_axis`.
    Rgb,
    /// Rec. 709 weights on the codes: one grey image, as Wang et al. took.
    Luma,
}

//! How far an image is from a reference: one function a measure, each with a number and a map.
//!
//! ```
//! use lucerna::measure::{Measure, Options, Pair, Picture};
//!
//! # fn main() -> lucerna::Result<()> {
//! let reference = Picture::from_fn(64, 48, |x, y| [x as f32 / 64.0, y as f32 / 48.0, 0.5]);
//! let test = Picture::from_fn(64, 48, |x, y| [x as f32 / 64.0, y as f32 / 48.0, 0.4]);
//! let pair = Pair::new(&reference, &test)?;
//! let mae = Measure::Mae.of(&pair, &Options::default())?;
//! assert!((mae.value - 0.1 / 3.0).abs() < 1e-7 && !mae.higher_is_better);
//! assert_eq!(mae.map.values.len(), 64 * 48);
//! # Ok(())
//! # }
//! ```
//!
//! Pictures are linear Rec. 709, three channels, top row first ([`Picture`]). Arithmetic measures ([`arithmetic`],
//! [`baseline`]) take these numbers as they are, of any range; measures of what is seen take what a screen would show
//! ([`Display`]: exposure, tone curve, sRGB). Which is which, and every formula: [`Measure`] and `docs/measures.md`.
//!
//! Numbers do not depend on how many threads compute them.

pub mod arithmetic;
pub mod baseline;
mod convolve;
mod display;
pub mod flip;
mod info;
mod map;
mod options;
mod parallel;
pub mod pdiff;
mod picture;
pub mod ssim;
pub mod steady;
pub mod vdp;

pub use display::{Display, Exposure, ToneCurve, develop};
pub use info::{Info, Measure};
pub use map::{Map, magma};
pub use options::{NrmseRange, Options, Space, SsimChannels};
pub use picture::{Pair, Picture};

/// What a measure found.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    pub measure: Measure,
    /// NaN where the measure is not defined for the pair (`note` says why); infinite for PSNR of equal images.
    pub value: f64,
    /// One value a pixel, with the scale on which it is shown.
    pub map: Map,
    /// Of `value`; empty for a plain number.
    pub unit: &'static str,
    pub higher_is_better: bool,
    /// Further numbers that say how it came about: exposures, pixels left out, counts.
    pub details: Vec<(&'static str, f64)>,
    /// What a reader of the number must know.
    pub note: Option<String>,
}

impl Measured {
    /// Whether the value is on the bad side of a threshold; an undefined value always is.
    pub fn is_worse_than(&self, threshold: f64) -> bool {
        self.value.is_nan() || if self.higher_is_better { self.value < threshold } else { self.value > threshold }
    }

    /// A further number by its name.
    pub fn detail(&self, name: &str) -> Option<f64> {
        self.details.iter().find(|(n, _)| *n == name).map(|(_, value)| *value)
    }

    fn new(measure: Measure, value: f64, map: Map) -> Self {
        let Info { unit, higher_is_better, .. } = measure.info();
        Self { measure, value, map, unit, higher_is_better, details: Vec::new(), note: None }
    }

    #[must_use]
    fn with(mut self, name: &'static str, value: f64) -> Self {
        self.details.push((name, value));
        self
    }

    #[must_use]
    fn noted(mut self, note: impl Into<String>) -> Self {
        self.note = Some(note.into());
        self
    }
}

/// Luminance of linear Rec. 709.
fn luminance([r, g, b]: [f32; 3]) -> f64 {
    0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b)
}

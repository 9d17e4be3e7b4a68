//! From linear values to what a screen shows, the same way for reference and test.

use super::{Options, Pair, Picture, parallel};
use crate::image::srgb;

/// How linear values become the values 0 to 1 that a screen is given.
///
/// Both images get the same exposure, found on the reference alone, so that one that is too bright stays too bright.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Display {
    pub exposure: Exposure,
    pub curve: ToneCurve,
}

/// By how many stops linear values are scaled.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Exposure {
    /// 0 for a reference from a file of screen codes. Else whole stops such that the median of the reference's brightest channel,
    /// black pixels left out, lies between 0.01 and 1; where it already does, 0: the rule by which pictures are shown.
    #[default]
    Auto,
    /// That many stops: values are multiplied by 2^EV.
    Stops(f64),
}

/// What is done with values that a screen cannot show.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ToneCurve {
    /// Values above 1 are shown as 1.
    #[default]
    Clip,
    /// L/(1+L) on luminance (Reinhard 2002, eq. 3), then clipped.
    Reinhard,
    /// Narkowicz's fit of ACES' filmic curve on each channel, with its exposure of 0.6; HDR-FLIP's default.
    Aces,
    /// Hable's filmic curve on each channel, with his exposure bias of 2 and white at 11.2.
    Hable,
}

impl ToneCurve {
    /// Names on the command line.
    pub const NAMES: [(&'static str, Self); 4] =
        [("clip", Self::Clip), ("reinhard", Self::Reinhard), ("aces", Self::Aces), ("hable", Self::Hable)];

    /// Linear scene values to linear screen values in [0, 1].
    pub fn apply(self, color: [f32; 3]) -> [f32; 3] {
        let color = color.map(|v| v.max(0.0));
        let mapped = match self {
            Self::Clip => color,
            Self::Reinhard => {
                let scale = 1.0 / (1.0 + super::luminance(color) as f32);
                color.map(|v| v * scale)
            }
            Self::Aces => color.map(|v| ratio(v, ACES)),
            Self::Hable => color.map(|v| ratio(v, HABLE)),
        };
        mapped.map(|v| v.clamp(0.0, 1.0))
    }
}

/// Coefficients of (k0 x² + k1 x + k2) / (k3 x² + k4 x + k5). Narkowicz 2015 with 0.6 x put in.
pub(super) const ACES: [f32; 6] = [0.6 * 0.6 * 2.51, 0.6 * 0.03, 0.0, 0.6 * 0.6 * 2.43, 0.6 * 0.59, 0.14];
/// Hable 2010 (A 0.15, B 0.5, C 0.1, D 0.2, E 0.02, F 0.3) with its exposure bias of 2, divided by its value at the white of 11.2.
pub(super) const HABLE: [f32; 6] = [0.231_683, 0.013_791, 0.0, 0.18, 0.3, 0.018];

/// Value of such a quotient.
pub(super) fn ratio(x: f32, k: [f32; 6]) -> f32 {
    // Both parts over x² where x is huge: no overflow.
    if x > 1e6 { k[0] / k[3] } else { ((k[0] * x + k[1]) * x + k[2]) / ((k[3] * x + k[4]) * x + k[5]) }
}

impl Display {
    /// The stops that a pair with this reference is exposed by.
    pub fn stops(&self, reference: &Picture) -> f64 {
        match self.exposure {
            Exposure::Stops(stops) => stops,
            Exposure::Auto if reference.display_referred => 0.0,
            Exposure::Auto => auto_stops(reference),
        }
    }
}

/// Whole stops, so that rounding on another device does not show.
fn auto_stops(picture: &Picture) -> f64 {
    let brightest = picture.pixels.iter().map(|[r, g, b]| r.max(*g).max(*b));
    let mut lit: Vec<f32> = brightest.filter(|l| l.is_finite() && *l > 0.0).collect();
    if lit.is_empty() {
        return 0.0;
    }
    let middle = lit.len() / 2;
    let median = *lit.select_nth_unstable_by(middle, f32::total_cmp).1;
    if (0.01..=1.0).contains(&median) { 0.0 } else { f64::from((0.2 / median).log2().round().clamp(-64.0, 64.0)) }
}

/// A pair as a screen shows it: linear light in [0, 1].
pub(super) struct Shown {
    pub reference: Vec<[f32; 3]>,
    pub test: Vec<[f32; 3]>,
    /// Stops of exposure.
    pub stops: f64,
}

/// Both images as a screen shows them.
pub(super) fn shown(pair: &Pair<'_>, options: &Options) -> Shown {
    let stops = options.display.stops(pair.reference);
    let show = |picture: &Picture| expose(picture, stops, options.display.curve, parallel::threads(options.threads));
    Shown { reference: show(pair.reference), test: show(pair.test), stops }
}

/// What a screen shows of a picture after `stops` of exposure and a tone curve: a display-referred picture.
pub fn develop(picture: &Picture, stops: f64, curve: ToneCurve) -> Picture {
    let pixels = expose(picture, stops, curve, parallel::threads(None));
    Picture { width: picture.width, height: picture.height, pixels, display_referred: true }
}

/// Linear light in [0, 1].
pub(super) fn expose(picture: &Picture, stops: f64, curve: ToneCurve, threads: usize) -> Vec<[f32; 3]> {
    let scale = stops.exp2() as f32;
    let mut out = vec![[0.0; 3]; picture.pixels.len()];
    let width = picture.width as usize;
    parallel::rows(threads, &mut out, width, |y, row| {
        for (shown, pixel) in row.iter_mut().zip(&picture.pixels[y * width..]) {
            *shown = curve.apply(pixel.map(|v| v * scale));
        }
    });
    out
}

/// sRGB-encodes in place.
pub(super) fn encode(pixels: &mut [[f32; 3]], threads: usize) {
    parallel::rows(threads, pixels, 1, |_, pixel| pixel[0] = pixel[0].map(srgb::encode));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_rise_from_black_to_white() {
        for (name, curve) in ToneCurve::NAMES {
            assert_eq!(curve.apply([0.0, -1.0, 0.0]), [0.0; 3], "{name}");
            let values: Vec<f32> = (0..200).map(|i| curve.apply([(i as f32 / 8.0 - 12.0).exp2(); 3])[1]).collect();
            assert!(values.windows(2).all(|pair| pair[0] <= pair[1]) && values[199] > 0.99, "{name}");
        }
        // 0.8037 is what the fit gives for 0.6 · 1.
        assert!(
            (ToneCurve::Aces.apply([1.0; 3])[0] - (2.51 * 0.36 + 0.018) / (2.43 * 0.36 + 0.354 + 0.14)).abs() < 1e-6
        );
        assert!((ToneCurve::Hable.apply([5.6; 3])[0] - 1.0).abs() < 1e-4);
    }

    #[test]
    fn exposure_is_the_references() {
        let bright = Picture::from_fn(8, 8, |_, _| [204.8; 3]);
        let fine = Picture::from_fn(8, 8, |_, _| [0.5; 3]);
        let auto = Display::default();
        assert_eq!((auto.stops(&bright), auto.stops(&fine)), (-10.0, 0.0));
        assert_eq!(auto.stops(&Picture { display_referred: true, ..bright.clone() }), 0.0);
        assert_eq!(Display { exposure: Exposure::Stops(1.5), ..auto }.stops(&bright), 1.5);
        let pair = Pair::new(&bright, &fine).unwrap();
        let shown = shown(&pair, &Options::default());
        assert_eq!((shown.reference[0], shown.test[0]), ([0.2; 3], [0.5 / 1024.0; 3]));
    }
}

//! The automatic exposure of .png files, for scenes whose radiance is far outside of a screen's range.
//!
//! glTF lights are in candela and lux: a scene in bright sunlight has radiances of thousands.

use lucerna::image::Layers;
use lucerna_scenes as builtin;

use crate::record::Source;

/// If the median of the brightest channel is in this range, W/(sr·m²), the exposure stays 0.
const FINE: std::ops::RangeInclusive<f32> = 0.01..=1.0;
/// The median after a changed exposure.
const TARGET: f32 = 0.2;

/// The exposure that suits the lights of a built-in scene, EV; `None` for files.
pub fn of_source(source: &Source) -> Option<f64> {
    match source {
        Source::Builtin(name) => builtin::exposure(name).map(f64::from),
        Source::File(_) | Source::Terrain => None,
    }
}

/// Whether all pixels are black.
pub fn is_black(picture: &Layers) -> bool {
    picture.main().is_some_and(|layer| layer.data.iter().all(|value| *value <= 0.0))
}

/// The exposure of a picture, EV; 0 if its median is in the screen's range.
///
/// Uses the median of the pixels that are not black. The result is a whole number of stops, so that rounding differences between devices do
/// not change it.
pub fn fitting(picture: &Layers) -> f64 {
    let Some(pixels) = picture.main().and_then(|layer| layer.rgb_pixels()) else { return 0.0 };
    // The brightest channel and not the luminance, because a blue room is not dark.
    let brightest = pixels.iter().map(|[r, g, b]| r.max(*g).max(*b));
    let mut lit: Vec<f32> = brightest.filter(|l| l.is_finite() && *l > 0.0).collect();
    if lit.is_empty() {
        return 0.0;
    }
    let middle = lit.len() / 2;
    let median = *lit.select_nth_unstable_by(middle, f32::total_cmp).1;
    if FINE.contains(&median) { 0.0 } else { f64::from((TARGET / median).log2().round().clamp(-64.0, 64.0)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(luminance: f32) -> f64 {
        let black = [0.0; 3 * 3];
        let lit = [luminance; 3 * 4];
        fitting(&Layers::rgb(7, 1, [&black[..], &lit[..]].concat()))
    }

    #[test]
    fn only_what_cannot_be_seen_is_changed() {
        assert_eq!((of(0.02), of(0.5), of(1.0), of(0.0)), (0.0, 0.0, 0.0, 0.0));
        assert_eq!((of(0.2 * 1024.0), of(0.2 / 1024.0)), (-10.0, 10.0));
        assert_eq!(of(0.2 * 1100.0), of(0.2 * 1000.0));
        assert_eq!(fitting(&Layers::rgb(1, 1, vec![f32::NAN; 3])), 0.0);
    }
}

//! Which pixels are important: Michael 2010, section 4.4.2.

use super::plane::Plane;
use crate::techniques::tonemap::{Identify, Settings};

/// Magnitude of the Sobel gradient, √(Gx² + Gy²), with the weights 1 2 1 unscaled.
pub fn sobel(values: &Plane) -> Plane {
    Plane::from_fn(values.width, values.height, |x, y| {
        let at = |i: isize, j: isize| values.clamped(x as isize + i, y as isize + j);
        let gx = at(1, -1) + 2.0 * at(1, 0) + at(1, 1) - at(-1, -1) - 2.0 * at(-1, 0) - at(-1, 1);
        let gy = at(-1, 1) + 2.0 * at(0, 1) + at(1, 1) - at(-1, -1) - 2.0 * at(0, -1) - at(1, -1);
        gx.hypot(gy)
    })
}

/// Which pixels are important, by the settings.
pub fn important(luminance: &Plane, settings: &Settings) -> Vec<bool> {
    let map = match settings.identify {
        Identify::Sobel => sobel(luminance),
        Identify::Saliency => sobel(luminance),
    };
    map.values.iter().map(|v| *v > f64::from(settings.threshold)).collect()
}

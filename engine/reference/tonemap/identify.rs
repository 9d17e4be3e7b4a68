//! Which pixels are important: Michael 2010, section 4.4.2, and the definitions of `techniques::tonemap::identify`.

use super::plane::Plane;
use crate::techniques::tonemap::{Identify, Settings, ThresholdUnit};

/// Which pixels are important, by the settings. `log_average`: of the luminance.
pub fn important(luminance: &Plane, log_average: f64, settings: &Settings) -> Vec<bool> {
    let factor = settings.identify_scale as usize;
    let small = shrink(luminance, factor);
    let map = match settings.identify {
        Identify::Sobel => sobel(&small),
        Identify::Saliency => saliency(&small),
    };
    let at = |i: usize| map[(i % luminance.width / factor, i / luminance.width / factor)];
    let unit = match (settings.identify, settings.threshold_unit) {
        (Identify::Sobel, ThresholdUnit::LogAverage) => log_average,
        _ => 1.0,
    };
    (0..luminance.values.len()).map(|i| at(i) > f64::from(settings.threshold()) * unit).collect()
}

/// Averages over boxes of `factor`² pixels; those at the right and lower border average what lies inside.
pub fn shrink(values: &Plane, factor: usize) -> Plane {
    Plane::from_fn(values.width.div_ceil(factor), values.height.div_ceil(factor), |x, y| {
        let rows = y * factor..values.height.min((y + 1) * factor);
        let columns = x * factor..values.width.min((x + 1) * factor);
        let count = (rows.len() * columns.len()) as f64;
        rows.flat_map(|y| columns.clone().map(move |x| values[(x, y)])).sum::<f64>() / count
    })
}

/// Least Sobel magnitude of a step, as a share of the mean luminance around.
pub const LEAST_STEP: f64 = 1e-4;

/// Magnitude of the Sobel gradient, √(Gx² + Gy²), with the weights 1 2 1 unscaled; 0 up to [`LEAST_STEP`] of the mean of the four filtered
/// neighbours, for that is rounding.
pub fn sobel(values: &Plane) -> Plane {
    Plane::from_fn(values.width, values.height, |x, y| {
        let at = |i: isize, j: isize| values.clamped(x as isize + i, y as isize + j);
        let gx = at(1, -1) + 2.0 * at(1, 0) + at(1, 1) - at(-1, -1) - 2.0 * at(-1, 0) - at(-1, 1);
        let gy = at(-1, 1) + 2.0 * at(0, 1) + at(1, 1) - at(-1, -1) - 2.0 * at(0, -1) - at(1, -1);
        let ends =
            [(1, 0), (-1, 0), (0, 1), (0, -1)].map(|(i, j)| at(i + j, j + i) + 2.0 * at(i, j) + at(i - j, j - i));
        let (magnitude, mean) = (gx.hypot(gy), ends.iter().sum::<f64>() / 16.0);
        if magnitude > LEAST_STEP * mean { magnitude } else { 0.0 }
    })
}

/// Mean of |C − S| / (C + S) over centre levels 0, 1, 2 and the surrounds three and four levels above each.
pub fn saliency(values: &Plane) -> Plane {
    let mut levels = vec![values.clone()];
    for k in 0..6 {
        levels.push(octave(&levels[k]));
    }
    Plane::from_fn(values.width, values.height, |x, y| {
        let at = |level: usize| {
            let place = |p: usize| (p as f64 + 0.5) / f64::from(1 << level) - 0.5;
            bilinear(&levels[level], place(x), place(y))
        };
        let pairs = (0..3).flat_map(|c| [(c, c + 3), (c, c + 4)]);
        let contrast = |(c, s)| {
            let (centre, surround): (f64, f64) = (at(c), at(s));
            if centre + surround > 0.0 { (centre - surround).abs() / (centre + surround) } else { 0.0 }
        };
        pairs.map(contrast).sum::<f64>() / 6.0
    })
}

/// Half the size, rounded up, by (1 3 3 1) / 8 along both axes.
fn octave(values: &Plane) -> Plane {
    const WEIGHTS: [f64; 4] = [0.125, 0.375, 0.375, 0.125];
    Plane::from_fn(values.width.div_ceil(2), values.height.div_ceil(2), |x, y| {
        let mut sum = 0.0;
        for (j, v) in (-1..3).zip(WEIGHTS) {
            for (i, u) in (-1..3).zip(WEIGHTS) {
                sum += u * v * values.clamped(2 * x as isize + i, 2 * y as isize + j);
            }
        }
        sum
    })
}

/// Between samples, whose places are whole numbers.
fn bilinear(values: &Plane, x: f64, y: f64) -> f64 {
    let (left, top) = (x.floor(), y.floor());
    let (u, v) = (x - left, y - top);
    let at = |i: isize, j: isize| values.clamped(left as isize + i, top as isize + j);
    (1.0 - v) * ((1.0 - u) * at(0, 0) + u * at(1, 0)) + v * ((1.0 - u) * at(0, 1) + u * at(1, 1))
}

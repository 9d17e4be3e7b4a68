//! Structural similarity, at one scale and at five.

use super::{Map, Measure, Measured, Options, Pair, SsimChannels, convolve, display, parallel};
use crate::{Error, Result};

/// Side of the window of weights.
const WINDOW: usize = 11;
const RADIUS: usize = WINDOW / 2;
/// K1 = 0.01 and K2 = 0.03 of a range of 1, squared.
const C1: f64 = 1e-4;
const C2: f64 = 9e-4;
/// Weights of the scales (Wang, Simoncelli, Bovik 2003), the finest first.
const SCALES: [f64; 5] = [0.0448, 0.2856, 0.3001, 0.2363, 0.1333];

/// Smallest side for one scale: a window.
pub(super) const SMALLEST: u32 = WINDOW as u32;
/// Smallest side for five: a window at the coarsest.
pub(super) const SMALLEST_MULTI_SCALE: u32 = SMALLEST << (SCALES.len() - 1);

/// Luminance-and-structure maps of one plane.
struct Maps {
    /// SSIM of every pixel.
    full: Vec<f64>,
    /// Its contrast and structure part alone.
    structure: Vec<f64>,
}

/// One channel of both images as a screen is given it, 0 to 1.
type Planes = [Vec<f64>; 2];

/// Mean SSIM (Wang et al. 2004): Gaussian window of 11×11, σ = 1.5, K1 = 0.01, K2 = 0.03, weighted (population) covariances, on sRGB codes
/// of 0 to 1; the mean over pixels whose window lies inside the image, and over channels.
///
/// The same as scikit-image's `structural_similarity(gaussian_weights=True, sigma=1.5, use_sample_covariance=False, data_range=1)`.
///
/// # Errors
/// `Input` for images of fewer than 11 pixels on a side.
pub fn ssim(pair: &Pair<'_>, options: &Options) -> Result<Measured> {
    let size = [pair.width(), pair.height()];
    large_enough(Measure::Ssim, pair)?;
    let threads = parallel::threads(options.threads);
    let (planes, stops) = planes(pair, options, threads);
    let mut map = vec![0.0; size[0] * size[1]];
    let mut value = 0.0;
    for plane in &planes {
        let maps = maps(plane, size, threads);
        value += inner_mean(&maps.full, size, threads) / planes.len() as f64;
        map.iter_mut().zip(&maps.full).for_each(|(m, s)| *m += (1.0 - s) / planes.len() as f64);
    }
    let map = Map {
        width: pair.reference.width,
        height: pair.reference.height,
        values: map.into_iter().map(|v| v as f32).collect(),
        range: [0.0, 1.0],
        meaning: "1 − SSIM, mean of the channels",
    };
    Ok(Measured::new(Measure::Ssim, value, map).with("exposure", stops))
}

/// Multi-scale SSIM (Wang et al. 2003): five scales, each half the size of the one before by averages of 2×2 pixels; contrast and
/// structure at every scale, luminance at the coarsest; the product of their means to the published powers. Means below 0 count as 0.
///
/// # Errors
/// `Input` for images of fewer than 176 pixels on a side: the coarsest scale must hold a window.
pub fn ms_ssim(pair: &Pair<'_>, options: &Options) -> Result<Measured> {
    let size = [pair.width(), pair.height()];
    large_enough(Measure::MsSsim, pair)?;
    let threads = parallel::threads(options.threads);
    let (planes, stops) = planes(pair, options, threads);
    let mut map = vec![0.0; size[0] * size[1]];
    let mut value = 0.0;
    let channels = planes.len() as f64;
    for mut plane in planes {
        let mut at = size;
        let mut product = 1.0;
        let mut each = vec![1.0; map.len()];
        for (scale, weight) in SCALES.into_iter().enumerate() {
            let maps = maps(&plane, at, threads);
            let part = if scale + 1 == SCALES.len() { &maps.full } else { &maps.structure };
            product *= inner_mean(part, at, threads).max(0.0).powf(weight);
            parallel::rows(threads, &mut each, size[0], |y, row| {
                for (x, value) in row.iter_mut().enumerate() {
                    let (sx, sy) = ((x >> scale).min(at[0] - 1), (y >> scale).min(at[1] - 1));
                    *value *= part[sy * at[0] + sx].max(0.0).powf(weight);
                }
            });
            if scale + 1 < SCALES.len() {
                plane = plane.map(|p| halve(&p, at));
                at = at.map(|n| n.div_ceil(2));
            }
        }
        value += product / channels;
        map.iter_mut().zip(&each).for_each(|(m, s)| *m += (1.0 - s) / channels);
    }
    let map = Map {
        width: pair.reference.width,
        height: pair.reference.height,
        values: map.into_iter().map(|v| v as f32).collect(),
        range: [0.0, 1.0],
        meaning: "1 − product over scales at the pixel, mean of the channels",
    };
    Ok(Measured::new(Measure::MsSsim, value, map).with("exposure", stops))
}

fn large_enough(measure: Measure, pair: &Pair<'_>) -> Result<()> {
    let (w, h, least) = (pair.reference.width, pair.reference.height, measure.smallest_side());
    if w.min(h) >= least {
        return Ok(());
    }
    Err(Error::input(format!("{w}×{h} pixels, {measure} needs at least {least} on each side")))
}

fn planes(pair: &Pair<'_>, options: &Options, threads: usize) -> (Vec<Planes>, f64) {
    let mut shown = display::shown(pair, options);
    display::encode(&mut shown.reference, threads);
    display::encode(&mut shown.test, threads);
    let both = [&shown.reference, &shown.test];
    let take = |weigh: &dyn Fn(&[f32; 3]) -> f64| both.map(|image| image.iter().map(weigh).collect());
    let planes = match options.ssim_channels {
        SsimChannels::Rgb => (0..3).map(|c| take(&|p| f64::from(p[c]))).collect(),
        SsimChannels::Luma => vec![take(&|p| super::luminance(*p))],
    };
    (planes, shown.stops)
}

fn maps([a, b]: &Planes, size: [usize; 2], threads: usize) -> Maps {
    let weights: Vec<f64> = (0..WINDOW).map(|i| (-0.5 * ((i as f64 - RADIUS as f64) / 1.5).powi(2)).exp()).collect();
    let total: f64 = weights.iter().sum();
    let kernel: Vec<f64> = weights.iter().map(|w| w / total).collect();
    let filtered = |value: &dyn Fn(f64, f64) -> f64| {
        let plane: Vec<f64> = a.iter().zip(b).map(|(a, b)| value(*a, *b)).collect();
        convolve::separable(&plane, size, &kernel, &kernel, convolve::Edge::Symmetric, threads)
    };
    let (ma, mb) = (filtered(&|a, _| a), filtered(&|_, b| b));
    let (aa, bb, ab) = (filtered(&|a, _| a * a), filtered(&|_, b| b * b), filtered(&|a, b| a * b));
    let mut full = vec![0.0; a.len()];
    let mut structure = vec![0.0; a.len()];
    for i in 0..a.len() {
        let (x, y) = (ma[i], mb[i]);
        let (vx, vy, cov) = (aa[i] - x * x, bb[i] - y * y, ab[i] - x * y);
        structure[i] = (2.0 * cov + C2) / (vx + vy + C2);
        full[i] = structure[i] * (2.0 * x * y + C1) / (x * x + y * y + C1);
    }
    Maps { full, structure }
}

/// Mean over the pixels whose window lies inside.
fn inner_mean(map: &[f64], [width, height]: [usize; 2], threads: usize) -> f64 {
    let inner = [width - 2 * RADIUS, height - 2 * RADIUS];
    let [sum] = parallel::sum(threads, inner, |i| {
        let (x, y) = (i % inner[0] + RADIUS, i / inner[0] + RADIUS);
        [map[y * width + x]]
    });
    sum / (inner[0] * inner[1]) as f64
}

/// Averages of 2×2; an odd last row or column stands twice.
fn halve(plane: &[f64], [width, height]: [usize; 2]) -> Vec<f64> {
    let (w, h) = (width.div_ceil(2), height.div_ceil(2));
    let at = |x: usize, y: usize| plane[y.min(height - 1) * width + x.min(width - 1)];
    let block = |x: usize, y: usize| (at(x, y) + at(x + 1, y) + at(x, y + 1) + at(x + 1, y + 1)) / 4.0;
    (0..w * h).map(|i| block(i % w * 2, i / w * 2)).collect()
}

//! The visible differences predictor: S. Daly, "The Visible Differences Predictor: An Algorithm for the Assessment of Image
//! Fidelity" (1993). Own implementation from the published formulas.
//!
//! What is done: luminance of the screen → response of the retina L/(L + 12.6 L^0.63) → contrast sensitivity function as a filter →
//! 31 channels (five octaves in six orientations, and a base) → in each channel the difference over its threshold, raised by the weaker of
//! both images' masks, (1 + (0.0153 (392.498 m)^0.7)^4)^¼ → psychometric function 1 − exp(−d^3.5) → probability summation.
//!
//! Where it differs from the paper, or settles what the paper leaves open:
//! - contrast is relative to the response to the reference's mean luminance in both images (global contrast), and is divided by the slope of the
//!   response there, so that a grating's threshold in luminance contrast is 1/CSF, whatever the adaptation;
//! - difference of the means is judged at the sensitivity for one cycle in the image's longer side: the CSF itself is 0 there, and
//!   would let any change of brightness pass;
//! - masks are the values of the channels themselves (no phase uncertainty, no learning effect beyond the choice of the slope);
//! - the observer looks straight at every pixel (no eccentricity) from 0.7 m; the screen's black has a thousandth of its white;
//! - colour is not looked at; the sign of differences is not kept.

mod cortex;
mod csf;
mod fft;

use fft::Complex;

use super::{Map, Measure, Measured, Options, Pair, display, luminance, parallel};
use crate::Result;

/// Black of the screen over its white.
const BLACK: f64 = 1e-3;
/// A difference of less than this part of its threshold adds nothing that can be told from 0.
const NOTHING: f32 = 1e-4;

/// Share of pixels, %, whose difference is detected with a probability above [`Options::vdp_threshold`] (0.75).
///
/// On what a screen shows, whose white has [`Options::white_luminance`], at [`Options::pixels_per_degree`]. The map is the probability.
pub fn vdp(pair: &Pair<'_>, options: &Options) -> Result<Measured> {
    let size = [pair.width(), pair.height()];
    let threads = parallel::threads(options.threads);
    let shown = display::shown(pair, options);
    let white = options.white_luminance;
    let light = |image: &[[f32; 3]]| -> Vec<f64> {
        image.iter().map(|p| white * (BLACK + (1.0 - BLACK) * luminance(*p))).collect()
    };
    let (reference, test) = (light(&shown.reference), light(&shown.test));
    let [sum] = parallel::sum(threads, size, |i| [reference[i]]);
    let adaptation = sum / reference.len() as f64;
    let probability = if reference == test {
        vec![0.0; reference.len()]
    } else {
        detect(&reference, &test, size, adaptation, options, threads)
    };
    let detected = probability.iter().filter(|p| f64::from(**p) > options.vdp_threshold).count();
    let [total] = parallel::sum(threads, size, |i| [f64::from(probability[i])]);
    let share = 100.0 * detected as f64 / probability.len() as f64;
    let mean = total / probability.len() as f64;
    let map = Map {
        width: pair.reference.width,
        height: pair.reference.height,
        values: probability,
        range: [0.0, 1.0],
        meaning: "probability that the difference is detected",
    };
    Ok(Measured::new(Measure::Vdp, share, map)
        .with("pixels", detected as f64)
        .with("mean_probability", mean)
        .with("adaptation", adaptation)
        .with("exposure", shown.stops)
        .with("pixels_per_degree", options.pixels_per_degree))
}

/// Probability of detection of every pixel.
fn detect(
    reference: &[f64],
    test: &[f64],
    size: [usize; 2],
    adaptation: f64,
    options: &Options,
    threads: usize,
) -> Vec<f32> {
    // Room for what reaches over the edge, and a length that transforms well.
    let padded = size.map(|n| fft::good_length(n + (n / 8).clamp(16, 128)));
    let (level, slope) = (csf::response(adaptation), csf::response_slope(adaptation));
    let contrast = |l: f64| ((csf::response(l) / level - 1.0) / slope) as f32;
    // Filters are real and even: one image in the real part and one in the imaginary part stay apart.
    let both: Vec<Complex> = reference.iter().zip(test).map(|(r, t)| [contrast(*r), contrast(*t)]).collect();
    let mut spectrum = forward(&pad(&both, size, padded), padded, threads);
    let grid = Grid { padded, per_degree: options.pixels_per_degree };
    let area = size.iter().map(|n| *n as f64 / options.pixels_per_degree).product();
    let longest = size[0].max(size[1]) as f64 / options.pixels_per_degree;
    weigh(&mut spectrum, grid, &csf::Sensitivity::new(adaptation, area), 1.0 / longest, threads);

    let mut sums = vec![0.0_f32; padded[0] * padded[1]];
    let inverse = [fft::Line::new(padded[1], true), fft::Line::new(padded[0], true)];
    let mut band = vec![[0.0; 2]; spectrum.len()];
    let mut plane = band.clone();
    let (masking, psychometric) = (options.vdp_masking_slope as f32, options.vdp_psychometric_slope as f32);
    for channel in cortex::channels() {
        // Rows are horizontal frequencies: those beyond the channel are empty and need no transform.
        let used = |fx: usize| grid.cycles(fx, 0).abs() * 2.0 <= channel.limit();
        parallel::rows(threads, &mut band, padded[1], |fx, row| {
            if !used(fx) {
                row.fill([0.0; 2]);
                return;
            }
            for (fy, value) in row.iter_mut().enumerate() {
                let (frequency, angle) = grid.polar(fx, fy);
                let gain = channel.gain(frequency, angle) as f32;
                *value = spectrum[fx * padded[1] + fy].map(|v| v * gain);
            }
        });
        fft::rows(&inverse[0], &mut band, threads, used);
        fft::transpose(&band, &mut plane, padded[1], threads);
        fft::rows(&inverse[1], &mut plane, threads, |y| y < size[1]);
        parallel::rows(threads, &mut sums, padded[0], |y, row| {
            for (sum, [r, t]) in row.iter_mut().zip(&plane[y * padded[0]..]) {
                let difference = (r - t).abs();
                if difference > NOTHING {
                    *sum += (difference / elevation(r.abs().min(t.abs()), masking)).powf(psychometric);
                }
            }
        });
    }
    let rows = sums.chunks_exact(padded[0]).take(size[1]);
    rows.flat_map(|row| &row[..size[0]]).map(|sum| 1.0 - (-sum).exp()).collect()
}

/// By how much a mask of `m` thresholds raises the threshold of its channel.
fn elevation(m: f32, slope: f32) -> f32 {
    (1.0 + (0.0153 * (392.498 * m).powf(slope)).powi(4)).sqrt().sqrt()
}

/// Frequencies of the spectrum, in rows of one horizontal frequency.
#[derive(Clone, Copy)]
struct Grid {
    padded: [usize; 2],
    per_degree: f64,
}

impl Grid {
    /// Cycles a pixel of an index in one direction (0: x).
    fn cycles(&self, index: usize, direction: usize) -> f64 {
        let n = self.padded[direction];
        let signed = if index > n / 2 { index as f64 - n as f64 } else { index as f64 };
        signed / n as f64
    }

    /// In units of half a cycle a pixel, and the angle.
    fn polar(&self, fx: usize, fy: usize) -> (f64, f64) {
        let (x, y) = (self.cycles(fx, 0), self.cycles(fy, 1));
        (2.0 * x.hypot(y), y.atan2(x))
    }
}

/// Multiplies by the sensitivity, and by the scale of the inverse transform.
fn weigh(spectrum: &mut [Complex], grid: Grid, eye: &csf::Sensitivity, lowest: f64, threads: usize) {
    let scale = 1.0 / (grid.padded[0] * grid.padded[1]) as f64;
    parallel::rows(threads, spectrum, grid.padded[1], |fx, row| {
        for (fy, value) in row.iter_mut().enumerate() {
            let (frequency, angle) = grid.polar(fx, fy);
            let cycles = (0.5 * frequency * grid.per_degree).max(lowest);
            let weight = (eye.at(cycles, angle) * scale) as f32;
            *value = value.map(|v| v * weight);
        }
    });
}

/// Mirrors at every edge, going over from one side's mirror image to the other's in between, because the transform repeats the image.
fn pad(image: &[Complex], [width, height]: [usize; 2], [w, h]: [usize; 2]) -> Vec<Complex> {
    let line = |i: usize, n: usize, padded: usize| -> (usize, usize, f32) {
        if i < n {
            return (i, i, 0.0);
        }
        let (right, left) = (2 * n - 1 - i.min(2 * n - 1), (padded - 1 - i).min(n - 1));
        (right, left, (i - n + 1) as f32 / (padded - n + 1) as f32)
    };
    let mix = |a: Complex, b: Complex, t: f32| [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t];
    let mut out = Vec::with_capacity(w * h);
    for y in 0..h {
        let (below, above, ty) = line(y, height, h);
        for x in 0..w {
            let (right, left, tx) = line(x, width, w);
            let row = |y: usize| mix(image[y * width + right], image[y * width + left], tx);
            out.push(mix(row(below), row(above), ty));
        }
    }
    out
}

/// The spectrum in rows of one horizontal frequency.
fn forward(image: &[Complex], [width, height]: [usize; 2], threads: usize) -> Vec<Complex> {
    let mut rows = image.to_vec();
    fft::rows(&fft::Line::new(width, false), &mut rows, threads, |_| true);
    let mut spectrum = vec![[0.0; 2]; rows.len()];
    fft::transpose(&rows, &mut spectrum, width, threads);
    fft::rows(&fft::Line::new(height, false), &mut spectrum, threads, |_| true);
    spectrum
}

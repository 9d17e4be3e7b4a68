//! FLIP: Andersson et al., "FLIP: A Difference Evaluator for Alternating Images" (2020), and its extension to HDR (2021), with the
//! separated filters of the authors' program (version 1.2 and later). Own implementation.

mod colour;
mod filters;

use super::{Map, Measure, Measured, Options, Pair, Picture, ToneCurve, display, luminance, parallel};
use crate::{Error, Result};

/// Exponent of colour differences.
const QC: f32 = 0.7;
/// Exponent of feature differences.
const QF: f32 = 0.5;

/// Mean over pixels of LDR-FLIP: how different the images look when they are flipped between, 0 to 1.
///
/// On what a screen shows ([`super::Display`]), at [`Options::pixels_per_degree`].
pub fn flip(pair: &Pair<'_>, options: &Options) -> Result<Measured> {
    let size = [pair.width(), pair.height()];
    let threads = parallel::threads(options.threads);
    let shown = display::shown(pair, options);
    let filters = filters::Filters::new(options.pixels_per_degree);
    let values = errors(&shown.reference, &shown.test, size, &filters, threads);
    let mean = mean(&values, size, threads);
    let map = map(pair, values, "FLIP error");
    Ok(Measured::new(Measure::Flip, mean, map)
        .with("exposure", shown.stops)
        .with("pixels_per_degree", options.pixels_per_degree))
}

/// Mean over pixels of HDR-FLIP: the largest LDR-FLIP error of the pixel over a range of exposures, each shown through
/// [`Options::flip_curve`].
///
/// The range comes from the reference as the authors' program finds it: from the exposure at which its brightest pixel, to the one
/// at which its median luminance, is shown as 0.85; one exposure a stop, at least two. Where the median is black it is the median of
/// what is not (the program gives infinity there). [`Options::flip_start`], [`Options::flip_stop`] and
/// [`Options::flip_exposures`] replace them; `start_exposure`, `stop_exposure` and `exposures` say what was taken.
///
/// # Errors
/// `Usage` if a given start lies above the stop that was found, or the other way round.
pub fn hdr_flip(pair: &Pair<'_>, options: &Options) -> Result<Measured> {
    let size = [pair.width(), pair.height()];
    let threads = parallel::threads(options.threads);
    let (auto_start, auto_stop, dark) = exposure_range(pair.reference, options.flip_curve);
    let start = options.flip_start.unwrap_or(auto_start);
    let stop = options.flip_stop.unwrap_or(auto_stop);
    if start > stop {
        return Err(Error::usage(format!("HDR-FLIP's exposures would go from {start:.3} down to {stop:.3}"))
            .help("Give both flip-start and flip-stop, in stops"));
    }
    let count = options.flip_exposures.unwrap_or(((stop - start).ceil() as u32).clamp(2, 64));
    let filters = filters::Filters::new(options.pixels_per_degree);
    let mut worst = vec![0.0_f32; size[0] * size[1]];
    for i in 0..count {
        let stops = start + (stop - start) * f64::from(i) / f64::from(count - 1);
        let expose = |picture: &Picture| display::expose(picture, stops, options.flip_curve, threads);
        let values = errors(&expose(pair.reference), &expose(pair.test), size, &filters, threads);
        worst.iter_mut().zip(values).for_each(|(w, v)| *w = w.max(v));
    }
    let mean = mean(&worst, size, threads);
    let map = map(pair, worst, "largest FLIP error over the exposures");
    let measured = Measured::new(Measure::HdrFlip, mean, map)
        .with("start_exposure", start)
        .with("stop_exposure", stop)
        .with("exposures", f64::from(count))
        .with("pixels_per_degree", options.pixels_per_degree);
    Ok(if dark && options.flip_stop.is_none() {
        measured.noted("more than half of the reference is black: the exposures come from the rest")
    } else {
        measured
    })
}

fn map(pair: &Pair<'_>, values: Vec<f32>, meaning: &'static str) -> Map {
    Map { width: pair.reference.width, height: pair.reference.height, values, range: [0.0, 1.0], meaning }
}

fn mean(values: &[f32], size: [usize; 2], threads: usize) -> f64 {
    let [sum] = parallel::sum(threads, size, |i| [f64::from(values[i])]);
    sum / values.len() as f64
}

/// Start and stop in stops, and whether the median had to be taken of what is not black.
fn exposure_range(reference: &Picture, curve: ToneCurve) -> (f64, f64, bool) {
    let mut sorted: Vec<f64> = reference.pixels.iter().map(|p| luminance(*p).max(0.0)).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let middle = |list: &[f64]| match list.len() {
        0 => 0.0,
        n if n < 2 => list[0],
        n => 0.5 * (list[n / 2 - 1] + list[n / 2]),
    };
    let brightest = sorted.last().copied().unwrap_or(0.0);
    if brightest <= 0.0 {
        return (0.0, 0.0, false);
    }
    let median = middle(&sorted);
    let dark = median <= 0.0;
    let median = if dark { middle(&sorted[sorted.partition_point(|v| *v <= 0.0)..]) } else { median };
    let shown = shown_as_085(curve);
    ((shown / brightest).log2(), (shown / median).log2(), dark)
}

/// The grey value that the curve shows as 0.85.
fn shown_as_085(curve: ToneCurve) -> f64 {
    let k = match curve {
        ToneCurve::Clip => return 0.85,
        ToneCurve::Reinhard => return 0.85 / 0.15,
        ToneCurve::Aces => display::ACES,
        ToneCurve::Hable => display::HABLE,
    };
    let [a, b, c] = [0, 1, 2].map(|i| f64::from(k[i]) - 0.85 * f64::from(k[i + 3]));
    let middle = -0.5 * b / a;
    middle + (middle * middle - c / a).sqrt()
}

/// FLIP error of every pixel of two images of linear values in [0, 1].
fn errors(
    reference: &[[f32; 3]],
    test: &[[f32; 3]],
    size: [usize; 2],
    filters: &filters::Filters,
    threads: usize,
) -> Vec<f32> {
    let opponent = |image: &[[f32; 3]]| -> [Vec<f32>; 3] {
        let mut pixels = image.to_vec();
        parallel::rows(threads, &mut pixels, size[0], |_, row| {
            row.iter_mut().for_each(|p| *p = colour::opponent_from_linear(*p));
        });
        [0, 1, 2].map(|c| pixels.iter().map(|p| p[c]).collect())
    };
    let (r, t) = (opponent(reference), opponent(test));
    let (seen_r, seen_t) = (filters.seen(&r, size, threads), filters.seen(&t, size, threads));
    let (features_r, features_t) = (filters.features(&r[0], size, threads), filters.features(&t[0], size, threads));
    let largest = colour::largest_difference().powf(QC);
    let mut out = vec![0.0; size[0] * size[1]];
    parallel::rows(threads, &mut out, size[0], |y, row| {
        for (x, value) in row.iter_mut().enumerate() {
            let i = y * size[0] + x;
            let colours = |p: &[Vec<f32>; 3]| colour::adjusted_lab([p[0][i], p[1][i], p[2][i]]);
            let difference = colour::distance(colours(&seen_r), colours(&seen_t)).powf(QC);
            let colour = redistribute(difference, largest);
            let [edge, point] = [0, 1].map(|k| (features_r[k][i] - features_t[k][i]).abs());
            let feature = (edge.max(point) * std::f32::consts::FRAC_1_SQRT_2).powf(QF);
            *value = colour.powf(1.0 - feature);
        }
    });
    out
}

/// Differences up to 0.4 of the largest fill [0, 0.95], the rest what is above.
fn redistribute(difference: f32, largest: f32) -> f32 {
    const SHARE: f32 = 0.4;
    const TARGET: f32 = 0.95;
    let knee = SHARE * largest;
    if difference < knee {
        difference * TARGET / knee
    } else {
        TARGET + (difference - knee) / (largest - knee) * (1.0 - TARGET)
    }
}

//! Measures that are arithmetic on pixel values: MAE, RMSE, NRMSE, relative errors, PSNR, correlation.
//!
//! r and t are a channel of a pixel of reference and test; sums run over all pixels and, unless luminance is named, all three channels.
//! Sums are taken in f64, row by row.

use super::{Map, Measure, Measured, NrmseRange, Options, Pair, Space, display, luminance, parallel};
use crate::Result;

/// Values that a measure compares, with how they came about.
pub(super) struct Values {
    pub reference: Vec<[f32; 3]>,
    pub test: Vec<[f32; 3]>,
    pub size: [usize; 2],
    pub threads: usize,
    /// Exposure in stops, if a screen was between.
    pub stops: Option<f64>,
    /// The brightest colour of maps of absolute errors: a quarter of the 99th percentile of the reference's channels, or 0.25 of
    /// what a screen shows.
    pub scale: f32,
}

impl Values {
    pub(super) fn new(pair: &Pair<'_>, options: &Options, default: Space) -> Self {
        let (size, threads) = ([pair.width(), pair.height()], parallel::threads(options.threads));
        match options.space.unwrap_or(default) {
            Space::Linear => {
                let (reference, test) = (pair.reference.pixels.clone(), pair.test.pixels.clone());
                let scale = 0.25 * percentile(reference.as_flattened(), 0.99);
                Self { reference, test, size, threads, stops: None, scale }
            }
            Space::Display => {
                let mut shown = display::shown(pair, options);
                display::encode(&mut shown.reference, threads);
                display::encode(&mut shown.test, threads);
                let (reference, test) = (shown.reference, shown.test);
                Self { reference, test, size, threads, stops: Some(shown.stops), scale: 0.25 }
            }
        }
    }

    /// Sum over pixels of what `pixel` makes of reference and test.
    fn sum<const N: usize>(&self, pixel: impl Fn([f64; 3], [f64; 3]) -> [f64; N] + Sync) -> [f64; N]
    where
        [f64; N]: Default,
    {
        parallel::sum(self.threads, self.size, |i| pixel(wide(self.reference[i]), wide(self.test[i])))
    }

    fn map(&self, meaning: &'static str, range: [f32; 2], pixel: impl Fn([f64; 3], [f64; 3]) -> f64 + Sync) -> Map {
        let [width, height] = self.size;
        let mut values = vec![0.0; width * height];
        parallel::rows(self.threads, &mut values, width, |y, row| {
            for (x, value) in row.iter_mut().enumerate() {
                let i = y * width + x;
                *value = pixel(wide(self.reference[i]), wide(self.test[i])) as f32;
            }
        });
        Map { width: width as u32, height: height as u32, values, range, meaning }
    }

    fn samples(&self) -> f64 {
        3.0 * self.pixels()
    }

    fn pixels(&self) -> f64 {
        (self.size[0] * self.size[1]) as f64
    }

    fn finish(&self, measured: Measured) -> Measured {
        match self.stops {
            Some(stops) => measured.with("exposure", stops),
            None => measured,
        }
    }
}

fn wide(pixel: [f32; 3]) -> [f64; 3] {
    pixel.map(f64::from)
}

/// At least the smallest positive number, so that it can be divided by.
fn percentile(values: &[f32], q: f64) -> f32 {
    let mut sorted: Vec<f32> = values.to_vec();
    let at = ((sorted.len() as f64 * q) as usize).min(sorted.len().saturating_sub(1));
    if sorted.is_empty() { 1.0 } else { sorted.select_nth_unstable_by(at, f32::total_cmp).1.max(f32::MIN_POSITIVE) }
}

/// Mean of |r − t| over channels: the error factor of a pixel.
pub(super) fn absolute(r: [f64; 3], t: [f64; 3]) -> f64 {
    (0..3).map(|c| (r[c] - t[c]).abs()).sum::<f64>() / 3.0
}

fn squared(r: [f64; 3], t: [f64; 3]) -> f64 {
    (0..3).map(|c| (r[c] - t[c]).powi(2)).sum::<f64>() / 3.0
}

/// Mean absolute error, 1/(3wh) Σ|r − t|: the error factor ε [ISR 19] of Imalyzer.
///
/// Linear values; that program took the codes of PNG files, which [`Space::Display`] gives as 0 to 1.
pub fn mae(pair: &Pair<'_>, options: &Options) -> Result<Measured> {
    let values = Values::new(pair, options, Space::Linear);
    let [sum] = values.sum(|r, t| [absolute(r, t)]);
    let map = values.map("mean |r − t| of the channels", [0.0, values.scale], absolute);
    Ok(values.finish(Measured::new(Measure::Mae, sum / values.pixels(), map)))
}

/// √(1/(3wh) Σ(r − t)²).
pub fn rmse(pair: &Pair<'_>, options: &Options) -> Result<Measured> {
    let values = Values::new(pair, options, Space::Linear);
    let [sum] = values.sum(|r, t| [squared(r, t)]);
    let map = values.map("√ of the channels' mean (r − t)²", [0.0, values.scale], |r, t| squared(r, t).sqrt());
    Ok(values.finish(Measured::new(Measure::Rmse, (sum / values.pixels()).sqrt(), map)))
}

/// For each channel √(1/n Σ(r − t)²) / (max − min), then the mean of the three ([FIV 17]).
///
/// The text takes maximum and minimum "of all pixels in the images"; here it is the reference's range unless
/// [`NrmseRange::Both`] is chosen, so that several tests are divided by the same number. A channel that is the same everywhere
/// counts 0 if it has no error; otherwise the value is not defined.
pub fn nrmse(pair: &Pair<'_>, options: &Options) -> Result<Measured> {
    let values = Values::new(pair, options, Space::Linear);
    let sums: [f64; 3] = values.sum(|r, t| std::array::from_fn(|c| (r[c] - t[c]).powi(2)));
    let mut range = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
    let test: &[[f32; 3]] = if options.nrmse_range == NrmseRange::Both { &values.test } else { &[] };
    for pixel in values.reference.iter().chain(test) {
        for (range, v) in range.iter_mut().zip(wide(*pixel)) {
            *range = [range[0].min(v), range[1].max(v)];
        }
    }
    let span = range.map(|[low, high]| high - low);
    let over = |error: f64, span: f64| {
        if error == 0.0 {
            0.0
        } else if span > 0.0 {
            error / span
        } else {
            f64::NAN
        }
    };
    let value = (0..3).map(|c| over((sums[c] / values.pixels()).sqrt(), span[c])).sum::<f64>() / 3.0;
    let map = values.map("mean |r − t| / range of the channels", [0.0, 0.25], |r, t| {
        (0..3).map(|c| if span[c] > 0.0 { (r[c] - t[c]).abs() / span[c] } else { 0.0 }).sum::<f64>() / 3.0
    });
    let measured = Measured::new(Measure::Nrmse, value, map);
    let measured = if value.is_nan() {
        measured.noted("not defined: a channel of the reference is the same everywhere, and the test differs in it")
    } else {
        measured
    };
    Ok(values.finish(measured))
}

/// Relative error of luminance; `None` where the reference is black and the test is not.
fn relative(r: [f64; 3], t: [f64; 3]) -> Option<f64> {
    let weigh = |p: [f64; 3]| luminance(p.map(|v| v as f32));
    let (r, t) = (weigh(r), weigh(t));
    if r == t {
        Some(0.0)
    } else if r == 0.0 {
        None
    } else {
        Some((r - t) / r)
    }
}

fn percent(measure: Measure, pair: &Pair<'_>, options: &Options, power: i32, meaning: &'static str) -> Measured {
    let values = Values::new(pair, options, Space::Linear);
    let [sum, left_out] = values.sum(|r, t| relative(r, t).map_or([0.0, 1.0], |e| [e.abs().powi(power), 0.0]));
    let counted = values.pixels() - left_out;
    let mean = if counted > 0.0 { sum / counted } else { f64::NAN };
    let value = 100.0 * if power == 2 { mean.sqrt() } else { mean };
    let map = values.map(meaning, [0.0, 100.0], |r, t| relative(r, t).map_or(100.0, |e| 100.0 * e.abs()));
    let mut measured = Measured::new(measure, value, map).with("left_out_pixels", left_out);
    if counted == 0.0 {
        measured = measured.noted("not defined: the reference is black everywhere");
    } else if left_out > 0.0 {
        measured =
            measured.noted(format!("{left_out} pixels are left out: the reference is black there and the test is not"));
    }
    values.finish(measured)
}

/// 100 √(1/n Σ((r − t)/r)²) of luminances ([TM 18]). Pixels where the reference is black and the test is not are left
/// out, and counted.
pub fn rms_percent(pair: &Pair<'_>, options: &Options) -> Result<Measured> {
    Ok(percent(Measure::RmsPercent, pair, options, 2, "|r − t|/r of luminance, %"))
}

/// 100/n Σ|(r − t)/r| of luminances ([TM 19]), with the same rule for black.
pub fn mean_percent(pair: &Pair<'_>, options: &Options) -> Result<Measured> {
    Ok(percent(Measure::MeanPercent, pair, options, 1, "|r − t|/r of luminance, %"))
}

/// 1/(3wh) Σ (r − t)²/(r² + ε), ε = 0.01: the error of Monte Carlo images (Rousselle et al. 2011).
pub fn rel_mse(pair: &Pair<'_>, options: &Options) -> Result<Measured> {
    let values = Values::new(pair, options, Space::Linear);
    let epsilon = options.rel_mse_epsilon;
    let error =
        |r: [f64; 3], t: [f64; 3]| (0..3).map(|c| (r[c] - t[c]).powi(2) / (r[c] * r[c] + epsilon)).sum::<f64>() / 3.0;
    let [sum] = values.sum(|r, t| [error(r, t)]);
    let map = values.map("mean (r − t)²/(r² + ε) of the channels", [0.0, 0.25], error);
    Ok(values.finish(Measured::new(Measure::RelMse, sum / values.pixels(), map).with("epsilon", epsilon)))
}

/// 10 log₁₀(peak²/MSE), dB: of displayed values with peak 1; with [`Space::Linear`] the peak is the reference's largest value.
/// Infinite for equal images.
pub fn psnr(pair: &Pair<'_>, options: &Options) -> Result<Measured> {
    let values = Values::new(pair, options, Space::Display);
    let [sum] = values.sum(|r, t| [squared(r, t)]);
    let peak = match values.stops {
        Some(_) => 1.0,
        None => values.reference.as_flattened().iter().fold(0.0, |a: f64, b| a.max(f64::from(*b))),
    };
    let mse = sum / values.pixels();
    let value = if mse == 0.0 { f64::INFINITY } else { 10.0 * (peak * peak / mse).log10() };
    let map = values.map("√ of the channels' mean (r − t)²", [0.0, values.scale], |r, t| squared(r, t).sqrt());
    let measured = Measured::new(Measure::Psnr, value, map).with("peak", peak);
    Ok(values.finish(if mse == 0.0 { measured.noted("infinite: the images are equal") } else { measured }))
}

/// Correlation of all channel values, 1/n Σ (r − μr)/σr (t − μt)/σt ([ISR 20]).
///
/// Equal images give 1. Not defined if either image has one value everywhere.
pub fn pearson(pair: &Pair<'_>, options: &Options) -> Result<Measured> {
    let values = Values::new(pair, options, Space::Linear);
    let n = values.samples();
    let [sr, st] = values.sum(|r, t| [r.iter().sum(), t.iter().sum()]);
    let (mr, mt) = (sr / n, st / n);
    // In a second pass: nothing is lost when the mean is large.
    let [vr, vt, product] = values.sum(|r, t| {
        (0..3).fold([0.0; 3], |[a, b, c], k| {
            let (x, y) = (r[k] - mr, t[k] - mt);
            [a + x * x, b + y * y, c + x * y]
        })
    });
    let scale = vr.sqrt() * vt.sqrt();
    let equal = values.reference == values.test;
    let value = match (equal, scale > 0.0) {
        (true, _) => 1.0,
        (_, true) => (product / scale).clamp(-1.0, 1.0),
        _ => f64::NAN,
    };
    let map = values.map("product of the standard scores, mean of the channels", [-1.0, 3.0], |r, t| {
        if scale > 0.0 { (0..3).map(|k| (r[k] - mr) * (t[k] - mt)).sum::<f64>() / 3.0 * n / scale } else { 0.0 }
    });
    let measured = Measured::new(Measure::Pearson, value, map);
    let measured = if value.is_nan() {
        measured.noted("not defined: one of the images has the same value everywhere")
    } else {
        measured
    };
    Ok(values.finish(measured))
}

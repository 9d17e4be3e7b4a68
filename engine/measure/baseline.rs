//! Measures of three images: is the test nearer to the reference than a baseline is?
//!
//! The dissertation's question: I0 is the model image (here `reference`), I1 direct light alone (`baseline`), I2 the method
//! (`test`). ε is the mean absolute error ([`super::arithmetic::mae`]).

use super::{
    Map, Measure, Measured, Options, Pair, Space,
    arithmetic::{Values, absolute},
    parallel,
};
use crate::{Error, Result};

/// Errors of every pixel, and their means.
struct Errors {
    test: Vec<f64>,
    baseline: Vec<f64>,
    test_mean: f64,
    baseline_mean: f64,
    size: [usize; 2],
    stops: Option<f64>,
}

impl Errors {
    fn new(measure: Measure, pair: &Pair<'_>, options: &Options) -> Result<Self> {
        let Some(baseline) = pair.baseline else {
            return Err(Error::usage(format!("{measure} asks whether the test is better than a third image"))
                .help("Name the image to beat (Pair::with_baseline; --baseline FILE)"));
        };
        let tested = Values::new(pair, options, Space::Linear);
        let based = Values::new(&Pair { test: baseline, ..*pair }, options, Space::Linear);
        let errors = |values: &Values| -> Vec<f64> {
            values
                .reference
                .iter()
                .zip(&values.test)
                .map(|(r, t)| absolute(r.map(f64::from), t.map(f64::from)))
                .collect()
        };
        let (test, baseline) = (errors(&tested), errors(&based));
        let mean = |list: &[f64]| {
            let [sum] = parallel::sum(tested.threads, tested.size, |i| [list[i]]);
            sum / list.len() as f64
        };
        let (test_mean, baseline_mean) = (mean(&test), mean(&baseline));
        Ok(Self { test, baseline, test_mean, baseline_mean, size: tested.size, stops: tested.stops })
    }

    fn finish(
        self,
        measure: Measure,
        value: f64,
        meaning: &'static str,
        range: [f32; 2],
        pixel: impl Fn(f64, f64) -> f64,
    ) -> Measured {
        let values = self.test.iter().zip(&self.baseline).map(|(t, b)| pixel(*t, *b) as f32).collect();
        let map = Map { width: self.size[0] as u32, height: self.size[1] as u32, values, range, meaning };
        let measured = Measured::new(measure, value, map)
            .with("test_error", self.test_mean)
            .with("baseline_error", self.baseline_mean);
        match self.stops {
            Some(stops) => measured.with("exposure", stops),
            None => measured,
        }
    }
}

/// −1 where the test is nearer, 1 where the baseline is, 0 where they are equal.
fn sign(test: f64, baseline: f64) -> f64 {
    if test < baseline {
        -1.0
    } else if test > baseline {
        1.0
    } else {
        0.0
    }
}

/// Quality function f_q(I0, I1, I2) of the dissertation ([ISR 21]) with I1 the baseline and I2 the test: −1 if the test's mean error is
/// smaller, 1 if the baseline's is, 0 if they are equal. Lower is better.
pub fn fq(pair: &Pair<'_>, options: &Options) -> Result<Measured> {
    let errors = Errors::new(Measure::Fq, pair, options)?;
    let value = sign(errors.test_mean, errors.baseline_mean);
    Ok(errors.finish(Measure::Fq, value, "-1: test nearer, 1: baseline nearer", [-1.0, 1.0], sign))
}

/// 100 (ε_baseline − ε_test)/ε_baseline, %: the quality gain of the dissertation's figure 5.9. Negative if the test is worse. Not
/// defined if the baseline is the reference itself and the test is not.
pub fn gain(pair: &Pair<'_>, options: &Options) -> Result<Measured> {
    let errors = Errors::new(Measure::Gain, pair, options)?;
    let (test, baseline) = (errors.test_mean, errors.baseline_mean);
    let over = |t: f64, b: f64| if t == b { 0.0 } else { 100.0 * (b - t) / b };
    let value = if baseline == 0.0 && test > 0.0 { f64::NAN } else { over(test, baseline) };
    // Of the mean error: the pixels' values then have the gain as their mean.
    let each = |t: f64, b: f64| if baseline > 0.0 { 100.0 * (b - t) / baseline } else { 0.0 };
    let measured = errors.finish(
        Measure::Gain,
        value,
        "error taken away by the test, % of the baseline's mean error",
        [-100.0, 100.0],
        each,
    );
    Ok(if value.is_nan() { measured.noted("not defined: the baseline has no error to gain from") } else { measured })
}

/// Share of pixels, %, whose error (mean of |r − t| over channels) is smaller in the test than in the baseline; equal ones do not
/// count (`equal` says how many). The dissertation's 99.05 %.
pub fn improved(pair: &Pair<'_>, options: &Options) -> Result<Measured> {
    let errors = Errors::new(Measure::Improved, pair, options)?;
    let count = |wanted: f64| {
        let pairs = errors.test.iter().zip(&errors.baseline);
        100.0 * pairs.filter(|(t, b)| sign(**t, **b) == wanted).count() as f64 / errors.test.len() as f64
    };
    let (better, equal, worse) = (count(-1.0), count(0.0), count(1.0));
    let meaning = "1: test nearer, 0: equal, -1: baseline nearer";
    let measured = errors.finish(Measure::Improved, better, meaning, [-1.0, 1.0], |t, b| -sign(t, b));
    Ok(measured.with("equal", equal).with("worse", worse))
}

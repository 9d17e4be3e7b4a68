//! What operators ask about a whole picture.

/// δ of the log-average.
pub const DELTA: f64 = 1e-6;

/// Of the luminances of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statistics {
    pub min: f64,
    pub max: f64,
    /// Reinhard 2002, equation 1.
    pub log_average: f64,
}

/// Statistics of luminances, `percent` of them left out at each end of minimum and maximum. Zeros without pixels.
pub fn statistics(luminance: &[f64], percent: f64) -> Statistics {
    if luminance.is_empty() {
        return Statistics { min: 0.0, max: 0.0, log_average: 0.0 };
    }
    let mut sorted = luminance.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    // Counted from 1, at least 1.
    let rank = ((n as f64 * percent / 100.0).ceil() as usize).clamp(1, n);
    Statistics { min: sorted[rank - 1], max: sorted[n - rank], log_average: log_average(luminance, DELTA) }
}

/// exp of the mean of ln(δ + L) over what is not black; δ if all is.
pub fn log_average(luminance: &[f64], delta: f64) -> f64 {
    let logs: Vec<f64> = luminance.iter().filter(|l| **l > 0.0).map(|l| (delta + l).ln()).collect();
    if logs.is_empty() { delta } else { (logs.iter().sum::<f64>() / logs.len() as f64).exp() }
}

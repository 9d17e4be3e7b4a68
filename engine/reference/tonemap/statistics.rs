//! What operators ask about a whole picture.

/// Of the luminances of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statistics {
    pub min: f64,
    pub max: f64,
    /// exp of the mean of ln(δ + L), Reinhard 2002, equation 1.
    pub log_average: f64,
}

/// Statistics of luminances; `delta` keeps the logarithm of black finite. Zeros without pixels.
pub fn statistics(luminance: &[f64], delta: f64) -> Statistics {
    let Some(&first) = luminance.first() else { return Statistics { min: 0.0, max: 0.0, log_average: 0.0 } };
    let sum: f64 = luminance.iter().map(|l| (delta + l).ln()).sum();
    Statistics {
        min: luminance.iter().copied().fold(first, f64::min),
        max: luminance.iter().copied().fold(first, f64::max),
        log_average: (sum / luminance.len() as f64).exp(),
    }
}

/// The value that `share` (0 to 1) of the values do not exceed: by sorting, the element ⌈share · n⌉, counted from 1.
pub fn percentile(values: &[f64], share: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let rank = (share * sorted.len() as f64).ceil() as usize;
    sorted.get(rank.clamp(1, sorted.len().max(1)) - 1).copied()
}

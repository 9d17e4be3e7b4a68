//! Drago, Myszkowski, Annen and Chiba, "Adaptive logarithmic mapping for displaying high contrast scenes", 2003.

/// The bias for which the paper's adaptation luminance is the log-average.
const USUAL_BIAS: f64 = 0.85;

/// Equation 4, relative to the display's white. `luminance` and the largest one `high` in any unit; `log_average` in the same.
///
/// The paper divides luminances by the adaptation luminance, which is L_wa / (1 + b − 0.85)⁵ for a bias b, L_wa being the log-average.
pub fn display(luminance: f64, high: f64, log_average: f64, bias: f64) -> f64 {
    let adaptation = log_average / (1.0 + bias - USUAL_BIAS).powi(5);
    let (l, most) = (luminance / adaptation, high / adaptation);
    if most <= 0.0 {
        return 0.0;
    }
    // L beyond the largest, which a percentile leaves out, goes on by the base of the largest.
    let share = (l / most).min(1.0).powf(bias.ln() / 0.5f64.ln());
    (1.0 + l).ln() / (2.0 + 8.0 * share).ln() / (1.0 + most).log10()
}

//! From light to the codes of a screen, for PNG and JPEG files.

use super::srgb;

/// Into [0, 1]; NaN becomes 0.
pub(super) fn clamp(value: f32) -> f32 {
    if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0) }
}

/// Light in [0, 1] to a code in [0, 1]: the sRGB curve, or the power 1/gamma.
pub(super) fn encode(linear: f32, gamma: Option<f32>) -> f32 {
    gamma.map_or_else(|| srgb::encode(linear), |gamma| linear.powf(1.0 / gamma))
}

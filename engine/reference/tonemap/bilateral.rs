//! Durand and Dorsey, "Fast bilateral filtering for the display of high-dynamic-range images", 2002: base and detail.

use super::plane::{Plane, gaussian};

/// The bilateral filter as it is defined, pixel by pixel: near in space and near in value. `range` is the σ of values.
pub fn filter(values: &Plane, sigma: f64, radius: usize, range: f64) -> Plane {
    let weights = gaussian(sigma, radius);
    let radius = weights.len() as isize - 1;
    Plane::from_fn(values.width, values.height, |x, y| {
        let centre = values[(x, y)];
        let (mut sum, mut total) = (0.0, 0.0);
        for j in -radius..=radius {
            for i in -radius..=radius {
                let value = values.clamped(x as isize + i, y as isize + j);
                let far = (value - centre) / range;
                let weight = weights[i.unsigned_abs()] * weights[j.unsigned_abs()] * (-0.5 * far * far).exp();
                sum += weight * value;
                total += weight;
            }
        }
        sum / total
    })
}

/// The smallest luminance that is told apart, as a share of the largest.
pub const DARKEST: f64 = 1e-6;
/// The least share of the largest luminance that counts when the range is looked for.
pub const DEEPEST: f64 = 1e-4;

/// Compression of the base, in log₁₀.
#[derive(Clone, Copy, Debug)]
pub struct Base {
    /// log₁₀ L_max, which becomes white.
    pub white: f64,
    /// Factor of the base's contrast, at most 1.
    pub factor: f64,
}

impl Base {
    /// From L_min and L_max and the contrast that shall remain.
    pub fn new(min: f64, max: f64, contrast: f64) -> Self {
        let range = max.log10() - min.max(DEEPEST * max).log10();
        Self { white: max.log10(), factor: (contrast.log10() / range).min(1.0) }
    }

    /// log₁₀ of the display luminance of a base.
    pub fn map(&self, base: f64) -> f64 {
        self.factor * (base - self.white)
    }
}

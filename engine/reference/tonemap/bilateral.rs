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

//! Weights that keep light which changes evenly: a linear fit instead of a mean (local linear regression), with a ridge against noise.

use glam::Vec3;

/// Least and largest ridge, squares of texels. With neighbours on a line, a smaller ridge leaves a singular fit; a larger ridge changes nothing.
const RIDGE: [f32; 2] = [1e-3, 1e9];

/// Two unit vectors that span the plane of a normal.
pub fn tangents(normal: [f32; 3]) -> [[f32; 3]; 2] {
    let (x, y) = Vec3::from(normal).normalize_or(Vec3::Z).any_orthonormal_pair();
    [x.into(), y.into()]
}

/// Makes the sum of some weights 1, and moves their centre to a texel: light that changes evenly keeps its value where most neighbours lie on one side.
/// Balanced weights have more noise, so they are balanced as far as a change of the light is likelier than noise. `weights`: of the texel itself, whose
/// weight is 1, and of its neighbours; `ways`: to them, texels; `noise`: the variance of their light by that of its change from texel to texel.
pub fn balance(weights: &mut [f32], ways: &[[f32; 2]], noise: f32) {
    let [mut x, mut y, mut xx, mut xy, mut yy] = [0.0f32; 5];
    for (weight, [dx, dy]) in weights.iter().zip(ways) {
        (x, y) = (x + weight * dx, y + weight * dy);
        (xx, xy, yy) = (xx + weight * dx * dx, xy + weight * dx * dy, yy + weight * dy * dy);
    }
    let ridge = noise.clamp(RIDGE[0], RIDGE[1]);
    let (xx, yy) = (xx + ridge, yy + ridge);
    let determinant = xx * yy - xy * xy;
    let by = [yy * x - xy * y, xx * y - xy * x].map(|by| by / determinant);
    weights.iter_mut().zip(ways).for_each(|(weight, [dx, dy])| *weight *= 1.0 - by[0] * dx - by[1] * dy);
    // The exact sum is at least the weight of the texel itself.
    let sum = weights.iter().sum::<f32>().max(0.5);
    weights.iter_mut().for_each(|weight| *weight /= sum);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Weights of a Gaussian around a texel at 0, and the places.
    fn gaussian(places: impl Iterator<Item = [f32; 2]>) -> (Vec<f32>, Vec<[f32; 2]>) {
        let ways: Vec<[f32; 2]> = std::iter::once([0.0; 2]).chain(places.filter(|place| *place != [0.0; 2])).collect();
        (ways.iter().map(|[x, y]| (-0.1 * (x * x + y * y)).exp()).collect(), ways)
    }

    /// The texels of a half plane that ends at the texel, turned.
    fn border(angle: f32) -> impl Iterator<Item = [f32; 2]> {
        let turned = move |[x, y]: [f32; 2]| [x * angle.cos() - y * angle.sin(), x * angle.sin() + y * angle.cos()];
        (0..5).flat_map(|x| (-4..=4).map(move |y| [x as f32, y as f32])).map(turned)
    }

    fn mean(weights: &[f32], ways: &[[f32; 2]], light: impl Fn([f32; 2]) -> f32) -> f32 {
        weights.iter().zip(ways).map(|(weight, way)| weight * light(*way)).sum()
    }

    #[test]
    fn light_that_changes_evenly_keeps_its_value_at_the_border_of_a_surface() {
        for angle in [0.0f32, 0.5, 1.0] {
            // Away from the border, and along the border.
            let (across, along) = ([angle.cos(), angle.sin()], [-angle.sin(), angle.cos()]);
            let light =
                |[x, y]: [f32; 2]| 1.0 + 0.1 * (across[0] * x + across[1] * y) - 0.05 * (along[0] * x + along[1] * y);
            let (plain, ways) = gaussian(border(angle));
            let sum: f32 = plain.iter().sum();
            let biased = mean(&plain, &ways, light) / sum;
            let at = |noise: f32| {
                let mut weights = plain.clone();
                balance(&mut weights, &ways, noise);
                assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-4);
                mean(&weights, &ways, light)
            };
            // Without noise the value is exact, with much noise it is the plain mean, and with some noise it lies between both.
            assert!((at(0.0) - 1.0).abs() < 1e-4 && (biased - 1.0).abs() > 0.05, "{} {biased}", at(0.0));
            assert!((at(f32::INFINITY) - biased).abs() < 1e-4 && (at(1e12) - biased).abs() < 1e-4);
            let half = at(30.0);
            assert!((half - 1.0).abs() > 0.01 && (half - 1.0).abs() < 0.9 * (biased - 1.0).abs(), "{half} {biased}");
        }
    }

    #[test]
    fn weights_are_finite_for_strips_of_one_texel_and_for_texels_without_neighbours() {
        for case in 0..4000 {
            // Multiples of irrational numbers fill the ranges evenly.
            let part = |by: f32| (case as f32 * by).fract();
            let (angle, step, first) =
                (6.3 * part(0.618_034), 0.2 + 2.0 * part(0.754_878), (6.0 * part(0.569_84)) as i32);
            let places = (-first..5).map(|i| [step * i as f32 * angle.cos(), step * i as f32 * angle.sin()]);
            let (mut weights, ways) = gaussian(places);
            balance(&mut weights, &ways, 0.0);
            assert!(weights.iter().all(|weight| weight.abs() < 20.0), "{angle} {step} {first}: {weights:?}");
            assert!((mean(&weights, &ways, |_| 1.0) - 1.0).abs() < 1e-3, "{weights:?}");
        }
        let mut alone = vec![1.0];
        balance(&mut alone, &[[0.0; 2]], 0.0);
        assert_eq!(alone, [1.0]);
    }
}

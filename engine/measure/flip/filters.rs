//! FLIP's filters: what the eye resolves of each opponent channel, and detectors of edges and points.

use std::f64::consts::PI;

use crate::measure::convolve::{Edge, separable};

/// Kernels for a number of pixels per degree. The one for blue-yellow is the sum of two.
pub(super) struct Filters {
    achromatic: Vec<f32>,
    red_green: Vec<f32>,
    blue_yellow: [Vec<f32>; 2],
    gauss: Vec<f32>,
    first: Vec<f32>,
    second: Vec<f32>,
}

impl Filters {
    pub(super) fn new(pixels_per_degree: f64) -> Self {
        // Contrast sensitivity as Gaussians a √(π/b) exp(−π² x²/b), x in degrees.
        let widest: f64 = 0.04;
        let radius = (3.0 * (widest / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil().min(4096.0) as i32;
        let sample = |height: f64, b: f64| -> Vec<f64> {
            (-radius..=radius)
                .map(|i| height * (-PI * PI * (f64::from(i) / pixels_per_degree).powi(2) / b).exp())
                .collect()
        };
        let unit = |list: Vec<f64>| -> Vec<f32> {
            let sum: f64 = list.iter().sum();
            list.iter().map(|v| (v / sum) as f32).collect()
        };
        // Both parts of blue-yellow are two-dimensional, so each direction has the root of the height.
        let root = |a: f64, b: f64| (a * (PI / b).sqrt()).sqrt();
        let parts = [sample(root(34.1, 0.04), 0.04), sample(root(13.5, 0.025), 0.025)];
        let whole = parts.iter().map(|p| p.iter().sum::<f64>().powi(2)).sum::<f64>().sqrt();
        let blue_yellow = parts.map(|p| p.iter().map(|v| (v / whole) as f32).collect());

        let sigma = 0.5 * 0.082 * pixels_per_degree;
        let reach = (3.0 * sigma).ceil().min(4096.0) as i32;
        let gauss = |x: i32| (-0.5 * (f64::from(x) / sigma).powi(2)).exp();
        let derivative = |value: &dyn Fn(i32) -> f64| -> Vec<f32> {
            let list: Vec<f64> = (-reach..=reach).map(value).collect();
            let total = |sign: f64| list.iter().map(|v| (v * sign).max(0.0)).sum::<f64>();
            let (up, down) = (total(1.0), total(-1.0));
            list.iter().map(|v| (if *v > 0.0 { v / up } else { v / down.max(f64::MIN_POSITIVE) }) as f32).collect()
        };
        Self {
            achromatic: unit(sample(1.0, 0.0047)),
            red_green: unit(sample(1.0, 0.0053)),
            blue_yellow,
            gauss: unit((-reach..=reach).map(gauss).collect()),
            first: derivative(&|x| -f64::from(x) * gauss(x)),
            second: derivative(&|x| ((f64::from(x) / sigma).powi(2) - 1.0) * gauss(x)),
        }
    }

    /// What the eye resolves of the opponent channels.
    pub(super) fn seen(&self, [y, cx, cz]: &[Vec<f32>; 3], size: [usize; 2], threads: usize) -> [Vec<f32>; 3] {
        let blur = |plane: &[f32], kernel: &[f32]| separable(plane, size, kernel, kernel, Edge::Clamp, threads);
        let mut yellow = blur(cz, &self.blue_yellow[0]);
        let other = blur(cz, &self.blue_yellow[1]);
        yellow.iter_mut().zip(other).for_each(|(a, b)| *a += b);
        [blur(y, &self.achromatic), blur(cx, &self.red_green), yellow]
    }

    /// Strength of edges and of points, from the achromatic channel.
    pub(super) fn features(&self, y: &[f32], size: [usize; 2], threads: usize) -> [Vec<f32>; 2] {
        let grey: Vec<f32> = y.iter().map(|v| (v + 16.0) / 116.0).collect();
        let strength = |kernel: &[f32]| -> Vec<f32> {
            let along = |kx: &[f32], ky: &[f32]| separable(&grey, size, kx, ky, Edge::Clamp, threads);
            let (dx, dy) = (along(kernel, &self.gauss), along(&self.gauss, kernel));
            dx.iter().zip(&dy).map(|(x, y)| (x * x + y * y).sqrt()).collect()
        };
        [strength(&self.first), strength(&self.second)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_stay_and_have_no_features() {
        let filters = Filters::new(67.02);
        let size = [31, 17];
        let planes = [50.0, -20.0, 30.0].map(|v| vec![v; 31 * 17]);
        for (out, constant) in filters.seen(&planes, size, 2).iter().zip(&planes) {
            assert!(out.iter().all(|v| (v - constant[0]).abs() < 1e-3));
        }
        assert!(filters.features(&planes[0], size, 2).concat().iter().all(|v| *v < 1e-5));
    }

    #[test]
    fn an_impulse_spreads_by_the_contrast_sensitivity_of_its_channel() {
        let (side, pixels_per_degree) = (31, 67.02);
        let mut impulse = vec![0.0; side * side];
        impulse[15 * side + 15] = 1000.0;
        let filters = Filters::new(pixels_per_degree);
        let spread = filters.seen(&[impulse.clone(), impulse.clone(), impulse], [side, side], 1);
        // The paper's table 1: heights a and widths b of Gaussians a √(π/b) exp(−π² r²/b), r in degrees.
        let terms: [&[[f64; 2]]; 3] = [&[[1.0, 0.0047]], &[[1.0, 0.0053]], &[[34.1, 0.04], [13.5, 0.025]]];
        for (channel, (spread, terms)) in spread.iter().zip(terms).enumerate() {
            let weight = |x: f64, y: f64| -> f64 {
                let r2 = (x * x + y * y) / (pixels_per_degree * pixels_per_degree);
                terms.iter().map(|[a, b]| a * (PI / b).sqrt() * (-PI * PI * r2 / b).exp()).sum()
            };
            for (x, y) in [(1, 0), (2, 3), (5, 0), (4, 6), (9, 2)] {
                let found = f64::from(spread[(15 + y) * side + 15 + x] / spread[15 * side + 15]);
                let exact = weight(x as f64, y as f64) / weight(0.0, 0.0);
                assert!((found - exact).abs() < 1e-4 * exact + 1e-7, "{channel}, {x} {y}: {found} instead of {exact}");
            }
        }
    }
}

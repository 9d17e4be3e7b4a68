//! Gaussian averages from halved pictures, as [`Local::Pyramid`](crate::techniques::tonemap::Local::Pyramid) defines them.

use super::plane::Plane;

/// Half the size, rounded up: means of 2 × 2 pixels.
pub fn halved(plane: &Plane) -> Plane {
    Plane::from_fn(plane.width.div_ceil(2), plane.height.div_ceil(2), |x, y| {
        let at = |i: isize, j: isize| plane.clamped(2 * x as isize + i, 2 * y as isize + j);
        (at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1)) / 4.0
    })
}

/// Average of every pixel with the Gaussian of `sigma` whose weights, not yet divided by their sum, are `weights`.
pub fn averages(plane: &Plane, sigma: f64, weights: &[f64]) -> Plane {
    let radius = weights.len() as isize - 1;
    let both = || (-radius..=radius).map(|d| (d as f64, weights[d.unsigned_abs()]));
    let variance = both().map(|(d, w)| d * d * w).sum::<f64>() / both().map(|(_, w)| w).sum::<f64>();
    let (level, added) = match variance {
        v if v < 1.5 => return plane.averages(weights),
        v if v < 9.0 => (1, 0.25 + 0.75),
        _ => (2, 1.25 + 2.75),
    };
    let q = ((variance - added) / variance).sqrt();
    let g =
        |x: f64| if x.abs() <= q * (radius as f64 + 0.5) { (-x * x / (2.0 * (q * sigma).powi(2))).exp() } else { 0.0 };
    let size = f64::from(1 << level);
    let mean = |d: usize| (0..64).map(|i| g(size * (d as f64 - 0.5 + (f64::from(i) + 0.5) / 64.0))).sum::<f64>() / 64.0;
    let narrowed: Vec<f64> = (0..weights.len()).map(mean).take_while(|w| *w > 0.0).collect();
    let small = (0..level).fold(plane.clone(), |plane, _| halved(&plane)).averages(&narrowed);
    Plane::from_fn(plane.width, plane.height, |x, y| {
        let place = |p: usize| {
            let t = (p as f64 + 0.5) / size - 0.5;
            (t.floor() as isize, t - t.floor())
        };
        let ((i, u), (j, v)) = (place(x), place(y));
        let row = |j: isize| (1.0 - u) * small.clamped(i, j) + u * small.clamped(i + 1, j);
        (1.0 - v) * row(j) + v * row(j + 1)
    })
}

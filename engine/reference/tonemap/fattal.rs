//! Fattal, Lischinski and Werman, "Gradient domain high dynamic range compression", 2002.

use super::{
    plane::Plane,
    solve::{self, Edges},
};

/// Smallest side of a level of the pyramid beside the first, section 4.
const SMALLEST: usize = 32;
/// Share of α below which gradients are not told apart; not in the paper.
pub const LEAST: f64 = 0.1;

/// The Gaussian pyramid: (1 3 3 1) / 8 along both axes, every second sample.
pub fn pyramid(logarithm: &Plane) -> Vec<Plane> {
    let mut levels = vec![logarithm.clone()];
    loop {
        let fine = &levels[levels.len() - 1];
        let (width, height) = (fine.width.div_ceil(2), fine.height.div_ceil(2));
        if width.min(height) < SMALLEST {
            return levels;
        }
        let weights = [0.125, 0.375, 0.375, 0.125];
        let coarse = Plane::from_fn(width, height, |x, y| {
            let at = |i: usize, j: usize| fine.clamped((2 * x + i) as isize - 1, (2 * y + j) as isize - 1);
            (0..4).flat_map(|j| (0..4).map(move |i| (i, j))).map(|(i, j)| weights[i] * weights[j] * at(i, j)).sum()
        });
        levels.push(coarse);
    }
}

/// Attenuation Φ of every pixel, `alpha` as a share of the mean gradient of each level.
pub fn attenuation(logarithm: &Plane, alpha: f64, beta: f64) -> Plane {
    let mut coarser: Option<Plane> = None;
    for (k, level) in pyramid(logarithm).iter().enumerate().rev() {
        let distance = 2f64.powi(k as i32 + 1);
        let gradient = Plane::from_fn(level.width, level.height, |x, y| {
            let at = |i: isize, j: isize| level.clamped(x as isize + i, y as isize + j);
            ((at(1, 0) - at(-1, 0)) / distance).hypot((at(0, 1) - at(0, -1)) / distance)
        });
        let kept = alpha * gradient.values.iter().sum::<f64>() / gradient.values.len() as f64;
        let own = gradient.map(|g| if kept > 0.0 { (g / kept).max(LEAST).powf(beta - 1.0) } else { 1.0 });
        coarser = Some(match coarser {
            None => own,
            Some(coarse) => Plane::from_fn(own.width, own.height, |x, y| {
                own[(x, y)] * bilinear(&coarse, (x as f64 + 0.5) / 2.0 - 0.5, (y as f64 + 0.5) / 2.0 - 0.5)
            }),
        });
    }
    coarser.unwrap_or_else(|| logarithm.map(|_| 1.0))
}

fn bilinear(plane: &Plane, x: f64, y: f64) -> f64 {
    let (left, top) = (x.floor(), y.floor());
    let (right, below) = (x - left, y - top);
    let at = |i: isize, j: isize| plane.clamped(left as isize + i, top as isize + j);
    let row = |j: isize| at(0, j) * (1.0 - right) + at(1, j) * right;
    row(0) * (1.0 - below) + row(1) * below
}

/// The logarithm whose gradients are nearest to the attenuated ones; its mean is 0. Between two pixels the attenuation is the mean of theirs.
pub fn solution(logarithm: &Plane, alpha: f64, beta: f64) -> Plane {
    let attenuation = attenuation(logarithm, alpha, beta);
    let (width, height) = (logarithm.width, logarithm.height);
    let wanted =
        Edges::of(width, height, |a, b| (logarithm[b] - logarithm[a]) * 0.5 * (attenuation[a] + attenuation[b]));
    solve::solve(&[(Edges::of(width, height, |_, _| 1.0), wanted)])
}

/// Light from a logarithm, its lower percentile black and its upper one white. Without contrast all is white.
pub fn shown(logarithm: f64, [low, high]: [f64; 2]) -> f64 {
    let light = |x: f64| 10f64.powf(x - high);
    if high > low { ((light(logarithm) - light(low)) / (1.0 - light(low))).max(0.0) } else { 1.0 }
}

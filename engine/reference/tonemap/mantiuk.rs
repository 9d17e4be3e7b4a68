//! Mantiuk, Myszkowski and Seidel, "A perceptual framework for contrast processing of high dynamic range images", 2006: contrast mapping.

use super::{
    plane::Plane,
    solve::{self, Edges},
};

/// Change of a contrast of `g` decades that is just seen; the same for all contrasts below `least`.
pub fn threshold(g: f64, least: f64) -> f64 {
    0.038737 * g.max(least).powf(0.537756)
}

/// Below a contrast of 5 % the response is proportional.
pub fn linear() -> f64 {
    1.05f64.log10()
}

/// Response to a contrast: just visible steps from no contrast to it, the integral of 1 / [`threshold`].
pub fn response(g: f64) -> f64 {
    let (linear, power) = (linear(), 1.0 - 0.537756);
    let straight = g.min(linear) / threshold(0.0, linear);
    straight + (g.max(linear).powf(power) - linear.powf(power)) / (0.038737 * power)
}

/// The contrast of a response.
pub fn contrast(r: f64) -> f64 {
    let (linear, power) = (linear(), 1.0 - 0.537756);
    let straight = response(linear);
    if r <= straight {
        return r * threshold(0.0, linear);
    }
    ((r - straight) * 0.038737 * power + linear.powf(power)).powf(1.0 / power)
}

/// Levels of means of 2 × 2, as long as a side has at least 4 pixels.
pub fn pyramid(logarithm: &Plane) -> Vec<Plane> {
    let mut levels = vec![logarithm.clone()];
    while let Some(fine) = levels.last().filter(|fine| fine.width.max(fine.height) >= 4) {
        levels.push(solve::halved(fine));
    }
    levels
}

/// The logarithm whose contrasts at all levels are nearest to the mapped ones; its mean is 0.
pub fn solution(logarithm: &Plane, scale: f64) -> Plane {
    let level = |plane: &Plane| {
        let mapped = |g: f64| g.signum() * contrast(scale * response(g.abs()));
        let differences = Edges::differences(plane);
        let wanted = differences.with(&differences, |g, _| mapped(g));
        // Where no pixel follows there is no edge.
        let weights =
            Edges::of(plane.width, plane.height, |a, b| 1.0 / threshold(mapped(plane[b] - plane[a]).abs(), 0.001));
        let flow = wanted.with(&weights, |g, w| g * w);
        (weights, flow)
    };
    let levels: Vec<(Edges, Edges)> = pyramid(logarithm).iter().map(level).collect();
    solve::solve(&levels)
}

/// Black of the display, at least so many decades below its white.
pub const LEAST: f64 = 0.05;

/// Equation 26 and the display's power undone: light from a logarithm by its lower and upper percentile and its median.
pub fn shown(logarithm: f64, [low, median, high]: [f64; 3]) -> f64 {
    let whole = (2.0 * (high - median).max(median - low)).max(LEAST);
    (0.5 + (logarithm - median) / whole).max(0.0).powf(2.2)
}

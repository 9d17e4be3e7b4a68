//! Spacing of the samples: dense where the vectors have a high curvature, sparse where they are nearly linear.
//!
//! The thesis grows radii by a constant factor and spaces directions evenly. Its future work asks for samples that
//! adapt to the occluder and the environment (chapter 6). Here the vectors of an occluder are first computed in fine
//! steps along each of the three coordinates. The error of linear interpolation between samples at distance `h` is h²/8
//! times the second derivative. The mean square error is least if the density of samples is proportional to the fifth
//! root of the square of the second derivative (de Boor, A Practical Guide to Splines, chapter III).

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

use super::{
    cover::Cover,
    light::Light,
    samples::{Grid, Shells},
};
use crate::{
    Result,
    graph::Runner,
    shaders::consts::{FIV_FLOATS, FIV_INSIDE, FIV_SPACING_KNOTS},
};

const KNOTS: usize = FIV_SPACING_KNOTS as usize;
/// Directions along which the vectors are computed in fine steps of the radius.
const WAYS: Grid = Grid::of(8, 5, 2);
/// Fine steps of azimuth and polar angle, on spheres of these radii, in radii of the occluder.
const FINE: [usize; 2] = [2 * (KNOTS - 1), KNOTS - 1];
const SPHERES: [f64; 2] = [1.5, 4.0];
/// Least density of samples, as a share of the even density.
const LEAST: f64 = 0.25;
/// Knots are rounded to multiples of this step, so that devices that round differently compute the same knots.
const GRAIN: f64 = 1.0 / 256.0;

/// The sample number at each of the evenly spaced knots of a coordinate, from 0 to the last sample. Empty: samples are
/// evenly spaced.
pub type Knots = Vec<f32>;

/// Spacing of the samples along their three coordinates.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Spacing {
    /// Up to the sample at 2π, which is the sample at 0.
    pub azimuth: Knots,
    pub polar: Knots,
    /// Along the logarithm of the radius.
    pub radius: Knots,
}

impl Spacing {
    /// The knots of each coordinate with the number of its last sample.
    fn all(&self, grid: &Grid) -> [(&[f32], f64); 3] {
        [
            (&self.azimuth, f64::from(grid.azimuths)),
            (&self.polar, f64::from(grid.polars - 1)),
            (&self.radius, f64::from(grid.radii - 1)),
        ]
    }

    /// Offset of the occluder's centre from the receiver, metres.
    pub fn offset(&self, grid: &Grid, shells: &Shells, index: u32) -> DVec3 {
        let [azimuth, polar, sphere] = grid.place(index);
        self.direction(grid, azimuth, polar) * self.radius(grid, shells, sphere)
    }

    /// Unit vector from the receiver to the occluder. At the poles all azimuths have the same direction.
    fn direction(&self, grid: &Grid, azimuth: u32, polar: u32) -> DVec3 {
        let [(a, azimuths), (p, polars), _] = self.all(grid);
        if (a.is_empty() && p.is_empty()) || polar == 0 || polar + 1 >= grid.polars {
            return grid.direction(azimuth, polar);
        }
        let (phi, theta) = (TAU * part_of(a, azimuths, azimuth.into()), PI * part_of(p, polars, polar.into()));
        DVec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos())
    }

    /// Radius of a sphere of samples, metres.
    pub fn radius(&self, grid: &Grid, shells: &Shells, sphere: u32) -> f64 {
        if self.radius.is_empty() || sphere == 0 || sphere + 1 >= grid.radii {
            return shells.radius(grid.radii, sphere);
        }
        let (near, far) = (f64::from(shells.nearest), f64::from(shells.farthest));
        near * (far / near).powf(part_of(&self.radius, f64::from(grid.radii - 1), sphere.into()))
    }

    /// Sample numbers with fractions for an occluder whose centre lies at `offset` (metres) from the receiver.
    pub fn numbers(&self, grid: &Grid, shells: &Shells, offset: DVec3) -> [f64; 3] {
        let (near, far) = (f64::from(shells.nearest), f64::from(shells.farthest));
        let parts = [
            (offset.x.atan2(-offset.z) / TAU).rem_euclid(1.0),
            offset.x.hypot(offset.z).atan2(offset.y) / PI,
            (offset.length().max(near) / near).ln() / (far / near).ln(),
        ];
        let all = self.all(grid);
        [0, 1, 2].map(|k| number_at(all[k].0, all[k].1, parts[k]))
    }

    /// The table that shaders read: the knots of the three coordinates, then the radii of the spheres, metres.
    pub fn table(&self, grid: &Grid, shells: &Shells) -> Vec<f32> {
        let knot = |k: usize| k as f64 / (KNOTS - 1) as f64;
        let knots = self
            .all(grid)
            .into_iter()
            .flat_map(|(knots, last)| (0..KNOTS).map(move |k| number_at(knots, last, knot(k))));
        let radii = (0..grid.radii).map(|sphere| self.radius(grid, shells, sphere));
        knots.chain(radii).map(|x| x as f32).collect()
    }

    /// Whether each coordinate has increasing knots from the first sample to the last.
    pub fn fit(&self, grid: &Grid) -> bool {
        self.all(grid).iter().all(|(knots, last)| {
            let ends = knots.first().zip(knots.last());
            knots.is_empty()
                || knots.len() == KNOTS
                    && ends.is_some_and(|(first, end)| (*first, f64::from(*end)) == (0.0, *last))
                    && knots.windows(2).all(|p| p[1] > p[0])
        })
    }
}

/// Sample number with fraction at `part` (0..1) of the coordinate. `last`: number at the end of the coordinate.
fn number_at(knots: &[f32], last: f64, part: f64) -> f64 {
    let part = part.clamp(0.0, 1.0);
    if knots.len() < 2 {
        return part * last;
    }
    let x = part * (knots.len() - 1) as f64;
    let k = (x as usize).min(knots.len() - 2);
    let (low, high) = (f64::from(knots[k]), f64::from(knots[k + 1]));
    low + (high - low) * (x - k as f64)
}

/// The inverse of [`number_at`].
fn part_of(knots: &[f32], last: f64, number: f64) -> f64 {
    if knots.len() < 2 {
        return number / last;
    }
    let k = knots.partition_point(|p| f64::from(*p) <= number).clamp(1, knots.len() - 1) - 1;
    let (low, high) = (f64::from(knots[k]), f64::from(knots[k + 1]));
    (k as f64 + ((number - low) / (high - low)).clamp(0.0, 1.0)) / (knots.len() - 1) as f64
}

/// Computes the spacing for an occluder. `radius`: radius of its bounding sphere, metres. `scaled`: vectors are
/// interpolated relative to the solid angle of the bounding sphere.
///
/// # Errors
/// `OutOfMemory`, `DeviceLost`.
pub fn choose(
    cover: &mut Cover,
    runner: &mut Runner,
    light: &Light,
    (grid, shells): (&Grid, &Shells),
    (radius, scaled): (f32, bool),
) -> Result<Spacing> {
    let mut look = |points: &[DVec3]| -> Result<Vec<f32>> {
        let points: Vec<Vec3> = points.iter().map(|p| -p.as_vec3()).collect();
        Ok(cover.run(runner, light, &points, 1)?.0)
    };
    let steps = 2 * (KNOTS - 1);
    let rho = |step: usize| shells.radius(steps as u32 + 1, step as u32);
    let ways = (0..WAYS.azimuths * WAYS.polars).map(|i| WAYS.direction(i % WAYS.azimuths, i / WAYS.azimuths));
    let points: Vec<DVec3> = ways.flat_map(|way| (0..=steps).map(move |s| way * rho(s))).collect();
    let fivs = look(&points)?;
    let reach = |step: usize| if scaled { rho(step).max(f64::from(radius)).powi(2) } else { 1.0 };
    let lines: Vec<&[f32]> = fivs.chunks_exact(FIV_FLOATS as usize * (steps + 1)).collect();
    // A ground shows an area proportional to the square of the radius in each interval of the radius' logarithm.
    let bend = |s: usize| {
        lines.iter().map(|line| bend(line, [s - 1, s, s + 1], reach)).sum::<f64>() * (rho(s) / reach(s)).powi(2)
    };
    let of_radius = spread(&(1..steps).map(bend).collect::<Vec<_>>(), f64::from(grid.radii - 1));

    let [azimuths, polars] = FINE;
    let fine = Grid::of(azimuths as u32, polars as u32 + 1, 2);
    let way = |i: usize| fine.direction((i % azimuths) as u32, (i / azimuths) as u32);
    let count = azimuths * (polars + 1);
    let spheres = SPHERES.map(|s| s * f64::from(radius));
    let points: Vec<DVec3> = spheres.iter().flat_map(|r| (0..count).map(move |i| way(i) * *r)).collect();
    let fivs = look(&points)?;
    let sizes: Vec<f64> = (0..=polars).map(|p| (PI * p as f64 / polars as f64).sin()).collect();
    let (mut around, mut down) = (vec![0.0; azimuths], vec![0.0; polars - 1]);
    for (sphere, size) in fivs.chunks_exact(FIV_FLOATS as usize * count).zip(spheres) {
        for (a, p) in (0..count).map(|i| (i % azimuths, i / azimuths)) {
            let at = |a: usize, p: usize| p * azimuths + a % azimuths;
            let weight = sizes[p] * size.powi(2);
            if p > 0 && p < polars {
                around[a] += weight * bend_of(sphere, [at(a + azimuths - 1, p), at(a, p), at(a + 1, p)]);
                down[p - 1] += weight * bend_of(sphere, [at(a, p - 1), at(a, p), at(a, p + 1)]);
            }
        }
    }
    // The sample at 0 is the sample at 2π.
    let around: Vec<f64> = (1..azimuths).map(|a| around[a]).collect();
    Ok(Spacing {
        azimuth: spread(&around, f64::from(grid.azimuths)),
        polar: spread(&down, f64::from(grid.polars - 1)),
        radius: of_radius,
    })
}

fn bend_of(fivs: &[f32], at: [usize; 3]) -> f64 {
    bend(fivs, at, |_| 1.0)
}

/// Square of the second difference of three vectors, each times a factor. 0 if one of the samples lies inside the
/// occluder.
fn bend(fivs: &[f32], at: [usize; 3], times: impl Fn(usize) -> f64) -> f64 {
    let floats = FIV_FLOATS as usize;
    let of = |step: usize| &fivs[floats * step..floats * (step + 1)];
    if at.iter().any(|step| of(*step)[0] >= FIV_INSIDE) {
        return 0.0;
    }
    let value = |step: usize, k: usize| f64::from(of(step)[k]) * times(step);
    (0..floats).map(|k| (value(at[0], k) - 2.0 * value(at[1], k) + value(at[2], k)).powi(2)).sum()
}

/// Knots with a density proportional to the fifth roots of `bends`, the squares of second differences at even steps
/// without the first and the last step.
fn spread(bends: &[f64], last: f64) -> Knots {
    let roots: Vec<f64> = bends.iter().map(|b| b.max(0.0).powf(0.2)).collect();
    let mean = roots.iter().sum::<f64>() / roots.len().max(1) as f64;
    if !(mean.is_finite() && mean > 0.0) {
        return Knots::new();
    }
    // The mean of neighbours removes the steps that single rays cause.
    let around = |i: usize| {
        let near = &roots[i.saturating_sub(2)..(i + 3).min(roots.len())];
        near.iter().sum::<f64>() / near.len() as f64
    };
    let density = |step: usize| LEAST + (1.0 - LEAST) * around(step.clamp(1, roots.len()) - 1) / mean;
    let steps = bends.len() + 1;
    let mut sums = vec![0.0];
    for step in 0..steps {
        sums.push(sums[step] + 0.5 * (density(step) + density(step + 1)));
    }
    let (whole, each) = (sums[steps], steps / (KNOTS - 1));
    let knot = |knot: usize| ((sums[knot * each] / whole * last / GRAIN).round() * GRAIN) as f32;
    let mut knots: Knots = (0..KNOTS).map(knot).collect();
    knots[KNOTS - 1] = last as f32;
    // Even spacing replaces knots that rounding has joined.
    if knots.windows(2).any(|p| p[1] <= p[0]) { Knots::new() } else { knots }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_bends_and_where_all_bend_alike_samples_lie_evenly() {
        assert!(spread(&[0.0; 63], 29.0).is_empty());
        for steps in [63, 31] {
            for (k, p) in spread(&vec![2.0; steps], 29.0).iter().enumerate() {
                assert!((p - 29.0 * k as f32 / 32.0).abs() < 0.01, "{k}: {p}");
            }
        }
    }

    #[test]
    fn samples_crowd_where_it_bends_and_numbers_are_inverse_to_places() {
        let bends: Vec<f64> = (0..63).map(|i| if (10..20).contains(&i) { 1.0 } else { 1e-6 }).collect();
        let grid = Grid::of(16, 9, 15);
        let spacing =
            Spacing { azimuth: spread(&bends, 16.0), polar: spread(&bends[..31], 8.0), radius: spread(&bends, 14.0) };
        assert!(spacing.fit(&grid) && !spacing.fit(&Grid::of(16, 9, 16)) && Spacing::default().fit(&grid));
        let there = spacing.radius[9] - spacing.radius[6];
        assert!(there > 2.5 * (spacing.radius[27] - spacing.radius[24]), "{:?}", spacing.radius);
        let shells = Shells { nearest: 0.1, farthest: 6.4 };
        for spacing in [&spacing, &Spacing::default()] {
            for index in 0..grid.count() {
                let [a, p, r] = grid.place(index);
                let found = spacing.numbers(&grid, &shells, spacing.offset(&grid, &shells, index));
                assert!((found[1] - f64::from(p)).abs() < 1e-5 && (found[2] - f64::from(r)).abs() < 1e-5, "{found:?}");
                let apart = (found[0] - f64::from(a)).rem_euclid(16.0);
                assert!(p == 0 || p == 8 || apart.min(16.0 - apart) < 1e-5, "{found:?} instead of {a}");
            }
            let table = spacing.table(&grid, &shells);
            assert_eq!((table.len(), table[KNOTS - 1], table[3 * KNOTS - 1]), (3 * KNOTS + 15, 16.0, 14.0));
            assert!((table[3 * KNOTS] - 0.1).abs() < 1e-6 && (table[3 * KNOTS + 14] - 6.4).abs() < 1e-5);
        }
    }
}

//! Extent of an occluder along every direction. It decides which share of the occluder lies in front of a receiver's
//! plane.
//!
//! The thesis uses the bounding sphere (section 3.3.3.1). The bounding sphere of a body that stands on the ground
//! reaches below the ground, although the body does not. The body would count as cut, and its whole shadow would be too
//! light. The support function of the vertices gives the exact extent of the convex hull. For a ball both methods
//! agree.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};

use crate::shaders::consts::{FIV_REACH_AZIMUTHS, FIV_REACH_POLARS};

/// Points that are processed at once, for the vector units of the CPU.
const LANES: usize = 8;

/// Entries of a table.
pub const LENGTH: usize = (FIV_REACH_AZIMUTHS * FIV_REACH_POLARS) as usize;

/// Largest coordinate of a set of points along the directions of a grid, metres. Azimuths around +Y (0 over −Z, towards
/// +X) lie next to each other, then the polar angles from +Y to −Y, both included. The opposite of each grid direction
/// is a grid direction.
#[derive(Clone, Debug, PartialEq)]
pub struct SupportFunction(pub Vec<f32>);

impl SupportFunction {
    /// The support function of points around the origin.
    pub fn of(points: &[Vec3]) -> Self {
        // Eight points at once, because occluders that deform are measured in each frame. Copies of the last point fill
        // the last row.
        let row = |row: usize, axis: usize| {
            std::array::from_fn(|lane| points[(LANES * row + lane).min(points.len() - 1)][axis])
        };
        let rows: Vec<[[f32; LANES]; 3]> =
            (0..points.len().div_ceil(LANES)).map(|i| [0, 1, 2].map(|axis| row(i, axis))).collect();
        let reach = |i: usize| {
            let along = direction(i).as_vec3();
            let mut most = [f32::NEG_INFINITY; LANES];
            for [x, y, z] in &rows {
                for (lane, most) in most.iter_mut().enumerate() {
                    let reach = x[lane] * along.x + y[lane] * along.y + z[lane] * along.z;
                    *most = if reach > *most { reach } else { *most };
                }
            }
            most.into_iter().fold(f32::NEG_INFINITY, f32::max)
        };
        // All azimuths have the same direction at the poles.
        let (row, last) = (FIV_REACH_AZIMUTHS as usize, LENGTH - FIV_REACH_AZIMUTHS as usize);
        let mut table: Vec<f32> =
            (0..LENGTH).map(|i| if i % row > 0 && !(row..last).contains(&i) { 0.0 } else { reach(i) }).collect();
        for i in (1..row).chain(last + 1..LENGTH) {
            table[i] = table[i / row * row];
        }
        Self(table)
    }

    /// Extent along a unit vector, metres, interpolated between four grid directions. Twin of fiv/reach.glsl.
    pub fn along(&self, n: Vec3) -> f32 {
        let n = n.as_dvec3();
        let (azimuths, polars) = (FIV_REACH_AZIMUTHS, FIV_REACH_POLARS);
        let a = (n.x.atan2(-n.z) / TAU).rem_euclid(1.0) * f64::from(azimuths);
        let p = n.x.hypot(n.z).atan2(n.y) / PI * f64::from(polars - 1);
        let (a0, p0) = ((a as u32).min(azimuths - 1), (p as u32).min(polars - 2));
        let (s, t) = ((a - f64::from(a0)) as f32, (p - f64::from(p0)) as f32);
        let at = |a: u32, p: u32| self.0[(p * azimuths + a % azimuths) as usize];
        let row = |p: u32| at(a0, p) * (1.0 - s) + at(a0 + 1, p) * s;
        row(p0) * (1.0 - t) + row(p0 + 1) * t
    }

    /// Share of the extent along `normal` that lies in front of a plane. `distance`: signed distance of the origin from
    /// the plane, metres.
    pub fn front(&self, distance: f32, normal: Vec3) -> f32 {
        let (over, under) = (self.along(normal), self.along(-normal));
        ((distance + over) / (over + under).max(1e-20)).clamp(0.0, 1.0)
    }
}

fn direction(i: usize) -> DVec3 {
    let (azimuth, polar) = (i as u32 % FIV_REACH_AZIMUTHS, i as u32 / FIV_REACH_AZIMUTHS);
    let theta = PI * f64::from(polar) / f64::from(FIV_REACH_POLARS - 1);
    let phi = TAU * f64::from(azimuth) / f64::from(FIV_REACH_AZIMUTHS);
    DVec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_reaches_as_far_as_its_corners() {
        let half = Vec3::new(1.0, 0.5, 0.25);
        let corners: Vec<Vec3> = (0..8)
            .map(|k| half * Vec3::new(1.0 - (k & 1) as f32 * 2.0, 1.0 - (k & 2) as f32, 1.0 - (k & 4) as f32 * 0.5))
            .collect();
        let support = SupportFunction::of(&corners);
        for (axis, exact) in [(Vec3::X, 1.0), (Vec3::Y, 0.5), (Vec3::Z, 0.25), (Vec3::NEG_X, 1.0), (Vec3::NEG_Y, 0.5)] {
            assert!((support.along(axis) - exact).abs() < 1e-5, "{axis}: {}", support.along(axis));
        }
        for i in 0..200 {
            let y = 1.0 - (i as f32 + 0.5) / 100.0;
            let (sin, cos) = (2.399 * i as f32).sin_cos();
            let n = Vec3::new((1.0 - y * y).sqrt() * cos, y, (1.0 - y * y).sqrt() * sin);
            let exact = n.abs().dot(half);
            assert!((support.along(n) - exact).abs() < 0.03, "{n}: {} instead of {exact}", support.along(n));
        }
        // A box that stands on the plane lies in front of the plane, a box below the plane lies behind it.
        assert_eq!((support.front(0.5, Vec3::Y), support.front(-0.5, Vec3::Y)), (1.0, 0.0));
        assert!((support.front(0.25, Vec3::Y) - 0.75).abs() < 1e-5);
    }

    #[test]
    fn it_reaches_as_far_as_the_farthest_of_any_number_of_points() {
        for count in [1, 7, 8, 9, 100] {
            let points: Vec<Vec3> =
                (0..count).map(|i| Vec3::new((i as f32).sin(), (1.7 * i as f32).cos(), 0.1 * i as f32 - 3.0)).collect();
            let support = SupportFunction::of(&points);
            for (i, found) in support.0.iter().enumerate().filter(|(i, _)| i % FIV_REACH_AZIMUTHS as usize == 0) {
                let exact = points.iter().map(|p| p.dot(direction(i).as_vec3())).fold(f32::NEG_INFINITY, f32::max);
                assert_eq!(found.to_bits(), exact.to_bits(), "{count} points, direction {i}");
            }
        }
    }

    #[test]
    fn the_share_of_a_ball_is_the_thesis() {
        let points: Vec<Vec3> = (0..LENGTH).map(|i| direction(i).as_vec3() * 2.0).collect();
        let support = SupportFunction::of(&points);
        for d in [-2.5f32, -1.0, 0.0, 0.7, 2.0, 3.0] {
            let exact = crate::reference::fiv::front(f64::from(d), 2.0) as f32;
            for n in [Vec3::Y, Vec3::X, Vec3::new(0.6, -0.64, 0.48)] {
                assert!((support.front(d, n) - exact).abs() < 0.01, "{d} {n}");
            }
        }
    }
}

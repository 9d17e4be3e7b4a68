//! Occluders that turn about +Y: vectors for some turns of each, between which is interpolated (the thesis' future work, chapter 6).
//!
//! An occluder that is turned under still light hides what one at rest hides under light turned the other way: masks are made with the
//! light turned back, and vectors turned along afterwards.

use std::f64::consts::TAU;

use glam::{DMat3, Mat3, Vec3};

use super::{Settings, Sky};
use crate::{Result, scene::Environment};

/// Difference of matrices that counts as none, in parts of their scale.
const SAME: f32 = 1e-4;

/// Angle of a sample, radians, counter-clockwise seen from above.
pub fn angle(turn: u32, turns: u32) -> f64 {
    TAU * f64::from(turn) / f64::from(turns.max(1))
}

/// Turns a vector from an occluder at rest to one that is turned.
pub fn matrix(turn: u32, turns: u32) -> DMat3 {
    DMat3::from_rotation_y(angle(turn, turns))
}

/// The environment of these settings as an occluder that is turned has it around itself.
///
/// # Errors
/// As [`Sky::new`].
pub fn sky(environment: &Environment, settings: &Settings, turn: u32) -> Result<Sky> {
    let rotation = environment.rotation - angle(turn, settings.turns) as f32;
    Sky::of(Some(&Environment { rotation, ..environment.clone() }), settings)
}

/// How far something is turned about +Y, radians from -π to π; `None` if it does anything else but that.
pub fn yaw(now: Mat3, rest: Mat3) -> Option<f32> {
    let scale = rest.to_cols_array().iter().fold(0f32, |m, x| m.max(x.abs()));
    if now.abs_diff_eq(rest, SAME * scale) {
        return Some(0.0);
    }
    let change = now * rest.inverse();
    let yaw = (-change.x_axis.z).atan2(change.x_axis.x);
    (yaw.is_finite() && change.abs_diff_eq(Mat3::from_rotation_y(yaw), 10.0 * SAME)).then_some(yaw)
}

/// The samples on both sides of a turn, and how far it is from the first to the second.
pub fn between(yaw: f32, turns: u32) -> (u32, u32, f32) {
    let at = (f64::from(yaw) / TAU).rem_euclid(1.0) * f64::from(turns);
    let first = (at as u32).min(turns - 1);
    (first, (first + 1) % turns, (at - f64::from(first)) as f32)
}

/// The vectors (nine floats: x.rgb, y.rgb, z.rgb) of one sample after turning. Those that say `inside` stay as they are.
pub fn vectors(floats: &mut [f32], matrix: &DMat3) {
    let color = |k: usize| Vec3::from_slice(&floats[3 * k..]).as_dvec3();
    let [x, y, z] = [color(0), color(1), color(2)];
    for axis in 0..3 {
        let row = matrix.row(axis);
        floats[3 * axis..3 * axis + 3].copy_from_slice(&(x * row.x + y * row.y + z * row.z).as_vec3().to_array());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn turns_are_found_and_other_changes_are_not() {
        let rest = Mat3::from_rotation_x(0.3) * Mat3::from_diagonal(Vec3::new(1.0, 2.0, 0.5));
        for angle in [0.0, 0.4, -2.0, 3.0] {
            let found = yaw(Mat3::from_rotation_y(angle) * rest, rest).unwrap();
            assert!((found - angle).abs() < 1e-4, "{angle}: {found}");
        }
        assert_eq!(yaw(Mat3::from_rotation_x(0.5) * rest, rest), None);
        assert_eq!(yaw(rest * 1.1, rest), None);
        assert_eq!(yaw(Mat3::ZERO, Mat3::ZERO), Some(0.0));
    }

    #[test]
    fn turns_lie_between_their_samples_all_around() {
        for turns in [1, 2, 7, 64] {
            for k in 0..500 {
                let yaw = -7.0 + 0.03 * k as f32;
                let (a, b, part) = between(yaw, turns);
                assert!(a < turns && b == (a + 1) % turns && (0.0..=1.0).contains(&part));
                let back = angle(a, turns) + f64::from(part) * TAU / f64::from(turns);
                let apart = (back - f64::from(yaw)).rem_euclid(TAU);
                assert!(apart.min(TAU - apart) < 1e-4, "{yaw} of {turns}: {a} and {part}");
            }
        }
    }

    #[test]
    fn vectors_turn_with_the_occluder() {
        let mut floats = [0f32; 9];
        // Red light from +X, blue from +Z.
        (floats[0], floats[8]) = (2.0, 3.0);
        vectors(&mut floats, &matrix(1, 4));
        let of = |c: usize| DVec3::new(floats[c].into(), floats[3 + c].into(), floats[6 + c].into());
        assert!((of(0) - DVec3::NEG_Z * 2.0).length() < 1e-6 && (of(2) - DVec3::X * 3.0).length() < 1e-6);
    }
}

//! Occluders that rotate about an axis. Vectors are computed for some rotation angles and interpolated between them.
//! The thesis lists such rotation samples as future work (chapter 6).

use std::f64::consts::TAU;

use glam::{DMat3, DVec3, Mat3, Quat, Vec3};
use serde::{Deserialize, Serialize};

use super::Fiv;
use crate::scene::Pose;

/// Largest difference of matrices that counts as equal, relative to their largest entry.
const SAME: f32 = 1e-4;

/// Axis of the rotation samples, in world axes: `x`, `y`, `z`, or three numbers with commas between them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Axis(Vec3);

impl Axis {
    pub const Y: Self = Self(Vec3::Y);

    /// The axis with this direction. `None` if the vector has no usable length.
    pub fn new(direction: Vec3) -> Option<Self> {
        let length = direction.length();
        (length.is_finite() && length > 1e-20).then_some(Self(direction))
    }

    /// Direction of the axis, unit length.
    pub fn direction(&self) -> DVec3 {
        self.0.as_dvec3().normalize()
    }
}

impl Default for Axis {
    fn default() -> Self {
        Self::Y
    }
}

impl TryFrom<String> for Axis {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let wrong =
            || format!("`{text}` is no axis; allowed: x, y, z, or three numbers that are not all 0, as 1,0.5,0");
        match text.trim() {
            "x" => return Ok(Self(Vec3::X)),
            "y" => return Ok(Self(Vec3::Y)),
            "z" => return Ok(Self(Vec3::Z)),
            _ => (),
        }
        let numbers: Vec<f32> = text.split(',').map_while(|part| part.trim().parse().ok()).collect();
        let three = <[f32; 3]>::try_from(numbers).ok().filter(|_| text.split(',').count() == 3);
        three.and_then(|three| Self::new(three.into())).ok_or_else(wrong)
    }
}

impl From<Axis> for String {
    fn from(axis: Axis) -> Self {
        axis.to_string()
    }
}

impl std::fmt::Display for Axis {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.0 {
            Vec3::X => write!(f, "x"),
            Vec3::Y => write!(f, "y"),
            Vec3::Z => write!(f, "z"),
            Vec3 { x, y, z } => write!(f, "{x},{y},{z}"),
        }
    }
}

/// Angle of a rotation sample, radians, counter-clockwise seen from the tip of the axis.
pub fn angle(turn: u32, turns: u32) -> f64 {
    TAU * f64::from(turn) / f64::from(turns.max(1))
}

/// Rotation of an occluder from its pose at rest to a rotation sample.
pub fn matrix(turn: u32, turns: u32, axis: Axis) -> DMat3 {
    if turn == 0 { DMat3::IDENTITY } else { DMat3::from_axis_angle(axis.direction(), angle(turn, turns)) }
}

/// Angle from `rest` to `now` about an axis, radians from −π to π. `None` if the change is not a rotation about the
/// axis.
pub fn about(now: Mat3, rest: Mat3, axis: Axis) -> Option<f32> {
    let scale = rest.to_cols_array().iter().fold(0f32, |m, x| m.max(x.abs()));
    if now.abs_diff_eq(rest, SAME * scale) {
        return Some(0.0);
    }
    let change = now * rest.inverse();
    if !change.is_finite() {
        return None;
    }
    let turn = Quat::from_mat3(&change);
    let axis = axis.direction().as_vec3();
    let half = turn.xyz().dot(axis).atan2(turn.w);
    // A quaternion and its negative are the same rotation.
    let angle = (2.0 * half + std::f32::consts::PI).rem_euclid(std::f32::consts::TAU) - std::f32::consts::PI;
    (angle.is_finite() && change.abs_diff_eq(Mat3::from_axis_angle(axis, angle), 10.0 * SAME)).then_some(angle)
}

/// Rotation by an angle about an axis. The angle 0 gives the exact identity.
pub fn rotation(angle: f32, axis: Axis) -> Mat3 {
    if angle == 0.0 { Mat3::IDENTITY } else { Mat3::from_axis_angle(axis.direction().as_vec3(), angle) }
}

/// The two rotation samples next to an angle, and the fraction of the way from the first to the second.
pub fn between(angle: f32, turns: u32) -> (u32, u32, f32) {
    let at = (f64::from(angle) / TAU).rem_euclid(1.0) * f64::from(turns);
    let first = (at as u32).min(turns - 1);
    (first, (first + 1) % turns, (at - f64::from(first)) as f32)
}

impl Fiv {
    /// Rotation angle of a node about the axis, radians. `None` if the change has no vectors: another rotation, a
    /// scale, or only one rotation sample.
    pub(super) fn angle(&self, pose: &Pose, node: u32) -> Option<f32> {
        let linear = |of: &Pose| of.world.get(node as usize).map(|m| Mat3::from_mat4(*m));
        let (now, rest) = linear(pose).zip(linear(&self.at_rest))?;
        about(now, rest, self.plan.turn_axis).filter(|angle| *angle == 0.0 || self.plan.turns > 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_are_found_and_other_changes_are_not() {
        let rest = Mat3::from_rotation_x(0.3) * Mat3::from_diagonal(Vec3::new(1.0, 2.0, 0.5));
        for axis in ["x", "y", "z", "1,0.5,-2"] {
            let axis = Axis::try_from(axis.to_owned()).unwrap();
            let direction = axis.direction().as_vec3();
            for angle in [0.0, 0.4, -2.0, 3.0, 0.5 * TAU as f32] {
                let turned = Mat3::from_axis_angle(direction, angle);
                let found = about(turned * rest, rest, axis).unwrap();
                let apart = (found - angle).abs();
                assert!(apart.min(TAU as f32 - apart) < 2e-4, "{axis} {angle}: {found}");
                if angle != 0.0 {
                    let (found, end) = (matrix(1, 7, axis), matrix(0, 7, axis));
                    assert!(end == DMat3::IDENTITY && (found * axis.direction() - axis.direction()).length() < 1e-12);
                }
            }
            let other = Mat3::from_axis_angle(direction.any_orthonormal_vector(), 0.5);
            assert_eq!(about(other * rest, rest, axis), None);
            assert_eq!(about(rest * 1.1, rest, axis), None);
            assert_eq!(about(rest * -1.0, rest, axis), None);
        }
        assert_eq!(about(Mat3::ZERO, Mat3::ZERO, Axis::Y), Some(0.0));
        assert_eq!(about(Mat3::IDENTITY, Mat3::ZERO, Axis::Y), None);
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
    fn an_axis_is_written_as_it_is_read_and_others_are_refused() {
        for text in ["x", "y", "z", "1,0.5,-2"] {
            assert_eq!(Axis::try_from(text.to_owned()).unwrap().to_string(), text);
        }
        assert_eq!(Axis::try_from(" 0, 1, 0 ".to_owned()).unwrap(), Axis::Y);
        for text in ["", "w", "0,0,0", "1,2", "1,2,3,4", "1,nan,0", "1,inf,0", "a,1,2", "1,2,x"] {
            let error = Axis::try_from(text.to_owned()).unwrap_err();
            assert!(error.contains("no axis; allowed: x, y, z"), "{error}");
        }
    }
}

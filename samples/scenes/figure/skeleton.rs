//! The figure's bones: where they are at rest, how thick, and whose they are.

use glam::{Vec3, vec3};

/// Joints in the order of the skin; a parent stands before its children.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Joint {
    Hips,
    Spine,
    Chest,
    Head,
    UpperArm(Side),
    Forearm(Side),
    Hand(Side),
    Thigh(Side),
    Shin(Side),
    Foot(Side),
}

/// The figure's own left (+X, it faces +Z) or right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    Left,
    Right,
}

impl Side {
    /// +1 left, −1 right.
    pub fn sign(self) -> f32 {
        if self == Self::Left { 1.0 } else { -1.0 }
    }
}

/// Length of the thigh and of the shin, metres.
pub(super) const LEG: (f32, f32) = (0.42, 0.41);
/// Height of the hip joints and of the ankles at rest.
pub(super) const HIP: f32 = ANKLE + LEG.0 + LEG.1;
pub(super) const ANKLE: f32 = 0.085;
/// Angle of the arms from the vertical at rest, degrees.
pub(super) const ARM: f32 = 32.0;

use Joint::*;
use Side::*;

/// All joints in order.
pub(super) const JOINTS: [Joint; 16] = [
    Hips,
    Spine,
    Chest,
    Head,
    UpperArm(Left),
    Forearm(Left),
    Hand(Left),
    UpperArm(Right),
    Forearm(Right),
    Hand(Right),
    Thigh(Left),
    Shin(Left),
    Foot(Left),
    Thigh(Right),
    Shin(Right),
    Foot(Right),
];

impl Joint {
    pub fn parent(self) -> Option<Self> {
        match self {
            Hips => None,
            Spine | Thigh(_) => Some(Hips),
            Chest => Some(Spine),
            Head | UpperArm(_) => Some(Chest),
            Forearm(side) => Some(UpperArm(side)),
            Hand(side) => Some(Forearm(side)),
            Shin(side) => Some(Thigh(side)),
            Foot(side) => Some(Shin(side)),
        }
    }

    pub fn name(self) -> String {
        let side = |side: Side, part: &str| format!("{} {part}", if side == Left { "left" } else { "right" });
        match self {
            Hips => "hips".to_owned(),
            Spine => "spine".to_owned(),
            Chest => "chest".to_owned(),
            Head => "head".to_owned(),
            UpperArm(s) => side(s, "upper arm"),
            Forearm(s) => side(s, "forearm"),
            Hand(s) => side(s, "hand"),
            Thigh(s) => side(s, "thigh"),
            Shin(s) => side(s, "shin"),
            Foot(s) => side(s, "foot"),
        }
    }

    /// Where the joint is at rest, in the figure's space.
    pub fn place(self) -> Vec3 {
        let arm = |side: Side, length: f32| {
            let (sin, cos) = ARM.to_radians().sin_cos();
            vec3(side.sign() * (0.175 + length * sin), 1.405 - length * cos, -0.005)
        };
        match self {
            Hips => vec3(0.0, 0.95, 0.0),
            Spine => vec3(0.0, 1.07, -0.005),
            Chest => vec3(0.0, 1.24, -0.01),
            Head => vec3(0.0, 1.51, 0.0),
            UpperArm(side) => arm(side, 0.0),
            Forearm(side) => arm(side, 0.29),
            Hand(side) => arm(side, 0.55),
            Thigh(side) => vec3(side.sign() * 0.095, HIP, 0.0),
            Shin(side) => vec3(side.sign() * 0.095, ANKLE + LEG.1, 0.0),
            Foot(side) => vec3(side.sign() * 0.095, ANKLE, 0.0),
        }
    }

    /// The bone's segment and its radii: what it weighs on.
    pub fn bone(self) -> ((Vec3, f32), (Vec3, f32)) {
        let p = self.place();
        let along = |length: f32| {
            let (sin, cos) = ARM.to_radians().sin_cos();
            move |side: Side, from: Vec3| from + vec3(side.sign() * sin, -cos, 0.0) * length
        };
        match self {
            Hips => ((p - Vec3::Y * 0.02, 0.11), (p + Vec3::Y * 0.06, 0.11)),
            Spine => ((p, 0.105), (p + Vec3::Y * 0.12, 0.11)),
            Chest => ((p + Vec3::Y * 0.03, 0.115), (p + Vec3::Y * 0.17, 0.09)),
            Head => ((p, 0.05), (p + vec3(0.0, 0.17, 0.01), 0.095)),
            UpperArm(s) => ((p, 0.055), (along(0.29)(s, p), 0.043)),
            Forearm(s) => ((p, 0.043), (along(0.25)(s, p), 0.029)),
            Hand(s) => ((p, 0.03), (along(0.12)(s, p), 0.026)),
            Thigh(_) => ((p, 0.088), (p - Vec3::Y * LEG.0, 0.06)),
            Shin(_) => ((p, 0.06), (p - Vec3::Y * LEG.1, 0.04)),
            Foot(_) => ((p - Vec3::Y * 0.04, 0.045), (p + vec3(0.0, -0.052, 0.14), 0.033)),
        }
    }
}

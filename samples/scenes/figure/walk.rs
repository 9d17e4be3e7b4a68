//! One cycle of walking in place: both steps, from inverse kinematics of the legs, so that feet stand still on the
//! ground while the figure moves on by [`STRIDE`].

use super::skeleton::{ANKLE, ARM, HIP, JOINTS, Joint, LEG, Side};
use glam::{Quat, Vec2, Vec3, vec2};
use std::f32::consts::TAU;

/// Metres forward in one cycle (two steps).
pub(super) const STRIDE: f32 = 1.15;
/// Seconds of one cycle.
pub(super) const PERIOD: f32 = 1.0;
/// Share of the cycle in which a foot stands.
const STANCE: f32 = 0.6;
/// Where the foot comes down, metres before the hip.
const CONTACT: f32 = 0.27;

/// Rotation of each joint and shift of the hips at a phase in [0, 1).
pub(super) struct Posture {
    pub rotations: [Quat; JOINTS.len()],
    pub hips: Vec3,
}

/// Ankle (forward, up) and pitch of the foot (toes up is positive), at a phase of its own leg.
fn foot(phase: f32) -> (Vec2, f32) {
    let phase = phase.rem_euclid(1.0);
    let release = CONTACT - STANCE * STRIDE;
    if phase < STANCE {
        let t = phase / STANCE;
        let along = CONTACT - STRIDE * phase;
        // The heel comes down first, and rises at the end while the ball of the foot still stands.
        let down = 0.3 * (1.0 - t / 0.15).max(0.0);
        let rise = ((t - 0.6) / 0.4).max(0.0);
        let pitch = down - 0.75 * rise * rise;
        (vec2(along + 0.03 * rise * rise, ANKLE + 0.02 * down + 0.085 * rise * rise), pitch)
    } else {
        let t = (phase - STANCE) / (1.0 - STANCE);
        let ease = t * t * (3.0 - 2.0 * t);
        let start = release + 0.03;
        let along = start + (CONTACT - start) * ease;
        let lift = (1.0 - t).powi(2) * 0.085 + 0.11 * (std::f32::consts::PI * t).sin().powi(2) * (1.0 - 0.35 * t);
        let pitch = -0.75 * (1.0 - t) * (1.0 - 1.3 * t) + 0.3 * t * t;
        (vec2(along, ANKLE + lift + 0.006 * t), pitch)
    }
}

/// Angles of thigh (forward) and knee (bent) that bring the ankle to `target` (forward, up) from a hip at height `hip`.
pub(super) fn leg(hip: f32, target: Vec2) -> (f32, f32) {
    let (thigh, shin) = LEG;
    let way = target - vec2(0.0, hip);
    let reach = way.length().clamp((thigh - shin).abs() + 1e-3, thigh + shin - 1e-3);
    let at_hip = ((thigh * thigh + reach * reach - shin * shin) / (2.0 * thigh * reach)).clamp(-1.0, 1.0).acos();
    let at_knee = ((thigh * thigh + shin * shin - reach * reach) / (2.0 * thigh * shin)).clamp(-1.0, 1.0).acos();
    (way.x.atan2(-way.y) + at_hip, std::f32::consts::PI - at_knee)
}

/// Height of the hip joints at a phase: lowest when both feet stand, highest over the standing leg.
pub(super) fn hip_height(phase: f32) -> f32 {
    HIP - 0.035 - 0.016 * (2.0 * TAU * (phase - 0.05)).cos()
}

/// The posture at a phase; the left heel comes down at phase 0.
pub(super) fn posture(phase: f32) -> Posture {
    let swing = |offset: f32| (TAU * (phase + offset)).cos();
    let hip = hip_height(phase);
    let rotations = JOINTS.map(|joint| {
        // Positive angles about X swing a hanging limb backward.
        let sagittal = |angle: f32| Quat::from_rotation_x(-angle);
        let at = |side: Side| if side == Side::Left { phase } else { phase + 0.5 };
        match joint {
            Joint::Hips => Quat::from_rotation_y(-0.07 * swing(0.0)) * Quat::from_rotation_z(0.03 * swing(0.25)),
            Joint::Spine => Quat::from_rotation_y(0.08 * swing(0.0)) * Quat::from_rotation_x(0.04),
            Joint::Chest => Quat::from_rotation_y(0.09 * swing(0.0)) * Quat::from_rotation_z(-0.025 * swing(0.25)),
            Joint::Head => Quat::from_rotation_y(-0.1 * swing(0.0)) * Quat::from_rotation_x(-0.03),
            Joint::UpperArm(side) => {
                let lower = Quat::from_rotation_z(-side.sign() * (ARM - 9.0).to_radians());
                sagittal(-0.42 * (TAU * (at(side) + 0.02)).cos() - 0.05) * lower
            }
            Joint::Forearm(side) => sagittal(0.38 - 0.24 * (TAU * (at(side) - 0.04)).cos()),
            Joint::Hand(_) => sagittal(0.12),
            Joint::Thigh(side) => {
                let (thigh, _) = leg(hip, foot(at(side)).0);
                // The hips' own turn and roll are taken back, so that feet stay where they stand.
                let hips = Quat::from_rotation_y(-0.07 * swing(0.0)) * Quat::from_rotation_z(0.03 * swing(0.25));
                hips.inverse() * sagittal(thigh)
            }
            Joint::Shin(side) => sagittal(-leg(hip, foot(at(side)).0).1),
            Joint::Foot(side) => {
                let (target, pitch) = foot(at(side));
                let (thigh, knee) = leg(hip, target);
                sagittal(pitch - thigh + knee)
            }
        }
    });
    Posture { rotations, hips: Vec3::new(0.012 * swing(-0.3), hip - HIP, 0.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn standing_feet_move_back_as_the_figure_moves_on() {
        for i in 2..16 {
            let (a, b) = (foot(i as f32 * 0.02), foot((i + 1) as f32 * 0.02));
            assert!((a.0.x - b.0.x - 0.02 * STRIDE).abs() < 1e-5, "the foot slides at {}", i as f32 * 0.02);
        }
    }

    #[test]
    fn ankles_reach_their_targets_and_the_cycle_closes() {
        for i in 0..100 {
            let phase = i as f32 / 100.0;
            let (target, _) = foot(phase);
            let hip = hip_height(phase);
            let (thigh, knee) = leg(hip, target);
            let end = vec2(0.0, hip)
                + LEG.0 * vec2(thigh.sin(), -thigh.cos())
                + LEG.1 * vec2((thigh - knee).sin(), -(thigh - knee).cos());
            assert!((end - target).length() < 0.012, "phase {phase}: ankle at {end}, not {target}");
            assert!((0.0..1.6).contains(&knee), "phase {phase}: knee bent by {knee}");
            let next = foot(phase + 0.01).0;
            assert!((next - target).length() < 0.05, "the foot jumps at {phase}: {target} to {next}");
        }
        let (a, b) = (posture(0.0), posture(1.0));
        assert!(a.rotations.iter().zip(&b.rotations).all(|(p, q)| p.angle_between(*q) < 1e-3));
    }
}

//! The figure's skin: one closed smooth surface around the bones, its weights and its clothes.

use super::super::kit::{Geometry, blend, round_cone, srgb, surface_net};
use super::skeleton::{JOINTS, Joint, Side};
use glam::{Vec3, Vec4, vec3};

/// Metres between samples of the distance field.
const CELL: f32 = 0.0145;

/// The surface at rest with vertex colours.
pub(super) fn surface() -> Geometry {
    let mut out = surface_net(vec3(-0.68, -0.03, -0.2), vec3(0.68, 1.84, 0.26), CELL, distance);
    out.colors = out.positions.iter().map(|p| clothes(*p).extend(1.0)).collect();
    out
}

/// Signed distance to the body, metres, approximately.
fn distance(p: Vec3) -> f32 {
    // The body is its own mirror image.
    let p = vec3(p.x.abs(), p.y, p.z);
    let side = Side::Left;
    let mut d = f32::INFINITY;
    let mut join = |part: f32, fillet: f32| d = if d == f32::INFINITY { part } else { blend(d, part, fillet) };
    let cone = |a: [f32; 3], ra: f32, b: [f32; 3], rb: f32| round_cone(p, (a.into(), ra), (b.into(), rb));
    join(cone([0.0, 0.955, 0.0], 0.112, [0.075, 0.94, -0.01], 0.108), 0.05);
    join(cone([0.032, 1.02, 0.0], 0.104, [0.036, 1.18, 0.0], 0.104), 0.05);
    join(cone([0.0, 1.27, -0.01], 0.118, [0.085, 1.3, -0.012], 0.098), 0.06);
    join(cone([0.0, 1.385, -0.015], 0.07, [0.165, 1.405, -0.01], 0.06), 0.06);
    join(cone([0.0, 1.42, -0.01], 0.055, [0.0, 1.55, 0.005], 0.05), 0.04);
    join(cone([0.0, 1.675, -0.008], 0.096, [0.0, 1.655, 0.022], 0.086), 0.03);
    join(cone([0.0, 1.6, 0.03], 0.062, [0.0, 1.585, 0.052], 0.045), 0.04);
    join(cone([0.0, 1.655, 0.1], 0.009, [0.0, 1.632, 0.116], 0.014), 0.02);
    join(cone([0.086, 1.64, 0.0], 0.016, [0.09, 1.66, -0.006], 0.02), 0.012);
    for joint in [Joint::UpperArm(side), Joint::Forearm(side), Joint::Thigh(side), Joint::Shin(side)] {
        let ((a, ra), (b, rb)) = joint.bone();
        join(round_cone(p, (a, ra), (b, rb)), 0.045);
    }
    // Calf, seat, hand with thumb, shoe with heel.
    join(cone([0.097, 0.4, -0.018], 0.056, [0.097, 0.28, -0.015], 0.046), 0.05);
    join(cone([0.07, 0.92, -0.055], 0.085, [0.075, 0.88, -0.045], 0.08), 0.05);
    let ((wrist, _), (finger, _)) = Joint::Hand(side).bone();
    join(round_cone(p, (wrist, 0.027), (finger.lerp(wrist, 0.35), 0.035)), 0.03);
    join(round_cone(p, (finger.lerp(wrist, 0.4), 0.031), (finger + (finger - wrist) * 0.25, 0.018)), 0.02);
    let thumb = finger.lerp(wrist, 0.6) + vec3(-0.005, 0.0, 0.025);
    join(round_cone(p, (thumb, 0.018), (thumb + vec3(0.008, -0.05, 0.018), 0.014)), 0.02);
    join(cone([0.095, 0.05, -0.035], 0.044, [0.1, 0.04, 0.05], 0.042), 0.03);
    join(cone([0.1, 0.042, 0.05], 0.042, [0.108, 0.034, 0.145], 0.034), 0.03);
    // A flat sole.
    d.max(0.006 - p.y)
}

/// Shirt, trousers, shoes, hair and skin by place.
fn clothes(p: Vec3) -> Vec3 {
    let side = if p.x < 0.0 { Side::Right } else { Side::Left };
    let wrist = Joint::Hand(side).place();
    let elbow = Joint::Forearm(side).place();
    let on_arm = (p - elbow).dot((wrist - elbow).normalize_or(Vec3::NEG_Y)) / (wrist - elbow).length();
    let far_out = p.x.abs() > 0.2 && p.y > 0.7;
    let eye = (vec3(p.x.abs(), p.y, p.z) - vec3(0.036, 1.658, 0.1)).length();
    let mouth = ((p - vec3(0.0, 1.597, 0.095)) * vec3(0.5, 1.5, 1.0)).length();
    if eye < 0.016 {
        srgb(0x33251f)
    } else if mouth < 0.016 {
        srgb(0xa4534a)
    } else if p.y > 1.47 && (p.x.abs() < 0.095 || p.y > 1.52) {
        let hairline = p.y - 1.655 - 0.9 * (p.z - 0.01).max(-0.09) + 0.4 * p.x.abs();
        if p.y > 1.56 && hairline > 0.0 { srgb(0x3a2416) } else { srgb(0xd9a07c) }
    } else if far_out && on_arm > 0.12 {
        srgb(0xd9a07c)
    } else if p.y < 0.105 {
        srgb(0x4a2c1c)
    } else if p.y < 0.975 && !far_out {
        // A belt closes the trousers.
        if p.y > 0.945 { srgb(0x2c1f17) } else { srgb(0x33485e) }
    } else {
        srgb(0xc4482f)
    }
}

/// Joints and weights of a vertex: the nearest bones, weighed by how much farther than the nearest one they are.
pub(super) fn weights(p: Vec3) -> ([u16; 4], Vec4) {
    /// Metres over which bones share a vertex.
    const SHARE: f32 = 0.035;
    let distances = JOINTS.map(|joint| {
        let (a, b) = joint.bone();
        // Limbs of the other side never take part.
        let other = match joint {
            Joint::UpperArm(s)
            | Joint::Forearm(s)
            | Joint::Hand(s)
            | Joint::Thigh(s)
            | Joint::Shin(s)
            | Joint::Foot(s) => s.sign() * p.x < -0.02,
            _ => false,
        };
        if other { f32::INFINITY } else { round_cone(p, a, b) }
    });
    let nearest = distances.iter().copied().fold(f32::INFINITY, f32::min);
    let mut shares: Vec<(u16, f32)> =
        distances.iter().enumerate().map(|(i, d)| (i as u16, (-((d - nearest) / SHARE).powi(2)).exp())).collect();
    shares.sort_by(|a, b| b.1.total_cmp(&a.1));
    let sum: f32 = shares[..4].iter().map(|s| s.1).sum();
    ([0, 1, 2, 3].map(|k| shares[k].0), Vec4::from([0, 1, 2, 3].map(|k| shares[k].1 / sum)))
}

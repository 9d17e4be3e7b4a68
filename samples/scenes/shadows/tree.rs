//! A tree whose leaves are triangles: about 20 000 vertices that stop light.

use super::super::kit::{Geometry, Random, sweep};
use glam::{Quat, Vec2, Vec3, vec2, vec3};
use std::f32::consts::TAU;

/// Leaves around each tip.
const LEAVES: usize = 48;

struct Limb {
    from: Vec3,
    way: Vec3,
    length: f32,
    radius: f32,
}

/// Wood and leaves of a tree of about 1.7 m.
pub(super) fn tree() -> (Geometry, Geometry) {
    let mut random = Random::new(7);
    let (mut wood, mut tips) = (Geometry::default(), Vec::new());
    let trunk = Limb { from: Vec3::ZERO, way: Vec3::Y, length: 0.62, radius: 0.06 };
    grow(&mut wood, &mut tips, &trunk, 4, &mut random);
    let mut leaves = Geometry::default();
    for (tip, way) in tips {
        for _ in 0..LEAVES {
            let mut unit = || vec3(random.range(-1.0, 1.0), random.range(-1.0, 1.0), random.range(-1.0, 1.0));
            let (place, up, side) = (tip + unit() * 0.13, (way + unit()).normalize_or(Vec3::Y), unit());
            let right = up.cross(side).normalize_or(up.any_orthonormal_vector());
            leaf(&mut leaves, place, right * 0.016, up * 0.07);
        }
    }
    (wood, leaves)
}

/// A rhombus from `foot`, `up` long and twice `right` wide.
fn leaf(out: &mut Geometry, foot: Vec3, right: Vec3, up: Vec3) {
    let normal = right.cross(up).normalize_or(Vec3::Y);
    let corners = [(0.0, 0.0), (1.0, 0.45), (0.0, 1.0), (-1.0, 0.45)];
    let ids = corners.map(|(r, u)| out.vertex(foot + right * r + up * u, normal, vec2(r * 0.016, u * 0.07)));
    out.quad(ids[0], ids[1], ids[2], ids[3]);
}

/// A limb as a bent pipe that gets thinner, and its children; ends of the last ones become tips.
fn grow(wood: &mut Geometry, tips: &mut Vec<(Vec3, Vec3)>, limb: &Limb, levels: u32, random: &mut Random) {
    let sway = vec3(random.range(-1.0, 1.0), random.range(-0.2, 0.4), random.range(-1.0, 1.0)) * 0.15 * limb.length;
    let path: Vec<Vec3> = (0..=4)
        .map(|i| {
            let t = i as f32 / 4.0;
            limb.from + limb.way * (limb.length * t) + sway * (t * t)
        })
        .collect();
    let sides = if levels > 2 { 8 } else { 5 };
    let ring: Vec<Vec2> = (0..sides).map(|i| Vec2::from_angle(TAU * i as f32 / sides as f32) * limb.radius).collect();
    wood.append(&sweep(&path, &ring, true, |i| 1.0 - 0.12 * i as f32));
    let way = (path[4] - path[3]).normalize_or(limb.way);
    if levels == 1 {
        tips.push((path[4], way));
        return;
    }
    let children = if levels == 4 { 5 } else { 4 };
    let start = random.range(0.0, TAU);
    for i in 0..children {
        let turn = start + TAU * i as f32 / children as f32 + random.range(-0.4, 0.4);
        let lean = random.range(0.4, 0.85);
        let side = Quat::from_rotation_arc(Vec3::Y, way) * vec3(turn.cos(), 0.0, turn.sin());
        let child = (way * lean.cos() + side * lean.sin() + Vec3::Y * 0.1).normalize_or(way);
        let from = path[4].lerp(path[3], 0.7 * random.unit());
        let next =
            Limb { from, way: child, length: limb.length * random.range(0.58, 0.74), radius: limb.radius * 0.55 };
        grow(wood, tips, &next, levels - 1, random);
    }
}

//! Trees and bushes of masked leaf cards, grass, cacti, rocks.

use super::super::kit::{Geometry, Random, fbm, hash, sphere, srgb, srgb_from_linear, surface_net, sweep, value_noise};
use glam::{Mat4, Quat, Vec2, Vec3, vec2, vec3};
use lucerna::scene::Texture;
use std::f32::consts::TAU;

/// A picture with alpha from a function of (u, v): linear colour, and whether the texel is covered. Colours bleed over
/// the border so that filtering brings in no black.
fn masked(name: &str, size: u32, texel: impl Fn(Vec2) -> (Vec3, bool)) -> Texture {
    let byte = |c: f32| (srgb_from_linear(c) * 255.0).round() as u8;
    let rgba = (0..size * size)
        .map(|i| {
            let uv = vec2((i % size) as f32 + 0.5, (i / size) as f32 + 0.5) / size as f32;
            // Four samples a texel soften the edge of the mask.
            let samples = [(-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25)]
                .map(|(x, y)| texel(uv + vec2(x, y) / size as f32).1);
            let covered = samples.iter().filter(|s| **s).count() as f32 / 4.0;
            let (color, _) = texel(uv);
            [byte(color.x), byte(color.y), byte(color.z), (covered * 255.0) as u8]
        })
        .collect();
    Texture { name: name.to_owned(), width: size, height: size, rgba }
}

/// A spray of leaves on twigs, its foot in the middle of the lower border.
pub(super) fn leaf_picture() -> Texture {
    let mut random = Random::new(31);
    // Centre, direction, half length and tone of each leaf.
    let leaves: Vec<(Vec2, Vec2, f32, f32)> = (0..46)
        .map(|_| {
            let reach = random.unit().sqrt() * 0.86 + 0.06;
            let lean = random.range(-1.0, 1.0) * 0.75;
            let direction = Vec2::from_angle(-std::f32::consts::FRAC_PI_2 + lean);
            let centre = vec2(0.5, 0.98) + direction * reach * 0.88 / (1.0 + 0.35 * lean.abs());
            let own = Vec2::from_angle(-std::f32::consts::FRAC_PI_2 + lean + random.range(-1.1, 1.1));
            (centre, own, random.range(0.055, 0.088), random.range(0.6, 1.15))
        })
        .collect();
    masked("leaves", 256, |uv| {
        let mut color = srgb(0x5f7a33);
        let mut covered = false;
        for (centre, direction, half, tone) in &leaves {
            let p = uv - *centre;
            let (along, across) = (p.dot(*direction) / half, p.dot(direction.perp()) / half);
            let width = 0.52 * (1.0 - along * along).max(0.0) * (1.0 - 0.35 * along);
            if across.abs() < width && along.abs() < 1.0 {
                let vein = if across.abs() < 0.045 { 1.25 } else { 1.0 };
                color = srgb(0x6f8c37).lerp(srgb(0x3f5c22), 0.5 + 0.5 * across) * *tone * vein;
                covered = true;
            }
        }
        let twig = (uv.x - 0.5 - 0.03 * (uv.y * 9.0).sin()).abs() < 0.009 && uv.y > 0.2;
        if twig && !covered { (srgb(0x5a452f), true) } else { (color, covered) }
    })
}

/// Blades of dry grass that rise from the lower border.
pub(super) fn grass_picture() -> Texture {
    let mut random = Random::new(33);
    let blades: Vec<[f32; 5]> = (0..30)
        .map(|_| {
            let foot = 0.5 + (random.unit() - 0.5) * 0.55;
            let bend = (foot - 0.5) * 0.9 + random.range(-0.25, 0.25);
            [foot, bend, random.range(0.45, 0.97), random.range(0.011, 0.02), random.unit()]
        })
        .collect();
    masked("grass", 128, |uv| {
        let up = 1.0 - uv.y;
        let mut color = srgb(0xa39a55);
        let mut covered = false;
        for [foot, bend, height, width, tone] in &blades {
            let t = up / height;
            let x = foot + bend * t * t;
            if t < 1.0 && (uv.x - x).abs() < width * (1.0 - t) + 0.002 {
                color = srgb(0xc2b068).lerp(srgb(0x84913f), *tone) * (0.7 + 0.5 * t);
                covered = true;
            }
        }
        (color, covered)
    })
}

/// Adds a card: `foot` the middle of its lower edge, `up` and `right` its half-free axes in metres; `normal` shades it.
fn card(out: &mut Geometry, foot: Vec3, right: Vec3, up: Vec3, normal: Vec3) {
    let corner = |r: f32, u: f32| foot + right * r + up * u;
    let ids = [(-0.5, 0.0, 0.0, 1.0), (0.5, 0.0, 1.0, 1.0), (0.5, 1.0, 1.0, 0.0), (-0.5, 1.0, 0.0, 0.0)]
        .map(|(r, u, s, t)| out.vertex(corner(r, u), normal, vec2(s, t)));
    out.quad(ids[0], ids[1], ids[2], ids[3]);
}

/// Bark and leaves of a tree of about `height` m.
pub(super) fn tree(height: f32, random: &mut Random) -> (Geometry, Geometry) {
    let (mut bark, mut tips) = (Geometry::default(), Vec::new());
    let trunk = Limb { from: vec3(0.0, -0.3, 0.0), way: Vec3::Y, length: height * 0.42, radius: height * 0.032 };
    grow(&mut bark, &mut tips, trunk, 4, random);
    let centre = tips.iter().map(|(p, _)| *p).sum::<Vec3>() / tips.len().max(1) as f32;
    let mut leaves = Geometry::default();
    for (tip, way) in &tips {
        for _ in 0..7 {
            let spread = vec3(random.range(-1.0, 1.0), random.range(-0.7, 1.0), random.range(-1.0, 1.0));
            let up = (*way + spread * 1.1).normalize_or(Vec3::Y);
            let outward = (*tip + up * 0.4 - centre).normalize_or(Vec3::Y);
            let size = random.range(0.62, 1.0) * height * 0.115;
            let mut right = up.cross(outward + spread * 0.4).normalize_or(up.any_orthonormal_vector());
            if right.cross(up).dot(outward) < 0.0 {
                right = -right;
            }
            let face = right.cross(up);
            let normal = (outward * 0.8 + face * 0.5 + Vec3::Y * 0.2).normalize_or(Vec3::Y);
            card(&mut leaves, *tip - up * size * 0.25, right * size, up * size, normal);
        }
    }
    (bark, leaves)
}

struct Limb {
    from: Vec3,
    way: Vec3,
    length: f32,
    radius: f32,
}

/// A limb as a bent tapering pipe, and its children; ends of the last ones become tips.
fn grow(bark: &mut Geometry, tips: &mut Vec<(Vec3, Vec3)>, limb: Limb, levels: u32, random: &mut Random) {
    let Limb { from, way, length, radius } = limb;
    let sway = vec3(random.range(-1.0, 1.0), random.range(-0.2, 0.5), random.range(-1.0, 1.0)) * 0.16 * length;
    let steps = if levels > 2 { 6 } else { 4 };
    let path: Vec<Vec3> = (0..=steps)
        .map(|i| {
            let t = i as f32 / steps as f32;
            from + way * length * t + sway * t * t
        })
        .collect();
    let sides = [5, 5, 6, 8, 11][levels as usize];
    let ring: Vec<Vec2> = (0..sides).map(|i| Vec2::from_angle(TAU * i as f32 / sides as f32) * radius).collect();
    let flare = if levels == 4 { 0.5 } else { 0.0 };
    bark.append(&sweep(&path, &ring, true, |i| {
        let t = i as f32 / steps as f32;
        1.0 - 0.45 * t + flare * (1.0 - t).powi(4)
    }));
    let end = from + way * length + sway;
    let direction = (path[steps] - path[steps - 1]).normalize_or(way);
    if levels == 1 {
        tips.push((end, direction));
        tips.push(((end + from) * 0.5, direction));
        return;
    }
    let children = if levels == 4 { 5 } else { 3 };
    let start = random.range(0.0, TAU);
    for i in 0..children {
        let turn = start + TAU * i as f32 / children as f32 + random.range(-0.4, 0.4);
        let lean = random.range(0.45, 0.85);
        let side = Quat::from_rotation_arc(Vec3::Y, direction) * vec3(turn.cos(), 0.0, turn.sin());
        let child = (direction * lean.cos() + side * lean.sin() + Vec3::Y * 0.12).normalize_or(direction);
        let at = path[steps].lerp(path[steps - 1], 0.6 * random.unit());
        let next = Limb { from: at, way: child, length: length * random.range(0.6, 0.78), radius: radius * 0.52 };
        grow(bark, tips, next, levels - 1, random);
    }
}

/// Tufts of crossed grass cards on the ground: both sides of every card are there, lit from above.
pub(super) fn grass(places: &[Vec3], random: &mut Random) -> Geometry {
    let mut out = Geometry::default();
    for place in places {
        let (turn, size) = (random.range(0.0, TAU), random.range(0.28, 0.62));
        for k in 0..2 {
            let angle = turn + std::f32::consts::FRAC_PI_2 * k as f32;
            let right = vec3(angle.cos(), 0.0, angle.sin());
            let up = Vec3::Y * size + vec3(random.range(-0.1, 0.1), 0.0, random.range(-0.1, 0.1)) * size;
            for side in [1.0, -1.0] {
                let face = (right * side).cross(up).normalize_or(Vec3::Z);
                let normal = (face * 0.35 + Vec3::Y).normalize_or(Vec3::Y);
                card(&mut out, *place - Vec3::Y * 0.03, right * side * size * 1.2, up, normal);
            }
        }
    }
    out
}

/// A low bush of leaf cards around a centre at y = 0, about `size` m across.
pub(super) fn bush(size: f32, cards: usize, random: &mut Random) -> Geometry {
    let mut out = Geometry::default();
    for _ in 0..cards {
        let turn = random.range(0.0, TAU);
        let lift = random.range(0.15, 1.0);
        let outward = vec3(turn.cos(), lift, turn.sin()).normalize();
        let up = (outward + vec3(random.range(-0.5, 0.5), 0.3, random.range(-0.5, 0.5))).normalize();
        let right = up.cross(outward + Vec3::Y * 0.01).normalize_or(up.any_orthonormal_vector());
        let right = if right.cross(up).dot(outward) < 0.0 { -right } else { right };
        let length = size * random.range(0.3, 0.5);
        let foot = outward * vec3(1.0, 0.7, 1.0) * size * random.range(0.02, 0.25);
        card(&mut out, foot, right * length, up * length, (outward + right.cross(up) * 0.4).normalize_or(Vec3::Y));
    }
    out
}

/// A ribbed cactus of `height` m with `arms`.
pub(super) fn cactus(height: f32, arms: usize, random: &mut Random) -> Geometry {
    let column = |path: &[Vec3], radius: f32| {
        let ribs = 9;
        let ring: Vec<Vec2> = (0..ribs * 2)
            .map(|i| Vec2::from_angle(TAU * i as f32 / (2 * ribs) as f32) * radius * if i % 2 == 0 { 1.0 } else { 0.8 })
            .collect();
        let last = (path.len() - 1) as f32;
        sweep(path, &ring, true, move |i| {
            let t = i as f32 / last;
            (0.82 + 0.18 * (t * 3.0).min(1.0)) * (1.0 - ((t - 0.82) / 0.19).max(0.0).powi(2)).max(0.0).sqrt().max(0.06)
        })
    };
    let trunk: Vec<Vec3> = (0..=12).map(|i| vec3(0.0, height * i as f32 / 12.0 - 0.1, 0.0)).collect();
    let mut out = column(&trunk, height * 0.058);
    for k in 0..arms {
        let start = height * random.range(0.35, 0.6);
        let (reach, rise) = (height * random.range(0.13, 0.18), height * random.range(0.22, 0.38));
        let path: Vec<Vec3> = (0..=11)
            .map(|i| {
                let t = i as f32 / 11.0;
                let bend = (t * 2.2).min(1.0);
                let x = reach * (bend * std::f32::consts::FRAC_PI_2).sin();
                let y = reach * 0.55 * (1.0 - (bend * std::f32::consts::FRAC_PI_2).cos())
                    + rise * ((t - 0.4) / 0.6).max(0.0);
                vec3(x, start + y, 0.0)
            })
            .collect();
        let turn = TAU * k as f32 / arms.max(1) as f32 + random.range(-0.5, 0.5);
        out.append(&column(&path, height * 0.042).transformed(Mat4::from_rotation_y(turn)));
    }
    out
}

/// A weathered boulder of about `size` m, resting in the ground.
pub(super) fn rock(size: f32, seed: u32) -> Geometry {
    let shape = move |p: Vec3| {
        let q = p / size;
        let n = |s: f32, k: u32| {
            fbm(vec2(q.x * s + q.z * 0.6 * s, q.y * s * 1.4 - q.z * 0.4 * s), 0, 2, seed + k)
                + value_noise(vec2(q.z * s, q.x * s + q.y * s), 0, seed + k + 7)
        };
        // Facets: the ball is cut by planes at different distances.
        let cut = (0..9).fold(f32::NEG_INFINITY, |far, k| {
            let angle = |m: u32| hash(seed.wrapping_mul(77) ^ (k * 13 + m)) as f32 / u32::MAX as f32;
            let (turn, tilt) = (angle(1) * TAU, angle(2) * 2.2 - 1.1);
            let normal = vec3(turn.cos() * tilt.cos(), tilt.sin(), turn.sin() * tilt.cos());
            far.max(q.dot(normal) - (0.33 + 0.14 * angle(3)))
        });
        (cut.max(q.length() - 0.52) + 0.07 * (n(2.2, 1) - 1.0)) * size
    };
    let reach = Vec3::splat(size * 0.68);
    surface_net(-reach, reach, size * 0.115, shape)
}

/// A ball of dry stems that the wind rolls.
pub(super) fn tumbleweed(size: f32, random: &mut Random) -> Geometry {
    let mut out = Geometry::default();
    for _ in 0..34 {
        let turn = Quat::from_euler(
            glam::EulerRot::XYZ,
            random.range(0.0, TAU),
            random.range(0.0, TAU),
            random.range(0.0, TAU),
        );
        let arc = random.range(1.2, 3.0);
        let radius = size * random.range(0.3, 0.5);
        let path: Vec<Vec3> = (0..=5)
            .map(|i| {
                let angle = arc * i as f32 / 5.0;
                turn * vec3(radius * angle.cos(), radius * angle.sin(), radius * 0.3 * (angle * 2.0).sin())
                    + Vec3::Y * size * 0.45
            })
            .collect();
        let stem = [vec2(0.005, 0.0), vec2(-0.0025, 0.0043), vec2(-0.0025, -0.0043)];
        out.append(&sweep(&path, &stem, true, |_| 1.0));
    }
    out
}

/// The crown of distant scrub: a rough half ball.
pub(super) fn scrub(size: f32, seed: u32) -> Geometry {
    sphere(size, 14, 8).displaced(|p| {
        let q = p / size;
        let bump = fbm(vec2(q.x * 2.5 + q.z * 1.7, q.y * 2.5 - q.z), 0, 3, seed);
        let scaled = p * (0.65 + 0.7 * bump);
        vec3(scaled.x, scaled.y.max(-0.2 * size) * 0.7, scaled.z)
    })
}

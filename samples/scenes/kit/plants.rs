//! A fern and a small tree, each in its pot.

use super::{Geometry, Model, Random, circle, curve, lathe, srgb, sweep};
use glam::{Mat4, Quat, Vec2, Vec3, vec2, vec3};

/// A round pot of `radius` and `height` filled with soil, standing on y = 0.
fn pot(clay: u32, radius: f32, height: f32) -> Model {
    let points = [
        (0.0, 0.0),
        (0.62, 0.0),
        (0.72, 0.06),
        (0.98, 0.8),
        (1.0, 0.97),
        (0.97, 1.0),
        (0.92, 0.97),
        (0.89, 0.86),
        (0.0, 0.86),
    ];
    let outline: Vec<Vec2> = points.iter().map(|&(r, y)| vec2(r * radius, y * height)).collect();
    Model::of(clay, lathe(&outline, 36, 40.0))
}

/// A leaf along +X from the origin, `length` long, bent down at its tip, in two halves along its rib.
fn leaf(length: f32, width: f32, droop: f32) -> Geometry {
    let steps = 5;
    let mut out = Geometry::default();
    for i in 0..=steps {
        let t = i as f32 / steps as f32;
        let half = width * (std::f32::consts::PI * (0.06 + 0.94 * t)).sin().max(0.0).powf(0.8) * (1.0 - 0.35 * t);
        let (x, y) = (length * t, -droop * length * t * t);
        for side in [-1.0, 0.0, 1.0f32] {
            let p = vec3(x, y + 0.22 * half * side.abs(), side * half);
            out.vertex(p, Vec3::Y, vec2(p.x, p.z));
        }
    }
    for i in 0..steps as u32 {
        for side in 0..2 {
            let at = 3 * i + side;
            // Seen from above: x to the right, z down.
            out.quad(at + 1, at + 4, at + 3, at);
        }
    }
    out.smooth_normals();
    out
}

/// Arching fronds with leaflets, from a pot 0.3 m high.
pub(crate) fn fern((clay, green_paint): (u32, u32), fronds: usize, random: &mut Random) -> Model {
    let mut model = pot(clay, 0.2, 0.3);
    let mut green = Geometry::default();
    for i in 0..fronds {
        let (turn, lean, length) = (i as f32 * 137.5, random.range(0.25, 1.0), random.range(0.45, 0.75));
        let rib: Vec<Vec3> = (0..=9)
            .map(|k| {
                let t = k as f32 / 9.0;
                vec3(0.03 + lean * length * (0.35 * t + 0.65 * t * t), 0.26 + length * (t - 0.75 * lean * t * t), 0.0)
            })
            .collect();
        let mut frond = sweep(&rib, &circle(0.0035, 4), true, |k| 1.0 - 0.08 * k as f32);
        for k in 2..rib.len() {
            let along = (rib[k] - rib[k - 1]).normalize_or(Vec3::X);
            for side in [-1.0f32, 1.0] {
                let size = 0.15 * (1.15 - k as f32 / 10.0);
                let way = Quat::from_rotation_arc(Vec3::X, (along * 0.35 + Vec3::Z * side).normalize_or(Vec3::Z));
                let map = Mat4::from_rotation_translation(way, rib[k]);
                frond.append(&leaf(size, 0.18 * size, 0.25).transformed(map));
            }
        }
        green.append(&frond.turned_y(turn).colored(srgb(0x4f7f38) * random.range(0.6, 1.15)));
    }
    model.add(green_paint, green);
    model
}

/// A slender tree 1.8 m high with `leaves` large leaves.
pub(crate) fn tree((clay, green_paint): (u32, u32), leaves: usize, random: &mut Random) -> Model {
    let mut model = pot(clay, 0.23, 0.42);
    let mut bark = Geometry::default();
    let mut green = Geometry::default();
    for stem in 0..3 {
        let turn = 120.0 * stem as f32 + random.range(-20.0, 20.0);
        let tall = [1.75, 1.35, 1.1][stem];
        let way = curve(
            &[
                vec3(0.05, 0.34, 0.0),
                vec3(0.06, 0.34 + 0.4 * (tall - 0.34), 0.03),
                vec3(0.12, 0.34 + 0.75 * (tall - 0.34), -0.02),
                vec3(0.16, tall, 0.0),
            ],
            4,
        );
        let last = way.len() - 1;
        let trunk = sweep(&way, &circle(0.013, 7), true, |k| 1.0 - 0.6 * k as f32 / last as f32);
        bark.append(&trunk.turned_y(turn).colored(srgb(0x6d5a43)));
        for i in 0..leaves / 3 {
            let t = 0.35 + 0.65 * (i as f32 + 0.5) / (leaves / 3) as f32;
            let place = way[((t * last as f32) as usize).min(last)];
            let pitch = random.range(0.1, 0.75) + 0.5 * (t - 0.5);
            let map = Mat4::from_translation(place)
                * Mat4::from_rotation_y((137.5 * i as f32 + random.range(-15.0, 15.0)).to_radians())
                * Mat4::from_rotation_z(pitch);
            let long = random.range(0.2, 0.34);
            let one = leaf(long, 0.24 * long, random.range(0.35, 0.8)).transformed(map);
            green.append(&one.turned_y(turn).colored(srgb(0x3f7a3a) * random.range(0.65, 1.2)));
        }
    }
    model.add(green_paint, bark);
    model.add(green_paint, green);
    model
}

//! A small hatchback: a smooth body from a distance field, glass and lamps wrapped onto it, four wheels.

use super::super::kit::{
    Geometry, Model, Stage, bevel_box, blend_max, cylinder, lathe, polygon_distance, shrink_wrap, srgb, surface_net,
};
use glam::{Vec2, Vec3, vec2, vec3};
use lucerna::scene::Material;

/// Radius of the wheels and where their axles are: (±x, z).
const WHEEL: f32 = 0.31;
const TRACK: f32 = 0.74;
const AXLES: [f32; 2] = [1.24, -1.27];

/// Side view (z, y), the nose towards +z, 6 cm inside the body's outline.
const SIDE: [(f32, f32); 18] = [
    (1.86, 0.28),
    (1.98, 0.34),
    (2.0, 0.5),
    (1.95, 0.64),
    (1.55, 0.76),
    (0.98, 0.86),
    (0.62, 1.1),
    (0.34, 1.29),
    (-0.05, 1.345),
    (-0.6, 1.345),
    (-1.1, 1.31),
    (-1.4, 1.24),
    (-1.78, 0.93),
    (-1.92, 0.84),
    (-1.97, 0.6),
    (-1.95, 0.4),
    (-1.84, 0.3),
    (-1.6, 0.28),
];

/// Materials of a car.
pub(super) struct Finish {
    pub paint: u32,
    pub glass: u32,
    pub rubber: u32,
    pub rim: u32,
    pub lamp: u32,
    pub tail: u32,
    pub plate: u32,
}

/// What all cars share; `paint` differs.
pub(super) fn finish(stage: &mut Stage, name: &str, color: u32) -> Finish {
    Finish {
        paint: stage.paint(name, color, 0.22),
        glass: stage.paint("tinted glass", 0x14191c, 0.08),
        rubber: stage.paint("rubber", 0x1c1c1d, 0.8),
        rim: stage.metal("aluminium", 0xc4c6c8, 0.32),
        lamp: stage.material(Material { roughness: 0.1, ..Material::diffuse("lamp glass", srgb(0xe8ecec)) }),
        tail: stage.paint("tail lamps", 0xb01a16, 0.15),
        plate: stage.paint("plates", 0xe8d9a0, 0.5),
    }
}

/// Signed distance to the body, approximately, metres.
fn body(p: Vec3) -> f32 {
    let outline = polygon_distance(vec2(p.z, p.y), &SIDE.map(Vec2::from)) - 0.06;
    // Half the width: rounded along the height, narrower towards the roof and towards both ends.
    let bulge = 0.05 * ((p.y - 0.62) / 0.4).powi(2).min(1.0);
    let tumblehome = 0.46 * (p.y - 0.88).max(0.0);
    let ends = 0.16 * (p.z.abs() - 1.2).max(0.0).powi(2);
    let sides = (p.x.abs() - (0.845 - bulge - tumblehome - ends)) * 0.88;
    let mut d = blend_max(outline, sides, 0.11);
    for z in AXLES {
        let arch = (vec2(p.z - z, p.y - WHEEL).length() - 0.365).max(0.57 - p.x.abs());
        d = blend_max(d, -arch, 0.02);
    }
    d
}

/// A sheet wrapped onto the body from the side `sign`: corners (z, y) in order around it.
fn on_side(sign: f32, corners: [(f32, f32); 4], cells: (usize, usize), offset: f32) -> Geometry {
    let [a, b, c, d] = corners.map(Vec2::from);
    let ray = |u: f32, v: f32| {
        let p = a.lerp(b, u).lerp(d.lerp(c, u), v);
        (vec3(sign * 1.1, p.y, p.x), vec3(-sign, 0.0, 0.0))
    };
    shrink_wrap(cells, offset, ray, body)
}

/// A sheet wrapped onto nose or tail: rows from (half width, y) to (half width, y), seen along −`way`·z.
fn on_end(way: f32, left: [(f32, f32); 2], right: [(f32, f32); 2], cells: (usize, usize), offset: f32) -> Geometry {
    let [[a, d], [b, c]] = [left.map(Vec2::from), right.map(Vec2::from)];
    let ray = |u: f32, v: f32| {
        let p = a.lerp(b, u).lerp(d.lerp(c, u), v);
        (vec3(p.x, p.y, way * 2.6), vec3(0.0, 0.0, -way))
    };
    shrink_wrap(cells, offset, ray, body)
}

/// The car on y = 0, nose towards +Z.
pub(super) fn car(finish: &Finish) -> Model {
    let shell = surface_net(vec3(-0.95, 0.1, -2.15), vec3(0.95, 1.5, 2.15), 0.046, body);
    let mut model = Model::of(finish.paint, shell);
    glass(&mut model, finish);
    trim(&mut model, finish);
    let wheel = wheel(finish);
    for (x, z) in AXLES.into_iter().flat_map(|z| [(TRACK, z), (-TRACK, z)]) {
        let turn = if x > 0.0 { -90.0f32 } else { 90.0 };
        let map = glam::Mat4::from_translation(vec3(x, WHEEL, z)) * glam::Mat4::from_rotation_z(turn.to_radians());
        model.append(&wheel, map);
    }
    model
}

fn glass(model: &mut Model, finish: &Finish) {
    for sign in [-1.0, 1.0] {
        let front = [(0.78, 0.955), (-0.33, 0.955), (-0.33, 1.3), (0.36, 1.3)];
        let rear = [(-0.4, 0.955), (-1.5, 0.975), (-1.2, 1.285), (-0.4, 1.3)];
        model.add(finish.glass, on_side(sign, front, (14, 6), 0.004));
        model.add(finish.glass, on_side(sign, rear, (14, 6), 0.004));
    }
    // Windscreen and rear window, looked at square on.
    let pane = |low: (f32, f32), high: (f32, f32), widths: (f32, f32), inward: Vec3| {
        let ray = move |u: f32, v: f32| {
            let (z, y) = (low.0 + (high.0 - low.0) * v, low.1 + (high.1 - low.1) * v);
            let half = widths.0 + (widths.1 - widths.0) * v;
            (vec3((2.0 * u - 1.0) * half, y, z) - inward * 0.5, inward)
        };
        shrink_wrap((16, 8), 0.004, ray, body)
    };
    let screen = vec3(0.0, -0.62, -0.78).normalize();
    model.add(finish.glass, pane((1.0, 0.93), (0.4, 1.34), (0.68, 0.56), screen));
    let back = vec3(0.0, -0.62, 0.78).normalize();
    model.add(finish.glass, pane((-1.84, 0.96), (-1.5, 1.24), (0.64, 0.55), back));
}

fn trim(model: &mut Model, finish: &Finish) {
    let mirrored = |x: f32, y0: f32, y1: f32| ([(-x, y0), (-x, y1)], [(x, y0), (x, y1)]);
    // Bumpers, grille, plates, lamps.
    for way in [1.0, -1.0] {
        let (left, right) = mirrored(0.74, 0.27, 0.43);
        model.add(finish.rubber, on_end(way, left, right, (20, 4), 0.022));
        let (left, right) = mirrored(0.26, 0.31, 0.41);
        model.add(finish.plate, on_end(way, left, right, (6, 2), 0.03));
    }
    let (left, right) = mirrored(0.4, 0.51, 0.63);
    model.add(finish.rubber, on_end(1.0, left, right, (10, 4), 0.006));
    for sign in [-1.0, 1.0] {
        let lamp = |x0: f32, x1: f32, y0: f32, y1: f32| {
            ([(sign * x0, y0), (sign * x0, y1)], [(sign * x1, y0), (sign * x1, y1)])
        };
        let (left, right) = lamp(0.44, 0.68, 0.5, 0.635);
        model.add(finish.lamp, on_end(1.0, left, right, (8, 5), 0.008));
        let (left, right) = lamp(0.46, 0.68, 0.56, 0.76);
        model.add(finish.tail, on_end(-1.0, left, right, (8, 6), 0.008));
        // Door seams, a strip along the side, handles, mirrors.
        for z in [0.84, -0.365] {
            let seam = [(z, 0.34), (z - 0.012, 0.34), (z - 0.012, 0.95), (z, 0.95)];
            model.add(finish.rubber, on_side(sign, seam, (1, 14), 0.002));
        }
        let strip = [(0.82, 0.53), (-0.84, 0.53), (-0.84, 0.58), (0.82, 0.58)];
        model.add(finish.rubber, on_side(sign, strip, (20, 2), 0.012));
        model.add(finish.rubber, bevel_box(0.03, 0.025, 0.15, 0.008).at(sign * 0.805, 0.855, -0.22));
        model.add(finish.rubber, bevel_box(0.15, 0.1, 0.07, 0.03).at(sign * 0.86, 0.99, 0.7));
    }
}

/// A wheel about Y, its outer side up.
fn wheel(finish: &Finish) -> Model {
    let tyre = [
        (0.2, -0.09),
        (0.275, -0.095),
        (0.3, -0.08),
        (WHEEL, -0.05),
        (WHEEL, 0.05),
        (0.3, 0.08),
        (0.275, 0.095),
        (0.2, 0.09),
        (0.2, -0.09),
    ];
    let mut model = Model::of(finish.rubber, lathe(&tyre.map(|(r, y)| vec2(r, y)), 40, 30.0));
    let rim = [
        (0.0, -0.05),
        (0.199, -0.05),
        (0.205, 0.088),
        (0.19, 0.092),
        (0.18, 0.07),
        (0.1, 0.035),
        (0.07, 0.06),
        (0.0, 0.065),
    ];
    let mut metal = lathe(&rim.map(|(r, y)| vec2(r, y)), 40, 30.0);
    for i in 0..5 {
        let spoke = bevel_box(0.13, 0.03, 0.045, 0.01).at(0.125, 0.062, 0.0).turned_y(72.0 * i as f32);
        metal.append(&spoke);
        metal.append(&cylinder(0.009, 0.012, 8).at(0.045, 0.062, 0.0).turned_y(72.0 * i as f32 + 36.0));
    }
    model.add(finish.rim, metal);
    model
}

//! What stands on the table and the sideboard, and the lamps above.

use super::super::kit::{
    Geometry, Model, Picture, Stage, bevel_box, circle, cuboid, curve, cylinder, lathe, profile, slab, sphere, srgb,
    sweep, torus, value_noise, vessel,
};
use super::Palette;
use glam::{Vec2, Vec3, vec2, vec3};

/// A carafe of clear glass, 0.27 m high, standing on y = 0.
pub(super) fn carafe() -> Geometry {
    let outside = [
        (0.0, 0.0),
        (0.05, 0.0),
        (0.062, 0.016),
        (0.067, 0.075),
        (0.053, 0.145),
        (0.034, 0.2),
        (0.031, 0.23),
        (0.041, 0.27),
    ];
    let inside = [
        (0.0385, 0.271),
        (0.0283, 0.23),
        (0.0311, 0.2),
        (0.0499, 0.145),
        (0.0637, 0.075),
        (0.058, 0.02),
        (0.045, 0.0115),
        (0.0, 0.0105),
    ];
    vessel(&outside, &inside, 2, 40)
}

/// A drinking glass with a thick base.
pub(super) fn tumbler() -> Geometry {
    let outside = [(0.0, 0.0), (0.027, 0.0), (0.031, 0.005), (0.034, 0.05), (0.036, 0.095)];
    let inside = [(0.0342, 0.0955), (0.0322, 0.05), (0.0292, 0.017), (0.022, 0.0125), (0.0, 0.012)];
    vessel(&outside, &inside, 2, 26)
}

/// A round tray of polished steel.
pub(super) fn tray(palette: &Palette) -> Model {
    let points =
        [(0.0, 0.0), (0.165, 0.0), (0.175, 0.004), (0.185, 0.022), (0.182, 0.024), (0.17, 0.0105), (0.0, 0.0105)];
    Model::of(palette.chrome, lathe(&points.map(|(r, y)| vec2(r, y)), 56, 30.0))
}

/// A telephone with three feet for the middle of a table.
pub(super) fn telephone(palette: &Palette) -> Model {
    let mut body = Geometry::default();
    for i in 0..3 {
        let arm = sphere(1.0, 20, 10).displaced(|p| {
            let reach = 0.5 + 0.5 * p.x;
            vec3(0.075 + 0.075 * p.x, 0.004 + (p.y + 1.0) * (0.011 + 0.011 * (1.0 - reach)), 0.042 * p.z)
        });
        body.append(&arm.turned_y(120.0 * i as f32));
    }
    let mut model = Model::of(palette.dark, body);
    let mut keys = Geometry::default();
    for i in 0..12 {
        let (x, z) = ((i % 3) as f32 - 1.0, (i / 3) as f32 - 1.5);
        keys.append(&bevel_box(0.011, 0.006, 0.008, 0.002).at(0.016 * x, 0.047, 0.013 * z));
    }
    model.add(palette.white, keys);
    model
}

/// Some sheets of paper and a pencil, written from +Z.
pub(super) fn pad(palette: &Palette) -> Model {
    let mut sheets = cuboid(0.21, 0.006, 0.297).at(0.0, 0.0032, 0.0);
    sheets.append(&cuboid(0.21, 0.0006, 0.297).turned_y(3.0).at(0.004, 0.0066, 0.003));
    let mut model = Model::of(palette.paper, sheets);
    model.add(palette.brass, pencil().turned_y(24.0).at(0.07, 0.0115, 0.0));
    model
}

fn pencil() -> Geometry {
    let points = [(0.0, 0.0), (0.004, 0.0), (0.004, 0.15), (0.0015, 0.166), (0.0, 0.168)];
    lathe(&points.map(|(r, y)| vec2(r, y)), 10, 40.0).turned_x(-90.0).at(0.0, 0.0, 0.08)
}

/// A closed notebook of a colour with its pencil.
pub(super) fn notebook(palette: &Palette, color: Vec3) -> Model {
    let mut model = Model::of(palette.cover, bevel_box(0.155, 0.014, 0.22, 0.003).at(0.0, 0.0075, 0.0).colored(color));
    model.add(palette.paper, slab([-0.07, 0.002, -0.1105], [0.0785, 0.012, 0.1105]));
    model.add(palette.brass, pencil().turned_y(-12.0).at(0.105, 0.0045, 0.0));
    model
}

/// An open portable computer, seen from +Z.
pub(super) fn laptop(stage: &mut Stage, palette: &Palette) -> Model {
    let shown = Picture::new(160, 100, |uv| {
        let row = (uv.y * 18.0).floor();
        let ink =
            (uv.y * 18.0).fract() > 0.5 && uv.x > 0.3 && uv.x < 0.36 + 0.6 * value_noise(vec2(row * 3.1, 0.5), 0, 9);
        let side = uv.x < 0.24;
        let color = match (uv.y < 0.08, side, ink) {
            (true, ..) => srgb(0x37474f),
            (_, true, _) => srgb(0x90a4ae),
            (.., true) => srgb(0x455a64),
            _ => srgb(0xcfd8dc),
        };
        (color, 0.0)
    });
    let shown = stage.pictured("laptop screen", &shown, vec2(0.29, 0.18), 0.3);
    stage.scene.materials[shown as usize].unlit = true;
    let mut body = bevel_box(0.31, 0.014, 0.215, 0.004).at(0.0, 0.008, 0.0);
    let lid = |g: Geometry| g.turned_x(-18.0).at(0.0, 0.014, -0.105);
    body.append(&lid(bevel_box(0.31, 0.205, 0.007, 0.003).at(0.0, 0.1025, -0.0035)));
    let mut model = Model::of(palette.dark, body);
    let mut face = Geometry::default();
    let corner = |x: f32, y: f32| vec3(0.145 * x, 0.107 + 0.09 * y, 0.0006);
    face.flat_quad([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]);
    model.add(shown, lid(face));
    let mut keys = Geometry::default();
    for row in 0..5 {
        for column in 0..13 {
            let x = -0.126 + 0.021 * column as f32;
            keys.append(&cuboid(0.0175, 0.003, 0.0155).at(x, 0.0165, -0.075 + 0.019 * row as f32));
        }
    }
    keys.append(&cuboid(0.09, 0.001, 0.055).at(0.0, 0.0154, 0.065));
    model.add(palette.white, keys);
    model
}

/// A ball of a material on a small ring of another.
pub(super) fn ball(material: u32, foot: u32, radius: f32, (segments, rings): (usize, usize)) -> Model {
    let mut model = Model::of(material, sphere(radius, segments, rings).at(0.0, radius + 0.006, 0.0));
    model.add(foot, torus(0.42 * radius, 0.012, 40, 8).at(0.0, 0.012, 0.0));
    model
}

/// A coffee pot of polished steel with a black handle.
pub(super) fn pot(palette: &Palette) -> Model {
    let body = profile(&[(0.0, 0.0), (0.055, 0.0), (0.064, 0.015), (0.07, 0.08), (0.058, 0.16), (0.045, 0.2)], 4);
    let mut points = body;
    points.extend(profile(&[(0.047, 0.203), (0.04, 0.216), (0.015, 0.226), (0.013, 0.245), (0.0, 0.249)], 3));
    let mut model = Model::of(palette.chrome, lathe(&points, 44, 40.0));
    let spout =
        curve(&[vec3(0.055, 0.09, 0.0), vec3(0.09, 0.11, 0.0), vec3(0.108, 0.17, 0.0), vec3(0.128, 0.19, 0.0)], 4);
    let last = spout.len() - 1;
    model.add(palette.chrome, sweep(&spout, &circle(0.015, 12), true, |k| 1.0 - 0.5 * k as f32 / last as f32));
    let grip =
        curve(&[vec3(-0.05, 0.17, 0.0), vec3(-0.1, 0.175, 0.0), vec3(-0.108, 0.11, 0.0), vec3(-0.066, 0.05, 0.0)], 4);
    model.add(palette.dark, sweep(&grip, &circle(0.0085, 10), true, |_| 1.0));
    model
}

/// A bar on two posts along X, standing off z = 0.
pub(super) fn handle() -> Geometry {
    let way = [
        vec3(-0.07, 0.0, 0.0),
        vec3(-0.07, 0.0, 0.022),
        vec3(-0.06, 0.0, 0.03),
        vec3(0.06, 0.0, 0.03),
        vec3(0.07, 0.0, 0.022),
        vec3(0.07, 0.0, 0.0),
    ];
    sweep(&way, &circle(0.0055, 8), true, |_| 1.0)
}

/// Four mitreless bars around a rectangle of `size` around the origin, `width` wide and `depth` deep, their backs on z = 0.
pub(super) fn frame(size: Vec2, width: f32, depth: f32) -> Geometry {
    let mut out = Geometry::default();
    for side in [-0.5f32, 0.5] {
        let along = bevel_box(size.x + 2.0 * width, width, depth, 0.008);
        out.append(&along.at(0.0, side * (size.y + width), 0.5 * depth));
        out.append(&bevel_box(width, size.y, depth, 0.008).at(side * (size.x + width), 0.0, 0.5 * depth));
    }
    out
}

/// A pendant lamp under y = 0: the middle of its globe `drop` below, a dish above the globe. Nothing that light meets is nearer to the
/// middle than 14 cm, for there it would be as bright as a lamp itself.
pub(super) fn lamp(palette: &Palette, drop: f32) -> Model {
    let mut brass = cylinder(0.055, 0.03, 24).at(0.0, -0.03, 0.0);
    brass.append(&cylinder(0.006, drop - 0.21, 10).at(0.0, -(drop - 0.19), 0.0));
    brass.append(&cylinder(0.024, 0.07, 20).at(0.0, -drop + 0.145, 0.0));
    let mut model = Model::of(palette.brass, brass);
    let rise = |r: f32| -drop + 0.205 - 0.1 * (r / 0.25f32).powf(1.6);
    let radii: Vec<f32> = (0..=10).map(|i| 0.024 + 0.226 * i as f32 / 10.0).collect();
    // The profile's right is outside: outwards along the bottom it faces down, inwards along the top up.
    let under: Vec<Vec2> = radii.iter().map(|&r| vec2(r, rise(r) - 0.004)).collect();
    let over: Vec<Vec2> = radii.iter().rev().map(|&r| vec2(r, rise(r))).collect();
    model.add(palette.brass, lathe(&under, 48, 40.0));
    model.add(palette.brass, lathe(&over, 48, 40.0));
    let rim = [vec2(0.25, rise(0.25) - 0.004), vec2(0.25, rise(0.25))];
    model.add(palette.brass, lathe(&rim, 48, 40.0));
    // The neck shines as the globe does, and lets light pass as it does.
    model.add(palette.bulb, sphere(0.062, 32, 16).at(0.0, -drop, 0.0));
    model.add(palette.bulb, cylinder(0.019, 0.1, 20).at(0.0, -drop + 0.05, 0.0));
    model
}

/// A wall clock facing +Z.
pub(super) fn clock(palette: &Palette) -> Model {
    let mut model = Model::of(palette.paper, cylinder(0.16, 0.02, 48).turned_x(90.0));
    let mut dark = Geometry::default();
    for hour in 0..12 {
        dark.append(&cuboid(0.008, 0.024, 0.003).at(0.0, 0.128, 0.0215).turned_z(30.0 * hour as f32));
    }
    dark.append(&cuboid(0.01, 0.08, 0.003).at(0.0, 0.033, 0.0225).turned_z(-40.0));
    dark.append(&cuboid(0.007, 0.118, 0.003).at(0.0, 0.048, 0.0245).turned_z(62.0));
    model.add(palette.dark, dark);
    model.add(palette.brass, torus(0.162, 0.013, 48, 8).turned_x(90.0).at(0.0, 0.0, 0.016));
    model
}

//! What lies on desks and hangs on walls.

use super::super::kit::{
    Geometry, Model, bevel_box, circle, cuboid, cylinder, lathe, loop_sweep, slab, sphere, sweep, torus,
};
use super::Palette;
use glam::{Vec3, vec2, vec3};

/// A flat screen on its foot, standing on y = 0, seen from +Z.
pub(super) fn monitor(palette: &Palette) -> Model {
    let mut body = bevel_box(0.56, 0.345, 0.022, 0.006).at(0.0, 0.33, 0.0);
    body.append(&bevel_box(0.3, 0.2, 0.03, 0.01).at(0.0, 0.32, -0.022));
    body.append(&bevel_box(0.05, 0.24, 0.018, 0.004).at(0.0, 0.14, -0.045));
    body.append(&bevel_box(0.24, 0.014, 0.18, 0.005).at(0.0, 0.007, -0.02));
    let mut model = Model::of(palette.dark, body);
    let mut screen = Geometry::default();
    let corner = |x: f32, y: f32| vec3(x * 0.268, 0.332 + y * 0.158, 0.0118);
    screen.flat_quad([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]);
    model.add(palette.screen, screen);
    model
}

/// A keyboard with its keys, and a mouse to its right.
pub(super) fn keyboard(palette: &Palette) -> Model {
    let mut model = Model::of(palette.dark, bevel_box(0.44, 0.016, 0.14, 0.004).at(0.0, 0.01, 0.0));
    let mut keys = Geometry::default();
    for row in 0..5 {
        let z = -0.05 + 0.024 * row as f32;
        if row == 4 {
            keys.append(&cuboid(0.11, 0.008, 0.018).at(-0.03, 0.02, z));
            for x in [-0.2, -0.17, -0.115, 0.06, 0.09, 0.2] {
                keys.append(&cuboid(0.02, 0.008, 0.018).at(x, 0.02, z));
            }
            continue;
        }
        for column in 0..12 {
            let shift = 0.005 * row as f32;
            keys.append(&cuboid(0.028, 0.008, 0.019).at(-0.2 + 0.034 * column as f32 + shift, 0.02, z));
        }
    }
    model.add(palette.grey, keys);
    let mouse = sphere(1.0, 12, 6).displaced(|p| vec3(p.x * 0.03, p.y.max(-0.25) * 0.026 + 0.0065, p.z * 0.052));
    model.add(palette.dark, mouse.at(0.31, 0.0, 0.01));
    model
}

/// A mug with its handle towards +X.
pub(super) fn mug() -> Geometry {
    let profile = [
        (0.0, 0.004),
        (0.034, 0.0),
        (0.038, 0.003),
        (0.04, 0.09),
        (0.0385, 0.092),
        (0.037, 0.09),
        (0.035, 0.008),
        (0.0, 0.006),
    ];
    let mut mug = lathe(&profile.map(|(r, y)| vec2(r, y)), 16, 40.0);
    let path: Vec<Vec3> = (0..=8)
        .map(|i| {
            let angle = (-78.0 + 156.0 * i as f32 / 8.0f32).to_radians();
            vec3(0.036 + 0.026 * angle.cos(), 0.047 + 0.026 * angle.sin(), 0.0)
        })
        .collect();
    mug.append(&sweep(&path, &circle(0.0045, 6), true, |_| 1.0));
    mug
}

/// A desk lamp whose head hangs over +Z.
pub(super) fn desk_lamp(palette: &Palette) -> Model {
    let base = [(0.0, 0.0), (0.085, 0.0), (0.085, 0.012), (0.02, 0.022), (0.0, 0.024)];
    let mut frame = lathe(&base.map(|(r, y)| vec2(r, y)), 20, 40.0);
    let arm = circle(0.007, 6);
    let elbow = vec3(0.0, 0.3, -0.14);
    let head = vec3(0.0, 0.46, 0.1);
    frame.append(&sweep(&[vec3(0.0, 0.02, 0.0), elbow], &arm, true, |_| 1.0));
    frame.append(&sweep(&[elbow, head], &arm, true, |_| 1.0));
    frame.append(&sphere(0.014, 10, 5).at(elbow.x, elbow.y, elbow.z));
    frame.append(&sphere(0.014, 10, 5).at(head.x, head.y, head.z));
    let mut model = Model::of(palette.steel, frame);
    let shade = [
        (0.0, 0.0),
        (0.022, 0.0),
        (0.03, -0.03),
        (0.075, -0.12),
        (0.073, -0.121),
        (0.028, -0.032),
        (0.02, -0.004),
        (0.0, -0.004),
    ];
    // The profile runs from the top down the outside, so that it is turned over to face outward.
    let mut points = shade.map(|(r, y)| vec2(r, y));
    points.reverse();
    model.add(palette.accent, lathe(&points, 24, 40.0).turned_x(-18.0).at(head.x, head.y, head.z));
    model.add(palette.bulb, sphere(0.02, 12, 6).turned_x(-18.0).at(head.x, head.y - 0.06, head.z + 0.02));
    model
}

/// A ceiling lamp: a flat drum with a glowing pane, hanging `drop` below y = 0.
pub(super) fn pendant(palette: &Palette, drop: f32) -> Model {
    let drum = [(0.0, 0.0), (0.3, 0.0), (0.31, -0.1), (0.3, -0.1), (0.29, -0.02), (0.0, -0.02)];
    let mut points = drum.map(|(r, y)| vec2(r, y - drop));
    points.reverse();
    let mut model = Model::of(palette.accent, lathe(&points, 40, 30.0));
    let mut rods = cylinder(0.05, 0.03, 16).at(0.0, -0.03, 0.0);
    rods.append(&cylinder(0.006, drop, 8).at(0.0, -drop, 0.0));
    model.add(palette.steel, rods);
    model.add(palette.bulb, cylinder(0.27, 0.012, 40).at(0.0, -drop - 0.06, 0.0));
    model
}

/// Venetian blinds `width` wide that hang `height` down from y = 0, slats turned by `tilt` degrees.
pub(super) fn blinds(palette: &Palette, width: f32, height: f32, tilt: f32) -> Model {
    let mut model = Model::of(palette.blind, cuboid(width, 0.04, 0.05).at(0.0, -0.02, 0.0));
    let pitch = 0.052;
    let count = ((height - 0.06) / pitch) as usize;
    for i in 0..count {
        let slat = cuboid(width, 0.0016, 0.05).turned_x(tilt).at(0.0, -0.07 - pitch * i as f32, 0.0);
        model.add(palette.blind, slat);
    }
    for x in [-0.35, 0.35] {
        let low = -0.07 - pitch * (count - 1) as f32;
        model.add(palette.blind, slab([x * width - 0.003, low, -0.001], [x * width + 0.003, -0.04, 0.001]));
    }
    model
}

/// A radiator of `width`, standing on y = 0, its back to −Z.
pub(super) fn radiator(palette: &Palette, width: f32) -> Model {
    let mut model = Model::default();
    let count = (width / 0.08) as usize;
    for i in 0..count {
        let x = (i as f32 + 0.5) / count as f32 * width - width * 0.5;
        model.add(palette.white, cuboid(0.066, 0.55, 0.05).at(x, 0.42, 0.0));
    }
    let mut pipes = Geometry::default();
    for y in [0.2, 0.64] {
        pipes.append(&slab([-width * 0.5, y, -0.012], [width * 0.5, y + 0.03, 0.012]));
    }
    for x in [-0.42, 0.42] {
        pipes.append(&cylinder(0.012, 0.2, 8).at(x * width, 0.0, 0.0));
    }
    model.add(palette.white, pipes);
    model
}

/// A wall clock facing +Z.
pub(super) fn clock(palette: &Palette) -> Model {
    let mut model = Model::of(palette.white, cylinder(0.15, 0.02, 32).turned_x(90.0));
    let mut dark = torus(0.15, 0.012, 32, 6).turned_x(90.0).at(0.0, 0.0, 0.015);
    for hour in 0..12 {
        dark.append(&cuboid(0.008, 0.022, 0.003).at(0.0, 0.12, 0.0215).turned_z(30.0 * hour as f32));
    }
    dark.append(&cuboid(0.01, 0.075, 0.003).at(0.0, 0.03, 0.0225).turned_z(55.0));
    dark.append(&cuboid(0.007, 0.11, 0.003).at(0.0, 0.045, 0.0245).turned_z(-62.0));
    model.add(palette.dark, dark);
    model
}

/// A waste-paper basket: a tapering tub of steel with a rim.
pub(super) fn basket(palette: &Palette) -> Model {
    let tub = [(0.0, 0.0), (0.11, 0.0), (0.145, 0.3), (0.141, 0.3), (0.106, 0.006), (0.0, 0.006)];
    let mut body = lathe(&tub.map(|(r, y)| vec2(r, y)), 24, 30.0);
    let rim: Vec<Vec3> = circle(0.144, 24).iter().map(|p| vec3(p.x, 0.3, -p.y)).collect();
    body.append(&loop_sweep(&rim, &circle(0.006, 5), true));
    Model::of(palette.dark, body)
}

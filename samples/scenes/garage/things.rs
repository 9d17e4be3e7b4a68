//! Shelves, bench, tools, tyres and the door.

use super::super::kit::{
    Geometry, Model, Random, bevel_box, circle, cuboid, cylinder, extrude, frustum, lathe, slab, srgb, sweep, torus,
};
use super::Palette;
use glam::{Mat4, Vec2, Vec3, vec2, vec3};

/// A rack of angle steel, `width` × 0.45 × 1.9 m, standing on y = 0 with its back to −Z, with things on it.
pub(super) fn rack(palette: &Palette, width: f32, random: &mut Random) -> Model {
    let (depth, height) = (0.45, 1.9);
    let mut frame = Geometry::default();
    for (x, z) in [(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5f32)] {
        frame.append(&cuboid(0.035, height, 0.035).at(x * width, height * 0.5, z * depth));
    }
    let mut model = Model::default();
    for level in 0..4 {
        let y = 0.15 + 0.55 * level as f32;
        frame.append(&bevel_box(width - 0.02, 0.03, depth, 0.004).at(0.0, y, 0.0));
        fill_shelf(&mut model, palette, (width, y + 0.015), random);
    }
    model.add(palette.steel, frame);
    model
}

/// Boxes, tins, cans and canisters along a shelf.
fn fill_shelf(model: &mut Model, palette: &Palette, (width, y): (f32, f32), random: &mut Random) {
    let colors = [0xb8402f, 0x2f6aa8, 0xe0a52e, 0x4b8b4e, 0xd8d4c8, 0x6a4a8c, 0x394049, 0xd0652a];
    let mut x = -width * 0.5 + 0.06;
    while x < width * 0.5 - 0.2 {
        let color = srgb(colors[random.index(colors.len())]);
        let z = random.range(-0.06, 0.05);
        match random.index(5) {
            0 | 1 => {
                let (w, h, d) = (random.range(0.22, 0.38), random.range(0.16, 0.36), random.range(0.25, 0.36));
                if x + w > width * 0.5 - 0.03 {
                    return;
                }
                let turn = random.range(-7.0, 7.0);
                let flaps = bevel_box(w, h, d, 0.004).turned_y(turn).at(x + w * 0.5, y + h * 0.5, z);
                model.add(palette.cardboard, flaps);
                let tape = cuboid(0.05, h + 0.001, d + 0.002).turned_y(turn).at(x + w * 0.5, y + h * 0.5, z);
                model.add(palette.colored, tape.colored(srgb(0xc9b17e)));
                x += w + 0.03;
            }
            2 | 3 => {
                let (r, h) = (random.range(0.055, 0.1), random.range(0.12, 0.24));
                let tin = lathe(
                    &[(0.0, 0.0), (r, 0.0), (r, h), (r * 0.96, h), (r * 0.92, h - 0.008), (0.0, h - 0.008)]
                        .map(|(r, y)| vec2(r, y)),
                    24,
                    30.0,
                );
                model.add(palette.steel, tin.at(x + r, y, z));
                let label = [(r + 0.001, h * 0.2), (r + 0.001, h * 0.8)].map(|(r, y)| vec2(r, y));
                model.add(palette.colored, lathe(&label, 24, 30.0).at(x + r, y, z).colored(color));
                x += 2.0 * r + random.range(0.02, 0.06);
            }
            _ => {
                let canister = bevel_box(0.16, 0.24, 0.11, 0.02).at(x + 0.08, y + 0.12, z);
                model.add(palette.colored, canister.colored(color));
                let cap = cylinder(0.022, 0.03, 16).at(x + 0.04, y + 0.24, z);
                model.add(palette.rubber, cap);
                let bar = [
                    vec3(x + 0.07, y + 0.235, z),
                    vec3(x + 0.08, y + 0.28, z),
                    vec3(x + 0.14, y + 0.28, z),
                    vec3(x + 0.15, y + 0.235, z),
                ];
                model.add(palette.colored, sweep(&bar, &circle(0.009, 6), true, |_| 1.0).colored(color));
                x += 0.2;
            }
        }
    }
}

/// A bench of `width` m with drawers, a vice and a board of tools above it; its back to −Z.
pub(super) fn bench(palette: &Palette, width: f32) -> Model {
    let height = 0.9;
    let mut wood = bevel_box(width, 0.06, 0.65, 0.008).at(0.0, height - 0.03, 0.0);
    for (x, z) in [(-0.46, -0.26), (0.46, -0.26), (-0.46, 0.26), (0.46, 0.26)] {
        wood.append(&cuboid(0.08, height - 0.06, 0.08).at(x * width, (height - 0.06) * 0.5, z));
    }
    wood.append(&cuboid(width * 0.9, 0.03, 0.55).at(0.0, 0.25, 0.0));
    wood.append(&cuboid(width * 0.84, 0.12, 0.03).at(0.0, height - 0.12, 0.26));
    let mut model = Model::of(palette.wood, wood);
    let mut steel = Geometry::default();
    for i in 0..3 {
        let x = (i as f32 - 1.0) * width * 0.28;
        steel.append(&bevel_box(0.14, 0.02, 0.025, 0.006).at(x, height - 0.12, 0.285));
    }
    // A vice on the front edge.
    let (x, z) = (-width * 0.3, 0.2);
    let mut vice = bevel_box(0.14, 0.05, 0.2, 0.01).at(x, height + 0.025, z);
    vice.append(&bevel_box(0.13, 0.11, 0.05, 0.01).at(x, height + 0.1, z - 0.02));
    vice.append(&bevel_box(0.13, 0.1, 0.04, 0.01).at(x, height + 0.1, z + 0.09));
    model.add(palette.enamel, vice);
    steel.append(&cylinder(0.012, 0.22, 12).turned_x(90.0).at(x, height + 0.06, z + 0.02));
    steel.append(&cylinder(0.007, 0.2, 10).turned_z(90.0).at(x + 0.1, height + 0.06, z + 0.235));
    model.add(palette.steel, steel);
    model.append(&toolbox(palette), Mat4::from_translation(vec3(width * 0.3, height, -0.05)));
    model
}

/// A steel box with a handle.
fn toolbox(palette: &Palette) -> Model {
    let mut model = Model::of(palette.enamel, bevel_box(0.46, 0.16, 0.2, 0.012).at(0.0, 0.08, 0.0));
    model.add(palette.enamel, bevel_box(0.44, 0.05, 0.18, 0.02).at(0.0, 0.18, 0.0));
    let grip = [vec3(-0.1, 0.2, 0.0), vec3(-0.08, 0.25, 0.0), vec3(0.08, 0.25, 0.0), vec3(0.1, 0.2, 0.0)];
    model.add(palette.rubber, sweep(&grip, &circle(0.01, 8), true, |_| 1.0));
    for x in [-0.15, 0.15] {
        model.add(palette.steel, bevel_box(0.04, 0.05, 0.012, 0.004).at(x, 0.14, 0.104));
    }
    model
}

/// A board of `width` × 0.9 m in XY at z = 0 with tools on it, in front of a wall.
pub(super) fn tool_board(palette: &Palette, width: f32) -> Model {
    let mut model = Model::of(palette.board, bevel_box(width, 0.9, 0.018, 0.003).at(0.0, 0.45, 0.009));
    let front = 0.03;
    let flat =
        |points: &[(f32, f32)], depth: f32| extrude(&points.iter().map(|p| Vec2::from(*p)).collect::<Vec<_>>(), depth);
    let mut steel = Geometry::default();
    let mut grips = Geometry::default();
    // Spanners of falling size.
    for i in 0..6 {
        let (x, size) = (-width * 0.44 + 0.085 * i as f32, 1.0 - 0.11 * i as f32);
        let jaw = [
            (-0.008, -0.1),
            (0.008, -0.1),
            (0.008, 0.09),
            (0.026, 0.11),
            (0.026, 0.14),
            (0.01, 0.15),
            (0.01, 0.12),
            (-0.01, 0.12),
            (-0.01, 0.15),
            (-0.026, 0.14),
            (-0.026, 0.11),
            (-0.008, 0.09),
        ];
        let spanner = flat(&jaw, 0.008).transformed(Mat4::from_scale(vec3(size, size, 1.0)));
        steel.append(&spanner.at(x, 0.62, front));
        steel.append(&torus(0.02 * size, 0.006, 20, 6).turned_x(90.0).at(x, 0.62 - 0.115 * size, front + 0.004));
    }
    // Two hammers.
    for (x, tilt) in [(0.0, 0.0), (0.16, 4.0)] {
        let head = bevel_box(0.11, 0.034, 0.034, 0.006).at(0.0, 0.15, 0.02);
        steel.append(&head.turned_z(tilt).at(x + 0.03, 0.55, front));
        let handle =
            sweep(&[vec3(0.0, -0.16, 0.02), vec3(0.0, 0.17, 0.02)], &circle(0.013, 10), true, |i| [1.1, 0.8][i]);
        grips.append(&handle.turned_z(tilt).at(x + 0.03, 0.55, front));
    }
    // A saw: blade and grip.
    let blade = [(0.0, 0.0), (0.46, 0.05), (0.46, 0.09), (0.0, 0.15)];
    steel.append(&flat(&blade, 0.003).at(width * 0.5 - 0.55, 0.14, front));
    grips.append(&bevel_box(0.1, 0.15, 0.025, 0.01).turned_z(14.0).at(width * 0.5 - 0.585, 0.21, front + 0.002));
    model.add(palette.wood, grips);
    // Screwdrivers.
    for i in 0..7 {
        let x = -width * 0.42 + 0.075 * i as f32;
        let color = srgb([0xc8372b, 0xe0a52e, 0x2f6aa8][i % 3]);
        let grip = frustum(0.016, 0.012, 0.1, 10).at(x, 0.3, front + 0.01);
        model.add(palette.colored, grip.colored(color));
        steel.append(&cylinder(0.0035, 0.14, 8).at(x, 0.165, front + 0.01));
    }
    // A square and pliers.
    steel.append(&flat(&[(0.0, 0.0), (0.3, 0.0), (0.3, 0.035), (0.035, 0.035), (0.035, 0.2), (0.0, 0.2)], 0.004).at(
        width * 0.5 - 0.42,
        0.55,
        front,
    ));
    for tilt in [-9.0, 9.0] {
        let arm = bevel_box(0.016, 0.13, 0.014, 0.004).at(0.0, -0.07, 0.008).turned_z(tilt);
        model.add(palette.colored, arm.at(0.36, 0.68, front).colored(srgb(0xc8372b)));
        steel.append(&bevel_box(0.014, 0.06, 0.014, 0.004).at(0.0, 0.03, 0.008).turned_z(tilt).at(0.36, 0.68, front));
    }
    model.add(palette.steel, steel);
    model
}

/// A tyre lying on y = 0.
pub(super) fn tyre(palette: &Palette) -> Model {
    let profile = [
        (0.2, 0.02),
        (0.26, 0.0),
        (0.29, 0.01),
        (0.31, 0.04),
        (0.31, 0.15),
        (0.29, 0.18),
        (0.26, 0.19),
        (0.2, 0.17),
        (0.2, 0.02),
    ];
    Model::of(palette.rubber, lathe(&profile.map(|(r, y)| vec2(r, y)), 44, 40.0))
}

/// An oil drum with two ribs.
pub(super) fn drum() -> Geometry {
    let profile = [
        (0.0, 0.0),
        (0.29, 0.0),
        (0.295, 0.02),
        (0.285, 0.03),
        (0.285, 0.28),
        (0.298, 0.3),
        (0.285, 0.32),
        (0.285, 0.57),
        (0.298, 0.59),
        (0.285, 0.61),
        (0.285, 0.86),
        (0.295, 0.87),
        (0.295, 0.88),
        (0.28, 0.875),
        (0.0, 0.87),
    ];
    lathe(&profile.map(|(r, y)| vec2(r, y)), 44, 30.0)
}

/// A ladder of `rungs` leaning towards −Z, standing on y = 0.
pub(super) fn ladder(palette: &Palette, rungs: usize) -> Model {
    let length = 0.28 * (rungs as f32 + 1.0);
    let mut out = Geometry::default();
    for x in [-0.2, 0.2] {
        out.append(&bevel_box(0.03, length, 0.065, 0.006).at(x, length * 0.5, 0.0));
    }
    for i in 1..=rungs {
        out.append(&cylinder(0.014, 0.38, 10).turned_z(90.0).at(0.19, 0.28 * i as f32, 0.0));
    }
    Model::of(palette.aluminium, out.turned_x(-11.0))
}

/// The sectional door pushed up: panels along tracks under the ceiling at `height`, `width` wide, from z = 0 to −Z.
pub(super) fn door(palette: &Palette, width: f32, height: f32) -> Model {
    let mut panels = Geometry::default();
    for i in 0..4 {
        let z = -0.35 - 0.54 * i as f32;
        panels.append(&bevel_box(width, 0.04, 0.52, 0.01).at(0.0, height + 0.28, z));
        for k in 0..4 {
            let x = (k as f32 - 1.5) * width * 0.24;
            panels.append(&bevel_box(width * 0.2, 0.012, 0.36, 0.004).at(x, height + 0.256, z));
        }
    }
    let mut model = Model::of(palette.white, panels);
    let mut rails = Geometry::default();
    let bar = [vec2(-0.02, -0.02), vec2(0.02, -0.02), vec2(0.02, 0.02), vec2(-0.02, 0.02)];
    for x in [-0.5f32, 0.5] {
        let x = x * (width + 0.08);
        let mut path = vec![vec3(x, 0.0, -0.06), vec3(x, height, -0.06)];
        path.extend((1..=6).map(|i| {
            let angle = i as f32 / 6.0 * std::f32::consts::FRAC_PI_2;
            vec3(x, height + 0.28 * angle.sin(), -0.06 - 0.28 * (1.0 - angle.cos()))
        }));
        path.push(vec3(x, height + 0.28, -2.5));
        rails.append(&sweep(&path, &bar, false, |_| 1.0));
    }
    model.add(palette.steel, rails);
    model
}

/// A lamp of two tubes under a white tray, hanging from y = 0.
pub(super) fn tube_lamp(palette: &Palette) -> Model {
    let mut model = Model::of(palette.white, bevel_box(1.3, 0.05, 0.16, 0.01).at(0.0, -0.3, 0.0));
    for x in [-0.5, 0.5] {
        model.add(palette.steel, slab([x - 0.004, -0.28, -0.004], [x + 0.004, 0.0, 0.004]));
    }
    for z in [-0.04, 0.04] {
        let tube = cylinder(0.015, 1.2, 12).turned_z(90.0).at(0.6, -0.342, z);
        model.add(palette.tube, tube);
    }
    model
}

/// A clamp lamp: hood towards −Y, its mouth at the origin.
pub(super) fn hood(palette: &Palette) -> Model {
    let profile = [
        (0.1, 0.0),
        (0.103, 0.0),
        (0.05, 0.1),
        (0.03, 0.16),
        (0.0, 0.165),
        (0.0, 0.16),
        (0.028, 0.155),
        (0.046, 0.1),
        (0.1, 0.0),
    ];
    let mut model = Model::of(palette.enamel, lathe(&profile.map(|(r, y)| vec2(r, y)), 32, 40.0));
    model.add(palette.tube, super::super::kit::sphere(0.035, 20, 10).at(0.0, 0.06, 0.0));
    let arm = [vec3(0.0, 0.16, 0.0), vec3(0.0, 0.3, -0.05), vec3(0.0, 0.32, -0.25)];
    model.add(palette.steel, sweep(&arm, &circle(0.008, 8), true, |_| 1.0));
    model
}

/// A hedge: a box of `size` with a lumpy skin, standing on y = 0.
pub(super) fn hedge(size: Vec3, seed: u32) -> Geometry {
    use super::super::kit::{surface_net, value_noise};
    let half = size * 0.5;
    let lumps = move |p: Vec3| {
        let n = value_noise(vec2(p.x * 6.0, p.y * 6.0 + p.z * 3.1), 0, seed)
            + value_noise(vec2(p.z * 6.0, p.y * 6.0), 0, seed + 1);
        let fine = value_noise(vec2(p.x * 12.0 + p.z * 5.0, p.y * 12.0), 0, seed + 2);
        let q = (p - Vec3::Y * half.y).abs() - (half - Vec3::splat(0.15));
        q.max(Vec3::ZERO).length() + q.max_element().min(0.0) - 0.15 + 0.08 * n + 0.035 * fine - 0.1
    };
    let margin = Vec3::splat(0.15);
    surface_net(vec3(-half.x, -0.1, -half.z) - margin, vec3(half.x, size.y, half.z) + margin, 0.09, lumps)
        // The field is too rough for its own gradients.
        .displaced(|p| p)
}

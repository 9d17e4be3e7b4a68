//! Barrels, crates, a covered wagon, rails, lanterns, poles and a wind wheel.

use super::super::kit::{
    Geometry, Model, Random, bevel_box, circle, cuboid, cylinder, frustum, lathe, loop_sweep, sphere, srgb, sweep,
};
use super::Palette;
use glam::{Mat4, Vec2, Vec3, vec2, vec3};

/// A square bar's profile of half width `h`.
fn square(h: f32) -> [Vec2; 4] {
    [vec2(-h, -h), vec2(h, -h), vec2(h, h), vec2(-h, h)]
}

/// A barrel standing on y = 0.
pub(super) fn barrel(palette: &Palette) -> Model {
    let profile = [
        (0.0, 0.03),
        (0.24, 0.03),
        (0.25, 0.0),
        (0.27, 0.0),
        (0.315, 0.2),
        (0.33, 0.43),
        (0.315, 0.66),
        (0.27, 0.86),
        (0.25, 0.86),
        (0.24, 0.82),
        (0.0, 0.82),
    ];
    let mut model = Model::of(palette.wood, lathe(&profile.map(|(r, y)| vec2(r, y)), 22, 28.0).colored(srgb(0x96703f)));
    let mut hoops = Geometry::default();
    for (y, r) in [(0.09, 0.296), (0.26, 0.325), (0.6, 0.325), (0.77, 0.296)] {
        let ring: Vec<Vec3> = circle(r, 22).iter().map(|p| vec3(p.x, y, -p.y)).collect();
        hoops.append(&loop_sweep(
            &ring,
            &[vec2(-0.008, -0.025), vec2(0.008, -0.025), vec2(0.008, 0.025), vec2(-0.008, 0.025)],
            false,
        ));
    }
    model.add(palette.iron, hoops);
    model
}

/// A crate of boards, `size` m, standing on y = 0.
pub(super) fn crate_of_boards(palette: &Palette, size: f32, random: &mut Random) -> Model {
    let mut out = Geometry::default();
    let tone = |random: &mut Random| srgb(0xb08d5c) * random.range(0.7, 1.0);
    out.append(&cuboid(size * 0.94, size * 0.94, size * 0.94).at(0.0, size * 0.5, 0.0).colored(srgb(0x6b5235)));
    for face in 0..4 {
        for i in 0..4 {
            let y = size * (0.125 + 0.25 * i as f32);
            let board = cuboid(size * 0.98, size * 0.235, 0.02).at(0.0, y, size * 0.48).turned_y(90.0 * face as f32);
            out.append(&board.colored(tone(random)));
        }
        for x in [-0.44, 0.44] {
            let batten =
                cuboid(size * 0.1, size, 0.02).at(x * size, size * 0.5, size * 0.5).turned_y(90.0 * face as f32);
            out.append(&batten.colored(tone(random)));
        }
    }
    for i in 0..4 {
        let lid = cuboid(size * 0.235, 0.02, size).at(size * (0.25 * i as f32 - 0.375), size - 0.005, 0.0);
        out.append(&lid.colored(tone(random)));
    }
    Model::of(palette.wood, out)
}

/// A spoked wheel of radius `r` in XY at z = 0.
fn spoked_wheel(palette: &Palette, r: f32) -> Model {
    let rim: Vec<Vec3> = circle(r - 0.04, 32).iter().map(|p| p.extend(0.0)).collect();
    let mut wood = loop_sweep(&rim, &square(0.035), false);
    wood.append(&cylinder(0.09, 0.26, 16).turned_x(90.0).at(0.0, 0.0, -0.13));
    for i in 0..12 {
        let spoke =
            sweep(&[vec3(0.0, 0.07, 0.0), vec3(0.0, r - 0.06, 0.0)], &circle(0.024, 6), true, |k| [1.0, 0.75][k]);
        wood.append(&spoke.turned_z(30.0 * i as f32));
    }
    let mut model = Model::of(palette.wood, wood.colored(srgb(0x7c4a2c)));
    let tyre: Vec<Vec3> = circle(r, 32).iter().map(|p| p.extend(0.0)).collect();
    let band = [vec2(-0.006, -0.036), vec2(0.006, -0.036), vec2(0.006, 0.036), vec2(-0.006, 0.036)];
    model.add(palette.iron, loop_sweep(&tyre, &band, false));
    model
}

/// A covered wagon, its shafts towards +X, standing on y = 0.
pub(super) fn wagon(palette: &Palette, random: &mut Random) -> Model {
    let mut model = Model::default();
    let mut wood = Geometry::default();
    let (length, width, floor) = (3.3, 1.25, 0.95);
    for i in 0..6 {
        let z = (i as f32 / 5.0 - 0.5) * (width - 0.2);
        wood.append(&cuboid(length, 0.04, 0.2).at(0.0, floor, z).colored(srgb(0x8c7350) * random.range(0.7, 1.0)));
    }
    for side in [-0.5f32, 0.5] {
        for i in 0..3 {
            let board = cuboid(length, 0.19, 0.03).at(0.0, floor + 0.13 + 0.2 * i as f32, side * width);
            wood.append(&board.colored(srgb(0x4f7a86) * random.range(0.75, 1.0)));
        }
        for x in [-1.5, -0.5, 0.5, 1.5] {
            wood.append(&cuboid(0.07, 0.75, 0.05).at(x, floor + 0.28, side * (width + 0.07)).colored(srgb(0x6d563a)));
        }
    }
    for x in [-0.5f32, 0.5] {
        for i in 0..3 {
            let board = cuboid(0.03, 0.19, width - 0.03).at(x * (length - 0.03), floor + 0.13 + 0.2 * i as f32, 0.0);
            wood.append(&board.colored(srgb(0x4f7a86) * random.range(0.75, 1.0)));
        }
    }
    wood.append(&cuboid(1.9, 0.12, 0.12).at(0.3, 0.72, 0.0).colored(srgb(0x5f4a33)));
    for x in [-1.05, 1.05] {
        wood.append(&cuboid(0.11, 0.11, width + 0.3).at(x, 0.6, 0.0).colored(srgb(0x5f4a33)));
        wood.append(&cuboid(0.16, 0.3, 0.7).at(x, 0.79, 0.0).colored(srgb(0x5f4a33)));
    }
    let shaft = [vec3(1.1, 0.62, 0.0), vec3(2.2, 0.5, 0.0), vec3(3.6, 0.18, 0.0)];
    wood.append(&sweep(&shaft, &square(0.045), false, |i| [1.2, 1.0, 0.8][i]).colored(srgb(0x6d563a)));
    model.add(palette.wood, wood);
    for (x, r) in [(-1.05, 0.62), (1.05, 0.52)] {
        for side in [-1.0f32, 1.0] {
            let place = vec3(x, r, side * (width * 0.5 + 0.17));
            model.append(&spoked_wheel(palette, r), Mat4::from_translation(place));
        }
    }
    // The cover sags between its bows.
    let mut cover = Geometry::default();
    let (columns, rows) = (24, 18);
    for j in 0..=rows {
        for i in 0..=columns {
            let (u, v) = (i as f32 / columns as f32, j as f32 / rows as f32);
            let angle = std::f32::consts::PI * v;
            let sag = 1.0 - 0.045 * (std::f32::consts::PI * u * 4.0).sin().powi(2) * (angle.sin() + 0.2);
            let flare = 1.0 + 0.1 * (2.0 * u - 1.0).powi(4);
            let p = vec3(
                (u - 0.5) * (length + 0.5),
                floor + 0.5 + 1.12 * angle.sin() * sag * flare,
                -0.68 * angle.cos() * sag * flare,
            );
            cover.vertex(p, Vec3::Y, vec2(u * 4.0, v * 3.0));
        }
    }
    for (i, j) in (0..columns).flat_map(|i| (0..rows).map(move |j| (i, j))) {
        let at = j * (columns + 1) + i;
        cover.quad(at, at + columns + 1, at + columns + 2, at + 1);
    }
    cover.smooth_normals();
    model.add(palette.canvas, cover);
    model
}

/// A rail to tie horses to, `length` along X.
pub(super) fn hitching_rail(palette: &Palette, length: f32) -> Model {
    let mut wood = cylinder(0.05, length, 10).turned_z(90.0).at(length * 0.5, 1.0, 0.0);
    for x in [-0.45, 0.0, 0.45] {
        wood.append(&frustum(0.075, 0.065, 1.4, 10).at(x * length, -0.3, 0.0));
    }
    Model::of(palette.wood, wood.colored(srgb(0x8a7256)))
}

/// A horse trough with water, `length` along X.
pub(super) fn trough(palette: &Palette, length: f32) -> Model {
    let mut wood = cuboid(length, 0.06, 0.6).at(0.0, 0.14, 0.0);
    for z in [-0.29, 0.29] {
        wood.append(&cuboid(length, 0.45, 0.06).at(0.0, 0.36, z));
    }
    for x in [-0.5f32, 0.5] {
        wood.append(&cuboid(0.06, 0.45, 0.52).at(x * (length - 0.06), 0.36, 0.0));
        wood.append(&cuboid(0.12, 0.14, 0.7).at(x * (length - 0.4), 0.06, 0.0));
    }
    let mut model = Model::of(palette.wood, wood.colored(srgb(0x7c6a52)));
    model.add(palette.water, cuboid(length - 0.12, 0.02, 0.52).at(0.0, 0.5, 0.0));
    model
}

/// A bench of boards, `length` along X, facing +Z.
pub(super) fn bench(palette: &Palette, length: f32) -> Model {
    let mut wood = Geometry::default();
    for z in [-0.16, 0.0, 0.16] {
        wood.append(&bevel_box(length, 0.035, 0.14, 0.008).at(0.0, 0.45, z));
    }
    for y in [0.65, 0.83] {
        wood.append(&bevel_box(length, 0.13, 0.03, 0.008).turned_x(-10.0).at(0.0, y, -0.26 - 0.17 * (y - 0.45)));
    }
    for x in [-0.42, 0.42] {
        wood.append(&cuboid(0.06, 0.43, 0.4).at(x * length, 0.215, 0.0));
        wood.append(&cuboid(0.06, 0.5, 0.05).turned_x(-10.0).at(x * length, 0.66, -0.26));
    }
    Model::of(palette.wood, wood.colored(srgb(0x8d6f4c)))
}

/// A lantern on an arm, hanging from its origin.
pub(super) fn lantern(palette: &Palette) -> Model {
    let mut iron = frustum(0.075, 0.085, 0.03, 8).at(0.0, -0.42, 0.0);
    iron.append(&frustum(0.11, 0.02, 0.09, 8).at(0.0, -0.2, 0.0));
    for i in 0..4 {
        let angle = std::f32::consts::FRAC_PI_2 * i as f32;
        iron.append(&cuboid(0.012, 0.2, 0.012).at(0.07 * angle.cos(), -0.3, 0.07 * angle.sin()));
    }
    iron.append(&cylinder(0.006, 0.12, 6).at(0.0, -0.12, 0.0));
    let mut model = Model::of(palette.iron, iron);
    model.add(palette.glass, frustum(0.06, 0.06, 0.18, 10).at(0.0, -0.39, 0.0));
    model
}

/// A telegraph pole of `height` m; wires run along Z at the ends of its arm.
pub(super) fn pole(palette: &Palette, height: f32) -> Model {
    let mut wood = frustum(0.14, 0.09, height + 0.5, 12).at(0.0, -0.5, 0.0);
    wood.append(&bevel_box(1.7, 0.11, 0.1, 0.01).at(0.0, height - 0.35, 0.11));
    let mut model = Model::of(palette.wood, wood.colored(srgb(0x7d6850)));
    for x in [-0.75, -0.4, 0.4, 0.75] {
        let knob = lathe(
            &[(0.0, 0.0), (0.03, 0.0), (0.045, 0.04), (0.025, 0.06), (0.04, 0.09), (0.0, 0.12)]
                .map(|(r, y)| vec2(r, y)),
            10,
            50.0,
        );
        model.add(palette.porcelain, knob.at(x, height - 0.295, 0.11));
    }
    model
}

/// A wire that hangs between two places.
pub(super) fn wire(a: Vec3, b: Vec3) -> Geometry {
    let path: Vec<Vec3> = (0..=10)
        .map(|i| {
            let t = i as f32 / 10.0;
            a.lerp(b, t) - Vec3::Y * 0.55 * 4.0 * t * (1.0 - t)
        })
        .collect();
    sweep(&path, &circle(0.012, 3), true, |_| 1.0)
}

/// A wind wheel of `height` m for a pump, facing +Z.
pub(super) fn wind_wheel(palette: &Palette, height: f32) -> Model {
    let mut wood = Geometry::default();
    let leg = |i: usize, y: f32| {
        let (x, z) = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0f32)][i % 4];
        let spread = 1.2 * (1.0 - y / height) + 0.12;
        vec3(x * spread, y, z * spread)
    };
    for i in 0..4 {
        wood.append(&sweep(&[leg(i, -0.5), leg(i, height)], &square(0.055), false, |_| 1.0));
        for k in 0..4 {
            let (low, high) = (height * 0.22 * k as f32 + 0.2, height * 0.22 * (k + 1) as f32 + 0.2);
            wood.append(&sweep(&[leg(i, low), leg(i + 1, high)], &square(0.03), false, |_| 1.0));
            wood.append(&sweep(&[leg(i, high), leg(i + 1, high)], &square(0.035), false, |_| 1.0));
        }
    }
    let mut model = Model::of(palette.wood, wood.colored(srgb(0x84725a)));
    let hub = vec3(0.0, height + 0.15, 0.35);
    let mut iron = cylinder(0.12, 0.5, 12).turned_x(90.0).at(hub.x, hub.y, hub.z - 0.4);
    for i in 0..18 {
        let blade = cuboid(0.2, 0.95, 0.012).turned_y(24.0).at(0.0, 0.95, 0.0).turned_z(20.0 * i as f32);
        iron.append(&blade.at(hub.x, hub.y, hub.z + 0.1));
    }
    for r in [0.5, 1.4] {
        let ring: Vec<Vec3> = circle(r, 36).iter().map(|p| p.extend(0.0) + hub + Vec3::Z * 0.1).collect();
        iron.append(&loop_sweep(&ring, &square(0.014), false));
    }
    let vane = bevel_box(0.02, 0.75, 1.1, 0.004).at(hub.x, hub.y, hub.z - 1.6);
    iron.append(&vane);
    iron.append(&cylinder(0.03, 1.2, 8).turned_x(90.0).at(hub.x, hub.y, hub.z - 1.35));
    model.add(palette.tin, iron);
    model
}

/// A flour sack that sits on y = 0.
pub(super) fn sack() -> Geometry {
    sphere(1.0, 18, 12).displaced(|p| {
        let slump = 1.0 + 0.25 * (-p.y).max(0.0);
        vec3(p.x * 0.25 * slump, (p.y.max(-0.7) + 0.7) * 0.27, p.z * 0.17 * slump)
    })
}

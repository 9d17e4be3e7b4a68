//! Desks, chairs, shelves and cabinets. Everything stands on y = 0; who uses it sits towards +Z.

use super::super::kit::{Geometry, Model, Random, bevel_box, circle, cuboid, cylinder, slab, sphere, srgb, sweep};
use super::Palette;
use glam::{Mat4, Vec2, Vec3, vec2, vec3};

/// Height of every desk top.
pub(super) const DESK: f32 = 0.735;

/// A desk of 1.5 m × 0.75 m with steel legs, a modesty panel and a drawer unit on the right.
pub(super) fn desk(palette: &Palette) -> Model {
    let mut model = Model::default();
    model.add(palette.beech, bevel_box(1.5, 0.028, 0.75, 0.006).at(0.0, DESK - 0.014, 0.0));
    let mut frame = Geometry::default();
    for x in [-0.68, 0.68] {
        frame.append(&slab([x - 0.025, 0.0, -0.32], [x + 0.025, DESK - 0.07, -0.27]));
        frame.append(&slab([x - 0.025, 0.0, 0.27], [x + 0.025, DESK - 0.07, 0.32]));
        frame.append(&slab([x - 0.025, DESK - 0.07, -0.32], [x + 0.025, DESK - 0.028, 0.32]));
    }
    frame.append(&slab([-0.655, DESK - 0.07, -0.31], [0.655, DESK - 0.03, -0.28]));
    model.add(palette.steel, frame);
    model.add(palette.grey, slab([-0.655, 0.35, -0.3], [0.655, DESK - 0.07, -0.29]));
    let mut drawers = bevel_box(0.4, 0.56, 0.55, 0.006).at(0.43, 0.33, 0.0);
    for i in 0..3 {
        let y = 0.15 + 0.18 * i as f32;
        drawers.append(&cuboid(0.37, 0.165, 0.012).at(0.43, y, 0.279));
    }
    model.add(palette.grey, drawers);
    let mut handles = Geometry::default();
    for i in 0..3 {
        handles.append(&cuboid(0.12, 0.012, 0.02).at(0.43, 0.2 + 0.18 * i as f32, 0.292));
    }
    handles.append(&slab([0.25, 0.0, -0.25], [0.61, 0.05, 0.25]));
    model.add(palette.steel, handles);
    model
}

/// A soft block: a superellipsoid of full extents `size`.
fn cushion(size: Vec3) -> Geometry {
    let soft = |c: f32| c.signum() * c.abs().powf(0.45) * 0.5;
    sphere(1.0, 16, 8).displaced(|p| vec3(soft(p.x), soft(p.y), soft(p.z)) * size)
}

/// A swivel chair whose seat faces −Z.
pub(super) fn chair(palette: &Palette) -> Model {
    let mut frame = Geometry::default();
    let bar = [vec2(-0.02, -0.014), vec2(0.02, -0.014), vec2(0.02, 0.014), vec2(-0.02, 0.014)];
    for i in 0..5 {
        let leg = sweep(&[vec3(0.02, 0.1, 0.0), vec3(0.15, 0.085, 0.0), vec3(0.3, 0.07, 0.0)], &bar, false, |k| {
            [1.25, 1.0, 0.7][k]
        });
        let caster = cylinder(0.029, 0.044, 9).turned_x(90.0).at(0.29, 0.029, -0.022);
        frame.append(&leg.turned_y(72.0 * i as f32 + 18.0));
        frame.append(&caster.turned_y(72.0 * i as f32 + 18.0));
    }
    frame.append(&cylinder(0.04, 0.1, 12).at(0.0, 0.07, 0.0));
    frame.append(&cylinder(0.024, 0.26, 12).at(0.0, 0.16, 0.0));
    frame.append(&bevel_box(0.22, 0.03, 0.26, 0.008).at(0.0, 0.415, 0.0));
    let spine = [vec3(0.0, 0.42, 0.1), vec3(0.0, 0.43, 0.25), vec3(0.0, 0.52, 0.285), vec3(0.0, 0.78, 0.27)];
    frame.append(&sweep(&spine, &bar.map(|p| p * 1.3), false, |_| 1.0));
    let pipe = circle(0.012, 6);
    let mut pads = Geometry::default();
    for side in [-1.0f32, 1.0] {
        let x = side * 0.27;
        let path = [vec3(side * 0.1, 0.415, 0.04), vec3(x, 0.425, 0.04), vec3(x, 0.48, 0.04), vec3(x, 0.63, 0.02)];
        frame.append(&sweep(&path, &pipe, true, |_| 1.0));
        pads.append(&bevel_box(0.06, 0.028, 0.25, 0.012).at(x, 0.642, 0.0));
    }
    let mut model = Model::of(palette.dark, frame);
    model.add(palette.dark, pads);
    let mut fabric = cushion(vec3(0.5, 0.1, 0.49)).at(0.0, 0.475, 0.0);
    let back = cushion(vec3(0.46, 0.56, 0.08))
        .displaced(|p| p + Vec3::Z * (-0.6 * p.x * p.x - 0.25 * (p.y - 0.05) * (p.y - 0.05)));
    fabric.append(&back.turned_x(-7.0).at(0.0, 0.83, 0.25));
    model.add(palette.fabric, fabric);
    model
}

/// An open shelf of `width` × `height` × 0.32 m with its back to −Z, filled with books and boxes.
pub(super) fn shelf(palette: &Palette, (width, height): (f32, f32), levels: usize, random: &mut Random) -> Model {
    let (depth, board) = (0.32, 0.022);
    let mut carcass = Geometry::default();
    for x in [-0.5f32, 0.5] {
        carcass.append(&cuboid(board, height, depth).at(x * (width - board), height * 0.5, 0.0));
    }
    carcass.append(&cuboid(width - 2.0 * board, height - 0.06, 0.008).at(0.0, height * 0.5, -depth * 0.5 + 0.005));
    let step = (height - board - 0.06) / levels as f32;
    for i in 0..=levels {
        let y = 0.06 + step * i as f32;
        carcass.append(&cuboid(width - 2.0 * board, board, depth - 0.01).at(0.0, y, 0.004));
    }
    let mut model = Model::of(palette.beech, carcass);
    let mut books = Geometry::default();
    let mut boxes = Geometry::default();
    for i in 0..levels {
        let y = 0.06 + step * i as f32 + board * 0.5;
        let (from, to) = (-width * 0.5 + board, width * 0.5 - board);
        // Some bays hold archive boxes, most hold books.
        if random.unit() < 0.25 {
            let mut x = from + 0.06;
            while x + 0.06 < to {
                boxes.append(&cuboid(0.085, 0.3f32.min(step - 0.05), 0.25).at(
                    x,
                    y + 0.15f32.min(step * 0.5 - 0.025),
                    0.0,
                ));
                x += 0.095;
            }
        } else {
            books.append(&row_of_books(from, to - random.range(0.05, 0.35), step, random).at(0.0, y, 0.0));
        }
    }
    model.add(palette.books, books);
    model.add(palette.grey, boxes);
    model
}

/// Books of different sizes side by side; the last ones lean.
fn row_of_books(from: f32, to: f32, room: f32, random: &mut Random) -> Geometry {
    let colors = [
        0x8c2f2a, 0x2f4e7a, 0x3a6b4b, 0xc9a14a, 0x5b3a63, 0xd8d2c4, 0x23282e, 0xb4552d, 0x4f7f8c, 0x7a7d80, 0x9a3d55,
        0xe3b23c,
    ];
    let mut out = Geometry::default();
    let mut x = from + 0.004;
    while x < to {
        let (thick, tall, deep) =
            (random.range(0.024, 0.064), random.range(0.19, 0.28).min(room - 0.04), random.range(0.15, 0.21));
        let color = srgb(colors[random.index(colors.len())]) * random.range(0.8, 1.1);
        let book = cuboid(thick, tall, deep).at(x + thick * 0.5, tall * 0.5, 0.15 - deep * 0.5);
        out.append(&book.colored(color.min(Vec3::splat(0.95))));
        x += thick + 0.0015;
    }
    let tilt = Mat4::from_translation(vec3(x + 0.075, 0.0015, 0.0)) * Mat4::from_rotation_z(0.3);
    out.append(&cuboid(0.03, 0.22, 0.17).at(-0.015, 0.11, 0.06).transformed(tilt).colored(srgb(0x2f4e7a)));
    out
}

/// A filing cabinet of four drawers, its front to +Z.
pub(super) fn cabinet(palette: &Palette) -> Model {
    let mut model = Model::of(palette.grey, bevel_box(0.46, 1.3, 0.6, 0.006).at(0.0, 0.65, 0.0));
    let mut handles = Geometry::default();
    for i in 0..4 {
        let y = 0.18 + 0.315 * i as f32;
        model.add(palette.grey, cuboid(0.43, 0.3, 0.012).at(0.0, y, 0.304));
        handles.append(&cuboid(0.14, 0.014, 0.022).at(0.0, y + 0.06, 0.317));
    }
    model.add(palette.steel, handles);
    model
}

/// A plant of long leaves in a pot.
pub(super) fn plant(palette: &Palette, leaves: usize, random: &mut Random) -> Model {
    let profile = [(0.0, 0.0), (0.12, 0.0), (0.16, 0.3), (0.165, 0.31), (0.15, 0.31), (0.14, 0.27), (0.0, 0.27)];
    let pot = super::super::kit::lathe(&profile.map(|(r, y)| vec2(r, y)), 28, 40.0);
    let mut model = Model::of(palette.clay, pot);
    let blade: Vec<Vec2> = vec![vec2(0.0, 0.002), vec2(-0.5, 0.06), vec2(0.0, -0.002), vec2(0.5, 0.06)];
    let mut green = Geometry::default();
    for i in 0..leaves {
        let (turn, lean, length) = (i as f32 * 137.5, random.range(0.15, 1.0), random.range(0.5, 0.95));
        let path: Vec<Vec3> = (0..=5)
            .map(|k| {
                let t = k as f32 / 5.0;
                let out = lean * length * (0.25 * t + 0.75 * t * t);
                vec3(0.02 + out, 0.27 + length * (t - 0.42 * lean * t * t * t), 0.0)
            })
            .collect();
        let leaf =
            sweep(&path, &blade, false, |k| 0.07 * (0.25 + 1.6 * (k as f32 / 5.0)).min(1.9 - 1.85 * k as f32 / 5.0));
        green.append(&leaf.turned_y(turn).colored(srgb(0x5f8a3c) * random.range(0.55, 1.1)));
    }
    model.add(palette.leaf, green);
    model
}

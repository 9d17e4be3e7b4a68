//! Bookcase, sideboards and the long clock. Their fronts look to +Z.

use super::super::kit::{Model, Random, bevel_box, cuboid, cylinder, lathe, picture_frame, slab, sphere, torus};
use super::{Palette, things};
use glam::{Mat4, Vec2, vec2, vec3};

/// Height and depth of a sideboard.
pub(super) const SIDEBOARD: (f32, f32) = (0.84, 0.42);
/// Width, height and depth of the bookcase, and how high its cupboards are.
const CASE: (f32, f32, f32) = (2.2, 2.2, 0.32);
const CUPBOARD: f32 = 0.66;

/// A cupboard door of `size` with a sunk panel, its back on z = 0, and its knob at `knob` from its middle.
fn panelled(model: &mut Model, (wood, brass): (u32, u32), size: Vec2, knob: Vec2, map: Mat4) {
    let mut door = bevel_box(size.x, size.y, 0.022, 0.005).at(0.0, 0.0, 0.011);
    door.append(&picture_frame(size - Vec2::splat(0.16), 0.028, 0.012).at(0.0, 0.0, 0.0215));
    model.add(wood, door.transformed(map));
    let mut handle = cylinder(0.006, 0.022, 10).turned_x(90.0).at(knob.x, knob.y, 0.02);
    handle.append(&sphere(0.014, 10, 5).at(knob.x, knob.y, 0.046));
    model.add(brass, handle.transformed(map));
}

/// Shelves of books over cupboards, in three bays.
pub(super) fn bookcase(palette: &Palette, random: &mut Random) -> Model {
    let (wide, high, deep) = CASE;
    let (bays, rows, board) = (3, 4, 0.026);
    let front = 0.5 * deep;
    let mut wood = cuboid(wide - 0.01, high - 0.08, 0.012).at(0.0, 0.5 * high, -front + 0.006);
    let bay = (wide - board) / bays as f32;
    for i in 0..=bays {
        let x = (i as f32 - 0.5 * bays as f32) * bay;
        wood.append(&cuboid(board, high - 0.1, deep - 0.012).at(x, 0.5 * high, 0.006));
        // A pilaster before each upright.
        wood.append(&bevel_box(0.05, high - 0.18, 0.014, 0.004).at(x, 0.5 * high + 0.04, front + 0.006));
    }
    wood.append(&slab([-0.5 * wide - 0.012, 0.0, -front], [0.5 * wide + 0.012, 0.09, front + 0.016]));
    wood.append(&bevel_box(wide + 0.06, 0.04, deep + 0.06, 0.012).at(0.0, CUPBOARD + 0.02, 0.02));
    wood.append(&bevel_box(wide + 0.05, 0.09, deep + 0.045, 0.012).at(0.0, high - 0.065, 0.015));
    wood.append(&bevel_box(wide + 0.11, 0.035, deep + 0.09, 0.014).at(0.0, high - 0.006, 0.03));
    let (low, top) = (CUPBOARD + 0.04, high - 0.11);
    let step = (top - low) / rows as f32;
    let mut model = Model::default();
    for bay_number in 0..bays {
        let x = (bay_number as f32 - 0.5 * (bays - 1) as f32) * bay;
        for row in 0..rows {
            let y = low + step * row as f32;
            if row > 0 {
                wood.append(&cuboid(bay - board, board, deep - 0.04).at(x, y - 0.5 * board, 0.0));
            }
            let room = step - board;
            shelf_row(&mut model, palette, (x - 0.5 * (bay - board), x + 0.5 * (bay - board)), (y, room), random);
        }
        for side in [-1.0f32, 1.0] {
            let size = vec2(0.5 * (bay - 0.05) - 0.004, CUPBOARD - 0.115);
            let place = vec3(x + side * (0.5 * size.x + 0.002), 0.5 * (CUPBOARD + 0.09), front - 0.002);
            let knob = vec2(-side * (0.5 * size.x - 0.035), 0.06);
            panelled(&mut model, (palette.wood, palette.brass), size, knob, Mat4::from_translation(place));
        }
    }
    model.add(palette.wood, wood);
    model
}

/// What stands on a shelf from x to x: books, in some places a pile of them, or a vessel.
fn shelf_row(model: &mut Model, palette: &Palette, (from, to): (f32, f32), (y, room): (f32, f32), random: &mut Random) {
    let mut x = from + 0.006;
    let kind = random.index(5);
    let end = match kind {
        0 => to - 0.2,
        1 => to - 0.27,
        _ => to - random.range(0.0, 0.06),
    };
    while x < end - 0.02 {
        let thick = random.range(0.022, 0.06).min(end - x);
        let (tall, deep) = (random.range(0.62, 0.9) * room.min(0.32), random.range(0.16, 0.21));
        let book = things::book(palette, vec3(thick, tall, deep), things::binding(random));
        // Backs stand in a line, not quite straight.
        let back = 0.5 * CASE.2 - 0.045 - random.range(0.0, 0.02);
        model.append(&book, Mat4::from_translation(vec3(x + 0.5 * thick, y, back - 0.5 * deep)));
        x += thick + 0.0012;
    }
    match kind {
        0 => {
            let vessel = if random.unit() < 0.5 { things::vase() } else { things::jar() };
            let paint = if random.unit() < 0.5 { palette.clay } else { palette.porcelain };
            model.add(paint, vessel.at(to - 0.1, y, 0.02));
        }
        1 => {
            let pile = things::pile(palette, 4, random);
            model.append(&pile, Mat4::from_translation(vec3(to - 0.135, y, 0.02)));
        }
        _ => {}
    }
}

/// A low cabinet of `bays` doors with a drawer over each.
pub(super) fn sideboard(palette: &Palette, wide: f32, bays: usize) -> Model {
    let (high, deep) = SIDEBOARD;
    let front = 0.5 * deep;
    let mut wood = bevel_box(wide, 0.032, deep, 0.01).at(0.0, high - 0.016, 0.0);
    wood.append(&bevel_box(wide - 0.02, 0.02, deep - 0.012, 0.006).at(0.0, high - 0.04, 0.0));
    wood.append(&bevel_box(wide - 0.06, high - 0.15, deep - 0.06, 0.004).at(0.0, 0.5 * (high + 0.07), -0.006));
    wood.append(&bevel_box(wide - 0.04, 0.05, deep - 0.04, 0.01).at(0.0, 0.13, 0.0));
    for (x, z) in [(-1.0f32, 1.0f32), (1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)] {
        let points = [(0.0, 0.0), (0.014, 0.0), (0.026, 0.09), (0.026, 0.11), (0.0, 0.11)];
        let leg = lathe(&points.map(|(r, y)| vec2(r, y)), 16, 40.0);
        wood.append(&leg.at(x * (0.5 * wide - 0.07), 0.0, z * (front - 0.06)));
    }
    let mut model = Model::of(palette.wood, wood);
    let pitch = (wide - 0.09) / bays as f32;
    for i in 0..bays {
        let x = (i as f32 - 0.5 * (bays - 1) as f32) * pitch;
        let face = front - 0.037;
        let drawer = Mat4::from_translation(vec3(x, high - 0.125, face));
        model.add(palette.wood, bevel_box(pitch - 0.016, 0.13, 0.022, 0.005).at(0.0, 0.0, 0.011).transformed(drawer));
        for side in [-0.25f32, 0.25] {
            model.add(palette.brass, sphere(0.014, 10, 5).at(side * pitch, 0.0, 0.03).transformed(drawer));
        }
        let size = vec2(pitch - 0.016, high - 0.375);
        let place = Mat4::from_translation(vec3(x, 0.5 * size.y + 0.165, face));
        let knob = vec2(if i % 2 == 0 { 1.0 } else { -1.0 } * (0.5 * size.x - 0.035), 0.08);
        panelled(&mut model, (palette.wood, palette.brass), size, knob, place);
    }
    model
}

/// A clock of a man's height in a narrow case.
pub(super) fn long_clock(palette: &Palette) -> Model {
    let mut wood = bevel_box(0.46, 0.12, 0.27, 0.012).at(0.0, 0.06, 0.0);
    wood.append(&bevel_box(0.42, 0.4, 0.24, 0.01).at(0.0, 0.3, 0.0));
    wood.append(&bevel_box(0.46, 0.04, 0.27, 0.012).at(0.0, 0.51, 0.0));
    wood.append(&bevel_box(0.32, 0.96, 0.2, 0.01).at(0.0, 1.0, 0.0));
    wood.append(&bevel_box(0.44, 0.05, 0.26, 0.014).at(0.0, 1.49, 0.0));
    wood.append(&bevel_box(0.4, 0.46, 0.235, 0.01).at(0.0, 1.74, 0.0));
    wood.append(&bevel_box(0.46, 0.045, 0.275, 0.014).at(0.0, 1.985, 0.0));
    wood.append(&bevel_box(0.34, 0.06, 0.2, 0.02).at(0.0, 2.03, 0.0));
    for x in [-0.19f32, 0.19] {
        wood.append(&cylinder(0.016, 0.44, 14).at(x, 1.52, 0.118));
        wood.append(&sphere(0.028, 12, 6).at(x, 2.035, 0.09));
    }
    wood.append(&picture_frame(vec2(0.2, 0.22), 0.03, 0.012).at(0.0, 0.3, 0.1195));
    wood.append(&picture_frame(vec2(0.16, 0.76), 0.03, 0.012).at(0.0, 1.0, 0.0995));
    let mut model = Model::of(palette.wood, wood);
    model.append(&things::dial(palette, 0.15), Mat4::from_translation(vec3(0.0, 1.74, 0.1175)));
    let mut brass = torus(0.158, 0.012, 32, 6).turned_x(90.0).at(0.0, 1.74, 0.121);
    brass.append(&cylinder(0.05, 0.008, 28).turned_x(90.0).at(0.0, 0.78, 0.1));
    brass.append(&cuboid(0.01, 0.4, 0.004).at(0.0, 1.0, 0.102));
    model.add(palette.brass, brass);
    model
}

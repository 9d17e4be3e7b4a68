//! Wooden buildings with false fronts, porches and boardwalks. A building's front lies in z = 0 and faces +Z; it stands
//! on the boardwalk's level, y = 0, and reaches down below it with its foundation.

use super::super::kit::{Geometry, Model, Random, bevel_box, circle, cuboid, cylinder, frustum, slab, srgb, sweep};
use super::Palette;
use glam::{Mat4, Vec3, vec2, vec3};

/// What a building looks like, metres.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    pub name: &'static str,
    pub width: f32,
    pub depth: f32,
    /// Height of the side walls and of the false front.
    pub walls: f32,
    pub front: f32,
    pub storeys: u32,
    /// Paint of the boards and of the trim, sRGB.
    pub paint: u32,
    pub trim: u32,
    /// Whether a porch covers the boardwalk in front.
    pub porch: bool,
    /// The sign's material and size, if it has one.
    pub sign: Option<(u32, (f32, f32))>,
}

/// Depth of the boardwalk before every building.
pub(super) const WALK: f32 = 2.4;
/// Height of the porch roof's lower and upper edge.
const PORCH: (f32, f32) = (2.55, 3.0);

pub(super) fn building(palette: &Palette, plan: &Plan, random: &mut Random) -> Model {
    let mut model = Model::default();
    let (w, d) = (plan.width, plan.depth);
    let paint = srgb(plan.paint);
    // A plain core behind the boards keeps light out.
    let core = slab([-w * 0.5 + 0.03, -0.6, -d + 0.03], [w * 0.5 - 0.03, plan.walls - 0.02, -0.03]);
    model.add(palette.wood, core.colored(paint * 0.5));
    model.add(palette.wood, boards(w, plan.front, 0.19, paint, random));
    for (turn, at, length) in [
        (90.0, vec3(w * 0.5, 0.0, -d * 0.5), d),
        (-90.0, vec3(-w * 0.5, 0.0, -d * 0.5), d),
        (180.0, vec3(0.0, 0.0, -d), w),
    ] {
        let side = boards(length, plan.walls, 0.24, paint * 0.85, random);
        model.add(palette.wood, side.turned_y(turn).at(at.x, at.y, at.z));
    }
    front_trim(&mut model, palette, plan);
    roof(&mut model, palette, plan);
    openings(&mut model, palette, plan);
    if plan.porch {
        porch(&mut model, palette, plan);
    }
    if let Some((sign, (width, height))) = plan.sign {
        let y = if plan.storeys > 1 {
            plan.front - 0.35 - height
        } else {
            (plan.front - 0.35 + plan.walls.max(PORCH.1 + 0.35)) * 0.5 - height * 0.5
        };
        let mut face = Geometry::default();
        let corner = |x: f32, up: f32| vec3(x * width, y + up * height, 0.121);
        face.flat_quad([corner(-0.5, 0.0), corner(0.5, 0.0), corner(0.5, 1.0), corner(-0.5, 1.0)]);
        model.add(sign, face);
        let back = bevel_box(width + 0.08, height + 0.08, 0.07, 0.012).at(0.0, y + height * 0.5, 0.083);
        model.add(palette.wood, back.colored(srgb(plan.trim) * 0.6));
    }
    model
}

/// Overlapping horizontal boards over a wall of `width` × `height` in z = 0, facing +Z.
fn boards(width: f32, height: f32, row: f32, paint: Vec3, random: &mut Random) -> Geometry {
    let mut out = Geometry::default();
    let rows = (height / row).ceil() as usize;
    for i in 0..rows {
        let low = i as f32 * row;
        let tall = row.min(height - low);
        // One or two lengths a row, each weathered differently.
        let split = random.range(0.25, 0.75) * width;
        let ends = if width > 3.0 { vec![0.0, split, width] } else { vec![0.0, width] };
        for pair in ends.windows(2) {
            let length = pair[1] - pair[0] - 0.004;
            let board = cuboid(length, tall + 0.015, 0.022).turned_x(-5.0);
            let tone = random.range(0.78, 1.08);
            let x = (pair[0] + pair[1] - width) * 0.5;
            // Boards share one texture; a shift makes each look like its own.
            let mut board = board.at(x, low + tall * 0.5, 0.004).colored((paint * tone).min(Vec3::ONE));
            let shift = vec2(random.range(0.0, 3.0), random.range(0.0, 3.0));
            board.uvs.iter_mut().for_each(|uv| *uv += shift);
            out.append(&board);
        }
    }
    out
}

/// Corner boards and the cornice of the false front with brackets.
fn front_trim(model: &mut Model, palette: &Palette, plan: &Plan) {
    let (w, trim) = (plan.width, srgb(plan.trim));
    let mut out = Geometry::default();
    for x in [-0.5f32, 0.5] {
        out.append(&cuboid(0.16, plan.front, 0.07).at(x * (w - 0.14), plan.front * 0.5, 0.02));
        out.append(&cuboid(0.1, plan.front - plan.walls, 0.5).at(
            x * (w - 0.1),
            (plan.front + plan.walls) * 0.5,
            -0.24,
        ));
    }
    out.append(&cuboid(w, plan.front - plan.walls, 0.04).at(0.0, (plan.front + plan.walls) * 0.5, -0.03));
    out.append(&bevel_box(w + 0.3, 0.12, 0.36, 0.03).at(0.0, plan.front + 0.06, 0.06));
    out.append(&bevel_box(w + 0.16, 0.1, 0.24, 0.02).at(0.0, plan.front - 0.05, 0.05));
    let count = (w / 0.55) as usize;
    for i in 0..count {
        let x = ((i as f32 + 0.5) / count as f32 - 0.5) * w;
        out.append(&cuboid(0.08, 0.24, 0.16).at(x, plan.front - 0.2, 0.09));
    }
    model.add(palette.wood, out.colored(trim));
}

/// A gable roof along z with rows of shingles, gables closed.
fn roof(model: &mut Model, palette: &Palette, plan: &Plan) {
    let (half, d) = (plan.width * 0.5 + 0.25, plan.depth);
    let rise = (plan.front - plan.walls - 0.25).clamp(0.5, half * 0.55);
    let slope = (rise / half).atan();
    let length = half / slope.cos();
    let mut gable = Geometry::default();
    let y = plan.walls - 0.05;
    let inner = plan.width * 0.5 - 0.02;
    let top = y + rise * inner / half;
    gable.flat_triangle(vec3(inner, y, -d), vec3(-inner, y, -d), vec3(0.0, top, -d));
    gable.flat_triangle(vec3(-inner, y, -0.08), vec3(inner, y, -0.08), vec3(0.0, top, -0.08));
    model.add(palette.wood, gable.colored(srgb(plan.paint) * 0.8));
    let rows = (length / 0.42).ceil() as usize;
    let mut shingles = Geometry::default();
    for side in [-1.0f32, 1.0] {
        for i in 0..rows {
            let t = (i as f32 + 0.5) / rows as f32;
            let (x, height) = (half * (1.0 - t), y - 0.12 + rise * t);
            let row = cuboid(length / rows as f32 + 0.06, 0.035, d + 0.35).turned_z(-side * (slope.to_degrees() - 2.5));
            shingles.append(&row.at(side * x, height + 0.1, -d * 0.5 - 0.22));
        }
    }
    shingles.append(&cuboid(0.2, 0.05, d + 0.35).at(0.0, y + rise + 0.02, -d * 0.5 - 0.22));
    model.add(palette.shingles, shingles);
    let stack = slab(
        [plan.width * 0.22, plan.walls, -d * 0.7],
        [plan.width * 0.22 + 0.55, plan.walls + rise + 0.9, -d * 0.7 + 0.5],
    );
    model.add(palette.brick, stack);
}

/// Doors and windows with their frames.
fn openings(model: &mut Model, palette: &Palette, plan: &Plan) {
    let trim = srgb(plan.trim);
    let count = ((plan.width - 1.6) / 2.1) as usize;
    let spots: Vec<f32> =
        (0..=count).map(|i| (i as f32 - count as f32 * 0.5) * (plan.width - 2.0) / count.max(1) as f32).collect();
    let door = spots.len() / 2;
    for (i, x) in spots.iter().enumerate() {
        if i == door {
            door_at(model, palette, *x, trim);
        } else {
            window_at(model, palette, (*x, 0.85), (1.05, 1.45), trim);
        }
    }
    if plan.storeys > 1 {
        for x in &spots {
            window_at(model, palette, (*x, PORCH.1 + 0.75), (0.95, 1.45), trim);
        }
    }
    // Two windows in each side wall.
    for (side, z) in [(1.0f32, 0.3), (1.0, 0.7), (-1.0, 0.3), (-1.0, 0.7)] {
        let mut window = Model::default();
        window_at(&mut window, palette, (0.0, 0.9), (0.9, 1.3), trim);
        let place = Mat4::from_translation(vec3(side * plan.width * 0.5, 0.0, -plan.depth * z))
            * Mat4::from_rotation_y(side * std::f32::consts::FRAC_PI_2);
        model.append(&window, place);
    }
}

/// A sash window with its lower left corner's middle at (x, y).
fn window_at(model: &mut Model, palette: &Palette, (x, y): (f32, f32), (width, height): (f32, f32), trim: Vec3) {
    let mut frame = Geometry::default();
    for side in [-0.5f32, 0.5] {
        frame.append(&cuboid(0.1, height + 0.1, 0.07).at(x + side * (width + 0.1), y + height * 0.5, 0.03));
    }
    frame.append(&bevel_box(width + 0.34, 0.13, 0.12, 0.02).at(x, y + height + 0.1, 0.045));
    frame.append(&bevel_box(width + 0.3, 0.07, 0.15, 0.015).at(x, y - 0.03, 0.06));
    frame.append(&cuboid(width, 0.05, 0.04).at(x, y + height * 0.5, 0.035));
    frame.append(&cuboid(0.035, height, 0.03).at(x, y + height * 0.5, 0.032));
    model.add(palette.wood, frame.colored(trim));
    let mut pane = Geometry::default();
    let corner = |r: f32, u: f32| vec3(x + r * width * 0.5, y + u * height, 0.026);
    pane.flat_quad([corner(-1.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(-1.0, 1.0)]);
    model.add(palette.glass, pane);
}

fn door_at(model: &mut Model, palette: &Palette, x: f32, trim: Vec3) {
    let mut frame = Geometry::default();
    for side in [-0.5f32, 0.5] {
        frame.append(&cuboid(0.12, 2.2, 0.09).at(x + side * 1.22, 1.1, 0.035));
    }
    frame.append(&bevel_box(1.46, 0.16, 0.14, 0.02).at(x, 2.26, 0.05));
    model.add(palette.wood, frame.colored(trim));
    let mut leaves = Geometry::default();
    for side in [-0.5f32, 0.5] {
        let middle = x + side * 0.55;
        leaves.append(&cuboid(0.54, 2.16, 0.035).at(middle, 1.08, 0.022));
        for y in [0.35, 1.02, 1.66] {
            leaves.append(&bevel_box(0.38, 0.5, 0.03, 0.012).at(middle, y, 0.04));
        }
    }
    model.add(palette.wood, leaves.colored(srgb(0x6b4428)));
    model.add(palette.iron, cylinder(0.03, 0.05, 10).turned_x(90.0).at(x + 0.07, 1.05, 0.04));
}

/// Posts, roof, railing and, with two storeys, a balcony.
fn porch(model: &mut Model, palette: &Palette, plan: &Plan) {
    let (w, trim) = (plan.width, srgb(plan.trim));
    let depth = WALK - 0.15;
    let posts = ((w / 2.4).round() as usize).max(2);
    let post_x = |i: usize| (i as f32 / posts as f32 - 0.5) * (w - 0.3);
    let mut wood = Geometry::default();
    let deck = if plan.storeys > 1 { PORCH.1 - 0.06 } else { PORCH.0 };
    for i in 0..=posts {
        let x = post_x(i);
        wood.append(&bevel_box(0.13, deck, 0.13, 0.02).at(x, deck * 0.5, depth - 0.1));
        wood.append(&bevel_box(0.2, 0.18, 0.2, 0.015).at(x, 0.09, depth - 0.1));
        wood.append(&bevel_box(0.2, 0.09, 0.2, 0.015).at(x, deck - 0.12, depth - 0.1));
        for side in [-1.0f32, 1.0] {
            let brace = [vec3(x, deck - 0.55, depth - 0.1), vec3(x + side * 0.45, deck - 0.05, depth - 0.1)];
            let profile = [vec2(-0.03, -0.03), vec2(0.03, -0.03), vec2(0.03, 0.03), vec2(-0.03, 0.03)];
            if (x + side * 0.45).abs() < w * 0.5 {
                wood.append(&sweep(&brace, &profile, false, |_| 1.0));
            }
        }
    }
    wood.append(&cuboid(w, 0.16, 0.12).at(0.0, deck + 0.02, depth - 0.1));
    let rafters = (w / 0.7) as usize;
    if plan.storeys > 1 {
        wood.append(&bevel_box(w + 0.2, 0.1, depth + 0.15, 0.015).at(0.0, PORCH.1 + 0.05, depth * 0.5));
        railing(&mut wood, (-w * 0.5 + 0.1, w * 0.5 - 0.1), (PORCH.1 + 0.1, depth - 0.05));
    } else {
        let slope = ((PORCH.1 - PORCH.0) / depth).atan();
        let length = depth / slope.cos() + 0.3;
        for i in 0..=rafters {
            let x = (i as f32 / rafters as f32 - 0.5) * (w - 0.1);
            let rafter = cuboid(0.06, 0.1, length - 0.1).turned_x(slope.to_degrees());
            wood.append(&rafter.at(x, (PORCH.0 + PORCH.1) * 0.5 + 0.08, depth * 0.5 + 0.03));
        }
        let rows = 6;
        for i in 0..rows {
            let t = (i as f32 + 0.5) / rows as f32;
            let row = cuboid(w + 0.24, 0.03, length / rows as f32 + 0.05).turned_x(slope.to_degrees() - 2.0);
            let place = vec3(0.0, PORCH.1 + 0.2 - (PORCH.1 - PORCH.0) * t, depth * t + 0.03);
            model.add(palette.shingles, row.at(place.x, place.y, place.z));
        }
    }
    // Rails between the posts left and right of the way to the door.
    for i in 0..posts {
        let (a, b) = (post_x(i), post_x(i + 1));
        if (a + b).abs() > 0.6 {
            railing(&mut wood, (a + 0.08, b - 0.08), (0.0, depth - 0.1));
        }
    }
    model.add(palette.wood, wood.colored(trim));
}

/// A railing of 0.95 m from x = a to b at height y and depth z.
fn railing(out: &mut Geometry, (a, b): (f32, f32), (y, z): (f32, f32)) {
    let middle = (a + b) * 0.5;
    out.append(&bevel_box(b - a, 0.07, 0.09, 0.015).at(middle, y + 0.93, z));
    out.append(&cuboid(b - a, 0.05, 0.06).at(middle, y + 0.14, z));
    let count = ((b - a) / 0.19) as usize;
    for i in 1..count {
        let x = a + (b - a) * i as f32 / count as f32;
        out.append(&cuboid(0.035, 0.76, 0.035).at(x, y + 0.53, z));
    }
}

/// A walk of single planks, from x = −`length`/2 to +`length`/2, z from 0 to [`WALK`], its surface at y = 0.
pub(super) fn boardwalk(palette: &Palette, length: f32, random: &mut Random) -> Model {
    let mut planks = Geometry::default();
    let count = (length / 0.24) as usize;
    for i in 0..count {
        let x = ((i as f32 + 0.5) / count as f32 - 0.5) * length;
        let reach = WALK + random.range(-0.04, 0.05);
        let tone = srgb(0xa08a6e) * random.range(0.65, 1.05);
        let plank = cuboid(length / count as f32 - 0.012, 0.045, reach).turned_y(random.range(-0.25, 0.25));
        planks.append(&plank.at(x, -0.022 + random.range(-0.006, 0.004), reach * 0.5).colored(tone));
    }
    let mut edge = cuboid(length, 0.3, 0.06).at(0.0, -0.2, WALK - 0.1);
    edge.append(&cuboid(length, 0.5, 0.06).at(0.0, -0.3, 0.1));
    planks.append(&edge.colored(srgb(0x6f5a44)));
    Model::of(palette.wood, planks)
}

/// The church at the end of the street: a nave with a tower and a spire.
pub(super) fn church(palette: &Palette, random: &mut Random) -> Model {
    let plan = Plan {
        name: "church",
        width: 8.0,
        depth: 13.0,
        walls: 4.2,
        front: 4.25,
        storeys: 1,
        paint: 0xe6e2d8,
        trim: 0xf2efe8,
        porch: false,
        sign: None,
    };
    let mut model = building(palette, &plan, random);
    let paint = srgb(plan.paint);
    // The gable over the front, boarded.
    let mut gable = Geometry::default();
    let rows = 14;
    for i in 0..rows {
        let t = i as f32 / rows as f32;
        let row = cuboid(8.0 * (1.0 - t), 0.19, 0.03).at(0.0, 4.25 + 2.45 * (t + 0.5 / rows as f32), 0.0);
        gable.append(&row.colored(paint * random.range(0.85, 1.0)));
    }
    model.add(palette.wood, gable);
    let tower = (2.4, 8.4);
    let mut shaft = Model::default();
    shaft.add(
        palette.wood,
        slab([-tower.0 * 0.5 + 0.03, -0.6, -tower.0 + 0.03], [tower.0 * 0.5 - 0.03, tower.1, -0.03])
            .colored(paint * 0.6),
    );
    for (turn, x, z) in [(0.0, 0.0, 0.0), (90.0, 1.2, -1.2), (-90.0, -1.2, -1.2), (180.0, 0.0, -2.4)] {
        shaft.add(palette.wood, boards(tower.0, tower.1, 0.19, paint, random).turned_y(turn).at(x, 0.0, z));
    }
    for y in [5.2, 6.9] {
        window_at(&mut shaft, palette, (0.0, y), (0.8, 1.05), srgb(plan.trim));
    }
    door_at(&mut shaft, palette, 0.0, srgb(plan.trim));
    shaft.add(palette.wood, bevel_box(2.75, 0.2, 2.75, 0.03).at(0.0, tower.1 + 0.1, -1.2).colored(paint));
    let spire = frustum(1.85, 0.0, 4.6, 4).turned_y(45.0).at(0.0, tower.1 + 0.2, -1.2);
    shaft.add(palette.shingles, spire);
    let mut cross = cuboid(0.09, 1.1, 0.09).at(0.0, tower.1 + 5.2, -1.2);
    cross.append(&cuboid(0.6, 0.09, 0.09).at(0.0, tower.1 + 5.4, -1.2));
    shaft.add(palette.iron, cross);
    model.append(&shaft, Mat4::from_translation(vec3(0.0, 0.0, 1.3)));
    for i in 0..3 {
        let step = cuboid(2.2, 0.16, 0.4).at(0.0, -0.08 - 0.16 * i as f32, 1.45 + 0.3 * i as f32);
        model.add(palette.wood, step.colored(srgb(0x8d8578)));
    }
    model
}

/// A water tower: a tank of staves on braced legs, `height` to the tank's floor, standing on y = 0.
pub(super) fn water_tower(palette: &Palette, height: f32, random: &mut Random) -> Model {
    let mut wood = Geometry::default();
    let bar = [vec2(-0.1, -0.1), vec2(0.1, -0.1), vec2(0.1, 0.1), vec2(-0.1, 0.1)];
    let foot = |i: usize, y: f32| {
        let (x, z) = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0f32)][i % 4];
        let spread = 1.75 - 0.4 * y / height;
        vec3(x * spread, y, z * spread)
    };
    for i in 0..4 {
        wood.append(&sweep(&[foot(i, -0.5), foot(i, height)], &bar, false, |_| 1.0));
        for (low, high) in [(0.3, 0.5), (0.5, 0.95)] {
            let thin = bar.map(|p| p * 0.55);
            wood.append(&sweep(&[foot(i, height * low), foot(i + 1, height * high)], &thin, false, |_| 1.0));
            wood.append(&sweep(&[foot(i + 1, height * low), foot(i, height * high)], &thin, false, |_| 1.0));
            wood.append(&sweep(&[foot(i, height * high), foot(i + 1, height * high)], &thin, false, |_| 1.0));
        }
    }
    let mut out = wood.colored(srgb(0x8a7358));
    out.append(&cuboid(3.6, 0.18, 3.6).at(0.0, height + 0.09, 0.0).colored(srgb(0x7a644b)));
    let staves = 36;
    for i in 0..staves {
        let tone = srgb(0x93764f) * random.range(0.75, 1.05);
        let stave = cuboid(0.285, 2.6, 0.06).at(0.0, height + 1.48, 1.6).turned_y(360.0 * i as f32 / staves as f32);
        out.append(&stave.colored(tone));
    }
    let mut model = Model::of(palette.wood, out);
    for y in [0.4, 1.2, 2.2] {
        let ring: Vec<Vec3> = circle(1.645, 40).iter().map(|p| vec3(p.x, height + 0.18 + y, -p.y)).collect();
        let band = [vec2(-0.012, -0.03), vec2(0.012, -0.03), vec2(0.012, 0.03), vec2(-0.012, 0.03)];
        model.add(palette.iron, super::super::kit::loop_sweep(&ring, &band, false));
    }
    model.add(palette.shingles, frustum(1.95, 0.0, 1.1, 24).at(0.0, height + 2.75, 0.0));
    model
}

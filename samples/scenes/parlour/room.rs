//! What bounds the room: walls, floor and ceiling with their mouldings and beams, fireplace, windows and door.

use super::super::kit::{
    Geometry, Model, Opening, Stage, at, bevel_box, bricks, circle, cuboid, cylinder, moulding, picture_frame, placed,
    slab, sphere, srgb, sweep, terrain, torus, value_noise, wall,
};
use super::{HALF, HEIGHT, Palette};
use glam::{Vec2, Vec3, vec2, vec3};

/// Depth of the beams under the ceiling.
pub(super) const BEAM: f32 = 0.13;
/// Top of the shelf over the fireplace.
pub(super) const MANTEL: f32 = 1.16;
/// Chimney breast: its middle and half its width (x), and its front (z).
pub(super) const BREAST: (f32, f32, f32) = (-1.0, 0.8, -2.15);
/// Opening of the fireplace: half its width, and its height.
const FIRE: (f32, f32) = (0.42, 0.7);
/// Middle of the door on the wall at +X, and half its width.
const DOOR: (f32, f32) = (-1.62, 0.44);

/// How far before its wall a curtain hangs, clear of the sill.
const CURTAIN: f32 = 0.175;

/// One box seen from within, each side with its paint, and what runs along it.
pub(super) fn shell(stage: &mut Stage, palette: &Palette) {
    let (x, z) = HALF;
    let mut model = Model::default();
    let mut side = |material: u32, corners: [[f32; 3]; 4]| {
        let mut quad = Geometry::default();
        quad.flat_quad(corners.map(Vec3::from));
        model.add(material, quad);
    };
    let y = HEIGHT;
    side(palette.floor, [[-x, 0.0, z], [x, 0.0, z], [x, 0.0, -z], [-x, 0.0, -z]]);
    side(palette.ceiling, [[-x, y, -z], [x, y, -z], [x, y, z], [-x, y, z]]);
    side(palette.wall, [[-x, 0.0, -z], [x, 0.0, -z], [x, y, -z], [-x, y, -z]]);
    side(palette.wall, [[x, 0.0, z], [-x, 0.0, z], [-x, y, z], [x, y, z]]);
    side(palette.red, [[-x, 0.0, z], [-x, 0.0, -z], [-x, y, -z], [-x, y, z]]);
    side(palette.green, [[x, 0.0, -z], [x, 0.0, z], [x, y, z], [x, y, -z]]);
    stage.add("shell", model);

    let mut beams = Geometry::default();
    for i in -2..=2 {
        // Ends and top lie within the walls and the ceiling.
        beams.append(&bevel_box(0.13, BEAM + 0.02, 2.0 * z + 0.02, 0.012).at(
            1.05 * i as f32,
            y - 0.5 * BEAM + 0.01,
            0.0,
        ));
    }
    stage.add("beams", Model::of(palette.beam, beams));
    stage.add("mouldings", Model::of(palette.trim, mouldings()));
}

/// Skirting, dado rail and cornice.
fn mouldings() -> Geometry {
    let (x, z) = HALF;
    let (middle, wide, front) = BREAST;
    let (left, right) = (middle - wide, middle + wide);
    // In plan, as seen from above with the wall at -Z on top: then the room lies to the left of the way.
    let plan = |points: &[(f32, f32)]| -> Vec<Vec2> { points.iter().map(|&(x, z)| vec2(x, -z)).collect() };
    let casing = DOOR.1 + 0.05;
    let ways = [
        plan(&[(x, DOOR.0 - casing), (x, -z), (right, -z), (right, front), (middle + 0.58, front)]),
        plan(&[(middle - 0.58, front), (left, front), (left, -z), (-x, -z), (-x, z), (x, z), (x, DOOR.0 + casing)]),
    ];
    let skirting = [(0.02, 0.0), (0.02, 0.1), (0.014, 0.118), (0.014, 0.128), (0.008, 0.14), (0.0, 0.14)];
    let rail = [(0.0, 0.86), (0.012, 0.866), (0.018, 0.88), (0.03, 0.894), (0.03, 0.908), (0.022, 0.918), (0.0, 0.92)];
    let mut out = Geometry::default();
    for (way, profile) in ways.iter().flat_map(|way| [(way, skirting.as_slice()), (way, rail.as_slice())]) {
        let profile: Vec<Vec2> = profile.iter().map(|&(d, y)| vec2(d, y)).collect();
        out.append(&moulding(way, false, &profile));
    }
    let around = plan(&[(-x, z), (x, z), (x, -z), (right, -z), (right, front), (left, front), (left, -z), (-x, -z)]);
    let cornice =
        [(0.0, -0.11), (0.014, -0.1), (0.016, -0.085), (0.03, -0.05), (0.055, -0.026), (0.08, -0.018), (0.085, 0.0)];
    out.append(&moulding(&around, true, &cornice.map(|(d, y)| vec2(d, HEIGHT + y))));
    // Height is across the plane of the plan.
    out.turned_x(-90.0)
}

pub(super) fn brick(stage: &mut Stage) -> u32 {
    stage.textured("brick", &bricks(256, 3, 8, srgb(0x8a4a35), srgb(0x8d8478), 21), 0.66, 0.95)
}

/// Chimney breast with a hearth of brick in a surround of stone.
pub(super) fn fireplace(stage: &mut Stage, palette: &Palette) {
    let (middle, wide, front) = BREAST;
    let (half, high) = FIRE;
    let back = -HALF.1;
    // A little into floor, ceiling and wall, so that no two faces lie in one plane.
    let sunk = 0.01;
    let opening = Opening { left: wide - half, bottom: 0.0, width: 2.0 * half, height: high + sunk };
    let breast = wall(2.0 * wide, HEIGHT + 2.0 * sunk, front - back + sunk, &[opening]);
    stage.mesh_at("chimney breast", Model::of(palette.wall, breast), at(middle - wide, -sunk, front));

    let mut brick = slab([-half - 0.02, -0.01, back - sunk], [half + 0.02, high + 0.02, back + 0.05]);
    for side in [-1.0f32, 1.0] {
        let cheek = bevel_box(0.06, high + 0.03, front - back, 0.003).turned_y(side * 9.0);
        brick.append(&cheek.at(side * (half - 0.015), 0.5 * high, 0.5 * (front + back) - 0.015));
    }
    brick.append(&slab([-half - 0.02, high - 0.04, back], [half + 0.02, high + 0.02, front - 0.02]));
    let mut stone = bevel_box(1.5, 0.045, 0.82, 0.008).at(0.0, 0.0155, front + 0.02);
    for side in [-1.0f32, 1.0] {
        let x = side * (half + 0.1);
        stone.append(&bevel_box(0.2, 0.94, 0.1, 0.008).at(x, 0.49, front + 0.04));
        stone.append(&bevel_box(0.23, 0.15, 0.13, 0.01).at(x, 0.1, front + 0.045));
        stone.append(&bevel_box(0.23, 0.04, 0.13, 0.01).at(x, 0.93, front + 0.045));
        stone.append(&picture_frame(vec2(0.09, 0.56), 0.02, 0.012).at(x, 0.53, front + 0.0895));
    }
    stone.append(&bevel_box(2.0 * half + 0.01, 0.26, 0.085, 0.008).at(0.0, high + 0.12, front + 0.035));
    stone.append(&picture_frame(vec2(0.62, 0.13), 0.02, 0.012).at(0.0, high + 0.13, front + 0.077));
    stone.append(&bevel_box(1.3, 0.14, 0.13, 0.012).at(0.0, 1.0, front + 0.05));
    stone.append(&bevel_box(1.4, 0.05, 0.2, 0.014).at(0.0, 1.09, front + 0.08));
    stone.append(&bevel_box(1.52, 0.05, 0.28, 0.012).at(0.0, MANTEL - 0.025, front + 0.115));
    let mut logs = Geometry::default();
    for (x, y, z, turn, long) in
        [(-0.02, 0.17, -0.14, 4.0, 0.5), (0.04, 0.17, -0.03, -6.0, 0.46), (0.0, 0.26, -0.09, 14.0, 0.44)]
    {
        let log = cylinder(0.05, long, 14).at(0.0, -0.5 * long, 0.0).turned_z(90.0).turned_y(turn);
        logs.append(&log.at(x, y, front + z));
    }
    let mut iron = Geometry::default();
    for side in [-1.0f32, 1.0] {
        let x = side * 0.17;
        iron.append(&slab([x - 0.012, 0.095, front - 0.25], [x + 0.012, 0.12, front + 0.06]));
        iron.append(&slab([x - 0.012, 0.03, front - 0.24], [x + 0.012, 0.1, front - 0.22]));
        iron.append(&cylinder(0.014, 0.26, 12).at(x, 0.035, front + 0.06));
        iron.append(&sphere(0.026, 12, 6).at(x, 0.315, front + 0.06));
    }
    let mut model = Model::of(palette.brick, brick);
    model.add(palette.stone, stone);
    model.add(palette.beam, logs);
    model.add(palette.iron, iron);
    stage.mesh_at("fireplace", model, at(middle, 0.0, 0.0));
}

/// Two windows with panes that show nothing, their sashes, and curtains in folds. It is night outside.
pub(super) fn windows(stage: &mut Stage, palette: &Palette) {
    let (width, height) = (1.0f32, 1.22f32);
    let mut white = picture_frame(vec2(width, height), 0.09, 0.045);
    for (w, h, x, y) in [
        (0.05, height, -0.5 * width + 0.025, 0.0),
        (0.05, height, 0.5 * width - 0.025, 0.0),
        (0.06, height - 0.1, 0.0, 0.0),
        (width - 0.1, 0.05, 0.0, 0.5 * height - 0.025),
        (width - 0.1, 0.05, 0.0, 0.025 - 0.5 * height),
    ] {
        white.append(&cuboid(w, h, 0.036).at(x, y, 0.018));
    }
    for side in [-0.25f32, 0.25] {
        for y in [-0.19f32, 0.19] {
            white.append(&cuboid(0.41, 0.022, 0.024).at(side * (width - 0.05), y, 0.012));
        }
    }
    white.append(&bevel_box(width + 0.22, 0.035, 0.11, 0.01).at(0.0, -0.5 * height - 0.04, 0.045));
    let mut pane = Geometry::default();
    let half = 0.5 * vec2(width, height);
    pane.flat_quad(
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(u, v)| vec3(u * half.x, v * half.y, 0.006)),
    );
    let mut window = Model::of(palette.trim, white);
    window.add(palette.pane, pane);
    let window = stage.mesh("window", window);
    for (i, x) in [-1.45f32, 1.5].into_iter().enumerate() {
        let here = placed(vec3(x, 1.66, HALF.1), 180.0);
        stage.place(&format!("window {}", i + 1), window, here);
        let seed = 3 + 2 * i as u32;
        let mut rail = Geometry::default();
        let long = 1.95f32;
        rail.append(&cylinder(0.014, long, 14).at(0.0, -0.5 * long, 0.0).turned_z(90.0));
        for side in [-1.0f32, 1.0] {
            rail.append(&sphere(0.03, 12, 6).at(side * 0.5 * long, 0.0, 0.0));
            let bracket = [vec3(side * 0.9, 0.0, 0.0), vec3(side * 0.9, 0.0, -CURTAIN)];
            rail.append(&sweep(&bracket, &circle(0.008, 8), true, |_| 1.0));
            for k in 0..6 {
                rail.append(&torus(0.023, 0.004, 8, 4).turned_z(90.0).at(side * (0.48 + 0.085 * k as f32), -0.01, 0.0));
            }
        }
        stage.mesh_at(
            &format!("curtain rail {}", i + 1),
            Model::of(palette.brass, rail),
            here * at(0.0, 0.82, CURTAIN),
        );
        stage.mesh_at(&format!("curtains {}", i + 1), curtains(palette.curtain, seed), here * at(0.0, 0.82, CURTAIN));
    }
}

/// A pair of curtains that hang from a rail at y = 0 to the floor, drawn aside, facing +Z.
fn curtains(cloth: u32, seed: u32) -> Model {
    let height = 1.66 + 0.82 - 0.05;
    let half = 0.5 * height;
    let mut both = Geometry::default();
    for side in [-1.0f32, 1.0] {
        let folds = |p: Vec2| {
            let drift = 1.5 * value_noise(vec2(p.x * 2.3, 0.3), 0, seed);
            // Fuller at the hem (y of the sheet becomes height).
            let low = 0.5 + p.y / height;
            let depth = 0.03 + 0.022 * low;
            depth * (p.x * 62.0 + drift).sin() + 0.014 * low * value_noise(p * vec2(7.0, 1.1), 0, seed ^ 9)
        };
        let (from, to) = if side < 0.0 { (-0.93, -0.46) } else { (0.46, 0.93) };
        let sheet = terrain(vec2(from, -half), vec2(to, half), 72, 6, folds);
        // What faced up faces into the room.
        both.append(&sheet.turned_x(90.0).at(0.0, -half - 0.03, 0.0));
    }
    Model::of(cloth, both)
}

/// A panelled door in its casing, on the wall at +X.
pub(super) fn door(stage: &mut Stage, palette: &Palette) {
    let (along, half) = DOOR;
    let high = 2.06;
    let mut white = bevel_box(2.0 * half - 0.01, high, 0.04, 0.005).at(0.0, 0.5 * high, 0.0);
    for side in [-1.0f32, 1.0] {
        white.append(&bevel_box(0.1, high + 0.02, 0.07, 0.012).at(side * (half + 0.045), 0.5 * high, 0.005));
        white.append(&bevel_box(0.12, 0.16, 0.085, 0.01).at(side * (half + 0.045), 0.08, 0.005));
    }
    white.append(&bevel_box(2.0 * half + 0.24, 0.12, 0.075, 0.012).at(0.0, high + 0.07, 0.005));
    white.append(&bevel_box(2.0 * half + 0.3, 0.03, 0.11, 0.01).at(0.0, high + 0.14, 0.02));
    for side in [-1.0f32, 1.0] {
        for (low, top) in [(0.2, 0.82), (1.0, 1.92)] {
            let size = vec2(0.25, top - low);
            white.append(&picture_frame(size, 0.03, 0.014).at(side * 0.2, 0.5 * (low + top), 0.0195));
        }
    }
    let mut brass = cylinder(0.03, 0.008, 24).turned_x(90.0).at(-half + 0.07, 0.93, 0.02);
    brass.append(&cylinder(0.01, 0.05, 12).turned_x(90.0).at(-half + 0.07, 0.93, 0.02));
    brass.append(&sphere(0.028, 16, 8).at(-half + 0.07, 0.93, 0.08));
    let mut model = Model::of(palette.trim, white);
    model.add(palette.brass, brass);
    stage.mesh_at("door", model, placed(vec3(HALF.0, 0.0, along), -90.0));
}

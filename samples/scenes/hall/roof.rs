//! The open roof: trusses on the columns, purlins, rafters, boards, slates.

use super::super::kit::{Geometry, Model, Stage, bevel_box, extrude};
use super::{BAYS, COLUMN, HALF, HEAD, Palette, bay};
use glam::{Mat4, Vec3, vec2, vec3};

/// Rise of the roof a metre.
const SLOPE: f32 = 0.84;
/// Thickness of boards and slates together, measured upright.
pub(super) const THICK: f32 = 0.3;
/// Top of the arcade's wall, and the underside of the tie beams.
pub(super) const ARCADE_TOP: f32 = 6.35;
const TIE: f32 = HEAD - 0.42;

/// Height of the boards' underside at `z`.
pub(super) fn underside(z: f32) -> f32 {
    HEAD - (z.abs() - HALF.1) * SLOPE
}

/// A beam of `width` × `height` between the middles of its ends, grain along it.
fn beam(from: Vec3, to: Vec3, width: f32, height: f32) -> Geometry {
    let along = (to - from).normalize_or(Vec3::X);
    let side = along.cross(Vec3::Y).normalize_or(Vec3::Z);
    let up = side.cross(along);
    let turn = Mat4::from_cols(along.extend(0.0), up.extend(0.0), side.extend(0.0), ((from + to) * 0.5).extend(1.0));
    bevel_box((to - from).length(), height, width, 0.012).transformed(turn)
}

pub(super) fn roof(stage: &mut Stage, palette: &Palette) {
    let length = HALF.0 + 1.1;
    // Two sheets meet in one solid, so that the ridge has no gap.
    let sheet = |reach: f32, low: f32, high: f32| {
        let at = |z: f32, rise: f32| vec2(z, underside(z) + rise);
        let corners = [at(-reach, low), at(0.0, low), at(reach, low), at(reach, high), at(0.0, high), at(-reach, high)];
        extrude(&corners, 2.0 * length).turned_y(90.0).at(-length, 0.0, 0.0)
    };
    stage.add("roof boards", Model::of(palette.boards, sheet(HALF.1 + 1.2, 0.0, 0.08)));
    let slates = sheet(HALF.1 + 1.26, 0.07, THICK);
    let ridge = bevel_box(2.0 * length, 0.16, 0.4, 0.05).at(0.0, underside(0.0) + THICK, 0.0);
    stage.add("slates", Model::of(palette.slates, slates));
    stage.add("ridge", Model::of(palette.iron, ridge));

    let mut rafters = Geometry::default();
    let count = 37;
    for i in 0..count {
        let x = (HALF.0 - 0.1) * (2.0 * i as f32 / (count - 1) as f32 - 1.0);
        for side in [-1.0, 1.0] {
            let foot = HALF.1 + 0.1;
            let at = |z: f32| vec3(x, underside(z) - 0.085, side * z);
            rafters.append(&beam(at(foot), at(-0.02f32), 0.09, 0.15));
        }
    }
    stage.add("rafters", Model::of(palette.oak, rafters));
    let mut long = Geometry::default();
    let reach = HALF.0 + 0.15;
    for (z, drop) in [(1.75, 0.3), (3.5, 0.3), (HALF.1 - 0.08, 0.22)] {
        for side in [-1.0, 1.0] {
            let y = underside(z) - drop;
            long.append(&beam(vec3(-reach, y, side * z), vec3(reach, y, side * z), 0.18, 0.22));
        }
    }
    let top = underside(0.0) - 0.26;
    long.append(&beam(vec3(-reach, top, 0.0), vec3(reach, top, 0.0), 0.14, 0.3));
    for side in [-1.0, 1.0] {
        let (y, z) = (ARCADE_TOP + 0.12, side * COLUMN);
        long.append(&beam(vec3(-reach, y, z), vec3(reach, y, z), 0.56, 0.26));
    }
    stage.add("purlins", Model::of(palette.oak, long));
    let truss = stage.mesh("truss", Model::of(palette.oak, truss()));
    for i in 1..BAYS {
        stage.place(&format!("truss {i}"), truss, Mat4::from_translation(vec3(bay(i), 0.0, 0.0)));
    }
}

/// A tie beam, a king post, principal rafters, struts, and posts with braces on the arcades; in the plane x = 0.
fn truss() -> Geometry {
    let middle = TIE + 0.17;
    let foot = HALF.1 + 0.3;
    let mut out = beam(vec3(0.0, middle, -foot), vec3(0.0, middle, foot), 0.28, 0.34);
    out.append(&beam(vec3(0.0, middle, 0.0), vec3(0.0, underside(0.0) - 0.2, 0.0), 0.24, 0.24));
    let low = |z: f32| underside(z) - 0.5;
    for side in [-1.0, 1.0] {
        let at = |z: f32, y: f32| vec3(0.0, y, side * z);
        out.append(&beam(at(4.85, low(4.75)), at(0.02, low(0.0)), 0.2, 0.24));
        out.append(&beam(at(0.05, middle + 0.6), at(1.9, low(1.9) - 0.02), 0.16, 0.18));
        out.append(&beam(at(0.05, middle + 1.9), at(0.95, low(0.95) - 0.02), 0.14, 0.16));
        out.append(&beam(at(COLUMN, ARCADE_TOP + 0.2), at(COLUMN, middle), 0.26, 0.26));
        out.append(&beam(at(COLUMN, middle), at(COLUMN, low(COLUMN)), 0.18, 0.18));
        for way in [-1.0, 1.0] {
            // Bent braces from the post to the tie beam.
            let (from, to) = (at(COLUMN + way * 0.05, ARCADE_TOP + 0.42), at(COLUMN + way * 1.0, TIE + 0.02));
            let bend = at(COLUMN + way * 0.35, TIE - 0.28);
            let point = |t: f32| from.lerp(bend, t).lerp(bend.lerp(to, t), t);
            for k in 0..6 {
                let [a, b] = [k, k + 1].map(|k| point(k as f32 / 6.0));
                let over = (b - a).normalize_or(Vec3::Y) * 0.012;
                out.append(&beam(a - over, b + over, 0.12, 0.15));
            }
        }
    }
    out
}

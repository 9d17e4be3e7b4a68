//! The ground around the hall: lawn, path, a low wall, trees and bushes.

use super::super::kit::{
    Geometry, Model, Picture, Random, Stage, at, bevel_box, bricks, extrude, fbm, mottled, sheet, sphere, srgb, sweep,
    terrain, value_noise,
};
use super::{BAYS, GROUND, HALF, Palette, THICKNESS, bay};
use glam::{Mat4, Vec2, Vec3, vec2, vec3};
use std::f32::consts::TAU;

/// Half the length (x) and width (z) of the yard inside the low wall, and half the width of the path and the gate.
const YARD: (f32, f32) = (24.0, 17.0);
const PATH: f32 = 1.3;

pub(super) fn outside(stage: &mut Stage, palette: &Palette) {
    ground(stage);
    low_wall(stage);
    feet(stage, palette);
    plants(stage);
}

fn ground(stage: &mut Stage) {
    let blades = Picture::new(256, 256, |uv| {
        let fine = value_noise(uv * vec2(96.0, 96.0), 96, 201);
        let broad = fbm(uv * 6.0, 6, 4, 202);
        (srgb(0x4c602e).lerp(srgb(0x2e4420), 0.5 * fine + 0.6 * broad), 0.006 * fine)
    });
    let lawn = stage.textured("lawn", &blades, 2.6, 1.0);
    let reach = 60.0;
    let rise = |p: Vec2| {
        // Level around the hall and along the path, gentle swells beyond.
        let far = ((p.x.abs() - 15.0).max(0.0) + (p.y.abs() - 9.0).max(0.0)).min(25.0) / 25.0;
        let away = (p.y.abs() / 6.0).min(1.0);
        GROUND + 1.6 * far * away * (fbm(p * 0.05, 0, 3, 203) - 0.35)
    };
    let sheet_of_grass = terrain(vec2(-reach, -reach), vec2(reach, reach), 60, 60, rise);
    stage.add("lawn", Model::of(lawn, sheet_of_grass));
    let stones = mottled(256, 64, srgb(0x9c917c), srgb(0x766d5f), 0.006, 204);
    let gravel = stage.textured("gravel", &stones, 1.6, 0.95);
    // From the gate to the door.
    let path = sheet(40.0, 2.0 * PATH, 20, 2).at(-HALF.0 - THICKNESS - 20.0, GROUND + 0.03, 0.0);
    stage.add("path", Model::of(gravel, path));
}

/// Rough stones between the yard and the fields, a gate towards the west.
fn low_wall(stage: &mut Stage) {
    let rubble = stage.textured("rubble", &bricks(256, 3, 6, srgb(0x9a9484), srgb(0x7d786c), 205), 1.2, 0.95);
    let mut out = Geometry::default();
    let (x, z) = YARD;
    let mut run = |from: Vec2, to: Vec2| {
        let (middle, along) = ((from + to) * 0.5, to - from);
        let turn = -along.to_angle().to_degrees();
        let body = bevel_box(along.length(), 1.6, 0.45, 0.03).turned_y(turn);
        out.append(&body.at(middle.x, GROUND, middle.y));
        let cap = bevel_box(along.length() + 0.04, 0.12, 0.58, 0.03).turned_y(turn);
        out.append(&cap.at(middle.x, GROUND + 0.85, middle.y));
    };
    run(vec2(-x, -z), vec2(x, -z));
    run(vec2(-x, z), vec2(x, z));
    run(vec2(x, -z), vec2(x, z));
    run(vec2(-x, -z), vec2(-x, -PATH - 0.3));
    run(vec2(-x, PATH + 0.3), vec2(-x, z));
    for side in [-1.0, 1.0] {
        let (post, top) = (bevel_box(0.7, 2.6, 0.7, 0.03), bevel_box(0.86, 0.16, 0.86, 0.04));
        out.append(&post.at(-x, GROUND + 0.2, side * (PATH + 0.3)));
        out.append(&top.at(-x, GROUND + 1.56, side * (PATH + 0.3)));
    }
    stage.add("low wall", Model::of(rubble, out));
}

/// A plinth around the hall, buttresses at the columns, a step before the door.
fn feet(stage: &mut Stage, palette: &Palette) {
    let (x, z) = (HALF.0 + THICKNESS, HALF.1 + THICKNESS);
    let mut out = Geometry::default();
    // Outline of a buttress across the wall: shallow, so that it leaves the windows the sun.
    let steps =
        [(-0.2, -0.5), (0.75, -0.5), (0.75, 2.5), (0.42, 3.0), (0.42, 5.6), (0.0, 6.3), (-0.2, 6.3)].map(Vec2::from);
    for side in [-1.0, 1.0] {
        out.append(&bevel_box(2.0 * x + 0.2, 1.0, 0.3, 0.04).at(0.0, 0.0, side * z));
        let (from, to) = (1.5, z + 0.1);
        out.append(&bevel_box(0.3, 1.0, to - from, 0.04).at(-x, 0.0, side * 0.5 * (from + to)));
        let from = 2.9;
        out.append(&bevel_box(0.3, 1.0, to - from, 0.04).at(x, 0.0, side * 0.5 * (from + to)));
        for i in 0..=BAYS {
            let place = bay(i).clamp(-x + 0.42, x - 0.42);
            let buttress = extrude(&steps, 0.6).turned_y(-90.0 * side);
            let buttress = buttress.at(place + 0.3 * side, 0.0, side * z);
            out.append(&buttress);
        }
    }
    out.append(&bevel_box(0.9, 0.3, 3.2, 0.03).at(-x - 0.4, GROUND, 0.0));
    stage.add("plinth and buttresses", Model::of(palette.ashlar, out));
}

fn plants(stage: &mut Stage) {
    let leaves = mottled(128, 24, srgb(0x4f6d30), srgb(0x28431a), 0.03, 206);
    let leaves = stage.textured("foliage", &leaves, 0.9, 0.95);
    let bark = stage.textured("bark", &mottled(128, 20, srgb(0x6a5640), srgb(0x463627), 0.01, 207), 0.8, 0.95);
    let mut random = Random::new(55);
    let trees: Vec<u32> = (0..3)
        .map(|i| {
            let mut model = Model::default();
            tree(&mut model, leaves, bark, 210 + 10 * i, &mut random);
            stage.mesh(&format!("tree {}", i + 1), model)
        })
        .collect();
    // None stands between the sun and the windows.
    let places = [
        (-19.0, -13.0),
        (-9.0, -14.5),
        (2.0, -13.5),
        (12.0, -14.0),
        (20.5, -9.0),
        (21.5, 5.0),
        (-15.0, 15.0),
        (-36.0, 8.0),
        (-38.0, -12.0),
        (34.0, -18.0),
        (-6.0, -29.0),
        (14.0, -31.0),
        (-28.0, -27.0),
        (38.0, 12.0),
    ];
    for (i, (x, z)) in places.into_iter().enumerate() {
        let turn =
            Mat4::from_rotation_y(random.range(0.0, TAU)) * Mat4::from_scale(Vec3::splat(random.range(0.8, 1.2)));
        stage.place(&format!("tree {}", i + 1), trees[i % 3], at(x, GROUND - 0.1, z) * turn);
    }
    let bush = stage.mesh("bush", Model::of(leaves, lump(0.8, (16, 9), 240)));
    for i in 0..18 {
        let side = if i % 3 == 0 { -1.0 } else { 1.0 };
        let place = vec3(-21.0 + 2.45 * i as f32, GROUND + 0.25, side * (YARD.1 - random.range(0.9, 1.6)));
        let turn =
            Mat4::from_rotation_y(random.range(0.0, TAU)) * Mat4::from_scale(Vec3::splat(random.range(0.7, 1.3)));
        stage.place(&format!("bush {}", i + 1), bush, Mat4::from_translation(place) * turn);
    }
}

/// A rough ball of leaves.
fn lump(size: f32, (segments, rings): (usize, usize), seed: u32) -> Geometry {
    sphere(size, segments, rings).displaced(|p| {
        let q = p / size;
        let broad = fbm(vec2(q.x * 2.1 + q.z * 1.3, q.y * 2.3 - q.z * 1.1), 0, 2, seed);
        let fine = value_noise(vec2(q.x * 7.0 - q.z * 3.0, q.y * 7.0 + q.z * 5.0), 0, seed ^ 3);
        p * (0.72 + 0.4 * broad + 0.22 * fine)
    })
}

/// A trunk with four limbs and a crown of lumps, about 6 m high.
fn tree(model: &mut Model, leaves: u32, bark: u32, seed: u32, random: &mut Random) {
    let ring: Vec<Vec2> = (0..10).map(|i| Vec2::from_angle(TAU * i as f32 / 10.0) * 0.22).collect();
    let trunk = [vec3(0.0, 0.0, 0.0), vec3(0.03, 1.0, 0.02), vec3(0.1, 2.2, -0.04), vec3(0.05, 3.6, 0.05)];
    model.add(bark, sweep(&trunk, &ring, true, |i| 1.15 - 0.2 * i as f32));
    for k in 0..4 {
        let turn = TAU * k as f32 / 4.0 + random.range(-0.4, 0.4);
        let out = vec3(turn.cos(), 0.0, turn.sin());
        let limb = [vec3(0.06, 1.9, 0.0), vec3(0.06, 2.5, 0.0) + out * 0.5, vec3(0.06, 3.4, 0.0) + out * 1.2];
        model.add(bark, sweep(&limb, &ring, true, |i| 0.5 - 0.12 * i as f32));
        let size = random.range(1.1, 1.4);
        let crown = out * random.range(1.1, 1.4) + Vec3::Y * random.range(3.2, 4.0);
        model.add(leaves, lump(size, (17, 9), seed + k).at(crown.x, crown.y, crown.z));
    }
    model.add(leaves, lump(1.6, (18, 9), seed + 7).at(0.0, 4.7, 0.0));
}

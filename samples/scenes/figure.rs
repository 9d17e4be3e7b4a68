//! Everything that moves: a walking figure (skin), a sculpture that changes shape (morph targets), turning rings, a
//! bouncing ball and a clock (nodes, all three interpolations).
//!
//! Each motion is an animation of its own and a loop: `walk` 1 s, `path` 12 s, `sculpture` 8 s, `rings` 8 s, `ball`
//! 1.2 s, `clock` 12 s. All of them together repeat after 24 s.

use super::kit::{
    Geometry, GradientSky, Model, Picture, Stage, at, bevel_box, circle, cuboid, cylinder, frustum, lathe, loop_sweep,
    mottled, placed, slab, sphere, srgb, value_noise, wall,
};
use glam::{Mat4, Quat, Vec3, vec2, vec3};
use lucerna::scene::{Animation, Channel, Interpolation, Keys, MorphTarget, Node, Scene, Skin, Transform};
use std::f32::consts::{FRAC_PI_2, TAU};

mod body;
mod skeleton;
mod walk;

use skeleton::JOINTS;

/// Cycles of walking in one round, which fixes the radius of the path.
const CYCLES: f32 = 12.0;

pub(super) fn build() -> Scene {
    let mut stage = Stage::new("figure");
    court(&mut stage);
    walker(&mut stage);
    sculpture(&mut stage);
    ball(&mut stage);
    clock(&mut stage);

    let to_sun = vec3(0.62, 0.62, 0.48).normalize();
    stage.sun(to_sun, srgb(0xfff1da), 3.4);
    let sky = GradientSky {
        zenith: vec3(0.1, 0.19, 0.4),
        horizon: vec3(0.42, 0.5, 0.58),
        ground: vec3(0.2, 0.18, 0.15),
        to_sun,
        glow: vec3(0.5, 0.42, 0.3),
    };
    stage.scene.environment = Some(sky.environment("clear sky", 256, 128));

    stage.camera("court", [4.3, 2.3, 5.2], [-0.3, 0.85, -0.4], 42.0);
    stage.camera("eye level", [0.6, 1.55, 5.4], [0.0, 1.1, 0.0], 40.0);
    stage.camera("above", [-2.8, 6.4, 4.6], [0.0, 0.5, 0.0], 44.0);
    stage.camera("sculpture", [1.1, 1.75, 2.7], [0.0, 1.45, 0.0], 42.0);
    follower(&mut stage);
    stage.finish()
}

/// Radius of the walker's path.
fn radius() -> f32 {
    CYCLES * walk::STRIDE / TAU
}

/// A paved court with two coloured walls, columns and a bench.
fn court(stage: &mut Stage) {
    let paving = Picture::new(256, 256, |uv| {
        let cell = (uv * 4.0).floor();
        let inside = (uv * 4.0).fract();
        let edge = inside.min(vec2(1.0, 1.0) - inside).min_element();
        let joint = ((edge - 0.012) / 0.02).clamp(0.0, 1.0);
        let tone = value_noise(cell * 3.3, 0, 12);
        let rough = value_noise(uv * 64.0, 64, 13) * 0.5 + value_noise(uv * 16.0, 16, 14) * 0.5;
        let stone = srgb(0xb9ae9c).lerp(srgb(0x9d9384), tone) * (0.86 + 0.24 * rough);
        (stone * (0.5 + 0.5 * joint), 0.004 * joint + 0.001 * rough)
    });
    let paving = stage.textured("paving", &paving, 2.4, 0.85);
    stage.add("ground", Model::of(paving, slab([-4.5, -0.3, -4.0], [4.5, 0.0, 4.5])));
    let ochre = stage.textured("ochre plaster", &mottled(128, 12, srgb(0xd59a4a), srgb(0xc48a3f), 0.003, 3), 2.0, 0.95);
    stage.add("back wall", Model::of(ochre, wall(9.0, 3.0, 0.3, &[]).at(-4.5, 0.0, -3.7)));
    let teal = stage.textured("teal plaster", &mottled(128, 12, srgb(0x3f8f92), srgb(0x357d80), 0.003, 4), 2.0, 0.95);
    stage.add("left wall", Model::of(teal, wall(7.7, 3.0, 0.3, &[]).turned_y(90.0).at(-4.2, 0.0, 4.0)));

    let stone = stage.paint("limestone", 0xd8d0c0, 0.8);
    let cap = stage.mesh("coping", Model::of(stone, cuboid(1.0, 0.1, 0.4)));
    stage.place("back coping", cap, at(0.0, 3.05, -3.85) * Mat4::from_scale(vec3(9.0, 1.0, 1.0)));
    let along = placed(vec3(-4.35, 3.05, 0.0), 90.0) * Mat4::from_scale(vec3(7.99, 1.0, 1.0));
    stage.place("left coping", cap, along);
    let column = stage.mesh("column", Model::of(stone, column()));
    for (i, (x, z)) in [(-3.2, -3.0), (-1.1, -3.0), (1.1, -3.0), (3.2, -3.0)].into_iter().enumerate() {
        stage.place(&format!("column {}", i + 1), column, at(x, 0.0, z));
    }
    stage.add("beam", Model::of(stone, bevel_box(7.2, 0.3, 0.5, 0.02).at(0.0, 2.75, -3.0)));
    let mut bench = bevel_box(0.45, 0.08, 1.8, 0.015).at(0.0, 0.44, 0.0);
    for z in [-0.65, 0.65] {
        bench.append(&bevel_box(0.36, 0.4, 0.16, 0.015).at(0.0, 0.2, z));
    }
    stage.mesh_at("bench", Model::of(stone, bench), at(-3.75, 0.0, 0.6));
}

/// A round column of 2.6 m with base and capital.
fn column() -> Geometry {
    let profile = [
        (0.0, 0.0),
        (0.25, 0.0),
        (0.25, 0.08),
        (0.21, 0.12),
        (0.22, 0.16),
        (0.18, 0.2),
        (0.178, 0.9),
        (0.155, 2.36),
        (0.175, 2.4),
        (0.165, 2.43),
        (0.23, 2.52),
        (0.24, 2.6),
        (0.0, 2.6),
    ];
    lathe(&profile.map(|(r, y)| vec2(r, y)), 32, 30.0)
}

/// Evenly spaced keys of a quarter turn each, from `start` radians about `axis`, `turns` times in `seconds`.
fn spin(node: u32, (axis, start): (Vec3, f32), turns: i32, seconds: f32) -> Channel {
    let steps = 4 * turns.unsigned_abs();
    let key = |i: u32| Quat::from_axis_angle(axis, start + FRAC_PI_2 * i as f32 * turns.signum() as f32);
    Channel {
        node,
        interpolation: Interpolation::Linear,
        times: (0..=steps).map(|i| seconds * i as f32 / steps as f32).collect(),
        values: Keys::Rotation((0..=steps).map(key).collect()),
    }
}

/// The walking figure: a pivot that turns, the figure at its end, bones and skin.
pub(super) fn walker(stage: &mut Stage) {
    let pivot = stage.node(Node { name: "path".to_owned(), ..Node::default() });
    // A turn about +Y carries +X to −Z: the figure, which faces +Z, is turned to face −Z.
    let local = super::kit::trs(placed(vec3(radius(), 0.0, 0.0), 180.0));
    let figure = stage.node(Node { name: "figure".to_owned(), parent: Some(pivot), local, ..Node::default() });
    let first = stage.scene.nodes.len() as u32;
    let index = |joint: skeleton::Joint| JOINTS.iter().position(|j| *j == joint).map_or(0, |i| i as u32);
    for joint in JOINTS {
        let (parent, from) = joint.parent().map_or((figure, Vec3::ZERO), |p| (first + index(p), p.place()));
        let local = super::kit::trs(Mat4::from_translation(joint.place() - from));
        stage.node(Node { name: joint.name(), parent: Some(parent), local, ..Node::default() });
    }
    stage.scene.skins.push(Skin {
        name: "figure".to_owned(),
        joints: (0..JOINTS.len() as u32).map(|i| first + i).collect(),
        inverse_bind: JOINTS.map(|j| Mat4::from_translation(-j.place())).to_vec(),
    });
    let cloth = stage.paint("figure", 0xffffff, 0.75);
    let mesh = stage.mesh("figure", Model::of(cloth, body::surface()));
    let primitive = &mut stage.scene.meshes[mesh as usize].primitives[0];
    let (joints, weights) = primitive.positions.iter().map(|p| body::weights(*p)).unzip();
    (primitive.joints, primitive.weights) = (vec![joints], vec![weights]);
    stage.node(Node {
        name: "figure skin".to_owned(),
        parent: Some(figure),
        mesh: Some(mesh),
        skin: Some(0),
        ..Node::default()
    });

    const KEYS: usize = 32;
    let postures: Vec<_> = (0..=KEYS).map(|i| walk::posture((i % KEYS) as f32 / KEYS as f32)).collect();
    let times: Vec<f32> = (0..=KEYS).map(|i| walk::PERIOD * i as f32 / KEYS as f32).collect();
    let rest = JOINTS[0].place();
    let channel =
        |node: u32, values: Keys| Channel { node, interpolation: Interpolation::Linear, times: times.clone(), values };
    let mut channels = vec![channel(first, Keys::Translation(postures.iter().map(|p| rest + p.hips).collect()))];
    for i in 0..JOINTS.len() {
        channels.push(channel(first + i as u32, Keys::Rotation(postures.iter().map(|p| p.rotations[i]).collect())));
    }
    stage.scene.animations.push(Animation { name: "walk".to_owned(), channels });
    let round = spin(pivot, (Vec3::Y, 0.0), 1, CYCLES * walk::PERIOD);
    stage.scene.animations.push(Animation { name: "path".to_owned(), channels: vec![round] });
}

/// A pedestal with a form that changes between ball, soft cube and star, inside three rings that turn in one another.
pub(super) fn sculpture(stage: &mut Stage) {
    let stone = stage.paint("pedestal", 0x8d867b, 0.7);
    let mut pedestal = bevel_box(0.62, 0.12, 0.62, 0.02).at(0.0, 0.06, 0.0);
    pedestal.append(&bevel_box(0.46, 0.68, 0.46, 0.02).at(0.0, 0.46, 0.0));
    pedestal.append(&bevel_box(0.6, 0.1, 0.6, 0.02).at(0.0, 0.85, 0.0));
    pedestal.append(&frustum(0.09, 0.02, 0.32, 24).at(0.0, 0.9, 0.0));
    stage.add("pedestal", Model::of(stone, pedestal));

    let coral = stage.paint("coral", 0xe65a4f, 0.3);
    let ball = sphere(0.27, 72, 48);
    let cube = |p: Vec3| {
        let soft = |c: f32| c.signum() * (c.abs() / 0.27).powf(0.4) * 0.23;
        vec3(soft(p.x), soft(p.y), soft(p.z))
    };
    let star = |p: Vec3| {
        let d = p / 0.27;
        let wave =
            (3.0 * d.z.atan2(d.x)).cos() * (1.0 - d.y * d.y).powf(1.5) + 0.6 * (4.0 * d.y * d.y - 3.0) * d.y * 0.5;
        p * (0.92 + 0.55 * wave)
    };
    let shapes = [ball.clone().displaced(cube), ball.clone().displaced(star)];
    let mesh = stage.mesh("sculpture", Model::of(coral, ball));
    let mesh_data = &mut stage.scene.meshes[mesh as usize];
    let base = &mut mesh_data.primitives[0];
    base.morphs = shapes
        .iter()
        .map(|shape| MorphTarget {
            positions: shape.positions.iter().zip(&base.positions).map(|(a, b)| *a - *b).collect(),
            normals: shape.normals.iter().zip(&base.normals).map(|(a, b)| *a - *b).collect(),
            ..MorphTarget::default()
        })
        .collect();
    mesh_data.weights = vec![0.0, 0.0];
    let form = stage.place("sculpture", mesh, at(0.0, 1.52, 0.0));
    // Ball, cube, star, ball; flat tangents hold each form for a moment.
    let keys = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.0, 0.0]];
    let morphing = Channel {
        node: form,
        interpolation: Interpolation::CubicSpline,
        times: vec![0.0, 2.5, 5.5, 8.0],
        values: Keys::Weights {
            count: 2,
            values: keys.iter().flat_map(|k| [0.0, 0.0, k[0], k[1], 0.0, 0.0]).collect(),
        },
    };
    stage.scene.animations.push(Animation { name: "sculpture".to_owned(), channels: vec![morphing] });

    let brass = stage.metal("brass", 0xd2a95a, 0.28);
    let mut parent = stage.node(Node { name: "rings".to_owned(), local: form_place(), ..Node::default() });
    let mut channels = Vec::new();
    for (i, (size, axis, turns)) in
        [(0.55, Vec3::X, 1), (0.49, Vec3::Y, -2), (0.43, Vec3::X, 2)].into_iter().enumerate()
    {
        let path: Vec<Vec3> = circle(size, 72).iter().map(|p| vec3(p.x, p.y, 0.0)).collect();
        let ring = loop_sweep(&path, &circle(0.017, 12), true);
        let name = format!("ring {}", i + 1);
        let mesh = stage.mesh(&name, Model::of(brass, ring));
        parent = stage.node(Node { name, parent: Some(parent), mesh: Some(mesh), ..Node::default() });
        channels.push(spin(parent, (axis, 0.5 + 0.4 * i as f32), turns, 8.0));
    }
    stage.scene.animations.push(Animation { name: "rings".to_owned(), channels });
}

fn form_place() -> Transform {
    super::kit::trs(at(0.0, 1.52, 0.0))
}

/// A ball that bounces on the spot, squashed where it lands.
pub(super) fn ball(stage: &mut Stage) {
    let rubber = stage.paint("ball", 0x2f6fd0, 0.35);
    let mesh = stage.mesh("ball", Model::of(rubber, sphere(0.2, 48, 24)));
    let ball = stage.place("ball", mesh, at(2.3, 0.2, -2.0));
    // A parabola is a cubic: fall and rise take 1.2 s under 9.81 m/s², exactly.
    let (half, gravity) = (0.6f32, 9.81);
    let (low, high) = (vec3(2.3, 0.2, -2.0), vec3(2.3, 0.2 + 0.5 * gravity * half * half, -2.0));
    let speed = Vec3::Y * gravity * half;
    let fall = Channel {
        node: ball,
        interpolation: Interpolation::CubicSpline,
        times: vec![0.0, half, 2.0 * half],
        values: Keys::Translation(vec![Vec3::ZERO, high, Vec3::ZERO, -speed, low, speed, Vec3::ZERO, high, Vec3::ZERO]),
    };
    let (flat, tall) = (vec3(1.14, 0.78, 1.14), vec3(0.96, 1.08, 0.96));
    let squash = Channel {
        node: ball,
        interpolation: Interpolation::Linear,
        times: vec![0.0, 0.3, 0.5, 0.6, 0.7, 0.9, 1.2],
        values: Keys::Scale(vec![Vec3::ONE, Vec3::ONE, tall, flat, tall, Vec3::ONE, Vec3::ONE]),
    };
    stage.scene.animations.push(Animation { name: "ball".to_owned(), channels: vec![fall, squash] });
}

/// A clock on the back wall whose hand jumps every second.
fn clock(stage: &mut Stage) {
    let face = stage.paint("clock face", 0xefe9dc, 0.6);
    let dark = stage.paint("clock iron", 0x2b2826, 0.5);
    let mut model = Model::of(face, cylinder(0.42, 0.05, 48).turned_x(90.0));
    let ring: Vec<Vec3> = circle(0.42, 48).iter().map(|p| vec3(p.x, p.y, 0.04)).collect();
    model.add(dark, loop_sweep(&ring, &circle(0.03, 8), true));
    for hour in 0..12 {
        let length = if hour % 3 == 0 { 0.09 } else { 0.05 };
        model.add(dark, cuboid(0.02, length, 0.008).at(0.0, 0.36 - length * 0.5, 0.053).turned_z(30.0 * hour as f32));
    }
    stage.mesh_at("clock", model, at(0.0, 2.1, -3.7));
    let red = stage.paint("clock hand", 0xc23a2a, 0.5);
    let hand = stage.mesh("clock hand", Model::of(red, bevel_box(0.022, 0.36, 0.012, 0.003).at(0.0, 0.13, 0.0)));
    let hand = stage.place("clock hand", hand, at(0.0, 2.1, -3.63));
    let jumps = Channel {
        node: hand,
        interpolation: Interpolation::Step,
        times: (0..=12).map(|i| i as f32).collect(),
        values: Keys::Rotation((0..=12).map(|i| Quat::from_rotation_z(-TAU * i as f32 / 12.0)).collect()),
    };
    stage.scene.animations.push(Animation { name: "clock".to_owned(), channels: vec![jumps] });
}

/// A camera that walks beside the figure.
fn follower(stage: &mut Stage) {
    let node = stage.camera("beside the figure", [0.0; 3], [0.0, 0.0, -1.0], 40.0);
    let figure = stage.scene.nodes.iter().position(|n| n.name == "figure").map(|i| i as u32);
    let node = &mut stage.scene.nodes[node as usize];
    node.parent = figure;
    node.local = super::kit::looking(vec3(1.75, 1.5, 2.15), vec3(0.0, 0.9, 0.1));
}

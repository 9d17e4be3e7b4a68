//! Occluders that move in every way, on a plain ground under a grove: a walking figure (skin), a sculpture that changes shape (morph
//! targets) in rings that turn in one another, a ball that is squashed where it lands, a queen that tumbles over the ground, and a hare
//! that sits still.
//!
//! The motions of the [`figure`] and `tumble` of 6 s: all of them together repeat after 24 s.

use super::{
    environments, figure,
    kit::{Geometry, Model, Stage, at},
    shadows,
};
use glam::{Quat, Vec3, vec3};
use lucerna::scene::{Animation, Channel, Interpolation, Keys, Scene};
use std::f32::consts::TAU;

/// Of the queen's round.
const SECONDS: f32 = 6.0;
const KEYS: u32 = 48;

pub(super) fn build() -> Scene {
    let mut stage = Stage::new("shadows-moving");
    let ground = stage.paint("ground", 0xd9d5cc, 1.0);
    let mut square = Geometry::default();
    let corner = |x: f32, z: f32| vec3(5.0 * x, 0.0, 5.0 * z);
    square.flat_quad([corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0), corner(-1.0, -1.0)]);
    stage.add("ground", Model::of(ground, square));
    figure::walker(&mut stage);
    figure::sculpture(&mut stage);
    figure::ball(&mut stage);
    let still = shadows::build();
    let hare = copied(&mut stage, &still, "hare");
    stage.place("hare", hare, at(-1.6, 0.0, 1.2));
    let queen = copied(&mut stage, &still, "queen");
    let node = stage.place("queen", queen, at(1.3, 0.9, 1.1));
    tumble(&mut stage, node);
    stage.scene.environment = Some(environments::grove());
    stage.camera("front", [0.5, 3.4, 6.4], [0.0, 0.6, 0.0], 44.0);
    stage.camera("above", [0.2, 7.2, 3.4], [0.0, 0.3, 0.0], 46.0);
    stage.camera("ground", [0.0, 0.35, 4.6], [0.0, 0.8, 0.0], 50.0);
    stage.finish()
}

/// A mesh of another built-in scene with its materials.
fn copied(stage: &mut Stage, from: &Scene, name: &str) -> u32 {
    let found = from.nodes.iter().find(|node| node.name == name).and_then(|node| node.mesh);
    let mut mesh = found.map(|mesh| from.meshes[mesh as usize].clone()).unwrap_or_default();
    for primitive in &mut mesh.primitives {
        primitive.material = stage.material(from.materials[primitive.material as usize].clone());
    }
    stage.scene.meshes.push(mesh);
    stage.scene.meshes.len() as u32 - 1
}

/// Carries a node around a small circle while it turns about a leaning axis.
fn tumble(stage: &mut Stage, node: u32) {
    let times: Vec<f32> = (0..=KEYS).map(|i| SECONDS * i as f32 / KEYS as f32).collect();
    let angle = |i: u32| TAU * (i % KEYS) as f32 / KEYS as f32;
    let place =
        |i: u32| vec3(1.4 + 0.5 * angle(i).cos(), 0.75 + 0.2 * (2.0 * angle(i)).sin(), 1.2 + 0.5 * angle(i).sin());
    let turn = |i: u32| Quat::from_rotation_y(angle(i)) * Quat::from_axis_angle(Vec3::X, 2.0 * angle(i));
    let channel = |values: Keys| Channel { node, interpolation: Interpolation::Linear, times: times.clone(), values };
    let channels = vec![
        channel(Keys::Translation((0..=KEYS).map(place).collect())),
        channel(Keys::Rotation((0..=KEYS).map(turn).collect())),
    ];
    stage.scene.animations.push(Animation { name: "tumble".to_owned(), channels });
}

//! Three things that cast soft shadows on a plain ground under a grove: a hare, a tree and a chess queen. Light comes from the
//! environment alone.

mod tree;

use super::{
    environments,
    kit::{Geometry, Model, Stage, blend, lathe, round_cone, srgb, surface_net},
    teapot,
};
use glam::{Vec2, Vec3, vec2, vec3};
use lucerna::scene::{Material, Scene};

/// A mesh that stands alone, without ground, light and camera.
pub(super) struct Thing {
    pub name: &'static str,
    pub description: &'static str,
    add: fn(&mut Stage) -> u32,
}

pub(super) const THINGS: [Thing; 4] = [
    Thing { name: "hare", description: "A sitting hare, 0.8 m high", add: add_hare },
    Thing { name: "queen", description: "A chess queen, 1 m high: a surface of revolution", add: add_queen },
    Thing {
        name: "tree",
        description: "A tree of about 20 000 vertices, 1.7 m high: leaves are triangles",
        add: add_tree,
    },
    Thing { name: "pot", description: "The Utah teapot alone, 19 cm high", add: teapot::pot },
];

/// One of [`THINGS`] as a scene.
pub(super) fn thing(name: &str) -> Option<Scene> {
    let thing = THINGS.iter().find(|thing| thing.name == name)?;
    let mut stage = Stage::new(name);
    let mesh = (thing.add)(&mut stage);
    stage.place(name, mesh, glam::Mat4::IDENTITY);
    Some(stage.finish())
}

fn add_hare(stage: &mut Stage) -> u32 {
    let fur = stage.paint("fur", 0xc7b299, 0.9);
    stage.mesh("hare", Model::of(fur, hare()))
}

fn add_queen(stage: &mut Stage) -> u32 {
    let ivory = stage.paint("ivory", 0xe9e0cb, 0.6);
    stage.mesh("queen", Model::of(ivory, queen()))
}

fn add_tree(stage: &mut Stage) -> u32 {
    let bark = stage.paint("bark", 0x6d5a48, 0.95);
    let leaf = Material { double_sided: true, ..Material::diffuse("leaf", srgb(0x6f9a45)) };
    let leaf = stage.material(leaf);
    let (wood, leaves) = tree::tree();
    let mut model = Model::of(bark, wood);
    model.add(leaf, leaves);
    stage.mesh("tree", model)
}

pub(super) fn build() -> Scene {
    let mut stage = Stage::new("shadows");
    let ground = stage.paint("ground", 0xd9d5cc, 1.0);
    stage.add("ground", Model::of(ground, square(5.0)));
    let hare = add_hare(&mut stage);
    stage.place("hare", hare, glam::Mat4::IDENTITY);
    let queen = add_queen(&mut stage);
    stage.place("queen", queen, super::kit::at(1.25, 0.0, 0.25));
    let tree = add_tree(&mut stage);
    stage.place("tree", tree, super::kit::at(-1.4, 0.0, -0.35));
    stage.scene.environment = Some(environments::grove());
    stage.camera("front", [0.3, 1.7, 4.2], [0.0, 0.45, 0.0], 42.0);
    stage.camera("above", [0.2, 5.2, 2.4], [0.0, 0.0, 0.0], 40.0);
    stage.camera("close", [0.9, 0.75, 1.5], [0.0, 0.3, 0.0], 44.0);
    stage.finish()
}

/// A square of half side `half` in the plane y = 0, seen from above.
fn square(half: f32) -> Geometry {
    let mut out = Geometry::default();
    out.flat_quad([vec3(-half, 0.0, half), vec3(half, 0.0, half), vec3(half, 0.0, -half), vec3(-half, 0.0, -half)]);
    out
}

/// A sitting hare 0.8 m high, without a base.
fn hare() -> Geometry {
    let v = vec3;
    let mirrored = |p: Vec3| v(p.x.abs(), p.y, p.z);
    let distance = |p: Vec3| {
        let q = mirrored(p);
        let body = round_cone(p, (v(0.0, 0.2, -0.08), 0.19), (v(0.0, 0.34, 0.08), 0.14));
        let head = round_cone(p, (v(0.0, 0.5, 0.15), 0.105), (v(0.0, 0.46, 0.25), 0.065));
        let ear = round_cone(q, (v(0.045, 0.57, 0.11), 0.028), (v(0.1, 0.78, 0.03), 0.034));
        let thigh = round_cone(q, (v(0.13, 0.13, -0.1), 0.105), (v(0.14, 0.05, 0.08), 0.045));
        let paw = round_cone(q, (v(0.06, 0.24, 0.16), 0.045), (v(0.07, 0.035, 0.21), 0.034));
        let tail = (p - v(0.0, 0.16, -0.29)).length() - 0.06;
        let upper = blend(blend(body, head, 0.1), ear, 0.03);
        let lower = blend(blend(thigh, paw, 0.03), tail, 0.03);
        // Nothing of it is below the ground.
        blend(upper, lower, 0.05).max(0.004 - p.y)
    };
    surface_net(v(-0.34, -0.03, -0.42), v(0.34, 0.86, 0.38), 0.0155, distance)
}

/// A chess queen 1 m high: a surface of revolution.
fn queen() -> Geometry {
    let profile: [(f32, f32); 27] = [
        (0.0, 0.0),
        (0.2, 0.0),
        (0.21, 0.02),
        (0.21, 0.06),
        (0.185, 0.085),
        (0.18, 0.1),
        (0.19, 0.115),
        (0.185, 0.14),
        (0.15, 0.175),
        (0.115, 0.23),
        (0.09, 0.32),
        (0.075, 0.43),
        (0.068, 0.56),
        (0.072, 0.64),
        (0.11, 0.655),
        (0.118, 0.67),
        (0.1, 0.69),
        (0.075, 0.7),
        (0.09, 0.715),
        (0.082, 0.735),
        (0.088, 0.79),
        (0.115, 0.86),
        (0.13, 0.9),
        (0.108, 0.905),
        (0.06, 0.935),
        (0.035, 0.955),
        (0.0, 1.0),
    ];
    let profile: Vec<Vec2> = profile.iter().map(|(r, y)| vec2(*r, *y)).collect();
    lathe(&profile, 64, 50.0)
}

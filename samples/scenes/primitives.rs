//! Coloured solids on a ground between two coloured walls: shadows, contacts and colour bleeding at one glance.

use super::kit::{
    Geometry, GradientSky, Model, Stage, bevel_box, checker, cuboid, cylinder, frustum, lathe, slab, sphere, srgb,
    torus, tube,
};
use glam::{Vec2, Vec3, vec2};
use lucerna::scene::Scene;

pub(super) fn build() -> Scene {
    let mut stage = Stage::new("primitives");
    ground_and_walls(&mut stage);
    solids(&mut stage);

    stage.spot("key", ([2.6, 4.6, 3.4], [-0.1, 0.2, 0.0]), srgb(0xfff1dc), 90.0, (24.0, 42.0));
    stage.point("fill", [-3.4, 3.2, 3.2], srgb(0xc9dcff), 14.0);
    let sky = GradientSky {
        zenith: Vec3::new(0.05, 0.07, 0.1),
        horizon: Vec3::new(0.1, 0.11, 0.12),
        ground: Vec3::splat(0.05),
        to_sun: Vec3::new(2.6, 4.6, 3.4),
        glow: Vec3::ZERO,
    };
    stage.scene.environment = Some(sky.environment("studio", 64, 32));

    stage.camera("front", [0.2, 1.75, 4.9], [0.0, 0.5, -0.2], 38.0);
    stage.camera("left", [-2.5, 1.3, 2.3], [0.4, 0.45, -0.3], 44.0);
    stage.camera("above", [0.9, 4.6, 2.9], [0.0, 0.2, 0.0], 40.0);
    stage.camera("close", [1.75, 0.75, 1.75], [0.35, 0.33, -0.1], 44.0);
    stage.finish()
}

fn ground_and_walls(stage: &mut Stage) {
    let tiles = stage.textured("tiles", &checker(128, 2, srgb(0xc9c5bc), srgb(0xb3aea3)), 1.0, 0.8);
    stage.add("ground", Model::of(tiles, slab([-3.2, -0.2, -2.2], [3.2, 0.0, 2.6])));
    let white = stage.paint("white wall", 0xe4e1da, 0.9);
    stage.add("back wall", Model::of(white, slab([-2.2, 0.0, -2.0], [2.2, 2.2, -1.85])));
    let red = stage.paint("red wall", 0xc8402c, 0.9);
    stage.add("red wall", Model::of(red, slab([-2.35, 0.0, -2.0], [-2.2, 2.2, 0.6])));
    let blue = stage.paint("blue wall", 0x2f62b5, 0.9);
    stage.add("blue wall", Model::of(blue, slab([2.2, 0.0, -2.0], [2.35, 2.2, 0.6])));
}

fn solids(stage: &mut Stage) {
    let mut put = |name: &str, hex: u32, roughness: f32, geometry: Geometry| {
        let material = stage.paint(name, hex, roughness);
        stage.add(name, Model::of(material, geometry));
    };
    put("large sphere", 0xe0662b, 0.35, sphere(0.5, 64, 32).at(-1.05, 0.5, -0.55));
    put("small sphere", 0xf0d9c0, 0.25, sphere(0.22, 48, 24).at(0.02, 0.22, 1.0));
    put("cone", 0xf2b632, 0.6, frustum(0.42, 0.0, 1.15, 64).at(0.15, 0.0, -0.95));
    put("ring", 0x3e9b52, 0.4, torus(0.36, 0.14, 64, 32).at(-0.62, 0.14, 0.62));
    let box_stack = [(0.72, 0.72, 14.0), (0.5, 0.5, 38.0)];
    let mut foot = 0.0;
    for (i, (size, height, turn)) in box_stack.into_iter().enumerate() {
        let name = ["large box", "small box"][i];
        let hex = [0x3b6fb8, 0x6fb3d6][i];
        put(name, hex, 0.55, bevel_box(size, height, size, 0.02).turned_y(turn).at(1.25, foot + height * 0.5, -0.6));
        foot += height;
    }
    put("cylinder", 0x9a4fb0, 0.5, cylinder(0.2, 0.85, 64).at(-0.32, 0.0, -0.2));
    put("pipe", 0xd8d4c8, 0.45, tube(0.3, 0.2, 0.34, 64).at(0.62, 0.0, 0.36));
    put("capsule", 0xd23f5e, 0.35, capsule(0.15, 0.34).turned_z(90.0).turned_y(35.0).at(1.32, 0.15, 0.72));
    put("pyramid", 0x2fa39a, 0.7, pyramid(0.62, 0.55).turned_y(24.0).at(-1.55, 0.0, 0.35));
    put("dice", 0xf4f1e8, 0.3, bevel_box(0.2, 0.2, 0.2, 0.025).turned_y(31.0).at(-1.2, 0.1, 1.15));
    put("octahedron", 0xc9b23a, 0.4, octahedron(0.24).turned_y(18.0).at(0.62, 0.58, 0.36));

    let gold = stage.metal("gold", 0xe7bd62, 0.25);
    stage.add("gold sphere", Model::of(gold, sphere(0.27, 64, 32).at(0.55, 0.27, -0.22)));
    let post = stage.paint("post", 0x6b6258, 0.7);
    let mut steps = Geometry::default();
    for i in 0..4 {
        let height = 0.14 * (i + 1) as f32;
        steps.append(&cuboid(0.24, height, 0.5).at(-1.95 + 0.24 * i as f32, height * 0.5, -1.5));
    }
    stage.add("steps", Model::of(post, steps));
}

/// A closed capsule around Y: a cylinder of `length` between two half spheres.
fn capsule(radius: f32, length: f32) -> Geometry {
    let arc = |from: f32, centre: f32| {
        (0..=12).map(move |i| {
            let (sin, cos) = (from + i as f32 / 12.0 * std::f32::consts::FRAC_PI_2).sin_cos();
            vec2(radius * cos.max(0.0), centre + radius * sin)
        })
    };
    let mut profile: Vec<Vec2> =
        arc(-std::f32::consts::FRAC_PI_2, -length * 0.5).chain(arc(0.0, length * 0.5)).collect();
    let last = profile.len() - 1;
    (profile[0].x, profile[last].x) = (0.0, 0.0);
    lathe(&profile, 48, 60.0)
}

/// A closed pyramid on a square foot.
fn pyramid(side: f32, height: f32) -> Geometry {
    let half = side * 0.5;
    let foot = [(-half, half), (half, half), (half, -half), (-half, -half)].map(|(x, z)| Vec3::new(x, 0.0, z));
    let mut out = Geometry::default();
    out.flat_quad([foot[3], foot[2], foot[1], foot[0]]);
    for i in 0..4 {
        out.flat_triangle(foot[i], foot[(i + 1) % 4], Vec3::new(0.0, height, 0.0));
    }
    out
}

/// A closed octahedron with corners at distance `radius` on the axes.
fn octahedron(radius: f32) -> Geometry {
    let mut out = Geometry::default();
    let around = [Vec3::X, Vec3::NEG_Z, Vec3::NEG_X, Vec3::Z].map(|p| p * radius);
    for i in 0..4 {
        let (a, b) = (around[i], around[(i + 1) % 4]);
        out.flat_triangle(a, b, Vec3::Y * radius);
        out.flat_triangle(b, a, Vec3::NEG_Y * radius);
    }
    out
}

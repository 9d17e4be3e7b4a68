//! The CPU's path tracer against light that is known in closed form (form factors from Howell's catalogue; Siegel and Howell).

use crate::tracer_lab::{Stage, flat_view, view};
use glam::Vec3;
use lucerna::{
    reference::path::{Layers, Settings, trace},
    scene::{Material, Pose, View, bvh::Bvh},
};
use std::f32::consts::PI;

/// W/(sr·m²) of all emitters.
const L: f32 = 3.0;

/// Adds a regular polygon of the area of a disc around (0, y, 0), facing up or down.
fn disc(stage: &mut Stage, material: u32, y: f32, radius: f32, up: bool) {
    let n = 256u32;
    let angle = 2.0 * PI / n as f32;
    let radius = radius * (angle / angle.sin()).sqrt();
    let mut positions = vec![Vec3::Y * y];
    positions.extend((0..n).map(|i| {
        let phi = angle * i as f32;
        Vec3::new(radius * phi.cos(), y, -radius * phi.sin())
    }));
    let normal = if up { Vec3::Y } else { Vec3::NEG_Y };
    let indices = (0..n).flat_map(|i| {
        let (a, b) = (1 + i, 1 + (i + 1) % n);
        if up { [0, a, b] } else { [0, b, a] }
    });
    stage.mesh(material, positions, vec![normal; n as usize + 1], indices.collect());
}

/// White receiver (0) and emitter (1).
fn stage() -> Stage {
    let mut stage = Stage::new();
    stage.material(Material::diffuse("white", Vec3::ONE));
    stage.emitter(Vec3::splat(L));
    stage
}

/// A square of half-widths (x, z) in the plane y, facing up or down.
fn square(stage: &mut Stage, material: u32, y: f32, [x, z]: [f32; 2], up: bool) {
    let corner = Vec3::new(-x, y, -z);
    let (a, b) = (Vec3::Z * 2.0 * z, Vec3::X * 2.0 * x);
    if up {
        stage.quad(material, corner, a, b)
    } else {
        stage.quad(material, corner, b, a)
    };
}

fn run(stage: &Stage, view: &View, settings: Settings) -> Layers {
    let pose = Pose::rest(&stage.scene);
    let settings = Settings { diffuse_only: true, jitter: true, ..settings };
    trace(&stage.scene, &pose, &Bvh::build(&stage.scene, &pose), view, &settings)
}

/// Fails unless E / (π L), averaged over a view from straight above and multiplied by `factor`, is `expected`, by rays and by points
/// on the emitter. The camera sees through the backs of emitters.
#[track_caller]
fn expect(name: &str, stage: &Stage, view: &View, factor: f64, expected: f64) {
    for sample_lamps in [false, true] {
        let samples = if sample_lamps { 100 } else { 400 };
        let layers = run(stage, view, Settings { samples, bounces: 0, sample_lamps, seed: 5, ..Settings::default() });
        let n = layers.direct.len() as f64;
        let scale = factor / f64::from(L);
        let found = layers.direct.iter().map(|d| f64::from(d.x)).sum::<f64>() / n * scale;
        let sigma = layers.variance.direct.iter().map(|v| f64::from(v.x)).sum::<f64>().sqrt() / n * scale;
        println!("{name}: {found:.5} ± {sigma:.5}, closed form {expected:.5}");
        assert!((found - expected).abs() < 4.5 * sigma + 2e-4 * expected, "{name}");
        assert!(sigma < 0.05 * expected, "{name} is too noisy to say anything");
    }
}

fn above(size: f32) -> View {
    flat_view(Vec3::Y * 20.0, Vec3::ZERO, size, [16, 16])
}

#[test]
fn form_factors_of_squares() {
    for (x, z, distance, expected) in [(1.0, 1.0, 1.0, 0.199_824_895_7), (10.0, 10.0, 1.0, 0.826_995)] {
        let mut stage = stage();
        square(&mut stage, 0, 0.0, [x / 2.0, z / 2.0], true);
        square(&mut stage, 1, distance, [x / 2.0, z / 2.0], false);
        expect(&format!("{x} × {z} at {distance}"), &stage, &above(x), 1.0, expected);
    }
    // Perpendicular unit squares with a common edge.
    let mut stage = stage();
    square(&mut stage, 0, 0.0, [0.5, 0.5], true);
    stage.quad(1, Vec3::new(-0.5, 0.0, -0.5), Vec3::Y, Vec3::Z);
    expect("perpendicular", &stage, &above(1.0), 1.0, 0.200_043_776_1);
    // 1 × 1.5 at a distance of 0.5, seen by a picture of the same shape.
    let mut stage = self::stage();
    square(&mut stage, 0, 0.0, [0.5, 0.75], true);
    square(&mut stage, 1, 0.5, [0.5, 0.75], false);
    // The picture shows a square of 1.5: two thirds of it are the receiver.
    expect("1 × 1.5 at 0.5", &stage, &above(1.5), 1.5, 0.475_576);
}

#[test]
fn form_factors_of_discs_and_their_reciprocity() {
    let over_disc = 4.0 / std::f64::consts::PI;
    let pair = |receiver: f32, emitter: f32, distance: f32, expected: f64| {
        let mut stage = stage();
        disc(&mut stage, 0, 0.0, receiver, true);
        disc(&mut stage, 1, distance, emitter, false);
        // The picture is a little wider than the disc.
        let wide = 1.02f32;
        let factor = over_disc * f64::from(wide * wide);
        expect(
            &format!("discs {receiver}, {emitter} at {distance}"),
            &stage,
            &above(2.0 * receiver * wide),
            factor,
            expected,
        );
    };
    pair(1.0, 1.0, 1.0, 0.381_966_011_3);
    pair(0.1, 0.2, 0.5, 0.133_931);
    // A₁ F₁₂ = A₂ F₂₁.
    pair(0.2, 0.1, 0.5, 0.133_931 / 4.0);
}

#[test]
fn irradiance_at_a_point() {
    let small = above(1e-3);
    let mut stage = stage();
    square(&mut stage, 0, 0.0, [0.01, 0.01], true);
    square(&mut stage, 1, 1.0, [0.5, 0.5], false);
    expect("under the centre of a unit square", &stage, &small, 1.0, 0.239_456_470_5);
    // A cap of half angle a about the normal: sin² a.
    for angle in [0.3f32, 0.7, 1.2] {
        let mut stage = self::stage();
        square(&mut stage, 0, 0.0, [0.01, 0.01], true);
        disc(&mut stage, 1, 1.0, angle.tan(), false);
        expect(&format!("cap of {angle}"), &stage, &small, 1.0, f64::from(angle.sin()).powi(2));
    }
    // A sphere of radius R in distance h: (R/h)². Its triangles lie a little within it.
    let mut stage = self::stage();
    square(&mut stage, 0, 0.0, [0.01, 0.01], true);
    let rings = 64u32;
    let shrink = 1.0 + (PI / rings as f32).powi(2) / 12.0;
    stage.sphere(1, Vec3::Y * 2.0, shrink, rings, false);
    let below = view(Vec3::new(0.02, 0.5, 0.0), Vec3::ZERO, 0.5, [16, 16]);
    expect("under a sphere", &stage, &below, 1.0, 0.25);
}

#[test]
fn closed_rooms_are_geometric_series() {
    // Box: e / (1 − ρ), by the twentieth bounce to one part in a million.
    let mut room = Stage::new();
    let wall = room.material(Material { emissive: Vec3::splat(2.0), ..Material::diffuse("", Vec3::splat(0.5)) });
    room.cuboid(wall, Vec3::NEG_ONE, Vec3::ONE, true);
    let eye = view(Vec3::new(0.1, 0.2, 0.3), Vec3::new(1.0, 0.4, -0.5), 60.0, [8, 8]);
    let layers = run(&room, &eye, Settings { samples: 4, bounces: 20, ..Settings::default() });
    for total in layers.total() {
        assert!((total.x / 4.0 - 1.0).abs() < 1e-4, "{total}");
    }
    // pbrt's unit sphere: albedo 0.5, a light of π W/sr in the middle. Radiance 1 everywhere, half of it direct.
    let mut sphere = Stage::new();
    let wall = sphere.material(Material::diffuse("", Vec3::splat(0.5)));
    sphere.sphere(wall, Vec3::ZERO, 1.0, 64, true);
    sphere.point(Vec3::ZERO, Vec3::splat(PI));
    let layers = run(&sphere, &eye, Settings { samples: 100, bounces: 20, ..Settings::default() });
    let mean = |pixels: &[Vec3]| pixels.iter().map(|p| p.x).sum::<f32>() / pixels.len() as f32;
    let (direct, total) = (mean(&layers.direct), mean(&layers.total()));
    println!("unit sphere: direct {direct}, total {total}");
    assert!((direct - 0.5).abs() < 2e-3 && (total - 1.0).abs() < 6e-3);
}

#[test]
fn twice_the_light_is_twice_the_picture_and_channels_do_not_mix() {
    let build = |radiance: Vec3, albedo: Vec3| {
        let mut stage = Stage::new();
        let wall = stage.material(Material::diffuse("", albedo));
        let lamp = stage.emitter(radiance);
        stage.cuboid(wall, Vec3::NEG_ONE, Vec3::ONE, true);
        stage.quad(lamp, Vec3::new(-0.3, 0.9, -0.3), Vec3::X * 0.6, Vec3::Z * 0.6);
        stage.point(Vec3::new(0.2, 0.1, 0.0), radiance * 0.25);
        let eye = view(Vec3::new(0.1, 0.2, 0.8), Vec3::ZERO, 60.0, [6, 6]);
        run(&stage, &eye, Settings { samples: 8, bounces: 3, sample_lamps: true, ..Settings::default() }).total()
    };
    let (light, albedo) = (Vec3::new(1.0, 2.0, 3.0), Vec3::new(0.7, 0.5, 0.2));
    let one = build(light, albedo);
    assert_eq!(build(light * 2.0, albedo), one.iter().map(|p| *p * 2.0).collect::<Vec<_>>());
    let turn = |v: Vec3| Vec3::new(v.y, v.z, v.x);
    assert_eq!(build(turn(light), turn(albedo)), one.iter().map(|p| turn(*p)).collect::<Vec<_>>());
}

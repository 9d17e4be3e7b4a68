use super::*;
use crate::scene::environment::{direction_from_uv, solid_angle};
use glam::Vec2;
use proptest::prelude::*;

fn painted(width: u32, height: u32, radiance: impl Fn(Vec3) -> Vec3) -> Environment {
    let at =
        |i: u32| Vec2::new((i % width) as f32 + 0.5, (i / width) as f32 + 0.5) / Vec2::new(width as f32, height as f32);
    let pixels = (0..width * height).map(|i| radiance(direction_from_uv(at(i)))).collect();
    Environment { name: String::new(), width, height, pixels, rotation: 0.0, scale: 1.0 }
}

/// A sky without any symmetry, so that the tests notice exchanged axes or signs.
fn odd_sky(width: u32) -> Environment {
    painted(width, width / 2, |d| {
        let blob = |x: f32, y: f32, z: f32, sharp: f32| d.dot(Vec3::new(x, y, z).normalize()).max(0.0).powf(sharp);
        let red = 0.2 + 3.0 * blob(0.3, 0.8, -0.5, 6.0) + 0.6 * d.x.max(0.0);
        let green = 0.1 + 2.0 * blob(-0.9, 0.1, 0.4, 12.0) + 0.5 * (-d.y).max(0.0);
        Vec3::new(red, green, 0.3 + 4.0 * blob(0.1, -0.6, 0.7, 3.0) + 0.4 * d.z * d.z * d.x.abs())
    })
}

/// Irradiance by its definition: a sum over all pixels of the picture, without any code of the module.
fn brute_force(sky: &Environment, n: Vec3) -> Vec3 {
    let turned = glam::Quat::from_rotation_y(sky.rotation);
    let mut sum = DVec3::ZERO;
    for (i, pixel) in sky.pixels.iter().enumerate() {
        let (x, y) = (i as u32 % sky.width, i as u32 / sky.width);
        let uv = Vec2::new((x as f32 + 0.5) / sky.width as f32, (y as f32 + 0.5) / sky.height as f32);
        let cosine = (turned * direction_from_uv(uv)).dot(n).max(0.0);
        sum += pixel.as_dvec3() * (f64::from(cosine) * solid_angle(sky.width, sky.height, y));
    }
    sum.as_vec3() * sky.scale
}

fn normals(count: u32) -> impl Iterator<Item = Vec3> {
    // Roberts' R2 on the sphere, and the axes.
    let spread = (0..count).map(|i| {
        let (u, v) = ((i as f32 * 0.754_877_7 + 0.31).fract(), (i as f32 * 0.569_840_3 + 0.77).fract());
        let (z, phi) = (2.0 * u - 1.0, std::f32::consts::TAU * v);
        let r = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(r * phi.cos(), z, r * phi.sin())
    });
    spread.chain(Vec3::AXES).chain(Vec3::AXES.map(|a| -a))
}

/// Largest difference from brute force relative to it, in any channel.
fn error(sky: &Environment, count: u32) -> f32 {
    let e = Irradiance::of(sky);
    let of = |n| {
        let exact = brute_force(sky, n);
        ((e.at(n) - exact).abs() / exact).max_element()
    };
    normals(count).map(of).fold(0.0, f32::max)
}

#[test]
fn a_constant_environment_of_any_size_gives_pi_times_its_radiance() {
    for (width, height) in [(1, 1), (2, 1), (4, 2), (1, 7), (5, 3), (128, 64), (300, 150)] {
        let radiance = Vec3::new(1.0, 2.0, 0.5);
        let e = Irradiance::of(&painted(width, height, |_| radiance));
        for n in normals(60) {
            let off = (e.at(n) / (std::f32::consts::PI * radiance) - 1.0).abs().max_element();
            assert!(off < 5e-4, "{width}×{height}: {off} towards {n}");
            let plain = Irradiance::constant(radiance).at(n);
            assert!((plain / (std::f32::consts::PI * radiance) - 1.0).abs().max_element() < 1e-6, "{plain}");
        }
    }
}

#[test]
fn every_normal_of_a_sky_without_symmetry_has_its_brute_force_irradiance() {
    let mut sky = odd_sky(256);
    let plain = error(&sky, 200);
    sky.rotation = 1.1;
    sky.scale = 3.0;
    let turned = error(&sky, 100);
    println!("largest relative error {plain}, turned {turned}");
    assert!(plain < 3e-3 && turned < 3e-3, "{plain}, {turned}");
}

#[test]
fn a_sun_of_one_pixel_keeps_its_cosine() {
    let mut sky = painted(512, 256, |_| Vec3::ZERO);
    for at in [512 * 70 + 300, 512 * 200 + 40] {
        sky.pixels.fill(Vec3::ZERO);
        sky.pixels[at] = Vec3::splat(1e5);
        let e = Irradiance::of(&sky);
        let greatest = normals(200).map(|n| brute_force(&sky, n).x).fold(0.0, f32::max);
        let off = normals(500).map(|n| (e.at(n) - brute_force(&sky, n)).abs().x / greatest).fold(0.0, f32::max);
        println!("off by {off} of the brightest");
        assert!(off < 1e-3, "{off}");
        // With a sky that adds a fifth of the sun's light, also where the sun is near the horizon.
        sky.pixels.iter_mut().for_each(|p| *p += Vec3::splat(0.2 * greatest / std::f32::consts::PI));
        let off = error(&sky, 200);
        println!("with haze {off}");
        assert!(off < 5e-3, "{off}");
    }
}

#[test]
fn cosine_lobes_have_their_closed_forms() {
    // L = 1 + d·y: E(n) = π + (2π/3) n·y.
    let e = Irradiance::of(&painted(256, 128, |d| Vec3::splat(1.0 + d.y)));
    let pi = std::f32::consts::PI;
    for n in normals(50) {
        assert!((e.at(n).x / (pi + 2.0 * pi / 3.0 * n.y) - 1.0).abs() < 3e-3, "{n}");
    }
    // L = max(d·(−z), 0): E(−z) = 2π/3, and nothing behind.
    let e = Irradiance::of(&painted(256, 128, |d| Vec3::splat((-d.z).max(0.0))));
    assert!((e.at(Vec3::NEG_Z).x / (2.0 * pi / 3.0) - 1.0).abs() < 1e-3);
    assert!(e.at(Vec3::Z).x < 2e-3);
}

#[test]
fn rotation_turns_counter_clockwise_seen_from_above() {
    let mut sky = painted(128, 64, |d| Vec3::splat((-d.z).max(0.0)));
    sky.rotation = std::f32::consts::FRAC_PI_2;
    let e = Irradiance::of(&sky);
    assert!(e.at(Vec3::NEG_X).x > 2.0 && e.at(Vec3::X).x < 0.1);
}

/// A table whose irradiance at each node is that node's normal.
fn normals_of_nodes() -> Irradiance {
    Irradiance::from_table((0..SIDE * SIDE).map(|i| direction(i % SIDE, i / SIDE).as_vec3()).collect(), &[])
}

#[test]
fn nodes_are_looked_up_where_they_lie() {
    let e = normals_of_nodes();
    for i in 0..SIDE * SIDE {
        let n = direction(i % SIDE, i / SIDE).as_vec3();
        assert!(e.at(n).distance(n) < 1e-5, "{n} {}", e.at(n));
    }
}

proptest! {
    // Linear between nodes, so continuous everywhere: over the folds, at the poles and along the axes too.
    #[test]
    fn the_lookup_has_no_seam(x in -1.0f32..1.0, y in -1.0f32..1.0, z in -1.0f32..1.0, flat in 0usize..4) {
        let mut n = Vec3::new(x, y, z);
        if flat < 3 {
            n[flat] = 0.0;
        }
        prop_assume!(n.length() > 0.1);
        let e = normals_of_nodes();
        let n = n.normalize();
        prop_assert!(e.at(n).distance(n) < 2e-3);
        for axis in Vec3::AXES {
            let beside = [n + 1e-6 * axis, n - 1e-6 * axis].map(|m| e.at(m.normalize()));
            prop_assert!(beside[0].distance(beside[1]) < 1e-5);
        }
    }
}

//! Scenes whose light is known in closed form.

use super::*;
use crate::scene::{Camera, Environment, Light, LightKind, Material, Mesh, Node, Primitive, Projection, Transform};
use std::f32::consts::PI;

const ALBEDO: Vec3 = Vec3::new(0.8, 0.5, 0.2);

/// A sphere of radius `r` around the origin, seen from inside (`inward`) or outside.
fn sphere(r: f32, inward: bool) -> Primitive {
    let (n, m) = (64u32, 32u32);
    let mut p = Primitive::default();
    let side = if inward { -1.0 } else { 1.0 };
    for j in 0..=m {
        for i in 0..=n {
            let (phi, theta) = (i as f32 / n as f32 * 2.0 * PI, j as f32 / m as f32 * PI);
            let d = Vec3::new(theta.sin() * phi.cos(), theta.cos(), -theta.sin() * phi.sin());
            p.positions.push(d * r);
            p.normals.push(d * side);
        }
    }
    for j in 0..m {
        for i in 0..n {
            let (a, b) = (j * (n + 1) + i, (j + 1) * (n + 1) + i);
            let quad = [a, b, b + 1, a, b + 1, a + 1];
            p.indices.extend(if inward { [2, 1, 0, 5, 4, 3].map(|k| quad[k]) } else { quad });
        }
    }
    p.tangents = vec![glam::Vec4::ZERO; p.positions.len()];
    p
}

/// With the normals of its triangles: no shading normal leads a path into the surface.
fn flat(mut primitive: Primitive) -> Primitive {
    primitive.make_flat();
    primitive
}

/// A square of half-width `s` in the plane y = 0, facing up.
fn ground(s: f32) -> Primitive {
    Primitive {
        positions: [(-s, s), (s, s), (s, -s), (-s, -s)].map(|(x, z)| Vec3::new(x, 0.0, z)).to_vec(),
        normals: vec![Vec3::Y; 4],
        tangents: vec![glam::Vec4::ZERO; 4],
        indices: vec![0, 1, 2, 0, 2, 3],
        ..Primitive::default()
    }
}

fn scene(primitive: Primitive, material: Material) -> Scene {
    Scene {
        nodes: vec![Node { mesh: Some(0), ..Node::default() }],
        meshes: vec![Mesh { primitives: vec![primitive], ..Mesh::default() }],
        materials: vec![material],
        ..Scene::default()
    }
}

fn with_light(mut scene: Scene, kind: LightKind, intensity: f32, place: Mat4) -> Scene {
    scene.lights.push(Light { name: String::new(), kind, color: Vec3::ONE, intensity });
    let light = Some(scene.lights.len() as u32 - 1);
    scene.nodes.push(Node { light, local: Transform::Matrix(place), ..Node::default() });
    scene
}

fn view(world_from_camera: Mat4, size: u32) -> View {
    let projection = Projection::Perspective { yfov: 1.0, aspect: None, znear: 0.01, zfar: Some(100.0) };
    View::new(&Camera { name: String::new(), projection }, world_from_camera, [size, size])
}

/// From 5 m above, looking down.
fn from_above(size: u32) -> View {
    view(Mat4::from_translation(Vec3::Y * 5.0) * Mat4::from_rotation_x(-PI / 2.0), size)
}

fn run(scene: &Scene, view: &View, settings: Settings) -> Layers {
    let pose = Pose::rest(scene);
    trace(scene, &pose, &Bvh::build(scene, &pose), view, &settings)
}

fn mean(values: &[Vec3]) -> Vec3 {
    values.iter().sum::<Vec3>() / values.len() as f32
}

fn assert_close(got: Vec3, expected: Vec3, relative: f32) {
    let off = ((got - expected) / expected).abs().max_element();
    assert!(off < relative, "{got} is not {expected}: off by {off}");
}

fn settings(samples: u32, bounces: u32) -> Settings {
    Settings { samples, bounces, diffuse_only: true, ..Settings::default() }
}

#[test]
fn a_furnace_sums_the_geometric_series() {
    let material = Material { emissive: Vec3::splat(2.0), ..Material::diffuse("", ALBEDO) };
    let scene = scene(flat(sphere(1.0, true)), material);
    for bounces in [0, 1, 3, 8] {
        let layers = run(&scene, &view(Mat4::IDENTITY, 6), settings(2, bounces));
        let series: Vec3 = (0..=bounces + 1).map(|k| 2.0 * ALBEDO.powf(k as f32)).sum();
        // Every path sees the same light: no noise, only rounding.
        for total in layers.total() {
            assert_close(total, series, 1e-4);
        }
    }
}

#[test]
fn a_light_in_a_sphere_lights_it_evenly_and_again() {
    let scene = scene(sphere(2.0, true), Material::diffuse("", ALBEDO));
    let scene = with_light(scene, LightKind::Point { range: None }, 10.0, Mat4::IDENTITY);
    let layers = run(&scene, &view(Mat4::IDENTITY, 8), settings(64, 2));
    let direct = ALBEDO / PI * (10.0 / 4.0);
    // Flat facets lie a little nearer than the sphere and tilt a little.
    assert_close(mean(&layers.direct), direct, 0.01);
    assert_close(mean(&layers.indirect), direct * (ALBEDO + ALBEDO * ALBEDO), 0.01);
}

#[test]
fn a_plane_under_an_even_sky_reflects_its_albedo() {
    let mut scene = scene(ground(50.0), Material::diffuse("", ALBEDO));
    scene.environment = Some(Environment {
        name: String::new(),
        width: 4,
        height: 2,
        pixels: vec![Vec3::splat(3.0); 8],
        rotation: 0.4,
        scale: 2.0,
    });
    let layers = run(&scene, &from_above(5), settings(8, 0));
    for sky in &layers.direct {
        assert_close(*sky, ALBEDO * 6.0, 1e-4);
    }
    let up = view(Mat4::from_translation(Vec3::Y) * Mat4::from_rotation_x(PI / 2.0), 3);
    let above = run(&scene, &up, settings(1, 1));
    assert!(above.emission.iter().all(|e| e.abs_diff_eq(Vec3::splat(6.0), 1e-4)));
    assert!(above.depth.iter().all(|d| d.is_infinite()));
}

#[test]
fn the_three_kinds_of_lights_follow_their_laws() {
    let down = Mat4::from_rotation_x(-PI / 2.0);
    let spot = LightKind::Spot { range: None, inner: 0.3, outer: 0.6 };
    let height = Mat4::from_translation(Vec3::Y * 4.0);
    for (kind, irradiance) in [
        (LightKind::Directional, 8.0),
        (LightKind::Point { range: None }, 0.5),
        (LightKind::Point { range: Some(8.0) }, 0.5 * (1.0 - 1.0 / 16.0)),
        (spot, 0.5),
    ] {
        let scene = with_light(scene(ground(20.0), Material::diffuse("", ALBEDO)), kind, 8.0, height * down);
        let layers = run(&scene, &from_above(9), settings(1, 0));
        assert_close(layers.direct[40], ALBEDO / PI * irradiance, 1e-3);
    }
    // 0.45 rad off the axis of the spot, halfway in angle: cos-linear ramp, squared; inverse square and cosine.
    let scene = with_light(scene(ground(20.0), Material::diffuse("", ALBEDO)), spot, 8.0, height * down);
    let aside = view(Mat4::from_translation(Vec3::new(4.0 * 0.45f32.tan(), 5.0, 0.0)) * down, 1);
    let ramp = (0.45f32.cos() - 0.6f32.cos()) / (0.3f32.cos() - 0.6f32.cos());
    let expected = 8.0 * ramp * ramp * 0.45f32.cos().powi(3) / 16.0;
    assert_close(run(&scene, &aside, settings(1, 0)).direct[0], ALBEDO / PI * expected, 1e-3);
}

/// [ISR 16] and k_dl: the colour relative to the brightest light, no π, no inverse square.
#[test]
fn lights_follow_the_law_of_the_dissertation() {
    let down = Mat4::from_rotation_x(-PI / 2.0);
    let law = Law::Paper { radius: 10.0, power: 1.3 };
    let height = Mat4::from_translation(Vec3::Y * 4.0);
    let spot = LightKind::Spot { range: None, inner: 0.3, outer: 0.6 };
    for (kind, expected) in [
        (LightKind::Directional, 1.0),
        (LightKind::Point { range: None }, 1.0 - 0.16),
        (LightKind::Point { range: Some(8.0) }, 1.0 - 0.25),
        (LightKind::Point { range: Some(3.0) }, 0.0),
        (spot, 1.0 - 0.16),
    ] {
        let scene = with_light(scene(ground(20.0), Material::diffuse("", ALBEDO)), kind, 8.0, height * down);
        let layers = run(&scene, &from_above(9), Settings { law, ..settings(1, 0) });
        match expected {
            0.0 => assert_eq!(layers.direct[40], Vec3::ZERO, "beyond the range"),
            expected => assert_close(layers.direct[40], ALBEDO * 1.3 * expected, 1e-3),
        }
        // A second light of half the strength adds half of its colour.
        let two = with_light(scene, LightKind::Directional, 4.0, down);
        let layers = run(&two, &from_above(9), Settings { law, ..settings(1, 0) });
        assert_close(layers.direct[40], ALBEDO * 1.3 * (expected + 0.5), 1e-3);
    }
}

#[test]
fn shadows_fall_where_rays_are_blocked() {
    let mut scene = scene(ground(20.0), Material::diffuse("", ALBEDO));
    scene.meshes.push(Mesh { primitives: vec![ground(1.0)], ..Mesh::default() });
    let lift = |y: f32| Transform::Matrix(Mat4::from_translation(Vec3::Y * y));
    scene.nodes.push(Node { mesh: Some(1), local: lift(2.0), ..Node::default() });
    let light = Mat4::from_translation(Vec3::Y * 4.0) * Mat4::from_rotation_x(-PI / 2.0);
    let scene = with_light(scene, LightKind::Point { range: None }, 8.0, light);
    // The square of half-width 1 at half the height shades half-width 2 on the ground.
    for (x, lit) in [(1.2f32, false), (1.9, false), (2.1, true), (3.0, true)] {
        let eye = Vec3::new(x, 1.0, 0.0);
        let layers =
            run(&scene, &view(Mat4::from_translation(eye) * Mat4::from_rotation_x(-PI / 2.0), 1), settings(1, 0));
        assert_eq!(layers.direct[0] != Vec3::ZERO, lit, "at {x}");
    }
}

#[test]
fn light_scales_and_repeats() {
    let scene = |intensity| {
        let room = scene(sphere(2.0, true), Material::diffuse("", ALBEDO));
        with_light(room, LightKind::Point { range: None }, intensity, Mat4::from_translation(Vec3::X))
    };
    let one = run(&scene(3.0), &view(Mat4::IDENTITY, 6), settings(4, 2));
    let two = run(&scene(6.0), &view(Mat4::IDENTITY, 6), settings(4, 2));
    assert_eq!(one.total().iter().map(|v| *v * 2.0).collect::<Vec<_>>(), two.total());
    assert_eq!(one, run(&scene(3.0), &view(Mat4::IDENTITY, 6), settings(4, 2)));
    let other = run(&scene(3.0), &view(Mat4::IDENTITY, 6), Settings { seed: 1, ..settings(4, 2) });
    assert_ne!(one.indirect, other.indirect);
}

/// A black surface facing up, seen from above.
fn blank() -> Face {
    Face {
        position: Vec3::ZERO,
        normal: Vec3::Y,
        lobe: Vec3::Y,
        geometric: Vec3::Y,
        to_viewer: Vec3::Y,
        albedo: Vec3::ZERO,
        base: Vec3::ONE,
        f0: Vec3::ZERO,
        roughness: 1.0,
        emission: Vec3::ZERO,
        unlit: false,
        front: true,
        double_sided: false,
        mirror: false,
        transmission: 0.0,
        ior: 1.5,
    }
}

#[test]
fn the_specular_lobe_reflects_no_more_than_it_gets() {
    // White metal under a sky of many directional lights would need an integral; one light, integrated over viewers:
    // ∫ f cos dω ≤ 1 by reciprocity.
    for roughness in [0.2f32, 0.4, 0.7, 1.0] {
        for cosine in [0.2f32, 0.7, 1.0] {
            let to_light = Vec3::new((1.0 - cosine * cosine).sqrt(), cosine, 0.0);
            let n = 600;
            let mut sum = 0.0f64;
            for i in 0..n {
                for j in 0..n {
                    let c = (i as f32 + 0.5) / n as f32;
                    let phi = (j as f32 + 0.5) / n as f32 * 2.0 * PI;
                    let s = (1.0 - c * c).sqrt();
                    let face = Face {
                        to_viewer: Vec3::new(s * phi.cos(), c, s * phi.sin()),
                        f0: Vec3::ONE,
                        roughness,
                        ..blank()
                    };
                    // Specular BRDF · cos of the viewer instead of the light's.
                    let [n3, v, l] = [face.normal, face.to_viewer, to_light].map(Vec3::as_dvec3);
                    let facets = face.matter().facets(n3, v, l).x;
                    sum += facets / f64::from(cosine) * f64::from(c) * f64::from(2.0 * PI) / f64::from(n * n);
                }
            }
            assert!(sum < 1.001, "roughness {roughness}, cosine {cosine}: {sum}");
            assert!(roughness > 0.3 || sum > 0.9, "roughness {roughness}, cosine {cosine}: {sum}");
        }
    }
}

#[test]
fn scattering_estimates_the_integral_of_what_it_samples() {
    // The same albedo (share of light from everywhere that is reflected) by quadrature and by the sampler.
    for (roughness, slant) in [(0.1f32, 0.3f32), (0.3, 0.9), (0.7, 0.5), (1.0, 0.2)] {
        let face = Face {
            to_viewer: Vec3::new((1.0 - slant * slant).sqrt(), slant, 0.0),
            albedo: Vec3::splat(0.3),
            f0: Vec3::splat(0.6),
            roughness,
            ..blank()
        };
        let (n, m) = (2000, 4000);
        let mut wanted = 0.0f64;
        for i in 0..n {
            for j in 0..m {
                let c = (i as f32 + 0.5) / n as f32;
                let (s, phi) = ((1.0 - c * c).sqrt(), (j as f32 + 0.5) / m as f32 * 2.0 * PI);
                wanted += f64::from(face.rough(Vec3::new(s * phi.cos(), c, s * phi.sin()), false).x);
            }
        }
        wanted *= std::f64::consts::TAU / f64::from(n * m);
        let mut random = Random::new(7, 3);
        let count = 200_000;
        let (mut sum, mut squares) = (0.0f64, 0.0f64);
        for _ in 0..count {
            let weight = face.scatter(false, &mut random).map_or(0.0, |(_, w)| f64::from(w.x));
            (sum, squares) = (sum + weight, squares + weight * weight);
        }
        let mean = sum / f64::from(count);
        let error = ((squares / f64::from(count) - mean * mean) / f64::from(count)).sqrt();
        assert!((mean - wanted).abs() < 4.0 * error + 1e-4, "roughness {roughness}: {mean} ± {error}, not {wanted}");
    }
}

#[test]
fn fresnel_agrees_with_known_values() {
    // Normal incidence ((n − 1) / (n + 1))², Brewster's angle, total reflection.
    assert!((scatter::fresnel(1.0, 1.0 / 1.5).0 - 0.04).abs() < 1e-6);
    let brewster = 1.5f32.atan();
    let half_of_s = 0.5 * ((1.5f32.powi(2) - 1.0) / (1.5f32.powi(2) + 1.0)).powi(2);
    assert!((scatter::fresnel(brewster.cos(), 1.0 / 1.5).0 - half_of_s).abs() < 1e-6);
    assert_eq!(scatter::fresnel(0.5, 1.5).0, 1.0);
}

/// A cube from −1 to 1.
fn cube() -> Primitive {
    let mut p = Primitive::default();
    for face in 0..6 {
        let turn = match face {
            0..4 => Mat4::from_rotation_x(face as f32 * PI / 2.0),
            _ => Mat4::from_rotation_z((face as f32 - 4.5) * PI),
        };
        let first = p.positions.len() as u32;
        let side = ground(1.0);
        p.positions.extend(side.positions.iter().map(|q| turn.transform_point3(*q + Vec3::Y).round()));
        p.normals.extend(side.normals.iter().map(|n| turn.transform_vector3(*n).round()));
        p.tangents.extend(side.tangents);
        p.indices.extend(side.indices.iter().map(|i| i + first));
    }
    p
}

/// Light of 5 W/(sr·m²) from everywhere; in it a body.
fn body_in_a_furnace(material: Material) -> Scene {
    let mut scene = scene(flat(sphere(4.0, true)), Material::emitter("", Vec3::splat(5.0)));
    scene.meshes.push(Mesh { primitives: vec![Primitive { material: 1, ..cube() }], ..Mesh::default() });
    let local = Transform::Matrix(Mat4::from_rotation_y(0.5) * Mat4::from_rotation_x(0.4));
    scene.nodes.push(Node { mesh: Some(1), local, ..Node::default() });
    scene.materials.push(material);
    scene
}

#[test]
fn clear_glass_and_white_mirrors_vanish_in_even_light() {
    let glass = Material { transmission: 1.0, ..Material::diffuse("", Vec3::ONE) };
    let thin = Material { double_sided: true, ..glass.clone() };
    let mirror = Material { roughness: 0.0, ..Material::default() };
    for material in [glass, thin, mirror] {
        let scene = body_in_a_furnace(material);
        let view = view(Mat4::from_translation(Vec3::Z * 3.0), 8);
        let settings = Settings { samples: 16, bounces: 0, specular_bounces: 200, ..Settings::default() };
        for emission in run(&scene, &view, settings).emission {
            assert_close(emission, Vec3::splat(5.0), 1e-4);
        }
    }
}

#[test]
fn a_pane_tints_and_does_not_bend() {
    let tint = Vec3::new(0.9, 0.5, 0.25);
    let pane = Material { transmission: 1.0, double_sided: true, ..Material::diffuse("", tint) };
    let mut scene = scene(ground(50.0), pane);
    let mut environment = Environment::constant(Vec3::ZERO);
    // Bright above, dark below.
    (environment.width, environment.height) = (2, 2);
    environment.pixels = vec![Vec3::ZERO, Vec3::ZERO, Vec3::splat(2.0), Vec3::splat(2.0)];
    scene.environment = Some(environment);
    let layers = run(&scene, &from_above(1), Settings { samples: 60_000, bounces: 0, ..Settings::default() });
    // 2R / (1 + R) is reflected in all.
    let r = 2.0 * 0.04 / 1.04;
    assert_close(layers.emission[0], tint * (1.0 - r) * 2.0, 0.01);
}

#[test]
fn lamps_give_the_same_light_by_points_and_by_rays() {
    let mut scene = scene(ground(5.0), Material { roughness: 0.4, metallic: 0.3, ..Material::diffuse("", ALBEDO) });
    scene.meshes.push(Mesh { primitives: vec![Primitive { material: 1, ..ground(1.0) }], ..Mesh::default() });
    scene.materials.push(Material::emitter("", Vec3::new(4.0, 5.0, 6.0)));
    let over = Mat4::from_translation(Vec3::new(0.5, 2.0, 0.0)) * Mat4::from_rotation_x(PI);
    scene.nodes.push(Node { mesh: Some(1), local: Transform::Matrix(over), ..Node::default() });
    let view = view(Mat4::from_translation(Vec3::new(0.0, 1.5, 0.0)) * Mat4::from_rotation_x(-PI / 2.0), 8);
    let rays = run(&scene, &view, Settings { samples: 4000, bounces: 0, ..Settings::default() });
    let points = run(&scene, &view, Settings { samples: 500, bounces: 0, sample_lamps: true, ..Settings::default() });
    let mut chi = 0.0;
    for i in 0..64 {
        let (d, v) = (rays.direct[i].y - points.direct[i].y, rays.variance.direct[i].y + points.variance.direct[i].y);
        chi += d * d / v;
        assert!(d.abs() < 5.0 * v.sqrt(), "pixel {i}: {d} with a deviation of {}", v.sqrt());
    }
    assert!((35.0..100.0).contains(&chi), "{chi}");
}

#[test]
fn sources_add_up() {
    let mut scene = with_light(
        scene(ground(5.0), Material::diffuse("", ALBEDO)),
        LightKind::Point { range: None },
        3.0,
        Mat4::from_translation(Vec3::Y),
    );
    scene.environment = Some(Environment::constant(Vec3::ONE));
    scene.materials[0].emissive = Vec3::X;
    let with = |sources| run(&scene, &from_above(4), Settings { sources, ..settings(16, 1) }).total();
    let parts = [Sources::PUNCTUAL, Sources::EMISSIVE, Sources::ENVIRONMENT].map(with);
    for (i, all) in with(Sources::ALL).iter().enumerate() {
        assert_close(parts[0][i] + parts[1][i] + parts[2][i], *all, 1e-5);
    }
}

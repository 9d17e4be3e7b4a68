//! Light of the environment on bare surfaces by image-space radiosity against brute force over the pixels of the environment.

use crate::common;
use crate::scene_kit;
use crate::scene_kit::{PI, mesh, place, sphere};
use glam::{DVec3, Mat4, Quat, Vec2, Vec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    graph::{Graph, Runner},
    passes::ambient::Irradiance,
    resident::Resident,
    scene::{
        Environment, Material, Scene,
        environment::{self, direction_from_uv, solid_angle},
    },
    techniques::isr,
};

/// ∫ L max(n·d, 0) dω over the pixels as they stand in the picture, W/m².
fn brute_force(sky: &Environment, n: Vec3) -> Vec3 {
    let turned = Quat::from_rotation_y(sky.rotation);
    let mut sum = DVec3::ZERO;
    for (y, row) in sky.pixels.chunks_exact(sky.width as usize).enumerate() {
        let angle = solid_angle(sky.width, sky.height, y as u32);
        for (x, pixel) in row.iter().enumerate() {
            let uv = Vec2::new((x as f32 + 0.5) / sky.width as f32, (y as f32 + 0.5) / sky.height as f32);
            let cosine = (turned * direction_from_uv(uv)).dot(n).max(0.0);
            sum += pixel.as_dvec3() * (f64::from(cosine) * angle);
        }
    }
    sum.as_vec3() * sky.scale
}

/// Irradiance on a white ball (W/m²) with the normals of the pixels.
fn ball(gpu: &Gpu, sky: &Environment) -> Vec<(Vec3, Vec3)> {
    let mut scene = Scene { environment: Some(sky.clone()), ..Scene::default() };
    // Without gloss; a reflectance of 1 is exact in eight bits.
    let white = Material { ior: 1.0, ..Material::diffuse("white", Vec3::ONE) };
    let one = mesh(&mut scene, sphere(24), white);
    place(&mut scene, one, Mat4::IDENTITY);
    let ambient = Irradiance::from(&scene);
    let settings = isr::Settings { occlusion: false, indirect: false, ..isr::Settings::default() };
    let settings = isr::PictureSettings { isr: settings, ..Default::default() };
    let mut out = Vec::new();
    for eye in [Vec3::new(0.3, 0.4, 2.6), Vec3::new(-0.2, -0.5, -2.6)] {
        let view = scene_kit::view(eye, Vec3::ZERO, [24, 24]);
        let mut resident = Resident::new(gpu, &scene).unwrap();
        let mut graph = Graph::new("ball");
        let handles = resident.frame(&mut graph, &scene, 0.0);
        let picture = isr::picture(&mut graph, &handles, &view, ambient.clone(), &settings).unwrap();
        let tokens =
            [picture.outputs.indirect, picture.gbuffer.normal, picture.gbuffer.depth].map(|i| graph.read_image(i));
        let frame = Runner::new(gpu).run(graph).unwrap();
        let [light, normal, depth] = tokens.map(|token| frame.image(token).to_f32());
        let seen = light.iter().zip(normal).zip(depth).filter(|(_, depth)| depth[0] < 1.0);
        for ((light, normal), _) in seen {
            out.push((octahedral(normal), Vec3::new(light[0], light[1], light[2]) * PI));
        }
    }
    assert!(out.len() > 200, "{}", out.len());
    out
}

fn octahedral(c: [f32; 4]) -> Vec3 {
    let p = Vec2::new(c[0], c[1]) * 2.0 - 1.0;
    let mut n = Vec3::new(p.x, p.y, 1.0 - p.x.abs() - p.y.abs());
    let t = (-n.z).max(0.0);
    n.x -= t.copysign(n.x);
    n.y -= t.copysign(n.y);
    n.normalize_or_zero()
}

/// Largest relative difference in any channel.
fn worst(lit: &[(Vec3, Vec3)], exact: impl Fn(Vec3) -> Vec3) -> f32 {
    lit.iter().map(|(n, light)| ((*light / exact(*n)) - 1.0).abs().max_element()).fold(0.0, f32::max)
}

#[test]
fn a_ball_under_a_sky_without_symmetry_has_its_irradiance() {
    let (width, height) = (64, 32);
    let at =
        |i: u32| Vec2::new((i % width) as f32 + 0.5, (i / width) as f32 + 0.5) / Vec2::new(width as f32, height as f32);
    let light = |d: Vec3| {
        let blob = |x: f32, y: f32, z: f32| d.dot(Vec3::new(x, y, z).normalize()).max(0.0).powi(8);
        Vec3::new(0.3 + 4.0 * blob(0.3, 0.8, -0.5), 0.2 + 3.0 * blob(-0.9, 0.2, 0.4), 0.4 + 2.0 * blob(0.1, -0.5, 0.8))
    };
    let pixels = (0..width * height).map(|i| light(direction_from_uv(at(i)))).collect();
    let sky = Environment { name: String::new(), width, height, pixels, rotation: 0.8, scale: 2.0 };
    with_gpu(|gpu| {
        let lit = ball(gpu, &sky);
        // The table's own function at these normals: only the rounding of the image is between them.
        let table = Irradiance::of(&sky);
        let twin = worst(&lit, |n| table.at(n));
        let exact = worst(&lit, |n| brute_force(&sky, n));
        println!("from the twin {twin}, from brute force {exact}");
        // 16-bit floats have 11 bits.
        assert!(twin < 1.5e-3, "{twin}");
        assert!(exact < 0.01, "{exact}");
    });
}

#[test]
fn small_lights_of_several_colours_light_a_ball_by_their_cosines() {
    let (width, height) = (128, 64);
    let mut pixels = vec![Vec3::new(0.2, 0.3, 0.4); (width * height) as usize];
    // Two pixels that send more than all others, each mostly of one colour.
    for (x, y, light) in [(70, 12, Vec3::new(900.0, 60.0, 0.0)), (20, 25, Vec3::new(0.0, 40.0, 700.0))] {
        pixels[y * width as usize + x] = light;
    }
    let sky = Environment { name: String::new(), width, height, pixels, rotation: 0.3, scale: 1.5 };
    with_gpu(|gpu| {
        let lit = ball(gpu, &sky);
        let off = worst(&lit, |n| brute_force(&sky, n));
        println!("off by {off}");
        assert!(off < 0.02, "{off}");
    });
}

#[test]
fn a_ball_under_the_least_of_skies_is_evenly_lit() {
    with_gpu(|gpu| {
        for (width, height) in [(1, 1), (2, 1), (4, 2)] {
            let sky = Environment {
                width,
                height,
                pixels: vec![Vec3::new(0.5, 1.0, 2.0); (width * height) as usize],
                ..Environment::constant(Vec3::ONE)
            };
            let off = worst(&ball(gpu, &sky), |_| PI * Vec3::new(0.5, 1.0, 2.0));
            assert!(off < 1.5e-3, "{width}×{height}: {off}");
        }
    });
}

#[test]
fn photographed_skies_light_every_normal_within_a_hundredth() {
    let folder = common::root().join("../shared/assets/environments");
    if !folder.is_dir() {
        assert!(std::env::var_os("CI").is_none(), "{} is missing, and CI is set", folder.display());
        eprintln!("SKIPPED: {} is missing", folder.display());
        return;
    }
    for name in ["uffizi_256.hdr", "grace_latlong.exr", "royal_esplanade_1k.hdr", "ennis_256.hdr", "blender_sunset.exr"]
    {
        let sky = environment::load(&folder.join(name), &Default::default()).unwrap().0;
        let begun = std::time::Instant::now();
        let table = Irradiance::of(&sky);
        let spent = begun.elapsed();
        let mut worst = 0.0f32;
        for i in 0..150 {
            let (u, v) = ((i as f32 * 0.754_877_7 + 0.31).fract(), (i as f32 * 0.569_840_3 + 0.77).fract());
            let (y, phi) = (2.0 * u - 1.0, 2.0 * PI * v);
            let r = (1.0 - y * y).max(0.0).sqrt();
            let n = Vec3::new(r * phi.cos(), y, r * phi.sin());
            worst = worst.max((table.at(n) / brute_force(&sky, n) - 1.0).abs().max_element());
        }
        println!("{name}: {}×{}, off by {worst}, {spent:?}", sky.width, sky.height);
        assert!(worst < 0.01, "{name}: {worst}");
    }
}

//! Glass read from OBJ, and mirrors under strong normal maps: the path tracer, its CPU twin, and the Whitted rays of igi.

use crate::igi_lab;
use crate::tracer_lab::{Stage, flat_view, render, view};
use glam::{DVec3, Vec2, Vec3, Vec4, vec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    reference::path,
    scene::{Environment, LoadOptions, Material, Pose, Scene, Texture, TextureRef, View, bvh::Bvh, load},
    techniques::igi,
    tracer::{Filter, Settings as Tracing},
};
use std::fmt::Write;

/// The picture by each of the three, three numbers a pixel.
fn pictures(gpu: &Gpu, scene: &Scene, view: &View, samples: u32) -> [(&'static str, Vec<DVec3>); 3] {
    let tracing = Tracing { bounces: 1, specular_bounces: 12, filter: Filter::Centre, ..Tracing::default() };
    let layers = render(gpu, scene, view, &tracing, samples);
    let traced = layers.layer("").unwrap().data.chunks_exact(3).map(|p| Vec3::from_slice(p).as_dvec3()).collect();
    let pose = Pose::rest(scene);
    let slow = path::Settings { samples, bounces: 1, specular_bounces: 12, ..path::Settings::default() };
    let twin = path::trace(scene, &pose, &Bvh::build(scene, &pose), view, &slow).total();
    let settings =
        igi::Settings { indirect: false, specular_depth: 12, direct_samples: samples, ..igi::Settings::default() };
    let mut studio = igi_lab::Studio::new(gpu, scene);
    let mut sum = vec![DVec3::ZERO; twin.len()];
    // Trees deeper than their nodes choose at random.
    for seed in 0..8 {
        let shown = studio.render(view, &settings, seed);
        sum.iter_mut().zip(&shown.total).for_each(|(sum, p)| *sum += Vec4::from_array(*p).truncate().as_dvec3() / 8.0);
    }
    [("reference", traced), ("twin", twin.iter().map(|p| p.as_dvec3()).collect()), ("igi", sum)]
}

/// A ball of radius 1 as a modeller writes it; every corner once.
fn ball_as_obj() -> String {
    let (rings, sectors) = (32u32, 64u32);
    let mut text = "mtllib ball.mtl\nusemtl glass\nv 0 1 0\nv 0 -1 0\n".to_owned();
    for ring in 1..rings {
        for sector in 0..sectors {
            let polar = std::f64::consts::PI * f64::from(ring) / f64::from(rings);
            let azimuth = std::f64::consts::TAU * f64::from(sector) / f64::from(sectors);
            let (x, z) = (polar.sin() * azimuth.sin(), polar.sin() * azimuth.cos());
            writeln!(text, "v {x:.7} {:.7} {z:.7}", polar.cos()).unwrap();
        }
    }
    let at = |ring: u32, sector: u32| match ring {
        0 => 1,
        _ if ring == rings => 2,
        _ => 3 + (ring - 1) * sectors + sector % sectors,
    };
    for (ring, sector) in (0..rings).flat_map(|ring| (0..sectors).map(move |sector| (ring, sector))) {
        let mut corners = vec![at(ring, sector), at(ring + 1, sector), at(ring + 1, sector + 1), at(ring, sector + 1)];
        corners.dedup();
        let corners: Vec<String> = corners.iter().map(u32::to_string).collect();
        writeln!(text, "f {}", corners.join(" ")).unwrap();
    }
    text
}

#[test]
fn a_ball_of_glass_from_obj_turns_the_sky_upside_down() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("ball.obj"), ball_as_obj()).unwrap();
    std::fs::write(folder.path().join("ball.mtl"), "newmtl glass\nKd 0 0 0\nKs 1 1 1\nTf 1 1 1\nNi 1.5\nillum 7\n")
        .unwrap();
    let mut scene = load(folder.path().join("ball.obj"), &LoadOptions::default()).unwrap();
    // 1 above, 0.1 below.
    let pixels = (0..8 * 256).map(|i| Vec3::splat(if i / 8 < 128 { 1.0 } else { 0.1 })).collect();
    scene.environment = Some(Environment { width: 8, height: 256, pixels, ..Environment::constant(Vec3::ONE) });
    with_gpu(|gpu| {
        const SIDE: usize = 32;
        let seen = view(vec3(0.0, 0.0, 8.0), Vec3::ZERO, 15.0, [SIDE as u32; 2]);
        for (name, picture) in pictures(gpu, &scene, &seen, 48) {
            let (mut halves, mut counts) = ([0.0; 2], [0.0; 2]);
            for (i, pixel) in picture.iter().enumerate() {
                let [x, y] = [i % SIDE, i / SIDE].map(|k| (k as f64 + 0.5) / SIDE as f64 * 2.0 - 1.0);
                // 8 tan 7.5° is 1.053; at the rim there is more of the mirrored sky.
                if x.hypot(y) * 1.053 < 0.8 {
                    halves[usize::from(y > 0.0)] += pixel.x;
                    counts[usize::from(y > 0.0)] += 1.0;
                }
            }
            let [upper, lower] = [halves[0] / counts[0], halves[1] / counts[1]];
            println!("{name}: {upper:.4} in the upper half, {lower:.4} in the lower");
            // An empty bubble has 0.93 and 0.14.
            assert!((upper - 0.14).abs() < 0.03 && (lower - 0.965).abs() < 0.03, "{name}: {upper} and {lower}");
        }
    });
}

/// A white metal under a normal map that leans everywhere alike, over black.
fn leaning(degrees: f32, roughness: f32) -> Stage {
    let mut stage = Stage::new();
    let lean = vec3(degrees.to_radians().sin(), 0.0, degrees.to_radians().cos());
    let [r, g, b] = (lean * 127.5 + 127.5).round().to_array().map(|c| c as u8);
    stage.scene.textures.push(Texture { name: "lean".into(), width: 1, height: 1, rgba: vec![[r, g, b, 255]] });
    let metal = stage.material(Material {
        metallic: 1.0,
        roughness,
        normal_texture: Some(TextureRef::new(0)),
        ..Material::diffuse("metal", Vec3::ONE)
    });
    let node = stage.quad(metal, vec3(-5.0, 0.0, -5.0), Vec3::Z * 10.0, Vec3::X * 10.0);
    let mesh = stage.scene.nodes[node].mesh.unwrap() as usize;
    let primitive = &mut stage.scene.meshes[mesh].primitives[0];
    primitive.uvs = vec![vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y]];
    primitive.tangents = vec![Vec4::new(1.0, 0.0, 0.0, 1.0); 4];
    let black = stage.material(Material { ior: 1.0, ..Material::diffuse("black", Vec3::ZERO) });
    stage.quad(black, vec3(-50.0, -0.05, -50.0), Vec3::Z * 100.0, Vec3::X * 100.0);
    stage.scene.environment = Some(Environment::constant(Vec3::ONE));
    stage
}

#[test]
fn a_mirror_shows_no_inside_of_itself_however_its_normal_map_leans() {
    with_gpu(|gpu| {
        for lean in [20.0f32, 45.0, 70.0] {
            let scene = leaning(lean, 0.0).scene;
            for angle in [-75.0f32, -40.0, 0.0, 40.0, 75.0] {
                let from = vec3(angle.to_radians().sin(), angle.to_radians().cos(), 0.0);
                let seen = flat_view(3.0 * from, Vec3::ZERO, 0.05, [4, 4]);
                for (name, picture) in pictures(gpu, &scene, &seen, 2) {
                    let mean = picture.iter().map(|p| p.x).sum::<f64>() / picture.len() as f64;
                    assert!((mean - 1.0).abs() < 2e-3, "{name}: {mean} where the map leans {lean}°, seen at {angle}°");
                }
            }
        }
    });
}

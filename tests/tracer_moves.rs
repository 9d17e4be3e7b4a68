//! Lamps that are moved, mirrored and deformed by `Tracer::set_pose` shine from where they are: against a tracer made for the
//! pose, and against the CPU's path tracer.

use crate::tracer_lab::{Stage, deviation, luminance, mean, view};
use glam::{Mat4, Quat, Vec3, vec3};
use lucerna::{
    gpu::testing::with_gpu,
    image::Layers,
    reference::path,
    scene::{Material, MorphTarget, Pose, Scene, bvh::Bvh},
    tracer::{Settings, Sources, Tracer},
};

/// A floor and a wall under a panel that can grow to four times its area, a ball that shines, and a point light.
fn room() -> Scene {
    let mut stage = Stage::new();
    let floor = stage.material(Material::diffuse("floor", vec3(0.7, 0.6, 0.5)));
    stage.quad(floor, vec3(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0);
    stage.quad(floor, vec3(-2.0, 0.0, -2.0), Vec3::X * 4.0, Vec3::Y * 3.0);
    let panel = stage.emitter(vec3(4.0, 3.0, 2.0));
    stage.quad(panel, vec3(-0.25, 2.0, -0.25), Vec3::X * 0.5, Vec3::Z * 0.5);
    let outwards = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, z)| vec3(x, 0.0, z) * 0.25);
    stage.scene.meshes[2].primitives[0].morphs =
        vec![MorphTarget { positions: outwards.to_vec(), normals: vec![Vec3::ZERO; 4], ..MorphTarget::default() }];
    stage.scene.meshes[2].weights = vec![0.0];
    let ball = stage.emitter(vec3(1.0, 2.0, 3.0));
    stage.sphere(ball, vec3(1.0, 0.4, 0.6), 0.3, 8, false);
    stage.point(vec3(-1.2, 1.5, 0.5), Vec3::splat(0.5));
    stage.scene.validate().unwrap();
    stage.scene
}

const PANEL: usize = 2;
const BALL: usize = 3;
const POINT: usize = 4;

fn data(layers: &Layers) -> &[f32] {
    &layers.layer("").unwrap().data
}

#[test]
fn lamps_shine_from_where_the_pose_puts_them() {
    let scene = room();
    let rest = Pose::rest(&scene);
    let mut grown = rest.clone();
    grown.weights[PANEL] = vec![1.0];
    let mut moved = rest.clone();
    moved.world[PANEL] = Mat4::from_translation(vec3(0.6, -0.7, 0.3)) * Mat4::from_rotation_z(0.4);
    // Mirrored: the triangles wind the other way, and still shine outwards.
    moved.world[BALL] = Mat4::from_translation(vec3(0.3, 0.5, 0.0)) * Mat4::from_scale(vec3(-1.0, 1.4, 0.7));
    moved.world[POINT] = Mat4::from_rotation_translation(Quat::IDENTITY, vec3(1.0, 0.5, 1.0));
    let seen = view(vec3(0.4, 1.8, 4.5), vec3(0.0, 0.8, 0.0), 45.0, [32, 24]);
    with_gpu(|gpu| {
        let mut tracer = Tracer::new(gpu, &scene, &rest).unwrap();
        let mut pictures = Vec::new();
        for (name, pose) in [("at rest", &rest), ("grown", &grown), ("moved", &moved), ("back", &rest)] {
            let bvh = Bvh::build(&scene, pose);
            tracer.set_pose(pose);
            let settings = Settings { bounces: 0, ..Settings::default() };
            let again = tracer.render(&seen, &settings, 24).unwrap();
            let fresh = Tracer::new(gpu, &scene, pose).unwrap().render(&seen, &settings, 24).unwrap();
            // Their trees of triangles differ, so rays through edges may.
            let differ = data(&again).iter().zip(data(&fresh)).filter(|(a, b)| a != b).count();
            assert!(differ * 100 <= data(&again).len(), "{name}: {differ} values differ from a new tracer's");
            // One sort of light at a time: what one lamp lacks another must not cover.
            for (sources, on_cpu) in
                [(Sources::Emissive, path::Sources::EMISSIVE), (Sources::Punctual, path::Sources::PUNCTUAL)]
            {
                let device = tracer.render(&seen, &Settings { sources, ..settings.clone() }, 64).unwrap();
                let asked = path::Settings {
                    samples: 100,
                    bounces: 0,
                    jitter: true,
                    sample_lamps: true,
                    sources: on_cpu,
                    ..Default::default()
                };
                let cpu = path::trace(&scene, pose, &bvh, &seen, &asked);
                let total = cpu.total();
                let n = total.len() as f64;
                let expected = luminance([0, 1, 2].map(|c| total.iter().map(|p| f64::from(p[c])).sum::<f64>() / n));
                let noise = luminance(
                    [0, 1, 2].map(|c| cpu.variance.total.iter().map(|v| f64::from(v[c])).sum::<f64>().sqrt() / n),
                );
                let (found, sigma) = (luminance(mean(&device, "")), deviation(&device).hypot(noise));
                println!("{name}, {sources:?}: {found:.5}, CPU {expected:.5}, σ {sigma:.5}");
                assert!(
                    (found - expected).abs() < 4.5 * sigma + 1e-3 * expected,
                    "{name}, {sources:?}: {found} {expected}"
                );
                assert!(sigma < 0.03 * expected, "too noisy to say anything");
            }
            pictures.push(again);
        }
        let light = |i: usize| luminance(mean(&pictures[i], "direct"));
        assert!(light(1) > 1.5 * light(0) && light(2) != light(0), "{} {} {}", light(0), light(1), light(2));
        assert!(data(&pictures[0]) == data(&pictures[3]), "back at rest it is the first picture");
    });
}

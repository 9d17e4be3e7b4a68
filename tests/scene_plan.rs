//! The graphs of the scene's passes: every barrier of their plans is needed.

use crate::scene_kit::*;
use glam::{Mat4, Vec3};
use lucerna::{
    gpu::testing::with_gpu,
    graph::{Extent, Format, Graph, Runner, testing::every_barrier_matters},
    passes::{gbuffer, shadow, skybox},
    resident::Resident,
    scene::{AlphaMode, LightKind, Material, MorphTarget, Scene},
};

/// Something of everything: masked, blended, mirrored, double-sided, morphed; three kinds of light.
fn all_sorts() -> Scene {
    let mut scene = Scene::default();
    let ground = mesh(&mut scene, square(), Material::diffuse("", Vec3::splat(0.5)));
    place(&mut scene, ground, Mat4::from_scale(Vec3::splat(4.0)));
    let mut leaf = Material { double_sided: true, ..Material::diffuse("", Vec3::ONE) };
    for alpha in [AlphaMode::Mask { cutoff: 0.5 }, AlphaMode::Blend] {
        leaf.alpha = alpha;
        leaf.base_color.w = 0.6;
        let leaf = mesh(&mut scene, square(), leaf.clone());
        let height = Vec3::Y * scene.nodes.len() as f32;
        place(&mut scene, leaf, Mat4::from_translation(height));
    }
    let mut ball = sphere(6);
    let positions = ball.positions.clone();
    ball.morphs = vec![MorphTarget { positions, ..MorphTarget::default() }];
    let ball = mesh(&mut scene, ball, Material::diffuse("", Vec3::ONE));
    let node = place(&mut scene, ball, Mat4::from_scale(Vec3::new(-1.0, 1.0, 1.0)));
    scene.nodes[node].weights = vec![0.3];
    light(&mut scene, LightKind::Directional, look(Vec3::new(1.0, 3.0, 0.5), Vec3::ZERO));
    light(&mut scene, LightKind::Point { range: None }, Mat4::from_translation(Vec3::new(0.0, 5.0, 1.0)));
    let spot = LightKind::Spot { range: Some(9.0), inner: 0.2, outer: 0.5 };
    light(&mut scene, spot, look(Vec3::new(2.0, 4.0, 2.0), Vec3::ZERO));
    scene
}

#[test]
fn every_barrier_of_gbuffer_shadows_and_sky_matters() {
    let scene = all_sorts();
    let view = view(Vec3::new(0.0, 4.0, 6.0), Vec3::ZERO, [64, 48]);
    with_gpu(|gpu| {
        let mut resident = Resident::new(gpu, &scene).unwrap();
        let mut runner = Runner::new(gpu);
        for kind in [shadow::Kind::Off, shadow::Kind::Pcf, shadow::Kind::Exponential] {
            let mut graph = Graph::new("scene");
            let handles = resident.frame(&mut graph, &scene, 0.0);
            let buffers = gbuffer::draw(&mut graph, &handles, &view, &gbuffer::Settings::default());
            let settings = shadow::Settings { kind, size: 64, ..Default::default() };
            shadow::draw(&mut graph, &handles, &view, &settings);
            let sky = graph.image("sky", Format::RGBA16F, Extent::from(view.extent));
            graph.clear(sky, [0.0; 4]);
            skybox::draw(&mut graph, &handles, &buffers, Vec3::ONE, sky);
            for image in [buffers.albedo, buffers.depth, sky] {
                graph.read_image(image);
            }
            let plan = every_barrier_matters(&graph);
            assert!(plan.barriers.len() > 5);
            runner.run(graph).unwrap();
        }
    });
}

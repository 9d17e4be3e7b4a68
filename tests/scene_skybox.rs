//! The environment behind a scene: right directions, only where nothing stands.

use crate::scene_kit::*;
use glam::{Mat4, Vec2, Vec3};
use lucerna::{
    gpu::testing::with_gpu,
    graph::{Extent, Format},
    passes::{gbuffer, skybox},
    scene::{Environment, Material, Scene},
};

/// Radiance that names its direction: (d + 1) as a colour, in a map fine enough to be read back.
fn compass(rotation: f32) -> Environment {
    let (width, height) = (256, 128);
    let pixels = (0..width * height)
        .map(|i| {
            let phi = 2.0 * PI * (((i % width) as f32 + 0.5) / width as f32 - 0.5);
            let theta = PI * ((i / width) as f32 + 0.5) / height as f32;
            // By the definition: the centre looks down −Z, u grows towards +X there.
            Vec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos()) + 1.0
        })
        .collect();
    Environment { name: String::new(), width, height, pixels, rotation, scale: 2.0 }
}

#[test]
fn every_background_pixel_shows_its_direction() {
    let extent = [48, 32];
    for (rotation, target) in [(0.0, Vec3::NEG_Z), (0.7, Vec3::NEG_Z), (0.0, Vec3::new(1.0, 0.8, 0.3)), (-2.0, Vec3::X)]
    {
        let mut scene = Scene { environment: Some(compass(rotation)), ..Scene::default() };
        let ball = mesh(&mut scene, sphere(24), Material::diffuse("", Vec3::ONE));
        place(&mut scene, ball, Mat4::from_translation(target.normalize() * 5.0));
        let view = view(Vec3::ZERO, target, extent);
        with_gpu(|gpu| {
            let (frame, [sky, depth]) = frame(gpu, &scene, |graph, handles| {
                let buffers = gbuffer::draw(graph, handles, &view, &gbuffer::Settings::default());
                let sky = graph.image("sky", Format::RGBA16F, Extent::from(extent));
                graph.clear(sky, [9.0; 4]);
                skybox::draw(graph, handles, &buffers, Vec3::splat(0.5), sky);
                [sky, buffers.depth].map(|image| graph.read_image(image))
            });
            let (sky, depth) = (frame.image(sky).to_f32(), frame.image(depth).to_f32());
            let mut background = 0;
            for i in 0..sky.len() {
                if depth[i][0] < 1.0 {
                    assert_eq!(sky[i], [9.0; 4], "surfaces keep what the target has");
                    continue;
                }
                background += 1;
                let uv = Vec2::new((i % 48) as f32 + 0.5, (i / 48) as f32 + 0.5) / Vec2::new(48.0, 32.0);
                let direction = (view.world_from_depth(uv, 1.0) - view.position).normalize();
                // The environment is turned by +rotation, so the map is read at the direction turned back.
                let read = glam::Quat::from_rotation_y(-rotation) * direction;
                let expected = 2.0 * (read + 1.0) + 0.5;
                let got = Vec3::new(sky[i][0], sky[i][1], sky[i][2]);
                assert!(got.abs_diff_eq(expected, 0.02), "rotation {rotation}, towards {direction}: {got} {expected}");
            }
            assert!(background > 400 && background < sky.len() - 20, "{background}");
        });
    }
}

//! Textures as the path tracer reads them.

use crate::scene_kit::{look, mesh, place, square};
use glam::{Mat4, Vec3};
use lucerna::{
    gpu::testing::with_gpu,
    scene::{Camera, Material, Pose, Projection, Sampler, Scene, Texture, TextureRef, View},
    tracer::{Filter, Settings, Tracer},
};

/// Light of all 256 codes, each of a texel of its own; `linear` filters between them, at the middle of each.
fn ramp(linear: bool) -> Vec<f32> {
    let mut scene = Scene::default();
    let rgba = (0..=255u8).map(|code| [code; 4]).collect();
    scene.textures.push(Texture { name: "ramp".into(), width: 256, height: 1, rgba });
    let sampler = Sampler { mag_linear: linear, min_linear: linear, ..Sampler::default() };
    let used = Some(TextureRef { sampler, ..TextureRef::new(0) });
    let glow = Material { emissive: Vec3::ONE, emissive_texture: used, ..Material::diffuse("glow", Vec3::ZERO) };
    let plate = mesh(&mut scene, square(), glow);
    place(&mut scene, plate, Mat4::IDENTITY);
    let half = 1.0 / 256.0;
    let projection = Projection::Orthographic { xmag: 1.0, ymag: half, znear: 0.1, zfar: 10.0 };
    let view = View::new(&Camera { name: String::new(), projection }, look(Vec3::Y, Vec3::ZERO), [256, 1]);
    let mut out = Vec::new();
    with_gpu(|gpu| {
        let settings = Settings { filter: Filter::Centre, bounces: 0, ..Settings::default() };
        let layers = Tracer::new(gpu, &scene, &Pose::rest(&scene)).unwrap().render(&view, &settings, 1).unwrap();
        let picture = &layers.layers[0];
        out = picture.data.chunks_exact(picture.channels.len()).map(|pixel| pixel[1]).collect();
        // Straight from above +X is to the left.
        out.reverse();
    });
    out
}

#[test]
fn every_srgb_code_has_its_exact_light() {
    for linear in [false, true] {
        let light = ramp(linear);
        let mut worst = 0.0f64;
        for (code, light) in light.iter().enumerate() {
            let v = code as f64 / 255.0;
            let exact = if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) };
            if code == 0 {
                assert_eq!(*light, 0.0);
                continue;
            }
            worst = worst.max((f64::from(*light) / exact - 1.0).abs());
        }
        println!("linear filter {linear}: off by {worst} at most");
        // Half floats have 11 bits: half of the last one is 4.9e-4. Where the filter blends neighbours, the place within a texel
        // (8 bits on most devices) is not exactly its middle.
        let allowed = if linear { 6e-4 } else { 4.9e-4 };
        assert!(light.is_empty() || worst < allowed, "linear filter {linear}: {worst}");
    }
}

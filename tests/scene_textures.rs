//! Material textures on the device: filtering and wrapping by the glTF sampler against a direct evaluation.

use crate::scene_kit::*;
use glam::{Vec2, Vec4};
use lucerna::{
    gpu::testing::with_gpu,
    scene::{Material, MipFilter, Sampler, Scene, Texture, TextureRef, Wrap},
    shaders::{test::texture as probe, types},
};

const W: i32 = 5;
const H: i32 = 3;

fn texel(x: i32, y: i32) -> Vec4 {
    Vec4::new(((x * 53 + y * 17) % 256) as f32, ((x * 5 + y * 101) % 256) as f32, 10.0 * x as f32, 20.0 * y as f32)
}

fn wrap(i: i32, size: i32, mode: Wrap) -> i32 {
    match mode {
        Wrap::Repeat => i.rem_euclid(size),
        Wrap::ClampToEdge => i.clamp(0, size - 1),
        Wrap::MirroredRepeat => {
            let m = i.rem_euclid(2 * size);
            if m < size { m } else { 2 * size - 1 - m }
        }
    }
}

/// Level 0 by the definition of the sampler.
fn expected(uv: Vec2, sampler: &Sampler) -> Vec4 {
    let at = |x: i32, y: i32| texel(wrap(x, W, sampler.wrap_u), wrap(y, H, sampler.wrap_v)) / 255.0;
    let p = uv * Vec2::new(W as f32, H as f32);
    if !sampler.mag_linear {
        return at(p.x.floor() as i32, p.y.floor() as i32);
    }
    let (low, f) = ((p - 0.5).floor(), (p - 0.5) - (p - 0.5).floor());
    let (x, y) = (low.x as i32, low.y as i32);
    let top = at(x, y).lerp(at(x + 1, y), f.x);
    let bottom = at(x, y + 1).lerp(at(x + 1, y + 1), f.x);
    top.lerp(bottom, f.y)
}

#[test]
fn wrapping_and_filtering_follow_the_sampler() {
    let wraps = [Wrap::Repeat, Wrap::ClampToEdge, Wrap::MirroredRepeat];
    let rgba: Vec<[u8; 4]> =
        (0..H).flat_map(|y| (0..W).map(move |x| texel(x, y).to_array().map(|v| v as u8))).collect();
    let uvs: Vec<Vec2> = (0..300)
        .map(|i| Vec2::new((i as f32 * 0.137).fract(), (i as f32 * 0.311).fract()) * 5.0 - 2.03)
        // Nearest filtering next to a boundary may round either way.
        .filter(|uv| {
            let p = *uv * Vec2::new(W as f32, H as f32);
            (p - p.round()).abs().min_element() > 0.02
        })
        .collect();
    with_gpu(|gpu| {
        for (wrap_u, wrap_v) in wraps.into_iter().flat_map(|u| wraps.map(|v| (u, v))) {
            for mag_linear in [true, false] {
                let sampler = Sampler { wrap_u, wrap_v, mag_linear, min_linear: true, mip: MipFilter::Linear };
                let mut scene = Scene::default();
                scene.textures.push(Texture {
                    name: String::new(),
                    width: W as u32,
                    height: H as u32,
                    rgba: rgba.clone(),
                });
                // A linear slot: texels come back as stored.
                let used = Some(TextureRef { sampler, ..TextureRef::new(0) });
                let material = Material { metallic_roughness_texture: used, ..Material::default() };
                mesh(&mut scene, square(), material);
                let probes: Vec<types::TextureProbe> = uvs
                    .iter()
                    .map(|uv| types::TextureProbe { uv: uv.to_array(), slot: 1, lod: -1.0, ..Default::default() })
                    .collect();
                let (frame, read) = frame(gpu, &scene, |graph, handles| {
                    let buffer = graph.buffer_from("probes", &probes);
                    let args =
                        probe::Args { probes: buffer, materials: handles.materials, scene_textures: handles.textures };
                    graph.compute(args, probes.len() as u32);
                    graph.read_buffer(buffer)
                });
                for probe in frame.buffer::<types::TextureProbe>(read) {
                    let want = expected(probe.uv.into(), &sampler);
                    // Hardware filters with eight bits of weight.
                    let error = (Vec4::from(probe.texel) - want).abs().max_element();
                    assert!(error < 0.006, "{sampler:?} at {:?}: {:?}, expected {want}", probe.uv, probe.texel);
                }
            }
        }
    });
}

#[test]
fn transforms_move_coordinates_and_base_colours_are_decoded() {
    // Red tells left from right, green upper from lower: sRGB 188 (linear 0.5) or black.
    let code = |first: bool| if first { 188 } else { 0 };
    let rgba = (0..64).map(|i| [code(i % 8 < 4), code(i / 8 < 4), 0, 255]).collect();
    let texture = Texture { name: String::new(), width: 8, height: 8, rgba };
    // A quarter turn, u' = v, v' = 1 − u, and one of everything.
    let transforms = [[0.0, 1.0, -1.0, 0.0, 0.0, 1.0], [0.7, 0.4, -0.9, 1.3, 0.15, -0.35]];
    for transform in transforms {
        let mut scene = Scene { textures: vec![texture.clone()], ..Scene::default() };
        let used = Some(TextureRef { transform, ..TextureRef::new(0) });
        mesh(&mut scene, square(), Material { base_color_texture: used, ..Material::default() });
        let [a, b, c, d, x, y] = transform;
        let moved = |uv: Vec2| Vec2::new(a * uv.x + b * uv.y + x, c * uv.x + d * uv.y + y);
        let uvs: Vec<Vec2> = (0..200)
            .map(|i| Vec2::new((i as f32 * 0.137).fract(), (i as f32 * 0.311).fract()) * 3.0 - 1.0)
            // Not where the filter blends halves.
            .filter(|uv| {
                let p = moved(*uv) * 2.0;
                (p - p.round()).abs().min_element() > 0.15
            })
            .collect();
        assert!(uvs.len() > 60);
        let probes: Vec<types::TextureProbe> =
            uvs.iter().map(|uv| types::TextureProbe { uv: uv.to_array(), ..Default::default() }).collect();
        with_gpu(|gpu| {
            let (frame, read) = frame(gpu, &scene, |graph, handles| {
                let buffer = graph.buffer_from("probes", &probes);
                let args =
                    probe::Args { probes: buffer, materials: handles.materials, scene_textures: handles.textures };
                graph.compute(args, probes.len() as u32);
                graph.read_buffer(buffer)
            });
            for probe in frame.buffer::<types::TextureProbe>(read) {
                let at = moved(probe.uv.into());
                let want = [at.x, at.y].map(|v| if v.rem_euclid(1.0) < 0.5 { 0.5 } else { 0.0 });
                let right = (0..2).all(|k| (probe.texel[k] - want[k]).abs() < 0.004);
                assert!(right, "{transform:?} at {:?}: {:?} instead of {want:?}", probe.uv, probe.texel);
            }
        });
    }
}

#[test]
fn mip_levels_are_chosen_by_the_sampler() {
    // Every other texel is white: level 0 is black or white, all others are half.
    let rgba = (0..64).map(|i| [if (i % 8 + i / 8) % 2 == 0 { 255 } else { 0 }; 4]).collect();
    let texture = Texture { name: String::new(), width: 8, height: 8, rgba };
    // The middle of texel (2, 2), which is white, at these levels of detail.
    let lods = [-1.0, 0.0, 0.4, 0.6, 1.0, 2.0, 9.0];
    let expected = [
        (MipFilter::Linear, [1.0, 1.0, 0.8, 0.7, 0.5, 0.5, 0.5]),
        (MipFilter::Nearest, [1.0, 1.0, 1.0, 0.5, 0.5, 0.5, 0.5]),
        (MipFilter::None, [1.0; 7]),
    ];
    with_gpu(|gpu| {
        for (mip, want) in expected {
            let sampler = Sampler { mip, ..Sampler::default() };
            let used = Some(TextureRef { sampler, ..TextureRef::new(0) });
            let mut scene = Scene { textures: vec![texture.clone()], ..Scene::default() };
            mesh(&mut scene, square(), Material { metallic_roughness_texture: used, ..Material::default() });
            let probes = lods.map(|lod| types::TextureProbe { uv: [2.5 / 8.0; 2], slot: 1, lod, ..Default::default() });
            let (frame, read) = frame(gpu, &scene, |graph, handles| {
                let buffer = graph.buffer_from("probes", &probes);
                let args =
                    probe::Args { probes: buffer, materials: handles.materials, scene_textures: handles.textures };
                graph.compute(args, lods.len() as u32);
                graph.read_buffer(buffer)
            });
            let got: Vec<f32> = frame.buffer::<types::TextureProbe>(read).iter().map(|p| p.texel[1]).collect();
            for (got, want) in got.iter().zip(want) {
                // Hardware may keep as few as six bits of the level of detail.
                assert!((got - want).abs() < 0.012, "{mip:?}: {got} is not {want}");
            }
        }
    });
}

//! What counts as a surface for rays: masks of camera and shadow rays, cut out, blended, coloured and unlit triangles, mirrored
//! instances. The compute traversal against a walk over the CPU's tree with the rules written again here.

use crate::rays_kit::*;
use crate::scene_kit;
use glam::{Mat3, Mat4, Quat, Vec2, Vec3, Vec4};
use lucerna::{
    gpu::testing::with_gpu,
    scene::{
        AlphaMode, Material, Pose, Primitive, Scene, Texture, TextureRef,
        bvh::{Bvh, Step},
    },
    shaders::types,
};

/// lib/trace_common.glsl
const CAMERA: u32 = 1;
const SHADOW: u32 = 2;

/// 4 × 4 texels, alpha in four steps.
fn picture() -> Texture {
    let rgba = (0..16u8).map(|i| [90, 200, 30, [0, 255, 100, 180][usize::from((i * 7 + i / 4) % 4)]]).collect();
    Texture { name: "holes".into(), width: 4, height: 4, rgba }
}

fn clutter() -> Scene {
    let mut scene = Scene { textures: vec![picture()], ..Scene::default() };
    let mut numbers = Numbers(0x5eed);
    let textured = Some(TextureRef::new(0));
    let plain = || Material::diffuse("", Vec3::splat(0.5));
    let mask = |cutoff| Material { alpha: AlphaMode::Mask { cutoff }, base_color_texture: textured, ..plain() };
    let blend =
        |alpha: f32| Material { alpha: AlphaMode::Blend, base_color: Vec4::new(0.5, 0.5, 0.5, alpha), ..plain() };
    let materials = [
        plain(),
        Material { double_sided: true, ..plain() },
        mask(0.5),
        Material { double_sided: true, ..mask(0.3) },
        blend(0.4),
        Material { double_sided: true, base_color_texture: textured, ..blend(0.8) },
        blend(0.0),
        Material { unlit: true, ..plain() },
        Material { unlit: true, double_sided: true, ..mask(0.6) },
    ];
    for i in 0..180 {
        let mut primitive = scene_kit::square();
        if i % 2 == 0 {
            primitive.colors = [1.0, 0.2, 0.9, 0.5].map(|a| Vec4::new(1.0, 1.0, 1.0, a)).to_vec();
        }
        let mesh = scene_kit::mesh(&mut scene, primitive, materials[i % materials.len()].clone());
        let turn = Quat::from_scaled_axis(numbers.vector() * 3.0);
        let size = Vec3::new(0.4 + 0.3 * numbers.next(), 1.0, if i % 5 < 2 { -0.5 } else { 0.5 });
        let at = Mat4::from_scale_rotation_translation(size, turn, numbers.vector() * 2.0);
        scene_kit::place(&mut scene, mesh, at);
    }
    scene.validate().unwrap();
    scene
}

/// PCG in four dimensions (Jarzynski and Olano 2020), first word, in [0, 1).
fn random(words: [u32; 4]) -> f32 {
    let mut v = words.map(|w| w.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    let mix = |v: &mut [u32; 4]| {
        for (to, a, b) in [(0, 1, 3), (1, 2, 0), (2, 0, 1), (3, 1, 2)] {
            v[to] = v[to].wrapping_add(v[a].wrapping_mul(v[b]));
        }
    };
    mix(&mut v);
    v = v.map(|w| w ^ w >> 16);
    mix(&mut v);
    (v[0] >> 8) as f32 / 16_777_216.0
}

/// Linear between the centres of texels, repeated.
fn alpha_at(texture: &Texture, uv: Vec2) -> f32 {
    let (w, h) = (texture.width as i32, texture.height as i32);
    let p = uv * Vec2::new(w as f32, h as f32) - 0.5;
    let (low, part) = (p.floor(), p - p.floor());
    let texel = |dx: i32, dy: i32| {
        let (x, y) = ((low.x as i32 + dx).rem_euclid(w), (low.y as i32 + dy).rem_euclid(h));
        f32::from(texture.rgba[(y * w + x) as usize][3]) / 255.0
    };
    let row = |dy| texel(0, dy) * (1.0 - part.x) + texel(1, dy) * part.x;
    row(0) * (1.0 - part.y) + row(1) * part.y
}

/// Whether a triangle is there for a ray, or `None` where rounding decides.
fn is_there(scene: &Scene, id: (u32, u32), uv: [f32; 2], ray: &types::Ray, mask: u32, salt: u32) -> Option<bool> {
    let node = &scene.nodes[id.0 as usize];
    let primitive: &Primitive = &scene.meshes[node.mesh.unwrap() as usize].primitives[0];
    let material = &scene.materials[primitive.material as usize];
    let corners = [0, 1, 2].map(|i| primitive.indices[3 * id.1 as usize + i] as usize);
    if mask & SHADOW != 0 && material.unlit {
        return Some(false);
    }
    if mask & CAMERA != 0 && !material.double_sided {
        // Normals turn with the inverse transpose, which keeps the front of mirrored instances.
        let linear = Mat3::from_mat4(node.local.matrix());
        let normal = linear.inverse().transpose() * primitive.normals[corners[0]];
        if normal.dot(Vec3::from(ray.direction)) > 0.0 {
            return Some(false);
        }
    }
    let weights = [1.0 - uv[0] - uv[1], uv[0], uv[1]];
    let mut alpha = material.base_color.w;
    if !primitive.colors.is_empty() {
        alpha *= (0..3).map(|i| primitive.colors[corners[i]].w * weights[i]).sum::<f32>();
    }
    if material.base_color_texture.is_some() {
        alpha *= alpha_at(&scene.textures[0], (0..3).map(|i| primitive.uvs[0][corners[i]] * weights[i]).sum());
    }
    let cutoff = match material.alpha {
        AlphaMode::Opaque => return Some(true),
        AlphaMode::Mask { cutoff } => cutoff,
        AlphaMode::Blend if material.base_color.w == 0.0 => return Some(false),
        AlphaMode::Blend => random([salt, id.0, id.1, 0]),
    };
    // Samplers have eight bits between texels.
    ((alpha - cutoff).abs() > 0.01).then_some(alpha >= cutoff)
}

#[test]
fn masks_holes_and_blending_are_those_of_the_rules() {
    let scene = clutter();
    let pose = Pose::rest(&scene);
    let bvh = Bvh::build(&scene, &pose);
    let ids = device_ids(&scene, &bvh);
    let rays = random_rays(&mut Numbers(77), 6000, Vec3::splat(-2.0), Vec3::splat(2.0));
    with_gpu(|gpu| {
        let mut traceable = Traceable::new(gpu, &scene);
        let mut first_hits = Vec::new();
        for (mask, salt) in [(0, 0), (CAMERA, 1), (SHADOW, 2), (CAMERA | SHADOW, 3), (0, 0xdead_beef)] {
            let traced = traceable.trace(&pose, &rays, mask, salt);
            let (mut decided, mut passed) = (0, 0);
            for (i, ray) in rays.iter().enumerate() {
                let (mut nearest, mut unsure, mut skipped) = (None, false, 0);
                bvh.walk(&cpu(ray), |hit| {
                    let edge = hit.u.min(hit.v).min(1.0 - hit.u - hit.v) < 1e-4;
                    match is_there(&scene, ids[hit.triangle as usize], [hit.u, hit.v], ray, mask, salt) {
                        Some(true) if !edge => {
                            nearest = Some(hit);
                            return Step::Nearer;
                        }
                        Some(false) => skipped += 1,
                        _ => unsure = true,
                    }
                    Step::Ignore
                });
                if unsure {
                    continue;
                }
                decided += 1;
                passed += usize::from(skipped > 0);
                let found = traced.closest[i];
                let what = format!("mask {mask}, salt {salt}, ray {i} {ray:?}: {found:?}, by the rules {nearest:?}");
                assert_eq!(found.instance == u32::MAX, nearest.is_none(), "{what}");
                assert_eq!(traced.any[i], nearest.is_some(), "any hit: {what}");
                if let Some(hit) = nearest {
                    assert!((found.t - hit.t).abs() <= 1e-4 * hit.t.max(1.0), "{what}");
                    // Squares cross: the other one may be as near.
                    let same = (found.instance, found.triangle) == ids[hit.triangle as usize];
                    assert!(same || (found.t - hit.t).abs() <= 1e-5, "{what}");
                }
            }
            println!(
                "mask {mask}, salt {salt}: {decided} of {} rays decided, {passed} went through something",
                rays.len()
            );
            assert!(decided * 10 > rays.len() * 8 && passed * 4 > decided, "the rules are hardly tested");
            first_hits.push(traced.closest.iter().map(|h| (h.instance, h.triangle)).collect::<Vec<_>>());
        }
        // Each mask sees something else, and so does each salt.
        for i in 1..first_hits.len() {
            assert!(first_hits[..i].iter().all(|other| *other != first_hits[i]), "run {i} is another one's");
        }
    });
}

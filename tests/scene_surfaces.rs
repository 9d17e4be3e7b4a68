//! The rasteriser and rays show the same surface: where two lie in one place, and under a normal map.

use crate::scene_kit;
use crate::scene_kit::{mesh, place, sphere, square, surfaces};
use glam::{Mat3, Mat4, Vec3, Vec4};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    passes::gbuffer,
    scene::{AlphaMode, Material, Pose, Primitive, Sampler, Scene, Texture, TextureRef, View},
    tracer::{Filter, Settings, Tracer},
};

const EXTENT: [u32; 2] = [32, 24];

/// A layer of three channels as rays through the middle of the pixels see it.
fn traced(gpu: &Gpu, scene: &Scene, view: &View, layer: &str) -> Vec<Vec3> {
    let settings = Settings { filter: Filter::Centre, bounces: 0, ..Settings::default() };
    let layers = Tracer::new(gpu, scene, &Pose::rest(scene)).unwrap().render(view, &settings, 1).unwrap();
    let found = layers.layers.iter().find(|one| one.name == layer).unwrap();
    assert_eq!(found.channels.len(), 3);
    found.data.chunks_exact(3).map(Vec3::from_slice).collect()
}

fn drawn(gpu: &Gpu, scene: &Scene, view: &View) -> scene_kit::Surfaces {
    surfaces(gpu, scene, view, gbuffer::Settings { mips: false, ..Default::default() })
}

#[test]
fn of_surfaces_in_one_place_both_show_the_first() {
    let red = Material::diffuse("red", Vec3::X);
    let green = Material::diffuse("green", Vec3::Y);
    let both = |material: &Material| Material { double_sided: true, ..material.clone() };
    let cut = |material: &Material| Material { alpha: AlphaMode::Mask { cutoff: 0.5 }, ..material.clone() };
    let (front, first, second) = (Vec3::X, Vec3::X, Vec3::Y);
    // Of one kind the first of the scene; else what is drawn first: opaque before cut out, single-sided before double-sided.
    let pairs = [
        (red.clone(), green.clone(), front),
        (both(&red), both(&green), first),
        (both(&red), green.clone(), second),
        (red.clone(), both(&green), first),
        (cut(&red), green.clone(), second),
        (cut(&red), both(&green), second),
        (cut(&red), cut(&green), first),
    ];
    let view = scene_kit::view(Vec3::new(1.5, 2.0, 2.5), Vec3::ZERO, EXTENT);
    with_gpu(|gpu| {
        for (number, (a, b, expected)) in pairs.into_iter().enumerate() {
            for swapped in [false, true] {
                let mut scene = Scene::default();
                // Meshes in either order: the order of the nodes counts.
                let (one, two) = if swapped {
                    let two = mesh(&mut scene, sphere(12), b.clone());
                    (mesh(&mut scene, sphere(12), a.clone()), two)
                } else {
                    (mesh(&mut scene, sphere(12), a.clone()), mesh(&mut scene, sphere(12), b.clone()))
                };
                let at = Mat4::from_rotation_y(0.3) * Mat4::from_scale(Vec3::new(1.1, 0.9, 1.3));
                place(&mut scene, one, at);
                place(&mut scene, two, at);
                let raster = drawn(gpu, &scene, &view);
                let rays = traced(gpu, &scene, &view, "albedo");
                let (mut seen, mut wrong) = (0, [0, 0]);
                for (raster, rays) in raster.albedo.iter().zip(&rays).filter(|(raster, _)| raster[3] > 0.5) {
                    seen += 1;
                    wrong[0] += usize::from(Vec3::new(raster[0], raster[1], raster[2]).distance(expected) > 0.01);
                    // On the outline one of the two may miss it.
                    wrong[1] += usize::from(rays.distance(expected) > 0.01 && *rays != Vec3::ZERO);
                }
                assert!(seen > 100, "{seen}");
                assert_eq!(wrong, [0, 0], "pair {number}, swapped {swapped}: pixels of {seen} that show the other one");
            }
        }
    });
}

/// The same with the sides of the tangent space exchanged, as where the picture of a texture is mirrored.
fn mirrored(primitive: Primitive) -> Primitive {
    let tangents = primitive.tangents.iter().map(|t| Vec4::new(t.x, t.y, t.z, -t.w)).collect();
    Primitive { tangents, ..primitive }
}

#[test]
fn normal_maps_turn_with_the_side_of_the_tangent_space() {
    // Tilted along both axes of the texture, differently, so that no two may be exchanged.
    let texel = [200u8, 60, 220, 255];
    let tilt = Vec3::new(f32::from(texel[0]), f32::from(texel[1]), f32::from(texel[2])) / 127.5 - 1.0;
    let normal_scale = 0.7;
    for (label, node) in [
        ("plain", Mat4::IDENTITY),
        ("turned", Mat4::from_rotation_y(1.0) * Mat4::from_rotation_z(0.3)),
        ("mirrored", Mat4::from_scale(Vec3::new(-1.0, 1.0, 1.0))),
        ("mirrored along the other axis", Mat4::from_scale(Vec3::new(1.0, 1.0, -1.0))),
    ] {
        for (hand, primitive) in [(1.0, square()), (-1.0, mirrored(square()))] {
            let mut scene = Scene::default();
            scene.textures.push(Texture { name: String::new(), width: 1, height: 1, rgba: vec![texel] });
            let used = TextureRef { sampler: Sampler::default(), ..TextureRef::new(0) };
            let matt = Material { normal_texture: Some(used), normal_scale, ..Material::diffuse("", Vec3::ONE) };
            let plate = mesh(&mut scene, primitive, matt);
            place(&mut scene, plate, node);
            // The square's tangent is +X, its normal +Y.
            let bitangent = Vec3::Y.cross(Vec3::X) * hand;
            let local = Vec3::X * tilt.x * normal_scale + bitangent * tilt.y * normal_scale + Vec3::Y * tilt.z;
            // Turns and reflections take normals as they take directions.
            let expected = (Mat3::from_mat4(node) * local).normalize();
            let above = (Mat3::from_mat4(node) * Vec3::Y) * 2.5 + Vec3::new(0.1, 0.0, 0.2);
            let view = scene_kit::view(above, Vec3::ZERO, EXTENT);
            with_gpu(|gpu| {
                let raster = drawn(gpu, &scene, &view);
                let rays = traced(gpu, &scene, &view, "normal");
                let mut seen = 0;
                for ((raster, rays), albedo) in raster.normal.iter().zip(&rays).zip(&raster.albedo) {
                    if albedo[3] < 0.5 {
                        continue;
                    }
                    seen += 1;
                    assert!(raster.distance(expected) < 2e-4, "{label}, {hand}: raster {raster}, expected {expected}");
                    assert!(
                        rays.distance(expected) < 2e-3 || *rays == Vec3::ZERO,
                        "{label}, {hand}: rays {rays}, expected {expected}"
                    );
                }
                assert!(seen > 100, "{label}: {seen}");
            });
        }
    }
}

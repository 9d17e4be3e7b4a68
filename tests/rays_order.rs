//! The two ways in which a traversal chooses the next node (lib/trace_order.glsl) find the same hits, bit for bit.

use crate::rays_kit::*;
use crate::scene_kit::mesh;
use glam::{Quat, Vec3};
use lucerna::{
    gpu::{GpuOptions, Traversal, testing::with_gpu_options},
    scene::{Material, Node, Pose, Primitive, Scene, Transform, bvh::Bvh},
    shaders::types,
};
use lucerna_scenes as builtin;

/// A scene, a time of its animations, and rays with all kinds of ends.
struct Case {
    scene: Scene,
    seconds: f32,
    rays: Vec<types::Ray>,
}

fn case(scene: Scene, seconds: f32, count: usize, seed: u64) -> Case {
    let bvh = Bvh::build(&scene, &Pose::playing(&scene, seconds));
    let (low, high) = bvh.bounds().unwrap();
    let size = (high - low).max_element();
    let mut rays = random_rays(&mut Numbers(seed), count, low, high);
    for (i, ray) in rays.iter_mut().enumerate() {
        match i % 8 {
            0 => ray.t_max = f32::INFINITY,
            1 => ray.t_max = 0.3 * size,
            2 => (ray.t_min, ray.t_max) = (0.05 * size, 0.6 * size),
            3 => ray.t_min = -0.5 * size,
            // Along an axis, through many boxes side by side.
            4 => ray.direction = [Vec3::X, Vec3::Y, Vec3::NEG_Z][i / 8 % 3].to_array(),
            5 => ray.direction = (Vec3::from(ray.direction) * 1e-9).to_array(),
            6 => ray.direction = (Vec3::from(ray.direction) * 1e9).to_array(),
            _ => {}
        }
    }
    Case { scene, seconds, rays }
}

/// `count` sheets one behind the other, each of two triangles that face along x: a ray along x meets the boxes of all of them.
fn sheets(count: u32) -> Scene {
    let mut scene = Scene { name: format!("{count} sheets"), ..Scene::default() };
    let positions: Vec<Vec3> = (0..count)
        .flat_map(|i| {
            let x = i as f32 * 0.01;
            [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[y, z]| Vec3::new(x, y, z))
        })
        .collect();
    let primitive = Primitive {
        normals: vec![Vec3::X; positions.len()],
        tangents: vec![glam::Vec4::ZERO; positions.len()],
        indices: (0..count).flat_map(|i| [0, 1, 2, 0, 2, 3].map(|k| 4 * i + k)).collect(),
        positions,
        ..Primitive::default()
    };
    let index = mesh(&mut scene, primitive, Material { double_sided: true, ..Material::diffuse("", Vec3::ONE) });
    scene.nodes.push(Node { mesh: Some(index), ..Node::default() });
    scene
}

/// The mesh of [`sheets`], turned and scaled, `copies` times.
fn turned_sheets(copies: usize) -> Scene {
    let mut scene = sheets(40);
    let mesh = scene.nodes[0].mesh;
    scene.nodes.clear();
    for i in 0..copies {
        let local = Transform::Trs {
            translation: Vec3::new(3.0 * i as f32, -1.0, 2.0),
            rotation: Quat::from_rotation_y(0.7).mul_quat(Quat::from_rotation_x(0.3)),
            scale: Vec3::new(2.0, 0.5, 1.5),
        };
        scene.nodes.push(Node { mesh, local, ..Node::default() });
    }
    scene
}

fn cases() -> Vec<Case> {
    let named = |name: &str, seconds| case(builtin::load(name).unwrap(), seconds, 1500, 5);
    vec![
        named("office", 0.0),
        named("conference", 0.0),
        named("figure", 0.77),
        named("garage", 0.0),
        case(sheets(400), 0.0, 800, 3),
        case(turned_sheets(1), 0.0, 800, 4),
        case(turned_sheets(3), 0.0, 800, 4),
    ]
}

#[test]
fn ordered_and_grouped_traversals_find_the_same_hits() {
    let cases = cases();
    let mut found: Vec<Vec<(Vec<types::Hit>, Vec<bool>)>> = Vec::new();
    for traversal in [Traversal::Ordered, Traversal::Grouped] {
        let mut list = Vec::new();
        with_gpu_options(GpuOptions { poison: true, traversal, ..GpuOptions::default() }, |gpu| {
            assert_eq!(gpu.caps().ordered_rays, traversal == Traversal::Ordered);
            for case in &cases {
                let mut traceable = Traceable::new(gpu, &case.scene);
                let traced = traceable.trace(&Pose::playing(&case.scene, case.seconds), &case.rays, 0, 1);
                list.push((traced.closest, traced.any));
            }
        });
        if list.is_empty() {
            return;
        }
        found.push(list);
    }
    for (case, (ordered, grouped)) in cases.iter().zip(found[0].iter().zip(&found[1])) {
        let hits = ordered.1.iter().filter(|hit| **hit).count();
        assert!(hits * 10 > case.rays.len(), "{}: {hits} hits", case.scene.name);
        assert_eq!(ordered.1, grouped.1, "{}: any hit", case.scene.name);
        for (i, (a, b)) in ordered.0.iter().zip(&grouped.0).enumerate() {
            let bits = bytemuck::bytes_of::<types::Hit>;
            assert_eq!(bits(a), bits(b), "{}, ray {i} {:?}: {a:?}, {b:?}", case.scene.name, case.rays[i]);
        }
    }
}

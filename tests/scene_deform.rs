//! Skinning and morphing on the GPU against the CPU.

use crate::common;
use crate::scene_kit::*;
use glam::{Mat4, Quat, Vec2, Vec3, Vec4};
use lucerna::{
    gpu::testing::with_gpu,
    scene::{Material, MorphTarget, Node, Pose, Scene, Skin, Transform, deform::world_vertices},
};

/// A cylinder of two bones that bends and bulges; two nodes share its mesh.
fn figure() -> Scene {
    let mut scene = Scene::default();
    let mut body = sphere(12);
    let count = body.positions.len();
    body.tangents = body.normals.iter().map(|n| n.any_orthonormal_vector().extend(1.0)).collect();
    let share = |p: &Vec3| 0.5 + 0.5 * p.y;
    body.joints = vec![vec![[0, 1, 0, 0]; count], vec![[1, 0, 0, 0]; count]];
    // Eight influences: the second set carries a quarter of the second joint's share.
    body.weights = vec![
        body.positions.iter().map(|p| Vec4::new(1.0 - share(p), 0.75 * share(p), 0.0, 0.0)).collect(),
        body.positions.iter().map(|p| Vec4::new(0.25 * share(p), 0.0, 0.0, 0.0)).collect(),
    ];
    body.morphs = vec![
        MorphTarget {
            positions: body.positions.iter().map(|p| Vec3::new(0.5 * p.x, 0.0, 0.0)).collect(),
            normals: body.normals.iter().map(|n| Vec3::new(-0.3 * n.x, 0.0, 0.0)).collect(),
            ..MorphTarget::default()
        },
        MorphTarget { positions: vec![Vec3::new(0.0, 0.0, 0.7); count], ..MorphTarget::default() },
    ];
    let mesh = mesh(&mut scene, body, Material::diffuse("", Vec3::splat(0.5)));
    let joint = |m| Node { local: Transform::Matrix(m), ..Node::default() };
    scene.nodes.push(joint(Mat4::from_translation(Vec3::new(0.3, 0.0, -0.2))));
    scene.nodes.push(Node {
        parent: Some(0),
        ..joint(Mat4::from_rotation_translation(Quat::from_rotation_z(0.9), Vec3::new(0.0, 1.0, 0.0)))
    });
    let inverse_bind = vec![Mat4::IDENTITY, Mat4::from_translation(Vec3::new(0.0, -1.0, 0.0))];
    scene.skins = vec![Skin { name: String::new(), joints: vec![0, 1], inverse_bind }];
    let shown = |weights: Vec<f32>, skin| Node { mesh: Some(mesh), skin, weights, ..Node::default() };
    scene.nodes.push(shown(vec![0.4, 0.0], Some(0)));
    scene.nodes.push(shown(vec![-0.5, 1.5], None));
    scene
}

#[test]
fn skinned_and_morphed_vertices_are_those_of_the_cpu() {
    let scene = figure();
    let pose = Pose::rest(&scene);
    let primitive = &scene.meshes[0].primitives[0];
    let count = primitive.positions.len();
    with_gpu(|gpu| {
        let (frame, [positions, normals, tangents]) = frame(gpu, &scene, |graph, handles| {
            [handles.positions, handles.normals, handles.tangents].map(|b| graph.read_buffer(b))
        });
        let positions = frame.buffer::<[f32; 3]>(positions);
        let normals = frame.buffer::<[f32; 3]>(normals);
        let tangents = frame.buffer::<[f32; 4]>(tangents);
        assert_eq!(positions.len(), 3 * count, "the vertices at rest and two deformed copies");
        for (copy, node) in [(1, 2), (2, 3)] {
            let twin = world_vertices(&scene, &pose, node, primitive);
            let mut moved = 0.0_f32;
            for v in 0..count {
                let at = copy * count + v;
                let near = |a: Vec3, b: Vec3| a.abs_diff_eq(b, 2e-5);
                assert!(near(positions[at].into(), twin.positions[v]), "{node} {v}");
                assert!(near(normals[at].into(), twin.normals[v]), "{node} {v}: {:?} {}", normals[at], twin.normals[v]);
                assert!(Vec4::from(tangents[at]).abs_diff_eq(twin.tangents[v], 2e-5), "{node} {v}");
                moved = moved.max(twin.positions[v].distance(primitive.positions[v]));
            }
            assert!(moved > 0.5, "the pose must move something");
        }
        assert!((0..count).all(|v| positions[v] == primitive.positions[v].to_array()), "the rest stays");
    });
}

#[test]
fn deforming_twice_starts_from_the_rest_each_time() {
    let scene = figure();
    with_gpu(|gpu| {
        let mut resident = lucerna::resident::Resident::new(gpu, &scene).unwrap();
        let mut runner = lucerna::graph::Runner::new(gpu);
        let mut run = || {
            let mut graph = lucerna::graph::Graph::new("twice");
            let handles = resident.frame(&mut graph, &scene, 0.0);
            let read = graph.read_buffer(handles.positions);
            runner.run(graph).unwrap().buffer::<[f32; 3]>(read)
        };
        assert_eq!(run(), run());
    });
}

#[test]
fn texture_coordinates_and_colours_morph_too() {
    let mut scene = Scene::default();
    let mut card = square();
    card.colors = vec![Vec4::new(0.5, 0.5, 0.5, 1.0); 4];
    let target = |uv: f32, red: f32| MorphTarget {
        uvs: vec![vec![Vec2::new(uv, -uv); 4]],
        colors: vec![Vec4::new(red, 0.1, 0.0, 0.0); 4],
        ..MorphTarget::default()
    };
    // The last target changes nothing of the kind.
    card.morphs = vec![target(1.0, 0.2), target(10.0, 4.0), MorphTarget::default()];
    let uvs_at_rest = card.uvs[0].clone();
    let card = mesh(&mut scene, card, Material::diffuse("", Vec3::ONE));
    let node = place(&mut scene, card, Mat4::IDENTITY);
    scene.nodes[node].weights = vec![0.5, 0.25, 1.0];
    with_gpu(|gpu| {
        let (frame, [uvs, colors]) =
            frame(gpu, &scene, |graph, handles| [handles.uvs, handles.colors].map(|b| graph.read_buffer(b)));
        let (uvs, colors) = (frame.buffer::<[f32; 2]>(uvs), frame.buffer::<[f32; 4]>(colors));
        assert_eq!((uvs.len(), colors.len()), (8, 8), "at rest and morphed");
        for v in 0..4 {
            assert!(Vec2::from(uvs[4 + v]).abs_diff_eq(uvs_at_rest[v] + Vec2::new(3.0, -3.0), 1e-5));
            // 0.5 + 0.1 + 1.0 is cut at one.
            assert!(
                Vec4::from(colors[4 + v]).abs_diff_eq(Vec4::new(1.0, 0.575, 0.5, 1.0), 1e-5),
                "{:?}",
                colors[4 + v]
            );
        }
    });
}

/// Every vertex of every deformed primitive of real files, at a moment of their animations.
#[test]
fn animated_files_deform_as_on_the_cpu() {
    let Some(assets) = common::assets() else { return };
    for (file, seconds) in [
        ("CesiumMan/CesiumMan.glb", 0.7),
        ("Fox/Fox.glb", 1.1),
        ("AnimatedMorphCube/AnimatedMorphCube.gltf", 1.3),
        ("RiggedSimple/RiggedSimple.gltf", 1.9),
    ] {
        let path = assets.join("gltf").join(file);
        let scene = lucerna::scene::load(&path, &Default::default()).unwrap();
        let pose = Pose::playing(&scene, seconds);
        with_gpu(|gpu| {
            let mut resident = lucerna::resident::Resident::new(gpu, &scene).unwrap();
            let mut graph = lucerna::graph::Graph::new("animated");
            let handles = resident.frame(&mut graph, &scene, seconds);
            let reads = [handles.positions, handles.instances].map(|b| graph.read_buffer(b));
            let frame = lucerna::graph::Runner::new(gpu).run(graph).unwrap();
            let positions = frame.buffer::<[f32; 3]>(reads[0]);
            let instances = frame.buffer::<lucerna::shaders::types::Instance>(reads[1]);
            let mut farthest = 0.0_f32;
            for (instance, host) in instances.iter().zip(&handles.moment.instances) {
                let node = host.node as usize;
                let mesh = &scene.meshes[scene.nodes[node].mesh.unwrap() as usize];
                let primitive = mesh.primitives.iter().find(|p| p.indices.len() as u32 == host.indices).unwrap();
                let world = Mat4::from_cols_array_2d(&instance.world_from_object);
                let twin = world_vertices(&scene, &pose, node, primitive);
                let size = host.bounds.half().length();
                let bounds = host.bounds.grown(1e-4 * size);
                for (v, expected) in twin.positions.iter().enumerate() {
                    let got = world.transform_point3(positions[instance.first_vertex as usize + v].into());
                    assert!(got.distance(*expected) < 2e-5 * size, "{file}, node {node}, vertex {v}: {got} {expected}");
                    assert!(bounds.min.cmple(got).all() && got.cmple(bounds.max).all(), "{file}: {got} is outside");
                    farthest = farthest.max(got.distance(primitive.positions[v]));
                }
            }
            assert!(farthest > 0.05, "{file}: nothing moved");
        });
    }
}

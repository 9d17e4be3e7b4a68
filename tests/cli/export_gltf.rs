//! The glTF export: what is read back is the scene, and a picture of it is the same.

use std::{fs, path::Path};

use glam::Mat4;
use lucerna::{
    image,
    scene::{self, Limits, LoadOptions, Pose, Primitive, Scene, deform::world_vertices},
};
use lucerna_scenes as builtin;
use serde_json::Value;

use crate::support::lucerna;

fn read(path: &Path) -> Scene {
    scene::load(path, &LoadOptions::default()).unwrap()
}

/// World transform and primitives of each node with a mesh, in order.
fn placed<'a>(scene: &'a Scene, pose: &Pose) -> Vec<(Mat4, &'a [Primitive])> {
    let of = |(index, node): (usize, &scene::Node)| {
        Some((pose.world[index], scene.meshes[node.mesh? as usize].primitives.as_slice()))
    };
    scene.nodes.iter().enumerate().filter_map(of).collect()
}

#[test]
fn a_scene_that_is_read_back_is_the_same() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["cornell", "cornell-area", "office", "conference", "garage", "street"] {
        let file = folder.path().join(format!("{name}.glb"));
        lucerna(["export-gltf".as_ref(), "--builtin".as_ref(), name.as_ref(), "-o".as_ref(), file.as_os_str()])
            .expect(0, &["wrote"]);
        let (before, after) = (builtin::load(name).unwrap(), read(&file));
        assert!(after.notes.is_empty(), "{name}: {:?}", after.notes);
        let poses = [&before, &after].map(Pose::rest);
        let (a, b) = (placed(&before, &poses[0]), placed(&after, &poses[1]));
        assert_eq!(a.len(), b.len(), "{name}");
        for ((world, primitives), (other, others)) in a.iter().zip(&b) {
            assert!(
                world.abs_diff_eq(*other, 1e-6 * (1.0 + world.w_axis.abs().max_element())),
                "{name}: {world} {other}"
            );
            assert_eq!(primitives.len(), others.len());
            for (p, q) in primitives.iter().zip(*others) {
                assert!(p.positions == q.positions && p.indices == q.indices && p.uvs == q.uvs && p.colors == q.colors);
                assert_eq!(p.material, q.material);
                assert!(p.normals.iter().zip(&q.normals).all(|(n, m)| n.distance(*m) < 1e-6));
                assert!(p.tangents.iter().zip(&q.tangents).all(|(n, m)| n.distance(*m) < 1e-5), "{name}");
            }
        }
        assert_eq!(before.textures.len(), after.textures.len(), "{name}");
        assert!(before.textures.iter().zip(&after.textures).all(|(t, u)| t.width == u.width && t.rgba == u.rgba));
        assert_eq!(before.materials.len(), after.materials.len());
        for (m, n) in before.materials.iter().zip(&after.materials) {
            let numbers = |m: &scene::Material| {
                [m.metallic, m.roughness, m.normal_scale, m.occlusion_strength, m.ior, m.transmission]
            };
            assert_eq!((numbers(m), m.alpha, m.double_sided, m.unlit), (numbers(n), n.alpha, n.double_sided, n.unlit));
            assert!(m.base_color == n.base_color && m.emissive.distance(n.emissive) <= 1e-6 * m.emissive.length());
            for (t, u) in [
                (m.base_color_texture, n.base_color_texture),
                (m.metallic_roughness_texture, n.metallic_roughness_texture),
                (m.normal_texture, n.normal_texture),
                (m.occlusion_texture, n.occlusion_texture),
                (m.emissive_texture, n.emissive_texture),
                (m.transmission_texture, n.transmission_texture),
            ] {
                assert_eq!(t.is_some(), u.is_some(), "{name}: {}", m.name);
                let (Some(t), Some(u)) = (t, u) else { continue };
                assert_eq!((t.texture, t.uv_set, t.sampler), (u.texture, u.uv_set, u.sampler));
                assert!(t.transform.iter().zip(u.transform).all(|(a, b)| (a - b).abs() < 1e-5), "{name}: {}", m.name);
            }
        }
        assert_eq!(before.lights.len(), after.lights.len());
        for (l, m) in before.lights.iter().zip(&after.lights) {
            let power = |l: &scene::Light| l.color * l.intensity;
            assert!(l.kind == m.kind && power(l).distance(power(m)) <= 1e-6 * power(l).length(), "{name}: {}", l.name);
        }
    }
}

/// The same paths through the same scene: the picture is the same up to rounding.
#[test]
fn a_picture_of_the_export_is_that_of_the_scene() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    for (name, environment) in [("cornell-area", None), ("shadows", Some("scene-environment.exr"))] {
        let (file, ours, theirs) = (at("scene.glb"), at("ours.exr"), at("theirs.exr"));
        lucerna(["export-gltf", "--builtin", name, "--size", "64x48", "-o", &file, "--overwrite"])
            .expect(0, &["wrote"]);
        let picture = ["--size", "64x48", "--spp", "16", "-q", "--overwrite", "-o"];
        lucerna([&["reference", "--builtin", name], &picture[..], &[&ours]].concat()).expect(0, &[]);
        let sky = environment.map(at);
        let lit: Vec<&str> = sky.iter().flat_map(|sky| ["--environment", sky.as_str()]).collect();
        lucerna([&["reference", &file, "--camera", "0"], &lit[..], &picture[..], &[&theirs]].concat()).expect(0, &[]);
        let [a, b] = [&ours, &theirs].map(|path| image::read(path, &Limits::default()).unwrap());
        let total = |layers: &image::Layers| layers.layers.iter().find(|l| l.name.is_empty()).unwrap().data.clone();
        let (a, b) = (total(&a), total(&b));
        let sum: f64 = a.iter().map(|v| f64::from(*v)).sum();
        let apart: f64 = a.iter().zip(&b).map(|(a, b)| f64::from((a - b).abs())).sum();
        eprintln!("{name}: {:.2e} apart", apart / sum);
        assert!(sum > 0.0 && apart / sum < 0.01, "{name}: {}", apart / sum);
    }
}

#[test]
fn what_moves_is_written_as_it_is_at_the_time() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("figure.glb");
    let said = lucerna(["export-gltf", "--builtin", "figure", "--time", "0.7", "-o", file.to_str().unwrap()]);
    said.expect(0, &["animations are left out"]);
    let (before, after) = (builtin::load("figure").unwrap(), read(&file));
    let poses = [Pose::playing(&before, 0.7), Pose::rest(&after)];
    assert!(after.skins.is_empty() && after.animations.is_empty());
    let mut counted = 0;
    let meshes = |scene: &Scene| -> Vec<usize> {
        scene.nodes.iter().enumerate().filter(|(_, node)| node.mesh.is_some()).map(|(index, _)| index).collect()
    };
    for (i, j) in meshes(&before).into_iter().zip(meshes(&after)) {
        let of = |scene: &Scene, node: usize| scene.meshes[scene.nodes[node].mesh.unwrap() as usize].primitives.clone();
        for (p, q) in of(&before, i).iter().zip(&of(&after, j)) {
            let [a, b] = [(&before, &poses[0], i, p), (&after, &poses[1], j, q)]
                .map(|(scene, pose, node, primitive)| world_vertices(scene, pose, node, primitive));
            assert_eq!(a.positions.len(), b.positions.len());
            assert!(a.positions.iter().zip(&b.positions).all(|(a, b)| a.distance(*b) < 1e-4));
            assert!(a.normals.iter().zip(&b.normals).all(|(a, b)| a.distance(*b) < 1e-3));
            counted += 1;
        }
    }
    assert!(counted > 5, "{counted}");
}

#[test]
fn the_file_is_glb_and_wrong_names_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    lucerna(["export-gltf", "--builtin", "cornell", "-o", &at("a.gltf")]).expect(2, &["not named .glb"]);
    lucerna(["export-gltf", "--builtin", "cornell", "-q", "-o", &at("a.glb")]).expect(0, &[]);
    lucerna(["export-gltf", "--builtin", "cornell", "-o", &at("a.glb/b.glb")]).expect(1, &["a.glb/b.glb"]);
    lucerna(["export-gltf", "--builtin", "cornell", "-q", "-o", &at("new/folder/a.glb")]).expect(0, &[]);
    assert!(fs::exists(at("new/folder/a.glb")).unwrap());
    lucerna(["export-gltf", "--builtin", "cornell", "-o", &at("a.glb")]).expect(1, &["a.glb", "exists already"]);
    let bytes = fs::read(at("a.glb")).unwrap();
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    assert_eq!((&bytes[..4], word(4), word(8)), (&b"glTF"[..], 2, bytes.len()));
    assert_eq!((&bytes[16..20], word(12) % 4), (&b"JSON"[..], 0));
    let document: Value = serde_json::from_slice(&bytes[20..20 + word(12)]).unwrap();
    let views = document["bufferViews"].as_array().unwrap();
    let aligned = |view: &Value| view["byteOffset"].as_u64().unwrap().is_multiple_of(4);
    assert!(!views.is_empty() && views.iter().all(aligned));
    assert_eq!(document["cameras"][0]["name"], "view");
}

//! Every glTF model of the asset collection, against what its list says about it.

use crate::common;
use glam::Mat4;
use lucerna::scene::{LoadOptions, Scene, load};

fn triangles(scene: &Scene) -> usize {
    scene.meshes.iter().flat_map(|mesh| &mesh.primitives).map(|primitive| primitive.indices.len() / 3).sum()
}

/// Triangles that were left out because they have no area.
fn dropped(scene: &Scene) -> usize {
    let counts = scene.notes.iter().filter_map(|note| note.text.strip_suffix(" triangles without area dropped"));
    counts.map(|count| count.parse::<usize>().unwrap()).sum()
}

/// The number before `word` in a description such as "12 triangles, 24 vertices".
fn stated(what: &str, word: &str) -> Option<usize> {
    let before = what.split(word).next().filter(|before| before.len() < what.len())?;
    before.trim_end().rsplit(|c: char| !c.is_ascii_digit()).next()?.parse().ok()
}

#[test]
fn every_model_loads_with_the_stated_counts() {
    let Some(assets) = common::assets() else { return };
    let manifest: serde_json::Value =
        serde_json::from_slice(&std::fs::read(assets.join("manifest.json")).unwrap()).unwrap();
    let mut failures = vec![];
    let mut models = 0;
    for entry in manifest["files"].as_array().unwrap() {
        let file = entry["file"].as_str().unwrap();
        if !file.starts_with("gltf/") || !(file.ends_with(".gltf") || file.ends_with(".glb")) {
            continue;
        }
        let what = entry["what"].as_str().unwrap();
        models += 1;
        let refused = ["KHR_draco_mesh_compression", "KHR_materials_pbrSpecularGlossiness", "ACME_gizmo"]
            .into_iter()
            .find(|name| what.contains(&format!("extensionsRequired {name}")));
        match (load(assets.join(file), &LoadOptions::default()), refused) {
            (Ok(_), Some(name)) => failures.push(format!("{file}: {name} was not refused")),
            (Err(error), Some(name)) if error.to_string().contains(name) => {}
            (Err(error), _) => failures.push(format!("{error}")),
            (Ok(scene), None) => {
                let mut compare = |word: &str, found: usize| {
                    let stated = stated(what, word).unwrap_or(0);
                    if stated != found {
                        failures.push(format!("{file}: {found}{word}, {stated} are stated"));
                    }
                };
                compare(" triangles", triangles(&scene) + dropped(&scene));
                compare(" mesh(es)", scene.meshes.len());
                compare(" node(s),", scene.nodes.len());
                compare(" animation(s)", scene.animations.len());
                compare(" skin(s)", scene.skins.len());
                compare(" camera(s)", scene.cameras.len());
            }
        }
    }
    assert!(models > 60, "only {models} models were found");
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// World positions of all triangle corners, sorted.
fn corners(scene: &Scene) -> Vec<[i32; 3]> {
    let mut world: Vec<Mat4> = vec![];
    let mut out = vec![];
    for node in &scene.nodes {
        let parent = node.parent.map_or(Mat4::IDENTITY, |parent| world[parent as usize]);
        world.push(parent * node.local.matrix());
        let Some(mesh) = node.mesh else { continue };
        for primitive in &scene.meshes[mesh as usize].primitives {
            let point = |&i: &u32| world[world.len() - 1].transform_point3(primitive.positions[i as usize]);
            out.extend(primitive.indices.iter().map(point).map(|p| (p * 1000.0).round().as_ivec3().to_array()));
        }
    }
    out.sort();
    out
}

#[test]
fn the_box_is_the_same_in_every_encoding() {
    let Some(assets) = common::assets() else { return };
    let read = |file: &str| load(assets.join("gltf").join(file), &LoadOptions::default()).unwrap();
    let plain = corners(&read("BoxInterleaved/BoxInterleaved.gltf"));
    assert_eq!(plain.len(), 36);
    for file in ["BoxMeshopt/BoxMeshopt.glb", "BoxMeshopt-Separate/BoxMeshopt.gltf"] {
        assert_eq!(corners(&read(file)), plain, "{file}");
    }
}

#[test]
fn mirrored_nodes_keep_their_determinant() {
    let Some(assets) = common::assets() else { return };
    for file in ["PalmTree/PalmTree.gltf", "IrradianceVolumeExample/IrradianceVolumeExample.glb"] {
        let scene = load(assets.join("gltf").join(file), &LoadOptions::default()).unwrap();
        let mirrored = scene.nodes.iter().filter(|node| node.local.matrix().determinant() < 0.0).count();
        assert_eq!(mirrored, 1, "{file}");
    }
}

/// KTX2 by KHR_texture_basisu, in place of a PNG that must not be read.
#[test]
fn basis_textures_are_decoded() {
    let Some(assets) = common::assets() else { return };
    for file in ["2d_uastc.ktx2", "2d_etc1s.ktx2", "2d_rgba8.ktx2", "2d_bc7.ktx2"] {
        let folder = tempfile::tempdir().unwrap();
        std::fs::copy(assets.join("gltf/ktx2").join(file), folder.path().join(file)).unwrap();
        let path = folder.path().join("scene.gltf");
        let json = serde_json::json!({
            "asset": {"version": "2.0"},
            "extensionsRequired": ["KHR_texture_basisu"],
            "images": [{"uri": "missing.png"}, {"uri": file, "mimeType": "image/ktx2"}],
            "textures": [{"source": 0, "extensions": {"KHR_texture_basisu": {"source": 1}}}],
            "materials": [{"emissiveTexture": {"index": 0}}],
        });
        std::fs::write(&path, json.to_string()).unwrap();
        let scene = load(&path, &LoadOptions::default()).unwrap();
        let texture = &scene.textures[0];
        assert_eq!(texture.name, file);
        assert!(texture.rgba.iter().any(|texel| texel != &texture.rgba[0]), "{file} is of one colour");
    }
}

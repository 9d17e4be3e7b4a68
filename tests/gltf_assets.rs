//! Every glTF model of the asset collection, against what its list says about it.

mod common;

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

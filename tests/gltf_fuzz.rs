//! Random damage to small valid files never makes the reader panic, and what is still read is valid.

use crate::common;
use crate::gltf::{File, PNG, load_bytes};
use proptest::prelude::*;
use serde_json::json;

/// A file that has something of every kind.
fn everything() -> File {
    let mut file = File::square();
    let joints = file.accessor("VEC4", 5121, 4, &[1, 0, 0, 0].repeat(4));
    let weights = file.floats("VEC4", &[0.5, 0.5, 0.0, 0.0].repeat(4));
    file.primitive()["attributes"]["JOINTS_0"] = json!(joints);
    file.primitive()["attributes"]["WEIGHTS_0"] = json!(weights);
    file.primitive()["targets"] = json!([{"POSITION": 0}]);
    file.primitive()["material"] = json!(0);
    let indices = file.view(&[1, 3]);
    let values = file.view(&[0; 24]);
    file.json["accessors"][0]["sparse"] = json!({
        "count": 2, "indices": {"bufferView": indices, "componentType": 5121}, "values": {"bufferView": values}
    });
    file.add("images", json!({"uri": PNG}));
    file.add("samplers", json!({"magFilter": 9728, "minFilter": 9984, "wrapS": 33071}));
    file.add("textures", json!({"source": 0, "sampler": 0}));
    let transform = json!({"KHR_texture_transform": {"offset": [1, 2], "rotation": 0.5}});
    file.add(
        "materials",
        json!({"normalTexture": {"index": 0, "extensions": transform}, "emissiveFactor": [1, 1, 1], "alphaMode": "MASK"}),
    );
    file.add("nodes", json!({"children": [2], "translation": [1, 2, 3], "rotation": [0, 0, 0, 1]}));
    file.add("nodes", json!({"camera": 0, "extensions": {"KHR_lights_punctual": {"light": 0}}}));
    file.json["nodes"][0]["skin"] = json!(0);
    file.add("skins", json!({"joints": [1, 2]}));
    file.add("cameras", json!({"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}}));
    file.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [{"type": "spot", "spot": {}}]}});
    let times = file.floats("SCALAR", &[0.0, 0.5]);
    let moves = file.floats("VEC3", &[0., 0., 0., 1., 2., 3.]);
    let channel = json!({"sampler": 0, "target": {"node": 1, "path": "translation"}});
    file.add("animations", json!({"samplers": [{"input": times, "output": moves}], "channels": [channel]}));
    file
}

fn accepted(name: &str, content: &[u8]) {
    if let Ok(scene) = load_bytes(name, content) {
        scene.validate().unwrap();
        for primitive in scene.meshes.iter().flat_map(|mesh| &mesh.primitives) {
            let unit = |length: f32| (length - 1.0).abs() < 1e-3;
            assert!(primitive.normals.iter().all(|normal| unit(normal.length())), "{:?}", primitive.normals);
        }
    }
}

/// Damage: bytes replaced, and the end cut off.
fn damaged(content: &[u8], edits: &[(prop::sample::Index, u8)], end: Option<prop::sample::Index>) -> Vec<u8> {
    let mut out = content.to_vec();
    for (at, byte) in edits {
        let at = at.index(out.len());
        out[at] = *byte;
    }
    if let Some(end) = end {
        out.truncate(end.index(out.len()));
    }
    out
}

fn edits() -> impl Strategy<Value = Vec<(prop::sample::Index, u8)>> {
    // Digits, signs and brackets keep much of the JSON valid.
    let byte = prop_oneof![any::<u8>(), prop::sample::select(b"0123456789-.e[]{}\",:".to_vec())];
    prop::collection::vec((any::<prop::sample::Index>(), byte), 1..6)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 600, ..ProptestConfig::default() })]

    #[test]
    fn damaged_files_are_refused_or_valid(edits in edits(), end in prop::option::weighted(0.1, any::<prop::sample::Index>())) {
        accepted("a.glb", &damaged(&everything().glb(), &edits, end));
    }

    #[test]
    fn other_numbers_are_refused_or_valid(
        at in any::<prop::sample::Index>(),
        number in prop_oneof![Just(-1.0), Just(0.0), Just(1.0), Just(2.0), Just(1e9), Just(4_294_967_295.0), Just(1e18), Just(1e38), any::<f64>()],
    ) {
        let mut file = everything();
        let mut numbers = vec![];
        collect(&mut file.json, &mut numbers);
        let count = numbers.len();
        *numbers[at.index(count)] = json!(number);
        accepted("a.glb", &file.glb());
    }

    #[test]
    fn damaged_obj_files_are_refused_or_valid(edits in edits(), end in prop::option::weighted(0.1, any::<prop::sample::Index>())) {
        let text = "mtllib a.mtl\no box\nv 0 0 0\nv 1 0 0 1 1\nv 1 1 0 1 0 0\nv 0 1 0.5\nv .2 .2 0\nvt 0 0\nvt 1 1\nvn 0 0 1\n\
                    usemtl a\nf 1/1/1 2/2/1 3/1/1\nf 1 2 3 4 5\ng b\nf -1// -2//-1 -3\nl 1 2\ns 1\n";
        accepted("a.obj", &damaged(text.as_bytes(), &edits, end));
    }
}

/// All numbers of a JSON tree.
fn collect<'a>(value: &'a mut serde_json::Value, out: &mut Vec<&'a mut serde_json::Value>) {
    match value {
        serde_json::Value::Number(_) => out.push(value),
        serde_json::Value::Array(values) => values.iter_mut().for_each(|value| collect(value, out)),
        serde_json::Value::Object(map) => map.values_mut().for_each(|value| collect(value, out)),
        _ => {}
    }
}

#[test]
fn the_undamaged_file_is_read() {
    let scene = everything().load().unwrap();
    assert_eq!((scene.skins.len(), scene.animations.len(), scene.textures.len()), (1, 1, 1));
    assert!(scene.notes.is_empty(), "{:?}", scene.notes);
}

/// Real files, with the same damage at every run.
#[test]
fn damaged_models_are_refused_or_valid() {
    let Some(assets) = common::assets() else { return };
    for file in ["gltf/BoxMeshopt/BoxMeshopt.glb", "gltf/LightsCubes/Cubes.glb", "gltf/BoxAnimated/BoxAnimated.glb"] {
        let content = std::fs::read(assets.join(file)).unwrap();
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 33) as usize
        };
        for _ in 0..150 {
            let mut damaged = content.clone();
            for _ in 0..1 + random() % 4 {
                let at = random() % damaged.len();
                damaged[at] = random() as u8;
            }
            accepted("a.glb", &damaged);
        }
        for cut in 0..16 {
            accepted("a.glb", &content[..content.len() * cut / 16]);
        }
    }
}

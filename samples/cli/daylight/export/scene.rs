//! The scene as glTF, for lightmaps with a further set of texture coordinates.

use lucerna::{
    Result,
    scene::{Pose, Scene},
    techniques::daylight::{
        Kind, Stored,
        export::{Unwrapping, unwrapped},
    },
};
use serde_json::{Value, json};

use super::{DayExportArgs, table};
use crate::{
    console::Console,
    export_gltf::{self, Parts},
    glb::glb,
    stage::Stage,
};

/// The bytes of the .glb file. If the bake is a lightmap, its materials name the picture `lightmap`, and the set of texture coordinates of the lightmap
/// comes back.
///
/// # Errors
/// As [`unwrapped`]; `Runtime` if the file would be larger than glTF allows.
pub fn glb_of(
    stage: &Stage,
    stored: &Stored,
    lightmap: &str,
    args: &DayExportArgs,
    console: Console,
) -> Result<(Vec<u8>, Option<u32>)> {
    let (_, view) = stage.at(args.stage.time, args.stage.size)?;
    if let Kind::Cube { .. } = stored.plan.receivers {
        let scene = unlit_by_itself(stage.scene.clone());
        let Parts { document, binary, notes } = export_gltf::parts(&scene, &Pose::rest(&scene), &view)?;
        notes.iter().for_each(|note| console.info(&format!("note: {note}")));
        return Ok((glb(&document, binary)?, None));
    }
    let Unwrapping { scene, uv_set, vertices } = unwrapped(&stage.scene, stored)?;
    let scene = unlit_by_itself(scene);
    // The light was baked on the scene at rest.
    let Parts { mut document, binary, notes } = export_gltf::parts(&scene, &Pose::rest(&scene), &view)?;
    notes.iter().for_each(|note| console.info(&format!("note: {note}")));
    console.info(&format!(
        "{} vertices, {} after they were split where charts end; the lightmap has TEXCOORD_{uv_set}",
        vertices[0], vertices[1]
    ));
    name_lightmap(&mut document, &scene, lightmap, uv_set);
    Ok((glb(&document, binary)?, Some(uv_set)))
}

/// The scene without its lights: the light is that of sun and sky.
fn unlit_by_itself(mut scene: Scene) -> Scene {
    scene.lights.clear();
    scene.nodes.iter_mut().for_each(|node| node.light = None);
    scene.environment = None;
    scene
}

/// Makes all lit materials name the lightmap by the extension `MOZ_lightmap`. Its picture is a Radiance file, which glTF allows only by an
/// extension (`MOZ_texture_rgbe`, of the same makers): a program that knows neither does not read the picture.
fn name_lightmap(document: &mut Value, scene: &Scene, file: &str, uv_set: u32) {
    const LINEAR: u32 = 9729;
    const CLAMP: u32 = 33071;
    let mut push = |list: &str, value: Value| {
        if document[list].is_null() {
            document[list] = json!([]);
        }
        let list = document[list].as_array_mut();
        list.map_or(0, |list| {
            list.push(value);
            list.len() - 1
        })
    };
    let image = push("images", json!({ "name": "lightmap", "uri": file }));
    let filter = json!({ "magFilter": LINEAR, "minFilter": LINEAR, "wrapS": CLAMP, "wrapT": CLAMP });
    let sampler = push("samplers", filter);
    let use_of = json!({ "MOZ_texture_rgbe": { "source": image } });
    let texture = push("textures", json!({ "name": "lightmap", "sampler": sampler, "extensions": use_of }));
    for (material, written) in scene.materials.iter().zip(document["materials"].as_array_mut().into_iter().flatten()) {
        if !material.unlit {
            written["extensions"]["MOZ_lightmap"] = json!({ "index": texture, "texCoord": uv_set, "intensity": 1.0 });
        }
    }
    let mut used: Vec<Value> = document["extensionsUsed"].as_array().cloned().unwrap_or_default();
    used.extend(["MOZ_lightmap", "MOZ_texture_rgbe"].map(Value::from));
    used.sort_by_key(Value::to_string);
    document["extensionsUsed"] = json!(used);
    document["asset"]["extras"] = json!({ "lightmap": table::UNIT });
}

//! Scene files made to do harm, and the message that each must end in.

use crate::gltf::{File, glb};
use serde_json::{Value, json};

/// Name, file name, content, and part of the message; `ok` if the file may be read.
pub struct Case {
    pub name: &'static str,
    pub file: &'static str,
    pub content: Vec<u8>,
    pub expected: &'static str,
}

fn changed(name: &'static str, expected: &'static str, change: impl FnOnce(&mut File)) -> Case {
    let mut file = File::square();
    change(&mut file);
    Case { name, file: "test.glb", content: file.glb(), expected }
}

fn text(name: &'static str, expected: &'static str, content: String) -> Case {
    Case { name, file: "test.gltf", content: content.into_bytes(), expected }
}

fn obj(name: &'static str, expected: &'static str, content: String) -> Case {
    Case { name, file: "test.obj", content: content.into_bytes(), expected }
}

fn buffer(name: &'static str, uri: &str) -> Case {
    let json = json!({"asset": {"version": "2.0"}, "buffers": [{"byteLength": 4, "uri": uri}]});
    let expected = if uri.contains(':') { "URI scheme" } else { "buffers[0].uri" };
    text(name, expected, json.to_string())
}

/// A PNG of one colour, as large as its header says.
fn png(width: u32, height: u32) -> Vec<u8> {
    let mut out = vec![];
    let mut encoder = png::Encoder::new(&mut out, width, height);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::One);
    encoder.set_compression(png::Compression::Fast);
    let mut writer = encoder.write_header().unwrap();
    let mut stream = writer.stream_writer().unwrap();
    let row = vec![0; width.div_ceil(8) as usize];
    for _ in 0..height {
        std::io::Write::write_all(&mut stream, &row).unwrap();
    }
    stream.finish().unwrap();
    drop(writer);
    out
}

fn image(file: &mut File, png: &[u8], times: usize) {
    let view = file.view(png);
    for i in 0..times {
        file.add("images", json!({"bufferView": view, "mimeType": "image/png"}));
        file.add("textures", json!({"source": i}));
        file.add("materials", json!({"emissiveTexture": {"index": i}}));
    }
}

fn chain(length: usize) -> Value {
    let nodes = (0..length).map(|i| if i + 1 < length { json!({"children": [i + 1]}) } else { json!({}) });
    json!({"asset": {"version": "2.0"}, "nodes": nodes.collect::<Vec<_>>()})
}

/// All cases.
pub fn cases() -> Vec<Case> {
    let mut out = vec![
        buffer("uri_parent", "../../../../etc/passwd"),
        buffer("uri_parent_encoded", "%2e%2e/%2e%2e/etc/passwd"),
        buffer("uri_absolute", "/etc/passwd"),
        buffer("uri_file_scheme", "file:///etc/passwd"),
        buffer("uri_http", "http://example.org/a.bin"),
        buffer("uri_device", "/dev/zero"),
        buffer("uri_backslash", "..\\secret"),
        buffer("uri_nul", "a%00b"),
        buffer("uri_folder", "."),
        text("node_cycle", "nodes[0]: the node is its own ancestor", {
            json!({"asset": {"version": "2.0"}, "nodes": [{"children": [1]}, {"children": [0]}]}).to_string()
        }),
        text("node_own_child", "nodes[0]: the node is its own ancestor", {
            json!({"asset": {"version": "2.0"}, "nodes": [{"children": [0]}]}).to_string()
        }),
        text("node_chain_of_200000", "the hierarchy is deeper than 256 nodes", chain(200_000).to_string()),
        text("node_twice_a_child", "nodes[1] is already a child of nodes[0]", {
            let nodes: Vec<Value> =
                (0..29).map(|i| if i < 28 { json!({"children": [i + 1, i + 1]}) } else { json!({}) }).collect();
            json!({"asset": {"version": "2.0"}, "nodes": nodes}).to_string()
        }),
        text("json_deep", "recursion limit", format!("{}{}", "[".repeat(1 << 20), "]".repeat(1 << 20))),
        text("json_wide", "MiB in memory", format!("{{\"asset\":[{}0]}}", "0,".repeat(12 << 20))),
        text("json_number", "number out of range", r#"{"asset":{"version":"2.0"},"scene":1e999}"#.into()),
        text("json_many_nodes", "1100000 nodes, 1048576 are allowed", {
            format!(r#"{{"asset":{{"version":"2.0"}},"nodes":[{}{{}}]}}"#, "{},".repeat(1_099_999))
        }),
    ];
    out.extend([
        changed("index_out_of_range", "meshes[0].primitives[0].indices: index 999999 (at 2)", |file| {
            let indices = file.indices(&[0, 1, 999_999]);
            file.primitive()["indices"] = json!(indices);
        }),
        changed("position_nan", "element 1 is NaN, which is not finite", |file| {
            let position = file.floats("VEC3", &[0., 0., 0., f32::NAN, 0., 0., 0., 1., 0., 1., 1., 0.]);
            file.primitive()["attributes"]["POSITION"] = json!(position);
        }),
        changed("position_infinite", "element 3 is inf", |file| {
            let position = file.floats("VEC3", &[0., 0., 0., 1., 0., 0., 0., 1., 0., 1., f32::INFINITY, 0.]);
            file.primitive()["attributes"]["POSITION"] = json!(position);
        }),
        changed("positions_enormous", "m from the origin; 1e8 m is allowed", |file| {
            let position = file.floats("VEC3", &[0., 0., 0., f32::MAX, 0., 0., 0., f32::MAX, 0., -f32::MAX, 1., 0.]);
            file.primitive()["attributes"]["POSITION"] = json!(position);
        }),
        changed("translation_too_large", "nodes[0].translation: inf is not finite", |file| {
            file.json["nodes"][0]["translation"] = json!([1e39, 0, 0]);
        }),
        changed("rotation_zero", "nodes[0].rotation: the quaternion has no direction", |file| {
            file.json["nodes"][0]["rotation"] = json!([0, 0, 0, 0]);
        }),
        changed("scale_zero", "ok", |file| file.json["nodes"][0]["scale"] = json!([0, 0, 0])),
        changed("count_4e9", "do not fit into the 48 bytes", |file| {
            file.json["accessors"][0]["count"] = json!(4_000_000_000u64);
        }),
        changed("count_overflow", "do not fit", |file| file.json["accessors"][0]["count"] = json!(u64::MAX)),
        changed("count_without_data", "over 268435456 vertices", |file| {
            let zeros = json!({"type": "VEC3", "componentType": 5126, "count": 4_000_000_000u64});
            let zeros = file.add("accessors", zeros);
            *file.primitive() = json!({"attributes": {"POSITION": zeros}});
        }),
        changed("offset_overflow", "do not fit", |file| {
            file.json["accessors"][0]["byteOffset"] = json!(u64::MAX - 3);
        }),
        changed("view_overflow", "bufferViews[0]: bytes", |file| {
            file.json["bufferViews"][0]["byteOffset"] = json!(u64::MAX - 3);
        }),
        changed("stride_zero", "bufferViews[0].byteStride: 0 bytes", |file| {
            file.json["bufferViews"][0]["byteStride"] = json!(0);
        }),
        changed("one_accessor_10000_times", "more than the", |file| {
            let count = 100_000;
            let position = file.floats("VEC3", &vec![0.5; 3 * count]);
            let primitives: Vec<Value> = (0..10_000).map(|_| json!({"attributes": {"POSITION": position}})).collect();
            file.json["meshes"] = json!([{"primitives": primitives}]);
        }),
        changed("morph_targets_10000", "more than the", |file| {
            let zeros = file.add("accessors", json!({"type": "VEC3", "componentType": 5126, "count": 1_000_000}));
            let targets = vec![json!({"POSITION": zeros}); 10_000];
            *file.primitive() = json!({"attributes": {"POSITION": zeros}, "targets": targets});
        }),
        changed("sparse_out_of_range", "accessors[0].sparse.indices: index 9", |file| {
            let indices = file.view(&[9]);
            file.json["accessors"][0]["sparse"] = json!({
                "count": 1, "indices": {"bufferView": indices, "componentType": 5121}, "values": {"bufferView": 0}
            });
        }),
        changed("meshopt_bomb", "EXT_meshopt_compression", |file| {
            let data = file.view(&[0xa0; 64]);
            let offset = file.json["bufferViews"][data]["byteOffset"].clone();
            let count = 1u64 << 28;
            let packed = json!({
                "buffer": 0, "byteOffset": offset, "byteLength": 64, "byteStride": 4, "count": count, "mode": "ATTRIBUTES"
            });
            file.json["bufferViews"][0] = json!({
                "buffer": 1, "byteLength": 4 * count, "extensions": {"EXT_meshopt_compression": packed}
            });
            file.json["buffers"] = json!([{"byteLength": file.bin.len()}, {"byteLength": 4 * count}]);
        }),
        changed("channels_50000", "ok", |file| {
            let times = file.floats("SCALAR", &[0.0]);
            let moves = file.floats("VEC3", &[0.0; 3]);
            file.json["nodes"] = json!(vec![json!({}); 100_000]);
            let channels: Vec<Value> =
                (0..100_000).map(|i| json!({"sampler": 0, "target": {"node": i, "path": "scale"}})).collect();
            file.add("animations", json!({"samplers": [{"input": times, "output": moves}], "channels": channels}));
        }),
        changed("skinned_nodes_100000", "ok", |file| {
            let joints = file.accessor("VEC4", 5121, 4, &[0; 16]);
            let weights = file.floats("VEC4", &[1.0; 16]);
            file.primitive()["attributes"]["JOINTS_0"] = json!(joints);
            file.primitive()["attributes"]["WEIGHTS_0"] = json!(weights);
            file.json["nodes"] = json!(vec![json!({"mesh": 0, "skin": 0}); 100_000]);
            file.add("skins", json!({"joints": (0..100_000).collect::<Vec<_>>()}));
        }),
        changed("skins_100000", "ok", |file| {
            file.json["nodes"] = json!(vec![json!({}); 100_000]);
            file.json["skins"] = json!(vec![json!({"joints": [0]}); 100_000]);
        }),
        changed("primitives_100000", "ok", |file| {
            let primitive = file.primitive().clone();
            file.json["meshes"][0]["primitives"] = json!(vec![primitive; 100_000]);
        }),
        changed("meshes_100000", "ok", |file| {
            let mesh = file.json["meshes"][0].clone();
            file.json["meshes"] = json!(vec![mesh; 100_000]);
        }),
        changed("negative_weights", "weight -1 of vertex 0 is negative", |file| {
            let joints = file.accessor("VEC4", 5121, 4, &[0; 16]);
            let weights = file.floats("VEC4", &[-1.0; 16]);
            file.primitive()["attributes"]["JOINTS_0"] = json!(joints);
            file.primitive()["attributes"]["WEIGHTS_0"] = json!(weights);
        }),
        changed("camera_not_a_number", "cameras[0]", |file| {
            file.add("cameras", json!({"type": "perspective", "perspective": {"yfov": 1e39, "znear": 1}}));
        }),
        changed("light_negative", "lights[0].intensity: -1", |file| {
            file.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": -1}]}});
        }),
        changed("emission_overflow", "larger than a float", |file| {
            let strength = json!({"KHR_materials_emissive_strength": {"emissiveStrength": 1e38}});
            file.add("materials", json!({"emissiveFactor": [100, 0, 0], "extensions": strength}));
        }),
        changed("required_extension", "requires the extension \"ACME_gizmo\"", |file| {
            file.json["extensionsRequired"] = json!(["ACME_gizmo"]);
        }),
        changed("tangents_of_a_fan_of_300000", "ok", |file| {
            let count = 300_000;
            let mut position = vec![0.0; 3];
            for i in 0..=count {
                let angle = i as f32 / count as f32 * std::f32::consts::TAU;
                position.extend([angle.cos(), angle.sin(), 0.0]);
            }
            let uv: Vec<f32> = position.chunks(3).flat_map(|p| [p[0], p[1]]).collect();
            let position = file.floats("VEC3", &position);
            let uv = file.floats("VEC2", &uv);
            file.add("images", json!({"uri": crate::gltf::PNG}));
            file.add("textures", json!({"source": 0}));
            file.add("materials", json!({"normalTexture": {"index": 0}}));
            *file.primitive() = json!({"attributes": {"POSITION": position, "TEXCOORD_0": uv}, "mode": 6, "material": 0});
        }),
        changed("png_16000_square", "images[0]", |file| image(file, &png(16_000, 16_000), 1)),
        changed("png_8000_square_40_times", "images[", |file| image(file, &png(8_000, 8_000), 40)),
    ]);
    out.extend([
        obj("obj_index_huge", "line 2: index 99999999999", "v 0 0 0\nf 1 99999999999 1\n".into()),
        obj("obj_index_negative", "line 2: index -2", "v 0 0 0\nf 1 -2 1\n".into()),
        obj("obj_index_zero", "line 2: index 0", "v 0 0 0\nf 0 1 1\n".into()),
        obj("obj_nan", "line 1: NaN is not finite", "v nan 0 0\n".into()),
        obj("obj_short_color", "ok", "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n".into()),
        obj("obj_polygon_of_300000", "ok", {
            let vertices: String = (0..300_000).map(|i| format!("v {} {} 0\n", i % 1000, i / 1000)).collect();
            let corners: String = (1..=300_000).map(|i| format!(" {i}")).collect();
            format!("{vertices}f{corners}\n")
        }),
        obj(
            "obj_million_groups",
            "more than the",
            format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{}", "g a\nf 1 2 3\n".repeat(1_000_000)),
        ),
        obj(
            "obj_one_face_a_million_times",
            "ok",
            format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{}", "f 1 2 3\n".repeat(1_000_000)),
        ),
        obj("obj_outside", "ok", "mtllib ../../../etc/passwd\nmtllib /dev/zero\nv 0 0 0\n".into()),
        Case { name: "glb_empty", file: "test.glb", content: b"glTF".to_vec(), expected: "header" },
        Case {
            name: "glb_chunk_length",
            file: "test.glb",
            expected: "chunk 0",
            content: {
                let mut file = glb(b"{}", &[]);
                file[12..16].copy_from_slice(&u32::MAX.to_le_bytes());
                file
            },
        },
        Case { name: "no_scene", file: "notes.txt", content: b"hello".to_vec(), expected: "is no scene file" },
        Case {
            name: "arrays_index",
            file: "a.bin",
            expected: "is 7, but there are 1 vertices",
            content: { b"float a_vertices[] = { 0, 0, 0 }; unsigned int a_indices[] = { 0, 0, 7 };".to_vec() },
        },
    ]);
    out
}

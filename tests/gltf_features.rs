//! What the glTF front end makes of each feature, on small files made here.

use crate::gltf::{File, PNG, bytes};
use glam::{Mat4, Quat, Vec2, Vec3, Vec4};
use lucerna::scene::{
    AlphaMode, Interpolation, Keys, LightKind, LoadOptions, MipFilter, NoteKind, Primitive, Projection, Scene,
    Transform, Wrap, load,
};
use serde_json::json;

fn only(scene: &Scene) -> &Primitive {
    assert_eq!(scene.meshes[0].primitives.len(), 1);
    &scene.meshes[0].primitives[0]
}

fn corners(primitive: &Primitive) -> Vec<Vec3> {
    primitive.indices.iter().map(|&i| primitive.positions[i as usize]).collect()
}

/// A zigzag whose strip triangles all face +Z.
const ZIGZAG: [f32; 15] = [0., 0., 0., 1., 0., 0., 0., 1., 0., 1., 1., 0., 0., 2., 0.];

#[test]
fn strips_and_fans_face_the_same_way_as_lists() {
    for (mode, expected) in [(5, [[0, 1, 2], [1, 3, 2], [2, 3, 4]]), (6, [[1, 2, 0], [2, 3, 0], [3, 4, 0]])] {
        let mut file = File::new();
        // Around a fan's centre in the plane z = 0.
        let fan = [0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0., -1., 1., 0.];
        let position = file.floats("VEC3", if mode == 5 { &ZIGZAG } else { &fan });
        file.mesh(json!({"attributes": {"POSITION": position}, "mode": mode}));
        let scene = file.load().unwrap();
        let primitive = only(&scene);
        assert!(primitive.normals.iter().all(|&n| n == Vec3::Z), "mode {mode}: {:?}", primitive.normals);
        let points: Vec<Vec3> = if mode == 5 { ZIGZAG } else { fan }.chunks(3).map(Vec3::from_slice).collect();
        let want: Vec<Vec3> = expected.iter().flatten().map(|&i: &usize| points[i]).collect();
        assert_eq!(corners(primitive), want, "mode {mode}");
    }
}

#[test]
fn points_and_lines_are_noted() {
    for mode in 0..4 {
        let mut file = File::square();
        file.primitive()["mode"] = json!(mode);
        let scene = file.load().unwrap();
        assert!(scene.meshes[0].primitives.is_empty());
        assert_eq!(
            (scene.notes[0].kind, scene.notes[0].place.as_str()),
            (NoteKind::Ignored, "meshes[0].primitives[0]")
        );
    }
}

#[test]
fn a_unit_is_noted_and_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("square.glb");
    std::fs::write(&path, File::square().glb()).unwrap();
    let [plain, in_unit] =
        [None, Some(0.01)].map(|unit| load(&path, &LoadOptions { unit, ..LoadOptions::default() }).unwrap());
    assert_eq!(corners(only(&plain)), corners(only(&in_unit)));
    assert!(plain.notes.is_empty(), "{:?}", plain.notes);
    assert_eq!((in_unit.notes[0].kind, in_unit.notes[0].place.as_str()), (NoteKind::Ignored, "unit"));
}

#[test]
fn flat_normals_split_vertices() {
    let mut file = File::square();
    file.primitive()["attributes"].as_object_mut().unwrap().remove("NORMAL");
    let scene = file.load().unwrap();
    let primitive = only(&scene);
    assert_eq!((primitive.positions.len(), primitive.uvs[0].len()), (6, 6));
    assert!(primitive.normals.iter().all(|&n| n == Vec3::Z));
    assert_eq!(primitive.uvs[0][2], Vec2::new(1.0, 0.0));
}

#[test]
fn sparse_accessors_replace_elements() {
    for with_base in [true, false] {
        let mut file = File::square();
        let indices = file.view(&[1, 3]);
        let values = file.view(&bytes(&[5f32, 6., 7., 8., 9., 10.], f32::to_le_bytes));
        file.json["accessors"][0]["sparse"] = json!({
            "count": 2, "indices": {"bufferView": indices, "componentType": 5121}, "values": {"bufferView": values}
        });
        if !with_base {
            file.json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
        }
        let scene = file.load().unwrap();
        let third = if with_base { Vec3::new(1.0, 1.0, 0.0) } else { Vec3::ZERO };
        let want = [Vec3::ZERO, Vec3::new(5.0, 6.0, 7.0), third, Vec3::new(8.0, 9.0, 10.0)];
        assert_eq!(only(&scene).positions, want);
    }
}

#[test]
fn every_integer_format_is_scaled_as_the_specification_says() {
    let cases: [(u32, bool, Vec<u8>, [f32; 2]); 8] = [
        (5120, false, vec![0x81, 0x7f], [-127.0, 127.0]),
        (5120, true, vec![0x80, 0x7f], [-1.0, 1.0]),
        (5121, false, vec![3, 255], [3.0, 255.0]),
        (5121, true, vec![51, 255], [0.2, 1.0]),
        (5122, false, bytes(&[-300i16, 300], i16::to_le_bytes), [-300.0, 300.0]),
        (5122, true, bytes(&[-32768i16, 16384], i16::to_le_bytes), [-1.0, 16384.0 / 32767.0]),
        (5123, false, bytes(&[7u16, 65535], u16::to_le_bytes), [7.0, 65535.0]),
        (5123, true, bytes(&[13107u16, 65535], u16::to_le_bytes), [0.2, 1.0]),
    ];
    for (component, normalized, pair, want) in cases {
        let mut file = File::square();
        let uv = file.accessor("VEC2", component, 4, &pair.repeat(4));
        file.json["accessors"][uv]["normalized"] = json!(normalized);
        file.primitive()["attributes"]["TEXCOORD_0"] = json!(uv);
        file.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        let scene = file.load().unwrap();
        assert_eq!(only(&scene).uvs[0], [Vec2::from(want); 4], "{component} {normalized}");
    }
}

#[test]
fn quantised_positions_and_normals() {
    let mut file = File::square();
    // Eight bytes from one to the next, of which six are used.
    let position: [i16; 16] = [0, 0, 0, 99, 100, 0, 0, 99, 100, 100, 0, 99, 0, 100, 0, 99];
    let position = file.accessor("VEC3", 5122, 4, &bytes(&position, i16::to_le_bytes));
    file.json["bufferViews"][position]["byteStride"] = json!(8);
    let normal = file.accessor("VEC3", 5120, 4, &[0, 0, 127, 0].repeat(4));
    file.json["bufferViews"][normal]["byteStride"] = json!(4);
    file.json["accessors"][normal]["normalized"] = json!(true);
    file.primitive()["attributes"]["POSITION"] = json!(position);
    file.primitive()["attributes"]["NORMAL"] = json!(normal);
    let scene = file.load().unwrap();
    assert_eq!(only(&scene).positions[2], Vec3::new(100.0, 100.0, 0.0));
    assert_eq!(only(&scene).normals, [Vec3::Z; 4]);
}

#[test]
fn colours_without_alpha_are_opaque() {
    let mut file = File::square();
    let color = file.accessor("VEC3", 5121, 4, &[255, 51, 0, 0].repeat(4));
    file.json["bufferViews"][color]["byteStride"] = json!(4);
    file.json["accessors"][color]["normalized"] = json!(true);
    file.primitive()["attributes"]["COLOR_0"] = json!(color);
    assert_eq!(only(&file.load().unwrap()).colors, [Vec4::new(1.0, 0.2, 0.0, 1.0); 4]);
}

fn textured() -> File {
    let mut file = File::square();
    file.add("images", json!({"uri": PNG, "name": "red"}));
    file.add("samplers", json!({"magFilter": 9728, "minFilter": 9984, "wrapS": 33071, "wrapT": 33648}));
    file.add("textures", json!({"source": 0, "sampler": 0}));
    file.add("textures", json!({"source": 0}));
    file.primitive()["material"] = json!(0);
    file
}

#[test]
fn every_slot_of_a_material_is_read() {
    let mut file = textured();
    let transform = |offset: f32| json!({"KHR_texture_transform": {"offset": [offset, 0.5], "scale": [2.0, 3.0]}});
    file.add(
        "materials",
        json!({
            "name": "all", "doubleSided": true, "alphaMode": "MASK", "alphaCutoff": 0.25, "emissiveFactor": [0.5, 0.25, 1.0],
            "pbrMetallicRoughness": {
                "baseColorFactor": [0.1, 0.2, 0.3, 0.4], "metallicFactor": 0.5, "roughnessFactor": 0.75,
                "baseColorTexture": {"index": 0, "extensions": transform(1.0)},
                "metallicRoughnessTexture": {"index": 0, "extensions": transform(2.0)},
            },
            "normalTexture": {"index": 0, "scale": -0.5, "extensions": transform(3.0)},
            "occlusionTexture": {"index": 0, "strength": 0.125, "extensions": transform(4.0)},
            "emissiveTexture": {"index": 1, "texCoord": 1, "extensions": transform(5.0)},
            "extensions": {
                "KHR_materials_emissive_strength": {"emissiveStrength": 8.0},
                "KHR_materials_ior": {"ior": 1.25},
                "KHR_materials_transmission": {
                    "transmissionFactor": 0.5, "transmissionTexture": {"index": 1, "extensions": transform(6.0)}
                },
                "KHR_materials_unlit": {},
            },
        }),
    );
    let scene = file.load().unwrap();
    let material = &scene.materials[0];
    assert_eq!((material.name.as_str(), scene.materials.len(), scene.textures.len()), ("all", 1, 1));
    assert_eq!((scene.textures[0].name.as_str(), scene.textures[0].rgba[0]), ("red", [255, 0, 0, 255]));
    assert_eq!(material.base_color, Vec4::new(0.1, 0.2, 0.3, 0.4));
    assert_eq!((material.metallic, material.roughness), (0.5, 0.75));
    assert_eq!((material.normal_scale, material.occlusion_strength), (-0.5, 0.125));
    assert_eq!(material.emissive, Vec3::new(4.0, 2.0, 8.0));
    assert_eq!((material.ior, material.transmission, material.unlit), (1.25, 0.5, true));
    assert_eq!((material.alpha, material.double_sided), (AlphaMode::Mask { cutoff: 0.25 }, true));
    let slots = [
        material.base_color_texture,
        material.metallic_roughness_texture,
        material.normal_texture,
        material.occlusion_texture,
        material.emissive_texture,
        material.transmission_texture,
    ];
    for (i, slot) in slots.into_iter().enumerate() {
        let slot = slot.unwrap();
        assert_eq!(slot.transform, [2.0, 0.0, 0.0, 3.0, i as f32 + 1.0, 0.5]);
        assert_eq!(slot.uv_set, u32::from(i == 4));
        let sampler = slot.sampler;
        match i {
            0..4 => {
                assert_eq!((sampler.wrap_u, sampler.wrap_v), (Wrap::ClampToEdge, Wrap::MirroredRepeat));
                assert_eq!((sampler.mag_linear, sampler.min_linear, sampler.mip), (false, false, MipFilter::Nearest));
            }
            _ => assert_eq!(sampler, lucerna::scene::Sampler::default()),
        }
    }
    // The second uv set is not in the file.
    assert_eq!(only(&scene).uvs.len(), 2);
    assert!(scene.notes.iter().any(|note| note.kind == NoteKind::Repaired && note.text.contains("TEXCOORD_1")));
}

#[test]
fn tangents_are_computed_only_for_normal_maps_and_given_ones_are_kept() {
    let mut file = textured();
    file.add("materials", json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
    assert_eq!(only(&file.load().unwrap()).tangents, [Vec4::ZERO; 4]);
    file.json["materials"][0]["normalTexture"] = json!({"index": 0});
    for tangent in &only(&file.load().unwrap()).tangents {
        assert!(tangent.abs_diff_eq(Vec4::new(1.0, 0.0, 0.0, 1.0), 1e-6), "{tangent}");
    }
    let given = file.floats("VEC4", &[0.0, 3.0, 1.0, -1.0].repeat(4));
    file.primitive()["attributes"]["TANGENT"] = json!(given);
    assert_eq!(only(&file.load().unwrap()).tangents, [Vec4::new(0.0, 1.0, 0.0, -1.0); 4]);
}

#[test]
fn other_image_sources_come_first() {
    let mut file = textured();
    file.add("images", json!({"uri": PNG, "name": "other"}));
    file.add("materials", json!({"emissiveTexture": {"index": 0}}));
    file.json["textures"][0]["extensions"] = json!({"EXT_texture_webp": {"source": 1}});
    assert_eq!(file.load().unwrap().textures[0].name, "other");
}

#[test]
fn nodes_are_ordered_and_instances_kept() {
    let mut file = File::square();
    // 0: the mesh, 1: child of 2, 2: child of 3 with a mirror, 3: a root in front.
    file.add("nodes", json!({"name": "leaf", "mesh": 0, "translation": [1.0, 2.0, 3.0]}));
    file.add("nodes", json!({"name": "middle", "children": [1], "scale": [-1.0, 1.0, 1.0]}));
    let matrix = Mat4::from_translation(Vec3::Y).to_cols_array();
    file.add("nodes", json!({"name": "root", "children": [2], "matrix": matrix}));
    file.json["scenes"] = json!([{"nodes": [3]}]);
    let scene = file.load().unwrap();
    let names: Vec<&str> = scene.nodes.iter().map(|node| node.name.as_str()).collect();
    assert_eq!(names, ["root", "middle", "leaf"]);
    let parents: Vec<Option<u32>> = scene.nodes.iter().map(|node| node.parent).collect();
    assert_eq!(parents, [None, Some(0), Some(1)]);
    let world = scene.nodes.iter().fold(Mat4::IDENTITY, |world, node| world * node.local.matrix());
    assert_eq!(world.transform_point3(Vec3::ZERO), Vec3::new(-1.0, 3.0, 3.0));
    assert!(world.determinant() < 0.0);
}

#[test]
fn cameras_and_lights() {
    let mut file = File::square();
    file.add("cameras", json!({"type": "perspective", "name": "eye", "perspective": {"yfov": 0.5, "znear": 0.1}}));
    file.add(
        "cameras",
        json!({"type": "orthographic", "orthographic": {"xmag": 2, "ymag": 3, "znear": 0, "zfar": 10}}),
    );
    let lights = json!([
        {"type": "directional", "color": [1, 0.5, 0.25], "intensity": 100},
        {"type": "point", "range": 5},
        {"type": "spot", "name": "lamp", "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.2}},
        {"type": "spot", "spot": {}},
    ]);
    file.json["extensions"] = json!({"KHR_lights_punctual": {"lights": lights}});
    file.add("nodes", json!({"camera": 0, "extensions": {"KHR_lights_punctual": {"light": 2}}}));
    let scene = file.load().unwrap();
    assert_eq!(
        scene.cameras[0].projection,
        Projection::Perspective { yfov: 0.5, aspect: None, znear: 0.1, zfar: None }
    );
    assert_eq!(scene.cameras[1].projection, Projection::Orthographic { xmag: 2.0, ymag: 3.0, znear: 0.0, zfar: 10.0 });
    let kinds: Vec<LightKind> = scene.lights.iter().map(|light| light.kind).collect();
    let eighth = std::f32::consts::FRAC_PI_4;
    assert_eq!(
        kinds,
        [
            LightKind::Directional,
            LightKind::Point { range: Some(5.0) },
            LightKind::Spot { range: None, inner: 0.1, outer: 0.2 },
            LightKind::Spot { range: None, inner: 0.0, outer: eighth },
        ]
    );
    assert_eq!((scene.lights[0].color, scene.lights[0].intensity), (Vec3::new(1.0, 0.5, 0.25), 100.0));
    assert_eq!((scene.lights[1].color, scene.lights[1].intensity), (Vec3::ONE, 1.0));
    assert_eq!((scene.nodes[1].camera, scene.nodes[1].light), (Some(0), Some(2)));
}

#[test]
fn animation_channels_of_every_kind() {
    let mut file = File::square();
    file.primitive()["targets"] = json!([{"POSITION": 0}, {"POSITION": 0}]);
    let times = file.floats("SCALAR", &[0.0, 0.5]);
    let moves = file.floats("VEC3", &[0., 0., 0., 1., 2., 3.]);
    let spline = file.floats("VEC3", &[9., 9., 9., 1., 1., 1., 8., 8., 8., 7., 7., 7., 2., 2., 2., 6., 6., 6.]);
    // Not of unit length, and as normalised integers.
    let turns = file.accessor("VEC4", 5122, 2, &bytes(&[0i16, 0, 0, 16384, 0, 23170, 0, 23170], i16::to_le_bytes));
    file.json["accessors"][turns]["normalized"] = json!(true);
    let weights = file.floats("SCALAR", &[0.0, 1.0, 1.0, 0.0]);
    let sampler =
        |output: usize, interpolation: &str| json!({"input": times, "output": output, "interpolation": interpolation});
    let target = |sampler: usize, path: &str| json!({"sampler": sampler, "target": {"node": 0, "path": path}});
    file.add(
        "animations",
        json!({
            "name": "all",
            "samplers": [
                sampler(moves, "STEP"), sampler(spline, "CUBICSPLINE"), sampler(turns, "LINEAR"), sampler(weights, "LINEAR"),
            ],
            "channels": [
                target(0, "translation"), target(1, "scale"), target(2, "rotation"), target(3, "weights"),
                target(0, "pointer"), {"sampler": 0, "target": {"path": "translation"}},
            ],
        }),
    );
    let scene = file.load().unwrap();
    let animation = &scene.animations[0];
    assert_eq!((animation.name.as_str(), animation.duration(), animation.channels.len()), ("all", 0.5, 4));
    assert_eq!(scene.notes.iter().filter(|note| note.place.starts_with("animations[0].channels")).count(), 2);
    let [moves, scale, turns, weights] = &animation.channels[..] else { unreachable!() };
    assert_eq!(moves.interpolation, Interpolation::Step);
    assert!(matches!(&moves.values, Keys::Translation(v) if v[..] == [Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0)]));
    assert_eq!(scale.interpolation, Interpolation::CubicSpline);
    assert!(matches!(&scale.values, Keys::Scale(v) if v.len() == 6 && v[1] == Vec3::ONE && v[5] == Vec3::splat(6.0)));
    let Keys::Rotation(turns) = &turns.values else { panic!() };
    assert!(turns[0].abs_diff_eq(Quat::IDENTITY, 1e-6));
    assert!(turns[1].abs_diff_eq(Quat::from_rotation_y(std::f32::consts::FRAC_PI_2), 1e-4), "{}", turns[1]);
    assert!(matches!(&weights.values, Keys::Weights { count: 2, values } if values[..] == [0.0, 1.0, 1.0, 0.0]));
}

#[test]
fn skins_bring_their_joints_into_the_scene() {
    let mut file = File::square();
    let joints = file.accessor("VEC4", 5121, 4, &[1, 0, 0, 0].repeat(4));
    // They sum to a half.
    let weights = file.floats("VEC4", &[0.25, 0.25, 0.0, 0.0].repeat(4));
    file.primitive()["attributes"]["JOINTS_0"] = json!(joints);
    file.primitive()["attributes"]["WEIGHTS_0"] = json!(weights);
    let bind = [Mat4::IDENTITY, Mat4::from_translation(Vec3::X)].map(|m| m.to_cols_array()).concat();
    let bind = file.floats("MAT4", &bind);
    file.add("nodes", json!({"name": "hip", "children": [2], "camera": 0}));
    file.add("nodes", json!({"name": "knee"}));
    file.add("cameras", json!({"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}}));
    file.add("skins", json!({"joints": [1, 2], "inverseBindMatrices": bind}));
    file.json["nodes"][0]["skin"] = json!(0);
    file.json["scenes"] = json!([{"nodes": [0]}]);
    let scene = file.load().unwrap();
    let names: Vec<&str> =
        scene.skins[0].joints.iter().map(|&joint| scene.nodes[joint as usize].name.as_str()).collect();
    assert_eq!(names, ["hip", "knee"]);
    assert_eq!(scene.skins[0].inverse_bind[1], Mat4::from_translation(Vec3::X));
    assert_eq!(only(&scene).weights[0], [Vec4::new(0.5, 0.5, 0.0, 0.0); 4]);
    // Joints outside the scene move it, but what stands at them is not shown.
    assert!(scene.nodes.iter().all(|node| node.camera.is_none()));

    // A joint that the skin does not have.
    file.json["skins"][0]["joints"] = json!([1]);
    assert!(file.error().contains("nodes[0].skin: meshes[0] uses joint 1, the skin has 1 joints"), "{}", file.error());
}

#[test]
fn sparse_morph_targets_and_default_weights() {
    let mut file = File::square();
    let indices = file.view(&bytes(&[2u16], u16::to_le_bytes));
    let values = file.view(&bytes(&[0f32, 0., 5.], f32::to_le_bytes));
    let sparse = json!({"count": 1, "indices": {"bufferView": indices, "componentType": 5123}, "values": {"bufferView": values}});
    let target = file.add("accessors", json!({"type": "VEC3", "componentType": 5126, "count": 4, "sparse": sparse}));
    file.primitive()["targets"] = json!([{"POSITION": target}]);
    let scene = file.load().unwrap();
    assert_eq!(only(&scene).morphs[0].positions, [Vec3::ZERO, Vec3::ZERO, Vec3::Z * 5.0, Vec3::ZERO]);
    assert!(only(&scene).morphs[0].normals.is_empty());
    assert_eq!(scene.meshes[0].weights, [0.0]);
    file.json["meshes"][0]["weights"] = json!([0.5]);
    file.json["nodes"][0]["weights"] = json!([0.75]);
    let scene = file.load().unwrap();
    assert_eq!((scene.meshes[0].weights[0], scene.nodes[0].weights[0]), (0.5, 0.75));
}

#[test]
fn text_files_with_resources_beside_them() {
    let file = File::square();
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("sub folder")).unwrap();
    std::fs::write(folder.path().join("sub folder/data.bin"), &file.bin).unwrap();
    let mut json = file.json.clone();
    json["buffers"] = json!([{"byteLength": file.bin.len(), "uri": "sub%20folder/data.bin"}]);
    let path = folder.path().join("scene.gltf");
    std::fs::write(&path, json.to_string()).unwrap();
    let scene = lucerna::scene::load(&path, &Default::default()).unwrap();
    assert_eq!((scene.name.as_str(), scene.meshes.len()), ("scene", 1));
    let Transform::Trs { scale, .. } = scene.nodes[0].local else { panic!() };
    assert_eq!(scale, Vec3::ONE);
    // A folder is an error that names the file in it.
    let error = lucerna::scene::load(folder.path(), &Default::default()).unwrap_err().to_string();
    assert!(error.contains("is a folder") && error.contains("scene.gltf"), "{error}");
}

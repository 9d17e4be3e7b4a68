//! `lucerna inspect`, `info`, `rerun`, `devices` and `list` from the outside: exit codes, messages, JSON.

use std::path::Path;

use crate::support::{asset, command, lucerna, ran};
use lucerna::image::{self, Layer, Layers, Metadata, WriteOptions};

fn picture(folder: &Path, name: &str, metadata: Metadata) -> String {
    let path = folder.join(name);
    let layers = Layers::rgb(2, 2, (0..12).map(|i| i as f32 / 8.0).collect());
    let layers = Layers { metadata, ..layers.with(Layer::new("depth", &["Z"], vec![1.0, 2.0, 3.0, f32::INFINITY])) };
    image::write(&path, &layers, &WriteOptions::default()).unwrap();
    path.to_str().unwrap().to_owned()
}

#[test]
fn wrong_usage_is_exit_code_2_and_says_what_is_right() {
    lucerna::<&str>([]).expect(2, &["Usage: lucerna"]);
    lucerna(["inspekt"]).expect(2, &["inspect"]);
    lucerna(["inspect"]).expect(2, &["--builtin"]);
    lucerna(["inspect", "a.gltf", "--builtin", "cornell"]).expect(2, &["cannot be used with"]);
    lucerna(["rerun", "a.png", "--tolerance", "nan"]).expect(2, &["a number from 0 on"]);
    let unknown = lucerna(["inspect", "--builtin", "cornel"]).expect(2, &["cornell", "furnace"]);
    assert_eq!(unknown.errors(), 1);
    lucerna(["--help"]).expect(0, &[]);
    assert!(lucerna(["--version"]).expect(0, &[]).stdout.contains(env!("CARGO_PKG_VERSION")));
}

#[test]
fn an_unreadable_scene_is_exit_code_3_and_names_the_file() {
    lucerna(["inspect", "no/such/scene.glb"]).expect(3, &["no/such/scene.glb"]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("broken.gltf");
    std::fs::write(&path, "{\"asset\": {\"version\": \"2.0\"}, \"nodes\": [{\"mesh\": 7}]").unwrap();
    assert_eq!(lucerna([Path::new("inspect"), &path]).expect(3, &["broken.gltf"]).errors(), 1);
    lucerna([Path::new("inspect"), folder.path()]).expect(3, &["is a folder", "broken.gltf"]);
    if let Some(path) = asset("gltf/RequiredUnknownExtension/ACMEBox.gltf") {
        lucerna([Path::new("inspect"), &path]).expect(3, &["ACMEBox.gltf", "extensionsRequired", "ACME_gizmo"]);
    }
}

#[test]
fn every_built_in_scene_is_inspected() {
    let list = lucerna(["list", "--json"]).expect(0, &[]).json();
    let list = list.as_array().unwrap();
    assert!(list.len() >= 5);
    assert!(list.iter().any(|entry| entry["kind"] == "thing"));
    for entry in list {
        let name = entry["name"].as_str().unwrap();
        assert!(!entry["description"].as_str().unwrap().is_empty());
        if entry["kind"] == "thing" {
            let stage = lucerna(["inspect", "--builtin", name, "--ground", "--copies", "3"]).expect(0, &[]).stdout;
            assert!(stage.contains("front") && stage.contains("ground"), "{stage}");
            continue;
        }
        let summary = lucerna(["inspect", "--json", "--builtin", name]).expect(0, &[]).json();
        assert!(summary["counts"]["triangles"].as_u64() > Some(0), "{name}");
        let cameras = summary["cameras"].as_array().unwrap();
        assert!(cameras.len() >= 3 && cameras.iter().all(|c| c["position"].is_array()), "{name}");
        assert!(summary["bounds"]["max"][0].as_f64() > summary["bounds"]["min"][0].as_f64(), "{name}");
        let text = lucerna(["inspect", "--builtin", name]).expect(0, &[]).stdout;
        assert!(text.starts_with(name) && text.contains("triangles"), "{text}");
    }
}

#[test]
fn a_skinned_model_is_counted_where_its_joints_put_it() {
    let Some(path) = asset("gltf/CesiumMan/CesiumMan.glb") else { return };
    let summary = lucerna([Path::new("inspect"), Path::new("--json"), &path]).expect(0, &[]).json();
    assert_eq!(summary["counts"]["joints"], 19);
    assert_eq!(summary["counts"]["triangles"], 4672);
    assert_eq!(summary["animations"][0]["seconds"], 2.0);
    // A man stands upright, 1.5 m high: without his skin he would lie on his back.
    let size = |axis: usize| {
        summary["bounds"]["max"][axis].as_f64().unwrap() - summary["bounds"]["min"][axis].as_f64().unwrap()
    };
    assert!((size(1) - 1.507).abs() < 0.01 && size(0) < 0.5, "{}", summary["bounds"]);
}

#[test]
fn an_image_says_what_is_in_it() {
    let folder = tempfile::tempdir().unwrap();
    let metadata = Metadata {
        program: "isr render".into(),
        device: "a device".into(),
        config: serde_json::json!({"settings": {"samples": 48}}),
        ..Metadata::default()
    };
    let path = picture(folder.path(), "a.exr", metadata.clone());
    let info = lucerna(["info", "--json", &path]).expect(0, &[]).json();
    assert_eq!((&info["width"], &info["height"]), (&2.into(), &2.into()));
    assert_eq!(info["metadata"]["config"]["settings"]["samples"], 48);
    let depth = info["layers"].as_array().unwrap().iter().find(|layer| layer["name"] == "depth").unwrap();
    assert_eq!(depth["channels"]["Z"]["max"], 3.0);
    assert_eq!(depth["channels"]["Z"]["not_finite"], 1);
    for name in ["a.exr", "b.png"] {
        let path = if name == "a.exr" { path.clone() } else { picture(folder.path(), name, metadata.clone()) };
        let text = lucerna(["info", &path]).expect(0, &[]).stdout;
        assert!(
            text.contains("2×2") && text.contains("device: a device") && text.contains("settings.samples = 48"),
            "{text}"
        );
    }
}

#[test]
fn what_is_no_image_is_refused_with_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let text = folder.path().join("note.exr");
    std::fs::write(&text, "not an image").unwrap();
    lucerna([Path::new("info"), &text]).expect(3, &["note.exr"]);
    lucerna(["info", "no/such.png"]).expect(3, &["no/such.png"]);
    // In a folder, every picture is read.
    lucerna([Path::new("info"), folder.path()]).expect(3, &["note.exr"]);
    let empty = tempfile::tempdir().unwrap();
    lucerna([Path::new("info"), empty.path()]).expect(3, &["a folder without pictures"]);
    // A picture without its recipe cannot be made again.
    let foreign = picture(folder.path(), "foreign.png", Metadata::default());
    lucerna(["rerun", &foreign]).expect(3, &["foreign.png", "does not say how it was made"]);
}

#[test]
fn without_a_device_it_is_exit_code_4_and_a_hint() {
    for arguments in [&["devices"][..], &["devices", "--json"], &["devices", "--require-gpu"]] {
        let mut none = command(env!("CARGO_BIN_EXE_lucerna"));
        none.args(arguments).env("VK_DRIVER_FILES", "/nowhere.json").env("VK_ICD_FILENAMES", "/nowhere.json");
        let ran = ran(&mut none).expect(4, &["driver"]);
        assert!(ran.stdout.is_empty(), "{}", ran.stdout);
    }
    lucerna(["devices"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_or_closed_output_is_no_panic() {
    use std::{fs::File, process::Stdio};
    let full = || Stdio::from(File::options().write(true).open("/dev/full").unwrap());
    let mut list = command(env!("CARGO_BIN_EXE_lucerna"));
    let output = list.args(["list"]).stdout(full()).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).contains("standard output"));
    // Nobody reads: like `lucerna … | true`.
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let mut list = command(env!("CARGO_BIN_EXE_lucerna"));
    assert_eq!(list.args(["list"]).stdout(writer).status().unwrap().code(), Some(0));
    // Nor can anyone hear.
    let mut broken = command(env!("CARGO_BIN_EXE_lucerna"));
    assert_eq!(broken.args(["info", "no/such.png"]).stderr(full()).status().unwrap().code(), Some(3));
}

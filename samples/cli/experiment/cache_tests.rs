use std::fs;

use lucerna::image::Layer;
use serde_json::json;

use super::*;
use crate::experiment::{kinds, sources};

fn inputs() -> Inputs {
    Inputs {
        scene: "abc".into(),
        view: json!([1.0, 2.0]),
        settings: json!({ "isr.samples": 24 }),
        seed: 0,
        repeat: 1,
        layers: vec!["direct".into()],
    }
}

fn key(kind: &str, device: &str, needs: &str, inputs: &Inputs) -> Key {
    Key::new(kinds::find(kind).unwrap(), device, needs, inputs).unwrap()
}

#[test]
fn a_key_changes_with_everything_that_it_is_made_of() {
    let name = |inputs: &Inputs| key("isr", "gpu", "", inputs).name;
    let same = name(&inputs());
    assert_eq!(same, name(&inputs()));
    let changed = [
        Inputs { scene: "abd".into(), ..inputs() },
        Inputs { view: json!([1.0, 2.5]), ..inputs() },
        Inputs { settings: json!({ "isr.samples": 48 }), ..inputs() },
        Inputs { seed: 1, ..inputs() },
        Inputs { repeat: 2, ..inputs() },
        Inputs { layers: vec!["indirect".into()], ..inputs() },
    ];
    let mut names: Vec<String> = changed.iter().map(name).collect();
    names.extend([same, key("isr", "cpu", "", &inputs()).name, key("isr", "gpu", "3.7", &inputs()).name]);
    names.push(key("igi", "gpu", "", &inputs()).name);
    let count = names.len();
    names.sort();
    names.dedup();
    assert_eq!(names.len(), count);
    // The path tracer on the CPU does not depend on the device.
    assert_eq!(key("path", "gpu", "", &inputs()).name, key("path", "cpu", "", &inputs()).name);
    let text = key("isr", "gpu", "", &inputs()).text;
    assert_eq!((text["sources"].as_str(), text["version"].as_str()), (Some(SOURCES), Some(program::VERSION)));
}

/// A picture of one colour.
fn picture(value: f32) -> Layers {
    Layers::new(4, 3).with(Layer::rgb("", &[[value; 3]; 12]))
}

struct Place {
    folder: tempfile::TempDir,
    key: Key,
}

impl Place {
    /// With one picture.
    fn new() -> Self {
        let place = Self { folder: tempfile::tempdir().unwrap(), key: key("isr", "gpu", "", &inputs()) };
        let times = Times { wall: vec![2.5], ..Times::default() };
        Cache::create(place.folder.path()).unwrap().put(&place.key, &picture(0.25), &times).unwrap();
        place
    }

    fn file(&self, extension: &str) -> PathBuf {
        self.folder.path().join("runs").join(format!("{}.{extension}", self.key.name))
    }

    /// As the next run of the program sees it.
    fn is_there(&self) -> bool {
        let cache = Cache::open(self.folder.path());
        let (times, content) = (cache.times(&self.key.name), cache.content(&self.key.name));
        let layers = cache.layers(&self.key.name);
        assert_eq!((times.is_some(), content.is_some()), (layers.is_ok(), layers.is_ok()));
        if let Err(error) = layers {
            assert!(error.to_string().contains(&self.key.name), "{error}");
        }
        times.is_some()
    }
}

#[test]
fn only_the_picture_that_was_kept_counts() {
    assert!(Place::new().is_there());
    let damage = |change: &dyn Fn(&mut Vec<u8>)| {
        let place = Place::new();
        let mut bytes = fs::read(place.file("exr")).unwrap();
        change(&mut bytes);
        fs::write(place.file("exr"), bytes).unwrap();
        place.is_there()
    };
    assert!(!damage(&|bytes| bytes.clear()));
    assert!(!damage(&|bytes| bytes.truncate(40)));
    assert!(!damage(&|bytes| *bytes.last_mut().unwrap() ^= 1));
    // Another picture that is whole.
    let other = image::encode(image::Format::Exr, &picture(0.5), &WriteOptions::default()).unwrap().0;
    assert!(!damage(&|bytes| bytes.clone_from(&other)));
    let gone = Place::new();
    fs::remove_file(gone.file("exr")).unwrap();
    assert!(!gone.is_there());
    // After it is made again, the picture counts.
    Cache::open(gone.folder.path()).put(&gone.key, &picture(0.25), &Times::default()).unwrap();
    assert!(gone.is_there());
}

#[test]
fn only_the_text_that_was_kept_counts() {
    let damage = |change: &dyn Fn(&str) -> String| {
        let place = Place::new();
        let text = fs::read_to_string(place.file("json")).unwrap();
        let changed = change(&text);
        assert_ne!(text, changed);
        fs::write(place.file("json"), changed).unwrap();
        place.is_there()
    };
    for (from, to) in [("2.5", "3.5"), ("2.5", "\"x\""), ("\"isr\"", "\"igi\""), ("{", "")] {
        assert!(!damage(&|text| text.replace(from, to)), "{from}");
    }
    assert!(!damage(&|_| String::new()));
    assert!(!damage(&|_| "{}".into()));
    // The whole text, and picture, of another key.
    let (place, other) = (Place::new(), key("isr", "gpu", "", &Inputs { seed: 7, ..inputs() }));
    Cache::open(place.folder.path()).put(&other, &picture(0.5), &Times::default()).unwrap();
    for extension in ["exr", "json"] {
        let from = place.folder.path().join("runs").join(format!("{}.{extension}", other.name));
        fs::copy(from, place.file(extension)).unwrap();
    }
    assert!(!place.is_there());
}

#[test]
fn only_measures_that_are_numbers_count() {
    let place = Place::new();
    let cache = Cache::open(place.folder.path());
    let values = [("mae", 0.125), ("psnr", f64::INFINITY), ("ssim", f64::NAN)];
    let map: Map<String, Value> = values.iter().map(|(name, value)| ((*name).into(), to_json(*value))).collect();
    cache.put_measures("pair", &map).unwrap();
    let read = |cache: &Cache, name: &str| cache.measures("pair").get(name).and_then(number);
    for (name, value) in values {
        let found = read(&cache, name).unwrap();
        assert!(found == value || (found.is_nan() && value.is_nan()), "{name}");
    }
    let file = place.folder.path().join("measures/pair.json");
    let text = fs::read_to_string(&file).unwrap();
    for (from, to) in [("0.125", "\"x\""), ("0.125", "0.25"), ("0.125", "null"), ("\"inf\"", "\"-inf\""), ("}", "")] {
        fs::write(&file, text.replace(from, to)).unwrap();
        assert!(cache.measures("pair").is_empty(), "{from} as {to}");
    }
    // A file with a right digest and wrong values.
    sealed::write(&file, &json!({ "mae": "x", "psnr": "inf", "ssim": [1], "hue": "1.5", "gmsd": 0.5 })).unwrap();
    let names: Vec<String> = cache.measures("pair").keys().cloned().collect();
    assert_eq!(names, ["gmsd", "psnr"]);
}

#[test]
fn every_source_that_can_change_a_picture_is_in_the_digest() {
    let root = Path::new(&std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_else(|| env!("CARGO_MANIFEST_DIR").into()))
        .join("..");
    let Ok(list) = sources::list(&root) else { panic!("the sources are not there") };
    let names: Vec<String> =
        list.iter().map(|path| path.strip_prefix(&root).unwrap().to_string_lossy().replace('\\', "/")).collect();
    for covered in [
        "Cargo.lock",
        "Cargo.toml",
        "build.rs",
        "engine/gpu/submit.rs",
        "engine/image/exr_read.rs",
        "engine/measure/ssim.rs",
        "engine/passes/gbuffer.rs",
        "engine/reference/path/mod.rs",
        "engine/reference/tonemap/mod.rs",
        "engine/tracer/kernel.rs",
        "engine/scene/bvh.rs",
        "engine/scene/gltf/materials.rs",
        "engine/shader/compile.rs",
        "engine/techniques/fiv/sky.rs",
        "samples/Cargo.toml",
        "samples/build.rs",
        "samples/cli/camera.rs",
        "samples/cli/experiment/kinds.rs",
        "samples/cli/experiment/kinds/fiv.rs",
        "samples/cli/experiment/place.rs",
        "samples/cli/experiment/run.rs",
        "samples/cli/export_pov/material.rs",
        "samples/cli/render.rs",
        "samples/cli/framing.rs",
        "samples/cli/ground.rs",
        "samples/cli/lights.rs",
        "samples/cli/stage.rs",
        "samples/fiv.rs",
    ] {
        assert!(names.iter().any(|name| name == covered), "{covered} can change a picture");
    }
    for folder in ["engine/", "samples/cli/", "shaders-glsl/scene/", "shaders-glsl/lib/", "shaders-glsl/reference/"] {
        assert!(names.iter().any(|name| name.starts_with(folder)), "{folder}");
    }
    for left_out in ["engine/README.md", "samples/cli/experiment/analysis/compare.rs", "samples/experiments/isr.toml"] {
        assert!(root.join(left_out).is_file() && !names.iter().any(|name| name == left_out), "{left_out}");
    }
    // What this was built from was such a digest.
    assert_eq!(SOURCES.len(), sources::digest(&root).unwrap().len());
}

#[test]
fn any_change_of_such_a_source_changes_the_digest() {
    let root = tempfile::tempdir().unwrap();
    let covered = ["engine/reference/path/mod.rs", "shaders-glsl/scene/a.comp", "samples/cli/stage.rs", "Cargo.lock"];
    let idle =
        ["engine/README.md", "engine/scene/tests.rs", "samples/cli/report/page.rs", "samples/experiments/a.toml"];
    let write = |name: &str, text: &str| {
        let path = root.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    };
    covered.iter().chain(&idle).for_each(|name| write(name, "one"));
    let first = sources::digest(root.path()).unwrap();
    for name in covered {
        write(name, "two");
        assert_ne!(sources::digest(root.path()).unwrap(), first, "{name}");
        write(name, "one");
        assert_eq!(sources::digest(root.path()).unwrap(), first, "{name}");
    }
    for name in idle {
        write(name, "two");
        assert_eq!(sources::digest(root.path()).unwrap(), first, "{name}");
    }
    // A new file counts, and so does a name.
    write("engine/new.rs", "");
    let more = sources::digest(root.path()).unwrap();
    assert_ne!(more, first);
    fs::rename(root.path().join("engine/new.rs"), root.path().join("engine/newer.rs")).unwrap();
    assert_ne!(sources::digest(root.path()).unwrap(), more);
}

//! `lucerna rerun` from the outside: pictures of every program are made again bit by bit, and no picture does more than that. Most of it
//! needs a device (each test says so when there is none).

use std::{
    fs,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use crate::support::{Ran, command, device, files, lucerna, ran};
use lucerna::{
    image::{self, Layers, Metadata, WriteOptions},
    scene::Limits,
};
use serde_json::{Value, json};

/// A picture of 8×8 pixels that says this of its making.
fn forged(folder: &Path, name: &str, changes: &Value) -> PathBuf {
    let mut config = json!({
        "command": ["isr", "render"], "scene": {"builtin": "cornell"}, "fingerprint": "0", "width": 8, "height": 8,
        "camera": {"scene": 0}, "first_frame": 0, "frame": 0, "time": 0.0, "fps": 30.0, "exposure": 0.0, "seed": 0, "mode": "isr",
        "settings": {},
    });
    for (key, value) in changes.as_object().unwrap() {
        config[key] = value.clone();
    }
    let path = folder.join(name);
    let layers = Layers { metadata: Metadata { config, ..Metadata::default() }, ..Layers::rgb(8, 8, vec![0.5; 192]) };
    image::write(&path, &layers, &WriteOptions { overwrite: true, ..WriteOptions::default() }).unwrap();
    path
}

fn rerun(picture: &Path) -> Ran {
    lucerna([Path::new("rerun"), picture])
}

#[test]
fn a_picture_passes_no_options_on() {
    let folder = tempfile::tempdir().unwrap();
    let victim = folder.path().join("victim.txt");
    fs::write(&victim, "precious").unwrap();
    let name = victim.to_str().unwrap();
    for words in [
        json!(["isr", "render", "--overwrite", "--timings", name]),
        json!(["isr", "render", "--overwrite", "--output", name]),
        json!(["isr", "--overwrite", "--timings", name]),
        json!(["lucerna", "reference", "--overwrite", "--output", name]),
        json!(["lucerna", "tonemap", name, "--output", name, "--overwrite"]),
        json!(["tonemap", "--overwrite"]),
        json!([]),
        json!("isr render"),
    ] {
        let picture = forged(folder.path(), "a.png", &json!({ "command": words }));
        assert_eq!(rerun(&picture).expect(3, &["a.png", "command", "no command that is made again"]).errors(), 1);
        assert_eq!(fs::read_to_string(&victim).unwrap(), "precious", "{words}");
    }
    assert_eq!(files(folder.path()), ["a.png", "victim.txt"]);
}

#[test]
fn cameras_of_numbers_and_lamps_that_were_put_elsewhere_are_made_again() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let picture = |name: &str, words: &[&str]| {
        let file = folder.path().join(name);
        let of = ["render", "isr", "--builtin", "cornell", "--size", "32x24", "--aa", "1", "-q", "-o"];
        let words = of.iter().copied().chain([file.to_str().unwrap()]).chain(words.iter().copied());
        lucerna(words).expect(0, &[]);
        file
    };
    let light = |file: &Path| image::read(file, &Limits::default()).unwrap().layers[0].data.clone();
    let plain = picture("plain.exr", &[]);
    for (name, words) in [
        ("camera.exr", &["--camera", "0.3,0.3,-0.6,0.2,0.2,0.3,60,0.02"][..]),
        ("put.exr", &["--put", "0=0.1,0.4,0.15"]),
    ] {
        let file = picture(name, words);
        assert_ne!(light(&file), light(&plain), "{name}");
        rerun(&file).expect(0, &[]);
    }
    let turned = |name: &str, degrees: &str| {
        let file = picture(name, &["--environment", "area", "--turn", degrees]);
        rerun(&file).expect(0, &[]);
        light(&file)
    };
    assert_ne!(turned("still.exr", "0"), turned("turned.exr", "-75"));
    for (words, parts) in [
        (["--turn", "10"], &["no environment that could be turned"][..]),
        (["--put", "7=1,2,3"], &["no lamp '7'", "0 '"]),
        (["--put", "0=1,2"], &["no sun"]),
        (["--put", "0"], &["LAMP=X,Y,Z"]),
        (["--camera", "1,2,3,1,2,3"], &["do not span a plane"]),
    ] {
        lucerna(["render", "isr", "--builtin", "cornell"].iter().chain(&words)).expect(2, parts);
    }
}

#[cfg(unix)]
#[test]
fn a_picture_starts_no_program() {
    // Whatever lies beside the executable.
    let folder = tempfile::tempdir().unwrap();
    let beside = folder.path().join("bin");
    fs::create_dir(&beside).unwrap();
    let lucerna = beside.join("lucerna");
    fs::copy(env!("CARGO_BIN_EXE_lucerna"), &lucerna).unwrap();
    let marker = folder.path().join("marker");
    let script = format!("#!/bin/sh\necho \"$0 $*\" >> {}\n", marker.display());
    for name in ["bash", "isr", "igi", "fiv", "tonemap"] {
        let program = beside.join(name);
        fs::write(&program, &script).unwrap();
        fs::set_permissions(&program, std::os::unix::fs::PermissionsExt::from_mode(0o755)).unwrap();
    }
    let touch = format!("touch {}", marker.display());
    for words in [json!(["bash", "-c", touch]), json!(["bash"]), json!(["isr", "render"]), json!(["fiv", "render"])] {
        // A size that is not that of the file ends the honest ones.
        let picture = forged(folder.path(), "a.png", &json!({ "command": words, "width": 9 }));
        ran(command(lucerna.to_str().unwrap()).arg("rerun").arg(&picture)).expect(3, &["a.png"]);
        assert!(!marker.exists(), "{words} ran {}", fs::read_to_string(&marker).unwrap());
    }
}

#[test]
fn work_without_bound_is_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let begun = Instant::now();
    for (changes, parts) in [
        (json!({ "frame": 4_000_000_000u32 }), &["frame", "4000000001", "--long"][..]),
        (json!({ "first_frame": 3, "frame": 2 }), &["frame", "3 to 2"]),
        (json!({ "width": 16384, "height": 16384 }), &["16384×16384", "8×8"]),
        (json!({ "width": 4_000_000_000u32, "view": "x" }), &["width"]),
        (json!({ "command": ["lucerna", "reference"], "mode": null, "settings": { "samples": u64::MAX } }), &["paths"]),
        (
            json!({ "command": ["fiv", "render"], "mode": null, "settings": { "fiv": {
            "azimuths": 1024, "polars": 513, "radii": 128 } } }),
            &["rays"],
        ),
        (json!({ "mode": "../x" }), &["mode", "occlusion"]),
        (json!({ "mode": "direct", "command": ["fiv", "render"] }), &["mode"]),
        (json!({ "settings": { "isr": { "sampels": 24 } } }), &["settings", "isr.samples"]),
        (json!({ "settings": { "isr": { "samples": 25 } } }), &["settings", "samples"]),
        (json!({ "settings": { "state": "/etc/passwd" } }), &["settings", "state"]),
        (json!({ "settings": [] }), &["settings"]),
        (json!({ "camera": { "file": { "position": [0, 0, 0], "target": [0, 0, 0] } } }), &["camera"]),
        (json!({ "fps": 0.0 }), &["fps"]),
        (json!({ "scene": { "builtin": "/etc/passwd" } }), &["passwd"]),
        (json!({ "scene": { "file": "no/such.glb" } }), &["reads", "no/such.glb"]),
        (json!({ "environment": "no/such.hdr" }), &["reads", "no/such.hdr"]),
        (json!({ "ground": { "copies": 4_000_000_000u32 } }), &["ground.copies"]),
    ] {
        let picture = forged(folder.path(), "a.png", &changes);
        let ran = rerun(&picture).expect(3, &[&["a.png"], parts].concat());
        assert_eq!(ran.errors(), 1, "{}", ran.stderr);
    }
    assert!(begun.elapsed() < Duration::from_secs(60), "{:?}", begun.elapsed());
    assert_eq!(files(folder.path()), ["a.png"]);
}

#[cfg(unix)]
#[test]
fn only_regular_files_are_read_and_each_is_named_before() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("pipe.gltf");
    assert!(command("mkfifo").arg(&pipe).status().unwrap().success());
    for file in ["/dev/zero", "/dev/stdin", pipe.to_str().unwrap(), "/proc/self/mem"] {
        let picture = forged(folder.path(), "a.png", &json!({ "scene": { "file": file } }));
        rerun(&picture).expect(3, &[&format!("reads {file:?}"), "a.png"]);
        let picture = forged(folder.path(), "a.png", &json!({ "environment": file }));
        rerun(&picture).expect(3, &[&format!("reads {file:?}"), "a.png"]);
        let tonemap = json!({ "command": ["tonemap"], "input": file, "gamma": "srgb" });
        let picture = forged(folder.path(), "a.png", &tonemap);
        rerun(&picture).expect(3, &[&format!("reads {file:?}"), "a.png"]);
    }
    // What a terminal would obey is shown as text.
    let picture = forged(folder.path(), "a.png", &json!({ "scene": { "file": "\u{1b}[2Jx.gltf" } }));
    rerun(&picture).expect(3, &["\\u{1b}[2Jx.gltf"]);
}

fn made(program: &str, arguments: &[&str]) {
    ran(command(program).args(arguments)).expect(0, &[]);
}

/// Makes it again: every byte is the same.
#[track_caller]
fn again(picture: &str) -> Ran {
    let told = lucerna(["rerun", "--json", picture]).expect(0, &[]);
    let report = told.json();
    assert!(report["same_file"] == true && report["metadata"] == json!([]), "{picture}: {report}");
    told
}

#[test]
fn pictures_of_every_technique_are_made_again() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let camera = at("left.toml");
    fs::write(&camera, "position = [0.278, 0.273, -0.8]\ntarget = [0.278, 0.273, 0]\nyfov_degrees = 39\n").unwrap();
    let scene = ["render", "--builtin", "cornell", "--size", "24x16", "-q"];
    let reference = ["reference", "--builtin", "cornell-area", "--size", "24x16", "-q", "--spp", "2"];
    let of_fiv =
        ["render", "--builtin", "furnace-sphere", "--env", "area", "--size", "16x12", "-q", "-D", "fiv.azimuths=6"];
    let few = ["-D", "fiv.polars=5", "-D", "fiv.radii=4", "-D", "fiv.size=8"];
    for ending in ["exr", "png"] {
        let [a, b, c, d, e] = ["a", "b", "c", "d", "e"].map(|name| at(&format!("{name}.{ending}")));
        let look = ["--camera", &camera, "--exposure", "-0.5", "-D", "samples=24", "--mode", "indirect", "--seed", "3"];
        made(env!("CARGO_BIN_EXE_isr"), &[&scene[..], &["-o", &a], &look].concat());
        let sun = ["--frames", "1..3", "--sun", "30,40", "--light", "0.2,0.3,0.2,0.1", "-D", "tonemap.operator=agx"];
        let frame = at(&format!("b-{{frame}}.{ending}"));
        made(env!("CARGO_BIN_EXE_igi"), &[&scene[..], &["-o", &frame], &sun].concat());
        fs::rename(at(&format!("b-2.{ending}")), &b).unwrap();
        made(env!("CARGO_BIN_EXE_fiv"), &[&of_fiv[..], &["-o", &c], &few].concat());
        made(
            env!("CARGO_BIN_EXE_lucerna"),
            &[&reference[..], &["-o", &d, "--show", "indirect", "--seed", "4"]].concat(),
        );
        made(env!("CARGO_BIN_EXE_isr"), &[&scene[..], &["-o", &e, "--view", "coarse.color"], &["--f32"]].concat());
        let before = files(folder.path());
        for picture in [&a, &b, &c, &d, &e] {
            again(picture);
        }
        assert_eq!(files(folder.path()), before, "nothing is written");
    }
}

#[test]
fn scene_and_environment_are_named_before_they_are_read() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (scene, sky, picture) = (at("-plate.obj"), at("sky.exr"), at("a.exr"));
    fs::write(&scene, "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let data = (0..8 * 4 * 3).map(|i| 0.1 + i as f32 * 0.01).collect();
    image::write(Path::new(&sky), &Layers::rgb(8, 4, data), &WriteOptions::default()).unwrap();
    let arguments = ["render", &scene, "--environment", &sky, "--size", "16x12", "-o", &picture, "-q", "--unit", "0.5"];
    made(env!("CARGO_BIN_EXE_isr"), &arguments);
    let told = again(&picture);
    for file in [&scene, &sky] {
        assert!(told.stderr.contains(&format!("reads {file:?}")), "{}", told.stderr);
    }
    // A scene that was edited gives another picture, and that is said.
    fs::write(&scene, "v -1 -1 0\nv 1 -1 0\nv 0 2 0\nf 1 2 3\n").unwrap();
    lucerna(["rerun", &picture]).expect(7, &["a.exr"]);
    fs::remove_file(&scene).unwrap();
    lucerna(["rerun", &picture]).expect(3, &["a.exr", "plate.obj"]);
}

#[test]
fn developed_pictures_are_made_again() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let light = |name: &str, scale: f32| {
        let data = (0..24 * 16 * 3).map(|i| scale * (0.01 + (i * i % 97) as f32 / 20.0)).collect();
        let picture = Layers::rgb(24, 16, data);
        let other = image::Layer { name: "direct".into(), ..picture.layers[0].clone() };
        image::write(Path::new(&at(name)), &picture.with(other), &WriteOptions::default()).unwrap();
    };
    light("in.exr", 1.0);
    let mask = Layers::rgb(24, 16, (0..24 * 16).flat_map(|i| [(i % 2) as f32; 3]).collect());
    image::write(Path::new(&at("mask.png")), &mask, &WriteOptions::default()).unwrap();
    let tonemap = env!("CARGO_BIN_EXE_tonemap");
    let (input, masked) = (at("in.exr"), at("mask.png"));
    let layer = format!("{input}:direct");
    for (number, (input, more)) in [
        (&input, &["--operator", "reinhard"][..]),
        (&input, &["--operator", "agx", "--exposure", "auto+0.5", "--gamma", "2.2", "--bits", "16"]),
        (&layer, &["--operator", "ashikhmin", "--mode", "selective", "--mask", &masked]),
        (&input, &["--operator", "linear", "--f32", "--quality", "80"]),
    ]
    .into_iter()
    .enumerate()
    {
        for ending in ["png", "exr", "jpg", "pfm"] {
            let out = at(&format!("out-{number}.{ending}"));
            made(tonemap, &[&[input.as_str(), "-o", &out, "-q"], more].concat());
            let told = again(&out);
            assert!(told.stderr.contains("reads") && told.stderr.contains("in.exr"), "{}", told.stderr);
        }
    }
    // The eye has adapted from the frames before.
    for (frame, scale) in [(3, 0.1), (4, 10.0), (7, 1.0)] {
        light(&format!("s-{frame:04}.exr"), scale);
    }
    made(tonemap, &[&at("s-####.exr"), "-o", &at("t-####.png"), "--fps", "5", "-q"]);
    for frame in [3, 4, 7] {
        again(&at(&format!("t-{frame:04}.png")));
    }
    let list = [at("s-0003.exr"), at("s-0004.exr")];
    made(tonemap, &[&list[0], &list[1], "--sequence", "-o", &at("l-####.png"), "-q"]);
    lucerna(["rerun", &at("l-0001.png")]).expect(3, &["l-0001.png", "list of names"]);
    fs::remove_file(at("s-0003.exr")).unwrap();
    lucerna(["rerun", &at("t-0007.png")]).expect(3, &["t-0007.png", "3 and 7"]);
    // A larger picture under the name of the input is not developed.
    let large = Layers::rgb(64, 64, vec![0.5; 64 * 64 * 3]);
    image::write(Path::new(&input), &large, &WriteOptions { overwrite: true, ..WriteOptions::default() }).unwrap();
    lucerna(["rerun", &at("out-0.png")]).expect(3, &["out-0.png", "64×64"]);
    assert!(image::read(at("out-0.png"), &Limits::default()).is_ok());
}

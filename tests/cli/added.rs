//! `--add` from the outside: objects in the scene of every command, and objects that a bake of daylight does not know.

use crate::support::{Ran, asset, command, device, isr, lucerna, ran};

fn daylight(arguments: &[&str]) -> Ran {
    ran(command(env!("CARGO_BIN_EXE_daylight")).args(arguments))
}

const COARSE: [&str; 12] = [
    "-D",
    "bake.density=0.5",
    "-D",
    "bake.samples=2",
    "-D",
    "bake.interval=240",
    "-D",
    "bake.bounces=2",
    "-D",
    "bake.tolerance=1",
    "-D",
    "bake.probe_samples=4",
];

#[test]
fn wrong_objects_are_refused_and_named() {
    let add = |text: &str| lucerna(["inspect", "--builtin", "cornell", "--add", text]);
    for text in ["pot.glb", "pot.glb@1,2", "pot.glb@1,2,x", "pot.glb@1,2,3,0", "@1,2,3", "builtin:@1,2,3"] {
        add(text).expect(2, &["--add", "FILE@X,Y,Z"]);
    }
    add("builtin:kettle@0,0,0").expect(2, &["--add", "kettle"]);
    add("no/such.glb@0,0,0").expect(3, &["no/such.glb", "--add"]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("none.obj");
    std::fs::write(&path, "v 0 0 0\n").unwrap();
    add(&format!("{}@0,0,0", path.display())).expect(3, &["none.obj"]);
}

#[test]
fn objects_are_in_the_scene_of_every_command() {
    let materials = |more: &[&str]| {
        let ran = lucerna([&["inspect", "--builtin", "cornell", "--json"], more].concat());
        ran.expect(0, &[]).json()["materials"].as_array().unwrap().len()
    };
    let before = materials(&[]);
    assert_ne!(before, materials(&["--add", "builtin:pot@0,0.1,0,2,45", "--add", "builtin:hare@0.1,0,0,0.1"]));
    if let Some(file) = asset("gltf/CesiumMan/CesiumMan.glb") {
        assert_ne!(before, materials(&["--add", &format!("{}@0,0.1,0,0.001", file.display())]));
    }
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let common = ["render", "--builtin", "cornell", "--size", "32x24", "--exposure", "0"];
    isr([&common[..], &["-o", &at("a.png")]].concat()).expect(0, &[]);
    isr([&common[..], &["--add", "builtin:hare@0.2,0,0.2,0.3", "-o", &at("b.png")]].concat()).expect(0, &[]);
    assert_ne!(std::fs::read(at("a.png")).unwrap(), std::fs::read(at("b.png")).unwrap());
    // The record of the picture has the object.
    lucerna(["rerun", &at("b.png")]).expect(0, &[]);
}

#[test]
fn baked_daylight_lights_objects_that_it_does_not_know() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (day, none) = (at("day.day"), at("none.day"));
    let bake = |out: &str, more: &[&str]| {
        daylight(&[&["bake", "--builtin", "cornell", "-o", out, "--json"], &COARSE[..], more].concat())
    };
    bake(&day, &["--probe-box", "0,0,0,1,1"]).expect(2, &["--probe-box", "X,Y,Z,X,Y,Z"]);
    bake(&day, &["--probe-box", "0,0,0,1,0,1"]).expect(2, &["--probe-box", "not flat"]);
    bake(&day, &["-D", "bake.probes=0", "--probe-box", "0,0,0,1,1,1"]).expect(2, &["--probe-box", "bake.probes"]);
    bake(&day, &["-D", "bake.probes=-1"]).expect(2, &["bake.probes", "0 to 1000"]);
    if !device() {
        return;
    }
    bake(&day, &["-D", "bake.probes=0.5"]).expect(0, &["probes"]);
    bake(&none, &["-D", "bake.probes=0"]).expect(0, &[]);
    let info = daylight(&["info", &day, "--json"]).expect(0, &[]).json();
    assert!(info["probes"]["probes"].as_u64().unwrap() >= 8, "{info}");
    assert!(daylight(&["info", &none, "--json"]).expect(0, &[]).json()["probes"].is_null());
    assert!(daylight(&["info", &day]).expect(0, &[]).stdout.contains("probes "));
    let picture = |bake: &str, out: &str, more: &[&str]| {
        let common =
            ["render", "--builtin", "cornell", "--bake", bake, "--size", "32x24", "--exposure", "-8", "-o", out];
        daylight(&[&common[..], more].concat())
    };
    let hare = ["--add", "builtin:hare@0.2,0,0.2,0.3"];
    picture(&day, &at("alone.png"), &[]).expect(0, &[]);
    picture(&day, &at("probes.png"), &hare).expect(0, &[]);
    picture(&day, &at("screen.png"), &[&hare[..], &["-D", "daylight.added=screen"]].concat()).expect(0, &[]);
    let bytes = |name: &str| std::fs::read(at(name)).unwrap();
    assert!(bytes("alone.png") != bytes("probes.png") && bytes("probes.png") != bytes("screen.png"));
    picture(&none, &at("none.png"), &hare).expect(3, &["none.day", "no probes", "daylight.added=screen"]);
    picture(&none, &at("none.png"), &[&hare[..], &["-D", "daylight.added=screen"]].concat()).expect(0, &[]);
    // A bake may know the object.
    let with = at("with.day");
    bake(&with, &hare).expect(0, &[]);
    picture(&with, &at("with.png"), &hare).expect(0, &[]);
    picture(&with, &at("without.png"), &[]).expect(3, &["with.day", "other geometry"]);
}

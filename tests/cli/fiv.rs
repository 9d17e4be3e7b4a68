//! `fiv` from the outside: files of vectors, also those of earlier versions, what is wrong with them, pictures. Needs a device (each test
//! says so when there is none).

use std::{fs, path::Path};

use lucerna::{
    image::{self, Layers, WriteOptions},
    techniques::fiv::Stored,
};
use serde_json::{Value, json};

use crate::support::{self, command, device, files, lucerna, ran};

const SMALL: [&str; 8] = ["-D", "fiv.azimuths=6", "-D", "fiv.polars=5", "-D", "fiv.radii=4", "-D", "fiv.size=8"];

fn fiv(arguments: &[&str]) -> support::Ran {
    ran(command(env!("CARGO_BIN_EXE_fiv")).args(arguments))
}

fn environment(folder: &Path, name: &str, light: f32) -> String {
    let path = folder.join(name);
    let pixel = |i: usize| [light, 0.5, if i % 16 < 5 { 3.0 } else { 0.2 }];
    let data = (0..128).flat_map(pixel).collect();
    image::write(&path, &Layers::rgb(16, 8, data), &WriteOptions { f32: true, ..WriteOptions::default() }).unwrap();
    path.to_str().unwrap().to_owned()
}

/// `fiv precompute` of the built-in sphere.
fn precompute(env: &str, out: &str, more: &[&str]) -> support::Ran {
    let base = ["precompute", "--builtin", "furnace-sphere", "--env", env, "-o", out];
    fiv(&[&base[..], &SMALL, more].concat())
}

#[test]
fn wrong_calls_are_refused_and_named() {
    fiv(&["precompute", "-o", "x.fiv"]).expect(2, &["MESH"]);
    fiv(&["precompute", "missing.glb", "--env", "missing.exr", "-o", "x.fiv"]).expect(3, &["missing.exr"]);
    let folder = tempfile::tempdir().unwrap();
    let env = environment(folder.path(), "sky.exr", 1.0);
    let out = folder.path().join("x.fiv");
    let out = out.to_str().unwrap();
    for (more, part) in [
        (&["-D", "fiv.azimuths=2"][..], "3 to 1024"),
        (&["-D", "fiv.size=12"], "multiples of 8"),
        (&["-D", "fiv.azimut=2"], "fiv.azimuths"),
        (&["--shard", "3/2"], "I/N"),
        (&["--shard", "auto"], "array job"),
        (&["--time-limit", "0"], "90s"),
        (&["-D", "fiv.self_samples=inside"], "surface"),
    ] {
        precompute(&env, out, more).expect(2, &[part]);
    }
    fiv(&["precompute", "--builtin", "cornell", "-o", out]).expect(2, &["--environment"]);
    fiv(&["merge", &env, "-o", out]).expect(3, &["sky.exr", "not a file of irradiance vectors"]);
    assert_eq!(files(folder.path()), ["sky.exr"]);
}

/// Some of the samples of a file, as earlier versions wrote parts and what a stopped run left.
fn part(whole: &str, path: &str, samples: std::ops::Range<u64>) {
    let whole = Stored::read(whole).unwrap();
    let mut part = Stored::empty(whole.plan.clone(), samples.start);
    part.push(&whole.fivs[9 * samples.start as usize..9 * samples.end as usize]);
    part.write(path, true).unwrap();
}

#[test]
fn parts_and_stopped_runs_give_the_same_bytes() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (env, whole) = (environment(folder.path(), "sky.exr", 1.0), at("whole.fiv"));
    let told = precompute(&env, &whole, &["--json"]).expect(0, &["6×5×4"]).json();
    assert_eq!(told["bytes"].as_u64(), fs::metadata(&whole).ok().map(|m| m.len()));
    assert_eq!(files(folder.path()), ["sky.exr", "whole.fiv"]);
    precompute(&env, &whole, &[]).expect(1, &["whole.fiv", "exists"]);
    let bytes = fs::read(&whole).unwrap();
    // Parts of earlier versions are joined as before.
    let samples = told["samples"].as_u64().unwrap();
    for (name, range) in [("1.fiv", 0..50), ("2.fiv", 50..51), ("3.fiv", 51..samples)] {
        part(&whole, &at(name), range);
    }
    fiv(&["merge", &at("3.fiv"), &at("1.fiv"), "-o", &at("joined.fiv")]).expect(3, &["missing"]);
    fiv(&["merge", &at("3.fiv"), &at("1.fiv"), &at("2.fiv"), "-o", &at("joined.fiv")]).expect(0, &[]);
    assert!(fs::read(at("joined.fiv")).unwrap() == bytes);
    // And what a stopped run of theirs has left is taken up.
    fs::copy(&whole, at("again.fiv.part")).unwrap();
    let told = precompute(&env, &at("again.fiv"), &["--json"]).expect(0, &["again.fiv.part: 2 units are taken"]).json();
    assert_eq!(told["computed"], 0);
    assert!(fs::read(at("again.fiv")).unwrap() == bytes && !Path::new(&at("again.fiv.part")).exists());
    // One that is damaged or of other work may be worth hours: it is neither used nor replaced without being told to.
    let (anew, left) = (at("anew.fiv"), at("anew.fiv.part"));
    fs::write(&left, &bytes[..bytes.len() / 2]).unwrap();
    precompute(&env, &anew, &[]).expect(3, &["anew.fiv.part", "cut off", "--restart"]);
    fs::copy(at("1.fiv"), &left).unwrap();
    precompute(&env, &at("other.fiv"), &["-D", "fiv.split=2"]).expect(0, &[]);
    let error = ["anew.fiv.parts", "other work", "`split` is `1` instead of `2`", "--restart"];
    precompute(&env, &anew, &["-D", "fiv.split=2"]).expect(1, &error);
    fs::remove_dir_all(at("anew.fiv.parts")).unwrap();
    precompute(&env, &anew, &["-D", "fiv.split=2"]).expect(1, &["anew.fiv.part:", "other work", "--restart"]);
    assert!(fs::read(&left).unwrap() == fs::read(at("1.fiv")).unwrap());
    precompute(&env, &anew, &["--restart"]).expect(0, &[]);
    assert!(fs::read(&anew).unwrap() == bytes && !Path::new(&left).exists());
}

#[test]
fn pictures_from_files_are_those_without_and_can_be_made_again() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (env, vectors) = (environment(folder.path(), "sky.exr", 1.0), at("v.fiv"));
    precompute(&env, &vectors, &["-q"]).expect(0, &[]);
    let picture = |env: &str, name: &str, more: &[&str]| {
        let base = ["render", "--builtin", "furnace-sphere", "--env", env, "--size", "32x24", "-q", "-o", name];
        fiv(&[&base[..], more].concat())
    };
    picture(&env, &at("a.exr"), &["--vectors", &vectors]).expect(0, &[]);
    picture(&env, &at("b.exr"), &[&["--full"][..], &SMALL].concat()).expect(0, &[]);
    let pixels = |name: &str| image::read(at(name), &Default::default()).unwrap().main().unwrap().data.clone();
    assert!(pixels("a.exr") == pixels("b.exr"));
    lucerna(["rerun", &at("a.exr")]).expect(0, &[]);
    // Settings must agree with the settings that the file decides.
    let asked = |key: &str| picture(&env, &at("d.exr"), &["--vectors", &vectors, "-D", key]);
    asked("fiv.azimuths=7").expect(2, &["v.fiv", "fiv.azimuths", "7", "6"]);
    asked("fiv.method=brute-force").expect(2, &["v.fiv", "fiv.method", "Leave out the vectors"]);
    picture(&env, &at("p.exr"), &["--paper"]).expect(2, &["--paper", "no preset"]);
    asked("fiv.azimuths=6").expect(0, &[]);
    precompute(&env, &at("idle.fiv"), &["-D", "fiv.turning=30"]).expect(0, &["do not depend on fiv.turning"]);
    // The file also decides the even spacing. Texels are separated for every method that is named.
    precompute(&env, &at("even.fiv"), &["-D", "fiv.adaptive=false"]).expect(0, &[]);
    let even = ["--vectors", &at("even.fiv"), "-D", "fiv.adaptive=true"];
    picture(&env, &at("e.exr"), &even).expect(2, &["even.fiv", "fiv.adaptive"]);
    let suns = ["-D", "fiv.suns=1", "-D", "fiv.method=brute-force"];
    precompute("point", &at("suns.fiv"), &suns).expect(0, &["do not depend on fiv.method"]);
    picture("point", &at("f.exr"), &["--vectors", &at("suns.fiv")]).expect(0, &[]);
    // Keys that vectors do not depend on are ignored.
    let online = ["-D", "fiv.method=online", "-D", "fiv.turns=2", "-D", "fiv.specular=summed"];
    precompute(&env, &at("turns.fiv"), &online).expect(0, &["do not depend on", "fiv.method", "fiv.specular"]);
    let apart = ["-D", "fiv.suns=1", "-D", "fiv.specular=summed", "-D", "fiv.negligible=0.1"];
    precompute("point", &at("apart.fiv"), &apart).expect(0, &["fiv.negligible", "fiv.specular"]);
    precompute(&env, &at("x.fiv"), &["-D", "fiv.negligible=2"]).expect(2, &["fiv.negligible", "0 to 1"]);
    precompute(&env, &at("x.fiv"), &["-D", "fiv.suns=1", "-D", "fiv.turns=2"]).expect(2, &["fiv.suns"]);
    // A note names the file and the samples that it lacks.
    let matt = at("without.fiv");
    precompute(&env, &matt, &["-q", "-D", "fiv.self_shadow=false"]).expect(0, &[]);
    let base = ["render", "--builtin", "furnace-sphere", "--env", &env, "--size", "8x8", "-o", &at("g.exr")];
    let noted = ["without.fiv", "samples on surfaces", "fiv.self_samples=surface"];
    fiv(&[&base[..], &["--vectors", &matt]].concat()).expect(0, &noted);
    let other = environment(folder.path(), "other.exr", 2.0);
    picture(&other, &at("c.exr"), &["--vectors", &vectors]).expect(3, &["v.fiv", "different radiance"]);
}

#[test]
fn things_stand_on_a_ground_and_the_picture_can_be_made_again() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let base = ["render", "--builtin", "queen", "--environment", "area", "--size", "24x24", "-q"];
    fiv(&[&base[..], &["--copies", "3", "-o", "x.exr"]].concat()).expect(2, &["--ground"]);
    let ground = ["--ground", "--copies", "3", "--beside", "hare", "--height", "0.5", "--sunk=-0.1", "--gap=0.2"];
    fiv(&[&base[..], &ground, &SMALL, &["-o", &at("a.exr")]].concat()).expect(0, &[]);
    lucerna(["rerun", &at("a.exr")]).expect(0, &[]);
    fiv(&[&base[..], &["--ground", "--sunk=7", "-o", &at("b.exr")]].concat()).expect(2, &["ground.sunk", "7"]);
    // A quick picture of a single mesh has fewer texels than one of several things.
    let size = |more: &[&str]| {
        let out = at("d.exr");
        let words = [&base[..], more, &["--json", "--overwrite", "-o", &out]].concat();
        let told: Value = serde_json::from_str(&fiv(&words).expect(0, &[]).stdout).unwrap();
        told["config"]["settings"]["fiv"]["size"].as_u64()
    };
    assert_eq!([size(&[]), size(&["--ground"])], [Some(8), Some(16)]);
    // The camera above the ground sees only the ground, which has one colour without shadows.
    let open = ["--camera", "ground", "-D", "fiv.method=unshadowed", "-o", &at("c.exr")];
    fiv(&[&base[..], &ground, &open].concat()).expect(0, &[]);
    let pixels = image::read(at("c.exr"), &Default::default()).unwrap().main().unwrap().rgb_pixels().unwrap();
    assert!(pixels[0][1] > 0.0 && pixels.iter().all(|p| (p[1] - pixels[0][1]).abs() < 1e-3 * pixels[0][1]));
}

#[test]
fn the_first_picture_has_few_vectors_unless_all_are_asked_for() {
    let config = |more: &[&str]| {
        let printed =
            fiv(&[&["render", "--builtin", "shadows", "--print-config"], more].concat()).expect(0, &[]).stdout;
        let value = |key: &str| {
            let line = printed.lines().find(|line| line.starts_with(&format!("{key} = ")));
            line.unwrap_or_else(|| panic!("{key}: {printed}")).split(' ').nth(2).unwrap().parse::<u32>().unwrap()
        };
        ["size", "azimuths", "polars", "radii"].map(value)
    };
    let (few, all) = ([16, 24, 13, 12], [32, 64, 33, 30]);
    assert_eq!(config(&[]), few);
    assert_eq!(config(&["-D", "fiv.method=online"]), few);
    assert_eq!(config(&["--full"]), all);
    // The truth has the whole environment.
    assert_eq!(config(&["-D", "fiv.method=brute-force"]), all);
    assert_eq!(config(&["-D", "fiv.polars=9"]), [16, 24, 9, 12]);
    let method = |more: &[&str]| {
        let asked = [&["render", "--builtin", "shadows", "--print-config"], more].concat();
        let printed = fiv(&asked).expect(0, &[]).stdout;
        let line = printed.lines().find(|line| line.starts_with("method = ")).unwrap().to_owned();
        line.split('"').nth(1).unwrap().to_owned()
    };
    // Only the vectors that the picture needs, unless a setting needs all of them.
    assert_eq!(method(&[]), "online");
    let single = fiv(&["render", "--builtin", "furnace-sphere", "--print-config"]).expect(0, &[]).stdout;
    assert!(single.contains("\nsize = 8"), "a single mesh has fewer texels: {single}");
    let none = fiv(&["render", "--print-config"]).expect(0, &[]).stdout;
    assert!(none.contains("\nsize = 16"), "{none}");
    for more in [&["--full"][..], &["-D", "fiv.suns=2"], &["-D", "fiv.specular=summed"], &["-D", "fiv.method=vectors"]]
    {
        assert_eq!(method(more), "vectors", "{more:?}");
    }
    fiv(&["render", "--full", "--vectors", "a.fiv"]).expect(2, &["--full", "--vectors"]);
}

#[test]
fn metals_are_not_black_in_a_quick_picture() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    // A triangle whose corners are (0 0 0), (1 0 0) and (0 1 0), metres.
    let gltf = |metallic: f32| {
        json!({
            "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
            "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "material": 0 }] }],
            "materials": [{ "pbrMetallicRoughness": { "metallicFactor": metallic, "roughnessFactor": 0.5 } }],
            "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] }],
            "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
            "buffers": [{ "byteLength": 36, "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA" }]
        })
    };
    let (metal, plastic) = (at("metal.gltf"), at("plastic.gltf"));
    for (path, metallic) in [(&metal, 1.0), (&plastic, 0.0)] {
        fs::write(path, gltf(metallic).to_string()).unwrap();
    }
    let config = |scene: &str, more: &[&str]| {
        let words = [&["render", scene, "--environment", "area", "--print-config"], more].concat();
        fiv(&words).expect(0, &[]).stdout
    };
    let has = |config: String, lines: &[&str]| {
        lines.iter().for_each(|line| assert!(config.contains(&format!("\n{line}")), "{line}: {config}"));
    };
    has(config(&metal, &[]), &["specular = \"summed\"", "method = \"vectors\"", "size = 8"]);
    has(config(&metal, &["-D", "fiv.specular=off"]), &["specular = \"off\"", "method = \"online\""]);
    has(config(&metal, &["-D", "fiv.method=online"]), &["specular = \"off\"", "method = \"online\""]);
    has(config(&plastic, &[]), &["specular = \"off\"", "method = \"online\"", "size = 8"]);
    if !device() {
        return;
    }
    let of = |scene: &str, name: &str| {
        lucerna(["render", scene, "--environment", "area", "--size", "16x12", "-o", &at(name)]).expect(0, &[]).stderr
    };
    assert!(of(&metal, "a.png").contains("technique: isr"));
    assert!(of(&plastic, "b.png").contains("technique: fiv"));
}

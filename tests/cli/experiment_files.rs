//! `lucerna reproduce` and `lucerna report`: mistakes in the file, files from elsewhere, and what may be missing.

use std::{
    fs,
    path::{Path, PathBuf},
};

use serde_json::Value;

use crate::{
    experiment_place::{EXPERIMENT, Place, contents, with_extension},
    support::{self, command, lucerna},
};

#[test]
fn mistakes_name_the_line() {
    let place = Place::new();
    let line = |part: &str| EXPERIMENT.lines().position(|line| line.contains(part)).unwrap() + 1;
    let scene = line("[[scene]]");
    let technique = line("[[technique]]");
    let cases = [
        ("size = \"40x30\"", "size = \"40\"", line("size ="), "WIDTHxHEIGHT"),
        ("size = \"40x30\"", "size = 40", line("size ="), "string"),
        ("\"mae\"", "\"mea\"", line("measures"), "mea"),
        ("images = 1", "imags = 1", line("images"), "imags"),
        ("builtin = \"cornell\"", "", scene, "one of builtin, file and image"),
        ("cameras = [\"0\"]", "", scene, "has no views"),
        ("builtin = \"cornell\"", "image = \"x.exr\"", scene, "is an image, which has its own"),
        (
            "builtin = \"cornell\"\ncameras = [\"0\"]",
            "image = \"x.exr\"\ngroup = \"g\"",
            technique,
            "'isr' renders scenes, and 'cornell'",
        ),
        ("cameras = [\"0\"]", "cameras = [\"0\"]\nsizes = [\"4by3\"]", scene, "sizes: expected WIDTHxHEIGHT"),
        ("cameras = [\"0\"]", "cameras = [\"7\"]", scene, "7"),
        ("cameras = [\"0\"]", "cameras = [\"0\"]\ndark_views = true", scene, "random is 0"),
        ("builtin = \"cornell\"", "builtin = \"cornel\"", scene, "cornell"),
        ("kind = \"isr\"", "kind = \"irs\"", technique, "there are isr"),
        ("isr.samples", "isr.sampels", technique, "isr.samples"),
        ("[24, 48]", "[24, \"many\"]", technique, "many"),
        ("[24, 48]", "[]", technique, "no values"),
        ("name = \"path\"", "name = \"isr\"", line("[[reference]]"), "two"),
        ("[quick.reference.path]", "[quick.reference.paht]", line("[quick.reference"), "paht"),
    ];
    for (from, to, line, says) in cases {
        assert!(EXPERIMENT.contains(from));
        place.file(&EXPERIMENT.replacen(from, to, 1));
        let quick = from.contains("quick");
        let ran = place.run("out", if quick { &["--quick"] } else { &[] });
        let known = ran.code == 3 || ran.code == 2;
        assert!(known && ran.stderr.contains(&format!("line {line}")), "{to}: {} {}", ran.code, ran.stderr);
        assert!(ran.stderr.contains(says) && ran.stderr.contains("e.toml"), "{to}: {}", ran.stderr);
        assert!(!place.path("out/report.html").exists());
    }
    lucerna(["reproduce", "smok"]).expect(2, &["did you mean 'smoke'"]);
    lucerna(["report", "/nowhere"]).expect(3, &["/nowhere", "reproduce"]);
    let list = lucerna(["reproduce", "--list", "--json"]).expect(0, &[]).json();
    assert!(list.as_array().unwrap().iter().any(|entry| entry["name"] == "smoke"));
}

#[test]
fn scenes_that_are_not_there_fail_or_are_skipped_by_name() {
    let place = Place::new();
    let hall = "\n[[scene]]\nname = \"hall\"\nfile = \"scenes/hall.gltf\"\ncameras = [\"0\"]\n";
    let text = EXPERIMENT.replacen("\n[[technique]]", &format!("{hall}\n[[technique]]"), 1);
    place.file(&text);
    let line = text.lines().position(|line| line.contains("hall")).unwrap();
    place.run("out", &["--quick"]).expect(3, &["hall", "scenes/hall.gltf", &format!("line {line}"), "--assets"]);
    place.file(&text.replace("scenes/hall.gltf\"", "scenes/hall.gltf\"\nif_missing = \"skip\""));
    place.run("out", &["--quick"]).expect(0, &["'hall' is skipped", "scenes/hall.gltf"]);
    let page = fs::read_to_string(place.path("out/report.html")).unwrap();
    assert!(page.contains("Left out: scene hall"));
}

#[test]
fn files_from_elsewhere_ask_for_no_work_without_bound() {
    let place = Place::new();
    let ten = "[1, 2, 3, 4, 5, 6, 7, 8, 9, 10]";
    let keys =
        ["samples", "radius", "strength", "layers", "bounces", "size", "near", "far", "bias", "limit", "seed", "x"];
    let matrix: Vec<String> = keys.iter().map(|key| format!("\"isr.{key}\" = {ten}")).collect();
    for (from, to, part) in [
        ("matrix = { \"isr.samples\" = [24, 48] }", format!("matrix = {{ {} }}", matrix.join(", ")), "1000000000000"),
        ("cameras = [\"0\"]", "random = 4000000000000".into(), "4000000000000"),
        ("matrix = { samples = [1, 2, 3] }", "matrix = { samples = [1, 4000000000] }".into(), "4000000000"),
        ("settings = { bounces = 1 }", "settings = { bounces = 4000000000 }".into(), "4000000000"),
    ] {
        assert!(EXPERIMENT.contains(from));
        place.file(&EXPERIMENT.replace(from, &to));
        let ran = place.run("out", &[]).expect(3, &[part]);
        assert_eq!(ran.errors(), 1, "{}", ran.stderr);
    }
}

#[test]
fn settings_of_a_paper_are_refused_where_there_are_none() {
    let place = Place::new();
    let from = "settings = { bounces = 1 }";
    place.file(&EXPERIMENT.replace(from, &format!("{from}\npaper = true")));
    place.run("out", &[]).expect(3, &["no preset with the settings of the paper", "line"]);
}

#[cfg(unix)]
#[test]
fn a_folder_from_elsewhere_names_no_file_outside_of_it() {
    let place = Place::new();
    let out = place.path("out");
    fs::create_dir_all(&out).unwrap();
    let victim = place.path("victim.txt");
    fs::write(&victim, "precious").unwrap();
    let manifest = |key: &str| {
        let run = match key {
            "" => serde_json::json!([]),
            key => serde_json::json!([{ "scene": "cornell", "group": "", "triangles": 1, "view": "0", "method": "isr",
                "variant": {}, "key": key, "exposure": null }]),
        };
        let text = serde_json::json!({ "name": "x", "path": null, "quick": false, "text": EXPERIMENT, "runs": run,
            "skipped": [], "missing": 0, "facts": [] });
        fs::write(out.join("manifest.json"), text.to_string()).unwrap();
    };
    let report = || lucerna([Path::new("report"), &out]);
    manifest("../../victim");
    report().expect(3, &["manifest.json", "../../victim", "no key"]);
    manifest("");
    std::os::unix::fs::symlink(&victim, out.join("report.html")).unwrap();
    report().expect(1, &["report.html", "symbolic link"]);
    assert_eq!(fs::read_to_string(&victim).unwrap(), "precious");
}

#[cfg(unix)]
#[test]
fn pictures_and_their_texts_are_not_written_through_links() {
    let place = Place::new();
    place.run("out", &["--quick"]).expect(0, &["wrote"]);
    let victim = place.path("victim.txt");
    for ending in ["exr", "json"] {
        let path = with_extension(&place.path("out/runs"), ending).remove(0);
        let before = fs::read(&path).unwrap();
        fs::write(&victim, "precious").unwrap();
        fs::remove_file(&path).unwrap();
        std::os::unix::fs::symlink(&victim, &path).unwrap();
        place.run("out", &["--quick"]).expect(1, &["is a link", path.to_str().unwrap()]);
        assert_eq!(fs::read_to_string(&victim).unwrap(), "precious");
        fs::remove_file(&path).unwrap();
        fs::write(&path, before).unwrap();
    }
}

#[cfg(unix)]
#[test]
fn a_program_that_fails_or_is_not_there_can_be_left_out() {
    use std::os::unix::fs::PermissionsExt;
    let place = Place::new();
    let pov = "\n[[technique]]\nname = \"pov\"\nkind = \"povray\"\nif_missing = \"skip\"\n";
    let run = |path: &Path, text: &str| {
        place.file(text);
        let arguments = place.arguments("out", &["--quick"]);
        support::ran(command(env!("CARGO_BIN_EXE_lucerna")).args(arguments).env("PATH", path))
    };
    let report = || -> Value { serde_json::from_slice(&fs::read(place.path("out/report.json")).unwrap()).unwrap() };
    let empty = place.path("empty");
    fs::create_dir(&empty).unwrap();
    run(&empty, &format!("{EXPERIMENT}{pov}")).expect(0, &[]);
    assert!(report()["warnings"][1].as_str().unwrap().contains("povray"), "{}", report()["warnings"]);
    run(&empty, &format!("{EXPERIMENT}{}", pov.replace("skip", "fail"))).expect(3, &["povray", "'pov'"]);

    let broken = place.path("broken");
    fs::create_dir(&broken).unwrap();
    let program = broken.join("povray");
    fs::write(
        &program,
        "#!/bin/sh\n[ \"$1\" = --version ] && echo 'POV-Ray 0' && exit 0\necho 'Fatal error: broken' >&2\nexit 1\n",
    )
    .unwrap();
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
    run(&broken, &format!("{EXPERIMENT}{pov}")).expect(0, &["pov is skipped", "broken"]);
    let json = report();
    assert!(json["warnings"][1].as_str().unwrap().contains("cornell/front pov"), "{}", json["warnings"]);
    run(&broken, &format!("{EXPERIMENT}{}", pov.replace("skip", "fail"))).expect(1, &["cornell/front pov", "broken"]);
}

#[test]
fn vectors_are_computed_once_and_kept() {
    let place = Place::new();
    place.file(
        r#"
title = "Vectors"
analysis = "fiv"
size = "24x24"

[[scene]]
name = "1 bunny"
builtin = "queen"
ground = { height = 1.0 }
environment = "area"
cameras = ["ground"]

[[scene]]
name = "10 bunnies"
builtin = "queen"
ground = { height = 1.0, copies = 2, beside = ["hare"] }
environment = "area"
cameras = ["ground"]

[[technique]]
name = "32x17x15"
kind = "fiv"
settings = { "fiv.azimuths" = 8, "fiv.polars" = 5, "fiv.radii" = 4, "fiv.size" = 8 }
layers = ["irradiance"]

[[reference]]
name = "brute force"
kind = "fiv"
settings = { "fiv.method" = "brute-force", "fiv.size" = 8 }
layers = ["irradiance", "covered"]
"#,
    );
    place.run("out", &[]).expect(0, &["wrote"]);
    // Two kinds of things in both scenes: two files of vectors, each with its cost.
    let mut kept = fs::read_dir(place.path("out/shared")).unwrap().map(|e| e.unwrap().path()).collect::<Vec<_>>();
    kept.sort();
    let ending = |end: &str| kept.iter().filter(|path| path.extension().is_some_and(|e| e == end)).count();
    assert_eq!((ending("fiv"), ending("json")), (2, 2));
    let report = fs::read_to_string(place.path("out/report.json")).unwrap();
    assert!(report.contains("NRMSE") && report.contains("unshadowed"), "{report}");
    // Without the pictures they are made from the same vectors, which are not written again.
    let written = |path: &PathBuf| fs::metadata(path).unwrap().modified().unwrap();
    let before: Vec<_> = kept.iter().map(written).collect();
    let first = contents(&place.path("out"));
    fs::remove_dir_all(place.path("out/runs")).unwrap();
    place.run("out", &[]).expect(0, &["wrote"]);
    assert_eq!(kept.iter().map(written).collect::<Vec<_>>(), before);
    assert!(contents(&place.path("out")) == first);
}

#[test]
fn every_shipped_experiment_finds_its_scenes_and_views() {
    let Some(assets) = support::asset("").filter(|_| support::device()) else { return };
    let (assets, place) = (assets.to_str().unwrap(), Place::new());
    let output = place.path("out");
    let list = lucerna(["reproduce", "--list", "--json"]).expect(0, &[]).json();
    for name in list.as_array().unwrap().iter().map(|entry| entry["name"].as_str().unwrap()) {
        // `isr-pair` has the scenes and views of `isr`.
        if name != "isr-pair" {
            let options = ["--dry-run", "--assets", assets, "-o", output.to_str().unwrap()];
            let listed = lucerna([&["reproduce", name], &options[..]].concat()).expect(0, &[]).stdout;
            assert!(listed.ends_with(" runs, 0 of them exist\n"), "{name}: {listed}");
        }
    }
}

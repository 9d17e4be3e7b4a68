//! `lucerna reproduce` and `lucerna report`: what is kept, what is rendered again, and what mistakes are told.

use crate::support;
use std::{
    collections::BTreeMap,
    fs,
    io::{BufRead, BufReader},
    path::{Path, PathBuf},
    process::{Child, Stdio},
};

use crate::support::{command, lucerna};
use serde_json::Value;

const EXPERIMENT: &str = r#"
title = "Test"
size = "40x30"
measures = ["mae", "pearson"]
images = 1

[[scene]]
name = "cornell"
builtin = "cornell"
cameras = ["0"]

[[technique]]
name = "isr"
kind = "isr"
matrix = { "isr.samples" = [24, 48] }

[[reference]]
name = "path"
kind = "path"
settings = { bounces = 1 }
matrix = { samples = [1, 2, 3] }

[quick]
size = "20x15"

[quick.reference.path]
matrix = { samples = [1] }
"#;

struct Place {
    folder: tempfile::TempDir,
}

impl Place {
    fn new() -> Self {
        let place = Self { folder: tempfile::tempdir().unwrap() };
        place.file(EXPERIMENT);
        place
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn file(&self, text: &str) {
        fs::write(self.path("e.toml"), text).unwrap();
    }

    fn arguments(&self, output: &str, more: &[&str]) -> Vec<String> {
        let (file, output) = (self.path("e.toml"), self.path(output));
        let first = ["reproduce", file.to_str().unwrap(), "-o", output.to_str().unwrap()];
        first.iter().chain(more).map(|text| (*text).to_owned()).collect()
    }

    fn run(&self, output: &str, more: &[&str]) -> support::Ran {
        lucerna(self.arguments(output, more))
    }

    /// How many runs there are, and how many of them would be rendered.
    fn planned(&self, output: &str, more: &[&str]) -> (usize, usize) {
        let runs = self.run(output, &[&["--dry-run", "--json"], more].concat()).expect(0, &[]).json();
        let runs = runs.as_array().unwrap();
        (runs.len(), runs.iter().filter(|run| run["there"] == false).count())
    }

    /// Starts it and waits until `runs` are done.
    fn start(&self, output: &str, runs: u64) -> Child {
        let mut child = command(env!("CARGO_BIN_EXE_lucerna"))
            .args(self.arguments(output, &["--progress", "json"]))
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
        let done = lines
            .by_ref()
            .map_while(Result::ok)
            .any(|line| serde_json::from_str::<Value>(&line).is_ok_and(|line| line["done"].as_u64() >= Some(runs)));
        assert!(done, "it ended too early");
        // It must be able to go on talking.
        std::thread::spawn(move || lines.for_each(drop));
        child
    }
}

/// Pictures and everything that does not come from a clock.
fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for part in ["", "runs", "measures"] {
        for entry in fs::read_dir(folder.join(part)).unwrap().map(Result::unwrap) {
            let name = entry.file_name().into_string().unwrap();
            // Records of runs hold times, and the page shows them.
            let timed =
                (part == "runs" && name.ends_with(".json")) || name.starts_with("times.") || name.ends_with(".html");
            if entry.path().is_file() && !timed {
                found.insert(format!("{part}/{name}"), fs::read(entry.path()).unwrap());
            }
        }
    }
    found
}

#[test]
fn what_was_killed_goes_on_and_ends_the_same() {
    let place = Place::new();
    place.run("whole", &[]).expect(0, &["wrote"]);
    let whole = contents(&place.path("whole"));
    assert_eq!(whole.keys().filter(|name| name.ends_with(".exr")).count(), 5);
    assert!(
        whole.contains_key("/report.json") && whole.contains_key("/report.csv") && whole.contains_key("/manifest.json")
    );

    // Killed in the middle: no report yet, but complete pictures.
    let mut child = place.start("parts", 2);
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(!place.path("parts/report.html").exists());
    let (all, left) = place.planned("parts", &[]);
    assert!(all == 5 && (1..=3).contains(&left), "{left} of {all} are left");
    let kept: Vec<(PathBuf, Vec<u8>)> = fs::read_dir(place.path("parts/runs"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "json"))
        .map(|path| (path.clone(), fs::read(path).unwrap()))
        .collect();
    assert_eq!(kept.len(), all - left);
    place.run("parts", &[]).expect(0, &["wrote"]);
    let parts = contents(&place.path("parts"));
    let temporary = |name: &&String| !name.contains(".lucerna-");
    assert_eq!(parts.keys().filter(temporary).collect::<Vec<_>>(), whole.keys().collect::<Vec<_>>());
    for (name, bytes) in &whole {
        assert!(parts[name] == *bytes, "{name} differs");
    }
    // What was there, with its times, was not made again.
    for (path, bytes) in kept {
        assert!(fs::read(&path).unwrap() == bytes, "{} was written again", path.display());
    }

    // From what is there, the same page again, by both ways.
    let page = fs::read(place.path("parts/report.html")).unwrap();
    fs::remove_file(place.path("parts/report.html")).unwrap();
    lucerna(["report".into(), place.path("parts")]).expect(0, &["wrote"]);
    assert!(fs::read(place.path("parts/report.html")).unwrap() == page, "the page differs");
    place.run("parts", &[]).expect(0, &[]);
    assert!(fs::read(place.path("parts/report.html")).unwrap() == page, "the page differs");

    only_what_changed_is_rendered(&place);
}

fn only_what_changed_is_rendered(place: &Place) {
    assert_eq!(place.planned("whole", &[]), (5, 0));
    // One value of a matrix, another order, a title, a measure: only the first needs a picture.
    let edited = EXPERIMENT.replace("[24, 48]", "[48, 80]").replace("Test", "Other").replace("\"pearson\"", "\"psnr\"");
    place.file(&edited);
    assert_eq!(place.planned("whole", &[]), (5, 1));
    place.file(&EXPERIMENT.replace("bounces = 1", "bounces = 0"));
    assert_eq!(place.planned("whole", &[]), (5, 3));
    place.file(&EXPERIMENT.replace("40x30", "41x30"));
    assert_eq!(place.planned("whole", &[]), (5, 5));
    place.file(&EXPERIMENT.replace("cameras = [\"0\"]", "cameras = [\"0\"]\nlight = [\"0,1.5,0,2\"]"));
    assert_eq!(place.planned("whole", &[]), (5, 5));
    place.file(EXPERIMENT);
    // Quick mode is other pictures, and can be beside.
    assert_eq!(place.planned("whole", &["--quick"]), (3, 3));
    place.run("whole", &["--quick"]).expect(0, &["20x15"]);
    assert_eq!((place.planned("whole", &[]), place.planned("whole", &["--quick"])), ((5, 0), (3, 0)));
    let json: Value = serde_json::from_slice(&fs::read(place.path("whole/report.json")).unwrap()).unwrap();
    assert_eq!((&json["facts"]["Mode"], &json["facts"]["Size"]), (&Value::from("quick"), &Value::from("20x15 pixels")));
    assert!(json["warnings"][0].as_str().unwrap().contains("Quick"));
    // A picture that is gone is rendered again, a damaged text too.
    let first = fs::read_dir(place.path("whole/runs"))
        .unwrap()
        .map(|e| e.unwrap().path())
        .find(|p| p.extension().is_some_and(|e| e == "exr"));
    fs::remove_file(first.unwrap()).unwrap();
    let (normal, quick) = (place.planned("whole", &[]).1, place.planned("whole", &["--quick"]).1);
    assert_eq!(normal + quick, 1);
}

#[cfg(unix)]
#[test]
fn what_is_interrupted_shows_what_is_there() {
    let place = Place::new();
    place.file(&EXPERIMENT.replace("[1, 2, 3]", "[2, 3, 4, 5, 6, 7, 8, 9]"));
    let mut child = place.start("out", 3);
    let interrupted = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(interrupted.success());
    assert_eq!(child.wait().unwrap().code(), Some(8));
    // Nobody waits for a page of measures; whoever wants one asks for it.
    assert!(!place.path("out/report.html").exists());
    lucerna(["report".into(), place.path("out")]).expect(0, &["wrote"]);
    let json: Value = serde_json::from_slice(&fs::read(place.path("out/report.json")).unwrap()).unwrap();
    assert!(json["warnings"][0].as_str().unwrap().contains("Not complete"), "{}", json["warnings"]);
    let page = fs::read_to_string(place.path("out/report.html")).unwrap();
    assert!(page.contains("Not complete") && page.ends_with("</html>\n"));
    let (all, left) = place.planned("out", &[]);
    assert!(all == 10 && (1..=7).contains(&left), "{left} of {all}");
}

/// Files of a folder with this extension, by name.
#[test]
fn shards_render_each_picture_once_and_the_same_command_reports_them() {
    let place = Place::new();
    place.run("whole", &[]).expect(0, &["wrote"]);
    place.run("parts", &["--shard", "1/2"]).expect(0, &["2 runs of 5, shard 1/2", "shard 1/2 is done, 2 runs"]);
    let parts = place.path("parts");
    assert!(!parts.join("report.html").exists() && !parts.join("manifest.json").exists());
    let first = with_extension(&parts.join("runs"), "exr");
    assert_eq!((first.len(), place.planned("parts", &["--shard", "1/2"])), (2, (2, 0)));
    // The other machine has a disk of its own; the folders are copied together.
    let json = place.run("other", &["--shard", "2/2", "--json"]).expect(0, &[]).json();
    assert_eq!((&json["shard"], &json["runs"], &json["missing"]), (&"2/2".into(), &3.into(), &0.into()), "{json}");
    for entry in fs::read_dir(place.path("other/runs")).unwrap().map(Result::unwrap) {
        assert!(!parts.join("runs").join(entry.file_name()).exists(), "two shards have rendered {entry:?}");
        fs::copy(entry.path(), parts.join("runs").join(entry.file_name())).unwrap();
    }
    assert_eq!(place.planned("parts", &[]), (5, 0));
    place.run("parts", &[]).expect(0, &["wrote"]);
    assert_eq!(contents(&place.path("whole")), contents(&parts));
    // More shards than pictures: some have nothing to do.
    place.run("parts", &["--shard", "1/9"]).expect(0, &["0 runs of 5", "shard 1/9 is done"]);
}

#[test]
fn a_time_limit_begins_nothing_that_would_end_later() {
    let place = Place::new();
    place.run("out", &["--time-limit", "0.001s"]).expect(8, &["time limit: stopped: 0 of 5 runs are done"]);
    let json = place.run("out", &["--time-limit", "0.001s", "--shard", "2/2", "--json"]);
    let json = json.expect(8, &["0 of 3 runs of shard 2/2"]).json();
    assert_eq!((&json["runs"], &json["missing"]), (&0.into(), &3.into()), "{json}");
    place.run("out", &["--time-limit", "1h"]).expect(0, &["wrote"]);
}

fn with_extension(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let paths = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut paths: Vec<PathBuf> = paths.filter(|path| path.extension().is_some_and(|e| e == extension)).collect();
    paths.sort();
    paths
}

#[test]
fn what_was_damaged_or_exchanged_is_made_anew_and_said() {
    let place = Place::new();
    place.file(&EXPERIMENT.replace("[24, 48]", "[24]").replace("[1, 2, 3]", "[1]"));
    place.run("out", &[]).expect(0, &["wrote"]);
    let whole = contents(&place.path("out"));
    let pictures = with_extension(&place.path("out/runs"), "exr");
    let [first, second] = &pictures[..] else { panic!("{pictures:?}") };
    let measures = with_extension(&place.path("out/measures"), "json").remove(0);
    let text = fs::read_to_string(&measures).unwrap();
    let mae = text.lines().find(|line| line.contains("\"mae\"")).unwrap();
    let changes: [(&Path, Vec<u8>); 5] = [
        (first, Vec::new()),
        (first, fs::read(first).unwrap()[..100].to_vec()),
        // A picture that can be read, but is another one.
        (first, fs::read(second).unwrap()),
        (&measures, text.replace(mae, "\"mae\": \"x\",").into_bytes()),
        (&measures, b"{".to_vec()),
    ];
    for (file, bytes) in changes {
        fs::write(file, bytes).unwrap();
        let name = file.file_name().unwrap().to_str().unwrap();
        place.run("out", &["-q"]).expect(0, &[name, "made again"]);
        assert!(contents(&place.path("out")) == whole, "{name}");
        // Once.
        assert!(!place.run("out", &["-q"]).expect(0, &[]).stderr.contains("made again"));
    }
}

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

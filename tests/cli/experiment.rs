//! `lucerna reproduce` and `lucerna report`: what is kept, and what is rendered again.

use std::{
    fs,
    path::{Path, PathBuf},
};

use serde_json::Value;

use crate::{
    experiment_place::{EXPERIMENT, Place, contents, with_extension},
    support::lucerna,
};

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
fn a_part_has_the_scenes_and_the_size_that_were_asked_for() {
    let place = Place::new();
    let scenes = EXPERIMENT.replace(
        "[[technique]]",
        "[[scene]]\nname = \"other\"\nbuiltin = \"primitives\"\ncameras = [\"0\"]\n\n[[technique]]",
    );
    place.file(&scenes.replace("cameras = [\"0\"]", "cameras = [\"0\"]\nsizes = [\"24x18\", \"16x12\"]"));
    assert_eq!(place.planned("out", &[]), (20, 20));
    assert_eq!(place.planned("out", &["--scene", "other"]), (10, 10));
    place.run("out", &["--scene", "other", "--size", "24x18"]).expect(0, &["5 runs, 1 scenes, 24x18", "wrote"]);
    // They are pictures of the whole, too.
    assert_eq!(place.planned("out", &[]), (20, 15));
    let report = || -> Value { serde_json::from_slice(&fs::read(place.path("out/report.json")).unwrap()).unwrap() };
    let first = report();
    assert_eq!(first["facts"]["Part"], "--size 24x18 --scene other");
    assert!(first["facts"]["Command"].as_str().unwrap().ends_with("--size 24x18 --scene other"), "{first}");
    assert!(first["warnings"][0].as_str().unwrap().contains("part of the experiment"), "{first}");
    lucerna(["report".into(), place.path("out")]).expect(0, &["wrote"]);
    assert_eq!(report(), first);
    place.run("no", &["--scene", "othr"]).expect(2, &["no scene 'othr'", "did you mean 'other'", "cornell, other"]);
    place.run("no", &["--size", "24"]).expect(2, &["WIDTHxHEIGHT"]);
    lucerna(["reproduce", "all", "--scene", "other"]).expect(2, &["takes no --scene"]);
    assert!(!place.path("no").exists());
}

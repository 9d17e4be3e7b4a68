//! `daylight` from the outside: pictures that are made again, frames, what is wrong with them. Needs a device (each test says so when there
//! is none).

use std::{fs, path::Path};

use crate::support::{self, command, device, files, lucerna, ran};
use serde_json::json;

fn daylight(arguments: &[&str]) -> support::Ran {
    ran(command(env!("CARGO_BIN_EXE_daylight")).args(arguments))
}

/// A bake of the box of few texels and steps.
fn bake(out: &str, more: &[&str]) {
    let small = ["-D", "bake.samples=4", "-D", "bake.interval=60", "-D", "bake.density=8", "-q"];
    daylight(&[&["bake", "--builtin", "cornell", "-o", out][..], &small, more].concat()).expect(0, &[]);
}

const PICTURE: [&str; 6] = ["render", "--builtin", "cornell", "--size", "24x16", "-q"];

#[test]
fn pictures_are_made_again_with_their_bake_and_with_no_other() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (day, picture) = (at("box.day"), at("a.exr"));
    bake(&day, &[]);
    let look = ["--time", "07:40", "--minutes", "25", "--frames", "2..3", "--mode", "indirect"];
    let look = [&look[..], &["-D", "daylight.interpolation=log-linear", "-D", "daylight.overcast=0.3"]].concat();
    daylight(&[&PICTURE[..], &["--bake", &day, "-o", &picture], &look].concat()).expect(0, &[]);
    let told = lucerna(["rerun", "--json", &picture]).expect(0, &[&format!("reads {day:?}")]);
    assert!(told.json()["same_file"] == true, "{}", told.stderr);
    // Another bake in its place is found out, and a missing one is named.
    fs::rename(&day, at("old.day")).unwrap();
    lucerna(["rerun", &picture]).expect(3, &["a.exr", "box.day"]);
    bake(&day, &["-D", "bake.seed=7"]);
    lucerna(["rerun", &picture]).expect(3, &["a.exr", "box.day", "digest"]);
    // A file of another kind.
    fs::write(&day, "no bake").unwrap();
    lucerna(["rerun", &picture]).expect(3, &["a.exr", "box.day", "not a file of baked daylight"]);
}

#[test]
fn frames_give_the_same_files_streamed_and_resident_and_are_made_again() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (day, frames) = (at("box.day"), at("box.frames"));
    bake(&day, &[]);
    let told = daylight(&["frames", &day, "-o", &frames, "--json"]).expect(0, &["wrote"]);
    let report = told.json();
    assert_eq!(report["bytes"], json!(fs::metadata(&frames).unwrap().len()));
    daylight(&["frames", &day, "-o", &frames]).expect(1, &["exists already"]);
    daylight(&["frames", &frames, "-o", &at("b.frames")]).expect(3, &["box.frames", "not a file of baked daylight"]);
    let run = |out: &str, more: &[&str]| {
        let sequence = ["--bake", &frames, "--time", "06:10", "--minutes", "25", "--frames", "0..6", "--json"];
        daylight(&[&PICTURE[..], &sequence, &["-o", &at(out)], more].concat()).expect(0, &[]).json()
    };
    run("r{frame}.exr", &[]);
    let streamed = run("s{frame}.exr", &["--stream", "--ring", "4"]);
    for frame in 0..6 {
        let read = |kind: &str| fs::read(at(&format!("{kind}{frame}.exr"))).unwrap();
        assert!(read("r") == read("s"), "frame {frame}");
        let numbers = &streamed["frames"][frame]["numbers"];
        assert!(numbers["stream_wait_ms"].is_number() && numbers["fetches"].as_f64().unwrap() > 0.0, "{numbers}");
    }
    lucerna(["rerun", &at("s4.exr")]).expect(0, &["box.frames"]);
    let none = at("x.exr");
    let wrong = [&PICTURE[..], &["--bake", &day, "-o", &none, "--stream"]].concat();
    daylight(&wrong).expect(2, &["--stream", "daylight frames"]);
    let wrong = [&PICTURE[..], &["--bake", &frames, "-o", &none, "--stream", "--ring", "3"]].concat();
    daylight(&wrong).expect(2, &["4"]);
    assert!(!Path::new(&none).exists() && !files(folder.path()).contains(&"b.frames".to_owned()));
}

#[test]
fn the_papers_preset_bakes_one_tile_and_renders() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let day = folder.path().join("paper.day").to_str().unwrap().to_owned();
    let few = ["-D", "bake.samples=4", "-D", "bake.interval=60", "-D", "bake.images=3", "-q", "--json"];
    let view = ["bake", "--builtin", "cornell", "--paper", "--kind", "view", "--size", "24x16", "-o", &day];
    let report = daylight(&[&view[..], &few].concat()).expect(0, &[]).json();
    assert_eq!((&report["settings"]["bake"]["tile"], &report["units"]), (&json!(0), &json!(1)), "{report}");
    assert_eq!(report["summary"]["most_images"], 3);
    let picture = folder.path().join("paper.exr").to_str().unwrap().to_owned();
    daylight(&[&PICTURE[..], &["--paper", "--bake", &day, "-o", &picture]].concat()).expect(0, &[]);
    lucerna(["rerun", &picture]).expect(0, &["paper.day"]);
    let huge = ["bake", "--builtin", "cornell", "--paper", "--kind", "view", "--size", "1600x1200", "-o", "x.day"];
    daylight(&huge).expect(2, &["bake.tile", "64"]);
}

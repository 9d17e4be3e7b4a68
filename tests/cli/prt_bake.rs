//! Bakes of rooms in units: killed after any stage, in any number of shards, in one folder or in several, with the same bytes.

use std::{
    fs,
    path::Path,
    time::{Duration, Instant},
};

use crate::{
    prt::{Lab, SCENE, SMALL},
    support::{command, device, files, lucerna},
};

/// Stages in the order in which one process computes them.
const STAGES: [&str; 6] = ["visibility", "gather", "direct", "basis", "transfer", "samples"];

/// Numbers of units of a stage in a folder.
fn units(parts: &Path, stage: &str) -> usize {
    let of_stage = |name: &&String| name.starts_with(stage) && name.ends_with(".unit");
    if parts.exists() { files(parts).iter().filter(of_stage).count() } else { 0 }
}

/// Starts a bake and kills it as soon as the stage has a unit; SIGKILL: nothing can be tidied up. Whether it was killed before its end.
fn killed(lab: &Lab, out: &str, stage: &str) -> bool {
    let words = [&["bake", "-q"][..], &SCENE, &SMALL, &["-o", out]].concat();
    let mut child = command(env!("CARGO_BIN_EXE_prt")).current_dir(lab.0.path()).args(words).spawn().unwrap();
    let parts = lab.at(&format!("{out}.parts"));
    let begun = Instant::now();
    while child.try_wait().unwrap().is_none() && units(&parts, stage) == 0 {
        assert!(begun.elapsed() < Duration::from_secs(300), "no unit of {stage} ever appeared");
        std::thread::sleep(Duration::from_millis(1));
    }
    let _ = child.kill();
    !child.wait().unwrap().success()
}

#[test]
fn killed_after_each_stage_the_same_command_ends_with_the_same_bytes() {
    if !device() {
        return;
    }
    let lab = Lab::new();
    lab.bake("whole.prt", &[]).expect(0, &[]);
    let whole = fs::read(lab.at("whole.prt")).unwrap();
    let parts = lab.at("room.prt.parts");
    for (number, stage) in STAGES.into_iter().enumerate() {
        let before = killed(&lab, "room.prt", stage);
        // The last stage has one unit, and the file may be there before the signal. Then it is whole.
        if number + 1 == STAGES.len() && lab.at("room.prt").exists() {
            assert!(fs::read(lab.at("room.prt")).unwrap() == whole, "half a file");
            return;
        }
        assert!(before, "{stage}: ended before it was killed");
        assert!(!lab.at("room.prt").exists());
        assert!(STAGES[..=number].iter().all(|stage| units(&parts, stage) > 0), "{stage}: {:?}", files(&parts));
    }
    let told = lab.bake("room.prt", &["--json"]).expect(0, &["goes on after", "wrote room.prt"]).json();
    // Stages that were whole are not computed again.
    for stage in STAGES[..4].iter().chain(&["transfer"]) {
        assert_eq!(told["seconds_of_stages"][stage], 0.0, "{stage}");
    }
    assert!(fs::read(lab.at("room.prt")).unwrap() == whole && !parts.exists());
}

/// Copies the units of a folder whose number is in turn, and its description.
fn share(lab: &Lab, from: &str, to: &str, [turn, of]: [usize; 2]) {
    fs::create_dir(lab.at(to)).unwrap();
    for (number, name) in files(&lab.at(from)).into_iter().enumerate() {
        if !name.ends_with(".unit") || number % of == turn {
            fs::copy(lab.at(from).join(&name), lab.at(to).join(&name)).unwrap();
        }
    }
}

#[test]
fn folders_of_two_machines_are_merged() {
    if !device() {
        return;
    }
    let lab = Lab::new();
    let path = |name: &str| lab.at(name).display().to_string();
    let merge = |words: &[&str]| {
        let paths: Vec<String> = words.iter().map(|name| path(name)).collect();
        lucerna(
            [&["merge".to_owned()][..], &paths[..paths.len() - 1], &["-o".into(), paths[paths.len() - 1].clone()]]
                .concat(),
        )
    };
    lab.bake("whole.prt", &[]).expect(0, &[]);
    let whole = fs::read(lab.at("whole.prt")).unwrap();
    // Two machines without a common disk bring their folders together after each turn.
    for turn in 0..3 {
        let code = if turn < 2 { 8 } else { 0 };
        lab.bake("a.prt", &["--shard", "1/2"]).expect(code, &[]);
        lab.bake("b.prt", &["--shard", "2/2"]).expect(code, &[]);
        if turn < 2 {
            merge(&["b.prt.parts", "a.prt.parts"]).expect(8, &["a.prt.parts", "missing", "transfer 0-"]);
            merge(&["a.prt.parts", "b.prt.parts"]).expect(8, &["b.prt.parts", "missing"]);
            merge(&["a.prt.parts", "b.prt.parts", "early.prt"]).expect(8, &["early.prt.parts", "missing"]);
            assert!(!lab.at("early.prt").exists());
        }
    }
    // By now each has all but the other one's transfer.
    merge(&["a.prt", "b.prt", "joined.prt"]).expect(0, &["joined.prt: "]);
    assert!(fs::read(lab.at("joined.prt")).unwrap() == whole);
    assert!(!lab.at("joined.prt.parts").exists() && lab.at("a.prt.parts").exists());
    // Two halves without a unit in common.
    lab.bake("all.prt", &["--shard", "1/1"]).expect(0, &["all units are there"]);
    share(&lab, "all.prt.parts", "half.prt.parts", [0, 2]);
    share(&lab, "all.prt.parts", "rest.prt.parts", [1, 2]);
    merge(&["half.prt.parts", "half.prt.parts", "halves.prt"]).expect(8, &["missing"]);
    merge(&["half.prt.parts", "rest.prt.parts", "halves.prt"]).expect(0, &["halves.prt: "]);
    assert!(fs::read(lab.at("halves.prt")).unwrap() == whole);
    // Other rooms, and files of other kinds.
    lab.bake("other.prt", &["--shard", "1/2", "-D", "room.seed=1"]).expect(8, &[]);
    merge(&["a.prt", "other.prt", "x.prt"]).expect(3, &["other.prt.parts", "another job", "seed"]);
    merge(&["a.prt", "x.day"]).expect(2, &["x.day", "units of kind `prt`", "ends with .prt"]);
    fs::write(lab.at("hall.day"), "a day").unwrap();
    fs::write(lab.at("notes.txt"), "notes").unwrap();
    merge(&["hall.day", "x.prt"]).expect(2, &["hall.day", "whole bake", "FILE.prt.parts"]);
    merge(&["a.prt", "hall.day", "x.prt"]).expect(2, &["hall.day", "no folder"]);
    merge(&["notes.txt", "x.prt"]).expect(2, &["parts are files"]);
    merge(&["nothing.prt.parts", "x.prt"]).expect(3, &["nothing.prt.parts"]);
    assert!(!lab.at("x.prt").exists() && !lab.at("x.day").exists());
}

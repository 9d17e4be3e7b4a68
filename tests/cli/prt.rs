//! `prt bake`, `prt render` and `prt info` from the outside.

use std::{fs, path::PathBuf};

use crate::support::{Ran, command, device, ran};
use lucerna::{image, scene::Limits};

pub struct Lab(pub tempfile::TempDir);

/// Settings that make a bake small.
pub const SMALL: [&str; 12] = [
    "-D",
    "room.samples=800",
    "-D",
    "room.cluster=200",
    "-D",
    "room.directions=100",
    "-D",
    "room.rays=64",
    "-D",
    "room.examples=60",
    "-D",
    "room.visibility=12",
];
pub const SCENE: [&str; 2] = ["--builtin", "cornell"];

impl Lab {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub fn at(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn run(&self, words: &[&str]) -> Ran {
        ran(command(env!("CARGO_BIN_EXE_prt")).current_dir(self.0.path()).args(words))
    }

    pub fn bake(&self, out: &str, more: &[&str]) -> Ran {
        self.run(&[&["bake"][..], &SCENE, &SMALL, &["-o", out], more].concat())
    }

    fn picture(&self, out: &str, more: &[&str]) -> Vec<f32> {
        let words = ["render", "--bake", "room.prt", "--size", "32x24", "-o", out];
        self.run(&[&words[..], &SCENE, more].concat()).expect(0, &[]);
        image::read(self.at(out), &Limits::default()).unwrap().main().unwrap().data.clone()
    }
}

#[test]
fn shards_and_one_run_give_the_same_bytes_and_a_finished_bake_renders() {
    if !device() {
        return;
    }
    let lab = Lab::new();
    let told = lab.bake("room.prt", &["--json"]).expect(0, &["samples", "wrote room.prt"]).json();
    assert!(told["summary"]["samples"].as_u64().unwrap() > 400 && told["missing"] == 0, "{told}");
    // Stages depend on other clusters, so shards take turns until all units are there.
    for _ in 0..3 {
        for shard in ["1/2", "2/2"] {
            let ran = lab.bake("other.prt", &["--shard", shard]);
            assert!(ran.code == 0 || ran.code == 8, "{} {}", ran.code, ran.stderr);
        }
    }
    // The parts hold all that the file needs, so they are joined without the scene.
    let merge = |parts: &str, out: &str| lab.run(&["merge", parts, "-o", out]);
    merge("other.prt", "joined.prt").expect(0, &["wrote joined.prt"]);
    assert!(fs::read(lab.at("room.prt")).unwrap() == fs::read(lab.at("joined.prt")).unwrap());
    merge("other.prt", "joined.fiv").expect(2, &["joined.fiv", "units of kind `prt`", ".prt"]);
    merge("room.prt", "joined.fiv").expect(2, &["room.prt", "whole bake", "FILE.prt.parts"]);
    assert!(!lab.at("joined.fiv").exists());
    lab.bake("other.prt", &[]).expect(0, &["wrote other.prt"]);
    assert!(fs::read(lab.at("room.prt")).unwrap() == fs::read(lab.at("other.prt")).unwrap());
    let info = lab.run(&["info", "room.prt"]).expect(0, &[]).stdout;
    assert!(info.contains("visibility") && info.contains("transfer"), "{info}");
    // Two lights are the sum of both; without light it is dark.
    let of = |out: &str, more: &[&str]| {
        lab.picture(out, &[more, &["--default-light", "never", "--mode", "irradiance"]].concat())
    };
    let one = of("one.exr", &[]);
    let more = of("more.exr", &["-D", "prt.strength=2"]);
    assert!(one.iter().sum::<f32>() > 0.0);
    for (one, more) in one.iter().zip(&more) {
        assert!((more - 2.0 * one).abs() <= 0.01 * more.abs() + 1e-6);
    }
    assert!(of("none.exr", &["-D", "prt.strength=0"]).iter().all(|value| *value == 0.0));
    // An other colour of the left wall.
    let picture = [&["render", "--bake", "room.prt", "--size", "32x24", "-o", "no.png"][..], &SCENE].concat();
    lab.run(&[&picture[..], &["--set", "nothing.albedo=1"]].concat()).expect(2, &["--set", "there is no material"]);
    lab.run(&[&picture[..], &["-D", "prt.vector=100000", "--mode", "transfer"]].concat()).expect(2, &["prt.vector"]);
    for (words, what) in [
        (["-D", "prt.spread=dots"], "expected one of `gather`, `splats`, `vertices`"),
        (["-D", "prt.splat_pixels=-1"], "0 to 64"),
        (["-D", "prt.eyes=11"], "0 to 10"),
    ] {
        lab.run(&[&picture[..], &words].concat()).expect(2, &[what]);
    }
    for mode in ["samples", "clusters", "transfer", "shadow", "direct", "indirect"] {
        let picture = lab.picture(&format!("{mode}.exr"), &["--mode", mode]);
        assert!(picture.iter().any(|value| *value > 0.0), "{mode}");
    }
    // Two eyes are side by side, and such a picture can be made again from its metadata.
    let both = lab.picture("eyes.exr", &["-D", "prt.eyes=0.1", "-D", "prt.spread=splats"]);
    assert_eq!(both.len(), 2 * 3 * 32 * 24);
    let mut rerun = command(env!("CARGO_BIN_EXE_lucerna"));
    ran(rerun.current_dir(lab.0.path()).args(["rerun", "eyes.exr"])).expect(0, &[]);
    // The pixels of named objects are known for one eye only, whether the file has layers or not.
    for file in ["two.exr", "two.png"] {
        let of = ["render", "--bake", "room.prt", "--size", "32x24", "--aa", "1", "-o", file];
        let named = ["tonemap.operator=ashikhmin", "tonemap.mode=selective", "tonemap.important=tall block"];
        let named: Vec<&str> = named.iter().flat_map(|define| ["-D", define]).collect();
        let eyes = ["-D", "prt.eyes=0.1"];
        lab.run(&[&of[..], &SCENE, &named, &eyes].concat()).expect(2, &["one eye"]);
        lab.run(&[&of[..], &SCENE, &named].concat()).expect(0, &[]);
    }
}

#[test]
fn bakes_of_other_scenes_and_odd_files_are_refused() {
    if !device() {
        return;
    }
    let lab = Lab::new();
    lab.bake("room.prt", &[]).expect(0, &[]);
    let render = |scene: &str, file: &str| lab.run(&["render", "--builtin", scene, "--bake", file, "-o", "x.png"]);
    render("furnace", "room.prt").expect(3, &["room.prt", "other geometry"]);
    let bytes = fs::read(lab.at("room.prt")).unwrap();
    fs::write(lab.at("cut.prt"), &bytes[..bytes.len() / 2]).unwrap();
    render("cornell", "cut.prt").expect(3, &["cut.prt", "cut off"]);
    fs::write(lab.at("odd.prt"), "odd").unwrap();
    render("cornell", "odd.prt").expect(3, &["odd.prt", "is not a file of precomputed transfer"]);
    render("cornell", "none.prt").expect(3, &["none.prt"]);
    assert!(!lab.at("x.png").exists());
    lab.bake("room.prt", &[]).expect(1, &["room.prt", "exists already"]);
    lab.bake("new.prt", &["-D", "room.samples=5"]).expect(2, &["room.samples", "16 to 1e6"]);
    let many = ["-D", "room.samples=1000000", "-D", "room.cluster=100"];
    lab.bake("new.prt", &many).expect(2, &["room.cluster", "240000 vectors of light", "at most 8192"]);
    lab.bake("new.prt", &["--inside", "0,0"]).expect(2, &["--inside"]);
    lab.bake("new.prt", &["--inside", "500,500,500"]).expect(3, &["--inside"]);
    assert!(!lab.at("new.prt").exists());
}

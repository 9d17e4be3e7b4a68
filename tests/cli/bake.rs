//! Computations in units from the outside: killed at any unit, in any number of shards, in one folder or in several, with the same bytes.

use std::{
    fs,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use crate::support::{Ran, command, device, files, lucerna, ran};
use lucerna::image::{self, Layers, WriteOptions};

/// A folder with an environment, and a job of eight units in it.
struct Lab(tempfile::TempDir);

impl Lab {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let data = (0..128).flat_map(|i| [1.0, 0.5, if i % 16 < 5 { 3.0 } else { 0.2 }]).collect();
        let options = WriteOptions { f32: true, ..WriteOptions::default() };
        image::write(folder.path().join("sky.exr"), &Layers::rgb(16, 8, data), &options).unwrap();
        Self(folder)
    }

    fn at(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn words<'a>(&self, out: &'a str, more: &[&'a str]) -> Vec<&'a str> {
        let size = ["-D", "fiv.azimuths=60", "-D", "fiv.polars=33", "-D", "fiv.radii=16", "-D", "fiv.size=8"];
        let rest = ["-D", "fiv.adaptive=false", "-D", "fiv.self_shadow=false", "-o", out];
        let base = ["precompute", "--builtin", "furnace-sphere", "--env", "sky.exr"];
        [&base[..], &size, &rest, more].concat()
    }

    fn fiv(&self, out: &str, more: &[&str]) -> Ran {
        ran(command(env!("CARGO_BIN_EXE_fiv")).current_dir(self.0.path()).args(self.words(out, more)))
    }

    fn lucerna(&self, words: &[&str]) -> Ran {
        ran(command(env!("CARGO_BIN_EXE_lucerna")).current_dir(self.0.path()).args(words))
    }

    /// Starts it and kills it as soon as so many units are there; SIGKILL: nothing can be tidied up.
    fn killed(&self, out: &str, more: &[&str], units: usize) {
        let words = self.words(out, more);
        let mut child =
            command(env!("CARGO_BIN_EXE_fiv")).current_dir(self.0.path()).args(words).arg("-q").spawn().unwrap();
        let parts = self.at(&format!("{out}.parts"));
        let begun = Instant::now();
        while child.try_wait().unwrap().is_none() && count(&parts) < units {
            assert!(begun.elapsed() < Duration::from_secs(300), "{units} units of {out} never appeared");
            std::thread::sleep(Duration::from_millis(1));
        }
        let _ = child.kill();
        child.wait().unwrap();
    }
}

fn count(parts: &Path) -> usize {
    if parts.exists() { files(parts).iter().filter(|name| name.ends_with(".unit")).count() } else { 0 }
}

#[test]
fn killed_at_any_unit_in_any_number_of_shards_the_bytes_are_the_same() {
    if !device() {
        return;
    }
    let lab = Lab::new();
    lab.fiv("whole.fiv", &[]).expect(0, &["wrote whole.fiv"]);
    let whole = fs::read(lab.at("whole.fiv")).unwrap();
    for (shards, kills) in [(1, &[1, 4][..]), (2, &[2, 5]), (5, &[1, 4, 7])] {
        let out = format!("{shards}.fiv");
        let shard = |number: usize| format!("{}/{shards}", number % shards + 1);
        for (number, units) in kills.iter().enumerate() {
            lab.killed(&out, &["--shard", &shard(number)], *units);
            assert!(!lab.at(&out).exists());
        }
        for number in (0..shards).rev() {
            lab.fiv(&out, &["--shard", &shard(number)]).expect(0, &["is done"]);
        }
        assert_eq!(count(&lab.at(&format!("{out}.parts"))), 8);
        let told = lab.fiv(&out, &["--json"]).expect(0, &["goes on after 31680 of 31680"]).json();
        assert_eq!((&told["computed"], &told["missing"]), (&0.into(), &0.into()));
        assert!(fs::read(lab.at(&out)).unwrap() == whole, "{shards} shards");
        assert!(!lab.at(&format!("{out}.parts")).exists());
    }
}

#[test]
fn folders_of_several_machines_are_joined_and_looked_into() {
    if !device() {
        return;
    }
    let lab = Lab::new();
    lab.fiv("whole.fiv", &[]).expect(0, &[]);
    let whole = fs::read(lab.at("whole.fiv")).unwrap();
    for (out, task) in [("a.fiv", "0"), ("b.fiv", "1"), ("c.fiv", "2")] {
        let mut task_of_three = command(env!("CARGO_BIN_EXE_fiv"));
        task_of_three.env("SLURM_ARRAY_TASK_ID", task).env("SLURM_ARRAY_TASK_COUNT", "3");
        ran(task_of_three.current_dir(lab.0.path()).args(lab.words(out, &["--shard", "auto"])))
            .expect(0, &["/3 is done"]);
    }
    fs::write(lab.at("b.fiv.parts/notes.txt"), "mine").unwrap();
    // What is missing is named; what is there stays for the next time.
    let said = lab.lucerna(&["merge", "a.fiv", "c.fiv", "-o", "joined.fiv"]).expect(8, &["missing: vectors 3-4"]);
    assert!(said.stdout.is_empty() && !lab.at("joined.fiv").exists());
    let status = lab.lucerna(&["bake", "status", "joined.fiv", "--json"]).expect(0, &[]).json();
    assert_eq!((&status["stages"][0]["whole"], &status["complete"]), (&6.into(), &false.into()));
    lab.lucerna(&["bake", "verify", "joined.fiv"]).expect(8, &[]);
    let joined = lab.lucerna(&["merge", "b.fiv", "a.fiv.parts", "c.fiv", "-o", "joined.fiv", "--json"]);
    let told = joined.expect(0, &["notes.txt", "stays"]).json();
    assert_eq!((&told["units"], &told["file"]), (&8.into(), &"joined.fiv".into()));
    assert!(fs::read(lab.at("joined.fiv")).unwrap() == whole && !lab.at("joined.fiv.parts").exists());
    assert_eq!(fs::read(lab.at("b.fiv.parts/notes.txt")).unwrap(), b"mine");
    lab.lucerna(&["merge", "a.fiv", "-o", "joined.fiv"]).expect(1, &["joined.fiv", "exists"]);
    // Into a folder.
    lab.lucerna(&["merge", "a.fiv", "b.fiv", "c.fiv", "-o", "all"]).expect(0, &["all 8 units are there"]);
    let verified = lab.lucerna(&["bake", "verify", "all"]).expect(0, &[]);
    assert!(
        verified.stdout.contains("vectors: 8 of 8 units") && verified.stdout.contains("split"),
        "{}",
        verified.stdout
    );
    // Damage is named, and made anew by the command.
    let path = lab.at("all/vectors-000005.unit");
    let mut bytes = fs::read(&path).unwrap();
    bytes[1000] ^= 1;
    fs::remove_file(&path).unwrap();
    fs::write(&path, &bytes).unwrap();
    let verified = lab.lucerna(&["bake", "verify", "all"]).expect(3, &[]);
    assert!(verified.stdout.contains("vectors-000005.unit: is damaged"), "{}", verified.stdout);
    fs::rename(lab.at("all"), lab.at("again.fiv.parts")).unwrap();
    let told = lab.fiv("again.fiv", &["--json"]).expect(0, &["is damaged", "made anew", "goes on after 27584"]).json();
    assert_eq!(told["computed"], 4096);
    assert!(fs::read(lab.at("again.fiv")).unwrap() == whole);
    // Folders of other jobs are not joined; the difference is named.
    lab.fiv("d.fiv", &["--shard", "1/3", "-D", "fiv.split=3"]).expect(0, &[]);
    let refused = ["d.fiv.parts", "`split` is `3` instead of `", "Join folders of one job"];
    lab.lucerna(&["merge", "a.fiv", "d.fiv", "-o", "x"]).expect(3, &refused);
    lab.lucerna(&["merge", "a.fiv", "whole.fiv", "-o", "x"]).expect(2, &["whole.fiv", "is no folder"]);
    lab.lucerna(&["bake", "status", "sky.exr"]).expect(3, &["sky.exr"]);
    // A list of units, with the shard of each.
    let plan = lab.lucerna(&["bake", "plan", "a.fiv", "--shards", "3"]).expect(0, &[]).json();
    let units = plan["units"].as_array().unwrap();
    let of = |shard: &str| units.iter().filter(|unit| unit["shard"] == shard).count();
    assert_eq!((units.len(), of("1/3"), of("2/3"), of("3/3")), (8, 3, 2, 3));
    assert!(units.iter().all(|unit| (unit["there"] == true) == (unit["shard"] == "1/3")), "{plan}");
}

#[test]
fn a_time_limit_ends_with_units_that_count_and_progress_is_told() {
    if !device() {
        return;
    }
    let lab = Lab::new();
    let said = lab.fiv("a.fiv", &["--time-limit", "0.001"]).expect(8, &["time limit: stopped after 0 of 31680"]);
    assert!(said.stdout.is_empty() && !lab.at("a.fiv").exists());
    lab.fiv("a.fiv", &["--shard", "1/2", "--progress", "openjd"])
        .expect(0, &["openjd_progress: 100.0", "openjd_status: "]);
    let json = lab.fiv("a.fiv", &["--time-limit", "10h", "--progress", "json"]).expect(0, &["\"bytes_per_second\""]);
    assert!(json.stdout.is_empty() && lab.at("a.fiv").exists());
    lab.fiv("b.fiv", &["--restart", "--shard", "2/2"]).expect(0, &["4 units of other shards are missing"]);
}

#[test]
fn plans_are_text_and_nothing_is_started() {
    let folder = tempfile::tempdir().unwrap();
    let job = ["--", "fiv", "precompute", "a.glb", "--environment", "sky.exr", "-o", "a.fiv"];
    let plan = |more: &[&str]| lucerna([&["bake", "plan", "--shards", "3"][..], more, &job].concat());
    let slurm = plan(&[]).expect(0, &[]).stdout;
    assert!(slurm.contains("--array=0-2") && slurm.contains("--shard auto/3") && slurm.contains("afterok"), "{slurm}");
    assert!(plan(&["--format", "openjd"]).json()["steps"][1]["dependencies"][0]["dependsOn"] == "Shards");
    assert!(plan(&["--format", "snakemake"]).stdout.contains("rule join"));
    assert!(plan(&["--format", "parallel"]).stdout.contains("--resume-failed"));
    let out = folder.path().join("job.sh");
    let out = out.to_str().unwrap();
    plan(&["-o", out]).expect(0, &[]);
    plan(&["-o", out]).expect(1, &["job.sh", "exists"]);
    assert_eq!(files(folder.path()), ["job.sh"]);
    lucerna(["bake", "plan", "--", "fiv", "precompute", "--shard", "1/2", "-o", "x"])
        .expect(2, &["COMMAND", "--shard"]);
    lucerna(["bake", "plan"]).expect(2, &["FOLDER"]);
    let none = folder.path().to_str().unwrap();
    lucerna(["bake", "status", none]).expect(3, &["job.json", "fiv precompute"]);
    lucerna(["merge", none, "-o", "x"]).expect(3, &["job.json"]);
}

#[test]
fn shards_of_a_reference_join_to_the_picture_of_one_run() {
    if !device() {
        return;
    }
    let lab = Lab::new();
    let base = ["reference", "--builtin", "cornell", "--size", "256x192", "--spp", "2"];
    let words = |out: &'static str, more: &[&'static str]| [&base[..], &["-o", out], more].concat();
    let whole = lab.lucerna(&words("whole.exr", &[]));
    whole.expect(0, &["wrote whole.exr"]);
    for (number, shard) in ["2/2", "1/2"].into_iter().enumerate() {
        let said = if number == 0 { "units of other shards are missing" } else { "all units are there" };
        lab.lucerna(&words("shards.exr", &["--shard", shard])).expect(0, &[&format!("shard {shard} is done"), said]);
        assert!(!lab.at("shards.exr").exists());
    }
    lab.lucerna(&["bake", "verify", "shards.exr"]).expect(0, &[]);
    lab.lucerna(&["merge", "shards.exr.parts", "-o", "b.exr"]).expect(2, &["b.exr", "PICTURE.parts"]);
    assert!(!lab.at("b.exr").exists());
    lab.lucerna(&["merge", "shards.exr.parts", "-o", "b.exr.parts"]).expect(0, &["all 3 units are there"]);
    lab.lucerna(&words("b.exr", &[])).expect(0, &["wrote b.exr"]);
    // Another picture does not mix with these units, and an error estimate needs the whole picture.
    let other = lab.lucerna(&[&words("shards.exr", &[])[..], &["--bounces", "1"]].concat());
    other.expect(1, &["shards.exr.parts", "bounces"]);
    let error = lab.lucerna(&words("shards.exr", &["--target-error", "0.1"]));
    error.expect(2, &["--target-error", "--restart"]);
    // The command without --shard joins, and a missing unit is traced.
    let unit = files(&lab.at("shards.exr.parts")).into_iter().find(|name| name.ends_with(".unit")).unwrap();
    fs::remove_file(lab.at("shards.exr.parts").join(unit)).unwrap();
    lab.lucerna(&words("shards.exr", &[])).expect(0, &["goes on after", "wrote shards.exr"]);
    assert!(fs::read(lab.at("whole.exr")).unwrap() == fs::read(lab.at("shards.exr")).unwrap());
    assert!(fs::read(lab.at("whole.exr")).unwrap() == fs::read(lab.at("b.exr")).unwrap());
    assert!(!lab.at("shards.exr.parts").exists());
    lab.lucerna(&["rerun", "shards.exr"]).expect(0, &[]);
    lab.lucerna(&words("-", &["--shard", "1/2"])).expect(2, &["--shard", "file"]);
}

#[test]
fn leftovers_beside_a_reference_neither_harm_nor_lose_it() {
    if !device() {
        return;
    }
    let lab = Lab::new();
    let words = |more: &[&'static str]| {
        [&["reference", "--builtin", "cornell", "--size", "256x192", "--spp", "2"][..], more].concat()
    };
    lab.lucerna(&words(&["-o", "whole.exr"])).expect(0, &[]);
    let whole = fs::read(lab.at("whole.exr")).unwrap();
    let same = |name: &str| assert!(fs::read(lab.at(name)).unwrap() == whole, "{name}");
    // A folder that is no job is no folder of bands.
    fs::create_dir(lab.at("a.exr.parts")).unwrap();
    lab.lucerna(&words(&["-o", "a.exr"])).expect(0, &["wrote a.exr"]);
    assert!(files(&lab.at("a.exr.parts")).is_empty());
    same("a.exr");
    // A state of a single run beside the bands stays as it is, and is not in their way.
    fs::write(lab.at("b.exr.state"), "hours of work").unwrap();
    lab.lucerna(&words(&["-o", "b.exr"])).expect(1, &["b.exr.state", "--restart"]);
    lab.lucerna(&words(&["-o", "b.exr", "--shard", "1/2"])).expect(0, &["shard 1/2 is done"]);
    // The folder is found beside any of the files.
    let joined = lab.lucerna(&words(&["-o", "b.png", "-o", "b.exr", "--json"]));
    let json: serde_json::Value = serde_json::from_str(&joined.stdout).unwrap();
    joined.expect(0, &["goes on after"]);
    assert!(json["paths_per_second"].as_f64().unwrap() > 0.0 && json["paths"] == 2 * 256 * 192, "{json}");
    same("b.exr");
    assert!(lab.at("b.png").exists() && !lab.at("b.exr.parts").exists());
    assert_eq!(fs::read(lab.at("b.exr.state")).unwrap(), b"hours of work");
    // --restart drops bands, of this picture and of another.
    for first in ["3", "2"] {
        let shard = lab
            .lucerna(&[&words(&["-o", "c.exr", "--shard", "1/3", "--overwrite"])[..], &["--bounces", first]].concat());
        shard.expect(0, &[]);
        lab.lucerna(&words(&["-o", "c.exr", "--restart", "--overwrite"])).expect(0, &["wrote c.exr"]);
        same("c.exr");
        assert!(!lab.at("c.exr.parts").exists());
    }
    // A shard with --restart leaves the bands of other shards.
    let units = |folder: &str| count(&lab.at(folder));
    lab.lucerna(&words(&["-o", "d.exr", "--shard", "1/3"])).expect(0, &[]);
    let first = units("d.exr.parts");
    lab.lucerna(&words(&["-o", "d.exr", "--shard", "2/3", "--restart"])).expect(0, &[]);
    assert!(first > 0 && units("d.exr.parts") > first);
    // A time limit keeps no picture and says so, also as JSON.
    let long =
        ["reference", "--builtin", "cornell", "--size", "256x192", "--spp", "100000", "-o", "e.exr", "--shard", "1/1"];
    let stopped = lab.lucerna(&[&long[..], &["--time-limit", "1.5s", "--json"]].concat());
    let json: serde_json::Value = serde_json::from_str(&stopped.stdout).unwrap();
    stopped.expect(8, &["time limit"]);
    assert!(json["complete"] == false && json["missing"].as_u64().unwrap() > 0, "{json}");
}

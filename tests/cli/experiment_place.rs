//! A folder with a small experiment.

use std::{
    collections::BTreeMap,
    fs,
    io::{BufRead, BufReader},
    path::{Path, PathBuf},
    process::{Child, Stdio},
};

use serde_json::Value;

use crate::support::{self, command, lucerna};

pub const EXPERIMENT: &str = r#"
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

pub struct Place {
    folder: tempfile::TempDir,
}

impl Place {
    pub fn new() -> Self {
        let place = Self { folder: tempfile::tempdir().unwrap() };
        place.file(EXPERIMENT);
        place
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn file(&self, text: &str) {
        fs::write(self.path("e.toml"), text).unwrap();
    }

    pub fn arguments(&self, output: &str, more: &[&str]) -> Vec<String> {
        let (file, output) = (self.path("e.toml"), self.path(output));
        let first = ["reproduce", file.to_str().unwrap(), "-o", output.to_str().unwrap()];
        first.iter().chain(more).map(|text| (*text).to_owned()).collect()
    }

    pub fn run(&self, output: &str, more: &[&str]) -> support::Ran {
        lucerna(self.arguments(output, more))
    }

    /// How many runs there are, and how many of them would be rendered.
    pub fn planned(&self, output: &str, more: &[&str]) -> (usize, usize) {
        let runs = self.run(output, &[&["--dry-run", "--json"], more].concat()).expect(0, &[]).json();
        let runs = runs.as_array().unwrap();
        (runs.len(), runs.iter().filter(|run| run["there"] == false).count())
    }

    /// Starts it and waits until `runs` are done.
    pub fn start(&self, output: &str, runs: u64) -> Child {
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
pub fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
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

/// Files of a folder with this extension, by name.
pub fn with_extension(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let paths = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut paths: Vec<PathBuf> = paths.filter(|path| path.extension().is_some_and(|e| e == extension)).collect();
    paths.sort();
    paths
}

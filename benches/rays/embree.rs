//! Embree beside ours: a small C program, compiled at run time into a temporary directory.

use super::sets::Set;
use glam::Vec3;
use lucerna::{Error, ErrorKind, Result};
use std::{path::Path, process::Command};

pub struct Program {
    folder: tempfile::TempDir,
}

/// What Embree took for one set of rays.
#[derive(Clone, Copy, Debug)]
pub struct Taken {
    pub seconds: f64,
    /// Of all processors together.
    pub busy: f64,
    pub hits: usize,
}

impl Program {
    /// Or why it cannot be had.
    pub fn build() -> std::result::Result<Self, String> {
        let folder = tempfile::tempdir().map_err(|e| e.to_string())?;
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/rays/embree.c");
        let program = folder.path().join("embree");
        let arguments = ["-O3", "-march=native", "-o"];
        let out = Command::new("cc")
            .args(arguments)
            .args([&program, &source])
            .args(["-lembree3", "-lpthread", "-lm"])
            .output()
            .map_err(|e| format!("no C compiler `cc`: {e}"))?;
        if !out.status.success() {
            let text = String::from_utf8_lossy(&out.stderr);
            let first = text.lines().find(|l| l.contains("error")).unwrap_or("cc failed").to_owned();
            return Err(format!("{first} (Debian: libembree-dev)"));
        }
        Ok(Self { folder })
    }

    /// For each set: any hit, then closest hit.
    pub fn run(&self, threads: usize, rounds: usize, triangles: &[[Vec3; 3]], sets: &[Set]) -> Result<Vec<[Taken; 2]>> {
        let folder = self.folder.path();
        let io = |e: std::io::Error| Error::new(ErrorKind::Output, format!("cannot write rays for Embree: {e}"));
        let flat: Vec<[f32; 3]> = triangles.iter().flatten().map(|p| p.to_array()).collect();
        std::fs::write(folder.join("triangles"), bytemuck::cast_slice(&flat)).map_err(io)?;
        let mut command = Command::new(folder.join("embree"));
        command.args([threads.to_string(), rounds.to_string()]).arg(folder.join("triangles"));
        for (i, set) in sets.iter().enumerate() {
            let path = folder.join(format!("rays{i}"));
            std::fs::write(&path, bytemuck::cast_slice(&set.rays)).map_err(io)?;
            command.arg(path);
        }
        let out = command.output().map_err(io)?;
        let text = String::from_utf8_lossy(&out.stdout);
        let mut lines = text.lines();
        if let Some(seconds) = lines.next().and_then(|l| l.strip_prefix("build ")) {
            println!("Embree: built in {seconds} s");
        }
        let parse = |line: &str| {
            let numbers: Vec<f64> = line.split_whitespace().filter_map(|w| w.parse().ok()).collect();
            let at = |i: usize| Taken {
                seconds: numbers.get(i).copied().unwrap_or(f64::NAN),
                busy: numbers.get(i + 1).copied().unwrap_or(f64::NAN),
                hits: numbers.get(i + 2).map_or(0, |h| *h as usize),
            };
            [at(0), at(3)]
        };
        let taken: Vec<_> = lines.map(parse).collect();
        if taken.len() != sets.len() {
            return Err(Error::new(ErrorKind::Runtime, format!("Embree's program failed: {:?}", out.status)));
        }
        Ok(taken)
    }
}

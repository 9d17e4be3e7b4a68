//! Running the programs, and what every run must keep: no panic, no escape codes, one line for an error.

#![allow(dead_code)]

use std::{
    ffi::OsStr,
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
};

/// What a program said.
pub struct Ran {
    pub code: i32,
    pub stdout: String,
    pub stderr: String,
}

/// `lucerna` with these arguments.
pub fn lucerna<A: AsRef<OsStr>>(arguments: impl IntoIterator<Item = A>) -> Ran {
    ran(command(env!("CARGO_BIN_EXE_lucerna")).args(arguments))
}

/// `isr` with these arguments.
pub fn isr<A: AsRef<OsStr>>(arguments: impl IntoIterator<Item = A>) -> Ran {
    ran(command(env!("CARGO_BIN_EXE_isr")).args(arguments))
}

pub fn command(program: &str) -> Command {
    let mut command = Command::new(program);
    command.stdin(Stdio::null()).env_remove("RUST_BACKTRACE").env_remove("RUST_LIB_BACKTRACE");
    command
}

pub fn ran(command: &mut Command) -> Ran {
    let Output { status, stdout, stderr } = command.output().expect("the program starts");
    let ran = Ran {
        code: status.code().unwrap_or(-1),
        stdout: String::from_utf8(stdout).expect("stdout is UTF-8"),
        stderr: String::from_utf8(stderr).expect("stderr is UTF-8"),
    };
    assert!(!ran.stderr.contains("internal error") && !ran.stderr.contains("panicked"), "{}", ran.stderr);
    assert!(!ran.stderr.contains('\x1b') && !ran.stdout.contains('\x1b'), "escape codes: {}", ran.stderr);
    ran
}

impl Ran {
    /// Fails unless it ended with `code` and said all of `parts` on stderr.
    #[track_caller]
    pub fn expect(self, code: i32, parts: &[&str]) -> Self {
        assert_eq!(self.code, code, "stdout: {}\nstderr: {}", self.stdout, self.stderr);
        for part in parts {
            assert!(self.stderr.contains(part), "{part:?} is not in: {}", self.stderr);
        }
        self
    }

    /// The one JSON document on stdout.
    #[track_caller]
    pub fn json(&self) -> serde_json::Value {
        serde_json::from_str(&self.stdout).unwrap_or_else(|error| panic!("{error} in: {}", self.stdout))
    }

    /// The lines of stderr that begin with `error: `.
    pub fn errors(&self) -> usize {
        self.stderr.lines().filter(|line| line.starts_with("error: ")).count()
    }
}

/// A file of the project.
pub fn of_project(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path)
}

/// A file of the test assets. Without them: fails if `CI` is set, else says that the test is skipped.
pub fn asset(path: &str) -> Option<PathBuf> {
    let file = Path::new(&std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_else(|| env!("CARGO_MANIFEST_DIR").into()))
        .join("../../shared/assets")
        .join(path);
    if file.exists() {
        return Some(file);
    }
    assert!(std::env::var_os("CI").is_none(), "{} is missing and CI is set", file.display());
    eprintln!("SKIPPED: {} is missing", file.display());
    None
}

/// Whether a device can be used. Without one: fails if `CI` is set, else says that the test is skipped.
pub fn device() -> bool {
    let list = lucerna(["devices", "--json"]);
    let usable = list.code == 0 && list.json().as_array().is_some_and(|all| all.iter().any(|d| d["usable"] == true));
    assert!(usable || std::env::var_os("CI").is_none(), "no Vulkan device and CI is set: {}", list.stderr);
    if !usable {
        eprintln!("SKIPPED: this test needs a device: {}", list.stderr.trim());
    }
    usable
}

/// Names of the files in a folder, sorted.
pub fn files(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("the folder can be read");
    let mut names: Vec<String> =
        entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

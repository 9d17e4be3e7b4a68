//! The source files that can change a picture, a measure, or other data that experiments store. The build script computes their digest; tests
//! use the same list.
//!
//! All files of the engine and of the programs count, except those named here. A new file therefore counts without being named.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use super::digest::Digest;

/// Folders and files, from the root of the repository.
pub const ROOTS: &[&str] =
    &["engine", "shaders-glsl", "samples", "build.rs", "Cargo.toml", "Cargo.lock", "rust-toolchain.toml"];
/// Code that only shows finished pictures.
const PAGES: &[&str] = &["samples/cli/experiment/analysis", "samples/cli/report"];

/// The files, sorted by name. A root that does not exist is skipped.
///
/// # Errors
/// A folder that cannot be read.
pub fn list(root: &Path) -> io::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for name in ROOTS {
        let path = root.join(name);
        if path.is_dir() {
            below(root, &path, &mut found)?;
        } else if path.is_file() {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

fn below(root: &Path, folder: &Path, found: &mut Vec<PathBuf>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if counts(&name(root, &path)) {
            if path.is_dir() {
                below(root, &path, found)?;
            } else {
                found.push(path);
            }
        }
    }
    Ok(())
}

/// The path relative to the root, with slashes.
fn name(root: &Path, path: &Path) -> String {
    path.strip_prefix(root).unwrap_or(path).to_string_lossy().replace('\\', "/")
}

fn counts(name: &str) -> bool {
    let last = name.rsplit('/').next().unwrap_or(name);
    let test = last == "tests" || last.ends_with("tests.rs");
    // Experiments and camera files are inputs of a picture: their contents are part of its key.
    let described = name.starts_with("samples/") && last.ends_with(".toml") && last != "Cargo.toml";
    !test && !described && !last.ends_with(".md") && !last.starts_with('.') && !PAGES.contains(&name)
}

/// Digest of names and contents.
///
/// # Errors
/// A file that cannot be read.
pub fn digest(root: &Path) -> io::Result<String> {
    let mut digest = Digest::default();
    for path in list(root)? {
        let bytes = fs::read(&path)?;
        for part in [name(root, &path).as_bytes(), bytes.as_slice()] {
            digest.add(&(part.len() as u64).to_le_bytes());
            digest.add(part);
        }
    }
    Ok(digest.hex())
}

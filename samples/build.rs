//! Tells the programs which git revision they were built from, for the metadata of pictures, and what the sources are that
//! decide pictures, so that experiments render again what such a source may have changed.

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::Command,
};

fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok().filter(|output| output.status.success())?;
    String::from_utf8(output.stdout).ok().map(|text| text.trim().to_owned()).filter(|text| !text.is_empty())
}

/// Source files below `folder` that can reach a picture or a measure.
fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        let name = entry.file_name().to_string_lossy().into_owned();
        if path.is_dir() && name != "tests" {
            sources(&path, found);
        } else if path.is_file() && !name.ends_with("tests.rs") && !name.ends_with(".md") {
            found.push(path);
        }
    }
}

/// Writes `SOURCES`: each file with FNV-1a of its bytes.
fn list_sources() {
    let (Some(here), Some(out)) = (env::var_os("CARGO_MANIFEST_DIR"), env::var_os("OUT_DIR")) else { return };
    let root = Path::new(&here).join("..");
    let mut found = Vec::new();
    for folder in ["engine", "shaders-glsl", "samples/cli/export_pov"] {
        println!("cargo::rerun-if-changed=../{folder}");
        sources(&root.join(folder), &mut found);
    }
    found.sort();
    let mut text = String::from(
        "/// Source files of the engine, and FNV-1a of 64 bits of each.\nconst SOURCES: &[(&str, u64)] = &[\n",
    );
    for path in found {
        let bytes = fs::read(&path).unwrap_or_default();
        let hash = bytes.iter().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3)
        });
        let name = path.strip_prefix(&root).unwrap_or(&path).to_string_lossy().replace('\\', "/");
        text += &format!("    ({name:?}, {hash:#018x}),\n");
    }
    text += "];\n";
    if let Err(error) = fs::write(Path::new(&out).join("sources.rs"), text) {
        println!("cargo::error=the list of sources cannot be written: {error}");
    }
}

fn main() {
    list_sources();
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-env=LUCERNA_REVISION={}", git(&["rev-parse", "--short=12", "HEAD"]).unwrap_or_default());
    // The log of HEAD grows with every commit and checkout.
    for file in ["HEAD", "logs/HEAD"] {
        if let Some(path) = git(&["rev-parse", "--git-path", file]).filter(|path| Path::new(path).exists()) {
            println!("cargo::rerun-if-changed={path}");
        }
    }
}

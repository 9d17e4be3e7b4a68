//! Tells the programs which git revision they were built from, for the metadata of pictures, and the digest of the sources that
//! decide pictures, so that experiments render again what such a source may have changed.

#[path = "cli/experiment/digest.rs"]
#[allow(dead_code)]
mod digest;
#[path = "cli/experiment/sources.rs"]
mod sources;

use std::{env, path::Path, process::Command};

fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok().filter(|output| output.status.success())?;
    String::from_utf8(output.stdout).ok().map(|text| text.trim().to_owned()).filter(|text| !text.is_empty())
}

fn main() {
    let root = Path::new(&env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default()).join("..");
    // Files, not their folders: a test that leaves a file in a folder for a moment must not build the programs again. A new file is found
    // because a file that exists has to name it.
    match sources::list(&root).and_then(|files| Ok((files, sources::digest(&root)?))) {
        Ok((files, digest)) => {
            for file in files {
                println!("cargo::rerun-if-changed=../{}", file.strip_prefix(&root).unwrap_or(&file).display());
            }
            println!("cargo::rustc-env=LUCERNA_SOURCES={digest}");
        }
        Err(error) => println!("cargo::error=the sources cannot be read: {error}"),
    }
    println!("cargo::rustc-env=LUCERNA_REVISION={}", git(&["rev-parse", "--short=12", "HEAD"]).unwrap_or_default());
    // The log of HEAD grows with every commit and checkout.
    for file in ["HEAD", "logs/HEAD"] {
        if let Some(path) = git(&["rev-parse", "--git-path", file]).filter(|path| Path::new(path).exists()) {
            println!("cargo::rerun-if-changed={path}");
        }
    }
}

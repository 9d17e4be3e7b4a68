//! What integration tests share.

use std::path::PathBuf;

/// The folder of the package. Cargo names it when it starts a test; the one at compile time may be another checkout that shares the build.
#[allow(dead_code)]
pub fn root() -> PathBuf {
    std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_else(|| env!("CARGO_MANIFEST_DIR").into()).into()
}

/// The asset collection; `None` (with a message) where it is not, which only a user's machine may do.
#[allow(dead_code)]
pub fn assets() -> Option<PathBuf> {
    let folder = root().join("../shared/assets");
    if folder.join("manifest.json").is_file() {
        return Some(folder);
    }
    assert!(std::env::var_os("CI").is_none(), "{} is missing", folder.display());
    eprintln!("SKIPPED: {} is missing", folder.display());
    None
}

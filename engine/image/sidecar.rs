//! Metadata beside a file that has no place for it: `NAME.pfm.json`.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::{Metadata, read_file_checked};
use crate::{Error, ErrorKind, Result};

#[derive(Serialize, Deserialize)]
struct SideCar {
    /// FNV-1a hash of the image file's bytes: text that was left by another image of that name must not speak for it.
    image_hash: String,
    metadata: Metadata,
}

pub(super) fn path(image: &Path) -> PathBuf {
    let mut name = image.as_os_str().to_owned();
    name.push(".json");
    name.into()
}

pub(super) fn encode(image: &[u8], metadata: &Metadata) -> Result<String> {
    let sidecar = SideCar { image_hash: hash(image), metadata: metadata.clone() };
    serde_json::to_string_pretty(&sidecar)
        .map_err(|error| Error::new(ErrorKind::Runtime, "metadata cannot be written").caused_by(error))
}

/// The metadata of an image of these bytes; empty when there is no such file.
pub(super) fn read(image: &Path, bytes: &[u8]) -> Result<Metadata> {
    let path = path(image);
    if !path.exists() {
        return Ok(Metadata::default());
    }
    let text = read_file_checked(&path, 1 << 24)?;
    let wrong = |what: &str| Error::input(what).in_file(&path);
    let sidecar: SideCar =
        serde_json::from_slice(&text).map_err(|error| wrong("metadata is not what lucerna writes").caused_by(error))?;
    if sidecar.image_hash != hash(bytes) {
        return Err(
            wrong("belongs to another image than the one beside it").help("Remove it, or write the image again")
        );
    }
    Ok(sidecar.metadata)
}

/// FNV-1a, 64 bits (Fowler, Noll, Vo).
fn hash(bytes: &[u8]) -> String {
    let hash = bytes
        .iter()
        .fold(0xcbf2_9ce4_8422_2325_u64, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3));
    format!("{hash:016x}")
}

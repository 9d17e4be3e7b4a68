//! Text files with a digest of their contents, which detects damage: `{ "digest": …, "holds": … }`. The digest is that of the compact JSON text
//! of `holds`.

use std::path::Path;

use lucerna::{Error, ErrorKind, Result, image};
use serde::{Serialize, de::DeserializeOwned};
use serde_json::{Value, json};

use super::digest::Digest;
use crate::config;

/// Writes a file; overwrites an existing file.
///
/// # Errors
/// `Output` if the file cannot be written.
pub fn write(path: &Path, value: &impl Serialize) -> Result<()> {
    let value = config::to_value(value)?;
    let digest = digest(&value);
    write_bytes(path, format!("{:#}\n", json!({ "digest": digest, "holds": value })).as_bytes())
}

/// Writes a file of a report's folder; overwrites an existing file.
///
/// # Errors
/// `Output` if the file cannot be written, or if its name is a link: the folder may come from an untrusted source.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<()> {
    refuse_link(path)?;
    image::write_atomic(path, bytes, true)
}

/// # Errors
/// `Output` if the name is a link.
pub fn refuse_link(path: &Path) -> Result<()> {
    match path.symlink_metadata().is_ok_and(|metadata| metadata.is_symlink()) {
        true => {
            let error = Error::new(ErrorKind::Output, "is a link, and its target does not belong to the experiment");
            Err(error.in_file(path).help("Remove it"))
        }
        false => Ok(()),
    }
}

/// Reads a file; `None` if it does not exist.
///
/// # Errors
/// `Input`, naming the file, if it is damaged or is not such a file.
pub fn read<T: DeserializeOwned>(path: &Path) -> Result<Option<T>> {
    // A dangling symbolic link exists, but cannot be read.
    if path.symlink_metadata().is_err() {
        return Ok(None);
    }
    let parsed: Result<Value, _> = serde_json::from_str(&config::read_text(path)?);
    let value = match parsed {
        Ok(Value::Object(mut whole)) => match (whole.remove("digest"), whole.remove("holds")) {
            (Some(Value::String(said)), Some(value)) if said == digest(&value) => value,
            _ => return Err(Error::input("is damaged, or was changed").in_file(path)),
        },
        _ => return Err(Error::input("is damaged, or of another program").in_file(path)),
    };
    match serde_json::from_value(value) {
        Ok(value) => Ok(Some(value)),
        Err(error) => Err(Error::input(format!("is of another version: {error}")).in_file(path)),
    }
}

fn digest(value: &Value) -> String {
    Digest::of(value.to_string().as_bytes()).hex()
}

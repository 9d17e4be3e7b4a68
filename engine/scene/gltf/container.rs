//! From the bytes of a .gltf or .glb file to its JSON text and binary chunk.

use crate::{Error, Result};

const MAGIC: &[u8; 4] = b"glTF";
const JSON: u32 = 0x4e4f_534a;
const BIN: u32 = 0x004e_4942;

/// The two parts of a glTF file.
#[derive(Debug)]
pub struct Parts<'a> {
    pub json: &'a str,
    pub bin: Option<&'a [u8]>,
}

/// Whether `bytes` begin like a GLB container.
pub fn is_glb(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC)
}

/// Splits a GLB container, or takes the whole file as JSON.
pub fn split(bytes: &[u8]) -> Result<Parts<'_>> {
    if is_glb(bytes) {
        return split_glb(bytes);
    }
    Ok(Parts { json: text(bytes)?, bin: None })
}

fn split_glb(bytes: &[u8]) -> Result<Parts<'_>> {
    let header = bytes.get(..12).ok_or_else(|| malformed("is shorter than its 12-byte header"))?;
    let version = word(header, 4);
    if version != 2 {
        return Err(Error::input(format!("GLB version {version} is not supported, only 2"))
            .at("header")
            .help("Convert the file to glTF 2.0"));
    }
    let length = word(header, 8) as usize;
    if length > bytes.len() {
        return Err(malformed(&format!("says {length} bytes, the file has {}", bytes.len())).at("header"));
    }
    // Bytes after the stated length do not belong to the container.
    let body = &bytes[..length.max(12)];
    let mut at = 12;
    let mut json = None;
    let mut bin = None;
    let mut number = 0;
    while at < body.len() {
        let place = || format!("chunk {number}");
        let head = body.get(at..at + 8).ok_or_else(|| malformed("ends inside a chunk header").at(place()))?;
        let (size, kind) = (word(head, 0) as usize, word(head, 4));
        let data = body.get(at + 8..).and_then(|rest| rest.get(..size)).ok_or_else(|| {
            malformed(&format!("says {size} bytes, {} are left in the file", body.len() - at - 8)).at(place())
        })?;
        match (number, kind) {
            (0, JSON) => json = Some(data),
            (0, _) => return Err(malformed("must be the JSON chunk").at(place())),
            (1, BIN) => bin = Some(data),
            (_, JSON | BIN) => {
                return Err(malformed("is a second JSON chunk, or a BIN chunk that does not stand second").at(place()));
            }
            // Other chunks are allowed and skipped.
            _ => {}
        }
        at += 8 + size;
        number += 1;
    }
    let json = json.ok_or_else(|| malformed("has no JSON chunk"))?;
    Ok(Parts { json: text(json).map_err(|error| error.at("chunk 0"))?, bin })
}

fn word(bytes: &[u8], at: usize) -> u32 {
    bytes.get(at..at + 4).map_or(0, |b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
}

fn malformed(what: &str) -> Error {
    Error::input(format!("the GLB container {what}")).help("The file is damaged or cut off; export or copy it again")
}

fn text(bytes: &[u8]) -> Result<&str> {
    let text = std::str::from_utf8(bytes).map_err(|error| {
        Error::input(format!("byte {} is not UTF-8", error.valid_up_to())).help("glTF JSON must be UTF-8 text")
    })?;
    Ok(text.strip_prefix('\u{feff}').unwrap_or(text))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn glb(chunks: &[(u32, &[u8])]) -> Vec<u8> {
        let mut out = Vec::new();
        for (kind, data) in chunks {
            out.extend_from_slice(&(data.len() as u32).to_le_bytes());
            out.extend_from_slice(&kind.to_le_bytes());
            out.extend_from_slice(data);
        }
        let length = (out.len() + 12) as u32;
        [MAGIC.as_slice(), &2u32.to_le_bytes(), &length.to_le_bytes(), &out].concat()
    }

    #[test]
    fn chunks_are_found() {
        let file = glb(&[(JSON, b"{}  "), (BIN, &[1, 2, 3, 4]), (7, &[9])]);
        let parts = split(&file).unwrap();
        assert_eq!((parts.json, parts.bin), ("{}  ", Some([1, 2, 3, 4].as_slice())));
    }

    #[test]
    fn every_truncation_is_an_error() {
        let file = glb(&[(JSON, b"{}  "), (BIN, &[1, 2, 3, 4])]);
        for length in 4..file.len() {
            assert!(split(&file[..length]).is_err(), "{length} bytes were accepted");
        }
    }
}

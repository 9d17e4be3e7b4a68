//! Files of glTF in one piece.

use lucerna::{Error, ErrorKind, Result};
use serde_json::Value;

/// The two chunks of a .glb file (glTF 2.0, section 4.4).
///
/// # Errors
/// `Runtime` if the file would be larger than glTF allows (4 GiB).
pub fn glb(document: &Value, mut binary: Vec<u8>) -> Result<Vec<u8>> {
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    binary.resize(binary.len().next_multiple_of(4), 0);
    let chunks = [(text, b"JSON"), (binary, b"BIN\0")];
    let chunks = chunks.iter().filter(|(bytes, _)| !bytes.is_empty());
    let length = 12 + chunks.clone().map(|(bytes, _)| 8 + bytes.len()).sum::<usize>();
    let word = |value: usize| -> Result<[u8; 4]> {
        let what = "the scene is larger than 4 GiB, which glTF does not allow";
        Ok(u32::try_from(value).map_err(|_| Error::new(ErrorKind::Runtime, what))?.to_le_bytes())
    };
    let mut out = Vec::with_capacity(length);
    out.extend(b"glTF");
    out.extend(2u32.to_le_bytes());
    out.extend(word(length)?);
    for (bytes, kind) in chunks {
        out.extend(word(bytes.len())?);
        out.extend(*kind);
        out.extend(bytes);
    }
    Ok(out)
}

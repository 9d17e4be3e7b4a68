//! Files that hold a finished bake: a magic number, a version, a header in JSON, a body, and a digest of all bytes before it.
//!
//! | bytes | content |
//! |---|---|
//! | 8 | magic number |
//! | 4 | version |
//! | 4 | bytes of the header |
//! | … | header: JSON |
//! | … | body |
//! | 32 | BLAKE3 digest of all bytes before |
//!
//! Numbers are little-endian.

use serde::{Serialize, de::DeserializeOwned};

use super::Digest;
use crate::{Error, ErrorKind, Result};

/// Bytes of the digest at the end.
const DIGEST: usize = 32;
/// Bytes before the header.
const FRONT: usize = 16;
/// Largest header that is read, bytes.
const MOST_HEADER: usize = 64 << 20;

/// A kind of files.
#[derive(Clone, Copy, Debug)]
pub struct Container {
    pub magic: [u8; 8],
    pub version: u32,
    /// For messages: `a file of baked daylight`.
    pub name: &'static str,
    /// The command that writes such files: `daylight bake`.
    pub command: &'static str,
}

impl Container {
    /// The bytes of a file.
    ///
    /// # Errors
    /// `Runtime` if the header cannot be written.
    pub fn encode(&self, header: &impl Serialize, body: &[u8]) -> Result<Vec<u8>> {
        let header = serde_json::to_vec(header).map_err(|error| {
            Error::new(ErrorKind::Runtime, "the header of the bake cannot be written").caused_by(error)
        })?;
        let mut out = Vec::with_capacity(FRONT + header.len() + body.len() + DIGEST);
        out.extend_from_slice(&self.magic);
        out.extend_from_slice(&self.version.to_le_bytes());
        out.extend_from_slice(&(header.len() as u32).to_le_bytes());
        out.extend_from_slice(&header);
        out.extend_from_slice(body);
        let digest = Digest::of(&out);
        out.extend_from_slice(&digest.0);
        Ok(out)
    }

    /// The header and the body of a file. `length`: checks the header, and gives the bytes of the body that the header announces; `None`: more than
    /// 64 bits hold.
    ///
    /// # Errors
    /// `Input`, naming the fault; the errors of `length`.
    pub fn decode<'a, H: DeserializeOwned>(
        &self,
        bytes: &'a [u8],
        length: impl FnOnce(&H) -> Result<Option<u64>>,
    ) -> Result<(H, &'a [u8])> {
        if !bytes.starts_with(&self.magic) {
            let error = Error::input(format!("is not {}", self.name));
            return Err(error.help(format!("`{}` writes such files", self.command)));
        }
        let word = |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        let (Some(version), Some(of_header)) = (word(8), word(12)) else {
            return Err(self.damaged(format!("is cut off after {} bytes", bytes.len())));
        };
        if version != self.version {
            return Err(self.damaged(format!("has version {version}; version {} can be read", self.version)));
        }
        let of_header = of_header as usize;
        let header = bytes.get(FRONT..FRONT + of_header.min(MOST_HEADER)).filter(|header| header.len() == of_header);
        let Some(header) = header else {
            let found = bytes.len();
            return Err(self.damaged(format!("is cut off: it has {found} bytes, and its header alone has {of_header}")));
        };
        let header: H = serde_json::from_slice(header)
            .map_err(|error| self.damaged("has a header that cannot be read".into()).caused_by(error))?;
        let body = FRONT + of_header;
        let whole = length(&header)?.and_then(|length| length.checked_add((body + DIGEST) as u64));
        if whole != Some(bytes.len() as u64) {
            let what = whole.map_or("too many bytes".into(), |whole| format!("{whole} bytes"));
            return Err(self.damaged(format!(
                "is cut off or has something after its end: {} bytes, by its header {what}",
                bytes.len()
            )));
        }
        let (covered, digest) = bytes.split_at(bytes.len() - DIGEST);
        if Digest::of(covered).0 != digest {
            return Err(self.damaged("is damaged: its digest does not fit".into()));
        }
        Ok((header, &covered[body..]))
    }

    /// The digest at the end of a file that was decoded.
    pub fn digest(bytes: &[u8]) -> Digest {
        let mut digest = [0; DIGEST];
        digest.copy_from_slice(&bytes[bytes.len() - DIGEST..]);
        Digest(digest)
    }

    /// An error of a file whose contents are wrong.
    pub fn damaged(&self, what: String) -> Error {
        Error::input(what).help(format!("Bake it again with `{}`", self.command))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KIND: Container = Container { magic: *b"lucabc\r\n", version: 3, name: "a file of abc", command: "abc bake" };

    fn decode(bytes: &[u8]) -> Result<(Vec<u32>, &[u8])> {
        KIND.decode(bytes, |header: &Vec<u32>| Ok(header.iter().try_fold(0u64, |sum, n| sum.checked_add((*n).into()))))
    }

    #[test]
    fn files_come_back_and_damage_of_any_byte_is_seen() {
        let bytes = KIND.encode(&vec![2u32, 3], b"abcde").unwrap();
        assert_eq!(decode(&bytes).unwrap(), (vec![2, 3], &b"abcde"[..]));
        assert_eq!(Container::digest(&bytes), Digest::of(&bytes[..bytes.len() - DIGEST]));
        for at in 0..bytes.len() {
            let mut wrong = bytes.clone();
            wrong[at] ^= 1;
            assert_eq!(decode(&wrong).unwrap_err().exit_code(), 3, "byte {at}");
            assert_eq!(decode(&bytes[..at]).unwrap_err().exit_code(), 3, "cut at {at}");
        }
        let said = |bytes: &[u8]| decode(bytes).unwrap_err().to_string();
        assert!(said(b"other").contains("is not a file of abc"));
        let mut newer = bytes.clone();
        newer[8] = 4;
        assert!(said(&newer).contains("has version 4; version 3 can be read"));
        assert!(said(&[&bytes[..], b"x"].concat()).contains("after its end"));
    }
}

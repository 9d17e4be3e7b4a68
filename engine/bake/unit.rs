//! The file of a unit, which holds its result.
//!
//! | bytes | content |
//! |---|---|
//! | 8 | `lucbake\n` |
//! | 4 | version, 1 |
//! | 4 | 0 |
//! | 32 | digest of the job's key |
//! | 4, 4 | stage and number of the unit |
//! | 8 | bytes of the payload |
//! | 32 | digest of the 64 bytes before this one and of the payload |
//! | … | the payload |
//!
//! Numbers have their low byte first.

use std::{
    fs::{self, File},
    io::{self, Read},
    ops::Range,
    path::{Path, PathBuf},
};

use super::{Digest, UnitId};
use crate::{Error, ErrorKind, Result};

const MAGIC: &[u8; 8] = b"lucbake\n";
const VERSION: u32 = 1;
/// Bytes of the header that the digest covers.
const COVERED: usize = 64;
/// Bytes before the payload.
pub const HEADER: usize = COVERED + 32;
/// Bytes of a payload at most.
pub const MOST_BYTES: u64 = 64 << 30;
/// Bytes per read while a file is verified.
const CHUNK: usize = 1 << 20;

/// The whole file of a unit.
///
/// # Errors
/// `Runtime` if the payload is over [`MOST_BYTES`]; `OutOfMemory`.
pub fn encode(key: Digest, unit: UnitId, payload: &[u8]) -> Result<Vec<u8>> {
    if payload.len() as u64 > MOST_BYTES {
        let what = format!("a unit has {} bytes, at most {MOST_BYTES} are allowed", payload.len());
        return Err(Error::new(ErrorKind::Runtime, what));
    }
    let mut out = Vec::new();
    out.try_reserve_exact(HEADER + payload.len())
        .map_err(|error| Error::new(ErrorKind::OutOfMemory, "a unit cannot be held in memory").caused_by(error))?;
    out.extend_from_slice(MAGIC);
    out.extend_from_slice(&VERSION.to_le_bytes());
    out.extend_from_slice(&[0; 4]);
    out.extend_from_slice(&key.0);
    out.extend_from_slice(&unit.stage.to_le_bytes());
    out.extend_from_slice(&unit.index.to_le_bytes());
    out.extend_from_slice(&(payload.len() as u64).to_le_bytes());
    let mut hasher = blake3::Hasher::new();
    hasher.update(&out).update(payload);
    out.extend_from_slice(hasher.finalize().as_bytes());
    out.extend_from_slice(payload);
    Ok(out)
}

/// The open file of a unit. Ranges are read on demand, so that a large file does not have to fit into memory. Memory maps would do the same,
/// but they need `unsafe`, and their behaviour is undefined if the file is truncated while it is mapped.
#[derive(Debug)]
pub struct Payload {
    path: PathBuf,
    file: File,
    length: u64,
    covered: [u8; COVERED],
    digest: [u8; 32],
}

impl Payload {
    /// Opens a file and looks at its header and its length. The payload's bytes are not looked at: [`Self::verify`].
    ///
    /// # Errors
    /// `Input`, naming the file, if it is damaged, cut off, or of another job or unit.
    pub fn open(path: &Path, key: Digest, unit: UnitId) -> Result<Self> {
        Self::opened(path, key, unit).map_err(|error| error.in_file(path))
    }

    fn opened(path: &Path, key: Digest, unit: UnitId) -> Result<Self> {
        let cannot = |error: io::Error| Error::input("cannot be read").caused_by(error);
        // Before it is opened, because opening a pipe waits.
        let regular = |metadata: fs::Metadata| match metadata.is_file() {
            true => Ok(metadata.len()),
            false => Err(Error::input("is no regular file")),
        };
        regular(fs::metadata(path).map_err(cannot)?)?;
        let file = File::open(path).map_err(cannot)?;
        let size = regular(file.metadata().map_err(cannot)?)?;
        let mut header = [0; HEADER];
        if size < HEADER as u64 {
            return Err(Error::input(format!("is cut off: {size} bytes, the header alone has {HEADER}")));
        }
        (&file).read_exact(&mut header).map_err(cannot)?;
        let (mut covered, mut digest) = ([0; COVERED], [0; 32]);
        covered.copy_from_slice(&header[..COVERED]);
        digest.copy_from_slice(&header[COVERED..]);
        let word = |at: usize| u32::from_le_bytes([covered[at], covered[at + 1], covered[at + 2], covered[at + 3]]);
        if !covered.starts_with(MAGIC) {
            return Err(Error::input("is no file of a unit"));
        }
        if word(8) != VERSION {
            return Err(Error::input(format!("has version {}, version {VERSION} can be read", word(8))));
        }
        if covered[16..48] != key.0 {
            return Err(Error::input("belongs to another job"));
        }
        let of = UnitId { stage: word(48), index: word(52) };
        if of != unit {
            let what = format!("is unit {} of stage {}, not {} of {}", of.index, of.stage, unit.index, unit.stage);
            return Err(Error::input(what));
        }
        let length = u64::from(word(60)) << 32 | u64::from(word(56));
        if length > MOST_BYTES {
            return Err(Error::input(format!("says it has {length} bytes, at most {MOST_BYTES} are allowed")));
        }
        let whole = HEADER as u64 + length;
        if size != whole {
            let what = if size < whole { "is cut off" } else { "has something after its end" };
            return Err(Error::input(format!("{what}: {size} bytes, by its header {whole}")));
        }
        Ok(Self { path: path.to_owned(), file, length, covered, digest })
    }

    /// Goes through all bytes.
    ///
    /// # Errors
    /// `Input`, naming the file, if they are not those that were written.
    pub fn verify(&self) -> Result<()> {
        let mut hasher = blake3::Hasher::new();
        hasher.update(&self.covered);
        let mut chunk = vec![0; CHUNK.min(self.length as usize)];
        let mut at = 0;
        while at < self.length {
            let size = (self.length - at).min(CHUNK as u64) as usize;
            self.read_exact_at(&mut chunk[..size], at)?;
            hasher.update(&chunk[..size]);
            at += size as u64;
        }
        match *hasher.finalize().as_bytes() == self.digest {
            true => Ok(()),
            false => Err(Error::input("is damaged: its digest does not fit").in_file(&self.path)),
        }
    }

    /// Bytes of the payload.
    pub fn len(&self) -> u64 {
        self.length
    }

    pub fn is_empty(&self) -> bool {
        self.length == 0
    }

    /// Some bytes of the payload.
    ///
    /// # Errors
    /// `Input`, naming the file, if it has no such bytes or cannot be read; `OutOfMemory`.
    pub fn read(&self, range: Range<u64>) -> Result<Vec<u8>> {
        if range.start > range.end || range.end > self.length {
            let what = format!("has no bytes {} to {}, but {}", range.start, range.end, self.length);
            return Err(Error::input(what).in_file(&self.path));
        }
        let size = usize::try_from(range.end - range.start).unwrap_or(usize::MAX);
        let mut out = Vec::new();
        out.try_reserve_exact(size).map_err(|error| {
            Error::new(ErrorKind::OutOfMemory, format!("{size} bytes cannot be held in memory"))
                .in_file(&self.path)
                .caused_by(error)
        })?;
        out.resize(size, 0);
        self.read_exact_at(&mut out, range.start)?;
        Ok(out)
    }

    /// All bytes of the payload.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn bytes(&self) -> Result<Vec<u8>> {
        self.read(0..self.length)
    }

    fn read_exact_at(&self, out: &mut [u8], at: u64) -> Result<()> {
        read_exact_at(&self.file, out, HEADER as u64 + at)
            .map_err(|error| Error::input("cannot be read").in_file(&self.path).caused_by(error))
    }
}

#[cfg(unix)]
fn read_exact_at(file: &File, out: &mut [u8], at: u64) -> io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, out, at)
}

#[cfg(windows)]
fn read_exact_at(file: &File, mut out: &mut [u8], mut at: u64) -> io::Result<()> {
    while !out.is_empty() {
        match std::os::windows::fs::FileExt::seek_read(file, out, at)? {
            0 => return Err(io::ErrorKind::UnexpectedEof.into()),
            read => (out, at) = (&mut out[read..], at + read as u64),
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: UnitId = UnitId { stage: 1, index: 7 };

    fn opened(bytes: &[u8]) -> Result<Payload> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.unit");
        fs::write(&path, bytes).unwrap();
        let payload = Payload::open(&path, Digest::of(b"key"), UNIT)?;
        payload.verify()?;
        Ok(payload)
    }

    #[test]
    fn what_is_written_is_read_in_any_ranges() {
        let data: Vec<u8> = (0..3 * CHUNK / 2).map(|i| (i % 251) as u8).collect();
        let payload = opened(&encode(Digest::of(b"key"), UNIT, &data).unwrap()).unwrap();
        assert_eq!((payload.len(), payload.is_empty()), (data.len() as u64, false));
        assert!(payload.bytes().unwrap() == data);
        assert_eq!(payload.read(5..9).unwrap(), data[5..9]);
        assert!(payload.read(3..3).unwrap().is_empty());
        let end = payload.len();
        for (start, end) in [(0, end + 1), (end + 1, end + 1), (u64::MAX - 1, u64::MAX), (5, 4)] {
            let error = payload.read(start..end).unwrap_err().to_string();
            assert!(error.contains("has no bytes"), "{error}");
        }
        assert!(opened(&encode(Digest::of(b"key"), UNIT, &[]).unwrap()).unwrap().is_empty());
    }

    #[test]
    fn damage_of_any_kind_is_refused_with_a_reason() {
        let bytes = encode(Digest::of(b"key"), UNIT, b"some bytes").unwrap();
        let refused = |bytes: &[u8], part: &str| {
            let error = opened(bytes).unwrap_err();
            assert!(error.exit_code() == 3 && error.to_string().contains(part), "{error} without {part:?}");
        };
        (0..bytes.len()).for_each(|length| refused(&bytes[..length], "is cut off"));
        for at in 0..bytes.len() {
            let mut wrong = bytes.clone();
            wrong[at] ^= 16;
            let part = match at {
                0..8 => "no file of a unit",
                8..12 => "has version",
                12..16 => "is damaged",
                16..48 => "belongs to another job",
                48..56 => "is unit",
                56..64 => "by",
                _ => "is damaged",
            };
            refused(&wrong, part);
        }
        refused(&[&bytes[..], &[0]].concat(), "after its end");
        // A length that nothing can hold is refused before anything is made ready for it.
        let mut huge = bytes.clone();
        huge[56..64].copy_from_slice(&u64::MAX.to_le_bytes());
        refused(&huge, "at most");
        huge[56..64].copy_from_slice(&MOST_BYTES.to_le_bytes());
        refused(&huge, "is cut off");
        refused(
            &encode(Digest::of(b"key"), UnitId { stage: 1, index: 8 }, b"").unwrap(),
            "is unit 8 of stage 1, not 7 of 1",
        );
        refused(&encode(Digest::of(b"other"), UNIT, b"").unwrap(), "another job");
    }

    #[test]
    fn folders_are_no_units() {
        let folder = tempfile::tempdir().unwrap();
        let error = Payload::open(folder.path(), Digest::of(b""), UNIT).unwrap_err().to_string();
        assert!(error.contains("is no regular file"), "{error}");
    }
}

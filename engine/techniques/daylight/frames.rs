//! Files of uncompressed frames: `.frames`, the paper's way. Every lit step of the day has the light of all texels as 16-bit floats, so that a
//! program may read one step after the other while time goes on.
//!
//! | bytes | content |
//! |---|---|
//! | 8 | `lucfrm\r\n` |
//! | 4 | version, 1 |
//! | 4 | number of steps |
//! | 8 | texels on surfaces |
//! | 32 | digest of the bake from which the frames were made |
//! | 8 | bytes of the next part |
//! | … | the same bake without the images of the sun's light, as a whole `.day` file |
//! | 32 | BLAKE3 digest of all bytes before: the identity of the file |
//! | … | the steps, each: its number (4), the light (6 for each texel, tile after tile, filled up to 4), a digest (32) |
//!
//! The digest of a step covers the identity, the number and the light, so a step of another file is not taken for one of this. The light is
//! irradiance after at least one scattering for 1 W/m² of the sun, in W/m²: red, green, blue. Numbers are little-endian.

use std::{
    fs::File,
    io::{Read, Seek, SeekFrom},
    path::{Path, PathBuf},
};

use half::f16;

use super::{Stored, blocks::Blocks, layer::Layer, units::Tile};
use crate::{Error, ErrorKind, Result, bake::Digest, image};

pub(super) const MAGIC: &[u8; 8] = b"lucfrm\r\n";
const VERSION: u32 = 1;
/// Bytes before the bake.
const HEAD: u64 = 64;
const DIGEST: u64 = 32;
/// Largest bake inside that is read, bytes.
const MOST_BAKE: u64 = 4 << 30;

/// Steps in memory while frames are streamed, unless another number is asked for.
pub const DEFAULT_RING: usize = 8;
/// A picture needs up to four steps at once.
pub const LEAST_RING: usize = 4;

/// An open file of frames.
#[derive(Debug)]
pub struct Frames {
    path: PathBuf,
    /// Digest of the bake from which the frames were made.
    pub source: Digest,
    identity: Digest,
    pub steps: u32,
    pub texels: u64,
    /// Byte of the first step.
    first: u64,
}

/// Bytes of the light of a step.
pub fn step_bytes(texels: u64) -> u64 {
    (6 * texels).next_multiple_of(4)
}

/// Bytes of a step in the file.
fn record_bytes(texels: u64) -> u64 {
    4 + step_bytes(texels) + DIGEST
}

fn of_step(identity: &Digest, record: &[u8]) -> Digest {
    Digest::of(&[&identity.0, record].concat())
}

/// The bake without the images of the sun's light.
fn still(stored: &Stored) -> Stored {
    let mut still = stored.clone();
    for Tile { sun, .. } in &mut still.tiles {
        let blocks = sun.blocks.as_ref().map(|_| Blocks::default());
        *sun = Layer { wide: 0, narrow: 0, table: Vec::new(), words: Vec::new(), blocks, ..sun.clone() };
    }
    still
}

/// The light of a step, as in the file.
pub fn frame(stored: &Stored, step: usize) -> Vec<u8> {
    let texels: u64 = stored.tiles.iter().map(|tile| u64::from(tile.there())).sum();
    let mut out = Vec::with_capacity(step_bytes(texels) as usize);
    for tile in &stored.tiles {
        let coefficients = tile.sun.mix([(step, [1.0; 3])].into_iter());
        for texel in 0..tile.there() as usize {
            for value in tile.sun.decode(texel, &coefficients) {
                out.extend_from_slice(&f16::from_f32(value).to_le_bytes());
            }
        }
    }
    out.resize(step_bytes(texels) as usize, 0);
    out
}

/// Decodes every step of a bake and writes the frames. `digest`: of the bake's file. `told` gets the number of finished steps and returns
/// whether to go on. Returns the bytes of the file.
///
/// # Errors
/// `Output` if the file cannot be written; `Usage` if the bake has no lit steps; `Interrupted` if `told` stopped it.
pub fn write(
    path: &Path,
    stored: &Stored,
    digest: Digest,
    overwrite: bool,
    mut told: impl FnMut(u64) -> bool,
) -> Result<u64> {
    let steps = stored.plan.times.len();
    if steps == 0 {
        return Err(
            Error::usage("the bake has no lit steps, so there are no frames").help("Bake a day on which the sun rises")
        );
    }
    let texels: u64 = stored.tiles.iter().map(|tile| u64::from(tile.there())).sum();
    if texels == 0 {
        let error = Error::usage("the bake has no texels on surfaces, so there are no frames");
        return Err(error.help("Bake a view that sees surfaces"));
    }
    let bake = still(stored).encode()?;
    let mut head = Vec::new();
    head.extend_from_slice(MAGIC);
    head.extend_from_slice(&VERSION.to_le_bytes());
    head.extend_from_slice(&(steps as u32).to_le_bytes());
    head.extend_from_slice(&texels.to_le_bytes());
    head.extend_from_slice(&digest.0);
    head.extend_from_slice(&(bake.len() as u64).to_le_bytes());
    head.extend_from_slice(&bake);
    let identity = Digest::of(&head);
    head.extend_from_slice(&identity.0);
    let bytes = head.len() as u64 + steps as u64 * record_bytes(texels);
    let records = (0..steps).map(|step| {
        let mut record = (step as u32).to_le_bytes().to_vec();
        record.extend_from_slice(&frame(stored, step));
        let digest = of_step(&identity, &record);
        record.extend_from_slice(&digest.0);
        match told(step as u64 + 1) {
            true => Ok(record),
            false => Err(Error::new(ErrorKind::Interrupted, "writing frames was stopped")),
        }
    });
    image::write_pieces_atomic(path, bytes, std::iter::once(Ok(head)).chain(records), overwrite)?;
    Ok(bytes)
}

impl Frames {
    /// Opens a file and reads all but its steps.
    ///
    /// # Errors
    /// `Input`, naming the file and saying what is wrong.
    pub fn open(path: &Path) -> Result<(Self, Stored)> {
        Self::opened(path).map_err(|error| error.in_file(path))
    }

    fn opened(path: &Path) -> Result<(Self, Stored)> {
        let damaged = |what: String| Error::input(what).help("Make it again with `daylight frames`");
        let head = image::read_head_checked(path, HEAD)?;
        if !head.starts_with(MAGIC) {
            return Err(Error::input("is not a file of frames").help("`daylight frames` writes such files"));
        }
        if head.len() < HEAD as usize {
            return Err(damaged(format!("is cut off after {} bytes", head.len())));
        }
        let word = |at: usize| u32::from_le_bytes([head[at], head[at + 1], head[at + 2], head[at + 3]]);
        let long = |at: usize| u64::from(word(at)) | u64::from(word(at + 4)) << 32;
        if word(8) != VERSION {
            return Err(damaged(format!("has version {}; version {VERSION} can be read", word(8))));
        }
        let (steps, texels, length) = (word(12), long(16), long(56));
        let mut source = Digest([0; 32]);
        source.0.copy_from_slice(&head[24..56]);
        let unreadable = |error: std::io::Error| Error::input("cannot be read").caused_by(error);
        let found = std::fs::metadata(path).map_err(unreadable)?.len();
        let first = HEAD.saturating_add(length).saturating_add(DIGEST);
        let record = texels.checked_mul(6).and_then(|light| light.checked_add(64)).map(|_| record_bytes(texels));
        let whole = record.and_then(|record| record.checked_mul(steps.into())).and_then(|all| all.checked_add(first));
        if length > MOST_BAKE || whole != Some(found) {
            let what = whole.map_or("too many bytes".into(), |whole| format!("{whole} bytes"));
            return Err(damaged(format!(
                "is cut off or has something after its end: {found} bytes, by its header {what}"
            )));
        }
        let start = image::read_head_checked(path, first)?;
        let (covered, identity) = start.split_at(start.len().saturating_sub(DIGEST as usize));
        let identity = Digest::of(covered).0 == identity;
        if !identity || covered.len() < HEAD as usize {
            return Err(damaged("is damaged: the digest of its header does not fit".into()));
        }
        let identity = Digest::of(covered);
        let stored = Stored::decode(&covered[HEAD as usize..])?;
        let there: u64 = stored.tiles.iter().map(|tile| u64::from(tile.there())).sum();
        if there != texels || stored.plan.times.len() != steps as usize {
            let (lit, all) = (stored.plan.times.len(), there);
            return Err(damaged(format!("has {steps} steps of {texels} texels; its bake has {lit} of {all}")));
        }
        Ok((Self { path: path.to_owned(), source, identity, steps, texels, first }, stored))
    }

    /// The digest by which the file is told from others.
    pub fn digest(&self) -> Digest {
        self.identity
    }

    /// Bytes of a step in memory.
    pub fn step_bytes(&self) -> u64 {
        step_bytes(self.texels)
    }

    /// Opens the file for reading steps.
    ///
    /// # Errors
    /// `Input` if the file cannot be opened.
    pub fn reader(&self) -> Result<File> {
        File::open(&self.path).map_err(|error| Error::input("cannot be read").caused_by(error).in_file(&self.path))
    }

    /// Reads the light of a step.
    ///
    /// # Errors
    /// `Input`, naming the file and the step, if the step is cut off, damaged or of another file; `OutOfMemory`.
    pub fn read(&self, file: &mut File, step: usize) -> Result<Vec<u8>> {
        let wrong = |what: &str| {
            let error = Error::input(what).at(format!("step {step}")).in_file(&self.path);
            error.help("Do not change the file while it is streamed; make it again with `daylight frames`")
        };
        let length = record_bytes(self.texels);
        let mut record = Vec::new();
        record
            .try_reserve_exact(length as usize)
            .map_err(|error| Error::new(ErrorKind::OutOfMemory, "a frame cannot be held in memory").caused_by(error))?;
        file.seek(SeekFrom::Start(self.first + step as u64 * length))
            .and_then(|_| file.take(length).read_to_end(&mut record))
            .map_err(|error| wrong("cannot be read").caused_by(error))?;
        if (record.len() as u64) < length {
            return Err(wrong("is cut off"));
        }
        let (covered, digest) = record.split_at(record.len() - DIGEST as usize);
        if of_step(&self.identity, covered).0 != digest || covered[..4] != (step as u32).to_le_bytes() {
            return Err(wrong("is damaged, or the file was replaced"));
        }
        record.truncate(record.len() - DIGEST as usize);
        record.drain(..4);
        Ok(record)
    }
}

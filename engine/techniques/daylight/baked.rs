//! The bake of a picture: compressed (`.day`), or all steps of the day as frames (`.frames`).

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use super::{Frames, Stored, frames};
use crate::{Error, Result, bake::Digest, image, technique};

/// A bake, and the file from which it was read.
#[derive(Clone, Debug)]
pub struct Baked {
    /// With frames: all but the light of the sun.
    pub stored: Arc<Stored>,
    /// The light of the sun as frames.
    pub frames: Option<Arc<Frames>>,
    /// Frames are read while pictures need them, and so many are in memory; `None`: all frames are read before the first picture.
    pub stream: Option<usize>,
    /// Errors name this file.
    pub file: Option<PathBuf>,
    /// Of the file.
    pub digest: Option<Digest>,
}

impl Baked {
    /// A bake that no file holds.
    pub fn new(stored: Stored) -> Self {
        Self { stored: Arc::new(stored), frames: None, stream: None, file: None, digest: None }
    }

    /// The error with the name of the file.
    pub(super) fn blamed(&self, error: Error) -> Error {
        match &self.file {
            Some(file) => error.in_file(file),
            None => error,
        }
    }
}

impl technique::Bake for Baked {
    const NEEDED: bool = true;

    /// Frames are streamed.
    fn read(file: &Path) -> Result<Self> {
        let head = image::read_head_checked(file, frames::MAGIC.len() as u64)?;
        if head == frames::MAGIC {
            let (frames, stored) = Frames::open(file)?;
            let digest = Some(frames.digest());
            return Ok(Self {
                stored: Arc::new(stored),
                frames: Some(Arc::new(frames)),
                stream: Some(frames::DEFAULT_RING),
                file: Some(file.to_owned()),
                digest,
            });
        }
        let (stored, digest) = Stored::read_with_digest(file)?;
        let baked = Self::new(stored);
        Ok(Self { file: Some(file.to_owned()), digest: Some(digest), ..baked })
    }

    fn source(&self) -> Option<(&Path, Digest)> {
        Some((self.file.as_deref()?, self.digest?))
    }
}

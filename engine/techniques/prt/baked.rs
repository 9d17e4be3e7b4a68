//! The bake of a picture.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use super::Stored;
use crate::{Error, Result, bake::Digest, scene::Scene, technique};

/// A bake, and the file from which it was read.
#[derive(Clone, Debug)]
pub struct Baked {
    pub stored: Arc<Stored>,
    /// Errors name this file.
    pub file: Option<PathBuf>,
    /// Of the file.
    pub digest: Option<Digest>,
}

impl Baked {
    /// A bake that no file holds.
    pub fn new(stored: Stored) -> Self {
        Self { stored: Arc::new(stored), file: None, digest: None }
    }

    /// Refuses scenes that are not the one of the bake.
    ///
    /// # Errors
    /// `Input`, naming the file and the part of the scene that differs.
    pub fn expect_scene(&self, scene: &Scene) -> Result<()> {
        let Some(parts) = self.stored.plan.difference(scene) else { return Ok(()) };
        let what = format!("is the room `{}`, and this scene has other {parts}", self.stored.plan.scene);
        Err(self.blamed(Error::input(what).help("Name the scene that was baked, or bake this one")))
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

    fn read(file: &Path) -> Result<Self> {
        let (stored, digest) = Stored::read(file)?;
        Ok(Self { file: Some(file.to_owned()), digest: Some(digest), ..Self::new(stored) })
    }

    fn source(&self) -> Option<(&Path, Digest)> {
        Some((self.file.as_deref()?, self.digest?))
    }
}

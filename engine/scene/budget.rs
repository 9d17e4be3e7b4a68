//! Bounds the memory that a scene may take by the bytes that were really read for it.
//!
//! A file of a hundred bytes can ask for a billion vertices (an accessor without data is all zero), or refer to one
//! accessor ten thousand times. Genuine files decode to a few times their size; what asks for much more is refused
//! before it is allocated.

use super::Limits;
use crate::{Error, Result};
use std::cell::Cell;

/// Decoded bytes that every scene may take, however small its files.
const BASE: u64 = 192 << 20;
/// Decoded bytes per byte read. Vertices quantised to 8 bits and compressed to a quarter, then split for flat shading,
/// stay below this.
const FACTOR: u64 = 48;

/// Texels that every scene may have, however small its files: half a GiB of RGBA.
const BASE_TEXELS: u64 = 1 << 27;
/// Texels per byte read. JPEG needs a byte for 5 to 20 texels; what is more is mostly one colour.
const TEXEL_FACTOR: u64 = 64;
/// Texels of one texture, 8192². Larger ones go past what devices must support, and small files can ask for them.
const MAX_TEXTURE: u64 = 1 << 26;

/// Counts decoded bytes, vertices and indices against what is allowed.
#[derive(Debug)]
pub struct Budget {
    allowed: Cell<u64>,
    ceiling: u64,
    used: Cell<u64>,
    vertices: Cell<u64>,
    indices: Cell<u64>,
    max_vertices: u64,
    texels: Cell<u64>,
    allowed_texels: Cell<u64>,
    max_texels: u64,
    max_texture: u64,
}

impl Budget {
    pub fn new(limits: &Limits) -> Self {
        let ceiling = limits.max_alloc.saturating_mul(8);
        Self {
            allowed: Cell::new(BASE.min(ceiling)),
            ceiling,
            used: Cell::new(0),
            vertices: Cell::new(0),
            indices: Cell::new(0),
            max_vertices: limits.max_vertices,
            texels: Cell::new(0),
            allowed_texels: Cell::new(BASE_TEXELS.min(limits.max_alloc)),
            max_texels: limits.max_alloc,
            max_texture: limits.max_image_pixels.min(MAX_TEXTURE),
        }
    }

    /// Bytes were read from a file: more may be decoded.
    pub fn read(&self, bytes: usize) {
        let allowed = self.allowed.get().saturating_add((bytes as u64).saturating_mul(FACTOR));
        self.allowed.set(allowed.min(self.ceiling));
        let texels = self.allowed_texels.get().saturating_add((bytes as u64).saturating_mul(TEXEL_FACTOR));
        self.allowed_texels.set(texels.min(self.max_texels));
    }

    /// `count` elements of `size` bytes are about to be allocated.
    pub fn take(&self, count: u64, size: u64) -> Result<()> {
        self.used.set(self.could_take(count, size)?);
        Ok(())
    }

    /// Checks that so much is left, without taking it. Gives what would be used in all.
    pub fn could_take(&self, count: u64, size: u64) -> Result<u64> {
        let used = count.checked_mul(size).and_then(|bytes| bytes.checked_add(self.used.get())).unwrap_or(u64::MAX);
        if used > self.allowed.get() {
            return Err(Error::input(format!(
                "{count} elements of {size} bytes bring the scene to {} MiB decoded, more than the {} MiB allowed for \
                 the bytes it is read from",
                used >> 20,
                self.allowed.get() >> 20
            )));
        }
        Ok(used)
    }

    /// A primitive of this size is about to be built.
    pub fn primitive(&self, vertices: u64, indices: u64) -> Result<()> {
        for (counter, more, what) in [(&self.vertices, vertices, "vertices"), (&self.indices, indices, "indices")] {
            let total = counter.get().saturating_add(more);
            if total > self.max_vertices {
                return Err(Error::input(format!("the scene has over {} {what}", self.max_vertices)));
            }
            counter.set(total);
        }
        Ok(())
    }

    /// Texels that the next texture may have.
    pub fn texels_left(&self) -> u64 {
        self.allowed_texels.get().saturating_sub(self.texels.get()).min(self.max_texture)
    }

    /// A texture of this many texels was decoded.
    pub fn texture(&self, texels: u64) -> Result<()> {
        if texels > self.texels_left() {
            let allowed = self.texels_left();
            return Err(Error::input(format!("the texture has {texels} texels, {allowed} more are allowed")));
        }
        self.texels.set(self.texels.get() + texels);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_files_cannot_ask_for_much_and_large_ones_can() {
        let budget = Budget::new(&Limits::default());
        assert!(budget.take(4_000_000_000, 12).is_err());
        assert!(budget.take(u64::MAX, u64::MAX).is_err());
        assert!(budget.take(1_000_000, 12).is_ok());
        assert!(budget.take(30_000_000, 12).is_err());
        budget.read(30_000_000);
        assert!(budget.take(30_000_000, 12).is_ok());
    }
}

//! The tiles of a bake as shaders read them (`tiles.glsl`).

use super::{layer::Layer, units::Tile};
use crate::{Error, ErrorKind, Result, gpu::Gpu, shaders::types};

/// Tiles with their number of columns, and their words, as the device reads them.
pub(super) fn packed<'a>(list: impl Iterator<Item = (&'a Tile, u32)>) -> (Vec<types::DayTile>, Vec<u32>) {
    let (mut tiles, mut words, mut first) = (Vec::new(), Vec::new(), 0);
    for (tile, columns) in list {
        let mut entry = types::DayTile {
            mask: words.len() as u32,
            mask_words: tile.mask.len() as u32,
            columns,
            ..types::DayTile::default()
        };
        words.extend_from_slice(&tile.mask);
        let mut before = 0;
        for word in &tile.mask {
            words.push(before);
            before += word.count_ones();
        }
        for (which, layer) in tile.layers().into_iter().enumerate() {
            let Layer { wide, narrow, .. } = *layer;
            entry.first_word[which] = words.len() as u32;
            (entry.wide[which], entry.narrow[which], entry.first[which]) = (wide, narrow, first);
            words.extend_from_slice(&layer.words);
            first += layer.images();
        }
        tiles.push(entry);
    }
    words.push(0);
    (tiles, words)
}

/// Coefficients of the images of all tiles, in their order. `weights`: of the baked times; `sun`: its colour; `patches`: radiance of the sky;
/// `lamps`: how bright each group of lamps is.
pub(super) fn coefficients<'a>(
    tiles: impl Iterator<Item = &'a Tile>,
    weights: &[(usize, f32)],
    sun: [f32; 3],
    patches: &[[f32; 3]],
    lamps: &[[f32; 3]],
) -> Vec<[f32; 3]> {
    let of_sun = |(time, weight): &(usize, f32)| (*time, sun.map(|channel| channel * weight));
    let mut out = Vec::new();
    for tile in tiles {
        out.extend(tile.sun.mix(weights.iter().map(of_sun)));
        out.extend(tile.sky.mix(patches.iter().copied().enumerate()));
        out.extend(tile.lamps.mix(lamps.iter().copied().enumerate()));
    }
    out.push([0.0; 3]);
    out
}

/// Checks that the images of a bake fit into one buffer.
///
/// # Errors
/// `Runtime` with both sizes.
pub(super) fn fits(gpu: &Gpu, words: &[u32]) -> Result<()> {
    let most = gpu.caps().limits.storage_range;
    let bytes = 4 * words.len() as u64;
    if bytes <= most {
        return Ok(());
    }
    Err(Error::new(
        ErrorKind::Runtime,
        format!("its images have {bytes} bytes, the device allows {most} in one buffer"),
    ))
}

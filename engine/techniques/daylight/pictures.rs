//! The tiles of a bake as shaders read them (`tiles.glsl`).

use super::{blocks::Blocks, layer::Layer, units::Tile};
use crate::{Error, ErrorKind, Result, gpu::Gpu, shaders::types};

/// Tiles with their number of columns, and their words, as the device reads them.
pub(super) fn packed<'a>(list: impl Iterator<Item = (&'a Tile, u32)>) -> (Vec<types::DayTile>, Vec<u32>) {
    let (mut tiles, mut words, mut first, mut texels) = (Vec::new(), Vec::new(), 0, 0);
    // Images in blocks lie on pages ([`super::pages`]).
    let mut slots = [0, 0];
    for (tile, columns) in list {
        let mut entry = types::DayTile {
            mask: words.len() as u32,
            mask_words: tile.mask.len() as u32,
            columns,
            first_texel: texels,
            ..types::DayTile::default()
        };
        words.extend_from_slice(&tile.mask);
        let mut before = 0;
        for word in &tile.mask {
            words.push(before);
            before += word.count_ones();
        }
        texels += before;
        for (which, layer) in tile.layers().into_iter().enumerate() {
            let Layer { wide, narrow, .. } = *layer;
            entry.first_word[which] = words.len() as u32;
            (entry.wide[which], entry.narrow[which], entry.first[which]) = (wide, narrow, first);
            words.extend_from_slice(&layer.words);
            let in_blocks = layer.blocks.as_ref().map_or([0, 0], |Blocks { hdr, pairs, .. }| [*hdr, *pairs]);
            [entry.hdr[which], entry.pairs[which]] = in_blocks;
            [entry.first_hdr[which], entry.first_pair[which]] = slots;
            slots = [slots[0] + in_blocks[0], slots[1] + in_blocks[1]];
            first += layer.images();
        }
        tiles.push(entry);
    }
    words.push(0);
    (tiles, words)
}

/// The light of a moment.
pub(super) struct Sources<'a> {
    /// Irradiance of the sun, W/m².
    pub sun: [f32; 3],
    /// Radiance of the patches of the sky, W/(sr m²).
    pub patches: &'a [[f32; 3]],
    /// How bright each group of lamps is.
    pub lamps: &'a [[f32; 3]],
}

/// Coefficients of the images of all tiles, in their order, for one mixture of the baked times after the other.
pub(super) fn coefficients<'a>(
    tiles: impl IntoIterator<Item = &'a Tile> + Clone,
    mixtures: &[Vec<(usize, f32)>],
    light: &Sources<'_>,
) -> Vec<[f32; 3]> {
    let of_sun = |(time, weight): &(usize, f32)| (*time, light.sun.map(|channel| channel * weight));
    let mut out = Vec::new();
    for mixture in mixtures {
        for tile in tiles.clone() {
            out.extend(tile.sun.mix(mixture.iter().map(of_sun)));
            out.extend(tile.sky.mix(light.patches.iter().copied().enumerate()));
            out.extend(tile.lamps.mix(light.lamps.iter().copied().enumerate()));
        }
    }
    out.push([0.0; 3]);
    out
}

/// Checks that the images of a bake fit into one buffer.
///
/// # Errors
/// `Runtime` with both sizes.
pub(super) fn fits(gpu: &Gpu, bytes: u64) -> Result<()> {
    let most = gpu.caps().limits.storage_range;
    if bytes <= most {
        return Ok(());
    }
    Err(Error::new(
        ErrorKind::Runtime,
        format!("its images have {bytes} bytes, the device allows {most} in one buffer"),
    ))
}

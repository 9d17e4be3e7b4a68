//! Images of a tile in blocks of 4×4 texels, as devices sample them: BC6H with signs (8 bits a texel), or BC5 with signs for red and green and BC4
//! with signs for blue (12 bits a texel). Values of images have both signs, so the forms without signs cannot hold them.
//!
//! No crate was found that encodes these forms: `intel_tex_2`, `block_compression` and `texpresso` have the forms without signs alone. The encoders are
//! `encode_bc6h` and `encode_bc4` of [`crate::image`]; tests decode them with the crate `bcdec_rs`.

use half::f16;
use serde::{Deserialize, Serialize};

use crate::{
    Error, Result,
    image::{decode_bc4, decode_bc6h, encode_bc4, encode_bc6h},
    settings::JsonSchema,
};

/// Texels along a side of a block.
pub const SIDE: u32 = 4;
const TEXELS: usize = (SIDE * SIDE) as usize;

/// The values that images of a bake have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Texels {
    /// 16-bit floats, and 8 bits where these are enough.
    #[default]
    Plain,
    /// BC5 and BC4 with signs, 12 bits a texel, where they are good enough; else as `plain`.
    Bc5,
    /// BC6H with signs, 8 bits a texel, where it is good enough; else as `plain`.
    Bc6h,
    /// The smallest of all that is good enough.
    Blocks,
}

impl Texels {
    /// The kinds of blocks that are allowed, the smallest first.
    pub fn codings(self) -> &'static [Coding] {
        match self {
            Self::Plain => &[],
            Self::Bc5 => &[Coding::Pair],
            Self::Bc6h => &[Coding::Hdr],
            Self::Blocks => &[Coding::Hdr, Coding::Pair],
        }
    }
}

/// How the blocks of an image are coded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Coding {
    /// BC6H with signs.
    Hdr,
    /// A block of BC5 with signs for red and green, then one of BC4 with signs for blue.
    Pair,
}

impl Coding {
    /// Bytes of a block of an image.
    pub fn bytes(self) -> usize {
        match self {
            Self::Hdr => 16,
            Self::Pair => 24,
        }
    }
}

/// The blocks of a tile that have texels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layout {
    /// Column and row of each block in the tile, in blocks.
    pub corners: Vec<[u32; 2]>,
    /// For each texel on a surface 16 times the number of its block, and its place in the block.
    places: Vec<u32>,
}

impl Layout {
    /// `mask`: a bit for each texel of a tile of so many columns and rows ([`super::units::Tile::mask`]).
    pub fn new(mask: &[u32], [columns, rows]: [u32; 2]) -> Self {
        let along = columns.div_ceil(SIDE);
        let mut numbers = vec![u32::MAX; (along * rows.div_ceil(SIDE)) as usize];
        let mut out = Self::default();
        for texel in 0..columns * rows {
            if mask.get(texel as usize / 32).is_none_or(|word| word >> (texel % 32) & 1 == 0) {
                continue;
            }
            let [x, y] = [texel % columns, texel / columns];
            let corner = [x / SIDE, y / SIDE];
            let number = &mut numbers[(corner[1] * along + corner[0]) as usize];
            if *number == u32::MAX {
                *number = out.corners.len() as u32;
                out.corners.push(corner);
            }
            out.places.push(*number * TEXELS as u32 + y % SIDE * SIDE + x % SIDE);
        }
        out
    }

    /// Bytes of an image.
    pub fn bytes(&self, coding: Coding) -> usize {
        self.corners.len() * coding.bytes()
    }

    /// Encodes an image of values from -1 to 1: three for each texel on a surface.
    pub fn encode(&self, values: &[f32], coding: Coding) -> Vec<u8> {
        let mut blocks = vec![[[f32::NAN; 3]; TEXELS]; self.corners.len()];
        for (place, colour) in self.places.iter().zip(values.as_chunks::<3>().0) {
            blocks[*place as usize / TEXELS][*place as usize % TEXELS] = *colour;
        }
        let mut out = Vec::with_capacity(self.bytes(coding));
        for mut block in blocks {
            // Texels on no surface have the mean of the others, so that they make no range larger.
            let there = || block.iter().filter(|colour| !colour[0].is_nan());
            let count = there().count().max(1) as f32;
            let mean = [0, 1, 2].map(|channel| there().map(|colour| colour[channel]).sum::<f32>() / count);
            block.iter_mut().filter(|colour| colour[0].is_nan()).for_each(|colour| *colour = mean);
            match coding {
                Coding::Hdr => out.extend(encode_bc6h(&block, [SIDE; 2], true).bytes),
                Coding::Pair => {
                    (0..3).for_each(|channel| out.extend(encode_bc4(&block.map(|colour| colour[channel]))));
                }
            }
        }
        out
    }

    /// The values of an image as 16-bit floats: three for each texel on a surface.
    ///
    /// # Errors
    /// `Input` if the bytes are too few, or if a block of BC6H has another mode than the one that [`Self::encode`] writes.
    pub fn decode(&self, bytes: &[u8], coding: Coding) -> Result<Vec<f16>> {
        if bytes.len() != self.bytes(coding) {
            return Err(Error::input("blocks that are cut off"));
        }
        let mut blocks = Vec::with_capacity(self.corners.len());
        for block in bytes.chunks_exact(coding.bytes()) {
            blocks.push(match coding {
                Coding::Hdr => {
                    let block = block.try_into().ok().and_then(|block| decode_bc6h(block, true));
                    block.ok_or_else(|| Error::input("a block of BC6H of another mode than the first one"))?
                }
                Coding::Pair => {
                    let channels = block.as_chunks::<8>().0;
                    let [r, g, b] = [0, 1, 2].map(|channel| decode_bc4(channels[channel]));
                    std::array::from_fn(|texel| [r[texel], g[texel], b[texel]])
                }
            });
        }
        let at = |place: &u32| blocks[*place as usize / TEXELS][*place as usize % TEXELS];
        Ok(self.places.iter().flat_map(at).map(f16::from_f32).collect())
    }
}

/// The images of a layer that are in blocks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Blocks {
    /// Images in BC6H; they come first.
    pub hdr: u32,
    /// Images in BC5 and BC4.
    pub pairs: u32,
    /// Image after image, block after block of those that have texels.
    pub bytes: Vec<u8>,
    /// The values of the images, one image after the other: three for each texel on a surface.
    values: Vec<f16>,
}

impl Blocks {
    /// Reads the bytes of images.
    ///
    /// # Errors
    /// `Input` if they are not those of such images.
    pub fn read(hdr: u32, pairs: u32, bytes: Vec<u8>, layout: &Layout) -> Result<Self> {
        let mut values = Vec::new();
        let mut rest = bytes.as_slice();
        for coding in
            std::iter::repeat_n(Coding::Hdr, hdr as usize).chain(std::iter::repeat_n(Coding::Pair, pairs as usize))
        {
            let (image, after) =
                rest.split_at_checked(layout.bytes(coding)).ok_or_else(|| Error::input("blocks that are cut off"))?;
            values.extend(layout.decode(image, coding)?);
            rest = after;
        }
        match rest.is_empty() {
            true => Ok(Self { hdr, pairs, bytes, values }),
            false => Err(Error::input("blocks with something after their end")),
        }
    }

    /// Number of images.
    pub fn images(&self) -> u32 {
        self.hdr + self.pairs
    }

    /// Number of texels on surfaces.
    pub fn texels(&self) -> usize {
        self.values.len() / (3 * self.images().max(1) as usize)
    }

    /// The coding of an image, and where its bytes are.
    pub fn image(&self, image: u32, layout: &Layout) -> (Coding, &[u8]) {
        let (hdr, pair) = (layout.bytes(Coding::Hdr), layout.bytes(Coding::Pair));
        let coding = if image < self.hdr { Coding::Hdr } else { Coding::Pair };
        let begin = image.min(self.hdr) as usize * hdr + image.saturating_sub(self.hdr) as usize * pair;
        (coding, self.bytes.get(begin..begin + layout.bytes(coding)).unwrap_or_default())
    }

    /// The values of an image at a texel.
    pub fn value(&self, texel: usize, image: u32) -> [f16; 3] {
        let at = 3 * (image as usize * self.texels() + texel);
        self.values.get(at..at + 3).map_or([f16::ZERO; 3], |value| [value[0], value[1], value[2]])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tile of 10×7 texels with a hole.
    fn layout() -> (Layout, Vec<[u32; 2]>) {
        let there = |x: u32, y: u32| !(4..8).contains(&x) || y > 4;
        let texels: Vec<[u32; 2]> =
            (0..7).flat_map(|y| (0..10).map(move |x| [x, y])).filter(|[x, y]| there(*x, *y)).collect();
        let mut mask = vec![0u32; 3];
        texels.iter().for_each(|[x, y]| mask[(y * 10 + x) as usize / 32] |= 1 << ((y * 10 + x) % 32));
        (Layout::new(&mask, [10, 7]), texels)
    }

    #[test]
    fn blocks_without_texels_are_left_out() {
        let (layout, texels) = layout();
        assert_eq!(layout.corners, [[0, 0], [2, 0], [0, 1], [2, 1], [1, 1]]);
        for (place, [x, y]) in layout.places.iter().zip(&texels) {
            let [column, row] = layout.corners[*place as usize / 16];
            assert_eq!([4 * column + place % 4, 4 * row + place % 16 / 4], [*x, *y]);
        }
    }

    #[test]
    fn smooth_values_of_both_signs_come_back() {
        let (layout, texels) = layout();
        let colour = |[x, y]: &[u32; 2]| {
            let light = 0.1 * *x as f32 - 0.5 + 0.03 * *y as f32;
            [light, -0.7 * light, 0.4 + 0.2 * light]
        };
        let values: Vec<f32> = texels.iter().flat_map(colour).collect();
        let square = |coding: Coding| {
            let bytes = layout.encode(&values, coding);
            assert_eq!(bytes.len(), 5 * coding.bytes());
            let read = layout.decode(&bytes, coding).unwrap();
            let apart = values.iter().zip(&read).map(|(a, b)| f64::from(a - b.to_f32()).powi(2)).sum::<f64>();
            (apart / values.len() as f64).sqrt()
        };
        let [pair, hdr] = [Coding::Pair, Coding::Hdr].map(square);
        // Values are within -0.7 and 1.3.
        assert!(pair < 0.012 && hdr < 0.012, "{pair} {hdr}");
        // Where all values of a block have one sign, it is within a few percent.
        let bright: Vec<f32> = texels.iter().flat_map(|at| colour(at).map(|value| 0.25 * value + 0.6)).collect();
        let read = layout.decode(&layout.encode(&bright, Coding::Hdr), Coding::Hdr).unwrap();
        let apart = bright.iter().zip(&read).map(|(a, b)| f64::from(a - b.to_f32()).powi(2)).sum::<f64>();
        assert!((apart / bright.len() as f64).sqrt() < 0.02, "{apart}");
    }

    #[test]
    fn images_are_found_in_their_bytes_and_damaged_ones_are_refused() {
        let (layout, texels) = layout();
        let values =
            |scale: f32| -> Vec<f32> { texels.iter().flat_map(|[x, _]| [0.05 * scale * *x as f32; 3]).collect() };
        let parts = [(0.5, Coding::Hdr), (1.0, Coding::Pair), (-2.0, Coding::Pair)];
        let images = parts.map(|(scale, coding)| layout.encode(&values(scale), coding));
        let read = Blocks::read(1, 2, images.concat(), &layout).unwrap();
        for (number, ((_, coding), bytes)) in parts.iter().zip(&images).enumerate() {
            assert_eq!(read.image(number as u32, &layout), (*coding, bytes.as_slice()));
            let alone = layout.decode(bytes, *coding).unwrap();
            for texel in 0..texels.len() {
                assert_eq!(read.value(texel, number as u32), alone[3 * texel..3 * texel + 3]);
            }
        }
        let bytes = images.concat();
        assert!(Blocks::read(1, 2, bytes[..bytes.len() - 1].to_vec(), &layout).is_err());
        assert!(Blocks::read(1, 1, bytes.clone(), &layout).is_err());
        let mut other = bytes;
        other[0] ^= 1;
        let error = Blocks::read(1, 2, other, &layout).unwrap_err();
        assert!(error.to_string().contains("another mode"), "{error}");
    }
}

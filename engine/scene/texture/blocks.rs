//! Block-compressed texels: BC1, BC2, BC3, BC4, BC5, BC7 (Khronos Data Format Specification 1.3, sections 18 and 19).

/// Sixteen RGBA texels, row by row.
pub(super) type Block = [[u8; 4]; 16];

#[derive(Clone, Copy)]
pub(super) enum Codec {
    Bc1 { alpha: bool },
    Bc2,
    Bc3,
    Bc4,
    Bc5,
    Bc7,
}

impl Codec {
    pub(super) fn block_bytes(self) -> usize {
        match self {
            Self::Bc1 { .. } | Self::Bc4 => 8,
            Self::Bc2 | Self::Bc3 | Self::Bc5 | Self::Bc7 => 16,
        }
    }

    /// Texels of a block of [`Codec::block_bytes`] bytes; black of any other length.
    pub(super) fn decode(self, bytes: &[u8]) -> Block {
        let mut block = [[0, 0, 0, 255]; 16];
        if let (Self::Bc7, Some(bytes)) = (self, bytes.first_chunk()) {
            return super::bc7::decode(*bytes);
        }
        match (self, bytes.as_chunks::<8>().0) {
            (Self::Bc1 { alpha }, [colour]) => block = bc1(*colour, true, alpha),
            (Self::Bc2, [alpha, colour]) => {
                block = bc1(*colour, false, false);
                let alphas = u64::from_le_bytes(*alpha);
                for (k, texel) in block.iter_mut().enumerate() {
                    texel[3] = (alphas >> (4 * k) & 15) as u8 * 17;
                }
            }
            (Self::Bc3, [alpha, colour]) => {
                block = bc1(*colour, false, false);
                channel(*alpha, 3, &mut block);
            }
            (Self::Bc4, [red]) => channel(*red, 0, &mut block),
            (Self::Bc5, [red, green]) => {
                channel(*red, 0, &mut block);
                channel(*green, 1, &mut block);
            }
            _ => {}
        }
        block
    }
}

/// Copies what of a block lies inside the image.
pub(super) fn place(block: &Block, x: usize, y: usize, width: usize, rgba: &mut [[u8; 4]]) {
    let columns = width.saturating_sub(x).min(4);
    for (row, texels) in block.as_chunks::<4>().0.iter().enumerate() {
        let start = (y + row) * width + x;
        if let Some(target) = rgba.get_mut(start..start + columns) {
            target.copy_from_slice(&texels[..columns]);
        }
    }
}

fn bc1([a, b, c, d, i0, i1, i2, i3]: [u8; 8], three: bool, transparent: bool) -> Block {
    let (first, second) = (u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d]));
    let widen = |c: u16| {
        let (r, g, b) = (u32::from(c >> 11), u32::from(c >> 5 & 63), u32::from(c & 31));
        [r << 3 | r >> 2, g << 2 | g >> 4, b << 3 | b >> 2]
    };
    let (p, q) = (widen(first), widen(second));
    let mix = |wp: u32, wq: u32| {
        let sum = wp + wq;
        let [r, g, b] = std::array::from_fn(|k| ((p[k] * wp + q[k] * wq + sum / 2) / sum) as u8);
        [r, g, b, 255]
    };
    let palette = if three && first <= second {
        [mix(1, 0), mix(0, 1), mix(1, 1), [0, 0, 0, if transparent { 0 } else { 255 }]]
    } else {
        [mix(1, 0), mix(0, 1), mix(2, 1), mix(1, 2)]
    };
    let indices = u32::from_le_bytes([i0, i1, i2, i3]);
    std::array::from_fn(|k| palette[(indices >> (2 * k) & 3) as usize])
}

/// One channel in the manner of BC4: two ends, 3-bit indices.
fn channel(bytes: [u8; 8], into: usize, block: &mut Block) {
    let (a, b) = (u64::from(bytes[0]), u64::from(bytes[1]));
    let indices = u64::from_le_bytes(bytes) >> 16;
    for (k, texel) in block.iter_mut().enumerate() {
        let index = indices >> (3 * k) & 7;
        let value = match (index, a > b) {
            (0, _) => a,
            (1, _) => b,
            (i, true) => ((8 - i) * a + (i - 1) * b + 3) / 7,
            (6, false) => 0,
            (7, false) => 255,
            (i, false) => ((6 - i) * a + (i - 1) * b + 2) / 5,
        };
        texel[into] = value as u8;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bc1_mixes_its_ends() {
        // Red and blue; indices 0, 1, 2, 3 in the first row, then 0.
        let block = Codec::Bc1 { alpha: true }.decode(&[0x00, 0xf8, 0x1f, 0x00, 0b11_10_01_00, 0, 0, 0]);
        assert_eq!(
            block[..5],
            [[255, 0, 0, 255], [0, 0, 255, 255], [170, 0, 85, 255], [85, 0, 170, 255], [255, 0, 0, 255]]
        );
        // Ends in the other order: a middle and a transparent black.
        let block = Codec::Bc1 { alpha: true }.decode(&[0x1f, 0x00, 0x00, 0xf8, 0b11_10_01_00, 0, 0, 0]);
        assert_eq!(block[..4], [[0, 0, 255, 255], [255, 0, 0, 255], [128, 0, 128, 255], [0, 0, 0, 0]]);
    }

    #[test]
    fn bc4_has_eight_or_six_steps() {
        let indices = (0..8u64).fold(0, |bits, i| bits | i << (3 * i));
        let mut bytes = (indices << 16 | 70).to_le_bytes();
        let reds = |bytes: &[u8]| Codec::Bc4.decode(bytes)[..8].iter().map(|t| t[0]).collect::<Vec<_>>();
        assert_eq!(reds(&bytes), [70, 0, 60, 50, 40, 30, 20, 10]);
        (bytes[0], bytes[1]) = (0, 50);
        assert_eq!(reds(&bytes), [0, 50, 10, 20, 30, 40, 0, 255]);
    }
}

//! BC7 blocks (Khronos Data Format Specification 1.3, section 20).

use super::blocks::Block;

/// What each of the eight modes stores.
struct Mode {
    subsets: usize,
    partition_bits: u32,
    rotation_bits: u32,
    selection_bits: u32,
    colour_bits: u32,
    alpha_bits: u32,
    /// Lowest bits of the ends: none, one for each end, or one for both ends of a subset.
    low_bits: LowBits,
    index_bits: u32,
    /// A second list of indices, for alpha (or for colour, by the selection bit).
    second_index_bits: u32,
}

#[derive(Clone, Copy, PartialEq)]
enum LowBits {
    None,
    Each,
    Shared,
}

#[rustfmt::skip]
const MODES: [Mode; 8] = {
    use LowBits::{Each, None, Shared};
    const fn mode(b: [u32; 6], low_bits: LowBits, index_bits: u32, second_index_bits: u32) -> Mode {
        let [subsets, partition_bits, rotation_bits, selection_bits, colour_bits, alpha_bits] = b;
        let subsets = subsets as usize;
        Mode { subsets, partition_bits, rotation_bits, selection_bits, colour_bits, alpha_bits, low_bits, index_bits, second_index_bits }
    }
    [
        mode([3, 4, 0, 0, 4, 0], Each, 3, 0),
        mode([2, 6, 0, 0, 6, 0], Shared, 3, 0),
        mode([3, 6, 0, 0, 5, 0], None, 2, 0),
        mode([2, 6, 0, 0, 7, 0], Each, 2, 0),
        mode([1, 0, 2, 1, 5, 6], None, 2, 3),
        mode([1, 0, 2, 0, 7, 8], None, 2, 2),
        mode([1, 0, 0, 0, 7, 7], Each, 4, 0),
        mode([2, 6, 0, 0, 5, 5], Each, 2, 0),
    ]
};

/// Reads from the lowest bit up.
struct Bits(u128);

impl Bits {
    fn take(&mut self, count: u32) -> u32 {
        let value = self.0 & ((1 << count) - 1);
        self.0 >>= count;
        value as u32
    }
}

pub(super) fn decode(bytes: [u8; 16]) -> Block {
    let mode_number = bytes[0].trailing_zeros();
    // Eight zeros are reserved and stand for transparent black.
    let Some(mode) = MODES.get(mode_number as usize) else { return [[0; 4]; 16] };
    let mut bits = Bits(u128::from_le_bytes(bytes) >> (mode_number + 1));
    let partition = bits.take(mode.partition_bits) as usize;
    let rotation = bits.take(mode.rotation_bits);
    let selection = bits.take(mode.selection_bits);
    let ends = ends(mode, &mut bits);

    let subset = |texel: usize| match mode.subsets {
        2 => usize::from(PARTITIONS_2[partition] >> texel & 1),
        3 => (PARTITIONS_3[partition] >> (2 * texel) & 3) as usize,
        _ => 0,
    };
    // The first texel of each subset in the spec's sense has an index with its highest bit left out.
    let is_anchor = |texel: usize| {
        texel == 0
            || match mode.subsets {
                2 => texel == usize::from(ANCHORS_2[partition]),
                3 => texel == usize::from(ANCHORS_3_1[partition]) || texel == usize::from(ANCHORS_3_2[partition]),
                _ => false,
            }
    };
    let first: [u32; 16] = std::array::from_fn(|texel| bits.take(mode.index_bits - u32::from(is_anchor(texel))));
    let second: [u32; 16] = std::array::from_fn(|texel| match mode.second_index_bits {
        0 => 0,
        n => bits.take(n - u32::from(texel == 0)),
    });

    std::array::from_fn(|texel| {
        let [low, high] = ends[subset(texel)];
        let one = weight(mode.index_bits, first[texel]);
        let two = if mode.second_index_bits == 0 { one } else { weight(mode.second_index_bits, second[texel]) };
        let (colour, alpha) = if selection == 0 { (one, two) } else { (two, one) };
        let mut rgba: [u8; 4] = std::array::from_fn(|c| {
            let w = if c == 3 { alpha } else { colour };
            (((64 - w) * low[c] + w * high[c] + 32) >> 6) as u8
        });
        if let 1..=3 = rotation {
            rgba.swap(rotation as usize - 1, 3);
        }
        rgba
    })
}

/// Both ends of each subset, RGBA, 8 bits.
fn ends(mode: &Mode, bits: &mut Bits) -> [[[u32; 4]; 2]; 3] {
    let mut ends = [[[0u32; 4]; 2]; 3];
    for channel in 0..4 {
        let count = if channel == 3 { mode.alpha_bits } else { mode.colour_bits };
        for end in ends[..mode.subsets].as_flattened_mut() {
            end[channel] = bits.take(count);
        }
    }
    let with_low = mode.low_bits != LowBits::None;
    for subset in &mut ends[..mode.subsets] {
        let shared = if mode.low_bits == LowBits::Shared { bits.take(1) } else { 0 };
        for end in subset {
            let low = if mode.low_bits == LowBits::Each { bits.take(1) } else { shared };
            for (channel, value) in end.iter_mut().enumerate() {
                let count = if channel == 3 { mode.alpha_bits } else { mode.colour_bits };
                if count == 0 {
                    *value = 255;
                    continue;
                }
                let (stored, count) = if with_low { (*value << 1 | low, count + 1) } else { (*value, count) };
                // The highest bits fill the lowest, so that the largest code is 255.
                *value = stored << (8 - count) | stored >> (2 * count - 8);
            }
        }
    }
    ends
}

/// Of 64.
fn weight(bits: u32, index: u32) -> u32 {
    let index = index as usize;
    match bits {
        2 => [0, 21, 43, 64][index & 3],
        3 => [0, 9, 18, 27, 37, 46, 55, 64][index & 7],
        _ => [0, 4, 9, 13, 17, 21, 26, 30, 34, 38, 43, 47, 51, 55, 60, 64][index & 15],
    }
}

/// Bit k: the subset of texel k.
#[rustfmt::skip]
const PARTITIONS_2: [u16; 64] = [
    0xcccc, 0x8888, 0xeeee, 0xecc8, 0xc880, 0xfeec, 0xfec8, 0xec80,
    0xc800, 0xffec, 0xfe80, 0xe800, 0xffe8, 0xff00, 0xfff0, 0xf000,
    0xf710, 0x008e, 0x7100, 0x08ce, 0x008c, 0x7310, 0x3100, 0x8cce,
    0x088c, 0x3110, 0x6666, 0x366c, 0x17e8, 0x0ff0, 0x718e, 0x399c,
    0xaaaa, 0xf0f0, 0x5a5a, 0x33cc, 0x3c3c, 0x55aa, 0x9696, 0xa55a,
    0x73ce, 0x13c8, 0x324c, 0x3bdc, 0x6996, 0xc33c, 0x9966, 0x0660,
    0x0272, 0x04e4, 0x4e40, 0x2720, 0xc936, 0x936c, 0x39c6, 0x639c,
    0x9336, 0x9cc6, 0x817e, 0xe718, 0xccf0, 0x0fcc, 0x7744, 0xee22,
];

/// Bits 2k and 2k + 1: the subset of texel k.
#[rustfmt::skip]
const PARTITIONS_3: [u32; 64] = [
    0xaa685050, 0x6a5a5040, 0x5a5a4200, 0x5450a0a8, 0xa5a50000, 0xa0a05050, 0x5555a0a0, 0x5a5a5050,
    0xaa550000, 0xaa555500, 0xaaaa5500, 0x90909090, 0x94949494, 0xa4a4a4a4, 0xa9a59450, 0x2a0a4250,
    0xa5945040, 0x0a425054, 0xa5a5a500, 0x55a0a0a0, 0xa8a85454, 0x6a6a4040, 0xa4a45000, 0x1a1a0500,
    0x0050a4a4, 0xaaa59090, 0x14696914, 0x69691400, 0xa08585a0, 0xaa821414, 0x50a4a450, 0x6a5a0200,
    0xa9a58000, 0x5090a0a8, 0xa8a09050, 0x24242424, 0x00aa5500, 0x24924924, 0x24499224, 0x50a50a50,
    0x500aa550, 0xaaaa4444, 0x66660000, 0xa5a0a5a0, 0x50a050a0, 0x69286928, 0x44aaaa44, 0x66666600,
    0xaa444444, 0x54a854a8, 0x95809580, 0x96969600, 0xa85454a8, 0x80959580, 0xaa141414, 0x96960000,
    0xaaaa1414, 0xa05050a0, 0xa0a5a5a0, 0x96000000, 0x40804080, 0xa9a8a9a8, 0xaaaaaa44, 0x2a4a5254,
];

/// The anchor texel of the second of two subsets.
#[rustfmt::skip]
const ANCHORS_2: [u8; 64] = [
    15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15,
    15, 2, 8, 2, 2, 8, 8, 15, 2, 8, 2, 2, 8, 8, 2, 2,
    15, 15, 6, 8, 2, 8, 15, 15, 2, 8, 2, 2, 2, 15, 15, 6,
    6, 2, 6, 8, 15, 15, 2, 2, 15, 15, 15, 15, 15, 2, 2, 15,
];

/// The anchor texel of the second of three subsets.
#[rustfmt::skip]
const ANCHORS_3_1: [u8; 64] = [
    3, 3, 15, 15, 8, 3, 15, 15, 8, 8, 6, 6, 6, 5, 3, 3,
    3, 3, 8, 15, 3, 3, 6, 10, 5, 8, 8, 6, 8, 5, 15, 15,
    8, 15, 3, 5, 6, 10, 8, 15, 15, 3, 15, 5, 15, 15, 15, 15,
    3, 15, 5, 5, 5, 8, 5, 10, 5, 10, 8, 13, 15, 12, 3, 3,
];

/// The anchor texel of the third of three subsets.
#[rustfmt::skip]
const ANCHORS_3_2: [u8; 64] = [
    15, 8, 8, 3, 15, 15, 3, 8, 15, 15, 15, 15, 15, 15, 15, 8,
    15, 8, 15, 3, 15, 8, 15, 8, 3, 15, 6, 10, 15, 15, 10, 8,
    15, 3, 15, 10, 10, 8, 9, 10, 6, 15, 8, 15, 3, 6, 6, 8,
    15, 3, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 3, 15, 15, 8,
];

#[cfg(test)]
mod tests {
    use super::*;

    /// Packs fields from the lowest bit up.
    fn pack(fields: &[(u32, u32)]) -> [u8; 16] {
        let mut at = 0;
        let mut value = 0u128;
        for &(bits, field) in fields {
            value |= u128::from(field) << at;
            at += bits;
        }
        assert!(at <= 128);
        value.to_le_bytes()
    }

    #[test]
    fn mode_6_mixes_rgba_in_sixteenths() {
        // Ends (0, 64, 254, 254) + low bit 0 and (254, 64, 0, 254) + low bit 1; the first index has three bits.
        let mut fields = vec![(7, 1 << 6)];
        fields.extend([
            (7, 0),
            (7, 127),
            (7, 32),
            (7, 32),
            (7, 127),
            (7, 0),
            (7, 127),
            (7, 127),
            (1, 0),
            (1, 1),
            (3, 0),
        ]);
        fields.extend((1..16).map(|i| (4, i)));
        let block = decode(pack(&fields));
        assert_eq!((block[0], block[15]), ([0, 64, 254, 254], [255, 65, 1, 255]));
        assert!(block.windows(2).all(|pair| pair[0][0] < pair[1][0] && pair[0][2] > pair[1][2]));
        assert_eq!(block[8][0], 135);
    }

    #[test]
    fn mode_5_rotates_alpha_into_a_colour() {
        // Rotation 1: the plane that is stored as alpha is red.
        let mut fields = vec![(6, 1 << 5), (2, 1)];
        fields.extend([(7, 10), (7, 10), (7, 20), (7, 20), (7, 30), (7, 30), (8, 200), (8, 200)]);
        let block = decode(pack(&fields));
        assert_eq!(block, [[200, 40, 60, 20]; 16]);
    }

    #[test]
    fn mode_1_has_two_halves_without_alpha() {
        // Partition 13: the upper half is one subset, the lower half the other.
        let mut fields = vec![(2, 1 << 1), (6, 13)];
        fields.extend([(6, 63), (6, 63), (6, 0), (6, 0), (6, 0), (6, 0), (6, 63), (6, 63)]);
        fields.extend([(6, 0), (6, 0), (6, 0), (6, 0), (1, 1), (1, 0)]);
        let block = decode(pack(&fields));
        assert_eq!(block[..8], [[255, 2, 2, 255]; 8]);
        assert_eq!(block[8..], [[0, 253, 0, 255]; 8]);
    }

    #[test]
    fn anchors_lie_in_their_subsets() {
        for p in 0..64 {
            assert_eq!((PARTITIONS_2[p] & 1, PARTITIONS_3[p] & 3), (0, 0));
            assert_eq!(PARTITIONS_2[p] >> ANCHORS_2[p] & 1, 1);
            assert_eq!(PARTITIONS_3[p] >> (2 * ANCHORS_3_1[p]) & 3, 1);
            assert_eq!(PARTITIONS_3[p] >> (2 * ANCHORS_3_2[p]) & 3, 2);
        }
        assert_eq!(decode([0; 16]), [[0; 4]; 16]);
    }
}

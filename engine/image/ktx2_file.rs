//! KTX 2.0 files out: one 2D image, or the six faces of a cube, with levels, uncompressed or in blocks of BC6H ("KTX File Format Specification", version 2.0, Khronos).
//!
//! The crate `ktx2` reads such files and describes formats, but does not write files.

use ktx2::dfd::{Basic, Block};

use crate::{Error, ErrorKind, Result};

const IDENTIFIER: [u8; 12] = *b"\xabKTX 20\xbb\r\n\x1a\n";
/// Bytes of the header and of the index before the entries of the levels.
const HEAD: usize = 80;
/// Bytes of one entry of the level index.
const ENTRY: usize = 24;

/// What a texel, or a block of 4×4 texels, holds. The names are those of Vulkan, without `VK_FORMAT`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ktx2Format {
    R8g8b8a8Snorm,
    R16g16b16a16Sfloat,
    R32Uint,
    R32Sfloat,
    Bc6hUfloatBlock,
    Bc6hSfloatBlock,
}

impl Ktx2Format {
    fn known(self) -> ktx2::Format {
        match self {
            Self::R8g8b8a8Snorm => ktx2::Format::R8G8B8A8_SNORM,
            Self::R16g16b16a16Sfloat => ktx2::Format::R16G16B16A16_SFLOAT,
            Self::R32Uint => ktx2::Format::R32_UINT,
            Self::R32Sfloat => ktx2::Format::R32_SFLOAT,
            Self::Bc6hUfloatBlock => ktx2::Format::BC6H_UFLOAT_BLOCK,
            Self::Bc6hSfloatBlock => ktx2::Format::BC6H_SFLOAT_BLOCK,
        }
    }

    /// Texels along a side of a block.
    pub fn block(self) -> u32 {
        match self {
            Self::Bc6hUfloatBlock | Self::Bc6hSfloatBlock => 4,
            _ => 1,
        }
    }

    /// Bytes of a block.
    pub fn bytes(self) -> usize {
        match self {
            Self::R8g8b8a8Snorm | Self::R32Uint | Self::R32Sfloat => 4,
            Self::R16g16b16a16Sfloat => 8,
            Self::Bc6hUfloatBlock | Self::Bc6hSfloatBlock => 16,
        }
    }

    /// Bytes of a level.
    pub fn level_bytes(self, [width, height]: [u32; 2]) -> usize {
        let blocks = [width, height].map(|side| side.div_ceil(self.block()) as usize);
        blocks[0] * blocks[1] * self.bytes()
    }
}

/// Columns and rows of a level.
pub fn level_extent(extent: [u32; 2], level: usize) -> [u32; 2] {
    extent.map(|side| side.checked_shr(level as u32).unwrap_or(0).max(1))
}

/// The bytes of a file. `levels`: from the largest on, rows from the top on, without gaps. `about`: pairs of a key and its text, which the file
/// carries beside `KTXorientation` and `KTXwriter`.
///
/// # Errors
/// `Usage` if there is no level, if there are more than the extent allows, or if one has another size than its extent says.
pub fn encode_ktx2(
    format: Ktx2Format,
    extent: [u32; 2],
    levels: &[Vec<u8>],
    about: &[(&str, &str)],
) -> Result<Vec<u8>> {
    encode(format, extent, 1, levels, about)
}

/// The bytes of a file of a cube map. `levels`: in each one the faces +X, -X, +Y, -Y, +Z, -Z, one after the other.
///
/// # Errors
/// As [`encode_ktx2`].
pub fn encode_ktx2_cube(format: Ktx2Format, side: u32, levels: &[Vec<u8>], about: &[(&str, &str)]) -> Result<Vec<u8>> {
    encode(format, [side; 2], 6, levels, about)
}

fn encode(
    format: Ktx2Format,
    extent: [u32; 2],
    faces: u32,
    levels: &[Vec<u8>],
    about: &[(&str, &str)],
) -> Result<Vec<u8>> {
    let most = 32 - extent[0].max(extent[1]).leading_zeros() as usize;
    if extent.contains(&0) || levels.is_empty() || levels.len() > most {
        let [width, height] = extent;
        return Err(Error::usage(format!("{} levels of an image of {width}×{height} texels", levels.len())));
    }
    for (level, bytes) in levels.iter().enumerate() {
        let wanted = faces as usize * format.level_bytes(level_extent(extent, level));
        if bytes.len() != wanted {
            return Err(Error::usage(format!("level {level} has {} bytes, {wanted} are needed", bytes.len())));
        }
    }
    let (block, type_size) = Basic::from_format(format.known())
        .map_err(|error| Error::new(ErrorKind::Runtime, "the format has no descriptor").caused_by(error))?;
    let block = Block::Basic(block).to_vec();
    let mut descriptor = (4 + block.len() as u32).to_le_bytes().to_vec();
    descriptor.extend(block);
    let writer = format!("lucerna {}", env!("CARGO_PKG_VERSION"));
    let mut pairs: Vec<(&str, &str)> = [("KTXorientation", "rd"), ("KTXwriter", &writer)].into();
    pairs.extend(about);
    pairs.sort_unstable();
    let mut texts = Vec::new();
    for (key, value) in pairs {
        texts.extend((key.len() as u32 + value.len() as u32 + 2).to_le_bytes());
        for part in [key, value] {
            texts.extend(part.as_bytes());
            texts.push(0);
        }
        texts.resize(texts.len().next_multiple_of(4), 0);
    }
    let first = HEAD + ENTRY * levels.len();
    let after = first + descriptor.len();
    // Levels begin at multiples of the block's bytes and of 4.
    let begin = |at: usize| at.next_multiple_of(format.bytes().max(4));
    let mut places = vec![0; levels.len()];
    let mut end = after + texts.len();
    // The smallest level comes first.
    for (place, bytes) in places.iter_mut().zip(levels).rev() {
        *place = begin(end);
        end = *place + bytes.len();
    }
    let mut out = Vec::with_capacity(end);
    out.extend(IDENTIFIER);
    let words = [format.known().value(), type_size, extent[0], extent[1], 0, 0, faces, levels.len() as u32, 0];
    let index = [first as u32, descriptor.len() as u32, after as u32, texts.len() as u32];
    out.extend(words.into_iter().chain(index).flat_map(u32::to_le_bytes));
    out.extend([0; 16]);
    for (place, bytes) in places.iter().zip(levels) {
        out.extend([*place, bytes.len(), bytes.len()].into_iter().flat_map(|number| (number as u64).to_le_bytes()));
    }
    out.extend(descriptor);
    out.extend(texts);
    for (place, bytes) in places.iter().zip(levels).rev() {
        out.resize(*place, 0);
        out.extend(bytes);
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Ktx2Format; 6] = [
        Ktx2Format::R8g8b8a8Snorm,
        Ktx2Format::R16g16b16a16Sfloat,
        Ktx2Format::R32Uint,
        Ktx2Format::R32Sfloat,
        Ktx2Format::Bc6hUfloatBlock,
        Ktx2Format::Bc6hSfloatBlock,
    ];

    /// Bytes that tell where they stand.
    fn content(count: usize, level: usize) -> Vec<u8> {
        (0..count).map(|i| (i * 7 + level * 31) as u8).collect()
    }

    #[test]
    fn another_reader_finds_the_same_levels_and_texts() {
        for format in ALL {
            let extent = [13, 6];
            let levels: Vec<Vec<u8>> =
                (0..4).map(|level| content(format.level_bytes(level_extent(extent, level)), level)).collect();
            let file = encode_ktx2(format, extent, &levels, &[("unit", "W/m2")]).unwrap();
            let reader = ktx2::Reader::new(&file).unwrap();
            let header = reader.header();
            assert_eq!(header.format, Some(format.known()));
            assert_eq!((header.pixel_width, header.pixel_height, header.level_count), (13, 6, 4));
            let described = reader.basic_dfd().unwrap();
            assert_eq!(usize::from(described.bytes_planes[0]), format.bytes(), "{format:?}");
            assert_eq!(u32::from(described.texel_block_dimensions[1].get()), format.block(), "{format:?}");
            let read: Vec<Vec<u8>> = reader.levels().map(|level| level.data.to_vec()).collect();
            assert_eq!(read, levels, "{format:?}");
            let texts: Vec<(&str, &[u8])> = reader.key_value_data().collect();
            assert!(texts.contains(&("unit", b"W/m2\0")) && texts.contains(&("KTXorientation", b"rd\0")), "{texts:?}");
            assert!(texts.is_sorted());
        }
    }

    #[test]
    fn impossible_levels_are_refused() {
        let format = Ktx2Format::R32Sfloat;
        for (extent, levels) in [
            ([4, 4], vec![]),
            ([4, 4], vec![vec![0; 60]]),
            ([0, 4], vec![vec![]]),
            ([1, 1], vec![vec![0; 4], vec![0; 4]]),
        ] {
            assert!(encode_ktx2(format, extent, &levels, &[]).is_err(), "{extent:?}");
        }
    }
}

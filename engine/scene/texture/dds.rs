//! The DDS container (Microsoft, "Programming Guide for DDS"): its first level, block compressed or plain.

use super::{
    blocks::Codec,
    ktx::{Kind, Layout},
    texels,
};
use crate::{
    Error, Result,
    image::check_size,
    scene::{Limits, Texture},
};

/// The first bytes of every file.
pub(super) const MAGIC: &[u8] = b"DDS ";
/// Bytes of the magic and the header, and of the second header that some files have.
const HEADER: usize = 128;
const SECOND: usize = 20;
/// Flags of the pixel format.
const FOURCC: u32 = 0x4;
const PLAIN: u32 = 0x40 | 0x2_0000;
const ALPHA: u32 = 0x1;
/// Flags of cube maps and volumes.
const CUBE: u32 = 0x200;
const VOLUME: u32 = 0x20_0000;

/// How texels lie in the file.
enum Stored {
    Layout(Layout),
    /// Bits of red, green, blue and alpha in a number of so many bytes.
    Masks {
        bytes: usize,
        masks: [u32; 4],
        grey: bool,
    },
}

pub(super) fn decode(bytes: &[u8], limits: &Limits) -> Result<Texture> {
    let word = |at: usize| bytes.get(at..at + 4).map_or(0, |b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    if bytes.len() < HEADER || word(4) != 124 || word(76) != 32 {
        return Err(Error::input("the DDS header is damaged"));
    }
    let (height, width) = (word(12), word(16));
    if word(112) & (CUBE | VOLUME) != 0 {
        return Err(Error::input("DDS with a cube map or a volume, only single 2D images are read"));
    }
    // Decoded texels beside those that they are decoded from, at most 16 bytes a texel each.
    check_size(width.into(), height.into(), 4, limits)?;
    let second = word(80) & FOURCC != 0 && word(84).to_le_bytes() == *b"DX10";
    if second && (word(132) != 3 || word(136) & 0x4 != 0 || word(140) > 1) {
        return Err(Error::input("DDS with several images, only single 2D images are read"));
    }
    let stored = match (word(80) & FOURCC != 0, second) {
        (true, true) => Stored::Layout(by_number(word(128))?),
        (true, false) => Stored::Layout(by_letters(word(84))?),
        (false, _) => masks(word(80), word(88), [92, 96, 100, 104].map(word))?,
    };
    let data = bytes.get(HEADER + if second { SECOND } else { 0 }..).unwrap_or_default();
    let size = match &stored {
        Stored::Layout(layout) => layout.bytes(width, height),
        Stored::Masks { bytes, .. } => u64::from(width) * u64::from(height) * *bytes as u64,
    };
    // Smaller levels may follow.
    let Some(data) = usize::try_from(size).ok().and_then(|size| data.get(..size)) else {
        return Err(Error::input(format!("{} bytes of texels where {size} are needed", data.len())));
    };
    let rgba = match stored {
        Stored::Layout(layout) => layout.decode(width, height, data)?,
        Stored::Masks { bytes, masks, grey } => unpacked(width as usize * height as usize, data, bytes, masks, grey)?,
    };
    Ok(Texture { name: String::new(), width, height, rgba })
}

fn unsupported(what: &str) -> Error {
    Error::input(format!("DDS with the format {what}"))
        .help("Read are plain formats of 8 to 32 bits a channel, and BC1 to BC5 and BC7 (DXT1 to DXT5, ATI1, ATI2)")
}

/// Formats by four letters, or by the numbers of Direct3D 9.
fn by_letters(letters: u32) -> Result<Layout> {
    let plain = |channels, kind| Layout::Plain { channels, kind, bgr: false };
    Ok(match &letters.to_le_bytes() {
        b"DXT1" => Layout::Blocks(Codec::Bc1 { alpha: true }),
        b"DXT2" | b"DXT3" => Layout::Blocks(Codec::Bc2),
        b"DXT4" | b"DXT5" => Layout::Blocks(Codec::Bc3),
        b"ATI1" | b"BC4U" => Layout::Blocks(Codec::Bc4),
        b"ATI2" | b"BC5U" => Layout::Blocks(Codec::Bc5),
        _ => match letters {
            36 => plain(4, Kind::U16),
            111 => plain(1, Kind::F16),
            112 => plain(2, Kind::F16),
            113 => plain(4, Kind::F16),
            114 => plain(1, Kind::F32),
            115 => plain(2, Kind::F32),
            116 => plain(4, Kind::F32),
            _ => return Err(unsupported(&letters.to_le_bytes().escape_ascii().to_string())),
        },
    })
}

/// Formats by the numbers of DXGI.
fn by_number(number: u32) -> Result<Layout> {
    let plain = |channels, kind| Layout::Plain { channels, kind, bgr: false };
    Ok(match number {
        2 => plain(4, Kind::F32),
        10 => plain(4, Kind::F16),
        11 => plain(4, Kind::U16),
        16 => plain(2, Kind::F32),
        28 | 29 => plain(4, Kind::U8),
        34 => plain(2, Kind::F16),
        35 => plain(2, Kind::U16),
        41 => plain(1, Kind::F32),
        49 => plain(2, Kind::U8),
        54 => plain(1, Kind::F16),
        56 => plain(1, Kind::U16),
        61 => plain(1, Kind::U8),
        71 | 72 => Layout::Blocks(Codec::Bc1 { alpha: true }),
        74 | 75 => Layout::Blocks(Codec::Bc2),
        77 | 78 => Layout::Blocks(Codec::Bc3),
        80 => Layout::Blocks(Codec::Bc4),
        83 => Layout::Blocks(Codec::Bc5),
        87 | 91 => Layout::Plain { channels: 4, kind: Kind::U8, bgr: true },
        98 | 99 => Layout::Blocks(Codec::Bc7),
        _ => return Err(unsupported(&format!("{number} of DXGI"))),
    })
}

fn masks(flags: u32, bits: u32, [red, green, blue, alpha]: [u32; 4]) -> Result<Stored> {
    if flags & PLAIN == 0 || !matches!(bits, 8 | 16 | 24 | 32) || red == 0 {
        return Err(unsupported(&format!("of {bits} bits with the flags {flags:#x}")));
    }
    let grey = flags & 0x40 == 0;
    let alpha = if flags & ALPHA != 0 { alpha } else { 0 };
    Ok(Stored::Masks { bytes: bits as usize / 8, masks: [red, green, blue, alpha], grey })
}

fn unpacked(count: usize, data: &[u8], bytes: usize, masks: [u32; 4], grey: bool) -> Result<Vec<[u8; 4]>> {
    let mut rgba = texels(count)?;
    let channel = |number: u32, mask: u32| {
        let most = u64::from(mask >> mask.trailing_zeros().min(31));
        let value = u64::from((number & mask) >> mask.trailing_zeros().min(31));
        ((value * 255 + most / 2) / most.max(1)) as u8
    };
    for (texel, stored) in rgba.iter_mut().zip(data.chunks_exact(bytes)) {
        let number = stored.iter().rev().fold(0u32, |number, byte| number << 8 | u32::from(*byte));
        let [red, green, blue, alpha] = masks;
        *texel = [channel(number, red), channel(number, green), channel(number, blue), 255];
        if grey {
            *texel = [texel[0], texel[0], texel[0], 255];
        }
        if alpha != 0 {
            texel[3] = channel(number, alpha);
        }
    }
    Ok(rgba)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file with this pixel format (flags, letters, bits, masks) and these texels.
    fn file([width, height]: [u32; 2], format: [u32; 7], second: Option<u32>, texels: &[u8]) -> Vec<u8> {
        let mut words = [0u32; 31];
        (words[0], words[1], words[2], words[3]) = (124, 0x1007, height, width);
        words[18] = 32;
        words[19..26].copy_from_slice(&format);
        let mut out = [MAGIC, bytemuck::cast_slice(&words)].concat();
        if let Some(number) = second {
            out.extend_from_slice(bytemuck::cast_slice(&[number, 3, 0, 1, 0]));
        }
        out.extend_from_slice(texels);
        out
    }

    fn letters(name: &[u8; 4]) -> [u32; 7] {
        [FOURCC, u32::from_le_bytes(*name), 0, 0, 0, 0, 0]
    }

    fn read(bytes: &[u8]) -> Result<Vec<[u8; 4]>> {
        decode(bytes, &Limits::default()).map(|texture| texture.rgba)
    }

    #[test]
    fn plain_texels_by_masks() {
        let bgra = [0x41, 0, 32, 0xff_0000, 0xff00, 0xff, 0xff00_0000];
        assert_eq!(read(&file([2, 1], bgra, None, &[1, 2, 3, 4, 5, 6, 7, 8])).unwrap(), [[3, 2, 1, 4], [7, 6, 5, 8]]);
        // 24 bits without alpha; 5, 6 and 5 bits; grey.
        let bgr = [0x40, 0, 24, 0xff_0000, 0xff00, 0xff, 0];
        assert_eq!(read(&file([1, 1], bgr, None, &[1, 2, 3])).unwrap(), [[3, 2, 1, 255]]);
        let few = [0x40, 0, 16, 0xf800, 0x7e0, 0x1f, 0];
        assert_eq!(
            read(&file([2, 1], few, None, &[0x00, 0xf8, 0xff, 0x07])).unwrap(),
            [[255, 0, 0, 255], [0, 255, 255, 255]]
        );
        let grey = [0x2_0000, 0, 8, 0xff, 0, 0, 0];
        assert_eq!(read(&file([2, 1], grey, None, &[9, 200])).unwrap(), [[9, 9, 9, 255], [200, 200, 200, 255]]);
    }

    #[test]
    fn blocks_and_numbers_are_those_of_their_formats() {
        // Red and blue ends, indices 0 to 3.
        let colour = [0x00, 0xf8, 0x1f, 0x00, 0b11_10_01_00, 0, 0, 0];
        let first = |bytes: &[u8]| read(bytes).unwrap()[..4].to_vec();
        let plain = [[255, 0, 0, 255], [0, 0, 255, 255], [170, 0, 85, 255], [85, 0, 170, 255]];
        assert_eq!(first(&file([4, 4], letters(b"DXT1"), None, &colour)), plain);
        assert_eq!(first(&file([4, 4], letters(b"DX10"), Some(72), &colour)), plain);
        // Alpha of four bits a texel.
        let alpha = [0x10, 0x32, 0, 0, 0, 0, 0, 0];
        let with = [[255, 0, 0, 0], [0, 0, 255, 17], [170, 0, 85, 34], [85, 0, 170, 51]];
        assert_eq!(first(&file([4, 4], letters(b"DXT3"), None, &[alpha, colour].concat())), with);
        assert_eq!(first(&file([4, 4], letters(b"DX10"), Some(74), &[alpha, colour].concat())), with);
        assert_eq!(read(&file([1, 1], letters(b"DX10"), Some(87), &[1, 2, 3, 4])).unwrap(), [[3, 2, 1, 4]]);
        let half = half::f16::from_f32(0.5).to_le_bytes();
        assert_eq!(read(&file([1, 1], [FOURCC, 113, 0, 0, 0, 0, 0], None, &[half; 4].concat())).unwrap(), [[128; 4]]);
        // Smaller levels after the first are not read.
        assert_eq!(read(&file([4, 4], letters(b"DXT1"), None, &[colour, colour].concat())).unwrap().len(), 16);
    }

    #[test]
    fn what_is_damaged_or_not_supported_is_told() {
        let good = file([4, 4], letters(b"DXT1"), None, &[0; 8]);
        for (bytes, part) in [
            (good[..100].to_vec(), "header is damaged"),
            (good[..132].to_vec(), "4 bytes of texels where 8 are needed"),
            (file([4, 4], letters(b"ETC1"), None, &[0; 8]), "format ETC1"),
            (file([4, 4], letters(b"DX10"), Some(95), &[0; 16]), "95 of DXGI"),
            (file([4, 4], [0x40, 0, 12, 1, 2, 4, 0], None, &[0; 64]), "12 bits"),
            (file([1 << 30, 1 << 30], letters(b"DXT1"), None, &[0; 8]), ""),
            (file([0, 4], letters(b"DXT1"), None, &[0; 8]), ""),
        ] {
            let error = read(&bytes).unwrap_err();
            assert!(error.exit_code() == 3 && error.to_string().contains(part), "{error}");
        }
        let mut cube = good.clone();
        cube[112..116].copy_from_slice(&CUBE.to_le_bytes());
        assert!(read(&cube).unwrap_err().to_string().contains("cube map"));
        // Every cut and every changed byte has an answer.
        for at in 0..good.len() {
            let _ = read(&good[..at]);
            for value in [0, 1, 0x7f, 0xff] {
                let mut other = good.clone();
                other[at] = value;
                let _ = read(&other);
            }
        }
    }
}

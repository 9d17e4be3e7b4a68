//! The KTX2 container: which level, which compression around it, which texel format.

use std::io::Read;

use half::f16;
use ktx2::{ColorModel, Format, Reader, SupercompressionScheme};

use super::{basis, blocks, texels};
use crate::{
    Error, ErrorKind, Result,
    image::check_size,
    scene::{Limits, Texture},
};

pub(super) fn decode(bytes: &[u8], limits: &Limits) -> Result<Texture> {
    let reader =
        Reader::new(bytes).map_err(|error| Error::input("KTX2 header or index is damaged").caused_by(error))?;
    let header = reader.header();
    let (width, height) = (header.pixel_width, header.pixel_height.max(1));
    if header.pixel_depth > 1 || header.layer_count > 1 || header.face_count != 1 {
        let (depth, layers, faces) = (header.pixel_depth, header.layer_count, header.face_count);
        let what =
            format!("KTX2 with depth {depth}, {layers} layers and {faces} faces, only single 2D images are read");
        return Err(Error::input(what));
    }
    // Decoded texels beside the level that they are decoded from, at most 16 bytes a texel each.
    check_size(width.into(), height.into(), 4, limits)?;
    let level = reader.levels().next().ok_or_else(|| Error::input("KTX2 without levels"))?;
    let mut rgba = match reader.color_model() {
        Some(ColorModel::ETC1S) => {
            if header.supercompression_scheme != Some(SupercompressionScheme::BasisLZ) {
                return Err(Error::input("ETC1S texels without BasisLZ supercompression"));
            }
            let global = reader.supercompression_global_data();
            basis::decode_etc1s(width, height, global, level.data)?
        }
        Some(ColorModel::UASTC) => {
            let size = u64::from(width.div_ceil(4)) * u64::from(height.div_ceil(4)) * 16;
            let data = level_bytes(header.supercompression_scheme, level.data, size, limits)?;
            basis::decode_uastc(width, height, &data)?
        }
        _ => {
            let format =
                header.format.ok_or_else(|| Error::input("KTX2 with neither a Vulkan format nor Basis texels"))?;
            let layout = Layout::of(format)?;
            let size = layout.bytes(width, height);
            let data = level_bytes(header.supercompression_scheme, level.data, size, limits)?;
            layout.decode(width, height, &data)?
        }
    };
    if let Some((_, value)) = reader.key_value_data().find(|(key, _)| *key == "KTXorientation") {
        orient(value, width as usize, &mut rgba);
    }
    Ok(Texture { name: String::new(), width, height, rgba })
}

/// Brings the image to right-down order. KTX 2.0 section 4.2: `l` or `r`, then `u` or `d`.
fn orient(value: &[u8], width: usize, rgba: &mut [[u8; 4]]) {
    if value.first() == Some(&b'l') {
        rgba.chunks_exact_mut(width).for_each(<[_]>::reverse);
    }
    if value.get(1) == Some(&b'u') {
        let height = rgba.len() / width;
        for y in 0..height / 2 {
            let (top, bottom) = rgba.split_at_mut((height - 1 - y) * width);
            top[y * width..(y + 1) * width].swap_with_slice(&mut bottom[..width]);
        }
    }
}

/// The bytes of a level of exactly `size` bytes, unpacked where they are packed.
fn level_bytes<'a>(
    scheme: Option<SupercompressionScheme>,
    data: &'a [u8],
    size: u64,
    limits: &Limits,
) -> Result<std::borrow::Cow<'a, [u8]>> {
    let wrong_size =
        |found: u64| Err(Error::input(format!("{found} bytes of texels where {size} are needed")).at("level 0"));
    match scheme {
        None if data.len() as u64 == size => Ok(data.into()),
        None => wrong_size(data.len() as u64),
        Some(SupercompressionScheme::Zstandard) => {
            if size > limits.max_alloc {
                return Err(
                    Error::input(format!("{size} bytes, at most {} are allocated", limits.max_alloc)).at("level 0")
                );
            }
            let damaged = |error: Box<dyn std::error::Error + Send + Sync>| {
                Error::input("Zstandard data is damaged").caused_by(error).at("level 0")
            };
            let decoder =
                ruzstd::decoding::StreamingDecoder::new(data).map_err(|error| damaged(error.to_string().into()))?;
            let mut out = Vec::new();
            out.try_reserve_exact(size as usize + 1)
                .map_err(|error| Error::new(ErrorKind::OutOfMemory, format!("{size} bytes")).caused_by(error))?;
            // Whatever the frame says, no more than needed is unpacked.
            decoder.take(size + 1).read_to_end(&mut out).map_err(|error| damaged(error.into()))?;
            if out.len() as u64 == size { Ok(out.into()) } else { wrong_size(out.len() as u64) }
        }
        Some(scheme) => {
            Err(Error::input(format!("supercompression {scheme:?} is not read")).help("Use Zstandard, BasisLZ or none"))
        }
    }
}

/// How texels lie in memory. Values are taken as they are stored, sRGB or not: what they mean is for their use to say.
pub(super) enum Layout {
    Plain { channels: usize, kind: Kind, bgr: bool },
    Blocks(blocks::Codec),
}

#[derive(Clone, Copy)]
pub(super) enum Kind {
    U8,
    U16,
    F16,
    F32,
}

impl Kind {
    fn bytes(self) -> usize {
        match self {
            Self::U8 => 1,
            Self::U16 | Self::F16 => 2,
            Self::F32 => 4,
        }
    }

    /// To the nearest of 256 steps, clamped; NaN becomes 0.
    fn read(self, bytes: &[u8]) -> u8 {
        let nearest = |value: f32| (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
        match (self, bytes) {
            (Self::U8, &[byte]) => byte,
            (Self::U16, &[a, b]) => ((u32::from(u16::from_le_bytes([a, b])) * 255 + 32_767) / 65_535) as u8,
            (Self::F16, &[a, b]) => nearest(f16::from_le_bytes([a, b]).to_f32()),
            (Self::F32, &[a, b, c, d]) => nearest(f32::from_le_bytes([a, b, c, d])),
            _ => 0,
        }
    }
}

impl Layout {
    fn of(format: Format) -> Result<Self> {
        use blocks::Codec;
        let plain = |channels, kind| Self::Plain { channels, kind, bgr: false };
        Ok(match format {
            Format::R8_UNORM | Format::R8_SRGB => plain(1, Kind::U8),
            Format::R8G8_UNORM | Format::R8G8_SRGB => plain(2, Kind::U8),
            Format::R8G8B8_UNORM | Format::R8G8B8_SRGB => plain(3, Kind::U8),
            Format::R8G8B8A8_UNORM | Format::R8G8B8A8_SRGB => plain(4, Kind::U8),
            Format::B8G8R8_UNORM | Format::B8G8R8_SRGB => Self::Plain { channels: 3, kind: Kind::U8, bgr: true },
            Format::B8G8R8A8_UNORM | Format::B8G8R8A8_SRGB => Self::Plain { channels: 4, kind: Kind::U8, bgr: true },
            Format::R16_UNORM => plain(1, Kind::U16),
            Format::R16G16_UNORM => plain(2, Kind::U16),
            Format::R16G16B16_UNORM => plain(3, Kind::U16),
            Format::R16G16B16A16_UNORM => plain(4, Kind::U16),
            Format::R16_SFLOAT => plain(1, Kind::F16),
            Format::R16G16_SFLOAT => plain(2, Kind::F16),
            Format::R16G16B16_SFLOAT => plain(3, Kind::F16),
            Format::R16G16B16A16_SFLOAT => plain(4, Kind::F16),
            Format::R32_SFLOAT => plain(1, Kind::F32),
            Format::R32G32_SFLOAT => plain(2, Kind::F32),
            Format::R32G32B32_SFLOAT => plain(3, Kind::F32),
            Format::R32G32B32A32_SFLOAT => plain(4, Kind::F32),
            Format::BC1_RGB_UNORM_BLOCK | Format::BC1_RGB_SRGB_BLOCK => Self::Blocks(Codec::Bc1 { alpha: false }),
            Format::BC1_RGBA_UNORM_BLOCK | Format::BC1_RGBA_SRGB_BLOCK => Self::Blocks(Codec::Bc1 { alpha: true }),
            Format::BC3_UNORM_BLOCK | Format::BC3_SRGB_BLOCK => Self::Blocks(Codec::Bc3),
            Format::BC4_UNORM_BLOCK => Self::Blocks(Codec::Bc4),
            Format::BC5_UNORM_BLOCK => Self::Blocks(Codec::Bc5),
            Format::BC7_UNORM_BLOCK | Format::BC7_SRGB_BLOCK => Self::Blocks(Codec::Bc7),
            format => {
                return Err(Error::input(format!("KTX2 with the Vulkan format {format:?}"))
                    .help("Read are 8, 16 and 32-bit plain formats, BC1, BC3, BC4, BC5, BC7, and Basis Universal"));
            }
        })
    }

    pub(super) fn bytes(&self, width: u32, height: u32) -> u64 {
        match self {
            Self::Plain { channels, kind, .. } => {
                u64::from(width) * u64::from(height) * (channels * kind.bytes()) as u64
            }
            Self::Blocks(codec) => {
                u64::from(width.div_ceil(4)) * u64::from(height.div_ceil(4)) * codec.block_bytes() as u64
            }
        }
    }

    pub(super) fn decode(&self, width: u32, height: u32, data: &[u8]) -> Result<Vec<[u8; 4]>> {
        let mut rgba = texels(width as usize * height as usize)?;
        match self {
            Self::Plain { channels, kind, bgr } => {
                for (texel, stored) in rgba.iter_mut().zip(data.chunks_exact(channels * kind.bytes())) {
                    *texel = [0, 0, 0, 255];
                    for (value, bytes) in texel.iter_mut().zip(stored.chunks_exact(kind.bytes())) {
                        *value = kind.read(bytes);
                    }
                    if *bgr {
                        texel.swap(0, 2);
                    }
                }
            }
            Self::Blocks(codec) => {
                let across = width.div_ceil(4) as usize;
                for (i, block) in data.chunks_exact(codec.block_bytes()).enumerate() {
                    let decoded = codec.decode(block);
                    blocks::place(&decoded, 4 * (i % across), 4 * (i / across), width as usize, &mut rgba);
                }
            }
        }
        Ok(rgba)
    }
}

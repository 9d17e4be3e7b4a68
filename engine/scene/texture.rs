//! Images for materials: PNG, JPEG, WebP, BMP, TGA, DDS and KTX2 (plain, block compressed, Basis Universal) to 8-bit RGBA.
//!
//! Only the largest level is kept: mip levels are made on the device, where the use of the texture (sRGB or linear) is
//! known. Colour profiles, gamma chunks and EXIF orientation are ignored, as glTF 2.0 asks (section 3.9.4).

mod basis;
mod bc7;
mod blocks;
mod dds;
mod ktx;

use std::{
    io::Cursor,
    panic::{AssertUnwindSafe, catch_unwind},
};

use glam::{UVec2, uvec2};
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};

use super::{Limits, Texture};
use crate::{Error, ErrorKind, Result, image::check_size};

/// Decodes an image file to 8-bit RGBA, top row first, with the name left empty.
///
/// The first bytes say what it is; `mime_hint` only helps to word the error when they do not. Sizes are checked against
/// `limits` before anything is allocated. Errors say what is wrong; the caller names the file and the place
/// ([`Error::at`]).
pub fn decode(bytes: &[u8], mime_hint: Option<&str>, limits: &Limits) -> Result<Texture> {
    if bytes.len() as u64 > limits.max_file {
        return Err(Error::input(format!("{} bytes, at most {} are read", bytes.len(), limits.max_file)));
    }
    match Format::sniff(bytes) {
        Some(Format::Ktx2) => guarded("KTX2", || ktx::decode(bytes, limits)),
        Some(Format::Png) => guarded("PNG", || decode_plain(bytes, ImageFormat::Png, "PNG", limits)),
        Some(Format::Jpeg) => guarded("JPEG", || decode_plain(bytes, ImageFormat::Jpeg, "JPEG", limits)),
        Some(Format::WebP) => guarded("WebP", || decode_plain(bytes, ImageFormat::WebP, "WebP", limits)),
        Some(Format::Bmp) => guarded("BMP", || decode_plain(bytes, ImageFormat::Bmp, "BMP", limits)),
        Some(Format::Tga) => guarded("TGA", || decode_plain(bytes, ImageFormat::Tga, "TGA", limits)),
        Some(Format::Dds) => guarded("DDS", || dds::decode(bytes, limits)),
        None => {
            let start: Vec<String> = bytes.iter().take(4).map(|byte| format!("{byte:02x}")).collect();
            let said = mime_hint.map(|mime| format!(", said to be {mime}")).unwrap_or_default();
            let what = format!("{} bytes that start with [{}]{said}", bytes.len(), start.join(" "));
            Err(Error::input(what).help("Textures are PNG, JPEG, WebP, BMP, TGA, DDS or KTX2"))
        }
    }
}

/// Words for a part of the picture that is not in its bytes, although [`decode`] reads them.
pub(crate) fn missing(bytes: &[u8]) -> Option<&'static str> {
    (Format::sniff(bytes) == Some(Format::Jpeg) && crate::image::jpeg::is_cut(bytes))
        .then_some("the JPEG ends before its picture does; the rest is grey")
}

/// Bytes that a texture takes on the device as 8-bit RGBA: the base level and, with `mips`, all levels below it.
pub fn device_bytes(width: u32, height: u32, mips: bool) -> u64 {
    let (mut w, mut h) = (u64::from(width), u64::from(height));
    let mut bytes = 4 * w * h;
    while mips && w.max(h) > 1 {
        (w, h) = ((w / 2).max(1), (h / 2).max(1));
        bytes += 4 * w * h;
    }
    bytes
}

impl Texture {
    /// Bytes that it takes in this process's memory.
    pub fn host_bytes(&self) -> u64 {
        self.rgba.len() as u64 * 4
    }

    /// Bytes that it takes on the device with all mip levels.
    pub fn device_bytes(&self) -> u64 {
        device_bytes(self.width, self.height, true)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Png,
    Jpeg,
    WebP,
    Bmp,
    Tga,
    Dds,
    Ktx2,
}

impl Format {
    fn sniff(bytes: &[u8]) -> Option<Self> {
        match bytes {
            [0x89, b'P', b'N', b'G', 0x0d, 0x0a, 0x1a, 0x0a, ..] => Some(Self::Png),
            [0xff, 0xd8, 0xff, ..] => Some(Self::Jpeg),
            [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => Some(Self::WebP),
            _ if bytes.starts_with(&ktx2::MAGIC) => Some(Self::Ktx2),
            _ if bytes.starts_with(dds::MAGIC) => Some(Self::Dds),
            [b'B', b'M', ..] => Some(Self::Bmp),
            // TGA has no magic number: a colour map or none, a type, no origin of the map without a map, a usual depth.
            [_, map @ 0..=1, 1 | 2 | 3 | 9 | 10 | 11, a, b, ..]
                if bytes.get(16).is_some_and(|depth| [8, 15, 16, 24, 32].contains(depth))
                    && (*map == 1 || (*a, *b) == (0, 0)) =>
            {
                Some(Self::Tga)
            }
            _ => None,
        }
    }
}

/// Turns a panic inside a decoder of others into an error. Sizes are checked before; this is the last resort against
/// an index or an overflow that their authors missed: one damaged texture must not end the process.
fn guarded<T>(format: &str, decode: impl FnOnce() -> Result<T>) -> Result<T> {
    catch_unwind(AssertUnwindSafe(decode))
        .unwrap_or_else(|_| Err(Error::input(format!("damaged: the {format} decoder gave up"))))
}

/// The luma codes of a picture as 16 bits, top row first, and whether it has colours. `None`: its format has more than 16 bits, or blocks.
pub(super) fn luma(bytes: &[u8], limits: &Limits) -> Result<Option<(UVec2, Vec<u16>, bool)>> {
    let (format, name) = match Format::sniff(bytes) {
        Some(Format::Png) => (ImageFormat::Png, "PNG"),
        Some(Format::Jpeg) => (ImageFormat::Jpeg, "JPEG"),
        Some(Format::WebP) => (ImageFormat::WebP, "WebP"),
        Some(Format::Bmp) => (ImageFormat::Bmp, "BMP"),
        Some(Format::Tga) => (ImageFormat::Tga, "TGA"),
        Some(Format::Dds | Format::Ktx2) | None => return Ok(None),
    };
    guarded(name, || {
        let picture = plain(bytes, format, name, limits, 8)?;
        let color = picture.color().has_color();
        let codes = picture.into_luma16();
        Ok(Some((uvec2(codes.width(), codes.height()), codes.into_raw(), color)))
    })
}

fn decode_plain(bytes: &[u8], format: ImageFormat, name: &str, limits: &Limits) -> Result<Texture> {
    // The decoded samples and the RGBA texels stand side by side for a moment.
    let rgba = plain(bytes, format, name, limits, 4)?.into_rgba8();
    let (width, height) = rgba.dimensions();
    Ok(Texture { name: String::new(), width, height, rgba: rgba.into_raw().as_chunks::<4>().0.to_vec() })
}

/// Decodes a picture that takes `further` bytes a texel besides the samples.
fn plain(bytes: &[u8], format: ImageFormat, name: &str, limits: &Limits, further: u64) -> Result<DynamicImage> {
    let damaged = |error| match error {
        image::ImageError::Limits(limit) => Error::input(format!("{name} over the limits")).caused_by(limit),
        error => Error::input(format!("{name} decoding failed")).caused_by(error),
    };
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut decoder_limits = image::Limits::default();
    decoder_limits.max_alloc = Some(limits.max_alloc);
    reader.limits(decoder_limits);
    let decoder = reader.into_decoder().map_err(damaged)?;
    let (width, height) = decoder.dimensions();
    let per_texel = further + u64::from(decoder.color_type().bytes_per_pixel());
    check_size(width.into(), height.into(), per_texel, limits)?;
    DynamicImage::from_decoder(decoder).map_err(damaged)
}

/// `count` texels to fill, or an error where `vec!` would abort.
fn texels(count: usize) -> Result<Vec<[u8; 4]>> {
    let mut list = Vec::new();
    list.try_reserve_exact(count)
        .map_err(|error| Error::new(ErrorKind::OutOfMemory, format!("{count} texels")).caused_by(error))?;
    list.resize(count, [0; 4]);
    Ok(list)
}

#[cfg(test)]
mod tests;

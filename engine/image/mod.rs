//! Linear images in and out, with the metadata that makes them reproducible.
//!
//! [`Layers`] are a stack of images of one size, each a [`Layer`]. Files: OpenEXR (all layers), Radiance .hdr, PFM, PNG and JPEG (one layer).
//!
//! Pixels are linear Rec. 709, top row first, and upright (EXIF orientation is applied); sRGB encoding ([`srgb`]) happens only in PNG and
//! JPEG files.
//!
//! Colour is premultiplied by alpha, as in OpenEXR: it is what is seen over black, and a pixel of alpha 0 may shine. PNG files hold it
//! unassociated: what is read of a pixel of alpha 0 is black, whatever colour the file hides there, and a picture with light at alpha 0 is
//! written as it is seen over black, without alpha ([`Report::alpha_left_out`]).
//!
//! Everything is encoded in memory and then written by [`write_atomic`]: a file is complete or not there.

mod bc4;
mod bc6h;
mod color;
mod encoding;
mod exr_chroma;
mod exr_luminance;
mod exr_read;
mod exr_write;
mod file;
pub(crate) mod jpeg;
mod ktx2_file;
mod metadata;
mod orientation;
mod pfm;
mod picture;
mod png_file;
mod probe;
mod radiance;
mod sidecar;
pub mod srgb;

use std::path::Path;

pub use bc4::{decode_bc4, encode_bc4};
pub use bc6h::{Bc6h, decode_bc6h, encode_bc6h};
pub use color::{Chromaticities, REC_709};
pub use file::{
    is_temporary, leave_nothing_unfinished, probe_output, read_file_checked, read_head_checked, read_text_checked,
    write_all_atomic, write_atomic, write_pieces_atomic,
};
pub use ktx2_file::{Ktx2Format, encode_ktx2, encode_ktx2_cube, level_extent};
pub use metadata::Metadata;
pub use picture::{Layer, Layers, Precision};
pub use probe::from_angular_map;

use crate::{Error, ErrorKind, Result, limits::Limits};

/// How to write.
#[derive(Clone, Debug, PartialEq)]
pub struct WriteOptions {
    /// Replace an existing file.
    pub overwrite: bool,
    /// 8 or 16 bits a channel in PNG files.
    pub png_bits: u8,
    /// 1 (small) to 100 (fine), for JPEG files.
    pub jpeg_quality: u8,
    /// PNG and JPEG files show the radiance times 2^EV.
    pub exposure_ev: f32,
    /// Codes of PNG and JPEG files are light to the power of 1/gamma; `None`: the sRGB curve. PNG files say it.
    pub gamma: Option<f32>,
    /// All layers of EXR files in 32 bits.
    pub f32: bool,
    /// PNG files have the alpha of the layer even if it hides light, see [`Report::alpha_left_out`].
    pub keep_alpha: bool,
    /// The layer for formats that hold one; `None`: the picture ([`Layers::main`]).
    pub layer: Option<String>,
}

impl Default for WriteOptions {
    fn default() -> Self {
        Self {
            overwrite: false,
            png_bits: 8,
            jpeg_quality: 92,
            exposure_ev: 0.0,
            gamma: None,
            f32: false,
            keep_alpha: false,
            layer: None,
        }
    }
}

/// What was odd about the values of a written image. EXR and PFM files keep NaN, infinity and negative values; .hdr
/// files write NaN and negative values as 0 and infinity as their largest value; PNG and JPEG files clamp.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Report {
    /// Samples that are not a number.
    pub nan: u64,
    /// Infinite samples.
    pub infinite: u64,
    /// Negative samples in colour channels.
    pub negative: u64,
    /// Finite samples too large for 16 bits, written as 65504.
    pub overflow: u64,
    /// The PNG file has no alpha, which the layer has: more than a hundredth of its light stands where alpha is 0 (flames, glows), and viewers
    /// would not have shown it.
    pub alpha_left_out: bool,
    /// Where the first NaN or infinity stands: `layer "direct", pixel (3, 4), channel G`.
    pub first: Option<String>,
}

impl Report {
    /// Whether every sample is finite.
    pub fn is_finite(&self) -> bool {
        self.nan == 0 && self.infinite == 0
    }

    /// Unusual samples of these layers, whose rows have `width` pixels.
    pub fn count(layers: &[&Layer], width: u32) -> Self {
        let mut report = Self::default();
        for layer in layers {
            let channels = layer.channels.len().max(1);
            let colour: Vec<bool> = layer.channels.iter().map(|c| matches!(c.as_str(), "R" | "G" | "B")).collect();
            for (i, value) in layer.data.iter().enumerate() {
                if value.is_finite() {
                    report.negative += u64::from(*value < 0.0 && colour[i % channels]);
                    continue;
                }
                *if value.is_nan() { &mut report.nan } else { &mut report.infinite } += 1;
                report.first.get_or_insert_with(|| {
                    let (pixel, channel) = (i / channels, &layer.channels[i % channels]);
                    let (x, y) = (pixel % width as usize, pixel / width as usize);
                    format!("layer {:?}, pixel ({x}, {y}), channel {channel}", layer.name)
                });
            }
        }
        report
    }
}

/// The formats, by file name extension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    Exr,
    Hdr,
    Pfm,
    Png,
    Jpeg,
}

impl Format {
    /// From the extension of a path, in any case.
    pub fn from_path(path: &Path) -> Result<Self> {
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
        match extension.as_str() {
            "exr" => Ok(Self::Exr),
            "hdr" | "pic" | "rgbe" => Ok(Self::Hdr),
            "pfm" => Ok(Self::Pfm),
            "png" => Ok(Self::Png),
            "jpg" | "jpeg" => Ok(Self::Jpeg),
            _ => Err(Error::usage(format!("the extension {extension:?} names no image format"))
                .in_file(path)
                .help("Images are .exr, .hdr, .pfm, .png or .jpg")),
        }
    }

    /// From the first bytes, which is more reliable than a name.
    pub fn sniff(bytes: &[u8]) -> Option<Self> {
        match bytes {
            [0x76, 0x2f, 0x31, 0x01, ..] => Some(Self::Exr),
            [0x89, b'P', b'N', b'G', ..] => Some(Self::Png),
            [b'P', b'F' | b'f', b' ' | b'\n' | b'\r' | b'\t', ..] => Some(Self::Pfm),
            _ if jpeg::sniff(bytes) => Some(Self::Jpeg),
            _ if radiance::sniff(bytes) => Some(Self::Hdr),
            _ => None,
        }
    }
}

/// Writes an image in the format of its extension, atomically ([`write_atomic`]).
///
/// EXR files get all layers; the others one ([`WriteOptions::layer`]). The metadata goes into EXR attributes, a PNG text
/// chunk, comments of .hdr and JPEG files; PFM has no place for it, so it stands beside the file as `NAME.pfm.json` ([`metadata`]).
/// Errors name the file; nothing is left behind.
pub fn write(path: impl AsRef<Path>, picture: &Layers, options: &WriteOptions) -> Result<Report> {
    let path = path.as_ref();
    let format = Format::from_path(path)?;
    let (bytes, report) = encode(format, picture, options).map_err(|error| error.in_file(path))?;
    let beside = match format {
        Format::Pfm if !picture.metadata.is_empty() => Some(sidecar::encode(&bytes, &picture.metadata)?),
        _ => None,
    };
    write_atomic(path, &bytes, options.overwrite)?;
    if let Some(text) = beside {
        // After the image: whenever the process dies, text that is there belongs to an image that is there, or says
        // of which other bytes it speaks.
        write_atomic(&sidecar::path(path), text.as_bytes(), true)?;
    }
    Ok(report)
}

/// The bytes that [`write()`] writes. The same image gives the same bytes.
pub fn encode(format: Format, picture: &Layers, options: &WriteOptions) -> Result<(Vec<u8>, Report)> {
    picture.validate()?;
    let all: Vec<&Layer> = picture.layers.iter().collect();
    let chosen = match &options.layer {
        None => picture.main(),
        Some(name) => Some(picture.layer(name).ok_or_else(|| {
            let names: Vec<&str> = all.iter().map(|layer| layer.name.as_str()).collect();
            Error::usage(format!("no layer {name:?}; there are {names:?}"))
        })?),
    };
    let Some(one) = chosen else { return Err(Error::usage("an image without layers")) };
    let mut report =
        Report::count(if format == Format::Exr { &all } else { std::slice::from_ref(&one) }, picture.width);
    let bytes = match format {
        Format::Exr => exr_write::encode(picture, options.f32, &mut report)?,
        Format::Hdr => radiance::encode(picture, one)?,
        Format::Pfm => pfm::encode(picture, one)?,
        Format::Png => png_file::encode(picture, one, options, &mut report)?,
        Format::Jpeg => jpeg::encode(picture, one, options)?,
    };
    Ok((bytes, report))
}

/// The codes that a PNG file of this layer with eight bits has, for windows: red, green and blue of each pixel, row by row from the upper left corner,
/// without alpha.
///
/// # Errors
/// `Usage` if the layer has two or more than four channels.
pub fn screen(layer: &Layer, options: &WriteOptions) -> Result<Vec<[u8; 3]>> {
    png_file::screen(layer, options)
}

/// Reads an image file of any of the formats, whatever its name. Errors name the file and the place in it.
pub fn read(path: impl AsRef<Path>, limits: &Limits) -> Result<Layers> {
    let path = path.as_ref();
    let bytes = read_file_checked(path, limits.max_file)?;
    let mut picture = decode(&bytes, limits).map_err(|error| error.in_file(path))?;
    if Format::sniff(&bytes) == Some(Format::Pfm) {
        // Text of another image does not make this one unreadable; `metadata` says what is wrong with it.
        picture.metadata = sidecar::read(path, &bytes).unwrap_or_default();
    }
    Ok(picture)
}

/// As [`read`], from memory.
pub fn decode(bytes: &[u8], limits: &Limits) -> Result<Layers> {
    match Format::sniff(bytes) {
        Some(Format::Exr) => exr_read::decode(bytes, limits),
        Some(Format::Hdr) => radiance::decode(bytes, limits),
        Some(Format::Pfm) => pfm::decode(bytes, limits),
        Some(Format::Png) => png_file::decode(bytes, limits),
        Some(Format::Jpeg) => jpeg::decode(bytes, limits),
        None => Err(unknown()),
    }
}

/// Reads only the metadata. Images of other programs give their header texts in [`Metadata::extra`].
pub fn metadata(path: impl AsRef<Path>) -> Result<Metadata> {
    let path = path.as_ref();
    let bytes = read_file_checked(path, Limits::default().max_file)?;
    let metadata = match Format::sniff(&bytes) {
        Some(Format::Exr) => exr_read::metadata(&bytes),
        Some(Format::Hdr) => radiance::metadata(&bytes),
        Some(Format::Png) => png_file::metadata(&bytes, &Limits::default()),
        Some(Format::Pfm) => return sidecar::read(path, &bytes),
        Some(Format::Jpeg) => jpeg::metadata(&bytes),
        None => Err(unknown()),
    };
    metadata.map_err(|error| error.in_file(path))
}

fn unknown() -> Error {
    Error::input("no image format that is known here").help("Images are .exr, .hdr, .pfm, .png or .jpg")
}

/// Whether the bytes of an image file hold codes of a screen (PNG, JPEG), in which white is 1; others hold light of any range.
pub fn is_display_referred(bytes: &[u8]) -> bool {
    matches!(Format::sniff(bytes), Some(Format::Png | Format::Jpeg))
}

/// Checks `width · height` pixels of `bytes_per_pixel` against the limits, before anything is allocated.
pub(crate) fn check_size(width: u64, height: u64, bytes_per_pixel: u64, limits: &Limits) -> Result<usize> {
    if width == 0 || height == 0 {
        return Err(Error::input(format!("an image of {width}×{height} pixels")));
    }
    let pixels = width.checked_mul(height).filter(|&pixels| pixels <= limits.max_image_pixels).ok_or_else(|| {
        Error::input(format!("{width}×{height} pixels, at most {} are read", limits.max_image_pixels))
    })?;
    let bytes = pixels.checked_mul(bytes_per_pixel).filter(|&bytes| bytes <= limits.max_alloc).ok_or_else(|| {
        let need = u128::from(pixels) * u128::from(bytes_per_pixel);
        Error::input(format!("{width}×{height} pixels take {need} bytes, at most {} are allocated", limits.max_alloc))
    })?;
    usize::try_from(bytes).map_err(|_| Error::input("an image too large for this machine"))
}

/// A zeroed list, or an error where `vec!` would abort.
pub(crate) fn zeroed(values: usize) -> Result<Vec<f32>> {
    let mut list = Vec::new();
    list.try_reserve_exact(values)
        .map_err(|error| Error::new(ErrorKind::OutOfMemory, format!("{values} values")).caused_by(error))?;
    list.resize(values, 0.0);
    Ok(list)
}

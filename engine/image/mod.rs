//! Linear images in and out, with the metadata that makes them reproducible.
//!
//! An image is a stack of [`Layer`]s of one size. Files: OpenEXR (all layers), Radiance .hdr, PFM and PNG (one layer).
//! Pixels are linear Rec. 709, top row first; sRGB encoding ([`srgb`]) happens only in PNG files. Colour is
//! premultiplied by alpha, as in OpenEXR; PNG files hold it unassociated.
//!
//! Everything is encoded in memory and then written by [`write_atomic`]: a file is complete or not there.

mod color;
mod exr_read;
mod exr_write;
mod file;
mod metadata;
mod pfm;
mod png_file;
mod radiance;
pub mod srgb;

use std::path::Path;

pub use color::{Chromaticities, REC_709};
pub use file::{probe_output, read_file_checked, write_atomic};
pub use metadata::Metadata;

use crate::{Error, ErrorKind, Result, scene::Limits};

/// Layers of one size and how they were made.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layers {
    pub width: u32,
    pub height: u32,
    pub layers: Vec<Layer>,
    pub metadata: Metadata,
}

/// One named image of some channels.
///
/// Names of the engine: `""` (RGBA, the picture), `direct`, `indirect`, `albedo` (RGB), `normal`, `position` (X Y Z),
/// `occlusion` (Y), `depth` (Z, eye-space metres; stored as the plain channel `Z` in EXR).
#[derive(Clone, PartialEq)]
pub struct Layer {
    pub name: String,
    /// `R G B A`, `R G B`, `X Y Z`, `Y`, `Z`…
    pub channels: Vec<String>,
    /// `width · height · channels` values, interleaved, top row first.
    pub data: Vec<f32>,
    pub precision: Precision,
}

impl std::fmt::Debug for Layer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "Layer({:?}, {}, {} values, {:?})",
            self.name,
            self.channels.join(""),
            self.data.len(),
            self.precision
        )
    }
}

/// Precision of a layer in EXR files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// 16 bits: enough for colour.
    #[default]
    Half,
    /// 32 bits: for depth and position.
    Full,
}

impl Layer {
    /// A layer of interleaved values; half precision for colour and `Y`, full for all else.
    pub fn new(name: impl Into<String>, channels: &[&str], data: Vec<f32>) -> Self {
        let colour = channels.iter().all(|c| matches!(*c, "R" | "G" | "B" | "A")) || channels == ["Y"];
        Self {
            name: name.into(),
            channels: channels.iter().map(|&c| c.to_owned()).collect(),
            data,
            precision: if colour { Precision::Half } else { Precision::Full },
        }
    }

    /// A colour layer from pixels of three or more values, of which the first three are taken.
    pub fn rgb<const N: usize>(name: impl Into<String>, pixels: &[[f32; N]]) -> Self {
        const { assert!(N >= 3) };
        Self::new(name, &["R", "G", "B"], pixels.iter().flat_map(|p| [p[0], p[1], p[2]]).collect())
    }

    /// A colour layer with alpha.
    pub fn rgba(name: impl Into<String>, pixels: &[[f32; 4]]) -> Self {
        Self::new(name, &["R", "G", "B", "A"], pixels.as_flattened().to_vec())
    }

    /// Position of a channel, if there is one of that name.
    pub fn channel(&self, name: &str) -> Option<usize> {
        self.channels.iter().position(|c| c == name)
    }

    /// Three values a pixel: R G B, or X Y Z, or a single channel three times. `None` for anything else.
    pub fn rgb_pixels(&self) -> Option<Vec<[f32; 3]>> {
        let find = |names: [&str; 3]| -> Option<[usize; 3]> {
            Some([self.channel(names[0])?, self.channel(names[1])?, self.channel(names[2])?])
        };
        let single = || (self.channels.len() == 1).then_some([0; 3]);
        let [r, g, b] =
            find(["R", "G", "B"]).or_else(|| find(["X", "Y", "Z"])).or_else(single).or_else(|| self.luminance())?;
        Some(self.data.chunks_exact(self.channels.len()).map(|p| [p[r], p[g], p[b]]).collect())
    }

    /// Luminance with alpha, as grey.
    fn luminance(&self) -> Option<[usize; 3]> {
        (self.channels.len() == 2 && self.channel("A").is_some()).then(|| self.channel("Y"))?.map(|y| [y; 3])
    }
}

impl Layers {
    /// No layers yet.
    pub fn new(width: u32, height: u32) -> Self {
        Self { width, height, ..Self::default() }
    }

    /// A picture: `data` is `width · height · 3` values.
    pub fn rgb(width: u32, height: u32, data: Vec<f32>) -> Self {
        Self::new(width, height).with(Layer::new("", &["R", "G", "B"], data))
    }

    /// A picture with premultiplied alpha: `data` is `width · height · 4` values.
    pub fn rgba(width: u32, height: u32, data: Vec<f32>) -> Self {
        Self::new(width, height).with(Layer::new("", &["R", "G", "B", "A"], data))
    }

    /// With one more layer.
    #[must_use]
    pub fn with(mut self, layer: Layer) -> Self {
        self.layers.push(layer);
        self
    }

    /// The layer of that name.
    pub fn layer(&self, name: &str) -> Option<&Layer> {
        self.layers.iter().find(|layer| layer.name == name)
    }

    /// The picture: the unnamed layer, else the first colour layer, else the first.
    pub fn main(&self) -> Option<&Layer> {
        self.layer("")
            .or_else(|| self.layers.iter().find(|layer| layer.channel("R").is_some()))
            .or_else(|| self.layers.first())
    }

    /// Sizes match, names are unique and can be written.
    pub fn validate(&self) -> Result<()> {
        let wrong = |what: String| Err(Error::new(ErrorKind::Usage, what));
        if self.width == 0 || self.height == 0 || self.layers.is_empty() {
            return wrong(format!(
                "an image of {}×{} with {} layers has no pixels",
                self.width,
                self.height,
                self.layers.len()
            ));
        }
        let mut names = std::collections::BTreeSet::new();
        for layer in &self.layers {
            let values = u64::from(self.width) * u64::from(self.height) * layer.channels.len() as u64;
            if layer.data.len() as u64 != values || values == 0 {
                let found = layer.data.len();
                return wrong(format!("layer {:?} has {found} values where {values} are needed", layer.name));
            }
            for channel in &layer.channels {
                let name = exr_write::channel_name(&layer.name, channel);
                if channel.is_empty() || channel.contains('.') || name.len() > 255 || name.bytes().any(|b| b == 0) {
                    return wrong(format!("{name:?} cannot be the name of a channel"));
                }
                if !names.insert(name) {
                    return wrong(format!("layer {:?} has the channel {channel:?} twice", layer.name));
                }
            }
        }
        Ok(())
    }
}

/// How to write.
#[derive(Clone, Debug, PartialEq)]
pub struct WriteOptions {
    /// Replace an existing file.
    pub overwrite: bool,
    /// 8 or 16 bits a channel in PNG files.
    pub png_bits: u8,
    /// PNG files show the radiance times 2^EV.
    pub exposure_ev: f32,
    /// All layers of EXR files in 32 bits.
    pub f32: bool,
}

impl Default for WriteOptions {
    fn default() -> Self {
        Self { overwrite: false, png_bits: 8, exposure_ev: 0.0, f32: false }
    }
}

/// What was odd about the values of a written image. EXR and PFM files keep NaN, infinity and negative values; .hdr
/// files write NaN and negative values as 0 and infinity as their largest value; PNG files clamp.
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
    /// Where the first NaN or infinity stands: `layer "direct", pixel (3, 4), channel G`.
    pub first: Option<String>,
}

impl Report {
    /// Whether every sample is finite.
    pub fn is_finite(&self) -> bool {
        self.nan == 0 && self.infinite == 0
    }

    fn count(layers: &[&Layer], width: u32) -> Self {
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
            _ => Err(Error::usage(format!("the extension {extension:?} names no image format"))
                .in_file(path)
                .help("Images are .exr, .hdr, .pfm or .png")),
        }
    }

    /// From the first bytes, which is more reliable than a name.
    pub fn sniff(bytes: &[u8]) -> Option<Self> {
        match bytes {
            [0x76, 0x2f, 0x31, 0x01, ..] => Some(Self::Exr),
            [0x89, b'P', b'N', b'G', ..] => Some(Self::Png),
            [b'P', b'F' | b'f', b' ' | b'\n' | b'\r' | b'\t', ..] => Some(Self::Pfm),
            _ if radiance::sniff(bytes) => Some(Self::Hdr),
            _ => None,
        }
    }
}

/// Writes an image in the format of its extension, atomically.
///
/// EXR files get all layers; the others the picture ([`Layers::main`]). Errors name the file; nothing is left behind.
pub fn write(path: &Path, layers: &Layers, options: &WriteOptions) -> Result<Report> {
    let format = Format::from_path(path)?;
    let (bytes, report) = encode(format, layers, options).map_err(|error| error.in_file(path))?;
    write_atomic(path, &bytes, options.overwrite)?;
    Ok(report)
}

/// The bytes that [`write`] writes. The same image gives the same bytes.
pub fn encode(format: Format, layers: &Layers, options: &WriteOptions) -> Result<(Vec<u8>, Report)> {
    layers.validate()?;
    let all: Vec<&Layer> = layers.layers.iter().collect();
    let Some(main) = layers.main() else { return Err(Error::usage("an image without layers")) };
    let mut report =
        Report::count(if format == Format::Exr { &all } else { std::slice::from_ref(&main) }, layers.width);
    let bytes = match format {
        Format::Exr => exr_write::encode(layers, options.f32, &mut report)?,
        Format::Hdr => radiance::encode(layers, main)?,
        Format::Pfm => pfm::encode(layers, main)?,
        Format::Png => png_file::encode(layers, main, options)?,
    };
    Ok((bytes, report))
}

/// Reads an image file of any of the formats, whatever its name. Errors name the file and the place in it.
pub fn read(path: impl AsRef<Path>, limits: &Limits) -> Result<Layers> {
    let path = path.as_ref();
    let bytes = read_file_checked(path, limits.max_file)?;
    decode(&bytes, limits).map_err(|error| error.in_file(path))
}

/// As [`read`], from memory.
pub fn decode(bytes: &[u8], limits: &Limits) -> Result<Layers> {
    match Format::sniff(bytes) {
        Some(Format::Exr) => exr_read::decode(bytes, limits),
        Some(Format::Hdr) => radiance::decode(bytes, limits),
        Some(Format::Pfm) => pfm::decode(bytes, limits),
        Some(Format::Png) => png_file::decode(bytes, limits),
        None => Err(Error::input("no image format that is known here").help("Images are .exr, .hdr, .pfm or .png")),
    }
}

/// Reads only the metadata. Images of other programs give their header texts in [`Metadata::extra`].
pub fn read_metadata(path: impl AsRef<Path>) -> Result<Metadata> {
    let path = path.as_ref();
    let bytes = read_file_checked(path, Limits::default().max_file)?;
    let metadata = match Format::sniff(&bytes) {
        Some(Format::Exr) => exr_read::metadata(&bytes),
        Some(Format::Hdr) => radiance::metadata(&bytes),
        Some(Format::Png) => png_file::metadata(&bytes, &Limits::default()),
        Some(Format::Pfm) => Err(Error::input("PFM files carry no metadata").help("Write EXR, PNG or .hdr files")),
        None => Err(Error::input("no image format that is known here")),
    };
    metadata.map_err(|error| error.in_file(path))
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

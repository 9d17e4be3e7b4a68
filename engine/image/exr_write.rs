//! OpenEXR files out: one part, all layers as `layer.channel`, ZIP.
//!
//! One part and not several, because `layer.channel` in one part is the form that most programs read.

use std::io::Cursor;

use exr::{
    image::{AnyChannel, AnyChannels, Blocks, Encoding, FlatSamples, Image, Layer as ExrLayer},
    math::Vec2,
    meta::{
        attribute::{Chromaticities as ExrChromaticities, LineOrder, Text},
        header::{ImageAttributes, LayerAttributes},
    },
    prelude::{Compression, SmallVec, WritableImage, f16},
};

use super::{Layer, Layers, Metadata, Precision, REC_709, Report};
use crate::{Error, ErrorKind, Result};

/// Attribute with the whole metadata as JSON.
pub(super) const JSON: &str = "lucerna";
/// Attributes with single values, for people: `lucerna.scene`.
pub(super) const PREFIX: &str = "lucerna.";

/// Name of a channel in the file. The picture itself and depth have plain names, which all programs know.
pub(super) fn channel_name(layer: &str, channel: &str) -> String {
    match (layer, channel) {
        ("" | "total", _) | ("depth", "Z") => channel.to_owned(),
        _ => format!("{layer}.{channel}"),
    }
}

/// Adds finite values that 16 bits cannot hold to `report`.
pub(super) fn encode(picture: &Layers, full: bool, report: &mut Report) -> Result<Vec<u8>> {
    let size = Vec2(picture.width as usize, picture.height as usize);
    let mut channels = SmallVec::new();
    for layer in &picture.layers {
        for (k, channel) in layer.channels.iter().enumerate() {
            let name = channel_name(&layer.name, channel);
            let name = Text::new_or_none(&name)
                .ok_or_else(|| Error::usage(format!("{name:?} cannot be the name of a channel in EXR files")))?;
            channels.push(AnyChannel::new(name, samples(layer, k, full, report)));
        }
    }
    let vec2 = |[x, y]: [f32; 2]| Vec2(x, y);
    let chromaticities = ExrChromaticities {
        red: vec2(REC_709.red),
        green: vec2(REC_709.green),
        blue: vec2(REC_709.blue),
        white: vec2(REC_709.white),
    };
    let metadata = &picture.metadata;
    let attributes = LayerAttributes {
        world_to_camera: metadata.world_to_camera,
        world_to_normalized_device: metadata.world_to_ndc,
        ..LayerAttributes::default()
    };
    let encoding =
        Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let layer = ExrLayer::new(size, attributes, encoding, AnyChannels::sort(channels));
    let image = Image {
        attributes: ImageAttributes { chromaticities: Some(chromaticities), ..ImageAttributes::with_size(size) },
        layer_data: layer,
    };
    let fail = |error: exr::error::Error| Error::new(ErrorKind::Runtime, "EXR encoding failed").caused_by(error);
    let mut out = Cursor::new(Vec::new());
    image.write().to_buffered(&mut out).map_err(fail)?;
    let bytes = out.into_inner();
    if metadata.is_empty() { Ok(bytes) } else { insert_attributes(&bytes, &attribute_bytes(metadata)?) }
}

fn samples(layer: &Layer, channel: usize, full: bool, report: &mut Report) -> FlatSamples {
    let values = layer.data.iter().skip(channel).step_by(layer.channels.len()).copied();
    if full || layer.precision == Precision::Full {
        return FlatSamples::F32(values.collect());
    }
    let halves = values.map(|value| {
        let half = f16::from_f32(value);
        if half.is_infinite() && value.is_finite() {
            report.overflow += 1;
            return if value > 0.0 { f16::MAX } else { f16::MIN };
        }
        half
    });
    FlatSamples::F16(halves.collect())
}

/// String attributes in the file's own form: name, type, size, value.
fn attribute_bytes(metadata: &Metadata) -> Result<Vec<u8>> {
    let mut out = Vec::new();
    let mut put = |name: &str, value: &str| {
        out.extend_from_slice(name.as_bytes());
        out.extend_from_slice(b"\0string\0");
        out.extend_from_slice(&(value.len() as u32).to_le_bytes());
        out.extend_from_slice(value.as_bytes());
    };
    put(JSON, &metadata.to_json()?);
    for (name, value) in metadata.singles() {
        put(&format!("{PREFIX}{name}"), &value);
    }
    Ok(out)
}

/// Puts attributes in front of the header's own and moves the chunk offsets along.
///
/// The crate keeps attributes of others in a hash map and writes them in its order, which is another one in every
/// process: the same picture would not give the same bytes.
fn insert_attributes(file: &[u8], attributes: &[u8]) -> Result<Vec<u8>> {
    let broken = || Error::new(ErrorKind::Runtime, "EXR encoding gave a header that cannot be read");
    let table = header_end(file).ok_or_else(broken)?;
    let offset = |at: usize| Some(u64::from_le_bytes(*file.get(at..)?.first_chunk()?));
    let chunks = offset(table).and_then(|first| usize::try_from(first).ok()).ok_or_else(broken)?;
    let entries = file.get(table..chunks).ok_or_else(broken)?;
    let mut out = Vec::with_capacity(file.len() + attributes.len());
    out.extend_from_slice(&file[..ATTRIBUTES]);
    out.extend_from_slice(attributes);
    out.extend_from_slice(&file[ATTRIBUTES..table]);
    for entry in entries.as_chunks::<8>().0 {
        out.extend_from_slice(&(u64::from_le_bytes(*entry) + attributes.len() as u64).to_le_bytes());
    }
    out.extend_from_slice(&file[chunks..]);
    Ok(out)
}

/// Where the attributes of the first part begin: after magic number and version.
const ATTRIBUTES: usize = 8;

/// Where the offset table of a file of one part begins: after its attributes and their end mark.
pub(super) fn header_end(file: &[u8]) -> Option<usize> {
    let mut at = ATTRIBUTES;
    while *file.get(at)? != 0 {
        at = attribute(file, at)?.1;
    }
    Some(at + 1)
}

/// An attribute of a header as the file has it.
pub(super) struct Attribute<'a> {
    pub(super) name: &'a [u8],
    pub(super) kind: &'a [u8],
    pub(super) value: &'a [u8],
}

/// The attributes of all parts, as far as they are whole.
pub(super) fn attributes(file: &[u8]) -> impl Iterator<Item = Attribute<'_>> {
    const MULTI_PART: u32 = 1 << 12;
    let flags = file.get(4..).and_then(<[u8]>::first_chunk).map_or(0, |flags| u32::from_le_bytes(*flags));
    let mut at = ATTRIBUTES;
    std::iter::from_fn(move || {
        // The header of a part ends with a zero, and all headers of a file of several parts with another.
        if flags & MULTI_PART != 0 && file.get(at) == Some(&0) {
            at += 1;
        }
        let (found, next) = attribute(file, at)?;
        at = next;
        Some(found)
    })
}

/// The attribute at a place, and where the next begins. `None` at an end mark, or if it is cut short.
fn attribute(file: &[u8], at: usize) -> Option<(Attribute<'_>, usize)> {
    let text = |from: usize| {
        let bytes = file.get(from..)?;
        bytes.get(..bytes.iter().position(|&b| b == 0)?).filter(|text| !text.is_empty())
    };
    let name = text(at)?;
    let kind = text(at + name.len() + 1)?;
    let size = at + name.len() + kind.len() + 2;
    let bytes = u32::from_le_bytes(*file.get(size..)?.first_chunk()?) as usize;
    let next = (size + 4).checked_add(bytes)?;
    Some((Attribute { name, kind, value: file.get(size + 4..next)? }, next))
}

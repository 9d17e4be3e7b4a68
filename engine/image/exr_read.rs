//! OpenEXR files in: all parts and layers, scan lines and tiles, the largest level, all compressions of the `exr` crate.
//!
//! Chunks are decoded into our own planes, allocated after all sizes were checked: what a header says is never believed
//! before.

use std::{
    io::Cursor,
    panic::{AssertUnwindSafe, catch_unwind},
};

use exr::{
    block::{UncompressedBlock, reader::ChunksReader, reader::Reader},
    meta::{
        BlockDescription, MetaData,
        attribute::{AttributeValue, ChannelDescription, EnvironmentMap, SampleType},
        header::Header,
    },
    prelude::f16,
};

use super::{
    Chromaticities, Layer, Layers, Metadata, Precision, REC_709, check_size, exr_chroma, exr_luminance,
    exr_write::{self, JSON, PREFIX},
    zeroed,
};
use crate::{Error, Result, limits::Limits};

/// Channels of all parts together. Cryptomatte files have a few dozen.
const MAX_CHANNELS: usize = 1024;

pub(super) fn decode(bytes: &[u8], limits: &Limits) -> Result<Layers> {
    guarded(|| decode_unguarded(bytes, limits))
}

pub(super) fn metadata(bytes: &[u8]) -> Result<Metadata> {
    guarded(|| read_metadata(&headers(bytes)?))
}

/// Turns a panic inside the decoder into an error. All sizes are checked before; this is the last resort against an
/// index or an overflow in its decompression (there are known ones), so that one damaged file cannot end the process.
fn guarded<T>(decode: impl FnOnce() -> Result<T>) -> Result<T> {
    catch_unwind(AssertUnwindSafe(decode)).unwrap_or_else(|_| Err(Error::input("damaged: the EXR decoder gave up")))
}

fn damaged(error: exr::error::Error) -> Error {
    Error::input("damaged or not served").caused_by(error)
}

/// Bit of the version field: some part holds a list of samples at each pixel.
const DEEP: u32 = 1 << 11;

fn headers(bytes: &[u8]) -> Result<Vec<Header>> {
    if bytes.get(4..).and_then(<[u8]>::first_chunk).is_some_and(|flags| u32::from_le_bytes(*flags) & DEEP != 0) {
        return Err(Error::input("deep pixels (a list of samples at each pixel) are not read").at("header").help(
            "Flatten the image first, in the program that made it or with `oiiotool IN.exr --flatten -o OUT.exr`",
        ));
    }
    check_compressions(bytes)?;
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|error| damaged(error).at("header"))?;
    Ok(meta.headers.into_vec())
}

/// Compressions from 10 on, none of which is read: `Compression` in ImfCompression.h of OpenEXR 3.5.
const NEWER_COMPRESSIONS: [&str; 4] = ["HTJ2K256", "HTJ2K32", "LJ2K", "ZSTD"];

/// Names a compression that is not read, before the decoder calls it damaged or unknown.
fn check_compressions(bytes: &[u8]) -> Result<()> {
    for attribute in exr_write::attributes(bytes) {
        let Some(newer) = attribute.value.first().and_then(|number| number.checked_sub(10)) else { continue };
        if attribute.name != b"compression" || attribute.kind != b"compression" {
            continue;
        }
        let name = NEWER_COMPRESSIONS.get(usize::from(newer)).copied().unwrap_or("newer than what is known here");
        let what = format!("compression {} ({name}) is not read", newer + 10);
        return Err(Error::input(what)
            .at("header.compression")
            .help("Convert the file with a program that knows it: `oiiotool IN.exr --compression zip -o OUT.exr`"));
    }
    Ok(())
}

/// Where the samples of a channel of the file go.
#[derive(Clone, Copy, Default)]
struct Slot {
    layer: usize,
    /// Position among the channels of the layer.
    channel: usize,
}

fn decode_unguarded(bytes: &[u8], limits: &Limits) -> Result<Layers> {
    let headers = headers(bytes)?;
    let (width, height) = check_headers(&headers, bytes.len(), limits)?;
    let (mut layers, slots) = lay_out(&headers);
    for layer in &mut layers {
        layer.data = zeroed(width * height * layer.channels.len())?;
    }
    // From pixels of a part's data window to pixels of the image.
    let offset_of = |header: &Header| {
        let display = header.shared_attributes.display_window.position;
        let data = header.own_attributes.layer_position;
        [i64::from(data.0) - i64::from(display.0), i64::from(data.1) - i64::from(display.1)]
    };

    let mut seen = vec![0u64; headers.len()];
    for block in blocks(bytes, &headers)? {
        let block = block?;
        let index = block.index;
        let Some((header, slots)) = headers.get(index.layer).zip(slots.get(index.layer)) else { continue };
        let offset = offset_of(header);
        if index.level.0 != 0 || index.level.1 != 0 {
            continue;
        }
        let pixels = index.pixel_size.0 as u64 * index.pixel_size.1 as u64;
        seen[index.layer] += pixels;
        let mut rest = &block.data[..];
        for y in 0..index.pixel_size.1 {
            for (channel, slot) in header.channels.list.iter().zip(slots) {
                let line_number = index.pixel_position.1 + y;
                let samples = exr_chroma::samples_in_line(channel, index.pixel_size.0, line_number);
                let bytes = samples * channel.sample_type.bytes_per_sample();
                let cut = || Error::input("a chunk is shorter than its pixels").at("pixels");
                let (line, tail) = rest.split_at_checked(bytes).ok_or_else(cut)?;
                rest = tail;
                if samples == 0 {
                    continue;
                }
                let row = line_number as i64 + offset[1];
                let column = index.pixel_position.0 as i64 + offset[0];
                let target = &mut layers[slot.layer];
                put_line(line, channel, [column, row], [width, height], target, slot.channel);
            }
        }
    }
    for (part, (header, seen)) in headers.iter().zip(seen).enumerate() {
        let all = header.layer_size.0 as u64 * header.layer_size.1 as u64;
        if seen < all {
            return Err(Error::input(format!("{seen} of {all} pixels are there")).at(format!("part[{part}]")));
        }
    }

    let mut picture = Layers { metadata: read_metadata(&headers)?, ..Layers::new(width as u32, height as u32) };
    let mut filtered = vec![false; layers.len()];
    for (header, slots) in headers.iter().zip(&slots) {
        let subsampled = header.channels.list.iter().zip(slots).filter(|(channel, _)| channel.sampling.0 == 2);
        for (_, slot) in subsampled {
            let layer = &mut layers[slot.layer];
            let chroma = matches!(layer.channels[slot.channel].as_str(), "RY" | "BY");
            filtered[slot.layer] |= chroma;
            let fill = if chroma { exr_luminance::fill_chroma } else { exr_luminance::fill_linearly };
            fill(layer, slot.channel, [width, height])?;
        }
    }
    let primaries = chromaticities(&headers[0]);
    let weights = primaries.luminance_weights().map_err(|error| error.at("header"))?;
    for (layer, filtered) in layers.iter_mut().zip(filtered) {
        exr_luminance::to_rgb(layer, weights, filtered, [width, height])?;
    }
    if let Some(matrix) = primaries.rec709_from_rgb().map_err(|error| error.at("header"))? {
        layers.iter_mut().for_each(|layer| convert(layer, matrix));
    }
    let inside = |header: &Header| {
        let ([x, y], size) = (offset_of(header), header.layer_size);
        x < width as i64 && y < height as i64 && x + size.0 as i64 > 0 && y + size.1 as i64 > 0
    };
    if !headers.iter().any(inside) {
        picture
            .warnings
            .push("the data window lies outside of the display window, in which nothing is to be seen".into());
    }
    if headers[0].shared_attributes.pixel_aspect != 1.0 {
        let aspect = headers[0].shared_attributes.pixel_aspect;
        picture.warnings.push(format!("its pixels are {aspect} times as wide as high, and are taken as squares"));
    }
    picture.layers = layers;
    Ok(picture)
}

/// All chunks of the file, unpacked one after the other.
fn blocks<'a>(
    bytes: &'a [u8],
    headers: &'a [Header],
) -> Result<Box<dyn Iterator<Item = Result<UncompressedBlock>> + 'a>> {
    if let [header] = headers
        && exr_chroma::is_subsampled(header)
    {
        return Ok(Box::new(exr_chroma::blocks(bytes, header)));
    }
    let reader = Reader::read_from_buffered(Cursor::new(bytes), false).map_err(damaged)?;
    let chunks = reader.all_chunks(false).map_err(|error| damaged(error).at("chunk table"))?;
    let blocks = chunks.sequential_decompressor(false);
    Ok(Box::new(blocks.map(|block| block.map_err(|error| damaged(error).at("pixels")))))
}

/// Of the file, or Rec. 709, which files without that attribute are in.
fn chromaticities(header: &Header) -> Chromaticities {
    let pair = |v: exr::math::Vec2<f32>| [v.0, v.1];
    header.shared_attributes.chromaticities.map_or(REC_709, |given| Chromaticities {
        red: pair(given.red),
        green: pair(given.green),
        blue: pair(given.blue),
        white: pair(given.white),
    })
}

/// Copies the part of a line of samples that lies inside the image.
fn put_line(
    line: &[u8],
    channel: &ChannelDescription,
    [x, y]: [i64; 2],
    [width, height]: [usize; 2],
    layer: &mut Layer,
    k: usize,
) {
    if y < 0 || y >= height as i64 {
        return;
    }
    let (kind, stride, step) = (channel.sample_type, layer.channels.len(), channel.sampling.0);
    let row = &mut layer.data[y as usize * width * stride..][..width * stride];
    let value = |sample: &[u8]| match (kind, sample) {
        (SampleType::F16, &[a, b]) => f16::from_ne_bytes([a, b]).to_f32(),
        (SampleType::F32, &[a, b, c, d]) => f32::from_ne_bytes([a, b, c, d]),
        (SampleType::U32, &[a, b, c, d]) => u32::from_ne_bytes([a, b, c, d]) as f32,
        _ => 0.0,
    };
    let skip = usize::try_from(-x).unwrap_or(0);
    let start = usize::try_from(x).unwrap_or(0).min(width);
    let samples = line.chunks_exact(kind.bytes_per_sample()).skip(skip);
    for (pixel, sample) in row[start * stride..].chunks_exact_mut(stride).step_by(step).zip(samples) {
        pixel[k] = value(sample);
    }
}

/// Size of the image (the display window), when everything that the headers ask for is within the limits.
fn check_headers(headers: &[Header], file_bytes: usize, limits: &Limits) -> Result<(usize, usize)> {
    let first = headers.first().ok_or_else(|| Error::input("no parts").at("header"))?;
    let size = first.shared_attributes.display_window.size;
    let channels: usize = headers.iter().map(|header| header.channels.list.len()).sum();
    if channels == 0 || channels > MAX_CHANNELS {
        return Err(Error::input(format!("{channels} channels, 1 to {MAX_CHANNELS} are read")).at("channels"));
    }
    // Every channel becomes f32.
    check_size(size.0 as u64, size.1 as u64, 4 * channels as u64, limits).map_err(|e| e.at("displayWindow"))?;
    for (i, header) in headers.iter().enumerate() {
        let wrong = |what: String| Err(Error::input(what).at(format!("part[{i}]")));
        if header.deep {
            return wrong("deep pixels are not read".into());
        }
        if exr_chroma::is_subsampled(header) {
            exr_chroma::check(header, headers.len()).map_err(|error| error.at(format!("part[{i}]")))?;
        }
        let data = header.layer_size;
        check_size(data.0 as u64, data.1 as u64, header.channels.bytes_per_pixel as u64, limits)
            .map_err(|error| error.at("dataWindow"))?;
        // No compression of the format packs more tightly than deflate (1032 : 1).
        let pixel_bytes = data.0 as u64 * data.1 as u64 * header.channels.bytes_per_pixel as u64;
        if pixel_bytes / 2048 > file_bytes as u64 {
            return wrong(format!("{pixel_bytes} bytes of pixels cannot come from {file_bytes} bytes"));
        }
        // An entry in the table, a position and a length.
        let least = header.chunk_count as u64 * 16;
        if least > file_bytes as u64 {
            return wrong(format!("{} chunks do not fit into {file_bytes} bytes", header.chunk_count));
        }
        // The decoder holds some chunks at a time.
        let chunk = match header.blocks {
            BlockDescription::Tiles(tiles) => (tiles.tile_size.0 as u64).checked_mul(tiles.tile_size.1 as u64),
            BlockDescription::ScanLines => Some(data.0 as u64 * header.compression.scan_lines_per_block() as u64),
        };
        let chunk = chunk.and_then(|pixels| pixels.checked_mul(header.channels.bytes_per_pixel as u64));
        if chunk.is_none_or(|bytes| bytes > limits.max_alloc / 4) {
            return wrong(format!("chunks of more than {} bytes", limits.max_alloc / 4));
        }
    }
    Ok((size.0, size.1))
}

/// Layer and channel from the names of a part and a channel.
fn split_name(part: &str, channel: &str, many_parts: bool) -> (String, String) {
    let (prefix, name) = channel.rsplit_once('.').unwrap_or(("", channel));
    let layer = match (many_parts && !part.is_empty(), prefix) {
        (false, "") if name == "Z" => "depth",
        (false, _) => prefix,
        (true, "") => part,
        // Some programs name the part and repeat it in front of its channels.
        (true, _) if prefix == part || prefix.starts_with(&format!("{part}.")) => prefix,
        (true, _) => return (format!("{part}.{prefix}"), name.to_owned()),
    };
    (layer.to_owned(), name.to_owned())
}

/// The layers without their samples, the unnamed one first, and for each part where its channels go.
fn lay_out(headers: &[Header]) -> (Vec<Layer>, Vec<Vec<Slot>>) {
    let mut layers: Vec<Layer> = Vec::new();
    let mut slots: Vec<Vec<Slot>> = Vec::new();
    for header in headers {
        let part = header.own_attributes.layer_name.as_ref().map(text_of).unwrap_or_default();
        let mut part_slots = Vec::new();
        for channel in &header.channels.list {
            let (layer, name) = split_name(&part, &text_of(&channel.name), headers.len() > 1);
            // A channel that a layer has already (in another part or view) begins another layer of that name.
            let free = |l: &Layer| l.name == layer && l.channel(&name).is_none();
            let at = layers.iter().position(free).unwrap_or_else(|| {
                layers.push(Layer { name: layer, channels: vec![], data: vec![], precision: Precision::Half });
                layers.len() - 1
            });
            if channel.sample_type != SampleType::F16 {
                layers[at].precision = Precision::Full;
            }
            part_slots.push(Slot { layer: at, channel: layers[at].channels.len() });
            layers[at].channels.push(name);
        }
        slots.push(part_slots);
    }
    layers.iter_mut().for_each(|layer| standard_names(&mut layer.channels));
    // The file has channels by the alphabet: A B G R becomes R G B A, A BY RY Y becomes RY Y BY A; X Y Z and U V stay in that order.
    let mut places: Vec<Vec<usize>> = Vec::new();
    for layer in &mut layers {
        let colours = if layer.channel("RY").is_some() { ["RY", "Y", "BY", "A"] } else { ["R", "G", "B", "A"] };
        let rank = |name: &str| colours.iter().position(|&c| c == name).unwrap_or(9);
        let mut order: Vec<usize> = (0..layer.channels.len()).collect();
        order.sort_by_key(|&k| rank(&layer.channels[k]));
        layer.channels = order.iter().map(|&k| layer.channels[k].clone()).collect();
        let mut place = vec![0; order.len()];
        order.iter().enumerate().for_each(|(to, &from)| place[from] = to);
        places.push(place);
    }
    let mut order: Vec<usize> = (0..layers.len()).collect();
    order.sort_by_key(|&at| !layers[at].name.is_empty());
    let mut moved = vec![0; order.len()];
    order.iter().enumerate().for_each(|(to, &from)| moved[from] = to);
    layers.sort_by_key(|layer| !layer.name.is_empty());
    for slot in slots.iter_mut().flatten() {
        *slot = Slot { layer: moved[slot.layer], channel: places[slot.layer][slot.channel] };
    }
    (layers, slots)
}

/// Some programs call the colours of a layer `red green blue alpha` or `r g b a`.
fn standard_names(channels: &mut [String]) {
    const STANDARD: [&str; 4] = ["R", "G", "B", "A"];
    for names in [["red", "green", "blue", "alpha"], ["r", "g", "b", "a"]] {
        let place = |channel: &String| names.iter().position(|name| channel.eq_ignore_ascii_case(name));
        let colours = channels.iter().filter_map(place).filter(|&i| i < 3).count();
        if colours == 3 && !channels.iter().any(|channel| STANDARD.contains(&channel.as_str())) {
            for channel in channels {
                if let Some(i) = place(channel) {
                    *channel = STANDARD[i].into();
                }
            }
            return;
        }
    }
}

fn convert(layer: &mut Layer, matrix: glam::Mat3) {
    let (Some(r), Some(g), Some(b)) = (layer.channel("R"), layer.channel("G"), layer.channel("B")) else { return };
    let channels = layer.channels.len();
    for pixel in layer.data.chunks_exact_mut(channels) {
        [pixel[r], pixel[g], pixel[b]] = (matrix * glam::Vec3::new(pixel[r], pixel[g], pixel[b])).to_array();
    }
}

fn read_metadata(headers: &[Header]) -> Result<Metadata> {
    let Some(header) = headers.first() else { return Ok(Metadata::default()) };
    let mut own = Metadata::default();
    for (name, value) in header.all_named_attributes() {
        let name = String::from_utf8_lossy(name).into_owned();
        let text = match value {
            AttributeValue::Text(text) => text_of(&text),
            AttributeValue::F32(value) => value.to_string(),
            AttributeValue::F64(value) => value.to_string(),
            AttributeValue::I32(value) => value.to_string(),
            AttributeValue::Compression(value) => format!("{value:?}"),
            AttributeValue::EnvironmentMap(EnvironmentMap::Cube) => "cube".into(),
            AttributeValue::EnvironmentMap(EnvironmentMap::LatitudeLongitude) => "latlong".into(),
            AttributeValue::Matrix4x4(matrix) => {
                match name.as_str() {
                    "worldToCamera" => own.world_to_camera = Some(matrix),
                    "worldToNDC" => own.world_to_ndc = Some(matrix),
                    _ => {}
                }
                continue;
            }
            _ => continue,
        };
        if name == JSON {
            return Metadata::from_json(&text).map_err(|error| error.at("header.lucerna"));
        }
        if !name.starts_with(PREFIX) {
            own.extra.insert(name, text);
        }
    }
    Ok(own)
}

/// Texts are bytes of no stated encoding; nearly always UTF-8.
fn text_of(text: &exr::meta::attribute::Text) -> String {
    String::from_utf8_lossy(text.bytes()).into_owned()
}

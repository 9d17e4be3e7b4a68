//! OpenEXR files with fewer samples in some channels: luminance with chroma at half resolution.
//!
//! The `exr` crate decompresses such chunks but expects as many bytes as without subsampling, so it is told how many
//! there really are.

use super::exr_write::header_end;
use crate::{Error, Result};
use exr::{
    block::{BlockIndex, UncompressedBlock, chunk::CompressedBlock, chunk::CompressedScanLineBlock},
    math::Vec2,
    meta::BlockDescription,
    meta::{
        attribute::{ChannelDescription, ChannelList, IntegerBounds, SampleType},
        header::Header,
    },
    prelude::Compression,
};

/// Whether any channel has not a sample for each pixel.
pub(super) fn is_subsampled(header: &Header) -> bool {
    header.channels.list.iter().any(|channel| channel.sampling.0 != 1 || channel.sampling.1 != 1)
}

/// What can be served: chroma at half resolution, in the only part, which has scan lines and no offset.
pub(super) fn check(header: &Header, parts: usize) -> Result<()> {
    if parts > 1 || header.blocks != BlockDescription::ScanLines {
        return Err(Error::input("subsampled channels in tiles or in one of several parts are not read"));
    }
    // The crate's decoder of these leaves the bounds of its buffers.
    if matches!(header.compression, Compression::DWAA(_) | Compression::DWAB(_)) {
        let what = format!("subsampled channels in {:?} compression are not read", header.compression);
        return Err(Error::input(what).help("Convert the file to PIZ or ZIP, or to RGB"));
    }
    let display = header.shared_attributes.display_window;
    if header.own_attributes.layer_position != display.position || header.layer_size != display.size {
        return Err(Error::input("subsampled channels whose data window is not the display window are not read"));
    }
    let Vec2(left, top) = header.own_attributes.layer_position;
    if left % 2 != 0 || top % 2 != 0 {
        // Samples stand at even coordinates, so that the first row or column would have none. OpenEXR refuses these files, too.
        let what = format!("subsampled channels whose data window begins at the odd coordinate ({left}, {top})");
        return Err(Error::input(what).help("Samples stand at even coordinates: begin at an even one"));
    }
    match header.channels.list.iter().find(|c| !matches!((c.sampling.0, c.sampling.1), (1, 1) | (2, 2))) {
        Some(channel) => {
            let (name, x, y) = (&channel.name, channel.sampling.0, channel.sampling.1);
            Err(Error::input(format!("channel {name} has one sample for {x}×{y} pixels, 1×1 and 2×2 are read")))
        }
        None => Ok(()),
    }
}

/// Samples of a channel in a line of that many pixels; lines count from the top of the data window.
pub(super) fn samples_in_line(channel: &ChannelDescription, width: usize, y: usize) -> usize {
    if y.is_multiple_of(channel.sampling.1) { width.div_ceil(channel.sampling.0) } else { 0 }
}

/// The blocks of a file of one subsampled part. The crate's reader refuses such files, so the chunks are found here.
pub(super) fn blocks<'a>(file: &'a [u8], header: &'a Header) -> impl Iterator<Item = Result<UncompressedBlock>> + 'a {
    let cut = || Error::input("a chunk lies outside of the file").at("chunk table");
    let table = header_end(file).and_then(|start| file.get(start..)).unwrap_or_default();
    (0..header.chunk_count).map(move |i| {
        let entry = table.get(8 * i..).and_then(<[u8]>::first_chunk).ok_or_else(cut)?;
        let start = usize::try_from(u64::from_le_bytes(*entry)).map_err(|_| cut())?;
        let chunk = file.get(start..).ok_or_else(cut)?;
        let (y, rest) = chunk.split_first_chunk().ok_or_else(cut)?;
        let (bytes, rest) = rest.split_first_chunk().ok_or_else(cut)?;
        let data = rest.get(..u32::from_le_bytes(*bytes) as usize).ok_or_else(cut)?;
        let block =
            CompressedScanLineBlock { y_coordinate: i32::from_le_bytes(*y), compressed_pixels_le: data.to_vec() };
        decompress(block, header)
            .map_err(|error| Error::input("damaged or not served").caused_by(error).at(format!("pixels.chunk[{i}]")))
    })
}

/// Decompresses a chunk of a subsampled part.
fn decompress(block: CompressedScanLineBlock, header: &Header) -> Result<UncompressedBlock, exr::error::Error> {
    let block = CompressedBlock::ScanLine(block);
    let tile = header.get_block_data_indices(&block)?;
    let bounds: IntegerBounds = header.get_absolute_block_pixel_coordinates(tile)?;
    let position = bounds.position.to_usize("chunk position")?;
    let lines = position.1..position.1 + bounds.size.1;
    let line_bytes = |y: usize| -> usize {
        let bytes = |c: &ChannelDescription| samples_in_line(c, bounds.size.0, y) * c.sample_type.bytes_per_sample();
        header.channels.list.iter().map(bytes).sum()
    };
    let total: usize = lines.map(line_bytes).sum();
    if let (Compression::B44 | Compression::B44A, CompressedBlock::ScanLine(block)) = (header.compression, &block)
        && block.compressed_pixels_le.len() != total
    {
        let data = b44(&block.compressed_pixels_le, header, bounds)?;
        let index = BlockIndex { layer: 0, pixel_position: position, pixel_size: bounds.size, level: tile.level_index };
        return Ok(UncompressedBlock { index, data });
    }
    let area = bounds.size.0 * bounds.size.1;
    if area == 0 || !total.is_multiple_of(area) {
        return Err(exr::error::Error::NotSupported("subsampled channels in a size that is not even".into()));
    }
    let mut header = header.clone();
    header.channels.bytes_per_pixel = total / area;
    let CompressedBlock::ScanLine(block) = block else { return Err(exr::error::Error::Invalid("tiles".into())) };
    let compression = header.compression;
    let data = compression.decompress_image_section_from_le(&header, block.compressed_pixels_le, bounds, false)?;
    let index = BlockIndex { layer: 0, pixel_position: position, pixel_size: bounds.size, level: tile.level_index };
    Ok(UncompressedBlock { index, data })
}

/// A chunk of B44 or B44A: a channel after the other in squares of 4×4 samples, each 14 bytes or (all the same) 3.
///
/// The crate unpacks only whole channels, so each is given to it as an image of one channel, padded to whole squares.
fn b44(packed: &[u8], header: &Header, bounds: IntegerBounds) -> Result<Vec<u8>, exr::error::Error> {
    let short = || exr::error::Error::Invalid("a chunk ends too early".into());
    let top = bounds.position.to_usize("chunk position")?.1;
    let mut rest = packed;
    let mut planes = Vec::new();
    for channel in &header.channels.list {
        let rows: Vec<usize> =
            (top..top + bounds.size.1).filter(|&y| samples_in_line(channel, bounds.size.0, y) > 0).collect();
        let (width, height) = (bounds.size.0.div_ceil(channel.sampling.0), rows.len());
        if channel.sample_type != SampleType::F16 {
            let (plane, tail) = rest.split_at_checked(4 * width * height).ok_or_else(short)?;
            planes.push((
                plane.as_chunks::<4>().0.iter().flat_map(|v| u32::from_le_bytes(*v).to_ne_bytes()).collect(),
                4 * width,
                4 * width,
            ));
            rest = tail;
            continue;
        }
        let padded = Vec2(width.next_multiple_of(4), height.next_multiple_of(4));
        let mut bytes = 0;
        for _ in 0..padded.area() / 16 {
            // A shift of 13 and more stands for a square of one value.
            bytes += if *rest.get(bytes + 2).ok_or_else(short)? >= 13 << 2 { 3 } else { 14 };
        }
        let (plane, tail) = rest.split_at_checked(bytes).ok_or_else(short)?;
        rest = tail;
        if bytes == 0 {
            planes.push((Vec::new(), 0, 0));
            continue;
        }
        let alone = ChannelDescription { sampling: Vec2(1, 1), ..channel.clone() };
        let mut single = header.clone();
        single.channels = ChannelList::new(std::iter::once(alone).collect());
        single.layer_size = padded;
        let section = IntegerBounds { position: Vec2(0, 0), size: padded };
        let unpacked = header.compression.decompress_image_section_from_le(&single, plane.to_vec(), section, false)?;
        planes.push((unpacked, 2 * padded.0, 2 * width));
    }
    let mut out = Vec::new();
    let mut next = vec![0; planes.len()];
    for y in top..top + bounds.size.1 {
        for ((channel, (plane, stride, used)), next) in header.channels.list.iter().zip(&planes).zip(&mut next) {
            if samples_in_line(channel, bounds.size.0, y) > 0 {
                out.extend_from_slice(plane.get(*next..*next + used).ok_or_else(short)?);
                *next += stride;
            }
        }
    }
    Ok(out)
}

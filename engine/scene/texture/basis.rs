//! Basis Universal texels (ETC1S with BasisLZ, UASTC) of KTX2 files.
//!
//! The transcoder reads `.basis` files, so the parts of the KTX2 file are laid out as one: same payloads, another
//! header (the `.basis` file format, as its authors describe it). It is a port of the authors' C++ to Rust without C++, so that damaged
//! files cannot corrupt memory; both give the same bytes (see the tests).

use basisu::{DecodeFlags, TargetFormat, Transcoder};

use crate::{Error, Result};

const HEADER_BYTES: usize = 77;
const SLICE_BYTES: usize = 23;
const VERSION: u16 = 0x13;

/// `global`: the supercompression global data of BasisLZ; `level`: the slices of one image.
pub(super) fn decode_etc1s(width: u32, height: u32, global: &[u8], level: &[u8]) -> Result<Vec<[u8; 4]>> {
    let damaged = |what: &str| Error::input(format!("BasisLZ {what}")).at("supercompression global data");
    let mut rest = global;
    let endpoints = take_u16(&mut rest).ok_or_else(|| damaged("header is cut short"))?;
    let selectors = take_u16(&mut rest).ok_or_else(|| damaged("header is cut short"))?;
    let mut length = || take_u32(&mut rest).map(|n| n as usize).ok_or_else(|| damaged("header is cut short"));
    let (endpoint_bytes, selector_bytes, table_bytes, extended_bytes) = (length()?, length()?, length()?, length()?);
    let mut description = [0; 5];
    // The first of one description an image; its level is the first.
    for word in &mut description {
        *word = take_u32(&mut rest).ok_or_else(|| damaged("has no image descriptions"))?;
    }
    let [flags, rgb_offset, rgb_bytes, alpha_offset, alpha_bytes] = description;
    if flags & 2 != 0 {
        return Err(damaged("holds a video"));
    }
    // One description an image and level; the payloads end the section.
    let payload = [endpoint_bytes, selector_bytes, table_bytes, extended_bytes]
        .iter()
        .try_fold(0, |sum: usize, &n| sum.checked_add(n));
    let start = payload.and_then(|bytes| global.len().checked_sub(bytes)).filter(|&start| start >= 40);
    let start = start.ok_or_else(|| damaged("is shorter than its parts"))?;
    let slice = |offset: u32, bytes: u32| {
        let end = (offset as usize).checked_add(bytes as usize)?;
        level.get(offset as usize..end).filter(|slice| !slice.is_empty())
    };
    let cut = || Error::input("BasisLZ slice lies outside of its level").at("level 0");
    let mut slices = vec![slice(rgb_offset, rgb_bytes).ok_or_else(cut)?];
    if alpha_bytes > 0 {
        slices.push(slice(alpha_offset, alpha_bytes).ok_or_else(cut)?);
    }
    let payloads = &global[start..start + endpoint_bytes + selector_bytes + table_bytes];
    let codebooks = Codebooks { endpoints, selectors, endpoint_bytes, selector_bytes, table_bytes, payloads };
    texels(width, height, Some(&codebooks), &slices)
}

/// `level`: 16 bytes a block of 4×4 texels.
pub(super) fn decode_uastc(width: u32, height: u32, level: &[u8]) -> Result<Vec<[u8; 4]>> {
    texels(width, height, None, &[level])
}

struct Codebooks<'a> {
    endpoints: u16,
    selectors: u16,
    endpoint_bytes: usize,
    selector_bytes: usize,
    table_bytes: usize,
    payloads: &'a [u8],
}

fn texels(width: u32, height: u32, codebooks: Option<&Codebooks<'_>>, slices: &[&[u8]]) -> Result<Vec<[u8; 4]>> {
    let bytes = transcode(width, height, codebooks, slices, TargetFormat::Rgba32)?;
    let count = width as usize * height as usize;
    bytes.as_chunks::<4>().0.get(..count).map(<[_]>::to_vec).ok_or_else(damaged)
}

fn damaged() -> Error {
    Error::input("Basis texels are damaged").at("level 0")
}

fn transcode(
    width: u32,
    height: u32,
    codebooks: Option<&Codebooks<'_>>,
    slices: &[&[u8]],
    format: TargetFormat,
) -> Result<Vec<u8>> {
    let too_large = || Error::input(format!("Basis image of {width}×{height} texels is too large"));
    let file = basis_file(width, height, codebooks, slices).ok_or_else(too_large)?;
    let transcoder = Transcoder::new(&file).map_err(|_| damaged())?;
    transcoder.transcode(0, format, DecodeFlags::HIGH_QUALITY).map_err(|_| damaged())
}

/// A `.basis` file of one image. `None`: something does not fit into its header fields.
fn basis_file(width: u32, height: u32, codebooks: Option<&Codebooks<'_>>, slices: &[&[u8]]) -> Option<Vec<u8>> {
    let narrow = |value: usize, bytes: u32| u32::try_from(value).ok().filter(|&v| u64::from(v) < 1 << (8 * bytes));
    let slices_at = HEADER_BYTES;
    let payload_at = slices_at + SLICE_BYTES * slices.len();
    let payload = codebooks.map_or(&[][..], |c| c.payloads);
    let data_at = payload_at + payload.len();
    let total = data_at.checked_add(slices.iter().map(|slice| slice.len()).sum())?;
    let mut file = Vec::new();
    file.try_reserve_exact(total).ok()?;

    let etc1s = codebooks.is_some();
    let alpha = slices.len() == 2;
    let mut put = |value: u32, bytes: usize| file.extend_from_slice(&value.to_le_bytes()[..bytes]);
    put(u32::from(u16::from_be_bytes(*b"Bs")), 2);
    put(VERSION.into(), 2);
    put(HEADER_BYTES as u32, 2);
    put(0, 2); // Checksum of the header: not looked at.
    put(narrow(total - HEADER_BYTES, 4)?, 4);
    put(0, 2); // Checksum of the data: not looked at.
    put(slices.len() as u32, 3);
    put(1, 3); // Images.
    put(u32::from(!etc1s), 1);
    put(u32::from(etc1s) | u32::from(alpha && etc1s) << 2, 2);
    put(0, 1); // A list of 2D images.
    put(0, 3); // Microseconds a frame.
    put(0, 4); // Reserved.
    put(0, 4);
    put(0, 4); // User data.
    let (mut parts, mut at) = ([[0; 2]; 3], payload_at);
    if let Some(c) = codebooks {
        for (part, bytes) in parts.iter_mut().zip([c.endpoint_bytes, c.selector_bytes, c.table_bytes]) {
            *part = [narrow(at, 4)?, narrow(bytes, 3)?];
            at += bytes;
        }
    }
    put(codebooks.map_or(0, |c| c.endpoints.into()), 2);
    put(parts[0][0], 4);
    put(parts[0][1], 3);
    put(codebooks.map_or(0, |c| c.selectors.into()), 2);
    put(parts[1][0], 4);
    put(parts[1][1], 3);
    put(parts[2][0], 4);
    put(parts[2][1], 4);
    put(slices_at as u32, 4);
    put(0, 4);
    put(0, 4); // Extended data.
    let mut at = data_at;
    for (i, slice) in slices.iter().enumerate() {
        put(0, 3); // Image.
        put(0, 1); // Level.
        put(i as u32, 1); // 1: alpha.
        put(narrow(width as usize, 2)?, 2);
        put(narrow(height as usize, 2)?, 2);
        put(width.div_ceil(4), 2);
        put(height.div_ceil(4), 2);
        put(narrow(at, 4)?, 4);
        put(narrow(slice.len(), 4)?, 4);
        put(0, 2); // Checksum: not looked at.
        at += slice.len();
    }
    file.extend_from_slice(payload);
    slices.iter().for_each(|slice| file.extend_from_slice(slice));
    Some(file)
}

fn take_u16(rest: &mut &[u8]) -> Option<u16> {
    let (value, tail) = rest.split_first_chunk()?;
    *rest = tail;
    Some(u16::from_le_bytes(*value))
}

fn take_u32(rest: &mut &[u8]) -> Option<u32> {
    let (value, tail) = rest.split_first_chunk()?;
    *rest = tail;
    Some(u32::from_le_bytes(*value))
}

#[cfg(test)]
mod tests;

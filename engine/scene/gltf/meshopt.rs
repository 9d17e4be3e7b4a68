//! Decoder for EXT_meshopt_compression buffer views, in safe Rust.
//!
//! Every read is checked: a malformed stream ends in an error, never in a wrong access. Formats after the extension's
//! "Appendix A: bitstream" (vertex codec version 0, index codecs versions 0 and 1) and "Appendix B: filters".

use crate::{Error, Result};

/// How the stream was packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Interleaved vertex data.
    Attributes,
    /// A triangle list.
    Triangles,
    /// Any sequence of indices.
    Indices,
}

/// What is applied to decoded vertex data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    None,
    /// Unit vectors in octahedral encoding, 4 × i8 or 4 × i16.
    Octahedral,
    /// Unit quaternions without their largest component, 4 × i16.
    Quaternion,
    /// Floats as 24-bit mantissa and 8-bit exponent.
    Exponential,
}

/// Decodes `count` elements of `stride` bytes. The result has `count · stride` bytes; the caller bounds that product.
pub fn decode(data: &[u8], mode: Mode, filter: Filter, count: usize, stride: usize) -> Result<Vec<u8>> {
    let size = count.checked_mul(stride).ok_or_else(|| Error::input("count times byteStride is too large"))?;
    let mut out = Vec::new();
    out.try_reserve_exact(size)
        .map_err(|_| Error::new(crate::ErrorKind::OutOfMemory, format!("no memory for {size} bytes")))?;
    match mode {
        Mode::Attributes => {
            if stride == 0 || stride > 256 || !stride.is_multiple_of(4) {
                return Err(Error::input(format!(
                    "byteStride {stride} of ATTRIBUTES must be a multiple of 4 up to 256"
                )));
            }
            out.resize(size, 0);
            attributes(data, count, stride, &mut out)?;
        }
        Mode::Triangles | Mode::Indices => {
            if stride != 2 && stride != 4 {
                return Err(Error::input(format!("byteStride {stride} of compressed indices must be 2 or 4")));
            }
            let indices = if mode == Mode::Triangles { triangles(data, count)? } else { sequence(data, count)? };
            for index in indices {
                match stride {
                    2 => out.extend_from_slice(&(index as u16).to_le_bytes()),
                    _ => out.extend_from_slice(&index.to_le_bytes()),
                }
            }
        }
    }
    apply(filter, &mut out, stride, mode)?;
    Ok(out)
}

fn truncated() -> Error {
    Error::input("the compressed stream ends too early")
}

fn header(data: &[u8], high: u8, highest_version: u8, what: &str) -> Result<u8> {
    let byte = *data.first().ok_or_else(truncated)?;
    let version = byte & 15;
    if byte & 0xf0 != high || version > highest_version {
        return Err(Error::input(format!(
            "the compressed stream begins with {byte:#04x}, {what} begin with {high:#04x} to {:#04x}",
            high + highest_version
        )));
    }
    Ok(version)
}

fn unzigzag8(value: u8) -> u8 {
    (value >> 1) ^ (value & 1).wrapping_neg()
}

fn unzigzag32(value: u32) -> u32 {
    (value >> 1) ^ (value & 1).wrapping_neg()
}

/// Vertices in blocks; in a block each byte of the stride is its own run of deltas, in groups of 16.
fn attributes(data: &[u8], count: usize, stride: usize, out: &mut [u8]) -> Result<()> {
    header(data, 0xa0, 0, "vertex data")?;
    // The first element stands at the very end; the tail is at least 32 bytes long.
    let tail = stride.max(32);
    let body_end = data.len().checked_sub(tail).filter(|&end| end >= 1).ok_or_else(truncated)?;
    let body = &data[1..body_end];
    let mut last = data[data.len() - stride..].to_vec();
    let block_length = ((8192 / stride) & !15).min(256);
    let mut at = 0;
    for block in out.chunks_mut(block_length * stride) {
        let elements = block.len() / stride;
        let groups = elements.div_ceil(16);
        for (byte, last) in last.iter_mut().enumerate() {
            let modes = body.get(at..at + groups.div_ceil(4)).ok_or_else(truncated)?;
            at += modes.len();
            for group in 0..groups {
                let mode = modes[group / 4] >> (group % 4 * 2) & 3;
                let deltas = byte_group(body, &mut at, mode)?;
                let first = group * 16;
                for (delta, element) in deltas.iter().zip(first..elements.min(first + 16)) {
                    *last = last.wrapping_add(unzigzag8(*delta));
                    block[element * stride + byte] = *last;
                }
            }
        }
    }
    if at != body.len() {
        return Err(Error::input(format!(
            "the compressed stream of {count} elements has {} bytes left over",
            body.len() - at
        )));
    }
    Ok(())
}

/// Sixteen bytes: all zero, 2 or 4 bits each with escapes to a full byte, or plain.
fn byte_group(body: &[u8], at: &mut usize, mode: u8) -> Result<[u8; 16]> {
    let mut out = [0; 16];
    let bits = match mode {
        0 => return Ok(out),
        1 => 2,
        2 => 4,
        _ => {
            out.copy_from_slice(body.get(*at..*at + 16).ok_or_else(truncated)?);
            *at += 16;
            return Ok(out);
        }
    };
    let packed = body.get(*at..*at + 2 * bits).ok_or_else(truncated)?;
    *at += packed.len();
    let escape = (1u8 << bits) - 1;
    let per_byte = 8 / bits;
    for (i, value) in out.iter_mut().enumerate() {
        // The first value of a byte lies in its highest bits.
        *value = packed[i / per_byte] >> (8 - bits * (i % per_byte + 1)) & escape;
        if *value == escape {
            *value = *body.get(*at).ok_or_else(truncated)?;
            *at += 1;
        }
    }
    Ok(out)
}

fn varint(data: &[u8], at: &mut usize) -> Result<u32> {
    let mut value = 0u32;
    for shift in [0, 7, 14, 21, 28] {
        let byte = *data.get(*at).ok_or_else(truncated)?;
        *at += 1;
        value |= u32::from(byte & 127) << shift;
        if byte < 128 {
            return Ok(value);
        }
    }
    Err(Error::input("the compressed stream has a number of more than five bytes"))
}

/// The last sixteen of something, newest first.
struct Recent<T> {
    ring: [T; 16],
    next: usize,
}

impl<T: Copy> Recent<T> {
    fn new(value: T) -> Self {
        Self { ring: [value; 16], next: 0 }
    }

    fn push(&mut self, value: T) {
        self.ring[self.next & 15] = value;
        self.next += 1;
    }

    /// `back = 1`: the newest.
    fn get(&self, back: usize) -> T {
        self.ring[self.next.wrapping_sub(back) & 15]
    }
}

/// A triangle list: one code byte a triangle that refers to recent edges and vertices.
fn triangles(data: &[u8], count: usize) -> Result<Vec<u32>> {
    let version = header(data, 0xe0, 1, "triangles")?;
    if !count.is_multiple_of(3) {
        return Err(Error::input(format!("a triangle list cannot have {count} indices")));
    }
    let faces = count / 3;
    let codes_end = faces + 1;
    let table_start = data.len().checked_sub(16).filter(|&start| start >= codes_end).ok_or_else(truncated)?;
    let codes = &data[1..codes_end];
    let extra = &data[codes_end..table_start];
    let table = &data[table_start..];
    let explicit_from = if version >= 1 { 13 } else { 15 };

    let mut at = 0;
    let mut next = 0u32;
    let mut last = 0u32;
    let mut edges = Recent::new((u32::MAX, u32::MAX));
    let mut vertices = Recent::new(u32::MAX);
    let mut out = Vec::with_capacity(count);
    for &code in codes {
        let low = usize::from(code & 15);
        let corners = if code < 0xf0 {
            let (a, b) = edges.get(usize::from(code >> 4) + 1);
            let c = match low {
                0 => {
                    next = next.wrapping_add(1);
                    next.wrapping_sub(1)
                }
                low if low < explicit_from => vertices.get(low + 1),
                low => {
                    last = match low {
                        13 => last.wrapping_sub(1),
                        14 => last.wrapping_add(1),
                        _ => last.wrapping_add(unzigzag32(varint(extra, &mut at)?)),
                    };
                    last
                }
            };
            if low == 0 || low >= explicit_from {
                vertices.push(c);
            }
            edges.push((c, b));
            edges.push((a, c));
            [a, b, c]
        } else {
            // 0 for a: a new vertex. For b and c: 0 new, 15 explicit, otherwise a recent one.
            let (first, pair) = if low < 14 {
                (0, table[low])
            } else {
                let pair = *extra.get(at).ok_or_else(truncated)?;
                at += 1;
                if pair == 0 {
                    next = 0;
                }
                (if low == 14 { 0 } else { 15 }, pair)
            };
            let kinds = [first, usize::from(pair >> 4), usize::from(pair & 15)];
            let from_table = low < 14;
            let mut corners = [0; 3];
            // New and recent vertices come first; explicit ones follow in the data.
            for (corner, &kind) in corners.iter_mut().zip(&kinds) {
                *corner = match kind {
                    0 => {
                        next = next.wrapping_add(1);
                        next.wrapping_sub(1)
                    }
                    15 if !from_table => 0,
                    kind => vertices.get(kind),
                };
            }
            if !from_table {
                for (corner, &kind) in corners.iter_mut().zip(&kinds) {
                    if kind == 15 {
                        last = last.wrapping_add(unzigzag32(varint(extra, &mut at)?));
                        *corner = last;
                    }
                }
            }
            for (&corner, &kind) in corners.iter().zip(&kinds) {
                if kind == 0 || (kind == 15 && !from_table) {
                    vertices.push(corner);
                }
            }
            let [a, b, c] = corners;
            edges.push((b, a));
            edges.push((c, b));
            edges.push((a, c));
            corners
        };
        out.extend_from_slice(&corners);
    }
    if at != extra.len() {
        return Err(Error::input(format!("the compressed triangles have {} bytes left over", extra.len() - at)));
    }
    Ok(out)
}

/// A sequence of indices: differences to one of two running values.
fn sequence(data: &[u8], count: usize) -> Result<Vec<u32>> {
    header(data, 0xd0, 1, "index sequences")?;
    let end = data.len().checked_sub(4).filter(|&end| end >= 1).ok_or_else(truncated)?;
    let body = &data[1..end];
    if count > body.len() {
        return Err(truncated());
    }
    let mut at = 0;
    let mut last = [0u32; 2];
    let mut out = Vec::with_capacity(count);
    for _ in 0..count {
        let value = varint(body, &mut at)?;
        let last = &mut last[(value & 1) as usize];
        *last = last.wrapping_add(unzigzag32(value >> 1));
        out.push(*last);
    }
    if at != body.len() {
        return Err(Error::input(format!("the compressed indices have {} bytes left over", body.len() - at)));
    }
    Ok(out)
}

fn apply(filter: Filter, data: &mut [u8], stride: usize, mode: Mode) -> Result<()> {
    let fits = match filter {
        Filter::None => return Ok(()),
        Filter::Octahedral => stride == 4 || stride == 8,
        Filter::Quaternion => stride == 8,
        Filter::Exponential => stride.is_multiple_of(4),
    };
    if !fits || mode != Mode::Attributes {
        return Err(Error::input(format!("filter {filter:?} cannot be applied to {mode:?} of {stride} bytes")));
    }
    match filter {
        Filter::None => {}
        Filter::Octahedral if stride == 4 => data.chunks_exact_mut(4).for_each(octahedral8),
        Filter::Octahedral => data.chunks_exact_mut(8).for_each(octahedral16),
        Filter::Quaternion => data.chunks_exact_mut(8).for_each(quaternion),
        Filter::Exponential => data.chunks_exact_mut(4).for_each(exponential),
    }
    Ok(())
}

fn octahedral8(element: &mut [u8]) {
    let [x, y, one] = [0, 1, 2].map(|i| f32::from(element[i] as i8));
    let unit = octahedron(x, y, one);
    for (byte, value) in element.iter_mut().zip(unit) {
        *byte = (value * 127.0).round() as i8 as u8;
    }
}

fn octahedral16(element: &mut [u8]) {
    let [x, y, one, _] = shorts(element).map(f32::from);
    let unit = octahedron(x, y, one);
    for (pair, value) in element.chunks_exact_mut(2).zip(unit) {
        pair.copy_from_slice(&((value * 32767.0).round() as i16).to_le_bytes());
    }
}

/// The unit vector at (x, y) of the unfolded octahedron whose corner is at `one`.
fn octahedron(x: f32, y: f32, one: f32) -> [f32; 3] {
    // A zero here is a malformed stream: the vector is then useless, but must be finite.
    let one = if one == 0.0 { 1.0 } else { one };
    let (mut x, mut y) = (x / one, y / one);
    let z = 1.0 - x.abs() - y.abs();
    let fold = (-z).max(0.0);
    x -= fold.copysign(x);
    y -= fold.copysign(y);
    let length = (x * x + y * y + z * z).sqrt();
    let length = if length > 0.0 { length } else { 1.0 };
    [x / length, y / length, z / length]
}

fn shorts(element: &[u8]) -> [i16; 4] {
    [0, 2, 4, 6].map(|i| i16::from_le_bytes([element[i], element[i + 1]]))
}

fn quaternion(element: &mut [u8]) {
    let [x, y, z, last] = shorts(element);
    let scale = std::f32::consts::FRAC_1_SQRT_2 / f32::from(last | 3);
    let [x, y, z] = [x, y, z].map(|v| f32::from(v) * scale);
    let w = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
    let dropped = (last & 3) as usize;
    for (i, value) in [w, x, y, z].into_iter().enumerate() {
        let at = (dropped + i) % 4 * 2;
        element[at..at + 2].copy_from_slice(&((value * 32767.0).round() as i16).to_le_bytes());
    }
}

fn exponential(element: &mut [u8]) {
    let bits = i32::from_le_bytes([element[0], element[1], element[2], element[3]]);
    let (exponent, mantissa) = (bits >> 24, bits << 8 >> 8);
    let value = (f64::from(mantissa) * f64::from(exponent).exp2()) as f32;
    element.copy_from_slice(&value.to_le_bytes());
}

#[cfg(test)]
#[path = "meshopt_tests.rs"]
mod tests;

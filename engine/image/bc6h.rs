//! BC6H: blocks of 4×4 colours of 16-bit floats in 16 bytes ("Khronos Data Format Specification", version 1.3, section 20.1).
//!
//! Blocks have one region and endpoints of 10 bits without differences (mode bits 00011), the form for smooth light. The encoder fits a line
//! through the colours of a block in the numbers of their bits, where steps are relative: an error is then a share of the light.

use half::f16;

use super::level_extent;

/// Weights of the sixteen colours between two endpoints, in 64ths.
const WEIGHTS: [i32; 16] = [0, 4, 9, 13, 17, 21, 26, 30, 34, 38, 43, 47, 51, 55, 60, 64];
/// The largest finite half.
const LARGEST: i32 = 0x7bff;
/// Bits of the mode: one region, endpoints of ten bits without differences.
const MODE: u32 = 0b00011;
/// Rounds of fitting.
const ROUNDS: usize = 4;

/// Blocks, and how far they are from the colours.
#[derive(Clone, Debug, Default)]
pub struct Bc6h {
    /// Block after block, row after row.
    pub bytes: Vec<u8>,
    /// Sum of the squared differences of all values.
    pub square: f64,
}

/// Colours of a block as numbers of the bits of halves, and as the decoder has them before its last step.
type Colours = [[f64; 3]; 16];

/// Encodes colours, row after row. `signed`: values may be negative; else negative ones become 0. Blocks beyond the border repeat it.
pub fn encode_bc6h(colours: &[[f32; 3]], extent: [u32; 2], signed: bool) -> Bc6h {
    let mut out = Bc6h::default();
    let [width, height] = level_extent(extent, 0);
    for (row, column) in (0..height.div_ceil(4)).flat_map(|y| (0..width.div_ceil(4)).map(move |x| (y, x))) {
        let at = |texel: u32| {
            let [x, y] = [(4 * column + texel % 4).min(width - 1), (4 * row + texel / 4).min(height - 1)];
            colours.get((y * width + x) as usize).copied().unwrap_or_default()
        };
        let wanted: [[i32; 3]; 16] = std::array::from_fn(|texel| at(texel as u32).map(|value| bits(value, signed)));
        let (block, found) = encode(&wanted, signed);
        out.bytes.extend(block);
        for texel in 0..16u32 {
            if 4 * column + texel % 4 < width && 4 * row + texel / 4 < height {
                for (value, bits) in at(texel).into_iter().zip(found[texel as usize]) {
                    out.square += f64::from(value - value_of(bits)).powi(2);
                }
            }
        }
    }
    out
}

/// The colours of a block, row after row; `None` if it has another mode than the one that [`encode_bc6h`] writes.
pub fn decode_bc6h(block: [u8; 16], signed: bool) -> Option<[[f32; 3]; 16]> {
    let bits = u128::from_le_bytes(block);
    let part = |place: u32, count: u32| (bits >> place) as u32 & ((1 << count) - 1);
    if part(0, 5) != MODE {
        return None;
    }
    let code = |number: u32| {
        let code = part(5 + 10 * number, 10).cast_signed();
        // Ten bits with a sign; the smallest number stands for the one above it.
        if signed && code >= 512 { (code - 1024).max(-511) } else { code }
    };
    let codes = [0, 3].map(|first| [code(first), code(first + 1), code(first + 2)]);
    let palette = palette(&codes, signed);
    let index = |texel: u32| if texel == 0 { part(65, 3) } else { part(64 + 4 * texel, 4) };
    Some(std::array::from_fn(|texel| palette[index(texel as u32) as usize].map(value_of)))
}

/// The bits of a half as a number that grows with the value.
fn bits(value: f32, signed: bool) -> i32 {
    let half = f16::from_f32(if value.is_nan() { 0.0 } else { value }).to_bits();
    let size = i32::from(half & 0x7fff).min(LARGEST);
    match half >> 15 == 1 {
        true if signed => -size,
        true => 0,
        false => size,
    }
}

fn value_of(bits: i32) -> f32 {
    let size = f16::from_bits(bits.unsigned_abs() as u16).to_f32();
    if bits < 0 { -size } else { size }
}

/// The decoder's number before its last step for the bits of a half, without rounding.
fn unfinished(bits: i32, signed: bool) -> f64 {
    f64::from(bits) * if signed { 32.0 } else { 64.0 } / 31.0
}

/// The decoder's last step.
fn finished(value: i32, signed: bool) -> i32 {
    match signed {
        false => (value * 31) >> 6,
        true if value < 0 => -((-value * 31) >> 5),
        true => (value * 31) >> 5,
    }
}

/// The endpoint of 10 bits nearest to a number.
fn quantized(value: f64, signed: bool) -> i32 {
    let size = ((value.abs() - 32.0) / 64.0).round();
    match signed {
        false => size.clamp(0.0, 1023.0) as i32,
        true => size.clamp(0.0, 511.0) as i32 * if value < 0.0 { -1 } else { 1 },
    }
}

/// The number that an endpoint stands for.
fn unquantized(code: i32, signed: bool) -> i32 {
    let (size, most, end) = if signed { (code.abs(), 511, 0x7fff) } else { (code, 1023, 0xffff) };
    let value = match size {
        0 => 0,
        size if size >= most => end,
        size => 64 * size + 32,
    };
    if code < 0 { -value } else { value }
}

fn encode(wanted: &[[i32; 3]; 16], signed: bool) -> ([u8; 16], [[i32; 3]; 16]) {
    let points: Colours = wanted.map(|colour| colour.map(|bits| unfinished(bits, signed)));
    let mut ends = along_axis(&points);
    let mut best: Option<(f64, [[i32; 3]; 2], [usize; 16])> = None;
    for _ in 0..ROUNDS {
        let codes = ends.map(|end| end.map(|value| quantized(value, signed)));
        let palette = palette(&codes, signed);
        let mut indices = [0; 16];
        let mut error = 0.0;
        for (index, colour) in indices.iter_mut().zip(wanted) {
            let apart = |of: &[i32; 3]| (0..3).map(|i| f64::from(of[i] - colour[i]).powi(2)).sum::<f64>();
            let distances = palette.each_ref().map(apart);
            *index = (0..16).fold(0, |near, next| if distances[next] < distances[near] { next } else { near });
            error += distances[*index];
        }
        if best.as_ref().is_none_or(|(least, _, _)| error < *least) {
            best = Some((error, codes, indices));
        }
        match refitted(&points, &indices) {
            Some(fitted) => ends = fitted,
            None => break,
        }
    }
    let (_, mut codes, mut indices) = best.unwrap_or_default();
    // The first index has no highest bit.
    if indices[0] >= 8 {
        codes.swap(0, 1);
        indices = indices.map(|index| 15 - index);
    }
    let palette = palette(&codes, signed);
    (packed(&codes, &indices), indices.map(|index| palette[index]))
}

fn palette(codes: &[[i32; 3]; 2], signed: bool) -> [[i32; 3]; 16] {
    let [a, b] = codes.map(|code| code.map(|code| unquantized(code, signed)));
    WEIGHTS.map(|w| [0, 1, 2].map(|i| finished((a[i] * (64 - w) + b[i] * w + 32) >> 6, signed)))
}

/// Endpoints of the principal axis of some points.
fn along_axis(points: &Colours) -> [[f64; 3]; 2] {
    let mean = [0, 1, 2].map(|i| points.iter().map(|p| p[i]).sum::<f64>() / 16.0);
    let mut covariance = [[0.0; 3]; 3];
    for point in points {
        for (i, row) in covariance.iter_mut().enumerate() {
            (0..3).for_each(|j| row[j] += (point[i] - mean[i]) * (point[j] - mean[j]));
        }
    }
    let mut axis = [1.0, 1.1, 0.9];
    for _ in 0..8 {
        let next = covariance.map(|row| (0..3).map(|j| row[j] * axis[j]).sum::<f64>());
        let length = next.iter().map(|x| x * x).sum::<f64>().sqrt();
        if length == 0.0 {
            break;
        }
        axis = next.map(|x| x / length);
    }
    let length = axis.iter().map(|x| x * x).sum::<f64>().sqrt();
    let axis = axis.map(|x| x / length);
    let place = |point: &[f64; 3]| (0..3).map(|i| (point[i] - mean[i]) * axis[i]).sum::<f64>();
    let low = points.iter().map(place).fold(f64::INFINITY, f64::min);
    let high = points.iter().map(place).fold(f64::NEG_INFINITY, f64::max);
    [low, high].map(|t| [0, 1, 2].map(|i| mean[i] + t * axis[i]))
}

/// The endpoints with the least squares for given indices; `None` if all indices are equal.
fn refitted(points: &Colours, indices: &[usize; 16]) -> Option<[[f64; 3]; 2]> {
    let (mut aa, mut ab, mut bb) = (0.0, 0.0, 0.0);
    let (mut at, mut bt) = ([0.0; 3], [0.0; 3]);
    for (point, index) in points.iter().zip(indices) {
        let b = f64::from(WEIGHTS[*index]) / 64.0;
        let a = 1.0 - b;
        (aa, ab, bb) = (aa + a * a, ab + a * b, bb + b * b);
        (0..3).for_each(|i| (at[i], bt[i]) = (at[i] + a * point[i], bt[i] + b * point[i]));
    }
    let determinant = aa * bb - ab * ab;
    if determinant.abs() < 1e-9 {
        return None;
    }
    Some([
        [0, 1, 2].map(|i| (at[i] * bb - bt[i] * ab) / determinant),
        [0, 1, 2].map(|i| (bt[i] * aa - at[i] * ab) / determinant),
    ])
}

/// The bits of a block: the mode, endpoints of 10 bits, indices of 4 bits, the first one of 3.
fn packed(codes: &[[i32; 3]; 2], indices: &[usize; 16]) -> [u8; 16] {
    let (mut out, mut place) = (0u128, 0);
    let mut put = |value: u128, count: u32| {
        out |= value << place;
        place += count;
    };
    put(MODE.into(), 5);
    codes.iter().flatten().for_each(|code| put(u128::from(code.cast_unsigned() & 1023), 10));
    indices.iter().enumerate().for_each(|(texel, index)| put(*index as u128, if texel == 0 { 3 } else { 4 }));
    out.to_le_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By another decoder.
    fn decoded(blocks: &Bc6h, [width, height]: [usize; 2], signed: bool) -> Vec<[f32; 3]> {
        let mut out = vec![[0.0; 3]; width * height];
        for (number, block) in blocks.bytes.chunks_exact(16).enumerate() {
            let mut texels = [0.0f32; 48];
            bcdec_rs::bc6h_float(block, &mut texels, 12, signed);
            let [column, row] = [number % width.div_ceil(4), number / width.div_ceil(4)];
            for (texel, colour) in texels.as_chunks::<3>().0.iter().enumerate() {
                let [x, y] = [4 * column + texel % 4, 4 * row + texel / 4];
                if x < width && y < height {
                    out[y * width + x] = *colour;
                }
            }
        }
        out
    }

    #[test]
    fn our_decoder_reads_what_the_other_one_reads() {
        let mut state = 7u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            state
        };
        for number in 0..400 {
            // Any bits after the mode are a block of it.
            let bits = (0..4).fold(0u128, |bits, _| bits << 32 | u128::from(next()));
            let block = ((bits & !31) | u128::from(MODE)).to_le_bytes();
            let signed = number % 2 == 0;
            let bytes = Bc6h { bytes: block.into(), square: 0.0 };
            let theirs = decoded(&bytes, [4, 4], signed);
            let ours = decode_bc6h(block, signed).unwrap();
            for (ours, theirs) in ours.iter().flatten().zip(theirs.iter().flatten()) {
                assert!(ours == theirs || (ours.is_nan() && theirs.is_nan()), "{block:?}: {ours} {theirs}");
            }
            assert_eq!(decode_bc6h(((bits & !31) | 0b01111).to_le_bytes(), signed), None);
        }
        // Smooth values through zero.
        let colours: Vec<[f32; 3]> = (0..16).map(|i| [0.1 * i as f32 - 0.7, 0.5, -0.02 * i as f32]).collect();
        let blocks = encode_bc6h(&colours, [4, 4], true);
        let block: [u8; 16] = blocks.bytes.clone().try_into().unwrap();
        let read = decode_bc6h(block, true).unwrap();
        assert_eq!(read.to_vec(), decoded(&blocks, [4, 4], true));
        assert!((square(&colours, &read) - blocks.square).abs() <= 1e-6 * blocks.square);
    }

    fn square(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
        a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| f64::from(a - b).powi(2)).sum()
    }

    #[test]
    fn another_decoder_sees_smooth_light() {
        let extent = [18, 13];
        let colour = |i: usize| {
            let [x, y] = [(i % 18) as f32 / 18.0, (i / 18) as f32 / 13.0];
            let light = 40.0 + 300.0 * x * x + 100.0 * y;
            [light, light * (0.8 + 0.05 * y), light * (0.6 - 0.1 * x)]
        };
        let colours: Vec<[f32; 3]> = (0..18 * 13).map(colour).collect();
        let blocks = encode_bc6h(&colours, extent, false);
        assert_eq!(blocks.bytes.len(), 5 * 4 * 16);
        let read = decoded(&blocks, extent.map(|side| side as usize), false);
        assert!((square(&colours, &read) - blocks.square).abs() <= 1e-6 * blocks.square);
        for (colour, read) in colours.iter().zip(&read) {
            assert!(colour.iter().zip(read).all(|(a, b)| (a - b).abs() <= 0.06 * a), "{colour:?} {read:?}");
        }
        let mean = colours.iter().flatten().map(|v| f64::from(*v)).sum::<f64>() / 702.0;
        let relative = (blocks.square / 702.0).sqrt() / mean;
        // Endpoints of 10 bits have steps of 1/32.
        assert!(relative < 0.015, "{relative}");
    }

    #[test]
    fn even_light_and_the_ends_of_the_range_are_kept() {
        for value in [0.0, 1e-6, 0.5, 1.0, 1000.0, 65504.0] {
            let blocks = encode_bc6h(&[[value, 0.0, value]; 16], [4, 4], false);
            for [r, g, b] in decoded(&blocks, [4, 4], false) {
                // 10 bits leave steps of 1/32.
                assert!((r - value).abs() <= value / 32.0 + 1e-6 && r == b && g < 1e-6, "{value}: {r} {g} {b}");
            }
        }
        let odd = [[-3.0, f32::NAN, f32::INFINITY]; 16];
        let read = decoded(&encode_bc6h(&odd, [4, 4], false), [4, 4], false);
        assert!(read[0][0] < 1e-6 && read[0][1] < 1e-6 && read[0][2] > 6e4, "{:?}", read[0]);
    }

    #[test]
    fn signed_values_keep_their_signs() {
        let colours: Vec<[f32; 3]> = (0..64)
            .map(|i| {
                let x = (i % 8) as f32 / 7.0;
                [0.5 + 0.4 * x, -0.7 + 0.2 * x, -0.25]
            })
            .collect();
        let blocks = encode_bc6h(&colours, [8, 8], true);
        let read = decoded(&blocks, [8, 8], true);
        assert!((square(&colours, &read) - blocks.square).abs() <= 1e-6 * blocks.square);
        for (colour, read) in colours.iter().zip(&read) {
            assert!(colour.iter().zip(read).all(|(a, b)| (a - b).abs() <= 0.04 * a.abs()), "{colour:?} {read:?}");
        }
    }
}

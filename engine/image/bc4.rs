//! BC4 with signs: blocks of 4×4 numbers from -1 to 1 in 8 bytes; and BC5, two such blocks ("Khronos Data Format Specification", version 1.3,
//! sections 19.1 and 19.2).
//!
//! Blocks have two endpoints of 8 bits and six values between them. The other form, with four values between them and -1 and 1, is used for blocks of
//! one value alone. The encoder fits the line of least squares, then looks at the neighbours of the rounded endpoints.

/// Shares of the second endpoint of the eight codes, in sevenths.
const SHARES: [i32; 8] = [0, 7, 1, 2, 3, 4, 5, 6];
/// Rounds of fitting.
const ROUNDS: usize = 4;

/// Encodes 16 numbers, row after row. What is beyond -1 and 1 becomes -1 and 1; what is no number becomes 0.
pub fn encode_bc4(values: &[f32; 16]) -> [u8; 8] {
    let wanted = values.map(|value| if value.is_nan() { 0.0 } else { 127.0 * value.clamp(-1.0, 1.0) });
    let low = wanted.iter().copied().fold(127.0, f32::min);
    let high = wanted.iter().copied().fold(-127.0, f32::max);
    let mut best = Fit::new([high.round() as i32, low.round() as i32], &wanted);
    let mut ends = [high, low];
    for _ in 0..ROUNDS {
        let Some(refitted) = refitted(&wanted, &Fit::new(ends.map(rounded), &wanted).codes) else { break };
        ends = refitted;
        best = best.better(Fit::new(ends.map(rounded), &wanted));
    }
    for (first, second) in (-1..=1).flat_map(|first| (-1..=1).map(move |second| (first, second))) {
        let near = [best.ends[0] + first, best.ends[1] + second].map(|end| end.clamp(-127, 127));
        best = best.better(Fit::new(near, &wanted));
    }
    let [first, second] = best.ends.map(|end| end as i8 as u8);
    let codes = best.codes.iter().enumerate().fold(0u64, |bits, (at, code)| bits | u64::from(*code) << (3 * at));
    let [a, b, c, d, e, f, ..] = codes.to_le_bytes();
    [first, second, a, b, c, d, e, f]
}

/// The 16 numbers of a block, row after row.
pub fn decode_bc4(block: [u8; 8]) -> [f32; 16] {
    let [first, second, codes @ ..] = block;
    let end = |byte: u8| i32::from(byte.cast_signed()).max(-127);
    let values = palette([end(first), end(second)]);
    let bits = codes.iter().rev().fold(0u64, |bits, byte| bits << 8 | u64::from(*byte));
    std::array::from_fn(|at| values[(bits >> (3 * at) & 7) as usize])
}

/// The values of the eight codes.
fn palette([first, second]: [i32; 2]) -> [f32; 8] {
    match first > second {
        true => SHARES.map(|share| ((7 - share) * first + share * second) as f32 / (7.0 * 127.0)),
        false => std::array::from_fn(|code| match code {
            6 => -1.0,
            7 => 1.0,
            code => {
                let share = [0, 5, 1, 2, 3, 4][code];
                ((5 - share) * first + share * second) as f32 / (5.0 * 127.0)
            }
        }),
    }
}

fn rounded(value: f32) -> i32 {
    value.round().clamp(-127.0, 127.0) as i32
}

/// Endpoints with the codes of the nearest values.
#[derive(Clone, Copy)]
struct Fit {
    ends: [i32; 2],
    codes: [u8; 16],
    /// Sum of the squared errors, in steps of a byte.
    error: f32,
}

impl Fit {
    fn new([a, b]: [i32; 2], wanted: &[f32; 16]) -> Self {
        let ends = [a.max(b), a.min(b)];
        let values = palette(ends).map(|value| 127.0 * value);
        let (mut codes, mut error) = ([0; 16], 0.0);
        for (code, wanted) in codes.iter_mut().zip(wanted) {
            let apart = |code: usize| (values[code] - wanted).powi(2);
            let nearest = (0..8).fold(0, |near, next| if apart(next) < apart(near) { next } else { near });
            (*code, error) = (nearest as u8, error + apart(nearest));
        }
        Self { ends, codes, error }
    }

    fn better(self, other: Self) -> Self {
        if other.error < self.error { other } else { self }
    }
}

/// The endpoints with the least squares for given codes; `None` if all values are between the same ones.
fn refitted(wanted: &[f32; 16], codes: &[u8; 16]) -> Option<[f32; 2]> {
    let (mut aa, mut ab, mut bb, mut at, mut bt) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (value, code) in wanted.iter().zip(codes) {
        let b = SHARES[usize::from(*code)] as f32 / 7.0;
        let a = 1.0 - b;
        (aa, ab, bb) = (aa + a * a, ab + a * b, bb + b * b);
        (at, bt) = (at + a * value, bt + b * value);
    }
    let determinant = aa * bb - ab * ab;
    (determinant.abs() > 1e-6).then(|| [(at * bb - bt * ab) / determinant, (bt * aa - at * ab) / determinant])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By another decoder.
    fn theirs(block: [u8; 8]) -> [f32; 16] {
        let mut out = [0.0; 16];
        bcdec_rs::bc4_float(&block, &mut out, 4, true);
        out
    }

    /// Blocks of numbers that look random, narrow and wide, of both signs.
    fn blocks() -> impl Iterator<Item = [f32; 16]> {
        let mut state = 1u32;
        let mut next = move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1u32 << 23) as f32 - 1.0
        };
        (0..300).map(move |number| {
            let (middle, size) = (next(), [0.0, 0.01, 0.1, 0.5, 1.0][number % 5]);
            std::array::from_fn(|_| (middle + size * next()).clamp(-1.0, 1.0))
        })
    }

    #[test]
    fn another_decoder_reads_the_same_numbers_of_any_bits() {
        for (number, block) in blocks().enumerate() {
            let coded = encode_bc4(&block);
            for (ours, theirs) in decode_bc4(coded).iter().zip(theirs(coded)) {
                assert!((ours - theirs).abs() < 1e-6, "{block:?}: {ours} {theirs}");
            }
            // Any bits are a block.
            let odd: [u8; 8] = std::array::from_fn(|i| ((number * 7919 + i * 104_729) >> 3) as u8);
            for (ours, theirs) in decode_bc4(odd).iter().zip(theirs(odd)) {
                assert!((ours - theirs).abs() < 1e-6, "{odd:?}: {ours} {theirs}");
            }
        }
    }

    #[test]
    fn numbers_of_both_signs_are_within_half_a_step_of_the_range_of_their_block() {
        for block in blocks() {
            let read = decode_bc4(encode_bc4(&block));
            let low = block.iter().copied().fold(1.0, f32::min);
            let high = block.iter().copied().fold(-1.0, f32::max);
            // Sevenths of the range, and the rounding of both endpoints.
            let most = (high - low) / 14.0 + 1.5 / 127.0;
            for (value, read) in block.iter().zip(read) {
                assert!((value - read).abs() <= most, "{block:?}: {value} {read}");
            }
            let square: f32 = block.iter().zip(read).map(|(a, b)| (a - b).powi(2)).sum::<f32>() / 16.0;
            assert!(square.sqrt() <= (high - low) / 14.0 + 0.6 / 127.0, "{block:?}: {}", square.sqrt());
        }
    }

    #[test]
    fn the_ends_of_the_range_and_numbers_that_are_none_are_kept() {
        for value in [-1.0, -0.5, 0.0, 1.0 / 127.0, 1.0] {
            let read = decode_bc4(encode_bc4(&[value; 16]));
            assert!(read.iter().all(|read| (read - value).abs() < 0.5 / 127.0 + 1e-6), "{value}: {read:?}");
        }
        let mut odd = [0.0; 16];
        (odd[1], odd[2], odd[3]) = (f32::NAN, f32::NEG_INFINITY, 7.0);
        let read = decode_bc4(encode_bc4(&odd));
        // The sum of the squares is least with an endpoint below 1, because fourteen values are 0.
        assert!(read[2] < -0.9 && read[3] > 0.8 && read[0].abs() < 0.1 && read[1].abs() < 0.1, "{read:?}");
        // -128 is -1, as -127 is.
        assert_eq!(decode_bc4([0x80, 0x80, 0, 0, 0, 0, 0, 0]), [-1.0; 16]);
    }
}

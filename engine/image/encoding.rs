//! From light to the codes of a screen, for PNG and JPEG files.

use super::srgb;

/// What is to be said of a picture with this ICC profile: nothing if it is sRGB by its own description, which is nearly always.
pub(super) fn profile_warning(profile: Option<&[u8]>) -> Option<String> {
    // Descriptions are ASCII or, since version 4, UTF-16.
    let says = |name: &[u8]| profile.is_some_and(|bytes| bytes.windows(name.len()).any(|window| window == name));
    let srgb = says(b"sRGB") || says(b"\0s\0R\0G\0B");
    (profile.is_some() && !srgb)
        .then(|| "its ICC colour profile is not sRGB and not applied; its colours are taken as sRGB".into())
}

/// Into [0, 1]; NaN becomes 0.
pub(super) fn clamp(value: f32) -> f32 {
    if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0) }
}

/// Light in [0, 1] to a code in [0, 1]: the sRGB curve, or the power 1/gamma.
pub(super) fn encode(linear: f32, gamma: Option<f32>) -> f32 {
    gamma.map_or_else(|| srgb::encode(linear), |gamma| linear.powf(1.0 / gamma))
}

/// A code in [0, 1] as one of 256, to the nearest.
pub(super) fn eight_bits(code: f32) -> u8 {
    (code * 255.0 + 0.5) as u8
}

/// Bits of a float that [`Codes`] does not look at first.
const REST: u32 = 15;

/// [`encode`] and [`eight_bits`] of many values, without a power for each.
pub(super) struct Codes {
    /// The smallest value of each code.
    least: [f32; 256],
    /// The code of the smallest float with these upper bits.
    first: Vec<u8>,
}

impl Codes {
    pub(super) fn new(gamma: Option<f32>) -> Self {
        let code = |bits: u32| eight_bits(encode(f32::from_bits(bits), gamma));
        let mut least = [0.0; 256];
        for (i, least) in least.iter_mut().enumerate().skip(1) {
            let (mut below, mut from) = (0, 1.0f32.to_bits());
            while from - below > 1 {
                let middle = below.midpoint(from);
                if usize::from(code(middle)) < i { below = middle } else { from = middle }
            }
            *least = f32::from_bits(from);
        }
        let first = (0..=1.0f32.to_bits() >> REST).map(|upper| code(upper << REST)).collect();
        Self { least, first }
    }

    /// Of light in [0, 1].
    pub(super) fn of(&self, linear: f32) -> u8 {
        let mut code = self.first[(linear.to_bits() >> REST) as usize];
        while code < 255 && linear >= self.least[usize::from(code) + 1] {
            code += 1;
        }
        code
    }
}

/// `fill(i, part)` for parts of `samples` of `rows · row` values each, on all cores; the i-th begins with row i · rows.
pub(super) fn in_parts<T: Send>(samples: &mut [T], row: usize, fill: impl Fn(usize, &mut [T]) + Sync) {
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let rows = (samples.len() / row.max(1)).div_ceil(cores).max(1);
    if samples.len() < 1 << 16 {
        return fill(0, samples);
    }
    std::thread::scope(|scope| {
        for (part, samples) in samples.chunks_mut(rows * row.max(1)).enumerate() {
            let fill = &fill;
            scope.spawn(move || fill(part * rows, samples));
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn looked_up_codes_are_the_computed_ones() {
        for gamma in [None, Some(1.0), Some(2.2), Some(0.4), Some(5.0)] {
            let codes = Codes::new(gamma);
            let steps = (0..=100_000).map(|i| i as f32 / 100_000.0);
            let small = (0..=0x3F80).map(|i| f32::from_bits(i << 16));
            for value in steps.chain(small).chain(codes.least).chain(codes.least.map(f32::next_down)) {
                let value = clamp(value);
                assert_eq!(codes.of(value), eight_bits(encode(value, gamma)), "{value} {gamma:?}");
            }
        }
    }

    #[test]
    fn parts_cover_everything_once() {
        for (rows, row) in [(1, 1), (700, 301), (1, 100_000), (100_000, 1)] {
            let mut samples = vec![0usize; rows * row];
            in_parts(&mut samples, row, |first, part| {
                part.iter_mut().enumerate().for_each(|(i, v)| *v += first * row + i + 1);
            });
            assert!(samples.iter().enumerate().all(|(i, v)| *v == i + 1));
        }
    }
}

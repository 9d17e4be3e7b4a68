//! What becomes of NaN, infinite and negative values.

use super::BadValues;
use crate::{Error, Result};

/// Samples of colour and alpha that were not as an image should be.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BadCounts {
    pub nan: u64,
    pub infinite: u64,
    pub negative: u64,
    /// Pixels whose three colours are all negative. Such a pixel is no colour outside of the gamut, and becomes black.
    pub below_black: u64,
    /// Column and row of the first of them.
    pub first: Option<[u32; 2]>,
}

impl BadCounts {
    /// None were found.
    pub fn is_clean(&self) -> bool {
        self.first.is_none()
    }

    /// Of an image of rows of `width` pixels.
    pub fn of(width: u32, pixels: &[[f32; 4]]) -> Self {
        let mut counts = Self::default();
        for (i, pixel) in pixels.iter().enumerate() {
            if pixel.iter().all(|v| v.is_finite() && *v >= 0.0) {
                continue;
            }
            counts.nan += pixel.iter().filter(|v| v.is_nan()).count() as u64;
            counts.infinite += pixel.iter().filter(|v| v.is_infinite()).count() as u64;
            counts.negative += pixel.iter().filter(|v| v.is_finite() && **v < 0.0).count() as u64;
            counts.below_black += u64::from(pixel[..3].iter().all(|v| v.is_finite() && *v < 0.0));
            let width = width.max(1) as usize;
            counts.first.get_or_insert([(i % width) as u32, (i / width) as u32]);
        }
        counts
    }
}

/// Makes all samples finite and none negative, by `policy`, and says what was found.
///
/// # Errors
/// `Input` with the first place and the counts, if the policy is [`BadValues::Error`] and something was found.
pub fn clean(width: u32, pixels: &mut [[f32; 4]], policy: BadValues) -> Result<BadCounts> {
    let counts = BadCounts::of(width, pixels);
    let Some([x, y]) = counts.first else { return Ok(counts) };
    let mut largest = [0.0f32; 4];
    if policy == BadValues::Clamp {
        for pixel in pixels.iter() {
            for (l, v) in largest.iter_mut().zip(pixel) {
                *l = if v.is_finite() { l.max(*v) } else { *l };
            }
        }
    }
    let finite = |p: &[f32; 4]| p.iter().all(|v| v.is_finite());
    match policy {
        BadValues::Error => {
            let BadCounts { nan, infinite, negative, .. } = counts;
            let what = format!("{nan} samples are not a number, {infinite} infinite, {negative} negative");
            return Err(Error::input(what)
                .at(format!("pixel ({x}, {y})"))
                .help("Choose another policy for bad values: zero, clamp, neighbour"));
        }
        BadValues::Neighbour => {
            let width = width.max(1) as usize;
            let height = pixels.len() / width;
            let bad: Vec<usize> = (0..pixels.len()).filter(|i| !finite(&pixels[*i])).collect();
            let means: Vec<[f32; 4]> = bad
                .iter()
                .map(|i| {
                    let (x, y) = (i % width, i / width);
                    let (mut sum, mut count) = ([0.0f64; 4], 0.0);
                    for row in y.saturating_sub(1)..=(y + 1).min(height - 1) {
                        for column in x.saturating_sub(1)..=(x + 1).min(width - 1) {
                            let near = &pixels[row * width + column];
                            if finite(near) {
                                count += 1.0;
                                (0..4).for_each(|c| sum[c] += f64::from(near[c].max(0.0)));
                            }
                        }
                    }
                    sum.map(|s| if count > 0.0 { (s / count) as f32 } else { 0.0 })
                })
                .collect();
            for (i, mean) in bad.into_iter().zip(means) {
                pixels[i] = mean;
            }
        }
        BadValues::Zero | BadValues::Clamp => {}
    }
    for pixel in pixels.iter_mut() {
        for (v, l) in pixel.iter_mut().zip(largest) {
            if *v == f32::INFINITY {
                *v = l;
            } else if !(v.is_finite() && *v >= 0.0) {
                *v = 0.0;
            }
        }
    }
    Ok(counts)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bad() -> Vec<[f32; 4]> {
        let mut pixels = vec![[2.0, 4.0, 6.0, 1.0]; 9];
        pixels[4] = [f32::NAN, f32::INFINITY, -1.0, 1.0];
        pixels[8] = [1.0, -0.5, f32::NEG_INFINITY, 1.0];
        pixels
    }

    #[test]
    fn light_below_zero_is_no_colour_outside_of_the_gamut() {
        let counts = BadCounts::of(2, &[[-1.0, 2.0, -0.1, 1.0], [-1.0, -2.0, -0.1, 1.0], [0.0, 0.0, 0.0, -1.0]]);
        assert_eq!((counts.below_black, counts.negative), (1, 6));
    }

    #[test]
    fn each_policy_does_what_it_says() {
        let counts = BadCounts { nan: 1, infinite: 2, negative: 2, below_black: 0, first: Some([1, 1]) };
        for (policy, at4, at8) in [
            (BadValues::Zero, [0.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 1.0]),
            (BadValues::Clamp, [0.0, 4.0, 0.0, 1.0], [1.0, 0.0, 0.0, 1.0]),
            (BadValues::Neighbour, [2.0, 4.0, 6.0, 1.0], [2.0, 4.0, 6.0, 1.0]),
        ] {
            let mut pixels = bad();
            assert_eq!(clean(3, &mut pixels, policy).unwrap(), counts);
            assert_eq!((pixels[4], pixels[8], pixels[0]), (at4, at8, [2.0, 4.0, 6.0, 1.0]), "{policy:?}");
        }
        let error = clean(3, &mut bad(), BadValues::Error).unwrap_err();
        assert_eq!(error.exit_code(), 3);
        assert!(
            error.to_string().starts_with("pixel (1, 1): 1 samples are not a number, 2 infinite, 2 negative"),
            "{error}"
        );
        assert!(clean(1, &mut [[0.0; 4]], BadValues::Error).unwrap().is_clean());
        assert_eq!(clean(1, &mut [[f32::NAN; 4]], BadValues::Neighbour).unwrap().nan, 4);
        assert!(clean(0, &mut [], BadValues::Error).unwrap().is_clean());
    }
}

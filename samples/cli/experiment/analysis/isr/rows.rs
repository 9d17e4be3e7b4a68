//! Rows of errors, one for each view and technique, and statistics over rows. This module does not know the source of the numbers.

/// Errors of direct light alone and of a technique on one view, against one reference.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    pub scene: String,
    pub view: String,
    /// More than 25,000 triangles.
    pub complex: bool,
    /// Mean absolute error over pixels and channels [ISR 19], linear radiance, W/(sr·m²).
    pub direct: f64,
    pub technique: f64,
    /// The same error for 8-bit sRGB codes, at an exposure that fits the reference.
    pub direct_codes: f64,
    pub technique_codes: f64,
    /// Pearson's correlation with the reference.
    pub direct_correlation: f64,
    pub correlation: f64,
    /// Number of pixels whose error the technique makes smaller, and larger; the others do not change.
    pub better: usize,
    pub worse: usize,
    pub pixels: usize,
    /// Ratio of the means of the indirect light, technique over reference.
    pub found: f64,
    /// Number of pixels where the indirect light is nearer to the reference's than zero is, where it is farther, and where the reference
    /// has indirect light.
    pub indirect_better: usize,
    pub indirect_worse: usize,
    pub reached: usize,
    /// Parts of the remaining error.
    pub parts: Parts,
}

/// Parts of the remaining error: sums of absolute values over pixels and channels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Parts {
    /// Error of the direct light, which indirect light cannot correct (shadow maps, filtered textures).
    pub direct: f64,
    /// Missing and excess indirect light compared with the reference, as means over blocks of pixels, so that the reference's noise averages
    /// out.
    pub missing: f64,
    pub excess: f64,
    /// The rest of the indirect light's error, within blocks: the reference's noise, and detail.
    pub fine: f64,
}

/// Side of the blocks, pixels.
const BLOCK: usize = 8;

impl Parts {
    /// The parts for pictures of `width` pixels per row.
    pub fn of(
        width: usize,
        direct: (&[[f32; 3]], &[[f32; 3]]),
        indirect: impl Fn(usize) -> ([f64; 3], [f64; 3]),
    ) -> Self {
        let (mut out, width) = (Self::default(), width.max(1));
        let columns = width.div_ceil(BLOCK).max(1);
        let mut blocks = vec![[0.0; 3]; columns * direct.0.len().div_ceil(width * BLOCK)];
        let mut whole = 0.0;
        for (i, (found, reference)) in direct.0.iter().zip(direct.1).enumerate() {
            let (found_indirect, true_indirect) = indirect(i);
            let block = &mut blocks[i / width / BLOCK * columns + i % width / BLOCK];
            for c in 0..3 {
                out.direct += (f64::from(found[c]) - f64::from(reference[c])).abs();
                let missing = true_indirect[c] - found_indirect[c];
                whole += missing.abs();
                block[c] += missing;
            }
        }
        for missing in blocks.into_iter().flatten() {
            out.missing += missing.max(0.0);
            out.excess += (-missing).max(0.0);
        }
        out.fine = (whole - out.missing - out.excess).max(0.0);
        out
    }

    /// Shares of the sum, in percent: direct, missing, excess, fine.
    pub fn percent(&self) -> [f64; 4] {
        let all = [self.direct, self.missing, self.excess, self.fine];
        let sum: f64 = all.iter().sum();
        all.map(|part| if sum > 0.0 { 100.0 * part / sum } else { 0.0 })
    }
}

/// Reduction of an error in percent. NaN if the error was 0.
pub fn gain(before: f64, after: f64) -> f64 {
    if before > 0.0 { 100.0 * (before - after) / before } else { f64::NAN }
}

impl Row {
    /// Figure 5.9.
    pub fn gain(&self) -> f64 {
        gain(self.direct, self.technique)
    }

    pub fn gain_codes(&self) -> f64 {
        gain(self.direct_codes, self.technique_codes)
    }

    /// Figure 5.10.
    pub fn correlation_gain(&self) -> f64 {
        self.correlation - self.direct_correlation
    }

    /// The main part of the remaining error, in words; empty if the remaining error is small.
    pub fn reason(&self) -> &'static str {
        if !self.gain().is_finite() {
            return "direct light has no error";
        }
        if self.gain() > 20.0 {
            return "";
        }
        let [direct, missing, excess, fine] = self.parts.percent();
        let most = direct.max(missing).max(excess).max(fine);
        if most == direct {
            "direct light itself: shadow edges, emissive lamps out of the picture, textures that the reference does not filter"
        } else if most == missing {
            "light of surfaces that the picture does not show is missing"
        } else if most == excess {
            "light passes through what the picture does not show"
        } else {
            "noise of the reference, or detail"
        }
    }
}

/// Statistics over a list.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    pub count: usize,
    pub mean: f64,
    /// For an even number of values, the mean of the two middle values.
    pub median: f64,
    pub least: f64,
    pub most: f64,
    /// Percentage of values above zero.
    pub positive: f64,
}

impl Spread {
    /// Statistics over the finite values; `None` if there are none.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut list: Vec<f64> = values.into_iter().filter(|v| v.is_finite()).collect();
        list.sort_by(f64::total_cmp);
        let (&least, &most) = (list.first()?, list.last()?);
        let count = list.len();
        let median = 0.5 * (list[(count - 1) / 2] + list[count / 2]);
        let mean = list.iter().sum::<f64>() / count as f64;
        let positive = 100.0 * list.iter().filter(|v| **v > 0.0).count() as f64 / count as f64;
        Some(Self { count, mean, median, least, most, positive })
    }
}

/// Percentages of all pixels of all views that become nearer to the reference, and farther from it.
pub fn improved(rows: &[Row]) -> (f64, f64) {
    let sum = |of: fn(&Row) -> usize| rows.iter().map(of).sum::<usize>() as f64;
    let all = sum(|row| row.pixels);
    (100.0 * sum(|row| row.better) / all, 100.0 * sum(|row| row.worse) / all)
}

/// Factor that maps a picture to the range of 8-bit codes: the 95th percentile of the brightest channel becomes 0.8.
pub fn exposure(pixels: &[[f32; 3]]) -> f32 {
    let mut brightest: Vec<f32> =
        pixels.iter().map(|p| p[0].max(p[1]).max(p[2])).filter(|l| l.is_finite() && *l > 0.0).collect();
    if brightest.is_empty() {
        return 1.0;
    }
    let place = (brightest.len() * 95 / 100).min(brightest.len() - 1);
    0.8 / brightest.select_nth_unstable_by(place, f32::total_cmp).1.max(1e-20)
}

#[cfg(test)]
mod tests {
    use super::*;

    pub fn row(direct: f64, technique: f64) -> Row {
        Row {
            scene: "s".into(),
            view: "v".into(),
            complex: false,
            direct,
            technique,
            direct_codes: 10.0,
            technique_codes: 9.0,
            direct_correlation: 0.9,
            correlation: 0.92,
            better: 60,
            worse: 30,
            pixels: 100,
            found: 0.5,
            indirect_better: 50,
            indirect_worse: 5,
            reached: 80,
            parts: Parts { direct: 1.0, missing: 6.0, excess: 2.0, fine: 1.0 },
        }
    }

    #[test]
    fn gain_is_the_share_of_the_error_that_is_gone() {
        assert_eq!(row(2.0, 1.5).gain(), 25.0);
        assert_eq!(row(2.0, 3.0).gain(), -50.0);
        assert!(row(0.0, 0.0).gain().is_nan());
        assert_eq!(row(1.0, 1.0).gain_codes(), 10.0);
        assert!((row(1.0, 1.0).correlation_gain() - 0.02).abs() < 1e-12);
    }

    #[test]
    fn spreads_leave_out_what_is_not_a_number() {
        let spread = Spread::of([3.0, f64::NAN, -1.0, 2.0, 8.0]).unwrap();
        assert_eq!(spread, Spread { count: 4, mean: 3.0, median: 2.5, least: -1.0, most: 8.0, positive: 75.0 });
        assert_eq!(Spread::of([f64::NAN]), None);
    }

    #[test]
    fn pixels_count_over_all_views() {
        let larger = Row { better: 300, worse: 0, pixels: 300, ..row(1.0, 1.0) };
        assert_eq!(improved(&[row(1.0, 1.0), larger]), (90.0, 7.5));
    }

    #[test]
    fn reasons_are_told_apart() {
        assert_eq!(row(1.0, 0.5).reason(), "");
        let named = |parts| Row { parts, ..row(1.0, 0.99) }.reason();
        let parts = row(1.0, 1.0).parts;
        assert_eq!(parts.percent(), [10.0, 60.0, 20.0, 10.0]);
        assert!(named(parts).contains("is missing"));
        assert!(named(Parts { direct: 9.0, ..parts }).contains("direct light itself"));
        assert!(named(Parts { excess: 9.0, ..parts }).contains("passes through"));
        assert!(named(Parts { fine: 9.0, ..parts }).contains("noise"));
    }

    #[test]
    fn errors_are_told_apart_from_noise_by_blocks() {
        // Two blocks of 8 × 8: in the left one every other pixel of the reference has 2 where 1 was found; the right one misses 1.
        let (width, height) = (16, 8);
        let pixels = vec![[1.0f32; 3]; width * height];
        let mut direct = pixels.clone();
        direct[0] = [1.5, 1.0, 1.0];
        let parts = Parts::of(width, (&direct, &pixels), |i| {
            let reference = if i % width < 8 { 2.0 * (i % 2) as f64 } else { 2.0 };
            ([1.0; 3], [reference; 3])
        });
        assert_eq!(parts, Parts { direct: 0.5, missing: 192.0, excess: 0.0, fine: 192.0 });
    }

    #[test]
    fn exposure_brings_bright_pixels_to_four_fifths() {
        let mut pixels = vec![[0.0, 2.0, 1.0]; 100];
        assert!((exposure(&pixels) - 0.4).abs() < 1e-6);
        pixels[0] = [1e6; 3];
        assert!((exposure(&pixels) - 0.4).abs() < 1e-6, "one highlight does not count");
        assert_eq!(exposure(&[[0.0; 3]]), 1.0);
    }
}

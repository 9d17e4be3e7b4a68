//! One view of the pair: a model image, direct light, and direct light with image-space radiosity. This module does not know the source of the pixels.

use super::super::rows::gain;

/// Share of the simple views in the dissertation (80 of 227).
pub const SIMPLE_SHARE: f64 = 80.0 / 227.0;

/// Errors of direct light and of image-space radiosity on one view, against one model image.
#[derive(Clone, Debug, PartialEq)]
pub struct Judged {
    pub scene: String,
    pub view: String,
    pub complex: bool,
    /// Mean absolute error [ISR 19] of linear values: direct light, image-space radiosity.
    pub errors: [f64; 2],
    /// The same of codes from 0 to 255 without a transfer curve, as a program of 2010 writes them.
    pub codes: [f64; 2],
    /// Pearson's correlation with the model image, of linear values and of codes: direct light, image-space radiosity.
    pub correlations: [[f64; 2]; 2],
    /// Shares of the pixels whose error becomes smaller, and larger; for linear values and for codes.
    pub better: [f64; 2],
    pub worse: [f64; 2],
    /// Share of the pixels where the model image is brighter than direct light (sums of the channels): light that is added can improve hardly more.
    pub brighter: f64,
    /// Share of the pixels where image-space radiosity makes the picture brighter than direct light.
    pub raised: f64,
    /// Means over pixels and channels: model image, direct light, image-space radiosity.
    pub means: [f64; 3],
}

/// Mean of |a − b| over channels.
fn difference(a: [f32; 3], b: [f32; 3]) -> f64 {
    (0..3).map(|c| (f64::from(a[c]) - f64::from(b[c])).abs()).sum::<f64>() / 3.0
}

fn code(pixel: [f32; 3]) -> [f32; 3] {
    pixel.map(|v| (v.clamp(0.0, 1.0) * 255.0).round())
}

fn sum(pixel: [f32; 3]) -> f64 {
    pixel.iter().map(|v| f64::from(*v)).sum()
}

impl Judged {
    /// All lists have one element for each pixel.
    pub fn of(
        (scene, view, complex): (&str, &str, bool),
        model: &[[f32; 3]],
        direct: &[[f32; 3]],
        total: impl Fn(usize) -> [f32; 3],
    ) -> Self {
        let pixels = model.len().max(1) as f64;
        let mut out = Self {
            scene: scene.into(),
            view: view.into(),
            complex,
            errors: [0.0; 2],
            codes: [0.0; 2],
            correlations: [[0.0; 2]; 2],
            better: [0.0; 2],
            worse: [0.0; 2],
            brighter: 0.0,
            raised: 0.0,
            means: [0.0; 3],
        };
        let mut correlations = [[Correlation::default(); 2]; 2];
        for (i, (&model, &direct)) in model.iter().zip(direct).enumerate() {
            let total = total(i);
            for (kind, errors) in [&mut out.errors, &mut out.codes].into_iter().enumerate() {
                let shown = |pixel| if kind == 0 { pixel } else { code(pixel) };
                let truth = shown(model);
                let (before, after) = (difference(truth, shown(direct)), difference(truth, shown(total)));
                errors[0] += before / pixels;
                errors[1] += after / pixels;
                out.better[kind] += f64::from(after < before) / pixels;
                out.worse[kind] += f64::from(after > before) / pixels;
                for (correlation, test) in correlations[kind].iter_mut().zip([direct, total]) {
                    let test = shown(test);
                    (0..3).for_each(|c| correlation.add(f64::from(truth[c]), f64::from(test[c])));
                }
            }
            out.brighter += f64::from(sum(model) > sum(direct)) / pixels;
            out.raised += f64::from(sum(total) > sum(direct)) / pixels;
            for (mean, pixel) in out.means.iter_mut().zip([model, direct, total]) {
                *mean += sum(pixel) / (3.0 * pixels);
            }
        }
        out.correlations = correlations.map(|both| both.map(|correlation| correlation.value()));
        out
    }

    pub fn gain(&self) -> f64 {
        gain(self.errors[0], self.errors[1])
    }

    pub fn gain_codes(&self) -> f64 {
        gain(self.codes[0], self.codes[1])
    }

    pub fn correlation_gain(&self) -> f64 {
        self.correlations[0][1] - self.correlations[0][0]
    }
}

/// Sums of Pearson's correlation [ISR 20].
#[derive(Clone, Copy, Debug, Default)]
struct Correlation {
    count: f64,
    a: f64,
    b: f64,
    aa: f64,
    bb: f64,
    ab: f64,
}

impl Correlation {
    fn add(&mut self, a: f64, b: f64) {
        self.count += 1.0;
        self.a += a;
        self.b += b;
        self.aa += a * a;
        self.bb += b * b;
        self.ab += a * b;
    }

    /// NaN if one of the pictures has one value alone.
    fn value(&self) -> f64 {
        let n = self.count;
        let spread = (n * self.aa - self.a * self.a) * (n * self.bb - self.b * self.b);
        if spread > 0.0 { (n * self.ab - self.a * self.b) / spread.sqrt() } else { f64::NAN }
    }
}

/// Statistics over views, in which simple views together weigh [`SIMPLE_SHARE`], as in the dissertation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weighted {
    pub mean: f64,
    pub median: f64,
    /// Percentage of values above zero.
    pub positive: f64,
}

/// Statistics over the finite values; `None` if there are none.
pub fn weighted(rows: &[Judged], value: impl Fn(&Judged) -> f64) -> Option<Weighted> {
    let finite: Vec<(bool, f64)> =
        rows.iter().map(|row| (row.complex, value(row))).filter(|(_, value)| value.is_finite()).collect();
    let count = |complex: bool| finite.iter().filter(|(of, _)| *of == complex).count() as f64;
    let (simple, complex) = (count(false), count(true));
    let both = simple > 0.0 && complex > 0.0;
    let weight = |of: bool| match (both, of) {
        (false, _) => 1.0 / (simple + complex),
        (true, false) => SIMPLE_SHARE / simple,
        (true, true) => (1.0 - SIMPLE_SHARE) / complex,
    };
    let mut list: Vec<(f64, f64)> = finite.iter().map(|(of, value)| (*value, weight(*of))).collect();
    list.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mean = list.iter().map(|(value, weight)| value * weight).sum();
    let positive = 100.0 * list.iter().filter(|(value, _)| *value > 0.0).map(|(_, weight)| weight).sum::<f64>();
    // The mean of two values if half of the weight is exactly between them.
    let at = |share: f64| {
        let mut below = 0.0;
        let found = list.iter().find(|(_, weight)| {
            below += weight;
            below >= share
        });
        found.or(list.last()).map(|(value, _)| *value)
    };
    let median = 0.5 * (at(0.5 - 1e-9)? + at(0.5 + 1e-9)?);
    Some(Weighted { mean, median, positive })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judged(complex: bool, direct: f32, total: f32) -> Judged {
        Judged::of(("s", "v", complex), &[[0.8; 3]; 4], &[[direct; 3]; 4], |_| [total; 3])
    }

    #[test]
    fn errors_shares_and_means_of_known_pixels() {
        // Two pixels become better (one of them too bright by less than before), one worse, one stays.
        let model = [[0.5; 3], [0.5; 3], [0.5; 3], [0.0; 3]];
        let direct = [[0.25; 3], [0.25; 3], [0.5; 3], [0.0; 3]];
        let total = [[0.375; 3], [0.625; 3], [0.75; 3], [0.0; 3]];
        let row = Judged::of(("s", "v", true), &model, &direct, |i| total[i]);
        assert_eq!(row.errors, [0.125, 0.125]);
        assert_eq!((row.better, row.worse, row.brighter, row.raised), ([0.5; 2], [0.25; 2], 0.5, 0.75));
        assert_eq!(row.means, [0.375, 0.25, 0.4375]);
        assert_eq!(row.gain(), 0.0);
    }

    #[test]
    fn codes_end_at_white() {
        let row = Judged::of(("s", "v", true), &[[3.0; 3]], &[[1.0; 3]], |_| [2.0; 3]);
        assert_eq!((row.errors, row.codes), ([2.0, 1.0], [0.0, 0.0]));
        assert_eq!((row.better, row.worse), ([1.0, 0.0], [0.0, 0.0]));
    }

    #[test]
    fn the_correlation_of_a_line_is_one() {
        let model = [[0.1; 3], [0.4; 3], [0.7; 3]];
        let row =
            Judged::of(("s", "v", true), &model, &[[0.3; 3], [0.2; 3], [0.1; 3]], |i| model[i].map(|v| 2.0 * v + 0.1));
        assert!((row.correlations[0][0] + 1.0).abs() < 1e-6 && (row.correlations[0][1] - 1.0).abs() < 1e-6);
        assert!(judged(true, 0.4, 0.6).correlations[0][0].is_nan());
    }

    #[test]
    fn simple_and_complex_views_weigh_as_in_the_dissertation() {
        // One simple view of gain 50 %, three complex ones of 25 %.
        let rows = [judged(false, 0.4, 0.6), judged(true, 0.4, 0.5), judged(true, 0.4, 0.5), judged(true, 0.4, 0.5)];
        let all = weighted(&rows, Judged::gain).unwrap();
        assert!((all.mean - (50.0 * SIMPLE_SHARE + 25.0 * (1.0 - SIMPLE_SHARE))).abs() < 1e-3, "{all:?}");
        assert!((all.median - 25.0).abs() < 1e-3 && (all.positive - 100.0).abs() < 1e-9);
        assert!((weighted(&rows[..1], Judged::gain).unwrap().mean - 50.0).abs() < 1e-3);
        // Two views of one kind: the mean of both is the median.
        let two = weighted(&[judged(true, 0.4, 0.6), judged(true, 0.4, 0.5)], Judged::gain).unwrap();
        assert!((two.median - 37.5).abs() < 1e-3, "{two:?}");
        assert_eq!(weighted(&[], Judged::gain), None);
    }
}

//! The range and the tick marks of an axis.

use super::table::number;

/// The range of an axis and its marks.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Scale {
    pub low: f64,
    pub high: f64,
    pub log: bool,
    /// Value and text.
    pub marks: Vec<(f64, String)>,
}

impl Scale {
    /// The range for `values`, which begins and ends at marks. `about`: approximate number of marks.
    pub fn of(values: impl Iterator<Item = f64>, log: bool, about: usize) -> Self {
        let fits = |v: &f64| v.is_finite() && (!log || *v > 0.0);
        let (mut low, mut high) =
            values.filter(fits).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        if low > high {
            (low, high) = if log { (1.0, 10.0) } else { (0.0, 1.0) };
        }
        if log { Self::logarithmic(low, high) } else { Self::linear(low, high, about) }
    }

    fn linear(mut low: f64, mut high: f64, about: usize) -> Self {
        if high - low < 1e-9 * high.abs().max(low.abs()).max(1e-30) {
            let room = if high == 0.0 { 1.0 } else { high.abs() * 0.1 };
            (low, high) = (low - room, high + room);
        }
        let rough = (high - low) / about.max(1) as f64;
        let power = 10f64.powf(rough.log10().floor());
        let step =
            [1.0, 2.0, 5.0, 10.0].map(|f| f * power).into_iter().find(|s| *s >= rough * 0.999).unwrap_or(power * 10.0);
        let (first, last) = ((low / step + 1e-9).floor(), (high / step - 1e-9).ceil());
        let decimals = (-(step.log10().floor())).max(0.0) as usize;
        let mark = |i: i64| {
            let value = (first + i as f64) * step;
            let plain = |v: f64| {
                let text =
                    if step.abs() >= 1e7 || step.abs() < 1e-5 { number(v, 3) } else { format!("{v:.decimals$}") };
                text.replace('-', "−")
            };
            (value, if value.abs() < step * 1e-6 { "0".into() } else { plain(value) })
        };
        let count = ((last - first).clamp(1.0, 100.0)) as i64;
        Self { low: first * step, high: last * step, log: false, marks: (0..=count).map(mark).collect() }
    }

    fn logarithmic(low: f64, high: f64) -> Self {
        let (first, last) = ((low.log10() + 1e-9).floor() as i32, (high.log10() - 1e-9).ceil() as i32);
        let decades = last - first;
        if decades <= 2 {
            // A range of less than two decades begins and ends at 1, 2 or 5 times a power of ten.
            let all: Vec<f64> =
                (first - 1..=last + 1).flat_map(|e| [1.0, 2.0, 5.0].map(|f| f * 10f64.powi(e))).collect();
            let low = all.iter().copied().filter(|m| *m <= low * 1.000_001).fold(all[0], f64::max);
            let high = all.iter().copied().filter(|m| *m >= high * 0.999_999).fold(all[all.len() - 1], f64::min);
            let high = if high > low { high } else { low * 10.0 };
            let inside = all.into_iter().filter(|m| (low * 0.999..=high * 1.001).contains(m));
            return Self { low, high, log: true, marks: inside.map(|m| (m, number(m, 1))).collect() };
        }
        let every = (decades as usize).div_ceil(8).max(1);
        let marks = (first..=last).step_by(every).map(|e| (10f64.powi(e), power_of_ten(e))).collect();
        Self { low: 10f64.powi(first), high: 10f64.powi(last), log: true, marks }
    }

    /// Position of `value` on the axis: 0 at the low end, 1 at the high end.
    pub fn place(&self, value: f64) -> f64 {
        if self.log {
            (value.log10() - self.low.log10()) / (self.high.log10() - self.low.log10())
        } else {
            (value - self.low) / (self.high - self.low)
        }
    }

    /// Whether `value` can be shown.
    pub fn shows(&self, value: f64) -> bool {
        value.is_finite() && (!self.log || value > 0.0)
    }
}

fn power_of_ten(exponent: i32) -> String {
    if (-3..=4).contains(&exponent) {
        return number(10f64.powi(exponent), 1);
    }
    let raised = |c: char| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        digit => char::from_u32(0x2070 + digit as u32 - '0' as u32).unwrap_or(digit),
    };
    format!("10{}", exponent.to_string().chars().map(raised).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(scale: &Scale) -> Vec<&str> {
        scale.marks.iter().map(|(_, text)| text.as_str()).collect()
    }

    #[test]
    fn marks_are_round_numbers() {
        assert_eq!(
            texts(&Scale::of([0.13, 0.97].into_iter(), false, 5)),
            ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"].map(|t| if t == "0.0" { "0" } else { t })
        );
        assert_eq!(texts(&Scale::of([-3.0, 12.0].into_iter(), false, 4)), ["−5", "0", "5", "10", "15"]);
        assert_eq!(texts(&Scale::of([3.0, 800.0].into_iter(), true, 5)), ["1", "10", "100", "1000"]);
        assert_eq!(texts(&Scale::of([24.0, 80.0].into_iter(), true, 5)), ["20", "50", "100"]);
        assert_eq!(texts(&Scale::of([1e-9, 1e-3].into_iter(), true, 5))[..2], ["10⁻⁹", "10⁻⁸"]);
        assert_eq!(texts(&Scale::of([].into_iter(), false, 2)), ["0", "0.5", "1.0"]);
        let one = Scale::of([7.0].into_iter(), false, 4);
        assert!(one.low < 7.0 && one.high > 7.0 && one.marks.len() >= 3, "{one:?}");
    }

    #[test]
    fn values_lie_between_the_ends() {
        let scale = Scale::of([1.0, 1000.0].into_iter(), true, 5);
        assert!((scale.place(10.0) - 1.0 / 3.0).abs() < 1e-12 && !scale.shows(0.0) && !scale.shows(f64::NAN));
    }
}

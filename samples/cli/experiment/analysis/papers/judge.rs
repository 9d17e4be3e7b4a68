//! Decides whether our value meets that of a paper.

/// The rule by which a value of ours meets that of a paper. Printed values are rounded: half of their last digit, and at most [`ROUNDING`] of the value,
/// counts as no difference, but for `same`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rule {
    AtLeast,
    AtMost,
    /// The ratio is between 1/factor and factor.
    Within(f64),
    Same,
    /// On the same side of zero.
    Sign,
}

/// Largest relative difference that rounding explains.
const ROUNDING: f64 = 5e-3;

/// Half of the last digit of a printed value, at most [`ROUNDING`] of the value.
fn rounding(paper: f64) -> f64 {
    let text = paper.to_string();
    let digits = text.split_once('.').map_or(0, |(_, digits)| digits.len());
    (0.5 * 0.1f64.powi(digits as i32)).min(ROUNDING * paper.abs())
}

impl Rule {
    /// `at least`, `at most`, `within F`, `same` or `sign`.
    ///
    /// # Errors
    /// The allowed texts.
    pub fn parse(text: &str) -> Result<Self, String> {
        let factor = |text: &str| text.trim().parse::<f64>().ok().filter(|factor| *factor > 1.0);
        match text {
            "at least" => Ok(Self::AtLeast),
            "at most" => Ok(Self::AtMost),
            "same" => Ok(Self::Same),
            "sign" => Ok(Self::Sign),
            _ => text.strip_prefix("within ").and_then(factor).map(Self::Within).ok_or_else(|| {
                format!("`met` is '{text}', allowed are at least, at most, within FACTOR (above 1), same and sign")
            }),
        }
    }

    pub fn holds(self, paper: f64, ours: f64) -> bool {
        let slack = rounding(paper);
        match self {
            Self::AtLeast => ours >= paper - slack,
            Self::AtMost => ours <= paper + slack,
            Self::Within(factor) => {
                // The same sign, and neither is more than the factor times the other. A zero meets only a zero.
                let (a, b) = (paper.abs() * factor, ours.abs() * factor);
                paper.signum() * ours.signum() > 0.0 && ours.abs() <= a + slack && paper.abs() <= b + slack
                    || paper == 0.0 && ours.abs() < 1e-9
            }
            Self::Same => (ours - paper).abs() <= 1e-6 * paper.abs(),
            Self::Sign => (paper == 0.0 && ours == 0.0) || paper * ours > 0.0,
        }
    }
}

/// What became of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    Met,
    /// Not met, for a reason that a cell, a test or a page shows.
    Explained,
    Open,
    /// The experiment has no counterpart.
    NoCounterpart,
    /// Only the full mode of the experiment has the cell, and the report is of the quick mode.
    FullModeOnly,
    /// A property of the paper's machine.
    Hardware,
    /// There is no report of the experiment, or of its part with the number.
    NoReport,
}

impl Verdict {
    pub fn name(self) -> &'static str {
        match self {
            Self::Met => "met",
            Self::Explained => "explained",
            Self::Open => "open",
            Self::NoCounterpart => "no counterpart",
            Self::FullModeOnly => "full mode only",
            Self::Hardware => "paper's machine",
            Self::NoReport => "no report",
        }
    }
}

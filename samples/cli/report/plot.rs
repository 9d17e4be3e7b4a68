//! The contents of a plot; `svg` draws it.

/// One axis.
#[derive(Clone, Debug, Default)]
pub struct Axis {
    /// With its unit: `time (ms)`.
    pub label: String,
    /// Logarithmic; values that are not positive are left out.
    pub log: bool,
    /// Values that the axis always includes.
    pub include: Vec<f64>,
    /// Names of the positions 0, 1, 2… instead of numbers.
    pub names: Vec<String>,
}

impl Axis {
    pub fn new(label: impl Into<String>) -> Self {
        Self { label: label.into(), ..Self::default() }
    }

    /// Logarithmic.
    #[must_use]
    pub fn log(self) -> Self {
        Self { log: true, ..self }
    }

    /// Always includes `value`.
    #[must_use]
    pub fn with(mut self, value: f64) -> Self {
        self.include.push(value);
        self
    }

    /// Shows names instead of numbers, at the positions 0, 1, 2…
    #[must_use]
    pub fn names<N: Into<String>>(self, names: impl IntoIterator<Item = N>) -> Self {
        Self { names: names.into_iter().map(Into::into).collect(), ..self }
    }
}

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A line with dots.
    Line,
    /// Dots.
    Points,
    /// Bars from zero (the lower edge on a logarithmic axis); series stand side by side.
    Bars,
    /// Bars of a histogram, which touch: x is the left edge of a bin, and the last x the right edge of all.
    Steps,
}

/// Points of one name and colour.
#[derive(Clone, Debug)]
pub struct Series {
    pub name: String,
    pub kind: Kind,
    /// x, y, and the text of the tooltip, which may be empty.
    pub points: Vec<(f64, f64, String)>,
}

/// A straight line across the plot.
#[derive(Clone, Debug)]
pub struct Rule {
    pub at: f64,
    /// True for a horizontal line at y = `at`, false for a vertical line at x = `at`.
    pub across: bool,
    pub label: String,
}

/// A plot: axes, series and lines.
#[derive(Clone, Debug)]
pub struct Plot {
    /// Identifier in the data files; unique within the page.
    pub id: String,
    pub caption: String,
    pub x: Axis,
    pub y: Axis,
    pub series: Vec<Series>,
    pub rules: Vec<Rule>,
    /// The numbers are measured times.
    pub timed: bool,
}

impl Plot {
    pub fn new(id: impl Into<String>, caption: impl Into<String>, x: Axis, y: Axis) -> Self {
        Self { id: id.into(), caption: caption.into(), x, y, series: Vec::new(), rules: Vec::new(), timed: false }
    }

    fn series(mut self, name: impl Into<String>, kind: Kind, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let points = points.into_iter().map(|(x, y)| (x, y, String::new())).collect();
        self.series.push(Series { name: name.into(), kind, points });
        self
    }

    /// Adds a line through points.
    #[must_use]
    pub fn line(self, name: impl Into<String>, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        self.series(name, Kind::Line, points)
    }

    /// Adds dots.
    #[must_use]
    pub fn points(self, name: impl Into<String>, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        self.series(name, Kind::Points, points)
    }

    /// Adds dots with names, which the tooltips show.
    #[must_use]
    pub fn named_points(
        mut self,
        name: impl Into<String>,
        points: impl IntoIterator<Item = (f64, f64, String)>,
    ) -> Self {
        self.series.push(Series { name: name.into(), kind: Kind::Points, points: points.into_iter().collect() });
        self
    }

    /// Adds bars at 0, 1, 2…; the x axis has the names of these positions.
    #[must_use]
    pub fn bars(self, name: impl Into<String>, heights: impl IntoIterator<Item = f64>) -> Self {
        self.series(name, Kind::Bars, heights.into_iter().enumerate().map(|(i, y)| (i as f64, y)))
    }

    /// Adds a histogram of `values` with `bins` bins of equal width, from the smallest value to the largest.
    #[must_use]
    pub fn histogram(self, name: impl Into<String>, values: &[f64], bins: usize) -> Self {
        let finite = || values.iter().copied().filter(|v| v.is_finite());
        let (low, high) = finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        if low > high {
            return self.series(name, Kind::Steps, []);
        }
        let bins = bins.max(1);
        let width = if high > low { (high - low) / bins as f64 } else { 1.0 };
        let mut counts = vec![0u32; bins];
        finite().for_each(|v| counts[(((v - low) / width) as usize).min(bins - 1)] += 1);
        let mut points: Vec<(f64, f64)> =
            counts.iter().enumerate().map(|(i, count)| (low + i as f64 * width, f64::from(*count))).collect();
        points.push((low + bins as f64 * width, 0.0));
        self.series(name, Kind::Steps, points)
    }

    /// Adds a horizontal line at `y`.
    #[must_use]
    pub fn across(mut self, at: f64, label: impl Into<String>) -> Self {
        self.rules.push(Rule { at, across: true, label: label.into() });
        self
    }

    /// Adds a vertical line at `x`.
    #[must_use]
    pub fn upright(mut self, at: f64, label: impl Into<String>) -> Self {
        self.rules.push(Rule { at, across: false, label: label.into() });
        self
    }

    /// Marks the numbers as measured times, which go into the `times` files.
    #[must_use]
    pub fn timed(self) -> Self {
        Self { timed: true, ..self }
    }
}

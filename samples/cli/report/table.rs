//! Tables.

/// One cell.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    Empty,
    Text(String),
    /// Shown with a few digits; the data files have all of them.
    Number(f64),
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl From<f64> for Cell {
    fn from(value: f64) -> Self {
        Self::Number(value)
    }
}

impl From<usize> for Cell {
    fn from(value: usize) -> Self {
        Self::Number(value as f64)
    }
}

impl From<u32> for Cell {
    fn from(value: u32) -> Self {
        Self::Number(value.into())
    }
}

impl<T: Into<Cell>> From<Option<T>> for Cell {
    fn from(value: Option<T>) -> Self {
        value.map_or(Self::Empty, Into::into)
    }
}

/// Rows of cells under named columns.
#[derive(Clone, Debug)]
pub struct Table {
    /// Identifier in the data files; unique within the page.
    pub id: String,
    pub caption: String,
    pub columns: Vec<String>,
    pub rows: Vec<Vec<Cell>>,
    /// Significant digits of shown numbers.
    pub digits: usize,
    /// The numbers are measured times.
    pub timed: bool,
    /// Has many words: the page shows it as wide as the window and as high as it is, with the markup of paragraphs in its cells.
    pub long: bool,
}

impl Table {
    pub fn new<C: Into<String>>(
        id: impl Into<String>,
        caption: impl Into<String>,
        columns: impl IntoIterator<Item = C>,
    ) -> Self {
        let columns = columns.into_iter().map(Into::into).collect();
        Self { id: id.into(), caption: caption.into(), columns, rows: Vec::new(), digits: 4, timed: false, long: false }
    }

    /// A table that compares figures of a paper with ours: quantity, unit, paper, ours, ratio of ours to the paper's. [`Table::figure`] adds rows.
    pub fn figures(id: impl Into<String>, caption: impl Into<String>) -> Self {
        Self::new(id, caption, ["quantity", "unit", "paper", "ours", "ours / paper"])
    }

    /// Adds a row to [`Table::figures`]. The ratio is empty if it is not defined.
    #[must_use]
    pub fn figure(
        self,
        quantity: &str,
        unit: &str,
        paper: impl Into<Option<f64>>,
        ours: impl Into<Option<f64>>,
    ) -> Self {
        let (paper, ours) = (paper.into(), ours.into());
        let ratio = paper.zip(ours).map(|(paper, ours)| ours / paper).filter(|ratio| ratio.is_finite());
        self.row([quantity.into(), unit.into(), paper.into(), ours.into(), ratio.into()])
    }

    /// Adds a row; missing cells at its end are empty.
    #[must_use]
    pub fn row(mut self, cells: impl IntoIterator<Item = Cell>) -> Self {
        self.push(cells);
        self
    }

    /// Adds a row; missing cells at its end are empty, surplus cells are ignored.
    pub fn push(&mut self, cells: impl IntoIterator<Item = Cell>) {
        let mut row: Vec<Cell> = cells.into_iter().take(self.columns.len()).collect();
        row.resize(self.columns.len(), Cell::Empty);
        self.rows.push(row);
    }

    /// Shows numbers with `digits` significant digits.
    #[must_use]
    pub fn digits(self, digits: usize) -> Self {
        Self { digits, ..self }
    }

    /// Marks the numbers as measured times, which go into the `times` files.
    #[must_use]
    pub fn timed(self) -> Self {
        Self { timed: true, ..self }
    }

    /// Shows it as wide as the window and as high as it is, with the markup of paragraphs in its cells.
    #[must_use]
    pub fn long(self) -> Self {
        Self { long: true, ..self }
    }

    /// Whether a column holds only numbers and empty cells.
    pub(super) fn is_numeric(&self, column: usize) -> bool {
        let mut cells = self.rows.iter().map(|row| &row[column]).filter(|cell| **cell != Cell::Empty).peekable();
        cells.peek().is_some() && cells.all(|cell| matches!(cell, Cell::Number(_)))
    }
}

/// A number with `digits` significant digits and a typographic minus sign; `—` for NaN. It has an exponent only if it is very large or small.
pub fn number(value: f64, digits: usize) -> String {
    let text = if value.is_nan() {
        return "—".into();
    } else if value.is_infinite() {
        "∞".to_owned()
    } else if value == 0.0 {
        return "0".into();
    } else {
        let magnitude = value.abs();
        let exponent = magnitude.log10().floor() as i32;
        // Rounding may carry into the next power of ten, which needs one decimal less.
        let rounded: f64 = format!("{magnitude:.*e}", digits.saturating_sub(1)).parse().unwrap_or(magnitude);
        let exponent = if rounded >= 10f64.powi(exponent + 1) { exponent + 1 } else { exponent };
        if rounded.fract() == 0.0 && exponent < 9 {
            format!("{rounded:.0}")
        } else if (-4..9).contains(&exponent) {
            format!("{magnitude:.*}", (digits as i32 - 1 - exponent).max(0) as usize)
        } else {
            format!("{magnitude:.*e}", digits.saturating_sub(1))
        }
    };
    if value < 0.0 { format!("−{text}") } else { text }
}

//! The file of a ledger.

use std::collections::BTreeMap;

use lucerna::{Error, Result};
use serde::Deserialize;

/// All numbers and figures of a document, in its order.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ledger {
    /// Author, title, year.
    pub document: String,
    /// Letter that stands for the document.
    pub short: String,
    /// Experiment of references that name none.
    pub experiment: String,
    pub number: Vec<Number>,
    #[serde(default)]
    pub figure: Vec<Figure>,
}

/// A printed number.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Number {
    /// Section, table or figure.
    pub place: String,
    pub what: String,
    pub unit: String,
    pub paper: f64,
    #[serde(default)]
    pub kind: Kind,
    /// The cell that has our value.
    pub ours: Option<Reference>,
    /// The rule by which ours meets the paper's: [`super::judge::Rule`].
    pub met: Option<String>,
    /// Reason why ours may differ.
    pub reason: Option<String>,
    /// Cells, tests and pages that show the reason.
    #[serde(default)]
    pub shown: Vec<Reference>,
    /// Reason why no cell has our value.
    pub missing: Option<String>,
}

/// What a number is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    #[default]
    Result,
    /// An input of the experiment or of the method.
    Setting,
    /// A property of the paper's machine.
    Hardware,
}

/// A printed figure.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Figure {
    pub place: String,
    pub what: String,
    /// Its counterparts.
    pub ours: Option<Several>,
    /// Reason why it has none.
    pub missing: Option<String>,
    /// Cells, tests and pages that show what the figure shows in another way.
    #[serde(default)]
    pub shown: Vec<Reference>,
}

/// One reference or a list.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged)]
pub enum Several {
    One(Box<Reference>),
    List(Vec<Reference>),
}

impl Several {
    pub fn list(&self) -> &[Reference] {
        match self {
            Self::One(one) => std::slice::from_ref(one),
            Self::List(list) => list,
        }
    }
}

/// A place that has or shows a value: exactly one of `table`, `plot`, `images`, `file`, `test`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Reference {
    /// The experiment.
    #[serde(rename = "in")]
    pub experiment: Option<String>,
    pub table: Option<String>,
    /// Values of columns that find one row.
    pub row: BTreeMap<String, String>,
    pub column: Option<String>,
    /// Factor on our value, for another unit.
    pub scale: Option<f64>,
    /// Only the full mode of the experiment has the cell.
    pub full: bool,
    pub plot: Option<String>,
    pub images: Option<String>,
    /// A file of the repository.
    pub file: Option<String>,
    /// Words that stand in the file.
    pub words: Option<String>,
    /// A test: `file_stem::name`.
    pub test: Option<String>,
}

impl Ledger {
    /// # Errors
    /// `Input` with the place in the file.
    pub fn parse(name: &str, text: &str) -> Result<Self> {
        let fail = |what: String| Error::input(what).in_file(format!("papers/{name}.toml"));
        let ledger: Self = toml::from_str(text).map_err(|error| fail(error.to_string()))?;
        for number in &ledger.number {
            let at = format!("'{}' of {}", number.what, number.place);
            number.check().map_err(|what| fail(format!("{at}: {what}")))?;
        }
        for figure in &ledger.figure {
            let at = format!("figure {}", figure.place);
            figure.references().try_for_each(Reference::check).map_err(|what| fail(format!("{at}: {what}")))?;
            if figure.ours.is_some() == figure.missing.is_some() {
                return Err(fail(format!("{at}: needs either `ours` or `missing`")));
            }
        }
        Ok(ledger)
    }

    /// All references.
    #[cfg(test)]
    pub fn references(&self) -> impl Iterator<Item = &Reference> {
        let numbers = self.number.iter().flat_map(|number| number.ours.iter().chain(&number.shown));
        numbers.chain(self.figure.iter().flat_map(Figure::references))
    }
}

impl Figure {
    /// Counterparts, and what shows the figure in another way.
    pub fn references(&self) -> impl Iterator<Item = &Reference> {
        self.ours.iter().flat_map(Several::list).chain(&self.shown)
    }
}

impl Number {
    /// A time or a rate: of the machine more than of the method.
    pub fn is_time(&self) -> bool {
        ["1/s", "frames/s", "ms", "s", "min", "h", "1/(s %)"].contains(&self.unit.as_str())
    }

    fn check(&self) -> Result<(), String> {
        if !self.paper.is_finite() {
            return Err("`paper` is no finite number".into());
        }
        for reference in self.ours.iter().chain(&self.shown) {
            reference.check()?;
        }
        let Some(ours) = &self.ours else {
            let needs = self.kind != Kind::Hardware && self.missing.is_none();
            return if needs { Err("needs `ours` or `missing`".into()) } else { Ok(()) };
        };
        if ours.table.is_none() || ours.column.is_none() {
            return Err("`ours` must name a table and a column".into());
        }
        let rule = self.met.as_deref().ok_or("needs `met`")?;
        super::judge::Rule::parse(rule).map(|_| ())
    }
}

impl Reference {
    fn check(&self) -> Result<(), String> {
        let kinds = [&self.table, &self.plot, &self.images, &self.file, &self.test];
        if kinds.iter().filter(|kind| kind.is_some()).count() != 1 {
            return Err(format!("a reference needs exactly one of table, plot, images, file and test: {self:?}"));
        }
        if self.test.as_deref().is_some_and(|test| !test.contains("::")) {
            return Err(format!("a test is written as file_stem::name: {:?}", self.test));
        }
        if self.experiment.as_deref().is_some_and(|name| !super::EXPERIMENTS.contains(&name)) {
            return Err(format!("there is no experiment {:?}", self.experiment));
        }
        Ok(())
    }
}

//! Reports: one self-contained HTML file, and the same data as JSON and CSV.
//!
//! A [`Page`] is a list of sections with texts, [`Table`]s, [`Plot`]s and [`Comparison`]s of images. [`Page::write`] writes it as
//! `report.html`, `report.json` and `report.csv`. Measured times differ from run to run. Tables and plots of times
//! ([`Table::timed`], [`Plot::timed`]) therefore go into `times.json` and `times.csv`, so that the other data files are
//! bit-identical for the same pictures.
//!
//! ```
//! use lucerna_samples::report::{Axis, Page, Plot, Section, Table};
//!
//! let mut page = Page::new("Square roots");
//! let mut section = Section::new("Growth");
//! section.text("Slower than a line.");
//! section.add(Table::new("roots", "Roots", ["x", "√x"]).row(["4".into(), 2.0.into()]).row(["9".into(), 3.0.into()]));
//! let points = (1..10).map(|x| (f64::from(x), f64::from(x).sqrt()));
//! section.add(Plot::new("curve", "Roots", Axis::new("x"), Axis::new("√x")).line("√x", points));
//! page.add(section);
//! assert!(page.html().unwrap().starts_with("<!doctype html>"));
//! ```

mod data;
mod html;
mod images;
mod markdown;
mod plot;
mod svg;
mod table;
mod ticks;

use std::path::{Path, PathBuf};

use lucerna::{Error, ErrorKind, Result, image};

pub use images::{Comparison, Image};
pub use plot::{Axis, Kind, Plot, Rule, Series};
pub use table::{Cell, Table, number};

/// The contents of a report.
#[derive(Clone, Debug, Default)]
pub struct Page {
    pub title: String,
    /// A sentence or two under the title.
    pub summary: String,
    pub sections: Vec<Section>,
    /// Device, driver, versions, seeds, command line: name and value. Shown at the end of the page.
    pub facts: Vec<(String, String)>,
    /// Reasons why the report is not complete, if any; shown at the top.
    pub warnings: Vec<String>,
}

/// A part of the page with a heading.
#[derive(Clone, Debug, Default)]
pub struct Section {
    pub title: String,
    pub blocks: Vec<Block>,
}

/// A part of a section.
#[derive(Clone, Debug)]
pub enum Block {
    /// A paragraph. `*emphasis*` and `` `code` `` are markup; everything else is text.
    Text(String),
    Table(Table),
    Plot(Plot),
    Images(Box<Comparison>),
}

impl From<Table> for Block {
    fn from(table: Table) -> Self {
        Self::Table(table)
    }
}

impl From<Plot> for Block {
    fn from(plot: Plot) -> Self {
        Self::Plot(plot)
    }
}

impl From<Comparison> for Block {
    fn from(images: Comparison) -> Self {
        Self::Images(Box::new(images))
    }
}

impl Section {
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), blocks: Vec::new() }
    }

    /// Adds a paragraph.
    pub fn text(&mut self, text: impl Into<String>) {
        self.blocks.push(Block::Text(text.into()));
    }

    /// Adds a table, a plot or images.
    pub fn add(&mut self, block: impl Into<Block>) {
        self.blocks.push(block.into());
    }
}

impl Page {
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), ..Self::default() }
    }

    pub fn add(&mut self, section: Section) {
        self.sections.push(section);
    }

    fn blocks(&self) -> impl Iterator<Item = &Block> {
        self.sections.iter().flat_map(|section| &section.blocks)
    }

    /// The page as one HTML file.
    ///
    /// # Errors
    /// `Runtime` if an image cannot be packed.
    pub fn html(&self) -> Result<String> {
        html::page(self)
    }

    /// Texts and tables of the page as Markdown.
    pub fn markdown(&self) -> String {
        markdown::page(self)
    }

    /// Writes `report.html`, `report.json`, `report.csv` and, if anything was timed, `times.json` and `times.csv` into a folder.
    /// Each file is written as a whole or not at all. Returns their paths, the page first.
    ///
    /// # Errors
    /// `Output` if a file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<Vec<PathBuf>> {
        let mut files = vec![
            ("report.html", self.html()?),
            ("report.json", data::json(self, false)?),
            ("report.csv", data::csv(self, false)),
        ];
        if data::has_times(self) {
            files.push(("times.json", data::json(self, true)?));
            files.push(("times.csv", data::csv(self, true)));
        }
        let mut written = Vec::new();
        for (name, text) in files {
            let path = folder.join(name);
            write_own(&path, text.as_bytes())?;
            written.push(path);
        }
        Ok(written)
    }
}

/// Writes a file of a report's folder. Refuses symbolic links: an untrusted folder must not decide which file is overwritten.
///
/// # Errors
/// `Output` if it is a link or cannot be written.
pub(crate) fn write_own(path: &Path, bytes: &[u8]) -> Result<()> {
    if path.is_symlink() {
        let what = "is a symbolic link, which may lead out of the report's folder";
        return Err(Error::new(ErrorKind::Output, what).in_file(path).help("Remove it"));
    }
    image::write_atomic(path, bytes, true)
}

//! The ledgers of the papers: every number and figure that a paper prints, beside the cell of a report that has ours.
//!
//! A ledger is a file of `samples/papers/`. It names cells of reports and holds no value of ours, so that the page of all papers ([`summary`]) follows
//! from the reports of the experiments alone.

mod judge;
mod ledger;
mod page;
mod reports;
#[cfg(test)]
mod tests;

use std::path::Path;

use lucerna::{Error, Result};

use crate::report::Page;

/// The experiments of all papers, in the order in which `lucerna reproduce all` runs them.
pub const EXPERIMENTS: &[&str] = &["isr", "isr-pair", "igi", "fiv", "tonemap", "daylight", "prt"];

/// The ledgers: name and text.
const LEDGERS: &[(&str, &str)] = &[
    ("isr", include_str!("../../../../papers/isr.toml")),
    ("igi", include_str!("../../../../papers/igi.toml")),
    ("fiv", include_str!("../../../../papers/fiv.toml")),
    ("tonemap", include_str!("../../../../papers/tonemap.toml")),
    ("daylight", include_str!("../../../../papers/daylight.toml")),
    ("prt", include_str!("../../../../papers/prt.toml")),
];

/// Whether `folder` holds reports of experiments of papers in folders of their names.
pub fn is_summary(folder: &Path) -> bool {
    EXPERIMENTS.iter().any(|name| folder.join(name).join("report.json").is_file())
}

/// The page of all papers, from the reports in the folders of `folder` that have the experiments' names.
///
/// # Errors
/// `Input` if there is no report, or if one cannot be read.
pub fn summary(folder: &Path) -> Result<Page> {
    let reports = reports::Reports::read(folder)?;
    if reports.is_empty() {
        let what = format!("holds no report of an experiment ({})", EXPERIMENTS.join(", "));
        return Err(Error::input(what).in_file(folder).help("`lucerna reproduce all -o DIR` writes such a folder"));
    }
    Ok(page::page(&ledgers()?, &reports))
}

/// All ledgers.
fn ledgers() -> Result<Vec<ledger::Ledger>> {
    LEDGERS.iter().map(|(name, text)| ledger::Ledger::parse(name, text)).collect()
}

/// Checks the ledgers, before experiments of hours are run for them.
///
/// # Errors
/// `Input` with the entry that has a mistake.
pub fn check() -> Result<()> {
    ledgers().map(|_| ())
}

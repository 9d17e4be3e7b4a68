//! Analyses: functions that turn the results of an experiment into tables, plots and images.

mod compare;
mod daylight;
mod fiv;
mod igi;
mod isr;
mod observer;
pub mod papers;
mod prt;
mod tonemap;
mod yardstick;

use lucerna::{Error, Result};

use super::{file::Experiment, results::Results};
use crate::{config, report::Page};

/// Fills the page, which already has title, summary, warnings and facts.
pub type Analysis = fn(&Results, &mut Page) -> Result<()>;

/// All analyses, by the name that a file gives.
const ANALYSES: &[(&str, Analysis)] = &[
    ("compare", compare::analyse),
    ("daylight", daylight::analyse),
    ("fiv", fiv::analyse),
    ("igi", igi::analyse),
    ("isr", isr::analyse),
    ("isr-pair", isr::pair::analyse),
    ("prt", prt::analyse),
    ("tonemap", tonemap::analyse),
    ("yardstick", yardstick::analyse),
];

/// Finds an analysis.
///
/// # Errors
/// `Input` if there is none of this name.
pub fn find(name: &str) -> Result<Analysis> {
    ANALYSES.iter().find(|(known, _)| *known == name).map(|(_, analysis)| *analysis).ok_or_else(|| {
        let names: Vec<&str> = ANALYSES.iter().map(|(name, _)| *name).collect();
        let hint = config::nearest(name, names.iter().copied()).map(|name| format!(" (did you mean '{name}'?)"));
        Error::input(format!("no analysis '{name}'{}; there are {}", hint.unwrap_or_default(), names.join(", ")))
    })
}

/// Checks the additional requirements of an analysis on its experiment.
///
/// # Errors
/// `Input`, naming the key.
pub fn check(experiment: &Experiment) -> Result<()> {
    if experiment.analysis == "igi" { igi::check(experiment) } else { Ok(()) }
}

/// The report of an experiment.
///
/// # Errors
/// Those of its analysis.
pub fn report(results: &Results) -> Result<Page> {
    let experiment = &results.experiment;
    let mut page = Page::new(&experiment.title);
    page.summary.clone_from(&experiment.summary);
    page.facts.clone_from(&results.facts);
    if experiment.quick {
        page.warnings
            .push("Quick mode: fewer views, smaller pictures or fewer samples than the experiment proper.".into());
    }
    if !experiment.narrowed.is_empty() {
        page.warnings.push(format!("A part of the experiment, chosen by {}.", experiment.narrowed));
    }
    if results.missing > 0 {
        let (there, missing) = (results.runs.len(), results.missing);
        page.warnings.push(format!(
            "Not complete: {missing} of {} runs are missing. Run the same command again to continue.",
            there + missing
        ));
    }
    for (what, why) in &results.skipped {
        page.warnings.push(format!("Left out: {what} ({why})."));
    }
    find(&experiment.analysis)?(results, &mut page)?;
    Ok(page)
}

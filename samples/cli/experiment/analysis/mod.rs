//! What the results of an experiment mean: functions that turn them into tables, plots and images.

mod compare;
mod fiv;
mod igi;
mod isr;
mod tonemap;

use lucerna::{Error, Result};

use super::{file::Experiment, results::Results};
use crate::{config, report::Page};

/// Fills the page. Title, summary, warnings and facts are there already.
pub type Analysis = fn(&Results, &mut Page) -> Result<()>;

/// All analyses, by the name that a file gives.
const ANALYSES: &[(&str, Analysis)] = &[
    ("compare", compare::analyse),
    ("fiv", fiv::analyse),
    ("igi", igi::analyse),
    ("isr", isr::analyse),
    ("tonemap", tonemap::analyse),
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

/// What an analysis asks of an experiment beyond what all do.
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
    if results.missing > 0 {
        let (there, missing) = (results.runs.len(), results.missing);
        page.warnings.push(format!(
            "Not complete: {missing} of {} runs are still to be done. Run the same command again to go on.",
            there + missing
        ));
    }
    for (what, why) in &results.skipped {
        page.warnings.push(format!("Left out: {what} ({why})."));
    }
    find(&experiment.analysis)?(results, &mut page)?;
    Ok(page)
}

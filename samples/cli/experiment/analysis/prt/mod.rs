//! Precomputed transfer: section 6 of Leonhardt and Bohn, with their figures beside ours, and the study that they leave open.
//!
//! Pictures of the kind `prt` are held against the reference of the kind `prt-truth` for the same view and lights. `paper` and `ours` are the paper's
//! settings and the defaults; techniques whose names begin with `study` belong to [`study`].

mod beside;
mod errors;
mod figures;
mod paper;
mod study;

#[cfg(test)]
mod tests;

use lucerna::Result;

pub(super) use self::errors::{Errors, mean};

use crate::{experiment::results::Results, report::Page};

pub(super) fn analyse(results: &Results, page: &mut Page) -> Result<()> {
    let cases = errors::cases(results)?;
    let measured = errors::measure(results, &cases)?;
    for section in [
        paper::section(results, &cases)?,
        beside::section(results, &measured)?,
        beside::mean_and_darkness(results, &cases)?,
        study::section(results, &measured)?,
        figures::bake(results, &cases)?,
        figures::light(results, &cases)?,
    ] {
        section.into_iter().for_each(|section| page.add(section));
    }
    Ok(())
}

//! Baked daylight: sections 3.2 and 4 of Bahnsen et al. (2012), with their figures beside ours, and what goes beyond.
//!
//! Runs of the kind `daylight-frames` give the frames of a day. Techniques of the kind `daylight` are held against the reference of the same name
//! with `, truth` ([`beside`]).

mod beside;
mod between;
mod day;
mod sizes;
mod variance;

use lucerna::Result;

use self::day::Day;
use crate::{
    experiment::results::{Done, Results},
    report::{Page, Section, Table},
};

/// Name of the technique that gives the frames of a day.
const FRAMES: &str = "frames";
/// Longest side of an image in the page, pixels.
const SIDE: u32 = 512;

pub(super) fn analyse(results: &Results, page: &mut Page) -> Result<()> {
    let runs: Vec<&Done> = results.of(FRAMES).collect();
    let days = runs.iter().map(|run| Day::read(results, run)).collect::<Result<Vec<Day>>>()?;
    if !days.is_empty() {
        let [variance, restored] = variance::sections(&days)?;
        page.add(variance);
        page.add(sizes::before_and_after(results, &days, &runs)?);
        page.add(restored);
        page.add(between::adaptive(&days)?);
        page.add(between::interpolation(&days)?);
    }
    page.add(beside::section(results)?);
    if !days.is_empty() {
        page.add(sizes::error_and_bytes(&days)?);
    }
    page.add(times(results, &days, &runs)?);
    Ok(())
}

/// Times of the bakes and of the references.
fn times(results: &Results, days: &[Day], runs: &[&Done]) -> Result<Section> {
    let mut section = Section::new("Time");
    section.text(
        "*Bake* is the time of the paths for all times of the day and of the compression. *Reference* is the median time of one picture by the path tracer, \
         times the number of lit frames beside it; its noise is not that of the bake. `cargo bench --bench daylight_cost` compares both at equal error.",
    );
    let columns = ["scene", "lit frames", "bake (s)", "reference (s)", "times lit frames (s)", "frame (ms)"];
    let mut table = Table::new("times", "Measured times", columns).timed();
    for (day, run) in days.iter().zip(runs) {
        let median = |name: &str| -> Result<Option<f64>> {
            let mut list = Vec::new();
            for other in results
                .runs
                .iter()
                .filter(|other| other.method == name && other.scene == run.scene && other.view == run.view)
            {
                list.extend(results.times(other)?.frame());
            }
            list.sort_by(f64::total_cmp);
            Ok(list.get(list.len() / 2).copied())
        };
        let bake = results.times(run)?.frame().map(|ms| ms / 1e3);
        let reference = median("day, truth")?.map(|ms| ms / 1e3);
        table.push([
            day.name.as_str().into(),
            day.len().into(),
            bake.into(),
            reference.into(),
            reference.map(|seconds| seconds * day.len() as f64).into(),
            median("day")?.into(),
        ]);
    }
    section.add(table);
    Ok(section)
}

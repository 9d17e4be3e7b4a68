//! Baked daylight: sections 3.2 and 4 of Bahnsen et al. (2012), with their figures beside ours, and what goes beyond.
//!
//! Runs of the kind `daylight-frames` give the frames of a day. Techniques of the kind `daylight` are held against the reference of the same name
//! with `, truth` ([`beside`]).

mod added;
mod beside;
mod between;
mod day;
mod elements;
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
        page.add(noise(results, &days, &runs)?);
        let [variance, restored] = variance::sections(&days)?;
        page.add(variance);
        page.add(sizes::before_and_after(results, &days, &runs)?);
        page.add(restored);
        page.add(between::adaptive(&days)?);
        page.add(between::interpolation(&days)?);
    }
    if let Some(section) = elements::section(results)? {
        page.add(section);
    }
    page.add(beside::section(results)?);
    if let Some(section) = added::section(results)? {
        page.add(section);
    }
    if !days.is_empty() {
        page.add(sizes::error_and_bytes(&days)?);
    }
    page.add(times(results, &days, &runs)?);
    Ok(())
}

/// What the frames are, and their noise.
fn noise(results: &Results, days: &[Day], runs: &[&Done]) -> Result<Section> {
    let mut section = Section::new("The frames");
    section.text(
        "A frame is the indirect light of the sun at a lit step of the day: all light of the sun but what surfaces have from it directly. One set of paths \
         serves all times. The paper has photon maps with final gathering, which are smooth; paths have noise, and noise is no signal that a few vectors \
         describe. So a filter averages neighbouring pixels on the same surface, with the same weights at all times. It blurs small shadows of indirect \
         light. *Noise left* is the root mean square of the noise over the mean of the frame, from two halves of the paths, after the filter. Errors below \
         that are of the size of the noise or smaller are errors of noise. Where errors are relative to the mean of a frame, frames darker than a \
         thousandth of the brightest one do not count.",
    );
    let columns = [
        "scene",
        "pixels",
        "steps",
        "lit",
        "radius of the filter (pixels)",
        "noise left, median frame (%)",
        "worst frame, dark ones included (%)",
    ];
    let mut table = Table::new("frames", "Frames and their noise", columns);
    for (day, run) in days.iter().zip(runs) {
        let times = results.times(run)?;
        let percent = |name: &str| times.fact(name).map(|value| 100.0 * value);
        table.push([
            day.name.as_str().into(),
            format!("{}×{}", day.width, day.height).into(),
            day.steps.into(),
            day.len().into(),
            times.fact("filter").into(),
            percent("median noise").into(),
            percent("worst noise").into(),
        ]);
    }
    section.add(table);
    Ok(section)
}

/// Times of the bakes and of the references.
fn times(results: &Results, days: &[Day], runs: &[&Done]) -> Result<Section> {
    let mut section = Section::new("Time");
    section.text(
        "*Bake* is the time of the paths for all times of the day and of the compression. *Reference* is the median time of one picture by the path tracer, \
         times the number of lit frames beside it; its noise is not that of the bake. `cargo bench -p lucerna-samples --bench daylight_cost` compares both at equal error.",
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

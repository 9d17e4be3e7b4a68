//! Ideas after Marques and Santos, each compared with the technique that it improves.
//!
//! The analysis finds techniques by their names. The table `beside` of the experiment's parameters names pairs of techniques. `all` and `picked`
//! have a matrix of `igi.vpls`. `mirrors` and `mirrors, cache` have specular surfaces.

use lucerna::{Result, measure::Measure};

use super::{mean, name, reference, stages::spent};
use crate::{
    experiment::results::{Done, Layer, Results},
    report::{Axis, Plot, Section, Table},
};

/// Techniques with their own sections.
pub(super) const OWN: [&str; 4] = [ALL, PICKED, MIRRORS, CACHE];
/// Techniques of the section on many virtual lights.
pub(super) const MANY: [&str; 2] = [ALL, PICKED];
const ALL: &str = "all";
const PICKED: &str = "picked";
const MIRRORS: &str = "mirrors";
const CACHE: &str = "mirrors, cache";

/// A run by the name of its technique. Of the exact variants, the run with the usual number of virtual lights.
fn run<'a>(results: &'a Results, view: (&'a str, &'a str), method: &str) -> Option<&'a Done> {
    match method {
        super::EXACT | super::EXACT_SPECULAR => super::counted(results, view, method),
        _ => results.at(view).find(|run| run.method == method),
    }
}

fn error(results: &Results, truth: &Done, layer: &'static str, run: &Done) -> Result<Option<f64>> {
    let values = results.measures(&[Measure::RelMse], Layer(truth, layer), Layer(run, layer), None)?;
    Ok(values.first().copied())
}

/// The ratio, if it is finite.
fn over(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    a.zip(b).map(|(a, b)| a / b).filter(|ratio| ratio.is_finite())
}

/// Errors and times of each idea, relative to the technique that it improves.
pub(super) fn successors(results: &Results) -> Result<Section> {
    let mut section = Section::new("What the ideas after the paper buy");
    section.text(
        "Each idea is compared with the technique in the column *beside*. *Error*: ratio of their relative mean squared errors of the indirect light \
         against the path tracer; below 1 is better. *Time*: ratio of their times for the stages indirect and filters (gathering, refinement, \
         compensation, despeckling, smoothing, upsampling), and for the whole frame. *Light*: mean of the indirect light over the reference's mean, \
         before and with the idea.",
    );
    let columns = ["scene", "idea", "beside", "error", "light before", "light"];
    let mut errors = Table::new("successors", "Errors", columns);
    let mut times = Table::new("successors-times", "Times", ["scene", "idea", "beside", "indirect", "frame"]).timed();
    let pairs = results.experiment.parameters.get("beside").and_then(serde_json::Value::as_object);
    for view in results.views() {
        for (idea, other) in pairs.into_iter().flatten() {
            let other = other.as_str().unwrap_or_default();
            let Some((new, old)) = run(results, view, idea).zip(run(results, view, other)) else { continue };
            let (mut ratio, mut light) = (None, [None; 2]);
            if let Some(truth) = reference(results, view) {
                ratio = over(error(results, truth, "indirect", new)?, error(results, truth, "indirect", old)?);
                let whole = mean(results, truth, "indirect")?;
                light = [
                    over(Some(mean(results, old, "indirect")?), Some(whole)),
                    over(Some(mean(results, new, "indirect")?), Some(whole)),
                ];
            }
            let names = [name(view).into(), idea.as_str().into(), other.into()];
            errors.push(names.clone().into_iter().chain([ratio.into(), light[0].into(), light[1].into()]));
            let (new, old) = (spent(results, new)?, spent(results, old)?);
            let gathering = over(Some(new.gathering_and_filters()), Some(old.gathering_and_filters()));
            let frame = over(new.frame, old.frame);
            times.push(names.into_iter().chain([gathering.into(), frame.into()]));
        }
    }
    section.add(errors);
    section.add(times);
    Ok(section)
}

/// Cost and error against the number of virtual lights.
pub(super) fn many(results: &Results) -> Result<Section> {
    let mut section = Section::new("Many virtual lights");
    section.text(
        "*All*: a shadow ray to each virtual light. *Picked*: a fixed number of picks per pixel from the light tree. Errors are relative mean squared \
         errors of the indirect light against the path tracer, without downsampling and interleaving. *Exponent*: exponent of the growth in time since \
         the row above; 1 is linear.",
    );
    let columns = ["scene", "way", "virtual lights", "gathering (ms)", "exponent"];
    let mut times = Table::new("many-times", "Time against the number of virtual lights", columns).timed();
    let columns = ["scene", "way", "virtual lights", "error", "light"];
    let mut errors = Table::new("many", "Error against the number of virtual lights", columns);
    let axis = || Axis::new("virtual lights").log();
    let mut time_plot = Plot::new("many-times-plot", "Time of gathering", axis(), Axis::new("ms").log());
    let mut error_plot = Plot::new("many-plot", "Error of the indirect light", axis(), Axis::new("relative MSE").log());
    for view in results.views() {
        for method in [ALL, PICKED] {
            let [mut time_line, mut error_line] = [const { Vec::<(f64, f64)>::new() }; 2];
            for run in results.at(view).filter(|run| run.method == method) {
                let Some(count) = run.value("igi.vpls").and_then(|count| count.parse::<f64>().ok()) else { continue };
                let ms = spent(results, run)?.indirect();
                let exponent = time_line.last().map(|(before, of)| (ms / of).ln() / (count / before).ln());
                times.push([name(view).into(), method.into(), count.into(), ms.into(), exponent.into()]);
                time_line.push((count, ms));
                let Some(truth) = reference(results, view) else { continue };
                let error = error(results, truth, "indirect", run)?;
                let light = over(Some(mean(results, run, "indirect")?), Some(mean(results, truth, "indirect")?));
                errors.push([name(view).into(), method.into(), count.into(), error.into(), light.into()]);
                error_line.extend(error.map(|error| (count, error)));
            }
            let label = format!("{}, {method}", name(view));
            if !time_line.is_empty() {
                time_plot = time_plot.line(label.clone(), time_line);
            }
            if !error_line.is_empty() {
                error_plot = error_plot.line(label, error_line);
            }
        }
    }
    section.add(times);
    section.add(time_plot.timed());
    section.add(errors);
    section.add(error_plot);
    Ok(section)
}

/// The irradiance cache for surfaces that mirrors and glass show.
pub(super) fn cached(results: &Results) -> Result<Section> {
    let mut section = Section::new("Behind mirrors and glass");
    section.text(
        "Surfaces that mirrors and glass show also gather from all virtual lights. The irradiance cache makes this faster. Times of the stage *direct \
         and specular* and of the frame are relative to the times without the cache; errors are for the whole picture against the picture without it.",
    );
    let columns = ["scene", "direct and specular", "frame"];
    let mut times = Table::new("cache-times", "Time with the cache over time without", columns).timed();
    let columns = ["scene", "rel. MSE", "FLIP", "PDiff"];
    let mut errors = Table::new("cache", "Errors of the cache", columns);
    for view in results.views() {
        let Some((without, with)) = run(results, view, MIRRORS).zip(run(results, view, CACHE)) else { continue };
        let (plain, cached) = (spent(results, without)?, spent(results, with)?);
        let ratio = over(Some(cached.direct()), Some(plain.direct()));
        times.push([name(view).into(), ratio.into(), over(cached.frame, plain.frame).into()]);
        let list = [Measure::RelMse, Measure::Flip, Measure::Pdiff];
        let values = results.measures(&list, Layer(without, ""), Layer(with, ""), None)?;
        let values = (0..list.len()).map(|i| values.get(i).copied().into());
        errors.push(std::iter::once(name(view).into()).chain(values));
    }
    section.add(times);
    section.add(errors);
    Ok(section)
}

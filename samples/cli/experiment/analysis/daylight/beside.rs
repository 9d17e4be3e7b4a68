//! Section 4.1: the technique against the path tracer, at several times, in other weather and another season.

use lucerna::{
    Result,
    measure::{Display, Measure},
};

use super::{SIDE, day::mean};
use crate::{
    experiment::{
        file::Role,
        place::spread,
        results::{Done, Layer, Results},
    },
    report::{Axis, Cell, Comparison, Plot, Section, Table},
};

/// Techniques of pictures and their names in tables.
const DAYS: [(&str, &str); 10] = [
    ("day", "the day of the experiment"),
    ("cube", "the same day, from a cube"),
    ("lightmap", "the same day, from a lightmap"),
    ("coarse lightmap", "the same day, from a coarse lightmap"),
    ("lightmap without backs", "the same day, from a lightmap without texels on backs"),
    ("lightmap without directions", "the same day, from a lightmap; gloss without directions"),
    ("probes", "the same day with a pot, lit by probes"),
    ("diffuse", "the same day, diffuse surfaces on both sides"),
    ("overcast", "the same day, overcast"),
    ("winter", "a winter day"),
];
const MEASURES: [Measure; 3] = [Measure::RelMse, Measure::Flip, Measure::Pdiff];

/// A picture and its reference.
pub(super) struct Two<'a> {
    pub run: &'a Done,
    pub truth: &'a Done,
    pub time: String,
}

/// Time of a picture: the value of a matrix of `…daylight.time`.
fn time(run: &Done) -> Option<String> {
    let (key, _) = run.variant.iter().find(|(key, _)| key.ends_with("daylight.time"))?;
    run.value(key)
}

/// The pictures of a technique at a view, each with its reference.
pub(super) fn pairs<'a>(results: &'a Results, view: (&'a str, &'a str), name: &str) -> Vec<Two<'a>> {
    let mut pairs = Vec::new();
    for run in results.at(view).filter(|run| run.method == name) {
        let Some(time) = time(run) else { continue };
        let reference = reference_of(name);
        let truth = results.with_role(Role::Reference).find(|other| {
            (other.scene.as_str(), other.view.as_str()) == view
                && other.method == reference
                && self::time(other).as_ref() == Some(&time)
        });
        pairs.extend(truth.map(|truth| Two { run, truth, time }));
    }
    pairs
}

/// Name of the reference of a technique.
fn reference_of(name: &str) -> String {
    let is_same_light = matches!(name, "cube" | "coarse lightmap") || name.starts_with("lightmap");
    let day = if is_same_light { "day" } else { name };
    format!("{day}, truth")
}

/// Hours after midnight of `07:40`.
fn hours(time: &str) -> f64 {
    time.split(':').zip([1.0, 60.0, 3600.0]).filter_map(|(part, unit)| Some(part.parse::<f64>().ok()? / unit)).sum()
}

pub(super) fn section(results: &Results) -> Result<Section> {
    let mut section = Section::new("Section 4.1: the technique against the path tracer");
    section.text(
        "The light of sun and sky alone; the scene's own lights are off. The path tracer has all surfaces as they are; gloss of the \
         technique reflects baked light as light from everywhere alike, without its direction. One row has diffuse surfaces alone on both sides: what \
         differs there is neither gloss nor a mirror. *Energy* is the mean of the picture over that of the reference, *baked* the same for all light but the sun's direct \
         light. All errors are of linear radiance; *FLIP* and *PDiff* are of the picture as a screen shows it at the exposure that suits the reference. Where the sun shines, few \
         pixels at the edges of its light may make most of the relative MSE of the picture. The paper shows such pictures with 3ds Max as its reference, and gives no numbers. Reference pictures have noise of their own, and \
         the bake has its noise too (see the table of sizes).",
    );
    let columns =
        ["scene", "day", "time", "energy", "energy, baked", "rel. MSE", "rel. MSE, baked", "FLIP", "PDiff (%)"];
    let mut table = Table::new("beside", "Errors of the technique", columns);
    let (x, y) = (Axis::new("time of day (h)"), Axis::new("energy over the reference's").with(1.0));
    let mut plot = Plot::new("energy", "Energy of the baked light through the day", x, y).across(1.0, "reference");
    let mut sets = Vec::new();
    let views = results.views();
    for view in &views {
        let name = format!("{}, {}", view.0, view.1);
        for (method, what) in DAYS {
            let mut line = Vec::new();
            for Two { run, truth, time } in pairs(results, *view, method) {
                let baked = energy(results, truth, run, "indirect")?;
                let of = |layer, list: &[Measure]| results.measures(list, Layer(truth, layer), Layer(run, layer), None);
                let (all, light) = (of("", &MEASURES)?, of("indirect", &MEASURES[..1])?);
                let cell = |list: &[f64], index: usize| Cell::from(list.get(index).copied());
                table.push([
                    name.as_str().into(),
                    what.into(),
                    time.as_str().into(),
                    energy(results, truth, run, "")?.into(),
                    baked.into(),
                    cell(&all, 0),
                    cell(&light, 0),
                    cell(&all, 1),
                    cell(&all, 2),
                ]);
                line.extend(baked.map(|baked| (hours(&time), baked)));
            }
            if !line.is_empty() {
                plot = plot.line(format!("{name}, {what}"), line);
            }
            sets.push((*view, method, what));
        }
    }
    section.add(table);
    section.add(plot);
    for (view, method, what) in sets {
        let all = pairs(results, view, method);
        for Two { run, truth, time } in spread(&all, Some(results.experiment.images)) {
            let reference = results.picture(Layer(truth, ""))?;
            let (scene, camera) = view;
            // A scene's own exposure is for its own lights.
            let stops = Display::default().stops(&reference);
            let id = format!("{scene}-{camera}-{method}-{}", time.replace(':', ""));
            let title = format!("{scene}, {camera}, {what}, {time}");
            let set = Comparison::new(id, title, reference.width, reference.height)
                .exposure(stops)
                .with("baked daylight", results.picture(Layer(run, ""))?.pixels)
                .with("path tracer", reference.pixels)
                .with("baked light", results.picture(Layer(run, "indirect"))?.pixels)
                .with("path tracer, without the sun's direct light", results.picture(Layer(truth, "indirect"))?.pixels);
            section.add(set.at_most(SIDE));
        }
    }
    Ok(section)
}

/// Mean of a layer over that of the reference; `None` in darkness.
fn energy(results: &Results, truth: &Done, run: &Done, layer: &str) -> Result<Option<f64>> {
    let [wanted, found] = [truth, run].map(|run| results.picture(Layer(run, layer)));
    let wanted = mean(&wanted?.pixels);
    let found = mean(&found?.pixels);
    Ok((wanted > 0.0).then_some(found / wanted))
}

//! The dissertation's own pair (sections 5.2 and 5.3): its choices of settings against the model images of POV-Ray with the radiosity of table 1, in
//! the light of listing 9, and the reasons for the differences to its figures.
//!
//! The analysis finds techniques and references by their names: `paper`, `paper, large`, `sweep`, `occluders`, `samples`, `patterns`, `shadows`, `no occlusion`, `lit`; `povray` and its variants; `eq. 16`,
//! `inverse square` and the path tracer with the same law, for the scenes with lamps.

mod judged;
mod reasons;
mod tables;

use lucerna::{Error, Result};

use judged::Judged;

use crate::{
    experiment::{
        place::spread,
        results::{Done, Layer, Results},
    },
    report::{Comparison, Page, Section},
};

/// The model image of the figures.
const MODEL: &str = "povray";
/// The technique of the figures.
const PAPER: &str = "paper";
/// The same with the reach of the larger pictures.
const PAPER_LARGE: &str = "paper, large";
/// Group of the scenes at the dissertation's size.
const LARGE: &str = "large";
/// Longest side of an image in the page, pixels.
const SIDE: u32 = 512;

pub(in super::super) fn analyse(results: &Results, page: &mut Page) -> Result<()> {
    page.add(tables::pair(results)?);
    page.add(reasons::models(results)?);
    page.add(reasons::needed(results)?);
    page.add(reasons::sweep(results)?);
    page.add(reasons::occluders(results)?);
    page.add(tables::samples(results)?);
    page.add(reasons::law(results)?);
    page.add(images(results)?);
    Ok(())
}

fn is_large(run: &Done) -> bool {
    run.group == LARGE
}

/// Compares all runs that pass `select` with the run `model` of their view.
fn against(results: &Results, model: &str, select: impl Fn(&Done) -> bool) -> Result<Vec<Judged>> {
    Ok(at_strengths(results, model, select, &[1.0])?.pop().unwrap_or_default())
}

/// The same with the light that image-space radiosity adds multiplied by each of `factors`: a list of views for each factor.
fn at_strengths(
    results: &Results,
    model: &str,
    select: impl Fn(&Done) -> bool,
    factors: &[f32],
) -> Result<Vec<Vec<Judged>>> {
    let mut all = vec![Vec::new(); factors.len()];
    for run in results.runs.iter().filter(|run| select(run)) {
        let Some(truth) = results.beside(run, model) else { continue };
        let pixels = |run: &Done, layer: &str| results.picture(Layer(run, layer)).map(|picture| picture.pixels);
        let (model, direct, total) = (pixels(truth, "")?, pixels(run, "direct")?, pixels(run, "")?);
        if model.len() != direct.len() || model.len() != total.len() {
            return Err(Error::input(format!("{}/{}: the pictures differ in size", run.scene, run.view)));
        }
        let complex = run.triangles > super::SIMPLE;
        let added = if factors.iter().any(|factor| *factor != 1.0) { pixels(run, "indirect")? } else { Vec::new() };
        for (rows, factor) in all.iter_mut().zip(factors) {
            let shown = |i: usize| match *factor {
                1.0 => total[i],
                factor => [0, 1, 2].map(|c: usize| total[i][c] + (factor - 1.0) * added[i][c]),
            };
            rows.push(Judged::of((&run.scene, &run.view, complex), &model, &direct, shown));
        }
    }
    Ok(all)
}

fn images(results: &Results) -> Result<Section> {
    let mut section = Section::new("Images");
    section.text("Linear values; 1 is white. The model image is POV-Ray's with the brightness of 2.4.");
    let views: Vec<&Done> = results.of(PAPER).filter(|run| !is_large(run)).collect();
    // Figures 5.11 and 5.12: the views whose correlation gains most, and least.
    let rows = against(results, MODEL, |run| run.method == PAPER && !is_large(run))?;
    let mut order: Vec<&Judged> = rows.iter().filter(|row| row.correlation_gain().is_finite()).collect();
    order.sort_by(|a, b| a.correlation_gain().total_cmp(&b.correlation_gain()));
    let of = |row: &Judged| views.iter().copied().find(|run| run.scene == row.scene && run.view == row.view);
    let ends = [
        ("figure-5-11", "Figure 5.11, best correlation gain", order.last()),
        ("figure-5-12", "Figure 5.12, worst correlation gain", order.first()),
    ];
    for (id, title, row) in ends {
        let Some((row, run)) = row.and_then(|row| Some((row, of(row)?))) else { continue };
        let caption = format!("{title} ({:+.5}): {}, {}", row.correlation_gain(), run.scene, run.view);
        section.add(beside_model(results, run, id.into(), caption)?);
    }
    for run in spread(&views, Some(results.experiment.images)) {
        if results.beside(run, MODEL).is_some() {
            let (id, caption) = (format!("{}-{}", run.scene, run.view), format!("{}, {}", run.scene, run.view));
            section.add(beside_model(results, run, id, caption)?);
        }
    }
    // Figures 5.6 and 4.5: variants of one view beside each other.
    for (id, title, method, key) in [
        ("figure-5-6", "Figure 5.6: number of samples", "samples", "isr.samples"),
        ("figure-4-5", "Figure 4.5: shadow maps", "shadows", "shadow.kind"),
    ] {
        let Some(first) = results.of(method).next() else { continue };
        let mut set: Option<Comparison> = None;
        for run in results.at((&first.scene, &first.view)).filter(|run| run.method == method) {
            let picture = results.picture(Layer(run, ""))?;
            let caption = format!("{title} ({}, {})", run.scene, run.view);
            let size = (picture.width, picture.height);
            let current = set.take().unwrap_or_else(|| Comparison::new(id, caption, size.0, size.1).exposure(0.0));
            set = Some(current.with(run.value(key).unwrap_or_default(), picture.pixels));
        }
        if let Some(set) = set {
            section.add(set.at_most(SIDE));
        }
    }
    Ok(section)
}

/// The model image of a view, direct light, image-space radiosity and variants.
fn beside_model(results: &Results, run: &Done, id: String, caption: String) -> Result<Comparison> {
    let direct = results.picture(Layer(run, "direct"))?;
    let mut set = Comparison::new(id, caption, direct.width, direct.height).exposure(0.0);
    if let Some(model) = results.beside(run, MODEL) {
        set = set.with("model image", results.picture(Layer(model, ""))?.pixels);
    }
    set =
        set.with("direct light", direct.pixels).with("image-space radiosity", results.picture(Layer(run, ""))?.pixels);
    for (method, name) in [("povray-1", "model image, brightness 1"), ("lit", "sender `lit`")] {
        if let Some(other) = results.beside(run, method) {
            set = set.with(name, results.picture(Layer(other, ""))?.pixels);
        }
    }
    Ok(set.at_most(SIDE))
}

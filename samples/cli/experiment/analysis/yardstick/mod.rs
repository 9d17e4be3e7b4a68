//! All methods by the same light: error against time.
//!
//! Pictures of the kinds `daylight` and `daylight-truth` have sun and sky. They are held against the reference of the kind `daylight-truth`, all others
//! against the first other reference of the view; the two groups have plots of their own.

#[cfg(test)]
mod tests;

use lucerna::{Result, measure::Display};

use super::prt::{Errors, mean};
use crate::{
    experiment::{
        file::Role,
        results::{Done, Layer, Results},
    },
    report::{Axis, Cell, Comparison, Page, Plot, Section, Table},
};

/// Longest side of an image in the page, pixels.
const SIDE: u32 = 512;
/// Parts of the light: name, and layer.
const PARTS: [(&str, &str); 2] = [("indirect light", "indirect"), ("all light", "")];
/// Kinds whose light is that of sun and sky.
const DAYLIGHT: [&str; 2] = ["daylight", "daylight-truth"];
/// Techniques whose name begins so are the path tracer.
const TRACED: &str = "path tracer";

/// A picture with its errors and times.
#[derive(Clone, Debug, PartialEq)]
struct Row {
    /// Scene, view and light.
    view: String,
    method: String,
    /// With the values of its matrix.
    label: String,
    /// Of the indirect light and of all light.
    errors: [Option<Errors>; 2],
    /// Time of the picture, ms.
    frame: Option<f64>,
    /// Time before the first picture, s: of the bake.
    before: Option<f64>,
}

fn kind<'a>(results: &'a Results, run: &Done) -> &'a str {
    let method = results.experiment.methods.iter().find(|method| method.name == run.method);
    method.map_or("", |method| method.kind.as_str())
}

/// Whether a picture has the light of sun and sky.
fn by_sky(results: &Results, run: &Done) -> bool {
    DAYLIGHT.contains(&kind(results, run))
}

/// The reference of a picture.
fn truth<'a>(results: &'a Results, run: &Done) -> Option<&'a Done> {
    let sky = by_sky(results, run);
    results
        .with_role(Role::Reference)
        .find(|other| (&other.scene, &other.view) == (&run.scene, &run.view) && by_sky(results, other) == sky)
}

/// Scene, view and light of a picture: what pictures must share to be compared.
fn place(results: &Results, run: &Done) -> String {
    format!("{}, {}{}", run.scene, run.view, if by_sky(results, run) { ", sun and sky" } else { "" })
}

fn rows(results: &Results) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for run in results.with_role(Role::Technique) {
        let Some(truth) = truth(results, run) else { continue };
        let mut errors = [None; 2];
        for (error, (_, layer)) in errors.iter_mut().zip(PARTS) {
            let [a, b] = [results.picture(Layer(truth, layer))?, results.picture(Layer(run, layer))?];
            *error = Errors::of(a.width as usize, &a.pixels, &b.pixels, |_| true);
        }
        let times = results.times(run)?;
        rows.push(Row {
            view: place(results, run),
            method: run.method.clone(),
            label: run.label(),
            errors,
            frame: times.frame(),
            before: times.fact("seconds whole"),
        });
    }
    Ok(rows)
}

pub(super) fn analyse(results: &Results, page: &mut Page) -> Result<()> {
    let rows = rows(results)?;
    page.add(plots(&rows));
    page.add(tables(&rows));
    page.add(images(results)?);
    Ok(())
}

/// Views, in order.
fn views(rows: &[Row]) -> Vec<&str> {
    let mut views: Vec<&str> = Vec::new();
    rows.iter().for_each(|row| {
        if !views.contains(&row.view.as_str()) {
            views.push(&row.view)
        }
    });
    views
}

fn plots(rows: &[Row]) -> Section {
    let mut section = Section::new("Error against time");
    section.text(
        "One view and one light by all methods. *Error* is the root mean square of the difference of linear radiance over the mean of the reference, of \
         diffuse surfaces on both sides. *Time* is that of one picture on this device: the table below gives the time of each bake, which all \
         pictures of a scene share. The path tracer draws a line: more samples, less error; its error falls with the root of the \
         time. A method below that line is faster than the path tracer at the same error.",
    );
    section.text(
        "The methods do not all have the same light. Image-space radiosity gathers one scattering from what the picture shows. Virtual lights scatter as often \
         as the settings say, and corners lose light near them. Precomputed transfer has all scatterings of point and spot lights, and of no sun. Baked \
         daylight has sun and sky alone: a closed room has neither, so a hall with windows stands beside the parlour. There daylight and \
         the path tracer have sun and sky, in a plot of their own; the other methods have a white sun of the same direction alone, because they do not \
         gather a sky. Few light paths find a window, so virtual lights have little of the light in the hall; all figures are for one seed.",
    );
    for (at, view) in views(rows).into_iter().enumerate() {
        for (part, (name, _)) in PARTS.iter().enumerate() {
            let (x, y) = (Axis::new("time of a picture (ms)").log(), Axis::new("error (%)").log());
            let id = format!("yardstick-{at}-{}", name.split(' ').next().unwrap_or_default());
            let mut plot = Plot::new(id, format!("{view}: {name}"), x, y).timed();
            let here: Vec<&Row> = rows.iter().filter(|row| row.view == view).collect();
            let mut methods: Vec<&str> = here.iter().map(|row| row.method.as_str()).collect();
            methods.dedup();
            for method in methods {
                let of = here.iter().filter(|row| row.method == method);
                let dots: Vec<(f64, f64, String)> =
                    of.filter_map(|row| Some((row.frame?, row.errors[part]?.rms, row.label.clone()))).collect();
                // Variants of a method are joined.
                plot = match dots.len() {
                    0 => plot,
                    1 => plot.named_points(method, dots),
                    _ => plot.line(method, dots.into_iter().map(|(x, y, _)| (x, y))),
                };
            }
            section.add(plot);
        }
    }
    section
}

fn tables(rows: &[Row]) -> Section {
    let mut section = Section::new("The numbers");
    let columns = ["scene", "method"].map(str::to_owned).into_iter();
    let columns = columns.chain(PARTS.map(|(part, _)| format!("{part}, error (%)")));
    let columns = columns.chain(PARTS.map(|(part, _)| format!("{part}, energy")));
    let mut errors = Table::new("errors", "Errors", columns);
    let columns = ["scene", "method", "picture (ms)", "bake (s)", "the path tracer's time for that error (ms)"];
    let mut times = Table::new("times", "Measured times", columns).timed();
    for row in rows {
        let names = [row.view.as_str().into(), row.label.as_str().into()];
        let rms = row.errors.map(|error| Cell::from(error.map(|error| error.rms)));
        let energy = row.errors.map(|error| Cell::from(error.map(|error| error.energy())));
        errors.push(names.clone().into_iter().chain(rms).chain(energy));
        let equal = row.errors[1].and_then(|error| equal_time(rows, &row.view, error.rms));
        times.push(names.into_iter().chain([row.frame.into(), row.before.into(), equal.into()]));
    }
    section.text(
        "*Energy* is the sum over that of the reference, the mean of three channels. The path tracer's time for an error of all light follows from its pictures \
         here and the law of the root, as the mean over them.",
    );
    section.add(errors);
    section.add(times);
    section
}

/// Time in which the path tracer reaches an error of all light, ms: its error falls with the root of the time.
fn equal_time(rows: &[Row], view: &str, rms: f64) -> Option<f64> {
    let traced = rows.iter().filter(|row| row.view == view && row.method.starts_with(TRACED));
    mean(traced.filter_map(|row| Some(row.frame? * (row.errors[1]?.rms / rms).powi(2))))
}

fn images(results: &Results) -> Result<Section> {
    let mut section = Section::new("Pictures");
    // Pictures by one light share an exposure.
    for (at, truth) in results.with_role(Role::Reference).enumerate() {
        for (part, layer) in PARTS {
            let picture = results.picture(Layer(truth, layer))?;
            let id = format!("picture-{at}-{}", part.split(' ').next().unwrap_or_default());
            let title = format!("{}: {part}", place(results, truth));
            let mut set = Comparison::new(id, title, picture.width, picture.height)
                .exposure(Display::default().stops(&picture))
                .with(truth.label(), picture.pixels);
            for run in results
                .with_role(Role::Technique)
                .filter(|run| self::truth(results, run).map(|of| &of.key) == Some(&truth.key))
            {
                set = set.with(run.label(), results.picture(Layer(run, layer))?.pixels);
            }
            section.add(set.at_most(SIDE));
        }
    }
    Ok(section)
}

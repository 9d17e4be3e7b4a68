//! The generic analysis: every technique against the first reference, by every measure that the file names.

use lucerna::{Result, measure::Measure};

use crate::{
    experiment::{
        file::Role,
        place::spread,
        results::{Done, Layer, Results, known_measure, label},
    },
    report::{Axis, Cell, Comparison, Page, Plot, Section, Table},
};

/// Longest side of an image in the page, pixels.
const SIDE: u32 = 512;

pub(super) fn analyse(results: &Results, page: &mut Page) -> Result<()> {
    let measures: Vec<Measure> =
        results.experiment.measures.iter().map(|name| known_measure(name)).collect::<Result<_>>()?;
    let measures: Vec<Measure> = measures.into_iter().filter(|measure| !measure.info().needs_baseline).collect();
    let rows = rows(results, &measures)?;
    if !rows.is_empty() && !measures.is_empty() {
        page.add(errors(&rows, &measures));
    }
    page.add(images(results)?);
    page.add(times(results)?);
    Ok(())
}

struct Row<'a> {
    run: &'a Done,
    values: Vec<f64>,
}

fn rows<'a>(results: &'a Results, measures: &[Measure]) -> Result<Vec<Row<'a>>> {
    let references: Vec<&Done> = results.with_role(Role::Reference).collect();
    let mut rows = Vec::new();
    for run in results.with_role(Role::Technique) {
        let reference = references.iter().find(|reference| reference.scene == run.scene && reference.view == run.view);
        if let Some(reference) = reference {
            rows.push(Row { run, values: results.measures(measures, Layer(reference, ""), Layer(run, ""), None)? });
        }
    }
    Ok(rows)
}

/// Labels of all variants, in order.
fn labels<'a>(runs: impl Iterator<Item = &'a Done>) -> Vec<String> {
    let mut labels: Vec<String> = Vec::new();
    for run in runs {
        let label = label(&run.method, &run.variant);
        if !labels.contains(&label) {
            labels.push(label);
        }
    }
    labels
}

fn name_with_unit(measure: Measure) -> String {
    let info = measure.info();
    if info.unit.is_empty() { info.name.to_owned() } else { format!("{} ({})", info.name, info.unit) }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn errors(rows: &[Row<'_>], measures: &[Measure]) -> Section {
    let mut section = Section::new("Against the reference");
    let labels = labels(rows.iter().map(|row| row.run));
    let heads = ["technique".to_owned(), "views".to_owned()];
    let columns = heads.iter().cloned().chain(measures.iter().map(|measure| name_with_unit(*measure)));
    let mut means = Table::new("means", "Mean over all views", columns);
    for label in &labels {
        let of: Vec<&Row<'_>> = rows.iter().filter(|row| row.run.label() == *label).collect();
        let mean = |index: usize| mean(&of.iter().map(|row| row.values[index]).collect::<Vec<_>>());
        let cells = (0..measures.len()).map(|index| Cell::from(mean(index)));
        means.push([label.as_str().into(), of.len().into()].into_iter().chain(cells));
    }
    section.add(means);
    let mut views: Vec<String> = rows.iter().map(|row| format!("{}/{}", row.run.scene, row.run.view)).collect();
    views.dedup();
    if let Some(measure) = measures.first() {
        let axis = Axis::new("view").names(views.clone());
        let mut plot = Plot::new(
            "by-view",
            format!("`{}` of each view", measure.name()),
            axis,
            Axis::new(name_with_unit(*measure)),
        );
        for label in &labels {
            let of = |view: &String| {
                let row = rows
                    .iter()
                    .find(|row| row.run.label() == *label && format!("{}/{}", row.run.scene, row.run.view) == *view);
                row.map_or(f64::NAN, |row| row.values[0])
            };
            plot = plot.bars(label, views.iter().map(of));
        }
        section.add(plot);
    }
    let heads = ["scene", "view", "technique"].map(str::to_owned);
    let columns = heads.into_iter().chain(measures.iter().map(|measure| name_with_unit(*measure)));
    let mut each = Table::new("views", "Each view", columns);
    for Row { run, values } in rows {
        let names = [run.scene.as_str().into(), run.view.as_str().into(), run.label().into()];
        each.push(names.into_iter().chain(values.iter().map(|value| Cell::from(*value))));
    }
    section.add(each);
    section
}

fn images(results: &Results) -> Result<Section> {
    let mut section = Section::new("Images");
    let views = results.views();
    for view in spread(&views, Some(results.experiment.images)) {
        let mut set: Option<Comparison> = None;
        let mut runs: Vec<&Done> = results.at(*view).collect();
        // The reference first: techniques are flipped against it.
        runs.sort_by_key(|run| !results.with_role(Role::Reference).any(|reference| reference.key == run.key));
        for run in runs {
            let picture = results.picture(Layer(run, ""))?;
            let (scene, name) = *view;
            let current = match set.take() {
                Some(set) => set,
                None => Comparison::new(
                    format!("{scene}-{name}"),
                    format!("{scene}, {name}"),
                    picture.width,
                    picture.height,
                )
                .exposure(results.exposure(run)?),
            };
            set = Some(current.with(run.label(), picture.pixels));
        }
        if let Some(set) = set {
            section.add(set.at_most(SIDE));
        }
    }
    Ok(section)
}

fn times(results: &Results) -> Result<Section> {
    let mut section = Section::new("Time");
    let mut table =
        Table::new("times", "Median time of a frame", ["technique", "frames", "mean (ms)", "least (ms)", "most (ms)"])
            .timed();
    for label in labels(results.runs.iter()) {
        let mut list = Vec::new();
        for run in results.runs.iter().filter(|run| run.label() == label) {
            list.extend(results.times(run)?.frame());
        }
        let ends = list.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
        table.push([label.as_str().into(), list.len().into(), mean(&list).into(), ends.0.into(), ends.1.into()]);
    }
    section.add(table);
    Ok(section)
}

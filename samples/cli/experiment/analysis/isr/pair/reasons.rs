//! Reasons for the differences: the model image, the strength of the added light, settings that the dissertation leaves open, the law of lights.

use lucerna::{Error, Result};

use super::{
    MODEL, PAPER, against, at_strengths, is_large,
    judged::{Judged, weighted},
    tables::{figures, percent},
};
use crate::{
    experiment::results::{Done, Layer, Results},
    report::{Axis, Cell, Plot, Section, Table},
};

/// The dissertation's figures: gain median and mean, share of the pixels improved, percent.
const MEDIAN: f64 = 7.18;
const MEAN: f64 = 5.88;
const IMPROVED: f64 = 99.05;
/// k_ISR of the dissertation, and those of the table; the first one is its remedy for views that become worse.
const STRENGTH: f32 = 0.5;
const STRENGTHS: [f32; 7] = [0.1, 0.25, STRENGTH, 1.0, 2.0, 4.0, 8.0];
/// The sender of light in equation 25.
const SENDER: &str = "albedo";
/// Factors on the added light.
const FACTORS: [f32; 8] = [0.0625, 0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0];
/// Rows of the table of combinations.
const NEAREST: usize = 16;

const COLUMNS: [&str; 6] =
    ["gain, median (%)", "gain, mean (%)", "positive (%)", "pixels improved (%)", "correlation gain", "views"];

fn summary(rows: &[Judged]) -> Vec<Cell> {
    let all = weighted(rows, Judged::gain);
    vec![
        all.map(|all| all.median).into(),
        all.map(|all| all.mean).into(),
        all.map(|all| all.positive).into(),
        percent(rows, |row| row.better[0]).into(),
        weighted(rows, Judged::correlation_gain).map(|all| all.mean).into(),
        rows.len().into(),
    ]
}

/// The same pair against other model images.
pub(super) fn models(results: &Results) -> Result<Section> {
    let mut section = Section::new("Which model image");
    section.text(
        "A pixel can improve only where the model image is brighter than direct light, because image-space radiosity adds light. *Model brighter* is the share \
         of such pixels (by the sum of the channels): hardly more can improve. *Raised* is the share of the pixels that image-space radiosity makes brighter; the other pixels do not change, or \
         occlusion darkens them (equation 29 multiplies direct light by accessibility). POV-Ray's `brightness` of 2.4 multiplies gathered light at every \
         bounce; 1 conserves energy. *Ambient*: every surface also shows a tenth of its colour, which POV-Ray 3.6 adds where a file names no `ambient`.",
    );
    let names = ["model image", "technique"].into_iter().chain(COLUMNS);
    let more = ["model brighter (%)", "raised (%)", "model over direct light", "added over missing light"];
    let mut table = Table::new("pair-models", "Gain against each model image", names.chain(more)).digits(3);
    for (model, caption) in
        [(MODEL, "brightness 2.4"), ("povray-1", "brightness 1"), ("povray-ambient", "brightness 2.4, ambient 0.1")]
    {
        for technique in [PAPER, "no occlusion", "lit"] {
            let rows = against(results, model, |run| run.method == technique && !is_large(run))?;
            if rows.is_empty() {
                continue;
            }
            let mean = |of: usize| weighted(&rows, |row| row.means[of]).map_or(f64::NAN, |all| all.mean);
            let missing = mean(0) - mean(1);
            let mut cells = vec![caption.into(), technique.into()];
            cells.extend(summary(&rows));
            cells.push(percent(&rows, |row| row.brighter).into());
            cells.push(percent(&rows, |row| row.raised).into());
            cells.push((mean(0) / mean(1)).into());
            cells.push((missing > 0.0).then(|| (mean(2) - mean(1)) / missing).into());
            table.push(cells);
        }
    }
    section.add(table);
    Ok(section)
}

/// How strong the added light must be for the dissertation's figures.
pub(super) fn needed(results: &Results) -> Result<Section> {
    let mut section = Section::new("Strength that the dissertation's figures need");
    section.text(
        "The gathered light, multiplied by a factor, against the same model images. A gain of 7.18 % with 99.05 % of the pixels improved needs two \
         things at once: the added light is about 7 % of the missing light, and it arrives in nearly every pixel, none of which may be background, overexposed or as bright \
         as the model image. `no occlusion` leaves out equation 26, which makes pixels darker.",
    );
    let columns = ["technique", "factor"].into_iter().chain(COLUMNS);
    let mut table = Table::new("pair-needed", "Gain by the strength of the gathered light", columns).digits(3);
    let mut plot = Plot::new(
        "pair-needed-plot",
        "Gain by the strength of the added light",
        Axis::new("factor").log(),
        Axis::new("gain, median (%)").with(0.0),
    );
    for technique in [PAPER, "no occlusion", "lit"] {
        let mut points = Vec::new();
        let of = |run: &Done| run.method == technique && !is_large(run);
        for (factor, rows) in FACTORS.iter().zip(at_strengths(results, MODEL, of, &FACTORS)?) {
            let Some(all) = weighted(&rows, Judged::gain) else { continue };
            points.push((f64::from(*factor), all.median));
            table.push([technique.into(), f64::from(*factor).into()].into_iter().chain(summary(&rows)));
        }
        plot = plot.line(technique, points);
    }
    section.add(table);
    section.add(plot.across(MEDIAN, "median of the dissertation"));
    Ok(section)
}

/// Distance of a row from the dissertation's figures: relative differences of median and mean, and the shares that are missing.
fn distance(rows: &[Judged]) -> f64 {
    let Some(all) = weighted(rows, Judged::gain) else { return f64::INFINITY };
    let improved = percent(rows, |row| row.better[0]).unwrap_or(0.0);
    (all.median / MEDIAN - 1.0).abs()
        + (all.mean / MEAN - 1.0).abs()
        + (100.0 - all.positive) / 100.0
        + (IMPROVED - improved).abs() / 100.0
}

/// A combination of settings that the dissertation leaves open, with its views.
struct Variant<'a> {
    run: &'a Done,
    strength: f32,
    rows: Vec<Judged>,
}

impl Variant<'_> {
    fn names(&self) -> Vec<Cell> {
        let text = |key: &str| self.run.value(key).unwrap_or_default();
        let reach: Option<f64> = text("isr.reach").parse().ok();
        vec![text("isr.sender").into(), self.patch().into(), reach.into(), f64::from(self.strength).into()]
    }

    fn patch(&self) -> String {
        self.run.value("isr.patch").unwrap_or_else(|| "cell".into())
    }
}

/// Names of [`Variant::names`].
const NAMES: [&str; 4] = ["sender", "patch", "reach (pixels)", "k_ISR"];

/// Settings that the dissertation leaves open.
pub(super) fn sweep(results: &Results) -> Result<Section> {
    let mut section = Section::new("What the dissertation leaves open");
    section.text(
        "The sender of light, the area dA (the footprint of a pixel, or of a cell of the grid), the reach of the grid (pixels of the picture) and k_ISR, in every combination. \
         *Distance*: the sum of the relative differences of median and mean, of the share of views without gain, and of the difference in pixels improved. The dissertation's \
         sender is the albedo, and its k_ISR is 0.5.",
    );
    let mut variants: Vec<&Done> = Vec::new();
    for run in results.of("sweep") {
        if !variants.iter().any(|known| known.variant == run.variant) {
            variants.push(run);
        }
    }
    let factors = STRENGTHS.map(|strength| strength / STRENGTH);
    let mut found = Vec::new();
    for run in variants {
        let of = |other: &Done| other.method == "sweep" && other.variant == run.variant;
        let lists = at_strengths(results, MODEL, of, &factors)?;
        found.extend(STRENGTHS.into_iter().zip(lists).map(|(strength, rows)| Variant { run, strength, rows }));
    }
    let columns = NAMES.into_iter().chain(COLUMNS);
    let mut reaches = Table::new("pair-reach", "The dissertation's k_ISR of 0.5", columns).digits(3);
    for variant in found.iter().filter(|variant| variant.strength == STRENGTH) {
        reaches.push(variant.names().into_iter().chain(summary(&variant.rows)));
    }
    section.add(reaches);
    section.add(weaker(&found));
    found.sort_by(|a, b| distance(&a.rows).total_cmp(&distance(&b.rows)));
    let columns = NAMES.into_iter().chain(["distance"]).chain(COLUMNS);
    let mut table =
        Table::new("pair-sweep", "The combinations nearest to the dissertation's figures", columns).digits(3);
    for variant in found.iter().take(NEAREST) {
        let names = variant.names().into_iter().chain([distance(&variant.rows).into()]);
        table.push(names.chain(summary(&variant.rows)));
    }
    section.add(table);
    if let Some(nearest) = found.iter().find(|variant| variant.run.value("isr.sender").as_deref() == Some(SENDER)) {
        section.text(
            "All quantities for the nearest combination with the dissertation's sender. It is fitted to the printed median and mean. The added light is \
             proportional to k_ISR and to dA, so the same light comes from the printed k_ISR of 0.5 with an area that is larger by the factor between \
             both values of k_ISR.",
        );
        let reach = nearest.run.value("isr.reach").unwrap_or_default();
        let caption = format!(
            "Sender {SENDER}, dA of a {}, reach {reach} pixels, k_ISR {} (printed: {STRENGTH})",
            nearest.patch(),
            nearest.strength
        );
        section.add(figures("pair-nearest", &caption, &nearest.rows, Judged::gain, 0));
    }
    Ok(section)
}

/// k_ISR = 0.1 on the views whose correlation falls with 0.5.
fn weaker(found: &[Variant<'_>]) -> Table {
    let columns = [
        "views",
        "correlation falls with 0.5",
        "of these, rises with 0.1",
        "rises (%)",
        "of these, nearer to direct light's with 0.1",
    ];
    let columns = NAMES[..3].iter().copied().chain(columns);
    let mut table = Table::new("pair-weaker", "The dissertation's remedy: k_ISR = 0.1 in place of 0.5", columns);
    for strong in found.iter().filter(|variant| variant.strength == STRENGTH) {
        let same = |weak: &&Variant<'_>| weak.strength == STRENGTHS[0] && weak.run.variant == strong.run.variant;
        let Some(weak) = found.iter().find(same) else { continue };
        let (mut falls, mut rises, mut nearer) = (0usize, 0usize, 0usize);
        for (strong, weak) in strong.rows.iter().zip(&weak.rows) {
            if strong.correlation_gain() < 0.0 {
                falls += 1;
                rises += usize::from(weak.correlation_gain() > 0.0);
                nearer += usize::from(weak.correlation_gain() > strong.correlation_gain());
            }
        }
        let share = (falls > 0).then(|| 100.0 * rises as f64 / falls as f64);
        let cells = [strong.rows.len().into(), falls.into(), rises.into(), share.into(), nearer.into()];
        table.push(strong.names().into_iter().take(3).chain(cells));
    }
    table
}

/// Radius and reach of the occluders.
pub(super) fn occluders(results: &Results) -> Result<Section> {
    let mut section = Section::new("Occlusion");
    section.text(
        "Equation 29 multiplies direct light by saturate(A + 1 − k_SSAO), so that with k_SSAO = 0.5 only an accessibility A below one half darkens it. *Raised* is the share of the \
         pixels that are brighter than direct light.",
    );
    let names = ["reach of occluders (pixels)", "radius (cells)"].into_iter().chain(COLUMNS);
    let mut table =
        Table::new("pair-occluders", "Radius and reach of occluders", names.chain(["raised (%)"])).digits(3);
    let mut variants: Vec<&Done> = Vec::new();
    for run in results.of("occluders") {
        if !variants.iter().any(|known| known.variant == run.variant) {
            variants.push(run);
        }
    }
    for variant in variants {
        let rows = against(results, MODEL, |run| run.method == "occluders" && run.variant == variant.variant)?;
        let value = |key: &str| variant.value(key).and_then(|text| text.parse::<f64>().ok());
        let names = ["isr.occlusion_reach", "isr.occluder_radius"].map(|key| value(key).into());
        let raised = percent(&rows, |row| row.raised).into();
        table.push(names.into_iter().chain(summary(&rows)).chain([raised]));
    }
    section.add(table);
    Ok(section)
}

/// Equation 16 against the inverse square, with lamps that cast shadows.
pub(super) fn law(results: &Results) -> Result<Section> {
    let mut section = Section::new("The law of lights");
    section.text(
        "Scenes with their own lamps, which cast shadows on both sides. The path tracer (one diffuse bounce) has the law of equation 16 or the inverse square; the technique has the \
         dissertation's choices with either law. Where the laws differ, one factor for each view gives direct light the reference's mean. What remains of the error of direct light with the same law is that of shadow maps, of normals of eight bits and of filtered textures.",
    );
    let columns =
        ["technique", "reference", "factor", "correlation, direct", "with isr", "error of direct over its mean"];
    let mut table = Table::new("pair-law", "The same and different laws", columns.into_iter().chain(COLUMNS)).digits(3);
    for technique in ["eq. 16", "inverse square"] {
        for law in ["eq. 16", "inverse square"] {
            let (mut rows, mut error) = (Vec::new(), 0.0);
            for run in results.of(technique) {
                let Some(truth) = results.beside(run, &format!("path, {law}")) else { continue };
                let pixels = |run: &Done, layer: &str| results.picture(Layer(run, layer)).map(|picture| picture.pixels);
                let (model, lit) = (pixels(truth, "")?, pixels(truth, "direct")?);
                let (mut direct, mut total) = (pixels(run, "direct")?, pixels(run, "")?);
                if [&lit, &direct, &total].iter().any(|pixels| pixels.len() != model.len()) {
                    return Err(Error::input(format!("{}/{}: the pictures differ in size", run.scene, run.view)));
                }
                let sum = |list: &[[f32; 3]]| list.iter().flatten().map(|v| f64::from(*v)).sum::<f64>();
                if technique != law && sum(&direct) > 0.0 {
                    let factor = (sum(&lit) / sum(&direct)) as f32;
                    direct.iter_mut().chain(&mut total).for_each(|pixel| *pixel = pixel.map(|v| v * factor));
                }
                let apart: f64 =
                    direct.iter().flatten().zip(lit.iter().flatten()).map(|(a, b)| f64::from(a - b).abs()).sum();
                error += apart / sum(&lit).max(1e-20);
                rows.push(Judged::of((&run.scene, &run.view, true), &model, &direct, |i| total[i]));
            }
            if rows.is_empty() {
                continue;
            }
            let mean = |of: usize| weighted(&rows, |row| row.correlations[0][of]).map(|all| all.mean);
            let factor = if technique == law { "none" } else { "one for each view" };
            let cells = [
                technique.into(),
                law.into(),
                factor.into(),
                mean(0).into(),
                mean(1).into(),
                (error / rows.len() as f64).into(),
            ];
            table.push(cells.into_iter().chain(summary(&rows)));
        }
    }
    section.add(table);
    Ok(section)
}

//! The experiment of the dissertation on image-space radiosity (chapter 5): table 2, figures 5.6 to 5.10, and settings beyond the dissertation.

mod page;
pub(super) mod pair;
mod rows;
#[cfg(test)]
mod tests;

use lucerna::{Error, Result, image::srgb, measure::Measure};

use self::rows::{Parts, Row, exposure};
use crate::{
    experiment::{
        file::Role,
        results::{Done, Layer, Results},
    },
    report::Page,
};

/// The technique of the figures.
const JUDGED: &str = "lit";
/// Largest number of triangles of a simple scene.
const SIMPLE: usize = 25_000;

/// All rows with the same label.
struct Labelled {
    label: String,
    rows: Vec<Row>,
}

pub(super) fn analyse(results: &Results, page: &mut Page) -> Result<()> {
    let mut all: Vec<Labelled> = Vec::new();
    for run in results.with_role(Role::Technique) {
        let Some(row) = row(results, run)? else { continue };
        let label = run.label();
        match all.iter_mut().find(|labelled| labelled.label == label) {
            Some(labelled) => labelled.rows.push(row),
            None => all.push(Labelled { label, rows: vec![row] }),
        }
    }
    page::fill(results, page, &all)
}

/// Compares a picture and its direct light with the reference; `None` if the view has no reference.
fn row(results: &Results, run: &Done) -> Result<Option<Row>> {
    let bounces = run.method == "bounces";
    let Some(truth) = results.beside(run, if bounces { "path-3" } else { "path" }) else { return Ok(None) };
    let (total, direct) = (Layer(run, ""), Layer(run, "direct"));
    // The dissertation's light law has other units. One factor per view, from direct light, converts them.
    let own_law = results.experiment.methods.iter().any(|method| method.name == run.method && method.paper);
    let reference = results.picture(Layer(truth, ""))?.pixels;
    let bounced = results.picture(Layer(truth, "indirect"))?.pixels;
    // Emission counts as direct light, as in the pictures under test.
    let reference_direct: Vec<[f32; 3]> =
        reference.iter().zip(&bounced).map(|(all, indirect)| [0, 1, 2].map(|c| all[c] - indirect[c])).collect();
    let shown = results.picture(total)?;
    let (width, mut total_px, mut direct_px) = (shown.width as usize, shown.pixels, results.picture(direct)?.pixels);
    if [bounced.len(), total_px.len(), direct_px.len()].iter().any(|pixels| *pixels != reference.len()) {
        return Err(Error::input(format!("{}/{}: the pictures differ in size", run.scene, run.view)));
    }
    let sum = |pixels: &[[f32; 3]]| pixels.iter().flatten().map(|v| f64::from(*v)).sum::<f64>();
    if own_law {
        let own = sum(&direct_px);
        let scale = if own > 0.0 { (sum(&reference_direct) / own) as f32 } else { 1.0 };
        total_px.iter_mut().chain(&mut direct_px).for_each(|pixel| *pixel = pixel.map(|v| v * scale));
    }
    let correlation = |test| results.measure(Measure::Pearson, Layer(truth, ""), test, None);
    let scale = exposure(&reference);
    let errors = Errors::of(&reference, &direct_px, &total_px, scale);
    let indirect = sum(&bounced);
    let added = |i: usize| [0, 1, 2].map(|c| total_px[i][c] - direct_px[i][c]);
    let wide = |v: [f32; 3]| v.map(f64::from);
    let parts = Parts::of(width, (&direct_px, &reference_direct), |i| (wide(added(i)), wide(bounced[i])));
    let (mut indirect_better, mut indirect_worse) = (0, 0);
    for (i, bounced) in bounced.iter().enumerate() {
        let (before, after) = (difference(bounced, &[0.0; 3]), difference(bounced, &added(i)));
        indirect_better += usize::from(after < before);
        indirect_worse += usize::from(after > before);
    }
    Ok(Some(Row {
        scene: run.scene.clone(),
        view: run.view.clone(),
        complex: run.triangles > SIMPLE,
        direct: errors.direct,
        technique: errors.technique,
        direct_codes: errors.direct_codes,
        technique_codes: errors.technique_codes,
        direct_correlation: correlation(direct)?,
        correlation: correlation(total)?,
        better: errors.better,
        worse: errors.worse,
        pixels: reference.len(),
        found: (sum(&total_px) - sum(&direct_px)) / indirect.max(1e-20),
        indirect_better,
        indirect_worse,
        reached: bounced.iter().filter(|pixel| **pixel != [0.0; 3]).count(),
        parts,
    }))
}

/// Mean of |a − b| over channels, times three.
fn difference(a: &[f32; 3], b: &[f32; 3]) -> f64 {
    (0..3).map(|c| (f64::from(a[c]) - f64::from(b[c])).abs()).sum()
}

#[derive(Default)]
struct Errors {
    direct: f64,
    technique: f64,
    direct_codes: f64,
    technique_codes: f64,
    better: usize,
    worse: usize,
}

impl Errors {
    fn of(reference: &[[f32; 3]], direct: &[[f32; 3]], total: &[[f32; 3]], scale: f32) -> Self {
        let code = |pixel: &[f32; 3]| pixel.map(|v| f32::from(srgb::encode_u8(v * scale)));
        let mut sum = Self::default();
        for ((r, d), t) in reference.iter().zip(direct).zip(total) {
            let (before, after) = (difference(r, d), difference(r, t));
            sum.direct += before;
            sum.technique += after;
            sum.better += usize::from(after < before);
            sum.worse += usize::from(after > before);
            let truth = code(r);
            sum.direct_codes += difference(&truth, &code(d));
            sum.technique_codes += difference(&truth, &code(t));
        }
        let values = 3.0 * reference.len().max(1) as f64;
        for error in [&mut sum.direct, &mut sum.technique, &mut sum.direct_codes, &mut sum.technique_codes] {
            *error /= values;
        }
        sum
    }
}

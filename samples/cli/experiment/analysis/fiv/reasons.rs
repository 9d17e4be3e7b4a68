//! Why a case has more error than the thesis says, as far as the pictures themselves tell: where the error lies, and what changes it.

use lucerna::Result;

use super::{DEFAULT, GROUND, Lab, SETS, TRUTH, paper::Case};
use crate::experiment::results::Layer;

/// The part of the ground that counts as steep: where the reference changes most from pixel to pixel.
const STEEP: f64 = 0.1;

/// In words; `technique`: that of the case's row, `ours`: its NRMSE.
pub(super) fn of(lab: &Lab<'_>, case: &Case, technique: &str, ours: f64) -> Result<String> {
    let mut parts = vec!["above".to_owned()];
    let beside = |name: &str| lab.nrmse(case.scene, GROUND, name);
    // Without a correction, or with the defaults in place of the thesis' choices.
    for (name, what) in [("no overlap", "without the correction"), ("no partial", "without the correction")] {
        if let (false, Some(value)) = (technique == name, beside(name)?) {
            parts.push(format!("{value:.3} {what}"));
        }
    }
    let set = lab.nearest(case.scene, GROUND, DEFAULT);
    if let (true, Some(value)) = (technique == "thesis", beside(set)?) {
        parts.push(format!("{value:.3} with {set} and our defaults"));
    }
    // With samples closer together.
    let at = SETS.iter().position(|set| *set == technique).unwrap_or(0);
    for denser in SETS[..at].iter().rev() {
        if let Some(value) = beside(denser)? {
            parts.push(format!("{value:.3} with {denser}"));
        }
    }
    if let Some(share) = steep(lab, case.scene, technique)? {
        let part = 100.0 * STEEP;
        parts.push(format!(
            "{:.0} % of the squared error lies on the {part:.0} % of the ground where light changes most",
            100.0 * share
        ));
    }
    if ours > 0.0 && parts.len() == 1 {
        parts.push("nothing else was rendered that would tell why".to_owned());
    }
    Ok(parts.join("; "))
}

/// The share of the squared error on the part of the ground where the reference changes most.
fn steep(lab: &Lab<'_>, scene: &str, technique: &str) -> Result<Option<f64>> {
    let Some((truth, run)) = lab.run(scene, GROUND, TRUTH).zip(lab.run(scene, GROUND, technique)) else {
        return Ok(None);
    };
    let open = lab.open(truth)?;
    let [truth, test] = [truth, run].map(|run| lab.results.picture(Layer(run, "irradiance")));
    let (truth, test) = (truth?, test?);
    let (width, height) = (truth.width as usize, truth.height as usize);
    let light = |i: usize| truth.pixels[i].iter().map(|v| f64::from(*v)).sum::<f64>();
    let mut pixels = Vec::new();
    for i in (0..width * height).filter(|i| open.as_ref().is_none_or(|open| open[*i])) {
        let (x, y) = (i % width, i / width);
        let along = |low: usize, high: usize| (light(high) - light(low)).abs();
        let across = along(i - x.min(1), i + usize::from(x + 1 < width));
        let down = along(i - width * y.min(1), i + width * usize::from(y + 1 < height));
        let error: f64 = (0..3).map(|c| f64::from(truth.pixels[i][c] - test.pixels[i][c]).powi(2)).sum();
        pixels.push((across.hypot(down), error));
    }
    pixels.sort_by(|a, b| b.0.total_cmp(&a.0));
    let all: f64 = pixels.iter().map(|p| p.1).sum();
    let count = (STEEP * pixels.len() as f64) as usize;
    let most: f64 = pixels.iter().take(count).map(|p| p.1).sum();
    Ok((all > 0.0 && count > 0).then(|| most / all))
}

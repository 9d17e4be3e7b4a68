//! Reasons for errors that are larger than in the thesis, if the pictures show them: the location of the error, and settings that change it.

use lucerna::Result;

use super::{DEFAULT, GROUND, Lab, SETS, TRUTH, paper::Case};
use crate::experiment::results::Layer;

/// Share of the ground that counts as steep: the pixels with the largest change of the reference from pixel to pixel.
const STEEP: f64 = 0.1;
/// Maximum distance between touched ground and covered ground, as share of the picture's width.
const TOUCHED: f64 = 1.0 / 64.0;

/// The reasons in words. `technique`: the technique of the case's row; `ours`: its NRMSE.
pub(super) fn of(lab: &Lab<'_>, case: &Case, technique: &str, ours: f64) -> Result<String> {
    let mut parts = Vec::new();
    let beside = |name: &str| lab.nrmse(case.scene, GROUND, name);
    // The error without a correction, or with our defaults instead of the thesis' choices.
    for (name, what) in [("no overlap", "without the correction"), ("no partial", "without the correction")] {
        if let (false, Some(value)) = (technique == name, beside(name)?) {
            parts.push(format!("{value:.3} {what}"));
        }
    }
    let set = lab.nearest(case.scene, GROUND, DEFAULT);
    if let (true, Some(value)) = (technique == "thesis", beside(set)?) {
        parts.push(format!("{value:.3} with {set} and our defaults"));
    }
    // The error with denser samples.
    let at = SETS.iter().position(|set| *set == technique).unwrap_or(0);
    for denser in SETS[..at].iter().rev() {
        if let Some(value) = beside(denser)? {
            parts.push(format!("{value:.3} with {denser}"));
        }
    }
    if let Some([steep, touched, rest]) = shares(lab, case.scene, technique)? {
        let part = 100.0 * STEEP;
        parts.push(format!(
            "{:.0} % of the squared error is on the {part:.0} % of the ground with the largest change of light; {:.0} % is on ground within 1/64 of \
             the width from covered ground, and without this ground the NRMSE is {:.3}",
            100.0 * steep,
            100.0 * touched,
            ours * rest.sqrt(),
        ));
    }
    if parts.is_empty() {
        parts.push("the experiment has no other pictures that show the reason".to_owned());
    }
    Ok(parts.join("; "))
}

/// Shares of the squared error on steep ground and on touched ground, and the ratio of the mean squared error without touched ground to the mean
/// squared error of all ground.
fn shares(lab: &Lab<'_>, scene: &str, technique: &str) -> Result<Option<[f64; 3]>> {
    let Some((truth, run)) = lab.run(scene, GROUND, TRUTH).zip(lab.run(scene, GROUND, technique)) else {
        return Ok(None);
    };
    let open = lab.open(truth)?;
    let [truth, test] = [truth, run].map(|run| lab.results.picture(Layer(run, "irradiance")));
    let (truth, test) = (truth?, test?);
    let (width, height) = (truth.width as usize, truth.height as usize);
    let is_open = |i: usize| open.as_ref().is_none_or(|open| open[i]);
    let light = |i: usize| truth.pixels[i].iter().map(|v| f64::from(*v)).sum::<f64>();
    let near = ((TOUCHED * width as f64) as usize).max(1);
    let mut touched = vec![false; width * height];
    for i in (0..width * height).filter(|i| !is_open(*i)) {
        let (x, y) = (i % width, i / width);
        for row in y.saturating_sub(near)..(y + near + 1).min(height) {
            touched[row * width + x.saturating_sub(near)..row * width + (x + near + 1).min(width)].fill(true);
        }
    }
    // For each pixel: change of the reference, squared error, whether the ground is touched.
    let mut pixels = Vec::new();
    for i in (0..width * height).filter(|i| is_open(*i)) {
        let (x, y) = (i % width, i / width);
        let along = |low: usize, high: usize| (light(high) - light(low)).abs();
        let across = along(i - x.min(1), i + usize::from(x + 1 < width));
        let down = along(i - width * y.min(1), i + if y + 1 < height { width } else { 0 });
        let error: f64 = (0..3).map(|c| f64::from(truth.pixels[i][c] - test.pixels[i][c]).powi(2)).sum();
        pixels.push((across.hypot(down), error, touched[i]));
    }
    pixels.sort_by(|a, b| b.0.total_cmp(&a.0));
    let sum = |list: &mut dyn Iterator<Item = f64>| list.sum::<f64>();
    let all = sum(&mut pixels.iter().map(|p| p.1));
    let steep = sum(&mut pixels.iter().take((STEEP * pixels.len() as f64) as usize).map(|p| p.1));
    let next = sum(&mut pixels.iter().filter(|p| p.2).map(|p| p.1));
    let far = pixels.iter().filter(|p| !p.2).count() as f64 / pixels.len().max(1) as f64;
    Ok((all > 0.0 && far > 0.0).then(|| [steep / all, next / all, (1.0 - next / all) / far]))
}

//! Tables 17 and 18: visibility of the errors before and after tone mapping.

use lucerna::{
    Result,
    measure::{Display, Exposure, Measure, Options, Pair, Picture, ToneCurve},
    reference::tonemap,
    techniques::tonemap::Settings,
};

use super::{GROUND, Lab, TRUTH, paper};
use crate::{
    experiment::results::{Done, Layer},
    report::{Section, Table},
};

/// Screen value to which the 99th percentile of a picture is mapped.
const BRIGHT: f64 = 0.9;
/// Luminance to which the log-average is scaled for an operator that works in cd/m².
const GREY: f32 = 18.0;

/// Five of 255 steps to the screen's white.
const CODES: f64 = 5.0 / 255.0;

pub(super) fn tables(lab: &Lab<'_>) -> Result<Section> {
    let mut section = Section::new("Tables 17 and 18: before and after tone mapping");
    section.text(
        "Share of pixels with a visible difference to brute force (VDP for an inexperienced observer, p > 0.75), for the ground without the objects on \
         it, as in the thesis: before tone mapping, at an exposure at which the picture spans the screen's range, and after Ashikhmin's local \
         operator. The thesis names neither the program that computed its VDP nor its settings. *Differ* is the share of pixels that differ before \
         tone mapping by more than 5/255 of the screen's white. VDP marks more pixels. For 32×17×15 samples in 96×96 under one point light it marks \
         44 %, although 6.6 % differ by 1/255; it marks 25 % if each pixel is shown as 5×5. Its settings change this value to between 38 % (p > 0.95) and \
         72 % (masking of a practised observer); a white of 40 or 300 cd/m², or a fourth of the pixels per degree, changes it by a tenth. For \
         64×33×30 under one area light it marks 5.8 %, or 3.9 % to 14 % with other settings, although 0.9 % differ. No setting gives the thesis' 0.2 %.",
    );
    let columns = ["samples", "before (thesis)", "before", "after (thesis)", "after", "differ"];
    let mut table =
        Table::new("table-17", lab.caption("Table 17: VDP (%) by samples, bunny under one area light"), columns);
    for (samples, before, after) in paper::TABLE_17 {
        if let Some([ours_before, ours_after, differ]) = seen(lab, "bunny, area", samples)? {
            let ours = [ours_before.into(), after.into(), ours_after.into(), differ.into()];
            table.push([samples.into(), before.into()].into_iter().chain(ours));
        }
    }
    section.add(table);
    let columns = ["environment", "samples", "before (thesis)", "before", "after (thesis)", "after", "differ"];
    let mut table = Table::new("table-18", lab.caption("Table 18: VDP (%) by environment, a bunny"), columns);
    for (name, scene, before, after) in paper::TABLE_18 {
        let samples = lab.nearest(scene, GROUND, paper::DENSEST);
        if let Some([ours_before, ours_after, differ]) = seen(lab, scene, samples)? {
            let ours = [ours_before.into(), after.into(), ours_after.into(), differ.into()];
            table.push([name.into(), samples.into(), before.into()].into_iter().chain(ours));
        }
    }
    section.add(table);
    Ok(section)
}

/// Percent of pixels before and after, and of those that differ by more than [`CODES`] before.
fn seen(lab: &Lab<'_>, scene: &str, technique: &str) -> Result<Option<[f64; 3]>> {
    let Some((truth, run)) = lab.run(scene, GROUND, TRUTH).zip(lab.run(scene, GROUND, technique)) else {
        return Ok(None);
    };
    let picture = |run: &Done| lab.results.picture(Layer(run, ""));
    let open = lab.open(truth)?;
    let (truth, mut test) = (picture(truth)?, picture(run)?);
    // Pixels that are never visible do not count as different.
    for (i, _) in open.iter().flatten().enumerate().filter(|(_, open)| !**open) {
        test.pixels[i] = truth.pixels[i];
    }
    let stops = exposure(&truth);
    let before = vdp(&truth, &test, stops)?;
    let after = vdp(&mapped(&truth)?, &mapped(&test)?, 0.0)?;
    Ok(Some([before, after, differing(&truth, &test, stops)]))
}

/// Percent of pixels of which a channel differs by more than [`CODES`] of the screen's white.
fn differing(truth: &Picture, test: &Picture, stops: f64) -> f64 {
    let apart = |a: &[f32; 3], b: &[f32; 3]| (0..3).any(|k| f64::from((a[k] - b[k]).abs()) * stops.exp2() > CODES);
    let count = truth.pixels.iter().zip(&test.pixels).filter(|(a, b)| apart(a, b)).count();
    100.0 * count as f64 / truth.pixels.len().max(1) as f64
}

fn vdp(truth: &Picture, test: &Picture, stops: f64) -> Result<f64> {
    let display = Display { exposure: Exposure::Stops(stops), curve: ToneCurve::Clip };
    let options = Options { display, vdp_masking_slope: 1.0, ..Options::default() };
    Ok(Measure::Vdp.of(&Pair::new(truth, test)?, &options)?.value)
}

/// Stops that make a picture span the screen.
fn exposure(picture: &Picture) -> f64 {
    let mut values: Vec<f32> = picture.pixels.iter().map(|p| p[0].max(p[1]).max(p[2])).collect();
    let at = values.len() * 99 / 100;
    let bright = f64::from(*values.select_nth_unstable_by(at, f32::total_cmp).1);
    if bright > 0.0 { (BRIGHT / bright).log2().clamp(-64.0, 64.0) } else { 0.0 }
}

/// By Ashikhmin's local operator, linear light of a screen.
fn mapped(picture: &Picture) -> Result<Picture> {
    let settings = Settings { normalize: true, exposure: GREY.log2(), ..Settings::default() };
    let pixels = tonemap::tonemap(picture.width, picture.height, &picture.pixels, &settings);
    Picture::new(picture.width, picture.height, pixels)
}

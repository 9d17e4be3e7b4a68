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

/// Screen value of a picture's 99th percentile.
const BRIGHT: f64 = 0.9;
/// Luminance to which the log-average is scaled for an operator that works in cd/m².
const GREY: f32 = 18.0;

/// Five of the 255 steps from black to the screen's white.
const CODES: f64 = 5.0 / 255.0;

pub(super) fn tables(lab: &Lab<'_>) -> Result<Section> {
    let mut section = Section::new("Tables 17 and 18: before and after tone mapping");
    section.text(
        "Share of pixels with a visible difference from brute force (VDP for an inexperienced observer, p > 0.75), for the ground without the objects \
         on it, as in the thesis. *Before* is before tone mapping, at an exposure at which the picture spans the screen's range. *After* is after \
         Ashikhmin's local operator. The thesis names neither the program that computed its VDP nor its settings. *Differ* is the share of pixels that \
         differ before tone mapping by more than 5/255 of the screen's white. VDP marks more pixels. For 32×17×15 samples in 96×96 under one point \
         light VDP marks 44 % of the pixels, although only 6.6 % differ by 1/255; it marks 25 % if each pixel is shown as 5×5 pixels. Other settings \
         of the VDP give 38 % (p > 0.95) to 72 % (masking of a practised observer); a white of 40 or 300 cd/m², or a fourth of the pixels per degree, \
         changes the value by a tenth. For 64×33×30 samples under one area light VDP marks 5.8 %, or 3.9 % to 14 % with other settings, although only \
         0.9 % differ. No setting gives the thesis' 0.2 %.",
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

/// Percent of pixels with a visible difference before and after tone mapping, and of pixels that differ by more than [`CODES`] before it.
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

/// Percent of pixels in which a channel differs by more than [`CODES`] of the screen's white.
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

/// The exposure, in stops, at which a picture spans the screen's range.
fn exposure(picture: &Picture) -> f64 {
    let mut values: Vec<f32> = picture.pixels.iter().map(|p| p[0].max(p[1]).max(p[2])).collect();
    let at = values.len() * 99 / 100;
    let bright = f64::from(*values.select_nth_unstable_by(at, f32::total_cmp).1);
    if bright > 0.0 { (BRIGHT / bright).log2().clamp(-64.0, 64.0) } else { 0.0 }
}

/// The picture after Ashikhmin's local operator, as linear light of a screen.
fn mapped(picture: &Picture) -> Result<Picture> {
    let settings = Settings { normalize: true, exposure: GREY.log2(), ..Settings::default() };
    let pixels = tonemap::tonemap(picture.width, picture.height, &picture.pixels, &settings);
    Picture::new(picture.width, picture.height, pixels)
}

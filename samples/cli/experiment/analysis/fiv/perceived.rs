//! Tables 17 and 18: what is seen of the errors before and after tone mapping.

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

/// What the brightest of a picture becomes on the screen, but for one pixel in a hundred.
const BRIGHT: f64 = 0.9;
/// Luminance that the log-average becomes for an operator that works in cd/m².
const GREY: f32 = 18.0;

pub(super) fn tables(lab: &Lab<'_>) -> Result<Section> {
    let mut section = Section::new("Tables 17 and 18: before and after tone mapping");
    section.text(
        "Share of pixels whose difference to brute force is seen (VDP, an observer who does not know what to look for, p > 0.75), of the \
         ground without what stands on it, as in the thesis: before tone mapping at an exposure at which the picture spans \
         the screen, and after Ashikhmin's local operator. The thesis names neither the program that computed its VDP nor its settings.",
    );
    let columns = ["samples", "before (thesis)", "before", "after (thesis)", "after"];
    let mut table =
        Table::new("table-17", lab.caption("Table 17: VDP (%) by samples, bunny under one area light"), columns);
    for (samples, before, after) in paper::TABLE_17 {
        if let Some([ours_before, ours_after]) = seen(lab, "bunny, area", samples)? {
            table.push([samples.into(), before.into(), ours_before.into(), after.into(), ours_after.into()]);
        }
    }
    section.add(table);
    let columns = ["environment", "samples", "before (thesis)", "before", "after (thesis)", "after"];
    let mut table = Table::new("table-18", lab.caption("Table 18: VDP (%) by environment, a bunny"), columns);
    for (name, scene, before, after) in paper::TABLE_18 {
        let samples = lab.nearest(scene, GROUND, paper::DENSEST);
        if let Some([ours_before, ours_after]) = seen(lab, scene, samples)? {
            let ours = [ours_before.into(), after.into(), ours_after.into()];
            table.push([name.into(), samples.into(), before.into()].into_iter().chain(ours));
        }
    }
    section.add(table);
    Ok(section)
}

/// Percent of pixels before and after.
fn seen(lab: &Lab<'_>, scene: &str, technique: &str) -> Result<Option<[f64; 2]>> {
    let Some((truth, run)) = lab.run(scene, GROUND, TRUTH).zip(lab.run(scene, GROUND, technique)) else {
        return Ok(None);
    };
    let picture = |run: &Done| lab.results.picture(Layer(run, ""));
    let open = lab.open(truth)?;
    let (truth, mut test) = (picture(truth)?, picture(run)?);
    // What is never seen is no difference.
    for (i, _) in open.iter().flatten().enumerate().filter(|(_, open)| !**open) {
        test.pixels[i] = truth.pixels[i];
    }
    let before = vdp(&truth, &test, exposure(&truth))?;
    let after = vdp(&mapped(&truth)?, &mapped(&test)?, 0.0)?;
    Ok(Some([before, after]))
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

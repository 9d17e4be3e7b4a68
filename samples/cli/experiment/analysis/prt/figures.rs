//! The paper's pictures: samples and clusters (figure 1), signed transfer (figure 3), and the light beside the path tracer (figures 4 and 5).

use lucerna::{
    Result,
    measure::{Display, Picture},
};

use super::{errors::Case, paper::SIDES};
use crate::{
    experiment::{
        place::spread,
        results::{Layer, Results},
    },
    report::{Comparison, Section},
};

/// Longest side of an image in the page, pixels.
const SIDE: u32 = 512;

fn set(id: String, title: String, like: &Picture, exposure: f64) -> Comparison {
    Comparison::new(id, title, like.width, like.height).exposure(exposure)
}

/// The exposure of signed light, EV: the largest channel of most pixels is below 1, in the mean over the pictures. Luminance is no measure of such light, because red and
/// blue have little of it.
fn signed_stops<'a>(pictures: impl Iterator<Item = &'a Picture>) -> f64 {
    let bright = |picture: &Picture| {
        let mut peaks: Vec<f32> = picture.pixels.iter().map(|[r, g, b]| r.max(*g).max(*b)).collect();
        peaks.sort_by(f32::total_cmp);
        peaks.get(peaks.len() * 49 / 50).copied().filter(|peak| *peak > 0.0 && peak.is_finite())
    };
    let logarithms: Vec<f64> = pictures.filter_map(bright).map(|peak| f64::from(peak).log2()).collect();
    let mean = logarithms.iter().sum::<f64>() / logarithms.len().max(1) as f64;
    -(4.0 * mean).round() / 4.0
}

/// Figures 1 and 3; `None` without their pictures.
pub(super) fn bake(results: &Results, cases: &[Case<'_>]) -> Result<Option<Section>> {
    let showing = |what: &'static str| cases.iter().filter(move |case| case.setting("/show") == what);
    let mut section = Section::new("Figures 1 and 3: the bake");
    section.text(
        "Figure 1: samples, each as a dot in a neighbourhood of its own colour, and clusters. Figure 3: the light that one vector of a cluster sends to all samples, \
         red above zero and blue below. The first vector around zero is even light over its cluster: below zero is only \
         what the vectors of the receivers miss. All others send both.",
    );
    let mut colours: Option<Comparison> = None;
    for (what, name) in [("samples", "samples"), ("clusters", "clusters")] {
        for case in showing(what) {
            let picture = results.picture(Layer(case.run, ""))?;
            let current = colours.take().unwrap_or_else(|| {
                set("figure-1".into(), format!("Figure 1: {}, {}", case.run.scene, case.run.view), &picture, 0.0)
                    .values("colours")
            });
            colours = Some(current.with(name, picture.pixels));
        }
    }
    let mut signed: Option<Comparison> = None;
    let transfers = showing("transfer").map(|case| Ok((case, results.picture(Layer(case.run, ""))?)));
    let transfers: Vec<_> = transfers.collect::<Result<_>>()?;
    let stops = signed_stops(transfers.iter().map(|(_, picture)| picture));
    for (case, picture) in transfers {
        let current = match signed.take() {
            Some(set) => set,
            None => {
                let title = format!("Figure 3: {}, {}", case.run.scene, case.run.view);
                set("figure-3".into(), title, &picture, stops).values("transferred light, W/m², for a coefficient of 1")
            }
        };
        signed = Some(current.with(format!("vector {}", case.number("/picture/prt/vector")), picture.pixels));
    }
    let mut some = false;
    for set in [colours, signed].into_iter().flatten() {
        section.add(set.at_most(SIDE));
        some = true;
    }
    Ok(some.then_some(section))
}

/// Figures 4 and 5; `None` without pictures that have a reference.
pub(super) fn light(results: &Results, cases: &[Case<'_>]) -> Result<Option<Section>> {
    let mut section = Section::new("Figures 4 and 5: shadow, indirect light and all light beside the path tracer");
    section.text("`paper` has the paper's settings with the transfer of the mean, `ours` those of the default bake; both have shadows by the samples, and diffuse surfaces; the same lights with more points are area lights.");
    let lit = |case: &&Case<'_>| case.truth.is_some() && case.shows_light() && !case.run.method.starts_with("study");
    // One set for each reference: all techniques by its light.
    let mut sets: Vec<(&str, Vec<&Case<'_>>)> = Vec::new();
    for case in cases.iter().filter(lit) {
        let Some(truth) = case.truth else { continue };
        match sets.iter_mut().find(|(key, _)| *key == truth.key) {
            Some((_, list)) => list.push(case),
            None => sets.push((&truth.key, vec![case])),
        }
    }
    for (at, (_, list)) in spread(&sets, Some(results.experiment.images)).into_iter().enumerate() {
        let Some((first, truth)) = list.first().and_then(|case| Some((case, case.truth?))) else { continue };
        for (layer, what) in
            [("", "all light"), ("direct", "direct light"), ("indirect", "indirect light"), ("shadow", "shadow")]
        {
            let reference = results.picture(Layer(truth, layer))?;
            // A share has a range of its own.
            let stops = if layer == "shadow" { 0.0 } else { Display::default().stops(&reference) };
            let title = format!("{}, {}, light {}: {what}", first.run.scene, first.run.view, first.light());
            let id = format!("light-{at}-{}", if layer.is_empty() { "total" } else { layer });
            let mut images = set(id, title, &reference, stops);
            if layer == "shadow" {
                images = images.values("shares of the light");
            }
            images = images.with("path tracer", reference.pixels);
            // The defaults stand first beside the reference.
            let mut order: Vec<&&Case<'_>> = list.iter().collect();
            order.sort_by_key(|case| !case.run.method.starts_with(SIDES[1].0));
            for case in order {
                images = images.with(case.run.method.clone(), results.picture(Layer(case.run, layer))?.pixels);
            }
            section.add(images.at_most(SIDE));
        }
    }
    Ok((!sets.is_empty()).then_some(section))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signed_light_is_shown_by_its_largest_channel() {
        let picture = |peak: f32| Picture {
            width: 100,
            height: 1,
            display_referred: false,
            // One pixel is far too bright.
            pixels: (0..100).map(|i| if i == 7 { [900.0, 0.0, 0.0] } else { [0.0, 0.0, peak] }).collect(),
        };
        assert_eq!(signed_stops([picture(0.25)].iter()), 2.0);
        assert_eq!(signed_stops([picture(0.25), picture(1.0)].iter()), 1.0);
        // Pictures without light have no say.
        assert_eq!(signed_stops([picture(0.5), picture(0.0)].iter()), 1.0);
        assert_eq!(signed_stops([picture(0.0)].iter()).abs(), 0.0);
    }
}

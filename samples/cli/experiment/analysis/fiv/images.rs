//! Figures 18 to 27 as images.

use lucerna::Result;

use super::{DEFAULT, FRONT, GROUND, Lab, TRUTH};
use crate::{
    experiment::results::{Done, Layer},
    report::{Comparison, Section},
};

/// Longest side of an image in the page, pixels.
const SIDE: u32 = 512;

/// The technique with samples on surfaces.
const SURFACE: &str = "surface";

/// The figures: caption, scene, view.
const FIGURES: &[(&str, &str, &str)] = &[
    ("Figure 18: the bunny's shadow at different samplings", "bunny, area", GROUND),
    ("Figure 18: the bunny", "bunny, area", FRONT),
    ("Figure 19: the grove", "bunny", GROUND),
    ("Figure 19: the grove", "bunny", FRONT),
    ("Figure 19: one point light", "bunny, point", GROUND),
    ("Figure 19: one point light", "bunny, point", FRONT),
    ("Figure 19: two area lights", "bunny, areas", GROUND),
    ("Figure 19: two area lights", "bunny, areas", FRONT),
    ("Figure 19: a photographed forest", "bunny, forest", GROUND),
    ("Figure 19: a photographed forest", "bunny, forest", FRONT),
    ("Figure 19: Eucalyptus Grove", "bunny, eucalyptus", FRONT),
    ("Figure 20: coloured lights, one occluder", "queen, areas", GROUND),
    ("Figure 20: coloured lights, one occluder", "queen, areas", FRONT),
    ("Figure 20: coloured lights, two occluders", "two, areas", GROUND),
    ("Figure 20: coloured lights, two occluders", "two, areas", FRONT),
    ("Figure 21: several occluders, one area light", "queens, area", GROUND),
    ("Figure 21: several occluders, one area light", "queens, area", FRONT),
    ("Figure 22: several occluders, grove", "queens", GROUND),
    ("Figure 22: occluders closer to each other", "queens, close", GROUND),
    ("Figure 22: occluders closer to each other", "queens, close", FRONT),
    ("Figure 23: a fifth of the queen is below the ground", "queen, sunk", GROUND),
    ("Figure 23: a fifth of the queen is below the ground", "queen, sunk", FRONT),
    ("Figure 25: a receiver that changes its shape", "waves", FRONT),
    ("Figure 25: this receiver a third of a period later", "waves, later", FRONT),
    ("Figure 26: many objects", "5 bunnies and trees", FRONT),
    ("Figure 27: a bunny that casts and receives shadows", "bunny and tree", FRONT),
    ("The queen of a chess set under coloured lights", "chess queen, areas", GROUND),
    ("The queen of a chess set under coloured lights", "chess queen, areas", FRONT),
    ("Queens of a chess set, one area light", "chess queens, area", GROUND),
    ("Queens of a chess set, one area light", "chess queens, area", FRONT),
    ("A fifth of a chess set's queen is below the ground", "chess queen, sunk", GROUND),
    ("A fifth of a chess set's queen is below the ground", "chess queen, sunk", FRONT),
    ("A teapot", "teapot, area", GROUND),
    ("A teapot", "teapot, area", FRONT),
    ("The tree", "tree", FRONT),
    ("A hare", "hare", FRONT),
];

pub(super) fn figures(lab: &Lab<'_>) -> Result<Section> {
    let mut section = Section::new("Figures 18 to 27: images");
    section.text(
        "Errors are measured in the views named *ground*, which show the ground from straight above, without the objects on it. Press `D` to see \
         the difference of two images, and `G` to amplify it.",
    );
    for (caption, scene, view) in FIGURES {
        let runs: Vec<&Done> = lab.results.at((scene, view)).collect();
        let Some(first) = runs.iter().find(|run| run.method == TRUTH).or(runs.first()).copied() else { continue };
        let picture = lab.results.picture(Layer(first, ""))?;
        let mut set =
            Comparison::new(format!("{scene}-{view}"), format!("{caption} ({view})"), picture.width, picture.height)
                .exposure(lab.results.exposure(first)?)
                .with(first.label(), picture.pixels);
        for run in runs.iter().filter(|run| run.key != first.key) {
            set = set.with(run.label(), lab.results.picture(Layer(run, ""))?.pixels);
        }
        section.add(set.at_most(SIDE));
    }
    if let Some(set) = own_shadow(lab)? {
        section.add(set.at_most(SIDE));
    }
    Ok(section)
}

/// Figure 24: an object without its shadow on itself, the object with this shadow, and the shadow alone.
fn own_shadow(lab: &Lab<'_>) -> Result<Option<Comparison>> {
    let Some((scene, without, with)) = ["bunny, area", "bunny", "hare"].into_iter().find_map(|scene| {
        let with = lab.run(scene, FRONT, DEFAULT).or_else(|| lab.run(scene, FRONT, SURFACE));
        let (without, with) = lab.run(scene, FRONT, "no self-shadow").zip(with)?;
        Some((scene, without, with))
    }) else {
        return Ok(None);
    };
    let (open, shaded) = (lab.results.picture(Layer(without, ""))?, lab.results.picture(Layer(with, ""))?);
    let alone =
        open.pixels.iter().zip(&shaded.pixels).map(|(a, b)| [0, 1, 2].map(|c| (a[c] - b[c]).max(0.0))).collect();
    let caption = format!("Figure 24: the shadow of the {scene} on itself");
    let mut set = Comparison::new("own-shadow", caption, open.width, open.height)
        .exposure(lab.results.exposure(with)?)
        .with("without the shadow", open.pixels)
        .with("with the shadow", shaded.pixels)
        .with("the shadow alone", alone);
    if let Some(truth) = lab.run(scene, FRONT, TRUTH) {
        set = set.with(TRUTH, lab.results.picture(Layer(truth, ""))?.pixels);
    }
    Ok(Some(set))
}

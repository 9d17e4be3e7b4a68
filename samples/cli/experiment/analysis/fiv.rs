//! Fullsphere irradiance vectors: tables 2 to 4, 17, 18 and figures 18 to 27 of Michael's thesis (sections 5.2 and 5.4).
//!
//! The analysis finds scenes and techniques by their names. [`paper`] assigns them to figures. Techniques with names like `32x17x15` are sets of
//! samples. The reference is `brute force`. Errors are for the irradiance of the ground, seen from straight above without the objects on it
//! (view [`GROUND`]). Ground closely below an object is not visible, and does not count.

mod images;
mod paper;
mod perceived;
mod reasons;
mod tables;

use lucerna::{
    Result,
    measure::{Measure, Options, Pair, Picture},
};

use crate::{
    experiment::{
        kinds::Times,
        results::{Done, Layer, Results},
    },
    report::{Cell, Page},
};

/// The view of the ground without the objects on it.
const GROUND: &str = "ground";
/// The view with the objects.
const FRONT: &str = "front";
const TRUTH: &str = "brute force";
const UNSHADOWED: &str = "unshadowed";
const ONLINE: &str = "online";
/// The default set of samples.
const DEFAULT: &str = "64x33x30";
/// The set of table 3.
const DENSE: &str = "128x65x30";
/// Sets of samples, the densest first.
const SETS: [&str; 5] = [paper::DENSEST, DENSE, DEFAULT, "64x33x15", "32x17x15"];
/// Beginning of the names of the technique's own passes.
const PASSES: &str = "fiv.";

pub(super) fn analyse(results: &Results, page: &mut Page) -> Result<()> {
    let lab = Lab { results };
    page.add(tables::errors(&lab)?);
    page.add(images::figures(&lab)?);
    page.add(tables::precompute(&lab)?);
    page.add(tables::frames(&lab)?);
    page.add(tables::independence(&lab)?);
    page.add(tables::online(&lab)?);
    page.add(perceived::tables(&lab)?);
    page.add(tables::methods(&lab)?);
    Ok(())
}

/// The results, with queries that all parts of the analysis use.
struct Lab<'a> {
    results: &'a Results,
}

impl<'a> Lab<'a> {
    fn run(&self, scene: &str, view: &str, method: &str) -> Option<&'a Done> {
        self.results.runs.iter().find(|run| run.scene == scene && run.view == view && run.method == method)
    }

    /// The wanted technique. If it has no run, the next coarser set of samples with a run, because quick mode leaves out the finer sets.
    fn nearest(&self, scene: &str, view: &str, wanted: &'static str) -> &'static str {
        let from = SETS.iter().position(|set| *set == wanted);
        let coarser = from.into_iter().flat_map(|from| &SETS[from..]);
        coarser.copied().find(|set| self.run(scene, view, set).is_some()).unwrap_or(wanted)
    }

    /// The run of a technique in the first view of a scene that has one.
    fn any(&self, scene: &str, method: &str) -> Option<&'a Done> {
        self.results.runs.iter().find(|run| run.scene == scene && run.method == method)
    }

    fn times(&self, run: Option<&Done>) -> Result<Option<Times>> {
        run.map(|run| self.results.times(run)).transpose()
    }

    /// NRMSE [FIV 17] of the irradiance of a view, over the pixels that are not covered.
    fn nrmse(&self, scene: &str, view: &str, method: &str) -> Result<Option<f64>> {
        let Some((truth, run)) = self.run(scene, view, TRUTH).zip(self.run(scene, view, method)) else {
            return Ok(None);
        };
        let open = self.open(truth)?;
        let picture = |run: &Done| -> Result<Picture> {
            let picture = self.results.picture(Layer(run, "irradiance"))?;
            let Some(open) = &open else { return Ok(picture) };
            let pixels: Vec<[f32; 3]> = picture.pixels.iter().zip(open).filter(|(_, o)| **o).map(|(p, _)| *p).collect();
            Picture::new(pixels.len() as u32, 1, pixels)
        };
        let (truth, test) = (picture(truth)?, picture(run)?);
        let value = Measure::Nrmse.of(&Pair::new(&truth, &test)?, &Options::default())?.value;
        Ok(Some(value).filter(|value| value.is_finite()))
    }

    /// For each pixel of the ground, whether it is visible. `None` for other views, and if no ground is visible: then all pixels count.
    fn open(&self, truth: &Done) -> Result<Option<Vec<bool>>> {
        if truth.view != GROUND {
            return Ok(None);
        }
        let covered = self.results.picture(Layer(truth, "covered"))?;
        let open: Vec<bool> = covered.pixels.iter().map(|p| p[0] < 0.5).collect();
        Ok(Some(open).filter(|open| open.iter().any(|o| *o)))
    }

    /// Device and driver, for the captions of tables.
    fn device(&self) -> String {
        let fact =
            |name: &str| self.results.facts.iter().find(|(known, _)| known == name).map(|(_, value)| value.as_str());
        format!("{}, {}", fact("Device").unwrap_or("unknown device"), fact("Driver").unwrap_or("unknown driver"))
    }

    /// A caption for a table whose rows have sizes of their own.
    fn caption_without_size(&self, text: &str) -> String {
        format!("{text} ({})", self.device())
    }

    fn caption(&self, text: &str) -> String {
        format!("{text} ({}; {})", self.results.experiment.size, self.device())
    }
}

/// Time of the technique's own passes, milliseconds. If the device has no timestamps, the time of the frame.
fn own(times: &Times) -> Option<f64> {
    let sum = times.of_passes(PASSES);
    if sum > 0.0 { Some(sum) } else { times.frame() }
}

/// The ratio of two values; empty if a value is missing or the ratio is not finite.
fn over(ours: Option<f64>, paper: Option<f64>) -> Cell {
    ours.zip(paper).map(|(ours, paper)| ours / paper).filter(|ratio| ratio.is_finite()).into()
}

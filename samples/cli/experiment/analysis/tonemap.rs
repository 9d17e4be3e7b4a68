//! Tone mapping: the tables of Michael's thesis (section 5.3), and the gain of selection with faster local operators.
//!
//! The analysis finds techniques by their names: `gtm`, `ltm`, `stm` (global, local and selective tone mapping by the literal operator; `stm` with
//! a matrix of `tonemap.mark`), `ltm-growing` and `stm-growing` (matrices of `tonemap.radius` and `tonemap.mark`), `ltm-fast`, `stm-fast`, `ltm-pyramid`, `stm-pyramid`,
//! `stm-threshold` (a matrix of `tonemap.threshold`), `unit-gtm`, `unit-ltm`, `unit-stm`, `unit-saliency` (matrices of `tonemap.exposure`), `stm-saliency`, `stm-half`; and the reference `cpu`. Scenes of the group `still` are pictures, all others frames.

mod alike;
mod tables;
mod units;

use lucerna::{
    Result,
    measure::{Measure, Options, Pair},
};

use super::observer;
use crate::{
    experiment::{
        place::spread,
        results::{Done, Layer, Results},
    },
    report::{Comparison, Page, Section},
};

/// The thesis' threshold.
const THRESHOLD: f64 = 0.1;
/// Group of pictures.
const STILL: &str = "still";
/// Maximum of pixels of a frame whose losses are measured.
const MEASURED: usize = 1 << 20;

/// The observer of the VDP in the tables, of pictures that are light of a screen.
fn casual() -> Options {
    observer::inexperienced(0.0)
}

/// Daly's practised observer.
fn practised() -> Options {
    observer::practised(0.0)
}

/// Longest side of an image in the page, pixels.
const SIDE: u32 = 768;

pub(super) fn analyse(results: &Results, page: &mut Page) -> Result<()> {
    let views: Vec<View<'_>> = results.views().into_iter().map(|of| View { results, of }).collect();
    page.add(alike::section(&views)?);
    page.add(tables::payoff(&views)?);
    page.add(tables::agreement(&views)?);
    if views.iter().any(|view| !view.is_still()) {
        page.add(tables::frames(&views)?);
    }
    if views.iter().any(View::is_still) {
        page.add(tables::stills(&views)?);
    }
    page.add(tables::quality(&views)?);
    if let Some(section) = units::section(&views)? {
        page.add(section);
    }
    page.add(tables::operators(&views)?);
    page.add(images(results, &views)?);
    Ok(())
}

/// A picture or a frame, with all its runs.
#[derive(Clone, Copy)]
struct View<'a> {
    results: &'a Results,
    of: (&'a str, &'a str),
}

impl<'a> View<'a> {
    fn name(&self) -> String {
        let (scene, view) = self.of;
        if self.is_still() { scene.to_owned() } else { format!("{scene}, {view}") }
    }

    fn is_still(&self) -> bool {
        self.results.at(self.of).any(|run| run.group == STILL)
    }

    /// Pixels of a frame, by the name of its view; `None` for pictures.
    fn pixels(&self) -> Option<usize> {
        let (width, height) = self.of.1.rsplit(' ').next()?.split_once('x')?;
        Some(width.parse::<usize>().ok()? * height.parse::<usize>().ok()?)
    }

    /// Whether its losses are measured: frames of many pixels would take too long.
    fn is_measured(&self) -> bool {
        self.pixels().is_none_or(|pixels| pixels <= MEASURED)
    }

    /// A run by the name of its technique, and a value of its matrix.
    fn run(&self, method: &str, value: Option<(&str, &str)>) -> Option<&'a Done> {
        self.results.at(self.of).find(|run| {
            run.method == method && value.is_none_or(|(key, value)| run.value(key).as_deref() == Some(value))
        })
    }

    /// Milliseconds of tone mapping.
    fn time(&self, run: Option<&Done>) -> Result<Option<f64>> {
        Ok(match run {
            Some(run) => self.results.times(run)?.frame(),
            None => None,
        })
    }

    fn ms(&self, method: &str) -> Result<Option<f64>> {
        self.time(self.run(method, None))
    }

    fn ms_marked(&self, mark: &str) -> Result<Option<f64>> {
        self.time(self.run("stm", Some(("tonemap.mark", mark))))
    }

    /// The fastest way to mark, with its time.
    fn best_mark(&self) -> Result<Option<(String, f64)>> {
        let mut best: Option<(String, f64)> = None;
        for run in self.results.at(self.of).filter(|run| run.method == "stm") {
            let Some((mark, ms)) = run.value("tonemap.mark").zip(self.time(Some(run))?) else { continue };
            if best.as_ref().is_none_or(|(_, least)| ms < *least) {
                best = Some((mark, ms));
            }
        }
        Ok(best)
    }

    /// Share of important pixels.
    fn important(&self, run: Option<&Done>) -> Result<Option<f64>> {
        let Some(run) = run else { return Ok(None) };
        let map = self.results.picture(Layer(run, "important"))?.pixels;
        Ok(Some(map.iter().filter(|pixel| pixel[0] > 0.5).count() as f64 / map.len() as f64))
    }

    /// Measures of `test` against `truth` by an observer; NaN where one of them was not made.
    fn measures<const N: usize>(
        &self,
        observer: &Options,
        list: [Measure; N],
        truth: Option<&Done>,
        test: Option<&Done>,
    ) -> Result<[f64; N]> {
        let Some((truth, test)) = truth.zip(test) else { return Ok([f64::NAN; N]) };
        let values = self.results.measures_as(observer, &list, Layer(truth, ""), Layer(test, ""), None)?;
        Ok(values.try_into().unwrap_or([f64::NAN; N]))
    }
}

/// The ratio of two numbers.
fn over(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    a.zip(b).map(|(a, b)| a / b).filter(|ratio| ratio.is_finite())
}

fn images(results: &Results, views: &[View<'_>]) -> Result<Section> {
    let mut section = Section::new("Images");
    section.text("Local tone mapping is what the others are held against; *important* is the map that selects.");
    for view in spread(views, Some(results.experiment.images)) {
        let Some(truth) = view.run("ltm", None) else { continue };
        let local = results.picture(Layer(truth, ""))?;
        let (scene, name) = view.of;
        let mut set = Comparison::new(format!("{scene}-{name}"), view.name(), local.width, local.height)
            .exposure(0.0)
            .values("linear light of a screen, whose white is 1")
            .with("local", local.pixels);
        for method in [
            "stm",
            "stm-saliency",
            "gtm",
            "ltm-fast",
            "ltm-pyramid",
            "reinhard-ltm",
            "bilateral-ltm",
            "aces",
            "agx",
            "neutral",
        ] {
            if let Some(run) = view.run(method, None) {
                set = set.with(method, results.picture(Layer(run, ""))?.pixels);
            }
        }
        if let Some(run) = view.run("stm", None) {
            set = set.with("important", results.picture(Layer(run, "important"))?.pixels);
        }
        section.add(set.at_most(SIDE));
        if let Some(set) = thresholds(results, view)? {
            section.add(set);
        }
    }
    Ok(section)
}

/// Maps of important pixels with the visible differences from the local operator, and their pictures, by threshold; as figures 16, 17, 35, 37 and 38.
fn thresholds(results: &Results, view: &View<'_>) -> Result<Option<Comparison>> {
    let Some(truth) = view.run("ltm", None) else { return Ok(None) };
    let local = results.picture(Layer(truth, ""))?;
    let (scene, name) = view.of;
    let (id, title) = (format!("thresholds-{scene}-{name}"), format!("{}: thresholds of the map", view.name()));
    let values =
        "linear light of a screen, whose white is 1; maps: grey is important, red is a visible difference from local";
    let mut set = Comparison::new(id, title, local.width, local.height).exposure(0.0).values(values);
    let runs: Vec<&Done> = results.at(view.of).filter(|run| run.method == "stm-threshold").collect();
    if runs.is_empty() {
        return Ok(None);
    }
    let options = casual();
    for run in runs {
        let Some(threshold) = run.value("tonemap.threshold") else { continue };
        let (test, map) = (results.picture(Layer(run, ""))?, results.picture(Layer(run, "important"))?);
        let seen = Measure::Vdp.of(&Pair::new(&local, &test)?, &options)?.map.values;
        let marked = map.pixels.iter().zip(seen).map(|(important, seen)| {
            let grey = 0.4 * important[0];
            if f64::from(seen) > options.vdp_threshold { [1.0, 0.0, 0.0] } else { [grey; 3] }
        });
        let marked = marked.collect();
        set = set.with(format!("map {threshold}"), marked).with(format!("selective {threshold}"), test.pixels);
    }
    Ok(Some(set.with("local", local.pixels).at_most(SIDE)))
}

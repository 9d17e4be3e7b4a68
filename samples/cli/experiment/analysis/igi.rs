//! Instant global illumination: figures 4 to 7 of Marques and Santos, with the errors that the paper does not give.
//!
//! Techniques are known by their names: `exact` with a matrix of `igi.vpls`, and the variants, whatever they are called, with the number of
//! virtual lights that [`COUNT`] states; the reference is the first one. What came after the paper: [`beyond`].

mod beyond;

use lucerna::{Result, measure::Measure};

use crate::{
    experiment::{
        file::Role,
        place::spread,
        results::{Done, Layer, Results},
    },
    report::{Axis, Cell, Comparison, Page, Plot, Section, Table},
};

/// Virtual lights of the variants.
const COUNT: &str = "180";
/// Longest side of an image in the page, pixels.
const SIDE: u32 = 640;

/// Stages of figures 4 and 5, by the beginnings of the names of their passes.
const STAGES: [(&str, &[&str]); 4] = [
    ("shooting (%)", &["igi.shoot", "igi.points", "igi.importance", "igi.cumulate", "igi.resample", "igi.order"]),
    (
        "direct and specular (%)",
        &["passes.gbuffer", "igi.direct", "igi.grow", "igi.gather_tree", "igi.cache", "igi.reap"],
    ),
    ("indirect (%)", &["igi.gather", "igi.near", "igi.raster"]),
    ("filters (%)", &["igi.guide", "igi.discontinuity", "igi.upsample"]),
];

pub(super) fn analyse(results: &Results, page: &mut Page) -> Result<()> {
    page.add(counts(results)?);
    page.add(variants(results)?);
    page.add(beyond::successors(results)?);
    page.add(beyond::many(results)?);
    page.add(beyond::cached(results)?);
    page.add(images(results)?);
    Ok(())
}

/// Milliseconds of a frame and of the four stages. What passes names begin twice counts for the longer beginning.
fn stages(results: &Results, run: &Done) -> Result<(Option<f64>, [f64; 4])> {
    let times = results.times(run)?;
    let mut sums = [0.0; 4];
    for (name, ms) in &times.passes {
        let matching = STAGES.iter().enumerate().flat_map(|(stage, (_, list))| list.iter().map(move |l| (stage, l)));
        let best = matching.filter(|(_, beginning)| name.starts_with(**beginning)).max_by_key(|(_, b)| b.len());
        if let Some((stage, _)) = best {
            sums[stage] += ms;
        }
    }
    Ok((times.frame(), sums))
}

fn shares((frame, sums): (Option<f64>, [f64; 4])) -> [Cell; 4] {
    sums.map(|ms| frame.map(|frame| 100.0 * ms / frame).into())
}

/// Figure 4.
fn counts(results: &Results) -> Result<Section> {
    let mut section = Section::new("Figure 4: time against the number of virtual lights");
    section.text(
        "Exact visibility at full resolution. The paper has 30, 90 and 180 virtual lights on a GTX 480: there too the indirect stage grows \
         with their number, and the specular objects of the conference room put much of that growth into the stage *direct and specular*.",
    );
    let heads = ["scene", "virtual lights", "frames per second"].into_iter().chain(STAGES.map(|stage| stage.0));
    let mut table = Table::new("figure-4", "Frames per second and shares of the time", heads).timed();
    let axis = Axis::new("virtual lights");
    let mut plot = Plot::new("figure-4-plot", "Time of the indirect stage", axis, Axis::new("ms"));
    for view in results.views() {
        let mut line = Vec::new();
        for run in results.at(view).filter(|run| run.method == "exact") {
            let Some(count) = run.value("igi.vpls") else { continue };
            let times = stages(results, run)?;
            line.extend(count.parse().ok().map(|count: f64| (count, times.1[2])));
            let cells = [name(view).into(), count.into(), times.0.map(|ms| 1e3 / ms).into()];
            table.push(cells.into_iter().chain(shares(times)));
        }
        plot = plot.line(name(view), line);
    }
    section.add(table);
    section.add(plot.timed());
    Ok(section)
}

fn name((scene, view): (&str, &str)) -> String {
    format!("{scene}, {view}")
}

/// The exact variant with [`COUNT`] virtual lights.
fn exact<'a>(results: &'a Results, view: (&'a str, &'a str)) -> Option<&'a Done> {
    results.at(view).find(|run| run.method == "exact" && run.value("igi.vpls").is_none_or(|count| count == COUNT))
}

/// What is held against the exact variant, that one first.
fn others<'a>(results: &'a Results, view: (&'a str, &'a str)) -> Vec<&'a Done> {
    let technique = |run: &&Done| results.with_role(Role::Technique).any(|known| known.key == run.key);
    let others = results.at(view).filter(technique);
    let others = others.filter(|run| run.method != "exact" && !beyond::OWN.contains(&run.method.as_str()));
    exact(results, view).into_iter().chain(others).collect()
}

fn reference<'a>(results: &'a Results, view: (&'a str, &'a str)) -> Option<&'a Done> {
    results.with_role(Role::Reference).find(|run| (run.scene.as_str(), run.view.as_str()) == view)
}

/// Figure 5 and what it costs.
fn variants(results: &Results) -> Result<Section> {
    let mut section = Section::new("Figure 5: the accelerations");
    section.text(
        "180 virtual lights. *Speed* is the frame's, over the exact variant; *indirect* that of gathering and filters alone. The paper has \
         1.5 to 2.0 for imperfect visibility, about 5 for downsampling, and 2.8 frames per second with all three.",
    );
    let heads = ["scene", "variant", "frames per second"].into_iter().chain(STAGES.map(|stage| stage.0));
    let heads = heads.chain(["speed", "indirect, speed"]);
    let mut table = Table::new("figure-5", "Time of the variants", heads).timed();
    let columns = [
        "scene",
        "variant",
        "light",
        "rel. MSE to exact",
        "FLIP to exact",
        "PDiff to exact",
        "rel. MSE to reference",
        "FLIP to reference",
        "PDiff to reference",
    ];
    let mut errors = Table::new("errors", "Errors of the variants", columns);
    for view in results.views() {
        let Some(exact) = exact(results, view) else { continue };
        let base = stages(results, exact)?;
        let truth = reference(results, view);
        for run in others(results, view) {
            let times = stages(results, run)?;
            let indirect = |times: &(Option<f64>, [f64; 4])| times.1[2] + times.1[3];
            let speed = base.0.zip(times.0).map(|(base, ms)| base / ms);
            let indirect = (indirect(&times) > 0.0).then(|| indirect(&base) / indirect(&times));
            let cells = [name(view).into(), run.label().into(), times.0.map(|ms| 1e3 / ms).into()];
            table.push(cells.into_iter().chain(shares(times)).chain([speed.into(), indirect.into()]));
            let list = [Measure::RelMse, Measure::Flip, Measure::Pdiff];
            let against = |other: Option<&Done>| -> Result<[Cell; 3]> {
                let Some(other) = other.filter(|other| other.key != run.key) else {
                    return Ok([(); 3].map(|()| Cell::Empty));
                };
                let values = results.measures(&list, Layer(other, ""), Layer(run, ""), None)?;
                Ok(std::array::from_fn(|i| values.get(i).copied().into()))
            };
            let light = match truth {
                Some(truth) => Some(mean(results, truth, "indirect")?).filter(|m| *m > 0.0),
                None => None,
            };
            let found = mean(results, run, "indirect")?;
            let cells = [name(view).into(), run.label().into(), light.map(|light| found / light).into()];
            errors.push(cells.into_iter().chain(against(Some(exact))?).chain(against(truth)?));
        }
    }
    section.add(table);
    section.text("*Light* is the mean of the indirect light over that of the reference.");
    section.add(errors);
    Ok(section)
}

/// Mean over pixels and channels.
fn mean(results: &Results, run: &Done, layer: &str) -> Result<f64> {
    let picture = results.picture(Layer(run, layer))?;
    let sum: f64 = picture.pixels.iter().flatten().map(|v| f64::from(*v)).sum();
    Ok(sum / (3 * picture.pixels.len()).max(1) as f64)
}

/// Figures 6 and 7.
fn images(results: &Results) -> Result<Section> {
    let mut section = Section::new("Figures 6 and 7: images");
    for view in spread(&results.views(), Some(results.experiment.images)) {
        let mut set: Option<Comparison> = None;
        for run in reference(results, *view).into_iter().chain(others(results, *view)) {
            let picture = results.picture(Layer(run, ""))?;
            let (scene, camera) = *view;
            let id = format!("{scene}-{camera}");
            let new = || Comparison::new(id, name(*view), picture.width, picture.height);
            let current = match set.take() {
                Some(set) => set,
                None => new().exposure(results.exposure(run)?),
            };
            set = Some(current.with(run.label(), picture.pixels));
        }
        if let Some(set) = set {
            section.add(set.at_most(SIDE));
        }
    }
    Ok(section)
}

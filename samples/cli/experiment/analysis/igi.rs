//! Instant global illumination: figures 4 to 7 of Marques and Santos, with errors, which the paper does not give.
//!
//! The analysis finds techniques by their names. `exact` has a matrix of `igi.vpls`. All other techniques are variants with [`COUNT`] virtual
//! lights. They have diffuse surfaces only, like the reference, which is the first one. The techniques of [`SPECULAR`] also have
//! mirrors, glass and highlights, like the paper; figures 4 to 7 show both. [`beyond`] has the ideas after the paper.

mod beyond;
mod rays;
mod stages;

use lucerna::{Error, Result, measure::Measure};
use serde_json::Value;

use crate::{
    config,
    experiment::{
        file::{Experiment, Role},
        place::spread,
        results::{Done, Layer, Results},
    },
    report::{Axis, Cell, Comparison, Page, Plot, Section, Table},
};
use stages::{STAGES, spent};

/// Number of virtual lights of the variants.
const COUNT: &str = "180";
/// Longest side of an image in the page, pixels.
const SIDE: u32 = 640;
const EXACT: &str = "exact";
/// The same with all surfaces as they are.
const EXACT_SPECULAR: &str = "exact, specular";
const PAPER_SPECULAR: &str = "paper, specular";
const SPECULAR: [&str; 6] = [
    EXACT_SPECULAR,
    "imperfect, specular",
    "downsampled, specular",
    "imperfect, downsampled, specular",
    "interleaved, downsampled, specular",
    PAPER_SPECULAR,
];

pub(super) fn analyse(results: &Results, page: &mut Page) -> Result<()> {
    page.add(setup(results));
    page.add(counts(results)?);
    page.add(variants(results)?);
    page.add(rays::rates(results)?);
    page.add(beyond::successors(results)?);
    page.add(beyond::many(results)?);
    page.add(beyond::cached(results)?);
    page.add(images(results)?);
    Ok(())
}

/// Checks that the table `beside` of the parameters names existing techniques.
pub(super) fn check(experiment: &Experiment) -> Result<()> {
    let techniques = experiment.methods.iter().filter(|method| method.role == Role::Technique);
    let known: Vec<&str> = techniques.map(|method| method.name.as_str()).collect();
    let Some(beside) = experiment.parameters.get("beside") else { return Ok(()) };
    let Value::Object(pairs) = beside else {
        let what = format!("{beside} is no table; allowed: \"technique\" = \"technique\"");
        return Err(Error::input(what).at("parameters.beside"));
    };
    for (idea, other) in pairs {
        let place = format!("parameters.beside.\"{idea}\"");
        let Some(other) = other.as_str() else {
            return Err(Error::input(format!("{other} is no text; allowed: the name of a technique")).at(place));
        };
        if let Some(name) = [idea.as_str(), other].into_iter().find(|name| !known.contains(name)) {
            let hint = config::nearest(name, known.iter().copied()).map(|name| format!(" (did you mean '{name}'?)"));
            let what = format!("no technique '{name}'{}; there are {}", hint.unwrap_or_default(), known.join(", "));
            return Err(Error::input(what).at(place));
        }
    }
    Ok(())
}

/// Figure 4.
fn counts(results: &Results) -> Result<Section> {
    let mut section = Section::new("Figure 4: time against the number of virtual lights");
    section.text(
        "Exact visibility at full resolution. *All*: all surfaces, with mirrors, glass and highlights, as in the paper; in the paper's conference \
         room, specular objects cause much of the growth in the stage *direct and specular*. *Diffuse*: diffuse surfaces only, as for the errors \
         below. The paper has 30, 90 and 180 virtual lights on a GTX 480; its indirect stage also grows with their number.",
    );
    section.text(
        "Shares are of the time of all passes. *Shooting*: light paths, and the choice of the virtual lights. *Direct and specular*: visible \
         surfaces, shadow rays to light sources, and all light on surfaces that mirrors and glass show. *Indirect*: gathering by rays or maps, \
         refinement, and compensation of the bound. *Filters*: filters of the picture, and over time. *Other*: the sum, the sky, uploads, clears.",
    );
    let heads = ["scene", "surfaces", "virtual lights", "frames/s"].into_iter().chain(STAGES);
    let mut table = Table::new("figure-4", "Frames per second and shares of the time", heads).timed();
    let axis = Axis::new("virtual lights");
    let mut plot = Plot::new("figure-4-plot", "Time of the indirect stage", axis, Axis::new("ms"));
    for view in results.views() {
        for (method, surfaces) in [(EXACT_SPECULAR, "all"), (EXACT, "diffuse")] {
            let mut line = Vec::new();
            for run in results.at(view).filter(|run| run.method == method) {
                let Some(count) = run.value("igi.vpls") else { continue };
                let spent = spent(results, run)?;
                line.extend(count.parse().ok().map(|count: f64| (count, spent.indirect())));
                let cells = [name(view).into(), surfaces.into(), count.into(), spent.frame.map(|ms| 1e3 / ms).into()];
                table.push(cells.into_iter().chain(spent.shares()));
            }
            if !line.is_empty() {
                plot = plot.line(format!("{}, {surfaces}", name(view)), line);
            }
        }
    }
    section.add(table);
    section.add(plot.timed());
    Ok(section)
}

fn name((scene, view): (&str, &str)) -> String {
    format!("{scene}, {view}")
}

/// The run of a technique with [`COUNT`] virtual lights, or without a matrix of their number.
fn counted<'a>(results: &'a Results, view: (&'a str, &'a str), method: &str) -> Option<&'a Done> {
    results.at(view).find(|run| run.method == method && run.value("igi.vpls").is_none_or(|count| count == COUNT))
}

/// The runs to compare with the exact variant; the exact variant is the first.
fn others<'a>(results: &'a Results, view: (&'a str, &'a str)) -> Vec<&'a Done> {
    let technique = |run: &&Done| results.with_role(Role::Technique).any(|known| known.key == run.key);
    let own = |method: &str| method == EXACT || SPECULAR.contains(&method) || beyond::OWN.contains(&method);
    let others = results.at(view).filter(technique).filter(|run| !own(&run.method));
    counted(results, view, EXACT).into_iter().chain(others).collect()
}

/// The runs with specular surfaces; the exact variant is the first.
fn specular<'a>(results: &'a Results, view: (&'a str, &'a str)) -> Vec<&'a Done> {
    SPECULAR.iter().filter_map(|method| counted(results, view, method)).collect()
}

fn reference<'a>(results: &'a Results, view: (&'a str, &'a str)) -> Option<&'a Done> {
    results.with_role(Role::Reference).find(|run| (run.scene.as_str(), run.view.as_str()) == view)
}

/// Figure 5, with the errors of its variants.
fn variants(results: &Results) -> Result<Section> {
    let mut section = Section::new("Figure 5: the accelerations");
    section.text(format!(
        "{COUNT} virtual lights, unless a variant has its own number. *Speed* is the speed of the frame relative to the exact variant with the same \
         surfaces; *indirect, speed* is the same for the stages indirect and filters together: gathering, refinement, compensation, despeckling, \
         smoothing, upsampling. The paper has 1.5 to 2.0 for imperfect visibility, about 5 for downsampling, and 2.8 frames per second with all three. \
         Variants whose names end in `specular` show mirrors, glass and highlights, as all pictures of the paper: what mirrors show is gathered at full resolution, so \
         that imperfect visibility helps there and downsampling does not. All other variants, and all errors, are for diffuse surfaces \
         only, like the reference. *Speed over one acceleration less*: relative to the variant with one acceleration less: without imperfect visibility, without interleaved sampling, or exact.",
    ));
    let heads = ["scene", "variant", "frames/s"].into_iter().chain(STAGES);
    let heads = heads.chain(["speed", "indirect, speed", "speed over one acceleration less"]);
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
        let Some(exact) = counted(results, view, EXACT) else {
            let what =
                format!("*{}* is left out: there is no run of `{EXACT}` with {COUNT} virtual lights.", name(view));
            section.text(what);
            continue;
        };
        for list in [specular(results, view), others(results, view)] {
            // Speeds are relative to the first run, the exact variant.
            let Some(base) = list.first().map(|run| spent(results, run)).transpose()? else { continue };
            for run in &list {
                let spent = spent(results, run)?;
                let speed = base.frame.zip(spent.frame).map(|(base, ms)| base / ms);
                let indirect = spent.gathering_and_filters();
                let indirect = (indirect > 0.0).then(|| base.gathering_and_filters() / indirect);
                let cells = [name(view).into(), run.label().into(), spent.frame.map(|ms| 1e3 / ms).into()];
                let before = before(&run.method).and_then(|name| list.iter().find(|other| other.method == name));
                let before = before.map(|other| self::spent(results, other)).transpose()?.and_then(|other| other.frame);
                let over = before.zip(spent.frame).map(|(before, ms)| before / ms);
                let speeds = [speed.into(), indirect.into(), over.into()];
                table.push(cells.into_iter().chain(spent.shares()).chain(speeds));
            }
        }
        let truth = reference(results, view);
        let light = match truth {
            Some(truth) => Some(mean(results, truth, "indirect")?).filter(|m| *m > 0.0),
            None => None,
        };
        for run in others(results, view) {
            let list = [Measure::RelMse, Measure::Flip, Measure::Pdiff];
            let against = |other: Option<&Done>| -> Result<[Cell; 3]> {
                let Some(other) = other.filter(|other| other.key != run.key) else {
                    return Ok([(); 3].map(|()| Cell::Empty));
                };
                let values = results.measures(&list, Layer(other, ""), Layer(run, ""), None)?;
                Ok(std::array::from_fn(|i| values.get(i).copied().into()))
            };
            let found = mean(results, run, "indirect")?;
            let cells = [name(view).into(), run.label().into(), light.map(|light| found / light).into()];
            errors.push(cells.into_iter().chain(against(Some(exact))?).chain(against(truth)?));
        }
    }
    section.add(table);
    section.text(
        "Errors are for the whole picture; the reference is path traced with the same number of bounces and diffuse surfaces only. *Light* is the \
         mean of the indirect light over the reference's mean. All figures are for one seed: if few virtual lights reach the view, as in the office \
         without importance resampling, another seed gives other figures.",
    );
    section.add(errors);
    Ok(section)
}

/// The variant with one acceleration less.
fn before(method: &str) -> Option<&'static str> {
    Some(match method {
        "imperfect" | "downsampled" | "interleaved" => EXACT,
        "imperfect, downsampled" | "interleaved, downsampled" => "downsampled",
        "imperfect, specular" | "downsampled, specular" => EXACT_SPECULAR,
        "imperfect, downsampled, specular" | "interleaved, downsampled, specular" => "downsampled, specular",
        "paper" => "imperfect, downsampled",
        PAPER_SPECULAR => "imperfect, downsampled, specular",
        _ => return None,
    })
}

/// The scenes and sizes beside the paper's.
fn setup(results: &Results) -> Section {
    let mut section = Section::new("Section 5.1: scenes");
    section.text(
        "The paper has a conference room (190,000 triangles, four point lights) and an office (21,000 triangles, two point lights) at 800 × 600. *room* is a built-in conference room \
         with as many triangles, lamps and kinds of surfaces; *conference* is the room that the paper names, without mirrors. *office, two lamps* is the counterpart of the paper's office; *office* has a sun, a spot light and a sky in place of the two lamps.",
    );
    let columns = ["scene", "triangles", "lamps", "sky", "emissive surfaces", "pixels"];
    let mut table = Table::new("set-up", "Scenes", columns);
    let size = results.experiment.size;
    let pixels = f64::from(size.width) * f64::from(size.height);
    for view in results.views() {
        let Some(run) = results.at(view).next() else { continue };
        let yes = |there: Option<bool>| there.map(|there| if there { "yes" } else { "no" });
        table.push([
            name(view).into(),
            run.triangles.into(),
            run.shining.map(|shining| f64::from(shining.lamps)).into(),
            yes(run.shining.map(|shining| shining.sky)).into(),
            yes(run.shining.map(|shining| shining.surfaces)).into(),
            pixels.into(),
        ]);
    }
    section.add(table);
    section
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
    section.text("First the variants with mirrors, glass and highlights, as in the paper; then the reference and all variants with diffuse surfaces only.");
    for view in spread(&results.views(), Some(results.experiment.images)) {
        let (scene, camera) = *view;
        let diffuse = reference(results, *view).into_iter().chain(others(results, *view)).collect();
        for (id, title, list) in [
            (format!("{scene}-{camera}-specular"), format!("{}, all surfaces", name(*view)), specular(results, *view)),
            (format!("{scene}-{camera}"), name(*view), diffuse),
        ] {
            let mut set: Option<Comparison> = None;
            for run in list {
                let picture = results.picture(Layer(run, ""))?;
                let current = match set.take() {
                    Some(set) => set,
                    None => Comparison::new(id.clone(), title.clone(), picture.width, picture.height)
                        .exposure(results.exposure(run)?),
                };
                set = Some(current.with(run.label(), picture.pixels));
            }
            if let Some(set) = set {
                section.add(set.at_most(SIDE));
            }
        }
    }
    Ok(section)
}

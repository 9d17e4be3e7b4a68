//! The figures of section 6 beside ours.

use lucerna::Result;

use super::errors::{Case, mean};
use crate::{
    experiment::{kinds::Times, results::Results},
    report::{Cell, Section, Table},
};

/// The techniques with the paper's settings and with the defaults.
pub(super) const SIDES: [(&str, &str); 2] = [("paper", "the paper's settings"), ("ours", "the default bake")];
/// The paper's frames a second with a point light, and with an area light of 25 points.
const FRAMES: [f64; 2] = [30.0, 25.0];
/// The paper's time of the precomputation, hours, about.
const HOURS: f64 = 4.0;

/// Times and facts of a technique's first picture.
fn first(results: &Results, name: &str) -> Result<Option<Times>> {
    results.of(name).next().map(|run| results.times(run)).transpose()
}

/// Frames of the size of the paper, if the experiment has them.
fn frame(results: &Results, side: &str, light: &str) -> Result<Option<f64>> {
    let name = format!("{side}, {light} at 1024×768");
    Ok(mean(
        results.of(&name).map(|run| results.times(run)).collect::<Result<Vec<_>>>()?.iter().filter_map(Times::frame),
    ))
}

/// `None` without pictures of either side.
pub(super) fn section(results: &Results, cases: &[Case<'_>]) -> Result<Option<Section>> {
    let mut sides = Vec::new();
    for (name, _) in SIDES {
        sides.push(first(results, name)?);
    }
    if sides.iter().all(Option::is_none) {
        return Ok(None);
    }
    let mut section = Section::new("Section 6: sizes and times beside the paper's");
    section.text(
        "Two bakes of the built-in `parlour`. *The paper's settings*: ten vectors of light around the mean of the examples, and the fifth of all coefficients \
         between vectors and samples that counts most. *The default bake*: 24 vectors of light around zero, and 48 vectors of the receivers in place of the \
         coefficients. The paper's room, program and GPU are other ones, so its figures stand here for their order of size alone. Its 4.47 MB of \
         visibility and 21 MB of transfer include the vectors (section 6: *with the basis functions*); its visibility is sparse, the visibility here is not. The paper's transfer \
         holds what it keeps of the coefficients for red, green and blue; the transfer here has no colour, because albedos are applied when a picture is made.",
    );
    if results.experiment.quick {
        section.text(
            "In quick mode all bakes have fewer samples, in smaller clusters, and fewer rays: times and bytes are not those of the experiment proper.",
        );
    }
    let asked = |side: &str, path: &str| -> Cell {
        cases.iter().find(|case| case.run.method == side).map(|case| case.number(path)).into()
    };
    let columns = ["quantity", "unit", "paper", SIDES[0].1, SIDES[1].1];
    let mut sizes = Table::new("sizes", "Settings and sizes of the bakes", columns);
    let both = |of: &dyn Fn(&str, Option<&Times>) -> Cell| [0, 1].map(|at| of(SIDES[at].0, sides[at].as_ref()));
    let fact = |name: &'static str, scale: f64| {
        both(&move |_, side| side.and_then(|times| times.fact(name)).map(|value| value * scale).into())
    };
    let together = |names: &'static [&'static str]| {
        both(&move |_, side| {
            side.and_then(|times| names.iter().map(|name| times.fact(name)).sum::<Option<f64>>())
                .map(|b| b * 1e-6)
                .into()
        })
    };
    let setting = |path: &'static str| both(&move |side, _| asked(side, path));
    let rows: [(&str, &str, Option<f64>, [Cell; 2]); 19] = [
        ("samples", "", Some(45_000.0), fact("samples", 1.0)),
        ("clusters", "", Some(48.0), fact("clusters", 1.0)),
        ("samples a cluster, asked for", "", Some(1000.0), setting("/bake/cluster")),
        ("directions of a hemisphere", "", Some(2016.0), setting("/bake/directions")),
        ("vectors of visibility, d₁", "", Some(50.0), setting("/bake/visibility")),
        ("vectors of light, d₂", "", Some(10.0), setting("/bake/light")),
        ("vectors of light of all clusters, with means", "", None, fact("vectors", 1.0)),
        ("example lights", "", Some(1000.0), setting("/bake/examples")),
        ("visibility with its vectors", "MB", Some(4.47), together(&["bytes visibility", "bytes visibility vectors"])),
        ("visibility: means and coefficients", "MB", None, fact("bytes visibility", 1e-6)),
        ("visibility: vectors", "MB", None, fact("bytes visibility vectors", 1e-6)),
        ("transfer with its bases", "MB", Some(21.0), together(&["bytes basis", "bytes transfer"])),
        ("bases", "MB", None, fact("bytes basis", 1e-6)),
        ("transfer", "MB", None, fact("bytes transfer", 1e-6)),
        ("links", "MB", None, fact("bytes links", 1e-6)),
        (
            "visibility and transfer together",
            "MB",
            Some(30.0),
            together(&["bytes visibility", "bytes visibility vectors", "bytes basis", "bytes transfer"]),
        ),
        ("coefficients kept, at most", "%", Some(20.0), fact("kept", 100.0)),
        ("error of a distance, root mean square", "m", None, fact("distance error", 1.0)),
        ("transferred light that is left out, root mean square", "%", None, fact("left", 100.0)),
    ];
    for (quantity, unit, paper, [theirs, ours]) in rows {
        sizes.push([quantity.into(), unit.into(), paper.into(), theirs, ours]);
    }
    section.add(sizes);
    let mut work = Table::new("products", "Products of a frame with one point light, in millions", columns);
    for (quantity, name) in [
        ("visibility: 4 (d₁ + 1) a sample", "visibility_products"),
        ("projection and transfer", "transfer_products"),
        ("all scatterings, and what receivers mix", "basis_products"),
    ] {
        let [theirs, ours] = fact(name, 1e-6);
        work.push([quantity.into(), "10⁶".into(), Cell::Empty, theirs, ours]);
    }
    section.add(work);
    section.text(
        "The time of a frame is that of the device for the whole picture. *Ready*: upload of the bake and the matrices of all scatterings, once before the \
         first frame; they are made anew when colours change.",
    );
    let mut times = Table::new("times", "Measured times", columns).timed();
    for (light, frames) in ["point light", "area light"].iter().zip(FRAMES) {
        let mut found = [None; 2];
        for (found, (side, _)) in found.iter_mut().zip(SIDES) {
            *found = frame(results, side, light)?;
        }
        let quantity = format!("frame of 1024×768, {light}");
        times.push([quantity.as_str().into(), "ms".into(), (1e3 / frames).into(), found[0].into(), found[1].into()]);
        let a_second = found.map(|ms| ms.map(|ms| 1e3 / ms).into());
        let [theirs, ours] = a_second;
        times.push([quantity.into(), "frames/s".into(), frames.into(), theirs, ours]);
    }
    for (quantity, paper, name) in [
        ("whole bake", Some(HOURS * 3600.0), "seconds whole"),
        ("samples and clusters", None, "seconds samples"),
        ("visibility: distances and components", None, "seconds visibility"),
        ("gather: rays of one scattering", None, "seconds gather"),
        ("light of the examples", None, "seconds direct"),
        ("bases", None, "seconds basis"),
        ("transfer", None, "seconds transfer"),
        ("ready", None, "seconds ready"),
    ] {
        let [theirs, ours] = fact(name, 1.0);
        times.push([quantity.into(), "s".into(), paper.into(), theirs, ours]);
    }
    section.add(times);
    Ok(Some(section))
}

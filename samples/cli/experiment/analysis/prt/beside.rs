//! The technique against the path tracer, for all lights; and the transfer of the mean.

use lucerna::Result;
use serde_json::Value;

use super::errors::{Case, Errors, Measured, PARTS, mean, noise};
use crate::{
    experiment::results::{Done, Layer, Results},
    report::{Axis, Cell, Plot, Section, Table},
};

fn place(run: &Done) -> String {
    format!("{}, {}", run.scene, run.view)
}

/// Errors of all pictures, but those of the study; `None` without any.
pub(super) fn section(results: &Results, measured: &[Measured<'_>]) -> Result<Option<Section>> {
    let all: Vec<&Measured<'_>> = measured.iter().filter(|one| !one.case.run.method.starts_with("study")).collect();
    if all.is_empty() {
        return Ok(None);
    }
    let mut section = Section::new("The technique against the path tracer");
    section.text(
        "Diffuse surfaces on both sides, and all scatterings. An area light is 25 points on a sphere on both sides. *Error* is the root mean square of the \
         difference of linear radiance over the mean of the reference, in per cent. The error of *pixels* contains the noise of the reference, and the edges; the error \
         of *blocks*, of the means over 8×8 pixels, contains little of both. *Shadow* is the share of the light that a point sees, against rays to the light, where the surface faces the light. *Energy* is the sum \
         over that of the reference.",
    );
    means(&all).into_iter().for_each(|table| section.add(table));
    let mut errors = Table::new(
        "errors",
        "Errors of each picture (%)",
        ["scene", "technique", "light"].map(str::to_owned).into_iter().chain(both_columns(&PARTS)),
    );
    let columns = ["scene", "technique", "light"].map(str::to_owned).into_iter();
    let columns =
        columns.chain(PARTS[1..].iter().flat_map(|(part, _)| ["red", "green", "blue"].map(|c| format!("{part}, {c}"))));
    let mut energies = Table::new("energy", "Energy of each picture", columns);
    for one in &all {
        let names = [place(one.case.run), one.case.run.method.clone(), one.case.light()].map(Cell::from);
        let both = one.parts.iter().flat_map(|part| [part.map(|of| of.rms), part.map(|of| of.blocks)].map(Cell::from));
        errors.push(names.clone().into_iter().chain(both));
        let energy = |part: &Option<Errors>| {
            part.map_or([Cell::Empty, Cell::Empty, Cell::Empty], |of| of.energy.map(Cell::from))
        };
        energies.push(names.into_iter().chain(one.parts[1..].iter().flat_map(energy)));
    }
    section.add(by_light(&all));
    section.add(errors);
    section.add(energies);
    let noise = noise(results)?;
    if !noise.is_empty() {
        section.text(
            "The noise of the reference, from two pictures with different seeds: no technique can have a smaller error by this reference.",
        );
        let columns = std::iter::once("scene".to_owned()).chain(both_columns(&PARTS[1..]));
        let mut table = Table::new("noise", "Noise of the reference (%)", columns);
        for (run, parts) in noise {
            let both = parts.iter().flat_map(|part| [0, 1].map(|at| Cell::from(part.map(|of| of[at]))));
            table.push(std::iter::once(Cell::from(place(run))).chain(both));
        }
        section.add(table);
    }
    Ok(Some(section))
}

/// For each part, the names of the columns of its two errors.
fn both_columns(parts: &[(&str, &str)]) -> Vec<String> {
    parts.iter().flat_map(|(part, _)| ["pixels", "blocks"].map(|of| format!("{part}, {of}"))).collect()
}

/// Means over the lights.
fn means(all: &[&Measured<'_>]) -> [Table; 2] {
    let heads = || ["scene", "technique", "lights"].map(str::to_owned).into_iter();
    let columns = heads();
    let columns = columns.chain(both_columns(&PARTS).into_iter().map(|name| format!("{name} (%)")));
    let columns = columns.chain(["indirect, blocks, worst light (%)".to_owned()]);
    let mut table = Table::new("means", "Errors, means over all lights", columns);
    let columns = heads().chain(PARTS[1..].iter().map(|(part, _)| (*part).to_owned()));
    let mut energy = Table::new("means-energy", "Energy, means over all lights and channels", columns);
    let mut groups: Vec<(String, &str)> =
        all.iter().map(|one| (place(one.case.run), one.case.run.method.as_str())).collect();
    let mut seen = Vec::new();
    groups.retain(|group| {
        !seen.contains(group) && {
            seen.push(group.clone());
            true
        }
    });
    for (scene, method) in groups {
        let of = || all.iter().filter(|one| one.case.run.method == method && place(one.case.run) == scene);
        let part =
            |at: usize, value: &dyn Fn(&Errors) -> f64| mean(of().filter_map(|one| Some(value(&one.parts[at]?))));
        let worst = of().filter_map(|one| Some(one.parts[2]?.blocks)).max_by(f64::total_cmp);
        let cells = || [scene.as_str().into(), method.into(), of().count().into()].into_iter();
        let errors =
            (0..PARTS.len()).flat_map(|at| [part(at, &|of| of.rms), part(at, &|of| of.blocks)].map(Cell::from));
        let energies = (1..PARTS.len()).map(|at| Cell::from(part(at, &Errors::energy)));
        table.push(cells().chain(errors).chain([worst.into()]));
        energy.push(cells().chain(energies));
    }
    [table, energy]
}

/// Errors of the indirect light by light, for the first view.
fn by_light(all: &[&Measured<'_>]) -> Plot {
    let mut lights: Vec<String> = Vec::new();
    let scene = all.first().map(|one| place(one.case.run)).unwrap_or_default();
    let here: Vec<&&Measured<'_>> = all.iter().filter(|one| place(one.case.run) == scene).collect();
    for one in &here {
        let light = one.case.light();
        if !lights.contains(&light) {
            lights.push(light);
        }
    }
    let x = Axis::new("light: x, y, z (m), intensity (W/sr)").names(lights.clone());
    let mut plot =
        Plot::new("by-light", format!("Error of the indirect light in blocks, {scene}"), x, Axis::new("error (%)"));
    let mut methods: Vec<&str> = here.iter().map(|one| one.case.run.method.as_str()).collect();
    methods.dedup();
    for method in methods {
        let of = |light: &String| {
            let one = here.iter().find(|one| one.case.run.method == method && one.case.light() == *light);
            one.and_then(|one| Some(one.parts[2]?.blocks)).unwrap_or(f64::NAN)
        };
        let heights: Vec<f64> = lights.iter().map(of).collect();
        if heights.iter().filter(|height| height.is_finite()).count() > 1 {
            plot = plot.bars(method, heights);
        }
    }
    plot
}

/// The light of pictures with all lights off, relative to the same pictures with light; `None` without such pictures.
pub(super) fn mean_and_darkness(results: &Results, cases: &[Case<'_>]) -> Result<Option<Section>> {
    let off = |case: &&Case<'_>| case.number("/picture/prt/strength") == 0.0;
    let mut table = Table::new(
        "darkness",
        "Indirect light with the lights off",
        ["scene", "technique", "vectors of light", "around the mean", "transfer of the mean", "share of the light (%)"],
    );
    let light = |run: &Done| -> Result<f64> {
        let picture = results.picture(Layer(run, "indirect"))?;
        Ok(picture.pixels.iter().flatten().map(|value| f64::from(*value)).sum())
    };
    for case in cases.iter().filter(off) {
        // All settings but the strength.
        let settings = |case: &Case<'_>| {
            let mut settings = case.settings.clone();
            settings.pointer_mut("/picture/prt/strength").map(Value::take);
            settings
        };
        let of_dark = settings(case);
        let lit = cases.iter().find(|other| {
            (&other.run.scene, &other.run.view) == (&case.run.scene, &case.run.view)
                && settings(other) == of_dark
                && other.number("/picture/prt/strength") > 0.0
        });
        let Some(lit) = lit else { continue };
        let (whole, dark) = (light(lit.run)?, light(case.run)?);
        let yes = |path: &str| if case.setting(path) == true { "yes" } else { "no" };
        table.push([
            place(case.run).into(),
            lit.run.method.as_str().into(),
            case.number("/bake/light").into(),
            yes("/bake/centred").into(),
            if case.setting("/bake/centred") == true { yes("/picture/prt/mean").into() } else { Cell::Empty },
            (whole > 0.0).then_some(100.0 * dark / whole).into(),
        ]);
    }
    if table.rows.is_empty() {
        return Ok(None);
    }
    let mut section = Section::new("The transfer of the mean, and darkness");
    section.text(
        "The paper describes direct light around the mean of the examples. The mean has a transfer of its own, which equation 10 leaves out; the tables above \
         have both. With the transfer of the mean, what the vectors do not describe of the mean stays when the light goes off: the room glows. Without it, the light \
         of the mean is missing in all pictures, and in darkness the light is below zero, which is shown as none. Vectors around zero have neither fault: no light is exactly no light.",
    );
    section.add(table);
    Ok(Some(section))
}

//! Tables of errors, of the time of precomputation, and of the time of a frame.

use lucerna::Result;

use super::{DEFAULT, DENSE, FRONT, GROUND, Lab, ONLINE, TRUTH, UNSHADOWED, over, own, paper, reasons};
use crate::report::{Axis, Cell, Plot, Section, Table};

/// Bytes of a megabyte, as in the thesis.
const MEGABYTE: f64 = (1 << 20) as f64;

/// Figures 18 to 23 as numbers.
pub(super) fn errors(lab: &Lab<'_>) -> Result<Section> {
    let mut section = Section::new("Figures 18 to 23: errors against brute force");
    section.text(
        "NRMSE (eq. 17) is computed for each channel: the root mean square difference of irradiance, divided by the range of the reference. The tables \
         have the mean of the three channels. The error is computed on the ground, seen from straight above without the objects on it, like the \
         thesis' shadow images. Some ground is never visible and does not count: ground inside an object, and ground below an object at a distance \
         of less than a tenth of the radius of the largest object. The reference casts a shadow ray from every pixel to every texel of the \
         environment that is not black. *Unshadowed* is the error without shadows. The thesis does not state its views, and it states the \
         environment for figure 19 only. If its Eucalyptus Grove is not available, a procedural grove and a photographed forest replace it.",
    );
    let columns = [
        "figure",
        "case",
        "technique",
        "thesis",
        "ours",
        "ours / thesis",
        "verdict",
        "unshadowed",
        "with the objects, from the front",
    ];
    let mut table = Table::new("errors", lab.caption("NRMSE against brute force"), columns);
    let mut above = Vec::new();
    for case in paper::CASES {
        let technique =
            if case.figure == "18" { case.technique } else { lab.nearest(case.scene, GROUND, case.technique) };
        let Some(ours) = lab.nrmse(case.scene, GROUND, technique)? else { continue };
        table.push([
            case.figure.into(),
            case.what.into(),
            technique.into(),
            case.nrmse.into(),
            ours.into(),
            over(Some(ours), Some(case.nrmse)),
            if ours <= case.nrmse { "at or under" } else { "above" }.into(),
            lab.nrmse(case.scene, GROUND, UNSHADOWED)?.into(),
            lab.nrmse(case.scene, FRONT, technique)?.into(),
        ]);
        if ours > case.nrmse {
            let why = reasons::of(lab, case, technique, ours)?;
            above.push(format!(
                "Above the thesis: *figure {}, {}* (`{technique}`, {ours:.3}): {why}.",
                case.figure, case.what
            ));
        }
    }
    section.add(table);
    above.iter().for_each(|text| section.text(text));
    section.add(corrections(lab)?);
    section.add(contact(lab)?);
    let mut all =
        Table::new("errors-all", lab.caption("NRMSE of every technique"), ["scene", "view", "technique", "NRMSE"]);
    for run in lab.results.runs.iter().filter(|run| run.method != TRUTH) {
        if let Some(value) = lab.nrmse(&run.scene, &run.view, &run.method)? {
            all.push([run.scene.clone().into(), run.view.clone().into(), run.label().into(), value.into()]);
        }
    }
    section.add(all);
    Ok(section)
}

/// Errors with and without the corrections of figures 21 and 23.
fn corrections(lab: &Lab<'_>) -> Result<Table> {
    let columns = [
        "correction",
        "off",
        "on",
        "on minus off",
        "all as in the thesis, off",
        "all as in the thesis, on",
        "all as in the thesis, on minus off",
    ];
    let mut table = Table::new("corrections", lab.caption("NRMSE with and without a correction"), columns);
    let overlap =
        ["queens, area", "queens", "queens, close", "queens, close, dome", "chess queens, area", "two, areas"];
    let partial = ["queen, sunk", "queen, sunk, grove", "queen, sunk, forest", "chess queen, sunk", "bunny"];
    for (correction, scenes) in [("overlap", &overlap[..]), ("partial", &partial)] {
        for scene in scenes {
            let error = |technique: &str| lab.nrmse(scene, GROUND, technique);
            let ours = (error(&format!("no {correction}"))?, error(lab.nearest(scene, GROUND, DEFAULT))?);
            let thesis = (error(&format!("thesis, no {correction}"))?, error("thesis")?);
            if ours.0.is_none() || ours.1.is_none() {
                continue;
            }
            let cells = [ours, thesis]
                .into_iter()
                .flat_map(|(off, on)| [off.into(), on.into(), off.zip(on).map(|(off, on)| on - off).into()]);
            table.push([format!("{correction}, {scene}").into()].into_iter().chain(cells));
        }
    }
    Ok(table)
}

/// Errors of an object that stands on the ground, beside one that floats and one that is partly below it.
fn contact(lab: &Lab<'_>) -> Result<Table> {
    let columns = ["queen", "ours", "all as in the thesis", "unshadowed"];
    let mut table =
        Table::new("contact", lab.caption("NRMSE by the distance from the ground, one area light"), columns);
    for (place, scene) in [
        ("floats, a fifth of its height above the ground", "queen, floating"),
        ("stands", "queen, area"),
        ("a fifth of its height below the ground", "queen, sunk"),
    ] {
        let ours = lab.nrmse(scene, GROUND, lab.nearest(scene, GROUND, DEFAULT))?;
        if ours.is_some() {
            let [thesis, unshadowed] = ["thesis", UNSHADOWED].map(|technique| lab.nrmse(scene, GROUND, technique));
            table.push([place.into(), ours.into(), thesis?.into(), unshadowed?.into()]);
        }
    }
    Ok(table)
}

/// Table 2.
pub(super) fn precompute(lab: &Lab<'_>) -> Result<Section> {
    let mut section = Section::new("Table 2: computing the vectors");
    section.text(
        "The vectors are computed once for each kind of object and each environment. The thesis' times are for a CPU of 2007 with two cores. In the \
         thesis and here, a sample takes the memory of three 32-bit floats per colour channel.",
    );
    let columns =
        ["object", "vertices", "samples", "thesis (min)", "ours (min)", "times faster", "thesis (MB)", "ours (MB)"];
    let mut table = Table::new("table-2", lab.caption("Table 2"), columns).timed();
    for (scene, vertices) in [("bunny, area", 35_947), ("bunny", 35_947), ("tree", 20_614), ("hare", 0)] {
        for (samples, bunny, tree, megabytes) in paper::TABLE_2 {
            let Some(times) = lab.times(lab.any(scene, samples))? else { continue };
            let minutes = times.fact("seconds before").map(|seconds| seconds / 60.0);
            let thesis = match vertices {
                35_947 => Some(bunny),
                20_614 => tree,
                _ => None,
            };
            table.push([
                scene.into(),
                times.fact("vertices").into(),
                samples.into(),
                thesis.into(),
                minutes.into(),
                over(thesis, minutes),
                megabytes.into(),
                times.fact("bytes").map(|bytes| bytes / MEGABYTE).into(),
            ]);
        }
    }
    section.add(table);
    Ok(section)
}

/// Table 3.
pub(super) fn frames(lab: &Lab<'_>) -> Result<Section> {
    let mut section = Section::new("Table 3: time of a frame for 1 to 60 objects");
    section.text(
        "Frames per second of the illumination only, as in the thesis (the passes of the technique, without the G-buffer and the sky), and the time of \
         the whole frame. The thesis used a GeForce 8800 GTS.",
    );
    let columns = [
        "scene",
        "objects",
        "vertices",
        "samples",
        "thesis (frames/s)",
        "illumination (frames/s)",
        "illumination (ms)",
        "whole frame (ms)",
        "thesis (MB)",
        "vectors (MB)",
    ];
    let mut table =
        Table::new("table-3", lab.caption(&format!("Table 3; the thesis has {DENSE} samples")), columns).timed();
    let (mut ours, mut thesis) = (Vec::new(), Vec::new());
    for (name, things, megabytes, fps) in paper::TABLE_3 {
        let samples = lab.nearest(name, FRONT, DENSE);
        let Some(times) = lab.times(lab.run(name, FRONT, samples))? else { continue };
        let milliseconds = own(&times);
        ours.extend(milliseconds.map(|ms| (things as f64, ms)));
        thesis.push((things as f64, 1e3 / fps));
        table.push([
            name.into(),
            things.into(),
            times.fact("vertices").into(),
            samples.into(),
            fps.into(),
            milliseconds.map(|ms| 1e3 / ms).into(),
            milliseconds.into(),
            times.frame().into(),
            megabytes.into(),
            times.fact("bytes").map(|bytes| bytes / MEGABYTE).into(),
        ]);
    }
    section.add(table);
    let axes = (Axis::new("objects").with(0.0), Axis::new("ms").with(0.0));
    let plot = Plot::new("table-3-plot", "Time of the illumination against the number of objects", axes.0, axes.1);
    section.add(plot.points("ours", ours).points("thesis", thesis).timed());
    Ok(section)
}

/// Dependence of the time on the numbers of vertices and lights.
pub(super) fn independence(lab: &Lab<'_>) -> Result<Section> {
    let mut section = Section::new("What the cost depends on");
    section.text(
        "Time of the illumination for the ground, seen from straight above. Every pixel is a receiver. The rows of the first table differ in the \
         object and its number of vertices, and the rows of the second table in the environment and its number of lights.",
    );
    let columns = ["objects", "vertices", "illumination (ms)", "over the fastest"];
    let mut table = Table::new("vertices", lab.caption("10 objects of 2,000 to 36,000 vertices each"), columns).timed();
    let mut rows = Vec::new();
    for scene in ["10 bunnies", "10 trees", "10 queens", "10 hares"] {
        if let Some(times) = lab.times(lab.run(scene, GROUND, lab.nearest(scene, GROUND, DENSE)))? {
            rows.push((scene, times.fact("vertices"), own(&times)));
        }
    }
    let least = rows.iter().filter_map(|row| row.2).fold(f64::INFINITY, f64::min);
    for (scene, vertices, ms) in rows {
        table.push([scene.into(), vertices.into(), ms.into(), over(ms, Some(least))]);
    }
    section.add(table);
    let columns =
        ["environment", "lit texels", "vectors (ms)", "over the fastest", "brute force (ms)", "brute force / vectors"];
    let mut table = Table::new("lights", lab.caption("One bunny under one to 6,144 lights"), columns).timed();
    let mut rows = Vec::new();
    for scene in ["bunny, point", "bunny, area", "bunny, areas", "bunny", "bunny, forest", "bunny, eucalyptus"] {
        let Some(times) = lab.times(lab.run(scene, GROUND, lab.nearest(scene, GROUND, DEFAULT)))? else { continue };
        let truth = lab.times(lab.run(scene, GROUND, TRUTH))?.as_ref().and_then(own);
        rows.push((scene, times.fact("lights"), own(&times), truth));
    }
    let least = rows.iter().filter_map(|row| row.2).fold(f64::INFINITY, f64::min);
    for (scene, lights, ms, truth) in rows {
        let cells = [scene.into(), lights.into(), ms.into(), over(ms, Some(least)), truth.into(), over(truth, ms)];
        table.push(cells);
    }
    section.add(table);
    Ok(section)
}

/// Beyond the thesis: vectors of each frame, without precomputation.
pub(super) fn online(lab: &Lab<'_>) -> Result<Section> {
    let mut section = Section::new("Without precomputation");
    section.text(
        "The thesis leaves this to future work: each frame computes the vectors that its pixels look up. Times are for the illumination. Frames of a \
         resting scene take the same time, because no vectors are kept.",
    );
    let columns =
        ["scene", "view", "online (ms)", "vectors (ms)", "computing all vectors (s)", "NRMSE", "NRMSE of vectors"];
    let mut table = Table::new("online", lab.caption("Vectors of each frame"), columns).timed();
    for run in lab.results.of(ONLINE) {
        let (scene, view) = (run.scene.as_str(), run.view.as_str());
        let set = lab.nearest(scene, view, DEFAULT);
        let beside = lab.run(scene, view, set);
        let (ours, stored) = (lab.times(Some(run))?, lab.times(beside)?);
        table.push([
            scene.into(),
            view.into(),
            ours.as_ref().and_then(own).into(),
            stored.as_ref().and_then(own).into(),
            stored.as_ref().and_then(|times| times.fact("seconds before")).into(),
            lab.nrmse(scene, view, ONLINE)?.into(),
            lab.nrmse(scene, view, set)?.into(),
        ]);
    }
    section.add(table);
    Ok(section)
}

/// Table 4.
pub(super) fn methods(lab: &Lab<'_>) -> Result<Section> {
    let mut section = Section::new("Table 4: other methods");
    section.text(
        "The values of the thesis, with ours in the last row. Times on different machines do not allow a comparison of the methods.",
    );
    let columns = ["method", "environment's frequencies", "objects that may move", "memory", "frames per second"];
    let mut table = Table::new("table-4", lab.caption("Table 4"), columns).timed();
    for row in paper::TABLE_4 {
        table.push(row.map(Cell::from));
    }
    let speed = |scene: &str| -> Result<Option<f64>> {
        let run = lab.run(scene, FRONT, lab.nearest(scene, FRONT, DENSE));
        Ok(lab.times(run)?.as_ref().and_then(own).map(|ms| 1e3 / ms))
    };
    let said = |scene: &str, things: u32| -> Result<Option<String>> {
        Ok(speed(scene)?.map(|fps| format!("{fps:.0} for {things}")))
    };
    let speeds: Vec<String> =
        [said("1 bunny", 1)?, said("15 bunnies and trees", 30)?, said("30 bunnies and trees", 60)?]
            .into_iter()
            .flatten()
            .collect();
    table.push([
        "irradiance vectors (ours)".into(),
        "all".into(),
        "receivers; occluders; with vectors of each frame also rotations, deformations and the environment".into(),
        "0.28 to 34 MB a kind".into(),
        speeds.join(", ").into(),
    ]);
    section.add(table);
    Ok(section)
}

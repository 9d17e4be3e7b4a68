//! The tables of the page.

use lucerna::{Result, measure::Measure};

use super::{THRESHOLD, View, casual, over, practised};
use crate::{
    experiment::results::Done,
    report::{Axis, Cell, Plot, Section, Table},
};

const MARKS: [&str; 4] = ["branch", "tiles", "early-z", "compact"];

/// Table 7 of the thesis: picture, RMS %, mean %.
const TABLE_7: [(&str, f64, f64); 2] = [("memorial", 0.041, 0.025), ("stilllife", 0.074, 0.051)];
/// Table 5: size, frames a second without and with local tone mapping.
const TABLE_5: [(&str, f64, f64); 4] =
    [("256x256", 60.0, 39.0), ("512x512", 29.0, 28.0), ("1024x1024", 9.0, 8.0), ("2048x2048", 9.0, 7.0)];
/// Tables 9 and 10: size, STM/LTM, on GeForce 6600 and 8800 GTX.
const TABLES_9_10: [(&str, f64); 8] = [
    ("320x240", 1.68),
    ("640x480", 2.79),
    ("800x600", 2.89),
    ("1024x768", 3.08),
    ("512x512", 1.40),
    ("1024x1024", 1.65),
    ("2048x2048", 2.00),
    ("4096x4096", 2.22),
];
/// Tables 12 and 13: picture, STM/LTM on both.
const TABLES_12_13: [(&str, f64, f64); 2] = [("memorial", 3.28, 2.48), ("desk", 1.7, 1.63)];
/// Tables 14 to 16: picture, VDP % with Sobel, with saliency, SSIM, VDP % of the global operator.
pub(super) const TABLES_14_16: [(&str, f64, f64, f64, f64); 2] =
    [("memorial", 2.41, 3.62, 0.9876, 5.44), ("desk", 2.72, 2.05, 0.9925, 17.66)];

/// Printed STM/LTM of a size of frames (tables 9, 10) or of a picture (table 12).
pub(super) fn printed(name: &str) -> Option<f64> {
    let stills = TABLES_12_13.iter().map(|(name, ratio, _)| (*name, *ratio));
    TABLES_9_10.into_iter().chain(stills).find(|(known, _)| *known == name).map(|(_, ratio)| ratio)
}

/// The gain of selection, for each way of averaging.
pub(super) fn payoff(views: &[View<'_>]) -> Result<Section> {
    let mut section = Section::new("Does selection still pay?");
    section.text(
        "By its definition, the local operator averages every neighbourhood of every pixel separately (*literal*). Selection then saves the \
         time of all unselected pixels. If the averages are computed along rows and columns (*fast*), they cost so little that selection saves \
         less. If large averages are computed from halved pictures (*pyramid*; the result differs slightly, see FLIP against the literal \
         operator), it saves even less. The first table has the ratio of the times of local and selective tone mapping with the same kind of \
         averages. Above 1 selection is faster.",
    );
    let title = "Speed of selective over local tone mapping, by kind of averages";
    let columns = ["picture", "important (%)", "literal", "marked by", "fast", "pyramid"];
    let mut gains = Table::new("payoff", title, columns).timed();
    let title = "Local tone mapping: speed of better averages";
    let columns = ["picture", "literal (ms)", "literal / fast", "literal / pyramid", "FLIP of pyramid"];
    let mut ways = Table::new("payoff-ways", title, columns).timed();
    let mut points = [const { Vec::new() }; 3];
    for view in views {
        let (literal, fast, pyramid) = (view.ms("ltm")?, view.ms("ltm-fast")?, view.ms("ltm-pyramid")?);
        let best = view.best_mark()?;
        let important = view.important(view.run("stm", None))?.map(|share| share * 100.0);
        let selective = over(literal, best.as_ref().map(|(_, ms)| *ms));
        let selective_fast = over(fast, view.ms("stm-fast")?);
        let selective_pyramid = over(pyramid, view.ms("stm-pyramid")?);
        let flip = if view.is_measured() {
            Some(view.measures(&casual(), [Measure::Flip], view.run("ltm", None), view.run("ltm-pyramid", None))?[0])
        } else {
            None
        };
        gains.push([
            view.name().into(),
            important.into(),
            selective.into(),
            best.map_or(Cell::Empty, |(mark, _)| mark.into()),
            selective_fast.into(),
            selective_pyramid.into(),
        ]);
        ways.push([
            view.name().into(),
            literal.into(),
            over(literal, fast).into(),
            over(literal, pyramid).into(),
            flip.into(),
        ]);
        for (points, gain) in points.iter_mut().zip([selective, selective_fast, selective_pyramid]) {
            points.extend(important.zip(gain));
        }
    }
    section.add(gains);
    section.add(ways);
    let plot = Plot::new(
        "payoff-plot",
        "Gain against the share of important pixels",
        Axis::new("important (%)"),
        Axis::new("times"),
    );
    let [literal, fast, pyramid] = points;
    let plot = plot.points("literal / selective", literal).points("fast / selective fast", fast);
    section.add(plot.points("pyramid / selective pyramid", pyramid).timed());
    Ok(section)
}

/// Table 7.
pub(super) fn agreement(views: &[View<'_>]) -> Result<Section> {
    let mut section = Section::new("Table 7: the device against the CPU");
    section.text("Errors of display luminance (equations 18 and 19), against the reference implementation on the CPU.");
    let columns = ["picture", "RMS % (thesis)", "mean % (thesis)", "RMS %", "mean %", "fast: RMS %", "fast: mean %"];
    let mut table = Table::new("table-7", "Table 7", columns);
    for view in views {
        let truth = view.run("cpu", None);
        if truth.is_none() {
            continue;
        }
        let paper = TABLE_7.iter().find(|(name, ..)| *name == view.of.0);
        let list = [Measure::RmsPercent, Measure::MeanPercent];
        let literal = view.measures(&practised(), list, truth, view.run("ltm", None))?;
        let fast = view.measures(&practised(), list, truth, view.run("ltm-fast", None))?;
        table.push([
            view.name().into(),
            paper.map(|p| p.1).into(),
            paper.map(|p| p.2).into(),
            literal[0].into(),
            literal[1].into(),
            fast[0].into(),
            fast[1].into(),
        ]);
    }
    section.add(table);
    Ok(section)
}

fn rate(ms: Option<f64>) -> Cell {
    ms.map(|ms| 1e3 / ms).into()
}

/// Tables 5 and 8 to 10.
pub(super) fn frames(views: &[View<'_>]) -> Result<Section> {
    let mut section = Section::new("Tables 5 and 8 to 10: frames by size");
    section.text(
        "Frames per second of tone mapping only. Ours are for the device named at the end of the page; the thesis' figures are for a GeForce 6600 \
         (4:3) and an 8800 GTX (squares). Only ratios between columns are comparable.",
    );
    let columns = ["frame", "thesis", "thesis, with LTM", "rendering", "with LTM", "with LTM fast", "with LTM pyramid"];
    let title = "Table 5: frames a second of rendering, and of rendering with tone mapping";
    let mut whole = Table::new("table-5", title, columns).timed();
    let heads = ["frame", "GTM", "LTM", "STM", "thesis"].map(str::to_owned);
    let marks = MARKS.iter().map(|mark| (*mark).to_owned());
    let fast = ["LTM fast", "STM fast", "LTM pyramid", "STM pyramid"].map(str::to_owned);
    let title = "Tables 9 and 10: frames a second (STM by early-z), and STM/LTM by way to mark";
    let mut table = Table::new("table-9", title, heads.into_iter().chain(marks).chain(fast)).timed();
    let frames = || views.iter().filter(|view| !view.is_still());
    for view in frames() {
        let size = view.of.1.rsplit(' ').next().unwrap_or_default();
        let paper = TABLES_9_10.iter().find(|(name, _)| *name == size).map(|(_, ratio)| *ratio);
        let (local, selective) = (view.ms("ltm")?, view.ms_marked("early-z")?);
        let mut row = vec![view.name().into(), rate(view.ms("gtm")?), rate(local), rate(selective), paper.into()];
        for mark in MARKS {
            row.push(over(local, view.ms_marked(mark)?).into());
        }
        for way in ["ltm-fast", "stm-fast", "ltm-pyramid", "stm-pyramid"] {
            row.push(rate(view.ms(way)?));
        }
        table.push(row);
        let paper = TABLE_5.iter().find(|(name, ..)| *name == size);
        let render = view.ms("frame")?;
        let both = |ms: Option<f64>| rate(render.zip(ms).map(|(a, b)| a + b));
        whole.push([
            view.name().into(),
            paper.map(|p| p.1).into(),
            paper.map(|p| p.2).into(),
            rate(render),
            both(local),
            both(view.ms("ltm-fast")?),
            both(view.ms("ltm-pyramid")?),
        ]);
    }
    section.add(whole);
    section.add(table);
    for table in by_threshold(&frames().collect::<Vec<_>>(), "table-8", "Table 8: selective, by threshold")? {
        section.add(table);
    }
    Ok(section)
}

/// Times and shares of important pixels by threshold.
fn by_threshold(views: &[&View<'_>], name: &str, title: &str) -> Result<[Table; 2]> {
    let all = views.iter().flat_map(|view| of_thresholds(view));
    let mut thresholds: Vec<String> = all.filter_map(|run| run.value("tonemap.threshold")).collect();
    thresholds.sort_by(|a, b| number(a).total_cmp(&number(b)));
    thresholds.dedup();
    let each = |thresholds: &[String], what: &str| -> Vec<String> {
        std::iter::once("picture".to_owned()).chain(thresholds.iter().map(|t| format!("{t} {what}"))).collect()
    };
    let mut times = Table::new(name, title, each(&thresholds, "(1/s)")).timed();
    let mut shares = Table::new(format!("{name}-important"), "Important pixels by threshold", each(&thresholds, "(%)"));
    for view in views.iter().filter(|view| of_thresholds(view).next().is_some()) {
        let (mut rates, mut parts) = (vec![Cell::from(view.name())], vec![Cell::from(view.name())]);
        for threshold in &thresholds {
            let run = of_thresholds(view).find(|run| run.value("tonemap.threshold").as_ref() == Some(threshold));
            rates.push(rate(view.time(run)?));
            parts.push(view.important(run)?.map(|share| share * 100.0).into());
        }
        times.push(rates);
        shares.push(parts);
    }
    Ok([times, shares])
}

fn of_thresholds<'a>(view: &View<'a>) -> impl Iterator<Item = &'a Done> {
    view.results.at(view.of).filter(|run| run.method == "stm-threshold")
}

fn number(text: &str) -> f64 {
    text.parse().unwrap_or(f64::NAN)
}

/// Tables 11 to 13.
pub(super) fn stills(views: &[View<'_>]) -> Result<Section> {
    let mut section = Section::new("Tables 11 to 13: pictures");
    section.text(format!(
        "Threshold {THRESHOLD}. STM/LTM is the speed of selective over local tone mapping, for each way to mark pixels."
    ));
    let mut table = Table::new(
        "table-11",
        "Table 11",
        [
            "picture",
            "pixels",
            "dynamic range (log₁₀)",
            "dynamic range of 99.9 % of the pixels (log₁₀)",
            "important (%)",
        ],
    );
    let heads = ["picture", "GTM (ms)", "LTM (ms)", "fast LTM (ms)", "pyramid LTM (ms)"].map(str::to_owned);
    let marks = MARKS.iter().map(|mark| (*mark).to_owned());
    let paper = ["thesis, 6600", "thesis, 8800"].map(str::to_owned);
    let title = "Tables 12 and 13: times, and STM/LTM by way to mark";
    let mut times = Table::new("table-12", title, heads.into_iter().chain(marks).chain(paper)).timed();
    for view in views.iter().filter(|view| view.is_still()) {
        let global = view.run("gtm", None);
        let mut size = Cell::Empty;
        let (mut range, mut most) = (None, None);
        if let Some(run) = global {
            let luminance = view.results.picture(super::Layer(run, "luminance"))?;
            size = format!("{} × {}", luminance.width, luminance.height).into();
            let mut lit: Vec<f64> = luminance.pixels.iter().map(|p| f64::from(p[0])).filter(|l| *l > 0.0).collect();
            lit.sort_by(f64::total_cmp);
            // The share of the pixels that is left out at each end.
            let without = |share: f64| {
                let out = (share * lit.len() as f64) as usize;
                let (low, high) = (lit.get(out)?, lit.get(lit.len().checked_sub(1 + out)?)?);
                Some((high / low).log10()).filter(|range| range.is_finite())
            };
            (range, most) = (without(0.0), without(5e-4));
        }
        let important = view.important(view.run("stm", None))?.map(|share| share * 100.0);
        table.push([view.name().into(), size, range.into(), most.into(), important.into()]);
        let local = view.ms("ltm")?;
        let mut cells = vec![view.name().into(), view.ms("gtm")?.into(), local.into()];
        cells.extend([view.ms("ltm-fast")?.into(), view.ms("ltm-pyramid")?.into()]);
        for mark in MARKS {
            cells.push(over(local, view.ms_marked(mark)?).into());
        }
        let paper = TABLES_12_13.iter().find(|(name, ..)| *name == view.of.0);
        cells.extend([paper.map(|p| p.1).into(), paper.map(|p| p.2).into()]);
        times.push(cells);
    }
    section.add(table);
    section.add(times);
    let stills: Vec<_> = views.iter().filter(|view| view.is_still()).collect();
    for table in by_threshold(&stills, "thresholds", "Selective, by threshold (early-z)")? {
        section.add(table);
    }
    Ok(section)
}

/// Tables 14 to 16.
pub(super) fn quality(views: &[View<'_>]) -> Result<Section> {
    let mut section = Section::new("Tables 14 to 16: what selection loses");
    section.text(
        "Losses against local tone mapping by the literal operator. VDP %: share of pixels with a visible difference (lower is better). Gain: frames per \
         second over VDP % (equations 20, 21; higher is better), with early-z. The thesis names neither the program that computed its VDP nor its \
         settings. The first table is for an inexperienced observer (slope of masking 1), a screen of 100 cd/m² with 67 pixels per degree, and \
         differences that are detected almost certainly (p > 0.95). The second table is for Daly's practised observer (slope 0.7) and p > 0.75, who \
         sees differences in up to ten times as many pixels. If the global operator is a hundred times as fast as the local one, its gain is larger, \
         regardless of its losses.",
    );
    let names = [
        "picture",
        "global (thesis)",
        "global",
        "Sobel (thesis)",
        "Sobel",
        "saliency (thesis)",
        "saliency",
        "Sobel, half size",
    ];
    let mut table = Table::new("table-14", "Table 14: VDP %", names);
    let columns = ["picture", "global", "Sobel", "saliency"];
    let mut sharp = Table::new("vdp-practised", "VDP % of the practised observer", columns);
    let columns = ["picture", "SSIM (thesis)", "SSIM", "FLIP"];
    let mut alike = Table::new("table-15", "Table 15: SSIM, and FLIP (Sobel)", columns);
    let mut gains =
        Table::new("table-16", "Table 16: gain", ["picture", "GTM (1/s)", "STM (1/s)", "gain GTM", "gain STM"]).timed();
    for view in views.iter().filter(|view| view.is_measured()) {
        let truth = view.run("ltm", None);
        let sobel = view.run("stm", Some(("tonemap.mark", "early-z")));
        let vdp = |run| view.measures(&casual(), [Measure::Vdp], truth, run).map(|[vdp]| vdp);
        let seen_by_practised = |run| view.measures(&practised(), [Measure::Vdp], truth, run).map(|[vdp]| vdp);
        let [seen, ssim, flip] =
            view.measures(&casual(), [Measure::Vdp, Measure::Ssim, Measure::Flip], truth, sobel)?;
        let global = vdp(view.run("gtm", None))?;
        let paper = TABLES_14_16.iter().find(|(name, ..)| *name == view.of.0);
        table.push([
            view.name().into(),
            paper.map(|p| p.4).into(),
            global.into(),
            paper.map(|p| p.1).into(),
            seen.into(),
            paper.map(|p| p.2).into(),
            vdp(view.run("stm-saliency", None))?.into(),
            vdp(view.run("stm-half", None))?.into(),
        ]);
        alike.push([view.name().into(), paper.map(|p| p.3).into(), ssim.into(), flip.into()]);
        sharp.push([
            view.name().into(),
            seen_by_practised(view.run("gtm", None))?.into(),
            seen_by_practised(sobel)?.into(),
            seen_by_practised(view.run("stm-saliency", None))?.into(),
        ]);
        let (fast, selective) = (view.ms("gtm")?, view.time(sobel)?);
        let gain = |ms: Option<f64>, vdp: f64| ms.map(|ms| 1e3 / ms / vdp).filter(|gain| gain.is_finite());
        gains.push([
            view.name().into(),
            rate(fast),
            rate(selective),
            gain(fast, global).into(),
            gain(selective, seen).into(),
        ]);
    }
    section.add(table);
    section.add(sharp);
    section.add(alike);
    section.add(gains);
    Ok(section)
}

/// Losses and times of the other operators.
pub(super) fn operators(views: &[View<'_>]) -> Result<Section> {
    let mut section = Section::new("Other operators in the same framework");
    let columns = ["picture", "operator", "VDP % global", "VDP % selective", "SSIM selective"];
    let mut losses = Table::new("operators", "Reinhard 2002 and the bilateral operator", columns);
    let columns = ["picture", "operator", "GTM (ms)", "LTM (ms)", "STM (ms)", "STM/LTM"];
    let mut times = Table::new("operators-times", "Their times, by the fast local operators", columns).timed();
    for view in views {
        for operator in ["reinhard", "bilateral"] {
            let run = |mode: &str| view.run(&format!("{operator}-{mode}"), None);
            let (global, local, selective) = (run("gtm"), run("ltm"), run("stm"));
            if local.is_none() {
                continue;
            }
            let [worst] = view.measures(&casual(), [Measure::Vdp], local, global)?;
            let [seen, ssim] = view.measures(&casual(), [Measure::Vdp, Measure::Ssim], local, selective)?;
            losses.push([view.name().into(), operator.into(), worst.into(), seen.into(), ssim.into()]);
            let [global, local, selective] = [view.time(global)?, view.time(local)?, view.time(selective)?];
            times.push([
                view.name().into(),
                operator.into(),
                global.into(),
                local.into(),
                selective.into(),
                over(local, selective).into(),
            ]);
        }
    }
    section.add(losses);
    section.add(times);
    Ok(section)
}

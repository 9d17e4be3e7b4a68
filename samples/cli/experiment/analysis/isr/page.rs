//! The tables, plots and images of the page.

use lucerna::Result;

use super::{
    JUDGED, Labelled,
    rows::{Row, Spread, improved},
};
use crate::{
    experiment::{
        place::spread,
        results::{Done, Layer, Results},
    },
    report::{Axis, Cell, Comparison, Page, Plot, Section, Table},
};

/// Longest side of an image in the page, pixels.
const SIDE: u32 = 512;
/// Views in the list of the smallest gains.
const WORST: usize = 12;

pub(super) fn fill(results: &Results, page: &mut Page, all: &[Labelled]) -> Result<()> {
    let rows = |label: &str| all.iter().find(|l| l.label == label).map_or(&[][..], |l| &l.rows[..]);
    page.add(figures(rows(JUDGED), rows("albedo"), rows("albedo-0.1")));
    page.add(cost(results)?);
    page.add(views(rows(JUDGED), rows("albedo")));
    page.add(scenes(rows(JUDGED)));
    page.add(small_gains(rows(JUDGED)));
    page.add(beyond(results, all)?);
    if let Some(section) = povray(results, rows(JUDGED))? {
        page.add(section);
    }
    page.add(images(results, rows(JUDGED))?);
    Ok(())
}

fn of(rows: &[Row], value: impl Fn(&Row) -> f64) -> Option<Spread> {
    Spread::of(rows.iter().map(value))
}

/// The dissertation's figures, compared with ours.
pub(super) fn figures(lit: &[Row], albedo: &[Row], weaker: &[Row]) -> Section {
    let mut section = Section::new("The dissertation's figures");
    section.text(
        "Gain is the reduction of the mean absolute error of direct light by image-space radiosity, in percent (equation 19, all \
         pixels and channels). Errors are for linear radiance unless stated. *8 bits*: errors for sRGB codes, at the exposure that \
         maps the 95th percentile of the reference to 0.8; this is closer to the dissertation's comparison. The sender `lit` is the \
         direct light that a surface reflects; `albedo` has all of the dissertation's choices, with one brightness factor per view, so \
         that its direct light has the reference's mean.",
    );
    let select =
        |rows: &[Row], complex: bool| rows.iter().filter(|r| r.complex == complex).cloned().collect::<Vec<_>>();
    for (id, caption, rows) in
        [("lit", "Sender `lit`", lit), ("albedo", "The dissertation's choices (`albedo`)", albedo)]
    {
        let gain = of(rows, Row::gain);
        let codes = of(rows, Row::gain_codes);
        let (simple, complex) = (of(&select(rows, false), Row::gain), of(&select(rows, true), Row::gain));
        let correlation = of(rows, Row::correlation_gain);
        let mean = |value: fn(&Row) -> f64| of(rows, value).map(|s| s.mean);
        let table = Table::figures(format!("figures-{id}"), caption)
            .figure("views", "", 227.0, rows.len() as f64)
            .figure("views with a positive gain", "%", 100.0, gain.map(|s| s.positive))
            .figure("gain, mean", "%", 5.88, gain.map(|s| s.mean))
            .figure("gain, median", "%", 7.18, gain.map(|s| s.median))
            .figure("gain, simple scenes, least", "%", 0.21, simple.map(|s| s.least))
            .figure("gain, simple scenes, most", "%", 3.34, simple.map(|s| s.most))
            .figure("gain, complex scenes, least", "%", 2.51, complex.map(|s| s.least))
            .figure("gain, complex scenes, most", "%", 14.69, complex.map(|s| s.most))
            .figure("gain of 8 bits, mean", "%", 5.88, codes.map(|s| s.mean))
            .figure("gain of 8 bits, median", "%", 7.18, codes.map(|s| s.median))
            .figure("gain of 8 bits, views with a positive one", "%", 100.0, codes.map(|s| s.positive))
            .figure("correlation of direct light, mean", "", 0.8867, mean(|r| r.direct_correlation))
            .figure("correlation with image-space radiosity, mean", "", 0.887, mean(|r| r.correlation))
            .figure("correlation gain, least", "", None, correlation.map(|s| s.least))
            .figure("correlation gain, most", "", None, correlation.map(|s| s.most))
            .figure("pixels improved", "%", 99.05, (!rows.is_empty()).then(|| improved(rows).0))
            .figure("pixels not made worse", "%", None, (!rows.is_empty()).then(|| 100.0 - improved(rows).1))
            .figure(
                "pixels whose indirect light alone is nearer than none",
                "%",
                None,
                share(rows, |r| r.indirect_better),
            )
            .figure("pixels whose indirect light alone is farther", "%", None, share(rows, |r| r.indirect_worse))
            .figure(
                "pixels that no indirect light reaches in the reference",
                "%",
                None,
                share(rows, |r| r.pixels - r.reached),
            );
        section.add(table);
    }
    let repaired = albedo.iter().filter(|row| row.correlation_gain() < 0.0);
    let (mut worse, mut mended) = (0usize, 0usize);
    for row in repaired {
        worse += 1;
        let same = weaker.iter().find(|other| other.scene == row.scene && other.view == row.view);
        mended += usize::from(same.is_some_and(|other| other.correlation_gain() >= row.correlation_gain()));
    }
    section.text(
        "A pixel is *improved* if indirect light makes its error smaller. Black background and surfaces without indirect light do not \
         change, and do not count as improved. If noise or texture filtering makes direct light brighter than the reference, any \
         indirect light increases the error. Therefore the indirect light itself is also compared with the reference's indirect light.",
    );
    section.text(format!(
        "With the dissertation's choices the correlation falls on {worse} of {} views. On {mended} of these views it is better with \
         k_ISR = 0.1, the dissertation's remedy for such views, than with 0.5.",
        albedo.len()
    ));
    section
}

/// Table 2 and figures 5.6, 5.7.
fn cost(results: &Results) -> Result<Section> {
    let mut section = Section::new("Cost");
    section.text(
        "Our times are for the device named at the end of the page; the dissertation's times are for a Radeon HD 4870 at 1024 × 768 and for \
         a quad-core processor. Only ratios between rows of one device are comparable.",
    );
    for (id, method, caption) in [
        ("table-2", "albedo", "Table 2: frame times with the dissertation's choices"),
        ("table-2-lit", JUDGED, "The same with the sender `lit`"),
    ] {
        let mut frames = (Vec::new(), Vec::new(), Vec::new());
        for run in results.of(method) {
            let times = results.times(run)?;
            frames.0.extend(times.frame());
            frames.1.push(gathering(&times));
            if let Some(truth) = results.beside(run, "path") {
                frames.2.extend(results.times(truth)?.frame());
            }
        }
        let (isr, step, path) = (Spread::of(frames.0), Spread::of(frames.1), Spread::of(frames.2));
        let direct = isr.zip(step).map(|(isr, step)| isr.mean - step.mean);
        let total = |s: Option<Spread>| s.map(|s| s.mean * s.count as f64 / 1e3);
        let table = Table::figures(id, caption)
            .figure("image-space radiosity, total", "s", 2.02, total(isr))
            .figure("image-space radiosity, mean frame", "ms", 8.89, isr.map(|s| s.mean))
            .figure("image-space radiosity, mean rate", "1/s", 112.49, isr.map(|s| 1e3 / s.mean))
            .figure("image-space radiosity, least rate", "1/s", 90.0, isr.map(|s| 1e3 / s.most))
            .figure("direct light, total", "s", 1.64, total(isr).zip(total(step)).map(|(isr, step)| isr - step))
            .figure("direct light, mean frame", "ms", 1640.0 / 227.0, direct)
            .figure("image-space radiosity alone", "ms", 1.674, step.map(|s| s.mean))
            .figure("reference, total", "s", 168_070.0, total(path))
            .figure("reference, mean", "s", 740.4, path.map(|s| s.mean / 1e3))
            .figure("reference, mean rate", "1/s", 0.00135, path.map(|s| 1e3 / s.mean))
            .figure("reference over image-space radiosity", "", 83_000.0, path.zip(isr).map(|(p, i)| p.mean / i.mean));
        section.add(table.timed());
    }
    let counts = ["24", "48", "80"];
    let mut points = Vec::new();
    for count in counts {
        let mut list = Vec::new();
        for run in results.of("samples").filter(|run| run.value("isr.samples").as_deref() == Some(count)) {
            list.push(gathering(&results.times(run)?));
        }
        points.extend(Spread::of(list).map(|s| (count.parse().unwrap_or(f64::NAN), s.median)));
    }
    let mut table =
        Table::new("samples", "Figure 5.7: cost against samples", ["samples", "step (ms)", "over 48 samples"]).timed();
    let base = points.iter().find(|p| p.0 == 48.0).map(|p| p.1);
    for (count, ms) in &points {
        table.push([(*count).into(), (*ms).into(), base.map(|base| ms / base).into()]);
    }
    section.add(table);
    let plot =
        Plot::new("figure-5-7", "Cost against samples", Axis::new("samples").with(0.0), Axis::new("ms").with(0.0));
    section.add(plot.line("downsampling, gathering, blur and sum", points).timed());
    Ok(section)
}

/// Time of image-space radiosity without G-buffer, shadow maps and direct light.
fn gathering(times: &crate::experiment::kinds::Times) -> f64 {
    let own = |name: &str| {
        let last = name.rsplit('/').next().unwrap_or(name);
        name.contains("isr") && !last.starts_with("passes.direct")
    };
    times.passes.iter().filter(|(name, _)| own(name)).map(|(_, ms)| ms).sum()
}

fn views(lit: &[Row], albedo: &[Row]) -> Section {
    let mut section = Section::new("View by view");
    section.text("Simple scenes come first, then complex scenes. Hover over a dot to see its name.");
    let mut order: Vec<&Row> = lit.iter().collect();
    order.sort_by_key(|row| row.complex);
    let simple = order.iter().filter(|row| !row.complex).count() as f64 - 0.5;
    let named = |value: &dyn Fn(&Row) -> f64| {
        let point = |(i, row): (usize, &&Row)| (i as f64, value(row), format!("{}, {}", row.scene, row.view));
        order.iter().enumerate().map(point).collect::<Vec<_>>()
    };
    let axis = || Axis::new("view");
    let error =
        Plot::new("figure-5-8", "Figure 5.8: mean error", axis(), Axis::new("mean absolute error, W/(sr·m²)").log());
    let error = error.named_points("direct light", named(&|r| r.direct));
    section.add(error.named_points("image-space radiosity", named(&|r| r.technique)).upright(simple, "complex"));
    let gain = Plot::new("figure-5-9", "Figure 5.9: gain of each view", axis(), Axis::new("gain (%)").with(0.0));
    let gain = gain.named_points("linear", named(&Row::gain)).named_points("8 bits", named(&Row::gain_codes));
    section.add(gain.across(7.18, "median of the dissertation").upright(simple, "complex"));
    let correlation =
        Plot::new("figure-5-10", "Figure 5.10: correlation gain", axis(), Axis::new("correlation gain").with(0.0));
    let correlation = correlation.named_points("lit", named(&Row::correlation_gain));
    let of_albedo = order.iter().enumerate().filter_map(|(i, row)| {
        let other = albedo.iter().find(|other| other.scene == row.scene && other.view == row.view)?;
        Some((i as f64, other.correlation_gain(), format!("{}, {}", row.scene, row.view)))
    });
    section.add(correlation.named_points("albedo", of_albedo).upright(simple, "complex"));
    let gains: Vec<f64> = lit.iter().map(Row::gain).collect();
    section.add(
        Plot::new("gains", "Gains of all views", Axis::new("gain (%)"), Axis::new("views"))
            .histogram("views", &gains, 20),
    );
    section
}

const COLUMNS: [&str; 9] = [
    "views",
    "gain, median (%)",
    "mean",
    "least",
    "most",
    "positive (%)",
    "8 bits, median",
    "improved (%)",
    "light found",
];

/// Percentage of the pixels of all views.
fn share(rows: &[Row], of: impl Fn(&Row) -> usize) -> Option<f64> {
    let sum = |of: &dyn Fn(&Row) -> usize| rows.iter().map(of).sum::<usize>() as f64;
    (!rows.is_empty()).then(|| 100.0 * sum(&of) / sum(&|row| row.pixels))
}

fn summary(rows: &[Row]) -> Vec<Cell> {
    let (gain, codes) = (of(rows, Row::gain), of(rows, Row::gain_codes));
    vec![
        rows.len().into(),
        gain.map(|s| s.median).into(),
        gain.map(|s| s.mean).into(),
        gain.map(|s| s.least).into(),
        gain.map(|s| s.most).into(),
        gain.map(|s| s.positive).into(),
        codes.map(|s| s.median).into(),
        (!rows.is_empty()).then(|| improved(rows).0).into(),
        of(rows, |r| r.found).map(|s| s.median).into(),
    ]
}

fn scenes(lit: &[Row]) -> Section {
    let mut section = Section::new("Scene by scene");
    section.text(
        "*Light found* is the ratio of the means of the indirect light, ours over the reference's; median over views.",
    );
    let mut table = Table::new("scenes", "Sender `lit`", ["scene"].into_iter().chain(COLUMNS));
    let mut names: Vec<&str> = Vec::new();
    for row in lit.iter().filter(|row| !names.contains(&row.scene.as_str())).collect::<Vec<_>>() {
        if !names.contains(&row.scene.as_str()) {
            names.push(&row.scene);
        }
    }
    for name in names {
        let rows: Vec<Row> = lit.iter().filter(|row| row.scene == name).cloned().collect();
        table.push([name.into()].into_iter().chain(summary(&rows)));
    }
    table.push(["all".into()].into_iter().chain(summary(lit)));
    section.add(table.digits(3));
    section
}

fn small_gains(lit: &[Row]) -> Section {
    let mut section = Section::new("Where it gains least");
    section.text(
        "Parts of the remaining error. *Direct*: the error of direct light, which indirect light cannot correct. *Missing* and *excess*: too \
         little and too much indirect light, as means over blocks of 8 × 8 pixels. *Fine*: the rest, which is noise of the reference and detail. \
         *Why* names the largest part.",
    );
    let mut order: Vec<&Row> = lit.iter().collect();
    order.sort_by(|a, b| a.gain().total_cmp(&b.gain()));
    let columns = [
        "scene",
        "view",
        "gain (%)",
        "8 bits (%)",
        "light found",
        "direct (%)",
        "missing (%)",
        "excess (%)",
        "fine (%)",
        "why",
    ];
    let mut table = Table::new("least", "The smallest gains", columns).digits(3);
    for row in order.into_iter().take(WORST) {
        let numbers = [row.gain(), row.gain_codes(), row.found].into_iter().chain(row.parts.percent()).map(Cell::from);
        let names = [row.scene.as_str().into(), row.view.as_str().into()];
        table.push(names.into_iter().chain(numbers).chain([row.reason().into()]));
    }
    section.add(table);
    section
}

/// Options and presets: time and error on the views that all of them have.
fn beyond(results: &Results, all: &[Labelled]) -> Result<Section> {
    let mut section = Section::new("Beyond the dissertation");
    section.text(
        "The ideas of the dissertation's future work (chapter 6), one at a time, and the presets of `isr render --preset`. The table has the \
         views that all of them rendered. `bounces` is compared with a reference of three bounces, all others with one bounce.",
    );
    let options = ["full", "by-depth", "layers", "border", "cameras", "bounces", "fast", "balanced", "best"];
    let common = |row: &Row| {
        options.iter().all(|name| {
            let rows = all.iter().find(|l| l.label == *name).map(|l| &l.rows);
            rows.is_none_or(|rows| rows.iter().any(|other| other.scene == row.scene && other.view == row.view))
        })
    };
    let mut errors = Table::new("beyond", "Error", ["technique"].into_iter().chain(COLUMNS)).digits(3);
    let columns = ["technique", "frame (ms)", "over the default", "gathering (ms)"];
    let mut times = Table::new("beyond-times", "Cost", columns).timed();
    let mut base = None;
    for name in [JUDGED].into_iter().chain(options) {
        let Some(labelled) = all.iter().find(|l| l.label == name) else { continue };
        let rows: Vec<Row> = labelled.rows.iter().filter(|row| common(row)).cloned().collect();
        errors.push([name.into()].into_iter().chain(summary(&rows)));
        let (mut frames, mut steps) = (Vec::new(), Vec::new());
        for run in results.of(name).filter(|run| rows.iter().any(|r| r.scene == run.scene && r.view == run.view)) {
            let spent = results.times(run)?;
            frames.extend(spent.frame());
            steps.push(gathering(&spent));
        }
        let frame = Spread::of(frames).map(|s| s.mean);
        base = base.or(frame);
        let ratio = frame.zip(base).map(|(frame, base)| frame / base);
        times.push([name.into(), frame.into(), ratio.into(), Spread::of(steps).map(|s| s.mean).into()]);
    }
    section.add(errors);
    section.add(times);
    Ok(section)
}

/// Comparison with POV-Ray, if it is installed: with the dissertation's settings, and without its factor on gathered light.
fn povray(results: &Results, lit: &[Row]) -> Result<Option<Section>> {
    use lucerna::measure::Measure::{Gain, Mae, Pearson};
    let columns = [
        "brightness",
        "scene",
        "view",
        "gain (%)",
        "correlation, direct",
        "with isr",
        "path tracer",
        "mean over path tracer",
    ];
    let mut table = Table::new("povray", "Gain and correlation against POV-Ray", columns).digits(3);
    let mut gains = Vec::new();
    for (method, brightness) in [("povray", 2.4), ("povray-1", 1.0)] {
        for model in results.of(method) {
            let Some(run) = results.beside(model, JUDGED) else { continue };
            if !lit.iter().any(|row| row.scene == run.scene && row.view == run.view) {
                continue;
            }
            let (truth, direct) = (Layer(model, ""), Layer(run, "direct"));
            let of = |test| results.measure(Pearson, truth, test, None);
            let before = results.measure(Mae, truth, direct, None)?;
            let gain = match before > 0.0 {
                true => results.measure(Gain, truth, Layer(run, ""), Some(direct))?,
                false => f64::NAN,
            };
            gains.push((brightness, gain));
            let path = results.beside(model, "path");
            let traced = path.map(|path| of(Layer(path, ""))).transpose()?;
            let mean = |picture: Vec<[f32; 3]>| picture.iter().flatten().map(|v| f64::from(*v)).sum::<f64>();
            let ratio = match path {
                Some(path) => {
                    Some(mean(results.picture(truth)?.pixels) / mean(results.picture(Layer(path, ""))?.pixels))
                }
                None => None,
            };
            let names = [run.scene.as_str().into(), run.view.as_str().into()];
            let values = [gain.into(), of(direct)?.into(), of(Layer(run, ""))?.into(), traced.into(), ratio.into()];
            table.push([brightness.into()].into_iter().chain(names).chain(values));
        }
    }
    if table.rows.is_empty() {
        return Ok(None);
    }
    let mut section = Section::new("Against POV-Ray");
    section.text(
        "POV-Ray with the dissertation's radiosity settings (table 1). Their `brightness` of 2.4 multiplies gathered light at every \
         bounce. Such pictures are brighter than physically correct ones (the last column), so the gain of a method depends on whether it \
         finds too much or too little indirect light. A brightness of 1 conserves energy. POV-Ray gathers two bounces, as its \
         `recursion_limit` counts them.",
    );
    let mut summary =
        Table::new("povray-gain", "Gain against POV-Ray", ["brightness", "views", "median (%)", "positive (%)"]);
    for brightness in [2.4, 1.0] {
        let of = Spread::of(gains.iter().filter(|g| g.0 == brightness).map(|g| g.1));
        let count = of.map(|s| s.count);
        summary.push([brightness.into(), count.into(), of.map(|s| s.median).into(), of.map(|s| s.positive).into()]);
    }
    section.add(summary.digits(3));
    section.add(table);
    Ok(Some(section))
}

fn images(results: &Results, lit: &[Row]) -> Result<Section> {
    let mut section = Section::new("Images");
    let views = results.views();
    let views: Vec<_> =
        views.into_iter().filter(|(scene, view)| lit.iter().any(|r| r.scene == *scene && r.view == *view)).collect();
    for view in spread(&views, Some(results.experiment.images)) {
        let (scene, name) = *view;
        let run = |method: &str| results.at(*view).find(|run| run.method == method && run.variant.is_empty());
        let Some((truth, base)) = run("path").zip(run(JUDGED)) else { continue };
        let reference = results.picture(Layer(truth, ""))?;
        let exposure = f64::from(super::rows::exposure(&reference.pixels)).log2();
        let id = format!("{scene}-{name}");
        let mut set = Comparison::new(id, format!("{scene}, {name}"), reference.width, reference.height)
            .exposure((exposure * 4.0).round() / 4.0)
            .with("reference", reference.pixels)
            .with("direct light", results.picture(Layer(base, "direct"))?.pixels);
        for run in [Some(base), run("balanced"), run("best")].into_iter().flatten() {
            set = set.with(shown(run), results.picture(Layer(run, ""))?.pixels);
        }
        section.add(set.at_most(SIDE));
    }
    Ok(section)
}

fn shown(run: &Done) -> String {
    if run.method == JUDGED { "image-space radiosity".into() } else { run.method.clone() }
}

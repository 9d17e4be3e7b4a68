//! The dissertation's figures beside ours, for its own pair.

use lucerna::Result;

use super::{
    MODEL, PAPER, PAPER_LARGE, against, is_large,
    judged::{Judged, weighted},
};
use crate::{
    experiment::results::{Done, Layer, Results},
    report::{Cell, Section, Table},
};

/// Percentage of all pixels, with the weights of [`weighted`].
pub(super) fn percent(rows: &[Judged], value: impl Fn(&Judged) -> f64) -> Option<f64> {
    weighted(rows, value).map(|all| 100.0 * all.mean)
}

/// Least and most of a value over the simple or the complex views.
fn ends(rows: &[Judged], complex: bool, value: impl Fn(&Judged) -> f64) -> Option<[f64; 2]> {
    let of = rows.iter().filter(|row| row.complex == complex).map(value).filter(|value| value.is_finite());
    of.fold(None, |ends, value| Some(ends.map_or([value; 2], |[a, b]: [f64; 2]| [a.min(value), b.max(value)])))
}

pub(super) fn pair(results: &Results) -> Result<Section> {
    let mut section = Section::new("The dissertation's figures, like for like");
    section.text(
        "Gain is the reduction of the mean absolute error of direct light by image-space radiosity, in percent (equation 19, all pixels and channels). \
         The model images are POV-Ray's with table 1. Both sides have the light of listing 9: parallel, without shadows and falloff, of colour 1.3. In \
         this light the law of equation 16 and that of POV-Ray are the same, and no factor is needed. *Linear*: values as computed. *8 bits*: \
         codes from 0 to 255 without a transfer curve, in which everything above 1 is white. Simple views weigh 80 of 227, as in the dissertation. \
         Its model images are not available, and most of its views are from a commercial game; we use other views.",
    );
    let rows = against(results, MODEL, |run| run.method == PAPER && !is_large(run))?;
    section.add(figures("pair", "Linear", &rows, Judged::gain, 0));
    section.add(figures("pair-codes", "8 bits", &rows, Judged::gain_codes, 1));
    let large = against(results, MODEL, |run| (run.method == PAPER || run.method == PAPER_LARGE) && is_large(run))?;
    if !large.is_empty() {
        let columns = ["scene", "view", "gain (%)", "8 bits (%)", "correlation gain", "pixels improved (%)"];
        let mut table = Table::new("pair-large", "Single views at 1024 × 768", columns).digits(3);
        for row in &large {
            table.push([
                row.scene.as_str().into(),
                row.view.as_str().into(),
                row.gain().into(),
                row.gain_codes().into(),
                row.correlation_gain().into(),
                (100.0 * row.better[0]).into(),
            ]);
        }
        section.add(table);
    }
    let columns =
        ["scene", "view", "gain (%)", "8 bits (%)", "correlation gain", "pixels improved (%)", "model brighter (%)"];
    let mut table = Table::new("pair-views", "View by view", columns).digits(3);
    for row in &rows {
        table.push([
            row.scene.as_str().into(),
            row.view.as_str().into(),
            row.gain().into(),
            row.gain_codes().into(),
            row.correlation_gain().into(),
            (100.0 * row.better[0]).into(),
            (100.0 * row.brighter).into(),
        ]);
    }
    section.add(table);
    Ok(section)
}

/// The quantities that the dissertation prints.
pub(super) fn figures(
    id: &str,
    caption: &str,
    rows: &[Judged],
    gain: impl Fn(&Judged) -> f64 + Copy,
    kind: usize,
) -> Table {
    let all = weighted(rows, gain);
    let (simple, complex) = (ends(rows, false, gain), ends(rows, true, gain));
    let mean = |value: &dyn Fn(&Judged) -> f64| weighted(rows, value).map(|all| all.mean);
    let count = (!rows.is_empty()).then_some(rows.len() as f64);
    let simple_count = rows.iter().filter(|row| !row.complex).count() as f64;
    let kind_mean = |complex: bool| {
        let rows: Vec<Judged> = rows.iter().filter(|row| row.complex == complex).cloned().collect();
        weighted(&rows, gain).map(|all| all.mean)
    };
    let share = count.map(|count| 100.0 * simple_count / count);
    Table::figures(id, caption)
        .figure("views", "", 227.0, count)
        .figure("simple views", "%", 100.0 * super::judged::SIMPLE_SHARE, share)
        .figure("views with a positive gain", "%", 100.0, all.map(|all| all.positive))
        .figure("gain, mean", "%", 5.88, all.map(|all| all.mean))
        .figure("gain, median", "%", 7.18, all.map(|all| all.median))
        .figure("gain, simple scenes, least", "%", 0.21, simple.map(|ends| ends[0]))
        .figure("gain, simple scenes, most", "%", 3.34, simple.map(|ends| ends[1]))
        .figure("gain, complex scenes, least", "%", 2.51, complex.map(|ends| ends[0]))
        .figure("gain, complex scenes, most", "%", 14.69, complex.map(|ends| ends[1]))
        .figure("gain, simple scenes, mean", "%", None, kind_mean(false))
        .figure("gain, complex scenes, mean", "%", None, kind_mean(true))
        .figure(
            "gain, complex over simple scenes, mean",
            "",
            None,
            kind_mean(true)
                .zip(kind_mean(false))
                .filter(|(_, simple)| *simple > 0.0)
                .map(|(complex, simple)| complex / simple),
        )
        .figure("correlation of direct light, mean", "", 0.8867, mean(&|row| row.correlations[kind][0]))
        .figure("correlation with image-space radiosity, mean", "", 0.887, mean(&|row| row.correlations[kind][1]))
        .figure(
            "correlation gain, mean",
            "",
            0.0003,
            mean(&|row| row.correlations[kind][1] - row.correlations[kind][0]),
        )
        .figure("pixels improved", "%", 99.05, percent(rows, |row| row.better[kind]))
        .figure("pixels made worse", "%", None, percent(rows, |row| row.worse[kind]))
        .digits(4)
}

/// Median, mean, share of views with a gain, share of the pixels improved.
fn gains(rows: &[Judged]) -> [Cell; 4] {
    let all = weighted(rows, Judged::gain);
    [
        all.map(|all| all.median).into(),
        all.map(|all| all.mean).into(),
        all.map(|all| all.positive).into(),
        percent(rows, |row| row.better[0]).into(),
    ]
}

/// Sum of absolute differences from the pictures with 80 samples, relative to the sum of the light that 80 samples add.
fn change(results: &Results, count: &str) -> Result<Option<f64>> {
    let counted =
        |run: &Done, count: &str| run.method == "samples" && run.value("isr.samples").as_deref() == Some(count);
    let (mut apart, mut added) = (0.0, 0.0);
    for run in results.of("samples").filter(|run| counted(run, count)) {
        let same = |other: &&Done| counted(other, "80") && other.scene == run.scene && other.view == run.view;
        let Some(base) = results.of("samples").find(same) else { continue };
        let pixels = |run: &Done, layer: &str| results.picture(Layer(run, layer)).map(|picture| picture.pixels);
        let (test, direct) = (pixels(run, "")?, pixels(base, "direct")?);
        let base = pixels(base, "")?;
        let sum = |a: &[[f32; 3]], b: &[[f32; 3]]| -> f64 {
            a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| f64::from(a - b).abs()).sum()
        };
        apart += sum(&test, &base);
        added += sum(&base, &direct);
    }
    Ok((added > 0.0).then(|| apart / added))
}

pub(super) fn samples(results: &Results) -> Result<Section> {
    let mut section = Section::new("Figure 5.6: number and pattern of samples");
    section.text(
        "The same pair with other numbers of samples, and with other patterns of 80 samples. The dissertation sees little difference above 80, without figures. *Difference from 80*: the sum of \
         absolute differences from the pictures with 80 samples, relative to the light that 80 samples add.",
    );
    let columns = ["gain, median (%)", "gain, mean (%)", "positive (%)", "pixels improved (%)"];
    let heads = ["samples"].into_iter().chain(columns).chain(["difference from 80"]);
    let mut table = Table::new("pair-samples", "Gain by the number of samples", heads).digits(3);
    for count in ["24", "48", "80", "120", "168"] {
        let of = |run: &Done| run.method == "samples" && run.value("isr.samples").as_deref() == Some(count);
        let rows = against(results, MODEL, of)?;
        if !rows.is_empty() {
            table.push([count.into()].into_iter().chain(gains(&rows)).chain([change(results, count)?.into()]));
        }
    }
    section.add(table);
    let heads = ["pattern", "jitter"].into_iter().chain(columns);
    let mut table = Table::new("pair-patterns", "Gain by the pattern of 80 samples", heads).digits(3);
    let mut known = Vec::new();
    for run in results.of("patterns") {
        if known.contains(&&run.variant) {
            continue;
        }
        known.push(&run.variant);
        let rows = against(results, MODEL, |other| other.method == "patterns" && other.variant == run.variant)?;
        let names = ["isr.pattern", "isr.jitter"].map(|key| run.value(key).unwrap_or_default().into());
        table.push(names.into_iter().chain(gains(&rows)));
    }
    section.add(table);
    Ok(section)
}

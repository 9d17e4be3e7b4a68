//! Losses of selection by the unit of a picture: the thesis' threshold is a luminance, and its pictures' unit is not printed.

use lucerna::{Result, measure::Measure};

use super::{STILL, View, casual, tables::TABLES_14_16};
use crate::{
    experiment::results::{Done, Layer},
    report::{Cell, Section, Table},
};

/// Runs of the unit table, by technique. Each has a matrix of [`EXPOSURE`].
const GLOBAL: &str = "unit-gtm";
const LOCAL: &str = "unit-ltm";
const SOBEL: &str = "unit-stm";
const SALIENCY: &str = "unit-saliency";
/// The setting that multiplies a picture's values, in stops.
const EXPOSURE: &str = "tonemap.exposure";

/// The tables; `None` if the experiment has no such runs.
pub(super) fn section(views: &[View<'_>]) -> Result<Option<Section>> {
    let mut section = Section::new("Tables 14 to 16 by the unit of the pictures");
    section.text(
        "The threshold of 0.1 and the local operator both depend on the unit of luminance, and the thesis does not print the unit of its pictures. A file of the format Radiance holds \
         radiances, of which one unit is 179 cd/m², and `Tree` states 621 cd/m² for white; the other pictures state nothing. *Unit*: luminance of the value 1 that is taken, cd/m². The row with unit 1 \
         has the values as they are in the file. *Log-average*: of the luminance in this unit. All rows are against local tone mapping in the same unit, with the averages of the definition. *Global / Sobel*: share of visible differences with the global operator over that with selection by Sobel.",
    );
    let columns = [
        "picture",
        "unit (cd/m²)",
        "log-average (cd/m²)",
        "important by Sobel (%)",
        "important by saliency (%)",
        "VDP % global (thesis)",
        "VDP % global",
        "VDP % Sobel (thesis)",
        "VDP % Sobel",
        "VDP % saliency (thesis)",
        "VDP % saliency",
        "SSIM Sobel (thesis)",
        "SSIM Sobel",
        "global / Sobel",
    ];
    let mut table = Table::new("units", "Losses of selection by the unit", columns).digits(3);
    let mut found = false;
    for view in views.iter().filter(|view| view.results.at(view.of).any(|run| run.group == STILL)) {
        let mut units: Vec<(f64, String)> = runs(view, LOCAL)
            .filter_map(|run| run.value(EXPOSURE))
            .filter_map(|value| Some((value.parse().ok()?, value)))
            .collect();
        units.sort_by(|a, b| a.0.total_cmp(&b.0));
        let thesis = TABLES_14_16.iter().find(|(name, ..)| *name == view.of.0);
        for (stops, value) in units {
            let run = |method| runs(view, method).find(|run| run.value(EXPOSURE).as_ref() == Some(&value));
            let (local, global, sobel, saliency) = (run(LOCAL), run(GLOBAL), run(SOBEL), run(SALIENCY));
            let [of_global] = view.measures(&casual(), [Measure::Vdp], local, global)?;
            let [of_sobel, alike] = view.measures(&casual(), [Measure::Vdp, Measure::Ssim], local, sobel)?;
            let [of_saliency] = view.measures(&casual(), [Measure::Vdp], local, saliency)?;
            let share = |run| view.important(run).map(|share| Cell::from(share.map(|share| share * 100.0)));
            found = true;
            table.push([
                view.name().into(),
                stops.exp2().into(),
                log_average(view, global)?.into(),
                share(sobel)?,
                share(saliency)?,
                thesis.map(|of| of.4).into(),
                of_global.into(),
                thesis.map(|of| of.1).into(),
                of_sobel.into(),
                thesis.map(|of| of.2).into(),
                of_saliency.into(),
                thesis.map(|of| of.3).into(),
                alike.into(),
                Some(of_global / of_sobel).filter(|ratio| ratio.is_finite()).into(),
            ]);
        }
    }
    section.add(table);
    Ok(found.then_some(section))
}

fn runs<'a>(view: &View<'a>, method: &'static str) -> impl Iterator<Item = &'a Done> {
    view.results.at(view.of).filter(move |run| run.method == method)
}

/// Log-average of the luminance that the operator works on, black pixels left out.
fn log_average(view: &View<'_>, run: Option<&Done>) -> Result<Option<f64>> {
    let Some(run) = run else { return Ok(None) };
    let luminance = view.results.picture(Layer(run, "luminance"))?.pixels;
    let lit: Vec<f64> = luminance.iter().map(|pixel| f64::from(pixel[0])).filter(|value| *value > 0.0).collect();
    let mean = lit.iter().map(|value| value.ln()).sum::<f64>() / lit.len() as f64;
    Ok(Some(mean.exp()).filter(|mean| mean.is_finite()))
}

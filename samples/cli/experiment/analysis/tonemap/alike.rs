//! Selection in the thesis' class of cost: a local operator that searches from pixel to pixel over small windows.

use lucerna::{Result, measure::Measure};

use super::{View, casual, over, tables};
use crate::{
    experiment::results::Done,
    report::{Cell, Section, Table},
};

/// Frames a second of the thesis by the size of the frame or the name of the picture: GTM and LTM (tables 9, 10, 12).
const RATES: [(&str, [f64; 2]); 10] = [
    ("320x240", [226.0, 83.0]),
    ("640x480", [111.0, 28.0]),
    ("800x600", [80.0, 19.0]),
    ("1024x768", [55.0, 12.0]),
    ("512x512", [1719.0, 360.0]),
    ("1024x1024", [584.0, 115.0]),
    ("2048x2048", [195.0, 33.0]),
    ("4096x4096", [56.0, 9.0]),
    ("memorial", [136.0, 25.0]),
    ("desk", [95.0, 18.0]),
];
const RADII: [&str; 3] = ["2", "5", "10"];

fn radius(run: &Done) -> Option<String> {
    run.value("tonemap.radius")
}

/// The selective run with a radius and a way to mark.
fn selective<'a>(view: &View<'a>, wanted: &str, mark: &str) -> Option<&'a Done> {
    view.results.at(view.of).find(|run| {
        run.method == "stm-growing"
            && radius(run).as_deref() == Some(wanted)
            && run.value("tonemap.mark").as_deref() == Some(mark)
    })
}

pub(super) fn section(views: &[View<'_>]) -> Result<Section> {
    let mut section = Section::new("Like for like: the thesis' class of cost");
    section.text(
        "The thesis' local operator takes 2.7 to 6.2 times the time of the global one (tables 9, 10, 12). An operator that computes thousands of samples for each pixel (*literal*) takes hundreds of \
         times as long. *Growing* searches from pixel to pixel: windows grow ring by ring, and the search ends at the first uneven one. Its cost is in the thesis' class \
         where *LTM/GTM* is near the thesis' ratio, and there the gain of selection, STM/LTM, is comparable with the thesis' 1.4 to 3.67 (its table 12 prints 3.76 for rates of 44 and 12). Selection is by early-z, the thesis' second way. Radius: the largest window, as in the setting `tonemap.radius`; its surround has twice the radius. \
         Gain: frames a second over VDP % (equations 20 and 21). \
         Losses are against local tone mapping by the same windows. FLIP: local tone mapping by these windows against Gaussian averages.",
    );
    let columns = [
        "picture",
        "radius",
        "LTM/GTM (thesis)",
        "LTM/GTM",
        "STM/LTM (thesis)",
        "STM/LTM",
        "STM/LTM, tiles",
        "STM/LTM, compact",
        "GTM (ms)",
        "LTM (ms)",
        "STM (ms)",
        "important (%)",
        "gain GTM",
        "gain STM",
        "gain STM/GTM",
        "LTM (1/s)",
        "STM (1/s)",
    ];
    let mut table =
        Table::new("like-for-like", "Cost of the local operator, and gain of selection", columns).digits(3).timed();
    let columns =
        ["picture", "radius", "VDP % of STM", "VDP % of GTM", "SSIM of STM", "FLIP of LTM to Gaussian averages"];
    let mut losses = Table::new("like-for-like-losses", "Losses of selection", columns).digits(3);
    for view in views {
        let size = if view.is_still() { view.of.0 } else { view.of.1.rsplit(' ').next().unwrap_or_default() };
        let thesis = RATES.iter().find(|(name, _)| *name == size).map(|(_, rates)| *rates);
        let global = view.ms("gtm")?;
        for wanted in RADII {
            let local = view.run("ltm-growing", Some(("tonemap.radius", wanted)));
            let Some((local, run)) = local.zip(selective(view, wanted, "early-z")) else { continue };
            let Some(ms) = view.time(Some(run))? else { continue };
            let spent = view.time(Some(local))?;
            let important = view.important(Some(run))?.map(|share| share * 100.0);
            let (mut of_stm, mut of_gtm) = (None, None);
            if view.is_measured() {
                let list = [Measure::Vdp, Measure::Ssim];
                let [seen, alike] = view.measures(&casual(), list, Some(local), Some(run))?;
                let [of_global] = view.measures(&casual(), [Measure::Vdp], Some(local), view.run("gtm", None))?;
                let [flip] = view.measures(&casual(), [Measure::Flip], view.run("ltm", None), Some(local))?;
                let cells: [Cell; 6] =
                    [view.name().into(), wanted.into(), seen.into(), of_global.into(), alike.into(), flip.into()];
                losses.push(cells);
                // Equations 20 and 21.
                let gain = |ms: f64, vdp: f64| Some(1e3 / ms / vdp).filter(|gain| gain.is_finite());
                (of_stm, of_gtm) = (gain(ms, seen), global.and_then(|ms| gain(ms, of_global)));
            }
            table.push([
                view.name().into(),
                wanted.into(),
                thesis.map(|[global, local]| global / local).into(),
                over(spent, global).into(),
                tables::printed(size).into(),
                over(spent, Some(ms)).into(),
                over(spent, view.time(selective(view, wanted, "tiles"))?).into(),
                over(spent, view.time(selective(view, wanted, "compact"))?).into(),
                global.into(),
                spent.into(),
                ms.into(),
                important.into(),
                of_gtm.into(),
                of_stm.into(),
                over(of_stm, of_gtm).into(),
                spent.map(|ms| 1e3 / ms).into(),
                (1e3 / ms).into(),
            ]);
        }
    }
    section.add(table);
    section.add(losses);
    Ok(section)
}

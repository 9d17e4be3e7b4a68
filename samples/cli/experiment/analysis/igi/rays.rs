//! Rays per second in the stages of a frame.

use lucerna::{
    Result,
    techniques::igi::{GATHERED, PictureSettings, Visibility},
};
use serde_json::Value;

use super::{name, stages, stages::Part};
use crate::{
    experiment::{
        kinds,
        results::{Done, Layer, Results},
    },
    report::{Cell, Section, Table},
};

/// Parts whose number of rays is known, with the heads of their columns.
const COLUMNS: [(Part, &str); 5] = [
    (Part::Shooting, "shooting"),
    (Part::Choosing, "choosing"),
    (Part::Direct, "direct"),
    (Part::Gathering, "gathering"),
    (Part::Compensation, "compensation"),
];

/// Maximum of rays for each part of [`COLUMNS`]; `None` if the part traces no rays, or their number is not known.
type Rays = [Option<f64>; COLUMNS.len()];

/// Maximum of rays, from the settings, the size of the picture, and the direct light's rays per pixel.
fn at_most(settings: &PictureSettings, [width, height]: [u32; 2], direct_rays: Option<u32>) -> Rays {
    let igi = &settings.igi;
    let pixels = f64::from(width) * f64::from(height);
    let texels = f64::from(width.div_ceil(igi.downsample)) * f64::from(height.div_ceil(igi.downsample));
    let bounces = f64::from(igi.bounces);
    let shot = f64::from(igi.paths() * igi.candidates);
    let segments = bounces + if igi.specular { f64::from(igi.specular_depth) } else { 0.0 };
    let lights = igi.paths() * igi.bounces;
    let each = if igi.picks_from(lights) { igi.texel_picks() } else { lights.div_ceil(igi.interleave.pow(2)) };
    let by_rays = igi.visibility != Visibility::Raster;
    // Each segment has a ray, a shadow ray for direct light and, except for the last segment, a shadow ray to a virtual light.
    let back = f64::from(igi.compensation) * (3.0 * bounces - 1.0);
    [
        igi.indirect.then_some(shot * segments),
        (igi.indirect && igi.candidates > 1).then(|| shot * bounces * f64::from(igi.judges)),
        direct_rays.map(|rays| pixels * f64::from(rays)),
        (igi.indirect && by_rays).then(|| texels * f64::from(each)),
        (igi.indirect && igi.compensates()).then_some(texels * back),
    ]
}

/// All settings of a run; `None` for a run of another kind.
fn settings(results: &Results, run: &Done) -> Result<Option<PictureSettings>> {
    let Some(method) = results.experiment.methods.iter().find(|method| method.name == run.method) else {
        return Ok(None);
    };
    if method.kind != "igi" {
        return Ok(None);
    }
    let value: Value = kinds::find(&method.kind)?.effective(method, &run.variant)?;
    Ok(serde_json::from_value(value).ok())
}

/// Numbers of rays, and rays per second.
pub(super) fn rates(results: &Results) -> Result<Section> {
    let mut section = Section::new("Rays per second");
    section.text(
        "Millions of rays per frame, computed from the settings, the pixels and the light sources. They are an upper limit: paths that leave the scene \
         end, and no ray is traced from the background, to lights behind the surface, or if no light arrives. The rates therefore are upper limits, too. \
         *Counted* is the number of shadow rays that the gathering pass has traced, so its rate is exact. The rays of ray trees (mirrors and glass) and of \
         refinement are not counted; *raster* has no rays to virtual lights.",
    );
    let heads = ["scene", "variant"].into_iter().chain(COLUMNS.map(|column| column.1)).chain(["gathering, counted"]);
    let heads: Vec<&str> = heads.collect();
    let mut counts = Table::new("rays", "Rays of a frame, at most (millions)", heads.clone());
    let mut rates = Table::new("rays-times", "Rays per second, at most (millions)", heads).timed();
    for view in results.views() {
        for run in results.at(view).filter(|run| !super::beyond::MANY.contains(&run.method.as_str())) {
            let Some(settings) = settings(results, run)? else { continue };
            let picture = results.picture(Layer(run, ""))?;
            let spent = stages::spent(results, run)?;
            let igi = &settings.igi;
            let direct = run.shining.map(|shining| shining.rays(igi.direct_samples, igi.glossy_rays()));
            let rays = at_most(&settings, [picture.width, picture.height], direct);
            let counted = results.times(run)?.fact(GATHERED).filter(|rays| *rays > 0.0);
            let all = COLUMNS.map(|column| column.0).into_iter().zip(rays).chain([(Part::Gathering, counted)]);
            let all: Vec<(Part, Option<f64>)> = all.collect();
            let names = [name(view).into(), Cell::from(run.label())];
            counts
                .push(names.clone().into_iter().chain(all.iter().map(|(_, rays)| rays.map(|rays| rays * 1e-6).into())));
            let rate = |(part, rays): &(Part, Option<f64>)| -> Cell {
                let rate = rays.map(|rays| rays / spent.part(*part) * 1e-3).filter(|rate| rate.is_finite());
                rate.into()
            };
            rates.push(names.into_iter().chain(all.iter().map(rate)));
        }
    }
    section.add(counts);
    section.add(rates);
    Ok(section)
}

#[cfg(test)]
mod tests {
    use super::*;
    use lucerna::techniques::igi::Settings;

    #[test]
    fn rays_follow_from_settings_and_pixels() {
        let base =
            Settings { vpls: 180, bounces: 1, candidates: 1, compensation: 0, specular: false, ..Settings::default() };
        let of = |igi: Settings| at_most(&PictureSettings { igi, ..Default::default() }, [81, 60], Some(5));
        assert_eq!(of(base.clone()), [Some(180.0), None, Some(5.0 * 4860.0), Some(180.0 * 4860.0), None]);
        let coarse = Settings { downsample: 4, interleave: 3, ..base.clone() };
        assert_eq!(of(coarse)[3], Some(20.0 * 21.0 * 15.0));
        let picked = Settings { vpls: 1800, picks: 180, interleave: 3, ..base.clone() };
        assert_eq!(of(picked)[3], Some(20.0 * 4860.0));
        let chosen = Settings { candidates: 8, judges: 10, ..base.clone() };
        assert_eq!(of(chosen)[..2], [Some(1440.0), Some(14400.0)]);
        let back = Settings { compensation: 4, bounces: 2, ..base.clone() };
        assert_eq!(of(back)[4], Some(4860.0 * 4.0 * 5.0));
        assert_eq!(of(Settings { visibility: Visibility::Raster, ..base })[3], None);
    }
}

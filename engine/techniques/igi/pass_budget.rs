//! The pass budget: an estimate of a frame's passes, made before any pass is declared. Each setting may be within its range, and
//! together they may still need more passes than a host can plan and record.

use super::{Igi, Settings, Shared, Visibility, raster};
use crate::{
    Error, Result,
    graph::Extent,
    scene::resident::{Cutout, Handles},
};

/// Maximum of passes per frame. The host takes some seconds and a hundred megabytes to plan and record them.
const MOST_PASSES: u64 = 50_000;

/// The passes whose number grows with one setting.
#[derive(Clone, Copy, Debug)]
pub(super) struct Share {
    pub key: &'static str,
    pub passes: u64,
    /// Advice on how to reduce the passes.
    less: &'static str,
}

impl Igi {
    /// Estimated number of passes of a frame of `extent` pixels, for each setting that causes them.
    pub(super) fn passes(&self, extent: Extent, handles: &Handles, shared: &Shared, settings: &Settings) -> Vec<Share> {
        let batches = |extent: Extent, rays: u32| self.batches(extent, rays).len() as u64;
        let (paths, total) = (settings.paths(), settings.paths() * settings.bounces);
        let coarse = extent.div_ceil(settings.downsample);
        let trees = self.trees_of(extent).filter(|_| settings.specular);
        // With a history, mirrors use a second set of virtual lights.
        let chosen = 1 + u64::from(settings.history > 0 && trees.is_some());
        let shot = chosen + u64::from(settings.history > 1);
        let indirect = u64::from(settings.indirect);
        let mut out = Vec::new();
        let mut add = |key, passes, less| out.push(Share { key, passes, less });

        let segments = settings.bounces + if settings.specular { settings.specular_depth } else { 0 };
        add("bounces", indirect * shot * u64::from(segments), "Choose fewer");
        if settings.candidates > 1 {
            let judged = batches(Extent::new(paths * settings.candidates * settings.bounces, 1), settings.judges);
            add("judges", indirect * chosen * judged, "Choose fewer, or fewer candidates");
        }
        let direct = batches(extent, shared.direct_rays);
        let (count, nodes) = trees.map_or((0, Extent::new(1, 1)), |(count, nodes)| (count, Extent::new(nodes, 1)));
        let lit = count * batches(nodes, shared.direct_rays);
        add("direct_samples", direct + lit, "Choose fewer, or a smaller picture");

        let picks = settings.picks_from(total);
        let own = total.div_ceil(settings.interleave * settings.interleave);
        let gathered = match settings.visibility {
            Visibility::Raster => {
                let holed = handles.moment.instances.iter().any(|i| i.casts && i.cutout != Cutout::Opaque);
                raster::passes(settings, total, self.most_layers, holed)
            }
            _ if picks => batches(coarse, settings.texel_picks()),
            _ => batches(coarse, own),
        };
        let of_nodes = if picks { settings.picks } else { total };
        let cells = if settings.cache > 0.0 && count > 0 {
            batches(Extent::new(settings.cache_cells.min(count as u32 * nodes.width), 1), total)
        } else {
            0
        };
        let gathered = gathered + count * batches(nodes, of_nodes) + cells;
        match picks {
            true => add("picks", indirect * gathered, "Choose fewer, or a smaller picture"),
            false => add("vpls", indirect * gathered, "Choose fewer, or igi.picks above 0, or a smaller picture"),
        }
        let refines = settings.refine > 0.0 && settings.upsamples();
        if refines {
            let (lights, _, ranges) = self.refined(extent, own);
            let passes = lights.len() as u64 * u64::from(ranges);
            add("refine", indirect * passes, "Choose 0, or fewer igi.vpls, or a smaller picture");
        }
        if settings.compensates() {
            // A path has one pass at its start and two or three passes per segment.
            let each = 3 * u64::from(settings.bounces);
            let held = |extent: Extent| extent.pixels().div_ceil(u64::from(super::compensation::HELD));
            let listed = if refines { held(extent) } else { 0 };
            let ranges = held(coarse) + listed + count;
            let passes = ranges * (2 + u64::from(settings.compensation) * each);
            add("compensation", indirect * passes, "Choose fewer, or a smaller picture");
        }
        let grown = count * (1 + u64::from(settings.cache > 0.0)) * u64::from(settings.specular_depth + 1);
        add("specular_depth", grown, "Choose less, or a smaller picture");
        out
    }

    /// # Errors
    /// `Usage` if a frame would need more than [`MOST_PASSES`]; names the setting that causes most of them.
    pub(super) fn few_enough(
        &self,
        extent: Extent,
        handles: &Handles,
        shared: &Shared,
        settings: &Settings,
    ) -> Result<()> {
        let shares = self.passes(extent, handles, shared, settings);
        let sum: u64 = shares.iter().map(|share| share.passes).sum();
        let Some(most) = shares.iter().max_by_key(|share| share.passes).filter(|_| sum > MOST_PASSES) else {
            return Ok(());
        };
        let what = format!(
            "a picture of {}×{} pixels would need {sum} passes, {} of them because of this setting; allowed: {MOST_PASSES}",
            extent.width, extent.height, most.passes
        );
        Err(Error::usage(what).at(format!("igi.{}", most.key)).help(most.less))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        gpu::{Gpu, testing::with_gpu},
        graph::Graph,
        scene::{Material, Pose, Scene, View, builtin, resident::Resident},
        techniques::igi::PictureSettings,
    };

    /// A Cornell box with metal walls. Dispatches are short, so that small settings cause many passes.
    fn mirrors(gpu: &Gpu) -> (Scene, Resident, Igi) {
        let mut scene = builtin::load("cornell-area").unwrap();
        scene.materials[0] = Material { metallic: 1.0, roughness: 0.0, ..scene.materials[0].clone() };
        let resident = Resident::new(gpu, &scene).unwrap();
        let mut igi = Igi::new(gpu, &scene, &resident, &Settings::default()).unwrap();
        igi.rays_at_once = 1 << 14;
        (scene, resident, igi)
    }

    #[test]
    fn as_many_are_counted_as_are_declared() {
        with_gpu(|gpu| {
            let (scene, mut resident, mut igi) = mirrors(gpu);
            let pose = Pose::rest(&scene);
            let view = View::of_camera(&scene, &pose, 0, [70, 50]).unwrap();
            let base = Settings { vpls: 60, candidates: 1, direct_samples: 4, ..Settings::default() };
            for (key, settings) in [
                ("vpls", Settings { vpls: 2000, ..base.clone() }),
                ("vpls", Settings { vpls: 2000, downsample: 2, interleave: 3, ..base.clone() }),
                ("vpls", Settings { vpls: 200, visibility: Visibility::Raster, ..base.clone() }),
                ("vpls", Settings { vpls: 2000, cache: 0.05, specular_depth: 1, ..base.clone() }),
                ("picks", Settings { vpls: 5000, picks: 1000, ..base.clone() }),
                ("direct_samples", Settings { direct_samples: 1000, ..base.clone() }),
                ("direct_samples", Settings { direct_samples: 1000, indirect: false, ..base.clone() }),
                ("judges", Settings { vpls: 600, candidates: 20, judges: 1000, ..base.clone() }),
                ("compensation", Settings { compensation: 60, bounces: 3, ..base.clone() }),
                ("refine", Settings { vpls: 2000, specular: false, downsample: 4, refine: 0.1, ..base.clone() }),
                ("vpls", Settings { vpls: 2000, history: 8, ..base.clone() }),
            ] {
                let declare = |frame: u32, igi: &mut Igi, resident: &mut Resident| {
                    let mut graph = Graph::new("count");
                    graph.frame = frame;
                    let handles = resident.frame_in(&mut graph, &scene, &pose);
                    let before = graph.pass_count() as u64;
                    let all = PictureSettings { igi: settings.clone(), ..Default::default() };
                    igi.picture(&mut graph, &scene, &pose, &handles, &view, &all).unwrap();
                    let declared = graph.pass_count() as u64 - before;
                    let shared = igi.shared(&mut graph, &scene, &pose, &handles, &settings);
                    (declared, igi.passes(Extent::from(view.extent), &handles, &shared, &settings))
                };
                let (declared, shares) = declare(1, &mut igi, &mut resident);
                let counted: u64 = shares.iter().map(|share| share.passes).sum();
                println!("{key}: {declared} passes, counted {counted}");
                // The estimate leaves out filters, clears and sorting.
                assert!(declared.abs_diff(counted) <= 80 + declared / 50, "{key}: {declared} and {counted} passes");
                let most = shares.iter().max_by_key(|share| share.passes).unwrap();
                assert!(most.key == key && most.passes > 100, "{most:?} instead of {key}");
            }
        });
    }

    #[test]
    fn what_no_host_could_plan_is_refused_before_it_is_declared() {
        with_gpu(|gpu| {
            let (scene, mut resident, mut igi) = mirrors(gpu);
            let pose = Pose::rest(&scene);
            let view = View::of_camera(&scene, &pose, 0, [800, 600]).unwrap();
            let mut declare = |vpls| {
                let mut graph = Graph::new("refused");
                let handles = resident.frame_in(&mut graph, &scene, &pose);
                let all = PictureSettings { igi: Settings { vpls, ..Settings::default() }, ..Default::default() };
                let result = igi.picture(&mut graph, &scene, &pose, &handles, &view, &all);
                (result, graph.pass_count())
            };
            assert!(declare(20).0.is_ok());
            let (result, passes) = declare(10_000);
            let error = result.unwrap_err();
            assert!(error.exit_code() == 2 && passes < 50, "{passes} passes");
            let text = error.to_string();
            for part in ["igi.vpls: ", "800×600 pixels", "allowed: 50000", "igi.picks above 0"] {
                assert!(text.contains(part), "{part} is not in {text}");
            }
        });
    }
}

//! Gathering: irradiance of the visible surfaces from all virtual lights, or from a few that each receiver picks from the light tree.

use super::{Igi, LightTree, Settings, Shared, Vpls};
use crate::{
    graph::{Buffer, Extent, Format, Graph, Image},
    passes::gbuffer::GBuffer,
    shaders::igi::{gather, gather_picks, refine, refine_groups},
};

/// Pixels of the list per pass: a multiple of the workgroup, and few enough groups for every device.
const LISTED: u32 = 1 << 16;

/// Indirect dispatch sizes (three u32 per range) for `ranges` ranges of `pixels` pixels of the list `unmatched`, whose length only the
/// device knows.
pub(super) fn listed_groups(graph: &mut Graph, unmatched: Buffer, pixels: u32, ranges: u32) -> Buffer {
    let groups = graph.buffer("igi.refine-groups", 12 * u64::from(ranges));
    let push = refine_groups::Push { ranges, pixels };
    graph.compute(refine_groups::Args { unmatched, groups, push }, ranges);
    groups
}

impl Igi {
    /// Irradiance of every [`Settings::downsample`]-th pixel, W/m² (equation 1 without ρ); alpha: number of shadow rays.
    pub(super) fn gather(
        &self,
        graph: &mut Graph,
        g: &GBuffer,
        shared: &Shared,
        vpls: Option<Vpls>,
        settings: &Settings,
    ) -> Image {
        let extent = graph.extent(g.depth).div_ceil(settings.downsample);
        let irradiance = graph.image("igi.irradiance", Format::RGBA32F, extent);
        graph.clear(irradiance, [0.0; 4]);
        let Some(vpls) = vpls else { return irradiance };
        match vpls.tree {
            Some(tree) if settings.picks_from(vpls.count) => {
                self.gather_picks(graph, g, shared, (vpls, tree), settings, irradiance)
            }
            _ => self.gather_all(graph, g, shared, vpls, settings, irradiance),
        }
        irradiance
    }

    fn gather_all(
        &self,
        graph: &mut Graph,
        g: &GBuffer,
        shared: &Shared,
        vpls: Vpls,
        settings: &Settings,
        irradiance: Image,
    ) {
        let extent = graph.extent(irradiance);
        let own = vpls.count.div_ceil(settings.interleave * settings.interleave);
        let push = gather::Push {
            total: vpls.count,
            tile: settings.interleave,
            factor: settings.downsample,
            scattered: settings.scattered.into(),
            least: shared.least,
            stride: settings.stride(),
            seed: shared.seed,
            ..Default::default()
        };
        let spec = gather::Spec { imperfect: settings.imperfect.into() };
        let args = crate::rays::traced!(
            gather::Args { view: g.view, normal: g.normal, depth: g.depth, vpls: vpls.buffer, irradiance, push, spec },
            shared.hidden_by
        );
        graph.compute_over(args, extent, self.items(own, extent.pixels()));
    }

    /// Gathers for the pixels in the list `unmatched` of [`filters::upsample`](super::filters::upsample), each from one subset. If the
    /// bound is compensated, [`Self::compensate_listed`] runs afterwards and dims the specks.
    pub(super) fn refine(
        &self,
        graph: &mut Graph,
        g: &GBuffer,
        shared: &Shared,
        vpls: Vpls,
        settings: &Settings,
        (irradiance, unmatched): (Image, Buffer),
    ) {
        let own = vpls.count.div_ceil(settings.interleave * settings.interleave);
        // Most ranges of the list are empty.
        let ranges = graph.extent(irradiance).pixels().div_ceil(LISTED.into()).max(1) as u32;
        let groups = listed_groups(graph, unmatched, LISTED, ranges);
        for range in 0..ranges {
            let push = refine::Push {
                total: vpls.count,
                tile: settings.interleave,
                least: shared.least,
                stride: settings.stride(),
                seed: shared.seed,
                own,
                begin: range * LISTED,
                limit: if settings.compensates() { 0.0 } else { settings.despeckle },
                ..Default::default()
            };
            let args = crate::rays::traced!(
                refine::Args {
                    view: g.view,
                    normal: g.normal,
                    depth: g.depth,
                    vpls: vpls.buffer,
                    irradiance,
                    unmatched,
                    push,
                    spec: refine::Spec { imperfect: settings.imperfect.into() },
                },
                shared.hidden_by
            );
            graph.compute_indirect_over(args, (groups, 12 * u64::from(range)), self.items(own, LISTED.into()));
        }
    }

    fn gather_picks(
        &self,
        graph: &mut Graph,
        g: &GBuffer,
        shared: &Shared,
        (vpls, tree): (Vpls, LightTree),
        settings: &Settings,
        irradiance: Image,
    ) {
        let extent: Extent = graph.extent(irradiance);
        let picks = settings.texel_picks();
        let push = gather_picks::Push {
            picks,
            proposals: settings.proposals,
            leaves: tree.leaves,
            tile: settings.interleave,
            factor: settings.downsample,
            scattered: settings.scattered.into(),
            least: shared.least,
            stride: settings.stride(),
            seed: shared.seed,
            ..Default::default()
        };
        let args = crate::rays::traced!(
            gather_picks::Args {
                view: g.view,
                normal: g.normal,
                depth: g.depth,
                vpls: vpls.buffer,
                irradiance,
                vpl_nodes: tree.nodes,
                push,
                spec: gather_picks::Spec { imperfect: settings.imperfect.into() },
            },
            shared.hidden_by
        );
        graph.compute_over(args, extent, self.picked(picks, extent.pixels(), settings));
    }
}

#[cfg(test)]
mod tests {
    use crate::builtin;
    use crate::{
        gpu::testing::with_gpu,
        graph::{Graph, Runner},
        resident::Resident,
        scene::{Material, Pose, View},
        techniques::igi::{Igi, PictureSettings, Settings},
    };

    #[test]
    fn any_number_of_lights_takes_the_same_passes_and_short_dispatches_show_nowhere() {
        with_gpu(|gpu| {
            let mut scene = builtin::load("cornell-area").unwrap();
            // Metal walls have ray trees.
            scene.materials[0] = Material { metallic: 1.0, roughness: 0.0, ..scene.materials[0].clone() };
            let mut resident = Resident::new(gpu, &scene).unwrap();
            let mut igi = Igi::new(gpu, &scene, &resident, &Settings::default()).unwrap();
            let pose = Pose::rest(&scene);
            let view = View::of_camera(&scene, &pose, 0, [70, 50]).unwrap();
            let mut render = |settings: &Settings, rays: Option<u64>| {
                let mut graph = Graph::new("passes");
                let handles = resident.frame_in(&mut graph, &scene, &pose);
                let all = PictureSettings { igi: settings.clone(), ..Default::default() };
                let picture = igi.picture(&mut graph, &scene, &pose, &handles, &view, &all).unwrap();
                let read = graph.read_image(picture.outputs.total);
                let runner = Runner::new(gpu);
                let mut runner = rays.map_or_else(|| Runner::new(gpu), |rays| runner.dispatch_rays(rays));
                let mut frame = runner.run(&graph).unwrap();
                let launches: usize = frame.report.passes.iter().map(|pass| pass.launches).sum();
                (frame.take_floats(read), graph.pass_count(), launches)
            };
            // Short rays sort the lights, in more passes for more lights.
            let base = Settings { vpls: 400, candidates: 1, compensation: 0, direct_samples: 4, ..Settings::default() };
            for (settings, more) in [
                (base.clone(), Settings { vpls: 800, ..base.clone() }),
                (Settings { picks: 50, ..base.clone() }, Settings { picks: 100, direct_samples: 8, ..base.clone() }),
                (
                    Settings { cache: 0.05, downsample: 3, refine: 0.1, ..base.clone() },
                    Settings { cache: 0.05, downsample: 3, refine: 0.1, vpls: 800, ..base.clone() },
                ),
                (
                    Settings { vpls: 60, candidates: 8, judges: 50, ..base.clone() },
                    Settings { vpls: 60, candidates: 8, judges: 500, ..base.clone() },
                ),
            ] {
                let (whole, passes, launches) = render(&settings, None);
                let (cut, _, dispatches) = render(&settings, Some(1 << 14));
                assert!(dispatches > launches + 20, "{launches} dispatches, then {dispatches}");
                // Partial sums are rounded otherwise.
                let sum = |image: &[[f32; 4]]| image.iter().flat_map(|p| &p[..3]).map(|v| f64::from(*v)).sum::<f64>();
                let difference =
                    whole.iter().flatten().zip(cut.iter().flatten()).map(|(a, b)| f64::from((a - b).abs()));
                let (difference, all) = (difference.sum::<f64>(), sum(&whole));
                assert!(all > 0.0 && difference < 2e-5 * all, "{difference} of {all} with {settings:?}");
                assert_eq!(render(&more, None).1, passes, "{more:?}");
            }
        });
    }
}

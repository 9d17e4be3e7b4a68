//! Irradiance from virtual lights at the visible surfaces: from all of them, or from a few picked by the tree over them.

use super::{Igi, LightTree, Pattern, Settings, Shared, Vpls};
use crate::{
    graph::{Buffer, Extent, Format, Graph, Image},
    passes::gbuffer::GBuffer,
    shaders::igi::{gather, gather_picks, refine, refine_groups},
};

impl Igi {
    /// Irradiance of every [`Settings::downsample`]-th pixel; alpha: shadow rays.
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
        for (first, count) in self.batches(extent, own) {
            let push = gather::Push {
                first,
                count,
                total: vpls.count,
                tile: settings.interleave,
                factor: settings.downsample,
                scattered: settings.scattered.into(),
                least: shared.least,
                irregular: (settings.pattern == Pattern::Irregular).into(),
                seed: shared.seed,
            };
            let spec = gather::Spec { imperfect: settings.imperfect.into() };
            let args = crate::rays::traced!(
                gather::Args {
                    view: g.view,
                    normal: g.normal,
                    depth: g.depth,
                    vpls: vpls.buffer,
                    irradiance,
                    push,
                    spec
                },
                shared.hidden_by
            );
            graph.compute(args, extent);
        }
    }

    /// Gathers for the pixels that `unmatched` of [`filters::upsample`](super::filters::upsample) lists, each from a subset.
    pub(super) fn refine(
        &self,
        graph: &mut Graph,
        g: &GBuffer,
        shared: &Shared,
        vpls: Vpls,
        settings: &Settings,
        (irradiance, unmatched): (Image, Buffer),
    ) {
        let groups = graph.buffer("igi.refine-groups", 12);
        graph.compute(refine_groups::Args { unmatched, groups }, 1);
        let extent = graph.extent(irradiance);
        let own = vpls.count.div_ceil(settings.interleave * settings.interleave);
        // Most pixels will not be there.
        let few = Extent::new(extent.width.div_ceil(8), extent.height.div_ceil(4));
        for (first, count) in self.batches(few, own) {
            let push = refine::Push {
                first,
                count,
                total: vpls.count,
                tile: settings.interleave,
                least: shared.least,
                irregular: (settings.pattern == Pattern::Irregular).into(),
                seed: shared.seed,
                own,
                limit: settings.despeckle,
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
            graph.compute_indirect(args, groups, 0);
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
        for (first, count) in self.batches(extent, picks) {
            let push = gather_picks::Push {
                first,
                count,
                picks,
                proposals: settings.proposals,
                leaves: tree.leaves,
                tile: settings.interleave,
                factor: settings.downsample,
                scattered: settings.scattered.into(),
                least: shared.least,
                irregular: (settings.pattern == Pattern::Irregular).into(),
                seed: shared.seed,
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
            graph.compute(args, extent);
        }
    }
}

//! Mirrors and glass: a tree of reflected and refracted rays for each pixel that shows a mirror or glass (Whitted 1980).

use super::{Igi, Settings, Shared, Vpls, cache::Cache, dispatch_over};
use crate::{
    graph::{Buffer, Extent, Format, Graph, Image},
    passes::gbuffer::GBuffer,
    resident::Handles,
    shaders::{
        consts::{TREE_BLOCK, TREE_WIDTH},
        igi::{ray_tree_direct, ray_tree_gather, ray_tree_gather_picks, ray_tree_grow, ray_tree_sum},
        types,
    },
};

/// Pixels whose ray trees are in memory at one time.
const SLOTS: u32 = 1 << 16;
const _: () = assert!(SLOTS.is_multiple_of(TREE_BLOCK));

/// The light of all ray trees.
#[derive(Clone, Copy, Debug)]
pub(super) struct Trees {
    /// Radiance, W/(sr·m²); alpha: the share of each pixel's surface that is mirror or glass.
    pub sharp: Image,
    /// `None` if the irradiance cache is off.
    pub cache: Option<Cache>,
}

/// The ray trees of a range of pixels.
#[derive(Clone, Copy, Debug)]
struct Range {
    sharp: Image,
    tree_nodes: Buffer,
    /// Slot of the first pixel.
    first: u32,
    slots: u32,
}

impl Range {
    /// Nodes (`types::TreeNode`) of the range: [`TREE_WIDTH`] for each slot.
    fn nodes(&self) -> u32 {
        self.slots * TREE_WIDTH
    }
}

/// Slots for a picture: its pixels, rounded up to whole blocks of 8 × 8.
fn slots(extent: Extent) -> u32 {
    extent.width.div_ceil(8) * extent.height.div_ceil(8) * 64
}

impl Igi {
    /// Number of ranges of pixels of a picture that have ray trees; 0 if the scene has no mirrors and no glass, or they are off.
    pub(super) fn tree_ranges(&self, extent: Extent, settings: &Settings) -> u64 {
        if self.sharp && settings.specular { slots(extent).div_ceil(SLOTS).into() } else { 0 }
    }

    /// For each range of pixels, traces the ray trees and computes the light at the surfaces where their rays end.
    pub(super) fn trees(
        &self,
        graph: &mut Graph,
        handles: &Handles,
        g: &GBuffer,
        shared: &Shared,
        (vpls, background): (Option<Vpls>, [f32; 3]),
        settings: &Settings,
    ) -> Trees {
        let extent = graph.extent(g.depth);
        let sharp = graph.image("igi.sharp", Format::RGBA32F, extent);
        let slots = slots(extent);
        let held = slots.min(SLOTS);
        let tree_nodes = graph.buffer("igi.trees", u64::from(held * TREE_WIDTH) * size_of::<types::TreeNode>() as u64);
        graph.fill(tree_nodes, 0);
        graph.clear(sharp, [0.0; 4]);
        let ranges: Vec<_> = (0..slots)
            .step_by(held as usize)
            .map(|first| Range { sharp, tree_nodes, first, slots: held.min(slots - first) })
            .collect();
        let cache = vpls.filter(|_| settings.cache > 0.0).map(|vpls| {
            // The cells of all ranges are filled before any range reads them, so that there is no seam between ranges.
            let cache = Cache::new(graph, shared, settings);
            for range in &ranges {
                self.grow(graph, handles, g, shared, background, settings, range);
                cache.claim(graph, tree_nodes, range.first * TREE_WIDTH, range.nodes());
            }
            self.fill(graph, shared, vpls, settings, &cache, slots * TREE_WIDTH);
            cache
        });
        for range in &ranges {
            if cache.is_none() || ranges.len() > 1 {
                self.grow(graph, handles, g, shared, background, settings, range);
            }
            self.direct_of_trees(graph, handles, shared, range);
            if let Some(vpls) = vpls {
                let groups = cache.as_ref().map(|cache| {
                    cache.read(graph, tree_nodes, range.nodes());
                    cache.fallback_groups(graph, range.nodes())
                });
                self.gather_of_trees(graph, shared, vpls, settings, range, groups);
                if settings.compensates() {
                    self.compensate_trees(graph, handles, shared, vpls, settings, (tree_nodes, range.nodes()));
                }
            }
            let push = ray_tree_sum::Push { first: range.first, count: range.slots };
            graph.compute(ray_tree_sum::Args { sharp, tree_nodes, push }, range.slots);
        }
        Trees { sharp, cache }
    }

    /// Traces the rays of a range of pixels, one level of the trees per dispatch.
    #[allow(clippy::too_many_arguments)]
    fn grow(
        &self,
        graph: &mut Graph,
        handles: &Handles,
        g: &GBuffer,
        shared: &Shared,
        background: [f32; 3],
        settings: &Settings,
        range: &Range,
    ) {
        for level in 0..=settings.specular_depth {
            let push = ray_tree_grow::Push { first: range.first, count: range.slots, level, background };
            let args = traced_lit!(
                ray_tree_grow::Args {
                    view: g.view,
                    depth: g.depth,
                    sharp: range.sharp,
                    tree_nodes: range.tree_nodes,
                    push
                },
                shared.rays,
                handles,
                shared
            );
            graph.compute(args, range.nodes()).rays(range.nodes().into());
        }
    }

    /// Adds direct light at the ends of the ray trees.
    fn direct_of_trees(&self, graph: &mut Graph, handles: &Handles, shared: &Shared, range: &Range) {
        let push = ray_tree_direct::Push { nodes: range.nodes(), ..Default::default() };
        let args = traced_lit!(
            ray_tree_direct::Args { tree_nodes: range.tree_nodes, push },
            shared.rays,
            handles,
            shared,
            lamps
        );
        graph.compute_over(args, range.nodes(), self.items(shared.direct_rays, range.nodes().into()));
    }

    /// Adds the light of the virtual lights at the ends of the ray trees. `groups`: number of workgroups, where the device computes it.
    fn gather_of_trees(
        &self,
        graph: &mut Graph,
        shared: &Shared,
        vpls: Vpls,
        settings: &Settings,
        range: &Range,
        groups: Option<Buffer>,
    ) {
        let (nodes, tree_nodes) = (range.nodes(), range.tree_nodes);
        let (least, imperfect, seed) = (shared.least, settings.imperfect.into(), shared.seed);
        if let (Some(tree), true) = (vpls.tree, settings.picks_from(vpls.count)) {
            let (picks, proposals, leaves) = (settings.picks, settings.proposals, tree.leaves);
            let push =
                ray_tree_gather_picks::Push { picks, proposals, leaves, nodes, least, seed, ..Default::default() };
            let spec = ray_tree_gather_picks::Spec { imperfect };
            let args = crate::rays::traced!(
                ray_tree_gather_picks::Args { vpls: vpls.buffer, vpl_nodes: tree.nodes, tree_nodes, push, spec },
                shared.hidden_by
            );
            dispatch_over(graph, args, groups, nodes, self.picked(picks, nodes.into(), settings));
            return;
        }
        let push = ray_tree_gather::Push { nodes, least, seed, ..Default::default() };
        let spec = ray_tree_gather::Spec { imperfect };
        let args =
            crate::rays::traced!(ray_tree_gather::Args { vpls: vpls.buffer, tree_nodes, push, spec }, shared.hidden_by);
        dispatch_over(graph, args, groups, nodes, self.items(vpls.count, nodes.into()));
    }
}

//! Puts back what the bound of the geometry term takes (Kollig and Keller 2004): light from surfaces nearer than the bound is gathered by
//! short rays instead of virtual lights, each weighted by the share that was taken. What lights those surfaces is bounded in its turn, and
//! put back by the next segment, as often as light bounces.

use super::{Igi, LightTree, Settings, Shared, Vpls};
use crate::{
    graph::{Buffer, Graph, Image},
    passes::gbuffer::GBuffer,
    scene::resident::Handles,
    shaders::{
        consts::TEXTURE_SLOTS,
        igi::{near_begin, near_begin_tree, near_direct, near_end, near_end_tree, near_pick, near_trace},
        types,
    },
};

/// Paths that are held at once.
const HELD: u32 = 1 << 18;

/// `types::NearPath` of `paths` paths, undefined until they begin.
fn held(graph: &mut Graph, paths: u32) -> Buffer {
    let near_paths = graph.buffer("igi.near", u64::from(paths.max(1)) * size_of::<types::NearPath>() as u64);
    graph.fill(near_paths, 0);
    near_paths
}

impl Igi {
    /// Adds to the irradiance of every [`Settings::downsample`]-th pixel.
    #[allow(clippy::too_many_arguments)]
    pub(super) fn compensate(
        &self,
        graph: &mut Graph,
        handles: &Handles,
        g: &GBuffer,
        shared: &Shared,
        vpls: Vpls,
        settings: &Settings,
        irradiance: Image,
    ) {
        let Some(tree) = vpls.tree else { return };
        let extent = graph.extent(irradiance);
        let texels = extent.width * extent.height;
        let near_paths = held(graph, texels.min(HELD));
        for first in (0..texels).step_by(HELD as usize) {
            let count = HELD.min(texels - first);
            for number in 0..settings.compensation {
                let push = near_begin::Push {
                    extent: [extent.width, extent.height],
                    first,
                    count,
                    number,
                    paths: settings.compensation,
                    factor: settings.downsample,
                    scattered: settings.scattered.into(),
                };
                let args = near_begin::Args { view: g.view, normal: g.normal, depth: g.depth, near_paths, push };
                graph.compute(args, count);
                self.follow(graph, handles, shared, (vpls, tree), settings, (near_paths, count, number));
            }
            let push = near_end::Push { first, count };
            graph.compute(near_end::Args { irradiance, near_paths, push }, count);
        }
    }

    /// Adds to what reaches the pixels from the ends of their trees.
    pub(super) fn compensate_trees(
        &self,
        graph: &mut Graph,
        handles: &Handles,
        shared: &Shared,
        vpls: Vpls,
        settings: &Settings,
        (tree_nodes, count): (Buffer, u32),
    ) {
        let Some(tree) = vpls.tree else { return };
        let near_paths = held(graph, count);
        for number in 0..settings.compensation {
            let push = near_begin_tree::Push { count, number, paths: settings.compensation };
            graph.compute(near_begin_tree::Args { tree_nodes, near_paths, push }, count);
            self.follow(graph, handles, shared, (vpls, tree), settings, (near_paths, count, number));
        }
        let push = near_end_tree::Push { count };
        graph.compute(near_end_tree::Args { tree_nodes, near_paths, push }, count);
    }

    /// Traces and lights paths that have begun.
    fn follow(
        &self,
        graph: &mut Graph,
        handles: &Handles,
        shared: &Shared,
        (vpls, tree): (Vpls, LightTree),
        settings: &Settings,
        (near_paths, count, number): (Buffer, u32, u32),
    ) {
        let (least, seed) = (shared.least, shared.seed);
        for turn in 0..settings.bounces {
            let diffuse_only = (!settings.specular).into();
            let push = near_trace::Push { count, turn, number, least, diffuse_only, slots: TEXTURE_SLOTS, seed };
            let args = crate::rays::traced!(near_trace::Args { near_paths, push }, shared.rays, handles);
            graph.compute(args, count);
            let push = near_direct::Push { count, turn, number };
            let args = traced_lit!(near_direct::Args { near_paths, push }, shared.rays, handles, shared, lamps);
            graph.compute(args, count);
            // Light that has bounced less often than it may.
            if turn + 1 < settings.bounces {
                let (leaves, bounces) = (tree.leaves, settings.bounces);
                let push = near_pick::Push { count, turn, number, leaves, bounces, least, seed };
                let args = crate::rays::traced!(
                    near_pick::Args { vpls: vpls.buffer, vpl_nodes: tree.nodes, near_paths, push },
                    shared.rays
                );
                graph.compute(args, count);
            }
        }
    }
}

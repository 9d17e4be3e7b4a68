//! Irradiance in space for what mirrors and glass show: cells of a hashed grid, each lit once, instead of every surface by itself.

use super::{Igi, LEAST_CELL, Settings, Shared, Vpls};
use crate::{
    graph::{Buffer, Extent, Graph},
    shaders::{
        consts::CACHE_SLOTS,
        igi::{cache_claim, cache_fill, cache_groups, cache_keep, cache_read},
        types,
    },
};

use glam::Vec3;

/// Invocations of a workgroup that gathers for nodes of trees.
const GROUP: u32 = 64;

/// Cells of a frame.
#[derive(Clone, Copy, Debug)]
pub struct Cache {
    keys: Buffer,
    cells: Buffer,
    /// Number of cells, then their places.
    pub list: Buffer,
    low: [f32; 3],
    side: f32,
    most: u32,
}

impl Cache {
    pub(super) fn new(graph: &mut Graph, shared: &Shared, settings: &Settings) -> Self {
        let slots = u64::from(CACHE_SLOTS);
        let extent = Vec3::from(shared.block.high) - Vec3::from(shared.block.low);
        let cache = Self {
            keys: graph.buffer("igi.cache-keys", 4 * slots),
            cells: graph.buffer("igi.cache-cells", slots * size_of::<types::CacheCell>() as u64),
            list: graph.buffer("igi.cache-list", 4 * (1 + u64::from(settings.cache_cells))),
            low: shared.block.low,
            // Keys must reach all over a scene that has grown.
            side: (settings.cache * shared.diagonal).max(LEAST_CELL * extent.length()).max(1e-12),
            most: settings.cache_cells,
        };
        graph.fill(cache.keys, u32::MAX);
        graph.fill(cache.cells, u32::MAX);
        graph.fill(cache.list, 0);
        cache
    }

    /// Makes cells for surfaces of `nodes` nodes; `first` is the number of the first of them in the picture.
    pub(super) fn claim(&self, graph: &mut Graph, tree_nodes: Buffer, first: u32, nodes: u32) {
        let Self { keys: cache_keys, cells: cache_cells, list: cache_list, low, side, most } = *self;
        let push = cache_claim::Push { low, side, first, nodes, most };
        graph.compute(cache_claim::Args { tree_nodes, cache_keys, cache_cells, cache_list, push }, nodes);
        let push = cache_keep::Push { low, side, first, nodes };
        graph.compute(cache_keep::Args { tree_nodes, cache_keys, cache_cells, cache_list, push }, nodes);
    }

    /// Lights the surfaces of the nodes.
    pub(super) fn read(&self, graph: &mut Graph, tree_nodes: Buffer, nodes: u32) {
        let Self { keys: cache_keys, cells: cache_cells, list: cache_list, low, side, most } = *self;
        let push = cache_read::Push { low, side, nodes, most };
        graph.compute(cache_read::Args { tree_nodes, cache_keys, cache_cells, cache_list, push }, nodes);
    }

    /// Size of dispatches that gather for `nodes` nodes if there are more cells than allowed, else empty.
    pub(super) fn otherwise(&self, graph: &mut Graph, nodes: u32) -> Buffer {
        let groups = graph.buffer("igi.cache-groups", 12);
        let push = cache_groups::Push { most: self.most, full: nodes.div_ceil(GROUP) };
        let Self { keys: cache_keys, cells: cache_cells, list: cache_list, .. } = *self;
        graph.compute(cache_groups::Args { groups, cache_keys, cache_cells, cache_list, push }, 1);
        groups
    }
}

impl Igi {
    /// Gathers for the cells; there are no more than `nodes`.
    pub(super) fn fill(
        &self,
        graph: &mut Graph,
        shared: &Shared,
        vpls: Vpls,
        settings: &Settings,
        cache: &Cache,
        nodes: u32,
    ) {
        let cells = cache.most.min(nodes);
        for (first, count) in self.batches(Extent::new(cells, 1), vpls.count) {
            let push = cache_fill::Push { first, count, most: cache.most, least: shared.least, seed: shared.seed };
            let args = crate::rays::traced!(
                cache_fill::Args {
                    vpls: vpls.buffer,
                    cache_keys: cache.keys,
                    cache_cells: cache.cells,
                    cache_list: cache.list,
                    push,
                    spec: cache_fill::Spec { imperfect: settings.imperfect.into() },
                },
                shared.hidden_by
            );
            graph.compute(args, cells);
        }
    }
}

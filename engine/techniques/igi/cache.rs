//! The irradiance cache for surfaces that mirrors and glass show: a hashed grid in world space. The light of the virtual lights is
//! gathered once for each cell, and not for each surface (sources: `shaders-glsl/igi/cache.glsl`).

use super::{Igi, LEAST_CELL, Settings, Shared, Vpls};
use crate::{
    graph::{Buffer, Graph},
    scene::{Note, NoteKind},
    shaders::{
        consts::CACHE_SLOTS,
        igi::{cache_claim, cache_fill, cache_groups, cache_keep, cache_read},
        types,
    },
};

use glam::Vec3;

/// Invocations per workgroup of the passes that gather for ray tree nodes.
const GROUP: u32 = 64;

/// The irradiance cache of a frame.
#[derive(Clone, Copy, Debug)]
pub struct Cache {
    keys: Buffer,
    cells: Buffer,
    /// u32 values: the number of cells that the frame needs, then the slots of the cells in the hash table.
    pub list: Buffer,
    low: [f32; 3],
    side: f32,
    most: u32,
}

/// Corner and side, metres, of a grid of cells that covers the box from `low` to `high`. The side is `side`, doubled until the keys
/// cover the box. Moving objects stretch the box. The cells do not move with it, because light in mirrors would then jump.
fn grid(low: Vec3, high: Vec3, side: f32) -> (Vec3, f32) {
    // A key has nine bits for each axis, which limits the number of cells along the box.
    let least = LEAST_CELL * (high - low).length();
    let mut side = side.max(1e-12);
    while side < least {
        side *= 2.0;
    }
    // The grid is shifted by half a cell. Many scenes have a floor at height 0, which now lies in the middle of cells and not on
    // their border.
    (((low / side).floor() - 0.5) * side, side)
}

impl Cache {
    pub(super) fn new(graph: &mut Graph, shared: &Shared, settings: &Settings) -> Self {
        let slots = u64::from(CACHE_SLOTS);
        let (low, high) = (Vec3::from(shared.block.low), Vec3::from(shared.block.high));
        let (low, side) = grid(low, high, settings.cache * shared.diagonal);
        let cache = Self {
            keys: graph.buffer("igi.cache-keys", 4 * slots),
            cells: graph.buffer("igi.cache-cells", slots * size_of::<types::CacheCell>() as u64),
            list: graph.buffer("igi.cache-list", 4 * (1 + u64::from(settings.cache_cells))),
            low: low.to_array(),
            side,
            most: settings.cache_cells,
        };
        graph.fill(cache.keys, u32::MAX);
        graph.fill(cache.cells, u32::MAX);
        graph.fill(cache.list, 0);
        cache
    }

    /// A note if `count` cells, the first value of [`Cache::list`], are more than the cache holds.
    pub fn note(&self, count: u32) -> Option<Note> {
        let text = format!(
            "the frame needs more than {} cells (igi.cache_cells): the cache is not used, and every surface that mirrors and glass \
             show gathers light",
            self.most
        );
        (count > self.most).then(|| Note { kind: NoteKind::Ignored, place: "igi.cache".to_owned(), text })
    }

    /// Makes a cell for the surface of each of `nodes` ray tree nodes. `first`: number of the first node within the picture.
    pub(super) fn claim(&self, graph: &mut Graph, tree_nodes: Buffer, first: u32, nodes: u32) {
        let Self { keys: cache_keys, cells: cache_cells, list: cache_list, low, side, most } = *self;
        let push = cache_claim::Push { low, side, first, nodes, most };
        graph.compute(cache_claim::Args { tree_nodes, cache_keys, cache_cells, cache_list, push }, nodes);
        let push = cache_keep::Push { low, side, first, nodes };
        graph.compute(cache_keep::Args { tree_nodes, cache_keys, cache_cells, cache_list, push }, nodes);
    }

    /// Adds the light of the cells to the nodes.
    pub(super) fn read(&self, graph: &mut Graph, tree_nodes: Buffer, nodes: u32) {
        let Self { keys: cache_keys, cells: cache_cells, list: cache_list, low, side, most } = *self;
        let push = cache_read::Push { low, side, nodes, most };
        graph.compute(cache_read::Args { tree_nodes, cache_keys, cache_cells, cache_list, push }, nodes);
    }

    /// Workgroups for the passes that gather for `nodes` nodes: all of them if there are more cells than allowed, else none.
    pub(super) fn fallback_groups(&self, graph: &mut Graph, nodes: u32) -> Buffer {
        let groups = graph.buffer("igi.cache-groups", 12);
        let push = cache_groups::Push { most: self.most, full: nodes.div_ceil(GROUP) };
        let Self { keys: cache_keys, cells: cache_cells, list: cache_list, .. } = *self;
        graph.compute(cache_groups::Args { groups, cache_keys, cache_cells, cache_list, push }, 1);
        groups
    }
}

impl Igi {
    /// Gathers the light of the virtual lights for all cells. There are at most as many cells as `nodes`.
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
        let push = cache_fill::Push { most: cache.most, least: shared.least, seed: shared.seed, ..Default::default() };
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
        graph.compute_over(args, cells, self.items(vpls.count, cells.into()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_stay_where_they_are_while_something_stretches_the_scene() {
        let (low, side) = grid(Vec3::splat(-1.0), Vec3::ONE, 0.07);
        assert_eq!(side, 0.07);
        for step in 0..200 {
            let bird = Vec3::new(0.013, 0.029, 0.017) * step as f32;
            let (lower, wider) = grid(Vec3::splat(-1.0) - bird, Vec3::ONE, 0.07);
            let cells = (low - lower) / side;
            assert!(wider == side && (cells - cells.round()).abs().max_element() < 1e-4, "{cells}");
            assert!(lower.cmple(Vec3::splat(-1.0) - bird).all(), "{lower}");
        }
    }

    #[test]
    fn a_cache_that_is_too_small_is_named() {
        let mut graph = Graph::new("cells");
        let list = graph.buffer("list", 4);
        let cache = Cache { keys: list, cells: list, list, low: [0.0; 3], side: 1.0, most: 20 };
        assert!(cache.note(20).is_none());
        let note = cache.note(21).unwrap();
        assert!(note.place == "igi.cache" && note.text.contains("20 cells (igi.cache_cells)"), "{note:?}");
    }

    #[test]
    fn keys_reach_everywhere() {
        for (low, high, side) in [
            (Vec3::splat(-1.0), Vec3::ONE, LEAST_CELL * 12f32.sqrt()),
            (Vec3::new(-70.3, 0.0, 1.0), Vec3::new(3000.0, 2.0, 90.0), 0.1),
            (Vec3::ZERO, Vec3::new(1.0, 0.0, 0.0), LEAST_CELL),
            (Vec3::ZERO, Vec3::ZERO, 0.0),
        ] {
            let (corner, wide) = grid(low, high, side);
            let last = ((high - corner) / wide).floor();
            assert!(wide >= side && last.cmple(Vec3::splat(511.0)).all(), "{last} of {wide} m");
            // The side is not doubled more often than necessary.
            assert!(wide <= side.max(1e-12) || 0.5 * wide < LEAST_CELL * (high - low).length());
        }
    }
}

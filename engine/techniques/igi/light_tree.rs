//! The light tree: a binary tree over the virtual lights of a frame, from which a receiver picks the lights that send it the most
//! light (Yuksel 2019; Lin and Yuksel 2020). The device builds the tree: a radix sort orders the lights, then pairs of nodes are
//! joined level by level.

use super::{Settings, Vpls};
use crate::{
    graph::{Buffer, Graph},
    shaders::{
        consts::VPL_TREE_MOST,
        igi::{light_tree_join, light_tree_keys, light_tree_leaves, light_tree_sort},
        types,
    },
};

/// A perfectly balanced binary tree over virtual lights.
#[derive(Clone, Copy, Debug)]
pub struct LightTree {
    /// 2·`leaves` values of `types::VplNode`. Node 1 is the root; the children of node i are nodes 2i and 2i + 1.
    pub nodes: Buffer,
    /// Number of leaves, a power of two. Leaf i is node `leaves` + i. It holds virtual light i, or nothing if there is no light i.
    pub leaves: u32,
}

/// Sorts the virtual lights if the settings need it, and builds a tree if receivers pick from it.
pub(super) fn with_light_tree(graph: &mut Graph, vpls: Vpls, settings: &Settings) -> Vpls {
    let picked = settings.picks > 0 || settings.compensates();
    if picked || settings.sorted { sorted(graph, vpls, picked) } else { vpls }
}

/// Sorts the virtual lights, and builds a tree over them if `picked`.
fn sorted(graph: &mut Graph, vpls: Vpls, picked: bool) -> Vpls {
    let total = vpls.count;
    debug_assert!(total <= VPL_TREE_MOST);
    let leaves = total.max(1).next_power_of_two();
    let keys = [(); 2].map(|()| graph.buffer("igi.light-tree-keys", 8 * u64::from(total.max(1))));
    graph.compute(light_tree_keys::Args { vpls: vpls.buffer, keys: keys[0], push: light_tree_keys::Push { total } }, 1);
    // The number of sorting passes is even, so that the result is in the first buffer again.
    for turn in 0..8 {
        let (from, to) = if turn % 2 == 0 { (keys[0], keys[1]) } else { (keys[1], keys[0]) };
        let push = light_tree_sort::Push { total, shift: 4 * turn };
        graph.compute(light_tree_sort::Args { keys: from, sorted: to, push }, 1);
    }
    let ordered = graph.buffer("igi.sorted-vpls", u64::from(total.max(1)) * size_of::<types::Vpl>() as u64);
    let nodes = graph.buffer("igi.light-tree", 2 * u64::from(leaves) * size_of::<types::VplNode>() as u64);
    let push = light_tree_leaves::Push { total, leaves };
    graph.compute(light_tree_leaves::Args { keys: keys[0], vpls: vpls.buffer, ordered, nodes, push }, leaves);
    if !picked {
        return Vpls { buffer: ordered, count: total, tree: None };
    }
    let mut first = leaves / 2;
    while first > 0 {
        graph.compute(light_tree_join::Args { nodes, push: light_tree_join::Push { first } }, first);
        first /= 2;
    }
    Vpls { buffer: ordered, count: total, tree: Some(LightTree { nodes, leaves }) }
}

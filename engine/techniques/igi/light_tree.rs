//! A tree over the virtual lights of a frame, so that a surface can pick those that matter to it. Built on the device: sorted by a radix
//! sort, then joined two by two.

use super::{Settings, Vpls};
use crate::{
    graph::{Buffer, Graph},
    shaders::{
        consts::VPL_TREE_MOST,
        igi::{light_tree_join, light_tree_keys, light_tree_leaves, light_tree_sort},
        types,
    },
};

/// A perfectly balanced tree over virtual lights.
#[derive(Clone, Copy, Debug)]
pub struct LightTree {
    /// `types::VplNode`: the root is number 1, below node i are 2 i and 2 i + 1.
    pub nodes: Buffer,
    /// A power of two; leaf i is node `leaves` + i and stands for virtual light i, or for none.
    pub leaves: u32,
}

/// The same virtual lights, with a tree over them if something picks from it, sorted if that or their order is asked for.
pub(super) fn with_light_tree(graph: &mut Graph, vpls: Vpls, settings: &Settings) -> Vpls {
    let picked = settings.picks > 0 || settings.compensates();
    if picked || settings.sorted { ordered(graph, vpls, picked) } else { vpls }
}

/// The same virtual lights, sorted; with a tree over them if `picked`.
fn ordered(graph: &mut Graph, vpls: Vpls, picked: bool) -> Vpls {
    let total = vpls.count;
    debug_assert!(total <= VPL_TREE_MOST);
    let leaves = total.max(1).next_power_of_two();
    let keys = [(); 2].map(|()| graph.buffer("igi.light-tree-keys", 8 * u64::from(total.max(1))));
    graph.compute(light_tree_keys::Args { vpls: vpls.buffer, keys: keys[0], push: light_tree_keys::Push { total } }, 1);
    // An even number of turns, back into the first.
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

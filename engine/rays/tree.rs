//! Trees as the shaders read them (`lib/trace_compute.glsl`).

use crate::{
    scene::Aabb,
    shaders::consts::{TRACE_COUNT_SHIFT, TRACE_FIRST_MASK, TRACE_LEAF},
};
use glam::Vec3;
use obvhs::{Boundable, BvhBuildParams, bvh2::Bvh2, bvh2::builder::build_bvh2};
use std::time::Duration;

/// Most things in a leaf.
pub const LEAF: u32 = 4;
/// Nodes on the way from a bottom tree's root to a leaf, at most.
pub const DEPTH: u32 = 40;

/// Two boxes and what they hold: a child is a reference (`TRACE_LEAF` …).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    pub boxes: [Aabb; 2],
    pub children: [u32; 2],
}

/// A tree over things with boxes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tree {
    /// Children stand after their parents.
    pub nodes: Vec<Node>,
    /// What stands at each place of the leaves: indices of the things given.
    pub order: Vec<u32>,
    /// Reference to the root; counts in `nodes` and `order`.
    pub root: u32,
    /// Nodes on the longest way to a leaf.
    pub depth: u32,
}

/// A box that nothing hits.
pub const NOTHING: Aabb = Aabb { min: Vec3::splat(3e37), max: Vec3::splat(-3e37) };

struct Boxed(Aabb);

impl Boundable for Boxed {
    fn aabb(&self) -> obvhs::aabb::Aabb {
        obvhs::aabb::Aabb::new(self.0.min.into(), self.0.max.into())
    }
}

fn leaf(first: u32, count: u32) -> u32 {
    TRACE_LEAF | (count - 1) << TRACE_COUNT_SHIFT | (first & TRACE_FIRST_MASK)
}

impl Tree {
    /// A tree for many rays over `boxes`, which are finite; leaves of up to [`LEAF`].
    pub fn build(boxes: &[Aabb]) -> Self {
        if boxes.len() <= LEAF as usize {
            return Self::halved(boxes, LEAF);
        }
        let boxed: Vec<Boxed> = boxes.iter().map(|b| Boxed(*b)).collect();
        let params = BvhBuildParams { max_prims_per_leaf: LEAF, ..BvhBuildParams::medium_build() };
        let tree = build_bvh2(&boxed, params, &mut Duration::default());
        match Self::from_bvh2(&tree) {
            Some(tree) if tree.depth <= DEPTH => tree,
            // Equal boxes can make it as deep as they are many.
            _ => Self::halved(boxes, LEAF),
        }
    }

    /// A tree whose nodes halve the list along the longest side, so that it has ⌈log₂ n⌉ levels whatever the boxes are.
    pub fn halved(boxes: &[Aabb], leaf_size: u32) -> Self {
        let mut tree = Self { order: (0..boxes.len() as u32).collect(), ..Self::default() };
        if boxes.is_empty() {
            tree.nodes.push(Node { boxes: [NOTHING; 2], children: [leaf(0, 1); 2] });
            tree.depth = 1;
            return tree;
        }
        let mut order = std::mem::take(&mut tree.order);
        let count = order.len();
        tree.root = tree.halve(boxes, &mut order, 0, count, leaf_size, 0);
        tree.order = order;
        tree
    }

    fn halve(
        &mut self,
        boxes: &[Aabb],
        order: &mut [u32],
        first: usize,
        count: usize,
        leaf_size: u32,
        depth: u32,
    ) -> u32 {
        if count <= leaf_size as usize {
            self.depth = self.depth.max(depth);
            return leaf(first as u32, count as u32);
        }
        let centre = |i: u32| (boxes[i as usize].min + boxes[i as usize].max) * 0.5;
        let part = &mut order[first..first + count];
        let spread = Aabb::of(part.iter().map(|i| centre(*i)));
        let size = spread.max - spread.min;
        let axis = if size.x >= size.y && size.x >= size.z { 0 } else { 1 + usize::from(size.z > size.y) };
        part.sort_by(|a, b| centre(*a)[axis].total_cmp(&centre(*b)[axis]).then(a.cmp(b)));
        let half = count / 2;
        let around = |list: &[u32]| list.iter().map(|i| boxes[*i as usize]).fold(Aabb::EMPTY, Aabb::union);
        let pair = [around(&part[..half]), around(&part[half..])];
        let index = self.nodes.len();
        self.nodes.push(Node { boxes: pair, children: [0; 2] });
        let left = self.halve(boxes, order, first, half, leaf_size, depth + 1);
        let right = self.halve(boxes, order, first + half, count - half, leaf_size, depth + 1);
        self.nodes[index].children = [left, right];
        index as u32
    }

    /// `None` for a tree that is not one.
    fn from_bvh2(tree: &Bvh2) -> Option<Self> {
        let mut out = Self { order: tree.primitive_indices.clone(), ..Self::default() };
        let aabb = |i: u32| {
            let aabb = tree.nodes[i as usize].aabb();
            Aabb { min: aabb.min.into(), max: aabb.max.into() }
        };
        let refer = |i: u32| {
            let node = &tree.nodes[i as usize];
            node.is_leaf().then(|| leaf(node.first_index, node.prim_count))
        };
        if let Some(root) = refer(0) {
            out.root = root;
            return Some(out);
        }
        // Nodes of the other tree whose place here is known, with their depth.
        let mut todo = vec![(0u32, 0usize, 1u32)];
        out.nodes.push(Node { boxes: [NOTHING; 2], children: [0; 2] });
        while let Some((from, to, depth)) = todo.pop() {
            out.depth = out.depth.max(depth);
            let first = tree.nodes[from as usize].first_index;
            for (slot, child) in [first, first + 1].into_iter().enumerate() {
                out.nodes[to].boxes[slot] = aabb(child);
                out.nodes[to].children[slot] = refer(child).unwrap_or(out.nodes.len() as u32);
                if refer(child).is_none() {
                    todo.push((child, out.nodes.len(), depth + 1));
                    out.nodes.push(Node { boxes: [NOTHING; 2], children: [0; 2] });
                }
                if out.nodes.len() > tree.nodes.len() {
                    return None;
                }
            }
        }
        Some(out)
    }

    /// The four vectors of each node, with references that count from `first_node` and `first_record`.
    pub fn encode(&self, first_node: u32, first_record: u32) -> Vec<[f32; 4]> {
        let mut out = Vec::with_capacity(4 * self.nodes.len());
        for node in &self.nodes {
            for (aabb, child) in node.boxes.iter().zip(node.children) {
                let child = self.refer(child, first_node, first_record);
                out.push(aabb.min.extend(f32::from_bits(child)).to_array());
                out.push(aabb.max.extend(0.0).to_array());
            }
        }
        out
    }

    /// `child` with other places counted.
    pub fn refer(&self, child: u32, first_node: u32, first_record: u32) -> u32 {
        if child & TRACE_LEAF != 0 { child + first_record } else { child + first_node }
    }
}

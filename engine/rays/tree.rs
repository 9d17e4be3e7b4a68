//! Trees with eight children per node, built on the CPU.
//!
//! obvhs (PLOC with reinsertion) builds a binary tree; [`binned`] builds it for inputs on which PLOC would not end. The binary tree is
//! collapsed to eight children per node as in Ylitie, Karras and Laine, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide
//! BVHs", HPG 2017, section 3.2, with one item per leaf.

use crate::scene::{Aabb, bvh::binned};
use glam::Vec3;
use obvhs::{
    Boundable, BvhBuildParams, bvh2::Bvh2, bvh2::reinsertion::ReinsertionOptimizer, ploc::PlocBuilder,
    splits::split_aabbs_preset, triangle::Triangle,
};

/// Maximum of levels of a tree, limited by the shaders' stack; see [`Tree::build`].
pub const DEPTH: u32 = 22;
/// Levels of a tree by [`Tree::eighths`] over the maximum of items, ⌈log₈ 2²⁴⌉.
pub const EIGHTHS_DEPTH: u32 = 8;

/// The content of a slot of a node.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Child {
    #[default]
    Empty,
    /// Index into [`Tree::order`].
    Leaf(u32),
    Node(u32),
}

/// Eight boxes and their contents. The number of a slot follows the octant of its box as seen from the node's middle, as far as slots
/// are free: bit 0 is set on the side of larger x, bit 1 of larger y, bit 2 of larger z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    pub boxes: [Aabb; 8],
    pub children: [Child; 8],
}

impl Node {
    const EMPTY: Self = Self { boxes: [Aabb::EMPTY; 8], children: [Child::Empty; 8] };
}

/// A tree over items with boxes. Nodes are stored level by level, from the root (node 0) down. The child nodes of a node are consecutive, in
/// the order of its slots, and so are the indices of its leaves.
#[derive(Clone, Debug, PartialEq)]
pub struct Tree {
    pub nodes: Vec<Node>,
    /// First node of each level, and the number of nodes.
    pub levels: Vec<u32>,
    /// The item of each leaf.
    pub order: Vec<u32>,
}

struct Boxed(Aabb);

impl Boundable for Boxed {
    fn aabb(&self) -> obvhs::aabb::Aabb {
        obvhs::aabb::Aabb::new(self.0.min.into(), self.0.max.into())
    }
}

impl Tree {
    /// Builds a tree of high quality over `boxes`, which must be finite and not empty. It has at most [`DEPTH`] levels. If `triangles` are
    /// given, a large triangle is in several leaves, each with the box of a part.
    pub fn build(boxes: &[Aabb], triangles: &[[Vec3; 3]]) -> Self {
        if boxes.len() <= 8 {
            return Self::eighths(boxes);
        }
        let boxed: Vec<Boxed> = boxes.iter().map(|b| Boxed(*b)).collect();
        let p = BvhBuildParams::medium_build();
        let mut aabbs: Vec<obvhs::aabb::Aabb> = boxed.iter().map(Boundable::aabb).collect();
        let mut indices: Vec<u32> = (0..boxed.len() as u32).collect();
        if triangles.len() == boxed.len() {
            let [mut sum, mut largest] = [0.0f32; 2];
            for area in aabbs.iter().map(obvhs::aabb::Aabb::half_area) {
                (sum, largest) = (sum + area, largest.max(area));
            }
            let corners: Vec<Triangle> =
                triangles.iter().map(|t| Triangle { v0: t[0].into(), v1: t[1].into(), v2: t[2].into() }).collect();
            split_aabbs_preset(&mut aabbs, &mut indices, &corners, sum / boxed.len() as f32, largest);
        }
        let binary = if binned::clusters(&aabbs) {
            let mut clustered = PlocBuilder::with_capacity(aabbs.len()).build(
                p.ploc_search_distance,
                &aabbs,
                indices,
                p.sort_precision,
                p.search_depth_threshold,
            );
            ReinsertionOptimizer::default().run(&mut clustered, p.reinsertion_batch_ratio, None);
            clustered
        } else {
            let mut cut = binned::build(&aabbs, 1);
            cut.primitive_indices.iter_mut().for_each(|i| *i = indices[*i as usize]);
            cut
        };
        // With many equal boxes the binary tree may be too deep.
        collapse(&binary).filter(|t| t.levels.len() as u32 <= DEPTH + 1).unwrap_or_else(|| Self::eighths(boxes))
    }

    /// Builds a balanced tree: each node divides its list into eighths along the longest sides. It has ⌈log₈ n⌉ levels for any boxes.
    pub fn eighths(boxes: &[Aabb]) -> Self {
        Self::by_levels(Part::new(boxes, (0..boxes.len() as u32).collect()), |part| part.eighths(boxes))
    }

    /// Stores the tree that `split` makes from `root`, level by level.
    fn by_levels<T: Split>(root: T, split: impl Fn(&T) -> Vec<T>) -> Self {
        let mut tree = Self { nodes: Vec::new(), levels: vec![0], order: Vec::new() };
        let mut level = vec![root];
        while !level.is_empty() {
            let first_below = (tree.nodes.len() + level.len()) as u32;
            let mut below = Vec::new();
            for item in &level {
                let children = split(item);
                let boxes: Vec<Aabb> = children.iter().map(Split::bounds).collect();
                let mut node = Node::EMPTY;
                let slots = slots(&boxes);
                let mut by_slot: Vec<(usize, T)> = slots.into_iter().zip(children).collect();
                by_slot.sort_by_key(|(slot, _)| *slot);
                for (slot, child) in by_slot {
                    node.boxes[slot] = child.bounds();
                    node.children[slot] = match child.leaf() {
                        Some(thing) => {
                            tree.order.push(thing);
                            Child::Leaf(tree.order.len() as u32 - 1)
                        }
                        None => {
                            below.push(child);
                            Child::Node(first_below + below.len() as u32 - 1)
                        }
                    };
                }
                tree.nodes.push(node);
            }
            tree.levels.push(tree.nodes.len() as u32);
            level = below;
        }
        tree
    }
}

/// A subtree that is not stored yet.
trait Split {
    fn bounds(&self) -> Aabb;
    /// The only item of the subtree, if it becomes a leaf.
    fn leaf(&self) -> Option<u32>;
}

/// Assigns up to eight boxes to slots by their octants, with a greedy algorithm (Ylitie et al., section 3.3).
fn slots(boxes: &[Aabb]) -> Vec<usize> {
    let all = boxes.iter().copied().fold(Aabb::EMPTY, Aabb::union);
    let middle = all.centre();
    let gain = |b: &Aabb, slot: usize| {
        let sign = |bit: usize| if slot >> bit & 1 == 1 { 1.0 } else { -1.0 };
        (b.centre() - middle).dot(Vec3::new(sign(0), sign(1), sign(2)))
    };
    let mut slots = vec![usize::MAX; boxes.len()];
    let mut free = [true; 8];
    for _ in 0..boxes.len().min(8) {
        let mut best = (f32::NEG_INFINITY, 0, 0);
        for (i, b) in boxes.iter().enumerate().filter(|(i, _)| slots[*i] == usize::MAX) {
            for slot in (0..8).filter(|s| free[*s]) {
                let gain = gain(b, slot);
                // If no gain is comparable (NaN), this takes the first free slot.
                if gain > best.0 || best.0 == f32::NEG_INFINITY {
                    best = (gain, i, slot);
                }
            }
        }
        slots[best.1] = best.2;
        free[best.2] = false;
    }
    slots
}

/// Items of a subtree of a balanced tree.
struct Part {
    order: Vec<u32>,
    bounds: Aabb,
}

impl Split for Part {
    fn bounds(&self) -> Aabb {
        self.bounds
    }

    fn leaf(&self) -> Option<u32> {
        (self.order.len() == 1).then(|| self.order[0])
    }
}

impl Part {
    fn new(boxes: &[Aabb], order: Vec<u32>) -> Self {
        let bounds = order.iter().map(|i| boxes[*i as usize]).fold(Aabb::EMPTY, Aabb::union);
        Self { order, bounds }
    }

    fn eighths(&self, boxes: &[Aabb]) -> Vec<Self> {
        let mut parts = vec![self.order.clone()];
        for _ in 0..3 {
            let halves = parts.into_iter().flat_map(|part| halve(part, boxes));
            parts = halves.filter(|half| !half.is_empty()).collect();
        }
        parts.into_iter().map(|order| Self::new(boxes, order)).collect()
    }
}

fn halve(mut part: Vec<u32>, boxes: &[Aabb]) -> [Vec<u32>; 2] {
    let centre = |i: &u32| (boxes[*i as usize].min + boxes[*i as usize].max) * 0.5;
    let spread = Aabb::of(part.iter().map(centre));
    let size = spread.max - spread.min;
    let axis = if size.x >= size.y && size.x >= size.z { 0 } else { 1 + usize::from(size.z > size.y) };
    let half = part.len().div_ceil(2);
    if half < part.len() {
        part.select_nth_unstable_by(half, |a, b| centre(a)[axis].total_cmp(&centre(b)[axis]).then(a.cmp(b)));
    }
    let rest = part.split_off(half);
    [part, rest]
}

/// A node of the binary tree.
struct Binary<'a> {
    tree: &'a Bvh2,
    node: u32,
}

impl Split for Binary<'_> {
    fn bounds(&self) -> Aabb {
        bounds(self.tree, self.node)
    }

    fn leaf(&self) -> Option<u32> {
        let node = &self.tree.nodes[self.node as usize];
        node.is_leaf().then(|| self.tree.primitive_indices[node.first_index as usize])
    }
}

fn bounds(tree: &Bvh2, node: u32) -> Aabb {
    let aabb = tree.nodes[node as usize].aabb();
    Aabb { min: aabb.min.into(), max: aabb.max.into() }
}

/// The optimal representation of a subtree as at most i + 1 children of one node, for each i.
#[derive(Clone, Copy, Default)]
struct Plan {
    /// Expected cost, relative to the cost of a node test.
    cost: [f32; 7],
    /// Number of slots for the left child; 0: the subtree stays one node.
    left: [u8; 7],
    /// The same if the subtree is a node.
    own: u8,
}

/// Cost of a triangle test, relative to a node test.
const TRIANGLE_COST: f32 = 0.5;

/// Collapses a binary tree to eight children per node. `None` if a leaf has not exactly one item.
fn collapse(tree: &Bvh2) -> Option<Tree> {
    // Sorts parents before children, because the nodes may be in any order.
    let mut order = vec![0u32];
    let mut at = 0;
    while let Some(&node) = order.get(at) {
        at += 1;
        let n = tree.nodes.get(node as usize)?;
        if !n.is_leaf() {
            order.extend([n.first_index, n.first_index + 1]);
        } else if n.prim_count != 1 {
            return None;
        }
        if order.len() > tree.nodes.len() {
            return None;
        }
    }
    let mut plans = vec![Plan::default(); tree.nodes.len()];
    for &node in order.iter().rev() {
        let n = &tree.nodes[node as usize];
        let size = bounds(tree, node);
        let d = size.max - size.min;
        let area = d.x * d.y + d.y * d.z + d.z * d.x;
        let mut plan = Plan::default();
        if n.is_leaf() {
            plan.cost = [area * TRIANGLE_COST; 7];
        } else {
            let (left, right) = (plans[n.first_index as usize], plans[n.first_index as usize + 1]);
            // The best division of `slots` slots between the two children.
            let best = |slots: usize| {
                let ways = (1..slots).filter(|k| *k <= 7 && slots - k <= 7);
                let cost = |k: usize| left.cost[k - 1] + right.cost[slots - k - 1];
                ways.map(|k| (cost(k), k as u8)).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f32::INFINITY, 1))
            };
            let (inside, own) = best(8);
            plan.own = own;
            plan.cost[0] = inside + area;
            for i in 1..7 {
                let (cost, k) = best(i + 1);
                (plan.cost[i], plan.left[i]) =
                    if cost < plan.cost[i - 1] { (cost, k) } else { (plan.cost[i - 1], plan.left[i - 1]) };
                // Fewer slots may have a lower cost; KEEP marks this case.
                if cost >= plan.cost[i - 1] {
                    plan.left[i] |= KEEP;
                }
            }
        }
        plans[node as usize] = plan;
    }
    Some(Tree::by_levels(Binary { tree, node: 0 }, |item| {
        let mut out = Vec::new();
        let n = &tree.nodes[item.node as usize];
        if n.is_leaf() {
            out.push(item.node);
        } else {
            let left = usize::from(plans[item.node as usize].own);
            open(tree, &plans, n.first_index, left, &mut out);
            open(tree, &plans, n.first_index + 1, 8 - left, &mut out);
        }
        out.into_iter().map(|node| Binary { tree, node }).collect()
    }))
}

/// In [`Plan::left`]: the solution is the same as with one slot less.
const KEEP: u8 = 0x80;

/// Appends the children into which `node` is opened with `slots` slots.
fn open(tree: &Bvh2, plans: &[Plan], node: u32, mut slots: usize, out: &mut Vec<u32>) {
    let n = &tree.nodes[node as usize];
    let plan = &plans[node as usize];
    while slots > 1 && plan.left[slots - 1] & KEEP != 0 {
        slots -= 1;
    }
    if n.is_leaf() || slots == 1 {
        out.push(node);
    } else {
        let left = usize::from(plan.left[slots - 1]);
        open(tree, plans, n.first_index, left, out);
        open(tree, plans, n.first_index + 1, slots - left, out);
    }
}

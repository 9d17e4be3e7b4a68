//! A builder for what clustering is too slow for.
//!
//! PLOC (Meister and Bittner, "Parallel Locally-Ordered Clustering for Bounding Volume Hierarchy Construction", TVCG 2018) merges pairs
//! that are each other's nearest neighbours along a space-filling curve. Where boxes lie in each other (a fan of one large polygon) or are
//! equal, each one's nearest neighbour has a nearer one, one pair is merged a round, and the time goes with the square of their number.
//! Such boxes get a tree from the top down, by the surface area heuristic over bins (Wald, "On fast Construction of SAH-based Bounding
//! Volume Hierarchies", RT 2007), with a bound on how uneven a cut may be: n log n whatever they are.

use glam::Vec3A;
use obvhs::{
    aabb::Aabb,
    bvh2::{Bvh2, node::Bvh2Node},
    ploc::morton::morton_encode_u64_unorm,
};

/// Whatever so many are, their tree is not deep.
const FEW: usize = 64;
/// Neighbours on each side that PLOC looks at, as the crate is asked to: in the first rounds, and then.
const NEAR: [usize; 2] = [1, 14];
const FIRST: usize = 3;
/// Rounds that clustering may take. A surface of a million triangles takes about forty. The crate has room for trees of 96 levels, a round
/// makes one, and improving the tree a tenth more; it does not survive more in debug builds.
const ROUNDS: usize = 80;
/// Looks at a box that clustering may take, for each box. Surfaces take three.
const LOOKS: usize = 32;
const BINS: usize = 16;
/// The smaller part of a cut has at least one of so many.
const UNEVEN: usize = 8;

/// Whether PLOC gets on with `boxes`, found by doing the like.
pub(crate) fn clusters(boxes: &[Aabb]) -> bool {
    let all = union(boxes);
    let scale = 1.0 / all.diagonal().as_dvec3();
    let code = |b: &Aabb| morton_encode_u64_unorm((b.center() - all.min).as_dvec3() * scale);
    let mut order: Vec<(u64, u32)> = boxes.iter().zip(0..).map(|(b, i)| (code(b), i)).collect();
    order.sort_unstable();
    let mut list: Vec<Aabb> = order.iter().map(|(_, i)| boxes[*i as usize]).collect();
    let (mut rounds, mut looks) = (0, 0);
    let mut nearest = Vec::new();
    while list.len() > FEW {
        let count = list.len();
        (rounds, looks) = (rounds + 1, looks + count);
        if rounds > ROUNDS || looks > LOOKS * boxes.len() {
            return false;
        }
        let near = NEAR[usize::from(rounds > FIRST)];
        nearest.clear();
        nearest.extend((0..count).map(|i| (f32::INFINITY, i)));
        for i in 0..count {
            for other in i + 1..(i + near + 1).min(count) {
                let cost = list[i].union(&list[other]).half_area();
                // As PLOC: of equals the last.
                for (one, two) in [(i, other), (other, i)] {
                    if cost <= nearest[one].0 {
                        nearest[one] = (cost, two);
                    }
                }
            }
        }
        let mut next = Vec::with_capacity(count);
        for (i, &(_, other)) in nearest.iter().enumerate() {
            if nearest[other].1 != i {
                next.push(list[i]);
            } else if i <= other {
                next.push(list[i].union(&list[other]));
            }
        }
        list = next;
    }
    true
}

/// A tree over `boxes` with at most `most` of them in a leaf.
pub(crate) fn build(boxes: &[Aabb], most: usize) -> Bvh2 {
    let centres: Vec<Vec3A> = boxes.iter().map(Aabb::center).collect();
    let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
    let mut nodes = vec![Bvh2Node::default()];
    let mut left = vec![(0, 0..boxes.len(), 1)];
    let mut deepest = 1;
    while let Some((node, range, depth)) = left.pop() {
        deepest = deepest.max(depth);
        let part = &mut order[range.clone()];
        let bounds = part.iter().fold(Aabb::empty(), |all, i| all.union(&boxes[*i as usize]));
        if part.len() <= most.max(1) {
            nodes[node] = Bvh2Node::new(bounds, part.len() as u32, range.start as u32);
            continue;
        }
        let middle = range.start + cut(part, boxes, &centres);
        let first = nodes.len();
        nodes.extend([Bvh2Node::default(); 2]);
        nodes[node] = Bvh2Node::new(bounds, 0, first as u32);
        left.extend([(first + 1, middle..range.end, depth + 1), (first, range.start..middle, depth + 1)]);
    }
    let bare = Bvh2::default();
    let max_depth = bare.max_depth.max(deepest);
    Bvh2 { nodes, primitive_indices: order, children_are_ordered_after_parents: true, max_depth, ..bare }
}

/// Orders `part`, of two or more, into two and returns the number of the first.
fn cut(part: &mut [u32], boxes: &[Aabb], centres: &[Vec3A]) -> usize {
    let centre = |i: u32| centres[i as usize];
    let (low, high) = part
        .iter()
        .fold((Vec3A::INFINITY, Vec3A::NEG_INFINITY), |(low, high), i| (low.min(centre(*i)), high.max(centre(*i))));
    let size = high - low;
    let longest = if size.x >= size.y && size.x >= size.z { 0 } else { 1 + usize::from(size.z > size.y) };
    let bin = |i: u32, axis: usize| (((centre(i) - low)[axis] / size[axis] * BINS as f32) as usize).min(BINS - 1);
    let mut best: Option<(f32, usize, usize)> = None;
    for axis in (0..3).filter(|axis| size[*axis] > 0.0) {
        let mut bins = [(0usize, Aabb::empty()); BINS];
        for &i in part.iter() {
            let (count, bounds) = &mut bins[bin(i, axis)];
            (*count, *bounds) = (*count + 1, bounds.union(&boxes[i as usize]));
        }
        // Cost of the bins from each one on.
        let mut behind = [0.0; BINS];
        let (mut count, mut bounds) = (0, Aabb::empty());
        for k in (1..BINS).rev() {
            (count, bounds) = (count + bins[k].0, bounds.union(&bins[k].1));
            behind[k] = count as f32 * bounds.half_area();
        }
        let (mut count, mut bounds) = (0, Aabb::empty());
        for k in 1..BINS {
            (count, bounds) = (count + bins[k - 1].0, bounds.union(&bins[k - 1].1));
            let cost = count as f32 * bounds.half_area() + behind[k];
            let even = count.min(part.len() - count) * UNEVEN >= part.len();
            if even && best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, axis, k));
            }
        }
    }
    match best {
        Some((_, axis, k)) => {
            let (mut first, second): (Vec<u32>, Vec<u32>) = part.iter().copied().partition(|i| bin(*i, axis) < k);
            let middle = first.len();
            first.extend(second);
            part.copy_from_slice(&first);
            middle
        }
        None => {
            let middle = part.len() / 2;
            let along = |i: &u32| centre(*i)[longest];
            part.select_nth_unstable_by(middle, |a, b| along(a).total_cmp(&along(b)).then(a.cmp(b)));
            middle
        }
    }
}

fn union(boxes: &[Aabb]) -> Aabb {
    boxes.iter().fold(Aabb::empty(), |all, b| all.union(b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::bvh::{Bvh, Ray};
    use glam::{Vec3, vec3};

    /// A disc of radius 1 about the origin, facing +z.
    fn fan(count: usize) -> Vec<[Vec3; 3]> {
        let at = |i: usize| {
            let angle = std::f32::consts::TAU * i as f32 / count as f32;
            vec3(angle.cos(), angle.sin(), 0.0)
        };
        (2..count).map(|i| [at(0), at(i - 1), at(i)]).collect()
    }

    /// Triangles about one centre, the largest last.
    fn nested(count: usize) -> Vec<[Vec3; 3]> {
        let corner = |size: f32, angle: f32| vec3(angle.cos(), angle.sin(), 0.1) * size;
        (1..=count).map(|i| [0.0, 2.1, 4.2].map(|angle| corner(i as f32 / count as f32, angle))).collect()
    }

    fn grid(side: usize) -> Vec<[Vec3; 3]> {
        let cell = |i: usize| vec3((i % side) as f32, (i / side) as f32, 0.0);
        (0..side * side).map(|i| [cell(i), cell(i) + Vec3::X, cell(i) + Vec3::Y]).collect()
    }

    fn boxes(triangles: &[[Vec3; 3]]) -> Vec<Aabb> {
        triangles.iter().map(|[a, b, c]| Aabb::new(a.min(*b).min(*c).into(), a.max(*b).max(*c).into())).collect()
    }

    #[test]
    fn what_clusters_is_told_from_what_does_not() {
        assert!(clusters(&boxes(&grid(100))));
        assert!(clusters(&boxes(&fan(FEW + 2))));
        for hard in [fan(2_000), fan(20_000), nested(20_000), vec![[Vec3::ZERO, Vec3::X, Vec3::Y]; 20_000]] {
            assert!(!clusters(&boxes(&hard)));
            // Beside much else, too.
            assert!(!clusters(&boxes(&[grid(200), hard].concat())));
        }
    }

    #[test]
    fn what_does_not_cluster_takes_no_square_of_its_number() {
        for hard in [fan(200_000), nested(200_000), vec![[Vec3::ZERO, Vec3::X, Vec3::Y]; 200_000]] {
            let begun = std::time::Instant::now();
            let bvh = Bvh::from_triangles(hard);
            let seconds = begun.elapsed().as_secs_f64();
            // By clustering it takes minutes.
            assert!(seconds < 10.0, "{seconds} s");
            assert_eq!(bvh.validate(), Ok(()));
            assert!(bvh.tree().max_depth < 200);
        }
    }

    #[test]
    fn its_trees_find_what_is_there() {
        for triangles in [fan(5000), nested(5000), [grid(60), nested(3000)].concat()] {
            assert!(!clusters(&boxes(&triangles)));
            let bvh = Bvh::from_triangles(triangles.clone());
            assert_eq!(bvh.validate(), Ok(()));
            for i in 0..60 {
                let (x, y) = ((i % 10) as f32 * 0.23 - 1.1, (i / 10) as f32 * 0.37 - 1.0);
                let ray = Ray::new(vec3(x, y, 2.0), Vec3::NEG_Z);
                let alone = |t: &[Vec3; 3]| Bvh::from_triangles(vec![*t]).closest(&ray).map(|hit| hit.t);
                let nearest = triangles.iter().filter_map(alone).min_by(f32::total_cmp);
                assert_eq!(bvh.closest(&ray).map(|hit| hit.t), nearest, "at {x} {y}");
            }
        }
    }
}

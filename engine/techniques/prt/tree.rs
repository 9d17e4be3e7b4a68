//! A tree over the samples of each cluster, from whose nodes a picture takes the splats that it needs: those that are far away stand for several
//! samples of a plane.

use glam::Vec3;

use super::samples::position;
use crate::{
    scene::{View, cull::Aabb, cull::Frustum},
    shaders::{
        consts,
        types::{PrtPoint, PrtSplat},
    },
};

/// Largest distance of a node's samples from its plane, in distances of its splats: there a splat has lost a fifth of its weight.
const FLAT: f32 = 0.05;
/// Least cosine of the angle between a node's normal and those of its samples.
const EVEN: f32 = 0.9;
/// Largest distance of a node's samples from its middle, in distances of its splats; half the diagonal of a square is 0.7.
const COMPACT: f32 = 1.4;

/// Trees of all clusters.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tree {
    /// One for each node.
    pub splats: Vec<PrtSplat>,
    /// Numbers of samples; those of a node are side by side.
    pub members: Vec<u32>,
    nodes: Vec<Node>,
    roots: Vec<u32>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Node {
    /// A sphere around the samples of the node that lies in that of its parent.
    middle: Vec3,
    bound: f32,
    /// Size of its splat, metres.
    spacing: f32,
    /// One splat may stand for all its samples.
    merges: bool,
    /// Numbers of two nodes; `None`: one sample.
    parts: Option<[u32; 2]>,
}

impl Tree {
    /// Trees over the samples of clusters with these numbers of samples. `radius`: least distance of two samples on a plane, metres.
    pub fn new(samples: &[PrtPoint], clusters: &[u32], radius: f32) -> Self {
        let mut tree = Self::default();
        let mut first = 0;
        for count in clusters {
            let mut members: Vec<u32> = (first..first + count).collect();
            if !members.is_empty() {
                let root = tree.grow(samples, &mut members, radius);
                tree.roots.push(root);
            }
            first += count;
        }
        tree
    }

    /// Adds a node over samples, and returns its number.
    fn grow(&mut self, samples: &[PrtPoint], members: &mut [u32], radius: f32) -> u32 {
        let first = self.members.len() as u32;
        let (node, splat) = if let [member] = members {
            self.members.push(*member);
            leaf(&samples[*member as usize], first, radius)
        } else {
            let middle = split(samples, members);
            let (left, right) = members.split_at_mut(middle);
            let parts = [self.grow(samples, left, radius), self.grow(samples, right, radius)];
            self.join(samples, parts, first)
        };
        self.nodes.push(node);
        self.splats.push(splat);
        self.nodes.len() as u32 - 1
    }

    fn join(&self, samples: &[PrtPoint], parts: [u32; 2], first: u32) -> (Node, PrtSplat) {
        let [a, b] = parts.map(|part| self.nodes[part as usize]);
        let [of_a, of_b] = parts.map(|part| self.splats[part as usize]);
        let count = of_a.count + of_b.count;
        let members = || self.members[first as usize..].iter().map(|member| &samples[*member as usize]);
        let place = members().map(position).sum::<Vec3>() / count as f32;
        let normal = members().map(|s| Vec3::from(s.normal)).sum::<Vec3>().normalize_or(of_a.normal.into());
        let spacing = of_a.spacing.hypot(of_b.spacing);
        let fits = |s: &PrtPoint| {
            let way = position(s) - place;
            let off = way.dot(normal).abs();
            off <= FLAT * spacing && way.length() <= COMPACT * spacing && normal.dot(s.normal.into()) >= EVEN
        };
        let merges = a.merges && b.merges && members().all(fits);
        let (middle, bound) = around([(a.middle, a.bound), (b.middle, b.bound)]);
        let splat = PrtSplat { position: place.to_array(), spacing, normal: normal.to_array(), first, count };
        (Node { middle, bound, spacing, merges, parts: Some(parts) }, splat)
    }

    /// Appends the splats that a picture needs: nodes that the view sees, whose splats are nearer to each other than `least` pixels but for
    /// those of single samples. `end`: distance at which a splat ends, in distances of splats.
    pub fn cut(&self, view: &View, least: f32, end: f32) -> Vec<u32> {
        let frustum = Frustum::new(view);
        let pixel = view.uniform().pixel_angle;
        let [_, _, forward] = view.axes();
        let mut found = Vec::new();
        let mut open: Vec<u32> = self.roots.iter().rev().copied().collect();
        while let Some(number) = open.pop() {
            let (node, splat) = (&self.nodes[number as usize], &self.splats[number as usize]);
            if !frustum.sees(&Aabb::of([node.middle]).grown(node.bound + end * node.spacing)) {
                continue;
            }
            let away = view.position.distance(node.middle) - node.bound;
            let metres = if view.is_orthographic() { pixel } else { pixel * away.max(view.near) };
            match node.parts {
                Some([left, right]) if !node.merges || splat.spacing >= least * metres => open.extend([right, left]),
                _ => {
                    let back = if view.is_orthographic() {
                        -forward
                    } else {
                        (view.position - Vec3::from(splat.position)).normalize_or_zero()
                    };
                    // Shading normals of visible surfaces may look away a little.
                    if back.dot(splat.normal.into()) > -0.3 {
                        found.push(number);
                    }
                }
            }
        }
        found
    }
}

/// A node of one sample.
fn leaf(sample: &PrtPoint, first: u32, radius: f32) -> (Node, PrtSplat) {
    // Not by the sample's own area: samples that stand for more than others would spread farther than the surface does that they lie on.
    let splat = PrtSplat { position: sample.position, spacing: radius, normal: sample.normal, first, count: 1 };
    (Node { middle: position(sample), bound: 0.0, spacing: radius, merges: true, parts: None }, splat)
}

/// Sorts samples into two parts and returns the number of those in the first one: along the axis in which they differ most, of positions and
/// normals. Neither part is much smaller than the other.
fn split(samples: &[PrtPoint], members: &mut [u32]) -> usize {
    let (mut low, mut high) = (Vec3::MAX, Vec3::MIN);
    for member in members.iter() {
        (low, high) = (low.min(position(&samples[*member as usize])), high.max(position(&samples[*member as usize])));
    }
    let size = (high - low).max_element();
    // Normals count more than places, so that the samples of one plane stay together.
    let of = |member: u32, axis: usize| match axis {
        0..3 => samples[member as usize].position[axis],
        _ => 2.0 * size * samples[member as usize].normal[axis - 3],
    };
    let extent = |axis: usize| {
        let values = members.iter().map(|member| of(*member, axis));
        let (low, high) = values.fold((f32::MAX, f32::MIN), |(low, high), value| (low.min(value), high.max(value)));
        (high - low, 0.5 * (low + high))
    };
    let widest = (0..6).map(|axis| (axis, extent(axis))).max_by(|a, b| a.1.0.total_cmp(&b.1.0));
    let Some((axis, (_, half))) = widest else { return members.len() / 2 };
    members.sort_by(|a, b| of(*a, axis).total_cmp(&of(*b, axis)));
    let middle = members.partition_point(|member| of(*member, axis) < half);
    let least = (members.len() / 8).max(1);
    if middle < least || members.len() - middle < least { members.len() / 2 } else { middle }
}

/// The smallest sphere around two spheres.
fn around([(a, of_a), (b, of_b)]: [(Vec3, f32); 2]) -> (Vec3, f32) {
    let apart = a.distance(b);
    if apart + of_b <= of_a {
        return (a, of_a);
    }
    if apart + of_a <= of_b {
        return (b, of_b);
    }
    let radius = 0.5 * (apart + of_a + of_b);
    (a + (b - a) * ((radius - of_a) / apart), radius)
}

/// Distance at which a splat ends, in distances of splats.
pub fn end(splat: f32) -> f32 {
    consts::PRT_SPLAT_END * splat
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Camera, Projection};
    use glam::Mat4;

    /// Samples on the floor and on a wall beside it.
    fn corner(side: u32) -> Vec<PrtPoint> {
        let step = 1.0 / side as f32;
        let floor = (0..side * side).map(|i| ([i % side, i / side].map(|n| (n as f32 + 0.5) * step), true));
        let wall = floor.clone().map(|(at, _)| (at, false));
        floor
            .chain(wall)
            .map(|([x, y], floor)| {
                let (at, normal) =
                    if floor { (Vec3::new(x, 0.0, y), Vec3::Y) } else { (Vec3::new(x, y, 0.0), Vec3::Z) };
                PrtPoint {
                    position: at.to_array(),
                    side: normal.to_array(),
                    normal: normal.to_array(),
                    area: step * step,
                    ..PrtPoint::default()
                }
            })
            .collect()
    }

    fn seen(from: Vec3) -> View {
        let projection = Projection::Perspective { yfov: 0.8, aspect: None, znear: 0.01, zfar: Some(1000.0) };
        let back = (from - Vec3::new(0.5, 0.3, 0.3)).normalize();
        let right = Vec3::Y.cross(back).normalize();
        let axes = [right, back.cross(right), back].map(|axis| axis.extend(0.0));
        let world = Mat4::from_cols(axes[0], axes[1], axes[2], from.extend(1.0));
        View::new(&Camera { name: String::new(), projection }, world, [128, 96])
    }

    #[test]
    fn a_cut_holds_each_visible_sample_once_and_far_cuts_are_smaller() {
        let samples = corner(32);
        let tree = Tree::new(&samples, &[1500, 548], 1.0 / 32.0);
        assert_eq!(tree.members.len(), 2048);
        let mut before = usize::MAX;
        for away in [1.2f32, 4.0, 16.0, 64.0] {
            let view = seen(Vec3::splat(away));
            let cut = tree.cut(&view, 2.0, 1.8);
            let mut members: Vec<u32> = Vec::new();
            for number in &cut {
                let splat = &tree.splats[*number as usize];
                let own = &tree.members[splat.first as usize..(splat.first + splat.count) as usize];
                members.extend(own);
                // One plane each.
                assert!(own.iter().all(|m| samples[*m as usize].normal == samples[own[0] as usize].normal));
            }
            members.sort_unstable();
            members.dedup();
            assert_eq!(members.len(), cut.iter().map(|n| tree.splats[*n as usize].count as usize).sum::<usize>());
            assert!(away < 2.0 || members.len() == samples.len(), "{away}: {}", members.len());
            assert!(cut.len() < before || away < 2.0, "{away}: {}", cut.len());
            before = cut.len();
            assert_eq!(tree.cut(&view, 0.0, 1.8).len(), members.len());
        }
        assert!(before < 64, "{before}");
        // From behind there is nothing to see.
        assert!(tree.cut(&seen(Vec3::new(0.5, -3.0, -3.0)), 2.0, 1.8).is_empty());
    }

    #[test]
    fn spheres_hold_both_parts() {
        let (a, b) = ((Vec3::ZERO, 1.0), (Vec3::X * 3.0, 0.5));
        let (middle, radius) = around([a, b]);
        assert!(
            (middle.distance(a.0) + a.1 - radius).abs() < 1e-5 && (middle.distance(b.0) + b.1 - radius).abs() < 1e-5
        );
        assert_eq!(around([a, (Vec3::X * 0.2, 0.3)]), a);
        assert_eq!(around([a, a]), a);
    }
}

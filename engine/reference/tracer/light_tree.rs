//! A tree of bounds over lights, with which `lib/light_sampling.glsl` picks one for a place (Conty Estevez and Kulla, Importance
//! Sampling of Many Lights with Adaptive Tree Splitting, 2018).

use crate::{
    scene::Aabb,
    shaders::{
        consts::{LIGHT_LEVELS, TRAIL_NONE},
        types::LightNode,
    },
};
use glam::{Mat3, Vec3};

/// Not there.
const NONE: u32 = u32::MAX;
/// Places along each axis where a node may be cut, and one.
const BUCKETS: usize = 12;

/// One light, or the bounds of some.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    pub around: Aabb,
    /// What it sends along its axis, W/sr.
    pub power: f64,
    /// Nothing arrives beyond, metres; infinite for most.
    pub reach: f32,
    /// Unit.
    pub axis: Vec3,
    /// The lights' own axes lie within this angle of `axis`, radians.
    pub spread: f64,
    /// How far from its own axis a light shines, radians.
    pub edge: f64,
    /// It shines to both sides.
    pub two_sided: bool,
}

impl Bounds {
    fn union(self, other: Self) -> Self {
        let (axis, spread) = cone((self.axis, self.spread), (other.axis, other.spread));
        Self {
            around: self.around.union(other.around),
            power: self.power + other.power,
            reach: self.reach.max(other.reach),
            axis,
            spread,
            edge: self.edge.max(other.edge),
            two_sided: self.two_sided || other.two_sided,
        }
    }

    /// Directions that it shines into, weighted (Conty Estevez and Kulla, equation 1).
    fn orientation(&self) -> f64 {
        use std::f64::consts::PI;
        let (o, w) = (self.spread, (self.spread + self.edge).min(PI));
        let rim = 2.0 * w * o.sin() - (o - 2.0 * w).cos() - 2.0 * o * o.sin() + o.cos();
        2.0 * PI * (1.0 - o.cos()) + 0.5 * PI * rim
    }

    /// Cost of a node with these lights: power, area of the box, directions.
    fn cost(&self) -> f64 {
        let size = (self.around.max - self.around.min).as_dvec3();
        // Flat boxes and points have no area; their extent still counts.
        let area = size.x * size.y + size.y * size.z + size.z * size.x + 1e-6 * size.length_squared();
        self.power * area * self.orientation()
    }

    fn centre(&self) -> Vec3 {
        0.5 * (self.around.min + self.around.max)
    }

    fn node(&self, second: u32, light: u32) -> LightNode {
        LightNode {
            low: self.around.min.to_array(),
            power: self.power as f32,
            high: self.around.max.to_array(),
            // The square must be finite.
            reach: self.reach.min(1e18),
            axis: self.axis.to_array(),
            cos_spread: self.spread.cos() as f32,
            cos_edge: self.edge.cos() as f32,
            two_sided: u32::from(self.two_sided),
            second,
            light,
        }
    }
}

/// The smallest cone around two, each an axis and a half angle.
fn cone(a: (Vec3, f64), b: (Vec3, f64)) -> (Vec3, f64) {
    use std::f64::consts::PI;
    let (wide, narrow) = if a.1 >= b.1 { (a, b) } else { (b, a) };
    let between = f64::from(wide.0.angle_between(narrow.0));
    if (between + narrow.1).min(PI) <= wide.1 {
        return wide;
    }
    let spread = 0.5 * (wide.1 + between + narrow.1);
    let pole = wide.0.cross(narrow.0);
    if spread >= PI || pole.length_squared() < 1e-12 {
        return (wide.0, PI);
    }
    // A little wider: the axis is rounded.
    let turned = Mat3::from_axis_angle(pole.normalize(), (spread - wide.1) as f32) * wide.0;
    (turned.normalize(), (spread + 1e-6).min(PI))
}

/// Nodes, the root first, and the way to each light (`TRAIL_NONE`: it is not in the tree). `lights[i]`: number and bounds.
/// `count`: how many numbers there are. Without lights there is one node, of no power.
pub fn build(lights: &[(u32, Bounds)], count: usize) -> (Vec<LightNode>, Vec<u32>) {
    let mut trails = vec![TRAIL_NONE; count];
    let mut nodes = Vec::with_capacity(2 * lights.len());
    if lights.is_empty() {
        nodes.push(LightNode { second: NONE, ..Default::default() });
        return (nodes, trails);
    }
    let mut order = lights.to_vec();
    // What is still to be built: a range, its level, the way to it, and the node whose second half it is.
    let mut todo = vec![(0..order.len(), 0u32, 0u32, NONE)];
    while let Some((range, level, trail, parent)) = todo.pop() {
        let here = &mut order[range.clone()];
        let number = nodes.len() as u32;
        if let Some(parent) = nodes.get_mut(parent as usize) {
            let parent: &mut LightNode = parent;
            parent.second = number;
        }
        let Some(all) = here.iter().map(|l| l.1).reduce(Bounds::union) else { continue };
        if let [(light, bounds)] = here {
            nodes.push(bounds.node(NONE, *light));
            trails[*light as usize] = trail;
            continue;
        }
        let left = LIGHT_LEVELS - level;
        let cut = range.start + split(here, left);
        nodes.push(all.node(NONE, NONE));
        // The first half comes off the stack at once, and so lies right behind its parent.
        todo.push((cut..range.end, level + 1, trail | 1 << level, number));
        todo.push((range.start..cut, level + 1, trail, NONE));
    }
    (nodes, trails)
}

/// Orders at least two lights into two halves, and returns the size of the first. `left`: levels that the halves may have.
fn split(lights: &mut [(u32, Bounds)], left: u32) -> usize {
    let middle = lights.len() / 2;
    let centres = Aabb::of(lights.iter().map(|l| l.1.centre()));
    let size = centres.max - centres.min;
    let longest = if size.x >= size.y && size.x >= size.z { 0 } else { 1 + usize::from(size.z > size.y) };
    // With as many levels as an even tree needs there is no room for a better one.
    let even = usize::BITS - (lights.len() - 1).leading_zeros();
    let mut best: Option<(f64, usize, f32)> = None;
    if even + 1 < left {
        for axis in 0..3 {
            if size[axis] <= 0.0 {
                continue;
            }
            let scale = BUCKETS as f32 / size[axis];
            let bucket = |b: &Bounds| (((b.centre()[axis] - centres.min[axis]) * scale) as usize).min(BUCKETS - 1);
            let mut filled: [Option<Bounds>; BUCKETS] = [None; BUCKETS];
            for (_, bounds) in lights.iter() {
                let slot = &mut filled[bucket(bounds)];
                *slot = Some(slot.map_or(*bounds, |b| b.union(*bounds)));
            }
            let join = |part: &[Option<Bounds>]| part.iter().flatten().copied().reduce(Bounds::union);
            for cut in 1..BUCKETS {
                let (Some(a), Some(b)) = (join(&filled[..cut]), join(&filled[cut..])) else { continue };
                // Thin slices of the node cost as much as thick ones to look at (Conty Estevez and Kulla, section 4.3).
                let thin = f64::from(size.max_element() / size[axis]);
                let cost = thin * (a.cost() + b.cost());
                if best.is_none_or(|(least, ..)| cost < least) {
                    best = Some((cost, axis, cut as f32));
                }
            }
        }
    }
    if let Some((_, axis, cut)) = best {
        let scale = BUCKETS as f32 / size[axis];
        let first =
            |b: &Bounds| (((b.centre()[axis] - centres.min[axis]) * scale) as usize).min(BUCKETS - 1) < cut as usize;
        // Stable, so that the same lights give the same tree.
        lights.sort_by_key(|(_, bounds)| !first(bounds));
        let count = lights.iter().filter(|(_, bounds)| first(bounds)).count();
        if count > 0 && count < lights.len() {
            return count;
        }
    }
    lights.sort_by(|a, b| a.1.centre()[longest].total_cmp(&b.1.centre()[longest]).then(a.0.cmp(&b.0)));
    middle
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::PI;

    fn light(at: Vec3, axis: Vec3, spread: f64, power: f64) -> Bounds {
        let around = Aabb { min: at, max: at + Vec3::splat(0.1) };
        Bounds { around, power, reach: f32::INFINITY, axis: axis.normalize(), spread, edge: 0.5 * PI, two_sided: false }
    }

    fn any_light() -> impl Strategy<Value = Bounds> {
        let coordinate = || prop_oneof![Just(0.0f32), -10.0f32..10.0];
        ((coordinate(), coordinate(), coordinate()), (-1.0f32..1.0, -1.0f32..1.0, 0.01f32..1.0), 0.0..PI, 1e-6..1e6f64)
            .prop_map(|((x, y, z), (a, b, c), spread, power)| {
                light(Vec3::new(x, y, z), Vec3::new(a, b, c), spread, power)
            })
    }

    proptest! {
        #[test]
        fn a_cone_holds_both(a in any_light(), b in any_light(), turn in 0.0..6.3f32, share in 0.0..1.0f32) {
            let (axis, spread) = cone((a.axis, a.spread), (b.axis, b.spread));
            for (part, angle) in [(a.axis, a.spread), (b.axis, b.spread)] {
                let tilted = Mat3::from_axis_angle(part.any_orthonormal_vector(), angle as f32 * share) * part;
                let inside = Mat3::from_axis_angle(part, turn) * tilted;
                prop_assert!(f64::from(inside.angle_between(axis)) <= spread + 2e-3, "{inside} beyond {spread} of {axis}");
            }
        }

        #[test]
        fn every_light_has_its_own_way(lights in prop::collection::vec(any_light(), 1..300)) {
            let count = lights.len() + 3;
            let numbered: Vec<(u32, Bounds)> = lights.iter().enumerate().map(|(i, b)| (i as u32 + 2, *b)).collect();
            let (nodes, trails) = build(&numbered, count);
            prop_assert_eq!(nodes.len(), 2 * lights.len() - 1);
            prop_assert!(trails[0] == TRAIL_NONE && trails[1] == TRAIL_NONE && trails[count - 1] == TRAIL_NONE);
            for (number, bounds) in &numbered {
                let (mut node, mut level) = (0usize, 0);
                loop {
                    let n = &nodes[node];
                    let (low, high) = (Vec3::from(n.low), Vec3::from(n.high));
                    prop_assert!(bounds.around.min.cmpge(low).all() && bounds.around.max.cmple(high).all());
                    if n.second == NONE {
                        prop_assert_eq!(n.light, *number);
                        break;
                    }
                    let halves = f64::from(nodes[node + 1].power) + f64::from(nodes[n.second as usize].power);
                    prop_assert!((halves / f64::from(n.power) - 1.0).abs() < 1e-5);
                    prop_assert!(level < LIGHT_LEVELS);
                    node = if trails[*number as usize] >> level & 1 == 0 { node + 1 } else { n.second as usize };
                    level += 1;
                }
            }
        }
    }

    #[test]
    fn crowds_in_one_place_and_long_rows_fit_the_levels() {
        let crowd: Vec<(u32, Bounds)> = (0..3000).map(|i| (i, light(Vec3::ONE, Vec3::Y, 0.0, 1.0))).collect();
        // Each twice as far: a tree by area alone would be as deep as there are lights.
        let row: Vec<(u32, Bounds)> =
            (0..120).map(|i| (i, light(Vec3::X * 1e-15 * 2f32.powi(i as i32), Vec3::Y, 0.0, 1.0))).collect();
        for lights in [crowd, row] {
            let (nodes, trails) = build(&lights, lights.len());
            assert_eq!(nodes.len(), 2 * lights.len() - 1);
            assert!(trails.iter().all(|&t| t < 1 << LIGHT_LEVELS));
        }
        assert_eq!(build(&[], 2).0.len(), 1);
    }
}

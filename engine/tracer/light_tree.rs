//! The light tree: a bounding hierarchy over lights, from which `lib/light_sampling.glsl` picks a light for a point (Conty Estevez and Kulla,
//! Importance Sampling of Many Lights with Adaptive Tree Splitting, 2018).

use crate::{
    scene::Aabb,
    shaders::{
        consts::{LIGHT_LEVELS, TRAIL_NONE},
        types::LightNode,
    },
};
use glam::{Mat3, Vec3};

/// An absent node.
const NONE: u32 = u32::MAX;
/// Buckets along each axis; a node may be split between any two of them.
const BUCKETS: usize = 12;

/// A light, or the bounds of several lights.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    pub around: Aabb,
    /// Intensity along the axis, summed over the colour channels, W/sr.
    pub power: f64,
    /// Distance beyond which no light arrives, metres; infinite for most lights.
    pub reach: f32,
    /// Unit vector.
    pub axis: Vec3,
    /// The axes of all lights lie within this angle of `axis`, radians.
    pub spread: f64,
    /// Maximum angle to its own axis at which a light emits, radians.
    pub edge: f64,
    /// The light emits to both sides.
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

    /// The orientation measure (Conty Estevez and Kulla, equation 1).
    fn orientation(&self) -> f64 {
        use std::f64::consts::PI;
        let (o, w) = (self.spread, (self.spread + self.edge).min(PI));
        let rim = 2.0 * w * o.sin() - (o - 2.0 * w).cos() - 2.0 * o * o.sin() + o.cos();
        2.0 * PI * (1.0 - o.cos()) + 0.5 * PI * rim
    }

    /// Cost of a node with these bounds: the product of power, surface of the box, and orientation measure.
    fn cost(&self) -> f64 {
        let size = (self.around.max - self.around.min).as_dvec3();
        // Points and lines have no area; the last term makes their extent count.
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
            // The square of the reach must be finite in 32 bits.
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

/// The smallest cone around two cones, each an axis and a half angle (radians).
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
    // A margin for the rounding of the axis.
    let turned = Mat3::from_axis_angle(pole.normalize(), (spread - wide.1) as f32) * wide.0;
    (turned.normalize(), (spread + 1e-6).min(PI))
}

/// Builds the tree. Returns the nodes, the root first, and for each light the trail of branches to it (`TRAIL_NONE`: the light is not in the
/// tree). `lights[i]`: number and bounds of a light. `count`: length of the list of trails. Without lights there is one node without power.
pub fn build(lights: &[(u32, Bounds)], count: usize) -> (Vec<LightNode>, Vec<u32>) {
    let mut trails = vec![TRAIL_NONE; count];
    let mut nodes = Vec::with_capacity(2 * lights.len());
    if lights.is_empty() {
        nodes.push(LightNode { second: NONE, ..Default::default() });
        return (nodes, trails);
    }
    let mut order = lights.to_vec();
    // Ranges of lights whose nodes are not built yet, each with its level, its trail, and the node whose second child it is.
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
        // The first child is taken from the stack next, so that it directly follows its parent.
        todo.push((cut..range.end, level + 1, trail | 1 << level, number));
        todo.push((range.start..cut, level + 1, trail, NONE));
    }
    (nodes, trails)
}

/// Partitions at least two lights into two parts, and returns the size of the first. `left`: maximum of levels below.
fn split(lights: &mut [(u32, Bounds)], left: u32) -> usize {
    let middle = lights.len() / 2;
    let centres = Aabb::of(lights.iter().map(|l| l.1.centre()));
    let size = centres.max - centres.min;
    let longest = if size.x >= size.y && size.x >= size.z { 0 } else { 1 + usize::from(size.z > size.y) };
    // If only as many levels are left as a balanced tree needs, the split must be balanced.
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
                // Regularisation that avoids thin boxes (Conty Estevez and Kulla, section 4.3).
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
        // A stable sort, so that the same lights give the same tree.
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
        // Each light is twice as far away as the one before. A tree that minimises the cost would have one level per light.
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

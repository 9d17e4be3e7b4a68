//! A bounding-volume hierarchy over all triangles of a scene, in world space.
//!
//! Built by the obvhs crate (PLOC with reinsertion), or by surface area over bins (`binned`) where that would not end; the traversal here is the plain CPU one that cameras, tests and
//! precomputations use. Rays that meet an edge shared by two triangles hit at least one of them: Woop, Benthin and Wald,
//! "Watertight Ray/Triangle Intersection", JCGT 2013, with box tests padded as in Ize, "Robust BVH Ray Traversal", JCGT 2013.

pub(crate) mod binned;

use super::{Pose, Scene, deform::world_vertices};
use glam::{BVec3A, DVec3, Vec3, Vec3A};
use obvhs::{BvhBuildParams, aabb::Aabb, bvh2::Bvh2, bvh2::builder::build_bvh2};
use std::time::Duration;

/// Which triangle of the scene: `scene.meshes[scene.nodes[node].mesh].primitives[primitive].indices[3 * triangle..]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TriangleId {
    pub node: u32,
    pub primitive: u32,
    pub triangle: u32,
}

/// Where a ray meets a triangle first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// In lengths of the ray's direction.
    pub t: f32,
    /// Weight of the second vertex; the first has 1 − u − v.
    pub u: f32,
    /// Weight of the third vertex.
    pub v: f32,
    /// Index into the triangles in the order they were given.
    pub triangle: u32,
}

/// A ray segment from `t_min` to `t_max` along `direction` (any length but zero).
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    pub origin: Vec3,
    pub direction: Vec3,
    pub t_min: f32,
    pub t_max: f32,
}

impl Ray {
    /// From `origin` to infinity.
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, direction, t_min: 0.0, t_max: f32::INFINITY }
    }
}

/// How [`Bvh::walk`] goes on after a hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// As if the triangle were not there.
    Ignore,
    /// Only what is nearer still counts.
    Nearer,
    /// Nothing more is wanted.
    End,
}

/// Triangles of a leaf where the crate does not build the tree.
const LEAF: usize = 4;

/// Triangles and the tree above them.
pub struct Bvh {
    tree: Bvh2,
    /// In the order given; leaves hold indices.
    triangles: Vec<[Vec3; 3]>,
    ids: Vec<TriangleId>,
}

impl std::fmt::Debug for Bvh {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Bvh({} triangles, {} nodes)", self.triangles.len(), self.tree.nodes.len())
    }
}

fn bounds([a, b, c]: &[Vec3; 3]) -> Aabb {
    Aabb::new(a.min(*b).min(*c).into(), a.max(*b).max(*c).into())
}

impl Bvh {
    /// All triangles of `scene` as they stand in `pose`.
    pub fn build(scene: &Scene, pose: &Pose) -> Self {
        let mut triangles = Vec::new();
        let mut ids = Vec::new();
        for (index, node) in scene.nodes.iter().enumerate() {
            let Some(mesh) = node.mesh else { continue };
            for (p, primitive) in scene.meshes[mesh as usize].primitives.iter().enumerate() {
                let positions = world_vertices(scene, pose, index, primitive).positions;
                for (t, corner) in primitive.indices.chunks_exact(3).enumerate() {
                    triangles.push([0, 1, 2].map(|i| positions[corner[i] as usize]));
                    ids.push(TriangleId { node: index as u32, primitive: p as u32, triangle: t as u32 });
                }
            }
        }
        Self::over(triangles, ids)
    }

    /// A bare list of triangles; their ids count up in primitive 0 of node 0.
    pub fn from_triangles(triangles: Vec<[Vec3; 3]>) -> Self {
        let ids = (0..triangles.len() as u32).map(|triangle| TriangleId { node: 0, primitive: 0, triangle }).collect();
        Self::over(triangles, ids)
    }

    fn over(triangles: Vec<[Vec3; 3]>, ids: Vec<TriangleId>) -> Self {
        let boxes: Vec<Aabb> = triangles.iter().map(bounds).collect();
        let tree = if boxes.is_empty() {
            Bvh2::default()
        } else if binned::clusters(&boxes) {
            build_bvh2(&boxes, BvhBuildParams::medium_build(), &mut Duration::default())
        } else {
            binned::build(&boxes, LEAF)
        };
        Self { tree, triangles, ids }
    }

    /// Corners of every triangle, metres.
    pub fn triangles(&self) -> &[[Vec3; 3]] {
        &self.triangles
    }

    /// Where triangle `index` comes from.
    pub fn id(&self, index: u32) -> TriangleId {
        self.ids[index as usize]
    }

    /// The tree, for uploading: leaves index [`Bvh2::primitive_indices`], these index [`Bvh::triangles`].
    pub fn tree(&self) -> &Bvh2 {
        &self.tree
    }

    /// Smallest and largest corner of everything, or nothing for an empty scene.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let root = self.tree.nodes.first()?.aabb();
        Some((root.min.into(), root.max.into()))
    }

    /// The nearest hit in the ray's segment. Both sides of a triangle count.
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        let mut best = None;
        self.walk(ray, |hit| {
            best = Some(hit);
            Step::Nearer
        });
        best
    }

    /// Whether anything lies in the ray's segment.
    pub fn any(&self, ray: &Ray) -> bool {
        let mut found = false;
        self.walk(ray, |_| {
            found = true;
            Step::End
        });
        found
    }

    /// Calls `hit` for hits in the ray's segment, in no particular order, and does what it says.
    pub fn walk(&self, ray: &Ray, mut hit: impl FnMut(Hit) -> Step) {
        if self.tree.nodes.is_empty() {
            return;
        }
        let frame = Frame::new(ray);
        let slabs = Slabs::new(ray);
        let mut t_max = ray.t_max;
        let enters = |index: u32, t_max: f32| slabs.enter(self.tree.nodes[index as usize].aabb(), t_max);
        let mut stack = Stack::default();
        if let Some(near) = enters(0, t_max) {
            stack.push((0, near));
        }
        while let Some((index, near)) = stack.pop() {
            // Something nearer may have been found since.
            if near > t_max {
                continue;
            }
            let node = &self.tree.nodes[index as usize];
            if node.is_leaf() {
                for slot in node.first_index..node.first_index + node.prim_count {
                    let triangle = self.tree.primitive_indices[slot as usize];
                    let Some((t, u, v)) = frame.intersect(&self.triangles[triangle as usize]) else { continue };
                    if t >= ray.t_min && t < t_max {
                        match hit(Hit { t, u, v, triangle }) {
                            Step::Ignore => {}
                            Step::Nearer => t_max = t,
                            Step::End => return,
                        }
                    }
                }
            } else {
                let (left, right) = (node.first_index, node.first_index + 1);
                match (enters(left, t_max), enters(right, t_max)) {
                    (Some(a), Some(b)) if a <= b => {
                        stack.push((right, b));
                        stack.push((left, a));
                    }
                    (Some(a), Some(b)) => {
                        stack.push((left, a));
                        stack.push((right, b));
                    }
                    (Some(a), None) => stack.push((left, a)),
                    (None, Some(b)) => stack.push((right, b)),
                    (None, None) => {}
                }
            }
        }
    }

    /// Checks that every triangle stands in exactly one leaf and inside the boxes of all its ancestors.
    pub fn validate(&self) -> Result<(), String> {
        if self.tree.nodes.is_empty() {
            let n = self.triangles.len();
            return if n == 0 { Ok(()) } else { Err(format!("no nodes over {n} triangles")) };
        }
        let mut seen = vec![0u32; self.triangles.len()];
        let everything = (Vec3::NEG_INFINITY, Vec3::INFINITY);
        let mut stack = vec![(0u32, everything)];
        let mut visits = 0usize;
        while let Some((index, (low, high))) = stack.pop() {
            visits += 1;
            if visits > self.tree.nodes.len() {
                return Err("the tree has a cycle".into());
            }
            let node = self.tree.nodes.get(index as usize).ok_or(format!("node {index} does not exist"))?;
            let (min, max): (Vec3, Vec3) = (node.aabb().min.into(), node.aabb().max.into());
            if min.cmplt(low).any() || max.cmpgt(high).any() {
                return Err(format!("node {index} sticks out of its parent"));
            }
            if !node.is_leaf() {
                stack.extend([(node.first_index, (min, max)), (node.first_index + 1, (min, max))]);
                continue;
            }
            for slot in node.first_index..node.first_index + node.prim_count {
                let triangle = self.tree.primitive_indices[slot as usize] as usize;
                seen[triangle] += 1;
                if self.triangles[triangle].iter().any(|p| p.cmplt(min).any() || p.cmpgt(max).any()) {
                    return Err(format!("triangle {triangle} sticks out of leaf {index}"));
                }
            }
        }
        match seen.iter().position(|&n| n != 1) {
            Some(triangle) => Err(format!("triangle {triangle} stands in {} leaves", seen[triangle])),
            None => Ok(()),
        }
    }
}

/// Nodes that wait, with where the ray enters them. Trees of any depth, but those of usual depth take no memory from the heap.
struct Stack {
    low: [(u32, f32); 64],
    used: usize,
    high: Vec<(u32, f32)>,
}

impl Default for Stack {
    fn default() -> Self {
        Self { low: [(0, 0.0); 64], used: 0, high: Vec::new() }
    }
}

impl Stack {
    fn push(&mut self, node: (u32, f32)) {
        match self.low.get_mut(self.used) {
            Some(slot) => {
                *slot = node;
                self.used += 1;
            }
            None => self.high.push(node),
        }
    }

    fn pop(&mut self) -> Option<(u32, f32)> {
        self.high.pop().or_else(|| {
            self.used = self.used.checked_sub(1)?;
            Some(self.low[self.used])
        })
    }
}

/// A ray as boxes are tested with it.
struct Slabs {
    origin: Vec3A,
    inverse: Vec3A,
    backwards: BVec3A,
    t_min: Vec3A,
}

impl Slabs {
    fn new(ray: &Ray) -> Self {
        let inverse = Vec3A::from(ray.direction.recip());
        let backwards = inverse.cmplt(Vec3A::ZERO);
        Self { origin: ray.origin.into(), inverse, backwards, t_min: Vec3A::splat(ray.t_min) }
    }

    /// Where the ray enters a box, or nothing when it misses it. A NaN (the ray lies in a face: 0 · ∞) keeps the other bound, as
    /// comparisons do; what minimum and maximum do, processors do not agree on.
    fn enter(&self, aabb: &Aabb, t_max: f32) -> Option<f32> {
        let (a, b) = ((aabb.min - self.origin) * self.inverse, (aabb.max - self.origin) * self.inverse);
        let (lo, hi) = (Vec3A::select(self.backwards, b, a), Vec3A::select(self.backwards, a, b));
        let near = Vec3A::select(lo.cmpgt(self.t_min), lo, self.t_min).max_element();
        // Ize: two units in the last place more make the far bound safe against rounding.
        let (hi, t_max) = (hi * (1.0 + 4.0 * f32::EPSILON), Vec3A::splat(t_max));
        let far = Vec3A::select(hi.cmplt(t_max), hi, t_max).min_element();
        (near <= far).then_some(near)
    }
}

/// The ray's shear to the +z axis (Woop, Benthin and Wald 2013).
struct Frame {
    origin: Vec3,
    axes: [usize; 3],
    shear: Vec3,
}

impl Frame {
    fn new(ray: &Ray) -> Self {
        let size = ray.direction.abs();
        let z = if size.x > size.y && size.x > size.z {
            0
        } else if size.y > size.z {
            1
        } else {
            2
        };
        let (mut x, mut y) = ((z + 1) % 3, (z + 2) % 3);
        // Keeps the winding.
        if ray.direction[z] < 0.0 {
            std::mem::swap(&mut x, &mut y);
        }
        let d = ray.direction;
        Self { origin: ray.origin, axes: [x, y, z], shear: Vec3::new(d[x] / d[z], d[y] / d[z], 1.0 / d[z]) }
    }

    /// `(t, u, v)` of the line's hit, if any.
    fn intersect(&self, triangle: &[Vec3; 3]) -> Option<(f32, f32, f32)> {
        let [x, y, z] = self.axes;
        let corner = |p: Vec3| {
            let q = p - self.origin;
            // Products and sums in double precision decide the sign exactly where single precision gives zero.
            DVec3::new(
                f64::from(q[x]) - f64::from(self.shear.x) * f64::from(q[z]),
                f64::from(q[y]) - f64::from(self.shear.y) * f64::from(q[z]),
                f64::from(self.shear.z) * f64::from(q[z]),
            )
        };
        let [a, b, c] = triangle.map(corner);
        let (u, v, w) = (c.x * b.y - c.y * b.x, a.x * c.y - a.y * c.x, b.x * a.y - b.y * a.x);
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let determinant = u + v + w;
        if determinant == 0.0 {
            return None;
        }
        let t = (u * a.z + v * b.z + w * c.z) / determinant;
        Some((t as f32, (v / determinant) as f32, (w / determinant) as f32))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Mesh, Node, Primitive, Transform};
    use glam::Mat4;
    use proptest::prelude::*;

    /// xorshift: tests need no crate for numbers.
    struct Numbers(u64);

    impl Numbers {
        fn next(&mut self) -> f32 {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 7;
            self.0 ^= self.0 << 17;
            (self.0 >> 40) as f32 / (1u64 << 24) as f32 * 2.0 - 1.0
        }

        fn vector(&mut self) -> Vec3 {
            Vec3::new(self.next(), self.next(), self.next())
        }
    }

    fn brute_force(bvh: &Bvh, ray: &Ray) -> Option<f32> {
        let frame = Frame::new(ray);
        let hits = bvh.triangles().iter().filter_map(|t| frame.intersect(t)).map(|h| h.0);
        hits.filter(|t| (ray.t_min..ray.t_max).contains(t)).min_by(f32::total_cmp)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn the_tree_finds_what_brute_force_finds(seed in 1u64.., count in 0usize..120) {
            let mut numbers = Numbers(seed);
            let mut triangles: Vec<[Vec3; 3]> = Vec::new();
            for i in 0..count {
                let centre = numbers.vector() * 4.0;
                triangles.push(match i % 5 {
                    // Degenerate to a point and to a line, coplanar with an axis, copies of the one before.
                    0 => [centre; 3],
                    1 => [centre, centre + Vec3::X, centre + Vec3::X * 2.0],
                    2 => [centre.with_y(0.0), (centre + Vec3::X).with_y(0.0), (centre + Vec3::Z).with_y(0.0)],
                    3 if i > 3 => triangles[i - 1],
                    _ => [centre, centre + numbers.vector(), centre + numbers.vector()],
                });
            }
            let bvh = Bvh::from_triangles(triangles);
            prop_assert_eq!(bvh.validate(), Ok(()));
            for i in 0..100 {
                let direction = match i % 4 {
                    0 => [Vec3::X, Vec3::NEG_Y, Vec3::Z][i / 4 % 3],
                    _ => numbers.vector(),
                };
                if direction == Vec3::ZERO {
                    continue;
                }
                let ray = Ray { origin: numbers.vector() * 5.0, direction, t_min: 0.0, t_max: 100.0 };
                let expected = brute_force(&bvh, &ray);
                prop_assert_eq!(bvh.closest(&ray).map(|h| h.t), expected);
                prop_assert_eq!(bvh.any(&ray), expected.is_some());
            }
        }
    }

    #[test]
    fn no_ray_slips_through_a_closed_mesh() {
        // A unit cube whose faces are cut into many triangles; rays from inside through vertices, edges and at random.
        let n = 8;
        let mut triangles = Vec::new();
        let mut targets = Vec::new();
        for axis in 0..3 {
            for side in [-1.0f32, 1.0] {
                let at = |i: i32, j: i32| {
                    let (a, b) = (2.0 * i as f32 / n as f32 - 1.0, 2.0 * j as f32 / n as f32 - 1.0);
                    let mut p = [0.0; 3];
                    (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (side, a, b);
                    Vec3::from(p)
                };
                for i in 0..n {
                    for j in 0..n {
                        let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
                        triangles.extend([[a, b, c], [a, c, d]]);
                        targets.extend([a, a.lerp(b, 0.37), a.lerp(c, 0.61), a.lerp(d, 0.13)]);
                    }
                }
            }
        }
        let bvh = Bvh::from_triangles(triangles);
        let mut numbers = Numbers(7);
        let origin = Vec3::new(0.137, -0.241, 0.059);
        targets.extend((0..20_000).map(|_| origin + numbers.vector()));
        for target in targets {
            assert!(bvh.any(&Ray::new(origin, target - origin)), "towards {target}");
        }
    }

    #[test]
    fn a_hit_knows_its_triangle_and_its_place() {
        let quad = Primitive {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y],
            normals: vec![Vec3::Z; 4],
            tangents: vec![glam::Vec4::ZERO; 4],
            indices: vec![0, 1, 2, 0, 2, 3],
            ..Primitive::default()
        };
        let at = |z: f32| Node {
            mesh: Some(0),
            local: Transform::Matrix(Mat4::from_translation(Vec3::new(0.0, 0.0, z))),
            ..Node::default()
        };
        let scene = Scene {
            nodes: vec![at(0.0), at(3.0)],
            meshes: vec![Mesh { primitives: vec![quad], ..Mesh::default() }],
            ..Scene::default()
        };
        let bvh = Bvh::build(&scene, &Pose::rest(&scene));
        assert_eq!(bvh.bounds(), Some((Vec3::ZERO, Vec3::new(1.0, 1.0, 3.0))));
        let hit = bvh.closest(&Ray::new(Vec3::new(0.75, 0.25, 5.0), Vec3::NEG_Z)).unwrap();
        assert_eq!(hit.t, 2.0);
        assert_eq!(bvh.id(hit.triangle), TriangleId { node: 1, primitive: 0, triangle: 0 });
        // (0.75, 0.25) = 0.25 · a + 0.5 · b + 0.25 · c.
        assert!((hit.u - 0.5).abs() < 1e-6 && (hit.v - 0.25).abs() < 1e-6);
        let short = Ray { t_max: 1.9, ..Ray::new(Vec3::new(0.75, 0.25, 5.0), Vec3::NEG_Z) };
        assert_eq!(bvh.closest(&short), None);
        assert!(!bvh.any(&Ray { t_min: 5.5, ..Ray::new(Vec3::new(0.75, 0.25, 5.0), Vec3::NEG_Z) }));
    }

    #[test]
    fn an_empty_scene_is_empty() {
        let bvh = Bvh::from_triangles(Vec::new());
        assert_eq!(bvh.validate(), Ok(()));
        assert_eq!(bvh.bounds(), None);
        assert!(!bvh.any(&Ray::new(Vec3::ZERO, Vec3::X)));
    }
}

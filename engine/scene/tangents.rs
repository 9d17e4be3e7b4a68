//! Tangents by MikkTSpace, the convention that normal maps are baked with.

use super::{
    Primitive,
    surface::{area_vector, tangent_of},
};
use bevy_mikktspace::{Geometry, TangentSpace};
use glam::{Vec2, Vec3, Vec4};
use std::{
    collections::{HashMap, hash_map::Entry},
    panic::{AssertUnwindSafe, catch_unwind},
};

/// MikkTSpace compares all triangles around a vertex with each other and recurses around it. Ordinary meshes have 4 to
/// 50 triangles there; above this many in one place, or this many comparisons a corner, the simple mean is used.
const MAX_AROUND: u32 = 1024;
const MAX_COMPARISONS: u64 = 256;

/// How tangents were made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Made {
    MikkTSpace,
    /// The mean over the triangles around each vertex.
    Mean,
}

impl Primitive {
    /// Computes tangents from uv set `set`, splitting vertices where triangles that meet there disagree. The primitive
    /// has unit normals and no tangents.
    pub(crate) fn make_tangents(&mut self, set: usize) -> Made {
        let Some(uvs) = self.uvs.get(set) else {
            self.tangents = self.normals.iter().map(|&normal| tangent_of(Vec3::ZERO, normal, 1.0)).collect();
            return Made::Mean;
        };
        let corners = if tame(self, uvs) { mikktspace(self, uvs) } else { None };
        let made = if corners.is_some() { Made::MikkTSpace } else { Made::Mean };
        let corners = corners.unwrap_or_else(|| mean(self, uvs));

        // Vertices whose corners all got the same tangent stay one.
        let mut from = Vec::with_capacity(self.positions.len());
        let mut known: HashMap<(u32, [u32; 4]), u32> = HashMap::with_capacity(self.positions.len());
        let mut tangents = Vec::with_capacity(self.positions.len());
        for (index, &tangent) in self.indices.iter_mut().zip(&corners) {
            let tangent = tangent_of(tangent.truncate(), self.normals[*index as usize], tangent.w);
            *index = match known.entry((*index, tangent.to_array().map(f32::to_bits))) {
                Entry::Occupied(entry) => *entry.get(),
                Entry::Vacant(entry) => {
                    from.push(*index);
                    tangents.push(tangent);
                    *entry.insert(from.len() as u32 - 1)
                }
            };
        }
        self.gather_vertices(&from);
        self.tangents = tangents;
        made
    }
}

struct Corners<'a> {
    primitive: &'a Primitive,
    uvs: &'a [Vec2],
    tangents: Vec<Vec4>,
}

impl Corners<'_> {
    fn index(&self, face: usize, vertex: usize) -> usize {
        self.primitive.indices[face * 3 + vertex] as usize
    }
}

impl Geometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.primitive.indices.len() / 3
    }

    fn num_vertices_of_face(&self, _: usize) -> usize {
        3
    }

    fn position(&self, face: usize, vertex: usize) -> [f32; 3] {
        self.primitive.positions[self.index(face, vertex)].to_array()
    }

    fn normal(&self, face: usize, vertex: usize) -> [f32; 3] {
        self.primitive.normals[self.index(face, vertex)].to_array()
    }

    fn tex_coord(&self, face: usize, vertex: usize) -> [f32; 2] {
        // MikkTSpace has v upwards, glTF downwards.
        let uv = self.uvs[self.index(face, vertex)];
        [uv.x, 1.0 - uv.y]
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, vertex: usize) {
        if let Some(space) = space {
            self.tangents[face * 3 + vertex] = Vec4::from_array(space.tangent_encoded());
        }
    }
}

/// Whether MikkTSpace will end soon, and will not meet numbers that leave the range of floats.
fn tame(primitive: &Primitive, uvs: &[Vec2]) -> bool {
    let small = |value: f32| value.abs() < 1e12;
    if !primitive.positions.iter().all(|p| p.to_array().into_iter().all(small))
        || !uvs.iter().all(|uv| small(uv.x) && small(uv.y))
    {
        return false;
    }
    // Vertices that are equal in everything count as one.
    let mut around: HashMap<[u32; 8], u32> = HashMap::new();
    for &index in &primitive.indices {
        let i = index as usize;
        let (p, n, uv) = (primitive.positions[i], primitive.normals[i], uvs[i]);
        // Adding zero makes −0 and 0 the same.
        let key = [p.x, p.y, p.z, n.x, n.y, n.z, uv.x, uv.y].map(|value| (value + 0.0).to_bits());
        *around.entry(key).or_default() += 1;
    }
    let most = around.values().copied().max().unwrap_or(0);
    let comparisons: u64 = around.values().map(|&count| u64::from(count).pow(2)).sum();
    most <= MAX_AROUND && comparisons <= primitive.indices.len() as u64 * MAX_COMPARISONS
}

/// One tangent a corner; `None` if the crate gave up.
fn mikktspace(primitive: &Primitive, uvs: &[Vec2]) -> Option<Vec<Vec4>> {
    let mut corners = Corners { primitive, uvs, tangents: vec![Vec4::W; primitive.indices.len()] };
    catch_unwind(AssertUnwindSafe(|| {
        let made = bevy_mikktspace::generate_tangents(&mut corners);
        made.is_ok()
    }))
    .ok()
    .filter(|&ok| ok)
    .map(|_| corners.tangents)
}

/// One tangent a corner: the direction of growing u, averaged over the triangles of each vertex by area.
fn mean(primitive: &Primitive, uvs: &[Vec2]) -> Vec<Vec4> {
    let mut sums = vec![(Vec3::ZERO, 0.0f32); primitive.positions.len()];
    for corners in primitive.indices.chunks_exact(3) {
        let corner = [0, 1, 2].map(|c| corners[c] as usize);
        let [p0, p1, p2] = corner.map(|i| primitive.positions[i].as_dvec3());
        let [t0, t1, t2] = corner.map(|i| uvs[i].as_dvec2());
        let (e1, e2, d1, d2) = (p1 - p0, p2 - p0, t1 - t0, t2 - t0);
        let turn = d1.perp_dot(d2);
        let direction = (e1 * d2.y - e2 * d1.y) * turn.signum();
        let weight = area_vector(corner.map(|i| primitive.positions[i])).length();
        let tangent = direction.normalize_or_zero() * weight;
        for i in corner {
            sums[i].0 += tangent.as_vec3();
            // v grows downwards: a mirrored chart turns the same way as the triangle here.
            sums[i].1 -= (turn.signum() * weight) as f32;
        }
    }
    primitive
        .indices
        .iter()
        .map(|&i| {
            let (direction, turn) = sums[i as usize];
            let direction = if direction.is_finite() { direction } else { Vec3::ZERO };
            direction.extend(if turn < 0.0 { -1.0 } else { 1.0 })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square in the xy plane with u along x; `mirror` flips u.
    fn square(mirror: f32) -> Primitive {
        let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
        Primitive {
            positions: corners.iter().map(|&(x, y)| Vec3::new(x, y, 0.0)).collect(),
            normals: vec![Vec3::Z; 4],
            uvs: vec![corners.iter().map(|&(x, y)| Vec2::new(x * mirror, 1.0 - y)).collect()],
            indices: vec![0, 1, 2, 0, 2, 3],
            ..Primitive::default()
        }
    }

    #[test]
    fn tangent_follows_u_and_bitangent_goes_up_the_image() {
        // With v downwards in the file, the bitangent w · n × t points towards smaller v: up, as normal maps expect.
        for mirror in [1.0, -1.0] {
            let mut primitive = square(mirror);
            assert_eq!(primitive.make_tangents(0), Made::MikkTSpace);
            for (&tangent, &normal) in primitive.tangents.iter().zip(&primitive.normals) {
                assert!(tangent.truncate().abs_diff_eq(Vec3::X * mirror, 1e-6), "{tangent}");
                let bitangent = tangent.w * normal.cross(tangent.truncate());
                assert!(bitangent.abs_diff_eq(Vec3::Y, 1e-6), "{bitangent}");
            }
        }
    }

    #[test]
    fn the_mean_agrees_where_both_are_defined() {
        for mirror in [1.0, -1.0] {
            let primitive = square(mirror);
            let uvs = &primitive.uvs[0];
            let exact = mikktspace(&primitive, uvs).unwrap();
            for (a, b) in exact.iter().zip(mean(&primitive, uvs)) {
                let b = tangent_of(b.truncate(), Vec3::Z, b.w);
                assert!(a.abs_diff_eq(b, 1e-5), "{a} {b}");
            }
        }
    }

    #[test]
    fn a_seam_splits_vertices() {
        // The second triangle runs the other way in u.
        let mut primitive = square(1.0);
        primitive.positions.push(Vec3::new(-1.0, 1.0, 0.0));
        primitive.normals.push(Vec3::Z);
        primitive.uvs[0].push(Vec2::new(1.0, 0.0));
        primitive.indices.extend([0, 3, 4]);
        primitive.make_tangents(0);
        assert!(primitive.positions.len() > 5);
        assert_eq!(primitive.tangents.len(), primitive.positions.len());
        assert!(primitive.indices.iter().all(|&i| (i as usize) < primitive.positions.len()));
    }

    #[test]
    fn a_hostile_fan_takes_the_simple_way() {
        let count = 100_000;
        let rim = (0..=count).map(|i| {
            let angle = i as f32 / count as f32 * std::f32::consts::TAU;
            Vec3::new(angle.cos(), angle.sin(), 0.0)
        });
        let positions: Vec<Vec3> = std::iter::once(Vec3::ZERO).chain(rim).collect();
        let mut primitive = Primitive {
            normals: vec![Vec3::Z; positions.len()],
            uvs: vec![positions.iter().map(|p| Vec2::new(p.x, p.y)).collect()],
            indices: (1..=count).flat_map(|i| [0, i, i + 1]).collect(),
            positions,
            ..Primitive::default()
        };
        assert_eq!(primitive.make_tangents(0), Made::Mean);
        assert!(primitive.tangents.iter().all(|t| t.truncate().is_normalized()));
    }
}

//! What every front end does to a primitive once its attributes are read: drop triangles without area, supply missing
//! normals, make vectors unit length.

use super::{Material, Mesh, Primitive};
use glam::{DVec3, Vec3, Vec4};

/// What was repaired, for the scene's notes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Repairs {
    pub degenerate_triangles: usize,
    pub bad_normals: usize,
}

impl Primitive {
    /// Replaces the vertices: the new vertex `i` is the old vertex `from[i]`.
    pub(crate) fn gather_vertices(&mut self, from: &[u32]) {
        fn gather<T: Copy>(list: &mut Vec<T>, from: &[u32]) {
            if !list.is_empty() {
                *list = from.iter().map(|&i| list[i as usize]).collect();
            }
        }
        gather(&mut self.positions, from);
        gather(&mut self.normals, from);
        gather(&mut self.tangents, from);
        self.uvs.iter_mut().for_each(|set| gather(set, from));
        gather(&mut self.colors, from);
        self.joints.iter_mut().for_each(|set| gather(set, from));
        self.weights.iter_mut().for_each(|set| gather(set, from));
        for morph in &mut self.morphs {
            gather(&mut morph.positions, from);
            gather(&mut morph.normals, from);
            gather(&mut morph.tangents, from);
            gather(&mut morph.colors, from);
            morph.uvs.iter_mut().for_each(|set| gather(set, from));
        }
    }

    /// Bytes of one vertex, for bounding what splitting vertices takes.
    pub(crate) fn vertex_size(&self) -> u64 {
        let sets = |lists: usize, size: u64| lists as u64 * size;
        let morphs: u64 = self.morphs.iter().map(|morph| 36 + 16 + sets(morph.uvs.len(), 8)).sum();
        12 + 12 + 16 + 16 + sets(self.uvs.len(), 8) + sets(self.joints.len(), 8) + sets(self.weights.len(), 16) + morphs
    }

    /// Whether its shape can change while it is shown.
    fn deforms(&self) -> bool {
        !self.morphs.is_empty() || !self.joints.is_empty()
    }

    /// Drops triangles that have no area, and says how many. Of primitives that deform only those go that use a vertex
    /// twice, because the others may gain area.
    pub(crate) fn drop_degenerate_triangles(&mut self) -> usize {
        let before = self.indices.len();
        let deforms = self.deforms();
        let positions = &self.positions;
        let mut kept = 0;
        for triangle in 0..before / 3 {
            let corners = [0, 1, 2].map(|c| self.indices[triangle * 3 + c]);
            let [a, b, c] = corners;
            let twice = a == b || b == c || c == a;
            if !twice && (deforms || area_vector(corners.map(|i| positions[i as usize])) != DVec3::ZERO) {
                self.indices.copy_within(triangle * 3..triangle * 3 + 3, kept);
                kept += 3;
            }
        }
        self.indices.truncate(kept);
        (before - kept) / 3
    }

    /// Gives each triangle its own three vertices and the normal of its plane.
    pub(crate) fn make_flat(&mut self) {
        let from = std::mem::take(&mut self.indices);
        self.gather_vertices(&from);
        self.indices = (0..from.len() as u32).collect();
        self.normals = self
            .positions
            .chunks_exact(3)
            .flat_map(|p| [area_vector([p[0], p[1], p[2]]).normalize_or(DVec3::Y).as_vec3(); 3])
            .collect();
        // Differences to normals that the file does not have mean nothing.
        self.morphs.iter_mut().for_each(|morph| morph.normals.clear());
    }

    /// Makes normals unit length; those without a direction get that of the triangles around. Says how many those were.
    pub(crate) fn repair_normals(&mut self) -> usize {
        let mut bad = vec![];
        for (i, normal) in self.normals.iter_mut().enumerate() {
            match unit(*normal) {
                Some(unit) => *normal = unit,
                None => bad.push(i),
            }
        }
        if bad.is_empty() {
            return 0;
        }
        let mut sums = vec![DVec3::ZERO; self.positions.len()];
        for corners in self.indices.chunks_exact(3) {
            let area = area_vector([0, 1, 2].map(|c| self.positions[corners[c] as usize]));
            corners.iter().for_each(|&i| sums[i as usize] += area);
        }
        for &i in &bad {
            self.normals[i] = sums[i].normalize_or(DVec3::Y).as_vec3();
        }
        bad.len()
    }

    /// Makes tangents unit length, at right angles to the normals, and their handedness ±1.
    pub(crate) fn repair_tangents(&mut self) {
        for (tangent, &normal) in self.tangents.iter_mut().zip(&self.normals) {
            *tangent = tangent_of(tangent.truncate(), normal, tangent.w);
        }
    }
}

/// Front ends put a default material last; it stays only where a primitive uses it.
pub(crate) fn drop_unused_default(materials: &mut Vec<Material>, meshes: &[Mesh]) {
    let default = materials.len().wrapping_sub(1) as u32;
    if !meshes.iter().flat_map(|mesh| &mesh.primitives).any(|primitive| primitive.material == default) {
        materials.pop();
    }
}

/// The unit tangent nearest to `direction` at right angles to `normal`, any if there is none.
pub(crate) fn tangent_of(direction: Vec3, normal: Vec3, handedness: f32) -> Vec4 {
    let flat = unit(direction).and_then(|direction| unit(direction - normal * normal.dot(direction)));
    flat.unwrap_or_else(|| normal.any_orthonormal_vector()).extend(if handedness < 0.0 { -1.0 } else { 1.0 })
}

/// `vector` at unit length; `None` if it has no direction.
pub(crate) fn unit(vector: Vec3) -> Option<Vec3> {
    // In double precision: the squares of large and small floats leave the range of single precision.
    let vector = vector.as_dvec3();
    let length = vector.length();
    (length > 1e-30).then(|| (vector / length).as_vec3())
}

/// Twice the area of a triangle times its normal.
pub(crate) fn area_vector([a, b, c]: [Vec3; 3]) -> DVec3 {
    let a = a.as_dvec3();
    (b.as_dvec3() - a).cross(c.as_dvec3() - a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::MorphTarget;

    fn square() -> Primitive {
        Primitive {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::ONE.with_z(0.0), Vec3::Y, Vec3::X * 0.5],
            // The third has no area, the fourth uses a vertex twice.
            indices: vec![0, 1, 2, 0, 2, 3, 0, 4, 1, 3, 3, 1],
            ..Primitive::default()
        }
    }

    #[test]
    fn triangles_without_area_go() {
        let mut primitive = square();
        assert_eq!(primitive.drop_degenerate_triangles(), 2);
        assert_eq!(primitive.indices, [0, 1, 2, 0, 2, 3]);
    }

    #[test]
    fn triangles_that_may_gain_area_stay() {
        let mut primitive = square();
        primitive.morphs.push(MorphTarget::default());
        assert_eq!(primitive.drop_degenerate_triangles(), 1);
    }

    #[test]
    fn flat_normals_are_those_of_the_planes() {
        let mut primitive = square();
        primitive.positions[3].z = 1.0;
        primitive.colors = (0..5).map(|i| Vec4::splat(i as f32)).collect();
        primitive.drop_degenerate_triangles();
        primitive.make_flat();
        assert_eq!(primitive.indices, [0, 1, 2, 3, 4, 5]);
        assert_eq!(primitive.colors.iter().map(|c| c.x).collect::<Vec<_>>(), [0.0, 1.0, 2.0, 0.0, 2.0, 3.0]);
        assert_eq!(primitive.normals[..3], [Vec3::Z; 3]);
        let want = Vec3::new(1.0, -1.0, 1.0).normalize();
        assert!(primitive.normals[3..].iter().all(|n| n.abs_diff_eq(want, 1e-6)), "{:?}", primitive.normals);
    }

    #[test]
    fn normals_without_direction_are_recomputed_and_others_normalised() {
        let mut primitive = square();
        primitive.normals = vec![Vec3::Z * 3e-20, Vec3::ZERO, Vec3::Z * 1e30, Vec3::Z, Vec3::Z];
        primitive.drop_degenerate_triangles();
        assert_eq!(primitive.repair_normals(), 1);
        assert_eq!(primitive.normals, [Vec3::Z; 5]);
    }
}

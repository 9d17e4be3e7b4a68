//! Normals for meshes that bring none: smooth over faces that meet at a small angle, sharp elsewhere.

use glam::Vec3;
use std::collections::HashMap;

/// A mesh whose vertices are split where its surface has an edge.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Creased {
    /// For each new vertex, which of the given ones it copies.
    pub source: Vec<u32>,
    /// Unit length, one a new vertex.
    pub normals: Vec<Vec3>,
    /// Three a triangle, into the new vertices; as many triangles as given, in the same order.
    pub indices: Vec<u32>,
}

/// Faces around one point beyond which smoothing would take quadratic time; such a point keeps the normals of its faces.
const MAX_FACES_AROUND_A_POINT: usize = 256;

/// Computes normals of a triangle list. Two faces that share a point are smoothed there when their normals differ by at
/// most `crease` radians; faces count by their angle at the point (Thürmer and Wüthrich 1998), so that the result does
/// not depend on how a surface was cut into triangles. Points are shared by place, not by index.
///
/// Triangles without area take the normal +Y where no other face helps. Indices must be in range.
pub fn creased(positions: &[Vec3], indices: &[u32], crease: f32) -> Creased {
    let faces: Vec<Vec3> = indices
        .chunks_exact(3)
        .map(|t| {
            let [a, b, c] = [t[0], t[1], t[2]].map(|i| positions[i as usize]);
            (b - a).cross(c - a).normalize_or_zero()
        })
        .collect();
    let around = corners_by_point(positions, indices);
    let limit = crease.cos() - 1e-5;
    let mut normals = vec![Vec3::Y; indices.len()];
    for corners in around.values() {
        let weights: Vec<Vec3> =
            corners.iter().map(|&c| faces[c as usize / 3] * angle_at(positions, indices, c)).collect();
        for &corner in corners {
            let own = faces[corner as usize / 3];
            if corners.len() > MAX_FACES_AROUND_A_POINT {
                normals[corner as usize] = own;
                continue;
            }
            let near = |&(&other, _): &(&u32, &Vec3)| own == Vec3::ZERO || faces[other as usize / 3].dot(own) >= limit;
            let sum: Vec3 = corners.iter().zip(&weights).filter(near).map(|(_, weight)| *weight).sum();
            normals[corner as usize] = sum.try_normalize().unwrap_or(if own == Vec3::ZERO { Vec3::Y } else { own });
        }
    }
    weld(indices, &normals)
}

/// Corners (indices into the index list) that stand at the same place.
fn corners_by_point(positions: &[Vec3], indices: &[u32]) -> HashMap<[u32; 3], Vec<u32>> {
    let mut around: HashMap<[u32; 3], Vec<u32>> = HashMap::with_capacity(positions.len());
    for (corner, &index) in indices.iter().enumerate() {
        // Adding zero makes −0 and +0 the same place.
        let place = (positions[index as usize] + Vec3::ZERO).to_array().map(f32::to_bits);
        around.entry(place).or_default().push(corner as u32);
    }
    around
}

/// Angle of the face at this corner, radians.
fn angle_at(positions: &[Vec3], indices: &[u32], corner: u32) -> f32 {
    let first = corner / 3 * 3;
    let at = |i: u32| positions[indices[(first + (corner - first + i) % 3) as usize] as usize];
    let (p, q, r) = (at(0), at(1), at(2));
    (q - p).angle_between(r - p).max(0.0)
}

/// Shares vertices that agree in source and normal.
fn weld(indices: &[u32], normals: &[Vec3]) -> Creased {
    let mut out = Creased { indices: Vec::with_capacity(indices.len()), ..Creased::default() };
    let mut known: HashMap<(u32, [u32; 3]), u32> = HashMap::new();
    for (&index, &normal) in indices.iter().zip(normals) {
        let next = out.source.len() as u32;
        let vertex = *known.entry((index, normal.to_array().map(f32::to_bits))).or_insert_with(|| {
            out.source.push(index);
            out.normals.push(normal);
            next
        });
        out.indices.push(vertex);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cube of eight shared corners, outward.
    fn cube() -> (Vec<Vec3>, Vec<u32>) {
        let corner = |i: usize| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) * 2.0 - 1.0;
        let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let indices = quads.iter().flat_map(|&[a, b, c, d]| [a, b, c, a, c, d]).collect();
        ((0..8).map(corner).collect(), indices)
    }

    #[test]
    fn a_cube_is_sharp_below_ninety_degrees_and_round_above() {
        let (positions, indices) = cube();
        let sharp = creased(&positions, &indices, 1.0);
        assert_eq!(sharp.source.len(), 24);
        assert!(sharp.normals.iter().all(|n| n.abs().max_element() == 1.0));
        let round = creased(&positions, &indices, 1.6);
        assert_eq!(round.source.len(), 8);
        // By angle, all three faces count the same however the diagonals run.
        for (source, normal) in round.source.iter().zip(&round.normals) {
            assert!(normal.abs_diff_eq(positions[*source as usize].normalize(), 1e-5), "{normal}");
        }
    }

    #[test]
    fn a_sphere_gets_its_radial_normals() {
        let (n, m) = (48, 24);
        let point = |i: usize, j: usize| {
            let (phi, theta) =
                (i as f32 / n as f32 * std::f32::consts::TAU, j as f32 / m as f32 * std::f32::consts::PI);
            // All of a pole's vertices stand at exactly one place.
            let r = if j == m { 0.0 } else { theta.sin() };
            Vec3::new(r * phi.cos(), theta.cos(), -r * phi.sin())
        };
        // Vertices are not shared at all: places decide.
        let (mut positions, mut indices) = (Vec::new(), Vec::new());
        for i in 0..n {
            for j in 0..m {
                let (a, b, c, d) = (point(i, j), point(i, j + 1), point((i + 1) % n, j + 1), point((i + 1) % n, j));
                for p in [a, b, c, a, c, d] {
                    indices.push(positions.len() as u32);
                    positions.push(p);
                }
            }
        }
        let mesh = creased(&positions, &indices, 0.6);
        let worst = mesh.source.iter().zip(&mesh.normals).map(|(&s, n)| n.dot(positions[s as usize].normalize()));
        assert!(worst.fold(1.0, f32::min) > 0.995);
    }

    #[test]
    fn triangles_without_area_do_no_harm() {
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Z, Vec3::X];
        let mesh = creased(&positions, &[0, 2, 1, 0, 1, 3, 1, 1, 1], 0.5);
        assert!(mesh.normals.iter().all(|n| n.abs_diff_eq(Vec3::Y, 1e-6)), "{:?}", mesh.normals);
        assert_eq!(mesh.indices.len(), 9);
        assert_eq!(creased(&[Vec3::X], &[0, 0, 0], 0.5).normals, vec![Vec3::Y]);
        assert_eq!(creased(&[], &[], 0.5), Creased::default());
    }
}

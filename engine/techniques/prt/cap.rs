//! Directions of a cluster: equal cells of a spherical cap around the cluster's mean normal. The directions of all samples of a cluster are the
//! same, so that the columns of its matrix of depths belong together. Samples whose normal differs from the mean see below the
//! mean's horizon, so the cap is wider than a hemisphere by the largest difference. Twin: `shaders-glsl/prt/cap.glsl`.

use glam::{Mat3, Vec2, Vec3};

/// The cap of a cluster.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cap {
    /// Unit.
    pub axis: Vec3,
    /// Cosine of the largest angle to the axis.
    pub cos_most: f32,
    /// Cells along a side of the square that the concentric map makes of the cap.
    pub side: u32,
}

impl Cap {
    /// The cap that holds the hemispheres around these normals, with as many cells in a solid angle as a hemisphere with `directions` has.
    pub fn around(normals: impl Iterator<Item = Vec3> + Clone, directions: u32) -> Self {
        let sum: Vec3 = normals.clone().sum();
        let axis = sum.try_normalize().unwrap_or(Vec3::Y);
        let least = normals.map(|normal| normal.dot(axis)).fold(1.0f32, f32::min);
        // A hemisphere around a normal at an angle t from the axis reaches the angle t + 90° from the axis.
        let cos_most = if least <= 0.0 { -1.0 } else { -(1.0 - least * least).max(0.0).sqrt() };
        // Less than one cell beyond the horizon.
        let cos_most = if cos_most > -0.02 { 0.0 } else { cos_most };
        let side = (directions as f32 * (1.0 - cos_most)).sqrt().round().max(2.0) as u32;
        Self { axis, cos_most, side }
    }

    /// Number of directions.
    pub fn directions(&self) -> usize {
        (self.side * self.side) as usize
    }

    /// The direction in the middle of a cell.
    pub fn direction(&self, index: usize) -> Vec3 {
        let side = self.side.max(1);
        let at = Vec2::new((index as u32 % side) as f32, (index as u32 / side) as f32) + 0.5;
        let disc = concentric(at / side as f32);
        let square = disc.length_squared().min(1.0);
        let cosine = 1.0 - square * (1.0 - self.cos_most);
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let way = disc.normalize_or_zero() * sine;
        frame_around(self.axis) * way.extend(cosine)
    }
}

/// The point of the unit disc of a point of the unit square (Shirley and Chiu 1997).
fn concentric(uv: Vec2) -> Vec2 {
    use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};
    let p = 2.0 * uv - 1.0;
    let flat = p.x.abs() > p.y.abs();
    let r = if flat { p.x } else { p.y };
    if r == 0.0 {
        return Vec2::ZERO;
    }
    let phi = if flat { FRAC_PI_4 * (p.y / p.x) } else { FRAC_PI_2 - FRAC_PI_4 * (p.x / p.y) };
    r * Vec2::from_angle(phi)
}

/// An orthonormal frame whose third axis is `n` (Duff et al. 2017). Twin: `lib/sampling.glsl`.
fn frame_around(n: Vec3) -> Mat3 {
    let s = if n.z >= 0.0 { 1.0 } else { -1.0 };
    let a = -1.0 / (s + n.z);
    let b = n.x * n.y * a;
    Mat3::from_cols(Vec3::new(1.0 + s * n.x * n.x * a, s * b, -s * n.x), Vec3::new(b, s + n.y * n.y * a, -n.y), n)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flat_cluster_has_a_hemisphere_and_directions_are_even() {
        let cap = Cap::around([Vec3::X; 5].into_iter(), 2016);
        assert_eq!((cap.axis, cap.cos_most, cap.side), (Vec3::X, 0.0, 45));
        let mut cosines: Vec<f32> = (0..cap.directions()).map(|i| cap.direction(i).x).collect();
        assert!(cosines.iter().all(|c| (0.0..=1.0).contains(c)));
        // Equal areas: cosines are uniform, but all cells of a ring have the same one, and the outermost ring has 4 × 44 of them.
        let half_a_ring = 0.5 * 4.0 * 44.0 / 2025.0;
        cosines.sort_by(f32::total_cmp);
        let count = cosines.len() as f32;
        for (at, cosine) in cosines.iter().enumerate() {
            assert!((cosine - at as f32 / count).abs() < 1.02 * half_a_ring, "{at}: {cosine}");
        }
    }

    #[test]
    fn tilted_normals_widen_the_cap_and_opposite_ones_make_a_sphere() {
        let tilted = [Vec3::new(0.5, 0.75f32.sqrt(), 0.0), Vec3::new(-0.5, 0.75f32.sqrt(), 0.0)];
        let cap = Cap::around(tilted.into_iter(), 2016);
        assert!((cap.cos_most + 0.5).abs() < 1e-5 && cap.side == 55, "{cap:?}");
        for normal in tilted {
            let above = (0..cap.directions()).filter(|i| cap.direction(*i).dot(normal) > 0.0).count();
            assert!((above as f32 / 2016.0 - 1.0).abs() < 0.03, "{above}");
        }
        assert_eq!(Cap::around([Vec3::X, -Vec3::X].into_iter(), 100).cos_most, -1.0);
    }
}

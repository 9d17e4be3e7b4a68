//! Samples on the surface of an occluder, at the vertices of its triangles. Each sample stores the light that reaches
//! the vertex past the occluder itself.
//!
//! The thesis computes the shadow of an occluder on itself from the samples around the occluder, which also hold all
//! other shadows (section 3.3.3.2). These samples lie off the surface by as much as the distance of two spheres. From
//! such a position light behind the surface is visible and is subtracted, although [FIV 13] requires that everything
//! behind the receiver is hidden. The last chapter of the thesis proposes samples along the outline of the occluder
//! (figure 43), which are these samples. Only light in front of the surface is counted, so that [FIV 13] holds at every
//! edge and corner.

use glam::Vec3;

/// Distance of a sample from the surface, in radii of the bounding sphere.
const OVER: f32 = 5e-4;

/// A position with the normal of the half space whose light is summed up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Position relative to the centre of the occluder, metres.
    pub point: Vec3,
    /// Unit length; zero if no light is counted.
    pub normal: Vec3,
}

/// The samples of one primitive: the front sides of its vertices in their order, then the back sides, if they are
/// visible.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Own {
    /// Number of the primitive in the node's mesh.
    pub slot: u32,
    pub corners: u32,
    pub backs: bool,
}

impl Own {
    /// Number of samples.
    pub fn count(&self) -> u32 {
        self.corners * if self.backs { 2 } else { 1 }
    }
}

/// Appends the samples of a primitive. `radius`: radius of the bounding sphere, metres.
pub fn places(own: &Own, positions: &[Vec3], normals: &[Vec3], radius: f32, out: &mut Vec<Place>) {
    let sides: &[f32] = if own.backs { &[1.0, -1.0] } else { &[1.0] };
    for side in sides {
        for (i, position) in positions.iter().enumerate().take(own.corners as usize) {
            let normal = normals.get(i).copied().unwrap_or_default() * *side;
            let point = *position + normal * (OVER * radius);
            let good = point.is_finite() && normal.length_squared() > 0.5;
            out.push(if good { Place { point, normal } } else { Place { point: Vec3::ZERO, normal: Vec3::ZERO } });
        }
    }
}

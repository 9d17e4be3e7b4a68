//! Places on an occluder's own surface, where the light that it leaves itself is kept: the corners of its triangles.
//!
//! The thesis looks up an occluder's shadow on itself in the same samples around it as others' (section 3.3.3.2). Those lie over the
//! surface, by as much as spheres are apart: from there light behind the surface is seen, and taken away (eq. 13 holds only where
//! everything behind the receiver is hidden). Its last chapter asks for samples along the outline of the occluder (figure 43): that is
//! what these are. Only light in front of the surface is counted, so that eq. 13 holds at every edge and corner too.

use glam::Vec3;

/// Distance of a place from the surface, in radii of the bounding sphere.
const OVER: f32 = 5e-4;

/// Where light is summed up: in front of a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Seen from the centre of the occluder, metres.
    pub point: Vec3,
    /// Unit length; zero: no light is counted.
    pub normal: Vec3,
}

/// The places of one primitive: those of its corners' fronts, in their order, then those of their backs, if they can be seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Own {
    /// Of the node's mesh.
    pub slot: u32,
    pub corners: u32,
    pub backs: bool,
}

impl Own {
    /// Places.
    pub fn count(&self) -> u32 {
        self.corners * if self.backs { 2 } else { 1 }
    }
}

/// Appends the places of a primitive. `radius`: of the bounding sphere, metres.
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

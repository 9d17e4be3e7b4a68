//! Bounds and frustum culling on the CPU.

use crate::scene::view::View;
use glam::{Mat4, Vec3, Vec4};

/// Axis-aligned box. Empty while `min > max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    pub min: Vec3,
    pub max: Vec3,
}

impl Default for Aabb {
    fn default() -> Self {
        Self::EMPTY
    }
}

impl Aabb {
    /// Contains nothing.
    pub const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// The smallest box around `points`.
    pub fn of(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, Self::with)
    }

    /// The smallest box around `self` and a point.
    #[must_use]
    pub fn with(self, point: Vec3) -> Self {
        Self { min: self.min.min(point), max: self.max.max(point) }
    }

    /// The smallest box around both.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Grown by `by` metres on every side.
    #[must_use]
    pub fn grown(self, by: f32) -> Self {
        Self { min: self.min - by, max: self.max + by }
    }

    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// Neither empty nor unbounded.
    pub fn is_finite(&self) -> bool {
        !self.is_empty() && self.min.is_finite() && self.max.is_finite()
    }

    pub fn centre(&self) -> Vec3 {
        0.5 * (self.min + self.max)
    }

    /// Half the diagonal as a vector.
    pub fn half(&self) -> Vec3 {
        0.5 * (self.max - self.min)
    }

    pub fn corners(&self) -> [Vec3; 8] {
        std::array::from_fn(|i| {
            let pick = |axis: usize| if i >> axis & 1 == 0 { self.min[axis] } else { self.max[axis] };
            Vec3::new(pick(0), pick(1), pick(2))
        })
    }

    /// A box around the image of this box under an affine transform; empty stays empty.
    #[must_use]
    pub fn transformed(&self, matrix: &Mat4) -> Self {
        if self.is_empty() {
            return *self;
        }
        let (centre, half) = (matrix.transform_point3(self.centre()), self.half());
        let reach = matrix.x_axis.truncate().abs() * half.x
            + matrix.y_axis.truncate().abs() * half.y
            + matrix.z_axis.truncate().abs() * half.z;
        Self { min: centre - reach, max: centre + reach }
    }
}

/// A convex region: planes with their inner side positive.
#[derive(Clone, Copy, Debug)]
pub struct Frustum {
    planes: [Vec4; 6],
}

impl Frustum {
    /// What `view` can show.
    pub fn new(view: &View) -> Self {
        Self::from_clip(&view.clip_from_world)
    }

    /// The points that `clip_from_world` brings into −w ≤ x, y ≤ w, 0 ≤ z ≤ w.
    pub fn from_clip(clip_from_world: &Mat4) -> Self {
        let [x, y, z, w] = std::array::from_fn(|i| clip_from_world.row(i));
        Self { planes: [w + x, w - x, w + y, w - y, z, w - z] }
    }

    /// Could any point of the box lie inside? Never false when one does (rounding is on the side of yes); may be true when
    /// none does.
    pub fn sees(&self, bounds: &Aabb) -> bool {
        if bounds.is_empty() {
            return false;
        }
        if !bounds.is_finite() {
            return true;
        }
        let (centre, half) = (bounds.centre(), bounds.half());
        self.planes.iter().all(|plane| {
            let normal = plane.truncate();
            let (at, reach) = (normal.dot(centre) + plane.w, normal.abs().dot(half));
            // Sums of products of this size carry errors of a few units in the last place.
            let slack = 1e-5 * (normal.abs().dot(centre.abs() + half) + plane.w.abs());
            at + reach + slack >= 0.0
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Camera, Projection};
    use proptest::prelude::*;

    fn vec3(range: std::ops::Range<f32>) -> impl Strategy<Value = Vec3> {
        [range.clone(), range.clone(), range].prop_map(Vec3::from_array)
    }

    fn view(orthographic: bool, at: Vec3, yaw: f32, pitch: f32) -> View {
        let projection = if orthographic {
            Projection::Orthographic { xmag: 4.0, ymag: 3.0, znear: 0.0, zfar: 60.0 }
        } else {
            Projection::Perspective { yfov: 0.8, aspect: None, znear: 0.1, zfar: Some(60.0) }
        };
        let world = Mat4::from_translation(at) * Mat4::from_rotation_y(yaw) * Mat4::from_rotation_x(pitch);
        View::new(&Camera { name: String::new(), projection }, world, [320, 240])
    }

    proptest! {
        // Brute force: a box that holds a visible point is never culled.
        #[test]
        fn never_culls_what_is_visible(
            orthographic: bool, at in vec3(-10.0..10.0), yaw in -3.2f32..3.2, pitch in -1.5f32..1.5,
            uv in [0.0f32..1.0, 0.0f32..1.0], z in 0.01f32..1.0,
            inside in vec3(0.0..1.0), size in vec3(0.0..30.0),
        ) {
            let view = view(orthographic, at, yaw, pitch);
            let visible = view.world_from_depth(uv.into(), z.max(view.near / view.far));
            let min = visible - inside * size;
            let bounds = Aabb { min, max: min + size }.with(visible);
            prop_assert!(Frustum::new(&view).sees(&bounds));
        }

        // And it does cull: a small ball outside every face by more than its radius is gone.
        #[test]
        fn culls_what_is_behind(at in vec3(-10.0..10.0), yaw in -3.2f32..3.2, distance in 0.5f32..50.0) {
            let view = view(false, at, yaw, 0.0);
            let behind = view.position - view.axes()[2] * distance;
            let bounds = Aabb { min: behind, max: behind }.grown(0.1);
            prop_assert!(!Frustum::new(&view).sees(&bounds));
        }

        #[test]
        fn a_transformed_box_holds_its_transformed_points(
            min in vec3(-5.0..5.0), size in vec3(0.0..5.0), t in vec3(0.0..1.0),
            scale in vec3(-3.0..3.0), yaw in -3.0f32..3.0, shift in vec3(-9.0..9.0),
        ) {
            let bounds = Aabb { min, max: min + size };
            let m = Mat4::from_translation(shift) * Mat4::from_rotation_y(yaw) * Mat4::from_scale(scale);
            let p = m.transform_point3(min + t * size);
            let out = bounds.transformed(&m).grown(1e-3);
            prop_assert!(out.min.cmple(p).all() && p.cmple(out.max).all());
        }
    }

    #[test]
    fn empty_boxes_are_never_seen_and_unbounded_ones_always() {
        let frustum = Frustum::new(&view(false, Vec3::ZERO, 0.0, 0.0));
        assert!(!frustum.sees(&Aabb::EMPTY));
        assert!(frustum.sees(&Aabb { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY }));
    }
}

//! The camera of a frame: matrices, and the far-plane vectors that give a world position from linear depth without any.

use crate::{
    Error, Result,
    scene::{Camera, Pose, Projection, Scene, cull::Aabb},
    shaders,
};
use glam::{Mat4, Vec2, Vec3, Vec4};

/// Far plane, metres, of a camera that has none and whose scene is not known ([`View::fit_far`]).
pub const DEFAULT_FAR: f32 = 10_000.0;

/// A camera at a place, for an image of a given size.
///
/// Right-handed, +Y up, looking down −Z. Clip space has +Y up and reversed depth: 1 at `near`, 0 at `far`.
/// Linear depth is eye distance / `far`, in (0, 1].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    pub view_from_world: Mat4,
    pub clip_from_view: Mat4,
    pub clip_from_world: Mat4,
    /// Of the camera, metres.
    pub position: Vec3,
    /// Metres along the axis.
    pub near: f32,
    /// Metres along the axis at which linear depth is 1. Always finite: geometry beyond is not drawn.
    pub far: f32,
    /// Pixels.
    pub extent: [u32; 2],
    projection: Projection,
    /// Where each pixel looks, from its middle to the right and down, pixels.
    shift: Vec2,
}

impl View {
    /// A view of `extent` pixels through `camera`, which stands at `world_from_camera` (its scale is ignored).
    ///
    /// Pixels are square: the vertical field of view is the camera's, the horizontal one follows from `extent`.
    /// A camera without a far plane gets [`DEFAULT_FAR`]; call [`View::fit_far`] when the scene's bounds are known.
    pub fn new(camera: &Camera, world_from_camera: Mat4, extent: [u32; 2]) -> Self {
        let mut view = Self {
            view_from_world: rigid_inverse(world_from_camera),
            clip_from_view: Mat4::IDENTITY,
            clip_from_world: Mat4::IDENTITY,
            position: world_from_camera.w_axis.truncate(),
            near: 0.0,
            far: 0.0,
            extent: extent.map(|e| e.max(1)),
            projection: camera.projection,
            shift: Vec2::ZERO,
        };
        let (near, far) = match camera.projection {
            Projection::Perspective { znear, zfar, .. } => (znear, zfar.unwrap_or(DEFAULT_FAR)),
            Projection::Orthographic { znear, zfar, .. } => (znear, zfar),
        };
        view.set_range(near, far);
        view
    }

    /// The view through the scene's camera number `camera`, where the first node that carries it stands in `pose`.
    ///
    /// # Errors
    /// `Usage` if the scene has no such camera or no node carries it.
    pub fn of_camera(scene: &Scene, pose: &Pose, camera: usize, extent: [u32; 2]) -> Result<Self> {
        let there = scene.cameras.len();
        let missing = || Error::usage(format!("there is no camera {camera}; the scene has {there}"));
        let found = scene.cameras.get(camera).ok_or_else(missing)?;
        let node = scene.nodes.iter().position(|node| node.camera == Some(camera as u32));
        let world = node
            .and_then(|node| pose.world.get(node))
            .ok_or_else(|| Error::usage(format!("camera {camera} stands nowhere: no node carries it")))?;
        Ok(Self::new(found, *world, extent))
    }

    /// Moves an infinite far plane to just behind `bounds`, so that linear depth has one scale for near and far scenes.
    /// A far plane that the camera itself states stays.
    #[must_use]
    pub fn fit_far(mut self, bounds: &Aabb) -> Self {
        if matches!(self.projection, Projection::Perspective { zfar: None, .. }) && bounds.is_finite() {
            let distance = |p: Vec3| -self.view_from_world.transform_point3(p).z;
            let farthest = bounds.corners().into_iter().map(distance).fold(0.0, f32::max);
            self.set_range(self.near, farthest * 1.01);
        }
        self
    }

    /// The same view with another far plane, metres.
    #[must_use]
    pub fn with_far(mut self, far: f32) -> Self {
        self.set_range(self.near, far);
        self
    }

    /// The same camera with the tangents of its angles of view (orthographic: its size) times `factor`, for an image of `extent`
    /// pixels. Angles stop short of 180°.
    #[must_use]
    pub fn wider(mut self, factor: f32, extent: [u32; 2]) -> Self {
        match &mut self.projection {
            Projection::Perspective { yfov, .. } => *yfov = 2.0 * ((0.5 * yfov.clamp(1e-3, 3.1)).tan() * factor).atan(),
            Projection::Orthographic { ymag, .. } => *ymag *= factor,
        }
        self.extent = extent.map(|e| e.max(1));
        self.set_range(self.near, self.far);
        self
    }

    /// The same camera, moved to its right by `metres`.
    #[must_use]
    pub fn beside(mut self, metres: f32) -> Self {
        let [right, up, forward] = self.axes();
        self.position += metres * right;
        let axes = [right, up, -forward].map(|axis| axis.extend(0.0));
        self.view_from_world = rigid_inverse(Mat4::from_cols(axes[0], axes[1], axes[2], self.position.extend(1.0)));
        self.clip_from_world = self.clip_from_view * self.view_from_world;
        self
    }

    /// The same camera, whose pixels look at the place `pixels` away from their middles, to the right and down. For anti-aliasing by the mean of several
    /// images.
    #[must_use]
    pub fn shifted(mut self, pixels: Vec2) -> Self {
        self.shift = pixels;
        self.set_range(self.near, self.far);
        self
    }

    /// Where each pixel looks, from its middle to the right and down, pixels ([`Self::shifted`]).
    pub fn shift(&self) -> Vec2 {
        self.shift
    }

    /// The shift as a part of the image, x to the right and y down.
    fn shift_uv(&self) -> Vec2 {
        self.shift / Vec2::new(self.extent[0] as f32, self.extent[1] as f32)
    }

    fn set_range(&mut self, near: f32, far: f32) {
        self.near = if near.is_finite() { near } else { 0.01 };
        if matches!(self.projection, Projection::Perspective { .. }) {
            self.near = self.near.max(1e-6);
        }
        // Room between the planes even for a scene behind the camera.
        let least = self.near.abs() * 1.001 + 1e-4;
        self.far = if far.is_finite() { far.max(self.near + least) } else { DEFAULT_FAR.max(self.near + least) };
        let half = self.half_extent();
        self.clip_from_view = match self.projection {
            Projection::Perspective { .. } => perspective(half, self.near, self.far),
            Projection::Orthographic { .. } => orthographic(half, self.near, self.far),
        };
        if self.shift != Vec2::ZERO {
            let uv = self.shift_uv();
            self.clip_from_view = Mat4::from_translation(Vec3::new(-2.0 * uv.x, 2.0 * uv.y, 0.0)) * self.clip_from_view;
        }
        self.clip_from_world = self.clip_from_view * self.view_from_world;
    }

    /// Half width and height of the image at unit distance (perspective) or in metres (orthographic).
    fn half_extent(&self) -> Vec2 {
        let aspect = self.extent[0] as f32 / self.extent[1] as f32;
        let y = match self.projection {
            Projection::Perspective { yfov, .. } => (0.5 * yfov.clamp(1e-3, 3.1)).tan(),
            Projection::Orthographic { ymag, .. } => ymag.abs().max(1e-6),
        };
        Vec2::new(y * aspect, y)
    }

    /// Are rays parallel?
    pub fn is_orthographic(&self) -> bool {
        matches!(self.projection, Projection::Orthographic { .. })
    }

    /// World-space unit vectors to the right, upwards and along the line of sight.
    pub fn axes(&self) -> [Vec3; 3] {
        let m = self.view_from_world;
        [m.row(0).truncate(), m.row(1).truncate(), -m.row(2).truncate()]
    }

    /// As the shaders see it (`lib/view.glsl`).
    pub fn uniform(&self) -> shaders::types::View {
        let [right, up, forward] = self.axes();
        let half = self.half_extent();
        let (x, y) = (right * half.x, up * half.y);
        let uv = self.shift_uv();
        let aside = 2.0 * (uv.x * x - uv.y * y);
        let mut out = shaders::types::View {
            view_from_world: self.view_from_world.to_cols_array_2d(),
            clip_from_view: self.clip_from_view.to_cols_array_2d(),
            clip_from_world: self.clip_from_world.to_cols_array_2d(),
            position: self.position.to_array(),
            near: self.near,
            far: self.far,
            orthographic: u32::from(self.is_orthographic()),
            pixel_angle: 2.0 * half.y / self.extent[1] as f32,
            base_o: self.position.to_array(),
            extent: self.extent.map(|e| e as f32),
            ..Default::default()
        };
        let far = self.far;
        if self.is_orthographic() {
            out.base_o = (self.position - x + y + aside).to_array();
            out.base_u = (2.0 * x).to_array();
            out.base_v = (-2.0 * y).to_array();
            out.frustum_o = (forward * far).to_array();
        } else {
            out.frustum_o = ((forward - x + y + aside) * far).to_array();
            out.frustum_u = (2.0 * x * far).to_array();
            out.frustum_v = (-2.0 * y * far).to_array();
        }
        out
    }

    /// World position of linear depth `z` (eye distance / far) at `uv` (0..1, y down), as `world_from_depth` in GLSL.
    pub fn world_from_depth(&self, uv: Vec2, z: f32) -> Vec3 {
        let u = self.uniform();
        let v = |a: [f32; 3]| Vec3::from_array(a);
        let base = v(u.base_o) + uv.x * v(u.base_u) + uv.y * v(u.base_v);
        base + (v(u.frustum_o) + uv.x * v(u.frustum_u) + uv.y * v(u.frustum_v)) * z
    }
}

/// `clip_from_view` with reversed depth; `half`: tangents of half the angles of view.
pub(crate) fn perspective(half: Vec2, near: f32, far: f32) -> Mat4 {
    let depth = far - near;
    Mat4::from_cols(
        Vec4::new(1.0 / half.x, 0.0, 0.0, 0.0),
        Vec4::new(0.0, 1.0 / half.y, 0.0, 0.0),
        Vec4::new(0.0, 0.0, near / depth, -1.0),
        Vec4::new(0.0, 0.0, near * far / depth, 0.0),
    )
}

/// `clip_from_view` with reversed depth; `half`: half the width and height, metres.
pub(crate) fn orthographic(half: Vec2, near: f32, far: f32) -> Mat4 {
    let depth = far - near;
    Mat4::from_cols(
        Vec4::new(1.0 / half.x, 0.0, 0.0, 0.0),
        Vec4::new(0.0, 1.0 / half.y, 0.0, 0.0),
        Vec4::new(0.0, 0.0, 1.0 / depth, 0.0),
        Vec4::new(0.0, 0.0, far / depth, 1.0),
    )
}

/// `view_from_world` at `at`, looking along a unit vector; which way is up is not specified.
pub(crate) fn looking_along(at: Vec3, along: Vec3) -> Mat4 {
    let right = along.any_orthonormal_vector();
    let up = right.cross(along);
    rigid_inverse(Mat4::from_cols(right.extend(0.0), up.extend(0.0), (-along).extend(0.0), at.extend(1.0)))
}

/// Inverse of the rotation and translation in `world_from_camera`; scale, shear and mirroring are dropped.
fn rigid_inverse(world_from_camera: Mat4) -> Mat4 {
    let back = world_from_camera.z_axis.truncate().try_normalize().unwrap_or(Vec3::Z);
    let up = world_from_camera.y_axis.truncate();
    let right = up.cross(back).try_normalize().unwrap_or_else(|| back.any_orthonormal_vector());
    let up = back.cross(right);
    let at = world_from_camera.w_axis.truncate();
    Mat4::from_cols(right.extend(0.0), up.extend(0.0), back.extend(0.0), at.extend(1.0)).inverse()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec4Swizzles;
    use proptest::prelude::*;

    fn camera(orthographic: bool, zfar: Option<f32>) -> Camera {
        let projection = if orthographic {
            Projection::Orthographic { xmag: 3.0, ymag: 2.0, znear: 0.5, zfar: zfar.unwrap_or(40.0) }
        } else {
            Projection::Perspective { yfov: 0.9, aspect: None, znear: 0.1, zfar }
        };
        Camera { name: String::new(), projection }
    }

    fn somewhere() -> Mat4 {
        Mat4::from_rotation_translation(
            glam::Quat::from_euler(glam::EulerRot::YXZ, 0.7, -0.4, 0.2),
            Vec3::new(3.0, -2.0, 5.0),
        )
    }

    #[test]
    fn depth_is_one_at_near_and_zero_at_far_and_up_is_up() {
        for orthographic in [false, true] {
            let view = View::new(&camera(orthographic, Some(40.0)), somewhere(), [640, 480]);
            let [right, up, forward] = view.axes();
            let clip = |p: Vec3| {
                let c = view.clip_from_world * p.extend(1.0);
                c.xyz() / c.w
            };
            assert!((clip(view.position + forward * view.near).z - 1.0).abs() < 1e-4);
            assert!(clip(view.position + forward * view.far).z.abs() < 1e-4);
            let centre = view.position + forward * 2.0;
            assert!(clip(centre + up * 0.1).y > 0.0);
            assert!(clip(centre + right * 0.1).x > 0.0);
        }
    }

    #[test]
    fn a_pixel_of_a_shifted_view_shows_what_is_beside_its_middle() {
        for orthographic in [false, true] {
            let view = View::new(&camera(orthographic, Some(40.0)), somewhere(), [64, 48]);
            let shifted = view.shifted(Vec2::new(0.3, -0.4));
            let extent = Vec2::new(64.0, 48.0);
            let pixel = Vec2::new(17.5, 30.5);
            let beside = view.world_from_depth((pixel + Vec2::new(0.3, -0.4)) / extent, 0.2);
            assert!(shifted.world_from_depth(pixel / extent, 0.2).distance(beside) < 1e-5);
            let clip = shifted.clip_from_world * beside.extend(1.0);
            let uv = Vec2::new(0.5 + 0.5 * clip.x / clip.w, 0.5 - 0.5 * clip.y / clip.w);
            assert!((uv * extent).distance(pixel) < 1e-3, "{uv}");
            assert_eq!(shifted.with_far(50.0).shifted(Vec2::ZERO), view.with_far(50.0));
        }
    }

    #[test]
    fn a_scaled_or_mirrored_camera_node_is_only_a_place() {
        let plain = View::new(&camera(false, None), somewhere(), [64, 48]);
        let scaled = View::new(&camera(false, None), somewhere() * Mat4::from_scale(Vec3::splat(3.0)), [64, 48]);
        assert!(plain.view_from_world.abs_diff_eq(scaled.view_from_world, 1e-5));
    }

    #[test]
    fn an_infinite_far_plane_goes_behind_the_scene_and_a_stated_one_stays() {
        let bounds = Aabb { min: Vec3::splat(-100.0), max: Vec3::splat(100.0) };
        let view = View::new(&camera(false, None), Mat4::IDENTITY, [64, 48]).fit_far(&bounds);
        assert!((view.far - 101.0).abs() < 1e-3);
        let view = View::new(&camera(false, Some(20.0)), Mat4::IDENTITY, [64, 48]).fit_far(&bounds);
        assert_eq!(view.far, 20.0);
    }

    #[test]
    fn absurd_cameras_give_finite_matrices() {
        for (yfov, znear, zfar) in [(0.0, 0.0, Some(0.0)), (f32::NAN, f32::NAN, Some(f32::NAN)), (7.0, -1.0, None)] {
            let projection = Projection::Perspective { yfov, aspect: Some(0.0), znear, zfar };
            let view = View::new(&Camera { name: String::new(), projection }, Mat4::ZERO, [0, 0]);
            assert!(yfov.is_nan() || view.clip_from_world.is_finite(), "{view:?}");
            assert!(view.far > view.near);
        }
    }

    proptest! {
        // Position reconstruction against the matrices (the dissertation's section 4.3 against its matrix variant).
        #[test]
        fn reconstruction_agrees_with_the_inverse_matrix(
            orthographic: bool, x in 0.0f32..1.0, y in 0.0f32..1.0, distance in 0.6f32..39.0,
            right in -1.0f32..1.0, down in -1.0f32..1.0,
        ) {
            let view = View::new(&camera(orthographic, Some(40.0)), somewhere(), [1024, 768]).shifted(Vec2::new(right, down));
            let point = view.world_from_depth(Vec2::new(x, y), distance / view.far);
            let eye = view.view_from_world.transform_point3(point);
            prop_assert!((-eye.z - distance).abs() < 1e-4 * distance.max(1.0));
            let clip = view.clip_from_world * point.extend(1.0);
            let ndc = clip.xyz() / clip.w;
            prop_assert!((ndc.x - (2.0 * x - 1.0)).abs() < 2e-4);
            prop_assert!((ndc.y - (1.0 - 2.0 * y)).abs() < 2e-4);
            let back = view.clip_from_world.as_dmat4().inverse() * ndc.extend(1.0).as_dvec4();
            let back = (back.xyz() / back.w).as_vec3();
            prop_assert!(back.distance(point) < 2e-3 * distance.max(1.0), "{} {}", back, point);
        }
    }
}

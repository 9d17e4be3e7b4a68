//! G-buffers made by casting one ray a texel at a few parallelograms: inputs for image-space radiosity whose light can be
//! computed in closed form.

use glam::DVec3;
use std::f64::consts::PI;

/// A perspective camera.
#[derive(Clone, Copy, Debug)]
pub struct Eye {
    pub position: DVec3,
    /// Unit vectors.
    pub right: DVec3,
    pub up: DVec3,
    pub forward: DVec3,
    /// Half the image's width and height at distance one.
    pub tan_x: f64,
    pub tan_y: f64,
    /// Metres at which linear depth is 1.
    pub far: f64,
    /// Pixels.
    pub width: usize,
    pub height: usize,
}

impl Eye {
    /// At `position`, looking at `target`, +Y up; `yfov` is the full vertical angle in radians.
    pub fn look_at(position: DVec3, target: DVec3, yfov: f64, far: f64, width: usize, height: usize) -> Self {
        let forward = (target - position).normalize();
        let right = forward.cross(DVec3::Y).normalize();
        let tan_y = (yfov / 2.0).tan();
        let tan_x = tan_y * width as f64 / height as f64;
        Self { position, right, up: right.cross(forward), forward, tan_x, tan_y, far, width, height }
    }

    /// Through image coordinates (0..1, y down); advances one metre along the axis.
    pub fn ray(&self, u: f64, v: f64) -> DVec3 {
        self.forward + self.right * self.tan_x * (2.0 * u - 1.0) + self.up * self.tan_y * (1.0 - 2.0 * v)
    }

    /// Where linear depth `z` (distance along the axis / far) lies.
    pub fn position_at(&self, u: f64, v: f64, z: f64) -> DVec3 {
        self.position + self.ray(u, v) * z * self.far
    }
}

/// A parallelogram `corner + s·a + t·b`, s and t in 0..1; its front is where `a × b` points.
#[derive(Clone, Copy, Debug)]
pub struct Patch {
    pub corner: DVec3,
    pub a: DVec3,
    pub b: DVec3,
    pub albedo: DVec3,
    /// What it sends: W/(sr·m²).
    pub radiance: DVec3,
}

impl Patch {
    pub fn normal(&self) -> DVec3 {
        self.a.cross(self.b).normalize()
    }

    /// Where a ray meets it, in lengths of `direction`.
    pub fn hit(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        let normal = self.a.cross(self.b);
        let t = normal.dot(self.corner - origin) / normal.dot(direction);
        let local = origin + direction * t - self.corner;
        let s = local.cross(self.b).dot(normal) / normal.length_squared();
        let r = self.a.cross(local).dot(normal) / normal.length_squared();
        ((0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&r) && t > 0.0).then_some(t)
    }

    /// Radiance / π-normalised irradiance (what a white Lambertian receiver reflects) at `p` with normal `n` from the whole
    /// patch, by Lambert's formula for polygons. The patch must lie wholly above the receiver's horizon.
    pub fn reflected_by_white(&self, p: DVec3, n: DVec3) -> DVec3 {
        let corners = [self.corner, self.corner + self.a, self.corner + self.a + self.b, self.corner + self.b];
        let directions = corners.map(|c| (c - p).normalize());
        let mut total = 0.0;
        for i in 0..4 {
            let (u, v) = (directions[i], directions[(i + 1) % 4]);
            total += u.dot(v).clamp(-1.0, 1.0).acos() * u.cross(v).normalize_or_zero().dot(n);
        }
        // Seen from its front, the corners run clockwise.
        self.radiance * (-total / (2.0 * PI)).max(0.0)
    }
}

/// What the G-buffer holds, row-major, at full or half resolution.
#[derive(Clone, Debug, Default)]
pub struct Buffers {
    pub width: usize,
    pub height: usize,
    /// Pixels that a texel covers along each side.
    pub factor: f64,
    pub albedo: Vec<DVec3>,
    /// Radiation mask.
    pub mask: Vec<f64>,
    /// World, any length.
    pub normal: Vec<DVec3>,
    /// Linear depth / far; background 1.
    pub depth: Vec<f64>,
    /// Radiance that a texel sends.
    pub sender: Vec<DVec3>,
}

impl Buffers {
    /// One ray through the centre of each texel of `factor` × `factor` pixels.
    pub fn cast(eye: &Eye, patches: &[Patch], factor: usize) -> Self {
        let (width, height) = (eye.width.div_ceil(factor), eye.height.div_ceil(factor));
        let mut out = Self { width, height, factor: factor as f64, ..Self::default() };
        for y in 0..height {
            for x in 0..width {
                let (u, v) = out.uv(eye, x, y);
                let direction = eye.ray(u, v);
                let hit = patches
                    .iter()
                    .filter_map(|patch| patch.hit(eye.position, direction).map(|t| (t, patch)))
                    .filter(|(t, _)| *t < eye.far)
                    .min_by(|a, b| a.0.total_cmp(&b.0));
                out.depth.push(hit.map_or(1.0, |(t, _)| t / eye.far));
                out.albedo.push(hit.map_or(DVec3::ZERO, |(_, p)| p.albedo));
                out.normal.push(hit.map_or(DVec3::ZERO, |(_, p)| p.normal()));
                out.sender.push(hit.map_or(DVec3::ZERO, |(_, p)| p.radiance));
                out.mask.push(if hit.is_some() { 1.0 } else { 0.0 });
            }
        }
        out
    }

    /// Index of a texel.
    pub fn at(&self, x: usize, y: usize) -> usize {
        y * self.width + x
    }

    /// Image coordinates of a texel's centre.
    pub fn uv(&self, eye: &Eye, x: usize, y: usize) -> (f64, f64) {
        ((x as f64 + 0.5) * self.factor / eye.width as f64, (y as f64 + 0.5) * self.factor / eye.height as f64)
    }

    /// World position of a texel.
    pub fn position(&self, eye: &Eye, x: usize, y: usize) -> DVec3 {
        let (u, v) = self.uv(eye, x, y);
        eye.position_at(u, v, self.depth[self.at(x, y)])
    }

    /// m² of a texel on a plane that faces the camera axis at linear depth z.
    pub fn facing_area(&self, eye: &Eye, z: f64) -> f64 {
        let width = 2.0 * eye.tan_x * z * eye.far * self.factor / eye.width as f64;
        let height = 2.0 * eye.tan_y * z * eye.far * self.factor / eye.height as f64;
        width * height
    }

    /// m² of the surface that a texel sees: its solid angle times r² over the cosine at the surface, which is limited to a
    /// twentieth of the cosine at the camera.
    pub fn footprint(&self, eye: &Eye, x: usize, y: usize) -> f64 {
        let (u, v) = self.uv(eye, x, y);
        let i = self.at(x, y);
        let ray = eye.ray(u, v).normalize();
        let cos_axis = ray.dot(eye.forward);
        let cos_surface = ray.dot(self.normal[i].normalize()).abs();
        self.facing_area(eye, self.depth[i]) * cos_axis / cos_surface.max(0.05 * cos_axis)
    }
}

//! Light from infinity: latitude-longitude images, cubes, and reading them from files.
//!
//! Conventions: +Y up; the centre of a latitude-longitude image looks down −Z, u grows to the right (towards +X at the
//! centre), the top row looks up. Cube faces are pictures as seen from the inside, not mirrored ([`Face`]).

mod cube;
mod read;

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use super::Environment;

pub use cube::{Cube, Face};
pub use read::{decode, from_picture, load};

/// Unit direction of a point of a latitude-longitude image; `uv` in [0, 1]², v = 0 at the top.
pub fn direction_from_uv(uv: Vec2) -> Vec3 {
    let (azimuth, polar) = ((uv.x - 0.5) * 2.0 * PI, uv.y * PI);
    Vec3::new(polar.sin() * azimuth.sin(), polar.cos(), -polar.sin() * azimuth.cos())
}

/// The inverse of [`direction_from_uv`] for any vector but zero; u in [0, 1).
pub fn uv_from_direction(direction: Vec3) -> Vec2 {
    let azimuth = direction.x.atan2(-direction.z);
    // More precise at the poles than the arc cosine of y.
    let polar = direction.x.hypot(direction.z).atan2(direction.y);
    let u = azimuth / (2.0 * PI) + 0.5;
    Vec2::new(if u >= 1.0 { u - 1.0 } else { u }, polar / PI)
}

/// Solid angle in steradians of each pixel in a row of a latitude-longitude image, exactly.
pub fn solid_angle(width: u32, height: u32, row: u32) -> f64 {
    let latitude = |row: u32| (std::f64::consts::PI * f64::from(row) / f64::from(height)).cos();
    2.0 * std::f64::consts::PI / f64::from(width) * (latitude(row) - latitude(row + 1))
}

impl Environment {
    /// The same radiance from everywhere, W/(sr·m²).
    pub fn constant(radiance: Vec3) -> Self {
        Self { name: "constant".into(), width: 2, height: 1, pixels: vec![radiance; 2], rotation: 0.0, scale: 1.0 }
    }

    /// Radiance from a world-space direction, W/(sr·m²): bilinear, around the seam and over the poles, with the
    /// rotation and the scale of the environment.
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        // The environment turns by `rotation`, so the direction is looked up turned back.
        let uv = uv_from_direction(glam::Quat::from_rotation_y(-self.rotation) * direction);
        self.bilinear(uv) * self.scale
    }

    /// Mean radiance over the sphere, W/(sr·m²).
    pub fn mean(&self) -> Vec3 {
        let mut sum = glam::DVec3::ZERO;
        for (row, pixels) in self.pixels.chunks_exact(self.width.max(1) as usize).enumerate() {
            let row_sum: glam::DVec3 = pixels.iter().map(|p| p.as_dvec3()).sum();
            sum += row_sum * solid_angle(self.width, self.height, row as u32);
        }
        (sum / (4.0 * std::f64::consts::PI)).as_vec3() * self.scale
    }

    /// Bytes in this process's memory.
    pub fn host_bytes(&self) -> u64 {
        self.pixels.len() as u64 * size_of::<Vec3>() as u64
    }

    /// Bytes on the device as 16-bit RGBA without mip levels.
    pub fn device_bytes(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height) * 8
    }

    pub(crate) fn bilinear(&self, uv: Vec2) -> Vec3 {
        let (w, h) = (self.width as i64, self.height as i64);
        let x = f64::from(uv.x) * w as f64 - 0.5;
        let y = f64::from(uv.y) * h as f64 - 0.5;
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = ((x - x0) as f32, (y - y0) as f32);
        let (x0, y0) = (x0 as i64, y0 as i64);
        let at = |x: i64, y: i64| {
            // Beyond a pole lies the same row, half a turn away.
            let (x, y) = match y {
                y if y < 0 => (x + w / 2, -1 - y),
                y if y >= h => (x + w / 2, 2 * h - 1 - y),
                y => (x, y),
            };
            self.pixels.get((y * w + x.rem_euclid(w)) as usize).copied().unwrap_or_default()
        };
        let top = at(x0, y0).lerp(at(x0 + 1, y0), fx);
        top.lerp(at(x0, y0 + 1).lerp(at(x0 + 1, y0 + 1), fx), fy)
    }
}

#[cfg(test)]
mod tests;

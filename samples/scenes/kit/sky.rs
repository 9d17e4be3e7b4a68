//! Environments: a clear sky over ground, and a uniform one.

use glam::Vec3;
use lucerna::scene::Environment;
use std::f32::consts::{PI, TAU};

/// A clear sky without its sun disc (the sun is a directional light), over even ground. Radiance, W/(sr·m²).
#[derive(Clone, Copy, Debug)]
pub(crate) struct GradientSky {
    pub zenith: Vec3,
    pub horizon: Vec3,
    pub ground: Vec3,
    /// Direction towards the sun.
    pub to_sun: Vec3,
    /// Radiance that the glow around the sun adds at its centre.
    pub glow: Vec3,
}

impl GradientSky {
    /// Radiance seen in a direction.
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        let up = direction.y;
        if up < 0.0 {
            // A short blend hides the edge between ground and haze.
            return self.horizon.lerp(self.ground, (-up * 12.0).min(1.0));
        }
        let sky = self.horizon.lerp(self.zenith, 1.0 - (1.0 - up).powf(2.6));
        let near_sun = direction.dot(self.to_sun.normalize_or(Vec3::Y)).max(0.0);
        sky + self.glow * (0.25 * near_sun.powi(6) + 0.75 * near_sun.powi(64))
    }

    /// As a latitude-longitude map.
    pub fn environment(&self, name: &str, width: u32, height: u32) -> Environment {
        let pixels = (0..width * height)
            .map(|i| {
                let phi = (((i % width) as f32 + 0.5) / width as f32 - 0.5) * TAU;
                let elevation = (0.5 - ((i / width) as f32 + 0.5) / height as f32) * PI;
                let (sin, cos) = phi.sin_cos();
                self.radiance(Vec3::new(sin * elevation.cos(), elevation.sin(), -cos * elevation.cos()))
            })
            .collect();
        Environment { name: name.to_owned(), width, height, pixels, rotation: 0.0, scale: 1.0 }
    }
}

/// The same radiance from every direction.
pub(crate) fn uniform_environment(name: &str, radiance: Vec3) -> Environment {
    let (width, height) = (16, 8);
    Environment { name: name.to_owned(), width, height, pixels: vec![radiance; 128], rotation: 0.0, scale: 1.0 }
}

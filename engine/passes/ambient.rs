//! Diffuse light of a distant environment as nine spherical-harmonic coefficients of its irradiance (Ramamoorthi and
//! Hanrahan 2001), which reproduce it within about 1 %.

use crate::{
    graph::{Graph, Uniform},
    scene::{Environment, Scene},
    shaders::types,
};
use glam::Vec3;
use std::f32::consts::PI;

/// Irradiance in W/m² as a function of the normal. Default: no environment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Irradiance {
    /// Coefficients for 1, y, z, x, xy, yz, 3z²−1, xz, x²−y²; cosine and basis constants folded in.
    pub coefficients: [Vec3; 9],
}

/// Of the scene's environment; none without one.
impl From<&Scene> for Irradiance {
    fn from(scene: &Scene) -> Self {
        scene.environment.as_ref().map(Self::of).unwrap_or_default()
    }
}

impl Irradiance {
    /// Of equal radiance L (W/(sr·m²)) from everywhere: π·L on every plane.
    pub fn constant(radiance: Vec3) -> Self {
        let mut coefficients = [Vec3::ZERO; 9];
        coefficients[0] = PI * radiance;
        Self { coefficients }
    }

    /// Integrates all pixels of a latitude-longitude image.
    pub fn of(environment: &Environment) -> Self {
        let (width, height) = (environment.width as usize, environment.height as usize);
        let mut sums = [glam::DVec3::ZERO; 9];
        for (y, row) in environment.pixels.chunks_exact(width.max(1)).take(height).enumerate() {
            let theta = PI * (y as f32 + 0.5) / height as f32;
            let solid_angle = f64::from(theta.sin() * PI / height as f32 * 2.0 * PI / width as f32);
            for (x, radiance) in row.iter().enumerate() {
                // The image centre looks down −Z, u grows towards +X; rotation turns the environment counter-clockwise
                // seen from above, which turns −Z towards −X.
                let phi = 2.0 * PI * ((x as f32 + 0.5) / width as f32 - 0.5) - environment.rotation;
                let d = Vec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos());
                for (sum, basis) in sums.iter_mut().zip(basis(d)) {
                    *sum += radiance.as_dvec3() * f64::from(basis) * solid_angle;
                }
            }
        }
        // Basis constants squared, times the cosine lobe's π, 2π/3, π/4.
        let (a0, a1, a2) = (PI, 2.0 * PI / 3.0, PI / 4.0);
        let (k0, k1, k2) = (0.282_095_f32.powi(2), 0.488_603_f32.powi(2), 1.092_548_f32.powi(2));
        let (k3, k4) = (0.315_392_f32.powi(2), 0.546_274_f32.powi(2));
        let factors = [a0 * k0, a1 * k1, a1 * k1, a1 * k1, a2 * k2, a2 * k2, a2 * k3, a2 * k2, a2 * k4];
        let mut coefficients = [Vec3::ZERO; 9];
        for i in 0..9 {
            coefficients[i] = sums[i].as_vec3() * factors[i] * environment.scale;
        }
        Self { coefficients }
    }

    /// W/m² on a plane with unit normal `n`.
    pub fn at(&self, n: Vec3) -> Vec3 {
        let sum: Vec3 = self.coefficients.iter().zip(basis(n)).map(|(c, b)| *c * b).sum();
        sum.max(Vec3::ZERO)
    }

    /// The uniform block of `lib/ambient.glsl`.
    pub fn upload(&self, graph: &mut Graph) -> Uniform<types::Ambient> {
        graph.uniform(&types::Ambient { c: self.coefficients.map(Into::into) })
    }
}

/// The nine polynomials of a unit vector, without constants.
fn basis(d: Vec3) -> [f32; 9] {
    let Vec3 { x, y, z } = d;
    [1.0, y, z, x, x * y, y * z, 3.0 * z * z - 1.0, x * z, x * x - y * y]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn environment(radiance: impl Fn(Vec3) -> Vec3) -> Environment {
        let (width, height) = (128, 64);
        let mut pixels = Vec::new();
        for y in 0..height {
            for x in 0..width {
                let theta = PI * (y as f32 + 0.5) / height as f32;
                let phi = 2.0 * PI * ((x as f32 + 0.5) / width as f32 - 0.5);
                pixels.push(radiance(Vec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos())));
            }
        }
        Environment { name: String::new(), width, height, pixels, rotation: 0.0, scale: 1.0 }
    }

    #[test]
    fn a_constant_environment_gives_pi_times_its_radiance() {
        let e = Irradiance::of(&environment(|_| Vec3::new(1.0, 2.0, 3.0)));
        for n in [Vec3::X, Vec3::NEG_Y, Vec3::new(0.6, 0.0, 0.8)] {
            assert!((e.at(n) - PI * Vec3::new(1.0, 2.0, 3.0)).length() < 0.01, "{:?}", e.at(n));
        }
    }

    #[test]
    fn a_cosine_lobe_has_its_closed_form() {
        // L = 1 + d·y: E(n) = π + (2π/3) n·y.
        let e = Irradiance::of(&environment(|d| Vec3::splat(1.0 + d.y)));
        for n in [Vec3::Y, Vec3::NEG_Y, Vec3::X, Vec3::new(0.0, 0.6, -0.8)] {
            assert!((e.at(n).x - (PI + 2.0 * PI / 3.0 * n.y)).abs() < 0.01);
        }
        // L = max(d·(-z), 0): E(-z) = 2π/3; nine coefficients keep it within 2 %.
        let e = Irradiance::of(&environment(|d| Vec3::splat((-d.z).max(0.0))));
        assert!((e.at(Vec3::NEG_Z).x / (2.0 * PI / 3.0) - 1.0).abs() < 0.02);
        assert!(e.at(Vec3::Z).x < 0.1);
    }

    #[test]
    fn rotation_turns_counter_clockwise_seen_from_above() {
        let mut sky = environment(|d| Vec3::splat((-d.z).max(0.0)));
        sky.rotation = PI / 2.0;
        let e = Irradiance::of(&sky);
        assert!(e.at(Vec3::NEG_X).x > 2.0 && e.at(Vec3::X).x < 0.1);
    }
}

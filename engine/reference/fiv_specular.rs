//! Slow twin of the glossy reflection of an environment: sums over its texels in double precision, rays through the
//! hierarchy of the CPU, and the share of its cells that occluders leave visible (techniques::fiv::specular). After
//! Walter et al. 2007, Heitz 2014 and Schlick 1994.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3, Vec3};

use crate::{
    scene::bvh::{Bvh, Ray},
    shaders::types::FivLobe,
    techniques::fiv::{
        samples::{Grid, Shells},
        sky::{self, Sky},
        spacing::Spacing,
        specular::cell,
    },
};

/// A glossy surface.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// Origin of shadow rays, metres.
    pub point: Vec3,
    /// Unit length.
    pub normal: DVec3,
    /// Unit vector to the eye.
    pub eye: DVec3,
    /// Reflectance at normal incidence.
    pub f0: DVec3,
    /// Perceptual roughness.
    pub roughness: f64,
}

/// Square of the GGX width alpha. Roughness below 0.045 counts as 0.045.
pub fn width2(roughness: f64) -> f64 {
    roughness.max(0.045).powi(4)
}

/// BRDF × cosine for a lobe of light around `light`, a unit vector. `spread` widens the distribution of normals, more
/// so at a large angle between light and eye. `least` is the least square of the width.
pub fn response(surface: &Surface, light: DVec3, (spread, least): (f64, f64)) -> DVec3 {
    let (n, v) = (surface.normal, surface.eye);
    let cosine = n.dot(light);
    if cosine <= 0.0 {
        return DVec3::ZERO;
    }
    let half = (v + light).normalize();
    let across = v.dot(half).max(0.1);
    let a2 = width2(surface.roughness);
    let w2 = (a2 + spread / (across * across)).max(least / (across * across)).min(1.0);
    // GGX by the tangent of the angle to the normal.
    let c2 = n.dot(half).powi(2).min(1.0);
    let distribution = w2 / (PI * (c2 * (w2 - 1.0) + 1.0).powi(2));
    // Height-correlated masking and shadowing: 1 / (1 + Λ(v) + Λ(l)).
    let lambda = |c: f64| 0.5 * ((1.0 + a2 * (1.0 - c * c).max(0.0) / (c * c)).sqrt() - 1.0);
    let nv = n.dot(v).max(1e-4);
    let both = 1.0 / (1.0 + lambda(nv) + lambda(cosine));
    let grazing = (50.0 * surface.f0.max_element()).clamp(0.0, 1.0);
    let fresnel = surface.f0 + (grazing - surface.f0) * (1.0 - v.dot(half).clamp(0.0, 1.0)).powi(5);
    fresnel * (distribution * both / (4.0 * nv))
}

/// Radiance of the environment that a surface reflects glossily, W/(sr·m²). Geometry hides the texels whose middles it
/// covers.
pub fn reflected(sky: &Sky, surface: &Surface, geometry: Option<&Bvh>) -> DVec3 {
    let mut sum = DVec3::ZERO;
    for (i, radiance) in sky.radiance.iter().enumerate() {
        let (face, x, y) = sky::place(sky.size, i as u32);
        let light = sky::area(face, sky.size, x, y).normalize();
        if surface.normal.dot(light) <= 0.0 || *radiance == Vec3::ZERO {
            continue;
        }
        let st = (DVec2::new(x.into(), y.into()) + 0.5) / f64::from(sky.size);
        let ray = || Ray::new(surface.point, sky::direction(face, st).as_vec3());
        if geometry.is_some_and(|geometry| geometry.any(&ray())) {
            continue;
        }
        let angle = sky::solid_angle(sky.size, x, y);
        sum += radiance.as_dvec3() * angle * response(surface, light, (angle / 24.0, angle / 4.0));
    }
    sum
}

/// Share of constant radiance that a surface reflects glossily, from `steps`² normals by their GGX probability.
pub fn albedo(surface: &Surface, steps: u32) -> DVec3 {
    let n = surface.normal;
    let (right, up) = n.any_orthonormal_pair();
    let a2 = width2(surface.roughness);
    let mut sum = DVec3::ZERO;
    for k in 0..steps * steps {
        let at = |k: u32| (f64::from(k) + 0.5) / f64::from(steps);
        let (u, phi) = (at(k % steps), TAU * at(k / steps));
        let cosine = ((1.0 - u) / (1.0 + (a2 - 1.0) * u)).sqrt();
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let half = n * cosine + (right * phi.cos() + up * phi.sin()) * sine;
        let across = surface.eye.dot(half);
        let light = 2.0 * across * half - surface.eye;
        if across <= 0.0 || n.dot(light) <= 0.0 {
            continue;
        }
        let density = a2 / (PI * (cosine * cosine * (a2 - 1.0) + 1.0).powi(2)) * cosine / (4.0 * across);
        sum += response(surface, light, (0.0, 0.0)) / density;
    }
    sum / f64::from(steps * steps)
}

/// Share of the light of each cell that geometry hides from a point. `weights`: weights of the texels as [`Cells::of`]
/// has them.
///
/// [`Cells::of`]: crate::techniques::fiv::specular::Cells::of
pub fn hidden(size: u32, weights: &[f32], cells: usize, geometry: &Bvh, point: Vec3) -> Vec<f64> {
    let mut out = vec![0.0; cells];
    for (i, weight) in weights.iter().enumerate() {
        let (face, x, y) = sky::place(size, i as u32);
        let st = (DVec2::new(x.into(), y.into()) + 0.5) / f64::from(size);
        if geometry.any(&Ray::new(point, sky::direction(face, st).as_vec3())) {
            out[cell(size, i as u32) as usize] += f64::from(*weight);
        }
    }
    out
}

/// Radiance that a surface reflects from cells without occluders, and the radiance that is left if occluders hide these
/// shares of the cells, W/(sr·m²).
pub fn left(lobes: &[FivLobe], surface: &Surface, hidden: &[Vec<f64>]) -> (DVec3, DVec3) {
    let (mut whole, mut left) = (DVec3::ZERO, DVec3::ZERO);
    for (i, lobe) in lobes.iter().enumerate().filter(|(_, lobe)| lobe.power != [0.0; 3]) {
        let along = Vec3::from(lobe.direction).as_dvec3();
        let light =
            Vec3::from(lobe.power).as_dvec3() * response(surface, along, (lobe.spread.into(), lobe.least.into()));
        whole += light;
        left += light * hidden.iter().map(|shares| 1.0 - shares[i].clamp(0.0, 1.0)).product::<f64>();
    }
    (whole, left)
}

/// Samples of one occluder with the hidden shares of cells.
#[derive(Clone, Copy, Debug)]
pub struct Masks<'a> {
    pub grid: Grid,
    pub shells: Shells,
    pub spacing: &'a Spacing,
    /// Words per sample, with four cells of a byte each.
    pub words: usize,
    pub shares: &'a [u32],
    /// Vectors as in [`super::fiv::Set`]. They mark the samples inside the occluder.
    pub fivs: &'a [f32],
}

impl Masks<'_> {
    /// Hidden share of each cell if the occluder's centre lies at `offset` (metres) from the receiver, trilinear
    /// between samples.
    pub fn lookup(&self, offset: DVec3) -> Vec<f64> {
        let Grid { azimuths, polars, radii } = self.grid;
        let numbers = self.spacing.numbers(&self.grid, &self.shells, offset);
        let low = [azimuths - 1, polars - 2, radii - 2].map(f64::from);
        let first = [0, 1, 2].map(|k| numbers[k].floor().min(low[k]));
        let (mut sum, mut weights) = (vec![0.0; 4 * self.words], 0.0);
        for k in 0..8u32 {
            let step = [k & 1, k >> 1 & 1, k >> 2];
            let weight: f64 = (0..3)
                .map(|axis| {
                    let part = numbers[axis] - first[axis];
                    if step[axis] == 1 { part } else { 1.0 - part }
                })
                .product();
            let at = |axis: usize| first[axis] as u32 + step[axis];
            let sample = self.grid.index(at(0) % azimuths, at(1), at(2)) as usize;
            if weight <= 0.0 || self.fivs[9 * sample] >= crate::shaders::consts::FIV_INSIDE {
                continue;
            }
            weights += weight;
            for (cell, sum) in sum.iter_mut().enumerate() {
                let byte = self.shares[sample * self.words + cell / 4].to_le_bytes()[cell % 4];
                *sum += weight * f64::from(byte) / 255.0;
            }
        }
        let beyond = (f64::from(self.shells.farthest) / offset.length().max(1e-30)).min(1.0).powi(2);
        // If most samples lie inside the occluder, the receiver does too, and all light is hidden.
        let inside = (1.0 - 2.0 * weights).clamp(0.0, 1.0);
        let scale = if weights > 0.0 { beyond / weights * (1.0 - inside) } else { 0.0 };
        sum.into_iter().map(|s| s * scale + inside).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Environment;

    fn surface(roughness: f64, cosine: f64, f0: f64) -> Surface {
        let eye = DVec3::new((1.0 - cosine * cosine).sqrt(), cosine, 0.0);
        Surface { point: Vec3::ZERO, normal: DVec3::Y, eye, f0: DVec3::splat(f0), roughness }
    }

    #[test]
    fn a_mirror_reflects_all_and_a_rough_surface_loses_what_it_shades() {
        for cosine in [0.2, 0.6, 1.0] {
            let mirror = albedo(&surface(0.0, cosine, 1.0), 64).x;
            assert!((mirror - 1.0).abs() < 2e-3, "{cosine}: {mirror}");
            let rough = albedo(&surface(1.0, cosine, 1.0), 128).x;
            assert!(rough > 0.3 && rough < 0.8, "{cosine}: {rough}");
            // Schlick: with a small reflectance at normal incidence almost only the fifth power is left, and without an
            // interface nothing is reflected.
            let dark = albedo(&surface(0.0, cosine, 0.02), 64).x;
            assert!((dark - 0.02 - 0.98 * (1.0 - cosine).powi(5)).abs() < 2e-3, "{cosine}: {dark}");
            assert_eq!(albedo(&surface(0.0, cosine, 0.0), 64).x, 0.0);
        }
    }

    #[test]
    fn light_and_eye_may_change_places() {
        for roughness in [0.2, 0.5, 0.9] {
            let a = surface(roughness, 0.4, 0.3);
            let light = DVec3::new(-0.3, 0.7, 0.5).normalize();
            let b = Surface { eye: light, ..a };
            let there = response(&a, light, (0.01, 0.0)).x / light.y;
            let back = response(&b, a.eye, (0.01, 0.0)).x / a.eye.y;
            assert!((there / back - 1.0).abs() < 1e-12, "{there} {back}");
        }
    }

    #[test]
    fn even_light_is_reflected_by_the_albedo() {
        let sky = Sky::new(Some(&Environment::constant(Vec3::ONE)), 32).unwrap();
        for (roughness, slack) in [(0.0, 0.05), (0.2, 0.05), (0.35, 0.02), (0.6, 0.01), (1.0, 0.01)] {
            for cosine in [0.35, 0.7, 0.95] {
                // At grazing view some light of texels wider than the lobe falls behind the surface.
                let slack = if cosine < 0.5 && roughness < 0.3 { 0.13 } else { slack };
                let surface = surface(roughness, cosine, 1.0);
                let (found, exact) = (reflected(&sky, &surface, None).x, albedo(&surface, 128).x);
                assert!((found / exact - 1.0).abs() < slack, "{roughness} {cosine}: {found} instead of {exact}");
            }
        }
    }
}

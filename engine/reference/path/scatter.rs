//! How surfaces send light on.

use super::random::{Random, cosine_direction, facet};
use crate::{reference::brdf::Matter, scene::surfaces::Face};
use glam::Vec3;
use std::f32::consts::PI;

/// What becomes of a path at a surface.
pub enum Event {
    /// It is scattered by the base and the microfacets over it.
    Rough,
    /// It goes on in one direction, from this place, with this share of its light.
    Sharp { origin: Vec3, direction: Vec3, share: Vec3 },
    /// Nothing goes on.
    None,
}

impl Face {
    /// What light is scattered by.
    pub fn matter(&self) -> Matter {
        Matter { albedo: self.albedo.as_dvec3(), f0: self.f0.as_dvec3(), roughness: self.roughness.into() }
    }

    /// Decides by chance between the rough and the sharp part of the surface.
    pub fn event(&self, diffuse_only: bool, random: &mut Random) -> Event {
        if diffuse_only {
            return Event::Rough;
        }
        if self.mirror {
            // Schlick's Fresnel term, F0 = base colour.
            let c = self.lobe.dot(self.to_viewer).clamp(0.0, 1.0);
            return self.reflected(self.base + (1.0 - self.base) * (1.0 - c).powi(5));
        }
        if self.transmission > 0.0 && random.next() < self.transmission { self.glass(random) } else { Event::Rough }
    }

    fn reflected(&self, share: Vec3) -> Event {
        let direction = 2.0 * self.lobe.dot(self.to_viewer) * self.lobe - self.to_viewer;
        match direction.dot(self.geometric) > 0.0 {
            true => Event::Sharp { origin: self.lifted(), direction: direction.normalize(), share },
            false => Event::None,
        }
    }

    /// A smooth dielectric: reflects with the share F of Fresnel's equations, transmits the rest tinted by the base colour.
    fn glass(&self, random: &mut Random) -> Event {
        let cosine = self.lobe.dot(self.to_viewer).clamp(0.0, 1.0);
        if self.double_sided {
            // A thin wall: F at both interfaces, and all that goes to and fro between them.
            let f = fresnel(cosine, 1.0 / self.ior).0;
            let f = if f < 1.0 { f + (1.0 - f) * (1.0 - f) * f / (1.0 - f * f) } else { 1.0 };
            return match random.next() < f {
                true => self.reflected(Vec3::ONE),
                false => Event::Sharp { origin: self.sunk(), direction: -self.to_viewer, share: self.base },
            };
        }
        // Refractive index on the viewer's side over that behind.
        let eta = if self.front { 1.0 / self.ior } else { self.ior };
        let (f, behind) = fresnel(cosine, eta);
        if random.next() < f {
            return self.reflected(Vec3::ONE);
        }
        let direction = (-self.to_viewer * eta + self.lobe * (eta * cosine - behind)).normalize();
        if direction.dot(self.geometric) >= 0.0 {
            return Event::None;
        }
        // Radiance over the square of the index is what refraction keeps.
        Event::Sharp { origin: self.sunk(), direction, share: self.base * (eta * eta) }
    }

    /// BRDF · cosine of the rough part.
    pub fn rough(&self, to: Vec3, diffuse_only: bool) -> Vec3 {
        let normal = self.scattering(diffuse_only);
        let cosine = normal.dot(to);
        if cosine <= 0.0 || self.geometric.dot(to) <= 0.0 {
            return Vec3::ZERO;
        }
        if diffuse_only {
            return self.albedo * (cosine / PI);
        }
        let [n, v, l] = [normal, self.to_viewer, to].map(Vec3::as_dvec3);
        self.matter().response(n, v, l).as_vec3()
    }

    fn scattering(&self, diffuse_only: bool) -> Vec3 {
        if diffuse_only { self.normal } else { self.lobe }
    }

    /// A direction of the rough part and BRDF · cosine / density; half of them around the mirror direction, half by the cosine.
    pub fn scatter(&self, diffuse_only: bool, random: &mut Random) -> Option<(Vec3, Vec3)> {
        let (choice, a, b) = (random.next(), random.next(), random.next());
        let (normal, a2) = (self.scattering(diffuse_only), self.alpha_squared());
        let share = if diffuse_only { 0.0 } else { 0.5 };
        let to = if choice < share {
            let half = facet(normal, a2, a, b);
            (2.0 * half.dot(self.to_viewer) * half - self.to_viewer).normalize()
        } else {
            cosine_direction(normal, a, b)
        };
        let value = self.rough(to, diffuse_only);
        if value == Vec3::ZERO {
            return None;
        }
        let half = (self.to_viewer + to).normalize_or(normal);
        let (nh, vh) = (normal.dot(half).clamp(0.0, 1.0), self.to_viewer.dot(half).max(1e-6));
        let facets = a2 / (PI * (nh * nh * (a2 - 1.0) + 1.0).powi(2)) * nh / (4.0 * vh);
        let density = share * facets + (1.0 - share) * normal.dot(to) / PI;
        Some((to, value / density))
    }
}

/// Share of unpolarised light that a dielectric reflects, and the cosine behind; `eta`: index before over index behind.
pub fn fresnel(cosine: f32, eta: f32) -> (f32, f32) {
    let sine2 = eta * eta * (1.0 - cosine * cosine);
    if sine2 >= 1.0 {
        return (1.0, 0.0);
    }
    let behind = (1.0 - sine2).sqrt();
    let s = (eta * cosine - behind) / (eta * cosine + behind);
    let p = (cosine - eta * behind) / (cosine + eta * behind);
    (0.5 * (s * s + p * p), behind)
}

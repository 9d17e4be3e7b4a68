//! Bright parts of an environment. Where two shadows overlap, the light of a small source must not be subtracted twice.
//! The light that occluders hide from a bright part is therefore summed up separately, and at most all light of this
//! part is subtracted.

use glam::{DVec3, Vec3};

use super::sky::{self, Sky};
use crate::shaders::{consts::FIV_SPOTS, types};

/// A texel is bright if the radiance of a channel is at least this multiple of the channel's mean over all directions.
const BRIGHT: f64 = 4.0;
/// Parts with at most this share of every channel's power are left out.
const LEAST: f64 = 0.02;
/// Cosine of the largest angle between a texel of a part and its brightest texel: 45 degrees.
const WIDEST: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// A bright part of the environment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spot {
    /// Mean direction weighted by power, unit length.
    pub direction: DVec3,
    /// Solid angle, sr.
    pub angle: f64,
    /// Fullsphere irradiance vectors of its light: the colours of x, y and z, W/m².
    pub vectors: [DVec3; 3],
}

struct Texel {
    direction: DVec3,
    area: DVec3,
    angle: f64,
    radiance: DVec3,
    /// Radiance relative to the mean, the maximum of all channels.
    level: f64,
}

/// The bright parts of an environment with the most power, the strongest first, at most [`FIV_SPOTS`]. Each part grows
/// from a bright texel to its bright neighbours.
pub fn spots(sky: &Sky) -> Vec<Spot> {
    let mut texels: Vec<Texel> = (0..sky.radiance.len() as u32)
        .filter(|&texel| sky.radiance[texel as usize] != Vec3::ZERO)
        .map(|texel| {
            let (face, x, y) = sky::place(sky.size, texel);
            let area = sky::area(face, sky.size, x, y);
            let radiance = sky.radiance[texel as usize].as_dvec3();
            let angle = sky::solid_angle(sky.size, x, y);
            Texel { direction: area.normalize(), area, angle, radiance, level: 0.0 }
        })
        .collect();
    let whole: DVec3 = texels.iter().map(|t| t.radiance * t.angle).sum();
    let mean = whole / (4.0 * std::f64::consts::PI);
    let share = |color: DVec3, of: DVec3| (color / of.max(DVec3::splat(1e-300))).max_element();
    texels.iter_mut().for_each(|t| t.level = share(t.radiance, mean));
    texels.retain(|t| t.level >= BRIGHT);
    // The sort is stable, so each run gives the same parts.
    texels.sort_by(|a, b| b.level.total_cmp(&a.level));
    // Neighbours touch at least at a corner. Texels in the middle of a face are the widest.
    let near = (1.6 * 2.0 / f64::from(sky.size)).cos();
    let mut free = vec![true; texels.len()];
    let mut found = Vec::new();
    // Seeds go from bright to dark. The limit bounds the work if nearly all texels are equally bright.
    for seed in 0..texels.len().min(512) {
        if !free[seed] {
            continue;
        }
        free[seed] = false;
        let mut part = vec![seed];
        let mut at = 0;
        while at < part.len() {
            let from = texels[part[at]].direction;
            for (other, texel) in texels.iter().enumerate() {
                let inside = free[other] && texel.direction.dot(texels[seed].direction) >= WIDEST;
                if inside && texel.direction.dot(from) >= near {
                    free[other] = false;
                    part.push(other);
                }
            }
            at += 1;
        }
        let members = || part.iter().map(|&i| &texels[i]);
        let power: DVec3 = members().map(|t| t.radiance * t.angle).sum();
        let vector = |axis: usize| members().map(|t| t.radiance * t.area[axis]).sum();
        let mean: DVec3 = members().map(|t| t.area * share(t.radiance, whole)).sum();
        let spot = Spot {
            direction: mean.normalize_or(texels[seed].direction),
            angle: members().map(|t| t.angle).sum(),
            vectors: [0, 1, 2].map(vector),
        };
        let of_whole = share(power, whole);
        if of_whole > LEAST {
            found.push((of_whole, spot));
        }
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.truncate(FIV_SPOTS as usize);
    found.into_iter().map(|(_, spot)| spot).collect()
}

impl Spot {
    /// The part in the form that shaders read.
    pub fn packed(&self) -> types::FivSpot {
        let [x, y, z] = self.vectors.map(|v| v.as_vec3().to_array());
        // A cap has the solid angle 2π (1 - cos).
        let cosine = (1.0 - self.angle / std::f64::consts::TAU).clamp(0.0, 1.0);
        let radius = (1.0 - cosine * cosine).sqrt().max(1e-4) as f32;
        types::FivSpot { direction: self.direction.as_vec3().to_array(), radius, x, y, z }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builtin;
    use crate::scene::Environment;

    fn of(name: &str, size: u32) -> (Sky, Vec<Spot>) {
        let sky = Sky::new(Some(&builtin::environment(name).unwrap()), size).unwrap();
        let spots = spots(&sky);
        (sky, spots)
    }

    #[test]
    fn even_and_black_light_has_none() {
        let even = Environment { scale: 3.0, ..Environment::constant(Vec3::ONE) };
        assert_eq!(spots(&Sky::new(Some(&even), 16).unwrap()), []);
        assert_eq!(spots(&Sky::new(None, 16).unwrap()), []);
    }

    #[test]
    fn lights_of_built_in_environments_are_found_whole() {
        for size in [8, 32] {
            // No other part sends light, or hardly any.
            for (name, count) in [("point", 1), ("area", 1), ("areas", 2)] {
                let (sky, spots) = of(name, size);
                // Coarse texels may part a light in two.
                assert!((count..=count + 1).contains(&spots.len()), "{name} {size}: {}", spots.len());
                let whole = crate::reference::fiv::total(&sky);
                let sum: DVec3 = spots.iter().map(|s| s.vectors[1]).sum();
                assert!((sum - whole[1]).length() < 0.1 * whole[1].length(), "{name} {size}: {sum} of {}", whole[1]);
                assert!(spots.iter().all(|s| s.angle < 1.0 && (s.direction.length() - 1.0).abs() < 1e-9));
            }
            let (_, grove) = of("grove", size);
            let sun = DVec3::new(0.45, 0.72, -0.35).normalize();
            assert!(grove[0].direction.dot(sun) > 0.99, "{size}: {:?}", grove[0]);
            assert!(grove.windows(2).all(|pair| pair[0].direction.distance(pair[1].direction) > 1e-3));
        }
    }

    #[test]
    fn a_spot_is_one_whichever_edges_of_the_cube_it_lies_on() {
        // A cap of 12 degrees around a corner, an edge and the middle of a face.
        for towards in [DVec3::ONE, DVec3::new(1.0, 0.0, -1.0), DVec3::Z] {
            let mut sky = Sky::new(Some(&Environment::constant(Vec3::splat(0.01))), 32).unwrap();
            let mut exact = (0.0, DVec3::ZERO);
            for i in 0..sky.radiance.len() as u32 {
                let (face, x, y) = sky::place(sky.size, i);
                let area = sky::area(face, sky.size, x, y);
                if area.normalize().dot(towards.normalize()) > 12f64.to_radians().cos() {
                    sky.radiance[i as usize] = Vec3::new(10.0, 5.0, 0.0);
                    exact.0 += sky::solid_angle(sky.size, x, y);
                    exact.1 += area;
                }
            }
            let [spot] = spots(&sky)[..] else { panic!("{towards}: {:?}", spots(&sky)) };
            assert!((spot.angle / exact.0 - 1.0).abs() < 1e-9);
            assert!(spot.direction.dot(exact.1.normalize()) > 0.9999);
            let red = DVec3::new(spot.vectors[0].x, spot.vectors[1].x, spot.vectors[2].x);
            assert!((red - exact.1 * 10.0).length() < 1e-6 * red.length());
            let packed = spot.packed();
            assert!(
                (f64::from(packed.radius) - (1.0 - (1.0 - exact.0 / std::f64::consts::TAU).powi(2)).sqrt()).abs()
                    < 1e-5
            );
        }
    }
}

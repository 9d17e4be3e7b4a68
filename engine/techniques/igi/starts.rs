//! Where paths of light begin: as many at each light as it has of the power of all.

use super::halton;
use crate::{
    scene::{Aabb, Environment, environment::solid_angle},
    shaders::{
        consts::{LIGHT_DIRECTIONAL, LIGHT_SPOT, START_ENVIRONMENT, START_PUNCTUAL, START_TRIANGLE},
        types::{Light, LightNode, LightTarget, VplStart},
    },
};
use glam::{Mat3, Vec3};
use std::f64::consts::PI;

/// Not there.
const NONE: u32 = u32::MAX;

/// A light and the power that it is chosen by, summed over channels, W.
#[derive(Clone, Copy, Debug)]
pub struct Source {
    start: VplStart,
    pub power: f64,
}

/// Of a map, W/m² summed over channels: ∫ L |ωₖ| dω for the three axes. With the areas of a box's faces across the axes it gives the
/// power that enters the box (W): parallel light from ω meets Σ |ωₖ| Aₖ of a box, whose mean over directions is a quarter of its
/// surface (Cauchy 1841).
pub fn sky_moments(environment: &Environment) -> [f64; 3] {
    let mut sum = [0.0; 3];
    let (width, height) = (environment.width.max(1), environment.height.max(1));
    let turn = Mat3::from_rotation_y(environment.rotation);
    for (i, pixel) in environment.pixels.iter().enumerate() {
        let (x, y) = (i as u32 % width, i as u32 / width);
        let uv = glam::vec2((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32);
        let direction = turn * crate::scene::environment::direction_from_uv(uv);
        let light = strength(*pixel) * solid_angle(width, height, y) * f64::from(environment.scale);
        for (sum, part) in sum.iter_mut().zip(direction.to_array()) {
            *sum += light * f64::from(part.abs());
        }
    }
    sum
}

/// All that shines, with its power. `emissive`: targets and tree of the emissive triangles.
pub fn sources(
    lights: &[Light],
    (targets, nodes): (&[LightTarget], &[LightNode]),
    two_sided: impl Fn(&LightTarget) -> bool,
    sky: Option<[f64; 3]>,
    bounds: &Aabb,
) -> Vec<Source> {
    let faces = faces(bounds);
    let mut out = Vec::new();
    let mut add = |kind, instance, index, power: f64| {
        if power > 0.0 && power.is_finite() {
            out.push(Source { start: VplStart { kind, instance, index, weight: 0.0 }, power });
        }
    };
    for (index, light) in lights.iter().enumerate() {
        let strength = strength(light.intensity.into());
        let angle = match light.kind {
            LIGHT_DIRECTIONAL => light.direction.iter().zip(faces).map(|(d, face)| f64::from(d.abs()) * face).sum(),
            LIGHT_SPOT => {
                // In narrow cones the line from the outer to the inner one may end before it is 1.
                let cosine = |at: f32| f64::from((at - light.spot_offset) / light.spot_scale);
                let (outer, inner) = (cosine(0.0).clamp(-1.0, 1.0), cosine(1.0));
                let end = inner.min(1.0);
                let reached = ((end - outer) / (inner - outer).max(1e-30)).clamp(0.0, 1.0);
                2.0 * PI * (1.0 - end + (inner - outer) / 3.0 * reached.powi(3))
            }
            _ => 4.0 * PI,
        };
        add(START_PUNCTUAL, NONE, index as u32, strength * angle);
    }
    for node in nodes.iter().filter(|node| node.second == NONE) {
        let Some(target) = targets.get(node.light as usize) else { continue };
        let sides = if two_sided(target) { 2.0 } else { 1.0 };
        // The tree knows what a triangle sends along its axis; Lambert's law has π times as much in all.
        add(START_TRIANGLE, target.instance, target.index, PI * sides * f64::from(node.power));
    }
    if let Some(moments) = sky {
        add(START_ENVIRONMENT, NONE, 0, moments.iter().zip(faces).map(|(moment, face)| moment * face).sum());
    }
    out
}

/// Areas of a box's faces, across each axis, m².
fn faces(bounds: &Aabb) -> [f64; 3] {
    if bounds.is_empty() {
        return [0.0; 3];
    }
    let size = (bounds.max - bounds.min).as_dvec3();
    [size.y * size.z, size.z * size.x, size.x * size.y]
}

/// The start of each of `paths` paths. Equal steps through the powers in a row: every light has its share of the paths to within
/// one, and a path of it carries the same part of its power as any other.
pub fn starts(sources: &[Source], paths: u32, seed: u32) -> Vec<VplStart> {
    let total: f64 = sources.iter().map(|s| s.power).sum();
    let mut out = Vec::with_capacity(paths as usize);
    let (mut at, mut before) = (0, 0.0);
    // Seed 0 takes the middle of each step.
    let offset = if seed == 0 { 0.5 } else { halton::shift(seed, u32::MAX) };
    for path in 0..paths {
        let wanted = (f64::from(path) + offset) / f64::from(paths) * total;
        while at + 1 < sources.len() && before + sources[at].power <= wanted {
            before += sources[at].power;
            at += 1;
        }
        out.push(sources.get(at).map_or(
            VplStart { kind: START_PUNCTUAL, instance: NONE, index: 0, weight: 0.0 },
            |source| {
                let weight = (total / (source.power * f64::from(paths))) as f32;
                VplStart { weight, ..source.start }
            },
        ));
    }
    out
}

/// One number for a colour.
fn strength(color: Vec3) -> f64 {
    color.to_array().iter().map(|&c| f64::from(c.max(0.0))).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source(index: u32, power: f64) -> Source {
        Source { start: VplStart { kind: START_PUNCTUAL, instance: NONE, index, weight: 0.0 }, power }
    }

    #[test]
    fn paths_are_shared_in_proportion_to_power() {
        let sources = [source(0, 1.0), source(1, 6.5), source(2, 0.01), source(3, 2.5)];
        for (paths, seed) in [(1u32, 0), (7, 0), (100, 0), (100, 5), (1003, 77)] {
            let starts = starts(&sources, paths, seed);
            assert_eq!(starts.len(), paths as usize);
            for source in &sources {
                let mine: Vec<_> = starts.iter().filter(|s| s.index == source.start.index).collect();
                let share = source.power / 10.01 * f64::from(paths);
                assert!((mine.len() as f64 - share).abs() < 1.0, "{} of {paths}, share {share}", mine.len());
                // Weighted, a light's paths carry its power.
                for start in mine {
                    assert!((f64::from(start.weight) * share - 1.0).abs() < 1e-5);
                }
            }
        }
    }

    #[test]
    fn nothing_shines() {
        let starts = starts(&[], 3, 0);
        assert!(starts.len() == 3 && starts.iter().all(|s| s.weight == 0.0));
    }

    #[test]
    fn powers_of_lamps_are_their_integrals() {
        let spot = Light {
            kind: LIGHT_SPOT,
            intensity: [1.0, 0.0, 0.0],
            spot_scale: 1.0 / (0.9 - 0.5),
            spot_offset: -0.5 / (0.9 - 0.5),
            ..Light::default()
        };
        // One degree: the line is a tenth of the way up in the middle.
        let edge = 1f32.to_radians().cos();
        let narrow = Light { spot_scale: 1e3, spot_offset: -1e3 * edge, ..spot };
        let sun = Light { intensity: [0.0, 3.0, 0.0], direction: [0.6, 0.0, -0.8], ..Light::default() };
        let bounds = Aabb { min: Vec3::ZERO, max: Vec3::new(2.0, 3.0, 4.0) };
        let all = sources(&[spot, sun, narrow], (&[], &[]), |_| false, Some([1.0, 2.0, 0.5]), &bounds);
        let steps = 200_000;
        let integral: f64 = (0..steps)
            .map(|i| {
                let cosine = -1.0 + 2.0 * (f64::from(i) + 0.5) / f64::from(steps);
                ((cosine - 0.5) / 0.4).clamp(0.0, 1.0).powi(2) * 2.0 * PI * 2.0 / f64::from(steps)
            })
            .sum();
        assert!((all[0].power - integral).abs() < 1e-5, "{} {integral}", all[0].power);
        assert!((all[1].power - 3.0 * (0.6 * 12.0 + 0.8 * 6.0)).abs() < 1e-5);
        let exact = 2.0 * PI * 1e6 * (1.0 - f64::from(edge)).powi(3) / 3.0;
        assert!((all[2].power / exact - 1.0).abs() < 3e-3, "{} {exact}", all[2].power);
        assert!((all[3].power - (12.0 + 2.0 * 8.0 + 0.5 * 6.0)).abs() < 1e-9);
    }

    #[test]
    fn an_even_sky_sends_pi_times_half_the_surface() {
        // Mean cross-section of a convex body is a quarter of its surface (Cauchy): power 4π L S/4.
        let sky = Environment {
            width: 64,
            height: 32,
            pixels: vec![Vec3::splat(2.0); 64 * 32],
            ..Environment::constant(Vec3::ONE)
        };
        for moment in sky_moments(&sky) {
            assert!((moment / (6.0 * 2.0 * PI) - 1.0).abs() < 2e-3, "{moment}");
        }
    }
}

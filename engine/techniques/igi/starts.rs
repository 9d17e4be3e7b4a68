//! The starts of light paths: each light source gets paths in proportion to its share of the total power.

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

/// An absent instance or child node.
const NONE: u32 = u32::MAX;

/// A light source, and its power summed over the colour channels, W.
#[derive(Clone, Copy, Debug)]
pub struct Source {
    start: VplStart,
    pub power: f64,
}

/// Moments of an environment map, one for each axis k: ∫ L |ωₖ| dω, W/m², summed over the colour channels.
///
/// The power that enters a box is the sum over k of moment k times Aₖ, the area of a face perpendicular to axis k (W). This holds because
/// parallel light from direction ω sees the projected area Σ |ωₖ| Aₖ. The mean of this area over all directions is a quarter of the box's
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

/// All light sources with a positive power. `targets`, `nodes`: the emissive triangles and the tree over them. `two_sided`: whether a
/// triangle emits from both sides. `sky`: [`sky_moments`]. `bounds`: the box around the scene, metres.
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
                // The falloff is linear in the cosine from the outer to the inner cone. In narrow cones rounding may place the inner
                // cosine above 1, where the cone ends.
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
        // `power` is the intensity along the triangle's normal. The flux of a Lambertian emitter is π times its normal intensity.
        add(START_TRIANGLE, target.instance, target.index, PI * sides * f64::from(node.power));
    }
    if let Some(moments) = sky {
        add(START_ENVIRONMENT, NONE, 0, moments.iter().zip(faces).map(|(moment, face)| moment * face).sum());
    }
    out
}

/// Area of a face of the box, perpendicular to each axis, m².
fn faces(bounds: &Aabb) -> [f64; 3] {
    if bounds.is_empty() {
        return [0.0; 3];
    }
    let size = (bounds.max - bounds.min).as_dvec3();
    [size.y * size.z, size.z * size.x, size.x * size.y]
}

/// The start of each of `paths` paths, by systematic sampling: equal steps through the running sum of the powers. The number of paths of
/// a light differs from its expected number by less than one. The weight of a path is the inverse of this expected number, so that the
/// light's paths together carry its power.
pub fn starts(sources: &[Source], paths: u32, seed: u32) -> Vec<VplStart> {
    let total: f64 = sources.iter().map(|s| s.power).sum();
    let mut out = Vec::with_capacity(paths as usize);
    let (mut at, mut before) = (0, 0.0);
    // With seed 0 the samples lie in the middle of each step.
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

/// Sum of the colour channels; negative channels count as 0.
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
                // The weight is the inverse of the light's expected number of paths.
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
        // A cone of one degree: on the axis the linear falloff has only reached about 0.15.
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
        // The mean projected area of a convex body is a quarter of its surface S (Cauchy), so the power is 4π L S/4.
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

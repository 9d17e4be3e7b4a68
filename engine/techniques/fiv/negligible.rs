//! How large an occluder must look to matter under an environment.

use glam::{DVec2, DVec3, Vec3};

use super::sky::{self, Sky};

/// Steps of 1 - cos of the half angle, from a direction to one at right angles.
const STEPS: usize = 2048;
/// Directions from which caps are looked at, along an edge of a face, at most.
const CENTRES: u32 = 32;

/// Sine of the half angle of the widest cap of directions that lets through at most `share` of the mean irradiance of the environment, in
/// each channel and wherever the cap is. 0: none is small enough; 1: even a half space.
pub fn widest(sky: &Sky, share: f32) -> f32 {
    let texels: Vec<(Vec3, Vec3)> = (0..sky.radiance.len() as u32)
        .filter(|&texel| sky.radiance[texel as usize] != Vec3::ZERO)
        .map(|texel| {
            let (face, x, y) = sky::place(sky.size, texel);
            let area = sky::area(face, sky.size, x, y);
            (area.normalize().as_vec3(), sky.radiance[texel as usize] * area.length() as f32)
        })
        .collect();
    let whole: DVec3 = texels.iter().map(|(_, power)| power.as_dvec3()).sum();
    // The irradiance of a normal is a quarter of all power in the mean.
    let allowed = whole * (0.25 * f64::from(share));
    let size = sky.size.min(CENTRES);
    let mut sums = vec![DVec3::ZERO; STEPS];
    let mut most = vec![DVec3::ZERO; STEPS];
    for centre in 0..6 * size * size {
        let (face, x, y) = sky::place(size, centre);
        let st = (DVec2::new(x.into(), y.into()) + 0.5) / f64::from(size);
        let centre = sky::direction(face, st).normalize().as_vec3();
        sums.fill(DVec3::ZERO);
        for (direction, power) in &texels {
            let step = ((1.0 - centre.dot(*direction)) * STEPS as f32) as usize;
            if let Some(sum) = sums.get_mut(step) {
                *sum += power.as_dvec3();
            }
        }
        let mut below = DVec3::ZERO;
        for (most, sum) in most.iter_mut().zip(&sums) {
            below += *sum;
            *most = most.max(below);
        }
    }
    let kept = most.iter().take_while(|most| most.cmple(allowed).all()).count();
    // A cap may lie anywhere between these directions.
    let between = std::f64::consts::SQRT_2 / f64::from(size);
    let angle = (1.0 - kept as f64 / STEPS as f64).acos() - between;
    if kept == STEPS { 1.0 } else { angle.max(0.0).sin() as f32 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Environment;

    #[test]
    fn caps_of_even_light_have_their_share() {
        let sky = Sky::new(Some(&Environment::constant(Vec3::ONE)), 16).unwrap();
        // A cap of solid angle 2π(1 - cos α) has that much of power 4π, a quarter of which is the mean irradiance.
        for share in [0.2f32, 0.5, 1.0] {
            let exact = (1.0 - share / 2.0).acos().sin();
            let found = widest(&sky, share);
            assert!(found <= exact && found > exact - 0.15, "{share}: {found} instead of {exact}");
        }
        assert_eq!((widest(&sky, 1e-4), widest(&sky, 4.0)), (0.0, 1.0));
    }

    #[test]
    fn a_small_light_leaves_nothing_negligible() {
        let mut sky = Sky::new(Some(&Environment::constant(Vec3::splat(1e-3))), 8).unwrap();
        sky.radiance[100] = Vec3::splat(1000.0);
        assert_eq!(widest(&sky, 0.1), 0.0);
    }
}

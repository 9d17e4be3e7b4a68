//! Upper bound of the irradiance that an occluder can hide, by its direction and its apparent size.
//!
//! A disc of directions whose radius is the sine r contains at most π r² times the greatest radiance in the disc. A
//! table of the greatest radiance around each direction, for discs of several sizes, therefore bounds the irradiance
//! that any occluder hides. Occluders whose bound is below a share of the mean irradiance can be left out. Away from
//! the sun even a near occluder may be left out, in front of the sun no occluder is. The interpolation between entries
//! is a bound too, because each entry covers the discs around its neighbours.

use glam::{DVec2, DVec3, Vec3};

use super::sky::{self, Sky};
use crate::shaders::consts::{FIV_MATTER_AZIMUTHS, FIV_MATTER_LEVELS, FIV_MATTER_POLARS};

/// Sine of the disc radius at level 0. Each level has twice the sine of the level before.
const SMALLEST: f64 = 0.05;

/// Entries of the table.
pub const LENGTH: usize = (FIV_MATTER_AZIMUTHS * FIV_MATTER_POLARS * FIV_MATTER_LEVELS) as usize;

/// π times the greatest radiance around each direction, divided by the mean irradiance, as the maximum of all channels.
/// The azimuth changes fastest, then the polar angle, then the level. Twin of fiv/matter.glsl.
pub fn table(sky: &Sky) -> Vec<f32> {
    let pi = std::f64::consts::PI;
    let lit = (0..sky.radiance.len() as u32).filter(|&t| sky.radiance[t as usize] != Vec3::ZERO);
    let texels: Vec<(DVec3, DVec3, f64)> = lit
        .map(|t| {
            let (face, x, y) = sky::place(sky.size, t);
            let area = sky::area(face, sky.size, x, y);
            (area.normalize(), sky.radiance[t as usize].as_dvec3(), area.length())
        })
        .collect();
    // The mean irradiance over all normals is a quarter of the total power.
    let mean = 0.25 * texels.iter().map(|(_, radiance, area)| *radiance * *area).sum::<DVec3>();
    let level = |radiance: DVec3| (pi * radiance / mean.max(DVec3::splat(1e-300))).max_element();
    let mut texels: Vec<(Vec3, f32)> =
        texels.iter().map(|(d, radiance, _)| (d.as_vec3(), level(*radiance) as f32)).collect();
    // Texels are sorted, so the first texel in a disc is the brightest.
    texels.sort_by(|a, b| b.1.total_cmp(&a.1));
    // A lookup reads entries at a distance of up to the diagonal of a cell, and texels extend beyond their middles.
    let cell = 2.0 * pi / f64::from(FIV_MATTER_AZIMUTHS);
    let around = 2f64.sqrt() * (cell + 1.0 / f64::from(sky.size));
    let within: Vec<f32> = (0..FIV_MATTER_LEVELS)
        .map(|level| {
            let sine = SMALLEST * f64::from(1u32 << (level + 1));
            let angle = if sine < 1.0 { sine.asin() + around } else { pi };
            angle.min(pi).cos() as f32 - 1e-6
        })
        .collect();
    let mut table = vec![0f32; LENGTH];
    let cells = (FIV_MATTER_AZIMUTHS * FIV_MATTER_POLARS) as usize;
    for entry in 0..cells {
        let (column, row) = (entry as u32 % FIV_MATTER_AZIMUTHS, entry as u32 / FIV_MATTER_AZIMUTHS);
        let place = DVec2::new(column.into(), row.into());
        let (azimuth, polar) = (place.x * cell, place.y * pi / f64::from(FIV_MATTER_POLARS - 1));
        let at = DVec3::new(polar.sin() * azimuth.sin(), polar.cos(), -polar.sin() * azimuth.cos()).as_vec3();
        // Discs of higher levels contain those of lower levels, so entries from `known` on are done.
        let mut known = within.len();
        for (direction, level) in &texels {
            let cosine = at.dot(*direction);
            while known > 0 && cosine >= within[known - 1] {
                known -= 1;
                table[known * cells + entry] = *level;
            }
            if known == 0 {
                break;
            }
        }
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builtin;
    use crate::scene::Environment;

    /// As fiv/matter.glsl.
    fn bound(table: &[f32], d: DVec3, r: f64) -> f64 {
        let (azimuths, polars) = (FIV_MATTER_AZIMUTHS as usize, FIV_MATTER_POLARS as usize);
        let azimuth = (d.x.atan2(-d.z) / std::f64::consts::TAU).rem_euclid(1.0) * azimuths as f64;
        let polar = d.y.clamp(-1.0, 1.0).acos() / std::f64::consts::PI * (polars - 1) as f64;
        let (a, p) = ((azimuth as usize).min(azimuths - 1), (polar as usize).min(polars - 2));
        let level = (r.max(1e-6) / SMALLEST).log2().clamp(0.0, f64::from(FIV_MATTER_LEVELS - 1) - 1e-3);
        let l = level as usize;
        let mut sum = 0.0;
        for (i, j, k) in (0..8).map(|k| (k & 1, k >> 1 & 1, k >> 2)) {
            let weight =
                |x: f64, low: usize, step: usize| if step == 1 { x - low as f64 } else { 1.0 - (x - low as f64) };
            let entry = ((l + k) * polars + p + j) * azimuths + (a + i) % azimuths;
            sum += weight(azimuth, a, i) * weight(polar, p, j) * weight(level, l, k) * f64::from(table[entry]);
        }
        r * r * sum
    }

    fn directions(count: u32) -> impl Iterator<Item = DVec3> {
        (0..count).map(move |i| {
            let y = 1.0 - 2.0 * (f64::from(i) + 0.5) / f64::from(count);
            let (sin, cos) = (2.399_963 * f64::from(i)).sin_cos();
            DVec3::new((1.0 - y * y).sqrt() * cos, y, (1.0 - y * y).sqrt() * sin)
        })
    }

    #[test]
    fn discs_of_even_light_have_their_area() {
        let table = table(&Sky::new(Some(&Environment::constant(Vec3::ONE)), 16).unwrap());
        for (d, r) in directions(50).flat_map(|d| [0.001, 0.05, 0.3, 0.9, 1.0].map(|r| (d, r))) {
            // The share of a disc in the irradiance of a surface that faces it is r².
            assert!((bound(&table, d, r) / (r * r) - 1.0).abs() < 0.01, "{d} {r}: {}", bound(&table, d, r));
        }
    }

    #[test]
    fn no_disc_hides_more_than_its_bound() {
        for name in ["grove", "areas", "point"] {
            let sky = Sky::new(Some(&builtin::environment(name).unwrap()), 16).unwrap();
            let table = table(&sky);
            let texels: Vec<(DVec3, DVec3)> = (0..sky.radiance.len() as u32)
                .map(|t| {
                    let (face, x, y) = sky::place(sky.size, t);
                    (sky::area(face, sky.size, x, y), sky.radiance[t as usize].as_dvec3())
                })
                .collect();
            let mean = 0.25 * texels.iter().map(|(area, radiance)| *radiance * area.length()).sum::<DVec3>();
            let mut free = 0;
            for (d, r) in directions(120).flat_map(|d| [0.02, 0.11, 0.4, 0.8].map(|r| (d, r))) {
                let cosine = (1.0f64 - r * r).sqrt();
                // A disc smaller than its texels contains only a part of their light.
                let inside = || texels.iter().filter(|(area, _)| area.normalize().dot(d) > cosine);
                let hidden: DVec3 = inside().map(|(area, radiance)| *radiance * area.dot(d).max(0.0)).sum();
                let angle: f64 = inside().map(|(area, _)| area.length()).sum();
                let part = (std::f64::consts::TAU * (1.0 - cosine) / angle.max(1e-9)).min(1.0);
                let share = part * (hidden / mean.max(DVec3::splat(1e-300))).max_element();
                let slack = 4.0 / f64::from(sky.size * sky.size) * share;
                assert!(share <= bound(&table, d, r) * 1.3 + slack, "{name} {d} {r}: {share}, {}", bound(&table, d, r));
                free += u32::from(r == 0.11 && bound(&table, d, r) < 0.02);
            }
            // The bound is useful: in most directions an occluder at nine radii hides little.
            assert!(free > 40, "{name}: {free}");
        }
    }
}

//! Light probes: angular maps, as Debevec's collection has them.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3, Vec3};

use super::Layers;

/// Larger latitude-longitude pictures are not made, rows.
const MOST_ROWS: u32 = 2048;
/// Places along an edge of a pixel where the map is looked at.
const PLACES: u32 = 3;

/// A latitude-longitude picture of what a square angular map shows: its middle lies straight ahead (−Z), its rim straight behind, and
/// the distance from the middle is the angle. What is outside of the circle counts for nothing. `None` if the picture is not square, is
/// smaller than 2×2, or has no colour.
pub fn from_angular_map(picture: &Layers) -> Option<Layers> {
    let size = picture.width;
    let map = picture.main()?.rgb_pixels()?;
    if size != picture.height || size < 2 || map.len() != size as usize * size as usize {
        return None;
    }
    let rows = size.min(MOST_ROWS);
    let (width, all) = (2 * rows, PLACES * PLACES);
    let mut data = Vec::with_capacity(3 * (width * rows) as usize);
    for i in 0..width * rows {
        let mut sum = Vec3::ZERO;
        for k in 0..all {
            let within = (DVec2::new((k % PLACES).into(), (k / PLACES).into()) + 0.5) / f64::from(PLACES);
            let azimuth = TAU * ((f64::from(i % width) + within.x) / f64::from(width) - 0.5);
            let polar = PI * (f64::from(i / width) + within.y) / f64::from(rows);
            let direction = DVec3::new(polar.sin() * azimuth.sin(), polar.cos(), -polar.sin() * azimuth.cos());
            sum += look_up(&map, size, place(direction) * f64::from(size));
        }
        data.extend((sum / all as f32).to_array());
    }
    let mut out = Layers::rgb(width, rows, data);
    out.metadata = picture.metadata.clone();
    out.warnings = picture.warnings.clone();
    Some(out)
}

/// Where a direction is in the map, 0 to 1 from the left and from the top.
fn place(direction: DVec3) -> DVec2 {
    let aside = direction.truncate().length();
    let away = aside.atan2(-direction.z) / PI;
    let toward = if aside > 0.0 { direction.truncate() / aside } else { DVec2::X };
    DVec2::new(0.5 + 0.5 * away * toward.x, 0.5 - 0.5 * away * toward.y)
}

/// Between the four nearest pixels, as far as they lie in the circle.
fn look_up(map: &[[f32; 3]], size: u32, at: DVec2) -> Vec3 {
    let radius = 0.5 * f64::from(size);
    let low = (at - 0.5).floor();
    let part = at - 0.5 - low;
    let (mut sum, mut weights) = (Vec3::ZERO, 0.0);
    for k in 0..4u32 {
        let step = DVec2::new((k & 1).into(), (k >> 1).into());
        let pixel = low + step;
        let share = (DVec2::ONE - step - part).abs();
        let inside = (pixel + 0.5).distance(DVec2::splat(radius)) <= radius;
        if inside && pixel.min_element() >= 0.0 && pixel.max_element() < f64::from(size) {
            let weight = (share.x * share.y) as f32;
            // A weight of zero must not make a number of what is none.
            if weight > 0.0 {
                sum += Vec3::from(map[(pixel.y as u32 * size + pixel.x as u32) as usize]) * weight;
                weights += weight;
            }
        }
    }
    if weights > 0.0 {
        return sum / weights;
    }
    // On the rim: the pixel next to it towards the middle.
    let inward = at + (DVec2::splat(radius) - at).normalize_or_zero();
    let [x, y] = inward.to_array().map(|v| (v.max(0.0) as u32).min(size - 1));
    Vec3::from(map[(y * size + x) as usize])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn light(d: DVec3) -> Vec3 {
        DVec3::new(2.0 + d.x, 2.0 + d.y, 2.0 + d.z).as_vec3()
    }

    /// The map of a function of the direction, black outside of its circle.
    fn painted(size: u32, light: impl Fn(DVec3) -> Vec3) -> Layers {
        let at = |i: u32| {
            let st = (DVec2::new((i % size).into(), (i / size).into()) + 0.5) / f64::from(size);
            let (u, v) = (2.0 * st.x - 1.0, 1.0 - 2.0 * st.y);
            let away = u.hypot(v);
            let (sin, cos) = (PI * away).sin_cos();
            let d = DVec3::new(sin * u / away.max(1e-12), sin * v / away.max(1e-12), -cos);
            if away <= 1.0 { light(d).to_array() } else { [0.0; 3] }
        };
        Layers::rgb(size, size, (0..size * size).flat_map(at).collect())
    }

    #[test]
    fn every_direction_shows_what_the_map_has_there() {
        let found = from_angular_map(&painted(64, light)).unwrap();
        assert_eq!((found.width, found.height), (128, 64));
        let pixels = found.main().unwrap().rgb_pixels().unwrap();
        for (i, pixel) in pixels.iter().enumerate() {
            let (x, y) = (i % 128, i / 128);
            let azimuth = TAU * ((x as f64 + 0.5) / 128.0 - 0.5);
            let polar = PI * (y as f64 + 0.5) / 64.0;
            let d = DVec3::new(polar.sin() * azimuth.sin(), polar.cos(), -polar.sin() * azimuth.cos());
            assert!((Vec3::from(*pixel) - light(d)).length() < 0.06, "{d}: {pixel:?} instead of {}", light(d));
        }
    }

    #[test]
    fn the_power_of_a_small_light_is_kept() {
        for towards in [DVec3::NEG_Z, DVec3::X, DVec3::new(0.3, 0.8, -0.4), DVec3::new(0.2, 0.5, 0.6)] {
            let towards = towards.normalize();
            let lamp = |d: DVec3| Vec3::splat(if d.dot(towards) > 0.3f64.cos() { 1.0 } else { 0.0 });
            let found = from_angular_map(&painted(200, lamp)).unwrap();
            let pixels = found.main().unwrap().rgb_pixels().unwrap();
            let angle =
                |row: usize| TAU / 400.0 * ((PI * row as f64 / 200.0).cos() - (PI * (row + 1) as f64 / 200.0).cos());
            let power: f64 = pixels.iter().enumerate().map(|(i, p)| f64::from(p[0]) * angle(i / 400)).sum();
            // The painted disc is ten pixels in radius, and as round as these make it.
            let exact = TAU * (1.0 - 0.3f64.cos());
            assert!((power / exact - 1.0).abs() < 0.03, "{towards}: {power} instead of {exact}");
        }
    }

    #[test]
    fn what_is_no_map_is_none() {
        assert!(from_angular_map(&Layers::rgb(4, 2, vec![1.0; 24])).is_none());
        assert!(from_angular_map(&Layers::rgb(1, 1, vec![1.0; 3])).is_none());
        assert!(from_angular_map(&Layers::new(4, 4)).is_none());
    }
}

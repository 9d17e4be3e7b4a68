//! Rounded and upholstered bodies. All are closed.

use super::Geometry;
use glam::{Vec2, Vec3, vec2, vec3};
use std::f32::consts::FRAC_PI_4;

/// A box of full extents `size` around the origin whose edges and corners are parts of cylinders and spheres of `radius`. Each side
/// has `arc` cells from an edge to its flat middle, which has `flat` cells.
pub(crate) fn rounded_box(size: Vec3, radius: f32, (arc, flat): (usize, usize)) -> Geometry {
    let half = 0.5 * size;
    let radius = radius.min(0.999 * half.min_element());
    let core = half - Vec3::splat(radius);
    // Of one axis of a side: the place in the core, and the slope of the direction from there.
    let turned: Vec<f32> = (0..arc).map(|i| (FRAC_PI_4 * (1.0 - i as f32 / arc as f32)).tan()).collect();
    let mut line: Vec<(f32, f32)> = turned.iter().map(|slope| (-1.0, -slope)).collect();
    line.extend((0..=flat).map(|i| (2.0 * i as f32 / flat as f32 - 1.0, 0.0)));
    line.extend(turned.iter().rev().map(|slope| (1.0, *slope)));
    let sides = [(Vec3::X, Vec3::Y), (Vec3::Y, Vec3::Z), (Vec3::Z, Vec3::X)];
    let mut out = Geometry::default();
    for (outward, right) in sides.into_iter().chain(sides.map(|(outward, right)| (-outward, -right))) {
        // right × up = outward.
        let up = outward.cross(right);
        let first = out.positions.len() as u32;
        for (on_up, slope_up) in &line {
            for (on_right, slope_right) in &line {
                let normal = (outward + right * *slope_right + up * *slope_up).normalize();
                let place = (outward + right * *on_right + up * *on_up) * core + normal * radius;
                out.vertex(place, normal, vec2(place.dot(right), -place.dot(up)));
            }
        }
        let row = line.len() as u32;
        for at in (0..row - 1).flat_map(|j| (0..row - 1).map(move |i| first + j * row + i)) {
            out.quad(at, at + 1, at + row + 1, at + row);
        }
    }
    out
}

/// A body of half extents `half` swollen by up to `amount` metres along each axis, most in the middle of its sides.
pub(crate) fn puffed(body: Geometry, half: Vec3, amount: Vec3) -> Geometry {
    body.displaced(|p| {
        let q = (p / half).clamp(Vec3::NEG_ONE, Vec3::ONE);
        let swell = Vec3::ONE - q * q;
        p + q * amount * vec3(swell.y * swell.z, swell.z * swell.x, swell.x * swell.y)
    })
}

/// A scatter cushion of `size` in XY and of `thick` in its middle, with four corners, in `cells` × `cells` cells a side.
pub(crate) fn pillow(size: Vec2, thick: f32, cells: usize) -> Geometry {
    // Denser towards the seam, where it curves most.
    let step = |i: usize| (std::f32::consts::FRAC_PI_2 * (2.0 * i as f32 / cells as f32 - 1.0)).sin();
    let mut out = Geometry::default();
    for side in [1.0f32, -1.0] {
        let first = out.positions.len() as u32;
        for j in 0..=cells {
            for i in 0..=cells {
                let (s, t) = (step(i), step(j));
                let (ends, full) = (vec2(1.0 - t * t, 1.0 - s * s), (1.0 - s * s) * (1.0 - t * t));
                // Seams are drawn in between the corners.
                let flat = 0.5 * size * vec2(s, t) * (Vec2::ONE - 0.09 * ends);
                let seam = i % cells == 0 || j % cells == 0;
                let height = if seam { 0.0 } else { 0.5 * thick * side * full.powf(0.42) };
                out.vertex(flat.extend(height), Vec3::Z * side, vec2(flat.x, -flat.y));
            }
        }
        let row = cells as u32 + 1;
        for at in (0..cells as u32).flat_map(|j| (0..cells as u32).map(move |i| first + j * row + i)) {
            if side > 0.0 {
                out.quad(at, at + 1, at + row + 1, at + row);
            } else {
                out.quad(at, at + row, at + row + 1, at + 1);
            }
        }
    }
    out.smooth_normals();
    out
}

//! Smooth ways through a few points.

use glam::{Vec2, Vec3, vec2, vec3};

/// A smooth way through points (Catmull and Rom), `steps` pieces from each to the next.
pub(crate) fn curve(points: &[Vec3], steps: usize) -> Vec<Vec3> {
    let at = |i: isize| points[i.clamp(0, points.len() as isize - 1) as usize];
    let mut out = Vec::new();
    for i in 0..points.len() as isize - 1 {
        let [a, b, c, d] = [at(i - 1), at(i), at(i + 1), at(i + 2)];
        for k in 0..steps {
            let t = k as f32 / steps as f32;
            let linear = (c - a) * t;
            let square = (2.0 * a - 5.0 * b + 4.0 * c - d) * (t * t);
            let cube = (3.0 * b - 3.0 * c + d - a) * (t * t * t);
            out.push(b + 0.5 * (linear + square + cube));
        }
    }
    out.extend(points.last());
    out
}

/// The same for (radius, height).
pub(crate) fn profile(points: &[(f32, f32)], steps: usize) -> Vec<Vec2> {
    let points: Vec<Vec3> = points.iter().map(|&(r, y)| vec3(r, y, 0.0)).collect();
    curve(&points, steps).iter().map(|p| vec2(p.x.max(0.0), p.y)).collect()
}

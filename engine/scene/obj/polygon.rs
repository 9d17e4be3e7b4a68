//! Polygons to triangles.

use crate::scene::surface::area_vector;
use glam::{DVec2, DVec3, Vec3};

/// Polygons of more corners are cut into a fan, because cutting ears takes the square of their number.
const MAX_EARS: usize = 512;

/// Appends the triangles of a plane simple polygon, which may be concave, in its own orientation.
pub fn triangulate<T: Copy>(corners: &[T], position: impl Fn(T) -> Vec3, out: &mut Vec<T>) {
    let fan = |out: &mut Vec<T>| {
        for i in 2..corners.len() {
            out.extend([corners[0], corners[i - 1], corners[i]]);
        }
    };
    if corners.len() <= 3 || corners.len() > MAX_EARS {
        return fan(out);
    }
    // Newell's normal: the sum over the triangles of any fan.
    let first = position(corners[0]);
    let normal: DVec3 =
        (2..corners.len()).map(|i| area_vector([first, position(corners[i - 1]), position(corners[i])])).sum();
    let Some(normal) = normal.try_normalize() else { return fan(out) };
    let (x, y) = normal.any_orthonormal_pair();
    // Oriented so that the polygon runs counter-clockwise.
    let flip = x.cross(y).dot(normal).signum();
    let flat: Vec<DVec2> = corners
        .iter()
        .map(|&corner| position(corner).as_dvec3() - first.as_dvec3())
        .map(|p| DVec2::new(p.dot(x), p.dot(y) * flip))
        .collect();
    if convex(&flat) {
        return fan(out);
    }
    let mut left: Vec<usize> = (0..corners.len()).collect();
    while left.len() > 3 {
        let ear = (0..left.len()).find(|&i| is_ear(&flat, &left, i));
        // A polygon that crosses itself has no ear at some point: cut anywhere.
        let i = ear.unwrap_or(1);
        let [a, b, c] = around(&left, i);
        out.extend([corners[a], corners[b], corners[c]]);
        left.remove(i);
    }
    out.extend([corners[left[0]], corners[left[1]], corners[left[2]]]);
}

fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - b)
}

fn convex(points: &[DVec2]) -> bool {
    let count = points.len();
    (0..count).all(|i| turn(points[i], points[(i + 1) % count], points[(i + 2) % count]) >= 0.0)
}

fn around(left: &[usize], i: usize) -> [usize; 3] {
    let count = left.len();
    [left[(i + count - 1) % count], left[i], left[(i + 1) % count]]
}

fn is_ear(points: &[DVec2], left: &[usize], i: usize) -> bool {
    let corners = around(left, i);
    let [a, b, c] = corners.map(|i| points[i]);
    if turn(a, b, c) <= 0.0 {
        return false;
    }
    let inside = |p: DVec2| turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0;
    left.iter().filter(|i| !corners.contains(i)).all(|&i| !inside(points[i]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn areas(points: &[(f32, f32)]) -> Vec<f64> {
        let corners: Vec<usize> = (0..points.len()).collect();
        let position = |i: usize| Vec3::new(points[i].0, 2.0, -points[i].1);
        let mut out = vec![];
        triangulate(&corners, position, &mut out);
        assert_eq!(out.len(), 3 * (points.len() - 2));
        out.chunks(3).map(|t| area_vector([position(t[0]), position(t[1]), position(t[2])]).y / 2.0).collect()
    }

    #[test]
    fn concave_polygons_are_covered_once() {
        // An arrow head whose notch a fan from the first corner would cover, and a comb.
        for (points, want) in [
            (&[(0.0, 0.0), (2.0, 2.0), (0.0, 1.0), (-2.0, 2.0)][..], 2.0),
            (
                &[(0.0, 0.0), (3.0, 0.0), (3.0, 2.0), (2.0, 2.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)][..],
                5.0,
            ),
            (&[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)][..], 1.0),
        ] {
            for start in 0..points.len() {
                let mut points = points.to_vec();
                points.rotate_left(start);
                let areas = areas(&points);
                assert!(areas.iter().all(|&area| area >= 0.0), "{areas:?}");
                assert!((areas.iter().sum::<f64>() - want).abs() < 1e-9, "{areas:?}");
            }
        }
    }

    #[test]
    fn polygons_without_area_end() {
        assert_eq!(areas(&[(0.0, 0.0); 6]).len(), 4);
        assert_eq!(areas(&[(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)]).len(), 2);
    }
}

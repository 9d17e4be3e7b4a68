//! Polygons to triangles.

use super::delaunay;
use crate::scene::surface::area_vector;
use glam::{DVec2, DVec3, Vec3};

/// Polygons of more corners are cut by a Delaunay triangulation, or by halves if they are convex: the square of their number is too much,
/// and a fan of many makes boxes that lie in each other.
const MAX_EARS: usize = 64;
/// Outlines of more corners that cross themselves become a fan, which has the right area. Those of fewer are cut by [`earcut`], which takes
/// the square of their number at worst.
const MAX_CROSSED: usize = 10_000;

/// Appends the triangles of a plane simple polygon, which may be concave, in its own orientation.
pub fn triangulate<T: Copy>(corners: &[T], position: impl Fn(T) -> Vec3, out: &mut Vec<T>) {
    let fan = |out: &mut Vec<T>| {
        for i in 2..corners.len() {
            out.extend([corners[0], corners[i - 1], corners[i]]);
        }
    };
    if corners.len() <= 3 {
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
    match (convex(&flat), corners.len() > MAX_EARS) {
        (true, false) => return fan(out),
        (true, true) => return halves(corners, out),
        (false, true) => {
            if let Some(triangles) = delaunay::triangulate(&flat) {
                out.extend(triangles.iter().flatten().map(|i| corners[*i]));
                return;
            }
            if corners.len() > MAX_CROSSED {
                return fan(out);
            }
            let mut triangles: Vec<usize> = Vec::new();
            earcut::Earcut::new().earcut(flat.iter().map(|p| p.to_array()), &[], &mut triangles);
            out.extend(triangles.chunks_exact(3).flatten().map(|i| corners[*i]));
            return;
        }
        (false, false) => {}
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

/// Cuts a convex polygon across its middle, and both parts again.
fn halves<T: Copy>(corners: &[T], out: &mut Vec<T>) {
    // First and last corner of parts, whose other edges are cut already.
    let mut parts = vec![(0, corners.len() - 1)];
    while let Some((first, last)) = parts.pop() {
        if last - first >= 2 {
            let middle = first + (last - first) / 2;
            out.extend([corners[first], corners[middle], corners[last]]);
            parts.extend([(middle, last), (first, middle)]);
        }
    }
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
        // Of many corners those on a straight line need no triangle.
        let (found, most) = (out.len() / 3, points.len() - 2);
        assert!(found == most || (points.len() > MAX_EARS && found < most), "{found} of {most}");
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
    fn large_polygons_are_covered_once() {
        let circle = |i: usize, count: usize, radius: f32| {
            let angle = std::f32::consts::TAU * i as f32 / count as f32;
            (radius * angle.cos(), radius * angle.sin())
        };
        for count in [65, 2_000, 100_000] {
            let half = 0.5 * count as f64 * (std::f64::consts::TAU / count as f64).sin();
            let round: Vec<_> = (0..count).map(|i| circle(i, count, 1.0)).collect();
            // Every other corner of an even number inwards.
            let even = count / 2 * 2;
            let star: Vec<_> = (0..even).map(|i| circle(i, even, if i % 2 == 0 { 1.0 } else { 0.5 })).collect();
            let spikes = 0.5 * 0.5 * even as f64 * (std::f64::consts::TAU / even as f64).sin();
            for (points, want) in [(round, half), (star, spikes)] {
                let areas = areas(&points);
                assert!(areas.iter().all(|&area| area >= -1e-9), "{count}");
                let sum: f64 = areas.iter().sum();
                assert!((sum - want).abs() < 1e-4, "{count} corners: {sum} instead of {want}");
            }
        }
    }

    #[test]
    fn polygons_without_area_end() {
        assert_eq!(areas(&[(0.0, 0.0); 6]).len(), 4);
        assert_eq!(areas(&[(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)]).len(), 2);
    }
}

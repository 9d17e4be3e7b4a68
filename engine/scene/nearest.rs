//! The nearest points of triangles.

use glam::Vec3;

/// Distance of the origin from a triangle, also from one without area.
pub(crate) fn distance_of_origin([a, b, c]: [Vec3; 3]) -> f32 {
    let (ab, ac) = (b - a, c - a);
    // Regions of corners and edges (Ericson, Real-Time Collision Detection, 5.1.5).
    let (d1, d2) = (-ab.dot(a), -ac.dot(a));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a.length();
    }
    let (d3, d4) = (-ab.dot(b), -ac.dot(b));
    if d3 >= 0.0 && d4 <= d3 {
        return b.length();
    }
    let (d5, d6) = (-ab.dot(c), -ac.dot(c));
    if d6 >= 0.0 && d5 <= d6 {
        return c.length();
    }
    let (vc, vb, va) = (d1 * d4 - d3 * d2, d5 * d2 - d1 * d6, d3 * d6 - d5 * d4);
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (a + ab * (d1 / (d1 - d3))).length();
    }
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (a + ac * (d2 / (d2 - d6))).length();
    }
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return (b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)))).length();
    }
    let whole = 1.0 / (va + vb + vc);
    let inside = a + ab * (vb * whole) + ac * (vc * whole);
    if inside.is_finite() { inside.length() } else { a.length().min(b.length()).min(c.length()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_from_triangles_are_those_of_the_nearest_point() {
        let exact = |t: [Vec3; 3]| {
            let at = |i: usize, j: usize| (i as f32 / 400.0, j as f32 / 400.0);
            let inside = (0..=400).flat_map(|i| (0..=400 - i).map(move |j| at(i, j)));
            inside.map(|(u, v)| (t[0] + (t[1] - t[0]) * u + (t[2] - t[0]) * v).length()).fold(f32::INFINITY, f32::min)
        };
        let v = Vec3::new;
        for triangle in [
            [v(1.0, 1.0, 1.0), v(2.0, 1.0, 1.0), v(1.0, 3.0, 1.0)],
            [v(-1.0, -1.0, 1.0), v(2.0, -1.0, 1.0), v(-1.0, 3.0, 1.0)],
            [v(-1.0, 0.5, 0.2), v(2.0, 0.6, 0.3), v(0.0, 3.0, 1.0)],
            [v(-1.0, -2.5, 0.2), v(2.0, 0.6, 0.3), v(0.0, -3.0, 1.0)],
            [v(3.0, 0.0, 0.2), v(0.5, 0.1, -0.4), v(4.0, -3.0, 1.0)],
        ] {
            for turned in [triangle, [triangle[1], triangle[2], triangle[0]], [triangle[2], triangle[0], triangle[1]]] {
                assert!((distance_of_origin(turned) - exact(triangle)).abs() < 0.02, "{turned:?}");
                assert!(distance_of_origin(turned) <= exact(triangle) + 1e-5);
            }
        }
        assert_eq!(distance_of_origin([Vec3::X; 3]), 1.0);
    }
}

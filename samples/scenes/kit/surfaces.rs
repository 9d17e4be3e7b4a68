//! Surfaces of revolution, sweeps along paths, extrusions, terrain and sheets.

use super::Geometry;
use glam::{Vec2, Vec3};
use std::f32::consts::TAU;

/// `segments` points on a circle of `radius`, counter-clockwise from +X.
pub(crate) fn circle(radius: f32, segments: usize) -> Vec<Vec2> {
    (0..segments).map(|i| Vec2::from_angle(TAU * i as f32 / segments as f32) * radius).collect()
}

/// Surface of revolution about Y of a profile of (radius, height) from bottom to top, outside to the right of its way.
/// Profile corners sharper than `crease` degrees stay sharp. Closed where the profile begins and ends on the axis.
pub(crate) fn lathe(profile: &[Vec2], segments: usize, crease: f32) -> Geometry {
    let mut out = Geometry::default();
    let spans: Vec<Vec2> = profile.windows(2).map(|w| w[1] - w[0]).collect();
    let flat: Vec<Vec2> = spans.iter().map(|s| Vec2::new(s.y, -s.x).normalize_or(Vec2::X)).collect();
    let reference = profile.iter().map(|p| p.x).fold(0.0, f32::max);
    let total: f32 = spans.iter().map(|s| s.length()).sum();
    let limit = crease.to_radians().cos();
    let smooth = |i: usize| i > 0 && i < spans.len() && flat[i - 1].dot(flat[i]) >= limit;
    let normal_at = |i: usize, span: usize| {
        if smooth(i) {
            (flat[i - 1] * spans[i - 1].length() + flat[i] * spans[i].length()).normalize_or(flat[span])
        } else {
            flat[span]
        }
    };
    let ring = |out: &mut Geometry, i: usize, span: usize, way: f32| -> u32 {
        let (p, n) = (profile[i], normal_at(i, span));
        let first = out.positions.len() as u32;
        for k in 0..=segments {
            // The last column stands exactly on the first, so that the seam is watertight.
            let (sin, cos) = (TAU * (k % segments) as f32 / segments as f32).sin_cos();
            let direction = |r: f32, y: f32| Vec3::new(r * sin, y, r * cos);
            let u = TAU * reference * k as f32 / segments as f32;
            out.vertex(direction(p.x, p.y), direction(n.x, n.y), Vec2::new(u, total - way));
        }
        first
    };
    let mut way = 0.0;
    let mut below = None;
    for (span, step) in spans.iter().enumerate() {
        let low = below.take().unwrap_or_else(|| ring(&mut out, span, span, way));
        way += step.length();
        let high = ring(&mut out, span + 1, span, way);
        for k in 0..segments as u32 {
            out.quad(low + k, low + k + 1, high + k + 1, high + k);
        }
        below = smooth(span + 1).then_some(high);
    }
    out
}

/// A closed cylinder of `radius` standing on y = 0.
pub(crate) fn cylinder(radius: f32, height: f32, segments: usize) -> Geometry {
    frustum(radius, radius, height, segments)
}

/// A closed truncated cone standing on y = 0; a radius of zero makes a point.
pub(crate) fn frustum(bottom: f32, top: f32, height: f32, segments: usize) -> Geometry {
    let mut profile = vec![Vec2::ZERO];
    profile.extend((bottom > 0.0).then_some(Vec2::new(bottom, 0.0)));
    profile.extend((top > 0.0).then_some(Vec2::new(top, height)));
    profile.push(Vec2::new(0.0, height));
    lathe(&profile, segments, 30.0)
}

/// A closed pipe standing on y = 0 with a bore of `inner` radius.
pub(crate) fn tube(outer: f32, inner: f32, height: f32, segments: usize) -> Geometry {
    let corners = [(inner, 0.0), (outer, 0.0), (outer, height), (inner, height), (inner, 0.0)];
    lathe(&corners.map(|(r, y)| Vec2::new(r, y)), segments, 30.0)
}

/// A closed solid: `profile` (counter-clockwise seen against the way, convex or not) swept along `path` and scaled by
/// `scale(i)` at point i. `smooth` shades across the profile's corners.
pub(crate) fn sweep(path: &[Vec3], profile: &[Vec2], smooth: bool, scale: impl Fn(usize) -> f32) -> Geometry {
    let mut out = Geometry::default();
    let tangent = |i: usize| {
        let (before, after) = (i.saturating_sub(1), (i + 1).min(path.len() - 1));
        (path[after] - path[before]).normalize_or(Vec3::Y)
    };
    let frames = frames(path.len(), tangent);
    let way = lengths(path);
    let point = |i: usize, p: Vec2| path[i] + (frames[i].0 * p.x + frames[i].1 * p.y) * scale(i);
    skin(&mut out, path.len(), profile, smooth, false, &point, &|i| frames[i], &|i| way[i]);
    for (end, sign) in [(0, -1.0), (path.len() - 1, 1.0)] {
        let normal = tangent(end) * sign;
        let ids: Vec<u32> = profile.iter().map(|p| out.vertex(point(end, *p), normal, *p)).collect();
        for [a, b, c] in triangulate(profile) {
            if sign > 0.0 {
                out.triangle(ids[a], ids[b], ids[c]);
            } else {
                out.triangle(ids[a], ids[c], ids[b]);
            }
        }
    }
    out
}

/// A closed ring: `profile` swept along a closed flat `path` (the last point joins the first).
pub(crate) fn loop_sweep(path: &[Vec3], profile: &[Vec2], smooth: bool) -> Geometry {
    let mut out = Geometry::default();
    let count = path.len();
    let tangent = |i: usize| (path[(i + 1) % count] - path[(i + count - 1) % count]).normalize_or(Vec3::X);
    // A flat path: the normal of its plane is one axis of every frame.
    let plane = (0..count).map(|i| path[i].cross(path[(i + 1) % count])).sum::<Vec3>().normalize_or(Vec3::Y);
    let frame = |i: usize| (plane.cross(tangent(i)).normalize_or(Vec3::X), plane);
    let frame = |i: usize| {
        let (x, y) = frame(i % count);
        // x × y must point along the way.
        if x.cross(y).dot(tangent(i % count)) > 0.0 { (x, y) } else { (-x, y) }
    };
    let mut closed = path.to_vec();
    closed.push(path[0]);
    let way = lengths(&closed);
    let point = |i: usize, p: Vec2| path[i % count] + frame(i).0 * p.x + frame(i).1 * p.y;
    skin(&mut out, count + 1, profile, smooth, true, &point, &frame, &|i| way[i]);
    out
}

/// The mantle of a sweep: `rows` rings of the profile's points.
#[allow(clippy::too_many_arguments)]
fn skin(
    out: &mut Geometry,
    rows: usize,
    profile: &[Vec2],
    smooth: bool,
    closed: bool,
    point: &dyn Fn(usize, Vec2) -> Vec3,
    frame: &dyn Fn(usize) -> (Vec3, Vec3),
    way: &dyn Fn(usize) -> f32,
) {
    let n = profile.len();
    let outward = |i: usize| {
        let edge = profile[(i + 1) % n] - profile[i % n];
        Vec2::new(edge.y, -edge.x).normalize_or(Vec2::X)
    };
    let mut around = 0.0;
    for side in 0..n {
        let (a, b) = (profile[side], profile[(side + 1) % n]);
        let (na, nb) = if smooth {
            (
                (outward(side + n - 1) + outward(side)).normalize_or(outward(side)),
                (outward(side) + outward(side + 1)).normalize_or(outward(side)),
            )
        } else {
            (outward(side), outward(side))
        };
        let next = around + (b - a).length();
        let first = out.positions.len() as u32;
        for row in 0..rows {
            let (x, y) = frame(row);
            // The last row of a ring is its first, bit for bit.
            let row_point = if closed && row + 1 == rows { 0 } else { row };
            out.vertex(point(row_point, a), x * na.x + y * na.y, Vec2::new(around, -way(row)));
            out.vertex(point(row_point, b), x * nb.x + y * nb.y, Vec2::new(next, -way(row)));
        }
        for row in 0..rows as u32 - 1 {
            let at = first + 2 * row;
            out.quad(at, at + 1, at + 3, at + 2);
        }
        around = next;
    }
}

/// Frames (x, y) with x × y along the way, turned as little as possible from point to point.
fn frames(count: usize, tangent: impl Fn(usize) -> Vec3) -> Vec<(Vec3, Vec3)> {
    let first = tangent(0);
    // A vertical way gets x = +X, a level one gets y = +Y: extrusions then lie as one expects.
    let mut x = if first.y.abs() > 0.99 { Vec3::X } else { Vec3::Y.cross(first).normalize_or(Vec3::X) };
    (0..count)
        .map(|i| {
            let t = tangent(i);
            x = (x - t * x.dot(t)).normalize_or(t.any_orthonormal_vector());
            (x, t.cross(x))
        })
        .collect()
}

fn lengths(path: &[Vec3]) -> Vec<f32> {
    let mut sum = 0.0;
    let steps = path.windows(2).map(|w| {
        sum += (w[1] - w[0]).length();
        sum
    });
    std::iter::once(0.0).chain(steps).collect()
}

/// A closed prism: the polygon (counter-clockwise in XY, simple) from z = 0 to z = `depth`.
pub(crate) fn extrude(polygon: &[Vec2], depth: f32) -> Geometry {
    sweep(&[Vec3::ZERO, Vec3::new(0.0, 0.0, depth)], polygon, false, |_| 1.0)
}

/// Ear clipping of a simple counter-clockwise polygon.
fn triangulate(polygon: &[Vec2]) -> Vec<[usize; 3]> {
    let mut left: Vec<usize> = (0..polygon.len()).collect();
    let mut out = Vec::new();
    let cross = |a: usize, b: usize, c: usize| (polygon[b] - polygon[a]).perp_dot(polygon[c] - polygon[a]);
    while left.len() > 3 {
        let n = left.len();
        let ear = (0..n).find(|&i| {
            let (a, b, c) = (left[(i + n - 1) % n], left[i], left[(i + 1) % n]);
            cross(a, b, c) > 1e-9
                && left
                    .iter()
                    .filter(|&&p| p != a && p != b && p != c)
                    .all(|&p| cross(a, b, p) < -1e-9 || cross(b, c, p) < -1e-9 || cross(c, a, p) < -1e-9)
        });
        // A polygon without an ear is not simple; cutting any corner still ends the loop.
        let i = ear.unwrap_or(0);
        out.push([left[(i + n - 1) % n], left[i], left[(i + 1) % n]]);
        left.remove(i);
    }
    if let [a, b, c] = left[..] {
        out.push([a, b, c]);
    }
    out
}

/// A horizontal rectangle at y = 0 facing up, from (−x/2, −z/2) to (x/2, z/2), cut into `cells_x` × `cells_z` quads.
pub(crate) fn sheet(x: f32, z: f32, cells_x: usize, cells_z: usize) -> Geometry {
    terrain(Vec2::new(-x, -z) * 0.5, Vec2::new(x, z) * 0.5, cells_x, cells_z, |_| 0.0)
}

/// A height field over a rectangle of (x, z), facing up, smooth.
pub(crate) fn terrain(min: Vec2, max: Vec2, cells_x: usize, cells_z: usize, height: impl Fn(Vec2) -> f32) -> Geometry {
    let mut out = Geometry::default();
    let step = (max - min) / Vec2::new(cells_x as f32, cells_z as f32);
    for j in 0..=cells_z {
        for i in 0..=cells_x {
            let p = min + step * Vec2::new(i as f32, j as f32);
            // Central differences of the height give the normal.
            let e = step * 0.5;
            let slope_x = (height(p + Vec2::new(e.x, 0.0)) - height(p - Vec2::new(e.x, 0.0))) / step.x;
            let slope_z = (height(p + Vec2::new(0.0, e.y)) - height(p - Vec2::new(0.0, e.y))) / step.y;
            out.vertex(Vec3::new(p.x, height(p), p.y), Vec3::new(-slope_x, 1.0, -slope_z).normalize(), p - min);
        }
    }
    let row = cells_x as u32 + 1;
    for j in 0..cells_z as u32 {
        for i in 0..cells_x as u32 {
            let at = j * row + i;
            out.quad(at + row, at + row + 1, at + 1, at);
        }
    }
    out
}

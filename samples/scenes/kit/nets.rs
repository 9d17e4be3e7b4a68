//! Smooth closed bodies from a signed distance: naive surface nets (Gibson 1998).

use super::Geometry;
use glam::{UVec3, Vec2, Vec3};

/// The surface where `distance` is zero (negative inside) in the box from `low` to `high`, sampled every `cell` metres.
/// Closed as long as it does not touch the box. Normals are gradients; uv is (x, −y).
pub(crate) fn surface_net(low: Vec3, high: Vec3, cell: f32, distance: impl Fn(Vec3) -> f32) -> Geometry {
    let count = ((high - low) / cell).ceil().as_uvec3() + UVec3::ONE;
    let at = |p: UVec3| low + p.as_vec3() * cell;
    let index = |p: UVec3| ((p.z * count.y + p.y) * count.x + p.x) as usize;
    let all = |size: UVec3| {
        (0..size.z).flat_map(move |z| (0..size.y).flat_map(move |y| (0..size.x).map(move |x| UVec3::new(x, y, z))))
    };
    // Samples by blocks of 4³: one that lies far from the surface by the field at its centre is of one sign throughout.
    // The margin allows for fields that grow up to 1.6 times as fast as distance.
    let mut values = vec![0.0; (count.x * count.y * count.z) as usize];
    for block in all((count + 3) / 4) {
        let (first, last) = (block * 4, (block * 4 + 4).min(count));
        let centre = distance(at(first) + 1.5 * cell);
        let far = centre.abs() > 1.6 * 1.5 * 3.0f32.sqrt() * cell;
        for offset in all(last - first) {
            let p = first + offset;
            values[index(p)] = if far { centre } else { distance(at(p)) };
        }
    }
    let inside = |p: UVec3| values[index(p)] < 0.0;
    let gradient = |p: Vec3| {
        let e = 0.25 * cell;
        let along = |axis: Vec3| distance(p + axis * e) - distance(p - axis * e);
        Vec3::new(along(Vec3::X), along(Vec3::Y), along(Vec3::Z)) / (2.0 * e)
    };

    let mut out = Geometry::default();
    let mut vertex_of = vec![u32::MAX; values.len()];
    let cells = count - UVec3::ONE;
    for p in all(cells) {
        let (mut sum, mut crossings) = (Vec3::ZERO, 0.0);
        for (axis, u, v) in
            [(UVec3::X, UVec3::Y, UVec3::Z), (UVec3::Y, UVec3::Z, UVec3::X), (UVec3::Z, UVec3::X, UVec3::Y)]
        {
            for offset in [UVec3::ZERO, u, v, u + v] {
                let (a, b) = (p + offset, p + offset + axis);
                if inside(a) != inside(b) {
                    let (da, db) = (values[index(a)], values[index(b)]);
                    sum += at(a).lerp(at(b), da / (da - db));
                    crossings += 1.0;
                }
            }
        }
        if crossings > 0.0 {
            let mut point = sum / crossings;
            // One step down the gradient brings the mean of the crossings onto the surface, but not out of its cell.
            let slope = gradient(point);
            let step = slope * (distance(point) / slope.length_squared().max(1e-3));
            point = (point - step.clamp_length_max(0.5 * cell)).clamp(at(p), at(p + UVec3::ONE));
            let normal = gradient(point).normalize_or(Vec3::Y);
            vertex_of[index(p)] = out.vertex(point, normal, Vec2::new(point.x, -point.y));
        }
    }
    for (axis, u, v) in [(UVec3::X, UVec3::Y, UVec3::Z), (UVec3::Y, UVec3::Z, UVec3::X), (UVec3::Z, UVec3::X, UVec3::Y)]
    {
        for p in all(cells).filter(|p| p.dot(u) > 0 && p.dot(v) > 0) {
            if inside(p) == inside(p + axis) {
                continue;
            }
            let [a, b, c, d] = [p - u - v, p - v, p, p - u].map(|q| vertex_of[index(q)]);
            let [a, b, c, d] = if inside(p) { [a, b, c, d] } else { [a, d, c, b] };
            // The diagonal along which the halves agree better with the normals.
            let agreement = |corners: [u32; 3]| {
                let [i, j, k] = corners.map(|i| i as usize);
                let face = (out.positions[j] - out.positions[i]).cross(out.positions[k] - out.positions[i]);
                face.normalize_or_zero().dot(out.normals[i] + out.normals[j] + out.normals[k])
            };
            let split = |halves: [[u32; 3]; 2]| agreement(halves[0]).min(agreement(halves[1]));
            if split([[a, b, c], [a, c, d]]) >= split([[b, c, d], [b, d, a]]) {
                out.quad(a, b, c, d);
            } else {
                out.quad(b, c, d, a);
            }
        }
    }
    out
}

/// Distance to a cone with round ends of radii `ra` at `a` and `rb` at `b`, close to exact where the radii are alike.
pub(crate) fn round_cone(p: Vec3, (a, ra): (Vec3, f32), (b, rb): (Vec3, f32)) -> f32 {
    let axis = b - a;
    let t = ((p - a).dot(axis) / axis.length_squared().max(1e-12)).clamp(0.0, 1.0);
    (p - a - axis * t).length() - (ra + (rb - ra) * t)
}

/// Union of two distances with a fillet of about `radius` (quadratic polynomial).
pub(crate) fn blend(a: f32, b: f32, radius: f32) -> f32 {
    let h = (radius - (a - b).abs()).max(0.0) / radius;
    a.min(b) - h * h * radius * 0.25
}

/// Intersection of two distances with an edge rounded by about `radius`.
pub(crate) fn blend_max(a: f32, b: f32, radius: f32) -> f32 {
    -blend(-a, -b, radius)
}

/// Signed distance to a simple polygon in its plane, negative inside.
pub(crate) fn polygon_distance(p: Vec2, polygon: &[Vec2]) -> f32 {
    let (mut nearest, mut inside) = (f32::INFINITY, false);
    for i in 0..polygon.len() {
        let (a, b) = (polygon[i], polygon[(i + 1) % polygon.len()]);
        let (edge, way) = (b - a, p - a);
        let t = (way.dot(edge) / edge.length_squared().max(1e-12)).clamp(0.0, 1.0);
        nearest = nearest.min((way - edge * t).length_squared());
        // Crossings of the ray towards +x.
        if (a.y > p.y) != (b.y > p.y) && p.x < a.x + edge.x * (p.y - a.y) / edge.y {
            inside = !inside;
        }
    }
    if inside { -nearest.sqrt() } else { nearest.sqrt() }
}

/// A sheet of `cells` that lies `offset` metres outside the surface of a body: `ray` gives origin and direction towards
/// the body for (u, v) in [0, 1]². Rays that miss stop where they come nearest.
pub(crate) fn shrink_wrap(
    cells: (usize, usize),
    offset: f32,
    ray: impl Fn(f32, f32) -> (Vec3, Vec3),
    distance: impl Fn(Vec3) -> f32,
) -> Geometry {
    let mut out = Geometry::default();
    for j in 0..=cells.1 {
        for i in 0..=cells.0 {
            let (u, v) = (i as f32 / cells.0 as f32, j as f32 / cells.1 as f32);
            let (origin, direction) = ray(u, v);
            let mut p = origin;
            for _ in 0..96 {
                let left = distance(p) - offset;
                p += direction * left * 0.8;
                if left.abs() < 2e-5 {
                    break;
                }
            }
            let along = |axis: Vec3| distance(p + axis * 0.01) - distance(p - axis * 0.01);
            let normal = Vec3::new(along(Vec3::X), along(Vec3::Y), along(Vec3::Z)).normalize_or(-direction);
            out.vertex(p, normal, Vec2::new(u, 1.0 - v));
        }
    }
    let row = cells.0 as u32 + 1;
    for at in (0..cells.1 as u32).flat_map(|j| (0..cells.0 as u32).map(move |i| j * row + i)) {
        let [a, b, d] = [at, at + 1, at + row].map(|i| out.positions[i as usize]);
        if (b - a).cross(d - a).dot(out.normals[at as usize]) > 0.0 {
            out.quad(at, at + 1, at + row + 1, at + row);
        } else {
            out.quad(at, at + row, at + row + 1, at + 1);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn net_of_a_ball_is_a_ball() {
        let ball = surface_net(Vec3::splat(-1.2), Vec3::splat(1.2), 0.1, |p| p.length() - 1.0);
        for (p, n) in ball.positions.iter().zip(&ball.normals) {
            assert!((p.length() - 1.0).abs() < 2e-3 && n.dot(p.normalize()) > 0.999);
        }
        let six_fold: f32 = ball
            .indices
            .chunks_exact(3)
            .map(|c| {
                ball.positions[c[0] as usize].dot(ball.positions[c[1] as usize].cross(ball.positions[c[2] as usize]))
            })
            .sum();
        let expected = 4.0 / 3.0 * std::f32::consts::PI;
        assert!((six_fold / 6.0 / expected - 1.0).abs() < 0.02, "{}", six_fold / 6.0);
    }
}

//! Mouldings: a profile along a way with mitred corners, as skirting boards, cornices and picture frames have.

use super::Geometry;
use glam::{Vec2, Vec3, vec2};

/// A strip along `path` in the plane z = 0, closed or open, that has `profile` across: x metres to the left of the way, y metres
/// above the plane. What the profile passes on its right side is outside: it begins low on the left. Corners are mitred.
///
/// The side towards the plane and the ends stay open, as both lie against other things.
pub(crate) fn moulding(path: &[Vec2], closed: bool, profile: &[Vec2]) -> Geometry {
    let count = path.len();
    let legs = if closed { count } else { count - 1 };
    let along = |leg: usize| (path[(leg + 1) % count] - path[leg]).normalize_or(Vec2::X);
    let left = |leg: usize| along(leg).perp();
    // How far a metre to the left of both legs lies from their corner.
    let mitre = |corner: usize| {
        let after = left(corner.min(legs - 1));
        let before = match corner {
            0 if closed => left(legs - 1),
            0 => after,
            _ => left(corner - 1),
        };
        (before + after) / (1.0 + before.dot(after)).max(0.05)
    };
    let mut out = Geometry::default();
    let mut start = 0.0;
    for leg in 0..legs {
        let (from, to) = (leg, (leg + 1) % count);
        let direction = along(leg).extend(0.0);
        let mitres = [mitre(from), mitre(if closed { to } else { leg + 1 })];
        let point = |end: usize, p: Vec2| (path[[from, to][end]] + mitres[end] * p.x).extend(p.y);
        let mut across = 0.0;
        for pair in profile.windows(2) {
            let step = left(leg).extend(0.0) * (pair[1].x - pair[0].x) + Vec3::Z * (pair[1].y - pair[0].y);
            let normal = step.cross(direction).normalize_or(Vec3::Z);
            let next = across + step.length();
            let mut vertex = |end: usize, p: Vec2, v: f32| {
                let place = point(end, p);
                out.vertex(place, normal, vec2(start + (place - path[from].extend(0.0)).dot(direction), v))
            };
            let ids = [vertex(0, pair[0], across), vertex(0, pair[1], next), vertex(1, pair[1], next)];
            let last = vertex(1, pair[0], across);
            out.quad(ids[0], ids[1], ids[2], last);
            across = next;
        }
        start += (path[to] - path[from]).length();
    }
    out
}

/// A mitred frame around a rectangle of `size` around the origin, its back on z = 0: `width` wide, `depth` deep, with a step down to
/// what it frames.
pub(crate) fn picture_frame(size: Vec2, width: f32, depth: f32) -> Geometry {
    let half = 0.5 * size;
    let path = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| half * vec2(x, y));
    let profile =
        [(0.0, 0.0), (0.0, 0.35), (-0.2, 0.5), (-0.28, 0.8), (-0.45, 1.0), (-0.75, 1.0), (-1.0, 0.7), (-1.0, 0.0)];
    moulding(&path, true, &profile.map(|(x, y)| vec2(x * width, y * depth)))
}

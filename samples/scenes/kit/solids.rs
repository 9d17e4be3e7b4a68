//! Closed solids with flat faces, spheres and tori. Every one is watertight.

use super::{Geometry, lathe, loop_sweep, surfaces::circle};
use glam::{Vec2, Vec3};

/// The six faces of a box: outward axis, then right and up axes so that right × up = outward.
const FACES: [(Vec3, Vec3, Vec3); 6] = [
    (Vec3::X, Vec3::NEG_Z, Vec3::Y),
    (Vec3::NEG_X, Vec3::Z, Vec3::Y),
    (Vec3::Y, Vec3::X, Vec3::NEG_Z),
    (Vec3::NEG_Y, Vec3::X, Vec3::Z),
    (Vec3::Z, Vec3::X, Vec3::Y),
    (Vec3::NEG_Z, Vec3::NEG_X, Vec3::Y),
];

/// A box of full extents `x`, `y`, `z` around the origin; 12 triangles.
pub(crate) fn cuboid(x: f32, y: f32, z: f32) -> Geometry {
    let half = Vec3::new(x, y, z) * 0.5;
    let mut out = Geometry::default();
    for (normal, right, up) in FACES {
        let corner = |r: f32, u: f32| (normal + r * right + u * up) * half;
        out.flat_quad([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]);
    }
    out
}

/// A box between two corners; 12 triangles.
pub(crate) fn slab(min: [f32; 3], max: [f32; 3]) -> Geometry {
    let (min, max) = (Vec3::from(min), Vec3::from(max));
    let size = max - min;
    let centre = (min + max) * 0.5;
    cuboid(size.x, size.y, size.z).at(centre.x, centre.y, centre.z)
}

/// A box of full extents `x`, `y`, `z` around the origin whose edges are bevelled by `bevel` metres and shaded round;
/// 44 triangles.
pub(crate) fn bevel_box(x: f32, y: f32, z: f32, bevel: f32) -> Geometry {
    let half = Vec3::new(x, y, z) * 0.5;
    let bevel = bevel.min(half.min_element() * 0.98);
    let mut out = Geometry::default();
    // Vertex of face `normal` at the box corner with signs `corner`: inset along the two other axes.
    let place = |normal: Vec3, corner: Vec3| corner * (half - (Vec3::ONE - normal.abs()) * bevel);
    let mut ids = [[0u32; 8]; 6];
    for (face, (normal, right, up)) in FACES.iter().enumerate() {
        for (r, u) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
            let corner = *normal + r * *right + u * *up;
            let position = place(*normal, corner);
            let uv = Vec2::new((position + half).dot(right.abs()), (half - position).dot(up.abs()));
            ids[face][corner_index(corner)] = out.vertex(position, *normal, uv);
        }
        let at = |r: f32, u: f32| ids[face][corner_index(*normal + r * *right + u * *up)];
        out.quad(at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0));
    }
    for (face_a, (a, ..)) in FACES.iter().enumerate() {
        for (face_b, (b, ..)) in FACES.iter().enumerate().filter(|(f, (b, ..))| *f > face_a && a.dot(*b) == 0.0) {
            let along = a.cross(*b);
            let (low, high) = (corner_index(*a + *b - along), corner_index(*a + *b + along));
            out.quad(ids[face_a][low], ids[face_b][low], ids[face_b][high], ids[face_a][high]);
        }
    }
    let both = [1.0f32, -1.0];
    let corners = both.into_iter().flat_map(|x| both.into_iter().flat_map(move |y| both.map(|z| Vec3::new(x, y, z))));
    for corner in corners {
        let on = |axis: usize| ids[axis * 2 + usize::from(corner[axis] < 0.0)][corner_index(corner)];
        if corner.element_product() > 0.0 {
            out.triangle(on(0), on(1), on(2));
        } else {
            out.triangle(on(0), on(2), on(1));
        }
    }
    out
}

/// Number of the box corner with these signs: bit a is set where axis a is positive.
fn corner_index(signs: Vec3) -> usize {
    usize::from(signs.x > 0.0) | usize::from(signs.y > 0.0) << 1 | usize::from(signs.z > 0.0) << 2
}

/// A sphere of `radius` around the origin with poles on Y; 2 · segments · (rings − 1) triangles.
pub(crate) fn sphere(radius: f32, segments: usize, rings: usize) -> Geometry {
    let profile: Vec<Vec2> = (0..=rings)
        .map(|i| {
            let (sin, cos) = (std::f32::consts::PI * i as f32 / rings as f32).sin_cos();
            if i == 0 || i == rings {
                Vec2::new(0.0, -radius * cos.signum())
            } else {
                Vec2::new(radius * sin, -radius * cos)
            }
        })
        .collect();
    let mut out = lathe(&profile, segments, 180.0);
    for (position, normal) in out.positions.iter().zip(&mut out.normals) {
        *normal = position.normalize();
    }
    out
}

/// A torus around the Y axis: `radius` of the ring, `thickness` its radius across; 2 · segments · sides triangles.
pub(crate) fn torus(radius: f32, thickness: f32, segments: usize, sides: usize) -> Geometry {
    let ring: Vec<Vec3> = circle(radius, segments).iter().map(|p| Vec3::new(p.x, 0.0, -p.y)).collect();
    loop_sweep(&ring, &circle(thickness, sides), true)
}

/// A rectangular hole through a [`wall`], metres from the wall's lower left corner.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Opening {
    pub left: f32,
    pub bottom: f32,
    pub width: f32,
    pub height: f32,
}

/// A wall of `width` × `height` standing on y = 0, x from 0 to width, front at z = 0 facing +Z, back at −`thickness`,
/// with openings. Watertight as long as openings do not touch each other.
pub(crate) fn wall(width: f32, height: f32, thickness: f32, openings: &[Opening]) -> Geometry {
    let cuts = |full: f32, edges: Vec<f32>| {
        let mut cuts: Vec<f32> = [0.0, full].into_iter().chain(edges.into_iter().map(|e| e.clamp(0.0, full))).collect();
        cuts.sort_by(f32::total_cmp);
        cuts.dedup_by(|a, b| (*a - *b).abs() < 1e-5);
        cuts
    };
    let xs = cuts(width, openings.iter().flat_map(|o| [o.left, o.left + o.width]).collect());
    let ys = cuts(height, openings.iter().flat_map(|o| [o.bottom, o.bottom + o.height]).collect());
    let solid = |i: isize, j: isize| {
        if i < 0 || j < 0 || i as usize + 1 >= xs.len() || j as usize + 1 >= ys.len() {
            return false;
        }
        let (i, j) = (i as usize, j as usize);
        let (x, y) = ((xs[i] + xs[i + 1]) * 0.5, (ys[j] + ys[j + 1]) * 0.5);
        !openings.iter().any(|o| x > o.left && x < o.left + o.width && y > o.bottom && y < o.bottom + o.height)
    };
    let mut out = Geometry::default();
    let mut face = |corners: [Vec3; 4], uv: &dyn Fn(Vec3) -> Vec2| {
        let normal = (corners[2] - corners[0]).cross(corners[3] - corners[1]).normalize_or(Vec3::Z);
        let ids = corners.map(|p| out.vertex(p, normal, uv(p)));
        out.quad(ids[0], ids[1], ids[2], ids[3]);
    };
    for i in 0..xs.len() - 1 {
        for j in 0..ys.len() - 1 {
            let (si, sj) = (i as isize, j as isize);
            if !solid(si, sj) {
                continue;
            }
            let (x0, x1, y0, y1) = (xs[i], xs[i + 1], ys[j], ys[j + 1]);
            let p = |x: f32, y: f32, back: bool| Vec3::new(x, y, if back { -thickness } else { 0.0 });
            let front_uv = |q: Vec3| Vec2::new(q.x, -q.y);
            let side_uv = |q: Vec3| Vec2::new(q.z, -q.y);
            let top_uv = |q: Vec3| Vec2::new(q.x, q.z);
            face([p(x0, y0, false), p(x1, y0, false), p(x1, y1, false), p(x0, y1, false)], &front_uv);
            face([p(x1, y0, true), p(x0, y0, true), p(x0, y1, true), p(x1, y1, true)], &front_uv);
            if !solid(si - 1, sj) {
                face([p(x0, y0, true), p(x0, y0, false), p(x0, y1, false), p(x0, y1, true)], &side_uv);
            }
            if !solid(si + 1, sj) {
                face([p(x1, y0, false), p(x1, y0, true), p(x1, y1, true), p(x1, y1, false)], &side_uv);
            }
            if !solid(si, sj - 1) {
                face([p(x0, y0, true), p(x1, y0, true), p(x1, y0, false), p(x0, y0, false)], &top_uv);
            }
            if !solid(si, sj + 1) {
                face([p(x0, y1, false), p(x1, y1, false), p(x1, y1, true), p(x0, y1, true)], &top_uv);
            }
        }
    }
    out
}

//! Walls with round-arched holes, and the shell of the apse. Each is closed, and neighbours share every vertex of an edge.

use super::super::kit::{Geometry, Model};
use glam::{Vec2, Vec3, vec2, vec3};
use std::f32::consts::PI;

/// Steps of a half circle.
const STEPS: usize = 28;

/// A hole with a round arch, metres in the plane of its wall.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arch {
    pub middle: f32,
    /// Half the width, the arch's radius.
    pub half: f32,
    /// Height of the sill. A hole that begins at the wall's base or below has no sill.
    pub bottom: f32,
    /// Height at which the arch begins.
    pub spring: f32,
}

impl Arch {
    fn ends(&self) -> [f32; 2] {
        [self.middle - self.half, self.middle + self.half]
    }

    /// Height of the hole's top at `x`.
    fn top(&self, x: f32) -> f32 {
        // The root would magnify the rounding of x at the ends.
        if self.ends().iter().any(|end| (end - x).abs() < 1e-4) {
            return self.spring;
        }
        self.spring + (self.half * self.half - (x - self.middle).powi(2)).max(0.0).sqrt()
    }

    /// The hole's outline in (x, y) without its sill: up the left jamb, over the arch, down the right jamb.
    pub fn outline(&self, steps: usize) -> Vec<Vec2> {
        let arch = (0..=steps).map(|i| {
            let (sin, cos) = (PI * i as f32 / steps as f32).sin_cos();
            vec2(self.middle - self.half * cos, self.spring + self.half * sin)
        });
        let [left, right] = self.ends().map(|x| vec2(x, self.bottom));
        [left].into_iter().chain(arch).chain([right]).collect()
    }
}

/// A wall along +X from x = 0, its front at z = 0 towards +Z.
pub(super) struct Wall<'a> {
    pub width: f32,
    /// Height of its foot.
    pub base: f32,
    pub thickness: f32,
    /// Height of its top at x, at its front (0) or at its back (−thickness).
    pub top: &'a dyn Fn(f32, f32) -> f32,
    /// Kinks of the top, besides its ends.
    pub kinks: &'a [f32],
    pub arches: &'a [Arch],
}

/// A solid part of a column between two vertical lines: heights at its left and right.
struct Piece {
    low: [f32; 2],
    high: [f32; 2],
    /// The arch below it, and whether a hole is above it.
    under: Option<Arch>,
    sill: bool,
}

/// One face of a wall: its columns and the heights of vertices on the lines between them.
struct Face {
    columns: Vec<Vec<Piece>>,
    lines: Vec<Vec<f32>>,
}

impl Wall<'_> {
    /// The wall with its front and the holes' sides of one material, the rest of another.
    pub fn build(&self, room: u32, outer: u32) -> Model {
        let cuts = self.cuts();
        let [front, back] = [0.0, -self.thickness].map(|z| self.face(&cuts, z));
        let mut inside = Geometry::default();
        let mut outside = Geometry::default();
        fill(&mut inside, &cuts, &front, 0.0);
        fill(&mut outside, &cuts, &back, -self.thickness);
        for k in 0..front.columns.len() {
            for (near, far) in front.columns[k].iter().zip(&back.columns[k]) {
                self.across(&mut inside, &mut outside, [cuts[k], cuts[k + 1]], near, far);
            }
        }
        for (k, x) in cuts.iter().enumerate() {
            let end = k == 0 || k + 1 == cuts.len();
            self.along(if end { &mut outside } else { &mut inside }, *x, k, &front, &back);
        }
        let mut model = Model::of(room, inside);
        model.add(outer, outside);
        model
    }

    /// Where vertical lines stand: at ends, at kinks, at steps of arches.
    fn cuts(&self) -> Vec<f32> {
        let mut cuts = vec![0.0, self.width];
        cuts.extend(self.arches.iter().flat_map(Arch::ends));
        cuts.extend(self.kinks);
        for arch in self.arches {
            for p in arch.outline(STEPS) {
                if cuts.iter().all(|known| (known - p.x).abs() > 0.004) {
                    cuts.push(p.x);
                }
            }
        }
        cuts.sort_by(f32::total_cmp);
        cuts
    }

    fn face(&self, cuts: &[f32], z: f32) -> Face {
        let columns: Vec<Vec<Piece>> = cuts.windows(2).map(|x| self.pieces(x[0], x[1], z)).collect();
        let heights = |k: usize| {
            let side = |column: Option<&Vec<Piece>>, side: usize| -> Vec<f32> {
                column.into_iter().flatten().flat_map(|p| [p.low[side], p.high[side]]).collect()
            };
            let mut heights = side(k.checked_sub(1).map(|k| &columns[k]), 1);
            heights.extend(side(columns.get(k), 0));
            heights.sort_by(f32::total_cmp);
            heights.dedup();
            heights
        };
        let lines = (0..cuts.len()).map(heights).collect();
        Face { columns, lines }
    }

    fn pieces(&self, a: f32, b: f32, z: f32) -> Vec<Piece> {
        let middle = 0.5 * (a + b);
        let mut here: Vec<Arch> =
            self.arches.iter().filter(|arch| (arch.middle - middle).abs() < arch.half).copied().collect();
        here.sort_by(|p, q| p.bottom.total_cmp(&q.bottom));
        let mut pieces = Vec::new();
        let (mut low, mut under) = ([self.base; 2], None);
        for arch in here {
            if arch.bottom > low[0].max(low[1]) {
                pieces.push(Piece { low, high: [arch.bottom; 2], under, sill: true });
            }
            (low, under) = ([arch.top(a), arch.top(b)], Some(arch));
        }
        pieces.push(Piece { low, high: [(self.top)(a, z), (self.top)(b, z)], under, sill: false });
        pieces
    }

    /// The faces of a piece below and above it, from the front to the back.
    fn across(&self, inside: &mut Geometry, outside: &mut Geometry, x: [f32; 2], near: &Piece, far: &Piece) {
        let z = -self.thickness;
        let [a, b] = [0, 1].map(|i| vec3(x[i], near.low[i], 0.0));
        let [d, c] = [0, 1].map(|i| vec3(x[i], far.low[i], z));
        if let Some(arch) = near.under {
            let centre = vec2(arch.middle, arch.spring);
            let inward = |p: Vec3| (centre - p.truncate()).normalize_or(Vec2::NEG_Y).extend(0.0);
            let around = |p: Vec3| arch.half * (p.x - arch.middle).atan2(p.y - arch.spring);
            let ids = [a, d, c, b].map(|p| inside.vertex(p, inward(p), vec2(around(p), p.z)));
            inside.quad(ids[0], ids[1], ids[2], ids[3]);
        } else {
            flat(outside, [a, d, c, b], |p| vec2(p.x, p.z));
        }
        let [a, b] = [0, 1].map(|i| vec3(x[i], near.high[i], 0.0));
        let [d, c] = [0, 1].map(|i| vec3(x[i], far.high[i], z));
        flat(if near.sill { inside } else { outside }, [a, b, c, d], |p| vec2(p.x, p.z));
    }

    /// Faces across the wall on a vertical line, where only one side of it is solid.
    fn along(&self, out: &mut Geometry, x: f32, k: usize, front: &Face, back: &Face) {
        let solid = |column: Option<&Vec<Piece>>, side: usize, y: f32| {
            column.into_iter().flatten().any(|p| p.low[side] < y && y < p.high[side])
        };
        // Lines of both faces differ in the height of the top only.
        for (near, far) in front.lines[k].windows(2).zip(back.lines[k].windows(2)) {
            let y = 0.5 * (near[0] + near[1]);
            let left = solid(k.checked_sub(1).map(|k| &front.columns[k]), 1, y);
            let right = solid(front.columns.get(k), 0, y);
            let [a, b] = [vec3(x, near[0], 0.0), vec3(x, near[1], 0.0)];
            let [d, c] = [vec3(x, far[0], -self.thickness), vec3(x, far[1], -self.thickness)];
            match (left, right) {
                (true, false) => flat(out, [a, d, c, b], |p| vec2(p.z, -p.y)),
                (false, true) => flat(out, [a, b, c, d], |p| vec2(p.z, -p.y)),
                _ => {}
            }
        }
    }
}

fn flat(out: &mut Geometry, corners: [Vec3; 4], uv: impl Fn(Vec3) -> Vec2) {
    let normal = (corners[2] - corners[0]).cross(corners[3] - corners[1]).normalize_or(Vec3::Y);
    let ids = corners.map(|p| out.vertex(p, normal, uv(p)));
    out.quad(ids[0], ids[1], ids[2], ids[3]);
}

/// Fills a face at `z`; the one at the back (z below zero) looks towards −Z.
fn fill(out: &mut Geometry, cuts: &[f32], face: &Face, z: f32) {
    let back = z < 0.0;
    let normal = if back { Vec3::NEG_Z } else { Vec3::Z };
    for (k, column) in face.columns.iter().enumerate() {
        for piece in column {
            let [left, right] = [0, 1].map(|side| {
                let heights = face.lines[k + side].iter().filter(|y| (piece.low[side]..=piece.high[side]).contains(y));
                let point = |y: &f32| out.vertex(vec3(cuts[k + side], *y, z), normal, vec2(cuts[k + side], -*y));
                heights.map(point).collect::<Vec<u32>>()
            });
            let (mut i, mut j) = (0, 0);
            while i + 1 < left.len() || j + 1 < right.len() {
                let height = |ids: &[u32], at: usize| ids.get(at).map(|id| out.positions[*id as usize].y);
                let corner = match (height(&left, i + 1), height(&right, j + 1)) {
                    (Some(l), Some(r)) if l <= r => left[i + 1],
                    (Some(_), None) => left[i + 1],
                    _ => right[j + 1],
                };
                let (a, b) = if back { (right[j], left[i]) } else { (left[i], right[j]) };
                out.triangle(a, b, corner);
                if left.get(i + 1) == Some(&corner) { i += 1 } else { j += 1 }
            }
        }
    }
}

/// A shell of half a turn about Y towards +X: `inner` and `outer` are lines of (radius, height), equally many points, from
/// the foot to the axis.
pub(super) fn half_shell(inner: &[Vec2], outer: &[Vec2], segments: usize, room: u32, roof: u32) -> Model {
    let point = |p: Vec2, k: usize| {
        let (sin, cos) = (PI * (k as f32 / segments as f32 - 0.5)).sin_cos();
        vec3(p.x * cos, p.y, p.x * sin)
    };
    let mantle = |line: &[Vec2], sign: f32| {
        let mut out = Geometry::default();
        let mut way = 0.0;
        for (i, span) in line.windows(2).enumerate() {
            let flat = |i: usize| (line[i + 1] - line[i]).perp().normalize_or(Vec2::NEG_X);
            let soft = |other: Option<usize>| match other.map(flat) {
                Some(next) if next.dot(flat(i)) > 0.85 => (next + flat(i)).normalize_or(next),
                _ => flat(i),
            };
            let normals = [soft(i.checked_sub(1)), soft((i + 2 < line.len()).then_some(i + 1))];
            for k in 0..segments {
                let corner = |end: usize, k: usize, out: &mut Geometry| {
                    let uv = vec2(
                        line[0].x * PI * k as f32 / segments as f32,
                        -way - end as f32 * span[0].distance(span[1]),
                    );
                    let axis = point(vec2(1.0, 0.0), k);
                    let normal = (axis * normals[end].x + Vec3::Y * normals[end].y) * sign;
                    out.vertex(point(span[end], k), normal, uv)
                };
                let [a, b] = [k, k + 1].map(|k| corner(0, k, &mut out));
                let [d, c] = [k, k + 1].map(|k| corner(1, k, &mut out));
                // Seen from the axis, a growing angle about it goes to the right.
                if sign > 0.0 { out.quad(a, b, c, d) } else { out.quad(a, d, c, b) }
            }
            way += span[0].distance(span[1]);
        }
        out
    };
    let mut model = Model::of(room, mantle(inner, 1.0));
    let mut rest = mantle(outer, -1.0);
    for k in 0..segments {
        let [a, b] = [k, k + 1].map(|k| point(inner[0], k));
        let [d, c] = [k, k + 1].map(|k| point(outer[0], k));
        flat(&mut rest, [a, d, c, b], |p| vec2(p.x, p.z));
    }
    for i in 0..inner.len() - 1 {
        for (k, swap) in [(0, true), (segments, false)] {
            let [a, b] = [point(inner[i], k), point(outer[i], k)];
            let [d, c] = [point(inner[i + 1], k), point(outer[i + 1], k)];
            flat(&mut rest, if swap { [a, d, c, b] } else { [a, b, c, d] }, |p| vec2(p.z, -p.y));
        }
    }
    model.add(roof, rest);
    model
}

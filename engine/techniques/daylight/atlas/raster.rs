//! The list of the texels that the charts cover.

use glam::{DVec2, Vec2};

use super::Atlas;

/// A texel that a chart covers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Texel {
    /// The column.
    pub x: u32,
    /// The row.
    pub y: u32,
    /// The triangle, an index into [`Atlas::corners`].
    pub triangle: u32,
    /// The weights of corner 1 and of corner 2 at the texel centre.
    ///
    /// If the centre lies outside the triangle, they belong to the nearest point of the triangle.
    pub barycentric: [f32; 2],
    /// From the texel centre to that point, texels.
    pub offset: [f32; 2],
}

/// What makes one triangle the better choice for a texel: a smaller value wins.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
struct Rank {
    /// A degenerate triangle loses to any other.
    is_flat: bool,
    /// The squared distance from the texel centre in texels.
    distance: f64,
    /// The index of the triangle.
    triangle: u32,
}

/// Weights are rounded to 32 bits: by less than so many texels at the far end of a triangle as wide as a lightmap.
const ROUNDED: f64 = 1e-3;
/// Points of [`spread`] along a side of a texel.
const GRID: u32 = 4;

/// Lists every texel that a chart covers, sorted by row and then by column.
///
/// The coverage is conservative: a texel is covered if its open square touches a triangle. Every texel comes once. It
/// takes the triangle that contains its centre, else the nearest triangle.
pub fn texels(atlas: &Atlas) -> Vec<Texel> {
    let rows = Rows::new(atlas);
    let mut active: Vec<u32> = Vec::new();
    let mut best: Vec<Option<(Rank, [f32; 2])>> = vec![None; atlas.width as usize];
    let mut result = Vec::new();
    for y in 0..atlas.height {
        active.retain(|&triangle| row_range(&atlas.corners[triangle as usize]).1 >= y);
        active.extend_from_slice(rows.starting(y));
        let (mut first, mut last) = (u32::MAX, 0);
        for &triangle in &active {
            let corners = &atlas.corners[triangle as usize];
            let (from, to) = columns(corners, y, atlas.width);
            first = first.min(from);
            last = last.max(to);
            let flat = corners.map(Vec2::as_dvec2);
            let is_flat = is_flat(&flat);
            for x in from..=to {
                let centre = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
                let (barycentric, distance) = nearest(&flat, centre);
                let rank = Rank { is_flat, distance, triangle };
                let slot = &mut best[x as usize];
                if slot.is_none_or(|(old, _)| rank < old) {
                    *slot = Some((rank, barycentric));
                }
            }
        }
        if first <= last {
            for x in first..=last {
                if let Some((rank, barycentric)) = best[x as usize].take() {
                    result.push(texel([x, y], rank, barycentric, atlas));
                }
            }
        }
    }
    result
}

/// The texel with its place in the triangle of its rank.
fn texel([x, y]: [u32; 2], rank: Rank, barycentric: [f32; 2], atlas: &Atlas) -> Texel {
    let centre = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
    let corners = atlas.corners[rank.triangle as usize].map(|corner| corner.as_dvec2());
    let offset = if rank.distance == 0.0 { DVec2::ZERO } else { point(&corners, barycentric) - centre };
    Texel { x, y, triangle: rank.triangle, barycentric, offset: offset.as_vec2().to_array() }
}

/// Lists places of a covered texel where its light can be gathered, the nearest to its centre first: the points of its charts that are the
/// nearest to a grid of [`GRID`] × [`GRID`] points in the texel, without those outside of the texel. `triangles`: indices of all triangles that may
/// touch the texel.
pub(in super::super) fn spread(corners: &[[Vec2; 3]], triangles: &[u32], [x, y]: [u32; 2]) -> Vec<(u32, [f32; 2])> {
    let touches = |corners: &[Vec2; 3]| {
        let [(left, right), (top, bottom)] = touched_by(corners);
        (left..=right).contains(&x) && (top..=bottom).contains(&y) && {
            let (first, last) = columns(corners, y, u32::MAX);
            (first..=last).contains(&x)
        }
    };
    let near: Vec<(u32, [DVec2; 3])> = triangles
        .iter()
        .map(|triangle| (*triangle, &corners[*triangle as usize]))
        .filter(|(_, corners)| touches(corners))
        .map(|(triangle, corners)| (triangle, corners.map(|corner| corner.as_dvec2())))
        .collect();
    let corner = DVec2::new(f64::from(x), f64::from(y));
    let step = |number: u32| (f64::from(number) + 0.5) / f64::from(GRID);
    let mut found: Vec<(f64, u32, [f32; 2])> = Vec::new();
    for wanted in (0..GRID * GRID).map(|i| corner + DVec2::new(step(i % GRID), step(i / GRID))) {
        let best = near
            .iter()
            .map(|(triangle, flat)| {
                let (barycentric, distance) = nearest(flat, wanted);
                (Rank { is_flat: is_flat(flat), distance, triangle: *triangle }, barycentric, flat)
            })
            .reduce(|best, next| if next.0 < best.0 { next } else { best });
        let Some((rank, weights, flat)) = best else { continue };
        let inside = point(flat, weights) - corner;
        let is_new = !found.iter().any(|(_, triangle, known)| (*triangle, *known) == (rank.triangle, weights));
        if is_new && inside.cmpge(DVec2::splat(-ROUNDED)).all() && inside.cmple(DVec2::splat(1.0 + ROUNDED)).all() {
            found.push((inside.distance_squared(DVec2::splat(0.5)), rank.triangle, weights));
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found.into_iter().map(|(_, triangle, barycentric)| (triangle, barycentric)).collect()
}

/// Whether a triangle has no area.
fn is_flat(corners: &[DVec2; 3]) -> bool {
    (corners[1] - corners[0]).perp_dot(corners[2] - corners[0]) == 0.0
}

/// The triangles with a place, sorted by their first row.
struct Rows {
    starts: Vec<usize>,
    triangles: Vec<u32>,
}

impl Rows {
    fn new(atlas: &Atlas) -> Self {
        let first = |corners: &[Vec2; 3]| row_range(corners).0.min(atlas.height.saturating_sub(1)) as usize;
        let mut starts = vec![0; atlas.height as usize + 1];
        let placed = || atlas.corners.iter().enumerate().filter(|(_, corners)| corners[0].is_finite());
        for (_, corners) in placed() {
            starts[first(corners) + 1] += 1;
        }
        for row in 0..atlas.height as usize {
            starts[row + 1] += starts[row];
        }
        let mut next = starts.clone();
        let mut triangles = vec![0; starts[atlas.height as usize]];
        for (index, corners) in placed() {
            let slot = &mut next[first(corners)];
            triangles[*slot] = index as u32;
            *slot += 1;
        }
        Self { starts, triangles }
    }

    fn starting(&self, row: u32) -> &[u32] {
        &self.triangles[self.starts[row as usize]..self.starts[row as usize + 1]]
    }
}

/// Gives the first and the last texel whose open square touches the range from `low` to `high`.
fn touched(low: f64, high: f64) -> (u32, u32) {
    let first = low.floor().max(0.0);
    ((first) as u32, (high.ceil() - 1.0).max(first) as u32)
}

/// Gives the texels that the box of a triangle touches: its first and its last column, and its first and its last row.
pub(in super::super) fn touched_by([a, b, c]: &[Vec2; 3]) -> [(u32, u32); 2] {
    [[a.x, b.x, c.x], [a.y, b.y, c.y]].map(|of| {
        let [first, second, third] = of.map(f64::from);
        touched(first.min(second).min(third), first.max(second).max(third))
    })
}

/// Gives the first and the last row of a triangle.
fn row_range(corners: &[Vec2; 3]) -> (u32, u32) {
    touched_by(corners)[1]
}

/// Gives the first and the last column that a triangle touches in a row.
fn columns(corners: &[Vec2; 3], row: u32, width: u32) -> (u32, u32) {
    let (top, bottom) = (f64::from(row), f64::from(row) + 1.0);
    let (mut left, mut right) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut add = |x: f64| {
        left = left.min(x);
        right = right.max(x);
    };
    for k in 0..3 {
        let (a, b) = (corners[k].as_dvec2(), corners[(k + 1) % 3].as_dvec2());
        if a.y >= top && a.y <= bottom {
            add(a.x);
        }
        for line in [top, bottom] {
            if (a.y < line) != (b.y < line) {
                add(a.x + (b.x - a.x) * ((line - a.y) / (b.y - a.y)));
            }
        }
    }
    let (first, last) = touched(left, right);
    (first.min(width - 1), last.min(width - 1))
}

/// Gives the point of a triangle with these weights of corner 1 and corner 2.
fn point([a, b, c]: &[DVec2; 3], [u, v]: [f32; 2]) -> DVec2 {
    *a + (*b - *a) * f64::from(u) + (*c - *a) * f64::from(v)
}

/// Gives the weights of the nearest point of a triangle, and the squared distance to it.
fn nearest(corners: &[DVec2; 3], point: DVec2) -> ([f32; 2], f64) {
    let [a, b, c] = *corners;
    let area = (b - a).perp_dot(c - a);
    if area != 0.0 {
        let u = (point - a).perp_dot(c - a) / area;
        let v = (b - a).perp_dot(point - a) / area;
        if u >= 0.0 && v >= 0.0 && u + v <= 1.0 {
            return (weights(u, v), 0.0);
        }
    }
    let mut best = (f64::INFINITY, 0.0, 0.0);
    for k in 0..3 {
        let (from, to) = (corners[k], corners[(k + 1) % 3]);
        let edge = to - from;
        let length = edge.length_squared();
        let t = if length > 0.0 { ((point - from).dot(edge) / length).clamp(0.0, 1.0) } else { 0.0 };
        let distance = (from + edge * t).distance_squared(point);
        if distance < best.0 {
            let mut weight = [0.0; 3];
            weight[k] = 1.0 - t;
            weight[(k + 1) % 3] += t;
            best = (distance, weight[1], weight[2]);
        }
    }
    (weights(best.1, best.2), best.0)
}

/// Rounds two weights so that they stay inside the triangle.
fn weights(u: f64, v: f64) -> [f32; 2] {
    let u = u.clamp(0.0, 1.0) as f32;
    [u, (v.max(0.0) as f32).min(1.0 - u)]
}

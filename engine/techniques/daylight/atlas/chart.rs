//! Charts: flat pieces of a surface, in metres.

use glam::{DVec2, DVec3};

use super::surface::Surface;

/// A flat piece of a surface.
#[derive(Clone, Debug)]
pub(super) struct Chart {
    /// The triangles of the chart, ascending.
    pub(super) triangles: Vec<u32>,
    /// The flat position of every corner of every triangle in metres, the smallest coordinates at 0.
    pub(super) corners: Vec<[DVec2; 3]>,
    /// The width and the height in metres.
    pub(super) size: DVec2,
}

impl Chart {
    /// Makes a chart from flat corners and moves its smallest coordinates to 0.
    pub(super) fn new(triangles: Vec<u32>, mut corners: Vec<[DVec2; 3]>) -> Self {
        let mut low = DVec2::INFINITY;
        let mut high = DVec2::NEG_INFINITY;
        for &corner in corners.iter().flatten() {
            low = low.min(corner);
            high = high.max(corner);
        }
        for corner in corners.iter_mut().flatten() {
            *corner -= low;
        }
        Self { triangles, corners, size: high - low }
    }

    /// Projects triangles along the mean normal, without distortion if they are coplanar.
    pub(super) fn project(surface: &Surface, mut triangles: Vec<u32>) -> Self {
        triangles.sort_unstable();
        let normal = mean_normal(surface, &triangles);
        let tangent = normal.any_orthonormal_vector();
        let bitangent = normal.cross(tangent);
        let corners = triangles
            .iter()
            .map(|&t| surface.corners(t).map(|p| DVec2::new(p.dot(tangent), p.dot(bitangent))))
            .collect();
        let mut chart = Self::new(triangles, corners);
        chart.keep_area(surface);
        chart.turn_upright()
    }

    /// Scales the chart so that its area is the area of its surface.
    pub(super) fn keep_area(&mut self, surface: &Surface) {
        let flat: f64 = self.corners.iter().map(|c| signed_area(c).abs()).sum();
        let real: f64 = self.triangles.iter().map(|&t| surface.areas[t as usize]).sum();
        if flat > 0.0 && real > 0.0 {
            self.scale(DVec2::splat((real / flat).sqrt()));
        }
    }

    /// Scales both axes of the chart.
    pub(super) fn scale(&mut self, factor: DVec2) {
        for corner in self.corners.iter_mut().flatten() {
            *corner *= factor;
        }
        self.size *= factor;
    }

    /// Turns the chart to the bounding rectangle with the smallest area.
    pub(super) fn turn_upright(self) -> Self {
        let hull = convex_hull(self.corners.iter().flatten().copied().collect());
        let mut best: Option<(f64, DVec2)> = None;
        for (index, &point) in hull.iter().enumerate() {
            let Some(axis) = (hull[(index + 1) % hull.len()] - point).try_normalize() else {
                continue;
            };
            let (low, high) = hull.iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), p| {
                let turned = DVec2::new(p.dot(axis), p.dot(axis.perp()));
                (low.min(turned), high.max(turned))
            });
            let area = (high - low).element_product();
            // A later edge must win clearly, so that rounding does not choose between equal sides.
            if best.is_none_or(|(smallest, _)| area < smallest * (1.0 - 1.0e-9)) {
                best = Some((area, axis));
            }
        }
        let Some((_, axis)) = best else { return self };
        let turn = |p: DVec2| DVec2::new(p.dot(axis), p.dot(axis.perp()));
        let corners = self.corners.iter().map(|c| c.map(turn)).collect();
        Self::new(self.triangles, corners)
    }
}

/// Gives the unit mean normal of triangles, weighted by their area.
pub(super) fn mean_normal(surface: &Surface, triangles: &[u32]) -> DVec3 {
    triangles
        .iter()
        .map(|&t| surface.normals[t as usize] * surface.areas[t as usize])
        .fold(DVec3::ZERO, |sum, n| sum + n)
        .normalize_or(surface.normals[triangles[0] as usize])
}

/// Gives the signed area of a flat triangle.
pub(super) fn signed_area(corners: &[DVec2; 3]) -> f64 {
    (corners[1] - corners[0]).perp_dot(corners[2] - corners[0]) * 0.5
}

/// Gives the corners of the convex hull in counter-clockwise order.
fn convex_hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    let mut hull: Vec<DVec2> = Vec::new();
    let mut half = |points: &mut dyn Iterator<Item = DVec2>| {
        let base = hull.len();
        for point in points {
            while hull.len() >= base + 2 {
                let (a, b) = (hull[hull.len() - 2], hull[hull.len() - 1]);
                if (b - a).perp_dot(point - a) > 0.0 {
                    break;
                }
                hull.pop();
            }
            hull.push(point);
        }
        hull.pop();
    };
    half(&mut points.iter().copied());
    half(&mut points.iter().rev().copied());
    hull
}

/// Counts the sample points of a chart that lie inside more than one triangle.
///
/// The test takes a grid of sample points over the bounds. It gives the covered points and the points with more than
/// one triangle. A triangle ends just before its edges, so that neighbours do not overlap.
pub(super) fn overlap(corners: &[[DVec2; 3]]) -> (u64, u64) {
    let mut low = DVec2::INFINITY;
    let mut high = DVec2::NEG_INFINITY;
    for &corner in corners.iter().flatten() {
        low = low.min(corner);
        high = high.max(corner);
    }
    let extent = high - low;
    let area: f64 = corners.iter().map(|c| signed_area(c).abs()).sum();
    if corners.len() < 2 || area.is_nan() || area <= 0.0 || extent.min_element() <= 0.0 {
        return (0, 0);
    }
    // About 32 samples for every triangle, so that most triangles take part.
    let samples = (corners.len() as f64 * 32.0).clamp(4096.0, 4_194_304.0);
    let cell = (area / samples)
        .sqrt()
        .max((extent.element_product() / 16_777_216.0).sqrt())
        .max(extent.max_element() / 65_536.0);
    let width = (extent.x / cell).ceil() as usize + 1;
    let height = (extent.y / cell).ceil() as usize + 1;
    let mut count = vec![0_u8; width * height];
    for triangle in corners {
        let area = signed_area(triangle) * 2.0;
        if area == 0.0 {
            continue;
        }
        let flat = triangle.map(|p| (p - low) / cell);
        let area = area / (cell * cell);
        let (from, to) = (flat[0].min(flat[1]).min(flat[2]), flat[0].max(flat[1]).max(flat[2]));
        for y in (from.y - 0.5).ceil().max(0.0) as usize..=((to.y - 0.5).floor().max(-1.0) + 1.0) as usize {
            let (mut left, mut right) = (f64::INFINITY, f64::NEG_INFINITY);
            let line = y as f64 + 0.5;
            for k in 0..3 {
                let (a, b) = (flat[k], flat[(k + 1) % 3]);
                if (a.y <= line) != (b.y <= line) {
                    let x = a.x + (b.x - a.x) * ((line - a.y) / (b.y - a.y));
                    left = left.min(x);
                    right = right.max(x);
                }
            }
            if left > right || y >= height {
                continue;
            }
            let last = ((right - 0.5).floor().max(-1.0) + 1.0) as usize;
            for x in (left - 0.5).ceil().max(0.0) as usize..last.min(width) {
                let point = DVec2::new(x as f64 + 0.5, line);
                let inside = (0..3).all(|k| {
                    let (a, b) = (flat[k], flat[(k + 1) % 3]);
                    (b - a).perp_dot(point - a) / area > 1.0e-3
                });
                if inside {
                    count[y * width + x] = count[y * width + x].saturating_add(1);
                }
            }
        }
    }
    let covered = count.iter().filter(|&&n| n > 0).count() as u64;
    let double = count.iter().filter(|&&n| n > 1).count() as u64;
    (covered, double)
}

/// Tells whether the triangles of a chart overlap by more than 0.1 % of the covered samples.
pub(super) fn overlaps(corners: &[[DVec2; 3]]) -> bool {
    let (covered, double) = overlap(corners);
    double > 2 && double * 1000 > covered
}

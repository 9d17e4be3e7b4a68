use glam::{Vec2, vec3};
use proptest::prelude::*;

use super::*;

/// The twin of `day_cell()`.
fn cell(of: &types::DayCells, barycentrics: Vec2) -> u32 {
    let (columns, rows, base) = (of.size & 0x7fff, of.size >> 15 & 0x7fff, of.size >> 30);
    let w = [1.0 - barycentrics.x - barycentrics.y, barycentrics.x, barycentrics.y];
    let [end, apex] = [w[(base as usize + 1) % 3], w[(base as usize + 2) % 3]];
    let column = (((end + of.foot * apex).max(0.0) * columns as f32) as u32).min(columns - 1);
    let row = ((apex.max(0.0) * rows as f32) as u32).min(rows - 1);
    of.first + row * columns + column
}

/// The twin of `day_cell_point()`.
fn point(of: &types::DayCells, cell: u32, at: Vec2) -> Vec2 {
    let (columns, rows, base) = (of.size & 0x7fff, of.size >> 15 & 0x7fff, of.size >> 30);
    let number = cell - of.first;
    let (low, column) = ((number / columns) as f32 / rows as f32, (number % columns) as f32);
    let ends = (
        (column / columns as f32).max(of.foot * low),
        ((column + 1.0) / columns as f32).min(1.0 - (1.0 - of.foot) * low),
    );
    let along = ends.0 + at.x * (ends.1 - ends.0).max(0.0);
    let high = (along / of.foot.max(1e-9)).min((1.0 - along) / (1.0 - of.foot).max(1e-9));
    let high = high.max(low).min((number / columns + 1) as f32 / rows as f32);
    let apex = low + at.y * (high - low);
    let inside = Vec2::new(along - of.foot * apex, apex).lerp(Vec2::splat(1.0 / 3.0), 1e-3);
    let mut w = [0.0; 3];
    w[base as usize] = 1.0 - inside.x - inside.y;
    w[(base as usize + 1) % 3] = inside.x;
    w[(base as usize + 2) % 3] = inside.y;
    Vec2::new(w[1], w[2])
}

fn of_triangle(corners: [Vec3; 3], spacing: f32) -> Cells {
    Corners { of_instances: vec![vec![corners]] }.divided(spacing)
}

fn world(corners: [Vec3; 3], barycentrics: Vec2) -> Vec3 {
    corners[0] + barycentrics.x * (corners[1] - corners[0]) + barycentrics.y * (corners[2] - corners[0])
}

fn corner() -> impl Strategy<Value = Vec3> {
    [-3.0f32..3.0, -3.0f32..3.0, -3.0f32..3.0].prop_map(Vec3::from)
}

proptest! {
    /// Whatever the triangle: a point's cell is one of the triangle's, and the point for which the cell has its bits is on the triangle and not
    /// farther than the diagonal of a cell, but for the share by which it is moved inwards.
    #[test]
    fn the_point_of_a_cell_is_near_all_points_of_the_cell(
        corners in [corner(), corner(), corner()],
        weights in [0.0f32..1.0, 0.0f32..1.0],
        at in [0.0f32..1.0, 0.0f32..1.0],
    ) {
        let spacing = 0.25;
        let cells = of_triangle(corners, spacing);
        let [a, b] = weights;
        let barycentrics = if a + b > 1.0 { Vec2::new(1.0 - a, 1.0 - b) } else { Vec2::new(a, b) };
        let number = cell(&cells.triangles[0], barycentrics);
        prop_assert!(number < cells.count);
        let point = point(&cells.triangles[0], number, at.into());
        prop_assert!(point.min_element() >= -1e-5 && point.x + point.y <= 1.0 + 1e-5, "{point}");
        let distance = world(corners, point).distance(world(corners, barycentrics));
        prop_assert!(distance <= spacing * 2f32.sqrt() + 0.02, "{distance}");
    }
}

#[test]
fn a_long_thin_triangle_has_few_cells() {
    // 10 m long and 1 cm high: 40 columns and one row, wherever its first corner is.
    let corners = [vec3(0.0, 0.0, 0.0), vec3(10.0, 0.0, 0.0), vec3(5.0, 0.01, 0.0)];
    for turn in 0..3 {
        let corners = [0, 1, 2].map(|corner| corners[(corner + turn) % 3]);
        assert_eq!(of_triangle(corners, 0.25).count, 40);
    }
}

#[test]
fn triangles_without_an_area_have_a_cell_each() {
    let point = [vec3(1.0, 2.0, 3.0); 3];
    let broken = [Vec3::NAN, Vec3::INFINITY, Vec3::ZERO];
    for corners in [point, broken] {
        let cells = of_triangle(corners, 0.25);
        assert_eq!(cells.count, 1, "{corners:?}");
        assert!(cells.triangles[0].foot.is_finite());
    }
}

#[test]
fn distances_are_rounded_up() {
    assert_eq!([0.0123, 0.5, 1.26, 123.0].map(up), [0.013, 0.5, 1.3, 130.0]);
}

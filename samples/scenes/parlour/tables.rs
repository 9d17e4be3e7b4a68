//! The low table before the sofa and the one for meals.

use super::super::kit::{Geometry, Model, circle, cuboid, curve, lathe, profile, rounded_box, sweep};
use super::Palette;
use glam::{Mat4, Vec2, Vec3, vec2, vec3};

/// Heights of the tops.
pub(super) const COFFEE_TOP: f32 = 0.43;
pub(super) const DINING_TOP: f32 = 0.755;

/// An oval disc with a rounded edge: half extents `half` in XZ, from y = `top` − `thick` to `top`.
fn oval(half: Vec2, top: f32, thick: f32) -> Geometry {
    let r = 0.5 * thick;
    let mut outline = vec![vec2(0.0, -thick)];
    outline.extend((0..=6).map(|i| {
        let (sin, cos) = (std::f32::consts::PI * (i as f32 / 6.0 - 0.5)).sin_cos();
        vec2(half.x - r * (1.0 - cos), r * sin - r)
    }));
    outline.push(Vec2::ZERO);
    let stretched = Mat4::from_scale(vec3(1.0, 1.0, half.y / half.x));
    let mut out = lathe(&outline, 40, 40.0).transformed(stretched).at(0.0, top, 0.0);
    // Grain runs along the table, not around its middle, and the picture of it does not begin again on the top.
    for (uv, p) in out.uvs.iter_mut().zip(&out.positions) {
        *uv = vec2(p.z + 0.65, p.x + p.y + 0.4);
    }
    out
}

/// An oval table on four curved legs with a shelf between them, its length along Z.
pub(super) fn coffee_table(palette: &Palette) -> Model {
    let mut wood = oval(vec2(0.33, 0.6), COFFEE_TOP, 0.028);
    wood.append(&oval(vec2(0.22, 0.42), 0.15, 0.02));
    for (x, z) in [(1.0f32, 1.0f32), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)] {
        let leg = [
            vec3(x * 0.2, COFFEE_TOP - 0.02, z * 0.38),
            vec3(x * 0.215, 0.3, z * 0.4),
            vec3(x * 0.175, 0.16, z * 0.34),
            vec3(x * 0.19, 0.07, z * 0.365),
            vec3(x * 0.225, 0.0, z * 0.42),
        ];
        let leg = curve(&leg, 4);
        let last = leg.len() - 1;
        wood.append(&sweep(&leg, &circle(0.021, 10), true, |k| 1.15 - 0.45 * k as f32 / last as f32));
    }
    Model::of(palette.wood, wood)
}

/// A table for four with a polished top on turned legs, its length along Z.
pub(super) fn dining_table(palette: &Palette) -> Model {
    let (wide, long, thick) = (0.9f32, 1.5f32, 0.032f32);
    // The grain runs along the boards of the top.
    let top = rounded_box(vec3(long, thick, wide), 0.012, (3, 1)).turned_y(90.0);
    let mut model = Model::of(palette.top, top.at(0.0, DINING_TOP - 0.5 * thick, 0.0));
    let under = DINING_TOP - thick;
    let mut wood = Geometry::default();
    for side in [-1.0f32, 1.0] {
        wood.append(&cuboid(0.024, 0.1, long - 0.26).at(side * (0.5 * wide - 0.09), under - 0.05, 0.0));
        wood.append(&cuboid(wide - 0.23, 0.1, 0.024).at(0.0, under - 0.05, side * (0.5 * long - 0.09)));
    }
    let turned = profile(
        &[
            (0.0, 0.0),
            (0.02, 0.0),
            (0.026, 0.03),
            (0.018, 0.07),
            (0.024, 0.12),
            (0.036, 0.36),
            (0.04, 0.46),
            (0.024, 0.52),
            (0.04, 0.545),
            (0.036, 0.57),
        ],
        2,
    );
    let mut turned: Vec<Vec2> = turned;
    turned.push(vec2(0.0, 0.57));
    for corner in [(1.0f32, 1.0f32), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)] {
        let place: Vec3 = vec3(corner.0 * (0.5 * wide - 0.085), 0.0, corner.1 * (0.5 * long - 0.085));
        wood.append(&lathe(&turned, 12, 40.0).at(place.x, 0.0, place.z));
        wood.append(&rounded_box(vec3(0.075, under - 0.56, 0.075), 0.006, (1, 1)).at(
            place.x,
            0.5 * (under + 0.56),
            place.z,
        ));
    }
    model.add(palette.wood, wood);
    model
}

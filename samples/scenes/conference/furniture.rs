//! The table, the chairs around it, and what stands and hangs at the wall.

use super::super::kit::{Geometry, Model, bevel_box, circle, curve, cylinder, lathe, loop_sweep, slab, sphere, sweep};
use super::{Palette, things};
use glam::{Vec2, Vec3, vec2, vec3};

/// Half the table's length (x) and greatest width (z), and its height.
pub(super) const TABLE: (f32, f32, f32) = (3.25, 0.78, 0.745);
/// Length, height and depth of the sideboard.
pub(super) const SIDEBOARD: (f32, f32, f32) = (3.3, 0.86, 0.48);

/// Half the table's width at a place along it: it bulges.
pub(super) fn half_width(x: f32) -> f32 {
    TABLE.1 * bulge(x)
}

fn bulge(x: f32) -> f32 {
    1.0 - 0.24 * (x / TABLE.0).powi(2)
}

/// The outline of the table smaller by `inset`, at height `y`: from +Z to +X and on, symmetric in both axes.
fn outline(inset: f32, y: f32) -> Vec<Vec3> {
    let (a, b, r) = (TABLE.0 - inset, TABLE.1 - inset, (0.3 - 0.6 * inset).max(0.05));
    let (sides, corner, ends) = (40, 14, 6);
    let mut quarter: Vec<Vec2> = (0..sides).map(|i| vec2((a - r) * i as f32 / sides as f32, b)).collect();
    quarter.extend((0..corner).map(|i| {
        let (sin, cos) = (0.5 * std::f32::consts::PI * i as f32 / corner as f32).sin_cos();
        vec2(a - r + r * sin, b - r + r * cos)
    }));
    quarter.extend((0..=ends).map(|i| vec2(a, (b - r) * (1.0 - i as f32 / ends as f32))));
    let q = quarter.len() - 1;
    let all = (0..4 * q).map(|i| {
        let (turn, j) = (i / q, i % q);
        let (p, back) = (quarter[j], quarter[q - j]);
        match turn {
            0 => p,
            1 => vec2(back.x, -back.y),
            2 => -p,
            _ => vec2(-back.x, back.y),
        }
    });
    all.map(|p| vec3(p.x, y, p.y * bulge(p.x))).collect()
}

/// The surface from ring to ring, each counter-clockwise seen from above, outside as in a lathe.
fn loft(rings: &[Vec<Vec3>]) -> Geometry {
    let mut out = Geometry::default();
    for ring in rings {
        for p in ring {
            out.vertex(*p, Vec3::Y, vec2(p.x, p.z - p.y));
        }
    }
    for (row, ring) in rings.iter().enumerate().skip(1) {
        let n = ring.len();
        for i in 0..n {
            let id = |row: usize, i: usize| (row * n + i % n) as u32;
            out.quad(id(row - 1, i), id(row - 1, i + 1), id(row, i + 1), id(row, i));
        }
    }
    out.smooth_normals();
    out
}

/// What such a ring encloses, in strips across it, facing up.
fn lid(ring: &[Vec3]) -> Geometry {
    let n = ring.len();
    let mut out = Geometry::default();
    for p in ring {
        out.vertex(*p, Vec3::Y, vec2(p.x, p.z));
    }
    for k in 0..n / 2 {
        let front = |k: usize| ((3 * n / 4 + k) % n) as u32;
        let back = |k: usize| ((3 * n / 4 + n - k) % n) as u32;
        out.quad(front(k), front(k + 1), back(k + 1), back(k));
    }
    out
}

/// A boat-shaped top of wood with an inlay of stone, on three pedestals.
pub(super) fn table(palette: &Palette) -> Model {
    let top = TABLE.2;
    let thick = 0.045;
    let rounded: Vec<Vec<Vec3>> = (0..=8)
        .map(|i| {
            let (sin, cos) = (std::f32::consts::PI * (i as f32 / 8.0 - 0.5)).sin_cos();
            outline(0.0225 * (1.0 - cos), top - 0.5 * thick * (1.0 - sin))
        })
        .collect();
    let mut wood = loft(&rounded);
    wood.append(&loft(&[outline(0.0225, top), outline(0.345, top)]));
    // Seen from below.
    wood.append(&lid(&outline(0.0225, top - thick)).flipped());
    let mut model = Model::of(palette.walnut, wood);
    model.add(palette.stone, lid(&outline(0.345, top)));
    let mut legs = Geometry::default();
    for x in [-2.0, 0.0, 2.0] {
        legs.append(&bevel_box(0.5, top - thick - 0.03, 0.22, 0.02).at(x, 0.5 * (top - thick + 0.03), 0.0));
    }
    legs.append(&bevel_box(4.6, 0.09, 0.06, 0.01).at(0.0, top - thick - 0.05, 0.0));
    model.add(palette.walnut, legs);
    let mut feet = Geometry::default();
    for x in [-2.0, 0.0, 2.0] {
        feet.append(&bevel_box(0.62, 0.04, 0.7, 0.012).at(x, 0.02, 0.0));
    }
    model.add(palette.chrome, feet);
    model
}

/// A soft block of full extents `size`.
fn cushion(size: Vec3, (segments, rings): (usize, usize)) -> Geometry {
    let soft = |c: f32| c.signum() * c.abs().powf(0.42) * 0.5;
    let mut out = sphere(1.0, segments, rings).displaced(|p| vec3(soft(p.x), soft(p.y), soft(p.z)) * size);
    for (uv, p) in out.uvs.iter_mut().zip(&out.positions) {
        *uv = vec2(p.x, p.z - p.y);
    }
    out
}

/// A swivel armchair whose seat faces −Z.
pub(super) fn chair(palette: &Palette) -> Model {
    let mut chrome = Geometry::default();
    let mut dark = Geometry::default();
    let oval: Vec<Vec2> = circle(1.0, 8).iter().map(|p| vec2(0.021 * p.x, 0.014 * p.y)).collect();
    for i in 0..5 {
        let turn = 72.0 * i as f32 + 18.0;
        let way = [vec3(0.025, 0.115, 0.0), vec3(0.14, 0.1, 0.0), vec3(0.25, 0.078, 0.0), vec3(0.315, 0.066, 0.0)];
        let way = curve(&way, 2);
        let last = way.len() - 1;
        let leg = sweep(&way, &oval, true, |k| 1.25 - 0.55 * k as f32 / last as f32);
        chrome.append(&leg.turned_y(turn));
        for side in [-0.02, 0.008] {
            let wheel = cylinder(0.028, 0.013, 12).turned_x(90.0).at(0.308, 0.028, side);
            dark.append(&wheel.turned_y(turn));
        }
    }
    let column =
        [(0.0, 0.08), (0.045, 0.08), (0.045, 0.13), (0.034, 0.14), (0.034, 0.25), (0.021, 0.252), (0.021, 0.4)];
    let column = column.map(|(r, y)| vec2(r, y));
    chrome.append(&lathe(&column, 20, 40.0));
    dark.append(&bevel_box(0.26, 0.032, 0.28, 0.01).at(0.0, 0.41, 0.0));

    let bent = |p: Vec3| p + Vec3::Z * (-0.5 * p.x * p.x - 0.35 * (p.y - 0.08).powi(2));
    let lean = |g: Geometry| g.turned_x(-8.0).at(0.0, 0.86, 0.27);
    let mut leather = cushion(vec3(0.54, 0.13, 0.52), (36, 13)).at(0.0, 0.475, 0.0);
    leather.append(&lean(cushion(vec3(0.5, 0.66, 0.11), (36, 14)).displaced(bent)));
    // Piping around seat and back, a little outside of where the cushions are widest.
    let around = |x: f32, y: f32| -> Vec<Vec3> {
        let soft = |c: f32| c.signum() * c.abs().powf(0.42) * 0.5;
        let points = circle(1.0, 30);
        points.iter().map(|p| vec3(soft(p.x) * x, 0.0, -soft(p.y) * y)).collect()
    };
    let cord = circle(0.0065, 5);
    let mut piping = loop_sweep(&around(0.54, 0.52), &cord, true).at(0.0, 0.475, 0.0);
    let upright: Vec<Vec3> = around(0.5, 0.66).iter().map(|p| vec3(p.x, -p.z, 0.0)).collect();
    piping.append(&lean(loop_sweep(&upright, &cord, true).displaced(bent)));

    let pipe = circle(0.0115, 8);
    let spine = [vec3(0.0, 0.405, 0.08), vec3(0.0, 0.42, 0.27), vec3(0.0, 0.54, 0.335), vec3(0.0, 0.85, 0.345)];
    chrome.append(&sweep(&curve(&spine, 4), &circle(0.02, 8), true, |_| 1.0));
    for side in [-1.0f32, 1.0] {
        let x = side * 0.3;
        let way = [
            vec3(side * 0.12, 0.405, 0.1),
            vec3(x, 0.43, 0.12),
            vec3(x, 0.62, 0.2),
            vec3(x, 0.672, 0.08),
            vec3(x, 0.668, -0.12),
            vec3(x, 0.62, -0.185),
            vec3(x, 0.46, -0.12),
            vec3(side * 0.15, 0.405, -0.08),
        ];
        chrome.append(&sweep(&curve(&way, 3), &pipe, true, |_| 1.0));
        leather.append(&cushion(vec3(0.062, 0.034, 0.27), (14, 7)).at(x, 0.692, -0.02));
    }
    let mut model = Model::of(palette.leather, leather);
    model.add(palette.piping, piping);
    model.add(palette.chrome, chrome);
    model.add(palette.dark, dark);
    model
}

/// A low cabinet with six doors, its front to +Z.
pub(super) fn sideboard(palette: &Palette) -> Model {
    let (long, high, deep) = SIDEBOARD;
    let mut wood = bevel_box(long, 0.035, deep, 0.008).at(0.0, high - 0.0175, 0.0);
    wood.append(&bevel_box(long - 0.03, high - 0.135, deep - 0.03, 0.006).at(0.0, 0.5 * (high - 0.135) + 0.1, -0.005));
    let mut fronts = Geometry::default();
    let mut handles = Geometry::default();
    for i in 0..6 {
        let wide = (long - 0.06) / 6.0;
        let x = (i as f32 - 2.5) * wide;
        fronts.append(&bevel_box(wide - 0.012, high - 0.16, 0.02, 0.006).at(
            x,
            0.5 * (high - 0.16) + 0.112,
            0.5 * deep - 0.014,
        ));
        let edge = if i % 2 == 0 { 0.5 } else { -0.5 } * (wide - 0.1);
        handles.append(&things::handle().turned_z(90.0).at(x + edge, 0.56, 0.5 * deep));
    }
    let mut model = Model::of(palette.walnut, wood);
    model.add(palette.white, fronts);
    model.add(palette.chrome, handles);
    model.add(
        palette.dark,
        slab([-0.5 * long + 0.06, 0.0, -0.5 * deep + 0.05], [0.5 * long - 0.06, 0.1, 0.5 * deep - 0.08]),
    );
    model
}

/// A mirror of `size` in a brass frame, its middle at the origin, facing +Z.
pub(super) fn mirror(palette: &Palette, size: Vec2) -> Model {
    let mut face = Geometry::default();
    let half = 0.5 * size;
    face.flat_quad(
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(u, v)| vec3(u * half.x, v * half.y, 0.02)),
    );
    let mut model = Model::of(palette.chrome, face);
    model.add(palette.brass, things::frame(size, 0.045, 0.045));
    model.add(palette.dark, slab([-half.x, -half.y, 0.0], [half.x, half.y, 0.018]));
    model
}

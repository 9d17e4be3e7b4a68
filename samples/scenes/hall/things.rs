//! What stands and hangs in the hall: pews, altar, emblem, font, lectern, lamps, banners, door.

use super::super::kit::{
    Geometry, Model, Picture, bevel_box, circle, cuboid, cylinder, extrude, lathe, loop_sweep, slab, sphere, srgb,
    sweep, terrain, torus, value_noise,
};
use super::{Palette, walls::Arch};
use glam::{Vec2, Vec3, vec2, vec3};

fn points(list: &[(f32, f32)]) -> Vec<Vec2> {
    list.iter().map(|p| Vec2::from(*p)).collect()
}

/// A pew of `length` along Z, its sitters facing +X, standing on y = 0.
pub(super) fn pew(palette: &Palette, length: f32) -> Model {
    let end = points(&[
        (-0.3, 0.0),
        (0.26, 0.0),
        (0.26, 0.1),
        (0.22, 0.14),
        (0.22, 0.4),
        (0.25, 0.45),
        (0.23, 0.5),
        (0.14, 0.55),
        (0.06, 0.63),
        (0.0, 0.76),
        (-0.03, 0.9),
        (-0.06, 0.99),
        (-0.12, 1.05),
        (-0.2, 1.06),
        (-0.26, 1.02),
        (-0.28, 0.95),
        (-0.26, 0.88),
        (-0.3, 0.8),
    ]);
    let mut out = Geometry::default();
    for side in [-0.5, 0.5] {
        let z = side * (length - 0.07);
        out.append(&extrude(&end, 0.07).at(0.0, 0.0, z - 0.035));
        // A raised panel and a knob on each face.
        for face in [-1.0, 1.0] {
            let at = z + face * 0.037;
            out.append(&bevel_box(0.3, 0.24, 0.02, 0.008).at(-0.03, 0.26, at));
            out.append(&torus(0.06, 0.014, 12, 5).turned_x(90.0).at(-0.17, 0.88, at));
        }
    }
    let wide = length - 0.12;
    out.append(&bevel_box(0.44, 0.035, wide, 0.01).at(-0.01, 0.445, 0.0));
    out.append(&bevel_box(0.03, 0.36, wide, 0.006).at(0.12, 0.25, 0.0));
    let mut back = bevel_box(0.028, 0.5, wide, 0.006).at(0.0, 0.26, 0.0);
    let count = 5;
    let panel = wide / count as f32;
    for i in 0..count {
        let z = (i as f32 + 0.5) * panel - 0.5 * wide;
        for face in [-1.0, 1.0] {
            back.append(&bevel_box(0.016, 0.3, panel - 0.12, 0.006).at(face * 0.016, 0.27, z));
        }
    }
    back.append(&bevel_box(0.06, 0.05, wide, 0.015).at(0.0, 0.52, 0.0));
    out.append(&back.turned_z(9.0).at(-0.16, 0.44, 0.0));
    // A shelf for books and a kneeler for the row behind.
    out.append(&bevel_box(0.15, 0.02, wide, 0.006).at(-0.3, 0.76, 0.0));
    out.append(&bevel_box(0.15, 0.025, wide, 0.008).at(-0.42, 0.17, 0.0));
    for z in [-0.42, 0.0, 0.42] {
        out.append(&bevel_box(0.2, 0.15, 0.035, 0.006).at(-0.4, 0.08, z * wide));
    }
    Model::of(palette.oak, out)
}

/// A slab of stone on a block, with a white cloth, a red one over it, and candles; the long side along Z.
pub(super) fn altar(palette: &Palette) -> Model {
    let mut stone = bevel_box(0.7, 0.14, 1.9, 0.02).at(0.0, 0.07, 0.0);
    stone.append(&bevel_box(0.6, 0.76, 1.7, 0.015).at(0.0, 0.5, 0.0));
    for i in 0..5 {
        for side in [-1.0, 1.0] {
            let z = (i as f32 - 2.0) * 0.34;
            stone.append(&lathe(&baluster(0.66), 20, 40.0).at(side * 0.31, 0.17, z));
        }
    }
    stone.append(&bevel_box(0.86, 0.12, 2.1, 0.02).at(0.0, 0.92, 0.0));
    let mut model = Model::of(palette.stone, stone);
    let mut white = slab([-0.436, 0.97, -1.056], [0.436, 0.986, 1.056]);
    for side in [-1.0f32, 1.0] {
        let z = side * 1.06;
        white.append(&slab([-0.43, 0.6, z - 0.006], [0.43, 0.98, z + 0.006]));
    }
    model.add(palette.linen, white);
    let mut red = slab([-0.445, 0.985, -0.42], [0.445, 0.995, 0.42]);
    red.append(&slab([-0.45, 0.5, -0.42], [-0.438, 0.995, 0.42]));
    model.add(palette.carpet, red);
    for (z, height) in [(-0.8, 0.34), (-0.56, 0.24), (0.56, 0.24), (0.8, 0.34)] {
        model.add(palette.gold, lathe(&baluster(height), 24, 40.0).at(0.12, 0.986, z));
        model.add(palette.linen, cylinder(0.018, 0.22, 16).at(0.12, 0.986 + height, z));
    }
    let mut book = cuboid(0.3, 0.05, 0.22).turned_y(8.0).at(-0.1, 1.02, 0.1);
    book.append(&cuboid(0.3, 0.05, 0.22).turned_y(8.0).at(-0.07, 1.02, -0.13));
    model.add(palette.linen, book);
    model
}

/// The line of a small turned post, closed at both ends.
fn baluster(height: f32) -> Vec<Vec2> {
    let line = [
        (0.0, 0.0),
        (0.055, 0.0),
        (0.055, 0.06),
        (0.03, 0.12),
        (0.025, 0.2),
        (0.05, 0.4),
        (0.055, 0.5),
        (0.045, 0.62),
        (0.024, 0.8),
        (0.03, 0.88),
        (0.055, 0.94),
        (0.055, 1.0),
        (0.0, 1.0),
    ];
    line.iter().map(|(r, t)| vec2(*r, t * height)).collect()
}

/// A wheel cross of `radius` in the plane x = 0, facing −X.
pub(super) fn emblem(palette: &Palette, radius: f32) -> Model {
    let ring = |r: f32| -> Vec<Vec3> { circle(r, 56).iter().map(|p| p.extend(0.0)).collect() };
    let bar = |half: f32| [vec2(-half, -half), vec2(half, -half), vec2(half, half), vec2(-half, half)];
    let mut gold = loop_sweep(&ring(radius), &circle(0.075, 12), true);
    gold.append(&loop_sweep(&ring(radius * 0.42), &bar(0.04), false));
    for k in 0..4 {
        let arm = points(&[
            (-0.07, 0.0),
            (0.07, 0.0),
            (0.07, radius),
            (0.17, radius * 1.3),
            (-0.17, radius * 1.3),
            (-0.07, radius),
        ]);
        gold.append(&extrude(&arm, 0.08).at(0.0, 0.0, -0.04).turned_z(90.0 * k as f32));
        let ray = points(&[(-0.045, radius * 0.42), (0.045, radius * 0.42), (0.0, radius * 0.95)]);
        gold.append(&extrude(&ray, 0.03).at(0.0, 0.0, -0.015).turned_z(45.0 + 90.0 * k as f32));
    }
    gold.append(&sphere(0.2, 40, 20).displaced(|p| p * vec3(1.0, 1.0, 0.6)));
    let mut model = Model::of(palette.gold, gold);
    let disc = cylinder(radius * 0.93, 0.04, 64).turned_x(90.0).at(0.0, 0.0, -0.1);
    model.add(palette.enamel, disc);
    let parts = model.parts.into_iter().map(|(material, part)| (material, part.turned_y(-90.0))).collect();
    Model { parts }
}

/// A round font, its bowl blue.
pub(super) fn font(palette: &Palette) -> Model {
    let line = points(&[
        (0.0, 0.0),
        (0.55, 0.0),
        (0.55, 0.14),
        (0.4, 0.16),
        (0.4, 0.28),
        (0.2, 0.34),
        (0.18, 0.62),
        (0.42, 0.78),
        (0.46, 0.82),
        (0.46, 1.02),
        (0.38, 1.02),
        (0.34, 0.9),
        (0.0, 0.84),
    ]);
    let mut model = Model::of(palette.stone, lathe(&line, 40, 40.0));
    model.add(palette.enamel, cylinder(0.345, 0.02, 32).at(0.0, 0.93, 0.0));
    model
}

/// A desk to read from, its reader facing −X.
pub(super) fn lectern(palette: &Palette) -> Model {
    let mut oak = bevel_box(0.5, 0.08, 0.5, 0.015).at(0.0, 0.04, 0.0);
    oak.append(&lathe(&baluster(0.95), 24, 40.0).at(0.0, 0.08, 0.0));
    oak.append(&bevel_box(0.42, 0.03, 0.56, 0.008).turned_z(24.0).at(0.0, 1.09, 0.0));
    oak.append(&bevel_box(0.03, 0.07, 0.56, 0.008).turned_z(24.0).at(-0.19, 1.03, 0.0));
    let mut model = Model::of(palette.oak, oak);
    model.add(palette.linen, bevel_box(0.28, 0.03, 0.4, 0.01).turned_z(24.0).at(0.0, 1.125, 0.0));
    model
}

/// Height of the bulb of a [`lamp`].
pub(super) const BULB: f32 = 2.62;

/// A lamp on a post of iron. Nothing that light meets is nearer to the bulb's middle than 14 cm.
pub(super) fn lamp(palette: &Palette) -> Model {
    let line = points(&[
        (0.0, 0.0),
        (0.2, 0.0),
        (0.2, 0.04),
        (0.15, 0.07),
        (0.08, 0.12),
        (0.055, 0.3),
        (0.075, 0.36),
        (0.075, 0.4),
        (0.036, 0.46),
        (0.03, 1.2),
        (0.05, 1.24),
        (0.05, 1.28),
        (0.028, 1.33),
        (0.022, 2.2),
        (0.045, 2.26),
        (0.06, 2.36),
        (0.1, 2.42),
        (0.1, 2.44),
        (0.0, 2.45),
    ]);
    let mut iron = lathe(&line, 28, 40.0);
    for k in 0..3 {
        let foot = [vec3(0.05, 0.1, 0.0), vec3(0.18, 0.14, 0.0), vec3(0.27, 0.06, 0.0), vec3(0.34, 0.02, 0.0)];
        iron.append(&sweep(&foot, &circle(0.022, 8), true, |_| 1.0).turned_y(30.0 + 120.0 * k as f32));
    }
    let mut model = Model::of(palette.iron, iron);
    model.add(palette.bulb, sphere(0.07, 28, 14).at(0.0, BULB, 0.0));
    model.add(palette.bulb, cylinder(0.02, 0.14, 16).at(0.0, 2.445, 0.0));
    model
}

/// A picture of a banner: a field, a border and a sign of gold.
pub(super) fn heraldry(field: u32, round: bool) -> Picture {
    Picture::new(128, 384, |uv| {
        let p = (uv - vec2(0.5, 0.5)) * vec2(1.0, 3.0);
        let weave = 0.9 + 0.2 * value_noise(uv * vec2(64.0, 192.0), 0, 5);
        let border = uv.x < 0.07 || uv.x > 0.93 || uv.y > 0.965;
        let sign = (p + vec2(0.0, 0.55)) / 0.3;
        let shown = if round {
            (sign.length() < 1.0 && sign.length() > 0.78) || sign.length() < 0.4
        } else {
            (sign.x.abs() < 0.2 && sign.y.abs() < 1.0) || (sign.y.abs() < 0.2 && sign.x.abs() < 1.0)
        };
        (if border || shown { srgb(0xc9a24a) } else { srgb(field) } * weave, 0.0)
    })
}

/// A banner of `size` under y = 0, facing +Z, its folds deeper at the hem; on a rod.
pub(super) fn banner(palette: &Palette, cloth: u32, size: Vec2, seed: u32) -> Model {
    let folds = |p: Vec2| {
        let fall = p.y / size.y + 0.5;
        let wave = (p.x * 13.0 + 3.0 * value_noise(vec2(p.x, p.y * 0.6), 0, seed)).sin();
        0.03 * fall * wave + 0.02 * value_noise(p * vec2(3.0, 1.0), 0, seed ^ 5)
    };
    let sheet = terrain(-0.5 * size, 0.5 * size, 24, 20, folds);
    let mut model = Model::of(cloth, sheet.turned_x(90.0).at(0.0, -0.5 * size.y, 0.06));
    let mut gold = cylinder(0.018, size.x + 0.2, 16).turned_z(90.0).at(0.5 * size.x + 0.1, 0.02, 0.06);
    for side in [-1.0, 1.0] {
        gold.append(&sphere(0.035, 16, 8).at(side * (0.5 * size.x + 0.11), 0.02, 0.06));
        gold.append(&cylinder(0.01, 0.1, 10).turned_x(90.0).at(side * 0.3 * size.x, 0.025, -0.02));
    }
    model.add(palette.gold, gold);
    model
}

/// A closed door of two leaves that fills an arch in the plane z = 0; its edges sink into the jambs.
pub(super) fn door(palette: &Palette, arch: &Arch) -> Model {
    let wider = Arch { half: arch.half + 0.05, bottom: arch.bottom - 0.05, ..*arch };
    let mut outline = wider.outline(24);
    outline.reverse();
    let mut oak = extrude(&outline, 0.08).at(0.0, 0.0, -0.04);
    let boards = 10;
    let wide = 2.0 * arch.half / boards as f32;
    for i in 0..boards {
        let x = arch.middle - arch.half + (i as f32 + 0.5) * wide;
        let d = (x - arch.middle).abs() + 0.5 * wide;
        let top = arch.spring + (arch.half * arch.half - d * d).max(0.0).sqrt() - 0.02;
        for face in [-0.045, 0.045] {
            let board = bevel_box(wide - 0.012, top - arch.bottom - 0.02, 0.03, 0.008);
            oak.append(&board.at(x, 0.5 * (top + arch.bottom) + 0.01, face));
        }
    }
    let mut model = Model::of(palette.oak, oak);
    let mut iron = Geometry::default();
    for face in [-0.063, 0.063] {
        for y in [0.4, 1.9] {
            for side in [-1.0, 1.0] {
                let strap = bevel_box(arch.half - 0.12, 0.07, 0.014, 0.004);
                iron.append(&strap.at(arch.middle + side * (0.5 * arch.half + 0.03), y, face));
            }
        }
        for side in [-1.0, 1.0] {
            let ring = torus(0.06, 0.012, 28, 8).turned_x(90.0);
            iron.append(&ring.at(arch.middle + side * 0.16, 1.05, face * 1.2));
        }
        iron.append(&bevel_box(0.03, arch.spring, 0.02, 0.004).at(arch.middle, 0.5 * arch.spring + 0.02, face));
    }
    model.add(palette.iron, iron);
    model
}

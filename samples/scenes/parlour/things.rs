//! Lamps, vessels, books and what else stands about.

use super::super::kit::{
    Geometry, Model, Picture, Random, Stage, bevel_box, circle, cuboid, curve, cylinder, lathe, profile, slab, sphere,
    srgb, sweep, torus, vessel,
};
use super::{Palette, pictures};
use glam::{Mat4, Vec2, Vec3, vec2, vec3};

/// A shade of cloth, open above and below: a cone between two radii, standing on y = 0.
fn shade(below: f32, above: f32, height: f32) -> Geometry {
    let thick = 0.004;
    let points = [(below - thick, 0.0), (below, 0.0), (above, height), (above - thick, height), (below - thick, 0.0)];
    lathe(&points.map(|(r, y)| vec2(r, y)), 44, 30.0)
}

/// Three spokes of a shade's ring of `radius` in the plane y = 0.
fn spokes(radius: f32) -> Geometry {
    let mut out = Geometry::default();
    for i in 0..3 {
        let spoke = [Vec3::ZERO, vec3(radius, 0.0, 0.0)];
        out.append(&sweep(&spoke, &circle(0.003, 6), true, |_| 1.0).turned_y(120.0 * i as f32));
    }
    out
}

/// A pendant lamp under y = 0, its shade's lower edge `drop` below. The light itself is below it, in free space.
pub(super) fn pendant(palette: &Palette, drop: f32) -> Model {
    let mut brass = cylinder(0.055, 0.03, 28).at(0.0, -0.03, 0.0);
    brass.append(&cylinder(0.005, drop - 0.06, 10).at(0.0, 0.04 - drop, 0.0));
    brass.append(&cylinder(0.02, 0.06, 16).at(0.0, 0.03 - drop, 0.0));
    brass.append(&spokes(0.165).at(0.0, 0.23 - drop, 0.0));
    let mut model = Model::of(palette.brass, brass);
    model.add(palette.shade, shade(0.25, 0.17, 0.24).at(0.0, -drop, 0.0));
    model.add(palette.porcelain, sphere(0.035, 14, 7).at(0.0, 0.01 - drop, 0.0));
    model
}

/// A lamp of a man's height with a wide shade.
pub(super) fn floor_lamp(palette: &Palette) -> Model {
    let points = [
        (0.0, 0.0),
        (0.15, 0.0),
        (0.155, 0.012),
        (0.12, 0.026),
        (0.03, 0.04),
        (0.014, 0.07),
        (0.011, 0.1),
        (0.011, 1.4),
        (0.0, 1.4),
    ];
    let mut brass = lathe(&points.map(|(r, y)| vec2(r, y)), 20, 40.0);
    for y in [0.5, 0.95] {
        brass.append(&sphere(0.02, 12, 6).at(0.0, y, 0.0));
    }
    brass.append(&spokes(0.14).at(0.0, 1.62, 0.0));
    brass.append(&cylinder(0.005, 0.24, 8).at(0.0, 1.39, 0.0));
    let mut model = Model::of(palette.brass, brass);
    model.add(palette.shade, shade(0.24, 0.145, 0.3).at(0.0, 1.34, 0.0));
    model
}

/// A lamp for a table on a foot of porcelain.
pub(super) fn table_lamp(palette: &Palette) -> Model {
    let outline = profile(
        &[
            (0.0, 0.0),
            (0.06, 0.0),
            (0.06, 0.012),
            (0.035, 0.03),
            (0.085, 0.11),
            (0.08, 0.17),
            (0.025, 0.25),
            (0.018, 0.29),
        ],
        4,
    );
    let mut outline: Vec<Vec2> = outline;
    outline.push(vec2(0.0, 0.29));
    let mut model = Model::of(palette.glaze, lathe(&outline, 18, 50.0));
    let mut brass = cylinder(0.006, 0.24, 8).at(0.0, 0.28, 0.0);
    brass.append(&spokes(0.105).at(0.0, 0.49, 0.0));
    model.add(palette.brass, brass);
    model.add(palette.shade, shade(0.18, 0.11, 0.22).at(0.0, 0.29, 0.0));
    model
}

/// A candle on its stick.
pub(super) fn candlestick(palette: &Palette) -> Model {
    let mut stick = profile(
        &[
            (0.0, 0.0),
            (0.048, 0.0),
            (0.046, 0.012),
            (0.016, 0.028),
            (0.01, 0.06),
            (0.016, 0.08),
            (0.008, 0.11),
            (0.009, 0.15),
            (0.026, 0.168),
        ],
        2,
    );
    stick.extend([vec2(0.026, 0.174), vec2(0.0, 0.174)]);
    let mut model = Model::of(palette.brass, lathe(&stick, 12, 40.0));
    model.add(palette.paper, cylinder(0.011, 0.15, 14).at(0.0, 0.17, 0.0));
    model
}

/// A plate.
pub(super) fn plate() -> Geometry {
    let points = [(0.0, 0.0), (0.06, 0.0), (0.07, 0.006), (0.115, 0.018), (0.114, 0.021), (0.068, 0.011), (0.0, 0.008)];
    lathe(&points.map(|(r, y)| vec2(r, y)), 24, 40.0)
}

/// A slender vase, 0.24 m high.
pub(super) fn vase() -> Geometry {
    let outside = [(0.0, 0.0), (0.04, 0.0), (0.045, 0.01), (0.075, 0.1), (0.06, 0.16), (0.028, 0.2), (0.042, 0.24)];
    let inside = [(0.039, 0.24), (0.025, 0.2), (0.055, 0.16), (0.03, 0.1), (0.0, 0.1)];
    vessel(&outside, &inside, 2, 18)
}

/// A wide jar with its lid, 0.21 m high.
pub(super) fn jar() -> Geometry {
    let mut points = profile(&[(0.0, 0.0), (0.05, 0.0), (0.06, 0.012), (0.092, 0.09), (0.06, 0.155), (0.05, 0.162)], 3);
    points.extend(profile(&[(0.056, 0.164), (0.05, 0.176), (0.012, 0.188), (0.016, 0.205), (0.0, 0.212)], 2));
    lathe(&points, 18, 40.0)
}

/// Tulips in a vase.
pub(super) fn flowers(palette: &Palette, random: &mut Random) -> Model {
    let mut model = Model::of(palette.porcelain, vase());
    let (mut green, mut blooms) = (Geometry::default(), Geometry::default());
    let colors = [0xd8442f, 0xe7b53a, 0xe9e3d4, 0xc4526a];
    for i in 0..9 {
        let (turn, lean, tall) = (137.5 * i as f32, random.range(0.03, 0.16), random.range(0.38, 0.5));
        let stem = curve(
            &[
                vec3(0.004, 0.11, 0.0),
                vec3(0.02, 0.24, 0.0),
                vec3(0.03 + 0.5 * lean, 0.3 + 0.3 * (tall - 0.3), 0.0),
                vec3(0.03 + lean, tall, 0.0),
            ],
            2,
        );
        green.append(&sweep(&stem, &circle(0.003, 5), true, |_| 1.0).turned_y(turn).colored(srgb(0x5c8a3f)));
        if i % 2 == 0 {
            let blade: Vec<Vec2> = vec![vec2(-0.5, 0.0), vec2(0.0, -0.06), vec2(0.5, 0.0), vec2(0.0, 0.02)];
            let last = stem.len() as f32 - 1.0;
            let leaf = sweep(&stem, &blade, false, |k| 0.004 + 0.03 * (std::f32::consts::PI * k as f32 / last).sin());
            green.append(&leaf.turned_y(turn + 60.0).colored(srgb(0x6f9a4c)));
        }
        let bloom = profile(&[(0.0, 0.0), (0.017, 0.006), (0.025, 0.025), (0.017, 0.055), (0.0, 0.062)], 2);
        let bloom = lathe(&bloom, 9, 60.0).turned_z(-60.0 * lean / 0.16 * 0.5).at(0.03 + lean, tall - 0.004, 0.0);
        blooms.append(&bloom.turned_y(turn).colored(srgb(colors[i % colors.len()])));
    }
    model.add(palette.leaf, green);
    model.add(palette.fruit, blooms);
    model
}

/// A colour for a binding.
pub(super) fn binding(random: &mut Random) -> Vec3 {
    let colors = [
        0x8c2f2a, 0x2f4e7a, 0x3a6b4b, 0xc9a14a, 0x5b3a63, 0xd8d2c4, 0x3b3f46, 0xb4552d, 0x4f7f8c, 0x7a5a3c, 0x9a3d55,
        0xe3c27c,
    ];
    (srgb(colors[random.index(colors.len())]) * random.range(0.8, 1.15)).min(Vec3::splat(0.9))
}

/// A book of `size` (thickness, height, depth) that stands on y = 0, its back to +Z.
pub(super) fn book(palette: &Palette, size: Vec3, color: Vec3) -> Model {
    let cover = 0.003;
    let (t, h, d) = (0.5 * size.x, size.y, 0.5 * size.z);
    // In plan with the back at -Y: around it from one cover to the other, and back within them.
    let round = (0..=2).map(|i| {
        let (sin, cos) = (std::f32::consts::PI * (0.5 * i as f32 - 0.5)).sin_cos();
        vec2(t * sin, cover - d - 0.12 * t * cos)
    });
    let inner = t - cover;
    let plan: Vec<Vec2> = [vec2(-t, d)]
        .into_iter()
        .chain(round)
        .chain([(t, d), (inner, d), (inner, 2.0 * cover - d), (-inner, 2.0 * cover - d), (-inner, d)].map(Vec2::from))
        .collect();
    let binding = sweep(&[Vec3::ZERO, vec3(0.0, h, 0.0)], &plan, false, |_| 1.0);
    let mut model = Model::of(palette.books, binding.colored(color));
    model.add(
        palette.paper,
        slab([0.0005 - inner, 0.004, 0.004 - d], [inner - 0.0005, h - 0.004, d - 2.0 * cover - 0.0005]),
    );
    model
}

/// Books that lie one on the other, the lowest on y = 0.
pub(super) fn pile(palette: &Palette, count: usize, random: &mut Random) -> Model {
    let mut model = Model::default();
    let mut y = 0.0;
    for i in 0..count {
        let less = 1.0 - 0.1 * i as f32;
        let size = vec3(random.range(0.02, 0.04), random.range(0.22, 0.25) * less, random.range(0.16, 0.18) * less);
        let lying = Mat4::from_translation(vec3(0.0, y + 0.5 * size.x, 0.0))
            * Mat4::from_rotation_y(random.range(-0.25, 0.25))
            * Mat4::from_rotation_z(0.5 * std::f32::consts::PI)
            * Mat4::from_translation(vec3(0.0, -0.5 * size.y, 0.0));
        model.append(&book(palette, size, binding(random)), lying);
        y += size.x + 0.0005;
    }
    model
}

/// The face of a clock of `radius`, its back on z = 0, with hands at ten past ten.
pub(super) fn dial(palette: &Palette, radius: f32) -> Model {
    let mut face = Geometry::default();
    let ring: Vec<u32> = (0..40)
        .map(|i| {
            let p = Vec2::from_angle(std::f32::consts::TAU * i as f32 / 40.0);
            // The picture of the dial spans one metre.
            face.vertex((radius * p).extend(0.002), Vec3::Z, vec2(0.5 + 0.5 * p.x, 0.5 - 0.5 * p.y))
        })
        .collect();
    let middle = face.vertex(vec3(0.0, 0.0, 0.002), Vec3::Z, vec2(0.5, 0.5));
    for i in 0..40 {
        face.triangle(middle, ring[i], ring[(i + 1) % 40]);
    }
    let mut model = Model::of(palette.dial, face);
    let mut hands = cuboid(0.07 * radius, 0.55 * radius, 0.002).at(0.0, 0.22 * radius, 0.004).turned_z(55.0);
    hands.append(&cuboid(0.05 * radius, 0.8 * radius, 0.002).at(0.0, 0.34 * radius, 0.0065).turned_z(-60.0));
    model.add(palette.iron, hands);
    model
}

/// A clock for the shelf over the fire.
pub(super) fn mantel_clock(palette: &Palette) -> Model {
    let mut wood = bevel_box(0.24, 0.03, 0.12, 0.008).at(0.0, 0.015, 0.0);
    let arch: Vec<Vec2> = (0..=16)
        .map(|i| Vec2::from_angle(std::f32::consts::PI * i as f32 / 16.0) * 0.095 + vec2(0.0, 0.13))
        .chain([vec2(-0.095, 0.03), vec2(0.095, 0.03)])
        .collect();
    wood.append(&super::super::kit::extrude(&arch, 0.09).at(0.0, 0.0, -0.045));
    let mut model = Model::of(palette.wood, wood);
    model.append(&dial(palette, 0.068), Mat4::from_translation(vec3(0.0, 0.13, 0.0452)));
    model.add(palette.brass, torus(0.072, 0.006, 28, 6).turned_x(90.0).at(0.0, 0.13, 0.047));
    model
}

/// A rug with a border and fringes at its ends, its length along Z.
pub(super) fn rug(stage: &mut Stage, palette: &Palette) -> Model {
    let (wide, long, thick) = (2.1f32, 2.9f32, 0.012f32);
    let picture: Picture = pictures::rug();
    let paint = stage.pictured("rug", &picture, vec2(wide, long), 1.0);
    let mut pile = Geometry::default();
    let corner = |x: f32, z: f32, y: f32| vec3(0.5 * wide * x, y, 0.5 * long * z);
    let ring = [(-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)];
    pile.flat_quad(ring.map(|(x, z)| corner(x, z, thick)));
    for i in 0..4 {
        let (a, b) = (ring[i], ring[(i + 1) % 4]);
        pile.flat_quad([
            corner(a.0, a.1, 0.0),
            corner(b.0, b.1, 0.0),
            corner(b.0, b.1, thick),
            corner(a.0, a.1, thick),
        ]);
    }
    let mut fringe = Geometry::default();
    for end in [-1.0f32, 1.0] {
        for i in 0..44 {
            let x = (i as f32 + 0.5) / 44.0 * wide - 0.5 * wide;
            let turn = 16.0 * (i as f32 * 2.4).sin();
            fringe.append(&cuboid(0.014, 0.005, 0.07).turned_y(turn).at(x, 0.0035, end * (0.5 * long + 0.03)));
        }
    }
    let mut model = Model::of(paint, pile);
    model.add(palette.paper, fringe);
    model
}

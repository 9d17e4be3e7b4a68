//! What hangs on the walls, and patterns: paintings in frames, the mirror, the rug, the face of a clock.

use super::super::kit::{Geometry, Model, Picture, Stage, fbm, picture_frame, placed, slab, srgb, value_noise};
use super::{HALF, Palette, room::BREAST};
use glam::{Mat4, Vec2, Vec3, vec2, vec3};

/// The colour at (u, v), v downwards.
type Paint = fn(Vec2) -> Vec3;

/// The paintings and the mirror, each at its place.
pub(super) fn hang(stage: &mut Stage, palette: &Palette) {
    let (x, z) = HALF;
    let left = |y: f32, along: f32| placed(vec3(-x, y, along), 90.0);
    let paintings: [(&str, Paint, Vec2, Mat4); 6] = [
        ("valley", valley, vec2(0.95, 0.66), left(1.62, 0.25)),
        ("boats", boats, vec2(0.42, 0.54), left(1.62, -0.72)),
        ("still life", still_life, vec2(0.42, 0.54), left(1.62, 1.22)),
        ("squares", squares, vec2(0.62, 0.62), placed(vec3(-2.44, 1.85, -z), 0.0)),
        ("poplars", poplars, vec2(1.1, 0.7), placed(vec3(x, 1.65, 0.75), -90.0)),
        ("moon", moon, vec2(0.36, 0.5), placed(vec3(x, 1.7, -0.62), -90.0)),
    ];
    for (name, paint, size, place) in paintings {
        let wide = 320u32;
        let picture = Picture::new(wide, (wide as f32 * size.y / size.x) as u32, |uv| (paint(uv), 0.0));
        let material = stage.pictured(&format!("picture {name}"), &picture, size, 0.85);
        stage.mesh_at(&format!("picture {name}"), framed(palette, material, size), place);
    }
    let size = vec2(0.78, 0.86);
    let mirror = framed(palette, palette.mirror, size);
    stage.mesh_at("mirror", mirror, Mat4::from_translation(vec3(BREAST.0, 1.78, BREAST.2)));
}

/// A flat thing of `size` in a frame with a back, its middle at the origin, facing +Z.
fn framed(palette: &Palette, material: u32, size: Vec2) -> Model {
    let half = 0.5 * size;
    let mut face = Geometry::default();
    face.flat_quad(
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(u, v)| vec3(u * half.x, v * half.y, 0.016)),
    );
    let mut model = Model::of(material, face);
    model.add(palette.gilt, picture_frame(size, 0.065, 0.038));
    model.add(palette.paper, slab([-half.x, -half.y, 0.002], [half.x, half.y, 0.014]));
    model
}

fn strokes(uv: Vec2, seed: u32) -> f32 {
    0.82 + 0.36 * fbm(uv * vec2(60.0, 22.0), 0, 3, seed)
}

/// Hills behind hills under an evening sky.
fn valley(uv: Vec2) -> Vec3 {
    let mut color = srgb(0xf2cf8f).lerp(srgb(0x7fa7c9), (1.0 - uv.y * 1.7).clamp(0.0, 1.0));
    let hills = [
        (0.42, 0.1, 3.1, 0x8ca0b5),
        (0.55, 0.09, 4.3, 0x6b8f83),
        (0.68, 0.07, 5.9, 0x53793f),
        (0.82, 0.05, 7.7, 0x3c5a2c),
    ];
    for (i, (base, rise, pace, hex)) in hills.into_iter().enumerate() {
        let top = base
            + rise
                * ((uv.x * pace + i as f32 * 1.7).sin() * 0.6 + fbm(vec2(uv.x * pace * 1.6, i as f32 * 3.0), 0, 3, 4)
                    - 0.5);
        if uv.y > top {
            color = srgb(hex) * (1.0 + 0.25 * (uv.y - top) / 0.2);
        }
    }
    let river = 0.52 + 0.16 * (uv.y * 9.0).sin() * (1.0 - uv.y);
    if uv.y > 0.7 && (uv.x - river).abs() < 0.02 + 0.12 * (uv.y - 0.7) {
        color = srgb(0xa9c3cf);
    }
    (color * strokes(uv, 51)).min(Vec3::splat(0.95))
}

/// Two sails on the sea.
fn boats(uv: Vec2) -> Vec3 {
    let wave = value_noise(vec2(uv.x * 9.0, uv.y * 60.0), 0, 61);
    let mut color = if uv.y < 0.55 {
        srgb(0x8fb6cf).lerp(srgb(0xeadfc4), uv.y / 0.55)
    } else {
        srgb(0x3f7f98).lerp(srgb(0x1f4d66), (uv.y - 0.55) / 0.45) * (0.8 + 0.5 * wave)
    };
    for (x, y, size, hex) in [(0.36, 0.62, 0.4, 0xf1ead8), (0.72, 0.57, 0.2, 0xc9573a)] {
        let p = (uv - vec2(x, y)) / size;
        let sail = p.y < -0.05 && p.y > -0.95 && p.x > -0.02 && p.x < 0.42 * (p.y + 0.95);
        let jib = p.y < -0.05 && p.y > -0.8 && p.x < -0.04 && p.x > -0.3 * (p.y + 0.8);
        let hull = p.y.abs() < 0.06 && p.x.abs() < 0.4 - p.y.max(0.0) * 2.0;
        if sail || jib {
            color = srgb(hex) * (0.85 + 0.3 * (p.x + 0.3));
        } else if hull {
            color = srgb(0x4a3020);
        }
    }
    (color * strokes(uv, 62)).min(Vec3::splat(0.95))
}

/// Fruit on a cloth before a dark ground.
fn still_life(uv: Vec2) -> Vec3 {
    let mut color = if uv.y < 0.66 { srgb(0x4a3527) } else { srgb(0xd9cfb8) * (1.1 - 0.5 * (uv.y - 0.66)) };
    let round = [
        (0.3, 0.62, 0.13, 0xb83227),
        (0.55, 0.66, 0.14, 0xd98a2b),
        (0.75, 0.62, 0.11, 0x8f9f3a),
        (0.45, 0.5, 0.11, 0xc9a032),
    ];
    for (x, y, radius, hex) in round {
        let p = (uv - vec2(x, y)) / vec2(radius, radius * 0.78);
        if p.length() < 1.0 {
            let lit = (0.55 - 0.5 * p.dot(vec2(0.6, 0.7))).clamp(0.1, 1.2);
            color = srgb(hex) * (0.35 + 0.95 * lit);
        }
    }
    (color * strokes(uv, 71)).min(Vec3::splat(0.95))
}

/// Fields of flat colour.
fn squares(uv: Vec2) -> Vec3 {
    let field = |x: f32, y: f32, w: f32, h: f32| uv.x > x && uv.x < x + w && uv.y > y && uv.y < y + h;
    let color = match () {
        () if field(0.1, 0.12, 0.42, 0.5) => srgb(0xc23b2c),
        () if field(0.56, 0.12, 0.34, 0.24) => srgb(0xe3b23c),
        () if field(0.56, 0.4, 0.34, 0.48) => srgb(0x2e5d8c),
        () if field(0.1, 0.66, 0.42, 0.22) => srgb(0x33363b),
        () => srgb(0xe9e2d2),
    };
    (color * (0.9 + 0.2 * fbm(uv * 30.0, 0, 3, 81))).min(Vec3::splat(0.95))
}

/// A row of trees by a canal.
fn poplars(uv: Vec2) -> Vec3 {
    let shore = 0.66;
    let mirrored = uv.y > shore;
    let y = if mirrored { 2.0 * shore - uv.y + 0.012 * (uv.y * 160.0).sin() } else { uv.y };
    let mut color = srgb(0x9fc4dc).lerp(srgb(0xf3e2bd), (y / shore).clamp(0.0, 1.0));
    if fbm(vec2(uv.x * 4.0, y * 9.0), 0, 4, 91) > 0.62 {
        color = color.lerp(Vec3::splat(0.85), 0.6);
    }
    for i in 0..8 {
        let x = 0.06 + 0.125 * i as f32 + 0.02 * (i as f32 * 5.1).sin();
        let top = 0.12 + 0.1 * (i as f32 * 2.3).sin().abs();
        let t = ((y - top) / (shore - 0.03 - top)).clamp(0.0, 1.0);
        let half = 0.034
            * (std::f32::consts::PI * (0.05 + 0.85 * t)).sin()
            * (0.7 + 0.6 * value_noise(vec2(y * 40.0, i as f32 * 7.0), 0, 92));
        if y > top && y < shore - 0.02 && (uv.x - x).abs() < half {
            let side = ((uv.x - x) / half * 0.5 + 0.5).clamp(0.0, 1.0);
            color = srgb(0x7f9a3c).lerp(srgb(0x35552c), side);
        }
    }
    if y > shore - 0.035 {
        color = srgb(0x6f8a45);
    }
    let dim = if mirrored { 0.72 } else { 1.0 };
    (color * dim * strokes(uv, 93)).min(Vec3::splat(0.95))
}

/// The moon over a roof.
fn moon(uv: Vec2) -> Vec3 {
    let p = (uv - vec2(0.62, 0.3)) * vec2(1.0, 1.4);
    let roof = uv.y > 0.62 + 0.5 * (uv.x - 0.35).abs();
    let window = roof && (uv - vec2(0.36, 0.84)).abs().max_element() < 0.05;
    let color = match (window, roof, p.length() < 0.14) {
        (true, ..) => srgb(0xe9b64a),
        (_, true, _) => srgb(0x3a2f3a),
        (.., true) => srgb(0xf2ead0),
        _ => srgb(0x2b4468).lerp(srgb(0x6f86a8), uv.y),
    };
    (color * strokes(uv, 95)).min(Vec3::splat(0.95))
}

/// A field of small flowers with a medallion, in borders.
pub(super) fn rug() -> Picture {
    Picture::new(420, 580, |uv| {
        let metres = (uv - Vec2::splat(0.5)) * vec2(2.1, 2.9);
        let edge = (vec2(1.05, 1.45) - metres.abs()).min_element();
        let (deep, dark, cream, gold) = (srgb(0x9c3226), srgb(0x2c3f63), srgb(0xd9c7a0), srgb(0xc58f3d));
        let along = if metres.x.abs() * 1.45 > metres.y.abs() * 1.05 { metres.y } else { metres.x };
        let petal = |p: Vec2, size: f32| {
            let angle = p.y.atan2(p.x);
            p.length() < size * (0.7 + 0.3 * (6.0 * angle).cos())
        };
        let medallion = {
            let p = metres / vec2(0.55, 0.85);
            p.length() + 0.06 * (12.0 * p.y.atan2(p.x)).cos()
        };
        let cell = |p: Vec2, pitch: f32| (p / pitch - (p / pitch).round()) * pitch;
        let color = match edge {
            e if e < 0.03 => dark,
            e if e < 0.05 => gold,
            e if e < 0.24 => {
                let p = vec2(along - (along / 0.2).round() * 0.2, e - 0.145);
                if petal(p, 0.06) {
                    if p.length() < 0.018 { deep } else { cream }
                } else if (p.y - 0.03 * (along * 31.4).sin()).abs() < 0.008 {
                    gold
                } else {
                    dark
                }
            }
            e if e < 0.26 => gold,
            e if e < 0.3 => cream,
            e if e < 0.315 => dark,
            _ if medallion < 0.3 => {
                if petal(metres, 0.13) {
                    gold
                } else {
                    deep
                }
            }
            _ if medallion < 0.34 => cream,
            _ if medallion < 0.9 => {
                if petal(cell(metres, 0.16), 0.035) {
                    cream
                } else {
                    dark
                }
            }
            _ if medallion < 0.97 => gold,
            _ if petal(cell(metres + Vec2::splat(0.08), 0.19), 0.045) => {
                if cell(metres + Vec2::splat(0.08), 0.19).length() < 0.014 { dark } else { gold }
            }
            _ => deep,
        };
        let wool = 0.78 + 0.4 * value_noise(uv * vec2(210.0, 290.0), 0, 97);
        ((color * wool).min(Vec3::splat(0.95)), 0.0)
    })
}

/// A white face with strokes for the hours.
pub(super) fn dial(stage: &mut Stage) -> u32 {
    let picture = Picture::new(128, 128, |uv| {
        let p = uv - Vec2::splat(0.5);
        let turn = p.x.atan2(p.y) / std::f32::consts::TAU * 12.0;
        let off = (turn - turn.round()).abs() / 12.0 * std::f32::consts::TAU * p.length();
        let stroke = p.length() > 0.34 && p.length() < 0.43 && off < 0.016;
        let ring = (p.length() - 0.455).abs() < 0.008;
        (if stroke || ring { srgb(0x33302c) } else { srgb(0xece5d3) }, 0.0)
    });
    stage.pictured("dial", &picture, Vec2::ONE, 0.8)
}

//! Procedural textures: small, tiling, deterministic, each a colour and a relief.

use super::{fbm, hash, srgb_from_linear, value_noise};
use glam::{Vec2, Vec3};
use lucerna::scene::Texture;

/// A picture that tiles: linear colour and relief height in metres at each texel, top row first.
#[derive(Clone, Debug)]
pub(crate) struct Picture {
    pub width: u32,
    pub height: u32,
    pub color: Vec<Vec3>,
    pub relief: Vec<f32>,
}

impl Picture {
    /// Evaluates `texel` at texel centres; its argument is (u, v) in [0, 1), v downwards.
    pub fn new(width: u32, height: u32, texel: impl Fn(Vec2) -> (Vec3, f32)) -> Self {
        let centres = (0..width * height).map(|i| {
            Vec2::new((i % width) as f32 + 0.5, (i / width) as f32 + 0.5) / Vec2::new(width as f32, height as f32)
        });
        let (color, relief) = centres.map(texel).unzip();
        Self { width, height, color, relief }
    }

    /// The colour, sRGB encoded.
    pub fn color_texture(&self, name: &str) -> Texture {
        let encode = |c: f32| (srgb_from_linear(c) * 255.0).round() as u8;
        let rgba = self.color.iter().map(|c| [encode(c.x), encode(c.y), encode(c.z), 255]).collect();
        Texture { name: name.to_owned(), width: self.width, height: self.height, rgba }
    }

    /// Tangent-space normals of the relief (x right, y up in the picture) when the picture spans `metres` each way.
    pub fn normal_texture(&self, name: &str, metres: f32) -> Texture {
        let at = |x: i64, y: i64| {
            let (x, y) = (x.rem_euclid(i64::from(self.width)), y.rem_euclid(i64::from(self.height)));
            self.relief[(y * i64::from(self.width) + x) as usize]
        };
        let (step_x, step_y) = (metres / self.width as f32, metres / self.height as f32);
        let rgba = (0..i64::from(self.width) * i64::from(self.height))
            .map(|i| {
                let (x, y) = (i % i64::from(self.width), i / i64::from(self.width));
                let slope_x = (at(x + 1, y) - at(x - 1, y)) / (2.0 * step_x);
                let slope_up = (at(x, y - 1) - at(x, y + 1)) / (2.0 * step_y);
                let n = Vec3::new(-slope_x, -slope_up, 1.0).normalize() * 0.5 + Vec3::splat(0.5);
                let byte = |c: f32| (c * 255.0).round() as u8;
                [byte(n.x), byte(n.y), byte(n.z), 255]
            })
            .collect();
        Texture { name: name.to_owned(), width: self.width, height: self.height, rgba }
    }
}

/// Two colours in `cells` × `cells` squares (an even number tiles).
pub(crate) fn checker(size: u32, cells: u32, a: Vec3, b: Vec3) -> Picture {
    Picture::new(size, size, |uv| {
        let cell = (uv * cells as f32).floor();
        (if (cell.x + cell.y) as i32 % 2 == 0 { a } else { b }, 0.0)
    })
}

/// Noise between two colours with a rough relief of `depth` metres; `cells` lattice cells across the picture.
pub(crate) fn mottled(size: u32, cells: i32, a: Vec3, b: Vec3, depth: f32, seed: u32) -> Picture {
    Picture::new(size, size, |uv| {
        let p = uv * cells as f32;
        (a.lerp(b, fbm(p, cells, 4, seed)), depth * fbm(p * 2.0, cells * 2, 3, seed ^ 77))
    })
}

/// `count` boards along u, side by side down the picture, with grain, butt joints and dark gaps.
pub(crate) fn planks(size: u32, count: u32, light: Vec3, dark: Vec3, seed: u32) -> Picture {
    Picture::new(size, size, |uv| {
        let row = uv.y * count as f32;
        let board = row.floor() as u32;
        let across = row.fract();
        let joint = (hash(board ^ seed) % 97) as f32 / 97.0;
        let along = (uv.x + joint).fract();
        let tone = (hash(board.wrapping_mul(31) ^ seed ^ (u32::from(along > 0.5) * 5)) % 89) as f32 / 89.0;
        // Grain: noise drawn out along the board, with a slow wave.
        let grain_at = Vec2::new(uv.x * 4.0, uv.y * count as f32 * 10.0);
        let grain = fbm(grain_at, 0, 3, seed ^ board.wrapping_mul(7919)) * 0.65 + value_noise(uv * 8.0, 8, seed) * 0.35;
        let edge = across.min(1.0 - across) / count as f32 * size as f32;
        let end = (along - 0.5).abs().min(along.min(1.0 - along)) * size as f32;
        let gap = (edge.min(end) / 1.4).clamp(0.0, 1.0);
        let color =
            light.lerp(dark, (0.25 * tone + 0.75 * grain).clamp(0.0, 1.0)) * (0.45 + 0.55 * gap) * (0.85 + 0.3 * tone);
        (color, 0.003 * gap + 0.0006 * grain)
    })
}

/// Sliced wood without joints: fine grain along u with slow bands across it.
pub(crate) fn veneer(size: u32, light: Vec3, dark: Vec3, seed: u32) -> Picture {
    Picture::new(size, size, |uv| {
        let wave = 0.02 * value_noise(uv * 4.0, 4, seed ^ 3);
        // Lattices whose periods (2, 8 and 128 cells) divide the picture, so that it tiles.
        let bands = value_noise(Vec2::new(uv.x * 2.0, (uv.y + wave) * 16.0), 0, seed);
        let grain = value_noise(Vec2::new(uv.x * 8.0, (uv.y + wave) * 128.0), 128, seed ^ 1);
        (light.lerp(dark, (0.6 * bands + 0.4 * grain) * 0.9), 0.0)
    })
}

/// Running-bond brickwork, `columns` × `rows` bricks (even rows tile).
pub(crate) fn bricks(size: u32, columns: u32, rows: u32, brick: Vec3, mortar: Vec3, seed: u32) -> Picture {
    Picture::new(size, size, |uv| {
        let row = (uv.y * rows as f32).floor();
        let shifted = uv.x * columns as f32 + if row as i32 % 2 == 0 { 0.0 } else { 0.5 };
        let column = shifted.floor().rem_euclid(columns as f32);
        let inside = Vec2::new(shifted.fract(), (uv.y * rows as f32).fract());
        let to_edge =
            Vec2::new(inside.x.min(1.0 - inside.x) * rows as f32 / columns as f32, inside.y.min(1.0 - inside.y));
        let solid = ((to_edge.min_element() - 0.05) / 0.07).clamp(0.0, 1.0);
        let tone = (hash(hash(row as u32 ^ seed) ^ column as u32) % 101) as f32 / 101.0;
        let rough = fbm(uv * 32.0, 32, 3, seed);
        let color = mortar.lerp(brick * (0.7 + 0.5 * tone), solid) * (0.75 + 0.5 * rough);
        (color, 0.008 * solid + 0.003 * rough)
    })
}

/// Looped pile of one colour.
pub(crate) fn carpet(size: u32, color: Vec3, seed: u32) -> Picture {
    Picture::new(size, size, |uv| {
        let fine = value_noise(uv * 64.0, 64, seed);
        let broad = fbm(uv * 4.0, 4, 3, seed ^ 9);
        (color * (0.55 + 0.6 * fine + 0.3 * broad), 0.002 * fine)
    })
}

/// A board of `board` colour with `text` (A to Z, 0 to 9, blank) in letters of `ink`, six texels a letter and a frame.
pub(crate) fn lettering(text: &str, board: Vec3, ink: Vec3, seed: u32) -> Picture {
    const SCALE: u32 = 4;
    let (columns, rows) = (text.len() as u32 * 6 + 5, 13);
    Picture::new(columns * SCALE, rows * SCALE, |uv| {
        let (x, y) = ((uv.x * columns as f32) as u32, (uv.y * rows as f32) as u32);
        let frame = x == 0 || y == 0 || x + 1 == columns || y + 1 == rows;
        let (letter, column) = (x.wrapping_sub(3) / 6, x.wrapping_sub(3) % 6);
        let lit = x >= 3 && column < 5 && (3..10).contains(&y) && {
            let glyph = text.as_bytes().get(letter as usize).map_or([0; 7], |letter| glyph(*letter));
            glyph[(y - 3) as usize] >> (4 - column) & 1 == 1
        };
        let worn = 0.75 + 0.5 * fbm(Vec2::new(uv.x * 6.0, uv.y * 24.0), 0, 3, seed);
        ((if lit || frame { ink } else { board }) * worn, 0.0)
    })
}

/// Rows of a 5×7 letter, most significant of five bits on the left.
fn glyph(letter: u8) -> [u8; 7] {
    match letter {
        b'A' => [14, 17, 17, 31, 17, 17, 17],
        b'B' => [30, 17, 17, 30, 17, 17, 30],
        b'C' => [14, 17, 16, 16, 16, 17, 14],
        b'D' => [30, 17, 17, 17, 17, 17, 30],
        b'E' => [31, 16, 16, 30, 16, 16, 31],
        b'F' => [31, 16, 16, 30, 16, 16, 16],
        b'G' => [14, 17, 16, 23, 17, 17, 14],
        b'H' => [17, 17, 17, 31, 17, 17, 17],
        b'I' => [14, 4, 4, 4, 4, 4, 14],
        b'J' => [7, 2, 2, 2, 2, 18, 12],
        b'K' => [17, 18, 20, 24, 20, 18, 17],
        b'L' => [16, 16, 16, 16, 16, 16, 31],
        b'M' => [17, 27, 21, 21, 17, 17, 17],
        b'N' => [17, 25, 21, 19, 17, 17, 17],
        b'O' | b'0' => [14, 17, 17, 17, 17, 17, 14],
        b'P' => [30, 17, 17, 30, 16, 16, 16],
        b'Q' => [14, 17, 17, 17, 21, 18, 13],
        b'R' => [30, 17, 17, 30, 20, 18, 17],
        b'S' => [15, 16, 16, 14, 1, 1, 30],
        b'T' => [31, 4, 4, 4, 4, 4, 4],
        b'U' => [17, 17, 17, 17, 17, 17, 14],
        b'V' => [17, 17, 17, 17, 17, 10, 4],
        b'W' => [17, 17, 17, 21, 21, 27, 17],
        b'X' => [17, 17, 10, 4, 10, 17, 17],
        b'Y' => [17, 17, 10, 4, 4, 4, 4],
        b'Z' => [31, 1, 2, 4, 8, 16, 31],
        b'1' => [4, 12, 4, 4, 4, 4, 14],
        b'8' => [14, 17, 17, 14, 17, 17, 14],
        _ => [0; 7],
    }
}

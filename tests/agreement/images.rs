//! The test images of images.py, by the same integer arithmetic, bit for bit.

pub const WIDTH: u32 = 256;
pub const HEIGHT: u32 = 192;

type Codes = Vec<[u8; 3]>;

fn hashed(x: i64, y: i64, seed: i64) -> i64 {
    let h = (x * 374_761_393 + y * 668_265_263 + seed * 2_246_822_519) & 0xffff_ffff;
    let h = ((h ^ (h >> 13)) * 1_274_126_177) & 0xffff_ffff;
    h ^ (h >> 16)
}

/// Value noise, 0 to 255.
fn smooth(x: i64, y: i64, cell: i64, seed: i64) -> i64 {
    let (cx, cy, fx, fy) = (x / cell, y / cell, x % cell, y % cell);
    let at = |i: i64, j: i64| hashed(cx + i, cy + j, seed) & 255;
    let top = at(0, 0) * (cell - fx) + at(1, 0) * fx;
    let bottom = at(0, 1) * (cell - fx) + at(1, 1) * fx;
    (top * (cell - fy) + bottom * fy) / (cell * cell)
}

fn each(pixel: impl Fn(i64, i64) -> [i64; 3]) -> Codes {
    let at = |i: i64| pixel(i % i64::from(WIDTH), i / i64::from(WIDTH)).map(|v| v.clamp(0, 255) as u8);
    (0..i64::from(WIDTH * HEIGHT)).map(at).collect()
}

fn base(seed: i64) -> Codes {
    each(|x, y| {
        std::array::from_fn(|c| {
            let c = c as i64;
            let mut v =
                (smooth(x, y, 64, seed + c) * 5 + smooth(x, y, 16, seed + 10) * 2 + smooth(x, y, 4, seed + 20)) / 8;
            if (x - 90).pow(2) + (y - 80).pow(2) < 45 * 45 {
                v = (v + [200, 60, 40][c as usize] * 2) / 3;
            }
            if x > 160 && y > 110 && (x / 5) % 2 == 0 {
                v /= 2;
            }
            if y < 24 && x > 128 {
                v = 250 - c * 3;
            }
            if y >= 168 && x < 64 {
                v = 6 + c;
            }
            v
        })
    })
}

fn at(image: &Codes, x: i64, y: i64) -> [i64; 3] {
    let (x, y) = (x.clamp(0, i64::from(WIDTH) - 1), y.clamp(0, i64::from(HEIGHT) - 1));
    image[(y * i64::from(WIDTH) + x) as usize].map(i64::from)
}

/// Sums of a window of `n` by `n` pixels, divided by their number.
fn mean(image: &Codes, x: i64, y: i64, n: i64) -> [i64; 3] {
    let sum = (0..n * n).map(|i| at(image, x + i % n, y + i / n));
    sum.fold([0; 3], |a, b| [a[0] + b[0], a[1] + b[1], a[2] + b[2]]).map(|v| v / (n * n))
}

fn distort(image: &Codes, kind: &str, seed: i64) -> Codes {
    each(|x, y| {
        let p = at(image, x, y);
        match kind {
            "noise" => std::array::from_fn(|c| p[c] + hashed(x, y, seed + c as i64) % 41 - 20),
            "blur" => mean(image, x - 2, y - 2, 5),
            "shift" => at(image, x - 1, y),
            "contrast" => p.map(|v| v * 3 / 4 + 32),
            "colour" => [p[0] + 14, p[1], p[2] - 11],
            "fireflies" if hashed(x, y, seed) % 150 == 0 => [255; 3],
            "fireflies" => p,
            "blocks" => mean(image, x / 8 * 8, y / 8 * 8, 8),
            "faint" => p.map(|v| v + hashed(x, y, seed) % 3 - 1),
            _ => panic!("no distortion is called {kind}"),
        }
    })
}

fn hdr(codes: &Codes) -> Vec<[f32; 3]> {
    let pixel = |(i, p): (usize, &[u8; 3])| {
        let (x, y) = (i as i64 % i64::from(WIDTH), i as i64 / i64::from(WIDTH));
        let lamp = (x - 200).pow(2) + (y - 50).pow(2) < 30 * 30;
        let scale = if x < 85 {
            1.0 / 16.0
        } else if lamp {
            64.0
        } else {
            1.0
        };
        p.map(|v| f32::from(v) * f32::from(v) / 65536.0 * scale)
    };
    codes.iter().enumerate().map(pixel).collect()
}

fn number(kinds: &[&str], name: &str) -> i64 {
    kinds.iter().position(|k| *k == name).unwrap_or_else(|| panic!("no pair is called {name}")) as i64
}

/// Reference and test of a pair of codes.
pub fn pair(name: &str) -> (Codes, Codes) {
    let i = number(&["noise", "blur", "shift", "contrast", "colour", "fireflies", "blocks", "faint"], name);
    let reference = base(100 * i + 1);
    let test = distort(&reference, name, 7 + i);
    (reference, test)
}

/// Reference and test of a pair of linear values.
pub fn hdr_pair(name: &str) -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
    let i = number(&["noise", "blur", "colour", "fireflies"], name);
    let reference = base(100 * i + 51);
    let test = distort(&reference, name, 17 + i);
    (hdr(&reference), hdr(&test))
}

/// FNV-1a.
pub fn checksum(data: &[u8]) -> String {
    let hash = data.iter().fold(0xcbf2_9ce4_8422_2325_u64, |h, b| (h ^ u64::from(*b)).wrapping_mul(0x0100_0000_01b3));
    format!("{hash:016x}")
}

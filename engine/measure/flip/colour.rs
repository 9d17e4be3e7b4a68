//! FLIP's colour spaces, all relative to the white of sRGB.

/// Rows of XYZ from linear sRGB (exact fractions of the standard's primaries), in f32 as the published numbers are.
const XYZ: [[f32; 3]; 3] = [
    [10_135_552.0 / 24_577_794.0, 8_788_810.0 / 24_577_794.0, 4_435_075.0 / 24_577_794.0],
    [2_613_072.0 / 12_288_897.0, 8_788_810.0 / 12_288_897.0, 887_015.0 / 12_288_897.0],
    [1_425_312.0 / 73_733_382.0, 8_788_810.0 / 73_733_382.0, 70_074_185.0 / 73_733_382.0],
];
/// The inverse.
const RGB: [[f32; 3]; 3] = [
    [3.241_003_3, -1.537_398_9, -0.498_615_86],
    [-0.969_224_3, 1.875_930_1, 0.041_554_224],
    [0.055_639_423, -0.204_011_2, 1.057_148_9],
];
/// XYZ of (1, 1, 1).
const WHITE: [f32; 3] = [0.950_428_55, 1.0, 1.088_900_4];

fn multiply(m: &[[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
    m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// Y Cx Cz: the opponent space that is linear in light, so that it may be filtered.
pub(super) fn opponent_from_linear(rgb: [f32; 3]) -> [f32; 3] {
    let xyz = multiply(&XYZ, rgb);
    let [x, y, z] = [0, 1, 2].map(|c| xyz[c] / WHITE[c]);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// CIELab with chroma scaled by lightness (Hunt effect), after clamping to what a screen shows.
pub(super) fn adjusted_lab([y, cx, cz]: [f32; 3]) -> [f32; 3] {
    let grey = (y + 16.0) / 116.0;
    let relative = [grey + cx / 500.0, grey, grey - cz / 200.0];
    let rgb = multiply(&RGB, [0, 1, 2].map(|c| relative[c] * WHITE[c])).map(|v| v.clamp(0.0, 1.0));
    lab_from_linear(rgb)
}

fn lab_from_linear(rgb: [f32; 3]) -> [f32; 3] {
    const DELTA: f32 = 6.0 / 29.0;
    let xyz = multiply(&XYZ, rgb);
    let f = [0, 1, 2].map(|c| {
        let v: f32 = xyz[c] / WHITE[c];
        if v > DELTA * DELTA * DELTA { v.cbrt() } else { v / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
    });
    let lightness = 116.0 * f[1] - 16.0;
    let hunt = 0.01 * lightness;
    [lightness, hunt * 500.0 * (f[0] - f[1]), hunt * 200.0 * (f[1] - f[2])]
}

/// HyAB: city-block in lightness, Euclidean in chroma.
pub(super) fn distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    (a[0] - b[0]).abs() + ((a[1] - b[1]).powi(2) + (a[2] - b[2]).powi(2)).sqrt()
}

/// The distance between the green and the blue of the screen.
pub(super) fn largest_difference() -> f32 {
    distance(lab_from_linear([0.0, 1.0, 0.0]), lab_from_linear([0.0, 0.0, 1.0]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_is_neutral_and_the_spaces_invert() {
        let [y, cx, cz] = opponent_from_linear([1.0; 3]);
        assert!((y - 100.0).abs() < 1e-3 && cx.abs() < 1e-3 && cz.abs() < 1e-3);
        for rgb in [[0.2, 0.5, 0.8], [1.0, 0.0, 0.3], [0.0; 3]] {
            let (a, b) = (adjusted_lab(opponent_from_linear(rgb)), lab_from_linear(rgb));
            assert!(distance(a, b) < 2e-3, "{a:?} {b:?}");
        }
        // Lightness of half the light is 76.07.
        assert!((lab_from_linear([0.5; 3])[0] - 76.069).abs() < 1e-2);
    }
}

//! Global curves of a pixel's colour, each from its published definition.

type Rgb = [f64; 3];

fn multiply(matrix: &[Rgb; 3], v: Rgb) -> Rgb {
    matrix.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// Stephen Hill's fit of the ACES reference rendering and output transforms (RRT and ODT) for sRGB displays, 2015: matrices
/// from linear Rec. 709 to AP1 with the RRT's desaturation and back with the ODT's, as published in BakingLab.
pub fn aces(pixel: Rgb) -> Rgb {
    const INPUT: [Rgb; 3] = [[0.59719, 0.35458, 0.04823], [0.07600, 0.90834, 0.01566], [0.02840, 0.13383, 0.83777]];
    const OUTPUT: [Rgb; 3] =
        [[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]];
    let fitted = multiply(&INPUT, pixel)
        .map(|v| (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.4329510) + 0.238081));
    multiply(&OUTPUT, fitted)
}

/// Khronos PBR Neutral, specification of 2024: colours under 0.76 stay as they are but for the Fresnel offset; what is
/// brighter is compressed and goes towards white.
pub fn neutral(pixel: Rgb) -> Rgb {
    const START: f64 = 0.8 - 0.04;
    const DESATURATION: f64 = 0.15;
    let colour = pixel;
    let least = colour[0].min(colour[1]).min(colour[2]);
    let offset = if least < 0.08 { least - 6.25 * least * least } else { 0.04 };
    let colour = colour.map(|v| v - offset);
    let peak = colour[0].max(colour[1]).max(colour[2]);
    if peak < START {
        return colour;
    }
    let d = 1.0 - START;
    let compressed = 1.0 - d * d / (peak + d - START);
    let grey = 1.0 - 1.0 / (DESATURATION * (peak - compressed) + 1.0);
    colour.map(|v| {
        let v = v * compressed / peak;
        v + (compressed - v) * grey
    })
}

/// AgX (Troy Sobotka, 2022), base look: log₂ exposure between its inset matrix and the inverse of that, a sigmoid through
/// (0, 0), (20/33, 1/2) with slope 2, and (1, 1), and its display encoding of 2.2 undone, so that the result is linear Rec. 709.
pub fn agx(pixel: Rgb) -> Rgb {
    const INSET: [Rgb; 3] = [
        [0.842479062253094, 0.0784335999999992, 0.0792237451477643],
        [0.0423282422610123, 0.878468636469772, 0.0791661274605434],
        [0.0423756549057051, 0.0784336, 0.879142973793104],
    ];
    const LOW: f64 = -12.47393;
    const HIGH: f64 = 4.026069;
    let sigmoid = |v: f64| {
        let x = ((v.max(f64::MIN_POSITIVE).log2() - LOW) / (HIGH - LOW)).clamp(0.0, 1.0);
        let pivot = 20.0 / 33.0;
        let (power, end): (f64, f64) = if x < pivot { (3.0, pivot) } else { (3.25, 1.0 - pivot) };
        let scale = 4f64.powf(power) - end.powf(-power);
        0.5 + 2.0 * (x - pivot) * (1.0 + scale * (x - pivot).abs().powf(power)).powf(-1.0 / power)
    };
    multiply(&inverse(&INSET), multiply(&INSET, pixel).map(sigmoid)).map(|v| v.max(0.0).powf(2.2))
}

/// By cofactors.
fn inverse(m: &[Rgb; 3]) -> [Rgb; 3] {
    let minor = |i: usize, j: usize| {
        let (a, b, c, d) = ((i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3);
        m[a][c] * m[b][d] - m[a][d] * m[b][c]
    };
    let determinant: f64 = (0..3).map(|j| m[0][j] * minor(0, j)).sum();
    std::array::from_fn(|i| std::array::from_fn(|j| minor(j, i) / determinant))
}

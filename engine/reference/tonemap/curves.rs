//! Global curves of a pixel's colour, each from its published definition.

use super::plane::luminance_of;

type Rgb = [f64; 3];

fn multiply(matrix: &[Rgb; 3], v: Rgb) -> Rgb {
    matrix.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// Extended Reinhard (Reinhard 2002, equation 4) of luminance without scaling; colour keeps its ratios.
pub fn extended_reinhard(pixel: [f32; 3], white: f64) -> Rgb {
    let l = luminance_of(pixel);
    let ratio = (1.0 + l / (white * white)) / (1.0 + l);
    pixel.map(|v| f64::from(v) * ratio)
}

/// Stephen Hill's fit of the ACES reference rendering and output transforms (RRT and ODT) for sRGB displays, 2015: matrices
/// from linear Rec. 709 to AP1 with the RRT's desaturation and back with the ODT's, as published in BakingLab.
pub fn aces_hill(pixel: [f32; 3]) -> Rgb {
    const INPUT: [Rgb; 3] = [[0.59719, 0.35458, 0.04823], [0.07600, 0.90834, 0.01566], [0.02840, 0.13383, 0.83777]];
    const OUTPUT: [Rgb; 3] =
        [[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]];
    let fitted = multiply(&INPUT, pixel.map(f64::from))
        .map(|v| (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.4329510) + 0.238081));
    multiply(&OUTPUT, fitted)
}

/// Krzysztof Narkowicz's fit of the ACES film curve, 2015, channel by channel.
pub fn aces_narkowicz(pixel: [f32; 3]) -> Rgb {
    pixel.map(f64::from).map(|v| (v * (2.51 * v + 0.03)) / (v * (2.43 * v + 0.59) + 0.14))
}

/// Khronos PBR Neutral, specification of 2024: colours under 0.76 stay as they are but for the Fresnel offset; what is
/// brighter is compressed and goes towards white.
pub fn neutral(pixel: [f32; 3]) -> Rgb {
    const START: f64 = 0.8 - 0.04;
    const DESATURATION: f64 = 0.15;
    let colour = pixel.map(f64::from);
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

/// AgX (Troy Sobotka) in the form that Filament and three.js give it: Blender's working space of Rec. 2020 primaries, inset
/// matrix, log2 from −12.47393 to 4.026069, the polynomial fit of the default contrast by Benjamin Wrensch, outset matrix, and
/// its display encoding of 2.2 undone, so that the result is linear Rec. 709.
pub fn agx(pixel: [f32; 3]) -> Rgb {
    const REC2020: [Rgb; 3] = [[0.6274, 0.3293, 0.0433], [0.0691, 0.9195, 0.0113], [0.0164, 0.0880, 0.8956]];
    const REC709: [Rgb; 3] = [[1.6605, -0.5876, -0.0728], [-0.1246, 1.1329, -0.0083], [-0.0182, -0.1006, 1.1187]];
    const INSET: [Rgb; 3] = [
        [0.856627153315983, 0.0951212405381588, 0.0482516061458583],
        [0.137318972929847, 0.761241990602591, 0.101439036467562],
        [0.11189821299995, 0.0767994186031903, 0.811302368396859],
    ];
    const OUTSET: [Rgb; 3] = [
        [1.1271005818144368, -0.11060664309660323, -0.016493938717834573],
        [-0.1413297634984383, 1.157823702216272, -0.016493938717834257],
        [-0.14132976349843826, -0.11060664309660294, 1.2519364065950405],
    ];
    const LOW: f64 = -12.47393;
    const HIGH: f64 = 4.026069;
    let inset = multiply(&INSET, multiply(&REC2020, pixel.map(f64::from)));
    let contrast = inset.map(|v| {
        let x = ((v.max(1e-10).log2() - LOW) / (HIGH - LOW)).clamp(0.0, 1.0);
        15.5 * x.powi(6) - 40.14 * x.powi(5) + 31.96 * x.powi(4) - 6.868 * x.powi(3) + 0.4298 * x * x + 0.1191 * x - 0.00232
    });
    let shown = multiply(&OUTSET, contrast).map(|v| v.max(0.0).powf(2.2));
    multiply(&REC709, shown).map(|v| v.clamp(0.0, 1.0))
}

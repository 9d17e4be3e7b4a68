//! PerceptualDiff: H. Yee, A. Newman, "A Perceptual Metric for Production Testing" (2004), with the numbers of the program
//! `perceptualdiff` 2.1.

use super::{Map, Measure, Measured, Options, Pair, convolve, display, parallel};
use crate::{Result, image::srgb};

/// Levels of the pyramid: each is the one before, blurred; all in full size.
const LEVELS: usize = 8;
/// Bands whose contrast counts.
const BANDS: usize = LEVELS - 2;
/// Below this adaptation, cd/m², colours are not compared.
const COLOUR_FROM: f32 = 10.0;

/// XYZ of linear Adobe RGB (1998), the colours that the program takes its input for.
const XYZ: [[f32; 3]; 3] =
    [[0.576_7, 0.185_556, 0.188_212], [0.297_361, 0.627_355, 0.075_284_7], [0.027_032_8, 0.070_687_9, 0.991_248]];

/// Share of pixels, %, that a human observer sees to be different. `pixels` is their count; `different` is 1 where the count
/// reaches [`Options::pdiff_threshold`], the program's verdict.
///
/// The program exchanges red and blue (it reads FreeImage's BGRA as RGBA), and so does [`Options::pdiff_swapped`], the default: the
/// numbers are then the program's, to the pixel.
///
/// Screen codes become light by the power [`Options::pdiff_gamma`] (2.2) and XYZ by the matrix of Adobe RGB, as the program
/// does it; white has [`Options::white_luminance`]. Luminance differs where |ΔY| > F · TVI(adaptation), with
/// F the contrast-weighted mean over the bands of CSF and masking elevation, in [1, 10]; colour where Δa² + Δb² > F (scaled by
/// [`Options::pdiff_color`]; not below 10 cd/m²).
pub fn pdiff(pair: &Pair<'_>, options: &Options) -> Result<Measured> {
    let size = [pair.width(), pair.height()];
    let threads = parallel::threads(options.threads);
    let shown = display::shown(pair, options);
    let white = options.white_luminance as f32;
    let light = |image: &[[f32; 3]]| seen(image, options, size[0], threads);
    let (a, b) = (light(&shown.reference), light(&shown.test));
    let pyramid = |image: &[[f32; 3]]| pyramid(image.iter().map(|p| p[0] * white).collect(), size, threads);
    let (la, lb) = (pyramid(&a), pyramid(&b));

    let field = (2.0 * (options.pdiff_fov.to_radians() * 0.5).tan()).to_degrees() as f32;
    let level = adaptation_level(field);
    let mut cycles = [0.5 * size[0] as f32 / field; BANDS];
    (1..BANDS).for_each(|i| cycles[i] = 0.5 * cycles[i - 1]);
    let peak = csf(3.248, 100.0);
    let frequency = cycles.map(|c| peak / csf(c, 100.0));

    let mut values = vec![0.0_f32; size[0] * size[1]];
    parallel::rows(threads, &mut values, size[0], |y, row| {
        for (x, value) in row.iter_mut().enumerate() {
            let i = y * size[0] + x;
            let adapt = ((la[level][i] + lb[level][i]) * 0.5).max(1e-5);
            let (mut sum, mut factor) = (0.0_f32, 0.0);
            for k in 0..BANDS {
                let band = |l: &[Vec<f32>]| (l[k][i] - l[k + 1][i]).abs();
                let below = la[k + 2][i].abs().max(lb[k + 2][i].abs()).max(1e-5);
                let contrast = band(&la).max(band(&lb)) / below;
                factor += contrast * frequency[k] * masking(contrast * csf(cycles[k], adapt));
                sum += contrast;
            }
            let factor = (factor / sum.max(1e-5)).clamp(1.0, 10.0);
            let luminance = (la[0][i] - lb[0][i]).abs() / (factor * tvi(adapt));
            let colour = (a[i][1] - b[i][1]).powi(2) + (a[i][2] - b[i][2]).powi(2);
            let weight = if adapt < COLOUR_FROM { 0.0 } else { options.pdiff_color as f32 };
            *value = luminance.max(colour * weight / factor);
        }
    });
    let pixels = values.iter().filter(|v| **v > 1.0).count() as u64;
    let share = 100.0 * pixels as f64 / values.len() as f64;
    let map = Map {
        width: pair.reference.width,
        height: pair.reference.height,
        values,
        range: [0.0, 2.0],
        meaning: "difference over its threshold; above 1 it is visible",
    };
    let different = pixels >= options.pdiff_threshold.max(1);
    Ok(Measured::new(Measure::Pdiff, share, map)
        .with("pixels", pixels as f64)
        .with("different", f64::from(u8::from(different)))
        .with("exposure", shown.stops)
        .noted(if different { "visibly different" } else { "perceptually indistinguishable" }))
}

/// Y (white 1), a*, b* of every pixel.
fn seen(image: &[[f32; 3]], options: &Options, width: usize, threads: usize) -> Vec<[f32; 3]> {
    let gamma = options.pdiff_gamma.map(|g| g as f32);
    let order = if options.pdiff_swapped { [2, 1, 0] } else { [0, 1, 2] };
    let white = XYZ.map(|row| row.iter().sum::<f32>());
    let mut out = vec![[0.0; 3]; image.len()];
    parallel::rows(threads, &mut out, width, |y, row| {
        for (out, pixel) in row.iter_mut().zip(&image[y * width..]) {
            let ordered = order.map(|c| pixel[c]);
            let light = match gamma {
                Some(gamma) => ordered.map(|v| srgb::encode(v).powf(gamma)),
                None => ordered,
            };
            let xyz = XYZ.map(|row| row[0] * light[0] + row[1] * light[1] + row[2] * light[2]);
            let f: [f32; 3] = std::array::from_fn(|c| {
                let r = xyz[c] / white[c];
                if r > 216.0 / 24389.0 { r.cbrt() } else { (24389.0 / 27.0 * r + 16.0) / 116.0 }
            });
            *out = [xyz[1], 500.0 * (f[0] - f[1]), 200.0 * (f[1] - f[2])];
        }
    });
    out
}

fn pyramid(luminance: Vec<f32>, size: [usize; 2], threads: usize) -> Vec<Vec<f32>> {
    const KERNEL: [f32; 5] = [0.05, 0.25, 0.4, 0.25, 0.05];
    let mut levels = vec![luminance];
    while levels.len() < LEVELS {
        let finer = &levels[levels.len() - 1];
        levels.push(convolve::separable(finer, size, &KERNEL, &KERNEL, convolve::Edge::Yee, threads));
    }
    levels
}

/// The level whose blur is about a degree wide.
fn adaptation_level(pixels_per_degree: f32) -> usize {
    (0..LEVELS).find(|&level| (1_u32 << level) as f32 > pixels_per_degree).unwrap_or(LEVELS - 1)
}

/// Threshold against intensity, cd/m² (Ward Larson et al. 1997).
fn tvi(adaptation: f32) -> f32 {
    let log = adaptation.log10();
    let r = if log < -3.94 {
        -2.86
    } else if log < -1.44 {
        (0.405 * log + 1.6).powf(2.18) - 2.86
    } else if log < -0.0184 {
        log - 0.395
    } else if log < 1.9 {
        (0.249 * log + 0.65).powf(2.7) - 0.72
    } else {
        log - 1.255
    };
    10_f32.powf(r)
}

/// Contrast sensitivity at `cycles` per degree and a luminance in cd/m² (Barten 1989).
fn csf(cycles: f32, luminance: f32) -> f32 {
    let a = 440.0 * (1.0 + 0.7 / luminance).powf(-0.2);
    let b = 0.3 * (1.0 + 100.0 / luminance).powf(0.15);
    a * cycles * (-b * cycles).exp() * (1.0 + 0.06 * (b * cycles).exp()).sqrt()
}

/// By how much a mask of this contrast (in thresholds) raises the threshold (Daly 1993).
fn masking(contrast: f32) -> f32 {
    let a = (392.498 * contrast).powf(0.7);
    (1.0 + (0.0153 * a).powi(4)).sqrt().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threshold_curve_rises_and_its_pieces_nearly_meet() {
        for edge in [-3.94_f32, -1.44, -0.0184, 1.9] {
            let (below, above) = (tvi(10_f32.powf(edge - 1e-3)), tvi(10_f32.powf(edge + 1e-3)));
            assert!((above / below - 1.0).abs() < 0.05, "{edge}: {below} {above}");
        }
        let values: Vec<f32> = (-40..=40).map(|i| tvi(10_f32.powf(i as f32 / 10.0))).collect();
        assert!(values.windows(2).all(|pair| pair[0] <= pair[1] * 1.05));
    }

    #[test]
    fn sensitivity_peaks_at_a_few_cycles_and_masks_raise_thresholds() {
        let peak = (1..400).map(|i| i as f32 / 10.0).max_by(|a, b| csf(*a, 100.0).total_cmp(&csf(*b, 100.0))).unwrap();
        assert!((peak - 3.248).abs() < 0.2, "{peak}");
        assert!(csf(4.0, 0.1) < csf(4.0, 100.0));
        assert!(
            (masking(0.0) - 1.0).abs() < 1e-6 && (masking(10.0) / (0.0153 * 3924.98_f32.powf(0.7)) - 1.0).abs() < 0.01
        );
    }
}

//! Luminance and chroma of OpenEXR files become R G B, with the filters of OpenEXR's own reader.
//!
//! Source: ImfRgbaYca.h and .cpp and `RgbaInputFile` in ImfRgbaFile.cpp of OpenEXR 3.5 (BSD-3-Clause). The reader rounds to 16 bits after each
//! step; here all steps are in 32 bits.

use glam::Vec3;

use super::{Layer, zeroed};
use crate::Result;

/// Weights of the samples 1, 3, 5 … 13 pixels to either side of a pixel between two samples: half of a low-pass filter of 27 taps, whose taps
/// at other distances are zero.
const TAPS: [f32; 7] = [0.627_123, -0.186_077, 0.087_929, -0.043_159, 0.019_597, -0.007_540, 0.002_128];

/// Fills the pixels between samples that stand at even columns and rows, linearly; the last is repeated.
///
/// For what is no chroma: the filter of chroma overshoots at edges.
pub(super) fn fill_linearly(layer: &mut Layer, channel: usize, [width, height]: [usize; 2]) -> Result<()> {
    let stride = layer.channels.len();
    let at = |x: usize, y: usize| (y * width + x) * stride + channel;
    for y in (0..height).step_by(2) {
        for x in (1..width).step_by(2) {
            let right = if x + 1 < width { x + 1 } else { x - 1 };
            layer.data[at(x, y)] = 0.5 * (layer.data[at(x - 1, y)] + layer.data[at(right, y)]);
        }
    }
    for y in (1..height).step_by(2) {
        let below = if y + 1 < height { y + 1 } else { y - 1 };
        for x in 0..width {
            layer.data[at(x, y)] = 0.5 * (layer.data[at(x, y - 1)] + layer.data[at(x, below)]);
        }
    }
    Ok(())
}

/// Fills the pixels between samples of chroma that stand at even columns and rows; the first and the last sample are repeated outside.
pub(super) fn fill_chroma(layer: &mut Layer, channel: usize, [width, height]: [usize; 2]) -> Result<()> {
    let stride = layer.channels.len();
    let mut sampled = zeroed(width * height.div_ceil(2))?;
    let mut samples = vec![0.0; width.div_ceil(2) + 2 * TAPS.len()];
    for (line, row) in sampled.chunks_exact_mut(width).zip(layer.data.chunks_exact(width * stride).step_by(2)) {
        let last = width.div_ceil(2) - 1;
        for (i, sample) in samples.iter_mut().enumerate() {
            *sample = row[2 * i.saturating_sub(TAPS.len()).min(last) * stride + channel];
        }
        for (x, value) in line.iter_mut().enumerate() {
            let i = x / 2 + TAPS.len();
            let sum = || TAPS.iter().enumerate().map(|(k, tap)| tap * (samples[i - k] + samples[i + 1 + k])).sum();
            *value = if x % 2 == 0 { samples[i] } else { sum() };
        }
    }
    let mut line = vec![0.0; width];
    for (y, row) in layer.data.chunks_exact_mut(width * stride).enumerate() {
        if y % 2 == 0 {
            line.copy_from_slice(&sampled[y / 2 * width..][..width]);
        } else {
            between_rows(y as i64, &sampled, &mut line);
        }
        row.chunks_exact_mut(stride).zip(&line).for_each(|(pixel, value)| pixel[channel] = *value);
    }
    Ok(())
}

/// The row `y`, an odd number from −1 on, from the rows that have samples.
fn between_rows(y: i64, sampled: &[f32], line: &mut [f32]) {
    let width = line.len();
    let last = (sampled.len() / width) as i64 - 1;
    let row = |i: i64| &sampled[i.clamp(0, last) as usize * width..][..width];
    line.fill(0.0);
    for (k, tap) in (0i64..).zip(TAPS) {
        let above = y.div_euclid(2);
        for ((sum, a), b) in line.iter_mut().zip(row(above - k)).zip(row(above + 1 + k)) {
            *sum += tap * (a + b);
        }
    }
}

/// Luminance Y and the chroma differences RY = (R − Y) / Y, BY = (B − Y) / Y become R G B. `weights`: of R, G and B in Y.
///
/// `filtered`: chroma went through [`fill_chroma`]. Then the colour of pixels that are far more saturated than their neighbours is the error of a
/// filter at an edge of luminance, and they are made less saturated at the same luminance, as OpenEXR's reader does it.
pub(super) fn to_rgb(layer: &mut Layer, weights: Vec3, filtered: bool, [width, height]: [usize; 2]) -> Result<()> {
    let (Some(y), Some(ry), Some(by)) = (layer.channel("Y"), layer.channel("RY"), layer.channel("BY")) else {
        return Ok(());
    };
    let mut places = [y, ry, by];
    places.sort_unstable();
    let channels = layer.channels.len();
    let colour = |luminance: f32, red: f32, blue: f32| {
        // Grey stays grey, whatever the weights round to.
        if red == 0.0 && blue == 0.0 {
            return Vec3::splat(luminance);
        }
        let (red, blue) = ((red + 1.0) * luminance, (blue + 1.0) * luminance);
        Vec3::new(red, (luminance - red * weights.x - blue * weights.z) / weights.y, blue)
    };
    // Saturation of all rows, and of one more above and below as the reader makes them up: the row above has the luminance of the first row and
    // chroma that is filtered across the border; the row below is the last row that has chroma of its own.
    let mut saturations = Vec::new();
    if filtered {
        saturations = zeroed(width * (height + 2))?;
        let row = |y: usize, channel: usize| -> Vec<f32> {
            layer.data[y * width * channels..][..width * channels]
                .iter()
                .skip(channel)
                .step_by(channels)
                .copied()
                .collect()
        };
        let above = |channel: usize| {
            let rows: Vec<f32> = (0..height).step_by(2).take(TAPS.len() + 1).flat_map(|y| row(y, channel)).collect();
            let mut line = vec![0.0; width];
            between_rows(-1, &rows, &mut line);
            line
        };
        let last = (height - 1) & !1;
        let outside = [[row(0, y), above(ry), above(by)], [row(last, y), row(last, ry), row(last, by)]];
        for (first, [y, ry, by]) in [0, (height + 1) * width].into_iter().zip(outside) {
            for (x, saturated) in saturations[first..].iter_mut().take(width).enumerate() {
                *saturated = saturation(colour(y[x], ry[x], by[x]));
            }
        }
    }
    for (i, pixel) in layer.data.chunks_exact_mut(channels).enumerate() {
        let found = colour(pixel[y], pixel[ry], pixel[by]);
        if let Some(saturated) = saturations.get_mut(width + i) {
            *saturated = saturation(found);
        }
        places.iter().zip(found.to_array()).for_each(|(&place, value)| pixel[place] = value);
    }
    for (place, name) in places.into_iter().zip(["R", "G", "B"]) {
        layer.channels[place] = name.to_owned();
    }
    if filtered {
        for (i, pixel) in layer.data.chunks_exact_mut(channels).enumerate() {
            let (x, row) = (i % width, i / width);
            let (left, right) = (x.saturating_sub(1), (x + 1).min(width - 1));
            let of = |x: usize, row: usize| saturations[row * width + x];
            let mean = (0.25 * (of(left, row) + of(right, row) + of(left, row + 2) + of(right, row + 2))).min(1.0);
            let most = (1.0 - 0.25 * (1.0 - mean)).min(1.0);
            let own = of(x, row + 1);
            if own > mean && own > most {
                let rgb = Vec3::from_array(places.map(|place| pixel[place]));
                let less = desaturated(rgb, most / own, weights);
                places.iter().zip(less.to_array()).for_each(|(&place, value)| pixel[place] = value);
            }
        }
    }
    Ok(())
}

/// 0 (grey) to 1 and, where a channel is negative, above.
fn saturation(rgb: Vec3) -> f32 {
    if rgb.max_element() > 0.0 { 1.0 - rgb.min_element() / rgb.max_element() } else { 0.0 }
}

/// Distances from the largest channel are multiplied by `factor`, then the luminance is restored.
fn desaturated(rgb: Vec3, factor: f32, weights: Vec3) -> Vec3 {
    let most = Vec3::splat(rgb.max_element());
    let less = (most - (most - rgb) * factor).max(Vec3::ZERO);
    let luminance = less.dot(weights);
    if luminance > 0.0 { less * (rgb.dot(weights) / luminance) } else { less }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WEIGHTS: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);

    fn layer(channels: &[&str], values: Vec<f32>) -> Layer {
        Layer::new("", channels, values)
    }

    /// An even function of the place that the samples can show: filtered, it comes back nearly as it was, where lines between the samples
    /// leave up to 29 % of it away.
    #[test]
    fn waves_between_the_samples_come_back() {
        let size = [64, 64];
        let wave = |x: usize, y: usize| {
            let phase = |place: usize| std::f32::consts::TAU * place as f32 / 8.0;
            0.5 + 0.2 * phase(x).sin() + 0.2 * phase(y).cos()
        };
        let sampled: Vec<f32> = (0..64 * 64)
            .map(|i| (i % 64, i / 64))
            .map(|(x, y)| if x % 2 == 0 && y % 2 == 0 { wave(x, y) } else { 9.0 })
            .collect();
        let worst = |fill: fn(&mut Layer, usize, [usize; 2]) -> Result<()>| {
            let mut filled = layer(&["RY"], sampled.clone());
            fill(&mut filled, 0, size).unwrap();
            let inside = (14..50).flat_map(|y| (14..50).map(move |x| (x, y)));
            inside.map(|(x, y)| (filled.data[y * 64 + x] - wave(x, y)).abs()).fold(0.0, f32::max)
        };
        assert!(worst(fill_chroma) < 0.004, "{}", worst(fill_chroma));
        assert!(worst(fill_linearly) > 0.05, "{}", worst(fill_linearly));
    }

    #[test]
    fn constant_chroma_stays_and_odd_sizes_are_filled() {
        for size in [[1, 1], [2, 2], [5, 3], [30, 31]] {
            let mut filled = layer(&["BY"], vec![f32::NAN; size[0] * size[1]]);
            for y in (0..size[1]).step_by(2) {
                (0..size[0]).step_by(2).for_each(|x| filled.data[y * size[0] + x] = 0.25);
            }
            fill_chroma(&mut filled, 0, size).unwrap();
            // The weights of the source add up to 1.000002.
            assert!(filled.data.iter().all(|v| (v - 0.25).abs() < 1e-5), "{size:?}: {:?}", filled.data);
        }
    }

    /// Green falls as red and blue grow, so a pixel of too much chroma has negative green: that is an error of the filter.
    #[test]
    fn a_pixel_that_is_far_more_saturated_than_its_neighbours_is_mended_at_its_luminance() {
        let [width, height] = [6, 6];
        let grey = [0.0, 0.5, 0.0];
        let mut values: Vec<f32> = grey.repeat(width * height);
        values[3 * (2 * width + 3)] = 3.0;
        values[3 * (2 * width + 3) + 2] = 3.0;
        let mut picture = layer(&["RY", "Y", "BY"], values.clone());
        to_rgb(&mut picture, WEIGHTS, true, [width, height]).unwrap();
        let rgb = |picture: &Layer| Vec3::from_slice(&picture.data[3 * (2 * width + 3)..][..3]);
        assert_eq!(picture.channels, ["R", "G", "B"]);
        let found = rgb(&picture);
        assert!(found.min_element() >= 0.0 && (found.dot(WEIGHTS) - 0.5).abs() < 1e-5, "{found}");
        assert!((saturation(found) - 0.75).abs() < 1e-5, "{found}");
        // Chroma of each pixel is taken as it is.
        let mut exact = layer(&["RY", "Y", "BY"], values);
        to_rgb(&mut exact, WEIGHTS, false, [width, height]).unwrap();
        assert!(rgb(&exact).y < 0.0 && (rgb(&exact).dot(WEIGHTS) - 0.5).abs() < 1e-5, "{}", rgb(&exact));
    }
}

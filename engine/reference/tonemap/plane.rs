//! Images of one number a pixel, and what all operators do with them. Nothing here is fast: samples are looked up one by one.

use std::{ops::Index, thread};

/// Pixels below which starting threads would take longer than they save.
const ALONE: usize = 1 << 12;

/// `width · height` numbers, top row first. Samples outside the image are those of the nearest edge pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    pub width: usize,
    pub height: usize,
    pub values: Vec<f64>,
}

impl Plane {
    /// Computes each pixel by itself; the result does not depend on the number of cores.
    pub fn from_fn(width: usize, height: usize, pixel: impl Fn(usize, usize) -> f64 + Sync) -> Self {
        Self::from_rows(width, height, |y, row| row.iter_mut().enumerate().for_each(|(x, value)| *value = pixel(x, y)))
    }

    /// Computes each row by itself, rows shared out to all cores in turn.
    fn from_rows(width: usize, height: usize, row: impl Fn(usize, &mut [f64]) + Sync) -> Self {
        let mut values = vec![0.0; width * height];
        if values.is_empty() {
            return Self { width, height, values };
        }
        if values.len() < ALONE {
            values.chunks_mut(width).enumerate().for_each(|(y, values)| row(y, values));
            return Self { width, height, values };
        }
        let cores = thread::available_parallelism().map_or(1, |n| n.get());
        let share = height.div_ceil(cores);
        thread::scope(|scope| {
            for (part, rows) in values.chunks_mut(share * width).enumerate() {
                let row = &row;
                scope.spawn(move || {
                    rows.chunks_mut(width).enumerate().for_each(|(y, values)| row(part * share + y, values));
                });
            }
        });
        Self { width, height, values }
    }

    /// The same, from each value of this plane.
    pub fn map(&self, value: impl Fn(f64) -> f64 + Sync) -> Self {
        Self::from_fn(self.width, self.height, |x, y| value(self[(x, y)]))
    }

    /// A sample anywhere, edges repeated.
    pub fn clamped(&self, x: isize, y: isize) -> f64 {
        let x = x.clamp(0, self.width as isize - 1) as usize;
        let y = y.clamp(0, self.height as isize - 1) as usize;
        self[(x, y)]
    }

    /// Smallest and largest value. `None` without pixels.
    pub fn range(&self) -> Option<(f64, f64)> {
        let first = *self.values.first()?;
        Some(self.values.iter().fold((first, first), |(low, high), &v| (low.min(v), high.max(v))))
    }

    /// Weighted mean of the neighbourhood of (x, y): `weights[d]` is the weight of distance d along one axis, and a pixel
    /// weighs the product of both axes. This is the definition, with its cost of (2r + 1)² samples.
    pub fn average(&self, x: usize, y: usize, weights: &[f64]) -> f64 {
        let radius = weights.len() as isize - 1;
        let (mut sum, mut total) = (0.0, 0.0);
        for j in -radius..=radius {
            for i in -radius..=radius {
                let weight = weights[i.unsigned_abs()] * weights[j.unsigned_abs()];
                sum += weight * self.clamped(x as isize + i, y as isize + j);
                total += weight;
            }
        }
        sum / total
    }

    /// [`Plane::average`] of every pixel, along rows and then along columns: the weights are products and the edges are
    /// repeated, so this is the same sum in another order.
    pub fn averages(&self, weights: &[f64]) -> Self {
        let radius = weights.len() as isize - 1;
        let total: f64 = (-radius..=radius).map(|i| weights[i.unsigned_abs()]).sum();
        let weights: Vec<f64> = (-radius..=radius).map(|i| weights[i.unsigned_abs()] / total).collect();
        let rows = Self::from_rows(self.width, self.height, |y, row| {
            let padded = -radius..self.width as isize + radius;
            let line: Vec<f64> = padded.map(|x| self.clamped(x, y as isize)).collect();
            for (value, window) in row.iter_mut().zip(line.windows(weights.len())) {
                *value = window.iter().zip(&weights).map(|(v, w)| v * w).sum();
            }
        });
        Self::from_rows(self.width, self.height, |y, row| {
            for (weight, j) in weights.iter().zip(-radius..) {
                let from = (y as isize + j).clamp(0, self.height as isize - 1) as usize * self.width;
                row.iter_mut().zip(&rows.values[from..]).for_each(|(value, v)| *value += weight * v);
            }
        })
    }
}

/// Averages of every pixel with a Gaussian: its σ, and its weights of the distances 0 to its radius.
pub type Average = fn(&Plane, f64, &[f64]) -> Plane;

impl Index<(usize, usize)> for Plane {
    type Output = f64;

    fn index(&self, (x, y): (usize, usize)) -> &f64 {
        &self.values[y * self.width + x]
    }
}

/// Weights exp(−d² / 2σ²) of the distances 0 to `radius`; σ of 0 is the pixel alone.
pub fn gaussian(sigma: f64, radius: usize) -> Vec<f64> {
    if sigma <= 0.0 {
        return vec![1.0];
    }
    (0..=radius).map(|d| (-((d * d) as f64) / (2.0 * sigma * sigma)).exp()).collect()
}

/// Luminance of linear Rec. 709 pixels.
pub fn luminance(width: usize, height: usize, pixels: &[[f32; 3]]) -> Plane {
    Plane::from_fn(width, height, |x, y| luminance_of(pixels[y * width + x]))
}

/// Luminance of one linear Rec. 709 pixel.
pub fn luminance_of(pixel: [f32; 3]) -> f64 {
    let [r, g, b] = pixel.map(f64::from);
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

//! Fourier transforms of lengths that are products of 2, 3 and 5.

use std::f64::consts::TAU;

use crate::measure::parallel;

/// A complex number.
pub(super) type Complex = [f32; 2];

fn add(a: Complex, b: Complex) -> Complex {
    [a[0] + b[0], a[1] + b[1]]
}

fn multiply(a: Complex, b: Complex) -> Complex {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}

/// The smallest length from `n` on that can be transformed.
pub(super) fn good_length(n: usize) -> usize {
    let smooth = |mut n: usize| {
        for p in [2, 3, 5] {
            while n.is_multiple_of(p) {
                n /= p;
            }
        }
        n == 1
    };
    (n.max(1)..).find(|&n| smooth(n)).unwrap_or(n)
}

/// A transform of one length and direction.
pub(super) struct Line {
    length: usize,
    /// Factors, in the order in which they are taken.
    radices: Vec<usize>,
    /// exp(± 2πi k/n).
    twiddles: Vec<Complex>,
}

impl Line {
    /// Forward (exp(−…)) or inverse (exp(+…)), neither scaled. `length` must come from [`good_length`].
    pub(super) fn new(length: usize, inverse: bool) -> Self {
        let mut radices = Vec::new();
        let mut rest = length;
        for p in [4, 2, 3, 5] {
            while rest.is_multiple_of(p) && rest > 1 {
                radices.push(p);
                rest /= p;
            }
        }
        let sign = if inverse { TAU } else { -TAU };
        let twiddles = (0..length)
            .map(|k| {
                let (sin, cos) = (sign * k as f64 / length as f64).sin_cos();
                [cos as f32, sin as f32]
            })
            .collect();
        Self { length, radices, twiddles }
    }

    /// In place; `scratch` is as long as `data`.
    ///
    /// Stockham's order: after a step the `p` parts of each group stand side by side, so nothing is ever sorted.
    pub(super) fn run(&self, data: &mut [Complex], scratch: &mut [Complex]) {
        let n = self.length;
        let (mut from, mut to) = (data, scratch);
        let mut swapped = false;
        // Groups of `done` values are transformed; `groups` of them are left to be joined.
        let (mut groups, mut done) = (n, 1);
        for &p in &self.radices {
            groups /= p;
            match p {
                2 => self.step::<2>(from, to, groups, done),
                3 => self.step::<3>(from, to, groups, done),
                4 => self.step::<4>(from, to, groups, done),
                _ => self.step::<5>(from, to, groups, done),
            }
            done *= p;
            std::mem::swap(&mut from, &mut to);
            swapped = !swapped;
        }
        if swapped {
            // The result lies in the caller's scratch, which `from` is now.
            to.copy_from_slice(from);
        }
    }

    /// Joins `P` transforms of length `done` into one, for each of `groups`.
    fn step<const P: usize>(&self, from: &[Complex], to: &mut [Complex], groups: usize, done: usize) {
        let n = self.length;
        let stride = n / (done * P);
        // exp(± 2πi jk/P).
        let root: [[Complex; P]; P] =
            std::array::from_fn(|j| std::array::from_fn(|k| self.twiddles[(j * k % P) * (n / P)]));
        for q in 0..done {
            let turn: [Complex; P] = std::array::from_fn(|j| self.twiddles[q * j * stride]);
            for g in 0..groups {
                let part: [Complex; P] = std::array::from_fn(|j| multiply(from[(j * groups + g) * done + q], turn[j]));
                let base = g * P * done + q;
                if P == 4 {
                    let (even, odd) = (add(part[0], part[2]), add(part[1], part[3]));
                    let (even2, odd2) = (minus(part[0], part[2]), multiply(minus(part[1], part[3]), root[1][1]));
                    to[base] = add(even, odd);
                    to[base + done] = add(even2, odd2);
                    to[base + 2 * done] = minus(even, odd);
                    to[base + 3 * done] = minus(even2, odd2);
                    continue;
                }
                for k in 0..P {
                    let sum = (1..P).fold(part[0], |sum, j| add(sum, multiply(part[j], root[j][k])));
                    to[base + k * done] = sum;
                }
            }
        }
    }
}

fn minus(a: Complex, b: Complex) -> Complex {
    [a[0] - b[0], a[1] - b[1]]
}

/// Transforms every row for which `wanted` says so.
pub(super) fn rows(line: &Line, data: &mut [Complex], threads: usize, wanted: impl Fn(usize) -> bool + Sync) {
    parallel::rows_with(
        threads,
        data,
        line.length,
        || vec![[0.0; 2]; line.length],
        |scratch, y, row| {
            if wanted(y) {
                line.run(row, scratch);
            }
        },
    );
}

/// `data` of `width` columns, with rows and columns exchanged.
pub(super) fn transpose(data: &[Complex], out: &mut [Complex], width: usize, threads: usize) {
    const BLOCK: usize = 16;
    let height = data.len() / width.max(1);
    // A band of columns becomes a band of rows; blocks keep both sides in the cache.
    parallel::bands(threads, out, height, BLOCK, |x0, rows| {
        for y0 in (0..height).step_by(BLOCK) {
            for (dx, row) in rows.chunks_exact_mut(height).enumerate() {
                for (y, value) in row.iter_mut().enumerate().take((y0 + BLOCK).min(height)).skip(y0) {
                    *value = data[y * width + x0 + dx];
                }
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(n: usize) -> Vec<Complex> {
        let value = |i: usize| ((i * 7919 + 13) % 1009) as f32 / 1009.0 - 0.5;
        (0..n).map(|i| [value(2 * i), value(2 * i + 1)]).collect()
    }

    #[test]
    fn equals_the_sum_it_stands_for() {
        for n in [1, 2, 3, 4, 5, 6, 8, 12, 15, 16, 20, 45, 64, 90, 120] {
            let data = noise(n);
            let mut fast = data.clone();
            Line::new(n, false).run(&mut fast, &mut vec![[0.0; 2]; n]);
            for (k, value) in fast.iter().enumerate() {
                let mut sum = [0.0_f64; 2];
                for (i, [a, b]) in data.iter().enumerate() {
                    let (sin, cos) = (-TAU * (i * k) as f64 / n as f64).sin_cos();
                    let (a, b) = (f64::from(*a), f64::from(*b));
                    sum = [sum[0] + a * cos - b * sin, sum[1] + a * sin + b * cos];
                }
                let error = (f64::from(value[0]) - sum[0]).abs() + (f64::from(value[1]) - sum[1]).abs();
                assert!(error < 1e-5 * n as f64, "{n}: {k}");
            }
            Line::new(n, true).run(&mut fast, &mut vec![[0.0; 2]; n]);
            let scale = 1.0 / n as f32;
            assert!(fast.iter().zip(&data).all(|(a, b)| (a[0] * scale - b[0]).abs() < 1e-5), "{n}: back");
        }
    }

    #[test]
    fn lengths_and_transposes() {
        assert_eq!([1, 7, 11, 17, 121, 1030].map(good_length), [1, 8, 12, 18, 125, 1080]);
        let data = noise(37 * 21);
        let mut out = vec![[0.0; 2]; data.len()];
        transpose(&data, &mut out, 37, 3);
        assert!((0..data.len()).all(|i| out[(i % 37) * 21 + i / 37] == data[i]));
    }
}

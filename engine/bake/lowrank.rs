//! The leading right singular vectors of large matrices, where all eigenvalues would cost too much.
//!
//! Products are summed in f64 in a fixed order, and the subspace iteration begins with fixed numbers, so the same rows give the same bits on
//! every machine and with any number of threads.

use std::thread;

use nalgebra::DMatrix;

use super::{
    eigen::leading,
    pca::{Keep, dot},
};
use crate::{Error, ErrorKind, Result};

/// Vectors of the iteration beyond those that are wanted.
const MORE: usize = 12;
/// Steps of the subspace iteration. The error of a vector falls in each by the ratio of its eigenvalue to the first one that is left out.
const STEPS: usize = 12;
/// Values of a row that stay in the first cache while products are summed.
const STRIP: usize = 512;

/// Orthonormal vectors in descending order of the part of the rows that they describe.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LowRank {
    pub columns: usize,
    /// One vector after the other. In each vector the value of the largest magnitude is positive.
    pub vectors: Vec<f64>,
    /// Sums of squares of the rows' coefficients, one value a vector.
    pub squares: Vec<f64>,
}

impl LowRank {
    /// Number of vectors.
    pub fn len(&self) -> usize {
        self.squares.len()
    }

    /// True if all rows are 0.
    pub fn is_empty(&self) -> bool {
        self.squares.is_empty()
    }

    /// A vector. `index` is below [`Self::len`].
    pub fn vector(&self, index: usize) -> &[f64] {
        &self.vectors[index * self.columns..][..self.columns]
    }

    /// The coefficients of a row.
    pub fn project(&self, row: &[f32]) -> Vec<f64> {
        let row: Vec<f64> = row.iter().map(|value| f64::from(*value)).collect();
        (0..self.len()).map(|index| dot(&row, self.vector(index))).collect()
    }
}

/// At most `count` leading vectors of rows of `columns` values.
///
/// # Errors
/// `Runtime` if a value is not finite, or if the decomposition does not converge.
pub fn low_rank(rows: &[f32], columns: usize, count: usize) -> Result<LowRank> {
    let lines = rows.len() / columns.max(1);
    if rows.iter().any(|value| !value.is_finite()) {
        return Err(Error::new(ErrorKind::Runtime, "a value is not finite").at("low rank"));
    }
    let count = count.min(lines).min(columns);
    if count == 0 {
        return Ok(LowRank { columns, ..LowRank::default() });
    }
    let values: Vec<f64> = rows.iter().map(|value| f64::from(*value)).collect();
    // The smaller of the two matrices of products.
    let of_columns = columns <= lines;
    let (size, gram) = match of_columns {
        true => (columns, products(&transposed(&values, columns), lines)),
        false => (lines, products(&values, columns)),
    };
    let (squares, found) = subspace(&gram, size, count)?;
    let mut out = LowRank { columns, vectors: Vec::new(), squares: Vec::new() };
    for (square, vector) in squares.iter().zip(&found) {
        let mut vector = match of_columns {
            true => vector.clone(),
            false => {
                let mut sum = vec![0.0; columns];
                for (row, share) in values.chunks_exact(columns).zip(vector) {
                    sum.iter_mut().zip(row).for_each(|(sum, value)| *sum += share * value);
                }
                sum
            }
        };
        for index in 0..out.len() {
            let along = dot(&vector, out.vector(index));
            vector.iter_mut().zip(out.vector(index)).for_each(|(value, other)| *value -= along * other);
        }
        let length = dot(&vector, &vector).sqrt();
        if length == 0.0 {
            break;
        }
        let largest = vector.iter().fold(0.0f64, |most, v| if v.abs() > most.abs() { *v } else { most });
        let scale = largest.signum() / length;
        out.vectors.extend(vector.iter().map(|value| value * scale));
        out.squares.push(*square);
    }
    Ok(out)
}

/// The matrix with rows and columns exchanged.
fn transposed(values: &[f64], columns: usize) -> Vec<f64> {
    let lines = values.len() / columns.max(1);
    let mut out = vec![0.0; values.len()];
    for (line, row) in values.chunks_exact(columns).enumerate() {
        row.iter().enumerate().for_each(|(column, value)| out[column * lines + line] = *value);
    }
    out
}

/// Products of all pairs of rows: a whole symmetric matrix, row after row.
fn products(values: &[f64], columns: usize) -> Vec<f64> {
    let size = values.len() / columns.max(1);
    let mut out = vec![0.0; size * size];
    let threads = thread::available_parallelism().map_or(1, usize::from).clamp(1, 16);
    // Rows of the lower triangle grow, so threads take every so many rows.
    let mut parts: Vec<Vec<(usize, &mut [f64])>> = (0..threads).map(|_| Vec::new()).collect();
    for (row, products) in out.chunks_exact_mut(size.max(1)).enumerate() {
        parts[row / 4 % threads].push((row, products));
    }
    thread::scope(|scope| {
        for part in &mut parts {
            scope.spawn(move || {
                for first in (0..columns).step_by(STRIP) {
                    let last = (first + STRIP).min(columns);
                    let strip = |row: usize| &values[row * columns + first..row * columns + last];
                    for (row, products) in part.iter_mut() {
                        let a = strip(*row);
                        for (other, product) in products.iter_mut().enumerate().take(*row + 1) {
                            *product += dot(a, strip(other));
                        }
                    }
                }
            });
        }
    });
    for row in 0..size {
        for column in 0..row {
            out[column * size + row] = out[row * size + column];
        }
    }
    out
}

/// The leading eigenvalues of a symmetric matrix without negative ones, and their vectors.
fn subspace(gram: &[f64], size: usize, count: usize) -> Result<(Vec<f64>, Vec<Vec<f64>>)> {
    let wide = (count + MORE).min(size);
    let mut state = 0x9e37_79b9_7f4a_7c15u64;
    let mut random = move || {
        // SplitMix64.
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    let mut basis: Vec<f64> = (0..wide * size).map(|_| random()).collect();
    orthonormal(&mut basis, size);
    let whole = wide == size;
    for _ in 0..if whole { 0 } else { STEPS } {
        basis = times(gram, &basis, size);
        orthonormal(&mut basis, size);
    }
    let image = times(gram, &basis, size);
    let mut small = DMatrix::zeros(wide, wide);
    for a in 0..wide {
        for b in 0..=a {
            let value = dot(&basis[a * size..][..size], &image[b * size..][..size]);
            small[(a, b)] = value;
            small[(b, a)] = value;
        }
    }
    let total = small.trace().max(0.0);
    let (squares, shares, _) = leading(small, Keep::Count(count), total)?;
    let vectors = shares.iter().map(|shares| {
        let mut vector = vec![0.0; size];
        for (share, along) in shares.iter().zip(basis.chunks_exact(size)) {
            vector.iter_mut().zip(along).for_each(|(sum, value)| *sum += share * value);
        }
        vector
    });
    let vectors = vectors.collect();
    Ok((squares, vectors))
}

/// The products of a symmetric matrix with vectors.
fn times(gram: &[f64], vectors: &[f64], size: usize) -> Vec<f64> {
    let mut out = vec![0.0; vectors.len()];
    let count = vectors.len() / size.max(1);
    let each = count.div_ceil(thread::available_parallelism().map_or(1, usize::from).clamp(1, 16)).max(1);
    thread::scope(|scope| {
        for (outs, ins) in out.chunks_mut(each * size).zip(vectors.chunks(each * size)) {
            scope.spawn(move || {
                for (row, products) in gram.chunks_exact(size).enumerate() {
                    for (out, vector) in outs.chunks_exact_mut(size).zip(ins.chunks_exact(size)) {
                        out[row] = dot(products, vector);
                    }
                }
            });
        }
    });
    out
}

/// Gram and Schmidt's orthonormalisation, twice, which is exact to rounding. Vectors that depend on the ones before become 0.
fn orthonormal(vectors: &mut [f64], size: usize) {
    let count = vectors.len() / size.max(1);
    for index in 0..count {
        let (before, rest) = vectors.split_at_mut(index * size);
        let vector = &mut rest[..size];
        let first = dot(vector, vector).sqrt();
        for _ in 0..2 {
            for other in before.chunks_exact(size) {
                let along = dot(vector, other);
                vector.iter_mut().zip(other).for_each(|(value, other)| *value -= along * other);
            }
        }
        let length = dot(vector, vector).sqrt();
        let scale = if length > 1e-13 * first && length > 0.0 { 1.0 / length } else { 0.0 };
        vector.iter_mut().for_each(|value| *value *= scale);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows that are sums of `rank` products of smooth functions, with falling sizes.
    fn rows(lines: usize, columns: usize, rank: usize) -> Vec<f32> {
        let value = |line: usize, column: usize| {
            let of = |j: usize| {
                let (x, y) = (line as f64 * (0.31 + 0.17 * j as f64), column as f64 * (0.23 + 0.11 * j as f64));
                0.5f64.powi(j as i32) * (x.sin() + 0.3) * (y.cos() + 0.1)
            };
            (0..rank).map(of).sum::<f64>() as f32
        };
        (0..lines * columns).map(|at| value(at / columns, at % columns)).collect()
    }

    #[test]
    fn rows_of_low_rank_are_described_whole_from_both_sides() {
        for (lines, columns) in [(90, 40), (40, 90), (64, 64)] {
            let rows = rows(lines, columns, 6);
            let found = low_rank(&rows, columns, 6).unwrap();
            assert_eq!(found.len(), 6);
            for (a, b) in (0..6).flat_map(|a| (0..6).map(move |b| (a, b))) {
                let wanted = if a == b { 1.0 } else { 0.0 };
                assert!((dot(found.vector(a), found.vector(b)) - wanted).abs() < 1e-9);
            }
            assert!(found.squares.windows(2).all(|pair| pair[0] >= pair[1]));
            for row in rows.chunks_exact(columns) {
                let mut left: Vec<f64> = row.iter().map(|v| f64::from(*v)).collect();
                for (index, along) in found.project(row).iter().enumerate() {
                    left.iter_mut().zip(found.vector(index)).for_each(|(left, v)| *left -= along * v);
                }
                assert!(dot(&left, &left).sqrt() < 1e-5);
            }
        }
    }

    #[test]
    fn vectors_are_those_of_the_whole_decomposition() {
        use super::super::pca::{Centre, basis};
        let rows = rows(120, 70, 30);
        let whole = basis(&rows, 70, &[1.0; 120], Centre::Origin, Keep::Count(8)).unwrap();
        let found = low_rank(&rows, 70, 8).unwrap();
        for index in 0..8 {
            let same = dot(whole.vector(index), found.vector(index));
            assert!((same - 1.0).abs() < 1e-6, "vector {index}: {same}");
            assert!((whole.squares[index] * 120.0 / found.squares[index] - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn nothing_and_nan_are_answered() {
        assert!(low_rank(&[0.0; 12], 4, 2).unwrap().is_empty());
        assert!(low_rank(&[], 4, 2).unwrap().is_empty());
        assert_eq!(low_rank(&[1.0, f32::NAN], 2, 1).unwrap_err().exit_code(), 1);
    }
}

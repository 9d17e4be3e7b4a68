//! The leading right singular vectors of large matrices, where all eigenvalues would cost too much.
//!
//! Products are summed in f64 in an order that does not depend on the number of threads, and the subspace iteration begins with fixed numbers, so the
//! same rows give the same bits on the same kind of processor.

use std::thread;

use nalgebra::{DMatrix, DMatrixView, DMatrixViewMut, Dyn};

use super::{
    eigen::leading,
    pca::{Keep, dot},
};
use crate::{Error, ErrorKind, Result};

/// Vectors of the iteration beyond those that are wanted.
const MORE: usize = 12;
/// Steps of the subspace iteration. The error of a vector falls in each by the ratio of its eigenvalue to the first one that is left out.
const STEPS: usize = 12;
/// Columns of a product that a thread computes at once.
const COLUMNS: usize = 64;
/// Sizes up to which nalgebra 0.34 multiplies vector by vector, which reads views with steps beyond their slices.
const SMALL: usize = 5;

/// A matrix whose values lie in steps of any size.
type View<'a> = DMatrixView<'a, f64, Dyn, Dyn>;

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

    /// The coefficients of rows of [`Self::columns`] values: those of a row one after the other.
    pub fn project(&self, rows: &[f32]) -> Vec<f64> {
        let values: Vec<f64> = rows.iter().map(|value| f64::from(*value)).collect();
        product(turned(&self.vectors, self.columns), whole(&values, self.columns)).data.into()
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
    // A column for each row.
    let (matrix, turned) = (whole(&values, columns), turned(&values, columns));
    // The smaller of the two matrices of products.
    let (squares, found) = match columns <= lines {
        true => subspace(&squared(matrix, turned), count)?,
        false => {
            let (squares, shares) = subspace(&squared(turned, matrix), count)?;
            (squares, product(matrix, of(&shares)))
        }
    };
    let mut out = LowRank { columns, vectors: Vec::new(), squares: Vec::new() };
    for (square, vector) in squares.iter().zip(found.column_iter()) {
        let mut vector: Vec<f64> = vector.iter().copied().collect();
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

/// The matrix with these columns of `size` values.
fn whole(values: &[f64], size: usize) -> View<'_> {
    DMatrixView::from_slice_with_strides(values, size, values.len() / size.max(1), 1, size)
}

/// The matrix with these rows of `size` values.
fn turned(values: &[f64], size: usize) -> View<'_> {
    DMatrixView::from_slice_with_strides(values, values.len() / size.max(1), size, size, 1)
}

fn of(matrix: &DMatrix<f64>) -> View<'_> {
    whole(matrix.as_slice(), matrix.nrows())
}

/// The product of a matrix with its transpose.
fn squared(a: View<'_>, turned: View<'_>) -> DMatrix<f64> {
    let mut out = products(a, turned, true);
    out.fill_upper_triangle_with_lower_triangle();
    out
}

/// The product of two matrices.
fn product(a: View<'_>, b: View<'_>) -> DMatrix<f64> {
    products(a, b, false)
}

/// `lower`: only the lower triangle and some values above it are needed.
fn products(a: View<'_>, b: View<'_>, lower: bool) -> DMatrix<f64> {
    let (lines, inner, columns) = (a.nrows(), b.nrows(), b.ncols());
    let mut out = DMatrix::zeros(lines, columns);
    if lines == 0 || columns == 0 {
        return out;
    }
    let threads = thread::available_parallelism().map_or(1, usize::from).clamp(1, 16);
    let mut parts: Vec<Vec<(usize, &mut [f64])>> = (0..threads).map(|_| Vec::new()).collect();
    for (block, values) in out.as_mut_slice().chunks_mut(COLUMNS * lines).enumerate() {
        parts[block % threads].push((block * COLUMNS, values));
    }
    thread::scope(|scope| {
        for part in parts {
            scope.spawn(move || {
                for (first, values) in part {
                    let count = values.len() / lines;
                    let above = if lower { first } else { 0 };
                    let mut out = DMatrixViewMut::from_slice(values, lines, count);
                    let (a, b) = (a.rows(above, lines - above), b.view((0, first), (inner, count)));
                    let mut out = out.rows_mut(above, lines - above);
                    if (lines - above).min(inner).min(count) > SMALL {
                        out.gemm(1.0, &a, &b, 0.0);
                        continue;
                    }
                    for (line, column) in (0..count).flat_map(|column| (0..a.nrows()).map(move |line| (line, column))) {
                        out[(line, column)] = (0..inner).map(|i| a[(line, i)] * b[(i, column)]).sum();
                    }
                }
            });
        }
    });
    out
}

/// The leading eigenvalues of a symmetric matrix without negative ones, and their vectors as columns.
fn subspace(gram: &DMatrix<f64>, count: usize) -> Result<(Vec<f64>, DMatrix<f64>)> {
    let size = gram.nrows();
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
    let mut basis = DMatrix::from_fn(size, wide, |_, _| random());
    orthonormal(basis.as_mut_slice(), size);
    let whole = wide == size;
    for _ in 0..if whole { 0 } else { STEPS } {
        basis = product(of(gram), of(&basis));
        orthonormal(basis.as_mut_slice(), size);
    }
    let image = product(of(gram), of(&basis));
    let small = product(turned(basis.as_slice(), size), of(&image));
    // The same on both sides of the diagonal.
    let small = 0.5 * (&small + small.transpose());
    let total = small.trace().max(0.0);
    let (squares, shares, _) = leading(small, Keep::Count(count), total)?;
    let shares = DMatrix::from_fn(wide, shares.len(), |line, column| shares[column][line]);
    Ok((squares, product(of(&basis), of(&shares))))
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

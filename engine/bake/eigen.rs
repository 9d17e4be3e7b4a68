//! Eigenvalues of symmetric matrices, with the same bits on every machine.

use nalgebra::{DMatrix, Dyn, SymmetricEigen};

use super::pca::Keep;
use crate::{Error, ErrorKind, Result};

/// The largest eigenvalues of a symmetric matrix in descending order, their eigenvectors, and the smallest eigenvalue or 0.
pub(super) fn leading(matrix: DMatrix<f64>, keep: Keep, total: f64) -> Result<(Vec<f64>, Vec<Vec<f64>>, f64)> {
    let count = matrix.nrows();
    let wanted = match keep {
        Keep::Count(count) => count,
        Keep::Share(_) => count,
    };
    if count == 0 || wanted == 0 || total == 0.0 {
        return Ok((Vec::new(), Vec::new(), 0.0));
    }
    // Dimensions without values have no part in any vector. With their zeros the decomposition of nalgebra 0.34 often gives NaN.
    let there: Vec<usize> = (0..count).filter(|&at| matrix[(at, at)] != 0.0).collect();
    let matrix = if there.len() < count { matrix.select_rows(&there).select_columns(&there) } else { matrix };
    let steps = 1000 + 100 * count;
    let finite = |found: &SymmetricEigen<f64, Dyn>| {
        found.eigenvalues.iter().chain(found.eigenvectors.iter()).all(|value| value.is_finite())
    };
    // The quick way divides by zero for some matrices with many tiny numbers.
    let found = match SymmetricEigen::try_new(matrix.clone(), f64::EPSILON, steps).filter(finite) {
        Some(found) => found,
        None => rotated(matrix).ok_or_else(|| {
            Error::new(ErrorKind::Runtime, "the decomposition does not converge").at("principal components")
        })?,
    };
    let mut order: Vec<usize> = (0..there.len()).collect();
    // A stable sort: equal values keep their order.
    order.sort_by(|&a, &b| found.eigenvalues[b].total_cmp(&found.eigenvalues[a]));
    let noise = found.eigenvalues[order[0]] * f64::EPSILON * count as f64;
    let (mut squares, mut vectors, mut described) = (Vec::new(), Vec::new(), 0.0);
    for &at in order.iter().take(wanted) {
        let value = found.eigenvalues[at];
        if value <= noise || matches!(keep, Keep::Share(share) if described >= share * total) {
            break;
        }
        described += value;
        squares.push(value);
        let mut vector = vec![0.0; count];
        there.iter().zip(found.eigenvectors.column(at).iter()).for_each(|(&at, &value)| vector[at] = value);
        vectors.push(vector);
    }
    let least = found.eigenvalues.iter().copied().fold(0.0, f64::min);
    Ok((squares, vectors, least))
}

/// Eigenvalues by cyclic Jacobi rotations (Golub and Van Loan, Matrix Computations, 8.5): slow, and right for every finite symmetric matrix.
/// `None`: the matrix is not finite.
fn rotated(mut matrix: DMatrix<f64>) -> Option<SymmetricEigen<f64, Dyn>> {
    let count = matrix.nrows();
    let mut vectors = DMatrix::<f64>::identity(count, count);
    if matrix.iter().any(|value| !value.is_finite()) {
        return None;
    }
    let size = matrix.iter().fold(0.0f64, |most, value| most.max(value.abs()));
    // Each sweep squares what is left; a dozen is more than any matrix needs.
    for _ in 0..64 {
        let mut rest = 0.0f64;
        for p in 0..count {
            for q in p + 1..count {
                let off = matrix[(p, q)];
                rest = rest.max(off.abs());
                if off.abs() <= f64::EPSILON * f64::EPSILON * size {
                    continue;
                }
                let theta = (matrix[(q, q)] - matrix[(p, p)]) / (2.0 * off);
                let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
                let cosine = 1.0 / t.hypot(1.0);
                let sine = t * cosine;
                for k in 0..count {
                    let (a, b) = (matrix[(k, p)], matrix[(k, q)]);
                    (matrix[(k, p)], matrix[(k, q)]) = (cosine * a - sine * b, sine * a + cosine * b);
                }
                for k in 0..count {
                    let (a, b) = (matrix[(p, k)], matrix[(q, k)]);
                    (matrix[(p, k)], matrix[(q, k)]) = (cosine * a - sine * b, sine * a + cosine * b);
                }
                for k in 0..count {
                    let (a, b) = (vectors[(k, p)], vectors[(k, q)]);
                    (vectors[(k, p)], vectors[(k, q)]) = (cosine * a - sine * b, sine * a + cosine * b);
                }
            }
        }
        if rest <= f64::EPSILON * size {
            break;
        }
    }
    Some(SymmetricEigen { eigenvalues: matrix.diagonal(), eigenvectors: vectors })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotations_find_the_same_eigenvalues() {
        let count = 12;
        let root = DMatrix::from_fn(count, count, |a, b| ((a * 7 + b * 13 + a * b) as f64).sin());
        let matrix = &root * root.transpose();
        let mut quick: Vec<f64> = SymmetricEigen::new(matrix.clone()).eigenvalues.iter().copied().collect();
        let slow = rotated(matrix.clone()).unwrap();
        for at in 0..count {
            let vector = slow.eigenvectors.column(at);
            let off = (&matrix * vector - vector * slow.eigenvalues[at]).norm();
            assert!(off < 1e-11 && (vector.norm() - 1.0).abs() < 1e-12, "{off}");
        }
        let mut found: Vec<f64> = slow.eigenvalues.iter().copied().collect();
        quick.sort_by(f64::total_cmp);
        found.sort_by(f64::total_cmp);
        assert!(quick.iter().zip(&found).all(|(a, b)| (a - b).abs() < 1e-10), "{quick:?} {found:?}");
        // Numbers that are tiny beside the largest: the quick way may divide by zero.
        let tiny = DMatrix::from_fn(40, 40, |a, b| if a == b && a < 3 { 1.0 } else { 1e-160 * ((a + b) % 5) as f64 });
        let (squares, vectors, _) = leading(tiny, Keep::Count(40), 3.0).unwrap();
        assert!(squares.len() == 3 && vectors.iter().flatten().all(|value| value.is_finite()), "{squares:?}");
        assert!(rotated(DMatrix::from_element(2, 2, f64::NAN)).is_none());
    }
}

//! Principal component analysis: the directions in which examples vary most.
//!
//! Everything is computed in `f64`, by one thread and in a fixed order, so that the same examples give the same bits whenever they are
//! analysed on one kind of processor. Processors with other vector units (AVX2, AVX-512, NEON) may differ in the last bits, for `faer`
//! uses what is there. A job for machines that differ makes the analysis one unit of its own, whose bytes all others read.
//!
//! Examples are rows. With weights `w`, mean `m` and `W = Σ w`, the basis is that of the covariance `Σ w (x − m)(x − m)ᵀ / W`, from the
//! singular values of the examples themselves: squaring them first would lose half of the digits.

use faer::{
    Mat, Par,
    diag::Diag,
    dyn_stack::{MemBuffer, MemStack},
    linalg::svd::{ComputeSvdVectors, svd, svd_scratch},
};
use serde::{Deserialize, Serialize};

use crate::{Error, ErrorKind, Result};

/// Numbers of all examples at most: 2 GiB.
const MOST_NUMBERS: usize = 1 << 28;

/// How examples are analysed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Directions that are kept at most; 0: the mean alone.
    pub rank: usize,
    /// Subtract the mean first. Otherwise the mean is 0, and the first direction leads roughly to it.
    pub centred: bool,
}

/// The mean of examples, and the directions in which they vary most.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pca {
    /// 0 if the examples were not centred.
    pub mean: Vec<f64>,
    /// Orthonormal directions, the most important first; of each the largest number is positive. No more than the examples span.
    pub basis: Vec<Vec<f64>>,
    /// Of each direction the mean square of the examples along it (divided by the sum of weights, not by one less).
    pub eigenvalues: Vec<f64>,
    /// The sum of the other eigenvalues: the mean square error of [`Self::restore`] over the examples.
    pub dropped: f64,
}

/// Analyses examples that follow each other in `examples`, `dimensions` numbers each; `weights` has one for each example, or is `None`: all
/// count the same.
///
/// # Errors
/// `Input`, naming the example, if a number is no number or endless, or a weight negative; if there are no examples, all weights are 0, or
/// the numbers do not divide into examples; `Runtime` if there are too many numbers, or they are too large to be squared.
pub fn pca(examples: &[f64], dimensions: usize, weights: Option<&[f64]>, settings: Settings) -> Result<Pca> {
    let (count, weights) = checked(examples, dimensions, weights).map_err(|error| error.at("pca"))?;
    let rows = || examples.chunks_exact(dimensions).zip(&weights);
    let mut mean = vec![0.0; dimensions];
    if settings.centred {
        for (row, weight) in rows() {
            mean.iter_mut().zip(row).for_each(|(mean, x)| *mean += weight * x);
        }
    }
    let mut matrix = Mat::<f64>::zeros(count, dimensions);
    for (i, (row, weight)) in rows().enumerate() {
        let factor = weight.sqrt();
        row.iter().zip(&mean).enumerate().for_each(|(j, (x, mean))| matrix[(i, j)] = factor * (x - mean));
    }
    let (values, vectors) = singular(&matrix)?;
    let squares: Vec<f64> = values.iter().map(|value| value * value).collect();
    let all: f64 = squares.iter().rev().sum();
    if !all.is_finite() || mean.iter().any(|mean| !mean.is_finite()) {
        return Err(Error::new(ErrorKind::Runtime, "the examples are too large to be squared").at("pca"));
    }
    // Below this a direction is made of rounding alone, that of the mean's subtraction too.
    let size = rows().map(|(row, weight)| weight * row.iter().map(|x| x * x).sum::<f64>()).sum::<f64>().sqrt();
    let least = size * count.max(dimensions) as f64 * f64::EPSILON;
    let rank = values.iter().take(settings.rank).take_while(|value| **value > least).count();
    let basis = (0..rank).map(|of| upright((0..dimensions).map(|j| vectors[(j, of)]).collect())).collect();
    let dropped = squares[rank..].iter().rev().sum();
    Ok(Pca { mean, basis, eigenvalues: squares[..rank].to_vec(), dropped })
}

/// The number of examples, and weights whose sum is 1.
fn checked(examples: &[f64], dimensions: usize, weights: Option<&[f64]>) -> Result<(usize, Vec<f64>)> {
    let wrong = |what: String| Error::input(what);
    if dimensions == 0 || examples.is_empty() {
        return Err(wrong(format!("there are no examples: {} numbers, {dimensions} for each", examples.len())));
    }
    if examples.len() > MOST_NUMBERS {
        let what = format!("{} numbers, at most {MOST_NUMBERS} are allowed", examples.len());
        return Err(Error::new(ErrorKind::Runtime, what).help("Analyse fewer examples, or clusters of them"));
    }
    let count = examples.len() / dimensions;
    if count * dimensions != examples.len() {
        return Err(wrong(format!("{} numbers are no whole examples of {dimensions}", examples.len())));
    }
    if let Some(at) = examples.iter().position(|x| !x.is_finite()) {
        let (i, j) = (at / dimensions, at % dimensions);
        return Err(wrong(format!("is {}, a finite number is needed", examples[at])).at(format!("examples[{i}][{j}]")));
    }
    let ones = vec![1.0; count];
    let weights = weights.unwrap_or(&ones);
    if weights.len() != count {
        return Err(wrong(format!("{} weights for {count} examples", weights.len())));
    }
    if let Some(at) = weights.iter().position(|w| !(w.is_finite() && *w >= 0.0)) {
        return Err(wrong(format!("is {}, 0 or more is needed", weights[at])).at(format!("weights[{at}]")));
    }
    // Divided first, so that the sum of large ones is finite.
    let largest = weights.iter().copied().fold(0.0, f64::max);
    if largest == 0.0 {
        return Err(wrong("all weights are 0".into()));
    }
    let sum: f64 = weights.iter().map(|w| w / largest).sum();
    Ok((count, weights.iter().map(|w| w / largest / sum).collect()))
}

/// Singular values, the largest first, and the right singular vectors as columns.
fn singular(matrix: &Mat<f64>) -> Result<(Vec<f64>, Mat<f64>)> {
    let (rows, columns) = matrix.shape();
    let size = rows.min(columns);
    let mut values = Diag::<f64>::zeros(size);
    let mut vectors = Mat::<f64>::zeros(columns, size);
    let (none, thin) = (ComputeSvdVectors::No, ComputeSvdVectors::Thin);
    let scratch = svd_scratch::<f64>(rows, columns, none, thin, Par::Seq, Default::default());
    let mut memory = MemBuffer::try_new(scratch)
        .map_err(|_| Error::new(ErrorKind::OutOfMemory, "there is no memory for the singular values").at("pca"))?;
    let stack = MemStack::new(&mut memory);
    let target = Some(vectors.as_mut());
    svd(matrix.as_ref(), values.as_mut(), None, target, Par::Seq, stack, Default::default()).map_err(|error| {
        Error::new(ErrorKind::Runtime, format!("no singular values were found ({error:?})")).at("pca")
    })?;
    Ok((values.column_vector().iter().copied().collect(), vectors))
}

/// The direction or its opposite: the one whose largest number is positive; the first of several that are as large.
fn upright(direction: Vec<f64>) -> Vec<f64> {
    let largest = direction.iter().copied().fold(0.0f64, |best, x| if x.abs() > best.abs() { x } else { best });
    if largest < 0.0 { direction.iter().map(|x| -x).collect() } else { direction }
}

impl Pca {
    /// Numbers of an example.
    pub fn dimensions(&self) -> usize {
        self.mean.len()
    }

    /// How far an example lies along each direction. Numbers that it lacks count as 0.
    pub fn project(&self, example: &[f64]) -> Vec<f64> {
        let along = |direction: &Vec<f64>| {
            direction.iter().zip(example).zip(&self.mean).map(|((d, x), mean)| d * (x - mean)).sum()
        };
        self.basis.iter().map(along).collect()
    }

    /// The example that lies so far along each direction.
    pub fn restore(&self, coefficients: &[f64]) -> Vec<f64> {
        let mut out = self.mean.clone();
        for (direction, coefficient) in self.basis.iter().zip(coefficients) {
            out.iter_mut().zip(direction).for_each(|(x, d)| *x += coefficient * d);
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers from −1 to 1 that a seed decides.
    fn numbers(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
        move || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }
    }

    fn dot(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| a * b).sum()
    }

    /// Orthonormal directions by Gram and Schmidt, twice.
    fn directions(count: usize, dimensions: usize, next: &mut impl FnMut() -> f64) -> Vec<Vec<f64>> {
        let mut out: Vec<Vec<f64>> = Vec::new();
        while out.len() < count {
            let mut new: Vec<f64> = (0..dimensions).map(|_| next()).collect();
            for _ in 0..2 {
                for old in &out {
                    let along = dot(&new, old);
                    new.iter_mut().zip(old).for_each(|(x, o)| *x -= along * o);
                }
                let length = dot(&new, &new).sqrt();
                new.iter_mut().for_each(|x| *x /= length);
            }
            out.push(new);
        }
        out
    }

    fn mean_square_error(pca: &Pca, examples: &[f64], weights: &[f64]) -> f64 {
        let error = |row: &[f64]| {
            let again = pca.restore(&pca.project(row));
            row.iter().zip(&again).map(|(a, b)| (a - b) * (a - b)).sum::<f64>()
        };
        let rows = examples.chunks_exact(pca.dimensions());
        rows.zip(weights).map(|(row, w)| w * error(row)).sum::<f64>() / weights.iter().sum::<f64>()
    }

    fn orthonormal(pca: &Pca) {
        for (i, a) in pca.basis.iter().enumerate() {
            for (j, b) in pca.basis.iter().enumerate() {
                let wanted = if i == j { 1.0 } else { 0.0 };
                assert!((dot(a, b) - wanted).abs() < 1e-10, "{i} {j}: {}", dot(a, b));
            }
            let largest = a.iter().copied().fold(0.0f64, |best, x| if x.abs() > best.abs() { x } else { best });
            assert!(largest > 0.0);
        }
    }

    const SHAPES: [(usize, usize); 6] = [(200, 20), (12, 40), (30, 30), (1000, 3), (2, 300), (90, 70)];

    #[test]
    fn a_planted_basis_of_low_rank_is_found() {
        for (seed, (count, dimensions)) in (1..).zip(SHAPES) {
            let mut next = numbers(seed);
            let rank = 3.min(dimensions).min(count - 1);
            let planted = directions(rank, dimensions, &mut next);
            let offset: Vec<f64> = (0..dimensions).map(|_| 5.0 * next()).collect();
            let mut examples = Vec::new();
            for _ in 0..count {
                let coefficients: Vec<f64> = (0..rank).map(|i| next() * 10f64.powi(-2 * i as i32)).collect();
                let along = |j: usize| coefficients.iter().zip(&planted).map(|(c, p)| c * p[j]).sum::<f64>();
                examples.extend((0..dimensions).map(|j| offset[j] + along(j)));
            }
            let found = pca(&examples, dimensions, None, Settings { rank: 10, centred: true }).unwrap();
            orthonormal(&found);
            assert_eq!(found.basis.len(), rank, "no direction is made of rounding");
            for direction in &planted {
                let inside: f64 = found.basis.iter().map(|b| dot(b, direction).powi(2)).sum();
                assert!((inside - 1.0).abs() < 1e-10, "{inside}");
            }
            assert!(found.dropped < 1e-24 && mean_square_error(&found, &examples, &vec![1.0; count]) < 1e-24);
        }
    }

    #[test]
    fn what_is_lost_is_the_sum_of_the_eigenvalues_that_are_dropped() {
        for (seed, (count, dimensions)) in (10..).zip(SHAPES) {
            let mut next = numbers(seed);
            let examples: Vec<f64> = (0..count * dimensions).map(|i| (1 + i % 7) as f64 * next() + 0.5).collect();
            let weights: Vec<f64> = (0..count).map(|i| if i % 5 == 4 { 0.0 } else { next().abs() }).collect();
            for (weights, given) in [(vec![1.0; count], false), (weights, true)] {
                for centred in [false, true] {
                    let all =
                        pca(&examples, dimensions, given.then_some(&weights), Settings { rank: 999, centred }).unwrap();
                    let total: f64 = all.eigenvalues.iter().sum();
                    assert!(all.eigenvalues.windows(2).all(|pair| pair[0] >= pair[1]));
                    for rank in [0, 1, 2, 5] {
                        let found =
                            pca(&examples, dimensions, given.then_some(&weights), Settings { rank, centred }).unwrap();
                        orthonormal(&found);
                        let error = mean_square_error(&found, &examples, &weights);
                        assert!((error - found.dropped).abs() < 1e-12 * total, "{error} {}", found.dropped);
                        let kept: f64 = found.eigenvalues.iter().sum();
                        assert!((kept + found.dropped - total).abs() < 1e-12 * total);
                        // Each eigenvalue is the mean square along its direction.
                        for (i, value) in found.eigenvalues.iter().enumerate() {
                            let rows = examples.chunks_exact(dimensions).zip(&weights);
                            let along: f64 = rows.map(|(row, w)| w * found.project(row)[i].powi(2)).sum();
                            assert!((along / weights.iter().sum::<f64>() - value).abs() < 1e-12 * total);
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn a_weight_of_three_is_an_example_three_times() {
        let mut next = numbers(3);
        let examples: Vec<f64> = (0..40 * 6).map(|_| next()).collect();
        let weights: Vec<f64> = (0..40).map(|i| f64::from(i % 4)).collect();
        let again: Vec<f64> =
            examples.chunks_exact(6).zip(&weights).flat_map(|(row, w)| row.repeat(*w as usize)).collect();
        let settings = Settings { rank: 4, centred: true };
        let a = pca(&examples, 6, Some(&weights), settings).unwrap();
        let b = pca(&again, 6, None, settings).unwrap();
        let near = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
        assert!(near(&a.mean, &b.mean) && near(&a.eigenvalues, &b.eigenvalues));
        assert!(a.basis.iter().zip(&b.basis).all(|(a, b)| near(a, b)));
        // The size of weights does not matter, be it ever so large.
        let large: Vec<f64> = weights.iter().map(|w| w * 1e307).collect();
        let c = pca(&examples, 6, Some(&large), settings).unwrap();
        assert!(near(&a.mean, &c.mean) && near(&a.eigenvalues, &c.eigenvalues));
    }

    #[test]
    fn the_same_examples_give_the_same_bits() {
        let mut next = numbers(5);
        let examples: Vec<f64> = (0..300 * 130).map(|_| next()).collect();
        let found = || pca(&examples, 130, None, Settings { rank: 40, centred: true }).unwrap();
        let bits =
            |pca: &Pca| pca.basis.iter().flatten().chain(&pca.eigenvalues).map(|x| x.to_bits()).collect::<Vec<_>>();
        let first = bits(&found());
        std::thread::scope(|scope| {
            let others: Vec<_> = (0..3).map(|_| scope.spawn(|| bits(&found()))).collect();
            others.into_iter().for_each(|other| assert!(other.join().unwrap() == first));
        });
    }

    #[test]
    fn without_centring_the_first_direction_leads_to_the_mean() {
        let mut next = numbers(8);
        let examples: Vec<f64> = (0..50 * 3).map(|i| [30.0, -40.0, 0.0][i % 3] + 0.01 * next()).collect();
        let found = pca(&examples, 3, None, Settings { rank: 1, centred: false }).unwrap();
        let [x, y, z] = found.basis[0][..] else { panic!() };
        // The largest number is positive.
        assert!((x + 0.6).abs() < 1e-3 && (y - 0.8).abs() < 1e-3 && z.abs() < 1e-3, "{x} {y} {z}");
        assert!((found.eigenvalues[0] - 2500.0).abs() < 1.0 && found.mean == [0.0; 3]);
    }

    #[test]
    fn examples_that_do_not_vary_are_their_mean() {
        let settings = Settings { rank: 5, centred: true };
        for (examples, dimensions) in [(vec![1.5, -2.0, 3.0], 3), ([7.0, 8.0].repeat(9), 2), (vec![0.0; 12], 4)] {
            let found = pca(&examples, dimensions, None, settings).unwrap();
            assert!(found.basis.is_empty() && found.eigenvalues.is_empty() && found.dropped.abs() < 1e-28, "{found:?}");
            let again = found.restore(&found.project(&examples[..dimensions]));
            assert!(again.iter().zip(&examples).all(|(a, b)| (a - b).abs() < 1e-14), "{again:?}");
        }
        let none = pca(&[1.0, 2.0, 5.0, 6.0], 2, None, Settings { rank: 0, centred: true }).unwrap();
        assert!(none.mean == [3.0, 4.0] && none.basis.is_empty() && (none.dropped - 8.0).abs() < 1e-14);
        // One of weight 0 does not count.
        let one = pca(&[1.0, 2.0, 5.0, 6.0], 2, Some(&[0.0, 4.0]), settings).unwrap();
        assert_eq!((one.mean, one.basis.len()), (vec![5.0, 6.0], 0));
    }

    #[test]
    fn what_is_no_example_is_refused_and_named() {
        let settings = Settings { rank: 2, centred: true };
        let refused = |examples: &[f64], dimensions: usize, weights: Option<&[f64]>, part: &str| {
            let error = pca(examples, dimensions, weights, settings).unwrap_err().to_string();
            assert!(error.contains(part), "{error}");
        };
        refused(&[], 3, None, "no examples");
        refused(&[1.0], 0, None, "no examples");
        refused(&[1.0; 5], 3, None, "no whole examples of 3");
        refused(&[1.0, 2.0, f64::NAN, 4.0], 2, None, "pca.examples[1][0]: is NaN");
        refused(&[1.0, f64::INFINITY], 2, None, "pca.examples[0][1]: is inf");
        refused(&[1.0; 4], 2, Some(&[1.0]), "1 weights for 2");
        refused(&[1.0; 4], 2, Some(&[1.0, -1.0]), "weights[1]");
        refused(&[1.0; 4], 2, Some(&[f64::NAN, 1.0]), "weights[0]");
        refused(&[1.0; 4], 2, Some(&[0.0, 0.0]), "all weights are 0");
        refused(&[1e200, -1e200], 1, None, "too large to be squared");
    }
}

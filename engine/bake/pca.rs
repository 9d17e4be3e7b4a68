//! Principal components, for data that a few vectors describe well.
//!
//! Sums are in f64 and in a fixed order, and signs are fixed, so that the same rows give the same bits on every machine. The only foreign code
//! is the eigenvalue decomposition of `nalgebra`, which does not choose instructions at run time.
//!
//! The centre matters. A light that is off must give exactly nothing, so light is described around the [`Centre::Origin`]. Around the
//! [`Centre::Mean`] fewer vectors are needed for data that are far from zero, such as depths.

use nalgebra::DMatrix;

use super::eigen::leading;
use crate::{Error, Result};

/// Rows whose products are summed at once: their columns fit into the first cache.
const BLOCK: usize = 64;
/// Values that are summed side by side.
const LANES: usize = 8;

/// The point around which data are described.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Centre {
    /// The weighted mean of all rows.
    Mean,
    /// Zero.
    Origin,
}

/// How many vectors are kept. Vectors that only describe rounding errors are never kept.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Keep {
    /// This number at most.
    Count(usize),
    /// As few as describe this share of the sum of squares around the centre, from 0 to 1.
    Share(f64),
}

/// Orthonormal vectors in descending order of the share that they describe.
#[derive(Clone, Debug, PartialEq)]
pub struct Basis {
    /// The centre, one value a dimension.
    pub mean: Vec<f64>,
    /// The vectors, one after the other. In each vector the value of the largest magnitude is positive.
    pub vectors: Vec<f64>,
    /// Weighted mean square of the rows' coefficients, one value a vector.
    pub squares: Vec<f64>,
    /// Weighted mean square of the rows' distances from the centre.
    pub total: f64,
    /// The smallest eigenvalue if it is negative, else 0. Only [`Moments::without_noise`] makes negative ones; positive ones of the same size are
    /// as likely noise.
    pub least: f64,
}

impl Basis {
    /// Dimensions of a row.
    pub fn dimensions(&self) -> usize {
        self.mean.len()
    }

    /// Number of vectors.
    pub fn len(&self) -> usize {
        self.squares.len()
    }

    /// True without vectors: all rows are equal to the centre.
    pub fn is_empty(&self) -> bool {
        self.squares.is_empty()
    }

    /// A vector. `index` is below [`Basis::len`].
    pub fn vector(&self, index: usize) -> &[f64] {
        &self.vectors[index * self.dimensions()..][..self.dimensions()]
    }

    /// The share of the sum of squares that the vectors do not describe.
    pub fn residual(&self) -> f64 {
        if self.total == 0.0 { 0.0 } else { (1.0 - self.squares.iter().sum::<f64>() / self.total).max(0.0) }
    }

    /// The coefficients of a row, one a vector. Values beyond [`Basis::dimensions`] are ignored, missing values are at the centre.
    pub fn project(&self, row: &[f32]) -> Vec<f64> {
        let around: Vec<f64> = row.iter().zip(&self.mean).map(|(&value, mean)| f64::from(value) - mean).collect();
        (0..self.len()).map(|index| dot(&around, self.vector(index))).collect()
    }

    /// The row that these coefficients describe. With fewer coefficients than vectors, the rest are 0.
    pub fn restore(&self, coefficients: &[f64]) -> Vec<f64> {
        let mut row = self.mean.clone();
        for (index, coefficient) in coefficients.iter().take(self.len()).enumerate() {
            row.iter_mut().zip(self.vector(index)).for_each(|(value, along)| *value += coefficient * along);
        }
        row
    }
}

/// Weighted sums of the products of rows, from which a basis follows. For more rows than memory holds: rows are added in blocks, and sums of
/// parts are added to each other. The bits depend on the order and on the limits of the parts.
#[derive(Clone, Debug, PartialEq)]
pub struct Moments {
    dimensions: usize,
    weight: f64,
    sums: Vec<f64>,
    /// The lower triangle, row after row.
    products: Vec<f64>,
}

impl Moments {
    /// Sums without rows.
    pub fn new(dimensions: usize) -> Self {
        let products = vec![0.0; dimensions * (dimensions + 1) / 2];
        Self { dimensions, weight: 0.0, sums: vec![0.0; dimensions], products }
    }

    /// Adds rows of `f32`, one after the other, each with a weight.
    ///
    /// # Errors
    /// `Usage` if the numbers of values and weights do not fit, if a value is not finite, or if a weight is negative.
    pub fn add(&mut self, rows: &[f32], weights: &[f64]) -> Result<()> {
        check(rows, self.dimensions, weights)?;
        let rows: Vec<f64> = rows.iter().map(|&value| f64::from(value)).collect();
        self.add_checked(&rows, weights);
        Ok(())
    }

    fn add_checked(&mut self, rows: &[f64], weights: &[f64]) {
        let dimensions = self.dimensions;
        if dimensions == 0 {
            return;
        }
        let mut columns = vec![0.0; dimensions * BLOCK];
        for (rows, weights) in rows.chunks(BLOCK * dimensions).zip(weights.chunks(BLOCK)) {
            columns.fill(0.0);
            for (at, (row, weight)) in rows.chunks_exact(dimensions).zip(weights).enumerate() {
                let root = weight.sqrt();
                for (dimension, value) in row.iter().enumerate() {
                    columns[dimension * BLOCK + at] = root * value;
                    self.sums[dimension] += weight * value;
                }
                self.weight += weight;
            }
            let mut products = self.products.iter_mut();
            for a in 0..dimensions {
                let column = &columns[a * BLOCK..][..BLOCK];
                for (b, product) in (0..=a).zip(&mut products) {
                    *product += dot(column, &columns[b * BLOCK..][..BLOCK]);
                }
            }
        }
    }

    /// Adds the sums of other rows.
    ///
    /// # Errors
    /// `Usage` if these have another number of dimensions.
    pub fn merge(&mut self, other: &Self) -> Result<()> {
        if self.dimensions != other.dimensions {
            let what = format!("{} dimensions, {} are expected", other.dimensions, self.dimensions);
            return Err(Error::usage(what).at("principal components"));
        }
        self.weight += other.weight;
        self.sums.iter_mut().zip(&other.sums).for_each(|(sum, other)| *sum += other);
        self.products.iter_mut().zip(&other.products).for_each(|(product, other)| *product += other);
        Ok(())
    }

    /// Removes the products of other rows, one for each row that was added: what is left are the products of the rows' parts that differ from
    /// independent noise, if the other rows are samples of that noise. Some of the squares that follow may be negative; they are never kept.
    ///
    /// # Errors
    /// `Usage` if the numbers of dimensions or the weights differ.
    pub fn without_noise(&mut self, noise: &Self) -> Result<()> {
        if self.dimensions != noise.dimensions || self.weight != noise.weight {
            let what = format!("noise of {} dimensions, {} are expected", noise.dimensions, self.dimensions);
            return Err(Error::usage(what).at("principal components"));
        }
        self.products.iter_mut().zip(&noise.products).for_each(|(product, noise)| *product -= noise);
        Ok(())
    }

    /// The basis of all rows that were added.
    ///
    /// # Errors
    /// `Runtime` if the decomposition does not converge.
    pub fn basis(&self, centre: Centre, keep: Keep) -> Result<Basis> {
        let count = self.dimensions;
        let scale = if self.weight > 0.0 { 1.0 / self.weight } else { 0.0 };
        let mean: Vec<f64> = match centre {
            Centre::Mean => self.sums.iter().map(|sum| sum * scale).collect(),
            Centre::Origin => vec![0.0; count],
        };
        let mut matrix = DMatrix::zeros(count, count);
        let mut products = self.products.iter();
        for a in 0..count {
            for (b, product) in (0..=a).zip(&mut products) {
                let value = product * scale - mean[a] * mean[b];
                matrix[(a, b)] = value;
                matrix[(b, a)] = value;
            }
        }
        let total = matrix.trace().max(0.0);
        let (squares, vectors, least) = leading(matrix, keep, total)?;
        let vectors: Vec<f64> = vectors.concat();
        Ok(signed(Basis { mean, vectors, squares, total, least }))
    }
}

/// The basis of rows that are in memory, one after the other, each of `dimensions` values and with a weight. It takes the smaller of the two
/// matrices of products, so fewer rows than dimensions cost less.
///
/// # Errors
/// As [`Moments::add`] and [`Moments::basis`].
pub fn basis(rows: &[f32], dimensions: usize, weights: &[f64], centre: Centre, keep: Keep) -> Result<Basis> {
    check(rows, dimensions, weights)?;
    let weight: f64 = weights.iter().sum();
    let scale = if weight > 0.0 { 1.0 / weight } else { 0.0 };
    let mut mean = vec![0.0; dimensions];
    if centre == Centre::Mean && dimensions > 0 {
        for (row, weight) in rows.chunks_exact(dimensions).zip(weights) {
            mean.iter_mut().zip(row).for_each(|(mean, &value)| *mean += weight * scale * f64::from(value));
        }
    }
    // Distances from the mean are exact where a difference of large sums is not.
    let around: Vec<f64> = match dimensions {
        0 => Vec::new(),
        _ => rows.iter().enumerate().map(|(at, &value)| f64::from(value) - mean[at % dimensions]).collect(),
    };
    if dimensions <= weights.len() {
        let mut moments = Moments::new(dimensions);
        moments.add_checked(&around, weights);
        return Ok(Basis { mean, ..moments.basis(Centre::Origin, keep)? });
    }
    let mut rows = around;
    for (row, weight) in rows.chunks_exact_mut(dimensions).zip(weights) {
        let root = (weight * scale).sqrt();
        row.iter_mut().for_each(|value| *value *= root);
    }
    let row = |at: usize| &rows[at * dimensions..][..dimensions];
    let count = weights.len();
    let mut matrix = DMatrix::zeros(count, count);
    for a in 0..count {
        for b in 0..=a {
            let value = dot(row(a), row(b));
            matrix[(a, b)] = value;
            matrix[(b, a)] = value;
        }
    }
    let total = matrix.trace().max(0.0);
    let (mut squares, shares, _) = leading(matrix, keep, total)?;
    let mut vectors: Vec<Vec<f64>> = Vec::new();
    for shares in &shares {
        let mut vector = vec![0.0; dimensions];
        for (at, share) in shares.iter().enumerate() {
            vector.iter_mut().zip(row(at)).for_each(|(sum, value)| *sum += share * value);
        }
        // Rounding errors of small eigenvalues leave parts along larger ones.
        for larger in &vectors {
            let along = dot(&vector, larger);
            vector.iter_mut().zip(larger).for_each(|(value, larger)| *value -= along * larger);
        }
        let length = dot(&vector, &vector).sqrt();
        if length == 0.0 {
            break;
        }
        vector.iter_mut().for_each(|value| *value /= length);
        vectors.push(vector);
    }
    squares.truncate(vectors.len());
    Ok(signed(Basis { mean, vectors: vectors.concat(), squares, total, least: 0.0 }))
}

/// Makes the value of the largest magnitude of each vector positive.
fn signed(mut basis: Basis) -> Basis {
    let dimensions = basis.dimensions().max(1);
    for vector in basis.vectors.chunks_exact_mut(dimensions) {
        let largest = vector.iter().fold(0.0f64, |most, &value| if value.abs() > most.abs() { value } else { most });
        if largest < 0.0 {
            vector.iter_mut().for_each(|value| *value = -*value);
        }
    }
    basis
}

fn check(rows: &[f32], dimensions: usize, weights: &[f64]) -> Result<()> {
    let wrong = |what: String| Err(Error::usage(what).at("principal components"));
    if weights.len().checked_mul(dimensions) != Some(rows.len()) {
        return wrong(format!("{} values for {} rows of {dimensions}", rows.len(), weights.len()));
    }
    if let Some(value) = rows.iter().find(|value| !value.is_finite()) {
        return wrong(format!("{value} is not finite"));
    }
    match weights.iter().find(|weight| !(weight.is_finite() && **weight >= 0.0)) {
        Some(weight) => wrong(format!("{weight} is no weight; allowed are finite numbers from 0")),
        None => Ok(()),
    }
}

/// The sum of products, always in the same order.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; LANES];
    let (a, b) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let rest: f64 = a.remainder().iter().zip(b.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in a.zip(b) {
        for lane in 0..LANES {
            lanes[lane] += a[lane] * b[lane];
        }
    }
    let [s0, s1, s2, s3, s4, s5, s6, s7] = lanes;
    ((s0 + s4) + (s2 + s6)) + ((s1 + s5) + (s3 + s7)) + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of a fixed pattern without symmetries.
    fn rows(count: usize, dimensions: usize, value: impl Fn(usize, usize) -> f64) -> Vec<f32> {
        (0..count).flat_map(|row| (0..dimensions).map(move |at| (row, at))).map(|(r, d)| value(r, d) as f32).collect()
    }

    fn apart(a: &[f64], b: &[f64]) -> f64 {
        assert_eq!(a.len(), b.len());
        a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn an_ellipse_has_its_axes() {
        // Points (3 cos, sin) on a circle, turned by the angle whose tangent is 3/4, around (10, −20).
        let turned = |angle: f64| {
            let (x, y) = (3.0 * angle.cos(), angle.sin());
            [10.0 + 0.8 * x - 0.6 * y, -20.0 + 0.6 * x + 0.8 * y]
        };
        let points = rows(360, 2, |row, at| turned((row as f64).to_radians())[at]);
        let found = basis(&points, 2, &[2.0; 360], Centre::Mean, Keep::Count(5)).unwrap();
        assert!(apart(&found.mean, &[10.0, -20.0]) < 1e-6, "{:?}", found.mean);
        // The mean squares of the cosine and the sine are one half.
        assert!(apart(&found.squares, &[4.5, 0.5]) < 1e-5, "{:?}", found.squares);
        assert!(apart(&found.vectors, &[0.8, 0.6, -0.6, 0.8]) < 1e-6, "{:?}", found.vectors);
        assert!((found.total - 5.0).abs() < 1e-5 && found.residual() < 1e-9);
        let one = basis(&points, 2, &[2.0; 360], Centre::Mean, Keep::Count(1)).unwrap();
        assert!((one.residual() - 0.1).abs() < 1e-6, "{}", one.residual());
    }

    #[test]
    fn both_matrices_of_products_give_the_same_basis() {
        let value = |r: usize, d: usize| {
            (1.0 + r as f64 * 0.37).sin() * (d as f64 * 0.11).cos() + 0.3 * (r as f64 * 1.3 + d as f64 * 0.7).sin()
        };
        for centre in [Centre::Mean, Centre::Origin] {
            let (count, dimensions) = (30, 50);
            let few = rows(count, dimensions, value);
            let weights: Vec<f64> = (0..count).map(|row| 0.5 + (row % 4) as f64).collect();
            let found = basis(&few, dimensions, &weights, centre, Keep::Count(3)).unwrap();
            let mut moments = Moments::new(dimensions);
            moments.add(&few, &weights).unwrap();
            let other = moments.basis(centre, Keep::Count(3)).unwrap();
            assert_eq!((found.len(), other.len()), (3, 3));
            assert!(apart(&found.squares, &other.squares) < 1e-12);
            assert!(apart(&found.vectors, &other.vectors) < 1e-9 && apart(&found.mean, &other.mean) < 1e-12);
            // The vectors are orthonormal.
            for a in 0..3 {
                for b in 0..3 {
                    let expected = f64::from(u8::from(a == b));
                    assert!((dot(found.vector(a), found.vector(b)) - expected).abs() < 1e-12);
                }
            }
            // The weighted mean square of the coefficients is that of the vector, and the error is the residual.
            let (mut squares, mut error) = (vec![0.0; 3], 0.0);
            for (row, weight) in few.chunks_exact(dimensions).zip(&weights) {
                let coefficients = found.project(row);
                squares.iter_mut().zip(&coefficients).for_each(|(sum, c)| *sum += weight * c * c);
                let shown = found.restore(&coefficients);
                error += weight * row.iter().zip(&shown).map(|(a, b)| (f64::from(*a) - b).powi(2)).sum::<f64>();
            }
            let total: f64 = weights.iter().sum();
            squares.iter_mut().for_each(|sum| *sum /= total);
            assert!(apart(&squares, &found.squares) < 1e-10);
            assert!((error / total / found.total - found.residual()).abs() < 1e-9);
        }
    }

    #[test]
    fn data_of_low_rank_need_no_more_vectors() {
        let two = rows(200, 40, |r, d| (r as f64).sin() * d as f64 + (r as f64 * 0.3).cos() * (d as f64 * 0.9).sin());
        let kept = |keep| basis(&two, 40, &[1.0; 200], Centre::Origin, keep).unwrap();
        let all = kept(Keep::Share(1.0 - 1e-9));
        assert!(all.len() == 2 && all.residual() < 1e-9, "{} {}", all.len(), all.residual());
        assert_eq!(kept(Keep::Share(0.0)).len(), 0);
        assert_eq!(kept(Keep::Share(0.5)).len(), 1);
        // A light that is off gives nothing around the origin.
        assert!(all.restore(&all.project(&[0.0; 40])).iter().all(|value| *value == 0.0));
    }

    #[test]
    fn parts_give_the_bits_of_the_whole() {
        let many = rows(300, 20, |r, d| ((r * 31 + d * 17) % 101) as f64 * 0.1);
        let weights: Vec<f64> = (0..300).map(|row| 1.0 + (row % 7) as f64).collect();
        let mut whole = Moments::new(20);
        whole.add(&many, &weights).unwrap();
        let mut blocks = Moments::new(20);
        for (rows, weights) in many.chunks(BLOCK * 20).zip(weights.chunks(BLOCK)) {
            blocks.add(rows, weights).unwrap();
        }
        assert_eq!(whole, blocks);
        let [mut first, mut second] = [0, 1].map(|_| Moments::new(20));
        first.add(&many[..100 * 20], &weights[..100]).unwrap();
        second.add(&many[100 * 20..], &weights[100..]).unwrap();
        first.merge(&second).unwrap();
        let [a, b] = [&whole, &first].map(|m| m.basis(Centre::Mean, Keep::Count(4)).unwrap());
        assert!(apart(&a.squares, &b.squares) < 1e-9 && apart(&a.vectors, &b.vectors) < 1e-7);
    }

    #[test]
    fn nothing_and_wrong_numbers_are_no_reason_to_panic() {
        for (rows, dimensions, count) in [(vec![], 0, 0), (vec![], 3, 0), (vec![], 0, 4), (vec![0.0; 12], 3, 4)] {
            for centre in [Centre::Mean, Centre::Origin] {
                let found = basis(&rows, dimensions, &vec![1.0; count], centre, Keep::Share(0.9)).unwrap();
                assert!(found.is_empty() && found.total == 0.0 && found.residual() == 0.0);
            }
        }
        let nothing = basis(&[1.0, 2.0], 1, &[0.0, 0.0], Centre::Mean, Keep::Count(1)).unwrap();
        assert!(nothing.is_empty());
        let wrong = |rows: &[f32], dimensions, weights: &[f64], part: &str| {
            let error = basis(rows, dimensions, weights, Centre::Mean, Keep::Count(1)).unwrap_err();
            assert!(error.exit_code() == 2 && error.to_string().contains(part), "{error}");
        };
        wrong(&[1.0; 5], 2, &[1.0; 2], "5 values for 2 rows of 2");
        wrong(&[1.0, f32::NAN], 2, &[1.0], "NaN is not finite");
        wrong(&[1.0, 2.0], 2, &[-1.0], "-1 is no weight");
        assert!(Moments::new(2).merge(&Moments::new(3)).is_err());
    }

    #[test]
    fn dimensions_without_values_do_not_harm() {
        let hash = |a: usize, b: usize| (a * 7919 + b * 104_729 + a * b * 31) % 1009;
        for used in [1, 2, 5, 20] {
            for seed in 0..20 {
                let value = |row: usize, at: usize| match at % (146 / used) == seed % (146 / used)
                    && hash(row + seed, at) < 300
                {
                    true => hash(at, row) as f64 / 1009.0,
                    false => 0.0,
                };
                let rows = rows(57, 146, value);
                let basis = basis(&rows, 146, &[1.0; 57], Centre::Origin, Keep::Count(146)).unwrap();
                let mut moments = Moments::new(146);
                moments.add(&rows, &[1.0; 57]).unwrap();
                for basis in [basis, moments.basis(Centre::Origin, Keep::Count(146)).unwrap()] {
                    for row in rows.chunks(146) {
                        let back = basis.restore(&basis.project(row));
                        let near = |(a, b): (&f32, &f64)| (f64::from(*a) - b).abs() < 1e-6;
                        assert!(row.iter().zip(&back).all(near), "{used} dimensions, seed {seed}");
                    }
                }
            }
        }
    }
}

//! The distances around the samples of a cluster, by principal components (Leonhardt and Bohn, section 4.2, equations 7 to 9).

use half::f16;

use super::Cap;
use crate::{Result, bake::lowrank::low_rank};

/// The distances of a cluster.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Visibility {
    /// Number of vectors, d₁ of the paper.
    pub vectors: u32,
    /// Mean distance of each direction. Distances are relative to that in which nothing is, so that 16 bits hold those of all rooms.
    pub mean: Vec<f16>,
    /// All vectors of a direction, direction after direction.
    pub basis: Vec<f16>,
    /// All coefficients of a sample, sample after sample.
    pub coefficients: Vec<f16>,
    /// Root mean square of the error of a distance, after decoding, metres.
    pub error: f32,
}

impl Visibility {
    /// `depths`: a row of the cap's directions for each sample, metres; negative values are below the horizon and unknown. `far`: the distance in
    /// which nothing is, metres.
    ///
    /// # Errors
    /// `Runtime` if a distance is not finite.
    pub fn compress(depths: &[f32], cap: &Cap, vectors: u32, far: f32) -> Result<Self> {
        let directions = cap.directions();
        let depths: Vec<f32> = depths.iter().map(|depth| depth / far).collect();
        let (mut sums, mut counts) = (vec![0.0f64; directions], vec![0u32; directions]);
        for row in depths.chunks_exact(directions) {
            for ((sum, count), depth) in sums.iter_mut().zip(&mut counts).zip(row).filter(|(_, depth)| **depth >= 0.0) {
                *sum += f64::from(*depth);
                *count += 1;
            }
        }
        let mean: Vec<f16> =
            sums.iter().zip(&counts).map(|(sum, count)| f16::from_f64(sum / f64::from((*count).max(1)))).collect();
        // An unknown distance is the mean, which needs no vector.
        let around: Vec<f32> = depths
            .iter()
            .zip(mean.iter().cycle())
            .map(|(depth, mean)| if *depth >= 0.0 { depth - mean.to_f32() } else { 0.0 })
            .collect();
        let found = low_rank(&around, directions, vectors as usize)?;
        let count = found.len();
        let mut basis = vec![f16::ZERO; directions * count];
        for (index, vector) in found.vectors.chunks_exact(directions).enumerate() {
            vector.iter().enumerate().for_each(|(at, value)| basis[at * count + index] = f16::from_f64(*value));
        }
        let coefficients = found.project(&around).into_iter().map(f16::from_f64).collect();
        let mut out = Self { vectors: count as u32, mean, basis, coefficients, error: 0.0 };
        out.error = far * out.error_of(&depths);
        Ok(out)
    }

    /// The distance of a sample in a direction, relative to that in which nothing is (equation 9).
    pub fn distance(&self, sample: usize, direction: usize) -> f32 {
        let count = self.vectors as usize;
        let products =
            self.coefficients[sample * count..][..count].iter().zip(&self.basis[direction * count..][..count]);
        self.mean[direction].to_f32() + products.map(|(a, b)| a.to_f32() * b.to_f32()).sum::<f32>()
    }

    fn error_of(&self, depths: &[f32]) -> f32 {
        let directions = self.mean.len().max(1);
        let (mut sum, mut count) = (0.0f64, 0u64);
        // Every eleventh distance: neighbours have similar errors.
        for (at, depth) in depths.iter().enumerate().step_by(11).filter(|(_, depth)| **depth >= 0.0) {
            sum += f64::from(self.distance(at / directions, at % directions) - depth).powi(2);
            count += 1;
        }
        (sum / count.max(1) as f64).sqrt() as f32
    }

    /// Bytes of the parts in files: means and coefficients, vectors.
    pub fn bytes(&self) -> [u64; 2] {
        [2 * (self.mean.len() + self.coefficients.len()) as u64, 2 * self.basis.len() as u64]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn distances_of_low_rank_are_restored_and_unknown_ones_cost_nothing() {
        let cap = Cap::around([Vec3::Y].into_iter(), 100);
        let directions = cap.directions();
        let depth = |sample: usize, direction: usize| {
            let (a, b) = (sample as f32 * 0.1, direction as f32 * 0.07);
            if direction.is_multiple_of(9) { -1.0 } else { 3.0 + a.sin() * b.cos() + 0.2 * a * (0.3 * b).sin() }
        };
        let depths: Vec<f32> = (0..40 * directions).map(|at| depth(at / directions, at % directions)).collect();
        let stored = Visibility::compress(&depths, &cap, 2, 5.0).unwrap();
        assert_eq!(stored.vectors, 2);
        assert!(stored.error < 0.004, "{}", stored.error);
        for (at, depth) in depths.iter().enumerate().filter(|(_, depth)| **depth >= 0.0) {
            let found = 5.0 * stored.distance(at / directions, at % directions);
            assert!((found - depth).abs() < 0.02, "{found} {depth}");
        }
        let one = Visibility::compress(&depths, &cap, 1, 5.0).unwrap();
        assert!(one.error > 10.0 * stored.error);
    }
}

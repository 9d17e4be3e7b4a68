//! All scatterings at once, between the bases of the clusters.
//!
//! Let a be the coefficients of the radiosity of all samples, X the transfer and P the projection. Radiosity is the albedo ρ times irradiance, so
//! a = P ρ (E + X a) with the direct irradiance E, and a = (1 − P ρ X)⁻¹ P ρ E. The matrix has a row for each vector, so the matrix is small, and the
//! sum of all scatterings is exact in the space of the bases (the paper follows photons for each vector instead, for one albedo).

use nalgebra::DMatrix;

use super::{Stored, transfer};
use crate::{Error, Result};

/// The matrices that turn the projected direct light into the coefficients of all light, for red, green and blue.
#[derive(Clone, Debug)]
pub struct Solved {
    /// (1 − P ρ X)⁻¹, column after column.
    pub inverse: [Vec<f32>; 3],
    /// Taken away from the projected light: the coefficients of the means.
    pub shift: Vec<f32>,
    /// Coefficients that are there without any light: those of the means.
    pub fixed: Vec<f32>,
}

/// P ρ X for one colour. `albedos`: of each sample.
fn scattered(stored: &Stored, albedos: &[f32]) -> DMatrix<f64> {
    let plan = &stored.plan;
    let all = plan.all_vectors();
    let mut out = DMatrix::zeros(all, all);
    for cluster in 0..plan.clusters.len() {
        let (basis, transfer) = (&stored.bases[cluster], &stored.transfers[cluster]);
        let range = plan.range(cluster);
        let stride = transfer.stride(all);
        let vectors = plan.vectors(cluster);
        let mut small = vec![0.0f64; vectors * stride];
        for (number, sample) in stored.samples[range.clone()].iter().enumerate() {
            let albedo = f64::from(albedos[range.start + number]);
            let values = &transfer.values[number * stride..][..stride];
            for (row, weight) in small.chunks_exact_mut(stride.max(1)).zip(basis.weights(number, sample.area)) {
                let weight = f64::from(weight) * albedo;
                row.iter_mut().zip(values).for_each(|(sum, value)| *sum += weight * f64::from(value.to_f32()));
            }
        }
        let first = plan.first_vector(cluster);
        for (vector, row) in small.chunks_exact(stride.max(1)).enumerate() {
            if transfer.rank == 0 {
                row.iter().enumerate().for_each(|(at, value)| out[(first + vector, at)] = *value);
                continue;
            }
            for (part, of) in row.iter().zip(transfer.rows.chunks_exact(all.max(1))) {
                of.iter().enumerate().for_each(|(at, value)| out[(first + vector, at)] += part * f64::from(*value));
            }
        }
    }
    out
}

/// Solves for these albedos: three for each sample. `bounces`: all scatterings, or one. `mean`: the mean of a centred basis transfers light.
///
/// # Errors
/// `Input` if the light of all scatterings is not finite: the room is closed and reflects everything.
pub fn solve(stored: &Stored, albedos: &[[f32; 3]], bounces: bool, mean: bool) -> Result<Solved> {
    let plan = &stored.plan;
    let all = plan.all_vectors();
    let mut shift = Vec::with_capacity(all);
    let mut fixed = vec![0.0; all];
    for (cluster, basis) in stored.bases.iter().enumerate() {
        shift.extend(basis.shift(&transfer::areas(plan, &stored.samples, cluster)));
        if basis.centred && mean {
            fixed[shift.len() - 1] = 1.0;
        }
    }
    let mut inverse = [(); 3].map(|()| Vec::new());
    for (channel, out) in inverse.iter_mut().enumerate() {
        let mut matrix = DMatrix::<f64>::identity(all, all);
        if bounces {
            let of: Vec<f32> = albedos.iter().map(|albedo| albedo[channel]).collect();
            let scattered = scattered(stored, &of);
            let largest = growth(&scattered);
            if largest >= 0.999 {
                let what = format!("each scattering keeps {:.1} % of the light, so there is no end", 100.0 * largest);
                return Err(Error::input(what).help("Give the surfaces a smaller albedo, or choose prt.bounces=false"));
            }
            matrix -= scattered;
            matrix = matrix.try_inverse().ok_or_else(|| Error::input("the scatterings of light have no sum"))?;
        }
        // nalgebra stores columns.
        *out = matrix.iter().map(|value| *value as f32).collect();
    }
    Ok(Solved { inverse, shift, fixed })
}

impl Solved {
    /// Indirect irradiance at the samples, W/m², by this direct irradiance: the slow twin of the passes of a frame.
    pub fn indirect(&self, stored: &Stored, albedos: &[[f32; 3]], direct: &[[f32; 3]]) -> Vec<[f32; 3]> {
        let plan = &stored.plan;
        let all = plan.all_vectors();
        let mut out = vec![[0.0f32; 3]; stored.samples.len()];
        for channel in 0..3 {
            let mut before = vec![0.0f64; all];
            for (cluster, basis) in stored.bases.iter().enumerate() {
                let (first, range) = (plan.first_vector(cluster), plan.range(cluster));
                for (number, sample) in range.clone().enumerate() {
                    let radiosity = f64::from(albedos[sample][channel] * direct[sample][channel]);
                    let weights = basis.weights(number, stored.samples[sample].area);
                    before[first..]
                        .iter_mut()
                        .zip(weights)
                        .for_each(|(sum, weight)| *sum += f64::from(weight) * radiosity);
                }
            }
            let fixed = self.fixed.iter().zip(&self.shift).map(|(fixed, shift)| f64::from(fixed - shift));
            before.iter_mut().zip(fixed).for_each(|(sum, fixed)| *sum += fixed);
            let mut after = vec![0.0f64; all];
            for (column, before) in self.inverse[channel].chunks_exact(all.max(1)).zip(&before) {
                after.iter_mut().zip(column).for_each(|(sum, value)| *sum += f64::from(*value) * before);
            }
            for (cluster, transfer) in stored.transfers.iter().enumerate() {
                let stride = transfer.stride(all);
                let mixed: Vec<f64> = match transfer.rank {
                    0 => after.clone(),
                    _ => transfer
                        .rows
                        .chunks_exact(all.max(1))
                        .map(|row| row.iter().zip(&after).map(|(a, b)| f64::from(*a) * b).sum())
                        .collect(),
                };
                for (number, sample) in plan.range(cluster).enumerate() {
                    let values = &transfer.values[number * stride..][..stride];
                    let sum: f64 = values.iter().zip(&mixed).map(|(a, b)| f64::from(a.to_f32()) * b).sum();
                    out[sample][channel] = sum as f32;
                }
            }
        }
        out
    }
}

/// As [`Solved::indirect`], solved for these albedos.
///
/// # Errors
/// As [`solve`].
pub fn indirect(
    stored: &Stored,
    albedos: &[[f32; 3]],
    direct: &[[f32; 3]],
    bounces: bool,
    mean: bool,
) -> Result<Vec<[f32; 3]>> {
    Ok(solve(stored, albedos, bounces, mean)?.indirect(stored, albedos, direct))
}

/// The factor by which repeated scattering grows, about: the largest eigenvalue.
fn growth(matrix: &DMatrix<f64>) -> f64 {
    let count = matrix.nrows();
    let mut vector = nalgebra::DVector::from_element(count, 1.0);
    let mut factor = 0.0;
    for _ in 0..24 {
        let next = matrix * &vector;
        let length = next.norm();
        factor = length / vector.norm().max(1e-300);
        if length <= 1e-300 {
            return 0.0;
        }
        vector = next / length;
    }
    factor
}

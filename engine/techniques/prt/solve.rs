//! All scatterings at once, between the bases of the clusters.
//!
//! Let a be the coefficients of the radiosity of all samples, X the transfer and P the projection. Radiosity is the albedo ρ times irradiance, so
//! a = P ρ (E + X a) with the direct irradiance E, and a = (1 − P ρ X)⁻¹ P ρ E. The matrix has a row for each vector, so the matrix is small, and the
//! sum of all scatterings is exact in the space of the bases (the paper follows photons for each vector instead, for one albedo).

use std::collections::BTreeMap;

use nalgebra::DMatrix;

use super::{Settings, Stored, transfer};
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
    /// Scatterings whose light links carry exactly.
    pub linked: u32,
}

/// P ρ X for one colour, with links. `albedos`: of each sample.
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
        add_links(stored, cluster, albedos, &mut out);
        for (vector, row) in small.chunks_exact(stride.max(1)).enumerate() {
            if transfer.rank == 0 {
                row.iter().enumerate().for_each(|(at, value)| out[(first + vector, at)] += *value);
                continue;
            }
            for (part, of) in row.iter().zip(transfer.rows.chunks_exact(all.max(1))) {
                of.iter().enumerate().for_each(|(at, value)| out[(first + vector, at)] += part * f64::from(*value));
            }
        }
    }
    out
}

/// Adds what links carry to the rows of a cluster.
fn add_links(stored: &Stored, cluster: usize, albedos: &[f32], out: &mut DMatrix<f64>) {
    let plan = &stored.plan;
    let (range, first) = (plan.range(cluster), plan.first_vector(cluster));
    let (basis, links) = (&stored.bases[cluster], &stored.transfers[cluster].links);
    let ends: Vec<usize> = (0..plan.clusters.len()).map(|cluster| plan.range(cluster).end).collect();
    // For each cluster that sends light: the light by each of its vectors.
    let mut light: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    for (number, sample) in stored.samples[range.clone()].iter().enumerate() {
        light.clear();
        for (sender, share) in links.of(number, plan.settings.rays) {
            let from = ends.partition_point(|end| *end <= sender);
            let functions = stored.bases[from].functions(sender - plan.range(from).start, stored.samples[sender].area);
            let sums = light.entry(from).or_insert_with(|| vec![0.0; plan.vectors(from)]);
            sums.iter_mut().zip(functions).for_each(|(sum, value)| *sum += f64::from(share * value));
        }
        let albedo = f64::from(albedos[range.start + number]);
        for (from, sums) in &light {
            for (at, value) in sums.iter().enumerate() {
                let mut column = out.column_mut(plan.first_vector(*from) + at);
                let column = column.as_mut_slice()[first..].iter_mut();
                let weights = basis.weights(number, sample.area);
                column.zip(weights).for_each(|(sum, weight)| *sum += f64::from(weight) * albedo * value);
            }
        }
    }
}

/// Solves for these albedos: three for each sample. `bounces`, `mean` and `linked` of the settings count.
///
/// # Errors
/// `Input` if the light of all scatterings is not finite: the room is closed and reflects everything.
pub fn solve(stored: &Stored, albedos: &[[f32; 3]], settings: &Settings) -> Result<Solved> {
    let Settings { bounces, mean, .. } = *settings;
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
    // Without links there is nothing to refine, and of one scattering nothing after the first.
    let links = stored.transfers.iter().any(|of| !of.links.senders.is_empty());
    let most = if links { u32::MAX } else { 0 };
    let linked = settings.linked.min(most).min(if bounces { u32::MAX } else { 1 });
    Ok(Solved { inverse, shift, fixed, linked })
}

impl Solved {
    /// Indirect irradiance at the samples, W/m², by this direct irradiance: the slow twin of the passes of a frame.
    pub fn indirect(&self, stored: &Stored, albedos: &[[f32; 3]], direct: &[[f32; 3]]) -> Vec<[f32; 3]> {
        let plan = &stored.plan;
        let all = plan.all_vectors();
        let mut out = vec![[0.0f32; 3]; stored.samples.len()];
        let fixed: Vec<f64> =
            self.fixed.iter().zip(&self.shift).map(|(fixed, shift)| f64::from(fixed - shift)).collect();
        for channel in 0..3 {
            let of = |light: &[f64]| -> Vec<f64> {
                light.iter().zip(albedos).map(|(light, albedo)| light * f64::from(albedo[channel])).collect()
            };
            let direct: Vec<f64> = direct.iter().map(|direct| f64::from(direct[channel])).collect();
            let radiosity = of(&direct);
            let before = projected(stored, &radiosity, &fixed);
            let mut after = vec![0.0f64; all];
            for (column, before) in self.inverse[channel].chunks_exact(all.max(1)).zip(&before) {
                after.iter_mut().zip(column).for_each(|(sum, value)| *sum += f64::from(*value) * before);
            }
            // What links carry: the first scattering exactly, and the further ones as the vectors have them.
            let mut linked = match self.linked {
                0 => restored(stored, &after),
                _ => {
                    let further: Vec<f64> = after.iter().zip(&before).map(|(after, before)| after - before).collect();
                    restored(stored, &further).iter().zip(&radiosity).map(|(a, b)| a + b).collect()
                }
            };
            let mut light = received(stored, &after, &linked);
            for _ in 1..self.linked {
                linked = of(&light.iter().zip(&direct).map(|(a, b)| a + b).collect::<Vec<_>>());
                light = received(stored, &projected(stored, &linked, &fixed), &linked);
            }
            out.iter_mut().zip(light).for_each(|(out, light)| out[channel] = light as f32);
        }
        out
    }
}

/// The coefficients of this radiosity. `fixed`: what is there without light.
fn projected(stored: &Stored, radiosity: &[f64], fixed: &[f64]) -> Vec<f64> {
    let mut out = fixed.to_vec();
    for (cluster, basis) in stored.bases.iter().enumerate() {
        let first = stored.plan.first_vector(cluster);
        for (number, sample) in stored.plan.range(cluster).enumerate() {
            let weights = basis.weights(number, stored.samples[sample].area);
            let sums = out[first..].iter_mut().zip(weights);
            sums.for_each(|(sum, weight)| *sum += f64::from(weight) * radiosity[sample]);
        }
    }
    out
}

/// The radiosity of all samples that has these coefficients.
fn restored(stored: &Stored, coefficients: &[f64]) -> Vec<f64> {
    let mut out = Vec::with_capacity(stored.samples.len());
    for (cluster, basis) in stored.bases.iter().enumerate() {
        let of = &coefficients[stored.plan.first_vector(cluster)..];
        for (number, sample) in stored.plan.range(cluster).enumerate() {
            let values = basis.functions(number, stored.samples[sample].area);
            out.push(values.zip(of).map(|(value, along)| f64::from(value) * along).sum());
        }
    }
    out
}

/// Irradiance of all samples by light with these coefficients. `linked`: radiosity of all samples, for links.
fn received(stored: &Stored, coefficients: &[f64], linked: &[f64]) -> Vec<f64> {
    let all = stored.plan.all_vectors();
    let rays = stored.plan.settings.rays;
    let mut out = Vec::with_capacity(stored.samples.len());
    for (cluster, transfer) in stored.transfers.iter().enumerate() {
        let stride = transfer.stride(all);
        let mixed: Vec<f64> = match transfer.rank {
            0 => coefficients.to_vec(),
            _ => {
                let rows = transfer.rows.chunks_exact(all.max(1));
                rows.map(|row| row.iter().zip(coefficients).map(|(a, b)| f64::from(*a) * b).sum()).collect()
            }
        };
        for number in 0..stored.plan.clusters[cluster] as usize {
            let values = &transfer.values[number * stride..][..stride];
            let far: f64 = values.iter().zip(&mixed).map(|(a, b)| f64::from(a.to_f32()) * b).sum();
            let near: f64 =
                transfer.links.of(number, rays).map(|(sender, share)| f64::from(share) * linked[sender]).sum();
            out.push(far + near);
        }
    }
    out
}

/// As [`Solved::indirect`], solved for these albedos by these settings.
///
/// # Errors
/// As [`solve`].
pub fn indirect(
    stored: &Stored,
    albedos: &[[f32; 3]],
    direct: &[[f32; 3]],
    settings: &Settings,
) -> Result<Vec<[f32; 3]>> {
    Ok(solve(stored, albedos, settings)?.indirect(stored, albedos, direct))
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

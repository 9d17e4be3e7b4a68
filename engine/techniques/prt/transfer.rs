//! Bases for direct light, and the light that each of their vectors sends to each sample (Leonhardt and Bohn, section 4.3).
//!
//! A vector of a basis is a function on the samples of a cluster. The functions are orthonormal if samples count with their areas. Transfer is of
//! radiosity without any albedo: the albedo is applied when light arrives, so that albedos may change at run time.

use half::f16;

use super::{Plan, links::Links};
use crate::{
    Result,
    bake::lowrank::{LowRank, low_rank},
    shaders::types::PrtPoint,
};

/// Examples whose light after one scattering is an example, too: indirect light is smoother than direct light, and both are projected.
pub const INDIRECT: usize = 300;

/// Rays of a link at least: fewer tell little of the share of the hemisphere.
const LEAST_RAYS: usize = 4;

/// The basis of the direct light of a cluster.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Basis {
    /// Number of vectors, with the mean.
    pub vectors: u32,
    /// Values of all vectors at a sample, each times the root of the sample's area (the mean: the irradiance itself); sample after sample.
    pub values: Vec<f16>,
    /// Root mean square of the coefficients of the examples, one a vector, relative to each other: how much a vector counts.
    pub sizes: Vec<f32>,
    /// The last vector is the mean, which is always there once.
    pub centred: bool,
}

/// The light that all vectors of all clusters send to the samples of one cluster.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Transfer {
    /// Vectors of the receivers; 0: `values` are of each vector of light.
    pub rank: u32,
    /// For each vector of the receivers a row of all vectors of light.
    pub rows: Vec<f32>,
    /// For each sample its part of each vector of the receivers, or of each vector of light.
    pub values: Vec<f16>,
    /// Share of the light of the examples' vectors that the vectors of the receivers leave out.
    pub left: f32,
    /// Share of rays that met a surface without samples.
    pub lost: f32,
    /// Pairs of samples whose light is not in `values`.
    pub links: Links,
    /// For each sample the samples that its first rays meet; no number of a sample: none.
    pub met: Vec<u32>,
}

impl Basis {
    /// The basis of a cluster. `direct`: irradiance by each example, a row for each sample; `indirect`: the same after one scattering. `scale`: the
    /// factor on both, for a mean whose lights have 1 W/sr.
    ///
    /// # Errors
    /// `Runtime` if a value is not finite.
    pub fn new(
        areas: &[f32],
        (direct, indirect, scale): (&[f32], &[f32], f32),
        vectors: usize,
        centred: bool,
    ) -> Result<Self> {
        let count = areas.len();
        let roots: Vec<f32> = areas.iter().map(|area| area.sqrt()).collect();
        let lights = direct.len() / count.max(1);
        let mean: Vec<f32> = match centred {
            true => direct.chunks_exact(lights.max(1)).map(|row| row.iter().sum::<f32>() / lights as f32).collect(),
            false => vec![0.0; count],
        };
        // Each example is a row of all samples.
        let column = |rows: &[f32], light: usize, of: usize| -> Vec<f32> {
            (0..count).map(|i| roots[i] * (rows[i * of + light] - mean[i])).collect()
        };
        let even: Vec<f32> = unit(&roots);
        let mut vectors_found: Vec<f64> = Vec::new();
        let found = if centred {
            let rows: Vec<f32> = (0..lights).flat_map(|light| column(direct, light, lights)).collect();
            low_rank(&rows, count, vectors)?
        } else {
            // Even light is a vector of its own, so that the sum of the light over the cluster is exact.
            vectors_found.extend(even.iter().map(|value| f64::from(*value)));
            let mut rows = Vec::new();
            for (list, of) in [(direct, lights), (indirect, indirect.len() / count.max(1))] {
                for light in 0..of {
                    let mut row = unit(&column(list, light, of));
                    let along: f32 = row.iter().zip(&even).map(|(a, b)| a * b).sum();
                    row.iter_mut().zip(&even).for_each(|(value, even)| *value -= along * even);
                    rows.extend(row);
                }
            }
            low_rank(&rows, count, vectors.saturating_sub(1))?
        };
        vectors_found.extend(&found.vectors);
        let mut all =
            LowRank { columns: count, squares: vec![1.0; vectors_found.len() / count.max(1)], vectors: vectors_found };
        // All clusters have the planned number of vectors, the last ones may be 0.
        all.vectors.resize(count * vectors, 0.0);
        all.squares.resize(vectors, 0.0);
        let mut sizes = vec![0.0f64; vectors];
        let rows: Vec<f32> = (0..lights).flat_map(|light| column(direct, light, lights)).collect();
        for coefficients in all.project(&rows).chunks_exact(vectors.max(1)) {
            sizes.iter_mut().zip(coefficients).for_each(|(sum, along)| *sum += along * along / lights as f64);
        }
        let mut sizes: Vec<f32> = sizes.into_iter().map(|square| square.sqrt() as f32).collect();
        let stride = vectors + usize::from(centred);
        let mut values = vec![f16::ZERO; stride * count];
        for (index, vector) in all.vectors.chunks_exact(count).enumerate() {
            vector.iter().enumerate().for_each(|(i, value)| values[i * stride + index] = f16::from_f64(*value));
        }
        if centred {
            mean.iter().enumerate().for_each(|(i, mean)| values[i * stride + vectors] = f16::from_f32(*mean / scale));
            sizes.push(scale);
        }
        Ok(Self { vectors: stride as u32, values, sizes, centred })
    }

    /// The values of all vectors at a sample as functions, for light that the vectors send.
    pub fn functions<'a>(&'a self, sample: usize, area: f32) -> impl Iterator<Item = f32> + 'a {
        let stride = self.vectors as usize;
        let root = area.sqrt().max(1e-20);
        let values = self.values[sample * stride..][..stride].iter().enumerate();
        values.map(move |(index, value)| {
            let mean = self.centred && index + 1 == stride;
            if mean { value.to_f32() } else { value.to_f32() / root }
        })
    }

    /// The coefficients of all vectors for 1 W/m² at one sample. The mean's coefficient does not depend on the light.
    pub fn weights<'a>(&'a self, sample: usize, area: f32) -> impl Iterator<Item = f32> + 'a {
        let stride = self.vectors as usize;
        let root = area.sqrt();
        let values = self.values[sample * stride..][..stride].iter().enumerate();
        values.map(move |(index, value)| {
            let mean = self.centred && index + 1 == stride;
            if mean { 0.0 } else { value.to_f32() * root }
        })
    }

    /// The coefficients of the mean, which are taken away from those of the light.
    pub fn shift(&self, areas: &[f32]) -> Vec<f32> {
        let stride = self.vectors as usize;
        let mut out = vec![0.0; stride];
        if self.centred {
            for (i, area) in areas.iter().enumerate() {
                let mean = self.values[i * stride + stride - 1].to_f32();
                out.iter_mut().zip(self.weights(i, *area)).for_each(|(sum, weight)| *sum += weight * mean);
            }
        }
        out
    }
}

fn unit(row: &[f32]) -> Vec<f32> {
    let length = row.iter().map(|value| f64::from(*value).powi(2)).sum::<f64>().sqrt();
    let scale = if length > 0.0 { (1.0 / length) as f32 } else { 0.0 };
    row.iter().map(|value| value * scale).collect()
}

/// Mean over the rays of each sample of a function of the samples that they meet: `values` has a row of `count` values for each sample.
pub fn gathered(seen: &[u32], rays: usize, values: &[f32], count: usize) -> Vec<f32> {
    let mut out = Vec::with_capacity(seen.len() / rays.max(1) * count);
    let scale = 1.0 / rays as f32;
    let mut sum = vec![0.0f32; count];
    for seen in seen.chunks_exact(rays) {
        sum.fill(0.0);
        for number in seen {
            if let Some(row) = values.get(*number as usize * count..).and_then(|rest| rest.get(..count)) {
                sum.iter_mut().zip(row).for_each(|(sum, value)| *sum += value);
            }
        }
        out.extend(sum.iter().map(|sum| sum * scale));
    }
    out
}

/// The values of all vectors at all samples as functions, with the number of each sample's first vector.
#[derive(Debug)]
pub struct Senders {
    firsts: Vec<u32>,
    /// First value of each sample.
    starts: Vec<u32>,
    values: Vec<f32>,
    sizes: Vec<f32>,
}

impl Senders {
    /// Joins the bases of all clusters.
    pub fn new(plan: &Plan, samples: &[PrtPoint], bases: &[Basis]) -> Self {
        let mut out = Self { firsts: Vec::new(), starts: vec![0], values: Vec::new(), sizes: Vec::new() };
        for (cluster, basis) in bases.iter().enumerate() {
            let first = plan.first_vector(cluster) as u32;
            for (number, sample) in samples[plan.range(cluster)].iter().enumerate() {
                out.firsts.push(first);
                out.values.extend(basis.functions(number, sample.area));
                out.starts.push(out.values.len() as u32);
            }
            out.sizes.extend(&basis.sizes);
        }
        out
    }

    /// The transfer to the samples of a cluster. `seen`: the samples that their rays meet.
    ///
    /// # Errors
    /// `Runtime` if a value is not finite.
    pub fn transfer(&self, plan: &Plan, samples: &[PrtPoint], cluster: usize, seen: &[u32]) -> Result<Transfer> {
        let rays = plan.settings.rays as usize;
        let all = self.sizes.len();
        let receivers = &samples[plan.range(cluster)];
        let scale = 1.0 / rays as f32;
        let mut dense = vec![0.0f32; receivers.len() * all];
        let mut lost = 0usize;
        let mut links = Links::default();
        let least = match plan.settings.links {
            0.0 => usize::MAX,
            share => ((share * rays as f64).ceil() as usize).max(LEAST_RAYS),
        };
        let mut sorted = Vec::with_capacity(rays);
        for (row, seen) in dense.chunks_exact_mut(all.max(1)).zip(seen.chunks_exact(rays)) {
            sorted.clear();
            sorted.extend_from_slice(seen);
            sorted.sort_unstable();
            links.add(&sorted, least, |number, met| {
                let Some(first) = self.firsts.get(number) else {
                    lost += if number as u32 == crate::shaders::consts::PRT_LOST { met } else { 0 };
                    return;
                };
                let values = &self.values[self.starts[number] as usize..self.starts[number + 1] as usize];
                let share = met as f32 * scale;
                row[*first as usize..].iter_mut().zip(values).for_each(|(sum, value)| *sum += value * share);
            });
        }
        if links.senders.is_empty() {
            links = Links::default();
        }
        let lost = lost as f32 / seen.len().max(1) as f32;
        let kept = plan.settings.kept_rays();
        let met: Vec<u32> = seen.chunks_exact(rays).flat_map(|seen| &seen[..kept]).copied().collect();
        let rank = plan.settings.receivers as usize;
        if rank == 0 {
            return Ok(Transfer { lost, links, met, ..thinned(dense, &self.sizes, plan.settings.keep) });
        }
        // Samples count with their areas, and vectors with the size of their coefficients.
        let roots: Vec<f32> = receivers.iter().map(|sample| sample.area.sqrt()).collect();
        for (row, root) in dense.chunks_exact_mut(all.max(1)).zip(&roots) {
            row.iter_mut().zip(&self.sizes).for_each(|(value, size)| *value *= root * size);
        }
        let found = low_rank(&dense, all, rank)?;
        let whole: f64 = dense.iter().map(|value| f64::from(*value).powi(2)).sum();
        let left = if whole > 0.0 { 1.0 - found.squares.iter().sum::<f64>() / whole } else { 0.0 };
        let coefficients = found.project(&dense);
        let rows = coefficients.chunks_exact(found.len().max(1)).zip(&roots);
        let divided = |(row, root): (&[f64], &f32)| {
            let root = f64::from(root.max(1e-20));
            row.iter().map(move |along| f16::from_f64(along / root)).collect::<Vec<_>>()
        };
        let values = rows.flat_map(divided).collect();
        let divided = |(value, size): (&f64, &f32)| if *size > 0.0 { (value / f64::from(*size)) as f32 } else { 0.0 };
        let rows =
            found.vectors.chunks_exact(all.max(1)).flat_map(|v| v.iter().zip(&self.sizes).map(divided)).collect();
        Ok(Transfer { rank: found.len() as u32, rows, values, left: left.max(0.0).sqrt() as f32, lost, links, met })
    }
}

/// Every coefficient, or the share of them that counts most; all smaller ones become 0 (section 4.4).
fn thinned(dense: Vec<f32>, sizes: &[f32], keep: f64) -> Transfer {
    let sized: Vec<f32> = dense.iter().zip(sizes.iter().cycle()).map(|(value, size)| (value * size).abs()).collect();
    let mut order = sized.clone();
    let kept = ((keep * order.len() as f64).round() as usize).min(order.len());
    let least = match kept {
        0 => f32::INFINITY,
        kept if kept == order.len() => 0.0,
        kept => *order.select_nth_unstable_by(kept, |a, b| b.total_cmp(a)).1,
    };
    let (mut whole, mut left) = (0.0f64, 0.0f64);
    let values = dense.iter().zip(&sized).map(|(value, size)| {
        let square = f64::from(*size).powi(2);
        whole += square;
        if *size > least || least == 0.0 {
            return f16::from_f32(*value);
        }
        left += square;
        f16::ZERO
    });
    let values = values.collect();
    let left = if whole > 0.0 { (left / whole).sqrt() as f32 } else { 0.0 };
    Transfer { values, left, ..Transfer::default() }
}

impl Transfer {
    /// Numbers of each sample.
    pub fn stride(&self, all: usize) -> usize {
        if self.rank == 0 && !self.values.is_empty() { all } else { self.rank as usize }
    }

    /// Share of the coefficients that are not 0.
    pub fn kept(&self) -> f64 {
        let there = self.values.iter().filter(|value| **value != f16::ZERO).count();
        there as f64 / self.values.len().max(1) as f64
    }

    /// Bytes in files, with sparse rows.
    pub fn bytes(&self) -> u64 {
        let dense = 2 * self.values.len() as u64 + 4 * self.rows.len() as u64;
        if self.rank > 0 {
            return dense;
        }
        // A bit for each coefficient, and those that are there.
        let there = self.values.iter().filter(|value| **value != f16::ZERO).count();
        (2 * there + self.values.len().div_ceil(8)) as u64
    }
}

/// Areas of the samples of a cluster, m².
pub(super) fn areas(plan: &Plan, samples: &[PrtPoint], cluster: usize) -> Vec<f32> {
    samples[plan.range(cluster)].iter().map(|sample| sample.area).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn light(count: usize, lights: usize) -> Vec<f32> {
        let value = |i: usize, l: usize| {
            let (x, y) = (i as f32 / count as f32, l as f32 / lights as f32);
            1.0 / (0.05 + (x - y) * (x - y))
        };
        (0..count * lights).map(|at| value(at / lights, at % lights)).collect()
    }

    fn projected(basis: &Basis, areas: &[f32], light: &[f32]) -> Vec<f32> {
        let stride = basis.vectors as usize;
        let mut along = vec![0.0f32; stride];
        for (i, value) in light.iter().enumerate() {
            along.iter_mut().zip(basis.weights(i, areas[i])).for_each(|(sum, weight)| *sum += weight * value);
        }
        along
    }

    #[test]
    fn the_mean_over_a_cluster_is_exact_and_smooth_light_is_near() {
        let areas: Vec<f32> = (0..200).map(|i| 0.01 + 0.004 * (i as f32 * 0.7).sin()).collect();
        let direct = light(200, 100);
        let basis = Basis::new(&areas, (&direct, &[], 1.0), 10, false).unwrap();
        let mut worst = 0.0f32;
        for l in 0..100 {
            let of: Vec<f32> = (0..200).map(|i| direct[i * 100 + l]).collect();
            let along = projected(&basis, &areas, &of);
            let restored: Vec<f32> = (0..200)
                .map(|i| basis.functions(i, areas[i]).zip(&along).map(|(value, along)| value * along).sum())
                .collect();
            let sum = |list: &[f32]| list.iter().zip(&areas).map(|(value, area)| value * area).sum::<f32>();
            assert!((sum(&restored) / sum(&of) - 1.0).abs() < 2e-3);
            let off: f32 = restored.iter().zip(&of).map(|(a, b)| (a - b).powi(2)).sum();
            worst = worst.max((off / of.iter().map(|v| v * v).sum::<f32>()).sqrt());
        }
        assert!(worst < 0.1, "{worst}");
        // No light is exactly none.
        assert!(projected(&basis, &areas, &[0.0; 200]).iter().all(|along| *along == 0.0));
    }

    #[test]
    fn a_centred_basis_has_its_mean_and_takes_it_away() {
        let areas = vec![0.01; 60];
        let direct = light(60, 40);
        let basis = Basis::new(&areas, (&direct, &[], 1.0), 5, true).unwrap();
        assert_eq!((basis.vectors, basis.sizes.len()), (6, 6));
        let shift = basis.shift(&areas);
        assert!(shift[..5].iter().any(|value| value.abs() > 1e-3) && shift[5] == 0.0);
    }

    #[test]
    fn thinning_keeps_the_largest() {
        let dense: Vec<f32> = (0..100).map(|i| i as f32 - 50.0).collect();
        let thin = thinned(dense.clone(), &[1.0; 10], 0.2);
        assert!((thin.kept() - 0.2).abs() < 0.02, "{}", thin.kept());
        assert!(thin.values[0].to_f32() == -50.0 && thin.values[50] == f16::ZERO);
        let square = |of: &dyn Fn(usize) -> f32| (0..100).map(|i| of(i).powi(2)).sum::<f32>();
        let left = square(&|i| dense[i] - thin.values[i].to_f32()) / square(&|i| dense[i]);
        assert!((thin.left - left.sqrt()).abs() < 1e-3, "{} {left}", thin.left);
    }
}

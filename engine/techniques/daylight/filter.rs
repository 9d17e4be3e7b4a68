//! The filter of a bake's noise: means over texels of one surface whose light differs by no more than its noise explains.
//!
//! Weights follow the idea of Rousselle, Knaus and Zwicker (Adaptive Rendering with Non-Local Means Filtering, 2012): differences are compared with
//! their noise, and the halves of the samples weight each other. The neighbours of a texel lie on its surface in space, so that the borders of
//! charts do not matter. Instead of patches, means of near texels are compared, for parts of the day, the sky and the lamps. Weights of a half
//! come from the other half, so that weights and noise are independent, and all times have the same weights: the light stays linear in its
//! sources, and does not flicker.

use std::collections::BTreeMap;

use super::{
    Kind, Plan,
    balance::{balance, tangents},
    gathered::{FEATURES, Features, Gathered},
    listed::{Listed, Texel, dot},
};

/// Square of a difference in standard deviations of the noise that counts as noise.
const BY_NOISE: f32 = 2.0;
/// How fast weights fall beyond it.
const SHARP: f32 = 1.0;
/// Relative difference of light that is never seen.
const UNSEEN: f32 = 0.02;
/// Number of texels whose plain mean has the noise of the mean over next neighbours: a Gaussian of 1 texel that ends at 2 texels.
const NEXT: f32 = 9.6;
/// Change of light from texel to texel that is expected, relative.
const CHANGE: f32 = 0.02;
/// Least cosine between the normals of two texels of one surface.
const LEAST_COSINE: f32 = 0.85;

/// The texels of a bake with what decides the weights between them.
#[derive(Debug)]
pub struct Filter<'a> {
    listed: &'a Listed,
    near: Near,
    radius: f32,
    features: Vec<Features>,
    /// Variance of the features of one half.
    variances: Vec<[f32; FEATURES]>,
}

/// How neighbours are found.
#[derive(Debug)]
enum Near {
    /// In the picture: the texel at each pixel.
    Picture,
    /// In space: texels by cells of this size.
    Space { cell: f32, cells: BTreeMap<[i32; 3], Vec<u32>> },
}

impl<'a> Filter<'a> {
    /// Compares the light of all texels. `listed`: those of the `tiles`; `radius`: of the means, in texels.
    pub fn new(plan: &Plan, tiles: &[Gathered], listed: &'a Listed, radius: u32) -> Self {
        let radius = radius as f32;
        let near = match plan.receivers {
            Kind::View { .. } => Near::Picture,
            _ => in_space(&listed.texels, radius),
        };
        let features: Vec<Features> = tiles.iter().flat_map(|tile| tile.features.iter().copied()).collect();
        let variances = vec![[0.0; FEATURES]; features.len()];
        let mut filter = Self { listed, near, radius, features, variances };
        filter.smooth();
        filter
    }

    /// The neighbours of a texel on its surface within `radius` texels, itself among them, with their weight by distance. `falloff`: texels.
    fn each(&self, of: u32, radius: f32, falloff: f32, mut found: impl FnMut(u32, f32)) {
        let texel = self.listed.texels[of as usize];
        let mut consider = |other: u32, distance: f32| {
            let q = &self.listed.texels[other as usize];
            let way = texel.way_to(q);
            let cosine = dot(q.normal, texel.normal);
            let off = dot(way, texel.normal).abs();
            // On a curved surface the way between two texels leaves the tangent plane by less than half its length.
            // A degenerate triangle has no normal.
            let turned = cosine.is_nan() || cosine < LEAST_COSINE;
            if other != of && turned || off > 0.2 * dot(way, way).sqrt() + 0.05 * texel.size {
                return;
            }
            let x = distance / falloff;
            found(
                other,
                (-0.5 * x * x).exp()
                    * if other == of { 1.0 } else { ((cosine - LEAST_COSINE) / (1.0 - LEAST_COSINE)).min(1.0) },
            );
        };
        match &self.near {
            Near::Picture => {
                let reach = radius as i64;
                for dy in -reach..=reach {
                    for dx in -reach..=reach {
                        let distance = ((dx * dx + dy * dy) as f32).sqrt();
                        if let Some(other) = self.listed.beside(&texel, [dx, dy])
                            && distance <= radius
                        {
                            consider(other, distance);
                        }
                    }
                }
            }
            Near::Space { cell, cells } => {
                let reach = radius * texel.size;
                let [low, high] = [-reach, reach].map(|by| texel.position.map(|p| cell_of(p + by, *cell)));
                for x in low[0]..=high[0] {
                    for y in low[1]..=high[1] {
                        for &other in (low[2]..=high[2]).filter_map(|z| cells.get(&[x, y, z])).flatten() {
                            let q = &self.listed.texels[other as usize];
                            let way = texel.way_to(q);
                            let distance = dot(way, way).sqrt();
                            if distance <= reach {
                                consider(other, distance / texel.size.max(f32::MIN_POSITIVE));
                            }
                        }
                    }
                }
            }
        }
    }

    /// Means of the features over next neighbours, and their variances over more of them.
    fn smooth(&mut self) {
        let means = |radius: f32, falloff: f32, of: &dyn Fn(u32) -> Features| -> Vec<Features> {
            (0..self.listed.texels.len() as u32)
                .map(|texel| {
                    let (mut sum, mut weights) = ([[0.0; FEATURES]; 2], 0.0);
                    self.each(texel, radius, falloff, |other, weight| {
                        let values = of(other);
                        for (sum, value) in sum.iter_mut().flatten().zip(values.iter().flatten()) {
                            *sum += weight * value;
                        }
                        weights += weight;
                    });
                    sum.map(|half| half.map(|sum| if weights > 0.0 { sum / weights } else { 0.0 }))
                })
                .collect()
        };
        let smoothed = means(2.0, 1.0, &|texel| self.features[texel as usize]);
        let squares = means(4.0, 2.0, &|texel| {
            let [a, b] = smoothed[texel as usize];
            let square: [f32; FEATURES] = std::array::from_fn(|j| 0.5 * (a[j] - b[j]).powi(2));
            [square, square]
        });
        self.variances = squares.into_iter().map(|[square, _]| square).collect();
        self.features = smoothed;
    }

    /// How far the light of two texels differs beyond its noise, by one half of the samples: 0 for differences that noise explains.
    fn difference(&self, half: usize, p: u32, q: u32) -> f32 {
        let (f, g) = (&self.features[p as usize][half], &self.features[q as usize][half]);
        let (v, w) = (&self.variances[p as usize], &self.variances[q as usize]);
        let (mut sum, mut most, mut count) = (0.0f32, 0.0f32, 0.0f32);
        for j in 0..FEATURES {
            let unseen = UNSEEN * 0.5 * (f[j].abs() + g[j].abs());
            let variance = v[j] + w[j] + unseen * unseen;
            if variance > 0.0 {
                let square = (f[j] - g[j]).powi(2) / variance;
                (sum, most, count) = (sum + square, most.max(square), count + 1.0);
            }
        }
        // Noise alone gives squares of 1 on average, and about 4 for the largest.
        let found = (sum / count.max(1.0)).max(most / 4.0);
        (SHARP * (found - BY_NOISE)).max(0.0)
    }

    /// The variance of the light of a texel, relative, by one half of the samples.
    fn noise(&self, half: usize, of: u32) -> f32 {
        let light: f32 = self.features[of as usize][half].iter().map(|value| value * value).sum();
        let variance: f32 = self.variances[of as usize].iter().sum();
        // Variances are those of means over next neighbours.
        if variance > 0.0 { NEXT * variance / light.max(f32::MIN_POSITIVE) } else { 0.0 }
    }

    /// The neighbours of a texel, and their weights for the first and for the second half of the samples, each summing to 1.
    pub fn weights(&self, of: u32) -> Vec<(u32, [f32; 2])> {
        let texel = &self.listed.texels[of as usize];
        let axes = tangents(texel.normal).map(|axis| axis.map(|of| of / texel.size.max(f32::MIN_POSITIVE)));
        let (mut near, mut ways, mut halves) = (Vec::new(), Vec::new(), [Vec::new(), Vec::new()]);
        // The second half decides for the first, and the first for the second.
        self.each(of, self.radius, 0.5 * self.radius, |other, weight| {
            let weights = [1, 0].map(|half| weight * (-self.difference(half, of, other)).exp());
            if weights.iter().any(|weight| *weight > 1e-4) {
                let way = texel.way_to(&self.listed.texels[other as usize]);
                near.push(other);
                ways.push(axes.map(|axis| dot(way, axis)));
                halves.iter_mut().zip(weights).for_each(|(half, weight)| half.push(weight));
            }
        });
        for (weights, half) in halves.iter_mut().zip([1, 0]) {
            balance(weights, &ways, self.noise(half, of) / CHANGE.powi(2));
        }
        let [first, second] = halves;
        near.into_iter().zip(first.into_iter().zip(second)).map(|(near, (a, b))| (near, [a, b])).collect()
    }
}

fn cell_of(position: f32, cell: f32) -> i32 {
    (position / cell).floor().clamp(-1e9, 1e9) as i32
}

fn in_space(texels: &[Texel], radius: f32) -> Near {
    let mut sizes: Vec<f32> = texels.iter().map(|texel| texel.size).collect();
    sizes.sort_by(f32::total_cmp);
    let cell = (radius * sizes.get(sizes.len() / 2).copied().unwrap_or(1.0)).max(1e-6);
    let mut cells: BTreeMap<[i32; 3], Vec<u32>> = BTreeMap::new();
    for (number, texel) in texels.iter().enumerate() {
        cells.entry(texel.position.map(|p| cell_of(p, cell))).or_default().push(number as u32);
    }
    Near::Space { cell, cells }
}

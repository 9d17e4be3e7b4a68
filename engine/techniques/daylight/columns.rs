//! The columns of a tile's light (moments of the day, or skies), their noise, and how far a description is from them.
//!
//! The light is known from two halves of the samples, A and B: their mean (A+B)/2, and their noise (A−B)/2, which has the variance of the noise
//! of the mean. A description takes the part P of its data. The mean of (A−PA)(B−PB) is the mean square of the light that P misses, because the
//! noise of the halves is independent. It equals the mean square of the rest of the mean less that of the rest of the noise. So noise needs
//! no image, and a description can be nearer to the light than its data.

use crate::{
    Result,
    bake::pca::{Basis, Centre, Keep, Moments},
};

/// Weights below this part of the largest are no light: their inverse would not be a number of 32 bits.
const LEAST: f64 = 1e-12;

/// Columns below this part of the brightest one have no light: a few stray paths, a millionth as bright as noon, tell nothing.
pub(super) const DARK: f64 = 1e-6;

/// The light of a tile and its noise: three rows (red, green, blue) for each texel.
#[derive(Clone, Copy, Debug)]
pub struct Measured<'a> {
    pub dimensions: usize,
    pub rows: &'a [f32],
    /// Half the difference of the two halves of the samples; empty: the light counts as exact.
    pub noise: &'a [f32],
}

/// The columns that have to be within the tolerance.
#[derive(Clone, Copy, Debug)]
pub enum Columns<'a> {
    /// Each dimension by itself.
    Dimensions,
    /// Mixtures of the dimensions: weights, one row of all dimensions for each mixture.
    Mixtures(&'a [f32]),
}

impl Measured<'_> {
    fn lines(&self) -> usize {
        self.rows.len() / self.dimensions.max(1)
    }

    /// Mean of the values of a function of the rows.
    fn mean(&self, rows: &[f32], of: impl Fn(&[f32]) -> f64) -> f64 {
        rows.chunks_exact(self.dimensions.max(1)).map(of).sum::<f64>() / self.lines().max(1) as f64
    }
}

impl Columns<'_> {
    /// How much each dimension counts: by what it can add, so that dusk counts as much as noon. A dimension whose noise is larger than its light
    /// counts less.
    pub fn weights(self, light: Measured<'_>) -> Vec<f64> {
        let dimensions = light.dimensions;
        let mut weights = match self {
            Columns::Dimensions => {
                let means: Vec<f64> =
                    (0..dimensions).map(|t| light.mean(light.rows, |row| f64::from(row[t]))).collect();
                let least = DARK * means.iter().copied().fold(0.0, f64::max);
                let noise = |t: usize| light.mean(light.noise, |row| f64::from(row[t]).powi(2));
                let weight = |(t, mean): (usize, &f64)| match *mean > least {
                    true => inverse((mean * mean + noise(t)).sqrt()),
                    false => 0.0,
                };
                means.iter().enumerate().map(weight).collect()
            }
            Columns::Mixtures(mixtures) => {
                let mut most = vec![0.0; dimensions];
                for mixture in mixtures.chunks_exact(dimensions.max(1)) {
                    let scale = inverse(light.mean(light.rows, |row| mixed(row, mixture)));
                    most.iter_mut()
                        .zip(mixture)
                        .for_each(|(most, part)| *most = f64::max(*most, f64::from(*part) * scale));
                }
                most
            }
        };
        let largest = weights.iter().copied().fold(0.0, f64::max);
        weights.iter_mut().filter(|weight| **weight < LEAST * largest).for_each(|weight| *weight = 0.0);
        weights
    }
}

/// Weighted rows, and the principal components of what the halves have in common.
#[derive(Debug)]
pub(super) struct Weighted {
    pub scaled: Vec<f32>,
    pub basis: Basis,
}

impl Weighted {
    pub fn new(light: Measured<'_>, weights: &[f64], most: usize) -> Result<Self> {
        let (scaled, noise) = (times(light.rows, weights), times(light.noise, weights));
        let ones = vec![1.0; light.lines()];
        let mut moments = Moments::new(light.dimensions);
        moments.add(&scaled, &ones)?;
        if !noise.is_empty() {
            let mut of_noise = Moments::new(light.dimensions);
            of_noise.add(&noise, &ones)?;
            moments.without_noise(&of_noise)?;
        }
        let basis = moments.basis(Centre::Origin, Keep::Count(most))?;
        Ok(Self { scaled, basis })
    }
}

/// Rows times the weights of their dimensions.
pub(super) fn times(rows: &[f32], weights: &[f64]) -> Vec<f32> {
    rows.iter().zip(weights.iter().cycle()).map(|(value, weight)| (f64::from(*value) * weight) as f32).collect()
}

/// The coefficient of each row along a vector.
pub(super) fn project<'a>(rows: &'a [f32], vector: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
    rows.chunks_exact(vector.len().max(1)).map(move |row| row.iter().zip(vector).map(|(r, v)| f64::from(*r) * v).sum())
}

/// What the images so far do not describe, column after column.
pub(super) struct Rest {
    lines: usize,
    dimensions: usize,
    /// Means of the columns as they were.
    means: Vec<f64>,
    /// Mean squares of the noise of the columns as it was.
    noises: Vec<f64>,
    /// Column after column.
    values: Vec<f32>,
    /// The same of the noise; empty: unknown.
    noise: Vec<f32>,
    /// The noise in rows, from which its coefficients follow.
    noise_rows: Vec<f32>,
    /// Weights of the mixtures; `None`: columns are dimensions.
    mixtures: Option<Vec<f32>>,
}

/// How far the columns are from their description, relative to their means.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct State {
    /// Root mean square of the error without the noise, of the worst column whose noise does not hide it.
    pub worst: f64,
    pub column: usize,
    /// Number of columns whose noise hides errors as large as the tolerance.
    pub hidden: usize,
    /// Root mean square of the noise that the description holds, of all columns together.
    pub noise: f64,
    /// All columns are within the tolerance, or so near to it that their noise hides the difference.
    pub within: bool,
}

impl Rest {
    pub fn new(light: Measured<'_>, columns: Columns<'_>) -> Self {
        let (dimensions, lines) = (light.dimensions, light.lines());
        let mixtures = match columns {
            Columns::Dimensions => None,
            Columns::Mixtures(mixtures) => Some(mixtures.to_vec()),
        };
        let by_column = |rows: &[f32]| -> Vec<f32> {
            if rows.is_empty() {
                return Vec::new();
            }
            match &mixtures {
                None => (0..dimensions).flat_map(|t| rows.iter().skip(t).step_by(dimensions).copied()).collect(),
                Some(mixtures) => mixtures
                    .chunks_exact(dimensions)
                    .flat_map(|mixture| rows.chunks_exact(dimensions).map(move |row| mixed(row, mixture) as f32))
                    .collect(),
            }
        };
        let (values, noise) = (by_column(light.rows), by_column(light.noise));
        let mean = |column: &[f32]| column.iter().map(|v| f64::from(*v)).sum::<f64>() / lines.max(1) as f64;
        let means: Vec<f64> = values.chunks_exact(lines.max(1)).map(mean).collect();
        let noises = match noise.is_empty() {
            true => vec![0.0; means.len()],
            false => noise.chunks_exact(lines.max(1)).map(square).collect(),
        };
        Self { lines, dimensions, means, noises, values, noise, noise_rows: light.noise.to_vec(), mixtures }
    }

    /// What a vector over the dimensions has along the columns.
    fn of_columns(&self, along: &[f32]) -> Vec<f32> {
        match &self.mixtures {
            None => along.to_vec(),
            Some(mixtures) => {
                mixtures.chunks_exact(self.dimensions).map(|mixture| mixed(along, mixture) as f32).collect()
            }
        }
    }

    /// Removes an image: `along` is what each dimension has of it, `values` one value for each line.
    pub fn remove(&mut self, along: &[f32], values: &[f32]) {
        let of_columns = self.of_columns(along);
        take(&mut self.values, &of_columns, values);
    }

    /// Removes the noise along a vector of the weighted dimensions.
    pub fn remove_noise(&mut self, vector: &[f64], weights: &[f64]) {
        if self.noise.is_empty() {
            return;
        }
        let into: Vec<f64> = vector.iter().zip(weights).map(|(v, w)| v * w).collect();
        let values: Vec<f32> = project(&self.noise_rows, &into).map(|value| value as f32).collect();
        let along = |(v, w): (&f64, &f64)| if *w > 0.0 { (v / w) as f32 } else { 0.0 };
        let along: Vec<f32> = vector.iter().zip(weights).map(along).collect();
        let of_columns = self.of_columns(&along);
        take(&mut self.noise, &of_columns, &values);
    }

    /// How far the columns are from their description.
    pub fn state(&self, tolerance: f64) -> State {
        let mut out = State { within: true, ..State::default() };
        let allowed = tolerance * tolerance;
        let texels = (self.lines as f64 / 3.0).max(1.0);
        let lines = self.lines.max(1);
        let (mut noise, mut light) = (0.0, 0.0);
        let mut of_noise = self.noise.chunks_exact(lines);
        let dark = DARK * self.means.iter().copied().fold(0.0, f64::max);
        for (number, column) in self.values.chunks_exact(lines).enumerate() {
            let left = of_noise.next().map_or(0.0, square);
            if self.means[number] <= dark {
                continue;
            }
            let scale = inverse(self.means[number]).powi(2);
            let error = square(column) - left;
            // The variance of a product of the halves' rests is the square of twice their noise; a texel's colours have the same noise.
            let doubt = 2.0 * left / texels.sqrt();
            let [error, doubt] = [error, doubt].map(|value| value * scale);
            if doubt > allowed {
                out.hidden += 1;
                out.within &= error <= allowed + doubt;
            } else {
                if error > out.worst * out.worst {
                    (out.worst, out.column) = (error.sqrt(), number);
                }
                out.within &= error <= allowed;
            }
            noise += (self.noises[number] - left).max(0.0);
            light += self.means[number].powi(2);
        }
        if light > 0.0 {
            out.noise = (noise / light).sqrt();
        }
        out
    }
}

/// The mean of the light that some images leave out, in red, green and blue of each dimension. An image: what each dimension has of it, and a value
/// for each line.
pub(super) fn left_out(light: Measured<'_>, images: &[(&[f32], &[f32])]) -> Vec<[f64; 3]> {
    let dimensions = light.dimensions.max(1);
    let texels = (light.lines() / 3).max(1) as f64;
    let mut left = vec![[0.0f64; 3]; dimensions];
    for (line, row) in light.rows.chunks_exact(dimensions).enumerate() {
        left.iter_mut().zip(row).for_each(|(left, value)| left[line % 3] += f64::from(*value) / texels);
    }
    for (along, values) in images {
        let mut sums = [0.0f64; 3];
        values.iter().enumerate().for_each(|(line, value)| sums[line % 3] += f64::from(*value) / texels);
        for (left, along) in left.iter_mut().zip(*along) {
            left.iter_mut().zip(sums).for_each(|(left, sum)| *left -= f64::from(*along) * sum);
        }
    }
    left
}

/// The mean light that some images leave out, as one more image: the same value at each texel, and a coefficient for each dimension. Where noise
/// hides the light, images that describe it are not found, but its mean over the tile is known, and no energy may be lost. `None`: all
/// columns have their mean within the tolerance.
pub(super) fn level(
    light: Measured<'_>,
    columns: Columns<'_>,
    images: &[(&[f32], &[f32])],
    tolerance: f64,
) -> Option<([f32; 3], Vec<f64>)> {
    let dimensions = light.dimensions.max(1);
    let left = left_out(light, images);
    let means: Vec<f64> = left_out(light, &[]).iter().map(|channels| channels.iter().sum::<f64>() / 3.0).collect();
    let grey: Vec<f64> = left.iter().map(|channels| channels.iter().sum::<f64>() / 3.0).collect();
    let dark = DARK * means.iter().copied().fold(0.0, f64::max);
    let off = |missing: f64, mean: f64| mean > dark && missing.abs() > 0.5 * tolerance * mean;
    let wrong = match columns {
        Columns::Dimensions => grey.iter().zip(&means).any(|(missing, mean)| off(*missing, *mean)),
        Columns::Mixtures(mixtures) => mixtures.chunks_exact(dimensions).any(|mixture| {
            let of = |values: &[f64]| values.iter().zip(mixture).map(|(v, m)| v * f64::from(*m)).sum::<f64>();
            off(of(&grey), of(&means))
        }),
    };
    // The colour of what is missing, by its size.
    let mut colour = [0.0f64; 3];
    for (left, (missing, mean)) in left.iter().zip(grey.iter().zip(&means)) {
        let weight = missing.signum() * inverse(*mean);
        colour.iter_mut().zip(left).for_each(|(colour, left)| *colour += weight * left);
    }
    let largest = colour.iter().fold(0.0f64, |most, value| most.max(value.abs()));
    if !wrong || largest == 0.0 {
        return None;
    }
    let colour = colour.map(|value| value.max(0.0) / largest);
    // The sum of the colours is kept exactly.
    let sum = colour.iter().sum::<f64>().max(1e-30);
    let along = left.iter().map(|left| left.iter().sum::<f64>() / sum);
    Some((colour.map(|value| value as f32), along.collect()))
}

fn take(values: &mut [f32], of_columns: &[f32], image: &[f32]) {
    for (column, along) in values.chunks_exact_mut(image.len().max(1)).zip(of_columns) {
        column.iter_mut().zip(image).for_each(|(value, decoded)| *value -= along * decoded);
    }
}

/// The mean square.
fn square(column: &[f32]) -> f64 {
    column.iter().map(|v| f64::from(*v) * f64::from(*v)).sum::<f64>() / column.len().max(1) as f64
}

fn inverse(mean: f64) -> f64 {
    if mean > 0.0 && mean.is_finite() { 1.0 / mean } else { 0.0 }
}

/// A mixture of a row's dimensions.
pub(super) fn mixed(row: &[f32], mixture: &[f32]) -> f64 {
    row.iter().zip(mixture).map(|(value, weight)| f64::from(*value) * f64::from(*weight)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::techniques::daylight::layer::{Aim, Layer};

    const TIMES: usize = 40;
    const TEXELS: usize = 500;

    /// Even numbers in [-1, 1).
    fn even(seed: u32) -> impl FnMut() -> f32 {
        let mut state = u64::from(seed) * 2 + 1;
        move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f32 / (1u64 << 23) as f32 - 1.0
        }
    }

    /// Light of rank 3, dim at both ends of the day; and its two halves with independent noise of this size, relative to the mean of each time.
    fn halves(noise: f32) -> (Vec<f32>, Vec<f32>, Vec<f32>) {
        let mut next = even(7);
        let (mut truth, mut rows, mut noises) = (Vec::new(), Vec::new(), Vec::new());
        for line in 0..3 * TEXELS {
            let place = line as f32 / 300.0;
            for t in 0..TIMES {
                let x = (t as f32 + 0.5) / TIMES as f32;
                let day = (std::f32::consts::PI * x).sin().powi(2);
                let light = day * (2.0 + (3.0 * x + place).sin() + 0.5 * (7.0 * place).cos() * (6.0 * x).cos());
                // Noise of one half: even numbers of this range have a variance of a third.
                let [a, b] = [(); 2].map(|()| 3f32.sqrt() * noise * 2.0 * day * 2f32.sqrt() * next());
                truth.push(light);
                rows.push(light + 0.5 * (a + b));
                noises.push(0.5 * (a - b));
            }
        }
        (truth, rows, noises)
    }

    fn error(layer: &Layer, truth: &[f32]) -> f64 {
        (0..TIMES)
            .map(|t| {
                let coefficients = layer.mix([(t, [1.0; 3])].into_iter());
                let (mut square, mut mean) = (0.0, 0.0);
                for texel in 0..TEXELS {
                    for (channel, decoded) in layer.decode(texel, &coefficients).into_iter().enumerate() {
                        let light = f64::from(truth[(3 * texel + channel) * TIMES + t]);
                        square += (f64::from(decoded) - light).powi(2);
                        mean += light;
                    }
                }
                let lines = 3.0 * TEXELS as f64;
                (square / lines).sqrt() / (mean / lines)
            })
            .fold(0.0, f64::max)
    }

    #[test]
    fn noise_needs_no_images_and_the_light_without_it_is_within_the_tolerance() {
        let aim = Aim { tolerance: 0.05, most: TIMES };
        for noise in [0.02, 0.1, 0.2] {
            let (truth, rows, noises) = halves(noise);
            let light = Measured { dimensions: TIMES, rows: &rows, noise: &noises };
            let layer = Layer::compress(light, Columns::Dimensions, aim).unwrap();
            assert!(layer.images() <= 4, "noise {noise}: {} images", layer.images());
            // Three vectors of forty keep about a thirteenth of the noise's variance.
            let found = error(&layer, &truth);
            assert!(found < 0.05 + 0.4 * f64::from(noise), "noise {noise}: {found}");
            let kept = f64::from(layer.noise);
            assert!(kept > 0.1 * f64::from(noise) && kept < 0.6 * f64::from(noise), "noise {noise}: {kept} kept");
            // If the noise counts as light, it needs images.
            let light = Measured { noise: &[], ..light };
            let with_noise = Layer::compress(light, Columns::Dimensions, aim).unwrap();
            assert!(f64::from(with_noise.worst) <= 0.05 && with_noise.noise == 0.0 && with_noise.hidden == 0);
            assert_eq!(with_noise.images() > 20, noise > 0.05, "noise {noise}: {} images", with_noise.images());
        }
    }

    #[test]
    fn columns_whose_noise_hides_the_tolerance_are_counted() {
        let (_, rows, noises) = halves(1.5);
        let light = Measured { dimensions: TIMES, rows: &rows, noise: &noises };
        let aim = Aim { tolerance: 0.02, most: TIMES };
        let layer = Layer::compress(light, Columns::Dimensions, aim).unwrap();
        assert!(layer.hidden as usize > TIMES / 2, "{} hidden", layer.hidden);
        assert!(layer.images() < 10, "{}", layer.images());
        // Each column keeps its mean.
        for t in 0..TIMES {
            let coefficients = layer.mix([(t, [1.0; 3])].into_iter());
            let sums = |texel: usize| layer.decode(texel, &coefficients).into_iter().sum::<f32>();
            let found: f64 = (0..TEXELS).map(|texel| f64::from(sums(texel))).sum();
            let wanted: f64 = rows.iter().skip(t).step_by(TIMES).map(|value| f64::from(*value)).sum();
            assert!((found / wanted - 1.0).abs() < 0.002, "{t}: {found} {wanted}");
        }
    }

    #[test]
    fn tiny_parts_of_a_mixture_have_finite_coefficients() {
        let rows: Vec<f32> = (0..60).map(|i| 1.0 + (i % 7) as f32).collect();
        let mixture = [1.0f32, 1e-30, 0.5, 1e-38];
        let light = Measured { dimensions: 4, rows: &rows, noise: &[] };
        let layer = Layer::compress(light, Columns::Mixtures(&mixture), Aim { tolerance: 0.001, most: 4 }).unwrap();
        layer.validate(5, 4).unwrap();
    }
}

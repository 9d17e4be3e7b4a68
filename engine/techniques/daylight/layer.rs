//! One kind of light of a tile, compressed: images that belong to vectors over the dimensions (times of the day, or patches of the sky).
//!
//! A tile's light is a matrix with a row for each texel and colour and a column for each dimension. Its principal components around zero give
//! the vectors, so that no light stays exactly no light. The number of images rises until every column, decoded from the stored bits, is
//! within the tolerance: a guarantee for the worst moment of the day instead of a share of variance. Images that would hold only noise are
//! not made ([`super::columns`]).

use half::f16;

use super::columns::{Columns, Measured, Rest, Weighted, left_out, level, project};
use crate::{Error, Result};

/// Largest part of the tolerance that the rounding of one image to bytes may take.
const ROUNDING: f64 = 1.0 / 16.0;

/// Light of a tile for some dimensions.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// Columns of the table.
    pub dimensions: u32,
    /// Images of 16-bit floats; they come first.
    pub wide: u32,
    /// Images of signed bytes.
    pub narrow: u32,
    /// Coefficients: for each image one number for each dimension. The scale of the image's values is part of them. Files have 24 bits of them
    /// ([`rounded`]).
    pub table: Vec<f32>,
    /// For each texel the values of all images, three each; rows are filled up to whole words.
    pub words: Vec<u32>,
    /// Root mean square of the error of the worst column whose noise does not hide it, relative to the column's mean.
    pub worst: f32,
    /// The worst column.
    pub worst_dimension: u32,
    /// Number of columns whose noise hides errors as large as the tolerance: the images describe of them what is certain.
    pub hidden: u32,
    /// Root mean square of the noise that the images hold in all columns, relative to their light; 0 if it is unknown.
    pub noise: f32,
}

/// What decides the size of a layer.
#[derive(Clone, Copy, Debug)]
pub struct Aim {
    /// Root mean square of the error of a column, relative to its mean.
    pub tolerance: f64,
    /// Images at most.
    pub most: usize,
}

impl Layer {
    /// Number of images.
    pub fn images(&self) -> u32 {
        self.wide + self.narrow
    }

    /// Words of one texel.
    pub fn stride(wide: u32, narrow: u32) -> u32 {
        (6 * wide + 3 * narrow).div_ceil(4)
    }

    /// Bytes in files.
    pub fn bytes(&self) -> u64 {
        3 * self.table.len() as u64 + 4 * self.words.len() as u64
    }

    /// Compresses the light of a tile: three rows (red, green, blue) for each texel. If the noise is known, the tolerance is for the light
    /// without it, and noise is no reason for an image.
    ///
    /// # Errors
    /// `Runtime` if the decomposition does not converge, or if a value is not finite.
    pub fn compress(light: Measured<'_>, columns: Columns<'_>, aim: Aim) -> Result<Self> {
        let Measured { dimensions, rows, .. } = light;
        let texels = rows.len() / dimensions.max(1) / 3;
        let none = Self {
            dimensions: dimensions as u32,
            wide: 0,
            narrow: 0,
            table: Vec::new(),
            words: Vec::new(),
            worst: 0.0,
            worst_dimension: 0,
            hidden: 0,
            noise: 0.0,
        };
        let weights = columns.weights(light);
        if texels == 0 || weights.iter().all(|w| *w == 0.0) {
            return Ok(none);
        }
        let Weighted { scaled, basis } = Weighted::new(light, &weights, aim.most)?;
        let mut rest = Rest::new(light, columns);
        let mut images: Vec<Image> = Vec::new();
        let mut state = rest.state(aim.tolerance);
        for index in 0..basis.len() {
            if state.within {
                keep_means(&mut images, &mut rest, light);
                state = rest.state(aim.tolerance);
                if state.within {
                    break;
                }
            }
            let vector = basis.vector(index);
            // In units of light: what a dimension has at a coefficient of 1. Dimensions without light stay without.
            let along: Vec<f64> =
                vector.iter().zip(&weights).map(|(v, w)| if *w > 0.0 { v / w } else { 0.0 }).collect();
            let values: Vec<f32> = project(&scaled, vector).map(|value| value as f32).collect();
            let image = Image::new(&values, along, vector, aim, images.last().is_none_or(|i| i.wide));
            rest.remove(&image.table, &image.decoded);
            rest.remove_noise(vector, &weights);
            images.push(image);
            state = rest.state(aim.tolerance);
        }
        // Where noise ended the images before the tolerance was reached, the mean is known all the same.
        keep_means(&mut images, &mut rest, light);
        state = rest.state(aim.tolerance);
        if let Some((colour, along)) = level(light, columns, &known(&images), aim.tolerance)
            && images.len() < aim.most
        {
            let values: Vec<f32> = colour.iter().copied().cycle().take(3 * texels).collect();
            // Bytes hold a colour well enough.
            let image = Image::new(&values, along, &[], aim, false);
            rest.remove(&image.table, &image.decoded);
            images.push(image);
            state = rest.state(aim.tolerance);
        }
        let wide = images.iter().filter(|i| i.wide).count() as u32;
        let narrow = images.len() as u32 - wide;
        let stride = Self::stride(wide, narrow) as usize;
        let mut words = vec![0u32; texels * stride];
        for (texel, row) in words.chunks_exact_mut(stride.max(1)).enumerate().take(if stride == 0 { 0 } else { texels })
        {
            let mut bytes = Vec::with_capacity(4 * stride);
            for image in &images {
                for channel in 0..3 {
                    let code = image.codes[3 * texel + channel];
                    match image.wide {
                        true => bytes.extend_from_slice(&(code as u16).to_le_bytes()),
                        false => bytes.push(code as u8),
                    }
                }
            }
            bytes.resize(4 * stride, 0);
            for (word, bytes) in row.iter_mut().zip(bytes.chunks_exact(4)) {
                *word = u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
            }
        }
        let table = images.iter().flat_map(|i| i.table.iter().copied()).collect();
        Ok(Self {
            wide,
            narrow,
            table,
            words,
            worst: state.worst as f32,
            worst_dimension: state.column as u32,
            hidden: state.hidden as u32,
            noise: state.noise as f32,
            ..none
        })
    }

    /// The light of a texel for given coefficients of the images: three values for each image ([`Self::mix`]).
    pub fn decode(&self, texel: usize, coefficients: &[[f32; 3]]) -> [f32; 3] {
        let stride = Self::stride(self.wide, self.narrow) as usize;
        let Some(words) = self.words.get(texel * stride..(texel + 1) * stride) else { return [0.0; 3] };
        let byte = |at: usize| (words[at / 4] >> (8 * (at % 4))) as u8;
        let mut sum = [0.0; 3];
        for (index, coefficients) in coefficients.iter().take(self.images() as usize).enumerate() {
            let wide = index < self.wide as usize;
            for (channel, sum) in sum.iter_mut().enumerate() {
                let value = if wide {
                    let at = 6 * index + 2 * channel;
                    f16::from_le_bytes([byte(at), byte(at + 1)]).to_f32()
                } else {
                    let at = 6 * self.wide as usize + 3 * (index - self.wide as usize) + channel;
                    f32::from(byte(at) as i8)
                };
                *sum += value * coefficients[channel];
            }
        }
        sum
    }

    /// Coefficients of all images for a mixture of the dimensions: `mixture` gives pairs of a dimension and the colour of its light.
    pub fn mix(&self, mixture: impl Iterator<Item = (usize, [f32; 3])> + Clone) -> Vec<[f32; 3]> {
        let rows = self.table.chunks_exact((self.dimensions as usize).max(1));
        rows.take(self.images() as usize)
            .map(|row| {
                let mut sum = [0.0f64; 3];
                for (dimension, colour) in mixture.clone() {
                    let along = f64::from(row.get(dimension).copied().unwrap_or(0.0));
                    sum.iter_mut().zip(colour).for_each(|(sum, colour)| *sum += along * f64::from(colour));
                }
                sum.map(|sum| sum as f32)
            })
            .collect()
    }

    /// Checks that the lists have the lengths that the numbers say, for `texels` texels.
    ///
    /// # Errors
    /// `Input`, saying what differs.
    pub fn validate(&self, texels: usize, dimensions: usize) -> Result<()> {
        let wrong = |what: String| Err(Error::input(what));
        if self.dimensions as usize != dimensions {
            return wrong(format!("a table of {} columns, {dimensions} are needed", self.dimensions));
        }
        let images = self.images() as usize;
        if images > dimensions {
            return wrong(format!("{images} images of {dimensions} dimensions"));
        }
        let words = texels * Self::stride(self.wide, self.narrow) as usize;
        if self.table.len() != images * dimensions || self.words.len() != words {
            return wrong("lists of other lengths than their numbers say".into());
        }
        if self.table.iter().any(|value| !value.is_finite()) {
            return wrong("a coefficient that is not finite".into());
        }
        Ok(())
    }
}

/// What each dimension has of images, and their values.
fn known(images: &[Image]) -> Vec<(&[f32], &[f32])> {
    images.iter().map(|image| (image.table.as_slice(), image.decoded.as_slice())).collect()
}

/// Gives the first image what the mean of each dimension misses, so that neighbouring tiles fit together where a wall is even: the error that the
/// tolerance allows would otherwise be a step at their border.
fn keep_means(images: &mut [Image], rest: &mut Rest, light: Measured<'_>) {
    let missing = left_out(light, &known(images));
    let Some(first) = images.first_mut() else { return };
    let count = first.decoded.len().max(1) as f64;
    let mean = first.decoded.iter().map(|value| f64::from(*value)).sum::<f64>() / count;
    let square = first.decoded.iter().map(|value| f64::from(*value).powi(2)).sum::<f64>() / count;
    // An image that is dark here and bright there cannot carry a mean.
    if mean * mean < 0.1 * square || square == 0.0 {
        return;
    }
    let changed: Vec<f32> = first
        .table
        .iter()
        .zip(missing.iter().map(|channels| channels.iter().sum::<f64>() / 3.0))
        .map(|(along, missing)| if *along == 0.0 { 0.0 } else { rounded((f64::from(*along) + missing / mean) as f32) })
        .collect();
    let added: Vec<f32> = changed.iter().zip(&first.table).map(|(new, old)| new - old).collect();
    rest.remove(&added, &first.decoded);
    first.table = changed;
}

/// A number of 24 bits: that of 32 bits without its last byte. Coefficients at dusk are a millionth of those at noon, which is too little for
/// numbers of 16 bits.
pub fn rounded(value: f32) -> f32 {
    let near = f32::from_bits(value.to_bits().saturating_add(0x80) & !0xff);
    if near.is_finite() { near } else { value }
}

/// An image as it is stored.
struct Image {
    wide: bool,
    /// Bits of the values, a texel's three after each other.
    codes: Vec<u32>,
    /// Values as they are decoded, without the scale.
    decoded: Vec<f32>,
    table: Vec<f32>,
}

impl Image {
    /// `may_be_wide`: all images before this one are wide.
    fn new(values: &[f32], along: Vec<f64>, vector: &[f64], aim: Aim, may_be_wide: bool) -> Self {
        let largest = values.iter().fold(0.0f32, |most, v| most.max(v.abs()));
        let steepest = vector.iter().fold(0.0f64, |most, v| most.max(v.abs()));
        let step = f64::from(largest) / 127.0;
        // The rounding error is even within a step.
        let rounding = step / 12f64.sqrt() * steepest;
        let wide = may_be_wide && rounding > ROUNDING * aim.tolerance;
        // Values of 16 bits stay near 1, where they are most precise and never too large.
        let scale = if wide { f64::from(largest).max(1e-30) } else { step.max(1e-30) };
        let table: Vec<f32> = along.iter().map(|a| rounded((a * scale) as f32)).collect();
        let (codes, decoded) = values
            .iter()
            .map(|value| {
                let value = f64::from(*value) / scale;
                if wide {
                    let half = f16::from_f64(value);
                    (u32::from(half.to_bits()), half.to_f32())
                } else {
                    let byte = value.round().clamp(-127.0, 127.0) as i8;
                    (u32::from(byte as u8), f32::from(byte))
                }
            })
            .unzip();
        Self { wide, codes, decoded, table }
    }
}

#[cfg(test)]
mod tests {
    use super::{
        super::columns::{DARK, mixed},
        *,
    };

    const AIM: Aim = Aim { tolerance: 0.05, most: 64 };

    /// Light whose noise is unknown.
    fn of(rows: &[f32], dimensions: usize) -> Measured<'_> {
        Measured { dimensions, rows, noise: &[] }
    }

    /// Rows of a known rank: smooth products of place and time, positive, and nearly dark at both ends of the day.
    fn rows(texels: usize, dimensions: usize, rank: usize) -> Vec<f32> {
        let mut rows = Vec::new();
        for line in 0..3 * texels {
            for t in 0..dimensions {
                let x = (t as f32 + 0.5) / dimensions as f32;
                let day = (std::f32::consts::PI * x).sin().powi(4);
                let of = |j: usize| {
                    let place = 1.0 + (line as f32 * 0.37 * (j as f32 + 1.0)).sin();
                    let time = 1.0 + (x * 9.0 * (j as f32 + 0.5)).cos();
                    place * time
                };
                rows.push(day * (0..rank).map(of).sum::<f32>());
            }
        }
        rows
    }

    /// The largest relative error of the columns that are not dark.
    fn errors(layer: &Layer, rows: &[f32], dimensions: usize) -> f64 {
        let texels = rows.len() / dimensions / 3;
        let means: Vec<f32> = (0..dimensions).map(|t| rows.iter().skip(t).step_by(dimensions).sum()).collect();
        let brightest = means.iter().copied().fold(0.0, f32::max);
        (0..dimensions)
            .filter(|t| f64::from(means[*t]) > DARK * f64::from(brightest))
            .map(|t| {
                let coefficients = layer.mix([(t, [1.0; 3])].into_iter());
                let (mut square, mut mean) = (0.0, 0.0);
                for texel in 0..texels {
                    let decoded = layer.decode(texel, &coefficients);
                    for (channel, decoded) in decoded.iter().enumerate() {
                        let truth = f64::from(rows[(3 * texel + channel) * dimensions + t]);
                        square += (f64::from(*decoded) - truth).powi(2);
                        mean += truth;
                    }
                }
                let count = 3.0 * texels as f64;
                if mean > 0.0 { (square / count).sqrt() / (mean / count) } else { square }
            })
            .fold(0.0, f64::max)
    }

    #[test]
    fn every_column_that_is_decoded_from_the_bits_is_within_the_tolerance() {
        for (rank, tolerance) in [(1, 0.05), (3, 0.05), (7, 0.05), (7, 0.005), (7, 0.3)] {
            let rows = rows(200, 60, rank);
            let layer = Layer::compress(of(&rows, 60), Columns::Dimensions, Aim { tolerance, ..AIM }).unwrap();
            layer.validate(200, 60).unwrap();
            let worst = errors(&layer, &rows, 60);
            assert!(worst <= tolerance && (worst - f64::from(layer.worst)).abs() < 1e-3, "{worst} {}", layer.worst);
            assert!(layer.images() as usize <= rank + 1, "{} images for rank {rank}", layer.images());
            // The images before the last one were not enough.
            if layer.images() > 1 {
                let fewer = Aim { tolerance, most: layer.images() as usize - 1 };
                assert!(
                    f64::from(Layer::compress(of(&rows, 60), Columns::Dimensions, fewer).unwrap().worst) > tolerance
                );
            }
        }
    }

    #[test]
    fn no_light_is_no_image_and_dark_columns_stay_dark() {
        let none = Layer::compress(of(&[0.0; 3 * 5 * 7], 7), Columns::Dimensions, AIM).unwrap();
        assert_eq!((none.images(), none.bytes()), (0, 0));
        assert_eq!(none.decode(3, &none.mix([(2, [1.0; 3])].into_iter())), [0.0; 3]);
        let mut rows = rows(30, 10, 3);
        rows.iter_mut().skip(4).step_by(10).for_each(|v| *v = 0.0);
        let layer = Layer::compress(of(&rows, 10), Columns::Dimensions, AIM).unwrap();
        let coefficients = layer.mix([(4, [1.0; 3])].into_iter());
        assert!((0..30).all(|texel| layer.decode(texel, &coefficients) == [0.0; 3]));
        assert_eq!(Layer::compress(of(&[], 7), Columns::Dimensions, AIM).unwrap().images(), 0);
    }

    #[test]
    fn light_adds_and_scales() {
        let rows = rows(40, 20, 5);
        let layer = Layer::compress(of(&rows, 20), Columns::Dimensions, AIM).unwrap();
        let one = |t: usize, scale: f32| layer.decode(11, &layer.mix([(t, [scale; 3])].into_iter()));
        let both = layer.decode(11, &layer.mix([(3, [2.0; 3]), (9, [0.5; 3])].into_iter()));
        for (channel, both) in both.into_iter().enumerate() {
            let sum = one(3, 2.0)[channel] + one(9, 0.5)[channel];
            assert!((both - sum).abs() < 1e-4 * sum.abs());
        }
    }

    #[test]
    fn mixtures_are_within_the_tolerance() {
        let rows = rows(100, 30, 6);
        let mixtures: Vec<f32> = (0..4 * 30).map(|i| 0.1 + ((i * i) % 17) as f32).collect();
        let layer =
            Layer::compress(of(&rows, 30), Columns::Mixtures(&mixtures), Aim { tolerance: 0.01, most: 30 }).unwrap();
        for mixture in mixtures.chunks(30) {
            let coefficients = layer.mix(mixture.iter().map(|w| [*w; 3]).enumerate());
            let (mut square, mut mean) = (0.0, 0.0);
            for (at, row) in rows.chunks(30).enumerate() {
                let truth = mixed(row, mixture);
                square += (f64::from(layer.decode(at / 3, &coefficients)[at % 3]) - truth).powi(2);
                mean += truth;
            }
            let error = (square / 300.0).sqrt() / (mean / 300.0);
            assert!(error <= 0.0101, "{error}");
        }
    }

    #[test]
    fn the_same_rows_give_the_same_bits() {
        let rows = rows(50, 25, 9);
        let once = || Layer::compress(of(&rows, 25), Columns::Dimensions, AIM).unwrap();
        assert_eq!(once(), once());
    }
}

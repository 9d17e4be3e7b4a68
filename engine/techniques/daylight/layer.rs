//! One kind of light of a tile, compressed: images that belong to vectors over the dimensions (times of the day, or patches of the sky).
//!
//! A tile's light is a matrix with a row for each texel and colour and a column for each dimension. Its principal components around zero give
//! the vectors, so that no light stays exactly no light. The number of images rises until every column, decoded from the stored bits, is
//! within the tolerance: a guarantee for the worst moment of the day instead of a share of variance. Images that would hold only noise are
//! not made ([`super::columns`]).

use half::f16;

use super::blocks::Blocks;
use crate::{Error, Result};

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
    /// For each texel the values of all images that are not in blocks, three each; rows are filled up to whole words.
    pub words: Vec<u32>,
    /// Images in blocks; they come last. `None`: blocks were not allowed.
    pub blocks: Option<Blocks>,
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
        self.wide + self.narrow + self.in_blocks()
    }

    /// Number of images in blocks.
    pub fn in_blocks(&self) -> u32 {
        self.blocks.as_ref().map_or(0, Blocks::images)
    }

    /// A layer without light.
    pub fn none(dimensions: usize) -> Self {
        Self {
            dimensions: dimensions as u32,
            wide: 0,
            narrow: 0,
            table: Vec::new(),
            words: Vec::new(),
            blocks: None,
            worst: 0.0,
            worst_dimension: 0,
            hidden: 0,
            noise: 0.0,
        }
    }

    /// Words of one texel.
    pub fn stride(wide: u32, narrow: u32) -> u32 {
        (6 * wide + 3 * narrow).div_ceil(4)
    }

    /// Bytes in files.
    pub fn bytes(&self) -> u64 {
        let of_blocks = self.blocks.as_ref().map_or(0, |blocks| blocks.bytes.len() as u64);
        3 * self.table.len() as u64 + 4 * self.words.len() as u64 + of_blocks
    }

    /// The same light without blocks, for devices that cannot sample them and for files of other programs: their images become 16-bit floats, which hold
    /// all values that blocks have up to their rounding.
    pub fn without_blocks(&self) -> Self {
        let Some(blocks) = self.blocks.as_ref().filter(|blocks| blocks.images() > 0) else {
            return Self { blocks: None, ..self.clone() };
        };
        let (dimensions, wide) = (self.dimensions as usize, self.wide + blocks.images());
        let rows = |images: std::ops::Range<u32>| {
            self.table[images.start as usize * dimensions..images.end as usize * dimensions].iter().copied()
        };
        let plain = self.wide + self.narrow;
        let table = rows(0..self.wide).chain(rows(plain..self.images())).chain(rows(self.wide..plain)).collect();
        let (before, stride) =
            (Self::stride(self.wide, self.narrow) as usize, Self::stride(wide, self.narrow) as usize);
        let texels = blocks.texels();
        let mut words = Vec::with_capacity(texels * stride);
        for texel in 0..texels {
            let own: Vec<u8> =
                self.words[texel * before..(texel + 1) * before].iter().flat_map(|word| word.to_le_bytes()).collect();
            let (halves, bytes) = own.split_at(6 * self.wide as usize);
            let mut row = halves.to_vec();
            for image in 0..blocks.images() {
                row.extend(blocks.value(texel, image).into_iter().flat_map(f16::to_le_bytes));
            }
            row.extend_from_slice(&bytes[..3 * self.narrow as usize]);
            row.resize(4 * stride, 0);
            words.extend(row.as_chunks::<4>().0.iter().map(|bytes| u32::from_le_bytes(*bytes)));
        }
        Self { wide, table, words, blocks: None, ..self.clone() }
    }

    /// The light of a texel for given coefficients of the images: three values for each image ([`Self::mix`]).
    pub fn decode(&self, texel: usize, coefficients: &[[f32; 3]]) -> [f32; 3] {
        let stride = Self::stride(self.wide, self.narrow) as usize;
        let Some(words) = self.words.get(texel * stride..(texel + 1) * stride) else { return [0.0; 3] };
        let plain = (self.wide + self.narrow) as usize;
        let byte = |at: usize| (words[at / 4] >> (8 * (at % 4))) as u8;
        let mut sum = [0.0; 3];
        for (index, coefficients) in coefficients.iter().take(plain).enumerate() {
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
        if let Some(blocks) = &self.blocks {
            let coefficients = coefficients.iter().skip(plain).take(blocks.images() as usize);
            for (image, coefficients) in (0..).zip(coefficients) {
                let value = blocks.value(texel, image).map(f16::to_f32);
                (0..3).for_each(|channel| sum[channel] += value[channel] * coefficients[channel]);
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
        if self.blocks.as_ref().is_some_and(|blocks| blocks.images() > 0 && blocks.texels() != texels) {
            return wrong("blocks of another number of texels".into());
        }
        if self.table.iter().any(|value| !value.is_finite()) {
            return wrong("a coefficient that is not finite".into());
        }
        Ok(())
    }
}

/// A number of 24 bits: that of 32 bits without its last byte. Coefficients at dusk are a millionth of those at noon, which is too little for
/// numbers of 16 bits.
pub fn rounded(value: f32) -> f32 {
    let near = f32::from_bits(value.to_bits().saturating_add(0x80) & !0xff);
    if near.is_finite() { near } else { value }
}

#[cfg(test)]
mod tests {
    use super::{
        super::columns::{Columns, DARK, Measured, mixed},
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

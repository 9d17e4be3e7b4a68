//! The light of a tile between the tracing of its paths and its final compression: coefficients of its two halves of samples.
//!
//! The halves (odd and even samples) show which part of the light is noise. Principal components of what both have in common describe the light;
//! the coefficients of mean and noise are kept apart, so that the filter and the compression that follow know the noise of what they read.

use half::f16;

use super::{
    Baking, Light, Plan,
    columns::{Columns, Measured, Rest, Weighted, level, project, times},
};
use crate::{Error, Result};

/// Part of the tolerance that the coefficients may miss.
const SHARE: f64 = 0.25;
/// Vectors of a kind of light at most.
const MOST: usize = 128;

/// One kind of light of a tile: vectors over the dimensions, and coefficients of each line (a texel's red, green or blue).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Coded {
    pub dimensions: u32,
    /// Vector after vector, in units of light at a coefficient of 1.
    pub vectors: Vec<f32>,
    /// For each line the coefficients of the mean, then those of the noise. 16-bit floats.
    pub coefficients: Vec<u16>,
}

/// The surface of a texel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spot {
    /// Metres.
    pub position: [f32; 3],
    /// Unit normal of the side that receives light.
    pub normal: [f32; 3],
    /// From the centre of the texel to the position, texels: not 0 where the centre is outside of its chart. Texels of a picture have their
    /// light at their centres, and a texel that was moved because it is buried keeps the light of its place.
    pub offset: [f32; 2],
}

/// A tile of a bake as its unit keeps it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Gathered {
    /// A bit for each texel of the tile, row after row: whether it is on a surface.
    pub mask: Vec<u32>,
    /// The surface of each such texel.
    pub spots: Vec<Spot>,
    /// What the filter compares, of each such texel.
    pub features: Vec<Features>,
    /// Light of the sun, of the sky, of lamps.
    pub layers: [Coded; 3],
}

/// Parts of the day whose light is compared.
const PARTS: usize = 6;
/// Parts of the day, the sky, the lamps.
pub const FEATURES: usize = PARTS + 2;

/// Luminance of parts of a texel's light in the two halves of the samples, W/m².
pub type Features = [[f32; FEATURES]; 2];

/// The features of all texels of a tile. `parts`: the part of the day of each time.
fn features(measured: &[Measured<'_>; 3], texels: usize, parts: &[usize]) -> Vec<Features> {
    let mut out = vec![[[0.0; FEATURES]; 2]; texels];
    for (which, light) in measured.iter().enumerate() {
        let dimensions = light.dimensions;
        if dimensions == 0 || light.rows.is_empty() || light.noise.len() != light.rows.len() {
            continue;
        }
        let lines = light.rows.chunks_exact(dimensions).zip(light.noise.chunks_exact(dimensions));
        for (line, (rows, noise)) in lines.enumerate() {
            let luma = [0.2126, 0.7152, 0.0722][line % 3];
            let [a, b] = &mut out[line / 3];
            for (dimension, (mean, noise)) in rows.iter().zip(noise).enumerate() {
                let feature = match which {
                    0 => parts[dimension],
                    1 => PARTS,
                    _ => PARTS + 1,
                };
                a[feature] += luma * (mean + noise);
                b[feature] += luma * (mean - noise);
            }
        }
    }
    out
}

/// The part of the day of each time of a plan, by its place among the lit times of its day.
fn parts(plan: &Plan) -> Vec<usize> {
    let part = |time: usize| {
        let of_day = plan.of_day(plan.times[time].day());
        (time - of_day.start) * PARTS / of_day.len().max(1)
    };
    (0..plan.times.len()).map(part).collect()
}

impl Coded {
    /// Codes the light of some lines. `tolerance`: error that the final compression allows; `exact`: for the light with its noise.
    ///
    /// # Errors
    /// `Runtime` if the decomposition does not converge, or if a value is not finite.
    pub fn new(light: Measured<'_>, columns: Columns<'_>, tolerance: f64, exact: bool) -> Result<Self> {
        let all_noise = light.noise;
        let light = if exact { Measured { noise: &[], ..light } } else { light };
        let dimensions = light.dimensions;
        let none = Self { dimensions: dimensions as u32, ..Self::default() };
        let lines = light.rows.len() / dimensions.max(1);
        let weights = columns.weights(light);
        if lines == 0 || weights.iter().all(|weight| *weight == 0.0) {
            return Ok(none);
        }
        let most = if exact { light.dimensions } else { MOST };
        let Weighted { scaled, basis } = Weighted::new(light, &weights, most)?;
        let noise = times(all_noise, &weights);
        let mut rest = Rest::new(light, columns);
        let (mut vectors, mut coefficients): (Vec<f32>, Vec<[Vec<f16>; 2]>) = (Vec::new(), Vec::new());
        for index in 0..basis.len() {
            // Vectors that are no larger than those of noise alone are left out. The filter finds light that is below the noise of one tile, so
            // all larger ones are kept.
            let noise_alone = exact || basis.squares[index] <= -basis.least;
            if noise_alone && rest.state(SHARE * tolerance).within {
                break;
            }
            let vector = basis.vector(index);
            let [of_light, of_noise]: [Vec<f64>; 2] = [&scaled, &noise].map(|rows| project(rows, vector).collect());
            // Near 1, where 16-bit floats are most precise.
            let largest = of_light.iter().chain(&of_noise).fold(1e-30f64, |most, value| most.max(value.abs()));
            let unscaled = |(v, w): (&f64, &f64)| if *w > 0.0 { (v / w * largest) as f32 } else { 0.0 };
            let along: Vec<f32> = vector.iter().zip(&weights).map(unscaled).collect();
            let bits = |values: Vec<f64>| values.into_iter().map(|v| f16::from_f64(v / largest)).collect::<Vec<f16>>();
            let [of_light, of_noise] = [bits(of_light), bits(of_noise)];
            let decoded: Vec<f32> = of_light.iter().map(|value| value.to_f32()).collect();
            rest.remove(&along, &decoded);
            rest.remove_noise(vector, &weights);
            vectors.extend(along);
            coefficients.push([of_light, of_noise]);
        }
        let decoded: Vec<Vec<f32>> =
            coefficients.iter().map(|[of_light, _]| of_light.iter().map(|value| value.to_f32()).collect()).collect();
        let known: Vec<(&[f32], &[f32])> =
            vectors.chunks_exact(dimensions).zip(&decoded).map(|(along, values)| (along, values.as_slice())).collect();
        if let Some((colour, along)) = level(light, columns, &known, SHARE * tolerance) {
            vectors.extend(along.into_iter().map(|value| value as f32));
            let values = colour.iter().map(|value| f16::from_f32(*value)).cycle().take(lines).collect();
            coefficients.push([values, vec![f16::ZERO; lines]]);
        }
        let mut bits = Vec::with_capacity(2 * lines * coefficients.len());
        for line in 0..lines {
            for half in 0..2 {
                bits.extend(coefficients.iter().map(|of| of[half].get(line).map_or(0, |value: &f16| value.to_bits())));
            }
        }
        let coefficients = bits;
        Ok(Self { vectors, coefficients, ..none })
    }

    /// Number of vectors.
    pub fn len(&self) -> usize {
        self.vectors.len() / (self.dimensions as usize).max(1)
    }

    /// Whether there is no light.
    pub fn is_empty(&self) -> bool {
        self.vectors.is_empty()
    }

    /// Coefficients of a texel's mean and noise: all vectors of its red, then of its green and its blue.
    fn coefficients_of(&self, texel: usize) -> impl Iterator<Item = [f32; 2]> + '_ {
        let count = self.len();
        let first = 6 * count * texel;
        let at = move |line: usize, half: usize, index: usize| {
            let bits = self.coefficients.get(first + (2 * line + half) * count + index).copied().unwrap_or(0);
            f16::from_bits(bits).to_f32()
        };
        (0..3).flat_map(move |line| (0..count).map(move |index| [at(line, 0, index), at(line, 1, index)]))
    }

    /// Mean and noise of a texel's light: three rows each.
    pub fn restore(&self, texel: usize, mean: &mut [f32], noise: &mut [f32]) {
        mean.fill(0.0);
        noise.fill(0.0);
        let dimensions = self.dimensions as usize;
        let count = self.len();
        for (at, [of_mean, of_noise]) in self.coefficients_of(texel).enumerate() {
            let (line, index) = (at / count, at % count);
            let vector = &self.vectors[index * dimensions..][..dimensions];
            let range = line * dimensions..(line + 1) * dimensions;
            mean[range.clone()].iter_mut().zip(vector).for_each(|(sum, v)| *sum += of_mean * v);
            noise[range].iter_mut().zip(vector).for_each(|(sum, v)| *sum += of_noise * v);
        }
    }

    fn validate(&self, texels: usize, dimensions: usize) -> Result<()> {
        let wrong = |what: &str| Err(Error::input(what));
        let count = self.len();
        if self.dimensions as usize != dimensions || count * dimensions != self.vectors.len() {
            return wrong("vectors of other dimensions than the plan has");
        }
        if self.coefficients.len() != 6 * texels * count {
            return wrong("lists of other lengths than their numbers say");
        }
        let finite = self.coefficients.iter().all(|bits| f16::from_bits(*bits).is_finite());
        if !finite || self.vectors.iter().any(|value| !value.is_finite()) {
            return wrong("a number that is not finite");
        }
        Ok(())
    }
}

impl Gathered {
    /// Codes the light of a tile. `columns`: those of the three kinds of light that are within the tolerance.
    ///
    /// # Errors
    /// As [`Coded::new`].
    pub fn new(plan: &Plan, light: &Light, columns: [Columns<'_>; 3]) -> Result<Self> {
        let measured = light.measured(plan.dimensions());
        let Baking { tolerance, noise_floor, .. } = plan.settings;
        let coded = |layer: usize| Coded::new(measured[layer], columns[layer], tolerance, !noise_floor);
        let layers = [coded(0)?, coded(1)?, coded(2)?];
        let features = features(&measured, light.spots.len(), &parts(plan));
        Ok(Self { mask: light.mask.clone(), spots: light.spots.clone(), features, layers })
    }

    /// The bytes of a unit: numbers with their low byte first.
    pub fn encode(&self) -> Vec<u8> {
        let mut out = Vec::new();
        let word = |out: &mut Vec<u8>, word: usize| out.extend_from_slice(&(word as u32).to_le_bytes());
        word(&mut out, self.mask.len());
        self.mask.iter().for_each(|word| out.extend_from_slice(&word.to_le_bytes()));
        for spot in &self.spots {
            let numbers = spot.position.iter().chain(&spot.normal).chain(&spot.offset);
            numbers.for_each(|value| out.extend_from_slice(&value.to_le_bytes()));
        }
        let features = self.features.iter().flatten().flatten();
        features.for_each(|value| out.extend_from_slice(&value.to_le_bytes()));
        for layer in &self.layers {
            word(&mut out, layer.dimensions as usize);
            word(&mut out, layer.len());
            layer.vectors.iter().for_each(|value| out.extend_from_slice(&value.to_le_bytes()));
            layer.coefficients.iter().for_each(|bits| out.extend_from_slice(&bits.to_le_bytes()));
        }
        out
    }

    /// Reads the bytes of a unit for a tile of `texels` texels and layers of these dimensions.
    ///
    /// # Errors
    /// `Input` if they are not those of such a tile.
    pub fn decode(bytes: &[u8], texels: usize, dimensions: [usize; 3]) -> Result<Self> {
        let mut rest = super::units::Rest(bytes);
        let words = rest.word()? as usize;
        if words != texels.div_ceil(32) {
            return Err(Error::input(format!("a mask of {words} words for {texels} texels")));
        }
        let mask = (0..words).map(|_| rest.word()).collect::<Result<Vec<_>>>()?;
        super::units::check_mask(&mask, texels)?;
        let there: u32 = mask.iter().map(|word| word.count_ones()).sum();
        let mut spots = Vec::with_capacity(there as usize);
        for _ in 0..there {
            let mut number = || rest.float();
            let position = [number()?, number()?, number()?];
            let normal = [number()?, number()?, number()?];
            let offset = [number()?, number()?];
            if !position.iter().chain(&normal).all(|value| value.is_finite()) {
                return Err(Error::input("a surface that is not finite"));
            }
            if !offset.iter().all(|value| value.abs() <= 1.0) {
                return Err(Error::input("light from outside of its texel"));
            }
            spots.push(Spot { position, normal, offset });
        }
        let mut features = vec![[[0.0; FEATURES]; 2]; there as usize];
        for value in features.iter_mut().flatten().flatten() {
            *value = rest.float()?;
            if !value.is_finite() {
                return Err(Error::input("a luminance that is not finite"));
            }
        }
        let mut layers = [Coded::default(), Coded::default(), Coded::default()];
        for (layer, wanted) in layers.iter_mut().zip(dimensions) {
            layer.dimensions = rest.word()?;
            let count = rest.word()? as usize;
            if count > MOST.max(wanted) + 1 || layer.dimensions as usize != wanted {
                return Err(Error::input(format!("{count} vectors of {} dimensions", layer.dimensions)));
            }
            layer.vectors = (0..count * wanted).map(|_| rest.float()).collect::<Result<_>>()?;
            let halves = 6 * there as usize * count;
            layer.coefficients =
                rest.take(2 * halves)?.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect();
            layer.validate(there as usize, wanted)?;
        }
        match rest.0.is_empty() {
            true => Ok(Self { mask, spots, features, layers }),
            false => Err(Error::input("a tile with something after its end")),
        }
    }
}

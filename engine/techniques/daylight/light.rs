//! The light of the texels of a tile as it was traced, before filter and compression.

use super::{columns::Measured, gathered::Spot};

/// Light of a tile's texels that are on a surface, W/m².
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Light {
    /// Irradiance by the sun after at least one scattering, for 1 W/m² of the sun: for each texel three rows (red, green, blue) of all times.
    pub sun: Vec<f32>,
    /// The same by the odd samples alone less that by the even samples alone, halved: one standard deviation of its noise, on average.
    pub noise: Vec<f32>,
    /// Irradiance for a radiance of 1 W/(sr m²) of each patch of the sky: for each texel three rows of all patches.
    pub sky: Vec<f32>,
    /// Noise of `sky`.
    pub sky_noise: Vec<f32>,
    /// Irradiance by the lamps of each group, direct and scattered: for each texel three rows of all groups.
    pub lamps: Vec<f32>,
    /// Noise of `lamps`.
    pub lamps_noise: Vec<f32>,
    /// The surface of each texel.
    pub spots: Vec<Spot>,
    /// A bit for each texel of the tile, row after row: whether it is on a surface.
    pub mask: Vec<u32>,
}

impl Light {
    /// The light of the sun, of the sky and of lamps, with its noise. `dimensions`: [`Plan::dimensions`](super::Plan::dimensions).
    pub fn measured(&self, dimensions: [usize; 3]) -> [Measured<'_>; 3] {
        let rows = [(&self.sun, &self.noise), (&self.sky, &self.sky_noise), (&self.lamps, &self.lamps_noise)];
        let mut dimensions = dimensions.into_iter();
        rows.map(|(rows, noise)| Measured { dimensions: dimensions.next().unwrap_or(0), rows, noise })
    }
}

/// Rows of means and of noise from sums in the order of the device: for each receiver and dimension the sums of even and of odd samples.
pub(super) fn summed(sums: &[[f32; 3]], [count, dimensions, samples]: [u32; 3]) -> [Vec<f32>; 2] {
    let (count, dimensions) = (count as usize, dimensions as usize);
    let all = 1.0 / f64::from(samples);
    let (even_count, odd_count) = (samples.div_ceil(2), samples / 2);
    let mut out = [(); 2].map(|()| Vec::with_capacity(3 * count * dimensions));
    for texel in 0..count {
        let first = 2 * texel * dimensions;
        for channel in 0..3 {
            for pair in sums[first..first + 2 * dimensions].chunks_exact(2) {
                let [even, odd] = [pair[0][channel], pair[1][channel]].map(f64::from);
                let difference = odd / f64::from(odd_count.max(1)) - even / f64::from(even_count.max(1));
                out[0].push(((even + odd) * all) as f32);
                out[1].push((0.5 * difference) as f32);
            }
        }
    }
    out
}

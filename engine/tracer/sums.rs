//! The sums over samples, and the picture computed from them.

use crate::{
    image::{Layer, Layers, Precision},
    shaders::consts::PATH_SUMS,
};

/// Distance of the background in the layer `depth`, metres; the value that Blender writes.
const BACKGROUND: f32 = 1e10;
/// Added to the square of the reference in relative errors, so that black pixels do not dominate the mean.
pub const EPSILON: f64 = 0.01;

/// The sums of a picture, in the layout of `reference/path_sums.glsl`.
#[derive(Clone, Debug, PartialEq)]
pub struct Sums {
    extent: [u32; 2],
    /// One list of pixels for each image.
    layers: Vec<Vec<[f32; 4]>>,
    /// Samples of every pixel.
    samples: u64,
    /// Number of slots that have one sample more.
    begun: u64,
}

impl Sums {
    pub(super) fn new(extent: [u32; 2], layers: Vec<Vec<[f32; 4]>>, samples: u64, begun: u64) -> Self {
        Self { extent, layers, samples, begun }
    }

    pub(super) fn raw(&self) -> &[Vec<[f32; 4]>] {
        &self.layers
    }

    /// Samples of every pixel.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    pub(super) fn begun(&self) -> u64 {
        self.begun
    }

    fn pixels(&self) -> usize {
        self.extent[0] as usize * self.extent[1] as usize
    }

    /// Number of samples of a pixel.
    fn count(&self, pixel: usize) -> f64 {
        let (x, y) = (pixel as u64 % u64::from(self.extent[0]), pixel as u64 / u64::from(self.extent[0]));
        let block = y / 8 * u64::from(self.extent[0].div_ceil(8)) + x / 8;
        let slot = block * 64 + y % 8 * 8 + x % 8;
        (self.samples + u64::from(slot < self.begun)) as f64
    }

    /// A component of a sum, with its rounding error if the layer has one.
    fn sum(&self, layer: u32, pixel: usize, component: usize) -> f64 {
        let value = f64::from(self.layers[layer as usize][pixel][component]);
        match self.layers.get((layer + PATH_SUMS) as usize) {
            Some(rest) => value + f64::from(rest[pixel][component]),
            None => value,
        }
    }

    fn mean(&self, layer: u32, pixel: usize) -> [f64; 3] {
        let count = self.count(pixel).max(1.0);
        [0, 1, 2].map(|c| self.sum(layer, pixel, c) / count)
    }

    /// Variance of a pixel's mean luminance, and the mean luminance.
    fn variance(&self, pixel: usize) -> (f64, f64) {
        let n = self.count(pixel);
        let mean = self.sum(0, pixel, 3) / n.max(1.0);
        if n < 2.0 {
            return (0.0, mean);
        }
        let spread = (self.sum(1, pixel, 3) / n - mean * mean).max(0.0);
        (spread / (n - 1.0), mean)
    }

    /// Estimate of the relative mean squared error of luminance: the mean of variance / (luminance² + 0.01).
    /// Infinite below two samples.
    pub fn relative_error(&self) -> f64 {
        if self.samples < 2 {
            return f64::INFINITY;
        }
        let each = |(variance, mean): (f64, f64)| variance / (mean * mean + EPSILON);
        (0..self.pixels()).map(|pixel| each(self.variance(pixel))).sum::<f64>() / self.pixels() as f64
    }

    /// Number of samples left out because they were not finite. Any such sample is a bug.
    pub fn lost(&self) -> u64 {
        self.layers[4].iter().map(|p| f64::from(p[3])).sum::<f64>() as u64
    }

    /// The picture: radiance in W/(sr·m²), 32 bits per channel.
    ///
    /// | layer | channels | contents |
    /// |---|---|---|
    /// | (unnamed) | R G B | total: emission + direct + indirect |
    /// | `direct` | R G B | radiance after one scattering |
    /// | `indirect` | R G B | radiance after more than one scattering |
    /// | `emission` | R G B | emitted radiance, seen directly or in mirrors and glass; the background |
    /// | `albedo` | R G B | (1 − metallic) · base colour of the first surface |
    /// | `normal` | X Y Z | unit shading normal of the first surface, world space; 0 for the background |
    /// | `position` | X Y Z | metres, world space |
    /// | `depth` | Z | metres along the view axis; 1e10 for the background |
    /// | `samples` | Y | number of paths of the pixel |
    /// | `variance` | Y | variance of the mean luminance of the total |
    pub fn layers(&self) -> Layers {
        let all = 0..self.pixels();
        let color =
            |layer: u32| -> Vec<f32> { all.clone().flat_map(|i| self.mean(layer, i).map(|v| v as f32)).collect() };
        let total = all
            .clone()
            .flat_map(|i| {
                let [a, b, c] = [0, 1, 2].map(|layer| self.mean(layer, i));
                [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) as f32)
            })
            .collect();
        let met = |i: usize| self.sum(2, i, 3);
        let normal = all.clone().flat_map(|i| {
            let n = glam::DVec3::from_array([0, 1, 2].map(|c| self.sum(4, i, c)));
            n.normalize_or_zero().as_vec3().to_array()
        });
        let position = all.clone().flat_map(|i| [0, 1, 2].map(|c| (self.sum(5, i, c) / met(i).max(1.0)) as f32));
        let depth = all.clone().map(|i| if met(i) > 0.0 { (self.sum(3, i, 3) / met(i)) as f32 } else { BACKGROUND });
        let full = |name: &str, channels: &[&str], data: Vec<f32>| Layer {
            precision: Precision::Full,
            ..Layer::new(name, channels, data)
        };
        const RGB: &[&str] = &["R", "G", "B"];
        Layers::new(self.extent[0], self.extent[1])
            .with(full("", RGB, total))
            .with(full("direct", RGB, color(1)))
            .with(full("indirect", RGB, color(2)))
            .with(full("emission", RGB, color(0)))
            .with(full("albedo", RGB, color(3)))
            .with(full("normal", &["X", "Y", "Z"], normal.collect()))
            .with(full("position", &["X", "Y", "Z"], position.collect()))
            .with(full("depth", &["Z"], depth.collect()))
            .with(full("samples", &["Y"], all.clone().map(|i| self.count(i) as f32).collect()))
            .with(full("variance", &["Y"], all.map(|i| self.variance(i).0 as f32).collect()))
    }
}

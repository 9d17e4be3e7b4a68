//! Maps: one value a pixel on a scale that is fixed before the images are seen.

use crate::image::{Layer, Layers, Precision};

/// Where in the picture a measure is bad.
#[derive(Clone, PartialEq)]
pub struct Map {
    pub width: u32,
    pub height: u32,
    /// `width · height` values, top row first.
    pub values: Vec<f32>,
    /// The values that the darkest and the brightest colour of the picture of the map stand for. The same for every pair, or
    /// chosen by the reference alone, so that maps can be compared.
    pub range: [f32; 2],
    /// What a value is.
    pub meaning: &'static str,
}

impl std::fmt::Debug for Map {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Map({}×{}, {} in {:?})", self.width, self.height, self.meaning, self.range)
    }
}

impl Map {
    /// The numbers, as a layer of one channel.
    pub fn layers(&self) -> Layers {
        let layer = Layer { precision: Precision::Full, ..Layer::new("", &["Y"], self.values.clone()) };
        Layers::new(self.width, self.height).with(layer)
    }

    /// The picture: magma over [`range`](Self::range), as linear colours that a PNG file encodes back.
    pub fn picture(&self) -> Layers {
        let [low, high] = self.range;
        let span = if high > low { high - low } else { 1.0 };
        let data =
            self.values.iter().flat_map(|v| magma((v - low) / span).map(crate::image::srgb::decode_u8)).collect();
        Layers::rgb(self.width, self.height, data)
    }

    /// The value below which the share `q` (0 to 1) of the pixels lies; 0.5 is the median.
    pub fn quantile(&self, q: f64) -> f32 {
        let mut sorted = self.values.clone();
        let last = sorted.len().saturating_sub(1);
        let at = ((last as f64 * q.clamp(0.0, 1.0)).round() as usize).min(last);
        if sorted.is_empty() { f32::NAN } else { *sorted.select_nth_unstable_by(at, f32::total_cmp).1 }
    }
}

/// 17 colours of matplotlib's magma (CC0), from 0 to 1; between them the codes are interpolated, which stays within 3 codes of the
/// table of 256.
const MAGMA: [[u8; 3]; 17] = [
    [0, 0, 4],
    [10, 8, 34],
    [29, 17, 70],
    [54, 16, 106],
    [80, 18, 124],
    [105, 28, 129],
    [130, 38, 129],
    [156, 46, 127],
    [182, 55, 121],
    [207, 65, 112],
    [230, 81, 99],
    [245, 105, 92],
    [251, 135, 97],
    [254, 165, 113],
    [254, 195, 135],
    [253, 224, 162],
    [252, 253, 191],
];

/// The 8-bit sRGB colour of a value in [0, 1]; values outside are clamped, NaN is the colour of 0.
pub fn magma(value: f32) -> [u8; 3] {
    let at = if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0) } * 16.0;
    let low = (at as usize).min(15);
    let t = at - low as f32;
    std::array::from_fn(|c| {
        let (a, b) = (f32::from(MAGMA[low][c]), f32::from(MAGMA[low + 1][c]));
        (a + (b - a) * t + 0.5) as u8
    })
}

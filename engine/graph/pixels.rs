//! Pixels read back from an image, and their values as floats.

use half::f16;

use super::format::{Extent, Format};
use crate::image::srgb;

/// Pixels of one level of an image: rows from the top, layer after layer, slice after slice.
#[derive(Clone, Debug, PartialEq)]
pub struct Pixels {
    pub name: String,
    pub extent: Extent,
    pub format: Format,
    /// Layers, or slices of a volume.
    pub layers: u32,
    /// As stored, tightly packed; depth without stencil.
    pub bytes: Vec<u8>,
}

/// An unsigned float of five exponent bits and `mantissa` mantissa bits.
fn small_float(bits: u32, mantissa: u32) -> f32 {
    f16::from_bits((bits << (10 - mantissa)) as u16).to_f32()
}

impl Pixels {
    /// The values of all pixels as a shader would sample them. Channels that the format lacks are 0, alpha 1.
    pub fn to_f32(&self) -> Vec<[f32; 4]> {
        let size = self.format.bytes() as usize;
        if size == 0 {
            return Vec::new();
        }
        if self.format == Format::RGBA32F {
            return bytemuck::pod_collect_to_vec(&self.bytes[..self.bytes.len() / size * size]);
        }
        self.bytes.chunks_exact(size).map(|p| decode(self.format, p)).collect()
    }

    /// The pixel at column `x`, row `y` of `layer`.
    pub fn at(&self, x: u32, y: u32, layer: u32) -> Option<[f32; 4]> {
        let Extent { width, height } = self.extent;
        if x >= width || y >= height || layer >= self.layers {
            return None;
        }
        let size = self.format.bytes() as usize;
        let index = (layer as usize * height as usize + y as usize) * width as usize + x as usize;
        self.bytes.get(index * size..(index + 1) * size).filter(|p| !p.is_empty()).map(|p| decode(self.format, p))
    }
}

fn decode(format: Format, pixel: &[u8]) -> [f32; 4] {
    let half = |i: usize| u16::from_le_bytes([pixel[2 * i], pixel[2 * i + 1]]);
    let word = |i: usize| u32::from_le_bytes([pixel[4 * i], pixel[4 * i + 1], pixel[4 * i + 2], pixel[4 * i + 3]]);
    let mut out = [0.0, 0.0, 0.0, 1.0];
    let channels = format.channels() as usize;
    let mut fill = |value: &dyn Fn(usize) -> f32| (0..channels).for_each(|c| out[c] = value(c));
    use Format::*;
    match format {
        R8 | RG8 | RGBA8 | BGRA8 => fill(&|c| f32::from(pixel[c]) / 255.0),
        RGBA8Srgb | BGRA8Srgb => {
            fill(&|c| if c < 3 { srgb::decode_u8(pixel[c]) } else { f32::from(pixel[c]) / 255.0 });
        }
        R8U | RGBA8U => fill(&|c| f32::from(pixel[c])),
        R16 | RG16 | RGBA16 => fill(&|c| f32::from(half(c)) / 65535.0),
        R16F | RG16F | RGBA16F => fill(&|c| f16::from_bits(half(c)).to_f32()),
        R16U | RG16U | RGBA16U => fill(&|c| f32::from(half(c))),
        R32F | RG32F | RGBA32F | D32F | D32S8 => fill(&|c| f32::from_bits(word(c))),
        R32U | RG32U | RGBA32U => fill(&|c| word(c) as f32),
        R32I | RG32I | RGBA32I => fill(&|c| word(c) as i32 as f32),
        D24S8 => fill(&|_| (word(0) & 0xFF_FFFF) as f32 / 16_777_215.0),
        R11G11B10F => {
            let v = word(0);
            out = [small_float(v & 0x7FF, 6), small_float(v >> 11 & 0x7FF, 6), small_float(v >> 22, 5), 1.0];
        }
        RGB10A2 => {
            let v = word(0);
            let ten = |shift: u32| (v >> shift & 0x3FF) as f32 / 1023.0;
            out = [ten(0), ten(10), ten(20), (v >> 30) as f32 / 3.0];
        }
        Raw(_) => {}
    }
    if matches!(format, BGRA8 | BGRA8Srgb) {
        out.swap(0, 2);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one(format: Format, bytes: &[u8]) -> [f32; 4] {
        let pixels = Pixels { name: "x".into(), extent: Extent::square(1), format, layers: 1, bytes: bytes.to_vec() };
        assert_eq!(pixels.to_f32()[0], pixels.at(0, 0, 0).unwrap());
        assert!(pixels.at(1, 0, 0).is_none() && pixels.at(0, 0, 1).is_none());
        pixels.to_f32()[0]
    }

    #[test]
    fn formats_decode_to_what_a_shader_samples() {
        assert_eq!(one(Format::RGBA8, &[255, 0, 51, 255]), [1.0, 0.0, 0.2, 1.0]);
        assert_eq!(one(Format::BGRA8, &[255, 0, 51, 255]), [0.2, 0.0, 1.0, 1.0]);
        assert_eq!(one(Format::RG16F, &[0x00, 0x3C, 0x00, 0xC0]), [1.0, -2.0, 0.0, 1.0]);
        assert_eq!(one(Format::R32I, &(-7i32).to_le_bytes()), [-7.0, 0.0, 0.0, 1.0]);
        assert_eq!(one(Format::D24S8, &[0xFF, 0xFF, 0xFF, 0x12]), [1.0, 0.0, 0.0, 1.0]);
        // 1.0 has exponent 15 and mantissa 0 in each of the three small floats.
        let packed: u32 = 15 << 6 | (15 << 6) << 11 | (15 << 5) << 22;
        assert_eq!(one(Format::R11G11B10F, &packed.to_le_bytes()), [1.0, 1.0, 1.0, 1.0]);
        assert_eq!(one(Format::RGB10A2, &(1023u32 | 3 << 30).to_le_bytes()), [1.0, 0.0, 0.0, 1.0]);
        let middle = one(Format::RGBA8Srgb, &[188, 0, 0, 128]);
        assert!((middle[0] - 0.502_886).abs() < 1e-5 && middle[3] == 128.0 / 255.0, "{middle:?}");
    }
}

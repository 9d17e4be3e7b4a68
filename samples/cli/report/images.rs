//! Images in a page, with their linear values.
//!
//! Values are stored as 16-bit floats with 8 significant bits (relative steps below 0.4 %): first all high bytes, then all low bytes, each as
//! the difference from its left neighbour, deflated. The page unpacks them, so that exposure, difference and the values under the cursor use
//! radiance and not screen values.

use std::io::Write;

use flate2::{Compression, write::ZlibEncoder};
use half::f16;
use lucerna::{Error, ErrorKind, Result};

/// Bits of the 10-bit significand that are stored.
const KEPT_BITS: u32 = 7;

/// One image.
#[derive(Clone, Debug)]
pub struct Image {
    pub name: String,
    /// Linear Rec. 709, row by row, the top row first.
    pub pixels: Vec<[f32; 3]>,
}

/// Images of one size for comparison: the page flips, splits and subtracts them.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// Unique within the page.
    pub id: String,
    pub caption: String,
    pub width: u32,
    pub height: u32,
    pub images: Vec<Image>,
    /// Initial exposure, EV: the page multiplies values by 2^EV.
    pub exposure: f64,
    /// Meaning of the values, for the caption.
    pub values: &'static str,
    /// Number of times that each side was halved ([`Comparison::at_most`]).
    halved: u32,
}

impl Comparison {
    pub fn new(id: impl Into<String>, caption: impl Into<String>, width: u32, height: u32) -> Self {
        let (id, caption) = (id.into(), caption.into());
        let values = "linear radiance, W/(sr·m²)";
        Self { id, caption, width, height, images: Vec::new(), exposure: 0.0, values, halved: 0 }
    }

    /// Adds an image. Ignores it if it has another size.
    #[must_use]
    pub fn with(mut self, name: impl Into<String>, pixels: Vec<[f32; 3]>) -> Self {
        if pixels.len() == self.width as usize * self.height as usize {
            self.images.push(Image { name: name.into(), pixels });
        }
        self
    }

    /// Sets the initial exposure, EV.
    #[must_use]
    pub fn exposure(self, exposure: f64) -> Self {
        Self { exposure, ..self }
    }

    /// Sets the meaning of the values, if they are not radiance.
    #[must_use]
    pub fn values(self, values: &'static str) -> Self {
        Self { values, ..self }
    }

    /// Halves the size, averaging 2×2 pixels, until no side is longer than `side` pixels. The caption mentions this.
    #[must_use]
    pub fn at_most(mut self, side: u32) -> Self {
        while self.width.max(self.height) > side.max(1) {
            let (w, h) = (self.width as usize, self.height as usize);
            let (half_w, half_h) = (w.div_ceil(2), h.div_ceil(2));
            for image in &mut self.images {
                let average = |x: usize, y: usize| {
                    let corner =
                        |dx: usize, dy: usize| image.pixels[(2 * y + dy).min(h - 1) * w + (2 * x + dx).min(w - 1)];
                    let four = [corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)];
                    [0, 1, 2].map(|c| four.iter().map(|pixel| pixel[c]).sum::<f32>() * 0.25)
                };
                image.pixels =
                    (0..half_h).flat_map(|y| (0..half_w).map(move |x| (x, y))).map(|(x, y)| average(x, y)).collect();
            }
            (self.width, self.height) = (half_w as u32, half_h as u32);
            self.halved += 1;
        }
        self
    }

    /// Number of times that each side was halved.
    pub fn halved(&self) -> u32 {
        self.halved
    }
}

/// A value in the page's encoding.
fn stored(value: f32) -> u16 {
    let bits = f16::from_f32(value.clamp(-65504.0, 65504.0)).to_bits();
    if value.is_nan() {
        return f16::NAN.to_bits();
    }
    // Rounds to the kept bits. A carry into the exponent is correct; a carry to infinity is not.
    let drop = 10 - KEPT_BITS;
    let rounded = ((bits & 0x7fff) + (1 << (drop - 1))) & !((1 << drop) - 1);
    (bits & 0x8000) | rounded.min(0x7bff & !((1 << drop) - 1))
}

/// Base64 of the zlib stream of the planes.
pub(super) fn packed(image: &Image, width: u32) -> Result<String> {
    let values: Vec<u16> = image.pixels.iter().flatten().map(|value| stored(*value)).collect();
    let row = width.max(1) as usize * 3;
    let mut planes = Vec::with_capacity(values.len() * 2);
    for shift in [8, 0] {
        for line in values.chunks(row) {
            let byte = |i: usize| (line[i] >> shift) as u8;
            planes.extend((0..line.len()).map(|i| byte(i).wrapping_sub(if i >= 3 { byte(i - 3) } else { 0 })));
        }
    }
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
    let bytes = encoder.write_all(&planes).and_then(|()| encoder.finish());
    let failed =
        |error| Error::new(ErrorKind::Runtime, format!("image '{}' cannot be packed", image.name)).caused_by(error);
    bytes.map(|bytes| base64(&bytes)).map_err(failed)
}

/// RFC 4648, with padding.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let group = chunk.iter().fold(0u32, |group, byte| group << 8 | u32::from(*byte)) << (8 * (3 - chunk.len()));
        for i in 0..4 {
            let digit = DIGITS[(group >> (18 - 6 * i) & 63) as usize] as char;
            text.push(if i <= chunk.len() { digit } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_of_the_standard() {
        for (plain, coded) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")] {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
    }

    #[test]
    fn stored_values_are_near() {
        for value in [0.0f32, 1.0, 0.1, 1e-4, 123.4, 6.0e4, -0.3, 1e9] {
            let back = f16::from_bits(stored(value)).to_f32();
            let wanted = value.clamp(-65504.0, 65504.0);
            assert!((back - wanted).abs() <= wanted.abs() / 250.0 + 1e-6, "{value} became {back}");
        }
        assert!(f16::from_bits(stored(f32::NAN)).is_nan());
        assert!(f16::from_bits(stored(f32::INFINITY)).is_finite());
    }

    #[test]
    fn halving_averages() {
        let pixels = (0..6).map(|i| [i as f32; 3]).collect();
        let half = Comparison::new("a", "", 3, 2).with("x", pixels).at_most(2);
        assert_eq!((half.width, half.height, half.halved()), (2, 1, 1));
        // 0 1 2 / 3 4 5: the last column stands for its missing neighbour.
        assert_eq!(half.images[0].pixels, [[2.0; 3], [3.5; 3]]);
    }
}

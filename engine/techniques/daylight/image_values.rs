//! The values of one image as they are stored: 16-bit floats, signed bytes, or blocks.

use half::f16;

use super::{
    blocks::{Coding, Layout},
    layer::rounded,
};
use crate::Result;

/// Largest part of the tolerance that the rounding of one image to bytes may take.
const ROUNDING: f64 = 1.0 / 16.0;

/// How the values of an image are stored, in the order of a layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Stored {
    Wide,
    Narrow,
    Blocks(Coding),
}

/// What images may be.
#[derive(Clone, Copy)]
pub(super) struct Choice<'a> {
    /// Kinds of blocks, the smallest first.
    pub codings: &'a [Coding],
    /// The blocks of the tile; `None`: none are allowed.
    pub layout: Option<&'a Layout>,
    /// Part of the tolerance that the error of an image in blocks may take.
    pub share: f64,
}

impl Choice<'_> {
    /// No blocks.
    pub const PLAIN: Self = Self { codings: &[], layout: None, share: 0.0 };

    /// For an image of one colour whose error is unknown: BC6H with steps of a thirtieth is too coarse.
    pub fn exact_for_a_colour(self) -> Self {
        let codings = self.codings.iter().position(|coding| *coding == Coding::Pair);
        Self { codings: codings.map_or(&[], |at| &self.codings[at..at + 1]), ..self }
    }
}

/// An image as it is stored.
pub(super) struct Image {
    pub stored: Stored,
    /// Bits of the values, a texel's three after each other; empty for blocks.
    pub codes: Vec<u32>,
    pub blocks: Vec<u8>,
    /// Values as they are decoded, without the scale.
    pub decoded: Vec<f32>,
    pub table: Vec<f32>,
}

impl Image {
    /// `along`: what each dimension has of the image; `vector`: the same for dimensions that are divided by their means; `may_be_wide`: no image before
    /// this one is of bytes.
    ///
    /// # Errors
    /// As [`Layout::decode`], which is given blocks of our own.
    pub fn new(
        values: &[f32],
        along: Vec<f64>,
        vector: &[f64],
        tolerance: f64,
        (may_be_wide, choice): (bool, Choice<'_>),
    ) -> Result<Self> {
        let largest = values.iter().fold(0.0f32, |most, v| most.max(v.abs()));
        let steepest = vector.iter().fold(0.0f64, |most, v| most.max(v.abs()));
        let scaled = |scale: f64| along.iter().map(|a| rounded((a * scale) as f32)).collect::<Vec<f32>>();
        for coding in choice.codings {
            let Some(layout) = choice.layout else { break };
            let scale = f64::from(largest).max(1e-30);
            let near_one: Vec<f32> = values.iter().map(|value| (f64::from(*value) / scale) as f32).collect();
            let blocks = layout.encode(&near_one, *coding);
            let decoded: Vec<f32> = layout.decode(&blocks, *coding)?.into_iter().map(f16::to_f32).collect();
            let square: f64 = near_one.iter().zip(&decoded).map(|(a, b)| f64::from(a - b).powi(2)).sum();
            let error = (square / values.len().max(1) as f64).sqrt() * scale * steepest;
            if error <= choice.share * tolerance {
                let stored = Stored::Blocks(*coding);
                return Ok(Self { stored, codes: Vec::new(), blocks, decoded, table: scaled(scale) });
            }
        }
        let step = f64::from(largest) / 127.0;
        // The rounding error is even within a step.
        let rounding = step / 12f64.sqrt() * steepest;
        let wide = may_be_wide && rounding > ROUNDING * tolerance;
        // Values of 16 bits stay near 1, where they are most precise and never too large.
        let scale = if wide { f64::from(largest).max(1e-30) } else { step.max(1e-30) };
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
        let stored = if wide { Stored::Wide } else { Stored::Narrow };
        Ok(Self { stored, codes, blocks: Vec::new(), decoded, table: scaled(scale) })
    }
}

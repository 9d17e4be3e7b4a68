//! The picture in memory: named layers of one size.

use super::{Metadata, exr_write};
use crate::{Error, ErrorKind, Result};

/// Layers of one size and how they were made.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layers {
    pub width: u32,
    pub height: u32,
    pub layers: Vec<Layer>,
    pub metadata: Metadata,
    /// What is wrong with the file that was read, though a picture could be made of it. Not written.
    pub warnings: Vec<String>,
}

/// One named image of some channels.
///
/// Names of the engine: `""` (RGBA, the picture), `direct`, `indirect`, `albedo` (RGB), `normal`, `position` (X Y Z),
/// `occlusion` (Y), `depth` (Z, eye-space metres; stored as the plain channel `Z` in EXR).
#[derive(Clone, PartialEq)]
pub struct Layer {
    pub name: String,
    /// `R G B A`, `R G B`, `X Y Z`, `Y`, `Z`…
    pub channels: Vec<String>,
    /// `width · height · channels` values, interleaved, top row first.
    pub data: Vec<f32>,
    pub precision: Precision,
}

impl std::fmt::Debug for Layer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "Layer({:?}, {}, {} values, {:?})",
            self.name,
            self.channels.join(""),
            self.data.len(),
            self.precision
        )
    }
}

/// Precision of a layer in EXR files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// 16 bits: enough for colour.
    #[default]
    Half,
    /// 32 bits: for depth and position.
    Full,
}

impl Layer {
    /// A layer of interleaved values; half precision for colour and `Y`, full for all else.
    pub fn new(name: impl Into<String>, channels: &[&str], data: Vec<f32>) -> Self {
        let colour = channels.iter().all(|c| matches!(*c, "R" | "G" | "B" | "A")) || channels == ["Y"];
        Self {
            name: name.into(),
            channels: channels.iter().map(|&c| c.to_owned()).collect(),
            data,
            precision: if colour { Precision::Half } else { Precision::Full },
        }
    }

    /// A colour layer from pixels of three or more values, of which the first three are taken.
    pub fn rgb<const N: usize>(name: impl Into<String>, pixels: &[[f32; N]]) -> Self {
        const { assert!(N >= 3) };
        let colours: Vec<[f32; 3]> = pixels.iter().map(|p| [p[0], p[1], p[2]]).collect();
        Self::new(name, &["R", "G", "B"], colours.into_flattened())
    }

    /// A colour layer with alpha.
    pub fn rgba(name: impl Into<String>, pixels: &[[f32; 4]]) -> Self {
        Self::new(name, &["R", "G", "B", "A"], pixels.as_flattened().to_vec())
    }

    /// Position of a channel, if there is one of that name.
    pub fn channel(&self, name: &str) -> Option<usize> {
        self.channels.iter().position(|c| c == name)
    }

    /// Three values a pixel: R G B, or X Y Z, or a single channel three times. `None` for anything else.
    pub fn rgb_pixels(&self) -> Option<Vec<[f32; 3]>> {
        let [r, g, b] = self.colours()?;
        Some(self.data.chunks_exact(self.channels.len()).map(|p| [p[r], p[g], p[b]]).collect())
    }

    /// Positions of the channels of [`Layer::rgb_pixels`].
    pub fn colours(&self) -> Option<[usize; 3]> {
        let find = |names: [&str; 3]| -> Option<[usize; 3]> {
            Some([self.channel(names[0])?, self.channel(names[1])?, self.channel(names[2])?])
        };
        let single = || (self.channels.len() == 1).then_some([0; 3]);
        find(["R", "G", "B"]).or_else(|| find(["X", "Y", "Z"])).or_else(single).or_else(|| self.luminance())
    }

    /// Luminance with alpha, as grey.
    fn luminance(&self) -> Option<[usize; 3]> {
        (self.channels.len() == 2 && self.channel("A").is_some()).then(|| self.channel("Y"))?.map(|y| [y; 3])
    }
}

impl Layers {
    /// No layers yet.
    pub fn new(width: u32, height: u32) -> Self {
        Self { width, height, ..Self::default() }
    }

    /// A picture: `data` is `width · height · 3` values.
    pub fn rgb(width: u32, height: u32, data: Vec<f32>) -> Self {
        Self::new(width, height).with(Layer::new("", &["R", "G", "B"], data))
    }

    /// A picture with premultiplied alpha: `data` is `width · height · 4` values.
    pub fn rgba(width: u32, height: u32, data: Vec<f32>) -> Self {
        Self::new(width, height).with(Layer::new("", &["R", "G", "B", "A"], data))
    }

    /// With one more layer.
    #[must_use]
    pub fn with(mut self, layer: Layer) -> Self {
        self.layers.push(layer);
        self
    }

    /// The layer of that name; `total` is another name of the unnamed one.
    pub fn layer(&self, name: &str) -> Option<&Layer> {
        let name = if name == "total" { "" } else { name };
        self.layers.iter().find(|layer| layer.name == name || (name.is_empty() && layer.name == "total"))
    }

    /// The picture: the unnamed layer, else the first colour layer, else the first.
    pub fn main(&self) -> Option<&Layer> {
        self.layer("")
            .or_else(|| self.layers.iter().find(|layer| layer.channel("R").is_some()))
            .or_else(|| self.layers.first())
    }

    /// Sizes match, names are unique and can be written.
    pub fn validate(&self) -> Result<()> {
        let wrong = |what: String| Err(Error::new(ErrorKind::Usage, what));
        if self.width == 0 || self.height == 0 || self.layers.is_empty() {
            return wrong(format!(
                "an image of {}×{} with {} layers has no pixels",
                self.width,
                self.height,
                self.layers.len()
            ));
        }
        let mut names = std::collections::BTreeSet::new();
        for layer in &self.layers {
            let values = u64::from(self.width) * u64::from(self.height) * layer.channels.len() as u64;
            if layer.data.len() as u64 != values || values == 0 {
                let found = layer.data.len();
                return wrong(format!("layer {:?} has {found} values where {values} are needed", layer.name));
            }
            for channel in &layer.channels {
                let name = exr_write::channel_name(&layer.name, channel);
                if channel.is_empty() || channel.contains('.') || name.len() > 255 || name.bytes().any(|b| b == 0) {
                    return wrong(format!("{name:?} cannot be the name of a channel"));
                }
                if !names.insert(name) {
                    return wrong(format!("layer {:?} has the channel {channel:?} twice", layer.name));
                }
            }
        }
        Ok(())
    }
}

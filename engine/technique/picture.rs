//! The result of a technique for a frame: images of the graph with names.

use std::fmt::{self, Debug};

use crate::{
    Result,
    graph::{Buffer, Graph, Image},
    passes::gbuffer::GBuffer,
    resident::Handles,
    scene::{Note, View},
};

use super::{Readback, readback};

/// How pixels are encoded in an image of the graph.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Decode {
    /// Values as they are.
    Plain,
    /// Normals as in `lib/gbuffer.glsl`: octahedral if alpha is 1, else one byte per component.
    Normal,
    /// Depth as a share of the far plane's distance (metres), 1: background.
    Depth { far: f32 },
}

/// Makes a note from a number that the frame has computed.
pub(super) type Remark = Box<dyn Fn(u32) -> Option<Note>>;

/// A number about the cost of a frame.
pub(super) enum Number {
    Known(f64),
    /// The sum of all words of a buffer.
    Counted(Buffer),
}

/// The result of a technique for a frame: the total, layers for file formats that hold them, sums, and notes.
pub struct Picture {
    pub(super) total: Image,
    /// The total's first channel is shown as grey.
    pub(super) grey: bool,
    pub(super) layers: Vec<Layer>,
    pub(super) sums: Vec<Sum>,
    pub(super) remarks: Vec<(Buffer, Remark)>,
    pub(super) numbers: Vec<(&'static str, Number)>,
    /// The surfaces that the picture shows. [`super::Ready::frame`] takes it and adds its layers.
    pub gbuffer: Option<GBuffer>,
    /// The scene with which the G-buffer was drawn, if the technique has changed it. [`super::Ready::frame`] takes it.
    pub(super) drawn: Option<Handles>,
    /// R32F: the matte of the chosen objects ([`super::Ready::choose`]), which is also the layer `chosen`.
    pub matte: Option<Image>,
    /// The view of the picture. [`super::Ready::frame`] sets it.
    pub view: Option<View>,
    /// Notes about this frame.
    pub notes: Vec<Note>,
}

/// A layer of a picture.
#[derive(Clone, Debug)]
pub(super) struct Layer {
    pub name: &'static str,
    pub channels: &'static [&'static str],
    pub image: Image,
    pub decode: Decode,
}

impl Layer {
    /// Colours have means; directions, distances and numbers have none. Programs tell the layers that stay exact by the same rule.
    pub fn is_color(&self) -> bool {
        self.channels == ["R", "G", "B"]
    }
}

/// A number for the whole frame: the sum of a channel over all pixels.
#[derive(Clone, Debug)]
pub(super) struct Sum {
    pub name: &'static str,
    pub image: Image,
    pub channel: usize,
}

impl Debug for Picture {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Picture({:?}, layers {:?})", self.total, self.names())
    }
}

impl Picture {
    /// A picture without layers: the red, green and blue channels of an image are radiance.
    pub fn new(total: Image) -> Self {
        let (layers, sums, remarks, numbers, notes) = Default::default();
        Self {
            total,
            grey: false,
            layers,
            sums,
            remarks,
            numbers,
            gbuffer: None,
            drawn: None,
            matte: None,
            view: None,
            notes,
        }
    }

    /// A picture without layers: the first channel of an image, as grey.
    pub fn grey(total: Image) -> Self {
        Self { grey: true, ..Self::new(total) }
    }

    /// Adds a layer of colours, `NAME.R` `NAME.G` `NAME.B`.
    #[must_use]
    pub fn color(self, name: &'static str, image: Image) -> Self {
        self.layer(name, &["R", "G", "B"], image, Decode::Plain)
    }

    /// Adds a layer with its encoding.
    #[must_use]
    pub fn layer(
        mut self,
        name: &'static str,
        channels: &'static [&'static str],
        image: Image,
        decode: Decode,
    ) -> Self {
        self.layers.push(Layer { name, channels, image, decode });
        self
    }

    /// Adds a layer of other values, as they are.
    #[must_use]
    pub fn values(self, name: &'static str, channels: &'static [&'static str], image: Image) -> Self {
        self.layer(name, channels, image, Decode::Plain)
    }

    /// Adds a number: the sum of a channel over all pixels of an image, which may have any size.
    #[must_use]
    pub fn sum(mut self, name: &'static str, image: Image, channel: usize) -> Self {
        self.sums.push(Sum { name, image, channel });
        self
    }

    /// Adds a number about the cost of the frame that a pass counts: the sum of all words of a buffer.
    #[must_use]
    pub fn counting(mut self, name: &'static str, words: Buffer) -> Self {
        self.numbers.push((name, Number::Counted(words)));
        self
    }

    /// Adds a number about the cost of the frame.
    #[must_use]
    pub fn number(mut self, name: &'static str, number: f64) -> Self {
        self.numbers.push((name, Number::Known(number)));
        self
    }

    /// Adds the surfaces that the picture shows.
    #[must_use]
    pub fn showing(self, gbuffer: GBuffer) -> Self {
        Self { gbuffer: Some(gbuffer), ..self }
    }

    /// Says that the G-buffer shows this scene and not that of the frame: other materials, or fewer surfaces.
    #[must_use]
    pub fn drawn_with(self, handles: Handles) -> Self {
        Self { drawn: Some(handles), ..self }
    }

    /// Sets the notes.
    #[must_use]
    pub fn noting(self, notes: Vec<Note>) -> Self {
        Self { notes, ..self }
    }

    /// Adds a note that depends on the first number of a buffer, which is known after the frame has run.
    #[must_use]
    pub fn remarking(mut self, number: Buffer, remark: impl Fn(u32) -> Option<Note> + 'static) -> Self {
        self.remarks.push((number, Box::new(remark)));
        self
    }

    /// Removes all layers but those of these names.
    #[must_use]
    pub fn only(mut self, names: &[&str]) -> Self {
        self.layers.retain(|layer| names.contains(&layer.name));
        self
    }

    /// Applies `stage` to the total. If the stage changes it, the total before the stage becomes the layer `light`.
    ///
    /// # Errors
    /// The errors of `stage`.
    pub fn develop(&mut self, stage: impl FnOnce(Image) -> Result<Image>) -> Result<()> {
        let light = self.total;
        self.total = stage(light)?;
        if self.total != light {
            self.layers.push(Layer { name: "light", channels: &["R", "G", "B"], image: light, decode: Decode::Plain });
        }
        Ok(())
    }

    /// Lets `stage` change the total before anything develops it.
    ///
    /// # Errors
    /// The errors of `stage`.
    pub fn follow(&mut self, stage: impl FnOnce(Image) -> Result<Image>) -> Result<()> {
        self.total = stage(self.total)?;
        Ok(())
    }

    /// Names of the layers.
    pub fn names(&self) -> Vec<&'static str> {
        self.layers.iter().map(|layer| layer.name).collect()
    }

    /// Declares the readback of the total and, if wanted, of the layers and the sums.
    pub fn read(self, graph: &mut Graph, layers: bool, sums: bool) -> Readback {
        readback::of(self, graph, layers, sums)
    }
}

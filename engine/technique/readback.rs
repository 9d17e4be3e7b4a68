//! The readback of a picture as layers in host memory.

use std::fmt::{self, Debug};

use crate::{
    Result,
    graph::{BufferRead, Frame, Graph, ImageRead, Pixels},
    image::{self, Layer, Layers},
    scene::Note,
};

use super::picture::{self, Number, Picture, Remark};

/// The declared readback of a picture.
pub struct Readback {
    total: ImageRead,
    grey: bool,
    /// The picture is an arbitrary image of the graph.
    view: bool,
    layers: Vec<(ImageRead, picture::Layer)>,
    sums: Vec<(ImageRead, picture::Sum)>,
    remarks: Vec<(BufferRead, Remark)>,
    numbers: Vec<(&'static str, Counted)>,
}

/// A number about the cost of a frame.
enum Counted {
    Known(f64),
    Words(BufferRead),
}

impl Debug for Readback {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Readback({} layers)", self.layers.len())
    }
}

/// Declares the readback of a picture.
pub(super) fn of(picture: Picture, graph: &mut Graph, layers: bool, sums: bool) -> Readback {
    let total = graph.read_image(picture.total);
    let layers = if layers { picture.layers } else { Vec::new() };
    let sums = if sums { picture.sums } else { Vec::new() };
    Readback {
        total,
        grey: picture.grey,
        view: false,
        layers: layers.into_iter().map(|layer| (graph.read_image(layer.image), layer)).collect(),
        sums: sums.into_iter().map(|sum| (graph.read_image(sum.image), sum)).collect(),
        remarks: picture.remarks.into_iter().map(|(number, of)| (graph.read_buffer(number), of)).collect(),
        numbers: picture
            .numbers
            .into_iter()
            .map(|(name, number)| match number {
                Number::Known(number) => (name, Counted::Known(number)),
                Number::Counted(words) => (name, Counted::Words(graph.read_buffer(words))),
            })
            .collect(),
    }
}

impl Readback {
    /// Declares the readback of the graph image of this name, instead of a technique's picture.
    ///
    /// # Errors
    /// `Usage` if no pass writes it; the message lists the names.
    pub fn view(graph: &mut Graph, name: &str) -> Result<Self> {
        let total = graph.view(name)?;
        let (layers, sums, remarks, numbers) = Default::default();
        Ok(Self { total, grey: false, view: true, layers, sums, remarks, numbers })
    }

    /// The sums, after the graph has run.
    pub fn sums(&self, frame: &Frame) -> Vec<(String, f64)> {
        let of = |(token, sum): &(ImageRead, picture::Sum)| {
            let pixels = frame.image(*token).to_f32();
            (sum.name.to_owned(), pixels.into_iter().map(|pixel| f64::from(pixel[sum.channel])).sum())
        };
        self.sums.iter().map(of).collect()
    }

    /// Numbers about the cost of the frame, after the graph has run.
    pub fn numbers(&self, frame: &Frame) -> Vec<(&'static str, f64)> {
        let of = |(name, number): &(&'static str, Counted)| {
            let number = match number {
                Counted::Known(number) => *number,
                Counted::Words(words) => frame.buffer::<u32>(*words).into_iter().map(f64::from).sum(),
            };
            (*name, number)
        };
        self.numbers.iter().map(of).collect()
    }

    /// The notes that depend on numbers of the frame, after the graph has run.
    pub fn notes(&self, frame: &Frame) -> Vec<Note> {
        let of = |(token, remark): &(BufferRead, Remark)| frame.buffer::<u32>(*token).first().and_then(|&n| remark(n));
        self.remarks.iter().filter_map(of).collect()
    }

    /// The picture with its layers, after the graph has run. Layers of another size are resampled to the size of the picture.
    pub fn layers(&self, frame: &Frame) -> Layers {
        let picture = frame.image(self.total);
        let (width, height) = (picture.extent.width, picture.extent.height);
        if self.view {
            // A graph image may hold any values. The picture makes them visible; the layer `raw` has them unchanged.
            let visible = picture.picture().into_iter().take(width as usize * height as usize);
            let data = visible.flat_map(|[r, g, b, _]| [r, g, b]).collect();
            let mut layers = Layers::rgb(width, height, data);
            layers.layers.extend(raw(&picture).layers.into_iter().map(|layer| Layer { name: "raw".into(), ..layer }));
            return layers;
        }
        let mut pixels = stretched(&picture, width, height);
        if self.grey {
            pixels.iter_mut().for_each(|pixel| *pixel = [pixel[0]; 4]);
        }
        let mut layers = Layers::new(width, height).with(Layer::rgb("", &pixels));
        for (token, source) in &self.layers {
            let pixels = stretched(&frame.image(*token), width, height);
            let count = source.channels.len().min(4);
            let data = pixels.into_iter().flat_map(|p| source.decode.pixel(p).into_iter().take(count)).collect();
            layers = layers.with(Layer::new(source.name, source.channels, data));
        }
        layers
    }
}

/// The first layer of `pixels` at another size, by nearest-neighbour resampling.
fn stretched(pixels: &Pixels, width: u32, height: u32) -> Vec<[f32; 4]> {
    let all = pixels.to_f32();
    let (w, h) = (pixels.extent.width, pixels.extent.height);
    if (w, h) == (width, height) {
        return all.into_iter().take(w as usize * h as usize).collect();
    }
    let nearest = |i: u32, to: u32, from: u32| u64::from(i) * u64::from(from) / u64::from(to);
    let at = |x, y| all[(nearest(y, height, h) * u64::from(w) + nearest(x, width, w)) as usize];
    (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| at(x, y)).collect()
}

/// An image of the graph with unchanged values: all channels of its first layer and mip level.
pub fn raw(pixels: &Pixels) -> Layers {
    let (width, height) = (pixels.extent.width, pixels.extent.height);
    let count = pixels.format.channels().clamp(1, 4) as usize;
    let channels: &[&str] = match count {
        1 => &["Y"],
        2 => &["X", "Y"],
        3 => &["R", "G", "B"],
        _ => &["R", "G", "B", "A"],
    };
    let values = pixels.to_f32().into_iter().take(width as usize * height as usize);
    let data = values.flat_map(|p| p.into_iter().take(count)).collect();
    let mut layer = Layer::new("", channels, data);
    layer.precision = image::Precision::Full;
    Layers::new(width, height).with(layer)
}

//! The output of a technique for a frame: graph images, and their readback as the layers of a picture.

use lucerna::{
    Result,
    graph::{Buffer, BufferRead, Frame, Graph, Image, ImageRead, Pixels},
    image::{Layer, Layers},
    scene::{Note, View},
};

/// Converts a pixel from the shader's encoding to the layer's values.
type Decode = Box<dyn Fn([f32; 4]) -> [f32; 4]>;
/// Makes a note from a number that the frame has computed.
type Remark = Box<dyn Fn(u32) -> Option<Note>>;

/// The output of a technique for a frame: the picture, layers for formats that hold them, sums, and notes.
pub struct FrameOutput {
    picture: Image,
    /// The picture's first channel is shown as grey.
    grey: bool,
    layers: Vec<Source>,
    sums: Vec<Sum>,
    /// The rendered view, if the technique changed it (its far plane).
    pub view: Option<View>,
    /// Notes of the technique about this frame.
    pub notes: Vec<Note>,
    remarks: Vec<(Buffer, Remark)>,
}

/// A number for the whole frame: the sum of a value of each pixel.
struct Sum {
    name: &'static str,
    image: Image,
    of: fn([f32; 4]) -> f32,
}

struct Source {
    name: &'static str,
    channels: &'static [&'static str],
    image: Image,
    decode: Decode,
}

impl std::fmt::Debug for FrameOutput {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let names: Vec<&str> = self.layers.iter().map(|layer| layer.name).collect();
        write!(f, "FrameOutput({:?}, layers {names:?})", self.picture)
    }
}

impl FrameOutput {
    /// An output with a picture only; its red, green and blue channels are radiance.
    pub fn new(picture: Image) -> Self {
        let (layers, sums, notes, remarks) = Default::default();
        Self { picture, grey: false, layers, sums, view: None, notes, remarks }
    }

    /// An output with a picture only: the first channel of an image, as grey.
    pub fn grey(picture: Image) -> Self {
        Self { grey: true, ..Self::new(picture) }
    }

    /// Sets the rendered view.
    #[must_use]
    pub fn seen_by(self, view: View) -> Self {
        Self { view: Some(view), ..self }
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

    /// Adds a layer of colours, `NAME.R` `NAME.G` `NAME.B`.
    #[must_use]
    pub fn color(self, name: &'static str, image: Image) -> Self {
        self.layer(name, &["R", "G", "B"], image, |pixel| pixel)
    }

    /// Adds a number: the sum of a value of each pixel of an image, which may have any size.
    #[must_use]
    pub fn sum(mut self, name: &'static str, image: Image, of: fn([f32; 4]) -> f32) -> Self {
        self.sums.push(Sum { name, image, of });
        self
    }

    /// Adds a layer of other values.
    #[must_use]
    pub fn layer(
        mut self,
        name: &'static str,
        channels: &'static [&'static str],
        image: Image,
        decode: impl Fn([f32; 4]) -> [f32; 4] + 'static,
    ) -> Self {
        self.layers.push(Source { name, channels, image, decode: Box::new(decode) });
        self
    }

    /// Applies `stage` to the picture. If the stage changes it, the picture before the stage becomes the layer `light`.
    ///
    /// # Errors
    /// The errors of `stage`.
    pub fn develop(&mut self, stage: impl FnOnce(Image) -> Result<Image>) -> Result<()> {
        let light = self.picture;
        self.picture = stage(light)?;
        if self.picture != light {
            let decode: Decode = Box::new(|pixel| pixel);
            self.layers.push(Source { name: "light", channels: &["R", "G", "B"], image: light, decode });
        }
        Ok(())
    }

    /// Names of the layers, the picture first.
    pub fn names(&self) -> Vec<&'static str> {
        std::iter::once("picture").chain(self.layers.iter().map(|layer| layer.name)).collect()
    }

    /// Declares the readback of the picture and, if wanted, of the layers and sums.
    pub fn read(self, graph: &mut Graph, with_layers: bool) -> Readback {
        let picture = graph.read_image(self.picture);
        let (layers, sums) = if with_layers { (self.layers, self.sums) } else { Default::default() };
        let layers = layers.into_iter().map(|layer| (graph.read_image(layer.image), layer)).collect();
        let sums = sums.into_iter().map(|sum| (graph.read_image(sum.image), sum)).collect();
        let remarks = self.remarks.into_iter().map(|(number, of)| (graph.read_buffer(number), of)).collect();
        Readback { picture, grey: self.grey, view: false, layers, sums, remarks }
    }
}

/// The readback of a frame's output.
pub struct Readback {
    picture: ImageRead,
    grey: bool,
    /// The picture is an arbitrary image of the graph (`--view`).
    view: bool,
    layers: Vec<(ImageRead, Source)>,
    sums: Vec<(ImageRead, Sum)>,
    remarks: Vec<(BufferRead, Remark)>,
}

impl std::fmt::Debug for Readback {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Readback({} layers)", self.layers.len())
    }
}

impl Readback {
    /// Declares the readback of the graph image of this name, instead of a technique's picture.
    ///
    /// # Errors
    /// `Usage` if no pass writes it; the message lists the names.
    pub fn view(graph: &mut Graph, name: &str) -> Result<Self> {
        let picture = graph.view(name).map_err(|error| error.at("--view"))?;
        Ok(Self { picture, grey: false, view: true, layers: Vec::new(), sums: Vec::new(), remarks: Vec::new() })
    }

    /// The sums, after the graph has run.
    pub fn sums(&self, frame: &Frame) -> Vec<(String, f64)> {
        let of = |(token, sum): &(ImageRead, Sum)| {
            let pixels = frame.image(*token).to_f32();
            (sum.name.to_owned(), pixels.into_iter().map(|pixel| f64::from((sum.of)(pixel))).sum())
        };
        self.sums.iter().map(of).collect()
    }

    /// The notes that depend on numbers of the frame, after the graph has run.
    pub fn notes(&self, frame: &Frame) -> Vec<Note> {
        let of = |(token, remark): &(BufferRead, Remark)| frame.buffer::<u32>(*token).first().and_then(|&n| remark(n));
        self.remarks.iter().filter_map(of).collect()
    }

    /// The picture with its layers, after the graph has run. Layers of another size are resampled to the size of the picture.
    pub fn layers(&self, frame: &Frame) -> Layers {
        let picture = frame.image(self.picture);
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
            let data = pixels.into_iter().flat_map(|p| (source.decode)(p).into_iter().take(count)).collect();
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
    layer.precision = lucerna::image::Precision::Full;
    Layers::new(width, height).with(layer)
}

//! How the light of the samples reaches the pixels.

use super::{
    Settings, Spread, Stored,
    on_device::{Lit, OnDevice},
    splats::{Seen, Splats},
    vertices::Vertices,
};
use crate::{
    Result,
    gpu::Gpu,
    graph::{Buffer, Extent, Format, Graph, Image},
    passes::gbuffer::{self, GBuffer},
    resident::Handles,
    scene::{Scene, View},
    shaders::consts,
};

/// Images of sums over samples.
#[derive(Clone, Copy, Debug)]
pub struct Sums {
    /// Irradiance times weight, and the weight.
    pub light: Image,
    /// Shares of lights that the samples see, times weight.
    pub visible: Image,
}

/// A way of spreading, with the data that it needs besides the samples.
#[derive(Debug)]
enum Way {
    Gather,
    Splats(Splats),
    Vertices(Vertices),
}

/// A way of spreading light, prepared for a scene.
#[derive(Debug)]
pub struct Spreader {
    way: Way,
    /// Of the sums.
    format: Format,
}

impl Spreader {
    /// # Errors
    /// As [`Splats::new`] and [`Vertices::new`].
    pub fn new(gpu: &Gpu, scene: &Scene, stored: &Stored, spread: Spread) -> Result<Self> {
        let way = match spread {
            Spread::Gather => Way::Gather,
            Spread::Splats => Way::Splats(Splats::new(gpu, stored)?),
            Spread::Vertices => Way::Vertices(Vertices::new(gpu, scene)?),
        };
        // Not all devices blend 32 bits. The weights of a pixel on an open surface sum to about 1, so halves are off by a thousandth.
        let format = if gpu.caps().blend_float32 { Format::RGBA32F } else { Format::RGBA16F };
        Ok(Self { way, format })
    }

    /// The light that all views of a frame spread. `count`: lights whose visibility is needed.
    pub fn light<'a>(
        &'a self,
        graph: &mut Graph,
        scene: &Handles,
        lit: (&'a OnDevice, &'a Lit),
        count: u32,
        settings: &Settings,
    ) -> Spreading<'a> {
        let at_once = if matches!(self.way, Way::Gather) { consts::PRT_LIGHTS } else { consts::PRT_SPREAD_LIGHTS };
        let mut spreading = Spreading { spreader: self, lit, at_once, count, values: Vec::new() };
        if let Way::Vertices(vertices) = &self.way {
            let lights = (0..spreading.passes()).map(|pass| spreading.lights(pass));
            spreading.values = lights.map(|lights| vertices.light(graph, scene, lit, lights, settings.splat)).collect();
        }
        spreading
    }
}

/// The light of the samples of a frame on its way to the pixels.
#[derive(Clone, Debug)]
pub struct Spreading<'a> {
    spreader: &'a Spreader,
    lit: (&'a OnDevice, &'a Lit),
    /// Lights whose visibility reaches the pixels in one pass.
    at_once: u32,
    /// All these lights.
    count: u32,
    /// Light at the vertices in each pass.
    values: Vec<Buffer>,
}

impl Spreading<'_> {
    /// Passes over the pixels.
    pub fn passes(&self) -> u32 {
        self.count.div_ceil(self.at_once).max(1)
    }

    /// Number of the first light of a pass, and the number of its lights.
    pub fn lights(&self, pass: u32) -> [u32; 2] {
        let first = pass * self.at_once;
        [first, self.at_once.min(self.count - first.min(self.count))]
    }

    /// The way to the pixels of one view. `None`: the pixels gather by themselves.
    pub fn of_view(&self, graph: &mut Graph, view: &View, settings: &Settings) -> Option<OfView<'_>> {
        let way = match &self.spreader.way {
            Way::Gather => return None,
            Way::Splats(splats) => OfWay::Splats(splats.seen(graph, view, settings.splat_pixels, settings.splat)),
            Way::Vertices(vertices) => OfWay::Vertices(vertices),
        };
        let extent = Extent::from(view.extent);
        let image = |graph: &mut Graph, name: &str| graph.image(name, self.spreader.format, extent).nearest();
        let sums = Sums { light: image(graph, "prt.sum-light"), visible: image(graph, "prt.sum-visible") };
        Some(OfView { way, sums, spreading: self })
    }
}

/// The way of the light to the pixels of one view.
#[derive(Debug)]
pub struct OfView<'a> {
    way: OfWay<'a>,
    pub sums: Sums,
    spreading: &'a Spreading<'a>,
}

#[derive(Debug)]
enum OfWay<'a> {
    Splats(Seen<'a>),
    Vertices(&'a Vertices),
}

impl OfView<'_> {
    /// Fills the sums with the light of a pass.
    pub fn draw(
        &self,
        graph: &mut Graph,
        scene: &Handles,
        (view, gbuffer, settings): (&View, &GBuffer, &gbuffer::Settings),
        pass: u32,
    ) {
        let lights = self.spreading.lights(pass);
        match &self.way {
            OfWay::Splats(seen) => seen.draw(graph, gbuffer, self.spreading.lit, lights, self.sums),
            OfWay::Vertices(vertices) => {
                let values = self.spreading.values[pass as usize];
                vertices.draw(graph, scene, (view, gbuffer, settings), values, self.sums);
            }
        }
    }

    /// The name of the items that the way draws, and their number.
    pub fn count(&self) -> (&'static str, u32) {
        match &self.way {
            OfWay::Splats(seen) => ("splats", seen.count),
            OfWay::Vertices(vertices) => ("vertices", vertices.count),
        }
    }
}

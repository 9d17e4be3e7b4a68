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
    graph::{Extent, Format, Graph, Image},
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

/// What a way of spreading needs besides the samples, for a scene.
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
        // Not all devices blend 32 bits. The weights of a pixel sum to about 1, so halves are off by a thousandth.
        let format = if gpu.caps().blend_float32 { Format::RGBA32F } else { Format::RGBA16F };
        Ok(Self { way, format })
    }

    /// Lights whose visibility reaches the pixels in one pass.
    pub fn lights_at_once(&self) -> u32 {
        match self.way {
            Way::Gather => consts::PRT_LIGHTS,
            Way::Splats(_) | Way::Vertices(_) => consts::PRT_SPREAD_LIGHTS,
        }
    }

    /// The way for one view. Pixels of views gather by themselves where this is `None`.
    pub fn of_view(&self, graph: &mut Graph, view: &View, settings: &Settings) -> Option<OfView<'_>> {
        let way = match &self.way {
            Way::Gather => return None,
            Way::Splats(splats) => OfWay::Splats(splats.seen(graph, view, settings.splat_pixels, settings.splat)),
            Way::Vertices(vertices) => OfWay::Vertices(vertices),
        };
        let image = |graph: &mut Graph, name: &str| graph.image(name, self.format, Extent::from(view.extent)).nearest();
        let sums = Sums { light: image(graph, "prt.sum-light"), visible: image(graph, "prt.sum-visible") };
        Some(OfView { way, sums, splat: settings.splat })
    }
}

/// A way of spreading light for one view.
#[derive(Debug)]
pub struct OfView<'a> {
    way: OfWay<'a>,
    pub sums: Sums,
    splat: f32,
}

#[derive(Debug)]
enum OfWay<'a> {
    Splats(Seen<'a>),
    Vertices(&'a Vertices),
}

impl OfView<'_> {
    /// Fills the sums. `lights`: number of the first one whose visibility is summed, and their number.
    pub fn draw(
        &self,
        graph: &mut Graph,
        scene: &Handles,
        (view, gbuffer, settings): (&View, &GBuffer, &gbuffer::Settings),
        lit: (&OnDevice, &Lit),
        lights: [u32; 2],
    ) {
        match &self.way {
            OfWay::Splats(seen) => seen.draw(graph, gbuffer, lit, lights, self.sums),
            OfWay::Vertices(vertices) => {
                let values = vertices.light(graph, scene, lit, lights, self.splat);
                vertices.draw(graph, scene, (view, gbuffer, settings), values, self.sums);
            }
        }
    }

    /// What is counted, and its number.
    pub fn count(&self) -> (&'static str, u32) {
        match &self.way {
            OfWay::Splats(seen) => ("splats", seen.count),
            OfWay::Vertices(vertices) => ("vertices", vertices.count),
        }
    }
}

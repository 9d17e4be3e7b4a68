//! The lightmap on the device: where the surfaces of a picture have their texels.

use super::{Baked, lightmap};
use crate::{
    Error, Result,
    gpu::{Gpu, OwnedBuffer},
    graph::{Cull, Depth, Draw, DrawCall, Format, Graph, Image, Load, Raster, Targets},
    passes::gbuffer::GBuffer,
    resident::Handles,
    scene::{Scene, View},
    shaders::{daylight::place, types},
};

/// The corners of all triangles in the lightmap.
#[derive(Debug)]
pub(super) struct Places {
    corners: OwnedBuffer,
    /// Corners of all fronts, which those of the backs follow; 0: backs show the light of the fronts; `u32::MAX`: backs have no light.
    backs: u32,
    placed: OwnedBuffer,
    draws: Vec<DrawCall>,
}

impl Places {
    /// `None`: the bake has no lightmap.
    ///
    /// # Errors
    /// `Input` if the scene has another number of triangles; `OutOfMemory`.
    pub fn new(gpu: &Gpu, scene: &Scene, baked: &Baked) -> Result<Option<Self>> {
        let corners = &baked.stored.corners;
        if corners.is_empty() {
            return Ok(None);
        }
        let (mut placed, mut draws, mut first) = (Vec::new(), Vec::new(), 0);
        for (number, (.., primitive)) in lightmap::placed(scene).enumerate() {
            let double_sided = scene.materials.get(primitive.material as usize).is_some_and(|of| of.double_sided);
            placed.push(types::DayPlaced { first, sides: 1 + u32::from(double_sided) });
            let vertices = primitive.indices.len() as u32 / 3 * 3;
            draws.push(DrawCall { first_vertex: first, vertices, first_instance: number as u32, instances: 1 });
            first += vertices;
        }
        let (all, stored) = (first / 3, corners.fronts.len());
        if all as usize != stored {
            return Err(baked.blamed(Error::input(format!("has places for {stored} triangles, the scene has {all}"))));
        }
        draws.retain(|draw| draw.vertices > 0);
        Ok(Some(Self {
            corners: OwnedBuffer::with_contents(gpu, "daylight.corners", bytemuck::cast_slice(&corners.listed()))?,
            backs: match &corners.backs {
                None => 0,
                Some(backs) if backs.is_empty() => u32::MAX,
                Some(_) => first,
            },
            placed: OwnedBuffer::with_contents(gpu, "daylight.placed", bytemuck::cast_slice(&placed))?,
            draws,
        }))
    }

    /// Draws the place in the lightmap of each pixel.
    pub fn draw(&self, graph: &mut Graph, handles: &Handles, view: &View, gbuffer: &GBuffer) -> Image {
        let places = graph.image("daylight.places", Format::RG32F, view.extent);
        let depth = graph.image("daylight.places.depth", Format::D32F, view.extent);
        let args = place::Args {
            view: gbuffer.view,
            instances: handles.instances,
            indices: handles.indices,
            positions: handles.positions,
            corners: graph.import_buffer(&self.corners),
            placed: graph.import_buffer(&self.placed),
            depth: gbuffer.depth,
            push: place::Push { backs: self.backs },
        };
        let targets = Targets::new().color(places, Load::Clear([-1.0; 4])).depth(depth, Depth::Clear(0.0));
        // Sides that the G-buffer does not show are at another depth.
        graph.raster(targets, Raster::new().cull(Cull::None), args, Draw::calls(self.draws.clone()));
        places
    }
}

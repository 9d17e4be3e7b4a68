//! Light of the samples as splats (Leonhardt and Bohn, section 5): discs in the tangent planes of the samples, seen as ellipses, with Gaussian weights.
//! The picture divides by the sum of the weights.

use super::{
    Stored,
    on_device::{Lit, OnDevice},
    spread::Sums,
    tree::{self, Tree},
};
use crate::{
    Result,
    gpu::{Gpu, OwnedBuffer},
    graph::{Blend, Compare, Depth, Draw, Graph, Load, Raster, StencilLoad, Targets},
    passes::gbuffer::GBuffer,
    scene::View,
    shaders::prt::{splat_light, splats},
};

/// The splats of a bake on a device.
#[derive(Debug)]
pub struct Splats {
    tree: Tree,
    splats: OwnedBuffer,
    members: OwnedBuffer,
}

impl Splats {
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub fn new(gpu: &Gpu, stored: &Stored) -> Result<Self> {
        let tree = Tree::new(&stored.samples, &stored.plan.clusters, stored.plan.radius);
        let buffer = |name, bytes: &[u8]| OwnedBuffer::with_contents(gpu, name, bytes);
        Ok(Self {
            splats: buffer("prt.splats", bytemuck::cast_slice(&tree.splats))?,
            members: buffer("prt.members", bytemuck::cast_slice(&tree.members))?,
            tree,
        })
    }

    /// The splats of a view. `least`: distance of splats at least, pixels; `splat`: standard deviation of their weights, in distances of samples.
    pub fn seen(&self, graph: &mut Graph, view: &View, least: f32, splat: f32) -> Seen<'_> {
        let drawn = self.tree.cut(view, least, tree::end(splat));
        let count = drawn.len() as u32;
        let drawn = graph.buffer_from("prt.drawn", if drawn.is_empty() { &[0] } else { &drawn[..] });
        Seen { splats: self, drawn, count, splat }
    }
}

/// The splats of a view.
#[derive(Clone, Copy, Debug)]
pub struct Seen<'a> {
    splats: &'a Splats,
    drawn: crate::graph::Buffer,
    pub count: u32,
    splat: f32,
}

impl Seen<'_> {
    /// Sums of the light of the samples and of their weights at the pixels. `lights`: number of the first one whose visibility is summed, and their
    /// number.
    pub fn draw(
        &self,
        graph: &mut Graph,
        gbuffer: &GBuffer,
        (light, lit): (&OnDevice, &Lit),
        [first_light, lights]: [u32; 2],
        sums: Sums,
    ) {
        let values = graph.buffer("prt.splat-light", 32 * u64::from(self.count.max(1)));
        let splats = graph.import_buffer(&self.splats.splats);
        let args = splat_light::Args {
            splats,
            members: graph.import_buffer(&self.splats.members),
            drawn: self.drawn,
            samples: graph.import_buffer(&light.samples),
            irradiances: lit.irradiances,
            visible: lit.visible,
            values,
            push: splat_light::Push { count: self.count, samples_all: light.count, first_light, lights },
        };
        graph.compute(args, self.count.max(1));
        let args = splats::Args {
            view: gbuffer.view,
            splats,
            drawn: self.drawn,
            values,
            pixel_normal: gbuffer.normal.nearest(),
            depth: gbuffer.depth.nearest(),
            push: splats::Push { splat: self.splat },
        };
        let targets = Targets::new()
            .color(sums.light, Load::Clear([0.0; 4]))
            .color(sums.visible, Load::Clear([0.0; 4]))
            .depth(gbuffer.hardware, Depth::ReadOnly)
            .stencil(StencilLoad::Keep);
        // Splats of a draw are blended in their order, so sums have the same bits in each run.
        let state = Raster::new().depth_compare(Compare::GreaterOrEqual).depth_write(false).blend(Blend::Add);
        graph.raster(targets, state, args, Draw::instanced(6, self.count));
    }
}

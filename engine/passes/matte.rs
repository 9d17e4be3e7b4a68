//! The matte of chosen objects: the pixels in which the G-buffer shows one of their surfaces.

use super::gbuffer::GBuffer;
use crate::{
    graph::{Draw, Format, Graph, Image, Load, Raster, Targets},
    resident::{Batches, Handles},
    scene::{View, chosen::Chosen, cull::Frustum},
    shaders::passes::matte,
};

/// R32F at the extent of the G-buffer, which is that of `view`: 1 where the G-buffer shows a chosen object, 0 elsewhere. The depth of the G-buffer
/// decides, so objects that stand behind other ones, holes, and the pixels in which a blended surface is dithered away are 0. Of two surfaces whose
/// distances differ by less than 10⁻⁴ of the distance both count.
pub fn draw(graph: &mut Graph, handles: &Handles, g: &GBuffer, view: &View, chosen: &Chosen) -> Image {
    let extent = graph.extent(g.depth);
    let matte = graph.image("matte", Format::R32F, extent);
    let frustum = Frustum::new(view);
    let is_seen = |i: &crate::resident::Instance| chosen.has(i.node, i.material) && frustum.sees(&i.bounds);
    let batches = Batches::filtered(&handles.moment, is_seen, view.position);
    let visible = batches.visible_buffer(graph, "matte.visible");
    let calls: Vec<_> = batches.list.iter().flat_map(|batch| batch.calls.iter().copied()).collect();
    let args = matte::Args {
        view: g.view,
        instances: handles.instances,
        visible,
        positions: handles.positions,
        depth: g.depth,
    };
    let targets = Targets::new().color(matte, Load::Clear([0.0; 4]));
    graph.raster(targets, Raster::new(), args, Draw::indexed(handles.indices, calls));
    matte
}

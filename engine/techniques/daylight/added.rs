//! The pixels of objects that were added at run time.

use crate::{
    graph::{Cull, Depth, Draw, DrawCall, Format, Graph, Image, Load, Raster, Targets},
    passes::gbuffer::GBuffer,
    resident::Handles,
    scene::View,
    shaders::daylight::added,
};

/// Draws a mask: 1 where the G-buffer shows an instance of a node from `first` on.
pub(super) fn mask(graph: &mut Graph, handles: &Handles, view: &View, gbuffer: &GBuffer, first: u32) -> Image {
    let mask = graph.image("daylight.added", Format::R8, view.extent);
    let depth = graph.image("daylight.added.depth", Format::D32F, view.extent);
    let args = added::Args {
        view: gbuffer.view,
        instances: handles.instances,
        indices: handles.indices,
        positions: handles.positions,
        depth: gbuffer.depth,
    };
    let calls = handles.moment.instances.iter().enumerate();
    let calls =
        calls.filter(|(_, instance)| instance.node >= first && instance.indices > 0).map(|(number, instance)| {
            DrawCall { first_vertex: 0, vertices: instance.indices, first_instance: number as u32, instances: 1 }
        });
    let targets = Targets::new().color(mask, Load::Clear([0.0; 4])).depth(depth, Depth::Clear(0.0));
    // Sides that the G-buffer does not show are at another depth.
    graph.raster(targets, Raster::new().cull(Cull::None), args, Draw::calls(calls.collect()));
    mask
}

/// The scene of a frame without the instances of nodes from `first` on.
pub(super) fn without(handles: &Handles, first: u32) -> Handles {
    let mut moment = (*handles.moment).clone();
    // Numbers of instances stay, so they are hidden and not removed.
    moment.instances.iter_mut().filter(|instance| instance.node >= first).for_each(|instance| instance.indices = 0);
    Handles { moment: moment.into(), ..handles.clone() }
}

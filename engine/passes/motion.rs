//! The motion of the surfaces that the G-buffer shows, for passes that look up surfaces in the last frame.

use super::gbuffer::GBuffer;
use crate::{
    graph::{Draw, Format, Graph, Image, Load, Raster, Targets},
    resident::{Batches, Handles},
    scene::{View, cull::Frustum},
    shaders::passes::motion,
};

/// Bytes of a position.
const POSITION: u64 = 12;

/// RGBA32F at the extent of the G-buffer: the world position in the last frame of each visible surface that moved, metres, alpha 1; alpha 0
/// elsewhere. Stores instances and deformed vertices for the next frame. `user`: begins the names of image and history, so that two users in a
/// graph have two; each must run in every frame. In a first frame the positions mean nothing.
pub fn draw(graph: &mut Graph, handles: &Handles, g: &GBuffer, view: &View, user: &str) -> Image {
    let extent = graph.extent(g.depth);
    let motion = graph.image(format!("{user}.motion"), Format::RGBA32F, extent);
    let (before_instances, next) = graph.history_buffer(format!("{user}.history.instances"), handles.instances.bytes());
    graph.copy_buffer(handles.instances, next);
    // In the vertex streams, deformed primitives are stored after all undeformed ones.
    let deformed = handles.moment.instances.iter().filter(|i| i.deformed).map(|i| i.first_vertex).min();
    let before_positions = match deformed {
        Some(first) => {
            let written = handles.positions.range(u64::from(first) * POSITION..handles.positions.bytes());
            let (before, next) = graph.history_buffer(format!("{user}.history.positions"), written.bytes());
            graph.copy_buffer(written, next);
            before
        }
        // Without deformed primitives the shader does not read this buffer.
        None => handles.positions,
    };
    let frustum = Frustum::new(view);
    let batches = Batches::new(&handles.moment, Some(&frustum), view.position);
    let visible = batches.visible_buffer(graph, &format!("{user}.visible"));
    let calls: Vec<_> = batches.list.iter().flat_map(|batch| batch.calls.iter().copied()).collect();
    let args = motion::Args {
        view: g.view,
        instances: handles.instances,
        visible,
        positions: handles.positions,
        before_instances,
        before_positions,
        depth: g.depth,
        push: motion::Push { first_deformed: deformed.unwrap_or(u32::MAX) },
    };
    let targets = Targets::new().color(motion, Load::Clear([0.0; 4]));
    graph.raster(targets, Raster::new(), args, Draw::indexed(handles.indices, calls));
    motion
}

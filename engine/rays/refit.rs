//! Refits trees to the positions of their triangles in a frame, on the device: first the corners, then the boxes, level by level from the
//! leaves to the root. Each value is written by one invocation only, so the result is bit-identical for the same scene.

use super::shapes::Shape;
use crate::{
    graph::{Buffer, Graph},
    resident::Handles,
    shaders::rays::{records, refit},
};

/// Declares the passes that refit `shapes`, each given with the first instance of its use.
pub fn declare(graph: &mut Graph, scene: &Handles, nodes: Buffer, triangles: Buffer, shapes: &[(&Shape, u32)]) {
    let total: usize = shapes.iter().map(|(shape, _)| shape.node_count()).sum();
    if total == 0 {
        return;
    }
    graph.scope("refit", |graph| {
        let boxes = graph.buffer("rays.boxes", 24 * total as u64);
        // The lowest level reads no boxes, but the graph requires that a buffer is written before a pass reads it.
        graph.fill(boxes, 0);
        let mut first_box = 0;
        for (shape, first_instance) in shapes {
            let count = shape.record_count();
            let push = records::Push {
                first: shape.first_record,
                count,
                first_instance: *first_instance,
                placed: u32::from(shape.merged),
            };
            let args = records::Args {
                records: triangles,
                indices: scene.indices,
                positions: scene.positions,
                instances: scene.instances,
                push,
            };
            graph.compute(args, count);
            for level in shape.levels.windows(2).rev() {
                let count = level[1] - level[0];
                let push = refit::Push { first: shape.root + level[0], count, root: shape.root, first_box };
                graph.compute(refit::Args { nodes, records: triangles, boxes, push }, count);
            }
            first_box += shape.node_count() as u32;
        }
    });
}

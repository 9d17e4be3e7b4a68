//! Hardware acceleration structures for ray queries: a bottom level for each primitive in the vertex streams, and a top level with all
//! instances of the scene.

use std::collections::HashMap;

use crate::{
    Result,
    gpu::{BottomDesc, Gpu, OwnedAccel},
    graph::{Accel, BottomBuild, Graph, TopInstance},
    resident::{Cutout, Handles, Instance, Resident, Sided},
    shaders::consts::{TRACE_SEES_LIT, TRACE_SEES_UNLIT},
};

/// Number of frames after which the bottom levels of deforming primitives are rebuilt instead of refitted. The further the triangles have
/// moved, the slower a refitted tree becomes.
const REBUILD_EVERY: u64 = 16;

/// First index and first vertex of a primitive. Instances with the same key share a bottom level.
type Key = (u32, u32);

/// Acceleration structures of one scene.
#[derive(Debug)]
pub(super) struct Query {
    accel: OwnedAccel,
    bottoms: HashMap<Key, u32>,
    frames: u64,
}

fn key(instance: &Instance) -> Key {
    (instance.first_index, instance.first_vertex)
}

impl Query {
    /// # Errors
    /// As [`OwnedAccel::new`].
    pub fn new(gpu: &Gpu, resident: &Resident) -> Result<Self> {
        let mut bottoms = HashMap::new();
        let mut descs = Vec::new();
        let shapes = resident.shapes();
        for shape in &shapes {
            if shape.indices >= 3 && !bottoms.contains_key(&(shape.first_index, shape.first_vertex)) {
                bottoms.insert((shape.first_index, shape.first_vertex), descs.len() as u32);
                let (triangles, vertices) = (shape.indices / 3, shape.vertices);
                descs.push(BottomDesc { triangles, vertices, deforms: shape.deforms });
            }
        }
        let accel = OwnedAccel::new(gpu, "rays.accel", &descs, shapes.len() as u32)?;
        Ok(Self { accel, bottoms, frames: 0 })
    }

    /// Declares the update for the frame of `scene`. The first frame builds all levels. Later frames refit or rebuild the bottom levels of
    /// deforming primitives, and rebuild the top level.
    pub fn frame(&mut self, graph: &mut Graph, scene: &Handles) -> Accel {
        let accel = graph.import_accel(&self.accel);
        let first = !self.accel.is_built();
        let refit = !first && !self.frames.is_multiple_of(REBUILD_EVERY);
        self.frames = if first { 1 } else { self.frames + 1 };
        let mut builds: Vec<Option<BottomBuild>> = vec![None; self.accel.layout().bottoms.len()];
        let mut instances = Vec::with_capacity(scene.moment.instances.len());
        for (number, instance) in scene.moment.instances.iter().enumerate() {
            let Some(&bottom) = self.bottoms.get(&key(instance)) else { continue };
            if (first || instance.deformed)
                && let Some(build) = builds.get_mut(bottom as usize)
            {
                *build = Some(BottomBuild {
                    bottom,
                    positions: scene.positions,
                    first_vertex: instance.first_vertex,
                    indices: scene.indices,
                    first_index: instance.first_index,
                    refit,
                });
            }
            // A singular transform has no inverse, so rays cannot be transformed to object space.
            if !instance.world_from_object.inverse().is_finite() {
                continue;
            }
            let sees = if instance.casts { TRACE_SEES_LIT } else { TRACE_SEES_UNLIT };
            let placed =
                TopInstance::new(self.accel.address(bottom), &instance.world_from_object, number as u32, sees as u8);
            instances
                .push(placed.double_sided(instance.sided == Sided::Both).opaque(instance.cutout == Cutout::Opaque));
        }
        let builds: Vec<BottomBuild> = builds.into_iter().flatten().collect();
        graph.build_bottoms(accel, &builds);
        graph.build_top(accel, &instances);
        accel
    }
}

//! From visible instances to draw calls: grouped by pipeline state, equal meshes in one instanced call, near ones first. Things of the same
//! extent are as near as each other and keep the scene's order, so that of two in one place the first is drawn first.

use super::{Handles, Instance, Moment};
use crate::{
    graph::{Buffer, Cull, Draw, Graph, IndexedCall},
    scene::cull::Frustum,
};
use glam::Vec3;
use std::collections::BTreeMap;

/// What becomes of transparent texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Cutout {
    /// Alpha is ignored.
    Opaque,
    /// Cut out below the material's cutoff.
    Mask,
    /// See-through.
    Blend,
}

/// Which sides of the triangles are seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Sided {
    /// Counter-clockwise ones.
    Front,
    /// Clockwise ones: the instance is mirrored.
    Mirrored,
    Both,
}

impl Sided {
    /// What the rasteriser drops.
    pub fn cull(self) -> Cull {
        match self {
            Self::Front => Cull::Back,
            Self::Mirrored => Cull::Front,
            Self::Both => Cull::None,
        }
    }
}

/// Draws that share a pipeline state.
#[derive(Clone, Debug, PartialEq)]
pub struct Batch {
    pub cutout: Cutout,
    pub sided: Sided,
    /// `first_instance` counts in [`Batches::visible`].
    pub calls: Vec<IndexedCall>,
}

/// All draws of one view, opaque first, then masked, then blended.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Batches {
    /// Numbers of instances, in the order of the draws.
    pub visible: Vec<u32>,
    pub list: Vec<Batch>,
}

impl Batches {
    /// The instances that `frustum` sees (`None`: all), near `eye` first.
    pub fn new(moment: &Moment, frustum: Option<&Frustum>, eye: Vec3) -> Self {
        Self::of_views(moment, frustum.map_or(&[], std::slice::from_ref), eye)
    }

    /// As [`Batches::new`], with the instances that at least one of several frusta sees; no frusta: all.
    pub fn of_views(moment: &Moment, frusta: &[Frustum], eye: Vec3) -> Self {
        Self::filtered(moment, |i| frusta.is_empty() || frusta.iter().any(|f| f.sees(&i.bounds)), eye)
    }

    /// As [`Batches::new`], without a difference between the sides of triangles: for shadow maps.
    pub fn of_casters(moment: &Moment, frustum: Option<&Frustum>, eye: Vec3) -> Self {
        let mut all = Self::filtered(moment, |i| i.casts && frustum.is_none_or(|f| f.sees(&i.bounds)), eye);
        let mut merged: Vec<Batch> = Vec::new();
        for batch in all.list {
            match merged.last_mut() {
                Some(last) if last.cutout == batch.cutout => last.calls.extend(batch.calls),
                _ => merged.push(Batch { sided: Sided::Both, ..batch }),
            }
        }
        all.list = merged;
        all
    }

    /// As [`Batches::new`], with the instances for which `keep` is true.
    pub fn filtered(moment: &Moment, keep: impl Fn(&Instance) -> bool, eye: Vec3) -> Self {
        // State → mesh (by its indices) → instances with their distance.
        type Meshes = BTreeMap<(u32, u32), Vec<(f32, u32)>>;
        let mut groups: BTreeMap<(Cutout, Sided), Meshes> = BTreeMap::new();
        for (number, instance) in moment.instances.iter().enumerate().filter(|(_, i)| i.indices > 0 && keep(i)) {
            let nearest = eye.clamp(instance.bounds.min, instance.bounds.max);
            let distance = if instance.bounds.is_finite() { nearest.distance(eye) } else { 0.0 };
            let meshes = groups.entry((instance.cutout, instance.sided)).or_default();
            meshes.entry((instance.first_index, instance.indices)).or_default().push((distance, number as u32));
        }
        let mut out = Self::default();
        for ((cutout, sided), meshes) in groups {
            let mut meshes: Vec<_> = meshes.into_iter().collect();
            for (_, instances) in &mut meshes {
                instances.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            }
            meshes.sort_by(|a, b| a.1[0].0.total_cmp(&b.1[0].0).then(a.1[0].1.cmp(&b.1[0].1)));
            let mut calls = Vec::new();
            for ((first_index, indices), instances) in meshes {
                calls.push(IndexedCall {
                    first_index,
                    indices,
                    vertex_offset: 0,
                    first_instance: out.visible.len() as u32,
                    instances: instances.len() as u32,
                });
                out.visible.extend(instances.iter().map(|(_, number)| number));
            }
            out.list.push(Batch { cutout, sided, calls });
        }
        out
    }

    /// [`Batches::visible`] as a buffer.
    pub fn visible_buffer(&self, graph: &mut Graph, name: &str) -> Buffer {
        let list = if self.visible.is_empty() { &[0][..] } else { &self.visible };
        graph.buffer_from(name, list)
    }
}

impl Batch {
    /// The calls of this batch.
    pub fn draw(&self, handles: &Handles) -> Draw {
        Draw::indexed(handles.indices, self.calls.clone())
    }

    /// Triangles drawn.
    pub fn triangles(&self) -> u64 {
        self.calls.iter().map(|c| u64::from(c.indices / 3) * u64::from(c.instances)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Aabb;

    fn instance(at: f32, mesh: u32, cutout: Cutout, sided: Sided) -> Instance {
        let bounds = Aabb::of([Vec3::new(at, 0.0, 0.0)]).grown(0.5);
        Instance {
            node: 0,
            material: 0,
            bounds,
            first_index: 30 * mesh,
            indices: 30,
            cutout,
            sided,
            casts: true,
            world_from_object: glam::Mat4::IDENTITY,
            first_vertex: 0,
            deformed: false,
        }
    }

    #[test]
    fn equal_meshes_share_a_call_and_states_come_in_order() {
        use Cutout::*;
        use Sided::*;
        let instances = vec![
            instance(9.0, 0, Blend, Front),
            instance(5.0, 1, Opaque, Front),
            instance(1.0, 2, Opaque, Front),
            instance(3.0, 1, Opaque, Front),
            instance(2.0, 1, Opaque, Both),
            instance(2.0, 3, Mask, Mirrored),
        ];
        let moment = Moment { instances, ..Moment::default() };
        let batches = Batches::new(&moment, None, Vec3::ZERO);
        let states: Vec<_> = batches.list.iter().map(|b| (b.cutout, b.sided)).collect();
        assert_eq!(states, [(Opaque, Front), (Opaque, Both), (Mask, Mirrored), (Blend, Front)]);
        // Mesh 2 is nearest; of mesh 1, instance 3 before 1.
        assert_eq!(batches.visible, [2, 3, 1, 4, 5, 0]);
        let calls: Vec<_> =
            batches.list[0].calls.iter().map(|c| (c.first_index, c.first_instance, c.instances)).collect();
        assert_eq!(calls, [(60, 0, 1), (30, 1, 2)]);
        assert_eq!(batches.list[0].triangles(), 30);
        let casters = Batches::of_casters(&moment, None, Vec3::ZERO);
        assert_eq!(casters.list.iter().map(|b| b.cutout).collect::<Vec<_>>(), [Opaque, Mask, Blend]);
        assert_eq!(casters.list[0].triangles(), 40);
    }
}

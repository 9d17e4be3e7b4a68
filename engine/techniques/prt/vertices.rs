//! Light of the samples at the vertices of the scene, and between them by interpolation.

use super::{
    on_device::{Lit, OnDevice},
    spread::Sums,
};
use crate::{
    Error, Result,
    gpu::{Gpu, OwnedBuffer},
    graph::{Buffer, Compare, Depth, Extent, Format, Graph, Load, Raster, Targets},
    passes::gbuffer::{self, GBuffer},
    resident::{Batches, Cutout, Handles},
    scene::{Scene, View, cull::Frustum},
    shaders::{
        prt::{at_vertices, vertices},
        types::PrtMesh,
    },
};

/// The places of the light at the vertices of a scene, in a buffer.
#[derive(Debug)]
pub struct Vertices {
    meshes: OwnedBuffer,
    instances: u32,
    /// Vertices of all instances, those of double-sided surfaces twice.
    pub count: u32,
}

impl Vertices {
    /// # Errors
    /// `Usage` if the scene has more vertices than the device's buffers can hold; `OutOfMemory`, `DeviceLost`.
    pub fn new(gpu: &Gpu, scene: &Scene) -> Result<Self> {
        let mut meshes = Vec::new();
        let mut count = 0u64;
        // In the order of the instances of a frame.
        for mesh in scene.nodes.iter().filter_map(|node| scene.meshes.get(node.mesh? as usize)) {
            for primitive in &mesh.primitives {
                let Some(material) = scene.materials.get(primitive.material as usize) else { continue };
                let sides = 1 + u32::from(material.double_sided);
                meshes.push(PrtMesh { first: count as u32, sides });
                count += primitive.positions.len() as u64 * u64::from(sides);
            }
        }
        let limits = &gpu.caps().limits;
        // 32 bytes for each vertex, and groups of 64.
        let groups = 64 * u64::from(limits.work_group_count[0]);
        let most = (limits.storage_range / 32).min(groups).min(u64::from(u32::MAX / 2));
        if count > most {
            let what = format!("vertices, and the scene has {count} of them; the device allows {most}");
            return Err(Error::usage(what).at("prt.spread").help("Use gather or splats"));
        }
        let instances = meshes.len() as u32;
        meshes.push(PrtMesh { first: count as u32, sides: 1 });
        let meshes = OwnedBuffer::with_contents(gpu, "prt.meshes", bytemuck::cast_slice(&meshes))?;
        Ok(Self { meshes, instances, count: count as u32 })
    }

    /// Light at the vertices. `lights`: number of the first one whose visibility is gathered, and their number.
    pub fn light(
        &self,
        graph: &mut Graph,
        scene: &Handles,
        (light, lit): (&OnDevice, &Lit),
        [first_light, lights]: [u32; 2],
        splat: f32,
    ) -> Buffer {
        let values = graph.buffer("prt.vertex-light", 32 * u64::from(self.count.max(1)));
        let args = at_vertices::Args {
            samples: graph.import_buffer(&light.samples),
            grid: graph.uniform(&light.grid.grid),
            starts: graph.import_buffer(&light.starts),
            order: graph.import_buffer(&light.order),
            irradiances: lit.irradiances,
            visible: lit.visible,
            instances: scene.instances,
            positions: scene.positions,
            normals: scene.normals,
            meshes: graph.import_buffer(&self.meshes),
            values,
            push: at_vertices::Push {
                count: self.count,
                mesh_count: self.instances,
                samples_all: light.count,
                first_light,
                lights,
                splat,
            },
        };
        graph.compute(args, self.count.max(1));
        values
    }

    /// Draws the light at the vertices into `sums`, with weights of 1.
    pub fn draw(
        &self,
        graph: &mut Graph,
        scene: &Handles,
        (view, gbuffer, settings): (&View, &GBuffer, &gbuffer::Settings),
        values: Buffer,
        sums: Sums,
    ) {
        let extent = Extent::from(view.extent);
        let nearest = graph.image("prt.vertices.depth", Format::D32F, extent);
        let frustum = settings.culling.then(|| Frustum::new(view));
        let batches = Batches::new(&scene.moment, frustum.as_ref(), view.position);
        let drawn = batches.visible_buffer(graph, "prt.vertices.drawn");
        let hidden = settings.blended == gbuffer::Blended::Hidden;
        let list: Vec<_> = batches.list.iter().filter(|b| b.cutout != Cutout::Blend || !hidden).collect();
        // Without draws an empty pass still clears the images.
        for index in 0..list.len().max(1) {
            let batch = list.get(index);
            let load = if index == 0 { Load::Clear([0.0; 4]) } else { Load::Keep };
            let depth = if index == 0 { Depth::Clear(0.0) } else { Depth::Keep };
            let args = vertices::Args {
                view: gbuffer.view,
                instances: scene.instances,
                drawn,
                positions: scene.positions,
                meshes: graph.import_buffer(&self.meshes),
                values,
                depth: gbuffer.depth.nearest(),
            };
            let targets = Targets::new().color(sums.light, load).color(sums.visible, load).depth(nearest, depth);
            // As in the G-buffer, the first of coplanar surfaces is visible.
            let state = Raster::new().depth_compare(Compare::Greater);
            let state = state.cull(batch.map_or_else(Default::default, |batch| batch.sided.cull()));
            let draw =
                batch.map_or_else(|| crate::graph::Draw::indexed(scene.indices, Vec::new()), |batch| batch.draw(scene));
            graph.raster(targets, state, args, draw);
        }
    }
}

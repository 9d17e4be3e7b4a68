//! Mirrors and glass: a tree of rays for each pixel that sees some (Whitted 1980).

use super::{Igi, Settings, Shared, Vpls};
use crate::{
    graph::{Extent, Format, Graph, Image},
    passes::gbuffer::GBuffer,
    scene::resident::Handles,
    shaders::{
        consts::TREE_WIDTH,
        igi::{direct_tree, gather_tree, grow, reap},
        types,
    },
};

/// Pixels whose trees are held at once.
const SLOTS: u32 = 1 << 16;

impl Igi {
    /// Radiance that mirrors and glass show, and in alpha the share of each pixel's surface that they are.
    pub(super) fn trees(
        &self,
        graph: &mut Graph,
        handles: &Handles,
        g: &GBuffer,
        shared: &Shared,
        (vpls, background): (Option<Vpls>, [f32; 3]),
        settings: &Settings,
    ) -> Image {
        let extent = graph.extent(g.depth);
        let sharp = graph.image("igi.sharp", Format::RGBA32F, extent);
        // Whole blocks of 8 × 8 pixels.
        let slots = extent.width.div_ceil(8) * extent.height.div_ceil(8) * 64;
        let held = slots.min(SLOTS);
        let tree_nodes = graph.buffer("igi.trees", u64::from(held * TREE_WIDTH) * size_of::<types::TreeNode>() as u64);
        graph.fill(tree_nodes, 0);
        graph.clear(sharp, [0.0; 4]);
        let (rays, hidden_by) = (&shared.rays, &shared.hidden_by);
        for first in (0..slots).step_by(held as usize) {
            let count = held.min(slots - first);
            let nodes = count * TREE_WIDTH;
            for level in 0..=settings.specular_depth {
                let args = grow::Args {
                    view: g.view,
                    environment_radiance_map: shared.environment,
                    environment_columns: shared.environment_columns,
                    settings: shared.settings,
                    sharp,
                    materials: handles.materials,
                    scene_textures: handles.textures,
                    surface_instances: handles.instances,
                    surface_indices: handles.indices,
                    surface_positions: handles.positions,
                    surface_normals: handles.normals,
                    surface_tangents: handles.tangents,
                    surface_uvs: handles.uvs,
                    surface_colors: handles.colors,
                    trace_nodes: rays.trace_nodes,
                    trace_triangles: rays.trace_triangles,
                    trace_instances: rays.trace_instances,
                    trace_indices: rays.trace_indices,
                    trace_uvs: rays.trace_uvs,
                    trace_colors: rays.trace_colors,
                    trace_scene: rays.trace_scene,
                    trace_accel: rays.trace_accel,
                    tree_nodes,
                    push: grow::Push { first, count, level, background },
                };
                graph.compute(args, nodes);
            }
            let lit = Extent::new(nodes, 1);
            for (first, count) in self.batches(lit, shared.direct_rays) {
                let args = direct_tree::Args {
                    environment_radiance_map: shared.environment,
                    environment_columns: shared.environment_columns,
                    light_columns: shared.light_columns,
                    light_targets: shared.light_targets,
                    instance_lights: shared.instance_lights,
                    settings: shared.settings,
                    light_nodes: shared.light_nodes,
                    lights: handles.lights,
                    materials: handles.materials,
                    scene_textures: handles.textures,
                    surface_instances: handles.instances,
                    surface_indices: handles.indices,
                    surface_positions: handles.positions,
                    surface_normals: handles.normals,
                    surface_tangents: handles.tangents,
                    surface_uvs: handles.uvs,
                    surface_colors: handles.colors,
                    trace_nodes: rays.trace_nodes,
                    trace_triangles: rays.trace_triangles,
                    trace_instances: rays.trace_instances,
                    trace_indices: rays.trace_indices,
                    trace_uvs: rays.trace_uvs,
                    trace_colors: rays.trace_colors,
                    trace_scene: rays.trace_scene,
                    trace_accel: rays.trace_accel,
                    tree_nodes,
                    push: direct_tree::Push { first, count, nodes },
                };
                graph.compute(args, nodes);
            }
            let ranges = vpls.map(|vpls| (vpls.buffer, self.batches(lit, vpls.count)));
            for (buffer, (first, count)) in
                ranges.into_iter().flat_map(|(b, list)| list.into_iter().map(move |r| (b, r)))
            {
                let args = gather_tree::Args {
                    vpls: buffer,
                    materials: handles.materials,
                    scene_textures: handles.textures,
                    trace_nodes: hidden_by.trace_nodes,
                    trace_triangles: hidden_by.trace_triangles,
                    trace_instances: hidden_by.trace_instances,
                    trace_indices: hidden_by.trace_indices,
                    trace_uvs: hidden_by.trace_uvs,
                    trace_colors: hidden_by.trace_colors,
                    trace_scene: hidden_by.trace_scene,
                    trace_accel: hidden_by.trace_accel,
                    tree_nodes,
                    push: gather_tree::Push {
                        first,
                        count,
                        nodes,
                        least: shared.least,
                        imperfect: settings.imperfect.into(),
                        seed: shared.seed,
                    },
                };
                graph.compute(args, nodes);
            }
            graph.compute(reap::Args { sharp, tree_nodes, push: reap::Push { first, count } }, count);
        }
        sharp
    }
}

//! Lights with an area, which techniques sample by rays: the emissive triangles of a scene and its environment.

use super::{Sources, environment, lights, lights::LightTable};
use crate::{
    Result,
    gpu::{Gpu, OwnedBuffer, OwnedImage},
    graph::{Buffer, Graph, Image},
    scene::{Pose, Scene},
    shaders::types::{AliasEntry, EnvironmentMap, LightNode, LightTarget},
};

/// The tables of a scene's lights with an area.
#[derive(Debug)]
pub struct AreaLights {
    environment: OwnedImage,
    environment_edges: OwnedBuffer,
    map: EnvironmentMap,
    sky: bool,
    /// The emissive triangles, and the pose for which the table was built.
    lights: Option<(Pose, LightTable)>,
}

/// The bindings of `lib/environment_sampling.glsl` and `lib/light_sampling.glsl` in a graph.
#[derive(Clone, Copy, Debug)]
pub struct AreaHandles {
    pub map: EnvironmentMap,
    /// The scene has an environment.
    pub sky: bool,
    /// The scene has emissive triangles.
    pub tree: bool,
    pub environment: Image,
    pub environment_edges: Buffer,
    pub light_columns: Buffer,
    pub light_targets: Buffer,
    pub instance_lights: Buffer,
    pub light_nodes: Buffer,
}

impl AreaLights {
    /// Whether a scene has such lights.
    pub fn any(scene: &Scene) -> bool {
        let emits = |number: u32| {
            let material = scene.materials.get(number as usize);
            material.is_some_and(|material| !material.unlit && material.emissive.max_element() > 0.0)
        };
        let mut primitives = scene.meshes.iter().flat_map(|mesh| &mesh.primitives);
        has_sky(scene) || primitives.any(|primitive| emits(primitive.material))
    }

    /// Uploads the environment.
    ///
    /// # Errors
    /// `Runtime` if the environment is larger than the device's images; `OutOfMemory`, `DeviceLost`.
    pub fn new(gpu: &Gpu, scene: &Scene) -> Result<Self> {
        let environment = scene.environment.as_ref();
        let importance = environment::importance(environment);
        let edges = bytemuck::cast_slice(&importance.edges);
        Ok(Self {
            environment: environment::radiance_map(gpu, environment)?,
            environment_edges: OwnedBuffer::with_contents(gpu, "area-lights.environment", edges)?,
            map: EnvironmentMap {
                size: environment.map_or([1, 1], |e| [e.width as i32, e.height as i32]),
                cells: importance.cells,
                rotation: environment.map_or(0.0, |e| e.rotation),
                scale: environment.map_or(0.0, |e| e.scale),
            },
            sky: has_sky(scene),
            lights: None,
        })
    }

    /// The table of the emissive triangles in the pose of the last [`Self::frame`].
    pub fn table(&self) -> Option<&LightTable> {
        self.lights.as_ref().map(|(_, table)| table)
    }

    /// Imports the tables into a graph, with the emissive triangles where the pose has them.
    pub fn frame(&mut self, graph: &mut Graph, scene: &Scene, pose: &Pose) -> AreaHandles {
        if self.lights.as_ref().is_none_or(|(of, _)| of != pose) {
            self.lights = Some((pose.clone(), lights::table(scene, pose, &[], Sources::Emissive)));
        }
        let empty = LightTable {
            suns: 0,
            columns: vec![AliasEntry::default()],
            targets: vec![LightTarget::default()],
            nodes: vec![LightNode::default()],
            tree: false,
            instances: vec![u32::MAX],
        };
        let table = self.table().unwrap_or(&empty);
        AreaHandles {
            map: self.map,
            sky: self.sky,
            tree: table.tree,
            environment: graph.import_image(&self.environment),
            environment_edges: graph.import_buffer(&self.environment_edges),
            light_columns: graph.buffer_from("area-lights.columns", &table.columns),
            light_targets: graph.buffer_from("area-lights.targets", &table.targets),
            instance_lights: graph.buffer_from("area-lights.instances", &table.instances),
            light_nodes: graph.buffer_from("area-lights.nodes", &table.nodes),
        }
    }
}

fn has_sky(scene: &Scene) -> bool {
    scene.environment.as_ref().is_some_and(|environment| !environment.pixels.is_empty())
}

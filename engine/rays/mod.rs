//! The scene as shaders trace rays through it: `trace_closest` and `trace_any` of `lib/trace.glsl`.
//!
//! Two levels: a bottom tree over the triangles of each shape, which instances of it share, and a top tree over the places
//! where they stand. What never moves on its own is one shape in world space. The top tree is rebuilt each frame.
//!
//! ```no_run
//! # use lucerna::{gpu::Gpu, graph::Graph, rays::Rays, scene::{Scene, resident::Resident}};
//! # fn example(gpu: &Gpu, scene: &Scene) -> lucerna::Result<()> {
//! let mut resident = Resident::new(gpu, scene)?;
//! let mut rays = Rays::new(gpu, scene, &resident)?;
//! let mut graph = Graph::new("frame");
//! let handles = resident.frame(&mut graph, scene, 0.0);
//! let traced = rays.frame(&mut graph, &handles); // its fields go into the Args of the same names
//! # Ok(())
//! # }
//! ```

mod query;
mod shapes;
mod tree;

use crate::{
    Error, ErrorKind, Result,
    gpu::{Gpu, OwnedBuffer},
    graph::{Accel, Buffer, Graph, Image},
    scene::{
        Aabb, Scene,
        resident::{Handles, Resident},
    },
    shaders::{
        consts::{MAX_TEXTURE_ARRAYS, TRACE_FIRST_MASK, TRACE_LEAF},
        types,
    },
};
use glam::{Mat4, Vec3};
use shapes::{Shape, Use};
use tree::Tree;

/// Trees of one scene on a device.
#[derive(Debug)]
pub struct Rays {
    nodes: OwnedBuffer,
    triangles: OwnedBuffer,
    shapes: Vec<Shape>,
    uses: Vec<Use>,
    /// What ray queries trace instead.
    query: Option<query::Query>,
    /// Nodes at the start of the buffer that are left to the top tree.
    top_nodes: u32,
}

/// What a pass that includes `lib/trace.glsl` binds; each field goes into the field of `Args` of the same name.
#[derive(Clone, Copy, Debug)]
pub struct RayHandles {
    pub trace_nodes: Buffer,
    pub trace_triangles: Buffer,
    pub trace_instances: Buffer,
    pub trace_indices: Buffer,
    pub trace_uvs: Buffer,
    pub trace_colors: Buffer,
    pub trace_scene: Buffer,
    /// `NONE`: rays are traced in compute.
    pub trace_accel: Accel,
    pub materials: Buffer,
    pub scene_textures: [Image; MAX_TEXTURE_ARRAYS as usize],
}

impl Rays {
    /// Builds the trees of a scene that was made `resident`.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`; `Runtime` if the scene is larger than the device's limits.
    pub fn new(gpu: &Gpu, scene: &Scene, resident: &Resident) -> Result<Self> {
        let query = if gpu.caps().ray_query { Some(query::Query::new(gpu, resident)?) } else { None };
        Ok(Self { query, ..Self::in_compute(gpu, scene, resident)? })
    }

    /// As [`Self::new`], but rays are traced in compute also where the device has ray queries.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn in_compute(gpu: &Gpu, scene: &Scene, _resident: &Resident) -> Result<Self> {
        let (mut shapes, uses) = shapes::gather(scene);
        // A node for every two uses, and one for an empty scene.
        let top_nodes = uses.len().max(2) as u32;
        let mut nodes = vec![[0.0f32; 4]; 4 * top_nodes as usize];
        let mut records = Vec::new();
        for shape in &mut shapes {
            let first_record = (records.len() / 3) as u32;
            let first_node = (nodes.len() / 4) as u32;
            nodes.extend(shape.tree.encode(first_node, first_record));
            shape.encode(&mut records);
            shape.root = shape.tree.refer(shape.tree.root, first_node, first_record);
        }
        if records.len() / 3 > TRACE_FIRST_MASK as usize {
            return Err(Error::new(
                ErrorKind::Runtime,
                format!("{} triangles; rays can be traced through {TRACE_FIRST_MASK}", records.len() / 3),
            )
            .help("Use a scene with fewer triangles"));
        }
        records.resize(records.len().max(3), [0.0; 4]);
        let limit = gpu.caps().limits.storage_range;
        let upload = |name: &str, contents: &[[f32; 4]]| {
            let bytes: &[u8] = bytemuck::cast_slice(contents);
            if bytes.len() as u64 > limit {
                return Err(Error::new(
                    ErrorKind::Runtime,
                    format!("`{name}` has {} bytes; the device allows {limit}", bytes.len()),
                )
                .help("Use a scene with fewer triangles, or another device"));
            }
            OwnedBuffer::with_contents(gpu, name, bytes)
        };
        Ok(Self {
            nodes: upload("rays.nodes", &nodes)?,
            triangles: upload("rays.triangles", &records)?,
            query: None,
            shapes,
            uses,
            top_nodes,
        })
    }

    /// The trees as the scene stands in `scene`, for its graph.
    pub fn frame(&mut self, graph: &mut Graph, scene: &Handles) -> RayHandles {
        let nodes = graph.import_buffer(&self.nodes);
        let (top, instances) = self.top(scene);
        let staging = graph.buffer_from("rays.top", &top.encode(0, 1));
        graph.copy_buffer(staging, nodes.range(0..staging.size));
        RayHandles {
            trace_nodes: nodes,
            trace_triangles: graph.import_buffer(&self.triangles),
            trace_instances: graph.buffer_from("rays.instances", &instances),
            trace_indices: scene.indices,
            trace_uvs: scene.uvs,
            trace_colors: scene.colors,
            trace_scene: scene.instances,
            trace_accel: self.query.as_mut().map_or(Accel::NONE, |query| query.frame(graph, scene)),
            materials: scene.materials,
            scene_textures: scene.textures,
        }
    }

    /// The top tree, and what its leaves refer to, the tree itself first.
    fn top(&self, scene: &Handles) -> (Tree, Vec<types::TraceInstance>) {
        let mut boxes = Vec::new();
        let mut places = Vec::new();
        for usage in &self.uses {
            let Some(shape) = self.shapes.get(usage.shape) else { continue };
            let instance = scene.moment.instances.get(usage.first_instance as usize);
            let (world, bounds) = match instance {
                _ if shape.merged => (Mat4::IDENTITY, shape.bounds),
                Some(i) if i.deformed => (i.world_from_object, i.bounds),
                Some(i) => (i.world_from_object, shape.bounds.transformed(&i.world_from_object)),
                None => continue,
            };
            let inverse = world.inverse();
            if bounds.is_empty() || !inverse.is_finite() {
                continue;
            }
            boxes.push(Aabb { min: bounds.min.max(-HUGE), max: bounds.max.min(HUGE) });
            let rows = inverse.transpose();
            places.push(types::TraceInstance {
                object_from_world: [rows.x_axis.to_array(), rows.y_axis.to_array(), rows.z_axis.to_array()],
                first_instance: if shape.merged { 0 } else { usage.first_instance },
                root: shape.root,
                reach: reach(&shape.bounds),
            });
        }
        let mut top = Tree::halved(&boxes, 1);
        let ordered = top.order.iter().map(|i| places[*i as usize]);
        let all = boxes.iter().copied().fold(Aabb::EMPTY, Aabb::union);
        let world = types::TraceInstance { root: top.refer(top.root, 0, 1), reach: reach(&all), ..Default::default() };
        let instances = std::iter::once(world).chain(ordered).collect();
        if top.nodes.is_empty() {
            // The root is a leaf.
            top.nodes.push(tree::Node { boxes: [tree::NOTHING; 2], children: [TRACE_LEAF; 2] });
        }
        debug_assert!(top.nodes.len() <= self.top_nodes as usize);
        (top, instances)
    }
}

/// Farther out nothing is distinguished.
const HUGE: Vec3 = Vec3::splat(1e15);

/// The largest coordinate of a box.
fn reach(bounds: &Aabb) -> f32 {
    if bounds.is_empty() { 0.0 } else { bounds.min.abs().max(bounds.max.abs()).max_element().min(HUGE.x) }
}

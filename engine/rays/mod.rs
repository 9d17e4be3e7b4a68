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

mod encode;
mod query;
mod refit;
mod shapes;
mod traced;
mod tree;

pub(crate) use traced::traced;

use crate::{
    Error, ErrorKind, Result,
    gpu::{Gpu, OwnedBuffer},
    graph::{Accel, Buffer, Graph, Image},
    scene::{
        Aabb, Scene,
        resident::{Handles, Resident},
    },
    shaders::{
        consts::{MAX_TEXTURE_ARRAYS, TRACE_DEPTH, TRACE_NODE_WORDS, TRACE_STEPS},
        types,
    },
};
use encode::{WORDS, encode};
use glam::{Mat4, Vec3};
use shapes::{Encoded, Gathered, Shape, Use};
use tree::{DEPTH, EIGHTHS_DEPTH, Tree};

// The stack has an entry for each level, two for the way back up, and one for the end.
const _: () = assert!(DEPTH + EIGHTHS_DEPTH + 2 <= TRACE_DEPTH);
const _: () = assert!(WORDS == TRACE_NODE_WORDS as usize);

/// Nodes, triangles and instances have numbers of 24 bits.
const MOST: usize = 1 << 24;

/// Trees of one scene on a device.
#[derive(Debug)]
pub struct Rays {
    nodes: OwnedBuffer,
    triangles: OwnedBuffer,
    shapes: Vec<Shape>,
    uses: Vec<Use>,
    /// Instances in world space with where they stood when the tree was built.
    merged: Vec<(u32, Mat4)>,
    /// Some have stood elsewhere since.
    disturbed: bool,
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
        if !gpu.caps().ray_query {
            return Self::in_compute(gpu, scene, resident);
        }
        // No trees of our own are needed then.
        let query = Some(query::Query::new(gpu, resident)?);
        Ok(Self { query, ..Self::in_compute(gpu, &Scene::default(), resident)? })
    }

    /// As [`Self::new`], but rays are traced in compute also where the device has ray queries.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn in_compute(gpu: &Gpu, scene: &Scene, _resident: &Resident) -> Result<Self> {
        let mut out = Encoded::default();
        // Each node but the last of a level has eight children; how many uses there will be is not known yet.
        let pieces: usize =
            scene.nodes.iter().filter_map(|n| scene.meshes.get(n.mesh? as usize)).map(|m| m.primitives.len()).sum();
        let top_nodes = (pieces as u32).div_ceil(4) + EIGHTHS_DEPTH;
        out.nodes.resize(WORDS * top_nodes as usize, 0);
        let Gathered { shapes, uses, merged } = shapes::gather(scene, &mut out);
        let most = (out.records.len() / 3).max(out.nodes.len() / WORDS).max(uses.len() + 1);
        if most > MOST {
            return Err(Error::new(ErrorKind::Runtime, format!("{most} triangles; rays can be traced through {MOST}"))
                .help("Use a scene with fewer triangles"));
        }
        out.records.resize(out.records.len().max(3), [0.0; 4]);
        let limit = gpu.caps().limits.storage_range;
        let upload = |name: &str, bytes: &[u8]| {
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
            nodes: upload("rays.nodes", bytemuck::cast_slice(&out.nodes))?,
            triangles: upload("rays.triangles", bytemuck::cast_slice(&out.records))?,
            query: None,
            shapes,
            uses,
            merged,
            disturbed: false,
            top_nodes,
        })
    }

    /// Turns of all loops of a ray at most. CPU drivers run eight invocations together, through each turn that one of them needs; scenes
    /// of more triangles than some hundred get [`TRACE_STEPS`], at which traversal ends.
    pub fn most_turns(&self) -> u64 {
        if self.query.is_some() {
            // Its trees are the driver's.
            return TRACE_STEPS.into();
        }
        let of = |usage: &Use| self.shapes.get(usage.shape).map_or(0, Shape::most_turns);
        let one = u64::from(self.top_nodes) + self.uses.iter().map(of).sum::<u64>();
        (8 * one).min(TRACE_STEPS.into())
    }

    /// The trees as the scene stands in `scene`, for its graph.
    pub fn frame(&mut self, graph: &mut Graph, scene: &Handles) -> RayHandles {
        let nodes = graph.import_buffer(&self.nodes);
        let moved = |(i, built): &(u32, Mat4)| {
            scene.moment.instances.get(*i as usize).is_some_and(|i| i.world_from_object != *built)
        };
        self.disturbed |= self.merged.iter().any(moved);
        let (top, instances) = self.top(scene);
        let mut words = Vec::new();
        encode(&top, 0, 1, &mut words);
        let staging = graph.buffer_from("rays.top", &words);
        graph.copy_buffer(staging, nodes.range(0..staging.size));
        let triangles = graph.import_buffer(&self.triangles);
        let used = self.uses.iter().filter_map(|u| Some((self.shapes.get(u.shape)?, u.first_instance)));
        let refitted: Vec<_> = used.filter(|(s, _)| s.deformed || (s.merged && self.disturbed)).collect();
        refit::declare(graph, scene, nodes, triangles, &refitted);
        RayHandles {
            trace_nodes: nodes,
            trace_triangles: triangles,
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
            let Some(instance) = scene.moment.instances.get(usage.first_instance as usize) else { continue };
            let world = if shape.merged { Mat4::IDENTITY } else { instance.world_from_object };
            // Rounding of the inverse would carry rays past what they meet.
            let inverse = world.as_dmat4().inverse().as_mat4();
            let bounds = match (shape.merged, shape.deformed) {
                (true, _) if self.disturbed => {
                    let of = |(i, _): &(u32, Mat4)| scene.moment.instances.get(*i as usize).map(|i| i.bounds);
                    self.merged.iter().filter_map(of).fold(Aabb::EMPTY, Aabb::union)
                }
                (_, true) => instance.bounds,
                _ => shape.bounds.transformed(&world),
            };
            if bounds.is_empty() || !inverse.is_finite() {
                continue;
            }
            let bounds = Aabb { min: bounds.min.max(-HUGE), max: bounds.max.min(HUGE) };
            // Corners are rounded on the way to the world.
            boxes.push(bounds.grown(1e-5 * reach(&bounds)));
            let rows = inverse.transpose();
            places.push(types::TraceInstance {
                object_from_world: [rows.x_axis.to_array(), rows.y_axis.to_array(), rows.z_axis.to_array()],
                first_instance: if shape.merged { 0 } else { usage.first_instance },
                root: shape.root,
                reach: reach(&bounds.transformed(&inverse)),
            });
        }
        let top = Tree::eighths(&boxes);
        debug_assert!(top.nodes.len() <= self.top_nodes as usize);
        let ordered = top.order.iter().map(|i| places[*i as usize]);
        let all = boxes.iter().copied().fold(Aabb::EMPTY, Aabb::union);
        let world = types::TraceInstance { root: 0, reach: reach(&all), ..Default::default() };
        let instances = std::iter::once(world).chain(ordered).collect();
        (top, instances)
    }
}

/// Farther out nothing is distinguished.
const HUGE: Vec3 = Vec3::splat(1e15);

/// The largest coordinate of a box.
fn reach(bounds: &Aabb) -> f32 {
    if bounds.is_empty() { 0.0 } else { bounds.min.abs().max(bounds.max.abs()).max_element().min(HUGE.x) }
}

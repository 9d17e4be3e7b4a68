//! Acceleration structures of a scene, through which shaders trace rays with `trace_closest` and `trace_any` of `lib/trace.glsl`.
//!
//! There are two levels: a bottom tree over the triangles of each shape, which all instances of the shape share, and a top tree
//! over the instances. All objects that never move are merged into one shape in world space. The top tree is rebuilt each frame.
//!
//! ```no_run
//! # use lucerna::{gpu::Gpu, graph::Graph, rays::Rays, resident::Resident, scene::Scene};
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
    gpu::{BufferDesc, Gpu, OwnedBuffer},
    graph::{Accel, Buffer, Graph, Image, Uniform},
    resident::{Handles, Resident},
    scene::{Aabb, Scene},
    shaders::{
        consts::{MAX_TEXTURE_ARRAYS, TRACE_DEPTH, TRACE_NODE_WORDS, TRACE_STEPS},
        types,
    },
};
use encode::{WORDS, encode};
use glam::{Mat4, Vec3};
use shapes::{Encoded, Gathered, Shape, Use};
use tree::{DEPTH, EIGHTHS_DEPTH, Tree};

// The traversal stack needs an entry for each level and two more entries.
const _: () = assert!(DEPTH + EIGHTHS_DEPTH + 2 <= TRACE_DEPTH);
const _: () = assert!(WORDS == TRACE_NODE_WORDS as usize);

/// Maximum of nodes, triangles and instances: their numbers have 24 bits.
const MOST: usize = 1 << 24;

/// The acceleration structures of one scene on a device.
#[derive(Debug)]
pub struct Rays {
    nodes: OwnedBuffer,
    triangles: OwnedBuffer,
    /// Copy of the instances of the scene.
    instances: OwnedBuffer,
    shapes: Vec<Shape>,
    uses: Vec<Use>,
    /// Merged instances, with their transforms at the time when the tree was built.
    merged: Vec<(u32, Mat4)>,
    /// The transform of a merged instance has changed since then.
    disturbed: bool,
    /// Hardware acceleration structures, which ray queries trace instead.
    query: Option<query::Query>,
    /// Nodes at the start of the buffer that are reserved for the top tree.
    top_nodes: u32,
}

/// The bindings of a pass that includes `lib/trace.glsl`. Each field goes into the field of `Args` with the same name.
#[derive(Clone, Copy, Debug)]
pub struct RayHandles {
    pub trace_nodes: Buffer,
    pub trace_triangles: Buffer,
    pub trace_instances: Buffer,
    /// Addresses of the trees and of the scene.
    pub scene_at: Uniform<types::SceneAddresses>,
    pub trace_indices: Buffer,
    pub trace_uvs: Buffer,
    pub trace_colors: Buffer,
    pub trace_scene: Buffer,
    /// `NONE` if rays are traced in compute.
    pub trace_accel: Accel,
    pub materials: Buffer,
    pub scene_textures: [Image; MAX_TEXTURE_ARRAYS as usize],
}

impl Rays {
    /// Builds the acceleration structures of a scene that `resident` has uploaded.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`; `Runtime` if the scene is larger than the device's limits.
    pub fn new(gpu: &Gpu, scene: &Scene, resident: &Resident) -> Result<Self> {
        if !gpu.caps().ray_query {
            return Self::in_compute(gpu, scene, resident);
        }
        // Ray queries need no trees for compute shaders.
        let query = Some(query::Query::new(gpu, resident)?);
        Ok(Self { query, ..Self::in_compute(gpu, &Scene::default(), resident)? })
    }

    /// Like [`Self::new`], but rays are traced in compute even if the device has ray queries.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn in_compute(gpu: &Gpu, scene: &Scene, resident: &Resident) -> Result<Self> {
        let mut out = Encoded::default();
        // An upper bound, because the number of uses is not known yet. Every node has eight children, except the last one of each level.
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
            instances: OwnedBuffer::new(gpu, "rays.scene", BufferDesc::device(resident.instances_size()))?,
            query: None,
            shapes,
            uses,
            merged,
            disturbed: false,
            top_nodes,
        })
    }

    /// Maximum of loop iterations that one ray needs. CPU drivers run eight invocations together and execute each iteration that one of them
    /// needs. For scenes of more than a few hundred triangles this is [`TRACE_STEPS`], the limit at which traversal ends.
    pub fn most_turns(&self) -> u64 {
        if self.query.is_some() {
            // The driver builds these trees, so their depth is unknown.
            return TRACE_STEPS.into();
        }
        let of = |usage: &Use| self.shapes.get(usage.shape).map_or(0, Shape::most_turns);
        let one = u64::from(self.top_nodes) + self.uses.iter().map(of).sum::<u64>();
        (8 * one).min(TRACE_STEPS.into())
    }

    /// Declares the update of the trees for the frame of `scene`, and returns their handles in its graph.
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
        // Those of the frame have no address.
        let placed = graph.import_buffer(&self.instances);
        graph.copy_buffer(scene.instances, placed.range(0..scene.instances.size));
        let triangles = graph.import_buffer(&self.triangles);
        let used = self.uses.iter().filter_map(|u| Some((self.shapes.get(u.shape)?, u.first_instance)));
        let refitted: Vec<_> = used.filter(|(s, _)| s.deformed || (s.merged && self.disturbed)).collect();
        refit::declare(graph, scene, nodes, triangles, &refitted);
        RayHandles {
            trace_nodes: nodes,
            trace_triangles: triangles,
            trace_instances: graph.buffer_from("rays.instances", &instances),
            scene_at: graph.uniform(&types::SceneAddresses {
                nodes: self.nodes.address_words(),
                triangles: self.triangles.address_words(),
                instances: self.instances.address_words(),
                ..scene.at
            }),
            trace_indices: scene.indices,
            trace_uvs: scene.uvs,
            trace_colors: scene.colors,
            trace_scene: scene.instances,
            trace_accel: self.query.as_mut().map_or(Accel::NONE, |query| query.frame(graph, scene)),
            materials: scene.materials,
            scene_textures: scene.textures,
        }
    }

    /// The top tree, and the instances to which its leaves refer.
    fn top(&self, scene: &Handles) -> (Tree, Vec<types::TraceInstance>) {
        let mut boxes = Vec::new();
        let mut places = Vec::new();
        for usage in &self.uses {
            let Some(shape) = self.shapes.get(usage.shape) else { continue };
            let Some(instance) = scene.moment.instances.get(usage.first_instance as usize) else { continue };
            let world = if shape.merged { Mat4::IDENTITY } else { instance.world_from_object };
            // With an inverse in single precision, rounding would let rays miss triangles.
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
            // A margin for the rounding of the corners in the transform to world space.
            boxes.push(bounds.grown(1e-5 * reach(&bounds)));
            let rows = inverse.transpose();
            places.push(types::TraceInstance {
                object_from_world: [rows.x_axis.to_array(), rows.y_axis.to_array(), rows.z_axis.to_array()],
                first_instance: if shape.merged { 0 } else { usage.first_instance },
                root: shape.root,
                reach: reach(&bounds.transformed(&inverse)),
                only: 0,
            });
        }
        let top = Tree::eighths(&boxes);
        debug_assert!(top.nodes.len() <= self.top_nodes as usize);
        let ordered = top.order.iter().map(|i| places[*i as usize]);
        let all = boxes.iter().copied().fold(Aabb::EMPTY, Aabb::union);
        let only = u32::from(places.len() == 1);
        let world = types::TraceInstance { root: 0, reach: reach(&all), only, ..Default::default() };
        let instances = std::iter::once(world).chain(ordered).collect();
        (top, instances)
    }
}

/// Coordinates are clamped to this size, metres, so that products stay finite.
const HUGE: Vec3 = Vec3::splat(1e15);

/// The largest coordinate of a box.
fn reach(bounds: &Aabb) -> f32 {
    if bounds.is_empty() { 0.0 } else { bounds.min.abs().max(bounds.max.abs()).max_element().min(HUGE.x) }
}

//! The scene on the device: streams, materials, textures and lights, uploaded once; poses and instances, every frame.
//!
//! ```no_run
//! # use lucerna::{gpu::Gpu, graph::Graph, resident::Resident, scene::Scene};
//! # fn example(gpu: &Gpu, scene: &Scene) -> lucerna::Result<()> {
//! let mut resident = Resident::new(gpu, scene)?;
//! let mut graph = Graph::new("frame");
//! let handles = resident.frame(&mut graph, scene, 0.0);
//! # Ok(())
//! # }
//! ```

mod deform;
mod draws;
mod geometry;
mod material;
mod textures;

pub(crate) use deform::deforms;
pub use draws::{Batches, Cutout, Sided};
pub use material::lights;

use crate::{
    Error, ErrorKind, Result,
    gpu::{Gpu, ImageDesc, OwnedBuffer, OwnedImage, Region},
    graph::{Buffer, Format, Graph, Image},
    scene::{Aabb, AlphaMode, Environment, Note, NoteKind, Pose, Scene, deform::cofactor},
    shaders::{consts::MAX_TEXTURE_ARRAYS, types},
};
use ash::vk;
use bytemuck::Pod;
use geometry::{Range, Streams};
use glam::{Mat3, Mat4};
use half::f16;
use std::sync::Arc;

/// A scene on a device.
#[derive(Debug)]
pub struct Resident {
    positions: OwnedBuffer,
    normals: OwnedBuffer,
    tangents: OwnedBuffer,
    uvs: OwnedBuffer,
    colors: OwnedBuffer,
    indices: OwnedBuffer,
    materials: OwnedBuffer,
    /// The same on the host.
    material_table: Arc<[types::Material]>,
    material_names: Arc<[String]>,
    skin_vertices: OwnedBuffer,
    morph_deltas: OwnedBuffer,
    stream_deltas: OwnedBuffer,
    textures: Vec<OwnedImage>,
    /// For array slots that no texture needs.
    white: OwnedImage,
    environment: OwnedImage,
    items: Vec<Item>,
    deform: deform::Deform,
    notes: Vec<Note>,
    bytes: u64,
    depth_stencil: Format,
}

/// One primitive of one node.
#[derive(Clone, Copy, Debug)]
struct Item {
    node: usize,
    /// The primitive's own vertices, or the deformed copy.
    range: Range,
    job: Option<usize>,
    cutout: Cutout,
    double_sided: bool,
    casts: bool,
}

/// A primitive's place in the streams, or that of a deformed copy.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StreamShape {
    pub first_vertex: u32,
    /// From the first one to the end of the stream.
    pub vertices: u32,
    pub first_index: u32,
    pub indices: u32,
    /// Its vertices are written anew each frame.
    pub deforms: bool,
}

/// One primitive of one node in one frame: what culling and sorting need to know.
#[derive(Clone, Copy, Debug)]
pub struct Instance {
    /// Index into [`Scene::nodes`].
    pub node: u32,
    /// Index into [`Scene::materials`].
    pub material: u32,
    /// World space.
    pub bounds: Aabb,
    pub first_index: u32,
    pub indices: u32,
    pub cutout: Cutout,
    pub sided: Sided,
    /// Stops light: all but unlit surfaces.
    pub casts: bool,
    /// Of vertices in the streams; the identity for skinned ones.
    pub world_from_object: Mat4,
    /// Of its own, into the streams of positions, normals and tangents.
    pub first_vertex: u32,
    /// Its vertices are written anew each frame.
    pub deformed: bool,
}

/// The scene of one frame on the host.
#[derive(Clone, Debug, Default)]
pub struct Moment {
    /// In the order of [`Handles::instances`].
    pub instances: Vec<Instance>,
    pub lights: Vec<types::Light>,
    /// Around everything, world space; empty for an empty scene.
    pub bounds: Aabb,
    /// Factor on the environment's radiance; 0 without an environment.
    pub environment_scale: f32,
    /// Radians about +Y, counter-clockwise from above.
    pub environment_rotation: f32,
}

impl Moment {
    /// Around all that light meets, world space; empty if there is nothing. Unlit surfaces neither receive nor stop it: a sky dome
    /// does not make a room larger.
    pub fn lit_bounds(&self) -> Aabb {
        around(self.instances.iter().filter(|instance| instance.casts))
    }
}

/// Around instances with a finite place.
fn around<'a>(instances: impl Iterator<Item = &'a Instance>) -> Aabb {
    instances.map(|i| i.bounds).filter(Aabb::is_finite).fold(Aabb::EMPTY, Aabb::union)
}

/// The scene of one frame in one graph: what passes bind. Cheap to clone.
#[derive(Clone, Debug)]
pub struct Handles {
    pub indices: Buffer,
    pub positions: Buffer,
    pub normals: Buffer,
    pub tangents: Buffer,
    pub uvs: Buffer,
    pub colors: Buffer,
    /// `types::Instance`
    pub instances: Buffer,
    /// `types::Material`
    pub materials: Buffer,
    /// The contents of `materials`, for techniques that change them for a frame.
    pub material_table: Arc<[types::Material]>,
    /// Names of the materials, in the same order.
    pub material_names: Arc<[String]>,
    /// `lib/lights.glsl`: count and lights.
    pub lights: Buffer,
    /// `scene_textures` of `lib/material.glsl`.
    pub textures: [Image; MAX_TEXTURE_ARRAYS as usize],
    /// Latitude-longitude radiance, repeating; black without an environment.
    pub environment: Image,
    /// Depth with stencil, as the device has it.
    pub depth_stencil: Format,
    /// Addresses of these buffers, and zero for those that have none.
    pub(crate) at: types::SceneAddresses,
    /// The same moment on the host.
    pub moment: Arc<Moment>,
}

impl Handles {
    /// Around everything, world space.
    pub fn bounds(&self) -> Aabb {
        self.moment.bounds
    }
}

impl Resident {
    /// Uploads a scene and returns when everything is there. The scene must pass its validation.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`; `Runtime` if the scene is larger than the device's limits.
    pub fn new(gpu: &Gpu, scene: &Scene) -> Result<Self> {
        Self::decoded(gpu, scene, textures::Decoding::Device)
    }

    /// For rays alone: textures have no mip levels, and sRGB is decoded exactly where devices may be off by some per cent.
    ///
    /// # Errors
    /// As [`Resident::new`].
    pub(crate) fn for_rays(gpu: &Gpu, scene: &Scene) -> Result<Self> {
        Self::decoded(gpu, scene, textures::Decoding::Exact)
    }

    fn decoded(gpu: &Gpu, scene: &Scene, decoding: textures::Decoding) -> Result<Self> {
        let mut streams = Streams::new(scene)?;
        let mut deform = deform::Deform::default();
        let mut notes = Vec::new();
        let items = items(scene, &mut streams, &mut deform, &mut notes)?;
        let limits = &gpu.caps().limits;
        let packing = textures::pack(scene, limits.image_2d, limits.array_layers)?;
        if packing.resampled > 0 {
            notes.push(note("textures", format!("{} resized to share array images", packing.resampled)));
        }
        if scene.materials.iter().any(|m| m.transmission > 0.0) {
            notes.push(note("materials", told::TRANSMISSION));
        }
        if scene.environment.iter().flat_map(|e| &e.pixels).any(|p| p.max_element() > BRIGHTEST) {
            notes.push(note("environment", told::BRIGHT_SKY));
        }
        let materials: Vec<types::Material> = scene.materials.iter().map(|m| material::material(m, &packing)).collect();
        let mut bytes = 0;
        let mut buffer = |name: &str, contents: &[u8]| -> Result<OwnedBuffer> {
            if contents.len() as u64 > limits.storage_range {
                return Err(Error::new(
                    ErrorKind::Runtime,
                    format!("`{name}` has {} bytes; the device allows {}", contents.len(), limits.storage_range),
                )
                .help("Use a scene with fewer triangles, or another device"));
            }
            bytes += contents.len() as u64;
            OwnedBuffer::with_contents(gpu, name, contents)
        };
        let textures = textures::upload(gpu, scene, &packing, decoding)?;
        Ok(Self {
            positions: buffer("scene.positions", &raw(&streams.positions))?,
            normals: buffer("scene.normals", &raw(&streams.normals))?,
            tangents: buffer("scene.tangents", &raw(&streams.tangents))?,
            uvs: buffer("scene.uvs", &raw(&streams.uvs))?,
            colors: buffer("scene.colors", &raw(&streams.colors))?,
            indices: buffer("scene.indices", &raw(&streams.indices))?,
            materials: buffer("scene.materials", &raw(&materials))?,
            material_table: materials.into(),
            material_names: scene.materials.iter().map(|material| material.name.clone()).collect(),
            skin_vertices: buffer("scene.skin_vertices", &raw(&deform.skin_vertices))?,
            morph_deltas: buffer("scene.morph_deltas", &raw(&deform.morph_deltas))?,
            stream_deltas: buffer("scene.stream_deltas", &raw(&deform.stream_deltas))?,
            bytes: bytes + textures.iter().map(image_bytes).sum::<u64>(),
            textures,
            white: one_texel(gpu, "scene.white", vk::Format::R8G8B8A8_UNORM, &[255; 4])?,
            environment: environment(gpu, scene.environment.as_ref(), limits.image_2d)?,
            items,
            deform: deform.uploaded(),
            notes,
            depth_stencil: match gpu.caps().depth_stencil_format {
                Some(vk::Format::D24_UNORM_S8_UINT) => Format::D24S8,
                _ => Format::D32S8,
            },
        })
    }

    /// Of each instance, in the order of [`Moment::instances`].
    pub(crate) fn shapes(&self) -> Vec<StreamShape> {
        let vertices = (self.positions.size() / 12) as u32;
        let shape = |item: &Item| {
            let Range { first_vertex, first_index, indices, .. } = item.range;
            let vertices = vertices.saturating_sub(first_vertex);
            StreamShape { first_vertex, vertices, first_index, indices, deforms: item.job.is_some() }
        };
        self.items.iter().map(shape).collect()
    }

    /// What is served by something simpler here.
    pub fn notes(&self) -> &[Note] {
        &self.notes
    }

    /// Bytes of buffers and textures on the device.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// The scene after `seconds` with all its animations playing ([`Pose::playing`]), for one graph.
    ///
    /// `scene` is the one that [`Resident::new`] was given; materials and transforms of its nodes may have changed since,
    /// its lists may not.
    pub fn frame(&mut self, graph: &mut Graph, scene: &Scene, seconds: f32) -> Handles {
        self.frame_in(graph, scene, &Pose::playing(scene, seconds))
    }

    /// The scene in `pose`, for one graph.
    pub fn frame_in(&mut self, graph: &mut Graph, scene: &Scene, pose: &Pose) -> Handles {
        let positions = graph.import_buffer(&self.positions);
        let normals = graph.import_buffer(&self.normals);
        let tangents = graph.import_buffer(&self.tangents);
        let uvs = graph.import_buffer(&self.uvs);
        let colors = graph.import_buffer(&self.colors);
        let buffers = deform::Buffers {
            positions,
            normals,
            tangents,
            skin_vertices: graph.import_buffer(&self.skin_vertices),
            morph_deltas: graph.import_buffer(&self.morph_deltas),
            stream_deltas: graph.import_buffer(&self.stream_deltas),
            uvs,
            colors,
        };
        self.deform.declare(graph, scene, pose, &buffers);
        let (instances, moment) = self.moment(scene, pose);
        let lights = lights_bytes(&moment.lights);
        let white = graph.import_image(&self.white).repeat();
        let mut textures = [white; MAX_TEXTURE_ARRAYS as usize];
        for (slot, image) in textures.iter_mut().zip(&self.textures) {
            *slot = graph.import_image(image).repeat();
        }
        Handles {
            indices: graph.import_buffer(&self.indices),
            positions,
            normals,
            tangents,
            uvs,
            colors,
            instances: graph.buffer_from("scene.instances", &at_least_one(&instances)),
            materials: graph.import_buffer(&self.materials),
            material_table: self.material_table.clone(),
            material_names: self.material_names.clone(),
            lights: graph.buffer_from("scene.lights", &lights),
            textures,
            environment: graph.import_image(&self.environment).repeat(),
            depth_stencil: self.depth_stencil,
            at: types::SceneAddresses {
                indices: self.indices.address_words(),
                positions: self.positions.address_words(),
                normals: self.normals.address_words(),
                tangents: self.tangents.address_words(),
                uvs: self.uvs.address_words(),
                colors: self.colors.address_words(),
                materials: self.materials.address_words(),
                ..Default::default()
            },
            moment: Arc::new(moment),
        }
    }

    /// Size of the instances of a frame, bytes.
    pub(crate) fn instances_size(&self) -> u64 {
        (self.items.len().max(1) * size_of::<types::Instance>()) as u64
    }

    /// [`Moment::lit_bounds`] in `pose`.
    pub(crate) fn lit_bounds_in(&self, scene: &Scene, pose: &Pose) -> Aabb {
        self.moment(scene, pose).1.lit_bounds()
    }

    fn moment(&self, scene: &Scene, pose: &Pose) -> (Vec<types::Instance>, Moment) {
        let deformed = self.deform.bounds(scene, pose);
        let mut gpu = Vec::with_capacity(self.items.len());
        let mut host = Vec::with_capacity(self.items.len());
        for item in &self.items {
            let skinned = item.job.is_some_and(|j| self.deform.jobs[j].skin.is_some());
            // Skinned vertices are in world space already.
            let world = if skinned { Mat4::IDENTITY } else { pose.world[item.node] };
            let linear = Mat3::from_mat4(world);
            let mirrored = linear.determinant() < 0.0;
            let Range { first_vertex, uv_first, color_first, material, first_index, indices, bounds, .. } = item.range;
            gpu.push(types::Instance {
                world_from_object: world.to_cols_array_2d(),
                normal_from_object: cofactor(linear).to_cols_array_2d(),
                first_vertex,
                uv_first,
                color_first,
                material,
                flags: if mirrored { crate::shaders::consts::INSTANCE_FLIPPED } else { 0 },
                first_index,
                index_count: indices,
            });
            host.push(Instance {
                node: item.node as u32,
                material,
                bounds: item.job.map_or_else(|| bounds.transformed(&world), |j| deformed[j]),
                first_index,
                indices,
                cutout: item.cutout,
                casts: item.casts,
                world_from_object: world,
                first_vertex,
                deformed: item.job.is_some(),
                sided: match (item.double_sided, mirrored) {
                    (true, _) => Sided::Both,
                    (false, false) => Sided::Front,
                    (false, true) => Sided::Mirrored,
                },
            });
        }
        let bounds = around(host.iter());
        let moment = Moment {
            instances: host,
            lights: lights(scene, pose),
            bounds,
            environment_scale: scene.environment.as_ref().map_or(0.0, |e| e.scale),
            environment_rotation: scene.environment.as_ref().map_or(0.0, |e| e.rotation),
        };
        (gpu, moment)
    }
}

/// All primitives of all nodes; deformed ones get vertices of their own.
fn items(
    scene: &Scene,
    streams: &mut Streams,
    deform: &mut deform::Deform,
    notes: &mut Vec<Note>,
) -> Result<Vec<Item>> {
    let mut items = Vec::new();
    let mut blended = false;
    for (index, node) in scene.nodes.iter().enumerate() {
        let Some(mesh_index) = node.mesh.map(|m| m as usize) else { continue };
        let Some(mesh) = scene.meshes.get(mesh_index) else { continue };
        for (slot, primitive) in mesh.primitives.iter().enumerate() {
            let range = streams.ranges[mesh_index][slot];
            let Some(material) = scene.materials.get(primitive.material as usize) else { continue };
            let mut item = Item {
                node: index,
                range,
                job: None,
                cutout: match material.alpha {
                    AlphaMode::Opaque => Cutout::Opaque,
                    AlphaMode::Mask { .. } => Cutout::Mask,
                    AlphaMode::Blend => Cutout::Blend,
                },
                double_sided: material.double_sided,
                casts: !material.unlit,
            };
            blended |= item.cutout == Cutout::Blend;
            if deform::deforms(primitive, node.skin.is_some()) {
                let (job, range) = deform.add(scene, index, primitive, &range, streams)?;
                (item.job, item.range) = (Some(job), range);
            }
            items.push(item);
        }
    }
    if blended {
        notes.push(note("materials", told::BLENDING));
    }
    Ok(items)
}

/// Notes that a technique may have to replace, for what they say holds for the rasteriser and not for rays.
pub(crate) mod told {
    pub(crate) const TRANSMISSION: &str = "surfaces with transmission are drawn opaque";
    pub(crate) const BLENDING: &str = "alpha blending is dithered: each pixel shows one surface";
    pub(crate) const BRIGHT_SKY: &str = "radiance over 65504 is cut there";
}

fn note(place: impl Into<String>, text: impl Into<String>) -> Note {
    Note { kind: NoteKind::Approximated, place: place.into(), text: text.into() }
}

/// At least one element: a buffer of no bytes cannot be bound.
fn raw<T: Pod>(list: &[T]) -> Vec<u8> {
    if list.is_empty() { vec![0; size_of::<T>()] } else { bytemuck::cast_slice(list).to_vec() }
}

fn at_least_one(list: &[types::Instance]) -> Vec<types::Instance> {
    if list.is_empty() { vec![types::Instance::default()] } else { list.to_vec() }
}

/// Block `Lights` of `lib/lights.glsl`.
pub(crate) fn lights_bytes(lights: &[types::Light]) -> Vec<u32> {
    let mut out = vec![lights.len() as u32];
    out.extend_from_slice(bytemuck::cast_slice(lights));
    if lights.is_empty() {
        out.extend_from_slice(bytemuck::cast_slice(&[types::Light::default()]));
    }
    out
}

fn image_bytes(image: &OwnedImage) -> u64 {
    let desc = image.desc();
    (0..desc.mips).filter_map(|mip| desc.level_bytes(mip)).sum::<u64>() * u64::from(desc.layers)
}

fn one_texel(gpu: &Gpu, name: &str, format: vk::Format, bytes: &[u8]) -> Result<OwnedImage> {
    OwnedImage::with_contents(gpu, name, ImageDesc::new(format, 1, 1), &[Region { mip: 0, layer: 0, bytes }])
}

/// The largest half float.
const BRIGHTEST: f32 = 65504.0;

/// The environment in half floats; radiance over [`BRIGHTEST`] is cut there.
pub(crate) fn environment(gpu: &Gpu, environment: Option<&Environment>, max_side: u32) -> Result<OwnedImage> {
    let name = "scene.environment";
    let format = vk::Format::R16G16B16A16_SFLOAT;
    let Some(env) = environment.filter(|e| !e.pixels.is_empty()) else {
        return one_texel(gpu, name, format, &[0; 8]);
    };
    if env.width > max_side || env.height > max_side {
        return Err(Error::new(
            ErrorKind::Runtime,
            format!("environment is {}×{}; the device allows sides of {max_side}", env.width, env.height),
        )
        .at(format!("environment `{}`", env.name)));
    }
    let texels: Vec<[f16; 4]> = env
        .pixels
        .iter()
        .map(|p| p.clamp(glam::Vec3::ZERO, glam::Vec3::splat(BRIGHTEST)).extend(1.0).to_array().map(f16::from_f32))
        .collect();
    let bits: Vec<[u16; 4]> = texels.iter().map(|t| t.map(f16::to_bits)).collect();
    let desc = ImageDesc::new(format, env.width, env.height);
    OwnedImage::with_contents(gpu, name, desc, &[Region { mip: 0, layer: 0, bytes: bytemuck::cast_slice(&bits) }])
}

//! Instant global illumination with ray-traced virtual point lights (Marques and Santos 2010, after Keller 1997 and Wald et al. 2002).
//!
//! Light paths start at the lamps. They leave a virtual point light on every surface with a diffuse part that they hit. Every
//! visible point then gathers the light of all virtual lights, with one shadow ray to each. Direct light is added, also by
//! shadow rays.
//!
//! [`Igi`] holds the data that lives as long as a scene. [`Igi::picture`] declares the passes of one frame, which shoots new
//! light paths.
//!
//! Where this differs from the paper, and why:
//! - A receiver can pick some virtual lights from a light tree instead of gathering from all ([`Settings::picks`]).
//! - The bound of the geometry term removes light near corners. Short rays can add this light back
//!   ([`Settings::compensation`]).
//! - More paths are shot than needed. Their virtual lights are candidates, and the frame draws its virtual lights among them
//!   with a probability that follows the light that they send to the view ([`Settings::candidates`]).
//! - A filter removes the noise of direct light from emissive surfaces and from the sky ([`Settings::direct_filter`]). The paper's point lights
//!   have no such noise.
//! - Every kind of light sends paths: point, spot and directional lights, emissive surfaces, the environment. The paper has
//!   point lights only.
//! - 1/π is explicit: a virtual light has a flux Φ and sends Φ cos θ / π W/sr; the paper's L is Φ/π, its ρ our ρ/π.
//! - A surface receives light by its shading normal and reflects it by its geometric normal. A path tracer, which works from
//!   the camera's end of the same path, uses the two normals in this way.
//! - The first two dimensions of the Halton table give the directions of paths from near lights, and the starting points of
//!   paths from distant lights.

#[macro_use]
mod traced;

mod cache;
mod compensation;
mod direct;
pub mod filters;
mod gather;
pub mod halton;
pub mod history;
mod importance;
mod light_tree;
mod notes;
mod picture;
mod raster;
mod ray_tree;
mod settings;
pub mod starts;
mod technique;

pub use cache::Cache;
pub use light_tree::LightTree;
pub use notes::notes;
pub use picture::{Picture, PictureSettings};
use settings::LEAST_CELL;
pub use settings::{Pattern, Settings, Visibility};
pub use technique::{GATHERED, Mode};

use crate::{
    Result,
    gpu::Gpu,
    graph::{Buffer, ComputeArgs, Graph, Image, Items, PassRef, RangedArgs, Uniform},
    rays::{RayHandles, Rays},
    resident::{Handles, Resident},
    scene::{Aabb, Pose, Scene},
    shaders::{self, consts, types},
    tracer::tables::{self, AreaLights},
};

/// Maximum of loop iterations that choosing one light takes, besides its ray: one descent of the path tracer's light tree.
const LIGHT_TURNS: u64 = 64;
/// Maximum of loop iterations of one proposal for a pick: a descent of the tree of virtual lights, three iterations a level.
const PROPOSAL_TURNS: u64 = 43;

/// The data of a scene that instant global illumination needs in every frame.
#[derive(Debug)]
pub struct Igi {
    rays: Rays,
    /// Compute acceleration structures for [`Settings::imperfect`]; `None` if `rays` already is in compute, or nothing needs them.
    boxes: Option<Rays>,
    /// `rays` are traced in compute.
    in_compute: bool,
    /// The device has ray queries.
    queries: bool,
    /// The emissive triangles and the environment.
    areas: AreaLights,
    /// [`starts::sky_moments`] of the environment, W/m²; `None` without an environment.
    moments: Option<[f64; 3]>,
    /// Whether the material of each instance is double-sided.
    double_sided: Vec<bool>,
    /// The scene may have mirrors or glass.
    sharp: bool,
    /// Diagonal of the bounding box of all lit surfaces in the rest pose, metres. Settings that are shares of the scene's size
    /// refer to this length, so that animation does not change them.
    size: f32,
    /// Maximum of loop iterations of a ray.
    turns: u64,
    /// Maximum of layers per image on this device.
    most_layers: u32,
}

/// Resources and numbers that all passes of a frame share.
#[derive(Clone, Copy, Debug)]
struct Shared {
    settings: Uniform<types::IgiSettings>,
    /// Contents of `settings`.
    block: types::IgiSettings,
    rays: RayHandles,
    /// Acceleration structures for the shadow rays of virtual lights.
    hidden_by: RayHandles,
    environment: Image,
    environment_edges: Buffer,
    light_columns: Buffer,
    light_targets: Buffer,
    instance_lights: Buffer,
    light_nodes: Buffer,
    /// Shadow rays per point for direct light.
    direct_rays: u32,
    /// Iterations of the filter for direct light from emissive surfaces and from the sky; 0 if the scene has neither.
    direct_filter: u32,
    /// min_d of the bounded geometry term, metres.
    least: f32,
    /// Diagonal of the bounding box of all lit surfaces in the rest pose, metres.
    diagonal: f32,
    /// Seed of the random numbers.
    seed: u32,
    /// Seed of the Cranley-Patterson rotation of the Halton points.
    turn: u32,
    /// Index of the Halton point of the first path.
    first: u32,
}

/// The virtual lights of a frame.
#[derive(Clone, Copy, Debug)]
pub struct Vpls {
    /// `count` values of `types::Vpl`: first the lights at the first hits of all paths, then those at the second hits, and so on.
    /// With a tree they are sorted like its leaves.
    pub buffer: Buffer,
    /// Slots in the buffer. A slot with zero flux holds no light.
    pub count: u32,
    /// The light tree; `None` if no receiver picks lights from a tree.
    pub tree: Option<LightTree>,
}

/// Images of a frame, at full resolution unless stated.
#[derive(Clone, Copy, Debug)]
pub struct Outputs {
    /// Sum of all light, W/(sr·m²); alpha 1 on geometry, 0 on background, where rgb is 0 until a sky is drawn.
    pub total: Image,
    /// Direct light with emission.
    pub direct: Image,
    /// Indirect light as it enters the sum.
    pub indirect: Image,
    /// Radiance that mirrors and glass reflect and transmit, W/(sr·m²); alpha: the share of the surface that is mirror or glass.
    /// `None` if the scene has neither, or [`Settings::specular`] is off.
    pub sharp: Option<Image>,
    /// Irradiance from virtual lights at every pixel, W/m².
    pub irradiance: Image,
    /// The same irradiance before the filters, of size `extent / downsample`; alpha: number of shadow rays.
    pub gathered: Image,
    /// `None` if indirect light is off.
    pub vpls: Option<Vpls>,
    /// The irradiance cache for surfaces that mirrors and glass show; `None` if it is off or nothing needs it.
    pub cache: Option<Cache>,
}

/// Length of the box's diagonal, metres; 0 for an empty box.
fn diagonal(bounds: &Aabb) -> f32 {
    if bounds.is_empty() { 0.0 } else { (bounds.max - bounds.min).length() }
}

/// Dispatches `threads` threads, or the number of workgroups that `groups` (buffer and byte offset) holds.
fn dispatch<A: ComputeArgs>(graph: &mut Graph, args: A, groups: Option<(Buffer, u64)>, threads: u32) -> PassRef<'_> {
    match groups {
        Some((groups, offset)) => graph.compute_indirect(args, groups, offset),
        None => graph.compute(args, threads),
    }
}

/// As [`dispatch`], for a loop over `items`.
fn dispatch_over<A: RangedArgs>(graph: &mut Graph, args: A, groups: Option<Buffer>, threads: u32, items: Items) {
    match groups {
        Some(groups) => graph.compute_indirect_over(args, (groups, 0), items),
        None => graph.compute_over(args, threads, items),
    };
}

impl Igi {
    /// Builds acceleration structures and light tables. [`Settings::visibility`] and [`Settings::imperfect`] choose how rays are
    /// traced; the other settings do not matter here.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`; `Runtime` if the scene is larger than the device's limits; `Usage` if the settings ask for
    /// ray queries and the device has none.
    pub fn new(gpu: &Gpu, scene: &Scene, resident: &Resident, settings: &Settings) -> Result<Self> {
        let queries = gpu.caps().ray_query;
        let in_compute = settings.visibility.in_compute(queries)?;
        let double_sided = |primitive: &crate::scene::Primitive| {
            scene.materials.get(primitive.material as usize).is_some_and(|material| material.double_sided)
        };
        let meshes = scene.nodes.iter().filter_map(|node| scene.meshes.get(node.mesh? as usize));
        let rays = if in_compute { Rays::in_compute(gpu, scene, resident)? } else { Rays::new(gpu, scene, resident)? };
        let turns = rays.most_turns();
        Ok(Self {
            rays,
            boxes: (!in_compute && settings.imperfect).then(|| Rays::in_compute(gpu, scene, resident)).transpose()?,
            in_compute,
            queries,
            areas: AreaLights::new(gpu, scene)?,
            moments: scene.environment.as_ref().filter(|e| !e.pixels.is_empty()).map(starts::sky_moments),
            double_sided: meshes.flat_map(|mesh| mesh.primitives.iter().map(double_sided)).collect(),
            sharp: tables::has_sharp(scene),
            size: diagonal(&resident.lit_bounds_in(scene, &Pose::rest(scene))),
            turns,
            most_layers: gpu.caps().limits.array_layers,
        })
    }

    /// Imports or uploads the resources that all passes of the frame share.
    fn shared(
        &mut self,
        graph: &mut Graph,
        scene: &Scene,
        pose: &Pose,
        handles: &Handles,
        settings: &Settings,
    ) -> Shared {
        let rays = self.rays.frame(graph, handles);
        let hidden_by = match &mut self.boxes {
            Some(boxes) if settings.imperfect => boxes.frame(graph, handles),
            _ => rays,
        };
        let areas = self.areas.frame(graph, scene, pose);
        let bounds = handles.moment.lit_bounds();
        let (low, high) = if bounds.is_empty() { Default::default() } else { (bounds.min, bounds.max) };
        // A scene may be empty or flat in the rest pose and have a size in this pose.
        let diagonal = if self.size > 0.0 { self.size } else { diagonal(&bounds) };
        let glossy = if areas.sky { settings.glossy_rays() } else { 0 };
        let block = types::IgiSettings {
            environment: areas.map,
            low: low.to_array(),
            high: high.to_array(),
            paths: settings.paths() * settings.candidates,
            bounces: settings.bounces,
            specular_depth: settings.specular_depth,
            diffuse_only: (!settings.specular).into(),
            seed: graph.seed,
            samples: settings.direct_samples,
            glossy,
            tree: areas.tree.into(),
            sky: areas.sky.into(),
            slots: consts::TEXTURE_SLOTS,
            two: 2,
        };
        let lights = handles.moment.lights.len() as u32;
        Shared {
            settings: graph.uniform(&block),
            block,
            rays,
            hidden_by,
            environment: areas.environment,
            environment_edges: areas.environment_edges,
            light_columns: areas.light_columns,
            light_targets: areas.light_targets,
            instance_lights: areas.instance_lights,
            light_nodes: areas.light_nodes,
            direct_rays: lights + (u32::from(areas.tree) + u32::from(areas.sky)) * settings.direct_samples + glossy,
            direct_filter: if areas.tree || areas.sky { settings.direct_filter } else { 0 },
            least: settings.bound * diagonal,
            diagonal,
            seed: graph.seed,
            turn: graph.seed,
            first: 0,
        }
    }

    /// Shoots the light paths of a frame and returns the virtual lights that they leave.
    fn shoot(&self, graph: &mut Graph, handles: &Handles, shared: &Shared, settings: &Settings) -> Vpls {
        let paths = settings.paths() * settings.candidates;
        let sided =
            |target: &types::LightTarget| self.double_sided.get(target.instance as usize).copied().unwrap_or(false);
        let emissive = self.areas.table().filter(|table| table.tree);
        let triangles = emissive.map_or((&[][..], &[][..]), |table| (&table.targets[..], &table.nodes[..]));
        let bounds = handles.moment.lit_bounds();
        let sources = starts::sources(&handles.moment.lights, triangles, sided, self.moments, &bounds);
        let starts = starts::starts(&sources, paths, shared.seed);
        let numbers = halton::table_from(shared.first, paths, history::dimensions(settings), shared.turn);
        let count = paths * settings.bounces;
        let buffer = graph.buffer("igi.candidates", u64::from(count) * size_of::<types::Vpl>() as u64);
        let vpls = Vpls { buffer, count, tree: None };
        let states = graph.buffer("igi.paths", u64::from(paths) * size_of::<types::VplPath>() as u64);
        graph.fill(vpls.buffer, 0);
        graph.fill(states, 0);
        let args = traced_lit!(
            shaders::igi::shoot::Args {
                starts: graph.buffer_from("igi.starts", &starts),
                numbers: graph.buffer_from("igi.numbers", &numbers),
                paths: states,
                vpls: vpls.buffer,
                lights: handles.lights,
                push: shaders::igi::shoot::Push::default(),
            },
            shared.rays,
            handles,
            shared
        );
        let segments = settings.bounces + if settings.specular { settings.specular_depth } else { 0 };
        for turn in 0..segments {
            let args = shaders::igi::shoot::Args { push: shaders::igi::shoot::Push { turn }, ..args };
            graph.compute(args, paths).rays(paths.into());
        }
        vpls
    }

    /// A loop of `count` rays in each of `invocations` invocations.
    fn items(&self, count: u32, invocations: u64) -> Items {
        Items::new(count).rays(invocations).turns(self.turns + LIGHT_TURNS)
    }

    /// As [`Self::items`], for rays to lights that each pixel picks from the light tree.
    fn picked(&self, picks: u32, invocations: u64, settings: &Settings) -> Items {
        let descents = u64::from(settings.proposals) * PROPOSAL_TURNS;
        Items::new(picks).rays(invocations).turns(self.turns + descents)
    }
}

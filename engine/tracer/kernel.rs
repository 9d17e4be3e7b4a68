//! The path tracer's resources for one scene on the device, and the passes that trace a range of samples.

use std::ops::Range;

use glam::Vec3;

use super::{
    Filter, Settings, Sources, Strategy,
    environment::{importance, radiance_map},
    job::{BLOCK, Job},
    lights,
    sharp::may_be_sharp,
};
use crate::{
    Result,
    gpu::{BufferDesc, Gpu, OwnedBuffer, OwnedImage},
    graph::{Buffer, Graph},
    rays::{Rays, traced},
    resident::{Handles, Resident},
    scene::{Material, Pose, Scene},
    shaders::{
        consts,
        reference::{path as shader, path_end, path_trace},
        types,
    },
};

/// Maximum of paths that are traced together, which may belong to several samples. The buffer of path states has the same size.
pub(super) const MOST_SLOTS: u64 = 1 << 18;
/// Maximum of passes per submission.
const MOST_PASSES: u64 = 512;
/// Kinds of rays.
const WAYS: usize = 4;

/// The resources of a scene, except those of [`Resident`].
#[derive(Debug)]
pub(super) struct Kernel {
    gpu: Gpu,
    rays: Rays,
    environment: OwnedImage,
    environment_edges: OwnedBuffer,
    /// Columns and rows of the environment's importance map.
    cells: [u32; 2],
    lights: Option<Lights>,
    paths: Option<Paths>,
    /// Maximum of paths that are traced together.
    pub together: u64,
}

/// The states of paths between passes.
#[derive(Debug)]
struct Paths {
    states: OwnedBuffer,
    hits: OwnedBuffer,
    lists: OwnedBuffer,
    /// Counts of paths of even and of odd turns.
    counts: [OwnedBuffer; 2],
}

/// The light table of the chosen sources.
#[derive(Debug)]
struct Lights {
    sources: Sources,
    suns: u32,
    tree: bool,
    columns: OwnedBuffer,
    targets: OwnedBuffer,
    instances: OwnedBuffer,
    nodes: OwnedBuffer,
}

/// The division of a picture's work into passes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cut {
    /// Surfaces after which all paths have ended.
    surfaces: u32,
    /// Maximum of paths that are traced together.
    capacity: u64,
    /// The maximum of rays per surface of a path, and the kind of each ray.
    turns: (u32, [u32; WAYS]),
}

impl Cut {
    /// Maximum of slots per submission.
    pub fn most(&self) -> u64 {
        let passes = u64::from(self.surfaces) * (1 + u64::from(self.turns.0)) + 1;
        self.capacity * (MOST_PASSES / passes).max(1)
    }
}

impl Kernel {
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub fn new(gpu: &Gpu, scene: &Scene, resident: &Resident) -> Result<Self> {
        let importance = importance(scene.environment.as_ref());
        let environment_edges =
            OwnedBuffer::with_contents(gpu, "tracer.environment", bytemuck::cast_slice(&importance.edges))?;
        Ok(Self {
            gpu: gpu.clone(),
            rays: Rays::new(gpu, scene, resident)?,
            environment: radiance_map(gpu, scene.environment.as_ref())?,
            environment_edges,
            cells: importance.cells,
            lights: None,
            paths: None,
            together: MOST_SLOTS,
        })
    }

    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Drops all data that depend on the pose.
    pub fn moved(&mut self) {
        self.lights = None;
    }

    /// Makes the light table of these sources.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub fn light(&mut self, scene: &Scene, pose: &Pose, punctual: &[types::Light], sources: Sources) -> Result<()> {
        if self.lights.as_ref().is_some_and(|l| l.sources == sources) {
            return Ok(());
        }
        let table = lights::table(scene, pose, punctual, sources);
        let buffer = |name, bytes: &[u8]| OwnedBuffer::with_contents(&self.gpu, name, bytes);
        self.lights = Some(Lights {
            sources,
            suns: table.suns,
            tree: table.tree,
            columns: buffer("tracer.light columns", bytemuck::cast_slice(&table.columns))?,
            targets: buffer("tracer.light targets", bytemuck::cast_slice(&table.targets))?,
            instances: buffer("tracer.instance lights", bytemuck::cast_slice(&table.instances))?,
            nodes: buffer("tracer.light tree", bytemuck::cast_slice(&table.nodes))?,
        });
        Ok(())
    }

    /// Divides work on `slots` slots of a picture, after [`Self::light`], and makes the buffer of path states.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub fn cut(&mut self, scene: &Scene, job: &Job, slots: u64) -> Result<Cut> {
        let turns = self.turns(scene, &job.settings)?;
        let surfaces = longest(scene, &job.settings);
        let capacity = slots.min(self.together).max(1);
        let states = capacity * size_of::<types::PathState>() as u64;
        let counts = place_of_count(surfaces + 1, 0);
        if self.paths.as_ref().is_none_or(|p| p.states.size() < states || p.counts[0].size() < counts) {
            let buffer = |name, desc| OwnedBuffer::new(&self.gpu, name, desc);
            self.paths = Some(Paths {
                states: buffer("tracer.paths", BufferDesc::device(states))?,
                hits: buffer("tracer.hits", BufferDesc::device(capacity * size_of::<types::Hit>() as u64))?,
                lists: buffer("tracer.lists", BufferDesc::device(u64::from(consts::PATH_LISTS) * 4 * capacity))?,
                counts: [
                    buffer("tracer.even counts", BufferDesc::device(counts))?,
                    buffer("tracer.odd counts", BufferDesc::device(counts))?,
                ],
            });
        }
        Ok(Cut { surfaces, capacity, turns })
    }

    /// The maximum of rays per surface of a path, and the kind of each ray.
    fn turns(&self, scene: &Scene, settings: &Settings) -> Result<(u32, [u32; WAYS])> {
        let Some(lights) = &self.lights else { return Err(super::not_started()) };
        let sky = settings.sources.environment() && scene.environment.is_some();
        let there = [
            (true, consts::ON),
            (lights.tree, consts::TO_LIGHT),
            (lights.suns > 0, consts::TO_SUN),
            (sky, consts::TO_SKY),
        ];
        let mut ways = [consts::ON; WAYS];
        let mut count = 0;
        for (_, way) in there.iter().filter(|(there, _)| *there) {
            ways[count] = *way;
            count += 1;
        }
        Ok((count as u32, ways))
    }

    /// Declares the passes of a range of slots, which may span several samples. Returns the sums.
    ///
    /// # Errors
    /// `Usage` before [`Self::cut`].
    pub fn declare(
        &mut self,
        graph: &mut Graph,
        (scene, handles): (&Scene, &Handles),
        job: &Job,
        tile: Range<u64>,
        cut: Cut,
    ) -> Result<Buffer> {
        let rays = self.rays.frame(graph, handles);
        let (Some(lights), Some(paths)) = (&self.lights, &self.paths) else { return Err(super::not_started()) };
        let slots = job.slots();
        let settings = graph.uniform(&self.path_settings(scene, job, (lights, paths), cut));
        let view = graph.uniform(&job.view.uniform());
        let sums = graph.import_buffer(&job.sums);
        if tile.start == 0 {
            graph.fill(sums, 0);
        }
        let states = graph.import_buffer(&paths.states);
        let hits = graph.import_buffer(&paths.hits);
        let lists = graph.import_buffer(&paths.lists);
        let counts = [graph.import_buffer(&paths.counts[0]), graph.import_buffer(&paths.counts[1])];
        let surface = shader::Args {
            view,
            scene_at: rays.scene_at,
            surface_instances: handles.instances,
            surface_indices: handles.indices,
            surface_positions: handles.positions,
            surface_normals: handles.normals,
            surface_tangents: handles.tangents,
            surface_uvs: handles.uvs,
            surface_colors: handles.colors,
            environment_radiance_map: graph.import_image(&self.environment),
            environment_edges: graph.import_buffer(&self.environment_edges),
            light_columns: graph.import_buffer(&lights.columns),
            light_targets: graph.import_buffer(&lights.targets),
            instance_lights: graph.import_buffer(&lights.instances),
            light_nodes: graph.import_buffer(&lights.nodes),
            settings,
            paths: states,
            hits,
            lists,
            traced: counts[0],
            counts: counts[1],
            lights: handles.lights,
            materials: handles.materials,
            scene_textures: handles.textures,
            push: shader::Push::default(),
        };
        let trace = traced!(
            path_trace::Args {
                view,
                settings,
                paths: states,
                hits,
                lists,
                counts: counts[0],
                spec: path_trace::Spec::default(),
                push: path_trace::Push::default(),
            },
            rays
        );
        let (turns, ways) = cut.turns;
        let mut at = tile.start;
        while at < tile.end {
            let (sample_index, first) = ((at / slots) as u32, (at % slots) as u32);
            let count = (tile.end - at).min(cut.capacity) as u32;
            let begin = graph.buffer_from("tracer.begin", &first_counts(cut.surfaces, count));
            for counts in counts {
                graph.copy_buffer(begin, counts.range(0..begin.size));
            }
            let rays = |graph: &mut Graph, turn: u32, way: u32| {
                let counts = counts[turn as usize % 2];
                let spec = path_trace::Spec { to_lights: u32::from(way != consts::ON) };
                let push = path_trace::Push { first, sample_index, turn, way };
                let args = path_trace::Args { counts, spec, push, ..trace };
                graph.compute_indirect(args, counts, place_of_count(turn, way)).rays(count.into());
            };
            for number in 0..cut.surfaces {
                rays(graph, number, consts::ON);
                let [traced, counts] = [number, number + 1].map(|turn| counts[turn as usize % 2]);
                let push = shader::Push { first, sample_index, surface: number };
                let args = shader::Args { traced, counts, push, ..surface };
                graph.compute_indirect(args, traced, place_of_count(number, consts::ON));
                for way in ways.iter().take(turns as usize).filter(|way| **way != consts::ON) {
                    rays(graph, number + 1, *way);
                }
            }
            let push = path_end::Push { first, sample_index, count };
            let pixels = slots.min(count.into()) as u32;
            graph.compute(path_end::Args { settings, paths: states, push }, [pixels, 1, 1]).writing(sums);
            at += u64::from(count);
        }
        Ok(sums)
    }

    fn path_settings(
        &self,
        scene: &Scene,
        job: &Job,
        (lights, paths): (&Lights, &Paths),
        cut: Cut,
    ) -> types::PathSettings {
        let settings = &job.settings;
        let environment = scene.environment.as_ref();
        let (turns, turn_ways) = cut.turns;
        let mut flags = 0;
        let mut set = |on: bool, flag: u32| flags |= if on { flag } else { 0 };
        set(settings.diffuse_only, consts::PATH_DIFFUSE_ONLY);
        set(settings.filter == Filter::Box, consts::PATH_JITTER);
        set(settings.sources.emissive(), consts::PATH_SEES_EMISSION);
        set(settings.sources.environment() && environment.is_some(), consts::PATH_SEES_ENVIRONMENT);
        set(settings.strategy == Strategy::Bsdf, consts::PATH_NO_LIGHT_SAMPLES);
        set(settings.strategy == Strategy::Lights, consts::PATH_NO_BSDF_SAMPLES);
        let textures = textures(scene, settings);
        let size = environment.map_or([1, 1], |e| [e.width as i32, e.height as i32]);
        types::PathSettings {
            environment: types::EnvironmentMap {
                size,
                cells: self.cells,
                rotation: environment.map_or(0.0, |e| e.rotation),
                scale: environment.map_or(0.0, |e| e.scale),
            },
            extent: job.view.extent,
            first_row: job.first_row(),
            blocks: job.view.extent[0].div_ceil(BLOCK),
            suns: lights.suns,
            tree: lights.tree.into(),
            bounces: settings.bounces,
            specular_bounces: settings.specular_bounces,
            roulette: settings.roulette,
            flags,
            seed: settings.seed,
            textures: textures.len() as u32,
            texture_slots: std::array::from_fn(|i| textures.get(i).copied().unwrap_or(0)),
            turns,
            turn_ways,
            slots: job.slots() as u32,
            first_slot: job.first_slot() as u32,
            capacity: cut.capacity as u32,
            sum_pixels: job.pixels() as u32,
            sums_at: job.sums.address_words(),
            paths_at: paths.states.address_words(),
            hits_at: paths.hits.address_words(),
            lists_at: paths.lists.address_words(),
            light_nodes_at: lights.nodes.address_words(),
            light_targets_at: lights.targets.address_words(),
            environment_at: self.environment_edges.address_words(),
            plan: settings.plan(),
        }
    }
}

/// `texture_slots` of the settings: the kinds of textures that some material has and that the path tracer looks at.
fn textures(scene: &Scene, settings: &Settings) -> Vec<u32> {
    let any = |has: fn(&Material) -> bool| scene.materials.iter().any(has);
    let lamps = |has: fn(&Material) -> bool| {
        settings.sources.emissive() && scene.materials.iter().any(|m| m.emissive != Vec3::ZERO && has(m))
    };
    let kinds = [
        (consts::TEXTURE_BASE_COLOR, any(|m| m.base_color_texture.is_some())),
        (consts::TEXTURE_METALLIC_ROUGHNESS, any(|m| m.metallic_roughness_texture.is_some())),
        (consts::TEXTURE_NORMAL, any(|m| m.normal_texture.is_some())),
        (consts::TEXTURE_EMISSIVE, any(|m| m.emissive_texture.is_some())),
        (consts::TEXTURE_TRANSMISSION, !settings.diffuse_only && any(|m| m.transmission_texture.is_some())),
        (consts::TEXTURE_OF_LAMP + consts::TEXTURE_BASE_COLOR, lamps(|m| m.base_color_texture.is_some())),
        (consts::TEXTURE_OF_LAMP + consts::TEXTURE_EMISSIVE, lamps(|m| m.emissive_texture.is_some())),
    ];
    kinds.into_iter().filter(|(_, has)| *has).map(|(kind, _)| kind).collect()
}

/// Maximum of surfaces along a path.
fn longest(scene: &Scene, settings: &Settings) -> u32 {
    let sharp = !settings.diffuse_only && may_be_sharp(scene);
    settings.bounces + 2 + if sharp { settings.specular_bounces } else { 0 }
}

/// Place of a [`types::PathCount`], bytes.
fn place_of_count(turn: u32, way: u32) -> u64 {
    size_of::<types::PathCount>() as u64 * (WAYS as u64 * u64::from(turn) + u64::from(way))
}

/// The counts of paths before the first pass: all are at the camera.
fn first_counts(surfaces: u32, paths: u32) -> Vec<types::PathCount> {
    let none = types::PathCount { groups: 0, one: 1, another: 1, paths: 0 };
    let mut counts = vec![none; WAYS * (surfaces as usize + 1)];
    if let Some(all) = counts.get_mut(consts::ON as usize) {
        *all = types::PathCount { groups: paths.div_ceil(consts::PATH_GROUP), paths, ..none };
    }
    counts
}

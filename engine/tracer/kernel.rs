//! The path tracer's resources for one scene on the device, and the passes that trace a range of samples.

use std::ops::Range;

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
    graph::{Graph, Image},
    rays::{Rays, traced},
    resident::{Handles, Resident},
    scene::{Pose, Scene},
    shaders::{
        consts,
        reference::{path as shader, path_trace},
        types,
    },
};

/// Maximum of paths that are traced together. The buffer of path states has the same size.
const MOST_SLOTS: u64 = 1 << 18;
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
    environment_columns: OwnedBuffer,
    /// Columns and rows of the environment's importance map.
    cells: [u32; 2],
    lights: Option<Lights>,
    paths: Option<Paths>,
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
    /// Maximum of slots per submission. It also limits small pictures, whose samples are many passes.
    pub fn most(&self) -> u64 {
        let passes = u64::from(self.surfaces) * (1 + u64::from(self.turns.0));
        self.capacity * (MOST_PASSES / passes).max(1)
    }
}

impl Kernel {
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub fn new(gpu: &Gpu, scene: &Scene, resident: &Resident) -> Result<Self> {
        let importance = importance(scene.environment.as_ref());
        let environment_columns =
            OwnedBuffer::with_contents(gpu, "tracer.environment", bytemuck::cast_slice(&importance.columns))?;
        Ok(Self {
            gpu: gpu.clone(),
            rays: Rays::new(gpu, scene, resident)?,
            environment: radiance_map(gpu, scene.environment.as_ref())?,
            environment_columns,
            cells: importance.cells,
            lights: None,
            paths: None,
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

    /// Divides the work on a picture, after [`Self::light`], and makes the buffer of path states.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub fn cut(&mut self, scene: &Scene, job: &Job) -> Result<Cut> {
        let turns = self.turns(scene, &job.settings)?;
        let surfaces = longest(scene, &job.settings);
        let capacity = MOST_SLOTS.min(job.slots());
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

    /// Declares the passes of a range of slots, which may span several samples. Returns the image of the sums.
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
    ) -> Result<Image> {
        let rays = self.rays.frame(graph, handles);
        let (Some(lights), Some(paths)) = (&self.lights, &self.paths) else { return Err(super::not_started()) };
        let (slots, offset) = (job.slots(), job.first_slot());
        let settings = graph.uniform(&self.path_settings(scene, job, lights, cut));
        let view = graph.uniform(&job.view.uniform());
        let sums = graph.import_image(&job.sums);
        if tile.start == 0 {
            graph.clear(sums, [0.0; 4]);
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
            environment_columns: graph.import_buffer(&self.environment_columns),
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
            sums,
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
            let (sample, first) = (at / slots, at % slots);
            let count = (slots - first).min(tile.end - at).min(cut.capacity) as u32;
            let begin = graph.buffer_from("tracer.begin", &first_counts(cut.surfaces, count));
            for counts in counts {
                graph.copy_buffer(begin, counts.range(0..begin.size));
            }
            let (first, sample_index) = ((offset + first) as u32, sample as u32);
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
            at += u64::from(count);
        }
        Ok(sums)
    }

    fn path_settings(&self, scene: &Scene, job: &Job, lights: &Lights, cut: Cut) -> types::PathSettings {
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
            slots: consts::TEXTURE_SLOTS + 2,
            two: 2,
            turns,
            turn_ways,
            capacity: cut.capacity as u32,
            paths_at: self.paths.as_ref().map_or([0; 2], |paths| paths.states.address_words()),
            light_nodes_at: lights.nodes.address_words(),
        }
    }
}

/// Maximum of surfaces along a path.
fn longest(scene: &Scene, settings: &Settings) -> u32 {
    let sharp = !settings.diffuse_only && may_be_sharp(scene);
    settings.bounces + 3 + if sharp { settings.specular_bounces } else { 0 }
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

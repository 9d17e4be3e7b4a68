//! The work on one picture, divided into tiles that are short enough for watchdogs.

use super::{Filter, Progress, Settings, Strategy, Sums, Tracer, sharp::may_be_sharp};
use crate::{
    Error, ErrorKind, Result,
    gpu::{BufferDesc, Gpu, ImageDesc, OwnedBuffer, OwnedImage, Region, Tiles},
    graph::Graph,
    scene::{Scene, View},
    shaders::{consts, reference::path as shader, types},
};
use ash::vk;
use std::time::Duration;

/// Side of the blocks of pixels by which slots are ordered.
const BLOCK: u32 = 8;
/// Slots of a block: one workgroup.
const GRANULE: u32 = BLOCK * BLOCK;
/// Maximum of slots per dispatch. The buffer of path states has the same size.
const MOST_SLOTS: u64 = 1 << 18;
/// Maximum of dispatches per submission.
const MOST_PASSES: u64 = 64;
/// Rays per path that one invocation traces.
const RAYS: u32 = 32;
/// The same on drivers that abort long loops: two rays of at most 30,000 steps stay below the limit.
const RAYS_LIMITED: u32 = 2;
/// Images of the sums: six sums, and the rounding errors of the first three.
pub(super) const LAYERS: u32 = consts::PATH_SUMS + consts::PATH_EXACT_SUMS;

/// The work on a picture.
#[derive(Debug)]
pub(super) struct Job {
    pub view: View,
    pub settings: Settings,
    sums: OwnedImage,
    /// Finished slots, summed over all samples.
    done: u64,
    time: Duration,
}

impl Job {
    pub fn new(gpu: &Gpu, view: View, settings: Settings) -> Result<Self> {
        let [width, height] = view.extent;
        let most = gpu.caps().limits.image_2d;
        if width.max(height) > most {
            let what = format!("a picture of {width}×{height}; the device allows sides of {most}");
            return Err(Error::new(ErrorKind::Runtime, what));
        }
        let mut desc = ImageDesc::new(vk::Format::R32G32B32A32_SFLOAT, width, height).layers(LAYERS);
        desc.usage =
            vk::ImageUsageFlags::STORAGE | vk::ImageUsageFlags::TRANSFER_SRC | vk::ImageUsageFlags::TRANSFER_DST;
        let sums = OwnedImage::new(gpu, "tracer.sums", desc)?;
        Ok(Self { view, settings, sums, done: 0, time: Duration::ZERO })
    }

    /// Slots of one sample: the pixels, rounded up to whole blocks.
    fn slots(&self) -> u64 {
        // The number of slots of every image that a device supports fits into 64 bits.
        slots_of(self.view.extent).unwrap_or(u64::MAX)
    }

    /// Samples of every pixel.
    pub fn samples_done(&self) -> u64 {
        self.done / self.slots()
    }

    pub fn progress(&self) -> Progress {
        let [width, height] = self.view.extent.map(u64::from);
        let samples = self.done as f64 / self.slots() as f64;
        Progress { samples, paths: (samples * (width * height) as f64) as u64, time: self.time }
    }

    pub fn sums(&self) -> Result<Sums> {
        let empty = self.sums.layout() == vk::ImageLayout::UNDEFINED;
        let [width, height] = self.view.extent;
        let layer = |layer| -> Result<Vec<[f32; 4]>> {
            if empty {
                return Ok(vec![[0.0; 4]; width as usize * height as usize]);
            }
            Ok(self.sums.read(0, layer)?.chunks_exact(16).map(bytemuck::pod_read_unaligned).collect())
        };
        let layers = (0..LAYERS).map(layer).collect::<Result<_>>()?;
        Ok(Sums::new([width, height], layers, self.done / self.slots(), self.done % self.slots()))
    }

    /// Replaces the sums.
    pub fn set_sums(&mut self, sums: &Sums) -> Result<()> {
        let regions: Vec<Region<'_>> = sums
            .raw()
            .iter()
            .enumerate()
            .map(|(layer, texels)| Region { mip: 0, layer: layer as u32, bytes: bytemuck::cast_slice(texels) })
            .collect();
        self.sums.upload(&regions)?;
        self.done = sums.samples() * self.slots() + sums.begun();
        Ok(())
    }
}

/// Slots of one sample of a picture of this size; `None` on overflow.
pub(super) fn slots_of(extent: [u32; 2]) -> Option<u64> {
    let [width, height] = extent.map(|side| u64::from(side.div_ceil(BLOCK)));
    width.checked_mul(height)?.checked_mul(GRANULE.into())
}

/// Maximum of surfaces along a path.
fn longest(scene: &Scene, settings: &Settings) -> u32 {
    let sharp = !settings.diffuse_only && may_be_sharp(scene);
    settings.bounces + 3 + if sharp { settings.specular_bounces } else { 0 }
}

impl Tracer<'_> {
    pub(super) fn advance(&mut self, samples: u64, go_on: &mut dyn FnMut(&Progress) -> bool) -> Result<Progress> {
        let job = self.job()?;
        let (slots, done) = (job.slots(), job.done);
        if samples > u64::from(u32::MAX) {
            return Err(Error::usage(format!("{samples} samples a pixel; at most {} are numbered", u32::MAX)));
        }
        let total = samples.saturating_mul(slots).max(done);
        let limited = self.gpu.loop_limit()?.is_some();
        let rays = if limited { RAYS_LIMITED } else { RAYS };
        let (turns, _) = self.turns()?;
        let rounds = (turns * longest(self.scene, &job.settings)).div_ceil(rays);
        let capacity = MOST_SLOTS.min(slots);
        self.prepare_paths(capacity)?;
        // This limit also applies to small pictures, whose samples are many passes.
        let most = (capacity * (MOST_PASSES / u64::from(rounds)).max(1)).max(u64::from(GRANULE));
        let mut tiles = Tiles::new(total, GRANULE).at_most(most).after(done).first(self.tile);
        if let Some(fixed) = self.fixed_tile {
            tiles = tiles.first(fixed);
        }
        while let Some(tile) = tiles.next_tile() {
            let mut graph = Graph::new("tracer");
            self.declare(&mut graph, tile.clone(), (rays, rounds), capacity)?;
            let frame = self.runner.run(&graph)?;
            let time = Duration::from_secs_f64(frame.report.wait_ms.max(0.0) * 1e-3);
            match self.fixed_tile {
                Some(fixed) => tiles = Tiles::new(total, GRANULE).at_most(most).after(tile.end).first(fixed),
                None => tiles.took(time),
            }
            let job = self.job_mut()?;
            job.done = tile.end;
            job.time += time;
            let progress = job.progress();
            if !go_on(&progress) {
                break;
            }
        }
        if self.fixed_tile.is_none() {
            self.tile = tiles.size();
        }
        Ok(self.job()?.progress())
    }

    /// The maximum of rays per surface of a path, and the kind of each ray.
    fn turns(&self) -> Result<(u32, [u32; 4])> {
        let (Some(lights), Some(job)) = (&self.lights, &self.job) else { return Err(super::not_started()) };
        let sky = job.settings.sources.environment() && self.scene.environment.is_some();
        let there = [
            (true, consts::ON),
            (lights.tree, consts::TO_LIGHT),
            (lights.suns > 0, consts::TO_SUN),
            (sky, consts::TO_SKY),
        ];
        let mut ways = [consts::ON; 4];
        let mut count = 0;
        for (_, way) in there.iter().filter(|(there, _)| *there) {
            ways[count] = *way;
            count += 1;
        }
        Ok((count as u32, ways))
    }

    fn prepare_paths(&mut self, slots: u64) -> Result<()> {
        let bytes = slots * size_of::<types::PathState>() as u64;
        if self.paths.as_ref().is_none_or(|p| p.size() < bytes) {
            self.paths = Some(OwnedBuffer::new(&self.gpu, "tracer.paths", BufferDesc::device(bytes))?);
        }
        Ok(())
    }

    /// Declares the passes of a tile, which may span several samples.
    fn declare(
        &mut self,
        graph: &mut Graph,
        tile: std::ops::Range<u64>,
        (rays_each, rounds): (u32, u32),
        capacity: u64,
    ) -> Result<()> {
        let handles = self.resident.frame_in(graph, self.scene, &self.pose);
        let rays = self.rays.frame(graph, &handles);
        let (Some(job), Some(lights), Some(paths)) = (&self.job, &self.lights, &self.paths) else {
            return Err(super::not_started());
        };
        let slots = job.slots();
        let settings = graph.uniform(&path_settings(self, job, lights, self.turns()?));
        let view = graph.uniform(&job.view.uniform());
        let sums = graph.import_image(&job.sums);
        if job.done == 0 && tile.start == 0 {
            graph.clear(sums, [0.0; 4]);
        }
        let args = shader::Args {
            view,
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
            paths: graph.import_buffer(paths),
            sums,
            lights: handles.lights,
            materials: handles.materials,
            scene_textures: handles.textures,
            trace_nodes: rays.trace_nodes,
            trace_triangles: rays.trace_triangles,
            trace_instances: rays.trace_instances,
            trace_indices: rays.trace_indices,
            trace_uvs: rays.trace_uvs,
            trace_colors: rays.trace_colors,
            trace_scene: rays.trace_scene,
            trace_accel: rays.trace_accel,
            push: shader::Push::default(),
        };
        let mut at = tile.start;
        while at < tile.end {
            let (sample, first) = (at / slots, at % slots);
            let count = (slots - first).min(tile.end - at).min(capacity) as u32;
            for round in 0..rounds {
                let push = shader::Push {
                    first: first as u32,
                    count,
                    sample_index: sample as u32,
                    turn: round * rays_each,
                    rays: rays_each,
                };
                graph.compute(shader::Args { push, ..args }, count);
            }
            at += u64::from(count);
        }
        Ok(())
    }
}

fn path_settings(
    tracer: &Tracer<'_>,
    job: &Job,
    lights: &super::Lights,
    (turns, turn_ways): (u32, [u32; 4]),
) -> types::PathSettings {
    let settings = &job.settings;
    let environment = tracer.scene.environment.as_ref();
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
            cells: tracer.cells,
            rotation: environment.map_or(0.0, |e| e.rotation),
            scale: environment.map_or(0.0, |e| e.scale),
        },
        extent: job.view.extent,
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
    }
}

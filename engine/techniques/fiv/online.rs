//! Vectors of one frame, computed on the device only for the samples that pixels look up.
//!
//! There are four steps. The host never learns the number of samples:
//! 1. Every pixel marks the samples of each occluder that its lookup reads, a bit each.
//! 2. The marks of each geometry become a list in the order of sample numbers, by prefix sums over blocks. The order is
//!    the same in every run.
//! 3. The vectors of the list are computed as [`cover`](super::cover) computes them before the first frame.
//! 4. The vectors are copied to the places where the lookup reads them.
//!
//! Samples lie around an occluder in its current pose, in world axes. The picture is therefore the same as with vectors
//! that were precomputed for this pose. Rays are transformed into the geometry at rest. Only occluders that deform have
//! their own acceleration structures, which are refitted to each pose. Occluders of one geometry with the same rotation
//! and scale share their samples.
//!
//! The shadow of an occluder on itself needs no samples, because the occluder covers few pixels: each of its pixels
//! sums up the light that passes its own geometry. [`SelfSamples::Spheres`](super::SelfSamples::Spheres) is the method
//! of the thesis.

use std::{collections::BTreeMap, ops::Range};

use glam::Mat3;

use super::{
    Occluders, Settings,
    cover::tiles,
    light::Light,
    occluder,
    online_occluders::{FrameOccluders, PlacementInputs, Set},
    samples::Grid,
};
use crate::{
    Error, ErrorKind, Result,
    gpu::{Gpu, OwnedBuffer},
    graph::{Buffer, Extent, Graph, Image, Items},
    passes::gbuffer::GBuffer,
    rays::{RayHandles, Rays},
    resident::{Resident, deforms},
    scene::{Pose, Scene},
    shaders::{
        consts::{FIV_BLOCK_SAMPLES, FIV_BLOCK_WORDS, FIV_FLOATS, FIV_INSIDE, FIV_ROW},
        fiv, types,
    },
};

/// Most points of a batch, and bytes of its partial sums, approximately.
const MOST_POINTS: u64 = 32_768;
const MOST_PARTIALS: u64 = 64 << 20;
/// State that outlives a frame: geometries with their acceleration structures.
#[derive(Debug)]
pub struct Online {
    shapes: Vec<Shape>,
    /// The geometry of each placed occluder, and whether the geometry deforms.
    of_placed: Vec<(usize, bool)>,
    /// Linear transforms of the placed occluders at rest.
    rest: Vec<Mat3>,
    /// Directions of the samples of a sphere, from the receiver to the occluder.
    directions: OwnedBuffer,
    grid: Grid,
    reach: f32,
    split: u32,
    /// Largest size of a storage buffer, bytes.
    limit: u64,
}

/// A geometry that rays are traced through.
#[derive(Debug)]
struct Shape {
    traced: TracedScene,
    resident: Resident,
    rays: Rays,
    tiles: u64,
}

#[derive(Debug)]
enum TracedScene {
    /// A kind of occluder at rest, with its centre at the origin.
    Still(usize),
    /// One node of a scene, in world space.
    Deforming(Box<Scene>),
}

/// Inputs from the pixels of a frame.
#[derive(Clone, Copy, Debug)]
pub struct Seen<'a> {
    pub gbuffer: &'a GBuffer,
    /// Number of the visible occluder of each pixel.
    pub identity: Image,
    /// [`FrameOccluders::list`] on the device.
    pub occluders: Buffer,
    /// Irradiance that reaches a pixel past its own occluder. These passes write the image if the settings ask for
    /// shadows from surfaces.
    pub own: Image,
    /// Occluders that may affect each tile of pixels, a bit each, and words per tile.
    pub near: (Buffer, u32),
}

/// Lists of points with their sample numbers, on the device.
#[derive(Clone, Copy, Debug)]
struct Lists {
    points: Buffer,
    samples: Buffer,
    groups: Buffer,
    turns: Buffer,
}

impl Online {
    /// Builds the acceleration structures of all geometries.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`; `Runtime` if an occluder is larger than the device's limits.
    pub fn new(gpu: &Gpu, scene: &Scene, occluders: &Occluders, settings: &Settings) -> Result<Self> {
        let mut shapes: Vec<Shape> = Vec::new();
        let mut known = BTreeMap::new();
        let mut of_placed = Vec::new();
        for placed in &occluders.placed {
            let (node, kind) = (placed.node as usize, placed.kind as usize);
            let primitives = scene.nodes[node].mesh.map_or(&[][..], |mesh| &scene.meshes[mesh as usize].primitives);
            let deforms = primitives.iter().any(|p| deforms(p, scene.nodes[node].skin.is_some()));
            if let Some(&shape) = known.get(&kind).filter(|_| !deforms) {
                of_placed.push((shape, false));
                continue;
            }
            let traced = match deforms {
                true => TracedScene::Deforming(Box::new(occluder::only(scene, node))),
                false => TracedScene::Still(kind),
            };
            of_placed.push((shapes.len(), deforms));
            if !deforms {
                known.insert(kind, shapes.len());
            }
            let geometry = traced.scene(occluders);
            let resident = Resident::new(gpu, geometry)?;
            let rays = Rays::new(gpu, geometry, &resident)?;
            let tiles = tiles(gpu, &rays)?;
            shapes.push(Shape { traced, resident, rays, tiles });
        }
        let grid = settings.grid();
        let at = |ring: u32| grid.direction(ring % grid.azimuths, ring / grid.azimuths).as_vec3().to_array();
        let directions: Vec<[f32; 3]> = (0..grid.azimuths * grid.polars).map(at).collect();
        let pose = Pose::rest(scene);
        Ok(Self {
            shapes,
            of_placed,
            rest: occluders.placed.iter().map(|p| Mat3::from_mat4(pose.world[p.node as usize])).collect(),
            directions: OwnedBuffer::with_contents(gpu, "fiv.directions", bytemuck::cast_slice(&directions))?,
            grid,
            reach: settings.reach,
            split: settings.split,
            limit: gpu.caps().limits.storage_range,
        })
    }

    /// Blocks of marks per set.
    fn blocks(&self) -> u32 {
        self.grid.count().div_ceil(FIV_BLOCK_SAMPLES)
    }

    /// All occluders in their current poses.
    pub fn in_frame(&self, scene: &Scene, pose: &Pose, occluders: &Occluders) -> FrameOccluders {
        let inputs = PlacementInputs {
            scene,
            occluders,
            shapes: &self.of_placed,
            rest: &self.rest,
            grid: self.grid,
            reach: self.reach,
            floats: self.blocks() * FIV_BLOCK_SAMPLES * FIV_FLOATS,
        };
        FrameOccluders::of(&inputs, pose)
    }

    /// Declares the passes that compute the vectors for the pixels of `seen`. Returns a buffer with a range for each
    /// set.
    ///
    /// # Errors
    /// `Runtime` if the samples take more memory than the device allows for a buffer.
    pub fn vectors(
        &mut self,
        graph: &mut Graph,
        (occluders, pose): (&Occluders, &Pose),
        in_frame: &FrameOccluders,
        light: &Light,
        seen: &Seen<'_>,
        settings: &Settings,
    ) -> Result<Buffer> {
        let (blocks, count) = (self.blocks(), in_frame.sets.len() as u32);
        let samples = u64::from(count) * u64::from(blocks * FIV_BLOCK_SAMPLES);
        let bytes = 4 * u64::from(FIV_FLOATS) * samples;
        if bytes > self.limit {
            let what = format!("the samples of {count} occluders that stand differently have {bytes} bytes");
            return Err(Error::new(ErrorKind::Runtime, format!("{what}; the device allows {}", self.limit))
                .at("fiv")
                .help("Take fewer samples (fiv.azimuths, fiv.polars, fiv.radii)"));
        }
        let extent = graph.extent(seen.gbuffer.depth);
        let fivs = graph.buffer("fiv.online", bytes.max(4));
        // A sample that no pixel marked must have no weight if rounding leads a lookup to it.
        graph.fill(fivs, FIV_INSIDE.to_bits());
        if count == 0 {
            return Ok(fivs);
        }
        let marks = self.marks(graph, seen, samples, settings);
        let jobs = self.jobs(in_frame, extent, light);
        let lists = self.lists(graph, in_frame, marks, &jobs, samples);
        let found = graph.buffer("fiv.found", bytes);
        let coverage = graph.buffer("fiv.coverage", 4 * samples);
        let texels = graph.import_buffer(&light.texels);
        let normals = graph.buffer_from("fiv.normals", &[[0f32; 3]]);
        for job in &jobs.list {
            let shape = &mut self.shapes[job.shape];
            let scene = shape.traced.scene(occluders);
            let rest;
            let pose = match &shape.traced {
                TracedScene::Still(_) => {
                    rest = Pose::rest(scene);
                    &rest
                }
                TracedScene::Deforming(_) => pose,
            };
            let handles = shape.resident.frame_in(graph, scene, pose);
            let rays = shape.rays.frame(graph, &handles);
            if settings.self_shadow && settings.on_surface() {
                let sets = (job.sets.start as u32, job.sets.len() as u32);
                let floats = blocks * FIV_BLOCK_SAMPLES * FIV_FLOATS;
                own(graph, seen, light, (texels, lists.turns, rays), (sets, floats), shape.rays.most_turns());
            }
            let partials = graph.buffer("fiv.partials", jobs.each * u64::from(jobs.chunks) * 40);
            for batch in job.batches.clone() {
                let first = (job.first + u64::from(batch - job.batches.start) * jobs.each) as u32;
                let args = crate::rays::traced!(
                    fiv::cover::Args {
                        texels,
                        points: lists.points,
                        partials,
                        turns: lists.turns,
                        normals,
                        push: fiv::cover::Push {
                            first,
                            size: light.size,
                            split: self.split,
                            tiles: jobs.tiles,
                            own: 0
                        },
                    },
                    rays
                );
                let groups = u64::from(batch) * 24;
                graph.compute_indirect(args, lists.groups, groups);
                let push = fiv::gather::Push {
                    first,
                    count: jobs.each as u32,
                    chunks: jobs.chunks,
                    inside: super::cover::inside(),
                    own: 0,
                };
                let args = fiv::gather::Args { partials, fivs: found, coverage, push };
                graph.compute_indirect(args, lists.groups, groups + 12);
                let push = fiv::online_scatter::Push { first, batch };
                let (samples, counts) = (lists.samples, lists.groups);
                let args = fiv::online_scatter::Args { found, samples, groups: counts, fivs, push };
                graph.compute_indirect(args, lists.groups, groups + 12);
            }
        }
        Ok(fivs)
    }

    /// A bit for each sample that a pixel looks up.
    fn marks(&self, graph: &mut Graph, seen: &Seen<'_>, samples: u64, settings: &Settings) -> Buffer {
        let marks = graph.buffer("fiv.marks", samples / 8);
        graph.fill(marks, 0);
        let (extent, (near, words)) = (graph.extent(seen.gbuffer.depth), seen.near);
        let args = fiv::online_mark::Args {
            view: seen.gbuffer.view,
            normal: seen.gbuffer.normal,
            depth: seen.gbuffer.depth,
            identity: seen.identity,
            occluders: seen.occluders,
            marks,
            near,
            push: fiv::online_mark::Push { words, ..Default::default() },
            spec: fiv::online_mark::Spec {
                partial: settings.partial.into(),
                own: (settings.self_shadow && !settings.on_surface()).into(),
                trilinear: settings.trilinear.into(),
            },
        };
        // A word has 32 occluders, each with at most eight samples.
        graph.compute_over(args, extent, Items::new(words).rays(extent.pixels()).turns(512));
        marks
    }

    /// Upper bound of the work of each geometry.
    fn jobs(&self, in_frame: &FrameOccluders, extent: Extent, light: &Light) -> Jobs {
        let row = light.size * self.split / 8;
        let all = 6 * row * row;
        let used = || in_frame.sets.iter().map(|set| self.shapes[set.shape].tiles);
        let tiles = used().min().unwrap_or(1).min(all.into()) as u32;
        let chunks = all.div_ceil(tiles);
        let samples = u64::from(self.blocks() * FIV_BLOCK_SAMPLES);
        let set_of = |first: u32| (first / (self.blocks() * FIV_BLOCK_SAMPLES * FIV_FLOATS)) as usize;
        let shape_of = |first: u32| in_frame.sets[set_of(first)].shape;
        let mut occluders = vec![0u64; self.shapes.len()];
        in_frame.list.iter().for_each(|occluder| occluders[shape_of(occluder.first)] += 1);
        // A lookup reads eight samples for each pixel and occluder.
        let most = |shape: usize, sets: u64| (8 * extent.pixels() * occluders[shape]).min(sets * samples);
        let mut list: Vec<Job> = Vec::new();
        for (number, set) in in_frame.sets.iter().enumerate() {
            match list.last_mut() {
                Some(job) if job.shape == set.shape => job.sets.end += 1,
                _ => list.push(Job {
                    shape: set.shape,
                    sets: number..number + 1,
                    first: number as u64 * samples,
                    batches: 0..0,
                }),
            }
        }
        let largest = list.iter().map(|job| most(job.shape, job.sets.len() as u64)).max().unwrap_or(1);
        let each = (MOST_PARTIALS / (u64::from(chunks) * 40)).clamp(64, MOST_POINTS).min(largest.max(1));
        // Entries after the last point of a batch must not belong to another batch.
        let each = each.next_multiple_of(64);
        let mut batch = 0;
        for job in &mut list {
            let end = batch + most(job.shape, job.sets.len() as u64).div_ceil(each) as u32;
            job.batches = batch..end;
            batch = end;
        }
        Jobs { list, each, tiles, chunks, batches: batch }
    }

    /// The marked samples of each geometry in a row, and the workgroups of each batch.
    fn lists(&self, graph: &mut Graph, in_frame: &FrameOccluders, marks: Buffer, jobs: &Jobs, samples: u64) -> Lists {
        let of_set = self.blocks();
        let blocks = in_frame.sets.len() as u32 * of_set;
        let counts = graph.buffer("fiv.counts", 4 * u64::from(blocks));
        let starts = graph.buffer("fiv.starts", 4 * u64::from(blocks));
        let groups = graph.buffer("fiv.groups", 24 * u64::from(jobs.batches));
        let threads = [FIV_BLOCK_WORDS * blocks.min(FIV_ROW), blocks.div_ceil(FIV_ROW), 1];
        graph.compute(fiv::online_count::Args { marks, counts, push: fiv::online_count::Push { blocks } }, threads);
        let job = |job: &Job| types::FivJob {
            block: job.sets.start as u32 * of_set,
            blocks: job.sets.len() as u32 * of_set,
            batch: job.batches.start,
            batches: job.batches.len() as u32,
        };
        let list: Vec<types::FivJob> = jobs.list.iter().map(job).collect();
        let push = fiv::online_starts::Push { each: jobs.each as u32, chunks: jobs.chunks };
        let args =
            fiv::online_starts::Args { jobs: graph.buffer_from("fiv.jobs", &list), counts, starts, groups, push };
        graph.compute(args, 64 * list.len() as u32);

        let radii = self.grid.radii;
        // The jobs contain all sets in their order.
        let sets_of = |job: &Job| {
            let base = job.first as u32;
            job.sets.clone().map(move |number| types::FivSet { base, radii_at: number as u32 * radii })
        };
        let sets: Vec<types::FivSet> = jobs.list.iter().flat_map(sets_of).collect();
        let spheres = |set: &Set| (0..radii).map(move |r| set.shells.radius(radii, r) as f32).collect::<Vec<f32>>();
        let distances: Vec<f32> = in_frame.sets.iter().flat_map(spheres).collect();
        let turns: Vec<types::FivTurn> = in_frame.sets.iter().map(rotation).collect();
        let lists = Lists {
            points: graph.buffer("fiv.points", 16 * samples),
            samples: graph.buffer("fiv.samples", 4 * samples),
            groups,
            turns: graph.buffer_from("fiv.turns", &turns),
        };
        let args = fiv::online_list::Args {
            marks,
            starts,
            sets: graph.buffer_from("fiv.sets", &sets),
            directions: graph.import_buffer(&self.directions),
            radii: graph.buffer_from("fiv.radii", &distances),
            points: lists.points,
            samples: lists.samples,
            push: fiv::online_list::Push { blocks, set_blocks: of_set, rings: self.grid.azimuths * self.grid.polars },
        };
        graph.compute(args, threads);
        lists
    }
}

/// The work of a frame.
#[derive(Debug)]
struct Jobs {
    list: Vec<Job>,
    /// Most points of a batch.
    each: u64,
    /// Tiles of an invocation.
    tiles: u32,
    /// Number of invocations that share the tiles of a point.
    chunks: u32,
    /// Number of all batches.
    batches: u32,
}

/// The work of one geometry.
#[derive(Debug)]
struct Job {
    shape: usize,
    sets: Range<usize>,
    /// First entry in the lists.
    first: u64,
    batches: Range<u32>,
}

/// Declares the passes that compute the irradiance at the pixels of the occluders of a geometry, with shadows of this
/// geometry only.
fn own(
    graph: &mut Graph,
    seen: &Seen<'_>,
    light: &Light,
    (texels, turns, rays): (Buffer, Buffer, RayHandles),
    ((set, sets), set_floats): ((u32, u32), u32),
    turns_of_ray: u64,
) {
    let extent = graph.extent(seen.gbuffer.depth);
    let count = light.lit.len() as u64;
    let lit = graph.buffer_from("fiv.lit", if count > 0 { &light.lit } else { &[0] });
    let args = crate::rays::traced!(
        fiv::online_own::Args {
            view: seen.gbuffer.view,
            normal: seen.gbuffer.normal,
            depth: seen.gbuffer.depth,
            identity: seen.identity,
            occluders: seen.occluders,
            texels,
            lit,
            turns,
            own: seen.own,
            push: fiv::online_own::Push {
                size: light.size,
                set,
                sets,
                set_floats,
                seed: graph.seed,
                ..Default::default()
            },
        },
        rays
    );
    // Most pixels show no occluder. Under a black sky the pass runs once, so that the irradiance is known to be 0.
    let texels = Items::new(count as u32).rays(extent.pixels() / 4).turns(turns_of_ray);
    graph.compute_over(args, extent, texels);
}

impl TracedScene {
    fn scene<'a>(&'a self, occluders: &'a Occluders) -> &'a Scene {
        match self {
            Self::Still(kind) => &occluders.kinds[*kind].scene,
            Self::Deforming(scene) => scene,
        }
    }
}

fn rotation(set: &Set) -> types::FivTurn {
    types::FivTurn {
        geometry_from_world: set.geometry_from_world.to_cols_array_2d(),
        centre: set.centre.to_array(),
        radius: super::cover::reach(set.radius),
    }
}

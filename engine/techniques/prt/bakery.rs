//! The computations of a bake on the device: distances, gathered samples and the light of examples (`shaders-glsl/prt`).

use std::ops::Range;

use super::{
    Plan,
    cap::Cap,
    grid::{Nearby, packed},
    samples::{self, Triangles},
};
use crate::{
    Error, ErrorKind, Result,
    gpu::{Gpu, OwnedBuffer},
    graph::{Graph, Items, Runner},
    rays::{Rays, traced},
    resident::Resident,
    scene::{Pose, Scene},
    shaders::{
        consts::PRT_CLEAR,
        prt::{depths, examples, gather},
        types::{self, PrtPoint},
    },
};

/// Bytes of the rows of samples that are computed at once; devices with smaller buffers have fewer.
const MOST_BYTES: u64 = 1 << 26;

/// The scene of a bake on a device.
#[derive(Debug)]
pub struct Bakery {
    pub(super) runner: Runner,
    gpu: Gpu,
    pub(super) scene: Scene,
    pub(super) pose: Pose,
    pub(super) resident: Resident,
    pub(super) rays: Rays,
    on_device: Option<Uploaded>,
}

/// Samples on the device.
#[derive(Debug)]
struct Uploaded {
    samples: OwnedBuffer,
    candidates: OwnedBuffer,
    firsts: OwnedBuffer,
    components: OwnedBuffer,
    nearby: Nearby,
    starts: OwnedBuffer,
    order: OwnedBuffer,
}

impl Bakery {
    /// Uploads the scene.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`; `Runtime` if the scene is larger than the device's limits.
    pub fn new(gpu: &Gpu, scene: &Scene) -> Result<Self> {
        let scene = Scene { environment: None, ..scene.clone() };
        let resident = Resident::for_rays(gpu, &scene)?;
        let rays = Rays::new(gpu, &scene, &resident)?;
        let pose = Pose::rest(&scene);
        Ok(Self { runner: Runner::new(gpu), gpu: gpu.clone(), scene, pose, resident, rays, on_device: None })
    }

    /// Moves samples to the device, for the stages that follow.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub fn upload(&mut self, plan: &Plan, samples: &[PrtPoint]) -> Result<()> {
        let clearances = self.clearances(samples, PRT_CLEAR * plan.radius, plan.settings.seed)?;
        let gaps = plan.settings.gaps as f32;
        let share = |clear: &f32| samples::share_in_gap(*clear, plan.radius, gaps);
        let nearby = Nearby::new(samples, plan.radius, &clearances.iter().map(share).collect::<Vec<_>>());
        let triangles = Triangles::new(&self.scene);
        let components: Vec<u32> = samples.iter().map(|sample| triangles.component(sample)).collect();
        let candidates = packed(samples, &components, &clearances, PRT_CLEAR * plan.radius);
        let (firsts, components) = triangles.components();
        let buffer = |name, bytes: &[u8]| OwnedBuffer::with_contents(&self.gpu, name, bytes);
        self.on_device = Some(Uploaded {
            samples: buffer("prt.samples", bytemuck::cast_slice(samples))?,
            candidates: buffer("prt.candidates", bytemuck::cast_slice(&candidates))?,
            firsts: buffer("prt.firsts", bytemuck::cast_slice(firsts))?,
            components: buffer("prt.components", bytemuck::cast_slice(&components))?,
            starts: buffer("prt.cells", bytemuck::cast_slice(&nearby.starts))?,
            order: buffer("prt.order", bytemuck::cast_slice(&nearby.order))?,
            nearby,
        });
        Ok(())
    }

    /// Distances from the samples of a cluster in the directions of its cap, metres: a row for each sample. Negative: below the horizon.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`, `Interrupted`.
    pub fn depths(&mut self, plan: &Plan, cluster: usize, cap: &Cap) -> Result<Vec<f32>> {
        self.rows(plan.range(cluster), cap.directions(), |of, range| of.depths_of(plan, range, cap))
    }

    fn depths_of(&mut self, plan: &Plan, Range { start, end }: Range<u32>, cap: &Cap) -> Result<Vec<f32>> {
        let uploaded = self.on_device.as_ref().ok_or_else(not_uploaded)?;
        let count = end - start;
        let directions = cap.directions() as u32;
        let mut graph = Graph::new("prt.depths");
        let handles = self.resident.frame_in(&mut graph, &self.scene, &self.pose);
        let rays = self.rays.frame(&mut graph, &handles);
        let depths = graph.buffer("prt.depths", 4 * u64::from(count) * u64::from(directions));
        let args = traced!(
            depths::Args {
                cap: graph.uniform(&device_cap(cap, [start, count])),
                samples: graph.import_buffer(&uploaded.samples),
                depths,
                push: depths::Push { first: 0, count: directions, far: plan.far, seed: plan.settings.seed },
            },
            rays
        );
        let items = Items::new(directions).rays(count.into()).turns(self.rays.most_turns());
        graph.compute_over(args, count, items);
        let read = graph.read_buffer(depths);
        Ok(self.runner.run(&graph)?.buffer(read))
    }

    /// The samples that the samples of a cluster see along their rays: a row for each sample, `u32::MAX` where there is none.
    ///
    /// # Errors
    /// As [`Self::depths`].
    pub fn gather(&mut self, plan: &Plan, cluster: usize) -> Result<Vec<u32>> {
        self.rows(plan.range(cluster), plan.settings.rays as usize, |of, range| of.gather_of(plan, range))
    }

    fn gather_of(&mut self, plan: &Plan, Range { start, end }: Range<u32>) -> Result<Vec<u32>> {
        let uploaded = self.on_device.as_ref().ok_or_else(not_uploaded)?;
        let count = end - start;
        let of_sample = plan.settings.rays;
        let mut graph = Graph::new("prt.gather");
        let handles = self.resident.frame_in(&mut graph, &self.scene, &self.pose);
        let rays = self.rays.frame(&mut graph, &handles);
        let seen = graph.buffer("prt.seen", 4 * u64::from(count) * u64::from(of_sample));
        let args = traced!(
            gather::Args {
                samples: graph.import_buffer(&uploaded.samples),
                grid: graph.uniform(&uploaded.nearby.grid),
                starts: graph.import_buffer(&uploaded.starts),
                order: graph.import_buffer(&uploaded.order),
                candidates: graph.import_buffer(&uploaded.candidates),
                firsts: graph.import_buffer(&uploaded.firsts),
                components: graph.import_buffer(&uploaded.components),
                seen,
                push: gather::Push {
                    first: 0,
                    count: of_sample,
                    first_sample: start,
                    receivers: count,
                    rays: of_sample,
                    slit: samples::slit(plan.radius, plan.settings.gaps as f32),
                    seed: plan.settings.seed,
                },
            },
            rays,
            handles
        );
        // A ray, one above its hit, and some hundred steps to find a sample.
        let turns = 2 * self.rays.most_turns() + 512;
        let items = Items::new(of_sample).rays(2 * u64::from(count)).turns(turns);
        graph.compute_over(args, count, items);
        let read = graph.read_buffer(seen);
        Ok(self.runner.run(&graph)?.buffer(read))
    }

    /// Irradiance at the samples of a cluster by each light of 1 W/sr, W/m²: a row of all lights for each sample. Distances below `nearest` count as
    /// `nearest`, metres.
    ///
    /// # Errors
    /// As [`Self::depths`].
    pub fn lit(&mut self, plan: &Plan, cluster: usize, places: &[[f32; 3]], nearest: f32) -> Result<Vec<f32>> {
        self.rows(plan.range(cluster), places.len(), |of, range| of.lit_of(plan, range, places, nearest))
    }

    fn lit_of(
        &mut self,
        plan: &Plan,
        Range { start, end }: Range<u32>,
        places: &[[f32; 3]],
        nearest: f32,
    ) -> Result<Vec<f32>> {
        let uploaded = self.on_device.as_ref().ok_or_else(not_uploaded)?;
        let count = end - start;
        let lights = places.len() as u32;
        let mut graph = Graph::new("prt.examples");
        let handles = self.resident.frame_in(&mut graph, &self.scene, &self.pose);
        let rays = self.rays.frame(&mut graph, &handles);
        let irradiances = graph.buffer("prt.irradiances", 4 * u64::from(count) * u64::from(lights));
        let args = traced!(
            examples::Args {
                samples: graph.import_buffer(&uploaded.samples),
                places: graph.buffer_from("prt.places", places),
                irradiances,
                push: examples::Push {
                    first: 0,
                    count: lights,
                    first_sample: start,
                    receivers: count,
                    lights,
                    nearest,
                    seed: plan.settings.seed,
                },
            },
            rays
        );
        let items = Items::new(lights).rays(count.into()).turns(self.rays.most_turns());
        graph.compute_over(args, count, items);
        let read = graph.read_buffer(irradiances);
        Ok(self.runner.run(&graph)?.buffer(read))
    }
}

impl Bakery {
    /// Rows of `columns` words for the samples of a range, by ranges of samples whose rows fit into a buffer.
    fn rows<T>(
        &mut self,
        samples: Range<usize>,
        columns: usize,
        mut of: impl FnMut(&mut Self, Range<u32>) -> Result<Vec<T>>,
    ) -> Result<Vec<T>> {
        let most = self.gpu.caps().limits.storage_range.min(MOST_BYTES);
        let each = (most / (4 * columns.max(1) as u64)).max(1) as usize;
        let mut out = Vec::new();
        for start in samples.clone().step_by(each) {
            out.extend(of(self, start as u32..samples.end.min(start.saturating_add(each)) as u32)?);
        }
        Ok(out)
    }

    /// The samples on the device.
    pub(super) fn uploaded(&self) -> Result<&OwnedBuffer> {
        self.on_device.as_ref().map(|uploaded| &uploaded.samples).ok_or_else(not_uploaded)
    }
}

fn not_uploaded() -> Error {
    Error::new(ErrorKind::Runtime, "the samples are not on the device")
}

/// The cap of a cluster for shaders, without rows.
pub(super) fn device_cap(cap: &Cap, [first_sample, samples]: [u32; 2]) -> types::PrtCap {
    types::PrtCap {
        axis: cap.axis.to_array(),
        cos_most: cap.cos_most,
        side: cap.side,
        first_sample,
        samples,
        ..types::PrtCap::default()
    }
}

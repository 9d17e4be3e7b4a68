//! Runs a plan on a device.
#![allow(unsafe_code)]

mod accel;
mod bind;
mod over;
mod parts;
mod pool;
mod record;
#[cfg(test)]
mod tests;
mod transfer;

use std::{borrow::Borrow, sync::Arc, time::Instant};

use ash::vk;

use self::{
    parts::{Pace, Parts, Progress},
    pool::{Memory, Pool, device_format},
    record::Recorder,
};
use super::{
    Graph,
    frame::{Frame, PassTime, Report},
    oracle,
    pass::{Pass, ReadWhat, Work},
    pixels::Pixels,
    plan::{Plan, Shape, Source},
    vocab::Resource,
};
use crate::{
    Error, ErrorKind, Result,
    gpu::{BufferDesc, DescriptorArena, Gpu, OwnedBuffer, Statistics, Timestamps},
};

/// Timestamps are taken when all commands before them have ended.
const END: vk::PipelineStageFlags2 = vk::PipelineStageFlags2::ALL_COMMANDS;
/// Contents of uploaded buffers start at multiples of this in the staging buffer.
const STAGING_ALIGNMENT: u64 = 16;

/// Executes graphs on a device, and keeps what outlives them: memory and history. Pipelines live as long as the device.
#[derive(Debug)]
pub struct Runner {
    gpu: Gpu,
    pool: Pool,
    sets: DescriptorArena,
    uniforms: Option<OwnedBuffer>,
    staging: Option<OwnedBuffer>,
    timestamps: Option<Timestamps>,
    statistics: Option<Statistics>,
    pace: Pace,
    dispatch_rays: Option<u64>,
    /// The last plan without objections: frames of a sequence, and steps of long work, often have the same one.
    approved: Option<Plan>,
}

impl Runner {
    /// Nothing kept yet.
    pub fn new(gpu: &Gpu) -> Self {
        Self {
            gpu: gpu.clone(),
            pool: Pool::default(),
            sets: DescriptorArena::new(gpu),
            uniforms: None,
            staging: None,
            timestamps: None,
            statistics: None,
            pace: Pace::default(),
            dispatch_rays: None,
            approved: None,
        }
    }

    /// The device it runs on.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Dispatches of passes with long loops ([`Graph::compute_over`]) have about `rays` rays. By default a dispatch takes up to about a
    /// second on a CPU driver, and tens of milliseconds on a GPU. Sums over the items of a loop may be rounded differently with another
    /// limit.
    #[must_use]
    pub fn dispatch_rays(self, rays: u64) -> Self {
        Self { dispatch_rays: Some(rays.max(1)), ..self }
    }

    /// Forgets all history: the next frame is a first one.
    pub fn forget_history(&mut self) {
        self.pool.forget();
    }

    /// Runs all passes and waits for them. A long graph is given to the device in parts while later passes are recorded.
    ///
    /// # Errors
    /// `Runtime` with every mistake of the graph, or a limit of the device that a pass is over; `OutOfMemory`; `Interrupted`;
    /// `DeviceLost`, naming the pass. Earlier parts may have run then: the next frame has no history, and imported images whose layout
    /// changes have no contents.
    pub fn run(&mut self, graph: impl Borrow<Graph>) -> Result<Frame> {
        self.run_then(graph.borrow(), true, &mut |_| {})
    }

    /// As [`Runner::run`], but the history stays that of the frame before: the same frame can run again.
    ///
    /// # Errors
    /// As [`Runner::run`].
    pub fn run_held(&mut self, graph: impl Borrow<Graph>) -> Result<Frame> {
        self.run_then(graph.borrow(), false, &mut |_| {})
    }

    /// As [`Runner::run`], or with `held` as [`Runner::run_held`]. `told` is called while the graph runs, with the share of its rays that are
    /// traced, 0 to 1: seldom on short graphs.
    ///
    /// # Errors
    /// As [`Runner::run`].
    pub fn run_with_progress(
        &mut self,
        graph: impl Borrow<Graph>,
        held: bool,
        told: &mut dyn FnMut(f64),
    ) -> Result<Frame> {
        self.run_then(graph.borrow(), !held, told)
    }

    fn run_then(&mut self, graph: &Graph, turn: bool, told: &mut dyn FnMut(f64)) -> Result<Frame> {
        let begun = Instant::now();
        let plan = graph.plan()?;
        let plan_ms = milliseconds(begun);
        let approved = || self.approved.as_ref().is_some_and(|before| before.does_the_same(&plan));
        if cfg!(debug_assertions) && self.gpu.validation_active() && !approved() {
            let objections = oracle::check(&plan);
            if !objections.is_empty() {
                let what = format!("the plan of graph `{}` is wrong: {}", graph.name(), objections.join("; "));
                return Err(Error::new(ErrorKind::Runtime, what));
            }
            self.approved = Some(plan.clone());
        }
        self.execute(graph, &plan, (plan_ms, turn), told).map_err(|e| e.at(graph.name()))
    }

    fn execute(
        &mut self,
        graph: &Graph,
        plan: &Plan,
        (plan_ms, turn): (f64, bool),
        told: &mut dyn FnMut(f64),
    ) -> Result<Frame> {
        let begun = Instant::now();
        let (memory, fresh) = self.pool.acquire(&self.gpu, graph, plan)?;
        self.sets.reset()?;
        self.fill_uniforms(graph)?;
        self.fill_staging(graph)?;
        let stamps = plan.passes.len() as u32 + 1;
        if self.timestamps.as_ref().is_none_or(|t| t.count() < stamps) {
            self.timestamps = Some(Timestamps::new(&self.gpu, stamps.next_power_of_two())?);
        }
        let counted = graph.passes.iter().filter(|p| p.counted).count() as u32;
        if counted > 0 && self.statistics.as_ref().is_none_or(|s| s.count() < counted) {
            self.statistics = Some(Statistics::new(&self.gpu, counted.next_power_of_two())?);
        }
        let statistics = self.statistics.as_ref().filter(|_| counted > 0);
        let held = (memory.clone(), self.uniforms.clone(), self.staging.clone());
        let limits = over::limits(&self.gpu, graph, self.dispatch_rays)?;
        let told = Progress::new(over::rays(graph, limits), told);
        let parts = Parts::new(&self.gpu, graph.name(), Arc::new(held), (&mut self.pace, told));
        let mut commands = parts.begin()?;
        transfer::clear_fresh(&self.gpu, &mut commands, &fresh);
        if let Some(timestamps) = &self.timestamps {
            timestamps.reset(&mut commands);
            timestamps.write(&mut commands, 0, END);
        }
        if let Some(statistics) = statistics {
            statistics.reset(&mut commands);
        }
        // For each pass, the query that counts it.
        let mut queries: Vec<Option<u32>> = Vec::with_capacity(plan.passes.len());
        let mut times = Vec::with_capacity(plan.passes.len());
        let (uniforms, staging, sets) = (self.uniforms.clone(), self.staging.clone(), &mut self.sets);
        let gpu = &self.gpu;
        let open: &[String] = &[];
        let mut recorder =
            Recorder { gpu, graph, plan, memory: &memory, uniforms, staging, sets, commands, parts, open, limits };
        let mut ran = Ok(());
        for (index, declared) in plan.upload.iter().chain(&graph.passes).enumerate() {
            let (begun, waited) = (Instant::now(), recorder.parts.waited());
            let query = declared.counted.then(|| queries.iter().flatten().count() as u32);
            queries.push(query);
            match recorder.pass(index, declared, statistics.zip(query)) {
                Ok(launches) => {
                    if let Some(timestamps) = &self.timestamps {
                        timestamps.write(&mut recorder.commands, index as u32 + 1, END);
                    }
                    let Pass { name, scope, .. } = declared;
                    let spent = begun.elapsed().saturating_sub(recorder.parts.waited() - waited);
                    let (cpu_ms, name, scope) = (spent.as_secs_f64() * 1e3, name.clone(), scope.clone());
                    times.push(PassTime { name, scope, launches, gpu_ms: None, cpu_ms, started: None });
                }
                Err(error) => {
                    ran = Err(error);
                    break;
                }
            }
        }
        if ran.is_ok() {
            recorder.end(plan.passes.len());
        }
        let Recorder { commands, mut parts, .. } = recorder;
        let ran = ran.and_then(|()| parts.finish(commands));
        let (submissions, waited) = (parts.given(), parts.waited());
        // Parts that are still running are waited for here.
        drop(parts);
        if let Err(error) = ran {
            if submissions > 0 {
                self.forget_where_things_are(plan, &memory);
            }
            return Err(error);
        }
        let wait_ms = waited.as_secs_f64() * 1e3;
        let cpu_ms = milliseconds(begun) - wait_ms;

        accel::remember_built(graph);
        if turn {
            self.pool.turn(graph);
        }
        for (physical, memory) in plan.physical.iter().zip(&memory) {
            if let (Source::Imported(_), Some(rest), Memory::Image(image)) = (&physical.source, physical.rest, memory) {
                image.set_layout(rest.to_vk());
            }
        }
        if let Some(timestamps) = &self.timestamps {
            let stamps = timestamps.read()?;
            for (i, time) in times.iter_mut().enumerate() {
                if let (Some(Some(from)), Some(Some(to))) = (stamps.get(i), stamps.get(i + 1)) {
                    time.gpu_ms = Some(to - from);
                }
            }
        }
        if let Some(statistics) = statistics {
            let started = statistics.read(counted)?;
            for (time, query) in times.iter_mut().zip(queries) {
                time.started = query.and_then(|q| started.get(q as usize).copied().flatten());
            }
        }
        let report = Report {
            graph: graph.name().to_owned(),
            device: self.gpu.describe().to_string(),
            passes: times,
            plan_ms,
            record_ms: cpu_ms,
            wait_ms,
            barriers: plan.barriers.len(),
            submissions,
            transient_bytes: transient_bytes(plan),
            warnings: plan.warnings.clone(),
        };
        self.results(graph, plan, &memory, report)
    }

    /// After a graph of which only some parts ran: history is half this frame's, and an image whose layout changes on the way is in none
    /// that is known. Who imports such an image again is told so; the next frame is a first one.
    fn forget_where_things_are(&mut self, plan: &Plan, memory: &[Memory]) {
        self.pool.forget();
        for barrier in plan.barriers.iter().filter(|b| b.from != b.to) {
            let imported = matches!(plan.physical[barrier.physical].source, Source::Imported(_));
            if let (true, Some(Memory::Image(image))) = (imported, memory.get(barrier.physical)) {
                image.set_layout(vk::ImageLayout::UNDEFINED);
            }
        }
    }

    fn fill_uniforms(&mut self, graph: &Graph) -> Result<()> {
        if graph.uniforms.is_empty() {
            return Ok(());
        }
        let size = graph.uniforms.len() as u64;
        if self.uniforms.as_ref().is_none_or(|b| b.size() < size) {
            let desc = BufferDesc::upload(size.next_power_of_two());
            self.uniforms = Some(OwnedBuffer::new(&self.gpu, "uniforms", desc)?);
        }
        // The last graph that used it was waited for.
        self.uniforms.as_ref().map_or(Ok(()), |b| b.write(0, &graph.uniforms))
    }

    fn fill_staging(&mut self, graph: &Graph) -> Result<()> {
        let contents: Vec<&Vec<u8>> = graph.buffers.iter().filter_map(|b| b.contents.as_ref()).collect();
        let size = contents.iter().map(|c| (c.len() as u64).next_multiple_of(STAGING_ALIGNMENT)).sum();
        if contents.is_empty() {
            self.staging = None;
            return Ok(());
        }
        if self.staging.as_ref().is_none_or(|b| b.size() < size) {
            self.staging = Some(OwnedBuffer::new(&self.gpu, "staging", BufferDesc::upload(size))?);
        }
        let Some(staging) = &self.staging else { return Ok(()) };
        let mut offset = 0;
        for bytes in contents {
            staging.write(offset, bytes)?;
            offset += (bytes.len() as u64).next_multiple_of(STAGING_ALIGNMENT);
        }
        Ok(())
    }

    /// Fetches what was promised.
    fn results(&self, graph: &Graph, plan: &Plan, memory: &[Memory], report: Report) -> Result<Frame> {
        let mut frame = Frame::new(graph.id, report);
        for read in &graph.reads {
            let physical = plan.physical_of(Resource::Buffer(read.to.index));
            let buffer = match physical.and_then(|p| memory.get(p)) {
                Some(Memory::Buffer(buffer)) => buffer,
                _ => return Err(Error::new(ErrorKind::Runtime, "a read without memory")),
            };
            match &read.what {
                ReadWhat::Buffer => frame.push_buffer(buffer.mapped_bytes(0, read.to.size as usize)?),
                ReadWhat::Image { name, desc, format } => {
                    let format = device_format(&self.gpu, *format);
                    let layers = desc.layers * desc.depth;
                    let count = desc.extent.pixels() as usize * layers as usize;
                    let pixels = Pixels { name: name.clone(), extent: desc.extent, format, layers, bytes: Vec::new() };
                    if format == crate::graph::Format::RGBA32F {
                        frame.push_floats(pixels, buffer.mapped_values(0, count)?);
                    } else {
                        let bytes = buffer.mapped_bytes(0, count * format.bytes() as usize)?;
                        frame.push_image(Pixels { bytes, ..pixels });
                    }
                }
            }
        }
        Ok(frame)
    }
}

/// Closes and opens labels to come from the scopes `open` to `wanted`.
fn labels<'a>(commands: &mut crate::gpu::Commands, open: &[String], wanted: &'a [String]) -> &'a [String] {
    let common = open.iter().zip(wanted).take_while(|(a, b)| a == b).count();
    for _ in common..open.len() {
        commands.end_label();
    }
    for name in &wanted[common..] {
        commands.begin_label(name);
    }
    wanted
}

fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

fn transient_bytes(plan: &Plan) -> u64 {
    let pooled = plan.physical.iter().filter(|p| p.source == Source::Pool);
    pooled
        .map(|p| match p.shape {
            Shape::Image(desc) => desc.bytes(),
            Shape::Buffer(bytes) => bytes,
        })
        .sum()
}

// Passes that only move data have no shader.
impl Work {
    /// Number of draw calls, or of dispatches.
    pub(super) fn launches(&self) -> usize {
        match self {
            Work::Compute { .. } => 1,
            Work::Raster { draw, .. } => draw.count(),
            Work::BuildBottoms { builds, .. } => builds.len(),
            Work::BuildTop { .. } => 1,
            _ => 0,
        }
    }
}

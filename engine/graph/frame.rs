//! What comes back from a graph that ran.

use std::borrow::Borrow;

use bytemuck::AnyBitPattern;

use super::{
    Graph,
    handles::{BufferRead, ImageRead},
    pixels::Pixels,
};
use crate::{Error, ErrorKind, Result, gpu::Gpu};

/// Executes graphs on a device, and keeps what outlives them: memory, pipelines, history.
#[derive(Debug)]
pub struct Runner {
    gpu: Gpu,
}

impl Runner {
    /// Nothing kept yet.
    pub fn new(gpu: &Gpu) -> Self {
        Self { gpu: gpu.clone() }
    }

    /// The device it runs on.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Runs all passes and waits for them.
    ///
    /// # Errors
    /// `Usage` with every mistake of the graph; `OutOfMemory`; `DeviceLost`, naming the pass.
    pub fn run(&mut self, graph: impl Borrow<Graph>) -> Result<Frame> {
        let graph = graph.borrow();
        Err(Error::new(ErrorKind::Runtime, "running graphs is not built yet").at(graph.name()))
    }
}

/// Results of one graph.
#[derive(Debug)]
pub struct Frame {
    /// Passes and their times.
    pub report: Report,
    images: Vec<Pixels>,
    buffers: Vec<Vec<u8>>,
}

impl Frame {
    /// The pixels promised by [`Graph::read_image`].
    ///
    /// # Panics
    /// If the token is of another graph.
    #[track_caller]
    pub fn image(&self, token: ImageRead) -> Pixels {
        self.images[token.index as usize].clone()
    }

    /// The contents promised by [`Graph::read_buffer`]; bytes after the last whole `T` are left out.
    ///
    /// # Panics
    /// If the token is of another graph.
    #[track_caller]
    pub fn buffer<T: AnyBitPattern>(&self, token: BufferRead) -> Vec<T> {
        let bytes = &self.buffers[token.index as usize];
        bytes.chunks_exact(size_of::<T>().max(1)).map(bytemuck::pod_read_unaligned).collect()
    }
}

/// What one pass cost.
#[derive(Clone, Debug, PartialEq)]
pub struct PassTime {
    pub name: String,
    /// Labels around it, outermost first.
    pub scope: Vec<String>,
    /// Milliseconds on the device; `None` if it has no timestamps.
    pub gpu_ms: Option<f64>,
    /// Milliseconds the CPU took to record it.
    pub cpu_ms: f64,
}

/// What one run of a graph cost.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Report {
    pub graph: String,
    /// Device and driver.
    pub device: String,
    pub passes: Vec<PassTime>,
}

//! What comes back from a graph that ran.

use bytemuck::AnyBitPattern;

use crate::gpu::Started;

use super::{
    handles::{BufferRead, GraphId, ImageRead},
    pixels::Pixels,
};

/// Results of one graph.
#[derive(Debug)]
pub struct Frame {
    /// Passes and their times.
    pub report: Report,
    graph: GraphId,
    /// In the order in which they were promised.
    reads: Vec<Read>,
}

#[derive(Debug)]
enum Read {
    Image(Pixels),
    /// RGBA32F; the pixels without their bytes.
    Floats(Pixels, Vec<[f32; 4]>),
    Buffer(Vec<u8>),
}

impl Frame {
    pub(super) fn new(graph: GraphId, report: Report) -> Self {
        Self { report, graph, reads: Vec::new() }
    }

    pub(super) fn push_image(&mut self, pixels: Pixels) {
        self.reads.push(Read::Image(pixels));
    }

    pub(super) fn push_floats(&mut self, pixels: Pixels, values: Vec<[f32; 4]>) {
        self.reads.push(Read::Floats(pixels, values));
    }

    pub(super) fn push_buffer(&mut self, bytes: Vec<u8>) {
        self.reads.push(Read::Buffer(bytes));
    }

    #[track_caller]
    fn read(&self, graph: GraphId, index: u32) -> &Read {
        assert!(
            graph == self.graph,
            "a token of graph `{}` was redeemed from a frame of graph `{}`",
            graph.name,
            self.graph.name
        );
        &self.reads[index as usize]
    }

    /// The pixels promised by [`Graph::read_image`](super::Graph::read_image).
    ///
    /// # Panics
    /// If the token is of another graph.
    #[track_caller]
    pub fn image(&self, token: ImageRead) -> Pixels {
        match self.read(token.graph, token.index) {
            Read::Image(pixels) => pixels.clone(),
            Read::Floats(pixels, values) => Pixels { bytes: bytemuck::cast_slice(values).to_vec(), ..pixels.clone() },
            Read::Buffer(_) => unreachable!("image tokens stand for images"),
        }
    }

    /// The values of [`Frame::image`] as [`Pixels::to_f32`], once: what is left for the token is empty.
    ///
    /// # Panics
    /// If the token is of another graph.
    #[track_caller]
    pub fn take_floats(&mut self, token: ImageRead) -> Vec<[f32; 4]> {
        let _ = self.read(token.graph, token.index);
        match &mut self.reads[token.index as usize] {
            Read::Floats(_, values) => std::mem::take(values),
            Read::Image(pixels) => {
                let values = pixels.to_f32();
                pixels.bytes.clear();
                values
            }
            Read::Buffer(_) => unreachable!("image tokens stand for images"),
        }
    }

    /// The contents promised by [`Graph::read_buffer`](super::Graph::read_buffer); bytes after the last whole `T` are left out.
    ///
    /// # Panics
    /// If the token is of another graph.
    #[track_caller]
    pub fn buffer<T: AnyBitPattern>(&self, token: BufferRead) -> Vec<T> {
        let Read::Buffer(bytes) = self.read(token.graph, token.index) else {
            unreachable!("buffer tokens stand for buffers")
        };
        bytes.chunks_exact(size_of::<T>().max(1)).map(bytemuck::pod_read_unaligned).collect()
    }
}

/// What one pass cost.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PassTime {
    pub name: String,
    /// Labels around it, outermost first.
    pub scope: Vec<String>,
    /// Draw calls, or dispatches.
    pub launches: usize,
    /// Milliseconds on the device; `None` if it has no timestamps.
    pub gpu_ms: Option<f64>,
    /// Milliseconds the CPU took to record it.
    pub cpu_ms: f64,
    /// How often its shaders started; `None` unless the pass is [counted](super::PassRef::counted) and the device can count.
    pub started: Option<Started>,
}

/// What one run of a graph cost.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Report {
    pub graph: String,
    /// Device and driver.
    pub device: String,
    pub passes: Vec<PassTime>,
    /// Milliseconds to derive the plan.
    pub plan_ms: f64,
    /// Milliseconds to record and to make what was missing: memory, pipelines.
    pub record_ms: f64,
    /// Milliseconds for which the host waited for the device.
    pub wait_ms: f64,
    pub barriers: usize,
    /// Parts in which the device had it: more than one where it is long.
    pub submissions: usize,
    /// Memory of images and buffers that live in the graph.
    pub transient_bytes: u64,
    /// Things that are no mistake but look like one.
    pub warnings: Vec<String>,
}

//! The render graph: passes in the order they run, from which barriers, layouts, usage, lifetimes, labels and timings follow.
//!
//! A [`Graph`] is a list of declared passes; building one touches no Vulkan object. The generated `Args` of a shader
//! ([`crate::shaders`]) names everything a pass binds, and `readonly` / `writeonly` in the GLSL say how.
//! [`Plan::new`] turns the list into barriers and physical resources, or into the list of [`Mistake`]s, each with pass and
//! resource. [`Runner::run`] executes it and hands back a [`Frame`]: what was asked to be read, and a [`Report`] of times.
//!
//! ```no_run
//! use lucerna::{gpu::{Gpu, GpuOptions}, graph::*, shaders::test::{advance, pattern}};
//!
//! # fn main() -> lucerna::Result<()> {
//! let gpu = Gpu::new(GpuOptions::from_env()?)?;
//! let mut runner = Runner::new(&gpu);
//!
//! let mut graph = Graph::new("example");
//! let extent = Extent::new(64, 64);
//! let first = graph.image("first", Format::RGBA32F, extent);
//! graph.compute(pattern::Args { image_out: first, push: pattern::Push { tag: 1.0 } }, extent);
//! let second = graph.image("second", Format::RGBA32F, extent);
//! graph.compute(advance::Args { previous: first, next: second }, extent);
//! let token = graph.read_image(second);
//!
//! let frame = runner.run(graph)?;
//! println!("{:?}\n{}", frame.image(token).at(0, 0, 0), frame.report);
//! # Ok(())
//! # }
//! ```
//!
//! | want | use |
//! |---|---|
//! | an image, a buffer, a uniform block for this frame | [`Graph::image`], [`Graph::buffer`], [`Graph::buffer_from`], [`Graph::uniform`] |
//! | one that outlives the frame | [`Graph::history`], [`Graph::import_image`], [`Graph::import_buffer`] |
//! | a part of it, another sampler | [`Image::mip`], [`Image::layer`], [`Image::nearest`], [`Buffer::range`] … |
//! | a pass whose shader loops for long | [`Graph::compute_over`] |
//! | a pass | [`Graph::compute`], [`Graph::raster`] with [`Targets`], [`Raster`] and [`Draw`], [`Graph::clear`], [`Graph::copy`], [`Graph::mips`] … |
//! | acceleration structures for ray queries | [`Graph::import_accel`], [`Graph::build_bottoms`], [`Graph::build_top`] |
//! | results on the CPU | [`Graph::read_image`], [`Graph::read_buffer`] |
//! | to look into a graph | [`Plan::list_passes`], [`Graph::view`], [`Graph::dump`] |
//! | to test a graph | [`testing::every_barrier_matters`] |
//!
//! Declaration order is execution order: nothing is reordered, removed or put on another queue. Rules that follow from it:
//! what is read must have been written by an earlier pass; a pass does not write what it reads otherwise; last frame's half
//! of a history is only read.
//!
//! How it is known to be right: [`oracle::check`] proves each plan by brute force without the planner's code (wherever
//! validation is on, every plan that runs), tests drop each barrier of each shipped graph, random graphs are compared with
//! a simulation on the CPU, and synchronisation validation listens to all tests on a device.

mod accel;
mod access;
mod args;
mod build;
mod execute;
mod format;
mod frame;
mod grid;
mod handles;
mod import;
mod list;
#[cfg(feature = "effects")]
mod live;
pub mod oracle;
mod over;
mod pass;
mod pixels;
mod plan;
mod raster;
mod tap;
pub mod testing;
mod vocab;
mod vulkan;

pub use accel::{BottomBuild, TopInstance};
pub use args::{Args, Bind, ComputeArgs, RangedArgs, RasterArgs};
pub use build::PassRef;
pub use execute::Runner;
pub use format::{Class, Extent, Format, ImageDesc, Threads};
pub use frame::{Frame, PassTime, Report};
pub use handles::{Accel, Buffer, BufferRead, GraphId, Image, ImageRead, Sampler, Uniform, UniformSlice};
pub use over::Items;
pub use pixels::Pixels;
pub use plan::{Barrier, Physical, Plan, PlannedPass, Shape, Source};
pub use raster::{
    Blend, Compare, Cull, Depth, DepthBias, Draw, DrawCall, IndexedCall, Load, Raster, Stencil, StencilLoad, StencilOp,
    Targets, Topology,
};
pub use vocab::{Access, Layout, Mistake, MistakeKind, Region, Resource, Scope, Stages, Usage, Use};

use pass::{BufferEntry, ImageEntry, Pass, ReadEntry};

/// The passes of one frame, in the order they run.
#[derive(Clone, Debug)]
pub struct Graph {
    /// Number of the frame, for shaders that vary over time. 0 unless set.
    pub frame: u32,
    /// Seed of everything random. 0 unless set.
    pub seed: u32,
    id: GraphId,
    image_names: build::Names,
    buffer_names: build::Names,
    pass_names: build::Names,
    images: Vec<ImageEntry>,
    buffers: Vec<BufferEntry>,
    uniforms: Vec<u8>,
    passes: Vec<Pass>,
    reads: Vec<ReadEntry>,
    scope: Vec<String>,
}

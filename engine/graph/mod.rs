//! The render graph: passes in the order they run, from which barriers, layouts, usage, lifetimes, labels and timings follow.
//!
//! A [`Graph`] is a list of declared passes; building one touches no Vulkan object. The generated `Args` of a shader names
//! everything a pass binds, and `readonly` / `writeonly` in the GLSL say how. A plan turns the list into barriers and
//! physical resources, or into the list of mistakes, each with pass and resource. [`Runner::run`] executes it.
//!
//! Declaration order is execution order: nothing is reordered, removed or put on another queue.

mod access;
mod build;
mod execute;
mod format;
mod frame;
mod handles;
mod import;
mod list;
pub mod oracle;
mod pass;
mod pixels;
mod plan;
mod raster;
mod tap;
pub mod testing;
mod vocab;
mod vulkan;

pub use build::PassRef;
pub use execute::Runner;
pub use format::{Class, Extent, Format, ImageDesc, Threads};
pub use frame::{Frame, PassTime, Report};
pub use handles::{Buffer, BufferRead, GraphId, Image, ImageRead, Sampler, Uniform, UniformSlice};
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
    images: Vec<ImageEntry>,
    buffers: Vec<BufferEntry>,
    uniforms: Vec<u8>,
    passes: Vec<Pass>,
    reads: Vec<ReadEntry>,
    scope: Vec<String>,
}

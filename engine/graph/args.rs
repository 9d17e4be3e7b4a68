//! What a pass gives to its shader.

use super::handles::{Accel, Buffer, Image, UniformSlice};
use crate::shader::Shader;

/// What a generated `Args` gives to a binding.
#[derive(Clone, Copy, Debug)]
pub enum Bind {
    Image(Image),
    Buffer(Buffer),
    Uniform(UniformSlice),
    Accel(Accel),
}

/// Implemented by every generated `Args`: constructing it is declaring the accesses of a pass.
pub trait Args {
    const SHADER: &'static Shader;

    /// The resources in the order of [`Shader::bindings`], arrays element by element.
    fn resources(&self, out: &mut Vec<Bind>);

    /// The variant for these resources, and its resources as [`Self::resources`] has them: the one that traces by ray query
    /// where there is an acceleration structure to trace.
    fn variant(&self, out: &mut Vec<Bind>) -> &'static Shader {
        self.resources(out);
        Self::SHADER
    }

    /// The bytes of the push-constant block; empty if there is none.
    fn push(&self) -> &[u8] {
        &[]
    }

    /// The values of [`Shader::spec`], as bits.
    fn spec(&self) -> Vec<u32> {
        Vec::new()
    }
}

/// `Args` of a compute shader.
pub trait ComputeArgs: Args {}

/// `Args` of a compute shader whose invocations loop over a range of items: its push constants have the members `first` and `count`
/// (`uint`). For [`Graph::compute_over`](super::Graph::compute_over).
pub trait RangedArgs: ComputeArgs {
    /// Byte offsets of `first` and `count` in the push-constant block.
    const RANGE: [usize; 2];
}

/// `Args` of a vertex shader with or without a fragment shader.
pub trait RasterArgs: Args {}

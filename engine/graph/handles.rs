//! Handles: small `Copy` values that name a resource of one graph, which part of it, and how it is sampled.

use std::{
    fmt,
    marker::PhantomData,
    ops::{Deref, Range},
};

/// Which graph a handle belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct GraphId {
    pub(crate) id: u32,
    pub(crate) name: &'static str,
}

/// How a sampled image is read: by one of these stock samplers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Sampler {
    /// Linear inside a level, nearest level, clamped to the edge.
    #[default]
    Linear,
    /// Nearest, clamped to the edge.
    Nearest,
    /// Trilinear, clamped to the edge.
    Trilinear,
    /// Trilinear, repeated.
    Repeat,
    /// Nearest, repeated.
    NearestRepeat,
    /// Depth comparison for reversed Z: 1 where the reference is greater than or equal to the stored depth, and outside.
    Shadow,
}

/// An image, or a range of its levels and layers, with a sampler. Valid for the graph that made it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Image {
    pub(crate) graph: GraphId,
    pub(crate) index: u32,
    pub(crate) mip: u32,
    pub(crate) mips: u32,
    pub(crate) layer: u32,
    pub(crate) layers: u32,
    pub(crate) cube: bool,
    pub(crate) sampler: Sampler,
}

impl Image {
    /// Level `level` of the levels this handle covers.
    #[must_use]
    pub const fn mip(self, level: u32) -> Self {
        Self { mip: self.mip.saturating_add(level), mips: 1, ..self }
    }

    /// Some of the levels this handle covers.
    #[must_use]
    pub const fn mips(self, levels: Range<u32>) -> Self {
        Self { mip: self.mip.saturating_add(levels.start), mips: levels.end.saturating_sub(levels.start), ..self }
    }

    /// Layer `layer` of the layers this handle covers.
    #[must_use]
    pub const fn layer(self, layer: u32) -> Self {
        Self { layer: self.layer.saturating_add(layer), layers: 1, cube: false, ..self }
    }

    /// Some of the layers this handle covers.
    #[must_use]
    pub const fn layers(self, layers: Range<u32>) -> Self {
        Self { layer: self.layer.saturating_add(layers.start), layers: layers.end.saturating_sub(layers.start), ..self }
    }

    /// Six layers as one cube map.
    #[must_use]
    pub const fn as_cube(self) -> Self {
        Self { cube: true, ..self }
    }

    /// Read with nearest filtering, clamped to the edge.
    #[must_use]
    pub const fn nearest(self) -> Self {
        Self { sampler: Sampler::Nearest, ..self }
    }

    /// Read with trilinear filtering, clamped to the edge.
    #[must_use]
    pub const fn trilinear(self) -> Self {
        Self { sampler: Sampler::Trilinear, ..self }
    }

    /// Read with trilinear filtering, repeated.
    #[must_use]
    pub const fn repeat(self) -> Self {
        Self { sampler: Sampler::Repeat, ..self }
    }

    /// Read with nearest filtering, repeated.
    #[must_use]
    pub const fn nearest_repeat(self) -> Self {
        Self { sampler: Sampler::NearestRepeat, ..self }
    }

    /// Read by depth comparison: see [`Sampler::Shadow`].
    #[must_use]
    pub const fn shadow(self) -> Self {
        Self { sampler: Sampler::Shadow, ..self }
    }

    /// Read with `sampler`.
    #[must_use]
    pub const fn sampled_by(self, sampler: Sampler) -> Self {
        Self { sampler, ..self }
    }
}

/// A buffer, or a byte range of it. Valid for the graph that made it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Buffer {
    pub(crate) graph: GraphId,
    pub(crate) index: u32,
    pub(crate) offset: u64,
    pub(crate) size: u64,
}

impl Buffer {
    /// Bytes `range` of the bytes this handle covers. A shader may want the start to be a multiple of 256.
    #[must_use]
    pub const fn range(self, range: Range<u64>) -> Self {
        Self { offset: self.offset.saturating_add(range.start), size: range.end.saturating_sub(range.start), ..self }
    }

    /// Bytes that this handle covers.
    pub const fn bytes(self) -> u64 {
        self.size
    }
}

/// Acceleration structures ([`Graph::import_accel`](super::Graph::import_accel)), or none. Valid for the graph that made it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Accel {
    pub(crate) graph: GraphId,
    /// Of the buffer in which they lie.
    pub(crate) index: u32,
}

impl Accel {
    /// None: shaders that take it trace rays in compute.
    pub const NONE: Self = Self { graph: GraphId { id: u32::MAX, name: "" }, index: u32::MAX };

    /// There are none.
    pub const fn is_none(self) -> bool {
        self.index == u32::MAX
    }
}

/// Bytes in the uniform arena of a graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct UniformSlice {
    pub(crate) graph: GraphId,
    pub(crate) offset: u32,
    pub(crate) size: u32,
}

/// A uniform block of type `T` of one graph.
pub struct Uniform<T> {
    slice: UniformSlice,
    of: PhantomData<fn() -> T>,
}

impl<T> Uniform<T> {
    pub(crate) fn new(slice: UniformSlice) -> Self {
        Self { slice, of: PhantomData }
    }
}

impl<T> Clone for Uniform<T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Uniform<T> {}

impl<T> fmt::Debug for Uniform<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.slice.fmt(f)
    }
}

impl<T> Deref for Uniform<T> {
    type Target = UniformSlice;
    fn deref(&self) -> &UniformSlice {
        &self.slice
    }
}

impl<T> From<Uniform<T>> for UniformSlice {
    fn from(uniform: Uniform<T>) -> Self {
        uniform.slice
    }
}

/// What [`super::Graph::read_image`] promises; redeem it with [`super::Frame::image`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ImageRead {
    pub(crate) graph: GraphId,
    pub(crate) index: u32,
}

/// What [`super::Graph::read_buffer`] promises; redeem it with [`super::Frame::buffer`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BufferRead {
    pub(crate) graph: GraphId,
    pub(crate) index: u32,
}

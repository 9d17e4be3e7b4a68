//! What a raster pass draws, onto what, with which fixed-function state.

use super::handles::{Buffer, Image};
use std::sync::Arc;

/// What happens to a colour target before drawing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Load {
    /// Every pixel becomes this value.
    Clear([f32; 4]),
    /// As `Clear`, for unsigned integer formats.
    ClearUint([u32; 4]),
    /// What earlier passes left stays.
    Keep,
    /// Undefined; the pass draws every pixel.
    Discard,
}

/// What happens to depth before drawing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Depth {
    /// Every pixel becomes this depth; 0 is the far end (reversed Z).
    Clear(f32),
    /// What earlier passes left stays.
    Keep,
    /// As `Keep`, and neither depth nor stencil is written: the same image may be sampled by the pass.
    ReadOnly,
}

/// What happens to stencil before drawing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StencilLoad {
    Clear(u8),
    Keep,
}

/// What a raster pass draws onto: up to eight colours, and depth (with stencil, if its format has it).
///
/// ```
/// # use lucerna::graph::*;
/// # let mut graph = Graph::new("docs");
/// # let (hdr, depth) = (graph.image("hdr", Format::RGBA16F, Extent::new(8, 8)), graph.image("depth", Format::D32F, Extent::new(8, 8)));
/// let targets = Targets::new().color(hdr, Load::Clear([0.0; 4])).depth(depth, Depth::Clear(0.0));
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Targets {
    pub(crate) colors: Vec<(Image, Load)>,
    pub(crate) depth: Option<(Image, Depth)>,
    pub(crate) stencil: Option<StencilLoad>,
    pub(crate) area: Option<[u32; 4]>,
    pub(crate) views: bool,
}

impl Targets {
    /// Nothing yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// The next colour output of the fragment shader.
    #[must_use]
    pub fn color(mut self, image: Image, load: Load) -> Self {
        self.colors.push((image, load));
        self
    }

    /// Depth, and stencil if the format has it.
    #[must_use]
    pub fn depth(mut self, image: Image, load: Depth) -> Self {
        self.depth = Some((image, load));
        self
    }

    /// Stencil of the depth image. Without this call it is treated as depth is: cleared to 0 with it, or kept.
    #[must_use]
    pub fn stencil(mut self, load: StencilLoad) -> Self {
        self.stencil = Some(load);
        self
    }

    /// Draws only into this rectangle (x and y of the top left corner, width, height), to which clip space is mapped.
    /// Clears still reach the whole target.
    #[must_use]
    pub fn area(mut self, x: u32, y: u32, width: u32, height: u32) -> Self {
        self.area = Some([x, y, width, height]);
        self
    }

    /// Draws everything once into each layer of the targets, where `gl_ViewIndex` is the number of the layer (multiview). All targets have as many
    /// layers, 2 to 6. Only with [`Caps::multiview`](crate::gpu::Caps::multiview).
    #[must_use]
    pub fn views(mut self) -> Self {
        self.views = true;
        self
    }
}

/// Which triangles are not drawn. Front faces are counter-clockwise seen with +Y up, as in glTF.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Cull {
    #[default]
    None,
    Back,
    Front,
}

/// When a depth or stencil test passes: new value OP stored value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Compare {
    Never,
    Less,
    Equal,
    LessOrEqual,
    Greater,
    NotEqual,
    GreaterOrEqual,
    Always,
}

/// How drawn colours join those of the target.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Blend {
    #[default]
    Replace,
    /// Sum of both.
    Add,
    /// Straight alpha.
    Alpha,
    /// Colour already multiplied by alpha.
    Premultiplied,
    /// Product of both.
    Multiply,
    /// The larger of both, by channel.
    Max,
}

/// What happens to a stencil value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum StencilOp {
    #[default]
    Keep,
    Zero,
    Replace,
    Increment,
    Decrement,
    Invert,
}

/// Stencil test and write, the same for both faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Stencil {
    /// `reference` OP stored value.
    pub compare: Compare,
    pub reference: u8,
    pub read_mask: u8,
    pub write_mask: u8,
    /// Both tests passed.
    pub pass: StencilOp,
    /// The stencil test failed.
    pub fail: StencilOp,
    /// The stencil test passed, the depth test failed.
    pub depth_fail: StencilOp,
}

impl Stencil {
    /// Draws only where the stored value is `reference`; writes nothing.
    pub const fn equals(reference: u8) -> Self {
        Self {
            compare: Compare::Equal,
            reference,
            read_mask: 255,
            write_mask: 0,
            pass: StencilOp::Keep,
            fail: StencilOp::Keep,
            depth_fail: StencilOp::Keep,
        }
    }

    /// Writes `value` wherever a pixel is drawn.
    pub const fn write(value: u8) -> Self {
        Self { compare: Compare::Always, write_mask: 255, pass: StencilOp::Replace, ..Self::equals(value) }
    }
}

/// Added to the depth of each fragment (before the compare): `constant` in units of the depth format, `slope` times the
/// largest depth slope of the triangle. Negative moves away from the eye under reversed Z.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DepthBias {
    pub constant: f32,
    pub slope: f32,
}

/// How corners become primitives.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Topology {
    #[default]
    Triangles,
    Lines,
    Points,
}

/// Fixed-function state of a raster pass. The default: no culling, reversed-Z depth test and write if there is a depth
/// target, no stencil, no blending.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Raster {
    pub cull: Cull,
    pub depth_compare: Compare,
    pub depth_write: bool,
    pub depth_bias: Option<DepthBias>,
    /// Depths outside of [0, 1] are clamped instead of cut off, where the device can ([`crate::gpu`]).
    pub depth_clamp: bool,
    pub stencil: Option<Stencil>,
    pub blend: Blend,
    pub topology: Topology,
}

impl Default for Raster {
    fn default() -> Self {
        Self {
            cull: Cull::None,
            depth_compare: Compare::GreaterOrEqual,
            depth_write: true,
            depth_bias: None,
            depth_clamp: false,
            stencil: None,
            blend: Blend::Replace,
            topology: Topology::Triangles,
        }
    }
}

impl Raster {
    /// The default state.
    pub fn new() -> Self {
        Self::default()
    }

    #[must_use]
    pub fn cull(self, cull: Cull) -> Self {
        Self { cull, ..self }
    }

    #[must_use]
    pub fn depth_compare(self, depth_compare: Compare) -> Self {
        Self { depth_compare, ..self }
    }

    #[must_use]
    pub fn depth_write(self, depth_write: bool) -> Self {
        Self { depth_write, ..self }
    }

    #[must_use]
    pub fn depth_bias(self, constant: f32, slope: f32) -> Self {
        Self { depth_bias: Some(DepthBias { constant, slope }), ..self }
    }

    #[must_use]
    pub fn depth_clamp(self, depth_clamp: bool) -> Self {
        Self { depth_clamp, ..self }
    }

    #[must_use]
    pub fn stencil(self, stencil: Stencil) -> Self {
        Self { stencil: Some(stencil), ..self }
    }

    #[must_use]
    pub fn blend(self, blend: Blend) -> Self {
        Self { blend, ..self }
    }

    #[must_use]
    pub fn topology(self, topology: Topology) -> Self {
        Self { topology, ..self }
    }
}

/// One draw without indices: `gl_VertexIndex` from `first_vertex`, `gl_InstanceIndex` from `first_instance`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct DrawCall {
    pub first_vertex: u32,
    pub vertices: u32,
    pub first_instance: u32,
    pub instances: u32,
}

/// One draw with 32-bit indices: `gl_VertexIndex` is the index plus `vertex_offset`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct IndexedCall {
    pub first_index: u32,
    pub indices: u32,
    pub vertex_offset: i32,
    pub first_instance: u32,
    pub instances: u32,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) enum DrawKind {
    Calls(Vec<DrawCall>),
    Indexed { indices: Buffer, calls: Arc<[IndexedCall]> },
    Indirect { commands: Buffer, count: u32 },
    IndexedIndirect { indices: Buffer, commands: Buffer, count: u32 },
}

/// What a raster pass draws. Vertices are pulled from buffers by `gl_VertexIndex`; there is no vertex input.
#[derive(Clone, Debug, PartialEq)]
pub struct Draw {
    pub(crate) kind: DrawKind,
    /// Depth of everything drawn, through the viewport's depth range.
    pub(crate) depth: Option<f32>,
}

impl Draw {
    fn new(kind: DrawKind) -> Self {
        Self { kind, depth: None }
    }

    /// Draw calls.
    pub(crate) fn count(&self) -> usize {
        match &self.kind {
            DrawKind::Calls(calls) => calls.len(),
            DrawKind::Indexed { calls, .. } => calls.len(),
            DrawKind::Indirect { count, .. } | DrawKind::IndexedIndirect { count, .. } => *count as usize,
        }
    }

    /// One triangle over the whole target, at depth 0.
    pub fn fullscreen() -> Self {
        Self::vertices(3)
    }

    /// One triangle over the whole target, at `depth` in [0, 1].
    pub fn fullscreen_at(depth: f32) -> Self {
        Self { depth: Some(depth), ..Self::fullscreen() }
    }

    /// Vertices 0 to `count`, one instance.
    pub fn vertices(count: u32) -> Self {
        Self::instanced(count, 1)
    }

    /// Vertices 0 to `count`, `instances` times.
    pub fn instanced(count: u32, instances: u32) -> Self {
        Self::calls(vec![DrawCall { first_vertex: 0, vertices: count, first_instance: 0, instances }])
    }

    /// Several draws in this order.
    pub fn calls(calls: Vec<DrawCall>) -> Self {
        Self::new(DrawKind::Calls(calls))
    }

    /// Several draws in this order with 32-bit indices from `indices`. Passes that draw the same share an `Arc` of the calls.
    pub fn indexed(indices: Buffer, calls: impl Into<Arc<[IndexedCall]>>) -> Self {
        Self::new(DrawKind::Indexed { indices, calls: calls.into() })
    }

    /// `count` draws whose parameters (`VkDrawIndirectCommand`, 16 bytes: vertices, instances, first vertex, first
    /// instance) lie one after the other in `commands`.
    pub fn indirect(commands: Buffer, count: u32) -> Self {
        Self::new(DrawKind::Indirect { commands, count })
    }

    /// `count` indexed draws whose parameters (`VkDrawIndexedIndirectCommand`, 20 bytes: indices, instances, first
    /// index, vertex offset, first instance) lie one after the other in `commands`.
    pub fn indexed_indirect(indices: Buffer, commands: Buffer, count: u32) -> Self {
        Self::new(DrawKind::IndexedIndirect { indices, commands, count })
    }
}

//! What a graph records: plain data, no Vulkan object.

use super::{
    accel::BottomBuild,
    args::Bind,
    format::{Format, ImageDesc},
    handles::{Accel, Buffer, Image},
    over::Over,
    raster::{Draw, Raster, Targets},
    vocab::{Layout, Usage},
};
use std::sync::Arc;

use crate::gpu::{AccelLayout, OwnedAccel, OwnedBuffer, OwnedImage};
use crate::shader::Shader;

/// Where a resource comes from and how long it lives.
#[derive(Clone, Debug)]
pub(crate) enum Origin {
    /// Made by the graph; its memory is shared with others that are not in use at the same time.
    Transient,
    /// Last frame's or this frame's half of a pair that outlives the graph.
    History { key: String, next: bool },
    /// Owned by someone else, and left as found.
    Imported(Imported),
}

/// An image or buffer that someone else owns.
#[derive(Clone, Debug)]
pub(crate) struct Imported {
    /// Layout before and after the graph.
    pub rest: Layout,
    /// It holds data at the start.
    pub contents: bool,
    /// What it was made for; `None`: known only by description.
    pub usage: Option<Usage>,
    /// Keeps it alive; `Described` for planning without a device.
    pub owner: Owner,
}

#[derive(Clone, Debug)]
pub(crate) enum Owner {
    Described,
    Image(OwnedImage),
    Buffer(OwnedBuffer),
    Accel(OwnedAccel),
}

#[derive(Clone, Debug)]
pub(crate) struct ImageEntry {
    pub name: String,
    pub desc: ImageDesc,
    pub origin: Origin,
}

#[derive(Clone, Debug)]
pub(crate) struct BufferEntry {
    pub name: String,
    pub bytes: u64,
    pub origin: Origin,
    /// Contents at the start of the graph.
    pub contents: Option<Vec<u8>>,
    /// Read by the CPU after the graph.
    pub host: bool,
    /// It holds acceleration structures.
    pub accel: Option<Arc<AccelLayout>>,
}

/// How a compute pass is launched.
#[derive(Clone, Debug)]
pub(crate) enum Groups {
    Direct([u32; 3]),
    /// `VkDispatchIndirectCommand` at this offset into the buffer's range.
    Indirect {
        buffer: Buffer,
        offset: u64,
    },
}

/// A shader with everything it binds.
#[derive(Clone, Debug)]
pub(crate) struct Bound {
    pub shader: &'static Shader,
    pub resources: Vec<Bind>,
    pub push: Vec<u8>,
    pub spec: Vec<u32>,
}

#[derive(Clone, Debug)]
pub(crate) enum Work {
    /// Contents of all buffers made with `buffer_from`.
    Upload {
        buffers: Vec<Buffer>,
    },
    Compute {
        bound: Bound,
        groups: Groups,
        /// The dispatches of a pass with a long loop; `None`: one.
        over: Option<Over>,
    },
    Raster {
        bound: Bound,
        targets: Targets,
        state: Raster,
        draw: Draw,
    },
    /// Bottom levels from triangles.
    BuildBottoms {
        accel: Accel,
        builds: Vec<BottomBuild>,
        scratch: Buffer,
    },
    /// The top level from `count` instances.
    BuildTop {
        accel: Accel,
        instances: Buffer,
        count: u32,
        scratch: Buffer,
    },
    Clear {
        image: Image,
        value: [f32; 4],
    },
    Fill {
        buffer: Buffer,
        value: u32,
    },
    CopyImage {
        from: Image,
        to: Image,
    },
    CopyBuffer {
        from: Buffer,
        to: Buffer,
    },
    Blit {
        from: Image,
        to: Image,
    },
    /// One level, all layers of the handle, tightly packed.
    ReadImage {
        from: Image,
        to: Buffer,
    },
    ReadBuffer {
        from: Buffer,
        to: Buffer,
    },
}

#[derive(Clone, Debug)]
pub(crate) struct Pass {
    pub name: String,
    /// Labels around it, outermost first.
    pub scope: Vec<String>,
    /// Its shaders' starts are counted.
    pub counted: bool,
    /// Rays that it traces, about; 0: little is known of it.
    pub rays: u64,
    /// Buffers that its compute shader uses by their addresses; true: it also writes them.
    pub addressed: Vec<(Buffer, bool)>,
    pub work: Work,
}

/// What a readback token stands for.
#[derive(Clone, Debug)]
pub(crate) struct ReadEntry {
    /// The host-visible buffer.
    pub to: Buffer,
    /// What is in it.
    pub what: ReadWhat,
}

#[derive(Clone, Debug)]
pub(crate) enum ReadWhat {
    Image { name: String, desc: ImageDesc, format: Format },
    Buffer,
}

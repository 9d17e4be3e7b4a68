//! The words of a plan: stages, accesses, layouts, usages and parts of resources. The Vulkan ones, but without Vulkan.

use std::{
    fmt,
    ops::{BitOr, BitOrAssign, Range},
};

macro_rules! bits {
    ($(#[$doc:meta])* $name:ident { $($(#[$flag_doc:meta])* $flag:ident = $bit:expr),* $(,)? }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub struct $name(pub u32);

        impl $name {
            pub const NONE: Self = Self(0);
            $($(#[$flag_doc])* pub const $flag: Self = Self($bit);)*

            /// Every bit of `other` is in `self`.
            pub const fn contains(self, other: Self) -> bool {
                self.0 & other.0 == other.0
            }

            /// Some bit is in both.
            pub const fn intersects(self, other: Self) -> bool {
                self.0 & other.0 != 0
            }

            /// No bit.
            pub const fn is_empty(self) -> bool {
                self.0 == 0
            }

            /// Bits of both.
            #[must_use]
            pub const fn and(self, other: Self) -> Self {
                Self(self.0 & other.0)
            }

            /// Each bit alone.
            pub fn each(self) -> impl Iterator<Item = Self> {
                let mut rest = self.0;
                std::iter::from_fn(move || {
                    let lowest = rest & rest.wrapping_neg();
                    rest ^= lowest;
                    (lowest != 0).then_some(Self(lowest))
                })
            }
        }

        impl BitOr for $name {
            type Output = Self;
            fn bitor(self, other: Self) -> Self {
                Self(self.0 | other.0)
            }
        }

        impl BitOrAssign for $name {
            fn bitor_assign(&mut self, other: Self) {
                self.0 |= other.0;
            }
        }

        impl fmt::Debug for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                let mut first = true;
                $(if Self::$flag.0.is_power_of_two() && self.contains(Self::$flag) {
                    if !first {
                        f.write_str("|")?;
                    }
                    first = false;
                    f.write_str(stringify!($flag))?;
                })*
                if first { f.write_str("NONE") } else { Ok(()) }
            }
        }
    };
}

bits! {
    /// Where in the pipeline something happens.
    Stages {
        INDIRECT = 1, INDEX = 2, VERTEX = 4, FRAGMENT = 8,
        /// Early and late fragment tests.
        DEPTH = 16,
        /// Colour output, blending, loads and stores of colour targets.
        COLOR = 32,
        COMPUTE = 64,
        /// Copies, blits, clears.
        TRANSFER = 128,
        HOST = 256,
        /// Builds of acceleration structures.
        ACCEL = 512,
        /// Everything on the device.
        ALL = 0xFF + 512,
    }
}

bits! {
    /// What is done to memory.
    Access {
        SAMPLED = 1, STORAGE_READ = 2, STORAGE_WRITE = 4,
        COLOR_READ = 8, COLOR_WRITE = 16, DEPTH_READ = 32, DEPTH_WRITE = 64,
        TRANSFER_READ = 128, TRANSFER_WRITE = 256, INDIRECT_READ = 512, INDEX_READ = 1024,
        HOST_READ = 2048, UNIFORM_READ = 4096,
        /// Of acceleration structures, by builds and ray queries.
        ACCEL_READ = 8192,
        /// Of acceleration structures and of scratch memory, by builds.
        ACCEL_WRITE = 16384,
        /// Of vertices, indices and instances, by builds.
        BUILD_INPUT = 32768,
        /// Everything on the device that writes.
        WRITES = 4 + 16 + 64 + 256 + 16384,
        /// Everything on the device.
        EVERYTHING = 2047 + 4096 + 8192 + 16384 + 32768,
    }
}

impl Access {
    /// The bits that write.
    #[must_use]
    pub const fn writes(self) -> Self {
        self.and(Self::WRITES)
    }

    /// The bits that read.
    #[must_use]
    pub const fn reads(self) -> Self {
        Self(self.0 & !Self::WRITES.0)
    }
}

bits! {
    /// What an image or buffer must be made for.
    Usage {
        SAMPLED = 1, STORAGE = 2, COLOR = 4, DEPTH = 8, COPY_FROM = 16, COPY_TO = 32, INDEX = 64, INDIRECT = 128,
        /// Mapped for the CPU to read.
        HOST = 256,
        UNIFORM = 512,
        /// Holds acceleration structures.
        ACCEL = 1024,
    }
}

/// How the memory of an image is arranged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Layout {
    /// Contents may be lost.
    Undefined,
    General,
    ShaderRead,
    Color,
    Depth,
    /// Depth and stencil, both only read, by tests or shaders.
    DepthRead,
    CopyFrom,
    CopyTo,
    /// On its way to a window.
    Present,
    /// A buffer.
    Buffer,
}

/// Part of a resource. Images: levels and layers. Buffers: bytes, and `0..1`.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Region {
    /// Levels, or bytes.
    pub a: (u64, u64),
    /// Layers.
    pub b: (u64, u64),
}

impl Region {
    /// Levels and layers of an image.
    pub fn image(mips: Range<u32>, layers: Range<u32>) -> Self {
        Self { a: (mips.start.into(), mips.end.into()), b: (layers.start.into(), layers.end.into()) }
    }

    /// Bytes of a buffer.
    pub fn buffer(bytes: Range<u64>) -> Self {
        Self { a: (bytes.start, bytes.end), b: (0, 1) }
    }

    /// Both have a part in common.
    pub fn overlaps(&self, other: &Self) -> bool {
        self.a.0 < other.a.1 && other.a.0 < self.a.1 && self.b.0 < other.b.1 && other.b.0 < self.b.1
    }

    /// `other` is a part of it.
    pub fn covers(&self, other: &Self) -> bool {
        self.a.0 <= other.a.0 && other.a.1 <= self.a.1 && self.b.0 <= other.b.0 && other.b.1 <= self.b.1
    }
}

/// One half of a barrier.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Scope {
    pub stages: Stages,
    pub access: Access,
}

/// A logical resource of a graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Resource {
    Image(u32),
    Buffer(u32),
}

/// What a pass does to a part of a resource.
#[derive(Clone, Debug, PartialEq)]
pub struct Use {
    pub resource: Resource,
    pub region: Region,
    pub scope: Scope,
    pub layout: Layout,
    pub usage: Usage,
    /// Name of the binding, or the role: `colour 0`, `depth`, `from`.
    pub role: String,
}

impl Use {
    /// It changes contents.
    pub fn writes(&self) -> bool {
        !self.scope.access.writes().is_empty()
    }

    /// It needs contents.
    pub fn reads(&self) -> bool {
        !self.scope.access.reads().is_empty()
    }
}

/// What can be wrong with a graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MistakeKind {
    /// A handle of another graph.
    Foreign,
    /// Levels, layers or bytes that the resource does not have.
    Range,
    /// Nothing has written what is read.
    ReadBeforeWrite,
    /// A write to what is only there to be read.
    ReadOnly,
    /// Read and written, or written twice, in one pass.
    Conflict,
    /// A format that cannot serve.
    Format,
    /// Extents, counts or shapes that do not fit together.
    Shape,
}

/// A mistake in a graph, with pass and resource.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mistake {
    pub kind: MistakeKind,
    pub graph: String,
    pub pass: String,
    pub resource: String,
    pub what: String,
}

impl fmt::Display for Mistake {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "graph `{}`, pass `{}`, resource `{}`: {}", self.graph, self.pass, self.resource, self.what)
    }
}

impl std::error::Error for Mistake {}

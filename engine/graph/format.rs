//! Pixel formats and extents, without Vulkan types, so that a graph can be built and planned without a device.

/// How the pixels of an image are stored. Unsigned normalised unless the name says otherwise: `F` float, `U` unsigned
/// integer, `I` signed integer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Format {
    R8,
    RG8,
    RGBA8,
    /// Decoded to linear when sampled, encoded when drawn to; cannot be a storage image.
    RGBA8Srgb,
    BGRA8,
    BGRA8Srgb,
    R8U,
    RGBA8U,
    R16,
    RG16,
    RGBA16,
    R16F,
    RG16F,
    RGBA16F,
    R16U,
    RG16U,
    RGBA16U,
    R32F,
    RG32F,
    RGBA32F,
    R32U,
    RG32U,
    RGBA32U,
    R32I,
    RG32I,
    RGBA32I,
    R11G11B10F,
    /// Ten bits of red in the low bits.
    RGB10A2,
    /// Depth as a float.
    D32F,
    /// Depth as a float, and eight bits of stencil.
    D32S8,
    /// Twenty-four bits of depth, and eight of stencil. Not on every device.
    D24S8,
    /// A compressed or other format of an imported image, by its Vulkan number. It can only be sampled.
    Raw(i32),
}

/// How the values of a [`Format`] reach a shader.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Class {
    Float,
    Uint,
    Sint,
    Depth,
    DepthStencil,
}

impl Format {
    /// Bytes of a pixel; depth and stencil: of the depth aspect. 0 for [`Format::Raw`].
    pub fn bytes(self) -> u32 {
        use Format::*;
        match self {
            R8 | R8U => 1,
            RG8 | R16 | R16F | R16U => 2,
            RGBA8 | RGBA8Srgb | BGRA8 | BGRA8Srgb | RGBA8U | RG16 | RG16F | RG16U | R32F | R32U | R32I | R11G11B10F
            | RGB10A2 | D32F | D32S8 | D24S8 => 4,
            RGBA16 | RGBA16F | RGBA16U | RG32F | RG32U | RG32I => 8,
            RGBA32F | RGBA32U | RGBA32I => 16,
            Raw(_) => 0,
        }
    }

    /// Float, integer or depth.
    pub fn class(self) -> Class {
        use Format::*;
        match self {
            R8U | RGBA8U | R16U | RG16U | RGBA16U | R32U | RG32U | RGBA32U => Class::Uint,
            R32I | RG32I | RGBA32I => Class::Sint,
            D32F => Class::Depth,
            D32S8 | D24S8 => Class::DepthStencil,
            _ => Class::Float,
        }
    }

    /// The format that SPIR-V numbers so, for storage images; `None` if no image here has it.
    pub fn from_spirv(number: u32) -> Option<Self> {
        use Format::*;
        Some(match number {
            1 => RGBA32F,
            2 => RGBA16F,
            3 => R32F,
            4 => RGBA8,
            6 => RG32F,
            7 => RG16F,
            8 => R11G11B10F,
            9 => R16F,
            10 => RGBA16,
            11 => RGB10A2,
            12 => RG16,
            13 => RG8,
            14 => R16,
            15 => R8,
            21 => RGBA32I,
            24 => R32I,
            25 => RG32I,
            30 => RGBA32U,
            31 => RGBA16U,
            32 => RGBA8U,
            33 => R32U,
            35 => RG32U,
            36 => RG16U,
            38 => R16U,
            39 => R8U,
            _ => return None,
        })
    }

    /// Depth, with or without stencil.
    pub fn is_depth(self) -> bool {
        matches!(self.class(), Class::Depth | Class::DepthStencil)
    }

    /// Channels that hold data: 1 to 4.
    pub fn channels(self) -> u32 {
        use Format::*;
        match self {
            R8 | R8U | R16 | R16F | R16U | R32F | R32U | R32I | D32F | D32S8 | D24S8 => 1,
            RG8 | RG16 | RG16F | RG16U | RG32F | RG32U | RG32I => 2,
            R11G11B10F => 3,
            _ => 4,
        }
    }
}

/// Width and height in pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Extent {
    pub width: u32,
    pub height: u32,
}

impl Extent {
    pub const fn new(width: u32, height: u32) -> Self {
        Self { width, height }
    }

    /// `size` by `size`.
    pub const fn square(size: u32) -> Self {
        Self { width: size, height: size }
    }

    /// Both sides divided by `by`, rounded up.
    #[must_use]
    pub const fn div_ceil(self, by: u32) -> Self {
        Self { width: self.width.div_ceil(by), height: self.height.div_ceil(by) }
    }

    /// Size of mip level `level`: halved that often, rounded down, at least 1.
    #[must_use]
    pub const fn mip(self, level: u32) -> Self {
        const fn down(size: u32, level: u32) -> u32 {
            let small = if level < 32 { size >> level } else { 0 };
            if small == 0 { 1 } else { small }
        }
        Self { width: down(self.width, level), height: down(self.height, level) }
    }

    /// Levels of a full mip chain.
    pub const fn mip_levels(self) -> u32 {
        let longest = if self.width > self.height { self.width } else { self.height };
        if longest == 0 { 1 } else { 32 - longest.leading_zeros() }
    }

    /// Width times height.
    pub const fn pixels(self) -> u64 {
        self.width as u64 * self.height as u64
    }

    /// Width over height.
    pub fn aspect(self) -> f32 {
        self.width as f32 / self.height.max(1) as f32
    }
}

impl std::fmt::Display for Extent {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}×{}", self.width, self.height)
    }
}

impl From<[u32; 2]> for Extent {
    fn from([width, height]: [u32; 2]) -> Self {
        Self { width, height }
    }
}

impl From<(u32, u32)> for Extent {
    fn from((width, height): (u32, u32)) -> Self {
        Self { width, height }
    }
}

impl From<Extent> for [u32; 2] {
    fn from(e: Extent) -> Self {
        [e.width, e.height]
    }
}

/// Threads of a compute pass; the graph divides by the shader's workgroup, rounding up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Threads(pub [u32; 3]);

impl From<u32> for Threads {
    fn from(x: u32) -> Self {
        Self([x, 1, 1])
    }
}

impl From<Extent> for Threads {
    fn from(e: Extent) -> Self {
        Self([e.width, e.height, 1])
    }
}

impl From<[u32; 2]> for Threads {
    fn from([x, y]: [u32; 2]) -> Self {
        Self([x, y, 1])
    }
}

impl From<[u32; 3]> for Threads {
    fn from(size: [u32; 3]) -> Self {
        Self(size)
    }
}

/// What an image is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ImageDesc {
    pub format: Format,
    pub extent: Extent,
    /// Slices of a volume (`sampler3D`, `image3D`); 1 otherwise.
    pub depth: u32,
    pub mips: u32,
    /// Layers of an array; six for each cube.
    pub layers: u32,
    /// Can be viewed as a cube or an array of cubes.
    pub cube: bool,
}

impl ImageDesc {
    /// One level, one layer.
    pub const fn new(format: Format, extent: Extent) -> Self {
        Self { format, extent, depth: 1, mips: 1, layers: 1, cube: false }
    }

    /// `size`² cube map.
    pub const fn cube(format: Format, size: u32) -> Self {
        Self { format, extent: Extent::square(size), depth: 1, mips: 1, layers: 6, cube: true }
    }

    /// A volume of `depth` slices.
    pub const fn volume(format: Format, extent: Extent, depth: u32) -> Self {
        Self { format, extent, depth, mips: 1, layers: 1, cube: false }
    }

    #[must_use]
    pub const fn mips(self, mips: u32) -> Self {
        Self { mips, ..self }
    }

    /// All levels down to 1×1.
    #[must_use]
    pub const fn all_mips(self) -> Self {
        Self { mips: self.extent.mip_levels(), ..self }
    }

    #[must_use]
    pub const fn layers(self, layers: u32) -> Self {
        Self { layers, ..self }
    }

    /// Bytes of all levels and layers, without padding.
    pub fn bytes(&self) -> u64 {
        let pixels: u64 =
            (0..self.mips).map(|m| self.extent.mip(m).pixels() * u64::from((self.depth >> m).max(1))).sum();
        let stencil = if self.format.class() == Class::DepthStencil { 1 } else { 0 };
        pixels * u64::from(self.layers) * u64::from(self.format.bytes() + stencil)
    }
}

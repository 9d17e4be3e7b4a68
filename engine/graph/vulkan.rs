//! The words of a plan in Vulkan.

use ash::vk;

use super::{
    format::{Class, Format, ImageDesc},
    raster::{Blend, Compare, Cull, StencilOp, Topology},
    vocab::{Access, Layout, Stages, Usage},
};
use crate::{gpu, shader::Dim};

/// Every format but [`Format::Raw`].
const FORMATS: [(Format, vk::Format); 31] = [
    (Format::R8, vk::Format::R8_UNORM),
    (Format::RG8, vk::Format::R8G8_UNORM),
    (Format::RGBA8, vk::Format::R8G8B8A8_UNORM),
    (Format::RGBA8Srgb, vk::Format::R8G8B8A8_SRGB),
    (Format::BGRA8, vk::Format::B8G8R8A8_UNORM),
    (Format::BGRA8Srgb, vk::Format::B8G8R8A8_SRGB),
    (Format::R8U, vk::Format::R8_UINT),
    (Format::RGBA8U, vk::Format::R8G8B8A8_UINT),
    (Format::R16, vk::Format::R16_UNORM),
    (Format::RG16, vk::Format::R16G16_UNORM),
    (Format::RGBA16, vk::Format::R16G16B16A16_UNORM),
    (Format::R16F, vk::Format::R16_SFLOAT),
    (Format::RG16F, vk::Format::R16G16_SFLOAT),
    (Format::RGBA16F, vk::Format::R16G16B16A16_SFLOAT),
    (Format::R16U, vk::Format::R16_UINT),
    (Format::RG16U, vk::Format::R16G16_UINT),
    (Format::RGBA16U, vk::Format::R16G16B16A16_UINT),
    (Format::R32F, vk::Format::R32_SFLOAT),
    (Format::RG32F, vk::Format::R32G32_SFLOAT),
    (Format::RGBA32F, vk::Format::R32G32B32A32_SFLOAT),
    (Format::R32U, vk::Format::R32_UINT),
    (Format::RG32U, vk::Format::R32G32_UINT),
    (Format::RGBA32U, vk::Format::R32G32B32A32_UINT),
    (Format::R32I, vk::Format::R32_SINT),
    (Format::RG32I, vk::Format::R32G32_SINT),
    (Format::RGBA32I, vk::Format::R32G32B32A32_SINT),
    (Format::R11G11B10F, vk::Format::B10G11R11_UFLOAT_PACK32),
    (Format::RGB10A2, vk::Format::A2B10G10R10_UNORM_PACK32),
    (Format::D32F, vk::Format::D32_SFLOAT),
    (Format::D32S8, vk::Format::D32_SFLOAT_S8_UINT),
    (Format::D24S8, vk::Format::D24_UNORM_S8_UINT),
];

impl Format {
    /// The same format in Vulkan.
    pub fn to_vk(self) -> vk::Format {
        match self {
            Self::Raw(raw) => vk::Format::from_raw(raw),
            _ => FORMATS.iter().find(|(f, _)| *f == self).map_or(vk::Format::UNDEFINED, |(_, vk)| *vk),
        }
    }

    /// A Vulkan format; [`Format::Raw`] if it has no name here.
    pub fn from_vk(format: vk::Format) -> Self {
        FORMATS.iter().find(|(_, vk)| *vk == format).map_or(Self::Raw(format.as_raw()), |(f, _)| *f)
    }
}

impl Layout {
    /// The Vulkan layout; buffers have none.
    pub fn to_vk(self) -> vk::ImageLayout {
        use vk::ImageLayout as L;
        match self {
            Self::Undefined | Self::Buffer => L::UNDEFINED,
            Self::General => L::GENERAL,
            Self::ShaderRead => L::SHADER_READ_ONLY_OPTIMAL,
            Self::Color => L::COLOR_ATTACHMENT_OPTIMAL,
            Self::Depth => L::DEPTH_STENCIL_ATTACHMENT_OPTIMAL,
            Self::DepthRead => L::DEPTH_STENCIL_READ_ONLY_OPTIMAL,
            Self::CopyFrom => L::TRANSFER_SRC_OPTIMAL,
            Self::CopyTo => L::TRANSFER_DST_OPTIMAL,
            Self::Present => L::PRESENT_SRC_KHR,
        }
    }

    /// A Vulkan layout; `None` if plans do not use it.
    pub fn from_vk(layout: vk::ImageLayout) -> Option<Self> {
        use Layout::*;
        [Undefined, General, ShaderRead, Color, Depth, DepthRead, CopyFrom, CopyTo, Present]
            .into_iter()
            .find(|l| l.to_vk() == layout)
    }
}

pub(super) fn stages(stages: Stages) -> vk::PipelineStageFlags2 {
    use vk::PipelineStageFlags2 as S;
    if stages.contains(Stages::ALL) {
        return S::ALL_COMMANDS;
    }
    let table = [
        (Stages::INDIRECT, S::DRAW_INDIRECT),
        (Stages::INDEX, S::INDEX_INPUT),
        (Stages::VERTEX, S::VERTEX_SHADER),
        (Stages::FRAGMENT, S::FRAGMENT_SHADER),
        (Stages::DEPTH, S::EARLY_FRAGMENT_TESTS | S::LATE_FRAGMENT_TESTS),
        (Stages::COLOR, S::COLOR_ATTACHMENT_OUTPUT),
        (Stages::COMPUTE, S::COMPUTE_SHADER),
        (Stages::TRANSFER, S::ALL_TRANSFER),
        (Stages::HOST, S::HOST),
        (Stages::ACCEL, S::ACCELERATION_STRUCTURE_BUILD_KHR),
    ];
    table.iter().filter(|(s, _)| stages.contains(*s)).fold(S::NONE, |all, (_, vk)| all | *vk)
}

pub(super) fn access(access: Access) -> vk::AccessFlags2 {
    use vk::AccessFlags2 as A;
    if access == Access::WRITES {
        return A::MEMORY_WRITE;
    }
    if access.contains(Access::EVERYTHING) {
        return A::MEMORY_READ | A::MEMORY_WRITE;
    }
    let table = [
        (Access::SAMPLED, A::SHADER_SAMPLED_READ),
        (Access::STORAGE_READ, A::SHADER_STORAGE_READ),
        (Access::STORAGE_WRITE, A::SHADER_STORAGE_WRITE),
        (Access::COLOR_READ, A::COLOR_ATTACHMENT_READ),
        (Access::COLOR_WRITE, A::COLOR_ATTACHMENT_WRITE),
        (Access::DEPTH_READ, A::DEPTH_STENCIL_ATTACHMENT_READ),
        (Access::DEPTH_WRITE, A::DEPTH_STENCIL_ATTACHMENT_WRITE),
        (Access::TRANSFER_READ, A::TRANSFER_READ),
        (Access::TRANSFER_WRITE, A::TRANSFER_WRITE),
        (Access::INDIRECT_READ, A::INDIRECT_COMMAND_READ),
        (Access::INDEX_READ, A::INDEX_READ),
        (Access::HOST_READ, A::HOST_READ),
        (Access::UNIFORM_READ, A::UNIFORM_READ),
        (Access::ACCEL_READ, A::ACCELERATION_STRUCTURE_READ_KHR),
        (Access::ACCEL_WRITE, A::ACCELERATION_STRUCTURE_WRITE_KHR),
        (Access::BUILD_INPUT, A::SHADER_READ),
    ];
    table.iter().filter(|(a, _)| access.contains(*a)).fold(A::NONE, |all, (_, vk)| all | *vk)
}

pub(super) fn image_usage(usage: Usage) -> vk::ImageUsageFlags {
    use vk::ImageUsageFlags as U;
    let table = [
        (Usage::SAMPLED, U::SAMPLED),
        (Usage::STORAGE, U::STORAGE),
        (Usage::COLOR, U::COLOR_ATTACHMENT),
        (Usage::DEPTH, U::DEPTH_STENCIL_ATTACHMENT),
        (Usage::COPY_FROM, U::TRANSFER_SRC),
        (Usage::COPY_TO, U::TRANSFER_DST),
    ];
    table.iter().filter(|(u, _)| usage.contains(*u)).fold(U::empty(), |all, (_, vk)| all | *vk)
}

pub(super) fn usage_of_image(usage: vk::ImageUsageFlags) -> Usage {
    [Usage::SAMPLED, Usage::STORAGE, Usage::COLOR, Usage::DEPTH, Usage::COPY_FROM, Usage::COPY_TO]
        .into_iter()
        .filter(|u| usage.contains(image_usage(*u)))
        .fold(Usage::NONE, |all, u| all | u)
}

pub(super) fn usage_of_buffer(usage: vk::BufferUsageFlags) -> Usage {
    use vk::BufferUsageFlags as U;
    let table = [
        (Usage::STORAGE, U::STORAGE_BUFFER),
        (Usage::UNIFORM, U::UNIFORM_BUFFER),
        (Usage::INDEX, U::INDEX_BUFFER),
        (Usage::INDIRECT, U::INDIRECT_BUFFER),
        (Usage::COPY_FROM, U::TRANSFER_SRC),
        (Usage::COPY_TO, U::TRANSFER_DST),
        (Usage::ACCEL, U::ACCELERATION_STRUCTURE_STORAGE_KHR),
    ];
    table.iter().filter(|(_, vk)| usage.contains(*vk)).fold(Usage::NONE, |all, (u, _)| all | *u)
}

/// What the memory layer makes of a description.
pub(super) fn image_desc(desc: &ImageDesc, usage: vk::ImageUsageFlags) -> gpu::ImageDesc {
    gpu::ImageDesc {
        format: desc.format.to_vk(),
        width: desc.extent.width,
        height: desc.extent.height,
        depth: desc.depth,
        mips: desc.mips,
        layers: desc.layers,
        cube: desc.cube,
        usage,
    }
}

/// The aspect that shaders and copies see: depth of depth-stencil images.
pub(super) fn data_aspect(format: Format) -> vk::ImageAspectFlags {
    match format.class() {
        Class::Depth | Class::DepthStencil => vk::ImageAspectFlags::DEPTH,
        _ => vk::ImageAspectFlags::COLOR,
    }
}

pub(super) fn view_type(dim: Dim) -> vk::ImageViewType {
    match dim {
        Dim::D1 => vk::ImageViewType::TYPE_1D,
        Dim::D2 => vk::ImageViewType::TYPE_2D,
        Dim::D2Array => vk::ImageViewType::TYPE_2D_ARRAY,
        Dim::D3 => vk::ImageViewType::TYPE_3D,
        Dim::Cube => vk::ImageViewType::CUBE,
        Dim::CubeArray => vk::ImageViewType::CUBE_ARRAY,
    }
}

pub(super) fn compare(compare: Compare) -> vk::CompareOp {
    match compare {
        Compare::Never => vk::CompareOp::NEVER,
        Compare::Less => vk::CompareOp::LESS,
        Compare::Equal => vk::CompareOp::EQUAL,
        Compare::LessOrEqual => vk::CompareOp::LESS_OR_EQUAL,
        Compare::Greater => vk::CompareOp::GREATER,
        Compare::NotEqual => vk::CompareOp::NOT_EQUAL,
        Compare::GreaterOrEqual => vk::CompareOp::GREATER_OR_EQUAL,
        Compare::Always => vk::CompareOp::ALWAYS,
    }
}

pub(super) fn cull(cull: Cull) -> vk::CullModeFlags {
    match cull {
        Cull::None => vk::CullModeFlags::NONE,
        Cull::Back => vk::CullModeFlags::BACK,
        Cull::Front => vk::CullModeFlags::FRONT,
    }
}

pub(super) fn stencil_op(op: StencilOp) -> vk::StencilOp {
    match op {
        StencilOp::Keep => vk::StencilOp::KEEP,
        StencilOp::Zero => vk::StencilOp::ZERO,
        StencilOp::Replace => vk::StencilOp::REPLACE,
        StencilOp::Increment => vk::StencilOp::INCREMENT_AND_CLAMP,
        StencilOp::Decrement => vk::StencilOp::DECREMENT_AND_CLAMP,
        StencilOp::Invert => vk::StencilOp::INVERT,
    }
}

pub(super) fn topology(topology: Topology) -> vk::PrimitiveTopology {
    match topology {
        Topology::Triangles => vk::PrimitiveTopology::TRIANGLE_LIST,
        Topology::Lines => vk::PrimitiveTopology::LINE_LIST,
        Topology::Points => vk::PrimitiveTopology::POINT_LIST,
    }
}

pub(super) fn blend(blend: Blend) -> Option<gpu::Blend> {
    use vk::{BlendFactor as F, BlendOp as O};
    let (src, dst, op) = match blend {
        Blend::Replace => return None,
        Blend::Add => (F::ONE, F::ONE, O::ADD),
        Blend::Alpha => (F::SRC_ALPHA, F::ONE_MINUS_SRC_ALPHA, O::ADD),
        Blend::Premultiplied => (F::ONE, F::ONE_MINUS_SRC_ALPHA, O::ADD),
        Blend::Multiply => (F::DST_COLOR, F::ZERO, O::ADD),
        Blend::Max => (F::ONE, F::ONE, O::MAX),
    };
    Some(gpu::Blend { src, dst, op })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_map_one_to_one_and_have_equal_sizes() {
        for (format, vk) in FORMATS {
            assert_eq!(Format::from_vk(vk), format);
            assert_eq!(format.to_vk(), vk);
            assert_eq!(gpu::block(vk).map(|b| b.bytes), Some(format.bytes()), "{format:?}");
        }
        let block = vk::Format::BC7_UNORM_BLOCK;
        assert_eq!(Format::from_vk(block).to_vk(), block);
    }

    #[test]
    fn layouts_come_back() {
        for layout in [Layout::General, Layout::ShaderRead, Layout::Depth, Layout::CopyTo, Layout::Present] {
            assert_eq!(Layout::from_vk(layout.to_vk()), Some(layout));
        }
        assert_eq!(Layout::from_vk(vk::ImageLayout::PREINITIALIZED), None);
    }
}

//! Sizes and aspects of formats.

use ash::vk;

/// The smallest unit of a format that is stored as a whole: one texel, or one block of a compressed format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Block {
    /// Texels.
    pub width: u32,
    /// Texels.
    pub height: u32,
    pub bytes: u32,
}

impl Block {
    /// Bytes of a tightly packed image of `width` × `height` × `depth` texels.
    pub fn image_bytes(self, width: u32, height: u32, depth: u32) -> u64 {
        u64::from(width.div_ceil(self.width))
            * u64::from(height.div_ceil(self.height))
            * u64::from(depth)
            * u64::from(self.bytes)
    }
}

/// The block of `format` as it is copied to and from buffers (depth-stencil: the depth aspect); `None` if the engine does
/// not know the format.
pub fn block(format: vk::Format) -> Option<Block> {
    use vk::Format as F;
    let texel = |bytes| Some(Block { width: 1, height: 1, bytes });
    let block4 = |bytes| Some(Block { width: 4, height: 4, bytes });
    match format {
        F::R8_UNORM | F::R8_SNORM | F::R8_UINT | F::R8_SINT | F::R8_SRGB | F::S8_UINT => texel(1),
        F::R8G8_UNORM | F::R8G8_SNORM | F::R8G8_UINT | F::R8G8_SINT | F::R8G8_SRGB => texel(2),
        F::R16_SFLOAT | F::R16_UNORM | F::R16_SNORM | F::R16_UINT | F::R16_SINT | F::D16_UNORM => texel(2),
        F::R8G8B8A8_UNORM | F::R8G8B8A8_SNORM | F::R8G8B8A8_UINT | F::R8G8B8A8_SINT | F::R8G8B8A8_SRGB => texel(4),
        F::B8G8R8A8_UNORM | F::B8G8R8A8_SRGB | F::A2B10G10R10_UNORM_PACK32 | F::A2B10G10R10_UINT_PACK32 => texel(4),
        F::B10G11R11_UFLOAT_PACK32 | F::E5B9G9R9_UFLOAT_PACK32 => texel(4),
        F::R16G16_SFLOAT | F::R16G16_UNORM | F::R16G16_SNORM | F::R16G16_UINT | F::R16G16_SINT => texel(4),
        F::R32_SFLOAT | F::R32_UINT | F::R32_SINT => texel(4),
        F::D32_SFLOAT | F::D32_SFLOAT_S8_UINT | F::D24_UNORM_S8_UINT | F::X8_D24_UNORM_PACK32 => texel(4),
        F::R16G16B16A16_SFLOAT
        | F::R16G16B16A16_UNORM
        | F::R16G16B16A16_SNORM
        | F::R16G16B16A16_UINT
        | F::R16G16B16A16_SINT
        | F::R32G32_SFLOAT
        | F::R32G32_UINT
        | F::R32G32_SINT
        | F::R64_UINT => texel(8),
        F::R32G32B32_SFLOAT | F::R32G32B32_UINT => texel(12),
        F::R32G32B32A32_SFLOAT | F::R32G32B32A32_UINT | F::R32G32B32A32_SINT => texel(16),
        F::BC1_RGB_UNORM_BLOCK
        | F::BC1_RGB_SRGB_BLOCK
        | F::BC1_RGBA_UNORM_BLOCK
        | F::BC1_RGBA_SRGB_BLOCK
        | F::BC4_UNORM_BLOCK
        | F::BC4_SNORM_BLOCK
        | F::ETC2_R8G8B8_UNORM_BLOCK
        | F::ETC2_R8G8B8_SRGB_BLOCK
        | F::EAC_R11_UNORM_BLOCK => block4(8),
        F::BC2_UNORM_BLOCK
        | F::BC2_SRGB_BLOCK
        | F::BC3_UNORM_BLOCK
        | F::BC3_SRGB_BLOCK
        | F::BC5_UNORM_BLOCK
        | F::BC5_SNORM_BLOCK
        | F::BC6H_UFLOAT_BLOCK
        | F::BC6H_SFLOAT_BLOCK
        | F::BC7_UNORM_BLOCK
        | F::BC7_SRGB_BLOCK
        | F::ETC2_R8G8B8A8_UNORM_BLOCK
        | F::ETC2_R8G8B8A8_SRGB_BLOCK
        | F::EAC_R11G11_UNORM_BLOCK
        | F::ASTC_4X4_UNORM_BLOCK
        | F::ASTC_4X4_SRGB_BLOCK => block4(16),
        _ => None,
    }
}

/// The aspects that images of `format` have.
pub fn aspects(format: vk::Format) -> vk::ImageAspectFlags {
    use vk::Format as F;
    match format {
        F::D16_UNORM | F::D32_SFLOAT | F::X8_D24_UNORM_PACK32 => vk::ImageAspectFlags::DEPTH,
        F::D32_SFLOAT_S8_UINT | F::D24_UNORM_S8_UINT | F::D16_UNORM_S8_UINT => {
            vk::ImageAspectFlags::DEPTH | vk::ImageAspectFlags::STENCIL
        }
        F::S8_UINT => vk::ImageAspectFlags::STENCIL,
        _ => vk::ImageAspectFlags::COLOR,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_of_compressed_formats_round_up_to_blocks() {
        let bc7 = block(vk::Format::BC7_UNORM_BLOCK).unwrap();
        assert_eq!(bc7.image_bytes(1, 1, 1), 16);
        assert_eq!(bc7.image_bytes(5, 4, 1), 32);
        let half4 = block(vk::Format::R16G16B16A16_SFLOAT).unwrap();
        assert_eq!(half4.image_bytes(5, 4, 2), 5 * 4 * 2 * 8);
        assert_eq!(block(vk::Format::UNDEFINED), None);
    }
}

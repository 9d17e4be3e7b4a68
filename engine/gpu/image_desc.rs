//! What images and views are, without a device.

use ash::vk;

use super::format::{aspects, block};

/// What image to make.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageDesc {
    pub format: vk::Format,
    /// Texels of mip level 0.
    pub width: u32,
    /// Texels of mip level 0.
    pub height: u32,
    /// Texels of mip level 0; more than 1 makes a 3D image.
    pub depth: u32,
    pub mips: u32,
    /// Array layers; 6 for each cube.
    pub layers: u32,
    /// Views of cubes are wanted.
    pub cube: bool,
    pub usage: vk::ImageUsageFlags,
}

impl ImageDesc {
    /// A 2D image with one level and one layer, to be sampled and copied (the usage of a texture).
    pub fn new(format: vk::Format, width: u32, height: u32) -> Self {
        use vk::ImageUsageFlags as U;
        let usage = U::SAMPLED | U::TRANSFER_SRC | U::TRANSFER_DST;
        Self { format, width, height, depth: 1, mips: 1, layers: 1, cube: false, usage }
    }

    #[must_use]
    pub fn depth(self, depth: u32) -> Self {
        Self { depth, ..self }
    }

    #[must_use]
    pub fn mips(self, mips: u32) -> Self {
        Self { mips, ..self }
    }

    #[must_use]
    pub fn layers(self, layers: u32) -> Self {
        Self { layers, ..self }
    }

    /// Cubes: six layers each.
    #[must_use]
    pub fn cubes(self, cubes: u32) -> Self {
        Self { layers: cubes.saturating_mul(6), cube: true, ..self }
    }

    /// Adds to the usage.
    #[must_use]
    pub fn also(self, usage: vk::ImageUsageFlags) -> Self {
        Self { usage: self.usage | usage, ..self }
    }

    /// Levels of a full mip chain down to 1 × 1 (× 1).
    pub fn full_mips(&self) -> u32 {
        32 - self.width.max(self.height).max(self.depth).max(1).leading_zeros()
    }

    /// Width, height and depth in texels of level `mip`.
    pub fn extent(&self, mip: u32) -> vk::Extent3D {
        let shrink = |size: u32| size.checked_shr(mip).unwrap_or(0).max(1);
        vk::Extent3D { width: shrink(self.width), height: shrink(self.height), depth: shrink(self.depth) }
    }

    /// All aspects of the format.
    pub fn aspects(&self) -> vk::ImageAspectFlags {
        aspects(self.format)
    }

    /// Bytes of one layer of level `mip`, tightly packed; `None` if the engine does not know the format.
    pub fn level_bytes(&self, mip: u32) -> Option<u64> {
        let extent = self.extent(mip);
        block(self.format).map(|block| block.image_bytes(extent.width, extent.height, extent.depth))
    }
}

/// Which part of an image a shader or an attachment sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ViewDesc {
    pub ty: vk::ImageViewType,
    /// Sampled depth-stencil images show one aspect.
    pub aspect: vk::ImageAspectFlags,
    pub base_mip: u32,
    pub mips: u32,
    pub base_layer: u32,
    pub layers: u32,
}

/// Contents of one layer of one mip level.
#[derive(Clone, Copy, Debug)]
pub struct Region<'a> {
    pub mip: u32,
    pub layer: u32,
    /// Tightly packed rows, the top one first.
    pub bytes: &'a [u8],
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_shrink_to_one() {
        let desc = ImageDesc::new(vk::Format::R8G8B8A8_UNORM, 5, 3).mips(3);
        assert_eq!(desc.full_mips(), 3);
        assert_eq!(desc.level_bytes(0), Some(60));
        assert_eq!(desc.level_bytes(1), Some(8));
        assert_eq!(desc.level_bytes(2), Some(4));
        assert_eq!(desc.extent(31), vk::Extent3D { width: 1, height: 1, depth: 1 });
        assert_eq!(desc.extent(40), vk::Extent3D { width: 1, height: 1, depth: 1 });
    }
}

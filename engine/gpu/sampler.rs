//! Samplers: few, cached, owned by the device.

use ash::vk;

use super::{Gpu, device::lock};
use crate::Result;

/// How a texture is read. Two equal ones share a Vulkan object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SamplerDesc {
    /// Linear instead of nearest, inside a mip level.
    pub linear: bool,
    /// Linear instead of nearest, between mip levels.
    pub linear_mips: bool,
    pub address: [vk::SamplerAddressMode; 3],
    /// Depth comparison, for shadow maps.
    pub compare: Option<vk::CompareOp>,
    /// Most samples of anisotropic filtering; 1: off. Lowered to what the device can.
    pub anisotropy: f32,
    pub border: vk::BorderColor,
}

impl SamplerDesc {
    /// Linear inside of the nearest level, clamped to the edge.
    pub const LINEAR: Self = Self {
        linear: true,
        linear_mips: false,
        address: [vk::SamplerAddressMode::CLAMP_TO_EDGE; 3],
        compare: None,
        anisotropy: 1.0,
        border: vk::BorderColor::FLOAT_TRANSPARENT_BLACK,
    };
    /// Nearest, clamped to the edge.
    pub const NEAREST: Self = Self { linear: false, ..Self::LINEAR };
    /// Linear inside and between levels, clamped to the edge.
    pub const TRILINEAR: Self = Self { linear_mips: true, ..Self::LINEAR };
    /// Linear inside and between levels, repeated.
    pub const REPEAT: Self = Self { address: [vk::SamplerAddressMode::REPEAT; 3], ..Self::TRILINEAR };
    /// Nearest, repeated.
    pub const NEAREST_REPEAT: Self = Self { address: [vk::SamplerAddressMode::REPEAT; 3], ..Self::NEAREST };
    /// For reverse-Z shadow maps: lit (1) where the receiver's depth is greater than or equal to the stored one, and
    /// outside of the map.
    pub const SHADOW: Self = Self {
        address: [vk::SamplerAddressMode::CLAMP_TO_BORDER; 3],
        compare: Some(vk::CompareOp::GREATER_OR_EQUAL),
        border: vk::BorderColor::FLOAT_TRANSPARENT_BLACK,
        ..Self::LINEAR
    };
}

/// [`SamplerDesc`] as a key: the float by its bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct SamplerKey(bool, bool, [vk::SamplerAddressMode; 3], Option<vk::CompareOp>, u32, vk::BorderColor);

impl Gpu {
    /// The sampler for `desc`; it lives as long as the device.
    ///
    /// # Errors
    /// `OutOfMemory`.
    pub fn sampler(&self, desc: SamplerDesc) -> Result<vk::Sampler> {
        let anisotropy = desc.anisotropy.clamp(1.0, self.caps().sampler_anisotropy.unwrap_or(1.0));
        let key =
            SamplerKey(desc.linear, desc.linear_mips, desc.address, desc.compare, anisotropy.to_bits(), desc.border);
        let mut samplers = lock(&self.0.samplers);
        if let Some(sampler) = samplers.get(&key) {
            return Ok(*sampler);
        }
        self.0.alive()?;
        let filter = if desc.linear { vk::Filter::LINEAR } else { vk::Filter::NEAREST };
        let info = vk::SamplerCreateInfo::default()
            .mag_filter(filter)
            .min_filter(filter)
            .mipmap_mode(if desc.linear_mips { vk::SamplerMipmapMode::LINEAR } else { vk::SamplerMipmapMode::NEAREST })
            .address_mode_u(desc.address[0])
            .address_mode_v(desc.address[1])
            .address_mode_w(desc.address[2])
            .anisotropy_enable(anisotropy > 1.0)
            .max_anisotropy(anisotropy)
            .compare_enable(desc.compare.is_some())
            .compare_op(desc.compare.unwrap_or(vk::CompareOp::ALWAYS))
            .border_color(desc.border)
            .max_lod(vk::LOD_CLAMP_NONE);
        // SAFETY: `info` is complete; the device is alive.
        let sampler =
            self.0.check(unsafe { self.0.device.create_sampler(&info, None) }, || "vkCreateSampler".into())?;
        samplers.insert(key, sampler);
        Ok(sampler)
    }
}

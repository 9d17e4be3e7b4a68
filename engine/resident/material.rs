//! Materials and lights as the shaders see them.

use super::textures::{Encoding, Packing};
use crate::{
    scene::{AlphaMode, LightKind, Material, MipFilter, Pose, Sampler, Scene, TextureRef, Wrap},
    shaders::{consts, types},
};
use glam::Vec3;

/// `lib/material.glsl`, struct Material.
pub(super) fn material(material: &Material, packing: &Packing) -> types::Material {
    let mut flags = 0;
    if material.unlit {
        flags |= consts::MATERIAL_UNLIT;
    }
    if material.double_sided {
        flags |= consts::MATERIAL_DOUBLE_SIDED;
    }
    let mut alpha_cutoff = 0.0;
    match material.alpha {
        AlphaMode::Opaque => {}
        AlphaMode::Mask { cutoff } => {
            flags |= consts::MATERIAL_MASK;
            alpha_cutoff = cutoff;
        }
        AlphaMode::Blend => flags |= consts::MATERIAL_BLEND,
    }
    let mut textures =
        [types::TextureUse { array: consts::NO_TEXTURE, ..Default::default() }; consts::TEXTURE_SLOTS as usize];
    let mut put = |slot: u32, used: &Option<TextureRef>, encoding| {
        if let Some(found) = used.as_ref().and_then(|r| texture_use(r, encoding, packing)) {
            textures[slot as usize] = found;
            flags |= 1 << (consts::MATERIAL_FIRST_TEXTURE + slot);
        }
    };
    put(consts::TEXTURE_BASE_COLOR, &material.base_color_texture, Encoding::Srgb);
    put(consts::TEXTURE_METALLIC_ROUGHNESS, &material.metallic_roughness_texture, Encoding::Linear);
    put(consts::TEXTURE_NORMAL, &material.normal_texture, Encoding::Linear);
    put(consts::TEXTURE_OCCLUSION, &material.occlusion_texture, Encoding::Linear);
    put(consts::TEXTURE_EMISSIVE, &material.emissive_texture, Encoding::Srgb);
    put(consts::TEXTURE_TRANSMISSION, &material.transmission_texture, Encoding::Linear);
    types::Material {
        base_color: material.base_color.to_array(),
        emissive: material.emissive.to_array(),
        metallic: material.metallic,
        roughness: material.roughness,
        normal_scale: material.normal_scale,
        occlusion_strength: material.occlusion_strength,
        alpha_cutoff,
        // KHR_materials_ior: 0 stands for an infinite index, a reflectance of 1.
        ior: if material.ior > 0.0 { material.ior } else { 1e9 },
        transmission: material.transmission,
        flags,
        textures,
    }
}

fn texture_use(used: &TextureRef, encoding: Encoding, packing: &Packing) -> Option<types::TextureUse> {
    let &(array, layer) = packing.places.get(&(used.texture, encoding))?;
    let size = &packing.arrays[array as usize];
    let [a, b, c, d, tx, ty] = used.transform;
    Some(types::TextureUse {
        array,
        layer,
        uv_set: used.uv_set.min(3),
        mode: sampler_mode(&used.sampler),
        size: [size.width as f32, size.height as f32],
        linear: [a, b, c, d],
        offset: [tx, ty],
    })
}

fn sampler_mode(sampler: &Sampler) -> u32 {
    let wrap = |wrap, clamp, mirror| match wrap {
        Wrap::Repeat => 0,
        Wrap::ClampToEdge => clamp,
        Wrap::MirroredRepeat => mirror,
    };
    let mut mode = wrap(sampler.wrap_u, consts::SAMPLER_CLAMP_U, consts::SAMPLER_MIRROR_U)
        | wrap(sampler.wrap_v, consts::SAMPLER_CLAMP_V, consts::SAMPLER_MIRROR_V);
    if !sampler.mag_linear {
        mode |= consts::SAMPLER_MAG_NEAREST;
    }
    if !sampler.min_linear {
        mode |= consts::SAMPLER_MIN_NEAREST;
    }
    mode | match sampler.mip {
        MipFilter::None => consts::SAMPLER_MIP_NONE,
        MipFilter::Nearest => consts::SAMPLER_MIP_NEAREST,
        MipFilter::Linear => 0,
    }
}

/// All lights of the scene as they stand in `pose`, one for each node that carries one (`lib/lights.glsl`, struct Light).
pub fn lights(scene: &Scene, pose: &Pose) -> Vec<types::Light> {
    let mut out = Vec::new();
    for (node, world) in scene.nodes.iter().zip(&pose.world) {
        let Some(light) = node.light.and_then(|l| scene.lights.get(l as usize)) else { continue };
        let (kind, range, spot_scale, spot_offset) = match light.kind {
            LightKind::Directional => (consts::LIGHT_DIRECTIONAL, None, 0.0, 1.0),
            LightKind::Point { range } => (consts::LIGHT_POINT, range, 0.0, 1.0),
            LightKind::Spot { range, inner, outer } => {
                // KHR_lights_punctual, "Inner and outer cone angles".
                let scale = 1.0 / (inner.cos() - outer.cos()).max(1e-3);
                (consts::LIGHT_SPOT, range, scale, -outer.cos() * scale)
            }
        };
        out.push(types::Light {
            position: world.w_axis.truncate().to_array(),
            kind,
            direction: (-world.z_axis.truncate()).try_normalize().unwrap_or(Vec3::NEG_Z).to_array(),
            range: range.unwrap_or(0.0),
            intensity: (light.color * light.intensity).to_array(),
            index: out.len() as u32,
            spot_scale,
            spot_offset,
        });
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Light, Node, Transform};
    use glam::{Mat4, Quat};

    #[test]
    fn spot_lights_shine_down_minus_z_with_the_gltf_cone() {
        let (inner, outer) = (0.3_f32, 0.8_f32);
        let kind = LightKind::Spot { range: Some(9.0), inner, outer };
        let light = Light { name: String::new(), kind, color: Vec3::new(1.0, 0.5, 0.25), intensity: 8.0 };
        let turn = Mat4::from_rotation_translation(Quat::from_rotation_y(std::f32::consts::FRAC_PI_2), Vec3::X);
        let node = Node { light: Some(0), local: Transform::Matrix(turn), ..Node::default() };
        let scene = Scene { nodes: vec![node], lights: vec![light], ..Scene::default() };
        let got = lights(&scene, &Pose::rest(&scene))[0];
        assert!(Vec3::from(got.direction).abs_diff_eq(Vec3::NEG_X, 1e-6));
        assert_eq!((got.position, got.range, got.intensity), ([1.0, 0.0, 0.0], 9.0, [8.0, 4.0, 2.0]));
        let cone = |angle: f32| (angle.cos() * got.spot_scale + got.spot_offset).clamp(0.0, 1.0);
        assert!((cone(inner) - 1.0).abs() < 1e-5 && cone(outer) < 1e-5);
        let middle = ((inner.cos() + outer.cos()) / 2.0).acos();
        assert!((cone(middle) - 0.5).abs() < 1e-5);
    }
}

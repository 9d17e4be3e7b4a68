//! Tells whether a scene has mirrors or glass, which need additional rays.

use crate::scene::{Material, Scene};

/// Below this roughness and above this metalness a surface is a mirror, as in `reference/path_step.glsl` and `igi/vpl_surface.glsl`.
const ROUGHNESS: f32 = 0.05;
const METALNESS: f32 = 0.5;

/// Whether any surface may be a mirror or glass, judged by the material factors only. Fast, but also true for most textured metals.
pub fn may_be_sharp(scene: &Scene) -> bool {
    in_use(scene).any(by_factors)
}

/// Like [`may_be_sharp`], but also reads the texels of the textures.
pub fn has_sharp(scene: &Scene) -> bool {
    in_use(scene).any(|m| by_factors(m) && (m.transmission > 0.0 || by_texels(scene, m)))
}

/// The materials that surfaces use and that reflect light.
fn in_use(scene: &Scene) -> impl Iterator<Item = &Material> {
    let primitives = scene.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let mut used: Vec<u32> = primitives.map(|primitive| primitive.material).collect();
    used.sort_unstable();
    used.dedup();
    used.into_iter().filter_map(|number| scene.materials.get(number as usize)).filter(|m| !m.unlit)
}

fn by_factors(m: &Material) -> bool {
    m.transmission > 0.0
        || (m.metallic > METALNESS && (m.roughness < ROUGHNESS || m.metallic_roughness_texture.is_some()))
}

/// Whether the material may be a mirror, judged by its texels. Interpolated values are never smoother or more metallic than the texels
/// around them.
fn by_texels(scene: &Scene, m: &Material) -> bool {
    let Some(texture) = m.metallic_roughness_texture.as_ref().and_then(|t| scene.textures.get(t.texture as usize))
    else {
        return m.roughness < ROUGHNESS;
    };
    let smooth = |texel: &[u8; 4]| m.roughness * f32::from(texel[1]) / 255.0 < ROUGHNESS;
    let metal = |texel: &[u8; 4]| m.metallic * f32::from(texel[2]) / 255.0 > METALNESS;
    texture.rgba.iter().any(smooth) && texture.rgba.iter().any(metal)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builtin;
    use crate::scene::{Texture, TextureRef};

    #[test]
    fn metal_is_sharp_where_its_texels_are() {
        let scene = |material: Material, texels: Vec<[u8; 4]>| {
            let mut scene = builtin::load("cornell").unwrap();
            scene.textures = vec![Texture { name: String::new(), width: texels.len() as u32, height: 1, rgba: texels }];
            scene.materials[0] = material;
            scene
        };
        let plain = builtin::load("cornell").unwrap().materials[0].clone();
        let metal = Material {
            metallic: 1.0,
            roughness: 1.0,
            metallic_roughness_texture: Some(TextureRef::new(0)),
            ..plain.clone()
        };
        let (rough_metal, smooth_paint, mirror) = ([0, 200, 255, 255], [0, 0, 0, 255], [0, 5, 255, 255]);
        for (material, texels, may, has) in [
            (plain.clone(), vec![mirror], false, false),
            (metal.clone(), vec![rough_metal], true, false),
            (metal.clone(), vec![smooth_paint], true, false),
            (metal.clone(), vec![rough_metal, mirror], true, true),
            // Interpolation between these texels may be smooth and metallic.
            (metal.clone(), vec![rough_metal, smooth_paint], true, true),
            (Material { metallic: 0.4, ..metal.clone() }, vec![mirror], false, false),
            (Material { roughness: 0.1, ..metal.clone() }, vec![[0, 100, 255, 255]], true, true),
            (Material { unlit: true, ..metal.clone() }, vec![mirror], false, false),
            (Material { metallic_roughness_texture: None, roughness: 0.0, ..metal.clone() }, vec![], true, true),
            (Material { transmission: 1.0, ..plain.clone() }, vec![], true, true),
        ] {
            let said = format!("{material:?} {texels:?}");
            let scene = scene(material, texels);
            assert_eq!((may_be_sharp(&scene), has_sharp(&scene)), (may, has), "{said}");
        }
        // A material that no surface uses.
        let mut scene = builtin::load("cornell").unwrap();
        scene.materials.push(Material { transmission: 1.0, ..plain });
        assert!(!may_be_sharp(&scene));
    }
}

//! MTL materials as metallic-roughness ones, and their textures.

use super::mtl::{Map, Mtl};
use crate::{
    Error, Result,
    scene::{
        AlphaMode, Limits, Material, Sampler, Texture, TextureRef, Wrap, budget::Budget, folder::Folder, notes::Notes,
        texture,
    },
};
use glam::{Vec3, Vec4};
use std::{
    collections::HashMap,
    path::{Path, PathBuf},
};

/// Reads the textures that materials name, each file once.
pub struct Textures<'a> {
    pub folder: &'a Folder,
    pub limits: &'a Limits,
    pub budget: &'a Budget,
    pub notes: &'a mut Notes,
    pub textures: Vec<Texture>,
    /// By file, and whether it was made to normals, with the height of its bumps.
    pub known: HashMap<(PathBuf, Option<u32>), u32>,
}

/// A file that a scene names by a plain path; one from another machine is looked for beside the scene.
pub fn find(folder: &Folder, name: &str) -> Result<PathBuf> {
    folder.resolve_path(name).or_else(|error| {
        let name = name.replace('\\', "/");
        let base = Path::new(&name).file_name().and_then(|name| name.to_str());
        base.filter(|&base| base != name).and_then(|base| folder.resolve_path(base).ok()).ok_or(error)
    })
}

impl Textures<'_> {
    /// The material that comes closest to `mtl`.
    pub fn material(&mut self, mtl: &Mtl) -> Result<Material> {
        let place = format!("material {:?}", mtl.name);
        let black = |color: Vec3| color.max_element() <= 0.0;
        let specular = Vec3::from(mtl.specular.unwrap_or_default());
        let mut diffuse = mtl.diffuse.map(Vec3::from);
        let base_color_texture = self.texture(mtl.diffuse_map.as_ref(), None, &place)?;
        if base_color_texture.is_some() && diffuse.is_none_or(black) {
            diffuse = Some(Vec3::ONE);
        }
        let mut out = Material::diffuse(mtl.name.clone(), diffuse.unwrap_or(Vec3::splat(0.8)));
        out.base_color_texture = base_color_texture;
        // OBJ does not say which sides are seen: both. Bodies of glass are told from sheets by their meshes.
        out.double_sided = true;
        if let Some(ior) = mtl.refraction.filter(|&ior| ior >= 1.0) {
            out.ior = ior;
        }
        if !black(specular) && mtl.illumination.unwrap_or(2) >= 2 {
            // Blinn's exponent n of a microfacet distribution of width α: n = 2/α² − 2; α is roughness squared.
            out.roughness = (2.0 / (mtl.shininess.unwrap_or(0.0).max(0.0) + 2.0)).powf(0.25);
        }
        match mtl.illumination {
            Some(3 | 5) if !black(specular) => {
                (out.metallic, out.roughness) = (1.0, 0.0);
                out.base_color = specular.min(Vec3::ONE).extend(1.0);
            }
            Some(4 | 6 | 7 | 9) => {
                (out.transmission, out.roughness) = (1.0, 0.0);
                // Programs do not agree whether the filter says what passes or what stays; a dark one means clear glass.
                let filter = mtl.filter.map(Vec3::from).filter(|filter| filter.max_element() > 0.5);
                out.base_color = filter.unwrap_or(Vec3::ONE).min(Vec3::ONE).extend(1.0);
            }
            _ if mtl.diffuse.is_some_and(|color| black(color.into()))
                && !black(specular)
                && out.base_color_texture.is_none() =>
            {
                out.metallic = 1.0;
                out.base_color = specular.min(Vec3::ONE).extend(1.0);
            }
            _ => {}
        }
        if let Some(roughness) = mtl.roughness {
            out.roughness = roughness.clamp(0.0, 1.0);
        }
        if let Some(metallic) = mtl.metallic {
            out.metallic = metallic.clamp(0.0, 1.0);
        }
        self.emission(mtl, &mut out, &place)?;
        self.opacity(mtl, &mut out, &place);
        self.relief(mtl, &mut out, &place)?;
        out.base_color = out.base_color.clamp(Vec4::ZERO, Vec4::ONE);
        for keyword in &mtl.ignored {
            self.notes.ignored(&place, format!("{keyword} is not read"));
        }
        Ok(out)
    }

    fn emission(&mut self, mtl: &Mtl, out: &mut Material, place: &str) -> Result<()> {
        out.emissive = Vec3::from(mtl.emissive.unwrap_or_default());
        out.emissive_texture = self.texture(mtl.emissive_map.as_ref(), None, place)?;
        if out.emissive_texture.is_some() && out.emissive == Vec3::ZERO {
            out.emissive = Vec3::ONE;
        }
        Ok(())
    }

    fn opacity(&mut self, mtl: &Mtl, out: &mut Material, place: &str) {
        // Zero would make it invisible; programs that mean the opposite write it.
        let opacity = mtl.opacity.filter(|&opacity| opacity > 0.0).unwrap_or(1.0);
        if opacity < 1.0 && out.transmission == 0.0 {
            out.base_color.w = opacity;
            out.alpha = AlphaMode::Blend;
        }
        match (&mtl.opacity_map, &mtl.diffuse_map) {
            (Some(map), Some(color)) if map.file == color.file => out.alpha = AlphaMode::Mask { cutoff: 0.5 },
            (Some(map), _) => self.notes.ignored(place, format!("map_d {:?} is not read", map.file)),
            _ => {}
        }
    }

    fn relief(&mut self, mtl: &Mtl, out: &mut Material, place: &str) -> Result<()> {
        out.normal_texture = match (&mtl.normal_map, &mtl.bump_map) {
            (Some(map), _) => {
                out.normal_scale = map.bumps;
                self.texture(Some(map), None, place)?
            }
            (None, Some(map)) => self.texture(Some(map), Some(map.bumps), place)?,
            (None, None) => None,
        };
        Ok(())
    }

    /// `bumps`: the file holds heights, to be made to normals, or normals already.
    fn texture(&mut self, map: Option<&Map>, bumps: Option<f32>, place: &str) -> Result<Option<TextureRef>> {
        let Some(map) = map else { return Ok(None) };
        let path = match find(self.folder, &map.file) {
            Ok(path) => path,
            Err(error) => {
                self.notes.ignored(place, format!("texture {:?}: {error}", map.file));
                return Ok(None);
            }
        };
        let key = (path, bumps.map(f32::to_bits));
        let index = match self.known.get(&key) {
            Some(&index) => index,
            None => {
                let texture = self.read(&key.0, bumps).map_err(|error| error.at(place))?;
                self.textures.push(texture);
                let index = self.textures.len() as u32 - 1;
                self.known.insert(key, index);
                index
            }
        };
        let ([su, sv], [ou, ov]) = (map.scale, map.offset);
        let wrap = if map.clamp { Wrap::ClampToEdge } else { Wrap::Repeat };
        Ok(Some(TextureRef {
            // v' = sv·v + ov with v upwards, written for v downwards.
            transform: [su, 0.0, 0.0, sv, ou, 1.0 - sv - ov],
            sampler: Sampler { wrap_u: wrap, wrap_v: wrap, ..Sampler::default() },
            ..TextureRef::new(index)
        }))
    }

    fn read(&mut self, path: &Path, bumps: Option<f32>) -> Result<Texture> {
        let bytes = self.folder.read(path, self.limits.max_file.min(self.limits.max_alloc))?;
        self.budget.read(bytes.len());
        let limits = Limits { max_image_pixels: self.budget.texels_left(), ..self.limits.clone() };
        let decode = || -> Result<Texture> {
            let mut texture = texture::decode(&bytes, None, &limits)?;
            self.budget.texture(texture.rgba.len() as u64)?;
            texture.name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
            Ok(texture)
        };
        let mut texture = decode().map_err(|error: Error| error.in_file(path))?;
        if let Some(missing) = texture::missing(&bytes) {
            self.notes.approximated(format!("texture {:?}", texture.name), missing);
        }
        if let Some(bumps) = bumps.filter(|_| holds_heights(&texture)) {
            texture = normals_of(&texture, bumps);
        }
        Ok(texture)
    }
}

/// Whether the image is grey; normal maps are mostly blue.
fn holds_heights(texture: &Texture) -> bool {
    let grey = texture.rgba.iter().filter(|[r, g, b, _]| r.abs_diff(*g) < 8 && g.abs_diff(*b) < 8).count();
    2 * grey > texture.rgba.len()
}

/// Normals of a height map by central differences. `bumps` is the height of white, in texels of 1/64 of the width, as
/// MTL leaves the unit open.
fn normals_of(texture: &Texture, bumps: f32) -> Texture {
    let (width, height) = (texture.width as usize, texture.height as usize);
    let at = |x: usize, y: usize| f32::from(texture.rgba[(y % height) * width + x % width][0]) / 255.0;
    let scale = bumps * texture.width as f32 / 64.0;
    let mut rgba = Vec::with_capacity(texture.rgba.len());
    for y in 0..height {
        for x in 0..width {
            let dx = (at(x + 1, y) - at(x + width - 1, y)) * 0.5 * scale;
            // Rows go down, the bitangent up.
            let dy = (at(x, y + height - 1) - at(x, y + 1)) * 0.5 * scale;
            let normal = Vec3::new(-dx, -dy, 1.0).normalize_or(Vec3::Z);
            let [r, g, b] = (normal * 127.5 + 127.5).round().to_array().map(|value| value as u8);
            rgba.push([r, g, b, 255]);
        }
    }
    Texture { rgba, name: texture.name.clone(), ..*texture }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slope_becomes_a_tilted_normal() {
        // Brighter to the right and upwards: the surface leans to the left and down.
        let grey = |v: u8| [v, v, v, 255];
        let rgba = (0..64 * 64).map(|i| grey(((i % 64) * 2 + (63 - i / 64) * 2) as u8 / 2)).collect();
        let heights = Texture { name: String::new(), width: 64, height: 64, rgba };
        assert!(holds_heights(&heights));
        let normals = normals_of(&heights, 64.0);
        let [r, g, b, _] = normals.rgba[32 * 64 + 32];
        assert!(r < 120 && g < 120 && b > 128, "{r} {g} {b}");
        assert_eq!(r, g);
        assert!(!holds_heights(&normals));
    }
}

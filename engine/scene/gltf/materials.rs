//! Materials with their textures and samplers.

use super::{
    buffers::Buffers,
    data_uri,
    document::{Document, extension, item},
    types::{self, EmissiveStrength, Extensions, Ior, OtherSource, TextureInfo, TextureTransform, Transmission},
};
use crate::{
    Error, Result,
    scene::{
        AlphaMode, Limits, MAX_UV_SETS, Material, MipFilter, Sampler, Texture, TextureRef, Wrap,
        budget::Budget,
        folder::{self, Folder},
        notes::Notes,
        texture,
    },
};
use glam::{Vec3, Vec4};
use std::borrow::Cow;

/// Reads the materials of a file, and of its images those that materials use.
pub struct Materials<'a> {
    pub document: &'a Document,
    pub buffers: &'a Buffers<'a>,
    pub folder: &'a Folder,
    pub limits: &'a Limits,
    pub budget: &'a Budget,
    pub notes: &'a mut Notes,
    /// Decoded images, and for each image of the file which of them it is.
    pub textures: Vec<Texture>,
    pub of_image: Vec<Option<u32>>,
}

impl Materials<'_> {
    /// The file's materials, then the one of primitives that name none.
    pub fn read_all(&mut self) -> Result<Vec<Material>> {
        self.check_unused()?;
        let document = self.document;
        let mut out = Vec::with_capacity(document.materials.len() + 1);
        for (i, material) in document.materials.iter().enumerate() {
            let place = format!("materials[{i}]");
            out.push(self.material(material, &place).map_err(|error| error.at(&place))?);
        }
        out.push(Material { name: "default".into(), ..Material::default() });
        Ok(out)
    }

    /// Checks references of textures and images whether materials use them or not.
    fn check_unused(&self) -> Result<()> {
        for (i, texture) in self.document.textures.iter().enumerate() {
            let check = || {
                if let Some(sampler) = texture.sampler {
                    sampler_of(item(&self.document.samplers, "samplers", sampler)?)
                        .map_err(|error| error.at(format!("samplers[{sampler}]")))?;
                }
                self.source(texture).map(|_| ())
            };
            check().map_err(|error: Error| error.at(format!("textures[{i}]")))?;
        }
        for (i, image) in self.document.images.iter().enumerate() {
            let check = match (&image.uri, image.buffer_view) {
                (Some(uri), None) if uri.get(..5).is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:")) => Ok(()),
                (Some(uri), None) => folder::path_of_uri(uri).map(|_| ()).map_err(|error| error.at("uri")),
                (None, Some(view)) => {
                    item(&self.document.views, "bufferViews", view).map(|_| ()).map_err(|error| error.at("bufferView"))
                }
                (Some(_), Some(_)) => Err(Error::input("has both a uri and a bufferView, one of them is allowed")),
                (None, None) => Err(Error::input("has neither a uri nor a bufferView")),
            };
            check.map_err(|error| error.at(format!("images[{i}]")))?;
        }
        Ok(())
    }

    fn material(&mut self, source: &types::Material, place: &str) -> Result<Material> {
        let mut out = Material { name: source.name.clone().unwrap_or_default(), ..Material::default() };
        let pbr = &source.pbr_metallic_roughness;
        let mut unit = |value: f32, what: &str| bounded(value, 0.0..=1.0, what, place, self.notes);
        let [r, g, b, a] = pbr.base_color_factor;
        let base = "pbrMetallicRoughness.baseColorFactor";
        out.base_color = Vec4::new(unit(r, base)?, unit(g, base)?, unit(b, base)?, unit(a, base)?);
        out.metallic = unit(pbr.metallic_factor, "pbrMetallicRoughness.metallicFactor")?;
        out.roughness = unit(pbr.roughness_factor, "pbrMetallicRoughness.roughnessFactor")?;
        out.double_sided = source.double_sided;
        out.alpha = match source.alpha_mode.as_deref() {
            None | Some("OPAQUE") => AlphaMode::Opaque,
            Some("BLEND") => AlphaMode::Blend,
            Some("MASK") => {
                let cutoff = source.alpha_cutoff.unwrap_or(0.5);
                AlphaMode::Mask { cutoff: bounded(cutoff, 0.0..=f32::MAX, "alphaCutoff", place, self.notes)? }
            }
            Some(other) => return Err(Error::input(format!("{other:?} is unknown")).at("alphaMode")),
        };

        let slot = "pbrMetallicRoughness.baseColorTexture";
        out.base_color_texture = self.slot(pbr.base_color_texture.as_ref(), slot, place)?;
        let slot = "pbrMetallicRoughness.metallicRoughnessTexture";
        out.metallic_roughness_texture = self.slot(pbr.metallic_roughness_texture.as_ref(), slot, place)?;
        out.normal_texture = self.slot(source.normal_texture.as_ref(), "normalTexture", place)?;
        out.occlusion_texture = self.slot(source.occlusion_texture.as_ref(), "occlusionTexture", place)?;
        out.emissive_texture = self.slot(source.emissive_texture.as_ref(), "emissiveTexture", place)?;
        if let Some(info) = &source.normal_texture {
            out.normal_scale = finite(info.scale, "normalTexture.scale")?;
        }
        if let Some(info) = &source.occlusion_texture {
            let strength = "occlusionTexture.strength";
            out.occlusion_strength = bounded(info.strength, 0.0..=1.0, strength, place, self.notes)?;
        }
        let mut emissive = source.emissive_factor;
        for value in &mut emissive {
            *value = bounded(*value, 0.0..=f32::MAX, "emissiveFactor", place, self.notes)?;
        }
        out.emissive = Vec3::from(emissive);
        self.extensions(source, place, &mut out)?;
        Ok(out)
    }

    fn extensions(&mut self, source: &types::Material, place: &str, out: &mut Material) -> Result<()> {
        let extensions = &source.extensions;
        if let Some(EmissiveStrength { emissive_strength }) = extension(extensions, "KHR_materials_emissive_strength")?
        {
            let what = "extensions.KHR_materials_emissive_strength.emissiveStrength";
            out.emissive *= bounded(emissive_strength, 0.0..=f32::MAX, what, place, self.notes)?;
            if !out.emissive.is_finite() {
                return Err(Error::input("the emitted radiance is larger than a float").at(what));
            }
        }
        out.unlit = extensions.as_ref().is_some_and(|map| map.contains_key("KHR_materials_unlit"));
        if let Some(Ior { ior }) = extension(extensions, "KHR_materials_ior")? {
            // Zero has a meaning of its own there: a perfect mirror at grazing angles of old specular workflows.
            let what = "extensions.KHR_materials_ior.ior";
            out.ior = if ior == 0.0 { 0.0 } else { bounded(ior, 1.0..=f32::MAX, what, place, self.notes)? };
        }
        if let Some(transmission) = extension::<Transmission>(extensions, "KHR_materials_transmission")? {
            let what = "extensions.KHR_materials_transmission";
            out.transmission = bounded(transmission.transmission_factor, 0.0..=1.0, what, place, self.notes)?;
            out.transmission_texture = self.slot(transmission.transmission_texture.as_ref(), what, place)?;
        }
        if extensions.as_ref().is_some_and(|map| map.contains_key("KHR_materials_pbrSpecularGlossiness")) {
            let text = "KHR_materials_pbrSpecularGlossiness is not supported; the metallic-roughness values are used";
            self.notes.approximated(place, text);
        }
        Ok(())
    }

    fn slot(&mut self, info: Option<&TextureInfo>, slot: &str, place: &str) -> Result<Option<TextureRef>> {
        let Some(info) = info else { return Ok(None) };
        let texture = self.texture(info, &format!("{place}.{slot}")).map_err(|error| error.at(slot))?;
        Ok(texture)
    }

    fn texture(&mut self, info: &TextureInfo, place: &str) -> Result<Option<TextureRef>> {
        let document = self.document;
        let source = item(&document.textures, "textures", info.index).map_err(|error| error.at("index"))?;
        let (transform, uv_set) = transform(&info.extensions, info.tex_coord)?;
        let Some(image) = self.source(source).map_err(|error| error.at(format!("textures[{}]", info.index)))? else {
            self.notes.ignored(place, format!("textures[{}] has no image in a supported format", info.index));
            return Ok(None);
        };
        if uv_set as usize >= MAX_UV_SETS {
            self.notes.ignored(place, format!("uses TEXCOORD_{uv_set}; {MAX_UV_SETS} sets are read"));
            return Ok(None);
        }
        let sampler = match source.sampler {
            None => Sampler::default(),
            Some(sampler) => sampler_of(item(&document.samplers, "samplers", sampler)?)?,
        };
        let texture = match self.of_image[image as usize] {
            Some(texture) => texture,
            None => {
                let here = format!("images[{image}]");
                let (decoded, missing) = self.decode(&document.images[image as usize], &here)?;
                if let Some(missing) = missing {
                    self.notes.approximated(&here, missing);
                }
                self.budget.texture(decoded.rgba.len() as u64).map_err(|error| error.at(&here))?;
                self.textures.push(decoded);
                *self.of_image[image as usize].insert(self.textures.len() as u32 - 1)
            }
        };
        Ok(Some(TextureRef { texture, uv_set, transform, sampler }))
    }

    /// Index of the image that a texture shows, by the best extension that is there.
    fn source(&self, texture: &types::Texture) -> Result<Option<u32>> {
        let mut source = texture.source;
        for name in ["EXT_texture_webp", "KHR_texture_basisu"] {
            let other = extension::<OtherSource>(&texture.extensions, name)?.and_then(|other| other.source);
            source = other.or(source);
        }
        if let Some(image) = source {
            item(&self.document.images, "images", image).map_err(|error| error.at("source"))?;
        }
        Ok(source)
    }

    /// The picture, and what is missing from it.
    fn decode(&self, image: &types::Image, here: &str) -> Result<(Texture, Option<&'static str>)> {
        let mut mime = image.mime_type.clone();
        let mut name = image.name.clone();
        let bytes: Cow<[u8]> = match (&image.uri, image.buffer_view) {
            (Some(uri), _) => {
                let at = |error: Error| error.at("uri").at(here);
                match data_uri::decode(uri).transpose().map_err(at)? {
                    Some(data) => {
                        mime = mime.or(Some(data.mime));
                        data.bytes.into()
                    }
                    None => {
                        let path = self.folder.resolve_uri(uri).map_err(at)?;
                        let limit = self.limits.max_file.min(self.limits.max_alloc);
                        let bytes = self.folder.read(&path, limit).map_err(at)?;
                        self.budget.read(bytes.len());
                        name = name.or_else(|| Some(path.file_name()?.to_string_lossy().into_owned()));
                        bytes.into()
                    }
                }
            }
            (None, Some(view)) => self.buffers.view(view).map_err(|error| error.at(here))?.into(),
            (None, None) => return Err(Error::input("has neither a uri nor a bufferView").at(here)),
        };
        let limits = Limits { max_image_pixels: self.budget.texels_left(), ..self.limits.clone() };
        let mut decoded = texture::decode(&bytes, mime.as_deref(), &limits).map_err(|error| error.at(here))?;
        decoded.name = name.unwrap_or_else(|| here.to_owned());
        Ok((decoded, texture::missing(&bytes)))
    }
}

/// KHR_texture_transform as a matrix, and the uv set (glTF's own if the extension names none).
fn transform(extensions: &Extensions, tex_coord: u32) -> Result<([f32; 6], u32)> {
    let Some(transform) = extension::<TextureTransform>(extensions, "KHR_texture_transform")? else {
        return Ok((TextureRef::IDENTITY, tex_coord));
    };
    let ([x, y], [width, height]) = (transform.offset, transform.scale);
    let (sin, cos) = transform.rotation.sin_cos();
    // Translation · rotation · scale. With v downwards, counter-clockwise rotation has its sines the other way round.
    let matrix = [cos * width, sin * height, -sin * width, cos * height, x, y];
    if matrix.iter().any(|value| !value.is_finite()) {
        return Err(Error::input("the texture transform is not finite").at("extensions.KHR_texture_transform"));
    }
    Ok((matrix, transform.tex_coord.unwrap_or(tex_coord)))
}

fn sampler_of(sampler: &types::Sampler) -> Result<Sampler> {
    let wrap = |code: Option<u32>, what: &str| match code {
        None | Some(10497) => Ok(Wrap::Repeat),
        Some(33648) => Ok(Wrap::MirroredRepeat),
        Some(33071) => Ok(Wrap::ClampToEdge),
        Some(code) => Err(Error::input(format!("{code} is unknown")).at(what)),
    };
    let (min_linear, mip) = match sampler.min_filter {
        Some(9728) => (false, MipFilter::None),
        Some(9729) => (true, MipFilter::None),
        Some(9984) => (false, MipFilter::Nearest),
        Some(9985) => (true, MipFilter::Nearest),
        Some(9986) => (false, MipFilter::Linear),
        None | Some(9987) => (true, MipFilter::Linear),
        Some(code) => return Err(Error::input(format!("{code} is unknown")).at("minFilter")),
    };
    let mag_linear = match sampler.mag_filter {
        Some(9728) => false,
        None | Some(9729) => true,
        Some(code) => return Err(Error::input(format!("{code} is unknown")).at("magFilter")),
    };
    let (wrap_u, wrap_v) = (wrap(sampler.wrap_s, "wrapS")?, wrap(sampler.wrap_t, "wrapT")?);
    Ok(Sampler { wrap_u, wrap_v, mag_linear, min_linear, mip })
}

fn finite(value: f32, what: &str) -> Result<f32> {
    match value.is_finite() {
        true => Ok(value),
        false => Err(Error::input(format!("{value} is not finite")).at(what)),
    }
}

/// `value`, moved into `range` with a note if it lies outside.
fn bounded(
    value: f32,
    range: std::ops::RangeInclusive<f32>,
    what: &str,
    place: &str,
    notes: &mut Notes,
) -> Result<f32> {
    let bounded = finite(value, what)?.clamp(*range.start(), *range.end());
    if bounded != value {
        notes.repaired(place, format!("{what} {value} is out of range, {bounded} is used"));
    }
    Ok(bounded)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn apply(matrix: [f32; 6], [u, v]: [f32; 2]) -> [f32; 2] {
        let [a, b, c, d, x, y] = matrix;
        [a * u + b * v + x, c * u + d * v + y]
    }

    /// The example of the extension's text: the lower half of the image, turned 90° counter-clockwise.
    #[test]
    fn texture_transform_turns_scales_and_moves() {
        let extensions = json!({"KHR_texture_transform": {
            "offset": [0.0, 1.0], "rotation": std::f32::consts::FRAC_PI_2, "scale": [0.5, 0.5], "texCoord": 1
        }});
        let serde_json::Value::Object(map) = extensions else { unreachable!() };
        let (matrix, set) = transform(&Some(map), 0).unwrap();
        assert_eq!(set, 1);
        for (uv, want) in [([0.0, 0.0], [0.0, 1.0]), ([1.0, 0.0], [0.0, 0.5]), ([0.0, 1.0], [0.5, 1.0])] {
            let got = apply(matrix, uv);
            assert!(
                (got[0] - want[0]).abs() < 1e-6 && (got[1] - want[1]).abs() < 1e-6,
                "{uv:?}: {got:?}, not {want:?}"
            );
        }
    }

    #[test]
    fn samplers_follow_the_table() {
        let sampler = |min, mag, wrap| types::Sampler { min_filter: min, mag_filter: mag, wrap_s: wrap, wrap_t: None };
        let read = sampler_of(&sampler(Some(9985), Some(9728), Some(33071))).unwrap();
        assert_eq!((read.min_linear, read.mip, read.mag_linear), (true, MipFilter::Nearest, false));
        assert_eq!((read.wrap_u, read.wrap_v), (Wrap::ClampToEdge, Wrap::Repeat));
        assert!(sampler_of(&sampler(Some(1), None, None)).is_err());
        assert_eq!(sampler_of(&types::Sampler::default()).unwrap(), Sampler::default());
    }
}

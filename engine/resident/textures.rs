//! Material textures as array images: one array for each size and encoding, at most [`MAX_TEXTURE_ARRAYS`] of them, so that
//! any shader may read any texture by number. Mip levels are made here, averaged as light (sRGB decoded).

use crate::{
    Error, ErrorKind, Result,
    gpu::{Gpu, ImageDesc, OwnedImage, Region},
    scene::{Material, Scene, Texture},
    shaders::consts::MAX_TEXTURE_ARRAYS,
};
use ash::vk;
use half::f16;
use std::{
    collections::BTreeMap,
    sync::{Mutex, OnceLock},
};

type Texel = [u8; 4];

/// How the texels of a use are encoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) enum Encoding {
    Srgb,
    Linear,
}

/// One array image: all its layers have this size.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Array {
    pub width: u32,
    pub height: u32,
    pub encoding: Encoding,
    /// Indices into [`Scene::textures`]; one layer each.
    pub layers: Vec<u32>,
}

impl Array {
    fn texels(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height) * self.layers.len() as u64
    }

    fn merged(&self, other: &Self) -> Self {
        let layers = [&self.layers[..], &other.layers[..]].concat();
        Self { width: self.width.max(other.width), height: self.height.max(other.height), layers, ..*self }
    }
}

/// The places of all textures.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Packing {
    pub arrays: Vec<Array>,
    /// Array and layer of a texture under an encoding.
    pub places: BTreeMap<(u32, Encoding), (u32, u32)>,
    /// Textures that are stored at another size than their own.
    pub resampled: usize,
}

/// Every (texture, encoding) that the materials use.
fn uses(scene: &Scene) -> BTreeMap<(u32, Encoding), ()> {
    let of = |m: &Material| {
        [
            (m.base_color_texture, Encoding::Srgb),
            (m.emissive_texture, Encoding::Srgb),
            (m.metallic_roughness_texture, Encoding::Linear),
            (m.normal_texture, Encoding::Linear),
            (m.occlusion_texture, Encoding::Linear),
            (m.transmission_texture, Encoding::Linear),
        ]
    };
    let known = |t: u32| scene.textures.get(t as usize).is_some_and(|t| t.width > 0 && t.height > 0);
    let used = scene.materials.iter().flat_map(of);
    used.filter_map(|(r, encoding)| Some((r?.texture, encoding))).filter(|u| known(u.0)).map(|u| (u, ())).collect()
}

/// Sorts textures into arrays. `max_side`, `max_layers`: what the device allows.
///
/// # Errors
/// `Runtime` if they do not fit into the arrays that there are.
pub(super) fn pack(scene: &Scene, max_side: u32, max_layers: u32) -> Result<Packing> {
    let mut arrays: Vec<Array> = Vec::new();
    let add = |arrays: &mut Vec<Array>, array: Array| match arrays
        .iter_mut()
        .find(|a| (a.width, a.height, a.encoding) == (array.width, array.height, array.encoding))
    {
        Some(same) => same.layers.extend(array.layers),
        None => arrays.push(array),
    };
    for (texture, encoding) in uses(scene).into_keys() {
        let Texture { width, height, .. } = scene.textures[texture as usize];
        let (width, height) = (width.min(max_side), height.min(max_side));
        add(&mut arrays, Array { width, height, encoding, layers: vec![texture] });
    }
    let most = MAX_TEXTURE_ARRAYS as usize;
    if arrays.len() > most {
        // Powers of two first, then the pair whose union wastes the fewest texels.
        let mut rounded = Vec::new();
        for array in arrays.drain(..) {
            let up = |side: u32| side.next_power_of_two().min(max_side);
            add(&mut rounded, Array { width: up(array.width), height: up(array.height), ..array });
        }
        arrays = rounded;
        while arrays.len() > most {
            let pairs = (0..arrays.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
            let cost = |a: &Array, b: &Array| a.merged(b).texels() - a.texels() - b.texels();
            let same = pairs.filter(|(a, b)| arrays[*a].encoding == arrays[*b].encoding);
            let Some((a, b)) = same.min_by_key(|(a, b)| cost(&arrays[*a], &arrays[*b])) else { break };
            // b < a, so b stays where it is.
            let removed = arrays.swap_remove(a);
            arrays[b] = arrays[b].merged(&removed);
        }
    }
    // An array with more layers than the device has is split.
    let limit = max_layers.max(1) as usize;
    let split = |a: Array| {
        let chunks: Vec<Vec<u32>> = a.layers.chunks(limit).map(<[u32]>::to_vec).collect();
        chunks.into_iter().map(move |layers| Array { layers, ..a.clone() })
    };
    let arrays: Vec<Array> = arrays.into_iter().flat_map(split).collect();
    if arrays.len() > most {
        let count: usize = arrays.iter().map(|a| a.layers.len()).sum();
        return Err(Error::new(
            ErrorKind::Runtime,
            format!("{count} material textures do not fit into {most} array images of {limit} layers"),
        )
        .at("textures"));
    }
    let mut places = BTreeMap::new();
    let mut resampled = 0;
    for (index, array) in arrays.iter().enumerate() {
        for (layer, &texture) in array.layers.iter().enumerate() {
            places.insert((texture, array.encoding), (index as u32, layer as u32));
            let Texture { width, height, .. } = scene.textures[texture as usize];
            resampled += usize::from((width, height) != (array.width, array.height));
        }
    }
    Ok(Packing { arrays, places, resampled })
}

/// Who decodes sRGB.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Decoding {
    /// The device, as it filters: four bytes a texel, and all mip levels. llvmpipe's curve is off by −1.2 to +0.5 %.
    Device,
    /// This process, to half floats (within 5e-4, as Mitsuba 3 keeps textures of 8 bits): eight bytes a texel, the finest level alone,
    /// which is one and a half times as much memory. For rays, which read nothing else.
    Exact,
}

/// Uploads every array with its mip levels.
///
/// # Errors
/// `OutOfMemory`, `DeviceLost`.
pub(super) fn upload(gpu: &Gpu, scene: &Scene, packing: &Packing, decoding: Decoding) -> Result<Vec<OwnedImage>> {
    let mut images = Vec::new();
    for (index, array) in packing.arrays.iter().enumerate() {
        if (decoding, array.encoding) == (Decoding::Exact, Encoding::Srgb) {
            images.push(upload_decoded(gpu, scene, array, index)?);
            continue;
        }
        let format = match array.encoding {
            Encoding::Srgb => vk::Format::R8G8B8A8_SRGB,
            Encoding::Linear => vk::Format::R8G8B8A8_UNORM,
        };
        let desc = ImageDesc::new(format, array.width, array.height).layers(array.layers.len() as u32);
        let desc = desc.mips(desc.full_mips());
        let image = OwnedImage::new(gpu, &format!("scene.textures{index}"), desc)?;
        // A few layers at a time: their mips take host memory.
        for (batch, textures) in array.layers.chunks(4).enumerate() {
            let chains = chains(scene, array, textures);
            let regions: Vec<Region> = chains
                .iter()
                .enumerate()
                .flat_map(|(i, chain)| chain.iter().enumerate().map(move |(mip, level)| (i, mip, level)))
                .map(|(i, mip, level)| Region {
                    mip: mip as u32,
                    layer: (4 * batch + i) as u32,
                    bytes: bytemuck::cast_slice(level),
                })
                .collect();
            image.upload(&regions)?;
        }
        images.push(image);
    }
    Ok(images)
}

/// The finest level of an array of sRGB textures as linear half floats.
fn upload_decoded(gpu: &Gpu, scene: &Scene, array: &Array, index: usize) -> Result<OwnedImage> {
    let desc =
        ImageDesc::new(vk::Format::R16G16B16A16_SFLOAT, array.width, array.height).layers(array.layers.len() as u32);
    let image = OwnedImage::new(gpu, &format!("scene.textures{index}"), desc)?;
    let table: [f16; 256] = std::array::from_fn(|code| f16::from_f64(decoded(code as f64 / 255.0)));
    let alpha: [f16; 256] = std::array::from_fn(|code| f16::from_f64(code as f64 / 255.0));
    for (layer, &texture) in array.layers.iter().enumerate() {
        let texels = resampled(&scene.textures[texture as usize], array);
        let decode = |[r, g, b, a]: &Texel| {
            [table[usize::from(*r)], table[usize::from(*g)], table[usize::from(*b)], alpha[usize::from(*a)]]
                .map(f16::to_bits)
        };
        let level: Vec<[u16; 4]> = texels.iter().map(decode).collect();
        image.upload(&[Region { mip: 0, layer: layer as u32, bytes: bytemuck::cast_slice(&level) }])?;
    }
    Ok(image)
}

/// Linear light of an sRGB value, both 0 to 1 (IEC 61966-2-1).
fn decoded(v: f64) -> f64 {
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// The mip chains of some textures at the size of their array, made on all cores.
fn chains(scene: &Scene, array: &Array, textures: &[u32]) -> Vec<Vec<Vec<Texel>>> {
    let done = Mutex::new(vec![Vec::new(); textures.len()]);
    std::thread::scope(|scope| {
        for (slot, &texture) in textures.iter().enumerate() {
            let done = &done;
            scope.spawn(move || {
                let texture = &scene.textures[texture as usize];
                let chain = mips(resampled(texture, array), array.width, array.height, array.encoding);
                done.lock().unwrap_or_else(std::sync::PoisonError::into_inner)[slot] = chain;
            });
        }
    });
    done.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner)
}

/// All levels of an image, the given one first; each is the 2×2 mean of the one before, taken in linear light.
fn mips(base: Vec<Texel>, width: u32, height: u32, encoding: Encoding) -> Vec<Vec<Texel>> {
    let tables = Tables::get();
    let mut levels = vec![base];
    let (mut w, mut h) = (width as usize, height as usize);
    while w > 1 || h > 1 {
        let (nw, nh) = ((w / 2).max(1), (h / 2).max(1));
        let last = &levels[levels.len() - 1];
        let mut next = Vec::with_capacity(nw * nh);
        for y in 0..nh {
            let top = &last[(2 * y).min(h - 1) * w..][..w];
            let bottom = &last[(2 * y + 1).min(h - 1) * w..][..w];
            for x in 0..nw {
                let (left, right) = ((2 * x).min(w - 1), (2 * x + 1).min(w - 1));
                let four = [top[left], top[right], bottom[left], bottom[right]];
                next.push(match encoding {
                    Encoding::Srgb => mean_of_light(four, tables),
                    Encoding::Linear => mean(four),
                });
            }
        }
        (w, h) = (nw, nh);
        levels.push(next);
    }
    levels
}

// Written out for speed in unoptimised builds: all textures of a scene pass through here at start.
fn mean([a, b, c, d]: [Texel; 4]) -> Texel {
    let mut out = [0; 4];
    for i in 0..4 {
        out[i] = ((u32::from(a[i]) + u32::from(b[i]) + u32::from(c[i]) + u32::from(d[i]) + 2) / 4) as u8;
    }
    out
}

/// As [`mean`], of sRGB texels in linear light; alpha is linear as it is.
fn mean_of_light(four: [Texel; 4], tables: &Tables) -> Texel {
    let [a, b, c, d] = four;
    let linear = |v: u8| u32::from(tables.linear[usize::from(v)]);
    let mut out = mean(four);
    for i in 0..3 {
        let sum = linear(a[i]) + linear(b[i]) + linear(c[i]) + linear(d[i]);
        out[i] = tables.encoded[((sum + 2) / 4) as usize];
    }
    out
}

/// sRGB to 16-bit linear and back.
struct Tables {
    linear: [u16; 256],
    encoded: Vec<u8>,
}

impl Tables {
    fn get() -> &'static Self {
        static TABLES: OnceLock<Tables> = OnceLock::new();
        TABLES.get_or_init(|| {
            let encode = |v: f64| if v <= 0.0031308 { v * 12.92 } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
            let scale = f64::from(u16::MAX);
            Self {
                linear: std::array::from_fn(|i| (decoded(i as f64 / 255.0) * scale).round() as u16),
                encoded: (0..=u16::MAX).map(|i| (encode(f64::from(i) / scale) * 255.0).round() as u8).collect(),
            }
        })
    }
}

/// The texture at the size of its array: bilinear in the stored encoding, repeating at the edges.
fn resampled(texture: &Texture, array: &Array) -> Vec<Texel> {
    let (w, h) = (texture.width as usize, texture.height as usize);
    if (texture.width, texture.height) == (array.width, array.height) {
        return texture.rgba.clone();
    }
    let taps = |size: usize, of: u32| -> Vec<(usize, usize, f32)> {
        let scale = size as f32 / of as f32;
        let place = |i: u32| (i as f32 + 0.5) * scale - 0.5;
        (0..of)
            .map(|i| {
                let at = place(i);
                let low = at.floor();
                let wrap = |x: f32| (x as i64).rem_euclid(size as i64) as usize;
                (wrap(low), wrap(low + 1.0), at - low)
            })
            .collect()
    };
    let columns = taps(w, array.width);
    let mut out = Vec::with_capacity((array.width * array.height) as usize);
    for (y0, y1, fy) in taps(h, array.height) {
        for &(x0, x1, fx) in &columns {
            let at = |x: usize, y: usize, c: usize| f32::from(texture.rgba[y * w + x][c]);
            out.push(std::array::from_fn(|c| {
                let top = at(x0, y0, c) * (1.0 - fx) + at(x1, y0, c) * fx;
                let bottom = at(x0, y1, c) * (1.0 - fx) + at(x1, y1, c) * fx;
                (top * (1.0 - fy) + bottom * fy).round() as u8
            }));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::TextureRef;

    fn texture(width: u32, height: u32, texel: Texel) -> Texture {
        Texture { name: String::new(), width, height, rgba: vec![texel; (width * height) as usize] }
    }

    fn scene(sizes: &[(u32, u32)]) -> Scene {
        let textures = sizes.iter().map(|(w, h)| texture(*w, *h, [10, 20, 30, 40])).collect();
        let material = |i| Material { base_color_texture: Some(TextureRef::new(i)), ..Material::default() };
        Scene { textures, materials: (0..sizes.len() as u32).map(material).collect(), ..Scene::default() }
    }

    #[test]
    fn textures_of_one_size_share_an_array_and_both_encodings_get_a_place() {
        let mut scene = scene(&[(8, 8), (8, 8), (4, 2)]);
        scene.materials[1].normal_texture = Some(TextureRef::new(0));
        let packing = pack(&scene, 4096, 256).unwrap();
        assert_eq!(packing.arrays.len(), 3);
        assert_eq!(packing.resampled, 0);
        let (array, layer) = packing.places[&(1, Encoding::Srgb)];
        assert_eq!(packing.arrays[array as usize].layers[layer as usize], 1);
        assert_ne!(packing.places[&(0, Encoding::Srgb)].0, packing.places[&(0, Encoding::Linear)].0);
    }

    #[test]
    fn many_sizes_are_merged_into_the_arrays_that_there_are() {
        let sizes: Vec<(u32, u32)> = (1..40).map(|i| (7 * i, 300 - 5 * i)).collect();
        let packing = pack(&scene(&sizes), 4096, 256).unwrap();
        assert!(packing.arrays.len() <= MAX_TEXTURE_ARRAYS as usize);
        assert_eq!(packing.places.len(), sizes.len());
        for ((texture, _), (array, _)) in &packing.places {
            let (array, (w, h)) = (&packing.arrays[*array as usize], sizes[*texture as usize]);
            assert!(array.width >= w && array.height >= h, "nothing loses detail");
        }
    }

    #[test]
    fn device_limits_bound_sides_and_layers() {
        let packing = pack(&scene(&[(64, 16); 5]), 32, 2).unwrap();
        assert!(packing.arrays.iter().all(|a| a.width == 32 && a.layers.len() <= 2));
        assert_eq!(packing.arrays.len(), 3);
        assert!(pack(&scene(&[(4, 4); 40]), 4096, 2).unwrap_err().to_string().contains("40 material textures"));
    }

    #[test]
    fn mips_average_light_not_code_values() {
        let base = vec![[0, 0, 0, 0], [255, 255, 255, 255], [255, 255, 255, 255], [0, 0, 0, 0]];
        // Half the light is sRGB 188 and linear 128; alpha is always linear.
        assert_eq!(mips(base.clone(), 2, 2, Encoding::Srgb)[1], [[188, 188, 188, 128]]);
        assert_eq!(mips(base, 2, 2, Encoding::Linear)[1], [[128; 4]]);
    }

    #[test]
    fn a_constant_stays_constant_through_mips_and_resampling() {
        for value in [0, 1, 37, 128, 200, 255] {
            let chain = mips(vec![[value; 4]; 15], 5, 3, Encoding::Srgb);
            assert_eq!(chain.iter().map(Vec::len).collect::<Vec<_>>(), [15, 2, 1]);
            assert!(chain.iter().flatten().all(|t| *t == [value; 4]), "{value}");
            let array = Array { width: 16, height: 8, encoding: Encoding::Srgb, layers: vec![0] };
            assert!(resampled(&texture(5, 3, [value; 4]), &array).iter().all(|t| *t == [value; 4]));
        }
    }
}

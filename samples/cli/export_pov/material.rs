//! Export of materials as POV-Ray textures and images, and of emissive surfaces as point samples.

use std::fmt::Write;

use glam::{Vec2, Vec3, Vec4};
use lucerna::{
    Result,
    image::{self, Format, Layer, Layers, WriteOptions, srgb},
    scene::{AlphaMode, Material, Pose, Primitive, Scene, TextureRef, Wrap, bvh::Bvh, deform},
};

use super::{
    Export, Pov,
    text::{number, vector},
};

/// A material as POV-Ray statements.
#[derive(Clone, Debug, Default)]
pub struct Look {
    /// `texture { … }` without vertex colours.
    pub texture: String,
    /// `interior { … }` of glass.
    pub interior: String,
    /// Keywords for the object, for example `no_shadow`.
    pub flags: String,
    /// The texture reference that defines the image's coordinates.
    pub uv: Option<TextureRef>,
    /// The colour of an untextured matt material, which vertex colours can multiply.
    pub plain: Option<Vec4>,
    /// Contents of `finish { … }` of a matt material.
    pub finish: String,
    pub double_sided: bool,
}

/// Converts all materials; adds their images to `export`.
pub fn looks(scene: &Scene, stem: &str, settings: &Pov, export: &mut Export) -> Result<Vec<Look>> {
    let used: Vec<u32> = scene.meshes.iter().flat_map(|mesh| &mesh.primitives).map(|p| p.material).collect();
    let mut looks = Vec::new();
    for (index, material) in scene.materials.iter().enumerate() {
        looks.push(match used.contains(&(index as u32)) {
            true => look(scene, index, material, stem, settings, export)?,
            false => Look::default(),
        });
    }
    Ok(looks)
}

fn look(
    scene: &Scene,
    index: usize,
    material: &Material,
    stem: &str,
    settings: &Pov,
    export: &mut Export,
) -> Result<Look> {
    let name = if material.name.is_empty() { format!("material {index}") } else { format!("{:?}", material.name) };
    let mut note = |text: &str| export.notes.push(format!("{name}: {text}"));
    let mirror = material.is_mirror();
    if !mirror && !material.unlit && material.metallic > 0.5 {
        note("a rough metal: its reflections are left out, its diffuse albedo is kept");
    }
    if material.normal_texture.is_some() {
        note("the normal map is left out");
    }
    let mut out = Look { double_sided: material.double_sided, ..Look::default() };
    let glass = material.transmission > 0.0 && !material.unlit;
    if glass {
        note("glass: Fresnel reflection and refraction are POV-Ray's; shadows behind it are tinted, without caustics");
    }
    let metallic = material.metallic.clamp(0.0, 1.0);
    let base = material.base_color.truncate();
    let mut finish = "ambient 0".to_owned();
    let emits = if material.unlit { Vec3::ZERO } else { material.emissive };
    if material.unlit {
        finish += " diffuse 0 emission 1";
        out.flags += " no_shadow no_radiosity";
    } else if mirror {
        let _ = write!(finish, " diffuse 0 reflection {{ rgb {} }}", vector(base));
    } else if glass {
        let t = material.transmission.min(1.0);
        let _ = write!(finish, " diffuse {} reflection {{ 0 {} fresnel on }} conserve_energy", number(1.0 - t), t);
        let ior = if material.double_sided { 1.0 } else { material.ior };
        let _ = write!(out.interior, "interior {{ ior {} }}", number(ior.max(1.0)));
    } else {
        finish += " diffuse 1";
        if settings.ambient > 0.0 && emits == Vec3::ZERO {
            let _ = write!(finish, " emission {}", number(settings.ambient));
        }
        out.finish.clone_from(&finish);
    }
    if emits != Vec3::ZERO && settings.emissive_lights > 0 {
        // The surface is already exported as lights, and radiosity would count its light again.
        out.flags += " no_radiosity";
    }
    let albedo = match () {
        _ if material.unlit || glass => base,
        _ if mirror => Vec3::ZERO,
        _ => base * (1.0 - metallic),
    };
    let alpha = if material.alpha == AlphaMode::Opaque { 1.0 } else { material.base_color.w.clamp(0.0, 1.0) };
    let textured = material.base_color_texture.or(material.metallic_roughness_texture.filter(|_| metallic > 0.0));
    out.uv = textured.or(material.emissive_texture);
    let through = if glass { material.transmission.min(1.0) } else { 0.0 };
    if out.uv.is_none() {
        // Emission is multiplied with the pigment, so where light comes from a black surface that must be a little bright.
        let least = emits.cmpgt(Vec3::ZERO);
        let pigment = Vec3::select(least, albedo.max(Vec3::splat(1e-6)), albedo);
        let glow = Vec3::select(least, emits / pigment.max(Vec3::splat(1e-6)), Vec3::ZERO);
        if emits != Vec3::ZERO {
            let _ = write!(finish, " emission rgb {}", vector(glow));
        } else if !out.finish.is_empty() && through == 0.0 {
            out.plain = Some(albedo.extend(alpha));
        }
        out.texture = plain(pigment, through, 1.0 - alpha, &finish);
        return Ok(out);
    }
    for texture in [material.base_color_texture, material.metallic_roughness_texture, material.emissive_texture] {
        let same = |a: TextureRef, b: TextureRef| a.uv_set == b.uv_set && a.transform == b.transform;
        if texture.zip(out.uv).is_some_and(|(a, b)| !same(a, b)) {
            note("its textures have different coordinates: those of the first are used for all");
        }
    }
    let wraps = out.uv.map(|t| [t.sampler.wrap_u, t.sampler.wrap_v]).unwrap_or_default_wraps();
    if wraps != [Wrap::Repeat; 2] {
        note("its texture repeats in POV-Ray, where it is clamped or mirrored here");
    }
    let surface = bake(scene, material, textured, |uv| {
        let mut color = base.extend(material.base_color.w);
        if let Some(t) = &material.base_color_texture {
            color *= sample(scene, t, uv, true);
        }
        if let (Some(t), false) = (&material.metallic_roughness_texture, material.unlit || mirror || glass) {
            color *= Vec3::splat(1.0 - metallic * sample(scene, t, uv, false).z).extend(1.0);
        } else if !(material.unlit || mirror || glass) {
            color *= Vec3::splat(1.0 - metallic).extend(1.0);
        }
        match material.alpha {
            AlphaMode::Opaque => color.w = 1.0,
            AlphaMode::Mask { cutoff } => color.w = f32::from(color.w >= cutoff),
            AlphaMode::Blend => {}
        }
        color
    });
    let mut layers = Vec::new();
    let glows = emits != Vec3::ZERO;
    match surface {
        _ if mirror => layers.push(plain(Vec3::ZERO, 0.0, 0.0, &finish)),
        Some(picture) => {
            let file = format!("{stem}-{index}.png");
            export.images.push((file.clone(), png(&picture)?));
            let filter = if through > 0.0 { format!(" filter all {}", number(through)) } else { String::new() };
            layers.push(mapped(&file, &filter, &finish));
        }
        None => layers.push(plain(albedo, through, 1.0 - alpha, &finish)),
    }
    if glows {
        match &material.emissive_texture {
            None => layers.push(plain(Vec3::ONE, 0.0, 0.0, &glow(emits))),
            Some(texture) => {
                let file = format!("{stem}-{index}-emission.png");
                let picture = bake(scene, material, Some(*texture), |uv| sample(scene, texture, uv, true).with_w(1.0));
                export.images.push((file.clone(), png(&picture.unwrap_or_default())?));
                layers.push(mapped(&file, "", &glow(emits)));
            }
        }
    }
    out.texture = match &layers[..] {
        [only] => only.clone(),
        // An average of two textures, each with doubled values.
        both => {
            let twice: Vec<String> = both.iter().map(|t| t.replace("diffuse 1", "diffuse 2")).collect();
            format!("texture {{ average texture_map {{ [1 {}] [1 {}] }} }}", inner(&twice[0]), inner(&twice[1]))
        }
    };
    Ok(out)
}

trait OrRepeat {
    fn unwrap_or_default_wraps(self) -> [Wrap; 2];
}

impl OrRepeat for Option<[Wrap; 2]> {
    fn unwrap_or_default_wraps(self) -> [Wrap; 2] {
        self.unwrap_or([Wrap::Repeat; 2])
    }
}

/// Finish of the emissive texture in an average of two textures, with doubled emission.
fn glow(emits: Vec3) -> String {
    format!("ambient 0 diffuse 0 emission rgb {}", vector(emits * 2.0))
}

/// `texture { … }` → `…`.
fn inner(texture: &str) -> &str {
    texture.trim_start_matches("texture { ").trim_end_matches(" }").trim()
}

/// A texture of one colour.
pub fn plain(color: Vec3, filter: f32, transmit: f32, finish: &str) -> String {
    let [r, g, b] = color.to_array().map(number);
    let (filter, transmit) = (number(filter), number(transmit));
    format!("texture {{ pigment {{ color rgbft <{r},{g},{b},{filter},{transmit}> }} finish {{ {finish} }} }}")
}

fn mapped(file: &str, filter: &str, finish: &str) -> String {
    format!(
        "texture {{ uv_mapping pigment {{ image_map {{ png \"{file}\" gamma srgb map_type 0 interpolate 2{filter} }} }} \
         finish {{ {finish} }} }}"
    )
}

/// A picture that a texture reference spans, RGBA.
#[derive(Default)]
struct Baked {
    size: [u32; 2],
    texels: Vec<[f32; 4]>,
}

/// Evaluates `color` at every texel of `by`, in the texture's own coordinates.
fn bake(scene: &Scene, _: &Material, by: Option<TextureRef>, color: impl Fn(Vec2) -> Vec4) -> Option<Baked> {
    let texture = &scene.textures.get(by?.texture as usize)?;
    let size = [texture.width, texture.height];
    let at = |x: u32, y: u32| Vec2::new((x as f32 + 0.5) / size[0] as f32, (y as f32 + 0.5) / size[1] as f32);
    let texels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y)));
    Some(Baked { size, texels: texels.map(|(x, y)| color(at(x, y)).to_array()).collect() })
}

/// 16 bits, sRGB.
fn png(picture: &Baked) -> Result<Vec<u8>> {
    let [width, height] = picture.size.map(|s| s.max(1));
    let mut texels = picture.texels.clone();
    texels.resize(width as usize * height as usize, [0.0, 0.0, 0.0, 1.0]);
    let opaque = texels.iter().all(|t| t[3] >= 1.0);
    let layer = match opaque {
        true => Layer::rgb("", &texels),
        false => {
            // Layers are premultiplied; a texel without cover keeps no colour.
            let premultiplied: Vec<_> = texels.iter().map(|&[r, g, b, a]| [r * a, g * a, b * a, a]).collect();
            Layer::rgba("", &premultiplied)
        }
    };
    let picture = Layers::new(width, height).with(layer);
    Ok(image::encode(Format::Png, &picture, &WriteOptions { png_bits: 16, ..Default::default() })?.0)
}

/// Nearest texel of a texture at its own coordinates.
fn sample(scene: &Scene, reference: &TextureRef, uv: Vec2, color: bool) -> Vec4 {
    let Some(texture) = scene.textures.get(reference.texture as usize) else { return Vec4::ONE };
    let place = |u: f32, size: u32| ((u - u.floor()) * size as f32) as u32 % size.max(1);
    let index = place(uv.y, texture.height) as usize * texture.width as usize + place(uv.x, texture.width) as usize;
    let [r, g, b, a] = texture.rgba.get(index).copied().unwrap_or([255; 4]);
    let decode = |code: u8| if color { srgb::decode_u8(code) } else { f32::from(code) / 255.0 };
    Vec4::new(decode(r), decode(g), decode(b), f32::from(a) / 255.0)
}

/// Coordinates of a vertex in the texture.
pub fn texture_uv(primitive: &Primitive, reference: &TextureRef, vertex: usize) -> Vec2 {
    let uv = primitive.uvs.get(reference.uv_set as usize).and_then(|set| set.get(vertex)).copied().unwrap_or_default();
    let [a, b, c, d, tx, ty] = reference.transform;
    Vec2::new(a * uv.x + b * uv.y + tx, c * uv.x + d * uv.y + ty)
}

/// A piece of an emissive surface.
pub struct Patch {
    /// Metres.
    pub position: Vec3,
    /// Unit, on the emitting side.
    pub normal: Vec3,
    /// W/(sr·m²).
    pub radiance: Vec3,
    /// m².
    pub area: f32,
}

/// About `count` patches of equal power over all emissive triangles, in their order. Double-sided triangles emit from both sides.
pub fn patches(scene: &Scene, pose: &Pose, bvh: &Bvh, count: u32) -> Vec<Patch> {
    let mut lamps = Vec::new();
    for (index, corners) in bvh.triangles().iter().enumerate() {
        let id = bvh.id(index as u32);
        let Some(mesh) = scene.nodes[id.node as usize].mesh else { continue };
        let primitive = &scene.meshes[mesh as usize].primitives[id.primitive as usize];
        let material = &scene.materials[primitive.material as usize];
        if material.unlit || material.emissive.max_element() <= 0.0 {
            continue;
        }
        let cross = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let power = 0.5 * cross.length() * material.emissive.element_sum();
        if power > 0.0 {
            lamps.push((id, primitive, material, corners, cross, power));
        }
    }
    let total: f64 = lamps.iter().map(|l| f64::from(l.5)).sum();
    let (mut out, mut done) = (Vec::new(), 0.0f64);
    for (id, primitive, material, [a, b, c], cross, power) in lamps {
        // Samples fall where the running sum of power passes half steps.
        let step = total / f64::from(count.max(1));
        let (first, last) = ((done / step - 0.5).ceil(), ((done + f64::from(power)) / step - 0.5).ceil());
        done += f64::from(power);
        let n = (last - first).max(0.0) as u32;
        if n == 0 {
            continue;
        }
        let indices = &primitive.indices[3 * id.triangle as usize..][..3];
        let vertices = deform::world_vertices(scene, pose, id.node as usize, primitive);
        let normal: Vec3 = indices.iter().map(|&i| vertices.normals[i as usize]).sum();
        let front = cross.normalize_or_zero() * if cross.dot(normal) < 0.0 { -1.0 } else { 1.0 };
        for k in 0..n {
            // R2 sequence (Roberts 2018), folded into the triangle.
            let (u, v) = ((0.5 + 0.754_877_7 * k as f32).fract(), (0.5 + 0.569_840_3 * k as f32).fract());
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let texel = material.emissive_texture.map_or(Vec3::ONE, |t| {
                let uv = |i: usize| texture_uv(primitive, &t, indices[i] as usize);
                sample(scene, &t, uv(0) * (1.0 - u - v) + uv(1) * u + uv(2) * v, true).truncate()
            });
            // Equal power: the area follows from the radiance without its texture.
            let area = (step / f64::from(material.emissive.element_sum())) as f32;
            let position = *a * (1.0 - u - v) + *b * u + *c * v;
            let patch = |normal| Patch { position, normal, radiance: material.emissive * texel, area };
            out.push(patch(front));
            if material.double_sided {
                out.push(patch(-front));
            }
        }
    }
    out
}

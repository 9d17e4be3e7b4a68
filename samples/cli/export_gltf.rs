//! `lucerna export-gltf`: a scene as one glTF 2.0 file, so that other programs can render the same scene.
//!
//! Each mesh is written once, and nodes hold world transforms. Meshes that deform are written as they are at the chosen time. glTF has no
//! environments, so the environment is written beside the file. Animations are left out.

use std::{
    collections::HashMap,
    path::{Path, PathBuf},
};

use glam::{Mat4, Vec2, Vec3, Vec4};
use lucerna::{
    Error, ErrorKind, Result,
    image::{self, Format, Layers, WriteOptions},
    scene::{
        AlphaMode, Environment, Light, LightKind, Material, MipFilter, Pose, Primitive, Projection, Sampler, Scene,
        Texture, TextureRef, View, Wrap, deform::world_vertices,
    },
};
use serde_json::{Map, Value, json};

use crate::{
    args::TalkArgs,
    glb::glb,
    program,
    stage::{Stage, StageArgs},
};

/// glTF's numbers of component types.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
/// glTF's numbers of the uses of a buffer view.
const ATTRIBUTES: u32 = 34962;
const INDICES: u32 = 34963;

/// Options of `lucerna export-gltf`.
#[derive(clap::Args, Clone, Debug)]
pub struct ExportGltfArgs {
    #[command(flatten)]
    pub stage: StageArgs,
    /// File to write, ending in .glb; the environment is written beside it as FILE-environment.exr
    #[arg(short, long, value_name = "FILE.glb")]
    pub output: PathBuf,
    /// Overwrite existing files
    #[arg(long)]
    pub overwrite: bool,
    #[command(flatten)]
    pub talk: TalkArgs,
}

/// Runs `lucerna export-gltf`.
///
/// # Errors
/// Any error of the run. Its kind decides the exit code.
pub fn run(args: &ExportGltfArgs) -> Result<()> {
    let console = args.talk.console();
    let output = &args.output;
    if output.extension().is_none_or(|ending| !ending.eq_ignore_ascii_case("glb")) {
        return Err(Error::usage("the output is not named .glb").in_file(output));
    }
    image::probe_output(output, args.overwrite)?;
    let stage = Stage::open(&args.stage)?;
    stage.notes().iter().for_each(|note| console.info(&format!("note: {}: {}", note.place, note.text)));
    let (pose, view) = stage.at(args.stage.time, args.stage.size)?;
    let (bytes, notes) = export(&stage.scene, &pose, &view)?;
    notes.iter().for_each(|note| console.info(&format!("note: {note}")));
    let sky = match &stage.scene.environment {
        Some(environment) => Some((beside(output), exr(environment)?)),
        None => None,
    };
    let mut files: Vec<(&Path, &[u8])> = Vec::new();
    if let Some((path, bytes)) = &sky {
        image::probe_output(path, args.overwrite)?;
        files.push((path, bytes));
    }
    files.push((output, &bytes));
    image::write_all_atomic(&files, args.overwrite)?;
    let names: Vec<String> = files.iter().rev().map(|(path, _)| path.display().to_string()).collect();
    console.info(&format!("wrote {}", names.join(" ")));
    Ok(())
}

/// The file of the environment.
fn beside(output: &Path) -> PathBuf {
    let stem = output.file_stem().unwrap_or_default().to_string_lossy();
    output.with_file_name(format!("{stem}-environment.exr"))
}

/// The environment with its rotation and scale applied.
fn exr(environment: &Environment) -> Result<Vec<u8>> {
    let (width, height) = (environment.width, environment.height);
    let turned = environment.rotation != 0.0;
    let mut pixels = Vec::with_capacity(width as usize * height as usize * 3);
    for (index, pixel) in environment.pixels.iter().enumerate() {
        let (x, y) = (index as u32 % width, index as u32 / width);
        let uv = Vec2::new((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32);
        let value = if turned { environment.radiance(towards(uv)) } else { *pixel * environment.scale };
        pixels.extend(value.to_array());
    }
    let layers = Layers::rgb(width, height, pixels);
    Ok(image::encode(Format::Exr, &layers, &WriteOptions { f32: true, ..WriteOptions::default() })?.0)
}

/// The direction that a latitude-longitude image shows at `uv`: its centre looks down −Z, u grows towards +X.
fn towards(uv: Vec2) -> Vec3 {
    let (azimuth, polar) = ((uv.x - 0.5) * std::f32::consts::TAU, uv.y * std::f32::consts::PI);
    Vec3::new(polar.sin() * azimuth.sin(), polar.cos(), -polar.sin() * azimuth.cos())
}

/// The scene in `pose` as the bytes of a .glb file, seen through `view` by its first camera; and notes about parts that are left out.
///
/// # Errors
/// `Runtime` if the file would be larger than glTF allows (4 GiB), or a texture cannot be encoded.
pub fn export(scene: &Scene, pose: &Pose, view: &View) -> Result<(Vec<u8>, Vec<String>)> {
    let Parts { document, binary, notes } = parts(scene, pose, view)?;
    Ok((glb(&document, binary)?, notes))
}

/// A glTF document, its one buffer, and notes about parts of the scene that are left out.
pub(crate) struct Parts {
    pub document: Value,
    pub binary: Vec<u8>,
    pub notes: Vec<String>,
}

/// The parts of [`export`].
pub(crate) fn parts(scene: &Scene, pose: &Pose, view: &View) -> Result<Parts> {
    let mut out = Writer::default();
    let images = scene.textures.iter().map(|texture| out.image(texture)).collect::<Result<Vec<_>>>()?;
    let materials: Vec<Value> = scene.materials.iter().map(|material| out.material(material)).collect();
    let mut nodes = vec![json!({ "name": "view", "camera": 0, "matrix": matrix(view.view_from_world.inverse()) })];
    let mut cameras = vec![camera_of(view)];
    let mut lights: Vec<Value> = Vec::new();
    let mut meshes = Vec::new();
    // Numbers of the meshes that do not deform.
    let mut shared: HashMap<u32, usize> = HashMap::new();
    for (index, node) in scene.nodes.iter().enumerate() {
        let mut placed = Map::new();
        let mut world = pose.world[index];
        let mesh = node.mesh.and_then(|mesh| Some((mesh, scene.meshes.get(mesh as usize)?)));
        // glTF forbids meshes without primitives.
        if let Some((number, mesh)) = mesh.filter(|(_, mesh)| mesh.primitives.iter().any(|p| !p.indices.is_empty())) {
            let deforms = |p: &Primitive| !p.morphs.is_empty() || (node.skin.is_some() && !p.joints.is_empty());
            let written = if mesh.primitives.iter().any(deforms) {
                world = Mat4::IDENTITY;
                meshes.push(out.mesh(&mesh.name, &mesh.primitives, |p| Some(world_vertices(scene, pose, index, p))));
                meshes.len() - 1
            } else {
                *shared.entry(number).or_insert_with(|| {
                    meshes.push(out.mesh(&mesh.name, &mesh.primitives, |_| None));
                    meshes.len() - 1
                })
            };
            placed.insert("mesh".into(), json!(written));
        }
        if let Some(light) = node.light.and_then(|light| scene.lights.get(light as usize)) {
            placed.insert("extensions".into(), json!({ "KHR_lights_punctual": { "light": lights.len() } }));
            lights.push(light_of(light));
        }
        if let Some(camera) = node.camera.and_then(|camera| scene.cameras.get(camera as usize)) {
            placed.insert("camera".into(), json!(cameras.len()));
            cameras.push(named(projection(camera.projection), &camera.name));
        }
        if !placed.is_empty() {
            placed.insert("name".into(), json!(node.name));
            if world != Mat4::IDENTITY {
                placed.insert("matrix".into(), json!(matrix(world)));
            }
            nodes.push(Value::Object(placed));
        }
    }
    if !scene.animations.is_empty() {
        out.notes.push("animations are left out; the file holds the chosen time".into());
    }
    if scene.environment.is_some() {
        out.notes.push("glTF has no environments; the environment is a file of its own".into());
    }
    let mut document = json!({
        "asset": { "version": "2.0", "generator": format!("lucerna {}", program::VERSION) },
        "scene": 0,
        "scenes": [{ "name": scene.name, "nodes": (0..nodes.len()).collect::<Vec<_>>() }],
        "nodes": nodes,
        "cameras": cameras,
    });
    // glTF forbids empty lists.
    let lists = [
        ("meshes", meshes),
        ("materials", materials),
        ("images", images),
        (
            "textures",
            out.textures.iter().map(|(image, sampler)| json!({ "source": image, "sampler": sampler })).collect(),
        ),
        ("samplers", out.samplers.iter().map(sampler_of).collect()),
        ("accessors", std::mem::take(&mut out.accessors)),
        ("bufferViews", std::mem::take(&mut out.views)),
    ];
    for (name, list) in lists.into_iter().filter(|(_, list)| !list.is_empty()) {
        document[name] = Value::Array(list);
    }
    if !out.bytes.is_empty() {
        document["buffers"] = json!([{ "byteLength": out.bytes.len() }]);
    }
    if !lights.is_empty() {
        document["extensions"] = json!({ "KHR_lights_punctual": { "lights": lights } });
        out.used.push("KHR_lights_punctual");
    }
    out.used.sort_unstable();
    out.used.dedup();
    if !out.used.is_empty() {
        document["extensionsUsed"] = json!(out.used);
    }
    out.notes.dedup();
    Ok(Parts { document, binary: out.bytes, notes: out.notes })
}

/// The parts of a document that materials and meshes share.
#[derive(Default)]
struct Writer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    /// Image and sampler of each texture.
    textures: Vec<(u32, usize)>,
    samplers: Vec<Sampler>,
    /// Extensions.
    used: Vec<&'static str>,
    notes: Vec<String>,
}

impl Writer {
    fn view(&mut self, bytes: &[u8]) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.push(json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() }));
        self.bytes.extend(bytes);
        self.views.len() - 1
    }

    fn accessor<T: bytemuck::NoUninit>(&mut self, data: &[T], component: u32, kind: &str) -> usize {
        let view = self.view(bytemuck::cast_slice(data));
        self.views[view]["target"] = json!(if kind == "SCALAR" { INDICES } else { ATTRIBUTES });
        self.accessors
            .push(json!({ "bufferView": view, "componentType": component, "count": data.len(), "type": kind }));
        self.accessors.len() - 1
    }

    fn image(&mut self, texture: &Texture) -> Result<Value> {
        let failed = |error: png::EncodingError| Error::new(ErrorKind::Runtime, "cannot be PNG").caused_by(error);
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, texture.width, texture.height);
        encoder.set_color(png::ColorType::Rgba);
        let mut writer = encoder.write_header().map_err(failed)?;
        writer.write_image_data(texture.rgba.as_flattened()).map_err(failed)?;
        writer.finish().map_err(failed)?;
        let view = self.view(&bytes);
        Ok(json!({ "name": texture.name, "mimeType": "image/png", "bufferView": view }))
    }

    /// A mesh. `deformed`: world-space vertices instead of the primitive's own.
    fn mesh(
        &mut self,
        name: &str,
        primitives: &[Primitive],
        deformed: impl Fn(&Primitive) -> Option<lucerna::scene::deform::Vertices>,
    ) -> Value {
        let mut list = Vec::new();
        for primitive in primitives.iter().filter(|primitive| !primitive.indices.is_empty()) {
            let vertices = deformed(primitive);
            let (positions, normals, tangents) = match &vertices {
                Some(v) => (&v.positions, &v.normals, &v.tangents),
                None => (&primitive.positions, &primitive.normals, &primitive.tangents),
            };
            let mut attributes = Map::new();
            let at = self.accessor(positions, FLOAT, "VEC3");
            let low = positions.iter().copied().fold(Vec3::INFINITY, Vec3::min);
            let high = positions.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
            self.accessors[at]["min"] = json!(low.to_array());
            self.accessors[at]["max"] = json!(high.to_array());
            attributes.insert("POSITION".into(), json!(at));
            attributes.insert("NORMAL".into(), json!(self.accessor(normals, FLOAT, "VEC3")));
            if !tangents.is_empty() && tangents.iter().all(|tangent| *tangent != Vec4::ZERO) {
                attributes.insert("TANGENT".into(), json!(self.accessor(tangents, FLOAT, "VEC4")));
            }
            for (set, uvs) in primitive.uvs.iter().enumerate().filter(|(_, uvs)| !uvs.is_empty()) {
                attributes.insert(format!("TEXCOORD_{set}"), json!(self.accessor(uvs, FLOAT, "VEC2")));
            }
            if !primitive.colors.is_empty() {
                attributes.insert("COLOR_0".into(), json!(self.accessor(&primitive.colors, FLOAT, "VEC4")));
            }
            let indices = self.accessor(&primitive.indices, UNSIGNED_INT, "SCALAR");
            list.push(json!({ "attributes": attributes, "indices": indices, "material": primitive.material }));
        }
        named(json!({ "primitives": list }), name)
    }

    fn material(&mut self, material: &Material) -> Value {
        let mut pbr = json!({
            "baseColorFactor": material.base_color.to_array(),
            "metallicFactor": material.metallic,
            "roughnessFactor": material.roughness,
        });
        if let Some(texture) = self.texture(material.base_color_texture.as_ref()) {
            pbr["baseColorTexture"] = texture;
        }
        if let Some(texture) = self.texture(material.metallic_roughness_texture.as_ref()) {
            pbr["metallicRoughnessTexture"] = texture;
        }
        let mut out =
            named(json!({ "pbrMetallicRoughness": pbr, "doubleSided": material.double_sided }), &material.name);
        if let Some(mut texture) = self.texture(material.normal_texture.as_ref()) {
            texture["scale"] = json!(material.normal_scale);
            out["normalTexture"] = texture;
        }
        if let Some(mut texture) = self.texture(material.occlusion_texture.as_ref()) {
            texture["strength"] = json!(material.occlusion_strength);
            out["occlusionTexture"] = texture;
        }
        if let Some(texture) = self.texture(material.emissive_texture.as_ref()) {
            out["emissiveTexture"] = texture;
        }
        match material.alpha {
            AlphaMode::Opaque => {}
            AlphaMode::Mask { cutoff } => {
                out["alphaMode"] = json!("MASK");
                out["alphaCutoff"] = json!(cutoff);
            }
            AlphaMode::Blend => out["alphaMode"] = json!("BLEND"),
        }
        // Factors are at most 1; the strength carries the rest.
        let strength = material.emissive.max_element().max(1.0);
        out["emissiveFactor"] = json!((material.emissive / strength).to_array());
        let transmission = self.texture(material.transmission_texture.as_ref());
        let mut extensions = Map::new();
        let mut extend = |name: &'static str, value: Value| {
            extensions.insert(name.into(), value);
            self.used.push(name);
        };
        if strength > 1.0 {
            extend("KHR_materials_emissive_strength", json!({ "emissiveStrength": strength }));
        }
        if material.unlit {
            extend("KHR_materials_unlit", json!({}));
        }
        if material.ior != Material::default().ior {
            extend("KHR_materials_ior", json!({ "ior": material.ior }));
        }
        if material.transmission > 0.0 {
            let mut value = json!({ "transmissionFactor": material.transmission });
            if let Some(texture) = transmission {
                value["transmissionTexture"] = texture;
            }
            extend("KHR_materials_transmission", value);
        }
        if !extensions.is_empty() {
            out["extensions"] = Value::Object(extensions);
        }
        out
    }

    /// The use of a texture.
    fn texture(&mut self, used: Option<&TextureRef>) -> Option<Value> {
        let used = used?;
        let sampler = self.samplers.iter().position(|sampler| *sampler == used.sampler).unwrap_or_else(|| {
            self.samplers.push(used.sampler);
            self.samplers.len() - 1
        });
        let pair = (used.texture, sampler);
        let index = self.textures.iter().position(|texture| *texture == pair).unwrap_or_else(|| {
            self.textures.push(pair);
            self.textures.len() - 1
        });
        let mut value = json!({ "index": index, "texCoord": used.uv_set });
        if used.transform != TextureRef::IDENTITY {
            // Translation · rotation · scale, with v downwards.
            let [a, b, c, d, x, y] = used.transform;
            let (width, rotation) = (a.hypot(c), (-c).atan2(a));
            let (sin, cos) = rotation.sin_cos();
            let height = b * sin + d * cos;
            let back = [cos * width, sin * height, -sin * width, cos * height];
            let size = back.iter().map(|v| v.abs()).fold(1e-6, f32::max);
            if back.iter().zip([a, b, c, d]).any(|(back, value)| (back - value).abs() > 1e-5 * size) {
                self.notes.push("a texture is sheared, which glTF cannot say; it is only turned and scaled".into());
            }
            self.used.push("KHR_texture_transform");
            let transform = json!({ "offset": [x, y], "rotation": rotation, "scale": [width, height] });
            value["extensions"] = json!({ "KHR_texture_transform": transform });
        }
        Some(value)
    }
}

fn named(mut value: Value, name: &str) -> Value {
    if !name.is_empty() {
        value["name"] = json!(name);
    }
    value
}

/// Columns of a matrix, one after the other.
fn matrix(world: Mat4) -> [f32; 16] {
    let mut columns = world.to_cols_array();
    // The last row of a node's matrix must be exact.
    [columns[3], columns[7], columns[11], columns[15]] = [0.0, 0.0, 0.0, 1.0];
    columns
}

fn camera_of(view: &View) -> Value {
    let clip = view.clip_from_view;
    let (x, y) = (clip.x_axis.x, clip.y_axis.y);
    let projection = match view.is_orthographic() {
        true => Projection::Orthographic { xmag: 1.0 / x, ymag: 1.0 / y, znear: view.near, zfar: view.far },
        false => {
            let (yfov, aspect) = (2.0 * (1.0 / y).atan(), Some(y / x));
            Projection::Perspective { yfov, aspect, znear: view.near, zfar: Some(view.far) }
        }
    };
    named(self::projection(projection), "view")
}

fn projection(projection: Projection) -> Value {
    match projection {
        Projection::Perspective { yfov, aspect, znear, zfar } => {
            let mut perspective = json!({ "yfov": yfov, "znear": znear });
            for (name, value) in [("aspectRatio", aspect), ("zfar", zfar)] {
                if let Some(value) = value.filter(|value| value.is_finite()) {
                    perspective[name] = json!(value);
                }
            }
            json!({ "type": "perspective", "perspective": perspective })
        }
        Projection::Orthographic { xmag, ymag, znear, zfar } => {
            let orthographic = json!({ "xmag": xmag, "ymag": ymag, "znear": znear, "zfar": zfar });
            json!({ "type": "orthographic", "orthographic": orthographic })
        }
    }
}

/// A light of KHR_lights_punctual. Intensities stay in W/sr and W/m².
fn light_of(light: &Light) -> Value {
    let strongest = light.color.max_element().max(1.0);
    let color = (light.color / strongest).to_array();
    let mut out = named(json!({ "color": color, "intensity": light.intensity * strongest }), &light.name);
    let range = match light.kind {
        LightKind::Directional => {
            out["type"] = json!("directional");
            None
        }
        LightKind::Point { range } => {
            out["type"] = json!("point");
            range
        }
        LightKind::Spot { range, inner, outer } => {
            out["type"] = json!("spot");
            out["spot"] = json!({ "innerConeAngle": inner, "outerConeAngle": outer });
            range
        }
    };
    if let Some(range) = range {
        out["range"] = json!(range);
    }
    out
}

fn sampler_of(sampler: &Sampler) -> Value {
    let wrap = |wrap| match wrap {
        Wrap::Repeat => 10497,
        Wrap::MirroredRepeat => 33648,
        Wrap::ClampToEdge => 33071,
    };
    let min = match (sampler.mip, sampler.min_linear) {
        (MipFilter::None, false) => 9728,
        (MipFilter::None, true) => 9729,
        (MipFilter::Nearest, false) => 9984,
        (MipFilter::Nearest, true) => 9985,
        (MipFilter::Linear, false) => 9986,
        (MipFilter::Linear, true) => 9987,
    };
    let mag = if sampler.mag_linear { 9729 } else { 9728 };
    json!({ "wrapS": wrap(sampler.wrap_u), "wrapT": wrap(sampler.wrap_v), "minFilter": min, "magFilter": mag })
}

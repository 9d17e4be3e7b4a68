//! The CPU scene: what every front end (glTF, OBJ, the built-in scenes) produces and everything else reads.
//!
//! Right-handed, Y up, metres, linear Rec. 709. Cameras and lights look down −Z of their node. Nothing here knows Vulkan.

pub mod added;
pub mod animate;
mod archive;
mod budget;
pub mod bvh;
pub mod c_arrays;
pub mod chosen;
pub mod cull;
pub mod deform;
pub mod environment;
pub mod extent;
mod folder;
pub mod gltf;
pub mod ground;
mod load;
pub(crate) mod nearest;
pub mod normals;
mod notes;
mod obj;
mod surface;
pub(crate) mod surfaces;
mod tangents;
pub mod terrain;
pub mod texture;
mod validate;
pub mod view;

pub use crate::limits::Limits;
pub use animate::Pose;
pub use cull::Aabb;
pub use load::{LoadOptions, load};
pub use view::View;

use glam::{Mat4, Quat, Vec2, Vec3, Vec4};

/// A complete scene. Indices between its lists are checked by [`Scene::validate`].
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Short name for file names and metadata.
    pub name: String,
    /// Parents stand before their children, so that one forward pass computes world transforms.
    pub nodes: Vec<Node>,
    pub meshes: Vec<Mesh>,
    pub materials: Vec<Material>,
    pub textures: Vec<Texture>,
    pub lights: Vec<Light>,
    pub cameras: Vec<Camera>,
    pub skins: Vec<Skin>,
    pub animations: Vec<Animation>,
    /// Light from infinity around the scene.
    pub environment: Option<Environment>,
    /// Where the objects begin that were added at run time ([`added::add`]); `None`: there are none.
    pub added: Option<added::Counts>,
    /// What the front end met and could not serve, or served by an approximation. Shown by `inspect` and at load.
    pub notes: Vec<Note>,
}

/// A transform with an optional mesh, skin, light or camera.
#[derive(Clone, Debug)]
pub struct Node {
    pub name: String,
    /// Index into [`Scene::nodes`], smaller than this node's own index.
    pub parent: Option<u32>,
    pub local: Transform,
    pub mesh: Option<u32>,
    pub skin: Option<u32>,
    pub light: Option<u32>,
    pub camera: Option<u32>,
    /// Morph weights of this node's mesh; empty: the mesh's own.
    pub weights: Vec<f32>,
}

impl Default for Node {
    fn default() -> Self {
        Self {
            name: String::new(),
            parent: None,
            local: Transform::Trs { translation: Vec3::ZERO, rotation: Quat::IDENTITY, scale: Vec3::ONE },
            mesh: None,
            skin: None,
            light: None,
            camera: None,
            weights: Vec::new(),
        }
    }
}

/// Local transform of a node. Only `Trs` can be animated.
#[derive(Clone, Copy, Debug)]
pub enum Transform {
    Trs { translation: Vec3, rotation: Quat, scale: Vec3 },
    Matrix(Mat4),
}

impl Transform {
    /// `parent_from_local`.
    pub fn matrix(&self) -> Mat4 {
        match *self {
            Self::Trs { translation, rotation, scale } => {
                Mat4::from_scale_rotation_translation(scale, rotation, translation)
            }
            Self::Matrix(matrix) => matrix,
        }
    }
}

#[derive(Clone, Debug, Default)]
pub struct Mesh {
    pub name: String,
    pub primitives: Vec<Primitive>,
    /// Default morph weights, as many as each primitive has targets.
    pub weights: Vec<f32>,
}

/// A triangle list with one material. Strips and fans are already triangles; degenerate triangles are dropped.
///
/// `positions`, `normals` and `tangents` always have the same length. The other attributes are empty or as long.
#[derive(Clone, Debug, Default)]
pub struct Primitive {
    /// Metres, local to the mesh.
    pub positions: Vec<Vec3>,
    /// Unit length.
    pub normals: Vec<Vec3>,
    /// xyz unit tangent, w = ±1 handedness (MikkTSpace; bitangent = w · cross(n, t)). Zero where the material has no normal map.
    pub tangents: Vec<Vec4>,
    /// Up to [`MAX_UV_SETS`] sets; glTF convention (v = 0 is the top row of the image).
    pub uvs: Vec<Vec<Vec2>>,
    /// Linear RGBA vertex colours, multiplied onto the base colour.
    pub colors: Vec<Vec4>,
    /// Four joints a vertex and set; sets beyond the first give eight or more influences. Indices into [`Skin::joints`].
    pub joints: Vec<Vec<[u16; 4]>>,
    /// As `joints`; the weights of a vertex over all sets sum to one.
    pub weights: Vec<Vec<Vec4>>,
    pub morphs: Vec<MorphTarget>,
    /// Three a triangle, counter-clockwise seen from the front.
    pub indices: Vec<u32>,
    /// Index into [`Scene::materials`].
    pub material: u32,
}

/// Texture-coordinate sets that a primitive may have.
pub const MAX_UV_SETS: usize = 4;

/// Differences to the base attributes at weight one. Empty lists: no difference.
#[derive(Clone, Debug, Default)]
pub struct MorphTarget {
    pub positions: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    /// xyz only.
    pub tangents: Vec<Vec3>,
    pub colors: Vec<Vec4>,
    pub uvs: Vec<Vec<Vec2>>,
}

/// glTF metallic-roughness. Factors multiply their textures.
#[derive(Clone, Debug)]
pub struct Material {
    pub name: String,
    /// Linear RGBA.
    pub base_color: Vec4,
    pub base_color_texture: Option<TextureRef>,
    pub metallic: f32,
    pub roughness: f32,
    /// G = roughness, B = metallic.
    pub metallic_roughness_texture: Option<TextureRef>,
    pub normal_texture: Option<TextureRef>,
    pub normal_scale: f32,
    /// R = accessibility of ambient light.
    pub occlusion_texture: Option<TextureRef>,
    pub occlusion_strength: f32,
    /// Emitted radiance, W/(sr·m²), with KHR_materials_emissive_strength already multiplied in.
    pub emissive: Vec3,
    pub emissive_texture: Option<TextureRef>,
    pub alpha: AlphaMode,
    pub double_sided: bool,
    /// KHR_materials_unlit: base colour is shown as emitted radiance, no light is received or cast.
    pub unlit: bool,
    /// KHR_materials_ior; 1.5 by default.
    pub ior: f32,
    /// KHR_materials_transmission factor in [0, 1].
    pub transmission: f32,
    pub transmission_texture: Option<TextureRef>,
}

impl Default for Material {
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color: Vec4::ONE,
            base_color_texture: None,
            metallic: 1.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            occlusion_texture: None,
            occlusion_strength: 1.0,
            emissive: Vec3::ZERO,
            emissive_texture: None,
            alpha: AlphaMode::Opaque,
            double_sided: false,
            unlit: false,
            ior: 1.5,
            transmission: 0.0,
            transmission_texture: None,
        }
    }
}

impl Material {
    /// A diffuse material of linear albedo `rho`.
    pub fn diffuse(name: impl Into<String>, rho: Vec3) -> Self {
        Self { name: name.into(), base_color: rho.extend(1.0), metallic: 0.0, roughness: 1.0, ..Self::default() }
    }

    /// A light source of radiance `emissive`, W/(sr·m²), that reflects nothing.
    pub fn emitter(name: impl Into<String>, emissive: Vec3) -> Self {
        Self { emissive, ..Self::diffuse(name, Vec3::ZERO) }
    }

    /// Whitted mirror by the project's convention: `roughness < 0.05 && metallic > 0.5`.
    pub fn is_mirror(&self) -> bool {
        self.roughness < 0.05 && self.metallic > 0.5
    }

    /// Metal everywhere, which reflects nearly no light diffusely. A texture of metallic may leave other places; such materials do not count.
    pub fn is_metal(&self) -> bool {
        !self.unlit && self.metallic > 0.5 && self.metallic_roughness_texture.is_none()
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AlphaMode {
    Opaque,
    /// Cut out where alpha is below the cutoff.
    Mask {
        cutoff: f32,
    },
    Blend,
}

/// A use of a texture by a material.
#[derive(Clone, Copy, Debug)]
pub struct TextureRef {
    /// Index into [`Scene::textures`].
    pub texture: u32,
    /// Which of the primitive's uv sets.
    pub uv_set: u32,
    /// KHR_texture_transform as `[a, b, c, d, tx, ty]`: u' = a·u + b·v + tx, v' = c·u + d·v + ty.
    pub transform: [f32; 6],
    pub sampler: Sampler,
}

impl TextureRef {
    pub const IDENTITY: [f32; 6] = [1.0, 0.0, 0.0, 1.0, 0.0, 0.0];

    /// The texture on uv set 0, untransformed, with a repeating trilinear sampler.
    pub fn new(texture: u32) -> Self {
        Self { texture, uv_set: 0, transform: Self::IDENTITY, sampler: Sampler::default() }
    }
}

/// glTF sampler.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Sampler {
    pub wrap_u: Wrap,
    pub wrap_v: Wrap,
    pub mag_linear: bool,
    pub min_linear: bool,
    /// How mip levels are used when minifying.
    pub mip: MipFilter,
}

impl Default for Sampler {
    fn default() -> Self {
        Self { wrap_u: Wrap::Repeat, wrap_v: Wrap::Repeat, mag_linear: true, min_linear: true, mip: MipFilter::Linear }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Wrap {
    Repeat,
    MirroredRepeat,
    ClampToEdge,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MipFilter {
    None,
    Nearest,
    Linear,
}

/// A decoded image for materials, 8 bits a channel, top row first.
#[derive(Clone)]
pub struct Texture {
    pub name: String,
    pub width: u32,
    pub height: u32,
    /// `width · height` RGBA texels. Encoding depends on the use: base colour and emissive are sRGB, all else linear.
    pub rgba: Vec<[u8; 4]>,
}

impl std::fmt::Debug for Texture {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Texture({:?}, {}×{})", self.name, self.width, self.height)
    }
}

/// A light that stands at a node (directional and spot lights shine down its −Z). Emissive meshes are lights too, but
/// stay in the meshes.
#[derive(Clone, Debug)]
pub struct Light {
    pub name: String,
    pub kind: LightKind,
    /// Linear Rec. 709 colour; multiplies `intensity`.
    pub color: Vec3,
    /// Point and spot: radiant intensity, W/sr. Directional: irradiance on a facing plane, W/m².
    pub intensity: f32,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    Directional,
    /// `range`: metres after which the light is cut off smoothly (KHR_lights_punctual); `None`: no cut-off.
    Point {
        range: Option<f32>,
    },
    /// Angles from the axis in radians, inner < outer ≤ π/2.
    Spot {
        range: Option<f32>,
        inner: f32,
        outer: f32,
    },
}

#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    pub name: String,
    pub projection: Projection,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// `yfov`: full vertical angle in radians; `aspect`: width / height, `None`: of the output image; `zfar`: `None` = infinite.
    Perspective { yfov: f32, aspect: Option<f32>, znear: f32, zfar: Option<f32> },
    /// Half extents in metres.
    Orthographic { xmag: f32, ymag: f32, znear: f32, zfar: f32 },
}

#[derive(Clone, Debug)]
pub struct Skin {
    pub name: String,
    /// Node indices.
    pub joints: Vec<u32>,
    /// `joint_from_mesh` at bind time, one a joint.
    pub inverse_bind: Vec<Mat4>,
}

#[derive(Clone, Debug, Default)]
pub struct Animation {
    pub name: String,
    pub channels: Vec<Channel>,
}

impl Animation {
    /// Time of the last key, seconds.
    pub fn duration(&self) -> f32 {
        self.channels.iter().filter_map(|c| c.times.last().copied()).fold(0.0, f32::max)
    }
}

/// One animated property of one node.
#[derive(Clone, Debug)]
pub struct Channel {
    pub node: u32,
    pub interpolation: Interpolation,
    /// Seconds, strictly increasing.
    pub times: Vec<f32>,
    pub values: Keys,
}

/// Key values. Cubic splines store in-tangent, value, out-tangent for each key (three times as many entries).
#[derive(Clone, Debug)]
pub enum Keys {
    Translation(Vec<Vec3>),
    Rotation(Vec<Quat>),
    Scale(Vec<Vec3>),
    /// All weights of a key in a row.
    Weights {
        count: usize,
        values: Vec<f32>,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    Step,
    Linear,
    CubicSpline,
}

/// An HDR environment: radiance from infinity, W/(sr·m²).
#[derive(Clone)]
pub struct Environment {
    pub name: String,
    /// Latitude-longitude: +Y up, the image centre looks down −Z, u grows to the right (towards +X at the centre).
    pub width: u32,
    pub height: u32,
    /// Linear Rec. 709, top row first.
    pub pixels: Vec<Vec3>,
    /// Rotation about +Y in radians, counter-clockwise seen from above, applied to the environment.
    pub rotation: f32,
    /// Factor on the radiance.
    pub scale: f32,
}

impl std::fmt::Debug for Environment {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Environment({:?}, {}×{})", self.name, self.width, self.height)
    }
}

/// Something a user must know about how a scene was read.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Note {
    pub kind: NoteKind,
    /// Where: `materials[3]`, `extensionsUsed`.
    pub place: String,
    pub text: String,
}

/// `materials[3]: its text`.
impl std::fmt::Display for Note {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.place, self.text)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum NoteKind {
    /// Not read at all.
    Ignored,
    /// Read, but served by something simpler.
    Approximated,
    /// Repaired while reading (degenerate triangles dropped, weights normalised).
    Repaired,
}

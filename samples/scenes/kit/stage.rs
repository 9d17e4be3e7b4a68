//! [`Stage`]: a scene under construction.

use super::{Model, Picture, srgb};
use glam::{Mat3, Mat4, Quat, Vec2, Vec3, Vec4};
use lucerna::scene::{
    Camera, Light, LightKind, Material, Mesh, Node, Primitive, Projection, Scene, Texture, TextureRef, Transform,
};

/// A scene under construction: lists grow, indices come back.
#[derive(Debug)]
pub(crate) struct Stage {
    pub scene: Scene,
}

impl Stage {
    /// An empty scene.
    pub fn new(name: &str) -> Self {
        Self { scene: Scene { name: name.to_owned(), ..Scene::default() } }
    }

    /// Adds a material.
    pub fn material(&mut self, material: Material) -> u32 {
        push(&mut self.scene.materials, material)
    }

    /// A rough dielectric of an sRGB colour `0xRRGGBB`.
    pub fn paint(&mut self, name: &str, hex: u32, roughness: f32) -> u32 {
        self.material(Material { roughness, ..Material::diffuse(name, srgb(hex)) })
    }

    /// As [`Self::paint`], visible from both sides.
    pub fn paint_both(&mut self, name: &str, hex: u32, roughness: f32) -> u32 {
        self.material(Material { roughness, double_sided: true, ..Material::diffuse(name, srgb(hex)) })
    }

    /// A worn metal of an sRGB colour: half metallic, so that techniques without reflections do not show it black.
    pub fn metal(&mut self, name: &str, hex: u32, roughness: f32) -> u32 {
        self.material(Material { metallic: 0.5, roughness, ..Material::diffuse(name, srgb(hex)) })
    }

    /// A rough dielectric coloured by a picture that spans `metres` on the surface; its relief becomes a normal map
    /// where it has one.
    pub fn textured(&mut self, name: &str, picture: &Picture, metres: f32, roughness: f32) -> u32 {
        let scaled = |texture| TextureRef {
            transform: [1.0 / metres, 0.0, 0.0, 1.0 / metres, 0.0, 0.0],
            ..TextureRef::new(texture)
        };
        let color = scaled(self.texture(picture.color_texture(name)));
        let relief = picture.relief.iter().any(|h| *h != picture.relief[0]);
        let normal = relief.then(|| scaled(self.texture(picture.normal_texture(&format!("{name} relief"), metres))));
        self.material(Material {
            base_color_texture: Some(color),
            normal_texture: normal,
            roughness,
            ..Material::diffuse(name, Vec3::ONE)
        })
    }

    /// A rough dielectric coloured by a picture that spans uv 0 to `size` metres once (signs).
    pub fn pictured(&mut self, name: &str, picture: &Picture, size: Vec2, roughness: f32) -> u32 {
        let texture = self.texture(picture.color_texture(name));
        let transform = [1.0 / size.x, 0.0, 0.0, 1.0 / size.y, 0.0, 0.0];
        self.material(Material {
            base_color_texture: Some(TextureRef { transform, ..TextureRef::new(texture) }),
            roughness,
            ..Material::diffuse(name, Vec3::ONE)
        })
    }

    fn texture(&mut self, texture: Texture) -> u32 {
        push(&mut self.scene.textures, texture)
    }

    /// Adds a mesh with one primitive a material.
    pub fn mesh(&mut self, name: &str, model: Model) -> u32 {
        let primitives = model
            .parts
            .into_iter()
            .filter(|(_, geometry)| !geometry.indices.is_empty())
            .map(|(material, geometry)| geometry.into_primitive(material))
            .collect();
        push(&mut self.scene.meshes, Mesh { name: name.to_owned(), primitives, weights: Vec::new() })
    }

    /// Adds a node.
    pub fn node(&mut self, node: Node) -> u32 {
        push(&mut self.scene.nodes, node)
    }

    /// An instance of a mesh under a rigid or scaled transform.
    pub fn place(&mut self, name: &str, mesh: u32, world: Mat4) -> u32 {
        self.node(Node { name: name.to_owned(), local: trs(world), mesh: Some(mesh), ..Node::default() })
    }

    /// A mesh that occurs once, in world coordinates.
    pub fn add(&mut self, name: &str, model: Model) -> u32 {
        let mesh = self.mesh(name, model);
        self.place(name, mesh, Mat4::IDENTITY)
    }

    /// A mesh that occurs once, under a rigid or scaled transform.
    pub fn mesh_at(&mut self, name: &str, model: Model, world: Mat4) -> u32 {
        let mesh = self.mesh(name, model);
        self.place(name, mesh, world)
    }

    /// A perspective camera at `eye` that looks at `target`; `yfov` in degrees.
    pub fn camera(&mut self, name: &str, eye: [f32; 3], target: [f32; 3], yfov: f32) -> u32 {
        let projection =
            Projection::Perspective { yfov: yfov.to_radians(), aspect: None, znear: 0.05, zfar: Some(500.0) };
        let camera = push(&mut self.scene.cameras, Camera { name: name.to_owned(), projection });
        let local = looking(Vec3::from(eye), Vec3::from(target));
        self.node(Node { name: name.to_owned(), local, camera: Some(camera), ..Node::default() })
    }

    /// A point light of radiant intensity `intensity`, W/sr.
    pub fn point(&mut self, name: &str, position: [f32; 3], color: Vec3, intensity: f32) -> u32 {
        let kind = LightKind::Point { range: None };
        self.light(Light { name: name.to_owned(), kind, color, intensity }, looking_down(Vec3::from(position)))
    }

    /// A spot light of axial intensity `intensity`, W/sr, full inside `inner` and dark outside `outer` degrees from its
    /// axis.
    pub fn spot(
        &mut self,
        name: &str,
        (position, target): ([f32; 3], [f32; 3]),
        color: Vec3,
        intensity: f32,
        (inner, outer): (f32, f32),
    ) -> u32 {
        let kind = LightKind::Spot { range: None, inner: inner.to_radians(), outer: outer.to_radians() };
        let light = Light { name: name.to_owned(), kind, color, intensity };
        self.light(light, looking(Vec3::from(position), Vec3::from(target)))
    }

    /// The sun, in direction `to_sun`; `irradiance` on a facing plane, W/m².
    pub fn sun(&mut self, to_sun: Vec3, color: Vec3, irradiance: f32) -> u32 {
        let light = Light { name: "sun".to_owned(), kind: LightKind::Directional, color, intensity: irradiance };
        // A directional light has no place; a high one keeps it out of the way in viewers that draw lights.
        self.light(light, looking(to_sun * 50.0, Vec3::ZERO))
    }

    fn light(&mut self, light: Light, local: Transform) -> u32 {
        let name = light.name.clone();
        let light = push(&mut self.scene.lights, light);
        self.node(Node { name, local, light: Some(light), ..Node::default() })
    }

    /// The finished scene: tangents where a material has a normal map.
    pub fn finish(mut self) -> Scene {
        for primitive in self.scene.meshes.iter_mut().flat_map(|m| &mut m.primitives) {
            if self.scene.materials[primitive.material as usize].normal_texture.is_some() {
                tangents(primitive);
            }
        }
        self.scene
    }
}

fn push<T>(list: &mut Vec<T>, item: T) -> u32 {
    list.push(item);
    (list.len() - 1) as u32
}

/// Translation, rotation and scale of a transform without shear.
pub(crate) fn trs(matrix: Mat4) -> Transform {
    let (scale, rotation, translation) = matrix.to_scale_rotation_translation();
    Transform::Trs { translation, rotation, scale }
}

/// At `eye`, −Z towards `target`, +Y as far up as possible.
pub(crate) fn looking(eye: Vec3, target: Vec3) -> Transform {
    let back = (eye - target).normalize_or(Vec3::Z);
    let right = Vec3::Y.cross(back).normalize_or(Vec3::X);
    let rotation = Quat::from_mat3(&Mat3::from_cols(right, back.cross(right), back)).normalize();
    Transform::Trs { translation: eye, rotation, scale: Vec3::ONE }
}

fn looking_down(position: Vec3) -> Transform {
    looking(position, position - Vec3::Y)
}

/// Unit tangents along growing u, w so that w · cross(n, t) points to falling v (up in the picture).
fn tangents(primitive: &mut Primitive) {
    let mut along_u = vec![Vec3::ZERO; primitive.positions.len()];
    let mut against_v = vec![Vec3::ZERO; primitive.positions.len()];
    for corners in primitive.indices.chunks_exact(3) {
        let ids = [corners[0] as usize, corners[1] as usize, corners[2] as usize];
        let [p0, p1, p2] = ids.map(|i| primitive.positions[i]);
        let [u0, u1, u2] = ids.map(|i| primitive.uvs[0][i]);
        let (e1, e2, d1, d2) = (p1 - p0, p2 - p0, u1 - u0, u2 - u0);
        let area = d1.perp_dot(d2);
        if area.abs() < 1e-12 {
            continue;
        }
        let weight = e1.cross(e2).length() / area;
        for i in ids {
            along_u[i] += (e1 * d2.y - e2 * d1.y) * weight;
            against_v[i] -= (e2 * d1.x - e1 * d2.x) * weight;
        }
    }
    primitive.tangents = primitive
        .normals
        .iter()
        .enumerate()
        .map(|(i, n)| {
            let t = (along_u[i] - *n * n.dot(along_u[i])).normalize_or(n.any_orthonormal_vector());
            let handedness = if n.cross(t).dot(against_v[i]) < 0.0 { -1.0 } else { 1.0 };
            Vec4::new(t.x, t.y, t.z, handedness)
        })
        .collect();
}

//! What a ray finds: interpolated attributes and material values at a hit.

use crate::{
    image::srgb,
    scene::{
        AlphaMode, Environment, Material, Pose, Primitive, Scene, TextureRef, Wrap,
        bvh::Bvh,
        deform::{Vertices, world_vertices},
    },
};
use glam::{Vec2, Vec3, Vec4};

/// A point on a surface, turned towards the viewer.
#[derive(Clone, Copy)]
pub struct Face {
    pub position: Vec3,
    /// Shading normal, with the normal map.
    pub normal: Vec3,
    /// Normal that light is scattered by, but for Lambert's law alone: of metals [`mirroring`].
    pub lobe: Vec3,
    /// True normal of the triangle, on the same side.
    pub geometric: Vec3,
    pub to_viewer: Vec3,
    /// Diffuse albedo.
    pub albedo: Vec3,
    /// Base colour.
    pub base: Vec3,
    pub f0: Vec3,
    pub roughness: f32,
    /// Towards the viewer, W/(sr·m²).
    pub emission: Vec3,
    pub unlit: bool,
    /// Whether the viewer is on the front side.
    pub front: bool,
    pub double_sided: bool,
    /// Reflects sharply and does nothing else.
    pub mirror: bool,
    /// Share of the surface that is smooth glass.
    pub transmission: f32,
    pub ior: f32,
}

impl Face {
    /// A start for rays that leave the surface, off it by more than the rounding of the hit.
    pub fn lifted(&self) -> Vec3 {
        self.position + self.geometric * self.offset()
    }

    /// The same for rays that go through it.
    pub fn sunk(&self) -> Vec3 {
        self.position - self.geometric * self.offset()
    }

    fn offset(&self) -> f32 {
        1e-5 * (1.0 + self.position.abs().max_element())
    }

    /// α² of GGX: roughness no less than what a point light's highlight needs to cover a pixel.
    pub fn alpha_squared(&self) -> f32 {
        self.roughness.max(0.045).powi(4)
    }
}

/// The deformed geometry and materials behind the triangles of a [`Bvh`].
pub struct Surfaces<'a> {
    scene: &'a Scene,
    /// Of each mesh primitive in each place.
    vertices: Vec<Vertices>,
    triangles: Vec<Triangle<'a>>,
}

/// What is looked up for each hit.
struct Triangle<'a> {
    primitive: &'a Primitive,
    material: &'a Material,
    /// Index into the vertices, and into one of them.
    vertices: u32,
    corners: [u32; 3],
    /// Geometric normal on the front side.
    front: Vec3,
}

impl<'a> Surfaces<'a> {
    pub fn new(scene: &'a Scene, pose: &Pose, bvh: &Bvh) -> Self {
        let mut vertices = Vec::new();
        // First of each node.
        let mut first = Vec::with_capacity(scene.nodes.len());
        for (index, node) in scene.nodes.iter().enumerate() {
            first.push(vertices.len() as u32);
            let Some(mesh) = node.mesh else { continue };
            for primitive in &scene.meshes[mesh as usize].primitives {
                vertices.push(world_vertices(scene, pose, index, primitive));
            }
        }
        let triangle = |index: u32| {
            let id = bvh.id(index);
            let mesh = scene.nodes[id.node as usize].mesh.unwrap_or(0);
            let primitive = &scene.meshes[mesh as usize].primitives[id.primitive as usize];
            let at = 3 * id.triangle as usize;
            let corners = [0, 1, 2].map(|i| primitive.indices[at + i]);
            let place = first[id.node as usize] + id.primitive;
            let [a, b, c] = bvh.triangles()[index as usize];
            let n = (b - a).cross(c - a).normalize_or(Vec3::Y);
            // A mirroring transform keeps the front where the shading normals are.
            let shading: Vec3 = corners.iter().map(|&i| vertices[place as usize].normals[i as usize]).sum();
            Triangle {
                primitive,
                material: &scene.materials[primitive.material as usize],
                vertices: place,
                corners,
                front: if n.dot(shading) < 0.0 { -n } else { n },
            }
        };
        let triangles = (0..bvh.triangles().len() as u32).map(triangle).collect();
        Self { scene, vertices, triangles }
    }

    fn primitive(&self, triangle: u32) -> (&Primitive, &Vertices, &Material, [usize; 3]) {
        let Triangle { primitive, material, vertices, corners, .. } = &self.triangles[triangle as usize];
        (primitive, &self.vertices[*vertices as usize], material, corners.map(|i| i as usize))
    }

    /// Geometric normal on the front side.
    fn front(&self, triangle: u32) -> Vec3 {
        self.triangles[triangle as usize].front
    }

    /// Whether what is there depends on chance.
    pub fn is_certain(&self) -> bool {
        self.triangles.iter().all(|t| t.material.alpha != AlphaMode::Blend)
    }

    /// Whether a camera ray sees the back of a single-sided triangle, which a rasteriser culls.
    pub fn is_hidden_back(&self, triangle: u32, direction: Vec3) -> bool {
        !self.triangles[triangle as usize].material.double_sided && self.front(triangle).dot(direction) > 0.0
    }

    /// Whether this triangle stops light: unlit surfaces do not.
    pub fn casts(&self, triangle: u32) -> bool {
        !self.triangles[triangle as usize].material.unlit
    }

    /// Whether this triangle is a lamp.
    pub fn emits(&self, triangle: u32) -> bool {
        let material = self.triangles[triangle as usize].material;
        !material.unlit && material.emissive != Vec3::ZERO
    }

    /// Whether the surface is there, by its alpha; `random` in [0, 1) decides for blended surfaces.
    pub fn is_there(&self, triangle: u32, u: f32, v: f32, random: f32) -> bool {
        let (primitive, _, material, corners) = self.primitive(triangle);
        let threshold = match material.alpha {
            AlphaMode::Opaque => return true,
            AlphaMode::Mask { cutoff } => cutoff,
            AlphaMode::Blend => random,
        };
        self.base_color(primitive, material, corners, [1.0 - u - v, u, v]).w >= threshold
    }

    /// The share of the light that the surface stops, by its alpha.
    pub fn stops(&self, triangle: u32, u: f32, v: f32) -> f32 {
        let (primitive, _, material, corners) = self.primitive(triangle);
        let alpha = || self.base_color(primitive, material, corners, [1.0 - u - v, u, v]).w;
        match material.alpha {
            AlphaMode::Opaque => 1.0,
            AlphaMode::Mask { cutoff } => f32::from(alpha() >= cutoff),
            AlphaMode::Blend => alpha().clamp(0.0, 1.0),
        }
    }

    fn base_color(&self, primitive: &Primitive, material: &Material, corners: [usize; 3], w: [f32; 3]) -> Vec4 {
        let mut color = material.base_color;
        if let Some(texture) = &material.base_color_texture {
            color *= self.sample(texture, uv(primitive, texture, corners, w), true);
        }
        if !primitive.colors.is_empty() {
            color *= mix(corners.map(|i| primitive.colors[i]), w);
        }
        color
    }

    /// Attributes at barycentric (u, v) of a triangle, turned to `to_viewer`.
    pub fn at(&self, triangle: u32, u: f32, v: f32, to_viewer: Vec3) -> Face {
        let w = [1.0 - u - v, u, v];
        let (primitive, vertices, material, corners) = self.primitive(triangle);
        let color = self.base_color(primitive, material, corners, w);
        let (mut metallic, mut roughness) = (material.metallic, material.roughness);
        if let Some(texture) = &material.metallic_roughness_texture {
            let texel = self.sample(texture, uv(primitive, texture, corners, w), false);
            (roughness, metallic) = (roughness * texel.y, metallic * texel.z);
        }
        let mut emission = material.emissive;
        if let Some(texture) = &material.emissive_texture {
            emission *= self.sample(texture, uv(primitive, texture, corners, w), true).truncate();
        }
        let mut normal = mix(corners.map(|i| vertices.normals[i]), w).normalize_or(Vec3::Y);
        if let Some(texture) = &material.normal_texture {
            let tangent = mix(corners.map(|i| vertices.tangents[i]), w);
            let texel = self.sample(texture, uv(primitive, texture, corners, w), false).truncate() * 2.0 - 1.0;
            let t = tangent.truncate();
            let b = normal.cross(t) * vertices.tangents[corners[0]].w;
            let bumped =
                t * (texel.x * material.normal_scale) + b * (texel.y * material.normal_scale) + normal * texel.z;
            normal = bumped.normalize_or(normal);
        }
        let mut geometric = self.front(triangle);
        let front = geometric.dot(to_viewer) >= 0.0;
        if geometric.dot(to_viewer) < 0.0 {
            (geometric, normal) = (-geometric, -normal);
        }
        let base = color.truncate();
        let dielectric = ((material.ior - 1.0) / (material.ior + 1.0)).powi(2);
        let unlit = material.unlit;
        let mut transmission = material.transmission;
        if let Some(texture) = &material.transmission_texture {
            transmission *= self.sample(texture, uv(primitive, texture, corners, w), false).x;
        }
        if !(front || material.double_sided) {
            emission = Vec3::ZERO;
        }
        Face {
            position: mix(corners.map(|i| vertices.positions[i]), w),
            normal,
            lobe: if metallic > 0.5 { mirroring(normal, geometric, to_viewer) } else { normal },
            geometric,
            to_viewer,
            albedo: if unlit { Vec3::ZERO } else { base * (1.0 - metallic) },
            f0: Vec3::splat(dielectric).lerp(base, metallic),
            base,
            roughness,
            emission: if unlit { base } else { emission },
            unlit,
            front,
            double_sided: material.double_sided,
            mirror: roughness < 0.05 && metallic > 0.5,
            transmission: if unlit { 0.0 } else { transmission },
            ior: material.ior.max(1.0),
        }
    }

    /// Bilinear, finest level. `color` textures are sRGB.
    fn sample(&self, reference: &TextureRef, uv: Vec2, color: bool) -> Vec4 {
        let texture = &self.scene.textures[reference.texture as usize];
        let (width, height) = (texture.width as i64, texture.height as i64);
        let [a, b, c, d, tx, ty] = reference.transform;
        let uv = Vec2::new(a * uv.x + b * uv.y + tx, c * uv.x + d * uv.y + ty);
        let texel = |x: i64, y: i64| {
            let x = wrapped(x, width, reference.sampler.wrap_u);
            let y = wrapped(y, height, reference.sampler.wrap_v);
            let [r, g, b, a] = texture.rgba[y * texture.width as usize + x];
            let decode = |code: u8| if color { srgb::decode_u8(code) } else { f32::from(code) / 255.0 };
            Vec4::new(decode(r), decode(g), decode(b), f32::from(a) / 255.0)
        };
        if !uv.is_finite() {
            return texel(0, 0);
        }
        let (x, y) = (uv.x * width as f32, uv.y * height as f32);
        if !reference.sampler.mag_linear {
            return texel(x.floor() as i64, y.floor() as i64);
        }
        let (x, y) = (x - 0.5, y - 0.5);
        let (fx, fy) = (x - x.floor(), y - y.floor());
        let (x, y) = (x.floor() as i64, y.floor() as i64);
        let top = texel(x, y).lerp(texel(x + 1, y), fx);
        top.lerp(texel(x, y + 1).lerp(texel(x + 1, y + 1), fx), fy)
    }
}

/// The shading normal, bent towards that of the triangle as far as it takes for light to be mirrored above the triangle. Found by
/// halving, where the shader solves for it.
pub fn mirroring(shading: Vec3, geometric: Vec3, to_viewer: Vec3) -> Vec3 {
    let along = to_viewer.dot(geometric);
    let least = (0.9 * along).min(0.025);
    let above = |m: Vec3| 2.0 * m.dot(to_viewer) * m.dot(geometric) - along >= least;
    if above(shading) {
        return shading;
    }
    let across = shading - shading.dot(geometric) * geometric;
    let Some(x) = across.try_normalize() else { return geometric };
    let at = |angle: f32| x * angle.sin() + geometric * angle.cos();
    let (mut good, mut bad) = (0.0, x.dot(shading).atan2(geometric.dot(shading)));
    for _ in 0..40 {
        let middle = 0.5 * (good + bad);
        if above(at(middle)) { good = middle } else { bad = middle }
    }
    at(good).normalize()
}

fn wrapped(i: i64, size: i64, wrap: Wrap) -> usize {
    let i = match wrap {
        Wrap::Repeat => i.rem_euclid(size),
        Wrap::ClampToEdge => i.clamp(0, size - 1),
        Wrap::MirroredRepeat => {
            let j = i.rem_euclid(2 * size);
            if j < size { j } else { 2 * size - 1 - j }
        }
    };
    i as usize
}

fn uv(primitive: &Primitive, texture: &TextureRef, corners: [usize; 3], w: [f32; 3]) -> Vec2 {
    let set = primitive.uvs.get(texture.uv_set as usize);
    set.map_or(Vec2::ZERO, |uvs| mix(corners.map(|i| uvs[i]), w))
}

fn mix<V>(corners: [V; 3], w: [f32; 3]) -> V
where
    V: Copy + std::ops::Mul<f32, Output = V> + std::ops::Add<Output = V>,
{
    corners[0] * w[0] + corners[1] * w[1] + corners[2] * w[2]
}

/// Radiance that comes from `direction` (unit), bilinear.
pub fn environment(e: &Environment, direction: Vec3) -> Vec3 {
    // Turning the environment by +rotation is turning the direction back.
    let (sin, cos) = e.rotation.sin_cos();
    let d = Vec3::new(direction.x * cos - direction.z * sin, direction.y, direction.x * sin + direction.z * cos);
    let u = 0.5 + d.x.atan2(-d.z) / std::f32::consts::TAU;
    let v = d.y.clamp(-1.0, 1.0).acos() / std::f32::consts::PI;
    let (width, height) = (i64::from(e.width), i64::from(e.height));
    let (x, y) = (u * width as f32 - 0.5, v * height as f32 - 0.5);
    let (fx, fy) = (x - x.floor(), y - y.floor());
    let texel = |i: i64, j: i64| {
        let (i, j) = (i.rem_euclid(width), j.clamp(0, height - 1));
        e.pixels[(j * width + i) as usize]
    };
    let (x, y) = (x.floor() as i64, y.floor() as i64);
    let top = texel(x, y).lerp(texel(x + 1, y), fx);
    top.lerp(texel(x, y + 1).lerp(texel(x + 1, y + 1), fx), fy) * e.scale
}

//! A slow ray caster on the CPU: a check of cameras, orientation, exposure and free space that needs no device.
//!
//! Diffuse surfaces receive the punctual lights with exact shadows, emissive triangles (one sample a vertex), and what
//! `bounces` cosine-distributed rays find: other surfaces and the environment. Metals reflect along a roughened mirror
//! direction. Alpha, transmission and skins are ignored. It is no reference for papers; it is a second opinion.

use crate::scene::{LightKind, Material, Projection, Scene, TextureRef};
use glam::{Mat3, Mat4, Vec2, Vec3, Vec3A, Vec4};
use obvhs::{
    BvhBuildParams,
    cwbvh::{CwBvh, builder::build_cwbvh_from_tris},
    ray::{Ray, RayHit},
    triangle::Triangle,
};
use std::{f32::consts::PI, time::Duration};

/// How much work [`Tracer::image`] does.
#[derive(Clone, Copy, Debug)]
pub struct Quality {
    /// Paths a pixel.
    pub samples: u32,
    /// Diffuse bounces after the first hit; 0: direct light only.
    pub bounces: u32,
}

/// Radiance of every pixel, row by row from the top, seen by camera number `camera` (0: the first) with 16 paths a pixel
/// and one bounce. Black if there is no such camera.
pub fn preview(scene: &Scene, camera: usize, width: u32, height: u32) -> Vec<[f32; 3]> {
    Tracer::new(scene, &world_matrices(scene)).image(camera, width, height, Quality { samples: 16, bounces: 1 })
}

/// `world_from_node` of every node at rest.
pub fn world_matrices(scene: &Scene) -> Vec<Mat4> {
    let mut world: Vec<Mat4> = Vec::with_capacity(scene.nodes.len());
    for node in &scene.nodes {
        let parent = node.parent.and_then(|p| world.get(p as usize)).copied().unwrap_or(Mat4::IDENTITY);
        world.push(parent * node.local.matrix());
    }
    world
}

struct Corners {
    normals: [Vec3; 3],
    tangents: [Vec4; 3],
    uvs: [Vec2; 3],
    colors: [Vec3; 3],
    material: u32,
}

struct Lamp {
    kind: LightKind,
    position: Vec3,
    /// The way the light shines.
    axis: Vec3,
    power: Vec3,
}

/// A scene in world space with a hierarchy over its triangles.
pub struct Tracer<'a> {
    scene: &'a Scene,
    cameras: Vec<Mat4>,
    triangles: Vec<Triangle>,
    corners: Vec<Corners>,
    lamps: Vec<Lamp>,
    /// Emissive triangles and the running sum of their power.
    emitters: Vec<(usize, f32)>,
    bvh: CwBvh,
}

impl std::fmt::Debug for Tracer<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Tracer({:?}, {} triangles)", self.scene.name, self.triangles.len())
    }
}

impl<'a> Tracer<'a> {
    /// Flattens the scene under the given `world_from_node` matrices (see [`world_matrices`]).
    pub fn new(scene: &'a Scene, world: &[Mat4]) -> Self {
        let mut cameras = vec![Mat4::IDENTITY; scene.cameras.len()];
        let (mut triangles, mut corners, mut lamps, mut emitters) = (vec![], vec![], vec![], vec![]);
        for (node, &matrix) in scene.nodes.iter().zip(world) {
            if let Some(slot) = node.camera.and_then(|c| cameras.get_mut(c as usize)) {
                *slot = matrix;
            }
            if let Some(light) = node.light.and_then(|l| scene.lights.get(l as usize)) {
                lamps.push(Lamp {
                    kind: light.kind,
                    position: matrix.w_axis.truncate(),
                    axis: -matrix.z_axis.truncate().normalize_or(Vec3::Y),
                    power: light.color * light.intensity,
                });
            }
            let Some(mesh) = node.mesh.and_then(|m| scene.meshes.get(m as usize)) else { continue };
            let normal_map = Mat3::from_mat4(matrix).inverse().transpose();
            for primitive in &mesh.primitives {
                for ids in primitive.indices.chunks_exact(3) {
                    let ids = [ids[0] as usize, ids[1] as usize, ids[2] as usize];
                    let [v0, v1, v2] = ids.map(|i| Vec3A::from(matrix.transform_point3(primitive.positions[i])));
                    triangles.push(Triangle { v0, v1, v2 });
                    let uvs = primitive.uvs.first().map_or([Vec2::ZERO; 3], |uv| ids.map(|i| uv[i]));
                    let color = |i: usize| primitive.colors.get(i).map_or(Vec3::ONE, |c| c.truncate());
                    let tangent = |i: usize| {
                        let t = primitive.tangents[i];
                        matrix.transform_vector3(t.truncate()).normalize_or_zero().extend(t.w)
                    };
                    corners.push(Corners {
                        normals: ids.map(|i| (normal_map * primitive.normals[i]).normalize_or(Vec3::Y)),
                        tangents: ids.map(tangent),
                        uvs,
                        colors: ids.map(color),
                        material: primitive.material,
                    });
                }
            }
        }
        let mut sum = 0.0;
        for (index, (triangle, corner)) in triangles.iter().zip(&corners).enumerate() {
            let emissive = scene.materials[corner.material as usize].emissive;
            if emissive.max_element() > 0.0 {
                sum += emissive.element_sum() * area(triangle);
                emitters.push((index, sum));
            }
        }
        let bvh = build_cwbvh_from_tris(&triangles, BvhBuildParams::medium_build(), &mut Duration::default());
        Self { scene, cameras, triangles, corners, lamps, emitters, bvh }
    }

    /// Index of the nearest triangle along a ray (direction of unit length) and its distance.
    pub fn closest(&self, origin: Vec3, direction: Vec3, min: f32, max: f32) -> Option<(usize, f32)> {
        if self.triangles.is_empty() {
            return None;
        }
        let ray = Ray::new(origin.into(), direction.into(), min, max);
        let mut hit = RayHit::none();
        let found = self.bvh.ray_traverse(ray, &mut hit, |ray, id| {
            self.triangles[self.bvh.primitive_indices[id] as usize].intersect(ray)
        });
        (found && hit.t < max).then(|| (self.bvh.primitive_indices[hit.primitive_id as usize] as usize, hit.t))
    }

    /// `world_from_camera`, if there is such a camera.
    pub fn camera(&self, camera: usize) -> Option<Mat4> {
        self.cameras.get(camera).copied()
    }

    /// Radiance of every pixel, row by row from the top. Black if there is no such camera.
    pub fn image(&self, camera: usize, width: u32, height: u32, quality: Quality) -> Vec<[f32; 3]> {
        let mut pixels = vec![[0.0; 3]; (width * height) as usize];
        let Some((matrix, camera)) = self.camera(camera).zip(self.scene.cameras.get(camera)) else { return pixels };
        let threads = std::thread::available_parallelism().map_or(1, |n| n.get());
        let rows_each = height.div_ceil(threads as u32 * 4).max(1);
        let next = std::sync::atomic::AtomicU32::new(0);
        let bands: Vec<_> =
            pixels.chunks_mut((rows_each * width) as usize).map(std::sync::Mutex::new).collect();
        std::thread::scope(|scope| {
            for _ in 0..threads {
                scope.spawn(|| {
                    loop {
                        let band = next.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
                        let Some(Ok(mut rows)) = bands.get(band as usize).map(|b| b.lock()) else { return };
                        for (i, pixel) in rows.iter_mut().enumerate() {
                            let index = band * rows_each * width + i as u32;
                            let mut random = Stream(index.wrapping_mul(9781) ^ 0x5bd1_e995);
                            let mut sum = Vec3::ZERO;
                            for _ in 0..quality.samples.max(1) {
                                let at = Vec2::new(
                                    ((index % width) as f32 + random.next()) / width as f32,
                                    ((index / width) as f32 + random.next()) / height as f32,
                                );
                                let (origin, direction) =
                                    primary_ray(&camera.projection, matrix, at, width as f32 / height as f32);
                                sum += self.radiance(origin, direction, quality.bounces, &mut random);
                            }
                            *pixel = (sum / quality.samples.max(1) as f32).to_array();
                        }
                    }
                });
            }
        });
        drop(bands);
        pixels
    }

    fn radiance(&self, mut origin: Vec3, mut direction: Vec3, bounces: u32, random: &mut Stream) -> Vec3 {
        let (mut sum, mut weight, mut see_emission, mut left) = (Vec3::ZERO, Vec3::ONE, true, bounces);
        for _ in 0..=bounces + 2 {
            let Some((id, t)) = self.closest(origin, direction, 1e-4, f32::INFINITY) else {
                return sum + weight * self.sky(direction);
            };
            let hit = self.surface(id, origin + direction * t, direction);
            if see_emission && !hit.from_behind {
                sum += weight * hit.material.emissive;
            }
            let start = hit.position + hit.flat * 1e-4 * (1.0 + hit.position.abs().max_element());
            if hit.material.metallic > 0.5 {
                let spread = hit.material.roughness * hit.material.roughness;
                let mirror = direction - 2.0 * direction.dot(hit.normal) * hit.normal;
                direction = (mirror + random.sphere() * spread * 0.7).normalize_or(mirror);
                weight *= hit.albedo;
                see_emission = true;
            } else {
                sum += weight * hit.albedo / PI * (self.punctual(start, hit.normal) + self.emitted(start, hit.normal, random));
                if left == 0 {
                    return sum;
                }
                left -= 1;
                direction = (hit.normal + random.sphere()).normalize_or(hit.normal);
                weight *= hit.albedo;
                see_emission = false;
            }
            if direction.dot(hit.flat) <= 0.0 {
                return sum;
            }
            origin = start;
        }
        sum
    }

    /// Irradiance from point, spot and directional lights.
    fn punctual(&self, position: Vec3, normal: Vec3) -> Vec3 {
        let mut sum = Vec3::ZERO;
        for lamp in &self.lamps {
            let (to_light, distance, falloff) = match lamp.kind {
                LightKind::Directional => (-lamp.axis, f32::INFINITY, 1.0),
                LightKind::Point { .. } | LightKind::Spot { .. } => {
                    let way = lamp.position - position;
                    (way.normalize_or(Vec3::Y), way.length(), 1.0 / way.length_squared().max(1e-6))
                }
            };
            let cone = match lamp.kind {
                LightKind::Spot { inner, outer, .. } => {
                    let scale = 1.0 / (inner.cos() - outer.cos()).max(1e-3);
                    ((lamp.axis.dot(-to_light) - outer.cos()) * scale).clamp(0.0, 1.0).powi(2)
                }
                _ => 1.0,
            };
            let received = lamp.power * (falloff * cone * normal.dot(to_light).max(0.0));
            if received.max_element() > 0.0 && self.closest(position, to_light, 1e-4, distance - 1e-3).is_none() {
                sum += received;
            }
        }
        sum
    }

    /// Irradiance from one sampled point of the emissive triangles.
    fn emitted(&self, position: Vec3, normal: Vec3, random: &mut Stream) -> Vec3 {
        let Some(&(_, total)) = self.emitters.last() else { return Vec3::ZERO };
        let pick = random.next() * total;
        let slot = self.emitters.partition_point(|(_, sum)| *sum <= pick).min(self.emitters.len() - 1);
        let (id, _) = self.emitters[slot];
        let triangle = &self.triangles[id];
        let root = random.next().sqrt();
        let b = random.next();
        let point: Vec3 = (triangle.v0 * (1.0 - root) + triangle.v1 * (root * (1.0 - b)) + triangle.v2 * (root * b)).into();
        let emissive = self.scene.materials[self.corners[id].material as usize].emissive;
        let way = point - position;
        let (distance, to_light) = (way.length(), way.normalize_or(Vec3::Y));
        let cos_light = -Vec3::from(triangle.compute_normal()).dot(to_light);
        let cos_here = normal.dot(to_light);
        if cos_light <= 0.0 || cos_here <= 0.0 || self.closest(position, to_light, 1e-4, distance - 1e-3).is_some() {
            return Vec3::ZERO;
        }
        let density = emissive.element_sum() / total;
        emissive * (cos_light * cos_here / (distance * distance).max(1e-4) / density)
    }

    fn sky(&self, direction: Vec3) -> Vec3 {
        let Some(sky) = &self.scene.environment else { return Vec3::ZERO };
        let d = Mat3::from_rotation_y(-sky.rotation) * direction;
        let u = 0.5 + d.x.atan2(-d.z) / (2.0 * PI);
        let v = d.y.clamp(-1.0, 1.0).acos() / PI;
        let x = ((u * sky.width as f32) as u32).min(sky.width - 1);
        let y = ((v * sky.height as f32) as u32).min(sky.height - 1);
        sky.pixels[(y * sky.width + x) as usize] * sky.scale
    }

    fn surface(&self, id: usize, position: Vec3, direction: Vec3) -> Surface<'_> {
        let (triangle, corner) = (&self.triangles[id], &self.corners[id]);
        let material = &self.scene.materials[corner.material as usize];
        let [b0, b1, b2] = barycentric(triangle, position);
        let mut flat: Vec3 = Vec3::from(triangle.compute_normal());
        let mut normal = (corner.normals[0] * b0 + corner.normals[1] * b1 + corner.normals[2] * b2).normalize_or(flat);
        let uv = corner.uvs[0] * b0 + corner.uvs[1] * b1 + corner.uvs[2] * b2;
        if let Some(use_of) = &material.normal_texture {
            let texel = self.texel(use_of, uv).truncate() * 2.0 - Vec3::ONE;
            let t = corner.tangents[0];
            let bitangent = normal.cross(t.truncate()) * t.w;
            normal = (t.truncate() * texel.x + bitangent * texel.y + normal * texel.z).normalize_or(normal);
        }
        let from_behind = flat.dot(direction) > 0.0;
        if from_behind {
            (flat, normal) = (-flat, -normal);
        }
        let mut albedo = material.base_color.truncate() * (corner.colors[0] * b0 + corner.colors[1] * b1 + corner.colors[2] * b2);
        if let Some(use_of) = &material.base_color_texture {
            let linear = |c: f32| if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) };
            let texel = self.texel(use_of, uv);
            albedo *= Vec3::new(linear(texel.x), linear(texel.y), linear(texel.z));
        }
        Surface { position, flat, normal, albedo, material, from_behind: from_behind && !material.double_sided }
    }

    fn texel(&self, use_of: &TextureRef, uv: Vec2) -> Vec4 {
        let texture = &self.scene.textures[use_of.texture as usize];
        let [a, b, c, d, tx, ty] = use_of.transform;
        let at = Vec2::new(a * uv.x + b * uv.y + tx, c * uv.x + d * uv.y + ty);
        let wrapped = (at - at.floor()) * Vec2::new(texture.width as f32, texture.height as f32);
        let (x, y) = ((wrapped.x as u32).min(texture.width - 1), (wrapped.y as u32).min(texture.height - 1));
        Vec4::from(texture.rgba[(y * texture.width + x) as usize].map(|c| f32::from(c) / 255.0))
    }
}

struct Surface<'a> {
    position: Vec3,
    /// Normal of the triangle, towards the ray.
    flat: Vec3,
    normal: Vec3,
    albedo: Vec3,
    material: &'a Material,
    from_behind: bool,
}

fn area(triangle: &Triangle) -> f32 {
    (triangle.v1 - triangle.v0).cross(triangle.v2 - triangle.v0).length() * 0.5
}

fn barycentric(triangle: &Triangle, position: Vec3) -> [f32; 3] {
    let (e1, e2) = (triangle.v1 - triangle.v0, triangle.v2 - triangle.v0);
    let way = Vec3A::from(position) - triangle.v0;
    let (d11, d12, d22) = (e1.dot(e1), e1.dot(e2), e2.dot(e2));
    let (w1, w2) = (way.dot(e1), way.dot(e2));
    let scale = 1.0 / (d11 * d22 - d12 * d12).max(1e-20);
    let (b1, b2) = ((d22 * w1 - d12 * w2) * scale, (d11 * w2 - d12 * w1) * scale);
    [1.0 - b1 - b2, b1, b2]
}

/// Origin and unit direction of the ray through `at` (0 to 1, from the top left).
fn primary_ray(projection: &Projection, matrix: Mat4, at: Vec2, aspect_of_image: f32) -> (Vec3, Vec3) {
    let ndc = Vec2::new(at.x * 2.0 - 1.0, 1.0 - at.y * 2.0);
    let (origin, direction) = match *projection {
        Projection::Perspective { yfov, aspect, .. } => {
            let tan = (yfov * 0.5).tan();
            (Vec3::ZERO, Vec3::new(ndc.x * tan * aspect.unwrap_or(aspect_of_image), ndc.y * tan, -1.0))
        }
        Projection::Orthographic { xmag, ymag, .. } => (Vec3::new(ndc.x * xmag, ndc.y * ymag, 0.0), Vec3::NEG_Z),
    };
    (matrix.transform_point3(origin), matrix.transform_vector3(direction).normalize_or(Vec3::NEG_Z))
}

/// A small generator; every pixel has its own.
struct Stream(u32);

impl Stream {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let word = ((self.0 >> ((self.0 >> 28) + 4)) ^ self.0).wrapping_mul(277_803_737);
        (((word >> 22) ^ word) >> 8) as f32 / (1 << 24) as f32
    }

    /// Uniform on the unit sphere.
    fn sphere(&mut self) -> Vec3 {
        let z = self.next() * 2.0 - 1.0;
        let (sin, cos) = (self.next() * 2.0 * PI).sin_cos();
        let r = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(r * cos, r * sin, z)
    }
}

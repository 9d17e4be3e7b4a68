//! A plain CPU path tracer: the slow and obvious ground truth that GPU techniques are held against in tests.
//!
//! It knows what the real-time techniques know: Lambert reflection of punctual lights, emissive surfaces and the
//! environment, with the light's way kept apart in [`Layers`]. Direct light has the GGX lobe too; bounces are diffuse.

mod surface;

use crate::scene::{Light, LightKind, Pose, Scene, View, bvh::Bvh, bvh::Ray, bvh::Step};
use glam::{Mat4, Vec3};
use std::sync::atomic::{AtomicUsize, Ordering};
use surface::{Face, Surfaces};

/// What to trace.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Paths a pixel.
    pub samples: u32,
    /// Diffuse bounces after the first surface: 0 gives direct light only, 1 is what one image-space pass models.
    pub bounces: u32,
    pub seed: u32,
    /// Whether direct light has a specular lobe.
    pub specular: bool,
    /// Whether rays go through random places of the pixel (box filter) or all through its centre, as a rasteriser's do.
    pub jitter: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self { samples: 64, bounces: 1, seed: 0, specular: true, jitter: false }
    }
}

/// Radiance towards the camera, W/(sr·m²), by the way that the light took. Row by row, top row first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layers {
    /// Punctual lights → surface → camera.
    pub direct: Vec<Vec3>,
    /// Punctual lights → surfaces → surface → camera: diffuse bounces of the lights that `direct` shows.
    pub indirect: Vec<Vec3>,
    /// Emission of the surface itself, and of the environment where no surface is.
    pub emitted: Vec<Vec3>,
    /// Emissive surfaces → any number of bounces → camera.
    pub area: Vec<Vec3>,
    /// Environment → any number of bounces → camera.
    pub sky: Vec<Vec3>,
    /// Diffuse albedo at the first surface; zero where there is none.
    pub albedo: Vec<Vec3>,
    /// Distance along the line of sight, metres; infinite where there is no surface.
    pub depth: Vec<f32>,
}

impl Layers {
    /// Everything together.
    pub fn total(&self) -> Vec<Vec3> {
        (0..self.direct.len())
            .map(|i| self.direct[i] + self.indirect[i] + self.emitted[i] + self.area[i] + self.sky[i])
            .collect()
    }
}

/// One pixel's sums.
#[derive(Clone, Copy, Debug, Default)]
struct Pixel {
    direct: Vec3,
    indirect: Vec3,
    emitted: Vec3,
    area: Vec3,
    sky: Vec3,
    albedo: Vec3,
    depth: f32,
}

/// Traces `scene` in `pose` through `view`, on all cores. `bvh` must have been built from both. The result depends only on
/// the arguments, not on the number of cores.
pub fn trace(scene: &Scene, pose: &Pose, bvh: &Bvh, view: &View, settings: &Settings) -> Layers {
    let [width, height] = view.extent.map(|e| e as usize);
    let tracer = Tracer {
        bvh,
        scene,
        surfaces: Surfaces::new(scene, pose, bvh),
        lights: placed_lights(scene, pose),
        world_from_view: view.view_from_world.inverse(),
        view,
        settings,
    };
    let next = AtomicUsize::new(0);
    let workers = std::thread::available_parallelism().map_or(1, usize::from);
    let work = || {
        let mut rows = Vec::new();
        loop {
            let y = next.fetch_add(1, Ordering::Relaxed);
            if y >= height {
                return rows;
            }
            rows.push((y, (0..width).map(|x| tracer.pixel(x, y)).collect::<Vec<Pixel>>()));
        }
    };
    let mut rows: Vec<(usize, Vec<Pixel>)> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..workers).map(|_| scope.spawn(work)).collect();
        // A worker that panicked has a bug; pass it on instead of hiding it.
        threads.into_iter().flat_map(|t| t.join().unwrap_or_else(|e| std::panic::resume_unwind(e))).collect()
    });
    rows.sort_by_key(|(y, _)| *y);
    let mut layers = Layers::default();
    for pixel in rows.into_iter().flat_map(|(_, row)| row) {
        layers.direct.push(pixel.direct);
        layers.indirect.push(pixel.indirect);
        layers.emitted.push(pixel.emitted);
        layers.area.push(pixel.area);
        layers.sky.push(pixel.sky);
        layers.albedo.push(pixel.albedo);
        layers.depth.push(pixel.depth);
    }
    layers
}

/// A light in world space.
struct Placed<'a> {
    light: &'a Light,
    position: Vec3,
    direction: Vec3,
}

fn placed_lights<'a>(scene: &'a Scene, pose: &Pose) -> Vec<Placed<'a>> {
    let place = |(node, world): (&crate::scene::Node, &Mat4)| {
        Some(Placed {
            light: &scene.lights[node.light? as usize],
            position: world.w_axis.truncate(),
            direction: world.transform_vector3(Vec3::NEG_Z).normalize_or(Vec3::NEG_Z),
        })
    };
    scene.nodes.iter().zip(&pose.world).filter_map(place).collect()
}

impl Placed<'_> {
    /// Direction to the light, distance, irradiance on a facing plane (KHR_lights_punctual).
    fn at(&self, p: Vec3) -> (Vec3, f32, Vec3) {
        let power = self.light.color * self.light.intensity;
        let (range, cone) = match self.light.kind {
            LightKind::Directional => return (-self.direction, f32::INFINITY, power),
            LightKind::Point { range } => (range, None),
            LightKind::Spot { range, inner, outer } => (range, Some((inner, outer))),
        };
        let to = self.position - p;
        let distance = to.length().max(1e-4);
        let to = to / distance;
        let window = range.map_or(1.0, |r| (1.0 - (distance / r).powi(4)).clamp(0.0, 1.0));
        let cone = cone.map_or(1.0, |(inner, outer)| {
            let (cos, inner, outer) = (-to.dot(self.direction), inner.cos(), outer.cos());
            ((cos - outer) / (inner - outer).max(1e-3)).clamp(0.0, 1.0).powi(2)
        });
        (to, distance, power * (window * cone / (distance * distance)))
    }
}

struct Tracer<'a> {
    bvh: &'a Bvh,
    scene: &'a Scene,
    surfaces: Surfaces<'a>,
    lights: Vec<Placed<'a>>,
    world_from_view: Mat4,
    view: &'a View,
    settings: &'a Settings,
}

impl Tracer<'_> {
    fn pixel(&self, x: usize, y: usize) -> Pixel {
        let mut sum = Pixel::default();
        let index = y as u32 * self.view.extent[0] + x as u32;
        let samples = self.settings.samples.max(1);
        let mut random = Random::new(index, self.settings.seed);
        for _ in 0..samples {
            let place = if self.settings.jitter { (random.next(), random.next()) } else { (0.5, 0.5) };
            self.path(&self.camera_ray(x as f32 + place.0, y as f32 + place.1), &mut random, &mut sum);
        }
        let n = 1.0 / samples as f32;
        Pixel {
            direct: sum.direct * n,
            indirect: sum.indirect * n,
            emitted: sum.emitted * n,
            area: sum.area * n,
            sky: sum.sky * n,
            albedo: sum.albedo * n,
            depth: sum.depth * n,
        }
    }

    /// Through image position (x, y) in pixels, y down.
    fn camera_ray(&self, x: f32, y: f32) -> Ray {
        let [width, height] = self.view.extent.map(|e| e as f32);
        let clip = &self.view.clip_from_view;
        // Undoes the projection's scale; both kinds of projection are symmetric.
        let sx = (2.0 * x / width - 1.0) / clip.x_axis.x;
        let sy = (1.0 - 2.0 * y / height) / clip.y_axis.y;
        let (origin, direction) = if self.view.is_orthographic() {
            (Vec3::new(sx, sy, 0.0), Vec3::NEG_Z)
        } else {
            (Vec3::ZERO, Vec3::new(sx, sy, -1.0))
        };
        // The direction's length along the axis is 1: t is linear depth in metres.
        Ray {
            origin: self.world_from_view.transform_point3(origin),
            direction: self.world_from_view.transform_vector3(direction),
            t_min: self.view.near,
            t_max: self.view.far,
        }
    }

    fn path(&self, camera: &Ray, random: &mut Random, out: &mut Pixel) {
        let mut ray = *camera;
        let mut throughput = Vec3::ONE;
        for bounce in 0..=self.settings.bounces {
            let Some(hit) = self.nearest(&ray, bounce == 0, random) else {
                let sky = throughput * self.environment(ray.direction);
                if bounce == 0 {
                    out.emitted += sky;
                    out.depth = f32::INFINITY;
                } else {
                    out.sky += sky;
                }
                return;
            };
            let face = self.surfaces.at(hit.triangle, hit.u, hit.v, -ray.direction.normalize());
            let direct = throughput * self.direct(&face, self.settings.specular && bounce == 0, random);
            let emission = throughput * face.emission;
            if bounce == 0 {
                out.depth += hit.t;
                out.albedo += face.albedo;
                out.direct += direct;
                out.emitted += emission;
            } else {
                out.indirect += direct;
                out.area += emission;
            }
            if face.unlit || bounce == self.settings.bounces {
                return;
            }
            // Cosine-distributed direction: albedo/π · cos / (cos/π) = albedo.
            throughput *= face.albedo;
            if throughput == Vec3::ZERO {
                return;
            }
            let direction = cosine_direction(face.normal, random.next(), random.next());
            if direction.dot(face.geometric) <= 0.0 {
                // Below the true surface: a shading normal let it through, no light comes from there.
                return;
            }
            ray = Ray::new(face.lifted(), direction);
        }
    }

    /// Reflected light of all punctual lights. With or without the specular lobe.
    fn direct(&self, face: &Face, specular: bool, random: &mut Random) -> Vec3 {
        if face.unlit {
            return Vec3::ZERO;
        }
        let mut sum = Vec3::ZERO;
        for light in &self.lights {
            let (to, distance, irradiance) = light.at(face.position);
            let cosine = face.normal.dot(to);
            if cosine <= 0.0 || irradiance == Vec3::ZERO || face.geometric.dot(to) <= 0.0 {
                continue;
            }
            let origin = face.lifted();
            let shadow = Ray { origin, direction: to, t_min: 0.0, t_max: distance * (1.0 - 1e-4) };
            if self.blocked(&shadow, random) {
                continue;
            }
            let lambert = face.albedo * (cosine / std::f32::consts::PI);
            let lobe = if specular { face.specular(to) } else { Vec3::ZERO };
            sum += irradiance * (lambert + lobe);
        }
        sum
    }

    fn nearest(&self, ray: &Ray, primary: bool, random: &mut Random) -> Option<crate::scene::bvh::Hit> {
        let mut best = None;
        self.bvh.walk(ray, |hit| {
            if primary && self.surfaces.is_hidden_back(hit.triangle, ray.direction) {
                return Step::Ignore;
            }
            if !self.surfaces.is_there(hit.triangle, hit.u, hit.v, random.hashed(hit.triangle)) {
                return Step::Ignore;
            }
            best = Some(hit);
            Step::Nearer
        });
        best
    }

    fn blocked(&self, ray: &Ray, random: &mut Random) -> bool {
        let mut found = false;
        let salt = random.next();
        self.bvh.walk(ray, |hit| {
            if self.surfaces.casts(hit.triangle)
                && self.surfaces.is_there(hit.triangle, hit.u, hit.v, hash_to_unit(hit.triangle, salt.to_bits()))
            {
                found = true;
                return Step::End;
            }
            Step::Ignore
        });
        found
    }

    fn environment(&self, direction: Vec3) -> Vec3 {
        self.scene.environment.as_ref().map_or(Vec3::ZERO, |e| surface::environment(e, direction.normalize()))
    }
}

/// A direction around `n` with density cos/π (Malley's method).
fn cosine_direction(n: Vec3, a: f32, b: f32) -> Vec3 {
    let (r, phi) = (a.sqrt(), std::f32::consts::TAU * b);
    let (x, y) = n.any_orthonormal_pair();
    (x * (r * phi.cos()) + y * (r * phi.sin()) + n * (1.0 - a).max(0.0).sqrt()).normalize()
}

/// PCG (O'Neill 2014), one stream a pixel.
struct Random(u64);

impl Random {
    fn new(pixel: u32, seed: u32) -> Self {
        let mut random = Self((u64::from(seed) << 32 | u64::from(pixel)).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        random.next();
        random
    }

    /// In [0, 1).
    fn next(&mut self) -> f32 {
        let state = self.0;
        self.0 = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let word = (((state >> ((state >> 59) + 5)) ^ state).wrapping_mul(12_605_985_483_714_917_081) >> 32) as u32;
        (word >> 8) as f32 / (1 << 24) as f32
    }

    /// In [0, 1), the same for one triangle along one ray.
    fn hashed(&self, triangle: u32) -> f32 {
        hash_to_unit(triangle, (self.0 >> 32) as u32)
    }
}

fn hash_to_unit(a: u32, b: u32) -> f32 {
    let mut h = a.wrapping_mul(0x85eb_ca6b) ^ b;
    h = (h ^ h >> 16).wrapping_mul(0x7feb_352d);
    h = (h ^ h >> 15).wrapping_mul(0x846c_a68b);
    ((h ^ h >> 16) >> 8) as f32 / (1 << 24) as f32
}

#[cfg(test)]
mod tests;

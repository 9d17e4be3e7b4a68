//! A plain CPU path tracer: the slow and obvious ground truth that GPU techniques and the GPU path tracer are held against.
//!
//! Transport: a matt base under microfacets as [`brdf`](super::brdf) has it, for direct light and at every bounce; mirrors
//! (`roughness < 0.05 && metallic > 0.5`) and glass (`transmission`) are sharp; punctual lights, emissive surfaces, the
//! environment. Light of an extent is found by scattered rays that happen to meet it; emissive surfaces can be sampled by their
//! area instead ([`Settings::sample_lamps`]). There is no weighting between strategies, no roulette, no clamping.
//! Unlit surfaces are seen, also in mirrors and through glass, and are not there for light.

mod lights;
mod random;
mod scatter;

use crate::scene::{
    Pose, Scene, View,
    bvh::{Bvh, Hit, Ray, Step},
    surfaces::{self, Face, Surfaces},
};
use glam::{Mat4, Vec3};
pub use lights::Law;
use lights::{Lamps, Placed};
use random::{Random, hash_to_unit};
use scatter::Event;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Which lights there are. Those left out neither light nor show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sources {
    /// Point, spot and directional lights.
    pub punctual: bool,
    /// Emissive surfaces, and unlit ones.
    pub emissive: bool,
    pub environment: bool,
}

impl Sources {
    pub const ALL: Self = Self { punctual: true, emissive: true, environment: true };
    pub const PUNCTUAL: Self = Self { punctual: true, emissive: false, environment: false };
    pub const EMISSIVE: Self = Self { punctual: false, emissive: true, environment: false };
    pub const ENVIRONMENT: Self = Self { punctual: false, emissive: false, environment: true };
}

/// What to trace.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Paths a pixel.
    pub samples: u32,
    /// Scatterings after the first surface: 0 gives direct light only, 1 is what one image-space pass models.
    pub bounces: u32,
    /// Mirrors and glass that a path may meet, beside `bounces`.
    pub specular_bounces: u32,
    pub seed: u32,
    /// Every surface reflects by Lambert's law alone: no gloss, no mirrors, no glass.
    pub diffuse_only: bool,
    /// Whether rays go through random places of the pixel (box filter) or all through its centre, as a rasteriser's do.
    pub jitter: bool,
    pub sources: Sources,
    /// How punctual lights fall off.
    pub law: Law,
    /// Direct light of emissive surfaces from points on them instead of from scattered rays: less noise with small lamps.
    pub sample_lamps: bool,
    /// Surfaces that the camera does not see send nothing: as much as a method can know that has only the picture.
    pub seen_senders_only: bool,
    /// Only the middle pixels of squares of this size are traced; the others stay black.
    pub every: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            samples: 64,
            bounces: 1,
            specular_bounces: 8,
            seed: 0,
            diffuse_only: false,
            jitter: false,
            sources: Sources::ALL,
            law: Law::Physical,
            sample_lamps: false,
            seen_senders_only: false,
            every: 1,
        }
    }
}

/// Radiance towards the camera, W/(sr·m²), by the way that the light took, and what is seen. Row by row, top row first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layers {
    /// Seen directly, in mirrors or through glass, with the environment behind everything.
    pub emission: Vec<Vec3>,
    /// Any light, scattered once.
    pub direct: Vec<Vec3>,
    /// Any light, scattered more than once.
    pub indirect: Vec<Vec3>,
    /// Mean diffuse albedo at the first surface; zero where there is none.
    pub albedo: Vec<Vec3>,
    /// Mean shading normal there, world space.
    pub normal: Vec<Vec3>,
    /// Mean place, metres.
    pub position: Vec<Vec3>,
    /// Mean distance along the line of sight, metres; infinite where there is no surface.
    pub depth: Vec<f32>,
    /// Of each layer and of the total, by channel: variance of the mean.
    pub variance: Variances,
}

/// Variance of the mean, estimated from the samples.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Variances {
    pub emission: Vec<Vec3>,
    pub direct: Vec<Vec3>,
    pub indirect: Vec<Vec3>,
    pub total: Vec<Vec3>,
}

impl Layers {
    /// Everything together.
    pub fn total(&self) -> Vec<Vec3> {
        (0..self.direct.len()).map(|i| self.emission[i] + self.direct[i] + self.indirect[i]).collect()
    }
}

/// What one path brought.
#[derive(Clone, Copy, Debug, Default)]
struct Sample {
    emission: Vec3,
    direct: Vec3,
    indirect: Vec3,
    albedo: Vec3,
    normal: Vec3,
    position: Vec3,
    depth: f32,
}

impl Sample {
    /// The layer of light that was scattered so often.
    fn layer(&mut self, scatterings: u32) -> &mut Vec3 {
        match scatterings {
            0 => &mut self.emission,
            1 => &mut self.direct,
            _ => &mut self.indirect,
        }
    }
}

/// Sums over the samples of a pixel, and of their squares.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    sum: [glam::DVec3; 7],
    squares: [glam::DVec3; 4],
    depth: f64,
    count: u32,
}

impl Sums {
    fn add(&mut self, s: &Sample) {
        let total = s.emission + s.direct + s.indirect;
        let values = [s.emission, s.direct, s.indirect, total, s.albedo, s.normal, s.position].map(Vec3::as_dvec3);
        for (sum, value) in self.sum.iter_mut().zip(values) {
            *sum += value;
        }
        for (sum, value) in self.squares.iter_mut().zip(values) {
            *sum += value * value;
        }
        self.depth += f64::from(s.depth);
        self.count += 1;
    }

    fn mean(&self, i: usize) -> Vec3 {
        (self.sum[i] / f64::from(self.count.max(1))).as_vec3()
    }

    fn variance(&self, i: usize) -> Vec3 {
        let n = f64::from(self.count.max(1));
        let mean = self.sum[i] / n;
        ((self.squares[i] / n - mean * mean).max(glam::DVec3::ZERO) / (n - 1.0).max(1.0)).as_vec3()
    }
}

/// Traces `scene` in `pose` through `view`, on all cores. `bvh` must have been built from both. The result depends only on
/// the arguments, not on the number of cores.
pub fn trace(scene: &Scene, pose: &Pose, bvh: &Bvh, view: &View, settings: &Settings) -> Layers {
    let [width, height] = view.extent.map(|e| e as usize);
    let surfaces = Surfaces::new(scene, pose, bvh);
    let lamps = Lamps::new(bvh, &surfaces);
    let Settings { jitter, diffuse_only, sources, seen_senders_only, .. } = *settings;
    let shining = (sources.environment && scene.environment.is_some()) || (sources.emissive && lamps.area() > 0.0);
    let tracer = Tracer {
        bvh,
        scene,
        fixed_start: !jitter && surfaces.is_certain(),
        last_ray_meets_nothing: diffuse_only && !seen_senders_only && !shining,
        lamps,
        surfaces,
        lights: lights::placed(scene, pose, settings.law),
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
            rows.push((y, (0..width).map(|x| tracer.pixel(x, y)).collect::<Vec<Sums>>()));
        }
    };
    let mut rows: Vec<(usize, Vec<Sums>)> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..workers).map(|_| scope.spawn(work)).collect();
        // A worker that panicked has a bug; pass it on instead of hiding it.
        threads.into_iter().flat_map(|t| t.join().unwrap_or_else(|e| std::panic::resume_unwind(e))).collect()
    });
    rows.sort_by_key(|(y, _)| *y);
    let pixels: Vec<Sums> = rows.into_iter().flat_map(|(_, row)| row).collect();
    let means = |i: usize| pixels.iter().map(|p| p.mean(i)).collect();
    let variances = |i: usize| pixels.iter().map(|p| p.variance(i)).collect();
    Layers {
        emission: means(0),
        direct: means(1),
        indirect: means(2),
        albedo: means(4),
        normal: means(5),
        position: means(6),
        depth: pixels.iter().map(|p| (p.depth / f64::from(p.count.max(1))) as f32).collect(),
        variance: Variances {
            emission: variances(0),
            direct: variances(1),
            indirect: variances(2),
            total: variances(3),
        },
    }
}

/// The start of a path.
struct First {
    ray: Ray,
    /// What all paths of a pixel have in common, where they have.
    known: Option<Known>,
}

/// What a ray through a pixel finds, if neither the ray nor what is there depends on chance. Paths take as many random numbers with it
/// as without.
struct Known {
    found: Option<(Face, f32)>,
    /// Light that punctual lights send by that place, and the rays that were asked for it.
    punctual: Vec3,
    rays: u32,
}

struct Tracer<'a> {
    bvh: &'a Bvh,
    scene: &'a Scene,
    /// All paths of a pixel begin alike.
    fixed_start: bool,
    /// Nothing shines that the ray after the last scattering could meet.
    last_ray_meets_nothing: bool,
    surfaces: Surfaces<'a>,
    lights: Vec<Placed<'a>>,
    lamps: Lamps,
    world_from_view: Mat4,
    view: &'a View,
    settings: &'a Settings,
}

impl Tracer<'_> {
    fn pixel(&self, x: usize, y: usize) -> Sums {
        let mut sums = Sums::default();
        let every = self.settings.every.max(1) as usize;
        if [x, y].iter().any(|i| i % every != every / 2) {
            return sums;
        }
        let index = y as u32 * self.view.extent[0] + x as u32;
        let mut random = Random::new(index, self.settings.seed);
        let (x, y) = (x as f32, y as f32);
        let fixed = self.fixed_start.then(|| self.first(self.camera_ray(x + 0.5, y + 0.5)));
        for _ in 0..self.settings.samples.max(1) {
            let sample = match &fixed {
                Some(first) => self.path(first, &mut random),
                None => {
                    let (a, b) = if self.settings.jitter { (random.next(), random.next()) } else { (0.5, 0.5) };
                    self.path(&First { ray: self.camera_ray(x + a, y + b), known: None }, &mut random)
                }
            };
            sums.add(&sample);
        }
        sums
    }

    /// What all paths of a pixel begin with; only if nothing there depends on chance.
    fn first(&self, ray: Ray) -> First {
        let mut unused = Random::new(0, 0);
        let found = self.found(&ray, true, false, &mut unused);
        let (punctual, rays) = found.as_ref().map_or((Vec3::ZERO, 0), |(face, _)| self.punctual(face, &mut unused));
        First { ray, known: Some(Known { found, punctual, rays }) }
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

    fn path(&self, first: &First, random: &mut Random) -> Sample {
        let Settings { bounces, specular_bounces, diffuse_only, sources, sample_lamps, .. } = *self.settings;
        let mut out = Sample { depth: f32::INFINITY, ..Sample::default() };
        let mut ray = first.ray;
        let mut throughput = Vec3::ONE;
        let (mut scatterings, mut sharp_events) = (0, 0);
        // Whether points on lamps were already asked for the light that this ray may meet.
        let mut lamps_asked = false;
        for event in 0.. {
            let known = first.known.as_ref().filter(|_| event == 0);
            let found = match known {
                Some(known) => {
                    random.skip(1);
                    known.found
                }
                None => self.found(&ray, event == 0, scatterings > 0, random),
            };
            let Some((face, distance)) = found else {
                if sources.environment {
                    *out.layer(scatterings) += throughput * self.environment(ray.direction);
                }
                return out;
            };
            if event == 0 {
                (out.albedo, out.normal, out.position, out.depth) = (face.albedo, face.normal, face.position, distance);
            }
            if scatterings > 0 && self.settings.seen_senders_only && !self.is_seen(&face, random) {
                return out;
            }
            if sources.emissive && !lamps_asked {
                *out.layer(scatterings) += throughput * face.emission;
            }
            if face.unlit {
                return out;
            }
            match face.event(diffuse_only, random) {
                Event::None => return out,
                Event::Sharp { origin, direction, share } => {
                    if sharp_events == specular_bounces {
                        return out;
                    }
                    sharp_events += 1;
                    throughput *= share;
                    ray = Ray::new(origin, direction);
                    lamps_asked = false;
                }
                Event::Rough => {
                    if scatterings > bounces {
                        return out;
                    }
                    scatterings += 1;
                    if sources.punctual {
                        let light = match known {
                            Some(known) => {
                                random.skip(known.rays);
                                known.punctual
                            }
                            None => self.punctual(&face, random).0,
                        };
                        *out.layer(scatterings) += throughput * light;
                    }
                    if sources.emissive && sample_lamps {
                        *out.layer(scatterings) += throughput * self.lamp(&face, random);
                        lamps_asked = true;
                    }
                    let Some((direction, weight)) = face.scatter(diffuse_only, random) else { return out };
                    throughput *= weight;
                    ray = Ray::new(face.lifted(), direction);
                    if scatterings > bounces && self.last_ray_meets_nothing {
                        random.skip(1);
                        return out;
                    }
                }
            }
        }
        out
    }

    /// The nearest surface, and how far away in lengths of the ray's direction.
    fn found(&self, ray: &Ray, camera: bool, light: bool, random: &mut Random) -> Option<(Face, f32)> {
        let hit = self.nearest(ray, camera, light, random)?;
        Some((self.surfaces.at(hit.triangle, hit.u, hit.v, -ray.direction.normalize()), hit.t))
    }

    /// Reflected light of all punctual lights, and how many rays it took.
    fn punctual(&self, face: &Face, random: &mut Random) -> (Vec3, u32) {
        let (mut sum, mut rays) = (Vec3::ZERO, 0);
        for light in &self.lights {
            let (to, distance, irradiance) = light.at(face.position);
            let reflected = face.rough(to, self.settings.diffuse_only) * irradiance;
            if reflected == Vec3::ZERO {
                continue;
            }
            rays += 1;
            if !self.blocked(face.lifted(), to, distance * (1.0 - 1e-4), random) {
                sum += reflected;
            }
        }
        (sum, rays)
    }

    /// Reflected light of one point on all emissive surfaces.
    fn lamp(&self, face: &Face, random: &mut Random) -> Vec3 {
        let Some(point) = self.lamps.sample(self.bvh, [random.next(), random.next(), random.next()]) else {
            return Vec3::ZERO;
        };
        let way = point.position - face.position;
        let (distance, to) = (way.length(), way.normalize_or_zero());
        let reflected = face.rough(to, self.settings.diffuse_only);
        let source = self.surfaces.at(point.triangle, point.u, point.v, -to);
        if reflected == Vec3::ZERO || source.emission == Vec3::ZERO {
            return Vec3::ZERO;
        }
        if !self.surfaces.is_there(point.triangle, point.u, point.v, random.next()) {
            return Vec3::ZERO;
        }
        // A whole triangle in front of itself is no shadow.
        let end = distance - 1e-4 * (1.0 + distance);
        if self.blocked(face.lifted(), to, end, random) {
            return Vec3::ZERO;
        }
        // Density by area, turned into one by solid angle.
        reflected * source.emission * (self.lamps.area() * point.normal.dot(to).abs() / (distance * distance))
    }

    /// Does the camera see this point?
    fn is_seen(&self, face: &Face, random: &mut Random) -> bool {
        let clip = self.view.clip_from_world * face.position.extend(1.0);
        if clip.w <= 0.0 || clip.x.abs() > clip.w || clip.y.abs() > clip.w {
            return false;
        }
        let [.., forward] = self.view.axes();
        let from = match self.view.is_orthographic() {
            true => face.position - forward * forward.dot(face.position - self.view.position),
            false => self.view.position,
        };
        let ray = Ray { t_max: 1.0 - 1e-3, ..Ray::new(from, face.position - from) };
        self.nearest(&ray, true, false, random).is_none()
    }

    /// The nearest surface. Camera rays do not see the backs of single-sided surfaces, light does not see unlit ones.
    fn nearest(&self, ray: &Ray, camera: bool, light: bool, random: &mut Random) -> Option<Hit> {
        let mut best = None;
        let salt = random.salt();
        self.bvh.walk(ray, |hit| {
            let absent = (camera && self.surfaces.is_hidden_back(hit.triangle, ray.direction))
                || (light && !self.surfaces.casts(hit.triangle))
                || !self.surfaces.is_there(hit.triangle, hit.u, hit.v, hash_to_unit(hit.triangle, salt));
            if absent {
                return Step::Ignore;
            }
            best = Some(hit);
            Step::Nearer
        });
        best
    }

    fn blocked(&self, origin: Vec3, direction: Vec3, t_max: f32, random: &mut Random) -> bool {
        self.nearest(&Ray { origin, direction, t_min: 0.0, t_max }, false, true, random).is_some()
    }

    fn environment(&self, direction: Vec3) -> Vec3 {
        self.scene.environment.as_ref().map_or(Vec3::ZERO, |e| surfaces::environment(e, direction.normalize()))
    }
}

#[cfg(test)]
mod tests;

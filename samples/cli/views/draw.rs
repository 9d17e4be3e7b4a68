//! Random views that show something.
//!
//! Positions are uniform in the scene's bounding box, enlarged by [`ROOM`] to the sides and above. Directions are uniform in azimuth
//! and in elevation ([`PITCH`] degrees); the vertical angle of view is uniform in [`YFOV`] degrees. CPU rays then reject views for
//! these reasons; all lengths are relative to the diagonal of the scene's box:
//!
//! - *inside geometry*: of [`AROUND`] rays evenly around the position, more than [`MOST_BACKS`] hit the back of a single-sided
//!   surface, or one hits any surface nearer than [`CLEARANCE`];
//! - *mostly sky*: of [`RAYS`] rays through the picture, more than [`MOST_SKY`] hit no surface;
//! - *seen from behind*: more than [`MOST_BEHIND`] of them hit the back of a single-sided surface, which a rasteriser does not draw;
//! - *into a wall*: the nearest hit is nearer than [`NEAREST`], the median is farther than [`FARTHEST`] or nearer than [`MEDIAN`], or
//!   fewer than [`SURFACES`] different planes cover at least [`SHARE`] of the picture each;
//! - *in the dark*: in scenes with lights, less than [`LEAST_LIT`] of the hit surfaces receive light or are lamps.

use std::collections::HashMap;

use glam::{Mat4, Vec3};
use lucerna::{
    Error, Result,
    scene::{
        LightKind, Pose, Scene,
        bvh::{Bvh, Ray},
    },
};

use super::{NamedView, Origin};

/// Share of the diagonal by which the box is larger than the scene.
pub const ROOM: f32 = 0.1;
/// Lowest and highest elevation of the line of sight, degrees.
pub const PITCH: [f32; 2] = [-45.0, 20.0];
/// Smallest and largest vertical angle of view, degrees.
pub const YFOV: [f32; 2] = [40.0, 65.0];
/// Number of rays around the position.
pub const AROUND: u32 = 64;
/// Maximum share of the rays around the position that may hit backs.
pub const MOST_BACKS: f32 = 0.45;
/// Minimum distance to any surface around.
pub const CLEARANCE: f32 = 0.01;
/// Rays through the picture, across and down.
pub const RAYS: [u32; 2] = [16, 12];
/// Maximum share of the rays through the picture that may hit no surface.
pub const MOST_SKY: f32 = 0.4;
/// Maximum share of the rays through the picture that may hit backs.
pub const MOST_BEHIND: f32 = 0.01;
/// Minimum distance of the nearest hit.
pub const NEAREST: f32 = 0.015;
/// Minimum median distance; the maximum is [`FARTHEST`].
pub const MEDIAN: f32 = 0.05;
pub const FARTHEST: f32 = 1.5;
/// Minimum number of planes in the picture.
pub const SURFACES: usize = 6;
/// Minimum share of the picture that each of these planes covers.
pub const SHARE: f32 = 0.015;
/// Minimum share of the hit surfaces that must be lit.
pub const LEAST_LIT: f32 = 0.15;
/// Width over height of the pictures.
pub const ASPECT: f32 = 4.0 / 3.0;
/// Maximum of positions that are tried per requested view.
const PATIENCE: u64 = 4000;

/// The reason for rejecting a view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    InsideGeometry,
    MostlySky,
    SeenFromBehind,
    IntoAWall,
    InTheDark,
}

/// SplitMix64 (Steele et al. 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ z >> 31) >> 40) as f32 / (1u64 << 24) as f32
    }

    fn between(&mut self, [low, high]: [f32; 2]) -> f32 {
        low + (high - low) * self.next()
    }
}

/// Decides which views are good, by tracing rays through the scene.
pub struct Judge<'a> {
    scene: &'a Scene,
    bvh: Bvh,
    lamps: Vec<Lamp>,
    min: Vec3,
    max: Vec3,
}

/// A light in world space: its position, or the direction to a distant light, and the cone of a spot light.
enum Lamp {
    At(Vec3, Option<(Vec3, f32)>),
    Towards(Vec3),
}

fn lamps(scene: &Scene, pose: &Pose) -> Vec<Lamp> {
    let lit = |(node, world): (&lucerna::scene::Node, &Mat4)| {
        let light = scene.lights.get(node.light? as usize)?;
        let axis = -world.z_axis.truncate().normalize_or(Vec3::Z);
        let at = world.w_axis.truncate();
        Some(match light.kind {
            LightKind::Directional => Lamp::Towards(-axis),
            LightKind::Point { .. } => Lamp::At(at, None),
            LightKind::Spot { outer, .. } => Lamp::At(at, Some((axis, outer.cos()))),
        })
    };
    scene.nodes.iter().zip(&pose.world).filter_map(lit).collect()
}

/// The hit of a ray.
struct Seen {
    distance: f32,
    /// Unit, towards the ray.
    normal: Vec3,
    /// The back of a single-sided surface.
    back: bool,
    emissive: bool,
}

impl<'a> Judge<'a> {
    /// # Errors
    /// `Input` if the scene has no surface.
    pub fn new(scene: &'a Scene, pose: &Pose) -> Result<Self> {
        let bvh = Bvh::build(scene, pose);
        let (min, max) = bvh.bounds().ok_or_else(|| Error::input("the scene has no surface to look at"))?;
        Ok(Self { scene, bvh, lamps: lamps(scene, pose), min, max })
    }

    /// Without the rule that light must arrive.
    #[must_use]
    pub fn without_lights(mut self) -> Self {
        self.lamps.clear();
        self
    }

    fn diagonal(&self) -> f32 {
        (self.max - self.min).length().max(1e-6)
    }

    /// The nearest hit along a unit direction.
    fn look(&self, origin: Vec3, direction: Vec3) -> Option<Seen> {
        let hit = self.bvh.closest(&Ray::new(origin, direction))?;
        let [a, b, c] = self.bvh.triangles()[hit.triangle as usize];
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let id = self.bvh.id(hit.triangle);
        let mesh = self.scene.nodes.get(id.node as usize)?.mesh?;
        let primitive = &self.scene.meshes.get(mesh as usize)?.primitives[id.primitive as usize];
        let material = self.scene.materials.get(primitive.material as usize)?;
        let back = normal.dot(direction) > 0.0;
        Some(Seen {
            distance: hit.t,
            normal: if back { -normal } else { normal },
            back: back && !material.double_sided,
            emissive: material.unlit || material.emissive != Vec3::ZERO,
        })
    }

    fn is_lit(&self, at: Vec3, normal: Vec3) -> bool {
        let lift = 1e-4 * self.diagonal();
        self.lamps.iter().any(|lamp| {
            let (to, t_max) = match lamp {
                Lamp::Towards(to) => (*to, f32::INFINITY),
                Lamp::At(place, cone) => {
                    let to = *place - at;
                    if cone.is_some_and(|(axis, cosine)| -to.normalize_or_zero().dot(axis) < cosine) {
                        return false;
                    }
                    (to, 1.0 - 1e-3)
                }
            };
            let origin = at + normal * lift;
            to.dot(normal) > 0.0 && !self.bvh.any(&Ray { origin, direction: to, t_min: 0.0, t_max })
        })
    }

    /// Checks a view by the rules above.
    ///
    /// # Errors
    /// The rule that the view breaks.
    pub fn judge(&self, view: &NamedView) -> Result<(), Refusal> {
        let diagonal = self.diagonal();
        let eye = view.position;
        let mut backs = 0;
        for i in 0..AROUND {
            // A spiral of equal areas around the sphere.
            let y = 1.0 - 2.0 * (i as f32 + 0.5) / AROUND as f32;
            let (r, phi) = ((1.0 - y * y).sqrt(), i as f32 * 2.399_963_2);
            if let Some(seen) = self.look(eye, Vec3::new(r * phi.cos(), y, r * phi.sin())) {
                backs += u32::from(seen.back);
                if seen.distance < CLEARANCE * diagonal {
                    return Err(Refusal::InsideGeometry);
                }
            }
        }
        if backs as f32 > MOST_BACKS * AROUND as f32 {
            return Err(Refusal::InsideGeometry);
        }
        let forward = (view.target - eye).normalize();
        let right = forward.cross(view.up).normalize();
        let up = right.cross(forward);
        let slope = (0.5 * view.yfov_degrees.to_radians()).tan();
        let rays = (RAYS[0] * RAYS[1]) as f32;
        let (mut behind, mut lit, mut distances, mut planes) = (0, 0, Vec::new(), HashMap::<[i32; 4], u32>::new());
        for j in 0..RAYS[1] {
            for i in 0..RAYS[0] {
                let x = 2.0 * (i as f32 + 0.5) / RAYS[0] as f32 - 1.0;
                let y = 1.0 - 2.0 * (j as f32 + 0.5) / RAYS[1] as f32;
                let direction = (forward + right * (x * slope * ASPECT) + up * (y * slope)).normalize();
                let Some(Seen { distance, normal, back, emissive }) = self.look(eye, direction) else { continue };
                let at = eye + direction * distance;
                behind += u32::from(back);
                lit += u32::from(emissive || self.is_lit(at, normal));
                distances.push(distance);
                // Directions to about 20°, distance of the plane from the middle to 5 % of the diagonal.
                let offset = (at - 0.5 * (self.min + self.max)).dot(normal) / (0.05 * diagonal);
                let n = normal * 3.0;
                let key = [n.x, n.y, n.z, offset].map(|v| v.round() as i32);
                *planes.entry(key).or_default() += 1;
            }
        }
        if (rays - distances.len() as f32) > MOST_SKY * rays {
            return Err(Refusal::MostlySky);
        }
        if behind as f32 > MOST_BEHIND * rays {
            return Err(Refusal::SeenFromBehind);
        }
        distances.sort_by(f32::total_cmp);
        let (nearest, median) = (distances[0] / diagonal, distances[distances.len() / 2] / diagonal);
        let shown = planes.values().filter(|count| **count as f32 >= SHARE * rays).count();
        if nearest < NEAREST || !(MEDIAN..=FARTHEST).contains(&median) || shown < SURFACES {
            return Err(Refusal::IntoAWall);
        }
        if !self.lamps.is_empty() && (lit as f32) < LEAST_LIT * distances.len() as f32 {
            return Err(Refusal::InTheDark);
        }
        Ok(())
    }

    /// A random view, which may break the rules.
    fn any(&self, random: &mut Random) -> NamedView {
        let diagonal = self.diagonal();
        let margin = Vec3::splat(ROOM * diagonal);
        let min = self.min - margin * Vec3::new(1.0, 0.0, 1.0);
        let max = self.max + margin;
        let place = |random: &mut Random, axis: usize| random.between([min[axis], max[axis]]);
        let position = Vec3::new(place(random, 0), place(random, 1), place(random, 2));
        let azimuth = random.next() * std::f32::consts::TAU;
        let elevation = random.between(PITCH).to_radians();
        let level = Vec3::new(azimuth.sin(), 0.0, -azimuth.cos()) * elevation.cos();
        let yfov_degrees = random.between(YFOV).round();
        // Positions are rounded like in the written file, so that the written view is the view that was checked.
        let digits = 10f32.powi(3 - diagonal.log10().floor().clamp(-30.0, 30.0) as i32);
        let round = |v: Vec3| (v * digits).round() / digits;
        let position = round(position);
        let target = round(position + (level + Vec3::Y * elevation.sin()) * (0.2 * diagonal));
        let znear = (2e-3 * diagonal * digits).round().max(1.0) / digits;
        let (name, up) = (String::new(), Vec3::Y);
        NamedView { name, origin: Origin::Random, position, target, up, yfov_degrees, znear, zfar: None }
    }

    /// `count` views that pass [`Self::judge`], named `{name}-000` and so on. The same for the same arguments.
    ///
    /// # Errors
    /// `Input` if too few places see enough of the scene.
    pub fn views(&self, name: &str, count: usize, seed: u64) -> Result<Vec<NamedView>> {
        let mut random = Random(seed.wrapping_mul(0xd134_2543_de82_ef95));
        let mut found = Vec::new();
        let mut refusals = [0u64; 5];
        for _ in 0..PATIENCE * count as u64 {
            if found.len() == count {
                break;
            }
            let mut view = self.any(&mut random);
            match self.judge(&view) {
                Ok(()) => {
                    view.name = format!("{name}-{:03}", found.len());
                    found.push(view);
                }
                Err(why) => refusals[why as usize] += 1,
            }
        }
        if found.len() < count {
            let [inside, sky, behind, wall, dark] = refusals;
            let tried = inside + sky + behind + wall + dark + found.len() as u64;
            let found = found.len();
            let text = format!(
                "only {found} of {count} views were found in {tried} places tried: {inside} inside or too near to geometry, {sky} \
                 mostly sky, {behind} behind single-sided surfaces, {wall} in front of a wall, {dark} in the dark"
            );
            return Err(Error::input(text).help("Ask for fewer, or record cameras by hand (--camera FILE.toml)"));
        }
        Ok(found)
    }
}

/// [`Judge::views`] of a scene.
///
/// # Errors
/// `Input` if the scene has no surface, or too few places in it see enough of it.
pub fn views(scene: &Scene, pose: &Pose, name: &str, count: usize, seed: u64) -> Result<Vec<NamedView>> {
    Judge::new(scene, pose)?.views(name, count, seed)
}

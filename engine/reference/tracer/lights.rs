//! All lights of a scene in one table, picked by their power.

use super::{Sources, alias, environment::strength};
use crate::{
    image::srgb,
    scene::{Aabb, AlphaMode, Material, Pose, Primitive, Scene, TextureRef, deform::world_vertices},
    shaders::{
        consts::{LIGHT_DIRECTIONAL, LIGHT_SPOT, TARGET_ENVIRONMENT, TARGET_PUNCTUAL},
        types::{AliasEntry, Light, LightTarget},
    },
};
use glam::{DVec3, Vec2, Vec3};
use std::f64::consts::PI;

/// Not there ([`crate::scene::resident`]).
const NONE: u32 = u32::MAX;

/// What `lib/light_sampling.glsl` reads.
#[derive(Debug)]
pub struct LightTable {
    /// How many lights there are; the lists have one entry even without any.
    pub count: u32,
    pub columns: Vec<AliasEntry>,
    pub targets: Vec<LightTarget>,
    /// For each instance, number of the light that is its first triangle, or `u32::MAX`.
    pub instances: Vec<u32>,
    /// How probable the environment is to be picked.
    pub environment_choice: f32,
}

/// The table of what `sources` leaves of the lights. `lights` are those of the pose, `bounds` is around everything.
pub fn table(scene: &Scene, pose: &Pose, lights: &[Light], bounds: &Aabb, sources: Sources) -> LightTable {
    let mut targets = Vec::new();
    let mut powers = Vec::new();
    let mut groups = Vec::new();
    // Disc that the whole scene covers, seen from afar.
    let radius = if bounds.is_finite() { f64::from(bounds.max.distance(bounds.min)) * 0.5 } else { 1.0 };
    let disc = PI * (radius * radius).max(1e-12);
    if sources.punctual() {
        for (index, light) in lights.iter().enumerate() {
            let spread = match light.kind {
                LIGHT_DIRECTIONAL => disc,
                // Solid angle between the cosines at which the cone begins and ends, in the middle.
                LIGHT_SPOT => {
                    2.0 * PI * (1.0 - f64::from((0.5 - light.spot_offset) / light.spot_scale)).clamp(1e-4, 2.0)
                }
                _ => 4.0 * PI,
            };
            targets.push(LightTarget { instance: TARGET_PUNCTUAL, index: index as u32 });
            groups.push(if light.kind == LIGHT_DIRECTIONAL { Group::Sun } else { Group::Local });
            powers.push(strength(light.intensity.into()) * spread);
        }
    }
    let environment = scene.environment.as_ref().filter(|_| sources.environment());
    let sky = environment.map(|e| (targets.len(), strength(e.mean())));
    if let Some((_, mean)) = sky {
        targets.push(LightTarget { instance: TARGET_ENVIRONMENT, index: 0 });
        groups.push(Group::Sky);
        powers.push(mean * PI * 4.0 * disc);
    }
    let mut instances = Vec::new();
    for (node, primitive) in placed_primitives(scene) {
        let Some(material) = scene.materials.get(primitive.material as usize) else { continue };
        let number = instances.len() as u32;
        if material.unlit || material.emissive.max_element() <= 0.0 || !sources.emissive() {
            instances.push(NONE);
            continue;
        }
        instances.push(targets.len() as u32);
        let corners = world_vertices(scene, pose, node, primitive).positions;
        let glow = Glow::new(scene, material);
        for (index, triangle) in primitive.indices.chunks_exact(3).enumerate() {
            let corner = |i: usize| corners.get(triangle[i] as usize).map_or(DVec3::ZERO, |p| p.as_dvec3());
            let [a, b, c] = [0, 1, 2].map(corner);
            let area = 0.5 * (b - a).cross(c - a).length();
            let sides = if material.double_sided { 2.0 } else { 1.0 };
            targets.push(LightTarget { instance: number, index: index as u32 });
            groups.push(Group::Local);
            powers.push(PI * sides * area * glow.of(primitive, triangle));
        }
    }
    let count = targets.len() as u32;
    let columns = alias::table(&shares(&powers, &groups));
    // A sky of no power still counts as a light of the table, with probability 0 (or an even share, if nothing shines).
    let environment_choice = sky.map_or(0.0, |(at, _)| columns[at].probability);
    if targets.is_empty() {
        targets.push(LightTarget { instance: TARGET_ENVIRONMENT, index: 0 });
    }
    if instances.is_empty() {
        instances.push(NONE);
    }
    LightTable { count, columns, targets, instances, environment_choice }
}

/// Lights that reach the same places.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Group {
    Sun,
    Sky,
    Local,
}

/// How often to pick each light: half by its power; half by its share of the power of its group, all groups alike. What the
/// sun or the sky sends into the whole scene must not leave the lamps of a room unsampled.
fn shares(powers: &[f64], groups: &[Group]) -> Vec<f64> {
    let sum = |group: Option<Group>| -> f64 {
        powers.iter().zip(groups).filter(|(_, g)| group.is_none_or(|only| **g == only)).map(|(p, _)| p).sum()
    };
    let all = [Group::Sun, Group::Sky, Group::Local];
    let there = all.iter().filter(|g| sum(Some(**g)) > 0.0).count() as f64;
    if there == 0.0 {
        return powers.to_vec();
    }
    let (total, of_group) = (sum(None), all.map(|g| sum(Some(g))));
    let share = |(power, group): (&f64, &Group)| {
        let within = power / of_group[*group as usize];
        0.5 * power / total + if *power > 0.0 { 0.5 * within / there } else { 0.0 }
    };
    powers.iter().zip(groups).map(share).collect()
}

/// Primitives with their nodes, in the order of the resident scene's instances.
fn placed_primitives(scene: &Scene) -> impl Iterator<Item = (usize, &Primitive)> {
    scene.nodes.iter().enumerate().flat_map(|(index, node)| {
        let mesh = node.mesh.and_then(|mesh| scene.meshes.get(mesh as usize));
        mesh.into_iter().flat_map(|mesh| &mesh.primitives).map(move |primitive| (index, primitive))
    })
}

/// Mean emission of triangles.
struct Glow<'a> {
    /// Without texture.
    factor: f64,
    emissive: Vec3,
    texture: Option<(&'a crate::scene::Texture, TextureRef)>,
    /// Mean over the whole texture.
    mean: f64,
    /// The part of the surface that is there.
    alpha: f64,
}

impl<'a> Glow<'a> {
    fn new(scene: &'a Scene, material: &Material) -> Self {
        let known = |r: TextureRef| scene.textures.get(r.texture as usize).map(|t| (t, r));
        let texture = material.emissive_texture.and_then(known).filter(|(t, _)| !t.rgba.is_empty());
        let alpha = match material.alpha {
            AlphaMode::Blend => f64::from(material.base_color.w.clamp(0.01, 1.0)),
            _ => 1.0,
        };
        let emissive = material.emissive;
        let mean = texture.map_or(0.0, |(texture, _)| {
            // Some thousand texels are enough for a floor under the triangles' own means.
            let step = (texture.rgba.len() / 4096).max(1);
            let picked = texture.rgba.iter().step_by(step);
            let count = picked.clone().count() as f64;
            picked.map(|t| strength(emissive * linear(*t))).sum::<f64>() / count
        });
        Self { factor: strength(emissive), emissive, texture, mean, alpha }
    }

    fn of(&self, primitive: &Primitive, triangle: &[u32]) -> f64 {
        let Some((texture, at)) = &self.texture else { return self.factor * self.alpha };
        let Some(set) = primitive.uvs.get(at.uv_set as usize) else { return self.mean * self.alpha };
        let uv = [0, 1, 2].map(|i| set.get(triangle[i] as usize).copied().unwrap_or_default());
        const STEPS: u32 = 8;
        let (mut sum, mut count) = (0.0, 0.0);
        for i in 0..STEPS {
            for j in 0..STEPS - i {
                let b = Vec2::new(i as f32 + 0.33, j as f32 + 0.33) / STEPS as f32;
                let p = uv[0] * (1.0 - b.x - b.y) + uv[1] * b.x + uv[2] * b.y;
                sum += strength(self.emissive * texel(texture, at, p));
                count += 1.0;
            }
        }
        // Never 0 because of texels between the places looked at.
        (0.95 * sum / count + 0.05 * self.mean) * self.alpha
    }
}

fn texel(texture: &crate::scene::Texture, at: &TextureRef, uv: Vec2) -> Vec3 {
    let [a, b, c, d, x, y] = at.transform;
    let p = Vec2::new(a * uv.x + b * uv.y + x, c * uv.x + d * uv.y + y);
    let index = |value: f32, size: u32| {
        let place = f64::from(value.rem_euclid(1.0)) * f64::from(size);
        (place as u32).min(size.saturating_sub(1)) as usize
    };
    let at = index(p.y, texture.height) * texture.width as usize + index(p.x, texture.width);
    texture.rgba.get(at).map_or(Vec3::ZERO, |t| linear(*t))
}

fn linear([r, g, b, _]: [u8; 4]) -> Vec3 {
    Vec3::new(
        srgb::decode(f32::from(r) / 255.0),
        srgb::decode(f32::from(g) / 255.0),
        srgb::decode(f32::from(b) / 255.0),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Environment, builtin, resident};

    #[test]
    fn no_group_of_lights_is_left_out_for_another() {
        let groups = [Group::Sun, Group::Local, Group::Local, Group::Local];
        let found = shares(&[1e9, 3.0, 1.0, 0.0], &groups);
        assert!((found.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert!((found[1] - 0.1875).abs() < 1e-6 && (found[2] - 0.0625).abs() < 1e-6 && found[3] == 0.0, "{found:?}");
        assert_eq!(shares(&[0.0, 0.0], &groups[..2]), [0.0, 0.0]);
        assert_eq!(shares(&[5.0], &groups[..1]), [1.0]);
    }

    #[test]
    fn every_light_has_its_share_of_the_power() {
        let mut scene = builtin::load("cornell-area").unwrap();
        scene.environment = Some(Environment::constant(Vec3::ONE));
        let pose = Pose::rest(&scene);
        let lights = resident::lights(&scene, &pose);
        let bounds = Aabb { min: Vec3::splat(-1.0), max: Vec3::splat(1.0) };
        let all = table(&scene, &pose, &lights, &bounds, Sources::All);
        let sum: f32 = all.columns.iter().map(|c| c.probability).sum();
        assert!((sum - 1.0).abs() < 1e-5);
        let emissive = table(&scene, &pose, &lights, &bounds, Sources::Emissive);
        assert_eq!(emissive.environment_choice, 0.0);
        assert_eq!((emissive.count, all.count), (2, 3));
        assert_eq!(all.instances.iter().filter(|&&first| first != NONE).count(), 1);
        let none = table(&Scene::default(), &Pose::rest(&Scene::default()), &[], &bounds, Sources::All);
        assert_eq!((none.count, none.columns.len(), none.targets.len()), (0, 1, 1));
    }
}

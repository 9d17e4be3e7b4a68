//! The light table of a scene: directional lights are picked by their power, all other lights by the light tree.

use super::{
    Sources, alias,
    environment::strength,
    light_tree::{self, Bounds},
};
use crate::{
    image::srgb,
    scene::{Aabb, AlphaMode, Material, Pose, Primitive, Scene, TextureRef, deform::world_vertices},
    shaders::{
        consts::{LIGHT_DIRECTIONAL, LIGHT_SPOT, TARGET_PUNCTUAL, TRAIL_NONE},
        types::{AliasEntry, Light, LightNode, LightTarget},
    },
};
use glam::{DVec3, Vec2, Vec3};
use std::f64::consts::PI;

/// An absent index (as in [`crate::resident`]).
const NONE: u32 = u32::MAX;

/// The tables that `lib/light_sampling.glsl` reads.
#[derive(Debug)]
pub struct LightTable {
    /// Number of directional lights. The lists have at least one entry even if it is 0.
    pub suns: u32,
    /// Alias table that picks a directional light.
    pub columns: Vec<AliasEntry>,
    /// The directional lights, then all other lights.
    pub targets: Vec<LightTarget>,
    /// The light tree over all other lights, the root first.
    pub nodes: Vec<LightNode>,
    /// Whether the tree has lights.
    pub tree: bool,
    /// For each instance, the number of the light of its first triangle, or `u32::MAX`.
    pub instances: Vec<u32>,
}

/// The table of the lights that `sources` includes. `lights`: the scene's lights, placed by the pose.
pub fn table(scene: &Scene, pose: &Pose, lights: &[Light], sources: Sources) -> LightTable {
    let target = |instance, index: usize| LightTarget { instance, index: index as u32, trail: TRAIL_NONE };
    let punctual = if sources.punctual() { lights } else { &[] };
    let is_sun = |light: &Light| light.kind == LIGHT_DIRECTIONAL;
    let suns: Vec<(usize, &Light)> = punctual.iter().enumerate().filter(|(_, l)| is_sun(l)).collect();
    let mut targets: Vec<LightTarget> = suns.iter().map(|(index, _)| target(TARGET_PUNCTUAL, *index)).collect();
    let powers: Vec<f64> = suns.iter().map(|(_, light)| strength(light.intensity.into())).collect();
    let mut bounds = Vec::new();
    let mut add = |number: usize, light: Bounds| {
        // A light without power or without a finite position is never picked.
        if light.power > 0.0 && light.power.is_finite() && light.around.is_finite() {
            bounds.push((number as u32, light));
        }
    };
    for (index, light) in punctual.iter().enumerate().filter(|(_, l)| !is_sun(l)) {
        add(targets.len(), punctual_bounds(light));
        targets.push(target(TARGET_PUNCTUAL, index));
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
        // The winding of the corners defines the front side; a mirroring transform reverses it.
        let skinned = scene.nodes[node].skin.is_some() && !primitive.joints.is_empty();
        let mirrors = !skinned && pose.world.get(node).is_some_and(|m| m.determinant() < 0.0);
        let glow = Glow::new(scene, material);
        for (index, triangle) in primitive.indices.chunks_exact(3).enumerate() {
            let corner = |i: usize| corners.get(triangle[i] as usize).copied().unwrap_or(Vec3::ZERO);
            let [a, b, c] = [0, 1, 2].map(corner);
            let cross = (b - a).as_dvec3().cross((c - a).as_dvec3());
            let axis = if mirrors { -cross } else { cross };
            add(
                targets.len(),
                Bounds {
                    around: Aabb::of([a, b, c]),
                    power: 0.5 * cross.length() * glow.of(primitive, triangle),
                    reach: f32::INFINITY,
                    axis: axis.normalize_or(DVec3::Y).as_vec3(),
                    spread: 0.0,
                    edge: 0.5 * PI,
                    two_sided: material.double_sided,
                },
            );
            targets.push(target(number, index));
        }
    }
    let (nodes, trails) = light_tree::build(&bounds, targets.len());
    targets.iter_mut().zip(&trails).for_each(|(target, trail)| target.trail = *trail);
    if targets.is_empty() {
        targets.push(target(NONE, 0));
    }
    if instances.is_empty() {
        instances.push(NONE);
    }
    let tree = !bounds.is_empty();
    LightTable { suns: suns.len() as u32, columns: alias::table(&powers), targets, nodes, tree, instances }
}

/// Bounds of a point or spot light.
fn punctual_bounds(light: &Light) -> Bounds {
    let at = Vec3::from(light.position);
    let all = Bounds {
        around: Aabb { min: at, max: at },
        power: strength(light.intensity.into()),
        // A margin for the rounding of distances.
        reach: if light.range > 0.0 { light.range * 1.001 } else { f32::INFINITY },
        axis: Vec3::Y,
        spread: PI,
        edge: 0.5 * PI,
        two_sided: false,
    };
    if light.kind != LIGHT_SPOT {
        return all;
    }
    // Angle at which the linear falloff has the value `at`: 0 at the outer cone, 1 at the inner cone.
    let angle = |at: f32| f64::from((at - light.spot_offset) / light.spot_scale).clamp(-1.0, 1.0).acos();
    let (outer, inner) = (angle(0.0), angle(1.0));
    Bounds {
        axis: Vec3::from(light.direction).normalize_or(Vec3::NEG_Z),
        spread: inner,
        edge: (outer - inner).max(0.01),
        ..all
    }
}

/// Primitives with their nodes, in the order of the resident scene's instances.
fn placed_primitives(scene: &Scene) -> impl Iterator<Item = (usize, &Primitive)> {
    scene.nodes.iter().enumerate().flat_map(|(index, node)| {
        let mesh = node.mesh.and_then(|mesh| scene.meshes.get(mesh as usize));
        mesh.into_iter().flat_map(|mesh| &mesh.primitives).map(move |primitive| (index, primitive))
    })
}

/// Mean emission of the triangles of a material.
struct Glow<'a> {
    /// Emissive factor, summed over the colour channels, without the texture.
    factor: f64,
    emissive: Vec3,
    texture: Option<(&'a crate::scene::Texture, TextureRef)>,
    /// Mean over the whole texture.
    mean: f64,
    /// Coverage of the surface by its alpha.
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
            // The mean only is a lower limit for the triangles' means, so a few thousand texels are enough.
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
        // A part of the texture's mean keeps the result above 0 if the bright texels lie between the sampled points.
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
    use crate::builtin;
    use crate::{
        resident,
        scene::{Environment, LightKind, Node},
    };

    #[test]
    fn suns_come_first_and_everything_else_is_in_the_tree() {
        let mut scene = builtin::load("cornell-area").unwrap();
        scene.environment = Some(Environment::constant(Vec3::ONE));
        for kind in [LightKind::Point { range: None }, LightKind::Directional] {
            scene.lights.push(crate::scene::Light { name: String::new(), kind, color: Vec3::ONE, intensity: 1.0 });
            scene.nodes.push(Node { light: Some(scene.lights.len() as u32 - 1), ..Node::default() });
        }
        let pose = Pose::rest(&scene);
        let lights = resident::lights(&scene, &pose);
        let all = table(&scene, &pose, &lights, Sources::All);
        assert_eq!((all.suns, all.targets.len(), all.nodes.len()), (1, 4, 5));
        assert!(all.tree && all.targets[0].trail == TRAIL_NONE && all.targets[1..].iter().all(|t| t.trail < 8));
        assert_eq!(all.instances.iter().filter(|&&first| first != NONE).count(), 1);
        let emissive = table(&scene, &pose, &lights, Sources::Emissive);
        assert_eq!((emissive.suns, emissive.targets.len()), (0, 2));
        // Along its axis a lamp sends radiance times area, W/sr, as a punctual light its intensity.
        let glow = scene.materials.iter().find(|material| material.emissive != Vec3::ZERO).unwrap().emissive;
        let lamp = &emissive.nodes[0];
        let area = (lamp.high[0] - lamp.low[0]) * (lamp.high[2] - lamp.low[2]);
        let sent = strength(glow) * f64::from(area);
        assert!((f64::from(lamp.power) / sent - 1.0).abs() < 1e-5, "{} instead of {sent}", lamp.power);
        let none = table(&Scene::default(), &Pose::rest(&Scene::default()), &[], Sources::All);
        assert_eq!((none.suns, none.tree, none.nodes.len(), none.targets.len()), (0, false, 1, 1));
    }

    #[test]
    fn bounds_hold_the_cone_of_a_spot_light_and_the_front_of_a_mirrored_triangle() {
        let kind = LightKind::Spot { range: Some(3.0), inner: 0.3, outer: 0.7 };
        let mut scene = builtin::load("cornell-area").unwrap();
        scene.lights = vec![crate::scene::Light { name: String::new(), kind, color: Vec3::ONE, intensity: 2.0 }];
        scene.nodes.push(Node { light: Some(0), ..Node::default() });
        let pose = Pose::rest(&scene);
        let spot = punctual_bounds(&resident::lights(&scene, &pose)[0]);
        assert!((spot.spread - 0.3).abs() < 1e-3 && (spot.spread + spot.edge - 0.7).abs() < 1e-3, "{spot:?}");
        assert!(spot.reach > 3.0 && spot.axis.distance(Vec3::NEG_Z) < 1e-6 && (spot.power - 6.0).abs() < 1e-6);
        let axis = |scene: &Scene| {
            let all = table(scene, &Pose::rest(scene), &[], Sources::Emissive);
            Vec3::from(all.nodes[0].axis)
        };
        assert!(axis(&scene).distance(Vec3::NEG_Y) < 1e-5);
        for node in &mut scene.nodes {
            let mirror = glam::Mat4::from_scale(Vec3::new(-1.0, 1.0, 1.0));
            node.local = crate::scene::Transform::Matrix(mirror * node.local.matrix());
        }
        // The lamp still points down.
        assert!(axis(&scene).distance(Vec3::NEG_Y) < 1e-5);
    }
}

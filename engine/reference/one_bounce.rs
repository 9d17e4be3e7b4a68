//! Direct light and one diffuse bounce by ray casting on the CPU, for scenes of untextured matt surfaces and punctual lights:
//! what screen-space methods are measured against. Normals are those of the triangles.

use crate::scene::{
    LightKind, Pose, Scene,
    bvh::{Bvh, Ray},
};
use glam::{Vec3, vec3};
use std::f32::consts::PI;

/// A light in world space.
#[derive(Clone, Copy, Debug)]
struct Lamp {
    kind: LightKind,
    position: Vec3,
    /// Unit, the way it shines.
    direction: Vec3,
    /// W/sr, or W/m² of a directional light.
    intensity: Vec3,
}

/// A surface that a ray met.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    pub position: Vec3,
    /// Unit, towards where the ray came from.
    pub normal: Vec3,
    pub albedo: Vec3,
    /// W/(sr·m²).
    pub emission: Vec3,
}

/// A scene at one time.
#[derive(Debug)]
pub struct OneBounce<'a> {
    scene: &'a Scene,
    bvh: Bvh,
    lamps: Vec<Lamp>,
}

impl<'a> OneBounce<'a> {
    pub fn new(scene: &'a Scene, pose: &Pose) -> Self {
        let lamps = scene
            .nodes
            .iter()
            .zip(&pose.world)
            .filter_map(|(node, world)| node.light.map(|light| (&scene.lights[light as usize], world)))
            .map(|(light, world)| Lamp {
                kind: light.kind,
                position: world.w_axis.truncate(),
                direction: -world.z_axis.truncate().normalize_or_zero(),
                intensity: light.color * light.intensity,
            })
            .collect();
        Self { scene, bvh: Bvh::build(scene, pose), lamps }
    }

    /// The nearest surface along a ray. `direction` is a unit vector.
    pub fn surface(&self, origin: Vec3, direction: Vec3) -> Option<Surface> {
        let hit = self.bvh.closest(&Ray { t_min: 1e-4, ..Ray::new(origin, direction) })?;
        let [a, b, c] = self.bvh.triangles()[hit.triangle as usize];
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let id = self.bvh.id(hit.triangle);
        let mesh = self.scene.nodes[id.node as usize].mesh?;
        let primitive = &self.scene.meshes[mesh as usize].primitives[id.primitive as usize];
        let material = &self.scene.materials[primitive.material as usize];
        let color = material.base_color.truncate();
        let (albedo, emission) = if material.unlit {
            (Vec3::ZERO, Vec3::ZERO)
        } else {
            ((1.0 - material.metallic) * color, material.emissive)
        };
        let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
        Some(Surface { position: a * (1.0 - hit.u - hit.v) + b * hit.u + c * hit.v, normal, albedo, emission })
    }

    /// Does nothing lie between two points?
    pub fn sees(&self, from: Vec3, to: Vec3) -> bool {
        let line = to - from;
        let (distance, direction) = (line.length(), line.normalize_or_zero());
        !self.bvh.any(&Ray { origin: from, direction, t_min: 1e-3, t_max: distance - 1e-3 })
    }

    /// Radiance that a surface reflects of all punctual lights.
    pub fn direct(&self, surface: &Surface) -> Vec3 {
        let mut irradiance = Vec3::ZERO;
        for lamp in &self.lamps {
            let (to, distance, arriving) = match lamp.kind {
                LightKind::Directional => (-lamp.direction, f32::INFINITY, lamp.intensity),
                LightKind::Point { .. } | LightKind::Spot { .. } => {
                    let line = lamp.position - surface.position;
                    let distance = line.length();
                    let to = line / distance;
                    let cone = match lamp.kind {
                        LightKind::Spot { inner, outer, .. } => {
                            let span = (inner.cos() - outer.cos()).max(1e-4);
                            ((-to.dot(lamp.direction) - outer.cos()) / span).clamp(0.0, 1.0).powi(2)
                        }
                        _ => 1.0,
                    };
                    (to, distance, lamp.intensity * cone / (distance * distance))
                }
            };
            let cosine = surface.normal.dot(to);
            let ray = Ray { origin: surface.position, direction: to, t_min: 1e-3, t_max: distance - 1e-3 };
            if cosine > 0.0 && arriving != Vec3::ZERO && !self.bvh.any(&ray) {
                irradiance += arriving * cosine;
            }
        }
        surface.albedo / PI * irradiance
    }

    /// Radiance that a white surface would reflect of what others emit and reflect directly: `side`² rays, stratified,
    /// distributed by the cosine. Only surfaces that `counts` accepts send.
    pub fn gathered(&self, surface: &Surface, side: u32, counts: impl Fn(&Surface) -> bool) -> Vec3 {
        let tangent = surface.normal.any_orthonormal_vector();
        let bitangent = surface.normal.cross(tangent);
        let mut sum = Vec3::ZERO;
        for i in 0..side {
            for j in 0..side {
                // The middle of each cell, turned a little from row to row so that no two lie in a plane.
                let u = (i as f32 + 0.5) / side as f32;
                let v = (j as f32 + 0.5) / side as f32 + i as f32 * 0.618_034;
                let (radius, phi) = (u.sqrt(), 2.0 * PI * v);
                let local = vec3(radius * phi.cos(), radius * phi.sin(), (1.0 - u).sqrt());
                let direction = tangent * local.x + bitangent * local.y + surface.normal * local.z;
                let other = self.surface(surface.position + surface.normal * 1e-4, direction);
                if let Some(other) = other.filter(&counts) {
                    sum += other.emission + self.direct(&other);
                }
            }
        }
        sum / (side * side) as f32
    }
}

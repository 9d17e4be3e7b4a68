//! What shines: punctual lights and emissive triangles.

use crate::reference::isr::paper_attenuation;
use crate::scene::surfaces::Surfaces;
use crate::scene::{Light, LightKind, Node, Pose, Scene, bvh::Bvh};
use glam::{Mat4, Vec3};

/// A punctual light in world space.
pub struct Placed<'a> {
    light: &'a Light,
    position: Vec3,
    direction: Vec3,
    law: Law,
    /// Brightest channel of all lights, W/sr or W/m².
    brightest: f32,
}

/// How punctual lights fall off.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Law {
    /// KHR_lights_punctual: W/sr over squared distance.
    #[default]
    Physical,
    /// The law of the ISR dissertation: the colour relative to the brightest light, times `power`, times saturate(1 − (d/r)²) [ISR 16]. A surface
    /// reflects it without 1/π, so the irradiance is π times this value. `radius`: r of lights without a range, metres.
    Paper { radius: f32, power: f32 },
}

/// All punctual lights.
pub fn placed<'a>(scene: &'a Scene, pose: &Pose, law: Law) -> Vec<Placed<'a>> {
    let light = |node: &Node| Some(&scene.lights[node.light? as usize]);
    let brightest = scene.nodes.iter().filter_map(light).map(|light| (light.color * light.intensity).max_element());
    let brightest = brightest.fold(1e-20, f32::max);
    let place = |(node, world): (&Node, &Mat4)| {
        Some(Placed {
            light: light(node)?,
            position: world.w_axis.truncate(),
            direction: world.transform_vector3(Vec3::NEG_Z).normalize_or(Vec3::NEG_Z),
            law,
            brightest,
        })
    };
    scene.nodes.iter().zip(&pose.world).filter_map(place).collect()
}

impl Placed<'_> {
    /// Direction to the light, distance, irradiance on a facing plane.
    pub fn at(&self, p: Vec3) -> (Vec3, f32, Vec3) {
        let power = self.light.color * self.light.intensity;
        let power = match self.law {
            Law::Physical => power,
            Law::Paper { power: factor, .. } => power * (std::f32::consts::PI * factor / self.brightest),
        };
        let (range, cone) = match self.light.kind {
            LightKind::Directional => return (-self.direction, f32::INFINITY, power),
            LightKind::Point { range } => (range, None),
            LightKind::Spot { range, inner, outer } => (range, Some((inner, outer))),
        };
        let to = self.position - p;
        let distance = to.length().max(1e-4);
        let to = to / distance;
        let cone = cone.map_or(1.0, |(inner, outer)| {
            let (cos, inner, outer) = (-to.dot(self.direction), inner.cos(), outer.cos());
            ((cos - outer) / (inner - outer).max(1e-3)).clamp(0.0, 1.0).powi(2)
        });
        let falloff = match self.law {
            Law::Physical => {
                let window = range.map_or(1.0, |r| (1.0 - (distance / r).powi(4)).clamp(0.0, 1.0));
                window / (distance * distance)
            }
            Law::Paper { radius, .. } => paper_attenuation(distance.into(), range.unwrap_or(radius).into()) as f32,
        };
        (to, distance, power * (cone * falloff))
    }
}

/// Triangles that emit, to be chosen by their area.
pub struct Lamps {
    triangles: Vec<u32>,
    /// Running sum of areas, m².
    areas: Vec<f64>,
}

/// A point on an emissive triangle.
pub struct LampPoint {
    pub triangle: u32,
    /// Barycentric weights of the second and third corner.
    pub u: f32,
    pub v: f32,
    pub position: Vec3,
    /// Unit, of the triangle as it is wound.
    pub normal: Vec3,
}

impl Lamps {
    pub fn new(bvh: &Bvh, surfaces: &Surfaces<'_>) -> Self {
        let (mut triangles, mut areas, mut sum) = (Vec::new(), Vec::new(), 0.0);
        for (index, [a, b, c]) in bvh.triangles().iter().enumerate() {
            let area = 0.5 * f64::from((*b - *a).cross(*c - *a).length());
            if area > 0.0 && surfaces.emits(index as u32) {
                sum += area;
                triangles.push(index as u32);
                areas.push(sum);
            }
        }
        Self { triangles, areas }
    }

    /// Of all, m².
    pub fn area(&self) -> f32 {
        self.areas.last().map_or(0.0, |a| *a as f32)
    }

    /// A point, evenly over all areas.
    pub fn sample(&self, bvh: &Bvh, [choice, a, b]: [f32; 3]) -> Option<LampPoint> {
        let wanted = f64::from(choice) * self.areas.last()?;
        let triangle = self.triangles[self.areas.partition_point(|sum| *sum <= wanted).min(self.areas.len() - 1)];
        let [p, q, r] = bvh.triangles()[triangle as usize];
        let (u, v) = if a + b > 1.0 { (1.0 - a, 1.0 - b) } else { (a, b) };
        let normal = (q - p).cross(r - p).normalize_or_zero();
        Some(LampPoint { triangle, u, v, position: p * (1.0 - u - v) + q * u + r * v, normal })
    }
}

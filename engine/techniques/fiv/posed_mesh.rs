//! The triangles of a node in a pose, with their measures. Occluders that deform are measured in each frame.

use glam::{Vec3, Vec4};

use super::{samples::Shells, support_function::SupportFunction};
use crate::scene::{Mesh, Pose, Primitive, Scene, deform, nearest::distance_of_origin};

/// Least radius of the first sphere of samples, in radii of the bounding sphere.
const LEAST_FIRST: f32 = 0.1;

/// The triangles of a node, relative to the centre of their bounding sphere.
#[derive(Debug)]
pub(super) struct PosedMesh {
    pub primitives: Vec<PosedPrimitive>,
    /// Centre of the bounding sphere, seen from the node's origin, metres in world axes.
    pub centre: Vec3,
    pub size: Size,
}

/// The triangles of a primitive.
#[derive(Debug)]
pub(super) struct PosedPrimitive {
    /// Number of the primitive in its mesh.
    pub slot: usize,
    pub positions: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    pub indices: Vec<u32>,
}

impl PosedMesh {
    /// Poses the mesh of a node. `None` if no triangle could block light. `pose` has the same value afterwards.
    pub fn of(scene: &Scene, pose: &mut Pose, node: usize, mesh: &Mesh) -> Option<Self> {
        let mut primitives = Vec::new();
        for (slot, primitive) in mesh.primitives.iter().enumerate().filter(|(_, p)| !is_unlit(scene, p)) {
            // The translation is left out, so that equal meshes at different places have equal vertices to the last
            // bit.
            let place = std::mem::replace(&mut pose.world[node].w_axis, Vec4::W);
            let deform::Vertices { mut positions, normals, .. } = deform::world_vertices(scene, pose, node, primitive);
            pose.world[node].w_axis = place;
            if scene.nodes[node].skin.is_some() && !primitive.joints.is_empty() {
                positions.iter_mut().for_each(|p| *p -= place.truncate());
            }
            let good =
                |corner: &[u32]| corner.iter().all(|&i| positions.get(i as usize).is_some_and(|p| p.is_finite()));
            let indices: Vec<u32> = primitive.indices.chunks_exact(3).filter(|c| good(c)).flatten().copied().collect();
            if !indices.is_empty() {
                primitives.push(PosedPrimitive { slot, positions, normals, indices });
            }
        }
        let centre = bounding_centre(&primitives)?;
        primitives.iter_mut().flat_map(|part| &mut part.positions).for_each(|position| *position -= centre);
        let size = Size::of(primitives.iter().flat_map(|part| corners(&part.positions, &part.indices)))?;
        Some(Self { primitives, centre, size })
    }

    /// Its extent along every direction.
    pub fn support_function(&self) -> SupportFunction {
        support_function(self.primitives.iter().map(|part| (&part.positions[..], &part.indices[..])))
    }
}

/// The support function of the vertices that the triangles use.
pub(super) fn support_function<'a>(primitives: impl Iterator<Item = (&'a [Vec3], &'a [u32])>) -> SupportFunction {
    let mut points = Vec::new();
    for (positions, indices) in primitives {
        let mut used = vec![false; positions.len()];
        indices.iter().for_each(|&i| used[i as usize] = true);
        points.extend(positions.iter().zip(used).filter(|(_, used)| *used).map(|(position, _)| *position));
    }
    SupportFunction::of(&points)
}

/// Measures of triangles around the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Size {
    /// Radius of the bounding sphere, metres.
    pub radius: f32,
    /// Distance from the origin to the nearest surface, metres.
    pub inner: f32,
    /// Area of all triangles, m².
    pub area: f32,
}

impl Size {
    /// `None` if no triangle has an area.
    pub(super) fn of(triangles: impl Iterator<Item = [Vec3; 3]>) -> Option<Self> {
        let (mut radius, mut inner, mut area) = (0f32, f32::INFINITY, 0f64);
        for triangle in triangles {
            radius = triangle.iter().map(|p| p.length()).fold(radius, f32::max);
            inner = inner.min(distance_of_origin(triangle));
            let [a, b, c] = triangle;
            area += f64::from(0.5 * (b - a).cross(c - a).length());
        }
        (radius.is_finite() && radius > 0.0).then_some(Self { radius, inner, area: area as f32 })
    }

    /// The spheres of samples, as [`super::Occluder::shells`].
    pub(super) fn shells(&self, reach: f32) -> Shells {
        let nearest = self.inner.max(LEAST_FIRST * self.radius);
        Shells { nearest, farthest: (reach * self.radius).max(1.01 * nearest) }
    }

    /// Ratio of the filled share of the bounding disc to the share at the size `rest`. Convex bodies have silhouettes
    /// of a quarter of their surface (Cauchy). Other bodies are assumed to overlap themselves as much as at rest.
    pub(super) fn fill(&self, rest: &Self) -> f32 {
        let more = (self.area / rest.area) * (rest.radius / self.radius).powi(2);
        if more.is_finite() { more } else { 1.0 }
    }
}

/// Whether a primitive is unlit. Light passes through unlit surfaces.
pub(super) fn is_unlit(scene: &Scene, primitive: &Primitive) -> bool {
    scene.materials.get(primitive.material as usize).is_some_and(|material| material.unlit)
}

pub(super) fn corners<'a>(positions: &'a [Vec3], indices: &'a [u32]) -> impl Iterator<Item = [Vec3; 3]> + 'a {
    indices.chunks_exact(3).map(|c| [0, 1, 2].map(|k| positions[c[k] as usize]))
}

/// Centre of a sphere around all vertices by Ritter's method, whose radius is at most a few percent too large.
fn bounding_centre(primitives: &[PosedPrimitive]) -> Option<Vec3> {
    let points = || primitives.iter().flat_map(|p| p.indices.iter().map(|&i| p.positions[i as usize].as_dvec3()));
    let farthest =
        |from: glam::DVec3| points().max_by(|a, b| a.distance_squared(from).total_cmp(&b.distance_squared(from)));
    let start = farthest(points().next()?)?;
    let end = farthest(start)?;
    let (mut centre, mut radius) = (0.5 * (start + end), 0.5 * start.distance(end));
    for p in points() {
        let distance = p.distance(centre);
        if distance > radius {
            radius = 0.5 * (radius + distance);
            centre += (p - centre) * ((distance - radius) / distance);
        }
    }
    Some(centre.as_vec3())
}

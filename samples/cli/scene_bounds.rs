//! Bounding boxes of scenes.

use glam::Vec3;
use lucerna::scene::{Aabb, Pose, Scene, deform};

/// Number of times at which an animation is sampled.
const MOMENTS: u32 = 8;
/// A part is flat if its height is below this share of its width.
const FLAT: f32 = 0.02;
/// A flat part is ground if the other parts are narrower than this share of the whole.
const NARROW: f32 = 0.5;
/// Directions in which the outline of a subject is looked for.
const OUTLINE: u32 = 192;

/// The box around all geometry in one pose, metres; `None` if there is none.
pub fn in_pose(scene: &Scene, pose: &Pose) -> Option<Aabb> {
    let mut around = Aabb::EMPTY;
    visit(scene, pose, |_, positions| around = around.union(finite(positions)));
    around.is_finite().then_some(around)
}

/// The box around all geometry over the time of the animations, metres; `None` if there is no geometry.
pub fn over_animations(scene: &Scene) -> Option<Aabb> {
    poses(scene).iter().filter_map(|pose| in_pose(scene, pose)).reduce(Aabb::union)
}

/// A primitive of a node, by their indices.
type Part = (usize, usize);

/// The parts of a scene at which a camera should look, over the time of the animations: all of them, without ground that reaches far beyond the others.
#[derive(Debug)]
pub struct Subject {
    poses: Vec<Pose>,
    parts: Vec<Part>,
    /// Around these parts, metres.
    pub bounds: Aabb,
    /// Around all parts, metres.
    pub whole: Aabb,
}

impl Subject {
    /// The subject of a scene; `None` if there is no geometry.
    pub fn of(scene: &Scene) -> Option<Self> {
        let poses = poses(scene);
        let mut boxes: Vec<(Part, Aabb)> = Vec::new();
        for (number, pose) in poses.iter().enumerate() {
            let mut next = 0;
            visit(scene, pose, |part, positions| {
                let around = finite(positions);
                if number == 0 {
                    boxes.push((part, around));
                } else if let Some((_, known)) = boxes.get_mut(next) {
                    *known = known.union(around);
                }
                next += 1;
            });
        }
        boxes.retain(|(_, around)| around.is_finite());
        let union = |list: &[(Part, Aabb)]| list.iter().map(|(_, around)| *around).reduce(Aabb::union);
        let whole = union(&boxes)?;
        let width = |around: &Aabb| (around.max - around.min).x.max((around.max - around.min).z);
        let standing: Vec<_> = boxes.iter().copied().filter(|(_, b)| b.max.y - b.min.y > FLAT * width(b)).collect();
        let narrow = union(&standing).filter(|around| width(around) < NARROW * width(&whole));
        let (list, bounds) = narrow.map_or((boxes, whole), |bounds| (standing, bounds));
        Some(Self { poses, parts: list.into_iter().map(|(part, _)| part).collect(), bounds, whole })
    }

    /// Positions of the subject on its outside, metres: for each of many directions the farthest one.
    pub fn outline(&self, scene: &Scene) -> Vec<Vec3> {
        let directions: Vec<Vec3> = directions().collect();
        let mut most = vec![(f32::NEG_INFINITY, self.bounds.centre()); directions.len()];
        for pose in &self.poses {
            visit(scene, pose, |part, positions| {
                // The parts are in the order of the visit.
                if self.parts.binary_search(&part).is_err() {
                    return;
                }
                let around = finite(positions);
                for (farthest, direction) in most.iter_mut().zip(&directions) {
                    // Most parts are not on the outside.
                    if around.corners().iter().all(|corner| corner.dot(*direction) <= farthest.0) {
                        continue;
                    }
                    for position in positions.iter().filter(|p| p.is_finite()) {
                        let along = position.dot(*direction);
                        if along > farthest.0 {
                            *farthest = (along, *position);
                        }
                    }
                }
            });
        }
        most.into_iter().map(|(_, position)| position).collect()
    }
}

/// Directions evenly over the sphere (spherical Fibonacci points), and those to the corners of a cube.
fn directions() -> impl Iterator<Item = Vec3> {
    let spread = (0..OUTLINE).map(|i| {
        let y = 1.0 - 2.0 * (i as f32 + 0.5) / OUTLINE as f32;
        let angle = i as f32 * 2.399_963;
        let r = (1.0 - y * y).sqrt();
        Vec3::new(r * angle.cos(), y, r * angle.sin())
    });
    spread.chain(Aabb { min: Vec3::NEG_ONE, max: Vec3::ONE }.corners())
}

/// Poses over the time of the animations.
fn poses(scene: &Scene) -> Vec<Pose> {
    let longest = scene.animations.iter().map(|a| a.duration()).fold(0.0, f32::max);
    let moments = if longest > 0.0 { MOMENTS } else { 1 };
    (0..moments).map(|moment| Pose::playing(scene, longest * moment as f32 / MOMENTS as f32)).collect()
}

fn finite(positions: &[Vec3]) -> Aabb {
    Aabb::of(positions.iter().copied().filter(|p| p.is_finite()))
}

/// Calls `see` with the positions of each primitive, metres, world space.
fn visit(scene: &Scene, pose: &Pose, mut see: impl FnMut(Part, &[Vec3])) {
    for (index, node) in scene.nodes.iter().enumerate() {
        let Some(mesh) = node.mesh.and_then(|mesh| scene.meshes.get(mesh as usize)) else { continue };
        for (number, primitive) in mesh.primitives.iter().enumerate() {
            see((index, number), &deform::world_vertices(scene, pose, index, primitive).positions);
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::{Quat, Vec3, Vec4};
    use lucerna::scene::{Animation, Channel, Interpolation, Keys, Mesh, Node, Primitive, Transform};

    use super::*;

    fn at(translation: Vec3, parent: Option<u32>) -> Node {
        let local = Transform::Trs { translation, rotation: Quat::IDENTITY, scale: Vec3::ONE };
        Node { local, parent, ..Node::default() }
    }

    #[test]
    fn bounds_follow_hierarchy_and_animation() {
        let positions = vec![Vec3::ZERO, Vec3::ONE];
        let (normals, tangents) = (vec![Vec3::Y; 2], vec![Vec4::ZERO; 2]);
        let primitive = Primitive { positions, normals, tangents, ..Primitive::default() };
        let mut scene =
            Scene { meshes: vec![Mesh { primitives: vec![primitive], ..Mesh::default() }], ..Scene::default() };
        assert_eq!(over_animations(&scene), None);
        scene.nodes = vec![at(Vec3::X, None), Node { mesh: Some(0), ..at(Vec3::Y, Some(0)) }];
        let rest = Aabb { min: Vec3::new(1.0, 1.0, 0.0), max: Vec3::new(2.0, 2.0, 1.0) };
        assert_eq!(over_animations(&scene), Some(rest));
        let channel = Channel {
            node: 0,
            interpolation: Interpolation::Linear,
            times: vec![0.0, 1.0],
            values: Keys::Translation(vec![Vec3::X, Vec3::X * 9.0]),
        };
        scene.animations = vec![Animation { name: String::new(), channels: vec![channel] }];
        assert_eq!(in_pose(&scene, &Pose::rest(&scene)), Some(rest));
        // The last of eight moments is at 7/8.
        let all = Aabb { max: Vec3::new(9.0, 2.0, 1.0), ..rest };
        assert_eq!(over_animations(&scene), Some(all));
        let subject = Subject::of(&scene).unwrap();
        assert_eq!((subject.bounds, subject.whole), (all, all));
        let outline = Aabb::of(subject.outline(&scene));
        assert_eq!((outline.min, outline.max), (all.min, all.max));
    }

    #[test]
    fn far_ground_is_not_the_subject() {
        let mut scene = Scene::default();
        for (min, max) in [(Vec3::ZERO, Vec3::ONE), (Vec3::new(-50.0, 0.0, -50.0), Vec3::new(50.0, 0.1, 50.0))] {
            let (normals, tangents) = (vec![Vec3::Y; 2], vec![Vec4::ZERO; 2]);
            let primitive = Primitive { positions: vec![min, max], normals, tangents, ..Primitive::default() };
            scene.nodes.push(Node { mesh: Some(scene.meshes.len() as u32), ..Node::default() });
            scene.meshes.push(Mesh { primitives: vec![primitive], ..Mesh::default() });
        }
        let subject = Subject::of(&scene).unwrap();
        assert_eq!((subject.bounds.max, subject.whole.max), (Vec3::ONE, Vec3::new(50.0, 1.0, 50.0)));
        assert_eq!(Aabb::of(subject.outline(&scene)).max, Vec3::ONE);
        // Ground alone is the subject.
        scene.nodes.remove(0);
        assert_eq!(Subject::of(&scene).unwrap().bounds.max.x, 50.0);
    }
}

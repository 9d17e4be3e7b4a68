//! Bounding boxes of scenes.

use lucerna::scene::{Aabb, Pose, Scene, deform};

/// Number of times at which an animation is sampled.
const MOMENTS: u32 = 8;

/// The box around all geometry in one pose, metres; `None` if there is none.
pub fn in_pose(scene: &Scene, pose: &Pose) -> Option<Aabb> {
    let mut around = Aabb::EMPTY;
    for (index, node) in scene.nodes.iter().enumerate() {
        let Some(mesh) = node.mesh.and_then(|mesh| scene.meshes.get(mesh as usize)) else { continue };
        for primitive in &mesh.primitives {
            let vertices = deform::world_vertices(scene, pose, index, primitive);
            around = around.union(Aabb::of(vertices.positions.into_iter().filter(|p| p.is_finite())));
        }
    }
    around.is_finite().then_some(around)
}

/// The box around all geometry over the time of the animations, metres; `None` if there is no geometry.
pub fn over_animations(scene: &Scene) -> Option<Aabb> {
    let longest = scene.animations.iter().map(|a| a.duration()).fold(0.0, f32::max);
    let moments = if longest > 0.0 { MOMENTS } else { 1 };
    let at = |moment: u32| in_pose(scene, &Pose::playing(scene, longest * moment as f32 / MOMENTS as f32));
    (0..moments).filter_map(at).reduce(Aabb::union)
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
        assert_eq!(over_animations(&scene), Some(Aabb { max: Vec3::new(9.0, 2.0, 1.0), ..rest }));
    }
}

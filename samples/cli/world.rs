//! Where things of a CPU scene stand in the world, in its rest pose.

use glam::{Mat4, Vec3};
use lucerna::scene::{Primitive, Scene, Skin};

/// `world_from_local` of every node. Parents stand before their children.
pub fn transforms(scene: &Scene) -> Vec<Mat4> {
    let mut world: Vec<Mat4> = Vec::with_capacity(scene.nodes.len());
    for node in &scene.nodes {
        let local = node.local.matrix();
        let parent = node.parent.and_then(|parent| world.get(parent as usize)).copied();
        world.push(parent.map_or(local, |parent| parent * local));
    }
    world
}

/// Box around a scene, metres.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Bounds {
    pub min: Vec3,
    pub max: Vec3,
}

impl Bounds {
    pub fn center(&self) -> Vec3 {
        (self.min + self.max) * 0.5
    }

    /// Half the diagonal.
    pub fn radius(&self) -> f32 {
        (self.max - self.min).length() * 0.5
    }
}

/// The box around all geometry, skinned in its rest pose; `None` if there is none.
pub fn bounds(scene: &Scene) -> Option<Bounds> {
    let world = transforms(scene);
    let mut around = Bounds { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };
    let mut add = |point: Vec3| {
        if point.is_finite() {
            around.min = around.min.min(point);
            around.max = around.max.max(point);
        }
    };
    for (index, node) in scene.nodes.iter().enumerate() {
        let Some(mesh) = node.mesh.and_then(|mesh| scene.meshes.get(mesh as usize)) else { continue };
        let joints = node.skin.and_then(|skin| scene.skins.get(skin as usize)).map(|skin| palette(skin, &world));
        for primitive in &mesh.primitives {
            for vertex in 0..primitive.positions.len() {
                let matrix = joints.as_ref().map_or(world[index], |joints| skinned(primitive, vertex, joints));
                add(matrix.transform_point3(primitive.positions[vertex]));
            }
        }
    }
    (around.min.x <= around.max.x).then_some(around)
}

/// `world_from_mesh` of every joint.
fn palette(skin: &Skin, world: &[Mat4]) -> Vec<Mat4> {
    let joint = |&joint: &u32| world.get(joint as usize).copied().unwrap_or_default();
    skin.joints.iter().map(joint).zip(&skin.inverse_bind).map(|(world, bind)| world * *bind).collect()
}

fn skinned(primitive: &Primitive, vertex: usize, joints: &[Mat4]) -> Mat4 {
    let mut sum = Mat4::ZERO;
    for (set, weights) in primitive.joints.iter().zip(&primitive.weights) {
        let (Some(set), Some(weights)) = (set.get(vertex), weights.get(vertex)) else { continue };
        for (joint, weight) in set.iter().zip(weights.to_array()) {
            sum += joints.get(usize::from(*joint)).copied().unwrap_or_default() * weight;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use glam::{Quat, Vec4};
    use lucerna::scene::{Mesh, Node, Transform};

    use super::*;

    fn at(translation: Vec3, parent: Option<u32>) -> Node {
        let local = Transform::Trs { translation, rotation: Quat::IDENTITY, scale: Vec3::ONE };
        Node { local, parent, ..Node::default() }
    }

    fn mesh(positions: Vec<Vec3>) -> Mesh {
        Mesh { primitives: vec![Primitive { positions, ..Primitive::default() }], ..Mesh::default() }
    }

    #[test]
    fn bounds_follow_the_hierarchy() {
        let mut scene = Scene { meshes: vec![mesh(vec![Vec3::ZERO, Vec3::ONE])], ..Scene::default() };
        assert_eq!(bounds(&scene), None);
        scene.nodes = vec![at(Vec3::X, None), Node { mesh: Some(0), ..at(Vec3::Y, Some(0)) }];
        let expected = Bounds { min: Vec3::new(1.0, 1.0, 0.0), max: Vec3::new(2.0, 2.0, 1.0) };
        assert_eq!(bounds(&scene), Some(expected));
    }

    #[test]
    fn a_skin_replaces_the_transform_of_its_node() {
        let mut mesh = mesh(vec![Vec3::ZERO]);
        mesh.primitives[0].joints = vec![vec![[0, 1, 0, 0]]];
        mesh.primitives[0].weights = vec![vec![Vec4::new(0.25, 0.75, 0.0, 0.0)]];
        let scene = Scene {
            nodes: vec![
                Node { mesh: Some(0), skin: Some(0), ..at(Vec3::splat(100.0), None) },
                at(Vec3::ZERO, None),
                at(Vec3::X * 4.0, None),
            ],
            meshes: vec![mesh],
            skins: vec![Skin { name: String::new(), joints: vec![1, 2], inverse_bind: vec![Mat4::IDENTITY; 2] }],
            ..Scene::default()
        };
        assert_eq!(bounds(&scene).map(|b| b.center()), Some(Vec3::X * 3.0));
    }
}

//! Deformed vertices on the CPU: the slow, obvious twin of the GPU's morphing and skinning, and what the hierarchy is
//! built from.

use super::{Pose, Primitive, Scene};
use glam::{Mat3, Mat4, Vec3, Vec4};

/// World-space vertices of one primitive of one node.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Vertices {
    /// Metres, world space.
    pub positions: Vec<Vec3>,
    /// Unit length, world space.
    pub normals: Vec<Vec3>,
    /// xyz unit tangent in world space, w = handedness; zero where there is none.
    pub tangents: Vec<Vec4>,
}

/// Morphs, then skins or transforms `primitive` of `node` (glTF 2.0, 3.7.2.2 and 3.7.3).
///
/// `world_from_mesh` of a skinned vertex is the weighted sum of its joints' matrices; the node's own transform does not
/// count then.
pub fn world_vertices(scene: &Scene, pose: &Pose, node: usize, primitive: &Primitive) -> Vertices {
    let mut out = morphed(primitive, &pose.weights[node]);
    let skin = scene.nodes[node].skin.filter(|_| !primitive.joints.is_empty());
    let joints = skin.map(|skin| pose.joints(scene, skin as usize));
    for i in 0..out.positions.len() {
        let world = match &joints {
            Some(joints) => blend(primitive, joints, i),
            None => pose.world[node],
        };
        let linear = Mat3::from_mat4(world);
        out.positions[i] = world.transform_point3(out.positions[i]);
        out.normals[i] = (cofactor(linear) * out.normals[i]).normalize_or_zero();
        let tangent = out.tangents[i];
        // Mirroring swaps the side of the bitangent.
        let flip = if linear.determinant() < 0.0 { -1.0 } else { 1.0 };
        out.tangents[i] = (linear * tangent.truncate()).normalize_or_zero().extend(tangent.w * flip);
    }
    out
}

fn morphed(primitive: &Primitive, weights: &[f32]) -> Vertices {
    let mut out = Vertices {
        positions: primitive.positions.clone(),
        normals: primitive.normals.clone(),
        tangents: primitive.tangents.clone(),
    };
    for (target, &weight) in primitive.morphs.iter().zip(weights) {
        for (position, delta) in out.positions.iter_mut().zip(&target.positions) {
            *position += *delta * weight;
        }
        for (normal, delta) in out.normals.iter_mut().zip(&target.normals) {
            *normal += *delta * weight;
        }
        for (tangent, delta) in out.tangents.iter_mut().zip(&target.tangents) {
            *tangent += (*delta * weight).extend(0.0);
        }
    }
    out
}

fn blend(primitive: &Primitive, joints: &[Mat4], vertex: usize) -> Mat4 {
    let mut sum = Mat4::ZERO;
    for (set, weights) in primitive.joints.iter().zip(&primitive.weights) {
        for (joint, weight) in set[vertex].iter().zip(weights[vertex].to_array()) {
            if let Some(&matrix) = joints.get(usize::from(*joint)) {
                sum += matrix * weight;
            }
        }
    }
    sum
}

/// The matrix that transforms normals: det(m) · m⁻ᵀ, which also exists where `m` has no inverse. The sign of the
/// determinant is taken out so that a mirrored mesh keeps normals on its outside.
pub fn cofactor(m: Mat3) -> Mat3 {
    let c = Mat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
    if m.determinant() < 0.0 { c * -1.0 } else { c }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Mesh, MorphTarget, Node, Skin, Transform};
    use glam::{Quat, Vec4};

    fn one_vertex() -> Primitive {
        Primitive {
            positions: vec![Vec3::new(1.0, 0.0, 0.0)],
            normals: vec![Vec3::X],
            tangents: vec![Vec4::new(0.0, 1.0, 0.0, 1.0)],
            ..Primitive::default()
        }
    }

    fn scene(primitive: Primitive, local: Mat4) -> Scene {
        Scene {
            nodes: vec![Node { mesh: Some(0), local: Transform::Matrix(local), ..Node::default() }],
            meshes: vec![Mesh { primitives: vec![primitive], ..Mesh::default() }],
            ..Scene::default()
        }
    }

    fn first(scene: &Scene) -> (Vec3, Vec3, Vec4) {
        let v = world_vertices(scene, &Pose::rest(scene), 0, &scene.meshes[0].primitives[0]);
        (v.positions[0], v.normals[0], v.tangents[0])
    }

    #[test]
    fn normals_stay_perpendicular_under_uneven_scale() {
        let slanted = Primitive {
            positions: vec![Vec3::ZERO],
            normals: vec![Vec3::new(1.0, 1.0, 0.0).normalize()],
            tangents: vec![Vec3::new(1.0, -1.0, 0.0).normalize().extend(1.0)],
            ..Primitive::default()
        };
        let (_, normal, tangent) = first(&scene(slanted, Mat4::from_scale(Vec3::new(3.0, 1.0, 0.5))));
        assert!(normal.dot(tangent.truncate()).abs() < 1e-6);
        assert!((normal.length() - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_mirror_keeps_normals_outside_and_swaps_the_handedness() {
        let (position, normal, tangent) = first(&scene(one_vertex(), Mat4::from_scale(Vec3::new(-1.0, 1.0, 1.0))));
        assert_eq!((position, normal), (Vec3::NEG_X, Vec3::NEG_X));
        assert_eq!(tangent.w, -1.0);
    }

    #[test]
    fn morph_targets_add_their_weighted_differences() {
        let target = |x: f32| MorphTarget { positions: vec![Vec3::new(0.0, x, 0.0)], ..MorphTarget::default() };
        let mut scene = scene(Primitive { morphs: vec![target(2.0), target(10.0)], ..one_vertex() }, Mat4::IDENTITY);
        scene.nodes[0].weights = vec![0.5, 0.25];
        assert_eq!(first(&scene).0, Vec3::new(1.0, 3.5, 0.0));
    }

    #[test]
    fn a_skinned_vertex_ignores_its_node_and_follows_its_joints() {
        let mut primitive = one_vertex();
        primitive.joints = vec![vec![[0, 1, 0, 0]]];
        primitive.weights = vec![vec![Vec4::new(0.5, 0.5, 0.0, 0.0)]];
        let mut scene = scene(primitive, Mat4::from_translation(Vec3::splat(100.0)));
        let joint = |matrix| Node { local: Transform::Matrix(matrix), ..Node::default() };
        scene.nodes.push(joint(Mat4::from_translation(Vec3::new(0.0, 4.0, 0.0))));
        scene.nodes.push(joint(Mat4::from_quat(Quat::from_rotation_z(std::f32::consts::PI))));
        scene.skins = vec![Skin { name: String::new(), joints: vec![1, 2], inverse_bind: vec![Mat4::IDENTITY; 2] }];
        scene.nodes[0].skin = Some(0);
        // Half of (1, 4, 0) and half of (−1, 0, 0).
        assert!(first(&scene).0.abs_diff_eq(Vec3::new(0.0, 2.0, 0.0), 1e-6));
    }
}

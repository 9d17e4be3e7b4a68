//! Skinned and morphed primitives: what the GPU needs to deform them, and boxes that hold them whatever the pose.

use super::geometry::{NONE, Range, Streams};
use crate::{
    Result,
    graph::{Buffer, Graph},
    scene::{Aabb, MorphTarget, Pose, Primitive, Scene},
    shaders::{
        scene::{deform as shader, morph_stream},
        types,
    },
};
use glam::{Mat4, Vec2, Vec3, Vec4};

/// One primitive of one node that changes shape.
#[derive(Clone, Debug)]
pub(super) struct Job {
    pub node: usize,
    /// Skin whose joints move it; `None`: morphed only, stays in the space of its node.
    pub skin: Option<usize>,
    push: shader::Push,
    /// Texture coordinates and colours that morph: `true` for colours.
    streams: Vec<(bool, morph_stream::Push)>,
    bounds: Extent,
}

/// What a box around the deformed primitive is made from.
#[derive(Clone, Debug, Default)]
struct Extent {
    /// Vertices at rest that each joint moves; without a skin one entry for the node itself.
    joints: Vec<(usize, Aabb)>,
    /// Largest shift by each morph target at weight one.
    morphs: Vec<f32>,
}

/// Static data of all jobs.
#[derive(Debug, Default)]
pub(super) struct Deform {
    pub jobs: Vec<Job>,
    pub skin_vertices: Vec<types::SkinVertex>,
    pub morph_deltas: Vec<types::MorphDelta>,
    /// Differences of texture coordinates and colours, number by number.
    pub stream_deltas: Vec<f32>,
    /// Matrices and weights of one frame, in all.
    joints: u32,
    weights: u32,
}

/// Does `primitive` change shape at a node with or without a skin?
pub(crate) fn deforms(primitive: &Primitive, skinned: bool) -> bool {
    !primitive.morphs.is_empty() || (skinned && !primitive.joints.is_empty())
}

impl Deform {
    /// Adds `primitive` of `node`; returns the job and where it writes: `range` with other first vertices.
    ///
    /// # Errors
    /// As [`Streams::new`].
    pub fn add(
        &mut self,
        scene: &Scene,
        node: usize,
        primitive: &Primitive,
        range: &Range,
        streams: &mut Streams,
    ) -> Result<(usize, Range)> {
        let target = streams.reserve(range)?;
        let mut written = Range { first_vertex: target, ..*range };
        let streams = self.streams(primitive, &mut written, streams)?;
        let skin = scene.nodes[node].skin.map(|s| s as usize).filter(|_| !primitive.joints.is_empty());
        let joint_count = skin.map_or(0, |s| scene.skins[s].joints.len());
        let push = shader::Push {
            source: range.first_vertex,
            target,
            count: range.vertices,
            joint_sets: if skin.is_some() { primitive.joints.len() as u32 } else { 0 },
            skin_first: self.skin_vertices.len() as u32,
            joint_first: self.joints,
            joint_count: joint_count as u32,
            morph_targets: primitive.morphs.len() as u32,
            morph_first: self.morph_deltas.len() as u32,
            weight_first: self.weights,
        };
        if skin.is_some() {
            for (joints, weights) in primitive.joints.iter().zip(&primitive.weights) {
                self.skin_vertices.extend(joints.iter().zip(weights).map(|(joints, weights)| {
                    let [a, b, c, d] = joints.map(u32::from);
                    types::SkinVertex { joints: [a | b << 16, c | d << 16], weights: weights.to_array() }
                }));
            }
        }
        for morph in &primitive.morphs {
            let at = |list: &[Vec3], i: usize| list.get(i).copied().unwrap_or(Vec3::ZERO).to_array();
            self.morph_deltas.extend((0..primitive.positions.len()).map(|i| types::MorphDelta {
                position: at(&morph.positions, i),
                normal: at(&morph.normals, i),
                tangent: at(&morph.tangents, i),
            }));
        }
        self.joints += joint_count as u32;
        self.weights += primitive.morphs.len() as u32;
        self.jobs.push(Job { node, skin, push, streams, bounds: Extent::new(primitive, skin.is_some()) });
        Ok((self.jobs.len() - 1, written))
    }

    /// The streams of `primitive` that its morph targets change besides its vertices; `range` gets their copies.
    fn streams(
        &mut self,
        primitive: &Primitive,
        range: &mut Range,
        streams: &mut Streams,
    ) -> Result<Vec<(bool, morph_stream::Push)>> {
        let mut out = Vec::new();
        let vertices = range.vertices;
        let mut add = |deltas: &mut Vec<f32>, numbers: u32, source: u32, target: u32, of: Vec<Vec<f32>>| {
            let push = morph_stream::Push {
                source: source * numbers,
                target: target * numbers,
                count: vertices * numbers,
                targets: of.len() as u32,
                delta_first: deltas.len() as u32,
                weight_first: self.weights,
                limited: u32::from(numbers == 4),
            };
            for mut target in of {
                target.resize((vertices * numbers) as usize, 0.0);
                deltas.extend(target);
            }
            out.push((numbers == 4, push));
        };
        for (set, first) in range.uv_first.iter_mut().enumerate().filter(|(_, first)| **first != NONE) {
            if primitive.morphs.iter().any(|m| m.uvs.get(set).is_some_and(|uvs| !uvs.is_empty())) {
                let copy = streams.reserve_uvs(*first, vertices)?;
                let of =
                    |m: &MorphTarget| m.uvs.get(set).into_iter().flatten().flat_map(|d: &Vec2| d.to_array()).collect();
                add(&mut self.stream_deltas, 2, *first, copy, primitive.morphs.iter().map(of).collect());
                *first = copy;
            }
        }
        if range.color_first != NONE && primitive.morphs.iter().any(|m| !m.colors.is_empty()) {
            let copy = streams.reserve_colors(range.color_first, vertices)?;
            let of = |m: &MorphTarget| m.colors.iter().flat_map(|d: &Vec4| d.to_array()).collect();
            add(&mut self.stream_deltas, 4, range.color_first, copy, primitive.morphs.iter().map(of).collect());
            range.color_first = copy;
        }
        Ok(out)
    }

    /// Forgets the vertices, which the device has now.
    pub fn uploaded(self) -> Self {
        Self { skin_vertices: Vec::new(), morph_deltas: Vec::new(), stream_deltas: Vec::new(), ..self }
    }

    /// World boxes of the jobs in `pose`, in their order.
    pub fn bounds(&self, scene: &Scene, pose: &Pose) -> Vec<Aabb> {
        self.jobs
            .iter()
            .map(|job| match job.skin {
                Some(skin) => job.bounds.at(&pose.joints(scene, skin), &pose.weights[job.node]),
                None => job.bounds.at(&[pose.world[job.node]], &pose.weights[job.node]),
            })
            .collect()
    }

    /// Declares the passes that bring the streams into `pose`.
    pub fn declare(&self, graph: &mut Graph, scene: &Scene, pose: &Pose, buffers: &Buffers) {
        if self.jobs.is_empty() {
            return;
        }
        let mut joints: Vec<[[f32; 4]; 4]> = Vec::new();
        let mut weights: Vec<f32> = Vec::new();
        for job in &self.jobs {
            if let Some(skin) = job.skin {
                joints.extend(pose.joints(scene, skin).iter().map(Mat4::to_cols_array_2d));
            }
            let of_node = &pose.weights[job.node];
            weights.extend((0..job.push.morph_targets as usize).map(|i| of_node.get(i).copied().unwrap_or(0.0)));
        }
        joints.resize(joints.len().max(1), Default::default());
        weights.resize(weights.len().max(1), 0.0);
        let joints = graph.buffer_from("scene.joints", &joints);
        let weights = graph.buffer_from("scene.morph weights", &weights);
        graph.scope("deform", |graph| {
            for job in self.jobs.iter().filter(|j| j.push.count > 0) {
                let args = shader::Args {
                    positions: buffers.positions,
                    normals: buffers.normals,
                    tangents: buffers.tangents,
                    skin_vertices: buffers.skin_vertices,
                    morph_deltas: buffers.morph_deltas,
                    joints,
                    weights,
                    push: job.push,
                };
                graph.compute(args, job.push.count);
                for &(colors, push) in &job.streams {
                    let stream = if colors { buffers.colors } else { buffers.uvs };
                    let stream_deltas = buffers.stream_deltas;
                    graph.compute(morph_stream::Args { stream, stream_deltas, weights, push }, push.count);
                }
            }
        });
    }
}

/// Streams that deforming reads and writes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Buffers {
    pub positions: Buffer,
    pub normals: Buffer,
    pub tangents: Buffer,
    pub skin_vertices: Buffer,
    pub morph_deltas: Buffer,
    pub stream_deltas: Buffer,
    pub uvs: Buffer,
    pub colors: Buffer,
}

impl Extent {
    fn new(primitive: &Primitive, skinned: bool) -> Self {
        let longest = |m: &MorphTarget| m.positions.iter().map(|d| d.length()).fold(0.0, f32::max);
        let morphs = primitive.morphs.iter().map(longest).collect();
        if !skinned {
            return Self { joints: vec![(0, Aabb::of(primitive.positions.iter().copied()))], morphs };
        }
        let mut joints: Vec<Aabb> = Vec::new();
        for (set, weights) in primitive.joints.iter().zip(&primitive.weights) {
            for ((joint, weight), position) in set.iter().zip(weights).zip(&primitive.positions) {
                for (joint, weight) in joint.iter().zip(weight.to_array()).filter(|(_, w)| *w != 0.0) {
                    let joint = usize::from(*joint);
                    joints.resize(joints.len().max(joint + 1), Aabb::EMPTY);
                    joints[joint] = joints[joint].with(*position);
                    // Weights that do not lie in [0, 1] reach outside of the hull; no box is promised then.
                    if !(0.0..=1.001).contains(&weight) {
                        joints[joint] = Aabb { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY };
                    }
                }
            }
        }
        Self { joints: joints.into_iter().enumerate().filter(|(_, b)| !b.is_empty()).collect(), morphs }
    }

    /// A vertex is a weighted mean of where its joints carry it, so it lies in the box around those places.
    fn at(&self, matrices: &[Mat4], weights: &[f32]) -> Aabb {
        let reach: f32 = self.morphs.iter().zip(weights).map(|(m, w)| m * w.abs()).sum();
        let place = |(joint, rest): &(usize, Aabb)| match matrices.get(*joint) {
            Some(matrix) if rest.is_finite() => rest.grown(reach).transformed(matrix),
            Some(_) => *rest,
            None => Aabb::EMPTY,
        };
        self.joints.iter().map(place).fold(Aabb::EMPTY, Aabb::union)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Node, Skin, Transform, deform::world_vertices};
    use glam::{Quat, Vec4};
    use proptest::prelude::*;

    fn bent(angle: f32, weight: f32) -> Scene {
        let positions: Vec<Vec3> = (0..20).map(|i| Vec3::new(i as f32 * 0.1, (i % 3) as f32 * 0.2, 0.1)).collect();
        let share = |i: usize| i as f32 / 19.0;
        let primitive = Primitive {
            normals: vec![Vec3::Z; 20],
            tangents: vec![Vec4::X; 20],
            joints: vec![vec![[0, 1, 0, 0]; 20]],
            weights: vec![(0..20).map(|i| Vec4::new(1.0 - share(i), share(i), 0.0, 0.0)).collect()],
            morphs: vec![MorphTarget { positions: vec![Vec3::new(0.0, 0.0, 3.0); 20], ..MorphTarget::default() }],
            positions,
            ..Primitive::default()
        };
        let joint = |m| Node { local: Transform::Matrix(m), ..Node::default() };
        let turn = Mat4::from_rotation_translation(Quat::from_rotation_z(angle), Vec3::new(1.0, 2.0, 0.0));
        let body = Node { mesh: Some(0), skin: Some(0), weights: vec![weight], ..Node::default() };
        Scene {
            nodes: vec![body, joint(Mat4::IDENTITY), joint(turn)],
            meshes: vec![crate::scene::Mesh { primitives: vec![primitive], ..Default::default() }],
            skins: vec![Skin { name: String::new(), joints: vec![1, 2], inverse_bind: vec![Mat4::IDENTITY; 2] }],
            ..Scene::default()
        }
    }

    proptest! {
        #[test]
        fn the_box_holds_every_deformed_vertex(angle in -3.2f32..3.2, weight in -2.0f32..2.0) {
            let scene = bent(angle, weight);
            let pose = Pose::rest(&scene);
            let mut streams = Streams::new(&scene).unwrap();
            let (range, primitive) = (streams.ranges[0][0], &scene.meshes[0].primitives[0]);
            let mut deform = Deform::default();
            deform.add(&scene, 0, primitive, &range, &mut streams).unwrap();
            let bounds = deform.bounds(&scene, &pose)[0].grown(1e-4);
            for p in world_vertices(&scene, &pose, 0, primitive).positions {
                prop_assert!(bounds.min.cmple(p).all() && p.cmple(bounds.max).all(), "{p} {bounds:?}");
            }
        }
    }
}

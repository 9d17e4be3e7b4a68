//! Poses: world matrices and morph weights of a scene at a time (glTF 2.0, section 3.11 and appendix C).
//!
//! Keys are few, so they are sampled on the CPU; vertices are many, so skinning and morphing run on the GPU.

use super::{Animation, Channel, Interpolation, Keys, Scene, Transform};
use glam::{Mat4, Quat, Vec3};

/// Where every node stands and how every mesh is morphed at one time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pose {
    /// `world_from_node`, one a node.
    pub world: Vec<Mat4>,
    /// Morph weights, one list a node; empty for nodes without a morphed mesh.
    pub weights: Vec<Vec<f32>>,
}

impl Pose {
    /// The scene as it stands in the file, no animation applied.
    pub fn rest(scene: &Scene) -> Self {
        Self::of(scene, scene.nodes.iter().map(|node| node.local).collect(), base_weights(scene))
    }

    /// The scene `seconds` into `animation` (index into [`Scene::animations`]).
    ///
    /// Before a channel's first key its first value holds, after the last key its last. An index that the scene lacks
    /// gives the rest pose. To loop, pass the time through [`looped`].
    pub fn at(scene: &Scene, animation: usize, seconds: f32) -> Self {
        Self::mixed(scene, scene.animations.get(animation).map(|a| (a, seconds)).into_iter())
    }

    /// The scene after `seconds` with all its animations playing in loops. Where several drive the same property of a
    /// node, the first in the scene's list has it: a file with many clips of one figure shows its first clip, a file with
    /// one clip for each object shows them all.
    pub fn playing(scene: &Scene, seconds: f32) -> Self {
        // Later writes win, so the first clip comes last.
        Self::mixed(scene, scene.animations.iter().rev().map(|a| (a, looped(a, seconds))))
    }

    fn mixed<'a>(scene: &Scene, clips: impl Iterator<Item = (&'a Animation, f32)>) -> Self {
        let mut locals: Vec<Transform> = scene.nodes.iter().map(|node| node.local).collect();
        let mut weights = base_weights(scene);
        for (channel, seconds) in clips.flat_map(|(a, seconds)| a.channels.iter().map(move |c| (c, seconds))) {
            let node = channel.node as usize;
            match (sample(channel, seconds), locals.get_mut(node)) {
                (Some(Value::Weights(values)), Some(_)) => weights[node] = values,
                (Some(value), Some(Transform::Trs { translation, rotation, scale })) => match value {
                    Value::Translation(v) => *translation = v,
                    Value::Rotation(q) => *rotation = q,
                    Value::Scale(v) => *scale = v,
                    Value::Weights(_) => {}
                },
                // A matrix node cannot be animated (glTF 3.11); the front end has reported it.
                _ => {}
            }
        }
        Self::of(scene, locals, weights)
    }

    fn of(scene: &Scene, locals: Vec<Transform>, weights: Vec<Vec<f32>>) -> Self {
        let mut world: Vec<Mat4> = Vec::with_capacity(locals.len());
        for (node, local) in scene.nodes.iter().zip(&locals) {
            let matrix = local.matrix();
            // Parents stand before their children.
            let parent = node.parent.and_then(|p| world.get(p as usize).copied());
            world.push(parent.map_or(matrix, |parent| parent * matrix));
        }
        Self { world, weights }
    }

    /// `world_from_mesh` of each joint of skin `skin`: joint transform · inverse bind matrix. The transform of the node
    /// that carries the skinned mesh does not count (glTF 3.7.3.3).
    pub fn joints(&self, scene: &Scene, skin: usize) -> Vec<Mat4> {
        let skin = &scene.skins[skin];
        let joint = |i: usize| self.world[skin.joints[i] as usize];
        (0..skin.joints.len()).map(|i| joint(i) * skin.inverse_bind.get(i).copied().unwrap_or(Mat4::IDENTITY)).collect()
    }
}

/// Wraps `seconds` into the duration of `animation`, so that it plays in a loop. A time of exactly one duration shows the
/// last key, as a viewer expects of `--time`.
pub fn looped(animation: &Animation, seconds: f32) -> f32 {
    let duration = animation.duration();
    if duration <= 0.0 || (0.0..=duration).contains(&seconds) { seconds.max(0.0) } else { seconds.rem_euclid(duration) }
}

fn base_weights(scene: &Scene) -> Vec<Vec<f32>> {
    let of = |node: &super::Node| match node.mesh {
        Some(_) if !node.weights.is_empty() => node.weights.clone(),
        Some(mesh) => scene.meshes[mesh as usize].weights.clone(),
        None => Vec::new(),
    };
    scene.nodes.iter().map(of).collect()
}

#[derive(Clone, Debug, PartialEq)]
enum Value {
    Translation(Vec3),
    Rotation(Quat),
    Scale(Vec3),
    Weights(Vec<f32>),
}

/// The value of a channel at a time; nothing for a channel without keys.
fn sample(channel: &Channel, seconds: f32) -> Option<Value> {
    let span = Span::find(&channel.times, seconds)?;
    let mode = channel.interpolation;
    Some(match &channel.values {
        Keys::Translation(keys) => Value::Translation(span.vectors(mode, keys)?),
        Keys::Scale(keys) => Value::Scale(span.vectors(mode, keys)?),
        Keys::Rotation(keys) => Value::Rotation(span.rotation(mode, keys)?),
        Keys::Weights { count, values } => Value::Weights(
            (0..*count)
                .map(|i| span.number(mode, |key| values.get(key * count + i).copied()))
                .collect::<Option<Vec<f32>>>()?,
        ),
    })
}

/// Two keys and the place between them.
#[derive(Clone, Copy, Debug)]
struct Span {
    from: usize,
    to: usize,
    /// 0 at `from`, 1 at `to`.
    t: f32,
    /// Seconds from `from` to `to`.
    length: f32,
}

impl Span {
    fn find(times: &[f32], seconds: f32) -> Option<Self> {
        let last = times.len().checked_sub(1)?;
        let after = times.partition_point(|&time| time <= seconds);
        Some(match after {
            0 => Self { from: 0, to: 0, t: 0.0, length: 0.0 },
            n if n > last => Self { from: last, to: last, t: 0.0, length: 0.0 },
            n => {
                let length = times[n] - times[n - 1];
                Self { from: n - 1, to: n, t: (seconds - times[n - 1]) / length, length }
            }
        })
    }

    /// Interpolates anything linear; `key(i)` is the i-th stored entry.
    fn linear<V>(&self, mode: Interpolation, key: impl Fn(usize) -> Option<V>) -> Option<V>
    where
        V: std::ops::Mul<f32, Output = V> + std::ops::Add<Output = V>,
    {
        let t = self.t;
        match mode {
            Interpolation::Step => key(self.from),
            Interpolation::Linear if self.from == self.to => key(self.from),
            Interpolation::Linear => Some(key(self.from)? * (1.0 - t) + key(self.to)? * t),
            Interpolation::CubicSpline => {
                // glTF appendix C.4: three entries a key (in-tangent, value, out-tangent); tangents are scaled by the span.
                let (t2, t3) = (t * t, t * t * t);
                let from = key(3 * self.from + 1)? * (2.0 * t3 - 3.0 * t2 + 1.0);
                let out = key(3 * self.from + 2)? * (self.length * (t3 - 2.0 * t2 + t));
                let to = key(3 * self.to + 1)? * (-2.0 * t3 + 3.0 * t2);
                let into = key(3 * self.to)? * (self.length * (t3 - t2));
                Some(from + out + to + into)
            }
        }
    }

    fn vectors(&self, mode: Interpolation, keys: &[Vec3]) -> Option<Vec3> {
        self.linear(mode, |i| keys.get(i).copied())
    }

    fn number(&self, mode: Interpolation, key: impl Fn(usize) -> Option<f32>) -> Option<f32> {
        self.linear(mode, key)
    }

    fn rotation(&self, mode: Interpolation, keys: &[Quat]) -> Option<Quat> {
        let q = match mode {
            // Shortest way around, constant angular speed (glTF C.3).
            Interpolation::Linear => keys.get(self.from)?.slerp(*keys.get(self.to)?, self.t),
            _ => self.linear(mode, |i| keys.get(i).copied())?,
        };
        let length = q.length();
        // A spline through opposite quaternions passes zero: no direction is right there, so keep the nearer key.
        Some(if length > 1e-6 { q * (1.0 / length) } else { *keys.get(self.from).unwrap_or(&Quat::IDENTITY) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Mesh, Node, Skin};
    use std::f32::consts::{FRAC_PI_2, PI};

    fn channel(interpolation: Interpolation, times: &[f32], values: Keys) -> Channel {
        Channel { node: 0, interpolation, times: times.to_vec(), values }
    }

    fn translation(mode: Interpolation, values: &[f32], seconds: f32) -> f32 {
        let keys = values.iter().map(|&x| Vec3::new(x, 0.0, 0.0)).collect();
        match sample(&channel(mode, &[1.0, 2.0, 4.0], Keys::Translation(keys)), seconds) {
            Some(Value::Translation(v)) => v.x,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn step_and_linear_hit_their_keys_and_hold_outside() {
        let keys = [10.0, 20.0, 40.0];
        for mode in [Interpolation::Step, Interpolation::Linear] {
            for (time, value) in [(-5.0, 10.0), (1.0, 10.0), (2.0, 20.0), (4.0, 40.0), (99.0, 40.0)] {
                assert_eq!(translation(mode, &keys, time), value, "{mode:?} at {time}");
            }
        }
        assert_eq!(translation(Interpolation::Step, &keys, 3.999), 20.0);
        assert_eq!(translation(Interpolation::Linear, &keys, 3.0), 30.0);
        assert_eq!(translation(Interpolation::Linear, &keys, 2.5), 25.0);
    }

    #[test]
    fn a_cubic_spline_reproduces_a_cubic_polynomial() {
        // Tangents in units per second: the span's length must scale them, or the second (two-second) span is wrong.
        let f = |x: f32| 0.5 * x * x * x - 2.0 * x * x + x + 3.0;
        let slope = |x: f32| 1.5 * x * x - 4.0 * x + 1.0;
        let keys: Vec<f32> = [1.0, 2.0, 4.0].iter().flat_map(|&x| [slope(x), f(x), slope(x)]).collect();
        for i in 0..=30 {
            let time = 1.0 + 3.0 * i as f32 / 30.0;
            let got = translation(Interpolation::CubicSpline, &keys, time);
            assert!((got - f(time)).abs() < 1e-4, "{time}: {got} is not {}", f(time));
        }
    }

    #[test]
    fn rotations_turn_at_constant_speed_the_short_way() {
        let quarter = Quat::from_rotation_z(FRAC_PI_2);
        for end in [quarter, -quarter] {
            let keys = Keys::Rotation(vec![Quat::IDENTITY, end]);
            let c = channel(Interpolation::Linear, &[0.0, 1.0], keys);
            let Some(Value::Rotation(q)) = sample(&c, 0.25) else { panic!() };
            let expected = Quat::from_rotation_z(FRAC_PI_2 / 4.0);
            assert!(q.dot(expected).abs() > 1.0 - 1e-6, "{q}");
        }
    }

    #[test]
    fn spline_rotations_stay_unit() {
        let q = Quat::from_rotation_y(PI * 0.9);
        let zero = Quat::from_xyzw(0.0, 0.0, 0.0, 0.0);
        let keys = Keys::Rotation(vec![zero, Quat::IDENTITY, zero, zero, q, zero]);
        let c = channel(Interpolation::CubicSpline, &[0.0, 2.0], keys);
        for i in 0..=10 {
            let Some(Value::Rotation(r)) = sample(&c, i as f32 * 0.2) else { panic!() };
            assert!((r.length() - 1.0).abs() < 1e-5);
        }
    }

    #[test]
    fn weights_are_sampled_per_target() {
        let keys = Keys::Weights { count: 2, values: vec![0.0, 1.0, 1.0, 0.0] };
        let c = channel(Interpolation::Linear, &[0.0, 1.0], keys);
        assert_eq!(sample(&c, 0.25), Some(Value::Weights(vec![0.25, 0.75])));
    }

    #[test]
    fn children_follow_their_parents_and_joints_undo_the_bind_pose() {
        let arm = Transform::Trs { translation: Vec3::new(0.0, 2.0, 0.0), rotation: Quat::IDENTITY, scale: Vec3::ONE };
        let scene = Scene {
            nodes: vec![
                Node { local: arm, ..Node::default() },
                Node { parent: Some(0), local: arm, ..Node::default() },
            ],
            skins: vec![Skin {
                name: String::new(),
                joints: vec![0, 1],
                inverse_bind: vec![
                    Mat4::from_translation(Vec3::new(0.0, -2.0, 0.0)),
                    Mat4::from_translation(Vec3::new(0.0, -4.0, 0.0)),
                ],
            }],
            animations: vec![Animation {
                name: String::new(),
                channels: vec![channel(
                    Interpolation::Linear,
                    &[0.0, 1.0],
                    Keys::Rotation(vec![Quat::IDENTITY, Quat::from_rotation_z(FRAC_PI_2)]),
                )],
            }],
            ..Scene::default()
        };
        for joint in Pose::rest(&scene).joints(&scene, 0) {
            assert!(joint.abs_diff_eq(Mat4::IDENTITY, 1e-6));
        }
        // The first joint turns by 90° about z through (0, 2, 0): what stood at (0, 4, 0) comes to (−2, 2, 0).
        let pose = Pose::at(&scene, 0, 1.0);
        assert!(pose.world[1].transform_point3(Vec3::ZERO).abs_diff_eq(Vec3::new(-2.0, 2.0, 0.0), 1e-6));
        let moved = pose.joints(&scene, 0)[1].transform_point3(Vec3::new(0.0, 4.0, 0.0));
        assert!(moved.abs_diff_eq(Vec3::new(-2.0, 2.0, 0.0), 1e-6), "{moved}");
        assert_eq!(Pose::at(&scene, 7, 1.0), Pose::rest(&scene));
    }

    #[test]
    fn node_weights_override_those_of_the_mesh() {
        let mesh = Mesh { weights: vec![0.5], ..Mesh::default() };
        let node = |weights: Vec<f32>| Node { mesh: Some(0), weights, ..Node::default() };
        let scene = Scene { meshes: vec![mesh], nodes: vec![node(vec![]), node(vec![0.25])], ..Scene::default() };
        assert_eq!(Pose::rest(&scene).weights, vec![vec![0.5], vec![0.25]]);
    }

    #[test]
    fn all_clips_play_and_the_first_has_precedence() {
        let keys = |node, v| {
            let keys = Keys::Translation(vec![v]);
            Channel { node, ..channel(Interpolation::Step, &[0.0], keys) }
        };
        let clip = |channels| Animation { name: String::new(), channels };
        let scene = Scene {
            nodes: vec![Node::default(), Node::default()],
            animations: vec![clip(vec![keys(0, Vec3::X)]), clip(vec![keys(0, Vec3::Y), keys(1, Vec3::Z)])],
            ..Scene::default()
        };
        let at: Vec<Vec3> = Pose::playing(&scene, 0.0).world.iter().map(|m| m.w_axis.truncate()).collect();
        assert_eq!(at, [Vec3::X, Vec3::Z]);
    }

    #[test]
    fn loops_wrap_but_show_the_last_key() {
        let animation = Animation {
            name: String::new(),
            channels: vec![channel(Interpolation::Step, &[0.0, 2.0], Keys::Scale(vec![Vec3::ONE; 2]))],
        };
        for (time, expected) in [(0.5, 0.5), (2.0, 2.0), (2.5, 0.5), (-0.5, 1.5), (6.25, 0.25)] {
            assert_eq!(looped(&animation, time), expected);
        }
        assert_eq!(looped(&Animation::default(), 3.0), 3.0);
    }
}

//! Poses of occluders in a frame, and the occluders that can share samples.

use std::collections::BTreeMap;

use glam::{Mat3, Vec3};

use super::{
    Occluders,
    posed_mesh::PosedMesh,
    samples::{Grid, Shells},
    support_function::{self, SupportFunction},
};
use crate::{
    scene::{Pose, Scene},
    shaders::types,
};

/// Largest difference from a matrix that only rotates and scales uniformly.
const EVEN: f32 = 1e-4;

/// The samples around occluders with the same geometry, rotation and scale.
#[derive(Clone, Copy, Debug)]
pub struct Set {
    /// Number of the geometry.
    pub shape: usize,
    /// Linear map from the occluder's current pose to the geometry that rays are traced through.
    pub geometry_from_world: Mat3,
    /// Centre of the occluder in the geometry, metres.
    pub centre: Vec3,
    /// Radius of the bounding sphere, metres.
    pub radius: f32,
    pub shells: Shells,
}

/// All occluders of a frame in the form that shaders read.
#[derive(Clone, Debug, Default)]
pub struct FrameOccluders {
    /// In the order of [`Occluders::placed`], without occluders that have no extent.
    pub list: Vec<types::FivOccluder>,
    /// The node of each occluder.
    pub nodes: Vec<u32>,
    /// Filled share of the bounding disc of each occluder relative to its share at rest. Empty if all shares are
    /// unchanged.
    pub fills: Vec<f32>,
    /// Sets of samples. Sets of one geometry lie next to each other.
    pub sets: Vec<Set>,
    /// Support functions of occluders that deform, one after the other. The device has them after the tables of all
    /// kinds.
    pub reaches: Vec<f32>,
}

/// Inputs, beside the pose, from which the occluders of a frame are computed.
#[derive(Clone, Copy, Debug)]
pub struct PlacementInputs<'a> {
    pub scene: &'a Scene,
    pub occluders: &'a Occluders,
    /// The geometry of each placed occluder, and whether the geometry deforms.
    pub shapes: &'a [(usize, bool)],
    /// Linear transforms of the placed occluders at rest.
    pub rest: &'a [Mat3],
    pub grid: Grid,
    /// Radius of the last sphere of samples, in radii of the occluder.
    pub reach: f32,
    /// Floats from one set to the next.
    pub floats: u32,
}

impl FrameOccluders {
    /// The occluders in `pose`.
    pub fn of(inputs: &PlacementInputs<'_>, pose: &Pose) -> Self {
        let mut found = Vec::new();
        let (mut sets, mut reaches, mut fills) = (BTreeMap::new(), Vec::new(), Vec::new());
        // The pose is cloned once, because measuring an occluder changes a transform for a while.
        let mut lent = None;
        for (index, placed) in inputs.occluders.placed.iter().enumerate() {
            let Some(OccluderPose { set, centre, turn, support, fill }) =
                occluder_pose(inputs, (pose, &mut lent), index)
            else {
                continue;
            };
            let kinds = inputs.occluders.kinds.len() as u32;
            let reach = match &support {
                Some(_) => kinds + (reaches.len() / support_function::LENGTH) as u32,
                None => placed.kind,
            };
            reaches.extend(support.into_iter().flat_map(|support| support.0));
            // An occluder that deforms shares no samples.
            let alone = if inputs.shapes[index].1 { index } else { usize::MAX };
            let key = (set.shape, alone, turn.to_cols_array().map(f32::to_bits));
            sets.insert(key, set);
            fills.push(fill);
            found.push((key, placed.node, centre, set, turn, reach));
        }
        let numbers: BTreeMap<_, u32> = sets.keys().copied().zip(0..).collect();
        let Grid { azimuths, polars, radii } = inputs.grid;
        // A set beyond the range of 32-bit numbers is refused before its number is used.
        let first = |key| u32::try_from(u64::from(numbers[key]) * u64::from(inputs.floats)).unwrap_or(u32::MAX);
        let list = found.iter().map(|(key, _, centre, set, turn, reach)| types::FivOccluder {
            centre: centre.to_array(),
            radius: set.radius,
            first: first(key),
            azimuths,
            polars,
            radii,
            nearest: set.shells.nearest,
            farthest: set.shells.farthest,
            steps: set.shells.steps(radii) as f32,
            spacing: u32::MAX,
            reach: reach * support_function::LENGTH as u32,
            turned: (*turn != Mat3::IDENTITY).into(),
            to_rest: turn.transpose().to_cols_array_2d(),
            self_shadows: 1,
            ..Default::default()
        });
        Self {
            list: list.collect(),
            nodes: found.iter().map(|(_, node, ..)| *node).collect(),
            fills,
            sets: sets.into_values().collect(),
            reaches,
        }
    }
}

/// The pose of one occluder.
struct OccluderPose {
    set: Set,
    /// Centre of the bounding sphere, metres, world space.
    centre: Vec3,
    /// Linear map from the pose at rest to the current pose.
    turn: Mat3,
    /// The support function, if it is not that of the kind at rest.
    support: Option<SupportFunction>,
    /// Filled share of the bounding disc relative to the share of its kind.
    fill: f32,
}

/// `None` if the occluder has no extent.
fn occluder_pose(
    inputs: &PlacementInputs<'_>,
    (pose, lent): (&Pose, &mut Option<Pose>),
    index: usize,
) -> Option<OccluderPose> {
    let placed = inputs.occluders.placed.get(index)?;
    let (shape, deforms) = inputs.shapes[index];
    let node = placed.node as usize;
    let world = pose.world.get(node)?;
    let place = world.w_axis.truncate();
    let kind = &inputs.occluders.kinds[placed.kind as usize];
    if deforms {
        let mesh = inputs.scene.meshes.get(inputs.scene.nodes.get(node)?.mesh? as usize)?;
        let mesh = PosedMesh::of(inputs.scene, lent.get_or_insert_with(|| pose.clone()), node, mesh)?;
        let (size, centre) = (mesh.size, place + mesh.centre);
        let (radius, shells) = (size.radius, size.shells(inputs.reach));
        let set = Set { shape, geometry_from_world: Mat3::IDENTITY, centre, radius, shells };
        let (support, fill) = (Some(mesh.support_function()), size.fill(&kind.size()));
        return Some(OccluderPose { set, centre, turn: Mat3::IDENTITY, support, fill });
    }
    let (now, rest) = (Mat3::from_mat4(*world), inputs.rest[index]);
    // Without a rotation or scale the maps are the exact identity.
    let turn = if now == rest { Mat3::IDENTITY } else { now * rest.inverse() };
    let back = if now == rest { Mat3::IDENTITY } else { turn.inverse() };
    if !(turn.is_finite() && back.is_finite() && place.is_finite()) {
        return None;
    }
    // The centre stays the centre of the kind, because the support function is relative to this centre. A non-uniformly
    // scaled occluder gets a new sphere around this centre.
    let (radius, shells, fill) = match even(&turn) {
        Some(scale) => {
            let Shells { nearest, farthest } = kind.shells(inputs.reach);
            (kind.radius * scale, Shells { nearest: nearest * scale, farthest: farthest * scale }, 1.0)
        }
        None => {
            let size = kind.squeezed(&turn)?;
            (size.radius, size.shells(inputs.reach), size.fill(&kind.size()))
        }
    };
    let set = Set { shape, geometry_from_world: back, centre: Vec3::ZERO, radius, shells };
    Some(OccluderPose { set, centre: place + turn * placed.centre, turn, support: None, fill })
}

/// The scale of a matrix that only rotates, mirrors and scales uniformly.
fn even(turn: &Mat3) -> Option<f32> {
    let scale = turn.determinant().abs().cbrt();
    let square = (turn.transpose() * *turn) * (scale * scale).recip();
    square.abs_diff_eq(Mat3::IDENTITY, EVEN).then_some(scale)
}

#[cfg(test)]
mod tests {
    use glam::{Mat4, Quat, vec3};

    use super::*;
    use crate::builtin;

    #[test]
    fn a_turn_keeps_the_size_and_a_squeeze_is_measured() {
        let turn = Mat3::from_quat(Quat::from_rotation_y(0.7) * Quat::from_rotation_x(0.3));
        assert!((even(&turn).unwrap() - 1.0).abs() < 1e-5);
        assert!((even(&(turn * -2.5)).unwrap() - 2.5).abs() < 1e-4);
        assert_eq!(even(&Mat3::IDENTITY), Some(1.0));
        assert_eq!(even(&(turn * Mat3::from_diagonal(vec3(1.0, 1.0, 1.2)))), None);
        assert_eq!(even(&Mat3::ZERO), None);
    }

    #[test]
    fn occluders_that_stand_alike_share_and_what_has_no_extent_is_left_out() {
        let scene = builtin::load("primitives").unwrap();
        let rest = Pose::rest(&scene);
        let occluders = Occluders::of(&scene, &rest, false, 1.0);
        let shapes: Vec<_> = occluders.placed.iter().map(|p| (p.kind as usize, false)).collect();
        let linear: Vec<_> = occluders.placed.iter().map(|p| Mat3::from_mat4(rest.world[p.node as usize])).collect();
        let inputs = PlacementInputs {
            scene: &scene,
            occluders: &occluders,
            shapes: &shapes,
            rest: &linear,
            grid: Grid::of(8, 5, 4),
            reach: 16.0,
            floats: 2048 * 9,
        };
        // Sets with more samples than a shader can number are refused later by the device's limits.
        assert_eq!(FrameOccluders::of(&PlacementInputs { floats: u32::MAX, ..inputs }, &rest).list[2].first, u32::MAX);
        let still = FrameOccluders::of(&inputs, &rest);
        assert_eq!((still.list.len(), still.sets.len()), (occluders.placed.len(), occluders.kinds.len()));
        for (found, placed) in still.list.iter().zip(&occluders.placed) {
            assert_eq!(found.radius, occluders.kinds[placed.kind as usize].radius);
            let set = &still.sets[(found.first / inputs.floats) as usize];
            assert_eq!((set.shape, set.geometry_from_world), (placed.kind as usize, Mat3::IDENTITY));
        }
        // The first occluder is rotated and scaled, the second has a scale of 0.
        let mut pose = rest.clone();
        let node = occluders.placed[0].node as usize;
        pose.world[node] = pose.world[node] * Mat4::from_rotation_x(0.4) * Mat4::from_scale(vec3(1.0, 1.3, 1.0));
        pose.world[occluders.placed[1].node as usize] *= Mat4::from_scale(Vec3::ZERO);
        let moved = FrameOccluders::of(&inputs, &pose);
        assert_eq!(moved.list.len(), occluders.placed.len() - 1);
        let set = &moved.sets[(moved.list[0].first / inputs.floats) as usize];
        // The centre of the sphere is the centre that the geometry has.
        let world = Vec3::from(moved.list[0].centre) - pose.world[node].w_axis.truncate();
        let there = set.geometry_from_world * world - occluders.placed[0].centre;
        assert!((there - set.centre).length() < 1e-4 && set.radius > 0.0, "{there} {}", set.centre);
    }
}

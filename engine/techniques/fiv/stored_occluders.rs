//! Poses of occluders relative to their precomputed vectors.

use std::collections::HashSet;

use super::{
    Fiv, Method, Settings, occluder_rotation, online_occluders::FrameOccluders, spacing::Spacing, support_function,
};
use crate::{
    resident::Instance,
    scene::{Note, NoteKind, Pose, Scene},
    shaders::{
        consts::{FIV_FLOATS, FIV_SPACING_KNOTS},
        types,
    },
};

/// Marks a missing occluder, vector or table.
const NONE: u32 = u32::MAX;

impl Fiv {
    /// The occluders of a frame with precomputed vectors.
    pub(super) fn stored(&self, pose: &Pose, deforming: &HashSet<u32>) -> FrameOccluders {
        let grid = self.plan.grid;
        let spacing = self.firsts.last().map_or(0, |samples| *samples as u32 * FIV_FLOATS);
        let placed = self.occluders.placed.iter().map(|placed| {
            let kind = &self.plan.occluders[placed.kind as usize];
            let angle = self.angle(pose, placed.node);
            let turned = occluder_rotation::rotation(angle.unwrap_or(0.0), self.plan.turn_axis);
            let (first, second, blend) = occluder_rotation::between(angle.unwrap_or(0.0), self.plan.turns);
            let table = spacing + placed.kind * (3 * FIV_SPACING_KNOTS + grid.radii);
            types::FivOccluder {
                centre: (pose.world[placed.node as usize].w_axis.truncate() + turned * placed.centre).to_array(),
                radius: kind.radius,
                first: self.first_float(placed.kind, first, 0),
                second: self.first_float(placed.kind, second, 0),
                blend,
                azimuths: grid.azimuths,
                polars: grid.polars,
                radii: grid.radii,
                nearest: kind.shells.nearest,
                farthest: kind.shells.farthest,
                steps: kind.shells.steps(grid.radii) as f32,
                spacing: if kind.spacing == Spacing::default() { NONE } else { table },
                reach: placed.kind * support_function::LENGTH as u32,
                self_shadows: (angle.is_some() && !deforming.contains(&placed.node)).into(),
                turned: angle.is_some_and(|angle| angle != 0.0).into(),
                to_rest: turned.transpose().to_cols_array_2d(),
                ..Default::default()
            }
        });
        let nodes = self.occluders.placed.iter().map(|placed| placed.node).collect();
        FrameOccluders { list: placed.collect(), nodes, ..FrameOccluders::default() }
    }

    /// For each instance the number of its occluder and the first vectors of its vertices. The vectors are left out if
    /// the occluder's pose has no vectors.
    pub(super) fn owners(
        &self,
        (pose, deforming): (&Pose, &HashSet<u32>),
        nodes: &[u32],
        instances: &[Instance],
        settings: &Settings,
    ) -> Vec<types::FivOwner> {
        let none = types::FivOwner {
            occluder: NONE,
            front: NONE,
            back: NONE,
            front_next: NONE,
            back_next: NONE,
            ..Default::default()
        };
        let mut of_node = vec![NONE; self.at_rest.world.len()];
        for (at, node) in nodes.iter().enumerate().rev() {
            of_node[*node as usize] = at as u32;
        }
        let known = settings.method == Method::Vectors && self.plan.surface;
        let (mut node, mut slot) = (NONE, 0);
        let mut owners: Vec<_> = instances
            .iter()
            .map(|instance| {
                // Primitives of a node are next to each other, in their order.
                slot = if instance.node == node { slot + 1 } else { 0 };
                node = instance.node;
                let occluder = of_node.get(node as usize).copied().unwrap_or(NONE);
                let mut owner = types::FivOwner { occluder, ..none };
                // With precomputed vectors all occluders are in the list, in their order.
                let placed = self.occluders.placed.get(occluder as usize).filter(|_| known);
                let Some(placed) = placed else { return owner };
                let angle = self.angle(pose, node).filter(|_| !deforming.contains(&node));
                let Some(angle) = angle else {
                    return owner;
                };
                let (turn, next, blend) = occluder_rotation::between(angle, self.plan.turns);
                let mut first = self.plan.grid.count();
                for own in &self.occluders.kinds[placed.kind as usize].own {
                    if own.slot == slot {
                        let at = |turn: u32, sample: u32| self.first_float(placed.kind, turn, sample);
                        let back = first + own.corners;
                        (owner.front, owner.front_next) = (at(turn, first), at(next, first));
                        if own.backs {
                            (owner.back, owner.back_next) = (at(turn, back), at(next, back));
                        }
                        owner.flipped = (instance.world_from_object.determinant() < 0.0).into();
                        owner.blend = blend;
                    }
                    first += own.count();
                }
                owner
            })
            .collect();
        owners.resize(owners.len().max(1), none);
        owners
    }

    /// First float of the vector of a sample.
    fn first_float(&self, kind: u32, turn: u32, sample: u32) -> u32 {
        let of_turn = self.plan.of_turn(&self.plan.occluders[kind as usize]) as u32;
        (self.firsts[kind as usize] as u32 + turn * of_turn + sample) * FIV_FLOATS
    }

    /// Nodes whose meshes may differ from the meshes that the vectors were computed for.
    pub(super) fn deforming(&self, pose: &Pose, instances: &[Instance]) -> HashSet<u32> {
        let moved = *pose != self.at_rest;
        instances.iter().filter(|instance| moved && instance.deformed).map(|instance| instance.node).collect()
    }

    /// Notes on occluders whose current pose has no vectors.
    pub(super) fn turned(&self, scene: &Scene, pose: &Pose, instances: &[Instance]) -> Vec<Note> {
        let deforming = self.deforming(pose, instances);
        let what = |node: u32| match (self.angle(pose, node), deforming.contains(&node)) {
            (_, true) => Some("deforms"),
            (None, _) => Some("rotates or changes its size"),
            _ => None,
        };
        let found = self.occluders.placed.iter().filter_map(|placed| Some((placed.node, what(placed.node)?)));
        found
            .map(|(node, what)| Note {
                kind: NoteKind::Approximated,
                place: format!("nodes[{node}] ({})", scene.nodes[node as usize].name),
                text: format!(
                    "{what}; its shadow on other surfaces stays the shadow of its pose at rest, and it has no shadow on \
                     itself (fiv.method=online computes both)"
                ),
            })
            .collect()
    }
}

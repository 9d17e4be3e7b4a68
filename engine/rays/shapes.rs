//! Shapes: the groups of triangles that share a bottom tree, and the instances that use each shape.

use super::{
    encode::{WORDS, encode},
    tree::Tree,
};
use crate::{
    resident::deforms,
    scene::{Aabb, AlphaMode, Material, Pose, Primitive, Scene},
    shaders::consts::{TRACE_CUTOUT, TRACE_REVERSED, TRACE_SINGLE_SIDED, TRACE_UNLIT},
};
use glam::{Mat3, Mat4, Vec3};
use std::collections::{BTreeMap, HashSet};

/// Static instances of shared shapes are copied into the merged tree, as long as the scene then has no more triangles than this.
const MERGED_TRIANGLES: usize = 2_000_000;

/// A triangle of a shape.
#[derive(Clone, Copy, Debug)]
pub struct Record {
    pub corners: [Vec3; 3],
    /// Relative to the first instance of the shape's use.
    pub instance: u32,
    pub triangle: u32,
    /// Flags: `TRACE_SINGLE_SIDED` and others.
    pub surface: u32,
}

/// The triangles of a shape, and the location of its tree on the device.
#[derive(Debug)]
pub struct Shape {
    /// In the rest pose.
    pub bounds: Aabb,
    /// The shape holds all static objects, in world space.
    pub merged: bool,
    /// The vertices are rewritten in each frame.
    pub deformed: bool,
    /// Number of the root node.
    pub root: u32,
    /// First node of each level from the root, and the number of nodes.
    pub levels: Vec<u32>,
    pub first_record: u32,
    records: u32,
}

/// A use of a shape by instances.
#[derive(Clone, Copy, Debug)]
pub struct Use {
    pub shape: usize,
    /// Index of the first instance in the resident scene. All instances of the use have the same transform.
    pub first_instance: u32,
}

/// One primitive of one node, in the order of the resident scene's instances.
struct Piece<'a> {
    node: usize,
    mesh: usize,
    primitive: &'a Primitive,
    material: &'a Material,
    deformed: bool,
}

fn pieces(scene: &Scene) -> Vec<Piece<'_>> {
    let mut out = Vec::new();
    for (node, n) in scene.nodes.iter().enumerate() {
        let Some(mesh) = n.mesh.map(|m| m as usize) else { continue };
        for primitive in scene.meshes.get(mesh).map_or(&[][..], |m| &m.primitives) {
            let Some(material) = scene.materials.get(primitive.material as usize) else { continue };
            let deformed = deforms(primitive, n.skin.is_some());
            out.push(Piece { node, mesh, primitive, material, deformed });
        }
    }
    out
}

/// For each node, whether an animation moves it or one of its ancestors.
fn moving(scene: &Scene) -> Vec<bool> {
    let mut moving = vec![false; scene.nodes.len()];
    for channel in scene.animations.iter().flat_map(|a| &a.channels) {
        if let Some(node) = moving.get_mut(channel.node as usize) {
            *node = true;
        }
    }
    // Parents stand before their children.
    for (index, node) in scene.nodes.iter().enumerate() {
        moving[index] |= node.parent.is_some_and(|p| moving.get(p as usize).copied().unwrap_or(false));
    }
    moving
}

/// All shapes of a scene, their uses, and the instances in the merged shape with their transforms.
pub struct Gathered {
    pub shapes: Vec<Shape>,
    pub uses: Vec<Use>,
    pub merged: Vec<(u32, Mat4)>,
}

/// Gathers all shapes of a scene, and appends their nodes and records to `out`.
pub fn gather(scene: &Scene, out: &mut Encoded) -> Gathered {
    let pose = Pose::rest(scene);
    let moving = moving(scene);
    let pieces = pieces(scene);
    let triangles = |p: &&Piece<'_>| p.primitive.indices.len() / 3;
    let still: usize = pieces.iter().filter(|p| !p.deformed && !moving[p.node]).map(|p| triangles(&p)).sum();
    let mut users: BTreeMap<usize, usize> = BTreeMap::new();
    for node in scene.nodes.iter() {
        *users.entry(node.mesh.map_or(usize::MAX, |m| m as usize)).or_default() += 1;
    }
    let merges =
        |p: &Piece<'_>| !p.deformed && !moving[p.node] && (still <= MERGED_TRIANGLES || users.get(&p.mesh) == Some(&1));

    let mut merged = Vec::new();
    let mut merged_places = Vec::new();
    let mut shapes = Vec::new();
    let mut uses = Vec::new();
    // Maps (mesh, skinned) to a shape.
    let mut shared: BTreeMap<(usize, bool), usize> = BTreeMap::new();
    let mut first_of_node = 0;
    for (index, piece) in pieces.iter().enumerate() {
        let first = index == 0 || pieces[index - 1].node != piece.node;
        if first {
            first_of_node = index;
        }
        if piece.deformed {
            uses.push(Use { shape: shapes.len(), first_instance: index as u32 });
            shapes.push(out.add(&records(piece, 0, Mat4::IDENTITY, false), false, true));
        } else if merges(piece) {
            merged.extend(records(piece, index as u32, pose.world[piece.node], true));
            merged_places.push((index as u32, pose.world[piece.node]));
        } else {
            let key = (piece.mesh, scene.nodes[piece.node].skin.is_some());
            let first_instance = first_of_node as u32;
            let of_node = pieces[first_of_node..].iter().take_while(|p| p.node == piece.node);
            let rigid: Vec<_> = of_node.enumerate().filter(|(_, p)| !p.deformed).collect();
            // One entry per node.
            if rigid.first().is_none_or(|(i, _)| first_of_node + i != index) {
                continue;
            }
            let shape = *shared.entry(key).or_insert_with(|| {
                let list: Vec<Record> =
                    rigid.iter().flat_map(|(i, p)| records(p, *i as u32, Mat4::IDENTITY, false)).collect();
                shapes.push(out.add(&list, false, false));
                shapes.len() - 1
            });
            uses.push(Use { shape, first_instance });
        }
    }
    if !merged.is_empty() {
        uses.push(Use { shape: shapes.len(), first_instance: 0 });
        shapes.push(out.add(&merged, true, false));
    }
    Gathered { shapes, uses, merged: merged_places }
}

/// The triangles of `piece`, transformed by `world`. Leaves out triangles that are not finite, except in deforming shapes.
fn records(piece: &Piece<'_>, instance: u32, world: Mat4, placed: bool) -> Vec<Record> {
    let mut surface = 0;
    if !piece.material.double_sided {
        surface |= TRACE_SINGLE_SIDED;
    }
    if piece.material.unlit {
        surface |= TRACE_UNLIT;
    }
    if !matches!(piece.material.alpha, AlphaMode::Opaque) {
        surface |= TRACE_CUTOUT;
    }
    // A mirroring transform reverses the winding.
    if placed && Mat3::from_mat4(world).determinant() < 0.0 {
        surface |= TRACE_REVERSED;
    }
    let at = |i: u32| piece.primitive.positions.get(i as usize).copied().unwrap_or(Vec3::NAN);
    let place = |p: Vec3| if placed { world.transform_point3(p) } else { p };
    let corners = piece.primitive.indices.chunks_exact(3).map(|c| [place(at(c[0])), place(at(c[1])), place(at(c[2]))]);
    corners
        .enumerate()
        .map(|(triangle, corners)| Record { corners, instance, triangle: triangle as u32, surface })
        .filter(|r| piece.deformed || r.corners.iter().all(|p| p.is_finite()))
        .collect()
}

impl Shape {
    /// Maximum of loop iterations that one ray needs for the shape: one for each node and triangle, two more for each triangle that is tested
    /// again because of alpha or an equal distance, and some for entering and leaving.
    pub fn most_turns(&self) -> u64 {
        u64::from(self.levels.last().copied().unwrap_or(0)) + 4 * u64::from(self.records) + 8
    }

    /// Nodes of the tree.
    pub fn node_count(&self) -> usize {
        self.levels.last().map_or(0, |n| *n as usize)
    }

    /// Number of triangle records. A triangle in several leaves has several records.
    pub fn record_count(&self) -> u32 {
        self.records
    }
}

/// Nodes and records of all shapes as they go to the device.
#[derive(Debug, Default)]
pub struct Encoded {
    pub nodes: Vec<u32>,
    pub records: Vec<[f32; 4]>,
}

impl Encoded {
    fn add(&mut self, list: &[Record], merged: bool, deformed: bool) -> Shape {
        let distinct: Vec<Record>;
        let list = if deformed {
            list
        } else {
            // Of identical triangles of an instance a ray hits the first.
            let key = |r: &Record| (r.corners.map(|p| p.to_array().map(f32::to_bits)), r.instance, r.surface);
            let mut seen = HashSet::with_capacity(list.len());
            distinct = list.iter().filter(|r| r.surface & TRACE_CUTOUT != 0 || seen.insert(key(r))).copied().collect();
            &distinct
        };
        let around = |r: &Record| {
            let aabb = Aabb::of(r.corners.iter().filter(|p| p.is_finite()).copied());
            if aabb.is_empty() { Aabb::of([Vec3::ZERO]) } else { aabb }
        };
        let boxes: Vec<Aabb> = list.iter().map(around).collect();
        // Triangles of deforming shapes are not split, because refitting cannot recompute the parts.
        let corners: Vec<[Vec3; 3]> = if deformed { Vec::new() } else { list.iter().map(|r| r.corners).collect() };
        let tree = Tree::build(&boxes, &corners);
        let root = (self.nodes.len() / WORDS) as u32;
        let first_record = (self.records.len() / 3) as u32;
        encode(&tree, root, first_record, &mut self.nodes);
        for record in tree.order.iter().map(|i| &list[*i as usize]) {
            let bits = [record.surface, record.instance, record.triangle];
            let corner = |(p, b): (&Vec3, u32)| p.extend(f32::from_bits(b)).to_array();
            self.records.extend(record.corners.iter().zip(bits).map(corner));
        }
        let records = tree.order.len() as u32;
        let bounds = boxes.into_iter().fold(Aabb::EMPTY, Aabb::union);
        Shape { bounds, merged, deformed, root, levels: tree.levels, first_record, records }
    }
}

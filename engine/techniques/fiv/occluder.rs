//! Occluders: the geometry of a node in a pose, relative to the centre of its bounding sphere.

use std::collections::HashMap;

use glam::{Mat3, Mat4, Vec3, Vec4};

use super::{
    hash::Hash,
    posed_mesh::{self, PosedMesh, PosedPrimitive, Size, is_unlit},
    samples::Shells,
    support_function::SupportFunction,
    surface::{self, Own, Place},
};
use crate::scene::{AlphaMode, Material, Mesh, Node, Pose, Primitive, Scene};

/// Geometry is flat if its distance from a plane is at most this share of its radius.
const FLAT: f32 = 1e-4;
/// Version of the random numbers with which [`Cover`](super::cover::Cover) compares the alpha of blended surfaces. A
/// new version changes the hashes of blended occluders, so that vectors in older files are computed again. Version 0,
/// which was not hashed, took the same random numbers for a texel from all points.
const BLENDING: u64 = 1;

/// A kind of occluder. All occluders with equal geometry at different places share one kind.
#[derive(Clone, Debug)]
pub struct Occluder {
    pub name: String,
    /// Its geometry alone, with the centre of its bounding sphere at the origin and with the textures of its cutouts.
    pub scene: Scene,
    /// Radius of the bounding sphere, metres.
    pub radius: f32,
    /// Distance from the centre to the nearest surface, metres.
    pub inner: f32,
    /// Area of all triangles, m².
    pub area: f32,
    pub triangles: usize,
    /// Samples on the surface of each primitive that has triangles.
    pub own: Vec<Own>,
    /// Hash of the geometry and of the way it blocks rays.
    pub hash: u64,
}

/// An occluder of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placed {
    /// Number of the node in the scene.
    pub node: u32,
    /// Number of the kind.
    pub kind: u32,
    /// Centre of the bounding sphere, seen from the node's origin, metres in world axes.
    pub centre: Vec3,
}

/// The occluders of a scene.
#[derive(Clone, Debug, Default)]
pub struct Occluders {
    pub kinds: Vec<Occluder>,
    pub placed: Vec<Placed>,
    /// Nodes that only receive shadows, because they are flat or as large as the scene.
    pub receivers: Vec<u32>,
    /// Nodes whose meshes have no size in this pose, for example by a scale of 0. They cast no shadow in any pose.
    pub vanished: Vec<u32>,
}

impl Occluders {
    /// Finds the occluders of a scene. Every node with a mesh is an occluder, except for these nodes. Flat meshes (a
    /// ground) only receive shadows unless `flat` is set. If there are several occluders, those with a radius of more
    /// than `largest` times the scene's radius (a room, a thick ground) only receive shadows, because no sample around
    /// them lies far enough from them. Unlit surfaces block no light and belong to no occluder. Other poses than `pose`
    /// only move occluders.
    pub fn of(scene: &Scene, pose: &Pose, flat: bool, largest: f32) -> Self {
        let mut still = pose.clone();
        let (mut out, mut found) = (Self::default(), Vec::new());
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for (index, node) in scene.nodes.iter().enumerate() {
            let Some(mesh) = node.mesh.and_then(|mesh| scene.meshes.get(mesh as usize)) else { continue };
            let Some((occluder, centre)) = Occluder::of_node(scene, &mut still, index, mesh) else {
                if mesh.primitives.iter().any(|p| p.indices.len() >= 3 && !is_unlit(scene, p)) {
                    out.vanished.push(index as u32);
                }
                continue;
            };
            let at = pose.world[index].w_axis.truncate() + centre;
            (low, high) = (low.min(at - occluder.radius), high.max(at + occluder.radius));
            let casts = flat || !occluder.is_flat();
            found.push((index as u32, occluder, centre, casts));
        }
        let several = found.iter().filter(|(.., casts)| *casts).count() > 1;
        let most = if several { largest * 0.5 * (high - low).length() } else { f32::INFINITY };
        let mut known = HashMap::new();
        for (node, occluder, centre, casts) in found {
            if !casts || occluder.radius > most {
                out.receivers.push(node);
                continue;
            }
            let kind = *known.entry(occluder.hash).or_insert_with(|| {
                out.kinds.push(occluder);
                out.kinds.len() as u32 - 1
            });
            out.placed.push(Placed { node, kind, centre });
        }
        out
    }
}

impl Occluder {
    /// The occluder and its centre relative to the node's origin. `None` if no triangle could block light.
    pub(super) fn of_node(scene: &Scene, pose: &mut Pose, node: usize, mesh: &Mesh) -> Option<(Self, Vec3)> {
        let PosedMesh { primitives: posed, centre, size } = PosedMesh::of(scene, pose, node, mesh)?;
        let (mut primitives, mut own): (Vec<Primitive>, Vec<Own>) = Default::default();
        for PosedPrimitive { slot, positions, normals, indices } in posed {
            let primitive = &mesh.primitives[slot];
            let backs = scene.materials.get(primitive.material as usize).is_some_and(|m| m.double_sided);
            own.push(Own { slot: slot as u32, corners: positions.len() as u32, backs });
            primitives.push(Primitive {
                normals,
                tangents: vec![Vec4::ZERO; positions.len()],
                positions,
                uvs: primitive.uvs.clone(),
                colors: primitive.colors.clone(),
                indices,
                material: primitive.material,
                ..Primitive::default()
            });
        }
        let Size { radius, inner, area } = size;
        let triangles = primitives.iter().map(|p| p.indices.len() / 3).sum();
        let name = match scene.nodes[node].name.as_str() {
            "" if mesh.name.is_empty() => format!("node {node}"),
            "" => mesh.name.clone(),
            name => name.to_owned(),
        };
        let scene = alone(scene, primitives, &name);
        let hash = hash(&scene, &own);
        Some((Self { name, scene, radius, inner, area, triangles, own, hash }, centre))
    }

    /// Its extent along every direction.
    pub fn support_function(&self) -> SupportFunction {
        let primitives = self.scene.meshes[0].primitives.iter();
        posed_mesh::support_function(primitives.map(|p| (&p.positions[..], &p.indices[..])))
    }

    /// The samples on its surface, in the order of [`Self::own`].
    pub fn places(&self) -> Vec<Place> {
        let mut out = Vec::new();
        for (own, p) in self.own.iter().zip(&self.scene.meshes[0].primitives) {
            surface::places(own, &p.positions, &p.normals, self.radius, &mut out);
        }
        out
    }

    /// Whether all triangles lie nearly in one plane.
    pub fn is_flat(&self) -> bool {
        let triangles = || self.scene.meshes[0].primitives.iter().flat_map(of_primitive);
        let normal = |[a, b, c]: [Vec3; 3]| (b - a).cross(c - a);
        let Some(widest) = triangles().max_by(|a, b| normal(*a).length().total_cmp(&normal(*b).length())) else {
            return true;
        };
        let across = normal(widest).normalize_or_zero();
        triangles().flatten().all(|p| (p - widest[0]).dot(across).abs() <= FLAT * self.radius)
    }

    /// Its measures after the linear map `turn` about its centre. `None` if no extent is left.
    pub(super) fn squeezed(&self, turn: &Mat3) -> Option<Size> {
        let squeezed = |corners: [Vec3; 3]| corners.map(|p| *turn * p);
        Size::of(self.scene.meshes[0].primitives.iter().flat_map(of_primitive).map(squeezed))
    }

    pub(super) fn size(&self) -> Size {
        Size { radius: self.radius, inner: self.inner, area: self.area }
    }

    /// The spheres of samples around the occluder. The first sphere touches its surface from within, and the last
    /// sphere has `reach` times its radius.
    pub fn shells(&self, reach: f32) -> Shells {
        self.size().shells(reach)
    }
}

fn of_primitive(primitive: &Primitive) -> impl Iterator<Item = [Vec3; 3]> + '_ {
    posed_mesh::corners(&primitive.positions, &primitive.indices)
}

/// A scene of these primitives with the properties of their materials that decide which rays are blocked.
fn alone(scene: &Scene, mut primitives: Vec<Primitive>, name: &str) -> Scene {
    let mut out = Scene { name: name.to_owned(), ..Scene::default() };
    keep_cutouts(scene, &mut primitives, &mut out);
    out.meshes.push(Mesh { primitives, ..Mesh::default() });
    let local = crate::scene::Transform::Matrix(Mat4::IDENTITY);
    out.nodes.push(Node { mesh: Some(0), local, ..Node::default() });
    out
}

/// A copy of the scene that has no other mesh than that of `node`, with the animations, skins and morph targets that
/// deform this mesh. Poses of `scene` are valid for the copy.
pub(super) fn only(scene: &Scene, node: usize) -> Scene {
    let mut mesh = scene.nodes[node].mesh.map(|mesh| scene.meshes[mesh as usize].clone()).unwrap_or_default();
    let mut out = Scene {
        name: scene.nodes[node].name.clone(),
        skins: scene.skins.clone(),
        animations: scene.animations.clone(),
        ..Scene::default()
    };
    keep_cutouts(scene, &mut mesh.primitives, &mut out);
    for primitive in mesh.primitives.iter_mut() {
        let opaque = primitive.uvs.is_empty() && primitive.colors.is_empty();
        for morph in primitive.morphs.iter_mut().filter(|_| opaque) {
            morph.uvs.clear();
            morph.colors.clear();
        }
    }
    out.meshes.push(mesh);
    let kept = |(index, from): (usize, &Node)| Node {
        mesh: (index == node).then_some(0),
        skin: from.skin.filter(|_| index == node),
        light: None,
        camera: None,
        ..from.clone()
    };
    out.nodes = scene.nodes.iter().enumerate().map(kept).collect();
    out
}

/// Adds to `out` the materials of these primitives, reduced to the properties that decide which rays are blocked.
fn keep_cutouts(scene: &Scene, primitives: &mut [Primitive], out: &mut Scene) {
    let mut materials = HashMap::new();
    let mut textures = HashMap::new();
    for primitive in primitives {
        primitive.material = *materials.entry(primitive.material).or_insert_with(|| {
            let from = scene.materials.get(primitive.material as usize).cloned().unwrap_or_default();
            let cut = from.alpha != AlphaMode::Opaque;
            let texture = from.base_color_texture.filter(|_| cut).and_then(|mut used| {
                let texture = scene.textures.get(used.texture as usize)?;
                used.texture = *textures.entry(used.texture).or_insert_with(|| {
                    out.textures.push(texture.clone());
                    out.textures.len() as u32 - 1
                });
                Some(used)
            });
            out.materials.push(Material {
                base_color: if cut { Vec3::ONE.extend(from.base_color.w) } else { Vec4::ONE },
                base_color_texture: texture,
                alpha: from.alpha,
                unlit: from.unlit,
                double_sided: true,
                ..Material::diffuse("", Vec3::ONE)
            });
            out.materials.len() as u32 - 1
        });
        if out.materials[primitive.material as usize].alpha == AlphaMode::Opaque {
            primitive.uvs.clear();
            primitive.colors.clear();
        }
    }
}

fn hash(alone: &Scene, own: &[Own]) -> u64 {
    let mut hash = Hash::new();
    for (primitive, own) in alone.meshes[0].primitives.iter().zip(own) {
        hash.word(primitive.positions.len() as u64);
        hash.word(u64::from(own.slot) << 1 | u64::from(own.backs));
        primitive.positions.iter().for_each(|p| hash.floats(&p.to_array()));
        primitive.normals.iter().for_each(|n| hash.floats(&n.to_array()));
        primitive.indices.iter().for_each(|i| hash.word((*i).into()));
        let material = &alone.materials[primitive.material as usize];
        hash.bytes(format!("{:?} {} {:?}", material.alpha, material.unlit, material.base_color_texture).as_bytes());
        if material.alpha != AlphaMode::Opaque {
            hash.floats(&[material.base_color.w]);
            primitive.uvs.iter().flatten().for_each(|uv| hash.floats(&uv.to_array()));
            primitive.colors.iter().for_each(|c| hash.floats(&[c.w]));
        }
        if material.alpha == AlphaMode::Blend {
            hash.word(BLENDING);
        }
    }
    for texture in &alone.textures {
        hash.bytes(texture.rgba.as_flattened());
    }
    hash.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builtin;
    use glam::Quat;

    fn tetrahedron() -> Primitive {
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
        Primitive {
            normals: vec![Vec3::Y; 4],
            tangents: vec![Vec4::ZERO; 4],
            positions,
            indices: vec![0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3],
            ..Primitive::default()
        }
    }

    fn stage(at: &[Mat4]) -> Scene {
        let nodes =
            at.iter().map(|m| Node { mesh: Some(0), local: crate::scene::Transform::Matrix(*m), ..Node::default() });
        Scene {
            nodes: nodes.collect(),
            meshes: vec![Mesh { primitives: vec![tetrahedron()], ..Mesh::default() }],
            materials: vec![Material::default()],
            ..Scene::default()
        }
    }

    fn found(scene: &Scene) -> Occluders {
        Occluders::of(scene, &Pose::rest(scene), false, 1.0)
    }

    #[test]
    fn the_same_thing_in_other_places_is_one_kind_and_turned_or_scaled_it_is_another() {
        let turned = Mat4::from_quat(Quat::from_rotation_y(1.0));
        let at = |x: f32| Mat4::from_translation(Vec3::new(x, 0.3 * x, 0.1));
        let scene = stage(&[
            Mat4::IDENTITY,
            at(3.7),
            at(1000.3) * turned,
            turned,
            at(2.0) * Mat4::from_scale(Vec3::splat(2.0)),
        ]);
        let all = found(&scene);
        assert_eq!(all.placed.iter().map(|p| p.kind).collect::<Vec<_>>(), [0, 0, 1, 1, 2]);
        let [small, large] = [&all.kinds[0], &all.kinds[2]];
        assert!((large.radius / small.radius - 2.0).abs() < 1e-5 && small.triangles == 4);
        for kind in &all.kinds {
            assert!(kind.radius < 1.1 * large.radius && kind.inner < kind.radius && kind.inner > 0.0);
            let shells = kind.shells(16.0);
            assert!(shells.nearest >= kind.inner && (shells.farthest / kind.radius - 16.0).abs() < 1e-4);
        }
    }

    #[test]
    fn grounds_only_receive() {
        let mut scene = stage(&[Mat4::IDENTITY, Mat4::from_rotation_x(0.4)]);
        scene.meshes[0].primitives[0].positions[3] = Vec3::new(1.0, 1.0, 0.0);
        let all = found(&scene);
        assert!(all.kinds.is_empty() && all.placed.is_empty());
        assert_eq!(all.receivers, [0, 1]);
        let with = Occluders::of(&scene, &Pose::rest(&scene), true, 1.0);
        assert!(with.receivers.is_empty() && with.placed.len() == 2);
    }

    #[test]
    fn what_has_no_size_is_named_and_what_stops_no_light_is_nothing() {
        let at = |x: f32| Mat4::from_translation(Vec3::new(x, 0.0, 0.0));
        let mut scene = stage(&[at(0.0), at(1.0) * Mat4::from_scale(Vec3::ZERO)]);
        let all = found(&scene);
        assert_eq!((all.placed.len(), all.vanished, all.receivers), (1, vec![1], vec![]));
        scene.materials[0].unlit = true;
        let all = found(&scene);
        assert_eq!((all.placed.len(), all.vanished, all.receivers), (0, vec![], vec![]));
    }

    #[test]
    fn what_holds_everything_else_only_receives() {
        let at = |x: f32| Mat4::from_translation(Vec3::new(x, 0.0, 0.0));
        let scene = stage(&[at(0.0), at(-3.0) * Mat4::from_scale(Vec3::splat(9.0)), at(1.5)]);
        let all = Occluders::of(&scene, &Pose::rest(&scene), false, 0.5);
        assert_eq!((all.receivers, all.placed.len(), all.kinds.len()), (vec![1], 2, 1));
        // A single occluder is not limited by `largest`.
        let alone = stage(&[at(-3.0)]);
        assert_eq!(Occluders::of(&alone, &Pose::rest(&alone), false, 0.5).placed.len(), 1);
    }

    #[test]
    fn built_in_scenes_have_occluders() {
        let scene = builtin::load("primitives").unwrap();
        let all = found(&scene);
        assert!(all.placed.len() > 3 && all.kinds.iter().all(|k| k.radius.is_finite() && k.triangles > 0));
        for kind in &all.kinds {
            kind.scene.validate().unwrap();
        }
    }
}

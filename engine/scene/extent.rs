//! How large and how small a scene may be.
//!
//! All arithmetic of light is in 32-bit floats. Areas of triangles and squares of distances are squared again, so that lengths of
//! 10⁹ m overflow: light was lost from 10¹⁰ m on without a word, and nothing but infinities was left at 10¹⁵ m. What is refused here
//! cannot be shown rightly by any technique.

use super::{Aabb, Mesh, Pose, Scene};
use crate::{Error, Result};
use glam::{Mat4, Vec3};

/// No coordinate may be farther from the origin, metres; some way below where the first squares of areas overflow.
pub const FARTHEST: f32 = 1e8;
/// A scene must be larger than this, metres along its longest side: rays step off surfaces by up to 10⁻¹¹ m, cameras see nothing that
/// is nearer than 10⁻⁶ m.
pub const SMALLEST: f32 = 1e-5;

/// The local extent of every mesh of a scene, by which poses are checked.
#[derive(Clone, Debug)]
pub struct Extents {
    /// One a mesh, at rest.
    meshes: Vec<Aabb>,
    /// One a mesh: how far each morph target moves a vertex at weight 1, metres.
    morphs: Vec<Vec<f32>>,
}

impl Extents {
    /// Goes through all vertices once.
    pub fn of(scene: &Scene) -> Self {
        let bounds = |mesh: &Mesh| {
            mesh.primitives.iter().map(|p| Aabb::of(p.positions.iter().copied())).fold(Aabb::EMPTY, Aabb::union)
        };
        let morphs = |mesh: &Mesh| {
            let moved = |target: usize| {
                let deltas = mesh.primitives.iter().filter_map(|p| p.morphs.get(target)).flat_map(|m| &m.positions);
                deltas.map(|delta| delta.abs().max_element()).fold(0.0, f32::max)
            };
            (0..mesh.weights.len()).map(moved).collect()
        };
        Self { meshes: scene.meshes.iter().map(bounds).collect(), morphs: scene.meshes.iter().map(morphs).collect() }
    }

    /// Checks the scene in `pose`: meshes before and after their transforms, lights, and cameras.
    ///
    /// # Errors
    /// [`ErrorKind::Input`](crate::ErrorKind::Input), naming the first node that stands too far away with its coordinate, or saying that
    /// the scene as a whole is too small.
    pub fn check(&self, scene: &Scene, pose: &Pose) -> Result<()> {
        for (mesh, bounds) in self.meshes.iter().enumerate() {
            near(bounds.farthest()).map_err(|error| error.at(named("meshes", mesh, &scene.meshes[mesh].name)))?;
        }
        let mut all = Aabb::EMPTY;
        // Once a skin: many nodes may share one of many joints.
        let mut joints = vec![None; scene.skins.len()];
        for (i, node) in scene.nodes.iter().enumerate() {
            let Some(world) = pose.world.get(i) else { continue };
            let place = || named("nodes", i, &node.name);
            if node.light.is_some() || node.camera.is_some() {
                near(largest(world.w_axis.truncate())).map_err(|error| error.at(place()))?;
            }
            let Some(mesh) = node.mesh.map(|mesh| mesh as usize) else { continue };
            let Some(local) = self.meshes.get(mesh).filter(|local| !local.is_empty()) else { continue };
            let weights = pose.weights.get(i).into_iter().flatten().zip(&self.morphs[mesh]);
            let local = local.grown(weights.map(|(weight, moved)| weight.abs() * moved).sum());
            // Skinned vertices follow the joints, not the node.
            let skin = node.skin.map(|skin| skin as usize).filter(|skin| *skin < scene.skins.len());
            let bounds = match skin {
                Some(skin) => match joints[skin].get_or_insert_with(|| Joints::of(scene, pose, skin)) {
                    Some(joints) => joints.around(local),
                    None => continue,
                },
                None => local.transformed(world),
            };
            near(bounds.farthest()).map_err(|error| error.at(place()))?;
            all = all.union(bounds);
        }
        let size = (all.max - all.min).max_element();
        match !all.is_empty() && size > 0.0 && size < SMALLEST {
            false => Ok(()),
            true => {
                Err(Error::input(format!("the whole scene is {size:e} m large; at least {SMALLEST:e} m is allowed"))
                    .help("Scale it up where it was made; --unit says how many metres a unit of an OBJ file is"))
            }
        }
    }
}

/// The smallest and the largest of each number in the matrices of a skin's joints.
#[derive(Clone, Copy, Debug)]
struct Joints {
    low: Mat4,
    high: Mat4,
}

impl Joints {
    /// `None` if the skin has no joints.
    fn of(scene: &Scene, pose: &Pose, skin: usize) -> Option<Self> {
        let skin = &scene.skins[skin];
        let pairs = skin.joints.iter().zip(&skin.inverse_bind);
        let matrices = pairs.filter_map(|(joint, bind)| Some(*pose.world.get(*joint as usize)? * *bind));
        matrices.map(|m| Self { low: m, high: m }).reduce(|a, b| {
            let each = |of: fn(f32, f32) -> f32, a: Mat4, b: Mat4| {
                let (a, b) = (a.to_cols_array(), b.to_cols_array());
                // A number that is none stays: it is refused.
                Mat4::from_cols_array(&std::array::from_fn(|i| {
                    if a[i].is_nan() { a[i] } else { of(a[i], b[i]) + 0.0 * b[i] }
                }))
            };
            Self { low: each(f32::min, a.low, b.low), high: each(f32::max, a.high, b.high) }
        })
    }

    /// A box that holds `local` moved by any of the joints; larger than needed where they turn it differently.
    fn around(&self, local: Aabb) -> Aabb {
        let (mut min, mut max) = (self.low.w_axis.truncate(), self.high.w_axis.truncate());
        for axis in 0..3 {
            let ends = [self.low.col(axis).truncate(), self.high.col(axis).truncate()];
            let all = [
                ends[0] * local.min[axis],
                ends[0] * local.max[axis],
                ends[1] * local.min[axis],
                ends[1] * local.max[axis],
            ];
            min += all.into_iter().reduce(Vec3::min).unwrap_or_default();
            max += all.into_iter().reduce(Vec3::max).unwrap_or_default();
        }
        Aabb { min, max }
    }
}

/// The largest coordinate without its sign; infinite if any is no number.
fn largest(v: Vec3) -> f32 {
    if v.is_nan() { f32::INFINITY } else { v.abs().max_element() }
}

/// Checks a coordinate without its sign, metres.
///
/// # Errors
/// `Input` if it is over [`FARTHEST`].
pub fn near(coordinate: f32) -> Result<()> {
    match coordinate <= FARTHEST {
        true => Ok(()),
        false => Err(Error::input(format!(
            "reaches {coordinate:e} m from the origin; {FARTHEST:e} m is allowed, for the squares of areas overflow beyond"
        ))
        .help("Scale the scene down or move it to the origin; --unit says how many metres a unit of an OBJ file is")),
    }
}

fn named(list: &str, index: usize, name: &str) -> String {
    if name.is_empty() { format!("{list}[{index}]") } else { format!("{list}[{index}] '{name}'") }
}

impl Aabb {
    /// The largest coordinate without its sign; 0 of an empty box, infinite if any is no number.
    fn farthest(&self) -> f32 {
        if self.is_empty() && !self.min.is_nan() && !self.max.is_nan() {
            0.0
        } else {
            largest(self.min).max(largest(self.max))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{
        Animation, Camera, Channel, Interpolation, Keys, Light, LightKind, Material, MorphTarget, Node, Primitive,
        Projection, Skin, Transform,
    };
    use glam::{Quat, Vec4};

    fn scene(scale: f32) -> Scene {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y].map(|p| p * scale);
        let primitive = Primitive {
            positions: corners.to_vec(),
            normals: vec![Vec3::Z; 3],
            tangents: vec![Vec4::ZERO; 3],
            indices: vec![0, 1, 2],
            ..Primitive::default()
        };
        Scene {
            meshes: vec![Mesh { name: "triangle".into(), primitives: vec![primitive], weights: vec![] }],
            materials: vec![Material::diffuse("", Vec3::ONE)],
            nodes: vec![Node { name: "thing".into(), mesh: Some(0), ..Node::default() }],
            ..Scene::default()
        }
    }

    fn at(translation: Vec3) -> Transform {
        Transform::Trs { translation, rotation: Quat::IDENTITY, scale: Vec3::ONE }
    }

    fn refused(scene: &Scene, parts: &[&str]) {
        let error = scene.validate().unwrap_err();
        assert_eq!(error.exit_code(), 3);
        for part in parts {
            assert!(error.to_string().contains(part), "{error}: {part}");
        }
    }

    #[test]
    fn coordinates_are_bounded_before_and_after_transforms() {
        for scale in [1e-4, 1.0, 0.99e8] {
            scene(scale).validate().unwrap();
        }
        refused(&scene(1.1e8), &["meshes[0] 'triangle'", "1.1e8 m", "1e8 m is allowed"]);
        refused(&scene(1e20), &["meshes[0] 'triangle'", "1e20 m"]);
        let mut far = scene(1.0);
        far.nodes[0].local = at(Vec3::new(0.0, -2e8, 0.0));
        refused(&far, &["nodes[0] 'thing'", "2e8 m"]);
        far.nodes[0].local =
            Transform::Trs { translation: Vec3::ZERO, rotation: Quat::IDENTITY, scale: Vec3::splat(1e9) };
        refused(&far, &["nodes[0] 'thing'", "1e9 m"]);
        // Two scales that overflow together.
        far.nodes[0].local =
            Transform::Trs { translation: Vec3::ZERO, rotation: Quat::IDENTITY, scale: Vec3::splat(1e30) };
        far.nodes.push(Node { parent: Some(0), mesh: Some(0), ..far.nodes[0].clone() });
        far.nodes[0].mesh = None;
        refused(&far, &["nodes[1] 'thing'"]);
        // Too far in the mesh, though brought back by its node.
        let mut back = scene(1e15);
        back.nodes[0].local =
            Transform::Trs { translation: Vec3::ZERO, rotation: Quat::IDENTITY, scale: Vec3::splat(1e-15) };
        refused(&back, &["meshes[0]"]);
    }

    #[test]
    fn lights_cameras_morphs_joints_and_animations_are_bounded() {
        let mut lit = scene(1.0);
        lit.lights.push(Light {
            name: "lamp".into(),
            kind: LightKind::Point { range: None },
            color: Vec3::ONE,
            intensity: 1.0,
        });
        lit.nodes.push(Node { name: "lamp".into(), light: Some(0), local: at(Vec3::X * 1e10), ..Node::default() });
        refused(&lit, &["nodes[1] 'lamp'", "1e10 m"]);
        let mut seen = scene(1.0);
        let projection = Projection::Perspective { yfov: 1.0, aspect: None, znear: 0.1, zfar: None };
        seen.cameras.push(Camera { name: String::new(), projection });
        seen.nodes.push(Node { camera: Some(0), local: at(Vec3::Z * 1e12), ..Node::default() });
        refused(&seen, &["nodes[1]", "1e12 m"]);
        let mut morphed = scene(1.0);
        morphed.meshes[0].weights = vec![0.5];
        let target = MorphTarget { positions: vec![Vec3::Y * 1e9; 3], ..MorphTarget::default() };
        morphed.meshes[0].primitives[0].morphs = vec![target];
        refused(&morphed, &["nodes[0] 'thing'"]);
        morphed.meshes[0].weights = vec![0.0];
        morphed.validate().unwrap();
        let mut skinned = scene(1.0);
        skinned.nodes[0].skin = Some(0);
        skinned.nodes.push(Node { local: at(Vec3::X * 1e9), ..Node::default() });
        skinned.skins.push(Skin { name: String::new(), joints: vec![1], inverse_bind: vec![Mat4::IDENTITY] });
        refused(&skinned, &["nodes[0] 'thing'"]);
        // What moves there is found in the pose.
        let mut moving = scene(1.0);
        let values = Keys::Translation(vec![Vec3::ZERO, Vec3::X * 1e10]);
        let channel = Channel { node: 0, interpolation: Interpolation::Linear, times: vec![0.0, 1.0], values };
        moving.animations.push(Animation { name: String::new(), channels: vec![channel] });
        let extents = Extents::of(&moving);
        moving.validate().unwrap();
        extents.check(&moving, &Pose::playing(&moving, 0.001)).unwrap();
        let error = extents.check(&moving, &Pose::playing(&moving, 0.5)).unwrap_err();
        assert!(error.to_string().contains("nodes[0] 'thing'"), "{error}");
    }

    #[test]
    fn scenes_smaller_than_rays_can_step_are_refused_and_single_small_things_are_not() {
        refused(&scene(1e-20), &["the whole scene", "1e-20 m", "1e-5 m"]);
        refused(&scene(1e-6), &["1e-6 m"]);
        let mut both = scene(1e-20);
        both.meshes.push(scene(1.0).meshes.remove(0));
        both.nodes.push(Node { mesh: Some(1), ..Node::default() });
        both.validate().unwrap();
        Scene::default().validate().unwrap();
    }
}

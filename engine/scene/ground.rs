//! Things on a plain ground: the stage on which shadows are looked at.

use glam::{Mat4, Quat, Vec2, Vec3, Vec4};

use super::{
    Aabb, Camera, Material, Mesh, Node, Note, NoteKind, Pose, Primitive, Projection, Scene, TextureRef, Transform,
    deform,
};
use crate::{Error, Result};

/// Things that one stage holds at most.
const MOST: u32 = 10_000;
/// Gap under a thing, of the stage's height: the ground and a flat base must not lie in one plane.
const OVER: f32 = 0.002;
/// Angle from one thing to the next around the middle, radians: the golden one, which leaves no rows.
const TURN: f32 = 2.399_963;
/// Squares along an edge of a ground with waves.
const SQUARES: u32 = 96;
/// Albedo of the ground, linear Rec. 709.
const GREY: Vec3 = Vec3::new(0.694, 0.665, 0.604);
/// Full vertical angle of the camera in front, radians.
const YFOV: f32 = 0.7;
/// Factor on the size of a single thing in a picture of it: room around the thing, and for its shadow.
const MARGIN: f32 = 1.25;

/// How things are put on a ground.
#[derive(Clone, Debug, PartialEq)]
pub struct Ground {
    /// So many of each thing, 1 to 10,000 in all.
    pub copies: u32,
    /// Every thing is made this high, metres; `None`: as it is.
    pub height: Option<f32>,
    /// The part of its height that is below the ground, 0 to 1; below zero it floats.
    pub sunk: f32,
    /// Room between neighbours, in widths of the widest.
    pub gap: f32,
    /// Height of waves of the ground, in heights of the highest thing.
    pub waves: f32,
    /// Where the waves are in their period, 0 to 1.
    pub phase: f32,
}

impl Default for Ground {
    fn default() -> Self {
        Self { copies: 1, height: None, sunk: 0.0, gap: 0.4, waves: 0.0, phase: 0.0 }
    }
}

impl Ground {
    /// Whether the numbers are in their ranges for so many different things.
    ///
    /// # Errors
    /// `Usage`, naming the number.
    pub fn check(&self, things: usize) -> Result<()> {
        let wrong = |key: &str, found: String, allowed: &str| {
            Err(Error::usage(format!("{found} is not allowed; allowed: {allowed}")).at(format!("ground.{key}")))
        };
        let all = u64::from(self.copies) * things as u64;
        if all == 0 || all > MOST.into() {
            return wrong("copies", format!("{} of {things} things", self.copies), "1 to 10000 in all");
        }
        if let Some(height) = self.height.filter(|h| !(1e-4..=1e4).contains(h)) {
            return wrong("height", height.to_string(), "0.0001 to 10000");
        }
        for (key, value, (low, high)) in [
            ("sunk", self.sunk, (-100.0, 1.0)),
            ("gap", self.gap, (-0.9, 100.0)),
            ("waves", self.waves, (0.0, 10.0)),
            ("phase", self.phase, (0.0, 1.0)),
        ] {
            if !(low..=high).contains(&value) {
                return wrong(key, value.to_string(), &format!("{low} to {high}"));
            }
        }
        Ok(())
    }
}

/// What one thing takes: scale, and the place of its middle's foot before scaling.
struct Fit {
    scale: f32,
    foot: Vec3,
    /// Size of the box around it after scaling, metres.
    extents: Vec3,
    height: f32,
    width: f32,
}

/// A new scene of `ground.copies` of each of the things, in turns, on a ground in the plane y = 0: a spiral of even density around
/// the origin. Cameras of the things are left out; three others stand there: `front`, `above`, and `ground`, which sees the ground from
/// straight above without the things on it, as far as shadows of about 45° reach. A single thing fills the view of the first two.
/// Animations go on in all copies; lights are those of the first ones. The environment is the first that a thing has.
///
/// # Errors
/// `Usage` if a number is out of its range; `Input` if a thing has no triangles.
///
/// ```
/// use lucerna::scene::ground;
///
/// let stage = ground::on_ground(&[lucerna_scenes::load("hare")?], &ground::Ground { copies: 10, ..Default::default() })?;
/// assert_eq!(stage.nodes.iter().filter(|node| node.mesh.is_some()).count(), 11);
/// # Ok::<(), lucerna::Error>(())
/// ```
pub fn on_ground(things: &[Scene], ground: &Ground) -> Result<Scene> {
    ground.check(things.len())?;
    let fits = things.iter().map(|thing| fit(thing, ground)).collect::<Result<Vec<Fit>>>()?;
    let most = |of: fn(&Fit) -> f32| fits.iter().map(of).fold(0f32, f32::max);
    let (height, width) = (most(|f| f.height), most(|f| f.width));
    let count = ground.copies * things.len() as u32;
    let places = places(count, (1.0 + ground.gap) * width);
    let spread = places.iter().map(|p| p.length()).fold(0f32, f32::max);
    let size = height.max(width);
    let mut out = Scene { name: things[0].name.clone(), ..Scene::default() };
    out.materials.push(Material::diffuse("ground", GREY));
    let half = spread + 8.0 * size;
    let floor = if ground.waves > 0.0 { waves(half, ground.waves * height, ground.phase, size) } else { square(half) };
    out.meshes.push(Mesh { name: "ground".into(), primitives: vec![floor], ..Mesh::default() });
    out.nodes.push(Node { name: "ground".into(), mesh: Some(0), ..Node::default() });
    let bases: Vec<Base> = things.iter().map(|thing| take(&mut out, thing)).collect();
    for (k, place) in places.iter().enumerate() {
        let which = k % things.len();
        let (thing, fit) = (&things[which], &fits[which]);
        let foot = -fit.foot * fit.scale + Vec3::new(place.x, OVER * height - ground.sunk * fit.height, place.y);
        let local = Transform::Trs { translation: foot, rotation: Quat::IDENTITY, scale: Vec3::splat(fit.scale) };
        stand(&mut out, thing, &bases[which], (k, k < things.len()), local);
    }
    cameras(&mut out, (spread, height, size), (count == 1).then(|| fits[0].extents));
    out.environment = things.iter().find_map(|thing| thing.environment.clone());
    if things.iter().any(|thing| thing.nodes.iter().any(|node| node.camera.is_some())) {
        let text = "cameras of things that are put on a ground are left out".into();
        out.notes.push(Note { kind: NoteKind::Approximated, place: "cameras".into(), text });
    }
    Ok(out)
}

/// The box around everything at rest.
pub(super) fn bounds(scene: &Scene) -> Aabb {
    let pose = Pose::rest(scene);
    let mut around = Aabb::EMPTY;
    for (index, node) in scene.nodes.iter().enumerate() {
        let Some(mesh) = node.mesh.and_then(|mesh| scene.meshes.get(mesh as usize)) else { continue };
        for primitive in mesh.primitives.iter().filter(|p| !p.indices.is_empty()) {
            let vertices = deform::world_vertices(scene, &pose, index, primitive);
            around = around.union(Aabb::of(vertices.positions.into_iter().filter(|p| p.is_finite())));
        }
    }
    around
}

fn fit(thing: &Scene, ground: &Ground) -> Result<Fit> {
    let around = bounds(thing);
    let size = around.max - around.min;
    if !(around.is_finite() && size.max_element() > 0.0) {
        return Err(Error::input("has nothing that could stand on a ground").at(format!("scene '{}'", thing.name)));
    }
    let scale = ground.height.map_or(1.0, |height| height / if size.y > 0.0 { size.y } else { size.max_element() });
    let middle = around.centre();
    let foot = Vec3::new(middle.x, around.min.y, middle.z);
    let extents = size * scale;
    Ok(Fit { scale, foot, extents, height: extents.y, width: extents.x.max(extents.z) })
}

/// Places in a spiral of even density, neighbours about `apart` from each other, their middle at the origin.
fn places(count: u32, apart: f32) -> Vec<Vec2> {
    // The nearest neighbours in such a spiral of step c are 1.6 c apart.
    let at = |k: u32| Vec2::from_angle(k as f32 * TURN) * ((k as f32 + 0.5).sqrt() * apart / 1.6);
    let list: Vec<Vec2> = (0..count).map(at).collect();
    let middle = list.iter().copied().sum::<Vec2>() / count as f32;
    list.into_iter().map(|p| p - middle).collect()
}

/// Where the lists of a thing begin in the new scene.
pub(super) struct Base {
    mesh: u32,
    light: u32,
}

/// Adds meshes, materials, textures and lights of a thing.
pub(super) fn take(out: &mut Scene, thing: &Scene) -> Base {
    let (texture, material) = (out.textures.len() as u32, out.materials.len() as u32);
    let base = Base { mesh: out.meshes.len() as u32, light: out.lights.len() as u32 };
    out.textures.extend_from_slice(&thing.textures);
    out.lights.extend_from_slice(&thing.lights);
    for from in &thing.materials {
        let moved = |used: Option<TextureRef>| used.map(|used| TextureRef { texture: used.texture + texture, ..used });
        out.materials.push(Material {
            base_color_texture: moved(from.base_color_texture),
            metallic_roughness_texture: moved(from.metallic_roughness_texture),
            normal_texture: moved(from.normal_texture),
            occlusion_texture: moved(from.occlusion_texture),
            emissive_texture: moved(from.emissive_texture),
            transmission_texture: moved(from.transmission_texture),
            ..from.clone()
        });
    }
    for mesh in &thing.meshes {
        let mut mesh = mesh.clone();
        mesh.primitives.iter_mut().for_each(|primitive| primitive.material += material);
        out.meshes.push(mesh);
    }
    out.notes.extend_from_slice(&thing.notes);
    base
}

/// Adds nodes, skins and animations of a copy of a thing. `local`: its place.
pub(super) fn stand(out: &mut Scene, thing: &Scene, base: &Base, (number, first): (usize, bool), local: Transform) {
    let root = out.nodes.len() as u32;
    out.nodes.push(Node { name: format!("{} {}", thing.name, number + 1), local, ..Node::default() });
    let (node, skin) = (root + 1, out.skins.len() as u32);
    out.nodes.extend(thing.nodes.iter().map(|from| Node {
        parent: Some(from.parent.map_or(root, |parent| parent + node)),
        mesh: from.mesh.map(|mesh| mesh + base.mesh),
        skin: from.skin.map(|index| index + skin),
        light: from.light.filter(|_| first).map(|light| light + base.light),
        camera: None,
        ..from.clone()
    }));
    for from in &thing.skins {
        let mut skin = from.clone();
        skin.joints.iter_mut().for_each(|joint| *joint += node);
        out.skins.push(skin);
    }
    for from in &thing.animations {
        let channels = from.channels.iter().map(|channel| {
            let mut channel = channel.clone();
            channel.node += node;
            channel
        });
        // What is animated together plays together.
        match out.animations.iter_mut().find(|known| known.name == from.name) {
            Some(known) => known.channels.extend(channels),
            None => out.animations.push(super::Animation { name: from.name.clone(), channels: channels.collect() }),
        }
    }
}

/// Three cameras. `alone`: the extents of the only thing, metres, which the first two see as large as its shadow allows.
fn cameras(out: &mut Scene, (spread, height, size): (f32, f32, f32), alone: Option<Vec3>) {
    let mut camera = |name: &str, projection: Projection, eye: Vec3, back: Vec3, up: Vec3| {
        let right = up.cross(back).normalize();
        let world =
            Mat4::from_cols(right.extend(0.0), back.cross(right).extend(0.0), back.extend(0.0), eye.extend(1.0));
        out.cameras.push(Camera { name: name.into(), projection });
        let camera = Some(out.cameras.len() as u32 - 1);
        let (scale, rotation, translation) = world.to_scale_rotation_translation();
        let local = Transform::Trs { translation, rotation, scale };
        out.nodes.push(Node { name: name.into(), local, camera, ..Node::default() });
    };
    let target = Vec3::Y * (0.4 * height);
    let front = if alone.is_some() { Vec3::new(0.5, 0.7, 1.0) } else { Vec3::new(0.15, 0.55, 1.0) };
    for (name, from) in [("front", front), ("above", Vec3::new(0.1, 1.6, 1.0))] {
        let back = from.normalize();
        let distance = match alone {
            Some(extents) => fitted(extents, target, back),
            None => (0.9 * spread + 0.75 * size) / (0.5 * YFOV).tan(),
        };
        let znear = 0.02 * distance;
        let lens = Projection::Perspective { yfov: YFOV, aspect: None, znear, zfar: None };
        camera(name, lens, target + back * distance, back, Vec3::Y);
    }
    // Its near plane lies between the ground and what stands on it.
    let (eye, half) = (0.1 * height, spread + 1.25 * size);
    let (znear, zfar) = (eye - 0.5 * OVER * height, eye + 4.0 * size);
    let above = Projection::Orthographic { xmag: half, ymag: half, znear, zfar };
    camera("ground", above, Vec3::Y * eye, Vec3::Y, Vec3::NEG_Z);
}

/// The distance from `target`, metres, at which a camera in direction `back` sees a box on the ground, with the room around it, in a
/// picture as high as wide.
fn fitted(extents: Vec3, target: Vec3, back: Vec3) -> f32 {
    let right = Vec3::Y.cross(back).normalize();
    let up = back.cross(right);
    let corners = (0..8).map(|k| {
        let side = |bit: u32| if k >> bit & 1 == 1 { 0.5 } else { -0.5 };
        Vec3::new(side(0), side(1) + 0.5, side(2)) * extents - target
    });
    corners
        .map(|p| p.dot(right).abs().max(p.dot(up).abs()) * MARGIN / (0.5 * YFOV).tan() + p.dot(back))
        .fold(0f32, f32::max)
}

/// A square of half side `half` in the plane y = 0, seen from above.
fn square(half: f32) -> Primitive {
    let corners = [(-half, half), (half, half), (half, -half), (-half, -half)];
    Primitive {
        positions: corners.map(|(x, z)| Vec3::new(x, 0.0, z)).to_vec(),
        normals: vec![Vec3::Y; 4],
        tangents: vec![Vec4::ZERO; 4],
        indices: vec![0, 1, 2, 0, 2, 3],
        ..Primitive::default()
    }
}

/// The same with waves below that plane: `deep` from crest to trough, about `size` from crest to crest, a crest at the origin in phase 0.
fn waves(half: f32, deep: f32, phase: f32, size: f32) -> Primitive {
    let k = std::f32::consts::TAU / (2.0 * size);
    let turn = std::f32::consts::TAU * phase;
    let line = SQUARES + 1;
    // Squares get larger outwards.
    let along = |i: u32| {
        let t = 2.0 * i as f32 / SQUARES as f32 - 1.0;
        half * t * (0.25 + 0.75 * t * t)
    };
    let mut out = Primitive::default();
    for i in 0..line * line {
        let (x, z) = (along(i % line), along(i / line));
        let ((sx, cx), (sz, cz)) = ((k * x + turn).sin_cos(), (k * z).sin_cos());
        // Waves die away before squares are too large for them.
        let fade = (-(x * x + z * z) / (16.0 * size * size)).exp();
        let (high, slope) = (0.5 * deep * (cx * cz * fade - 1.0), 0.5 * deep * k * fade);
        out.positions.push(Vec3::new(x, high, z));
        let off = 0.5 * deep * cx * cz * fade / (8.0 * size * size);
        out.normals.push(Vec3::new(slope * sx * cz + off * x, 1.0, slope * cx * sz + off * z).normalize());
    }
    out.tangents = vec![Vec4::ZERO; out.positions.len()];
    for i in 0..SQUARES * SQUARES {
        let a = i / SQUARES * line + i % SQUARES;
        out.indices.extend([a, a + line, a + 1, a + 1, a + line, a + line + 1]);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builtin;
    use crate::scene::View;
    use glam::BVec3;

    fn stage(things: &[&str], ground: &Ground) -> Scene {
        let things: Vec<Scene> = things.iter().map(|name| builtin::load(name).unwrap()).collect();
        on_ground(&things, ground).unwrap()
    }

    /// Box of every mesh node but the ground.
    fn boxes(scene: &Scene) -> Vec<Aabb> {
        let pose = Pose::rest(scene);
        let nodes = scene.nodes.iter().enumerate().skip(1).filter_map(|(i, n)| Some((i, n.mesh?)));
        let all = nodes.map(|(i, mesh)| {
            let of = |p: &Primitive| Aabb::of(deform::world_vertices(scene, &pose, i, p).positions);
            scene.meshes[mesh as usize].primitives.iter().map(of).reduce(Aabb::union).unwrap()
        });
        all.collect()
    }

    #[test]
    fn a_single_thing_is_seen_whole_and_large() {
        for name in ["hare", "queen", "tree", "pot"] {
            let scene = stage(&[name], &Ground::default());
            let (pose, around) = (Pose::rest(&scene), boxes(&scene)[0]);
            for camera in 0..2 {
                let view = View::of_camera(&scene, &pose, camera, [256, 256]).unwrap();
                let clip_from_world = view.clip_from_world;
                let corners = (0..8).map(|k| {
                    let side = BVec3::new(k & 1 == 1, k & 2 == 2, k & 4 == 4);
                    clip_from_world.project_point3(Vec3::select(side, around.max, around.min))
                });
                let most = corners.map(|p| p.x.abs().max(p.y.abs())).fold(0f32, f32::max);
                assert!((0.6..0.9).contains(&most), "{name}, camera {camera}: {most}");
            }
        }
    }

    #[test]
    fn things_stand_on_the_ground_in_turns_and_apart() {
        let ground = Ground { copies: 15, height: Some(0.8), ..Ground::default() };
        let scene = stage(&["hare", "queen"], &ground);
        scene.validate().unwrap();
        let boxes = boxes(&scene);
        assert_eq!(boxes.len(), 30);
        for (i, a) in boxes.iter().enumerate() {
            assert!((a.max.y - a.min.y - 0.8).abs() < 1e-4 && (0.0..0.01).contains(&a.min.y), "{a:?}");
            for b in &boxes[..i] {
                let apart = (a.min - b.max).max(b.min - a.max);
                assert!(apart.x > 0.0 || apart.z > 0.0, "{a:?} {b:?}");
            }
        }
        // Two kinds of things, so two meshes and a ground.
        assert_eq!(scene.meshes.len(), 3);
        let names: Vec<&str> = scene.cameras.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["front", "above", "ground"]);
    }

    #[test]
    fn sunk_and_floating_things_are_where_they_should_be() {
        for (sunk, low) in [(0.2, -0.2), (-0.5, 0.5)] {
            let scene = stage(&["queen"], &Ground { height: Some(1.0), sunk, ..Ground::default() });
            assert!((boxes(&scene)[0].min.y - low).abs() < 0.01);
        }
    }

    #[test]
    fn waves_have_the_normals_of_their_surface_and_stay_below_the_plane() {
        let patch = waves(8.0, 0.4, 0.3, 1.0);
        assert!(patch.positions.iter().all(|p| (-0.41..=1e-6).contains(&p.y)));
        for c in patch.indices.chunks_exact(3) {
            let [a, b, d] = [0, 1, 2].map(|i| patch.positions[c[i] as usize]);
            let flat = (b - a).cross(d - a).normalize();
            let mean = c.iter().map(|&i| patch.normals[i as usize]).sum::<Vec3>().normalize();
            assert!(flat.y > 0.0 && flat.dot(mean) > 0.97, "{a}: {flat} {mean}");
        }
    }

    #[test]
    fn the_camera_over_the_ground_sees_it_without_the_things() {
        let scene = stage(&["queen"], &Ground::default());
        let pose = Pose::rest(&scene);
        let node = scene.nodes.iter().position(|n| n.camera == Some(2)).unwrap();
        let view = View::new(&scene.cameras[2], pose.world[node], [64, 64]);
        let depth = |p: Vec3| -view.view_from_world.transform_point3(p).z;
        assert!(depth(Vec3::ZERO) > view.near && depth(Vec3::ZERO) < view.far);
        assert!(depth(Vec3::Y * boxes(&scene)[0].min.y) < view.near);
        // The picture's right is +X, its top is −Z.
        let right = view.view_from_world.transform_vector3(Vec3::X);
        assert!(right.x > 0.99 && view.view_from_world.transform_vector3(Vec3::NEG_Z).y > 0.99);
    }

    #[test]
    fn numbers_out_of_range_are_refused_and_named() {
        let queen = [builtin::load("queen").unwrap()];
        for (ground, key) in [
            (Ground { copies: 0, ..Ground::default() }, "copies"),
            (Ground { copies: 20_000, ..Ground::default() }, "copies"),
            (Ground { height: Some(f32::NAN), ..Ground::default() }, "height"),
            (Ground { sunk: 2.0, ..Ground::default() }, "sunk"),
            (Ground { gap: f32::INFINITY, ..Ground::default() }, "gap"),
        ] {
            let error = on_ground(&queen, &ground).unwrap_err();
            assert!(error.exit_code() == 2 && error.to_string().contains(&format!("ground.{key}")), "{error}");
        }
        assert_eq!(on_ground(&[Scene::default()], &Ground::default()).unwrap_err().exit_code(), 3);
    }
}

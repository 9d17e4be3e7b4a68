//! Adds a camera and lights to scenes without them, so that every file gives a picture. A note tells the user what was added.

use glam::{Mat4, Quat, Vec3};
use lucerna::scene::{
    Aabb, Camera, Environment, Light, LightKind, Material, Node, Note, NoteKind, Projection, Scene, Transform,
};
use serde::{Deserialize, Serialize};

use crate::{
    interior::{self, Interior},
    scene_bounds,
};

/// Full vertical angle of view of an added camera, radians.
const YFOV: f32 = 45.0 * std::f32::consts::PI / 180.0;
/// The same in an interior.
const YFOV_INTERIOR: f32 = 60.0 * std::f32::consts::PI / 180.0;
/// Factor on the distance from which an added camera just sees the whole scene.
const MARGIN: f32 = 1.05;
/// Direction from the middle of the scene to an added camera: to the right, above, in front.
const VIEW_FROM: Vec3 = Vec3::new(0.55, 0.4, 1.0);
/// Irradiance of an added sun on a plane that faces it, W/m². With the added sky, a white wall that faces the sun stays below radiance 1.
const SUN: f32 = 2.0;
/// Height of an added lamp, as share of the height of the interior. On the floor its irradiance is that of the added sun.
const LAMP: f32 = 0.8;
/// Direction towards an added sun.
const SUN_FROM: Vec3 = Vec3::new(0.5, 1.0, 0.6);
/// Radiance of an added sky, W/(sr·m²): above, at the horizon, below.
const SKY: [Vec3; 3] = [Vec3::new(0.24, 0.32, 0.44), Vec3::new(0.34, 0.34, 0.34), Vec3::new(0.12, 0.11, 0.09)];

/// Adds a camera that sees the whole scene, if the scene has no camera.
pub fn add_missing_camera(scene: &mut Scene, aspect: f32) {
    if scene.nodes.iter().any(|node| node.camera.is_some()) {
        return;
    }
    let (name, text, (world_from_view, projection)) = match interior::find(scene) {
        Some(interior) => ("inside", "a camera was added inside the room", in_interior(&interior)),
        None => {
            let bounds =
                scene_bounds::over_animations(scene).unwrap_or(Aabb { min: Vec3::splat(-1.0), max: Vec3::ONE });
            let from = interior::opening(scene).unwrap_or(VIEW_FROM);
            ("fitted", "a camera was added that sees the whole scene", fitted(&bounds, aspect, from))
        }
    };
    scene.cameras.push(Camera { name: name.into(), projection });
    add_node(scene, "added camera", world_from_view, |node, scene| node.camera = Some(scene.cameras.len() as u32 - 1));
    note(scene, "cameras", &format!("the scene has no camera: {text}"));
}

/// A camera at one end of an interior, looking along it.
fn in_interior(room: &Interior) -> (Mat4, Projection) {
    let back = -room.forward;
    let right = Vec3::Y.cross(back);
    let world = Mat4::from_cols(right.extend(0.0), Vec3::Y.extend(0.0), back.extend(0.0), room.eye.extend(1.0));
    let znear = (room.length * 2e-3).max(1e-4);
    (world, Projection::Perspective { yfov: YFOV_INTERIOR, aspect: None, znear, zfar: Some(room.length * 2.0) })
}

/// When default lights are added.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DefaultLight {
    /// If the scene has no light, no environment, and no emissive surface without a texture
    #[default]
    Auto,
    Always,
    Never,
}

/// Note for scenes without other lights. It does not apply to the path tracer.
pub const EMISSIVE_ALONE: &str = "only emissive surfaces light the scene; with isr only the emissive surfaces in the picture give \
                                  light (--default-light always adds a sun and a sky, --light adds a lamp)";

/// Adds default lights to a dark scene, or as `choice` demands: a lamp to an interior, else a sun and a sky.
///
/// A surface with an emissive texture counts as a display and not as a lamp, because displays are too weak to light a scene.
pub fn add_missing_light(scene: &mut Scene, choice: DefaultLight) {
    let lamp = |m: &Material| m.emissive.max_element() > 0.0 && m.emissive_texture.is_none();
    let lit = scene.environment.is_some() || scene.nodes.iter().any(|node| node.light.is_some());
    let lamps = scene.materials.iter().any(lamp);
    if !lit && lamps && choice != DefaultLight::Always {
        note(scene, "lights", EMISSIVE_ALONE);
    }
    if choice == DefaultLight::Never || (choice == DefaultLight::Auto && (lit || lamps)) {
        return;
    }
    if let Some((under, floor)) = interior::find(scene).and_then(|room| Some((room.ceiling?, room.floor))) {
        // A sun cannot light a closed room, and techniques without shadows for the sky would let it shine through the walls.
        let height = under.y - floor.y;
        let lamp = Light {
            name: "default lamp".into(),
            kind: LightKind::Point { range: None },
            color: Vec3::ONE,
            intensity: SUN * (LAMP * height).powi(2),
        };
        add_light(scene, lamp, Mat4::from_translation(floor + Vec3::Y * LAMP * height));
        note(
            scene,
            "lights",
            "the scene has no light: a lamp was added inside the room (--default-light never adds none)",
        );
        return;
    }
    let light = Light { name: "default sun".into(), kind: LightKind::Directional, color: Vec3::ONE, intensity: SUN };
    add_light(scene, light, Mat4::from_quat(Quat::from_rotation_arc(Vec3::Z, SUN_FROM.normalize())));
    scene.environment.get_or_insert_with(default_sky);
    note(scene, "lights", "a sun and a sky were added (--default-light never adds none)");
}

/// Adds a light with the transform `world`.
pub fn add_light(scene: &mut Scene, light: Light, world: Mat4) {
    let name = light.name.clone();
    scene.lights.push(light);
    add_node(scene, &name, world, |node, scene| node.light = Some(scene.lights.len() as u32 - 1));
}

/// Bluish above, grey at the horizon, brown below.
pub fn default_sky() -> Environment {
    let (width, height) = (8, 64);
    let [above, horizon, below] = SKY;
    let pixels = (0..height * width)
        .map(|i| {
            let elevation = 1.0 - 2.0 * ((i / width) as f32 + 0.5) / height as f32;
            horizon.lerp(if elevation > 0.0 { above } else { below }, elevation.abs().sqrt())
        })
        .collect();
    Environment { name: "default sky".into(), width, height, pixels, rotation: 0.0, scale: 1.0 }
}

fn add_node(scene: &mut Scene, name: &str, world: Mat4, fill: impl FnOnce(&mut Node, &Scene)) {
    let (scale, rotation, translation) = world.to_scale_rotation_translation();
    let local = Transform::Trs { translation, rotation, scale };
    let mut node = Node { name: name.into(), local, ..Node::default() };
    fill(&mut node, scene);
    scene.nodes.push(node);
}

fn note(scene: &mut Scene, place: &str, text: &str) {
    scene.notes.push(Note { kind: NoteKind::Approximated, place: place.into(), text: text.into() });
}

/// A camera in the direction `from` of the middle of `bounds`. The picture shows every corner of `bounds`, with a small margin.
fn fitted(bounds: &Aabb, aspect: f32, from: Vec3) -> (Mat4, Projection) {
    let radius = bounds.half().length().max(1e-4);
    let back = from.normalize();
    let right = Vec3::Y.cross(back).normalize();
    let up = back.cross(right);
    let slope = (YFOV * 0.5).tan();
    let needed = |corner: Vec3| {
        let p = corner - bounds.centre();
        p.dot(back) + (p.dot(right).abs() / (slope * aspect)).max(p.dot(up).abs() / slope)
    };
    let distance = bounds.corners().into_iter().map(needed).fold(radius, f32::max) * MARGIN;
    let position = bounds.centre() + back * distance;
    let world = Mat4::from_cols(right.extend(0.0), up.extend(0.0), back.extend(0.0), position.extend(1.0));
    let (znear, zfar) = ((distance - radius) * 0.5, Some((distance + radius) * 2.0));
    (world, Projection::Perspective { yfov: YFOV, aspect: None, znear: znear.max(radius * 1e-3), zfar })
}

#[cfg(test)]
mod tests {
    use glam::Vec4;
    use lucerna::scene::{Mesh, Primitive, TextureRef};

    use super::*;

    fn cube(min: Vec3, max: Vec3) -> Scene {
        let (normals, tangents) = (vec![Vec3::Y; 2], vec![Vec4::ZERO; 2]);
        let primitive = Primitive { positions: vec![min, max], normals, tangents, ..Primitive::default() };
        Scene {
            meshes: vec![Mesh { primitives: vec![primitive], ..Mesh::default() }],
            nodes: vec![Node { mesh: Some(0), ..Node::default() }],
            materials: vec![Material::default()],
            ..Scene::default()
        }
    }

    #[test]
    fn the_added_camera_sees_every_corner() {
        for (min, max) in [(Vec3::splat(-1.0), Vec3::ONE), (Vec3::new(100.0, 0.0, -3.0), Vec3::new(400.0, 2.0, 0.0))] {
            for aspect in [0.3, 1.0, 2.5] {
                let mut scene = cube(min, max);
                add_missing_camera(&mut scene, aspect);
                let view_from_world = scene.nodes.last().unwrap().local.matrix().inverse();
                let Projection::Perspective { yfov, znear, zfar, .. } = scene.cameras[0].projection else { panic!() };
                for corner in 0..8 {
                    let pick = |bit: u32| (corner >> bit & 1) as f32;
                    let point = min + (max - min) * Vec3::new(pick(0), pick(1), pick(2));
                    let seen = view_from_world.transform_point3(point);
                    let half = (yfov * 0.5).tan() * -seen.z * 1.001;
                    assert!(seen.x.abs() <= half * aspect && seen.y.abs() <= half, "{seen}");
                    assert!((znear..=zfar.unwrap()).contains(&-seen.z), "{seen}");
                }
            }
        }
    }

    #[test]
    fn nothing_is_added_where_something_is() {
        let mut scene = cube(Vec3::ZERO, Vec3::ONE);
        scene.cameras.push(Camera { name: "own".into(), projection: fitted_projection() });
        scene.nodes[0].camera = Some(0);
        scene.materials[0].emissive = Vec3::X;
        add_missing_camera(&mut scene, 1.0);
        add_missing_light(&mut scene, DefaultLight::Auto);
        assert!(scene.nodes.len() == 1 && scene.environment.is_none());
        assert!(scene.notes.len() == 1 && scene.notes[0].text.contains("emissive"), "{:?}", scene.notes);
        scene.materials[0].emissive_texture = Some(TextureRef::new(0));
        add_missing_light(&mut scene, DefaultLight::Never);
        assert!(scene.lights.is_empty());
        add_missing_light(&mut scene, DefaultLight::Auto);
        assert!(scene.lights.len() == 1 && scene.environment.is_some() && scene.notes.len() == 2);
        // Lights shine along −Z of their node. The added sun must shine from above.
        assert!(scene.nodes[1].local.matrix().transform_vector3(Vec3::NEG_Z).y < -0.5);
    }

    fn fitted_projection() -> Projection {
        fitted(&Aabb { min: Vec3::ZERO, max: Vec3::ONE }, 1.0, VIEW_FROM).1
    }
}

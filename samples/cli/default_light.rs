//! Adds lights to dark scenes, so that every file gives a picture. A note tells the user what was added.

use glam::{Mat4, Quat, Vec3};
use lucerna::scene::environment::{direction_from_uv, solid_angle};
use lucerna::scene::{Environment, Light, LightKind, Pose, Scene, View, bvh::Bvh};
use serde::{Deserialize, Serialize};

use crate::{
    framing::{add_node, note},
    interior::Survey,
    sight::{self, Sight},
};

/// Irradiance of an added sun on a plane that faces it, W/m². With the added sky, a white wall that faces the sun stays below radiance 1.
pub const SUN: f32 = 2.0;
/// Height of an added lamp, as share of the height of the interior. On the floor its irradiance is that of the added sun.
const LAMP: f32 = 0.8;
/// Name of an added sun.
const ADDED_SUN: &str = "default sun";
/// Direction towards an added sun.
const SUN_FROM: Vec3 = Vec3::new(0.5, 1.0, 0.6);
/// Radiance of an added sky, W/(sr·m²): above, at the horizon, below.
const SKY: [Vec3; 3] = [Vec3::new(0.24, 0.32, 0.44), Vec3::new(0.34, 0.34, 0.34), Vec3::new(0.12, 0.11, 0.09)];

/// When default lights are added.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DefaultLight {
    /// If the scene has no light and no environment, and its emissive surfaces (without textures) do not light the picture; a picture that would be black
    /// gets a light, too, and is made again
    #[default]
    Auto,
    Always,
    Never,
}

/// Note for scenes without other lights.
const EMISSIVE_ALONE: &str =
    "only emissive surfaces light the scene (--default-light always adds a sun and a sky, --light adds a lamp)";

/// Adds default lights to a dark scene, or as `choice` demands: a lamp to an interior, else a sun and a sky. `seen`: the pose and the view of the
/// picture. Without them, emissive surfaces light a scene wherever they are.
///
/// A surface with an emissive texture counts as a display and not as a lamp, because displays are too weak to light a scene.
pub fn add_missing_light(scene: &mut Scene, choice: DefaultLight, seen: Option<(&Pose, &View)>) {
    let lit = scene.environment.is_some() || scene.nodes.iter().any(|node| node.light.is_some());
    let glows = scene.materials.iter().any(sight::is_lamp);
    let enough = glows && (lit || choice != DefaultLight::Auto || seen.is_none_or(|seen| lit_by_surfaces(scene, seen)));
    if !lit && enough && choice != DefaultLight::Always {
        note(scene, "lights", EMISSIVE_ALONE);
    }
    if choice == DefaultLight::Never || (choice == DefaultLight::Auto && (lit || enough)) {
        return;
    }
    let why = match (lit, glows) {
        (true, _) => "",
        (false, true) => "the emissive surfaces light too little of the picture: ",
        (false, false) => "the scene has no light: ",
    };
    let bvh = Bvh::build(scene, &Pose::playing(scene, 0.0));
    let room = Survey::of(&bvh).and_then(|survey| survey.interior());
    if let Some((under, floor)) = room.and_then(|room| Some((room.ceiling?, room.floor))) {
        // A sun and a sky cannot light a closed room.
        let height = under.y - floor.y;
        let lamp = Light {
            name: "default lamp".into(),
            kind: LightKind::Point { range: None },
            color: Vec3::ONE,
            intensity: SUN * (LAMP * height).powi(2),
        };
        add_light(scene, lamp, Mat4::from_translation(floor + Vec3::Y * LAMP * height));
        note(scene, "lights", &format!("{why}a lamp was added inside the room (--default-light never adds none)"));
        return;
    }
    let light = Light { name: ADDED_SUN.into(), kind: LightKind::Directional, color: Vec3::ONE, intensity: SUN };
    add_light(scene, light, Mat4::from_quat(Quat::from_rotation_arc(Vec3::Z, SUN_FROM.normalize())));
    let sky = if scene.environment.is_some() { "" } else { " and a sky" };
    scene.environment.get_or_insert_with(default_sky);
    let were = if sky.is_empty() { "was" } else { "were" };
    note(scene, "lights", &format!("{why}a sun{sky} {were} added (--default-light never adds none)"));
}

fn lit_by_surfaces(scene: &Scene, (pose, view): (&Pose, &View)) -> bool {
    let bvh = Bvh::build(scene, pose);
    Sight::of(scene, &bvh, view).is_lit_by_surfaces()
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
    let pixels = (0..height * width).map(|i| sky(1.0 - 2.0 * ((i / width) as f32 + 0.5) / height as f32)).collect();
    Environment { name: "default sky".into(), width, height, pixels, rotation: 0.0, scale: 1.0 }
}

/// Radiance of the added sky at an elevation from −1 (straight down) to 1, W/(sr·m²).
fn sky(elevation: f32) -> Vec3 {
    let [above, horizon, below] = SKY;
    horizon.lerp(if elevation > 0.0 { above } else { below }, elevation.abs().sqrt())
}

/// Angular radius of the added sun in an environment, radians. It is larger than the real sun, so that few vectors have soft shadows.
const SUN_RADIUS: f32 = 0.1;

/// Replaces the added sun and the added sky by one environment with the same irradiance, for the technique `name`. An added lamp stays.
pub fn put_into_environment(scene: &mut Scene, name: &str) {
    let Some(index) = scene.lights.iter().position(|light| light.name == ADDED_SUN) else { return };
    for node in &mut scene.nodes {
        if node.light == Some(index as u32) {
            node.light = None;
        }
    }
    // The sun is the last light, so no number of another light changes.
    scene.lights.truncate(index);
    let (width, height) = (256u32, 128u32);
    let (sun, edge) = (SUN_FROM.normalize(), SUN_RADIUS.cos());
    let direction = |i: u32| {
        let uv = glam::vec2(((i % width) as f32 + 0.5) / width as f32, ((i / width) as f32 + 0.5) / height as f32);
        direction_from_uv(uv)
    };
    let inside = |i: u32| direction(i).dot(sun) > edge;
    // The pixels of the disc together have the sun's irradiance.
    let facing = |i: u32| solid_angle(width, height, i / width) as f32 * direction(i).dot(sun);
    let disc: f32 = (0..width * height).filter(|i| inside(*i)).map(facing).sum();
    let pixel = |i: u32| {
        let elevation = 1.0 - 2.0 * ((i / width) as f32 + 0.5) / height as f32;
        sky(elevation) + Vec3::splat(if inside(i) { SUN / disc } else { 0.0 })
    };
    let pixels = (0..width * height).map(pixel).collect();
    let name_of = "default sun and sky".into();
    scene.environment = Some(Environment { name: name_of, width, height, pixels, rotation: 0.0, scale: 1.0 });
    note(
        scene,
        "lights",
        &format!(
            "{name} takes light from the environment only: the added sun is a part of the sky (--environment FILE chooses another one)"
        ),
    );
}

#[cfg(test)]
mod tests {
    use glam::Vec4;
    use lucerna::scene::{Material, Mesh, Node, Primitive, TextureRef};

    use super::*;

    #[test]
    fn lights_are_added_to_dark_scenes_alone() {
        let primitive = Primitive {
            positions: vec![Vec3::ZERO, Vec3::ONE],
            normals: vec![Vec3::Y; 2],
            tangents: vec![Vec4::ZERO; 2],
            ..Primitive::default()
        };
        let glowing = Material { emissive: Vec3::X, ..Material::default() };
        let mut scene = Scene {
            meshes: vec![Mesh { primitives: vec![primitive], ..Mesh::default() }],
            nodes: vec![Node { mesh: Some(0), ..Node::default() }],
            materials: vec![glowing],
            ..Scene::default()
        };
        add_missing_light(&mut scene, DefaultLight::Auto, None);
        assert!(scene.nodes.len() == 1 && scene.environment.is_none());
        assert!(scene.notes.len() == 1 && scene.notes[0].text.contains("emissive"), "{:?}", scene.notes);
        scene.materials[0].emissive_texture = Some(TextureRef::new(0));
        add_missing_light(&mut scene, DefaultLight::Never, None);
        assert!(scene.lights.is_empty());
        add_missing_light(&mut scene, DefaultLight::Auto, None);
        assert!(scene.lights.len() == 1 && scene.environment.is_some() && scene.notes.len() == 2);
        // Lights shine along −Z of their node. The added sun must shine from above.
        assert!(scene.nodes[1].local.matrix().transform_vector3(Vec3::NEG_Z).y < -0.5);
        // In an environment they give the same irradiance to the ground.
        let mut soft = scene.clone();
        put_into_environment(&mut soft, "fiv");
        assert!(soft.lights.is_empty() && soft.nodes.iter().all(|node| node.light.is_none()));
        let irradiance = |environment: &Environment| -> Vec3 {
            let (width, height) = (environment.width, environment.height);
            let lit = |i: usize| {
                let (x, y) = (i as u32 % width, i as u32 / width);
                let uv = glam::vec2((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32);
                environment.pixels[i] * (direction_from_uv(uv).y.max(0.0) * solid_angle(width, height, y) as f32)
            };
            (0..environment.pixels.len()).map(lit).sum()
        };
        let of_sun = irradiance(soft.environment.as_ref().unwrap()) - irradiance(scene.environment.as_ref().unwrap());
        let expected = SUN * SUN_FROM.normalize().y;
        assert!((of_sun / expected - Vec3::ONE).abs().max_element() < 0.01, "{of_sun} {expected}");
        assert!(soft.notes.last().unwrap().text.contains("fiv takes light from the environment only"));
        // Now there are lights: no others are added, unless the user asks for them.
        add_missing_light(&mut scene, DefaultLight::Auto, None);
        assert_eq!(scene.lights.len(), 1);
        add_missing_light(&mut scene, DefaultLight::Always, None);
        assert!(scene.lights.len() == 2 && scene.notes.last().unwrap().text.starts_with("a sun was added"));
    }
}

//! `--put`: lamps that stand elsewhere than in the scene's file, and suns that shine from elsewhere.

use std::{collections::BTreeMap, fmt, str::FromStr};

use glam::{Mat4, Quat, Vec3};
use lucerna::{
    Error, Result,
    scene::{LightKind, Pose, Scene, Transform},
};
use serde::{Deserialize, Serialize};

use crate::{
    as_text::as_text,
    config,
    lights::{numbers as numbers_of, towards},
};

/// Where a lamp is put.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Put {
    /// The place of a lamp, metres.
    At(Vec3),
    /// Towards a sun: azimuth (0 over +Z, 90 over +X) and elevation, degrees.
    Towards([f32; 2]),
}

impl Put {
    /// The place in the world of a lamp that stands at `before`.
    pub fn world(self, before: Mat4) -> Mat4 {
        match self {
            Self::At(place) => Mat4::from_cols(before.x_axis, before.y_axis, before.z_axis, place.extend(1.0)),
            Self::Towards(angles) => {
                let turn = Quat::from_rotation_arc(Vec3::Z, towards(angles));
                Mat4::from_rotation_translation(turn, before.w_axis.truncate())
            }
        }
    }
}

/// Puts lamps of a pose elsewhere, by their nodes.
pub fn apply(pose: &mut Pose, moved: &BTreeMap<usize, Put>) {
    for (node, put) in moved {
        if let Some(world) = pose.world.get_mut(*node) {
            *world = put.world(*world);
        }
    }
}

/// Azimuth and elevation of a sun in its place, degrees.
pub fn angles(world: Mat4) -> [f32; 2] {
    let to_sun = world.transform_vector3(Vec3::Z).normalize_or(Vec3::Y);
    [to_sun.x.atan2(to_sun.z).to_degrees(), to_sun.y.clamp(-1.0, 1.0).asin().to_degrees()]
}

/// A lamp that is put elsewhere: `LAMP=X,Y,Z`, or `LAMP=AZIMUTH,ELEVATION` for a sun.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct Lamp {
    /// Number among the scene's lamps, or name of its node or of its light.
    pub lamp: String,
    pub put: Put,
}

impl FromStr for Lamp {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            "expected LAMP=X,Y,Z in metres, or LAMP=AZIMUTH,ELEVATION in degrees for a sun, like 0=1,2.5,0".to_owned()
        };
        let (lamp, numbers) = text.rsplit_once('=').filter(|(lamp, _)| !lamp.is_empty()).ok_or_else(wrong)?;
        let put = match numbers_of(numbers).map_err(|_| wrong())?[..] {
            [x, y, z] => Put::At(Vec3::new(x, y, z)),
            [azimuth, elevation] if (-90.0..=90.0).contains(&elevation) => Put::Towards([azimuth, elevation]),
            _ => return Err(wrong()),
        };
        Ok(Self { lamp: lamp.to_owned(), put })
    }
}

impl fmt::Display for Lamp {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.put {
            Put::At(Vec3 { x, y, z }) => write!(f, "{}={x},{y},{z}", self.lamp),
            Put::Towards([azimuth, elevation]) => write!(f, "{}={azimuth},{elevation}", self.lamp),
        }
    }
}

as_text!(Lamp);

/// The nodes that carry a light, in the order of their numbers.
pub fn nodes(scene: &Scene) -> Vec<usize> {
    let lit = |index: &usize| scene.nodes[*index].light.is_some_and(|light| (light as usize) < scene.lights.len());
    (0..scene.nodes.len()).filter(lit).collect()
}

/// Name of a lamp for a person.
pub fn name(scene: &Scene, node: usize) -> &str {
    let of = &scene.nodes[node];
    let light = of.light.and_then(|light| scene.lights.get(light as usize)).map_or("", |light| light.name.as_str());
    [of.name.as_str(), light].into_iter().find(|name| !name.is_empty()).unwrap_or("lamp")
}

/// Whether a node carries a light that comes from one direction.
pub fn is_sun(scene: &Scene, node: usize) -> bool {
    let light = scene.nodes[node].light.and_then(|light| scene.lights.get(light as usize));
    light.is_some_and(|light| matches!(light.kind, LightKind::Directional))
}

/// Moves lamps of a scene, and returns their nodes with their places in the world: the place of the changed node itself has rounding errors of the nodes
/// above.
///
/// # Errors
/// `Usage` for a lamp that the scene does not have, one that an animation moves, and a place for a sun or a direction for a lamp.
pub fn put(scene: &mut Scene, lamps: &[Lamp]) -> Result<Vec<(usize, Mat4)>> {
    let mut out = Vec::new();
    for lamp in lamps {
        let node = find(scene, &lamp.lamp)?;
        let wrong = |what: &str| Err(Error::usage(format!("{lamp}: {what}")).at("--put"));
        match (lamp.put, is_sun(scene, node)) {
            (Put::At(_), true) => return wrong("this light is a sun, which has AZIMUTH,ELEVATION and no place"),
            (Put::Towards(_), false) => return wrong("this light is no sun; it has a place X,Y,Z"),
            _ => (),
        }
        if is_animated(scene, node) {
            return wrong("an animation moves this lamp");
        }
        let rest = Pose::rest(scene);
        let parent =
            scene.nodes[node].parent.and_then(|parent| rest.world.get(parent as usize)).copied().unwrap_or_default();
        let world = lamp.put.world(rest.world[node]);
        let local = parent.inverse() * world;
        if !local.is_finite() {
            return wrong("the node above this lamp has no size, so the lamp has no place");
        }
        scene.nodes[node].local = Transform::Matrix(local);
        out.push((node, world));
    }
    Ok(out)
}

/// Whether an animation moves a node, or a node above it.
pub fn is_animated(scene: &Scene, node: usize) -> bool {
    let mut above = vec![node as u32];
    while let Some(parent) = above.last().and_then(|last| scene.nodes[*last as usize].parent) {
        above.push(parent);
    }
    scene.animations.iter().flat_map(|animation| &animation.channels).any(|channel| above.contains(&channel.node))
}

/// The node of a lamp by its number or name.
///
/// # Errors
/// `Usage` if there is none.
pub fn find(scene: &Scene, asked: &str) -> Result<usize> {
    let all = nodes(scene);
    if let Some(node) = asked.parse::<usize>().ok().and_then(|number| all.get(number)) {
        return Ok(*node);
    }
    let named = |node: &&usize| {
        let light = scene.nodes[**node].light.and_then(|light| scene.lights.get(light as usize));
        scene.nodes[**node].name == asked || light.is_some_and(|light| light.name == asked)
    };
    if let Some(node) = all.iter().find(named) {
        return Ok(*node);
    }
    let names: Vec<&str> = all.iter().map(|node| name(scene, *node)).collect();
    let hint = config::nearest(asked, names.iter().copied()).map(|name| format!(" (did you mean '{name}'?)"));
    let list: Vec<String> = names.iter().enumerate().map(|(number, name)| format!("{number} '{name}'")).collect();
    let known = if list.is_empty() { "no lamps".to_owned() } else { list.join(", ") };
    Err(Error::usage(format!("no lamp '{asked}'{}; the scene has {known}", hint.unwrap_or_default())).at("--put"))
}

#[cfg(test)]
mod tests {
    use lucerna::scene::{Animation, Channel, Interpolation, Keys, Light, Node};

    use super::*;

    fn scene() -> Scene {
        let light = |name: &str, kind: LightKind| Light { name: name.into(), kind, color: Vec3::ONE, intensity: 1.0 };
        let parent = Transform::Matrix(Mat4::from_translation(Vec3::new(5.0, 0.0, 1.0)) * Mat4::from_rotation_y(0.7));
        Scene {
            lights: vec![light("bulb", LightKind::Point { range: None }), light("", LightKind::Directional)],
            nodes: vec![
                Node { local: parent, ..Node::default() },
                Node { parent: Some(0), light: Some(0), ..Node::default() },
                Node { name: "sun".into(), light: Some(1), ..Node::default() },
            ],
            ..Scene::default()
        }
    }

    #[test]
    fn lamps_stand_where_they_are_put() {
        let mut moved = scene();
        let lamps: Vec<Lamp> = ["bulb=1,2,-3", "1=-120,35"].map(|text| text.parse().unwrap()).to_vec();
        let put = put(&mut moved, &lamps).unwrap();
        let pose = Pose::rest(&moved);
        assert_eq!(put.iter().map(|(node, _)| *node).collect::<Vec<_>>(), [1, 2]);
        assert!(put.iter().all(|(node, world)| world.abs_diff_eq(pose.world[*node], 1e-5)));
        assert!(pose.world[1].w_axis.truncate().abs_diff_eq(Vec3::new(1.0, 2.0, -3.0), 1e-5));
        let found = angles(pose.world[2]);
        assert!((found[0] + 120.0).abs() < 1e-3 && (found[1] - 35.0).abs() < 1e-3, "{found:?}");
    }

    #[test]
    fn directions_come_back_and_have_no_scale() {
        for (azimuth, elevation) in [(0.0, 10.0), (90.0, 45.0), (-120.0, 80.0), (30.0, -20.0)] {
            let world = Put::Towards([azimuth, elevation]).world(Mat4::IDENTITY);
            let found = angles(world);
            assert!((found[0] - azimuth).abs() < 1e-2 && (found[1] - elevation).abs() < 1e-2, "{found:?}");
            assert!((world.determinant() - 1.0).abs() < 1e-4);
        }
        assert!(Put::Towards([0.0, 90.0]).world(Mat4::IDENTITY).is_finite());
    }

    #[test]
    fn what_cannot_be_put_is_said() {
        for (text, parts) in [
            ("bulp=1,2,3", &["did you mean 'bulb'", "0 'bulb', 1 'sun'"][..]),
            ("7=1,2,3", &["no lamp '7'"]),
            ("bulb=10,20", &["no sun"]),
            ("sun=1,2,3", &["AZIMUTH"]),
        ] {
            let error = put(&mut scene(), &[text.parse().unwrap()]).unwrap_err();
            assert_eq!(error.exit_code(), 2);
            assert!(parts.iter().all(|part| error.to_string().contains(part)), "{error}");
        }
        let mut animated = scene();
        let values = Keys::Translation(vec![Vec3::ZERO]);
        let channel = Channel { node: 0, interpolation: Interpolation::Linear, times: vec![0.0], values };
        animated.animations.push(Animation { name: String::new(), channels: vec![channel] });
        assert!(put(&mut animated, &["0=1,2,3".parse().unwrap()]).unwrap_err().to_string().contains("animation"));
        for bad in ["", "=1,2,3", "a", "a=", "a=1", "a=1,2,x", "a=1,2,3,4", "a=0,91", "a=1,nan,3"] {
            assert!(bad.parse::<Lamp>().is_err(), "{bad}");
        }
    }
}

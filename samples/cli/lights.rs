//! Lights from the command line (`--light`, `--sun`).

use std::{fmt, str::FromStr};

use glam::{Mat4, Quat, Vec3};
use lucerna::scene::{Animation, Channel, Interpolation, Keys, Light, LightKind, Scene, Transform};
use serde::{Deserialize, Serialize};

use crate::{
    as_text::as_text,
    default_light::{self, DefaultLight},
};

/// Default irradiance of a sun, W/m².
const SUN: f32 = 2.0;

/// A white point light: `X,Y,Z,INTENSITY`, metres and W/sr. With `,X2,Y2,Z2,SECONDS` it moves in a straight line to the second position and
/// back, with a period of this many seconds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct Point {
    position: Vec3,
    intensity: f32,
    /// The second position, and the period in seconds.
    to: Option<(Vec3, f32)>,
}

/// A white sun: `AZIMUTH,ELEVATION[,IRRADIANCE]`, degrees and W/m². Azimuth 0 is over +Z, 90 over +X.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct Sun {
    azimuth: f32,
    elevation: f32,
    irradiance: f32,
}

impl FromStr for Point {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = "expected X,Y,Z,INTENSITY or X,Y,Z,INTENSITY,X2,Y2,Z2,SECONDS with intensity and seconds above 0, like 0,2.5,0,10";
        let (from, to) = match numbers(text)?[..] {
            [x, y, z, intensity] => ([x, y, z, intensity], None),
            [x, y, z, intensity, x2, y2, z2, seconds] if seconds > 0.0 => {
                ([x, y, z, intensity], Some((Vec3::new(x2, y2, z2), seconds)))
            }
            _ => return Err(wrong.into()),
        };
        let [x, y, z, intensity] = from;
        if intensity > 0.0 { Ok(Self { position: Vec3::new(x, y, z), intensity, to }) } else { Err(wrong.into()) }
    }
}

impl FromStr for Sun {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (azimuth, elevation, irradiance) = match numbers(text)?[..] {
            [azimuth, elevation] => (azimuth, elevation, SUN),
            [azimuth, elevation, irradiance] => (azimuth, elevation, irradiance),
            _ => return Err("expected AZIMUTH,ELEVATION[,IRRADIANCE], like 45,60".into()),
        };
        if !(-90.0..=90.0).contains(&elevation) || irradiance <= 0.0 {
            return Err("the elevation must be from -90 to 90 degrees, the irradiance above 0".into());
        }
        Ok(Self { azimuth, elevation, irradiance })
    }
}

/// Finite numbers between commas.
///
/// # Errors
/// The word that is no finite number.
pub fn numbers(text: &str) -> Result<Vec<f32>, String> {
    let one = |word: &str| word.trim().parse().ok().filter(|x: &f32| x.is_finite());
    text.split(',').map(|word| one(word).ok_or_else(|| format!("'{word}' is not a number"))).collect()
}

impl fmt::Display for Point {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Vec3 { x, y, z } = self.position;
        write!(f, "{x},{y},{z},{}", self.intensity)?;
        let Some((Vec3 { x, y, z }, seconds)) = self.to else { return Ok(()) };
        write!(f, ",{x},{y},{z},{seconds}")
    }
}

impl fmt::Display for Sun {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{},{},{}", self.azimuth, self.elevation, self.irradiance)
    }
}

as_text!(Point);
as_text!(Sun);

impl Point {
    /// A light that does not move: metres, W/sr.
    pub fn still(position: Vec3, intensity: f32) -> Self {
        Self { position, intensity, to: None }
    }
}

impl Sun {
    /// Unit vector towards the sun.
    fn direction(&self) -> Vec3 {
        towards([self.azimuth, self.elevation])
    }
}

/// Unit vector of an azimuth (0 is +Z, 90 is +X) and an elevation, degrees.
pub fn towards([azimuth, elevation]: [f32; 2]) -> Vec3 {
    let (azimuth, elevation) = (azimuth.to_radians(), elevation.to_radians());
    Vec3::new(azimuth.sin() * elevation.cos(), elevation.sin(), azimuth.cos() * elevation.cos())
}

/// Adds lights, and default lights as `when` says.
pub fn light(scene: &mut Scene, points: &[Point], sun: Option<&Sun>, when: DefaultLight) {
    add(scene, points, sun);
    default_light::add_missing_light(scene, when, None);
}

/// Adds the lights. With a sun it also adds the default sky, if the scene has no environment.
pub fn add(scene: &mut Scene, points: &[Point], sun: Option<&Sun>) {
    for (i, point) in points.iter().enumerate() {
        let name = format!("light {i}");
        let kind = LightKind::Point { range: None };
        let light = Light { name, kind, color: Vec3::ONE, intensity: point.intensity };
        default_light::add_light(scene, light, Mat4::from_translation(point.position));
        if let (Some((to, seconds)), Some(node)) = (point.to, scene.nodes.last_mut()) {
            node.local = Transform::Trs { translation: point.position, rotation: Quat::IDENTITY, scale: Vec3::ONE };
            let channel = Channel {
                node: scene.nodes.len() as u32 - 1,
                interpolation: Interpolation::Linear,
                times: vec![0.0, 0.5 * seconds, seconds],
                values: Keys::Translation(vec![point.position, to, point.position]),
            };
            scene.animations.push(Animation { name: format!("light {i}"), channels: vec![channel] });
        }
    }
    if let Some(sun) = sun {
        let light =
            Light { name: "sun".into(), kind: LightKind::Directional, color: Vec3::ONE, intensity: sun.irradiance };
        // Lights shine down −Z of their node.
        default_light::add_light(scene, light, Mat4::from_quat(Quat::from_rotation_arc(Vec3::Z, sun.direction())));
        scene.environment.get_or_insert_with(default_light::default_sky);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lights_are_read_and_written() {
        let point: Point = "1, -2.5,3,10".parse().unwrap();
        assert_eq!(point, Point { position: Vec3::new(1.0, -2.5, 3.0), intensity: 10.0, to: None });
        assert_eq!(point.to_string().parse(), Ok(point));
        let sun: Sun = "90,30".parse().unwrap();
        assert_eq!(sun, Sun { azimuth: 90.0, elevation: 30.0, irradiance: SUN });
        assert_eq!(sun.to_string().parse(), Ok(sun));
        let moving: Point = "1,2,3,10,4,5,6,2.5".parse().unwrap();
        assert_eq!(moving.to, Some((Vec3::new(4.0, 5.0, 6.0), 2.5)));
        assert_eq!(moving.to_string().parse(), Ok(moving));
        for wrong in ["", "1,2,3", "1,2,3,0", "1,2,3,x", "1,2,3,inf", "1,2,3,4,5", "1,2,3,4,5,6,7", "1,2,3,4,5,6,7,0"] {
            assert!(wrong.parse::<Point>().is_err(), "{wrong}");
        }
        for wrong in ["90", "0,91", "0,45,-1", "0,nan"] {
            assert!(wrong.parse::<Sun>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_moving_lamp_goes_there_and_back() {
        let mut scene = Scene::default();
        add(&mut scene, &["9,9,9,1".parse().unwrap(), "0,2,0,5,4,2,0,2".parse().unwrap()], None);
        let at = |seconds: f32| lucerna::scene::Pose::playing(&scene, seconds).world[1].w_axis.truncate();
        for (seconds, x) in [(0.0, 0.0), (0.5, 2.0), (1.0, 4.0), (1.75, 1.0), (2.5, 2.0)] {
            assert!(at(seconds).abs_diff_eq(Vec3::new(x, 2.0, 0.0), 1e-5), "{seconds}: {}", at(seconds));
        }
    }

    #[test]
    fn a_sun_shines_from_where_it_stands() {
        let mut scene = Scene::default();
        add(&mut scene, &["0,2,0,5".parse().unwrap()], Some(&"90,0".parse().unwrap()));
        assert_eq!((scene.lights.len(), scene.nodes.len()), (2, 2));
        let shines = scene.nodes[1].local.matrix().transform_vector3(Vec3::NEG_Z);
        assert!(shines.abs_diff_eq(Vec3::NEG_X, 1e-6), "{shines}");
        assert!(scene.environment.is_some());
        assert_eq!(scene.nodes[0].local.matrix().transform_point3(Vec3::ZERO), Vec3::Y * 2.0);
    }
}

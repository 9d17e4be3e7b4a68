//! The choice of the camera (`--camera`), and camera files.

use std::path::Path;

use glam::{Mat4, Vec3};
use lucerna::{Error, Result, scene::Projection};
use serde::{Deserialize, Serialize};

use crate::{config, views::ViewList};

/// A camera file. Lengths in metres, world space.
///
/// ```toml
/// position = [0.0, 1.6, 4.0]
/// target = [0.0, 1.0, 0.0]
/// yfov_degrees = 45.0
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraFile {
    pub position: Vec3,
    /// Point in the middle of the picture.
    pub target: Vec3,
    #[serde(default = "up")]
    pub up: Vec3,
    /// Full vertical angle of view.
    #[serde(default = "yfov")]
    pub yfov_degrees: f32,
    #[serde(default = "znear")]
    pub znear: f32,
    /// `None`: at infinity.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub zfar: Option<f32>,
}

fn up() -> Vec3 {
    Vec3::Y
}
fn yfov() -> f32 {
    45.0
}
fn znear() -> f32 {
    0.05
}

impl CameraFile {
    /// Reads and checks a file.
    pub fn read(path: &Path) -> Result<Self> {
        let text = config::read_text(path)?;
        let camera: Self = toml::from_str(&text).map_err(|error| {
            Error::input(error.message().to_owned())
                .in_file(path)
                .help("A camera file has position, target and, if wanted, up, yfov_degrees, znear, zfar")
        })?;
        camera.check().map_err(|what| Error::input(what).in_file(path))?;
        Ok(camera)
    }

    pub(crate) fn check(&self) -> Result<(), String> {
        for (name, v) in [("position", self.position), ("target", self.target), ("up", self.up)] {
            if !v.is_finite() {
                return Err(format!("{name} is {v}, not finite"));
            }
        }
        let forward = self.target - self.position;
        if forward.normalize_or_zero().cross(self.up.normalize_or_zero()).length() < 1e-4 {
            return Err("position, target and up do not span a plane".into());
        }
        if !(0.1..=179.0).contains(&self.yfov_degrees) {
            return Err(format!("yfov_degrees is {}, allowed are 0.1 to 179", self.yfov_degrees));
        }
        if !(self.znear.is_finite() && self.znear > 0.0)
            || self.zfar.is_some_and(|far| far.is_nan() || far <= self.znear)
        {
            return Err("znear must be above zero and zfar beyond znear".into());
        }
        Ok(())
    }

    /// `world_from_view`.
    pub fn world_from_view(&self) -> Mat4 {
        let back = (self.position - self.target).normalize();
        let right = self.up.cross(back).normalize();
        let up = back.cross(right);
        Mat4::from_cols(right.extend(0.0), up.extend(0.0), back.extend(0.0), self.position.extend(1.0))
    }

    pub fn projection(&self) -> Projection {
        Projection::Perspective {
            yfov: self.yfov_degrees.to_radians(),
            aspect: None,
            znear: self.znear,
            zfar: self.zfar,
        }
    }
}

/// The camera that `--camera` names.
#[derive(Clone, Debug, PartialEq)]
pub enum Choice {
    /// Index into the scene's cameras.
    Scene(usize),
    File(CameraFile),
}

/// Resolves `--camera` against the names of a scene's cameras: an index, a name, numbers, a file, a view of a list (`LIST.toml#NAME`).
pub fn choose(asked: &str, names: &[&str]) -> Result<Choice> {
    if let Ok(index) = asked.parse::<usize>() {
        return match index < names.len() {
            true => Ok(Choice::Scene(index)),
            false => Err(unknown(asked, names)),
        };
    }
    let exact = names.iter().position(|name| *name == asked);
    let relaxed = || names.iter().position(|name| name.eq_ignore_ascii_case(asked));
    if let Some(index) = exact.or_else(relaxed) {
        return Ok(Choice::Scene(index));
    }
    if let Some(camera) = in_numbers(asked)? {
        return Ok(Choice::File(camera));
    }
    if let Some((file, view)) = in_list(asked) {
        return ViewList::read(Path::new(file))?.find(view).map(|view| Choice::File(view.camera()));
    }
    let path = Path::new(asked);
    if path.extension().is_some_and(|e| e == "toml") || path.is_file() {
        return CameraFile::read(path).map(Choice::File);
    }
    Err(unknown(asked, names))
}

/// The camera of `X,Y,Z,TX,TY,TZ[,FOV[,NEAR]]`: its place and its target in metres, its vertical angle of view in degrees, and its near plane in metres;
/// `None` if `asked` is no list of six to eight numbers.
///
/// # Errors
/// `Usage` if the numbers make no camera.
pub fn in_numbers(asked: &str) -> Result<Option<CameraFile>> {
    let numbers: Option<Vec<f32>> = asked.split(',').map(|number| number.trim().parse().ok()).collect();
    let Some(numbers) = numbers.filter(|numbers| (6..=8).contains(&numbers.len())) else { return Ok(None) };
    let camera = CameraFile {
        position: Vec3::from_slice(&numbers),
        target: Vec3::from_slice(&numbers[3..]),
        up: up(),
        yfov_degrees: numbers.get(6).copied().unwrap_or_else(yfov),
        znear: numbers.get(7).copied().unwrap_or_else(znear),
        zfar: None,
    };
    camera.check().map_err(|what| Error::usage(what).at("--camera"))?;
    Ok(Some(camera))
}

/// Splits `LIST.toml#VIEW` into file and view.
pub fn in_list(asked: &str) -> Option<(&str, &str)> {
    asked.rsplit_once('#').filter(|(file, _)| Path::new(file).extension().is_some_and(|e| e == "toml"))
}

fn unknown(asked: &str, names: &[&str]) -> Error {
    let list: Vec<String> = names.iter().enumerate().map(|(index, name)| format!("{index} '{name}'")).collect();
    let hint = config::nearest(asked, names.iter().copied()).map(|name| format!(" (did you mean '{name}'?)"));
    let known = if list.is_empty() { "none; give a camera file (.toml)".to_owned() } else { list.join(", ") };
    Error::usage(format!("no camera '{asked}'{}; the scene has {known}", hint.unwrap_or_default()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chooses_by_index_name_and_file() {
        let names = ["front", "Back"];
        assert_eq!(choose("1", &names).unwrap(), Choice::Scene(1));
        assert_eq!(choose("back", &names).unwrap(), Choice::Scene(1));
        for bad in ["2", "fron", "nothing.toml"] {
            assert!(choose(bad, &names).is_err(), "{bad}");
        }
        assert!(choose("fron", &names).unwrap_err().to_string().contains("did you mean 'front'"));
    }

    #[test]
    fn numbers_are_a_camera() {
        let Choice::File(camera) = choose("1, 2,3,1,2,-7", &[]).unwrap() else { panic!() };
        assert_eq!((camera.position, camera.target), (Vec3::new(1.0, 2.0, 3.0), Vec3::new(1.0, 2.0, -7.0)));
        assert_eq!((camera.yfov_degrees, camera.znear), (45.0, 0.05));
        let Choice::File(camera) = choose("1,2,3,1,2,-7,60,0.5", &[]).unwrap() else { panic!() };
        assert_eq!((camera.yfov_degrees, camera.znear), (60.0, 0.5));
        for bad in [
            "1,2,3,1,2,3",
            "1,2,3,1,9,3",
            "1,2,3,4,5,6,0",
            "1,2,3,4,5,6,60,0",
            "1,2,3,nan,5,6",
            "1,2,3,4,5",
            "1,2,3,4,5,6,7,8,9",
        ] {
            assert_eq!(choose(bad, &[]).unwrap_err().exit_code(), 2, "{bad}");
        }
    }

    #[test]
    fn a_camera_file_looks_at_its_target() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("c.toml");
        std::fs::write(&path, "position = [1, 2, 3]\ntarget = [1, 2, -7]\nyfov_degrees = 60").unwrap();
        let camera = CameraFile::read(&path).unwrap();
        let view = camera.world_from_view();
        assert!((view.transform_point3(Vec3::ZERO) - Vec3::new(1.0, 2.0, 3.0)).length() < 1e-5);
        assert!((view.transform_vector3(Vec3::NEG_Z) - Vec3::NEG_Z).length() < 1e-5);
        for bad in [
            "position = [1, 2, 3]",
            "position = [1, 2, 3]\ntarget = [1, 2, 3]",
            "position = [1, 2, 3]\ntarget = [1, 9, 3]",
            "position = [1, 2, nan]\ntarget = [1, 9, 0]",
            "position = [1, 2, 3]\ntarget = [1, 2, 0]\nyfov_degrees = 180",
            "position = [1, 2, 3]\ntarget = [1, 2, 0]\nznear = 0",
            "position = [1, 2, 3]\ntarget = [1, 2, 0]\nfov = 3",
        ] {
            std::fs::write(&path, bad).unwrap();
            assert_eq!(CameraFile::read(&path).unwrap_err().exit_code(), 3, "{bad}");
        }
    }
}

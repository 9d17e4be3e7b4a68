//! Lists of views of a scene: recorded cameras, and random views that pass the rules of [`draw`].
//!
//! A list is a TOML file, which `lucerna views` writes and experiments read; `render --camera FILE.toml#NAME` takes one view.
//!
//! ```toml
//! scene = "office"
//! seed = 1
//! [[view]]
//! name = "office-003"
//! origin = "random"
//! position = [0.4, 1.2, 2.0]
//! target = [0.1, 0.9, 1.1]
//! yfov_degrees = 58.0
//! ```

pub mod command;
pub mod draw;

use std::path::Path;

use glam::Vec3;
use lucerna::{
    Error, Result,
    scene::{Pose, Projection, Scene},
};
use serde::{Deserialize, Serialize};

use crate::{camera::CameraFile, config, placed};

/// Views of one scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ViewList {
    /// Name of the built-in scene, or the path of its file.
    pub scene: String,
    /// Seed of the random views.
    pub seed: u64,
    #[serde(rename = "view")]
    pub views: Vec<NamedView>,
}

/// The origin of a view.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Origin {
    /// A camera of the scene, or from a camera file.
    Recorded,
    /// A random view ([`draw::views`]).
    Random,
}

/// A camera with a name. Lengths in metres, world space.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NamedView {
    pub name: String,
    pub origin: Origin,
    pub position: Vec3,
    /// Point in the middle of the picture.
    pub target: Vec3,
    #[serde(default = "up", skip_serializing_if = "is_up")]
    pub up: Vec3,
    /// Full vertical angle of view.
    pub yfov_degrees: f32,
    pub znear: f32,
    /// `None`: at infinity.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub zfar: Option<f32>,
}

fn up() -> Vec3 {
    Vec3::Y
}

fn is_up(v: &Vec3) -> bool {
    *v == Vec3::Y
}

impl NamedView {
    /// The camera of the view.
    pub fn camera(&self) -> CameraFile {
        let Self { position, target, up, yfov_degrees, znear, zfar, .. } = *self;
        CameraFile { position, target, up, yfov_degrees, znear, zfar }
    }

    /// A recorded view.
    pub fn recorded(name: String, camera: &CameraFile) -> Self {
        let CameraFile { position, target, up, yfov_degrees, znear, zfar } = *camera;
        Self { name, origin: Origin::Recorded, position, target, up, yfov_degrees, znear, zfar }
    }
}

impl ViewList {
    /// Reads and checks a list.
    ///
    /// # Errors
    /// `Input`, naming the file, the view and what is wrong with it.
    pub fn read(path: &Path) -> Result<Self> {
        let text = config::read_text(path)?;
        let list: Self = toml::from_str(&text).map_err(|error| {
            Error::input(error.message().to_owned())
                .in_file(path)
                .help("A list of views has scene, seed and [[view]] tables; `lucerna views` writes one")
        })?;
        for (index, view) in list.views.iter().enumerate() {
            let wrong = |what: String| Error::input(what).at(format!("view '{}'", view.name)).in_file(path);
            view.camera().check().map_err(wrong)?;
            if list.views[..index].iter().any(|other| other.name == view.name) {
                return Err(wrong("there are two views of this name".into()));
            }
        }
        Ok(list)
    }

    /// The view of a name, or of an index counted from 0.
    ///
    /// # Errors
    /// `Usage` if there is none.
    pub fn find(&self, asked: &str) -> Result<&NamedView> {
        let by_index = || asked.parse::<usize>().ok().and_then(|index| self.views.get(index));
        self.views.iter().find(|view| view.name == asked).or_else(by_index).ok_or_else(|| {
            let near = config::nearest(asked, self.views.iter().map(|view| view.name.as_str()));
            let hint = near.map(|name| format!(" (did you mean '{name}'?)")).unwrap_or_default();
            Error::usage(format!("no view '{asked}'{hint}; the list has {}", self.views.len()))
        })
    }
}

/// The cameras that stand in the scene, as views. Orthographic ones are left out.
pub fn recorded(scene: &Scene, pose: &Pose) -> Vec<NamedView> {
    let mut found: Vec<NamedView> = Vec::new();
    for (index, camera) in scene.cameras.iter().enumerate() {
        let node = scene.nodes.iter().position(|node| node.camera == Some(index as u32));
        let (Some(world), Projection::Perspective { yfov, znear, zfar, .. }) =
            (node.and_then(|node| pose.world.get(node)), camera.projection)
        else {
            continue;
        };
        let position = world.w_axis.truncate();
        let forward = -world.z_axis.truncate().normalize_or(Vec3::Z);
        let up = world.y_axis.truncate().normalize_or(Vec3::Y);
        // Omits the up vector of upright cameras, so that the file stays readable.
        let upright = forward.cross(Vec3::Y).normalize_or_zero().dot(up).abs() < 1e-4 && up.y > 0.0;
        let mut name = placed::name_of(camera, index);
        if found.iter().any(|view| view.name == name) {
            name = format!("{name}-{index}");
        }
        found.push(NamedView {
            name,
            origin: Origin::Recorded,
            position,
            target: position + forward,
            up: if upright { Vec3::Y } else { up },
            yfov_degrees: yfov.to_degrees(),
            znear,
            zfar,
        });
    }
    found
}

#[cfg(test)]
mod tests;

//! A camera in its place: one of a scene, or one of a file.

use std::borrow::Cow;

use glam::Mat4;
use lucerna::scene::{Camera, Pose, Scene, View};

use crate::{args::Size, camera::CameraFile, path::CameraPath};

/// A camera in its place.
#[derive(Clone, Debug, PartialEq)]
pub struct Placed {
    /// Name for files and metadata, never empty.
    pub name: String,
    pub camera: Camera,
    /// The node that carries the camera; `None` if the camera is not part of the scene.
    node: Option<usize>,
    /// The place of a camera without node.
    world_from_camera: Mat4,
    /// The flight of a camera without node.
    path: Option<CameraPath>,
}

impl Placed {
    /// A camera of the scene.
    pub fn of_scene(scene: &Scene, index: usize) -> Self {
        let camera = scene.cameras[index].clone();
        let node = scene.nodes.iter().position(|node| node.camera == Some(index as u32));
        let name = name_of(&camera, index);
        Self { name, camera, node, world_from_camera: Mat4::IDENTITY, path: None }
    }

    /// The camera of a file.
    pub fn from_file(name: String, file: &CameraFile) -> Self {
        Self::fixed(Camera { name, projection: file.projection() }, file.world_from_view())
    }

    /// A camera at a place of its own.
    pub fn fixed(camera: Camera, world_from_camera: Mat4) -> Self {
        Self { name: camera.name.clone(), camera, node: None, world_from_camera, path: None }
    }

    /// A camera that flies.
    pub fn on_path(name: String, path: CameraPath) -> Self {
        Self { path: Some(path.clone()), ..Self::from_file(name, &path.at(0.0)) }
    }

    /// The camera at a time, seconds.
    pub fn at(&self, seconds: f64) -> Cow<'_, Self> {
        match &self.path {
            Some(path) => Cow::Owned(Self::from_file(self.name.clone(), &path.at(seconds))),
            None => Cow::Borrowed(self),
        }
    }

    /// The view in a pose. Of a camera that flies, at time 0.
    pub fn view(&self, pose: &Pose, size: Size) -> View {
        let world_from_camera = self.node.map_or(self.world_from_camera, |node| pose.world[node]);
        View::new(&self.camera, world_from_camera, [size.width, size.height])
    }
}

/// The name of a camera of a scene; by its number if the scene has no name for the camera.
pub fn name_of(camera: &Camera, index: usize) -> String {
    if camera.name.is_empty() { format!("camera{index}") } else { camera.name.clone() }
}

//! An object that stands in a scene after its bake, as in figure 2 of the paper.

use glam::{Vec2, Vec3};
use lucerna::{
    Error, Result,
    image::Layer,
    scene::{
        Pose, Scene, View,
        added::{self, Standing},
        bvh::{Bvh, Ray},
    },
};
use serde::{Deserialize, Serialize};

/// A built-in object and its place in the picture, so that one description suits all scenes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct Object {
    /// Name of a built-in scene or object; empty: none.
    builtin: String,
    /// The point of the picture at which the object stands on the surface that is seen there: shares of the width, from the left, and of the height,
    /// from the top.
    x: f32,
    y: f32,
    /// Height of the object, as a share of the picture's height.
    height: f32,
}

impl Object {
    pub(super) fn is_some(&self) -> bool {
        !self.builtin.is_empty()
    }

    pub(super) fn validate(&self) -> Result<()> {
        if !self.is_some() {
            return Ok(());
        }
        let shares = [("object.x", self.x, 0.0), ("object.y", self.y, 0.0), ("object.height", self.height, 0.01)];
        lucerna_scenes::load(&self.builtin)?;
        match shares.iter().find(|(_, value, least)| !(*least..=1.0).contains(value)) {
            Some((key, value, least)) => Err(Error::usage(format!("{value}; {least} to 1 are allowed")).at(*key)),
            None => Ok(()),
        }
    }

    /// The scene with the object; as it is without one.
    ///
    /// # Errors
    /// `Usage` if no surface is seen where the object is to stand.
    pub(super) fn added_to(&self, scene: &Scene, view: &View) -> Result<Scene> {
        let mut scene = scene.clone();
        if !self.is_some() {
            return Ok(scene);
        }
        let ray = ray(view, self.x, self.y);
        let hit = Bvh::build(&scene, &Pose::rest(&scene)).closest(&ray);
        let nothing = || {
            let what = format!("no surface is seen at object.x = {}, object.y = {}", self.x, self.y);
            Error::usage(what).help("Choose another point of the picture")
        };
        let time = hit.ok_or_else(nothing)?.t;
        let object = lucerna_scenes::load(&self.builtin)?;
        let size = Bvh::build(&object, &Pose::rest(&object)).bounds().map_or(Vec3::ONE, |(low, high)| high - low);
        // The height of the picture at that distance, metres.
        let [top, bottom] = [0.0, 1.0].map(|y| view.world_from_depth(Vec2::new(self.x, y), time));
        let scale = self.height * top.distance(bottom) / size.y.max(1e-6);
        let standing = Standing { foot: ray.origin + time * ray.direction, scale, turn: 0.0 };
        added::add(&mut scene, object, &standing)?;
        Ok(scene)
    }
}

/// The ray through a point of the picture. Its time is 0 at the eye and 1 at the far plane.
fn ray(view: &View, x: f32, y: f32) -> Ray {
    let [near, far] = [0.0, 1.0].map(|depth| view.world_from_depth(Vec2::new(x, y), depth));
    Ray::new(near, far - near)
}

/// A layer that is 1 where the picture shows an added object.
pub(super) fn layer(scene: &Scene, view: &View) -> Layer {
    let nodes = scene.added.map_or(usize::MAX, |counts| counts.nodes);
    let bvh = Bvh::build(scene, &Pose::rest(scene));
    let [width, height] = view.extent;
    let shows = |x: u32, y: u32| {
        let at = |i: u32, of: u32| (i as f32 + 0.5) / of as f32;
        let hit = bvh.closest(&ray(view, at(x, width), at(y, height)));
        hit.is_some_and(|hit| bvh.id(hit.triangle).node as usize >= nodes)
    };
    let data = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let data = data.map(|(x, y)| if shows(x, y) { 1.0 } else { 0.0 }).collect();
    Layer::new("object", &["Y"], data)
}

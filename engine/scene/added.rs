//! Objects that are added to a scene.

use std::borrow::Cow;

use glam::{Quat, Vec3};

use super::{Note, NoteKind, Scene, Transform, ground};
use crate::{Error, Result};

/// Largest scale of an object, and one over the smallest.
pub const MOST_SCALE: f32 = 1e4;

/// Lengths of the lists of a scene before the first object was added. What was there is the beginning of each list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Counts {
    pub nodes: usize,
    pub meshes: usize,
    pub materials: usize,
    pub textures: usize,
    pub skins: usize,
    pub animations: usize,
}

/// The place of an object in a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Standing {
    /// World position of the middle of the object's underside, metres.
    pub foot: Vec3,
    /// Factor on the size of the object.
    pub scale: f32,
    /// Turn about +Y, degrees, counter-clockwise as seen from above.
    pub turn: f32,
}

/// Adds an object. Its cameras, lights and environment are left out; emissive surfaces stay. Animations go on.
///
/// # Errors
/// `Usage` for a place that is not finite or a scale out of range; `Input` if the object has no triangles.
///
/// ```
/// use lucerna::scene::added::{Standing, add};
///
/// let mut scene = lucerna_scenes::load("cornell")?;
/// let before = scene.nodes.len();
/// add(&mut scene, lucerna_scenes::load("hare")?, &Standing { foot: glam::Vec3::ZERO, scale: 0.2, turn: 30.0 })?;
/// assert!(scene.nodes.len() > before && scene.before_added().nodes.len() == before);
/// # Ok::<(), lucerna::Error>(())
/// ```
pub fn add(scene: &mut Scene, mut object: Scene, standing: &Standing) -> Result<()> {
    let Standing { foot, scale, turn } = *standing;
    if !(foot.is_finite() && turn.is_finite()) {
        return Err(Error::usage("the place of an added object is not finite"));
    }
    if !(1.0 / MOST_SCALE..=MOST_SCALE).contains(&scale) {
        let allowed = format!("{} to {MOST_SCALE}", 1.0 / MOST_SCALE);
        return Err(Error::usage(format!("an added object has a scale of {scale}; allowed: {allowed}")));
    }
    let around = ground::bounds(&object);
    if !(around.is_finite() && (around.max - around.min).max_element() > 0.0) {
        return Err(Error::input("has no triangles, so it cannot be added").at(format!("scene '{}'", object.name)));
    }
    let counts = scene.counts();
    scene.added.get_or_insert(counts);
    object.lights.clear();
    object.nodes.iter_mut().for_each(|node| node.light = None);
    let rotation = Quat::from_rotation_y(turn.to_radians());
    let middle = around.centre().with_y(around.min.y);
    let local = Transform::Trs { translation: foot - rotation * (middle * scale), rotation, scale: Vec3::splat(scale) };
    let base = ground::take(scene, &object);
    let number = scene.nodes.len() - counts.nodes;
    ground::stand(scene, &object, &base, (number, false), local);
    if object.environment.is_some() {
        let text = format!("the environment of the added object '{}' is left out", object.name);
        scene.notes.push(Note { kind: NoteKind::Ignored, place: "environment".into(), text });
    }
    Ok(())
}

impl Scene {
    fn counts(&self) -> Counts {
        Counts {
            nodes: self.nodes.len(),
            meshes: self.meshes.len(),
            materials: self.materials.len(),
            textures: self.textures.len(),
            skins: self.skins.len(),
            animations: self.animations.len(),
        }
    }

    /// The scene without the objects that were added ([`add`]).
    pub fn before_added(&self) -> Cow<'_, Self> {
        let Some(counts) = self.added else { return Cow::Borrowed(self) };
        let mut scene = self.clone();
        scene.nodes.truncate(counts.nodes);
        scene.meshes.truncate(counts.meshes);
        scene.materials.truncate(counts.materials);
        scene.textures.truncate(counts.textures);
        scene.skins.truncate(counts.skins);
        scene.animations.truncate(counts.animations);
        // Animations of equal names play together, so an object may have joined an animation of the scene.
        for animation in &mut scene.animations {
            animation.channels.retain(|channel| (channel.node as usize) < counts.nodes);
        }
        scene.added = None;
        Cow::Owned(scene)
    }
}

#[cfg(test)]
mod tests {
    use glam::vec3;

    use super::*;
    use crate::builtin;

    fn standing() -> Standing {
        Standing { foot: vec3(0.3, 0.1, -0.2), scale: 0.25, turn: 90.0 }
    }

    #[test]
    fn an_object_stands_where_it_was_put_and_leaves_the_scene_as_it_was() {
        let before = builtin::load("cornell").unwrap();
        let mut scene = before.clone();
        for name in ["hare", "queen"] {
            add(&mut scene, builtin::load(name).unwrap(), &standing()).unwrap();
        }
        scene.validate().unwrap();
        let object = |first: usize| {
            let mut alone = scene.clone();
            alone.nodes.iter_mut().enumerate().filter(|(i, _)| *i < first).for_each(|(_, node)| node.mesh = None);
            ground::bounds(&alone)
        };
        let all = object(before.nodes.len());
        assert!((all.min.y - 0.1).abs() < 1e-5, "{all:?}");
        let last = object(scene.nodes.len() - 1);
        let middle = last.centre();
        assert!((middle.x - 0.3).abs() < 2e-3 && (middle.z + 0.2).abs() < 2e-3, "{middle}");
        assert!((last.max.y - last.min.y - 0.25).abs() < 0.01, "{last:?}");
        let rest = scene.before_added();
        assert_eq!(format!("{:?}", rest.nodes), format!("{:?}", before.nodes));
        assert_eq!(format!("{:?}", rest.materials), format!("{:?}", before.materials));
        assert_eq!((rest.meshes.len(), rest.lights.len()), (before.meshes.len(), before.lights.len()));
        assert!(rest.added.is_none());
    }

    #[test]
    fn lights_and_cameras_of_an_object_are_left_out() {
        let mut scene = builtin::load("cornell").unwrap();
        let (lights, cameras) = (scene.lights.len(), scene.cameras.len());
        add(&mut scene, builtin::load("teapot").unwrap(), &standing()).unwrap();
        assert_eq!((scene.lights.len(), scene.cameras.len()), (lights, cameras));
        assert!(scene.notes.iter().any(|note| note.text.contains("added object 'teapot'")));
        scene.validate().unwrap();
    }

    #[test]
    fn numbers_out_of_range_and_empty_objects_are_refused() {
        let mut scene = builtin::load("cornell").unwrap();
        let wrong = [
            Standing { scale: 0.0, ..standing() },
            Standing { scale: f32::NAN, ..standing() },
            Standing { scale: -1.0, ..standing() },
            Standing { foot: Vec3::NAN, ..standing() },
            Standing { turn: f32::INFINITY, ..standing() },
        ];
        for standing in wrong {
            let error = add(&mut scene, builtin::load("hare").unwrap(), &standing).unwrap_err();
            assert_eq!(error.exit_code(), 2, "{error}");
        }
        assert_eq!(add(&mut scene, Scene::default(), &standing()).unwrap_err().exit_code(), 3);
        assert!(scene.added.is_none());
    }
}

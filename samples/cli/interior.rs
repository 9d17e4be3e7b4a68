//! Detects interiors: scenes that a camera should see from the inside.

use glam::Vec3;
use lucerna::scene::{
    Pose, Scene,
    bvh::{Bvh, Ray},
};

/// Number of horizontal directions in which rays are traced.
const DIRECTIONS: u32 = 24;
/// Minimum of rays that must hit the front of a wall in an interior.
const WALLS: u32 = 19;
/// Minimum of rays that must hit the front of a wall in a box with one open side.
const BOX: u32 = 15;
/// Height of the eye above the floor: the smaller of these shares of the interior's height and of its length.
const EYE: (f32, f32) = (0.45, 0.15);

/// An interior. Lengths in metres, world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interior {
    /// Position of the camera, at one end of the interior.
    pub eye: Vec3,
    /// Unit vector along the interior.
    pub forward: Vec3,
    /// Point of the ceiling above the middle; `None` without a ceiling.
    pub ceiling: Option<Vec3>,
    /// Point of the floor below the middle.
    pub floor: Vec3,
    /// Length of the interior.
    pub length: f32,
}

/// The surroundings of a scene's middle, found by tracing rays from it.
struct Survey {
    bvh: Bvh,
    min: Vec3,
    max: Vec3,
    middle: Vec3,
    floor: Vec3,
    /// Directions in which no wall was hit.
    open: Vec<Vec3>,
}

impl Survey {
    fn of(scene: &Scene) -> Option<Self> {
        let bvh = Bvh::build(scene, &Pose::playing(scene, 0.0));
        let (min, max) = bvh.bounds()?;
        let middle = (min + max) * 0.5;
        let mut survey = Self { bvh, min, max, middle, floor: middle, open: Vec::new() };
        survey.floor -= Vec3::Y * survey.inside(middle, Vec3::NEG_Y)?;
        let around = (0..DIRECTIONS).map(|i| {
            let angle = std::f32::consts::TAU * (i as f32 + 0.5) / DIRECTIONS as f32;
            Vec3::new(angle.cos(), 0.0, angle.sin())
        });
        survey.open = around.filter(|&direction| survey.inside(middle, direction).is_none()).collect();
        Some(survey)
    }

    /// Distance to the nearest surface, metres, if the ray hits its front. From inside a solid object rays hit backs only.
    fn inside(&self, from: Vec3, direction: Vec3) -> Option<f32> {
        let hit = self.bvh.closest(&Ray::new(from, direction))?;
        let [a, b, c] = self.bvh.triangles()[hit.triangle as usize];
        ((b - a).cross(c - a).dot(direction) < 0.0).then_some(hit.t)
    }

    fn walls(&self) -> u32 {
        DIRECTIONS - self.open.len() as u32
    }
}

/// Finds an interior: walls around the middle, with their front towards it, and a floor below.
pub fn find(scene: &Scene) -> Option<Interior> {
    let survey = Survey::of(scene)?;
    if survey.walls() < WALLS {
        return None;
    }
    let Survey { min, max, middle, floor, .. } = survey;
    let ceiling = survey.inside(middle, Vec3::Y).map(|t| middle + Vec3::Y * t);
    let size = max - min;
    let forward = if size.x >= size.z { Vec3::X } else { Vec3::NEG_Z };
    let top = ceiling.map_or(max.y, |ceiling| ceiling.y);
    let length = size.x.max(size.z);
    let height = floor.y + (EYE.0 * (top - floor.y)).min(EYE.1 * length);
    let centre = Vec3::new(middle.x, height, middle.z);
    let back = survey.inside(centre, -forward).unwrap_or(0.0);
    Some(Interior { eye: centre - forward * back * 0.9, forward, ceiling, floor, length })
}

/// For a box with one open side (the Cornell box), the horizontal direction out of it.
pub fn opening(scene: &Scene) -> Option<Vec3> {
    let survey = Survey::of(scene)?;
    let sum: Vec3 = survey.open.iter().sum();
    let one_side = sum.length() > 0.8 * survey.open.len() as f32;
    (one_side && (BOX..WALLS).contains(&survey.walls())).then(|| sum.normalize_or_zero())
}

#[cfg(test)]
mod tests {
    use lucerna_scenes as builtin;

    use super::*;

    #[test]
    fn rooms_are_told_from_bodies() {
        let room = find(&builtin::load("furnace").unwrap()).expect("a closed box is a room");
        let ceiling = room.ceiling.expect("it is closed above");
        assert!(room.floor.y < room.eye.y && room.eye.y < ceiling.y && room.length > 0.0);
        for body in ["furnace-sphere", "primitives"] {
            let scene = builtin::load(body).unwrap();
            assert_eq!((find(&scene), opening(&scene)), (None, None), "{body}");
        }
        // The Cornell box is open towards its camera.
        let scene = builtin::load("cornell").unwrap();
        let out = opening(&scene).expect("it is open");
        assert!(find(&scene).is_none() && out.dot(Vec3::NEG_Z) > 0.95, "{out}");
        assert_eq!(find(&Scene::default()), None);
    }
}

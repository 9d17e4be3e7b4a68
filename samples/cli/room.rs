//! Is a scene a room, to be seen from inside?

use glam::Vec3;
use lucerna::scene::{
    Pose, Scene,
    bvh::{Bvh, Ray},
};

/// Directions that are looked into, all around.
const DIRECTIONS: u32 = 24;
/// So many of them must end at the inside of a wall.
const WALLS: u32 = 19;
/// Height of the eye over the floor, of the height of the room and of its length, whichever is less.
const EYE: (f32, f32) = (0.45, 0.15);

/// A room, metres, world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Room {
    /// At eye height at one end of the room.
    pub eye: Vec3,
    /// Unit vector along the room.
    pub forward: Vec3,
    /// Over the middle; none where the sky is open.
    pub ceiling: Option<Vec3>,
    /// Under the middle.
    pub floor: Vec3,
    /// From end to end.
    pub length: f32,
}

/// A room if walls with their front towards the middle stand all around it, and a floor lies below. A solid body shows its
/// backs to its middle, so it is none.
pub fn find(scene: &Scene) -> Option<Room> {
    let bvh = Bvh::build(scene, &Pose::playing(scene, 0.0));
    let (min, max) = bvh.bounds()?;
    let middle = (min + max) * 0.5;
    let inside = |from: Vec3, direction: Vec3| {
        let t = bvh.closest(&Ray::new(from, direction))?;
        let [a, b, c] = bvh.triangles()[t.triangle as usize];
        ((b - a).cross(c - a).dot(direction) < 0.0).then_some(t.t)
    };
    let around = |i: u32| {
        let angle = std::f32::consts::TAU * (i as f32 + 0.5) / DIRECTIONS as f32;
        Vec3::new(angle.cos(), 0.0, angle.sin())
    };
    let walls = (0..DIRECTIONS).filter(|&i| inside(middle, around(i)).is_some()).count() as u32;
    let floor = middle - Vec3::Y * inside(middle, Vec3::NEG_Y)?;
    if walls < WALLS {
        return None;
    }
    let ceiling = inside(middle, Vec3::Y).map(|t| middle + Vec3::Y * t);
    let size = max - min;
    let forward = if size.x >= size.z { Vec3::X } else { Vec3::NEG_Z };
    let top = ceiling.map_or(max.y, |ceiling| ceiling.y);
    let length = size.x.max(size.z);
    let height = floor.y + (EYE.0 * (top - floor.y)).min(EYE.1 * length);
    let centre = Vec3::new(middle.x, height, middle.z);
    let back = inside(centre, -forward).unwrap_or(0.0);
    Some(Room { eye: centre - forward * back * 0.9, forward, ceiling, floor, length })
}

#[cfg(test)]
mod tests {
    use lucerna::scene::builtin;

    use super::*;

    #[test]
    fn rooms_are_told_from_bodies() {
        let room = find(&builtin::load("furnace").unwrap()).expect("a closed box is a room");
        let ceiling = room.ceiling.expect("it is closed above");
        assert!(room.floor.y < room.eye.y && room.eye.y < ceiling.y && room.length > 0.0);
        for body in ["furnace-sphere", "primitives"] {
            assert_eq!(find(&builtin::load(body).unwrap()), None, "{body}");
        }
        assert_eq!(find(&Scene::default()), None);
    }
}

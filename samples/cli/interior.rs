//! Detects interiors: scenes that a camera should see from the inside.

use glam::Vec3;
use lucerna::scene::{
    Pose, Scene,
    bvh::{Bvh, Ray},
};

/// Number of horizontal directions in which rays are traced from each place.
const DIRECTIONS: u32 = 24;
/// Minimum of rays that must hit the front of a wall in an interior.
const WALLS: u32 = 19;
/// Minimum of rays from the middle that must hit the front of a wall in a box with one open side.
const BOX: u32 = 15;
/// Places around the middle from which an interior is looked at, in halves of the scene's size: a room has walls around most of them, the gap between
/// two shells of a body only around one.
const PLACES: [[f32; 2]; 5] = [[0.0, 0.0], [0.3, 0.3], [-0.3, 0.3], [0.3, -0.3], [-0.3, -0.3]];
/// Minimum of places that must have walls around them, and room to move.
const AROUND: usize = 3;
/// Minimum of length, width and height of a room, metres. Smaller things are models, which are looked at from outside.
const ROOM: f32 = 1.5;
/// A box with one open side is looked at through it, and not from inside, up to this length, metres. In longer rooms the open side is a window.
const LONGEST_BOX: f32 = 3.0;
/// A quarter of the ways from a place must be at least this long, in halves of the shorter horizontal size.
const FREE: f32 = 0.25;
/// Height of the eye above the floor: the smaller of these shares of the interior's height and of its length.
const EYE: (f32, f32) = (0.45, 0.15);
/// Share of the way from the middle to the wall at which the eye stands.
const BACK: f32 = 0.9;
/// Angles of the rays by which a view is judged, radians: half of the whole width, and up and down.
const FAN: (f32, f32) = (0.6, 0.2);

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

/// The surroundings of a scene's middle, found by tracing rays from it and from places around it.
#[derive(Debug)]
pub struct Survey<'a> {
    bvh: &'a Bvh,
    min: Vec3,
    max: Vec3,
    middle: Vec3,
    floor: Vec3,
    /// For each of [`PLACES`], what is in all directions.
    ways: Vec<Vec<Way>>,
}

/// What a ray hits.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Way {
    /// The front of a surface, at this distance, metres.
    Wall(f32),
    /// The back of a surface: the ray begins inside a solid object, or behind a wall.
    Back,
    /// Nothing.
    Open,
}

impl Way {
    /// Distance to a wall, metres.
    fn wall(self) -> Option<f32> {
        if let Self::Wall(distance) = self { Some(distance) } else { None }
    }
}

/// Whether a scene is a room that a camera should see from the inside.
pub fn is_room(scene: &Scene) -> bool {
    let bvh = Bvh::build(scene, &Pose::playing(scene, 0.0));
    Survey::of(&bvh).is_some_and(|survey| survey.interior().is_some())
}

impl<'a> Survey<'a> {
    /// Traces the rays. `None` if no floor is under the middle.
    pub fn of(bvh: &'a Bvh) -> Option<Self> {
        let (min, max) = bvh.bounds()?;
        let middle = (min + max) * 0.5;
        let half = 0.5 * (max - min);
        let mut survey = Self { bvh, min, max, middle, floor: middle, ways: Vec::new() };
        survey.floor -= Vec3::Y * survey.inside(middle, Vec3::NEG_Y)?;
        let around = |[x, z]: [f32; 2]| {
            let place = middle + Vec3::new(x * half.x, 0.0, z * half.z);
            directions().map(|direction| survey.way(place, direction)).collect()
        };
        survey.ways = PLACES.into_iter().map(around).collect();
        Some(survey)
    }

    fn way(&self, from: Vec3, direction: Vec3) -> Way {
        let Some(hit) = self.bvh.closest(&Ray::new(from, direction)) else { return Way::Open };
        let [a, b, c] = self.bvh.triangles()[hit.triangle as usize];
        if (b - a).cross(c - a).dot(direction) < 0.0 { Way::Wall(hit.t) } else { Way::Back }
    }

    /// Distance to the nearest surface, metres, if the ray hits its front.
    fn inside(&self, from: Vec3, direction: Vec3) -> Option<f32> {
        self.way(from, direction).wall()
    }

    /// An interior: large enough for people, walls around most places with their front towards them, room to move, a floor below.
    pub fn interior(&self) -> Option<Interior> {
        let Self { min, max, middle, floor, .. } = *self;
        let size = max - min;
        let small_box = size.x.max(size.z) < LONGEST_BOX && self.one_open_side().is_some();
        if size.min_element() < ROOM || small_box {
            return None;
        }
        let free = FREE * 0.5 * size.x.min(size.z);
        let is_around = |ways: &&Vec<Way>| {
            let walls: Vec<f32> = ways.iter().filter_map(|way| way.wall()).collect();
            let long = walls.iter().filter(|&&way| way >= free).count() as u32;
            walls.len() as u32 >= WALLS && long >= DIRECTIONS / 4
        };
        if self.ways.iter().filter(is_around).count() < AROUND {
            return None;
        }
        let ceiling = self.inside(middle, Vec3::Y).map(|t| middle + Vec3::Y * t);
        let top = ceiling.map_or(max.y, |ceiling| ceiling.y);
        let length = size.x.max(size.z);
        let height = floor.y + (EYE.0 * (top - floor.y)).min(EYE.1 * length);
        let (eye, forward) = self.view(height)?;
        Some(Interior { eye, forward, ceiling, floor, length })
    }

    /// The place of the eye at this height and its direction: at a wall or in a corner, with the longest ways before it.
    fn view(&self, height: f32) -> Option<(Vec3, Vec3)> {
        let size = self.max - self.min;
        let along = if size.x >= size.z { Vec3::X } else { Vec3::NEG_Z };
        let corner = Vec3::new(size.x, 0.0, size.z).normalize_or(Vec3::X);
        let corners = [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]].map(|[x, z]| corner * Vec3::new(x, 1.0, z));
        let forwards: Vec<Vec3> =
            [along, -along, Vec3::Y.cross(along), -Vec3::Y.cross(along)].into_iter().chain(corners).collect();
        // The middle may be in a piece of furniture at the height of the eye.
        let views = PLACES.into_iter().flat_map(|[x, z]| {
            let centre = Vec3::new(self.middle.x + 0.5 * x * size.x, height, self.middle.z + 0.5 * z * size.z);
            forwards.iter().filter_map(move |&forward| {
                let eye = centre - forward * BACK * self.inside(centre, -forward)?;
                Some((self.depth(eye, forward), eye, forward))
            })
        });
        // The first of equal ones.
        views
            .reduce(|best, view| if view.0 > 1.02 * best.0 { view } else { best })
            .map(|(_, eye, forward)| (eye, forward))
    }

    /// Mean length of the ways before an eye, metres.
    fn depth(&self, eye: Vec3, forward: Vec3) -> f32 {
        let right = forward.cross(Vec3::Y);
        let mut sum = 0.0;
        for across in -4..=4 {
            for up in -1..=1 {
                let (x, y) = (FAN.0 * across as f32 / 4.0, FAN.1 * up as f32);
                let direction = (forward + x.tan() * right + y.tan() * Vec3::Y).normalize();
                sum += self.inside(eye, direction).unwrap_or(0.0);
            }
        }
        sum / 27.0
    }

    /// The mean of the horizontal directions in which no wall was hit, if they are all on one side.
    fn one_open_side(&self) -> Option<Vec3> {
        let open = self.ways.iter().flat_map(|ways| directions().zip(ways).filter(|(_, way)| **way == Way::Open));
        let (sum, count) = open.fold((Vec3::ZERO, 0), |(sum, count), (direction, _)| (sum + direction, count + 1));
        (count > 0 && sum.length() > 0.8 * count as f32).then(|| sum.normalize_or_zero())
    }

    /// For a box with one open side (the Cornell box), the horizontal direction out of it.
    pub fn opening(&self) -> Option<Vec3> {
        let walls = self.ways.first()?.iter().filter_map(|way| way.wall()).count() as u32;
        self.one_open_side().filter(|_| walls >= BOX)
    }
}

fn directions() -> impl Iterator<Item = Vec3> {
    (0..DIRECTIONS).map(|i| {
        let angle = std::f32::consts::TAU * (i as f32 + 0.5) / DIRECTIONS as f32;
        Vec3::new(angle.cos(), 0.0, angle.sin())
    })
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use lucerna::scene::{Pose, Scene, Transform};
    use lucerna_scenes as builtin;

    use super::*;

    fn found(scene: &Scene) -> (Option<Interior>, Option<Vec3>) {
        let bvh = Bvh::build(scene, &Pose::playing(scene, 0.0));
        let survey = Survey::of(&bvh);
        survey.map_or((None, None), |survey| (survey.interior(), survey.opening()))
    }

    #[test]
    fn rooms_are_told_from_bodies() {
        let mut scene = builtin::load("furnace").unwrap();
        let room = found(&scene).0.expect("a closed box is a room");
        let ceiling = room.ceiling.expect("it is closed above");
        assert!(room.floor.y < room.eye.y && room.eye.y < ceiling.y && room.length > 0.0);
        // The same box, 14 cm wide, is a model.
        for node in &mut scene.nodes {
            node.local = Transform::Matrix(glam::Mat4::from_scale(Vec3::splat(0.07)) * node.local.matrix());
        }
        assert_eq!(found(&scene).0, None);
        for body in ["furnace-sphere", "primitives"] {
            assert_eq!(found(&builtin::load(body).unwrap()), (None, None), "{body}");
        }
        // The Cornell box is open towards its camera.
        let (room, out) = found(&builtin::load("cornell").unwrap());
        let out = out.expect("it is open");
        assert!(room.is_none() && out.dot(Vec3::NEG_Z) > 0.95, "{out}");
        assert_eq!(found(&Scene::default()), (None, None));
    }
}

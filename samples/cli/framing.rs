//! Adds a camera to scenes without one, so that every file gives a picture. A note tells the user what was added.

use glam::{Mat4, Vec2, Vec3};
use lucerna::scene::{Aabb, Camera, Node, Note, NoteKind, Pose, Projection, Scene, Transform, bvh::Bvh};

use crate::{
    interior::{Interior, Survey},
    scene_bounds::Subject,
};

/// Full vertical angle of view of an added camera, radians.
const YFOV: f32 = 45.0 * std::f32::consts::PI / 180.0;
/// The same in an interior.
const YFOV_INTERIOR: f32 = 60.0 * std::f32::consts::PI / 180.0;
/// Height and width of the picture, over those of the part that shows the subject.
const MARGIN: f32 = 1.08;
/// Direction from the middle of the scene to an added camera: to the right, above, in front.
const VIEW_FROM: Vec3 = Vec3::new(0.55, 0.4, 1.0);
/// The same for flat ground, which shows too little of itself from there.
const VIEW_GROUND: Vec3 = Vec3::new(0.5, 0.9, 0.9);
/// Share of [`VIEW_FROM`] in the direction from which a panel is seen; the rest is its normal.
const ASIDE: f32 = 0.35;
/// Steps in which aim and distance of a camera are found.
const TURNS: usize = 16;
/// A subject is flat if its smallest size is below this share of the next one.
const FLAT: f32 = 0.12;
/// A subject has a front if the vector sum of its areas has this share of their sum; in closed bodies it is zero.
const FRONT: f32 = 0.25;

/// Adds a camera that sees the whole scene, if the scene has no camera.
pub fn add_missing_camera(scene: &mut Scene, aspect: f32) {
    if scene.nodes.iter().any(|node| node.camera.is_some()) {
        return;
    }
    let bvh = Bvh::build(scene, &Pose::playing(scene, 0.0));
    let survey = Survey::of(&bvh);
    let room = survey.as_ref().and_then(Survey::interior);
    let (name, text, (world_from_view, projection)) = match room {
        Some(interior) => ("inside", "a camera was added inside the room", in_interior(&interior)),
        None => {
            let subject = Subject::of(scene);
            let opening = survey.and_then(|survey| survey.opening());
            let from = opening.unwrap_or_else(|| towards_front(&bvh, subject.as_ref()));
            let text = match &subject {
                Some(subject) if subject.bounds != subject.whole => {
                    "a camera was added that sees the whole scene but its wide ground"
                }
                _ => "a camera was added that sees the whole scene",
            };
            ("fitted", text, fitted(scene, subject.as_ref(), aspect, from))
        }
    };
    scene.cameras.push(Camera { name: name.into(), projection });
    add_node(scene, "added camera", world_from_view, |node, scene| node.camera = Some(scene.cameras.len() as u32 - 1));
    note(scene, "cameras", &format!("the scene has no camera: {text}"));
}

/// The direction to a camera that sees the front of the subject.
fn towards_front(bvh: &Bvh, subject: Option<&Subject>) -> Vec3 {
    let Some(subject) = subject else { return VIEW_FROM };
    let (mut sum, mut total) = (Vec3::ZERO, 0.0);
    for [a, b, c] in bvh.triangles() {
        let area = (*b - *a).cross(*c - *a);
        // Ground below the subject tells nothing about its front.
        let centre = (*a + *b + *c) / 3.0;
        let inside = (centre - subject.bounds.centre()).abs().cmple(subject.bounds.half() * 1.001 + 1e-6).all();
        if inside && area.is_finite() {
            sum += area;
            total += area.length();
        }
    }
    let front = if total > 0.0 { sum / total } else { Vec3::ZERO };
    let size = subject.bounds.max - subject.bounds.min;
    let thin = Vec3::AXES.into_iter().min_by(|a, b| size.dot(*a).total_cmp(&size.dot(*b))).unwrap_or(Vec3::Z);
    let next = Vec3::AXES.into_iter().filter(|axis| *axis != thin).map(|axis| size.dot(axis)).fold(f32::MAX, f32::min);
    let flat = size.dot(thin) < FLAT * next;
    // Things that show the same from both sides are seen from the usual one.
    let side = if front.dot(thin) < -FRONT { -1.0 } else { 1.0 };
    match flat {
        true if thin == Vec3::Y => VIEW_GROUND * Vec3::new(1.0, side, 1.0),
        true => side * thin + ASIDE * VIEW_FROM,
        false if front.length() > FRONT => {
            let sign = |front: f32, from: f32| if front < -FRONT * 0.5 { -from } else { from };
            Vec3::new(sign(front.x, VIEW_FROM.x), sign(front.y, VIEW_FROM.y), sign(front.z, VIEW_FROM.z))
        }
        false => VIEW_FROM,
    }
}

/// A camera at one end of an interior, looking along it.
fn in_interior(room: &Interior) -> (Mat4, Projection) {
    let back = -room.forward;
    let right = Vec3::Y.cross(back);
    let world = Mat4::from_cols(right.extend(0.0), Vec3::Y.extend(0.0), back.extend(0.0), room.eye.extend(1.0));
    let znear = (room.length * 2e-3).max(1e-4);
    (world, Projection::Perspective { yfov: YFOV_INTERIOR, aspect: None, znear, zfar: Some(room.length * 2.0) })
}

/// Adds a node with the transform `world`. `fill` gives it a camera or a light.
pub fn add_node(scene: &mut Scene, name: &str, world: Mat4, fill: impl FnOnce(&mut Node, &Scene)) {
    let (scale, rotation, translation) = world.to_scale_rotation_translation();
    let local = Transform::Trs { translation, rotation, scale };
    let mut node = Node { name: name.into(), local, ..Node::default() };
    fill(&mut node, scene);
    scene.nodes.push(node);
}

/// Adds a note about something that was added.
pub fn note(scene: &mut Scene, place: &str, text: &str) {
    scene.notes.push(Note { kind: NoteKind::Approximated, place: place.into(), text: text.into() });
}

/// A camera in the direction `from` of the subject. Its picture shows all of the subject, with a small margin, as large as possible.
fn fitted(scene: &Scene, subject: Option<&Subject>, aspect: f32, from: Vec3) -> (Mat4, Projection) {
    let unit = Aabb { min: Vec3::splat(-1.0), max: Vec3::ONE };
    let (bounds, whole) = subject.map_or((unit, unit), |subject| (subject.bounds, subject.whole));
    let outline = subject.map_or_else(|| unit.corners().to_vec(), |subject| subject.outline(scene));
    let radius = bounds.half().length().max(1e-4);
    let high = (YFOV * 0.5).tan() / MARGIN;
    let slopes = Vec2::new(high * aspect, high);
    let from = from.normalize();
    let front = outline.iter().map(|p| (*p - bounds.centre()).dot(from)).fold(0.0, f32::max) + 0.05 * radius;
    let mut distance = front + radius / high.min(high * aspect);
    let mut back = from;
    // The camera stays on the line from the middle of the subject; its aim and its distance follow what the picture shows.
    for _ in 0..TURNS {
        let (low, top) = extent(&outline, bounds.centre() + distance * from, back);
        let [right, up, _] = axes(back);
        back = (back - 0.5 * (low.x + top.x) * right - 0.5 * (low.y + top.y) * up).normalize();
        let (low, top) = extent(&outline, bounds.centre() + distance * from, back);
        let filled = (low.abs().max(top.abs()) / slopes).max_element();
        distance = front.max(distance * filled.clamp(0.5, 2.0));
    }
    let position = bounds.centre() + distance * from;
    let [right, up, back] = axes(back);
    let world = Mat4::from_cols(right.extend(0.0), up.extend(0.0), back.extend(0.0), position.extend(1.0));
    let depths = |points: &[Vec3]| points.iter().map(|p| (position - *p).dot(back)).collect::<Vec<f32>>();
    let near = depths(&outline).into_iter().fold(f32::MAX, f32::min) * 0.2;
    let far = depths(&[whole.corners(), bounds.corners()].concat()).into_iter().fold(distance, f32::max) * 1.5;
    (world, Projection::Perspective { yfov: YFOV, aspect: None, znear: near.max(radius * 1e-3), zfar: Some(far) })
}

/// Vectors to the right, upwards and backwards of a camera that looks along `-back`.
fn axes(back: Vec3) -> [Vec3; 3] {
    let right = Vec3::Y.cross(back).normalize_or(Vec3::X);
    [right, back.cross(right), back]
}

/// The lowest and the highest slopes at which points are seen, to the right and up.
fn extent(points: &[Vec3], eye: Vec3, back: Vec3) -> (Vec2, Vec2) {
    let [right, up, back] = axes(back);
    let slopes = points.iter().map(|p| {
        let way = *p - eye;
        Vec2::new(way.dot(right), way.dot(up)) / (-way.dot(back)).max(1e-6)
    });
    slopes.fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(low, top), slope| (low.min(slope), top.max(slope)))
}

#[cfg(test)]
mod tests {
    use glam::Vec4;
    use lucerna::scene::{Mesh, Primitive};

    use super::*;

    /// A scene of these positions, with a triangle of three of them for each entry of `indices`.
    fn of(positions: Vec<Vec3>, indices: Vec<u32>) -> Scene {
        let (normals, tangents) = (vec![Vec3::Y; positions.len()], vec![Vec4::ZERO; positions.len()]);
        let primitive = Primitive { positions, normals, tangents, indices, ..Primitive::default() };
        Scene {
            meshes: vec![Mesh { primitives: vec![primitive], ..Mesh::default() }],
            nodes: vec![Node { mesh: Some(0), ..Node::default() }],
            materials: vec![lucerna::scene::Material::default()],
            ..Scene::default()
        }
    }

    #[test]
    fn the_added_camera_sees_every_corner_and_no_more_than_the_margin() {
        for (min, max) in [(Vec3::splat(-1.0), Vec3::ONE), (Vec3::new(100.0, 0.0, -3.0), Vec3::new(400.0, 2.0, 0.0))] {
            for aspect in [0.3, 1.0, 2.5] {
                let mut scene = of(Aabb { min, max }.corners().to_vec(), Vec::new());
                add_missing_camera(&mut scene, aspect);
                let view_from_world = scene.nodes.last().unwrap().local.matrix().inverse();
                let Projection::Perspective { yfov, znear, zfar, .. } = scene.cameras[0].projection else { panic!() };
                let mut widest = 0f32;
                for corner in scene.meshes[0].primitives[0].positions.clone() {
                    let seen = view_from_world.transform_point3(corner);
                    let half = (yfov * 0.5).tan() * -seen.z;
                    let place = (seen.x / (half * aspect)).abs().max((seen.y / half).abs());
                    assert!(place <= 1.01 / MARGIN, "{seen}");
                    assert!((znear..=zfar.unwrap()).contains(&-seen.z), "{seen}");
                    widest = widest.max(place);
                }
                assert!(widest > 0.98 / MARGIN, "{widest}");
            }
        }
    }

    #[test]
    fn panels_are_seen_from_their_front() {
        let square = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        for turn in 0..4 {
            let rotation = glam::Quat::from_rotation_y(turn as f32 * std::f32::consts::FRAC_PI_2);
            let positions = square.map(|[x, y]| rotation * Vec3::new(x, y, 0.0)).to_vec();
            let mut scene = of(positions, vec![0, 1, 2, 0, 2, 3]);
            add_missing_camera(&mut scene, 1.5);
            let back = scene.nodes[1].local.matrix().z_axis.truncate();
            assert!(back.dot(rotation * Vec3::Z) > 0.8, "{turn} {back}");
        }
        // A triangle of no size, and nothing at all.
        for mut scene in [of(vec![Vec3::ONE; 3], vec![0, 1, 2]), Scene::default()] {
            add_missing_camera(&mut scene, 1.5);
            assert!(scene.nodes.last().unwrap().local.matrix().is_finite());
        }
    }

    #[test]
    fn a_scene_with_a_camera_keeps_it() {
        let mut scene = of(vec![Vec3::ZERO, Vec3::ONE], Vec::new());
        let projection = Projection::Perspective { yfov: 1.0, aspect: None, znear: 0.1, zfar: None };
        scene.cameras.push(Camera { name: "own".into(), projection });
        scene.nodes[0].camera = Some(0);
        add_missing_camera(&mut scene, 1.0);
        assert!(scene.nodes.len() == 1 && scene.cameras.len() == 1 && scene.notes.is_empty());
    }
}

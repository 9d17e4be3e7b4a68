//! The camera of the window: it flies, looks around, and turns around a point.

use glam::{Mat4, Vec2, Vec3};
use lucerna::scene::{Projection, View};

use crate::{camera::CameraFile, placed::Placed};

/// Steepest angle up and down, radians: straight up and down there is no right and left.
const STEEPEST: f32 = 1.55;

/// A camera that a person moves.
#[derive(Clone, Debug, PartialEq)]
pub struct Fly {
    position: Vec3,
    /// Direction of view: angle about +Y from −Z to the left, and angle above the horizon, radians.
    yaw: f32,
    pitch: f32,
    /// Distance of the point around which the camera turns, metres.
    pub distance: f32,
    yfov_degrees: f32,
    znear: f32,
    /// Metres in a second.
    pub speed: f32,
}

impl Fly {
    /// From where a view looks. `distance`: of what it looks at, metres.
    pub fn from_view(view: &View, projection: Projection, distance: f32) -> Self {
        let world_from_view = view.view_from_world.inverse();
        let forward = world_from_view.transform_vector3(Vec3::NEG_Z).normalize_or(Vec3::NEG_Z);
        let (yfov, znear) = match projection {
            Projection::Perspective { yfov, znear, .. } => (yfov, znear),
            // An orthographic camera becomes a perspective one that sees about as much.
            Projection::Orthographic { ymag, znear, .. } => (2.0 * (ymag / distance.max(1e-3)).atan(), znear.max(1e-3)),
        };
        let mut fly = Self {
            position: view.position,
            yaw: 0.0,
            pitch: 0.0,
            distance: distance.max(1e-3),
            yfov_degrees: yfov.to_degrees().clamp(0.1, 179.0),
            znear,
            speed: distance.clamp(0.05, 1000.0) * 0.5,
        };
        fly.look(forward);
        fly
    }

    /// The camera of a file. Its up vector is lost: this one always stands upright.
    pub fn from_file(file: &CameraFile) -> Self {
        let way = file.target - file.position;
        let distance = way.length().max(1e-3);
        let mut fly = Self {
            position: file.position,
            yaw: 0.0,
            pitch: 0.0,
            distance,
            yfov_degrees: file.yfov_degrees,
            znear: file.znear,
            speed: distance.clamp(0.05, 1000.0) * 0.5,
        };
        fly.look(way.normalize_or(Vec3::NEG_Z));
        fly
    }

    fn look(&mut self, forward: Vec3) {
        self.pitch = forward.y.clamp(-1.0, 1.0).asin().clamp(-STEEPEST, STEEPEST);
        self.yaw = (-forward.x).atan2(-forward.z);
    }

    fn forward(&self) -> Vec3 {
        let flat = self.pitch.cos();
        Vec3::new(-self.yaw.sin() * flat, self.pitch.sin(), -self.yaw.cos() * flat)
    }

    fn right(&self) -> Vec3 {
        Vec3::new(self.yaw.cos(), 0.0, -self.yaw.sin())
    }

    /// The point around which the camera turns.
    pub fn target(&self) -> Vec3 {
        self.position + self.forward() * self.distance
    }

    /// Looks around. `drag`: shares of the height of the picture, to the right and down.
    pub fn turn(&mut self, drag: Vec2) {
        let angle = self.yfov_degrees.to_radians();
        self.yaw += drag.x * angle;
        self.pitch = (self.pitch + drag.y * angle).clamp(-STEEPEST, STEEPEST);
    }

    /// Turns around the target. `drag`: as in [`Fly::turn`]; the height of the picture is half a turn.
    pub fn orbit(&mut self, drag: Vec2) {
        let target = self.target();
        self.yaw -= drag.x * std::f32::consts::PI;
        self.pitch = (self.pitch - drag.y * std::f32::consts::PI).clamp(-STEEPEST, STEEPEST);
        self.position = target - self.forward() * self.distance;
    }

    /// Moves the camera and its target parallel to the picture. `drag`: as in [`Fly::turn`].
    pub fn pan(&mut self, drag: Vec2) {
        let height = 2.0 * self.distance * (0.5 * self.yfov_degrees.to_radians()).tan();
        let up = self.right().cross(self.forward());
        self.position += (up * drag.y - self.right() * drag.x) * height;
    }

    /// Comes nearer to the target, or goes away from it. `steps` of the wheel; positive: nearer.
    pub fn dolly(&mut self, steps: f32) {
        let target = self.target();
        self.distance = (self.distance * 0.9f32.powf(steps)).clamp(1e-3, 1e6);
        self.position = target - self.forward() * self.distance;
    }

    /// Flies. `way`: to the right, up, and forward, each −1 to 1.
    pub fn fly(&mut self, way: Vec3, seconds: f32) {
        let up = Vec3::Y;
        self.position += (self.right() * way.x + up * way.y + self.forward() * way.z) * self.speed * seconds;
    }

    /// Turns to a point, which becomes the target.
    pub fn focus(&mut self, point: Vec3) {
        let way = point - self.position;
        if way.length() > 1e-4 {
            self.distance = way.length();
            self.look(way.normalize());
        }
    }

    /// The camera as a file has it.
    pub fn file(&self) -> CameraFile {
        CameraFile {
            position: self.position,
            target: self.target(),
            up: Vec3::Y,
            yfov_degrees: self.yfov_degrees,
            znear: self.znear,
            zfar: None,
        }
    }

    /// The camera as `--camera` has it. The numbers read back as the same ones.
    pub fn numbers(&self) -> String {
        let CameraFile { position: p, target: t, yfov_degrees, znear, .. } = self.file();
        format!("{},{},{},{},{},{},{yfov_degrees},{znear}", p.x, p.y, p.z, t.x, t.y, t.z)
    }

    /// The camera in its place, as [`Placed::from_file`] puts it.
    pub fn placed(&self) -> Placed {
        Placed::from_file("view".into(), &self.file())
    }
}

/// Where a point lies in a picture, shares of its width and height from the upper left corner; `None` behind the camera.
pub fn project(view: &View, point: Vec3) -> Option<Vec2> {
    let clip = view.clip_from_world * point.extend(1.0);
    (clip.w > 0.0).then(|| Vec2::new(0.5 + 0.5 * clip.x / clip.w, 0.5 - 0.5 * clip.y / clip.w))
}

/// The point at a depth along the line of sight of a place in a picture. `at`: as in [`project`]; `depth`: metres along the axis of the camera.
pub fn unproject(view: &View, at: Vec2, depth: f32) -> Vec3 {
    let world_from_view: Mat4 = view.view_from_world.inverse();
    let (x, y) = (2.0 * at.x - 1.0, 1.0 - 2.0 * at.y);
    // Lines of sight of an orthographic camera are parallel.
    let spread = if view.clip_from_view.w_axis.w == 1.0 { 1.0 } else { depth };
    let (sx, sy) = (view.clip_from_view.x_axis.x, view.clip_from_view.y_axis.y);
    world_from_view.transform_point3(Vec3::new(x / sx * spread, y / sy * spread, -depth))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        args::Size,
        camera::{Choice, choose},
    };
    use lucerna::scene::{Pose, Scene};

    const SIZE: Size = Size { width: 320, height: 240 };

    fn fly() -> Fly {
        let file = CameraFile {
            position: Vec3::new(1.0, 2.0, 3.0),
            target: Vec3::new(4.0, 1.0, -2.0),
            up: Vec3::Y,
            yfov_degrees: 50.0,
            znear: 0.1,
            zfar: None,
        };
        let placed = Placed::from_file("a".into(), &file);
        let view = placed.view(&Pose::rest(&Scene::default()), SIZE);
        Fly::from_view(&view, placed.camera.projection, 5.9)
    }

    fn view(fly: &Fly) -> View {
        fly.placed().view(&Pose::rest(&Scene::default()), SIZE)
    }

    #[test]
    fn a_view_becomes_the_same_view() {
        let view = view(&fly());
        assert!(view.position.abs_diff_eq(Vec3::new(1.0, 2.0, 3.0), 1e-5));
        let middle = project(&view, Vec3::new(4.0, 1.0, -2.0)).unwrap();
        assert!(middle.abs_diff_eq(Vec2::splat(0.5), 1e-4), "{middle}");
    }

    #[test]
    fn the_camera_as_numbers_is_the_same_camera() {
        let mut fly = fly();
        fly.turn(Vec2::new(0.123, 0.321));
        fly.fly(Vec3::new(0.3, -0.1, 0.7), 0.37);
        let Choice::File(read) = choose(&fly.numbers(), &[]).unwrap() else { panic!("no camera") };
        assert_eq!(read, fly.file());
    }

    #[test]
    fn turning_around_a_point_keeps_it_in_the_middle() {
        let mut fly = fly();
        let target = fly.target();
        for drag in [Vec2::new(0.3, 0.1), Vec2::new(-0.7, 0.4), Vec2::new(0.0, -3.0)] {
            fly.orbit(drag);
            assert!(fly.target().abs_diff_eq(target, 1e-3));
            let at = project(&view(&fly), target).unwrap();
            assert!(at.abs_diff_eq(Vec2::splat(0.5), 1e-3), "{at}");
        }
        fly.dolly(3.0);
        assert!(fly.target().abs_diff_eq(target, 1e-3) && fly.distance < 5.9);
    }

    #[test]
    fn dragging_moves_what_is_under_the_mouse_with_it() {
        let fly = fly();
        let point = unproject(&view(&fly), Vec2::new(0.4, 0.6), 5.9);
        let mut panned = fly.clone();
        // A tenth of the height to the right and down.
        panned.pan(Vec2::new(0.1, 0.1));
        let at = project(&view(&panned), point).unwrap();
        assert!(at.abs_diff_eq(Vec2::new(0.4 + 0.1 * 0.75, 0.7), 1e-2), "{at}");
        // Looking around moves the picture with the mouse near the middle.
        let middle = unproject(&view(&fly), Vec2::splat(0.5), 5.9);
        let mut turned = fly.clone();
        turned.turn(Vec2::new(0.05, 0.05));
        let at = project(&view(&turned), middle).unwrap();
        assert!(at.x > 0.52 && at.y > 0.53, "{at}");
    }

    #[test]
    fn places_in_the_picture_and_points_belong_together() {
        let view = view(&fly());
        for at in [Vec2::new(0.1, 0.9), Vec2::new(0.7, 0.2), Vec2::splat(0.5)] {
            let found = project(&view, unproject(&view, at, 4.0)).unwrap();
            assert!(found.abs_diff_eq(at, 1e-4), "{found}");
        }
        assert!(project(&view, Vec3::new(-4.0, 3.0, 9.0)).is_none());
    }

    #[test]
    fn double_clicks_turn_to_the_point() {
        let mut fly = fly();
        let point = Vec3::new(-2.0, 0.5, 1.0);
        fly.focus(point);
        assert!(fly.target().abs_diff_eq(point, 1e-4));
        // A point at the camera has no direction.
        let before = fly.clone();
        fly.focus(fly.file().position);
        assert_eq!(fly, before);
    }
}

//! A few rays through a camera's picture, traced on the CPU: what the camera sees, and how much of it lamps reach.

use glam::{Vec2, Vec3};
use lucerna::scene::{
    AlphaMode, Material, Scene, View,
    bvh::{Bvh, Hit, Ray, Step},
};

use crate::lights::Point;

/// Rays along the width and the height of the picture.
const RAYS: [u32; 2] = [32, 24];
/// Points on emissive surfaces.
const SAMPLES: u32 = 64;
/// A point is lit if its irradiance is this share of the radiance of the brightest emissive surface.
const LIT: f32 = 2e-3;
/// Emissive surfaces light a picture if they light this share of the other points in it.
const ENOUGH: f32 = 1.0 / 3.0;
/// Share of emissive points in a picture that needs no other light.
const GLOWING: f32 = 0.8;
/// Places of a lamp beside the camera: to the right and above, in distances of the middle point of the picture.
const BESIDE: [[f32; 2]; 5] = [[0.35, 0.35], [-0.35, 0.35], [0.0, 0.3], [0.12, 0.12], [0.0, 0.0]];
/// A place of the lamp is as good as a better one if it lights this share of the points.
const AS_GOOD: f32 = 0.8;
/// Distance of shadow rays from both ends, in their lengths.
const OFF: f32 = 1e-3;

/// A point of a surface in the picture.
#[derive(Clone, Copy, Debug)]
struct Seen {
    /// Metres, world space.
    at: Vec3,
    /// Unit normal of the triangle, on the camera's side.
    normal: Vec3,
    /// From the camera, metres.
    distance: f32,
    /// Index into the scene's materials.
    material: usize,
}

/// The points of a picture.
#[derive(Debug)]
pub struct Sight<'a> {
    scene: &'a Scene,
    bvh: &'a Bvh,
    view: &'a View,
    points: Vec<Seen>,
}

/// Whether a surface gives light to other surfaces. A surface with an emissive texture counts as a display, which is too weak for that.
pub fn is_lamp(material: &Material) -> bool {
    material.emissive.max_element() > 0.0 && material.emissive_texture.is_none()
}

impl<'a> Sight<'a> {
    /// Traces rays through the picture of a view. `bvh`: of the scene in the pose that the picture shows.
    pub fn of(scene: &'a Scene, bvh: &'a Bvh, view: &'a View) -> Self {
        let mut sight = Self { scene, bvh, view, points: Vec::new() };
        let [width, height] = RAYS;
        for ray in 0..width * height {
            let uv =
                Vec2::new((ray % width) as f32 + 0.5, (ray / width) as f32 + 0.5) / Vec2::from(RAYS.map(|n| n as f32));
            sight.points.extend(sight.first(uv));
        }
        sight
    }

    /// The first surface at a place of the picture that is drawn there.
    fn first(&self, uv: Vec2) -> Option<Seen> {
        let [near, far] = [self.view.near / self.view.far, 1.0].map(|depth| self.view.world_from_depth(uv, depth));
        let ray = Ray { t_max: 1.0, ..Ray::new(near, far - near) };
        let mut best: Option<Hit> = None;
        self.bvh.walk(&ray, |hit| {
            let material = &self.scene.materials[self.material(hit.triangle)];
            let behind = area(self.bvh.triangles()[hit.triangle as usize]).dot(ray.direction) > 0.0;
            if material.alpha == AlphaMode::Blend || (behind && !material.double_sided) {
                return Step::Ignore;
            }
            best = Some(hit);
            Step::Nearer
        });
        let hit = best?;
        let normal = area(self.bvh.triangles()[hit.triangle as usize]).normalize_or_zero();
        let at = near + hit.t * ray.direction;
        Some(Seen {
            at,
            normal: if normal.dot(ray.direction) > 0.0 { -normal } else { normal },
            distance: at.distance(self.view.position),
            material: self.material(hit.triangle),
        })
    }

    fn material(&self, triangle: u32) -> usize {
        let id = self.bvh.id(triangle);
        let mesh = self.scene.nodes[id.node as usize].mesh.unwrap_or_default() as usize;
        self.scene.meshes[mesh].primitives[id.primitive as usize].material as usize
    }

    /// Share of the picture that shows surfaces.
    pub fn coverage(&self) -> f32 {
        self.points.len() as f32 / (RAYS[0] * RAYS[1]) as f32
    }

    /// Whether the emissive surfaces of the scene give enough light to what the picture shows, so that it needs no other light.
    pub fn is_lit_by_surfaces(&self) -> bool {
        let lamp = |point: &Seen| is_lamp(&self.scene.materials[point.material]);
        let others: Vec<&Seen> = self.points.iter().filter(|point| !lamp(point)).collect();
        if self.points.is_empty() || (others.len() as f32) < (1.0 - GLOWING) * self.points.len() as f32 {
            return !self.points.is_empty();
        }
        let (lamps, brightest) = self.lamps();
        let lit = others.iter().filter(|point| self.irradiance(point, &lamps) > LIT * brightest).count();
        lit as f32 >= ENOUGH * others.len() as f32
    }

    /// Points on the emissive surfaces, and the highest radiance of them.
    fn lamps(&self) -> (Vec<Lamp>, f32) {
        let mut sum = 0.0;
        let mut brightest = 0f32;
        let mut list = Vec::new();
        for (index, corners) in self.bvh.triangles().iter().enumerate() {
            let material = &self.scene.materials[self.material(index as u32)];
            if !is_lamp(material) {
                continue;
            }
            let radiance = material.emissive.max_element();
            let area = area(*corners);
            sum += f64::from(radiance * area.length());
            brightest = brightest.max(radiance);
            list.push((sum, corners, area.normalize_or_zero(), material.double_sided));
        }
        let lamps = (0..SAMPLES).filter_map(|i| {
            // One point in each of equal parts of the power, at places of the R2 sequence in its triangle.
            let share = sum * (f64::from(i) + 0.5) / f64::from(SAMPLES);
            let (_, [a, b, c], normal, both) = list.get(list.partition_point(|(until, ..)| *until < share))?;
            let [mut u, mut v] = [0.754_877_7, 0.569_840_3].map(|step: f32| (0.5 + step * i as f32).fract());
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            let at = *a + u * (*b - *a) + v * (*c - *a);
            Some(Lamp { at, normal: *normal, both: *both, power: (sum / f64::from(SAMPLES)) as f32 })
        });
        (lamps.collect(), brightest)
    }

    /// Irradiance by the points of the emissive surfaces, W/m².
    fn irradiance(&self, point: &Seen, lamps: &[Lamp]) -> f32 {
        let from = |lamp: &Lamp| {
            let way = lamp.at - point.at;
            let direction = way.normalize_or_zero();
            let leaving = if lamp.both { lamp.normal.dot(direction).abs() } else { -lamp.normal.dot(direction) };
            let cosines = leaving.max(0.0) * point.normal.dot(direction).max(0.0);
            if cosines > 0.0 && self.is_free(point.at, way) { lamp.power * cosines / way.length_squared() } else { 0.0 }
        };
        lamps.iter().map(from).sum()
    }

    fn is_free(&self, from: Vec3, way: Vec3) -> bool {
        !self.bvh.any(&Ray { t_min: OFF, t_max: 1.0 - OFF, ..Ray::new(from, way) })
    }

    /// A lamp beside the camera that lights what the picture shows, with the irradiance `irradiance` in the middle distance, W/m². `None` if the picture
    /// shows no surface.
    pub fn lamp(&self, irradiance: f32) -> Option<Point> {
        let mut distances: Vec<f32> = self.points.iter().map(|point| point.distance).collect();
        distances.sort_by(f32::total_cmp);
        let middle = *distances.get(distances.len() / 2)?;
        let [right, up, _] = self.view.axes();
        let places = BESIDE.map(|[x, y]| self.view.position + middle * (x * right + y * up));
        let lit = |place: &Vec3| {
            let free = |point: &&Seen| {
                let way = *place - point.at;
                point.normal.dot(way) > 0.0 && self.is_free(point.at, way)
            };
            self.points.iter().filter(free).count()
        };
        let counts = places.map(|place| lit(&place));
        let most = counts.iter().copied().max().unwrap_or(0);
        let best = counts.iter().position(|&count| count as f32 >= AS_GOOD * most as f32)?;
        // Numbers that a person can type again.
        let decimals = (2.0 - middle.log10().floor()).clamp(0.0, 12.0) as usize;
        let rounded = |x: f32, decimals: usize| format!("{x:.decimals$}").parse().unwrap_or(x);
        let intensity = irradiance * middle * middle;
        let short = format!("{intensity:.2e}").parse().unwrap_or(intensity);
        Some(Point::still(places[best].map(|x| rounded(x, decimals)), short))
    }
}

/// A point on an emissive surface.
#[derive(Debug)]
struct Lamp {
    at: Vec3,
    normal: Vec3,
    /// Both sides emit.
    both: bool,
    /// Radiance times area, W/sr.
    power: f32,
}

/// The normal of a triangle, with its area as length.
fn area([a, b, c]: [Vec3; 3]) -> Vec3 {
    0.5 * (b - a).cross(c - a)
}

#[cfg(test)]
mod tests {
    use glam::{Mat4, Quat, Vec4};
    use lucerna::scene::{Camera, Mesh, Node, Pose, Primitive, Projection, Transform};

    use super::*;

    /// A square of side 2 at `place` whose front looks along +Z after the turn, for each material.
    fn squares(list: &[(Vec3, Quat, Material)]) -> Scene {
        let positions =
            [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| Vec3::new(x, y, 0.0)).to_vec();
        let mut scene = Scene::default();
        for (index, (translation, rotation, material)) in list.iter().enumerate() {
            let primitive = Primitive {
                positions: positions.clone(),
                normals: vec![Vec3::Z; 4],
                tangents: vec![Vec4::ZERO; 4],
                indices: vec![0, 1, 2, 0, 2, 3],
                material: index as u32,
                ..Primitive::default()
            };
            scene.meshes.push(Mesh { primitives: vec![primitive], ..Mesh::default() });
            scene.materials.push(material.clone());
            let local = Transform::Trs { translation: *translation, rotation: *rotation, scale: Vec3::ONE };
            scene.nodes.push(Node { mesh: Some(index as u32), local, ..Node::default() });
        }
        scene
    }

    fn with_sight<R>(scene: &Scene, eye: Vec3, look: impl FnOnce(&Sight<'_>) -> R) -> R {
        let projection = Projection::Perspective { yfov: 1.0, aspect: None, znear: 0.01, zfar: Some(100.0) };
        let view = View::new(&Camera { name: String::new(), projection }, Mat4::from_translation(eye), [64, 48]);
        let bvh = Bvh::build(scene, &Pose::playing(scene, 0.0));
        look(&Sight::of(scene, &bvh, &view))
    }

    #[test]
    fn a_picture_knows_its_surfaces_and_their_distances() {
        let scene = squares(&[(Vec3::ZERO, Quat::IDENTITY, Material::diffuse("wall", Vec3::ONE))]);
        // The picture is 2 tan(0.5) · 4 m high and 4/3 as wide.
        let height = 8.0 * 0.5f32.tan();
        let coverage = with_sight(&scene, Vec3::Z * 4.0, |sight| {
            assert!(sight.points.iter().all(|point| point.normal.z > 0.99 && point.at.z.abs() < 1e-4));
            sight.coverage()
        });
        assert!((coverage - 4.0 / (height * height * 4.0 / 3.0)).abs() < 0.03, "{coverage}");
        // The back of a surface with one side is not drawn.
        let behind = squares(&[(Vec3::ZERO, Quat::from_rotation_y(3.0), Material::diffuse("wall", Vec3::ONE))]);
        assert_eq!(with_sight(&behind, Vec3::Z * 4.0, |sight| sight.coverage()), 0.0);
    }

    #[test]
    fn a_lamp_lights_the_wall_before_it_and_not_the_one_behind_it() {
        let wall = || Material::diffuse("wall", Vec3::ONE);
        let lamp = || Material::emitter("lamp", Vec3::ONE);
        let to_wall = Quat::from_rotation_y(std::f32::consts::PI);
        // A lamp of side 2 that shines on a wall behind it, or the other way. It hides no part of the wall.
        for (turn, lit) in [(to_wall, true), (Quat::IDENTITY, false)] {
            let scene = squares(&[(Vec3::X * 0.5, Quat::IDENTITY, wall()), (Vec3::new(-2.0, 0.0, 2.0), turn, lamp())]);
            assert_eq!(with_sight(&scene, Vec3::Z * 5.0, |sight| sight.is_lit_by_surfaces()), lit);
        }
        // Irradiance in the middle of a wall that faces a small lamp: radiance · area / distance².
        let scene = squares(&[(Vec3::ZERO, Quat::IDENTITY, wall()), (Vec3::Z * 40.0, to_wall, lamp())]);
        with_sight(&scene, Vec3::Z * 5.0, |sight| {
            let middle = Seen { at: Vec3::ZERO, normal: Vec3::Z, distance: 5.0, material: 0 };
            let found = sight.irradiance(&middle, &sight.lamps().0);
            assert!((found / (4.0 / 1600.0) - 1.0).abs() < 0.01, "{found}");
        });
        // A picture that shows only lamps needs no other light; a picture without surfaces is not lit by any.
        let glow = squares(&[(Vec3::ZERO, Quat::IDENTITY, lamp())]);
        assert!(with_sight(&glow, Vec3::Z * 2.0, |sight| sight.is_lit_by_surfaces()));
        assert!(!with_sight(&glow, Vec3::Z * -2.0, |sight| sight.is_lit_by_surfaces()));
    }

    #[test]
    fn the_lamp_beside_the_camera_is_not_behind_a_wall() {
        let wall = || Material { double_sided: true, ..Material::diffuse("wall", Vec3::ONE) };
        let scene = squares(&[(Vec3::ZERO, Quat::IDENTITY, wall())]);
        let free = with_sight(&scene, Vec3::Z * 2.0, |sight| sight.lamp(3.0)).unwrap();
        // The points of the wall are 2 to 2.5 m away; the lamp stands 0.35 of the middle distance to the right and above.
        let numbers: Vec<f32> = free.to_string().split(',').map(|number| number.parse().unwrap()).collect();
        let [x, y, z, intensity] = numbers[..] else { panic!("{free}") };
        assert!(x == y && (0.7..0.875).contains(&x) && z == 2.0, "{free}");
        assert!((intensity / (3.0 * (x / 0.35).powi(2)) - 1.0).abs() < 0.02, "{free}");
        // Walls beside the camera, to the right and to the left of it, keep the light of lamps behind them away.
        let side = |x: f32| (Vec3::new(x, 0.0, 1.5), Quat::from_rotation_y(std::f32::consts::FRAC_PI_2), wall());
        let scene = squares(&[(Vec3::ZERO, Quat::IDENTITY, wall()), side(0.5), side(-0.5)]);
        let narrow = with_sight(&scene, Vec3::Z * 2.0, |sight| sight.lamp(3.0)).unwrap();
        let x: f32 = narrow.to_string().split(',').next().unwrap().parse().unwrap();
        assert!(x.abs() < 0.5, "{narrow}");
        assert!(with_sight(&scene, Vec3::Z * -9.0, |sight| sight.lamp(3.0).is_none()));
    }
}

//! The path tracer by the light of points, and their shadows.

use glam::{Mat4, Vec2, Vec3};
use lucerna::{
    Result,
    image::{Layer, Layers},
    scene::{
        AlphaMode, LightKind, Node, Pose, Scene, Transform, View,
        bvh::{Bvh, Ray},
    },
    techniques::prt,
    tracer::Tracer,
};

use super::{Job, OfTruth, Rendered, Times, Warm, lamp_of, lit};

/// Least distance of a shadow ray from its surface, as a share of the distance of the camera.
const OFF: f32 = 1e-4;

/// Layers as those of precomputed transfer. `shadow`: share of the first light that a point sees, as rays to its points find it. `facing`: 1 where the
/// first light is above the surface's horizon; 0 everywhere in scenes with cut-out or
/// transparent surfaces, which these rays do not know. Lamps that are shown without light stop these rays, too.
pub(super) fn picture(warm: &mut Warm<'_>, job: &Job<'_>, settings: &OfTruth) -> Result<Option<Rendered>> {
    let mut tracer = settings.tracer.clone();
    tracer.seed = tracer.seed.wrapping_add(job.seed);
    let offsets = prt::points_of_lights(&settings.lamps().prt);
    let scene = spread(lit(warm.scene, lamp_of(&settings.lamp)?), &offsets);
    let pose = Pose::rest(&scene);
    let mut running = Tracer::new(warm.gpu, &scene, &pose)?;
    running.start(job.view, &tracer)?;
    let progress = running.run(settings.samples.into(), |_| !job.interrupt.requested())?;
    if job.interrupt.requested() {
        return Ok(None);
    }
    let mut layers = running.layers()?;
    let bvh: &mut Bvh = warm.keep("bvh", |_, scene, pose| Ok(Bvh::build(scene, pose)))?;
    let lights: Vec<Vec3> = places(&scene, &pose).into_iter().take(offsets.len()).collect();
    let opaque = scene.materials.iter().all(|material| material.alpha == AlphaMode::Opaque);
    let lights = if opaque { &lights[..] } else { &[] };
    let depths = layers.layer("depth").map(|layer| layer.data.clone()).unwrap_or_default();
    let found = shadows(bvh, job.view, lights, &depths);
    for (name, index) in [("shadow", 0), ("facing", 1)] {
        let pixels: Vec<[f32; 3]> = found.iter().map(|pixel| [pixel[index]; 3]).collect();
        layers = Layers { ..layers }.with(Layer::rgb(name, &pixels));
    }
    let times = Times { wall: vec![progress.time.as_secs_f64() * 1e3], ..Times::default() };
    Ok(Some(Rendered { layers, times }))
}

/// Puts points around each point or spot light in its place, which share its intensity.
fn spread(mut scene: Scene, offsets: &[[f32; 3]]) -> Scene {
    if offsets.len() < 2 {
        return scene;
    }
    scene.lights.iter_mut().for_each(|light| light.intensity /= offsets.len() as f32);
    let pose = Pose::rest(&scene);
    let placed: Vec<(u32, Mat4)> =
        scene.nodes.iter().zip(&pose.world).filter_map(|(node, world)| Some((node.light?, *world))).collect();
    scene.nodes.iter_mut().for_each(|node| node.light = None);
    for (light, world) in placed {
        for offset in offsets {
            let local = Transform::Matrix(Mat4::from_translation(Vec3::from(*offset)) * world);
            scene.nodes.push(Node { light: Some(light), local, ..Node::default() });
        }
    }
    scene
}

/// Places of all point and spot lights.
fn places(scene: &Scene, pose: &Pose) -> Vec<Vec3> {
    let local = |light: u32| scene.lights.get(light as usize).is_some_and(|of| of.kind != LightKind::Directional);
    let nodes = scene.nodes.iter().zip(&pose.world).filter(|(node, _)| node.light.is_some_and(local));
    nodes.map(|(_, world)| world.w_axis.truncate()).collect()
}

/// Share of the light of these points that each pixel's surface sees, and 1 if it faces one of them. `depths`: of the picture, metres; pixels in which the
/// rays meet another surface than the picture shows have 0.
fn shadows(bvh: &Bvh, view: &View, lights: &[Vec3], depths: &[f32]) -> Vec<[f32; 2]> {
    let [_, _, forward] = view.axes();
    let [width, height] = view.extent;
    let pixel = |x: u32, y: u32| {
        let uv = (Vec2::new(x as f32, y as f32) + 0.5) / Vec2::new(width as f32, height as f32);
        let [near, far] = [0.0, 1.0].map(|depth| view.world_from_depth(uv, depth));
        let direction = (far - near).normalize_or_zero();
        let Some(hit) = bvh.closest(&Ray { t_min: view.near, ..Ray::new(near, direction) }) else { return [0.0; 2] };
        let depth = (near + direction * hit.t - view.position).dot(forward);
        let shown = depths.get((y * width + x) as usize).copied().unwrap_or(f32::NAN);
        // Two surfaces in one pixel are within a hundredth of each other if they are the same.
        let same = (shown - depth).abs() < 0.01 * depth;
        if !same {
            return [0.0; 2];
        }
        let [a, b, c] = bvh.triangles()[hit.triangle as usize];
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
        let point = near + direction * hit.t + normal * (OFF * hit.t);
        let (mut open, mut seen) = (0.0, 0.0);
        for light in lights {
            let way = *light - point;
            let square = way.length_squared();
            let irradiance = normal.dot(way).max(0.0) / (square * square.sqrt());
            if !(irradiance > 0.0 && irradiance.is_finite()) {
                continue;
            }
            open += irradiance;
            if !bvh.any(&Ray { t_max: 1.0 - OFF, ..Ray::new(point, way) }) {
                seen += irradiance;
            }
        }
        if open > 0.0 { [seen / open, 1.0] } else { [0.0; 2] }
    };
    (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| pixel(x, y)).collect()
}

#[cfg(test)]
mod tests {
    use lucerna::scene::{Camera, Projection};

    use super::*;

    #[test]
    fn a_plate_shadows_a_wall() {
        // A wall at z = −4, and a plate before its left half.
        let quad = |[x0, x1]: [f32; 2], z: f32| {
            let at = |x: f32, y: f32| Vec3::new(x, y, z);
            [[at(x0, -9.0), at(x1, -9.0), at(x1, 9.0)], [at(x0, -9.0), at(x1, 9.0), at(x0, 9.0)]]
        };
        let bvh = Bvh::from_triangles([quad([-9.0, 9.0], -4.0), quad([-9.0, 0.0], -1.0)].concat());
        let projection = Projection::Perspective { yfov: 1.0, aspect: None, znear: 0.1, zfar: Some(100.0) };
        let camera = Camera { name: String::new(), projection };
        let view = View::new(&camera, Mat4::from_translation(Vec3::new(2.0, 0.0, -2.0)), [8, 4]);
        // From (−0.5, 0, 0) the edge of the plate throws its shadow to x = 1.5 on the wall: on three of eight columns.
        let hidden = Vec3::new(-0.5, 0.0, 0.0);
        let dark = |at: usize| at % 8 < 3;
        for (at, pixel) in shadows(&bvh, &view, &[hidden], &[2.0; 32]).iter().enumerate() {
            assert_eq!(*pixel, [f32::from(!dark(at)), 1.0], "{at}");
        }
        // Another light, which nothing hides, counts with its irradiance.
        let open = Vec3::new(2.0, 0.0, 0.0);
        for (at, pixel) in shadows(&bvh, &view, &[hidden, open], &[2.0; 32]).iter().enumerate() {
            let [x, y] = [(at % 8) as f32 - 3.5, 1.5 - (at / 8) as f32].map(|steps| steps * 0.5f32.tan());
            let point = Vec3::new(2.0 + x, y, -4.0);
            let [a, b] = [hidden, open].map(|light| 4.0 / (light - point).length().powi(3));
            let share = if dark(at) { b / (a + b) } else { 1.0 };
            assert!((pixel[0] - share).abs() < 1e-3, "{at}: {pixel:?} {share}");
        }
        // A picture that shows another surface has no shadow to compare.
        assert!(shadows(&bvh, &view, &[open], &[1.5; 32]).iter().all(|pixel| *pixel == [0.0; 2]));
        // Behind the wall and without a light nothing faces the light.
        for lights in [&[Vec3::new(0.0, 0.0, -5.0)][..], &[]] {
            assert!(shadows(&bvh, &view, lights, &[2.0; 32]).iter().all(|pixel| *pixel == [0.0; 2]));
        }
    }

    #[test]
    fn points_share_the_light() {
        let scene = lit(&Scene::default(), lamp_of("1,2,3,8").unwrap());
        let all = spread(scene, &[[0.5, 0.0, 0.0], [-0.5, 0.0, 0.0]]);
        assert_eq!(places(&all, &Pose::rest(&all)), [Vec3::new(1.5, 2.0, 3.0), Vec3::new(0.5, 2.0, 3.0)]);
        assert_eq!(all.lights[0].intensity, 4.0);
    }
}

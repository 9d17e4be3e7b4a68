//! Odd rooms: rooms and lamps without a connection, few and many clusters, surfaces without area, and rooms of all sizes.

use crate::{
    prt_lab::{baked, baked_with_rooms, closed, diffuse, picture, small},
    prt_light::room,
    tracer_lab::{Stage, view},
};
use glam::{Mat4, Vec3, vec3};
use lucerna::{
    Stop,
    gpu::{Gpu, testing::with_gpu},
    image::Layers,
    scene::{Camera, Material, Projection, Scene, Transform, View},
    techniques::prt::{Bakery, Baking, Mode, PictureSettings, Settings, Stored, solve, starts},
};

/// Mean of a layer over pixels and colours.
fn mean(layers: &Layers, name: &str) -> f32 {
    let data = &layers.layer(name).unwrap().data;
    assert!(data.iter().all(|value| value.is_finite()), "{name} has values that are no numbers");
    data.iter().sum::<f32>() / data.len() as f32
}

/// The scene with its lamp at another place.
fn moved(scene: &Scene, at: Vec3) -> Scene {
    let mut scene = scene.clone();
    let node = scene.nodes.iter_mut().find(|node| node.light.is_some()).unwrap();
    node.local = Transform::Matrix(Mat4::from_translation(at));
    scene
}

#[test]
fn a_second_room_without_a_way_to_the_light_has_samples_and_the_inside_of_furniture_has_none() {
    with_gpu(|gpu| {
        let mut stage = Stage::new();
        let wall = stage.material(Material::diffuse("wall", Vec3::splat(0.5)));
        stage.cuboid(wall, vec3(-1.0, -1.0, -1.0), Vec3::ONE, true);
        stage.cuboid(wall, vec3(4.0, -1.0, -1.0), vec3(6.0, 1.0, 1.0), true);
        stage.cuboid(wall, vec3(-0.5, -0.7, -0.5), vec3(0.0, -0.2, 0.0), false);
        // A hollow cabinet behind the wall.
        stage.cuboid(wall, vec3(1.2, -0.2, -0.2), vec3(1.5, 0.1, 0.1), true);
        stage.point(vec3(0.2, 0.3, -0.1), Vec3::ONE);
        let mut places = starts(&stage.scene).points;
        let mut bakery = Bakery::new(gpu, &stage.scene).unwrap();
        let area = |bakery: &mut Bakery, places: &[Vec3]| {
            let baking = Baking { samples: 1000, ..small() };
            let found = bakery.sample(&baking, places, &Stop::default()).unwrap();
            let of = |far: bool| {
                let here = found.samples.iter().filter(|sample| (sample.position[0] > 3.0) == far);
                here.map(|sample| f64::from(sample.area)).sum::<f64>()
            };
            [of(false), of(true)]
        };
        assert_eq!(area(&mut bakery, &places)[1], 0.0);
        assert_eq!(bakery.rooms(&small(), &mut places, &Stop::default()).unwrap(), 1);
        assert!((places[1] - vec3(5.0, 0.0, 0.0)).abs().max_element() < 1.0, "{places:?}");
        // 24 m² each, and six sides of 0.25 m² of furniture in the first one.
        let [first, second] = area(&mut bakery, &places);
        assert!((first - 25.5).abs() < 0.5 && (second - 24.0).abs() < 0.2, "{first} {second}");
        assert_eq!(bakery.rooms(&small(), &mut places, &Stop::default()).unwrap(), 0);
    });
}

/// Rooms of 3×2×3 m side by side, with a wall of 40 cm between them, and their lamp in the first one.
fn neighbours() -> Scene {
    let mut stage = Stage::new();
    let wall = stage.material(Material::diffuse("wall", Vec3::splat(0.7)));
    stage.cuboid(wall, Vec3::ZERO, vec3(3.0, 2.0, 3.0), true);
    stage.cuboid(wall, vec3(3.4, 0.0, 0.0), vec3(6.4, 2.0, 3.0), true);
    stage.point(vec3(1.3, 1.2, 1.4), Vec3::splat(4.0));
    stage.scene
}

#[test]
fn light_of_one_room_does_not_reach_its_neighbour() {
    with_gpu(|gpu| {
        let scene = neighbours();
        let stored = baked_with_rooms(gpu, &scene, &Baking { samples: 4000, ..small() });
        let far = stored.samples.iter().filter(|sample| sample.position[0] > 3.2).count();
        assert!((far as f64 / stored.samples.len() as f64 - 0.5).abs() < 0.05, "{far}");
        let eyes = [0.0, 3.4].map(|x| view(vec3(0.2 + x, 1.8, 0.2), vec3(1.6 + x, 0.7, 1.6), 90.0, [32, 24]));
        for (lamp, here) in [(vec3(1.3, 1.2, 1.4), 0), (vec3(4.9, 1.1, 1.7), 1)] {
            let scene = moved(&scene, lamp);
            let found = eyes.map(|eye| picture(gpu, &scene, &stored, &eye, &diffuse(), Mode::Total));
            let [direct, indirect] =
                ["direct", "indirect"].map(|name| [mean(&found[here], name), mean(&found[1 - here], name)]);
            assert!(direct[0] > 0.0 && direct[1] == 0.0, "{lamp}: {direct:?}");
            assert!(indirect[1].abs() < 1e-3 * indirect[0], "{lamp}: {indirect:?}");
        }
    });
}

/// A room of 4×3×4 m with a closed cabinet of 1.4 m on its floor.
fn furnished() -> Scene {
    let mut stage = Stage::new();
    let wall = stage.material(Material::diffuse("wall", Vec3::splat(0.6)));
    stage.cuboid(wall, vec3(-2.0, 0.0, -2.0), vec3(2.0, 3.0, 2.0), true);
    stage.cuboid(wall, vec3(-1.8, 0.001, -1.8), vec3(-0.4, 1.4, -0.4), false);
    stage.point(vec3(0.8, 1.9, 0.6), Vec3::splat(5.0));
    stage.scene
}

#[test]
fn lamps_behind_walls_and_in_closed_furniture_light_nothing_outside() {
    with_gpu(|gpu| {
        let scene = furnished();
        let stored = baked(gpu, &scene, &Baking { samples: 6000, ..small() });
        let eye = view(vec3(1.8, 2.7, 1.8), vec3(-1.0, 0.5, -1.0), 90.0, [32, 24]);
        let shown = |scene: &Scene, stored: &Stored| {
            let found = picture(gpu, scene, stored, &eye, &diffuse(), Mode::Total);
            ["direct", "indirect"].map(|name| mean(&found, name))
        };
        let lit = shown(&scene, &stored);
        // Outside, below the floor, and in the middle of the cabinet.
        for lamp in [vec3(6.0, 1.5, 0.3), vec3(0.2, -1.0, 0.1), vec3(0.0, 4.0, 0.0), vec3(-1.1, 0.7, -1.1)] {
            let dark = shown(&moved(&scene, lamp), &stored);
            let by_maps = picture(gpu, &moved(&scene, lamp), &stored, &eye, &PictureSettings::default(), Mode::Total);
            let by_maps = ["direct", "indirect"].map(|name| mean(&by_maps, name));
            assert!(by_maps.iter().zip(lit).all(|(found, lit)| found.abs() <= 1e-3 * lit), "{lamp}: {by_maps:?}");
            assert!(dark[0] <= 1e-3 * lit[0] && dark[1].abs() <= 1e-3 * lit[1], "{lamp}: {dark:?} of {lit:?}");
        }
        // The bake's own lamp is in the cabinet: both its inside and the room have samples.
        let hidden = moved(&scene, vec3(-1.1, 0.7, -1.1));
        let stored = baked_with_rooms(gpu, &hidden, &Baking { samples: 4000, ..small() });
        let area: f64 = stored.samples.iter().map(|sample| f64::from(sample.area)).sum();
        // 80 m² of walls, 5 sides of 1.96 m² outside and 6 inside; below the cabinet there is no light.
        assert!((area / (80.0 + 11.0 * 1.96 - 1.96) - 1.0).abs() < 0.03, "{area}");
        let dark = shown(&hidden, &stored);
        // Components that describe distances inside and outside of the cabinet together let a little light through.
        assert!(dark[0] <= 2e-3 * lit[0], "{dark:?} of {lit:?}");
        // Clusters may hold samples of both sides of the cabinet, whose first vector is light on both.
        assert!(dark[1].abs() <= 0.02 * lit[1], "{dark:?} of {lit:?}");
        let again = shown(&scene, &stored);
        for (again, lit) in again.into_iter().zip(lit) {
            assert!((again / lit - 1.0).abs() < 0.05, "{again} {lit}");
        }
    });
}

#[test]
fn one_cluster_and_clusters_of_a_few_samples_keep_the_light() {
    with_gpu(|gpu| {
        for (samples, cluster, clusters) in [(500, 4096, 1..2), (200, 8, 15..40), (16, 8, 1..12)] {
            // More vectors than samples and than directions: there are as many as there can be.
            let baking =
                Baking { samples, cluster, directions: 16, visibility: 256, light: 64, receivers: 256, ..small() };
            let stored = baked(gpu, &closed(Vec3::splat(0.5)), &baking);
            assert!(clusters.contains(&stored.plan.clusters.len()), "{samples}: {:?}", stored.plan.clusters);
            let count = stored.samples.len();
            let even = vec![[1.0; 3]; count];
            let found = solve::indirect(&stored, &vec![[0.5; 3]; count], &even, &Settings::default()).unwrap();
            for e in found {
                assert!((e[0] - 1.0).abs() < 0.02, "{samples} in clusters of {cluster}: {}", e[0]);
            }
        }
    });
}

#[test]
fn triangles_without_area_change_nothing() {
    with_gpu(|gpu| {
        let few = Baking { samples: 1000, rays: 64, examples: 60, ..small() };
        let scene = room();
        let mut stage = Stage { scene: scene.clone() };
        let at = vec3(-0.7, 0.9, 0.3);
        let line = [at, at + Vec3::X * 0.4, at + Vec3::X * 0.9];
        for corners in [[at; 3], [at, at, line[1]], line] {
            stage.mesh(0, corners.to_vec(), vec![Vec3::Y; 3], vec![0, 1, 2]);
        }
        // So thin that its area has no float that is not 0.
        stage.mesh(0, vec![at, at + Vec3::X, at + vec3(0.5, 1e-30, 0.0)], vec![Vec3::Z; 3], vec![0, 1, 2]);
        let odd = stage.scene;
        let eye = view(vec3(1.6, 1.9, 1.2), vec3(-0.6, 0.7, -0.6), 75.0, [24, 18]);
        let [plain, with] = [&scene, &odd].map(|scene| {
            let stored = baked(gpu, scene, &few);
            assert!(stored.samples.iter().all(|s| s.area.is_finite() && Vec3::from(s.normal).is_finite()));
            let found = picture(gpu, scene, &stored, &eye, &diffuse(), Mode::Total);
            (stored.samples.clone(), ["direct", "indirect"].map(|name| mean(&found, name)))
        });
        // They are never hit, so particles and samples are the same.
        let places =
            |samples: &[lucerna::shaders::types::PrtPoint]| samples.iter().map(|s| s.position).collect::<Vec<_>>();
        assert!(places(&plain.0) == places(&with.0));
        for (plain, with) in plain.1.into_iter().zip(with.1) {
            assert!((with / plain - 1.0).abs() < 1e-3, "{with} {plain}");
        }
    });
}

/// A scene `by` times as large, whose surfaces have the same light.
fn scaled(mut scene: Scene, by: f32) -> Scene {
    for primitive in scene.meshes.iter_mut().flat_map(|mesh| &mut mesh.primitives) {
        primitive.positions.iter_mut().for_each(|at| *at *= by);
    }
    for node in scene.nodes.iter_mut().filter(|node| node.light.is_some()) {
        let Transform::Matrix(world) = &mut node.local else { continue };
        *world = Mat4::from_translation(by * world.w_axis.truncate());
    }
    scene.lights.iter_mut().for_each(|light| light.color *= by * by);
    scene
}

fn scaled_picture(gpu: &Gpu, by: f32) -> (Stored, Layers) {
    let scene = scaled(room(), by);
    let stored = baked(gpu, &scene, &Baking { samples: 3000, ..small() });
    let projection = Projection::Perspective { yfov: 1.3, aspect: None, znear: 0.01 * by, zfar: Some(10.0 * by) };
    let mut world = view(vec3(1.6, 1.9, 1.2), vec3(-0.6, 0.7, -0.6), 75.0, [48, 36]).view_from_world.inverse();
    world.w_axis = (by * world.w_axis.truncate()).extend(1.0);
    let eye = View::new(&Camera { name: String::new(), projection }, world, [48, 36]);
    let layers = picture(gpu, &scene, &stored, &eye, &diffuse(), Mode::Total);
    (stored, layers)
}

#[test]
fn rooms_of_4_millimetres_and_of_1000_metres_have_the_light_of_one_of_4_metres() {
    with_gpu(|gpu| {
        let (of_room, layers) = scaled_picture(gpu, 1.0);
        // Powers of two, so that floats have the same digits.
        for by in [1.0 / 1024.0, 256.0] {
            let (stored, found) = scaled_picture(gpu, by);
            assert_eq!(stored.samples.len(), of_room.samples.len());
            // The same digits: no distance of the method has a size of its own.
            for name in ["direct", "indirect", "irradiance", "shadow"] {
                let [found, wanted] = [&found, &layers].map(|of| &of.layer(name).unwrap().data);
                assert!(wanted.iter().all(|value| *value >= 0.0) && wanted.iter().any(|value| *value > 0.0));
                assert!(found == wanted, "{by}: {name}");
            }
        }
    });
}

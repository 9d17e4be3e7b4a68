//! Vectors of the frame: they give the same picture as precomputed vectors, and they stay right for occluders that
//! rotate and deform and for environments that change.

use crate::common;
use crate::fiv_lab::{Studio, ball, colourful, ground, nrmse, thing};
use crate::tracer_lab::{flat_view, view};
use glam::{Mat4, Quat, Vec3, vec3};
use lucerna::{
    gpu::testing::with_gpu,
    measure::steady::{Frame, Steadiness},
    scene::{self, Environment, LoadOptions, Pose, Scene, Transform, View},
    techniques::fiv::{Method, SelfSamples, Settings},
};
use lucerna_scenes as builtin;

fn few(method: Method) -> Settings {
    Settings {
        size: 16,
        azimuths: 16,
        polars: 9,
        radii: 8,
        largest: 1.0,
        self_samples: SelfSamples::Spheres,
        adaptive: false,
        method,
        ..Settings::default()
    }
}

fn finer(method: Method) -> Settings {
    Settings { azimuths: 32, polars: 17, radii: 15, ..few(method) }
}

fn bits(picture: &[Vec3]) -> Vec<[u32; 3]> {
    picture.iter().map(|p| p.to_array().map(f32::to_bits)).collect()
}

/// The ground around the origin from close above, `size` metres of it.
fn around(size: f32, extent: u32) -> View {
    flat_view(vec3(0.0, 0.002, 0.0), Vec3::ZERO, size, [extent; 2])
}

/// A ground under colourful light with these bodies.
fn stage(bodies: &[(Vec<Vec3>, Vec<u32>, Transform)]) -> Scene {
    let mut scene = Scene { environment: Some(colourful()), ..Scene::default() };
    ground(&mut scene, 20.0);
    for (i, (positions, indices, local)) in bodies.iter().enumerate() {
        let node = thing(&mut scene, &format!("body {i}"), positions.clone(), indices.clone(), Mat4::IDENTITY);
        scene.nodes[node as usize].local = *local;
    }
    scene
}

/// Long, flat, and different from all sides.
fn odd_body(turn: Quat, at: Vec3) -> (Vec<Vec3>, Vec<u32>, Transform) {
    let (mut positions, indices) = ball(0.5, 10);
    positions.iter_mut().for_each(|p| *p = *p * vec3(1.6, 0.35, 0.8) + vec3(0.2 * p.y * p.y, 0.3 * p.x * p.x, 0.0));
    (positions, indices, Transform::Trs { translation: at, rotation: turn, scale: Vec3::ONE })
}

#[test]
fn the_picture_is_bit_for_bit_that_of_vectors_computed_beforehand() {
    with_gpu(|gpu| {
        let scene = builtin::load("shadows").unwrap();
        let pose = Pose::rest(&scene);
        let eye = View::of_camera(&scene, &pose, 0, [40, 30]).unwrap();
        let variants = [
            Settings { largest: 0.5, ..few(Method::Vectors) },
            Settings { largest: 0.5, trilinear: false, partial: false, size: 8, ..few(Method::Vectors) },
        ];
        for before in variants {
            let online = Settings { method: Method::Online, ..before.clone() };
            let exact = Studio::new(gpu, &scene, &before, None).irradiance(&eye, &before);
            let mut studio = Studio::new(gpu, &scene, &online, None);
            let found = studio.irradiance(&eye, &online);
            assert_eq!(studio.fiv.occluders().placed.len(), 3);
            assert!(bits(&found) == bits(&exact), "NRMSE {}", nrmse(&exact, &found));
            // The next frame must be equal too.
            assert!(bits(&studio.irradiance(&eye, &online)) == bits(&exact));
        }
        // A single object, whose centre lies behind all its visible surfaces.
        let scene = stage(&[odd_body(Quat::IDENTITY, vec3(0.0, 0.9, 0.0))]);
        let eye = view(vec3(0.4, 2.2, 1.4), vec3(0.0, 0.9, 0.0), 15.0, [16, 16]);
        let [exact, found, none] = [(Method::Vectors, true), (Method::Online, true), (Method::Online, false)]
            .map(|(method, self_shadow)| Settings { self_shadow, partial: false, ..few(method) })
            .map(|settings| Studio::new(gpu, &scene, &settings, None).irradiance(&eye, &settings));
        assert!(bits(&found) == bits(&exact), "NRMSE {}", nrmse(&exact, &found));
        assert!(bits(&found) != bits(&none));
    });
}

#[test]
fn a_turned_occluder_is_as_one_made_turned() {
    with_gpu(|gpu| {
        let turn = Quat::from_rotation_y(0.7) * Quat::from_rotation_x(1.1);
        let at = vec3(0.1, 0.9, -0.2);
        let (before, online) = (finer(Method::Vectors), finer(Method::Online));
        let made = stage(&[odd_body(turn, at)]);
        let exact = Studio::new(gpu, &made, &before, None).irradiance(&around(4.0, 20), &before);
        // The pose at rest differs.
        let scene = stage(&[odd_body(Quat::IDENTITY, at)]);
        let mut studio = Studio::new(gpu, &scene, &online, None);
        let still = studio.irradiance(&around(4.0, 20), &online);
        let turned = studio.shot(&Pose::rest(&made), &around(4.0, 20), &online).0;
        let (same, other) = (nrmse(&exact, &turned), nrmse(&exact, &still));
        eprintln!("turned in the frame {same:.6}, not turned {other:.6}");
        // A ray that touches an edge may pass on the other side of it.
        assert!(same < 1e-3 && other > 0.05, "{same} {other}");
        let mut pose = Pose::rest(&made);
        let squeezed = Mat4::from_scale(vec3(1.0, 2.0, 0.6));
        pose.world[1] *= squeezed;
        let mut made = made;
        made.nodes[1].local = Transform::Matrix(pose.world[1]);
        // The samples lie around another centre than those of a mesh that was built in this pose.
        let brute = finer(Method::BruteForce);
        let exact = Studio::new(gpu, &made, &brute, None).irradiance(&around(4.0, 20), &brute);
        let stored = Studio::new(gpu, &made, &before, None).irradiance(&around(4.0, 20), &before);
        let found = studio.shot(&pose, &around(4.0, 20), &online).0;
        let (stored, found) = (nrmse(&exact, &stored), nrmse(&exact, &found));
        eprintln!("squeezed in the frame {found:.4}, made squeezed {stored:.4}");
        assert!(found < 1.1 * stored, "squeezed: {found} {stored}");
    });
}

/// A scene of the asset collection, lying 1.2 m long over a ground under colourful light.
fn lying(file: &str) -> Option<Scene> {
    let path = common::assets()?.join("gltf").join(file);
    let mut scene = scene::load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    let bounds = extent_of(&scene);
    let scale = 1.2 / (bounds.1.y - bounds.0.y);
    let rotation = Quat::from_rotation_z(std::f32::consts::FRAC_PI_2);
    let translation = vec3(0.0, 0.7, 0.0) - rotation * (0.5 * scale * (bounds.0 + bounds.1));
    // All nodes become children of one more node, which comes first.
    let holder = scene::Node {
        local: Transform::Trs { translation, rotation, scale: Vec3::splat(scale) },
        ..scene::Node::default()
    };
    for node in &mut scene.nodes {
        node.parent = Some(node.parent.map_or(0, |p| p + 1));
    }
    scene.nodes.insert(0, holder);
    scene.skins.iter_mut().flat_map(|s| &mut s.joints).for_each(|joint| *joint += 1);
    scene.animations.iter_mut().flat_map(|a| &mut a.channels).for_each(|channel| channel.node += 1);
    scene.environment = Some(colourful());
    ground(&mut scene, 20.0);
    Some(scene)
}

/// The box around all geometry at rest.
fn extent_of(scene: &Scene) -> (Vec3, Vec3) {
    let pose = Pose::rest(scene);
    let mut out = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for (index, node) in scene.nodes.iter().enumerate() {
        for primitive in node.mesh.map_or(&[][..], |mesh| &scene.meshes[mesh as usize].primitives) {
            for p in scene::deform::world_vertices(scene, &pose, index, primitive).positions {
                out = (out.0.min(p), out.1.max(p));
            }
        }
    }
    out
}

/// The scene with its meshes as they are in a pose, and nothing that could move them.
fn frozen(scene: &Scene, pose: &Pose) -> Scene {
    let mut out = Scene { environment: scene.environment.clone(), ..Scene::default() };
    for (index, node) in scene.nodes.iter().enumerate() {
        for primitive in node.mesh.map_or(&[][..], |mesh| &scene.meshes[mesh as usize].primitives) {
            let positions = scene::deform::world_vertices(scene, pose, index, primitive).positions;
            thing(&mut out, &node.name, positions, primitive.indices.clone(), Mat4::IDENTITY);
        }
    }
    out
}

#[test]
fn what_deforms_casts_the_shadow_of_its_moment() {
    with_gpu(|gpu| {
        for (file, times) in
            [("AnimatedMorphCube/AnimatedMorphCube.gltf", [0.0, 1.6]), ("RiggedSimple/RiggedSimple.gltf", [0.0, 1.0])]
        {
            let Some(scene) = lying(file) else { return };
            let (online, brute) = (finer(Method::Online), finer(Method::BruteForce));
            let mut studio = Studio::new(gpu, &scene, &online, None);
            let mut truth = Studio::new(gpu, &scene, &brute, None);
            let before = finer(Method::Vectors);
            let pictures = times.map(|seconds| {
                let pose = Pose::playing(&scene, seconds);
                let exact = truth.shot(&pose, &around(3.0, 20), &brute).0;
                let found = studio.shot(&pose, &around(3.0, 20), &online).0;
                // The picture equals the picture by precomputed vectors of the deformed mesh.
                let frozen = frozen(&scene, &pose);
                let same = Studio::new(gpu, &frozen, &before, None).irradiance(&around(3.0, 20), &before);
                eprintln!("{file}, {seconds} s: {:.5} from vectors of the mesh as it is", nrmse(&same, &found));
                assert!(nrmse(&same, &found) < 2e-3, "{file}, {seconds} s: {}", nrmse(&same, &found));
                (exact, found)
            });
            let [(first, found), (second, later)] = &pictures;
            let changed = nrmse(first, second);
            let errors = [nrmse(first, found), nrmse(second, later)];
            // The shadow of the other moment would have this error.
            let stale = nrmse(second, found);
            eprintln!("{file}: the truth changes by {changed:.4}, errors {errors:.4?}, of the other moment {stale:.4}");
            assert!(changed > 0.03, "{file}: nothing moves");
            assert!(errors.iter().all(|e| *e < 0.05) && errors[1] < 0.9 * stale, "{file}: {errors:?} {stale}");
        }
    });
}

#[test]
fn the_environment_turns_and_brightens_in_the_frame() {
    with_gpu(|gpu| {
        // The irradiance of a level ground without shadows does not depend on the rotation. That of a leaning one is looked up between the normals of
        // the environment before it turned.
        for (lean, bound) in [(0.0, 2e-4), (0.4, 2e-3)] {
            let lean = Quat::from_rotation_z(lean);
            let mut scene = stage(&[odd_body(Quat::IDENTITY, vec3(0.0, 0.9, 0.0))]);
            scene.nodes[0].local = Transform::Matrix(Mat4::from_quat(lean));
            let eye = flat_view(lean * vec3(0.0, 0.002, 0.0), Vec3::ZERO, 4.0, [16; 2]);
            let online = finer(Method::Online);
            let mut studio = Studio::new(gpu, &scene, &online, None);
            let first = studio.irradiance(&eye, &online);
            let turning = Settings { turning: 30.0, exposure: 1.0, ..online.clone() };
            let found = studio.irradiance(&eye, &turning.after(4.0));
            let turn = 120f32.to_radians();
            let environment = Environment { rotation: turn, scale: 2.0, ..colourful() };
            let made = Scene { environment: Some(environment), ..scene.clone() };
            let before = finer(Method::Vectors);
            let exact = Studio::new(gpu, &made, &before, None).irradiance(&eye, &before);
            println!("NRMSE of the environment that turns: {:.6}", nrmse(&exact, &found));
            assert!(nrmse(&exact, &found) < bound, "{}", nrmse(&exact, &found));
            assert!(nrmse(&exact, &first) > 0.1);
            // What was shown before does not matter.
            let map = studio.fiv.light().difmap.clone();
            let other = studio.irradiance(&eye, &turning.after(1.0));
            assert!(nrmse(&found, &other) > 0.1);
            assert!(std::sync::Arc::ptr_eq(&map, &studio.fiv.light().difmap), "the irradiance was found again");
            assert!(bits(&studio.irradiance(&eye, &turning.after(4.0))) == bits(&found));
            let mut fresh = Studio::new(gpu, &scene, &turning.after(4.0), None);
            assert!(bits(&fresh.irradiance(&eye, &turning.after(4.0))) == bits(&found));
            // The first rotation gives the first picture again to the last bit.
            assert!(bits(&studio.irradiance(&eye, &online)) == bits(&first));
            // Precomputed vectors are valid for one rotation only.
            let mut studio = Studio::new(gpu, &scene, &before, None);
            let refused = studio.refused(&eye, &Settings { rotation: 10.0, ..before.clone() });
            assert!(refused.exit_code() == 2 && refused.to_string().contains("online"), "{refused}");
        }
    });
}

#[test]
fn odd_numbers_of_occluders_and_odd_places() {
    with_gpu(|gpu| {
        let ball = |radius: f32, at: Vec3| {
            let (positions, indices) = ball(radius, 6);
            (positions, indices, Transform::Matrix(Mat4::from_translation(at)))
        };
        let same = |scene: &Scene, eye: &View| {
            let (before, online) = (few(Method::Vectors), few(Method::Online));
            let exact = Studio::new(gpu, scene, &before, None).irradiance(eye, &before);
            let found = Studio::new(gpu, scene, &online, None).irradiance(eye, &online);
            assert!(bits(&found) == bits(&exact), "NRMSE {}", nrmse(&exact, &found));
            found
        };
        // No occluder.
        let open = same(&stage(&[]), &around(3.0, 8));
        let unshadowed = few(Method::Unshadowed);
        let plain = Studio::new(gpu, &stage(&[]), &unshadowed, None).irradiance(&around(3.0, 8), &unshadowed);
        assert!(bits(&open) == bits(&plain));
        // One occluder around the receivers, and one larger than the scene.
        let dark = same(&stage(&[ball(2.0, vec3(0.0, 0.1, 0.0))]), &around(1.0, 8));
        assert!(dark.iter().zip(&open).all(|(d, o)| d.is_finite() && d.element_sum() <= o.element_sum()));
        same(&stage(&[ball(0.5, Vec3::Y), ball(90.0, vec3(0.0, 100.0, 0.0))]), &around(3.0, 8));
        // A hundred occluders, some of them equal.
        let many: Vec<_> = (0..100)
            .map(|i| ball(if i % 3 == 0 { 0.3 } else { 0.2 }, vec3((i % 10) as f32 - 4.5, 0.6, (i / 10) as f32 - 4.5)))
            .collect();
        let shaded = same(&stage(&many), &around(9.0, 12));
        assert!(shaded.iter().zip(&open).all(|(s, o)| s.element_sum() < o.element_sum()));
    });
}

#[test]
fn a_hundred_that_all_stand_differently() {
    with_gpu(|gpu| {
        let turn = |i: u32| Quat::from_rotation_y(0.31 * i as f32) * Quat::from_rotation_z(0.17 * i as f32);
        let at = |i: u32| vec3((i % 10) as f32 - 4.5, 0.9, (i / 10) as f32 - 4.5);
        let bodies = |turn: &dyn Fn(u32) -> Quat| (0..100).map(|i| odd_body(turn(i), at(i))).collect::<Vec<_>>();
        let scene = stage(&bodies(&|_| Quat::IDENTITY));
        let online = Settings { size: 8, ..few(Method::Online) };
        let mut studio = Studio::new(gpu, &scene, &online, None);
        assert_eq!(studio.fiv.occluders().kinds.len(), 1);
        let turned = stage(&bodies(&turn));
        let eye = view(vec3(0.0, 6.0, 8.0), Vec3::ZERO, 50.0, [16, 12]);
        let found = studio.shot(&Pose::rest(&turned), &eye, &online).0;
        let before = Settings { size: 8, ..few(Method::Vectors) };
        let exact = Studio::new(gpu, &turned, &before, None).irradiance(&eye, &before);
        assert!(nrmse(&exact, &found) < 3e-3, "{}", nrmse(&exact, &found));
    });
}

#[test]
fn a_sequence_changes_as_the_truth_does_and_does_not_pop() {
    with_gpu(|gpu| {
        let scene = builtin::load("shadows-moving").unwrap();
        // With eight texels to a side and one ray per texel, thin rotating rings in front of the sun would flicker: by
        // vectors all pixels share a few samples, by brute force each pixel has its own rays.
        let settings =
            |method| Settings { size: 8, split: 2, azimuths: 32, polars: 17, radii: 15, method, ..Settings::default() };
        let film = |settings: &Settings| {
            let mut studio = Studio::new(gpu, &scene, settings, None);
            let frame = |i: u32| {
                let seconds = 1.0 + i as f32 / 12.0;
                let pose = Pose::playing(&scene, seconds);
                let eye = View::of_camera(&scene, &pose, 1, [48, 32]).unwrap();
                studio.film(&pose, &eye, &settings.after(f64::from(seconds)))
            };
            (0..5).map(frame).collect::<Vec<_>>()
        };
        let measured = |turning: f32| {
            let of = |method| Settings { turning, ..settings(method) };
            let [truth, found] = [Method::BruteForce, Method::Online].map(|method| film(&of(method)));
            fn frames(film: &[(Vec<[f32; 3]>, Vec<f32>)]) -> Vec<Frame<'_>> {
                film.iter().map(|(light, depth)| Frame { light, depth }).collect()
            }
            Steadiness::of(48, &frames(&truth), &frames(&found))
        };
        for turning in [0.0, 40.0] {
            let steady = measured(turning);
            let largest = steady.largest();
            eprintln!("environment at {turning} degrees a second: {} parts, {largest:.4?}", steady.parts);
            assert!(steady.parts >= 6 && largest.truth > 0.01, "{steady:?}");
            assert!(largest.found < 1.2 * largest.truth && largest.apart < 1.0 * largest.truth, "{steady:?}");
        }
    });
}

/// Balls around a camera that looks down at a ground: in front of surfaces, behind them, under the ground and far away.
fn scattered() -> Vec<Vec3> {
    let place = |i: u32| {
        let (turn, far) = (2.399 * i as f32, 0.45 * (i as f32).sqrt());
        vec3(far * turn.cos(), if i % 4 == 3 { -1.5 } else { 0.25 + 0.07 * (i % 7) as f32 }, far * turn.sin())
    };
    (0..40).map(place).collect()
}

#[test]
fn lists_of_what_is_near_leave_out_nothing_that_matters() {
    with_gpu(|gpu| {
        let body = |at: Vec3| {
            let (positions, indices) = ball(0.2, 6);
            (positions, indices, Transform::Matrix(Mat4::from_translation(at)))
        };
        let eye = view(vec3(0.3, 2.0, 2.6), vec3(0.0, 0.1, 0.0), 60.0, [21, 19]);
        let settings = Settings { overlap: false, self_shadow: false, ..few(Method::Vectors) };
        let places = scattered();
        let scene = stage(&places.iter().map(|at| body(*at)).collect::<Vec<_>>());
        let all = Studio::new(gpu, &scene, &settings, None).film(&Pose::rest(&scene), &eye, &settings).0;
        let open = Settings { method: Method::Unshadowed, ..settings.clone() };
        let open = Studio::new(gpu, &scene, &open, None).film(&Pose::rest(&scene), &eye, &open).0;
        // Each ball alone, with all other balls out of sight.
        let mut studio = Studio::new(gpu, &scene, &settings, None);
        let rest = Pose::rest(&scene);
        let mut sum = vec![Vec3::ZERO; open.len()];
        for index in 0..places.len() {
            let mut pose = rest.clone();
            for (other, world) in pose.world[1..].iter_mut().enumerate() {
                if other != index {
                    world.w_axis.y = -1e4;
                }
            }
            let (alone, depth) = studio.film(&pose, &eye, &settings);
            for ((sum, (light, open)), z) in sum.iter_mut().zip(alone.iter().zip(&open)).zip(&depth) {
                *sum += if *z < 1e9 { Vec3::from(*open) - Vec3::from(*light) } else { Vec3::ZERO };
            }
        }
        let mut away = rest.clone();
        away.world[1..].iter_mut().for_each(|world| world.w_axis.y = -1e4);
        let ground = studio.film(&away, &eye, &settings);
        let shown = Studio::new(gpu, &scene, &settings, None).film(&rest, &eye, &settings).1;
        let mut compared = 0;
        for i in 0..all.len() {
            // Only pixels where no ball covers the ground.
            if (shown[i] - ground.1[i]).abs() > 1e-3 * shown[i] || shown[i] > 1e9 {
                continue;
            }
            compared += 1;
            let (found, exact) = (Vec3::from(all[i]), (Vec3::from(open[i]) - sum[i]).max(Vec3::ZERO));
            assert!((found - exact).length() < 2e-3 * Vec3::from(open[i]).length(), "{i}: {found} instead of {exact}");
        }
        assert!(compared > 60, "{compared}");
    });
}

#[test]
fn the_light_of_a_point_does_not_depend_on_the_pixels_around_it() {
    with_gpu(|gpu| {
        // The light of one tile of eight by eight pixels, and of tiles a ninth of its size with pixels at the same places.
        let same = |studio: &mut Studio, size: f32, settings: &Settings| {
            let eye = |extent: u32| flat_view(vec3(0.0, 0.002, 0.0), Vec3::ZERO, size, [extent; 2]);
            let [coarse, fine] = [8, 72].map(|extent| studio.irradiance(&eye(extent), settings));
            let at = |i: usize| (9 * (i / 8) + 4) * 72 + 9 * (i % 8) + 4;
            let off = |i: usize| (coarse[i] - fine[at(i)]).length() / fine[at(i)].length().max(1e-6);
            (0..64).map(off).fold(0.0, f32::max)
        };
        let body = |radius: f32, at: Vec3| {
            let (positions, indices) = ball(radius, 6);
            (positions, indices, Transform::Matrix(Mat4::from_translation(at)))
        };
        // A terrace: the ball lies below the middle of the tile, and above the lower half of its surfaces.
        let mut terrace = stage(&[body(0.2, vec3(0.6, -1.6, 0.1))]);
        let half = |x: f32, y: f32| {
            [(0.0, -1.0), (0.0, 1.0), (1.0, 1.0), (1.0, -1.0)].map(|(u, z)| vec3(x + 2.0 * u, y, 2.0 * z))
        };
        terrace.meshes[0].primitives[0].positions = [half(-2.0, 0.0), half(0.0, -2.0)].concat();
        terrace.meshes[0].primitives[0].normals = vec![Vec3::Y; 8];
        terrace.meshes[0].primitives[0].tangents = vec![glam::Vec4::ZERO; 8];
        terrace.meshes[0].primitives[0].indices = vec![0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7];
        let settings = Settings { self_shadow: false, ..few(Method::Vectors) };
        let off = same(&mut Studio::new(gpu, &terrace, &settings, None), 2.6, &settings);
        println!("terrace: {off}");
        assert!(off < 1e-3, "terrace: {off}");
        // Balls all around. Some of them are left out at some pixels of the tile.
        let scene = stage(&scattered().into_iter().map(|at| body(0.2, at)).collect::<Vec<_>>());
        let settings = Settings { overlap: false, negligible: 0.05, ..few(Method::Vectors) };
        let mut studio = Studio::new(gpu, &scene, &settings, None);
        for size in [0.5, 1.5, 5.0] {
            let off = same(&mut studio, size, &settings);
            println!("scattered, {size} m: {off}");
            assert!(off < 1e-3, "scattered, {size} m: {off}");
        }
    });
}

#[test]
fn what_is_negligible_is_left_out_without_a_step() {
    with_gpu(|gpu| {
        let body = |at: Vec3| {
            let (positions, indices) = ball(0.2, 6);
            (positions, indices, Transform::Matrix(Mat4::from_translation(at)))
        };
        let even = Environment::constant(Vec3::ONE);
        let scene = Scene { environment: Some(even), ..stage(&scattered().into_iter().map(body).collect::<Vec<_>>()) };
        let full = Settings { size: 8, ..few(Method::Online) };
        let mut studio = Studio::new(gpu, &scene, &full, None);
        let mut picture = |negligible: f32| {
            let settings = Settings { negligible, ..full.clone() };
            studio.irradiance(&around(4.0, 20), &settings)
        };
        let (all, most, none) = (picture(0.0), picture(0.2), picture(1.0));
        let difference = |a: &[Vec3], b: &[Vec3]| a.iter().zip(b).map(|(a, b)| b.x - a.x).fold(0f32, f32::max);
        // Constant radiance of one has an irradiance of π.
        let (some, much) = (difference(&all, &most), difference(&all, &none));
        eprintln!("left out with 0.2: {some}, with 1: {much} of π");
        assert!(some > 0.0 && some < much && most.iter().zip(&all).all(|(m, a)| m.x >= a.x - 1e-5));
        // An approaching occluder fades in.
        let settings = Settings { negligible: 0.2, ..full.clone() };
        let mut pose = Pose::rest(&scene);
        pose.world[1..].iter_mut().for_each(|world| world.w_axis.y = -1e4);
        let mut last: Option<f32> = None;
        let mut changed = 0f32;
        for step in 0..30 {
            pose.world[1].w_axis = Vec3::new(1.5 - 0.04 * step as f32, 0.2, 0.0).extend(1.0);
            let light = studio.shot(&pose, &around(0.1, 1), &settings).0[0].x;
            if let Some(last) = last {
                assert!((light - last).abs() < 0.05 * std::f32::consts::PI, "{step}: {last} to {light}");
                changed += (light - last).abs();
            }
            last = Some(light);
        }
        assert!(changed > 0.1, "{changed}");
    });
}

#[test]
fn shadows_of_an_occluder_on_itself_are_those_of_brute_force() {
    with_gpu(|gpu| {
        // A rotated body alone, which is shadowed by itself only.
        let turn = Quat::from_rotation_y(0.7) * Quat::from_rotation_x(1.1);
        let with = |turn: Quat| {
            let mut scene = stage(&[odd_body(turn, Vec3::Y)]);
            scene.nodes.remove(0);
            scene
        };
        let (scene, turned) = (with(Quat::IDENTITY), with(turn));
        let settings = |method| Settings { self_samples: SelfSamples::Surface, ..few(method) };
        let eye = view(vec3(0.4, 2.2, 1.4), Vec3::Y, 45.0, [24, 20]);
        let pose = Pose::rest(&turned);
        let [found, exact] = [Method::Online, Method::BruteForce].map(|method| {
            let settings = settings(method);
            Studio::new(gpu, &scene, &settings, None).shot(&pose, &eye, &settings).0
        });
        let seen = exact.iter().filter(|e| **e != Vec3::ZERO).count();
        assert!(seen > 100, "{seen}");
        // A ray that touches an edge may pass on the other side of it.
        assert!(nrmse(&exact, &found) < 3e-3, "{}", nrmse(&exact, &found));
        let spheres = few(Method::Online);
        let found = Studio::new(gpu, &scene, &spheres, None).shot(&pose, &eye, &spheres).0;
        assert!(nrmse(&exact, &found) > 0.02, "spheres: {}", nrmse(&exact, &found));
    });
}

//! Pictures by fullsphere irradiance vectors against brute force, closed forms and what must be the same.

mod fiv_lab;
mod tracer_lab;

use std::f64::consts::PI;

use fiv_lab::{Studio, ball, colourful, ground, nrmse, painted, thing};
use glam::{Mat4, Vec3, vec3};
use lucerna::{
    gpu::testing::with_gpu,
    reference::fiv as twin,
    scene::{Environment, Light, LightKind, Node, Pose, Scene, View, resident::Resident},
    techniques::fiv::{Fiv, Method, Settings, Sky},
};
use tracer_lab::flat_view;

fn coarse() -> Settings {
    Settings { size: 16, azimuths: 32, polars: 17, radii: 15, largest: 1.0, ..Settings::default() }
}

fn by(method: Method) -> Settings {
    Settings { method, ..coarse() }
}

/// A ground with balls of radius 0.5 over it.
fn stage(environment: Environment, balls: &[Vec3]) -> Scene {
    let mut scene = Scene { environment: Some(environment), ..Scene::default() };
    ground(&mut scene, 20.0);
    for (i, at) in balls.iter().enumerate() {
        let (positions, indices) = ball(0.5, 12);
        thing(&mut scene, &format!("ball {i}"), positions, indices, Mat4::from_translation(*at));
    }
    scene
}

/// The ground from under the balls: 3 m around the origin, looked at from close above.
fn under(extent: u32) -> View {
    flat_view(vec3(0.0, 0.2, 0.0), Vec3::ZERO, 3.0, [extent; 2])
}

#[test]
fn without_occluders_light_is_the_table_and_brute_force_agrees() {
    with_gpu(|gpu| {
        let scene = stage(colourful(), &[]);
        let sky = Sky::new(scene.environment.as_ref(), 16).unwrap();
        let exact = twin::irradiance(&sky, glam::DVec3::Y).as_vec3();
        for method in [Method::Vectors, Method::Unshadowed, Method::BruteForce] {
            let mut studio = Studio::new(gpu, &scene, &by(method), None);
            let (irradiance, total) = studio.shot(&Pose::rest(&scene), &under(8), &by(method));
            for (e, l) in irradiance.iter().zip(&total) {
                // The table is interpolated.
                assert!((*e - exact).length() < 5e-3 * exact.length(), "{method:?}: {e} instead of {exact}");
                // Albedo is stored in eight bits.
                let reflected = 0.5 * *e / PI as f32;
                assert!((*l - reflected).length() < 0.01 * reflected.length(), "{l} {reflected}");
            }
        }
    });
}

#[test]
fn vectors_come_close_to_brute_force() {
    with_gpu(|gpu| {
        let scene = stage(colourful(), &[vec3(0.2, 0.9, 0.1)]);
        let mut truth = Studio::new(gpu, &scene, &by(Method::BruteForce), None);
        let reference = truth.irradiance(&under(24), &by(Method::BruteForce));
        let error = |settings: &Settings| {
            let found = Studio::new(gpu, &scene, settings, None).irradiance(&under(24), settings);
            nrmse(&reference, &found)
        };
        let coarse = error(&coarse());
        let fine = error(&Settings { size: 16, ..Settings::default() });
        let nearest = error(&Settings { trilinear: false, ..self::coarse() });
        let unshadowed = error(&by(Method::Unshadowed));
        eprintln!("NRMSE: coarse {coarse:.4}, fine {fine:.4}, nearest {nearest:.4}, unshadowed {unshadowed:.4}");
        assert!(coarse < 0.06 && fine < coarse && coarse < nearest && nearest < 0.5 * unshadowed);
    });
}

#[test]
fn shadows_of_disjoint_occluders_add_and_their_order_is_nothing() {
    with_gpu(|gpu| {
        let places = [vec3(-0.8, 0.9, 0.2), vec3(0.9, 1.1, -0.6), vec3(0.1, 1.5, 0.9)];
        let settings = Settings { overlap: false, ..coarse() };
        let render = |balls: &[Vec3], settings: &Settings| {
            Studio::new(gpu, &stage(colourful(), balls), settings, None).irradiance(&under(12), settings)
        };
        let open = render(&[], &settings);
        let each = places.map(|p| render(&[p], &settings));
        let all = render(&places, &settings);
        for (i, e) in all.iter().enumerate() {
            let left = open[i] - each.iter().map(|single| open[i] - single[i]).sum::<Vec3>();
            assert!((*e - left.max(Vec3::ZERO)).length() < 1e-4 * open[i].length(), "{e} instead of {left}");
        }
        // With the correction, and in another order.
        let settings = coarse();
        let (one, other) = (render(&places, &settings), render(&[places[2], places[0], places[1]], &settings));
        for (i, (a, b)) in one.iter().zip(&other).enumerate() {
            assert!((*a - *b).length() < 1e-5 * open[i].length(), "{a} {b}");
            assert!(a.cmpge(all[i] - 1e-4 * open[i]).all(), "the correction never darkens: {a} {}", all[i]);
        }
        // Many in one place are one.
        let (one, many) = (render(&places[..1], &settings), render(&[places[0]; 5], &settings));
        for (i, (a, b)) in one.iter().zip(&many).enumerate() {
            assert!((*a - *b).length() < 2e-3 * open[i].length(), "{a} {b}");
        }
    });
}

#[test]
fn an_occluder_that_sinks_into_the_ground_fades_without_a_step() {
    with_gpu(|gpu| {
        let scene = stage(colourful(), &[vec3(0.0, 1.0, 0.0)]);
        let settings = coarse();
        let mut studio = Studio::new(gpu, &scene, &settings, None);
        let view = flat_view(vec3(0.9, 0.05, 0.2), vec3(0.9, 0.0, 0.2), 0.2, [2, 2]);
        let mut pose = Pose::rest(&scene);
        let mut last: Option<Vec3> = None;
        let open =
            Studio::new(gpu, &scene, &by(Method::Unshadowed), None).irradiance(&view, &by(Method::Unshadowed))[0];
        for step in 0..=60 {
            let height = 0.8 - 0.025 * step as f32;
            pose.world[1].w_axis.y = height;
            let e = studio.shot(&pose, &view, &settings).0[0];
            if let Some(before) = last {
                assert!((e - before).length() < 0.06 * open.length(), "{height}: {before} to {e}");
            }
            if height <= -0.5 {
                assert!((e - open).length() < 1e-5 * open.length(), "{height}: {e} instead of {open}");
            }
            last = Some(e);
        }
    });
}

#[test]
fn a_convex_body_alone_shadows_itself_less_the_closer_the_samples() {
    with_gpu(|gpu| {
        let mut scene = stage(colourful(), &[Vec3::ZERO]);
        scene.nodes.remove(0);
        let view = flat_view(vec3(0.0, 3.0, 0.0), Vec3::ZERO, 0.7, [16, 16]);
        let picture = |settings: &Settings| Studio::new(gpu, &scene, settings, None).irradiance(&view, settings);
        let open = picture(&by(Method::Unshadowed));
        // From a sample over the surface a little of what is behind it is seen, and taken away: of even light 1 - (R / ρ)².
        let mean = |p: &[Vec3]| p.iter().copied().sum::<Vec3>() / p.len() as f32;
        let ratio = |radii: u32, reach: f32| mean(&picture(&Settings { radii, reach, ..coarse() })) / mean(&open);
        let (far, near) = (ratio(15, 16.0), ratio(60, 4.0));
        eprintln!("self-shadowed over unshadowed, a ball: {far}, with spheres closer together {near}");
        assert!(far.min_element() > 0.6 && near.min_element() > 0.9 && near.max_element() <= 1.0001, "{far} {near}");
        assert!(near.cmpge(far).all());
        let off = picture(&Settings { self_shadow: false, ..coarse() });
        for (a, b) in off.iter().zip(&open) {
            assert!((*a - *b).length() < 1e-5 * b.length(), "{a} {b}");
        }
    });
}

#[test]
fn odd_stages_give_numbers() {
    with_gpu(|gpu| {
        let black = painted(16, |_| Vec3::ZERO);
        let mut one = black.clone();
        one.pixels[37] = vec3(90.0, 0.0, 1.0);
        let mut odd = colourful();
        odd.pixels[5] = vec3(f32::NAN, f32::INFINITY, -1.0);
        // In the middle of an occluder, and under one larger than the scene.
        let around = [Vec3::ZERO, vec3(0.0, 0.7, 0.0)];
        for environment in [black, one, odd] {
            let mut scene = stage(environment, &around);
            scene.nodes[2].local = lucerna::scene::Transform::Matrix(Mat4::from_scale(Vec3::splat(90.0)));
            let settings = Settings { azimuths: 8, polars: 5, radii: 4, ..coarse() };
            let mut studio = Studio::new(gpu, &scene, &settings, None);
            let dark = studio.irradiance(&under(6), &settings);
            assert!(dark.iter().all(|e| e.is_finite()));
        }
        // A hundred occluders.
        let many: Vec<Vec3> = (0..100).map(|i| vec3((i % 10) as f32 - 4.5, 0.8, (i / 10) as f32 - 4.5)).collect();
        let scene = stage(colourful(), &many);
        let settings = Settings { azimuths: 8, polars: 5, radii: 4, ..coarse() };
        let mut studio = Studio::new(gpu, &scene, &settings, None);
        assert_eq!((studio.fiv.occluders().kinds.len(), studio.fiv.occluders().placed.len()), (1, 100));
        let shaded = studio.irradiance(&under(6), &settings);
        let open =
            Studio::new(gpu, &scene, &by(Method::Unshadowed), None).irradiance(&under(6), &by(Method::Unshadowed));
        assert!(shaded.iter().zip(&open).all(|(s, o)| s.element_sum() < 0.8 * o.element_sum()));
    });
}

#[test]
fn what_cannot_be_served_is_refused_and_named() {
    with_gpu(|gpu| {
        let refused = |scene: &Scene, settings: &Settings| {
            let resident = Resident::new(gpu, scene).unwrap();
            Fiv::new(gpu, scene, &resident, settings, None, |_, _| true).unwrap_err()
        };
        let mut scene = stage(colourful(), &[]);
        scene.environment = None;
        let error = refused(&scene, &coarse());
        assert!(error.exit_code() == 2 && error.to_string().contains("--environment"), "{error}");
        let mut scene = stage(colourful(), &[]);
        let kind = LightKind::Point { range: None };
        scene.lights.push(Light { name: "lamp".into(), kind, color: Vec3::ONE, intensity: 1.0 });
        scene.nodes.push(Node { light: Some(0), ..Node::default() });
        let error = refused(&scene, &coarse());
        assert!(error.exit_code() == 2 && error.to_string().contains("`lamp` (point)"), "{error}");
        let error = refused(&stage(colourful(), &[]), &Settings { reach: 0.0, ..coarse() });
        assert!(error.to_string().contains("fiv.reach"), "{error}");
        let scene = stage(colourful(), &[Vec3::Y]);
        let resident = Resident::new(gpu, &scene).unwrap();
        let stopped = Fiv::new(gpu, &scene, &resident, &coarse(), None, |_, _| false).unwrap_err();
        assert!(stopped.to_string().contains("stopped"), "{stopped}");
    });
}

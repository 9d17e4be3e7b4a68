//! Unusual scenes and environments: precomputed vectors and vectors of the frame give physically right results.

use crate::fiv_lab::{Studio, ball, colourful, ground, nrmse, painted, thing};
use crate::tracer_lab::flat_view;
use glam::{Mat4, Vec3, vec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    scene::{Environment, Scene, Transform, View},
    techniques::fiv::{Method, Settings},
};

const TECHNIQUES: [Method; 2] = [Method::Vectors, Method::Online];

/// Evenly spaced samples, as in vectors of the frame.
fn few(method: Method) -> Settings {
    let base = Settings { size: 16, azimuths: 24, polars: 13, radii: 10, largest: 1.0, ..Settings::default() };
    Settings { adaptive: false, method, ..base }
}

/// A ground with balls over it: centres and radii.
fn stage(environment: Environment, balls: &[(Vec3, f32)]) -> Scene {
    let mut scene = Scene { environment: Some(environment), ..Scene::default() };
    ground(&mut scene, 20.0);
    for (i, (at, radius)) in balls.iter().enumerate() {
        let (positions, indices) = ball(*radius, 10);
        thing(&mut scene, &format!("ball {i}"), positions, indices, Mat4::from_translation(*at));
    }
    scene
}

/// The ground around the origin, `size` metres of it, from close above.
fn ground_view(size: f32) -> View {
    flat_view(vec3(0.0, 0.05, 0.0), Vec3::ZERO, size, [16; 2])
}

fn picture(gpu: &Gpu, scene: &Scene, view: &View, method: Method) -> Vec<Vec3> {
    Studio::new(gpu, scene, &few(method), None).irradiance(view, &few(method))
}

fn mean(picture: &[Vec3]) -> f32 {
    picture.iter().map(|p| p.element_sum()).sum::<f32>() / picture.len() as f32
}

#[test]
fn without_occluders_all_light_arrives() {
    with_gpu(|gpu| {
        let scene = stage(colourful(), &[]);
        let open = picture(gpu, &scene, &ground_view(3.0), Method::Unshadowed);
        let truth = picture(gpu, &scene, &ground_view(3.0), Method::BruteForce);
        assert!((mean(&truth) / mean(&open) - 1.0).abs() < 5e-3);
        for method in TECHNIQUES {
            assert!(picture(gpu, &scene, &ground_view(3.0), method) == open, "{method:?}");
        }
    });
}

#[test]
fn a_hundred_occluders_hide_what_they_hide_by_brute_force() {
    with_gpu(|gpu| {
        let at = |i: usize| vec3((i % 10) as f32 - 4.5, 0.8, (i / 10) as f32 - 4.5);
        let many: Vec<(Vec3, f32)> = (0..100).map(|i| (at(i), 0.35)).collect();
        let scene = stage(colourful(), &many);
        let view = ground_view(8.0);
        let [truth, open] = [Method::BruteForce, Method::Unshadowed].map(|m| picture(gpu, &scene, &view, m));
        let [stored, online] = TECHNIQUES.map(|m| picture(gpu, &scene, &view, m));
        assert!(stored == online);
        let (error, unshadowed, kept) = (nrmse(&truth, &stored), nrmse(&truth, &open), mean(&stored) / mean(&truth));
        eprintln!("a hundred: NRMSE {error:.3}, unshadowed {unshadowed:.3}, {kept:.3} of the light");
        assert!(error < 0.5 * unshadowed && (0.7..1.3).contains(&kept));
    });
}

#[test]
fn an_occluder_larger_than_the_scene_leaves_the_horizon() {
    with_gpu(|gpu| {
        let scene = stage(colourful(), &[(vec3(0.0, 45.2, 0.0), 45.0), (vec3(0.3, 0.05, 0.0), 0.05)]);
        let view = ground_view(3.0);
        let [truth, open] = [Method::BruteForce, Method::Unshadowed].map(|m| picture(gpu, &scene, &view, m));
        assert!(mean(&truth) < 0.2 * mean(&open));
        for method in TECHNIQUES {
            let found = picture(gpu, &scene, &view, method);
            let times = mean(&found) / mean(&truth);
            eprintln!(
                "{method:?}: {:.3} of the open light, brute force {:.3}",
                mean(&found) / mean(&open),
                mean(&truth) / mean(&open)
            );
            // Samples are metres apart, and light leaks between them, as the page says.
            assert!((0.5..6.0).contains(&times), "{method:?}: {times} times the light that arrives");
        }
    });
}

#[test]
fn sizes_places_and_triangles_leave_the_shadow_as_it_is() {
    with_gpu(|gpu| {
        // Object, scale of the scene, and offset from the origin.
        let shadow = |(positions, indices): (Vec<Vec3>, Vec<u32>), scale: f32, at: Vec3, method: Method| {
            let mut scene = Scene { environment: Some(colourful()), ..Scene::default() };
            ground(&mut scene, 20.0 * scale);
            scene.nodes[0].local = Transform::Matrix(Mat4::from_translation(at));
            let place =
                Mat4::from_translation(at + vec3(0.13, 0.8, 0.07) * scale) * Mat4::from_scale(Vec3::splat(scale));
            thing(&mut scene, "thing", positions, indices, place);
            let view = flat_view(at + vec3(0.0, 0.05, 0.0) * scale, at, 3.0 * scale, [16; 2]);
            picture(gpu, &scene, &view, method)
        };
        let flipped = |(positions, indices): (Vec<Vec3>, Vec<u32>)| {
            (positions, indices.chunks_exact(3).flat_map(|c| [c[0], c[2], c[1]]).collect())
        };
        let soup = |(positions, indices): (Vec<Vec3>, Vec<u32>)| {
            let corners: Vec<Vec3> = indices.iter().map(|&i| positions[i as usize]).collect();
            (corners, (0..indices.len() as u32).collect())
        };
        // Degenerate triangles: a point, a line, and a vertex used three times.
        let thin = |(positions, mut indices): (Vec<Vec3>, Vec<u32>)| {
            indices.extend([5, 5, 5, 5, 20, 5, 7, 7, 9]);
            (positions, indices)
        };
        let body = || ball(0.5, 10);
        for method in TECHNIQUES {
            let plain = shadow(body(), 1.0, Vec3::ZERO, method);
            let away = vec3(713.37, 0.0, -691.73);
            for (name, other, slack) in [
                ("small", shadow(body(), 0.01, Vec3::ZERO, method), 1e-4),
                ("large", shadow(body(), 100.0, Vec3::ZERO, method), 1e-4),
                ("far away", shadow(body(), 1.0, away, method), 5e-3),
                ("inside out", shadow(flipped(body()), 1.0, Vec3::ZERO, method), 1e-4),
                ("soup", shadow(soup(body()), 1.0, Vec3::ZERO, method), 1e-4),
                ("thin triangles", shadow(thin(body()), 1.0, Vec3::ZERO, method), 1e-4),
            ] {
                let off = nrmse(&plain, &other);
                eprintln!("{name}, {method:?}: {off:.2e}");
                assert!(off < slack, "{name}, {method:?}: {off}");
            }
            // The scene has a shadow.
            let open = plain.iter().map(|p| p.element_sum()).fold(0f32, f32::max);
            assert!(mean(&plain) < 0.9 * open);
        }
    });
}

#[test]
fn inside_of_an_occluder_it_is_dark() {
    with_gpu(|gpu| {
        let scene = stage(colourful(), &[(vec3(0.0, 0.3, 0.0), 2.0)]);
        let [truth, open] =
            [Method::BruteForce, Method::Unshadowed].map(|m| picture(gpu, &scene, &ground_view(1.0), m));
        assert!(mean(&truth) < 1e-3 * mean(&open));
        for method in TECHNIQUES {
            let found = picture(gpu, &scene, &ground_view(1.0), method);
            assert!(mean(&found) < 0.01 * mean(&open), "{method:?}: {} of the open light", mean(&found) / mean(&open));
        }
    });
}

#[test]
fn a_black_environment_gives_a_black_picture() {
    with_gpu(|gpu| {
        let scene = stage(painted(16, |_| Vec3::ZERO), &[(vec3(0.0, 0.8, 0.0), 0.5)]);
        for method in [Method::Vectors, Method::Online, Method::BruteForce, Method::Unshadowed] {
            let found = picture(gpu, &scene, &ground_view(3.0), method);
            assert!(found.iter().all(|p| *p == Vec3::ZERO), "{method:?}");
        }
    });
}

#[test]
fn one_texel_of_light_gives_one_shadow() {
    with_gpu(|gpu| {
        // The whole pixel lies in one texel, towards (0.31, 0.93, -0.19).
        let mut light = painted(256, |_| Vec3::ZERO);
        let (polar, azimuth) = (0.93f32.acos(), 0.31f32.atan2(0.19));
        let (row, column) = (polar / std::f32::consts::PI * 128.0, (azimuth / std::f32::consts::TAU + 0.5) * 256.0);
        light.pixels[row as usize * 256 + column as usize] = vec3(5e4, 3e4, 0.0);
        let scene = stage(light, &[(vec3(0.0, 0.8, 0.0), 0.5)]);
        let view = ground_view(3.0);
        let [truth, open] = [Method::BruteForce, Method::Unshadowed].map(|m| picture(gpu, &scene, &view, m));
        let full = open[0];
        assert!(full.x > 0.0 && full.z == 0.0);
        // A single ray sees all light or none.
        assert!(truth.iter().all(|p| *p == Vec3::ZERO || (*p - full).length() < 5e-3 * full.length()));
        let dark = truth.iter().filter(|p| **p == Vec3::ZERO).count();
        assert!((10..100).contains(&dark), "{dark} pixels in the shadow");
        for method in TECHNIQUES {
            let found = picture(gpu, &scene, &view, method);
            assert!(found.iter().all(|p| p.x <= full.x * 1.0001 && p.z == 0.0), "{method:?}");
            let lost = (mean(&open) - mean(&found)) / (mean(&open) - mean(&truth));
            eprintln!("{method:?}: {lost:.3} of what is hidden by brute force");
            assert!((0.8..1.2).contains(&lost), "{method:?}: {lost} of what is hidden by brute force");
            // A pixel whose light is not hidden, on the side of the light.
            let towards =
                found.iter().zip(&truth).filter(|(_, t)| t.x > 0.0).map(|(f, _)| f.x / full.x).fold(0f32, f32::max);
            assert!(towards > 0.99, "{method:?}: {towards}");
        }
    });
}

#[test]
fn numbers_that_are_no_radiance_count_as_none() {
    with_gpu(|gpu| {
        let (mut odd, mut clean) = (colourful(), colourful());
        for (i, wrong) in
            [(5, vec3(f32::NAN, -1.0, f32::NEG_INFINITY)), (900, Vec3::splat(f32::NAN)), (4000, -Vec3::ONE)]
        {
            odd.pixels[i] = wrong;
            clean.pixels[i] = Vec3::ZERO;
        }
        let balls = [(vec3(0.0, 0.8, 0.0), 0.5)];
        let (odd, clean) = (stage(odd, &balls), stage(clean, &balls));
        for method in [Method::Vectors, Method::Online, Method::BruteForce] {
            let [a, b] = [&odd, &clean].map(|scene| picture(gpu, scene, &ground_view(3.0), method));
            assert!(a == b && mean(&a) > 0.0, "{method:?}");
        }
    });
}

//! Surfaces that are cut out, blended or unlit: in the picture and among the occluders.

use crate::fiv_lab::{Studio, ball, colourful, ground, painted, thing};
use crate::tracer_lab::{flat_view, view};
use glam::{Mat4, Vec3, vec3};
use lucerna::{
    gpu::testing::with_gpu,
    scene::{AlphaMode, Environment, Pose, Scene},
    techniques::fiv::{Extent, Method, SelfSamples, Settings},
};

fn few() -> Settings {
    Settings { size: 16, azimuths: 16, polars: 9, radii: 8, largest: 1.0, adaptive: false, ..Settings::default() }
}

/// A ground with a ball of radius 0.5 over it.
fn stage(environment: Environment) -> Scene {
    let mut scene = Scene { environment: Some(environment), ..Scene::default() };
    ground(&mut scene, 20.0);
    let (positions, indices) = ball(0.5, 10);
    thing(&mut scene, "ball", positions, indices, Mat4::from_translation(vec3(0.0, 0.9, 0.0)));
    scene
}

/// A square of half side `half`, facing up, that lets light through.
fn pane(scene: &mut Scene, half: f32, at: Mat4, alpha: AlphaMode, value: f32) {
    let node = ground(scene, half);
    scene.nodes[node as usize].local = lucerna::scene::Transform::Matrix(at);
    let material = scene.materials.last_mut().unwrap();
    (material.alpha, material.base_color.w, material.double_sided) = (alpha, value, true);
}

#[test]
fn what_is_seen_through_a_pane_is_as_without_it() {
    with_gpu(|gpu| {
        let plain = stage(colourful());
        let eye = view(vec3(0.0, 1.0, 3.5), vec3(0.0, 0.8, 0.0), 35.0, [24, 20]);
        let before = Mat4::from_translation(vec3(0.0, 0.8, 1.5)) * Mat4::from_rotation_x(std::f32::consts::FRAC_PI_2);
        for (alpha, value) in [(AlphaMode::Mask { cutoff: 0.5 }, 0.2), (AlphaMode::Blend, 0.1)] {
            let mut glazed = plain.clone();
            // The pane lies within the bounds of the scene, so that the depth range of the picture stays the same.
            pane(&mut glazed, 0.55, before, alpha, value);
            for method in [Method::Vectors, Method::Online] {
                for self_samples in [SelfSamples::Surface, SelfSamples::Spheres] {
                    // Bounding spheres extend beyond the surfaces that they bound.
                    let settings = Settings { method, self_samples, extent: Extent::Sphere, ..few() };
                    let film = |scene: &Scene| {
                        Studio::new(gpu, scene, &settings, None).film(&Pose::rest(scene), &eye, &settings)
                    };
                    let [(light, depth), (through, shown)] = [&plain, &glazed].map(film);
                    let same: Vec<usize> = (0..light.len()).filter(|&i| depth[i] == shown[i]).collect();
                    let wrong = same.iter().filter(|&&i| light[i] != through[i]).count();
                    assert!(same.len() > light.len() * 3 / 4, "{} of {}", same.len(), light.len());
                    assert_eq!(wrong, 0, "{alpha:?}, {method:?}, {self_samples:?}: of {} pixels", same.len());
                }
            }
        }
    });
}

#[test]
fn a_glowing_shell_takes_nothing_from_the_shadow_of_what_is_in_it() {
    with_gpu(|gpu| {
        let plain = stage(colourful());
        let mut glowing = plain.clone();
        let (positions, indices) = ball(0.6, 10);
        thing(&mut glowing, "lamp", positions, indices, Mat4::from_translation(vec3(0.0, 0.9, 0.0)));
        glowing.materials.last_mut().unwrap().unlit = true;
        let below = flat_view(vec3(0.0, 0.2, 0.0), Vec3::ZERO, 3.0, [16; 2]);
        for method in [Method::Vectors, Method::Online] {
            let settings = Settings { method, ..few() };
            let [exact, found] = [&plain, &glowing].map(|scene| {
                let mut studio = Studio::new(gpu, scene, &settings, None);
                assert_eq!((studio.fiv.occluders().kinds.len(), studio.fiv.occluders().placed.len()), (1, 1));
                studio.irradiance(&below, &settings)
            });
            assert!(found == exact, "{method:?}");
        }
    });
}

#[test]
fn half_of_the_light_passes_a_pane_that_stops_half_of_it() {
    with_gpu(|gpu| {
        // A sun at the zenith fills the four texels around the zenith.
        let sun = painted(256, |d| if d.y > 0.999 { Vec3::splat(100.0) } else { Vec3::ZERO });
        let mut scene = Scene { environment: Some(sun), ..Scene::default() };
        ground(&mut scene, 20.0);
        pane(&mut scene, 0.5, Mat4::from_translation(Vec3::Y), AlphaMode::Blend, 0.5);
        let below = flat_view(vec3(0.0, 0.2, 0.0), Vec3::ZERO, 0.9, [24; 2]);
        let unshadowed = Settings { method: Method::Unshadowed, ..few() };
        let open = Studio::new(gpu, &scene, &unshadowed, None).film(&Pose::rest(&scene), &below, &unshadowed).0;
        for method in [Method::Vectors, Method::Online, Method::BruteForce] {
            let settings = Settings { method, flat: true, largest: 0.5, azimuths: 32, polars: 33, radii: 15, ..few() };
            let mut studio = Studio::new(gpu, &scene, &settings, None);
            let light = studio.film(&Pose::rest(&scene), &below, &settings).0;
            // Points below the two triangles of the pane.
            let mean = |half: bool| {
                let below = (0..light.len()).filter(|i| i % 24 != i / 24 && (i % 24 > i / 24) == half);
                let (sum, all) = below.fold((0.0, 0.0), |(s, a), i| (s + light[i][0], a + open[i][0]));
                sum / all
            };
            let halves = [mean(false), mean(true)];
            eprintln!("{method:?}: {halves:.3?} of the light pass the two triangles of a pane of alpha 0.5");
            assert!(halves.iter().all(|half| (half - 0.5).abs() < 0.15), "{method:?}: {halves:?}");
        }
    });
}

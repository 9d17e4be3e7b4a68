//! Occluders whose pose differs from the pose of their vectors, and occluders that are scaled non-uniformly in the
//! frame.

use crate::common;
use std::f32::consts::TAU;

use crate::fiv_lab::{Studio, ball, colourful, ground, nrmse, thing};
use crate::tracer_lab::{flat_view, view};
use glam::{Mat4, Vec3, vec3};
use lucerna::{
    gpu::testing::with_gpu,
    scene::{self, LoadOptions, Pose, Scene, View},
    techniques::fiv::{Cut, Method, SelfSamples, Settings},
};

fn few(method: Method) -> Settings {
    Settings {
        size: 16,
        azimuths: 32,
        polars: 17,
        radii: 15,
        largest: 1.0,
        adaptive: false,
        method,
        ..Settings::default()
    }
}

/// A ground with a body on it, under colourful light.
fn stage((positions, indices): (Vec<Vec3>, Vec<u32>), at: Mat4) -> Scene {
    let mut scene = Scene { environment: Some(colourful()), ..Scene::default() };
    ground(&mut scene, 20.0);
    thing(&mut scene, "body", positions, indices, at);
    scene
}

/// The ground around the origin from close above, `size` metres of it.
fn around(size: f32, extent: u32) -> View {
    flat_view(vec3(0.0, 0.002, 0.0), Vec3::ZERO, size, [extent; 2])
}

/// Its base around the origin, its tip up.
fn cone(radius: f32, height: f32) -> (Vec<Vec3>, Vec<u32>) {
    let around = 24;
    let rim = |k: u32| {
        let (sin, cos) = (TAU * k as f32 / around as f32).sin_cos();
        vec3(radius * sin, 0.0, radius * cos)
    };
    let mut positions: Vec<Vec3> = (0..around).map(rim).collect();
    positions.extend([Vec3::ZERO, Vec3::Y * height]);
    let sides = (0..around).flat_map(|k| {
        let next = (k + 1) % around;
        [k, next, around + 1, next, k, around]
    });
    (positions, sides.collect())
}

/// Long, flat, and different from all sides.
fn odd_body() -> (Vec<Vec3>, Vec<u32>) {
    let (mut positions, indices) = ball(0.5, 10);
    positions.iter_mut().for_each(|p| *p = *p * vec3(1.6, 0.35, 0.8) + vec3(0.2 * p.y * p.y, 0.9 * p.x * p.x, 0.0));
    (positions, indices)
}

#[test]
fn what_is_squeezed_on_its_ground_reaches_as_far_as_it_does() {
    with_gpu(|gpu| {
        let (scene, squeeze) = (stage(cone(0.6, 1.4), Mat4::IDENTITY), Mat4::from_scale(vec3(1.0, 0.5, 1.0)));
        let made = stage(cone(0.6, 1.4), squeeze);
        let pose = Pose::rest(&made);
        // The ground below the cone is never visible, so only the ground around it counts.
        let eyes = [vec3(1.1, 0.0, 0.0), vec3(-0.2, 0.0, 1.1)]
            .map(|at| flat_view(at + vec3(0.0, 0.002, 0.0), at, 0.8, [12; 2]));
        let brute = few(Method::BruteForce);
        let mut truth = Studio::new(gpu, &made, &brute, None);
        let exact: Vec<Vec3> = eyes.iter().flat_map(|eye| truth.irradiance(eye, &brute)).collect();
        for cut in [Cut::Light, Cut::Height] {
            let [online, before] = [Method::Online, Method::Vectors].map(|method| Settings { cut, ..few(method) });
            let mut studio = Studio::new(gpu, &scene, &online, None);
            let found: Vec<Vec3> = eyes.iter().flat_map(|eye| studio.shot(&pose, eye, &online).0).collect();
            let mut studio = Studio::new(gpu, &made, &before, None);
            let stored: Vec<Vec3> = eyes.iter().flat_map(|eye| studio.irradiance(eye, &before)).collect();
            let (found, stored) = (nrmse(&exact, &found), nrmse(&exact, &stored));
            eprintln!("{cut:?}: squeezed in the frame {found:.4}, vectors of the squeezed one {stored:.4}");
            assert!(found < 0.16 && found < stored, "{cut:?}: {found} {stored}");
        }
    });
}

#[test]
fn what_grows_in_the_frame_is_cut_by_the_ground_as_one_that_was_made_as_large() {
    with_gpu(|gpu| {
        // Sunk into the ground: the cut depends on how far the body reaches along the normal.
        let sunk = |scale: f32| Mat4::from_translation(Vec3::Y * -0.3) * Mat4::from_scale(Vec3::splat(scale));
        let (scene, made) = (stage(odd_body(), sunk(1.0)), stage(odd_body(), sunk(1.8)));
        let eye = flat_view(vec3(0.9, 0.002, 0.4), vec3(0.9, 0.0, 0.4), 1.6, [16; 2]);
        for cut in [Cut::Light, Cut::Height] {
            let settings = Settings { cut, ..few(Method::Online) };
            let exact = Studio::new(gpu, &made, &settings, None).irradiance(&eye, &settings);
            let found = Studio::new(gpu, &scene, &settings, None).shot(&Pose::rest(&made), &eye, &settings).0;
            let apart = nrmse(&exact, &found);
            eprintln!("{cut:?}: grown in the frame {apart:.5} from one that was made as large");
            assert!(apart < 0.01, "{cut:?}: {apart}");
        }
    });
}

#[test]
fn own_shadows_of_what_does_not_stand_as_its_vectors_are_left_out() {
    with_gpu(|gpu| {
        let scene = stage(odd_body(), Mat4::from_translation(Vec3::Y));
        let eye = view(vec3(0.4, 2.2, 1.6), Vec3::Y, 40.0, [20, 16]);
        for self_samples in [SelfSamples::Spheres, SelfSamples::Surface] {
            let settings = Settings { self_samples, ..few(Method::Vectors) };
            let none = Settings { self_shadow: false, ..settings.clone() };
            let mut studio = Studio::new(gpu, &scene, &settings, None);
            let mut differ = |pose: &Pose| {
                let [with, without] = [&settings, &none].map(|settings| studio.shot(pose, &eye, settings).0);
                nrmse(&without, &with)
            };
            let rest = Pose::rest(&scene);
            let mut turned = rest.clone();
            turned.world[1] *= Mat4::from_rotation_x(1.0);
            assert!(differ(&rest) > 0.01, "{self_samples:?}: {}", differ(&rest));
            assert_eq!(differ(&turned), 0.0, "{self_samples:?}");
        }
    });
}

#[test]
fn an_occluder_that_begins_to_turn_does_not_change_its_shadow_by_a_step() {
    with_gpu(|gpu| {
        let scene = stage(cone(0.6, 1.4), Mat4::from_translation(Vec3::Y * -0.2));
        for cut in [Cut::Light, Cut::Height] {
            let settings = Settings { cut, ..few(Method::Vectors) };
            let mut studio = Studio::new(gpu, &scene, &settings, None);
            let rest = Pose::rest(&scene);
            let mut turned = rest.clone();
            turned.world[1] *= Mat4::from_rotation_x(0.002);
            let [still, begun] = [&rest, &turned].map(|pose| studio.shot(pose, &around(3.0, 16), &settings).0);
            assert!(nrmse(&still, &begun) < 1e-3, "{cut:?}: {}", nrmse(&still, &begun));
        }
    });
}

#[test]
fn lights_kept_apart_do_not_shadow_what_deforms_by_what_it_was() {
    with_gpu(|gpu| {
        let Some(assets) = common::assets() else { return };
        let path = assets.join("gltf/RiggedSimple/RiggedSimple.gltf");
        let mut scene = scene::load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        scene.environment = Some(colourful());
        let settings = Settings { suns: 4, azimuths: 8, polars: 5, radii: 4, ..few(Method::Vectors) };
        let none = Settings { self_shadow: false, ..settings.clone() };
        let mut studio = Studio::new(gpu, &scene, &settings, None);
        assert!(!studio.fiv.light().suns.is_empty());
        let bounds = studio.fiv.occluders().kinds[0].radius;
        let eye = view(vec3(0.3, 2.0, 2.5) * bounds, vec3(0.0, 0.5 * bounds, 0.0), 45.0, [32, 32]);
        let mut differ = |pose: &Pose| {
            let [with, without] = [&settings, &none].map(|settings| studio.shot(pose, &eye, settings).0);
            with.iter().zip(&without).filter(|(a, b)| a != b).count()
        };
        assert!(differ(&Pose::rest(&scene)) > 0);
        assert_eq!(differ(&Pose::playing(&scene, 1.0)), 0);
    });
}

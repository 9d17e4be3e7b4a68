//! Masks from depth images along the directions of the texels, against closed forms and rays. And brute force with and
//! without its boxes.

use crate::tracer_lab;
use std::f64::consts::PI;

use crate::fiv_lab::{Studio, apart, ball, cap, colourful, ground, length, nrmse, occluder, one_ball, thing, vectors};
use glam::{DVec3, Mat4, Vec3, vec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    graph::Runner,
    reference::fiv as twin,
    scene::{AlphaMode, Environment, Scene},
    shaders::consts::FIV_INSIDE,
    techniques::fiv::{Light, Masks, Method, Occluder, Plan, Settings, Sky, cover::Cover},
};
use lucerna_scenes as builtin;

/// Vectors and solid angle of the hidden light.
type Found = (twin::Vectors, f64);

fn covered(gpu: &Gpu, occluder: &Occluder, light: &Light, points: &[Vec3], look_up: bool) -> Vec<Found> {
    let mut cover = Cover::new(gpu, occluder).unwrap();
    if look_up {
        cover.look_up(gpu, light.size, 1).unwrap();
    }
    let (fivs, coverage) = cover.run(&mut Runner::new(gpu), light, points, 1).unwrap();
    fivs.chunks_exact(9).zip(coverage).map(|(f, c)| (vectors(f), f64::from(c))).collect()
}

/// `count` directions all around.
fn ways(count: i32) -> impl Iterator<Item = DVec3> {
    (0..count).map(move |i| {
        let y = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
        let (sin, cos) = (2.399_963 * f64::from(i)).sin_cos();
        DVec3::new((1.0 - y * y).sqrt() * cos, y, (1.0 - y * y).sqrt() * sin)
    })
}

#[test]
fn the_looked_up_mask_of_a_sphere_is_its_cap() {
    with_gpu(|gpu| {
        let (sphere, _) = occluder(&one_ball(1.0, 40));
        let sky = Sky::new(Some(&Environment::constant(Vec3::ONE)), 8).unwrap();
        let light = Light::new(gpu, &sky).unwrap();
        for d in [1.05, 1.5, 2.0] {
            let points: Vec<Vec3> = ways(40).map(|way| (-way * d).as_vec3()).collect();
            let sin = 1.0 / d;
            let cap = 2.0 * PI * (1.0 - (1.0 - sin * sin).sqrt());
            let mut mean = 0.0;
            for ((hidden, angle), way) in covered(gpu, &sphere, &light, &points, true).into_iter().zip(ways(40)) {
                let found = DVec3::new(hidden[0].x, hidden[1].x, hidden[2].x);
                let exact = way * (PI * sin * sin);
                // A texel of 1 / 30 sr is hidden whole or not at all.
                assert!((found - exact).length() < 0.25 * exact.length(), "{d} {way}: {found} instead of {exact}");
                mean += angle / cap / 40.0;
            }
            assert!((mean - 1.0).abs() < 0.04, "{d}: {mean} of the cap");
        }
        // Points inside see no light.
        let (inside, _) = covered(gpu, &sphere, &light, &[vec3(0.2, 0.1, 0.0)], true)[0];
        assert!(inside[0].x >= f64::from(FIV_INSIDE));
    });
}

#[test]
fn looked_up_masks_are_those_of_rays_but_for_their_edges() {
    with_gpu(|gpu| {
        let hare = builtin::load("hare").unwrap();
        let (kind, _) = occluder(&hare);
        let light = Light::new(gpu, &Sky::new(Some(&colourful()), 8).unwrap()).unwrap();
        for (rho, slack) in [(0.5, 0.06), (1.0, 0.12), (2.0, 0.1), (4.0, 0.15)] {
            let points: Vec<Vec3> = ways(60).map(|way| (way * rho * f64::from(kind.radius)).as_vec3()).collect();
            let [rays, looked_up] = [false, true].map(|way| covered(gpu, &kind, &light, &points, way));
            let open: Vec<_> = rays
                .iter()
                .zip(&looked_up)
                .filter(|(a, b)| [a, b].iter().all(|of| of.0[0].x < f64::from(FIV_INSIDE)))
                .collect();
            // Both methods find the same points inside.
            assert!(open.len() + 2 >= rays.iter().filter(|a| a.0[0].x < f64::from(FIV_INSIDE)).count(), "{rho}");
            assert!(open.len() > 20, "{rho}: {}", open.len());
            let sum =
                |of: &dyn Fn(&(&Found, &Found)) -> f64| open.iter().map(|pair| of(pair).powi(2)).sum::<f64>().sqrt();
            let error = sum(&|(a, b)| apart(&a.0, &b.0)) / sum(&|(a, _)| length(&a.0));
            let angle = open.iter().map(|p| p.1.1).sum::<f64>() / open.iter().map(|p| p.0.1).sum::<f64>();
            eprintln!("{rho} radii away: vectors {error:.4} apart, {angle:.4} of the angle");
            assert!(error < slack && (angle - 1.0).abs() < 0.02, "{rho}: {error} {angle}");
        }
    });
}

#[test]
fn pictures_with_looked_up_masks_are_those_with_rays_nearly_and_plans_tell_them_apart() {
    with_gpu(|gpu| {
        let mut scene = Scene { environment: Some(colourful()), ..Scene::default() };
        ground(&mut scene, 20.0);
        let (mut positions, indices) = ball(0.5, 10);
        positions.iter_mut().for_each(|p| *p = *p * vec3(1.0, 0.4, 0.6) + vec3(0.0, 0.6, 0.0));
        thing(&mut scene, "stone", positions, indices, Mat4::IDENTITY);
        let rays = Settings { size: 8, azimuths: 24, polars: 13, radii: 12, largest: 1.0, ..Settings::default() };
        let looked_up = Settings { masks: Masks::Parallel, ..rays.clone() };
        let view = tracer_lab::view(vec3(0.0, 4.0, 0.1), Vec3::ZERO, 50.0, [24, 24]);
        let picture = |settings: &Settings| Studio::new(gpu, &scene, settings, None).irradiance(&view, settings);
        let truth = picture(&Settings { method: Method::BruteForce, ..rays.clone() });
        let (by_rays, by_pictures) = (picture(&rays), picture(&looked_up));
        let errors = [&by_rays, &by_pictures].map(|found| nrmse(&truth, found));
        let between = nrmse(&by_rays, &by_pictures);
        eprintln!("NRMSE by rays {:.4}, looked up {:.4}, between them {between:.4}", errors[0], errors[1]);
        assert!(between > 0.0 && between < 0.02 && errors[1] < errors[0] + 0.01);
        assert!(by_pictures == picture(&looked_up), "twice the same");
        let [a, b] = [&rays, &looked_up].map(|settings| Plan::new("", 1, &[], settings));
        assert!(a.difference(&b).unwrap().contains("Parallel"));
    });
}

#[test]
fn what_lets_light_through_and_fine_environments_get_rays() {
    with_gpu(|gpu| {
        let (sky, point) = (Sky::new(Some(&cap(40, 1.0).0), 16).unwrap(), vec3(0.0, -1.5, 0.0));
        let light = Light::new(gpu, &sky).unwrap();
        let mut scene = one_ball(1.0, 20);
        scene.materials[0].alpha = AlphaMode::Blend;
        scene.materials[0].base_color.w = 0.5;
        let (veil, _) = occluder(&scene);
        let [rays, looked_up] = [false, true].map(|way| covered(gpu, &veil, &light, &[point], way));
        assert_eq!(rays, looked_up);
        let (solid, _) = occluder(&one_ball(1.0, 20));
        let fine = Light::new(gpu, &Sky::new(Some(&cap(40, 1.0).0), 64).unwrap()).unwrap();
        let [rays, looked_up] = [false, true].map(|way| covered(gpu, &solid, &fine, &[point], way));
        assert_eq!(rays, looked_up);
    });
}

#[test]
fn brute_force_loses_nothing_by_its_boxes() {
    with_gpu(|gpu| {
        let stage = |more: u32| {
            let mut scene = Scene { environment: Some(colourful()), ..Scene::default() };
            ground(&mut scene, 20.0);
            for i in 0..3 {
                let (mut positions, indices) = ball(0.5, 8);
                positions.iter_mut().for_each(|p| *p *= vec3(1.0, 0.3, 0.7));
                let at = Mat4::from_translation(vec3(i as f32 - 1.0, 0.15 + 0.3 * i as f32, 0.2 * i as f32));
                thing(&mut scene, &format!("stone {i}"), positions, indices, at);
            }
            // Objects below the ground that face away from everything, so many that no boxes are used.
            for i in 0..more {
                let corner = vec3(i as f32, -50.0, 0.0);
                let corners = vec![corner, corner + Vec3::X * 0.01, corner + Vec3::Z * 0.01];
                thing(&mut scene, &format!("speck {i}"), corners, vec![0, 1, 2], Mat4::IDENTITY);
            }
            scene
        };
        let settings = Settings { size: 16, method: Method::BruteForce, ..Settings::default() };
        for from in [vec3(0.0, 4.0, 0.1), vec3(1.0, 0.4, 3.0)] {
            let view = tracer_lab::view(from, vec3(0.0, 0.3, 0.0), 50.0, [24, 24]);
            let [few, many] =
                [0, 8].map(|more| Studio::new(gpu, &stage(more), &settings, None).irradiance(&view, &settings));
            let apart = few.iter().zip(&many).filter(|(a, b)| a != b).count();
            // A different hierarchy may resolve a ray through an edge differently.
            assert!(apart <= few.len() / 100 && nrmse(&many, &few) < 1e-3, "{apart} pixels");
        }
    });
}

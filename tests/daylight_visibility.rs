//! The triangle that hid the sun at one time saves rays at the next times. No light may change by that.

use crate::{
    daylight_lab::lights,
    daylight_light::baking,
    daylight_masks::day,
    tracer_lab::{Stage, view},
};
use glam::{Vec3, vec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    scene::{AlphaMode, Material, Scene, View},
    techniques::daylight::{Baking, Plan, Sources, SunPoint, Transport},
};

/// A floor and a wall behind many small boxes at all heights, whose triangles hide the sun only in part, and few large ones.
fn forest() -> (Scene, View) {
    let mut stage = Stage::new();
    let white = stage.material(Material::diffuse("white", Vec3::splat(0.7)));
    stage.quad(white, vec3(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0);
    stage.quad(white, vec3(-2.0, 0.0, -2.0), Vec3::X * 4.0, Vec3::Y * 2.0);
    for i in 0..60 {
        let at = |k: u32, from: f32, to: f32| from + (to - from) * ((i * k + 7) % 61) as f32 / 61.0;
        let low = vec3(at(17, -1.9, 1.8), at(29, 0.3, 2.6), at(43, -1.9, 1.8));
        let side = if i % 20 == 0 { 0.9 } else { 0.08 + 0.004 * i as f32 };
        stage.cuboid(white, low, low + side * vec3(1.0, 0.4, 0.7), false);
    }
    (stage.scene, view(vec3(0.0, 1.6, 5.0), vec3(0.0, 0.6, 0.0), 40.0, [24, 18]))
}

/// The same surfaces, of a kind whose triangles never save a ray, because parts of them may be cut out.
fn without_saved_rays(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.materials.iter_mut().for_each(|material| material.alpha = AlphaMode::Mask { cutoff: 0.5 });
    scene
}

/// Suns at infinity with a disc, and suns that are points between the boxes.
fn days(scene: &Scene, eye: &View, settings: &Baking) -> [Plan; 2] {
    [None, Some(SunPoint { centre: [0.1, 0.9, 0.0], distance: 1.3 })].map(|point| {
        let mut plan = day(scene, eye, Baking { disc: point.is_none(), ..settings.clone() });
        plan.calendar.point = point;
        plan
    })
}

fn sun_of(gpu: &Gpu, scene: &Scene, plan: &Plan, sources: &Sources) -> Vec<f32> {
    lights(gpu, scene, plan, sources.clone()).into_iter().flat_map(|light| light.sun).collect()
}

#[test]
fn saved_rays_change_no_bit() {
    with_gpu(|gpu| {
        let (scene, eye) = forest();
        let all_traced = without_saved_rays(&scene);
        let sources = Sources::View(Box::new(eye));
        for sun_masks in [0.0, 0.2] {
            for plan in days(&scene, &eye, &Baking { samples: 16, sun_masks, ..baking() }) {
                let [saved, traced] = [&scene, &all_traced].map(|scene| sun_of(gpu, scene, &plan, &sources));
                let lit = traced.iter().filter(|light| **light > 0.0).count();
                assert!(lit > traced.len() / 4 && lit < traced.len(), "{lit} of {}", traced.len());
                let differ = saved.iter().zip(&traced).filter(|(a, b)| a != b).count();
                assert_eq!(differ, 0, "of {} values, masks {sun_masks}, {:?}", traced.len(), plan.calendar.point);
            }
        }
    });
}

#[test]
fn dispatches_of_few_rays_have_the_same_light() {
    with_gpu(|gpu| {
        let (scene, eye) = forest();
        for sun_masks in [0.0, 0.2] {
            let [plan, _] = days(&scene, &eye, &Baking { samples: 8, sun_masks, ..baking() });
            let light = |rays: Option<u64>| {
                let mut transport = Transport::new(gpu, &scene, &plan, Sources::View(Box::new(eye))).unwrap();
                if let Some(rays) = rays {
                    transport = transport.dispatch_rays(rays);
                }
                transport.tile(&plan, 0).unwrap().sun
            };
            // One ray is less than each item has: a dispatch for each time.
            let [whole, cut] = [None, Some(1)].map(light);
            assert!(whole.iter().any(|light| *light > 0.0));
            assert_eq!(whole.len(), cut.len());
            for (whole, cut) in whole.iter().zip(&cut) {
                assert!((whole - cut).abs() <= 1e-5 * whole, "{whole} and {cut}, masks {sun_masks}");
            }
        }
    });
}

#[test]
fn the_light_of_a_time_does_not_depend_on_the_other_times() {
    with_gpu(|gpu| {
        let (scene, eye) = forest();
        let sources = Sources::View(Box::new(eye));
        for sun_masks in [0.0, 0.2] {
            let [all, _] = days(&scene, &eye, &Baking { samples: 8, sun_masks, ..baking() });
            // Times of each word, without its first time.
            let some = [10, 40, 50, 69];
            let alone = Plan { times: some.map(|time| all.times[time]).to_vec(), ..all.clone() };
            let [all, alone] = [&all, &alone].map(|plan| sun_of(gpu, &scene, plan, &sources));
            assert!(alone.iter().any(|light| *light > 0.0));
            assert_eq!(all.len() / 70, alone.len() / some.len());
            for (all, alone) in all.chunks_exact(70).zip(alone.chunks_exact(some.len())) {
                assert_eq!(some.map(|time| all[time]), alone, "masks {sun_masks}");
            }
        }
    });
}

#[test]
fn cut_out_triangles_save_no_ray() {
    with_gpu(|gpu| {
        let mut stage = Stage::new();
        let white = stage.material(Material::diffuse("white", Vec3::splat(0.7)));
        let roof = stage.material(Material::diffuse("roof", Vec3::splat(0.7)));
        stage.quad(white, vec3(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0);
        stage.quad(white, vec3(-2.0, 0.0, -2.0), Vec3::X * 4.0, Vec3::Y * 2.0);
        let roofed = |from: f32| {
            let mut stage = Stage { scene: stage.scene.clone() };
            stage.quad(roof, vec3(from, 3.0, -6.0), Vec3::Z * 12.0, Vec3::X * (6.0 - from));
            stage.scene
        };
        // Alpha rises from 0 to 1 along x: the first half of the roof is cut out. The sun goes from +x to -x, so it is hidden first.
        let mut cut = roofed(-6.0);
        cut.materials[roof as usize].alpha = AlphaMode::Mask { cutoff: 0.5 };
        let white = |alpha: f32| Vec3::ONE.extend(alpha);
        cut.meshes.last_mut().unwrap().primitives[0].colors = vec![white(0.0), white(0.0), white(1.0), white(1.0)];
        let half = roofed(0.0);
        let eye = view(vec3(0.0, 1.6, 5.0), vec3(0.0, 0.6, 0.0), 40.0, [24, 18]);
        let plan = day(&cut, &eye, Baking { samples: 64, ..baking() });
        let [cut, half] = [&cut, &half].map(|scene| {
            let light = sun_of(gpu, scene, &plan, &Sources::View(Box::new(eye)));
            light.iter().map(|light| f64::from(*light)).sum::<f64>()
        });
        assert!((cut / half - 1.0).abs() < 0.01, "{cut} of {half}");
    });
}

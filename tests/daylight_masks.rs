//! Sun masks against exact shadow rays.

use crate::{
    daylight_lab::lights,
    daylight_light::{baking, eye, plan, stage},
    tracer_lab::{Stage, view},
};
use glam::{Vec3, vec3};
use lucerna::{
    gpu::testing::with_gpu,
    scene::{Material, Scene, View},
    techniques::daylight::{Baking, Cells, Light, Lit, Plan, Sources, SunPoint, Transport, probes::Grid},
};

/// Suns along a half circle: more times than one and two words of a mask have.
pub fn day(scene: &Scene, eye: &View, settings: Baking) -> Plan {
    let sun = |i: usize| {
        let angle = (i as f32 + 0.5) / 70.0 * std::f32::consts::PI;
        vec3(angle.cos(), angle.sin(), 0.4).normalize().to_array()
    };
    let times = (0..70).map(|i| Lit { seconds: 600.0 * i as f64, sun: sun(i) }).collect();
    Plan { times, steps: 70, ..plan(scene, eye, settings) }
}

/// For each time the light of all texels and colours.
fn by_time(tiles: &[Light], times: usize) -> Vec<f64> {
    let rows = tiles.iter().flat_map(|light| light.sun.chunks_exact(times));
    rows.fold(vec![0.0; times], |sums, row| sums.iter().zip(row).map(|(sum, light)| sum + f64::from(*light)).collect())
}

fn of_view(gpu: &lucerna::gpu::Gpu, scene: &Scene, eye: View, plan: &Plan) -> Vec<Light> {
    lights(gpu, scene, plan, Sources::View(Box::new(eye)))
}

#[test]
fn masks_have_the_light_of_shadow_rays_at_all_times() {
    with_gpu(|gpu| {
        let (scene, eye) = (stage(), eye());
        for point in [None, Some(SunPoint { centre: [0.0, 1.0, 0.0], distance: 6.0 })] {
            let times = [0.0, 0.05].map(|sun_masks| {
                let settings = Baking { samples: 64, sun_masks, disc: point.is_none(), ..baking() };
                let mut plan = day(&scene, &eye, settings);
                plan.calendar.point = point;
                by_time(&of_view(gpu, &scene, eye, &plan), 70)
            });
            let [exact, masks] = times;
            let brightest = exact.iter().copied().fold(0.0, f64::max);
            let (all_exact, all_masks) = (exact.iter().sum::<f64>(), masks.iter().sum::<f64>());
            assert!((all_masks / all_exact - 1.0).abs() < 0.01, "the day: {all_masks} of {all_exact}");
            let ratios = || exact.iter().zip(&masks).map(|(exact, masks)| masks / exact);
            let (least, most) = (ratios().fold(2.0, f64::min), ratios().fold(0.0, f64::max));
            println!("light of masks: {:.4}, at single times {least:.4} to {most:.4}", all_masks / all_exact);
            for (time, (exact, masks)) in exact.iter().zip(&masks).enumerate() {
                assert!((masks - exact).abs() < 0.02 * brightest.min(2.0 * exact), "time {time}: {masks} of {exact}");
            }
        }
    });
}

/// Light of the whole day with masks, by that with shadow rays.
fn ratio(gpu: &lucerna::gpu::Gpu, scene: &Scene, eye: View, sun_masks: f32) -> f64 {
    let [exact, masks] = [0.0, sun_masks].map(|sun_masks| {
        let plan = day(scene, &eye, Baking { samples: 64, bounces: 1, sun_masks, ..baking() });
        by_time(&of_view(gpu, scene, eye, &plan), 70).iter().sum::<f64>()
    });
    masks / exact
}

#[test]
fn both_sides_of_a_surface_have_masks() {
    with_gpu(|gpu| {
        let mut stage = Stage::new();
        let white = stage.material(Material::diffuse("white", Vec3::splat(0.7)));
        // A wall in the middle of a floor: the view is of its back, and the sun comes to both sides.
        stage.quad(white, vec3(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0);
        stage.quad(white, vec3(0.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::Y * 2.0);
        for x in [-4.0, 4.0] {
            let eye = view(vec3(x, 1.5, 0.0), vec3(0.0, 0.3, 0.0), 45.0, [24, 18]);
            let ratio = ratio(gpu, &stage.scene, eye, 0.05);
            assert!((ratio - 1.0).abs() < 0.01, "seen from {x}: {ratio}");
        }
    });
}

#[test]
fn points_of_masks_are_not_under_things() {
    with_gpu(|gpu| {
        let mut stage = Stage::new();
        let white = stage.material(Material::diffuse("white", Vec3::splat(0.7)));
        stage.quad(white, vec3(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0);
        stage.quad(white, vec3(-2.0, 0.0, -2.0), Vec3::X * 4.0, Vec3::Y * 2.0);
        // Low plates on half of each square metre of the floor, which has cells of a square metre.
        for x in -2..2 {
            for z in -2..2 {
                let low = vec3(x as f32, 0.0, z as f32);
                stage.cuboid(white, low, low + vec3(0.5, 0.02, 1.0), false);
            }
        }
        let eye = view(vec3(0.0, 1.0, 4.0), vec3(0.0, 0.8, -2.0), 40.0, [24, 18]);
        let ratio = ratio(gpu, &stage.scene, eye, 1.0);
        assert!((ratio - 1.0).abs() < 0.08, "{ratio}");
    });
}

#[test]
fn masks_of_surfaces_without_shadows_change_no_bit() {
    with_gpu(|gpu| {
        let mut stage = Stage::new();
        let white = stage.material(Material::diffuse("white", Vec3::splat(0.7)));
        stage.quad(white, vec3(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0);
        stage.quad(white, vec3(-2.0, 0.0, -2.0), Vec3::X * 4.0, Vec3::Y * 2.0);
        let eye = view(vec3(0.0, 1.0, 4.0), vec3(0.0, 0.5, 0.0), 50.0, [24, 18]);
        // All suns are high before both surfaces, and there is one scattering: all vertices send shadow rays.
        let both = [0.0, 0.3].map(|sun_masks| {
            let settings = Baking { samples: 16, bounces: 1, sun_masks, ..baking() };
            let mut plan = day(&stage.scene, &eye, settings);
            for (i, time) in plan.times.iter_mut().enumerate() {
                time.sun = vec3(i as f32 / 70.0 - 0.5, 1.0, 1.0).normalize().to_array();
            }
            of_view(gpu, &stage.scene, eye, &plan)
        });
        assert!(by_time(&both[0], 70).iter().all(|light| *light > 0.0));
        assert!(both[0] == both[1]);
    });
}

#[test]
fn no_light_leaks_through_masks_into_a_closed_box() {
    with_gpu(|gpu| {
        let mut stage = Stage::new();
        let white = stage.material(Material::diffuse("white", Vec3::splat(0.9)));
        stage.cuboid(white, Vec3::splat(-1.0), Vec3::splat(1.0), true);
        let eye = view(vec3(0.2, 0.1, 0.9), vec3(0.0, 0.0, -1.0), 80.0, [16, 12]);
        // Cells larger than the sides: one for each triangle.
        for sun_masks in [0.1, 5.0] {
            let plan = day(&stage.scene, &eye, Baking { samples: 32, disc: true, sun_masks, ..baking() });
            let tiles = of_view(gpu, &stage.scene, eye, &plan);
            assert!(tiles.iter().any(|light| !light.sun.is_empty()));
            assert!(by_time(&tiles, 70).iter().all(|light| *light == 0.0), "{sun_masks}");
        }
    });
}

#[test]
fn a_tile_has_the_same_bits_with_masks_whatever_else_is_baked() {
    with_gpu(|gpu| {
        let (scene, eye) = (stage(), eye());
        let plan = day(&scene, &eye, Baking { samples: 8, tile: 16, disc: true, sun_masks: 0.2, ..baking() });
        let mut transport = Transport::new(gpu, &scene, &plan, Sources::View(Box::new(eye))).unwrap();
        let after_others = [0, 1, 3].map(|tile| transport.tile(&plan, tile).unwrap())[2].clone();
        let alone = Transport::new(gpu, &scene, &plan, Sources::View(Box::new(eye))).unwrap().tile(&plan, 3).unwrap();
        assert!(alone == after_others);
        // Fewer times, as after the choice of the steps: the masks are new.
        let fewer = Plan { times: plan.times.iter().copied().step_by(2).collect(), ..plan.clone() };
        transport.follow(&fewer).unwrap();
        let tile = transport.tile(&fewer, 3).unwrap();
        let each_second: Vec<f32> = alone.sun.chunks_exact(70).flat_map(|row| row.iter().copied().step_by(2)).collect();
        assert!(tile.sun == each_second);
    });
}

#[test]
fn probes_have_the_light_of_shadow_rays_with_masks() {
    with_gpu(|gpu| {
        let (scene, eye) = (stage(), eye());
        let [exact, masks] = [0.0, 0.1].map(|sun_masks| {
            let settings = Baking { probe_samples: 256, sun_masks, ..baking() };
            let around = Grid::around(&scene, 1.0).unwrap();
            let plan = Plan { probes: Some(Grid::new(&around, 1.0, 64)), ..day(&scene, &eye, settings) };
            let mut transport = Transport::new(gpu, &scene, &plan, Sources::View(Box::new(eye))).unwrap();
            by_time(&[transport.brick(&plan, 0).unwrap().light], 70).iter().sum::<f64>()
        });
        assert!(exact > 0.0 && (masks / exact - 1.0).abs() < 0.015, "{masks} of {exact}");
    });
}

#[test]
fn too_many_points_of_masks_are_refused_with_a_distance_that_is_allowed() {
    let (scene, eye) = (stage(), eye());
    let plan = day(&scene, &eye, baking());
    let cells = |sun_masks: f32| Cells::new(&scene, &Baking { sun_masks, ..plan.settings.clone() }, 70);
    assert_eq!(cells(0.0).unwrap(), Cells::default());
    // 60 m² of surfaces, and half of a triangle's grid lies outside of it.
    let count = cells(0.1).unwrap().count;
    assert!((6_000..12_000).contains(&count), "{count}");
    let text = cells(0.001).unwrap_err().to_string();
    assert!(text.contains("bake.sun_masks") && text.contains("70 times"), "{text}");
    let allowed: f32 = text.split("at least ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!(cells(allowed).unwrap().count > 1_000_000, "{allowed}");
}

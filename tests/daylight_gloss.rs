//! Gloss in baked light: its directions from probes, beside the path tracer and beside a slow twin.

use std::f64::consts::PI;

use glam::{DVec3, Vec3, vec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    image::Layers,
    reference::brdf::{Matter, below, width},
    scene::{Material, Scene, View},
    techniques::daylight::{
        Baked, Baking, Light, Reflections, Sources, Stored,
        probes::{DIRECTIONS, Grid, lobe},
    },
    tracer::Settings,
};

use crate::{
    daylight_lab::{Studio, baked_with},
    daylight_lightmap::{baking, glowing_room, lamps_alone, planned},
    daylight_probes::normal,
    tracer_lab::{Stage, flat_view, matt, render},
};

type Lit<'a> = &'a dyn Fn(Vec3) -> f32;

/// A lightmap with probes and one group of lamps. `light`: the irradiance of a normal by them; `None`: that of the paths.
fn bake(gpu: &Gpu, scene: &Scene, lamp: u32, settings: Baking, light: Option<Lit<'_>>) -> Baked {
    bake_apart(gpu, scene, lamp, settings, light.map(|light| (light, light)))
}

/// The same with one light for texels and another one for probes.
fn bake_apart(gpu: &Gpu, scene: &Scene, lamp: u32, settings: Baking, light: Option<(Lit<'_>, Lit<'_>)>) -> Baked {
    let (mut plan, unwrapped) = planned(gpu, scene, &[lamp], settings);
    plan.probes = Some(Grid::new(&Grid::around(scene, 1.0).unwrap(), 1.0, 4096));
    let sources = Sources::Lightmap(Box::new(unwrapped.by_tile(plan.side())));
    let put = |of: &mut Light, values: Vec<f32>| {
        of.lamps = values;
        of.lamps_noise = vec![0.0; of.lamps.len()];
    };
    let of_tile = |of: &mut Light| {
        if let Some((light, _)) = light {
            let values = of.spots.iter().flat_map(|spot| [light(spot.normal.into()); 3]).collect();
            put(of, values);
        }
    };
    let of_brick = |of: &mut Light| {
        if let Some((_, light)) = light {
            let rows = 0..of.lamps.len() / 3;
            let values = rows.flat_map(|row| [light(normal(row % DIRECTIONS).as_vec3()); 3]).collect();
            put(of, values);
        }
    };
    let stored = baked_with(gpu, scene, plan, sources, of_tile, of_brick);
    Baked::new(Stored { corners: unwrapped.lightmap.corners, ..stored })
}

fn picture(gpu: &Gpu, scene: &Scene, eye: View, baked: &Baked, reflections: Reflections) -> Layers {
    let mut settings = lamps_alone();
    settings.daylight.reflections = reflections;
    Studio::with(gpu, scene.clone(), eye, baked, &settings).frame(0, &settings).unwrap().0
}

fn mean(layers: &Layers, name: &str) -> f64 {
    let data = &layers.layer(name).unwrap().data;
    data.iter().map(|value| f64::from(*value)).sum::<f64>() / data.len() as f64
}

fn body(albedo: f32, metallic: f32, roughness: f32) -> Material {
    Material { metallic, roughness, ior: 1.5, ..Material::diffuse("body", Vec3::splat(albedo)) }
}

/// A part of the front of a block in the middle, seen at this angle from the right (+x).
fn seen(degrees: f32) -> View {
    let (sine, cosine) = degrees.to_radians().sin_cos();
    let at = vec3(0.0, 0.0, 0.3);
    flat_view(at + 1.5 * vec3(sine, 0.0, cosine), at, 0.1, [8, 8])
}

#[test]
fn gloss_reflects_the_light_of_its_direction() {
    with_gpu(|gpu| {
        for (albedo, metallic, roughness) in [(0.7, 1.0, 0.3), (0.7, 1.0, 0.6), (0.05, 0.0, 0.4)] {
            // A black room whose left wall glows.
            let mut stage = Stage::new();
            let black = stage.material(Material::diffuse("black", Vec3::ZERO));
            stage.cuboid(black, Vec3::splat(-2.0), Vec3::splat(2.0), true);
            let lamp = stage.emitter(Vec3::ONE);
            stage.quad(lamp, vec3(-1.99, -2.0, -2.0), Vec3::Y * 4.0, Vec3::Z * 4.0);
            let block = stage.material(body(albedo, metallic, roughness));
            stage.cuboid(block, Vec3::splat(-0.3), Vec3::splat(0.3), false);
            let scene = stage.scene;
            let settings = Baking { bounces: 1, density: 8.0, diffuse_only: false, probe_samples: 1024, ..baking(256) };
            let baked = bake(gpu, &scene, lamp, settings, None);
            let mut ratios = Vec::new();
            for degrees in [50.0, -50.0] {
                let eye = seen(degrees);
                let truth = render(gpu, &scene, &eye, &Settings { diffuse_only: false, ..matt(1) }, 1024);
                let wanted = mean(&truth, "direct") + mean(&truth, "indirect");
                let [found, even] = [Reflections::Probes, Reflections::Even]
                    .map(|from| mean(&picture(gpu, &scene, eye, &baked, from), "indirect") / wanted);
                println!(
                    "albedo {albedo}, metallic {metallic}, roughness {roughness}, {degrees}°: {wanted:.4}; {found:.3}, even {even:.3}"
                );
                ratios.push((found, even));
            }
            let [(toward, even_toward), (away, even_away)] = ratios[..] else { unreachable!() };
            assert!((toward - 1.0).abs() < 0.2 && even_toward < 0.5, "{toward} {even_toward}");
            assert!(away < 0.7 * even_away, "{away} {even_away}");
        }
    });
}

/// Irradiance by a radiance of 1 + 0.6 x + 0.3 (3 x² - 1) / 2, whose harmonics above band 2 are 0.
fn uneven(normal: Vec3) -> f32 {
    let x = f64::from(normal.x);
    (PI * (1.0 + 0.6 * x * 2.0 / 3.0 + 0.3 * (1.5 * x * x - 0.5) / 4.0)) as f32
}

#[test]
fn gloss_of_probes_is_that_of_the_slow_twin() {
    with_gpu(|gpu| {
        for (albedo, metallic, roughness) in [(0.7f32, 1.0f32, 0.3f32), (0.7, 1.0, 0.8), (0.2, 0.0, 0.5)] {
            let (scene, lamp) = glowing_room(4.0, |stage, _| {
                let block = stage.material(body(albedo, metallic, roughness));
                stage.cuboid(block, Vec3::splat(-0.3), Vec3::splat(0.3), false);
            });
            let settings = Baking { bounces: 1, tolerance: 1e-3, probe_samples: 32, ..baking(32) };
            let settings = Baking { diffuse_only: false, ..settings };
            let baked = bake(gpu, &scene, lamp, settings, Some(&uneven));
            for degrees in [60.0f32, 20.0, -40.0] {
                let found = mean(&picture(gpu, &scene, seen(degrees), &baked, Reflections::Probes), "indirect");
                let (sine, cosine) = f64::from(degrees).to_radians().sin_cos();
                let (albedo, metallic, roughness) = (f64::from(albedo), f64::from(metallic), f64::from(roughness));
                let f0 = 0.04 + (albedo - 0.04) * metallic;
                let matter =
                    Matter { albedo: DVec3::splat(albedo * (1.0 - metallic)), f0: DVec3::splat(f0), roughness };
                let (matt, all) = (matter.matt(cosine).x, matter.reflected(cosine, 200).x);
                // Between the mirrored direction and the normal (Lagarde and de Rousiers 2014).
                let alpha = width(roughness);
                let share = (1.0 - alpha) * ((1.0 - alpha).sqrt() + alpha);
                let axis = DVec3::Z.lerp(DVec3::new(-sine, 0.0, cosine), share).normalize();
                let [one, two] = lobe(alpha);
                let reflected = 1.0 + 0.6 * axis.x * one + 0.3 * (1.5 * axis.x * axis.x - 0.5) * two;
                let wanted = matt * f64::from(uneven(Vec3::Z)) / PI + (all - matt) * reflected;
                println!(
                    "albedo {albedo:.2}, metallic {metallic}, roughness {roughness:.2}, {degrees}°: {found:.4}, {wanted:.4}"
                );
                assert!((found / wanted - 1.0).abs() < 0.015, "{found} {wanted}");
            }
        }
    });
}

#[test]
fn a_corner_reflects_less_and_a_lamp_close_by_has_no_direction() {
    with_gpu(|gpu| {
        let (scene, lamp) = glowing_room(4.0, |stage, _| {
            let block = stage.material(body(0.7, 1.0, 0.3));
            stage.cuboid(block, Vec3::splat(-0.3), Vec3::splat(0.3), false);
        });
        let settings = Baking { bounces: 1, tolerance: 1e-3, probe_samples: 32, diffuse_only: false, ..baking(32) };
        // Texels have this share of the light of the probes.
        let pictures = [1.0, 0.5, 3.0].map(|share| {
            let baked = bake_apart(gpu, &scene, lamp, settings.clone(), Some((&|n| share * uneven(n), &uneven)));
            [Reflections::Probes, Reflections::Even]
                .map(|from| mean(&picture(gpu, &scene, seen(-40.0), &baked, from), "indirect"))
        });
        let [[whole, even], [half, _], [more, _]] = pictures;
        println!("{pictures:?}");
        // A metal: nearly all light is reflected by facets at once.
        assert!((half / whole - 0.5).abs() < 5e-3, "{half} {whole}");
        assert!((more - whole - 2.0 * even).abs() < 0.01 * more, "{more} {whole} {even}");
        assert!(whole > 1.2 * even, "{whole} {even}");
    });
}

#[test]
fn even_light_is_reflected_alike_with_and_without_probes() {
    with_gpu(|gpu| {
        for (albedo, metallic, roughness) in [(0.05, 0.0, 0.3), (0.7, 1.0, 0.2), (0.7, 1.0, 0.9)] {
            let (scene, lamp) = glowing_room(4.0, |stage, _| {
                let block = stage.material(body(albedo, metallic, roughness));
                stage.cuboid(block, Vec3::splat(-0.3), Vec3::splat(0.3), false);
            });
            let even = |_: Vec3| 2.0 * PI as f32;
            let settings = Baking { bounces: 1, probe_samples: 32, diffuse_only: false, ..baking(32) };
            let baked = bake(gpu, &scene, lamp, settings, Some(&even));
            let [found, wanted] = [Reflections::Probes, Reflections::Even]
                .map(|from| mean(&picture(gpu, &scene, seen(50.0), &baked, from), "indirect"));
            assert!((found / wanted - 1.0).abs() < 2e-3, "{found} {wanted}");
        }
    });
}

#[test]
fn normals_that_lean_away_from_the_viewer_have_little_gloss() {
    with_gpu(|gpu| {
        for lean in [70.0f32, 80.0, 90.0] {
            let (sine, cosine) = lean.to_radians().sin_cos();
            let (mut scene, lamp) = glowing_room(4.0, |stage, _| {
                let leaf = stage.material(body(0.1, 0.0, 0.5));
                stage.quad(leaf, vec3(-0.5, -0.5, 0.3), Vec3::X, Vec3::Y);
            });
            let leaf = scene.meshes.last_mut().unwrap();
            leaf.primitives[0].normals.iter_mut().for_each(|normal| *normal = vec3(sine, 0.0, cosine));
            let settings = Baking { bounces: 1, diffuse_only: false, probe_samples: 32, ..baking(256) };
            let baked = bake(gpu, &scene, lamp, settings, None);
            // The cosine between viewer and normal is -0.17 to -0.5.
            let eye = seen(-30.0);
            let truth = render(gpu, &scene, &eye, &Settings { diffuse_only: false, ..matt(1) }, 1024);
            let wanted = mean(&truth, "direct") + mean(&truth, "indirect");
            let found = mean(&picture(gpu, &scene, eye, &baked, Reflections::Even), "indirect") / wanted;
            let left = below(f64::from((lean + 30.0).to_radians().cos()), 0.5);
            println!("{lean}°: {wanted:.4}, {found:.3}, {left:.3} of the gloss is left");
            // The path tracer also loses light that goes into the leaf. With the whole gloss of a viewer at the horizon the ratio is above 3.
            assert!((0.9..2.0).contains(&found), "{found}");
        }
    });
}

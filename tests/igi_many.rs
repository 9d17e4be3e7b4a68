//! Picks from the light tree, compensation of the bound, and the irradiance cache.

use crate::igi_lab::{Shown, Studio, mean, plain};
use crate::igi_picks::{Chooser, irradiance, offset};
use crate::tracer_lab::{Stage, flat_view, matt, view};
use glam::{DVec3, Vec3, vec3};
use lucerna::{
    gpu::testing::with_gpu,
    graph::{Graph, testing::every_barrier_matters},
    resident::Resident,
    scene::{Material, Pose, View},
    shaders::types,
    techniques::igi::{Igi, PictureSettings, Settings},
    tracer::{self, Tracer},
};
use lucerna_scenes as builtin;

/// A closed box of half side 1 around the origin with a lamp.
fn room() -> Stage {
    let mut stage = Stage::new();
    let wall = stage.material(Material::diffuse("wall", vec3(0.7, 0.5, 0.2)));
    stage.cuboid(wall, Vec3::splat(-1.0), Vec3::ONE, true);
    stage.point(vec3(0.2, 0.3, -0.1), vec3(1.0, 2.0, 3.0));
    stage
}

/// The inside of a sphere with a lamp: between any two of its points cos θ cos θ' / d² is 1 / 4R².
fn sphere(radius: f32, albedo: f32, lamp: Vec3) -> Stage {
    let mut stage = Stage::new();
    let wall = stage.material(Material::diffuse("wall", Vec3::splat(albedo)));
    stage.sphere(wall, Vec3::ZERO, radius, 80, true);
    stage.point(lamp, Vec3::splat(2.0));
    stage
}

fn cornell(side: u32) -> (lucerna::scene::Scene, View) {
    let scene = builtin::load("cornell").unwrap();
    let seen = View::of_camera(&scene, &Pose::rest(&scene), 0, [side, side]).unwrap();
    (scene, seen)
}

fn position(node: &types::Vpl) -> DVec3 {
    Vec3::from(node.position).as_dvec3()
}

/// Middle of pixel i of a 16 × 16 view of the wall z = -1.
fn on_the_wall(i: usize) -> DVec3 {
    let at = |k: usize| (k as f64 + 0.5) / 16.0 * 1.6 - 0.8;
    DVec3::new(at(i % 16), -at(i / 16), -1.0)
}

fn wall_view() -> View {
    flat_view(vec3(0.0, 0.0, 0.5), vec3(0.0, 0.0, -1.0), 1.6, [16, 16])
}

#[test]
fn the_tree_bounds_the_virtual_lights_and_holds_each_once() {
    with_gpu(|gpu| {
        let stage = room();
        let mut studio = Studio::new(gpu, &stage.scene);
        // One light, a few lights, a power of two, and one more. Some paths leave no virtual light.
        for (vpls, candidates) in [(1, 1), (2, 1), (5, 1), (256, 1), (257, 4), (10_000, 1)] {
            let settings = Settings { candidates, bounces: 1, ..plain(vpls) };
            let plain = studio.render(&wall_view(), &settings, 3);
            let shown = studio.render(&wall_view(), &Settings { picks: 1, ..settings }, 3);
            let bits = |shown: &Shown| {
                let mut all: Vec<_> = shown.vpls.iter().map(|v| bytemuck::bytes_of(v).to_vec()).collect();
                all.sort();
                all
            };
            assert!(bits(&plain) == bits(&shown), "{vpls}: other virtual lights");
            let (nodes, leaves) = (&shown.nodes, shown.nodes.len() / 2);
            assert_eq!(leaves, (vpls as usize).next_power_of_two());
            for (i, leaf) in nodes[leaves..].iter().enumerate() {
                let flux = shown.vpls.get(i).map_or(0.0, |v| v.flux.iter().sum::<f32>());
                assert!((leaf.flux - flux).abs() <= 1e-6 * flux);
            }
            for i in 1..leaves {
                let node = &nodes[i];
                let flux = nodes[2 * i].flux + nodes[2 * i + 1].flux;
                assert!((node.flux - flux).abs() <= 1e-5 * flux, "{vpls}, node {i}");
                // All leaves below the node, not only its two children.
                let (mut from, mut to) = (i, i + 1);
                while from < leaves {
                    (from, to) = (2 * from, 2 * to);
                }
                for leaf in nodes[from..to].iter().filter(|leaf| leaf.flux > 0.0) {
                    let inside = (0..3).all(|c| node.low[c] <= leaf.low[c] && leaf.high[c] <= node.high[c]);
                    let cosine = Vec3::from(node.axis).dot(Vec3::from(leaf.axis));
                    assert!(inside && cosine >= node.cos_spread - 1e-5, "{vpls}, node {i}: {cosine}");
                }
            }
        }
    });
}

#[test]
fn neighbours_in_the_tree_are_neighbours_in_space() {
    with_gpu(|gpu| {
        let stage = room();
        let settings = Settings { picks: 1, ..plain(1024) };
        let shown = Studio::new(gpu, &stage.scene).render(&wall_view(), &settings, 0);
        let mean = |step: usize| {
            let pairs = shown.vpls.iter().zip(&shown.vpls[step..]);
            pairs.map(|(a, b)| position(a).distance(position(b))).sum::<f64>() / (1024 - step) as f64
        };
        println!("distances {:.3} {:.3}", mean(1), mean(511));
        assert!(mean(1) < 0.2 * mean(511));
    });
}

#[test]
fn probabilities_sum_to_one_and_reach_all_that_shines() {
    with_gpu(|gpu| {
        let (scene, seen) = cornell(8);
        let mut studio = Studio::new(gpu, &scene);
        for (vpls, bound) in [(30, 0.0), (1000, 0.0), (1000, 0.1)] {
            let shown = studio.render(&seen, &Settings { picks: 1, bound, bounces: 2, ..plain(vpls) }, 1);
            let least = f64::from(bound);
            // Points near surfaces and in free space, with random normals.
            for i in 0..50u32 {
                let number = |k: u32| f64::from((i * 7 + k).wrapping_mul(2_654_435_769) >> 8) / 16_777_216.0;
                let vpl = &shown.vpls[(number(0) * shown.vpls.len() as f64) as usize];
                let normal = DVec3::new(number(1) - 0.5, number(2) - 0.5, number(3) - 0.5).normalize();
                let point = position(vpl) + (0.3 * number(4)) * normal;
                let chooser = Chooser { nodes: &shown.nodes, point, normal, least };
                let (probabilities, none) = chooser.probabilities();
                let sum: f64 = probabilities.iter().sum::<f64>() + none;
                assert!((sum - 1.0).abs() < 1e-9, "{sum}");
                for (vpl, probability) in shown.vpls.iter().zip(&probabilities) {
                    let light = irradiance(vpl, point, normal, least);
                    let flat = normal.dot(position(vpl) - point) <= 2e-4 * position(vpl).distance(point);
                    assert!(light == DVec3::ZERO || flat || *probability > 0.0, "{light} is never picked");
                }
                // Evenly spaced numbers pick each light in proportion to its probability.
                let count = 4096;
                let mut found = vec![0.0; probabilities.len()];
                for j in 0..count {
                    if let Some((k, probability)) = chooser.pick((f64::from(j) + number(5)) / f64::from(count)) {
                        assert!((probability - probabilities[k]).abs() < 1e-12);
                        found[k] += 1.0 / f64::from(count);
                    }
                }
                let apart = found.iter().zip(&probabilities).all(|(f, p)| (f - p).abs() < 1.01 / f64::from(count));
                assert!(apart, "picked in another share");
            }
        }
    });
}

#[test]
fn the_device_picks_what_its_twin_picks() {
    with_gpu(|gpu| {
        // In a convex room nothing is occluded.
        let stage = room();
        let mut studio = Studio::new(gpu, &stage.scene);
        for (vpls, bound, picks, proposals, interleave) in
            [(2, 0.0, 1, 4, 1), (300, 0.0, 6, 1, 1), (300, 0.1, 8, 4, 1), (4000, 0.1, 18, 3, 3)]
        {
            let settings = Settings { bounces: 2, bound, picks, proposals, interleave, fused: true, ..plain(vpls) };
            let shown = studio.render(&wall_view(), &settings, 7);
            let least = f64::from(bound) * 12f64.sqrt();
            let each = settings.texel_picks();
            let mut other = 0;
            for (i, pixel) in shown.gathered.iter().enumerate() {
                let (point, normal) = (on_the_wall(i), DVec3::Z);
                let chooser = Chooser { nodes: &shown.nodes, point, normal, least };
                let (x, y) = (i as u32 % 16, i as u32 / 16);
                let subset = y % interleave * interleave + x % interleave;
                let start = offset([x / interleave, y / interleave], subset, interleave * interleave, 7);
                let picking = (each, settings.proposals);
                let sum = chooser.picked(&shown.vpls, picking, start, [x, y], 7);
                let most = if settings.picks_from(vpls) { each } else { vpls };
                assert!(pixel[3] <= most as f32, "{} rays, {most} at most", pixel[3]);
                other += usize::from((0..3).any(|c| (f64::from(pixel[c]) - sum[c]).abs() > 2e-3 * sum[c] + 1e-6));
            }
            println!("{vpls}: {other} of 256 pixels differ");
            // Rounding decides if a number lies on the border between two children.
            assert!(other <= 8, "{vpls}: {other} pixels differ");
        }
    });
}

/// Mean and deviation of the mean.
fn moments(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0) / n).sqrt())
}

#[test]
fn the_mean_of_picks_is_the_sum_over_all() {
    with_gpu(|gpu| {
        // The same seed shoots the same virtual lights. The test compares parts of the picture with those of the full sum, over seeds.
        let (scene, seen) = cornell(18);
        let mut studio = Studio::new(gpu, &scene);
        for (picks, bound) in [(3, 0.05), (12, 0.02)] {
            let mut off = vec![Vec::new(); 6];
            let mut all = vec![0.0; 6];
            for seed in 1..=24 {
                let full = Settings { bound, bounces: 2, ..plain(100) };
                let truth = studio.render(&seen, &full, seed).irradiance;
                let found = studio.render(&seen, &Settings { picks, ..full }, seed).irradiance;
                for (k, (off, all)) in off.iter_mut().zip(&mut all).enumerate() {
                    let range = k * truth.len() / 6..(k + 1) * truth.len() / 6;
                    let sum = |p: &[[f32; 4]]| {
                        p[range.clone()].iter().flat_map(|p| &p[..3]).map(|&v| f64::from(v)).sum::<f64>()
                    };
                    off.push(sum(&found) - sum(&truth));
                    *all += sum(&truth) / 24.0;
                }
            }
            for (off, all) in off.iter().zip(&all) {
                let (mean, deviation) = moments(off);
                println!("{picks} picks: off by {:.4} ± {:.4} of {all:.2}", mean / all, deviation / all);
                assert!(mean.abs() < 3.6 * deviation, "off by {mean}, deviation {deviation}");
                assert!(deviation > 0.0 && deviation < 0.06 * all, "too noisy to say anything");
            }
        }
    });
}

#[test]
fn picks_light_a_sphere_evenly_with_every_filter() {
    with_gpu(|gpu| {
        let (radius, rho, intensity) = (1.5f32, 0.6f32, 2.0f32);
        let stage = sphere(radius, rho, vec3(0.3, -0.2, 0.5));
        let mut studio = Studio::new(gpu, &stage.scene);
        let seen = view(vec3(0.1, 0.2, 0.0), vec3(1.0, 0.4, 0.3), 80.0, [36, 36]);
        let exact = f64::from(rho * intensity / (radius * radius));
        for (vpls, picks, downsample, interleave, fused) in
            [(1000, 16, 1, 1, false), (10_000, 32, 1, 3, false), (3000, 36, 2, 3, true), (3000, 8, 4, 1, false)]
        {
            let settings = Settings { bound: 0.03, picks, downsample, interleave, fused, ..plain(vpls) };
            let found = mean(&studio.render(&seen, &settings, 0).irradiance);
            // The bound removes the light from within its distance, a share of about (min_d / 2R)².
            let lost = (0.03 * 12f64.sqrt() / 2.0).powi(2);
            println!("{vpls}, {picks} picks: {:.4}", found / exact);
            assert!((found / exact - 1.0 + lost).abs() < 0.02, "{vpls}: {found} instead of {exact}");
        }
    });
}

#[test]
fn picks_err_less_the_more_they_are_and_repeat_to_the_bit() {
    with_gpu(|gpu| {
        let (scene, seen) = cornell(32);
        let mut studio = Studio::new(gpu, &scene);
        let base = Settings { bound: 0.05, ..plain(2000) };
        let truth = studio.render(&seen, &base, 1).irradiance;
        let error = |found: &[[f32; 4]]| {
            let square = found.iter().zip(&truth).map(|(f, t)| f64::from(f[1] - t[1]).powi(2)).sum::<f64>();
            (square / truth.iter().map(|t| f64::from(t[1]).powi(2)).sum::<f64>()).sqrt()
        };
        let mut last = f64::MAX;
        for picks in [2, 8, 32, 128] {
            let settings = Settings { picks, ..base.clone() };
            let found = studio.render(&seen, &settings, 1).irradiance;
            println!("{picks} picks: {:.4}", error(&found));
            // Picks are stratified, so the error falls faster than with independent picks, which would halve it.
            assert!(error(&found) < 0.62 * last, "{picks} picks");
            last = error(&found);
            assert!(found == studio.render(&seen, &settings, 1).irradiance, "{picks} picks do not repeat");
            assert!(found.iter().all(|p| p[3] <= picks as f32));
        }
        assert!(last < 0.09, "{last}");
    });
}

#[test]
fn what_the_bound_takes_is_put_back_in_a_sphere() {
    with_gpu(|gpu| {
        let (radius, rho, intensity) = (1.5f32, 0.6f32, 2.0f32);
        let stage = sphere(radius, rho, Vec3::ZERO);
        let mut studio = Studio::new(gpu, &stage.scene);
        let seen = view(vec3(0.1, 0.2, 0.0), vec3(1.0, 0.4, 0.3), 80.0, [48, 48]);
        let once = f64::from(rho * intensity / (radius * radius));
        for (bounces, bound, picks) in [(1, 0.2, 0), (1, 0.45, 16), (2, 0.2, 0), (3, 0.3, 32)] {
            let exact = once * (0..bounces).map(|k| f64::from(rho).powi(k)).sum::<f64>();
            let settings = Settings { bounces: bounces as u32, bound, picks, ..plain(900) };
            let without = studio.render(&seen, &settings, 0).irradiance;
            let with = studio.render(&seen, &Settings { compensation: 4, ..settings }, 0).irradiance;
            let (lost, found) = (mean(&without) / exact, mean(&with) / exact);
            println!("{bounces} bounces, bound {bound}: {lost:.4} without, {found:.4} with");
            assert!(lost < 0.95 && (found - 1.0).abs() < 0.015, "{bounces} bounces: {lost} without, {found} with");
            assert!(with.iter().zip(&without).all(|(w, o)| (0..3).all(|c| w[c] >= 0.9999 * o[c])), "darker somewhere");
        }
        // Without a bound there is nothing to compensate.
        let settings = Settings { bound: 0.0, ..plain(300) };
        let without = studio.render(&seen, &settings, 0).irradiance;
        assert!(without == studio.render(&seen, &Settings { compensation: 4, ..settings }, 0).irradiance);
    });
}

#[test]
fn what_is_put_back_is_the_matt_share_of_a_wall_and_the_light_of_every_lamp() {
    with_gpu(|gpu| {
        let (radius, rho, intensity) = (1.5f32, 0.6f32, 2.0f32);
        let once = f64::from(rho * intensity / (radius * radius));
        let seen = view(vec3(0.1, 0.2, 0.0), vec3(1.0, 0.4, 0.3), 80.0, [32, 32]);
        // More lamps than a short path looks at, weak and strong ones, as bright together as the one.
        let strengths = (0..40).map(|i| [0.5, 1.5][i % 2] * intensity / 40.0).collect();
        for (name, share, strengths) in [
            ("half glass", 0.5f32, vec![intensity]),
            ("matt", 1.0, vec![intensity]),
            ("forty lamps", 1.0, strengths),
            ("glowing ball", 1.0, vec![]),
        ] {
            let mut stage = Stage::new();
            // An index of 1: half of the light leaves as if there were nothing.
            let matt = Material::diffuse("wall", Vec3::splat(rho));
            let wall = Material { ior: 1.0, transmission: 1.0 - share, double_sided: true, ..matt };
            let wall = stage.material(wall);
            stage.sphere(wall, Vec3::ZERO, radius, 80, true);
            for (i, strength) in strengths.iter().enumerate() {
                let at = 0.01 * vec3((i % 3) as f32 - 1.0, (i / 3 % 3) as f32 - 1.0, (i % 7) as f32 / 3.0 - 1.0);
                stage.point(if strengths.len() == 1 { Vec3::ZERO } else { at }, Vec3::splat(*strength));
            }
            if strengths.is_empty() {
                // A ball is as strong from all sides as its disc: radiance π r².
                let glow = stage.emitter(Vec3::splat(intensity / (std::f32::consts::PI * 0.04 * 0.04)));
                stage.sphere(glow, Vec3::ZERO, 0.04, 32, false);
            }
            let mut studio = Studio::new(gpu, &stage.scene);
            // Most of the light comes by short paths.
            let settings = Settings { bound: 0.45, picks: 16, specular: true, direct_samples: 3, ..plain(3000) };
            let without = mean(&studio.render(&seen, &settings, 0).irradiance) / (once * f64::from(share));
            let settings = Settings { compensation: 4, ..settings };
            let with = mean(&studio.render(&seen, &settings, 0).irradiance) / (once * f64::from(share));
            println!("{name}: {without:.4} without, {with:.4} with");
            assert!(without < 0.6 && (with - 1.0).abs() < 0.02, "{name}: {without} without, {with} with");
        }
    });
}

#[test]
fn with_compensation_a_picture_has_the_path_tracers_energy() {
    with_gpu(|gpu| {
        let (scene, seen) = cornell(32);
        let settings = tracer::Settings { seed: 5, ..matt(2) };
        let mut tracer = Tracer::new(gpu, &scene, &Pose::rest(&scene)).unwrap();
        let layers = tracer.render(&seen, &settings, 640).unwrap();
        let truth = layers.layer("indirect").unwrap().data.iter().map(|&v| f64::from(v)).sum::<f64>();
        let mut studio = Studio::new(gpu, &scene);
        let mut energy = |bound: f32, compensation: u32, vpls: u32, seeds: u32| {
            let base = Settings { bound, bounces: 2, compensation, ..plain(vpls) };
            let sum = |seed| mean(&studio.render(&seen, &base, seed).indirect) * (32 * 32 * 3) as f64;
            (1..=seeds).map(sum).sum::<f64>() / f64::from(seeds) / truth
        };
        // Without the bound near virtual lights are rare and bright, so the mean needs many seeds.
        let unbounded = energy(0.0, 0, 400, 24);
        let [without, with] = [0, 2].map(|rays| energy(0.12, rays, 2000, 3));
        println!("energy {unbounded:.4} without bound, {without:.4} with it, {with:.4} with compensation");
        assert!((unbounded - 1.0).abs() < 0.02, "energy {unbounded} without bound");
        assert!(without < 0.95 && (with - 1.0).abs() < 0.02, "energy {without} without, {with} with");
    });
}

/// A room with a mirror that fills the view, and a block that casts shadows.
fn mirrored() -> (Stage, View) {
    let matt = |albedo| Material { ior: 1.0, ..Material::diffuse("matt", albedo) };
    let mut stage = Stage::new();
    let (white, red) = (stage.material(matt(Vec3::splat(0.7))), stage.material(matt(vec3(0.8, 0.2, 0.1))));
    let shine = Material { metallic: 1.0, roughness: 0.0, ..Material::diffuse("mirror", Vec3::ONE) };
    let shine = stage.material(shine);
    stage.cuboid(white, Vec3::splat(-1.0), Vec3::ONE, true);
    stage.cuboid(red, vec3(-0.5, -1.0, 0.0), vec3(0.1, -0.2, 0.5), false);
    stage.sphere(red, vec3(0.5, -0.6, 0.2), 0.3, 16, false);
    stage.quad(shine, vec3(-0.9, -0.9, -0.95), Vec3::X * 1.8, Vec3::Y * 1.8);
    stage.point(vec3(0.1, 0.5, 0.8), Vec3::ONE);
    (stage, view(vec3(0.0, 0.2, 0.9), vec3(0.0, 0.0, -0.95), 60.0, [40, 40]))
}

#[test]
fn what_the_bound_takes_is_put_back_behind_mirrors() {
    with_gpu(|gpu| {
        let (stage, seen) = mirrored();
        let mut studio = Studio::new(gpu, &stage.scene);
        let settings =
            Settings { bounces: 2, vpls: 400, candidates: 1, bound: 0.15, compensation: 0, ..Settings::default() };
        let mut energy = [0.0; 3];
        for seed in 1..=6 {
            let all = [
                Settings { bound: 0.0, ..settings.clone() },
                settings.clone(),
                Settings { compensation: 2, ..settings.clone() },
            ];
            for (energy, settings) in energy.iter_mut().zip(&all) {
                let shown = studio.render(&seen, settings, seed);
                // Only pixels that see the mirror.
                let mirror = shown.total.iter().zip(&shown.albedo).filter(|(_, albedo)| albedo[..3] == [0.0; 3]);
                *energy += mirror.map(|(p, _)| f64::from(p[0] + p[1] + p[2])).sum::<f64>();
            }
        }
        let (without, with) = (energy[1] / energy[0], energy[2] / energy[0]);
        println!("in the mirror {without:.4} without, {with:.4} with");
        assert!(without < 0.97 && (with - 1.0).abs() < 0.02, "{without} without, {with} with");
    });
}

/// Relative difference of two pictures, root mean square.
fn apart(a: &[[f32; 4]], b: &[[f32; 4]]) -> f64 {
    let (mut off, mut all) = (0.0, 0.0);
    for (a, b) in a.iter().zip(b) {
        for c in 0..3 {
            off += f64::from(a[c] - b[c]).powi(2);
            all += f64::from(b[c]).powi(2);
        }
    }
    (off / all).sqrt()
}

#[test]
fn cells_show_what_every_surface_would_gather() {
    with_gpu(|gpu| {
        let (stage, seen) = mirrored();
        let mut studio = Studio::new(gpu, &stage.scene);
        let settings = Settings { bounces: 2, vpls: 200, candidates: 1, bound: 0.05, ..Settings::default() };
        let exact = studio.render(&seen, &settings, 0);
        let direct = studio.render(&seen, &Settings { indirect: false, ..settings.clone() }, 0);
        // The indirect light in the mirror.
        let mirrored = |shown: &Shown| -> Vec<[f32; 4]> {
            let pairs = shown.total.iter().zip(&direct.total).zip(&shown.albedo);
            let inside = pairs.filter(|(_, albedo)| albedo[..3] == [0.0; 3]);
            inside.map(|((all, direct), _)| std::array::from_fn(|c| all[c] - direct[c])).collect()
        };
        let right = mirrored(&exact);
        assert!(right.len() > 400 && mean(&right) > 0.05 * mean(&exact.total));
        let mut last = (f64::MAX, 0);
        // The bounds are the errors in samples/igi/README.md plus a quarter.
        for (side, stated) in [(0.1, 0.125), (0.05, 0.097), (0.025, 0.014), (0.004f32, 1e-4)] {
            let cached = Settings { cache: side, ..settings.clone() };
            let shown = studio.render(&seen, &cached, 0);
            let error = apart(&mirrored(&shown), &right);
            println!("cells of {side}: {} cells, error {error:.5}", shown.cells);
            assert!(error < last.0 && shown.cells > last.1, "{side}");
            assert!(error < 1.25 * stated, "cells of {side}: error {error}");
            last = (error, shown.cells);
            let again = studio.render(&seen, &cached, 0);
            assert!(shown.total == again.total && shown.cells == again.cells, "cells do not repeat");
        }
        // With too many cells the picture is the same as without a cache.
        let few = Settings { cache: 0.05, cache_cells: 20, ..settings.clone() };
        assert!(studio.render(&seen, &few, 0).total == exact.total);
        // With picks and without a cache, each surface behind the mirror picks lights.
        let picks = Settings { picks: 16, ..settings.clone() };
        let few = Settings { cache: 0.05, cache_cells: 20, ..picks.clone() };
        assert!(studio.render(&seen, &few, 0).total == studio.render(&seen, &picks, 0).total);
        // The cells of a cache gather from all lights, also with picks.
        let cached = Settings { cache: 0.05, ..settings };
        let picked = studio.render(&seen, &Settings { picks: 16, ..cached.clone() }, 0);
        let in_mirror = |shown: &Shown| -> Vec<[f32; 4]> {
            let pairs = shown.total.iter().zip(&shown.albedo);
            pairs.filter(|(_, albedo)| albedo[..3] == [0.0; 3]).map(|(pixel, _)| *pixel).collect()
        };
        assert!(apart(&in_mirror(&picked), &in_mirror(&studio.render(&seen, &cached, 0))) < 1e-5);
    });
}

#[test]
fn picks_behind_a_mirror_have_the_full_sums_mean() {
    with_gpu(|gpu| {
        let (stage, seen) = mirrored();
        let mut studio = Studio::new(gpu, &stage.scene);
        let settings = Settings { bounces: 2, vpls: 200, candidates: 1, bound: 0.05, ..Settings::default() };
        let mut off = Vec::new();
        for seed in 1..=16 {
            let full = mean(&studio.render(&seen, &settings, seed).total);
            off.push(mean(&studio.render(&seen, &Settings { picks: 4, ..settings.clone() }, seed).total) / full - 1.0);
        }
        let (mean, deviation) = moments(&off);
        println!("off by {mean:.5} ± {deviation:.5}");
        assert!(mean.abs() < 4.0 * deviation && deviation > 0.0 && deviation < 0.01, "off by {mean} ± {deviation}");
    });
}

#[test]
fn every_barrier_of_its_graphs_matters() {
    with_gpu(|gpu| {
        let (stage, seen) = mirrored();
        for settings in [
            Settings { vpls: 20, picks: 2, compensation: 1, direct_samples: 1, ..Settings::default() },
            Settings { vpls: 20, cache: 0.1, direct_samples: 1, ..Settings::default() },
            Settings { vpls: 20, cache: 0.1, picks: 2, direct_samples: 1, ..Settings::default() },
        ] {
            let mut resident = Resident::new(gpu, &stage.scene).unwrap();
            let mut igi = Igi::new(gpu, &stage.scene, &resident, &settings).unwrap();
            let mut graph = Graph::new("igi");
            let pose = Pose::rest(&stage.scene);
            let handles = resident.frame_in(&mut graph, &stage.scene, &pose);
            let all = PictureSettings { igi: settings, ..Default::default() };
            let out =
                igi.picture(&mut graph, &stage.scene, &pose, &handles, &seen.fit_far(&handles.bounds()), &all).unwrap();
            graph.read_image(out.outputs.total);
            assert!(every_barrier_matters(&graph).barriers.len() > 30);
        }
    });
}

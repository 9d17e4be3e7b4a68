//! Precomputed transfer: closed forms, its slow twin, and the path tracer.

use crate::{
    prt_lab::{baked, closed, diffuse, picture, sampled, small, walls},
    tracer_lab::{Stage, matt, mean, render, view},
};
use glam::{Vec3, vec3};
use lucerna::{
    Stop,
    gpu::testing::with_gpu,
    scene::{Material, Scene},
    techniques::prt::{
        Baking, Direct, Mode, Sampled, Settings, Stored,
        check::{CheckOptions, LightErrors, RelativeError, check},
        solve,
    },
};

/// A room with a red wall and a block in it.
pub fn room() -> Scene {
    let mut stage = Stage::new();
    let white = stage.material(Material::diffuse("white", Vec3::splat(0.7)));
    let red = stage.material(Material::diffuse("red", vec3(0.7, 0.1, 0.1)));
    walls(&mut stage, [red, white, white, white, white, white]);
    stage.cuboid(white, vec3(0.3, 0.001, -0.6), vec3(0.9, 1.0, 0.2), false);
    stage.point(vec3(-0.4, 1.6, 0.4), Vec3::splat(5.0));
    stage.scene
}

#[test]
fn areas_of_samples_sum_to_the_surface_and_samples_are_apart() {
    with_gpu(|gpu| {
        let (_, Sampled { plan, samples, examples }) = sampled(gpu, &closed(Vec3::splat(0.5)), &small()).unwrap();
        let whole: f64 = samples.iter().map(|sample| f64::from(sample.area)).sum();
        assert!((whole / 24.0 - 1.0).abs() < 2e-3, "{whole}");
        assert!((samples.len() as f64 / 3000.0 - 1.0).abs() < 0.15, "{}", samples.len());
        for (index, a) in samples.iter().enumerate().step_by(7) {
            let near = |b: &&lucerna::shaders::types::PrtPoint| {
                Vec3::from(a.position).distance(b.position.into()) < 0.999 * plan.radius && a.side == b.side
            };
            assert!(!samples[index + 1..].iter().any(|b| near(&b)));
        }
        let inside = |place: &[f32; 3]| Vec3::from(*place).abs().max_element() <= 1.0;
        assert!(examples.len() == 200 && examples.iter().all(inside));
        // Even in space: the mean of a coordinate is 0, its mean square a third.
        for axis in 0..3 {
            let mean: f32 = examples.iter().map(|place| place[axis]).sum::<f32>() / 200.0;
            let square: f32 = examples.iter().map(|place| place[axis].powi(2)).sum::<f32>() / 200.0;
            assert!(mean.abs() < 0.15 && (square - 1.0 / 3.0).abs() < 0.08, "{mean} {square}");
        }
    });
}

#[test]
fn a_closed_box_has_all_scatterings_and_one_of_albedo_1_is_refused() {
    with_gpu(|gpu| {
        let stored = baked(gpu, &closed(Vec3::splat(0.5)), &small());
        let direct = vec![[1.0, 2.0, 0.0]; stored.samples.len()];
        let first = Settings { bounces: false, ..Settings::default() };
        for albedo in [0.3f32, 0.5, 0.9] {
            let albedos = vec![[albedo; 3]; stored.samples.len()];
            let found = solve::indirect(&stored, &albedos, &direct, &Settings::default()).unwrap();
            let wanted = albedo / (1.0 - albedo);
            for (channel, light) in [1.0, 2.0, 0.0].into_iter().enumerate() {
                let mean = found.iter().map(|e| e[channel]).sum::<f32>() / found.len() as f32;
                assert!((mean - light * wanted).abs() <= 0.01 * light * wanted, "{albedo}: {mean} {wanted}");
                let off = found.iter().map(|e| (e[channel] - light * wanted).abs()).fold(0.0, f32::max);
                assert!(off <= 0.05 * light * wanted, "{albedo}: {off}");
            }
            let once = solve::indirect(&stored, &albedos, &direct, &first).unwrap();
            assert!((once.iter().map(|e| e[0]).sum::<f32>() / once.len() as f32 / albedo - 1.0).abs() < 0.01);
        }
        let error =
            solve::indirect(&stored, &vec![[1.0; 3]; stored.samples.len()], &direct, &Settings::default()).unwrap_err();
        assert!(error.to_string().contains("no end") && error.exit_code() == 3, "{error}");
    });
}

#[test]
fn light_is_linear_none_is_none_and_only_a_mean_glows_with_the_light_off() {
    with_gpu(|gpu| {
        let scene = closed(Vec3::splat(0.5));
        for centred in [false, true] {
            let stored = baked(gpu, &scene, &Baking { centred, receivers: if centred { 0 } else { 24 }, ..small() });
            let count = stored.samples.len();
            let albedos = vec![[0.5; 3]; count];
            let light = |scale: f32, bend: f32| -> Vec<[f32; 3]> {
                (0..count).map(|i| [scale * (1.0 + (i as f32 * bend).sin()); 3]).collect()
            };
            let of = |direct: &[[f32; 3]], mean| {
                solve::indirect(&stored, &albedos, direct, &Settings { mean, ..Settings::default() }).unwrap()
            };
            let dark = of(&vec![[0.0; 3]; count], true);
            if centred {
                // The mean and what is taken away for it do not cancel: the ghost of a centred basis.
                assert!(dark.iter().any(|e| e[0].abs() > 1e-4));
                assert_ne!(dark, of(&vec![[0.0; 3]; count], false));
                continue;
            }
            assert!(dark.iter().all(|e| *e == [0.0; 3]));
            let (a, b) = (light(1.0, 0.1), light(0.5, 0.07));
            let both: Vec<[f32; 3]> = a.iter().zip(&b).map(|(a, b)| [a[0] + 2.0 * b[0]; 3]).collect();
            let (of_a, of_b, of_both) = (of(&a, true), of(&b, true), of(&both, true));
            for ((a, b), both) in of_a.iter().zip(&of_b).zip(&of_both) {
                assert!((a[0] + 2.0 * b[0] - both[0]).abs() < 1e-4 * both[0].abs());
            }
        }
    });
}

#[test]
fn light_goes_the_same_way_in_both_directions() {
    with_gpu(|gpu| {
        let stored = baked(gpu, &room(), &small());
        let count = stored.samples.len();
        let even = |cluster: usize| -> Vec<[f32; 3]> {
            let range = stored.plan.range(cluster);
            (0..count).map(|i| if range.contains(&i) { [1.0; 3] } else { [0.0; 3] }).collect()
        };
        let white = vec![[1.0; 3]; count];
        let once = Settings { bounces: false, ..Settings::default() };
        let sent = |from: usize| solve::indirect(&stored, &white, &even(from), &once).unwrap();
        let received = |light: &[[f32; 3]], at: usize| -> f32 {
            stored.plan.range(at).map(|i| light[i][0] * stored.samples[i].area).sum()
        };
        let lights: Vec<_> = (0..stored.plan.clusters.len()).map(sent).collect();
        let (mut apart, mut whole) = (0.0, 0.0);
        for a in 0..lights.len() {
            for b in 0..a {
                let (there, back) = (received(&lights[a], b), received(&lights[b], a));
                apart += (there - back).abs();
                whole += 0.5 * (there + back);
            }
        }
        assert!(apart < 0.03 * whole, "{apart} of {whole}");
    });
}

#[test]
fn pictures_have_the_light_of_the_path_tracer() {
    with_gpu(|gpu| {
        let scene = room();
        let stored = baked(gpu, &scene, &Baking { samples: 8000, cluster: 500, ..small() });
        let eye = view(vec3(1.6, 1.9, 1.2), vec3(-0.6, 0.7, -0.6), 75.0, [48, 36]);
        let truth = render(gpu, &scene, &eye, &matt(16), 256);
        let found = picture(gpu, &scene, &stored, &eye, &diffuse(), Mode::Total);
        for layer in ["direct", "indirect"] {
            for (found, wanted) in mean(&found, layer).into_iter().zip(mean(&truth, layer)) {
                assert!((found / wanted - 1.0).abs() < 0.04, "{layer}: {found}, {wanted} by the path tracer");
            }
        }
        // By blocks of 6×6 pixels.
        let [ours, theirs] = [&found, &truth].map(|layers| layers.layer("indirect").unwrap().data.clone());
        let block = |data: &[f32], x: usize, y: usize| -> f32 {
            (0..36).map(|i| data[3 * ((6 * y + i / 6) * 48 + 6 * x + i % 6)]).sum::<f32>() / 36.0
        };
        let (mut square, mut sum) = (0.0, 0.0);
        for (x, y) in (0..6).flat_map(|y| (0..8).map(move |x| (x, y))) {
            square += (block(&ours, x, y) - block(&theirs, x, y)).powi(2) / 48.0;
            sum += block(&theirs, x, y) / 48.0;
        }
        assert!(square.sqrt() < 0.06 * sum, "{} of {sum}", square.sqrt());
        // With the light of shadow maps, the direct light is exact, and the indirect light is the light of it.
        let mut mapped = diffuse();
        mapped.prt.direct = Direct::Maps;
        let mapped = picture(gpu, &scene, &stored, &eye, &mapped, Mode::Total);
        for (found, wanted) in mean(&mapped, "indirect").into_iter().zip(mean(&truth, "indirect")) {
            assert!((found / wanted - 1.0).abs() < 0.03, "{found} {wanted}");
        }
        for (found, wanted) in mean(&mapped, "direct").into_iter().zip(mean(&truth, "direct")) {
            assert!((found / wanted - 1.0).abs() < 0.02, "{found} {wanted}");
        }
    });
}

#[test]
fn a_check_finds_the_closed_form_and_what_one_scattering_leaves_out() {
    with_gpu(|gpu| {
        let (albedo, scene) = (0.5, closed(Vec3::splat(0.5)));
        let stored = baked(gpu, &scene, &small());
        let options = CheckOptions { lights: 8, samples: 400, paths: 256, seed: 3 };
        let of = |settings: Settings| check(gpu, &scene, &stored, &settings, options, &Stop::default()).unwrap();
        let diffuse = Settings { gloss: false, ..Settings::default() };
        let found = of(diffuse.clone());
        assert_eq!(found.len(), 8);
        // The same bits; strength and radius of lights do not count.
        assert_eq!(found, of(Settings { strength: 3.0, radius: 0.2, ..diffuse.clone() }));
        assert!(found.iter().all(|light| light.distance_to_surface > 0.0 && light.distance_to_surface < 1.0));
        // The light of a lamp that is no farther from a wall than samples are from each other is a matter of chance.
        let mean = |list: &[LightErrors], part: fn(&LightErrors) -> Option<RelativeError>| {
            let far: Vec<_> = list.iter().filter(|light| light.distance_to_surface > 0.1).collect();
            assert!(far.len() >= 4);
            far.iter().map(|light| part(light).unwrap().energy).sum::<f64>() / far.len() as f64
        };
        // All light of a box is ρ/(1 − ρ) of the direct light, that after one scattering is ρ: a share of 1 − ρ.
        let [all, once] = [true, false].map(|bounces| {
            let found = of(Settings { bounces, ..diffuse.clone() });
            [mean(&found, |light| light.indirect), mean(&found, |light| light.transferred)]
        });
        assert!(all.iter().all(|energy| (energy - 1.0).abs() < 0.02), "{all:?}");
        assert!(once.iter().all(|energy| (energy / (1.0 - albedo) - 1.0).abs() < 0.02), "{once:?}");
        assert!((mean(&found, |light| light.direct) - 1.0).abs() < 0.02, "{found:?}");
        // Light far from the walls of the box is smooth.
        let middle = found.iter().max_by(|a, b| a.distance_to_surface.total_cmp(&b.distance_to_surface)).unwrap();
        assert!(middle.transferred.unwrap().error < 0.05, "{middle:?}");
    });
}

#[test]
fn a_bake_knows_no_albedo_so_changed_colours_are_exact() {
    with_gpu(|gpu| {
        let (scene, mut other) = (room(), room());
        other.materials[1].base_color = vec3(0.1, 0.2, 0.8).extend(1.0);
        let few = Baking { samples: 1000, rays: 64, examples: 60, ..small() };
        let (one, two) = (baked(gpu, &scene, &few), baked(gpu, &other, &few));
        assert!(one.encode().unwrap() == two.encode().unwrap());
        let eye = view(vec3(1.6, 1.9, 1.2), vec3(-0.6, 0.7, -0.6), 75.0, [24, 18]);
        let [red, blue] =
            [&scene, &other].map(|scene| mean(&picture(gpu, scene, &one, &eye, &diffuse(), Mode::Total), "indirect"));
        assert!(blue[2] / blue[0] > 1.3 * red[2] / red[0], "{red:?} {blue:?}");
        // Other surfaces are another room.
        other.nodes.pop();
        other.nodes.pop();
        let difference = one.plan.difference(&other).unwrap();
        assert!(difference.contains("nodes"), "{difference}");
    });
}

#[test]
fn files_come_back_and_damage_is_named() {
    with_gpu(|gpu| {
        for baking in [small(), Baking::paper()] {
            let few = Baking { samples: 400, cluster: 100, rays: 32, examples: 40, directions: 100, ..baking };
            let stored = baked(gpu, &closed(Vec3::splat(0.5)), &few);
            let bytes = stored.encode().unwrap();
            assert!(Stored::decode(&bytes).unwrap() == stored);
            let summary = stored.summary();
            assert!(summary.lost < 1e-3 && (summary.area - 24.0).abs() < 0.2, "{summary:?}");
            assert!(few.receivers > 0 || (summary.kept - 0.2).abs() < 0.03, "{summary:?}");
            for cut in (0..bytes.len()).step_by(bytes.len() / 50) {
                assert_eq!(Stored::decode(&bytes[..cut]).unwrap_err().exit_code(), 3, "{cut}");
            }
            let mut damaged = bytes.clone();
            for at in [9, 40, bytes.len() / 2, bytes.len() - 3] {
                damaged[at] ^= 4;
                assert_eq!(Stored::decode(&damaged).unwrap_err().exit_code(), 3, "{at}");
                damaged[at] ^= 4;
            }
        }
    });
}

#[test]
fn scenes_without_surfaces_and_open_ones_are_refused() {
    with_gpu(|gpu| {
        let nothing = sampled(gpu, &Stage::new().scene, &small()).unwrap_err();
        assert!(nothing.to_string().contains("no surface"), "{nothing}");
        let mut stage = Stage::new();
        let wall = stage.material(Material::diffuse("wall", Vec3::ONE));
        stage.quad(wall, Vec3::ZERO, Vec3::X, Vec3::Z);
        stage.point(vec3(0.3, -0.2, 0.4), Vec3::ONE);
        let open = sampled(gpu, &stage.scene, &small()).unwrap_err();
        assert!(open.to_string().contains("--inside") && open.exit_code() == 3, "{open}");
    });
}

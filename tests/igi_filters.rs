//! Upsampling and the discontinuity buffer on known texels, interleaving as a whole, and the graphs of the program.

use crate::igi_lab::{Studio, mean, plain};
use crate::isr_lab::{Random, gbuffer, image, read};
use crate::tracer_lab::{Stage, flat_view};
use glam::{DVec3, Vec3, dvec3, vec3};
use lucerna::{
    gpu::testing::with_gpu,
    graph::{Extent, Graph, Runner, testing::every_barrier_matters},
    reference::isr_scene::{Buffers, Eye, Patch},
    resident::Resident,
    scene::{Material, Pose, View},
    techniques::igi::{Igi, Pattern, PictureSettings, Settings, filters},
};
use lucerna_scenes as builtin;

fn patch(corner: DVec3, a: DVec3, b: DVec3) -> Patch {
    Patch { corner, a, b, albedo: DVec3::splat(0.5), radiance: DVec3::ZERO }
}

/// A wall, and a second wall in front of its left half, both facing the camera: a step in depth without a change of the normal.
fn step(width: usize, height: usize) -> (Eye, Buffers) {
    let eye = Eye::look_at(dvec3(0.0, 0.0, 3.0), DVec3::ZERO, 0.9, 10.0, width, height);
    let far = patch(dvec3(-9.0, -9.0, -1.0), dvec3(18.0, 0.0, 0.0), dvec3(0.0, 18.0, 0.0));
    let near = patch(dvec3(-9.0, -9.0, 1.0), dvec3(9.0, 0.0, 0.0), dvec3(0.0, 18.0, 0.0));
    let buffers = Buffers::cast(&eye, &[far, near], 1);
    (eye, buffers)
}

#[test]
fn upsampling_is_a_partition_of_unity_within_bounds_and_does_not_leak() {
    with_gpu(|gpu| {
        let (width, height) = (50, 37);
        let (eye, buffers) = step(width, height);
        let mut random = Random(4);
        for (factor, range, sharpness) in [(2, 0.01, 8.0), (3, 0.0, 1.0), (4, 0.01, 1.0), (4, 0.0, 0.0)] {
            let settings = Settings {
                downsample: factor,
                upsample_range: range,
                upsample_normal: sharpness,
                ..Settings::default()
            };
            let small = Extent::new(width as u32, height as u32).div_ceil(factor);
            let mut graph = Graph::new("upsample");
            let g = gbuffer(&mut graph, &eye, &buffers);
            let even = vec![[2.5, 0.25, 7.0, 1.0]; small.pixels() as usize];
            let noise: Vec<[f32; 4]> = (0..small.pixels()).map(|_| random.texel()).collect();
            // Only the nearer wall is lit.
            let pixel_of = |i: u64| {
                let middle = |k: u64, most: usize| (k as usize * factor as usize + factor as usize / 2).min(most - 1);
                (middle(i % u64::from(small.width), width), middle(i / u64::from(small.width), height))
            };
            let near = |x: usize, y: usize| buffers.depth[y * width + x] < 0.3;
            let lit: Vec<[f32; 4]> = (0..small.pixels())
                .map(|i| {
                    [f32::from(u8::from({
                        let (x, y) = pixel_of(i);
                        near(x, y)
                    })); 4]
                })
                .collect();
            let guide = filters::guide(&mut graph, &g, &settings);
            let made = [("even", &even), ("noise", &noise), ("lit", &lit)].map(|(name, texels)| {
                let coarse = image(&mut graph, name, small, texels);
                filters::upsample(&mut graph, &g, guide, coarse, &settings).0
            });
            let [flat, mixed, parted] = read(gpu, graph, made);
            let (low, high) = noise.iter().fold((f32::MAX, f32::MIN), |(l, h), t| (l.min(t[0]), h.max(t[0])));
            let mut mixed_up = 0;
            for i in 0..width * height {
                for c in 0..3 {
                    assert!((flat[i][c] / even[0][c] - 1.0).abs() < 1e-5, "pixel {i}: {:?}", flat[i]);
                }
                assert!((low * 0.9999..=high * 1.0001).contains(&mixed[i][0]), "pixel {i}: {}", mixed[i][0]);
                let own = f32::from(u8::from(near(i % width, i / width)));
                mixed_up += usize::from((parted[i][0] - own).abs() > 1e-3);
            }
            // Without the depth term, as in the paper, the filter does not distinguish the walls.
            assert_eq!(
                range > 0.0,
                mixed_up == 0,
                "factor {factor}, range {range}: {mixed_up} pixels see the other wall"
            );
        }
    });
}

#[test]
fn a_pixel_without_a_texel_on_its_surface_takes_the_light_of_the_nearest_surface() {
    with_gpu(|gpu| {
        // A strip that no coarse texel sees, between a wall close behind it and a wall far behind it.
        let (width, height) = (24, 24);
        let eye = Eye::look_at(dvec3(0.0, 0.0, 3.0), DVec3::ZERO, 0.9, 10.0, width, height);
        let settings = Settings { downsample: 4, upsample_range: 0.01, upsample_normal: 8.0, ..Settings::default() };
        let small = Extent::new(6, 6);
        for close_at_left in [true, false] {
            let depth = |x: usize| match x {
                12 | 13 => 0.3,
                _ if (x < 12) == close_at_left => 0.3 * 1.08,
                _ => 0.3 * 1.3,
            };
            let all = width * height;
            let buffers = Buffers {
                depth: (0..all).map(|i| depth(i % width)).collect(),
                normal: vec![DVec3::Z; all],
                albedo: vec![DVec3::ONE; all],
                mask: vec![1.0; all],
                sender: vec![DVec3::ZERO; all],
                ..Buffers { width, height, factor: 1.0, ..Buffers::default() }
            };
            let mut graph = Graph::new("strip");
            let g = gbuffer(&mut graph, &eye, &buffers);
            let guide = filters::guide(&mut graph, &g, &settings);
            let lit: Vec<_> = (0..36).map(|i| [f32::from(u8::from((i % 6 < 3) == close_at_left)); 4]).collect();
            let coarse = image(&mut graph, "lit", small, &lit);
            let (fine, _) = filters::upsample(&mut graph, &g, guide, coarse, &settings);
            let [fine] = read(gpu, graph, [fine]);
            for (i, texel) in fine.iter().enumerate() {
                let own = f32::from(u8::from(matches!(i % width, 12 | 13) || (i % width < 12) == close_at_left));
                assert!((texel[0] - own).abs() < 1e-3, "{close_at_left}, pixel {i}: {texel:?} instead of {own}");
            }
        }
    });
}

#[test]
fn the_discontinuity_buffer_is_the_mean_of_the_tile_on_one_surface() {
    with_gpu(|gpu| {
        let (width, height) = (40, 24);
        let (eye, buffers) = step(width, height);
        let mut random = Random(8);
        for tile in [2u32, 3, 4] {
            let settings = Settings { interleave: tile, ..Settings::default() };
            let noise: Vec<[f32; 4]> = (0..width * height).map(|_| random.texel()).collect();
            let mut graph = Graph::new("join");
            let g = gbuffer(&mut graph, &eye, &buffers);
            let guide = filters::guide(&mut graph, &g, &settings);
            let texels = image(&mut graph, "noise", Extent::new(width as u32, height as u32), &noise);
            let joined = filters::join(&mut graph, guide, texels, &settings);
            let [found] = read(gpu, graph, [joined]);
            let tile = i64::from(tile);
            for y in 0..height as i64 {
                for x in 0..width as i64 {
                    let at = |x: i64, y: i64| (y * width as i64 + x) as usize;
                    let (mut sum, mut count) = (0.0, 0.0);
                    for v in y - (tile - 1) / 2..=y + tile / 2 {
                        for u in x - (tile - 1) / 2..=x + tile / 2 {
                            let inside = (0..width as i64).contains(&u) && (0..height as i64).contains(&v);
                            if inside && buffers.depth[at(u, v)] == buffers.depth[at(x, y)] {
                                sum += noise[at(u, v)][1];
                                count += 1.0;
                            }
                        }
                    }
                    let (found, expected) = (found[at(x, y)][1], sum / count);
                    assert!((found - expected).abs() < 1e-5, "tile {tile}, {x} {y}: {found} instead of {expected}");
                }
            }
        }
    });
}

#[test]
fn subsets_of_a_tile_sum_to_all_virtual_lights() {
    with_gpu(|gpu| {
        // A very small wall, far from the lit surfaces. All pixels have nearly the same position, so each must have the mean of the subsets.
        let mut stage = Stage::new();
        let white = stage.material(Material::diffuse("white", Vec3::splat(0.8)));
        stage.cuboid(white, Vec3::splat(-1.0), Vec3::ONE, true);
        stage.point(vec3(0.2, 0.1, 0.4), Vec3::splat(2.0));
        let mut studio = Studio::new(gpu, &stage.scene);
        let seen = flat_view(vec3(0.1, 0.2, 0.0), vec3(0.1, 0.2, -1.0), 1e-4, [24, 24]);
        let all = studio.render(&seen, &plain(181), 3).irradiance;
        for interleave in [2, 3, 4] {
            let found = studio.render(&seen, &Settings { interleave, ..plain(181) }, 3).irradiance;
            let mut apart = 0;
            // Only pixels with a complete tile around them.
            for i in (0..24 * 24).filter(|i| (2..22).contains(&(i % 24)) && (2..22).contains(&(i / 24))) {
                for c in 0..3 {
                    let off = (found[i][c] / all[i][c] - 1.0).abs();
                    assert!(off < 2e-3, "interleave {interleave}, pixel {i}: {} instead of {}", found[i][c], all[i][c]);
                    apart += usize::from(off > 0.0);
                }
            }
            assert!(apart > 0, "nothing was interleaved");
        }
    });
}

#[test]
fn an_irregular_tile_has_each_virtual_light_once_and_each_of_its_texels_light_from_all_sides() {
    with_gpu(|gpu| {
        // As above, all pixels have nearly the same position, so the mean over a tile is the sum over all virtual lights.
        let mut stage = Stage::new();
        let white = stage.material(Material::diffuse("white", Vec3::splat(0.8)));
        stage.cuboid(white, Vec3::splat(-1.0), Vec3::ONE, true);
        stage.point(vec3(0.2, 0.1, 0.4), Vec3::splat(2.0));
        let mut studio = Studio::new(gpu, &stage.scene);
        let side = 36;
        let seen = flat_view(vec3(0.1, 0.2, 0.0), vec3(0.1, 0.2, -1.0), 1e-4, [side as u32, side as u32]);
        let all = f64::from(studio.render(&seen, &plain(700), 3).irradiance[0][1]);
        for tile in [2, 3, 4, 6, 9, 12] {
            let settings = Settings { interleave: tile as u32, fused: true, ..plain(700) };
            let spread = |texels: &[[f32; 4]]| {
                let sum: f64 = texels.iter().map(|t| (f64::from(t[1]) / all - 1.0).powi(2)).sum();
                (sum / texels.len() as f64).sqrt()
            };
            let regular = spread(&studio.render(&seen, &settings, 3).gathered);
            let settings = Settings { pattern: Pattern::Irregular, ..settings };
            let found = studio.render(&seen, &settings, 3).gathered;
            for (left, top) in (0..side / tile).flat_map(|x| (0..side / tile).map(move |y| (x * tile, y * tile))) {
                let of_tile = (0..tile * tile).map(|i| found[(top + i / tile) * side + left + i % tile][1]);
                let mean = of_tile.map(f64::from).sum::<f64>() / (tile * tile) as f64;
                assert!((mean / all - 1.0).abs() < 2e-3, "tile {tile} at {left} {top}: {mean} instead of {all}");
            }
            let irregular = spread(&found);
            println!("tile {tile}: texels differ by {regular:.3} regular, {irregular:.3} irregular");
            if tile % 3 == 0 {
                assert!(irregular < 0.7 * regular, "tile {tile}: {irregular} beside {regular}");
            }
        }
    });
}

#[test]
fn a_speck_is_dimmed_to_what_its_neighbours_allow_and_nothing_else_changes() {
    with_gpu(|gpu| {
        let (width, height) = (30, 20);
        let (eye, buffers) = step(width, height);
        let settings = Settings { despeckle: 3.0, ..Settings::default() };
        let mut texels = vec![[1.0, 2.0, 0.5, 0.0]; width * height];
        let speck = 9 * width + 22;
        texels[speck] = [100.0, 200.0, 50.0, 0.0];
        // A texel with twice the luminance of its neighbours is within the limit.
        texels[3 * width + 5] = [2.0, 4.0, 1.0, 0.0];
        let mut graph = Graph::new("despeckle");
        let g = gbuffer(&mut graph, &eye, &buffers);
        let guide = filters::guide(&mut graph, &g, &settings);
        let coarse = image(&mut graph, "specks", Extent::new(width as u32, height as u32), &texels);
        let out = filters::smooth(&mut graph, &g, guide, coarse, &settings);
        let [found] = read(gpu, graph, [out]);
        for (i, (found, texel)) in found.iter().zip(&texels).enumerate() {
            for c in 0..3 {
                let expected = if i == speck { 3.0 * texels[0][c] } else { texel[c] };
                assert!((found[c] / expected - 1.0).abs() < 1e-4, "texel {i}: {found:?} instead of {expected}");
            }
        }
    });
}

#[test]
fn pixels_that_gather_for_themselves_have_what_full_resolution_has() {
    with_gpu(|gpu| {
        let scene = builtin::load("cornell").unwrap();
        let mut studio = Studio::new(gpu, &scene);
        let seen = View::of_camera(&scene, &Pose::rest(&scene), 0, [45, 38]).unwrap();
        let settings = Settings { bound: 0.02, ..plain(40) };
        let exact = studio.render(&seen, &settings, 3).irradiance;
        let mut same = |settings: Settings| {
            let found = studio.render(&seen, &settings, 3).irradiance;
            let like = |(a, b): &(&[f32; 4], &[f32; 4])| (0..3).all(|c| (a[c] - b[c]).abs() <= 1e-4 * b[c]);
            found.iter().zip(&exact).filter(like).count() as f64 / exact.len() as f64
        };
        let coarse = Settings { downsample: 4, ..settings };
        let (plain, some, all) = (
            same(coarse.clone()),
            same(Settings { refine: 0.2, ..coarse.clone() }),
            same(Settings { refine: 1.0, ..coarse }),
        );
        println!("as at full resolution: {plain:.3} of the pixels, refined {some:.3}, all of them {all:.3}");
        // In the middle of a wall all texels may match exactly, so even a share of 1 does not refine every pixel.
        assert!(plain < 0.3 && some > plain + 0.02 && all > 0.7, "{plain} {some} {all}");
    });
}

#[test]
fn what_the_bound_takes_is_put_back_where_pixels_gather_for_themselves() {
    with_gpu(|gpu| {
        let scene = builtin::load("cornell").unwrap();
        let mut studio = Studio::new(gpu, &scene);
        let seen = View::of_camera(&scene, &Pose::rest(&scene), 0, [45, 38]).unwrap();
        let bounded = Settings { bound: 0.12, bounces: 2, ..plain(60) };
        let whole = Settings { compensation: 8, ..bounded.clone() };
        let listed = Settings { downsample: 4, refine: 1.0, ..whole.clone() };
        let [bounded, whole, listed] = [bounded, whole, listed].map(|s| {
            let mut shown = studio.render(&seen, &s, 3);
            // The texels of the unlit lamp have irradiance only for their neighbours; the lamp itself reflects none.
            let unlit = shown.irradiance.iter_mut().zip(&shown.albedo).filter(|(_, albedo)| albedo[3] < 0.5);
            unlit.for_each(|(irradiance, _)| *irradiance = [0.0; 4]);
            mean(&shown.irradiance)
        });
        println!("{:.3} without compensation, {:.3} in refined pixels", bounded / whole, listed / whole);
        assert!(bounded < 0.93 * whole && (listed / whole - 1.0).abs() < 0.02, "{bounded} {whole} {listed}");
    });
}

#[test]
fn every_barrier_of_the_graphs_matters_and_two_runs_are_the_same() {
    with_gpu(|gpu| {
        let mut runner = Runner::new(gpu);
        for (name, settings) in [
            ("cornell-area", Settings { vpls: 12, direct_samples: 2, ..Settings::default() }),
            ("office", Settings { vpls: 24, direct_samples: 2, ..Settings::paper() }),
            (
                "office",
                Settings {
                    vpls: 120,
                    direct_samples: 1,
                    candidates: 2,
                    judges: 7,
                    downsample: 2,
                    scattered: true,
                    interleave: 6,
                    pattern: Pattern::Irregular,
                    fused: true,
                    smoothing: 2,
                    despeckle: 3.0,
                    refine: 0.05,
                    compensation: 1,
                    ..Settings::default()
                },
            ),
            ("figure", Settings { vpls: 24, direct_samples: 1, candidates: 2, history: 8, ..Settings::default() }),
            ("figure", Settings { vpls: 24, direct_samples: 1, indirect: false, ..Settings::default() }),
        ] {
            let scene = builtin::load(name).unwrap();
            let mut resident = Resident::new(gpu, &scene).unwrap();
            let mut igi = Igi::new(gpu, &scene, &resident, &settings).unwrap();
            let mut pictures = Vec::new();
            for _ in 0..2 {
                let mut graph = Graph::new("igi");
                // A frame with a history, in which the paths of the last frame are shot again.
                graph.frame = 1;
                let pose = Pose::playing(&scene, 0.25);
                let handles = resident.frame_in(&mut graph, &scene, &pose);
                let view = View::of_camera(&scene, &pose, 0, [32, 24]).unwrap().fit_far(&handles.bounds());
                let all = PictureSettings { igi: settings.clone(), ..Default::default() };
                let out = igi.picture(&mut graph, &scene, &pose, &handles, &view, &all).unwrap();
                let total = graph.read_image(out.outputs.total);
                if pictures.is_empty() {
                    let plan = every_barrier_matters(&graph);
                    assert!(plan.barriers.len() > 10, "{name}: {}", plan.list_passes());
                }
                let frame = runner.run(&graph).unwrap_or_else(|e| panic!("{name}: {e}"));
                let pixels = frame.image(total);
                assert!(pixels.to_f32().iter().flatten().all(|v| v.is_finite()), "{name}");
                pictures.push(pixels.bytes);
            }
            assert_eq!(pictures[0], pictures[1], "{name}: two runs differ");
        }
    });
}

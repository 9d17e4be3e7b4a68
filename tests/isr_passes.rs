//! The passes of image-space radiosity on the device, each against closed forms or the CPU reference.

use crate::isr_lab;
use crate::isr_lab::{Random, close, coarse, gbuffer, image, read, scene, view};
use glam::DVec3;
use lucerna::{
    gpu::testing::with_gpu,
    graph::{Extent, Format, Graph},
    passes::{bilateral, blur, downsample},
    reference::{
        isr::{self as cpu, Estimator, Gather, Pattern},
        isr_scene::{Buffers, Eye},
    },
    shaders,
};
use std::f64::consts::PI;

#[test]
fn form_factor_occlusion_and_sample_places() {
    with_gpu(|gpu| {
        let mut random = Random(1);
        let queries: Vec<_> = (0..500)
            .map(|_| {
                let (p, n) = (random.vector(), random.vector().normalize());
                let (x, m) = (random.vector() * 2.0, random.vector().normalize());
                (p, n, x, m, random.next(), random.next() * 0.1)
            })
            .collect();
        for (samples, rings, jittered) in [
            (24, 1, 1),
            (48, 1, 0),
            (80, 1, 1),
            (24, 0, 0),
            (48, 0, 1),
            (80, 0, 0),
            (120, 1, 0),
            (168, 0, 1),
            (224, 1, 1),
        ] {
            let mut graph = Graph::new("terms");
            let contents: Vec<_> = queries
                .iter()
                .map(|(p, n, x, m, radius, bias)| shaders::types::TermQuery {
                    p: p.as_vec3().to_array(),
                    p_normal: n.as_vec3().to_array(),
                    x: x.as_vec3().to_array(),
                    x_normal: m.as_vec3().to_array(),
                    radius: *radius as f32,
                    bias: *bias as f32,
                })
                .collect();
            let threads = 16 * samples.max(80);
            let answers = graph.buffer("answers", 16 * queries.len() as u64);
            let places = graph.buffer("places", 16 * 16 * u64::from(samples));
            let args = shaders::test::isr_terms::Args {
                queries: graph.buffer_from("queries", &contents),
                answers,
                places,
                push: shaders::test::isr_terms::Push { samples, rings, jittered, reach: 37.0, spread: 1.7 },
            };
            graph.compute(args, threads);
            let (answers, places) = (graph.read_buffer(answers), graph.read_buffer(places));
            let frame = lucerna::graph::Runner::new(gpu).run(&graph).unwrap();
            let found: Vec<[f32; 4]> = frame.buffer(answers);
            let mut lit = 0;
            for (found, (p, n, x, m, radius, bias)) in found.iter().zip(&queries) {
                let f = cpu::form_factor(*p, *n, *x, *m, 1.0);
                let o = cpu::occlusion(*p, *n, *x, *radius, *bias);
                let r2 = p.distance_squared(*x);
                let bounded = f * PI * r2 / (PI * r2 + radius);
                assert!((f64::from(found[0]) - f).abs() <= 1e-6 + 2e-4 * f, "{} {f}", found[0]);
                assert!((f64::from(found[1]) - o).abs() <= 1e-5 + 1e-3 * o, "{} {o}", found[1]);
                assert!((f64::from(found[2]) - bounded).abs() <= 1e-6 + 2e-4 * bounded);
                lit += usize::from(f > 0.0);
            }
            assert!(lit > 50, "only {lit} pairs see each other");

            let found: Vec<[f32; 4]> = frame.buffer(places);
            let pattern = if rings != 0 { Pattern::Rings { spread: 1.7 } } else { Pattern::Grid };
            for texel in 0..16 {
                let jitter = (jittered != 0).then(|| cpu::jitter(texel % 4, texel / 4));
                let expected = cpu::samples(pattern, samples as usize, 37.0, jitter);
                for (i, (at, area)) in expected.into_iter().enumerate() {
                    let place = found[texel * samples as usize + i];
                    // A sample that falls on the pixel itself covers nothing.
                    let off = (f64::from(place[0]) - at.x).abs() + (f64::from(place[1]) - at.y).abs();
                    assert!(off < 1e-3, "sample {i} of {samples}, rings {rings}: {place:?} instead of {at}");
                    assert!(
                        (f64::from(place[2]) - area).abs() <= 1e-3 * area + 1e-3,
                        "area {place:?} instead of {area}"
                    );
                }
            }
        }
    });
}

#[test]
fn downsampling_is_the_mean_of_four_with_repeated_border() {
    with_gpu(|gpu| {
        let (width, height) = (7, 5);
        let mut random = Random(2);
        let texels: Vec<[f32; 4]> = (0..35).map(|_| random.texel()).collect();
        let normals: Vec<[f32; 4]> =
            (0..35).map(|_| (random.vector().normalize() * 0.5 + 0.5).as_vec3().extend(0.0).to_array()).collect();
        // Two surfaces, a factor of three apart, and some background.
        let depths: Vec<[f32; 4]> = (0..35)
            .map(|i| [if i % 11 == 3 { 1.0 } else { [0.2, 0.6][i % 3 / 2] + 0.004 * random.next() as f32 }; 4])
            .collect();
        for aware in [false, true] {
            let mut graph = Graph::new("downsample");
            let extent = Extent::new(width, height);
            let buffers = Buffers::default();
            let eye = Eye::look_at(DVec3::ZERO, -DVec3::Z, 0.9, 10.0, 7, 5);
            let mut g =
                gbuffer(&mut graph, &eye, &Buffers { width: 1, height: 1, depth: vec![1.0], ..filled(buffers) });
            g.albedo = image(&mut graph, "texels", extent, &texels);
            g.normal = image(&mut graph, "normals", extent, &normals);
            g.depth = image(&mut graph, "depths", extent, &depths);
            let coarse = downsample::gbuffer(&mut graph, &g, 2, aware);
            let color = downsample::color(&mut graph, g.albedo, &g, 2, aware);
            assert_eq!(graph.extent(color), Extent::new(4, 3));
            let [albedo, normal, depth, color] = read(gpu, graph, [coarse.albedo, coarse.normal, coarse.depth, color]);

            let z: Vec<f64> = depths.iter().map(|d| f64::from(d[0])).collect();
            let takes = |z: f64, nearest: f64| !aware || (z < 1.0 && z <= nearest * 1.05) || nearest >= 1.0;
            let mean = |value: &dyn Fn(usize) -> f64| cpu::downsample(7, 5, &z, value, takes);
            for c in 0..4 {
                let expected = mean(&|i| f64::from(texels[i][c]));
                for (i, e) in expected.iter().enumerate() {
                    assert!((f64::from(albedo[i][c]) - e).abs() < 6e-4, "albedo texel {i}: {:?} {e}", albedo[i]);
                    if c < 3 {
                        assert!((f64::from(color[i][c]) - e).abs() < 6e-4, "color texel {i}: {:?} {e}", color[i]);
                    }
                }
            }
            // Alpha of the radiance: the mask of those taken over all four.
            let taken = |i: usize, nearest: f64| if takes(z[i], nearest) { f64::from(texels[i][3]) } else { 0.0 };
            for (i, found) in color.iter().enumerate() {
                let (x, y) = (2 * (i % 4), 2 * (i / 4));
                let (right, below) = ((x + 1).min(6), (y + 1).min(4));
                let four = [y * 7 + x, y * 7 + right, below * 7 + x, below * 7 + right];
                let nearest = four.iter().map(|&j| z[j]).fold(1.0, f64::min);
                let e = four.iter().map(|&j| taken(j, nearest)).sum::<f64>() / 4.0;
                assert!((f64::from(found[3]) - e).abs() < 6e-4, "color texel {i}: {found:?} {e}");
            }
            for c in 0..3 {
                let expected = mean(&|i| f64::from(normals[i][c]) * 2.0 - 1.0);
                for (i, e) in expected.iter().enumerate() {
                    assert!((f64::from(normal[i][c]) - e).abs() < 1e-3, "normal texel {i}: {:?} {e}", normal[i]);
                }
            }
            for (i, e) in mean(&|i| z[i]).iter().enumerate() {
                assert!((f64::from(depth[i][0]) - e).abs() < 1e-6, "depth texel {i}: {} {e}", depth[i][0]);
                if aware {
                    assert!(!(0.21..0.59).contains(e), "a depth between the surfaces: {e}");
                }
            }
        }
    });
}

/// One texel of background.
fn filled(buffers: Buffers) -> Buffers {
    Buffers {
        albedo: vec![DVec3::ZERO],
        mask: vec![0.0],
        normal: vec![DVec3::Y],
        sender: vec![DVec3::ZERO],
        factor: 1.0,
        ..buffers
    }
}

#[test]
fn gaussian_keeps_a_constant_and_is_the_two_dimensional_kernel() {
    with_gpu(|gpu| {
        let extent = Extent::new(23, 17);
        let mut random = Random(3);
        let noise: Vec<[f32; 4]> = (0..extent.pixels()).map(|_| random.texel()).collect();
        for radius in [1, 4, 16] {
            let mut graph = Graph::new("gaussian");
            let constant = image(&mut graph, "constant", extent, &vec![[0.25, 0.5, 2.0, 1.0]; noise.len()]);
            let constant = blur::gaussian(&mut graph, constant, radius);
            let noisy = image(&mut graph, "noise", extent, &noise);
            let noisy = blur::gaussian(&mut graph, noisy, radius);
            let [constant, noisy] = read(gpu, graph, [constant, noisy]);
            close(&constant, &vec![[0.25, 0.5, 2.0, 1.0]; noise.len()], 0..4, 0.0, 1e-3);
            for c in 0..4 {
                let channel: Vec<f64> = noise.iter().map(|t| f64::from(t[c])).collect();
                let expected = cpu::gaussian(23, 17, &channel, i64::from(radius), f64::from(radius) / 2.0);
                for (i, e) in expected.iter().enumerate() {
                    assert!(
                        (f64::from(noisy[i][c]) - e).abs() < 1e-3,
                        "radius {radius}, texel {i}: {:?} {e}",
                        noisy[i]
                    );
                }
            }
        }
    });
}

#[test]
fn bilateral_keeps_constants_and_does_not_leak() {
    with_gpu(|gpu| {
        let (width, height) = (33, 21);
        let eye = Eye::look_at(DVec3::ZERO, -DVec3::Z, 0.9, 10.0, width, height);
        // Left half at 2 m, right half at 4 m, both facing; one lone texel at 3 m; a column of background.
        let mut buffers = Buffers { width, height, factor: 1.0, ..Buffers::default() };
        let mut colors = Vec::new();
        for y in 0..height {
            for x in 0..width {
                let lone = (x, y) == (5, 7);
                let z = if lone {
                    0.3
                } else if x == 25 {
                    1.0
                } else if x < 16 {
                    0.2
                } else {
                    0.4
                };
                buffers.depth.push(z);
                buffers.normal.push(DVec3::Z);
                buffers.albedo.push(DVec3::ONE);
                buffers.mask.push(1.0);
                buffers.sender.push(DVec3::ZERO);
                let left = if z == 0.2 { 1.0 } else { 0.0 };
                colors.push([left, if lone { 9.0 } else { 0.0 }, 0.75, if x == 25 { 100.0 } else { 0.0 }]);
            }
        }
        let mut graph = Graph::new("bilateral");
        let (coarse, _) = coarse(&mut graph, &buffers);
        let view = graph.uniform(&view(&eye).uniform());
        let colors_image = image(&mut graph, "colors", Extent::new(33, 21), &colors);
        let blurred = bilateral::blur(&mut graph, colors_image, &coarse, view, 1, 6, 0.01);
        let [found] = read(gpu, graph, [blurred]);
        for (i, (f, c)) in found.iter().zip(&colors).enumerate() {
            // The half that is 1 stays 1, the half that is 0 stays 0, the lone texel keeps its 9 for itself, background
            // gives nothing, and the constant is constant.
            assert!((f[0] - c[0]).abs() < 1e-3, "texel {i}: leak over the step: {f:?}");
            assert!((f[1] - c[1]).abs() < 1e-2, "texel {i}: leak from or to the lone texel: {f:?}");
            assert!((f[2] - 0.75).abs() < 1e-3, "texel {i}: the constant changed: {f:?}");
            assert_eq!(f[3], c[3], "texel {i}: background leaks");
        }
        // It does blur within a surface: a step in colour on one plane becomes a ramp.
        let mut graph = Graph::new("bilateral on a plane");
        buffers.depth.fill(0.2);
        let (coarse, _) = isr_lab::coarse(&mut graph, &buffers);
        let view = graph.uniform(&isr_lab::view(&eye).uniform());
        let step: Vec<_> = (0..width * height).map(|i| [if i % width < 16 { 1.0 } else { 0.0 }; 4]).collect();
        let step = image(&mut graph, "step", Extent::new(33, 21), &step);
        let blurred = bilateral::blur(&mut graph, step, &coarse, view, 1, 6, 0.01);
        let [found] = read(gpu, graph, [blurred]);
        let row: Vec<f32> = found[10 * width..11 * width].iter().map(|t| t[0]).collect();
        assert!(row[15] > 0.5 && row[15] < 0.7 && row[18] > 0.05 && row[2] > 0.999, "{row:?}");
    });
}

#[test]
fn bilateral_weighs_creases_by_the_fourth_power_of_the_cosine() {
    with_gpu(|gpu| {
        let (width, height, radius) = (33usize, 5usize, 6i32);
        let eye = Eye::look_at(DVec3::ZERO, -DVec3::Z, 0.9, 10.0, width, height);
        // One plane whose right half has normals that lean by a cosine of 0.8, and are not of unit length.
        let normal = |x: usize| if x < 16 { DVec3::Z } else { 0.5 * DVec3::new(0.0, 0.6, 0.8) };
        let all = || 0..width * height;
        let buffers = Buffers {
            width,
            height,
            factor: 1.0,
            depth: vec![0.2; width * height],
            normal: all().map(|i| normal(i % width)).collect(),
            albedo: vec![DVec3::ONE; width * height],
            mask: vec![1.0; width * height],
            sender: vec![DVec3::ZERO; width * height],
        };
        let value = |x: usize| if x < 16 { 1.0f32 } else { 3.0 };
        let mut graph = Graph::new("creases");
        let (coarse, _) = coarse(&mut graph, &buffers);
        let view = graph.uniform(&view(&eye).uniform());
        let colors: Vec<[f32; 4]> = all().map(|i| [value(i % width); 4]).collect();
        let colors = image(&mut graph, "colors", Extent::new(width as u32, height as u32), &colors);
        // Distance from the leaning texels' planes does not count.
        let blurred = bilateral::blur(&mut graph, colors, &coarse, view, 1, radius as u32, 1e6);
        let [found] = read(gpu, graph, [blurred]);
        for x in 0..width {
            let (mut sum, mut weights) = (0.0, 0.0);
            for i in -radius..=radius {
                let at = x as i32 + i;
                if at < 0 || at >= width as i32 {
                    continue;
                }
                // Standard deviation: half the radius.
                let like = normal(x).normalize().dot(normal(at as usize).normalize());
                let w = (-f64::from(i * i) / (2.0 * 3.0 * 3.0)).exp() * like.powi(4);
                sum += w * f64::from(value(at as usize));
                weights += w;
            }
            let (found, expected) = (f64::from(found[2 * width + x][0]), sum / weights);
            assert!((found - expected).abs() < 3e-3, "texel {x}: {found} instead of {expected}");
        }
    });
}

#[test]
fn a_bounce_sends_what_was_sent_and_what_is_reflected() {
    with_gpu(|gpu| {
        let extent = Extent::new(9, 7);
        let mut random = Random(3);
        let [sender, albedo, gathered] = [(); 3].map(|()| (0..63).map(|_| random.texel()).collect::<Vec<_>>());
        for premultiplied in [0, 1] {
            let mut graph = Graph::new("bounce");
            let next = graph.image("next", Format::RGBA16F, extent);
            let args = shaders::isr::bounce::Args {
                sender: image(&mut graph, "sender", extent, &sender),
                albedo: image(&mut graph, "albedo", extent, &albedo),
                gathered: image(&mut graph, "gathered", extent, &gathered),
                next,
                spec: shaders::isr::bounce::Spec { premultiplied },
            };
            graph.compute(args, extent);
            let [found] = read(gpu, graph, [next]);
            let inputs = sender.iter().zip(&albedo).zip(&gathered);
            for (i, (((sent, albedo), gathered), found)) in inputs.zip(&found).enumerate() {
                let mask = if premultiplied == 1 { sent[3] } else { 1.0 };
                let right = (0..3).all(|c| (found[c] - sent[c] - albedo[c] * gathered[c] * mask).abs() < 2e-3);
                assert!(right && (found[3] - sent[3]).abs() < 1e-3, "texel {i}: {found:?} of {sent:?}");
            }
        }
    });
}

/// The same texels with depths and normals by chance: much stands in the way, and estimates of form factors sum to more than one.
fn rugged(smooth: &Buffers) -> Buffers {
    let mut random = Random(5);
    let mut buffers = smooth.clone();
    for i in 0..buffers.depth.len() {
        let far = random.next() < 0.3;
        buffers.depth[i] = if far { 0.05 + 0.45 * random.next() } else { 0.2 + 0.03 * random.next() };
        buffers.normal[i] = (random.vector() + 0.5 * DVec3::Z).normalize();
        buffers.albedo[i] = DVec3::ONE;
        buffers.sender[i] = DVec3::ONE;
        buffers.mask[i] = 1.0;
    }
    buffers
}

#[test]
fn estimates_of_form_factors_sum_to_two_at_most() {
    // What the twin must have tried: the bound is reached at some texels, and at others the sum lies between one and the bound.
    let (eye, patches) = scene(96, 72);
    let buffers = rugged(&Buffers::cast(&eye, &patches, 2));
    let settings = Gather {
        estimator: Estimator::Area,
        pattern: Pattern::Rings { spread: 1.5 },
        samples: 48,
        jitter: true,
        reach: 18.37,
        occlusion_reach: 9.13,
        occluder_radius: 1.7,
        occlusion_bias: 0.02,
        visibility_steps: 0,
        thickness: 0.0,
    };
    let sums: Vec<f64> = cpu::gather(&eye, &buffers, &settings).into_iter().map(|(light, _)| light.x).collect();
    let [between, bounded] = [1.05..1.95, 1.999..2.001].map(|range| sums.iter().filter(|s| range.contains(*s)).count());
    println!("{between} of {} between one and two, {bounded} at two", sums.len());
    assert!(between * 20 > sums.len() && bounded * 100 > sums.len(), "{between} and {bounded} of {}", sums.len());
    assert!(sums.iter().all(|s| *s < 2.001));
}

#[test]
fn gather_is_the_reference() {
    with_gpu(|gpu| {
        let (eye, patches) = scene(96, 72);
        let mut smooth = Buffers::cast(&eye, &patches, 2);
        let mut rough = rugged(&smooth);
        // What sends or receives in part, or not at all.
        for buffers in [&mut smooth, &mut rough] {
            for (i, mask) in buffers.mask.iter_mut().enumerate() {
                *mask *= [1.0, 0.5, 0.0, 0.8][(i / 3) % 4];
            }
        }
        let rings = Pattern::Rings { spread: 1.5 };
        // Even numbers of steps: no step falls on half a texel.
        for (buffers, estimator, pattern, samples, jitter, visibility_steps) in [
            (&smooth, Estimator::Area, rings, 48, true, 0),
            (&smooth, Estimator::Area, Pattern::Grid, 24, false, 0),
            (&smooth, Estimator::Paper, Pattern::Grid, 80, false, 0),
            (&smooth, Estimator::PaperCells, Pattern::Grid, 48, false, 0),
            (&smooth, Estimator::Paper, Pattern::Rings { spread: 2.0 }, 24, true, 0),
            (&smooth, Estimator::Area, rings, 24, true, 6),
            (&rough, Estimator::Area, rings, 48, true, 0),
            (&rough, Estimator::Area, rings, 24, true, 4),
        ] {
            let settings = Gather {
                estimator,
                pattern,
                samples,
                jitter,
                // No offset falls on half a texel, where rounding would decide.
                reach: 18.37,
                occlusion_reach: 9.13,
                occluder_radius: 1.7,
                occlusion_bias: 0.02,
                visibility_steps,
                thickness: 0.2,
            };
            let mut graph = Graph::new("gather");
            let (coarse, sender) = coarse(&mut graph, buffers);
            let extent = graph.extent(coarse.depth);
            let gathered = graph.image("gathered", Format::RGBA16F, extent);
            let seen = graph.image("seen", Format::RGBA16F, extent);
            let args = shaders::isr::gather::Args {
                view: graph.uniform(&view(&eye).uniform()),
                sender,
                albedo: coarse.albedo,
                normal: coarse.normal,
                depth: coarse.depth,
                gathered,
                seen,
                filtered: sender,
                mean_depth: coarse.depth,
                peeled: [coarse.depth; 3],
                push: shaders::isr::gather::Push {
                    reach: 18.37,
                    occlusion_reach: 9.13,
                    occluder_radius: 1.7,
                    occlusion_bias: 0.02,
                    spread: match pattern {
                        Pattern::Rings { spread } => spread as f32,
                        Pattern::Grid => 1.0,
                    },
                    thickness: 0.2,
                    factor: 2.0,
                    peeled_scale: 1.0,
                },
                spec: shaders::isr::gather::Spec {
                    samples: samples as u32,
                    area_estimator: (estimator == Estimator::Area).into(),
                    rings: matches!(pattern, Pattern::Rings { .. }).into(),
                    jitter: jitter.into(),
                    indirect: 1,
                    occlusion: 1,
                    visibility_steps: visibility_steps as u32,
                    paper_cells: (estimator == Estimator::PaperCells).into(),
                    prefilter: 0,
                    by_depth: 0,
                    peeled: 0,
                },
            };
            graph.compute(args, extent);
            let [found] = read(gpu, graph, [gathered]);
            let expected: Vec<_> = cpu::gather(&eye, buffers, &settings)
                .into_iter()
                .map(|(light, hidden)| light.as_vec3().extend(hidden as f32).to_array())
                .collect();
            // Offsets that round differently in single precision move a sample by one texel: a few texels may differ.
            let brightest = expected.iter().map(|e| e[0]).fold(0.0, f32::max);
            assert!(brightest > 1e-4, "nothing gathered: {brightest}");
            let off = |f: &[f32; 4], e: &[f32; 4]| {
                let light = (0..3).any(|c| (f[c] - e[c]).abs() > 0.002 * brightest + 0.01 * e[c]);
                light || (f[3] - e[3]).abs() > 0.002 + 0.01 * e[3]
            };
            let different = found.iter().zip(&expected).filter(|(f, e)| off(f, e)).count();
            assert!(different * 100 <= found.len(), "{settings:?}: {different} of {} differ", found.len());
            if visibility_steps > 0 {
                let open = cpu::gather(&eye, buffers, &Gather { visibility_steps: 0, ..settings });
                let shaded = open.iter().zip(&expected).filter(|(o, e)| o.0.x - f64::from(e[0]) > 0.02 * o.0.x).count();
                assert!(shaded * 20 > found.len(), "something hides senders at {shaded} of {} texels", found.len());
            }
        }
    });
}

//! The passes of image-space radiosity on the device, each against closed forms or the CPU reference.

mod isr_lab;

use glam::{DVec3, Vec3, dvec3, vec3};
use isr_lab::{close, coarse, gbuffer, image, lights, point, read, view};
use lucerna::{
    gpu::testing::with_gpu,
    graph::{Extent, Format, Graph},
    passes::{
        ambient::Irradiance,
        bilateral, blur,
        compose::{self, Compose},
        direct::{self, Direct},
        downsample::{self, Coarse},
    },
    reference::{
        isr::{self as cpu, Estimator, Gather, Pattern},
        isr_scene::{Buffers, Eye, Patch},
    },
    shaders,
};
use std::f64::consts::PI;

/// Reproducible numbers in 0..1.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 40) as f64 / (1u64 << 24) as f64
    }

    fn vector(&mut self) -> DVec3 {
        dvec3(self.next(), self.next(), self.next()) * 2.0 - 1.0
    }

    fn texel(&mut self) -> [f32; 4] {
        [self.next() as f32, self.next() as f32, self.next() as f32, self.next() as f32]
    }
}

fn patch(corner: DVec3, a: DVec3, b: DVec3, albedo: DVec3, radiance: DVec3) -> Patch {
    Patch { corner, a, b, albedo, radiance }
}

/// Floor, lit wall, and a small block's top between them and the camera; background above.
fn scene(width: usize, height: usize) -> (Eye, Vec<Patch>) {
    let (red, white) = (dvec3(0.7, 0.1, 0.1), dvec3(0.6, 0.6, 0.6));
    let floor = patch(dvec3(-1.0, 0.0, 0.0), dvec3(2.0, 0.0, 0.0), dvec3(0.0, 0.0, -2.0), white, white * 0.2);
    let wall = patch(dvec3(-1.0, 0.0, -2.0), dvec3(2.0, 0.0, 0.0), dvec3(0.0, 1.0, 0.0), red, dvec3(1.0, 0.4, 0.1));
    let block = patch(dvec3(-0.3, 0.4, -0.4), dvec3(0.6, 0.0, 0.0), dvec3(0.0, 0.0, -0.5), white, white);
    let eye = Eye::look_at(dvec3(0.3, 1.5, 2.0), dvec3(0.0, 0.3, -1.3), 0.9, 10.0, width, height);
    (eye, vec![floor, wall, block])
}

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
        for (samples, rings, jittered) in [(24, 1, 1), (48, 1, 0), (80, 1, 1), (24, 0, 0), (48, 0, 1), (80, 0, 0)] {
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
            let threads = 16 * 80;
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
fn gather_is_the_reference() {
    with_gpu(|gpu| {
        let (eye, patches) = scene(96, 72);
        let buffers = Buffers::cast(&eye, &patches, 2);
        for (estimator, pattern, samples, jitter) in [
            (Estimator::Area, Pattern::Rings { spread: 1.5 }, 48, true),
            (Estimator::Area, Pattern::Grid, 24, false),
            (Estimator::Paper, Pattern::Grid, 80, false),
            (Estimator::PaperCells, Pattern::Grid, 48, false),
            (Estimator::Paper, Pattern::Rings { spread: 2.0 }, 24, true),
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
            };
            let mut graph = Graph::new("gather");
            let (coarse, sender) = coarse(&mut graph, &buffers);
            let extent = graph.extent(coarse.depth);
            let gathered = graph.image("gathered", Format::RGBA16F, extent);
            let args = shaders::isr::gather::Args {
                view: graph.uniform(&view(&eye).uniform()),
                sender,
                albedo: coarse.albedo,
                normal: coarse.normal,
                depth: coarse.depth,
                gathered,
                filtered: sender,
                push: shaders::isr::gather::Push {
                    reach: 18.37,
                    occlusion_reach: 9.13,
                    occluder_radius: 1.7,
                    occlusion_bias: 0.02,
                    spread: match pattern {
                        Pattern::Rings { spread } => spread as f32,
                        Pattern::Grid => 1.0,
                    },
                    thickness: 0.0,
                    factor: 2.0,
                },
                spec: shaders::isr::gather::Spec {
                    samples: samples as u32,
                    area_estimator: (estimator == Estimator::Area).into(),
                    rings: matches!(pattern, Pattern::Rings { .. }).into(),
                    jitter: jitter.into(),
                    indirect: 1,
                    occlusion: 1,
                    visibility_steps: 0,
                    paper_cells: (estimator == Estimator::PaperCells).into(),
                    prefilter: 0,
                },
            };
            graph.compute(args, extent);
            let [found] = read(gpu, graph, [gathered]);
            let expected: Vec<_> = cpu::gather(&eye, &buffers, &settings)
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
            assert!(different * 100 <= found.len(), "{estimator:?} {pattern:?}: {different} of {} differ", found.len());
        }
    });
}

#[test]
fn composing_is_equations_27_to_29() {
    with_gpu(|gpu| {
        // A full-resolution plane with a step: columns 0..8 at 2 m, the others at 4 m. Coarse texels on the same surfaces.
        let (width, height) = (16, 8);
        let eye = Eye::look_at(DVec3::ZERO, -DVec3::Z, 0.9, 10.0, width, height);
        let mut random = Random(5);
        let mut fine = Buffers { width, height, factor: 1.0, ..Buffers::default() };
        for i in 0..width * height {
            fine.depth.push(if i % width < 7 { 0.2 } else { 0.4 });
            fine.normal.push(DVec3::Z);
            fine.albedo.push(dvec3(0.5, 0.25, 0.75));
            fine.mask.push(1.0);
            fine.sender.push(DVec3::ZERO);
        }
        let (cw, ch) = (8usize, 4usize);
        let coarse_depth: Vec<f32> = (0..cw * ch).map(|i| if i % cw < 4 { 0.2 } else { 0.4 }).collect();
        let gathered: Vec<[f32; 4]> = (0..cw * ch).map(|_| random.texel()).collect();
        let direct: Vec<[f32; 4]> = (0..width * height).map(|_| random.texel()).collect();
        for (plane, tint, occlude_ambient) in [(false, false, false), (true, true, true)] {
            let mut graph = Graph::new("compose");
            let g = gbuffer(&mut graph, &eye, &fine);
            let ambient = Irradiance::constant(Vec3::splat(if tint { 0.4 } else { 0.0 })).upload(&mut graph);
            let coarse_extent = Extent::new(cw as u32, ch as u32);
            let depth: Vec<_> = coarse_depth.iter().map(|z| [*z; 4]).collect();
            let depth = image(&mut graph, "coarse depth", coarse_extent, &depth);
            let normal = image(&mut graph, "coarse normal", coarse_extent, &vec![[0.0, 0.0, 1.0, 0.0]; cw * ch]);
            let coarse = image(&mut graph, "gathered", coarse_extent, &gathered);
            let direct_image = image(&mut graph, "direct", Extent::new(16, 8), &direct);
            let choices = Compose { factor: 2, plane, epsilon: 1e-3, tint, occlude_ambient, k_ssao: 0.6, k_isr: 0.7 };
            let sum = compose::sum(
                &mut graph,
                &g,
                ambient,
                direct_image,
                coarse,
                &Coarse { albedo: depth, normal, depth },
                &choices,
            );
            let [total, indirect, open] = read(gpu, graph, [sum.total, sum.indirect, sum.accessibility]);
            for y in 0..height {
                for x in 0..width {
                    let i = y * width + x;
                    let (cx, cy) = ((x as f64 + 0.5) / 2.0 - 0.5, (y as f64 + 0.5) / 2.0 - 0.5);
                    let corner = |dx: f64, dy: f64| {
                        let x = (cx.floor() + dx).clamp(0.0, cw as f64 - 1.0) as usize;
                        let y = (cy.floor() + dy).clamp(0.0, ch as f64 - 1.0) as usize;
                        y * cw + x
                    };
                    let four = [corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0), corner(1.0, 1.0)];
                    let channel = |c: usize| {
                        let samples = four.map(|j| {
                            let step = (fine.depth[i] - f64::from(coarse_depth[j])).abs();
                            let off = if plane { step / fine.depth[i] } else { step };
                            Some((f64::from(gathered[j][c]), off))
                        });
                        cpu::upsample(samples, cx - cx.floor(), cy - cy.floor(), 1e-3)
                    };
                    let light = dvec3(channel(0), channel(1), channel(2));
                    let accessible = 1.0 - channel(3).clamp(0.0, 1.0);
                    let direct = dvec3(direct[i][0].into(), direct[i][1].into(), direct[i][2].into());
                    let expected = if tint {
                        let around = fine.albedo[i] * 0.4 * (accessible + 1.0 - 0.6).clamp(0.0, 1.0);
                        direct + around + light * fine.albedo[i] * 0.7
                    } else {
                        cpu::sum(direct, accessible, light, 0.6, 0.7)
                    };
                    for c in 0..3 {
                        assert!(
                            (f64::from(total[i][c]) - expected[c]).abs() < 2e-3,
                            "({x}, {y}): {:?} {expected}",
                            total[i]
                        );
                    }
                    assert!((f64::from(open[i][0]) - accessible).abs() < 1e-3);
                    assert!(indirect[i][0] <= total[i][0] + 1e-3);
                }
            }
        }
    });
}

#[test]
fn upsampling_falls_back_to_the_nearest_in_depth() {
    with_gpu(|gpu| {
        let eye = Eye::look_at(DVec3::ZERO, -DVec3::Z, 0.9, 10.0, 4, 4);
        let fine = Buffers {
            width: 4,
            height: 4,
            depth: vec![0.2; 16],
            albedo: vec![DVec3::ONE; 16],
            mask: vec![1.0; 16],
            normal: vec![DVec3::Z; 16],
            sender: vec![DVec3::ZERO; 16],
            factor: 1.0,
        };
        let mut graph = Graph::new("fallback");
        let g = gbuffer(&mut graph, &eye, &fine);
        let ambient = Irradiance::default().upload(&mut graph);
        // No coarse texel is near 0.2; 0.5 is the nearest.
        let extent = Extent::new(2, 2);
        let depth = image(&mut graph, "depth", extent, &[[0.7; 4], [0.5; 4], [0.9; 4], [1.0; 4]]);
        let normal = image(&mut graph, "normal", extent, &[[0.0, 0.0, 1.0, 0.0]; 4]);
        let values = [[1.0, 0.0, 0.0, 0.0], [2.0, 0.0, 0.0, 0.0], [3.0, 0.0, 0.0, 0.0], [4.0, 0.0, 0.0, 0.0]];
        let coarse = image(&mut graph, "gathered", extent, &values);
        let direct = image(&mut graph, "direct", Extent::new(4, 4), &[[0.0; 4]; 16]);
        let choices = Compose {
            factor: 2,
            plane: false,
            epsilon: 1e-3,
            tint: false,
            occlude_ambient: false,
            k_ssao: 0.5,
            k_isr: 1.0,
        };
        let sum =
            compose::sum(&mut graph, &g, ambient, direct, coarse, &Coarse { albedo: depth, normal, depth }, &choices);
        let [total] = read(gpu, graph, [sum.total]);
        // The four middle pixels lie between all four coarse texels.
        for i in [5, 6, 9, 10] {
            assert_eq!(total[i][0], 2.0, "pixel {i}");
        }
    });
}

#[test]
fn direct_light_by_the_inverse_square_and_by_equation_16() {
    with_gpu(|gpu| {
        let (eye, patches) = scene(32, 24);
        let mut fine = Buffers::cast(&eye, &patches, 1);
        fine.albedo.fill(dvec3(0.8, 0.4, 0.2));
        fine.sender.fill(DVec3::ZERO);
        let lamp = vec3(0.4, 1.2, -0.3);
        let light_with = |paper_law: bool, intensity: Vec3, kinds: &[shaders::types::Light]| {
            let mut graph = Graph::new("direct");
            let g = gbuffer(&mut graph, &eye, &fine);
            let mut all = vec![point(lamp, intensity)];
            all.extend_from_slice(kinds);
            let lights = lights(&mut graph, &all);
            let choices = Direct { paper_law, specular: false, light_radius: 2.0, light_power: 0.9 };
            let lit = direct::light(&mut graph, &g, lights, &choices);
            read(gpu, graph, [lit.direct, lit.diffuse])
        };
        let expect = |paper_law: bool, x: usize, y: usize| {
            let i = fine.at(x, y);
            if fine.depth[i] >= 1.0 {
                return DVec3::ZERO;
            }
            let to = lamp.as_dvec3() - fine.position(&eye, x, y);
            let cosine = fine.normal[i].dot(to.normalize()).max(0.0);
            let arriving = if paper_law {
                // Colours relative to the brightest channel of the brightest light.
                DVec3::new(1.0, 0.5, 0.25) * 0.9 * cpu::paper_attenuation(to.length(), 2.0)
            } else {
                DVec3::new(8.0, 4.0, 2.0) / to.length_squared() / PI
            };
            arriving * cosine * fine.albedo[i]
        };
        for paper_law in [false, true] {
            let [found, diffuse] = light_with(paper_law, vec3(8.0, 4.0, 2.0), &[]);
            assert_eq!(found, diffuse);
            let expected: Vec<[f32; 4]> = (0..24)
                .flat_map(|y| (0..32).map(move |x| (x, y)))
                .map(|(x, y)| expect(paper_law, x, y).as_vec3().extend(1.0).to_array())
                .collect();
            assert!(expected.iter().any(|e| e[0] > 0.1));
            close(&found, &expected, 0..3, 1e-3, 3e-3);
        }
        // Twice the light, twice the radiance; no light, none.
        let [once, _] = light_with(false, vec3(8.0, 4.0, 2.0), &[]);
        let [twice, _] = light_with(false, vec3(16.0, 8.0, 4.0), &[]);
        let doubled: Vec<[f32; 4]> = once.iter().map(|t| t.map(|c| 2.0 * c)).collect();
        close(&twice, &doubled, 0..3, 1e-4, 2e-3);
        let [none, _] = light_with(false, Vec3::ZERO, &[]);
        assert!(none.iter().all(|t| t[..3] == [0.0; 3]));
        // A directional light adds E ρ cos / π.
        let sun = shaders::types::Light {
            kind: shaders::consts::LIGHT_DIRECTIONAL,
            direction: [0.0, -0.6, -0.8],
            intensity: [3.0; 3],
            spot_offset: 1.0,
            ..Default::default()
        };
        let [sunny, _] = light_with(false, Vec3::ZERO, &[sun]);
        for (i, t) in sunny.iter().enumerate().filter(|(i, _)| fine.depth[*i] < 1.0) {
            let cosine = fine.normal[i].dot(dvec3(0.0, 0.6, 0.8)).max(0.0);
            assert!((f64::from(t[0]) - 3.0 * 0.8 * cosine / PI).abs() < 2e-3, "texel {i}: {t:?}");
        }
    });
}

//! Operators that solve an equation for the whole picture (Fattal, Mantiuk), and the photoreceptors, whose statistics are the picture's:
//! the solver against exact solutions, the device against the CPU twin in all sizes, residuals, the same bits each time.

use lucerna::{
    gpu::{Gpu, ImageDesc, OwnedImage, Region, testing::with_gpu},
    graph::{Format, Graph, Image, Runner},
    reference::tonemap::{
        self as twin,
        plane::Plane,
        solve::{self as twin_solve, Edges as TwinEdges},
    },
    shaders::types::TonemapSolve,
    techniques::tonemap::{
        Operator, Settings, Still, apply,
        solve::{self, Edges, Wanted},
    },
};

/// Largest |b − Ax| / |b| that the operators may leave, in f32.
const RESIDUAL: f32 = 5e-5;

const NEW: [Operator; 3] = [Operator::ReinhardDevlin, Operator::Fattal, Operator::Mantiuk];
const SOLVED: [Operator; 2] = [Operator::Fattal, Operator::Mantiuk];

fn with(operator: Operator) -> Settings {
    Settings { operator, ..Settings::default() }
}

/// Five decades of hills, steps and noise in colour; some pixels are black, one is hot.
fn picture(width: u32, height: u32) -> Vec<[f32; 4]> {
    let mut state = width.wrapping_mul(31).wrapping_add(height);
    let mut next = move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32
    };
    let pixel = |i: u32| {
        let (x, y) = ((i % width) as f32, (i / width) as f32);
        let step = if (x / 13.0).floor() as i32 % 3 == 0 { 1.5 } else { 0.0 };
        let light = 10f32.powf((x / 17.0).sin() + (y / 11.0).cos() + step + 0.2 * next());
        let dark = next() < 0.01;
        let [r, g, b] = [1.0, 0.7, 0.4].map(|c| if dark { 0.0 } else { light * c * (0.5 + next()) });
        [r, g, b, 1.0]
    };
    let mut pixels: Vec<[f32; 4]> = (0..width * height).map(pixel).collect();
    let middle = pixels.len() / 2;
    pixels[middle] = [3e4, 2e4, 1e4, 1.0];
    pixels
}

fn rgb(pixels: &[[f32; 4]]) -> Vec<[f32; 3]> {
    pixels.iter().map(|p| [p[0], p[1], p[2]]).collect()
}

fn upload(gpu: &Gpu, graph: &mut Graph, plane: &Plane) -> Image {
    let values: Vec<f32> = plane.values.iter().map(|v| *v as f32).collect();
    let desc = ImageDesc::new(Format::R32F.to_vk(), plane.width as u32, plane.height as u32);
    let region = Region { mip: 0, layer: 0, bytes: bytemuck::cast_slice(&values) };
    graph.import_image(&OwnedImage::with_contents(gpu, "given", desc, &[region]).unwrap())
}

/// Solution by the device less its mean, and the state of the solver.
fn solved(gpu: &Gpu, levels: &[(Option<TwinEdges>, TwinEdges)]) -> (Plane, TonemapSolve) {
    let mut graph = Graph::new("solve");
    let mut edges = |edges: &TwinEdges| Edges {
        across: upload(gpu, &mut graph, &edges.across),
        down: upload(gpu, &mut graph, &edges.down),
    };
    let flows = levels.iter().map(|(_, flow)| edges(flow)).collect();
    let weights = levels.iter().filter_map(|(weights, _)| weights.as_ref()).map(&mut edges).collect();
    let solution = solve::solve(&mut graph, &Wanted { flows, weights });
    let (values, state) = (graph.read_image(solution.values), graph.read_buffer(solution.state));
    let frame = Runner::new(gpu).run(&graph).unwrap();
    let state: TonemapSolve = frame.buffer(state)[0];
    let found: Vec<f32> = bytemuck::pod_collect_to_vec(&frame.image(values).bytes);
    let mean = found.iter().map(|v| f64::from(*v)).sum::<f64>() / found.len() as f64;
    let Plane { width, height, .. } = levels[0].1.across;
    (Plane { width, height, values: found.iter().map(|v| f64::from(*v) - mean).collect() }, state)
}

fn most(a: &Plane, b: &Plane) -> f64 {
    a.values.iter().zip(&b.values).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn the_solver_finds_exact_cosines_of_any_size() {
    use std::f64::consts::PI;
    with_gpu(|gpu| {
        for (width, height) in [(16, 16), (17, 33), (1, 300), (513, 2), (129, 65), (300, 211), (257, 256)] {
            for (m, n) in [(1, 0), (1, 1), (0, 1), (width - 1, 0), (width / 3, height / 2)] {
                let wave = |i: usize, m: usize, count: usize| (PI * m as f64 * (i as f64 + 0.5) / count as f64).cos();
                let cosine = Plane::from_fn(width, height, |x, y| wave(x, m, width) * wave(y, n, height));
                if (m == 0 || width == 1) && (n == 0 || height == 1) {
                    continue;
                }
                // The right side that belongs to it is its eigenvalue times itself: the cosine's own differences.
                let (found, state) = solved(gpu, &[(None, TwinEdges::differences(&cosine))]);
                let error = most(&found, &cosine);
                println!("{width}×{height}, {m} {n}: {error:e}, {} steps", state.steps);
                assert!(error < 2e-4 && state.steps <= 16, "{width}×{height}, {m} {n}: {error:e} {}", state.steps);
            }
        }
    });
}

/// Wanted differences that no picture has, with weights over a decade, on all levels of a pyramid.
#[test]
fn weighted_pyramids_are_solved_as_by_the_slow_solver() {
    with_gpu(|gpu| {
        for (width, height) in [(1, 2), (3, 2), (5, 1), (31, 17), (64, 33), (70, 41)] {
            let mut level = Plane::from_fn(width, height, |_, _| 0.0);
            let mut levels = Vec::new();
            loop {
                let k = levels.len() as f64;
                let noise = |a: (usize, usize), b: (usize, usize), seed: f64| {
                    ((a.0 * 12 + a.1 * 79 + b.0 * 37 + b.1 * 5) as f64 + seed + k).sin()
                };
                let weights = TwinEdges::of(level.width, level.height, |a, b| 10f64.powf(0.5 * noise(a, b, 0.3)));
                let flow =
                    TwinEdges::of(level.width, level.height, |a, b| noise(a, b, 2.0)).with(&weights, |g, w| g * w);
                levels.push((weights, flow));
                if level.width.max(level.height) < 4 {
                    break;
                }
                level = twin_solve::halved(&level);
            }
            let slow = twin_solve::solve(&levels);
            let given: Vec<_> = levels.into_iter().map(|(weights, flow)| (Some(weights), flow)).collect();
            let (found, state) = solved(gpu, &given);
            let scale = slow.range().map_or(0.0, |(low, high)| high - low);
            let error = most(&found, &slow);
            println!("{width}×{height}: {error:e} of {scale}, {} steps, residual {:e}", state.steps, state.residual);
            assert!(error < 1e-4 * scale && state.residual < RESIDUAL, "{width}×{height}: {error:e} of {scale}");
            // Steps that are not conjugate to those before need more.
            assert!(state.steps <= 18, "{width}×{height}: {} steps", state.steps);
        }
    });
}

#[test]
fn every_size_is_as_by_the_definition() {
    with_gpu(|gpu| {
        for operator in NEW {
            for (width, height) in [(1, 1), (2, 1), (1, 7), (40, 1), (2, 2), (3, 5), (33, 21), (70, 65), (64, 97)] {
                let pixels = picture(width, height);
                let found = apply(gpu, width, height, &pixels, None, &with(operator)).unwrap();
                let wanted = twin::tonemap(width, height, &rgb(&pixels), &with(operator));
                let mut far = 0.0f32;
                for (found, wanted) in rgb(&found.pixels).as_flattened().iter().zip(wanted.as_flattened()) {
                    far = far.max((found - wanted).abs() / wanted.abs().max(0.01));
                }
                println!("{operator:?} {width}×{height}: {far:e}, residual {:?}", found.residual);
                assert!(far < 2e-3, "{operator:?} {width}×{height}: {far:e}");
                assert_eq!(found.residual.is_some(), SOLVED.contains(&operator));
            }
        }
    });
}

#[test]
fn solutions_leave_next_to_nothing_and_are_the_same_bits_each_time() {
    with_gpu(|gpu| {
        for operator in SOLVED {
            for (width, height) in [(1, 1), (300, 1), (257, 129), (400, 300)] {
                let pixels = picture(width, height);
                let mut still = Still::new(gpu, &with(operator)).unwrap();
                let mut once = || still.map(width, height, pixels.clone(), None, None).unwrap();
                let (one, again) = (once(), once());
                assert!(one.pixels == again.pixels, "{operator:?} {width}×{height}");
                let (residual, steps) = one.residual.unwrap();
                println!("{operator:?} {width}×{height}: {residual:e}, {steps} steps");
                assert!(
                    residual <= RESIDUAL && steps < 40,
                    "{operator:?} {width}×{height}: {residual:e}, {steps} steps"
                );
                assert!(one.pixels.iter().flatten().all(|v| v.is_finite() && *v >= 0.0));
            }
        }
    });
}

/// A constant picture, black, and one with bad values: finite, and the same everywhere where the picture is.
#[test]
fn pictures_without_contrast_are_even() {
    with_gpu(|gpu| {
        for operator in NEW {
            for (width, height) in [(1, 1), (50, 40)] {
                let count = (width * height) as usize;
                let even =
                    apply(gpu, width, height, &vec![[0.3, 0.3, 0.3, 1.0]; count], None, &with(operator)).unwrap();
                let wanted = if operator == Operator::Mantiuk { 0.5f32.powf(2.2) } else { 1.0 };
                assert!(even.pixels.iter().all(|p| (p[1] - wanted).abs() < 1e-4), "{operator:?}: {:?}", even.pixels[0]);
                let black =
                    apply(gpu, width, height, &vec![[0.0, 0.0, 0.0, 1.0]; count], None, &with(operator)).unwrap();
                assert!(black.pixels.iter().all(|p| p[..3] == [0.0; 3]), "{operator:?}: {:?}", black.pixels[0]);
            }
            let mut bad = picture(20, 10);
            bad[3] = [f32::NAN, f32::INFINITY, -1.0, 1.0];
            let bad = apply(gpu, 20, 10, &bad, None, &with(operator)).unwrap();
            assert!(bad.bad.nan == 1 && bad.pixels.iter().flatten().all(|v| v.is_finite()), "{operator:?}");
        }
    });
}

#[test]
fn tiles_change_no_bit_of_photoreceptors() {
    with_gpu(|gpu| {
        let (width, height) = (131, 77);
        let pixels = picture(width, height);
        for settings in [
            with(Operator::ReinhardDevlin),
            Settings { chromatic: 0.7, adaptation: 0.4, percentile: 2.0, ..with(Operator::ReinhardDevlin) },
        ] {
            let map = |still: &mut Still| still.map(width, height, pixels.clone(), None, None).unwrap().pixels;
            let whole = map(&mut Still::new(gpu, &settings).unwrap());
            for side in [20, 64, 130] {
                assert!(whole == map(&mut Still::new(gpu, &settings).unwrap().tiles(side)), "tiles of {side}");
            }
        }
        // Operators that solve an equation are never cut into tiles.
        let mut tiled = Still::new(gpu, &with(Operator::Fattal)).unwrap().tiles(20);
        let cut = tiled.map(width, height, pixels.clone(), None, None).unwrap().pixels;
        assert!(cut == apply(gpu, width, height, &pixels, None, &with(Operator::Fattal)).unwrap().pixels);
    });
}

/// No compression gives the picture's ratios of luminance back (Fattal), and codes in proportion to its logarithm (Mantiuk).
#[test]
fn no_compression_keeps_the_contrasts_of_the_picture() {
    with_gpu(|gpu| {
        let (width, height) = (90, 70);
        let light = |i: usize| 10f32.powf(1.5 * ((i % 90) as f32 / 20.0).sin() + ((i / 90) as f32 / 9.0).cos());
        let pixels: Vec<[f32; 4]> = (0..6300).map(|i| [light(i), light(i), light(i), 1.0]).collect();
        let fattal = Settings { beta: 1.0, clipped: Some(0.0), ..with(Operator::Fattal) };
        let shown = apply(gpu, width, height, &pixels, None, &fattal).unwrap().pixels;
        let (least, most) = (0..6300).map(light).fold((f32::MAX, 0f32), |(l, m), v| (l.min(v), m.max(v)));
        for (i, shown) in shown.iter().enumerate() {
            let wanted = (light(i) - least) / (most - least);
            assert!((shown[1] - wanted).abs() < 1e-3 * wanted + 1e-6, "pixel {i}: {} {wanted}", shown[1]);
        }
        let mantiuk = Settings { contrast_scale: 1.0, clipped: Some(0.0), ..with(Operator::Mantiuk) };
        let shown = apply(gpu, width, height, &pixels, None, &mantiuk).unwrap().pixels;
        let mut logs: Vec<f32> = (0..6300).map(|i| light(i).log10()).collect();
        logs.sort_by(f32::total_cmp);
        let (low, median, high) = (logs[0], logs[3149], logs[6299]);
        for (i, shown) in shown.iter().enumerate() {
            let wanted = 0.5 + (light(i).log10() - median) / (2.0 * (high - median).max(median - low));
            assert!((shown[1].powf(1.0 / 2.2) - wanted).abs() < 1e-3, "pixel {i}: {} {wanted}", shown[1]);
        }
    });
}

//! Selective tone mapping: which pixels are important, and is the local component spent on those alone? On a device; every value
//! is exact.

use crate::common;
use lucerna::{
    gpu::{DeviceKind, Gpu, ImageDesc as OwnedDesc, OwnedImage, Region, Started, testing::with_gpu},
    graph::*,
    image,
    reference::tonemap::plane::luminance_of,
    scene::Limits,
    shaders::{self, test::*, types},
    techniques::tonemap::{self, Identify, Local, Mark, Mode, Operator, Settings, Still, identify, mark},
};

const OPERATORS: [Operator; 3] = [Operator::Ashikhmin, Operator::Reinhard, Operator::Bilateral];
const MARKS: [Mark; 4] = [Mark::Branch, Mark::Tiles, Mark::EarlyZ, Mark::Compact];
/// One pixel, less than a tile, a tile, more than whole tiles, a line.
const SIZES: [[u32; 2]; 6] = [[1, 1], [3, 5], [8, 8], [17, 9], [37, 29], [70, 1]];

/// Repeatable numbers in [0, 1).
fn noise(seed: u32, count: usize) -> Vec<f32> {
    let mut state = seed.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32
    };
    (0..count).map(|_| next()).collect()
}

fn owned(gpu: &Gpu, name: &str, [width, height]: [u32; 2], values: &[f32]) -> OwnedImage {
    let desc = OwnedDesc::new(ash::vk::Format::R32_SFLOAT, width, height);
    OwnedImage::with_contents(gpu, name, desc, &[Region { mip: 0, layer: 0, bytes: bytemuck::cast_slice(values) }])
        .unwrap()
}

fn run(gpu: &Gpu, graph: Graph) -> Frame {
    Runner::new(gpu).run(graph).unwrap_or_else(|e| panic!("{e}"))
}

fn red(pixels: &Pixels) -> Vec<f32> {
    pixels.to_f32().iter().map(|p| p[0]).collect()
}

fn statistics(graph: &mut Graph, scale: f32) -> Buffer {
    graph.buffer_from("statistics", &[types::TonemapStatistics { scale, ..Default::default() }])
}

/// The map of `luminance` on the device.
fn map(gpu: &Gpu, size: [u32; 2], luminance: &[f32], mask: Option<&[f32]>, settings: &Settings) -> Vec<bool> {
    let image = owned(gpu, "luminance", size, luminance);
    let mask = mask.map(|m| owned(gpu, "mask", size, m));
    let mut graph = Graph::new("identify");
    let (image, mask) = (graph.import_image(&image), mask.map(|m| graph.import_image(&m)));
    let statistics = statistics(&mut graph, 1.0);
    let importance = identify::importance(&mut graph, image, statistics, mask, settings);
    let token = graph.read_image(importance);
    let map = red(&run(gpu, graph).image(token));
    assert!(map.iter().all(|v| *v == 0.0 || *v == 1.0), "a map is 0 or 1");
    map.iter().map(|v| *v == 1.0).collect()
}

/// Adapted luminance where `importance` says so, and what the marking's own pass started.
fn adapt(gpu: &Gpu, size: [u32; 2], luminance: &[f32], importance: &[f32], mark: Mark) -> (Vec<f32>, Option<Started>) {
    let images = [owned(gpu, "luminance", size, luminance), owned(gpu, "importance", size, importance)];
    let mut graph = Graph::new("mark");
    let [image, importance] = images.map(|i| graph.import_image(&i));
    let settings = Settings { mark, radius: 3, local: Local::Literal, ..Settings::paper() };
    let statistics = statistics(&mut graph, 1.0);
    let extent = graph.extent(image);
    let adapted = mark::adapt(&mut graph, image, importance, statistics, extent, &settings).unwrap();
    let token = graph.read_image(adapted);
    let frame = run(gpu, graph);
    let pass = frame.report.passes.iter().rev().find(|p| p.name.starts_with("tonemap.marked")).unwrap();
    (red(&frame.image(token)), pass.started)
}

#[test]
fn the_ways_of_marking_give_the_same_bits_and_touch_nothing_else() {
    with_gpu(|gpu| {
        for (seed, size) in SIZES.into_iter().enumerate() {
            let count = (size[0] * size[1]) as usize;
            let luminance: Vec<f32> = noise(seed as u32, count).iter().map(|n| (n * 12.0 - 4.0).exp2()).collect();
            let whole = adapt(gpu, size, &luminance, &vec![1.0; count], Mark::Branch).0;
            if count > 1 {
                assert_ne!(whole, luminance, "the local component does something");
            }
            let some: Vec<f32> = noise(77 + seed as u32, count).iter().map(|n| f32::from(u8::from(*n < 0.3))).collect();
            for importance in [vec![0.0; count], vec![1.0; count], some] {
                let expected: Vec<f32> =
                    (0..count).map(|i| if importance[i] == 1.0 { whole[i] } else { luminance[i] }).collect();
                for mark in MARKS {
                    let (found, _) = adapt(gpu, size, &luminance, &importance, mark);
                    let wrong = (0..count).filter(|&i| found[i].to_bits() != expected[i].to_bits()).count();
                    assert_eq!(wrong, 0, "{mark:?} at {size:?}, {} marked", importance.iter().sum::<f32>());
                }
            }
        }
    });
}

/// The list of `compact` has room for 2²⁴ pixels: more are done in bands of rows.
#[test]
fn a_list_longer_than_its_room_is_done_in_bands() {
    with_gpu(|gpu| {
        let size = [gpu.caps().limits.image_2d.min(16384), 1 + (1 << 24) / 16384 + 5];
        let count = (size[0] * size[1]) as usize;
        let luminance: Vec<f32> = (0..count).map(|i| 1.0 + (i % 97) as f32).collect();
        // Few, but on both sides of the border between the bands.
        let marked =
            |i: usize| i.is_multiple_of(4099) || (i / size[0] as usize).abs_diff(1024) < 2 && i.is_multiple_of(13);
        let importance: Vec<f32> = (0..count).map(|i| f32::from(u8::from(marked(i)))).collect();
        let (one, _) = adapt(gpu, size, &luminance, &importance, Mark::Compact);
        let (other, _) = adapt(gpu, size, &luminance, &importance, Mark::Branch);
        let wrong = (0..count).find(|&i| one[i].to_bits() != other[i].to_bits());
        assert_eq!(wrong, None);
        assert!(one[size[0] as usize * 1025..].iter().zip(&luminance[size[0] as usize * 1025..]).any(|(a, b)| a != b));
    });
}

/// Draws one of the two counting shaders over what `importance` marked; returns its count by atomics and the driver's.
fn starts(gpu: &Gpu, size: [u32; 2], importance: &[f32], early: bool, tested: bool) -> (u32, Option<Started>, u32) {
    let owned = owned(gpu, "importance", size, importance);
    let mut graph = Graph::new("starts");
    let image = graph.import_image(&owned);
    let extent = graph.extent(image);
    let depth = graph.image("depth", Format::D32F, extent);
    mark::mark_depth(&mut graph, image, depth);
    let color = graph.image("color", Format::R32F, extent);
    let starts = graph.buffer("starts", 4);
    graph.fill(starts, 0);
    let (targets, state) = mark::early_z(Targets::new().color(color, Load::Clear([0.0; 4])), depth);
    let state = if tested { state } else { state.depth_compare(Compare::Always) };
    let draw = Draw::fullscreen_at(0.5);
    if early {
        graph.raster(targets, state, tonemap_early::Args { starts }, draw).counted().named("counted");
    } else {
        graph.raster(targets, state, tonemap_late::Args { starts }, draw).counted().named("counted");
    }
    let (count, drawn) = (graph.read_buffer(starts), graph.read_image(color));
    let frame = run(gpu, graph);
    let started = frame.report.passes.iter().find(|p| p.name == "counted").unwrap().started;
    assert_eq!(started.is_some(), gpu.caps().pipeline_statistics, "counted where the device can");
    let drawn = red(&frame.image(drawn)).iter().sum::<f32>() as u32;
    (frame.buffer(count)[0], started, drawn)
}

#[test]
fn early_z_starts_exactly_the_marked_fragments_and_not_by_chance() {
    with_gpu(|gpu| {
        for (seed, size) in SIZES.into_iter().enumerate() {
            let count = size[0] * size[1];
            let some: Vec<f32> =
                noise(5 + seed as u32, count as usize).iter().map(|n| f32::from(u8::from(*n < 0.3))).collect();
            for importance in [vec![0.0; count as usize], vec![1.0; count as usize], some] {
                let marked = importance.iter().sum::<f32>() as u32;
                // Forced: the shader does not start where the test fails, store or no store.
                let forced = starts(gpu, size, &importance, true, true);
                assert_eq!((forced.0, forced.2), (marked, marked), "forced early tests at {size:?}");
                // Not forced: its store must happen everywhere, though the picture is the same. So the count above is not what
                // any draw would give, and the qualifier is what makes it.
                let late = starts(gpu, size, &importance, false, true);
                assert_eq!((late.0, late.2), (count, marked), "tests after the shader at {size:?}");
                // Forced, but the test lets all through: the counter counts.
                let all = starts(gpu, size, &importance, true, false);
                assert_eq!((all.0, all.2), (count, count), "no test at {size:?}");
            }
        }
    });
}

#[test]
fn the_shipped_passes_start_what_they_should_by_the_driver_s_count() {
    with_gpu(|gpu| {
        if !gpu.caps().pipeline_statistics {
            eprintln!("SKIPPED: {} has no pipeline statistics", gpu.describe());
            return;
        }
        // The atomic counter of the test above says 0 here; Mesa 22.3 counts the blocks that it rasterises.
        let (by_atomics, by_query, _) = starts(gpu, [8, 8], &[0.0; 64], true, true);
        let honest = by_atomics == 0 && by_query.is_some_and(|started| started.fragments == 0);
        if !honest {
            eprintln!("SKIPPED: {} counts fragments that it does not start", gpu.describe());
        }
        for (seed, [width, height]) in SIZES.into_iter().enumerate() {
            let count = (width * height) as usize;
            let luminance = noise(seed as u32, count);
            let some: Vec<f32> = noise(9 + seed as u32, count).iter().map(|n| f32::from(u8::from(*n < 0.3))).collect();
            for importance in [vec![0.0; count], vec![1.0; count], some] {
                let blocks = |side: u32| {
                    let blocks = (0..height)
                        .step_by(side as usize)
                        .flat_map(|y| (0..width).step_by(side as usize).map(move |x| (x, y)));
                    let marked =
                        |x: u32, y: u32| x < width && y < height && importance[(y * width + x) as usize] == 1.0;
                    let busy = blocks.filter(|&(x, y)| (0..side * side).any(|i| marked(x + i % side, y + i / side)));
                    busy.count() as u64 * u64::from(side * side)
                };
                let marked = blocks(1);
                let started = |mark| adapt(gpu, [width, height], &luminance, &importance, mark).1.unwrap();
                // A driver may count the lanes that fill up a quad of 2 x 2.
                let early = started(Mark::EarlyZ);
                if honest {
                    assert!((marked..=blocks(2)).contains(&early.fragments), "{early:?} for {marked} marked");
                    if gpu.caps().kind == DeviceKind::Cpu {
                        assert_eq!(early.fragments, marked);
                    }
                }
                assert_eq!(early.compute, 0);
                let tiles = Started { compute: blocks(8), fragments: 0 };
                assert_eq!(started(Mark::Tiles), tiles);
                let compact = Started { compute: marked.next_multiple_of(64), fragments: 0 };
                assert_eq!(started(Mark::Compact), compact);
            }
        }
    });
}

/// Execution modes of the fragment stage, from its SPIR-V.
fn modes(shader: &lucerna::shader::Shader) -> Vec<u32> {
    let stage = shader.stages.iter().find(|s| s.stage == lucerna::shader::Stage::Fragment).unwrap();
    let words: Vec<u32> = stage.spirv.chunks_exact(4).map(|w| u32::from_le_bytes(w.try_into().unwrap())).collect();
    let (mut at, mut modes) = (5, Vec::new());
    while at < words.len() {
        let (length, operation) = ((words[at] >> 16) as usize, words[at] & 0xFFFF);
        if operation == 16 {
            modes.push(words[at + 2]); // OpExecutionMode
        }
        at += length.max(1);
    }
    modes
}

#[test]
fn early_tests_are_forced_in_the_shader_and_depth_is_not_written() {
    const EARLY_FRAGMENT_TESTS: u32 = 9;
    use lucerna::graph::Args;
    assert!(modes(shaders::tonemap::marked_early_z::Args::SHADER).contains(&EARLY_FRAGMENT_TESTS));
    assert!(modes(tonemap_early::Args::SHADER).contains(&EARLY_FRAGMENT_TESTS));
    assert!(!modes(tonemap_late::Args::SHADER).contains(&EARLY_FRAGMENT_TESTS));
    assert!(!modes(shaders::tonemap::marked_branch::Args::SHADER).contains(&EARLY_FRAGMENT_TESTS));
    let mut graph = Graph::new("state");
    let depth = graph.image("depth", Format::D32F, Extent::new(4, 4));
    let (targets, state) = mark::early_z(Targets::new(), depth);
    assert_eq!((state.depth_write, state.depth_compare), (false, Compare::Greater));
    assert_eq!(targets, Targets::new().depth(depth, Depth::ReadOnly));
}

#[test]
fn sobel_marks_steps_by_their_height_and_not_by_chance() {
    with_gpu(|gpu| {
        let size = [13, 9];
        let step = |low: f32, high: f32| -> Vec<f32> {
            (0..size[0] * size[1]).map(|i| if i % size[0] < 6 { low } else { high }).collect()
        };
        let with = |threshold| Settings { threshold: Some(threshold), ..Settings::paper() };
        // Along an edge of one pixel the kernels give four times the step, in the two columns beside it, also at the border.
        let columns: Vec<bool> = (0..117).map(|i| [5, 6].contains(&(i % 13))).collect();
        assert_eq!(map(gpu, size, &step(1.0, 1.5), None, &with(1.999)), columns);
        assert_eq!(map(gpu, size, &step(1.5, 1.0), None, &with(1.999)), columns);
        assert_eq!(map(gpu, size, &step(1.0, 1.5), None, &with(2.0)), vec![false; 117], "over, not at, the threshold");
        assert_eq!(map(gpu, size, &[7.0; 117], None, &with(0.0)), vec![false; 117], "a constant image has no edge");
        // A thousandth of the light around is an edge, a hundred-thousandth is rounding.
        assert_eq!(map(gpu, size, &step(1e4, 1.001e4), None, &with(0.1)), columns);
        assert_eq!(map(gpu, size, &step(1e4, 1.00001e4), None, &with(0.1)), vec![false; 117]);
        // Nothing overflows.
        assert_eq!(map(gpu, size, &step(0.0, 1e18), None, &with(0.1)), columns);
        assert_eq!(map(gpu, [1, 1], &[1e18], None, &with(0.0)), [false]);
        // A slope of 1 along x and 2 along y: 8 times its length inside.
        let slope: Vec<f32> = (0..117).map(|i| (i % 13 + 2 * (i / 13)) as f32).collect();
        let length = 8.0 * 5.0_f32.sqrt();
        let inside: Vec<bool> = (0..117).map(|i| (1..12).contains(&(i % 13)) && (1..8).contains(&(i / 13))).collect();
        assert_eq!(map(gpu, size, &slope, None, &with(length * 0.9999)), inside);
        assert_eq!(map(gpu, size, &slope, None, &with(length * 1.0001)), vec![false; 117]);
    });
}

#[test]
fn normalisation_acts_on_the_threshold_of_sobel() {
    with_gpu(|gpu| {
        let image = owned(gpu, "luminance", [4, 1], &[0.0, 0.0, 1.0, 1.0]);
        for (scale, expected) in [(1.0, 2.0), (0.02, 0.0), (0.03, 2.0)] {
            let mut graph = Graph::new("identify");
            let image = graph.import_image(&image);
            let statistics = statistics(&mut graph, scale);
            let importance = identify::importance(&mut graph, image, statistics, None, &Settings::paper());
            let token = graph.read_image(importance);
            assert_eq!(red(&run(gpu, graph).image(token)).iter().sum::<f32>(), expected, "factor {scale}");
        }
    });
}

#[test]
fn a_mask_is_or_ed_in_at_full_size() {
    with_gpu(|gpu| {
        for (seed, size) in SIZES.into_iter().enumerate() {
            let count = (size[0] * size[1]) as usize;
            let luminance = noise(seed as u32, count);
            let mask = noise(100 + seed as u32, count);
            for identify in [Identify::Sobel, Identify::Saliency] {
                for identify_scale in [1, 2, 4] {
                    let settings = Settings { identify, identify_scale, threshold: Some(0.3), ..Settings::paper() };
                    let found = map(gpu, size, &luminance, None, &settings);
                    let both = map(gpu, size, &luminance, Some(&mask), &settings);
                    let expected: Vec<bool> = (0..count).map(|i| found[i] || mask[i] > 0.5).collect();
                    assert_eq!(both, expected, "{identify:?} at 1/{identify_scale} of {size:?}");
                }
            }
        }
    });
}

#[test]
fn at_reduced_size_a_box_has_one_answer() {
    with_gpu(|gpu| {
        // A step inside of a box vanishes in its mean, a step between boxes stays.
        let (width, height) = (21, 10);
        let luminance: Vec<f32> = (0..width * height).map(|i| if i % width < 8 { 1.0 } else { 2.0 }).collect();
        for (factor, columns) in [(1, 7..9), (2, 6..10), (4, 4..12)] {
            let settings = Settings { identify_scale: factor, threshold: Some(3.99), ..Settings::paper() };
            let expected: Vec<bool> = (0..width * height).map(|i| columns.contains(&(i % width))).collect();
            assert_eq!(map(gpu, [width, height], &luminance, None, &settings), expected, "reduced {factor} times");
        }
        // Boxes that the border cuts average what is inside: a constant image stays constant.
        for size in SIZES {
            let luminance = vec![0.7; (size[0] * size[1]) as usize];
            let settings = Settings { identify_scale: 4, threshold: Some(1e-6), ..Settings::paper() };
            assert!(!map(gpu, size, &luminance, None, &settings).contains(&true), "{size:?}");
        }
    });
}

#[test]
fn saliency_sees_what_stands_out_whatever_the_unit() {
    with_gpu(|gpu| {
        let size = [96, 64];
        let settings = Settings { identify: Identify::Saliency, threshold: Some(0.1), ..Settings::paper() };
        let flat = map(gpu, size, &vec![0.3; 96 * 64], None, &settings);
        assert!(!flat.contains(&true), "a constant image has nothing salient");
        assert!(!map(gpu, size, &vec![0.0; 96 * 64], None, &settings).contains(&true), "nor has a black one");
        let lamp = |scale: f32| -> Vec<f32> {
            let inside = |i: i32| (30..36).contains(&(i % 96)) && (20..26).contains(&(i / 96));
            (0..96 * 64).map(|i| scale * if inside(i) { 8.0 } else { 0.5 }).collect()
        };
        let found = map(gpu, size, &lamp(1.0), None, &settings);
        assert!(found[23 * 96 + 33], "the lamp stands out");
        assert!(!found[60 * 96 + 90], "what is far from it does not");
        let share = found.iter().filter(|f| **f).count() as f32 / found.len() as f32;
        assert!((0.006..0.3).contains(&share), "{share} salient");
        for scale in [2.0_f32.powi(-20), 2.0_f32.powi(20)] {
            assert_eq!(map(gpu, size, &lamp(scale), None, &settings), found, "times {scale}");
        }
        for size in SIZES {
            let luminance = noise(3, (size[0] * size[1]) as usize);
            map(gpu, size, &luminance, None, &settings);
        }
    });
}

/// The thesis' threshold for Sobel would mark four fifths of a photograph by saliency.
#[test]
fn saliency_by_default_marks_a_part_of_a_photograph() {
    let Some(assets) = common::assets() else { return };
    with_gpu(|gpu| {
        for name in ["memorial_o876.hdr", "StillLife.exr", "Desk.exr"] {
            let layers = image::read(assets.join("hdr").join(name), &Limits::default()).unwrap();
            let pixels = layers.main().unwrap().rgb_pixels().unwrap();
            let luminance: Vec<f32> = pixels.iter().map(|p| luminance_of(p.map(|v| v.max(0.0))) as f32).collect();
            let settings = Settings { identify: Identify::Saliency, ..Settings::paper() };
            let found = map(gpu, [layers.width, layers.height], &luminance, None, &settings);
            let share = found.iter().filter(|f| **f).count() as f32 / found.len() as f32;
            println!("{name}: {:.1} % salient", 100.0 * share);
            assert!((0.1..0.4).contains(&share), "{name}: {share}");
        }
    });
}

#[test]
fn tiles_of_a_picture_have_the_map_of_the_whole() {
    with_gpu(|gpu| {
        let (width, height) = (301, 67);
        let count = (width * height) as usize;
        let mask: Vec<f32> = noise(2, count).iter().map(|n| f32::from(u8::from(*n > 0.99))).collect();
        let grain = noise(1, count);
        // Broad waves with grain, so that no map is empty or full.
        let pixels: Vec<[f32; 4]> = (0..count)
            .map(|i| {
                let (x, y) = ((i as u32 % width) as f32, (i as u32 / width) as f32);
                let l = ((x * 0.05).sin() * (y * 0.07).cos() * 2.0).exp2()
                    * if x > 150.0 { 0.8 + 0.4 * grain[i] } else { 1.0 };
                [l, l, l, 1.0]
            })
            .collect();
        for (identify, identify_scale, threshold) in
            [(Identify::Sobel, 1, 0.4), (Identify::Sobel, 4, 0.4), (Identify::Saliency, 1, 0.1)]
        {
            let settings = Settings {
                mode: Some(Mode::Selective),
                identify,
                identify_scale,
                threshold: Some(threshold),
                radius: 2,
                mark: Mark::Compact,
                ..Settings::paper()
            };
            let map = |mut still: Still| still.map(width, height, pixels.clone(), Some(&mask), None).unwrap();
            let whole = map(Still::new(gpu, &settings).unwrap());
            let tiled = map(Still::new(gpu, &settings).unwrap().tiles(80));
            assert!(whole.pixels == tiled.pixels, "{identify:?} at 1/{identify_scale}");
            assert_eq!(whole.important, tiled.important);
            let marked = whole.important.unwrap();
            assert!(0 < marked && marked < u64::from(width * height), "{marked} marked");
        }
    });
}

#[test]
fn selective_is_local_where_marked_and_global_elsewhere() {
    with_gpu(|gpu| {
        let (width, height) = (37, 19);
        let count = (width * height) as usize;
        let grain = noise(4, count);
        let pixels: Vec<[f32; 4]> = grain.iter().map(|g| [g.exp2(), 2.0 * g, g * g, 1.0]).collect();
        let mask: Vec<f32> = noise(8, count).iter().map(|n| f32::from(u8::from(*n < 0.4))).collect();
        for operator in OPERATORS {
            for local in [Local::Fast, Local::Pyramid, Local::Growing, Local::Literal] {
                if local == Local::Growing && operator != Operator::Ashikhmin {
                    continue;
                }
                let with = |mode, mark, mask: &[f32]| {
                    // Nothing is important but the mask.
                    let settings = Settings {
                        operator,
                        local,
                        mode: Some(mode),
                        mark,
                        threshold: Some(1e18),
                        radius: 3,
                        scales: 4,
                        ..Settings::paper()
                    };
                    tonemap::apply(gpu, width, height, &pixels, Some(mask), &settings).unwrap().pixels
                };
                let local_mode = with(Mode::Local, Mark::Branch, &mask);
                let none = with(Mode::Selective, Mark::Branch, &vec![0.0; count]);
                assert_ne!(local_mode, none, "{operator:?}");
                if operator != Operator::Reinhard {
                    // Its curve of the global mode has a white, that of the local one has none.
                    // Two specialisations of one shader may round differently.
                    let global = with(Mode::Global, Mark::Branch, &mask);
                    let near = |(a, b): (&f32, &f32)| (a - b).abs() <= 1e-6 * a.abs().max(b.abs());
                    assert!(none.as_flattened().iter().zip(global.as_flattened()).all(near), "{operator:?}");
                }
                let all = with(Mode::Selective, Mark::Compact, &vec![1.0; count]);
                assert_eq!(all, local_mode, "{operator:?}, {local:?}");
                for mark in MARKS {
                    let found = with(Mode::Selective, mark, &mask);
                    let expected = |i: usize| if mask[i] == 1.0 { local_mode[i] } else { none[i] };
                    let wrong = (0..count).filter(|&i| found[i] != expected(i)).count();
                    assert_eq!(wrong, 0, "{operator:?}, {local:?}, {mark:?}");
                }
            }
        }
    });
}

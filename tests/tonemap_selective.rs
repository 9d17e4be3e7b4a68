//! Selective tone mapping: which pixels are important, and is the local component spent on those alone? On a device; every value
//! is exact.

use lucerna::{
    gpu::{Gpu, ImageDesc as OwnedDesc, OwnedImage, Region, Started, testing::with_gpu},
    graph::*,
    shaders::{test::*, types},
    techniques::tonemap::{Identify, Mark, Settings, identify, mark},
};

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
    OwnedImage::with_contents(gpu, name, desc, &[Region { mip: 0, layer: 0, bytes: bytemuck::cast_slice(values) }]).unwrap()
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
    let settings = Settings { mark, radius: 3, ..Settings::default() };
    let local = graph.uniform(&types::TonemapLocal { radius: 3, contrast: 0.5 });
    let adapted = mark::adapt(&mut graph, image, importance, local, &settings);
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
                println!("{size:?} marked {marked}: forced {forced:?}");
                assert_eq!((forced.0, forced.2), (marked, marked), "forced early tests at {size:?}");
                // Not forced: its store must happen everywhere, though the picture is the same. So the count above is not what
                // any draw would give, and the qualifier is what makes it.
                let late = starts(gpu, size, &importance, false, true);
                println!("  late {late:?}");
                assert_eq!((late.0, late.2), (count, marked), "tests after the shader at {size:?}");
                // Forced, but the test lets all through: the counter counts.
                let all = starts(gpu, size, &importance, true, false);
                println!("  all {all:?}");
                assert_eq!((all.0, all.2), (count, count), "no test at {size:?}");
            }
        }
    });
}

#[test]
fn the_shipped_pass_starts_by_the_driver_s_count() {
    with_gpu(|gpu| {
        for (seed, size) in SIZES.into_iter().enumerate() {
            let count = (size[0] * size[1]) as usize;
            let luminance = noise(seed as u32, count);
            let some: Vec<f32> = noise(9 + seed as u32, count).iter().map(|n| f32::from(u8::from(*n < 0.3))).collect();
            for importance in [vec![0.0; count], vec![1.0; count], some] {
                let marked = importance.iter().sum::<f32>() as u64;
                for mark in MARKS {
                    println!("{size:?} marked {marked} of {count}: {mark:?} {:?}", adapt(gpu, size, &luminance, &importance, mark).1);
                }
            }
        }
    });
}

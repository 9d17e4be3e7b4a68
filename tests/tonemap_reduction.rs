//! Statistics of luminance on the device: minimum, maximum and percentiles to the bit, the log-average to rounding, whatever the extent
//! and however it is cut.

use lucerna::{
    gpu::testing::with_gpu,
    techniques::tonemap::{Mode, Operator, Settings, Still, statistics::ranks},
};

/// What the shaders call luminance, rounded once.
fn luminance(p: &[f32; 4]) -> f32 {
    let clean = |v: f32| f64::from(if v > 0.0 { v.min(1e18) } else { 0.0 });
    let l = (0.2126 * clean(p[0]) + 0.7152 * clean(p[1]) + 0.0722 * clean(p[2])) as f32;
    if l < 1e-30 { 0.0 } else { l.min(1e18) }
}

fn noise(seed: u32) -> impl FnMut() -> f32 {
    let mut state = seed.wrapping_mul(747_796_405).wrapping_add(1);
    move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32
    }
}

/// Twelve decades, with repetitions and black.
fn picture(count: usize, seed: u32) -> Vec<[f32; 4]> {
    let mut next = noise(seed);
    (0..count)
        .map(|i| {
            let l = if i % 13 == 5 { 0.0 } else { 10f32.powf(12.0 * next() - 6.0) };
            if i % 7 == 3 {
                [0.25; 4]
            } else if i % 11 == 5 {
                [0.0; 4]
            } else {
                [l * next(), l * next(), l, 1.0]
            }
        })
        .collect()
}

fn expected(pixels: &[[f32; 4]], percentile: f32) -> (f32, f32, f64) {
    let mut sorted: Vec<f32> = pixels.iter().map(luminance).collect();
    sorted.sort_by(f32::total_cmp);
    let lit = sorted.iter().filter(|l| **l > 0.0);
    let logs: f64 = lit.clone().map(|l| (1e-6 + f64::from(*l)).ln()).sum();
    let [low, high] = ranks(sorted.len() as u64, percentile);
    (sorted[low as usize], sorted[high as usize], (logs / lit.count() as f64).exp())
}

fn settings(percentile: f32) -> Settings {
    Settings { mode: Some(Mode::Global), percentile, ..Settings::paper() }
}

#[test]
fn ranks_follow_their_definition() {
    assert_eq!(ranks(1, 0.0), [0, 0]);
    assert_eq!(ranks(1, 49.0), [0, 0]);
    assert_eq!(ranks(1000, 0.0), [0, 999]);
    assert_eq!(ranks(1000, 1.0), [9, 990]);
    assert_eq!(ranks(1001, 1.0), [10, 990]);
}

#[test]
fn extremes_and_percentiles_are_exact_for_any_extent() {
    with_gpu(|gpu| {
        let extents =
            [(1, 1), (1, 2), (7, 1), (1, 513), (2, 3), (16, 16), (17, 31), (63, 65), (64, 64), (65, 129), (257, 130)];
        for (percentile, seed) in [(0.0, 1), (1.0, 2), (25.0, 3), (49.0, 4)] {
            let mut still = Still::new(gpu, &settings(percentile)).unwrap();
            for (width, height) in extents {
                let pixels = picture((width * height) as usize, seed + width);
                let (low, high, log_average) = expected(&pixels, percentile);
                let found = still.map(width, height, pixels, None, None).unwrap().statistics;
                assert_eq!(found.low.to_bits(), low.to_bits(), "{width}×{height}, {percentile} %: {} {low}", found.low);
                assert_eq!(found.high.to_bits(), high.to_bits(), "{width}×{height}, {percentile} %");
                let error = (f64::from(found.log_average) / log_average - 1.0).abs();
                assert!(error < 2e-6, "{width}×{height}: {} instead of {log_average}, {error:e}", found.log_average);
            }
        }
    });
}

#[test]
fn tiles_and_repetition_change_no_bit() {
    with_gpu(|gpu| {
        for percentile in [0.0, 2.0] {
            let (width, height) = (131, 77);
            let pixels = picture((width * height) as usize, 9);
            let mut whole = Still::new(gpu, &settings(percentile)).unwrap();
            let one = whole.map(width, height, pixels.clone(), None, None).unwrap();
            let again = whole.map(width, height, pixels.clone(), None, None).unwrap();
            assert_eq!(one.pixels, again.pixels);
            for side in [20, 64, 130] {
                let mut tiled = Still::new(gpu, &settings(percentile)).unwrap().tiles(side);
                let cut = tiled.map(width, height, pixels.clone(), None, None).unwrap();
                assert_eq!(cut.statistics.low.to_bits(), one.statistics.low.to_bits());
                assert_eq!(cut.statistics.high.to_bits(), one.statistics.high.to_bits());
                assert_eq!(cut.statistics.log_average.to_bits(), one.statistics.log_average.to_bits());
                assert!(cut.pixels == one.pixels, "tiles of {side}");
            }
        }
    });
}

#[test]
fn bad_values_reach_nothing() {
    with_gpu(|gpu| {
        use lucerna::{
            graph::{Format, Graph, Runner},
            techniques::tonemap::Tonemap,
        };
        // On the way around the policy for bad values: an image of a technique, straight into the passes.
        let pixels = [
            [f32::NAN, 1.0, 1.0, 1.0],
            [f32::INFINITY, 0.0, 0.0, 1.0],
            [-1.0, 0.5, 0.0, 1.0],
            [0.0, 0.0, f32::NEG_INFINITY, 1.0],
        ];
        let mut graph = Graph::new("bad");
        let source = gpu_image(gpu, &pixels);
        let color = graph.import_image(&source);
        assert_eq!(graph.desc(color).format, Format::RGBA32F);
        let mut tonemap = Tonemap::new(gpu, &settings(0.0)).unwrap();
        let output = tonemap.frame(&mut graph, color, None).unwrap();
        let mapped = graph.read_image(output.mapped);
        let frame = Runner::new(gpu).run(&graph).unwrap();
        let mapped = frame.image(mapped).to_f32();
        assert!(mapped.iter().flatten().all(|v| v.is_finite() && *v >= 0.0), "{mapped:?}");
        assert!((mapped[1][0] - 1.0 / 0.2126).abs() < 1e-4, "infinity is the brightest: {mapped:?}");
        assert_eq!(mapped[3], [0.0, 0.0, 0.0, 1.0]);
    });
}

fn gpu_image(gpu: &lucerna::gpu::Gpu, pixels: &[[f32; 4]]) -> lucerna::gpu::OwnedImage {
    use lucerna::gpu::{ImageDesc, OwnedImage, Region};
    let desc = ImageDesc::new(ash::vk::Format::R32G32B32A32_SFLOAT, pixels.len() as u32, 1);
    let bytes = bytemuck::cast_slice(pixels);
    OwnedImage::with_contents(gpu, "bad", desc, &[Region { mip: 0, layer: 0, bytes }]).unwrap()
}

/// More pixels than a float can count, in tiles: not one is lost.
#[test]
fn more_than_two_to_the_24_pixels_are_all_counted() {
    with_gpu(|gpu| {
        let (width, height) = (16384u32, 1025u32);
        let count = (width * height) as usize;
        assert!(count > 1 << 24);
        // One pixel less than half of 1, one more of 4; the last is the only one of 16 and the first the only one of 1/4.
        let mut pixels = vec![[1.0f32, 1.0, 1.0, 1.0]; count];
        pixels[count / 2..].fill([4.0, 4.0, 4.0, 1.0]);
        (pixels[0], pixels[count - 1]) = ([0.25; 4], [16.0; 4]);
        // Two pixels are the least that leaves one out at each end.
        for (percentile, least, most) in [(0.0, 0.25, 16.0), (100.0 * 2.0 / count as f32, 1.0, 4.0)] {
            let settings =
                Settings { operator: Operator::Linear, mode: Some(Mode::Global), percentile, ..Settings::default() };
            let found = Still::new(gpu, &settings).unwrap().map(width, height, pixels.clone(), None, None).unwrap();
            let s = found.statistics;
            assert_eq!((s.frame_low, s.frame_high), (least, most), "{percentile}");
            let logs = -2.0 + 4.0 + 2.0 * (count - count / 2 - 1) as f64;
            let wanted = (logs / count as f64).exp2();
            assert!((f64::from(s.frame_log_average) / wanted - 1.0).abs() < 1e-6, "{} {wanted}", s.frame_log_average);
            if percentile == 0.0 {
                assert!(found.pixels == pixels);
            }
        }
    });
}

/// `cargo test --release --test tonemap tonemap_reduction -- --ignored`: 10 GiB of memory, minutes on a CPU driver.
#[test]
#[ignore = "takes 10 GiB and minutes"]
fn the_largest_picture() {
    with_gpu(|gpu| {
        let side = 16384u32;
        let count = side as usize * side as usize;
        // Powers of two, so that every pixel is exact; a quarter of each.
        let light = |i: usize| ((i + i / side as usize) % 4) as f32;
        let pixels: Vec<[f32; 4]> =
            (0..count).map(|i| [light(i).exp2(), light(i).exp2(), light(i).exp2(), 1.0]).collect();
        let settings = Settings { operator: Operator::ReinhardGlobal, white: 8.0, ..Settings::default() };
        let found = Still::new(gpu, &settings).unwrap().map(side, side, pixels, None, None).unwrap();
        let s = found.statistics;
        assert_eq!((s.frame_low, s.frame_high), (1.0, 8.0));
        assert!((f64::from(s.frame_log_average).log2() - 1.5).abs() < 1e-6, "{}", s.frame_log_average);
        let shown = [0, 1, 2, 3].map(|stops| {
            let l = 2f32.powi(stops);
            l * (1.0 + l / 64.0) / (1.0 + l)
        });
        let wrong = (0..count).find(|&i| {
            let wanted = shown[(i + i / side as usize) % 4];
            found.pixels[i][..3].iter().any(|v| (v - wanted).abs() > 1e-6 * wanted) || found.pixels[i][3] != 1.0
        });
        assert_eq!(wrong.map(|i| (i % side as usize, i / side as usize, found.pixels[i])), None);
    });
}

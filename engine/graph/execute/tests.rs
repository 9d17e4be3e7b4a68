//! Does synchronisation validation see what the oracle sees? Without this canary, clean logs would prove nothing.

use super::*;
use crate::{
    gpu::{self, GpuOptions, OwnedImage, testing},
    graph::{Access, Extent, Format, Image, Items, Stages, oracle},
    shaders::test::{advance, pattern, range},
};

const SMALL: Extent = Extent::new(16, 12);

fn graph() -> Graph {
    let mut graph = Graph::new("canary");
    let [a, b]: [Image; 2] = ["a", "b"].map(|n| graph.image(n, Format::RGBA32F, SMALL));
    graph.compute(pattern::Args { image_out: a, push: pattern::Push { tag: 1.0 } }, SMALL);
    graph.compute(advance::Args { previous: a, next: b }, SMALL);
    graph.read_image(b);
    graph
}

/// What validation says when `spoil` has spoilt the plan of [`graph`].
fn said(spoil: impl FnOnce(&mut Plan)) -> Option<Result<(), String>> {
    let graph = graph();
    let mut plan = Plan::new(&graph).unwrap();
    spoil(&mut plan);
    let mut ran = None;
    let options = GpuOptions { print_messages: false, ..GpuOptions::default() };
    let result = testing::run(options, |gpu| {
        if gpu.validation_active() {
            ran = Some(Runner::new(gpu).execute(&graph, &plan, (0.0, true), &mut |_| {}).map(|_| ()));
        }
    });
    ran.map(|_| result)
}

#[test]
fn validation_misses_a_dropped_barrier() {
    if let Some(result) = said(|_| ()) {
        result.unwrap_or_else(|messages| panic!("the whole plan is right, but: {messages}"));
    }
    let wrong_layout = |p: &mut Plan| p.barriers.retain(|b| b.before != 1 || b.name != "a");
    if let Some(result) = said(wrong_layout) {
        assert!(result.is_err(), "validation did not see a wrong layout");
    }
    // The layout stays right, only the wait is gone.
    let no_wait = |p: &mut Plan| {
        for b in p.barriers.iter_mut().filter(|b| b.before == 1 && b.name == "a") {
            b.src.stages = Stages::INDEX;
            b.src.access = Access::NONE;
        }
        assert!(!oracle::check(p).is_empty());
    };
    if let Some(result) = said(no_wait) {
        let messages = result.expect_err("synchronisation validation is not alive");
        assert!(messages.contains("HAZARD"), "{messages}");
    }
}

#[test]
fn memory_does_not_grow_from_frame_to_frame() {
    testing::with_gpu(|gpu| {
        let mut runner = Runner::new(gpu);
        let mut in_use = Vec::new();
        for _ in 0..12 {
            runner.run(graph()).unwrap();
            in_use.push(gpu.memory_in_use().0);
        }
        assert!(in_use[1..].iter().all(|bytes| *bytes == in_use[1]), "{in_use:?}");
        // Another graph; the memory of the first is given back after a while.
        let mut other = Graph::new("other");
        let image = other.image("other", Format::RGBA32F, Extent::square(512));
        other.clear(image, [1.0; 4]);
        for _ in 0..12 {
            runner.run(&other).unwrap();
        }
        let slots = runner.pool.len();
        assert_eq!(slots, 1, "only the image of the other graph is left");
    });
}

#[test]
fn what_is_only_described_cannot_run() {
    testing::with_gpu(|gpu| {
        let mut graph = Graph::new("described");
        let buffer = graph.import_buffer_described("someone else's", 16);
        graph.read_buffer(buffer);
        let error = Runner::new(gpu).run(graph).unwrap_err().to_string();
        assert!(error.contains("`someone else's` is only described"), "{error}");
    });
}

#[test]
fn long_graphs_run_in_parts_and_short_ones_in_one() {
    testing::with_gpu(|gpu| {
        // Each pass adds to the last one's image; labels are open where a part ends.
        let chain = |passes: u32, rays: u64| {
            let mut graph = Graph::new("chain");
            let mut image = graph.image("first", Format::RGBA32F, SMALL);
            graph.compute(pattern::Args { image_out: image, push: pattern::Push { tag: 1.0 } }, SMALL).rays(rays);
            graph.scope("chain", |graph| {
                for _ in 0..passes {
                    let next = graph.image("next", Format::RGBA32F, SMALL);
                    graph.compute(advance::Args { previous: image, next }, SMALL).rays(rays);
                    image = next;
                }
            });
            let read = graph.read_image(image);
            let frame = Runner::new(gpu).run(&graph).unwrap();
            (frame.image(read).to_f32(), frame.report)
        };
        let (whole, report) = chain(30, 0);
        assert_eq!(report.submissions, 1);
        assert!(whole.iter().flatten().any(|value| *value > 1.0));
        let (parts, report) = chain(30, 1 << 25);
        // The first part allows less, so each pass is a part of its own until times are known.
        assert!((4..=20).contains(&report.submissions), "{} parts", report.submissions);
        assert!(report.passes.iter().all(|pass| pass.gpu_ms.is_some_and(|ms| ms >= 0.0)), "{report}");
        assert!(parts == whole);
        // The shares of a long graph grow to the whole.
        let shares = {
            let mut graph = Graph::new("told");
            let image = graph.image("sums", Format::RGBA32F, SMALL);
            for _ in 0..30 {
                graph
                    .compute(pattern::Args { image_out: image, push: pattern::Push { tag: 1.0 } }, SMALL)
                    .rays(1 << 25);
            }
            let mut shares = Vec::new();
            Runner::new(gpu).run_with_progress(&graph, false, &mut |share| shares.push(share)).unwrap();
            shares
        };
        assert!(shares.len() >= 4 && shares.is_sorted(), "{shares:?}");
        assert!((0.01..0.3).contains(&shares[0]) && *shares.last().unwrap() == 1.0, "{shares:?}");
        // A pass longer than a part may be is a part.
        let (parts, report) = chain(30, u64::MAX);
        assert_eq!(report.submissions, 32);
        assert!(parts == whole);
        // Each of 1024 passes has a mark of its own.
        let mut pace = Pace::default();
        let mut unheard = |_: f64| {};
        let mut parts = Parts::new(gpu, "small", Arc::new(()), (&mut pace, Progress::new(0, &mut unheard)));
        assert_eq!((0..2048).position(|_| parts.is_full(1)), Some(1024));
    });
}

#[test]
fn a_loop_over_items_is_cut_into_dispatches_and_parts_without_a_trace() {
    testing::with_gpu(|gpu| {
        let run = |items: Items, rays: Option<u64>, part: u64, counted: bool| {
            let mut graph = Graph::new("loop");
            let sums = graph.image("sums", Format::RGBA32F, SMALL);
            graph.clear(sums, [1.0; 4]);
            let push = range::Push { tag: 1, first: 77, count: 77 };
            graph.scope("around", |graph| {
                let pass = graph.compute_over(range::Args { sums, push }, SMALL, items);
                if counted {
                    pass.counted();
                }
            });
            let read = graph.read_image(sums);
            let mut runner = Runner { pace: Pace::of(part), dispatch_rays: rays, ..Runner::new(gpu) };
            let frame = runner.run(&graph).unwrap();
            let launches = frame.report.passes[1].launches;
            (frame.image(read).to_f32(), launches, frame.report.submissions)
        };
        let expected = (0..100).fold(1.0f32, |value, i| 0.5 * value + (i + 1) as f32);
        let right = |values: &[[f32; 4]]| values.iter().flatten().all(|value| *value == expected);
        let items = Items::new(100).rays(1 << 20);
        // On a CPU driver and on a GPU.
        let (values, launches, submissions) = run(items, None, u64::MAX, false);
        assert!(right(&values) && (launches == 25 || launches == 4) && submissions == 1, "{launches}, {submissions}");
        let (values, launches, submissions) = run(items, Some(7 << 20), u64::MAX, false);
        assert!(right(&values) && launches == 15 && submissions == 1, "{launches}, {submissions}");
        let (values, launches, submissions) = run(items, Some(7 << 20), 1, false);
        assert!(right(&values) && launches == 15 && submissions > 2, "{launches}, {submissions}");
        // A query of statistics cannot be cut.
        let (values, launches, _) = run(items, Some(7 << 20), 1, true);
        assert!(right(&values) && launches == 15);
        let (values, launches, _) = run(Items::new(0), None, 1, false);
        assert!(values.iter().flatten().all(|value| *value == 1.0) && launches == 1);
    });
}

#[test]
fn after_some_parts_of_a_graph_nothing_is_taken_for_what_it_was() {
    testing::with_gpu(|gpu| {
        let mut runner = Runner::new(gpu);
        let desc = gpu::ImageDesc::new(vk::Format::R32G32B32A32_SFLOAT, SMALL.width, SMALL.height);
        let image = OwnedImage::new(gpu, "lasting", desc.also(vk::ImageUsageFlags::STORAGE)).unwrap();
        let declare = || {
            let mut graph = Graph::new("lasting");
            let kept = graph.import_image(&image);
            graph.compute(pattern::Args { image_out: kept, push: pattern::Push { tag: 1.0 } }, SMALL);
            graph
        };
        runner.run(declare()).unwrap();
        let graph = declare();
        let plan = graph.plan().unwrap();
        let (memory, _) = runner.pool.acquire(gpu, &graph, &plan).unwrap();
        runner.forget_where_things_are(&plan, &memory);
        assert_eq!(image.layout(), vk::ImageLayout::UNDEFINED);
        let error = runner.run(graph).unwrap_err().to_string();
        assert!(error.contains("image `lasting`") && error.contains("UNDEFINED"), "{error}");
        // Imported anew it holds nothing, and can be written.
        runner.run(declare()).unwrap();
    });
}

#[test]
fn an_error_after_some_parts_leaves_the_runner_usable() {
    testing::with_gpu(|gpu| {
        let mut runner = Runner::new(gpu);
        let declare = |threads: [u32; 3]| {
            let mut graph = Graph::new("half");
            let (before, now) = graph.history("kept", Format::RGBA32F, SMALL);
            // Each pass is a part.
            for _ in 0..4 {
                graph.compute(advance::Args { previous: before, next: now }, SMALL).rays(1 << 30);
            }
            graph.compute(advance::Args { previous: before, next: now }, threads).rays(1 << 30);
            let read = graph.read_image(now);
            (graph, read)
        };
        let small = [SMALL.width, SMALL.height, 1];
        for expected in [1.0, 2.0] {
            let (graph, read) = declare(small);
            assert_eq!(runner.run(graph).unwrap().image(read).to_f32()[0], [expected; 4]);
        }
        // More workgroups than any device allows.
        let error = runner.run(declare([SMALL.width, SMALL.height, u32::MAX]).0).unwrap_err();
        assert!(error.kind() == ErrorKind::Runtime && error.to_string().contains("workgroups"), "{error}");
        // The history is gone, and the same runner goes on.
        let (graph, read) = declare(small);
        assert_eq!(runner.run(graph).unwrap().image(read).to_f32()[0], [1.0; 4]);
    });
}

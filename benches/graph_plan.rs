//! What planning a graph and checking its plan cost, for graphs of 100 to 10,000 passes: a chain through two images with parts of a
//! buffer beside it, many short-lived images, and one image that every pass reads. Exits with 1 if a pass of the longest costs more than
//! eight times as much as one of the shortest: both are to grow with the number of uses, and caches grow fuller.
//!
//! `cargo bench --bench graph_plan [-- MOST]`; MOST passes, 10000 by default. No device is needed.

mod common;

use std::{process::ExitCode, time::Instant};

use common::Places;
use lucerna::{
    Error, ErrorKind, Result,
    graph::{Extent, Format, Graph, Image, Plan, oracle},
    shaders::test::{advance, pattern, ramp},
};

/// Times of a pass that the longest graph may take of the shortest.
const GROWTH: f64 = 8.0;
const SMALL: Extent = Extent::new(16, 16);

fn main() -> ExitCode {
    common::verdict(run())
}

fn image(graph: &mut Graph, name: String, side: u32) -> Image {
    let extent = Extent::square(side);
    let image = graph.image(name, Format::RGBA32F, extent);
    graph.compute(pattern::Args { image_out: image, push: pattern::Push { tag: 1.0 } }, extent);
    image
}

fn chain(passes: usize) -> Graph {
    let mut graph = Graph::new("chain");
    let mut pair = [0, 1].map(|i| image(&mut graph, format!("image {i}"), 16));
    let values = graph.buffer("values", 1 << 16);
    for i in 2..passes {
        if i % 4 == 0 {
            let at = 256 * (i as u64 % 256);
            let push = ramp::Push { count: 64, first: 0, step_size: 1 };
            graph.compute(ramp::Args { values: values.range(at..at + 256), push }, 64);
        } else {
            graph.compute(advance::Args { previous: pair[0], next: pair[1] }, SMALL);
            pair.reverse();
        }
    }
    graph
}

/// Every second pass reads what the one before wrote, in eight sizes.
fn brief(passes: usize) -> Graph {
    let mut graph = Graph::new("brief");
    let mut last: Option<Image> = None;
    for i in 0..passes / 2 {
        let next = image(&mut graph, format!("image {i}"), 8 + (i % 8) as u32);
        if let Some(previous) = last {
            graph.compute(advance::Args { previous, next }, SMALL);
        }
        last = Some(next);
    }
    graph
}

fn read_by_all(passes: usize) -> Graph {
    let mut graph = Graph::new("read by all");
    let source = image(&mut graph, "source".into(), 16);
    let target = image(&mut graph, "target".into(), 16);
    for _ in 2..passes {
        graph.compute(advance::Args { previous: source, next: target }, SMALL);
    }
    graph
}

fn run() -> Result<bool> {
    let mut words = Places::new("MOST");
    let most = words.number("MOST", 100..=100_000, 10_000)? as usize;
    words.end()?;
    println!("microseconds a pass, least of three");
    println!("{:>8} {:<12} {:>9} {:>10} {:>10}", "passes", "graph", "barriers", "plan", "oracle");
    let mut good = true;
    for build in [chain, brief, read_by_all] {
        let mut first: Option<[f64; 2]> = None;
        let mut passes = 100;
        while passes <= most {
            let graph = build(passes);
            let mut least = [f64::INFINITY; 2];
            let mut barriers = 0;
            for _ in 0..3 {
                let begun = Instant::now();
                let plan = Plan::new(&graph).map_err(|mistakes| {
                    let text: Vec<String> = mistakes.iter().map(ToString::to_string).collect();
                    Error::new(ErrorKind::Runtime, text.join("; "))
                })?;
                let planned = begun.elapsed();
                let begun = Instant::now();
                let objections = oracle::check(&plan);
                let checked = begun.elapsed();
                if let Some(objection) = objections.first() {
                    return Err(Error::new(ErrorKind::Runtime, objection.clone()));
                }
                barriers = plan.barriers.len();
                let each = [planned, checked].map(|time| time.as_secs_f64() * 1e6 / passes as f64);
                least = [0, 1].map(|i| least[i].min(each[i]));
            }
            let [plan, oracle] = least;
            println!("{passes:>8} {:<12} {barriers:>9} {plan:>10.3} {oracle:>10.3}", graph.name());
            let [before, checked] = *first.get_or_insert(least);
            good &= plan < GROWTH * before && oracle < GROWTH * checked;
            passes *= 10;
        }
    }
    Ok(good)
}

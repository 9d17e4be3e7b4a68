//! What selective tone mapping saves: times of the global, local and selective mode of one operator on HDR images, for every way of
//! marking, with the share of important pixels and of started fragments.
//!
//! `cargo bench --bench selective_cost -- [--operator NAME] [--local fast|literal] [--identify sobel|saliency]
//! [--threshold T]... [--scale F] [--normalize] [--rounds N] [--out FOLDER] IMAGE...`; `--out` writes map and results as PNG.
//! `LUCERNA_DEVICE` chooses the device. The last column is the local mode's time through the selective one's (the thesis' STM/LTM,
//! there of frames per second).

mod common;

use std::path::PathBuf;

use common::median;
use lucerna::{
    Error, Result,
    gpu::{Gpu, GpuOptions, ImageDesc, OwnedImage, Region, Started},
    graph::{Format, Graph, Runner},
    image,
    techniques::tonemap::{Identify, Local, Mark, Mode, Operator, Settings, Tonemap},
};

fn main() -> std::process::ExitCode {
    common::end(run())
}

struct Options {
    settings: Settings,
    thresholds: Vec<f32>,
    rounds: usize,
    out: Option<PathBuf>,
    images: Vec<PathBuf>,
}

fn options() -> Result<Options> {
    let mut options = Options {
        settings: Settings { local: Local::Literal, ..Settings::paper() },
        thresholds: vec![],
        rounds: 3,
        out: None,
        images: vec![],
    };
    let mut arguments = common::words();
    while let Some(argument) = arguments.next() {
        if argument == "--normalize" {
            options.settings.normalize = true;
            continue;
        }
        if !argument.starts_with("--") {
            options.images.push(argument.into());
            continue;
        }
        let value = arguments.next().unwrap_or_default();
        let wrong = |allowed: &str| Error::usage(format!("{argument} {value:?}; allowed: {allowed}"));
        match argument.as_str() {
            "--operator" => {
                let known = Operator::ALL.iter().find(|(name, _)| *name == value);
                options.settings.operator = known.ok_or_else(|| wrong("names of operators"))?.1;
            }
            "--local" if value == "fast" => options.settings.local = Local::Fast,
            "--local" if value == "literal" => options.settings.local = Local::Literal,
            "--identify" if value == "sobel" => options.settings.identify = Identify::Sobel,
            "--identify" if value == "saliency" => options.settings.identify = Identify::Saliency,
            "--threshold" => options.thresholds.push(value.parse().map_err(|_| wrong("numbers"))?),
            "--scale" => options.settings.identify_scale = value.parse().map_err(|_| wrong("1, 2, 4"))?,
            "--rounds" => options.rounds = common::number("--rounds", &value, common::ROUNDS)? as usize,
            "--out" => options.out = Some(value.into()),
            _ => return Err(wrong("see the head of benches/selective_cost.rs")),
        }
    }
    if options.thresholds.is_empty() {
        options.thresholds.push(options.settings.threshold());
    }
    Ok(options)
}

/// Milliseconds of all passes, what the counted ones started, the picture, and the share of important pixels with their map.
struct Once {
    ms: f64,
    started: Started,
    mapped: Vec<[f32; 4]>,
    map: Option<Vec<f32>>,
}

fn once(runner: &mut Runner, color: &OwnedImage, settings: &Settings, read: bool) -> Result<Once> {
    let mut tonemap = Tonemap::new(runner.gpu(), settings)?;
    let mut graph = Graph::new("tonemap");
    let input = graph.import_image(color);
    let output = tonemap.frame(&mut graph, input, None)?;
    let tokens = read.then(|| (graph.read_image(output.mapped), output.important.map(|i| graph.read_image(i))));
    let frame = runner.run(&graph)?;
    let passes = frame.report.passes.iter().filter(|p| p.scope.first().is_some_and(|s| s == "tonemap"));
    let mut once = Once { ms: 0.0, started: Started::default(), mapped: vec![], map: None };
    for pass in passes {
        once.ms += pass.gpu_ms.unwrap_or(0.0);
        let started = pass.started.unwrap_or_default();
        once.started.fragments += started.fragments;
        once.started.compute += started.compute;
    }
    if let Some((mapped, map)) = tokens {
        once.mapped = frame.image(mapped).to_f32();
        once.map = map.map(|map| frame.image(map).to_f32().iter().map(|p| p[0]).collect());
    }
    Ok(once)
}

const MARKS: [(&str, Mark); 4] =
    [("branch", Mark::Branch), ("tiles", Mark::Tiles), ("early-z", Mark::EarlyZ), ("compact", Mark::Compact)];

fn run() -> Result<()> {
    let Options { settings, thresholds, rounds, out, images } = options()?;
    let gpu = Gpu::new(GpuOptions::from_env()?)?;
    println!("{}; {}, {:?}; medians of {rounds}, ms", gpu.describe(), settings.operator.name(), settings.local);
    println!(
        "{:<24} {:>11} {:>6} {:>7} {:>8} {:>9} {:>8} {:>9} {:>10} {:>8}",
        "image", "size", "above", "marked", "GTM", "LTM", "marking", "STM", "started", "LTM/STM"
    );
    let mut runner = Runner::new(&gpu);
    for path in &images {
        let picture = image::read(path, &Default::default())?;
        let (width, height) = (picture.width, picture.height);
        let rgb = picture.main().and_then(|l| l.rgb_pixels());
        let rgb = rgb.ok_or_else(|| Error::input("no colour").in_file(path))?;
        let rgba: Vec<[f32; 4]> = rgb.iter().map(|&[r, g, b]| [r, g, b, 1.0]).collect();
        let region = Region { mip: 0, layer: 0, bytes: bytemuck::cast_slice(&rgba) };
        let desc = ImageDesc::new(Format::RGBA32F.to_vk(), width, height);
        let color = OwnedImage::with_contents(&gpu, "color", desc, &[region])?;
        let name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        for &threshold in &thresholds {
            let in_mode =
                |mode, mark| Settings { mode: Some(mode), mark, threshold: Some(threshold), ..settings.clone() };
            let mut all: Vec<Settings> = [Mode::Global, Mode::Local].map(|m| in_mode(m, Mark::Branch)).into();
            all.extend(MARKS.map(|(_, mark)| in_mode(Mode::Selective, mark)));
            let mut times = vec![vec![]; all.len()];
            let mut started = vec![Started::default(); all.len()];
            let mut results = vec![];
            // Alternating, so that what else the machine does falls on all; the first round makes pipelines and memory.
            for round in 0..=rounds {
                for (i, settings) in all.iter().enumerate() {
                    let once = once(&mut runner, &color, settings, round == 0)?;
                    started[i] = once.started;
                    if round == 0 {
                        results.push(once);
                    } else {
                        times[i].push(once.ms);
                    }
                }
            }
            let times: Vec<f64> = times.into_iter().map(median).collect();
            let map = results[2].map.clone().unwrap_or_default();
            let marked = f64::from(map.iter().sum::<f32>()) / map.len().max(1) as f64;
            if results[3..].iter().any(|r| r.mapped != results[2].mapped) {
                println!("{name}: the ways of marking DIFFER");
            }
            for (i, (mark, _)) in MARKS.into_iter().enumerate() {
                println!(
                    "{name:<24} {:>11} {threshold:>6} {:>6.2}% {:>8.1} {:>9.1} {mark:>8} {:>9.1} {:>10} {:>8.2}",
                    format!("{width}x{height}"),
                    100.0 * marked,
                    times[0],
                    times[1],
                    times[2 + i],
                    started[2 + i].fragments + started[2 + i].compute,
                    times[1] / times[2 + i],
                );
            }
            if let Some(out) = &out {
                let write = |what: &str, pixels: Vec<f32>| {
                    let path = out.join(format!("{name}-{threshold}-{what}.png"));
                    let options = image::WriteOptions { overwrite: true, ..Default::default() };
                    image::write(path, &image::Layers::rgb(width, height, pixels), &options).map(|_| ())
                };
                let rgb = |pixels: &[[f32; 4]]| pixels.iter().flat_map(|p| [p[0], p[1], p[2]]).collect();
                write("global", rgb(&results[0].mapped))?;
                write("local", rgb(&results[1].mapped))?;
                write("selective", rgb(&results[2].mapped))?;
                write("map", map.iter().flat_map(|v| [*v; 3]).collect())?;
            }
        }
    }
    Ok(())
}

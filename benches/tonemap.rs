//! Tone mapping beside Luminance HDR and beside our CPU twin on all cores, on a picture of one and of twelve megapixels.
//!
//! `cargo build --release -p lucerna-samples --bin tonemap && cargo bench --bench tonemap [-- [--rounds N] [--literal] [--tonemap PROGRAM]
//! [--image FILE]]`. Whole process: from an EXR file to an 8-bit PNG file, start of the device and making of pipelines included. Operator
//! alone: of ours, the passes on the device; of Luminance HDR, its whole process less one that only reads the picture and writes it as
//! EXR. `--literal`: by definition as well for the large picture, which takes minutes on a CPU. Luminance HDR is left out where it is not
//! installed. `LUCERNA_DEVICE` chooses the device.

mod common;

use std::{
    path::{Path, PathBuf},
    process::Command,
    time::Instant,
};

use common::median;
use lucerna::{
    Error, Result,
    gpu::{Gpu, GpuOptions, ImageDesc, OwnedImage, Region},
    graph::{Format, Graph, Runner},
    image::{self, Layers, WriteOptions},
    reference::tonemap as twin,
    techniques::tonemap::{Local, Mode, Operator, Settings, Tonemap},
};

fn main() -> std::process::ExitCode {
    common::end(run())
}

struct Options {
    program: PathBuf,
    image: PathBuf,
    rounds: usize,
    literal: bool,
}

fn options() -> Result<Options> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut options = Options {
        program: root.join("target/release/tonemap"),
        image: root.join("../shared/assets/hdr/StillLife.exr"),
        rounds: 3,
        literal: false,
    };
    let mut arguments = common::words();
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--literal" => options.literal = true,
            "--tonemap" => options.program = arguments.next().unwrap_or_default().into(),
            "--image" => options.image = arguments.next().unwrap_or_default().into(),
            "--rounds" => {
                let text = arguments.next().unwrap_or_default();
                options.rounds = common::number("--rounds", &text, common::ROUNDS)? as usize;
            }
            _ => return Err(Error::usage(format!("{argument:?}; allowed: --rounds, --literal, --tonemap, --image"))),
        }
    }
    Ok(options)
}

/// A picture in memory and as a file.
struct Picture {
    width: u32,
    height: u32,
    pixels: Vec<[f32; 3]>,
    file: PathBuf,
}

/// `from` repeated to `width × height`, mirrored at its edges, no luminance at 0 or below (which makes Luminance HDR abort).
fn repeated(from: &Layers, width: u32, height: u32, file: PathBuf) -> Result<Picture> {
    let pixels = from.main().and_then(image::Layer::rgb_pixels).ok_or_else(|| Error::input("no colour"))?;
    let mirrored = |p: u32, size: u32| if (p / size).is_multiple_of(2) { p % size } else { size - 1 - p % size };
    let at = |i: u32| {
        let (x, y) = (mirrored(i % width, from.width), mirrored(i / width, from.height));
        pixels[(y * from.width + x) as usize].map(|v| v.max(1e-6))
    };
    let pixels: Vec<[f32; 3]> = (0..width * height).map(at).collect();
    let layers = Layers::rgb(width, height, pixels.as_flattened().to_vec());
    image::write(&file, &layers, &WriteOptions { overwrite: true, ..Default::default() })?;
    Ok(Picture { width, height, pixels, file })
}

/// Milliseconds of a process; an error if it fails or leaves no output.
fn process(command: &mut Command, out: &Path) -> Result<f64> {
    let _ = std::fs::remove_file(out);
    let begun = Instant::now();
    let done = command.output().map_err(|e| Error::usage(format!("{command:?} did not start")).caused_by(e))?;
    let ms = 1e3 * begun.elapsed().as_secs_f64();
    if !done.status.success() || !out.is_file() {
        let said = String::from_utf8_lossy(&done.stderr).into_owned();
        return Err(Error::input(format!("{command:?} ended with {}: {said}", done.status)));
    }
    Ok(ms)
}

/// Median milliseconds of the passes on the device.
fn passes(runner: &mut Runner, color: &OwnedImage, settings: &Settings, rounds: usize) -> Result<f64> {
    let mut times = Vec::new();
    for round in 0..=rounds {
        let mut tonemap = Tonemap::new(runner.gpu(), settings)?;
        let mut graph = Graph::new("tonemap");
        let input = graph.import_image(color);
        tonemap.frame(&mut graph, input, None)?;
        let frame = runner.run(&graph)?;
        let ms: f64 = frame.report.passes.iter().filter_map(|pass| pass.gpu_ms).sum();
        // The first makes pipelines and memory.
        if round > 0 || rounds == 1 {
            times.push(ms);
        }
    }
    Ok(median(times))
}

/// What is measured: a name, our settings with the program's arguments, and arguments of Luminance HDR where it has the same.
struct Row {
    name: &'static str,
    settings: Settings,
    ours: &'static [&'static str],
    theirs: Option<&'static [&'static str]>,
}

fn rows(literal: bool) -> Vec<Row> {
    let of = |operator, mode, local| Settings { operator, mode: Some(mode), local, ..Settings::paper() };
    let (ashikhmin, reinhard) = (Operator::Ashikhmin, Operator::Reinhard);
    let row = |name, settings, ours, theirs| Row { name, settings, ours, theirs };
    const SIMPLE: &[&str] = &["--tmo", "ashikhmin", "--tmoAshSimple", "true"];
    const FULL: &[&str] = &["--tmo", "ashikhmin", "--tmoAshSimple", "false", "--tmoAshEq2", "false"];
    const PHOTO: &[&str] = &["--tmo", "reinhard02", "--tmoR02Scales", "false"];
    const DODGE: &[&str] = &["--tmo", "reinhard02", "--tmoR02Scales", "true", "--tmoR02Phi", "8"];
    let mut rows = vec![
        row(
            "ashikhmin global",
            of(ashikhmin, Mode::Global, Local::Fast),
            &["--operator", "ashikhmin", "--mode", "global"],
            Some(SIMPLE),
        ),
        row(
            "ashikhmin local fast",
            of(ashikhmin, Mode::Local, Local::Fast),
            &["--operator", "ashikhmin", "--mode", "local", "--local", "fast"],
            Some(FULL),
        ),
        row(
            "ashikhmin local pyramid",
            of(ashikhmin, Mode::Local, Local::Pyramid),
            &["--operator", "ashikhmin", "--mode", "local", "--local", "pyramid"],
            Some(FULL),
        ),
        row(
            "ashikhmin selective fast",
            of(ashikhmin, Mode::Selective, Local::Fast),
            &["--operator", "ashikhmin", "--mode", "selective", "--local", "fast"],
            None,
        ),
        row(
            "ashikhmin selective pyramid",
            of(ashikhmin, Mode::Selective, Local::Pyramid),
            &["--operator", "ashikhmin", "--mode", "selective", "--local", "pyramid"],
            None,
        ),
        row(
            "reinhard global",
            of(reinhard, Mode::Global, Local::Fast),
            &["--operator", "reinhard", "--mode", "global"],
            Some(PHOTO),
        ),
        row(
            "reinhard local fast",
            of(reinhard, Mode::Local, Local::Fast),
            &["--operator", "reinhard", "--mode", "local", "--local", "fast"],
            Some(DODGE),
        ),
        row(
            "reinhard local pyramid",
            of(reinhard, Mode::Local, Local::Pyramid),
            &["--operator", "reinhard", "--mode", "local", "--local", "pyramid"],
            Some(DODGE),
        ),
    ];
    if literal {
        rows.push(row(
            "ashikhmin local literal",
            of(ashikhmin, Mode::Local, Local::Literal),
            &["--operator", "ashikhmin", "--mode", "local", "--local", "literal"],
            Some(FULL),
        ));
        rows.push(row(
            "ashikhmin selective literal",
            of(ashikhmin, Mode::Selective, Local::Literal),
            &["--operator", "ashikhmin", "--mode", "selective", "--local", "literal"],
            None,
        ));
    }
    rows
}

fn run() -> Result<()> {
    let options = options()?;
    let folder = tempfile::tempdir().map_err(|e| Error::usage("no temporary folder").caused_by(e))?;
    let source = image::read(&options.image, &Default::default())?;
    let gpu = Gpu::new(GpuOptions::from_env()?)?;
    let mut runner = Runner::new(&gpu);
    let installed = Command::new("luminance-hdr-cli").env("QT_QPA_PLATFORM", "offscreen").arg("--version").output();
    let rounds = options.rounds;
    let installed = installed.is_ok();
    println!("{}; medians of {rounds}, ms; CPU twin on {} threads", gpu.describe(), cores());
    println!("a program that is not built or installed shows as -; × is Luminance HDR's time through ours\n");
    let sizes = [(source.width, source.height), (4000, 3000)];
    for (which, (width, height)) in sizes.into_iter().enumerate() {
        let picture = repeated(&source, width, height, folder.path().join("in.exr"))?;
        let rgba: Vec<[f32; 4]> = picture.pixels.iter().map(|&[r, g, b]| [r, g, b, 1.0]).collect();
        let region = Region { mip: 0, layer: 0, bytes: bytemuck::cast_slice(&rgba) };
        let desc = ImageDesc::new(Format::RGBA32F.to_vk(), picture.width, picture.height);
        let color = OwnedImage::with_contents(&gpu, "color", desc, &[region])?;
        println!("{width}×{height}, {:.1} megapixels", f64::from(width * height) * 1e-6);
        println!(
            "{:<28} {:>9} {:>9} {:>6}   {:>9} {:>9} {:>6} {:>9}",
            "", "process", "Luminance", "×", "operator", "Luminance", "×", "CPU twin"
        );
        let luminance = |out: &Path, arguments: &[&str], to: &str| {
            let mut command = Command::new("luminance-hdr-cli");
            command.env("QT_QPA_PLATFORM", "offscreen").arg("-l").arg(&picture.file).args(arguments).arg(to).arg(out);
            process(&mut command, out)
        };
        let copied = folder.path().join("copy.exr");
        let alone = |f: &dyn Fn() -> Result<f64>| -> Result<f64> {
            (0..rounds).map(|_| f()).collect::<Result<Vec<f64>>>().map(median)
        };
        let reading = installed.then(|| alone(&|| luminance(&copied, &[], "-s"))).transpose()?;
        for row in rows(which == 0 || options.literal) {
            let out = folder.path().join("out.png");
            let (mut mine, mut theirs) = (Vec::new(), Vec::new());
            // Alternating, so that what else the machine does falls on both.
            for _ in 0..rounds {
                if options.program.is_file() {
                    let mut command = Command::new(&options.program);
                    command.arg(&picture.file).arg("-o").arg(&out).arg("--overwrite").args(row.ours);
                    mine.push(process(&mut command, &out)?);
                }
                if let Some(arguments) = row.theirs.filter(|_| installed) {
                    theirs.push(luminance(&out, arguments, "-o")?);
                }
            }
            let [mine, theirs] = [mine, theirs].map(|t| (!t.is_empty()).then(|| median(t)));
            let passes = passes(&mut runner, &color, &row.settings, rounds)?;
            let operator = theirs.zip(reading).map(|(all, reading)| all - reading);
            // The twin has one way to compute local adaptation, and no marking: selective is local with a map.
            let begun = Instant::now();
            let twin = (row.settings.local != Local::Literal && row.settings.mode() != Mode::Selective).then(|| {
                twin::tonemap(width, height, &picture.pixels, &row.settings);
                1e3 * begun.elapsed().as_secs_f64()
            });
            let ms = |v: Option<f64>| v.map_or_else(|| "-".into(), |v| format!("{v:.1}"));
            let times =
                |a: Option<f64>, b: Option<f64>| a.zip(b).map_or_else(|| "-".into(), |(a, b)| format!("{:.2}", a / b));
            println!(
                "{:<28} {:>9} {:>9} {:>6}   {passes:>9.1} {:>9} {:>6} {:>9}",
                row.name,
                ms(mine),
                ms(theirs),
                times(theirs, mine),
                ms(operator),
                times(operator, Some(passes)),
                ms(twin)
            );
        }
        println!();
    }
    Ok(())
}

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, std::num::NonZero::get)
}

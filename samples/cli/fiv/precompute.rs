//! `fiv precompute`: computes the vectors of occluders under an environment and writes them to a file.

use std::{
    ops::Range,
    path::{Path, PathBuf},
    process::ExitCode,
    time::{Duration, Instant},
};

use lucerna::{
    Error, ErrorKind, Result,
    gpu::Gpu,
    image,
    scene::{Environment, Pose},
    techniques::fiv::{Light, Method, Occluder, Occluders, Plan, Settings, Sky, Stored},
};
use serde::{Deserialize, Serialize};
use serde_json::json;

use super::{Meter, Shard, decided, partial};
use crate::{
    args::{DeviceArgs, TalkArgs, positive},
    config::{self, SettingsArgs},
    console::{self, Console},
    ground::GroundArgs,
    program::{self, STOPPED_EARLY},
    progress::ProgressMode,
    render::unless_stopped,
    settings_list,
    signals::Interrupt,
    source,
};

/// Options of `fiv precompute`.
#[derive(clap::Args, Clone, Debug)]
pub struct PrecomputeArgs {
    /// Scene files: .gltf, .glb or .obj. Every node with a mesh is an occluder in its pose at rest; flat meshes and meshes
    /// as large as their scene are left out
    #[arg(value_name = "MESH", required_unless_present = "builtin")]
    pub meshes: Vec<PathBuf>,

    /// The occluders of a built-in scene; may be given more than once
    #[arg(long, value_name = "NAME")]
    pub builtin: Vec<String>,

    /// Metres that one unit of the files stands for, where the format leaves it open (OBJ, C arrays) [default: 1]
    #[arg(long, value_name = "METRES", value_parser = positive)]
    pub unit: Option<f64>,

    #[command(flatten)]
    pub ground: GroundArgs,

    /// The .hdr or .exr environment, or a built-in one (point, area, areas, grove) [default: that of the first scene that has one]
    #[arg(long, alias = "env", value_name = "FILE")]
    pub environment: Option<PathBuf>,

    /// File to write
    #[arg(short, long, value_name = "FILE.fiv", help_heading = "Output")]
    pub output: PathBuf,

    /// Replace the file if it exists
    #[arg(long, help_heading = "Output")]
    pub overwrite: bool,

    /// Compute only part I of N; `fiv merge` joins the parts
    #[arg(long, value_name = "I/N", help_heading = "Output")]
    pub shard: Option<Shard>,

    /// Start again, even if a stopped run has left FILE.part
    #[arg(long, help_heading = "Output")]
    pub restart: bool,

    /// Seconds between writes of the finished samples to FILE.part; the interval is longer if a write takes more than a
    /// tenth of it
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0, value_parser = seconds, help_heading = "Output")]
    pub checkpoint: f64,

    /// Print one JSON document about the run on stdout
    #[arg(long, help_heading = "Output")]
    pub json: bool,

    #[command(flatten)]
    pub settings: SettingsArgs,

    #[command(flatten)]
    pub device: DeviceArgs,

    #[command(flatten)]
    pub talk: TalkArgs,

    /// How progress is shown on stderr
    #[arg(long, value_enum, default_value_t, value_name = "HOW", help_heading = "Messages")]
    pub progress: ProgressMode,
}

fn seconds(text: &str) -> Result<f64, String> {
    let good = |s: &f64| (0.0..=86_400.0).contains(s);
    text.parse().ok().filter(good).ok_or_else(|| "expected seconds from 0 to 86400".into())
}

/// The settings, with the same keys as `fiv render`.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Keys {
    fiv: Settings,
}

/// Runs the command.
///
/// # Errors
/// Whatever fails, with the kind that decides the exit code.
pub fn precompute(args: &PrecomputeArgs, console: Console) -> Result<ExitCode> {
    let mut keys = args.settings.effective(&Keys::default())?;
    let checked = |keys: &Keys| decided::of_vectors(&keys.fiv).validate().map_err(|error| error.at("fiv"));
    args.settings.blamed(checked(&keys), || checked(&args.settings.file_alone().effective(&Keys::default())?))?;
    if args.settings.print_config {
        console::print(settings_list::with_docs(&config::to_toml(&keys)?).trim_end())?;
        return Ok(ExitCode::SUCCESS);
    }
    let idle = decided::idle(&keys.fiv)?;
    if !idle.is_empty() {
        console.info(&format!("note: vectors do not depend on {}", idle.join(", ")));
    }
    // Texels are separated only for this method.
    keys.fiv.method = Method::Vectors;
    image::probe_output(&args.output, args.overwrite)?;
    let interrupt = Interrupt::install();
    let (occluders, environment) = load(args, &keys.fiv, console)?;
    let sky = Sky::of(Some(&environment), &keys.fiv)?;
    if sky.repaired > 0 {
        console.info(&format!("note: {} pixels of the environment are not valid radiance", sky.repaired));
    }
    let mut plan = Plan::new(&environment.name, sky.hash(), &occluders, &keys.fiv);
    let gpu = Gpu::new(args.device.options()?)?;
    console.info(&format!("lucerna {}, {}", program::VERSION, gpu.describe()));
    let names: Vec<&str> = plan.occluders.iter().map(|o| o.name.as_str()).collect();
    console.info(&format!("{} samples of {} occluders: {}", plan.grid, names.len(), names.join(", ")));
    if let Some(what) = plan.by_rays(&occluders) {
        console.info(&format!("note: fiv.masks: {what}"));
    }
    plan.fits(None)?;
    let light = Light::new(&gpu, &sky)?;
    plan.adapt(&gpu, &light, &occluders, &keys.fiv, |_| true)?;
    let range = args.shard.map_or(0..plan.samples(), |shard| plan.part(shard.index, shard.count));
    let part = partial(&args.output)?;
    let mut stored = match resumed(&part, &plan, &range, args.restart)? {
        Some(stored) => stored,
        None => Stored::empty(plan.clone(), range.start),
    };
    let total = range.end - range.start;
    let before = stored.range.end - range.start;
    if before > 0 {
        console.info(&format!("{}: goes on after {before} of {total} samples", part.display()));
    }

    let mut meter = Meter::new(args.progress, console.is_quiet(), before, total);
    let (mut saved, mut took) = (Instant::now(), Duration::ZERO);
    let checkpoint = Duration::from_secs_f64(args.checkpoint);
    let computed = plan.compute(&gpu, &light, &occluders, stored.range.end..range.end, |done, new| {
        stored.push(new);
        meter.show(done - range.start);
        // Each checkpoint writes the whole file. At most a tenth of the time is spent on checkpoints.
        if saved.elapsed() >= checkpoint.max(9 * took) {
            let begun = Instant::now();
            let _saving = interrupt.saving();
            stored.write(&part, true)?;
            saved = Instant::now();
            took = saved - begun;
        }
        Ok(!interrupt.requested())
    });
    // Samples that were computed before the interrupt are kept.
    unless_stopped(computed, &interrupt)?;
    if stored.range.end < range.end {
        let _saving = interrupt.saving();
        stored.write(&part, true)?;
        let done = stored.range.end - range.start;
        console.info(&format!("stopped after {done} of {total} samples; the same command goes on"));
        return Ok(ExitCode::from(STOPPED_EARLY));
    }
    let saving = interrupt.saving();
    stored.write(&args.output, args.overwrite)?;
    interrupt.keep();
    drop(saving);
    let _ = std::fs::remove_file(&part);
    let bytes = std::fs::metadata(&args.output).map_or(0, |m| m.len());
    console.info(&format!("wrote {}: {bytes} bytes", args.output.display()));
    if args.json {
        console::print_json(&json!({
            "file": args.output,
            "bytes": bytes,
            "samples": total,
            "computed": total - before,
            "seconds": meter.seconds(),
            "environment": plan.environment,
            "occluders": console::to_json(&plan.occluders)?,
            "settings": config::to_value(&keys)?,
        }))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The occluders of all files without duplicates, and the environment.
fn load(args: &PrecomputeArgs, settings: &Settings, console: Console) -> Result<(Vec<Occluder>, Environment)> {
    let options = source::in_unit(args.unit);
    let mut environment = match &args.environment {
        Some(path) => {
            let (environment, notes) = source::environment(path)?;
            notes.iter().for_each(|note| console.info(&format!("note: {}: {}", note.place, note.text)));
            Some(environment)
        }
        None => None,
    };
    let mut kinds: Vec<Occluder> = Vec::new();
    let files = args.meshes.iter().map(|path| (Some(path.as_path()), None));
    for (file, name) in files.chain(args.builtin.iter().map(|name| (None, Some(name.as_str())))) {
        let (scene, _) = source::open(file, name, &options)?;
        let scene = args.ground.place(scene, args.unit)?;
        scene.notes.iter().for_each(|note| console.info(&format!("note: {}: {}", note.place, note.text)));
        let found = Occluders::of(&scene, &Pose::rest(&scene), settings.flat, settings.largest);
        if found.kinds.is_empty() {
            let error = Error::input("has no occluder: there is no mesh, or all meshes are flat, large or unlit");
            let place = file.unwrap_or_else(|| Path::new(name.unwrap_or_default()));
            return Err(error.in_file(place).help("Include flat meshes with -D fiv.flat=true"));
        }
        if !found.receivers.is_empty() {
            let names: Vec<_> = found.receivers.iter().map(|&n| scene.nodes[n as usize].name.as_str()).collect();
            console.info(&format!(
                "note: flat or large meshes are left out (fiv.flat, fiv.largest): {}",
                names.join(", ")
            ));
        }
        if !found.vanished.is_empty() {
            let names: Vec<_> = found.vanished.iter().map(|&n| scene.nodes[n as usize].name.as_str()).collect();
            console.info(&format!("note: meshes without size at rest are left out: {}", names.join(", ")));
        }
        for kind in found.kinds {
            if kinds.iter().all(|known| known.hash != kind.hash) {
                kinds.push(kind);
            }
        }
        environment = environment.or(scene.environment);
    }
    let environment = environment.ok_or_else(|| {
        Error::usage("there is no environment").help("Name one with --environment; the scenes have none")
    })?;
    Ok((kinds, environment))
}

/// The samples that a stopped run has left.
///
/// # Errors
/// `Output` if the file belongs to other work, `Input` if it is damaged. The file may contain hours of work, so it is never replaced
/// unless the user asks for it.
fn resumed(part: &Path, plan: &Plan, range: &Range<u64>, restart: bool) -> Result<Option<Stored>> {
    if restart || !part.exists() {
        return Ok(None);
    }
    let help = "Use --restart to replace it, or name another file with -o";
    let stored = Stored::read(part).map_err(|error| error.help(help))?;
    let difference = plan.difference(&stored.plan).or_else(|| {
        let (first, last) = (stored.range.start, stored.range.end);
        let fits = first == range.start && last <= range.end;
        (!fits).then(|| format!("samples {first} to {last} instead of {} to {}", range.start, range.end))
    });
    match difference {
        None => Ok(Some(stored)),
        Some(difference) => {
            let what = format!("a stopped run with other work has left this file: {difference}");
            Err(Error::new(ErrorKind::Output, what).in_file(part).help(help))
        }
    }
}

//! `fiv precompute`: computes the vectors of occluders under an environment and writes them to a file.

use std::{
    path::{Path, PathBuf},
    process::ExitCode,
    time::Instant,
};

use lucerna::{
    Error, ErrorKind, Result,
    bake::{Needed, Store},
    gpu::Gpu,
    image,
    scene::{Environment, Pose},
    techniques::fiv::{Light, Method, Occluder, Occluders, Plan, Settings, Sky, Stored, plan::OnDevice, units},
};
use serde::{Deserialize, Serialize};
use serde_json::json;

use super::{partial, vector_settings};
use crate::{
    args::positive,
    bake::{self, BakeArgs, Ended, Work},
    config,
    console::{self, Console},
    ground::GroundArgs,
    program,
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

    /// The .hdr or .exr environment, or a built-in one (point, area, areas, grove, dome) [default: that of the first scene that has one]
    #[arg(long, alias = "env", value_name = "FILE")]
    pub environment: Option<PathBuf>,

    #[command(flatten)]
    pub run: BakeArgs,
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
    let begun = Instant::now();
    let checked = |keys: &Keys| vector_settings::of_vectors(&keys.fiv).validate().map_err(|error| error.at("fiv"));
    let Some(mut keys) = args.run.keys(&Keys::default(), checked)? else { return Ok(ExitCode::SUCCESS) };
    let idle = vector_settings::idle(&keys.fiv)?;
    if !idle.is_empty() {
        console.info(&format!("note: vectors do not depend on {}", idle.join(", ")));
    }
    // Texels are separated only for this method.
    keys.fiv.method = Method::Vectors;
    image::probe_output(&args.run.output, args.run.overwrite)?;
    // From here on the program ends by itself when it is asked to.
    let _ = Interrupt::install();
    let (occluders, environment) = load(args, &keys.fiv, console)?;
    let sky = Sky::of(Some(&environment), &keys.fiv)?;
    if sky.repaired > 0 {
        console.info(&format!("note: {} pixels of the environment are not valid radiance", sky.repaired));
    }
    let mut plan = Plan::new(&environment.name, sky.hash(), &occluders, &keys.fiv);
    let gpu = Gpu::new(args.run.device.options()?)?;
    console.info(&format!("lucerna {}, {}", program::VERSION, gpu.describe()));
    let names: Vec<&str> = plan.occluders.iter().map(|o| o.name.as_str()).collect();
    console.info(&format!("{} samples of {} occluders: {}", plan.grid, names.len(), names.join(", ")));
    if let Some(what) = plan.by_rays(&occluders) {
        console.info(&format!("note: fiv.masks: {what}"));
    }
    plan.fits(None)?;
    let light = Light::new(&gpu, &sky)?;
    plan.adapt(&gpu, &light, &occluders, &keys.fiv, |_| true)?;
    compute(args, console, begun, &keys, (&gpu, &light, &occluders, &plan))
}

/// Computes the units that are not there, and joins them to the file if all are.
fn compute(
    args: &PrecomputeArgs,
    console: Console,
    begun: Instant,
    keys: &Keys,
    (gpu, light, occluders, plan): (&Gpu, &Light, &[Occluder], &Plan),
) -> Result<ExitCode> {
    let interrupt = Interrupt::install();
    let about = gpu.describe();
    let device = format!("{}, {} {}", about.device, about.driver, about.driver_info);
    let folder = bake::parts(&args.run.output)?;
    let store = args.run.units.store(&folder, units::job(plan, &device)?, console)?;
    let part = partial(&args.run.output)?;
    take(&part, &store, plan, args.run.units.restart, console)?;
    let mut on_device = OnDevice::new(gpu);
    let unit = |unit, _: Needed<'_>| {
        let range = units::range(store.job(), unit);
        let (mut fivs, last) = (Vec::new(), range.end);
        let mut done = range.start;
        plan.compute_with(&mut on_device, light, occluders, range, |at, new| {
            fivs.extend_from_slice(new);
            done = at;
            Ok(!interrupt.requested())
        })?;
        match done == last {
            true => Ok(units::bytes(&fivs)),
            false => Err(Error::new(ErrorKind::Interrupted, "stopped on request")),
        }
    };
    let (units, what) = (&args.run.units, "samples");
    let work =
        Work { store: &store, args: units, begun, progress: args.run.progress, what, console, interrupt: &interrupt };
    let (progress, missing, bytes) = match work.compute(unit)? {
        Ended::Early(_, code) => return Ok(code),
        Ended::Shard(progress, missing) => (progress, missing, None),
        Ended::Whole(progress) => {
            let saving = interrupt.saving();
            let bytes = bake::joined(&store, &args.run.output, args.run.overwrite)?;
            drop(saving);
            bake::remove(store, console)?;
            let _ = std::fs::remove_file(&part);
            console.info(&format!("wrote {}: {bytes} bytes", args.run.output.display()));
            (progress, 0, Some(bytes))
        }
    };
    let (shard, total) = (args.run.units.shard, progress.cost[1]);
    if args.run.json {
        console::print_json(&json!({
            "file": bytes.map(|_| &args.run.output),
            "bytes": bytes,
            "folder": shard.map(|_| &folder),
            "shard": shard.map(|shard| shard.to_string()),
            "units": progress.units[1],
            "missing": missing,
            "samples": total,
            "computed": total - progress.before,
            "seconds": progress.seconds,
            "environment": plan.environment,
            "occluders": console::to_json(&plan.occluders)?,
            "settings": config::to_value(keys)?,
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

/// Takes what an earlier version of this program has left.
///
/// # Errors
/// `Input` if it is damaged, `Output` if it is of other work: it may be worth hours.
fn take(part: &Path, store: &Store, plan: &Plan, restart: bool, console: Console) -> Result<()> {
    if restart || !part.exists() {
        return Ok(());
    }
    let help = "Use --restart to replace it, or name another file with -o";
    let stored = Stored::read(part).map_err(|error| error.help(help))?;
    let taken = units::take(store, plan, &stored).map_err(|error| error.in_file(part).help(help))?;
    if taken > 0 {
        console.info(&format!("{}: {taken} units are taken from what an earlier version has left", part.display()));
    }
    Ok(())
}

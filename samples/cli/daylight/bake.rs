//! `daylight bake`: computes the light of a scene for all times of a day and writes it to a file.

use std::{path::PathBuf, process::ExitCode, time::Instant};

use lucerna::{
    Error, Result,
    gpu::Gpu,
    image,
    scene::Scene,
    techniques::daylight::{
        Baking, Calendar, Day, Kind, Lit, MOST_TIMES, Plan, Sources, Stored, Transport, Weather, digest, lightmap,
        parts, units,
    },
};
use serde::{Deserialize, Serialize};
use serde_json::json;

use super::info;
use crate::{
    args::{DeviceArgs, TalkArgs},
    bake::{self as units_of, Ended, UnitsArgs, Work},
    config::{self, SettingsArgs},
    console::{self, Console},
    program,
    progress::ProgressMode,
    settings_list,
    signals::Interrupt,
    stage::{Stage, StageArgs},
};

/// Elevation at which the sun has set: its radius below the horizon, degrees.
const SET: f64 = -0.2665;

/// Options of `daylight bake`.
#[derive(clap::Args, Clone, Debug)]
pub struct DayBakeArgs {
    #[command(flatten)]
    pub stage: StageArgs,

    /// Date of the day
    #[arg(long, value_name = "YYYY-MM-DD", default_value = "2026-06-21", help_heading = "Day")]
    pub date: String,

    /// Degrees, positive in the north
    #[arg(long, value_name = "DEGREES", default_value_t = 55.5, allow_negative_numbers = true, help_heading = "Day")]
    pub latitude: f64,

    /// Degrees, positive in the east
    #[arg(long, value_name = "DEGREES", default_value_t = 10.0, allow_negative_numbers = true, help_heading = "Day")]
    pub longitude: f64,

    /// Time zone: a name, or an offset such as +01:00
    #[arg(long, value_name = "ZONE", default_value = "Europe/Copenhagen", help_heading = "Day")]
    pub timezone: String,

    /// Turn of the north from -Z, degrees, clockwise as seen from above
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, allow_negative_numbers = true, help_heading = "Day")]
    pub north: f32,

    /// The surfaces to bake
    #[arg(long, value_enum, default_value = "lightmap", value_name = "KIND", help_heading = "Bake")]
    pub kind: KindArg,

    /// File to write
    #[arg(short, long, value_name = "FILE.day", help_heading = "Output")]
    pub output: PathBuf,

    /// Replace the file if it exists
    #[arg(long, help_heading = "Output")]
    pub overwrite: bool,

    /// Print one JSON document about the run on stdout
    #[arg(long, help_heading = "Output")]
    pub json: bool,

    #[command(flatten)]
    pub units: UnitsArgs,

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

/// The surfaces that a bake holds light for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum KindArg {
    /// All surfaces, for a free camera
    Lightmap,
    /// The pixels of the camera, for this camera and size alone
    View,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Keys {
    bake: Baking,
}

/// Runs the command.
///
/// # Errors
/// Whatever fails, with the kind that decides the exit code.
pub fn bake(args: &DayBakeArgs, console: Console) -> Result<ExitCode> {
    let begun = Instant::now();
    let keys = args.settings.effective(&Keys::default())?;
    args.settings
        .blamed(keys.bake.validate(), || args.settings.file_alone().effective(&Keys::default())?.bake.validate())?;
    if args.settings.print_config {
        console::print(settings_list::with_docs(&config::to_toml(&keys)?).trim_end())?;
        return Ok(ExitCode::SUCCESS);
    }
    image::probe_output(&args.output, args.overwrite)?;
    let interrupt = Interrupt::install();
    let stage = Stage::open(&args.stage)?;
    stage.notes().iter().for_each(|note| console.info(&format!("note: {}: {}", note.place, note.text)));
    let Planned { plan, sources, corners, notes } = plan(args, &keys.bake, &stage)?;
    notes.iter().for_each(|note| console.info(&format!("note: lightmap: {note}")));
    plan.validate()?;
    let gpu = Gpu::new(args.device.options()?)?;
    console.info(&format!("lucerna {}, {}", program::VERSION, gpu.describe()));
    let texels = match &plan.receivers {
        Kind::View { .. } => u64::from(plan.extent[0]) * u64::from(plan.extent[1]),
        Kind::Lightmap { covered, .. } => *covered,
    };
    console.info(&format!(
        "{texels} of {}×{} texels, {} steps of the day, {} of them lit, {} paths per texel",
        plan.extent[0],
        plan.extent[1],
        plan.steps,
        plan.times.len(),
        plan.settings.samples
    ));
    if plan.times.is_empty() {
        console.info("note: the sun does not rise on this day; the bake holds the light of the sky alone");
    }
    let raw = 6 * texels * plan.times.len() as u64;
    console.info(&format!("all frames as 16-bit floats would have {raw} bytes"));
    let about = gpu.describe();
    let device = format!("{}, {} {}", about.device, about.driver, about.driver_info);
    let folder = units_of::parts(&args.output)?;
    let of_tiles: Option<Vec<u64>> = match &sources {
        Sources::View(_) => None,
        Sources::Lightmap(tiles) => Some(tiles.iter().map(|tile| tile.len() as u64).collect()),
    };
    let store = args.units.store(&folder, units::job(&plan, &device, of_tiles.as_deref())?, console)?;
    let mut transport = Transport::new(&gpu, &stage.scene, &plan, sources)?;
    let skies = units::skies(&plan)?;
    let unit = |unit: lucerna::bake::UnitId, _: lucerna::bake::Needed<'_>| {
        let light = transport.tile(&plan, unit.index)?;
        Ok(units::compress(&plan, &light, &skies)?.encode())
    };
    let (units_args, what) = (&args.units, "paths");
    let work =
        Work { store: &store, args: units_args, begun, progress: args.progress, what, console, interrupt: &interrupt };
    let (progress, missing, summary) = match work.compute(unit)? {
        Ended::Early(_, code) => return Ok(code),
        Ended::Shard(progress, missing) => (progress, missing, None),
        Ended::Whole(progress) => {
            let saving = interrupt.saving();
            let stored = Stored::join(&store, corners)?;
            let bytes = stored.encode()?;
            image::write_atomic(&args.output, &bytes, args.overwrite)?;
            drop(saving);
            units_of::remove(store, console)?;
            let summary = stored.summary();
            info::lines(&summary).iter().for_each(|line| console.info(line));
            if summary.worst_tile > plan.settings.tolerance {
                console.warning(&format!(
                    "the error of a tile is {:.1} %, {:.1} % were allowed: bake.images allows only {} images",
                    100.0 * summary.worst_tile,
                    100.0 * plan.settings.tolerance,
                    plan.settings.images
                ));
            }
            if summary.noise > plan.settings.tolerance {
                console.info(
                    "note: the noise is larger than the tolerance; with more bake.samples fewer images are needed",
                );
            }
            console.info(&format!("wrote {}: {} bytes", args.output.display(), bytes.len()));
            (progress, 0, Some((bytes.len(), summary)))
        }
    };
    if args.json {
        console::print_json(&json!({
            "file": summary.as_ref().map(|_| &args.output),
            "bytes": summary.as_ref().map(|(bytes, _)| bytes),
            "summary": summary.as_ref().map(|(_, summary)| console::to_json(summary)).transpose()?,
            "units": progress.units[1],
            "missing": missing,
            "lit": plan.times.len(),
            "steps": plan.steps,
            "seconds": progress.seconds,
            "settings": config::to_value(&keys)?,
        }))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The plan of a command line, and the texels.
struct Planned {
    plan: Plan,
    sources: Sources,
    corners: Vec<[u16; 6]>,
    notes: Vec<String>,
}

fn plan(args: &DayBakeArgs, baking: &Baking, stage: &Stage) -> Result<Planned> {
    let day = Day::new(&args.date, &args.timezone, args.latitude, args.longitude).map_err(Error::usage)?;
    let steps = day.steps(baking.interval, baking.offset).map_err(Error::usage)?;
    if steps.len() > MOST_TIMES {
        let what = format!("the day has {} steps, at most {MOST_TIMES} are allowed", steps.len());
        return Err(Error::usage(what).at("bake.interval").help("Choose a longer interval"));
    }
    let lit = steps.iter().filter(|seconds| day.sun(**seconds).elevation > SET);
    let times = lit.map(|&seconds| Lit { seconds, sun: day.sun(seconds).direction(args.north) }).collect();
    let scene: &Scene = &stage.scene;
    if scene.meshes.is_empty() {
        return Err(Error::input("the scene has no surfaces, so there is nothing to bake"));
    }
    let (receivers, extent, sources, corners, notes) = match args.kind {
        KindArg::View => {
            let (_, view) = stage.at(args.stage.time, args.stage.size)?;
            let receivers = Kind::View {
                camera: stage.placed.name.clone(),
                view_from_world: view.view_from_world.to_cols_array(),
                clip_from_view: view.clip_from_view.to_cols_array(),
            };
            (receivers, view.extent, Sources::View(Box::new(view)), Vec::new(), Vec::new())
        }
        KindArg::Lightmap => {
            let unwrapped = lightmap::unwrap(scene, baking)?;
            let corners = unwrapped.lightmap.corners.clone();
            let receivers = Kind::Lightmap {
                charts: unwrapped.charts,
                covered: unwrapped.receivers.len() as u64,
                corners: digest(&corners),
            };
            let sources = Sources::Lightmap(unwrapped.by_tile(baking.tile));
            (receivers, unwrapped.lightmap.extent, sources, corners, unwrapped.notes)
        }
    };
    let plan = Plan {
        scene: scene.name.clone(),
        parts: parts(scene),
        receivers,
        extent,
        calendar: Calendar {
            date: args.date.clone(),
            zone: args.timezone.clone(),
            latitude: args.latitude,
            longitude: args.longitude,
            north: args.north,
        },
        steps: steps.len() as u32,
        times,
        weather: Weather::default(),
        settings: baking.clone(),
    };
    Ok(Planned { plan, sources, corners, notes })
}

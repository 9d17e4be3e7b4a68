//! `daylight bake`: computes the light of a scene for all times of a day and writes it to a file.

use std::{process::ExitCode, time::Instant};

use lucerna::{
    Result,
    gpu::Gpu,
    image,
    techniques::daylight::{Backs, Baking, Cells, Kind, Sources, Stored, units},
};
use serde::{Deserialize, Serialize};
use serde_json::json;

use super::{
    info,
    memory::Memory,
    plan::{DayOptions, KindArg, Planned, plan, thin_out},
};
use crate::{
    bake::{self as units_of, BakeArgs, Ended, Rate, Work},
    config,
    console::{self, Console},
    program,
    prt::available,
    signals::Interrupt,
    stage::{Stage, StageArgs},
};

/// Options of `daylight bake`.
#[derive(clap::Args, Clone, Debug)]
pub struct DayBakeArgs {
    #[command(flatten)]
    pub stage: StageArgs,

    #[command(flatten)]
    pub day: DayOptions,

    /// The surfaces to bake
    #[arg(long, value_enum, default_value = "lightmap", value_name = "KIND", help_heading = "Bake")]
    pub kind: KindArg,

    /// Start from the paper's settings: a sun without a size, 20 images for the whole picture
    #[arg(long, help_heading = "Settings")]
    pub paper: bool,

    #[command(flatten)]
    pub run: BakeArgs,
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
    let base = Keys { bake: if args.paper { Baking::paper() } else { Baking::default() } };
    let Some(keys) = args.run.keys(&base, |keys: &Keys| keys.bake.validate())? else {
        return Ok(ExitCode::SUCCESS);
    };
    image::probe_output(&args.run.output, args.run.overwrite)?;
    let interrupt = Interrupt::install();
    let stage = Stage::open(&args.stage)?;
    stage.notes().iter().for_each(|note| console.info(&format!("note: {}: {}", note.place, note.text)));
    let mut gpu = None;
    let device = || {
        if Backs::are_wanted(&stage.scene, &keys.bake) {
            console.info("looking for the backs of two-sided surfaces that light reaches");
        }
        Ok(gpu.insert(Gpu::new(args.run.device.options()?)?).clone())
    };
    let Planned { mut plan, sources, corners, backs, notes } =
        plan(device, &args.day, args.kind, &keys.bake, &stage, &args.stage)?;
    notes.iter().for_each(|note| console.info(&format!("note: {note}")));
    plan.validate()?;
    let gpu = gpu.map_or_else(|| Gpu::new(args.run.device.options()?), Ok)?;
    console.info(&format!("lucerna {}, {}", program::VERSION, gpu.describe()));
    let texels = match &plan.receivers {
        Kind::View { .. } | Kind::Cube { .. } => u64::from(plan.extent[0]) * u64::from(plan.extent[1]),
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
        let rest = if plan.lamps.is_empty() { "of the sky alone" } else { "of the sky and of lamps" };
        console.info(&format!("note: the sun does not shine at any step; the bake holds the light {rest}"));
    }
    if let Some(grid) = &plan.probes {
        let ([x, y, z], [across, up, along]) = (grid.counts, grid.spacing);
        console.info(&format!(
            "{x}×{y}×{z} probes, {across:.2} m, {up:.2} m and {along:.2} m apart, {} paths per probe",
            plan.settings.probe_samples
        ));
        let most = across.max(up).max(along);
        if most > 1.01 * plan.settings.probes {
            console.info(&format!(
                "note: bake.most_probes = {} allows no smaller distance; --probe-box limits them to a part of the scene",
                plan.settings.most_probes
            ));
        }
    }
    let raw = 6 * texels * plan.times.len() as u64;
    console.info(&format!("all frames as 16-bit floats would have {raw} bytes"));
    let about = gpu.describe();
    let device = format!("{}, {} {}", about.device, about.driver, about.driver_info);
    let folder = units_of::parts(&args.run.output)?;
    let of_tiles: Option<Vec<u64>> = match &sources {
        Sources::View(_) | Sources::Cube(_) => None,
        Sources::Lightmap(texels) => Some(texels.tiles.iter().map(|tile| tile.len() as u64).collect()),
    };
    let mut transport = backs.transport(&gpu, &stage.scene, &plan, sources)?;
    let adaptive = thin_out(&mut plan, &mut transport)?;
    adaptive.iter().for_each(|(said, _)| console.info(said));
    let memory = Memory::new(&plan, of_tiles.as_deref());
    console.info(&memory.to_string());
    memory.expect_free(&plan, args.run.units.shard.is_some(), available())?;
    let masks = Cells::new(&stage.scene, &plan.settings, plan.times.len())?;
    if masks.count > 0 {
        let (points, spacing, bytes) = (masks.count, plan.settings.sun_masks, masks.bytes(plan.times.len()));
        console.info(&format!("sun masks of {points} points, {spacing} m apart: {bytes} bytes of the device's memory"));
    }
    let store = args.run.units.store(&folder, units::job(&plan, &device, of_tiles.as_deref())?, console)?;
    let skies = units::skies(&plan)?;
    let unit = |unit: lucerna::bake::UnitId, _: lucerna::bake::Needed<'_>| {
        units::unit(&plan, &mut transport, unit.index, &skies)
    };
    let (units_args, what) = (&args.run.units, "paths");
    let work = Work {
        store: &store,
        args: units_args,
        begun,
        progress: args.run.progress,
        what,
        console,
        interrupt: &interrupt,
    };
    let (progress, missing, summary) = match work.compute(unit)? {
        Ended::Early(_, code) => return Ok(code),
        Ended::Shard(progress, missing) => (progress, missing, None),
        Ended::Whole(progress) => {
            let total = u64::from(plan.tiles()[0]) * u64::from(plan.tiles()[1]);
            let mut meter = Rate::new(args.run.progress, console.is_quiet(), "tiles", 0, total);
            let stored = Stored::join(&store, corners, |done| {
                meter.show(done as u64, 0);
                Interrupt::stop().check()
            })?;
            if let Kind::Lightmap { covered, .. } = plan.receivers {
                let kept: u64 = stored.tiles.iter().map(|tile| u64::from(tile.there())).sum();
                if kept < covered {
                    console.info(&format!(
                        "note: {} of {covered} texels are inside of solids or under objects and have no light of their own",
                        covered - kept
                    ));
                }
            }
            let saving = interrupt.saving();
            let bytes = stored.encode()?;
            image::write_atomic(&args.run.output, &bytes, args.run.overwrite)?;
            drop(saving);
            units_of::remove(store, console)?;
            let summary = stored.summary();
            let of_probes = stored.probe_summary();
            let lines = info::lines(&summary).into_iter().chain(of_probes.as_ref().map(info::probe_line));
            lines.for_each(|line| console.info(&line));
            // The tolerance is checked before the error is rounded to 32 bits.
            if summary.worst_tile > 1.0001 * plan.settings.tolerance {
                let reason = match plan.settings.images {
                    0 => "its noise hides the light that more images would hold; more bake.samples show it".to_owned(),
                    images => format!("bake.images allows only {images} images"),
                };
                console.warning(&format!(
                    "the error of a tile is {:.2} %, {:.2} % were allowed: {reason}",
                    100.0 * summary.worst_tile,
                    100.0 * plan.settings.tolerance
                ));
            }
            if summary.hidden > 0.25 {
                console.info("note: the noise hides errors as large as the tolerance; more bake.samples show them");
            }
            console.info(&format!("wrote {}: {} bytes", args.run.output.display(), bytes.len()));
            (progress, 0, Some((bytes.len(), summary)))
        }
    };
    if args.run.json {
        console::print_json(&json!({
            "file": summary.as_ref().map(|_| &args.run.output),
            "bytes": summary.as_ref().map(|(bytes, _)| bytes),
            "summary": summary.as_ref().map(|(_, summary)| console::to_json(summary)).transpose()?,
            "units": progress.units[1],
            "missing": missing,
            "lit": plan.times.len(),
            "steps": plan.steps,
            "adaptive": adaptive.map(|(_, json)| json),
            "seconds": progress.seconds,
            "settings": config::to_value(&keys)?,
        }))?;
    }
    Ok(ExitCode::SUCCESS)
}

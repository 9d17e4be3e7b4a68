//! `prt bake`: computes the transport of light in a room and writes a file.

use std::{process::ExitCode, str::FromStr, time::Instant};

use glam::Vec3;
use lucerna::{
    Error, ErrorKind, Result,
    gpu::Gpu,
    image,
    techniques::prt::{self, Bakery, Baking, Starts, Stored, units},
};
use serde::{Deserialize, Serialize};
use serde_json::json;

use super::{info, memory};
use crate::{
    bake::{self as units_of, BakeArgs, Ended, Work},
    config,
    console::{self, Console},
    program,
    record::Source,
    signals::Interrupt,
    stage::{Stage, StageArgs},
};

/// A point in the scene: `X,Y,Z`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inside(Vec3);

impl FromStr for Inside {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let one = |word: &str| word.trim().parse().ok().filter(|number: &f32| number.is_finite());
        let numbers: Option<Vec<f32>> = text.split(',').map(one).collect();
        match numbers.as_deref() {
            Some([x, y, z]) => Ok(Self(Vec3::new(*x, *y, *z))),
            _ => Err("expected X,Y,Z, metres".into()),
        }
    }
}

/// Options of `prt bake`.
#[derive(clap::Args, Clone, Debug)]
pub struct PrtBakeArgs {
    #[command(flatten)]
    pub stage: StageArgs,

    /// Point inside the room from which particles look for surfaces; may be given more than once [default: the lights and cameras of the
    /// scene, or its middle]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, help_heading = "Bake")]
    pub inside: Vec<Inside>,

    /// Start from the paper's settings: vectors of light around their mean, and a fifth of all coefficients
    #[arg(long, help_heading = "Settings")]
    pub paper: bool,

    #[command(flatten)]
    pub run: BakeArgs,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Keys {
    room: Baking,
}

/// Notes on places from which particles start although nobody named them.
fn notes_on(starts: &Starts) -> Vec<String> {
    let mut notes = Vec::new();
    let place = |at: &Vec3| format!("{:.3},{:.3},{:.3}", at.x, at.y, at.z);
    if let (true, Some(middle)) = (starts.guessed, starts.points.first()) {
        notes.push(format!(
            "note: no light and no camera is inside the scene, so particles start in its middle, {}, which may be inside a solid body; \
             --inside X,Y,Z names a point of the free space",
            place(middle)
        ));
    }
    if starts.rooms > 0 {
        let places: Vec<String> = starts.points[starts.points.len() - starts.rooms..].iter().map(place).collect();
        let rooms = match starts.rooms {
            1 => "a room, which is baked, too; a point in it".into(),
            rooms => format!("{rooms} rooms, which are baked, too; points in them"),
        };
        let places = places.join(" ");
        let from = if starts.guessed { "particles from there" } else { "lights and cameras" };
        notes.push(format!("note: {from} do not reach {rooms}: {places}; --inside chooses rooms"));
    }
    notes
}

/// Runs the command.
///
/// # Errors
/// Whatever fails, with the kind that decides the exit code.
pub fn bake(args: &PrtBakeArgs, console: Console) -> Result<ExitCode> {
    let begun = Instant::now();
    let base = Keys { room: if args.paper { Baking::paper() } else { Baking::default() } };
    let Some(keys) = args.run.keys(&base, |keys: &Keys| keys.room.validate())? else {
        return Ok(ExitCode::SUCCESS);
    };
    image::probe_output(&args.run.output, args.run.overwrite)?;
    let interrupt = Interrupt::install();
    let stage = Stage::open(&args.stage)?;
    for note in stage.notes().iter().chain(&prt::simplified(&stage.scene)).chain(&prt::unlit(&stage.scene)) {
        console.info(&format!("note: {}: {}", note.place, note.text));
    }
    let gpu = Gpu::new(args.run.device.options()?)?;
    console.info(&format!("lucerna {}, {}", program::VERSION, gpu.describe()));
    let need = memory::need(&keys.room);
    console.info(&format!("about {:.1} GB of memory for {} samples", need as f64 / 1e9, keys.room.samples));
    memory::expect_free(&keys.room, memory::available())?;
    // What is wrong with a scene is said with its name.
    let blamed = |error: Error| match (&stage.source, error.kind()) {
        (Source::File(file) | Source::Builtin(file), ErrorKind::Input) => error.in_file(file),
        _ => error,
    };
    let mut bakery = Bakery::new(&gpu, &stage.scene)?;
    let starts = match args.inside.is_empty() {
        true => bakery.starts(&keys.room, &Interrupt::stop()).map_err(blamed)?,
        false => Starts { points: args.inside.iter().map(|inside| inside.0).collect(), ..Starts::default() },
    };
    notes_on(&starts).iter().for_each(|note| console.info(note));
    let sampled = bakery.sample(&keys.room, &starts.points, &Interrupt::stop()).map_err(blamed)?;
    let (plan, samples) = (sampled.plan.clone(), sampled.samples.clone());
    let of_samples = begun.elapsed().as_secs_f64();
    console.info(&format!(
        "{} samples {:.3} m apart in {} clusters, after {of_samples:.1} s",
        samples.len(),
        plan.radius,
        plan.clusters.len()
    ));
    if plan.escaped > 0.02 {
        console.info(&format!(
            "note: {:.0} % of the particles left the scene: light that leaves it does not come back",
            100.0 * plan.escaped
        ));
    }
    let about = gpu.describe();
    let device = format!("{}, {} {}", about.device, about.driver, about.driver_info);
    let folder = units_of::parts(&args.run.output)?;
    let store = args.run.units.store(&folder, units::job(&plan, &samples, &device)?, console)?;
    let mut work = units::Work::new(bakery, sampled)?;
    let unit = |unit: lucerna::bake::UnitId, needed: lucerna::bake::Needed<'_>| work.unit(unit, &needed);
    let (units_args, what) = (&args.run.units, "rays");
    let of_units = Work {
        store: &store,
        args: units_args,
        begun,
        progress: args.run.progress,
        what,
        console,
        interrupt: &interrupt,
    };
    let (progress, missing, summary) = match of_units.compute(unit)? {
        Ended::Early(_, code) => return Ok(code),
        Ended::Shard(progress, missing) => (progress, missing, None),
        Ended::Whole(progress) => {
            let stored = Stored::join(&store, samples)?;
            let saving = interrupt.saving();
            let bytes = stored.encode()?;
            image::write_atomic(&args.run.output, &bytes, args.run.overwrite)?;
            drop(saving);
            units_of::remove(store, console)?;
            let summary = stored.summary();
            info::lines(&summary).iter().for_each(|line| console.info(line));
            console.info(&format!("wrote {}: {} bytes", args.run.output.display(), bytes.len()));
            (progress, 0, Some((bytes.len(), summary)))
        }
    };
    // The samples are there before all stages; their unit only keeps them.
    let mut seconds: Vec<(&str, f64)> = work.seconds().filter(|(name, _)| *name != "samples").collect();
    seconds.insert(0, ("samples", of_samples));
    let stages: Vec<String> = seconds.iter().map(|(name, time)| format!("{name} {time:.1} s")).collect();
    console.info(&stages.join(", "));
    if args.run.json {
        console::print_json(&json!({
            "file": summary.as_ref().map(|_| &args.run.output),
            "bytes": summary.as_ref().map(|(bytes, _)| bytes),
            "summary": summary.as_ref().map(|(_, summary)| console::to_json(summary)).transpose()?,
            "units": progress.units[1],
            "missing": missing,
            "clusters": plan.clusters,
            "seconds": progress.seconds,
            "seconds_of_stages": seconds.into_iter().collect::<std::collections::BTreeMap<_, _>>(),
            "settings": config::to_value(&keys)?,
        }))?;
    }
    Ok(ExitCode::SUCCESS)
}

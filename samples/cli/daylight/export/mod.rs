//! `daylight export`: a bake in forms that other programs read. `docs/daylight-export.md` describes the files.

mod folder;
mod lamps;
mod light;
mod moments;
mod scene;
mod table;

use std::{path::PathBuf, process::ExitCode};

use lucerna::{
    Error, ErrorKind, Result,
    image::{Ktx2Format, encode_ktx2},
    techniques::daylight::{
        Kind, Plan, Settings, Stored, Weather,
        export::{self},
    },
};
use serde_json::json;

use self::{
    folder::{Folder, TABLE},
    lamps::Lamps,
    light::Writer,
    moments::{Clock, OneDay},
};
use crate::{
    args::TalkArgs,
    console::Console,
    stage::{Stage, StageArgs},
};

/// Options of `daylight export`.
#[derive(clap::Args, Clone, Debug)]
pub struct DayExportArgs {
    #[command(flatten)]
    pub stage: StageArgs,

    /// File of `daylight bake`: a lightmap or a cube
    #[arg(long, value_name = "FILE.day", help_heading = "Export")]
    pub bake: PathBuf,

    /// Local times whose lightmaps are written as EXR and KTX2, separated by commas; the scene shows the first one
    #[arg(
        id = "clock",
        long = "time",
        value_name = "HH:MM,…",
        value_delimiter = ',',
        default_value = "12:00",
        help_heading = "Export"
    )]
    pub times: Vec<String>,

    /// Dates whose lightmaps are written, separated by commas, for a bake of several days [default: all of them]
    #[arg(long, value_name = "YYYY-MM-DD,…", value_delimiter = ',', help_heading = "Export")]
    pub date: Vec<String>,

    /// Write the EXR file of every lit step of these days too
    #[arg(long, help_heading = "Export")]
    pub all: bool,

    /// Haze of the air, 1 to 10: 1 is clear mountain air, 10 is thick haze
    #[arg(long, value_name = "NUMBER", default_value_t = Weather::default().turbidity(), help_heading = "Export")]
    pub turbidity: f64,

    /// Mean albedo of the land around the scene, 0 to 1, for the light of the sky
    #[arg(long, value_name = "ALBEDO", default_value_t = Weather::default().ground_albedo(), help_heading = "Export")]
    pub ground_albedo: f64,

    /// Share of the sky that clouds cover, 0 to 1
    #[arg(long, value_name = "SHARE", default_value_t = Weather::default().overcast(), help_heading = "Export")]
    pub overcast: f64,

    /// When lamps burn: `dusk` (while the sun is low), `on`, `off`, or hours (`18:30-06:00`); for single groups `NAME=…`, separated by commas
    #[arg(long, value_name = "WHEN", default_value_t = Settings::default().lamps, help_heading = "Export")]
    pub lamps: String,

    /// Elevation of the sun below which lamps with `dusk` burn, degrees; they fade over one degree
    #[arg(long, value_name = "DEGREES", default_value_t = Settings::default().dusk, allow_negative_numbers = true, help_heading = "Export")]
    pub dusk: f64,

    /// Leave the light of lamps out
    #[arg(long, conflicts_with_all = ["lamps", "dusk"], help_heading = "Export")]
    pub no_lamps: bool,

    /// What the texels of the lightmaps' KTX2 files are
    #[arg(long, value_enum, default_value_t, value_name = "FORMAT", help_heading = "Export")]
    pub format: TexelArg,

    /// Folder to write; it is made if it is missing
    #[arg(short, long, value_name = "FOLDER", help_heading = "Output")]
    pub output: PathBuf,

    /// Write into a folder that has files already
    #[arg(long, help_heading = "Output")]
    pub overwrite: bool,

    /// Print one JSON document about the files on stdout
    #[arg(long, help_heading = "Output")]
    pub json: bool,

    #[command(flatten)]
    pub talk: TalkArgs,
}

/// The texels of a lightmap in a KTX2 file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum TexelArg {
    /// Four 16-bit floats
    #[default]
    Half,
    /// Blocks of 4×4 texels in 16 bytes (BC6H), an eighth of the size
    Bc6h,
}

/// Writes the files of an export.
///
/// # Errors
/// Whatever fails, with the kind that decides the exit code.
pub fn export(args: &DayExportArgs, console: Console) -> Result<ExitCode> {
    let weather = Weather::new(args.turbidity, args.ground_albedo, args.overcast).map_err(Error::usage)?;
    // Pages hold 16-bit floats and bytes: not all programs read blocks with signs.
    let stored = Stored::read(&args.bake)?.without_blocks();
    let plan = &stored.plan;
    let blamed = |error: Error| error.in_file(&args.bake);
    if let Kind::View { .. } = plan.receivers {
        let what = "has the light that one camera sees, and it has no places on the surfaces of a scene";
        let help = "Bake with --kind lightmap or --kind cube, and export that file; or write the layers of pictures with \
                    `daylight render -o FILE.exr`";
        return Err(blamed(Error::input(what).help(help)));
    }
    let days = OneDay::all(plan).map_err(blamed)?;
    let lamps = Lamps::new(args, plan)?;
    if args.no_lamps && !plan.lamps.is_empty() {
        let names: Vec<&str> = plan.lamps.iter().map(|group| group.name.as_str()).collect();
        console.info(&format!("note: the light of lamps is left out: {}", names.join(", ")));
    }
    if plan.probes.is_some() {
        console.info("note: the probes, which light added objects, are left out");
    }
    let (clocks, shown) = clocks(args, plan, &days)?;
    let stage = Stage::open(&args.stage)?;
    stage.notes().iter().for_each(|note| console.info(&format!("note: {}: {}", note.place, note.text)));
    if let Some(parts) = plan.difference(&stage.scene) {
        let what = format!("is the light of `{}`, and this scene has other {parts}", plan.scene);
        return Err(blamed(Error::input(what).help("Name the scene that was baked, or bake this one")));
    }
    // Lamps must have a schedule at all times before a folder is made.
    clocks.iter().try_for_each(|clock| lamps.burning(&days[clock.day].course, clock.seconds).map(drop))?;
    folder::prepare(&args.output, args.overwrite)?;
    let mut folder = Folder { path: &args.output, overwrite: args.overwrite, written: Vec::new() };
    let first = format!("lightmap-{}.hdr", clocks[0].name);
    let (bytes, uv_set) = scene::glb_of(&stage, &stored, &first, args, console).map_err(blamed)?;
    folder.write("scene.glb".into(), &bytes)?;
    let sources = export::sources(&stored);
    let raw = sources.iter().flat_map(|source| source.to_le_bytes()).collect();
    folder.write("sources.ktx2".into(), &encode_ktx2(Ktx2Format::R32Uint, plan.extent, &[raw], &[])?)?;
    let mut document = table::write(&mut folder, &stored, &days, weather, &lamps, uv_set)?;
    let mut listed = Vec::new();
    let writer = Writer { stored: &stored, sources: &sources, format: args.format, console };
    for (number, clock) in clocks.iter().enumerate() {
        let day = &days[clock.day];
        let mut moment = day.moment(clock.seconds, weather)?;
        moment.lamps = lamps.burning(&day.course, clock.seconds)?;
        let mut entry = json!({ "time": clock.label, "seconds": clock.seconds });
        if days.len() > 1 {
            entry["date"] = json!(day.date);
        }
        if lamps.is_there() {
            entry["lamps"] = json!(moment.lamps);
        }
        writer.write(&mut folder, &moment, clock, &day.date, [number == 0, number < shown], &mut entry)?;
        listed.push(entry);
    }
    document["lightmaps"] = json!(listed);
    let text = serde_json::to_string_pretty(&document)
        .map_err(|error| Error::new(ErrorKind::Runtime, "the table cannot be written").caused_by(error))?;
    folder.write(TABLE.into(), folder::compact(&text).as_bytes())?;
    folder::say(&folder, console, args.json)?;
    Ok(ExitCode::SUCCESS)
}

/// The times whose lightmaps are written, and the number of those that were asked for; the others are the lit steps.
fn clocks(args: &DayExportArgs, plan: &Plan, days: &[OneDay]) -> Result<(Vec<Clock>, usize)> {
    let mut wanted: Vec<usize> = Vec::new();
    for date in &args.date {
        let Some(day) = days.iter().position(|day| day.date == *date && !date.is_empty()) else {
            let there: Vec<&str> = days.iter().map(|day| day.date.as_str()).filter(|date| !date.is_empty()).collect();
            let there = if there.is_empty() { "a path of the sun without a date".to_owned() } else { there.join(", ") };
            return Err(Error::usage(format!("the date is {date}, the bake has {there}")).at("--date"));
        };
        if !wanted.contains(&day) {
            wanted.push(day);
        }
    }
    if wanted.is_empty() {
        wanted = (0..days.len()).collect();
    }
    let several = days.len() > 1;
    let mut clocks: Vec<Clock> = Vec::new();
    for day in &wanted {
        for text in &args.times {
            let seconds = days[*day].parse(text)?;
            if clocks.iter().all(|known| (known.day, known.seconds) != (*day, seconds)) {
                clocks.push(Clock::new(&days[*day], *day, seconds, several));
            }
        }
    }
    let shown = clocks.len();
    if args.all {
        for day in &wanted {
            for seconds in days[*day].times(plan) {
                if clocks.iter().all(|known| (known.day, known.seconds) != (*day, seconds)) {
                    clocks.push(Clock::new(&days[*day], *day, seconds, several));
                }
            }
        }
    }
    Clock::named_apart(&mut clocks);
    Ok((clocks, shown))
}

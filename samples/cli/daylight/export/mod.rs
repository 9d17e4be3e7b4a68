//! `daylight export`: a bake in forms that other programs read. `docs/daylight-export.md` describes the files.

mod scene;
mod table;

use std::{
    fs,
    path::{Path, PathBuf},
    process::ExitCode,
};

use lucerna::{
    Error, ErrorKind, Result,
    image::{self, Format, Ktx2Format, Layers, Metadata, WriteOptions, encode_ktx2},
    techniques::daylight::{
        Course, Kind, Plan, Stored, Weather,
        export::{self, Levels, Moment},
        steps::Steps,
    },
};
use serde_json::json;

use crate::{
    args::TalkArgs,
    console::{self, Console},
    program,
    stage::{Stage, StageArgs},
};

/// Options of `daylight export`.
#[derive(clap::Args, Clone, Debug)]
pub struct DayExportArgs {
    #[command(flatten)]
    pub stage: StageArgs,

    /// File of `daylight bake`: a lightmap
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

    /// Write the EXR file of every lit step of the bake too
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

/// A time of the day and its name in file names: `0740`.
struct Clock {
    seconds: f64,
    label: String,
    name: String,
}

impl Clock {
    fn new(day: &Course, seconds: f64) -> Self {
        let label = day.label(seconds);
        let digits: String = label.chars().filter(char::is_ascii_digit).collect();
        let name = digits.strip_suffix("00").unwrap_or(&digits).to_owned();
        Self { seconds, label, name }
    }

    /// Makes the names different where the clock goes back and a time comes twice.
    fn named_apart(clocks: &mut [Self]) {
        for at in 1..clocks.len() {
            let (before, rest) = clocks.split_at_mut(at);
            if before.iter().any(|clock| clock.name == rest[0].name && clock.seconds != rest[0].seconds) {
                rest[0].name.push('b');
            }
        }
    }
}

/// Files of one folder, and their sizes.
struct Folder<'a> {
    path: &'a Path,
    overwrite: bool,
    written: Vec<(String, usize)>,
}

impl Folder<'_> {
    fn write(&mut self, name: String, bytes: &[u8]) -> Result<()> {
        image::write_atomic(&self.path.join(&name), bytes, self.overwrite)?;
        self.written.push((name, bytes.len()));
        Ok(())
    }
}

/// Name of the file that names the others. It is written last: where it is, the export is whole.
const TABLE: &str = "daylight.json";

/// Writes the files of an export.
///
/// # Errors
/// Whatever fails, with the kind that decides the exit code.
pub fn export(args: &DayExportArgs, console: Console) -> Result<ExitCode> {
    let weather = Weather::new(args.turbidity, args.ground_albedo, args.overcast).map_err(Error::usage)?;
    let stored = Stored::read(&args.bake)?;
    let plan = &stored.plan;
    let blamed = |error: Error| error.in_file(&args.bake);
    let Kind::Lightmap { .. } = plan.receivers else {
        let what = "has the light that one camera sees, and it has no places on the surfaces of a scene";
        return Err(blamed(Error::input(what).help("Bake with --kind lightmap, and export that file")));
    };
    let courses = plan.calendar.courses().map_err(|what| blamed(Error::input(what)))?;
    let day = &courses[0];
    if courses.len() > 1 {
        let what = format!("has {} days, and an export has one", courses.len());
        return Err(blamed(Error::input(what).help("Bake one day, and export that file")));
    }
    if plan.calendar.span.is_some() {
        let what = "has light for a part of the day, and an export has the whole day";
        return Err(blamed(Error::input(what).help("Bake without --from and --until, and export that file")));
    }
    if !plan.lamps.is_empty() {
        let names: Vec<&str> = plan.lamps.iter().map(|group| group.name.as_str()).collect();
        console.info(&format!(
            "note: the export has the light of sun and sky; that of lamps is left out: {}",
            names.join(", ")
        ));
    }
    let asked = |text: &String| {
        let seconds = day.parse_time(text).map_err(|what| Error::usage(what).at("--time"))?;
        Ok(Clock::new(day, seconds))
    };
    let mut clocks = args.times.iter().map(asked).collect::<Result<Vec<Clock>>>()?;
    let mut known = Vec::new();
    clocks.retain(|clock| {
        let new = !known.contains(&clock.seconds);
        known.push(clock.seconds);
        new
    });
    let shown = clocks.len();
    if args.all {
        let others: Vec<Clock> = plan.times[plan.of_day(0)].iter().map(|time| Clock::new(day, time.seconds)).collect();
        let new = |clock: &Clock| clocks.iter().all(|known| known.seconds != clock.seconds);
        let others: Vec<Clock> = others.into_iter().filter(new).collect();
        clocks.extend(others);
    }
    Clock::named_apart(&mut clocks);
    let stage = Stage::open(&args.stage)?;
    stage.notes().iter().for_each(|note| console.info(&format!("note: {}: {}", note.place, note.text)));
    if let Some(parts) = plan.difference(&stage.scene) {
        let what = format!("is the light of `{}`, and this scene has other {parts}", plan.scene);
        return Err(blamed(Error::input(what).help("Name the scene that was baked, or bake this one")));
    }
    prepare(&args.output, args.overwrite)?;
    let mut folder = Folder { path: &args.output, overwrite: args.overwrite, written: Vec::new() };
    let first = format!("lightmap-{}.hdr", clocks[0].name);
    let (bytes, uv_set) = scene::glb_of(&stage, &stored, &first, args, console).map_err(blamed)?;
    folder.write("scene.glb".into(), &bytes)?;
    let sources = export::sources(&stored);
    let raw = sources.iter().flat_map(|source| source.to_le_bytes()).collect();
    folder.write("sources.ktx2".into(), &encode_ktx2(Ktx2Format::R32Uint, plan.extent, &[raw], &[])?)?;
    let steps = Steps::new(plan, 0, day);
    let table = table::write(&mut folder, &stored, (day, &steps), weather, uv_set)?;
    let mut listed = Vec::new();
    for (number, clock) in clocks.iter().enumerate() {
        let moment = Moment::new(day, &steps, clock.seconds, weather)?;
        let light = export::irradiance(&stored, &moment);
        let exr = format!("lightmap-{}.exr", clock.name);
        let layers = pixels(plan, &export::filled(&light, &sources), clock);
        let encoded = |format| image::encode(format, &layers, &WriteOptions::default()).map(|(bytes, _)| bytes);
        folder.write(exr.clone(), &encoded(Format::Exr)?)?;
        let mut entry = json!({ "time": clock.label, "seconds": clock.seconds, "exr": exr });
        if number == 0 {
            folder.write(first.clone(), &encoded(Format::Hdr)?)?;
            entry["hdr"] = json!(first);
        }
        if number < shown {
            let ktx2 = format!("lightmap-{}.ktx2", clock.name);
            let bytes = ktx2_of(&export::levels(&light, &sources, plan.extent), clock, args.format, console)?;
            folder.write(ktx2.clone(), &bytes)?;
            entry["ktx2"] = json!(ktx2);
        }
        listed.push(entry);
    }
    let mut document = table;
    document["lightmaps"] = json!(listed);
    let text = serde_json::to_string_pretty(&document)
        .map_err(|error| Error::new(ErrorKind::Runtime, "the table cannot be written").caused_by(error))?;
    folder.write(TABLE.into(), compact(&text).as_bytes())?;
    say(&folder, console, args.json)?;
    Ok(ExitCode::SUCCESS)
}

/// Makes the folder, or checks that it may be written into.
fn prepare(folder: &Path, overwrite: bool) -> Result<()> {
    let failed = |error: std::io::Error| {
        Error::new(ErrorKind::Output, "cannot be used as a folder").in_file(folder).caused_by(error)
    };
    if !folder.exists() {
        return fs::create_dir_all(folder).map_err(failed);
    }
    let mut entries = fs::read_dir(folder).map_err(failed)?;
    if entries.next().is_some() && !overwrite {
        let error = Error::new(ErrorKind::Output, "exists already and has files in it").in_file(folder);
        return Err(error.help("Name another folder, or allow to write into this one with --overwrite"));
    }
    // While files are replaced there is no whole export.
    let table = folder.join(TABLE);
    if table.exists() { fs::remove_file(&table).map_err(failed) } else { Ok(()) }
}

/// The light as a picture of a file.
fn pixels(plan: &Plan, light: &[[f32; 3]], clock: &Clock) -> Layers {
    let [width, height] = plan.extent;
    let mut layers = Layers::rgb(width, height, light.as_flattened().to_vec());
    let extra = [("date", plan.calendar.date.as_str()), ("time", &clock.label), ("unit", table::UNIT)];
    layers.metadata = Metadata {
        program: "daylight export".into(),
        version: program::VERSION.into(),
        scene: plan.scene.clone(),
        technique: "daylight".into(),
        extra: extra.map(|(key, text)| (key.to_owned(), text.to_owned())).into(),
        ..Metadata::default()
    };
    layers
}

/// The lightmap of a time with its levels.
fn ktx2_of(levels: &Levels, clock: &Clock, format: TexelArg, console: Console) -> Result<Vec<u8>> {
    let about = [("lucerna.time", clock.label.as_str()), ("lucerna.unit", table::UNIT)];
    let (format, bytes) = match format {
        TexelArg::Half => (Ktx2Format::R16g16b16a16Sfloat, levels.halves()),
        TexelArg::Bc6h => {
            let (blocks, error) = levels.blocks();
            console.info(&format!(
                "{}: BC6H, error {:.2} % of the mean (root mean square)",
                clock.label,
                100.0 * error
            ));
            (Ktx2Format::Bc6hUfloatBlock, blocks)
        }
    };
    encode_ktx2(format, levels.extent, &bytes, &about)
}

/// Lists of numbers on one line each.
fn compact(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut lines = text.lines().peekable();
    while let Some(line) = lines.next() {
        let number = |line: &str| {
            let line = line.trim().trim_end_matches(',');
            !line.is_empty() && line.bytes().all(|b| b.is_ascii_digit() || b"+-.eE".contains(&b))
        };
        out.push_str(if number(line) { line.trim_start() } else { line });
        let next = lines.peek().copied().unwrap_or_default();
        let closes = number(line) && next.trim_start().starts_with(']');
        if !(number(next) || closes) {
            out.push('\n');
        } else if number(line) && !closes {
            out.push(' ');
        }
        if closes && let Some(next) = lines.next() {
            out.push_str(next.trim_start());
            out.push('\n');
        }
    }
    out
}

/// Says what was written.
fn say(folder: &Folder<'_>, console: Console, json: bool) -> Result<()> {
    let all: usize = folder.written.iter().map(|(_, bytes)| bytes).sum();
    // Pages and the lightmaps of all times are many; their sums are enough.
    let mut sums: Vec<(String, usize, usize)> = Vec::new();
    for (name, bytes) in &folder.written {
        let kind = kind_of(name);
        match sums.iter_mut().find(|(known, _, _)| *known == kind) {
            Some((_, count, sum)) => (*count, *sum) = (*count + 1, *sum + bytes),
            None => sums.push((kind, 1, *bytes)),
        }
    }
    for (kind, count, bytes) in sums {
        let count = if count == 1 { String::new() } else { format!(", {count} files") };
        console.info(&format!("{kind:<20} {bytes:>12} bytes{count}"));
    }
    console.info(&format!("wrote {}: {all} bytes in {} files", folder.path.display(), folder.written.len()));
    if json {
        let files: Vec<_> =
            folder.written.iter().map(|(name, bytes)| json!({ "name": name, "bytes": bytes })).collect();
        console::print_json(&json!({ "folder": folder.path, "bytes": all, "files": files }))?;
    }
    Ok(())
}

/// `sun-03.ktx2` and `sun-04.ktx2` are of one kind, `sun-*.ktx2`.
fn kind_of(name: &str) -> String {
    match name.split_once('-').and_then(|(begin, rest)| Some((begin, rest.split_once('.')?))) {
        Some((begin, (number, ending))) if number.starts_with(|c: char| c.is_ascii_digit()) => {
            format!("{begin}-*.{ending}")
        }
        _ => name.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_numbers_are_on_one_line_and_mean_the_same() {
        let value =
            json!({ "a": [1, 2.5, -3e-7], "b": [], "c": { "d": [[1, 2], [3, 4]], "e": "x" }, "f": 4, "g": [7] });
        let text = compact(&serde_json::to_string_pretty(&value).unwrap());
        assert_eq!(serde_json::from_str::<serde_json::Value>(&text).unwrap(), value);
        assert!(text.contains("[1, 2.5, -3e-7],") && text.contains("[1, 2],") && text.contains("[7]"), "{text}");
    }

    #[test]
    fn times_that_come_twice_get_names_of_their_own() {
        let day =
            Box::new(lucerna::techniques::daylight::Day::new("2026-10-25", "Europe/Copenhagen", 55.5, 10.0).unwrap());
        let day = &Course::Almanac { day, north: 0.0 };
        let mut clocks: Vec<Clock> = [2.0, 2.5, 3.0, 3.5].map(|hour| Clock::new(day, 3600.0 * hour)).into();
        Clock::named_apart(&mut clocks);
        let names: Vec<&str> = clocks.iter().map(|clock| clock.name.as_str()).collect();
        assert_eq!(names, ["0200", "0230", "0200b", "0230b"]);
        assert_eq!(Clock::new(day, 61.0).name, "000101");
    }

    #[test]
    fn kinds_of_files() {
        assert_eq!(
            ["sun-03.ktx2", "sun-table.ktx2", "scene.glb", "lightmap-0740.exr"].map(kind_of),
            ["sun-*.ktx2", "sun-table.ktx2", "scene.glb", "lightmap-*.exr"]
        );
    }
}

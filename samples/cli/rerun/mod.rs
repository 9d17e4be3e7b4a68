//! `lucerna rerun`: makes a picture again from its metadata, in memory, and compares.
//!
//! A picture is untrusted data. Its metadata are parsed into the same settings as the command line, and rendered in this process. No
//! program is started, no file is written, and the picture cannot set command line options. The picture may name these files: the scene,
//! further files in the scene's folder, the height map of a terrain, the environment, for `daylight` and `prt` the bake, for `tonemap` its input, and a pipeline of
//! post-processing with its shaders. Each file is printed before it is read. Work that
//! would take hours is refused without `--long`.

pub mod bounds;
mod comparison;

use std::{path::PathBuf, process::ExitCode};

use lucerna::{
    Error, ErrorKind, Result,
    image::{self, Format, Layers},
    scene::Limits,
    technique::Technique,
    techniques::{self, Visitor},
    tracer::Reference,
};
use serde_json::Value;

pub use comparison::Comparison;

use crate::{
    args::{DeviceArgs, TalkArgs},
    console::{self, Console},
    outputs::Fresh,
    record::Record,
    reference,
    render::{self, Again},
    signals::Interrupt,
    tonemap,
};

/// Options of `lucerna rerun`.
#[derive(clap::Args, Clone, Debug)]
pub struct RerunArgs {
    /// An image that `isr`, `igi`, `fiv`, `daylight` or `prt render`, `lucerna reference` or `tonemap` wrote
    pub image: PathBuf,

    /// Largest accepted difference between two samples [default: the bits must be the same]
    #[arg(long, value_name = "X", value_parser = tolerance)]
    pub tolerance: Option<f32>,

    /// Allow work that may take hours: more than 1000 frames, or 10^10 paths
    #[arg(long)]
    pub long: bool,

    #[command(flatten)]
    pub device: DeviceArgs,

    #[command(flatten)]
    pub talk: TalkArgs,

    /// Print one JSON document
    #[arg(long)]
    pub json: bool,
}

fn tolerance(text: &str) -> Result<f32, String> {
    text.parse().ok().filter(|x: &f32| x.is_finite() && *x >= 0.0).ok_or_else(|| "expected a number from 0 on".into())
}

/// The program that made a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Maker {
    /// A technique by its name.
    Technique(&'static str),
    Reference,
    Tonemap,
}

/// The values of `command` in the metadata that are accepted.
fn makers() -> Vec<(Vec<&'static str>, Maker)> {
    // Programs write pictures of the path tracer by a command of its own.
    let rendered = techniques::NAMES.iter().filter(|name| **name != Reference::NAME);
    let techniques = rendered.map(|name| (vec![*name, "render"], Maker::Technique(name)));
    let more = [(vec!["lucerna", "reference"], Maker::Reference), (vec!["tonemap"], Maker::Tonemap)];
    techniques.chain(more).collect()
}

impl Maker {
    fn of(config: &Value) -> Result<Self> {
        let Some(command) = config.get("command") else {
            return Err(Error::input("does not say how it was made")
                .help("Pictures written by `render`, `lucerna reference` and `tonemap` do"));
        };
        let words = command.as_array().map(Vec::as_slice).unwrap_or_default();
        let same = |known: &[&str]| known.iter().copied().map(Some).eq(words.iter().map(Value::as_str));
        makers().into_iter().find(|(known, _)| same(known)).map(|(_, maker)| maker).ok_or_else(|| {
            let known: Vec<String> = makers().iter().map(|(words, _)| words.join(" ")).collect();
            let shown: String = command.to_string().chars().take(100).collect();
            Error::input(format!("{shown} is no command that is made again; those are {}", known.join(", ")))
                .at("command")
        })
    }
}

/// Renders the picture of a technique again.
struct ByTechnique<'a>(&'a Again<'a>);

impl Visitor for ByTechnique<'_> {
    type Output = Result<Option<Fresh>>;

    fn visit<T: Technique + 'static>(self) -> Self::Output {
        render::again::<T>(self.0)
    }
}

/// Makes the picture again and reports the differences.
///
/// # Errors
/// `Input` for wrong metadata and for the files that they name; `Comparison` if the pictures differ.
pub fn run(args: &RerunArgs, console: Console) -> Result<ExitCode> {
    let (path, limits) = (&args.image, Limits::default());
    let bytes = image::read_file_checked(path, limits.max_file)?;
    let mut old = image::decode(&bytes, &limits).map_err(|error| error.in_file(path))?;
    let format = Format::sniff(&bytes).unwrap_or(Format::Png);
    if format == Format::Pfm {
        old.metadata = image::metadata(path)?;
    }
    // Errors of these options are usage errors of this call.
    args.device.options()?;
    let interrupt = Interrupt::install();
    let fresh = again(args, &old, format, console, &interrupt).map_err(|error| {
        // A usage error of the recorded command is an error of the picture.
        let kind = if error.kind() == ErrorKind::Usage { ErrorKind::Input } else { error.kind() };
        match error.file() {
            Some(_) => Error::new(kind, error.to_string().trim_end_matches('.')).in_file(path),
            None => error.of_kind(kind).in_file(path),
        }
    })?;
    let Some(fresh) = fresh else { return Ok(ExitCode::from(interrupt.exit_code())) };
    let mut new = image::decode(&fresh.bytes, &limits).map_err(|error| error.in_file(path))?;
    if format == Format::Pfm {
        new.metadata = fresh.metadata;
    }
    let result = comparison::compare(&old, &new, bytes == fresh.bytes);
    match args.json {
        true => console::print_json(&console::to_json(&result)?)?,
        false => console::print(&result.text(path))?,
    }
    result.verdict(path, args.tolerance)?;
    Ok(ExitCode::SUCCESS)
}

fn again(
    args: &RerunArgs,
    old: &Layers,
    format: Format,
    console: Console,
    interrupt: &Interrupt,
) -> Result<Option<Fresh>> {
    let config = &old.metadata.config;
    let maker = Maker::of(config)?;
    let extent = [old.width, old.height];
    if maker == Maker::Tonemap {
        let RerunArgs { device, long, .. } = args;
        return tonemap::again(config, &tonemap::Again { extent, format, device, console, long: *long, interrupt });
    }
    let record = Record::from_config(config)?;
    bounds::check(&record, extent, args.long)?;
    for file in record.files() {
        console.info(&format!("reads {file}"));
    }
    let asked = Again {
        record: &record,
        camera: &old.metadata.camera,
        format,
        device: &args.device,
        talk: &args.talk,
        long: args.long,
        interrupt,
    };
    match maker {
        Maker::Technique(name) => techniques::visit(name, ByTechnique(&asked))
            .unwrap_or_else(|| Err(Error::new(ErrorKind::Runtime, format!("there is no technique {name}")))),
        Maker::Reference | Maker::Tonemap => reference::again(&asked),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn only_whole_commands_of_the_list_are_made_again() {
        assert_eq!(makers().len(), 7);
        for (words, maker) in makers() {
            assert_eq!(Maker::of(&json!({ "command": words })).unwrap(), maker);
        }
        for odd in [
            json!([]),
            json!(["isr"]),
            json!(["render", "isr"]),
            json!(["isr", "render", "--overwrite"]),
            json!(["isr", "reference"]),
            json!(["bash", "-c", "true"]),
            json!(["../isr", "render"]),
            json!(["ISR", "render"]),
            json!(["tonemap", null]),
            json!("isr render"),
            json!({ "0": "isr", "1": "render" }),
            json!(null),
        ] {
            let error = Maker::of(&json!({ "command": odd })).unwrap_err();
            assert!(error.exit_code() == 3 && error.to_string().contains("no command"), "{odd}: {error}");
        }
        assert!(Maker::of(&json!({ "kind": "isr" })).unwrap_err().to_string().contains("does not say how"));
    }
}

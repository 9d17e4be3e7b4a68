//! `lucerna bake status` and `lucerna bake verify`: the finished, missing and damaged units of a job.

use std::{path::PathBuf, process::ExitCode};

use lucerna::{
    Result,
    bake::{Store, Survey},
};
use serde_json::{Value, json};

use super::{folder_of, size};
use crate::{args::TalkArgs, console, program::STOPPED_EARLY};

/// Exit code of `verify` where files are damaged: an input that cannot be read.
const DAMAGED: u8 = 3;

/// Options of `lucerna bake status` and `lucerna bake verify`.
#[derive(clap::Args, Clone, Debug)]
pub struct StatusArgs {
    /// The folder of a job, or the file that it is for
    #[arg(value_name = "FOLDER")]
    pub folder: PathBuf,

    /// Print one JSON document
    #[arg(long)]
    pub json: bool,

    #[command(flatten)]
    pub talk: TalkArgs,
}

/// Prints the state of the units. `all`: checks all bytes; the exit code says whether they are intact.
///
/// # Errors
/// `Input` if the folder is that of no job.
pub(super) fn status(args: &StatusArgs, all: bool) -> Result<ExitCode> {
    let store = Store::open(&folder_of(&args.folder))?;
    let survey = store.survey(all)?;
    match args.json {
        true => console::print_json(&document(&store, &survey, all))?,
        false => console::print(&text(&store, &survey, all))?,
    }
    Ok(match (all, survey.faulty.is_empty(), survey.missing.is_empty()) {
        (false, ..) | (_, true, true) => ExitCode::SUCCESS,
        (_, false, _) => ExitCode::from(DAMAGED),
        (_, true, false) => ExitCode::from(STOPPED_EARLY),
    })
}

fn text(store: &Store, survey: &Survey, all: bool) -> String {
    let job = store.job();
    let mut lines = vec![format!("{}: {} ({})", store.folder().display(), job.key().kind(), job.key().digest())];
    let width = job.key().parts().iter().map(|part| part.name.len()).max().unwrap_or(0);
    for part in job.key().parts() {
        lines.push(format!("  {:width$}  {}", part.name, part.text));
    }
    for (number, stage) in job.stages().iter().enumerate() {
        let of = |units: &[lucerna::bake::UnitId]| units.iter().filter(|unit| unit.stage as usize == number).count();
        lines.push(format!("{}: {} of {} units", stage.name, of(&survey.whole), stage.costs.len()));
    }
    let looked = if all { "all bytes are read" } else { "headers are read; `lucerna bake verify` reads all bytes" };
    lines.push(format!("{} ({looked})", size(survey.bytes as f64)));
    if !survey.missing.is_empty() {
        lines.push(format!("missing: {}", job.list(&survey.missing)));
    }
    lines.extend(survey.faulty.iter().map(|(_, error)| format!("does not count: {error}")));
    lines.extend(survey.unknown.iter().map(|name| format!("no file of the job: {}", name.to_string_lossy())));
    lines.join("\n")
}

fn document(store: &Store, survey: &Survey, all: bool) -> Value {
    let job = store.job();
    let names = |units: &[lucerna::bake::UnitId]| units.iter().map(|&unit| job.name(unit)).collect::<Vec<_>>();
    let stages: Vec<_> = job
        .stages()
        .iter()
        .enumerate()
        .map(|(number, stage)| {
            let whole = survey.whole.iter().filter(|unit| unit.stage as usize == number).count();
            json!({ "name": stage.name, "units": stage.costs.len(), "whole": whole })
        })
        .collect();
    let faulty =
        survey.faulty.iter().map(|(unit, error)| json!({ "unit": job.name(*unit), "error": error.to_string() }));
    json!({
        "folder": store.folder(),
        "kind": job.key().kind(),
        "key": job.key().digest().to_string(),
        "parts": job.key().parts().iter().map(|p| json!({ "name": p.name, "text": p.text, "digest": p.digest.to_string() })).collect::<Vec<_>>(),
        "stages": stages,
        "bytes": survey.bytes,
        "read": if all { "all" } else { "headers" },
        "missing": names(&survey.missing),
        "faulty": faulty.collect::<Vec<_>>(),
        "unknown": survey.unknown.iter().map(|name| name.to_string_lossy().into_owned()).collect::<Vec<_>>(),
        "complete": survey.missing.is_empty() && survey.faulty.is_empty(),
    })
}

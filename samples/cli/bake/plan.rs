//! `lucerna bake plan`: the shards of a job, as text for an engine that runs them.

use std::{path::PathBuf, process::ExitCode};

use lucerna::{
    Error, Result,
    bake::{MOST_SHARDS, Shard, State, Store},
    image,
};
use serde_json::{Value, json};

use super::{folder_of, scripts};
use crate::{args::TalkArgs, console};

/// Options of `lucerna bake plan`.
#[derive(clap::Args, Clone, Debug)]
pub struct PlanArgs {
    /// List the units of this job instead, as JSON: a folder, or the file that it is for
    #[arg(value_name = "FOLDER", conflicts_with = "command", required_unless_present = "command")]
    pub folder: Option<PathBuf>,

    /// Parts of the work
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=MOST_SHARDS))]
    pub shards: u64,

    /// For whom the text is written [default: slurm]
    #[arg(long, value_enum, value_name = "ENGINE", conflicts_with = "folder")]
    pub format: Option<Format>,

    /// Name of the job [default: that of the file which the command writes]
    #[arg(long, value_name = "NAME", conflicts_with = "folder")]
    pub name: Option<String>,

    /// Write into this file instead of onto stdout
    #[arg(short, long, value_name = "FILE", help_heading = "Output")]
    pub output: Option<PathBuf>,

    /// Replace the file if it exists
    #[arg(long, help_heading = "Output")]
    pub overwrite: bool,

    #[command(flatten)]
    pub talk: TalkArgs,

    /// A command that takes --shard: `-- fiv precompute scene.glb --environment sky.exr -o scene.fiv`
    #[arg(last = true, value_name = "COMMAND")]
    pub command: Vec<String>,
}

/// For whom text is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// A script that submits an array job, and a job after it that joins: `sh FILE`
    #[default]
    Slurm,
    /// A job template of Open Job Description (Deadline Cloud, openjd): `openjd run FILE`
    #[value(name = "openjd")]
    OpenJd,
    /// A script for GNU parallel: `sh FILE`
    Parallel,
    /// A Snakefile: `snakemake -s FILE`
    Snakemake,
}

pub(super) fn plan(args: &PlanArgs) -> Result<ExitCode> {
    let text = match &args.folder {
        Some(folder) => format!("{:#}\n", list(&Store::open(&folder_of(folder))?, args.shards)),
        None => {
            let command = scripts::Command::new(&args.command, args.name.as_deref(), args.shards)?;
            command.text(args.format.unwrap_or_default())?
        }
    };
    match &args.output {
        Some(path) => image::write_atomic(path, text.as_bytes(), args.overwrite)?,
        None => console::print(text.trim_end())?,
    }
    Ok(ExitCode::SUCCESS)
}

/// The units of a job, with the shard that computes each.
fn list(store: &Store, shards: u64) -> Value {
    let job = store.job();
    let mut units: Vec<_> = (0..shards)
        .filter_map(|index| Shard::of(index, shards))
        .flat_map(|shard| shard.units(job).into_iter().map(move |unit| (unit, shard)))
        .collect();
    units.sort_by_key(|(unit, _)| *unit);
    let units = units.into_iter().map(|(unit, shard)| {
        let needs: Vec<_> = job.needs(unit).into_iter().map(|need| job.name(need)).collect();
        json!({
            "unit": job.name(unit),
            "file": job.file_name(unit),
            "cost": job.cost(unit),
            "needs": needs,
            "shard": shard.to_string(),
            "there": matches!(store.look(unit), State::Whole(_)),
        })
    });
    let key = job.key();
    json!({ "kind": key.kind(), "key": key.digest().to_string(), "shards": shards, "units": units.collect::<Vec<_>>() })
}

/// Why a command cannot be planned.
pub(super) fn wrong(what: impl Into<String>) -> Error {
    Error::usage(what).at("COMMAND")
}

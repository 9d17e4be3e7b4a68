//! Command line of [`lucerna::bake`]: the options and the progress of commands that compute units, `lucerna bake` and `lucerna merge`.

mod args;
mod compute;
mod join;
mod plan;
mod rate;
mod scripts;
mod status;

use std::{
    ffi::OsString,
    path::{Path, PathBuf},
    process::ExitCode,
    time::{Duration, Instant},
};

use lucerna::{
    Error, Result,
    bake::{self, Job, Options, Shard, Store},
};

pub use args::BakeArgs;
pub use compute::{Ended, Work};
pub use join::{JoinArgs, join, joined};
pub use plan::PlanArgs;
pub use rate::Rate;
pub use status::StatusArgs;

use crate::{
    args::TalkArgs,
    console::Console,
    daylight::{self, DayBakeArgs},
    fiv::{self, PrecomputeArgs},
    programs::daylight::never,
    prt::{self, PrtBakeArgs},
    reference::Span,
    signals::Interrupt,
};

/// Options of commands that compute units.
#[derive(clap::Args, Clone, Debug)]
pub struct UnitsArgs {
    /// Compute only the units of part I of N. `auto`: the part of this task in an array job of Slurm, Grid Engine or Kubernetes; `auto/N`: of
    /// N parts. The same command without --shard computes the missing units and joins all units
    #[arg(long, value_name = "I/N|auto", value_parser = shard, help_heading = "Units")]
    pub shard: Option<Shard>,

    /// Start no unit that would end after this time: 90, 90s, 10m, 1h30m. Exit code 8 if units are missing then
    #[arg(long, value_name = "TIME", help_heading = "Units")]
    pub time_limit: Option<Span>,

    /// Start again, even if a stopped run has left units of this or another job; with --shard only its own units of this job are dropped
    #[arg(long, help_heading = "Units")]
    pub restart: bool,
}

/// Help for a folder of another job.
const RESTART: &str = "Give --restart to start anew over it, or name another file with -o";

impl UnitsArgs {
    /// The folder of a job.
    ///
    /// # Errors
    /// `Output` if it is that of another job, or cannot be written.
    pub fn store(&self, folder: &Path, job: Job, console: Console) -> Result<Store> {
        if self.restart
            && let Ok(store) = Store::open(folder)
        {
            if store.job().key() == job.key() {
                // Other machines may have finished their units of the same job.
                for unit in self.shard.unwrap_or_default().units(store.job()) {
                    // Most units do not exist yet.
                    let _ = std::fs::remove_file(store.path(unit));
                }
            } else {
                said_unknown(folder, &store.remove()?, console);
            }
        }
        Store::create(folder, job).map_err(|error| error.help(RESTART))
    }

    /// Limits of a run that began at `begun`.
    pub fn options(&self, begun: Instant) -> Options {
        Options {
            shard: self.shard.unwrap_or_default(),
            time_limit: self.time_limit.map(|span| span.0),
            begun,
            stop: Interrupt::stop(),
            wait: Duration::ZERO,
        }
    }
}

/// Reads `--shard`.
pub fn shard(text: &str) -> Result<Shard, String> {
    let variable = |name: &str| std::env::var(name).ok();
    let auto = |count| Shard::auto(variable, count).map_err(|error| error.to_string());
    match text.strip_prefix("auto") {
        Some("") => auto(None),
        Some(rest) => match rest.strip_prefix('/').and_then(|count| count.parse().ok()) {
            Some(count) => auto(Some(count)),
            None => text.parse(),
        },
        None => text.parse(),
    }
}

/// The folder of the units of a file: `FILE.parts`.
///
/// # Errors
/// `Usage` if `file` is no name of a file.
pub fn parts(file: &Path) -> Result<PathBuf> {
    let name = file.file_name().ok_or_else(|| Error::usage("is not a file name").in_file(file))?;
    let mut name = name.to_owned();
    name.push(".parts");
    Ok(file.with_file_name(name))
}

/// A job's folder, which may be named by the file that it is for.
fn folder_of(path: &Path) -> PathBuf {
    match parts(path) {
        Ok(parts) if !path.is_dir() && parts.is_dir() => parts,
        _ => path.to_owned(),
    }
}

fn said_unknown(folder: &Path, unknown: &[OsString], console: Console) {
    for name in unknown {
        console.info(&format!("note: {}: is no file of the job, and stays", folder.join(name).display()));
    }
}

/// Removes the units of a file that is written.
///
/// # Errors
/// `Output` if one cannot be removed.
pub fn remove(store: Store, console: Console) -> Result<()> {
    let folder = store.folder().to_owned();
    said_unknown(&folder, &store.remove()?, console);
    Ok(())
}

/// Options of `lucerna bake`.
#[derive(clap::Subcommand, Debug)]
pub enum BakeCommand {
    /// Compute the light of a scene for all times of a day (as `daylight bake`)
    #[command(args_override_self = true, mut_arg("default_light", never), mut_arg("output", |arg| arg.value_name("FILE.day")))]
    Daylight(Box<DayBakeArgs>),
    /// Compute the transport of light in a room (as `prt bake`)
    #[command(args_override_self = true, mut_arg("output", |arg| arg.value_name("FILE.prt")))]
    Prt(Box<PrtBakeArgs>),
    /// Compute the vectors of occluders under an environment (as `fiv precompute`)
    #[command(args_override_self = true, mut_arg("output", |arg| arg.value_name("FILE.fiv")))]
    Fiv(Box<PrecomputeArgs>),
    /// List the finished, missing and damaged units of a job
    Status(StatusArgs),
    /// Read all bytes of a job's units; exit code 3 if some are damaged, 8 if some are missing
    Verify(StatusArgs),
    /// Write the text that runs a command on several machines, or list the units of a job
    Plan(Box<PlanArgs>),
}

impl BakeCommand {
    pub fn talk(&self) -> &TalkArgs {
        match self {
            Self::Daylight(args) => &args.run.talk,
            Self::Prt(args) => &args.run.talk,
            Self::Fiv(args) => &args.run.talk,
            Self::Status(args) | Self::Verify(args) => &args.talk,
            Self::Plan(args) => &args.talk,
        }
    }

    /// Runs the command.
    ///
    /// # Errors
    /// Whatever fails, with the kind that decides the exit code.
    pub fn run(&self) -> Result<ExitCode> {
        let console = self.talk().console();
        match self {
            Self::Daylight(args) => daylight::bake(args, console),
            Self::Prt(args) => prt::bake(args, console),
            Self::Fiv(args) => fiv::precompute(args, console),
            Self::Status(args) => status::status(args, false),
            Self::Verify(args) => status::status(args, true),
            Self::Plan(args) => plan::plan(args),
        }
    }
}

/// Bytes as people read them.
fn size(bytes: f64) -> String {
    let units = ["B", "kB", "MB", "GB", "TB"];
    let (mut number, mut unit) = (bytes, 0);
    while number >= 999.5 && unit + 1 < units.len() {
        number /= 1000.0;
        unit += 1;
    }
    match (unit, number < 10.0) {
        (0, _) => format!("{number:.0} {}", units[unit]),
        (_, true) => format!("{number:.1} {}", units[unit]),
        (_, false) => format!("{number:.0} {}", units[unit]),
    }
}

/// The message for units that depend on units of other shards.
pub fn waits(job: &Job, units: &[bake::UnitId]) -> String {
    format!("the rest needs units of other shards that are not there yet: {}", job.list(units))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_told_roughly() {
        let all = [
            (0.0, "0 B"),
            (999.0, "999 B"),
            (1500.0, "1.5 kB"),
            (147_456.0, "147 kB"),
            (999_999.0, "1.0 MB"),
            (3.2e13, "32 TB"),
        ];
        all.iter().for_each(|(bytes, text)| assert_eq!(size(*bytes), *text));
    }

    #[test]
    fn units_lie_beside_their_file() {
        assert_eq!(parts(Path::new("a/b.fiv")).unwrap(), PathBuf::from("a/b.fiv.parts"));
        assert_eq!(parts(Path::new("/")).unwrap_err().exit_code(), 2);
    }

    #[test]
    fn shards_are_read_and_without_an_array_job_auto_says_so() {
        assert_eq!(shard("2/5").unwrap().to_string(), "2/5");
        for (text, part) in
            [("auto", "array job"), ("auto/x", "expected I/N"), ("automatic", "expected I/N"), ("3/2", "I/N")]
        {
            assert!(shard(text).unwrap_err().contains(part), "{text}");
        }
    }
}

//! Computing the units of a command, with progress and messages.

use std::{process::ExitCode, time::Instant};

use lucerna::{
    Error, ErrorKind, Result,
    bake::{End, Needed, Progress, Store, UnitId, run},
};

use super::{Rate, UnitsArgs, waits};
use crate::{console::Console, program::STOPPED_EARLY, progress::ProgressMode, signals::Interrupt};

/// A command's work on the units of a job.
#[derive(Debug)]
pub struct Work<'a> {
    pub store: &'a Store,
    pub args: &'a UnitsArgs,
    /// Start of the command.
    pub begun: Instant,
    pub progress: ProgressMode,
    /// Noun for the work of units: `samples`.
    pub what: &'static str,
    pub console: Console,
    pub interrupt: &'a Interrupt,
}

/// The end of the work.
#[derive(Debug)]
pub enum Ended {
    /// All units of the job exist, and the command has no `--shard`: it joins them.
    Whole(Progress),
    /// All units of the command's shard exist. This number of units of other shards is missing.
    Shard(Progress, usize),
    /// Units of the command are missing; the message was printed.
    Early(Progress, ExitCode),
}

impl Work<'_> {
    /// Computes the missing units.
    ///
    /// # Errors
    /// The errors of `unit`; `Output` if a unit cannot be written; `Interrupted` if the command was stopped before its first unit.
    pub fn compute(&self, unit: impl FnMut(UnitId, Needed<'_>) -> Result<Vec<u8>>) -> Result<Ended> {
        let Self { store, what, console, interrupt, .. } = self;
        let folder = store.folder().display();
        let mut meter = None;
        let outcome = run(store, &self.args.options(self.begun), unit, |progress| {
            let [done, total] = progress.cost;
            let fresh = meter.is_none();
            if fresh && done > 0 {
                console.info(&format!("{folder}: goes on after {done} of {total} {what}"));
            }
            let meter = meter.get_or_insert_with(|| Rate::new(self.progress, console.is_quiet(), what, done, total));
            if done > 0 {
                interrupt.keep();
            }
            if !fresh || done < total {
                meter.show(done, progress.bytes);
            }
        })?;
        let [done, total] = outcome.progress.cost;
        match &outcome.end {
            End::Stopped if done == 0 && interrupt.requested() => {
                return Err(Error::new(ErrorKind::Interrupted, "stopped on request"));
            }
            End::Stopped | End::TimeLimit => {
                let why = if interrupt.requested() { "stopped" } else { "time limit: stopped" };
                console.info(&format!("{why} after {done} of {total} {what}; the same command goes on"));
                return Ok(Ended::Early(outcome.progress, ExitCode::from(STOPPED_EARLY)));
            }
            End::Waits(units) => {
                console.info(&waits(store.job(), units));
                return Ok(Ended::Early(outcome.progress, ExitCode::from(STOPPED_EARLY)));
            }
            End::Done => {}
        }
        let Some(shard) = self.args.shard else { return Ok(Ended::Whole(outcome.progress)) };
        let missing = store.survey(false)?.missing.len();
        let rest = match missing {
            0 => "all units are there; the same command without --shard joins them".into(),
            missing => format!("{missing} units of other shards are missing"),
        };
        let units = outcome.progress.units[1];
        console.info(&format!("{folder}: shard {shard} is done, {units} units; {rest}"));
        Ok(Ended::Shard(outcome.progress, missing))
    }
}

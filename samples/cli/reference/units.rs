//! A picture in bands that several machines trace: `lucerna reference --shard`.

use std::{
    path::{Path, PathBuf},
    time::Instant,
};

use lucerna::{
    Error, Result,
    bake::{Progress, Store},
    tracer::{Tracer, bands},
};
use serde_json::{Value, json};

use super::{ReferenceArgs, Settings};
use crate::{
    bake::{self, Ended, UnitsArgs, Work},
    console::Console,
    signals::Interrupt,
};

/// The bands of a picture. The folder with its units lies next to the picture.
#[derive(Debug)]
pub struct Bands {
    store: Store,
    args: UnitsArgs,
    samples: u64,
}

impl Bands {
    /// Whether the picture is made of bands, and where: beside the first of its files (`outputs`), or beside that where shards have left a
    /// folder. With `--resume` the state of a single run counts, and with `--restart` nothing that is left.
    ///
    /// # Errors
    /// `Usage` for options that need the whole picture; `Output` if a folder cannot be removed.
    pub fn folder(args: &ReferenceArgs, outputs: &[PathBuf], console: Console) -> Result<Option<PathBuf>> {
        let folders = outputs.iter().map(|output| bake::parts(output)).collect::<Result<Vec<_>>>()?;
        let of_bands = |folder: &&PathBuf| Store::open(folder).is_ok_and(|s| s.job().key().kind() == bands::KIND);
        let found = folders.iter().find(of_bands);
        if args.shard.is_none() {
            if args.restart
                && let Some(folder) = found
            {
                bake::remove(Store::open(folder)?, console)?;
            }
            if args.restart || args.resume {
                return Ok(None);
            }
        }
        if args.shard.is_some() && folders.is_empty() {
            let help = "Name a file with -o: the units lie in a folder beside it";
            return Err(Error::usage("units need a file").at("--shard").help(help));
        }
        let Some(folder) = found.or(args.shard.and_then(|_| folders.first())) else { return Ok(None) };
        if args.target_error.is_some() {
            let what =
                format!("shards have left {}, and all pixels of their picture have --spp paths", folder.display());
            return Err(Error::usage(what).at("--target-error").help("Leave --target-error out, or give --restart"));
        }
        Ok(Some(folder.clone()))
    }

    /// The bands in this folder.
    ///
    /// # Errors
    /// `Output` if the folder belongs to another picture or cannot be written.
    pub fn open(
        args: &ReferenceArgs,
        folder: &Path,
        tracer: &Tracer<'_>,
        settings: &Settings,
        about: &Value,
        console: Console,
    ) -> Result<Self> {
        let units = UnitsArgs { shard: args.shard, time_limit: args.time_limit, restart: args.restart };
        let store = units.store(folder, tracer.bands(settings.samples, about)?, console)?;
        Ok(Self { store, args: units, samples: settings.samples })
    }

    /// Traces the missing bands.
    ///
    /// # Errors
    /// As [`Work::compute`].
    pub fn compute(
        &self,
        tracer: &mut Tracer<'_>,
        args: &ReferenceArgs,
        begun: Instant,
        console: Console,
        interrupt: &Interrupt,
    ) -> Result<Ended> {
        let Self { store, args: units, samples } = self;
        let work = Work { store, args: units, begun, progress: args.progress, what: "paths", console, interrupt };
        // A band that is not finished at the limit is dropped: its time is not known before.
        let over = || units.time_limit.is_some_and(|limit| begun.elapsed() >= limit.0);
        work.compute(|unit, _| tracer.band(unit, *samples, || !interrupt.requested() && !over()))
    }

    /// Puts the picture together.
    ///
    /// # Errors
    /// As [`Tracer::join`].
    pub fn join(&self, tracer: &mut Tracer<'_>) -> Result<()> {
        tracer.join(&self.store, self.samples)
    }

    /// The JSON document about a run that wrote no picture.
    ///
    /// # Errors
    /// `Output` if the folder cannot be read.
    pub fn report(&self, progress: &Progress) -> Result<Value> {
        let missing = self.store.survey(false)?.missing.len();
        let json = json!({
            "folder": self.store.folder(),
            "shard": self.args.shard.map(|shard| shard.to_string()),
            "units": progress.units[1],
            "missing": missing,
            "paths": progress.cost[1],
            "computed": progress.cost[0] - progress.before,
            "seconds": progress.seconds,
            "complete": progress.cost[0] == progress.cost[1],
        });
        Ok(json)
    }

    /// Removes the units of a picture that is written.
    ///
    /// # Errors
    /// `Output` if one cannot be removed.
    pub fn remove(self, console: Console) -> Result<()> {
        bake::remove(self.store, console)
    }
}

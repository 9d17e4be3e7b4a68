//! A picture in bands that several machines trace: `lucerna reference --shard`.

use std::{path::Path, time::Instant};

use lucerna::{
    Error, Result,
    bake::{Progress, Store},
    tracer::Tracer,
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
    /// The bands if `--shard` asks for them, or if shards have left their folder next to the picture at `path`.
    ///
    /// # Errors
    /// `Usage` for options that need the whole picture; `Output` if the folder belongs to another picture or cannot be written.
    pub fn of(
        args: &ReferenceArgs,
        path: Option<&Path>,
        tracer: &Tracer<'_>,
        settings: &Settings,
        about: &Value,
        console: Console,
    ) -> Result<Option<Self>> {
        let Some(path) = path else {
            let help = "Name a file with -o: the units lie in a folder beside it";
            return match args.shard {
                Some(_) => Err(Error::usage("units need a file").at("--shard").help(help)),
                None => Ok(None),
            };
        };
        let folder = bake::parts(path)?;
        if args.shard.is_none() && (args.restart || !folder.is_dir()) {
            return Ok(None);
        }
        if args.target_error.is_some() {
            let what =
                format!("shards have left {}, and all pixels of their picture have --spp paths", folder.display());
            return Err(Error::usage(what).at("--target-error").help("Leave --target-error out, or give --restart"));
        }
        let units = UnitsArgs { shard: args.shard, time_limit: args.time_limit, restart: args.restart };
        let store = units.store(&folder, tracer.bands(settings.samples, about)?, console)?;
        Ok(Some(Self { store, args: units, samples: settings.samples }))
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
        work.compute(|unit, _| tracer.band(unit, *samples, || !interrupt.requested()))
    }

    /// Puts the picture together.
    ///
    /// # Errors
    /// As [`Tracer::join`].
    pub fn join(&self, tracer: &mut Tracer<'_>) -> Result<()> {
        tracer.join(&self.store, self.samples)
    }

    /// The JSON document about a shard.
    pub fn report(&self, progress: &Progress, missing: usize) -> Value {
        json!({
            "folder": self.store.folder(),
            "shard": self.args.shard.map(|shard| shard.to_string()),
            "units": progress.units[1],
            "missing": missing,
            "paths": progress.cost[1],
            "computed": progress.cost[1] - progress.before,
            "seconds": progress.seconds,
        })
    }

    /// Removes the units of a picture that is written.
    ///
    /// # Errors
    /// `Output` if one cannot be removed.
    pub fn remove(self, console: Console) -> Result<()> {
        bake::remove(self.store, console)
    }
}

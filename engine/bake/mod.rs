//! Long computations in units. They can be stopped, continued, spread over machines and joined; the bytes are the same in every case.
//!
//! A [`Job`] is a list of units in stages, with a [`Key`] of all inputs that decide the bytes. A unit is a pure function of the key and of the
//! units that it needs. [`run()`] computes the units, and a [`Store`] keeps one file for each, which is complete or absent. A finished unit is
//! not computed again: the same command continues after a stop, and each [`Shard`] computes its own units on its own machine.
//! [`merge()`] joins folders of one job.
//!
//! ```
//! use lucerna::bake::{self, Job, Key, Options, Stage, Store, Which};
//! # fn main() -> lucerna::Result<()> {
//! # let temporary = tempfile::tempdir().unwrap();
//! # let folder = temporary.path().join("squares.parts");
//! let stages = vec![Stage::new("squares", vec![1; 4]), Stage::new("sum", vec![1]).needs(0, Which::All)];
//! let store = Store::create(&folder, Job::new(Key::new("example", 1), stages)?)?;
//! let outcome = bake::run(
//!     &store,
//!     &Options::default(),
//!     |unit, needed| match unit.stage {
//!         0 => Ok(vec![(unit.index * unit.index) as u8]),
//!         _ => needed.units().iter().try_fold(0, |sum, &of| Ok(sum + needed.open(of)?.bytes()?[0])).map(|sum| vec![sum]),
//!     },
//!     |progress| println!("{} of {} units", progress.units[0], progress.units[1]),
//! )?;
//! assert_eq!((outcome.end, outcome.computed), (bake::End::Done, 5));
//! let sum = store.job().units().last().unwrap();
//! assert_eq!(store.open_unit(sum)?.bytes()?, [14]);
//! # Ok(())
//! # }
//! ```
pub mod container;
mod eigen;
mod job;
mod key;
pub mod lowrank;
pub mod merge;
pub mod pca;
mod run;
mod shard;
mod store;
pub mod unit;

pub use job::{Job, MANIFEST, MOST_STAGES, MOST_UNITS, Need, Stage, UnitId, VERSION, Which};
pub use key::{Digest, Key, Part};
pub use merge::{Merged, merge};
pub use run::{End, Needed, Options, Outcome, Progress, run};
pub use shard::{MOST_SHARDS, Shard};
pub use store::{State, Store, Survey};
pub use unit::Payload;

#[cfg(test)]
mod tests;

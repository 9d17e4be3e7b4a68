//! Experiments: a TOML file names scenes, views, techniques with matrices of settings, references and measures. Running the experiment
//! renders pictures, stores them by a digest of their inputs, and writes a report.
//!
//! This module has the generic parts: reading the file ([`mod@file`]), rendering missing pictures ([`run`]), access to pictures and
//! measures ([`results`]). [`analysis`] has the functions that interpret the numbers of an experiment.
//!
//! To add an experiment, add a file to `samples/experiments/` and name it in [`file::BUILTIN`]. If the generic tables are not enough, add
//! a function `fn(&Results, &mut Page) -> Result<()>` to [`analysis`]. To add a technique, add an entry to [`kinds::KINDS`].

pub mod analysis;
pub mod cache;
pub mod command;
pub mod digest;
pub mod file;
pub mod kinds;
pub mod place;
pub mod progress;
pub mod results;
pub mod run;
pub mod sealed;
pub mod sources;

//! Experiments: a TOML file names scenes, views, techniques with matrices of settings, references and measures; running it gives
//! pictures, kept by what decided them, and a report.
//!
//! What is generic is here: reading the file ([`mod@file`]), rendering what is not there yet ([`run`]), asking for pictures and
//! measures ([`results`]). What the numbers of one experiment mean is a function in [`analysis`].
//!
//! To add an experiment: a file in `samples/experiments/`, named in [`file::BUILTIN`]; if the generic tables do not do, a function
//! `fn(&Results, &mut Page) -> Result<()>` in [`analysis`]. To add a technique: an entry in [`kinds::KINDS`].

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

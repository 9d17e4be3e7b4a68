//! Completions for shells, and man pages, of all programs.

use std::path::{Path, PathBuf};

use clap::Command;
use clap_complete::Shell;
use lucerna::{Error, ErrorKind, Result, image};

use super::all;
use crate::console::{self, Console};

/// Prints the completions of all programs, for `source <(lucerna completions bash)` or a file that the shell reads.
///
/// # Errors
/// `Output` if standard output cannot be written.
pub fn completions(shell: Shell) -> Result<()> {
    let mut text = Vec::new();
    for mut program in all() {
        let name = program.get_name().to_owned();
        clap_complete::generate(shell, &mut program, name, &mut text);
    }
    console::print(String::from_utf8_lossy(&text).trim_end())
}

/// Writes a man page for every program and each of its commands into a folder.
///
/// # Errors
/// `Output` if a page exists and is not to be replaced, or cannot be written.
pub fn man(folder: &Path, overwrite: bool, console: Console) -> Result<()> {
    let mut list = Vec::new();
    for mut program in all() {
        program = program.disable_help_subcommand(true);
        program.build();
        pages(&program, &mut list)?;
    }
    let paths: Vec<PathBuf> = list.iter().map(|(name, _)| folder.join(name)).collect();
    // Nothing is written if one of the pages must not be.
    paths.iter().try_for_each(|path| image::probe_output(path, overwrite))?;
    for (path, (_, text)) in paths.iter().zip(&list) {
        image::write_atomic(path, text, overwrite)?;
    }
    console.info(&format!("wrote {} pages to {}", list.len(), folder.display()));
    Ok(())
}

fn pages(command: &Command, list: &mut Vec<(String, Vec<u8>)>) -> Result<()> {
    let page = clap_mangen::Man::new(command.clone());
    let mut text = Vec::new();
    page.render(&mut text)
        .map_err(|error| Error::new(ErrorKind::Runtime, "a man page cannot be made").caused_by(error))?;
    list.push((page.get_filename(), text));
    command.get_subcommands().filter(|sub| !sub.is_hide_set()).try_for_each(|sub| pages(sub, list))
}

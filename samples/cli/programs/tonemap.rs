//! `tonemap`: pictures of light become pictures for a screen.

use std::process::ExitCode;

use clap::Parser;
use lucerna::Result;

use crate::{
    console::Console,
    listed, program,
    programs::help,
    tonemap::{self, TonemapArgs},
};

/// Develops HDR pictures: from the light of a scene to what a screen or a print can show.
#[derive(Parser, Debug)]
#[command(name = "tonemap", version, max_term_width = 120, args_override_self = true)]
pub struct Arguments {
    #[command(flatten)]
    tonemap: TonemapArgs,
}

/// The program.
pub fn main() -> ExitCode {
    let Arguments { tonemap } = help::parse::<Arguments>();
    let console = tonemap.talk.console();
    program::run(console, || run(tonemap, console))
}

/// Develops pictures. Folders and patterns stand for their pictures.
///
/// # Errors
/// Any error of the run. Its kind decides the exit code.
pub fn run(mut args: TonemapArgs, console: Console) -> Result<ExitCode> {
    args.inputs = listed::expanded(&args.inputs)?;
    tonemap::run(&args, console)
}

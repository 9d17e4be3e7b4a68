//! `igi`: instant global illumination.

use std::process::ExitCode;

use crate::{
    args::RenderArgs,
    program,
    programs::help,
    render::{self, Given},
};
use clap::{Args, Parser, Subcommand};
use lucerna::{
    Result,
    techniques::igi::{Igi, Mode},
};

/// Instant global illumination: direct light by shadow rays, indirect light by ray-traced virtual point lights.
#[derive(Parser, Debug)]
#[command(name = "igi", version, max_term_width = 120)]
pub struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// Render a scene into images
    #[command(args_override_self = true)]
    Render(Box<IgiArgs>),
}

/// Options of `igi render`.
#[derive(Args, Debug)]
pub struct IgiArgs {
    #[command(flatten)]
    pub common: RenderArgs,

    /// What the picture shows
    #[arg(long, value_parser = render::mode::<Mode>(), default_value = "igi", help_heading = "Technique")]
    pub mode: Mode,
}

/// The program.
pub fn main() -> ExitCode {
    let Command::Render(args) = help::parse::<Arguments>().command;
    program::run(args.common.talk.console(), || render(&args))
}

/// Renders the frames of a command line.
///
/// # Errors
/// Any error of the run. Its kind decides the exit code.
pub fn render(args: &IgiArgs) -> Result<ExitCode> {
    render::render(&args.common, &Given::<Igi>::by(&args.common, args.mode)?)
}

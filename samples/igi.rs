//! `igi`: instant global illumination.

use std::process::ExitCode;

use clap::{Args, Parser, Subcommand};
use lucerna::techniques::igi::{Igi, Mode};
use lucerna_samples::{
    args::RenderArgs,
    program,
    render::{self, Given},
};

/// Instant global illumination: direct light by shadow rays, indirect light by ray-traced virtual point lights.
#[derive(Parser, Debug)]
#[command(name = "igi", version, max_term_width = 120)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// Render a scene into images
    #[command(args_override_self = true)]
    Render(Box<IgiArgs>),
}

#[derive(Args, Debug)]
struct IgiArgs {
    #[command(flatten)]
    common: RenderArgs,

    /// What the picture shows
    #[arg(long, value_parser = render::mode::<Mode>(), default_value = "igi", help_heading = "Technique")]
    mode: Mode,
}

fn main() -> ExitCode {
    let Command::Render(args) = Arguments::parse().command;
    program::run(args.common.talk.console(), || {
        render::render(&args.common, &Given::<Igi>::by(&args.common, args.mode)?)
    })
}

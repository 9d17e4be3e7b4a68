//! `igi`: instant global illumination.

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use lucerna_samples::{
    program,
    technique::igi::{self, IgiArgs},
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

fn main() -> ExitCode {
    let Command::Render(render) = Arguments::parse().command;
    program::run(render.common.talk.console(), || igi::run(&render))
}

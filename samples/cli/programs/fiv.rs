//! `fiv`: soft shadows under an environment from fullsphere irradiance vectors.

use std::process::ExitCode;

use crate::{
    bake::{self, JoinArgs},
    fiv::{self, EnvironmentArgs, FivArgs, PrecomputeArgs, SteadyArgs},
    program,
    programs::help,
};
use clap::{Parser, Subcommand};

/// Soft shadows under an environment from fullsphere irradiance vectors.
#[derive(Parser, Debug)]
#[command(name = "fiv", version, max_term_width = 120)]
pub struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// Compute the vectors of occluders under an environment and write them to a file
    #[command(args_override_self = true, mut_arg("output", |arg| arg.value_name("FILE.fiv")))]
    Precompute(Box<PrecomputeArgs>),
    /// Join the parts of a file (as `lucerna merge`)
    Merge(JoinArgs),
    /// Write a built-in environment into a file
    Environment(EnvironmentArgs),
    /// Compare the changes between the frames of a sequence with those of a sequence by brute force, where surfaces
    /// stand still
    Steady(SteadyArgs),
    /// Render a scene into images
    // There are no settings of the thesis as a preset, so the help does not offer them.
    #[command(args_override_self = true, mut_arg("paper", |arg| arg.hide(true)))]
    Render(Box<FivArgs>),
}

/// The program.
pub fn main() -> ExitCode {
    match help::parse::<Arguments>().command {
        Command::Precompute(args) => {
            let console = args.run.talk.console();
            program::run(console, || fiv::precompute(&args, console))
        }
        Command::Merge(args) => {
            let console = args.talk.console();
            program::run(console, || bake::join(&args, console))
        }
        Command::Environment(args) => {
            let console = args.talk.console();
            program::run(console, || fiv::environment(&args, console))
        }
        Command::Steady(args) => {
            let console = args.talk.console();
            program::run(console, || fiv::steady(&args, console))
        }
        Command::Render(args) => program::run(args.common.talk.console(), || fiv::render(&args, None)),
    }
}

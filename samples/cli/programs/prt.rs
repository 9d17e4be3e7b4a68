//! `prt`: precomputed radiance transfer for lights that move inside a room.

use std::process::ExitCode;

use crate::{
    bake::{self, JoinArgs},
    program,
    programs::help,
    prt::{self, PrtArgs, PrtBakeArgs, PrtCheckArgs, PrtInfoArgs},
};
use clap::{Parser, Subcommand};

/// Precomputed radiance transfer for lights that move inside a room.
#[derive(Parser, Debug)]
#[command(name = "prt", version, max_term_width = 120)]
pub struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// Compute the transport of light in a room and write a file
    #[command(args_override_self = true, mut_arg("output", |arg| arg.value_name("FILE.prt")))]
    Bake(Box<PrtBakeArgs>),
    /// Measure the error of a bake beside light by following paths
    #[command(args_override_self = true)]
    Check(Box<PrtCheckArgs>),
    /// Print the contents, the size and the errors of a bake
    Info(PrtInfoArgs),
    /// Join the parts of a bake (as `lucerna merge`)
    Merge(JoinArgs),
    /// Render a room under lights that move into images
    #[command(args_override_self = true)]
    Render(Box<PrtArgs>),
}

/// The program.
pub fn main() -> ExitCode {
    match help::parse::<Arguments>().command {
        Command::Bake(args) => {
            let console = args.run.talk.console();
            program::run(console, || prt::bake(&args, console))
        }
        Command::Check(args) => {
            let console = args.talk.console();
            program::run(console, || prt::check(&args, console))
        }
        Command::Info(args) => {
            let console = args.talk.console();
            program::run(console, || prt::info(&args, console))
        }
        Command::Merge(args) => {
            let console = args.talk.console();
            program::run(console, || bake::join(&args, console))
        }
        Command::Render(args) => program::run(args.common.talk.console(), || prt::render(&args)),
    }
}

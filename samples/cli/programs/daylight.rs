//! `daylight`: indirect light for every time of day, baked once and lit live.

use std::process::ExitCode;

use crate::{
    bake::{self, JoinArgs},
    daylight::{self, DayArgs, DayBakeArgs, DayExportArgs, DayFramesArgs, DayInfoArgs},
    program,
    programs::help,
};
use clap::{Parser, Subcommand};

/// Indirect light for every time of day, baked once and lit live.
#[derive(Parser, Debug)]
#[command(name = "daylight", version, max_term_width = 120)]
pub struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// Compute the light of a scene for all times of a day and write it to a file
    #[command(args_override_self = true, mut_arg("default_light", never), mut_arg("output", |arg| arg.value_name("FILE.day")))]
    Bake(Box<DayBakeArgs>),
    /// Print the contents, the size and the errors of a bake
    Info(DayInfoArgs),
    /// Decode every step of a bake into a file of uncompressed frames, which `render --stream` reads step by step
    Frames(DayFramesArgs),
    /// Write a lightmap bake in forms that other programs read: glTF, EXR, KTX2, JSON
    #[command(args_override_self = true, mut_arg("time", |arg| arg.long("scene-time")), mut_arg("default_light", never))]
    Export(Box<DayExportArgs>),
    /// Join the parts of a bake (as `lucerna merge`)
    Merge(JoinArgs),
    /// Render a scene at times of the day into images
    #[command(args_override_self = true, mut_arg("time", |arg| arg.long("scene-time")), mut_arg("default_light", never))]
    Render(Box<DayArgs>),
}

/// A bake has the light of its day and the lamps of the scene; no lights are added for scenes without any.
pub fn never(argument: clap::Arg) -> clap::Arg {
    argument.default_value("never").hide(true)
}

/// The program.
pub fn main() -> ExitCode {
    match help::parse::<Arguments>().command {
        Command::Bake(args) => {
            let console = args.run.talk.console();
            program::run(console, || daylight::bake(&args, console))
        }
        Command::Info(args) => {
            let console = args.talk.console();
            program::run(console, || daylight::info(&args, console))
        }
        Command::Frames(args) => {
            let console = args.talk.console();
            program::run(console, || daylight::frames(&args, console))
        }
        Command::Export(args) => {
            let console = args.talk.console();
            program::run(console, || daylight::export(&args, console))
        }
        Command::Merge(args) => {
            let console = args.talk.console();
            program::run(console, || bake::join(&args, console))
        }
        Command::Render(args) => program::run(args.common.talk.console(), || daylight::render(&args)),
    }
}

//! `isr`: image-space radiosity.

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use lucerna_samples::{
    program,
    technique::isr::{self, IsrArgs},
};

/// Image-space radiosity: one bounce of indirect light and ambient occlusion from what the camera sees.
#[derive(Parser, Debug)]
#[command(name = "isr", version, max_term_width = 120)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// Render a scene into images
    #[command(args_override_self = true)]
    Render(Box<IsrArgs>),
}

fn main() -> ExitCode {
    let Command::Render(render) = Arguments::parse().command;
    program::run(render.common.talk.console(), || isr::run(&render))
}

//! `tonemap`: pictures of light become pictures for a screen.

use std::process::ExitCode;

use clap::Parser;
use lucerna_samples::{
    program,
    tonemap::{self, TonemapArgs},
};

/// Develops HDR pictures: from the light of a scene to what a screen or a print can show.
#[derive(Parser, Debug)]
#[command(name = "tonemap", version, max_term_width = 120, args_override_self = true)]
struct Arguments {
    #[command(flatten)]
    tonemap: TonemapArgs,
}

fn main() -> ExitCode {
    let Arguments { tonemap } = Arguments::parse();
    let console = tonemap.talk.console();
    program::run(console, || tonemap::run(&tonemap, console))
}

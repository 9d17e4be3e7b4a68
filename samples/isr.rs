//! `isr`: image-space radiosity.

use std::process::ExitCode;

use clap::{Args, Parser, Subcommand};
use lucerna::techniques::isr::{Isr, Mode, PictureSettings, Preset};
use lucerna_samples::{
    args::RenderArgs,
    program,
    render::{self, Given},
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

#[derive(Args, Debug)]
struct IsrArgs {
    #[command(flatten)]
    common: RenderArgs,

    /// Settings preset: fast, balanced or best; -D and --settings override it
    #[arg(long, value_name = "NAME", help_heading = "Technique", conflicts_with = "paper")]
    preset: Option<Preset>,

    /// What the picture shows
    #[arg(long, value_parser = render::mode::<Mode>(), default_value = "isr", help_heading = "Technique")]
    mode: Mode,
}

fn main() -> ExitCode {
    let Command::Render(args) = Arguments::parse().command;
    program::run(args.common.talk.console(), || {
        let mut given = Given::<Isr>::by(&args.common, args.mode)?;
        if let Some(preset) = args.preset {
            given.base = PictureSettings { isr: preset.settings(), ..given.base };
        }
        render::render(&args.common, &given)
    })
}

//! `isr`: image-space radiosity.

use std::process::ExitCode;

use crate::{
    args::RenderArgs,
    program,
    programs::help,
    render::{self, Given},
};
use clap::{
    Args, Parser, Subcommand,
    builder::{PossibleValuesParser, TypedValueParser},
};
use lucerna::{
    Result,
    techniques::isr::{Isr, Mode, PictureSettings, Preset},
};

/// Image-space radiosity: one bounce of indirect light and ambient occlusion from what the camera sees.
#[derive(Parser, Debug)]
#[command(name = "isr", version, max_term_width = 120)]
pub struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// Render a scene into images
    #[command(args_override_self = true)]
    Render(Box<IsrArgs>),
}

/// Options of `isr render`.
#[derive(Args, Debug)]
pub struct IsrArgs {
    #[command(flatten)]
    pub common: RenderArgs,

    /// Settings preset; -D and --settings override it
    #[arg(long, value_parser = preset(), value_name = "NAME", help_heading = "Technique", conflicts_with = "paper")]
    pub preset: Option<Preset>,

    /// What the picture shows
    #[arg(long, value_parser = render::mode::<Mode>(), default_value = "isr", help_heading = "Technique")]
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
pub fn render(args: &IsrArgs) -> Result<ExitCode> {
    let mut given = Given::<Isr>::by(&args.common, args.mode)?;
    if let Some(preset) = args.preset {
        given.base = PictureSettings { isr: preset.settings(), ..given.base };
    }
    render::render(&args.common, &given)
}

/// Reads a preset.
fn preset() -> impl TypedValueParser<Value = Preset> {
    PossibleValuesParser::new(Preset::ALL.map(|(name, _)| name)).try_map(|name| name.parse::<Preset>())
}

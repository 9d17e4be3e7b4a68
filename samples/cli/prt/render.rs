//! `prt render`: pictures of a room under lights that move.

use std::{path::PathBuf, process::ExitCode};

use lucerna::{
    Result,
    technique::Bake,
    techniques::prt::{Baked, Mode, Prt},
};

use crate::{
    args::RenderArgs,
    render::{self, Given},
};

/// Options of `prt render`.
#[derive(clap::Args, Debug)]
pub struct PrtArgs {
    #[command(flatten)]
    pub common: RenderArgs,

    /// File of `prt bake`
    #[arg(long, value_name = "FILE.prt", help_heading = "Technique")]
    pub bake: PathBuf,

    /// Light, or part of the bake, to show
    #[arg(long, value_parser = render::mode::<Mode>(), default_value = "total", help_heading = "Technique")]
    pub mode: Mode,
}

/// Renders the frames of a command line.
///
/// # Errors
/// Any error of the run. Its kind decides the exit code.
pub fn render(args: &PrtArgs) -> Result<ExitCode> {
    let baked = Baked::read(&args.bake)?;
    let given = Given::<Prt>::by(&args.common, args.mode)?;
    render::render(&args.common, &Given { baked: Some(baked), ..given })
}

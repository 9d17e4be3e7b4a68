//! `fiv render`: pictures by vectors, from a file or computed before the first frame.

use std::{path::PathBuf, process::ExitCode};

use lucerna::{
    Result,
    technique::{AllLight, Bake},
    techniques::fiv::{Baked, Fiv},
};

use crate::{
    args::RenderArgs,
    render::{self, Given},
};

/// Options of `fiv render`.
#[derive(clap::Args, Debug)]
pub struct FivArgs {
    #[command(flatten)]
    pub common: RenderArgs,

    /// File of `fiv precompute`; vectors that the file does not contain are computed
    #[arg(long, value_name = "FILE.fiv", help_heading = "Technique")]
    pub vectors: Option<PathBuf>,
}

/// Renders the frames of a command line.
///
/// # Errors
/// Any error of the run. Its kind decides the exit code.
pub fn render(args: &FivArgs) -> Result<ExitCode> {
    let baked = args.vectors.as_deref().map(Baked::read).transpose()?;
    let mut given = Given::<Fiv>::by(&args.common, AllLight)?;
    if let Some(baked) = &baked {
        // The settings in the picture's metadata are then sufficient to render the picture again.
        given.base.fiv = baked.stored.plan.settings(&given.base.fiv);
    }
    render::render(&args.common, &Given { baked, ..given })
}

//! `fiv render`: pictures by vectors, from a file or computed before the first frame.

use std::{path::PathBuf, process::ExitCode};

use lucerna::{
    Result,
    technique::{AllLight, Bake},
    techniques::fiv::{Baked, Fiv, Method, PictureSettings, Settings},
};

use crate::{
    args::RenderArgs,
    last_stage::Staged,
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

    /// Compute as many vectors as `fiv precompute` does by default, which takes a CPU minutes. Without this option and without --vectors, few vectors are
    /// computed
    #[arg(long, conflicts_with = "vectors", help_heading = "Technique")]
    pub full: bool,
}

/// Renders the frames of a command line.
///
/// # Errors
/// Any error of the run. Its kind decides the exit code.
pub fn render(args: &FivArgs) -> Result<ExitCode> {
    let baked = args.vectors.as_deref().map(Baked::read).transpose()?;
    let mut given = Given::<Fiv>::by(&args.common, AllLight)?;
    if baked.is_none() && !args.full {
        preview(args, &mut given)?;
    }
    if let Some(baked) = &baked {
        // The settings in the picture's metadata are then sufficient to render the picture again.
        given.base.fiv = baked.stored.plan.settings(&given.base.fiv);
    }
    render::render(&args.common, &Given { baked, ..given })
}

/// Vectors that are computed for this run alone are few, unless the user chose their number: a first picture takes seconds.
fn preview(args: &FivArgs, given: &mut Given<Fiv>) -> Result<()> {
    let settings = &args.common.settings;
    let over = |base: &PictureSettings| -> Result<Settings> {
        Ok(Staged::effective(settings, base, args.common.paper, PictureSettings::validate)?.technique.fiv)
    };
    let fewer = PictureSettings { fiv: Settings::preview(), ..given.base.clone() };
    let [full, chosen] = [over(&given.base)?, over(&fewer)?];
    if !matches!(full.method, Method::Vectors | Method::Online) {
        return Ok(());
    }
    given.base = fewer;
    if full != chosen && !settings.print_config {
        args.common.talk.console().info(
            "note: few vectors are computed, for a quick picture; --full computes all of them, and `fiv precompute` writes all into a file for --vectors",
        );
    }
    Ok(())
}

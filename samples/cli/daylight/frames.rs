//! `daylight frames`: the steps of a bake as uncompressed frames, for programs that read one step after the other.

use std::{path::PathBuf, process::ExitCode};

use lucerna::{
    Result, image,
    techniques::daylight::{Stored, frames},
};
use serde_json::json;

use crate::{
    args::TalkArgs,
    bake::Rate,
    console::{self, Console},
    progress::ProgressMode,
    signals::Interrupt,
};

/// Options of `daylight frames`.
#[derive(clap::Args, Clone, Debug)]
pub struct DayFramesArgs {
    /// File of `daylight bake`
    #[arg(value_name = "FILE.day")]
    pub bake: PathBuf,

    /// File to write
    #[arg(short, long, value_name = "FILE.frames", help_heading = "Output")]
    pub output: PathBuf,

    /// Replace the file if it exists
    #[arg(long, help_heading = "Output")]
    pub overwrite: bool,

    /// Print one JSON document about the run on stdout
    #[arg(long, help_heading = "Output")]
    pub json: bool,

    #[command(flatten)]
    pub talk: TalkArgs,

    /// How progress is shown on stderr
    #[arg(long, value_enum, default_value_t, value_name = "HOW", help_heading = "Messages")]
    pub progress: ProgressMode,
}

/// Decodes every step of a bake into a file.
///
/// # Errors
/// `Input` if the bake cannot be read; `Output` if the file cannot be written.
pub fn frames(args: &DayFramesArgs, console: Console) -> Result<ExitCode> {
    image::probe_output(&args.output, args.overwrite)?;
    let interrupt = Interrupt::install();
    let (stored, digest) = Stored::read_with_digest(&args.bake)?;
    let steps = stored.plan.times.len() as u64;
    let texels = stored.tiles.iter().map(|tile| u64::from(tile.there())).sum();
    let step = frames::step_bytes(texels);
    console.info(&format!("{steps} steps of {texels} texels, {step} bytes each"));
    let mut meter = Rate::new(args.progress, console.is_quiet(), "steps", 0, steps);
    let written = frames::write(&args.output, &stored, digest, args.overwrite, |done| {
        meter.show(done, 0);
        !interrupt.requested()
    });
    let bytes = match written {
        Err(_) if interrupt.requested() => return Ok(ExitCode::from(interrupt.exit_code())),
        written => written?,
    };
    console.info(&format!("wrote {}: {bytes} bytes", args.output.display()));
    if args.json {
        console::print_json(&json!({
            "file": args.output,
            "bytes": bytes,
            "steps": steps,
            "texels": texels,
            "step_bytes": step,
        }))?;
    }
    Ok(ExitCode::SUCCESS)
}

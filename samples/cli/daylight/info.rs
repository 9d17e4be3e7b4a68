//! `daylight info`: the contents of a bake.

use std::{path::PathBuf, process::ExitCode};

use lucerna::{
    Result,
    techniques::daylight::{Kind, Stored, Summary},
};
use serde_json::json;

use crate::{
    args::TalkArgs,
    console::{self, Console},
};

/// Options of `daylight info`.
#[derive(clap::Args, Clone, Debug)]
pub struct DayInfoArgs {
    /// File of `daylight bake`
    #[arg(value_name = "FILE.day")]
    pub file: PathBuf,

    /// Print one JSON document on stdout
    #[arg(long, help_heading = "Output")]
    pub json: bool,

    #[command(flatten)]
    pub talk: TalkArgs,
}

/// Prints what a bake holds and what it is within.
///
/// # Errors
/// `Input` if the file cannot be read.
pub fn info(args: &DayInfoArgs, _: Console) -> Result<ExitCode> {
    let stored = Stored::read(&args.file)?;
    let summary = stored.summary();
    if args.json {
        console::print_json(&json!({
            "file": args.file,
            "plan": console::to_json(&stored.plan)?,
            "summary": console::to_json(&summary)?,
        }))?;
        return Ok(ExitCode::SUCCESS);
    }
    let plan = &stored.plan;
    let kind = match &plan.receivers {
        Kind::View { camera, .. } => format!("pixels of camera {camera}"),
        Kind::Lightmap { charts, covered, .. } => format!("lightmap, {charts} charts, {covered} texels on surfaces"),
    };
    let calendar = &plan.calendar;
    console::print(&format!("scene      {}, {kind}", plan.scene))?;
    console::print(&format!("texels     {}×{}, tiles of {}", plan.extent[0], plan.extent[1], plan.side()))?;
    console::print(&format!(
        "day        {} at {:.4}° N, {:.4}° E, {}; {} steps, {} lit",
        calendar.date,
        calendar.latitude,
        calendar.longitude,
        calendar.zone,
        plan.steps,
        plan.times.len()
    ))?;
    console::print(&format!("paths      {} per texel, {} scatterings", plan.settings.samples, plan.settings.bounces))?;
    lines(&summary).iter().try_for_each(|line| console::print(line))?;
    Ok(ExitCode::SUCCESS)
}

/// The sizes and the errors of a bake, for people.
pub fn lines(summary: &Summary) -> Vec<String> {
    let Summary {
        raw_bytes,
        bytes,
        images,
        most_images,
        worst_tile,
        worst_frame,
        worst_frame_number,
        p999,
        worst_sky,
        noise,
    } = summary;
    let share = 100.0 * (1.0 - *bytes as f64 / (*raw_bytes).max(1) as f64);
    vec![
        format!("size       {bytes} bytes; all frames as 16-bit floats: {raw_bytes} ({share:.1} % saved)"),
        format!("images     {images:.1} per tile, at most {most_images}"),
        format!(
            "error      worst step of a tile {:.1} %, all but a thousandth {:.1} %; worst whole step {:.1} % (number {worst_frame_number})",
            100.0 * worst_tile,
            100.0 * p999,
            100.0 * worst_frame
        ),
        format!("sky        worst sky {:.1} %", 100.0 * worst_sky),
        format!("noise      {:.1} % in the worst step of the median tile", 100.0 * noise),
    ]
}

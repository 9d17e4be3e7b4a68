//! `daylight info`: the contents of a bake.

use std::{path::PathBuf, process::ExitCode};

use lucerna::{
    Error, Result,
    techniques::daylight::{Calendar, Kind, Stored, Summary, SunPoint, probes},
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
            "probes": stored.probe_summary().as_ref().map(console::to_json).transpose()?,
        }))?;
        return Ok(ExitCode::SUCCESS);
    }
    let plan = &stored.plan;
    let kind = match &plan.receivers {
        Kind::View { camera, .. } => format!("pixels of camera {camera}"),
        Kind::Cube { camera, position: [x, y, z], .. } => format!("cube around camera {camera} at {x}, {y}, {z}"),
        Kind::Lightmap { charts, covered, backs, .. } => {
            let backs = if *backs == 0 { String::new() } else { format!(", {backs} of them on backs") };
            format!("lightmap, {charts} charts, {covered} texels on surfaces{backs}")
        }
    };
    let calendar = &plan.calendar;
    console::print(&format!("scene      {}, {kind}", plan.scene))?;
    console::print(&format!("texels     {}×{}, tiles of {}", plan.extent[0], plan.extent[1], plan.side()))?;
    let Calendar { date, dates, zone, latitude, longitude, .. } = calendar;
    let day = match &calendar.path {
        Some(path) => format!("path of the sun with {} times", path.stops.len()),
        None if !dates.is_empty() => format!(
            "{} at {latitude:.4}° N, {longitude:.4}° E, {zone}",
            calendar.dates().collect::<Vec<_>>().join(", ")
        ),
        None => format!("{date} at {latitude:.4}° N, {longitude:.4}° E, {zone}"),
    };
    console::print(&format!("day        {day}; {} steps, light for {}", plan.steps, plan.times.len()))?;
    if let Some(SunPoint { centre: [x, y, z], distance }) = calendar.point {
        console::print(&format!("sun        a point {distance} m from {x}, {y}, {z}"))?;
    }
    if let Some(span) = calendar.span {
        let courses = calendar.courses().map_err(Error::input)?;
        let [from, until] = span.map(|seconds| courses[0].label(seconds));
        console::print(&format!("span       {from} until {until}"))?;
    }
    console::print(&format!("paths      {} per texel, {} scatterings", plan.settings.samples, plan.settings.bounces))?;
    lines(&summary).iter().try_for_each(|line| console::print(line))?;
    stored.probe_summary().iter().try_for_each(|summary| console::print(&probe_line(summary)))?;
    Ok(ExitCode::SUCCESS)
}

/// The sizes and the errors of the probes, for people.
pub fn probe_line(summary: &probes::Summary) -> String {
    let probes::Summary { probes, valid, spacing: [x, y, z], bytes, images, worst, noise } = summary;
    format!(
        "probes     {probes} every {x:.2}×{y:.2}×{z:.2} m, {} of them inside solids; {bytes} bytes, {images:.1} images per brick, worst step {:.1} %, noise {:.1} %",
        probes - valid,
        100.0 * worst,
        100.0 * noise
    )
}

/// The sizes and the errors of a bake, for people.
pub fn lines(summary: &Summary) -> Vec<String> {
    let Summary {
        raw_bytes,
        bytes,
        places_bytes,
        images,
        most_images,
        kinds: [wide, narrow, hdr, pairs],
        worst_tile,
        hidden,
        worst_frame,
        worst_frame_number,
        p999,
        worst_sky,
        noise,
    } = summary;
    let share = 100.0 * (1.0 - *bytes as f64 / (*raw_bytes).max(1) as f64);
    vec![
        format!("size       {bytes} bytes; all frames as 16-bit floats: {raw_bytes} ({share:.1} % saved)"),
        format!("places     {places_bytes} bytes: where each triangle is in the lightmap"),
        format!("images     {images:.1} per tile, at most {most_images}"),
        format!("values     {wide} images of 16-bit floats, {narrow} of bytes, {hdr} in BC6H, {pairs} in BC5 and BC4"),
        format!(
            "error      worst step of a tile {:.1} % beside the noise; the noise hides such errors in {:.1} % of the steps of tiles",
            100.0 * worst_tile,
            100.0 * hidden
        ),
        format!(
            "difference from the light with its noise: all steps of tiles but a thousandth {:.1} %; worst whole step {:.1} % (number {worst_frame_number})",
            100.0 * p999,
            100.0 * worst_frame
        ),
        format!("sky        worst sky {:.1} %", 100.0 * worst_sky),
        format!("noise      {:.1} % of the light of the day, in the median tile", 100.0 * noise),
    ]
}

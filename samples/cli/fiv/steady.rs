//! `fiv steady`: whether a sequence pops.

use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};

use lucerna::{
    Error, Result,
    image::{self, Layers},
    measure::steady::{Frame, Steadiness},
    scene::Limits,
};
use serde_json::json;

use crate::{
    args::TalkArgs,
    console::{self, Console},
};

/// Options of `fiv steady`.
#[derive(clap::Args, Clone, Debug)]
pub struct SteadyArgs {
    /// Folder with the .exr files of `fiv render --frames`
    #[arg(value_name = "FRAMES")]
    pub frames: PathBuf,

    /// Folder with the same frames by brute force
    #[arg(value_name = "TRUTH")]
    pub truth: PathBuf,

    /// Print one JSON document on stdout
    #[arg(long, help_heading = "Output")]
    pub json: bool,

    #[command(flatten)]
    pub talk: TalkArgs,
}

/// Runs the command.
///
/// # Errors
/// `Input` if a folder has fewer than two frames, or the two have different ones.
pub fn steady(args: &SteadyArgs, console: Console) -> Result<ExitCode> {
    let (ours, right) = (sequence(&args.frames)?, sequence(&args.truth)?);
    if ours.len() != right.len() {
        let what = format!("{} frames instead of {}", ours.len(), right.len());
        return Err(Error::input(what).in_file(&args.frames));
    }
    if let Some((a, b)) = ours.iter().zip(&right).find(|(a, b)| a.size != b.size) {
        let what = format!("{}×{} pixels instead of {}×{}", a.size[0], a.size[1], b.size[0], b.size[1]);
        return Err(Error::input(what).in_file(&args.frames));
    }
    fn frame(picture: &Picture) -> Frame<'_> {
        Frame { light: &picture.light, depth: &picture.depth }
    }
    let (found, truth): (Vec<_>, Vec<_>) = ours.iter().map(frame).zip(right.iter().map(frame)).unzip();
    let measured = Steadiness::of(right[0].size[0] as usize, &truth, &found);
    let largest = measured.largest();
    if args.json {
        let step = |s: &lucerna::measure::steady::Step| json!({"truth": s.truth, "found": s.found, "apart": s.apart});
        let steps: Vec<_> = measured.steps.iter().map(step).collect();
        console::print_json(&json!({
            "frames": right.len(), "parts": measured.parts, "largest": step(&largest), "steps": steps,
        }))?;
    } else {
        console::print("step  truth    found    apart")?;
        for (i, s) in measured.steps.iter().enumerate() {
            console::print(&format!("{i:4}  {:.5}  {:.5}  {:.5}", s.truth, s.found, s.apart))?;
        }
        let ratio = largest.found / largest.truth.max(1e-30);
        console::print(&format!(
            "{} parts; largest change {:.5}, in truth {:.5} ({ratio:.2} of it), most apart {:.5}",
            measured.parts, largest.found, largest.truth, largest.apart
        ))?;
    }
    if measured.parts == 0 {
        console.info("note: no part of 8×8 pixels stands still throughout");
    }
    Ok(ExitCode::SUCCESS)
}

struct Picture {
    size: [u32; 2],
    light: Vec<[f32; 3]>,
    depth: Vec<f32>,
}

/// All frames of a folder in the order of their names.
fn sequence(folder: &Path) -> Result<Vec<Picture>> {
    let unreadable = |error: std::io::Error| Error::input("cannot be read").caused_by(error).in_file(folder);
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr")) {
            files.push(path);
        }
    }
    files.sort();
    if files.len() < 2 {
        let error = Error::input(format!("{} .exr files, at least 2 are needed", files.len()));
        return Err(error.in_file(folder).help("Render with --frames 0..60 -o 'FOLDER/{frame:04}.exr'"));
    }
    files.iter().map(|file| picture(file).map_err(|error| error.in_file(file))).collect()
}

fn picture(file: &Path) -> Result<Picture> {
    let layers: Layers = image::read(file, &Limits::default())?;
    let layer = |name: &str, channels: usize| {
        let missing = || Error::input(format!("has no layer `{name}`")).help("It must be a picture of `fiv render`");
        layers.layer(name).filter(|l| l.channels.len() == channels).ok_or_else(missing)
    };
    let light = layer("irradiance", 3)?.data.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
    Ok(Picture { size: [layers.width, layers.height], light, depth: layer("depth", 1)?.data.clone() })
}

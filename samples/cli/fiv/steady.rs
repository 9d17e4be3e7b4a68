//! `fiv steady`: compares the changes between the frames of a sequence with those of a sequence by brute force.

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
/// `Input` if a folder has fewer than two frames or frames of different sizes, or if the two have frames of other names or sizes.
pub fn steady(args: &SteadyArgs, console: Console) -> Result<ExitCode> {
    let (ours, right) = (sequence(&args.frames)?, sequence(&args.truth)?);
    comparable([&args.frames, &args.truth], &ours, &right)?;
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
        console.info("note: no block of 8×8 pixels stands still in all frames");
    }
    Ok(ExitCode::SUCCESS)
}

/// Help text on the frames that can be compared.
const SAME: &str = "Both folders must have the same frames under the same names, of the same size";

/// Checks that two sequences have the same frames.
///
/// # Errors
/// `Input`, naming both folders and what differs.
fn comparable([folder, other]: [&Path; 2], ours: &[Picture], right: &[Picture]) -> Result<()> {
    let wrong = |what: String| Err(Error::input(what).in_file(folder).help(SAME));
    if let Some((a, b)) = ours.iter().zip(right).find(|(a, b)| a.name() != b.name()) {
        return wrong(format!("has frame `{}` where {} has `{}`", a.name(), other.display(), b.name()));
    }
    if ours.len() != right.len() {
        return wrong(format!("has {} frames, {} has {}", ours.len(), other.display(), right.len()));
    }
    ours.first().zip(right.first()).map_or(Ok(()), |(a, b)| same_size(a, b))
}

/// # Errors
/// `Input`, naming both files.
fn same_size(a: &Picture, b: &Picture) -> Result<()> {
    if a.size == b.size {
        return Ok(());
    }
    let ([w, h], [width, height]) = (a.size, b.size);
    let what = format!("{w}×{h} pixels, {} has {width}×{height}", b.file.display());
    Err(Error::input(what).in_file(&a.file).help(SAME))
}

struct Picture {
    file: PathBuf,
    size: [u32; 2],
    light: Vec<[f32; 3]>,
    depth: Vec<f32>,
}

impl Picture {
    fn name(&self) -> std::borrow::Cow<'_, str> {
        self.file.file_name().unwrap_or_default().to_string_lossy()
    }
}

/// All frames of a folder in the order of their names, of one size.
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
    let pictures: Vec<Picture> =
        files.iter().map(|file| picture(file).map_err(|error| error.in_file(file))).collect::<Result<_>>()?;
    pictures.iter().skip(1).try_for_each(|other| same_size(other, &pictures[0]))?;
    Ok(pictures)
}

fn picture(file: &Path) -> Result<Picture> {
    let layers: Layers = image::read(file, &Limits::default())?;
    let layer = |name: &str, channels: usize| {
        let missing = || Error::input(format!("has no layer `{name}`")).help("It must be a picture of `fiv render`");
        layers.layer(name).filter(|l| l.channels.len() == channels).ok_or_else(missing)
    };
    let light = layer("irradiance", 3)?.data.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
    Ok(Picture {
        file: file.to_owned(),
        size: [layers.width, layers.height],
        light,
        depth: layer("depth", 1)?.data.clone(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(name: &str, size: [u32; 2]) -> Picture {
        Picture { file: name.into(), size, light: Vec::new(), depth: Vec::new() }
    }

    fn refused(ours: &[Picture], right: &[Picture]) -> String {
        let error = comparable([Path::new("ours"), Path::new("right")], ours, right).unwrap_err();
        assert_eq!(error.exit_code(), 3);
        error.to_string()
    }

    #[test]
    fn only_the_same_frames_are_compared() {
        let frames = |names: [&str; 2], size| names.map(|name| picture(name, size));
        let (ours, same) = (frames(["0.exr", "1.exr"], [4, 3]), frames(["0.exr", "1.exr"], [4, 3]));
        comparable([Path::new("ours"), Path::new("right")], &ours, &same).unwrap();
        let text = refused(&ours, &frames(["0.exr", "2.exr"], [4, 3]));
        assert!(["ours", "right", "`1.exr`", "`2.exr`"].iter().all(|part| text.contains(part)), "{text}");
        let text = refused(&ours, &same[..1]);
        assert!(text.contains("2 frames") && text.contains("has 1"), "{text}");
        let text = refused(&ours, &frames(["0.exr", "1.exr"], [3, 4]));
        assert!(text.contains("4×3") && text.contains("3×4"), "{text}");
    }
}

//! The commands `fiv precompute`, `fiv merge` and `fiv environment`, which write the input files of `fiv render`, and
//! `fiv steady`, which measures its output.

mod decided;
mod meter;
mod precompute;
mod steady;

use std::{path::PathBuf, process::ExitCode};

use lucerna::{
    Error, Result,
    image::{self, Layers, WriteOptions},
    scene::builtin,
    techniques::fiv::{Stored, file},
};

pub use decided::decided;
pub use meter::Meter;
pub use precompute::{PrecomputeArgs, precompute};
pub use steady::{SteadyArgs, steady};

use crate::{args::TalkArgs, console::Console};

/// Options of `fiv merge`.
#[derive(clap::Args, Clone, Debug)]
pub struct MergeArgs {
    /// Files of `fiv precompute --shard`, in any order
    #[arg(value_name = "PART", required = true)]
    pub parts: Vec<PathBuf>,

    /// File to write
    #[arg(short, long, value_name = "FILE.fiv", help_heading = "Output")]
    pub output: PathBuf,

    /// Replace the file if it exists
    #[arg(long, help_heading = "Output")]
    pub overwrite: bool,

    #[command(flatten)]
    pub talk: TalkArgs,
}

/// Joins the parts of a file.
///
/// # Errors
/// `Input` if parts are damaged, if samples are missing or occur twice, or if the parts belong to different plans;
/// `Output` if the file cannot be written.
pub fn merge(args: &MergeArgs, console: Console) -> Result<ExitCode> {
    image::probe_output(&args.output, args.overwrite)?;
    let parts = args.parts.iter().map(Stored::read).collect::<Result<Vec<_>>>()?;
    let whole = file::merge(parts)?;
    whole.write(&args.output, args.overwrite)?;
    console.info(&format!("wrote {}: {} samples", args.output.display(), whole.plan.samples()));
    Ok(ExitCode::SUCCESS)
}

/// Options of `fiv environment`.
#[derive(clap::Args, Clone, Debug)]
pub struct EnvironmentArgs {
    /// One small light, a green and a red area light, or sun and sky through leaves
    #[arg(value_name = "NAME", value_parser = clap::builder::PossibleValuesParser::new(builtin::ENVIRONMENTS))]
    pub name: String,

    /// File to write: .exr, .hdr or .pfm, latitude-longitude
    #[arg(short, long, value_name = "FILE", help_heading = "Output")]
    pub output: PathBuf,

    /// Replace the file if it exists
    #[arg(long, help_heading = "Output")]
    pub overwrite: bool,

    #[command(flatten)]
    pub talk: TalkArgs,
}

/// Writes a built-in environment.
///
/// # Errors
/// `Usage` if there is no such environment or no such kind of file; `Output` if the file cannot be written.
pub fn environment(args: &EnvironmentArgs, console: Console) -> Result<ExitCode> {
    let environment = builtin::environment(&args.name)?;
    let data = environment.pixels.iter().flat_map(|p| p.to_array()).collect();
    let options = WriteOptions { overwrite: args.overwrite, f32: true, ..WriteOptions::default() };
    image::write(&args.output, &Layers::rgb(environment.width, environment.height, data), &options)?;
    console.info(&format!("wrote {}", args.output.display()));
    Ok(ExitCode::SUCCESS)
}

/// One of several equal parts of the work: `2/5` is the second of five.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// From 0.
    pub index: u64,
    pub count: u64,
}

impl std::str::FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parse = || {
            let (index, count) = text.split_once('/')?;
            let (index, count) = (index.trim().parse::<u64>().ok()?, count.trim().parse::<u64>().ok()?);
            (1..=count).contains(&index).then(|| Self { index: index - 1, count })
        };
        parse().filter(|s| s.count <= 1_000_000).ok_or_else(|| "expected I/N with 1 <= I <= N, for example 2/5".into())
    }
}

/// The name of the file that keeps the finished part of another file.
fn partial(path: &std::path::Path) -> Result<PathBuf> {
    let name = path.file_name().ok_or_else(|| Error::usage("is not a file name").in_file(path))?;
    Ok(path.with_file_name(format!("{}.part", name.to_string_lossy())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_count_from_one() {
        assert_eq!("2/5".parse(), Ok(Shard { index: 1, count: 5 }));
        for bad in ["0/5", "6/5", "1", "a/b", "-1/2", "1/0", "/", "1/9999999"] {
            assert!(bad.parse::<Shard>().is_err(), "{bad}");
        }
        assert_eq!(partial(std::path::Path::new("a/b.fiv")).unwrap(), PathBuf::from("a/b.fiv.part"));
    }
}

//! The commands of `fiv`: `precompute` and `environment` write the input files of `render`, and `steady` measures its
//! output.

mod precompute;
mod render;
mod steady;
mod vector_settings;

use std::{path::PathBuf, process::ExitCode};

use lucerna::{
    Error, Result,
    image::{self, Layers, WriteOptions},
};
use lucerna_scenes as builtin;

pub use precompute::{PrecomputeArgs, precompute};
pub use render::{FivArgs, has_metals, render};
pub use steady::{SteadyArgs, steady};

use crate::{args::TalkArgs, console::Console};

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

/// The file in which earlier versions kept what was done of another.
fn partial(path: &std::path::Path) -> Result<PathBuf> {
    let name = path.file_name().ok_or_else(|| Error::usage("is not a file name").in_file(path))?;
    Ok(path.with_file_name(format!("{}.part", name.to_string_lossy())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_earlier_versions_have_left_lies_beside_the_file() {
        assert_eq!(partial(std::path::Path::new("a/b.fiv")).unwrap(), PathBuf::from("a/b.fiv.part"));
    }
}

//! `prt info`: the contents of a bake.

use std::{path::PathBuf, process::ExitCode};

use lucerna::{
    Result,
    techniques::prt::{Stored, Summary},
};
use serde_json::json;

use crate::{
    args::TalkArgs,
    console::{self, Console},
};

/// Options of `prt info`.
#[derive(clap::Args, Clone, Debug)]
pub struct PrtInfoArgs {
    /// File of `prt bake`
    #[arg(value_name = "FILE.prt")]
    pub file: PathBuf,

    /// Print one JSON document on stdout
    #[arg(long, help_heading = "Output")]
    pub json: bool,

    #[command(flatten)]
    pub talk: TalkArgs,
}

/// Prints the contents of a bake.
///
/// # Errors
/// `Input` if the file cannot be read.
pub fn info(args: &PrtInfoArgs, _: Console) -> Result<ExitCode> {
    let (stored, _) = Stored::read(&args.file)?;
    let summary = stored.summary();
    if args.json {
        console::print_json(&json!({
            "file": args.file,
            "plan": console::to_json(&stored.plan)?,
            "summary": console::to_json(&summary)?,
        }))?;
        return Ok(ExitCode::SUCCESS);
    }
    let settings = &stored.plan.settings;
    console::print(&format!("scene       {}", stored.plan.scene))?;
    console::print(&format!(
        "rays        {} directions, {} gathered; {} example lights",
        settings.directions, settings.rays, settings.examples
    ))?;
    lines(&summary).iter().try_for_each(|line| console::print(line))?;
    Ok(ExitCode::SUCCESS)
}

/// The sizes and the errors of a bake, for people.
pub fn lines(summary: &Summary) -> Vec<String> {
    let Summary {
        samples,
        clusters,
        area,
        radius,
        sample_bytes,
        visibility_bytes,
        visibility_vectors_bytes,
        basis_bytes,
        transfer_bytes,
        link_bytes,
        directional_bytes,
        links,
        linked,
        kept,
        distance_error,
        left,
        lost,
        escaped,
    } = summary;
    vec![
        format!(
            "samples     {samples} in {clusters} clusters, {radius:.3} m apart, on {area:.1} m²; {sample_bytes} bytes"
        ),
        format!(
            "visibility  {visibility_bytes} bytes, and {visibility_vectors_bytes} of vectors; error of a distance {distance_error:.3} m (root mean square)"
        ),
        format!("basis       {basis_bytes} bytes"),
        format!(
            "transfer    {transfer_bytes} bytes, {:.1} % of the coefficients are not 0; {:.1} % of the light is left out",
            100.0 * kept,
            100.0 * left
        ),
        format!(
            "links       {link_bytes} bytes, {links:.1} of each sample; they carry {:.1} % of even light",
            100.0 * linked
        ),
        format!("directions  {directional_bytes} bytes"),
        format!(
            "particles   {:.1} % left the scene; {:.2} % of the rays met a surface without samples",
            100.0 * escaped,
            100.0 * lost
        ),
    ]
}

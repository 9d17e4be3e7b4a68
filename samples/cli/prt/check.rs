//! `prt check`: the error of a bake beside light by following paths.

use std::{path::PathBuf, process::ExitCode};

use lucerna::{
    Result,
    gpu::Gpu,
    technique::Bake,
    techniques::prt::{
        self, Baked, Settings,
        check::{self, CheckOptions, LightErrors, RelativeError},
    },
};
use serde_json::json;

use crate::{
    args::{DeviceArgs, TalkArgs},
    console::{self, Console},
    program,
    signals::Interrupt,
    stage::{Stage, StageArgs},
};

/// Options of `prt check`.
#[derive(clap::Args, Clone, Debug)]
pub struct PrtCheckArgs {
    #[command(flatten)]
    pub stage: StageArgs,

    /// File of `prt bake`
    #[arg(long, value_name = "FILE.prt", help_heading = "Check")]
    pub bake: PathBuf,

    /// Lights at places in the free space that the bake has not seen
    #[arg(long, value_name = "N", default_value_t = CheckOptions::default().lights, value_parser = clap::value_parser!(u32).range(1..=1000), help_heading = "Check")]
    pub lights: u32,

    /// Samples at which light is compared
    #[arg(long, value_name = "N", default_value_t = CheckOptions::default().samples, value_parser = clap::value_parser!(u32).range(1..=100_000), help_heading = "Check")]
    pub samples: u32,

    /// Paths that are followed from each of these samples, in four parts
    #[arg(long, value_name = "N", default_value_t = CheckOptions::default().paths, value_parser = clap::value_parser!(u32).range(4..=1_000_000), help_heading = "Check")]
    pub paths: u32,

    /// Seed of the paths
    #[arg(long, value_name = "N", default_value_t = 0, help_heading = "Check")]
    pub seed: u32,

    /// Print one JSON document on stdout
    #[arg(long, help_heading = "Output")]
    pub json: bool,

    #[command(flatten)]
    pub device: DeviceArgs,

    #[command(flatten)]
    pub talk: TalkArgs,
}

/// Distances to the nearest surface that separate the lines of the table, metres.
const APART: [f32; 4] = [0.1, 0.3, 0.5, 1.0];

/// Prints the errors of a bake by the distance of the lights to surfaces.
///
/// # Errors
/// `Input` if the file cannot be read or is of another scene; errors of the device.
pub fn check(args: &PrtCheckArgs, console: Console) -> Result<ExitCode> {
    let baked = Baked::read(&args.bake)?;
    Interrupt::install();
    let stage = Stage::open(&args.stage)?;
    for note in stage.notes().iter().chain(&prt::simplified(&stage.scene)) {
        console.info(&format!("note: {}: {}", note.place, note.text));
    }
    baked.expect_scene(&stage.scene)?;
    let gpu = Gpu::new(args.device.options()?)?;
    console.info(&format!("lucerna {}, {}", program::VERSION, gpu.describe()));
    let PrtCheckArgs { lights, samples, paths, seed, .. } = *args;
    let options = CheckOptions { lights, samples, paths, seed };
    // Paths scatter as on diffuse surfaces.
    let settings = Settings { gloss: false, ..Settings::default() };
    let found = check::check(&gpu, &stage.scene, &baked.stored, &settings, options, &Interrupt::stop())?;
    let lines: Vec<(f32, Vec<LightErrors>)> = (0..=APART.len())
        .map(|line| {
            let from = line.checked_sub(1).map_or(0.0, |before| APART[before]);
            let to = APART.get(line).copied().unwrap_or(f32::INFINITY);
            (
                from,
                found
                    .iter()
                    .filter(|light| light.distance_to_surface >= from && light.distance_to_surface < to)
                    .copied()
                    .collect(),
            )
        })
        .collect();
    if args.json {
        console::print_json(&json!({
            "file": args.bake,
            "device": gpu.describe().to_string(),
            "lights": console::to_json(&found)?,
            "by_distance": lines.iter().filter(|(_, of)| !of.is_empty()).map(|(from, of)| json!({
                "from": from,
                "lights": of.len(),
                "direct": joined(of, |light| light.direct),
                "indirect": joined(of, |light| light.indirect),
                "transferred": joined(of, |light| light.transferred),
            })).collect::<Vec<_>>(),
        }))?;
        return Ok(ExitCode::SUCCESS);
    }
    console::print(
        "lights by their distance to surfaces; error: root mean square over that of the truth; trimmed: the same without the worst twentieth of the samples; energy: light over that of the truth",
    )?;
    console::print(
        "                   direct                       indirect                     with exact direct light",
    )?;
    console::print(
        "distance   lights     error   trimmed   energy     error   trimmed   energy     error   trimmed   energy",
    )?;
    for (from, of) in lines.iter().filter(|(_, of)| !of.is_empty()) {
        let [direct, indirect, transferred] = [
            joined(of, |light| light.direct),
            joined(of, |light| light.indirect),
            joined(of, |light| light.transferred),
        ];
        console::print(&format!(
            "{:<9}  {:>6}{}{}{}",
            format!("{from} m"),
            of.len(),
            cells(direct),
            cells(indirect),
            cells(transferred)
        ))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Root mean square of the errors of lights, and the mean of their energies: each light counts alike, but for those in darkness. `None`: all are.
fn joined(lights: &[LightErrors], of: fn(&LightErrors) -> Option<RelativeError>) -> Option<RelativeError> {
    let all: Vec<RelativeError> = lights.iter().filter_map(of).collect();
    let count = all.len() as f64;
    (!all.is_empty()).then(|| RelativeError {
        error: (all.iter().map(|one| one.error.powi(2)).sum::<f64>() / count).sqrt(),
        trimmed: (all.iter().map(|one| one.trimmed.powi(2)).sum::<f64>() / count).sqrt(),
        energy: all.iter().map(|one| one.energy).sum::<f64>() / count,
    })
}

fn cells(error: Option<RelativeError>) -> String {
    match error {
        Some(RelativeError { error, trimmed, energy }) => {
            format!("  {:>6.1} %  {:>6.1} %  {energy:>7.3}", 100.0 * error, 100.0 * trimmed)
        }
        None => format!("  {:>8}  {:>8}  {:>7}", "dark", "", ""),
    }
}

//! `lucerna compare`: tables of measures for one or many images against a reference.

mod args;
mod input;
mod maps;
mod report;

use std::process::ExitCode;

use lucerna::{
    Error, ErrorKind, Result,
    measure::{Display, Exposure, Measure, Measured, Pair, ToneCurve},
};

pub use args::CompareArgs;
use args::Threshold;
pub(crate) use input::split;
use input::{Images, Stop};

use crate::console::{self, Console};

/// The measurements of one image.
struct Compared {
    name: String,
    values: Vec<Measured>,
    /// Files that were written.
    maps: Vec<String>,
}

/// The results of a run.
struct Comparison {
    reference: String,
    baseline: Option<String>,
    size: [u32; 2],
    measures: Vec<Measure>,
    tests: Vec<Compared>,
    /// Messages about exceeded thresholds.
    over: Vec<String>,
    warnings: Vec<String>,
    /// Notes about the inputs.
    notes: Vec<String>,
}

/// Runs `lucerna compare`. The exit code is 0, or with `--idiff-codes` the exit code of idiff.
///
/// # Errors
/// `Usage` and `Input` for images that cannot be compared; `Comparison` if a threshold is exceeded; `Output` for maps.
pub fn run(args: &CompareArgs, console: Console) -> Result<ExitCode> {
    match compare(args, console) {
        Ok(comparison) => {
            match args.json {
                true => console::print_json(&report::json(&comparison, args))?,
                false => console::print(&report::text(&comparison))?,
            }
            verdict(args, console, &comparison)
        }
        Err(Stop { error, sizes_differ }) if args.idiff_codes => {
            console.error(&error);
            Ok(ExitCode::from(if sizes_differ { 3 } else { 4 }))
        }
        Err(stop) => Err(stop.error),
    }
}

/// Checks the thresholds and decides the exit code.
fn verdict(args: &CompareArgs, console: Console, comparison: &Comparison) -> Result<ExitCode> {
    for warning in &comparison.warnings {
        console.warning(warning);
    }
    if comparison.over.is_empty() {
        let warned = args.idiff_codes && !comparison.warnings.is_empty();
        return Ok(ExitCode::from(u8::from(warned)));
    }
    let error = Error::new(ErrorKind::Comparison, comparison.over.join("; "));
    if args.idiff_codes {
        console.error(&error);
        return Ok(ExitCode::from(2));
    }
    Err(error)
}

fn compare(args: &CompareArgs, console: Console) -> Result<Comparison, Stop> {
    let mut options = args.options()?;
    let (fail, warn) = (args.thresholds(), args.warn_over.clone());
    let images = Images::read(args, console)?;
    if images.developed {
        // The images already are screen values, so they are compared unchanged.
        options.display = Display { exposure: Exposure::Stops(0.0), curve: ToneCurve::Clip };
    }
    let measures = chosen(args, &images, &fail, &warn)?;
    let folder = maps::Folder::prepare(args, &images, &measures)?;
    let mut comparison = Comparison {
        reference: images.reference.name.clone(),
        baseline: images.baseline.as_ref().map(|b| b.name.clone()),
        size: [images.reference.picture.width, images.reference.picture.height],
        measures,
        tests: Vec::new(),
        over: Vec::new(),
        warnings: Vec::new(),
        notes: images.notes.clone(),
    };
    for (i, test) in images.tests.iter().enumerate() {
        let pair = pair(&images, i)?;
        let mut values = Vec::new();
        for &measure in &comparison.measures {
            console.detail(&format!("{}: {measure}", test.name));
            values.push(measure.of(&pair, &options).map_err(|error| error.in_file(&test.name))?);
        }
        let maps = folder.write(i, &pair, &values, &options)?;
        comparison.over.extend(passed(&test.name, &values, &fail));
        comparison.warnings.extend(passed(&test.name, &values, &warn));
        comparison.tests.push(Compared { name: test.name.clone(), values, maps });
    }
    Ok(comparison)
}

fn pair(images: &Images, test: usize) -> Result<Pair<'_>, Stop> {
    let image = &images.tests[test];
    let sizes_differ = [image.picture.width, image.picture.height]
        != [images.reference.picture.width, images.reference.picture.height];
    let pair = Pair::new(&images.reference.picture, &image.picture)
        .and_then(|pair| images.baseline.as_ref().map_or(Ok(pair), |b| pair.with_baseline(&b.picture)));
    let name = |error: &Error| match error.place() {
        Some("reference") => images.reference.name.clone(),
        Some("baseline") => images.baseline.as_ref().map(|b| b.name.clone()).unwrap_or_default(),
        _ => image.name.clone(),
    };
    pair.map_err(|error| {
        let name = name(&error);
        Stop { error: error.in_file(name), sizes_differ }
    })
}

/// The measures in the order of the table: the measures that the user named, else a selection that fits the inputs; then the measures of the
/// thresholds.
fn chosen(args: &CompareArgs, images: &Images, fail: &[Threshold], warn: &[Threshold]) -> Result<Vec<Measure>> {
    let mut list: Vec<Measure> = Vec::new();
    let with_baseline = images.baseline.is_some();
    let side = images.reference.picture.width.min(images.reference.picture.height);
    for name in &args.metric {
        match name.as_str() {
            "all" => {
                let fits = |m: &&Measure| m.smallest_side() <= side && (with_baseline || !m.info().needs_baseline);
                list.extend(Measure::ALL.iter().filter(fits));
            }
            "default" => list.extend(selection(images)),
            _ => list.push(name.parse()?),
        }
    }
    if list.is_empty() {
        list = selection(images);
    }
    list.extend(fail.iter().chain(warn).map(|threshold| threshold.measure));
    let mut seen = Vec::new();
    list.retain(|measure| {
        !seen.contains(measure) && {
            seen.push(*measure);
            true
        }
    });
    if let Some(measure) = list.iter().find(|m| m.info().needs_baseline && !with_baseline) {
        return Err(Error::usage(format!("{measure} compares each image with a baseline"))
            .help("Give the baseline with --baseline FILE, for example a picture with direct light only"));
    }
    Ok(list)
}

fn selection(images: &Images) -> Vec<Measure> {
    use Measure::{Flip, Fq, Gain, HdrFlip, Improved, Mae, Pearson, Psnr, RelMse, Rmse, Ssim};
    let looks = if images.reference.picture.display_referred { Flip } else { HdrFlip };
    let mut list = vec![Mae, Rmse, RelMse, Psnr, Pearson, Ssim, looks];
    if images.baseline.is_some() {
        list.extend([Fq, Gain, Improved]);
    }
    let side = images.reference.picture.width.min(images.reference.picture.height);
    list.retain(|m| m.smallest_side() <= side);
    list
}

fn passed(name: &str, values: &[Measured], thresholds: &[Threshold]) -> Vec<String> {
    let each = thresholds.iter().filter_map(|threshold| {
        let value = values.iter().find(|v| v.measure == threshold.measure)?;
        let side = if value.higher_is_better { "below" } else { "above" };
        let (shown, unit) = (report::number(value.value), value.unit);
        value
            .is_worse_than(threshold.value)
            .then(|| format!("{name}: {} is {shown}{unit}, {side} {}", value.measure, report::number(threshold.value)))
    });
    each.collect()
}

//! `lucerna reproduce` and `lucerna report`.

use std::{
    path::{Path, PathBuf},
    process::ExitCode,
    time::Instant,
};

use lucerna::{Error, Result, bake::Shard, gpu::Gpu};
use serde_json::json;

use super::{
    analysis::{self, papers},
    cache::Cache,
    file::{self, BUILTIN, Narrowed},
    place::Folders,
    results::Results,
    run::{self, Context, Planned, Rendered, Stopped},
};
use crate::{
    args::{DeviceArgs, Size, TalkArgs},
    bake,
    console::{self, Console},
    program::STOPPED_EARLY,
    progress::ProgressMode,
    reference::Span,
    report::write_own,
    signals::Interrupt,
};

/// Options of `lucerna reproduce`.
#[derive(clap::Args, Clone, Debug)]
pub struct ReproduceArgs {
    /// A built-in experiment (`--list` lists them), or a .toml file; `all`: the experiments of all papers, and a page with every number of the papers beside ours
    #[arg(value_name = "NAME|all|FILE.toml", required_unless_present = "list")]
    pub experiment: Option<String>,

    /// Quick mode: fewer views, smaller pictures or fewer samples, as the experiment defines
    #[arg(long)]
    pub quick: bool,

    /// Size of all pictures, instead of the sizes that the experiment names
    #[arg(long, value_name = "WxH")]
    pub size: Option<Size>,

    /// Only this scene of the experiment; may be repeated
    #[arg(long, value_name = "NAME")]
    pub scene: Vec<String>,

    /// Folder for the report and the pictures; existing pictures are not rendered again [default: NAME-report]
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,

    /// Folder of scenes that are not built in [default: $LUCERNA_ASSETS, else ../shared/assets]
    #[arg(long, value_name = "DIR")]
    pub assets: Option<PathBuf>,

    /// List the built-in experiments, then stop
    #[arg(long)]
    pub list: bool,

    /// List the pictures to render, and the existing pictures, then stop
    #[arg(long)]
    pub dry_run: bool,

    /// Render only the pictures of part I of N, for several machines with devices of one kind, and write no report. `auto`: the part of this
    /// task in an array job of Slurm, Grid Engine or Kubernetes; `auto/N`: of N parts. The same command without --shard renders what is
    /// missing and writes the report
    #[arg(long, value_name = "I/N|auto", value_parser = bake::shard)]
    pub shard: Option<Shard>,

    /// Start no picture that would end after this time: 90, 90s, 10m, 1h30m. Exit code 8 if pictures are missing then
    #[arg(long, value_name = "TIME")]
    pub time_limit: Option<Span>,

    /// Print one JSON document about the run on stdout
    #[arg(long)]
    pub json: bool,

    #[command(flatten)]
    pub device: DeviceArgs,

    #[command(flatten)]
    pub talk: TalkArgs,

    /// How progress is shown on stderr
    #[arg(long, value_enum, default_value_t, value_name = "HOW")]
    pub progress: ProgressMode,
}

/// Options of `lucerna report`.
#[derive(clap::Args, Clone, Debug)]
pub struct ReportArgs {
    /// A folder written by `lucerna reproduce`, also by `lucerna reproduce all`
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,

    /// Print one JSON document on stdout
    #[arg(long)]
    pub json: bool,

    #[command(flatten)]
    pub talk: TalkArgs,
}

/// Runs an experiment and writes its report.
///
/// # Errors
/// `Usage` and `Input` for wrong options and experiments; any error of rendering.
pub fn reproduce(args: &ReproduceArgs, console: Console) -> Result<ExitCode> {
    let Some(asked) = args.experiment.as_deref().filter(|_| !args.list) else {
        list(args.json)?;
        return Ok(ExitCode::SUCCESS);
    };
    if asked == ALL { all(args, console) } else { one(args, asked, console) }
}

/// Name of the experiments of all papers.
const ALL: &str = "all";

/// Runs the experiments of all papers, each into a folder of its name, and writes the page with every number of the papers.
fn all(args: &ReproduceArgs, console: Console) -> Result<ExitCode> {
    if args.json {
        let help = "Run `lucerna reproduce NAME --json` for each experiment, or read report.json of the folder";
        return Err(Error::usage("`reproduce all` prints no JSON document").help(help));
    }
    if !args.scene.is_empty() {
        let help = "Run `lucerna reproduce NAME --scene SCENE` for the experiment that has the scene";
        return Err(Error::usage("`reproduce all` takes no --scene: experiments have scenes of their own").help(help));
    }
    papers::check()?;
    let begun = Instant::now();
    let quick = if args.quick { "-quick" } else { "" };
    let folder = args.output.clone().unwrap_or_else(|| PathBuf::from(format!("papers{quick}-report")));
    for name in papers::EXPERIMENTS {
        let spent = begun.elapsed();
        let of = ReproduceArgs {
            output: Some(folder.join(name)),
            time_limit: args.time_limit.map(|limit| Span(limit.0.saturating_sub(spent))),
            ..args.clone()
        };
        let code = one(&of, name, console)?;
        if code != ExitCode::SUCCESS {
            return Ok(code);
        }
    }
    if args.dry_run || args.shard.is_some() {
        return Ok(ExitCode::SUCCESS);
    }
    summary(&folder, console, false)?;
    let seconds = begun.elapsed().as_secs();
    console.info(&format!("all papers in {} min {} s", seconds / 60, seconds % 60));
    Ok(ExitCode::SUCCESS)
}

/// Writes the page of all papers from the reports in the folders of `folder`.
fn summary(folder: &Path, console: Console, as_json: bool) -> Result<()> {
    let page = papers::summary(folder)?;
    let mut files = page.write(folder)?;
    let markdown = folder.join("reproduction.md");
    write_own(&markdown, page.markdown().as_bytes())?;
    files.push(markdown);
    let names: Vec<String> = files.iter().map(|path| path.display().to_string()).collect();
    if as_json {
        return console::print_json(&json!({ "experiment": ALL, "files": names }));
    }
    console.info(&format!("wrote {}", names.join(", ")));
    Ok(())
}

fn one(args: &ReproduceArgs, asked: &str, console: Console) -> Result<ExitCode> {
    let begun = Instant::now();
    let narrowed = Narrowed::new(args.size, &args.scene);
    let experiment = file::open(asked, args.quick)?.narrow(&narrowed)?;
    let interrupt = Interrupt::install();
    let quick = if args.quick { "-quick" } else { "" };
    let folder = args.output.clone().unwrap_or_else(|| PathBuf::from(format!("{}{quick}-report", experiment.name)));
    let cache = if args.dry_run { Cache::open(&folder) } else { Cache::create(&folder)? };
    let gpu = Gpu::new(args.device.options()?)?;
    let context = Context {
        gpu: &gpu,
        folders: Folders::new(&experiment, args.assets.as_deref()),
        cache: &cache,
        console,
        progress: args.progress,
        interrupt: &interrupt,
        command: ["lucerna reproduce", asked, if args.quick { "--quick" } else { "" }, &narrowed.to_string()]
            .into_iter()
            .filter(|part| !part.is_empty())
            .collect::<Vec<_>>()
            .join(" "),
        shard: args.shard,
        until: args.time_limit.map(|limit| begun + limit.0),
        dry: args.dry_run,
    };
    let Rendered { results, planned, stopped } = run::run(experiment, &context)?;
    if args.dry_run {
        return dry(&planned, args.json).map(|()| ExitCode::SUCCESS);
    }
    let (done, missing) = (results.runs.len(), results.missing);
    let asked_to_stop = stopped == Some(Stopped::Request);
    if asked_to_stop && done == 0 {
        return Ok(ExitCode::from(interrupt.exit_code()));
    }
    if let Some(shard) = args.shard {
        return of_shard(shard, &results, &folder, stopped, args.json, console);
    }
    results.write_manifest(&folder)?;
    interrupt.keep();
    if let Some(stopped) = stopped.filter(|_| missing > 0) {
        // After a stop no report is written, because its measures may take long.
        let (all, folder) = (done + missing, folder.display());
        console.info(&format!(
            "{stopped}: {done} of {all} runs are done; the same command continues, `lucerna report {folder}` shows the finished runs"
        ));
        return Ok(ExitCode::from(STOPPED_EARLY));
    }
    write(&results, &folder, console, args.json)?;
    if results.missing > 0 {
        return Ok(ExitCode::from(STOPPED_EARLY));
    }
    Ok(ExitCode::SUCCESS)
}

/// The end of a shard: no report, because runs of other shards may be missing.
fn of_shard(
    shard: Shard,
    results: &Results,
    folder: &Path,
    stopped: Option<Stopped>,
    as_json: bool,
    console: Console,
) -> Result<ExitCode> {
    let (done, missing, shown) = (results.runs.len(), results.missing, folder.display());
    if as_json {
        let name = &results.experiment.name;
        console::print_json(&json!({
            "experiment": name, "shard": shard.to_string(), "folder": folder, "runs": done, "missing": missing,
        }))?;
    }
    if missing > 0 {
        let (why, all) = (stopped.map_or("stopped".into(), |stopped| stopped.to_string()), done + missing);
        console.info(&format!(
            "{shown}: {why}: {done} of {all} runs of shard {shard} are done; the same command continues"
        ));
        return Ok(ExitCode::from(STOPPED_EARLY));
    }
    console.info(&format!(
        "{shown}: shard {shard} is done, {done} runs; the same command without --shard renders what is missing and writes the report"
    ));
    Ok(ExitCode::SUCCESS)
}

/// Writes the report of a folder again.
///
/// # Errors
/// `Input` if there are no results.
pub fn report(args: &ReportArgs, console: Console) -> Result<()> {
    if !args.folder.join("manifest.json").exists() && papers::is_summary(&args.folder) {
        return summary(&args.folder, console, args.json);
    }
    write(&Results::open(&args.folder)?, &args.folder, console, args.json)
}

fn write(results: &Results, folder: &Path, console: Console, as_json: bool) -> Result<()> {
    let files = analysis::report(results)?.write(folder)?;
    let names: Vec<String> = files.iter().map(|path| path.display().to_string()).collect();
    if as_json {
        let (runs, missing) = (results.runs.len(), results.missing);
        let skipped: Vec<&String> = results.skipped.iter().map(|(what, _)| what).collect();
        let name = &results.experiment.name;
        return console::print_json(&json!({
            "experiment": name, "runs": runs, "missing": missing, "skipped": skipped, "files": names,
        }));
    }
    console.info(&format!("wrote {}", names.join(", ")));
    Ok(())
}

fn list(as_json: bool) -> Result<()> {
    let mut all = Vec::new();
    for (name, text) in BUILTIN {
        all.push((*name, file::parse(name, None, text, false)?.title));
    }
    if as_json {
        let list: Vec<_> = all.iter().map(|(name, title)| json!({ "name": name, "title": title })).collect();
        return console::print_json(&json!(list));
    }
    let width = all.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
    let mut lines: Vec<String> = all.iter().map(|(name, title)| format!("{name:width$}  {title}")).collect();
    lines.push(format!("{ALL:width$}  {}, and every number of the papers beside ours", papers::EXPERIMENTS.join(", ")));
    console::print(&lines.join("\n"))
}

fn dry(planned: &[Planned], as_json: bool) -> Result<()> {
    if as_json {
        let runs = planned.iter().map(|run| Ok(json!({ "run": console::to_json(&run.done)?, "there": run.there })));
        return console::print_json(&json!(runs.collect::<Result<Vec<_>>>()?));
    }
    let there = planned.iter().filter(|run| run.there).count();
    for run in planned {
        let mark = if run.there { "there " } else { "render" };
        console::print(&format!("{mark}  {}/{}  {}", run.done.scene, run.done.view, run.done.label()))?;
    }
    console::print(&format!("{} runs, {there} of them exist", planned.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_experiment_that_comes_along_can_be_read() {
        for (name, text) in BUILTIN {
            for quick in [false, true] {
                file::parse(name, None, text, quick).unwrap_or_else(|error| panic!("{name}: {error}"));
            }
        }
    }
}

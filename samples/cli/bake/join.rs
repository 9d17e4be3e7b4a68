//! `lucerna merge`: folders of one job into one, or into the file that the job is for.

use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};

use lucerna::{
    Error, Result,
    bake::{self, Store},
    image,
    techniques::{
        daylight,
        fiv::{Stored, file, units},
        prt,
    },
    tracer::bands,
};
use serde_json::json;

use super::{folder_of, parts, remove, said_unknown};
use crate::{
    args::TalkArgs,
    console::{self, Console},
    program::STOPPED_EARLY,
};

/// Options of `lucerna merge`.
#[derive(clap::Args, Clone, Debug)]
pub struct JoinArgs {
    /// Folders of one job (FILE.fiv.parts, FILE.prt.parts, FILE.day.parts, PICTURE.exr.parts), or .fiv files with parts of one whole, in any
    /// order. They stay as they are
    #[arg(value_name = "PART", required = true)]
    pub parts: Vec<PathBuf>,

    /// File to write (FILE.fiv, FILE.prt), or folder to bring all units into (PICTURE.exr.parts, from which `lucerna reference` makes the
    /// picture; FILE.day.parts, from which `daylight bake` makes the file)
    #[arg(short, long, value_name = "FILE|FOLDER", help_heading = "Output")]
    pub output: PathBuf,

    /// Replace the file if it exists
    #[arg(long, help_heading = "Output")]
    pub overwrite: bool,

    /// Print one JSON document about the joined units on stdout
    #[arg(long, help_heading = "Output")]
    pub json: bool,

    #[command(flatten)]
    pub talk: TalkArgs,
}

/// Joins parts.
///
/// # Errors
/// `Input` if parts are of different jobs, or files are damaged; `Output` if something cannot be written.
pub fn join(args: &JoinArgs, console: Console) -> Result<ExitCode> {
    let folders: Vec<PathBuf> = args.parts.iter().map(|path| folder_of(path)).collect();
    if let Some(missing) = folders.iter().find(|path| !path.exists()) {
        let error = Error::input("does not exist").in_file(missing);
        return Err(error.help("Name folders or files that a stopped or finished run has left"));
    }
    let ending = args.output.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
    let to_file = ["fiv", "prt"].contains(&ending) && !args.output.is_dir();
    if to_file {
        image::probe_output(&args.output, args.overwrite)?;
    }
    if folders.iter().all(|path| !path.is_dir()) {
        if let Some(file) = folders.iter().find(|path| path.extension().is_some_and(|e| e == "prt" || e == "day")) {
            let error = Error::usage("is a whole bake, and only the folders of stopped bakes are joined").in_file(file);
            return Err(error.help("Name the folders FILE.prt.parts or FILE.day.parts"));
        }
        if ending != "fiv" || !to_file {
            let error = Error::usage("parts are files, and files are joined to a file").in_file(&args.output);
            return Err(error.help("Name a file that ends with .fiv, or join folders"));
        }
        return files(&folders, args, console);
    }
    if let Some(file) = folders.iter().find(|path| !path.is_dir()) {
        let error = Error::usage("is no folder, but other parts are folders").in_file(file);
        return Err(error.help("Join folders with folders and files with files"));
    }
    if let Some(kind) = folders.iter().find_map(|folder| Some(Store::open(folder).ok()?.job().key().kind().to_owned()))
    {
        expect_output(&kind, ending, &args.output)?;
    }
    let into = if to_file { parts(&args.output)? } else { args.output.clone() };
    let (store, merged) = bake::merge(&folders, &into)?;
    merged.faulty.iter().for_each(|error| console.warning(&format!("{error}; it does not count")));
    merged.unknown.iter().for_each(|(folder, name)| said_unknown(folder, std::slice::from_ref(name), console));
    let missing = store.job().list(&merged.missing);
    let units = store.job().units().count() - merged.missing.len();
    if args.json {
        console::print_json(&json!({
            "folder": store.folder(),
            "file": (to_file && merged.missing.is_empty()).then_some(&args.output),
            "units": units,
            "linked": merged.linked,
            "copied": merged.copied,
            "missing": merged.missing.iter().map(|&unit| store.job().name(unit)).collect::<Vec<_>>(),
            "faulty": merged.faulty.iter().map(ToString::to_string).collect::<Vec<_>>(),
        }))?;
    }
    if !merged.missing.is_empty() {
        let shown = into.display();
        console.info(&format!("{shown}: {units} units are there, {} are missing: {missing}", merged.missing.len()));
        return Ok(ExitCode::from(STOPPED_EARLY));
    }
    if !to_file {
        console.info(&format!("{}: all {units} units are there", into.display()));
        return Ok(ExitCode::SUCCESS);
    }
    let bytes = joined(&store, &args.output, args.overwrite)?;
    // The joined folders stay. The folder that was created for the merge is removed, unless it is one of them.
    let real = |path: &Path| std::fs::canonicalize(path).ok();
    if folders.iter().all(|folder| real(folder) != real(&into)) {
        remove(store, console)?;
    }
    console.info(&format!("wrote {}: {bytes} bytes", args.output.display()));
    Ok(ExitCode::SUCCESS)
}

/// Checks that an output with this ending is right for units of this kind.
fn expect_output(kind: &str, ending: &str, output: &Path) -> Result<()> {
    let (what, command, file) = match kind {
        bands::KIND => ("a picture", "lucerna reference", "PICTURE"),
        daylight::units::KIND => ("daylight", "daylight bake", "FILE.day"),
        _ => {
            let wanted = if kind == prt::units::KIND { "prt" } else { "fiv" };
            if ending == wanted || !["fiv", "prt", "day"].contains(&ending) || output.is_dir() {
                return Ok(());
            }
            let error = Error::usage(format!("the parts are units of kind `{kind}`")).in_file(output);
            return Err(error.help(format!("Name a file that ends with .{wanted}, or a folder")));
        }
    };
    if ending == "parts" {
        return Ok(());
    }
    let error = Error::usage(format!("the parts are of {what}, which `{command}` joins")).in_file(output);
    Err(error
        .help(format!("Name the folder {file}.parts, and then run the command without --shard and with -o {file}")))
}

fn files(paths: &[PathBuf], args: &JoinArgs, console: Console) -> Result<ExitCode> {
    let parts = paths.iter().map(Stored::read).collect::<Result<Vec<_>>>()?;
    let whole = file::merge(parts)?;
    whole.write(&args.output, args.overwrite)?;
    let samples = whole.plan.samples();
    console.info(&format!("wrote {}: {samples} samples", args.output.display()));
    if args.json {
        console::print_json(&json!({ "file": args.output, "samples": samples }))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Writes the file that a job is for, whole or not at all; its bytes.
///
/// # Errors
/// `Input` if units are missing or damaged, or the job is for no file; `Output` if the file cannot be written.
pub fn joined(store: &Store, output: &Path, overwrite: bool) -> Result<u64> {
    match store.job().key().kind() {
        units::KIND => units::join(store)?.write(output, overwrite)?,
        prt::units::KIND => image::write_atomic(output, &prt::Stored::of_parts(store)?.encode()?, overwrite)?,
        kind => {
            let error =
                Error::input(format!("is a job of kind `{kind}`, which is for no file")).in_file(store.folder());
            return Err(error.help("Name a folder with -o"));
        }
    }
    Ok(std::fs::metadata(output).map_or(0, |metadata| metadata.len()))
}

//! Joins folders of one job.

use std::{
    ffi::OsString,
    fs::{self, File},
    path::{Path, PathBuf},
};

use super::{State, Store, UnitId};
use crate::{Error, Result};

/// The result of a merge.
#[derive(Debug, Default)]
pub struct Merged {
    /// Units that the target had already.
    pub there: u64,
    /// Units that were added as hard links.
    pub linked: u64,
    /// Units that were copied, because the file system refused a hard link.
    pub copied: u64,
    /// Units that no folder has.
    pub missing: Vec<UnitId>,
    /// Why some files were rejected.
    pub faulty: Vec<Error>,
    /// Files that do not belong to the job: folder and name.
    pub unknown: Vec<(PathBuf, OsString)>,
}

/// Collects the units of all folders in one folder, which may exist already. All folders must belong to one job. Each unit is verified before it
/// is accepted. No file is removed from any folder.
///
/// # Errors
/// `Input` if a folder cannot be read, or belongs to another job (the message names the parts that differ); `Output` if a unit cannot be
/// written.
pub fn merge(from: &[PathBuf], into: &Path) -> Result<(Store, Merged)> {
    let Some((first, rest)) = from.split_first() else { return Err(Error::usage("there are no folders to join")) };
    let first = Store::open(first)?;
    let mut stores = vec![first];
    for folder in rest {
        let store = Store::open(folder)?;
        if let Some(difference) = stores[0].job().key().difference(store.job().key()) {
            let what = format!("belongs to another job than {}: {difference}", stores[0].folder().display());
            return Err(Error::input(what).in_file(folder).help("Join folders of one job"));
        }
        stores.push(store);
    }
    let target = Store::create(into, stores[0].job().clone())?;
    let mut merged = Merged::default();
    for store in &stores {
        let survey = store.survey(false)?;
        merged.unknown.extend(survey.unknown.into_iter().map(|name| (store.folder().to_owned(), name)));
    }
    // The target may be one of the sources.
    let real = |folder: &Path| fs::canonicalize(folder).unwrap_or_else(|_| folder.to_owned());
    let home = real(into);
    stores.retain(|store| real(store.folder()) != home);
    for unit in target.job().units() {
        match target.check(unit) {
            State::Whole(_) => {
                merged.there += 1;
                continue;
            }
            State::Faulty(error) => merged.faulty.push(error),
            State::Missing => {}
        }
        let mut found = false;
        for store in &stores {
            match store.check(unit) {
                State::Whole(_) => {
                    match bring(store, &target, unit)? {
                        true => merged.linked += 1,
                        false => merged.copied += 1,
                    }
                    found = true;
                    break;
                }
                State::Faulty(error) => merged.faulty.push(error),
                State::Missing => {}
            }
        }
        if !found {
            merged.missing.push(unit);
        }
    }
    // Links reach the disk with their folder; not every file system can do that.
    if let Ok(folder) = File::open(into) {
        let _ = folder.sync_all();
    }
    Ok((target, merged))
}

/// True: by a hard link.
fn bring(from: &Store, to: &Store, unit: UnitId) -> Result<bool> {
    let (source, target) = (from.path(unit), to.path(unit));
    // A link to a link would depend on where the first one leads.
    let plain = source.symlink_metadata().is_ok_and(|metadata| metadata.is_file());
    if plain && fs::hard_link(&source, &target).is_ok() {
        return Ok(true);
    }
    to.put(unit, &from.open_unit(unit)?.bytes()?)?;
    Ok(false)
}

//! The folder of a job.

use std::{
    collections::HashSet,
    ffi::OsString,
    fs, io,
    path::{Path, PathBuf},
};

use super::{Digest, Job, MANIFEST, Payload, UnitId, unit};
use crate::{Error, ErrorKind, Result, image};

/// The folder of a job: its description (`job.json`) and one file for each finished unit. Several processes, also on several machines, may use
/// the folder at the same time: files appear whole, and the bytes of a unit do not depend on the process that computed it.
#[derive(Clone, Debug)]
pub struct Store {
    folder: PathBuf,
    job: Job,
    key: Digest,
}

/// The state of a unit's file.
#[derive(Debug)]
pub enum State {
    Missing,
    /// Its bytes.
    Whole(u64),
    /// The file is damaged, cut off, or belongs to another job. The unit is computed again.
    Faulty(Error),
}

/// The content of a job's folder.
#[derive(Debug, Default)]
pub struct Survey {
    /// Finished units, in order.
    pub whole: Vec<UnitId>,
    /// In order.
    pub missing: Vec<UnitId>,
    /// Rejected units, each with the reason.
    pub faulty: Vec<(UnitId, Error)>,
    /// Bytes of the finished units.
    pub bytes: u64,
    /// Files that do not belong to the job. They are neither read nor removed.
    pub unknown: Vec<OsString>,
}

impl Store {
    /// Opens the folder of a job, or creates it.
    ///
    /// # Errors
    /// `Output` if the folder belongs to another job (the message names the parts that differ), or if it cannot be written.
    pub fn create(folder: &Path, job: Job) -> Result<Self> {
        let bytes = job.encode()?;
        fs::create_dir_all(folder).map_err(|error| {
            Error::new(ErrorKind::Output, "the folder cannot be made").in_file(folder).caused_by(error)
        })?;
        let store = Self { folder: folder.to_owned(), key: job.key().digest(), job };
        let path = folder.join(MANIFEST);
        // Another process may write the description at the same time. The second process reads the description of the first.
        for _ in 0..3 {
            if path.symlink_metadata().is_ok() {
                match Job::read(folder) {
                    Ok(there) => {
                        store.same_as(&there)?;
                        return Ok(store);
                    }
                    Err(error) => {
                        log::warn!("{error}; it is written anew");
                        image::write_atomic(&path, &bytes, true)?;
                        return Ok(store);
                    }
                }
            }
            match image::write_atomic(&path, &bytes, false) {
                Ok(()) => return Ok(store),
                Err(_) if path.symlink_metadata().is_ok() => {}
                Err(error) => return Err(error),
            }
        }
        Err(Error::new(ErrorKind::Output, "is written and removed by other processes").in_file(path))
    }

    fn same_as(&self, there: &Job) -> Result<()> {
        match self.job.key().difference(there.key()) {
            None => Ok(()),
            Some(difference) => {
                let what = format!("belongs to other work: {difference}");
                Err(Error::new(ErrorKind::Output, what).in_file(self.folder.join(MANIFEST)))
            }
        }
    }

    /// Opens an existing folder with the job that its description gives.
    ///
    /// # Errors
    /// `Input` if it has no description, or one that cannot be read.
    pub fn open(folder: &Path) -> Result<Self> {
        let missing = |error: Error| match folder.join(MANIFEST).symlink_metadata() {
            Ok(_) => error.help("Run the command that made the folder again: it writes the description anew"),
            Err(_) => error.help("Name the folder of a job, such as FILE.fiv.parts of `fiv precompute -o FILE.fiv`"),
        };
        let job = Job::read(folder).map_err(missing)?;
        Ok(Self { folder: folder.to_owned(), key: job.key().digest(), job })
    }

    pub fn folder(&self) -> &Path {
        &self.folder
    }

    pub fn job(&self) -> &Job {
        &self.job
    }

    /// The file of a unit.
    pub fn path(&self, unit: UnitId) -> PathBuf {
        self.folder.join(self.job.file_name(unit))
    }

    /// Checks the header and the length of a unit's file.
    pub fn look(&self, unit: UnitId) -> State {
        self.state(unit, |_| Ok(()))
    }

    /// Checks all bytes of a unit's file.
    pub fn check(&self, unit: UnitId) -> State {
        self.state(unit, Payload::verify)
    }

    fn state(&self, unit: UnitId, more: impl Fn(&Payload) -> Result<()>) -> State {
        let path = self.path(unit);
        // A link without a target exists, but cannot be read.
        match path.symlink_metadata() {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return State::Missing,
            _ => {}
        }
        match self.open_unit(unit).and_then(|payload| more(&payload).map(|()| payload.len())) {
            Ok(length) => State::Whole(length),
            Err(error) => State::Faulty(error),
        }
    }

    /// Opens a unit without verifying its bytes.
    ///
    /// # Errors
    /// `Input`, naming the file, if it is missing, damaged, cut off, or of another job.
    pub fn open_unit(&self, unit: UnitId) -> Result<Payload> {
        Payload::open(&self.path(unit), self.key, unit)
    }

    /// Writes a unit's file, over a rejected one.
    ///
    /// # Errors
    /// `Output` if the file cannot be written, or if its name is a link: the link's target does not belong to the job.
    pub fn put(&self, unit: UnitId, payload: &[u8]) -> Result<()> {
        let path = self.path(unit);
        if path.symlink_metadata().is_ok_and(|metadata| metadata.is_symlink()) {
            let error = Error::new(ErrorKind::Output, "is a link, and its target does not belong to this job");
            return Err(error.in_file(path).help("Remove it"));
        }
        image::write_atomic(&path, &unit::encode(self.key, unit, payload)?, true)
    }

    /// Lists the folder. `all`: checks all bytes; otherwise headers and lengths only.
    ///
    /// # Errors
    /// `Input` if the folder cannot be read.
    pub fn survey(&self, all: bool) -> Result<Survey> {
        let mut survey = Survey::default();
        let mut there = HashSet::new();
        for name in self.names()? {
            match name.to_str().and_then(|name| self.job.of_file(name)) {
                Some(unit) => drop(there.insert(unit)),
                None if name == MANIFEST || image::is_temporary(&name) => {}
                None => survey.unknown.push(name),
            }
        }
        survey.unknown.sort();
        for unit in self.job.units() {
            let state = match (there.contains(&unit), all) {
                (false, _) => State::Missing,
                (true, true) => self.check(unit),
                (true, false) => self.look(unit),
            };
            match state {
                State::Missing => survey.missing.push(unit),
                State::Faulty(error) => survey.faulty.push((unit, error)),
                State::Whole(bytes) => {
                    survey.bytes += bytes;
                    survey.whole.push(unit);
                }
            }
        }
        Ok(survey)
    }

    fn names(&self) -> Result<Vec<OsString>> {
        let cannot = |error: io::Error| Error::input("cannot be listed").in_file(&self.folder).caused_by(error);
        fs::read_dir(&self.folder).map_err(cannot)?.map(|entry| Ok(entry.map_err(cannot)?.file_name())).collect()
    }

    /// Removes the files of the job and, if it is empty then, the folder. Returns the names of all other files, which stay.
    ///
    /// # Errors
    /// `Output` if a file cannot be removed.
    pub fn remove(self) -> Result<Vec<OsString>> {
        let names = self.names()?;
        let ours =
            |name: &OsString| name == MANIFEST || name.to_str().is_some_and(|name| self.job.of_file(name).is_some());
        // The description is removed last, so that a partly removed folder can still be identified.
        let units = names.iter().filter(|name| ours(name) && *name != MANIFEST);
        for name in units.chain(names.iter().filter(|name| *name == MANIFEST)) {
            let path = self.folder.join(name);
            match fs::remove_file(&path) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => {
                    let what = "cannot be removed";
                    return Err(Error::new(ErrorKind::Output, what).in_file(path).caused_by(error));
                }
                _ => {}
            }
        }
        let _ = fs::remove_dir(&self.folder);
        Ok(names.into_iter().filter(|name| !ours(name)).collect())
    }
}

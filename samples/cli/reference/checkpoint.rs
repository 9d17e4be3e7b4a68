//! The checkpoint file: the state of an unfinished picture, next to the picture's file.

use std::{
    path::PathBuf,
    time::{Duration, Instant},
};

use lucerna::{
    Error, ErrorKind, Result,
    image::{read_file_checked, write_atomic},
    tracer::{State, Tracer},
};
use serde_json::Value;

/// Minimum time between two checkpoints.
const PAUSE: Duration = Duration::from_secs(20);
/// Maximum share of the time for writing checkpoints.
const SHARE: f64 = 0.05;

/// The checkpoint file, and the time at which the next write is due.
#[derive(Debug)]
pub struct Checkpoint {
    path: Option<PathBuf>,
    about: Value,
    next: Instant,
}

impl Checkpoint {
    /// A checkpoint next to `image`: `image.exr.state`. `None`: no checkpoint. `LUCERNA_CHECKPOINT_SECONDS` shortens the first pause, for
    /// tests.
    pub fn new(image: Option<PathBuf>, about: Value) -> Self {
        let path = image.map(|image| {
            let mut name = image.into_os_string();
            name.push(".state");
            PathBuf::from(name)
        });
        Self { path, about, next: Instant::now() + pause() }
    }

    /// Checks that there is no checkpoint. A checkpoint may hold hours of work, so only `restart` allows to overwrite it.
    ///
    /// # Errors
    /// `Output` if there is one; the message gives its progress.
    pub fn probe(&self, restart: bool) -> Result<()> {
        let Some(path) = self.path.as_ref().filter(|path| !restart && path.symlink_metadata().is_ok()) else {
            return Ok(());
        };
        let what = match State::glance(path) {
            Ok(head) => {
                let [width, height] = head.extent;
                format!("a stopped run has left {} samples a pixel of {width}×{height}", head.samples)
            }
            Err(error) => format!("a stopped run has left a state that cannot be read ({})", error.what()),
        };
        Err(Error::new(ErrorKind::Output, what).in_file(path).help(
            "Give --resume to continue with the same options, --restart to start again and overwrite it, or give another image with -o",
        ))
    }

    /// Continues from the checkpoint, if there is one.
    ///
    /// # Errors
    /// `Input` if the checkpoint belongs to another picture or is damaged.
    pub fn resume(&self, tracer: &mut Tracer<'_>) -> Result<bool> {
        let Some(path) = self.path.as_ref().filter(|path| path.exists()) else { return Ok(false) };
        let [width, height] = tracer.view()?.extent;
        if let Some([w, h]) = State::glance(path).ok().map(|head| head.extent).filter(|of| *of != [width, height]) {
            let what = format!("is the state of another picture: of {w}×{h} pixels, this one has {width}×{height}");
            return Err(Error::input(what)
                .in_file(path)
                .help("Start again with --restart, or give the size of that picture"));
        }
        // Reads at most the size of this picture's state, even if the file is longer.
        let bytes = read_file_checked(path, State::most_bytes([width, height]))?;
        let state = State::decode(&bytes).map_err(|error| error.in_file(path))?;
        tracer.restore(&state, &self.about).map_err(|error| error.in_file(path))?;
        Ok(true)
    }

    /// Whether a checkpoint is due.
    pub fn is_due(&self) -> bool {
        self.path.is_some() && Instant::now() >= self.next
    }

    /// The state of the tracer for [`Self::write`].
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub fn state(&self, tracer: &Tracer<'_>) -> Result<State> {
        tracer.save(&self.about)
    }

    /// Writes the checkpoint as a whole or not at all. Returns false if checkpoints are off.
    ///
    /// # Errors
    /// `Output`; the previous checkpoint stays.
    pub fn write(&mut self, state: &State) -> Result<bool> {
        let Some(path) = &self.path else { return Ok(false) };
        let begun = Instant::now();
        write_atomic(path, &state.encode()?, true)?;
        self.next = Instant::now() + pause().max(begun.elapsed().div_f64(SHARE));
        Ok(true)
    }

    /// Removes the checkpoint of a finished picture.
    pub fn remove(&self) {
        if let Some(path) = &self.path {
            // In most cases the file does not exist.
            let _ = std::fs::remove_file(path);
        }
    }
}

fn pause() -> Duration {
    let asked = std::env::var("LUCERNA_CHECKPOINT_SECONDS").ok().and_then(|text| text.parse().ok());
    asked.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok()).unwrap_or(PAUSE)
}

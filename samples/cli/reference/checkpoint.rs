//! The state of a picture in the making, in a file beside the picture.

use std::{
    path::PathBuf,
    time::{Duration, Instant},
};

use lucerna::{
    Result,
    image::{read_file_checked, write_atomic},
    reference::tracer::{State, Tracer},
};
use serde_json::Value;

/// Time between two states at least.
const PAUSE: Duration = Duration::from_secs(20);
/// Of the time, at most this share goes into writing states.
const SHARE: f64 = 0.05;
/// Largest state that is read, bytes.
const MOST: u64 = 64 << 30;

/// Where the state is kept, and when it is due.
#[derive(Debug)]
pub struct Checkpoint {
    path: Option<PathBuf>,
    about: Value,
    next: Instant,
}

impl Checkpoint {
    /// Beside `image`: `image.exr.state`. `None`: nowhere. `LUCERNA_CHECKPOINT_SECONDS` shortens the first pause, for tests.
    pub fn new(image: Option<PathBuf>, about: Value) -> Self {
        let path = image.map(|image| {
            let mut name = image.into_os_string();
            name.push(".state");
            PathBuf::from(name)
        });
        Self { path, about, next: Instant::now() + pause() }
    }

    /// Goes on from the state, if there is one.
    ///
    /// # Errors
    /// `Input` if it is of another picture or damaged.
    pub fn resume(&self, tracer: &mut Tracer<'_>) -> Result<bool> {
        let Some(path) = self.path.as_ref().filter(|path| path.exists()) else { return Ok(false) };
        let state = State::decode(&read_file_checked(path, MOST)?).map_err(|error| error.in_file(path))?;
        tracer.restore(&state, &self.about).map_err(|error| error.in_file(path))?;
        Ok(true)
    }

    /// Whether it is time to write.
    pub fn is_due(&self) -> bool {
        self.path.is_some() && Instant::now() >= self.next
    }

    /// Writes the state, whole or not at all. False if there is no place for it.
    ///
    /// # Errors
    /// `Output`; what was there stays.
    pub fn write(&mut self, tracer: &Tracer<'_>) -> Result<bool> {
        let Some(path) = &self.path else { return Ok(false) };
        let begun = Instant::now();
        write_atomic(path, &tracer.save(&self.about)?.encode()?, true)?;
        self.next = Instant::now() + pause().max(begun.elapsed().div_f64(SHARE));
        Ok(true)
    }

    /// The picture is done.
    pub fn remove(&self) {
        if let Some(path) = &self.path {
            // Not there in most cases.
            let _ = std::fs::remove_file(path);
        }
    }
}

fn pause() -> Duration {
    let asked = std::env::var("LUCERNA_CHECKPOINT_SECONDS").ok().and_then(|text| text.parse().ok());
    asked.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok()).unwrap_or(PAUSE)
}

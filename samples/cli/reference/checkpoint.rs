//! The state of a picture in the making, in a file beside the picture.

use std::{
    path::PathBuf,
    time::{Duration, Instant},
};

use lucerna::{
    Error, ErrorKind, Result,
    image::{read_file_checked, write_atomic},
    reference::tracer::{State, Tracer},
};
use serde_json::Value;

/// Time between two states at least.
const PAUSE: Duration = Duration::from_secs(20);
/// Of the time, at most this share goes into writing states.
const SHARE: f64 = 0.05;

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

    /// Whether there is room for a state: that of a stopped run may be worth hours, and is neither replaced nor removed unless `restart`
    /// says so.
    ///
    /// # Errors
    /// `Output` if there is one, saying how far it is.
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
            "Give --resume to go on with the options that it was begun with, --restart to start anew over it, or name another image with -o",
        ))
    }

    /// Goes on from the state, if there is one.
    ///
    /// # Errors
    /// `Input` if it is of another picture or damaged.
    pub fn resume(&self, tracer: &mut Tracer<'_>) -> Result<bool> {
        let Some(path) = self.path.as_ref().filter(|path| path.exists()) else { return Ok(false) };
        let [width, height] = tracer.view()?.extent;
        if let Some([w, h]) = State::glance(path).ok().map(|head| head.extent).filter(|of| *of != [width, height]) {
            let what = format!("is the state of another picture: of {w}×{h} pixels, this one has {width}×{height}");
            return Err(Error::input(what).in_file(path).help("Start anew, or give the size that it was begun with"));
        }
        // No more than the state of this picture takes, whatever the length of the file.
        let bytes = read_file_checked(path, State::most_bytes([width, height]))?;
        let state = State::decode(&bytes).map_err(|error| error.in_file(path))?;
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

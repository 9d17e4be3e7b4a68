//! Being asked to stop.

use std::sync::{
    Arc,
    atomic::{AtomicBool, Ordering},
};

use crate::{Error, ErrorKind, Result};

/// Whether work shall stop, shared by whoever asks for it (a signal handler, a window that is closed) and whoever works. Clones are the
/// same one. [`crate::gpu::GpuOptions::stop`] hands it to a device: graphs then end between two submissions with
/// [`ErrorKind::Interrupted`], and so does waiting for one that takes longer than a second more.
///
/// ```
/// let stop = lucerna::Stop::default();
/// let asker = stop.clone();
/// assert!(stop.check().is_ok());
/// asker.request();
/// assert_eq!(stop.check().unwrap_err().kind(), lucerna::ErrorKind::Interrupted);
/// ```
#[derive(Clone, Debug, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// One that `flag` sets.
    pub fn by(flag: Arc<AtomicBool>) -> Self {
        Self(flag)
    }

    /// Asks.
    pub fn request(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// True from the first request on.
    pub fn requested(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// For loops that may take long.
    ///
    /// # Errors
    /// `Interrupted` from the first request on.
    pub fn check(&self) -> Result<()> {
        if self.requested() { Err(Error::new(ErrorKind::Interrupted, "stopped on request")) } else { Ok(()) }
    }
}

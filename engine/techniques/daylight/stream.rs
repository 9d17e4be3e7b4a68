//! Frames that a thread reads from disk ahead of time.
//!
//! A ring of steps is in memory. The reader reads the steps that a picture needs, and then those that the next pictures will need, as far as the
//! ring has room. A picture waits only for a step that is not there yet.

use std::{
    sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError},
    thread::JoinHandle,
    time::{Duration, Instant},
};

use super::Frames;
use crate::{Error, ErrorKind, Result};

/// A picture looks so often whether the reader has ended.
const LOOK: Duration = Duration::from_millis(50);

/// A reader of frames.
#[derive(Debug)]
pub struct Stream {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    ring: usize,
}

#[derive(Debug, Default)]
struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    /// Steps, the most urgent first; at most as many as the ring has places.
    wanted: Vec<usize>,
    ready: Vec<(usize, Arc<Vec<u8>>)>,
    failed: Vec<(usize, Error)>,
    stop: bool,
}

/// Steps for a picture.
#[derive(Debug)]
pub struct Fetched {
    /// In the order of the request.
    pub steps: Vec<Arc<Vec<u8>>>,
    /// How long the picture waited for the disk.
    pub waited: Duration,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The reader's work, until it is stopped.
    fn serve(&self, ring: usize, read: &mut dyn FnMut(usize) -> Result<Vec<u8>>) {
        let mut state = self.lock();
        while !state.stop {
            let there = |step: &usize| state.ready.iter().any(|(s, _)| s == step);
            let broken = |step: &usize| state.failed.iter().any(|(s, _)| s == step);
            let next = state.wanted.iter().copied().find(|step| !there(step) && !broken(step));
            let Some(step) = next else {
                state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
                continue;
            };
            if state.ready.len() >= ring {
                // All wanted steps have room in the ring, so one that is there is not wanted.
                let wanted = state.wanted.clone();
                let unwanted = state.ready.iter().position(|(s, _)| !wanted.contains(s)).unwrap_or(0);
                state.ready.remove(unwanted);
            }
            drop(state);
            let result = read(step);
            state = self.lock();
            match result {
                Ok(bytes) => state.ready.push((step, Arc::new(bytes))),
                Err(error) => state.failed.push((step, error)),
            }
            self.changed.notify_all();
        }
    }
}

impl Stream {
    /// Starts a reader whose ring has `ring` places, at least [`super::frames::LEAST_RING`].
    ///
    /// # Errors
    /// `Input` if the file cannot be opened; `Runtime` if no thread can be started.
    pub fn new(frames: &Arc<Frames>, ring: usize) -> Result<Self> {
        let (frames, mut file) = (Arc::clone(frames), frames.reader()?);
        Self::by(ring, move |step| frames.read(&mut file, step))
    }

    fn by(ring: usize, mut read: impl FnMut(usize) -> Result<Vec<u8>> + Send + 'static) -> Result<Self> {
        let ring = ring.max(super::frames::LEAST_RING);
        let shared = Arc::new(Shared::default());
        let of_thread = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("daylight frames".into())
            .spawn(move || of_thread.serve(ring, &mut read))
            .map_err(|error| Error::new(ErrorKind::Runtime, "the reader of frames cannot start").caused_by(error))?;
        Ok(Self { shared, thread: Some(thread), ring })
    }

    /// The steps that a picture needs, at most [`super::frames::LEAST_RING`]. `upcoming`: steps of the next pictures, the nearest first.
    ///
    /// # Errors
    /// Those of [`Frames::read`] for a needed step; `Runtime` if the reader has ended.
    pub fn fetch(&mut self, needed: &[usize], upcoming: impl Iterator<Item = usize>) -> Result<Fetched> {
        let mut wanted: Vec<usize> = Vec::new();
        for step in needed.iter().copied().chain(upcoming) {
            if wanted.len() >= self.ring {
                break;
            }
            if !wanted.contains(&step) {
                wanted.push(step);
            }
        }
        let begun = Instant::now();
        let mut state = self.shared.lock();
        state.wanted = wanted;
        // What failed before is tried again.
        state.failed.clear();
        self.shared.changed.notify_all();
        let mut waited = Duration::ZERO;
        loop {
            if let Some(at) = state.failed.iter().position(|(step, _)| needed.contains(step)) {
                return Err(state.failed.remove(at).1);
            }
            let found = |step: &usize| state.ready.iter().find(|(s, _)| s == step).map(|(_, bytes)| Arc::clone(bytes));
            if let Some(steps) = needed.iter().map(found).collect() {
                return Ok(Fetched { steps, waited });
            }
            if self.thread.as_ref().is_none_or(JoinHandle::is_finished) {
                return Err(Error::new(ErrorKind::Runtime, "the reader of frames has ended"));
            }
            let looked = self.shared.changed.wait_timeout(state, LOOK);
            state = looked.unwrap_or_else(PoisonError::into_inner).0;
            waited = begun.elapsed();
        }
    }
}

impl Drop for Stream {
    fn drop(&mut self) {
        self.shared.lock().stop = true;
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    fn content(step: usize) -> Vec<u8> {
        vec![step as u8; 3]
    }

    /// Waits until the reader has nothing to do.
    fn settle(stream: &Stream) {
        loop {
            let state = stream.shared.lock();
            if state.wanted.iter().all(|step| state.ready.iter().any(|(s, _)| s == step)) {
                return;
            }
            drop(state);
            std::thread::yield_now();
        }
    }

    #[test]
    fn steps_come_in_order_ahead_of_time_and_within_the_ring() {
        let reads = Arc::new(AtomicUsize::new(0));
        let counted = Arc::clone(&reads);
        let mut stream = Stream::by(5, move |step| {
            counted.fetch_add(1, Ordering::Relaxed);
            Ok(content(step))
        })
        .unwrap();
        for at in 0..50usize {
            let fetched = stream.fetch(&[at, at + 1], at + 2..at + 20).unwrap();
            assert_eq!(fetched.steps, [at, at + 1].map(|step| Arc::new(content(step))));
            settle(&stream);
            let state = stream.shared.lock();
            assert!(state.ready.len() <= 5 && state.wanted == (at..at + 5).collect::<Vec<_>>());
            drop(state);
        }
        // Each step was read once: the ring keeps what comes next.
        assert_eq!(reads.load(Ordering::Relaxed), 54);
        // After the first picture nothing was waited for.
        assert_eq!(stream.fetch(&[50, 51], 52..60).unwrap().waited, Duration::ZERO);
        // Backwards, and a jump.
        let fetched = stream.fetch(&[3, 2], (0..2).rev()).unwrap();
        assert_eq!(fetched.steps, [3, 2].map(|step| Arc::new(content(step))));
    }

    #[test]
    fn an_error_comes_with_the_picture_that_needs_the_step_and_nothing_hangs() {
        let mut stream = Stream::by(4, |step| match step {
            2 => Err(Error::input("is cut off").at("step 2")),
            3 => panic!("a bug of the reader"),
            step => Ok(content(step)),
        })
        .unwrap();
        assert_eq!(stream.fetch(&[0, 1], 2..3).unwrap().steps.len(), 2);
        for _ in 0..2 {
            let error = stream.fetch(&[1, 2], 0..0).unwrap_err();
            assert!(error.place() == Some("step 2") && error.to_string().contains("cut off"), "{error}");
        }
        stream.fetch(&[0, 1], 0..0).unwrap();
        let error = stream.fetch(&[3], 0..0).unwrap_err();
        assert!(error.to_string().contains("has ended"), "{error}");
    }
}

//! Progress of the computation of vectors, on stderr.

use std::time::{Duration, Instant};

use crate::progress::{ProgressMode, span};

/// Shows progress at intervals.
#[derive(Debug)]
pub struct Meter {
    mode: ProgressMode,
    started: Instant,
    shown: Instant,
    /// Samples that earlier runs have computed.
    before: u64,
    total: u64,
}

impl Meter {
    /// A meter for `total` samples, of which earlier runs have computed `before`.
    pub fn new(mode: ProgressMode, quiet: bool, before: u64, total: u64) -> Self {
        let mode = mode.here(quiet, false);
        Self { mode, started: Instant::now(), shown: Instant::now(), before, total }
    }

    /// Duration of this run so far, seconds.
    pub fn seconds(&self) -> f64 {
        self.started.elapsed().as_secs_f64()
    }

    /// Shows that `done` samples are done, including those of earlier runs. The last line is always shown.
    pub fn show(&mut self, done: u64) {
        let last = done >= self.total;
        let pause = if self.mode == ProgressMode::Bar { 200 } else { 5000 };
        if self.mode == ProgressMode::None || (!last && self.shown.elapsed() < Duration::from_millis(pause)) {
            return;
        }
        self.shown = Instant::now();
        let (rate, left) = rate(self.before, done, self.total, self.seconds());
        let percent = 100.0 * done as f64 / self.total.max(1) as f64;
        let text = match (self.mode, last) {
            (ProgressMode::Json, _) => serde_json::json!({
                "done": done, "total": self.total, "samples_per_second": rate, "seconds_left": left,
            })
            .to_string(),
            (_, true) => format!("{done} samples, {rate:.0} samples/s, {:.1} s", self.seconds()),
            (_, false) => {
                format!("{done}/{} samples ({percent:.0} %), {rate:.0} samples/s, {} left", self.total, span(left))
            }
        };
        self.mode.progress_line(&text, last);
    }
}

/// Samples per second, and the seconds left at this rate.
fn rate(before: u64, done: u64, total: u64, seconds: f64) -> (f64, f64) {
    let rate = done.saturating_sub(before) as f64 / seconds.max(1e-9);
    (rate, total.saturating_sub(done) as f64 / rate.max(1e-9))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_left_follows_from_this_run_alone() {
        assert_eq!(rate(100, 300, 700, 2.0), (100.0, 4.0));
        assert_eq!(rate(0, 700, 700, 2.0).1, 0.0);
    }
}

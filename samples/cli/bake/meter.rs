//! The progress of a computation, on stderr.

use std::time::{Duration, Instant};

use serde_json::json;

use super::size;
use crate::progress::{ProgressMode, span};

/// Shows the finished share, the rate, the bytes and the remaining time at intervals.
#[derive(Debug)]
pub struct Meter {
    mode: ProgressMode,
    /// Noun for the counted items: `samples`.
    what: &'static str,
    started: Instant,
    shown: Instant,
    /// Done before this run.
    before: u64,
    total: u64,
}

impl Meter {
    /// Counts up to `total` items; `before` of them were finished earlier.
    pub fn new(mode: ProgressMode, quiet: bool, what: &'static str, before: u64, total: u64) -> Self {
        let mode = mode.here(quiet, false);
        Self { mode, what, started: Instant::now(), shown: Instant::now(), before, total }
    }

    /// Seconds of this run.
    pub fn seconds(&self) -> f64 {
        self.started.elapsed().as_secs_f64()
    }

    /// `done`: finished items, with earlier ones. `bytes`: bytes that this run has computed; 0 if they are not counted. The last line is always
    /// shown.
    pub fn show(&mut self, done: u64, bytes: u64) {
        let last = done >= self.total;
        let pause = if self.mode == ProgressMode::Bar { 200 } else { 5000 };
        if self.mode == ProgressMode::None || (!last && self.shown.elapsed() < Duration::from_millis(pause)) {
            return;
        }
        self.shown = Instant::now();
        let share = done as f64 / self.total.max(1) as f64;
        self.mode.share(if last { 1.0 } else { share });
        self.mode.progress_line(&self.text(done, bytes, self.seconds()), last);
    }

    fn text(&self, done: u64, bytes: u64, seconds: f64) -> String {
        let Self { what, total, .. } = self;
        let (rate, left) = rate(self.before, done, *total, seconds);
        let bytes_rate = bytes as f64 / seconds.max(1e-9);
        if self.mode == ProgressMode::Json {
            let mut line = json!({ "done": done, "total": total, "seconds_left": left, "bytes": bytes, "bytes_per_second": bytes_rate });
            line[format!("{what}_per_second")] = json!(rate);
            return line.to_string();
        }
        let written = match bytes {
            0 => String::new(),
            _ => format!(", {}, {}/s", size(bytes as f64), size(bytes_rate)),
        };
        if done >= *total {
            return format!("{done} {what}, {rate:.0} {what}/s{written}, {seconds:.1} s");
        }
        let (percent, left) = (100.0 * done as f64 / (*total).max(1) as f64, span(left));
        let bar = match self.mode {
            ProgressMode::Bar => {
                let filled = (percent / 5.0) as usize;
                format!("{}{} ", "█".repeat(filled), "░".repeat(20usize.saturating_sub(filled)))
            }
            _ => String::new(),
        };
        format!("{bar}{done}/{total} {what} ({percent:.0} %), {rate:.0} {what}/s{written}, {left} left")
    }
}

/// How many a second, and seconds that are left at this pace.
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

    #[test]
    fn lines_say_how_much_how_fast_and_how_long() {
        let meter = |mode| Meter { mode, ..Meter::new(ProgressMode::None, true, "samples", 100, 700) };
        let plain = meter(ProgressMode::Plain);
        assert_eq!(plain.text(300, 0, 2.0), "300/700 samples (43 %), 100 samples/s, 4 s left");
        assert_eq!(plain.text(300, 7200, 2.0), "300/700 samples (43 %), 100 samples/s, 7.2 kB, 3.6 kB/s, 4 s left");
        assert_eq!(plain.text(700, 7200, 2.0), "700 samples, 300 samples/s, 7.2 kB, 3.6 kB/s, 2.0 s");
        assert!(meter(ProgressMode::Bar).text(300, 0, 2.0).starts_with("████████░░░░░░░░░░░░ 300/700"));
        let line: serde_json::Value = serde_json::from_str(&meter(ProgressMode::Json).text(300, 7200, 2.0)).unwrap();
        assert_eq!((&line["samples_per_second"], &line["bytes_per_second"]), (&json!(100.0), &json!(3600.0)));
    }
}

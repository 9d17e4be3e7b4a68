//! How far computing vectors is, on stderr.

use std::{
    io::{IsTerminal, Write},
    time::{Duration, Instant},
};

use crate::progress::ProgressMode;

/// Shows progress from time to time.
#[derive(Debug)]
pub struct Meter {
    mode: ProgressMode,
    started: Instant,
    shown: Instant,
    /// Done before this run.
    before: u64,
    total: u64,
}

impl Meter {
    /// Towards `total` samples, of which `before` were done earlier.
    pub fn new(mode: ProgressMode, quiet: bool, before: u64, total: u64) -> Self {
        let terminal = std::io::stderr().is_terminal();
        let mode = match mode {
            ProgressMode::Auto if quiet => ProgressMode::None,
            ProgressMode::Auto | ProgressMode::Bar if terminal => ProgressMode::Bar,
            ProgressMode::Auto | ProgressMode::Bar => ProgressMode::Plain,
            mode => mode,
        };
        Self { mode, started: Instant::now(), shown: Instant::now(), before, total }
    }

    /// Seconds of this run.
    pub fn seconds(&self) -> f64 {
        self.started.elapsed().as_secs_f64()
    }

    /// So many are done, with those done earlier. The last line is always shown.
    pub fn show(&mut self, done: u64) {
        let last = done >= self.total;
        let pause = if self.mode == ProgressMode::Bar { 200 } else { 5000 };
        if self.mode == ProgressMode::None || (!last && self.shown.elapsed() < Duration::from_millis(pause)) {
            return;
        }
        self.shown = Instant::now();
        let (rate, left) = rate(self.before, done, self.total, self.seconds());
        let mut err = std::io::stderr().lock();
        let percent = 100.0 * done as f64 / self.total.max(1) as f64;
        let text = match last {
            true => format!("{done} samples, {rate:.0} samples/s, {:.1} s", self.seconds()),
            false => {
                format!("{done}/{} samples ({percent:.0} %), {rate:.0} samples/s, {} left", self.total, span(left))
            }
        };
        let _ = match self.mode {
            ProgressMode::Json => {
                let value = serde_json::json!({
                    "done": done, "total": self.total, "samples_per_second": rate, "seconds_left": left,
                });
                writeln!(err, "{value}")
            }
            ProgressMode::Bar if !last => write!(err, "\r\x1b[K{text}").and_then(|()| err.flush()),
            ProgressMode::Bar => writeln!(err, "\r\x1b[K{text}"),
            _ => writeln!(err, "{text}"),
        };
    }
}

/// Samples a second, and seconds that are left at this pace.
fn rate(before: u64, done: u64, total: u64, seconds: f64) -> (f64, f64) {
    let rate = done.saturating_sub(before) as f64 / seconds.max(1e-9);
    (rate, total.saturating_sub(done) as f64 / rate.max(1e-9))
}

fn span(seconds: f64) -> String {
    match seconds {
        s if s >= 36_000.0 => format!("{:.0} h", s / 3600.0),
        s if s >= 600.0 => format!("{:.0} min", s / 60.0),
        s => format!("{s:.0} s"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_left_follows_from_this_run_alone() {
        assert_eq!(rate(100, 300, 700, 2.0), (100.0, 4.0));
        assert_eq!(rate(0, 700, 700, 2.0).1, 0.0);
        assert_eq!((span(59.0).as_str(), span(720.0).as_str(), span(72_000.0).as_str()), ("59 s", "12 min", "20 h"));
    }
}

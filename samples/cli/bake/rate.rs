//! The progress of a computation in units.

use serde_json::{Map, json};

use super::size;
use crate::progress::{Meter, Moment, ProgressMode, span};

/// Shows the finished share, the rate, the bytes and the remaining time at intervals.
#[derive(Debug)]
pub struct Rate {
    meter: Meter,
    /// Noun for the counted items: `samples`.
    unit: &'static str,
    /// Done before this run.
    before: u64,
    total: u64,
}

impl Rate {
    /// Counts up to `total` items; `before` of them were finished earlier.
    pub fn new(mode: ProgressMode, quiet: bool, unit: &'static str, before: u64, total: u64) -> Self {
        Self { meter: Meter::new(mode, quiet, false), unit, before, total }
    }

    /// `done`: finished items, with earlier ones. `bytes`: bytes that this run has computed; 0 if they are not counted. The last line is always
    /// shown.
    pub fn show(&mut self, done: u64, bytes: u64) {
        if self.meter.shows() && (done >= self.total || self.meter.due()) {
            let moment = self.moment(done, bytes, self.meter.seconds());
            self.meter.show(&moment);
        }
    }

    fn moment(&self, done: u64, bytes: u64, seconds: f64) -> Moment {
        let Self { unit, total, .. } = *self;
        let (rate, left) = rate(self.before, done, total, seconds);
        let bytes_rate = bytes as f64 / seconds.max(1e-9);
        let written = match bytes {
            0 => String::new(),
            _ => format!(", {}, {}/s", size(bytes as f64), size(bytes_rate)),
        };
        let percent = 100.0 * done as f64 / total.max(1) as f64;
        let text = match done >= total {
            true => format!("{done} {unit}, {rate:.0} {unit}/s{written}, {seconds:.1} s"),
            false => {
                format!("{done}/{total} {unit} ({percent:.0} %), {rate:.0} {unit}/s{written}, {} left", span(left))
            }
        };
        let mut facts = Map::new();
        facts.insert(format!("{unit}_per_second"), json!(rate));
        facts.insert("bytes".into(), json!(bytes));
        facts.insert("bytes_per_second".into(), json!(bytes_rate));
        let (done, total) = (done as f64, total as f64);
        Moment { done, total, unit, seconds_left: Some(left), text, facts, last: done >= total }
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
        let meter = Rate::new(ProgressMode::None, true, "samples", 100, 700);
        let text = |done, bytes| meter.moment(done, bytes, 2.0).text;
        assert_eq!(text(300, 0), "300/700 samples (43 %), 100 samples/s, 4 s left");
        assert_eq!(text(300, 7200), "300/700 samples (43 %), 100 samples/s, 7.2 kB, 3.6 kB/s, 4 s left");
        assert_eq!(text(700, 7200), "700 samples, 300 samples/s, 7.2 kB, 3.6 kB/s, 2.0 s");
        let facts = meter.moment(300, 7200, 2.0).facts;
        assert_eq!((&facts["samples_per_second"], &facts["bytes_per_second"]), (&json!(100.0), &json!(3600.0)));
    }
}

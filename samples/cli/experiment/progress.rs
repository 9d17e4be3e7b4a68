//! Progress over runs of different duration.

use std::collections::BTreeMap;

use serde_json::json;

use crate::progress::{Meter, Moment, ProgressMode, into_facts, span};

/// Counts runs, and estimates the remaining time from the times of runs of the same method.
#[derive(Debug)]
pub struct Progress {
    meter: Meter,
    total: usize,
    done: usize,
    /// Number of remaining runs, by method.
    left: BTreeMap<String, usize>,
    /// Time in seconds and number of finished runs, by method.
    spent: BTreeMap<String, (f64, usize)>,
    /// Seconds of the slowest run, by method.
    slowest: BTreeMap<String, f64>,
}

impl Progress {
    pub fn new(mode: ProgressMode, quiet: bool, runs: BTreeMap<String, usize>) -> Self {
        let meter = Meter::new(mode, quiet, false);
        Self {
            meter,
            total: runs.values().sum(),
            done: 0,
            left: runs,
            spent: BTreeMap::new(),
            slowest: BTreeMap::new(),
        }
    }

    /// Estimated remaining seconds; `None` without finished runs.
    pub fn seconds_left(&self) -> Option<f64> {
        let (seconds, count) = self.spent.values().fold((0.0, 0), |(s, c), (seconds, count)| (s + seconds, c + count));
        (count > 0).then(|| {
            let mean = |method: &str| match self.spent.get(method) {
                Some((seconds, count)) if *count > 0 => seconds / *count as f64,
                _ => seconds / count as f64,
            };
            self.left.iter().map(|(method, left)| *left as f64 * mean(method)).sum()
        })
    }

    /// Seconds of the slowest finished run of a method; 0 without finished runs.
    pub fn slowest(&self, method: &str) -> f64 {
        self.slowest.get(method).copied().unwrap_or(0.0)
    }

    /// Reports a finished run: its time in `seconds` if it was rendered, `None` if the picture existed.
    pub fn run(&mut self, method: &str, name: &str, seconds: Option<f64>) {
        self.done += 1;
        if let Some(left) = self.left.get_mut(method) {
            *left = left.saturating_sub(1);
        }
        if let Some(seconds) = seconds {
            let spent = self.spent.entry(method.to_owned()).or_default();
            *spent = (spent.0 + seconds, spent.1 + 1);
            let slowest = self.slowest.entry(method.to_owned()).or_default();
            *slowest = slowest.max(seconds);
        }
        let (done, total) = (self.done, self.total);
        if seconds.is_none() && done < total && !self.meter.shows_idle_items() {
            return;
        }
        let took = seconds.map_or("exists".to_owned(), |seconds| format!("{seconds:.1} s"));
        let seconds_left = self.seconds_left();
        let left = seconds_left.filter(|_| done < total).map(|left| format!(", {} left", span(left)));
        self.meter.show(&Moment {
            done: done as f64,
            total: total as f64,
            unit: "runs",
            seconds_left,
            text: format!("run {done}/{total}{}: {name}: {took}", left.unwrap_or_default()),
            facts: into_facts(json!({ "run": name, "run_seconds": seconds })),
            last: done >= total,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_left_follows_the_method() {
        let runs = BTreeMap::from([("fast".to_owned(), 10), ("slow".to_owned(), 3)]);
        let mut progress = Progress::new(ProgressMode::None, true, runs);
        assert_eq!(progress.seconds_left(), None);
        progress.run("fast", "", Some(1.0));
        progress.run("fast", "", None);
        assert_eq!(progress.seconds_left(), Some(8.0 + 3.0));
        progress.run("slow", "", Some(100.0));
        assert_eq!(progress.seconds_left(), Some(8.0 + 200.0));
        progress.run("slow", "", Some(50.0));
        assert_eq!([progress.slowest("slow"), progress.slowest("new")], [100.0, 0.0]);
    }
}

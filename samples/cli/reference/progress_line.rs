//! The progress of a reference picture, on stderr.

use std::time::{Duration, Instant};

use lucerna::tracer::Progress;

use crate::progress::{Meter, Moment, ProgressMode, into_facts, span};

/// The goals of a run. The first one that is reached ends it.
#[derive(Clone, Copy, Debug)]
pub struct Goals {
    /// Paths per pixel.
    pub samples: u64,
    /// Estimated relative mean squared error.
    pub error: Option<f64>,
    /// Time of this run.
    pub time: Option<Duration>,
}

impl Goals {
    /// Estimated remaining time in seconds, and the goal that will be reached first. `samples`: all samples; `done`: samples of this run,
    /// which took `seconds`. `error`: the last estimated error, and the number of samples at that time. The error is a variance, so it is
    /// inversely proportional to the number of samples.
    fn left(&self, samples: f64, done: f64, seconds: f64, error: Option<(f64, f64)>) -> (f64, &'static str) {
        let each = seconds / done.max(1e-12);
        let mut first = ((self.samples as f64 - samples).max(0.0) * each, "samples");
        if let (Some(goal), Some((error, at))) = (self.error, error.filter(|(e, _)| e.is_finite())) {
            let left = (at * error / goal - samples).max(0.0) * each;
            first = if left < first.0 { (left, "error") } else { first };
        }
        if let Some(limit) = self.time {
            let left = (limit.as_secs_f64() - seconds).max(0.0);
            first = if left < first.0 { (left, "time") } else { first };
        }
        first
    }
}

/// Shows progress from time to time.
#[derive(Debug)]
pub struct ProgressLine {
    meter: Meter,
    goals: Goals,
    /// Progress at the start of this run.
    before: Progress,
    /// The last estimated error, and the number of samples at that time.
    error: Option<(f64, f64)>,
}

impl ProgressLine {
    /// A progress line for a run with `goals`. `before`: the progress of earlier runs.
    pub fn new(mode: ProgressMode, quiet: bool, goals: Goals, before: Progress) -> Self {
        Self { meter: Meter::new(mode, quiet, false), goals, before, error: None }
    }

    /// This run began at `begun`, when `before` paths had been traced.
    pub fn traced(&mut self, begun: Instant, before: u64) {
        let share = before as f64 / self.before.paths.max(1) as f64;
        self.before = Progress { samples: self.before.samples * share, paths: before, ..self.before };
        self.meter.since(begun);
    }

    /// Whether the line shows the error.
    pub fn wants_error(&self) -> bool {
        self.meter.shows()
    }

    /// Records an estimated error.
    pub fn error(&mut self, now: &Progress, error: f64) {
        self.error = Some((error, now.samples));
    }

    /// Seconds of this run.
    pub fn seconds(&self) -> f64 {
        self.meter.seconds()
    }

    /// Paths per second in this run.
    pub fn rate(&self, now: &Progress) -> f64 {
        (now.paths - self.before.paths) as f64 / self.seconds().max(1e-9)
    }

    /// Shows the line, if it is due.
    pub fn show(&mut self, now: &Progress) {
        if self.meter.due() {
            self.line(now, false);
        }
    }

    /// Shows the last line.
    pub fn finish(&mut self, now: &Progress, error: f64) {
        self.error(now, error);
        if self.meter.shows() {
            self.line(now, true);
        }
    }

    fn line(&mut self, now: &Progress, last: bool) {
        let (seconds, rate) = (self.seconds(), self.rate(now));
        let done = now.samples - self.before.samples;
        let (left, by) = self.goals.left(now.samples, done, seconds, self.error);
        let error = self.error.map(|(error, _)| error).filter(|e| e.is_finite());
        let samples = if now.samples < 10.0 { format!("{:.1}", now.samples) } else { format!("{:.0}", now.samples) };
        let mut text = format!("{samples}/{} samples, {} samples/s", self.goals.samples, count(rate));
        if let Some(error) = error {
            text += &format!(", relative error {error:.2e}");
            if let Some(goal) = self.goals.error {
                text += &format!(" of {goal:.2e}");
            }
        }
        match last {
            true => text += &format!(", {seconds:.1} s"),
            false => text += &format!(", {} left", span(left)),
        }
        let facts = serde_json::json!({
            "paths_per_second": rate, "relative_error": error, "target_error": self.goals.error, "ends_by": by,
        });
        self.meter.show(&Moment {
            done: now.samples,
            total: self.goals.samples as f64,
            unit: "samples",
            seconds_left: Some(left),
            text,
            facts: into_facts(facts),
            last,
        });
    }
}

fn count(rate: f64) -> String {
    match rate {
        r if r >= 1e6 => format!("{:.1} M", r * 1e-6),
        r if r >= 1e3 => format!("{:.0} k", r * 1e-3),
        r => format!("{r:.0}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_goal_that_comes_first_tells_the_time_left() {
        let goals = Goals { samples: 1_000_000, error: None, time: None };
        // 100 samples in ten seconds.
        assert_eq!(goals.left(100.0, 100.0, 10.0, Some((0.5, 80.0))), (99_990.0, "samples"));
        // An error of 0.04 after 80 samples is one of 0.01 after 320: 220 more.
        let goals = Goals { error: Some(0.01), ..goals };
        let (left, by) = goals.left(100.0, 100.0, 10.0, Some((0.04, 80.0)));
        assert!((left - 22.0).abs() < 1e-9 && by == "error", "{left} {by}");
        assert_eq!(goals.left(100.0, 100.0, 10.0, None).1, "samples");
        assert_eq!(goals.left(100.0, 100.0, 10.0, Some((f64::INFINITY, 1.0))).1, "samples");
        // The error goal is already reached; the run ends at the next estimate.
        assert_eq!(goals.left(100.0, 100.0, 10.0, Some((0.001, 80.0))), (0.0, "error"));
        let goals = Goals { time: Some(Duration::from_secs(15)), ..goals };
        assert_eq!(goals.left(100.0, 100.0, 10.0, Some((0.04, 80.0))), (5.0, "time"));
        // Samples of an earlier run count for the goals, but not for the speed.
        let (left, _) = Goals { time: None, ..goals }.left(100.0, 50.0, 10.0, Some((0.04, 80.0)));
        assert!((left - 44.0).abs() < 1e-9);
    }
}

//! How far a reference picture is, on stderr.

use std::{
    io::{IsTerminal, Write},
    time::{Duration, Instant},
};

use lucerna::reference::tracer::Progress;

use crate::progress::ProgressMode;

/// Shows progress from time to time.
#[derive(Debug)]
pub struct Meter {
    mode: ProgressMode,
    target: u64,
    started: Instant,
    /// Before this run.
    before: Progress,
    shown: Option<Instant>,
    error: Option<f64>,
}

impl Meter {
    /// Towards `target` samples.
    pub fn new(mode: ProgressMode, quiet: bool, target: u64, before: Progress) -> Self {
        let terminal = std::io::stderr().is_terminal();
        let mode = match mode {
            ProgressMode::Auto if quiet => ProgressMode::None,
            ProgressMode::Auto | ProgressMode::Bar if terminal => ProgressMode::Bar,
            ProgressMode::Auto | ProgressMode::Bar => ProgressMode::Plain,
            mode => mode,
        };
        Self { mode, target, started: Instant::now(), before, shown: None, error: None }
    }

    /// Whether the error is shown to anybody.
    pub fn wants_error(&self) -> bool {
        self.mode != ProgressMode::None
    }

    /// The estimated error was looked at.
    pub fn error(&mut self, error: f64) {
        self.error = Some(error);
    }

    /// Seconds of this run.
    pub fn seconds(&self) -> f64 {
        self.started.elapsed().as_secs_f64()
    }

    /// Paths a second of this run.
    pub fn rate(&self, now: &Progress) -> f64 {
        (now.paths - self.before.paths) as f64 / self.seconds().max(1e-9)
    }

    /// Shows it, if it was not just shown.
    pub fn show(&mut self, now: &Progress) {
        let pause = match self.mode {
            ProgressMode::Bar => Duration::from_millis(200),
            _ => Duration::from_secs(5),
        };
        if self.mode == ProgressMode::None || self.shown.is_some_and(|at| at.elapsed() < pause) {
            return;
        }
        if self.shown.is_none() && self.mode != ProgressMode::Bar {
            // Short runs say only how they ended.
            self.shown = Some(Instant::now());
            return;
        }
        self.shown = Some(Instant::now());
        self.line(now, false);
    }

    /// The last line.
    pub fn finish(&mut self, now: &Progress, error: f64) {
        self.error = Some(error);
        if self.mode != ProgressMode::None {
            self.line(now, true);
        }
    }

    fn line(&self, now: &Progress, last: bool) {
        let done = now.samples - self.before.samples;
        let left = (self.target as f64 - now.samples).max(0.0) / (done / self.seconds().max(1e-9)).max(1e-12);
        let error = self.error.filter(|e| e.is_finite());
        let mut err = std::io::stderr().lock();
        if self.mode == ProgressMode::Json {
            let text = serde_json::json!({
                "samples": now.samples, "target": self.target, "paths_per_second": self.rate(now),
                "relative_error": error, "seconds_left": if last { 0.0 } else { left }, "done": last,
            });
            let _ = writeln!(err, "{text}");
            return;
        }
        let samples = if now.samples < 10.0 { format!("{:.1}", now.samples) } else { format!("{:.0}", now.samples) };
        let mut text = format!("{samples}/{} samples, {} samples/s", self.target, count(self.rate(now)));
        if let Some(error) = error {
            text += &format!(", relative error {error:.2e}");
        }
        match last {
            true => text += &format!(", {:.1} s", self.seconds()),
            false => text += &format!(", {} left", span(left)),
        }
        let _ = match (self.mode, last) {
            (ProgressMode::Bar, false) => write!(err, "\r\x1b[K{text}").and_then(|()| err.flush()),
            (ProgressMode::Bar, true) => writeln!(err, "\r\x1b[K{text}"),
            _ => writeln!(err, "{text}"),
        };
    }
}

fn count(rate: f64) -> String {
    match rate {
        r if r >= 1e6 => format!("{:.1} M", r * 1e-6),
        r if r >= 1e3 => format!("{:.0} k", r * 1e-3),
        r => format!("{r:.0}"),
    }
}

fn span(seconds: f64) -> String {
    match seconds {
        s if s >= 36_000.0 => format!("{:.0} h", s / 3600.0),
        s if s >= 600.0 => format!("{:.0} min", s / 60.0),
        s => format!("{s:.0} s"),
    }
}

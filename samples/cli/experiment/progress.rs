//! Progress over runs of different duration.

use std::{
    collections::BTreeMap,
    io::{IsTerminal, Write},
    time::Duration,
};

use crate::progress::ProgressMode;

/// Counts runs, and estimates the remaining time from the times of runs of the same method.
#[derive(Debug)]
pub struct Progress {
    mode: ProgressMode,
    total: usize,
    done: usize,
    /// Number of remaining runs, by method.
    left: BTreeMap<String, usize>,
    /// Time in seconds and number of finished runs, by method.
    spent: BTreeMap<String, (f64, usize)>,
}

impl Progress {
    pub fn new(mode: ProgressMode, quiet: bool, runs: BTreeMap<String, usize>) -> Self {
        let mode = match mode {
            ProgressMode::Auto if quiet => ProgressMode::None,
            ProgressMode::Auto if std::io::stderr().is_terminal() => ProgressMode::Bar,
            ProgressMode::Auto => ProgressMode::Plain,
            ProgressMode::Bar if !std::io::stderr().is_terminal() => ProgressMode::Plain,
            mode => mode,
        };
        Self { mode, total: runs.values().sum(), done: 0, left: runs, spent: BTreeMap::new() }
    }

    /// Estimated remaining time; `None` without finished runs.
    pub fn time_left(&self) -> Option<Duration> {
        let (seconds, count) = self.spent.values().fold((0.0, 0), |(s, c), (seconds, count)| (s + seconds, c + count));
        (count > 0).then(|| {
            let mean = |method: &str| match self.spent.get(method) {
                Some((seconds, count)) if *count > 0 => seconds / *count as f64,
                _ => seconds / count as f64,
            };
            Duration::from_secs_f64(self.left.iter().map(|(method, left)| *left as f64 * mean(method)).sum())
        })
    }

    /// Reports a finished run: its time in `seconds` if it was rendered, `None` if the picture existed.
    pub fn run(&mut self, method: &str, what: &str, seconds: Option<f64>) {
        self.done += 1;
        if let Some(left) = self.left.get_mut(method) {
            *left = left.saturating_sub(1);
        }
        if let Some(seconds) = seconds {
            let spent = self.spent.entry(method.to_owned()).or_default();
            *spent = (spent.0 + seconds, spent.1 + 1);
        }
        let (done, total) = (self.done, self.total);
        let took = seconds.map_or("there already".to_owned(), |seconds| format!("{seconds:.1} s"));
        let left = self.time_left().map(|left| format!(", {} left", spoken(left))).unwrap_or_default();
        self.mode.share(done as f64 / total.max(1) as f64);
        let mut err = std::io::stderr().lock();
        let _ = match self.mode {
            ProgressMode::Bar => {
                let filled = done * 30 / total.max(1);
                let bar = format!("{}{}", "█".repeat(filled), "░".repeat(30 - filled.min(30)));
                write!(err, "\r\x1b[K{bar} {done}/{total}{left}  {what}").and_then(|()| err.flush())
            }
            // Lines about existing pictures would hide the lines about rendered pictures.
            ProgressMode::Plain if seconds.is_none() && done < total => Ok(()),
            ProgressMode::Plain => writeln!(err, "run {done}/{total}: {what}: {took}{left}"),
            ProgressMode::Json => {
                let left = self.time_left().map(|left| left.as_secs_f64());
                let line = serde_json::json!({ "done": done, "total": total, "run": what, "seconds": seconds, "seconds_left": left });
                writeln!(err, "{line}")
            }
            ProgressMode::OpenJd => writeln!(err, "openjd_status: run {done}/{total}{left}"),
            ProgressMode::Auto | ProgressMode::None => Ok(()),
        };
    }

    /// Ends the line.
    pub fn finish(&self) {
        if self.mode == ProgressMode::Bar {
            let _ = write!(std::io::stderr().lock(), "\r\x1b[K");
        }
    }
}

/// `3 h 20 min`, `4 min 10 s`, `12 s`.
pub fn spoken(time: Duration) -> String {
    let seconds = time.as_secs_f64().round() as u64;
    match seconds {
        0..60 => format!("{seconds} s"),
        60..3600 => format!("{} min {:02} s", seconds / 60, seconds % 60),
        _ => format!("{} h {:02} min", seconds / 3600, seconds % 3600 / 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_left_follows_the_method() {
        let runs = BTreeMap::from([("fast".to_owned(), 10), ("slow".to_owned(), 3)]);
        let mut progress = Progress::new(ProgressMode::None, true, runs);
        assert_eq!(progress.time_left(), None);
        progress.run("fast", "", Some(1.0));
        progress.run("fast", "", None);
        assert_eq!(progress.time_left(), Some(Duration::from_secs(8 + 3)));
        progress.run("slow", "", Some(100.0));
        assert_eq!(progress.time_left(), Some(Duration::from_secs(8 + 200)));
        assert_eq!(spoken(Duration::from_secs(4200)), "1 h 10 min");
        assert_eq!(spoken(Duration::from_secs(61)), "1 min 01 s");
    }
}

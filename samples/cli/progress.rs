//! Progress over frames, on stderr.

use std::io::{IsTerminal, Write};

use serde_json::json;

/// How progress is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum ProgressMode {
    /// A bar on a terminal, plain lines elsewhere; nothing with -q.
    #[default]
    Auto,
    /// A bar.
    Bar,
    /// One line per frame.
    Plain,
    /// One JSON object per line.
    Json,
    /// Lines that Open Job Description schedulers read (openjd_progress, openjd_status).
    #[value(name = "openjd")]
    OpenJd,
    None,
}

impl ProgressMode {
    /// Resolves `Auto` for this process. A bar consists of escape codes, so it is shown on terminals only. `few`: there is too little work
    /// for a bar.
    pub fn here(self, quiet: bool, few: bool) -> Self {
        let terminal = std::io::stderr().is_terminal();
        match self {
            Self::Auto if quiet => Self::None,
            Self::Auto if terminal && !few => Self::Bar,
            Self::Bar if terminal => Self::Bar,
            Self::Auto | Self::Bar => Self::Plain,
            mode => mode,
        }
    }

    /// Writes a progress line. As a bar it overwrites the line before. `last`: no further line follows.
    pub fn progress_line(self, text: &str, last: bool) {
        let mut err = std::io::stderr().lock();
        // A closed stderr is not an error.
        let _ = match (self, last) {
            (Self::None, _) => Ok(()),
            (Self::Bar, false) => write!(err, "\r\x1b[K{text}").and_then(|()| err.flush()),
            (Self::Bar, true) => writeln!(err, "\r\x1b[K{text}"),
            (Self::OpenJd, _) => writeln!(err, "openjd_status: {text}"),
            _ => writeln!(err, "{text}"),
        };
    }

    /// Says how much of all is done, from 0 to 1, where somebody reads that apart from the line.
    pub fn share(self, done: f64) {
        if self == Self::OpenJd {
            let percent = if done.is_finite() { 100.0 * done.clamp(0.0, 1.0) } else { 0.0 };
            let _ = writeln!(std::io::stderr().lock(), "openjd_progress: {percent:.1}");
        }
    }
}

/// A rough time span: `59 s`, `12 min`, `20 h`.
pub fn span(seconds: f64) -> String {
    match seconds {
        s if s >= 36_000.0 => format!("{:.0} h", s / 3600.0),
        s if s >= 600.0 => format!("{:.0} min", s / 60.0),
        s => format!("{s:.0} s"),
    }
}

/// Counts frames.
#[derive(Debug)]
pub struct Progress {
    mode: ProgressMode,
    total: u64,
    done: u64,
    bar: Option<indicatif::ProgressBar>,
}

impl Progress {
    /// For `total` frames.
    pub fn new(mode: ProgressMode, quiet: bool, total: u64) -> Self {
        let mode = mode.here(quiet, total <= 1);
        let bar = (mode == ProgressMode::Bar).then(|| {
            let style = indicatif::ProgressStyle::with_template("{bar:40} {pos}/{len} frames, {eta} left {msg}");
            let bar = indicatif::ProgressBar::new(total);
            if let Ok(style) = style {
                bar.set_style(style);
            }
            bar
        });
        Self { mode, total, done: 0, bar }
    }

    /// Reports a finished frame: its number, its time in milliseconds, and the files written.
    pub fn frame(&mut self, frame: u32, milliseconds: f64, files: &[String]) {
        self.step(&format!("frame {frame}"), json!(frame), milliseconds, files);
    }

    fn step(&mut self, what: &str, frame: serde_json::Value, milliseconds: f64, files: &[String]) {
        self.done += 1;
        self.mode.share(self.done as f64 / self.total.max(1) as f64);
        let mut err = std::io::stderr().lock();
        let _ = match self.mode {
            ProgressMode::Bar => {
                if let Some(bar) = &self.bar {
                    bar.set_position(self.done);
                    bar.set_message(files.join(" "));
                }
                Ok(())
            }
            ProgressMode::Plain => writeln!(
                err,
                "{what} ({}/{}): {milliseconds:.0} ms{}{}",
                self.done,
                self.total,
                if files.is_empty() { "" } else { ", wrote " },
                files.join(" ")
            ),
            ProgressMode::Json => writeln!(
                err,
                "{}",
                json!({ "frame": frame, "done": self.done, "total": self.total, "ms": milliseconds, "files": files })
            ),
            ProgressMode::OpenJd => writeln!(err, "openjd_status: {what} ({}/{})", self.done, self.total),
            ProgressMode::Auto | ProgressMode::None => Ok(()),
        };
    }

    /// Reports a finished picture by its name, like [`Progress::frame`].
    pub fn named(&mut self, name: &str, milliseconds: f64, files: &[String]) {
        self.step(name, json!(name), milliseconds, files);
    }

    /// Ends the bar.
    pub fn finish(self) {
        if let Some(bar) = self.bar {
            bar.finish_and_clear();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_left_is_told_roughly() {
        assert_eq!((span(59.0).as_str(), span(720.0).as_str(), span(72_000.0).as_str()), ("59 s", "12 min", "20 h"));
    }

    #[test]
    fn what_is_asked_for_is_kept_but_for_bars_in_files() {
        for mode in [ProgressMode::Json, ProgressMode::None, ProgressMode::Plain] {
            assert_eq!(mode.here(true, true), mode);
        }
        assert_eq!(ProgressMode::Auto.here(true, false), ProgressMode::None);
    }
}

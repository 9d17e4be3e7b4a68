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
    /// One line a frame.
    Plain,
    /// One JSON object a line.
    Json,
    None,
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
        let terminal = std::io::stderr().is_terminal();
        let mode = match mode {
            ProgressMode::Auto if quiet => ProgressMode::None,
            ProgressMode::Auto if terminal && total > 1 => ProgressMode::Bar,
            ProgressMode::Auto => ProgressMode::Plain,
            // A bar is made of escape codes: never into a file.
            ProgressMode::Bar if !terminal => ProgressMode::Plain,
            mode => mode,
        };
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

    /// One more frame is done: its number, the milliseconds it took, and what was written.
    pub fn frame(&mut self, frame: u32, milliseconds: f64, files: &[String]) {
        self.step(&format!("frame {frame}"), json!(frame), milliseconds, files);
    }

    fn step(&mut self, what: &str, frame: serde_json::Value, milliseconds: f64, files: &[String]) {
        self.done += 1;
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
            ProgressMode::Auto | ProgressMode::None => Ok(()),
        };
    }

    /// One more picture is done, as [`Progress::frame`].
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

//! What the engine logs, on the console.

use std::sync::OnceLock;

use crate::console::Console;

/// Warnings of the engine; what the libraries below it log is for their makers.
#[derive(Debug)]
struct Notes(Console);

impl log::Log for Notes {
    fn enabled(&self, about: &log::Metadata<'_>) -> bool {
        about.level() <= log::Level::Warn && about.target().starts_with("lucerna")
    }

    fn log(&self, record: &log::Record<'_>) {
        if self.enabled(record.metadata()) {
            self.0.warning(&record.args().to_string());
        }
    }

    fn flush(&self) {}
}

/// From now on `console` shows what the engine logs. The first call in a process counts.
pub fn show(console: Console) {
    static NOTES: OnceLock<Notes> = OnceLock::new();
    if log::set_logger(NOTES.get_or_init(|| Notes(console))).is_ok() {
        log::set_max_level(log::LevelFilter::Warn);
    }
}

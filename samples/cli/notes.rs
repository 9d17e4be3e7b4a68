//! Prints the engine's log messages on the console.

use std::sync::OnceLock;

use crate::console::Console;

/// A logger for the engine's warnings. Messages of other libraries are not shown, because users cannot act on them.
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

/// Shows the engine's log messages on `console`. Only the first call in a process has an effect.
pub fn show(console: Console) {
    static NOTES: OnceLock<Notes> = OnceLock::new();
    if log::set_logger(NOTES.get_or_init(|| Notes(console))).is_ok() {
        log::set_max_level(log::LevelFilter::Warn);
    }
}

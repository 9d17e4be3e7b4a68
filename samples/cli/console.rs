//! Messages and progress on stderr, and the only functions that write to stdout.

use std::{
    borrow::Cow,
    io::{IsTerminal, Write},
    sync::{Mutex, PoisonError},
};

use lucerna::{Error, ErrorKind, Result};

/// Prints messages by their importance. Errors are always printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Console {
    /// −1 with `-q`, one more for each `-v`.
    level: i8,
    color: bool,
}

impl Console {
    /// Colours only on a terminal, and not when `NO_COLOR` is set to anything.
    pub fn new(quiet: bool, verbose: u8) -> Self {
        let color = std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|v| v.is_empty());
        let level = if quiet { -1 } else { verbose.min(3) as i8 };
        Self { level, color }
    }

    /// One line for the error that ends the program.
    pub fn error(&self, error: &Error) {
        self.line("error", "31", &error.to_string());
    }

    /// A warning; the work continues. `-q` does not silence it.
    pub fn warning(&self, text: &str) {
        self.line("warning", "33", text);
    }

    /// Information about the work; `-q` silences it.
    pub fn info(&self, text: &str) {
        if self.level >= 0 {
            self.plain(text);
        }
    }

    /// Details; printed with `-v`.
    pub fn detail(&self, text: &str) {
        if self.level >= 1 {
            self.plain(text);
        }
    }

    /// True with `-q`.
    pub fn is_quiet(&self) -> bool {
        self.level < 0
    }

    fn line(&self, label: &str, color: &str, text: &str) {
        let text = legible(text.trim_end()).replace('\n', " | ");
        if self.color {
            self.raw(&format!("\x1b[1;{color}m{label}\x1b[0m: {text}"));
        } else {
            self.raw(&format!("{label}: {text}"));
        }
    }

    fn plain(&self, text: &str) {
        self.raw(&legible(text));
    }

    fn raw(&self, text: &str) {
        stderr_line(text);
    }
}

/// A bar of progress stands on the last line of the terminal.
static BAR: Mutex<bool> = Mutex::new(false);

/// Begins the last line of a terminal again.
const AGAIN: &str = "\r\x1b[K";

/// Writes a line to stderr, in the place of a bar. Ignores errors: the work continues even if stderr is closed.
pub fn stderr_line(text: &str) {
    let mut bar = BAR.lock().unwrap_or_else(PoisonError::into_inner);
    let again = if std::mem::take(&mut *bar) { AGAIN } else { "" };
    let _ = writeln!(std::io::stderr().lock(), "{again}{text}");
}

/// Draws a bar on the last line of the terminal, over the bar before. `last`: the line stays.
pub fn stderr_bar(text: &str, last: bool) {
    let mut bar = BAR.lock().unwrap_or_else(PoisonError::into_inner);
    *bar = !last;
    let mut err = std::io::stderr().lock();
    let _ = write!(err, "{AGAIN}{text}{}", if last { "\n" } else { "" }).and_then(|()| err.flush());
}

/// Leaves the bar, if there is one, where it is: the next text stands below it.
pub fn end_bar() {
    let mut bar = BAR.lock().unwrap_or_else(PoisonError::into_inner);
    if std::mem::take(&mut *bar) {
        let _ = writeln!(std::io::stderr().lock());
    }
}

/// Makes a text from an untrusted file safe for terminals: escape sequences are printed as text and not obeyed.
pub fn legible(text: &str) -> Cow<'_, str> {
    let obeyed = |c: char| c.is_control() && !matches!(c, '\n' | '\t');
    if !text.contains(obeyed) {
        return text.into();
    }
    let mut out = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if obeyed(c) { out.extend(c.escape_default()) } else { out.push(c) }
    }
    out.into()
}

/// Writes `text` and a line end to stdout. A closed pipe (`| head`) is not an error.
pub fn print(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(legible(text).as_bytes()).and_then(|()| out.write_all(b"\n")).and_then(|()| out.flush()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Error::new(ErrorKind::Output, "could not write to standard output").caused_by(error))
        }
        _ => Ok(()),
    }
}

/// A value as JSON.
pub fn to_json(value: &impl serde::Serialize) -> Result<serde_json::Value> {
    serde_json::to_value(value).map_err(|error| Error::new(ErrorKind::Runtime, "cannot be JSON").caused_by(error))
}

/// Writes one JSON document to stdout.
pub fn print_json(value: &serde_json::Value) -> Result<()> {
    print(&format!("{value:#}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_obeys_is_written_out() {
        assert_eq!(legible("a\tb\nZürich →"), "a\tb\nZürich →");
        assert_eq!(legible("x\u{1b}[2J\u{9b}1m\r\u{7}"), "x\\u{1b}[2J\\u{9b}1m\\r\\u{7}");
    }
}

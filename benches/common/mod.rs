//! What benchmarks share: words of the command line, how they end, and medians.
#![allow(dead_code)]

use std::{fmt::Display, ops::RangeInclusive, process::ExitCode};

use lucerna::{Error, Result};

/// Says what went wrong, if something did.
pub fn end(done: Result<()>) -> ExitCode {
    verdict(done.map(|()| true))
}

/// As [`end`]; with `false` it fails, too.
pub fn verdict(done: Result<bool>) -> ExitCode {
    match done {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

/// The words of the command line, without the one that cargo adds.
pub fn words() -> impl Iterator<Item = String> {
    std::env::args().skip(1).filter(|word| word != "--bench")
}

/// # Errors
/// `Usage`, naming what was to be given, what was, and what is allowed.
pub fn wrong<T>(name: &str, found: &str, allowed: impl Display) -> Result<T> {
    Err(Error::usage(format!("{name} {found:?}; allowed: {allowed}")))
}

/// # Errors
/// `Usage`, as [`wrong`].
pub fn number(name: &str, text: &str, allowed: RangeInclusive<u32>) -> Result<u32> {
    match text.parse() {
        Ok(number) if allowed.contains(&number) => Ok(number),
        _ => wrong(name, text, format_args!("{} to {}", allowed.start(), allowed.end())),
    }
}

/// Width and height.
///
/// # Errors
/// `Usage`, as [`wrong`].
pub fn size(name: &str, text: &str, allowed: RangeInclusive<u32>) -> Result<[u32; 2]> {
    let good = |text: &str| text.parse().ok().filter(|number| allowed.contains(number));
    match text.split_once('x').map(|(width, height)| (good(width), good(height))) {
        Some((Some(width), Some(height))) => Ok([width, height]),
        _ => wrong(name, text, format_args!("WIDTHxHEIGHT, {} to {} each", allowed.start(), allowed.end())),
    }
}

/// Rounds that are measured at most.
pub const ROUNDS: RangeInclusive<u32> = 1..=10_000;
/// Edges of pictures, pixels.
pub const EDGES: RangeInclusive<u32> = 8..=8192;

/// Words that have their place.
pub struct Places {
    left: std::vec::IntoIter<String>,
    /// All that can be given.
    form: &'static str,
}

impl Places {
    /// Of the command line.
    pub fn new(form: &'static str) -> Self {
        Self { left: words().collect::<Vec<_>>().into_iter(), form }
    }

    /// # Errors
    /// `Usage`.
    pub fn size(&mut self, default: [u32; 2]) -> Result<[u32; 2]> {
        self.left.next().map_or(Ok(default), |text| size("size", &text, EDGES))
    }

    /// # Errors
    /// `Usage`.
    pub fn number(&mut self, name: &str, allowed: RangeInclusive<u32>, default: u32) -> Result<u32> {
        self.left.next().map_or(Ok(default), |text| number(name, &text, allowed))
    }

    /// The last word: one of these, or all of them; nothing may follow.
    ///
    /// # Errors
    /// `Usage`.
    pub fn tables(mut self, all: &'static [&'static str]) -> Result<Vec<&'static str>> {
        let tables = match self.left.next() {
            None => all.to_vec(),
            Some(text) => match all.iter().find(|name| **name == text) {
                Some(name) => vec![*name],
                None => return wrong("TABLE", &text, all.join(", ")),
            },
        };
        self.end()?;
        Ok(tables)
    }

    /// # Errors
    /// `Usage` if something is left.
    pub fn end(mut self) -> Result<()> {
        let form = self.form;
        self.left.next().map_or(Ok(()), |more| wrong("one word too many,", &more, form))
    }
}

/// Of an odd number of values the one in the middle, of an even one the upper of both.
///
/// # Panics
/// Without values.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

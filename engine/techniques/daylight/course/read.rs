//! Files with a path of the sun: `.csv` and `.toml`.

use std::path::Path;

use serde::Deserialize;
use toml::Spanned;

use super::{Stop, SunPath, Towards};
use crate::{
    Error, Result, image,
    techniques::daylight::{civil::civil_time, day::time_error},
};

/// Largest file that is read, bytes.
const MOST_BYTES: u64 = 16 << 20;
/// Times of a path at most.
const MOST_STOPS: usize = 100_000;
/// The columns of a `.csv` file, for messages.
const COLUMNS: &str =
    "`time`, then `azimuth,elevation` or `x,y,z`, then `red,green,blue` if the sun has an irradiance of its own";

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    #[serde(default)]
    sun: Vec<Spanned<Entry>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    time: String,
    azimuth: Option<f64>,
    elevation: Option<f64>,
    direction: Option<[f64; 3]>,
    irradiance: Option<[f32; 3]>,
}

impl SunPath {
    /// Reads a `.csv` or `.toml` file.
    ///
    /// # Errors
    /// `Usage` for another kind of file; `Input`, naming the file and the line.
    pub fn read(file: &Path) -> Result<Self> {
        let ending = file.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
        let parse = match ending.as_str() {
            "csv" => Self::from_csv,
            "toml" => Self::from_toml,
            _ => {
                let what = format!("{}: a path of the sun is a .csv or .toml file", file.display());
                return Err(Error::usage(what));
            }
        };
        let bytes = image::read_file_checked(file, MOST_BYTES)?;
        let text = String::from_utf8(bytes).map_err(|error| {
            let at = error.utf8_error().valid_up_to();
            let line = 1 + error.as_bytes()[..at].iter().filter(|byte| **byte == b'\n').count();
            Error::input("is not text in UTF-8").at(format!("line {line}")).in_file(file)
        })?;
        parse(&text).map_err(|error| error.in_file(file))
    }

    /// Reads lines of comma-separated values under a line with the names of the columns. Empty lines and lines that begin with `#` do not count.
    ///
    /// # Errors
    /// `Input`, naming the line.
    pub fn from_csv(text: &str) -> Result<Self> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let lines = text.lines().enumerate().map(|(number, line)| (number + 1, line.trim()));
        let mut lines = lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
        let (number, head) =
            lines.next().ok_or_else(|| Error::input(format!("is empty; its columns are {COLUMNS}")))?;
        let names: Vec<String> = head.split(',').map(|name| name.trim().to_lowercase()).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let (angles, coloured) = match names[..] {
            ["time", "azimuth", "elevation"] => (true, false),
            ["time", "azimuth", "elevation", "red", "green", "blue"] => (true, true),
            ["time", "x", "y", "z"] => (false, false),
            ["time", "x", "y", "z", "red", "green", "blue"] => (false, true),
            _ => {
                let what = format!("the columns are `{head}`, {COLUMNS} are allowed");
                return Err(Error::input(what).at(format!("line {number}")));
            }
        };
        let mut path = Self { stops: Vec::new() };
        for (number, line) in lines {
            let stop = || {
                let cells: Vec<&str> = line.split(',').map(str::trim).collect();
                if cells.len() != names.len() {
                    return Err(format!("has {} values, the first line names {} columns", cells.len(), names.len()));
                }
                let value = |at: usize| {
                    let found: Option<f64> = cells[at].parse().ok();
                    found.ok_or_else(|| format!("`{}` is `{}`, a number is needed", names[at], cells[at]))
                };
                let sun = match angles {
                    true => Towards::Angles([value(1)?, value(2)?]),
                    false => Towards::Direction([value(1)?, value(2)?, value(3)?]),
                };
                let first = names.len() - 3;
                let irradiance = match coloured {
                    true => Some([value(first)? as f32, value(first + 1)? as f32, value(first + 2)? as f32]),
                    false => None,
                };
                Ok(Stop { seconds: seconds(cells[0])?, sun, irradiance })
            };
            path.push(stop()).map_err(|what| Error::input(what).at(format!("line {number}")))?;
        }
        path.whole()
    }

    /// Reads tables `[[sun]]` with `time`, `azimuth` and `elevation` or `direction`, and perhaps `irradiance`.
    ///
    /// # Errors
    /// `Input`, naming the line.
    pub fn from_toml(text: &str) -> Result<Self> {
        let line = |offset: usize| {
            let before = text.as_bytes().iter().take(offset);
            format!("line {}", 1 + before.filter(|byte| **byte == b'\n').count())
        };
        let document: Document = toml::from_str(text).map_err(|error| {
            let what = error.message().lines().next().unwrap_or_default().to_owned();
            Error::input(what).at(line(error.span().unwrap_or(0..0).start))
        })?;
        let mut path = Self { stops: Vec::new() };
        for entry in document.sun {
            let place = line(entry.span().start);
            let Entry { time, azimuth, elevation, direction, irradiance } = entry.into_inner();
            let stop = || {
                let sun = match (azimuth, elevation, direction) {
                    (Some(azimuth), Some(elevation), None) => Towards::Angles([azimuth, elevation]),
                    (None, None, Some(direction)) => Towards::Direction(direction),
                    _ => return Err("needs either `azimuth` and `elevation`, or `direction`".into()),
                };
                Ok(Stop { seconds: seconds(&time)?, sun, irradiance })
            };
            path.push(stop()).map_err(|what| Error::input(what).at(place))?;
        }
        path.whole()
    }

    /// Adds a time that must be later than those before.
    fn push(&mut self, stop: Result<Stop, String>) -> Result<(), String> {
        let stop = stop?;
        stop.validate()?;
        if let Some(last) = self.stops.last() {
            if last.seconds >= stop.seconds {
                return Err("the time is not later than the one before it; times must be in order".into());
            }
            if last.irradiance.is_some() != stop.irradiance.is_some() {
                return Err("either all times have an irradiance, or none has one".into());
            }
        }
        if self.stops.len() == MOST_STOPS {
            return Err(format!("more than {MOST_STOPS} times"));
        }
        self.stops.push(stop);
        Ok(())
    }

    fn whole(self) -> Result<Self> {
        match self.stops.len() {
            0 | 1 => {
                let what = format!("has {} times, a path needs at least 2", self.stops.len());
                Err(Error::input(what).help("Before the first and after the last time it is night"))
            }
            _ => Ok(self),
        }
    }

    /// Whether any stop is given by angles, which the north turns.
    pub fn has_angles(&self) -> bool {
        self.stops.iter().any(|stop| matches!(stop.sun, Towards::Angles(_)))
    }
}

/// Seconds after midnight.
fn seconds(text: &str) -> Result<f64, String> {
    let time = civil_time(text).ok_or_else(|| time_error(text))?;
    Ok(f64::from(time.hour()) * 3600.0 + f64::from(time.minute()) * 60.0 + f64::from(time.second()))
}

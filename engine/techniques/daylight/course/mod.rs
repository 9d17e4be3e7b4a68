//! The course of the sun through a day: that of a date and a place, or a path from a file.

use serde::{Deserialize, Serialize};

use super::{
    Calendar, Day,
    beam::SUN_ANGULAR_RADIUS,
    civil::civil_time,
    day::{self, Sun},
};

mod read;

/// Seconds of a day whose sun follows a path from a file.
const DAY: f64 = 86_400.0;

/// The sun at a moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shine {
    /// Unit vector towards the sun.
    pub direction: [f32; 3],
    /// Irradiance at normal incidence under a clear sky, W/m²; `None`: that of the elevation and the air.
    pub irradiance: Option<[f32; 3]>,
}

impl Shine {
    /// Whether the sun gives any light: a part of its disc is above the horizon, or the path gives it an irradiance.
    pub fn is_lit(&self) -> bool {
        match self.irradiance {
            Some(irradiance) => irradiance.iter().any(|channel| *channel > 0.0),
            None => f64::from(self.direction[1]) > -SUN_ANGULAR_RADIUS.sin(),
        }
    }
}

/// One time of a path of the sun.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stop {
    /// Seconds after midnight.
    pub seconds: f64,
    pub sun: Towards,
    /// Irradiance at normal incidence under a clear sky, W/m².
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub irradiance: Option<[f32; 3]>,
}

/// Where the sun stands.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Towards {
    /// Azimuth, clockwise from the north as seen from above, and elevation, degrees.
    Angles([f64; 2]),
    /// Vector towards the sun in the axes of the scene, of any length above 0.
    Direction([f64; 3]),
}

impl Towards {
    /// Unit vector towards the sun; `north`: turn of the north from -Z, degrees.
    fn unit(self, north: f32) -> [f64; 3] {
        match self {
            Self::Angles([azimuth, elevation]) => Sun { elevation, azimuth }.direction(north).map(f64::from),
            Self::Direction(direction) => {
                // The largest part is divided out first, so that nothing overflows.
                let largest = direction.iter().fold(0.0f64, |most, part| most.max(part.abs()));
                let parts = direction.map(|part| part / largest);
                let length = parts.iter().map(|part| part * part).sum::<f64>().sqrt();
                parts.map(|part| part / length)
            }
        }
    }
}

/// A path of the sun from a file. Between two times the sun moves on the great circle, and its irradiance on the line. Before the first and
/// after the last time it is night. The day has 24 hours.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SunPath {
    /// In order of time.
    pub stops: Vec<Stop>,
}

impl SunPath {
    /// Checks the numbers.
    ///
    /// # Errors
    /// A sentence that says which number is impossible.
    pub fn validate(&self) -> Result<(), String> {
        if self.stops.is_empty() {
            return Err("the path of the sun has no times".into());
        }
        self.stops.iter().try_for_each(Stop::validate)?;
        if self.stops.windows(2).any(|pair| pair[0].seconds >= pair[1].seconds) {
            return Err("the times of the sun's path are not in order".into());
        }
        if self.stops.iter().any(|stop| stop.irradiance.is_some() != self.stops[0].irradiance.is_some()) {
            return Err("some times of the sun's path have an irradiance, and some have none".into());
        }
        Ok(())
    }

    fn at(&self, seconds: f64, north: f32) -> Shine {
        let night = Shine {
            direction: [0.0, -1.0, 0.0],
            irradiance: self.stops.first().and_then(|stop| stop.irradiance).map(|_| [0.0; 3]),
        };
        let next = self.stops.partition_point(|stop| stop.seconds <= seconds);
        let Some(before) = next.checked_sub(1).map(|before| &self.stops[before]) else { return night };
        let from = before.sun.unit(north);
        let Some(after) = self.stops.get(next) else {
            return match before.seconds == seconds {
                true => Shine { direction: from.map(|part| part as f32), irradiance: before.irradiance },
                false => night,
            };
        };
        let along = (seconds - before.seconds) / (after.seconds - before.seconds);
        let irradiance = before.irradiance.zip(after.irradiance).map(|(from, to)| {
            std::array::from_fn(|channel| from[channel] + along as f32 * (to[channel] - from[channel]))
        });
        Shine { direction: between(from, after.sun.unit(north), along).map(|part| part as f32), irradiance }
    }
}

impl Stop {
    /// # Errors
    /// A sentence that says which number is impossible, and what is allowed.
    fn validate(&self) -> Result<(), String> {
        if !(0.0..DAY).contains(&self.seconds) {
            return Err(format!("the time is {} seconds after midnight, 0 to 86399 are allowed", self.seconds));
        }
        match self.sun {
            Towards::Angles([azimuth, elevation]) => {
                if !(-360.0..=360.0).contains(&azimuth) {
                    return Err(format!("the azimuth is {azimuth}, -360 to 360 degrees are allowed"));
                }
                if !(-90.0..=90.0).contains(&elevation) {
                    return Err(format!("the elevation is {elevation}, -90 to 90 degrees are allowed"));
                }
            }
            Towards::Direction(direction) => {
                let largest = direction.iter().fold(0.0f64, |most, part| most.max(part.abs()));
                if !(direction.iter().all(|part| part.is_finite()) && largest > 1e-30) {
                    let [x, y, z] = direction;
                    return Err(format!("the direction is [{x}, {y}, {z}], it must be finite and longer than 0"));
                }
            }
        }
        let fits = |channel: &f32| (0.0..=1e9).contains(channel);
        match self.irradiance {
            Some([r, g, b]) if ![r, g, b].iter().all(fits) => {
                Err(format!("the irradiance is [{r}, {g}, {b}], 0 to 1000000000 W/m² are allowed"))
            }
            _ => Ok(()),
        }
    }
}

/// A unit vector on the great circle from `from` to `to`; on the way over the zenith if they are opposite.
fn between(from: [f64; 3], to: [f64; 3], along: f64) -> [f64; 3] {
    let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let scaled = |a: [f64; 3], by: f64| a.map(|part| part * by);
    let unit = |a: [f64; 3]| scaled(a, 1.0 / dot(a, a).sqrt());
    let cosine = dot(from, to).clamp(-1.0, 1.0);
    let mut side: [f64; 3] = std::array::from_fn(|i| to[i] - cosine * from[i]);
    if dot(side, side) < 1e-18 {
        if cosine > 0.0 {
            return from;
        }
        let up = if from[1].abs() < 0.9 { [0.0, 1.0, 0.0] } else { [1.0, 0.0, 0.0] };
        let height = dot(up, from);
        side = std::array::from_fn(|i| up[i] - height * from[i]);
    }
    let side = unit(side);
    let (sine, cosine) = (along * cosine.acos()).sin_cos();
    unit(std::array::from_fn(|i| cosine * from[i] + sine * side[i]))
}

fn finite(north: f32) -> Result<f32, String> {
    match north.is_finite() {
        true => Ok(north),
        false => Err(format!("the north is turned by {north} degrees, a finite number is allowed")),
    }
}

/// The course of the sun through a day of a bake.
#[derive(Clone, Debug)]
pub enum Course {
    /// That of a date and a place.
    Almanac { day: Box<Day>, north: f32 },
    /// A path from a file.
    Path { path: SunPath, north: f32 },
}

impl Course {
    /// A path from a file; `north`: turn of the north from -Z, degrees.
    ///
    /// # Errors
    /// A sentence that says what is impossible.
    pub(super) fn path(path: &SunPath, north: f32) -> Result<Self, String> {
        path.validate()?;
        Ok(Self::Path { path: path.clone(), north: finite(north)? })
    }

    /// A date at the place of a calendar.
    ///
    /// # Errors
    /// A sentence that says what is impossible.
    pub(super) fn almanac(date: &str, calendar: &Calendar) -> Result<Self, String> {
        let day = Day::new(date, &calendar.zone, calendar.latitude, calendar.longitude)?;
        Ok(Self::Almanac { day: Box::new(day), north: finite(calendar.north)? })
    }

    /// Seconds of the day.
    pub fn length(&self) -> f64 {
        match self {
            Self::Almanac { day, .. } => day.length(),
            Self::Path { .. } => DAY,
        }
    }

    /// The sun at `seconds` after the begin of the day.
    pub fn sun(&self, seconds: f64) -> Shine {
        match self {
            Self::Almanac { day, north } => Shine { direction: day.sun(seconds).direction(*north), irradiance: None },
            Self::Path { path, north } => path.at(seconds, *north),
        }
    }

    /// As [`Day::steps`].
    ///
    /// # Errors
    /// A value outside its range is an error.
    pub fn steps(&self, interval_minutes: f64, offset_minutes: f64) -> Result<Vec<f64>, String> {
        day::steps(self.length(), interval_minutes, offset_minutes)
    }

    /// As [`Day::parse_time`].
    ///
    /// # Errors
    /// A text that isn't a time and a time that doesn't exist on this day are errors.
    pub fn parse_time(&self, text: &str) -> Result<f64, String> {
        match self {
            Self::Almanac { day, .. } => day.parse_time(text),
            Self::Path { .. } => {
                let time = civil_time(text).ok_or_else(|| day::time_error(text))?;
                Ok(f64::from(time.hour()) * 3600.0 + f64::from(time.minute()) * 60.0 + f64::from(time.second()))
            }
        }
    }

    /// As [`Day::label`].
    pub fn label(&self, seconds: f64) -> String {
        match self {
            Self::Almanac { day, .. } => day.label(seconds),
            Self::Path { .. } => {
                let whole = seconds.round().clamp(0.0, DAY) as u32;
                format!("{:02}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60)
            }
        }
    }
}

#[cfg(test)]
mod tests;

//! A civil day at a place on the Earth, and the position of the sun during that day.
//!
//! A day is keyed by the seconds that elapsed since its first instant, which is local midnight. Elapsed seconds are
//! the difference of two UTC instants, so they run evenly through a change of the clock. A day with such a change has
//! 23 or 25 hours in most zones.
//!
//! The sun position comes from the Solar Position Algorithm (I. Reda, A. Andreas, "Solar position algorithm for solar
//! radiation applications", Solar Energy 76(5), 2003) as implemented by the crate `solar-positioning`. The observer
//! stands at sea level. UTC is taken as UT1; the difference is below 0.9 s, which moves the sun by less than 0.004°.

use super::civil::{civil_time, first_instant, parse_zone};
use jiff::Timestamp;
use jiff::civil::Date;
use jiff::tz::{AmbiguousOffset, TimeZone};
use solar_positioning::time::JulianDate;
use solar_positioning::{Location, SolarPositions, delta_t};

/// The air pressure at sea level that the refraction uses, in hPa.
pub const STANDARD_PRESSURE: f64 = 1013.25;

/// The air temperature at sea level that the refraction uses, in degrees Celsius.
pub const STANDARD_TEMPERATURE: f64 = 15.0;

/// The geometric elevation, in degrees, below which the refraction formula gives way to its continuation.
const REFRACTION_LIMIT: f64 = -0.83337;

/// A place on the Earth at sea level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    latitude: f64,
    longitude: f64,
}

impl Place {
    /// Makes a place from a latitude (positive north, -90 to 90) and a longitude (positive east, -180 to 180), both in
    /// degrees.
    ///
    /// # Errors
    /// A value outside its range is an error.
    pub fn new(latitude: f64, longitude: f64) -> Result<Place, String> {
        if !(-90.0..=90.0).contains(&latitude) {
            return Err(format!(
                "The latitude is {latitude}, but it must be from -90 to 90 degrees. Give degrees north of the equator; \
                 use a negative value for the south."
            ));
        }
        if !(-180.0..=180.0).contains(&longitude) {
            return Err(format!(
                "The longitude is {longitude}, but it must be from -180 to 180 degrees. Give degrees east of \
                 Greenwich; use a negative value for the west."
            ));
        }
        Ok(Place { latitude, longitude })
    }

    /// The latitude in degrees, positive north.
    pub fn latitude(&self) -> f64 {
        self.latitude
    }

    /// The longitude in degrees, positive east.
    pub fn longitude(&self) -> f64 {
        self.longitude
    }
}

/// A civil day in a time zone at a place.
#[derive(Clone, Debug)]
pub struct Day {
    date: Date,
    zone: TimeZone,
    place: Place,
    start: i64,
    end: i64,
    delta_t: f64,
}

impl Day {
    /// Makes a day from a date ("2026-06-21", years 0001 to 2999), a time zone, a latitude and a longitude in degrees.
    ///
    /// The zone is an IANA name ("Europe/Copenhagen"), "UTC" or a fixed offset ("+02:00", from -14:00 to +14:00). The
    /// time zone database is part of the program, so the result doesn't depend on the machine.
    ///
    /// # Errors
    /// A value that can't be read or is outside its range is an error. A date that the zone skipped is an error too.
    pub fn new(date: &str, zone: &str, latitude: f64, longitude: f64) -> Result<Day, String> {
        let place = Place::new(latitude, longitude)?;
        let date_error = || {
            format!(
                "The date is \"{date}\", but it must be a date from 0001-01-01 to 2999-12-31. Write it as year, month \
                 and day, for example \"2026-06-21\"."
            )
        };
        // The parser of jiff also accepts a time after the date, which would be lost.
        if date.len() != 10 {
            return Err(date_error());
        }
        let civil: Date = date.parse().map_err(|_| date_error())?;
        if !(1..=2999).contains(&civil.year()) {
            return Err(date_error());
        }
        let time_zone = parse_zone(zone)?;
        let next = civil.tomorrow().map_err(|error| format!("The day after {civil} isn't available: {error}."))?;
        let start = first_instant(civil, &time_zone)?;
        let end = first_instant(next, &time_zone)?;
        if end <= start {
            return Err(format!(
                "The date {civil} doesn't exist in the time zone \"{zone}\", because the zone skipped that day. Choose \
                 another date or another zone."
            ));
        }
        let delta_t = delta_t::estimate_from_date(i32::from(civil.year()), u32::from(civil.month().unsigned_abs()))
            .map_err(|error| format!("The date {civil} has no estimate of Earth's rotation: {error}."))?;
        Ok(Day { date: civil, zone: time_zone, place, start, end, delta_t })
    }

    /// The civil date.
    pub fn date(&self) -> Date {
        self.date
    }

    /// The time zone.
    pub fn zone(&self) -> &TimeZone {
        &self.zone
    }

    /// The place.
    pub fn place(&self) -> Place {
        self.place
    }

    /// The first instant of the day (local midnight), in UTC seconds since 1970-01-01T00:00:00Z.
    pub fn start(&self) -> i64 {
        self.start
    }

    /// The first instant of the next day, in UTC seconds since 1970-01-01T00:00:00Z.
    pub fn end(&self) -> i64 {
        self.end
    }

    /// The length of the day in seconds: 86400 unless the clock changes.
    pub fn length(&self) -> f64 {
        (self.end - self.start) as f64
    }

    /// The times `offset + i * interval` for i = 0, 1, 2, ... inside the day, in seconds since the start of the day.
    ///
    /// The interval and the offset are in minutes. The interval is at least one second (1/60), and the offset is at
    /// least 0 and less than the interval.
    ///
    /// # Errors
    /// A value outside its range is an error.
    pub fn steps(&self, interval_minutes: f64, offset_minutes: f64) -> Result<Vec<f64>, String> {
        steps(self.length(), interval_minutes, offset_minutes)
    }

    /// Reads a local civil time ("07:40" or "07:40:30") and returns the seconds since the start of the day.
    ///
    /// A time that occurs twice on this day, because the clock goes back, means its first occurrence.
    ///
    /// # Errors
    /// A text that isn't a time and a time that doesn't exist on this day are errors.
    pub fn parse_time(&self, text: &str) -> Result<f64, String> {
        let time = civil_time(text).ok_or_else(|| time_error(text))?;
        let ambiguous = self.zone.to_ambiguous_timestamp(self.date.to_datetime(time));
        if let AmbiguousOffset::Gap { .. } = ambiguous.offset() {
            return Err(format!(
                "The time \"{text}\" doesn't exist on {}, because the clock goes forward over it. Choose a time before \
                 or after the change of the clock.",
                self.date
            ));
        }
        let instant = ambiguous.earlier().map_err(|error| format!("The time \"{text}\" isn't available: {error}."))?;
        Ok((instant.as_second() - self.start) as f64)
    }

    /// The local civil time at `seconds` since the start of the day, rounded to a second, for example "07:40:00".
    ///
    /// The label is "--:--:--" when `seconds` isn't finite or is outside the calendar.
    pub fn label(&self, seconds: f64) -> String {
        let rounded = seconds.round();
        if !rounded.is_finite() || rounded.abs() > 1e12 {
            return "--:--:--".to_string();
        }
        match Timestamp::from_second(self.start + rounded as i64) {
            Ok(instant) => {
                let local = self.zone.to_datetime(instant);
                format!("{:02}:{:02}:{:02}", local.hour(), local.minute(), local.second())
            }
            Err(_) => "--:--:--".to_string(),
        }
    }

    /// The position of the sun's centre at `seconds` since the start of the day.
    ///
    /// The elevation contains the refraction of a standard atmosphere at sea level ([`STANDARD_PRESSURE`],
    /// [`STANDARD_TEMPERATURE`]); see [`refraction`].
    ///
    /// # Panics
    /// Panics if `seconds` isn't finite.
    pub fn sun(&self, seconds: f64) -> Sun {
        // The Julian date of 1970-01-01T00:00:00Z is 2440587.5.
        let julian = (self.start as f64 + seconds) / 86_400.0 + 2_440_587.5;
        let time = JulianDate::new(julian, self.delta_t).expect("The seconds since the start of the day are finite.");
        let (elevation, azimuth) = geometric_position(time, self.place, 0.0);
        Sun { elevation: elevation + refraction(elevation, STANDARD_PRESSURE, STANDARD_TEMPERATURE), azimuth }
    }
}

/// [`Day::steps`] of a day of `length` seconds.
pub(super) fn steps(length: f64, interval_minutes: f64, offset_minutes: f64) -> Result<Vec<f64>, String> {
    // The small tolerance accepts 1/60 in any rounding.
    if !(interval_minutes.is_finite() && interval_minutes >= 0.999 / 60.0) {
        return Err(format!(
            "The interval is {interval_minutes} minutes, but it must be at least one second (1/60 of a minute). \
             Choose a longer interval, for example 15."
        ));
    }
    if !(offset_minutes >= 0.0 && offset_minutes < interval_minutes) {
        return Err(format!(
            "The offset is {offset_minutes} minutes, but it must be at least 0 and less than the interval of \
             {interval_minutes} minutes. Subtract or add whole intervals until it fits."
        ));
    }
    let (interval, offset) = (interval_minutes * 60.0, offset_minutes * 60.0);
    Ok((0_u32..).map(|i| offset + f64::from(i) * interval).take_while(|&x| x < length).collect())
}

/// Says that a text is no time of a day.
pub(super) fn time_error(text: &str) -> String {
    format!(
        "The time is \"{text}\", but it must be from 00:00 to 23:59:59. Write two digits each for the hour, the minute \
         and, if needed, the second, for example \"07:40\" or \"07:40:30\"."
    )
}

/// The apparent position of the sun's centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// The elevation above the horizon in degrees, with refraction.
    pub elevation: f64,
    /// The azimuth in degrees, clockwise from north, from 0 to 360.
    pub azimuth: f64,
}

impl Sun {
    /// The unit vector towards the sun in a right-handed frame with +Y up.
    ///
    /// North is -Z and east is +X when `north_degrees` is 0. A positive `north_degrees` turns the north, and with it
    /// the sun, clockwise as seen from above: north is +X at 90 and +Z at 180.
    pub fn direction(&self, north_degrees: f32) -> [f32; 3] {
        let (sin_e, cos_e) = self.elevation.to_radians().sin_cos();
        let (sin_a, cos_a) = (self.azimuth + f64::from(north_degrees)).to_radians().sin_cos();
        [(cos_e * sin_a) as f32, sin_e as f32, (-cos_e * cos_a) as f32]
    }
}

/// The refraction of the atmosphere in degrees, for a geometric elevation in degrees, a pressure in hPa and a
/// temperature in degrees Celsius. The apparent elevation is the geometric elevation plus the refraction.
///
/// Above -0.83337° this is equation 42 in Reda and Andreas 2003. The original algorithm has no refraction below that
/// elevation, which makes the apparent elevation jump by 0.6°. This function continues with R(h) = R(h0) tan(h0) /
/// tan(h), the shape of the correction below the horizon in the solar calculator of NOAA. The apparent elevation is
/// therefore continuous and grows with the geometric elevation.
pub fn refraction(elevation: f64, pressure: f64, temperature: f64) -> f64 {
    let h = elevation.max(REFRACTION_LIMIT);
    let tangent = (h + 10.3 / (h + 5.11)).to_radians().tan();
    let value = pressure / 1010.0 * 283.0 / (273.0 + temperature) * 1.02 / (60.0 * tangent);
    if elevation >= REFRACTION_LIMIT {
        value
    } else if elevation > -90.0 {
        value * REFRACTION_LIMIT.to_radians().tan() / elevation.to_radians().tan()
    } else {
        0.0
    }
}

/// The topocentric elevation without refraction and the azimuth of the sun, in degrees, for an observer `height`
/// metres above sea level.
fn geometric_position(time: JulianDate, place: Place, height: f64) -> (f64, f64) {
    let location = Location { latitude: place.latitude, longitude: place.longitude };
    let position = SolarPositions::new()
        .at_from_julian(time, location, height, None)
        .expect("The place was checked when it was made.");
    (position.elevation_angle(), position.azimuth())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The worked example in the appendix of Reda and Andreas 2003.
    #[test]
    fn the_published_example_of_spa_is_reproduced() {
        let time = JulianDate::from_utc(2003, 10, 17, 19, 30, 30.0, 67.0).unwrap();
        let place = Place::new(39.742476, -105.1786).unwrap();
        let (elevation, azimuth) = geometric_position(time, place, 1830.14);
        let apparent = elevation + refraction(elevation, 820.0, 11.0);
        assert!((90.0 - apparent - 50.11162).abs() < 2e-5, "zenith {}", 90.0 - apparent);
        assert!((azimuth - 194.34024).abs() < 2e-5, "azimuth {azimuth}");
    }

    #[test]
    fn the_refraction_is_that_of_the_crate_above_its_limit_and_continuous_below() {
        let standard = solar_positioning::RefractionCorrection::standard();
        let day = Day::new("2026-03-20", "UTC", 0.0, 0.0).unwrap();
        for minute in 0..1440 {
            let julian = (day.start() as f64 + f64::from(minute) * 60.0) / 86_400.0 + 2_440_587.5;
            let time = JulianDate::new(julian, day.delta_t).unwrap();
            let location = Location { latitude: 0.0, longitude: 0.0 };
            let theirs = SolarPositions::new().at_from_julian(time, location, 0.0, Some(standard)).unwrap();
            let (geometric, _) = geometric_position(time, day.place(), 0.0);
            if geometric > REFRACTION_LIMIT {
                assert!((theirs.elevation_angle() - day.sun(f64::from(minute) * 60.0).elevation).abs() < 1e-9);
            }
        }
        let apparent = |h: f64| h + refraction(h, STANDARD_PRESSURE, STANDARD_TEMPERATURE);
        let mut last = apparent(-90.0);
        for i in 1..=18_000 {
            let next = apparent(-90.0 + f64::from(i) * 0.01);
            assert!(next > last && next - last < 0.03, "at {}", -90.0 + f64::from(i) * 0.01);
            last = next;
        }
    }
}

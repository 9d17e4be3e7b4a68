//! Reading of time zones and civil times, and the first instant of a date.

use jiff::SignedDuration;
use jiff::civil::{Date, Time};
use jiff::tz::{AmbiguousOffset, Offset, TimeZone};

/// Reads an IANA name, "UTC" or a fixed offset.
pub(super) fn parse_zone(text: &str) -> Result<TimeZone, String> {
    let error = || {
        format!(
            "The time zone is \"{text}\", but it must be a name in the IANA time zone database, \"UTC\" or an offset \
             from -14:00 to +14:00. Write, for example, \"Europe/Copenhagen\" or \"+02:00\"."
        )
    };
    if let Some(sign) = text.strip_prefix('+').map(|_| 1).or(text.strip_prefix('-').map(|_| -1)) {
        let seconds = offset_seconds(&text[1..]).ok_or_else(error)?;
        return Offset::from_seconds(sign * seconds).map(TimeZone::fixed).map_err(|_| error());
    }
    if text.eq_ignore_ascii_case("utc") {
        return Ok(TimeZone::UTC);
    }
    TimeZone::get(text).map_err(|_| error())
}

/// Reads "HH:MM" up to 14:00 as seconds.
fn offset_seconds(text: &str) -> Option<i32> {
    let (hours, minutes) = text.split_once(':')?;
    let seconds = two_digits(hours)? * 3600 + two_digits(minutes).filter(|&m| m < 60)? * 60;
    (seconds <= 14 * 3600).then_some(seconds)
}

/// Reads "HH:MM" or "HH:MM:SS".
pub(super) fn civil_time(text: &str) -> Option<Time> {
    let mut parts = text.split(':');
    let hour = two_digits(parts.next()?)?;
    let minute = two_digits(parts.next()?)?;
    let second = parts.next().map_or(Some(0), two_digits)?;
    if parts.next().is_some() {
        return None;
    }
    Time::new(hour as i8, minute as i8, second as i8, 0).ok()
}

/// Reads exactly two decimal digits.
fn two_digits(text: &str) -> Option<i32> {
    let bytes = text.as_bytes();
    (bytes.len() == 2 && bytes.iter().all(u8::is_ascii_digit)).then(|| text.parse().ok())?
}

/// The first instant of a date in a zone, in UTC seconds since 1970.
pub(super) fn first_instant(date: Date, zone: &TimeZone) -> Result<i64, String> {
    let message = |error: jiff::Error| format!("The date {date} isn't available in the time zone: {error}.");
    let midnight = zone.to_ambiguous_timestamp(date.to_datetime(Time::midnight()));
    let gap = matches!(midnight.offset(), AmbiguousOffset::Gap { .. });
    let instant = midnight.compatible().map_err(message)?;
    if gap {
        // The clock jumps over midnight. The date then begins at the jump itself.
        let after = instant.checked_add(SignedDuration::from_secs(1)).map_err(message)?;
        if let Some(transition) = zone.preceding(after).next() {
            return Ok(transition.timestamp().as_second());
        }
    }
    Ok(instant.as_second())
}

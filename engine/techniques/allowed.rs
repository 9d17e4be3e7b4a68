//! What settings may be.

use crate::{Error, Result};
use std::fmt::Display;

/// The error of a setting that is not allowed.
///
/// # Errors
/// Always `Usage`, naming the key, the value found and the values allowed.
pub fn wrong(key: &str, found: impl Display, allowed: &str) -> Result<()> {
    Err(Error::usage(format!("{found} is not allowed; allowed: {allowed}")).at(key))
}

/// Checks key, value, least and most of each. What is not a number is refused.
///
/// # Errors
/// [`wrong`] for the first that is outside.
pub fn within<T: Copy + PartialOrd + Display>(
    settings: impl IntoIterator<Item = (&'static str, T, T, T)>,
) -> Result<()> {
    for (key, value, least, most) in settings {
        if !(least..=most).contains(&value) {
            return wrong(key, value, &format!("{least} to {most}"));
        }
    }
    Ok(())
}

/// Checks the channels of a radiance, W/(sr·m²).
///
/// # Errors
/// [`wrong`] for the first that is below 0 or not a number, with the channel's number.
pub fn radiance(key: &str, channels: [f32; 3]) -> Result<()> {
    for (i, channel) in channels.into_iter().enumerate() {
        if !(channel.is_finite() && channel >= 0.0) {
            return wrong(&format!("{key}[{i}]"), channel, "a finite number not below 0");
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_radiance_that_is_none_names_its_channel() {
        radiance("background", [0.0, f32::MAX, 1e-30]).unwrap();
        for (wrong, text) in [
            ([0.0, f32::NAN, 0.0], "background[1]: NaN is not allowed; allowed: a finite number not below 0"),
            ([0.0, 0.0, -1.0], "background[2]: -1 is not allowed; allowed: a finite number not below 0"),
            ([f32::INFINITY, 0.0, 0.0], "background[0]: inf is not allowed; allowed: a finite number not below 0"),
        ] {
            assert_eq!(radiance("background", wrong).unwrap_err().to_string(), text);
        }
    }
}

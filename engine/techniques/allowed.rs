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

//! Settings that a file of vectors decides, and settings that vectors do not depend on.

use std::path::Path;

use lucerna::{
    Error, Result,
    techniques::fiv::{Method, Settings, Specular, Stored},
};
use serde_json::Value;

use crate::config;

/// Keys that change pictures but no vectors.
const OF_PICTURES: [&str; 10] =
    ["trilinear", "partial", "cut", "extent", "overlap", "negligible", "shared", "specular", "method", "turning"];

/// The keys in which two settings differ, with the values of both.
fn differences(a: &Settings, b: &Settings) -> Result<Vec<(String, Value, Value)>> {
    let (Value::Object(a), Value::Object(b)) = (config::to_value(a)?, config::to_value(b)?) else {
        return Ok(Vec::new());
    };
    let pair = |(key, value): (String, Value)| {
        let other = b.get(&key).cloned().unwrap_or_default();
        (value != other).then_some((key, value, other))
    };
    Ok(a.into_iter().filter_map(pair).collect())
}

/// Checks that settings agree with the settings that the file of vectors was computed with.
///
/// # Errors
/// `Usage`, naming the file, the key and both values.
pub fn decided(file: &Path, stored: &Stored, settings: &Settings) -> Result<()> {
    if settings.method != Method::Vectors {
        let error = Error::usage("--vectors is for fiv.method=vectors").at("fiv.method").in_file(file);
        return Err(error.help("Leave out --vectors or fiv.method"));
    }
    let wrong = differences(settings, &stored.plan.settings(settings))?.into_iter().next();
    wrong.map_or(Ok(()), |(key, asked, has)| {
        let error = Error::usage(format!("the settings ask for {asked}, the vectors were computed with {has}"));
        Err(error.at(format!("fiv.{key}")).in_file(file).help("Leave the key out, or compute the vectors again"))
    })
}

/// Keys that differ from their defaults and that vectors do not depend on.
///
/// # Errors
/// As [`config::to_value`].
pub(super) fn idle(settings: &Settings) -> Result<Vec<String>> {
    let set = differences(settings, &Settings::default())?.into_iter().map(|(key, ..)| key);
    Ok(set.filter(|key| OF_PICTURES.contains(&key.as_str())).map(|key| format!("fiv.{key}")).collect())
}

/// The settings from which vectors are computed. Keys that vectors do not depend on get values that are valid in every
/// combination. Values out of their range stay, so that validation reports them.
pub(super) fn of_vectors(settings: &Settings) -> Settings {
    let negligible = if (0.0..=1.0).contains(&settings.negligible) { 0.0 } else { settings.negligible };
    Settings { method: Method::Vectors, specular: Specular::Off, negligible, ..settings.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_of_pictures_are_keys() {
        let Value::Object(all) = config::to_value(&Settings::default()).unwrap() else { panic!() };
        OF_PICTURES.iter().for_each(|key| assert!(all.contains_key(*key), "{key}"));
        let settings = Settings { turning: 3.0, azimuths: 9, ..Settings::default() };
        assert_eq!(idle(&settings).unwrap(), ["fiv.turning"]);
    }
}

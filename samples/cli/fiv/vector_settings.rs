//! Settings that vectors depend on, and settings that they do not depend on.

use lucerna::{
    Result,
    settings::Described,
    techniques::fiv::{Method, Settings, Specular},
};

/// Keys that change pictures but no vectors.
const OF_PICTURES: [&str; 10] =
    ["trilinear", "partial", "cut", "extent", "overlap", "negligible", "shared", "specular", "method", "turning"];

/// Keys that differ from their defaults and that vectors do not depend on.
///
/// # Errors
/// `Runtime` if the settings cannot be written.
pub(super) fn idle(settings: &Settings) -> Result<Vec<String>> {
    let set = Settings::description().differences(settings, &Settings::default())?.into_iter().map(|set| &set.key.name);
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
        OF_PICTURES.iter().for_each(|key| assert!(Settings::description().key(key).is_some(), "{key}"));
        let settings = Settings { turning: 3.0, azimuths: 9, ..Settings::default() };
        assert_eq!(idle(&settings).unwrap(), ["fiv.turning"]);
    }
}

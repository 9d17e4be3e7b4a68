//! Settings that vectors depend on, and settings that they do not depend on.

use lucerna::{
    Result,
    settings::{Decides, Described},
    techniques::fiv::{Method, Settings, Specular},
};

/// Keys of pictures on which vectors depend, too: the light of the environment, and whether surfaces have vectors of their own.
const ALSO_OF_VECTORS: [&str; 3] = ["rotation", "exposure", "self_shadow"];

/// Keys that differ from their defaults and that vectors do not depend on.
///
/// # Errors
/// `Runtime` if the settings cannot be written.
pub(super) fn idle(settings: &Settings) -> Result<Vec<String>> {
    let set = Settings::description().differences(settings, &Settings::default())?.into_iter().map(|set| set.key);
    let idle = set.filter(|key| key.decides == Decides::Picture && !ALSO_OF_VECTORS.contains(&key.name.as_str()));
    Ok(idle.map(|key| format!("fiv.{}", key.name)).collect())
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
        ALSO_OF_VECTORS.iter().for_each(|key| assert!(Settings::description().key(key).is_some(), "{key}"));
        let settings = Settings {
            turning: 3.0,
            azimuths: 9,
            rotation: 5.0,
            trilinear: !Settings::default().trilinear,
            ..Settings::default()
        };
        assert_eq!(idle(&settings).unwrap(), ["fiv.trilinear", "fiv.turning"]);
    }
}

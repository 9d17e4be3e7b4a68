//! The settings that a scene was prepared with, and the settings that its pictures may choose.

use super::{Method, Settings, Specular};
use crate::{
    Error, Result,
    settings::{Decides, Described},
};

/// The settings that a scene was prepared with.
#[derive(Clone, Debug)]
pub(super) struct PreparedSettings {
    /// As the caller gave them.
    given: Settings,
    /// As they are in effect, because a file of vectors decides some of them.
    made: Settings,
    /// Whether the spacing of some occluder's samples was computed with these settings.
    adapted: bool,
}

impl PreparedSettings {
    /// `computed`: the vectors of some occluders were not in a file and were computed.
    pub(super) fn new(given: &Settings, made: &Settings, computed: bool) -> Self {
        Self { given: given.clone(), made: made.clone(), adapted: made.adaptive && computed }
    }

    /// Whether pictures by `method` depend on the value of this key at preparation.
    fn decides(&self, key: &str, method: Method) -> bool {
        match key {
            "size" => true,
            // The adaptive spacing of samples depends on the interpolation.
            "interpolation" => method == Method::Vectors && self.adapted,
            "adaptive" => method == Method::Vectors,
            _ => matches!(method, Method::Vectors | Method::Online),
        }
    }

    /// The settings of a picture: its own choices, and the prepared values of all other keys.
    ///
    /// # Errors
    /// `Usage`, naming the key, if the picture asks for a value that the scene was not prepared for; as
    /// [`Settings::validate`].
    pub(super) fn picture(&self, asked: &Settings) -> Result<Settings> {
        asked.validate().map_err(|error| error.at("fiv"))?;
        let made = &self.made;
        if ![made.method, Method::Unshadowed].contains(&asked.method) {
            return self.refused("method", asked);
        }
        let shadowed = asked.method == Method::Vectors;
        if shadowed && asked.specular != Specular::Off && made.specular == Specular::Off {
            return self.refused("specular", asked);
        }
        if shadowed && asked.self_shadow && !made.self_shadow && made.on_surface() {
            return self.refused("self_shadow", asked);
        }
        let from_made = baked_differences(asked, made)?;
        if !from_made.is_empty() {
            let from_given = baked_differences(asked, &self.given)?;
            let wrong = |key: &&&str| from_given.contains(key) && self.decides(key, asked.method);
            if let Some(key) = from_made.iter().find(wrong) {
                return self.refused(key, asked);
            }
        }
        let mut taken = Settings::description().taking(made, asked, |key| key.decides == Decides::Picture)?;
        if !self.decides("interpolation", asked.method) {
            taken.interpolation = asked.interpolation;
        }
        taken.validate().map_err(|error| error.at("fiv"))?;
        Ok(taken)
    }

    fn refused(&self, key: &str, asked: &Settings) -> Result<Settings> {
        let value = |of: &Settings| serde_json::to_value(of).ok().and_then(|all| all.get(key).cloned());
        let say = |of: &Settings| value(of).unwrap_or_default();
        let what = format!("the picture asks for {}, the scene was prepared for {}", say(asked), say(&self.made));
        let error = Error::usage(what).at(format!("fiv.{key}"));
        Err(error.help("Give Fiv::new the same settings"))
    }
}

/// The keys in which two settings differ, without those that decide pictures alone.
fn baked_differences(a: &Settings, b: &Settings) -> Result<Vec<&'static str>> {
    let all = Settings::description().differences(a, b)?;
    Ok(all.iter().map(|d| d.key).filter(|key| key.decides == Decides::Bake).map(|key| key.name.as_str()).collect())
}

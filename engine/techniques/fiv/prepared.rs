//! The settings that a scene was prepared with, and the settings that its pictures may choose.

use serde_json::Value;

use super::{Method, Settings, Specular};
use crate::{Error, ErrorKind, Result};

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
        let (fixed, given) = (chosen(asked, made), chosen(&self.given, made));
        if fixed != *made && fixed != given {
            let other = differing(&fixed, &given)?;
            let wrong =
                differing(&fixed, made)?.into_iter().find(|key| other.contains(key) && self.decides(key, asked.method));
            if let Some(key) = wrong {
                return self.refused(&key, asked);
            }
        }
        let mut taken = chosen(made, asked);
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

/// `of` with the keys of `picture` that each picture may choose.
fn chosen(of: &Settings, picture: &Settings) -> Settings {
    Settings {
        trilinear: picture.trilinear,
        partial: picture.partial,
        cut: picture.cut,
        extent: picture.extent,
        overlap: picture.overlap,
        shared: picture.shared,
        negligible: picture.negligible,
        self_shadow: picture.self_shadow,
        specular: picture.specular,
        method: picture.method,
        rotation: picture.rotation,
        turning: picture.turning,
        exposure: picture.exposure,
        ..of.clone()
    }
}

/// The keys in which two settings differ.
fn differing(a: &Settings, b: &Settings) -> Result<Vec<String>> {
    let all = |of: &Settings| match serde_json::to_value(of) {
        Ok(Value::Object(all)) => Ok(all),
        Ok(_) => Err(Error::new(ErrorKind::Runtime, "settings are no table")),
        Err(error) => Err(Error::new(ErrorKind::Runtime, "settings cannot be written").caused_by(error)),
    };
    let (a, b) = (all(a)?, all(b)?);
    Ok(a.into_iter().filter(|(key, value)| b.get(key) != Some(value)).map(|(key, _)| key).collect())
}

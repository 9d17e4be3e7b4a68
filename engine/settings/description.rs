//! What is known of each key, read from the schema of a settings type.

use super::{Described, schema};
use crate::{Error, ErrorKind, Result};
use serde::Serialize;
use serde_json::{Map, Value};

/// What values a key has.
#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    /// `true` or `false`.
    Switch,
    /// A whole number.
    Whole,
    /// A number.
    Number,
    /// One of some words.
    Choice(Vec<Choice>),
    /// A time of day: hours and minutes, and seconds if wanted, `07:40` or `07:40:30`.
    Clock,
    /// Text of a form that the docs of the key give.
    Text,
}

/// A word that a key may be.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Choice {
    pub name: String,
    pub doc: String,
}

/// The numbers that are allowed.
#[derive(Clone, Debug, PartialEq)]
pub enum Allowed {
    /// All of the type.
    All,
    /// These.
    Listed(Vec<f64>),
    /// From `least` to `most`, both included.
    Range {
        least: f64,
        most: f64,
        /// Only multiples of this number.
        multiple_of: Option<f64>,
        /// 0 too.
        or_zero: bool,
    },
}

impl Allowed {
    /// Whether a number is allowed. NaN is not.
    pub fn contains(&self, value: f64) -> bool {
        match self {
            Self::All => true,
            Self::Listed(all) => all.contains(&value),
            Self::Range { least, most, multiple_of, or_zero } => {
                let inside = (*least..=*most).contains(&value) && multiple_of.is_none_or(|step| value % step == 0.0);
                inside || (*or_zero && value == 0.0)
            }
        }
    }
}

/// What depends on a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decides {
    /// What is computed beforehand, and so pictures.
    Bake,
    /// Pictures alone.
    Picture,
}

/// One key.
#[derive(Clone, Debug, PartialEq)]
pub struct Key {
    pub name: String,
    /// What it does, as paragraphs.
    pub doc: String,
    pub kind: Kind,
    /// The key may be left open, and something else then decides.
    pub optional: bool,
    pub default: Value,
    pub allowed: Allowed,
    /// Empty: the number has no unit.
    pub unit: String,
    pub decides: Decides,
    /// The key has a command line option of its own, under this heading.
    pub option: Option<String>,
    /// Conditions on other keys: key and schema that its value meets. Without them the key has no effect.
    pub needs: Vec<(String, Value)>,
}

/// A key that is not at its default and has no effect.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Idle {
    pub key: String,
    /// The condition that is not met, with the value found: `partial is false`.
    pub because: String,
}

/// A key in which two settings differ.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference<'a> {
    pub key: &'a Key,
    pub first: Value,
    pub second: Value,
}

/// The keys of a settings type, in the order of its fields.
#[derive(Clone, Debug)]
pub struct Description {
    /// What the settings are for.
    pub doc: String,
    pub keys: Vec<Key>,
    pub(super) schema: Value,
}

impl Description {
    /// Reads the description of a type.
    ///
    /// # Panics
    /// If the type is no struct of described fields, which the tests of its module show.
    pub fn of<S: Described>() -> Self {
        schema::read::<S>()
    }

    /// A description of keys that are known at run time alone. It has no schema.
    pub fn of_keys(doc: String, keys: Vec<Key>) -> Self {
        Self { doc, keys, schema: Value::Null }
    }

    /// The key of this name.
    pub fn key(&self, name: &str) -> Option<&Key> {
        self.keys.iter().find(|key| key.name == name)
    }

    /// Checks each number against its range.
    ///
    /// # Errors
    /// `Usage` for the first that is not allowed, naming the key, the value found and the values allowed.
    pub fn check<S: Serialize>(&self, settings: &S) -> Result<()> {
        let values = schema::values(settings)?;
        for key in &self.keys {
            let found = values.get(&key.name).unwrap_or(&Value::Null);
            let good = match found {
                // An open key; for JSON also a number that is not finite.
                Value::Null => key.optional,
                Value::Number(number) => number.as_f64().is_some_and(|number| key.allowed.contains(number)),
                _ => true,
            };
            if !good {
                let found = found.as_f64().map_or_else(|| "NaN or infinity".to_owned(), |found| found.to_string());
                let what = format!("{found} is not allowed; allowed: {}", key.allowed);
                return Err(Error::usage(what).at(&key.name));
            }
        }
        Ok(())
    }

    /// The keys that are not at their defaults and have no effect.
    ///
    /// # Errors
    /// `Runtime` if the settings cannot be written.
    pub fn idle<S: Serialize>(&self, settings: &S) -> Result<Vec<Idle>> {
        let values = schema::values(settings)?;
        let changed = self.keys.iter().filter(|key| values.get(&key.name) != Some(&key.default));
        let idle = changed.filter_map(|key| Some(Idle { key: key.name.clone(), because: self.missing(key, &values)? }));
        Ok(idle.collect())
    }

    /// The first condition of a key that is not met, with the value found: the reason why the key has no effect. That of a key which it needs comes
    /// before it. `values`: those of all keys.
    pub fn missing(&self, key: &Key, values: &Map<String, Value>) -> Option<String> {
        key.needs.iter().find_map(|(name, condition)| {
            let deeper = self.key(name).and_then(|needed| self.missing(needed, values));
            deeper.or_else(|| {
                let value = values.get(name).unwrap_or(&Value::Null);
                (!schema::meets(value, condition)).then(|| format!("{name} is {}", plain(value)))
            })
        })
    }

    /// The keys in which two settings differ.
    ///
    /// # Errors
    /// `Runtime` if the settings cannot be written.
    pub fn differences<S: Serialize>(&self, first: &S, second: &S) -> Result<Vec<Difference<'_>>> {
        let (mut first, mut second) = (schema::values(first)?, schema::values(second)?);
        let mut take = |key| (first.remove(key).unwrap_or_default(), second.remove(key).unwrap_or_default());
        let all = self.keys.iter().map(|key| {
            let (first, second) = take(&key.name);
            Difference { key, first, second }
        });
        Ok(all.filter(|difference| difference.first != difference.second).collect())
    }

    /// `to` with the values of `from` for the keys that `which` says.
    ///
    /// # Errors
    /// `Runtime` if the settings cannot be written and read.
    pub fn taking<S>(&self, to: &S, from: &S, which: impl Fn(&Key) -> bool) -> Result<S>
    where
        S: Serialize + serde::de::DeserializeOwned,
    {
        let (mut to, mut from) = (schema::values(to)?, schema::values(from)?);
        for key in self.keys.iter().filter(|key| which(key)) {
            to.insert(key.name.clone(), from.remove(&key.name).unwrap_or_default());
        }
        serde_json::from_value(Value::Object(to))
            .map_err(|error| Error::new(ErrorKind::Runtime, "settings cannot be read back").caused_by(error))
    }

    /// The JSON schema (draft 2020-12) of the settings, with `x-unit`, `x-decides`, `x-needs`, `x-option`, `x-kind` and `x-zero`.
    pub fn schema(&self) -> &Value {
        &self.schema
    }
}

/// A value as a person writes it.
pub(super) fn plain(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Null => "open".to_owned(),
        other => other.to_string(),
    }
}

//! From the schema of a type to its [`Description`].

use super::{Allowed, Choice, Decides, Described, Description, Key, Kind};
use crate::{Error, ErrorKind, Result};
use schemars::generate::SchemaSettings;
use serde::{
    Serialize,
    de::{IgnoredAny, MapAccess, Visitor},
};
use serde_json::{Map, Value};

pub(super) fn read<S: Described>() -> Description {
    let settings = SchemaSettings::draft2020_12().with(|settings| settings.inline_subschemas = true);
    let mut schema = settings.into_generator().into_root_schema_for::<S>().to_value();
    let default = S::default();
    let values = values(&default).expect("settings are written as JSON");
    let doc = text(&schema, "description");
    let fields = schema["properties"].as_object_mut().expect("settings are a struct");
    // A default as JSON has all digits of an f64; the shortest number that is the same f32 is what a person would write.
    for (name, field) in fields.iter_mut() {
        field["default"] = values.get(name).cloned().unwrap_or_default();
    }
    let keys = order(&default).into_iter().map(|name| key(&fields[&name], name)).collect();
    Description { doc, keys, schema }
}

fn key(field: &Value, name: String) -> Key {
    let optional = has_null(field);
    // The schema of an optional word is that of the word or null.
    let inner = field["anyOf"].as_array().and_then(|any| any.iter().find(|one| one["type"] != "null")).unwrap_or(field);
    let needs = field["x-needs"].as_object().into_iter().flatten();
    let decides = if field["x-decides"] == "bake" { Decides::Bake } else { Decides::Picture };
    Key {
        doc: text(field, "description"),
        kind: kind(inner),
        optional,
        default: field["default"].clone(),
        allowed: allowed(field),
        unit: text(field, "x-unit"),
        option: field["x-option"].as_str().map(str::to_owned),
        decides,
        needs: needs.map(|(key, condition)| (key.clone(), condition.clone())).collect(),
        name,
    }
}

fn has_null(field: &Value) -> bool {
    let listed = |all: &Value, what: &dyn Fn(&Value) -> bool| all.as_array().is_some_and(|all| all.iter().any(what));
    listed(&field["type"], &|one| one == "null") || listed(&field["anyOf"], &|one| one["type"] == "null")
}

fn kind(field: &Value) -> Kind {
    if let Some(all) = field["oneOf"].as_array() {
        return Kind::Choice(all.iter().flat_map(choices).collect());
    }
    if field["type"] == "string" && field["enum"].is_array() {
        return Kind::Choice(choices(field));
    }
    if field["x-kind"] == "clock" {
        return Kind::Clock;
    }
    let types = [field["type"].as_str()].into_iter().flatten();
    let types = types.chain(field["type"].as_array().into_iter().flatten().filter_map(Value::as_str));
    let mut kinds = types.filter_map(|name| match name {
        "boolean" => Some(Kind::Switch),
        "integer" => Some(Kind::Whole),
        "number" => Some(Kind::Number),
        _ => None,
    });
    kinds.next().unwrap_or(Kind::Text)
}

/// The words of one branch: a documented one, or all that have no docs.
fn choices(branch: &Value) -> Vec<Choice> {
    let doc = text(branch, "description");
    let one = branch["const"].as_str().into_iter();
    let all = one.chain(branch["enum"].as_array().into_iter().flatten().filter_map(Value::as_str));
    all.map(|name| Choice { name: name.to_owned(), doc: doc.clone() }).collect()
}

fn allowed(field: &Value) -> Allowed {
    let numbers = field["enum"].as_array().map(|all| all.iter().filter_map(Value::as_f64).collect::<Vec<_>>());
    if let Some(listed) = numbers.filter(|all| !all.is_empty()) {
        return Allowed::Listed(listed);
    }
    match (field["minimum"].as_f64(), field["maximum"].as_f64()) {
        (Some(least), Some(most)) => {
            let or_zero = field["x-zero"] == true;
            Allowed::Range { least, most, multiple_of: field["multipleOf"].as_f64(), or_zero }
        }
        _ => Allowed::All,
    }
}

fn text(of: &Value, name: &str) -> String {
    of[name].as_str().unwrap_or_default().to_owned()
}

/// Whether a value meets a condition: a schema of `const`, `enum`, `minimum`, `exclusiveMinimum` and `not`.
pub(super) fn meets(value: &Value, condition: &Value) -> bool {
    let number = value.as_f64().unwrap_or(f64::NAN);
    let rules = condition.as_object().into_iter().flatten();
    rules.into_iter().all(|(rule, with)| match rule.as_str() {
        "const" => value == with,
        "enum" => with.as_array().is_some_and(|all| all.contains(value)),
        "minimum" => with.as_f64().is_some_and(|least| number >= least),
        "exclusiveMinimum" => with.as_f64().is_some_and(|least| number > least),
        "not" => !meets(value, with),
        // The tests of each type's module refuse another one.
        _ => false,
    })
}

/// The settings as JSON, with the shortest numbers that read back as the same f32.
///
/// # Errors
/// `Runtime` if they cannot be written.
pub(super) fn values<S: Serialize>(settings: &S) -> Result<Map<String, Value>> {
    let written = serde_json::to_string(settings).and_then(|text| serde_json::from_str(&text));
    written.map_err(|error| Error::new(ErrorKind::Runtime, "settings are not JSON").caused_by(error))
}

/// Names of the fields in their order, which a map of JSON does not keep.
fn order<S: Serialize>(settings: &S) -> Vec<String> {
    struct Names;
    impl<'de> Visitor<'de> for Names {
        type Value = Vec<String>;

        fn expecting(&self, to: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            to.write_str("a struct")
        }

        fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
            let mut names = Vec::new();
            while let Some((name, IgnoredAny)) = map.next_entry()? {
                names.push(name);
            }
            Ok(names)
        }
    }
    let text = serde_json::to_string(settings).expect("settings are written as JSON");
    let mut reader = serde_json::Deserializer::from_str(&text);
    serde::Deserializer::deserialize_map(&mut reader, Names).expect("settings are a struct")
}

use super::*;
use serde::{Deserialize, Serialize};
use serde_json::json;

/// How rays are traced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum Rays {
    /// Through trees.
    #[default]
    Trees,
    /// By the device.
    ByDevice,
}

const MOST: u32 = 96;

/// Of a test.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
struct Settings {
    /// Lights at most.
    ///
    /// A second paragraph,
    /// over two lines.
    #[schemars(range(min = 1, max = MOST), extend("multipleOf" = 8, "x-unit" = "lights", "x-decides" = "bake"))]
    vpls: u32,
    #[schemars(range(min = 0.002, max = 0.2), extend("x-zero" = true))]
    bound: f32,
    on: bool,
    #[schemars(extend("x-needs" = {"on": {"const": true}}))]
    rays: Rays,
    other: Option<Rays>,
    #[schemars(range(min = 0, max = 10), extend("x-needs" = {"rays": {"const": "by-device"}}))]
    limit: Option<f32>,
    #[schemars(extend("enum" = [24, 48]))]
    a_number: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Self { vpls: 8, bound: 0.1, on: false, rays: Rays::Trees, other: None, limit: None, a_number: 24 }
    }
}

described!(Settings);

fn description() -> &'static Description {
    Settings::description()
}

#[test]
fn keys_are_those_of_the_type_in_its_order() {
    let names: Vec<_> = description().keys.iter().map(|key| key.name.as_str()).collect();
    assert_eq!(names, ["vpls", "bound", "on", "rays", "other", "limit", "a_number"]);
    let key = |name| description().key(name).unwrap();
    let vpls = key("vpls");
    assert_eq!((vpls.kind.clone(), vpls.decides, vpls.unit.as_str()), (Kind::Whole, Decides::Bake, "lights"));
    assert_eq!(vpls.doc, "Lights at most.\n\nA second paragraph,\nover two lines.");
    assert_eq!(vpls.allowed, Allowed::Range { least: 1.0, most: 96.0, multiple_of: Some(8.0), or_zero: false });
    // The shortest number that is the same f32.
    assert_eq!(key("bound").default, json!(0.1));
    assert_eq!(key("a_number").allowed, Allowed::Listed(vec![24.0, 48.0]));
    assert!(key("other").optional && key("limit").optional && !key("rays").optional);
    for name in ["rays", "other"] {
        let Kind::Choice(choices) = &key(name).kind else { panic!("{:?}", key(name)) };
        let words: Vec<_> = choices.iter().map(|choice| (choice.name.as_str(), choice.doc.as_str())).collect();
        assert_eq!(words, [("trees", "Through trees."), ("by-device", "By the device.")]);
    }
    assert_eq!((&key("limit").kind, &key("on").kind), (&Kind::Number, &Kind::Switch));
    assert_eq!(key("bound").decides, Decides::Picture);
}

#[test]
fn numbers_out_of_range_are_refused_with_what_is_allowed() {
    let check = |settings: Settings| description().check(&settings);
    let good = Settings::default();
    check(good.clone()).unwrap();
    for bound in [0.0, 0.002, 0.2] {
        check(Settings { bound, ..good.clone() }).unwrap();
    }
    for (wrong, text) in [
        (Settings { vpls: 0, ..good.clone() }, "vpls: 0 is not allowed; allowed: multiples of 8 from 1 to 96"),
        (Settings { vpls: 9, ..good.clone() }, "vpls: 9 is not allowed; allowed: multiples of 8 from 1 to 96"),
        (Settings { vpls: 104, ..good.clone() }, "vpls: 104 is not allowed; allowed: multiples of 8 from 1 to 96"),
        (Settings { bound: 0.001, ..good.clone() }, "bound: 0.001 is not allowed; allowed: 0, or 0.002 to 0.2"),
        (
            Settings { bound: f32::NAN, ..good.clone() },
            "bound: NaN or infinity is not allowed; allowed: 0, or 0.002 to 0.2",
        ),
        (Settings { limit: Some(-1.0), ..good.clone() }, "limit: -1 is not allowed; allowed: 0 to 10"),
        (Settings { a_number: 25, ..good.clone() }, "a_number: 25 is not allowed; allowed: 24, 48"),
    ] {
        let error = check(wrong).unwrap_err();
        assert_eq!((error.to_string().as_str(), error.exit_code()), (text, 2));
    }
}

#[test]
fn a_key_without_effect_names_the_first_condition_that_is_missing() {
    let idle = |settings: Settings| {
        let idle = description().idle(&settings).unwrap();
        idle.into_iter().map(|idle| (idle.key, idle.because)).collect::<Vec<_>>()
    };
    let good = Settings::default();
    assert_eq!(idle(good.clone()), []);
    let rays = Settings { rays: Rays::ByDevice, ..good.clone() };
    assert_eq!(idle(rays.clone()), [("rays".to_owned(), "on is false".to_owned())]);
    assert_eq!(idle(Settings { on: true, ..rays.clone() }), []);
    let limit = Settings { limit: Some(1.0), ..good };
    // What the needed key needs itself comes first.
    assert_eq!(idle(limit.clone()), [("limit".to_owned(), "on is false".to_owned())]);
    assert_eq!(idle(Settings { on: true, ..limit }), [("limit".to_owned(), "rays is trees".to_owned())]);
}

#[test]
fn differences_and_choices_of_another() {
    let (a, b) = (Settings::default(), Settings { vpls: 16, bound: 0.0, ..Settings::default() });
    let names: Vec<_> = description().differences(&a, &b).unwrap().iter().map(|d| d.key.name.clone()).collect();
    assert_eq!(names, ["vpls", "bound"]);
    let taken = description().taking(&a, &b, |key| key.decides == Decides::Picture).unwrap();
    assert_eq!(taken, Settings { bound: 0.0, ..a });
}

#[test]
fn comments_say_what_keys_do() {
    let comment = |name| description().key(name).unwrap().comment();
    let vpls = [
        "# Lights at most.",
        "# A second paragraph, over two lines.",
        "# Allowed: multiples of 8 from 1 to 96 lights.",
    ];
    assert_eq!(comment("vpls"), vpls);
    // A field without docs of its own has those of its type.
    let rays = [
        "# How rays are traced.",
        "# trees: Through trees.",
        "# by-device: By the device.",
        "# Allowed: trees, by-device.",
        "# Needs on = true.",
    ];
    assert_eq!(comment("rays")[..], rays[..]);
}

#[test]
fn every_key_of_the_techniques_is_described() {
    for (technique, description) in crate::techniques::descriptions() {
        for key in &description.keys {
            let text = format!("{technique}.{}", key.name);
            assert!(!key.doc.is_empty(), "{text} has no docs");
            if let Kind::Choice(all) = &key.kind {
                assert!(all.len() > 1 && all.iter().all(|choice| !choice.doc.is_empty()), "{text}: {all:?}");
            }
            let number = matches!(key.kind, Kind::Whole | Kind::Number);
            assert_eq!(key.allowed != Allowed::All, number, "{text} has no range");
            let default = key.default.as_f64();
            assert!(default.is_none_or(|default| key.allowed.contains(default)), "{text}: {:?}", key.default);
            for (needed, condition) in &key.needs {
                let other = description.key(needed).unwrap_or_else(|| panic!("{text} needs {needed}, which is no key"));
                let rules = condition.as_object().unwrap();
                let known = ["const", "enum", "minimum", "exclusiveMinimum", "not"];
                assert!(rules.keys().all(|rule| known.contains(&rule.as_str())), "{text}: {condition}");
                // Words of conditions are words of the key.
                if let Kind::Choice(all) = &other.kind {
                    let words = rules.values().flat_map(|with| match with {
                        serde_json::Value::Array(all) => all.clone(),
                        serde_json::Value::Object(not) => not.values().cloned().collect(),
                        one => vec![one.clone()],
                    });
                    for word in words {
                        assert!(all.iter().any(|choice| word == choice.name.as_str()), "{text}: {condition}");
                    }
                }
            }
        }
    }
}

#[test]
fn the_table_has_a_row_a_key() {
    let table = description().table();
    assert_eq!(table.lines().count(), 2 + description().keys.len());
    let row = "| `limit` | 0 to 10 | open | Needs rays = by-device. |";
    assert!(table.lines().any(|line| line == row), "{table}");
}

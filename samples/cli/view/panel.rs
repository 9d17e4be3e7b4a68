//! The panel of all settings of a technique, made from their descriptions.

use std::collections::BTreeMap;

use egui::{Color32, RichText, Ui};
use lucerna::{
    effects::Pipeline,
    settings::{Allowed, Description, Key, Kind},
    techniques,
};
use serde_json::{Map, Value, json};

use super::fields;
use crate::effects;

/// The descriptions of all groups of settings by their names.
#[derive(Debug)]
pub struct Descriptions {
    known: BTreeMap<&'static str, &'static Description>,
    /// Of the constants of a pipeline, with its digest.
    effects: Option<(String, Description)>,
}

impl Default for Descriptions {
    fn default() -> Self {
        Self { known: techniques::descriptions().into_iter().collect(), effects: None }
    }
}

impl Descriptions {
    /// Describes the constants of a pipeline.
    pub fn of_effects(&mut self, pipeline: &Pipeline) {
        if self.effects.as_ref().is_none_or(|(digest, _)| digest != pipeline.digest()) {
            self.effects = Some((pipeline.digest().to_owned(), pipeline.description()));
        }
    }

    fn of(&self, group: &str) -> Option<&Description> {
        let effects = || self.effects.as_ref().filter(|_| group == effects::GROUP).map(|(_, description)| description);
        self.known.get(group).copied().or_else(effects)
    }
}

/// Shows all settings of a tree with groups. `defaults`: the tree of the technique's defaults. True: a setting changed.
pub fn show(ui: &mut Ui, descriptions: &Descriptions, tree: &mut Value, defaults: &Value) -> bool {
    let Value::Object(groups) = tree else { return false };
    let mut changed = false;
    for (name, group) in groups.iter_mut() {
        let default = defaults.get(name).unwrap_or(&Value::Null);
        match (group, descriptions.of(name)) {
            (Value::Object(values), Some(description)) => {
                let differs =
                    values.iter().any(|(key, value)| default.get(key).is_some_and(|default| default != value));
                let title = if differs { RichText::new(format!("{name} •")) } else { RichText::new(name.as_str()) };
                egui::CollapsingHeader::new(title)
                    .id_salt(name)
                    .default_open(techniques::NAMES.contains(&name.as_str()) || name == effects::GROUP)
                    .show(ui, |ui| {
                        for key in &description.keys {
                            let unmet = description.missing(key, values);
                            if let Some(value) = values.get_mut(&key.name) {
                                let default = default.get(&key.name).unwrap_or(&key.default);
                                changed |= row(ui, key, value, default, unmet);
                            }
                        }
                    });
            }
            (value, _) if !value.is_object() => changed |= plain(ui, name, value, default),
            _ => (),
        }
    }
    changed
}

/// One setting: name, value, way back to the default. `unmet`: why it has no effect.
fn row(ui: &mut Ui, key: &Key, value: &mut Value, default: &Value, unmet: Option<String>) -> bool {
    let before = value.clone();
    ui.horizontal(|ui| {
        let weak = unmet.is_some();
        let name =
            if weak { RichText::new(&key.name).color(Color32::from_gray(110)) } else { RichText::new(&key.name) };
        let label = ui.add(egui::Label::new(name).selectable(false).truncate());
        label.on_hover_text(help(key, unmet.as_deref()));
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            let differs = value != default;
            let back = ui.add_visible(differs, egui::Button::new("⟲").small().frame(false));
            if back.on_hover_text(format!("Back to the default: {}", shown(default))).clicked() {
                *value = default.clone();
            }
            ui.add_enabled_ui(!weak, |ui| edit(ui, key, value));
        });
    });
    *value != before
}

/// What a person may know of a setting.
fn help(key: &Key, unmet: Option<&str>) -> String {
    let mut text = key.doc.clone();
    if !key.unit.is_empty() {
        text += &format!("\n\nUnit: {}", key.unit);
    }
    if matches!(key.kind, Kind::Whole | Kind::Number) {
        text += &format!("\n\nAllowed: {}", key.allowed);
    }
    text += &format!("\nDefault: {}", shown(&key.default));
    if let Some(unmet) = unmet {
        text += &format!("\n\nNo effect, because {unmet}");
    }
    text
}

fn shown(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Null => "open".into(),
        other => other.to_string(),
    }
}

fn edit(ui: &mut Ui, key: &Key, value: &mut Value) {
    // With a default there is nothing to leave open.
    if key.optional && key.default.is_null() {
        let mut given = !value.is_null();
        if ui.checkbox(&mut given, "").on_hover_text("Given; without it, the program decides").changed() {
            *value = if given { first(key) } else { Value::Null };
        }
        if value.is_null() {
            ui.weak("open");
            return;
        }
    }
    if let Value::Array(numbers) = value {
        let (least, most) = match &key.allowed {
            Allowed::Range { least, most, .. } => (*least, *most),
            _ => (f64::from(f32::MIN), f64::from(f32::MAX)),
        };
        for number in numbers.iter_mut().rev() {
            let mut now = number.as_f64().unwrap_or_default();
            if ui.add(egui::DragValue::new(&mut now).speed(0.01).range(least..=most)).changed() {
                *number = (now as f32).to_string().parse().map_or(Value::Null, |n: f64| json!(n));
            }
        }
        return;
    }
    match &key.kind {
        Kind::Switch => {
            let mut on = value.as_bool().unwrap_or_default();
            if ui.checkbox(&mut on, "").changed() {
                *value = json!(on);
            }
        }
        Kind::Choice(choices) => {
            let now = value.as_str().unwrap_or_default().to_owned();
            egui::ComboBox::from_id_salt(&key.name).selected_text(&now).width(110.0).show_ui(ui, |ui| {
                for choice in choices {
                    if ui.selectable_label(now == choice.name, &choice.name).on_hover_text(&choice.doc).clicked() {
                        *value = json!(choice.name);
                    }
                }
            });
        }
        Kind::Whole | Kind::Number => number(ui, key, value),
        Kind::Clock | Kind::Text => {
            let field = if key.kind == Kind::Clock { fields::clock } else { fields::text };
            if let Some(text) = field(ui, &key.name, &shown(value)) {
                *value = json!(text);
            }
        }
    }
}

/// The first value of a setting that was open.
fn first(key: &Key) -> Value {
    match (&key.kind, &key.allowed) {
        (Kind::Choice(choices), _) => choices.first().map_or(Value::Null, |choice| json!(choice.name)),
        (Kind::Switch, _) => json!(false),
        (Kind::Clock, _) => json!("12:00"),
        (Kind::Text, _) => json!(""),
        (Kind::Whole, Allowed::Range { least, .. }) => json!(*least as i64),
        (Kind::Whole, Allowed::Listed(all)) => json!(all.first().copied().unwrap_or(0.0) as i64),
        (Kind::Whole, Allowed::All) => json!(0),
        (Kind::Number, Allowed::Range { least, most, .. }) => json!(1f64.clamp(*least, *most)),
        (Kind::Number, Allowed::Listed(all)) => json!(all.first().copied().unwrap_or(0.0)),
        (Kind::Number, Allowed::All) => json!(0.0),
    }
}

fn number(ui: &mut Ui, key: &Key, value: &mut Value) {
    let whole = key.kind == Kind::Whole;
    let before = value.as_f64().unwrap_or_default();
    let mut now = before;
    match &key.allowed {
        Allowed::Listed(all) => {
            egui::ComboBox::from_id_salt(&key.name).selected_text(shown(value)).width(70.0).show_ui(ui, |ui| {
                for one in all {
                    ui.selectable_value(&mut now, *one, one.to_string());
                }
            });
        }
        allowed => {
            let mut field = egui::DragValue::new(&mut now).max_decimals(if whole { 0 } else { 6 });
            field = field.speed(if whole { 0.2 } else { (before.abs() * 0.01).max(0.001) });
            if let Allowed::Range { least, most, or_zero, .. } = allowed {
                let least = if *or_zero { least.min(0.0) } else { *least };
                field = field.range(least..=*most).clamp_existing_to_range(false);
            }
            if !key.unit.is_empty() {
                field = field.suffix(format!(" {}", key.unit));
            }
            ui.add(field);
            if now != before
                && let Allowed::Range { least, most, multiple_of, or_zero } = allowed
            {
                now = nearest((before, now), (*least, *most), *multiple_of, *or_zero);
            }
        }
    }
    if now != before {
        // Settings are 32-bit numbers. The shortest decimal of one is what a person would write.
        *value = if whole {
            json!(now.round() as i64)
        } else {
            (now as f32).to_string().parse().map_or(Value::Null, |n: f64| json!(n))
        };
    }
}

/// The allowed value towards which a person has moved another one.
fn nearest((before, now): (f64, f64), (least, most): (f64, f64), step: Option<f64>, or_zero: bool) -> f64 {
    if or_zero && now < least {
        return if now < before || now <= 0.0 { 0.0 } else { least };
    }
    let Some(step) = step else { return now.clamp(least, most) };
    // Towards the value that the person aims at, and never back to the one before.
    let steps = if now > before { (now / step).ceil() } else { (now / step).floor() };
    (steps * step).clamp((least / step).ceil() * step, (most / step).floor() * step)
}

/// A value without description: a number, a list of numbers, a word.
fn plain(ui: &mut Ui, name: &str, value: &mut Value, default: &Value) -> bool {
    let before = value.clone();
    ui.horizontal(|ui| {
        ui.add(egui::Label::new(name).selectable(false));
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            if ui.add_visible(&*value != default, egui::Button::new("⟲").small().frame(false)).clicked() {
                *value = default.clone();
            }
            match value {
                Value::Array(numbers) => {
                    for number in numbers.iter_mut().rev() {
                        let mut now = number.as_f64().unwrap_or_default();
                        if ui.add(egui::DragValue::new(&mut now).speed(0.01).range(0.0..=1e6)).changed() {
                            *number = json!(now);
                        }
                    }
                }
                Value::Number(number) => {
                    let mut now = number.as_f64().unwrap_or_default();
                    let whole = number.is_u64();
                    let speed = if whole { 0.2 } else { 0.01 };
                    if ui.add(egui::DragValue::new(&mut now).speed(speed).range(0.0..=1e6)).changed() {
                        *value = if whole { json!(now.round() as u64) } else { json!(now) };
                    }
                }
                Value::Bool(on) => {
                    ui.checkbox(on, "");
                }
                _ => (),
            }
        });
    });
    *value != before
}

/// The settings in which a tree differs from another one, as `-D` has them: `isr.samples=80`.
pub fn changes(tree: &Value, defaults: &Value) -> Vec<String> {
    fn walk(prefix: &str, now: &Value, before: &Value, out: &mut Vec<String>) {
        let none = Map::new();
        match (now, before) {
            (Value::Object(now), before) => {
                let before = before.as_object().unwrap_or(&none);
                for (key, value) in now {
                    let name = if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") };
                    walk(&name, value, before.get(key).unwrap_or(&Value::Null), out);
                }
            }
            (now, before) if now == before || now.is_null() => (),
            (Value::String(text), _) => out.push(format!("{prefix}={text}")),
            (now, _) => out.push(format!("{prefix}={now}")),
        }
    }
    let mut out = Vec::new();
    walk("", tree, defaults, &mut out);
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{config::effective, view::live::about};
    use lucerna::techniques::isr::PictureSettings;

    #[test]
    fn every_setting_of_every_technique_has_a_description() {
        let descriptions = Descriptions::default();
        for name in techniques::NAMES {
            let Value::Object(groups) = about(name).unwrap().settings else { panic!("{name}") };
            for (group, values) in groups.iter().filter(|(_, values)| values.is_object()) {
                let known = descriptions.of(group.as_str()).unwrap_or_else(|| panic!("{name}: {group}"));
                for key in values.as_object().unwrap().keys() {
                    assert!(known.key(key).is_some(), "{name}: {group}.{key}");
                }
            }
        }
    }

    #[test]
    fn changes_read_back_as_the_same_settings() {
        let defaults = about("isr").unwrap().settings;
        assert!(changes(&defaults, &defaults).is_empty());
        let mut tree = defaults.clone();
        tree["isr"]["samples"] = json!(24);
        tree["isr"]["k_isr"] = json!(0.7);
        tree["gbuffer"]["mips"] = json!(false);
        tree["background"] = json!([0.5, 0.25, 1.0]);
        let list = changes(&tree, &defaults);
        assert_eq!(list.len(), 4, "{list:?}");
        let read: PictureSettings = effective(&PictureSettings::default(), None, &list).unwrap();
        let again = crate::config::to_value(&read).unwrap();
        for (group, values) in tree.as_object().unwrap() {
            assert_eq!(&again[group], values, "{group}");
        }
    }

    #[test]
    fn values_go_to_the_nearest_ones_that_are_allowed() {
        let step = |before, now| nearest((before, now), (8.0, 60.0), Some(8.0), false);
        assert_eq!([step(16.0, 17.0), step(16.0, 15.0), step(8.0, 1.0), step(56.0, 60.0)], [24.0, 8.0, 8.0, 56.0]);
        let zero = |before, now| nearest((before, now), (0.5, 4.0), None, true);
        assert_eq!([zero(0.5, 0.4), zero(0.0, 0.1), zero(1.0, 9.0), zero(0.0, -1.0)], [0.0, 0.5, 4.0, 0.0]);
    }

    #[test]
    fn optional_settings_have_no_other_default_than_open() {
        // A setting that is left open cannot be said on a command line.
        for (name, description) in techniques::descriptions() {
            for key in description.keys.iter().filter(|key| key.optional) {
                assert!(key.default.is_null(), "{name}.{}", key.name);
            }
        }
    }

    #[test]
    fn the_panel_shows_all_settings_without_changing_any() {
        let descriptions = Descriptions::default();
        for name in techniques::NAMES {
            let about = about(name).unwrap();
            let mut tree = about.settings.clone();
            let context = egui::Context::default();
            for _ in 0..3 {
                let mut changed = false;
                let _ = context.run(egui::RawInput::default(), |context| {
                    egui::CentralPanel::default()
                        .show(context, |ui| changed |= show(ui, &descriptions, &mut tree, &about.settings));
                });
                assert!(!changed && tree == about.settings, "{name}");
            }
        }
    }
}

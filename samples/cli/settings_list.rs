//! `lucerna settings`: every key of the techniques, with what it does, its values, its default and what it needs.

use clap::ValueEnum;
use lucerna::{
    Result,
    settings::{Description, Key},
    techniques::descriptions,
};
use serde_json::Value;

use crate::console;

/// How the list is written.
#[derive(ValueEnum, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Form {
    /// TOML with comments, as files for --settings have it
    #[default]
    Toml,
    /// JSON schema (draft 2020-12), with x-unit, x-decides and x-needs
    Json,
    /// Tables in Markdown
    Markdown,
}

/// Prints the settings of one technique, or of all.
///
/// # Errors
/// `Runtime` if standard output cannot be written.
pub fn print(technique: Option<&str>, form: Form) -> Result<()> {
    let asked: Vec<_> =
        descriptions().into_iter().filter(|(name, _)| technique.is_none_or(|asked| asked == *name)).collect();
    let text = match form {
        Form::Toml => asked.iter().map(|(name, description)| toml(name, description)).collect::<Vec<_>>().join("\n"),
        Form::Json => json(&asked, technique.is_some()),
        Form::Markdown => markdown(&asked),
    };
    console::print(text.trim_end())
}

/// Names of the techniques that have settings.
pub fn names() -> Vec<&'static str> {
    descriptions().into_iter().map(|(name, _)| name).collect()
}

fn toml(name: &str, description: &Description) -> String {
    let line = |key: &Key| match &key.default {
        Value::Null => format!("# {} =", key.name),
        value => format!("{} = {value}", key.name),
    };
    let keys = description.keys.iter().map(|key| format!("{}\n{}\n", key.comment().join("\n"), line(key)));
    format!("[{name}]\n{}", keys.collect::<Vec<_>>().join("\n"))
}

fn json(all: &[(&str, &Description)], alone: bool) -> String {
    let value = match all {
        [(_, only)] if alone => only.schema().clone(),
        all => all.iter().map(|(name, description)| ((*name).to_owned(), description.schema().clone())).collect(),
    };
    format!("{value:#}")
}

/// The tables as they stand in docs/settings.md.
pub fn markdown(all: &[(&str, &Description)]) -> String {
    let part = |(name, description): &(&str, &Description)| format!("## `{name}`\n\n{}", description.table());
    all.iter().map(part).collect::<Vec<_>>().join("\n")
}

/// Puts comments with the docs of the keys into settings as [`config::to_toml`](crate::config::to_toml) writes them.
pub fn with_docs(toml: &str) -> String {
    let mut group = None;
    let mut out = String::new();
    for line in toml.lines() {
        if let Some(name) = line.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
            group = descriptions()
                .into_iter()
                .find(|(technique, _)| *technique == name)
                .map(|(_, description)| description);
        }
        let key = line.split_once(" = ").and_then(|(name, _)| group?.key(name));
        if let Some(key) = key {
            out.push('\n');
            key.comment().iter().for_each(|line| out.push_str(&format!("{line}\n")));
        }
        out.push_str(line);
        out.push('\n');
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config;
    use lucerna::techniques::igi::PictureSettings;

    #[test]
    fn comments_leave_settings_as_they_are() {
        let plain = config::to_toml(&PictureSettings::default()).unwrap();
        let text = with_docs(&plain);
        assert_eq!(plain.parse::<toml::Table>().unwrap(), text.parse::<toml::Table>().unwrap());
        assert!(text.contains("# Allowed: 1 to 8.\n# Needs indirect = true.\nbounces = 4\n"), "{text}");
    }

    #[test]
    fn the_list_is_the_defaults() {
        for (name, description) in descriptions() {
            let text = toml(name, description);
            let table = text.parse::<toml::Table>().unwrap();
            assert_eq!(
                table[name].as_table().unwrap().len(),
                description.keys.iter().filter(|k| !k.default.is_null()).count()
            );
        }
    }

    #[test]
    fn the_pages_of_the_techniques_have_the_same_tables() {
        let pages = [
            ("isr", include_str!("../isr/README.md")),
            ("igi", include_str!("../igi/README.md")),
            ("fiv", include_str!("../fiv/README.md")),
            ("daylight", include_str!("../daylight/README.md")),
            ("prt", include_str!("../prt/README.md")),
            ("tonemap", include_str!("../tonemap/README.md")),
            ("reference", include_str!("../../docs/reference.md")),
        ];
        for (name, description) in descriptions() {
            let mark = format!("<!-- written by `lucerna settings {name} --form markdown` -->\n\n");
            let with: Vec<_> =
                pages.iter().filter_map(|(page, text)| Some((page, text.split_once(&mark)?.1))).collect();
            assert!(!with.is_empty(), "no page has the table of {name}");
            for (page, rest) in with {
                assert!(rest.starts_with(&description.table()), "the page of {page} has other keys of {name}");
            }
        }
        let without = pages.iter().find(|(page, text)| !text.contains(&format!("`lucerna settings {page} ")));
        assert!(without.is_none(), "{without:?}");
    }

    #[test]
    fn the_page_is_up_to_date() {
        let page = include_str!("../../docs/settings.md");
        let (_, tables) = page.split_once("<!-- written by `lucerna settings --form markdown` -->\n\n").unwrap();
        let wanted = markdown(&descriptions());
        assert!(tables == wanted, "docs/settings.md is not what `lucerna settings --form markdown` prints:\n{wanted}");
    }
}
